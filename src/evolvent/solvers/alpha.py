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
"""

from __future__ import annotations

import math

from numba import types

from evolvent.compiled.jit import REAL, indirect
from evolvent.flow.implicit import residual
from evolvent.kernels import contact, coordinate, sparse_lu
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha_state import (
    NO_CONVERGENCE,
    NOT_FINITE,
    REDUNDANT,
    SINGULAR,
    WORKSPACE,
    displace,
    factor_at,
)
from evolvent.solvers.least_norm import add_compliance
from evolvent.solvers.step_error import newton_limit

_I = types.int64

#: Iterations of Newton's method before a step counts as failed.
MOST_ITERATIONS = 25
#: Convergence slower than this has the matrix factored again.
SLOW = 0.15
#: A correction below this that Newton's method with a new tangent does not halve is round-off (constraints near a
#: position where they depend on one another).
ROUND_OFF = 1e-8


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def solve_step(t1, h, model, matrix, work):
    """Solve one step of length h that ends at t1; returns the number of iterations, or a status below zero.

    Newton's method starts from the accelerations of the step's start; of a fixed step that this does not solve, from
    constant velocities.
    """
    found = iterate(t1, h, False, model, matrix, work)
    if found > 0 or work.options.tolerance > 0.0:
        return found
    for i in range(work.la.size):
        work.la[i] = work.la0[i]
    work.loop.stale = 1
    return iterate(t1, h, True, model, matrix, work)


@indirect(_I(REAL, REAL, types.boolean, MODEL, SPARSE, WORKSPACE))
def iterate(t1, h, coasts, model, matrix, work):
    """Newton's method from constant velocities (`coasts`) or accelerations; returns as `solve_step` does."""
    n_q, n_v = model.info.nq, model.info.nv
    options, loop = work.options, work.loop
    y, y0, la, dq, r, x = work.y, work.y0, work.la, work.dq, work.r, work.x
    weight, n_j, first = work.weight, work.la.size, n_v
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    c_mass = (1.0 - am) / (beta * h * h * (1.0 - af))
    c_rate = gamma / (beta * h)
    c_step = 1.0 / (beta * h * h)
    scale = c_mass * options.mass
    limit = newton_limit(options.newton, options.sharp, options.rates, loop.fastest, h)
    info = model.info
    info.compliance = 1.0 / scale
    a0, dv0, a1, dv1 = work.a0, work.dv0, work.a1, work.dv1
    for i in range(n_v):
        if coasts:
            a1[i] = (beta - 0.5) / beta * a0[i]
            dv1[i] = ((1.0 - am) * a1[i] + am * a0[i] - af * dv0[i]) / (1.0 - af)
        else:
            dv1[i] = dv0[i]
            a1[i] = ((1.0 - af) * dv1[i] + af * dv0[i] - am * a0[i]) / (1.0 - am)
        dq[i] = h * y0[n_q + i] + h * h * ((0.5 - beta) * a0[i] + beta * a1[i])
        y[n_q + i] = y0[n_q + i] + h * ((1.0 - gamma) * a0[i] + gamma * a1[i])
    displace(y0, dq, model, y)
    if abs(loop.factored_step - h) > 1e-6 * h:
        loop.stale = 1
    last, ratio = math.inf, 0.0
    for iteration in range(MOST_ITERATIONS):
        residual(t1, y, dv1, la, h, 1.0, model, r, work.powers[0])
        if not is_finite(r):
            return NOT_FINITE
        touching = contact.pressed(model)
        if model.flexible.hinges.size > 0:
            touching += coordinate.count_slipping(model)
        if touching != loop.contact_set:
            loop.contact_set = touching
            loop.stale = 1
        # directions of threads must be fresh, and those in which multipliers of redundant constraints are free
        renewed = loop.stale == 1 or ratio > SLOW or model.threads.size > 0 or model.info.redundant != 0
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
        if info.redundant != 0:
            add_compliance(scale, 1.0, model, matrix, la, x, r)
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
        left = norm * ratio / (1.0 - ratio) if ratio > 0.0 and ratio < 0.9 else norm
        rounded = renewed and ratio > 0.5 and norm <= ROUND_OFF and model.threads.size == 0
        settled = iteration > 0 or info.redundant == 0  # the compliance leaves what a second iteration corrects
        if (settled and min(norm, left) <= limit) or rounded:
            loop.left = min(norm, left)
            return iteration + 1
        last = norm
    loop.stale = 1
    return NO_CONVERGENCE
