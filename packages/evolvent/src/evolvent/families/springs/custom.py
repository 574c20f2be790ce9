"""User-defined laws between points: forces on point masses, bodies, nodes of beams and the ground.

A point is a marker (`springs`), one after the other. Scratch of a law between k points, m = 3 k:
positions, velocities, forces and other forces, (m,) each, values and slopes for `kernels.law_slopes`, (6 m,),
derivatives of the forces, (m, m), and the scratch and the values of `law_means.integrate`.
"""

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.compiled.lookups import element_law_at
from evolvent.compiled.views import matrix_view
from evolvent.kernels.law_means import BETWEEN, integrate, room_size
from evolvent.kernels.law_slopes import add_element_law_gradient
from evolvent.kernels.markers import ON_BODY, marker_columns, marker_kinematics, marker_turning, push_marker
from evolvent.kernels.rotations import cross
from evolvent.kernels.sides import add_product, add_turning
from evolvent.model import MODEL

USED_FOR = "custom_forces"
#: Resultants this small beside the forces are round-off; so are asymmetries of derivatives by differences.
ROUND_OFF, ASYMMETRY = 1e-10, 1e-6


def scratch_size(points):
    """Numbers of scratch that a law between so many points needs. Not compiled."""
    m = 3 * points
    return 10 * m + m * m + room_size(m, m + 1) + m + 1


@inlined
def _gather(y, model, k):
    """Write positions and velocities of the points of law k into its scratch; returns 3 times their number."""
    forces, work = model.custom_forces, model.custom
    m = 3 * forces[k].points
    for i in range(forces[k].points):
        u = marker_kinematics(y, model.markers, model.points, model.bodies, forces[k].first_marker + i)
        for c in range(3):
            work[3 * i + c] = u[c]
            work[m + 3 * i + c] = u[3 + c]
    return m


@kernel
def _evaluate(t, model, k, m, out):
    """Call law k at the positions and velocities in its scratch; forces go to scratch[out : out + m].

    Returns the energy stored (J) and the power dissipated (W).
    """
    forces, work = model.custom_forces, model.custom
    for i in range(m):
        work[out + i] = 0.0
    parameters = model.parameters[forces[k].first : forces[k].last]
    return element_law_at(forces[k].law)(t, work[0:m], work[m : 2 * m], parameters, work[out : out + m])


@inlined
def _integrate(t, model, k, m, size, c_x, c_v, K):
    """Law k over the interval `info.over` into its scratch; minus `c_x` and `c_v` times its derivatives are added to K.

    Returns the mean power dissipated, W.
    """
    forces, work = model.custom_forces, model.custom
    p, at, n = model.parameters[forces[k].first : forces[k].last], 10 * m + m * m, 4 * m + 3
    out = work[at + n : at + n + m + 1]
    integrate(
        BETWEEN, forces[k].law, work[0:m], work[m : 2 * m], work[m : 2 * m], t, model.info.over, p, 0.0, 0.0, size, c_x,
        c_v, -1.0, work[at : at + n], work, out, K, 0, model,
    )  # fmt: skip
    for i in range(m):
        work[2 * m + i] = out[i]
    return out[m]


@inlined
def _energy_at_end(t, model, k, m):
    """Energy that law k states at the end of the interval `info.over`, J."""
    work, half = model.custom, 0.5 * model.info.over
    for i in range(m):
        work[2 * m + i] = work[i]
        work[i] += half * work[m + i]
    stored, _ = _evaluate(t + half, model, k, m, 3 * m)
    for i in range(m):
        work[i] = work[2 * m + i]
    return stored


@inlined
def _solve(a, b, c, d, e, f, x, y, z):
    """Solution of a symmetric system of three equations, of rows (a, b, c), (b, d, e) and (c, e, f): three floats."""
    p, q, r = d * f - e * e, c * e - b * f, b * e - c * d
    s = 1.0 / (a * p + b * q + c * r)
    u, v, w = a * f - c * c, b * c - a * e, a * d - b * b
    return s * (p * x + q * y + r * z), s * (q * x + u * y + v * z), s * (r * x + v * y + w * z)


@inlined
def _take_moment(work, m):
    """Take the moment from mean forces of a law that has neither resultant nor moment, and leave their work as it is.

    Notes
    -----
    The forces f act at the mean positions, about whose centroid their moment T is small: f - w x d with the moment
    J w = T of the arms d has none. The work T . u that this takes, u the turn in the velocities, is given back along
    what they deform.
    """
    x, v, f, n = work[0:m], work[m : 2 * m], work[2 * m : 3 * m], m // 3
    cx = cy = cz = ux = uy = uz = 0.0
    for i in range(0, m, 3):
        cx, cy, cz = cx + x[i] / n, cy + x[i + 1] / n, cz + x[i + 2] / n
        ux, uy, uz = ux + v[i] / n, uy + v[i + 1] / n, uz + v[i + 2] / n
    xx = xy = xz = yy = yz = zz = tx = ty = tz = lx = ly = lz = 0.0
    for i in range(0, m, 3):
        dx, dy, dz = x[i] - cx, x[i + 1] - cy, x[i + 2] - cz
        xx, yy, zz = xx + dy * dy + dz * dz, yy + dx * dx + dz * dz, zz + dx * dx + dy * dy
        xy, xz, yz = xy - dx * dy, xz - dx * dz, yz - dy * dz
        a, b, c = cross(dx, dy, dz, f[i], f[i + 1], f[i + 2])
        tx, ty, tz = tx + a, ty + b, tz + c
        a, b, c = cross(dx, dy, dz, v[i], v[i + 1], v[i + 2])
        lx, ly, lz = lx + a, ly + b, lz + c
    size = 1e-2 * ROUND_OFF * (xx + yy + zz)  # points on a line have no moment about it
    if size == 0.0:
        return
    xx, yy, zz = xx + size, yy + size, zz + size
    wx, wy, wz = _solve(xx, xy, xz, yy, yz, zz, tx, ty, tz)
    ox, oy, oz = _solve(xx, xy, xz, yy, yz, zz, lx, ly, lz)
    square = whole = 0.0
    for step in range(2):
        scale = (wx * lx + wy * ly + wz * lz) / square if step == 1 and square > ROUND_OFF * ROUND_OFF * whole else 0.0
        for i in range(0, m, 3):
            dx, dy, dz = x[i] - cx, x[i + 1] - cy, x[i + 2] - cz
            a, b, c = cross(ox, oy, oz, dx, dy, dz)
            a, b, c = v[i] - ux - a, v[i + 1] - uy - b, v[i + 2] - uz - c
            if step == 0:
                square += a * a + b * b + c * c
                whole += v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2]
                continue
            p, q, r = cross(wx, wy, wz, dx, dy, dz)
            f[i] += scale * a - p
            f[i + 1] += scale * b - q
            f[i + 2] += scale * c - r


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, MODEL))
def add_custom_forces(t, y, model):
    """Forces of all users' laws onto bodies and points; returns powers, W: dissipated, and of laws without an energy.

    A law that has given neither an energy nor a power so far states none: its forces do work, as loads do.
    """
    forces, work = model.custom_forces, model.custom
    markers, points, bodies = model.markers, model.points, model.bodies
    power = given = 0.0
    for k in range(forces.size):
        m = _gather(y, model, k)
        stored, lost = _evaluate(t, model, k, m, 2 * m)
        forces[k].balanced = _is_balanced(work, m)
        if model.info.over != 0.0:
            if stored == 0.0 and lost == 0.0 and forces[k].stated == 0.0:  # which it may do at the end
                stored = _energy_at_end(t, model, k, m)
            lost = _integrate(t, model, k, m, 1.0, 0.0, 0.0, model.K12)
            if forces[k].balanced != 0.0:
                _take_moment(work, m)
        power += lost
        if stored != 0.0 or lost != 0.0:
            forces[k].stated = 1.0
        for i in range(m if forces[k].stated == 0.0 else 0):
            given += work[2 * m + i] * work[m + i]
        for i in range(forces[k].points):
            x, f = 3 * i, 2 * m + 3 * i
            push_marker(
                markers, points, bodies, forces[k].first_marker + i, work[x], work[x + 1], work[x + 2],
                work[f], work[f + 1], work[f + 2],
            )  # fmt: skip
    return power, given


@indirect(REAL(REAL, VECTOR, MODEL))
def custom_energies(t, y, model):
    """Energy stored by all user-defined laws between points, J; after `kinematics`."""
    energy = 0.0
    for k in range(model.custom_forces.size):
        m = _gather(y, model, k)
        stored, _ = _evaluate(t, model, k, m, 3 * m)
        energy += stored
    return energy


@inlined
def _is_balanced(work, m):
    """1 where the forces of a law, in its scratch, have neither a resultant nor a moment; else 0."""
    fx = fy = fz = tx = ty = tz = size = moment = 0.0
    for i in range(0, m, 3):
        x, y, z = work[i] - work[0], work[i + 1] - work[1], work[i + 2] - work[2]
        f = (work[2 * m + i], work[2 * m + i + 1], work[2 * m + i + 2])
        fx, fy, fz = fx + f[0], fy + f[1], fz + f[2]
        a, b, c = cross(x, y, z, f[0], f[1], f[2])
        tx, ty, tz = tx + a, ty + b, tz + c
        strength = abs(f[0]) + abs(f[1]) + abs(f[2])
        size += strength
        moment += strength * (abs(x) + abs(y) + abs(z))
    small = abs(fx) + abs(fy) + abs(fz) <= ROUND_OFF * size
    return 1.0 if small and abs(tx) + abs(ty) + abs(tz) <= ROUND_OFF * moment else 0.0


@inlined
def _spread(work, first, count):
    """Largest difference between the first of several vectors in the scratch and the others."""
    found = 0.0
    for i in range(3, count):
        found = max(found, abs(work[first + i] - work[first + i % 3]))
    return found


@indirect(void(REAL, VECTOR, REAL, MODEL, SPARSE))
def add_custom_tangents(t, y, c_rate, model, matrix):
    """Tangents of all user-defined laws between points.

    Notes
    -----
    Derivatives by position that are symmetric but for the differences' errors are made so.
    """
    forces, work = model.custom_forces, model.custom
    for k in range(forces.size):
        m = _gather(y, model, k)
        K, p = matrix_view(work, 10 * m, m, m), model.parameters[forces[k].first : forces[k].last]
        for i in range(m):
            for j in range(m):
                K[i, j] = 0.0
        size = _spread(work, 0, m)
        size = size if size > 0.0 else 1.0
        if model.info.over != 0.0:
            _integrate(t, model, k, m, size, 1.0, 0.0, K)
        else:
            add_element_law_gradient(forces[k].law, p, t, work, m, 0, size, -1.0, K)
        largest = asymmetry = 0.0
        for i in range(m):
            for j in range(m):
                largest = max(largest, abs(K[i, j]))
                asymmetry = max(asymmetry, abs(K[i, j] - K[j, i]))
        symmetric = asymmetry <= ASYMMETRY * largest
        forces[k].symmetric = 1.0 if symmetric else 0.0
        if symmetric:
            for i in range(m):
                for j in range(i):
                    K[i, j] = K[j, i] = 0.5 * (K[i, j] + K[j, i])
        if model.info.over == 0.0:
            _evaluate(t, model, k, m, 2 * m)
        else:
            _integrate(t, model, k, m, size, 0.0, 0.0, model.K12)
        _add_products(y, model, k, m, 1.0, 0.0, K, matrix)
        if c_rate != 0.0 or _moves(work, m):
            speed = max(_spread(work, m, m), size)  # of points at rest: their distance in a second
            for i in range(m):
                for j in range(m):
                    K[i, j] = 0.0
            if model.info.over != 0.0:
                _integrate(t, model, k, m, speed, 0.0, 1.0, K)
            else:
                add_element_law_gradient(forces[k].law, p, t, work, m, m, speed, -1.0, K)
            _add_products(y, model, k, m, c_rate, 1.0, K, matrix)


@inlined
def _moves(work, m):
    """Whether a point of a law, in its scratch, has a velocity."""
    found = False
    for i in range(m, 2 * m):
        found = found or work[i] != 0.0
    return found


@inlined
def _add_products(y, model, k, m, moved, turned, K, matrix):
    """Add derivatives K of the forces of law k to the unknowns of its points, and what turns of bodies change.

    Parameters
    ----------
    moved, turned : what K is derived by changes by `moved` times the displacement of a point, and by `turned` times
        what a turn of its body changes in its velocity
    """
    forces, markers, work = model.custom_forces, model.markers, model.custom
    Ja, Jb = model.J[0], model.J[1]
    for i in range(forces[k].points):
        p, f = forces[k].first_marker + i, 2 * m + 3 * i
        at, n = marker_columns(model, p, Ja)
        for j in range(forces[k].points):
            other = forces[k].first_marker + j
            bt, o = marker_columns(model, other, Jb)
            add_product(matrix, at, n, Ja, K, 3 * i, 3 * j, bt, o, Jb, moved)
            if turned != 0.0:
                u = marker_kinematics(y, model.markers, model.points, model.bodies, other)
                bt, o = marker_turning(model, other, u, Jb)
                add_product(matrix, at, n, Ja, K, 3 * i, 3 * j, bt, o, Jb, turned)
        if turned == 0.0 and markers[p].kind == ON_BODY:
            add_turning(matrix, model, markers[p].index, markers[p].local, -work[f], -work[f + 1], -work[f + 2])
