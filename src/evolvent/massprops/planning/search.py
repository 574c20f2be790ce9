"""A measurement on springs, planned: which spring to load, how fast and how long to record, with which sensors.

A plan evaluates recordings that have not been made. The linear model of the stand, with the body that is expected,
gives the signals of a pull that is released; they are identified and evaluated as measured ones are, with the noise
that the sensors are stated to have. The deviations of the modes are then the Cramér-Rao bound, and the budget of
`evolvent.massprops.springs` adds what is known of stand and body.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.base import progress
from evolvent.base.errors import InputError
from evolvent.massprops import modal, springs
from evolvent.massprops.identification.signals import DETREND
from evolvent.massprops.inertia.problem import problem, undetermined, value_of
from evolvent.massprops.planning.expected import (
    COUNTED,
    Lines,
    Option,
    Task,
    lines,
    modal_of,
    reading_of,
    spring_task,
    task_of,
    with_noise,
    with_sensors,
)
from evolvent.massprops.planning.rules import Rule, rules
from evolvent.massprops.springs_inputs import first_body, inputs_of
from evolvent.massprops.springs_uncertainty import budget_of

Array = np.ndarray
#: Samples per period of the fastest mode at which a plan looks, where no rate is given.
PER_PERIOD = (2.1, 2.5, 4.0, 8.0, 16.0, 32.0)
#: Samples per period of the fastest mode of a plan without a stated rate: far from where modes are folded.
USUAL = 8.0
#: A record of a planned length meets the wanted uncertainty within this share.
CLOSE = 0.01
#: Least number of periods of the slowest mode in a record.
LEAST_PERIODS = 3.0
#: Samples of the longest record that is planned, and share of simulated recordings that may fail.
MOST_SAMPLES, MOST_FAILED = 2_000_000, 0.05


class Plan(NamedTuple):
    """A planned measurement.

    Attributes
    ----------
    wanted : float, relative expanded uncertainty
    factor : float, coverage factor k
    best : Option, the recommended one
    springs : tuple of Option, one a spring, at the rate of `best`, all sensors
    rates : tuple of Option, at the best spring, all sensors
    sensors : tuple of Option, at the best spring, with fewer and fewer sensors
    floor : tuple of (label, relative contribution), largest first: what a longer record does not improve
    rules : tuple of Rule
    warnings : tuple of str
    """

    wanted: float
    factor: float
    best: Option
    springs: tuple[Option, ...]
    rates: tuple[Option, ...]
    sensors: tuple[Option, ...]
    floor: tuple[tuple[str, float], ...]
    rules: tuple[Rule, ...]
    warnings: tuple[str, ...]


def plan(stand: Any, uncertainty: float, overrides: Mapping[str, Any] | None = None) -> Plan:
    """A measurement that gives the moments of inertia with a wanted uncertainty.

    Parameters
    ----------
    stand : path or mapping
        Description of the stand, as for `evolvent identify`. Unknowns have an expected value, such as
        ``Ixx: unknown near 3700 kg m^2``, and ``plan`` states the pull and the noise.
    uncertainty : float
        Relative expanded uncertainty of every moment, mass and common factor that is asked, 1e-3 for 0.1 %; its
        coverage factor is ``uncertainty.coverage_factor``.
    overrides : mapping, dotted key -> value, put in place of the description's own

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        A description without what a plan needs; a pull that moves no sensor.

    Notes
    -----
    The spring, the rate, the record's length and the sensors are compared by the uncertainty of what is asked, of
    which the noise's part follows from the Cramér-Rao bound of the modes (`identification.bounds`) and falls with the
    length of the record. The other part, from what is known of stand and body, does not.
    """
    task = task_of(stand, uncertainty, overrides)
    planned, every, numbers = task.planned, tuple(range(len(task.points))), range(len(task.stand.points))
    fastest = max(_fastest(task, spring, every) for spring in numbers)
    rate = USUAL * fastest if planned.rate is None else planned.rate
    by_spring = [
        _option(task, uncertainty, spring, rate, every) for spring in progress.track(numbers, "comparing springs")
    ]
    chosen = min(by_spring, key=lambda one: one.rank)
    if chosen.reason:
        raise InputError(f"no spring gives a recording that can be evaluated: {chosen.reason}")
    spring = chosen.spring - 1
    fastest = _fastest(task, spring, every)
    rates = [rate] if planned.rate is not None else [n * fastest for n in PER_PERIOD]
    by_rate = [
        chosen if r == rate else _option(task, uncertainty, spring, r, every)
        for r in progress.track(rates, "comparing rates")
    ]
    best = chosen
    if not chosen.reached:
        best = min([chosen, *by_rate], key=lambda o: (not o.reached, o.rate if o.reached else o.worst))
    fewer = _fewer_sensors(task, uncertainty, best)
    floor, warnings = _floor(task, best)
    return Plan(
        wanted=uncertainty,
        factor=task.given.uncertainty.coverage_factor,
        best=best,
        springs=tuple(by_spring),
        rates=tuple(by_rate),
        sensors=tuple(fewer),
        floor=floor,
        rules=rules(task, best),
        warnings=warnings,
    )


def _fastest(task: Task, spring: int, rows: Sequence[int]) -> float:
    """Frequency of the fastest mode that the sensors show after the pull at a spring, Hz; 0 where they show none."""
    try:
        return float(lines(task, spring, rows).frequency.max()) / (2.0 * math.pi)
    except InputError:
        return 0.0


def curves(
    stand: Any, found: Plan, overrides: Mapping[str, Any] | None = None, *, points: int = 24
) -> tuple[Array, Array]:
    """Uncertainty over the length of the record, of every spring.

    Parameters
    ----------
    stand, overrides : as of `plan`
    found : Plan
    points : int, lengths

    Returns
    -------
    duration : (points,) float, s
    worst : (springs, points) float, largest relative expanded uncertainty; NaN where there is none
    """
    task = task_of(stand, found.wanted, overrides)
    rate, rows = found.best.rate, range(len(task.points))
    least = min(LEAST_PERIODS * 2.0 * math.pi / float(task.modes.natural_frequency.max()), 0.5 * task.planned.duration)
    samples = np.unique(np.geomspace(least * rate, task.planned.duration * rate, points).astype(int)) + 1
    worst = np.array(
        [
            [_at(task, found.wanted, spring, rate, int(n), rows).worst for n in samples]
            for spring in range(len(task.stand.points))
        ]
    )
    return (samples - 1) / rate, np.where(np.isfinite(worst), worst, np.nan)


def check(
    stand: Any, option: Option, overrides: Mapping[str, Any] | None = None, *, runs: int = 200, seed: int = 1
) -> Array:
    """Deviation of the results of simulated recordings with noise, over the one that the plan promises of noise.

    Parameters
    ----------
    stand, overrides : as of `plan`
    option : Option, what is checked
    runs : int, recordings
    seed : int

    Returns
    -------
    (p,) float
        Root mean square of the error over the promised standard deviation, for each quantity of `option.keys`; its own
        deviation is about 1/sqrt(2 runs). NaN where the noise has no influence.

    Raises
    ------
    InputError
        If more than `MOST_FAILED` of the recordings cannot be evaluated.

    Notes
    -----
    The number of modes is given, and the search begins at the expected body.
    """
    task = task_of(stand, 1.0, overrides)
    random, rows = np.random.default_rng(seed), [k - 1 for k in option.sensors]
    given = with_sensors(task, rows, lines(task, option.spring - 1, rows).frequency.size)
    exact = reading_of(task, option.spring - 1, option.rate, option.samples, rows)
    truth = promised(task, option.spring - 1, option.rate, option.samples, rows)
    errors, failed = [], []
    for _ in progress.track(range(runs), "simulating recordings"):
        try:
            seen = modal.find(with_noise(task, exact, random, rows), given)
            found = springs.fit_from(spring_task(task, given, seen, rows), task.body)
        except InputError as error:
            failed.append(str(error))
            continue
        errors.append([found.values[name] for name in found.problem.unknown] - truth.values)
    if len(failed) > MOST_FAILED * runs:
        raise InputError(f"{len(failed)} of {runs} simulated recordings cannot be evaluated; the first: {failed[0]}")
    return _over(np.sqrt(np.mean(np.square(errors), axis=0)), truth.noise)


class Promise(NamedTuple):
    """Values of what is asked, and their deviations: with all that is known, and by the noise alone."""

    keys: tuple[str, ...]
    values: Array
    std: Array
    noise: Array


def promised(task: Task, spring: int, rate: float, samples: int, rows: Sequence[int]) -> Promise:
    """What a recording will give: the budget at the expected body, with the bound of the modes.

    Raises
    ------
    InputError
        Where the modes do not determine what is asked, or cannot be distinguished.
    """
    given = with_sensors(task, rows, 1)
    seen = modal_of(task, spring, rate, samples, rows)
    of = spring_task(task, given, seen, rows)
    p = problem(task.stand, task.body, **springs.data_of(of))
    values = np.array([value_of(p.base, name) for name in p.unknown])
    J = p.jacobian(values)
    if reasons := undetermined(J, p.unknown, p.scale):
        same = ", ".join(f"{w:.6g}" for w in lines(task, spring, rows).coinciding)
        hint = f"; several modes have the same frequency, {same} rad/s, and cannot be distinguished" if same else ""
        raise InputError("; ".join(reasons) + hint)
    _, assumed = first_body(given, task.stand, seen.frequency)
    budget = budget_of(of, p, values, [*inputs_of(given, seen), *assumed], ())
    parts = [share.contribution for share in budget.shares if share.label.startswith("noise:")]
    return Promise(of.keys, values, np.sqrt(np.diag(budget.covariance)), np.sqrt(np.sum(np.square(parts), axis=0)))


def _relative(task: Task, keys: Sequence[str], values: Array, std: Array) -> Array:
    """(p,) expanded, over the values; NaN of what may be zero."""
    counts = np.array([key in COUNTED for key in keys])
    return task.given.uncertainty.coverage_factor * _over(std, np.where(counts, np.abs(values), 0.0))


def _over(numbers: Array, by: Array) -> Array:
    """Quotients; NaN for a divisor of 0."""
    return np.divide(numbers, by, out=np.full(len(by), np.nan), where=by > 0.0)


def _at(task: Task, wanted: float, spring: int, rate: float, samples: int, rows: Sequence[int]) -> Option:
    """One recording of a given length."""
    try:
        found = promised(task, spring, rate, samples, rows)
    except (InputError, np.linalg.LinAlgError) as error:
        return _without_result(spring, rate, (samples - 1) / rate, rows, str(error))
    relative = _relative(task, found.keys, found.values, found.std)
    return Option(
        spring=spring + 1,
        rate=rate,
        duration=(samples - 1) / rate,
        sensors=tuple(k + 1 for k in rows),
        reached=bool(np.nanmax(relative) <= wanted),
        keys=found.keys,
        relative=relative,
        noise=_relative(task, found.keys, found.values, found.noise),
    )


def _without_result(spring: int, rate: float, duration: float, rows: Sequence[int], reason: str) -> Option:
    numbers, none = tuple(k + 1 for k in rows), np.zeros(0)
    return Option(spring + 1, rate, duration, numbers, False, (), none, none, reason)


def _least_samples(task: Task, shown: Lines, rate: float) -> int:
    """Samples in which an identification can distinguish the lines."""
    longest = max(LEAST_PERIODS * 2.0 * math.pi / float(shown.frequency.min()), shown.least_duration)
    enough = 2 * (4 * shown.frequency.size + 1 + DETREND[task.given.identification.detrend])
    return max(math.ceil(longest * rate) + 1, enough)


def _option(task: Task, wanted: float, spring: int, rate: float, rows: Sequence[int]) -> Option:
    """The shortest recording that reaches the wanted uncertainty, or the longest one that is allowed.

    Notes
    -----
    Of the squares of the uncertainties that of the noise falls about with the third power of the length, as long as the
    swing has not decayed. Lengths follow from that, in turns, between those that have been tried.
    """
    try:
        shown = lines(task, spring, rows)
    except InputError as error:
        return _without_result(spring, rate, task.planned.duration, rows, str(error))
    most = math.floor(task.planned.duration * rate) + 1
    if most > MOST_SAMPLES:
        raise InputError(
            f"plan.duration is {task.planned.duration:g} s, at {rate:.6g} Hz {most:.3g} samples; at most "
            f"{MOST_SAMPLES:.0e} are planned: give a shorter plan.duration or a lower plan.rate"
        )
    least = _least_samples(task, shown, rate)
    if least > most:
        text = (
            f"plan.duration is {task.planned.duration:g} s; to distinguish the modes takes {(least - 1) / rate:.3g} s"
        )
        return _without_result(spring, rate, task.planned.duration, rows, text)
    longest = _at(task, wanted, spring, rate, most, rows)
    if not longest.reached:
        return longest
    below, reached = least, longest
    first = _at(task, wanted, spring, rate, least, rows)
    if first.reached:
        return first
    tried = first
    for _ in range(12):
        if reached.samples - below <= max(1, CLOSE * below):
            break
        guess = math.sqrt(below * reached.samples)
        if not tried.reason:
            i = int(np.nanargmax(tried.relative))
            fixed = tried.relative[i] ** 2 - tried.noise[i] ** 2
            if wanted**2 > fixed:
                guess = tried.samples * (tried.noise[i] ** 2 / (wanted**2 - fixed)) ** (1.0 / 3.0)
        count = int(min(max(math.ceil(guess), below + 1), reached.samples - 1))
        tried = _at(task, wanted, spring, rate, count, rows)
        if tried.reached:
            reached = tried
        else:
            below = count
    return reached


def _fewer_sensors(task: Task, wanted: float, full: Option) -> list[Option]:
    """The best sets of fewer and fewer sensors; each leaves out the one that is missed least."""
    found, rows = [full], tuple(k - 1 for k in full.sensors)
    while len(rows) > 1:
        tried = [
            _option(task, wanted, full.spring - 1, full.rate, tuple(k for k in rows if k != out))
            for out in progress.track(rows, f"comparing sets of {len(rows) - 1} sensors")
        ]
        best = min(tried, key=lambda one: one.rank)
        found.append(best)
        if best.reason:
            break
        rows = tuple(k - 1 for k in best.sensors)
    return found


def _floor(task: Task, best: Option) -> tuple[tuple[tuple[str, float], ...], tuple[str, ...]]:
    """What a longer record does not improve: contributions of the inputs to the worst quantity; and warnings.

    Of one simulated recording with noise, whose swing has the amplitude of the pull.
    """
    rows, spring = [k - 1 for k in best.sensors], best.spring - 1
    given = with_sensors(task, rows, lines(task, spring, rows).frequency.size)
    example = with_noise(task, reading_of(task, spring, best.rate, best.samples, rows), np.random.default_rng(1), rows)
    try:
        found = springs.evaluate(given, modal.find(example, given))
    except InputError as error:
        return (), (f"a simulated recording could not be evaluated: {error}",)
    i = int(np.nanargmax(best.relative))
    k, value = task.given.uncertainty.coverage_factor, abs(float(found.values[i]))
    shares = [
        (share.label, k * abs(float(share.contribution[i])) / value)
        for share in found.shares
        if not share.label.startswith(("noise:", "other measurements")) and share.contribution[i] != 0.0
    ]
    return tuple(sorted(shares, key=lambda one: -one[1])), tuple(found.warnings)
