"""Back onto the constraints after a step."""

import numpy as np
from numba import types, void

from evolvent.algebra.linalg import banded_ldl_solve
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, entry, indirect, inlined, kernel
from evolvent.equations.between_steps import release_penalties
from evolvent.kernels import constraint_rows, constraints
from evolvent.kernels.blocks import ROTATION, normalise
from evolvent.kernels.calls import project_at
from evolvent.kernels.impulse import clear_wrenches_and_twists, jump, prepare, prepare_constrained_bodies
from evolvent.model import MODEL
from evolvent.model.questions import CONSTRAINT


@entry(MODEL)
@kernel
def is_corrected(model):
    """Whether `project` has anything to correct: constraints, fixed segments, quaternions, what is released."""
    found = constraint_rows.has_constraints(model)
    for k in range(model.constraints.size):
        found = found or model.constraints[k].until < np.inf
    for k in range(model.blocks.size):
        found = found or model.blocks[k].kind == ROTATION
    return found or model.node_events_project_calls.size > 0


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL))
def project(t, y, s, model):
    """Bring the state back onto its constraints; returns 1 if that changed it more than round-off of a rate.

    Quaternions and tangents are normalised, rates made perpendicular to their tangents; constraints are drawn to
    their gap and rate along their own directions, weighted by the masses (which keeps momentum).
    """
    normalise(model.blocks, y)
    calls = model.node_events_project_calls
    for k in range(calls.size):
        project_at(model, calls[k])(y, s, model)
    changed = 0
    if constraint_rows.has_constraints(model):
        project_constraints(t, y, s, model)
        changed = 1
    if model.info.penalties > 0:
        release_penalties(t, y, model)
    return changed


@inlined
def _held(t, s, r, model):
    """Whether row r is a constraint that acts."""
    row = model.rows[r]
    return row.kind == CONSTRAINT and constraints.acts(t, s, model.constraints, row.index)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL), used_for=constraint_rows.HELD)
def project_constraints(t, y, s, model):
    """Positions (two Newton iterations), then velocities, of a model with constraints."""
    rows, held, n, dy = model.rows, model.constraints, model.rows.size, model.dy[1]
    clear_wrenches_and_twists(model)
    for _ in range(2):
        _prepare_impulse(t, y, s, model)
        for r in range(n):
            model.la[r] = held[rows[r].index].gap if _held(t, s, r, model) else 0.0
        banded_ldl_solve(model.A, n, model.info.bandwidth, model.la)
        constraint_rows.move_sides(model, y)
    _prepare_impulse(t, y, s, model)
    for r in range(n):
        if _held(t, s, r, model):
            rows[r].rx = held[rows[r].index].rate
    for i in range(dy.size):
        dy[i] = 0.0
    jump(y, s, model, dy)


@kernel
def _prepare_impulse(t, y, s, model):
    """Prepare bodies and rows for an impulse; if no family locks inertia, only the bodies on which rows act."""
    if model.inertia_lock_calls.size > 0:
        prepare(t, y, s, model)
    else:
        prepare_constrained_bodies(t, y, s, model)
