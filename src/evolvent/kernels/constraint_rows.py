"""Rows of constraint: distance links, cords on a drum, guides, and the boundary segments of inextensible threads.

Each row has one multiplier, the tension la (positive where it pulls), and up to two sides, each a body, a point mass
or nothing. The rows that share a side are coupled; the coupled system A la = r is symmetric and banded.
"""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, entry, indirect, inlined
from evolvent.kernels import thread as chain
from evolvent.kernels.cord import drum_cord
from evolvent.kernels.linalg import banded_ldl, banded_ldl_solve
from evolvent.kernels.rigid import add_wrench, centripetal, respond
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.springs import marker_kinematics
from evolvent.model import MODEL, family_type

THREAD, LINK, GUIDE = 0, 1, 2
#: Kinds of guides.
CENTRE, AXIS = 0, 1


@entry(family_type("guides"), family_type("bodies"), types.int64)
@inlined
def guide_geometry(guides, bodies, k):
    """What guide k lacks, its rate, the part of its second derivative without accelerations, and its J : 6 numbers.

    Notes
    -----
    Of the centre: g = d . x - value. Of an axis X: g = X . d, g' = n . w and g'' = n . eps + n' . w with n = X x d.
    """
    b, d = guides[k].body, guides[k].direction
    if guides[k].kind == CENTRE:
        x, v = bodies[b].x, bodies[b].v
        gap = d[0] * x[0] + d[1] * x[1] + d[2] * x[2] - guides[k].value
        rate = d[0] * v[0] + d[1] * v[1] + d[2] * v[2]
        return gap, rate, 0.0, d[0], d[1], d[2], 0.0, 0.0, 0.0
    a, w = guides[k].axis, bodies[b].w
    X = turn(bodies[b].R, a[0], a[1], a[2])
    n = cross(X[0], X[1], X[2], d[0], d[1], d[2])
    u = cross(w[0], w[1], w[2], X[0], X[1], X[2])
    m = cross(u[0], u[1], u[2], d[0], d[1], d[2])
    gap = X[0] * d[0] + X[1] * d[1] + X[2] * d[2]
    rate = n[0] * w[0] + n[1] * w[1] + n[2] * w[2]
    return gap, rate, m[0] * w[0] + m[1] * w[1] + m[2] * w[2], 0.0, 0.0, 0.0, n[0], n[1], n[2]


@indirect(types.UniTuple(REAL, 12)(VECTOR, MODEL, types.int64))
def link_geometry(y, model, k):
    """Length, its rate, direction from a to b, the points of attack, and the velocity term of link k.

    Notes
    -----
    With a drum about an axis of the body at a, see `cord.drum_cord`. The velocity term is |v across|^2 / s (the free
    part's turning).
    """
    links, markers, points, bodies = model.links, model.markers, model.points, model.bodies
    a, b = links[k].a, links[k].b
    ax, ay, az, avx, avy, avz = marker_kinematics(y, markers, points, bodies, a)
    bx, by, bz, bvx, bvy, bvz = marker_kinematics(y, markers, points, bodies, b)
    dx, dy, dz = bx - ax, by - ay, bz - az
    vx, vy, vz = bvx - avx, bvy - avy, bvz - avz
    R = links[k].drum
    if R == 0.0:
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        ex, ey, ez = dx / length, dy / length, dz / length
        rate = ex * vx + ey * vy + ez * vz
        across = vx * vx + vy * vy + vz * vz - rate * rate
        return length, rate, ex, ey, ez, ax, ay, az, bx, by, bz, across / length
    body = markers[a].index
    sense = links[k].sense
    n, z = links[k].axis, links[k].zero
    nx, ny, nz = turn(bodies[body].R, n[0], n[1], n[2])
    zx, zy, zz = turn(bodies[body].R, z[0], z[1], z[2])
    omega = bodies[body].w[0] * nx + bodies[body].w[1] * ny + bodies[body].w[2] * nz
    length, rate, free, ex, ey, ez, rx, ry, rz, radial = drum_cord(
        R, sense, links[k].length, (dx, dy, dz), (vx, vy, vz), (nx, ny, nz), (zx, zy, zz), omega
    )
    px, py, pz = ax + R * rx, ay + R * ry, az + R * rz
    return length, rate, ex, ey, ez, px, py, pz, bx, by, bz, radial * radial / free


@indirect(types.int64(VECTOR, INTEGERS, MODEL))
def build_rows(y, s, model):
    """Directions, generalised directions J, responses Z and the factored matrix A of all rows.

    Returns -1, or the first row that the rows before it already imply.
    """
    rows, threads, bodies, points = model.rows, model.threads, model.bodies, model.points
    width = model.info.bandwidth
    A = model.A
    for r in range(rows.size):
        k = rows[r].index
        for side in range(2):
            for c in range(6):
                rows[r].J[side, c] = 0.0
                rows[r].Z[side, c] = 0.0
        for c in range(width + 1):
            A[r, c] = 0.0
        if rows[r].kind == THREAD:
            A[r, 0] = chain.chain_matrix(y, s, model, k) * threads[k].copies
            links, bound = chain.chain_links(s, threads, k)
            if not bound:
                continue
            if chain.is_loose(threads, k):
                radius = threads[k].r
                A[r, 0] += threads[k].copies * radius * radius / threads[k].spool
                nx, ny, nz = chain.spool_direction(threads, bodies, k)
                reaction = float(threads[k].copies) * radius
                rows[r].J[0, 3] -= reaction * nx
                rows[r].J[0, 4] -= reaction * ny
                rows[r].J[0, 5] -= reaction * nz
            q = threads[k].iq + 3 * links
            copies = float(threads[k].copies)
            rows[r].e[0], rows[r].e[1], rows[r].e[2] = y[q], y[q + 1], y[q + 2]
            add_wrench(
                rows[r].J[0],
                threads[k].d[0],
                threads[k].d[1],
                threads[k].d[2],
                copies * y[q],
                copies * y[q + 1],
                copies * y[q + 2],
            )
        elif rows[r].kind == GUIDE:
            held = guide_geometry(model.guides, bodies, k)
            J = rows[r].J
            J[0, 0], J[0, 1], J[0, 2] = held[3], held[4], held[5]
            J[0, 3], J[0, 4], J[0, 5] = held[6], held[7], held[8]
        else:
            geometry = link_geometry(y, model, k)
            ex, ey, ez = geometry[2], geometry[3], geometry[4]
            rows[r].e[0], rows[r].e[1], rows[r].e[2] = ex, ey, ez
            for side in range(2):
                b = rows[r].body[side]
                if b >= 0:
                    px, py, pz = geometry[5], geometry[6], geometry[7]
                    if side == 1:
                        px, py, pz = geometry[8], geometry[9], geometry[10]
                    add_wrench(
                        rows[r].J[side], px - bodies[b].x[0], py - bodies[b].x[1], pz - bodies[b].x[2], ex, ey, ez
                    )
                elif rows[r].point[side] >= 0:
                    A[r, 0] += 1.0 / points[rows[r].point[side]].mass
        for side in range(2):
            b = rows[r].body[side]
            if b >= 0:
                respond(bodies, b, rows[r].J[side], rows[r].Z[side])
                for c in range(6):
                    A[r, 0] += rows[r].J[side, c] * rows[r].Z[side, c]
    for k in range(model.pairs.shape[0]):
        r, q = model.pairs[k, 0], model.pairs[k, 1]
        a, b = model.pairs[k, 2], model.pairs[k, 3]
        value = 0.0
        if rows[r].body[a] >= 0:
            for c in range(6):
                value += rows[r].J[a, c] * rows[q].Z[b, c]
        else:
            for c in range(3):
                value += rows[r].e[c] * rows[q].e[c]
            value /= points[rows[r].point[a]].mass
        A[r, r - q] += value if a == b else -value
    return banded_ldl(A, rows.size, width)


@indirect(void(VECTOR, INTEGERS, MODEL, types.boolean))
def row_velocity_terms(y, s, model, loaded):
    """What the rows' accelerations need without any force: into rx (and rhs of the chains)."""
    rows, markers, bodies = model.rows, model.markers, model.bodies
    for r in range(rows.size):
        k = rows[r].index
        if rows[r].kind == THREAD:
            value = chain.chain_rhs(y, s, model, k, loaded)
            rows[r].rx = value * model.threads[k].copies
            continue
        if rows[r].kind == GUIDE:
            rows[r].rx = -guide_geometry(model.guides, bodies, k)[2]
            continue
        geometry = link_geometry(y, model, k)
        value = geometry[11]
        for side in range(2):
            b = rows[r].body[side]
            if b < 0:
                continue
            m = model.links[k].a if side == 0 else model.links[k].b
            # from the marker, not from a drum's tangent point: the drum's turning is in rJ alone
            local = markers[m].local
            dx, dy, dz = turn(bodies[b].R, local[0], local[1], local[2])
            cx, cy, cz = centripetal(bodies, b, dx, dy, dz)
            part = geometry[2] * cx + geometry[3] * cy + geometry[4] * cz
            value += -part if side == 0 else part
        rows[r].rx = value


@indirect(void(INTEGERS, MODEL))
def solve_rows(s, model):
    """Multipliers la from rx, the bodies' twists a; wrenches and points' forces f with them; chains included."""
    rows, bodies, points = model.rows, model.bodies, model.points
    la = model.la
    n = rows.size
    for r in range(n):
        value = rows[r].rx
        for side in range(2):
            part = 0.0
            b, i = rows[r].body[side], rows[r].point[side]
            if b >= 0:
                for c in range(6):
                    part += rows[r].J[side, c] * bodies[b].a[c]
            elif i >= 0:
                for c in range(3):
                    part += rows[r].e[c] * points[i].f[c] * points[i].compliance
            value += -part if side == 0 else part
        la[r] = value
    banded_ldl_solve(model.A, n, model.info.bandwidth, la)
    for r in range(n):
        if rows[r].kind == THREAD:
            chain.chain_solve(s, model, rows[r].index, la[r])
        for side in range(2):
            sign = la[r] if side == 0 else -la[r]
            b, i = rows[r].body[side], rows[r].point[side]
            if b >= 0:
                for c in range(6):
                    bodies[b].a[c] += sign * rows[r].Z[side, c]
                    bodies[b].F[c] += sign * rows[r].J[side, c]
            elif i >= 0:
                for c in range(3):
                    points[i].f[c] += sign * rows[r].e[c]
