"""Spring-dampers between two markers (points fixed to the ground, to a body or to a point mass).

A force is defined over an interval of length h; a state is an interval of length 0. `measure_springs` notes the lengths
l0, l1 at both ends of a step; along the mean vector e between the ends of the spring the force is T e / l, with the
mean length l = (l0 + l1)/2 and T of the mean extension and of the rate (l1 - l0)/h: its work is T (l1 - l0). Of a state
l = abs(e), and the rate is that of l. What a record holds of its last evaluation is listed in `model.RESULTS`.
"""

import math

import numpy as np
from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, VECTOR, entry, indirect, inlined
from evolvent.compiled.lookups import spring_law_at
from evolvent.kernels.calls import note_stage
from evolvent.kernels.law_means import SPRING, scalar_mean, scalar_slope
from evolvent.kernels.law_slopes import spring_law_slope
from evolvent.kernels.markers import (
    ON_BODY,
    ON_POINT,
    marker_columns,
    marker_kinematics,
    marker_turning,
    push_marker,
    spring_energy,
)
from evolvent.kernels.rigid import DRIVEN
from evolvent.kernels.sides import add_product, add_turning
from evolvent.kernels.slack import pull, recovered, taut_over
from evolvent.kernels.viscoelastic import (
    excess_square,
    is_kept,
    lost_square,
    note_rate,
    relax,
    relaxed_over,
    stiffness_factor,
)
from evolvent.model import MODEL

USED_FOR = "springs"
#: Length beside the natural length below which a spring has no direction.
NO_LINE = 1e-9


@inlined
def distance(ex, ey, ez, vx, vy, vz):
    """Length of a vector, its direction (zeros without a length) and the rate of its length: five floats."""
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    scale = 1.0 / length if length != 0.0 else 0.0
    nx, ny, nz = scale * ex, scale * ey, scale * ez
    return length, nx, ny, nz, nx * vx + ny * vy + nz * vz


@inlined
def lateral_force(u, stiffness, damping, ex, ey, ez, vx, vy, vz):
    """Force of a spring on its end b across the axis u of its mount on the ground, and the power it dissipates.

    Notes
    -----
    Of the part s of the spring's vector across the axis: -(k_l s + c_l s'), with the energy k_l s^2 / 2.
    """
    along = ex * u[0] + ey * u[1] + ez * u[2]
    rate = vx * u[0] + vy * u[1] + vz * u[2]
    wx, wy, wz = vx - rate * u[0], vy - rate * u[1], vz - rate * u[2]
    return (
        -stiffness * (ex - along * u[0]) - damping * wx,
        -stiffness * (ey - along * u[1]) - damping * wy,
        -stiffness * (ez - along * u[2]) - damping * wz,
        damping * (wx * wx + wy * wy + wz * wz),
    )


@inlined
def lateral_energy(u, stiffness, ex, ey, ez):
    """k_l s^2 / 2, J."""
    along = ex * u[0] + ey * u[1] + ez * u[2]
    return 0.5 * stiffness * (ex * ex + ey * ey + ez * ez - along * along)


@entry(VECTOR, REAL, types.int64, MODEL)
@inlined
def spring_ends(y, h, k, model):
    """Both ends of spring k (six floats each), its length, the direction of its force, and the rate of its length."""
    springs, markers, points, bodies = model.springs, model.markers, model.points, model.bodies
    a = marker_kinematics(y, markers, points, bodies, springs[k].a)
    b = marker_kinematics(y, markers, points, bodies, springs[k].b)
    if h == 0.0:
        found = distance(b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3], b[4] - a[4], b[5] - a[5])
        return a, b, found
    length, rate = 0.5 * (springs[k].length0 + springs[k].length1), (springs[k].length1 - springs[k].length0) / h
    scale = 1.0 / length if length != 0.0 else 0.0  # by which the mean vector becomes the direction of the force
    return a, b, (length, scale * (b[0] - a[0]), scale * (b[1] - a[1]), scale * (b[2] - a[2]), rate)


@inlined
def evaluate_spring(t, y, h, k, model):
    """Evaluate spring k; extension, rate and tension go into its record.

    Returns
    -------
    a, b, n : its ends (six floats each) and the direction of its force
    length, T : its length and tension
    lost, given : power that its damping along n takes, and relaxation in a state of an explicit method, and that of a
        user's law, W
    """
    springs = model.springs
    a, b, (length, nx, ny, nz, rate) = spring_ends(y, h, k, model)
    if h == 0.0:
        line = springs[k].line
        line[0], line[1], line[2] = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    extension = length - springs[k].length
    elastic = damping = given = relaxed = 0.0
    if length == 0.0:  # without a line there is no force
        pass
    elif springs[k].law == 0 and springs[k].slack == 0:
        elastic, damping = springs[k].stiffness * extension, springs[k].damping * rate
        if springs[k].prony_end > springs[k].prony:
            first, last, branch = springs[k].prony, springs[k].prony_end, springs[k].branch
            end = extension if h == 0.0 else springs[k].length1 - springs[k].length
            elastic += springs[k].stiffness * relax(first, last, branch, h, extension, end, model)[0]
            if is_kept(h, model):
                note_rate(first, last, branch, rate, model)
                relaxed = springs[k].stiffness * lost_square(first, last, branch, model)
    elif springs[k].law == 0:
        start, end = extension - 0.5 * h * rate, extension + 0.5 * h * rate
        if springs[k].prony_end > springs[k].prony:
            first, last, branch = springs[k].prony, springs[k].prony_end, springs[k].branch
            mean, share, springs[k].slope = pull(first, last, branch, h, start, end, model)
            if is_kept(h, model):
                relaxed = springs[k].stiffness * lost_square(first, last, branch, model)
        else:
            mean, share = taut_over(start, end)
        elastic = springs[k].stiffness * mean
        damping = max(share * springs[k].damping * rate, -elastic)
    else:
        p = model.parameters[springs[k].first : springs[k].last]
        if h == 0.0:
            elastic = spring_law_at(springs[k].law)(extension, rate, t, p)
        else:
            elastic = scalar_mean(SPRING, springs[k].law, extension, rate, t, h, p, 0.0, math.inf, model)
        given = -elastic * rate
    T = elastic + damping
    springs[k].extension, springs[k].rate, springs[k].tension = extension, rate, T
    return a, b, (nx, ny, nz), length, T, damping * rate + relaxed, given


@inlined
def has_lateral(springs, k):
    """Whether spring k has a force across the axis of its mount."""
    return springs[k].lateral_stiffness != 0.0 or springs[k].lateral_damping != 0.0


@inlined
def lateral_of(springs, k, a, b):
    """`lateral_force` of spring k with the ends a and b."""
    return lateral_force(
        springs[k].axis, springs[k].lateral_stiffness, springs[k].lateral_damping,
        b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3], b[4], b[5],
    )  # fmt: skip


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, REAL, MODEL))
def spring_forces(t, y, h, model):
    """Forces of all springs onto bodies and points; returns (power dissipated, power of the laws), W.

    At the state y (h = 0), or over a step of length h, after `measure_springs`: y is the mean state then, with the
    rates of the step.
    """
    springs, markers, points, bodies = model.springs, model.markers, model.points, model.bodies
    dissipated = law_power = 0.0
    for k in range(springs.size):
        a, b, n, _, T, lost, given = evaluate_spring(t, y, h, k, model)
        dissipated += lost
        law_power += given
        if has_lateral(springs, k):
            fx, fy, fz, rubbed = lateral_of(springs, k, a, b)
            dissipated += rubbed
            push_marker(markers, points, bodies, springs[k].b, b[0], b[1], b[2], fx, fy, fz)
        fx, fy, fz = T * n[0], T * n[1], T * n[2]
        push_marker(markers, points, bodies, springs[k].a, a[0], a[1], a[2], fx, fy, fz)
        push_marker(markers, points, bodies, springs[k].b, b[0], b[1], b[2], -fx, -fy, -fz)
    return dissipated, law_power


@indirect(void(types.int64, VECTOR, MODEL))
def measure_springs(end, y, model):
    """Lengths of all springs at the start (0) or the end (1) of a step, and their directions at the end."""
    springs = model.springs
    for k in range(springs.size):
        _, _, (length, nx, ny, nz, _) = spring_ends(y, 0.0, k, model)
        if end == 0:
            springs[k].length0 = length
        else:
            springs[k].length1 = length
            springs[k].end[0], springs[k].end[1], springs[k].end[2] = nx, ny, nz


@indirect(REAL(REAL, VECTOR, MODEL))
def evaluate_springs(t, y, model):
    """Evaluate all springs at a state, after `kinematics`, into their records; returns the energy that they store, J.

    Notes
    -----
    U = k e^2 / 2, and k_l s^2 / 2 across the axis. A user's law has no energy that is known.
    """
    springs, energy = model.springs, 0.0
    for k in range(springs.size):
        a, b, _, length, _, lost, _ = evaluate_spring(t, y, 0.0, k, model)
        springs[k].distance, springs[k].stored = length, 0.0
        fx, fy, fz, rubbed = lateral_of(springs, k, a, b)
        springs[k].lateral[0], springs[k].lateral[1], springs[k].lateral[2] = fx, fy, fz
        springs[k].lost = lost + rubbed
        if springs[k].law == 0:
            extension, kl = springs[k].extension, springs[k].lateral_stiffness
            relaxing = springs[k].prony_end > springs[k].prony
            if springs[k].slack != 0:
                extension = model.branch_strains[springs[k].branch].x if relaxing else max(extension, 0.0)
            springs[k].stored = spring_energy(springs[k].stiffness, extension)
            if relaxing:
                square = excess_square(springs[k].prony, springs[k].prony_end, springs[k].branch, extension, model)
                springs[k].stored += 0.5 * springs[k].stiffness * square
            springs[k].stored += lateral_energy(springs[k].axis, kl, b[0] - a[0], b[1] - a[1], b[2] - a[2])
        energy += springs[k].stored
    return energy


@inlined
def relaxed_springs(h, share, model):
    """What relaxation of all springs takes over a step of length h that is accepted, J.

    Parameters
    ----------
    share : 1 where the last evaluation was one of the step's end, 0.5 where it was one of the step
    """
    springs, taken = model.springs, 0.0
    for k in range(springs.size):
        if springs[k].prony_end > springs[k].prony:
            first, last, branch = springs[k].prony, springs[k].prony_end, springs[k].branch
            taken += springs[k].stiffness * relaxed_over(first, last, branch, h, model)
            if springs[k].slack != 0 and h > 0.0:
                end = springs[k].extension + (0.0 if share == 1.0 else 0.5 * h * springs[k].rate)
                taken += springs[k].stiffness * recovered(first, last, branch, h, end, model)
    return taken


@entry(REAL, types.int64, MODEL)
@inlined
def force_without_line(t, k, model):
    """Force of spring k at zero length and at rest, N, which has no direction there."""
    springs = model.springs
    if springs[k].law == 0:
        return -springs[k].stiffness * springs[k].length if springs[k].slack == 0 else 0.0
    p = model.parameters[springs[k].first : springs[k].last]
    return spring_law_at(springs[k].law)(-springs[k].length, 0.0, t, p)


@note_stage
def note_lines(t, starts, model):
    """Note at the state that was evaluated last, of a start or the end of a step, which springs have no line by now.

    Notes
    -----
    The field `passed` becomes the first time at which a spring with a force at zero length has no length, or has turned
    by more than a right angle within a step, as where its ends pass through one another; infinity before.
    """
    springs = model.springs
    for k in range(springs.size):
        e, e0 = springs[k].line, springs[k].line0
        if starts != 0:
            springs[k].passed = math.inf
            e0[0] = e0[1] = e0[2] = 0.0
        small = NO_LINE * springs[k].length
        turned = e[0] * e0[0] + e[1] * e0[1] + e[2] * e0[2] < 0.0
        gone = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] <= small * small
        e0[0], e0[1], e0[2] = e[0], e[1], e[2]
        if (turned or gone) and t < springs[k].passed and force_without_line(t, k, model) != 0.0:
            springs[k].passed = t


@indirect(void(REAL, VECTOR, REAL, REAL, MODEL, SPARSE))
def spring_tangents(t, y, h, c_rate, model, matrix):
    """Tangents of all springs; over a step of length h > 0 twice the derivatives by what its end moves.

    Notes
    -----
    With the direction n of the force and the length l of the interval, the force T n on the ends changes by
    T/l + (T_e + c_rate T_v - T/l) n m^T, m = n of a state and the direction at the end of a step. Of a state, the rate
    n . v changes as well with n, by (v - n (n . v))/l, and with v, which turns with the bodies.
    """
    springs, K = model.springs, model.K12
    Ja, Jb, L = model.J[0], model.J[1], model.J[2]
    for k in range(springs.size):
        ma, mb = springs[k].a, springs[k].b
        a, b, n, length, tension, _, _ = evaluate_spring(t, y, h, k, model)
        if length == 0.0 and (springs[k].length != 0.0 or springs[k].law != 0):
            continue
        m = n if h == 0.0 else (springs[k].end[0], springs[k].end[1], springs[k].end[2])
        across = tension / length if length > 0.0 else springs[k].stiffness  # the same along any line
        p = _slope_over(t, h, c_rate, k, model) - across
        sideways, u = springs[k].lateral_stiffness + c_rate * springs[k].lateral_damping, springs[k].axis
        for i in range(3):
            for j in range(3):
                K[i, j] = p * n[i] * m[j] - sideways * u[i] * u[j]
            K[i, i] += across + sideways
        by_rate = rate_slope(t, h, k, model) if length > 0.0 else 0.0
        if by_rate != 0.0:
            v, rate = (b[3] - a[3], b[4] - a[4], b[5] - a[5]), springs[k].rate
            for i in range(3):
                for j in range(3):
                    K[i, j] += by_rate / length * n[i] * (v[j] - rate * n[j])
        if model.markers[ma].kind == ON_POINT and model.markers[mb].kind == ON_POINT:
            i, j = model.markers[ma].index, model.markers[mb].index
            ra, rb = model.points[i].iv - model.info.nq, model.points[j].iv - model.info.nq
            add_block(matrix, ra, ra, K, 0, 0, 3, 3, 1.0)
            add_block(matrix, rb, rb, K, 0, 0, 3, 3, 1.0)
            add_block(matrix, ra, rb, K, 0, 0, 3, 3, -1.0)
            add_block(matrix, rb, ra, K, 0, 0, 3, 3, -1.0)
            continue
        ra, na = marker_columns(model, ma, Ja)
        rb, nb = marker_columns(model, mb, Jb)
        add_product(matrix, ra, na, Ja, K, 0, 0, ra, na, Ja, 1.0)
        add_product(matrix, rb, nb, Jb, K, 0, 0, rb, nb, Jb, 1.0)
        add_product(matrix, ra, na, Ja, K, 0, 0, rb, nb, Jb, -1.0)
        add_product(matrix, rb, nb, Jb, K, 0, 0, ra, na, Ja, -1.0)
        f = lateral_of(springs, k, a, b)
        if model.markers[ma].kind == ON_BODY:
            fx, fy, fz = -tension * n[0], -tension * n[1], -tension * n[2]
            add_turning(matrix, model, model.markers[ma].index, model.markers[ma].local, fx, fy, fz)
        if model.markers[mb].kind == ON_BODY:
            fx, fy, fz = tension * n[0] - f[0], tension * n[1] - f[1], tension * n[2] - f[2]
            add_turning(matrix, model, model.markers[mb].index, model.markers[mb].local, fx, fy, fz)
        sideways = springs[k].lateral_damping if h == 0.0 else 0.0
        if by_rate != 0.0 or sideways != 0.0:
            for i in range(3):
                for j in range(3):
                    K[i, j] = by_rate * n[i] * n[j] + sideways * ((1.0 if i == j else 0.0) - u[i] * u[j])
            for end in range(2):
                sign = 1.0 if end == 1 else -1.0
                at, count = marker_turning(model, mb if end == 1 else ma, b if end == 1 else a, L)
                add_product(matrix, ra, na, Ja, K, 0, 0, at, count, L, -sign)
                add_product(matrix, rb, nb, Jb, K, 0, 0, at, count, L, sign)


@inlined
def rate_slope(t, h, k, model):
    """Derivative of the tension of spring k by its rate, of a state; 0 over a step, whose rate its lengths make."""
    springs = model.springs
    if h != 0.0:
        return 0.0
    if springs[k].slack != 0 and springs[k].tension <= 0.0:
        return 0.0
    if springs[k].law == 0:
        return springs[k].damping
    p, length = model.parameters[springs[k].first : springs[k].last], springs[k].extension + springs[k].length
    return spring_law_slope(springs[k].law, springs[k].extension, 0.0, springs[k].rate, 1.0, t, p, max(length, 1e-3))


@inlined
def _slope_over(t, h, c_rate, k, model):
    """`spring_slope` at the last evaluation; over a step twice what the tension changes with its end."""
    springs = model.springs
    x, v = springs[k].extension, springs[k].rate
    if springs[k].slack != 0:
        if springs[k].tension <= 0.0:
            return 0.0
        start, end = x - 0.5 * h * v, x + 0.5 * h * v
        if springs[k].prony_end > springs[k].prony:
            taut = 1.0 if end >= model.branch_strains[springs[k].branch].x else 0.0
            return springs[k].stiffness * springs[k].slope + c_rate * springs[k].damping * taut
        mean, taut = taut_over(start, end)[0], 1.0 if end > 0.0 else 0.0
        by_end = 2.0 * (taut * end - mean) / (end - start) if (start > 0.0) != (end > 0.0) else taut
        return springs[k].stiffness * by_end + c_rate * springs[k].damping * taut
    if h == 0.0 or springs[k].law == 0:
        relaxed = stiffness_factor(springs[k].prony, springs[k].prony_end, h, model) - 1.0
        return spring_slope(t, x, v, c_rate, k, model) + springs[k].stiffness * relaxed
    p, size = model.parameters[springs[k].first : springs[k].last], max(x + springs[k].length, 1e-3)
    return scalar_slope(SPRING, springs[k].law, x, 1.0, v, c_rate, t, h, p, 0.0, math.inf, size, model)


@entry(REAL, REAL, REAL, REAL, types.int64, MODEL)
@inlined
def spring_slope(t, extension, rate, c_rate, k, model):
    """Derivative of the tension of spring k by its extension, and c_rate times that by its rate."""
    springs = model.springs
    if springs[k].law == 0:
        return springs[k].stiffness + c_rate * springs[k].damping
    p, length = model.parameters[springs[k].first : springs[k].last], extension + springs[k].length
    return spring_law_slope(springs[k].law, extension, 1.0, rate, c_rate, t, p, max(length, 1e-3))


# ---------------------------------------------------------------------------------------------- bound; not compiled


def add_spring_bound(y, model, body, point):
    """Add diagonal blocks of stiffness and damping of all springs, tightened ones stiff across their line as well.

    Parameters
    ----------
    body, point : (2, nb, 6, 6), (2, np, 3, 3) float, stiffness and damping felt by bodies and points

    Notes
    -----
    k (x_a - x_b)^2 <= 2 k (x_a^2 + x_b^2): blocks count twice where both ends move. After `kinematics`.
    """
    markers, moves = model.markers, model.bodies["motion"] != DRIVEN
    for k, spring in enumerate(model.springs):
        *ends, (length, *n, _) = spring_ends(y, 0.0, k, model)
        extension = length - float(spring["length"])
        tight, e = (max(extension / length, 0.0), n) if length > 0.0 else (0.0, [1.0, 0.0, 0.0])
        stiffness = spring_slope(0.0, extension, 0.0, 0.0, k, model)
        damping = spring_slope(0.0, extension, 0.0, 1.0, k, model) - stiffness
        along, across = np.outer(e, e), np.eye(3) - np.outer(spring["axis"], spring["axis"])
        blocks = np.array([
            max(stiffness, 0.0) * (along + tight * (np.eye(3) - along)) + float(spring["lateral_stiffness"]) * across,
            max(damping, 0.0) * along + float(spring["lateral_damping"]) * across,
        ])  # fmt: skip
        rows = [markers[int(spring[end])] for end in ("a", "b")]
        free = [row["kind"] == ON_POINT or bool(moves[row["index"]]) for row in rows]
        for row, end, moving in zip(rows, ends, free, strict=True):
            felt = blocks * (2.0 if all(free) else 1.0)
            if moving and row["kind"] == ON_POINT:
                point[:, row["index"]] += felt
            elif moving:
                d = np.array(end[:3]) - model.bodies["x"][row["index"]]
                J = np.hstack([np.eye(3), -np.array([[0.0, -d[2], d[1]], [d[2], 0.0, -d[0]], [-d[1], d[0], 0.0]])])
                body[:, row["index"]] += J.T @ felt @ J
