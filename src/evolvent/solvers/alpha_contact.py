"""Contact forces that are means over a step (the law CONSERVATIVE); see `evolvent.solvers.alpha`."""

from __future__ import annotations

from numba import types, void

from evolvent.flow import powers as eq
from evolvent.flow.implicit import residual
from evolvent.jit import REAL, indirect, inlined
from evolvent.kernels import contact, contact_laws, rigid, sparse_lu
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha import solve_step, step_of
from evolvent.solvers.alpha_state import (
    AS_IT_IS,
    DONE,
    SINGULAR,
    WORKSPACE,
    factor_at,
    short_c_mass,
)

_I, _B = types.int64, types.boolean

#: Part of mean contact forces that stiffness carries for which a step is solved once more; their change by that at
#: which it is not.
LEAST_PART, FOLLOWS = 1e-2, 0.25
#: Change of that part, beside the forces, below which a step is not solved once more.
KEPT = 1e-9


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def add_mean_forces(t, h, model, matrix, work):
    """Add the contact forces f that are means over a step to the start, where nothing of them stands; returns a status.

    Notes
    -----
    Steps go on with accelerations that hold the part g of f which stiffness carries, and nothing of the rest, M w. A
    start without g would not stay at rest where it is in equilibrium. Multipliers and wrenches are those of all of f.
    """
    options = work.options
    n_v, f, g, cylinders = work.dq.size, work.w1, work.g1, model.flexible.cylinders
    first = work.x.size - work.la.size
    if not contact.step_forces(model, f):
        return DONE
    rubs = False
    for k in range(cylinders.size):
        rubs = rubs or cylinders[k].friction > 0.0
    for i in range(n_v):
        g[i] = 0.0
    if options.tolerance == 0.0 and not rubs and find_stiff_part(t, h, model, matrix, work) < 0:
        return SINGULAR
    c_mass = short_c_mass(options)
    work.loop.stale = 1
    for part in range(2):
        if factor_at(t, work.y, work.la, c_mass, 0.0, c_mass * options.mass, model, matrix, work) != 0:
            return SINGULAR
        for i in range(work.x.size):
            work.x[i] = 0.0
        for i in range(n_v):
            work.x[i] = g[i] if part == 0 else f[i]
        sparse_lu.solve(matrix, work.x)
        for i in range(n_v):
            if part == 0:
                work.spare[i] = c_mass * work.x[i]
                work.a1[i] += work.spare[i]
                work.dv1[i] += work.spare[i]
            else:
                f[i] = c_mass * work.x[i] - work.spare[i]  # w
        if part == 1:
            for k in range(work.la.size):
                work.la[k] += c_mass * options.mass * work.x[first + k]
    residual(t, work.y, work.dv1, work.la, 0.0, 1.0, model, work.r, work.powers[0])
    for k in range(cylinders.size):
        if cylinders[k].law == contact_laws.CONSERVATIVE:
            for i in range(6):
                model.bodies[cylinders[k].body].F[i] += cylinders[k].F[i]
    return DONE


@indirect(_I(REAL, REAL, _I, MODEL, SPARSE, WORKSPACE))
def solve_with_stiff_part(t, h, found, model, matrix, work):
    """Solve a fixed step again with the part of mean forces that stiffness carries; returns as `step_of` does.

    Where the forces follow that (a contact that is stiffer than what it pushes), the step stays as it was, and so it
    does with friction, whose forces go on as those of rest do.
    """
    f, before, g, n_v = work.w1, work.g0, work.g1, work.dq.size
    for k in range(model.flexible.cylinders.size):
        if model.flexible.cylinders[k].friction > 0.0:
            return found
    last = work.spare[n_v : 2 * n_v]
    for i in range(n_v):
        last[i] = g[i]
    counts = find_stiff_part(t, h, model, matrix, work)
    if counts < 0:
        return SINGULAR
    change = largest = 0.0
    for i in range(n_v):
        change, largest = max(change, abs(g[i] - last[i])), max(largest, abs(f[i]), abs(last[i]))
        before[i] = f[i]
    if change <= KEPT * largest:
        return found
    if counts > 0:
        again = step_of(t, h, AS_IT_IS, model, matrix, work)
        if again > 0:
            residual(t, work.y, work.dv1, work.la, h, 1.0, model, work.r, work.powers[0])
            contact.step_forces(model, f)
            change = largest = 0.0
            for i in range(n_v):
                change, largest = max(change, abs(f[i] - before[i])), max(largest, abs(before[i]))
            if change <= FOLLOWS * largest:
                return found + again
    for i in range(n_v):
        g[i] = 0.0
    for i in range(work.la.size):
        work.la[i] = work.la0[i]
    work.loop.stale = 1
    again = solve_step(t, h, model, matrix, work)
    if again > 0:
        residual(t, work.y, work.dv1, work.la, h, 1.0, model, work.r, work.powers[0])
    return again


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def find_stiff_part(t, h, model, matrix, work):
    """Find the part g of contact forces f, means over the step, that stiffness and joints carry at once.

    Returns whether it counts (0 or 1), -1 without a solution. f stays in the place of w.

    Notes
    -----
    g = f - c M x with (c M + K) x + G^T mu = f, G x = 0, the contact's own stiffness left out. Any g will do; with this
    one little is left of what `correct_velocities` would set right in motions that the step does not resolve.
    """
    options = work.options
    n_v, f, g, A = model.info.nv, work.w1, work.g1, work.dv1
    cylinders = model.flexible.cylinders
    if not contact.step_forces(model, f):
        for i in range(n_v):
            g[i] = 0.0
        return 0
    for i in range(work.x.size):
        work.x[i] = 0.0
    for i in range(n_v):
        work.x[i] = f[i]
    c_mass = (1.0 - options.alpha_m) / (options.beta * h * h * (1.0 - options.alpha_f))
    work.loop.stale = 1
    for k in range(cylinders.size):
        cylinders[k].share = 0.0
    found = factor_at(t, work.y, work.la, c_mass, 0.0, c_mass * options.mass, model, matrix, work)
    for k in range(cylinders.size):
        cylinders[k].share = options.share if cylinders[k].law == contact_laws.CONSERVATIVE else 1.0
    if found != 0:
        return -1
    sparse_lu.solve(matrix, work.x)
    for i in range(n_v):
        work.spare[i] = A[i]
        A[i] += c_mass * work.x[i]
    residual(t, work.y, A, work.la, h, 1.0, model, work.x, work.powers[0])
    for i in range(n_v):
        A[i] = work.spare[i]
    residual(t, work.y, A, work.la, h, 1.0, model, work.r, work.powers[0])
    most = largest = 0.0
    for i in range(n_v):
        g[i] = f[i] - (work.x[i] - work.r[i])
        most, largest = max(most, abs(g[i])), max(largest, abs(f[i]))
    if most > LEAST_PART * largest:
        return 1
    for i in range(n_v):
        g[i] = 0.0
    return 0


@indirect(_B(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def correct_velocities(t, h, model, matrix, work):
    """Set right the velocities, accelerations and wrenches of a step with contact forces that are means over it."""
    options = work.options
    n_q, n_v, w, g = model.info.nq, model.info.nv, work.w1, work.g1
    some = contact.step_forces(model, w)
    for i in range(work.x.size):
        work.x[i] = 0.0
    for i in range(n_v):
        some = some or g[i] != 0.0
        work.x[i] = w[i] - g[i]
        w[i] = 0.0
    if not some:
        add_rest_of_wrenches(model, work)
        return True
    c_mass = short_c_mass(options)
    work.loop.stale = 1
    if factor_at(t, work.y, work.la, c_mass, 0.0, c_mass * options.mass, model, matrix, work) != 0:
        return False
    sparse_lu.solve(matrix, work.x)
    beta, gamma = options.beta, options.gamma
    for i in range(n_v):
        w[i] = c_mass * work.x[i]
        work.y[n_q + i] += h * w[i] * (1.0 - gamma / (2.0 * beta))
        work.a1[i] -= w[i] / (2.0 * beta)
        work.dv1[i] -= options.share * w[i]
    for k in range(work.la.size):
        work.la[k] -= (options.share - 1.0) * c_mass * options.mass * work.x[n_v + k]
    # powers and wrenches of the velocities as they are now
    residual(t, work.y, work.dv1, work.la, h, 1.0, model, work.r, work.powers[0])
    add_rest_of_wrenches(model, work)
    return True


@indirect(void(MODEL, WORKSPACE))
def add_rest_of_wrenches(model, work):
    """Wrenches of bodies, and the power that turns driven ones, with all of the forces that are means."""
    cylinders, bodies = model.flexible.cylinders, model.bodies
    for k in range(cylinders.size):
        if cylinders[k].law == contact_laws.CONSERVATIVE:
            G, b = cylinders[k].F, cylinders[k].body
            if bodies[b].motion == rigid.DRIVEN:
                work.powers[0, eq.DRIVEN] -= cylinders[k].share * driven_power(cylinders, bodies, k)
            for i in range(6):
                bodies[b].F[i] += (1.0 - cylinders[k].share) * G[i]


@inlined
def driven_power(cylinders, bodies, k):
    """Power that turns a driven body against the contacts of cylinder k, W."""
    w, G = bodies[cylinders[k].body].w, cylinders[k].F
    return -(w[0] * G[3] + w[1] * G[4] + w[2] * G[5])
