"""The functions of a model that solvers call."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import f8, i8, typeof, types, void

from evolvent import jit
from evolvent.flow.events import apply_event, event_values
from evolvent.flow.projection import project
from evolvent.flow.rhs import rhs
from evolvent.model import Model


class Flow(NamedTuple):
    """The functions of a model that solvers call, each in a 1-tuple (typed by numba as a function pointer)."""

    rhs: tuple[Any]
    events: tuple[Any]
    apply: tuple[Any]
    project: tuple[Any]


def bind_flow(model: Model) -> Flow:
    """Compile (or load) the functions of `model`; the same for every model, since all are of one type."""
    m = typeof(model)
    y, s = f8[::1], i8[::1]
    return Flow(
        rhs=(jit.bind(rhs, void(f8, y, s, m, y)),),
        events=(jit.bind(event_values, void(f8, y, s, m, y)),),
        apply=(jit.bind(apply_event, types.int64(f8, y, s, m, i8)),),
        project=(jit.bind(project, types.int64(f8, y, s, m)),),
    )
