"""What planned recordings will give: the budget of the identification at the expected body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.estimates import Share
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import undetermined
from evolvent_massprops.planning.expected import (
    COINCIDING,
    Option,
    PlanningTask,
    is_counted,
    lines,
    modal_of,
    recording_of,
    spring_task,
)
from evolvent_massprops.planning.pulls import Pull
from evolvent_massprops.springs_combined import joined, own_labels, shared_inputs, spelled_by_user, unknowns, with_keys
from evolvent_massprops.springs_inputs import Input, SpringsTask as SpringTask, stand_factor
from evolvent_massprops.springs_search import Recording, mountings, open_sentence, undetermined_near
from evolvent_massprops.springs_uncertainty import budget_of

Array = np.ndarray


class Undetermined(InputError):
    """Unknowns that the recordings do not determine; `count` combinations of them."""

    count = 0


class Posed(NamedTuple):
    """Planned recordings as one least squares.

    Attributes
    ----------
    problem : Combined
    keys : (p,) tuple of str, unknowns as the user names them
    tasks : tuple of SpringTask, one a recording
    inputs : list of Input
    own : tuple of str, keys that recordings state themselves
    spelled : mapping of names of unknowns to what the user writes
    """

    problem: Combined
    keys: tuple[str, ...]
    tasks: tuple[SpringTask, ...]
    inputs: list[Input]
    own: tuple[str, ...]
    spelled: dict[str, str]


class Prediction(NamedTuple):
    """What recordings will give.

    Attributes
    ----------
    keys : (p,) tuple of str
    values : (p,) float, as they are expected
    std : (p,) float, standard uncertainties, with all that is known
    noise : (p,) float, by the noise alone
    shares : tuple of Share, of each input and group of data
    scale : (p,) float, values over those of the problem's unknowns
    P : (p, r) float, of the problem's unknowns: dp = -P dr of a change of the residual
    problem, tasks, inputs : as of `Posed`
    warnings : tuple of str, on inputs that do not act in proportion
    """

    keys: tuple[str, ...]
    values: Array
    std: Array
    noise: Array
    shares: tuple[Share, ...]
    scale: Array
    P: Array
    problem: Combined
    tasks: tuple[SpringTask, ...]
    inputs: list[Input]
    warnings: tuple[str, ...]


class Mode(NamedTuple):
    """A mode as it will be identified.

    Attributes
    ----------
    recording : str, name of the recording
    frequency, frequency_std : float, rad/s
    decay_rate, decay_rate_std : float, 1/s
    damping_ratio, damping_ratio_std : float
    energy : float, J, that the pull gives it
    amplitude : float, m, the largest of the sensors'
    """

    recording: str
    frequency: float
    frequency_std: float
    decay_rate: float
    decay_rate_std: float
    damping_ratio: float
    damping_ratio_std: float
    energy: float
    amplitude: float


def posed(task: PlanningTask, recordings: Sequence[Recording], rows: Sequence[int]) -> Posed:
    """Recordings as the identification's least squares, set up at the expected body."""
    groups = mountings(recordings)
    unknown = unknowns(recordings, groups)
    keys = tuple(unknown)
    pairs = zip(task.recordings, recordings, strict=True)
    tasks = tuple(spring_task(one, recording, rows, keys) for one, recording in pairs)
    p = joined(recordings, tasks, groups, unknown)
    inputs = shared_inputs(recordings, tasks, groups, None)
    return Posed(p, keys, tasks, inputs, own_labels(recordings), spelled_by_user(unknown, recordings))


def predicted(task: PlanningTask, pulls: Sequence[Pull], rate: float, samples: int, rows: Sequence[int]) -> Prediction:
    """What recordings will give: the budget at the expected body, with the bound of the modes.

    Raises
    ------
    Undetermined
        Where the modes do not determine what is asked.
    InputError
        Where they cannot be distinguished.
    """
    pairs = list(zip(task.recordings, pulls, strict=True))
    recordings = [recording_of(one, modal_of(one, pull, rate, samples, rows), rows) for one, pull in pairs]
    of = posed(task, recordings, rows)
    p, values = of.problem, of.problem.initial_estimate
    combined = task.given.has_mounting
    reasons = undetermined_near(p, values) if combined else undetermined(p.jacobian(values), p.unknown, p.scale)
    if reasons:
        same = sorted({f"{w:.6g}" for one, pull in pairs for w in lines(one, pull, rows).coinciding})
        text = with_keys(open_sentence(reasons, recordings), of.spelled) if combined else "; ".join(reasons)
        if same:
            text += f"; several modes have the same frequency, {', '.join(same)} rad/s, and cannot be distinguished"
        error = Undetermined(text)
        error.count = len(reasons)
        raise error
    budget = budget_of(of.tasks[0], p, values, of.inputs, of.own)
    first = of.tasks[0]
    scale = np.array([stand_factor(first.given) / first.mean if key == "common_factor" else 1.0 for key in of.keys])
    shares = tuple(share._replace(contribution=share.contribution * scale) for share in budget.shares)
    parts = [share.contribution for share in shares if share.label.startswith("noise:")]
    return Prediction(
        keys=of.keys,
        values=values * scale,
        std=np.sqrt(np.diag(budget.covariance)) * scale,
        noise=np.sqrt(np.sum(np.square(parts), axis=0)),
        shares=shares,
        scale=scale,
        P=budget.P,
        problem=p,
        tasks=of.tasks,
        inputs=of.inputs,
        warnings=tuple(budget.warnings),
    )


def relative(task: PlanningTask, keys: Sequence[str], values: Array, std: Array) -> Array:
    """(p,) expanded, over the values; NaN of what may be zero."""
    counts = np.array([is_counted(key, keys) for key in keys])
    return task.given.uncertainty.coverage_factor * over(std, np.where(counts, np.abs(values), 0.0))


def over(numbers: Array, by: Array) -> Array:
    """Quotients; NaN for a divisor of 0."""
    return np.divide(numbers, by, out=np.full(len(by), np.nan), where=by > 0.0)


def at(
    task: PlanningTask, wanted: float, pulls: tuple[Pull, ...], rate: float, samples: int, rows: Sequence[int]
) -> Option:
    """Recordings of a given length."""
    try:
        found = predicted(task, pulls, rate, samples, rows)
    except (InputError, np.linalg.LinAlgError) as error:
        none = without_result(pulls, rate, (samples - 1) / rate, rows, str(error))
        return none._replace(open=error.count if isinstance(error, Undetermined) else 0)
    share = relative(task, found.keys, found.values, found.std)
    return Option(
        pulls=pulls,
        rate=rate,
        duration=(samples - 1) / rate,
        sensors=tuple(k + 1 for k in rows),
        reached=bool(np.nanmax(share) <= wanted),
        keys=found.keys,
        values=found.values,
        std=found.std,
        relative=share,
        noise=relative(task, found.keys, found.values, found.noise),
    )


def without_result(pulls: tuple[Pull, ...], rate: float, duration: float, rows: Sequence[int], reason: str) -> Option:
    """Recordings that cannot be evaluated."""
    numbers, none = tuple(k + 1 for k in rows), np.zeros(0)
    return Option(pulls, rate, duration, numbers, False, (), none, none, none, none, reason)


def modes_of(task: PlanningTask, best: Option) -> tuple[Mode, ...]:
    """The modes of every recording with their bounds."""
    rows, found = [k - 1 for k in best.sensors], []
    for one, pull in zip(task.recordings, best.pulls, strict=True):
        m = modal_of(one, pull, best.rate, best.samples, rows).modes
        own, energy = one.modes.frequency, one.modes.energy(pull.z)
        found += [
            Mode(
                one.name, float(m.frequency[k]), float(m.frequency_std[k]), float(m.decay_rate[k]),
                float(m.decay_rate_std[k]), float(m.damping_ratio[k]), float(m.damping_ratio_std[k]),
                float(energy[np.abs(own - m.frequency[k]) < COINCIDING * own].sum()), float(m.amplitude[k].max()),
            )
            for k in range(m.order)
        ]  # fmt: skip
    return tuple(found)
