"""A body on springs in several mountings, with tare and air: one least squares over all recordings."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops import amplitude, mode_selection
from evolvent_massprops.description import NO_UNKNOWN, OnSprings
from evolvent_massprops.estimates import Evaluation, Output, Share
from evolvent_massprops.inertia.combined import NO_BODY, Combined
from evolvent_massprops.inertia.least_squares import solve
from evolvent_massprops.inertia.problem import BODY_NAMES, problem, undetermined, value_of
from evolvent_massprops.modal import refuse_fast, refuse_rate
from evolvent_massprops.mounting_keys import AIR_SHAPES
from evolvent_massprops.spring_keys import CALIBRATED, PROPERTIES
from evolvent_massprops.springs import compare, data_fitted, measured_of, refuse_flexible
from evolvent_massprops.springs_inputs import (
    LABELS,
    Input,
    SpringsTask,
    asked,
    assumptions,
    first_body,
    inputs_of,
    label_of,
    mounting_of,
    sensors_of,
    stand_factor,
    stand_of,
)
from evolvent_massprops.springs_search import (
    Recording,
    best_of_searches,
    mountings,
    occupied,
    open_sentence,
    refuse_tare,
    undetermined_near,
)
from evolvent_massprops.springs_uncertainty import Budget, amplitude_share, budget_of, monte_carlo, weighted

#: Probability of the chi-square below which the recordings contradict one another.
UNLIKELY = 1e-3


class Joint(NamedTuple):
    """The estimate: an evaluation a recording, and values, covariance and budget of all together."""

    evaluations: list[Evaluation]
    outputs: tuple[Output, ...]
    values: np.ndarray
    covariance: np.ndarray
    shares: tuple[Share, ...]
    draws: np.ndarray | None


def evaluate(recordings: Sequence[Recording]) -> Joint:
    """Mass properties from all recordings at once.

    Raises
    ------
    InputError
        No recording with the body on the stand, unknowns that the mountings do not determine, shapes that no motion of
        a body has, an inertia that no body has.
    """
    if not any(occupied(r.given) for r in recordings):
        raise InputError(NO_BODY)
    _refuse_unstated(recordings)
    groups = mountings(recordings)
    on = [k for k, r in enumerate(recordings) if occupied(r.given)]
    first = next((k for k in on if recordings[k].given.body.unknown), on[0])
    unknown = unknowns(recordings, groups)
    if not unknown:
        raise InputError(NO_UNKNOWN)
    keys = tuple(unknown)
    tasks, why, warnings = [], [], []
    for r in recordings:
        task, reasons, cautions = _task(r, keys)
        tasks.append(task)
        why.append(reasons)
        warnings.append(cautions)
    p = joined(recordings, tasks, groups, unknown)
    spelled, known = spelled_by_user(unknown, recordings), None
    try:
        inertia = best_of_searches(p, recordings, first)
        if recordings[first].given.body.Iyy is None:  # it follows the moments found
            known = inertia.values
            p = joined(recordings, tasks, groups, unknown, known)
            inertia = solve(p, "least squares", [np.array([known[name] for name in p.unknown])])
        refuse_tare(p, inertia, recordings)
    except InputError as error:
        hints = [f"{r.name}: {h}" for r in recordings if (h := amplitude.large(stand_of(r.given).length, r.modal))]
        raise InputError("; ".join([with_keys(str(error), spelled), *hints])) from None
    inputs = shared_inputs(recordings, tasks, groups, known)
    values = weighted(p, np.array([inertia.values[name] for name in p.unknown]), inputs)
    if reasons := undetermined_near(p, values):
        raise InputError(with_keys(open_sentence(reasons, recordings), spelled))
    compared = [
        compare(task, part, values[places], warned)
        for task, (part, places), warned in zip(tasks, p.parts, warnings, strict=True)
    ]
    budget = budget_of(tasks[0], p, values, inputs, own_labels(recordings))
    together = [w for w in inertia.warnings if not w.startswith("the model misses")]
    together += _consistency_warnings(recordings, budget)
    shares, covariance = budget.shares, budget.covariance
    bias = amplitude_share(tasks, p, values, budget.P)
    if bias is not None:
        share, warn = bias
        shares, covariance = (*shares, share), covariance + np.outer(share.contribution, share.contribution)
        together += warn(np.sqrt(np.diag(covariance)))
    draws = None
    given = recordings[first].given
    if given.uncertainty.method == "monte-carlo":
        draws = monte_carlo(tasks[first], p, values, inputs, budget.widened, budget.P)
        if bias is not None:
            random = np.random.default_rng(given.uncertainty.seed + 1)
            draws = draws + random.standard_normal((len(draws), 1)) * bias[0].contribution
        covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    else:
        together += budget.warnings
    scale = np.array([stand_factor(given) / tasks[first].mean if k == "common_factor" else 1.0 for k in keys])
    values, covariance = values * scale, covariance * np.outer(scale, scale)
    shares = tuple(s._replace(contribution=s.contribution * scale) for s in shares)
    draws = None if draws is None else draws * scale
    outputs = tuple(Output(k, *labelled(k, recordings)) for k in keys)
    cannot, statement = _undetermined(p, values / scale, spelled), _statement(p, recordings, budget)
    evaluations = []
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        body, assumed = first_body(r.given, task.stand, task.modal.frequency[list(task.used)], known)
        evaluations.append(
            Evaluation(
                modal=r.modal,
                used=task.used,
                outputs=outputs,
                values=values,
                covariance=covariance,
                shares=shares,
                why=(*why[k], statement),
                assumed=(*_mounted(r.given), *assumptions(r.given, body, assumed, np.pi * r.modal.reading.rate)),
                cannot=cannot,
                model_frequency=compared[k][0],
                agreement=compared[k][1],
                model_shapes=compared[k][2],
                consistency=float(budget.misfit[k]) if len(recordings) > 1 else budget.consistency,
                draws=None if k else draws,
                warnings=(*warnings[k], *(together if k == first else ())),
            )
        )
    return Joint(evaluations, outputs, values, covariance, shares, draws)


def _refuse_unstated(recordings: Sequence[Recording]) -> None:
    """Refuse what several recordings leave open."""
    for r in recordings:
        given, b = r.given, r.given.body
        for key in sorted({key for other in recordings for key in other.given.stand.unknown}):
            same = ("stand.stiffness",) if key == "common_factor" else ("stand.points",)
            own = [k for k in r.own if k == "stand" or k.startswith((f"stand.{key}", *same))]
            if own:
                raise InputError(
                    f"recordings.{r.name}.{own[0]} is given and stand.{key} is unknown, which is one for all "
                    "recordings; leave one of them out"
                )
        if not occupied(given):
            continue
        upright = given.mounting is None or abs(given.mounting.matrix[1, 1]) > 1.0 - 1e-9
        if b.Iyy is None and not upright:
            raise InputError(
                f"body.Iyy is missing, and {r.name} has y out of the vertical; state it or write 'unknown'"
            )
        if not given.identification.shapes and all(v.unknown and np.isnan(v.value) for v in (b.Ixx, b.Izz)):
            raise InputError(
                "identification.shapes is false, and without shapes several pairs of Ixx and Izz may give the same "
                "frequencies; leave it on, or give a start, such as Ixx: unknown near 3700 kg m^2"
            )


def spelled_by_user(unknown: dict[str, tuple[str, float, float]], recordings: Sequence[Recording]) -> dict[str, str]:
    """Names of the unknowns as the user writes them."""
    found = {own: key for key, own in PROPERTIES.items()} | {own: f"stand.{key}" for key, own in CALIBRATED.items()}
    for key, (name, _, _) in unknown.items():
        plain, _, mark = key.partition("@")
        plain = f"stand.{plain}" if plain in CALIBRATED else plain
        found[name] = f"{plain} of {recordings[int(mark) - 1].name}" if mark else plain
    return found


def with_keys(text: str, spelled: dict[str, str]) -> str:
    """A sentence on unknowns with keys in place of their names."""
    if not text.startswith("the data do not determine"):
        return text
    return re.sub(r"(?<![\w.])[A-Za-z]\w*(?:@\d+)?", lambda m: spelled.get(m[0], m[0]), text)


def unknowns(recordings: Sequence[Recording], groups: Sequence[int]) -> dict[str, tuple[str, float, float]]:
    """Unknowns of all recordings by key: name, and value and deviation of another measurement, or nan."""
    found: dict[str, tuple[str, float, float]] = {}
    for k, r in enumerate(recordings):
        for key, name, stated in asked(r.given):
            mark = f"@{groups[k] + 1}" if key.startswith("mounting.") else ""
            factor = 1.0
            if key == "common_factor":
                factor = float(np.mean(stand_of(r.given).stiffness)) / stand_factor(r.given)
            value = (name + mark, stated.value * factor, stated.std * factor)
            if key + mark not in found:
                found[key + mark] = value
    return found


def _task(r: Recording, keys: tuple[str, ...]) -> tuple[SpringsTask, list[str], list[str]]:
    """What is solved of one recording, how its modes were chosen, and warnings."""
    try:
        stand = stand_of(r.given)
        used, why, warnings = mode_selection.select(r.given, r.modal)
        amplitude.refuse(stand.length, r.modal)
        sensors, directions = sensors_of(r.given, stand)
        refuse_flexible(r.modal, used, sensors, directions)
        mass = _moving_mass(r.given)
        if np.isfinite(mass):
            heave = float(np.sqrt(stand.stiffness.sum() / mass))
            refuse_rate(heave, r.modal.reading.rate, "the heave of all that moves")
            refuse_fast(heave, r.modal.frequency[list(used)])
        if few := mode_selection.missing_modes_warning(r.given, r.modal, used, sensors, directions):
            warnings = [*warnings, few]
    except InputError as error:
        raise InputError(f"{r.name}: {error}") from None
    mean = float(np.mean(stand.stiffness))
    return SpringsTask(r.given, r.modal, used, stand, sensors, directions, keys, mean), why, warnings


def _moving_mass(given: OnSprings) -> float:
    """Mass of body, tare and air that heave, kg; nan where it is not known."""
    m = mounting_of(given)
    mass = sum(t.mass.value for t in given.tare) + (given.body.mass.value if m.occupied else 0.0)
    for k, on_body in enumerate(m.air_on_body):
        if m.occupied or not on_body:
            up = m.rotation.T[:, 1] if on_body else np.eye(3)[1]
            mass += float(m.air_density * m.air_factor[k] * (up @ m.air_mass[k] @ up))
    return float(mass)


def joined(
    recordings: Sequence[Recording],
    tasks: Sequence[SpringsTask],
    groups: Sequence[int],
    unknown: dict[str, tuple[str, float, float]],
    known: dict[str, float] | None = None,
) -> Combined:
    """Problems of all recordings, set up at the start of the search but for moments without one."""
    problems, own, order = [], [], {name: None for name, _, _ in unknown.values()}
    starts = _tare_starts(recordings, tasks)
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        every = np.concatenate([t.modal.frequency[list(t.used)] for t in tasks])
        body, _ = first_body(r.given, task.stand, every, known)
        mounting = mounting_of(r.given)
        names: list[tuple[str, str]] = []
        for key, name, _ in asked(r.given):
            if not mounting.occupied and not key.startswith("tare") and key not in CALIBRATED:
                continue
            names.append((name, f"{name}@{groups[k] + 1}" if key.startswith("mounting.") else name))
        of_one = problem(
            task.stand, body, [name for name, _ in names] or ["mass"], mounting=mounting, **measured_of(task)
        )
        of_tare = {n: v for n, v in starts.items() if n in of_one.unknown}
        if of_tare:
            place = [of_one.unknown.index(n) for n in of_tare]
            at = of_one.initial_estimate
            at[place] = list(of_tare.values())
            of_one = dataclasses.replace(of_one, base=of_one.assigned(at))
        if not names:  # nothing is unknown that this recording has
            of_one = dataclasses.replace(of_one, unknown=())
        problems.append(of_one)
        own.append(tuple(full for _, full in names))
    prior = tuple((name, value, std) for name, value, std in unknown.values() if std > 0.0)
    generalized = any(r.given.stand.unknown and r.given.has_mounting for r in recordings)
    return Combined(
        problems=tuple(problems), unknown=tuple(order), own=tuple(own), prior=prior, generalized=generalized
    )


def _tare_starts(recordings: Sequence[Recording], tasks: Sequence[SpringsTask]) -> dict[str, float]:
    """Starts of the tares' unknowns that have none: from the mean frequency of a recording without the body, or all."""
    empty = [t for r, t in zip(recordings, tasks, strict=True) if not occupied(r.given)]
    found = {}
    for key, name, stated in (item for r in recordings for item in asked(r.given)):
        if not (key.startswith("tare.") and np.isnan(stated.value)):
            continue
        task = (empty or tasks)[0]
        square = float(np.mean(task.modal.frequency[list(task.used)])) ** 2
        arm = task.stand.points - task.stand.points.mean(axis=0)
        last = key.rpartition(".")[2]
        second = {"mass": arm[:, 0] ** 0, "Ixx": arm[:, 2] ** 2, "Izz": arm[:, 0] ** 2}
        second["Iyy"] = second["Ixx"] + second["Izz"]
        if last in second:
            found[name] = float(np.sum(task.stand.stiffness * second[last])) / square
    return found


def shared_inputs(
    recordings: Sequence[Recording],
    tasks: Sequence[SpringsTask],
    groups: Sequence[int],
    known: dict[str, float] | None,
) -> list[Input]:
    """Inputs of all recordings: shared, but for those that a recording states itself and those of a mounting."""
    found: dict[tuple[str, str], Input] = {}
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        _, assumed = first_body(r.given, task.stand, task.modal.frequency[list(task.used)], known)
        for item in [*inputs_of(r.given, r.modal), *assumed]:
            if not occupied(r.given) and item.key.startswith(("body.", "mounting.")):
                continue
            mark = ""
            if item.key.startswith("mounting."):
                mark = f" of {recordings[groups[k]].name}"
            elif item.key.startswith(r.own) if r.own else False:
                mark = f" of {r.name}"
            at = (item.key, mark)
            before = found[at].recordings if at in found else ()
            label = item.key + (mark if len(recordings) > 1 else "")
            found[at] = item._replace(key=label, recordings=(*(before or ()), k))
    return list(found.values())


def own_labels(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Keys that recordings state themselves."""
    return tuple(dict.fromkeys(key for r in recordings for key in r.own))


def _consistency_warnings(recordings: Sequence[Recording], budget: Budget) -> list[str]:
    """Sentences where the recordings contradict one another or the model."""
    if not np.isfinite(budget.consistency):
        return []
    chance = float(scipy.stats.chi2.sf(budget.free * budget.consistency**2, budget.free))
    if chance > UNLIKELY:
        return []
    worst = ""
    if len(recordings) > 1 and np.any(np.isfinite(budget.misfit)):
        k = int(np.nanargmax(budget.misfit))
        worst = f", most of it in {recordings[k].name} ({budget.misfit[k]:.1f} times what is expected)"
    several = len(recordings) > 1
    check = "the stand's description"
    if any(r.given.mounting is not None for r in recordings):
        check = f"rotation and position of {'each' if several else 'the'} mounting"
    return [
        f"the {'recordings contradict one another or' if several else 'recording contradicts'} the model: "
        f"chi-square is {budget.free * budget.consistency**2:.4g} for {budget.free} degrees of freedom "
        f"(p = {chance:.1g}){worst}; "
        f"check {check}; the data's part of the uncertainty is widened by it"
    ]


def _statement(p: Combined, recordings: Sequence[Recording], budget: Budget) -> str:
    """How the unknowns were found, for the certificate."""
    n, on_stand, asked_of = len(recordings), [occupied(r.given) for r in recordings], p.on
    count = len({g for k, g in enumerate(mountings(recordings)) if k in asked_of})
    known = on_stand.count(True) - len(asked_of)
    empty = "" if all(on_stand) else f" and {on_stand.count(False)} without the body"
    empty = f" and {known} of a known body{empty}" if known else empty
    text = (
        f"One least squares of {data_fitted(p)} over {n} recording{'s' if n > 1 else ''} in {count} "
        f"mounting{'s' if count > 1 else ''}{empty}, weighted by their covariances"
    )
    if not np.isfinite(budget.consistency):
        return f"{text}."
    chi = budget.free * budget.consistency**2
    chance = float(scipy.stats.chi2.sf(chi, budget.free))
    return f"{text}: chi-square {chi:.4g} for {budget.free} degrees of freedom (p = {chance:.2g})."


def labelled(key: str, recordings: Sequence[Recording]) -> tuple[str, str]:
    """Name and unit of an output; that of a mounting names its first recording."""
    label, unit = label_of(key, recordings[0].given)
    _, _, mark = key.partition("@")
    return (f"{label}, mounting of {recordings[int(mark) - 1].name}" if mark else label), unit


def _mounted(given: OnSprings) -> tuple[tuple[str, str], ...]:
    """How the body was mounted, and what else moved, for the certificate."""
    rows, no_turn = [], "axes as the stand's"
    if given.mounting is not None:
        turns = " then ".join(f"{np.degrees(a):.6g} deg about {axis}" for a, axis in given.mounting.rotation)
        places = [v.value for v in given.mounting.position]
        if any(places):
            numbers = ", ".join("unknown" if np.isnan(v) else f"{v:.6g}" for v in places)
            turns = f"{turns or no_turn}, at {numbers} m"
        rows.append(("mounting", (turns or no_turn) if given.mounting.body else "without the body"))
    rows += [("tare", f"{t.name}, {t.mass.value:.6g} kg") for t in given.tare if np.isfinite(t.mass.value)]
    if given.air is not None:
        shapes = ", ".join(name for s in given.air.shapes for name, kind in AIR_SHAPES.items() if type(s) is kind)
        rows.append(("air that moves along", f"{shapes}, density {given.air.density.value:.6g} kg/m³"))
    return tuple(rows)


def _undetermined(p: Combined, values: np.ndarray, spelled: dict[str, str]) -> tuple[tuple[str, str], ...]:
    """Properties of the body that were not asked for and that these mountings do not determine, with the reason."""
    rows = []
    if not set(BODY_NAMES) & set(p.unknown):
        return ()
    for key, name in (*PROPERTIES.items(), ("common_factor", "stiffness")):
        if name in p.unknown:
            continue
        more = p.with_unknown(name, values)
        at = np.append(values, float(value_of(p.base, name)))
        names = ["the springs' stiffness" if n == "stiffness" else spelled.get(n, n) for n in more.unknown]
        if reasons := undetermined(more.jacobian(at), names, more.scale):
            rows.append((LABELS[key][0], "; ".join(reasons)))
    return tuple(rows)
