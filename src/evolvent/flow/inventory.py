"""Energy and momentum of a state."""

import numpy as np
from numba import types, void

from evolvent.flow.penalties import add_flexible_inventory
from evolvent.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid, springs, thread
from evolvent.kernels.rotations import cross, turn
from evolvent.model import ELASTIC, H_BODY, H_CARRIED, H_RELEASED, H_WOUND, KINETIC, MODEL, N_INVENTORY, P_ALL


@inlined
def add_momentum(out, at, mass, x, y, z, vx, vy, vz):
    """Angular momentum of a point mass about the inertial origin into out[at : at + 3]."""
    hx, hy, hz = cross(x, y, z, mass * vx, mass * vy, mass * vz)
    out[at] += hx
    out[at + 1] += hy
    out[at + 2] += hz


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def inventory(t, y, s, model, out):
    """Energies and momenta of a state.

    Parameters
    ----------
    out : (N_INVENTORY,) float, output
        kinetic energy, elastic energy (J); angular momentum about the inertial origin of bodies, released and wound
        thread (kg m2/s); linear momentum (kg m/s); the part of the wound thread's angular momentum that bodies carry.
        Wound thread that is not carried is counted in its own angular momentum only. Leaves node positions and
        velocities in the nodes' x, v.
    """
    bodies, points, threads = model.bodies, model.points, model.threads
    for i in range(out.size):
        out[i] = 0.0
    rigid.kinematics(t, y, model)
    if threads.size > 0:
        thread.reels(t, y, s, model)
    for b in range(bodies.size):
        wx, wy, wz = bodies[b].w[0], bodies[b].w[1], bodies[b].w[2]
        if bodies[b].motion == rigid.SPIN:
            rate = y[bodies[b].iv]
            J = bodies[b].spin_inertia
            out[KINETIC] += 0.5 * J * rate * rate
            n = bodies[b].axis
            nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
            out[H_BODY] += J * rate * nx
            out[H_BODY + 1] += J * rate * ny
            out[H_BODY + 2] += J * rate * nz
        elif bodies[b].motion == rigid.FREE:
            m, M, v, x = bodies[b].mass, bodies[b].M, bodies[b].v, bodies[b].x
            out[KINETIC] += 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            add_momentum(out, H_BODY, m, x[0], x[1], x[2], v[0], v[1], v[2])
            for i in range(3):
                out[P_ALL + i] += m * v[i]
                h = M[3 + i, 3] * wx + M[3 + i, 4] * wy + M[3 + i, 5] * wz
                out[KINETIC] += 0.5 * h * bodies[b].w[i]
                out[H_BODY + i] += h
    for i in range(points.size):
        q, v, m = points[i].iq, points[i].iv, points[i].mass
        out[KINETIC] += 0.5 * m * (y[v] * y[v] + y[v + 1] * y[v + 1] + y[v + 2] * y[v + 2])
        add_momentum(out, H_BODY, m, y[q], y[q + 1], y[q + 2], y[v], y[v + 1], y[v + 2])
        for c in range(3):
            out[P_ALL + c] += m * y[v + c]
    if model.springs.size > 0:
        out[ELASTIC] += springs.springs_energy(y, model)
    for p in range(threads.size):
        thread_inventory(y, s, model, p, out)
    if model.flexible.beams.size > 0 or model.info.penalties > 0:
        add_flexible_inventory(t, y, model, out)


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64, VECTOR))
def thread_inventory(y, s, model, p, out):
    """Add thread p, released and wound, to `out` (see `inventory`)."""
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    first, j, body = threads[p].node, s[p], threads[p].body
    copies = float(threads[p].copies)
    if threads[p].kind == thread.SPRINGS:
        thread.spring_points(y, s, threads, nodes, p)
    else:
        thread.chain_points(y, s, model, p)
    part = model.sums[1]  # momenta of this thread, then summed over its copies
    for i in range(N_INVENTORY):
        part[i] = 0.0
    elastic = 0.0
    for i in range(j):
        k = first + i
        x, v, m = nodes[k].x, nodes[k].v, nodes[k].mass
        part[KINETIC] += 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        add_momentum(part, H_RELEASED, m, x[0], x[1], x[2], v[0], v[1], v[2])
        for c in range(3):
            part[P_ALL + c] += m * v[c]
        if threads[p].kind == thread.SPRINGS:
            if i < j - 1:
                dx, dy, dz = x[0] - nodes[k + 1].x[0], x[1] - nodes[k + 1].x[1], x[2] - nodes[k + 1].x[2]
                rest = threads[p].segment
            else:
                dx, dy, dz = x[0] - threads[p].Q[0], x[1] - threads[p].Q[1], x[2] - threads[p].Q[2]
                rest = threads[p].b[0]
            extension = np.sqrt(dx * dx + dy * dy + dz * dz) - rest
            if i < j - 1 or s[threads.size + p] == 0:
                elastic += springs.spring_energy(threads[p].stiffness, extension)
    part[ELASTIC] = elastic
    wound_inventory(s, model, p, part)
    if threads[p].feed == thread.FREE_SPOOL:
        rate = y[threads[p].spool_v]
        part[KINETIC] += 0.5 * threads[p].spool_inertia * rate * rate
    if copies == 1.0:
        for i in range(N_INVENTORY):
            out[i] += part[i]
        return
    n = bodies[body].axis
    nx, ny, nz = turn(bodies[body].R, n[0], n[1], n[2])
    out[KINETIC] += copies * part[KINETIC]
    out[ELASTIC] += copies * part[ELASTIC]
    for at in (H_RELEASED, H_WOUND, P_ALL, H_CARRIED):
        axial = copies * (part[at] * nx + part[at + 1] * ny + part[at + 2] * nz)
        out[at] += axial * nx
        out[at + 1] += axial * ny
        out[at + 2] += axial * nz


@inlined
def wound_inventory(s, model, p, out):
    """Add the wound part of thread p, a ring about the spool's axis (see `thread.carry_wound`), to `out`."""
    threads, bodies = model.threads, model.bodies
    b, r = threads[p].body, threads[p].radius
    x, w = bodies[b].x, bodies[b].w
    m = thread.wound_mass(s, threads, model.nodes, p)
    cx, cy, cz, nx, ny, nz = thread.spool_axis(threads, bodies, p)
    vx, vy, vz = cross(w[0], w[1], w[2], cx, cy, cz)
    vx, vy, vz = bodies[b].v[0] + vx, bodies[b].v[1] + vy, bodies[b].v[2] + vz
    along = w[0] * nx + w[1] * ny + w[2] * nz
    across = 0.5 * m * r * r  # moment of inertia about a diameter
    rate = threads[p].b[1] / r
    for c in range(3):
        n = (nx, ny, nz)[c]
        out[H_WOUND + c] += across * (w[c] + (along + 2.0 * rate) * n)
    add_momentum(out, H_WOUND, m, x[0] + cx, x[1] + cy, x[2] + cz, vx, vy, vz)
    if not threads[p].carried:
        return
    turning = across * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - along * along + 2.0 * (along + rate) ** 2)
    out[KINETIC] += 0.5 * (m * (vx * vx + vy * vy + vz * vz) + turning)
    out[P_ALL] += m * vx
    out[P_ALL + 1] += m * vy
    out[P_ALL + 2] += m * vz
    for c in range(3):
        out[H_CARRIED + c] += out[H_WOUND + c]
