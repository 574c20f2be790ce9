"""Energies and momenta of threads, released and wound."""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.markers import spring_energy
from evolvent.kernels.points import add_angular_momentum
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.thread.chain import chain_points
from evolvent.kernels.thread.moving_energy import moving_inventory
from evolvent.kernels.thread.relaxing import relaxes, relaxing_energy
from evolvent.kernels.thread.spool import INEXTENSIBLE, MOVING, SPRINGS, ring_radius, spool_direction
from evolvent.kernels.thread.springs import is_boundary, natural_segment, spring_points
from evolvent.kernels.thread.wound import reels, spool_axis, wound_mass
from evolvent.model import ELASTIC, H_CARRIED, H_RELEASED, H_WOUND, KINETIC, MODEL, N_INVENTORY, P_ALL

USED_FOR = "threads"


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64, VECTOR))
def thread_inventory(y, s, model, p, out):
    """Add thread p, released and wound, to `out` (see `inventory`)."""
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    first, j, body = threads[p].node, s[p], threads[p].body
    copies = float(threads[p].copies)
    if threads[p].kind == INEXTENSIBLE:
        chain_points(y, s, model, p)
    else:
        spring_points(y, s, threads, nodes, p)
    part = model.sums[1]  # momenta of this thread, then summed over its copies
    for i in range(N_INVENTORY):
        part[i] = 0.0
    elastic = 0.0
    if threads[p].kind == MOVING:
        elastic = moving_inventory(y, p, model, part)
        j = 0
    for i in range(j):
        k = first + i
        x, v, m = nodes[k].x, nodes[k].v, nodes[k].mass
        part[KINETIC] += 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        add_angular_momentum(part, H_RELEASED, m, x[0], x[1], x[2], v[0], v[1], v[2])
        for c in range(3):
            part[P_ALL + c] += m * v[c]
        if threads[p].kind == SPRINGS:
            if i < j - 1:
                dx, dy, dz = x[0] - nodes[k + 1].x[0], x[1] - nodes[k + 1].x[1], x[2] - nodes[k + 1].x[2]
            else:
                dx, dy, dz = x[0] - threads[p].Q[0], x[1] - threads[p].Q[1], x[2] - threads[p].Q[2]
            rest, stiffness = natural_segment(s, threads, p, i)
            extension = math.sqrt(dx * dx + dy * dy + dz * dz) - rest
            if not (i < j - 1 or s[threads.size + p] == 0):
                continue
            if relaxes(threads, p):
                elastic += relaxing_energy(is_boundary(s, threads, p, i), extension, p, k, model)
                continue
            if threads[p].slack != 0:
                extension = max(extension, 0.0)
            elastic += spring_energy(stiffness, extension)
    part[ELASTIC] = elastic
    wound_inventory(s, model, p, part)
    if threads[p].drive == FREE_SPOOL:
        rate, inertia, w = y[threads[p].spool_v], threads[p].spool_inertia, bodies[body].w
        axis = spool_direction(threads, bodies, p)
        part[KINETIC] += 0.5 * inertia * rate * rate
        part[KINETIC] += inertia * rate * (w[0] * axis[0] + w[1] * axis[1] + w[2] * axis[2])
        for c in range(3):
            part[H_WOUND + c] += inertia * rate * axis[c]
            part[H_CARRIED + c] += inertia * rate * axis[c]
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
    """Add the wound part of thread p, a ring about the spool's axis (see `wound.carry_wound`), to `out`."""
    threads, bodies = model.threads, model.bodies
    b, r = threads[p].body, ring_radius(s, threads, p)
    x, w = bodies[b].x, bodies[b].w
    m = wound_mass(s, threads, model.nodes, p)
    cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
    vx, vy, vz = cross(w[0], w[1], w[2], cx, cy, cz)
    vx, vy, vz = bodies[b].v[0] + vx, bodies[b].v[1] + vy, bodies[b].v[2] + vz
    along = w[0] * nx + w[1] * ny + w[2] * nz
    across = 0.5 * m * r * r  # moment of inertia about a diameter
    rate = threads[p].b[1] / threads[p].r
    for c in range(3):
        n = (nx, ny, nz)[c]
        out[H_WOUND + c] += across * (w[c] + (along + 2.0 * rate) * n)
    add_angular_momentum(out, H_WOUND, m, x[0] + cx, x[1] + cy, x[2] + cz, vx, vy, vz)
    if not threads[p].carried:
        return
    for c in range(3):
        out[H_CARRIED + c] += out[H_WOUND + c]
    turning = across * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - along * along + 2.0 * (along + rate) ** 2)
    out[KINETIC] += 0.5 * (m * (vx * vx + vy * vy + vz * vz) + turning)
    out[P_ALL] += m * vx
    out[P_ALL + 1] += m * vy
    out[P_ALL + 2] += m * vz


@indirect(void(REAL, VECTOR, MODEL, VECTOR))
def add_thread_energies(t, y, model, out):
    """out : (2,) += kinetic and elastic energy of all threads under an implicit method, J, after `kinematics`."""
    sums = model.sums[0]
    reels(t, y, model.switches, model)
    for i in range(sums.size):
        sums[i] = 0.0
    for p in range(model.threads.size):
        thread_inventory(y, model.switches, model, p, sums)
    out[0] += sums[KINETIC]
    out[1] += sums[ELASTIC]
