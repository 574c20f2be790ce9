"""Beams, rods, contacts, coordinates, penalty joints, laws between points under explicit methods: forces, energies.

Joints and gears without `stiffness` are rows of `evolvent.kernels.constraint_rows`. Bristles of frictions at the start
of a step are among the accounts. `evolvent.solvers.explicit_modes` finds the fastest mode.
"""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import (
    ancf_beams,
    beam_loads,
    constraint_rows,
    contact,
    coordinate,
    coordinate_laws,
    custom,
    fields,
    joint,
    points,
    rigid,
    rod,
    thermal,
    turning,
)
from evolvent.kernels.ancf import STATE
from evolvent.model import (
    BY_CONTACT,
    BY_JOINTS,
    BY_MASS,
    BY_STIFFNESS,
    DISSIPATED,
    ELASTIC,
    H_BODY,
    IMPULSE,
    KEPT,
    KINETIC,
    MODEL,
    N_ACCOUNTS,
    P_ALL,
    RELEASE,
)


@inlined
def has_explicit_forces(model):
    """Whether a model has any of these, in compiled code."""
    stiff = model.beams.size > 0 or model.rods.size > 0 or model.body_contacts.size > 0
    return stiff or model.info.penalties > 0 or model.coordinates.size > 0 or model.custom_forces.size > 0


def _has_penalties(model):
    return model.info.penalties


#: What a model has any of.
EXPLICIT = ("beams", "rods", "coordinates", "custom_forces", "body_contacts", _has_penalties)


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, INTEGERS, MODEL, VECTOR), used_for=EXPLICIT)
def add_explicit_forces(t, y, s, model, dy):
    """Forces of beams, rods, contacts, joint coordinates, penalties, users' laws: onto bodies and points, into F and P.

    Parameters
    ----------
    dy : (ny,) float, the accelerations of the beams in it still zero; rates of the beams' accounts are written into it

    Returns
    -------
    dissipated, given : float, W, powers taken by damping and given by loads
    """
    n_q, n_v = model.info.nq, model.info.nv
    F, P = model.F, model.P
    for i in range(n_v):
        F[i] = 0.0
        P[i] = 0.0
    points.pass_to_beams(n_q, model.points, F)
    by_mass = by_stiffness = by_joints = given = 0.0
    account = n_q + n_v + N_ACCOUNTS
    if model.elements.size > 0:
        by_mass, by_stiffness = ancf_beams.add_elements(y, dy[n_q : n_q + n_v], 1.0, STATE, model, F)
        ancf_beams.copy_weight(model, P)  # that of bodies and points: `rhs`
        if model.beam_loads.size > 0:
            beam_loads.add_beam_loads(t, y, 1.0, model, P)
        if model.thermal_loads.size > 0:
            thermal.add_thermal_loads(t, t, y, 1.0, model, P)
        if model.fields.size > 0:
            fields.add_beam_fields(t, y, model, P)
        for i in range(n_v):
            given += P[i] * y[n_q + i]
    step = math.inf if model.info.stepping != 0 else -1.0
    by_contact, _ = contact.add_contacts(y, y, KEPT, step, 1.0, 0.0, 0.0, model, F)
    for k in range(model.contact_surfaces.size):
        dy[account + IMPULSE + k] = model.contact_surfaces[k].normal
    if model.rods.size > 0:
        if model.thermal_loads.size > 0:
            thermal.heat_rods(t, t, 1.0, model)
        lost, viscous, heat = rod.add_rods(0.0, 0.0, 0.0, model)
        by_mass += lost
        by_stiffness += viscous
        given += heat
    if model.coordinates.size > 0:
        _, by_joints = coordinate.add_coordinates(t, y, KEPT, s, model, F)
        coordinate_laws.write_account_rates(model, dy)
        info = model.info
        info.step = min(info.step, coordinate.longest_step(model.coordinates))
    for k in range(model.joints.size):
        if joint.is_penalty(t, s, model.joints, k):
            by_joints += joint.add_penalty(t, y, k, model, F)
    if model.joints.size > 0 or model.coordinates.size > 0:
        points.take_forces(n_q, model.points, F)
    if model.beams.size > 0 or model.rods.size > 0:
        dy[account + BY_MASS] = by_mass
        dy[account + BY_STIFFNESS] = by_stiffness
        dy[account + BY_CONTACT] = by_contact
        dy[account + BY_JOINTS] = by_joints
    return by_mass + by_stiffness + by_contact + by_joints, given


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR), used_for=EXPLICIT)
def add_explicit_inventory(t, y, s, model, out):
    """Add beams, rods, contacts, coordinates, penalties, laws to an inventory (beams' momenta are those of bodies)."""
    F = model.F
    for i in range(F.size):
        F[i] = 0.0
    if model.elements.size > 0:
        part = model.sums[1]
        for i in range(3):
            part[i] = 0.0
        ancf_beams.beam_energies(y, 0, model.elements.size, model, part)
        out[KINETIC] += part[0]
        out[ELASTIC] += part[1]
        P, H = out[P_ALL : P_ALL + 3], out[H_BODY : H_BODY + 3]
        ancf_beams.beam_momenta(y, 0, model.elements.size, model, P, H)
    contact.add_contacts(y, y, KEPT, -1.0, 1.0, 0.0, 0.0, model, F)
    out[ELASTIC] += contact.energy_of(model)
    if model.rods.size > 0:
        part = model.sums[1]
        part[1] = 0.0
        rod.evaluate_rods(model, part)
        out[ELASTIC] += part[1]
    if model.coordinates.size > 0:
        energy, _ = coordinate.add_coordinates(t, y, KEPT, s, model, F)
        out[ELASTIC] += energy
    if model.custom_forces.size > 0:
        out[ELASTIC] += custom.custom_energies(t, y, model)
    for k in range(model.joints.size):
        if joint.is_penalty(t, s, model.joints, k):
            joint.joint_geometry(t, y, k, model)
            out[ELASTIC] += joint.penalty_energy(model.joints, k)


@indirect(REAL(REAL, VECTOR, VECTOR, INTEGERS, REAL, REAL, MODEL))
def measure_frictions(t, y0, y, s, h, step, model):
    """Frictions and their rates in the state y at t, the end of a step of length h from the state y0.

    Parameters
    ----------
    step : float, s, as of `end_frictions`

    Returns
    -------
    float, part of the step at which the first friction turns back, as of `turning.until_turn`
    """
    rigid.kinematics(t, y, model)
    if contact.any_contact(model):
        contact.add_contacts(y, y, KEPT, step, 1.0, 0.0, 0.0, model, model.F)
    if model.coordinates.size > 0:
        for k in range(model.coordinates.size):
            coordinate.measure_coordinate(y, s, model.coordinates, model.bodies, k)
    turning.measure_rates(y, model)
    return turning.until_turn(y0, y, h, model)


@indirect(void(VECTOR, REAL, MODEL))
def end_frictions(y, step, model):
    """Make the state y the start of the next explicit step for frictions: bristles and losses into its accounts.

    After `measure_frictions` of that state.

    Parameters
    ----------
    step : float, s, infinity at the end of a step, below 0 at the start of a run

    Notes
    -----
    Within a step frictions act over the interval from its start, as under implicit methods (`contact_laws.friction`,
    `coordinate.kept_friction`); their losses are those of the mean forces of both ends.
    """
    taken = 0.0
    if contact.any_contact(model):
        slip, _ = contact.end_contacts(y, model)
        contact.keep_bristles(y, model)
        if step > 0.0:
            y[model.info.rubbed] += slip
            taken += slip
    if step > 0.0:
        taken += coordinate.end_frictions(y, model)
    turning.keep_rates(model)
    y[model.info.nq + model.info.nv + DISSIPATED] += taken


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, types.int64), used_for=("motors", constraint_rows.HELD, _has_penalties))
def release_by(t, y, s, model, trigger):
    """Release the joints and switch off the motors that wait for a trigger (`user_events.release`).

    The strain energy of the penalties is taken out of the energy balance.
    """
    joints, motors = model.joints, model.motors
    account = model.info.nq + model.info.nv + RELEASE
    for k in range(joints.size):
        if joints[k].event != trigger or not joint.acts(t, s, joints, k):
            continue
        if joints[k].stiffness > 0.0:
            rigid.kinematics(t, y, model)
            joint.joint_geometry(t, y, k, model)
            y[account] -= joint.penalty_energy(joints, k)
        s[joints[k].switch] = 1
    for k in range(motors.size):
        if motors[k].event == trigger:
            s[motors[k].switch] = 1


@indirect(void(REAL, VECTOR, MODEL), used_for=_has_penalties)
def release_penalties(t, y, model):
    """Take the strain energy of penalties that are released at t out of the energy balance."""
    joints, account = model.joints, model.info.nq + model.info.nv + RELEASE
    for k in range(joints.size):
        if t == joints[k].until:
            rigid.kinematics(t, y, model)
            joint.joint_geometry(t, y, k, model)
            y[account] -= joint.penalty_energy(joints, k)
