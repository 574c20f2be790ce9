"""The case of the tie in the table of families: a pendulum."""

from __future__ import annotations

from typing import Any

import numpy as np
from tie import Tie

from evolvent import System, parts
from families.case import Array, Case, at, columns, of, swing

LENGTH, START, G = 0.8, 0.7, 9.81
FREQUENCY = np.sqrt(G / LENGTH)


def pendulum(clock: float | None = None, weight: float = G, **given: Any) -> System:
    """A point mass on a tie to a fixed place; an event at a time."""
    found = System(gravity=(0.0, 0.0, -weight))
    found.add(parts.Point(mass=2.0, position=(LENGTH * np.sin(START), 0.0, -LENGTH * np.cos(START))), "bob")
    if clock is not None:
        found.add(parts.Event(law=f"t - {clock}"), "clock")
    found.add(Tie(**{"a": (0.0, 0.0, 0.0), "b": "bob"} | given), "tie")
    return found


@of("a tie")
def case() -> Case:
    """The mathematical pendulum."""

    def motion(t: Array) -> Array:
        angle = swing(t, START, FREQUENCY)
        return columns(LENGTH * np.sin(angle), 0.0, -LENGTH * np.cos(angle))

    return Case(
        part="tie", system=pendulum, seen=at("bob"), motion=motion, end=2.0, step=1e-3, still=(0.0, 0.0, -LENGTH),
        poles=1j * FREQUENCY * np.ones(2),
    )  # fmt: skip
