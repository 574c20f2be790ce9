"""Coordinates with a margin: where each starts and ends, what is held meanwhile, and what a case asks of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Set
from typing import Any

import numpy as np

from evolvent.analysis.margins import factors as of
from evolvent.analysis.margins.keys import Margin, MarginLine
from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.positions import Position
from evolvent.kernels import axial
from evolvent.model.registry import motions_of
from evolvent_base.errors import InputError

Array = np.ndarray
#: What two gradients of one coordinate differ by, and a start that is the end of the travel, rad and m.
_ALIKE, _ARRIVED = 1e-9, 1e-9


@dataclasses.dataclass(frozen=True)
class MarginCoordinate:
    """A coordinate with a margin.

    Attributes
    ----------
    name : str; k : int, its row; of : (n,) int, all rows that measure the same coordinate
    angle : bool, whether it is an angle (rad, N m), else a travel (m, N)
    start, end : float, rad or m
    acceleration : float, rad/s2 or m/s2, 0 for none
    held, follow : names of the coordinates that are held, and of those that follow by constraints and cables
    zero : resistances that are declared to be zero
    """

    name: str
    k: int
    of: tuple[int, ...]
    angle: bool
    start: float
    end: float
    acceleration: float
    zero: frozenset[str]
    held: tuple[str, ...] = ()
    follow: tuple[str, ...] = ()

    @property
    def sense(self) -> float:
        """1 where the coordinate grows along its travel, else -1."""
        return 1.0 if self.end > self.start else -1.0

    @property
    def units(self) -> tuple[str, str]:
        """Units of the coordinate and of its torque or force."""
        return ("rad", "N m") if self.angle else ("m", "N")


def coordinates_of(mechanism: Mechanism, keys: Margin, at: Position) -> list[MarginCoordinate]:
    """All coordinates with a margin.

    Raises
    ------
    InputError
        For a coordinate whose travel has no end, or one that the case names and that is none.
    """
    names, rows = mechanism.names, motions_of(mechanism.whole)
    found = []
    for same in ([k for k in group if k not in mechanism.measured] for group in _alike(at.J)):
        if not same:
            continue
        asked = [k for k in same if names[k] in keys.lines]
        if len(asked) > 1:
            first, second = (names[k] for k in asked[:2])
            raise InputError(
                f"margin.lines has {first!r} and {second!r}, which are one coordinate; leave one of them out"
            )
        ends = [k for k in same if math.isfinite(rows["latch"][k])] or [
            k for k in same if np.isfinite(rows[["low", "high"]][k].tolist()).any()
        ]
        k = (asked or ends or same)[0]
        line = keys.lines.get(names[k], MarginLine())
        if line.leave_out:
            continue
        travel = _travel(names[k], rows, ends, float(at.x[k]), line)
        if travel is None:
            continue
        if not names[k]:
            raise InputError("a coordinate has no name; give its joint a JointSpring")
        found.append(
            MarginCoordinate(
                names[k], k, tuple(same), bool(rows["kind"][k] == axial.ANGLE), *travel,
                acceleration=specified_acceleration(line, *travel), zero=frozenset((*keys.zero, *line.zero)),
            )
        )  # fmt: skip
    if not found:
        raise InputError(
            "no coordinate of the system has a margin; it needs a hinge or slide that moves to a latch or stop"
        )
    return found


def _alike(J: Array) -> list[list[int]]:
    """Rows with the same gradient, one way or the other."""
    found: list[list[int]] = []
    for k in range(len(J)):
        size = float(np.abs(J[k]).max(initial=0.0))
        for group in found:
            first = J[group[0]]
            if min(np.abs(J[k] - first).max(), np.abs(J[k] + first).max()) <= _ALIKE * size:
                group.append(k)
                break
        else:
            found.append([k])
    return found


def _travel(name: str, rows: Any, ends: list[int], x: float, line: MarginLine) -> tuple[float, float] | None:
    """Start and end; None of a coordinate that has arrived.

    Raises
    ------
    InputError
        Where the end is not known.
    """
    if line.travel is not None:
        start, end = map(float, line.travel)
        if abs(end - start) <= _ARRIVED:
            raise InputError(f"margin.lines.{name}.travel is {list(line.travel)!r}; its ends must differ")
        return start, end
    if ends and math.isfinite(rows["latch"][ends[0]]):
        end = float(rows["latch"][ends[0]])
        return None if abs(end - x) <= _ARRIVED else (x, end)
    stops = [float(rows[key][k]) for k in ends for key in ("low", "high")]
    away = [end for end in stops if math.isfinite(end) and abs(end - x) > _ARRIVED]
    if len(away) == 1:
        return x, away[0]
    why = "has two stops" if away else "has no latch and no stop"
    raise InputError(
        f"{name!r} {why}; give margin.lines.{name}.travel, from and to, or say by margin.lines.{name}.leave_out why it "
        f"has no margin"
    )


def specified_acceleration(line: MarginLine, start: float, end: float) -> float:
    """The specified acceleration, or that which the specified time asks for; 0 for none."""
    if line.duration is not None:
        return 2.0 * abs(end - start) / float(line.duration) ** 2
    return float(line.acceleration or 0.0)


def with_others(mechanism: Mechanism, found: list[MarginCoordinate], at: Position) -> list[MarginCoordinate]:
    """The coordinates, each with those that are held while it moves and those that follow."""
    result = []
    for one in found:
        held, follow = mechanism.held_with(one.k, at)
        names = [tuple(mechanism.names[j] for j in group if j not in one.of) for group in (held, follow)]
        result.append(dataclasses.replace(one, held=names[0], follow=names[1]))
    return result


def refuse_unstated(coordinate: MarginCoordinate, given: Set[str], known: of.Standard) -> None:
    """Refuse a coordinate with a resistance that is neither given by a part nor declared to be zero.

    Parameters
    ----------
    given : categories that a part gives somewhere along the travel

    Raises
    ------
    Unstated
    """
    name = coordinate.name
    asked = {category for one in known.requirements.values() for category in (*one.resisting, *one.added)}
    for category in of.STATED:
        if category in given and category in coordinate.zero:
            raise InputError(f"margin: {category} of {name!r} is declared to be zero, but the case gives it")
    missing = [c for c in of.STATED if c in asked and c not in given and c not in coordinate.zero]
    if missing:
        verb, them = ("is", "it") if len(missing) == 1 else ("are", "them")
        raise of.Unstated(
            f"margin: {', '.join(missing)} of {name!r} {verb} neither given nor declared to be zero; add a part, or "
            f"name {them} under margin.zero or margin.lines.{name}.zero",
            name,
            missing,
        )
