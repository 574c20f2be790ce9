"""Measured modes against a model: the unknowns by name, the residual, and what the data determine."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError, nearest
from evolvent_massprops.inertia import mounted
from evolvent_massprops.inertia.stand import CENTRE, MOMENTS, Body, Mounting, Setup, Stand, array, setup
from evolvent_massprops.inertia.vibration import NormalModes, level, linearise

BODY_NAMES = ("mass", *CENTRE, *MOMENTS)
STAND_NAMES = ("stiffness", "a", "b", "length", "lateral_stiffness", "gravity")
MODELS = {"full": linearise, "vertical": level}
#: Standard deviations that weight the data where none are given: of a frequency, of a shape's largest amplitude.
FREQUENCY_STD, SHAPE_STD = 1e-5, 1e-2


def spring_number(name: str) -> int:
    """Index behind 'k1', 'k2', ...; -1 for other names."""
    match = re.fullmatch(r"k([1-9]\d*)", name)
    return int(match[1]) - 1 if match else -1


def check_names(what: str, names: Sequence[str], springs: int) -> tuple[str, ...]:
    """`names` as a tuple; refused where one is unknown or is given twice."""
    known = (*BODY_NAMES, *STAND_NAMES, *(f"k{i + 1}" for i in range(springs)))
    for name in names:
        if name not in known and not mounted.is_name(name):
            raise InputError(f"{what} names {name!r}; {nearest(str(name), known)}")
    if len(set(names)) < len(names):
        raise InputError(f"{what} is {tuple(names)}; no name may occur twice")
    return tuple(names)


def value_of(s: Setup, name: str) -> np.ndarray:
    """The number behind a name."""
    if s.mounting is not None and mounted.is_name(name):
        return mounted.value_of(s.mounting, name)
    if name == "mass":
        return np.asarray(s.mass)
    if name in CENTRE:
        i, sign = CENTRE[name]
        return sign * s.centre[..., i]
    if name in MOMENTS:
        return s.inertia[(..., *MOMENTS[name])]
    if name == "stiffness":
        return s.stiffness.mean(axis=-1)
    if name in ("a", "b"):
        return np.abs(s.points[..., 0 if name == "a" else 2]).max(axis=-1)
    if name == "gravity":
        return np.asarray(s.gravity)
    if name in ("length", "lateral_stiffness"):
        return getattr(s, name).mean(axis=-1)
    return s.stiffness[..., spring_number(name)]


def scale_of(s: Setup, name: str) -> float:
    """The size that a change of the named number is measured by."""
    size = float(np.linalg.norm(s.points - s.points.mean(axis=-2, keepdims=True), axis=-1).max())
    if name.startswith("tare"):
        name = name.partition("_")[2]
    if name in CENTRE or name.startswith("position"):
        return size
    if name.startswith("turn"):
        return 1.0
    if name in MOMENTS:
        row, column = MOMENTS[name]
        diagonal = np.diagonal(np.reshape(s.inertia, (-1, 3, 3))[0])
        return float(np.sqrt(diagonal[row] * diagonal[column]))
    if name == "lateral_stiffness":
        return float(s.stiffness.mean())
    return float(np.max(np.abs(value_of(s, name))))


def assign(s: Setup, names: Sequence[str], values: np.ndarray) -> Setup:
    """`s` with the named numbers replaced.

    Parameters
    ----------
    s : Setup
    names : sequence of str
        mass; ex, h, ez; Ixx, Iyy, Izz, Ixy, Ixz, Iyz; k1, k2, ... (stiffness of one spring); stiffness (mean of all,
        which keep their ratios); length (mean likewise; the unloaded springs stay unstretched); lateral_stiffness (of
        every spring); a, b (largest x and z of the attachments, the others and the ground points move along); gravity;
        of a setup with a mounting the names of `evolvent_massprops.inertia.mounted.is_name`.
    values : (..., p) float, SI
    """
    values = np.asarray(values)
    batch = values.shape[:-1]
    given = dict(zip(names, np.moveaxis(values, -1, 0), strict=True))
    fresh: dict[str, Any] = {}
    on_stand: dict[str, np.ndarray] = {}

    def own(field: str, trailing: int) -> np.ndarray:
        if field not in fresh:
            old = getattr(s, field)
            shape = old.shape[old.ndim - trailing :]
            fresh[field] = np.broadcast_to(
                old, (*np.broadcast_shapes(batch, old.shape[: old.ndim - trailing]), *shape)
            ).copy()
        return fresh[field]

    for name in sorted(given, key=lambda name: name in STAND_NAMES):  # one spring first, then all together
        value = given[name]
        if mounted.is_name(name):
            on_stand[name] = value
        elif name in ("mass", "gravity"):
            fresh[name] = value
        elif name in CENTRE:
            i, sign = CENTRE[name]
            own("centre", 1)[..., i] = sign * value
        elif name in MOMENTS:
            row, column = MOMENTS[name]
            own("inertia", 2)[..., row, column] = value
            own("inertia", 2)[..., column, row] = value
        elif name in ("a", "b"):
            ratio = (value / value_of(s, name))[..., None]
            i = 0 if name == "a" else 2
            apart = s.ground[..., i] - s.points[..., i]
            own("points", 2)[..., i] *= ratio
            own("ground", 2)[..., i] = fresh["points"][..., i] + apart
        elif name == "lateral_stiffness":
            fresh[name] = own(name, 1) * 0.0 + value[..., None]
        elif name in ("stiffness", "length"):
            fresh[name] = own(name, 1) * (value / value_of(s, name))[..., None]
        else:
            own("stiffness", 1)[..., spring_number(name)] = value
    if "length" in given:
        d = s.ground - s.points
        stretched = np.linalg.norm(d, axis=-1) / s.length
        reach = fresh["length"] * stretched
        own("ground", 2)[...] = (fresh.get("points", s.points)) + d / np.linalg.norm(d, axis=-1)[..., None] * reach[
            ..., None
        ]
    if on_stand:
        assert s.mounting is not None
        fresh["mounting"] = mounted.assign(s.mounting, on_stand, batch)
    return s._replace(**fresh)


def whitener(covariance: np.ndarray) -> np.ndarray:
    """W with W C W^T = 1 for a covariance C (..., n, n)."""
    try:
        return np.linalg.inv(np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError:
        raise InputError("a covariance of the data is not positive definite") from None


def mac(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Modal assurance criterion ``|u . v|^2 / (|u|^2 |v|^2)`` over the last axis; 1 where the shapes agree.

    Notes
    -----
    Allemang & Brown (1982).
    """
    uv = np.abs(np.sum(np.conj(u) * v, axis=-1)) ** 2
    uu_vv = np.sum(np.abs(u) ** 2, axis=-1) * np.sum(np.abs(v) ** 2, axis=-1)
    return uv / np.where(uu_vv > 0.0, uu_vv, 1.0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class InertiaProblem:
    """Measured modes, the model they are held against, and what is unknown in it.

    Attributes
    ----------
    base : Setup, what is known, and where the unknowns start
    unknown : tuple of str, names as of `assign`
    model : {"full", "vertical"}
        `linear_model` about the true equilibrium, or Belyakov's `vertical_model`.
    frequency : (m,) float, rad/s, undamped
    frequency_covariance : (m, m) float
    shapes : (m, s) float or None, amplitudes of each mode at the sensors, to any scale
    shape_covariance : (m, s, s) float or None
    points, directions : (s, 3) float, of the sensors
    release : (2, 3) float or None
        Force, N, level axes, whose letting go set the modes going, and its point, m, body axes; the shapes are then
        true amplitudes.
    prior : tuple of (name, value, standard deviation)
        Measurements of unknowns made otherwise.
    weighted : bool, whether the covariances were given and may be propagated
    at_springs : (s,) tuple of int
        Number of the spring, from 0, at whose end each sensor sits, wherever that is; -1 for a sensor at its point.
    """

    base: Setup
    unknown: tuple[str, ...]
    model: str
    frequency: np.ndarray
    frequency_covariance: np.ndarray
    shapes: np.ndarray | None
    shape_covariance: np.ndarray | None
    points: np.ndarray | None
    directions: np.ndarray
    release: np.ndarray | None
    prior: tuple[tuple[str, float, float], ...]
    weighted: bool
    at_springs: tuple[int, ...] = ()

    @property
    def initial_estimate(self) -> np.ndarray:
        """(p,) values of the unknowns in `base`."""
        return np.array([float(value_of(self.base, name)) for name in self.unknown])

    @property
    def parts(self) -> tuple[tuple[InertiaProblem, list[int]], ...]:
        """Itself, with the places of all unknowns: as of `evolvent_massprops.inertia.combined.Combined`."""
        return ((self, list(range(len(self.unknown)))),)

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Rows of the residual: of frequencies, shapes, and priors."""
        m, last = len(self.frequency), len(self.frequency) + (0 if self.shapes is None else self.shapes.size)
        rows = np.split(np.arange(last + len(self.prior)), [m, last])
        return dict(zip(("frequencies", "shapes", "priors"), rows, strict=True))

    @property
    def free_scales(self) -> int:
        """Number of shapes whose scale is free."""
        return 0 if self.shapes is None or self.release is not None else len(self.shapes)

    @property
    def has_shapes(self) -> bool:
        """Whether shapes were measured."""
        return self.shapes is not None

    @functools.cached_property
    def _whitener(self) -> np.ndarray:
        return whitener(self.frequency_covariance)

    @functools.cached_property
    def _shape_whitener(self) -> np.ndarray:
        assert self.shape_covariance is not None
        return whitener(self.shape_covariance)

    def assigned(self, values: np.ndarray) -> Setup:
        """The setup with values of the unknowns."""
        return assign(self.base, self.unknown, values)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """(p,) sizes of the unknowns."""
        return np.array([scale_of(self.base, name) for name in self.unknown])

    def modes(self, s: Setup) -> NormalModes:
        """Undamped modes of a setup."""
        none = np.zeros(s.stiffness.shape[-1])
        return MODELS[self.model](s._replace(damping=none, lateral_damping=none)).modes()

    def sensors(self, s: Setup) -> np.ndarray | None:
        """(..., s, 3) m, points of the sensors on a setup: of those at springs the springs' own."""
        if self.points is None or max(self.at_springs, default=-1) < 0:
            return self.points
        batch = np.broadcast_shapes(self.points.shape[:-2], s.points.shape[:-2])
        points = np.broadcast_to(self.points, (*batch, *self.points.shape[-2:])).copy()
        for k, spring in enumerate(self.at_springs):
            if spring >= 0:
                points[..., k, :] = s.points[..., spring, :]
        return points

    def residual(
        self,
        values: np.ndarray,
        known: Sequence[str] = (),
        known_values: np.ndarray | None = None,
        frequency: np.ndarray | None = None,
        shapes: np.ndarray | None = None,
    ) -> np.ndarray:
        """Model less data, in standard deviations of the data: frequencies, then shapes, then priors.

        Parameters
        ----------
        values : (..., p) float, of the unknowns
        known : sequence of str
            Known numbers to be replaced by `known_values` (..., q).
        frequency, shapes : (..., m), (..., m, s), optional
            Used for the measured ones.

        Returns
        -------
        (..., r) float

        Notes
        -----
        Unless the released force is known the scale of a shape is free: what stays of the whitened measured shape
        after projection off the whitened shape of the model is its residual (Golub & Pereyra 1973).
        """
        frequency = self.frequency if frequency is None else frequency
        shapes = self.shapes if shapes is None else shapes
        s = self.base if known_values is None else assign(self.base, known, known_values)
        s = assign(s, self.unknown, values)
        modes, points = self.modes(s), self.sensors(s)
        batch = np.broadcast_shapes(modes.eigenvalue.shape[:-1], frequency.shape[:-1], np.shape(values)[:-1])
        f = np.sqrt(modes.eigenvalue)
        v = None if points is None or shapes is None else modes.at(points, self.directions)
        if v is not None and self.release is not None:
            v = modes.release(*self.release).real[..., None] * v
        cost = np.abs(np.log(f[..., None, :] / frequency[..., :, None]))
        if v is not None and shapes is not None:
            cost = cost + 1.0 - mac(shapes[..., :, None, :], v[..., None, :, :])
        pick = matching(np.broadcast_to(cost, (*batch, *cost.shape[-2:])))
        f = np.take_along_axis(np.broadcast_to(f, (*batch, f.shape[-1])), pick, axis=-1)
        rows = [(f - frequency) @ self._whitener.T]
        if v is not None and shapes is not None and self.shape_covariance is not None:
            v = np.take_along_axis(np.broadcast_to(v, (*batch, *v.shape[-2:])), pick[..., None], axis=-2)
            W = self._shape_whitener
            Wv, Wa = np.einsum("mij,...mj->...mi", W, v), np.einsum("mij,...mj->...mi", W, shapes)
            if self.release is None:
                size = np.sum(Wv * Wv, axis=-1, keepdims=True)  # zero where no sensor sees the model's mode
                Wv = np.sum(Wv * Wa, axis=-1, keepdims=True) / np.where(size > 0.0, size, np.inf) * Wv
            left = Wv - Wa
            rows.append(left.reshape(*batch, -1))
        for name, value, std in self.prior:
            row = (np.asarray(values)[..., self.unknown.index(name), None] - value) / std
            rows.append(np.broadcast_to(row, (*batch, 1)))
        return np.concatenate(rows, axis=-1)

    def jacobian(self, values: np.ndarray, known: Sequence[str] | None = None) -> np.ndarray:
        """(r, p) derivative of the residual by the unknowns, or by the `known` numbers; central differences."""
        names = self.unknown if known is None else tuple(known)
        scale = self.scale if known is None else np.array([scale_of(self.base, name) for name in names])
        at = values if known is None else np.array([float(value_of(self.base, name)) for name in names])
        step = 1e-5 * scale
        both = at + np.concatenate([np.diag(step), -np.diag(step)])
        if known is None:
            r = self.residual(both)
        else:
            r = self.residual(np.broadcast_to(values, (len(both), len(values))), names, both)
        plus, minus = np.split(r, 2)
        return (plus - minus).T / (2.0 * step)


def matching(cost: np.ndarray) -> np.ndarray:
    """(..., m) which of f modes of the model belongs to each of m measured ones, least `cost` (..., m, f) in all."""
    pick = np.empty(cost.shape[:-1], dtype=int)
    for i in np.ndindex(*cost.shape[:-2]):
        pick[i] = scipy.optimize.linear_sum_assignment(cost[i])[1]
    return pick


def problem(
    stand: Stand,
    body: Body,
    unknown: Sequence[str],
    frequency: Any,
    *,
    frequency_covariance: Any = None,
    shapes: Any = None,
    shape_covariance: Any = None,
    points: Any = None,
    directions: Any = (0.0, 1.0, 0.0),
    model: str = "full",
    release: Any = None,
    prior: dict[str, tuple[float, float]] | None = None,
    mounting: Mounting | None = None,
    at_springs: Sequence[int] = (),
) -> InertiaProblem:
    """A checked `InertiaProblem`; parameters as of `evolvent_massprops.inertia.fit`."""
    s = setup(stand, body)._replace(mounting=mounting)
    if s.batch:
        raise InputError("stand and body have leading axes; one identification takes one stand and one body")
    unknown = check_names("unknown", unknown, len(stand.points))
    if model not in MODELS:
        raise InputError(f"model is {model!r}; {nearest(str(model), MODELS)}")
    if not unknown:
        raise InputError("unknown is empty; name what is to be identified")
    frequency = array("frequency", frequency, (-1,), least=np.nextafter(0.0, 1.0))
    m = len(frequency)
    most = 3 if model == "vertical" or s.guided else 6
    if m > most:
        raise InputError(f"frequency has {m} values; this model has {most} modes")
    weighted = frequency_covariance is not None
    if frequency_covariance is None:
        C = np.diag((FREQUENCY_STD * frequency) ** 2)
    else:
        C = array("frequency_covariance", frequency_covariance, (m, m))
    whitener(C)
    S = None
    if shapes is not None:
        if points is None:
            raise InputError("shapes need the points of their sensors")
        points = array("points", points, (-1, 3))
        shapes = array("shapes", shapes, (m, len(points)))
        if np.any(np.max(np.abs(shapes), axis=1) == 0.0):
            raise InputError("shapes have a mode that no sensor shows; leave it out")
        if shape_covariance is None:
            weighted = False
            S = np.eye(len(points)) * (SHAPE_STD * np.max(np.abs(shapes), axis=1))[:, None, None] ** 2
        else:
            S = array("shape_covariance", shape_covariance, (m, len(points), len(points)))
        whitener(S)
    elif release is not None:
        raise InputError("release gives the scale of shapes; give the shapes too")
    rows = []
    for name, (value, std) in (prior or {}).items():
        if name not in unknown:
            raise InputError(f"prior names {name!r}; it must be one of the unknowns {', '.join(unknown)}")
        rows.append((name, float(array(f"prior of {name}", value)), float(array(f"deviation of {name}", std))))
        if rows[-1][2] <= 0.0:
            raise InputError(f"the standard deviation of {name} is {std!r}; it must be above 0")
    return InertiaProblem(
        base=s,
        unknown=unknown,
        model=model,
        frequency=frequency,
        frequency_covariance=C,
        shapes=shapes,
        shape_covariance=S,
        points=points if shapes is not None else None,
        directions=array("directions", directions, (3,)),
        release=None if release is None else array("release", release, (2, 3)),
        prior=tuple(rows),
        weighted=weighted,
        at_springs=tuple(at_springs),
    )


def undetermined(J: np.ndarray, names: Sequence[str], scale: np.ndarray) -> list[str]:
    """Sentences naming the unknowns that the data do not determine.

    Parameters
    ----------
    J : (r, p) float, derivative of the whitened residual by the unknowns
    names, scale : of the unknowns, (p,)

    Notes
    -----
    From the singular values of J diag(scale): a combination of unknowns counts as determined if it is known to better
    than 0.3 of its scale, and changes the data by more than 1e-7 of what the best known one does.
    """
    p = len(names)
    _, sigma, Vt = np.linalg.svd(J * scale)
    sigma = np.concatenate([sigma, np.zeros(p - len(sigma))])
    sentences = []
    for i in np.flatnonzero((sigma < 1.0 / 0.3) | (sigma < 1e-7 * sigma[0])):
        share = Vt[i]
        part = [j for j in np.argsort(-np.abs(share)) if abs(share[j]) > 0.1 * np.max(np.abs(share))]
        if len(part) == 1:
            sentences.append(f"{names[part[0]]} does not show in the data")
        else:
            first = share[part[0]]
            mix = ", ".join(f"{names[j]} {share[j] / first:+.2g}" for j in part)
            sentences.append(
                f"{' and '.join(names[j] for j in part)} are not distinguished (they change together as {mix})"
            )
    return sentences
