"""Energy balance of a run by implicit steps."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.equations.implicit import energies
from evolvent.equations.step_end import end_step
from evolvent.kernels import constraints, contact, rigid
from evolvent.model import MODEL, powers as eq
from evolvent.solvers.common.balance import (
    defect_of,
    extend_extremes,
    largest_of,
    lost_of,
    moved_of,
    potential_of,
    worked_of,
)
from evolvent.solvers.time.implicit import methods as method
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_B = types.boolean
#: Steps in a row with too large a gain after which a run by generalized-alpha ends: the first few from rest gain as
#: much energy as there is, and then less and less beside it.
LASTS = 20


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def add_step_to_balance(t, h, model, work):
    """Add the work and losses of a step of length h to t to the balance.

    Notes
    -----
    Work of loads, drives and wheels is the mean of the forces of both ends times the displacement; losses by mass,
    stiffness, springs and joints are the mean power times h. Under energy-momentum both ends have the means of the
    step. The rest is what families book themselves (`Implicit.end_step`).
    """
    balance, midpoint = work.balance, work.options.midpoint != 0
    P, P0, p, p0 = work.loads1, work.loads0, work.powers[0], work.powers[1]
    given = 0.5 * h * (p[eq.MARKER_LOADS] + p0[eq.MARKER_LOADS])
    for i in range(work.dq.size):
        given += 0.5 * (P[i] + P0[i]) * work.dq[i]
    balance.loads += given
    balance.by_mass += 0.5 * h * (p[eq.MASS_DAMPING] + p0[eq.MASS_DAMPING])
    balance.by_stiffness += 0.5 * h * (p[eq.STIFFNESS_DAMPING] + p0[eq.STIFFNESS_DAMPING])
    balance.by_springs += 0.5 * h * (p[eq.SPRINGS] + p0[eq.SPRINGS])
    balance.by_joints += 0.5 * h * (p[eq.JOINTS] + p0[eq.JOINTS])
    balance.drives += _drives(t, model, work) + 0.5 * h * (p[eq.DRIVEN] + p0[eq.DRIVEN])
    balance.spools += 0.5 * h * (p[eq.SPOOLS] + p0[eq.SPOOLS])
    booked = work.booked
    end_step(t, h, 0.5 if midpoint else 1.0, 0.0, work.y, work.dq, model, booked)
    balance.loads += booked[eq.MARKER_LOADS]
    balance.by_mass += booked[eq.MASS_DAMPING]
    balance.by_stiffness += booked[eq.STIFFNESS_DAMPING]
    balance.by_springs += booked[eq.SPRINGS]
    balance.by_joints += booked[eq.JOINTS]
    balance.drives += booked[eq.DRIVEN]
    balance.spools += booked[eq.SPOOLS]
    if midpoint:
        balance.by_contact += work.step.contact[0]
        balance.by_friction += work.step.contact[1]
    balance.by_contact += booked[eq.CONTACTS]
    balance.by_friction += booked[eq.RUBBED]


@indirect(_B(_B, MODEL, WORKSPACE))
def has_gained(ends, model, work):
    """Whether the balance has gained too much from nothing, beside the energy moved.

    At the start of a motion that has hardly moved any, beside the largest energy. No step of energy-momentum gains by
    its construction. Generalized-alpha gives back some of what it takes: a gain counts there from the lowest on, and
    only where it lasts, or stands where the run `ends`.
    """
    loop, options, balance = work.loop, work.options, work.balance
    extend_extremes(loop, balance.kinetic, potential_of(balance), worked_of(balance), lost_of(balance))
    loop.gain = defect_of(balance, loop.start_energy)
    loop.lowest_gain = min(loop.lowest_gain, loop.gain)
    largest = options.gain * max(moved_of(loop), largest_of(loop)) + options.floor
    if options.conserves != 0:
        return loop.gain > largest
    loop.over = loop.over + 1 if loop.gain - loop.lowest_gain > largest else 0
    return loop.over >= LASTS or (ends and loop.over >= (1 if loop.steps > 5 else 2))


@inlined
def _drives(t, model, work):
    """Work of driven constraints over a step to t, la dg/dt of each, mean la."""
    given = 0.0
    rows = model.constraints
    for k in range(rows.size):
        if rows[k].drives != 0 and constraints.holds(t, rows, k):
            given += 0.5 * (work.la[k] + work.la0[k]) * work.gaps[k]
    return given


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def note_drives(t, h, model, work):
    """Change of each driven gap by its drive alone over a step that starts at t."""
    rows = model.constraints
    for k in range(rows.size):
        work.gaps[k] = 0.0
        if rows[k].drives != 0:
            constraints.measure(constraints.STATE, t, work.y0, k, model)
            now = rows[k].gap
            constraints.measure(constraints.STATE, t + h, work.y0, k, model)
            work.gaps[k] = rows[k].gap - now


@indirect(void(REAL, MODEL, WORKSPACE))
def fill_energies(t, model, work):
    """Energies of the state at t into the balance; contacts and joint coordinates are those of the last residual."""
    balance = work.balance
    if work.options.midpoint != 0:  # whose bodies are at the mean of a step
        rigid.kinematics(t, work.y, model)
    energies(t, work.y, model, work.energies)
    balance.kinetic, balance.elastic, balance.bending = work.energies[0], work.energies[1], work.energies[2]
    balance.contact = contact.energy_of(model)
    balance.coupled = method.coupled_energy(t, model, work)
