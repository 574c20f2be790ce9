"""Back onto the constraints after a step."""

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, entry, indirect, kernel
from evolvent.flow.explicit_flexible import release_penalties
from evolvent.flow.impulse import impulse, prepare
from evolvent.kernels import constraint_rows, rigid, thread
from evolvent.kernels.linalg import banded_ldl_solve
from evolvent.model import MODEL


@entry(MODEL)
@kernel
def is_corrected(model):
    """Whether `project` has anything to correct: links, fixed segments, quaternions, joints that are released."""
    found = model.links.size > 0
    for k in range(model.flexible.joints.size):
        found = found or model.flexible.joints[k].until < np.inf
    for b in range(model.bodies.size):
        found = found or model.bodies[b].motion == rigid.FREE
    for p in range(model.threads.size):
        found = found or model.threads[p].kind == thread.INEXTENSIBLE
    return found


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL))
def project(t, y, s, model):
    """Bring the state back onto its constraints; returns 1 if that changed it more than round-off of a rate.

    Quaternions and tangents are normalised, rates made perpendicular to their tangents; links are drawn to their
    length and rate along their own directions, weighted by the masses (which keeps momentum).
    """
    threads, bodies = model.threads, model.bodies
    for b in range(bodies.size):
        if bodies[b].motion == rigid.FREE:
            rigid.normalise_quaternion(y, bodies[b].iq + 3)
    for p in range(threads.size):
        if threads[p].kind == thread.INEXTENSIBLE:
            thread.project_chain(y, s, threads, p)
    changed = 0
    if model.links.size > 0 or model.guides.size > 0:
        project_links(t, y, s, model)
        changed = 1
    if model.info.penalties > 0:
        release_penalties(t, y, model)
    return changed


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def project_links(t, y, s, model):
    """Positions (two Newton iterations), then velocities, of a model with links or guides."""
    rows, points, bodies = model.rows, model.points, model.bodies
    n = rows.size
    for _ in range(2):
        prepare(t, y, s, model)
        for r in range(n):
            model.la[r] = 0.0
            if rows[r].kind == constraint_rows.LINK:
                k = rows[r].index
                geometry = constraint_rows.link_geometry(y, model, k)
                model.la[r] = geometry[0] - model.links[k].length
            elif rows[r].kind == constraint_rows.GUIDE:
                model.la[r] = -constraint_rows.guide_geometry(model.guides, bodies, rows[r].index)[0]
        banded_ldl_solve(model.A, n, model.info.bandwidth, model.la)
        for r in range(n):
            if rows[r].kind == constraint_rows.THREAD:
                continue
            for side in range(2):
                sign = model.la[r] if side == 0 else -model.la[r]
                b, i = rows[r].body[side], rows[r].point[side]
                if b >= 0:
                    for c in range(6):
                        bodies[b].a[c] += sign * rows[r].Z[side, c]
                elif i >= 0:
                    for c in range(3):
                        y[points[i].iq + c] += sign * rows[r].e[c] / points[i].mass
        for b in range(bodies.size):
            rigid.shift_body(y, bodies, b)
    prepare(t, y, s, model)
    for r in range(n):
        if rows[r].kind == constraint_rows.LINK:
            k = rows[r].index
            rows[r].rx = constraint_rows.link_geometry(y, model, k)[1]
        elif rows[r].kind == constraint_rows.GUIDE:
            rows[r].rx = -constraint_rows.guide_geometry(model.guides, bodies, rows[r].index)[1]
    impulse(y, s, model)
