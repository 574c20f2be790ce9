"""How far points of beams and round bodies move in a step against what they may touch: none may pass through unseen.

Between the two ends of a step a contact is not looked for. What is above a surface at both ends may have been below it
in between, and lie on the other side now. A point moves from u to v in the axes of a segment of radius r, an axis of a
cylinder or capsule, or the centre of a sphere. It may have passed if its way leads through the segment's surface and is
longer than its gap at u and half the radius (of boxes, half the smallest half side). Edges have passed where they have
changed sides. Planes, whose inside is a half space, hold at any depth; so do explicit
methods with fixed steps, for within a stable one nothing comes as deep as it sinks in altogether.
"""

import math

from evolvent.compiled.jit import CUBE, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels import body_gaps, surfaces
from evolvent.kernels.calls import passing_at
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.model import MODEL


def USED_FOR(model):  # noqa: N802
    """Contacts."""
    own = model.contact_surfaces.size > 0 or model.body_contacts.size > 0
    return own or model.contacts_passing_calls.size > 0


@inlined
def note_places(bodies, R, x):
    """Rotations R (nb, 3, 3) and positions x (nb, 3) of the bodies as they stand."""
    for b in range(bodies.size):
        for i in range(3):
            x[b, i] = bodies[b].x[i]
            for j in range(3):
                R[b, i, j] = bodies[b].R[i, j]


@inlined
def _seen(R, x, b, p):
    """A point p in the axes of body b, as it stands by R and x."""
    return turn_back(R[b], p[0] - x[b, 0], p[1] - x[b, 1], p[2] - x[b, 2])


@inlined
def _beside(u, v, centre, axis, half, radius, extent):
    """The way from u to v beside the gap at u and half the radius; 0 where it stays outside of the surface.

    Parameters
    ----------
    half, radius : float, m, of the segment; extent : float, m, how far what moves reaches from its middle
    """
    ux, uy, uz = u[0] - centre[0], u[1] - centre[1], u[2] - centre[2]
    ex, ey, ez = v[0] - u[0], v[1] - u[1], v[2] - u[2]
    moved = math.sqrt(ex * ex + ey * ey + ez * ez)
    if moved == 0.0:
        return 0.0
    t = min(max(ux * axis[0] + uy * axis[1] + uz * axis[2], -half), half)
    px, py, pz = ux - t * axis[0], uy - t * axis[1], uz - t * axis[2]
    away = math.sqrt(px * px + py * py + pz * pz) - radius - extent
    if away >= moved:
        return 0.0
    ex, ey, ez = ex / moved, ey / moved, ez / moved
    mx, my, mz = ux + 0.5 * moved * ex, uy + 0.5 * moved * ey, uz + 0.5 * moved * ez
    s, t = body_gaps.closest_positions(
        mx * ex + my * ey + mz * ez,
        mx * axis[0] + my * axis[1] + mz * axis[2],
        ex * axis[0] + ey * axis[1] + ez * axis[2],
        0.5 * moved,
        half,
    )
    px, py, pz = mx + s * ex - t * axis[0], my + s * ey - t * axis[1], mz + s * ez - t * axis[2]
    if px * px + py * py + pz * pz >= (radius + extent) ** 2:
        return 0.0
    return moved / (max(away, 0.0) + 0.5 * radius)


@inlined
def _beside_box(u, v, row):
    """`_beside` of a point that moves from u to v in the axes of a box's body."""
    c, sides = row.place_b, row.sides
    x, y, z = u[0] - c[0], u[1] - c[1], u[2] - c[2]
    end = (v[0] - c[0], v[1] - c[1], v[2] - c[2])
    if not body_gaps.crosses_box((x, y, z), end, sides, row.radius):
        return 0.0
    away, _, _, _ = body_gaps.box_distance(x, y, z, sides[0], sides[1], sides[2])
    thin = min(sides[0], sides[1], sides[2]) + row.radius
    x, y, z = end[0] - x, end[1] - y, end[2] - z
    return math.sqrt(x * x + y * y + z * z) / (max(away - row.radius, 0.0) + 0.5 * thin)


@inlined
def _beside_edge(row, R0, x0, R1, x1):
    """2 where two edges that cross lie on other sides of one another at both ends, else 0."""
    a, b, p, e, g, h = row.a, row.b, row.place_a, row.axis_a, row.axis_b, row.place_b
    side0, near0 = _side_of_edge(R0[a], x0[a], R0[b], x0[b], p, e, h, g, row.half_a, row.half_b)
    side1, near1 = _side_of_edge(R1[a], x1[a], R1[b], x1[b], p, e, h, g, row.half_a, row.half_b)
    return 2.0 if side0 * side1 < 0.0 and near0 and near1 else 0.0


@inlined
def _side_of_edge(Ra, xa, Rb, xb, p, e, q, g, half_a, half_b):
    """On which side of b's edge a's is, d . (e x g), and whether they cross, with the nearest points within both."""
    px, py, pz = turn(Ra, p[0], p[1], p[2])
    qx, qy, qz = turn(Rb, q[0], q[1], q[2])
    d = (xa[0] + px - xb[0] - qx, xa[1] + py - xb[1] - qy, xa[2] + pz - xb[2] - qz)
    e, g = turn(Ra, e[0], e[1], e[2]), turn(Rb, g[0], g[1], g[2])
    w = dot(e, g)
    s, t = body_gaps.closest_positions(dot(d, e), dot(d, g), w, half_a, half_b)
    cross_there = abs(s) < half_a and abs(t) < half_b and 1.0 - w * w > body_gaps.CROSSING
    return dot(d, cross(e[0], e[1], e[2], g[0], g[1], g[2])), cross_there


@indirect(REAL(VECTOR, CUBE, MATRIX, VECTOR, CUBE, MATRIX, MODEL))
def passing(y0, R0, x0, y1, R1, x1, model):
    """Largest way of a contact over a step beside its gap and half its radius; above 1 something may have passed.

    Parameters
    ----------
    y0, y1 : (ny,) float, states at both ends; R0, R1 : (nb, 3, 3) and x0, x1 : (nb, 3) float, rotations and positions
    """
    largest = 0.0
    rows = model.body_contacts
    for k in range(rows.size):
        if rows[k].surface == surfaces.PLANE:
            continue
        if rows[k].surface == body_gaps.EDGES:
            largest = max(largest, _beside_edge(rows[k], R0, x0, R1, x1))
            continue
        a, b, c = rows[k].a, rows[k].b, rows[k].place_a
        px, py, pz = turn(R0[a], c[0], c[1], c[2])
        u = _seen(R0, x0, b, (x0[a, 0] + px, x0[a, 1] + py, x0[a, 2] + pz))
        px, py, pz = turn(R1[a], c[0], c[1], c[2])
        v = _seen(R1, x1, b, (x1[a, 0] + px, x1[a, 1] + py, x1[a, 2] + pz))
        if rows[k].surface == body_gaps.BOX:
            largest = max(largest, _beside_box(u, v, rows[k]))
            continue
        far = _beside(u, v, rows[k].place_b, rows[k].axis_b, rows[k].half_b, rows[k].radius, rows[k].half_a)
        largest = max(largest, far)
    contact_surfaces, contacts = model.contact_surfaces, model.contact_points
    for k in range(contact_surfaces.size):
        if contact_surfaces[k].under >= 0 or contact_surfaces[k].surface == surfaces.PLANE:
            continue
        b, o, axis = contact_surfaces[k].body, contact_surfaces[k].centre, contact_surfaces[k].axis
        half, radius = contact_surfaces[k].half_length, contact_surfaces[k].radius
        for i in range(contact_surfaces[k].first, contact_surfaces[k].last):
            iq, S = contacts[i].iq, contacts[i].S
            u = _seen(R0, x0, b, surfaces.point_position(y0, iq, S))
            v = _seen(R1, x1, b, surfaces.point_position(y1, iq, S))
            largest = max(largest, _beside(u, v, o, axis, half, radius, 0.0))
    calls = model.contacts_passing_calls
    for k in range(calls.size):
        largest = max(largest, passing_at(model, calls[k])(R0, x0, R1, x1, model))
    return largest
