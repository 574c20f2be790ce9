"""The equations of motion as implicit solvers need them: M a + F(t, y, la) = 0 with constraints, and their tangent.

Unknowns stand in the order of `Flexible.place`, then one multiplier for each joint (a penalty's is no unknown: its
equation is la = 0).
"""

import math

from evolvent.jit import inlined, kernel
from evolvent.kernels import blocks, couplings, flexible, loads, rigid, springs, touch
from evolvent.kernels.couplings import ON_BODY, ON_COORDINATES, add_entry, add_product, add_turning, side_columns
from evolvent.kernels.rotations import cross, turn_back

#: What `residual` writes into `powers`: powers dissipated (W), power of loads at markers (W), energies of hinges and
#: penalties (J), power of spools (W), and what the beams' loads are left out of.
MASS_DAMPING, STIFFNESS_DAMPING, SPRINGS, JOINTS, MARKER_LOADS, COUPLED_ENERGY, SPOOLS, N_POWERS = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
)


@kernel
def residual(t, y, a, la, step, factor, model, r, powers):
    """r = M a + F and the constraints' gaps, in the order of the unknowns.

    Parameters
    ----------
    y : (ny,) float, state; a : (nv,) float, accelerations; la : (nj,) float, multipliers
    step : float, s, of the step that ends here, 0 for none
    factor : float, of all loads on beams and of gravity
    r : (nv + nj,) float, output
    powers : (N_POWERS,) float, output
    """
    info, bodies, points, f = model.info[0], model.bodies, model.points, model.flexible
    n_q, n_v = info.nq, info.nv
    F, P, joints = f.F, f.P, f.joints
    for i in range(n_v):
        F[i] = 0.0
        P[i] = 0.0
    for i in range(N_POWERS):
        powers[i] = 0.0
    rigid.kinematics(t, y, bodies)
    for i in range(points.size):
        for c in range(3):
            points[i].f[c] = 0.0
    if f.cells.size > 0:
        powers[MASS_DAMPING], powers[STIFFNESS_DAMPING] = flexible.add_cells(y, a, n_q, f, F)
        flexible.add_pushes(t, y, n_q, f, factor, P)
        touch.add_contacts(y, step, n_q, f, bodies, F)
    add_weight(info.gravity, factor, n_q, model, P)
    if model.springs.size > 0:
        lost, given = springs.spring_forces(t, y, model.springs, model.markers, points, bodies, model.parameters)
        powers[SPRINGS] += lost
        powers[MARKER_LOADS] += given
    if model.loads.size > 0:
        powers[MARKER_LOADS] += loads.concentrated_loads(
            t, y, model.loads, model.markers, points, bodies, model.parameters
        )
    if f.hinges.size > 0:
        energy, lost = couplings.add_hinges(y, n_q, f, bodies, F)
        powers[COUPLED_ENERGY] += energy
        powers[JOINTS] += lost
    for k in range(joints.size):
        couplings.joint_geometry(t, y, k, f, bodies, model.parameters)
        if not couplings.holds(t, joints, k):
            r[n_v + k] = la[k]
        elif joints[k].stiffness > 0.0:
            gap, rate = joints[k].gap, joints[k].rate
            couplings.add_joint_force(k, joints[k].stiffness * gap + joints[k].damping * rate, n_q, f, bodies, F)
            powers[COUPLED_ENERGY] += 0.5 * joints[k].stiffness * gap * gap
            powers[JOINTS] += joints[k].damping * rate * rate
            r[n_v + k] = la[k]
        else:
            couplings.add_joint_force(k, la[k], n_q, f, bodies, F)
            r[n_v + k] = joints[k].gap
    for i in range(points.size):
        at = points[i].iv - n_q
        for c in range(3):
            F[at + c] += points[i].mass * a[at + c] - points[i].f[c]
    for b in range(bodies.size):
        at, G = bodies[b].iv - n_q, bodies[b].F
        if bodies[b].motion == rigid.SPIN:
            n = bodies[b].axis
            x, yy, z = turn_back(bodies[b].R, G[3], G[4], G[5])
            F[at] += bodies[b].spin_inertia * a[at] - (n[0] * x + n[1] * yy + n[2] * z)
        elif bodies[b].motion == rigid.FREE:
            x, yy, z = turn_back(bodies[b].R, G[3], G[4], G[5])
            torque, J = (x, yy, z), bodies[b].inertia
            for c in range(3):
                F[at + c] += bodies[b].mass * a[at + c] - G[c]
                F[at + 3 + c] -= torque[c]
                for d in range(3):
                    F[at + 3 + c] += J[c, d] * a[at + 3 + d]
    place = f.place
    for i in range(n_v):
        r[place[i]] = F[i] - P[i]


@kernel
def add_weight(gravity, factor, n_q, model, P):
    """Weight of everything that moves , times `factor`, into the loads P."""
    if gravity[0] == 0.0 and gravity[1] == 0.0 and gravity[2] == 0.0:
        return
    bodies, points = model.bodies, model.points
    flexible.add_gravity(gravity, factor, n_q, model.flexible, P)
    for i in range(points.size):
        for c in range(3):
            P[points[i].iv - n_q + c] += factor * points[i].mass * gravity[c]
    for b in range(bodies.size):
        if bodies[b].motion == rigid.FREE:
            for c in range(3):
                P[bodies[b].iv - n_q + c] += factor * bodies[b].mass * gravity[c]


@kernel
def tangent(t, y, la, c_mass, c_rate, scale, model, matrix):
    """matrix = c_mass M + c_rate dF/dv + dF/dq, bordered by `scale` times the constraints; after `residual` only.

    Left out are what only slows Newton's method: how a body's turn changes velocities of its points, the field's own
    dependence on the shape, and the derivatives of user's laws.
    """
    info, bodies, points, f = model.info[0], model.bodies, model.points, model.flexible
    n_q = info.nq
    joints, place = f.joints, f.place
    blocks.clear(matrix)
    if f.cells.size > 0:
        flexible.add_cell_tangents(y, n_q, f, c_mass, c_rate, matrix)
        touch.add_contact_tangents(y, n_q, f, bodies, c_rate, matrix)
        _pad(f, matrix)
    if model.springs.size > 0:
        _spring_tangents(y, n_q, model, c_rate, matrix)
    if f.hinges.size > 0:
        couplings.add_hinge_tangents(y, n_q, f, bodies, c_rate, matrix)
    first = matrix.A.shape[0] * matrix.A.shape[1] + matrix.counts[blocks.BORDER] - joints.size
    for k in range(joints.size):
        row = first + k
        if not couplings.holds(t, joints, k):
            add_entry(matrix, row, row, scale * scale)
            continue
        stiffness = joints[k].stiffness
        if stiffness > 0.0:
            force = stiffness * joints[k].gap + joints[k].damping * joints[k].rate
            total = stiffness + c_rate * joints[k].damping
            couplings.add_joint_tangent(k, force, -1, 0.0, total, n_q, f, bodies, matrix)
            add_entry(matrix, row, row, scale * scale)
        else:
            couplings.add_joint_tangent(k, la[k], row, scale, 0.0, n_q, f, bodies, matrix)
    for i in range(points.size):
        at = place[points[i].iv - n_q]
        for c in range(3):
            add_entry(matrix, at + c, at + c, c_mass * points[i].mass)
    for b in range(bodies.size):
        if bodies[b].motion == rigid.SPIN:
            at = place[bodies[b].iv - n_q]
            add_entry(matrix, at, at, c_mass * bodies[b].spin_inertia)
        elif bodies[b].motion == rigid.FREE:
            at = place[bodies[b].iv - n_q]
            J, v = bodies[b].inertia, bodies[b].iv + 3
            w = y[v], y[v + 1], y[v + 2]
            h = (
                J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2],
                J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2],
                J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2],
            )
            for c in range(3):
                add_entry(matrix, at + c, at + c, c_mass * bodies[b].mass)
                x, yy, z = cross(w[0], w[1], w[2], J[0, c], J[1, c], J[2, c])
                ex, ey, ez = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
                hx, hy, hz = cross(ex, ey, ez, h[0], h[1], h[2])
                add_entry(matrix, at + 3, at + 3 + c, c_mass * J[0, c] + c_rate * (x + hx))
                add_entry(matrix, at + 4, at + 3 + c, c_mass * J[1, c] + c_rate * (yy + hy))
                add_entry(matrix, at + 5, at + 3 + c, c_mass * J[2, c] + c_rate * (z + hz))


@inlined
def _pad(f, matrix):
    """Ones for the unknowns that a node with fewer vectors leaves in its block."""
    m = matrix.A.shape[1]
    for k in range(f.beams.size):
        size = 3 * (2 if f.beams[k].kind == flexible.CABLE else 4)
        for b in range(f.beams[k].block, f.beams[k].block + f.beams[k].nodes):
            for r in range(size, m):
                matrix.A[b, r, m + r] = 1.0


@kernel
def _spring_tangents(y, n_q, model, c_rate, matrix):
    """Tangents of all springs that have a stiffness (a user's law has none here)."""
    bodies, points, f = model.bodies, model.points, model.flexible
    place, Ja, Jb = f.place, f.J[0], f.J[1]
    for k in range(model.springs.size):
        ma, mb = model.springs[k].a, model.springs[k].b
        a = springs.marker_kinematics(y, model.markers, points, bodies, ma)
        b = springs.marker_kinematics(y, model.markers, points, bodies, mb)
        dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        nx, ny, nz = dx / length, dy / length, dz / length
        rate = nx * (b[3] - a[3]) + ny * (b[4] - a[4]) + nz * (b[5] - a[5])
        elastic, damped = springs.spring_tension(model.springs, k, length - model.springs[k].length, rate, 0.0,
                                                 model.parameters)  # fmt: skip
        tension = elastic + damped
        along = model.springs[k].stiffness + c_rate * model.springs[k].damping
        across = tension / length
        p = along - across
        K00, K11, K22 = across + p * nx * nx, across + p * ny * ny, across + p * nz * nz
        K01, K02, K12 = p * nx * ny, p * nx * nz, p * ny * nz
        sideways = model.springs[k].lateral_stiffness + c_rate * model.springs[k].lateral_damping
        if sideways != 0.0:
            u = model.springs[k].axis
            K00 += sideways * (1.0 - u[0] * u[0])
            K11 += sideways * (1.0 - u[1] * u[1])
            K22 += sideways * (1.0 - u[2] * u[2])
            K01 -= sideways * u[0] * u[1]
            K02 -= sideways * u[0] * u[2]
            K12 -= sideways * u[1] * u[2]
        ra, na = _marker_columns(model, ma, n_q, place, Ja)
        rb, nb = _marker_columns(model, mb, n_q, place, Jb)
        add_product(matrix, ra, na, Ja, K00, K01, K02, K11, K12, K22, ra, na, Ja, 1.0)
        add_product(matrix, rb, nb, Jb, K00, K01, K02, K11, K12, K22, rb, nb, Jb, 1.0)
        add_product(matrix, ra, na, Ja, K00, K01, K02, K11, K12, K22, rb, nb, Jb, -1.0)
        add_product(matrix, rb, nb, Jb, K00, K01, K02, K11, K12, K22, ra, na, Ja, -1.0)
        for side in range(2):
            marker, sign = (ma, -1.0) if side == 0 else (mb, 1.0)
            if model.markers[marker].kind == springs.ON_BODY:
                s = sign * tension
                add_turning(
                    matrix, bodies, place, n_q, model.markers[marker].index, model.markers[marker].local,
                    s * nx, s * ny, s * nz,
                )  # fmt: skip


@inlined
def _marker_columns(model, marker, n_q, place, J):
    """Columns of a marker: its first unknown and their number."""
    index = model.markers[marker].index
    if model.markers[marker].kind == springs.ON_POINT:
        return side_columns(
            model.bodies, place, n_q, ON_COORDINATES, -1, model.points[index].iv, model.markers[marker].local, True, J
        )
    return side_columns(model.bodies, place, n_q, ON_BODY, index, -1, model.markers[marker].local, True, J)


@kernel
def energies(t, y, model, out):
    """out : (3,) = kinetic and elastic energy of everything, and the part of bending in cables, J.

    Contacts, hinges and penalties are those of the last `residual`.
    """
    bodies, points, f = model.bodies, model.points, model.flexible
    for i in range(3):
        out[i] = 0.0
    flexible.beam_energies(y, f, out)
    for b in range(bodies.size):
        v = bodies[b].iv
        if bodies[b].motion == rigid.SPIN:
            out[0] += 0.5 * bodies[b].spin_inertia * y[v] * y[v]
        elif bodies[b].motion == rigid.FREE:
            J = bodies[b].inertia
            for c in range(3):
                out[0] += 0.5 * bodies[b].mass * y[v + c] * y[v + c]
                for d in range(3):
                    out[0] += 0.5 * y[v + 3 + c] * J[c, d] * y[v + 3 + d]
    for i in range(points.size):
        v = points[i].iv
        out[0] += 0.5 * points[i].mass * (y[v] * y[v] + y[v + 1] * y[v + 1] + y[v + 2] * y[v + 2])
    for k in range(model.springs.size):
        if model.springs[k].law == 0:
            a = springs.marker_kinematics(y, model.markers, points, bodies, model.springs[k].a)
            b = springs.marker_kinematics(y, model.markers, points, bodies, model.springs[k].b)
            dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            extension = math.sqrt(dx * dx + dy * dy + dz * dz) - model.springs[k].length
            out[1] += springs.spring_energy(model.springs[k].stiffness, extension)
            out[1] += springs.lateral_energy(model.springs, k, dx, dy, dz)
    for k in range(f.cylinders.size):
        out[1] += f.cylinders[k].energy


@kernel
def momenta(y, model, out):
    """out : (6,) = linear momentum (kg m/s) and angular momentum about the inertial origin (kg m2/s)."""
    bodies, points = model.bodies, model.points
    for i in range(6):
        out[i] = 0.0
    P, H = out[:3], out[3:]
    flexible.beam_momenta(y, model.flexible, P, H)
    for i in range(points.size):
        q, v, m = points[i].iq, points[i].iv, points[i].mass
        hx, hy, hz = cross(y[q], y[q + 1], y[q + 2], m * y[v], m * y[v + 1], m * y[v + 2])
        H[0] += hx
        H[1] += hy
        H[2] += hz
        for c in range(3):
            P[c] += m * y[v + c]
    for b in range(bodies.size):
        R, v = bodies[b].R, bodies[b].iv
        if bodies[b].motion == rigid.FREE:
            q, m, J = bodies[b].iq, bodies[b].mass, bodies[b].inertia
            hx, hy, hz = cross(y[q], y[q + 1], y[q + 2], m * y[v], m * y[v + 1], m * y[v + 2])
            H[0] += hx
            H[1] += hy
            H[2] += hz
            for c in range(3):
                P[c] += m * y[v + c]
                h = 0.0
                for d in range(3):
                    h += J[c, d] * y[v + 3 + d]
                for d in range(3):
                    H[d] += R[d, c] * h
        elif bodies[b].motion == rigid.SPIN:
            n, h = bodies[b].axis, bodies[b].spin_inertia * y[v]
            for d in range(3):
                H[d] += h * (R[d, 0] * n[0] + R[d, 1] * n[1] + R[d, 2] * n[2])
