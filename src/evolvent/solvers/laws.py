"""Users' laws are tried once before a run, where a mistake can still be told in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import jit
from evolvent.builder import Assembly
from evolvent.errors import InputError
from evolvent.flow.impulse import prepare
from evolvent.flow.needs import load_preparation
from evolvent.kernels import feed, loads, springs


def try_laws(assembly: Assembly, start: float, end: float) -> None:
    """Evaluate every law of a model: feeds at `start` and `end`, springs and events at the start, loads at the reel.

    Raises
    ------
    InputError
        If a law raises an exception or returns anything but finite numbers.
    """
    if not assembly.laws:
        return
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    for k, row in enumerate(model.threads):
        if row["feed"] == feed.LAW:
            for time in (start, end):
                _attempt(assembly, "threads", k, time, time=time)
    load_preparation(model)
    prepare(start, y, s, model)  # places bodies and spools
    for k, row in enumerate(model.springs):
        if row["law"] != 0:
            a, b = (
                np.array(springs.marker_kinematics(y, model.markers, model.points, model.bodies, row[side]))
                for side in ("a", "b")
            )
            length = float(np.linalg.norm(b[:3] - a[:3]))
            rate = float((b - a)[:3] @ (b - a)[3:]) / length if length > 0.0 else 0.0
            _attempt(assembly, "springs", k, length - float(row["length"]), rate, start, time=start)
    for k, row in enumerate(model.loads):
        if row["kind"] == loads.LAW:
            Q = model.threads["Q"][row["target"]]
            _attempt(assembly, "loads", k, Q[:3].copy(), Q[3:].copy(), start, time=start)
    for k in range(model.events.size):
        _attempt(assembly, "events", k, start, y, time=start)


def _attempt(assembly: Assembly, family: str, index: int, *arguments: Any, time: float) -> None:
    """Evaluate the law of one row."""
    row = getattr(assembly.model, family)[index]
    parameters = assembly.model.parameters[row["first"] : row["last"]].copy()
    try:
        jit.try_law(assembly.laws[int(row["law"])], *arguments, parameters)
    except InputError as error:
        name = next(name for name, found in assembly.names.items() if found == (family, index))
        raise InputError(f"{name!r} at t = {time:g} s: {error}") from error
