"""What an identified inertia is known to: linear propagation (GUM), Monte Carlo, and the budget of its inputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent_base.answer import Answer, Section, Table
from evolvent_base.errors import InputError
from evolvent_base.showing import Answered
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import BODY_NAMES, InertiaProblem, check_names, value_of
from evolvent_massprops.inertia.stand import MOMENTS


@dataclasses.dataclass(frozen=True)
class Budget(Answered):
    """What each input adds to the uncertainty of each output.

    Attributes
    ----------
    outputs : tuple of str
    value : (p,) float, of the outputs
    inputs : tuple of str
    sensitivity : (q, p) float, derivative of the outputs by the inputs; nan for a group
    contribution : (q, p) float, standard deviation that each input alone would give
    """

    outputs: tuple[str, ...]
    value: np.ndarray
    inputs: tuple[str, ...]
    sensitivity: np.ndarray
    contribution: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """(p,) float, of the outputs, all inputs together."""
        return np.sqrt(np.sum(self.contribution**2, axis=0))

    @property
    def share(self) -> np.ndarray:
        """(q, p) float, each input's part of the variance, in percent."""
        variance = np.sum(self.contribution**2, axis=0)
        return 100.0 * self.contribution**2 / np.where(variance > 0.0, variance, 1.0)

    def answer(self) -> Answer:
        """The contribution of each input, absolute and in percent of the value."""
        rows = [("value", *(f"{x:.6g}" for x in self.value))]
        rows += [
            (name, *(f"{x:.4g} {percent(x, v):.4f} %" for x, v in zip(row, self.value, strict=True)))
            for name, row in [*zip(self.inputs, self.contribution, strict=True), ("all", self.std)]
        ]
        sections = [Section(title="", blocks=[Table(heads=("", *self.outputs), rows=rows)])]
        return Answer(title="Uncertainty budget", sections=sections)


def percent(x: float, value: float) -> float:
    """100 x / |value|; nan for a value of zero."""
    return 100.0 * x / abs(value) if value else float("nan")


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A stiffness and two moments that give the three measured frequencies.

    Attributes
    ----------
    stiffness : float, N/m, mean of the springs
    Ixx, Izz : float, kg m2
    mac : float
        Least agreement of its three mode shapes with the measured ones, 0 to 1; nan where none were given.
    """

    stiffness: float
    Ixx: float
    Izz: float
    mac: float


@dataclasses.dataclass(frozen=True)
class Inertia:
    """Identified mass properties.

    Attributes
    ----------
    values : dict of str to float
        mass, ex, h, ez, Ixx, Iyy, Izz, Ixy, Ixz, Iyz (kg, m, kg m2; centre of mass from the stiffness centre of the
        attachment plane, tensor about the centre of mass, body axes), and what was identified of the stand.
    identified : tuple of str, names found from the data; all other values are assumed
    covariance : (p, p) float
        Of the identified values, from all that is known of the data and of the inputs; nan where nothing was given.
    method : str
    budget : Budget or None
    candidates : tuple of Candidate, of the way from three frequencies, best first
    misfit : float
        Root mean square of the residual in standard deviations of the data; nan where the data are just enough.
    warnings : tuple of str
    problem : InertiaProblem, what was solved
    """

    values: dict[str, float]
    identified: tuple[str, ...]
    covariance: np.ndarray
    method: str
    problem: InertiaProblem | Combined = dataclasses.field(repr=False)
    budget: Budget | None = dataclasses.field(default=None, repr=False)
    candidates: tuple[Candidate, ...] = ()
    misfit: float = float("nan")
    warnings: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the body's values that were not identified."""
        return tuple(name for name in BODY_NAMES if name not in self.identified)

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each identified value."""
        return dict(zip(self.identified, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def tensor(self) -> np.ndarray:
        """(3, 3) float, kg m2, about the centre of mass, body axes, assumed elements among it."""
        tensor = np.empty((3, 3))
        for name, (i, j) in MOMENTS.items():
            tensor[i, j] = tensor[j, i] = self.values[name]
        return tensor

    @property
    def centre(self) -> np.ndarray:
        """(3,) float, m, centre of mass from the stiffness centre of the attachment plane, body axes."""
        return np.array([self.values["ex"], -self.values["h"], self.values["ez"]])


#: Identified numbers beside the tensor, for files: name -> (name in `Inertia`, units, text).
_NUMBERS = {
    "mass": ("mass", "kg", "identified mass"),
    "offset_x": ("ex", "m", "identified offset of the centre of mass"),
    "offset_z": ("ez", "m", "identified offset of the centre of mass"),
    "height": ("h", "m", "identified height of the attachment plane"),
    "stiffness": ("stiffness", "N/m", "identified stiffness, mean of the springs"),
}


def inertia_variables(
    found: Inertia | None, more: Mapping[str, float] | None = None
) -> dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]:
    """Mass properties as variables, the tensor over "component": name -> (dimensions, values, units, text).

    Parameters
    ----------
    found : Inertia, or None where none was found; what was not identified is NaN
    more : mapping, further standard deviations by name
    """
    values = dict.fromkeys((*MOMENTS, *(own for own, _, _ in _NUMBERS.values())), np.nan)
    std = dict.fromkeys(MOMENTS, np.nan)
    if found is not None:
        values |= {name: found[name] for name in values if name in found.identified}
        deviations = {name: np.hypot(one, (more or {}).get(name, 0.0)) for name, one in found.std.items()}
        std |= {name: deviations[name] for name in std if name in deviations}
    over, moments = ("component",), np.array([values[name] for name in MOMENTS])
    data: dict[str, tuple[tuple[str, ...], np.ndarray, str, str]] = {
        "inertia_identified": (over, moments, "kg m2", "identified about the centre of mass, body axes"),
        "inertia_std": (over, np.array(list(std.values())), "kg m2", "standard deviation of the identified inertia"),
    }
    for name, (own, unit, text) in _NUMBERS.items():
        data[f"{name}_identified"] = ((), np.array(values[own]), unit, text)
    return data


def check_inputs(p: InertiaProblem | Combined, inputs: Mapping[str, float]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and standard deviations of inputs; refused where unknown, identified or negative."""
    names = check_names("inputs", tuple(inputs), p.base.points.shape[-2])
    for name in names:
        if name in p.unknown:
            raise InputError(f"inputs names {name!r}, which is identified and not an input")
        if not (np.isfinite(inputs[name]) and inputs[name] >= 0.0):
            raise InputError(f"the standard deviation of {name} is {inputs[name]!r}; it must be 0 or above")
    return names, np.array([float(inputs[name]) for name in names])


def with_budget(inertia: Inertia, inputs: Mapping[str, float]) -> Inertia:
    """The same inertia with the uncertainty of its inputs propagated.

    Parameters
    ----------
    inertia : Inertia
    inputs : mapping of str to float
        Standard deviation of known numbers: names as of `evolvent_massprops.inertia.problem.assign` (a, b, ex, ez, h,
        k1, ..., mass, Ixz, gravity, ...). Data with a given covariance stand in the budget by themselves.

    Notes
    -----
    At the least squares of the whitened residual r(p, x) an input shifts the unknowns by dp = -J^+ (dr/dx) dx, and the
    data's own noise gives J^+ J^+T, J = dr/dp: the law of propagation of uncertainty, GUM (2008), eq. 10 and 13.
    """
    p = inertia.problem
    if inputs and isinstance(p, Combined):
        raise InputError("several recordings in one estimate take the inputs of `evolvent_massprops`")
    names, std = check_inputs(p, inputs)
    at = np.array([inertia.values[name] for name in p.unknown])
    scale = p.scale
    P = scale[:, None] * np.linalg.pinv(p.jacobian(at) * scale)
    sensitivity = -(P @ p.jacobian(at, names)).T if names and isinstance(p, InertiaProblem) else np.zeros((0, len(at)))
    rows = [sensitivity * std[:, None]]
    groups = {label: P[:, of] for label, of in p.groups.items() if p.weighted or label == "priors"}
    covariance = rows[0].T @ rows[0]
    labels = list(names)
    for label, part in groups.items():
        if part.shape[1]:
            covariance = covariance + part @ part.T
            labels.append(label)
            rows.append(np.sqrt(np.sum(part**2, axis=1))[None])
    if len(labels) == 0:
        return dataclasses.replace(inertia, covariance=np.full((len(at), len(at)), np.nan))
    blank = len(labels) - len(names)
    budget = Budget(
        outputs=p.unknown,
        value=at,
        inputs=tuple(labels),
        sensitivity=np.concatenate([sensitivity, np.full((blank, len(at)), np.nan)]),
        contribution=np.abs(np.concatenate(rows)),
    )
    return dataclasses.replace(inertia, covariance=covariance, budget=budget)


def monte_carlo(inertia: Inertia, inputs: Mapping[str, float], *, samples: int = 2000, seed: int = 0) -> np.ndarray:
    """(samples, p) identified values, drawn under the distribution of inputs and data (GUM Supplement 1).

    Parameters
    ----------
    inertia : Inertia
    inputs : mapping of str to float, standard deviations as of `with_budget`, normal and independent
    samples : int
    seed : int

    Notes
    -----
    Every sample is identified again, all at once: six Gauss-Newton steps with the Jacobian of the nominal case.
    """
    p = inertia.problem
    if isinstance(p, Combined):
        raise InputError("several recordings in one estimate take the Monte Carlo of `evolvent_massprops`")
    names, std = check_inputs(p, inputs)
    if samples < 2:
        raise InputError(f"samples is {samples}; a distribution takes 2 or more")
    random = np.random.default_rng(seed)
    at = np.array([inertia.values[name] for name in p.unknown])
    nominal = np.array([float(value_of(p.base, name)) for name in names])
    x = nominal + std * random.standard_normal((samples, len(names)))
    frequency, shapes = p.frequency, p.shapes
    if p.weighted:
        L = np.linalg.cholesky(p.frequency_covariance)
        frequency = frequency + random.standard_normal((samples, len(frequency))) @ L.T
        if shapes is not None and p.shape_covariance is not None:
            noise = random.standard_normal((samples, *shapes.shape))
            shapes = shapes + np.einsum("mij,nmj->nmi", np.linalg.cholesky(p.shape_covariance), noise)
    shift = np.zeros((samples, len(p.prior)))
    if p.prior:
        shift = random.standard_normal(shift.shape)
    scale = p.scale
    P = scale[:, None] * np.linalg.pinv(p.jacobian(at) * scale)
    values = np.broadcast_to(at, (samples, len(at)))
    for _ in range(6):
        r = p.residual(values, names, x, frequency, shapes)
        if p.prior:
            r[..., -len(p.prior) :] -= shift
        values = values - r @ P.T
    return values


def propagate(
    function: Callable[[np.ndarray], np.ndarray],
    values: Mapping[str, float],
    std: Mapping[str, float],
    *,
    outputs: Sequence[str],
    correlation: Any = None,
) -> tuple[Budget, np.ndarray]:
    """Budget and covariance of any function of measured numbers.

    Parameters
    ----------
    function : callable
        (..., q) float to (..., p) float.
    values, std : mapping of str to float
        The numbers and their standard deviations; one left out of `std` is exact.
    outputs : (p,) sequence of str
    correlation : (q, q) float, optional

    Returns
    -------
    budget : Budget
        Its contributions are each input's own; correlations show in the covariance only.
    covariance : (p, p) float

    Notes
    -----
    Derivatives by central differences over half a standard deviation; GUM (2008), eq. 10, 13 and 5.1.3, note 2.
    """
    names = tuple(values)
    unknown = set(std) - set(names)
    if unknown:
        raise InputError(f"std names {sorted(unknown)[0]!r}, which is not among the values {', '.join(names)}")
    x = np.array([float(values[name]) for name in names])
    u = np.array([float(std.get(name, 0.0)) for name in names])
    if np.any(u < 0.0) or not np.all(np.isfinite(u)):
        raise InputError(f"std is {dict(std)}; standard deviations are 0 or above")
    step = np.where(u > 0.0, 0.5 * u, 1e-6 * np.where(x != 0.0, np.abs(x), 1.0))
    both = x + np.concatenate([np.diag(step), -np.diag(step)])
    plus, minus = np.split(np.asarray(function(both)), 2)
    sensitivity = (plus - minus) / (2.0 * step[:, None])
    contribution = sensitivity * u[:, None]
    C = np.eye(len(x)) if correlation is None else np.asarray(correlation, dtype=float)
    budget = Budget(tuple(outputs), np.asarray(function(x)), names, sensitivity, np.abs(contribution))
    return budget, contribution.T @ C @ contribution
