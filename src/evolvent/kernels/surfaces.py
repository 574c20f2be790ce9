"""Surfaces that contact points touch: gap, normal and curvature of a cylinder, a capsule or sphere, and a plane.

A surface is given by a point c and a unit vector a of its body: middle and axis of a cylinder or capsule (the points
within `radius` of a segment; a sphere where its half length is 0), or a point and the outward normal of a plane. With
d = x - c of a point x, u = d.a, and s the point on the axis from which its distance is measured,

    distance = |d - s a|,  s = u (cylinder),  s = min(max(u, -half), half) (capsule);    distance = u (plane)

and the gap is the distance less the radius. `closest_positions` does this for two segments.
"""

import math

from evolvent.compiled.jit import REAL, entry, inlined
from evolvent.kernels import contact_laws

CYLINDER, CAPSULE, PLANE = 0, 1, 2


@inlined
def may_touch(surface, x, y, z, reach, cx, cy, cz, ax, ay, az, radius, half):
    """Whether any point within `reach` (m) of (x, y, z) may touch a surface; see `contact_laws.may_touch`."""
    if surface == PLANE:
        return (x - cx) * ax + (y - cy) * ay + (z - cz) * az <= radius + reach
    ends = radius if surface == CAPSULE else 0.0
    return contact_laws.may_touch(x, y, z, reach, cx, cy, cz, ax, ay, az, radius, half + ends)


@inlined
def gap_to(surface, x, y, z, cx, cy, cz, ax, ay, az, radius, half):
    """Gap between a point and a surface.

    Returns
    -------
    gap : float, m, negative inside; infinite beyond the ends of a cylinder
    nx, ny, nz : float, d gap / dx, a unit vector; zero on the axis
    distance : float, m, from the axis or the plane
    """
    if surface == CYLINDER:
        return contact_laws.cylinder_gap(x, y, z, cx, cy, cz, ax, ay, az, radius, half)
    dx, dy, dz = x - cx, y - cy, z - cz
    u = dx * ax + dy * ay + dz * az
    if surface == PLANE:
        return u - radius, ax, ay, az, u
    s = min(max(u, -half), half)
    px, py, pz = dx - s * ax, dy - s * ay, dz - s * az
    distance = math.sqrt(px * px + py * py + pz * pz)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    return distance - radius, px * scale, py * scale, pz * scale, distance


@inlined
def curvature(surface, u, half, nx, ny, nz, ax, ay, az, distance):
    """H = d2 gap / dx2, 1/m: (xx, yy, zz, xy, xz, yz); u : float, m, position of the point along the axis."""
    if surface == PLANE:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if surface == CAPSULE and abs(u) >= half:
        return contact_laws.cylinder_curvature(nx, ny, nz, 0.0, 0.0, 0.0, distance)
    return contact_laws.cylinder_curvature(nx, ny, nz, ax, ay, az, distance)


@inlined
def step_position(surface, u0, u1, half):
    """Position s on the axis by which distance^2 changes over a step, by 2 (dm - s am) . dd - 2 s dm . da.

    With s0 and s1 of both ends, p^2 = d.d - 2 s u + s^2 changes by d(d.d) - 2 sm du - 2 (um - sm) ds, means m of both
    ends, and ds/du times du stands for ds.

    Returns
    -------
    s : float, m
    share : float, ds/du: 1 where the distance is one from the axis, 0 where it is one from an end of a capsule
    """
    if surface == CYLINDER:
        return 0.5 * (u0 + u1), 1.0
    s0, s1 = min(max(u0, -half), half), min(max(u1, -half), half)
    share = 1.0 if abs(u1) < half else 0.0
    if u1 != u0:
        share = (s1 - s0) / (u1 - u0)
    s = 0.5 * (s0 + s1)
    return s + share * (0.5 * (u0 + u1) - s), share


@entry(REAL, REAL, REAL, REAL, REAL)
@inlined
def closest_positions(u, v, w, half_a, half_b):
    """Positions s and t on two segments that are closest: |d + s a - t b| is least for s, t in +-half_a, +-half_b.

    Parameters
    ----------
    u, v, w : float, d.a, d.b and a.b, d from the middle of the segment along b to the middle of the one along a

    Notes
    -----
    Of parallel segments the middle of the part that lies side by side.
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
