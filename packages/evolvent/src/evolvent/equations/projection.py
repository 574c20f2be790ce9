"""Back onto the constraints after a step."""

import numpy as np
from numba import types, void

from evolvent.algebra.linalg import banded_ldl_solve
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, entry, indirect, inlined, kernel
from evolvent.equations.between_steps import release_penalties
from evolvent.kernels import constraint_rows, joint
from evolvent.kernels.blocks import ROTATION, normalise
from evolvent.kernels.calls import project_at
from evolvent.kernels.impulse import impulse, prepare
from evolvent.model import MODEL


@entry(MODEL)
@kernel
def is_corrected(model):
    """Whether `project` has anything to correct: joints, fixed segments, quaternions, joints that are released."""
    found = constraint_rows.has_joints(model)
    for k in range(model.joints.size):
        found = found or model.joints[k].until < np.inf
    for k in range(model.blocks.size):
        found = found or model.blocks[k].kind == ROTATION
    return found or model.project_calls.size > 0


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL))
def project(t, y, s, model):
    """Bring the state back onto its constraints; returns 1 if that changed it more than round-off of a rate.

    Quaternions and tangents are normalised, rates made perpendicular to their tangents; joints are drawn to
    their gap and rate along their own directions, weighted by the masses (which keeps momentum).
    """
    normalise(model.blocks, y)
    calls = model.project_calls
    for k in range(calls.size):
        project_at(model, calls[k])(y, s, model)
    changed = 0
    if constraint_rows.has_joints(model):
        project_joints(t, y, s, model)
        changed = 1
    if model.info.penalties > 0:
        release_penalties(t, y, model)
    return changed


@inlined
def _held(t, s, r, model):
    """Whether row r is a joint that acts."""
    return model.rows[r].kind == constraint_rows.JOINT and joint.acts(t, s, model.joints, model.rows[r].index)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL), used_for=constraint_rows.HELD)
def project_joints(t, y, s, model):
    """Positions (two Newton iterations), then velocities, of a model with joints that are constraints."""
    rows, joints, n = model.rows, model.joints, model.rows.size
    for _ in range(2):
        prepare(t, y, s, model)
        for r in range(n):
            model.la[r] = joints[rows[r].index].gap if _held(t, s, r, model) else 0.0
        banded_ldl_solve(model.A, n, model.info.bandwidth, model.la)
        constraint_rows.move_sides(model, y)
    prepare(t, y, s, model)
    for r in range(n):
        if _held(t, s, r, model):
            rows[r].rx = joints[rows[r].index].rate
    impulse(y, s, model)
