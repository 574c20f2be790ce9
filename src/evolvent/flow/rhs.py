"""Right-hand side of the equations of motion."""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.flow.explicit_forces import add_explicit_forces, has_explicit_forces
from evolvent.kernels import (
    ancf_beams,
    attitude,
    constraint_rows,
    coordinate_laws,
    custom,
    fields,
    loads,
    points,
    reduced,
    rigid,
    rod_payout,
    springs,
    tape,
    thread,
)
from evolvent.model import DISSIPATED, DRIVE, LOAD, MODEL, SPOOL


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def rhs(t, y, s, model, dy):
    """State derivative dy : (ny,) at time t of the state y, s; leaves tensions in the nodes and in la.

    Not a number throughout where constraints are redundant (one of them follows from the others).
    """
    dissipated, load_power, spool_power, loaded = apply_forces(t, y, s, model, dy)
    motors = 0.0
    if attitude.has_actuators(model):
        lost, given, motors = attitude.actuator_forces(t, y, model)
        attitude.add_wheels(y, model)
        dissipated += lost
        load_power += given
    explicit_forces = has_explicit_forces(model)
    if explicit_forces:
        lost, given = add_explicit_forces(t, y, s, model, dy)
        dissipated += lost
        load_power += given
        if model.beams.size > 0:
            ancf_beams.beam_rates(y, model, dy)
    if model.tapes.size > 0:
        dissipated += tape.node_rates(y, model, dy)
    if model.reduced_bodies.size > 0:
        dissipated += reduced.mode_rates(y, model, dy)
    accelerate(t, y, s, model, dissipated, load_power, spool_power, loaded, dy)
    if attitude.has_actuators(model):
        attitude.actuator_rates(y, model, dy)
        dy[model.info.nq + model.info.nv + DRIVE] += motors
    if explicit_forces:
        dy[model.info.nq + model.info.nv + DRIVE] += coordinate_laws.motor_power(model)
    for k in range(model.rods.size):
        if model.rods[k].payout != 0:
            driven, by_weight = rod_payout.drive_rod(dy, 0, k, model)
            dy[model.info.nq + model.info.nv + DRIVE] += driven
            dy[model.info.nq + model.info.nv + LOAD] += by_weight


@inlined
def apply_forces(t, y, s, model, dy):
    """Kinematics, and all forces but those of beams and constraints; dy is cleared.

    Returns the powers dissipated, of loads and of spools (W), and whether threads' nodes carry loads.
    """
    bodies, threads, info = model.bodies, model.threads, model.info
    info.step = math.inf
    for i in range(y.size):
        dy[i] = 0.0
    rigid.kinematics(t, y, model)
    points.clear_forces(model.points)
    gravity = info.gravity
    falls = gravity[0] != 0.0 or gravity[1] != 0.0 or gravity[2] != 0.0
    load_power = 0.0
    if falls:
        load_power += loads.weight(y, bodies, model.points, gravity)
    dissipated = spool_power = 0.0
    if model.springs.size > 0:
        dissipated, law_power = springs.spring_forces(t, y, 0.0, model)
        load_power += law_power
    if model.custom_forces.size > 0:
        lost, given = custom.add_custom_forces(t, y, model)
        dissipated += lost
        load_power += given
    if model.loads.size > 0:
        load_power += loads.concentrated_loads(t, y, model)
    has_fields = model.fields.size > 0
    if has_fields:
        load_power += fields.add_field_forces(t, y, model)
    loaded = falls or has_fields or model.loads.size > 0
    if threads.size > 0:
        thread.reels(t, y, s, model)
        load_power += thread.carry_wound(s, model)
        if has_fields:
            load_power += thread.wound_fields(t, s, model)
    for p in range(threads.size):
        if loaded:
            if threads[p].kind == thread.INEXTENSIBLE:
                thread.chain_points(y, s, model, p)
            else:
                thread.spring_points(y, s, threads, model.nodes, p)
            load_power += thread.node_loads(t, s, model, p)
        if threads[p].kind == thread.MOVING:
            d, power = thread.hold_root(y, loaded, p, model, dy)
            dissipated += d
            load_power += power
        elif threads[p].kind == thread.SPRINGS:
            d, power = thread.spring_thread(y, 0.0, s, model, p, loaded, dy)
            dissipated += d
            spool_power += power
        elif threads[p].kind == thread.JOINED:
            thread.spring_points(y, s, threads, model.nodes, p)
            thread.pull_joined(s, model, p)
    if threads.size > 0:
        dissipated += thread.spool_losses(y, model)
    return dissipated, load_power, spool_power, loaded


@inlined
def accelerate(t, y, s, model, dissipated, load_power, spool_power, loaded, dy):
    """Accelerations of bodies, points and threads of fixed segments under what has been applied, and the accounts."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    info = model.info
    n_v, drive_power = info.nq + info.nv, 0.0
    rigid.factorise(bodies)
    for b in range(bodies.size):
        rigid.respond(bodies, b, bodies[b].F, bodies[b].a)
        if bodies[b].path != 0:
            for c in range(3):
                bodies[b].a[c] = bodies[b].along * bodies[b].direction[c]
    if model.rows.size > 0:
        if constraint_rows.build_rows(t, y, s, model) >= 0:
            for i in range(y.size):
                dy[i] = math.nan
            return
        constraint_rows.row_velocity_terms(t, y, s, model, loaded)
        constraint_rows.solve_rows(s, model, dy)
        drive_power += constraint_rows.driven_power(t, s, model)
        for p in range(threads.size):
            if threads[p].kind == thread.INEXTENSIBLE:
                spool_power += thread.chain_rates(y, s, model, p, loaded, dy)
                info.step = min(info.step, thread.boundary_step(s, threads, nodes, p))
    if threads.size > 0:
        thread.spring_spools(y, s, model, dy)
        for p in range(threads.size):
            if threads[p].kind == thread.MOVING:
                spool_power += thread.moving_rates(y, p, model, dy)
        spool_power += thread.carry_power(s, model)
    for b in range(bodies.size):
        drive_power += rigid.write_rates(y, bodies, b, dy)
    points.write_point_rates(y, model.points, dy)
    dy[n_v + DISSIPATED] = dissipated
    dy[n_v + SPOOL] = spool_power
    dy[n_v + LOAD] = load_power
    dy[n_v + DRIVE] = drive_power
