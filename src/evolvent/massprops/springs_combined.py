"""A body on springs in several mountings, with tare and air: one least squares over all recordings."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.stats

from evolvent.base.errors import InputError
from evolvent.massprops import amplitude, mode_selection
from evolvent.massprops.description import PROPERTIES, OnSprings
from evolvent.massprops.estimates import Evaluation, Output, Share
from evolvent.massprops.inertia import Inertia
from evolvent.massprops.inertia.combined import Combined
from evolvent.massprops.inertia.least_squares import CENTRE_SHARE, PRODUCT_SHARE, solve
from evolvent.massprops.inertia.problem import problem, undetermined, value_of
from evolvent.massprops.modal import Modal
from evolvent.massprops.springs import MISFIT_WARNED, compare, measured_of, refuse_flexible
from evolvent.massprops.springs_inputs import (
    LABELS,
    Input,
    Task,
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
from evolvent.massprops.springs_uncertainty import Budget, amplitude_share, budget_of, monte_carlo

#: Factors on moments without a start at which searches may begin, and how many of the best do.
FACTORS, SEARCHES = (0.3, 1.0, 3.0), 4
#: Probability of the chi-square below which the recordings contradict one another.
UNLIKELY = 1e-3


class Recording(NamedTuple):
    """One recording: its description, its modes, keys that are its own, and its file's name."""

    given: OnSprings
    modal: Modal
    own: tuple[str, ...]
    name: str


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
    if not any(_occupied(r.given) for r in recordings):
        raise InputError("mounting.body is false for all recordings; at least one must have the body on the stand")
    groups = _mountings(recordings)
    first = next(k for k, r in enumerate(recordings) if _occupied(r.given))
    unknown = _unknown(recordings, groups)
    keys = tuple(unknown)
    tasks, why, warnings = [], [], []
    for r in recordings:
        task, reasons, cautions = _task(r, keys)
        tasks.append(task)
        why.append(reasons)
        warnings.append(cautions)
    p = _combined(recordings, tasks, groups, unknown)
    inputs = _inputs(recordings, tasks, groups)
    inertia = _solve(p, recordings, tasks, first)
    values = np.array([inertia.values[name] for name in p.unknown])
    if reasons := _undetermined_near(p, values):
        raise InputError(f"the data do not determine the unknowns: {'; '.join(reasons)}{_hint(recordings)}")
    _refuse_tare(p, values)
    compared = [
        compare(task, part, values[places], warned)
        for task, (part, places), warned in zip(tasks, p.parts, warnings, strict=True)
    ]
    budget = budget_of(tasks[0], p, values, inputs, _own_labels(recordings))
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
    scale = np.array([1.0 / tasks[first].mean if k == "common_factor" else 1.0 for k in keys])
    values, covariance = values * scale, covariance * np.outer(scale, scale)
    shares = tuple(s._replace(contribution=s.contribution * scale) for s in shares)
    draws = None if draws is None else draws * scale
    outputs = tuple(Output(k, *_labelled(k, recordings)) for k in keys)
    cannot, statement = _undetermined(p, values / scale), _statement(recordings, budget)
    evaluations = []
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        body, assumed = first_body(r.given, task.stand, task.modal.frequency[list(task.used)])
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
                draws=draws,
                warnings=(*warnings[k], *(together if k == first else ())),
            )
        )
    return Joint(evaluations, outputs, values, covariance, shares, draws)


def _mountings(recordings: Sequence[Recording]) -> list[int]:
    """Number of the first recording in the same mounting, for each."""
    found: list[int] = []
    for k, r in enumerate(recordings):
        found.append(next((j for j in range(k) if recordings[j].given.mounting == r.given.mounting), k))
    return found


def _unknown(recordings: Sequence[Recording], groups: Sequence[int]) -> dict[str, tuple[str, float, float]]:
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


def _task(r: Recording, keys: tuple[str, ...]) -> tuple[Task, list[str], list[str]]:
    """What is solved of one recording, how its modes were chosen, and warnings."""
    try:
        stand = stand_of(r.given)
        used, why, warnings = mode_selection.select(r.given, r.modal)
        amplitude.refuse(stand.length, r.modal)
        sensors, directions = sensors_of(r.given, stand)
        refuse_flexible(r.modal, used, sensors, directions)
    except InputError as error:
        raise InputError(f"{r.name}: {error}") from None
    mean = float(np.mean(stand.stiffness))
    return Task(r.given, r.modal, used, stand, sensors, directions, keys, mean), why, warnings


def _combined(
    recordings: Sequence[Recording],
    tasks: Sequence[Task],
    groups: Sequence[int],
    unknown: dict[str, tuple[str, float, float]],
) -> Combined:
    """Problems of all recordings, set up at the start of the search but for moments without one."""
    problems, own, order = [], [], {name: None for name, _, _ in unknown.values()}
    starts = _tare_starts(recordings, tasks)
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        body, _ = first_body(r.given, task.stand, np.concatenate([t.modal.frequency[list(t.used)] for t in tasks]))
        mounting = mounting_of(r.given)
        names: list[tuple[str, str]] = []
        for key, name, _ in asked(r.given):
            if not mounting.occupied and not key.startswith(("tare", "common")):
                continue
            names.append((name, f"{name}@{groups[k] + 1}" if key.startswith("mounting.") else name))
        of_one = problem(
            task.stand, body, [name for name, _ in names] or ["mass"], mounting=mounting, **measured_of(task)
        )
        known = {n: v for n, v in starts.items() if n in of_one.unknown}
        if known:
            place = [of_one.unknown.index(n) for n in known]
            at = of_one.initial_estimate
            at[place] = list(known.values())
            of_one = dataclasses.replace(of_one, base=of_one.assigned(at))
        if not names:  # nothing is unknown that this recording has
            of_one = dataclasses.replace(of_one, unknown=())
        problems.append(of_one)
        own.append(tuple(full for _, full in names))
    prior = tuple((name, value, std) for name, value, std in unknown.values() if std > 0.0)
    return Combined(problems=tuple(problems), unknown=tuple(order), own=tuple(own), prior=prior)


def _tare_starts(recordings: Sequence[Recording], tasks: Sequence[Task]) -> dict[str, float]:
    """Starts of the tares' unknowns that have none: from the mean frequency of a recording without the body, or all."""
    empty = [t for r, t in zip(recordings, tasks, strict=True) if not _occupied(r.given)]
    found = {}
    for key, name, stated in asked(recordings[0].given):
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


def _solve(p: Combined, recordings: Sequence[Recording], tasks: Sequence[Task], first: int) -> Inertia:
    """The best of searches from several starts."""
    given = recordings[first].given
    base = p.initial_estimate
    free = [
        k
        for k, name in enumerate(p.unknown)
        if (name in ("Ixx", "Iyy", "Izz") and np.isnan(getattr(given.body, name).value))
        or (name[:4] == "tare" and name[-3:] in ("Ixx", "Iyy", "Izz"))
    ]
    nudge = np.array([_nudge(name) for name in p.unknown])
    begins = []
    for factors in itertools.product(FACTORS, repeat=min(len(free), 6)):
        start = base + nudge * p.scale
        start[free[: len(factors)]] = base[free[: len(factors)]] * factors
        begins.append(start)
    begins = _cheapest(p, begins)
    open_at = [_undetermined_near(p, start) for start in begins[:2]]
    if all(open_at):  # no search would converge
        raise InputError(f"the data do not determine the unknowns: {'; '.join(open_at[0])}{_hint(recordings)}")
    best: Inertia | None = None
    failure: InputError | None = None
    for start in begins:
        try:
            found = solve(p, "least squares", [start])
        except InputError as error:
            failure = failure or error
            continue
        if best is None or found.misfit < best.misfit:
            best = found
        if not best.misfit > MISFIT_WARNED:
            break
    if best is None:
        assert failure is not None
        hint = _hint(recordings) if str(failure).startswith("the data do not determine") else ""
        raise InputError(f"{failure}{hint}") from None
    return best


def _undetermined_near(p: Combined, values: np.ndarray) -> list[str]:
    """Sentences naming the unknowns that the data do not determine where products of inertia are small.

    A product that acts on the data through itself alone may have a far value that fits as well.
    """
    near = values.copy()
    for k, name in enumerate(p.unknown):
        if _nudge(name) == PRODUCT_SHARE:
            near[k] = PRODUCT_SHARE * p.scale[k]
    try:
        return undetermined(p.jacobian(near), p.unknown, p.scale)
    except (InputError, np.linalg.LinAlgError):
        return []


def _hint(recordings: Sequence[Recording]) -> str:
    """What may be done where unknowns are not determined."""
    mounted = {g for g, r in zip(_mountings(recordings), recordings, strict=True) if _occupied(r.given)}
    text = "1 mounting of the body is" if len(mounted) == 1 else f"{len(mounted)} mountings of the body are"
    return f"; {text} recorded: turn it about another axis, or state what is known"


def _occupied(given: OnSprings) -> bool:
    """Whether the body is on the stand."""
    return given.mounting is None or given.mounting.body


def _nudge(name: str) -> float:
    """Share of an unknown's scale by which a search begins off a symmetry."""
    last = name.partition("@")[0].rpartition("_")[2]
    if last in ("ex", "h", "ez", "x", "y", "z"):
        return CENTRE_SHARE
    return PRODUCT_SHARE if last in ("Ixy", "Ixz", "Iyz") else 0.0


def _cheapest(p: Combined, begins: list[np.ndarray]) -> list[np.ndarray]:
    """The starts of least misfit, at most `SEARCHES`."""
    cost = _costs(p, np.array(begins))
    if np.any(np.isinf(cost)):  # one that cannot be evaluated stops all: one by one
        cost = np.concatenate([_costs(p, start[None]) for start in begins])
    return [begins[k] for k in np.argsort(cost, kind="stable")[:SEARCHES]]


def _costs(p: Combined, values: np.ndarray) -> np.ndarray:
    """(n,) sum of squares of the residual; infinite where it cannot be evaluated."""
    try:
        r = p.residual(values)
    except (InputError, np.linalg.LinAlgError):
        return np.full(len(values), np.inf)
    return np.asarray(np.sum(np.where(np.isfinite(r), r, 1e9) ** 2, axis=-1))


def _refuse_tare(p: Combined, values: np.ndarray) -> None:
    """Refuse a tare that nothing can be."""
    for name, value in zip(p.unknown, values, strict=True):
        what = name.partition("_")[2]
        if name.startswith("tare") and what in ("mass", "Ixx", "Iyy", "Izz") and not value > 0.0:
            unit = "kg" if what == "mass" else "kg m2"
            raise InputError(f"the data give {what} = {value:.6g} {unit} of a tare; nothing has it, check the data")


def _inputs(recordings: Sequence[Recording], tasks: Sequence[Task], groups: Sequence[int]) -> list[Input]:
    """Inputs of all recordings: shared, but for those that a recording states itself and those of a mounting."""
    found: dict[tuple[str, str], Input] = {}
    for k, (r, task) in enumerate(zip(recordings, tasks, strict=True)):
        _, assumed = first_body(r.given, task.stand, task.modal.frequency[list(task.used)])
        occupied = _occupied(r.given)
        for item in [*inputs_of(r.given, r.modal), *assumed]:
            if not occupied and item.key.startswith(("body.", "mounting.")):
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


def _own_labels(recordings: Sequence[Recording]) -> tuple[str, ...]:
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
    return [
        f"the recordings contradict one another or the model: chi-square is "
        f"{budget.free * budget.consistency**2:.4g} for {budget.free} degrees of freedom (p = {chance:.1g}){worst}; "
        "check rotation and position of each mounting; the data's part of the uncertainty is widened by it"
    ]


def _statement(recordings: Sequence[Recording], budget: Budget) -> str:
    """How the unknowns were found, for the certificate."""
    n, occupied = len(recordings), [_occupied(r.given) for r in recordings]
    count = len({g for g, on in zip(_mountings(recordings), occupied, strict=True) if on})
    empty = "" if all(occupied) else f" and {occupied.count(False)} without the body"
    text = (
        f"One least squares of frequencies and mode shapes over {n} recording{'s' if n > 1 else ''} in {count} "
        f"mounting{'s' if count > 1 else ''}{empty}, weighted by their covariances"
    )
    if not np.isfinite(budget.consistency):
        return f"{text}."
    chi = budget.free * budget.consistency**2
    chance = float(scipy.stats.chi2.sf(chi, budget.free))
    return f"{text}: chi-square {chi:.4g} for {budget.free} degrees of freedom (p = {chance:.2g})."


def _labelled(key: str, recordings: Sequence[Recording]) -> tuple[str, str]:
    """Name and unit of an output; that of a mounting names its first recording."""
    label, unit = label_of(key)
    _, _, mark = key.partition("@")
    return (f"{label}, mounting of {recordings[int(mark) - 1].name}" if mark else label), unit


def _mounted(given: OnSprings) -> tuple[tuple[str, str], ...]:
    """How the body was mounted, and what else moved, for the certificate."""
    rows = []
    if given.mounting is not None:
        turns = " then ".join(f"{np.degrees(a):.6g} deg about {axis}" for a, axis in given.mounting.rotation)
        rows.append(("mounting", (turns or "axes as the stand's") if given.mounting.body else "without the body"))
    rows += [("tare", f"{t.name}, {t.mass.value:.6g} kg") for t in given.tare if np.isfinite(t.mass.value)]
    if given.air is not None:
        shapes = ", ".join(s.shape for s in given.air.shapes)
        rows.append(("air that moves along", f"{shapes}, density {given.air.density.value:.6g} kg/m³"))
    return tuple(rows)


def _undetermined(p: Combined, values: np.ndarray) -> tuple[tuple[str, str], ...]:
    """Properties of the body that were not asked for and that these mountings do not determine, with the reason."""
    rows = []
    for key, name in (*PROPERTIES.items(), ("common_factor", "stiffness")):
        if name in p.unknown:
            continue
        more = p.with_unknown(name, values)
        at = np.append(values, float(value_of(p.base, name)))
        if reasons := undetermined(more.jacobian(at), more.unknown, more.scale):
            rows.append((LABELS[key][0], "; ".join(reasons).replace("stiffness", "the springs' stiffness")))
    return tuple(rows)
