"""Hinges over a step that conserves energy.

With p = u.a and q = u.b of the second direction u and the first body's directions a and b, the angle changes by
d = atan2(p0 q1 - q0 p1, p0 p1 + q0 q1), and p0 q1 - q0 p1 = pm dq - qm dp exactly, means m of both ends. A torque T
that is the change of the hinge's energy over d therefore acts by the forces T c (pm b - qm a) on u, T c pm u on b and
-T c qm u on a, c = d/(p0 q1 - q0 p1), with the work of the energy's change. Travels are quadratic (`travel`). Motors
and synchronizations act by the mean coordinates, friction by its force at the end.
"""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels.coordinate import TRAVEL, bristle_energy, friction_force, synchronization_energy
from evolvent.kernels.hinge import _hinge_geometry, _second_side, add_applied, continuous_angle, hinge_law
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.sides import ON_COORDINATES
from evolvent.kernels.travel import push_travel, travel_geometry
from evolvent.model import MODEL

#: Change of an angle below which secants are tangents, rad.
_SMALL = 1e-7


@indirect(void(VECTOR, INTEGERS, MODEL, MATRIX))
def measure_hinges(y, s, model, out):
    """p, q and angle of all hinges by the state y and the bodies' current positions; out : (nh, 3) float.

    Of a travel the last is the travel.
    """
    hinges, bodies = model.flexible.hinges, model.bodies
    for k in range(hinges.size):
        u = _second_side(y, hinges, bodies, k)
        if hinges[k].kind == TRAVEL:
            out[k, 0], out[k, 1], out[k, 2] = 0.0, 0.0, travel_geometry(hinges, bodies, k, u)[1]
            continue
        _, _, p, q, _ = _hinge_geometry(hinges, bodies, k, u[0], u[1], u[2])
        out[k, 0], out[k, 1], out[k, 2] = p, q, continuous_angle(p, q, s[hinges[k].switch])


@inlined
def _over(hinges, k, angle):
    return max(angle - hinges[k].high, 0.0) + min(angle - hinges[k].low, 0.0)


@inlined
def _secant_torque(hinges, k, latched, start, end):
    """Change of the hinge's energy from angle `start` to `end` over that of the angle, N m."""
    mean = 0.5 * (start + end)
    torque = hinges[k].stiffness * (mean - hinges[k].rest)
    before, after = _over(hinges, k, start), _over(hinges, k, end)
    if before != 0.0 or after != 0.0:
        if abs(end - start) > _SMALL:
            torque += 0.5 * hinges[k].stop * (after * after - before * before) / (end - start)
        else:
            torque += 0.5 * hinges[k].stop * (after + before)
    if latched != 0:
        torque += hinges[k].latch_stiffness * (mean - hinges[k].latch)
    return torque


@indirect(REAL(REAL, VECTOR, REAL, INTEGERS, MATRIX, MATRIX, MODEL, VECTOR))
def add_hinge_step(t, ym, h, s, start, end, model, F):
    """Torques of all coordinates over a step, at the bodies' mean position; returns the power that dampers take, W.

    Parameters
    ----------
    t : float, s, middle of the step
    ym : (ny,) float, mean state; start, end : (nh, 3) float, of `measure_hinges`
    """
    hinges = model.flexible.hinges
    for k in range(hinges.size):
        hinges[k].before, hinges[k].angle = start[k, 2], end[k, 2]
        hinges[k].rate = (end[k, 2] - start[k, 2]) / h
    _, lost = add_applied(t, 0.5, s, model)
    for k in range(hinges.size):
        latched, rate = s[hinges[k].switch + 1], hinges[k].rate
        _, stiffness, damping, _, _ = hinge_law(hinges, k, latched, end[k, 2], rate)
        rubs, stick = friction_force(hinges, k, end[k, 2])
        torque = _secant_torque(hinges, k, latched, start[k, 2], end[k, 2]) + damping * rate + rubs + hinges[k].applied
        hinges[k].torque, hinges[k].slope = torque, stiffness + 2.0 * stick + hinges[k].applied_slope
        hinges[k].damper = damping + hinges[k].applied_damper
        hinges[k].lost = damping * rate * rate
        hinges[k].latch_lost = hinges[k].latch_damping * rate * rate if latched != 0 else 0.0
        lost += hinges[k].lost
        _push(ym, k, start, end, model, F)
    return lost


@inlined
def _push(ym, k, start, end, model, F):
    """Torque of coordinate k over the step on its sides."""
    hinges, bodies, n_q = model.flexible.hinges, model.bodies, model.info.nq
    u, torque = _second_side(ym, hinges, bodies, k), hinges[k].torque
    if hinges[k].kind == TRAVEL:
        d, _, _ = travel_geometry(hinges, bodies, k, u)
        for i in range(3):
            hinges[k].u[i], hinges[k].g[i] = u[i], d[i]
        push_travel(model, k, u, d, torque, F)
        return
    R, z, n = bodies[hinges[k].body].R, hinges[k].zero, hinges[k].axis
    p0, q0, p1, q1 = start[k, 0], start[k, 1], end[k, 0], end[k, 1]
    turned, swept = end[k, 2] - start[k, 2], p0 * q1 - q0 * p1
    scale = turned / swept if abs(turned) > _SMALL else 1.0 / math.sqrt((p0 * p0 + q0 * q0) * (p1 * p1 + q1 * q1))
    ax, ay, az = turn(R, z[0], z[1], z[2])
    bx, by, bz = cross(n[0], n[1], n[2], z[0], z[1], z[2])
    bx, by, bz = turn(R, bx, by, bz)
    p, q = 0.5 * (p0 + p1), 0.5 * (q0 + q1)
    g = (scale * (p * bx - q * ax), scale * (p * by - q * ay), scale * (p * bz - q * az))
    for i in range(3):
        hinges[k].u[i], hinges[k].g[i] = u[i], g[i]
    fx, fy, fz = torque * g[0], torque * g[1], torque * g[2]
    G = bodies[hinges[k].body].F  # b x f_b + a x f_a = (p b - q a) x u
    tx, ty, tz = cross(fx, fy, fz, u[0], u[1], u[2])
    G[3] -= tx
    G[4] -= ty
    G[5] -= tz
    if hinges[k].on == ON_COORDINATES:
        at = hinges[k].iv - n_q
        F[at] += fx
        F[at + 1] += fy
        F[at + 2] += fz
    else:
        H = bodies[hinges[k].other].F
        H[3] += tx
        H[4] += ty
        H[5] += tz


@indirect(REAL(INTEGERS, MODEL))
def hinge_energy(s, model):
    """Energy of all coordinates and of the cables between them, at the end of the last step, J."""
    hinges, found = model.flexible.hinges, synchronization_energy(model)
    for k in range(hinges.size):
        found += hinge_law(hinges, k, s[hinges[k].switch + 1], hinges[k].angle, 0.0)[3] + bristle_energy(hinges, k)
    return found
