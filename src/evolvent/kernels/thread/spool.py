"""Spools whose rate is a state: their torques, and what they do to the bodies that carry them.

A free spool is a rotor about the axis n of a body, whose inertia contains the empty spool's I at rest. With the ring of
wound thread it has the moment of inertia S = I + k about n, and with the rate phi' relative to the body

    S (phi'' + n . w') = r T + tau,

tau the torque of motor, viscous and Coulomb friction between body and spool. The body's equations then hold
J - S n n^T in place of its inertia J (that contains spool and ring), the torque -(r T + tau) n, and -w x (I phi' n).
Stuck by Coulomb friction, the spool is a part of the body: `hold_torque` is then what friction bears.

The radius of a spool follows its thread by r = r0 - c phi, c = thickness/(2 pi), and the length paid out is
r0 phi - c phi^2/2: an Archimedean spiral. What is wound is then an annulus from the core to its own outer radius.
"""

import math

from evolvent.jit import inlined, spring_law_at
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.profile import profile
from evolvent.kernels.rigid import FREE, SPIN
from evolvent.kernels.rotations import cross, turn


@inlined
def outer_radius(threads, p, phi):
    """Radius of spool p at its angle, m."""
    return threads[p].radius - threads[p].coiling * phi


@inlined
def paid_out(threads, p, phi):
    """Length that has left spool p at its angle, m."""
    return threads[p].radius * phi - 0.5 * threads[p].coiling * phi * phi


@inlined
def ring_radius(threads, p, wound):
    """Radius of the thin ring that has the moment of inertia of so many wound nodes, m."""
    if threads[p].coiling == 0.0:
        return threads[p].radius
    # R^2 = core^2 + length thickness/pi; the mean of the squares of core and outer radius
    return math.sqrt(threads[p].core * threads[p].core + threads[p].coiling * wound * threads[p].segment)


@inlined
def is_loose(threads, p):
    """Whether spool p is free and not stuck."""
    return threads[p].drive == FREE_SPOOL and threads[p].loose > 0.0


@inlined
def spool_torques(t, phi, rate, s, model, p):
    """Torque of the motor of free spool p, and of its friction (less than zero where it turns forwards), N m."""
    threads = model.threads
    motor = threads[p].spool_torque
    if threads[p].motor_profile >= 0:
        motor += profile(t, threads[p].motor_profile, model)
    if threads[p].motor_law != 0:
        parameters = model.parameters[threads[p].motor_first : threads[p].motor_last]
        motor += spring_law_at(threads[p].motor_law)(phi, rate, t, parameters)
    friction = -threads[p].spool_viscous * rate
    if threads[p].spool_switch >= 0:
        friction -= threads[p].spool_friction * s[threads[p].spool_switch]
    return motor, friction


@inlined
def note_spool(t, y, s, model, p):
    """Torques of free spool p, and whether it turns, into the thread's scratch."""
    threads = model.threads
    if threads[p].drive != FREE_SPOOL:
        return
    phi, rate = y[threads[p].spool_q], y[threads[p].spool_v]
    threads[p].loose = 1.0
    if threads[p].spool_switch >= 0 and s[threads[p].spool_switch] == 0:
        threads[p].loose = 0.0
    threads[p].motor, threads[p].friction = spool_torques(t, phi, rate, s, model, p)


@inlined
def lock_spools(model):
    """During an impulse, spools on bodies whose turning they feel turn on at their rates."""
    threads = model.threads
    for p in range(threads.size):
        if threads[p].coupled != 0:
            threads[p].loose = 0.0


@inlined
def spool_direction(threads, bodies, p):
    """Axis of spool p, inertial axes."""
    Y = threads[p].chord
    return turn(bodies[threads[p].body].R, Y[0], Y[1], Y[2])


@inlined
def carry_spool(model, p):
    """Free spool p, its inertia `spool` known, onto its body; the thread's tension is added by `pull_spool`."""
    threads, bodies = model.threads, model.bodies
    if not is_loose(threads, p):
        return
    b, copies = threads[p].body, float(threads[p].copies)
    nx, ny, nz = spool_direction(threads, bodies, p)
    rotor(bodies, b, copies * threads[p].spool, nx, ny, nz)
    spin = copies * threads[p].spool_inertia * threads[p].b[1] / threads[p].r
    gyroscopic(bodies, b, spin, nx, ny, nz)
    tau = copies * (threads[p].motor + threads[p].friction)
    F = bodies[b].F
    F[3] -= tau * nx
    F[4] -= tau * ny
    F[5] -= tau * nz


@inlined
def rotor(bodies, b, S, nx, ny, nz):
    """Take the inertia S n n^T of a rotor, whose own equation holds it, out of that of its body."""
    if bodies[b].motion == SPIN:
        ax, ay, az = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        along = ax * nx + ay * ny + az * nz
        bodies[b].J -= S * along * along
    elif bodies[b].motion == FREE:
        n = (nx, ny, nz)
        for i in range(3):
            for j in range(3):
                bodies[b].M[3 + i, 3 + j] -= S * n[i] * n[j]


@inlined
def gyroscopic(bodies, b, spin, nx, ny, nz):
    """The torque -w x (h n) of a rotor of angular momentum h relative to its body."""
    w, F = bodies[b].w, bodies[b].F
    gx, gy, gz = cross(w[0], w[1], w[2], nx, ny, nz)
    F[3] -= spin * gx
    F[4] -= spin * gy
    F[5] -= spin * gz


@inlined
def turning(bodies, b, nx, ny, nz):
    """Angular acceleration of a body about the direction n, rad/s2."""
    a = bodies[b].a
    return nx * a[3] + ny * a[4] + nz * a[5]


@inlined
def pull_spool(model, p, T):
    """The reaction of the torque r T that a tension puts on free spool p, onto its body."""
    threads, bodies = model.threads, model.bodies
    if not is_loose(threads, p):
        return
    nx, ny, nz = spool_direction(threads, bodies, p)
    torque = threads[p].copies * threads[p].r * T
    F = bodies[threads[p].body].F
    F[3] -= torque * nx
    F[4] -= torque * ny
    F[5] -= torque * nz


@inlined
def spool_acceleration(model, p, T):
    """Acceleration of free spool p under a tension, its body's a known, rad/s2; 0 where it is stuck."""
    threads, bodies = model.threads, model.bodies
    if not is_loose(threads, p):
        return 0.0
    nx, ny, nz = spool_direction(threads, bodies, p)
    torque = threads[p].r * T + (threads[p].motor + threads[p].friction)
    return torque / threads[p].spool - turning(bodies, threads[p].body, nx, ny, nz)


@inlined
def held_tension(s, model, p):
    """Tension that thread p puts on its spool, of the last evaluation of its forces, N."""
    threads = model.threads
    if s[p] == 0 or s[threads.size + p] != 0:
        return 0.0
    return model.nodes[threads[p].node + s[p] - 1].tension


@inlined
def spring_spools(y, s, model, dy):
    """Rates of the free spools of threads with segments of springs, their bodies' a known."""
    threads = model.threads
    for p in range(threads.size):
        if threads[p].drive == FREE_SPOOL and threads[p].kind == 0:
            k = threads[p].spool_v
            rate = y[k]
            dy[threads[p].spool_q] = rate
            dy[k] = spool_acceleration(model, p, held_tension(s, model, p))
            threads[p].b[2] = threads[p].r * dy[k] - threads[p].coiling * rate * rate


@inlined
def spool_losses(y, model):
    """Power that friction takes from all free spools, W."""
    threads, lost = model.threads, 0.0
    for p in range(threads.size):
        if is_loose(threads, p):
            lost -= threads[p].copies * threads[p].friction * y[threads[p].spool_v]
    return lost


@inlined
def hold_torque(s, model, p):
    """Torque of friction on spool p that is stuck, after the accelerations are known, N m."""
    threads, bodies = model.threads, model.bodies
    nx, ny, nz = spool_direction(threads, bodies, p)
    wanted = threads[p].spool * turning(bodies, threads[p].body, nx, ny, nz)
    return wanted - threads[p].r * held_tension(s, model, p) - threads[p].motor
