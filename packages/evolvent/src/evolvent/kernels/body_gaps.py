"""Gaps between two bodies: spheres, capsules, planes, and boxes with round edges.

A row is one place at which two bodies may touch. Of side a it has a segment, a point where its half length is 0; of
side b a segment (`CAPSULE`), a plane (`PLANE`), or a box (`BOX`). With d from the middle of b's to that of a's, their
axes e and g, u = d.e, v = d.g and w = e.g, the gap is a function of d.d, u, v and w; of a box one of the components of
d along its axes, which u, v and w then are.

**Boxes** have the half sides s, those of the body less the radius of its edges. With m_i = max(|p_i| - s_i, 0) of a
point p the distance is |m| outside, and that to the nearest face, below 0, inside. Over a step

    D1 - D0 = sum over i of (m_i0 + m_i1)/(D0 + D1) (m_i1 - m_i0)/(p_i1 - p_i0) (p_i1 - p_i0)

outside at both ends, exactly; else it is the gradient g at the mean, with g + (D1 - D0 - g.dp) dp/dp.dp (Gonzalez, J.
Nonlinear Sci. 6 (1996), 449-467). Two boxes touch with corners on faces, which are points near a box, and with edges
that cross, which are segments (`EDGES`): these end before the corners, and their gap grows by `fade` as they become
parallel, where the place of a crossing is not known and corners touch.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, entry, indirect, inlined
from evolvent.kernels.contact_laws import contact_energy
from evolvent.kernels.rotations import dot, turn, turn_back
from evolvent.kernels.surfaces import END, PLANE, START
from evolvent.model import MODEL

_I = types.int64
#: Kinds of b's surface beside those of `surfaces`: a box, and an edge that crosses one of another box.
BOX, EDGES = 3, 4
#: Squared sine of the angle, 10 degrees, from which edges cross with their whole radius.
CROSSING = math.sin(math.radians(10.0)) ** 2
#: Displacement (m) below which a gradient at the mean does the work of a step.
_STILL = 1e-12


@entry(REAL, REAL, REAL, REAL, REAL)
@inlined
def closest_positions(u, v, w, half_a, half_b):
    """Positions s and t on two segments that are closest: |d + s a - t b| is least for s, t in +-half_a, +-half_b.

    Parameters
    ----------
    u, v, w : float, d.a, d.b and a.b, d from the middle of the segment along b to the middle of the one along a

    Of parallel segments it is the middle of the part that lies side by side.
    """
    if half_a == 0.0:
        return 0.0, min(max(v, -half_b), half_b)
    if half_b == 0.0:
        return min(max(-u, -half_a), half_a), 0.0
    across = 1.0 - w * w
    if across > 1e-12:
        s = min(max((v * w - u) / across, -half_a), half_a)
        t = v + s * w
        if abs(t) > half_b:
            t = half_b if t > 0.0 else -half_b
            s = min(max(t * w - u, -half_a), half_a)
        return s, t
    low, high = max(-half_b, v - half_a), min(half_b, v + half_a)
    t = 0.5 * (low + high)
    if low > high:  # one behind the other
        t = half_b if v > 0.0 else -half_b
    return min(max((t - v) * w, -half_a), half_a), t


@inlined
def body_axes(row, bodies):
    """Of the bodies' current positions: arms of both middles, and the axes of both, inertial axes."""
    A, B, p, q, e, g = bodies[row.a].R, bodies[row.b].R, row.place_a, row.place_b, row.axis_a, row.axis_b
    return (
        turn(A, p[0], p[1], p[2]), turn(B, q[0], q[1], q[2]), turn(A, e[0], e[1], e[2]), turn(B, g[0], g[1], g[2])
    )  # fmt: skip


@inlined
def body_offset(row, bodies, p, q):
    """d, from the middle of b to that of a."""
    x, z = bodies[row.a].x, bodies[row.b].x
    return x[0] + p[0] - z[0] - q[0], x[1] + p[1] - z[1] - q[1], x[2] + p[2] - z[2] - q[2]


# ------------------------------------------------------------------------------------------------ boxes


@inlined
def _beyond(x, side):
    """How far a component lies outside of a box, and its sign."""
    return max(abs(x) - side, 0.0), (1.0 if x >= 0.0 else -1.0)


@entry(*(REAL,) * 6)
@inlined
def box_distance(x, y, z, a, b, c):
    """Signed distance (m) of a point from the box with half sides a, b, c, in its axes, and its gradient."""
    (mx, sx), (my, sy), (mz, sz) = _beyond(x, a), _beyond(y, b), _beyond(z, c)
    distance = math.sqrt(mx * mx + my * my + mz * mz)
    if distance > 0.0:
        return distance, sx * mx / distance, sy * my / distance, sz * mz / distance
    x, y, z = abs(x) - a, abs(y) - b, abs(z) - c
    if z >= x and z >= y:
        return z, 0.0, 0.0, sz
    if y >= x:
        return y, 0.0, sy, 0.0
    return x, sx, 0.0, 0.0


@inlined
def _share_of(p0, p1, side, total):
    """(m0 + m1)/total (m1 - m0)/(p1 - p0) of a component."""
    (m0, _), (m1, sign) = _beyond(p0, side), _beyond(p1, side)
    slope = (m1 - m0) / (p1 - p0) if p1 != p0 else (sign if m1 > 0.0 else 0.0)
    return (m0 + m1) / total * slope


@entry(*(REAL,) * 11)
@inlined
def box_secant(x0, y0, z0, x1, y1, z1, a, b, c, D0, D1):
    """Vector whose product with the displacement is D1 - D0, the change of `box_distance`, exactly; box axes."""
    if D0 > 0.0 and D1 > 0.0:
        total = D0 + D1
        return _share_of(x0, x1, a, total), _share_of(y0, y1, b, total), _share_of(z0, z1, c, total)
    _, gx, gy, gz = box_distance(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1), a, b, c)
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    square = dx * dx + dy * dy + dz * dz
    part = (D1 - D0 - gx * dx - gy * dy - gz * dz) / square if square > _STILL * _STILL else 0.0
    return gx + part * dx, gy + part * dy, gz + part * dz


@inlined
def box_step_normal(row, R):
    """Normal of a step of a point near a box with the mean rotation R, inertial axes; not a unit vector."""
    s = row.sides
    x, y, z = box_secant(
        row.u0, row.v0, row.w0, row.u1, row.v1, row.w1, s[0], s[1], s[2], row.distance0, row.distance
    )  # fmt: skip
    return turn(R, x, y, z)


# ------------------------------------------------------------------------------------------------ edges


@entry(REAL, REAL)
@inlined
def fade(w, radius):
    """By how much the gap of two edges with the cosine w is above their distance less `radius`, m."""
    x = max(1.0 - (1.0 - w * w) / CROSSING, 0.0)
    return radius * x * x


@entry(REAL, REAL, REAL)
@inlined
def fade_slope(w0, w1, radius):
    """Change of `fade` beside that of the cosine from w0 to w1; its derivative where both are the same, m."""
    if abs(w1 - w0) > 1e-9:
        return (fade(w1, radius) - fade(w0, radius)) / (w1 - w0)
    w = 0.5 * (w0 + w1)
    return radius * 4.0 * w / CROSSING * max(1.0 - (1.0 - w * w) / CROSSING, 0.0)


# ------------------------------------------------------------------------------------------------ gaps


@indirect(void(_I, MODEL), used_for="body_contacts")
def measure_bodies(what, model):
    """Gaps by the bodies' current positions, as `surfaces.measure_points`."""
    rows = model.body_contacts
    for k in range(rows.size):
        row = rows[k]
        p, q, e, g = body_axes(row, model.bodies)
        d = body_offset(row, model.bodies, p, q)
        u, v, w, s, t = dot(d, e), dot(d, g), dot(e, g), 0.0, 0.0
        distance, (nx, ny, nz), radius = v, g, row.radius
        if row.surface == BOX:
            R, half = model.bodies[row.b].R, row.sides
            u, v, w = turn_back(R, d[0], d[1], d[2])
            distance, nx, ny, nz = box_distance(u, v, w, half[0], half[1], half[2])
            nx, ny, nz = turn(R, nx, ny, nz)
        elif row.surface != PLANE:
            s, t = closest_positions(u, v, w, row.half_a, row.half_b)
            x, y, z = d[0] + s * e[0] - t * g[0], d[1] + s * e[1] - t * g[1], d[2] + s * e[2] - t * g[2]
            distance = math.sqrt(x * x + y * y + z * z)
            scale = 1.0 / distance if distance > 0.0 else 0.0
            nx, ny, nz = scale * x, scale * y, scale * z
            if row.surface == EDGES:
                radius -= fade(w, radius)
        gap = distance - radius
        if what == START:
            row.gap, row.distance0, row.u0, row.v0, row.w0, row.s0, row.t0 = gap, distance, u, v, w, s, t
            continue
        row.gap1, row.distance, row.u1, row.v1, row.w1, row.s1, row.t1 = gap, distance, u, v, w, s, t
        n = row.n1
        n[0], n[1], n[2] = nx, ny, nz
        if what == END:
            row.energy = contact_energy(gap, row.stiffness, row.exponent)


# ------------------------------------------------------------------------------------------------ passing


@inlined
def crosses_box(u, v, sides, radius):
    """Whether the way from u to v leads through the box with half sides `sides` + radius, all in its axes."""
    first, last = 0.0, 1.0
    for i in range(3):
        x, dx, side = u[i], v[i] - u[i], sides[i] + radius
        if abs(dx) < _STILL:
            if abs(x) > side:
                return False
            continue
        a, b = (-side - x) / dx, (side - x) / dx
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first <= last
