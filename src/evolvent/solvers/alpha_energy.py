"""Energy balance of a run under generalized-alpha."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.flow import powers as eq
from evolvent.flow.implicit import energies
from evolvent.kernels import attitude, contact, coordinate, joint
from evolvent.model import MODEL
from evolvent.solvers.alpha_state import WORKSPACE
from evolvent.solvers.balance import (
    defect_of,
    extend_extremes,
    largest_of,
    lost_of,
    moved_of,
    potential_of,
    worked_of,
)

_B = types.boolean

#: Steps in a row with too large a gain after which a run ends: the first few from rest gain as much energy as there is,
#: and then less and less beside it.
LASTS = 20


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def add_step_to_balance(t, h, model, work):
    """Add a step's work and losses to the balance.

    Notes
    -----
    Work of loads, drives and wheels is the mean of the forces of both ends times the displacement; losses by mass,
    stiffness, springs and joints are the mean power times h; friction is that of `contact.end_contacts` and
    `coordinate.end_coordinate_step`.
    """
    balance, f = work.balance, model.flexible
    n_v = model.info.nv
    P, P0, p, p0 = work.loads1, work.loads0, work.powers[0], work.powers[1]
    given = 0.5 * h * (p[eq.MARKER_LOADS] + p0[eq.MARKER_LOADS])
    for i in range(n_v):
        given += 0.5 * (P[i] + P0[i]) * work.dq[i]
    balance.loads += given
    balance.by_mass += 0.5 * h * (p[eq.MASS_DAMPING] + p0[eq.MASS_DAMPING])
    balance.by_stiffness += 0.5 * h * (p[eq.STIFFNESS_DAMPING] + p0[eq.STIFFNESS_DAMPING])
    balance.by_springs += 0.5 * h * (p[eq.SPRINGS] + p0[eq.SPRINGS])
    balance.by_joints += 0.5 * h * (p[eq.JOINTS] + p0[eq.JOINTS])
    balance.drives += _drives(t, h, model, work) + 0.5 * h * (p[eq.DRIVEN] + p0[eq.DRIVEN])
    balance.spools += 0.5 * h * (p[eq.SPOOLS] + p0[eq.SPOOLS])
    lost, driven = attitude.end_actuator_step(h, 0.5, work.dq, work.y, model)
    balance.by_springs += lost
    balance.drives += driven
    slip, damped = contact.end_contacts(work.y, model)
    balance.by_friction += slip
    balance.by_contact += damped
    if f.hinges.size > 0:
        balance.by_friction += coordinate.end_coordinate_step(h, 1.0, work.y, f.switches, model)
    for k in range(f.cylinders.size):
        work.impulse[k] += h * f.cylinders[k].normal
    for k in range(f.body_contacts.size):
        work.touched[k] += h * f.body_contacts[k].force


@indirect(_B(REAL, _B, MODEL, WORKSPACE))
def has_gained(t, ends, model, work):
    """Fill in the energies; returns whether the balance has gained too much from nothing since its lowest.

    Beside the energy moved or, at the start of a motion that has hardly moved any, the largest energy.

    A gain counts that lasts, or that stands where the run `ends`.
    """
    loop, options, balance = work.loop, work.options, work.balance
    fill_energies(t, model, work)
    extend_extremes(loop, balance.kinetic, potential_of(balance), worked_of(balance), lost_of(balance))
    loop.gain = defect_of(balance, loop.start_energy)
    loop.lowest_gain = min(loop.lowest_gain, loop.gain)
    largest = options.gain * (max(moved_of(loop), largest_of(loop)) + options.floor)
    loop.over = loop.over + 1 if loop.gain - loop.lowest_gain > largest else 0
    return loop.over >= LASTS or (ends and loop.over >= (1 if loop.steps > 5 else 2))


@inlined
def _drives(t, h, model, work):
    """Work of driven joints over a step, la dg/dt of each, mean la."""
    given = 0.0
    joints = model.flexible.joints
    for k in range(joints.size):
        if joints[k].path != 0 and joint.holds(t, joints, k):
            given += 0.5 * (work.la[k] + work.la0[k]) * work.gaps[k]
    return given


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def note_drives(t, h, model, work):
    """Change of each driven joint's gap by its drive alone over a step that starts at t."""
    joints = model.flexible.joints
    for k in range(joints.size):
        work.gaps[k] = 0.0
        if joints[k].path != 0:
            joint.joint_geometry(t, work.y, k, model)
            now = joints[k].gap
            joint.joint_geometry(t + h, work.y, k, model)
            work.gaps[k] = joints[k].gap - now


@indirect(void(REAL, MODEL, WORKSPACE))
def fill_energies(t, model, work):
    """Energies of the state into the balance; contacts and hinges are those of the last residual."""
    balance, f = work.balance, model.flexible
    energies(t, work.y, model, work.energies)
    balance.kinetic, balance.elastic, balance.bending = work.energies[0], work.energies[1], work.energies[2]
    balance.contact = 0.0
    for k in range(f.cylinders.size):
        balance.contact += f.cylinders[k].energy
    for k in range(f.body_contacts.size):
        balance.contact += f.body_contacts[k].energy
    balance.coupled = work.powers[0, eq.COUPLED_ENERGY]
