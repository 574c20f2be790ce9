"""Steps of energy-momentum as linear maps, and their transposes; see `solvers.sensitivity.recorded_steps`.

Notes
-----
A step from z0 = (e0, v0, b0) to z1, with b the change of the velocities over the step before, has the equations
R(u; z0, p) = 0 of its increments and multipliers u (`evolvent.equations.energy_momentum`) and, with c = 2/(1 + chi_v)
and f = chi_v r/2::

    e1 = T u + E e0,   v1 = v0 + b1,   b1 = c (u/h - v0 + f b0)

T = s (1 - [p]x), E = C(2 p)^T of turns by the increments 2 p, s = 1/(1 + p.p). Backwards, with (x, y, w) by z1::

    R_u^T W = T^T x + (c/h)(y + w),   dvalue -= W^T R_p dp
    (x, y, w) <- (E^T x, y - c (y + w), c f (y + w)) - R_z0^T W

Where no coordinate turns and all families say so (`AdjointSupport.mirrored`), R_u is the tangent of Newton's method,
and the forces do not change where the ends of the step are exchanged, of which h changes sign and increments are -u.
With K the tangent of the forces, S that at the exchanged step with the inertia of elements, which is among these, of
the other sign, and with the rows of penalties alone, and G the rows of constraints and penalties at the end::

    R_e0 = K + G + S

Else the columns of R_u and R_e0 are central differences of the residual, of many unknowns at once that have no equation
in common. Columns by multipliers have a scale of their own, since nothing stands on the right of their equations.
Velocities at the start, and b0, are only in the inertia.
"""

from __future__ import annotations

import numpy as np
from numba import types, void

from evolvent.algebra import sparse, sparse_lu
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, indirect, inlined
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.equations.energy_momentum import add_end_rows, add_force_tangents, add_inertia_tangents, measure, residual
from evolvent.kernels.blocks import ANGLE, ROTATION, displace
from evolvent.model import MODEL
from evolvent.model.family import every
from evolvent.model.registry import cubic, whole
from evolvent.solvers.sensitivity.colours import coloured, equations_of, joined
from evolvent.solvers.sensitivity.recorded_steps import (
    CHANGE,
    CHI,
    CHI_V,
    LENGTH,
    RATIO,
    RECORDED_STEPS,
    SHIFT,
    TIME,
    TIMED,
)
from evolvent.solvers.sensitivity.transposed import LINEAR, apply_rotation, multiply, multiply_mass, transpose
from evolvent.solvers.time.implicit import methods as method
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_I = types.int64
#: Change of coordinates by differences of the fourth order, and of multipliers, in which the residual is linear.
WIDE = 1e-4
_model_at = at_address(MODEL)
#: Central differences of the second and of the fourth order, as of `Colours.stencil`. Those of the fourth are exact of
#: beams, whose forces are cubic in their coordinates: changes are large, as their stiff directions leave round-off.
STENCILS = (
    ((CHANGE, 0.5 / CHANGE), (-CHANGE, -0.5 / CHANGE)),
    ((WIDE, 2 / 3 / WIDE), (-WIDE, -2 / 3 / WIDE), (2 * WIDE, -1 / 12 / WIDE), (-2 * WIDE, 1 / 12 / WIDE)),
)


class Colours(Struct):
    """Coordinates, and multipliers behind them, of which no two of a colour have an equation in common.

    Attributes
    ----------
    starts : (colours + 1,) int; columns : (nv + nj,) int, unknowns of each colour
    first : (nv + nj + 1,) int; rows : (n,) int, equations of each unknown
    inexact : (1,) int, 1 where the tangent is not exact; moving : (1,) int, colours of coordinates
    stencil : (n, 2) float, changes of a coordinate, beside its size, and factors of the residuals in its derivative
    base : (ny,) float, and move : (nv,) float, scratch
    """

    starts: np.ndarray = array(1, np.int64)
    columns: np.ndarray = array(1, np.int64)
    first: np.ndarray = array(1, np.int64)
    rows: np.ndarray = array(1, np.int64)
    inexact: np.ndarray = array(1, np.int64)
    moving: np.ndarray = array(1, np.int64)
    stencil: np.ndarray = array(2)
    base: np.ndarray = array(1)
    move: np.ndarray = array(1)


COLOURS = Colours._numba_type_


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def evaluate(t, h, model, work):
    """Residual `work.r` of a step of length h from t, from `work.y0` with the increments and multipliers there are."""
    step = work.step
    step.step.t, step.step.h, step.step.soft = t, h, 1.0
    measure(0, model, step)
    residual(model, step)


@inlined
def _load(n, recorded, model, work):
    """Step n of a record into the workspace; returns its time, length, c and f."""
    step, numbers = work.step, recorded.numbers[n]
    step.step.chi, step.step.chi_v, step.step.ratio = numbers[CHI], numbers[CHI_V], numbers[RATIO]
    for i in range(work.y0.size):
        work.y0[i] = recorded.y0[n, i]
    for i in range(work.dq.size):
        work.dq[i], step.before[i] = recorded.dq[n, i], recorded.a[n, i]
    for i in range(work.la.size):
        work.la[i] = recorded.la[n, i]
    for i in range(model.switches.size):
        model.switches[i] = recorded.switches[n, i]
    return numbers[TIME], numbers[LENGTH], 2.0 / (1.0 + numbers[CHI_V]), 0.5 * numbers[CHI_V] * numbers[RATIO]


@inlined
def _find_rows(t, h, timed, model, models, work, linear):
    """Derivatives of equations by parameters and time, as of `recorded_steps.Linear.rows`; the run keeps its own."""
    groups, rows, r = linear.sides.size, linear.rows, work.r
    for g in range(groups):
        for side in range(linear.sides[g]):
            own = _model_at(models[2 * g + side])
            for i in range(model.switches.size):
                own.switches[i] = model.switches[i]
            evaluate(t, h, own, work)
            for i in range(r.size):
                rows[g, i] = r[i] if side == 0 else 0.5 * (rows[g, i] - r[i])
    for i in range(r.size):
        rows[groups, i] = 0.0
    if timed:
        for side in (1.0, -1.0):
            evaluate(t + side * SHIFT * h, h, model, work)
            for i in range(r.size):
                rows[groups, i] += 0.5 * side / (SHIFT * h) * r[i]
    evaluate(t, h, model, work)
    for g in range(groups):
        for i in range(r.size):
            if linear.sides[g] == 1:
                rows[g, i] -= r[i]
            if rows[g, i] != 0.0:
                linear.changes[g, i] = 1


@inlined
def _size(j, n, recorded, work, colours):
    """Size of unknown j, in which its changes are given; of multipliers such that they change by `WIDE`."""
    n_v = work.dq.size
    return work.weight[j] if j < n_v else WIDE / colours.stencil[0, 0] * (1.0 + abs(recorded.la[n, j - n_v]))


@inlined
def _difference(k, starts, t, h, recorded, n, model, work, colours, out):
    """Derivatives of the residual by the unknowns of colour k, times their sizes.

    Parameters
    ----------
    starts : bool, whether coordinates of the start are changed, with the increments as they are; else increments
    """
    base, move, columns, stencil, r = colours.base, colours.move, colours.columns, colours.stencil, work.r
    for i in range(move.size):
        move[i] = 0.0
    for i in range(r.size):
        out[i] = 0.0
    for s in range(stencil.shape[0]):
        change, factor = stencil[s, 0], stencil[s, 1]
        for p in range(colours.starts[k], colours.starts[k + 1]):
            j = columns[p]
            if starts:
                move[j] = change * work.weight[j]
            elif j < move.size:
                work.dq[j] = recorded.dq[n, j] + change * work.weight[j]
            else:
                work.la[j - move.size] = recorded.la[n, j - move.size] + change * _size(j, n, recorded, work, colours)
        if starts:
            displace(base, move, False, model, work.y0)
        evaluate(t, h, model, work)
        for i in range(r.size):
            out[i] += factor * r[i]
    for p in range(colours.starts[k], colours.starts[k + 1]):
        if columns[p] < move.size:
            work.dq[columns[p]] = recorded.dq[n, columns[p]]
        else:
            work.la[columns[p] - move.size] = recorded.la[n, columns[p] - move.size]


@inlined
def _row_scale(i, scale, model):
    """What the equation of unknown i is multiplied by in the tangent."""
    n_v = model.info.nv
    if i < n_v:
        return 2.0
    return scale if model.constraints[i - n_v].stiffness <= 0.0 else 2.0 * scale


@inlined
def _assemble(t, h, n, recorded, scale, model, work, room, colours, linear, out):
    """The matrix of step n: the tangent, with columns by differences where it is not exact; after `evaluate`.

    Where it is exact, the tangent of the forces alone goes into `Linear.K`, and the rest into A.
    """
    model.info.compliance = 1.0 / scale
    add_force_tangents(scale, 1.0, 2.0 / h, model, work.step, room)
    for i in range(room.values.size if colours.inexact[0] == 0 else 0):
        linear.K[i] = room.values[i]
    add_inertia_tangents(model, work.step, room)
    for i in range(room.values.size if colours.inexact[0] == 0 else 0):
        linear.A[i] = room.values[i] - linear.K[i]
    for k in range(colours.starts.size - 1 if colours.inexact[0] != 0 else 0):
        _difference(k, False, t, h, recorded, n, model, work, colours, out)
        for p in range(colours.starts[k], colours.starts[k + 1]):
            j, held = colours.columns[p], False
            for q in range(colours.first[j], colours.first[j + 1]):
                held = held or out[colours.rows[q]] != 0.0
            for q in range(colours.first[j], colours.first[j + 1] if held else 0):  # not of joints that hold nothing
                i = colours.rows[q]
                at, _, _ = sparse.first_entry(room, i, j)
                if at >= 0:
                    room.values[at] = _row_scale(i, scale, model) * out[i] / _size(j, n, recorded, work, colours)


@inlined
def _turn(dq, kind, model, x, out):
    """Out = T^T x (`kind` 0), E^T x (1) or, of turns, C^T x (2)."""
    blocks, n_q = model.blocks, model.info.nq
    for i in range(dq.size):
        out[i] = x[i]
    for k in range(blocks.size):
        at = blocks[k].iv - n_q
        if blocks[k].kind == ANGLE and kind == 0:
            out[at] = x[at] / (1.0 + 0.25 * dq[at] * dq[at])
        elif blocks[k].kind == ROTATION:
            p = 0.5 * dq[at], 0.5 * dq[at + 1], 0.5 * dq[at + 2]
            s = 1.0 / (1.0 + p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
            if kind == 0:
                apply_rotation(at, p, s, s, 0.0, x, out)
            else:
                apply_rotation(at, p, 1.0, 2.0 * s if kind == 1 else -2.0 * s, 2.0 * s, x, out)


@inlined
def _exchange(t, h, n, recorded, scale, model, work, room):
    """Tangent of the forces, less the inertia of elements, and of penalties of step n where its ends are exchanged."""
    for i in range(work.y0.size):
        work.y0[i] = recorded.y1[n, i]
    for i in range(work.dq.size):
        work.dq[i] = -recorded.dq[n, i]
    evaluate(t + h, -h, model, work)
    add_force_tangents(scale, -1.0, -2.0 / h, model, work.step, room)
    if model.constraints.size > 0:
        add_end_rows(scale, -2.0 / h, model, work.step, room)
    for i in range(work.y0.size):
        work.y0[i] = recorded.y0[n, i]
    for i in range(work.dq.size):
        work.dq[i] = recorded.dq[n, i]


@inlined
def _subtract_by_start(scale, W, model, room, linear, x):
    """Subtract R_e0^T W from derivatives x (nv,) by coordinates, after `_exchange`."""
    n_v, rows, part, out = x.size, model.constraints, linear.parts[0], linear.parts[1]
    for i in range(W.size):
        part[i] = W[i] / _row_scale(i, scale, model)
    multiply(linear.K, room, part, out)
    for i in range(n_v):
        x[i] -= out[i]
    for i in range(n_v, W.size):
        part[i] = part[i] if rows[i - n_v].stiffness > 0.0 else 0.0
    multiply(room.values, room, part, out)
    for i in range(n_v):
        x[i] -= out[i]
    if rows.size > 0:
        for i in range(W.size):
            part[i] = W[i] / _row_scale(i, scale, model) if i >= n_v else 0.0
        multiply(linear.A, room, part, out)
        for i in range(n_v):
            x[i] -= out[i]


@indirect(_I(_I, _I, RECORDED_STEPS, SPARSE, SPARSE, MODEL, INTEGERS, WORKSPACE, LINEAR, COLOURS, MATRIX, MATRIX))
def pull_back(first, last, recorded, room, matrix, model, models, work, linear, colours, derivatives, found):
    """Take derivatives of values by the state at the end of step `last` back to the start of step `first`.

    Parameters and what is returned as of `recorded_steps.pull_back`; `derivatives` : (values, 3 nv + 1) float, by (e,
    v, b) and the time by which the steps are shifted; `work` : Workspace, scratch.
    """
    n_v, groups, values = model.info.nv, linear.sides.size, derivatives.shape[0]
    right, rows, parts = linear.right, linear.rows, linear.parts
    for n in range(last, first - 1, -1):
        t, h, c, f = _load(n, recorded, model, work)
        scale = method.scale_of(h, work.options)
        _find_rows(t, h, recorded.counts[TIMED] != 0, model, models, work, linear)
        _assemble(t, h, n, recorded, scale, model, work, room, colours, linear, parts[0])
        transpose(room.values, matrix)
        if sparse_lu.factor(matrix) != 0:
            return n + 1
        if colours.inexact[0] == 0:
            _exchange(t, h, n, recorded, scale, model, work, room)
        for q in range(values):
            W, x, y, w = linear.W[q], derivatives[q, :n_v], derivatives[q, n_v : 2 * n_v], derivatives[q, 2 * n_v :]
            _turn(work.dq, 0, model, x, right[:n_v])
            for i in range(right.size):
                W[i] = right[i] + c / h * (y[i] + w[i]) if i < n_v else 0.0
            sparse_lu.solve(matrix, W)
            for i in range(W.size):
                W[i] *= _row_scale(i, scale, model)
            for g in range(groups):
                for i in range(W.size):
                    found[q * groups + g, i] += W[i] * rows[g, i]
            for i in range(W.size):
                derivatives[q, 3 * n_v] -= W[i] * rows[groups, i]
            multiply_mass(linear, W, parts[1])
            _turn(work.dq, 2, model, W, parts[2])
            for i in range(n_v, W.size):
                parts[2, i] = W[i]
            multiply_mass(linear, parts[2], parts[3])
            for i in range(n_v):
                b = y[i] + w[i]
                y[i] += ((c - 1.0) * parts[3, i] + parts[1, i]) / h - c * b
                w[i] = c * f * (b - parts[3, i] / h)
            _turn(work.dq, 1, model, x, parts[2])
            for i in range(n_v):
                x[i] = parts[2, i]
            if colours.inexact[0] == 0:
                _subtract_by_start(scale, W, model, room, linear, x)
        if colours.inexact[0] != 0:
            _pull_back_coordinates(t, h, n, recorded, model, work, linear, colours, derivatives)
    return -1


@inlined
def _pull_back_coordinates(t, h, n, recorded, model, work, linear, colours, derivatives):
    """Subtract R_e0^T W from the derivatives by coordinates."""
    out = linear.parts[0]
    for i in range(work.y0.size):
        colours.base[i] = work.y0[i] = recorded.y0[n, i]
    for k in range(colours.moving[0]):
        _difference(k, True, t, h, recorded, n, model, work, colours, out)
        for p in range(colours.starts[k], colours.starts[k + 1]):
            j = colours.columns[p]
            for q in range(derivatives.shape[0]):
                total = 0.0
                for at in range(colours.first[j], colours.first[j + 1]):
                    total += linear.W[q, colours.rows[at]] * out[colours.rows[at]]
                derivatives[q, j] -= total / work.weight[j]


def is_mirrored(model):
    """Whether tangents of a step are exact and its forces do not change where its ends are exchanged."""
    if np.any(np.isin(model.blocks["kind"], (ANGLE, ROTATION))):
        return False
    own = ((family.adjoint, family.records(model)) for family in whole())
    return all(support is not None and every(support.mirrored, found) for support, found in own if found.size)


def colours_of(assembly):
    """Colours of the coordinates of a model by the ends of its forces: `Colours`; not compiled."""
    model, equations = assembly.model, equations_of(assembly)
    n_v, n_u = int(model.info.nv), len(equations)
    moving = coloured(equations, range(n_v))
    starts, columns = joined([*moving, *coloured(equations, range(n_v, n_u))])
    first, rows = joined(equations)
    return Colours(
        starts=starts,
        columns=columns,
        first=first,
        rows=rows,
        inexact=np.array([0 if is_mirrored(model) else 1]),
        moving=np.array([len(moving)]),
        stencil=np.array(STENCILS[1 if cubic(model) else 0]),
        base=np.zeros(int(model.info.ny)),
        move=np.zeros(n_v),
    )
