"""Beams against surfaces: all contact points of a model, their forces, tangents and what a step leaves behind."""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels import contact_laws, layers, rigid, surfaces
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_relative, add_relative_body, body_columns
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.model import MODEL

#: Depth of a contact, of the cylinder's radius, at which the bound of the explicit step takes its stiffness.
DEPTH = 1e-3


@indirect(void(VECTOR, REAL, MODEL, VECTOR))
def add_contacts(y, step, model, F):
    """Forces of all contacts into F and the bodies' wrenches; fills cylinders and contact points.

    Parameters
    ----------
    step : float, s, length of the step that ends in the state y; 0 where a run begins; below 0 without steps (statics,
        explicit methods)

    Notes
    -----
    Forces are those of the state y: the law CONSERVATIVE, which takes the mean over a step, acts as HUNT_CROSSLEY. Of a
    cylinder: F, force and torque on its body at the body's origin; normal, the sum of the normal forces; energy; power
    that normal damping takes; touching, the number of contact points that overlap it.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    cylinders, contacts = flexible.cylinders, flexible.contact_points
    for k in range(cylinders.size):
        if cylinders[k].under >= 0:
            layers.add_layers(y, step, model, k, F)
            continue
        body = cylinders[k].body
        R, X, V, w = bodies[body].R, bodies[body].x, bodies[body].v, bodies[body].w
        o, axis, G = cylinders[k].centre, cylinders[k].axis, cylinders[k].F
        cx, cy, cz = turn(R, o[0], o[1], o[2])
        cx, cy, cz = cx + X[0], cy + X[1], cz + X[2]
        ax, ay, az = turn(R, axis[0], axis[1], axis[2])
        radius, half, law = cylinders[k].radius, cylinders[k].half_length, cylinders[k].law
        surface = cylinders[k].surface
        stiffness, exponent, damping = cylinders[k].stiffness, cylinders[k].exponent, cylinders[k].damping
        mu = cylinders[k].friction
        for i in range(6):
            G[i] = 0.0
        normal = energy = power = touching = 0.0
        element, near = -1, False
        for i in range(cylinders[k].first, cylinders[k].last):
            iq = contacts[i].iq
            if contacts[i].element != element:
                element = contacts[i].element
                near = False
                for j in (0, 2):
                    at, reach = iq[j], contacts[i].reach
                    near = near or surfaces.may_touch(
                        surface, y[at], y[at + 1], y[at + 2], reach, cx, cy, cz, ax, ay, az, radius, half
                    )
            contact_laws.clear_point(contacts[i])
            if not near:
                continue
            x, yy, z = contact_laws.point_position(y, iq, contacts[i].S)
            gap, nx, ny, nz, distance = surfaces.gap_to(surface, x, yy, z, cx, cy, cz, ax, ay, az, radius, half)
            contacts[i].gap1 = gap
            if gap >= 0.0:
                continue
            vx, vy, vz = contact_laws.point_position(y, contacts[i].iv, contacts[i].S)
            dx, dy, dz = x - X[0], yy - X[1], z - X[2]
            bx, by, bz = cross(w[0], w[1], w[2], dx, dy, dz)
            rate = nx * (vx - V[0] - bx) + ny * (vy - V[1] - by) + nz * (vz - V[2] - bz)
            force, d_gap, d_rate = contact_laws.pushing_force(
                law, gap, rate, contacts[i].gap, stiffness, exponent, damping, contacts[i].viscous
            )
            contacts[i].force, contacts[i].distance = force, distance
            contacts[i].d_gap, contacts[i].d_rate = d_gap, d_rate
            n, f = contacts[i].n, contacts[i].f
            n[0], n[1], n[2] = nx, ny, nz
            fx, fy, fz = force * nx, force * ny, force * nz
            if mu > 0.0:
                tx, ty, tz, stored = friction_force(
                    contacts[i], cylinders[k], R, (dx, dy, dz), (nx, ny, nz), force, step
                )
                fx, fy, fz = fx + tx, fy + ty, fz + tz
                energy += stored
            f[0], f[1], f[2] = fx, fy, fz
            energy += contact_laws.contact_energy(gap, stiffness, exponent)
            contacts[i].damper1 = force - contact_laws.elastic_force(gap, stiffness, exponent)[0]
            power -= contacts[i].damper1 * rate
            touching += 1.0
            normal += force
            for j in range(4):
                at, s = contacts[i].iv[j] - n_q, contacts[i].S[j]
                F[at] -= s * fx
                F[at + 1] -= s * fy
                F[at + 2] -= s * fz
            rigid.add_wrench(G, dx, dy, dz, -fx, -fy, -fz)
        for i in range(6):
            bodies[body].F[i] += G[i]
        cylinders[k].normal, cylinders[k].energy, cylinders[k].power = normal, energy, power
        cylinders[k].touching = touching


@inlined
def friction_force(point, cylinder, R, place, normal, force, step):
    """Friction on a contact point by its normal force, N, and the energy of its bristle, J: (x, y, z, energy).

    Parameters
    ----------
    point : record of the contact point, whose bristle and tangent are filled in
    cylinder : record; R : (3, 3) float, rotation of its body
    point, normal : 3 floats each, of the point from the body's origin, and out of the cylinder; inertial axes
    """
    nx, ny, nz = normal
    sx, sy, sz = 0.0, 0.0, 0.0
    if step > 0.0:
        q = point.anchor
        px, py, pz = turn(R, q[0], q[1], q[2])
        sx, sy, sz = contact_laws.tangential(place[0] - px, place[1] - py, place[2] - pz, nx, ny, nz)
    q = point.stick
    ux, uy, uz = turn(R, q[0], q[1], q[2])
    ux, uy, uz = contact_laws.tangential(ux, uy, uz, nx, ny, nz)
    found = contact_laws.friction(
        ux, uy, uz, sx, sy, sz, force, cylinder.friction,
        cylinder.stick_stiffness, cylinder.stick_damping if step > 0.0 else 0.0, step,
    )  # fmt: skip
    q, d, t = point.stick1, point.drag1, point.t
    q[0], q[1], q[2] = turn_back(R, found[3], found[4], found[5])
    d[0], d[1], d[2] = found[0], found[1], found[2]
    t[0], t[1], t[2] = found[8], found[9], found[10]
    point.along, point.across, point.by_normal = found[11], found[12], found[13]
    stored = 0.5 * cylinder.stick_stiffness * (found[3] ** 2 + found[4] ** 2 + found[5] ** 2)
    return found[0], found[1], found[2], stored


@indirect(void(VECTOR, REAL, MODEL, SPARSE))
def add_contact_tangents(y, c_rate, model, matrix):
    """Tangents of all contacts, c_rate times the derivatives by velocity included."""
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    cylinders, contacts = flexible.cylinders, flexible.contact_points
    J, K, W = flexible.J[1], flexible.K12, flexible.K24
    for r in range(12):
        for c in range(12):
            W[r, c] = 0.0
    for k in range(cylinders.size):
        if cylinders[k].under >= 0:
            layers.add_layer_tangents(k, c_rate, model, matrix)
            continue
        body = cylinders[k].body
        moves = bodies[body].motion != rigid.DRIVEN
        R, X, V, w, axis = bodies[body].R, bodies[body].x, bodies[body].v, bodies[body].w, cylinders[k].axis
        ax, ay, az = turn(R, axis[0], axis[1], axis[2])
        o, surface, half = cylinders[k].centre, cylinders[k].surface, cylinders[k].half_length
        cx, cy, cz = turn(R, o[0], o[1], o[2])
        last = -1  # contact point whose element's sum is in W
        for i in range(cylinders[k].first, cylinders[k].last):
            force = contacts[i].force
            if force == 0.0 or contacts[i].gap1 == math.inf:
                continue
            n, t = contacts[i].n, contacts[i].t
            x, yy, z = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
            vx, vy, vz = contact_laws.point_position(y, contacts[i].iv, contacts[i].S)
            dx, dy, dz = x - X[0], yy - X[1], z - X[2]
            u = (dx - cx) * ax + (dy - cy) * ay + (dz - cz) * az
            H = surfaces.curvature(surface, u, half, n[0], n[1], n[2], ax, ay, az, contacts[i].distance)
            bx, by, bz = cross(w[0], w[1], w[2], dx, dy, dz)
            vx, vy, vz = vx - V[0] - bx, vy - V[1] - by, vz - V[2] - bz
            turned = (
                H[0] * vx + H[3] * vy + H[4] * vz,
                H[3] * vx + H[1] * vy + H[5] * vz,
                H[4] * vx + H[5] * vy + H[2] * vz,
            )
            normal, d_rate = contacts[i].d_gap + c_rate * contacts[i].d_rate, contacts[i].d_rate
            along, across, by_normal = contacts[i].along, contacts[i].across, contacts[i].by_normal
            # minus d(force)/dx; friction follows the normal force
            for a in range(3):
                for b in range(3):
                    nn, tt = n[a] * n[b], t[a] * t[b]
                    same = 1.0 if a == b else 0.0
                    h = H[a] if a == b else H[2 + a + b]
                    change = normal * n[b] + d_rate * turned[b]
                    K[a, b] = along * tt + across * (same - nn - tt) - force * h - (n[a] - by_normal * t[a]) * change
            if last >= 0 and contacts[last].element != contacts[i].element:
                add_sum(matrix, contacts[last].iv, n_q, W)
            last = i
            add_share(W, contacts[i].S, K)
            if not moves:
                continue
            q = flexible.e[2]
            q[0], q[1], q[2] = turn_back(R, dx, dy, dz)
            body_columns(model, body, q, True, J)
            f = (-contacts[i].f[0], -contacts[i].f[1], -contacts[i].f[2])
            for p in range(4):
                row = contacts[i].iv[p] - n_q
                add_relative(matrix, model, body, J, K, f, row, contacts[i].S[p])
            add_relative_body(matrix, model, body, True, J, K, f)
        if last >= 0:
            add_sum(matrix, contacts[last].iv, n_q, W)


@inlined
def add_share(W, S, K):
    """Add the tangent K of a contact point with the shape functions S to its element's sum W."""
    for p in range(4):
        for q in range(4):
            s = S[p] * S[q]
            for a in range(3):
                for b in range(3):
                    W[3 * p + a, 3 * q + b] += s * K[a, b]


@kernel
def add_sum(matrix, iv, n_q, W):
    """Add the sum of the tangents of an element's contact points, by the two vectors of each of its nodes; clear it."""
    for r in (0, 2):
        for c in (0, 2):
            add_block(matrix, iv[r] - n_q, iv[c] - n_q, W, 3 * r, 3 * c, 6, 6, 1.0)
    for r in range(12):
        for c in range(12):
            W[r, c] = 0.0


@indirect(types.UniTuple(REAL, 2)(VECTOR, MODEL))
def end_contact_step(y, model):
    """Make the end of a step the start of the next; returns what friction and normal damping took, J.

    Notes
    -----
    Friction takes the work of its force over the step less what the bristles keep, -F . s - (U1 - U0), with the mean F
    of both ends as of the work of all else: with the force of the end alone the energy balance would gain in proportion
    to the step.
    """
    flexible, bodies = model.flexible, model.bodies
    cylinders, contacts = flexible.cylinders, flexible.contact_points
    slip = damped = 0.0
    for k in range(cylinders.size):
        body = cylinders[k].body
        R, X, mu = bodies[body].R, bodies[body].x, cylinders[k].friction
        for i in range(cylinders[k].first, cylinders[k].last):
            gap, gap1 = contacts[i].gap, contacts[i].gap1
            if math.isfinite(gap) and math.isfinite(gap1):
                damped -= 0.5 * (contacts[i].damper + contacts[i].damper1) * (gap1 - gap)
            contacts[i].gap, contacts[i].damper = gap1, contacts[i].damper1
            if mu > 0.0 and cylinders[k].under >= 0:  # along the turn below and the axis; anchor: displacement
                q, u, u1, d, d1 = (
                    contacts[i].anchor,
                    contacts[i].stick,
                    contacts[i].stick1,
                    contacts[i].drag,
                    contacts[i].drag1,
                )
                for c in range(2):
                    new = u1[c] if contacts[i].force > 0.0 else 0.0
                    slip -= 0.5 * (d[c] + d1[c]) * q[c]
                    slip += 0.5 * cylinders[k].stick_stiffness * (u[c] * u[c] - new * new)
                    d[c], u[c] = d1[c], new
            elif mu > 0.0:
                x, yy, z = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
                q, u, u1 = contacts[i].anchor, contacts[i].stick, contacts[i].stick1
                x, yy, z = turn_back(R, x - X[0], yy - X[1], z - X[2])
                d, d1 = contacts[i].drag, contacts[i].drag1
                fx, fy, fz = turn_back(R, d1[0], d1[1], d1[2])
                slip -= 0.5 * ((d[0] + fx) * (x - q[0]) + (d[1] + fy) * (yy - q[1]) + (d[2] + fz) * (z - q[2]))
                q[0], q[1], q[2] = x, yy, z
                d[0], d[1], d[2] = fx, fy, fz
                half = 0.5 * cylinders[k].stick_stiffness
                slip += half * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
                for c in range(3):
                    u[c] = u1[c] if contacts[i].force > 0.0 else 0.0
                slip -= half * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        if cylinders[k].under >= 0:
            layers.end_layer_step(y, model, k)
    return slip, damped


@indirect(types.int64(MODEL))
def count_touching(model):
    """Sum over cylinders of contact points that overlap them, weighted by their index: changes where the set does."""
    cylinders, contacts = model.flexible.cylinders, model.flexible.contact_points
    total = 0
    for k in range(cylinders.size):
        for i in range(cylinders[k].first, cylinders[k].last):
            if contacts[i].gap1 < 0.0:
                total += 1 + 7919 * i
    return total


@inlined
def write_friction(point, out):
    """Friction on a contact point, N, of the last forces: out : (3,)."""
    f, n = point.f, point.n
    for i in range(3):
        out[i] = f[i] - point.force * n[i] if point.force > 0.0 else 0.0


def friction_values(points):
    """Friction (n, 3) on contact points, N: that of `write_friction`. Not compiled."""
    pressed = (points["force"] > 0.0)[:, None]
    return np.where(pressed, points["f"] - points["force"][:, None] * points["n"], 0.0)


def contact_bound(flexible):
    """Stiffness (N/m) and damping (N s/m) of all contact points in contact: (2, points) float. Not compiled.

    Of laws with an exponent above 1 the stiffness is that at the depth `DEPTH`.
    """
    found = np.zeros((2, flexible.contact_points.size))
    for row in flexible.cylinders:
        inside = slice(row["first"], row["last"])
        found[0, inside] += row["exponent"] * row["stiffness"] * (DEPTH * row["radius"]) ** (row["exponent"] - 1.0)
        if row["law"] == contact_laws.PAPER:
            found[1, inside] += row["damping"]
    return found
