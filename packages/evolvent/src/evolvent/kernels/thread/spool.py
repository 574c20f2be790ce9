"""Spools whose rate is a state: their torques, and what they do to the bodies that carry them.

A free spool is a rotor (`kernels.rotor`): with the ring of wound thread it has the moment of inertia S = I + k, I of
the empty spool, and the torque on it is Q = r T + tau, tau that of motor, viscous and Coulomb friction between body and
spool. Stuck by Coulomb friction, the spool is a part of the body: `hold_torque` is then the torque of friction.

The radius of a spool follows its thread by r = r0 - c phi, c = thickness/(2 pi), and the length paid out is
r0 phi - c phi^2/2: an Archimedean spiral. What is wound is then an annulus from the core to its own outer radius.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.compiled.lookups import spring_law_at
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.law_means import SPRING, scalar_mean
from evolvent.kernels.profile import profile
from evolvent.kernels.rotations import turn
from evolvent.kernels.rotor import acceleration_about, add_reaction, take_inertia

#: Kinds of threads, by their segments: springs; of fixed length, with directions as coordinates; of fixed length, with
#: positions as coordinates and a joint a segment (`joined`), as implicit methods have them; springs on a mesh that
#: moves (`moving`).
SPRINGS, INEXTENSIBLE, JOINED, MOVING = 0, 1, 2, 3


@inlined
def outer_radius(threads, p, phi):
    """Radius of spool p at its angle, m."""
    return threads[p].radius - threads[p].coiling * phi


@inlined
def paid_out(threads, p, phi):
    """Length that has left spool p at its angle, m."""
    return threads[p].radius * phi - 0.5 * threads[p].coiling * phi * phi


@inlined
def ring_radius(s, threads, p):
    """Radius of the thin ring that has the moment of inertia of the wound part of thread p, m."""
    wound = float(threads[p].n - s[p])
    if threads[p].kind == MOVING:
        wound = threads[p].n - paid_out(threads, p, threads[p].phi) / threads[p].segment
    return layer_radius(threads, p, wound)


@inlined
def layer_radius(threads, p, wound):
    """`ring_radius` of so many wound segments."""
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
        if model.info.over == 0.0:
            motor += spring_law_at(threads[p].motor_law)(phi, rate, t, parameters)
        else:
            law = threads[p].motor_law
            motor += scalar_mean(SPRING, law, phi, rate, t, model.info.over, parameters, 0.0, math.inf, model)
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
    if not is_loose(threads, p) or threads[p].kind == MOVING:  # see `moving.hold_root`
        return
    b, copies = threads[p].body, float(threads[p].copies)
    nx, ny, nz = spool_direction(threads, bodies, p)
    take_inertia(bodies, b, copies * threads[p].spool, nx, ny, nz)
    h = copies * threads[p].spool_inertia * threads[p].b[1] / threads[p].r
    add_reaction(bodies, b, copies * (threads[p].motor + threads[p].friction), h, nx, ny, nz)


@inlined
def pull_spool(model, p, T):
    """The reaction of the torque r T that a tension puts on free spool p, onto its body."""
    threads, bodies = model.threads, model.bodies
    if not is_loose(threads, p):
        return
    nx, ny, nz = spool_direction(threads, bodies, p)
    add_reaction(bodies, threads[p].body, threads[p].copies * threads[p].r * T, 0.0, nx, ny, nz)


@inlined
def spool_acceleration(model, p, T):
    """Acceleration of free spool p under a tension, its body's a known, rad/s2; 0 where it is stuck."""
    threads, bodies = model.threads, model.bodies
    if not is_loose(threads, p):
        return 0.0
    nx, ny, nz = spool_direction(threads, bodies, p)
    torque = threads[p].r * T + (threads[p].motor + threads[p].friction)
    return torque / threads[p].spool - acceleration_about(bodies, threads[p].body, nx, ny, nz)


@inlined
def exit_tension(model, p):
    """Tension at the exit of thread p on a mesh that moves, N: its pull there along the innermost element."""
    k, Q, f = model.threads[p].node + model.threads[p].n - 1, model.threads[p].Q, model.threads[p].exit
    x = model.nodes[k].x
    dx, dy, dz = x[0] - Q[0], x[1] - Q[1], x[2] - Q[2]
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    return (f[0] * dx + f[1] * dy + f[2] * dz) / size if size > 0.0 else 0.0


@inlined
def held_tension(s, model, p):
    """Tension that thread p puts on its spool, of the last evaluation of its forces, N."""
    threads = model.threads
    if s[p] == 0 or s[threads.size + p] != 0:
        return 0.0
    if threads[p].kind == MOVING:
        return exit_tension(model, p)
    return model.nodes[threads[p].node + s[p] - 1].tension


@inlined
def spool_pull(s, model, p):
    """Force by which thread p turns its spool, N: its tension there, and W (see `boundary`)."""
    if s[p] == 0 or s[model.threads.size + p] != 0:
        return 0.0
    if model.threads[p].kind == MOVING:
        return model.threads[p].pull
    return held_tension(s, model, p) + model.threads[p].line_energy


@inlined
def spring_spools(y, s, model, dy):
    """Rates of the free spools of threads with segments of springs, their bodies' a known."""
    threads = model.threads
    for p in range(threads.size):
        if threads[p].drive == FREE_SPOOL and threads[p].kind == SPRINGS:
            k = threads[p].spool_v
            rate = y[k]
            dy[threads[p].spool_q] = rate
            dy[k] = spool_acceleration(model, p, spool_pull(s, model, p))
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
    wanted = threads[p].spool * acceleration_about(bodies, threads[p].body, nx, ny, nz)
    return wanted - threads[p].r * spool_pull(s, model, p) - threads[p].motor
