"""Which face of a shell a node is closest to, on either side: cells of equal size, and boxes round the faces.

Faces are entered into cells by their middles, a list for each hash of a cell; these are as large as the largest face
and the distance within which faces are looked for, so that those near a node are in the 27 cells about it. The work is
proportional to the number of nodes and faces; nothing is allocated. A face is measured where its box, along its own
axes, is nearer than the best one so far.

A node has two contact points, for what lies before and behind it along a direction `way`, from the face to the node
where that is closest: a layer between two others touches both. The direction is that at the start of a step, so that
a node never changes over to the other side of what it touches.
"""

import math

from numba import types, void

from evolvent.compiled.jit import indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.families.contact import face_patch
from evolvent.kernels import calls
from evolvent.kernels.contact_laws import contact_energy
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.surfaces import END, START
from evolvent.model import MODEL

USED_FOR = "face_contacts"
#: Cosine of the largest angle between a face's normal and the way from its closest point to a node that is over it:
#: over an edge or a corner, of two or four faces, a node is over all of them, and beside a shell over none.
_OVER = 0.9
_I = types.int64


@inlined
def _place_face(faces, k, bodies):
    """Vectors, middle and box of face k, by the bodies' current positions; returns half the diagonal of its box."""
    V, c, A, e, t = faces[k].V, faces[k].middle, faces[k].axes, faces[k].extent, faces[k].t
    for a in range(4):
        b = faces[k].nodes[a]
        x, R = bodies[b].x, bodies[b].R
        V[3 * a, 0], V[3 * a, 1], V[3 * a, 2] = x[0], x[1], x[2]
        for i in range(2):
            V[3 * a + 1 + i, 0], V[3 * a + 1 + i, 1], V[3 * a + 1 + i, 2] = turn(
                R, t[2 * a + i, 0], t[2 * a + i, 1], t[2 * a + i, 2]
            )
    ux = uy = uz = vx = vy = vz = 0.0
    for i in range(3):
        c[i] = 0.25 * (V[0, i] + V[3, i] + V[6, i] + V[9, i])
    ux, uy, uz = (
        V[3, 0] + V[6, 0] - V[0, 0] - V[9, 0],
        V[3, 1] + V[6, 1] - V[0, 1] - V[9, 1],
        (V[3, 2] + V[6, 2] - V[0, 2] - V[9, 2]),
    )
    vx, vy, vz = (
        V[6, 0] + V[9, 0] - V[0, 0] - V[3, 0],
        V[6, 1] + V[9, 1] - V[0, 1] - V[3, 1],
        (V[6, 2] + V[9, 2] - V[0, 2] - V[3, 2]),
    )
    size = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / size, uy / size, uz / size
    wx, wy, wz = cross(ux, uy, uz, vx, vy, vz)
    size = math.sqrt(wx * wx + wy * wy + wz * wz)
    wx, wy, wz = wx / size, wy / size, wz / size
    vx, vy, vz = cross(wx, wy, wz, ux, uy, uz)
    A[0, 0], A[0, 1], A[0, 2] = ux, uy, uz
    A[1, 0], A[1, 1], A[1, 2] = vx, vy, vz
    A[2, 0], A[2, 1], A[2, 2] = wx, wy, wz
    square = 0.0
    for j in range(3):
        low, high, slope = math.inf, -math.inf, 0.0
        for a in range(4):
            u = v = w = 0.0
            for i in range(3):
                u += A[j, i] * (V[3 * a, i] - c[i])
                v += A[j, i] * V[3 * a + 1, i]
                w += A[j, i] * V[3 * a + 2, i]
            low, high = min(low, u), max(high, u)
            slope = max(slope, abs(v), abs(w)) if j == 2 else slope
        # a Hermite curve leaves the chord by at most a quarter of the slopes across it
        e[j] = max(-low, high) + (0.5 * slope if j == 2 else 0.05 * (high - low))
        square += e[j] * e[j]
    return math.sqrt(square)


@inlined
def _cell(x, size):
    return math.floor(x / size)


@inlined
def _bucket(i, j, k, count):
    """List of a cell; count: a power of two."""
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & (count - 1)


@indirect(void(_I, MODEL))
def _enter(k, model):
    """Faces of contact k by the bodies' current positions, and their lists."""
    row, faces, cells = model.face_contacts[k], model.faces, model.face_cells
    reach = 0.0
    for f in range(row.first_face, row.last_face):
        reach = max(reach, _place_face(faces, f, model.bodies))
    row.cell = reach + row.reach
    for c in range(row.first_cell, row.last_cell):
        cells[c].head = -1
    count = row.last_cell - row.first_cell
    for f in range(row.first_face, row.last_face):
        c, size = faces[f].middle, row.cell
        at = row.first_cell + _bucket(_cell(c[0], size), _cell(c[1], size), _cell(c[2], size), count)
        faces[f].next = cells[at].head
        cells[at].head = f


@inlined
def _is_apart(model, point, f):
    """Whether face f is too near to a node along the surface of its own shell to touch it."""
    low, high, apart = point.first_apart, point.last_apart, model.face_apart
    while low < high:
        middle = (low + high) // 2
        if apart[middle].face < f:
            low = middle + 1
        else:
            high = middle
    return low < point.last_apart and apart[low].face == f


@kernel
def _try(model, i, f, what):
    """Take face f for the contact points i and i + 1 of a node if it is the closest one so far on its side."""
    points, faces = model.face_points, model.faces
    plus, minus = points[i], points[i + 1]
    if faces[f].group != plus.target or _is_apart(model, plus, f):
        return
    x, c, A, e, way = model.bodies[plus.body].x, faces[f].middle, faces[f].axes, faces[f].extent, plus.way
    off = away = support = 0.0
    for j in range(3):
        u = v = 0.0
        for n in range(3):
            u += A[j, n] * (x[n] - c[n])
            v += A[j, n] * way[n]
        off += u * v
        support += abs(v) * e[j]
        beyond = abs(u) - e[j]
        if beyond > 0.0:
            away += beyond * beyond
    best = plus.least if off > support else minus.least if off < -support else max(plus.least, minus.least)
    if away >= best * best:
        return
    xi, eta = 0.5, 0.5
    for n in range(3):
        xi += 0.5 * A[0, n] * (x[n] - c[n]) / e[0]
        eta += 0.5 * A[1, n] * (x[n] - c[n]) / e[1]
    xi, eta = face_patch.closest(faces[f].V, x[0], x[1], x[2], min(max(xi, 0.0), 1.0), min(max(eta, 0.0), 1.0))
    px, py, pz = face_patch.point_of(faces[f].V, xi, eta)
    dx, dy, dz = x[0] - px, x[1] - py, x[2] - pz
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    own = i if dx * way[0] + dy * way[1] + dz * way[2] >= 0.0 else i + 1
    point = points[own]
    if distance >= point.least:
        return
    point.least = distance
    if what == START:
        point.face0, point.xi0, point.eta0, point.distance0 = f, xi, eta, distance
        point.gap = distance - point.radius - faces[f].radius
        return
    point.face1, point.xi1, point.eta1, point.distance = f, xi, eta, distance
    point.gap1 = distance - point.radius - faces[f].radius
    point.apart = point.gap1
    n1, scale = point.n1, 1.0 / distance if distance > 0.0 else 0.0
    n1[0], n1[1], n1[2] = scale * dx, scale * dy, scale * dz


@indirect(void(_I, _I, _I, MODEL))
def _look(k, i, what, model):
    """Find what is closest to the node of contact points i and i + 1, on both sides."""
    row, points, faces, cells = model.face_contacts[k], model.face_points, model.faces, model.face_cells
    for own in range(i, i + 2):
        point = points[own]
        point.least, hint = row.reach, point.face1
        point.hint = hint
        if what == START:
            point.face0, point.gap, point.distance0 = -1, math.inf, math.inf
        else:
            point.face1, point.gap1, point.distance = -1, math.inf, math.inf
            point.apart = row.reach
    for own in range(i, i + 2):
        if points[own].hint >= 0:
            _try(model, i, points[own].hint, what)
    x, size, count = model.bodies[points[i].body].x, row.cell, row.last_cell - row.first_cell
    p, q, r = _cell(x[0], size), _cell(x[1], size), _cell(x[2], size)
    for n in range(27):
        at = row.first_cell + _bucket(p + n // 9 - 1, q + (n // 3) % 3 - 1, r + n % 3 - 1, count)
        f = cells[at].head
        while f >= 0:
            if f != points[i].hint and f != points[i + 1].hint:
                _try(model, i, f, what)
            f = faces[f].next


@indirect(void(_I, MODEL))
def measure_faces(what, model):
    """Gaps of all nodes by the bodies' current positions, as `surfaces.measure_points`."""
    points = model.face_points
    for k in range(model.face_contacts.size):
        row = model.face_contacts[k]
        _enter(k, model)
        for i in range(row.first, row.last, 2):
            _look(k, i, what, model)
        if what == END:
            row.energy = 0.0
            for i in range(row.first, row.last):
                row.energy += contact_energy(points[i].gap1, points[i].stiffness, points[i].exponent)


@indirect(void(MODEL))
def note_ways(model):
    """Directions from the closest faces to the nodes, at the end of a step."""
    points = model.face_points
    for k in range(model.face_contacts.size):
        row = model.face_contacts[k]
        for i in range(row.first, row.last, 2):
            plus, minus, way = points[i], points[i + 1], points[i].way
            if plus.face1 < 0 and minus.face1 < 0:
                continue
            n, sign = (plus.n1, 1.0) if plus.distance <= minus.distance else (minus.n1, -1.0)
            for j in range(3):
                way[j] = sign * n[j]


# ------------------------------------------------------------------------------------------------ passing


@inlined
def _between(x0, x1, share, b, i):
    """Component i of node b at the part `share` of a step."""
    return x0[b, i] + share * (x1[b, i] - x0[b, i])


@inlined
def _side(x, nodes, p):
    """Height of node p over the plane along a face's diagonals through its middle, m."""
    a, b, c, d = nodes[0], nodes[1], nodes[2], nodes[3]
    nx, ny, nz = cross(
        x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2], x[d, 0] - x[b, 0], x[d, 1] - x[b, 1], x[d, 2] - x[b, 2]
    )
    off = 0.0
    for i, n in ((0, nx), (1, ny), (2, nz)):
        off += n * (x[p, i] - 0.25 * (x[a, i] + x[b, i] + x[c, i] + x[d, i]))
    return off / math.sqrt(nx * nx + ny * ny + nz * nz)


@inlined
def _way(x0, x1, share, a, b):
    """From node a to node b at the part `share` of a step."""
    return (
        _between(x0, x1, share, b, 0) - _between(x0, x1, share, a, 0),
        _between(x0, x1, share, b, 1) - _between(x0, x1, share, a, 1),
        _between(x0, x1, share, b, 2) - _between(x0, x1, share, a, 2),
    )


@inlined
def _is_over(x0, x1, share, nodes, p):
    """Whether node p is within the edges of a face, as seen along its normal, at the part `share` of a step."""
    inside = 0
    for k in range(4):
        a, b, c = nodes[k], nodes[(k + 1) % 4], nodes[(k + 2) % 4]
        e, g, q = _way(x0, x1, share, a, b), _way(x0, x1, share, b, c), _way(x0, x1, share, a, p)
        m, n = cross(e[0], e[1], e[2], g[0], g[1], g[2]), cross(e[0], e[1], e[2], q[0], q[1], q[2])
        inside += 1 if m[0] * n[0] + m[1] * n[1] + m[2] * n[2] >= 0.0 else 0
    return inside == 4


@inlined
def _moved(x0, x1, b, drift):
    """Half of the way of node b in a step, beside the mean of all, m."""
    x, y, z = x1[b, 0] - x0[b, 0] - drift[0], x1[b, 1] - x0[b, 1] - drift[1], x1[b, 2] - x0[b, 2] - drift[2]
    return 0.5 * math.sqrt(x * x + y * y + z * z)


@inlined
def _place_way(faces, f, x0, x1, drift):
    """Middle of face f in the middle of a step, into its record; returns how far its nodes are from there at most."""
    c, reach = faces[f].middle, 0.0
    for i in range(3):
        c[i] = 0.0
        for a in range(4):
            c[i] += 0.25 * _between(x0, x1, 0.5, faces[f].nodes[a], i)
    for a in range(4):
        b = faces[f].nodes[a]
        x, y, z = (
            _between(x0, x1, 0.5, b, 0) - c[0],
            _between(x0, x1, 0.5, b, 1) - c[1],
            (_between(x0, x1, 0.5, b, 2) - c[2]),
        )
        reach = max(reach, math.sqrt(x * x + y * y + z * z) + _moved(x0, x1, b, drift))
    return reach


@kernel
def _height(faces, f, R, x, p, V):
    """Height of node p over face f along its normal, m, by poses of the bodies; 0 where it is beside it."""
    for a in range(4):
        b = faces[f].nodes[a]
        for i in range(3):
            V[3 * a, i] = x[b, i]
        t = faces[f].t
        for i in range(2):
            V[3 * a + 1 + i, 0], V[3 * a + 1 + i, 1], V[3 * a + 1 + i, 2] = turn(
                R[b], t[2 * a + i, 0], t[2 * a + i, 1], t[2 * a + i, 2]
            )
    xi, eta = face_patch.closest(V, x[p, 0], x[p, 1], x[p, 2], 0.5, 0.5)
    X, u, v = face_patch.tangents_of(V, xi, eta)
    n = cross(u[0], u[1], u[2], v[0], v[1], v[2])
    dx, dy, dz = x[p, 0] - X[0], x[p, 1] - X[1], x[p, 2] - X[2]
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    height = (dx * n[0] + dy * n[1] + dz * n[2]) / size
    return height if abs(height) >= _OVER * math.sqrt(dx * dx + dy * dy + dz * dz) else 0.0


@kernel
def _passes(row, i, R0, x0, R1, x1, drift, model):
    """Whether the node of contact point i is on the other side of a face at the end of a step."""
    points, faces, cells, p = model.face_points, model.faces, model.face_cells, model.face_points[i].body
    V = matrix_view(row.work, 0, face_patch.WEIGHTS, 3)
    size, count, half = row.cell, row.last_cell - row.first_cell, _moved(x0, x1, p, drift)
    x, y, z = _between(x0, x1, 0.5, p, 0), _between(x0, x1, 0.5, p, 1), _between(x0, x1, 0.5, p, 2)
    a, b, c = _cell(x, size), _cell(y, size), _cell(z, size)
    for n in range(27):
        at = row.first_cell + _bucket(a + n // 9 - 1, b + (n // 3) % 3 - 1, c + n % 3 - 1, count)
        f = cells[at].head
        while f >= 0:
            m, far = faces[f].middle, half + faces[f].wide
            near = (x - m[0]) ** 2 + (y - m[1]) ** 2 + (z - m[2]) ** 2 <= far * far
            if near and faces[f].group == points[i].target and not _is_apart(model, points[i], f):
                s0, s1, bulge = _side(x0, faces[f].nodes, p), _side(x1, faces[f].nodes, p), faces[f].extent[2]
                if min(abs(s0), abs(s1)) > bulge:
                    if s0 * s1 < 0.0 and _is_over(x0, x1, s0 / (s0 - s1), faces[f].nodes, p):
                        return True
                elif _height(faces, f, R0, x0, p, V) * _height(faces, f, R1, x1, p, V) < 0.0:
                    return True
            f = faces[f].next
    return False


@calls.passing
def passing(R0, x0, R1, x1, model):
    """2 where a node has come to the other side of a face in a step between two poses of the bodies.

    Else the largest way by which a node has sunk in, beside its gap and half of both half thicknesses.
    """
    faces, cells, sunk = model.faces, model.face_cells, 0.0
    for i in range(model.face_points.size):
        point = model.face_points[i]
        if point.gap1 < 0.0:
            half, gap = 0.5 * (point.distance - point.gap1), point.gap if point.gap < math.inf else 0.0
            sunk = max(sunk, (gap - point.gap1) / (max(gap, 0.0) + half))
    for k in range(model.face_contacts.size):
        row, way = model.face_contacts[k], model.face_contacts[k].way
        for j in range(3):
            way[j] = 0.0
            for i in range(row.first, row.last, 2):
                b = model.face_points[i].body
                way[j] += 2.0 * (x1[b, j] - x0[b, j]) / (row.last - row.first)
        drift, reach, half = (way[0], way[1], way[2]), 0.0, 0.0
        for f in range(row.first_face, row.last_face):
            faces[f].wide = _place_way(faces, f, x0, x1, drift)
            reach = max(reach, faces[f].wide)
        for i in range(row.first, row.last, 2):
            half = max(half, _moved(x0, x1, model.face_points[i].body, drift))
        row.cell, count = reach + half, row.last_cell - row.first_cell
        for c in range(row.first_cell, row.last_cell):
            cells[c].head = -1
        for f in range(row.first_face, row.last_face):
            c = faces[f].middle
            at = row.first_cell + _bucket(_cell(c[0], row.cell), _cell(c[1], row.cell), _cell(c[2], row.cell), count)
            faces[f].next = cells[at].head
            cells[at].head = f
        for i in range(row.first, row.last, 2):
            if _passes(row, i, R0, x0, R1, x1, drift, model):
                return 2.0
    return sunk
