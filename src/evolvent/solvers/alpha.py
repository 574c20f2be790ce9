"""Generalized-alpha for constrained systems of index 3, its time loop compiled whole.

Unknowns of a step are the increments dq of the coordinates (of a free body's attitude a rotation vector in body axes,
so that the update stays on the rotations) and the multipliers at its end.

Notes
-----
Arnold & Bruls (2007), eqs. 5 and 8, with Chung & Hulbert's (1993) parameters of the spectral radius rho at infinity:
alpha_m = (2 rho - 1)/(rho + 1), alpha_f = rho/(rho + 1), beta = 1/(1 + rho)^2, gamma = 2/(1 + rho) - 1/2 (Yi et al.
2017 print + 1/2), and

    (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) v1' + alpha_f v0'
    dq = h v0 + h^2 ((1/2 - beta) a0 + beta a1),   v1 = v0 + h ((1 - gamma) a0 + gamma a1)
    M v1' + F(t1, q1, v1) + G^T la1 = 0,           g(t1, q1) = 0

Contact forces f that are means over the step (the law CONSERVATIVE) add h^2 w/2 to dq and h w to v1, M w = f. With a1
and v1' replaced by those that the same dq has without w, they stand in the equations with the share
(1 - alpha_m)/(2 beta (1 - alpha_f)), and v1, a1 and v1' are set right after Newton's method. Of a part whose stiffness
the step does not resolve, f = M w + g: it takes the jump of velocity as a whole, and what would drive its ends against
each other, g, stands in the equations as a force of the step's end, with the share 1: so energy is kept at fixed steps
as long as the contact, too (see `find_stiff_part`; adaptive steps resolve it, g = 0). Multipliers hold M w as a mean,
too.
"""

from __future__ import annotations

import math

from numba import types

from evolvent.flow.implicit import residual
from evolvent.jit import REAL, indirect
from evolvent.kernels import contact, contact_laws, sparse_lu
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha_state import (
    ACCELERATED,
    AS_IT_IS,
    COASTING,
    NO_CONVERGENCE,
    NOT_FINITE,
    REDUNDANT,
    SINGULAR,
    WORKSPACE,
    displace,
    factor_at,
)

_I = types.int64

#: Iterations of Newton's method before a step counts as failed.
MOST_ITERATIONS = 25
#: Convergence slower than this has the matrix factored again.
SLOW = 0.15
#: A correction below this that Newton's method with a new tangent does not halve is round-off (constraints near a place
#: where they depend on one another).
ROUND_OFF = 1e-8


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def solve_step(t1, h, model, matrix, work):
    """Solve one step of length h that ends at t1; returns as `step_of` does.

    Notes
    -----
    Newton's method starts from the accelerations of the step's start. Contact forces that have not built up yet (a taut
    cable that begins to touch a cylinder) are not among them: such a start may lie so far inside the cylinder that the
    method finds no solution. A fixed step is then solved from constant velocities, and with all of the mean forces
    taken by masses; an adaptive one is cut.
    """
    adaptive, coasts = work.options.tolerance > 0.0, False
    for k in range(model.flexible.cylinders.size):
        row = model.flexible.cylinders[k]
        coasts = coasts or (row.law == contact_laws.CONSERVATIVE and row.friction > 0.0 and row.touching > 0.0)
    begins = COASTING if coasts and not adaptive else ACCELERATED
    found = step_of(t1, h, begins, model, matrix, work)
    if adaptive or model.flexible.cylinders.size == 0:
        return found
    for trial in range(3):
        if found > 0:
            return found
        if trial == 1:
            for i in range(work.dq.size):
                work.g1[i] = 0.0
        for i in range(work.la.size):
            work.la[i] = work.la0[i]
        work.loop.stale = 1
        found = step_of(t1, h, begins if trial == 1 else COASTING, model, matrix, work)
    return found


@indirect(_I(REAL, REAL, _I, MODEL, SPARSE, WORKSPACE))
def step_of(t1, h, start, model, matrix, work):
    """Solve one step of length h that ends at t1; returns the number of iterations, or a status below zero.

    `start`: ACCELERATED, COASTING or AS_IT_IS.
    """
    n_q, n_v = model.info.nq, model.info.nv
    options, loop = work.options, work.loop
    y, y0, la, dq, r, x = work.y, work.y0, work.la, work.dq, work.r, work.x
    weight, n_j, first = work.weight, work.la.size, n_v
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    c_mass = (1.0 - am) / (beta * h * h * (1.0 - af))
    c_rate = gamma / (beta * h)
    c_step = 1.0 / (beta * h * h)
    scale = c_mass * options.mass
    a0, dv0, a1, dv1 = work.a0, work.dv0, work.a1, work.dv1
    if start != AS_IT_IS:
        for i in range(n_v):
            if start == ACCELERATED:
                dv1[i] = dv0[i]
                a1[i] = ((1.0 - af) * dv1[i] + af * dv0[i] - am * a0[i]) / (1.0 - am)
            else:
                a1[i] = (beta - 0.5) / beta * a0[i]
                dv1[i] = ((1.0 - am) * a1[i] + am * a0[i] - af * dv0[i]) / (1.0 - af)
            dq[i] = h * y0[n_q + i] + h * h * ((0.5 - beta) * a0[i] + beta * a1[i])
            y[n_q + i] = y0[n_q + i] + h * ((1.0 - gamma) * a0[i] + gamma * a1[i])
        displace(y0, dq, model, y)
        loop.touched = 0
    if abs(loop.factored_step - h) > 1e-6 * h:
        loop.stale = 1
    last, ratio = math.inf, 0.0
    for iteration in range(MOST_ITERATIONS):
        residual(t1, y, dv1, la, h, 1.0, model, r, work.powers[0])
        if model.flexible.cylinders.size > 0:
            for i in range(n_v):
                r[i] += (options.share - 1.0) * work.g1[i]
        if not is_finite(r):
            return NOT_FINITE
        touching = contact.count_touching(model) if model.flexible.cylinders.size > 0 else 0
        if touching != 0:
            loop.touched = 1
        if touching != loop.contact_set:
            loop.contact_set = touching
            loop.stale = 1
        # a thread's directions must be fresh
        renewed = loop.stale == 1 or ratio > SLOW or model.threads.size > 0
        if renewed:
            found = factor_at(t1, y, la, c_mass, c_rate, scale, model, matrix, work)
            if found < 0:
                loop.stale = 1
                return SINGULAR
            if found > 0:
                loop.stale = 1
                return REDUNDANT
            loop.stale = 0
            loop.factored_step = h
        for i in range(first):
            x[i] = -r[i]
        for k in range(n_j):
            x[first + k] = -scale * r[first + k]
        sparse_lu.solve(matrix, x)
        norm = 0.0
        for i in range(n_v):
            d = x[i]
            norm = max(norm, abs(d) / weight[i])
            dq[i] += d
            y[n_q + i] += c_rate * d
            dv1[i] += c_mass * d
            a1[i] += c_step * d
        for k in range(n_j):
            la[k] += scale * x[first + k]
        displace(y0, dq, model, y)
        if not math.isfinite(norm):
            return NOT_FINITE
        loop.iterations += 1
        if iteration > 0:
            ratio = norm / last if last > 0.0 else 0.0
        if norm <= options.newton or (ratio > 0.0 and ratio < 0.9 and norm * ratio / (1.0 - ratio) <= options.newton):
            return iteration + 1
        if renewed and ratio > 0.5 and norm <= ROUND_OFF and model.threads.size == 0:
            return iteration + 1
        last = norm
    loop.stale = 1
    return NO_CONVERGENCE
