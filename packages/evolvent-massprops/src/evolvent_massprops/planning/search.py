"""A measurement on springs, planned: where to pull, how fast and how long to record, with which sensors and mountings.

A plan evaluates recordings that have not been made. The linear model of the stand, with the body that is expected,
gives the signals of a pull that is released; they are identified and evaluated as measured ones are, with the noise
that the sensors are stated to have. The deviations of the modes are then the Cramér-Rao bound, and the budget of
`evolvent_massprops.springs_uncertainty` adds what is known of stand and body, of one recording or of several in one
estimate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_massprops import modal, springs
from evolvent_massprops.identification.signals import DETREND
from evolvent_massprops.inertia.least_squares import solve
from evolvent_massprops.mounting_keys import Mounting
from evolvent_massprops.planning.answer import Curves, MeasurementPlan
from evolvent_massprops.planning.calibration import calibrations, needs
from evolvent_massprops.planning.expected import (
    Expected,
    ExpectedLines,
    Option,
    PlanningTask,
    lines,
    reading_of,
    recording_of,
    task_of,
    with_noise,
    with_sensors,
)
from evolvent_massprops.planning.mountings import further, in_words, sets
from evolvent_massprops.planning.predictions import at, modes_of, over, posed, predicted, without_result
from evolvent_massprops.planning.pulls import Pull
from evolvent_massprops.planning.rules import rules
from evolvent_massprops.springs_inputs import SpringsTask as SpringTask, label_of
from evolvent_massprops.springs_search import occupied
from evolvent_massprops.springs_uncertainty import amplitude_share, weighted

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


def plan(
    stand: Any, uncertainty: float, overrides: Mapping[str, Any] | None = None, *, points: int = 0
) -> MeasurementPlan:
    """A measurement that gives the moments of inertia with a wanted uncertainty.

    Parameters
    ----------
    stand : path or mapping
        Description of the stand, as for `evolvent identify`. Unknowns have an expected value, such as
        ``Ixx: unknown near 3700 kg m^2``, and ``plan`` states the pull and the noise. Its recordings, where they
        differ in mounting, tare, air or excitation, are planned together.
    uncertainty : float
        Relative expanded uncertainty of every moment, mass and common factor that is asked, 1e-3 for 0.1 %; its
        coverage factor is ``uncertainty.coverage_factor``.
    overrides : mapping, dotted key -> value, put in place of the description's own
    points : int, lengths of the record for the figure, `MeasurementPlan.curves`; 0 for no figure

    Returns
    -------
    MeasurementPlan
        ``print(found)`` and notebooks show it; ``found.plot("plan.png")``, ``found.report("plan.html")``.

    Raises
    ------
    InputError
        A description without what a plan needs; a pull that moves no sensor; unknowns that the recordings do not
        determine.

    Notes
    -----
    Pulls, rate, length of the records and sensors are compared by the uncertainty of what is asked, of which the
    noise's part follows from the Cramér-Rao bound of the modes (`identification.bounds`) and falls with the length of
    the record. The other part, from what is known of stand and body, does not.
    """
    task = task_of(stand, uncertainty, overrides)
    planned, every = task.planned, task.sensors
    fastest = max(_fastest(one, pull, every) for one in task.recordings for pull in one.pulls)
    rate = USUAL * fastest if planned.rate is None else planned.rate
    if len(task.recordings) == 1:
        pulls = task.recordings[0].pulls
        by_pull = [option(task, uncertainty, (pull,), rate, every) for pull in progress.track(pulls, "comparing pulls")]
        chosen = min(by_pull, key=lambda one: one.rank)
    else:
        by_pull = []
        chosen = option(task, uncertainty, _chosen_pulls(task, uncertainty, rate), rate, every)
    if chosen.reason:
        what = "pull gives a recording" if by_pull else "set of pulls gives recordings"
        raise InputError(f"no {what} that can be evaluated: {chosen.reason}")
    fastest = max(_fastest(one, pull, every) for one, pull in zip(task.recordings, chosen.pulls, strict=True))
    rates = [rate] if planned.rate is not None else [n * fastest for n in PER_PERIOD]
    by_rate = [
        chosen if r == rate else option(task, uncertainty, chosen.pulls, r, every)
        for r in progress.track(rates, "comparing rates")
    ]
    best = chosen
    if not chosen.reached:
        best = min([chosen, *by_rate], key=lambda o: (not o.reached, o.rate if o.reached else o.worst))
    fewer = _fewer_sensors(task, uncertainty, best)
    floor, warnings = _floor(task, best)
    k = next(k for k, one in enumerate(task.recordings) if occupied(one.given))
    return MeasurementPlan(
        wanted=uncertainty,
        factor=task.given.uncertainty.coverage_factor,
        best=best,
        names=tuple(one.name for one in task.recordings),
        pulls=tuple(by_pull),
        rates=tuple(by_rate),
        sensors=tuple(fewer),
        sets=sets(task, uncertainty, best),
        further=further(task, uncertainty, best),
        modes=modes_of(task, best),
        units=tuple(label_of(key, task.given)[1] for key in best.keys),
        rotations=tuple(
            in_words(one.given.mounting or Mounting()) if occupied(one.given) else "without the body"
            for one in task.recordings
        ),
        needs=needs(task, uncertainty, best),
        calibrations=calibrations(task, uncertainty, best),
        floor=floor,
        rules=rules(task.recordings[k], best.pulls[k], best),
        warnings=warnings,
        curves=_curves(task, uncertainty, best, tuple(by_pull), points) if points else None,
    )


def _fastest(one: Expected, pull: Pull, rows: Sequence[int]) -> float:
    """Frequency of the fastest mode that the sensors show after a pull, Hz; 0 where they show none."""
    try:
        return float(lines(one, pull, rows).frequency.max()) / (2.0 * math.pi)
    except InputError:
        return 0.0


def _chosen_pulls(task: PlanningTask, wanted: float, rate: float) -> tuple[Pull, ...]:
    """A pull for each of several recordings: that of most energy, then one after the other that of least U."""
    pulls = list(task.best_pulls)
    samples = _most_samples(task, rate)
    best = at(task, wanted, tuple(pulls), rate, samples, task.sensors)
    for k, one in enumerate(progress.track(task.recordings, "comparing pulls")):
        for pull in one.pulls:
            tried = at(task, wanted, (*pulls[:k], pull, *pulls[k + 1 :]), rate, samples, task.sensors)
            if tried.worst < best.worst:
                best, pulls[k] = tried, pull
    return tuple(pulls)


def _curves(task: PlanningTask, wanted: float, best: Option, pulls: tuple[Option, ...], points: int) -> Curves:
    """Uncertainty over the length of the record, at so many lengths."""
    rate, compared = best.rate, pulls or (best,)
    slowest = max(float(one.modes.natural_frequency.max()) for one in task.recordings)
    least = min(LEAST_PERIODS * 2.0 * math.pi / slowest, 0.5 * task.planned.duration)
    samples = np.unique(np.geomspace(least * rate, task.planned.duration * rate, points).astype(int)) + 1
    worst = np.array(
        [[at(task, wanted, one.pulls, rate, int(n), task.sensors).worst for n in samples] for one in compared]
    )
    labels = tuple(one.label for one in pulls) or ("all recordings",)
    return Curves((samples - 1) / rate, np.where(np.isfinite(worst), worst, np.nan), labels)


def check(
    stand: Any, checked: Option, overrides: Mapping[str, Any] | None = None, *, runs: int = 200, seed: int = 1
) -> Array:
    """Deviation of the results of simulated recordings with noise, over the one that the plan predicts of noise.

    Parameters
    ----------
    stand, overrides : as of `plan`
    checked : Option
    runs : int, simulated measurements, of one recording or of all of them
    seed : int

    Returns
    -------
    (p,) float
        Root mean square of the error over the predicted standard deviation, for each quantity of `checked.keys`; its
        own deviation is about 1/sqrt(2 runs). NaN where the noise has no influence.

    Raises
    ------
    InputError
        If more than `MOST_FAILED` of the measurements cannot be evaluated.

    Notes
    -----
    The number of modes is given, and the search begins at the expected body.
    """
    task = task_of(stand, 1.0, overrides)
    random, rows = np.random.default_rng(seed), [k - 1 for k in checked.sensors]
    pairs = list(zip(task.recordings, checked.pulls, strict=True))
    given = [with_sensors(one, rows, lines(one, pull, rows).frequency.size) for one, pull in pairs]
    exact = [reading_of(one, pull, checked.rate, checked.samples, rows) for one, pull in pairs]
    truth = predicted(task, checked.pulls, checked.rate, checked.samples, rows)
    errors, failed = [], []
    for _ in progress.track(range(runs), "simulating recordings"):
        try:
            seen = [
                recording_of(one, modal.find(with_noise(one, clean, random, rows), own), rows)
                for (one, _), clean, own in zip(pairs, exact, given, strict=True)
            ]
            of = posed(task, seen, rows)
            found = solve(of.problem, "least squares", [of.problem.initial_estimate])
            values = weighted(of.problem, np.array([found.values[name] for name in of.problem.unknown]), of.inputs)
        except InputError as error:
            failed.append(str(error))
            continue
        errors.append(truth.scale * values - truth.values)
    if len(failed) > MOST_FAILED * runs:
        raise InputError(f"{len(failed)} of {runs} simulated recordings cannot be evaluated; the first: {failed[0]}")
    return over(np.sqrt(np.mean(np.square(errors), axis=0)), truth.noise)


def _least_samples(shown: Sequence[ExpectedLines], rate: float, detrend: str) -> int:
    """Samples in which an identification can distinguish the lines of every recording."""
    longest = max(max(LEAST_PERIODS * 2.0 * math.pi / float(one.frequency.min()), one.least_duration) for one in shown)
    enough = 2 * (4 * max(one.frequency.size for one in shown) + 1 + DETREND[detrend])
    return max(math.ceil(longest * rate) + 1, enough)


def _most_samples(task: PlanningTask, rate: float) -> int:
    """Samples of the longest record that is allowed."""
    most = math.floor(task.planned.duration * rate) + 1
    if most > MOST_SAMPLES:
        raise InputError(
            f"plan.duration is {task.planned.duration:g} s, at {rate:.6g} Hz {most:.3g} samples; at most "
            f"{MOST_SAMPLES:.0e} are planned: give a shorter plan.duration or a lower plan.rate"
        )
    return most


def option(task: PlanningTask, wanted: float, pulls: tuple[Pull, ...], rate: float, rows: Sequence[int]) -> Option:
    """The shortest recordings that reach the wanted uncertainty, or the longest ones that are allowed.

    Notes
    -----
    Of the squares of the uncertainties that of the noise falls about with the third power of the length, as long as the
    swing has not decayed. Lengths follow from that, in turns, between those that have been tried.
    """
    try:
        shown = [lines(one, pull, rows) for one, pull in zip(task.recordings, pulls, strict=True)]
    except InputError as error:
        return without_result(pulls, rate, task.planned.duration, rows, str(error))
    most = _most_samples(task, rate)
    least = _least_samples(shown, rate, task.given.identification.detrend)
    if least > most:
        text = (
            f"plan.duration is {task.planned.duration:g} s; to distinguish the modes takes {(least - 1) / rate:.3g} s"
        )
        return without_result(pulls, rate, task.planned.duration, rows, text)
    longest = at(task, wanted, pulls, rate, most, rows)
    if not longest.reached:
        return longest
    below, reached = least, longest
    first = at(task, wanted, pulls, rate, least, rows)
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
        tried = at(task, wanted, pulls, rate, count, rows)
        if tried.reached:
            reached = tried
        else:
            below = count
    return reached


def _fewer_sensors(task: PlanningTask, wanted: float, full: Option) -> list[Option]:
    """The best sets of fewer and fewer sensors; each leaves out the one that is missed least."""
    found, rows = [full], tuple(k - 1 for k in full.sensors)
    while len(rows) > 1:
        tried = [
            option(task, wanted, full.pulls, full.rate, tuple(k for k in rows if k != out))
            for out in progress.track(rows, f"comparing sets of {len(rows) - 1} sensors")
        ]
        best = min(tried, key=lambda one: one.rank)
        found.append(best)
        if best.reason:
            break
        rows = tuple(k - 1 for k in best.sensors)
    return found


def _floor(task: PlanningTask, best: Option) -> tuple[tuple[tuple[str, float], ...], tuple[str, ...]]:
    """What a longer record does not improve: contributions of the inputs to the worst quantity; and warnings.

    Warnings are those of a simulated recording with noise, whose swing has the amplitude of the pull; of several
    recordings those on the amplitude.
    """
    rows = [k - 1 for k in best.sensors]
    found = predicted(task, best.pulls, best.rate, best.samples, rows)
    shares, warnings = list(found.shares), list(found.warnings)
    tasks: Sequence[SpringTask] = found.tasks
    bias = amplitude_share(tasks, found.problem, found.values / found.scale, found.P)
    if bias is not None:
        shares.append(bias[0]._replace(contribution=bias[0].contribution * found.scale))
        warnings += bias[1](np.hypot(found.std / found.scale, bias[0].contribution))
    if not task.given.has_mounting:
        (one,), (pull,) = task.recordings, best.pulls
        given = with_sensors(one, rows, lines(one, pull, rows).frequency.size)
        exact, hum = reading_of(one, pull, best.rate, best.samples, rows), []
        try:
            seen = modal.find(with_noise(one, exact, np.random.default_rng(1), rows), given)
            hum = [text for text in seen.warnings if "mains hum" in text]
            warnings = [*hum, *springs.evaluate(given, seen).warnings]
        except InputError as error:
            warnings = [*hum, f"a simulated recording could not be evaluated: {error}"]
    if task.given.remarks:
        warnings.append(task.given.remarks)
    i = int(np.nanargmax(best.relative))
    k, value = task.given.uncertainty.coverage_factor, abs(float(found.values[i]))
    parts = [
        (share.label, k * abs(float(share.contribution[i])) / value)
        for share in shares
        if not share.label.startswith(("noise:", "other measurements")) and share.contribution[i] != 0.0
    ]
    return tuple(sorted(parts, key=lambda one: -one[1])), tuple(warnings)
