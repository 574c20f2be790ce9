"""A body on springs: from modes to its mass, centre of mass and inertia, with all that these depend on."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops import amplitude, mode_selection
from evolvent_massprops.description import OnSprings
from evolvent_massprops.estimates import Evaluation, Output
from evolvent_massprops.inertia import Body, Candidate, Inertia, Stand, candidates, fit, linear_model, mac
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import InertiaProblem, assign, matching, undetermined
from evolvent_massprops.keys import DIRECTIONS
from evolvent_massprops.modal import Modal, refuse_fast, refuse_rate
from evolvent_massprops.spring_keys import PROPERTIES
from evolvent_massprops.springs_inputs import (
    LABELS,
    Input,
    SpringsTask,
    assumptions,
    first_body,
    inputs_of,
    sensors_of,
    stand_factor,
    stand_of,
)
from evolvent_massprops.springs_uncertainty import amplitude_share, budget_of, monte_carlo

#: Agreement of measured and model shapes below which no certificate is written, and below which there is a warning.
LEAST_MAC, GOOD_MAC = 0.8, 0.98
#: A misfit above it gives a warning; the data's deviations are widened by any misfit above 1.
MISFIT_WARNED = 3.0
#: Modes above half the sampling rate are considered up to so many times the heave, in at most so many ways.
HIGHEST, MOST_FOLDED = 4.0, 10
_CHECK = (
    "check which column is which sensor, their points, directions and signs, or leave the mode out by "
    "identification.band"
)


def evaluate(given: OnSprings, modal: Modal, own: Sequence[str] = ()) -> Evaluation:
    """Mass properties from the modes of one recording.

    Raises
    ------
    InputError
        Springs that cannot hold the body, a rate too low for its modes, unknowns that the data do not determine, shapes
        that no motion of the body has, an inertia that no body has.
    """
    stand = stand_of(given)
    used, why, warnings = mode_selection.select(given, modal)
    if np.isfinite(given.body.mass.value):
        heave = float(np.sqrt(stand.stiffness.sum() / given.body.mass.value))
        refuse_rate(heave, modal.reading.rate, "the body's heave")
        refuse_fast(heave, modal.frequency[list(used)])
    body, _ = first_body(given, stand, modal.frequency[list(used)])
    _expected(given, stand, body, modal)
    sensors, directions = sensors_of(given, stand)
    used, merged = mode_selection.separate(linear_model(stand, body).modes(), modal, used, sensors, directions)
    amplitude.refuse(stand.length, modal)
    refuse_flexible(modal, used, sensors, directions)
    keys = (*given.body.unknown, *(("common_factor",) if given.stand.common_factor.unknown else ()))
    mean = float(np.mean(stand.stiffness))
    if not used:
        raise InputError("; ".join(merged))
    few = "; ".join(merged) or mode_selection.missing_modes_warning(given, modal, used, sensors, directions)
    if not given.identification.shapes:
        _ambiguous(given, stand, body, modal, used)
    task = SpringsTask(given, modal, used, stand, sensors, directions, keys, mean)
    try:
        inertia, body, start_assumed = _solve(task)
        p = problem_of(inertia)
        values = np.array([inertia.values[name] for name in p.unknown])
        badly: list[str] = []
        model_frequency, agreement, model_shapes = compare(task, p, values, badly)
    except InputError as error:
        hints = [hint for hint in (few, amplitude.large(stand.length, modal)) if hint]
        raise InputError("; ".join([str(error), *hints])) from None
    warnings += [few] if few else []
    warnings += [w for w in inertia.warnings if not w.startswith("the model misses")]
    warnings += badly
    inputs = [*inputs_of(given, modal), *start_assumed]
    budget = budget_of(task, p, values, inputs, own)
    shares, covariance, consistency = budget.shares, budget.covariance, budget.consistency
    if np.isfinite(consistency) and consistency > MISFIT_WARNED:
        warnings.append(
            f"the model misses the data by {consistency:.1f} of the deviations that hold for all inputs; the data's "
            "part of the uncertainty is widened by it"
        )
    bias = amplitude_share([task], p, values, budget.P)
    if bias is not None:
        share, warn = bias
        shares, covariance = (*shares, share), covariance + np.outer(share.contribution, share.contribution)
        warnings += warn(np.sqrt(np.diag(covariance)))
    warnings += _aliasing_warnings(task, inertia, consistency)
    draws = None
    if given.uncertainty.method == "gum":
        warnings += budget.warnings
    else:
        draws = monte_carlo(task, p, values, inputs, budget.widened, budget.P)
        if bias is not None:
            random = np.random.default_rng(given.uncertainty.seed + 1)
            draws = draws + random.standard_normal((len(draws), 1)) * bias[0].contribution
        covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    scale = np.array([stand_factor(given) / mean if k == "common_factor" else 1.0 for k in keys])
    if draws is not None:
        draws = draws * scale
    shares = tuple(s._replace(contribution=s.contribution * scale) for s in shares)
    return Evaluation(
        modal=modal,
        used=used,
        outputs=tuple(Output(k, *LABELS[k]) for k in keys),
        values=values * scale,
        covariance=covariance * np.outer(scale, scale),
        shares=shares,
        why=(*why, _how(p)),
        assumed=assumptions(given, body, start_assumed, np.pi * modal.reading.rate),
        cannot=_undetermined_properties(p, values),
        model_frequency=model_frequency,
        agreement=agreement,
        model_shapes=model_shapes,
        consistency=consistency,
        candidates=_others(task, inertia),
        draws=draws,
        warnings=tuple(warnings),
    )


def _expected(given: OnSprings, stand: Stand, body: Body, modal: Modal) -> None:
    """Refuse a stand that cannot hold the body, and a rate too low for modes that are known beforehand."""
    found = linear_model(stand, body).modes()  # refuses
    b = given.body
    if all(np.isfinite(v.value) for v in (b.mass, b.Ixx, b.Izz)):
        vertical = np.abs(found.at(stand.points)).max(axis=-1)
        seen = found.natural_frequency[vertical > 1e-3 * vertical.max()]
        refuse_rate(float(seen.max()), modal.reading.rate, "the body's highest mode")


def refuse_flexible(modal: Modal, used: tuple[int, ...], sensors: np.ndarray, directions: np.ndarray) -> None:
    """Refuse shapes that no motion of a rigid body has, whatever its mass."""
    motions = np.concatenate([directions, np.cross(sensors, directions)], axis=1)
    U, sigma, _ = np.linalg.svd(motions, full_matrices=False)
    U = U[:, sigma > 1e-6 * sigma[0]]
    for k in used:
        shape = modal.shapes[k]
        share = float(np.sum((U.T @ shape) ** 2) / np.sum(shape**2))
        if share < LEAST_MAC:
            raise InputError(
                f"the shape of mode {k + 1} ({modal.frequency[k]:.6g} rad/s) is no motion of a rigid body: only "
                f"{share:.0%} of it is; {_CHECK}"
            )


def _ambiguous(given: OnSprings, stand: Stand, body: Body, modal: Modal, used: tuple[int, ...]) -> None:
    """Refuse three frequencies alone where nothing says which of several bodies it is."""
    b = given.body
    asked = [b.Ixx, b.Izz]
    if len(used) != 3 or not all(v.unknown for v in asked) or any(np.isfinite(v.value) for v in asked):
        return
    found = candidates(stand, body, modal.frequency[list(used)])
    if len(found) > 1:
        pairs = "; ".join(f"{c.Ixx:.6g} and {c.Izz:.6g} with springs of {c.stiffness:.6g} N/m" for c in found)
        raise InputError(
            f"{len(found)} pairs of Ixx and Izz give these frequencies ({pairs}); leave identification.shapes on, or "
            "give a start, such as Ixx: unknown near 3700 kg m^2"
        )


def _solve(task: SpringsTask) -> tuple[Inertia, Body, list[Input]]:
    """The solution, where the search began, and inputs for moments that were not stated."""
    frequency = task.modal.frequency[list(task.used)]
    body, assumed = first_body(task.given, task.stand, frequency)
    inertia = fit_from(task, body)
    if assumed:  # Iyy follows the moments found
        body, assumed = first_body(task.given, task.stand, frequency, inertia.values)
        inertia = fit_from(task, body)
    return inertia, body, assumed


def problem_of(inertia: Inertia) -> InertiaProblem:
    """What was solved for one recording."""
    assert isinstance(inertia.problem, InertiaProblem)
    return inertia.problem


def fit_from(task: SpringsTask, body: Body) -> Inertia:
    """The solution of least squares from a given start."""
    return fit(task.stand, body, **data_of(task))


def data_of(task: SpringsTask) -> dict[str, Any]:
    """Unknowns and data of a task, as parameters of `evolvent_massprops.inertia.fit`."""
    given, keys = task.given, task.keys
    unknown = [PROPERTIES.get(k, "stiffness") for k in keys]
    prior = {}
    for key, name in zip(keys, unknown, strict=True):
        stated = given.stand.common_factor if key == "common_factor" else getattr(given.body, key)
        if stated.std > 0.0:
            scale = task.mean / stand_factor(given) if key == "common_factor" else 1.0
            prior[name] = (stated.value * scale, stated.std * scale)
    return {"unknown": unknown, "prior": prior, **measured_of(task)}


def measured_of(task: SpringsTask) -> dict[str, Any]:
    """The data of a task and its model, as parameters of `evolvent_massprops.inertia.fit`."""
    given, modal, rows = task.given, task.modal, list(task.used)
    shapes: dict[str, Any] = {}
    if given.identification.shapes:
        at = [sensor.point - 1 if isinstance(sensor.point, int) else -1 for sensor in given.signals.sensors]
        shapes = {"shapes": modal.shapes[rows], "points": task.sensors, "directions": task.directions}
        shapes["at_springs"] = tuple(at)
        if modal.has_uncertainties:
            shapes["shape_covariance"] = modal.shape_covariance[rows]
    known = modal.has_uncertainties
    return {
        "frequency": modal.frequency[rows],
        "frequency_covariance": modal.frequency_covariance[np.ix_(rows, rows)] if known else None,
        "model": given.identification.model,
        **shapes,
    }


def compare(
    task: SpringsTask, p: InertiaProblem, values: np.ndarray, warnings: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Model frequencies, agreement of shapes, and model shapes scaled to the measured ones."""
    modal, used = task.modal, task.used
    found = p.modes(p.assigned(values))
    w, v = np.sqrt(found.eigenvalue), found.at(task.sensors, task.directions)
    frequency, shapes = modal.frequency[list(used)], modal.shapes[list(used)]
    agreement = np.nan_to_num(mac(shapes[:, None], v[None]))
    pick = matching(np.abs(np.log(w[None] / frequency[:, None])) + (1.0 - agreement))
    v, agreement = v[pick], agreement[np.arange(len(pick)), pick]
    v = v * (np.sum(v * shapes, axis=1) / np.maximum(np.sum(v * v, axis=1), 1e-300))[:, None]
    for k, (number, value) in enumerate(zip(used, agreement, strict=True)):
        message = (
            f"the shape of mode {number + 1} ({frequency[k]:.6g} rad/s) agrees with no motion of the body on this "
            f"stand (MAC {value:.2f})"
        )
        if value < LEAST_MAC and len(task.sensors) > 1:
            raise InputError(f"{message}; {_CHECK}")
        if value < GOOD_MAC and len(task.sensors) > 1:
            warnings.append(message.replace("agrees with no", "agrees badly with any"))
    return w[pick], agreement, v


def _aliasing_warnings(task: SpringsTask, inertia: Inertia, consistency: float) -> list[str]:
    """Warn of other bodies, with modes above half the sampling rate, that give the same samples.

    Notes
    -----
    Samples at the rate f do not distinguish w from 2 pi f n +- w. Tried are the partners up to `HIGHEST` times the
    heave, unless the stated starts are nearer to the body found.
    """
    given, modal, used, stand = task.given, task.modal, task.used, task.stand
    turn = 2.0 * np.pi * modal.reading.rate
    limit = HIGHEST * float(np.sqrt(stand.stiffness.sum() / inertia.values["mass"]))
    times = range(1, int(limit / turn) + 2)
    ways = [
        [w, *(x for n in times for x in (n * turn - w, n * turn + w) if x < limit)] for w in modal.frequency[list(used)]
    ]
    tried = sorted(itertools.product(*ways), key=lambda way: sum(w > 0.5 * turn for w in way))[1 : MOST_FOLDED + 1]
    others = []
    for way in tried:
        frequency = modal.frequency.copy()
        frequency[list(used)] = way
        other = dataclasses.replace(modal, frequency=frequency)
        try:
            folded = task._replace(modal=other)
            found, _, extra = _solve(folded)
            p = problem_of(found)
            values = np.array([found.values[name] for name in p.unknown])
            compare(folded, p, values, [])
            agreement = budget_of(folded, p, values, [*inputs_of(given, modal), *extra], ()).consistency
        except InputError:
            continue
        if agreement > max(MISFIT_WARNED, 1.5 * consistency) or _off(given, found) > _off(given, inertia):
            continue
        moved = ", ".join(
            f"{w:.6g} for {v:.6g} rad/s" for w, v in zip(way, (x[0] for x in ways), strict=True) if w != v
        )
        values_found = ", ".join(
            f"{k} = {found.values[n]:.6g} {LABELS[k][1]}" for k, n in PROPERTIES.items() if n in p.unknown
        )
        others.append(f"{moved}: {values_found}")
        if agreement < 0.5 * consistency and consistency > MISFIT_WARNED:
            raise InputError(
                f"sampled at {modal.reading.rate:.6g} Hz, the modes fit better as faster ones ({others[-1]}); state "
                "this with a start, such as Ixx: unknown near 3700 kg m^2, or sample faster"
            )
    if not others:
        return []
    return [
        f"sampled at {modal.reading.rate:.6g} Hz, faster modes look the same and fit as well "
        f"({'; '.join(others[:3])}); give the unknowns a start, such as Ixx: unknown near 3700 kg m^2, or sample faster"
    ]


def _off(given: OnSprings, found: Inertia) -> float:
    """How far a body is from the expected values of the unknowns, in logarithms; 0 where there are none."""
    starts = {n: getattr(given.body, n) for n in ("mass", "Ixx", "Iyy", "Izz")}
    known = {n: v.value for n, v in starts.items() if v is not None and v.unknown and v.value > 0.0}
    return round(sum(abs(float(np.log(found.values[n] / v))) for n, v in known.items()), 3)


def data_fitted(p: InertiaProblem | Combined) -> str:
    """What the least squares fit, in words."""
    return "frequencies and mode shapes" if p.has_shapes else "frequencies"


def _how(p: InertiaProblem) -> str:
    """How the unknowns were found, for the certificate."""
    model = "six degrees of freedom about the true equilibrium" if p.model == "full" else "three of a level body"
    return (
        f"Least squares of {data_fitted(p)}, weighted by their covariances, on the linear model with {model}; begun at "
        "the best of the stated body and of the direct solutions from the modes."
    )


def _others(task: SpringsTask, inertia: Inertia) -> tuple[Candidate, ...]:
    """All pairs of moments that the three frequencies alone allow, for the certificate."""
    modal, used, sensors = task.modal, task.used, task.sensors
    vertical = np.all(task.directions == DIRECTIONS["vertical"])
    if len(used) != 3 or not vertical:
        return ()
    body = Body(mass=inertia.values["mass"], centre=inertia.centre, inertia=inertia.tensor)
    try:
        return candidates(
            task.stand, body, modal.frequency[list(used)], shapes=modal.shapes[list(used)], points=sensors
        )
    except InputError:
        return ()


def _undetermined_properties(p: InertiaProblem, values: np.ndarray) -> tuple[tuple[str, str], ...]:
    """Properties that were not asked for and that these data do not determine, each with the reason."""
    rows = []
    for key, name in (*PROPERTIES.items(), ("common_factor", "stiffness")):
        if name in p.unknown:
            continue
        more = dataclasses.replace(p, base=assign(p.base, p.unknown, values), unknown=(*p.unknown, name))
        reasons = undetermined(more.jacobian(more.initial_estimate), more.unknown, more.scale)
        if reasons:
            rows.append((LABELS[key][0], "; ".join(reasons).replace("stiffness", "the springs' stiffness")))
    return tuple(rows)
