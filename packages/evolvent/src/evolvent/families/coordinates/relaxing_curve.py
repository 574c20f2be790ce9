"""Relaxation of a curve T(x) of a resistance.

With the energy U of the curve, 0 where it is least, at x0, the strain y = sign(x - x0) sqrt(2 U) has the energy y^2/2
and the torque T = y dy/dx. It relaxes by a Prony series (`kernels.viscoelastic`), so that the torque is

    (y + sum_i g_i (w_i - y)) dy/dx

and one at a held coordinate falls by the series, whatever the curve. Over a step the torque is the mean of the first
factor times the change of y over that of x: its work is what is stored and dissipated.
"""

import math

from numba import types

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.axial import SMALL
from evolvent.kernels.profile import row_before
from evolvent.kernels.viscoelastic import excess_square, is_kept, lost_square, relax, relaxed_over
from evolvent.model import MODEL

USED_FOR = "resistances"
_I = types.int64
#: Change of a strain, beside its mean, below which its secant is that of the energy.
_NEAR = 0.1


@indirect(types.UniTuple(REAL, 3)(_I, REAL, MODEL))
def strain_of(c, x, model):
    """Strain y of curve c at x, and its first two derivatives.

    Notes
    -----
    By the end of the straight line at x where the energy is less: where it is 0, as it is at x0, without round-off.
    """
    p, curves = model.parameters, model.curves
    first, n = curves[c].first, curves[c].count
    i = row_before(p, first, n, x)
    slope = (p[first + n + i + 1] - p[first + n + i]) / (p[first + i + 1] - p[first + i])
    if p[first + 2 * n + i + 1] < p[first + 2 * n + i]:
        i += 1
    d, torque, energy = x - p[first + i], p[first + n + i], p[first + 2 * n + i]
    if torque == 0.0 and energy == 0.0:
        root = math.sqrt(max(slope, 0.0))
        return root * d, root, 0.0
    y = math.sqrt(2.0 * max(energy + d * (torque + 0.5 * slope * d), 0.0))
    if y == 0.0:
        return 0.0, math.sqrt(max(slope, 0.0)), 0.0
    if x < curves[c].zero:
        y = -y
    rate = (torque + slope * d) / y
    return y, rate, (slope - rate * rate) / y


@inlined
def _secant(y0, y1, dx, torque, by_x):
    """Change of a strain over that of the coordinate; torque: mean of the curve's."""
    if abs(dx) < SMALL:
        return by_x
    mean = 0.5 * (y0 + y1)
    return (y1 - y0) / dx if abs(y1 - y0) > _NEAR * abs(mean) else torque / mean


@indirect(types.UniTuple(REAL, 4)(_I, _I, REAL, REAL, REAL, REAL, MODEL))
def relaxed_torque(k, c, share, before, x, torque, model):
    """What relaxation adds to the torque of resistance k on its curve c.

    Parameters
    ----------
    share : 1 of a state at x, 0.5 of a step from before to x
    torque : float, N m or N, of the curve, its mean over a step

    Returns
    -------
    torque : float; slope : float, derivative by the coordinate, over a step twice that by its end
    stored : float, J; lost : float, W, in a state of an explicit method
    """
    first, last, branch = model.resistances[k].prony, model.resistances[k].prony_end, model.resistances[k].branch
    y1, by_x, bend = strain_of(c, x, model)
    if share == 1.0:
        lost = 0.0
        if is_kept(0.0, model):
            for i in range(branch, branch + last - first):
                model.branch_strains[i].w, model.branch_strains[i].rate = y1 + model.branch_strains[i].kept, 0.0
            lost = lost_square(first, last, branch, model)
        added, factor = relax(first, last, branch, 0.0, y1, y1, model)
        stored = 0.5 * excess_square(first, last, branch, y1, model)
        return added * by_x, (factor - 1.0) * by_x * by_x + added * bend, stored, lost
    y0, _, _ = strain_of(c, before, model)
    added, factor = relax(first, last, branch, model.info.over, 0.5 * (y0 + y1), y1, model)
    stored = 0.5 * excess_square(first, last, branch, y1, model)
    dx = x - before
    secant = _secant(y0, y1, dx, torque, by_x)
    turn = bend if abs(dx) < SMALL else 2.0 * (by_x - secant) / dx
    return added * secant, (factor - 1.0) * by_x * secant + added * turn, stored, 0.0


@inlined
def relaxed_resistances(h, model):
    """What relaxation of all resistances takes over a step of length h that is accepted, J."""
    rows, taken = model.resistances, 0.0
    for k in range(rows.size):
        if rows[k].prony_end > rows[k].prony:
            taken += relaxed_over(rows[k].prony, rows[k].prony_end, rows[k].branch, h, model)
    return taken


@inlined
def excess_energy(k, c, x, model):
    """Energy of the branches of resistance k at x on curve c, beyond that of the curve, J."""
    row = model.resistances[k]
    if row.prony_end == row.prony:
        return 0.0
    return 0.5 * excess_square(row.prony, row.prony_end, row.branch, strain_of(c, x, model)[0], model)


@inlined
def snap(k, after, x, state, model):
    """Take the strain of resistance k to the curve `after`, with those of its branches; returns what is left of U.

    Parameters
    ----------
    state : (ny,) float, whose accounts hold the strains of the dashpots
    """
    row, left = model.resistances[k], 1.0
    y = strain_of(after, x, model)[0] if row.prony_end > row.prony else 0.0
    for i in range(row.prony_end - row.prony):
        left -= model.prony_terms[row.prony + i].share
        own = model.branch_strains[row.branch + i]
        own.x = own.x0 = y
        state[own.account] = own.w - y
    return left
