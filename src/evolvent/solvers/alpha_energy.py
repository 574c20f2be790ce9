"""Energy balance of a run under generalized-alpha."""

from __future__ import annotations

from numba import void

from evolvent.flow import powers as eq
from evolvent.flow.implicit import energies
from evolvent.jit import REAL, VECTOR, entry, indirect, inlined
from evolvent.kernels import contact, contact_laws, joint, rigid
from evolvent.model import MODEL
from evolvent.solvers.alpha_contact import driven_power
from evolvent.solvers.alpha_state import (
    BY_CONTACT,
    BY_FRICTION,
    BY_JOINTS,
    BY_MASS,
    BY_SPRINGS,
    BY_STIFFNESS,
    CONTACT,
    COUPLED,
    DRIVES,
    ELASTIC,
    FLOOR,
    KINETIC,
    LOADS,
    MARCH,
    PEAK,
    SPOOLS,
    START,
)


@indirect(void(REAL, REAL, MODEL, MARCH))
def add_step_to_balance(t, h, model, march):
    """Book a step's work and losses into the ledger.

    Notes
    -----
    Work of loads and drives is the mean of the forces of both ends times the displacement; losses by mass, stiffness,
    springs and joints are the mean power times h; friction is booked as in `touch.end_contact_step`.
    """
    ledger, f = march.ledger, model.flexible
    n_v = model.info.nv
    P, P0, p, p0 = march.v1[2], march.v0[2], march.powers[0], march.powers[1]
    work = 0.5 * h * (p[eq.MARKER_LOADS] + p0[eq.MARKER_LOADS])
    for i in range(n_v):
        work += 0.5 * (P[i] + P0[i]) * march.dq[i]
    ledger[LOADS] += work
    for pair in range(4):
        cause = (BY_MASS, BY_STIFFNESS, BY_SPRINGS, BY_JOINTS)[pair]
        which = (eq.MASS_DAMPING, eq.STIFFNESS_DAMPING, eq.SPRINGS, eq.JOINTS)[pair]
        ledger[cause] += 0.5 * h * (p[which] + p0[which])
    ledger[DRIVES] += _drives(t, h, model, march) + 0.5 * h * (p[eq.DRIVEN] + p0[eq.DRIVEN])
    ledger[SPOOLS] += 0.5 * h * (p[eq.SPOOLS] + p0[eq.SPOOLS])
    for k in range(f.cylinders.size):
        if f.cylinders[k].law == contact_laws.CONSERVATIVE and model.bodies[f.cylinders[k].body].motion == rigid.DRIVEN:
            ledger[DRIVES] += h * driven_power(f.cylinders, model.bodies, k)
    if f.cylinders.size > 0:
        slip, damped = contact.end_contact_step(march.y, model)
        ledger[BY_FRICTION] += slip
        ledger[BY_CONTACT] += damped
    for k in range(f.cylinders.size):
        march.impulse[k] += h * f.cylinders[k].normal


@indirect(REAL(REAL, MODEL, MARCH))
def energy_gained(t, model, march):
    """Fill in the energies; returns what the account has gained from nothing since the start, J."""
    ledger = march.ledger
    fill_energies(t, model, march)
    energy = ledger[KINETIC] + ledger[ELASTIC] + ledger[COUPLED]
    ledger[PEAK] = max(ledger[PEAK], energy)
    gained = energy - ledger[START] - ledger[LOADS] - ledger[DRIVES] - ledger[SPOOLS]
    for cause in range(BY_MASS, BY_SPRINGS + 1):
        gained += ledger[cause]
    return gained


@entry(VECTOR, VECTOR)
@inlined
def gain_scale(ledger, options):
    """Energy beside which a gain counts: the largest there was, or the work, J."""
    return max(ledger[PEAK], abs(ledger[LOADS]) + abs(ledger[DRIVES]) + abs(ledger[SPOOLS])) + options[FLOOR]


@inlined
def _drives(t, h, model, march):
    """Work of driven joints over a step, la dg/dt of each, mean la."""
    work = 0.0
    joints = model.flexible.joints
    for k in range(joints.size):
        if joints[k].path != 0 and joint.holds(t, joints, k):
            work += 0.5 * (march.la[k] + march.la0[k]) * march.gaps[k]
    return work


@indirect(void(REAL, REAL, MODEL, MARCH))
def note_drives(t, h, model, march):
    """Change of each driven joint's gap by its feed alone over a step that starts at t."""
    joints = model.flexible.joints
    for k in range(joints.size):
        march.gaps[k] = 0.0
        if joints[k].path != 0:
            joint.joint_geometry(t, march.y, k, model)
            now = joints[k].gap
            joint.joint_geometry(t + h, march.y, k, model)
            march.gaps[k] = joints[k].gap - now


@indirect(void(REAL, MODEL, MARCH))
def fill_energies(t, model, march):
    """Energies of the state into the ledger; contacts and hinges are those of the last residual."""
    ledger, f = march.ledger, model.flexible
    energies(t, march.y, model, ledger[KINETIC : KINETIC + 3])
    ledger[CONTACT] = 0.0
    for k in range(f.cylinders.size):
        ledger[CONTACT] += f.cylinders[k].energy
    ledger[COUPLED] = march.powers[0, eq.COUPLED_ENERGY]
