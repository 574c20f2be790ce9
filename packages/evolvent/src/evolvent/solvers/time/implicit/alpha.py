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

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.equations.implicit import keep_momentum, residual
from evolvent.kernels import rigid, thread
from evolvent.kernels.blocks import displace, largest_turn
from evolvent.model import MODEL
from evolvent.solvers.time.implicit.step_error import beside_tolerance
from evolvent.solvers.time.implicit.workspace import WORKSPACE

#: Largest angle of a free body over an adaptive step, rad: a steady turn has no error by itself, but samples between
#: the ends of a step do not show more.
LARGEST_TURN = 0.5


@indirect(void(REAL, MODEL, WORKSPACE))
def start_step(h, model, work):
    """Make the end of the last step the start of one of length h."""
    for i in range(work.dq.size):
        work.a0[i], work.dv0[i] = work.a1[i], work.dv1[i]
        work.loads0[i] = work.loads1[i]
    if not thread.has_springs(model):  # algorithmic accelerations lie off the true ones in proportion to the step
        for i in range(work.dq.size):
            work.a0[i] = work.dv1[i] + (work.a1[i] - work.dv1[i]) * min(h / work.loop.last, 1.0)
    for i in range(work.la.size):
        work.la0[i] = work.la[i]
    for i in range(work.powers.shape[1]):
        work.powers[1, i] = work.powers[0, i]


@inlined
def rates(h, options):
    """c_mass and c_rate, derivatives of the accelerations v' and of the velocities by the increments of a step."""
    am, af, beta = options.alpha_m, options.alpha_f, options.beta
    return (1.0 - am) / (beta * h * h * (1.0 - af)), options.gamma / (beta * h)


@indirect(void(REAL, types.boolean, MODEL, WORKSPACE))
def predict(h, coasts, model, work):
    """Increments of a step of length h from constant velocities (`coasts`) or accelerations."""
    n_q, options, y0, a0, dv0, a1, dv1 = model.info.nq, work.options, work.y0, work.a0, work.dv0, work.a1, work.dv1
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    for i in range(work.dq.size):
        if coasts:
            a1[i] = (beta - 0.5) / beta * a0[i]
            dv1[i] = ((1.0 - am) * a1[i] + am * a0[i] - af * dv0[i]) / (1.0 - af)
        else:
            dv1[i] = dv0[i]
            a1[i] = ((1.0 - af) * dv1[i] + af * dv0[i] - am * a0[i]) / (1.0 - am)
        work.dq[i] = h * y0[n_q + i] + h * h * ((0.5 - beta) * a0[i] + beta * a1[i])
        work.y[n_q + i] = y0[n_q + i] + h * ((1.0 - gamma) * a0[i] + gamma * a1[i])
    displace(y0, work.dq, False, model, work.y)


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def evaluate(t1, h, model, work):
    """Residual at the end t1 of a step."""
    residual(t1, work.y, work.dv1, work.la, h, 1.0, model, work.r, work.powers[0])


@indirect(void(REAL, MODEL, WORKSPACE))
def correct(h, model, work):
    """Add the correction work.x to the increments."""
    n_q, y, x = model.info.nq, work.y, work.x
    c_mass, c_rate = rates(h, work.options)
    c_step = 1.0 / (work.options.beta * h * h)
    for i in range(work.dq.size):
        d = x[i]
        work.dq[i] += d
        y[n_q + i] += c_rate * d
        work.dv1[i] += c_mass * d
        work.a1[i] += c_step * d
    displace(work.y0, work.dq, False, model, y)


@indirect(void(MODEL, WORKSPACE))
def restore_start(model, work):
    """Restore the start of a step that is rejected, but for its state."""
    for i in range(work.dq.size):
        work.a1[i], work.dv1[i] = work.a0[i], work.dv0[i]
        work.loads1[i] = work.loads0[i]
    for i in range(work.la.size):
        work.la[i] = work.la0[i]
    for i in range(work.powers.shape[1]):
        work.powers[0, i] = work.powers[1, i]
    work.loop.factored = 0.0
    rigid.kinematics(work.loop.time, work.y, model)


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def end_step(t, h, model, work):
    """Keep the momentum and the loads at the end of a step of length h, and the places of the bodies there."""
    if work.options.corrects != 0:
        keep_momentum(t, h, work.y, model.P, model, work.spare, work.kept)
    for i in range(work.dq.size):
        work.loads1[i] = model.P[i]
    if h > 0.0:
        for b in range(work.x0.shape[0]):
            for i in range(3):
                work.x0[b, i] = work.x1[b, i]
                for j in range(3):
                    work.R0[b, i, j] = work.R1[b, i, j]


@inlined
def local_error(h, model, work):
    """Estimated error of a step beside the tolerance: c h^2 (a1 - a0); above 1 where a body turns too far."""
    c, error, rates = abs(work.options.beta - 1.0 / 6.0) * h * h, 0.0, 0.0
    for i in range(work.dq.size):
        change = c * (work.a1[i] - work.a0[i])
        error = max(error, abs(change) / work.error_weight[i])
        rates += work.shares[i] * change * change
    turn = largest_turn(work.dq, False, model.info.nq, model.blocks) / LARGEST_TURN
    error = beside_tolerance(error, rates, h, work.dq, work.shares, work.loop, work.options)
    return max(error, turn * turn * turn)
