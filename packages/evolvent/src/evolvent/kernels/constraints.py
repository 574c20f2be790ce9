"""Rows of constraint, one multiplier each: what solvers ask of them, whichever family they belong to.

A row holds a scalar gap at zero until a time, or is a penalty on it (`stiffness` > 0). Its family answers four
questions on it, `measure`, `bend`, `force` and `tangent` of `Rows`, two more for quicker convergence, and takes
by `answers` the walks over rows, which serve those of all families.
"""

import dataclasses
from typing import Any

import numpy as np
from numba import types

from evolvent.algebra.sparse import add_entry
from evolvent.compiled.jit import REAL, entry, inlined
from evolvent.kernels import calls, rigid
from evolvent.kernels.calls import (
    row_bend_at,
    row_end_at,
    row_force_at,
    row_measure_at,
    row_note_at,
    row_rates_at,
    row_tangent_at,
)
from evolvent.kernels.viscoelastic import (
    excess_square,
    is_kept,
    lost_square,
    note_rate,
    relax,
    relaxed_over,
    stiffness_factor,
)
from evolvent.model import RELEASE, family_type
from evolvent.model.powers import COUPLED_ENERGY, JOINTS
from evolvent.model.questions import Coupling, Explicit, Implicit, Rows, Samples, Stability, Step, Switching

USED_FOR = "constraints"
#: In place of an end of an interval: a state.
STATE = -1


@entry(REAL, family_type("constraints"), types.int64)
@inlined
def holds(t, rows, k):
    """Whether row k holds at time t."""
    return t <= rows[k].until


@inlined
def acts(t, s, rows, k):
    """Whether row k acts under explicit methods, s : (ns,) int, switches.

    A step that starts when it is released does without it.
    """
    if rows[k].switch >= 0 and s[rows[k].switch] != 0:
        return False
    return t < rows[k].until


@inlined
def measure(end, t, y, k, model):
    """Gap, rate and `driven` of row k in a state, which is the start (end 0) or the end (1) of an interval, or `STATE`.

    After `rigid.kinematics`.
    """
    row_measure_at(model, model.rows_measure_calls[model.constraints[k].family])(end, t, y, k, model)


@inlined
def bend(k, model):
    """Second derivative of the gap of row k without accelerations, after `measure` of a state."""
    return row_bend_at(model, model.rows_bend_calls[model.constraints[k].family])(k, model)


@inlined
def add_force(t, h, y, k, la, model, F):
    """Generalised forces of row k with the multiplier la over an interval from t; h = 0: of the state last measured.

    Over an interval they are those whose work is la times the change of the gap, y the mean state.
    """
    row_force_at(model, model.rows_force_calls[model.constraints[k].family])(t, h, y, k, la, model, F)


@calls.force
def note_all(interval, model):
    """Results of the rows whose multipliers are at hand, at a sample."""
    for k in range(interval.la.size):
        measure(STATE, interval.step.t, interval.ym, k, model)
        row_note_at(model, model.rows_note_calls[model.constraints[k].family])(k, interval.la[k], model)


# ------------------------------------------------------------------------------------------------ penalties


@inlined
def is_penalty(t, s, rows, k):
    """Whether row k is a penalty that acts under explicit methods."""
    return rows[k].stiffness > 0.0 and acts(t, s, rows, k)


@inlined
def relaxes(rows, k):
    """Whether row k is a penalty that relaxes (`kernels.viscoelastic`)."""
    return rows[k].prony_end > rows[k].prony


@inlined
def penalty_energy(k, gap, model):
    """stiffness gap^2 / 2, J, and that of its branches; the force is its derivative, stiffness gap."""
    rows, square = model.constraints, gap * gap
    if relaxes(rows, k):
        square += excess_square(rows[k].prony, rows[k].prony_end, rows[k].branch, gap, model)
    return 0.5 * rows[k].stiffness * square


@inlined
def energy_in_state(t, y, k, model):
    """`penalty_energy` of a state of an explicit method."""
    rows = model.constraints
    rigid.kinematics(t, y, model)
    measure(STATE, t, y, k, model)
    for i in range(rows[k].branch, rows[k].branch + rows[k].prony_end - rows[k].prony):
        model.branch_strains[i].w = y[model.branch_strains[i].account]
    return penalty_energy(k, rows[k].gap, model)


@inlined
def relaxed_gap(k, h, mean, end, model):
    """Mean of the gap of row k over an interval of length h, with what its relaxation adds."""
    rows = model.constraints
    if not relaxes(rows, k):
        return mean
    return mean + relax(rows[k].prony, rows[k].prony_end, rows[k].branch, h, mean, end, model)[0]


@inlined
def penalty_loss(k, model):
    """damping rate^2, W, the power that the penalty takes, with that of relaxation in a state of an explicit method."""
    rows, rate = model.constraints, model.constraints[k].rate
    lost = rows[k].damping * rate * rate
    if relaxes(rows, k) and is_kept(0.0, model):
        note_rate(rows[k].prony, rows[k].prony_end, rows[k].branch, rate, model)
        lost += rows[k].stiffness * lost_square(rows[k].prony, rows[k].prony_end, rows[k].branch, model)
    return lost


def penalty_values(t, s, model):
    """Multipliers (not a number of constraints) and the energy (J) of all penalties at a state, after `rhs`.

    Not compiled.
    """
    rows = model.constraints
    penalty = rows["stiffness"] > 0.0
    held = penalty & (t < rows["until"])
    switched = rows["switch"] >= 0
    held[switched] &= s[rows["switch"][switched]] == 0
    gap, rate = np.where(held, rows["gap"], 0.0), np.where(held, rows["rate"], 0.0)
    square, act = gap**2, gap.copy()
    for k in np.flatnonzero(held & (rows["prony_end"] > rows["prony"])).tolist():
        own = slice(int(rows["prony"][k]), int(rows["prony_end"][k]))
        share, first = model.prony_terms["share"][own], int(rows["branch"][k])
        w = model.branch_strains["w"][first : first + share.size]
        act[k] += share @ (w - gap[k])
        square[k] += share @ (w**2 - gap[k] ** 2)
    la = np.where(penalty, rows["stiffness"] * act + rows["damping"] * rate, np.nan)
    return la, float(0.5 * rows["stiffness"] @ square)


@calls.force
def add_penalties(interval, model):
    """Forces of penalties under explicit methods; constraints are rows of `kernels.constraint_rows`."""
    rows, t = model.constraints, interval.step.t
    for k in range(rows.size):
        if is_penalty(t, interval.s, rows, k):
            measure(STATE, t, interval.ym, k, model)
            gap = relaxed_gap(k, 0.0, rows[k].gap, rows[k].gap, model)
            force = rows[k].stiffness * gap + rows[k].damping * rows[k].rate
            add_force(t, 0.0, interval.ym, k, force, model, model.F)
            interval.powers[JOINTS] += penalty_loss(k, model)
        elif relaxes(rows, k):
            note_rate(rows[k].prony, rows[k].prony_end, rows[k].branch, 0.0, model)


@calls.energy
def add_penalty_energies(interval, model, out):
    """Elastic energy of penalties under explicit methods."""
    rows, t = model.constraints, interval.step.t
    for k in range(rows.size):
        if is_penalty(t, interval.s, rows, k):
            measure(STATE, t, interval.ym, k, model)
            out[1] += penalty_energy(k, rows[k].gap, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of all penalties at the end of a step."""
    rows, found = model.constraints, 0.0
    for k in range(rows.size):
        if rows[k].stiffness > 0.0 and holds(t, rows, k):
            found += penalty_energy(k, rows[k].gap1, model)
    return found


@inlined
def release_row(t, k, ends, y, s, model):
    """Release row k at t: its switch, and under implicit methods its end; the energy of a penalty leaves the balance.

    Parameters
    ----------
    ends : as of `watches.release`

    Returns
    -------
    1 where it has held, else 0
    """
    rows = model.constraints
    if ends != 0:
        if not rows[k].until > t:
            return 0
        rows[k].until = t
    elif not acts(t, s, rows, k):
        return 0
    elif rows[k].stiffness > 0.0:
        y[model.info.nq + model.info.nv + RELEASE] -= energy_in_state(t, y, k, model)
    s[rows[k].switch] = 1
    return 1


@calls.release
def release(t, trigger, ends, y, s, model):
    """Release the rows that wait for a trigger."""
    rows, found = model.constraints, 0
    for k in range(rows.size):
        if rows[k].event == trigger:
            found = max(found, release_row(t, k, ends, y, s, model))
    return found


# ------------------------------------------------------------------------------------------------ implicit methods


@calls.ties
def ties(t, model):
    """Whether a row that holds ties the system to what is not part of it."""
    rows, found = model.constraints, 0
    for k in range(rows.size):
        if rows[k].outside != 0 and holds(t, rows, k):
            found = 1
    return found


@calls.measure
def measure_all(end, t, y, model):
    """Gaps of all rows at the start (end 0) or the end (1) of an interval, t and y the time and state there."""
    rows = model.constraints
    for k in range(rows.size):
        measure(end, t, y, k, model)
        if end == 0:
            rows[k].gap0 = rows[k].gap
        else:
            rows[k].gap1 = rows[k].gap


@calls.force
def add_residuals(interval, model):
    """Forces by multipliers, and the rows; a multiplier is 0 over a step at whose end its row does not hold.

    A penalty is a constraint with a compliance, gap + (damping rate - la)/stiffness = 0, by the mean gap.
    """
    rows, t, h, n_v = model.constraints, interval.step.t, interval.step.h, model.info.nv
    y, r = interval.ym, interval.r
    for k in range(rows.size):
        held = holds(t + h, rows, k)
        if h == 0.0:
            measure(STATE, t, y, k, model)
        elif not held:
            interval.la[k] = 0.0
        la = interval.la[k]
        if not held:
            r[n_v + k] = la
            continue
        if h == 0.0:
            rows[k].gap0 = rows[k].gap1 = rows[k].gap
        add_force(t, h, y, k, la, model, model.F)
        gap0, gap1, stiffness, damping = rows[k].gap0, rows[k].gap1, rows[k].stiffness, rows[k].damping
        r[n_v + k] = gap1
        if h == 0.0 and model.info.exact == 0:
            r[n_v + k] -= rows[k].slack * model.info.compliance * la
        if stiffness > 0.0:
            rate = (gap1 - gap0) / h if h > 0.0 else rows[k].rate
            mean = relaxed_gap(k, h, 0.5 * (gap0 + gap1), gap1, model)
            r[n_v + k] = mean + (damping * rate - la) / stiffness
            interval.powers[COUPLED_ENERGY] += penalty_energy(k, gap1, model)
            interval.powers[JOINTS] += damping * rate * rate


@calls.force
def end_step(interval, model):
    """What relaxation of all penalties takes over a step."""
    rows, step = model.constraints, interval.step
    for k in range(rows.size):
        if relaxes(rows, k) and holds(step.t, rows, k):
            lost = relaxed_over(rows[k].prony, rows[k].prony_end, rows[k].branch, step.h, model)
            interval.powers[JOINTS] += rows[k].stiffness * lost


@inlined
def _factor(k, h, c_rate, model):
    """Factor of the gap of row k in its equation: a penalty relaxes, and its damper adds."""
    rows, factor = model.constraints, 1.0
    if relaxes(rows, k):
        factor = stiffness_factor(rows[k].prony, rows[k].prony_end, h, model)
    return factor + c_rate * rows[k].damping / rows[k].stiffness if rows[k].stiffness > 0.0 else 1.0


@inlined
def _add_tangent(t, k, with_row, interval, model, matrix):
    """Add row k to a tangent, its equation `with_row` times: 1, or 0 where `add_end_rows` adds it."""
    rows, step, row = model.constraints, interval.step, model.info.nv + k
    scale, la = step.scale, interval.la[k]
    if not holds(t, rows, k):
        add_entry(matrix, row, row, scale * scale)
        return
    if rows[k].stiffness > 0.0:
        add_entry(matrix, row, row, -scale * scale / rows[k].stiffness)
    elif rows[k].slack > 0.0:
        add_entry(matrix, row, row, -scale * scale * rows[k].slack * model.info.compliance)
    damped = with_row * _factor(k, step.h, step.c_rate, model)
    row_tangent_at(model, model.rows_tangent_calls[rows[k].family])(k, la, row, scale, damped, model, matrix)


@calls.tangent
def add_tangents(interval, model, matrix):
    """Derivatives of `add_residuals` in a state."""
    rows, step = model.constraints, interval.step
    for k in range(rows.size):
        _add_tangent(step.t, k, 1.0, interval, model, matrix)
        if rows[k].stiffness > 0.0 and rows[k].damping > 0.0 and holds(step.t, rows, k):
            factor, row = step.scale * rows[k].damping / rows[k].stiffness, model.info.nv + k
            row_rates_at(model, model.rows_rates_calls[rows[k].family])(interval.ym, k, row, factor, model, matrix)


@calls.tangent
def add_step_tangents(interval, model, matrix):
    """Derivatives of `add_residuals` over a step, but for the rows of the end (`add_end_rows`)."""
    rows, step = model.constraints, interval.step
    for k in range(rows.size):
        _add_tangent(step.t + step.h, k, 0.0 if rows[k].ends != 0 else 1.0, interval, model, matrix)


@inlined
def add_end_rows(t, h, y, dq, scale, c_rate, model, matrix):
    """Derivatives of the gaps at the end of a step by its increments dq, times `scale`, of families that give them.

    Parameters
    ----------
    t, h : float, s, end and length of the step
    y : (ny,) float, state at the end, where the bodies are
    dq : (nv,) float; that of a rotation is 2 p = 2 tan(angle/2) about its axis, and a change of it turns the end by
        (1 - p x)/(1 + p.p) of the change, body axes of the end
    """
    rows = model.constraints
    for k in range(rows.size):
        if rows[k].ends != 0 and holds(t, rows, k):
            measure(STATE, t, y, k, model)
            factor, row = scale * _factor(k, h, c_rate, model), model.info.nv + k
            row_end_at(model, model.rows_end_calls[rows[k].family])(y, dq, k, row, factor, model, matrix)


@calls.row_rates
def no_rates(y, k, row, scale, model, matrix):
    """Of a family that leaves out what a change of place alone changes in the rate of a gap."""


@calls.row_end
def no_end(y, dq, k, row, scale, model, matrix):
    """Of a family whose `Rows.tangent` gives the rows of steps as well."""


def answers(rows: Rows) -> dict[str, Any]:
    """Answers of a family whose records are rows of constraint, as fields of `Family`: its own, and walks over all."""
    return {
        "rows": dataclasses.replace(rows, rates=rows.rates or no_rates, end=rows.end or no_end),
        "force": add_residuals,
        "tangent": add_tangents,
        "of_step": False,
        "coupling": Coupling(at_times=True, ties=ties, couples=lambda row, _: iter(())),  # by its multiplier
        "implicit": Implicit(end_step=end_step),
        "explicit": Explicit(force=add_penalties, energy=add_penalty_energies),
        "stability": Stability(by_rates=lambda model: bool(model.info.penalties > 0)),
        "step": Step(measure=measure_all, tangent=add_step_tangents, energy=coupled_energy),
        "switching": Switching(release=release),
        "samples": Samples(evaluate=note_all),
    }
