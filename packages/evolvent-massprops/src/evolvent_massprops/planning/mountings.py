"""Which of the planned mountings suffice, and which further one would help most."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_massprops.description import OnSprings, load
from evolvent_massprops.mounting_keys import Mounting
from evolvent_massprops.planning.expected import Expected, Option, PlanningTask, expected
from evolvent_massprops.planning.predictions import at
from evolvent_massprops.springs_search import occupied

#: Rotations that are tried where the description names none.
ROTATIONS: tuple[Any, ...] = (
    "none", "90 deg about x", "90 deg about y", "90 deg about z", "180 deg about x", "45 deg about x", "45 deg about y",
    "45 deg about z", ("90 deg about x", "90 deg about y"), ("90 deg about z", "90 deg about y"),
    ("45 deg about x", "45 deg about z"),
)  # fmt: skip
#: Recordings with the body up to which all sets of them are compared.
MOST_COMPARED = 6


class MountingSet(NamedTuple):
    """Some of the recordings with the body, those without it among them.

    Attributes
    ----------
    names : tuple of str, of the recordings with the body
    option : Option, what they give, each as long as those of the best plan
    """

    names: tuple[str, ...]
    option: Option


class Further(NamedTuple):
    """One more recording of the body.

    Attributes
    ----------
    rotation : str, of the body, in words
    option : Option, what all recordings give with it, each as long as those of the best plan
    """

    rotation: str
    option: Option


def sets(task: PlanningTask, wanted: float, best: Option) -> tuple[MountingSet, ...]:
    """Of each number of recordings with the body the set with the least uncertainty; none for a single recording.

    Notes
    -----
    Recordings without the body stay in all sets. Of more than `MOST_COMPARED` the one is left out in turn that is
    missed least.
    """
    on = [k for k, one in enumerate(task.recordings) if occupied(one.given)]
    if len(on) < 2:
        return ()
    found, last = [], on
    for size in range(len(on), 0, -1):
        tried = list(itertools.combinations(on if len(on) <= MOST_COMPARED else last, size))
        options = [(_of(task, wanted, best, chosen), chosen) for chosen in tried]
        option, chosen = min(options, key=lambda pair: _rank(pair[0]))
        found.append(MountingSet(tuple(task.recordings[k].name for k in chosen), option))
        last = list(chosen)
    return tuple(reversed(found))


def _of(task: PlanningTask, wanted: float, best: Option, chosen: Sequence[int]) -> Option:
    """What some of the recordings with the body give, and all without it."""
    kept = [k for k, one in enumerate(task.recordings) if k in chosen or not occupied(one.given)]
    some = task._replace(recordings=tuple(task.recordings[k] for k in kept))
    pulls = tuple(best.pulls[k] for k in kept)
    return at(some, wanted, pulls, best.rate, best.samples, [k - 1 for k in best.sensors])


def further(task: PlanningTask, wanted: float, best: Option) -> tuple[Further, ...]:
    """What one more recording would give in each rotation that is not planned, the best first.

    Only where the plan has mountings, or names rotations in `plan.mountings`.
    """
    rotations: Sequence[Any] = task.planned.mountings
    if not rotations and len([one for one in task.recordings if occupied(one.given)]) < 2:
        return ()
    held = [(one.given.mounting or Mounting()).matrix for one in task.recordings if occupied(one.given)]
    found = []
    for rotation in progress.track(rotations or ROTATIONS, "comparing mountings"):
        mounting = Mounting.model_validate({"rotation": rotation})
        if any(np.allclose(mounting.matrix, R, atol=1e-9) for R in held):
            continue
        option = _with(task, wanted, best, mounting)
        if option is not None:
            found.append(Further(in_words(mounting), option))
    return tuple(sorted(found, key=lambda one: _rank(one.option)))


def _with(task: PlanningTask, wanted: float, best: Option, mounting: Mounting) -> Option | None:
    """What all recordings give with the body in one more mounting; None where the stand does not hold it."""
    written = mounting.model_dump(mode="json")["rotation"]
    keys = {"mounting.rotation": written, "mounting.body": True}
    given = load(task.given, keys)
    assert isinstance(given, OnSprings)
    try:
        one: Expected = expected("one more", given, tuple(keys))
    except InputError:
        return None
    pull = max(one.pulls, key=lambda pull: pull.least)
    more = task._replace(recordings=(*task.recordings, one), given=given)
    return at(more, wanted, (*best.pulls, pull), best.rate, best.samples, [k - 1 for k in best.sensors])


def in_words(mounting: Mounting) -> str:
    """Rotation of a mounting."""
    turns = [f"{np.degrees(angle):.6g} deg about {axis}" for angle, axis in mounting.rotation]
    return " then ".join(turns) or "none"


def _rank(option: Option) -> tuple[int, float]:
    """The less, the better: what leaves fewer unknowns open, then the smaller uncertainty."""
    return (option.open, option.worst) if not option.reason or option.open else (10**6, option.worst)
