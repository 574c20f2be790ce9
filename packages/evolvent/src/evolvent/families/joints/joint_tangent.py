"""Tangents of joints: of their forces, and of what they hold at the end of a step."""

from evolvent.algebra.sparse import add_entry, first_entry
from evolvent.compiled.jit import inlined, kernel
from evolvent.families.joints.gear import add_gear, add_gear_rates
from evolvent.families.joints.joint import side_rates
from evolvent.kernels import reduced, rigid
from evolvent.kernels.calls import row_end, row_rates, row_tangent
from evolvent.kernels.gaps import (
    ANGLE,
    CORD,
    GEAR,
    SEGMENT,
    add_gap_tangent,
    copies_at,
    gap_rate_slopes,
    is_place,
    side_count,
)
from evolvent.kernels.rotations import cross, turn_back
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns
from evolvent.kernels.thread.joined import couple_spool, turn_spool

USED_FOR = "joints"


@kernel
def _add_gradient(matrix, row, at, n, g, J, scale, damped, times):
    """Add scale J^T g as column `row`, `times` so much, and as row `row` times `damped`; of n unknowns from `at` on."""
    if n == 0:
        return
    values = matrix.values
    to, right, _ = first_entry(matrix, row, at)
    of, _, down = first_entry(matrix, at, row)
    if to < 0 or of < 0:
        return
    for c in range(n):
        value = scale * (g[0] * J[0, c] + g[1] * J[1, c] + g[2] * J[2, c])
        values[to + c * right] += value * damped
        values[of + c * down] += value * times


@row_tangent
def add_held_joint(k, la, row, scale, damped, model, matrix):
    """Add joint k: gradient as row and column `row`, times `scale`, the row times `damped` as well, and la g'."""
    n_q = model.info.nq
    joints = model.joints
    kind = joints[k].kind
    if kind == ANGLE:
        at = joints[k].iv[1] - n_q
        add_entry(matrix, row, at, scale * damped)
        add_entry(matrix, at, row, scale)
        return
    if kind == GEAR:
        add_gear(k, la, row, scale, damped, model, matrix)
        return
    points = is_place(kind, 0)
    Ja, Jb, Jd = model.J[0], model.J[1], model.J[2]
    a, n = side_columns(model, joints[k].on[0], joints[k].index[0], joints[k].iv[0], joints[k].local[0], points, Ja)
    b, m = side_columns(model, joints[k].on[1], joints[k].index[1], joints[k].iv[1], joints[k].local[1], points, Jb)
    ga, gb = joints[k].g[0], joints[k].g[1]
    _add_gradient(matrix, row, a, n, ga, Ja, scale, damped, copies_at(k, 0, model))
    _add_gradient(matrix, row, b, m, gb, Jb, scale, damped, 1.0)
    if joints[k].reduced > 0:
        reduced.add_shape(k, row, scale, scale * damped, model, matrix)
    if kind == SEGMENT and joints[k].on[0] == ON_BODY:
        couple_spool(matrix, joints[k].first, row, scale, damped, model)
    d, n_d = 0, 0
    if side_count(kind) == 3:
        d, n_d = side_columns(
            model, joints[k].on[2], joints[k].index[2], joints[k].iv[2], joints[k].local[2], is_place(kind, 2), Jd
        )
        _add_gradient(matrix, row, d, n_d, joints[k].g[2], Jd, scale, damped, 1.0)
    if la == 0.0:
        return
    for side in range(side_count(kind)):
        if joints[k].on[side] == ON_BODY:
            g, force = joints[k].g[side], la * copies_at(k, side, model)
            add_turning(
                matrix, model, joints[k].index[side], joints[k].local[side],
                force * g[0], force * g[1], force * g[2],
            )  # fmt: skip
    if kind == CORD:
        d, n_d = _drum_at_end(k, model, Jd)
    add_gap_tangent(k, la, model, matrix, a, n, Ja, b, m, Jb, d, n_d, Jd)


@inlined
def _drum_at_end(k, model, J):
    """Columns of the drum's body at the point where the free end of the cord k is, as of `sides.side_columns`."""
    joints, own = model.joints, model.e[2]
    body, end = joints[k].index[0], joints[k].u[1]
    x, R = model.bodies[body].x, model.bodies[body].R
    own[0], own[1], own[2] = turn_back(R, end[0] - x[0], end[1] - x[1], end[2] - x[2])
    return side_columns(model, ON_BODY, body, joints[k].iv[0], own, True, J)


@row_rates
def add_rate_row(y, k, row, factor, model, matrix):
    """Add what a change of place alone changes in the rate of the gap of joint k to row `row`, times `factor`.

    Notes
    -----
    The rate of the gap is the sum of g . v of all sides with the vectors u and rates v. It changes by h . du, h the
    second derivatives of the gap times the rates, and by g . dv where v turns with a body.
    """
    joints, bodies, J, own = model.joints, model.bodies, model.J[0], model.e[2]
    kind = joints[k].kind
    if kind == GEAR:
        add_gear_rates(y, k, row, factor, model, matrix)
        return
    for side in range(side_count(kind)):
        on, index, g, points = joints[k].on[side], joints[k].index[side], joints[k].g[side], is_place(kind, side)
        h = rate_slopes(y, k, side, model)
        at, n = side_columns(model, on, index, joints[k].iv[side], joints[k].local[side], points, J)
        for c in range(n):
            value = h[0] * J[0, c] + h[1] * J[1, c] + h[2] * J[2, c]
            add_entry(matrix, row, at + c, factor * value)
        if on != ON_BODY:
            continue
        u, v = side_of(y, k, side, model), bodies[index].v
        share = 1.0 if points else 0.0
        own[0], own[1], own[2] = turn_back(
            bodies[index].R, u[3] - share * v[0], u[4] - share * v[1], u[5] - share * v[2]
        )
        at, n = side_columns(model, ON_BODY, index, -1, own, False, J)
        for c in range(n):
            add_entry(matrix, row, at + c, factor * (g[0] * J[0, c] + g[1] * J[1, c] + g[2] * J[2, c]))


@inlined
def side_of(y, k, side, model):
    """Vector of a side of joint k and its rate: six floats."""
    joints = model.joints
    return side_rates(y, joints, model.bodies, k, side, is_place(joints[k].kind, side))


@inlined
def rate_slopes(y, k, side, model):
    """Second derivative of the gap of joint k by the vector of a side and by all, times their rates: three floats."""
    a, b = side_of(y, k, 0, model), side_of(y, k, 1, model)
    d = side_of(y, k, 2, model) if side_count(model.joints[k].kind) == 3 else a
    return gap_rate_slopes(model.joints, model.constraints, k, side, a, b, d)


@row_end
def add_end_row(y, dq, k, row, factor, model, matrix):
    """Add the derivative of the gap at the end of a step by its increments dq as row `row`, times `factor`.

    As `constraints.add_end_rows`.
    """
    joints, bodies, n_q = model.joints, model.bodies, model.info.nq
    kind = joints[k].kind
    if kind == ANGLE:
        at = joints[k].iv[1] - n_q
        add_entry(matrix, row, at, factor / (1.0 + 0.25 * dq[at] * dq[at]))
        return
    if joints[k].reduced > 0:
        reduced.add_shape(k, row, 0.0, factor, model, matrix)
    if kind == SEGMENT and joints[k].on[0] == ON_BODY:
        turn_spool(matrix, y, joints[k].first, row, factor, model)
    J = model.J[0]
    for side in range(side_count(kind)):
        on, index, g = joints[k].on[side], joints[k].index[side], joints[k].g[side]
        local = joints[k].local[side]
        at, n = side_columns(model, on, index, joints[k].iv[side], local, is_place(kind, side), J)
        to, right = 0, 0
        if n > 0:
            to, right, _ = first_entry(matrix, row, at)
        if n == 0 or to < 0:
            continue
        for c in range(n):
            J[0, c] = factor * (g[0] * J[0, c] + g[1] * J[1, c] + g[2] * J[2, c])
        if on == ON_BODY:
            first = n - 3 if bodies[index].motion == rigid.FREE else 0
            x, y_, z = 0.5 * dq[at + first], 0.0, 0.0
            if bodies[index].motion == rigid.FREE:
                y_, z = 0.5 * dq[at + 4], 0.5 * dq[at + 5]
                a, b, c = cross(x, y_, z, J[0, 3], J[0, 4], J[0, 5])
                J[0, 3], J[0, 4], J[0, 5] = J[0, 3] + a, J[0, 4] + b, J[0, 5] + c
            s = 1.0 / (1.0 + x * x + y_ * y_ + z * z)
            for c in range(first, n):
                J[0, c] *= s
        for c in range(n):
            matrix.values[to + c * right] += J[0, c]
