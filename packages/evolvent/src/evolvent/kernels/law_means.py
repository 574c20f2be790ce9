"""Means of users' laws over an interval of time, and what the means change with its end.

A force by a law acts over an interval of length h as the mean of the law along the increment: positions move on
straight lines at the interval's rates, bodies turn about a fixed axis, time passes. Its work is then the line integral
of the law; of a law of position alone, the change of its potential. `info.over` is h while a step of energy-momentum is
evaluated, else 0: a state, at which the law itself acts.

The integrals are adaptive: pieces of Lobatto's rule of 4 points with Kronrod's extension to 7 are halved where both
differ, down to a jump of the law. While `info.checks` is set, the pieces are `FINE` of the interval at most: another
rule, by which the loop checks a step and books its work.
"""

import math

from numba import types

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.compiled.lookups import element_law_at, force_law_at, spring_law_at
from evolvent.compiled.views import local_vector
from evolvent.kernels.drive import drive
from evolvent.kernels.law_slopes import (
    add_element_law_gradient,
    add_force_law_gradient,
    spring_law_slope,
    torque_law_turns,
)
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL
from evolvent.model.registry import families


def USED_FOR(model):  # noqa: N802
    """Whether a model has records that act as means."""
    rows = ((mask, family.records(model)) for family in families().values() for mask in family.masks_of_means())
    return any(found.size and mask(found).any() for mask, found in rows)


#: Kinds of laws: of a spring (wheels and spools as well), of a motor, of a motor that follows a motion, of a force or
#: torque, between points.
SPRING, FOLLOWS, FORCE, BETWEEN = range(4)
#: Places on [0, 1] with the weights of Kronrod's extension to 7 points of Lobatto's rule, and of that rule of 4 points
#: (Gander & Gautschi, 2000). The ends are among them: a law that switches on before the end of a step is seen.
_OUTER, _INNER = 0.5 * math.sqrt(2.0 / 3.0), 0.5 * math.sqrt(0.2)
_PLACES = (
    (0.0, 11.0 / 420.0, 1.0 / 12.0),
    (0.5 - _OUTER, 36.0 / 245.0, 0.0),
    (0.5 - _INNER, 125.0 / 588.0, 5.0 / 12.0),
    (0.5, 8.0 / 35.0, 0.0),
    (0.5 + _INNER, 125.0 / 588.0, 5.0 / 12.0),
    (0.5 + _OUTER, 36.0 / 245.0, 0.0),
    (1.0, 11.0 / 420.0, 1.0 / 12.0),
)
#: What both rules may differ by, beside the largest value of the law; most pieces; the shortest; one so short that its
#: slope is taken from its ends, between which the law may jump.
_EXACT, _MOST, _SHORTEST, _SHORT = 1e-10, 400, 2.0**-40, 2.0**-20
#: Longest piece while `info.checks` is set.
FINE = 0.25
_I = types.int64


def room_size(n, m):
    """Numbers of scratch that a law of n coordinates and m values needs. Not compiled."""
    return n + 3 * m


@inlined
def widest(model):
    """Longest piece of an interval."""
    return FINE if model.info.checks != 0 else 1.0


@inlined
def following_torque(t, x, v, motors, k, model):
    """Torque of a motor that follows a drive's motion, and its derivatives by x and v.

    Notes
    -----
    PD: kp (r - x) + kd (r' - v) = kd (command - v), command = r' + kp/kd (r - x), within the limit of the rate.
    """
    p = model.parameters[motors[k].first : motors[k].last]
    r, rate, _ = drive(motors[k].drive, p, motors[k].law, t)
    motors[k].reference = r
    gain, damping = motors[k].position_gain, motors[k].velocity_gain
    torque, slope, damper = gain * (r - x) + damping * (rate - v), -gain, -damping
    if damping > 0.0:
        command, most = rate + gain / damping * (r - x), motors[k].rate_limit
        if abs(command) > most:
            torque, slope = damping * (math.copysign(most, command) - v), 0.0
    if abs(torque) > motors[k].limit:
        return math.copysign(motors[k].limit, torque), 0.0, 0.0
    return torque, slope, damper


@inlined
def _turn_pose(part, h, w, x, kept):
    """Rotation matrix in x[3:12] at the part from -1/2 to 1/2 of an interval whose mean one is kept, turned at w."""
    size = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    scale = 1.0 / size if size > 0.0 else 0.0
    ex, ey, ez = scale * w[0], scale * w[1], scale * w[2]
    half = math.atan(0.5 * h * size)
    c, s, shrunk = math.cos(2.0 * part * half), math.sin(2.0 * part * half), 1.0 / math.cos(half)
    for j in range(3):
        dx, dy, dz = kept[3 + j], kept[6 + j], kept[9 + j]
        along = ex * dx + ey * dy + ez * dz
        px, py, pz = shrunk * (dx - along * ex), shrunk * (dy - along * ey), shrunk * (dz - along * ez)
        qx, qy, qz = cross(ex, ey, ez, px, py, pz)
        x[3 + j] = along * ex + c * px + s * qx
        x[6 + j] = along * ey + c * py + s * qy
        x[9 + j] = along * ez + c * pz + s * qz


@inlined
def _move(kind, at, h, rate, v, x, kept):
    """Move x to the part `at`, from 0 to 1, of the interval."""
    part, n = at - 0.5, x.size
    if kind == FORCE and n > 3:
        n = 3
        _turn_pose(part, h, v, x, kept)
    for i in range(n):
        x[i] = kept[i] + part * h * rate[i]


@inlined
def _call(kind, law, t, x, v, p, offset, limit, model, out):
    """Values of a law into out."""
    if kind == FORCE:
        out[0], out[1], out[2] = force_law_at(law)(x, v, t, p)
        return
    if kind == BETWEEN:
        m = x.size
        for i in range(m):
            out[i] = 0.0
        _, out[m] = element_law_at(law)(t, x, v, p, out[0:m])
        return
    if kind == SPRING:
        value = spring_law_at(law)(x[0], v[0], t, p)
    else:
        value, _, _ = following_torque(t, x[0], v[0], model.motors, law, model)
    value += offset
    if abs(value) > limit:
        value = math.copysign(limit, value)
    out[0] = value


@inlined
def _add_slopes(kind, law, t, x, v, p, offset, limit, size, c_x, c_v, scale, work, model, A, row):
    """Add scale (c_x df/dx + c_v df/dv) at a place to A, or return it of a law of one number."""
    if kind == FORCE:
        add_force_law_gradient(law, p, t, x, v, c_x, c_v, scale, A, row)
        if x.size > 3 and c_x != 0.0:  # by a turn, beside which rows are spare
            torque_law_turns(law, p, t, x, v, A, row + 9)
            for i in range(3):
                for j in range(3):
                    A[row + 6 + i, j] += scale * c_x * A[row + 9 + i, j]
        return 0.0
    if kind == BETWEEN:
        m = x.size
        if c_x != 0.0:
            add_element_law_gradient(law, p, t, work, m, 0, size, scale * c_x, A)
        if c_v != 0.0:
            add_element_law_gradient(law, p, t, work, m, m, size, scale * c_v, A)
        return 0.0
    if kind == FOLLOWS:
        _, slope, damper = following_torque(t, x[0], v[0], model.motors, law, model)
        return scale * (c_x * slope + c_v * damper)
    if limit < math.inf and abs(spring_law_at(law)(x[0], v[0], t, p) + offset) >= limit:
        return 0.0
    return scale * spring_law_slope(law, x[0], c_x, v[0], c_v, t, p, size)


@indirect(
    REAL(
        _I, _I, VECTOR, VECTOR, VECTOR, REAL, REAL, VECTOR, REAL, REAL, REAL, REAL, REAL, REAL, VECTOR, VECTOR, VECTOR,
        MATRIX, _I, MODEL,
    )
)  # fmt: skip
def integrate(
    kind, law, x, rate, v, t, h, p, offset, limit, size, c_x, c_v, scale, room, work, out, A, row, model,
):  # fmt: skip
    """Mean of a law over an interval of length h > 0 into out, and twice what it changes with the interval's end.

    Parameters
    ----------
    law : address; of a motor that follows a motion its number
    x : (n,) float, in the middle of the interval, where it is again afterwards; of a torque with the rotation matrix,
        row after row; rate : what it changes by in time, but for turns; v : second argument of the law; t : s, middle
    offset, limit : what is added to a law of one number, and its largest size
    size : of the numbers of a law of one number or between points, for differences
    c_x, c_v, scale : factors of the derivatives by x at the end and by v, 0 for none, and of both; that of a law of one
        number is returned, others are added to A, from `row` on (of turns from row + 6 on)
    room : (`room_size`,) float, scratch; work : scratch of a law between points, whose x and v are its first numbers
    """
    n, m = x.size, out.size
    kept, fine, coarse, f = room[0:n], room[n : n + m], room[n + m : n + 2 * m], room[n + 2 * m : n + 3 * m]
    for i in range(n):
        kept[i] = x[i]
    for i in range(m):
        out[i] = 0.0
    longest = widest(model)
    start, width, pieces, largest, slope = 0.0, longest, 0, 0.0, 0.0
    while start < 1.0:
        for i in range(m):
            fine[i] = coarse[i] = 0.0
        for place, weight, inner in _PLACES:
            at = start + width * place
            _move(kind, at, h, rate, v, x, kept)
            _call(kind, law, t + (at - 0.5) * h, x, v, p, offset, limit, model, f)
            for i in range(m):
                fine[i] += weight * f[i]
                coarse[i] += inner * f[i]
                largest = max(largest, abs(f[i]))
        off = 0.0
        for i in range(m):
            off = max(off, abs(fine[i] - coarse[i]))
        pieces += 1
        if width * off > _EXACT * largest and width > _SHORTEST and pieces < _MOST:
            width *= 0.5
            continue
        for i in range(m):
            out[i] += width * fine[i]
        if c_x != 0.0 and width < _SHORT:
            slope += _jump(kind, law, start, width, x, rate, v, t, h, p, offset, limit, c_x, scale, f, fine, kept,
                           model, A, row)  # fmt: skip
        elif c_x != 0.0 or c_v != 0.0:
            for place, _, inner in _PLACES:
                if inner == 0.0:
                    continue
                at = start + width * place
                _move(kind, at, h, rate, v, x, kept)
                slope += _add_slopes(
                    kind, law, t + (at - 0.5) * h, x, v, p, offset, limit, size, 2.0 * at * c_x, c_v,
                    scale * width * inner, work, model, A, row,
                )  # fmt: skip
        start += width
        if width < longest and math.floor(0.5 * start / width) * 2.0 * width == start:
            width *= 2.0
    for i in range(n):
        x[i] = kept[i]
    return slope


@inlined
def _jump(kind, law, start, width, x, rate, v, t, h, p, offset, limit, c_x, scale, f, g, kept, model, A, row):
    """What the ends of a short piece of an interval add to the slope: the law's change by place along the increment."""
    middle, m = t + (start + 0.5 * width - 0.5) * h, min(x.size, 3) if kind == FORCE else x.size
    square = 0.0
    for i in range(m):
        square += h * rate[i] * h * rate[i]
    if square == 0.0:
        return 0.0
    _move(kind, start, h, rate, v, x, kept)
    _call(kind, law, middle, x, v, p, offset, limit, model, f)
    _move(kind, start + width, h, rate, v, x, kept)
    _call(kind, law, middle, x, v, p, offset, limit, model, g)
    part = 2.0 * (start + 0.5 * width) * c_x * scale
    if kind in (FORCE, BETWEEN):
        for i in range(m):
            for j in range(m):
                A[row + i, j] += part * (g[i] - f[i]) * h * rate[j] / square
        return 0.0
    return part * (g[0] - f[0]) / (h * rate[0])


# ------------------------------------------------------------------------------------------------ of each kind


@inlined
def scalar_mean(kind, law, x, v, t, h, p, offset, limit, model):
    """Mean of a law of one coordinate x, whose rate is v; `law`, `offset`, `limit` as of `integrate`."""
    room = local_vector()
    room[0], room[1], room[2] = x, v, 0.0
    integrate(
        kind, law, room[0:1], room[1:2], room[1:2], t, h, p, offset, limit, 1.0, 0.0, 0.0, 0.0, room[4:12], room,
        room[2:3], model.K12, 0, model,
    )  # fmt: skip
    return room[2]


@inlined
def scalar_slope(kind, law, x, c_x, v, c_v, t, h, p, offset, limit, size, model):
    """Twice what `scalar_mean` changes with the end of the interval: c_x by x, c_v by v (c_v is not doubled)."""
    room = local_vector()
    room[0], room[1], room[2] = x, v, 0.0
    return integrate(
        kind, law, room[0:1], room[1:2], room[1:2], t, h, p, offset, limit, size, c_x, c_v, 1.0, room[4:12], room,
        room[2:3], model.K12, 0, model,
    )  # fmt: skip


@inlined
def force_of(law, x, v, t, p, model):
    """Three floats of a force law at a place x with velocity v, (3,) each: of a state, or the mean over `info.over`."""
    if model.info.over == 0.0:
        return force_law_at(law)(x, v, t, p)
    return mean_force(law, x, v, v, t, p, model)


@inlined
def mean_force(law, x, rate, v, t, p, model):
    """Three floats: mean of a force law or of that of a torque over the interval `info.over`."""
    room = local_vector()
    integrate(
        FORCE, law, x, rate, v, t, model.info.over, p, 0.0, math.inf, 1.0, 0.0, 0.0, 0.0, room[4:34], room, room[0:3],
        model.K12, 0, model,
    )  # fmt: skip
    return room[0], room[1], room[2]


@inlined
def add_force_gradient(law, p, t, x, v, c_x, c_v, scale, A, row, model):
    """`law_slopes.add_force_law_gradient` of `force_of`: over an interval twice the derivative by its end."""
    if model.info.over == 0.0:
        add_force_law_gradient(law, p, t, x, v, c_x, c_v, scale, A, row)
    else:
        add_mean_gradient(law, p, t, x, v, v, c_x, c_v, scale, A, row, model)


@inlined
def add_mean_gradient(law, p, t, x, rate, v, c_x, c_v, scale, A, row, model):
    """`add_force_gradient` over the interval `info.over`; that of a torque by turns as well."""
    room = local_vector()
    integrate(
        FORCE, law, x, rate, v, t, model.info.over, p, 0.0, math.inf, 1.0, c_x, c_v, scale, room[4:34], room, room[0:3],
        A, row, model,
    )  # fmt: skip


@inlined
def moment_of(law, x, rate, v, t, p, model):
    """`force_of` of a moment: v is an angular velocity, and `rate` the velocity of the place x."""
    if model.info.over == 0.0:
        return force_law_at(law)(x, v, t, p)
    return mean_force(law, x, rate, v, t, p, model)


@inlined
def moment_gradient(law, p, t, x, rate, v, c_x, c_v, A, row, model):
    """`force_gradient` of `moment_of`."""
    for c in range(3):
        A[row + c, 0] = A[row + c, 1] = A[row + c, 2] = 0.0
    if model.info.over == 0.0:
        add_force_law_gradient(law, p, t, x, v, c_x, c_v, 1.0, A, row)
    else:
        add_mean_gradient(law, p, t, x, rate, v, c_x, c_v, 1.0, A, row, model)


@inlined
def force_gradient(law, p, t, x, v, c_x, c_v, A, row, model):
    """A[row : row + 3, :3] = derivatives of `force_of`, as of `add_force_gradient`."""
    for c in range(3):
        A[row + c, 0] = A[row + c, 1] = A[row + c, 2] = 0.0
    add_force_gradient(law, p, t, x, v, c_x, c_v, 1.0, A, row, model)


@inlined
def turned_share(h, w):
    """Angle that a body turns by in an interval beside the size of its increment h w, which is 2 tan(angle/2)."""
    size = h * math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    return 2.0 * math.atan(0.5 * size) / size if size > 1e-6 else 1.0
