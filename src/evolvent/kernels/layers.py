"""Turns of beams that lie on one another, wound round a body's axis: where they touch, forces and tangents.

A turn is seen from the one below it: a contact point p of the upper beam, the nearest point r of the lower beam's cubic
in the plane across the axis a, the lower one's direction e there, n = e x a outwards, and the gap (p - r) . n less the
layers' thickness. The gap has sides: a point that has passed through the layer below is pushed back out. Since p - r is
across e, moving along the lower beam does not change the gap to first order, so that f n on p and -f n at r are its
gradients; what p lies off the plane makes a small couple, which the body takes, and momenta are kept.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels import contact_laws
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.sparse import SPARSE, add_inner, inner
from evolvent.model import MODEL

_I = types.int64
#: Steps of the search for the nearest point, and the change (of an element) at which it ends.
MOST_STEPS, NEAR = 12, 1e-9
#: What `contact_points.carrier` is before the first search; -1 where there is nothing below.
UNKNOWN = -2
#: Points farther than this from the layer below, in its elements' lengths, do not touch it.
FAR = 2.0


@inlined
def _shape(length, xi):
    """Hermite's cubic: factors of position, slope, position and slope of an element's two nodes."""
    return (
        1.0 - xi * xi * (3.0 - 2.0 * xi),
        length * xi * (1.0 - xi) * (1.0 - xi),
        xi * xi * (3.0 - 2.0 * xi),
        length * xi * xi * (xi - 1.0),
    )


@inlined
def _combined(y, at, half, S):
    """S . (position and slope of an element's two nodes), of nodes with `half` vectors."""
    b, c, d = at + 3, at + 3 * half, at + 3 * half + 3
    return (
        S[0] * y[at] + S[1] * y[b] + S[2] * y[c] + S[3] * y[d],
        S[0] * y[at + 1] + S[1] * y[b + 1] + S[2] * y[c + 1] + S[3] * y[d + 1],
        S[0] * y[at + 2] + S[1] * y[b + 2] + S[2] * y[c + 2] + S[3] * y[d + 2],
    )


@indirect(types.Tuple([_I, REAL])(VECTOR, MODEL, _I, _I, REAL, REAL, REAL, REAL, REAL, REAL, REAL))
def nearest(y, model, beam, element, xi, px, py, pz, ax, ay, az):
    """Point of a beam's axis nearest to a point as seen along the unit vector a, searched from (element, xi) on.

    Returns
    -------
    element : int, -1 where there is none: beyond the beam's ends, or farther away than `FAR`
    xi : float, position in the element, 0 to 1
    """
    flexible = model.flexible
    elements, half = flexible.elements, NODE_VECTORS[flexible.beams[beam].kind]
    first = flexible.beams[beam].first_element
    last = first + flexible.beams[beam].elements - 1
    for step in range(MOST_STEPS):
        length, at = elements[element].length, elements[element].iq
        x, w, z = _combined(y, at, half, _shape(length, xi))
        d1, d2 = (6.0 * xi * xi - 6.0 * xi) / length, (12.0 * xi - 6.0) / (length * length)
        tx, ty, tz = _combined(y, at, half, (d1, 1.0 - 4.0 * xi + 3.0 * xi * xi, -d1, 3.0 * xi * xi - 2.0 * xi))
        bx, by, bz = _combined(y, at, half, (d2, (6.0 * xi - 4.0) / length, -d2, (6.0 * xi - 2.0) / length))
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
def _angles(y, flexible, beam, sense, cx, cy, cz, ax, ay, az):
    """Angles about an axis of all nodes of a beam from its root on, in the sense of winding, into `flexible.angles`."""
    row, angles = flexible.beams[beam], flexible.angles
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
def _frame(bodies, cylinders, k):
    """Centre and axis of a cylinder, inertial axes."""
    body = cylinders[k].body
    R, X, o, axis = bodies[body].R, bodies[body].x, cylinders[k].centre, cylinders[k].axis
    cx, cy, cz = turn(R, o[0], o[1], o[2])
    ax, ay, az = turn(R, axis[0], axis[1], axis[2])
    return cx + X[0], cy + X[1], cz + X[2], ax, ay, az


@kernel
def find_partners(y, model, k):
    """Find the point below every contact point of cylinder k's layer, for the step that begins.

    Notes
    -----
    At the contact point's angle about the axis, counted along the beams from their roots on, less the angle `shift` by
    which the upper beam's turns are ahead: a turn for one beam, the angle between the roots for neighbours.
    """
    flexible, bodies = model.flexible, model.bodies
    cylinders, contacts, elements, angles = (
        flexible.cylinders,
        flexible.contact_points,
        flexible.elements,
        flexible.angles,
    )
    under, sense, shift = cylinders[k].under, cylinders[k].sense, cylinders[k].shift
    cx, cy, cz, ax, ay, az = _frame(bodies, cylinders, k)
    low = flexible.beams[under]
    over = elements[contacts[cylinders[k].first].element].beam
    _angles(y, flexible, over, sense, cx, cy, cz, ax, ay, az)
    if under != over:
        _angles(y, flexible, under, sense, cx, cy, cz, ax, ay, az)
    own = flexible.beams[over].first_node - flexible.beams[over].first_element
    j = 0
    for i in range(cylinders[k].first, cylinders[k].last):
        contacts[i].carrier = -1
        q = contacts[i].iq[0]
        px, py, pz = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
        angle = angles[own + contacts[i].element] + sense * _between(
            y[q] - cx, y[q + 1] - cy, y[q + 2] - cz, px - cx, py - cy, pz - cz, ax, ay, az
        )
        angle -= shift
        if angle < 0.0 or angle > angles[low.first_node + low.elements]:
            continue
        while j > 0 and angles[low.first_node + j] > angle:
            j -= 1
        while j < low.elements - 1 and angles[low.first_node + j + 1] < angle:
            j += 1
        a, b = angles[low.first_node + j], angles[low.first_node + j + 1]
        xi = min(max((angle - a) / (b - a), 0.0), 1.0) if b > a else 0.5
        contacts[i].carrier, contacts[i].xi = nearest(
            y, model, under, low.first_element + j, xi, px, py, pz, ax, ay, az
        )


@indirect(void(VECTOR, REAL, MODEL, _I, VECTOR))
def add_layers(y, step, model, k, F):
    """Forces of the layer of cylinder k on the turns below it; fills its records as `contact.add_contacts` does."""
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    cylinders, contacts, elements = flexible.cylinders, flexible.contact_points, flexible.elements
    body, under, sense, mu = cylinders[k].body, cylinders[k].under, cylinders[k].sense, cylinders[k].friction
    G, half = cylinders[k].F, NODE_VECTORS[flexible.beams[under].kind]
    _, _, _, ax, ay, az = _frame(bodies, cylinders, k)
    if step <= 0.0 or contacts[cylinders[k].first].carrier == UNKNOWN:
        end_layer_step(y, model, k)
    for i in range(6):
        G[i] = 0.0
    normal = energy = power = touching = 0.0
    for i in range(cylinders[k].first, cylinders[k].last):
        contact_laws.clear_point(contacts[i])
        s = contacts[i].anchor
        s[0] = s[1] = s[2] = 0.0
        if contacts[i].carrier < 0:
            continue
        px, py, pz = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
        c, xi = nearest(y, model, under, contacts[i].carrier, contacts[i].xi, px, py, pz, ax, ay, az)
        contacts[i].carrier1, contacts[i].xi1 = c, xi
        if c < 0:
            continue
        length = elements[c].length
        S = _shape(length, xi)
        x, yy, z = _combined(y, elements[c].iq, half, S)
        d1 = (6.0 * xi * xi - 6.0 * xi) / length
        D = (d1, 1.0 - 4.0 * xi + 3.0 * xi * xi, -d1, 3.0 * xi * xi - 2.0 * xi)
        tx, ty, tz = _combined(y, elements[c].iq, half, D)
        nx, ny, nz = cross(tx, ty, tz, ax, ay, az)
        size = math.sqrt(nx * nx + ny * ny + nz * nz)
        if not size > 0.0:
            continue
        nx, ny, nz = sense * nx / size, sense * ny / size, sense * nz / size
        wx, wy, wz = px - x, py - yy, pz - z
        if abs(wx * ax + wy * ay + wz * az) > cylinders[k].half_length:
            continue
        gap = wx * nx + wy * ny + wz * nz - 0.5 * (elements[contacts[i].element].thickness + elements[c].thickness)
        contacts[i].gap1 = gap
        if gap >= 0.0:
            continue
        ux, uy, uz = contact_laws.point_position(y, contacts[i].iv, contacts[i].S)
        vx, vy, vz = _combined(y, elements[c].iv, half, S)
        rate = nx * (ux - vx) + ny * (uy - vy) + nz * (uz - vz)
        stiffness, exponent = cylinders[k].stiffness, cylinders[k].exponent
        force, d_gap, d_rate = contact_laws.normal_force(
            cylinders[k].law, gap, rate, gap, stiffness, exponent, cylinders[k].damping
        )
        contacts[i].force, contacts[i].d_gap, contacts[i].d_rate = force, d_gap, d_rate
        n, f, t = contacts[i].n, contacts[i].f, contacts[i].t
        n[0], n[1], n[2] = nx, ny, nz
        fx, fy, fz = force * nx, force * ny, force * nz
        if mu > 0.0:
            sx, sy, sz = 0.0, 0.0, 0.0
            if step > 0.0:  # against what was below at the step's start
                before = contacts[i].carrier
                ox, oy, oz = _combined(y, elements[before].iq, half, _shape(elements[before].length, contacts[i].xi))
                sx, sy, sz = contact_laws.tangential(px - ox, py - oy, pz - oz, nx, ny, nz)
                off = contacts[i].offset
                sx, sy, sz = sx - off * ax, sy - off * ay, sz - off * az
            # bristles and their work lie along the lower beam and the axis, and turn with the coil
            ex, ey, ez = cross(ax, ay, az, nx, ny, nz)
            q = contacts[i].stick
            qx, qy, qz = q[0] * ex + q[1] * ax, q[0] * ey + q[1] * ay, q[0] * ez + q[1] * az
            found = contact_laws.friction(
                qx, qy, qz, sx, sy, sz, force, mu,
                cylinders[k].stick_stiffness, cylinders[k].stick_damping if step > 0.0 else 0.0, step,
            )  # fmt: skip
            fx, fy, fz = fx + found[0], fy + found[1], fz + found[2]
            q, d, s = contacts[i].stick1, contacts[i].drag1, contacts[i].anchor
            q[0], q[1] = found[3] * ex + found[4] * ey + found[5] * ez, found[3] * ax + found[4] * ay + found[5] * az
            d[0], d[1] = found[0] * ex + found[1] * ey + found[2] * ez, found[0] * ax + found[1] * ay + found[2] * az
            s[0], s[1] = sx * ex + sy * ey + sz * ez, sx * ax + sy * ay + sz * az
            t[0], t[1], t[2] = found[8], found[9], found[10]
            contacts[i].along, contacts[i].across, contacts[i].by_normal = found[11], found[12], found[13]
            energy += 0.5 * cylinders[k].stick_stiffness * (found[3] ** 2 + found[4] ** 2 + found[5] ** 2)
        f[0], f[1], f[2] = fx, fy, fz
        energy += contact_laws.contact_energy(gap, stiffness, exponent)
        contacts[i].damper1 = force - contact_laws.elastic_force(gap, stiffness, exponent)[0]
        power -= contacts[i].damper1 * rate
        touching += 1.0
        normal += force
        for j in range(4):
            at, s = contacts[i].iv[j] - n_q, contacts[i].S[j]
            F[at] -= s * fx
            F[at + 1] -= s * fy
            F[at + 2] -= s * fz
            at, s = elements[c].iv + 3 * (j % 2 + half * (j // 2)) - n_q, S[j]
            F[at] += s * fx
            F[at + 1] += s * fy
            F[at + 2] += s * fz
        tx, ty, tz = cross(wx, wy, wz, fx, fy, fz)
        G[3] -= tx
        G[4] -= ty
        G[5] -= tz
    for i in range(3, 6):
        bodies[body].F[i] += G[i]
    cylinders[k].normal, cylinders[k].energy, cylinders[k].power = normal, energy, power
    cylinders[k].touching = touching


@indirect(void(VECTOR, MODEL, _I))
def end_layer_step(y, model, k):
    """Find the partners of the step that begins, and how far their contact points lie off along the axis."""
    flexible, bodies = model.flexible, model.bodies
    contacts, elements, cylinders = flexible.contact_points, flexible.elements, flexible.cylinders
    find_partners(y, model, k)
    half = NODE_VECTORS[flexible.beams[cylinders[k].under].kind]
    _, _, _, ax, ay, az = _frame(bodies, cylinders, k)
    for i in range(cylinders[k].first, cylinders[k].last):
        c = contacts[i].carrier
        if c >= 0:
            px, py, pz = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
            x, yy, z = _combined(y, elements[c].iq, half, _shape(elements[c].length, contacts[i].xi))
            contacts[i].offset = (px - x) * ax + (py - yy) * ay + (pz - z) * az


@inlined
def side_vector(j, point, S, at, half, n_q):
    """Row of the j-th of the 8 vectors on which the displacement of a contact point depends, and its factor.

    Parameters
    ----------
    point : record of the contact point; S : factors of the 4 vectors of the lower element
    at, half : index of that element's velocities, and vectors of its nodes
    """
    if j < 4:
        return point.iv[j] - n_q, point.S[j]
    return at + 3 * (j % 2 + half * (j // 2 - 2)) - n_q, -S[j - 4]


@indirect(void(_I, REAL, MODEL, SPARSE))
def add_layer_tangents(k, c_rate, model, matrix):
    """Tangents of cylinder k's layer, through inner unknowns: any part of a turn may lie on any part of the next.

    Notes
    -----
    With u the displacement of p against r, as columns U of the coordinates, and K = -df/du, the forces add U K U^T to
    the matrix, as eliminating z = U^T x does from A x + U K z and U^T x - z = 0: along n alone without friction. How n
    turns and how far p lies along the lower beam is left out; beside the stiffness it counts as force by its element's
    length.
    """
    flexible, n_q = model.flexible, model.info.nq
    cylinders, contacts, elements = flexible.cylinders, flexible.contact_points, flexible.elements
    half = NODE_VECTORS[flexible.beams[cylinders[k].under].kind]
    K = flexible.K12
    for i in range(cylinders[k].first, cylinders[k].last):
        if contacts[i].force == 0.0 or contacts[i].gap1 == math.inf:
            continue
        n, t, c = contacts[i].n, contacts[i].t, contacts[i].carrier1
        S = _shape(elements[c].length, contacts[i].xi1)
        normal = contacts[i].d_gap + c_rate * contacts[i].d_rate
        rubs = cylinders[k].friction > 0.0
        for a in range(3):
            for b in range(3):
                nn, tt = n[a] * n[b], t[a] * t[b]
                same = 1.0 if a == b else 0.0
                K[a, b] = contacts[i].along * tt + contacts[i].across * (same - nn - tt) if rubs else 0.0
                K[a, b] -= (n[a] - contacts[i].by_normal * t[a]) * normal * n[b]
        size = math.sqrt(abs(normal) + contacts[i].along + contacts[i].across)
        if not size > 0.0:
            continue
        q = inner(matrix, 3 if rubs else 1)
        for j in range(8):
            row, s = side_vector(j, contacts[i], S, elements[c].iv, half, n_q)
            for a in range(3):
                if rubs:
                    for b in range(3):
                        add_inner(matrix, row + a, q + b, s * K[a, b] / size, size * s if a == b else 0.0)
                else:
                    add_inner(matrix, row + a, q, -s * n[a] * normal / size, size * s * n[a])
