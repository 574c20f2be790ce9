"""The functions of a model that solvers call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import f8, i8, typeof, types, void

from evolvent import jit
from evolvent.flow.events import apply_event, event_values
from evolvent.flow.inventory import inventory
from evolvent.flow.observations import Observations, empty_observations, fill_observations
from evolvent.flow.projection import project
from evolvent.flow.rhs import rhs
from evolvent.model import N_INVENTORY, Model


class Flow(NamedTuple):
    """The functions of a model that solvers call, each in a 1-tuple (typed by numba as a function pointer)."""

    rhs: tuple[Any]
    inventory: tuple[Any]
    events: tuple[Any]
    apply: tuple[Any]
    project: tuple[Any]


def bind_flow(model: Model) -> Flow:
    """Compile (or load) the functions of `model`; the same for every model, since all are of one type."""
    m, y, s = typeof(model), f8[::1], i8[::1]
    derivative = void(f8, y, s, m, y)
    pointer = types.UniTuple(types.FunctionType(derivative), 1)
    return Flow(
        rhs=(jit.bind(rhs, derivative),),
        inventory=(jit.bind(inventory, derivative),),
        events=(jit.bind(event_values, derivative),),
        apply=(jit.bind(apply_event, types.int64(f8, y, s, m, i8, pointer, pointer)),),
        project=(jit.bind(project, types.int64(f8, y, s, m)),),
    )


def observe(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> Observations:
    """Evaluate all quantities at the samples of a run.

    Parameters
    ----------
    model : Model
    t, y, s : (nt,), (nt, ny), (nt, ns), as in `evolvent.solvers.Solution`
    """
    out = empty_observations(model, t.size)
    flow = bind_flow(model)
    fill_observations(flow.rhs, flow.inventory, t, np.ascontiguousarray(y), np.ascontiguousarray(s), model, *out)
    return out


def state_sums(model: Model, t: float, y: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Energies and momenta of one state: (N_INVENTORY,) float, see `evolvent.flow.inventory`."""
    out = np.empty(N_INVENTORY)
    bind_flow(model).inventory[0](t, y, s, model, out)
    return out
