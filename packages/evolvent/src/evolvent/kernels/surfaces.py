"""Geometry of contacts: gaps and normals at a state or at both ends of a step, and the normal of the whole step.

**Rigid surfaces** on bodies are given by a point c and a unit vector a: middle and axis of a cylinder or capsule (the
points within `radius` of a segment; a sphere where its half length is 0), or a point and the outward normal of a plane.
With d = x - c of a point x, u = d.a, and s the place on the axis from which its distance p is measured,

    p = |d - s a|,  s = u (cylinder),  s = min(max(u, -half), half) (capsule);    p = u (plane)

and the gap is p less the radius. Over a step (p0 + p1) (p1 - p0) = 2 (dm - sm am) . dd - 2 sm dm . da with means m of
both ends: the force 2 (dm - sm am)/(p0 + p1) on the point, and its reaction there on the body, do the work of the gap's
change exactly and keep both momenta. Where the ends are one state this is the normal.

**Turns** of beams lie on one another, wound round a body's axis a: below a point p the nearest point r of the lower
beam's cubic as seen along a, its direction e there, n = e x a outwards, and the gap (p - r) . n less the thickness. It
has sides: a point that has passed through the layer below is pushed back out. Moving along the lower beam changes it in
second order: n on p and -n at r are its gradients; what p lies off the plane makes a couple, which the body takes, and
momenta are kept. Over a step the force acts midway between the points below at both ends. With the displacement u of p
against that point and the body,

    m = k + u (g1 - g0 - k . u)/u.u,      k = (n0 + n1)/(1 + n0 . n1)

so that m . u is the change of the gap exactly (Gonzalez, J. Nonlinear Sci. 6 (1996), 449-467); k alone does it where r
stays at its point on the beam.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels import ancf
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.contact_laws import TURNS, contact_energy
from evolvent.kernels.rotations import cross, turn
from evolvent.model import MODEL

_I = types.int64
CYLINDER, CAPSULE, PLANE = 0, 1, 2
#: What is measured: the start of a step, its end, or a state by itself, of which only points near a surface count.
START, END, STATE = 0, 1, 2
#: Steps of the search for the nearest point, and the change (of an element) at which it ends.
MOST_STEPS, NEAR = 12, 1e-9
#: Points farther than this from the layer below, in its elements' lengths, do not touch it.
FAR = 2.0
#: Displacement, of an element's length, below which the work of k, whose error is of third order, is exact.
_SMALL = 1e-4
#: Share of the displacement by which the work of the mean normal may differ from the change of the gap, and least
#: 1 + n0 . n1; beyond them a point is one that has moved to another part of the beam.
_LARGEST_MISS, _LEAST_TURN = 0.5, 0.5

# ------------------------------------------------------------------------------------------------ rigid surfaces


@inlined
def may_touch(surface, x, y, z, reach, cx, cy, cz, ax, ay, az, radius, half):
    """Whether any point within `reach` (m) of (x, y, z) may touch a surface; True where one does, to round-off."""
    dx, dy, dz = x - cx, y - cy, z - cz
    along = dx * ax + dy * ay + dz * az
    if surface == PLANE:
        return along <= radius + reach
    if abs(along) > half + (radius if surface == CAPSULE else 0.0) + reach:
        return False
    px, py, pz, limit = dx - along * ax, dy - along * ay, dz - along * az, radius + reach
    return px * px + py * py + pz * pz <= limit * limit


@inlined
def gap_to(surface, x, y, z, cx, cy, cz, ax, ay, az, radius, half):
    """Gap between the point (x, y, z) and a surface, whose `half` may be infinite, inertial axes.

    Returns the gap (m), infinite beyond the ends of a cylinder, which do not push, its gradient (nx, ny, nz), zero on
    the axis, and the distance from the axis or the plane.
    """
    dx, dy, dz = x - cx, y - cy, z - cz
    u = dx * ax + dy * ay + dz * az
    if surface == PLANE:
        return u - radius, ax, ay, az, u
    s = u if surface == CYLINDER else min(max(u, -half), half)
    px, py, pz = dx - s * ax, dy - s * ay, dz - s * az
    distance = math.sqrt(px * px + py * py + pz * pz)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    gap = distance - radius if surface != CYLINDER or abs(u) <= half else math.inf
    return gap, px * scale, py * scale, pz * scale, distance


@inlined
def step_position(surface, u0, u1, half):
    """Place s on the axis by which distance^2 changes over a step, by 2 (dm - s am) . dd - 2 s dm . da.

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


@inlined
def step_normal(row, point, d, a):
    """Normal of a step by the mean d of both ends, and of the axis a: not a unit vector."""
    if row.surface == PLANE:
        return a
    s, _ = step_position(row.surface, point.xi, point.xi1, row.half_length)  # of a body that turns not dm . am
    total = point.distance + point.offset
    return 2.0 * (d[0] - s * a[0]) / total, 2.0 * (d[1] - s * a[1]) / total, 2.0 * (d[2] - s * a[2]) / total


@inlined
def end_slope(row, point, d, a, h):
    """Gradient g of the gap at the end of an interval, share, part and total of its second derivative.

    It is part (I - share a a^T - n g^T)/total. d : of a state from the surface's point, else the point's displacement
    """
    n, total, p, u = point.n, point.distance + point.offset, point.distance, d[0] * a[0] + d[1] * a[1] + d[2] * a[2]
    if row.surface == PLANE:
        return a, 0.0, 0.0, 1.0
    if h == 0.0:
        share = 0.0 if row.surface == CAPSULE and abs(u) >= row.half_length else 1.0
        return (n[0], n[1], n[2]), share, 1.0 / p if p > 0.0 else 0.0, 1.0
    _, share = step_position(row.surface, point.xi, point.xi1, row.half_length)
    along = share * u
    return (
        (
            (0.5 * total * n[0] + 0.5 * (d[0] - along * a[0])) / p,
            (0.5 * total * n[1] + 0.5 * (d[1] - along * a[1])) / p,
            (0.5 * total * n[2] + 0.5 * (d[2] - along * a[2])) / p,
        ),
        share,
        1.0,
        total,
    )


@inlined
def point_position(y, at, S):
    """Position (or velocity) of a contact point of a beam, S . (the four vectors at `at`)."""
    return (
        S[0] * y[at[0]] + S[1] * y[at[1]] + S[2] * y[at[2]] + S[3] * y[at[3]],
        S[0] * y[at[0] + 1] + S[1] * y[at[1] + 1] + S[2] * y[at[2] + 1] + S[3] * y[at[3] + 1],
        S[0] * y[at[0] + 2] + S[1] * y[at[1] + 2] + S[2] * y[at[2] + 2] + S[3] * y[at[3] + 2],
    )


@inlined
def frame(bodies, row):
    """Point and direction of a surface's axis, inertial axes, by its body's current position."""
    R, X, o, n = bodies[row.body].R, bodies[row.body].x, row.centre, row.axis
    x, y, z = turn(R, o[0], o[1], o[2])
    return (X[0] + x, X[1] + y, X[2] + z), turn(R, n[0], n[1], n[2])


@indirect(void(VECTOR, _I, MODEL), used_for="contact_surfaces")
def measure_points(y, what, model):
    """Gaps of beams' contact points by the state y and the bodies' current positions (`START`, `END` or `STATE`).

    Of points beyond a cylinder's ends the gap is infinite; one that comes in from there below the surface keeps that
    depth, `rest`, until it is lifted, for it would bring energy. Of a step's end the contacts' energies, but for
    bristles, and the numbers of points that touch are summed up as well.
    """
    contact_surfaces, contacts, bodies = model.contact_surfaces, model.contact_points, model.bodies
    for k in range(contact_surfaces.size):
        if contact_surfaces[k].under >= 0:
            measure_turns(y, what, model, k)
            continue
        row = contact_surfaces[k]
        (cx, cy, cz), (ax, ay, az) = frame(bodies, row)
        radius, half, surface = row.radius, row.half_length, row.surface
        energy = touching = 0.0
        element, near = -1, True
        for i in range(row.first, row.last):
            point = contacts[i]
            if what == STATE and point.element != element:
                element, near = point.element, False
                for j in (0, 2):
                    at = point.iq[j]
                    near = near or may_touch(
                        surface, y[at], y[at + 1], y[at + 2], point.reach, cx, cy, cz, ax, ay, az, radius, half
                    )
            if not near:
                point.gap1 = math.inf
                continue
            px, py, pz = point_position(y, point.iq, point.S)
            gap, nx, ny, nz, distance = gap_to(surface, px, py, pz, cx, cy, cz, ax, ay, az, radius, half)
            u = (px - cx) * ax + (py - cy) * ay + (pz - cz) * az
            if what == START:
                point.gap, point.offset, point.xi = gap, distance, u
                continue
            point.gap1, point.distance, n, x = gap, distance, point.n1, point.x
            n[0], n[1], n[2] = nx, ny, nz
            x[0], x[1], x[2] = px, py, pz
            touching += 1.0 if gap < 0.0 else 0.0
            if what == END:
                point.xi1 = u
                if math.isfinite(point.gap):
                    energy += contact_energy(gap + point.rest, row.stiffness, row.exponent)
        if what != START:
            contact_surfaces[k].energy, contact_surfaces[k].touching = energy, touching


# ------------------------------------------------------------------------------------------------ turns


@inlined
def combined(y, at, half, S):
    """S . (position and slope of an element's two nodes), of nodes with `half` vectors."""
    b, c, d = at + 3, at + 3 * half, at + 3 * half + 3
    return (
        S[0] * y[at] + S[1] * y[b] + S[2] * y[c] + S[3] * y[d],
        S[0] * y[at + 1] + S[1] * y[b + 1] + S[2] * y[c + 1] + S[3] * y[d + 1],
        S[0] * y[at + 2] + S[1] * y[b + 2] + S[2] * y[c + 2] + S[3] * y[d + 2],
    )


@indirect(types.Tuple([_I, REAL])(VECTOR, MODEL, _I, _I, REAL, REAL, REAL, REAL, REAL, REAL, REAL), used_for=TURNS)
def nearest(y, model, beam, element, xi, px, py, pz, ax, ay, az):
    """Point of a beam's axis nearest to a point as seen along the unit vector a, searched from (element, xi) on.

    Returns
    -------
    element : int, -1 where there is none: beyond the beam's ends, or farther away than `FAR`
    xi : float, position in the element, 0 to 1
    """
    elements, half = model.elements, NODE_VECTORS[model.beams[beam].kind]
    first = model.beams[beam].first_element
    last = first + model.beams[beam].elements - 1
    for step in range(MOST_STEPS):
        length, at = elements[element].length, elements[element].iq
        x, w, z = combined(y, at, half, ancf.cubic(length, xi))
        tx, ty, tz = combined(y, at, half, ancf.cubic_slopes(length, xi))
        bx, by, bz = combined(y, at, half, ancf.cubic_bends(length, xi))
        dx, dy, dz = px - x, py - w, pz - z
        off, rise = dx * ax + dy * ay + dz * az, tx * ax + ty * ay + tz * az
        dx, dy, dz = dx - off * ax, dy - off * ay, dz - off * az
        if step == 0 and dx * dx + dy * dy + dz * dz > (FAR * length) ** 2:
            return -1, xi
        square = tx * tx + ty * ty + tz * tz - rise * rise
        slope = max(square - dx * bx - dy * by - dz * bz, 0.3 * square)
        if not slope > 0.0:
            return -1, xi
        change = min(max((dx * tx + dy * ty + dz * tz) / (slope * length), -1.0), 1.0)
        xi += change
        if xi < 0.0:
            if element == first:
                if xi > -NEAR:
                    return element, 0.0
                if change < 0.0 and step > 1:
                    return -1, xi
                xi = 0.0
            else:
                element -= 1
                xi = max(xi + 1.0, 0.0)
        elif xi > 1.0:
            if element == last:
                if xi < 1.0 + NEAR:
                    return element, 1.0
                if change > 0.0 and step > 1:
                    return -1, xi
                xi = 1.0
            else:
                element += 1
                xi = min(xi - 1.0, 1.0)
        if abs(change) < NEAR:
            return element, xi
    return element, xi


@kernel
def _angles(y, model, beam, sense, cx, cy, cz, ax, ay, az):
    """Angles about an axis of all nodes of a beam from its root on, in the sense of winding, into `model.angles`."""
    row, angles = model.beams[beam], model.angles
    size = 3 * NODE_VECTORS[row.kind]
    at, angle = row.first_node, 0.0
    angles[at] = 0.0
    for i in range(1, row.nodes):
        q = row.iq + size * i
        angle += sense * _between(
            y[q - size] - cx, y[q - size + 1] - cy, y[q - size + 2] - cz, y[q] - cx, y[q + 1] - cy, y[q + 2] - cz,
            ax, ay, az,
        )  # fmt: skip
        angles[at + i] = angle


@inlined
def _between(ux, uy, uz, vx, vy, vz, ax, ay, az):
    """Angle from u to v about the axis a, -pi to pi."""
    x, y, z = cross(ux, uy, uz, vx, vy, vz)
    along = (ux * ax + uy * ay + uz * az) * (vx * ax + vy * ay + vz * az)
    return math.atan2(x * ax + y * ay + z * az, ux * vx + uy * vy + uz * vz - along)


@inlined
def _gap_below(y, elements, upper, c, half, xi, p, a, sense, side):
    """Gap of the point p of element `upper` above the point (c, xi), infinite beyond the beam's sides; normal."""
    at, length = elements[c].iq, elements[c].length
    x, yy, z = combined(y, at, half, ancf.cubic(length, xi))
    tx, ty, tz = combined(y, at, half, ancf.cubic_slopes(length, xi))
    nx, ny, nz = cross(tx, ty, tz, a[0], a[1], a[2])
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not size > 0.0:
        return math.inf, 0.0, 0.0, 0.0
    size *= sense
    nx, ny, nz = nx / size, ny / size, nz / size
    wx, wy, wz = p[0] - x, p[1] - yy, p[2] - z
    if abs(wx * a[0] + wy * a[1] + wz * a[2]) > side:
        return math.inf, nx, ny, nz
    return wx * nx + wy * ny + wz * nz - 0.5 * (elements[upper].thickness + elements[c].thickness), nx, ny, nz


@inlined
def _is_far(y, elements, c, half, xi, p, a):
    """Whether p lies farther from the point (c, xi), as seen along the axis, than any contact."""
    length = elements[c].length
    x, yy, z = combined(y, elements[c].iq, half, ancf.cubic(length, xi))
    wx, wy, wz = p[0] - x, p[1] - yy, p[2] - z
    off = wx * a[0] + wy * a[1] + wz * a[2]
    return wx * wx + wy * wy + wz * wz - off * off > (FAR * length) ** 2


@indirect(void(VECTOR, _I, MODEL, _I), used_for=TURNS)
def measure_turns(y, what, model, k):
    """Points below the contact points of cylinder k's layer, gaps and normals, as `measure_points`.

    Notes
    -----
    The search begins at the contact point's angle about the axis, counted along the beams from their roots on, less the
    angle `shift` by which the upper beam's turns are ahead: a turn of one beam, the angle between roots of neighbours.
    """
    contacts, elements, angles, row = model.contact_points, model.elements, model.angles, model.contact_surfaces[k]
    low = model.beams[row.under]
    under, sense, energy, touching = row.under, row.sense, 0.0, 0.0
    (cx, cy, cz), (ax, ay, az) = frame(model.bodies, row)
    over = elements[contacts[row.first].element].beam
    _angles(y, model, over, sense, cx, cy, cz, ax, ay, az)
    if under != over:
        _angles(y, model, under, sense, cx, cy, cz, ax, ay, az)
    own, half, j = model.beams[over].first_node - model.beams[over].first_element, NODE_VECTORS[low.kind], 0
    for i in range(row.first, row.last):
        q, c, xi, gap, nx, ny, nz = contacts[i].iq[0], -1, 0.0, math.inf, 0.0, 0.0, 0.0
        p = point_position(y, contacts[i].iq, contacts[i].S)
        angle = angles[own + contacts[i].element] - row.shift + sense * _between(
            y[q] - cx, y[q + 1] - cy, y[q + 2] - cz, p[0] - cx, p[1] - cy, p[2] - cz, ax, ay, az
        )  # fmt: skip
        if 0.0 <= angle <= angles[low.first_node + low.elements]:
            while j > 0 and angles[low.first_node + j] > angle:
                j -= 1
            while j < low.elements - 1 and angles[low.first_node + j + 1] < angle:
                j += 1
            a, b = angles[low.first_node + j], angles[low.first_node + j + 1]
            c, xi = low.first_element + j, min(max((angle - a) / (b - a), 0.0), 1.0) if b > a else 0.5
            if not _is_far(y, elements, c, half, xi, p, (ax, ay, az)):
                c, xi = nearest(y, model, under, c, xi, p[0], p[1], p[2], ax, ay, az)
            if c >= 0:
                gap, nx, ny, nz = _gap_below(
                    y, elements, contacts[i].element, c, half, xi, p, (ax, ay, az), sense, row.half_length
                )
        if what == START:
            contacts[i].carrier, contacts[i].xi, contacts[i].gap = c, xi, gap
            n = contacts[i].n0
        else:
            contacts[i].carrier1, contacts[i].xi1, contacts[i].gap1 = c, xi, gap
            n = contacts[i].n1
            energy += contact_energy(gap + contacts[i].rest, row.stiffness, row.exponent)
            touching += 1.0 if gap < 0.0 else 0.0
        n[0], n[1], n[2] = nx, ny, nz
    if what != START:
        row.energy, row.touching = energy, touching


@inlined
def below(point, h):
    """Element and point below a contact point: of a state, or midway between those of both ends of a step."""
    if h == 0.0:
        return point.carrier1, point.xi1
    if point.carrier == point.carrier1:
        return point.carrier, 0.5 * (point.xi + point.xi1)
    s = 0.5 * (point.carrier + point.carrier1 + point.xi + point.xi1)
    c = min(int(s), max(point.carrier, point.carrier1))
    return c, s - c


@inlined
def turn_normal(point, u, length, h):
    """m of the module's notes for the displacement u, unit vector along k, and whether it is the same contact."""
    a, b, none = point.n0, point.n1, (0.0, 0.0, 0.0)
    if h == 0.0:
        return (b[0], b[1], b[2]), (b[0], b[1], b[2]), True
    both = 1.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if not both > _LEAST_TURN:
        return none, none, False
    kx, ky, kz = (a[0] + b[0]) / both, (a[1] + b[1]) / both, (a[2] + b[2]) / both
    miss = point.gap1 - point.gap - (kx * u[0] + ky * u[1] + kz * u[2])
    small = _SMALL * length
    square = max(u[0] * u[0] + u[1] * u[1] + u[2] * u[2], small * small)
    if abs(miss) > _LARGEST_MISS * math.sqrt(square):
        return none, none, False
    part, size = miss / square, math.sqrt(2.0 / both)
    return (kx + part * u[0], ky + part * u[1], kz + part * u[2]), (kx / size, ky / size, kz / size), True


@inlined
def turning(y, elements, c, half, xi, n):
    """How the normal turns at a point on the lower beam: e / |t|, slope's factors, and curvature times |t|.

    Notes
    -----
    dn = e/|t| (curvature |t| e . u - n . dt) of a displacement u of the point against the beam, t the slope.
    """
    at, T = elements[c].iq, ancf.cubic_slopes(elements[c].length, xi)
    tx, ty, tz = combined(y, at, half, T)
    bx, by, bz = combined(y, at, half, ancf.cubic_bends(elements[c].length, xi))
    square = tx * tx + ty * ty + tz * tz
    return (tx / square, ty / square, tz / square), T, -(n[0] * bx + n[1] * by + n[2] * bz)
