"""User-defined laws between points: forces on point masses, bodies, nodes of beams and the ground.

A point is a side (`evolvent.kernels.sides`). Scratch of a law between k points, m = 3 k: positions, velocities, forces
and other forces, (m,) each, then derivatives of the forces, (m, m).
"""

import numpy as np
from numba import types, void

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, element_law_at, indirect, inlined, kernel, matrix_view
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross
from evolvent.kernels.sides import ON_BODY, add_turning, pull, side_columns, side_vector
from evolvent.kernels.sparse import SPARSE, first_entry
from evolvent.model import MODEL

_I = types.int64
#: Steps of the central differences, in parts of the distance of the points.
STEP = 1e-5
#: Resultants this small beside the forces are round-off; so are asymmetries of derivatives by differences.
ROUND_OFF, ASYMMETRY = 1e-10, 1e-6


def scratch_size(points):
    """Numbers of scratch that a law between so many points needs. Not compiled."""
    m = 3 * points
    return 4 * m + m * m


@inlined
def _gather(y, model, k):
    """Write positions and velocities of the points of law k into its scratch; returns 3 times their number."""
    forces, points, work = model.flexible.custom_forces, model.flexible.custom_points, model.flexible.custom
    count, first = forces[k].points, forces[k].first_point
    m = 3 * count
    for i in range(count):
        p = first + i
        u = side_vector(
            y, model.bodies, points[p].on, points[p].index, points[p].iq, points[p].iv, points[p].local, True
        )
        for c in range(3):
            work[3 * i + c] = u[c]
            work[m + 3 * i + c] = u[3 + c]
    return m


@kernel
def _evaluate(t, model, k, m, out):
    """Call law k at the positions and velocities in its scratch; forces go to scratch[out : out + m].

    Returns the energy stored (J) and the power dissipated (W).
    """
    forces, work = model.flexible.custom_forces, model.flexible.custom
    for i in range(m):
        work[out + i] = 0.0
    parameters = model.parameters[forces[k].first : forces[k].last]
    return element_law_at(forces[k].law)(t, work[0:m], work[m : 2 * m], parameters, work[out : out + m])


@inlined
def _add_forces(y, t, k, model, F):
    """Forces of law k; returns the energy stored, the power dissipated, and that of forces without a stated energy.

    A law that has given neither an energy nor a power so far states none: its forces do work, as loads do.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    forces, points, work = flexible.custom_forces, flexible.custom_points, flexible.custom
    m, given = _gather(y, model, k), 0.0
    stored, lost = _evaluate(t, model, k, m, 2 * m)
    forces[k].balanced = _is_balanced(work, m)
    if stored != 0.0 or lost != 0.0:
        forces[k].stated = 1.0
    if forces[k].stated == 0.0:
        for i in range(m):
            given += work[2 * m + i] * work[m + i]
    for i in range(forces[k].points):
        p, x, f = forces[k].first_point + i, 3 * i, 2 * m + 3 * i
        pull(
            F, bodies, n_q, points[p].on, points[p].index, points[p].iv, (work[x], work[x + 1], work[x + 2]), True,
            -work[f], -work[f + 1], -work[f + 2],
        )  # fmt: skip
    return stored, lost, given


@indirect(types.UniTuple(REAL, 3)(REAL, VECTOR, MODEL, VECTOR))
def add_custom_forces(t, y, model, F):
    """Forces of all users' laws; returns the energy stored (J), the power dissipated, and that of those without energy.

    The powers are in W; see `_add_forces`.
    """
    energy = power = given = 0.0
    for k in range(model.flexible.custom_forces.size):
        stored, lost, work = _add_forces(y, t, k, model, F)
        energy += stored
        power += lost
        given += work
    return energy, power, given


@indirect(REAL(REAL, VECTOR, MODEL))
def custom_energies(t, y, model):
    """Energy stored by all user-defined laws between points, J; after `kinematics`."""
    energy = 0.0
    for k in range(model.flexible.custom_forces.size):
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


@inlined
def _differences(t, model, k, m, at, step, scale, K):
    """Add -scale times central differences of the forces of law k by the numbers from scratch[at] on to K."""
    work = model.flexible.custom
    for j in range(m):
        kept = work[at + j]
        work[at + j] = kept + step
        _evaluate(t, model, k, m, 2 * m)
        high = work[at + j]
        work[at + j] = kept - step
        _evaluate(t, model, k, m, 3 * m)
        part = scale / (high - work[at + j])
        work[at + j] = kept
        for i in range(m):
            K[i, j] -= part * (work[2 * m + i] - work[3 * m + i])


@indirect(void(REAL, VECTOR, REAL, MODEL, SPARSE))
def add_custom_tangents(t, y, c_rate, model, matrix):
    """Tangents of all user-defined laws between points, by central differences of their forces.

    Notes
    -----
    Derivatives by position that are symmetric but for the differences' errors are made so.
    """
    flexible = model.flexible
    forces, work = flexible.custom_forces, flexible.custom
    for k in range(forces.size):
        m = _gather(y, model, k)
        K = matrix_view(work, 4 * m, m, m)
        for i in range(m):
            for j in range(m):
                K[i, j] = 0.0
        size = _spread(work, 0, m)
        size = size if size > 0.0 else 1.0
        _differences(t, model, k, m, 0, STEP * size, 1.0, K)
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
        if c_rate != 0.0:
            speed = max(_spread(work, m, m), size)  # of points at rest: their distance in a second
            _differences(t, model, k, m, m, STEP * speed, c_rate, K)
        _evaluate(t, model, k, m, 2 * m)
        _add_products(model, k, m, K, matrix)


@inlined
def _add_products(model, k, m, K, matrix):
    """Add derivatives K of the forces of law k, and what turns of bodies change, to the points' unknowns."""
    flexible = model.flexible
    forces, points, work = flexible.custom_forces, flexible.custom_points, flexible.custom
    Ja, Jb = flexible.J[0], flexible.J[1]
    for i in range(forces[k].points):
        p = forces[k].first_point + i
        at, n = side_columns(model, points[p].on, points[p].index, points[p].iv, points[p].local, True, Ja)
        if n == 0:
            continue
        for j in range(forces[k].points):
            q = forces[k].first_point + j
            bt, o = side_columns(model, points[q].on, points[q].index, points[q].iv, points[q].local, True, Jb)
            _add_point_block(matrix, at, n, Ja, K, 3 * i, 3 * j, bt, o, Jb)
        if points[p].on == ON_BODY and model.bodies[points[p].index].motion != rigid.DRIVEN:
            f = 2 * m + 3 * i
            add_turning(
                matrix, model, points[p].index, points[p].local, -work[f], -work[f + 1], -work[f + 2],
            )  # fmt: skip


@indirect(void(SPARSE, _I, _I, MATRIX, MATRIX, _I, _I, _I, _I, MATRIX))
def _add_point_block(matrix, at, n, J, K, row, column, bt, m, L):
    """Add J^T K[row : row + 3, column : column + 3] L; rows of unknowns at, at + 1 ..., columns bt, bt + 1 ..."""
    if n == 0 or m == 0:
        return
    to, right, down = first_entry(matrix, at, bt)
    if to < 0:
        return
    values = matrix.values
    for c in range(m):
        for r in range(n):
            value = 0.0
            for i in range(3):
                for j in range(3):
                    value += J[i, r] * K[row + i, column + j] * L[j, c]
            values[to + r * down + c * right] += value


def states_of_points(model, y, k):
    """Positions and velocities, (3 k,) each, of the points of law k; after `kinematics`. Not compiled."""
    row, points = model.flexible.custom_forces[k], model.flexible.custom_points
    x, v = [], []
    for p in points[int(row["first_point"]) : int(row["first_point"] + row["points"])]:
        if p["on"] == ON_BODY:
            body = model.bodies[int(p["index"])]
            arm = np.array(body["R"]) @ p["local"]
            x.append(body["x"] + arm)
            v.append(body["v"] + np.cross(body["w"], arm))
        else:
            x.append(y[int(p["iq"]) :][:3])
            v.append(y[int(p["iv"]) :][:3])
    return np.concatenate(x), np.concatenate(v)
