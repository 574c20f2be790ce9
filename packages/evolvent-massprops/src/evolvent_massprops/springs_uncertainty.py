"""Uncertainty of what is found of a body on springs: shares of the inputs, data and amplitude; Monte Carlo."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_massprops import amplitude
from evolvent_massprops.estimates import Share
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import InertiaProblem, assign
from evolvent_massprops.springs_inputs import Input, SpringsTask, label_of

#: A second-order part of the standard uncertainty above this gives a warning.
BENT = 0.1
#: A shift by the amplitude above this share of the standard uncertainty gives a warning.
SHIFT_WARNED = 0.3
#: Contributions below this share of an output's size are rounding of the arithmetic.
ROUNDING = 1e-13


def moved(
    p: InertiaProblem, inputs: Sequence[Input], shifts: np.ndarray
) -> tuple[InertiaProblem, np.ndarray, np.ndarray | None]:
    """The problem, frequencies and shapes with inputs changed: one row of `shifts` (n, q) a case."""
    n = len(shifts)
    s = p.base
    springs = s.points.shape[-2]
    own: dict[str, Any] = {
        "points": np.broadcast_to(s.points, (n, springs, 3)).copy(),
        "ground": np.broadcast_to(s.ground, (n, springs, 3)).copy(),
        **{
            f: np.broadcast_to(getattr(s, f), (n, springs)).copy() for f in ("stiffness", "length", "lateral_stiffness")
        },
    }
    named: dict[str, np.ndarray] = {}
    frequency = np.broadcast_to(p.frequency, (n, len(p.frequency))).copy()
    shapes = None if p.shapes is None else np.broadcast_to(p.shapes, (n, *p.shapes.shape)).copy()
    sensors = None if p.points is None else np.broadcast_to(p.points, (n, *p.points.shape)).copy()
    factor = np.ones(n)
    for item, d in zip(inputs, shifts.T, strict=True):
        match item.target:
            case ("clock",):
                frequency /= (1.0 + d / item.value)[:, None]
            case ("sensitivity", c) if shapes is not None:
                shapes[..., c] /= (1.0 + d)[:, None]
            case ("sensor", c, axis) if sensors is not None:
                sensors[:, c, axis] += d
            case ("factor",):
                factor = 1.0 + d / item.value
            case ("a" | "b" as side,):
                axis = 0 if side == "a" else 2
                outwards = own["points"][..., axis] * (d / item.value)[:, None]
                own["points"][..., axis] += outwards
                own["ground"][..., axis] += outwards
            case ("point", i, axis):
                own["points"][:, i, axis] += d
                own["ground"][:, i, axis] += d
            case ("length", i):
                up = np.sign(s.ground[i, 1] - s.points[i, 1])
                own["length"][:, i] += d
                own["ground"][:, i, 1] += up * d
            case ("stiffness" | "lateral_stiffness" as field, i):
                own[field][:, i] += d
            case (str() as name,):
                named[name] = item.value + d
    own["stiffness"] *= factor[:, None]
    own["lateral_stiffness"] = np.maximum(own["lateral_stiffness"], 0.0)
    base = s._replace(**own)
    if named:
        base = assign(base, tuple(named), np.stack(list(named.values()), axis=-1))
    return dataclasses.replace(p, base=base, points=sensors), frequency, shapes


def _residual(
    p: InertiaProblem | Combined,
    values: np.ndarray,
    inputs: Sequence[Input],
    shifts: np.ndarray,
    noise: Sequence[tuple[Any, Any]] | None = None,
) -> np.ndarray:
    """(n, r) residual with inputs shifted, and for each recording noise added to frequencies and shapes."""
    values = np.broadcast_to(values, (len(shifts), values.shape[-1]))
    rows = []
    for k, (part, places) in enumerate(p.parts):
        mine = [j for j, i in enumerate(inputs) if i.recordings is None or k in i.recordings]
        shifted, frequency, shapes = moved(part, [inputs[j] for j in mine], shifts[:, mine])
        if noise is not None:
            frequency = frequency + noise[k][0]
            shapes = None if shapes is None else shapes + noise[k][1]
        rows.append(shifted.residual(values[:, places], (), None, frequency, shapes))
    return p.joined(rows, values) if isinstance(p, Combined) else rows[0]


def _ends(
    p: InertiaProblem | Combined, values: np.ndarray, inputs: Sequence[Input], share: float, *, middle: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Shifts (2 q, q) of each input up and down by a share of its deviation, and the residuals there.

    With `middle` one more row has no shift.

    Raises
    ------
    InputError
        Where no stand or body can have the input so far off; it names the input.
    """
    steps = np.diag([share * i.std for i in inputs])
    shifts = np.concatenate([steps, -steps, *([np.zeros((1, len(inputs)))] if middle else [])])
    with np.errstate(all="ignore"):
        try:
            r = _residual(p, values, inputs, shifts)
            if np.all(np.isfinite(r)):
                return shifts, r
        except (InputError, np.linalg.LinAlgError):
            pass
        for k, shift in enumerate(shifts[: 2 * len(inputs)]):
            item = inputs[k % len(inputs)]
            reason = "the model has no modes"
            try:
                if np.all(np.isfinite(_residual(p, values, inputs, shift[None]))):
                    continue
            except InputError as error:
                reason = str(error)
            except np.linalg.LinAlgError:
                pass
            raise InputError(
                f"the standard uncertainty of {item.key}, {item.std:.3g} {item.unit}, leads to what cannot be "
                f"evaluated, at {item.value + shift[k % len(inputs)]:.6g} {item.unit}: {reason}"
            )
    raise InputError("the uncertainties lead to what cannot be evaluated; state smaller ones")


def _second_order_terms(
    p: InertiaProblem | Combined, values: np.ndarray, inputs: Sequence[Input], P: np.ndarray
) -> np.ndarray:
    """(q, p) f'' u^2 / sqrt(2) of each output f for each input, from evaluations one deviation up and down.

    Notes
    -----
    GUM (2008), 5.1.2, note: of a quadratic input f'' du^2 / 2 the variance is f''^2 u^4 / 2. Products of different
    inputs are left out.
    """
    if not inputs:
        return np.zeros((0, len(values)))
    shifts, r = _ends(p, values, inputs, 1.0, middle=True)
    found = values - r @ P.T
    with np.errstate(all="ignore"):
        for _ in range(3):
            try:
                found = found - _residual(p, found, inputs, shifts) @ P.T
            except (InputError, np.linalg.LinAlgError):
                found = np.full_like(found, np.nan)
    q = len(inputs)
    return np.asarray((found[:q] + found[q:-1] - 2.0 * found[-1]) / np.sqrt(2.0))


def influence(p: InertiaProblem | Combined, values: np.ndarray, inputs: Sequence[Input]) -> np.ndarray:
    """(r, q) change of the residual by each input's standard deviation."""
    if not inputs:
        return np.zeros((len(p.residual(values)), 0))
    plus, minus = np.split(_ends(p, values, inputs, 0.5)[1], 2)
    return np.asarray((plus - minus).T)


def _estimator(p: InertiaProblem | Combined, J: np.ndarray, D: np.ndarray) -> np.ndarray:
    """(p, r) P of the estimate, dp = -P dr, for the derivative J of the residual by the unknowns over their scale.

    Notes
    -----
    The pseudoinverse of J; of a generalized problem that of the residual whitened by 1 + D D^T (Aitken 1935).
    """
    if isinstance(p, Combined) and p.generalized:
        W = np.linalg.inv(np.linalg.cholesky(np.eye(len(J)) + D @ D.T))
        return np.asarray(p.scale[:, None] * (np.linalg.pinv(W @ J) @ W))
    return np.asarray(p.scale[:, None] * np.linalg.pinv(J))


def weighted(p: Combined, values: np.ndarray, inputs: Sequence[Input]) -> np.ndarray:
    """Values of the unknowns of a generalized problem, from those that weight the data by their noise alone."""
    if not p.generalized:
        return values
    for _ in range(2):
        P = _estimator(p, p.jacobian(values) * p.scale, influence(p, values, inputs))
        for _ in range(4):
            values = values - P @ p.residual(values)
    return values


def _misfit_of_each(p: Combined, r: np.ndarray, D: np.ndarray, fitted: np.ndarray) -> np.ndarray:
    """(n,) root mean square of each recording's residual, of the covariance that data and inputs let expect of it.

    `fitted` (r, r) is the part of the residual that the unknowns take up, J P.
    """
    left, first, found = np.eye(len(r)) - fitted, p.first_rows, []
    C = left @ (np.eye(len(r)) + D @ D.T) @ left.T
    for k, (part, _) in enumerate(p.parts):
        rows = slice(first[k], first[k + 1])
        variance, V = np.linalg.eigh(C[rows, rows])
        kept = variance > 1e-9 * variance[-1]
        free = int(np.count_nonzero(kept)) - part.free_scales
        z = V[:, kept].T @ r[rows]
        found.append(float(np.sqrt(np.sum(z**2 / variance[kept]) / free)) if free > 0 else np.nan)
    return np.array(found)


class Budget(NamedTuple):
    """Uncertainty of the unknowns before what the amplitude adds.

    Attributes
    ----------
    shares : Share of each input and group of data
    covariance : (p, p)
    consistency : float, root mean square of the misfit, of the deviations that hold for all inputs; nan if unknown
    free : int, degrees of freedom of the misfit
    misfit : (n,) float, root mean square of each recording's residual, of the same deviations; nan if unknown
    widened : float, factor on the deviations of the data, 1 or more
    P : (p, r), dp = -P dr of a change of the residual
    warnings : sentences on inputs that do not act in proportion
    """

    shares: tuple[Share, ...]
    covariance: np.ndarray
    consistency: float
    free: int
    misfit: np.ndarray
    widened: float
    P: np.ndarray
    warnings: list[str]


def budget_of(
    task: SpringsTask, p: InertiaProblem | Combined, values: np.ndarray, inputs: Sequence[Input], own: Sequence[str]
) -> Budget:
    """Shares of inputs and data; `own` holds keys of inputs that are each recording's own.

    `task` gives the unknowns' keys; of several recordings in one estimate it may be that of any.

    Notes
    -----
    GUM (2008), eq. 10 and 13, at the least squares: an input shifts the unknowns by -J^+ (dr/dx) dx. The residual r
    should have the covariance 1 + D D^T, D = dr/dx u(x); what is left of it off the columns of J is held against that,
    and where it is larger the data's deviations are widened by the root of the mean square (Birge 1932).
    """
    scale, certain = p.scale, p.weighted
    J = p.jacobian(values) * scale
    D = influence(p, values, inputs)
    P = _estimator(p, J, D)
    r = p.residual(values)
    free = len(r) - len(values) - p.free_scales
    consistency, misfit = np.nan, np.full(len(p.parts), np.nan)
    if free > 0 and certain:
        U, sigma, _ = np.linalg.svd(J)
        rank = np.count_nonzero(sigma > 1e-12 * sigma[0])
        N = U[:, rank:]
        z, E = N.T @ r, N.T @ D
        consistency = float(np.sqrt(z @ np.linalg.solve(np.eye(len(z)) + E @ E.T, z) / free))
        if isinstance(p, Combined):
            misfit = _misfit_of_each(p, r, D, (J / scale) @ P)
    widened = max(1.0, consistency) if np.isfinite(consistency) else 1.0
    first, second = -(P @ D).T, np.nan_to_num(_second_order_terms(p, values, inputs, P), posinf=0.0, neginf=0.0)
    sign = np.sign(np.where(np.abs(first) >= np.abs(second), first, second))
    given = sign * np.hypot(first, second)
    given[np.abs(given) < ROUNDING * scale] = 0.0
    shares = [
        Share(i.key, i.unit, i.value, i.std, given[k], i.key in own or any(i.key.startswith(o) for o in own))
        for k, i in enumerate(inputs)
    ]
    of, groups = p.groups, []
    if certain:
        groups = [
            ("noise: frequencies", P[:, of["frequencies"]], widened),
            ("noise: mode shapes", P[:, of["shapes"]], widened),
        ]
    groups += [("other measurements of the unknowns", P[:, of["priors"]], 1.0)]
    covariance = given.T @ given
    for label, part, factor in groups:
        if part.shape[1]:
            covariance = covariance + factor**2 * part @ part.T
            contribution = factor * np.sqrt(np.sum(part**2, axis=1))
            contribution[contribution < ROUNDING * scale] = 0.0
            shares.append(Share(label, "", np.nan, np.nan, contribution, label.startswith("noise")))
    std = np.sqrt(np.diag(covariance))
    bent = [
        f"{i.key} with +- {i.std:.3g} {i.unit} does not act on {' and '.join(name for name in acted)} in proportion; "
        "the second order is in u, but for the coverage interval take uncertainty.method=monte-carlo"
        for k, i in enumerate(inputs)
        if (acted := [n for j, n in enumerate(task.keys) if abs(second[k, j]) > BENT * std[j]])
    ]
    return Budget(tuple(shares), covariance, consistency, free, misfit, widened, P, bent)


def amplitude_share(
    tasks: Sequence[SpringsTask], p: InertiaProblem | Combined, values: np.ndarray, P: np.ndarray
) -> tuple[Share, Callable[[np.ndarray], list[str]]] | None:
    """Shift by the amplitude of the swing, as a share of the budget, and its warnings for given deviations."""
    step, largest, lost, first, known = np.zeros(len(values)), 0.0, False, 0, False
    for task, (part, places) in zip(tasks, p.parts, strict=True):
        own = values[places]
        s = part.assigned(own)
        found = amplitude.shift(s, task.modal, task.used, task.sensors, task.directions)
        rows = slice(first, first + sum(len(group) for group in part.groups.values()))
        first = rows.stop
        if found is None:
            continue
        known, largest = True, max(largest, found.largest)
        if np.all(np.isfinite(found.frequency)):
            step += P[:, rows] @ (part.residual(own, frequency=part.frequency - found.frequency) - part.residual(own))
        else:
            lost = True
    if not known:
        return None
    if lost:
        step[:] = 0.0
    message = f"the springs' ends move by {1e3 * largest:.3g} mm, so that their stiffness is not quite linear"

    def warnings(std: np.ndarray) -> list[str]:
        if lost:
            return [f"{message}; what this does to the result cannot be estimated, and is not in u; let it swing less"]
        shown = [
            f"{k} by about {x:.2g} {label_of(k, tasks[0].given)[1]}"
            for k, x, u in zip(tasks[0].keys, step, std, strict=True)
            if abs(x) > SHIFT_WARNED * u
        ]
        return [f"{message}: this shifts {' and '.join(shown)}, which is in u; let it swing less"] if shown else []

    return Share("amplitude of the swing", "", np.nan, np.nan, step), warnings


def monte_carlo(
    task: SpringsTask,
    p: InertiaProblem | Combined,
    values: np.ndarray,
    inputs: Sequence[Input],
    widened: float,
    P: np.ndarray,
) -> np.ndarray:
    """(n, p) unknowns identified from drawn inputs and data (GUM Supplement 1); Gauss-Newton with a fixed P."""
    n = task.given.uncertainty.draws
    random = np.random.default_rng(task.given.uncertainty.seed)
    shifts = random.standard_normal((n, len(inputs))) * np.array([i.std for i in inputs])
    noise: list[tuple[Any, Any]] = []
    for part, _ in p.parts:
        L = widened * np.linalg.cholesky(part.frequency_covariance)
        of_frequency, of_shapes = random.standard_normal((n, len(L))) @ L.T, np.zeros(1)
        if part.shapes is not None and part.shape_covariance is not None:
            L = widened * np.linalg.cholesky(part.shape_covariance)
            of_shapes = np.einsum("mij,nmj->nmi", L, random.standard_normal((n, *part.shapes.shape)))
        noise.append((of_frequency, of_shapes))
    other = random.standard_normal((n, len(p.prior)))
    found = np.broadcast_to(values, (n, len(values)))
    for _ in progress.track(range(6), "Monte Carlo, iteration"):
        try:
            r = _residual(p, found, inputs, shifts, noise)
        except (InputError, np.linalg.LinAlgError) as error:
            widest = max(inputs, key=lambda i: i.std / abs(i.value) if i.value else 0.0)
            raise InputError(
                f"the Monte Carlo draws inputs that no stand or body can have ({error}); the widest is {widest.key}, "
                f"{widest.value:.6g} +- {widest.std:.3g} {widest.unit}"
            ) from None
        if p.prior:
            r[..., -len(p.prior) :] -= other
        found = found - r @ P.T
    if not np.all(np.isfinite(found)):
        raise InputError(
            "the Monte Carlo leaves the range in which the stand supports the body; the "
            "uncertainties are too large for it"
        )
    return np.asarray(found)
