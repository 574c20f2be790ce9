"""Contacts that a step touches and leaves again: how deep two bodies overlap between its ends.

A place of body a is seen in the axes of body b, where it lies on the cubic that has its places and rates at both ends
of the step; directions of a lie on straight lines between those at the ends. The gap along this way is evaluated in
eight parts, and where it is least by the golden section. A step is too long where bodies overlap in it by more than
twice what they do at its ends.
"""

import math

from evolvent.compiled.jit import CUBE, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels import body_gaps, rigid, surfaces
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.model import MODEL

USED_FOR = "body_contacts"
#: Parts in which the least gap is looked for, and steps of the golden section from there.
_PARTS, _GOLDEN = 8, 30
_SHORT = 0.5 * (3.0 - math.sqrt(5.0))
#: Overlap, beside the way of a step and beside the distance of the middles, that counts; halvings by which a touch is
#: found.
_LEAST, _ROUND_OFF, _HALVINGS = 1e-9, 1e-14, 50
#: Share of the energy of an impact that its first step may take.
MOST_LOST = 1e-3


@inlined
def _rates(y, R, bodies, b):
    """Velocity and angular velocity of body b in a state, inertial axes; of a driven one those of the last call."""
    v = bodies[b].iv
    if bodies[b].motion == rigid.FREE:
        return (y[v], y[v + 1], y[v + 2]), turn(R[b], y[v + 3], y[v + 4], y[v + 5])
    if bodies[b].motion == rigid.SPIN:
        n, rate = bodies[b].axis, y[v]
        return (0.0, 0.0, 0.0), turn(R[b], rate * n[0], rate * n[1], rate * n[2])
    u, w = bodies[b].v, bodies[b].w
    return (u[0], u[1], u[2]), (w[0], w[1], w[2])


@inlined
def _offset(y, R, x, bodies, row):
    """d, from the middle of b to that of a, its rate, and the axis of a: as b sees them, in its axes."""
    a, b, p, q, e = row.a, row.b, row.place_a, row.place_b, row.axis_a
    (va, wa), (vb, wb) = _rates(y, R, bodies, a), _rates(y, R, bodies, b)
    arm = turn(R[a], p[0], p[1], p[2])
    dx, dy, dz = x[a, 0] + arm[0] - x[b, 0], x[a, 1] + arm[1] - x[b, 1], x[a, 2] + arm[2] - x[b, 2]
    sx, sy, sz = cross(wa[0], wa[1], wa[2], arm[0], arm[1], arm[2])
    tx, ty, tz = cross(wb[0], wb[1], wb[2], dx, dy, dz)
    rate = turn_back(R[b], va[0] + sx - vb[0] - tx, va[1] + sy - vb[1] - ty, va[2] + sz - vb[2] - tz)
    seen = turn_back(R[b], dx, dy, dz)
    axis = turn(R[a], e[0], e[1], e[2])
    return (seen[0] - q[0], seen[1] - q[1], seen[2] - q[2]), rate, turn_back(R[b], axis[0], axis[1], axis[2])


@inlined
def _gap(d, e, row):
    """Gap of a contact by d and the axis of a, in the axes of b."""
    g = row.axis_b
    if row.surface == surfaces.PLANE:
        return dot(d, g) - row.radius
    if row.surface == body_gaps.BOX:
        half = row.sides
        return body_gaps.box_distance(d[0], d[1], d[2], half[0], half[1], half[2])[0] - row.radius
    w, radius = dot(e, g), row.radius
    s, t = body_gaps.closest_positions(dot(d, e), dot(d, g), w, row.half_a, row.half_b)
    x, y, z = d[0] + s * e[0] - t * g[0], d[1] + s * e[1] - t * g[1], d[2] + s * e[2] - t * g[2]
    if row.surface == body_gaps.EDGES:
        radius -= body_gaps.fade(w, radius)
    return math.sqrt(x * x + y * y + z * z) - radius


@inlined
def _between(theta, a, b, p, q):
    """The cubic from a to b with the rates p and q, times the length of the step, at the part `theta`."""
    u, d = 1.0 - theta, b - a
    return u * a + theta * b + theta * u * (u * (p - d) + theta * (d - q))


@inlined
def _gap_at(theta, h, d0, v0, e0, d1, v1, e1, row):
    """Gap at the part `theta` of a step."""
    d = (
        _between(theta, d0[0], d1[0], h * v0[0], h * v1[0]),
        _between(theta, d0[1], d1[1], h * v0[1], h * v1[1]),
        _between(theta, d0[2], d1[2], h * v0[2], h * v1[2]),
    )
    x, y, z = e0[0] + theta * (e1[0] - e0[0]), e0[1] + theta * (e1[1] - e0[1]), e0[2] + theta * (e1[2] - e0[2])
    size = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / size if size > 0.0 else 0.0
    return _gap(d, (scale * x, scale * y, scale * z), row)


@inlined
def _apart(a, b):
    """Distance of two places."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    return math.sqrt(x * x + y * y + z * z)


@indirect(REAL(REAL, VECTOR, CUBE, MATRIX, VECTOR, CUBE, MATRIX, MODEL))
def until_deepest(h, y0, R0, x0, y1, R1, x1, model):
    """Part of a step of length h at which bodies overlap most, where its ends do not show it; 1 where they do.

    Parameters
    ----------
    y0, y1 : (ny,) float, states at both ends; R0, R1 : (nb, 3, 3) and x0, x1 : (nb, 3) float, rotations and positions
    """
    rows, part = model.body_contacts, 1.0
    for k in range(rows.size):
        row = rows[k]
        d0, v0, e0 = _offset(y0, R0, x0, model.bodies, row)
        d1, v1, e1 = _offset(y1, R1, x1, model.bodies, row)
        gap0, gap1 = _gap(d0, e0, row), _gap(d1, e1, row)
        way = _apart(d0, d1) + row.half_a * _apart(e0, e1)
        bend = h * (math.sqrt(dot(v0, v0)) + math.sqrt(dot(v1, v1)))
        if gap0 + gap1 > way + bend:  # too far apart to touch in between
            continue
        distance = math.sqrt(dot(d0, d0)) + math.sqrt(dot(d1, d1)) + row.half_a + row.half_b + abs(row.radius)
        limit = min(-_LEAST * (way + bend) - _ROUND_OFF * distance, 2.0 * min(gap0, gap1))
        least, at = min(gap0, gap1), 0
        for i in range(1, _PARTS):
            gap = _gap_at(i / _PARTS, h, d0, v0, e0, d1, v1, e1, row)
            if gap < least:
                least, at = gap, i
        if at == 0 and min(gap0, gap1) > 0.25 * (way + bend) / _PARTS:
            continue
        low, high = max(at - 1, 0) / _PARTS, min(at + 1, _PARTS) / _PARTS
        if at == 0 and gap1 < gap0:
            low, high = 1.0 - 1.0 / _PARTS, 1.0
        one, two = low + _SHORT * (high - low), high - _SHORT * (high - low)
        first = _gap_at(one, h, d0, v0, e0, d1, v1, e1, row)
        second = _gap_at(two, h, d0, v0, e0, d1, v1, e1, row)
        for _ in range(_GOLDEN):
            if first < second:
                high, two, second = two, one, first
                one = low + _SHORT * (high - low)
                first = _gap_at(one, h, d0, v0, e0, d1, v1, e1, row)
            else:
                low, one, first = one, two, second
                two = high - _SHORT * (high - low)
                second = _gap_at(two, h, d0, v0, e0, d1, v1, e1, row)
        if min(first, second) < limit:
            part = min(part, one if first < second else two)
    return part


@inlined
def _inverse_mass(bodies, b):
    """Inverse of the mass that resists a push at body b, 1/kg; 0 of one that is driven."""
    if bodies[b].motion == rigid.DRIVEN or not bodies[b].mass > 0.0:
        return 0.0
    return 1.0 / bodies[b].mass


@indirect(REAL(REAL, VECTOR, CUBE, MATRIX, VECTOR, CUBE, MATRIX, MODEL))
def until_touch(h, y0, R0, x0, y1, R1, x1, model):
    """Part of a step of length h to end just behind the touch of two bodies that meet in it; 1 where it does so.

    Parameters
    ----------
    as of `until_deepest`

    Notes
    -----
    The law of a point that meets a surface in a step, K d at its end, takes K d h v by the rate v, d = v s, of the
    energy m v^2/2 of the impact: a share 2 h s K/m of a touch that is the time s before the end (`contact_laws`).
    """
    rows, bodies, part = model.body_contacts, model.bodies, 1.0
    for k in range(rows.size):
        row = rows[k]
        if not (row.gap > 0.0 and row.gap1 < 0.0 and math.isfinite(row.gap)):
            continue
        softness = _inverse_mass(bodies, row.a) + _inverse_mass(bodies, row.b)
        square = softness * row.stiffness * row.exponent * (-row.gap1) ** (row.exponent - 1.0)
        if not square > 0.0:
            continue
        d0, v0, e0 = _offset(y0, R0, x0, bodies, row)
        d1, v1, e1 = _offset(y1, R1, x1, bodies, row)
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _gap_at(middle, h, d0, v0, e0, d1, v1, e1, row) < 0.0:
                high = middle
            else:
                low = middle
        if 2.0 * h * (1.0 - high) * h * square > MOST_LOST:
            part = min(part, high + 0.05 * MOST_LOST / (h * h * square * high))
    return part
