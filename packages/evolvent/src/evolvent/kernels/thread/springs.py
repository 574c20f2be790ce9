"""Segments of springs: their force over an interval, right-hand side, tangent, and their pull on the body.

Over an interval of length h the state is the mean one, with the rates of the interval, and the records hold lengths at
both ends (`measure_segments`): a force acts along the mean vector d by 2 |d|/(l0 + l1), with the mean of the
elongations at both ends, so that its work is the change of its energy. A state is an interval of length 0.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.markers import ON_BODY as MARKER_ON_BODY, marker_turning
from evolvent.kernels.rigid import add_wrench
from evolvent.kernels.rotations import turn_back
from evolvent.kernels.sides import ON_BODY, add_product, add_turning, side_columns, write_axial
from evolvent.kernels.thread.boundary import interval_factor, length_factor, mean_square
from evolvent.kernels.thread.end import TINY, is_end, node_columns, pull_end
from evolvent.kernels.thread.relaxing import relaxes, relaxing_slope, relaxing_tension
from evolvent.kernels.thread.spool import MOVING, SPRINGS, pull_spool
from evolvent.model import MODEL, having

USED_FOR, _SPRINGS = "threads", having("threads", kind=SPRINGS)
_I = types.int64


@inlined
def spring_points(y, s, threads, nodes, p):
    """Positions and velocities of the released nodes of a spring thread into x, v."""
    first, q, v = threads[p].node, threads[p].iq, threads[p].iv
    for i in range(s[p]):
        if is_end(threads, p, i):  # see `end.place_end`
            continue
        for c in range(3):
            nodes[first + i].x[c] = y[q + 3 * i + c]
            nodes[first + i].v[c] = y[v + 3 * i + c]
    if threads[p].kind == MOVING:  # whose material moves on along the mesh
        last, flow = first + threads[p].n - 1, threads[p].n * threads[p].taken[1] / threads[p].b[0]
        for i in range(1, threads[p].n):
            part = 0.5 * (i * threads[p].growth + flow)
            for c in range(3):
                inner = nodes[first + i + 1].x[c] if first + i < last else threads[p].Q[c]
                nodes[first + i].v[c] += part * (nodes[first + i - 1].x[c] - inner)


@inlined
def segment_count(s, threads, p):
    """Number of segments of thread p: one a released node, but none to the spool once the whole has left it."""
    return s[p] - (1 if s[threads.size + p] != 0 else 0)


@inlined
def is_boundary(s, threads, p, i):
    """Whether segment i of thread p is the one between the spool and the last node, whose length is its own."""
    return i == s[p] - 1 and threads[p].kind != MOVING


@inlined
def natural_segment(s, threads, p, i):
    """Natural length and stiffness of segment i of thread p in a state."""
    if is_boundary(s, threads, p, i):
        rest = threads[p].b[0]
        return rest, threads[p].stiffness * length_factor(threads, p, rest)[0]
    return threads[p].element, threads[p].stiffness * (threads[p].segment / threads[p].element)


@inlined
def segment_vector(y, s, p, i, model):
    """Vector to node i of thread p from the next one, or from the departure point, and its rate: six floats."""
    threads, nodes, at_spool = model.threads, model.nodes, i == s[p] - 1
    first, a, c, Q = threads[p].node, threads[p].iq + 3 * i, threads[p].iv + 3 * i, threads[p].Q
    x, yy, z, vx, vy, vz = y[a], y[a + 1], y[a + 2], y[c], y[c + 1], y[c + 2]
    if is_end(threads, p, i):
        end, moves = nodes[first].x, nodes[first].v
        x, yy, z, vx, vy, vz = end[0], end[1], end[2], moves[0], moves[1], moves[2]
    if at_spool:
        return x - Q[0], yy - Q[1], z - Q[2], vx - Q[3], vy - Q[4], vz - Q[5]
    return x - y[a + 3], yy - y[a + 4], z - y[a + 5], vx - y[c + 3], vy - y[c + 4], vz - y[c + 5]


@inlined
def segment_force(y, h, s, p, i, model):
    """Force of segment i of thread p over an interval of length h; its tension and slope go to the node's record.

    Returns
    -------
    ex, ey, ez, scale : vector and factor of its direction
    tension, damped : N, tension and the damper's part of it
    rate : m/s, of the elongation, which is the length less the natural one: all that the spool pays out counts

    Notes
    -----
    By eq. (9) of the heliogyro the length paid out would count as much as the segment lies along X. Its damper d would
    then pull a segment that lags by an angle a, but does not stretch, with d v (1 - cos a).
    """
    threads, nodes, at_spool = model.threads, model.nodes, i == s[p] - 1
    k, rest, longer, boundary = threads[p].node + i, threads[p].element, 0.0, is_boundary(s, threads, p, i)
    if boundary:
        rest, longer = threads[p].b[0], threads[p].b[1]
    ex, ey, ez, vx, vy, vz = segment_vector(y, s, p, i, model)
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if h != 0.0:
        length = 0.5 * (nodes[k].length0 + nodes[k].length1)
    scale = 1.0
    if not at_spool or length > TINY:
        scale = 1.0 / length
    else:  # along the velocity with which the node leaves: the drive's (eq. 11), or that turned along the thread
        length = 0.0
        speed = math.sqrt(vx * vx + vy * vy + vz * vz)
        if speed > 0.0:
            scale = 1.0 / speed
            ex, ey, ez = vx, vy, vz
        else:
            ex, ey, ez = threads[p].X[0], threads[p].X[1], threads[p].X[2]
    if at_spool:
        ex, ey, ez, scale = scale * ex, scale * ey, scale * ez, 1.0
    stretch_rate = (vx * ex + vy * ey + vz * ez) * scale
    if h != 0.0:
        stretch_rate = (nodes[k].length1 - nodes[k].length0) / h
    rate = stretch_rate - longer - length * threads[p].growth
    extension = length - rest
    if h != 0.0 and threads[p].slack != 0:
        e0, e1 = nodes[k].extension0, nodes[k].extension1
        extension, nodes[k].along = secant(e0, e1)
    else:
        nodes[k].along = 1.0
    nodes[k].length, stiffness, damping = length, threads[p].stiffness, threads[p].damping
    factor = threads[p].segment / threads[p].element
    if boundary:
        factor = 1.0
        if threads[p].shortest != 0.0:
            factor, slope, _, _ = interval_factor(h, threads, p)
            squares, _ = mean_square(h, p, k, model)
            threads[p].line_energy = -0.5 * stiffness * slope * squares
    stiffness, damping = factor * stiffness, factor * damping
    elastic, damped = stiffness * extension, damping * rate
    if relaxes(threads, p):
        elastic, nodes[k].lost = relaxing_tension(h, boundary, length - rest, p, k, model)
    if threads[p].slack != 0:
        elastic, damped = taut(elastic, damped)
    nodes[k].tension = elastic + damped
    return ex, ey, ez, scale, elastic + damped, damped, rate


@inlined
def secant(e0, e1):
    """Mean elongation by which a slack segment pulls over an interval, and twice its derivative by e1.

    Notes
    -----
    (p1^2 - p0^2)/(2 (e1 - e0)), p = max(e, 0): the change of the energy over that of the elongation.
    """
    p0, p1 = max(e0, 0.0), max(e1, 0.0)
    if (e0 >= 0.0 and e1 >= 0.0) or (e0 <= 0.0 and e1 <= 0.0):
        return 0.5 * (p0 + p1), (1.0 if p0 + p1 > 0.0 else 0.0)
    mean = 0.5 * (p1 * p1 - p0 * p0) / (e1 - e0)
    return mean, 2.0 * (p1 - mean) / (e1 - e0)


@inlined
def taut(elastic, damped):
    """Elastic and damping part of the tension of a segment that goes slack, N: none below its length, no push above.

    A segment that contracts faster than its spring pulls carries no force: the damper takes what the spring releases.
    """
    if elastic <= 0.0:
        return 0.0, 0.0
    return elastic, max(damped, -elastic)


@indirect(void(_I, VECTOR, INTEGERS, MODEL))
def measure_segments(end, y, s, model):
    """Lengths and elongations of all segments at the start (0) or the end (1) of a step, after `reels`."""
    threads, nodes = model.threads, model.nodes
    for p in range(threads.size):
        if end == 0:
            threads[p].rest0, threads[p].turning0 = threads[p].b[0], threads[p].b[1] / threads[p].r
        else:
            threads[p].rest1, threads[p].turning1 = threads[p].b[0], threads[p].b[1] / threads[p].r
        for i in range(segment_count(s, threads, p)):
            k = threads[p].node + i
            rest, _ = natural_segment(s, threads, p, i)
            ex, ey, ez, _, _, _ = segment_vector(y, s, p, i, model)
            length = math.sqrt(ex * ex + ey * ey + ez * ez)
            if end == 0:
                nodes[k].length0, nodes[k].extension0 = length, length - rest
            else:
                nodes[k].length1, nodes[k].extension1 = length, length - rest
                scale = 1.0 / length if length > TINY else 0.0
                nodes[k].end[0], nodes[k].end[1], nodes[k].end[2] = scale * ex, scale * ey, scale * ez


@indirect(REAL(VECTOR, INTEGERS, MODEL))
def longest_step(y, s, model):
    """Time until the first stretched segment without a pull is as short as its natural length, s; infinity for none.

    What its damper takes until then, and no longer, is c extension rate: a step that ends there integrates it exactly.
    """
    threads, found = model.threads, math.inf
    for p in range(threads.size):
        if threads[p].slack == 0 or relaxes(threads, p):
            continue
        for i in range(segment_count(s, threads, p)):
            rest, _ = natural_segment(s, threads, p, i)
            _, _, _, _, tension, _, rate = segment_force(y, 0.0, s, p, i, model)
            extension = model.nodes[threads[p].node + i].length - rest
            if extension > 1e-9 * threads[p].segment and tension <= 0.0 and rate < 0.0:
                found = min(found, extension / -rate)
    return found


@inlined
def add_spring_thread(y, h, s, model, p, loaded, dy):
    """Right-hand side of a spring thread (eqs. 3, 4, 7 to 11) and its pull on the body (eq. 15).

    Over an interval of length h about the mean state y, or at the state y (h = 0). Tensions go to the nodes. Returns
    (power dissipated, power of the spool), W.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    j, copies, driven = s[p], float(threads[p].copies), 0.0
    if threads[p].drive == FREE_SPOOL:
        driven = copies * threads[p].motor * y[threads[p].spool_v]
    if j == 0:
        return 0.0, driven
    first, q, v = threads[p].node, threads[p].iq, threads[p].iv
    dissipated, relaxing = 0.0, relaxes(threads, p)
    px = py = pz = 0.0  # pull of the outer segment on the node
    for i in range(j):
        fx = fy = fz = 0.0
        if i < j - 1 or s[threads.size + p] == 0:
            ex, ey, ez, scale, T, damped, rate = segment_force(y, h, s, p, i, model)
            scale *= T
            fx, fy, fz = scale * ex, scale * ey, scale * ez
            dissipated += damped * rate
            if relaxing:
                dissipated += nodes[first + i].lost
            if i == j - 1:
                if threads[p].drive != FREE_SPOOL:
                    driven = -copies * (T + threads[p].line_energy) * threads[p].b[1]
                d, pull = threads[p].d, copies * T
                add_wrench(bodies[threads[p].body].F, d[0], d[1], d[2], pull * ex, pull * ey, pull * ez)
                if threads[p].drive == FREE_SPOOL:  # which turns by `spool.spring_spools`
                    pull_spool(model, p, T + threads[p].line_energy)
        else:
            nodes[first + i].tension = 0.0
        if is_end(threads, p, i):
            pull_end(model, p, -fx, -fy, -fz)
        else:
            a, c, m = q + 3 * i, v + 3 * i, nodes[first + i].compliance
            dy[a], dy[a + 1], dy[a + 2] = y[c], y[c + 1], y[c + 2]
            dy[c] = (px - fx) * m
            dy[c + 1] = (py - fy) * m
            dy[c + 2] = (pz - fz) * m
        px, py, pz = fx, fy, fz
    if loaded:
        if is_end(threads, p, 0):
            pull_end(model, p, nodes[first].af[0], nodes[first].af[1], nodes[first].af[2])
        for i in range(1 if is_end(threads, p, 0) else 0, j):
            for k in range(3):
                dy[v + 3 * i + k] += nodes[first + i].af[k]
    return copies * dissipated, driven


@indirect(
    types.UniTuple(REAL, 2)(VECTOR, REAL, INTEGERS, MODEL, _I, types.boolean, VECTOR),
    used_for=_SPRINGS,
)
def spring_thread(y, h, s, model, p, loaded, dy):
    """`add_spring_thread`, called by address."""
    return add_spring_thread(y, h, s, model, p, loaded, dy)


# ---------------------------------------------------------------------------------------------- tangent


@inlined
def stiffness_factor(h, threads, p, leaves):
    """Stiffness of a segment of thread p over that of a whole one; `leaves`: it is the one at the spool."""
    if leaves:
        factor, _, _, _ = interval_factor(h, threads, p)
        return factor
    return threads[p].segment / threads[p].element


@inlined
def segment_slope(h, c_rate, p, i, model):
    """Derivative of the tension of segment i of thread p by its length, and c_rate times that by the rate, N/m.

    None of a slack one; over a step twice the derivative by the length at its end.
    """
    threads, k = model.threads, model.threads[p].node + i
    if threads[p].slack != 0 and model.nodes[k].tension == 0.0:
        return 0.0
    factor = stiffness_factor(h, threads, p, is_boundary(model.switches, threads, p, i))
    stiffness, damping = factor * threads[p].stiffness, factor * threads[p].damping
    if relaxes(threads, p):
        return stiffness * relaxing_slope(h, p, k, model) + c_rate * damping
    if h == 0.0:
        return stiffness + c_rate * damping
    return stiffness * model.nodes[k].along + c_rate * damping


@inlined
def segment_columns(p, i, s, model, Ja, Jb):
    """Columns of both ends of segment i of thread p: first unknown and number of each."""
    threads, local = model.threads, model.threads[p].departure
    a, n = node_columns(model, p, i, Ja)
    if i == s[p] - 1:
        b, m = side_columns(model, ON_BODY, threads[p].body, -1, local, True, Jb)
    else:
        b, m = node_columns(model, p, i + 1, Jb)
    return a, n, b, m


@inlined
def turning_columns(p, i, s, model, Ja, Jb):
    """Columns of what turns of bodies change in the rates of both ends of segment i of p, as `segment_columns`."""
    threads, bodies, own, a, n, b, m = model.threads, model.bodies, model.e[2], 0, 0, 0, 0
    if is_end(threads, p, i):
        v = model.nodes[threads[p].node].v
        a, n = marker_turning(model, threads[p].end, (0.0, 0.0, 0.0, v[0], v[1], v[2]), Ja)
    if i == s[p] - 1:
        k, Q, v = threads[p].body, threads[p].Q, bodies[threads[p].body].v
        own[0], own[1], own[2] = turn_back(bodies[k].R, Q[3] - v[0], Q[4] - v[1], Q[5] - v[2])
        b, m = side_columns(model, ON_BODY, k, -1, own, False, Jb)
    return a, n, b, m


@inlined
def damper_slope(h, p, i, model):
    """Derivative of the tension of segment i of thread p by a rate that its lengths do not make, N s/m.

    It is 0 of a slack segment, and over a step of length h > 0, whose lengths make the rate.
    """
    threads = model.threads
    if h != 0.0 or (threads[p].slack != 0 and model.nodes[threads[p].node + i].tension == 0.0):
        return 0.0
    return threads[p].damping * stiffness_factor(h, threads, p, is_boundary(model.switches, threads, p, i))


@indirect(void(VECTOR, REAL, REAL, REAL, _I, _I, MODEL, SPARSE))
def add_segment_tangent(y, h, along, tension, p, i, model, matrix):
    """Tangent of segment i of thread p; over a step of length h > 0 twice the derivatives by what its end moves.

    Parameters
    ----------
    along : float, N/m, of `segment_slope`; tension : float, N

    Notes
    -----
    As of `springs.spring_tangents`: T/l + (along - T/l) n m^T, n along the force, m at the end of the step. The body of
    the reel carries all copies.
    """
    threads, nodes, s = model.threads, model.nodes, model.switches
    K, X, k = model.K12, threads[p].X, threads[p].node + i
    ex, ey, ez, vx, vy, vz = segment_vector(y, s, p, i, model)
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if h != 0.0:
        length = 0.5 * (nodes[k].length0 + nodes[k].length1)
    n, across = (X[0], X[1], X[2]), 0.0
    if length > TINY:
        n, across = (ex / length, ey / length, ez / length), tension / length
    m = n
    if h != 0.0 and nodes[k].length1 > TINY:
        m = (nodes[k].end[0], nodes[k].end[1], nodes[k].end[2])
    for r in range(3):
        for c in range(3):
            K[r, c] = (along - across) * n[r] * m[c] + (across if r == c else 0.0)
    held, whole = is_end(threads, p, i), i == s[p] - 1
    damper = damper_slope(h, p, i, model) if length > TINY else 0.0
    if damper != 0.0:
        v, rate = (vx, vy, vz), n[0] * vx + n[1] * vy + n[2] * vz
        for r in range(3):
            for c in range(3):
                K[r, c] += damper / length * n[r] * (v[c] - rate * n[c])
                K[r, c] -= damper * threads[p].growth * n[r] * n[c]
    if not (held or whole):
        outer = threads[p].iv + 3 * i - model.info.nq
        inner = outer + 3
        add_block(matrix, outer, outer, K, 0, 0, 3, 3, 1.0)
        add_block(matrix, inner, inner, K, 0, 0, 3, 3, 1.0)
        add_block(matrix, outer, inner, K, 0, 0, 3, 3, -1.0)
        add_block(matrix, inner, outer, K, 0, 0, 3, 3, -1.0)
        return
    Ja, Jb, copies = model.J[0], model.J[1], float(threads[p].copies) if whole else 1.0
    a, na, b, nb = segment_columns(p, i, s, model, Ja, Jb)
    add_product(matrix, a, na, Ja, K, 0, 0, a, na, Ja, 1.0)
    add_product(matrix, a, na, Ja, K, 0, 0, b, nb, Jb, -1.0)
    add_product(matrix, b, nb, Jb, K, 0, 0, a, na, Ja, -copies)
    add_product(matrix, b, nb, Jb, K, 0, 0, b, nb, Jb, copies)
    if damper != 0.0:
        write_axial(K, 0.0, damper, n)
        _add_turned_rates(p, i, copies, a, na, b, nb, model, matrix)
    e = threads[p].end
    if held and model.markers[e].kind == MARKER_ON_BODY:
        body, local = model.markers[e].index, model.markers[e].local
        add_turning(matrix, model, body, local, tension * n[0], tension * n[1], tension * n[2])
    if whole:
        T = -copies * tension
        add_turning(matrix, model, threads[p].body, threads[p].departure, T * n[0], T * n[1], T * n[2])


@inlined
def _add_turned_rates(p, i, copies, a, na, b, nb, model, matrix):
    """Add what turns of bodies change in the damper of segment i of thread p, whose derivative by rates is in K12.

    Parameters
    ----------
    a, na, b, nb : of `segment_columns`, which are in J[0] and J[1]
    """
    K, Ja, Jb, L, M = model.K12, model.J[0], model.J[1], model.J[2], model.K24
    c, nc, d, nd = turning_columns(p, i, model.switches, model, L, M)
    add_product(matrix, a, na, Ja, K, 0, 0, c, nc, L, 1.0)
    add_product(matrix, b, nb, Jb, K, 0, 0, c, nc, L, -copies)
    add_product(matrix, a, na, Ja, K, 0, 0, d, nd, M, -1.0)
    add_product(matrix, b, nb, Jb, K, 0, 0, d, nd, M, copies)
