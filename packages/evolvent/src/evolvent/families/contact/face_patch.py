"""Faces of shells as smooth surfaces: the closest point of a face, and how it moves with the nodes.

A face between four nodes is a Hermite patch: of its positions x_a and of two vectors along it at each node, t_a and
s_a, which are fixed to the node and lie across its director. With the cubics h (of positions) and k (of slopes),

    X(xi, eta) = sum over a of h_a(xi) h_a(eta) x_a + k_a(xi) h_a(eta) t_a + h_a(xi) k_a(eta) s_a,  0 <= xi, eta <= 1.

Neighbours share positions and normals along their common edge, so that the normal of the surface is continuous where
a bent shell is a polygon. X is linear in vectors that are fixed to bodies. The distance d of a point p is |p - X| where
it is least, so that its change does not depend on how (xi, eta) move (of first order).

**Over a step**, with the weights N_0 and N_1 of the closest points at both ends and d(N; state) the distance from the
material point N, the squares change by the scalar products of the means and the changes of p - X(N). As N_0 and N_1
are closest, a = d(N_0; 1)^2 - d(N_1; 1)^2 and b = d(N_1; 0)^2 - d(N_0; 0)^2 are not below 0, and

    d_1^2 - d_0^2 = (a (change of d(N_1)^2) + b (change of d(N_0)^2))/(a + b)      exactly.

So a force along the mean p - X(N_1) with the share a/(a + b), and along the mean p - X(N_0) with the other one, does
the work of the distance's change, on whatever faces both points are, and keeps both momenta.
"""

import math

from evolvent.compiled.jit import inlined, kernel
from evolvent.kernels.rotations import cross, turn

#: Weights of a face: of the position and of both vectors of each node.
WEIGHTS = 12
#: Corners of a face: xi and eta.
CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))
#: Iterations of the closest point; change of xi and eta, squared next, that ends them.
_MOST, _CLOSE = 40, 1e-9


@inlined
def _cubics(s):
    """Hermite cubics of both ends: h_0, h_1, k_0, k_1."""
    u = 1.0 - s
    return u * u * (1.0 + 2.0 * s), s * s * (3.0 - 2.0 * s), s * u * u, -s * s * u


@inlined
def _slopes(s):
    """Derivatives of `_cubics`."""
    return -6.0 * s * (1.0 - s), 6.0 * s * (1.0 - s), (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)


@inlined
def _bends(s):
    """Second derivatives of `_cubics`."""
    return 12.0 * s - 6.0, 6.0 - 12.0 * s, 6.0 * s - 4.0, 6.0 * s - 2.0


@inlined
def _products(f, g, W):
    """Weights W : (12,) by cubics f of xi and g of eta."""
    for a in range(4):
        i, j = CORNERS[a]
        W[3 * a], W[3 * a + 1], W[3 * a + 2] = f[i] * g[j], f[2 + i] * g[j], f[i] * g[2 + j]


@inlined
def write_weights(xi, eta, W):
    """Weights W : (12,) of the point (xi, eta) of a face."""
    _products(_cubics(xi), _cubics(eta), W)


@inlined
def write_slopes(xi, eta, A, B):
    """Derivatives A and B : (12,) of the weights by xi and eta."""
    _products(_slopes(xi), _cubics(eta), A)
    _products(_cubics(xi), _slopes(eta), B)


@inlined
def write_bends(xi, eta, A, B, C):
    """Second derivatives A, B and C : (12,) of the weights, by xi twice, by both, by eta twice."""
    _products(_bends(xi), _cubics(eta), A)
    _products(_slopes(xi), _slopes(eta), B)
    _products(_cubics(xi), _bends(eta), C)


@inlined
def bilinear(xi, eta, a):
    """Share of node a in directions at (xi, eta)."""
    i, j = CORNERS[a]
    return (xi if i == 1 else 1.0 - xi) * (eta if j == 1 else 1.0 - eta)


@inlined
def _rows(V, c, g):
    """Component c of the four vectors of a line along xi: positions at both ends, and slopes, by cubics g of eta."""
    return (
        g[0] * V[0, c] + g[1] * V[9, c] + g[2] * V[2, c] + g[3] * V[11, c],
        g[0] * V[3, c] + g[1] * V[6, c] + g[2] * V[5, c] + g[3] * V[8, c],
        g[0] * V[1, c] + g[1] * V[10, c],
        g[0] * V[4, c] + g[1] * V[7, c],
    )


@inlined
def _along(f, r):
    return f[0] * r[0] + f[1] * r[1] + f[2] * r[2] + f[3] * r[3]


@inlined
def point_of(V, xi, eta):
    """Position of a point of a face with the vectors V : (12, 3)."""
    f, g = _cubics(xi), _cubics(eta)
    return _along(f, _rows(V, 0, g)), _along(f, _rows(V, 1, g)), _along(f, _rows(V, 2, g))


@inlined
def tangents_of(V, xi, eta):
    """Position of a point of a face, and its derivatives by xi and eta."""
    f, g, df, dg = _cubics(xi), _cubics(eta), _slopes(xi), _slopes(eta)
    r, s, t = _rows(V, 0, g), _rows(V, 1, g), _rows(V, 2, g)
    u, v, w = _rows(V, 0, dg), _rows(V, 1, dg), _rows(V, 2, dg)
    return (
        (_along(f, r), _along(f, s), _along(f, t)),
        (_along(df, r), _along(df, s), _along(df, t)),
        (_along(f, u), _along(f, v), _along(f, w)),
    )


@kernel
def closest(V, px, py, pz, xi, eta):
    """The point (xi, eta) of a face that is closest to p, from a first guess: Newton's method within the edges.

    Parameters
    ----------
    V : (12, 3) float, m, position and two vectors of each node
    """
    p = (px, py, pz)
    best, best_xi, best_eta = math.inf, xi, eta
    for _ in range(_MOST):
        f, df, ddf = _cubics(xi), _slopes(xi), _bends(xi)
        g, dg, ddg = _cubics(eta), _slopes(eta), _bends(eta)
        square = a = b = c = a0 = b0 = c0 = u = v = 0.0
        for i in range(3):
            r, dr, ddr = _rows(V, i, g), _rows(V, i, dg), _rows(V, i, ddg)
            off, x, y = p[i] - _along(f, r), _along(df, r), _along(f, dr)
            square += off * off
            u, v = u + off * x, v + off * y
            a0, b0, c0 = a0 + x * x, b0 + x * y, c0 + y * y
            a, b, c = a - off * _along(ddf, r), b - off * _along(df, dr), c - off * _along(f, ddr)
        if square > best * (1.0 + 1e-14):  # too far: half of the way
            if max(abs(xi - best_xi), abs(eta - best_eta)) < _CLOSE:
                return best_xi, best_eta
            xi, eta = 0.5 * (xi + best_xi), 0.5 * (eta + best_eta)
            continue
        best, best_xi, best_eta = square, xi, eta
        a, b, c = a + a0, b + b0, c + c0
        if not (a > 0.1 * a0 and a * c - b * b > 0.01 * a0 * c0):
            a, b, c = a0, b0, c0
        held_x = (xi <= 0.0 and u <= 0.0) or (xi >= 1.0 and u >= 0.0)
        held_y = (eta <= 0.0 and v <= 0.0) or (eta >= 1.0 and v >= 0.0)
        dx = dy = 0.0
        if not held_x and not held_y:
            det = a * c - b * b
            dx, dy = (c * u - b * v) / det, (a * v - b * u) / det
        elif not held_x:
            dx = u / a
        elif not held_y:
            dy = v / c
        new_x, new_y = min(max(xi + dx, 0.0), 1.0), min(max(eta + dy, 0.0), 1.0)
        moved = max(abs(new_x - xi), abs(new_y - eta))
        xi, eta = new_x, new_y
        if moved < _CLOSE:
            break
    return xi, eta


# ------------------------------------------------------------------------------------------------ of bodies


@inlined
def arm_of(faces, k, a, W, R):
    """Part of a point of face k that node a's vectors make, from the node; R : (3, 3), axes of the node."""
    t, u, v = faces[k].t, W[3 * a + 1], W[3 * a + 2]
    return turn(
        R,
        u * t[2 * a, 0] + v * t[2 * a + 1, 0],
        u * t[2 * a, 1] + v * t[2 * a + 1, 1],
        u * t[2 * a, 2] + v * t[2 * a + 1, 2],
    )


@inlined
def offset_of(p, faces, k, W, bodies):
    """Vector from the point of face k with the weights W to body p, and its rate by the bodies' rates."""
    x, v = bodies[p].x, bodies[p].v
    dx, dy, dz, ux, uy, uz = x[0], x[1], x[2], v[0], v[1], v[2]
    for a in range(4):
        b = faces[k].nodes[a]
        x, v, w, s = bodies[b].x, bodies[b].v, bodies[b].w, W[3 * a]
        arm = arm_of(faces, k, a, W, bodies[b].R)
        r = cross(w[0], w[1], w[2], arm[0], arm[1], arm[2])
        dx, dy, dz = dx - s * x[0] - arm[0], dy - s * x[1] - arm[1], dz - s * x[2] - arm[2]
        ux, uy, uz = ux - s * v[0] - r[0], uy - s * v[1] - r[1], uz - s * v[2] - r[2]
    return (dx, dy, dz), (ux, uy, uz)


@inlined
def push(faces, k, W, bodies, p, f):
    """Add the force f on body p, and its reaction at the point of face k with the weights W, to the wrenches."""
    F = bodies[p].F
    for i in range(3):
        F[i] += f[i]
    for a in range(4):
        b = faces[k].nodes[a]
        F, s, arm = bodies[b].F, W[3 * a], arm_of(faces, k, a, W, bodies[b].R)
        t = cross(arm[0], arm[1], arm[2], f[0], f[1], f[2])
        for i in range(3):
            F[i] -= s * f[i]
            F[3 + i] -= t[i]
