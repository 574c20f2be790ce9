"""Rows of constraint of explicit methods: joints between bodies and point masses, and boundary segments of threads.

Each row has one multiplier la, of a thread the tension of its boundary segment, and up to two sides, each a body, a
point mass or nothing: forces are la J on the first one, -la J on the second. The rows that share a side are coupled;
the coupled system A la = r is symmetric and banded.
"""

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import joint, thread as chain
from evolvent.kernels.linalg import banded_ldl, banded_ldl_solve
from evolvent.kernels.rigid import add_wrench, centripetal, respond
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.sides import ON_BODY
from evolvent.model import MODEL

THREAD, JOINT = 0, 1
#: Kinds of guides.
CENTRE, AXIS = 0, 1


@inlined
def has_joints(model):
    """Whether a joint is among the rows."""
    found = False
    for r in range(model.rows.size):
        found = found or model.rows[r].kind == JOINT
    return found


@indirect(void(REAL, VECTOR, types.int64, MODEL))
def _add_joint_row(t, y, r, model):
    """Directions of the joint of row r on its sides, and the part of A that is of points."""
    rows, bodies, points, joints, k = model.rows, model.bodies, model.points, model.flexible.joints, model.rows[r].index
    joint.joint_geometry(t, y, k, model)
    u, g, kind, J = joints[k].u, joints[k].g, joints[k].kind, rows[r].J
    if kind == joint.ANGLE:
        b = rows[r].body[1]
        n = bodies[b].axis
        J[1, 3], J[1, 4], J[1, 5] = turn(bodies[b].R, n[0], n[1], n[2])
        return
    rows[r].e[0], rows[r].e[1], rows[r].e[2] = g[1, 0], g[1, 1], g[1, 2]
    for side in range(joint.side_count(kind)):
        to = side if side < 2 else (0 if joints[k].index[2] == rows[r].body[0] else 1)
        b, sign = rows[r].body[to], -1.0 if to == 0 else 1.0
        gx, gy, gz = sign * g[side, 0], sign * g[side, 1], sign * g[side, 2]
        if b < 0:
            model.A[r, 0] += 1.0 / points[rows[r].point[to]].mass
        elif kind == joint.DIRECTION or side == 2:
            tx, ty, tz = cross(u[side, 0], u[side, 1], u[side, 2], gx, gy, gz)
            J[to, 3] += tx
            J[to, 4] += ty
            J[to, 5] += tz
        else:
            x = bodies[b].x
            add_wrench(J[to], u[side, 0] - x[0], u[side, 1] - x[1], u[side, 2] - x[2], gx, gy, gz)


@inlined
def _second_rate(k, model):
    """Second derivative of the gap of joint k without accelerations, after `joint.joint_geometry`."""
    joints, bodies, value = model.flexible.joints, model.bodies, model.flexible.joints[k].bends
    if joints[k].kind == joint.ANGLE:
        return value
    for side in range(joint.side_count(joints[k].kind)):
        if joints[k].on[side] != ON_BODY:
            continue
        b, g, local = joints[k].index[side], joints[k].g[side], joints[k].local[side]
        if joints[k].kind == joint.CORD and side == 0:  # not from where the cord leaves, which turns not with the drum
            local = joints[k].centre
        dx, dy, dz = turn(bodies[b].R, local[0], local[1], local[2])
        cx, cy, cz = centripetal(bodies, b, dx, dy, dz)
        value += g[0] * cx + g[1] * cy + g[2] * cz
    return value


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL))
def build_rows(t, y, s, model):
    """Directions, generalised directions J, responses Z and the factored matrix A of all rows.

    Returns -1, or the first row that the rows before it already imply. A joint that does not hold has no direction.
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
        elif joint.acts(t, s, model.flexible.joints, k):
            _add_joint_row(t, y, r, model)
        else:
            A[r, 0] = 1.0
            rows[r].e[0] = rows[r].e[1] = rows[r].e[2] = 0.0
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


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, types.boolean))
def row_velocity_terms(t, y, s, model, loaded):
    """What the rows' accelerations need without any force: into rx (and rhs of the chains); after `build_rows`."""
    rows = model.rows
    for r in range(rows.size):
        k = rows[r].index
        if rows[r].kind == THREAD:
            rows[r].rx = chain.chain_rhs(y, s, model, k, loaded) * model.threads[k].copies
        else:
            rows[r].rx = _second_rate(k, model) if joint.acts(t, s, model.flexible.joints, k) else 0.0


@inlined
def driven_power(t, s, model):
    """Power of what drives joints, by the last multipliers, W."""
    rows, joints, power = model.rows, model.flexible.joints, 0.0
    for r in range(rows.size):
        k = rows[r].index
        if rows[r].kind == JOINT and joints[k].path != joint.STILL and joint.acts(t, s, joints, k):
            power += model.la[r] * joints[k].driven
    return power


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
