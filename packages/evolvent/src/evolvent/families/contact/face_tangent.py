"""Tangents of nodes on faces (`face_forces`).

With J(v) the derivatives of v . (p - X) at a fixed point of the face, and r those of the products of p - X with the
vectors along the face, the second derivative of the distance d is (J . J - r K^-1 r - J(n) J(n))/d, K that of d^2/2 by
xi and eta. Rows are by positions and turns of the node and of the nodes of the faces at both ends, along the mean
shape; columns by those of the face at the end, along the shape there.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, add_inner, first_entry, inner
from evolvent.compiled.jit import REAL, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.families.contact import face_patch
from evolvent.kernels.poses import add_double, add_skew, end_axes, pose_after
from evolvent.kernels.rotations import cross, dot, turn_back
from evolvent.model import MODEL

USED_FOR = "face_contacts"
_I = types.int64
#: Bodies of a contact point: the node, four of the face at the end, four of that at the start.
_NODES = 9
_SIZE = 6 * _NODES
# indices in the scratch `face_contacts[0].work`: positions and axes in the middle and at the end; axes of rows (those
# at the start) and of columns; weights of vectors along the face and of bends; rows, columns and matrix
_X, _R, _X1, _R1, _LEFT, _RIGHT, _W, _ROWS = 0, 27, 108, 135, 216, 297, 378, 438
#: Rows: by three directions, by both vectors along the face, by the normal, by the force, by three directions of
#: friction.
_BY_XI, _BY_ETA, _NORMAL, _FORCE, _RUBS, _COUNT = 3, 4, 5, 6, 7, 10
_COLUMNS = _ROWS + _COUNT * _SIZE
_M = _COLUMNS + _COUNT * _SIZE
WORK = _M + _SIZE * _SIZE
UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@inlined
def _body(point, faces, q):
    """Body q of a contact point."""
    if q == 0:
        return point.body
    return faces[point.of1].nodes[q - 1] if q < 5 else faces[point.of0].nodes[q - 5]


@kernel
def _write_poses(point, faces, bodies, h, work):
    """Positions and axes of all bodies of a contact point."""
    for q in range(_NODES):
        b = _body(point, faces, q)
        left, right = matrix_view(work, _LEFT + 9 * q, 3, 3), matrix_view(work, _RIGHT + 9 * q, 3, 3)
        end = matrix_view(work, _R1 + 9 * q, 3, 3)
        pose_after(bodies, b, -0.5 * h, left)
        end_axes(left, bodies[b].w, h, right)
        x1 = pose_after(bodies, b, 0.5 * h, end)
        for i in range(3):
            work[_X + 3 * q + i], work[_X1 + 3 * q + i] = bodies[b].x[i], x1[i]
            for j in range(3):
                work[_R + 9 * q + 3 * i + j] = bodies[b].R[i, j]


@inlined
def _arm(faces, k, a, W, work, axes, q):
    """`face_patch.arm_of` node a of face k, which is body q, by its axes at `axes`."""
    return face_patch.arm_of(faces, k, a, W, matrix_view(work, axes + 9 * q, 3, 3))


@inlined
def _vector(faces, k, W, work, places, axes, first):
    """What weights make of face k, whose nodes are the bodies from `first` on."""
    x = y = z = 0.0
    for a in range(4):
        q = first + a
        r = _arm(faces, k, a, W, work, axes, q)
        x += W[3 * a] * work[places + 3 * q] + r[0]
        y += W[3 * a] * work[places + 3 * q + 1] + r[1]
        z += W[3 * a] * work[places + 3 * q + 2] + r[2]
    return x, y, z


@inlined
def _add_row(J, at, faces, k, W, work, axes, own, first, v, scale):
    """Add scale v . (change of the vector that weights make of face k) to J[at]; own: axes of turns."""
    for a in range(4):
        q = first + a
        r = _arm(faces, k, a, W, work, axes, q)
        x, y, z = cross(r[0], r[1], r[2], scale * v[0], scale * v[1], scale * v[2])
        x, y, z = turn_back(matrix_view(work, own + 9 * q, 3, 3), x, y, z)
        for c in range(3):
            J[at, 6 * q + c] += scale * W[3 * a] * v[c]
        J[at, 6 * q + 3] += x
        J[at, 6 * q + 4] += y
        J[at, 6 * q + 5] += z


@inlined
def _add_turn(J, at, q, work, own, x, y, z):
    """Add the torque of body q to J[at]."""
    x, y, z = turn_back(matrix_view(work, own + 9 * q, 3, 3), x, y, z)
    J[at, 6 * q + 3] += x
    J[at, 6 * q + 4] += y
    J[at, 6 * q + 5] += z


@kernel
def _write_rows(point, faces, work, J, places, axes, own):
    """Rows J : (_COUNT, _SIZE) but that of the force, by the poses at `places` and `axes`; returns the normal.

    Returns
    -------
    n : (3 floats) unit normal; a, b, c : second derivatives of half the squared distance by xi and eta
    """
    k, W, A, B, C = point.of1, point.W1, work[_W : _W + 12], work[_W + 12 : _W + 24], work[_W + 24 : _W + 36]
    E, G = work[_W + 36 : _W + 48], work[_W + 48 : _W + 60]
    for i in range(_COUNT):
        for j in range(_SIZE):
            J[i, j] = 0.0
    x, y, z = _vector(faces, k, W, work, places, axes, 1)
    D = (work[places] - x, work[places + 1] - y, work[places + 2] - z)
    d = math.sqrt(dot(D, D))
    n = (D[0] / d, D[1] / d, D[2] / d)
    for i in range(3):
        J[i, i] += 1.0
        _add_row(J, i, faces, k, W, work, axes, own, 1, UNITS[i], -1.0)
        J[_NORMAL, i] += n[i]
    _add_row(J, _NORMAL, faces, k, W, work, axes, own, 1, n, -1.0)
    face_patch.write_slopes(point.xi, point.eta, A, B)
    face_patch.write_bends(point.xi, point.eta, C, E, G)
    u, v = _vector(faces, k, A, work, places, axes, 1), _vector(faces, k, B, work, places, axes, 1)
    for at, vector, slope in ((_BY_XI, u, A), (_BY_ETA, v, B)):
        for i in range(3):
            J[at, i] += vector[i]
        _add_row(J, at, faces, k, W, work, axes, own, 1, vector, -1.0)
        _add_row(J, at, faces, k, slope, work, axes, own, 1, D, 1.0)
    a = dot(u, u) - dot(D, _vector(faces, k, C, work, places, axes, 1))
    b = dot(u, v) - dot(D, _vector(faces, k, E, work, places, axes, 1))
    c = dot(v, v) - dot(D, _vector(faces, k, G, work, places, axes, 1))
    if point.friction > 0.0:
        for i in range(3):
            for j in range(6 * 5):
                J[_RUBS + i, j] = J[i, j]
            x, y, z = cross(n[0], n[1], n[2], UNITS[i][0], UNITS[i][1], UNITS[i][2])
            s = -point.radius
            _add_turn(J, _RUBS + i, 0, work, own, s * x, s * y, s * z)
            for q in range(1, 5):
                s = (point.radius - d) * face_patch.bilinear(point.xi, point.eta, q - 1)
                _add_turn(J, _RUBS + i, q, work, own, s * x, s * y, s * z)
    return n, a, b, c


@inlined
def _add_product(M, s, L, i, J, j, rows):
    """Add s L[i]^T J[j] to M, in the columns of the node and of the face at the end."""
    for r in range(rows):
        left = s * L[i, r]
        if left != 0.0:
            for c in range(30):
                M[r, c] += left * J[j, c]


@inlined
def _add_bend(M, point, L, J, a, b, c, s):
    """Add s r^T K^-1 r' of the directions along the face that are free: at an edge the one across it is not."""
    xi, eta = point.xi, point.eta
    by_xi, by_eta = 0.0 < xi < 1.0, 0.0 < eta < 1.0
    if by_xi and by_eta:
        det = a * c - b * b
        if not det > 0.0:
            return
        _add_product(M, s * c / det, L, _BY_XI, J, _BY_XI, 30)
        _add_product(M, s * a / det, L, _BY_ETA, J, _BY_ETA, 30)
        _add_product(M, -s * b / det, L, _BY_XI, J, _BY_ETA, 30)
        _add_product(M, -s * b / det, L, _BY_ETA, J, _BY_XI, 30)
    elif by_xi and a > 0.0:
        _add_product(M, s / a, L, _BY_XI, J, _BY_XI, 30)
    elif by_eta and c > 0.0:
        _add_product(M, s / c, L, _BY_ETA, J, _BY_ETA, 30)


@inlined
def _add_turned(M, point, faces, k, W, work, first, f):
    """Add how the torques of the reaction to f on face k follow the turns of its nodes."""
    for a in range(4):
        q = first + a
        r = 6 * q + 3
        arm, end = _arm(faces, k, a, W, work, _R, q), _arm(faces, k, a, W, work, _R1, q)
        T = matrix_view(work, _W, 3, 3)
        for i in range(3):
            for j in range(3):
                T[i, j] = 0.0
        add_double(T, 0, 0, 1.0, f[0], f[1], f[2], end[0], end[1], end[2])
        left, right = matrix_view(work, _LEFT + 9 * q, 3, 3), matrix_view(work, _RIGHT + 9 * q, 3, 3)
        if first == 1:
            for j in range(3):
                x, y, z = 0.0, 0.0, 0.0
                for m in range(3):
                    x, y, z = x + T[0, m] * right[m, j], y + T[1, m] * right[m, j], z + T[2, m] * right[m, j]
                x, y, z = turn_back(left, x, y, z)
                M[r, 6 * q + 3 + j] += x
                M[r + 1, 6 * q + 3 + j] += y
                M[r + 2, 6 * q + 3 + j] += z
        x, y, z = cross(arm[0], arm[1], arm[2], f[0], f[1], f[2])
        x, y, z = turn_back(left, x, y, z)
        if first == 1:
            add_skew(M, r, r, 1.0, x, y, z)


@inlined
def _room(matrix, count):
    """Whether a matrix has room for more inner unknowns."""
    return matrix.counts[0] + count <= matrix.E.shape[0] - matrix.deferred.size


@kernel
def _add_point(i, h, c_rate, model, matrix):
    """Add the tangent of contact point i."""
    point, faces, bodies, work, n_q = (
        model.face_points[i], model.faces, model.bodies, model.face_contacts[0].work, model.info.nq
    )  # fmt: skip
    L, J = matrix_view(work, _ROWS, _COUNT, _SIZE), matrix_view(work, _COLUMNS, _COUNT, _SIZE)
    M, lam, factor = matrix_view(work, _M, _SIZE, _SIZE), point.force, 1.0 if h == 0.0 else 2.0
    point.xi = point.xi1 if point.face1 >= 0 else point.xi0
    point.eta = point.eta1 if point.face1 >= 0 else point.eta0
    _write_poses(point, faces, bodies, h, work)
    n, _, _, _ = _write_rows(point, faces, work, L, _X, _R, _LEFT)
    n1, a, b, c = _write_rows(point, faces, work, J, _X1, _R1, _RIGHT)
    other = h != 0.0 and point.of0 != point.of1
    size = _SIZE if other else 30
    if h == 0.0:
        for r in range(30):
            L[_FORCE, r] = L[_NORMAL, r]
        s, part = 1.0 / point.distance, 1.0
    else:
        D1, D0 = point.D1, point.D0
        for r in range(3):
            L[_FORCE, r] = point.share1 * D1[r] + point.share0 * D0[r]
        _add_row(L, _FORCE, faces, point.of1, point.W1, work, _R, _LEFT, 1, D1, -point.share1)
        _add_row(L, _FORCE, faces, point.of0, point.W0, work, _R, _LEFT, 5 if other else 1, D0, -point.share0)
        s = 2.0 / (point.d0 + point.d1)
        part = 2.0 * point.share1 / (point.share0 + point.share1)
    slope = factor * point.d_gap if h != 0.0 else point.d_gap + c_rate * point.d_rate
    rubs = point.friction > 0.0
    of = bodies[faces[point.of1].nodes[0]].iv
    for q in range(2, 5):
        of = max(of, bodies[_body(point, faces, q)].iv)
    own = bodies[point.body].iv
    if own >= 0 and of >= 0 and first_entry(matrix, own - n_q, of - n_q)[0] < 0:
        if _room(matrix, 1):
            _add_rank(point, faces, bodies, L, J, -slope, size, n_q, matrix)
        return
    for r in range(size):
        for q in range(30):
            M[r, q] = 0.0
    _add_product(M, lam * s, L, _FORCE, J, _NORMAL, size)
    if rubs:
        t = point.t
        for k in range(3):
            for r in range(30):
                L[_FORCE, r] -= point.by_normal * t[k] * L[_RUBS + k, r]
    _add_product(M, -slope, L, _FORCE, J, _NORMAL, size)
    _add_bend(M, point, L, J, a, b, c, part * lam * s)
    apart = h != 0.0 and not other
    for k in range(3):
        _add_product(M, -lam * s * (0.5 * part if apart else 1.0), L, k, J, k, 30)
    if rubs:
        _add_friction(M, point, L, J, factor, n)
    if apart:
        for k in range(3):
            for r in range(30):
                L[k, r] = J[k, r] = UNITS[k][r] if r < 3 else 0.0
            _add_row(L, k, faces, point.of0, point.W0, work, _R, _LEFT, 1, UNITS[k], -1.0)
            _add_row(J, k, faces, point.of0, point.W0, work, _R1, _RIGHT, 1, UNITS[k], -1.0)
            _add_product(M, -lam * s * (1.0 - 0.5 * part), L, k, J, k, 30)
    if h == 0.0:
        _add_turned(M, point, faces, point.of1, point.W1, work, 1, point.whole)
    else:
        f1, f0, f = lam * point.share1, lam * point.share0, point.rubbing
        D1, D0 = point.D1, point.D0
        f1 = (f1 * D1[0] + f[0], f1 * D1[1] + f[1], f1 * D1[2] + f[2])
        _add_turned(M, point, faces, point.of1, point.W1, work, 1, f1)
        if not other:
            _add_turned(M, point, faces, point.of0, point.W0, work, 1, (f0 * D0[0], f0 * D0[1], f0 * D0[2]))
    for p in range(_NODES if other else 5):
        at = bodies[_body(point, faces, p)].iv
        for q in range(5):
            to = bodies[_body(point, faces, q)].iv
            if at >= 0 and to >= 0:
                add_block(matrix, at - n_q, to - n_q, M, 6 * p, 6 * q, 6, 6, 1.0)


@inlined
def _add_friction(M, point, L, J, factor, n):
    """Add the tangent of friction at a given normal force."""
    t = point.t
    for i in range(3):
        for j in range(3):
            tt = t[i] * t[j]
            k = point.along * tt + point.across * ((1.0 if i == j else 0.0) - n[i] * n[j] - tt)
            if k != 0.0:
                _add_product(M, factor * k, L, _RUBS + i, J, _RUBS + j, 30)


@inlined
def _add_rank(point, faces, bodies, L, J, stiffness, size, n_q, matrix):
    """Add the part of the normal force through an inner unknown."""
    if stiffness == 0.0:
        return
    z, root = inner(matrix, 1), math.sqrt(abs(stiffness))
    for p in range(size // 6):
        at = bodies[_body(point, faces, p)].iv
        for r in range(6 if at >= 0 else 0):
            left = root * J[_NORMAL, 6 * p + r] if p < 5 else 0.0
            add_inner(matrix, at - n_q + r, z, stiffness / root * L[_FORCE, 6 * p + r], left)


@indirect(void(REAL, REAL, MODEL, SPARSE))
def add_face_tangents(h, c_rate, model, matrix):
    """Derivatives of `face_forces.add_faces`: of a state by positions and rates, over a step twice those by its end.

    Exact where nothing rubs and no force depends on rates; over a step where both ends have the same closest point.
    """
    for i in range(model.face_points.size):
        if model.face_points[i].force != 0.0:
            _add_point(i, h, c_rate, model, matrix)
