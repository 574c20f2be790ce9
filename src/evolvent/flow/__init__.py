"""The functions of a model that solvers call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import f8, i8, typeof, types, void

from evolvent import jit
from evolvent.flow import implicit, implicit_thread
from evolvent.flow.events import apply_event, event_values
from evolvent.flow.inventory import inventory
from evolvent.flow.observations import Observations, empty_observations, fill_observations
from evolvent.flow.penalties import whole_inventory, whole_project
from evolvent.flow.projection import project
from evolvent.flow.rhs import flexible_rhs, rhs
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
    rates, sums = (flexible_rhs, whole_inventory) if is_flexible(model) else (rhs, inventory)
    return (jit.bind(rates, kind.rhs),), (jit.bind(sums, kind.inventory),), (jit.bind(event_values, kind.events),)


def is_flexible(model: Model) -> bool:
    """Whether a model has beams, or joints between other parts."""
    return bool(model.flexible.beams.size or model.flexible.joints.size)


def bind_corrections(model: Model) -> tuple[Any, Any]:
    """Compile (or load) what changes a state between steps: apply_event and project, each in a 1-tuple."""
    kind = signatures(model)
    correct = whole_project if is_flexible(model) else project
    return (jit.bind(apply_event, kind.apply),), (jit.bind(correct, kind.project),)


class Equations(NamedTuple):
    """The implicit equations of motion and their linear solver, each compiled by itself, in a 1-tuple."""

    residual: Any
    tangent: Any
    energies: Any
    keep_momentum: Any
    factor: Any
    solve: Any


def _equation_signatures(model: Model, matrix: blocks.Bordered) -> Equations:
    m, x, A = typeof(model), f8[::1], typeof(matrix)
    return Equations(
        residual=void(f8, x, x, x, f8, f8, m, x, x),
        tangent=void(f8, x, x, f8, f8, f8, m, A),
        energies=void(f8, x, m, x),
        keep_momentum=void(f8, f8, x, x, m, x, x),
        factor=types.int64(A),
        solve=void(A, x),
    )


def bind_equations(model: Model, matrix: blocks.Bordered) -> Equations:
    """Compile (or load) what implicit solvers call."""
    residual, tangent, energies = implicit.residual, implicit.tangent, implicit.energies
    if model.threads.size:
        residual, tangent = implicit_thread.residual_with_threads, implicit_thread.tangent_with_threads
        energies = implicit_thread.energies_with_threads
    functions = Equations(
        residual=residual,
        tangent=tangent,
        energies=energies,
        keep_momentum=implicit.keep_momentum,
        factor=blocks.factor,
        solve=blocks.solve,
    )
    kinds = _equation_signatures(model, matrix)
    return Equations(*((jit.bind(function, kind),) for function, kind in zip(functions, kinds, strict=True)))


def bind_linear_solver(model: Model, matrix: blocks.Bordered) -> None:
    """Compile (or load) the tangent and its solution alone: half of what `bind_equations` compiles."""
    kinds = _equation_signatures(model, matrix)
    jit.bind(implicit.tangent, kinds.tangent)
    jit.bind(blocks.factor, kinds.factor)
    jit.bind(blocks.solve, kinds.solve)


def equation_types(model: Model, matrix: blocks.Bordered) -> Any:
    """Type of what `bind_equations` returns, known before any of it is compiled."""
    return types.NamedTuple([pointer(kind) for kind in _equation_signatures(model, matrix)], Equations)


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
