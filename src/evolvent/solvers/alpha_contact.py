"""Contact forces that are means over a step (the law CONSERVATIVE); see `evolvent.solvers.alpha`."""

from __future__ import annotations

from numba import types, void

from evolvent.flow import powers as eq
from evolvent.flow.implicit import residual
from evolvent.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import contact, contact_laws, rigid, sparse_lu
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha import solve_step, step_of
from evolvent.solvers.alpha_state import (
    ALPHA_F,
    ALPHA_M,
    AS_IT_IS,
    BETA,
    DONE,
    FRESH,
    GAMMA,
    MARCH,
    MASS,
    SHARE,
    SINGULAR,
    TOLERANCE,
    factor_at,
    short_c_mass,
)

_I, _B = types.int64, types.boolean

#: Part of mean contact forces that stiffness carries for which a step is solved once more; their change by that at
#: which it is not.
BORNE, FOLLOWS = 1e-2, 0.25
#: Change of that part, beside the forces, below which a step is not solved once more.
KEPT = 1e-9


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, MARCH))
def add_mean_forces(t, h, model, matrix, options, march):
    """Add the contact forces f that are means over a step to the start, where nothing of them stands; returns a status.

    Notes
    -----
    Steps go on with accelerations that hold the part g of f which stiffness carries, and nothing of the rest, M w. A
    start without g would not stay at rest where it is in equilibrium. Multipliers and wrenches are those of all of f.
    """
    n_v, f, g, cylinders = march.dq.size, march.v1[3], march.v1[4], model.flexible.cylinders
    first = march.x.size - march.la.size
    if not contact.step_forces(model, f):
        return DONE
    rubs = False
    for k in range(cylinders.size):
        rubs = rubs or cylinders[k].friction > 0.0
    for i in range(n_v):
        g[i] = 0.0
    if options[TOLERANCE] == 0.0 and not rubs and find_stiff_part(t, h, model, matrix, options, march) < 0:
        return SINGULAR
    c_mass = short_c_mass(options)
    march.tally[FRESH] = 1
    for part in range(2):
        if factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march) != 0:
            return SINGULAR
        for i in range(march.x.size):
            march.x[i] = 0.0
        for i in range(n_v):
            march.x[i] = g[i] if part == 0 else f[i]
        sparse_lu.solve(matrix, march.x)
        for i in range(n_v):
            if part == 0:
                march.spare[i] = c_mass * march.x[i]
                march.v1[0, i] += march.spare[i]
                march.v1[1, i] += march.spare[i]
            else:
                f[i] = c_mass * march.x[i] - march.spare[i]  # w
        if part == 1:
            for k in range(march.la.size):
                march.la[k] += c_mass * options[MASS] * march.x[first + k]
    residual(t, march.y, march.v1[1], march.la, 0.0, 1.0, model, march.r, march.powers[0])
    for k in range(cylinders.size):
        if cylinders[k].law == contact_laws.CONSERVATIVE:
            for i in range(6):
                model.bodies[cylinders[k].body].F[i] += cylinders[k].F[i]
    return DONE


@indirect(_I(REAL, REAL, _I, MODEL, SPARSE, VECTOR, MARCH))
def solve_with_stiff_part(t, h, found, model, matrix, options, march):
    """Solve a fixed step again with the part of mean forces that stiffness carries; returns as `step_of` does.

    Where the forces follow that (a contact that is stiffer than what it pushes), the step stays as it was, and so it
    does with friction, whose forces go on as those of rest do.
    """
    f, before, g, n_v = march.v1[3], march.v0[4], march.v1[4], march.dq.size
    for k in range(model.flexible.cylinders.size):
        if model.flexible.cylinders[k].friction > 0.0:
            return found
    last = march.spare[n_v : 2 * n_v]
    for i in range(n_v):
        last[i] = g[i]
    counts = find_stiff_part(t, h, model, matrix, options, march)
    if counts < 0:
        return SINGULAR
    change = largest = 0.0
    for i in range(n_v):
        change, largest = max(change, abs(g[i] - last[i])), max(largest, abs(f[i]), abs(last[i]))
        before[i] = f[i]
    if change <= KEPT * largest:
        return found
    if counts > 0:
        again = step_of(t, h, AS_IT_IS, model, matrix, options, march)
        if again > 0:
            residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
            contact.step_forces(model, f)
            change = largest = 0.0
            for i in range(n_v):
                change, largest = max(change, abs(f[i] - before[i])), max(largest, abs(before[i]))
            if change <= FOLLOWS * largest:
                return found + again
    for i in range(n_v):
        g[i] = 0.0
    for i in range(march.la.size):
        march.la[i] = march.la0[i]
    march.tally[FRESH] = 1
    again = solve_step(t, h, model, matrix, options, march)
    if again > 0:
        residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
    return again


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, MARCH))
def find_stiff_part(t, h, model, matrix, options, march):
    """Find the part g of contact forces f, means over the step, that stiffness and joints bear at once.

    Returns whether it counts (0 or 1), -1 without a solution. f stays in the place of w.

    Notes
    -----
    g = f - c M x with (c M + K) x + G^T mu = f, G x = 0, the contact's own stiffness left out. Any g will do; with this
    one little is left of what `correct_velocities` would set right in motions that the step does not resolve.
    """
    n_v, f, g, A = model.info.nv, march.v1[3], march.v1[4], march.v1[1]
    cylinders = model.flexible.cylinders
    if not contact.step_forces(model, f):
        for i in range(n_v):
            g[i] = 0.0
        return 0
    for i in range(march.x.size):
        march.x[i] = 0.0
    for i in range(n_v):
        march.x[i] = f[i]
    c_mass = (1.0 - options[ALPHA_M]) / (options[BETA] * h * h * (1.0 - options[ALPHA_F]))
    march.tally[FRESH] = 1
    for k in range(cylinders.size):
        cylinders[k].share = 0.0
    found = factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march)
    for k in range(cylinders.size):
        cylinders[k].share = options[SHARE] if cylinders[k].law == contact_laws.CONSERVATIVE else 1.0
    if found != 0:
        return -1
    sparse_lu.solve(matrix, march.x)
    for i in range(n_v):
        march.spare[i] = A[i]
        A[i] += c_mass * march.x[i]
    residual(t, march.y, A, march.la, h, 1.0, model, march.x, march.powers[0])
    for i in range(n_v):
        A[i] = march.spare[i]
    residual(t, march.y, A, march.la, h, 1.0, model, march.r, march.powers[0])
    most = largest = 0.0
    for i in range(n_v):
        g[i] = f[i] - (march.x[i] - march.r[i])
        most, largest = max(most, abs(g[i])), max(largest, abs(f[i]))
    if most > BORNE * largest:
        return 1
    for i in range(n_v):
        g[i] = 0.0
    return 0


@indirect(_B(REAL, REAL, MODEL, SPARSE, VECTOR, MARCH))
def correct_velocities(t, h, model, matrix, options, march):
    """Set right the velocities, accelerations and wrenches of a step with contact forces that are means over it."""
    n_q, n_v, w, g = model.info.nq, model.info.nv, march.v1[3], march.v1[4]
    some = contact.step_forces(model, w)
    for i in range(march.x.size):
        march.x[i] = 0.0
    for i in range(n_v):
        some = some or g[i] != 0.0
        march.x[i] = w[i] - g[i]
        w[i] = 0.0
    if not some:
        add_rest_of_wrenches(model, march)
        return True
    c_mass = short_c_mass(options)
    march.tally[FRESH] = 1
    if factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march) != 0:
        return False
    sparse_lu.solve(matrix, march.x)
    beta, gamma = options[BETA], options[GAMMA]
    for i in range(n_v):
        w[i] = c_mass * march.x[i]
        march.y[n_q + i] += h * w[i] * (1.0 - gamma / (2.0 * beta))
        march.v1[0, i] -= w[i] / (2.0 * beta)
        march.v1[1, i] -= options[SHARE] * w[i]
    for k in range(march.la.size):
        march.la[k] -= (options[SHARE] - 1.0) * c_mass * options[MASS] * march.x[n_v + k]
    # powers and wrenches of the velocities as they are now
    residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
    add_rest_of_wrenches(model, march)
    return True


@indirect(void(MODEL, MARCH))
def add_rest_of_wrenches(model, march):
    """Wrenches of bodies, and the power that turns driven ones, with all of the forces that are means."""
    cylinders, bodies = model.flexible.cylinders, model.bodies
    for k in range(cylinders.size):
        if cylinders[k].law == contact_laws.CONSERVATIVE:
            G, b = cylinders[k].F, cylinders[k].body
            if bodies[b].motion == rigid.DRIVEN:
                march.powers[0, eq.DRIVEN] -= cylinders[k].share * driven_power(cylinders, bodies, k)
            for i in range(6):
                bodies[b].F[i] += (1.0 - cylinders[k].share) * G[i]


@inlined
def driven_power(cylinders, bodies, k):
    """Power that turns a driven body against the contacts of cylinder k, W."""
    w, G = bodies[cylinders[k].body].w, cylinders[k].F
    return -(w[0] * G[3] + w[1] * G[4] + w[2] * G[5])
