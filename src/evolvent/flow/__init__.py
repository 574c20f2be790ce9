"""The functions of a model that solvers call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import f8, i8, typeof, types, void

from evolvent import jit
from evolvent.flow import implicit
from evolvent.flow.events import apply_event, event_values
from evolvent.flow.inventory import inventory
from evolvent.flow.observations import Observations, empty_observations, fill_observations
from evolvent.flow.projection import project
from evolvent.flow.rhs import rhs
from evolvent.kernels import blocks
from evolvent.model import N_INVENTORY, Model


class Signatures(NamedTuple):
    """Types of the functions of a model that solvers call."""

    rhs: Any
    inventory: Any
    events: Any
    apply: Any
    project: Any


def signatures(model: Model) -> Signatures:
    """The signatures with which the functions of `model` are compiled."""
    m, y, s = typeof(model), f8[::1], i8[::1]
    rates = void(f8, y, s, m, y)
    return Signatures(
        rates, rates, rates, types.int64(f8, y, s, m, i8, y, pointer(rates), pointer(rates)), types.int64(f8, y, s, m)
    )


def pointer(signature: Any) -> Any:
    """Type of a 1-tuple of a function with that signature."""
    return types.UniTuple(types.FunctionType(signature), 1)


def bind_rates(model: Model) -> tuple[Any, Any, Any]:
    """Compile (or load) right-hand side, inventory and events of `model`, each in a 1-tuple."""
    kind = signatures(model)
    return (jit.bind(rhs, kind.rhs),), (jit.bind(inventory, kind.inventory),), (jit.bind(event_values, kind.events),)


def bind_corrections(model: Model) -> tuple[Any, Any]:
    """Compile (or load) what changes a state between steps: apply_event and project, each in a 1-tuple."""
    kind = signatures(model)
    return (jit.bind(apply_event, kind.apply),), (jit.bind(project, kind.project),)


class Equations(NamedTuple):
    """The implicit equations of motion and their linear solver, each compiled by itself, in a 1-tuple."""

    residual: Any
    tangent: Any
    energies: Any
    keep_momentum: Any
    factor: Any
    solve: Any


def bind_equations(model: Model, matrix: blocks.Bordered) -> Equations:
    """Compile (or load) what implicit solvers call."""
    m, x, A = typeof(model), f8[::1], typeof(matrix)
    return Equations(
        residual=(jit.bind(implicit.residual, void(f8, x, x, x, f8, f8, m, x, x)),),
        tangent=(jit.bind(implicit.tangent, void(f8, x, x, f8, f8, f8, m, A)),),
        energies=(jit.bind(implicit.energies, void(f8, x, m, x)),),
        keep_momentum=(jit.bind(implicit.keep_momentum, void(f8, f8, x, x, m, x, x)),),
        factor=(jit.bind(blocks.factor, types.int64(A)),),
        solve=(jit.bind(blocks.solve, void(A, x)),),
    )


def observe(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> Observations:
    """Evaluate all quantities at the samples of a run.

    Parameters
    ----------
    model : Model
    t, y, s : (nt,), (nt, ny), (nt, ns), as in `evolvent.solvers.Solution`
    """
    out = empty_observations(model, t.size)
    derivative, sums, _ = bind_rates(model)
    fill_observations(derivative, sums, t, np.ascontiguousarray(y), np.ascontiguousarray(s), model, *out)
    return out


def state_sums(model: Model, t: float, y: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Energies and momenta of one state: (N_INVENTORY,) float, see `evolvent.flow.inventory`."""
    out = np.empty(N_INVENTORY)
    bind_rates(model)[1][0](t, y, s, model, out)
    return out
