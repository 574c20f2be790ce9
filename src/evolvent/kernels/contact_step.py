"""Contact points of beams on surfaces over a step that conserves energy; turns on one another: `layer_step`.

The distance p of a point from a cylinder's axis obeys p^2 = d.d - (d.a)^2, d from a point of the axis a. Its change
over a step is (p1 + p0) (p1 - p0) = 2 (dm - sm am) . dd - 2 sm dm . da with means m of both ends, s = d.a: so the force
lam 2 (dm - sm am)/(p0 + p1) on the point, and its reaction on the body, do the work of the gap's change exactly
and keep both momenta; other surfaces: `surfaces.step_position`. With V = K <delta>^(n + 1)/(n + 1), the contact's
energy, its damping d, and the rate (delta1 - delta0)/h

    lam = (V1 - V0)/(delta1 - delta0) (1 + d rate)+     does the work of V's change, less what the damping takes;
    lam = K <delta1>^n (1 + d rate)+                    the force of the step's end, never gives back more than V.

A point in contact at the step's start has the first, which is of second order; one that meets the cylinder has the
second under the law HUNT_CROSSLEY, which is easier to solve and makes a bounce shorter than the step partly plastic,
and the first under CONSERVATIVE.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import contact_laws, rigid, surfaces
from evolvent.kernels.contact import add_share, add_sum
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_relative, add_relative_body, body_columns
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL

_I = types.int64


@inlined
def _frame(bodies, b, o, axis):
    """Point and direction of a cylinder's axis, inertial axes, by the body's current position."""
    cx, cy, cz = turn(bodies[b].R, o[0], o[1], o[2])
    ax, ay, az = turn(bodies[b].R, axis[0], axis[1], axis[2])
    return bodies[b].x[0] + cx, bodies[b].x[1] + cy, bodies[b].x[2] + cz, ax, ay, az


@indirect(void(VECTOR, types.int64, MODEL))
def measure_gaps(y, end, model):
    """Gaps of all contact points by the state y and the bodies' current positions, of a step's end (1) or start (0).

    Of points beyond a cylinder's ends the gap is infinite; one that comes in from there below the surface keeps that
    depth, `rest`, until it is lifted, for it would bring energy. Of a step's end the contacts' energies and the numbers
    of points that touch are summed up as well.
    """
    cylinders, contacts, bodies = model.flexible.cylinders, model.flexible.contact_points, model.bodies
    for k in range(cylinders.size):
        if cylinders[k].under >= 0:
            continue
        cx, cy, cz, ax, ay, az = _frame(bodies, cylinders[k].body, cylinders[k].centre, cylinders[k].axis)
        radius, half, surface = cylinders[k].radius, cylinders[k].half_length, cylinders[k].surface
        energy = touching = 0.0
        for i in range(cylinders[k].first, cylinders[k].last):
            x, yy, z = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
            gap, _, _, _, distance = surfaces.gap_to(surface, x, yy, z, cx, cy, cz, ax, ay, az, radius, half)
            if end == 1:
                contacts[i].gap1, contacts[i].distance = gap, distance
                if math.isfinite(contacts[i].gap):
                    depth = gap + contacts[i].rest
                    energy += contact_laws.contact_energy(depth, cylinders[k].stiffness, cylinders[k].exponent)
                touching += 1.0 if gap < 0.0 else 0.0
                contacts[i].xi1 = (x - cx) * ax + (yy - cy) * ay + (z - cz) * az
            else:
                contacts[i].gap, contacts[i].offset = gap, distance
                contacts[i].xi = (x - cx) * ax + (yy - cy) * ay + (z - cz) * az
        if end == 1:
            cylinders[k].energy, cylinders[k].touching = energy, touching


@inlined
def _pressed(cylinder, viscous, gap0, gap1, h, soft, chi, sank):
    """Normal force over a step, its derivative by the gap at the end, and the filter's part of it.

    Parameters
    ----------
    viscous : float, kg^(1/2), of `contact_laws.sliding_damper`
    chi, sank : float, of the filter, and how far the point sank over the step before, of this step's length, m
    """
    stiffness, exponent = soft * cylinder.stiffness, cylinder.exponent
    if gap0 < 0.0 or cylinder.law == contact_laws.CONSERVATIVE:
        elastic, slope, _ = contact_laws.normal_force(
            contact_laws.CONSERVATIVE, gap1, 0.0, gap0, stiffness, exponent, 0.0
        )
    else:
        elastic, slope = contact_laws.elastic_force(gap1, stiffness, exponent)
    if cylinder.damping != 0.0 and elastic != 0.0 and math.isfinite(gap0):
        factor = 1.0 + cylinder.damping * (gap0 - gap1) / h
        if not factor > 0.0:
            return 0.0, 0.0, 0.0
        elastic, slope = elastic * factor, slope * factor - elastic * cylinder.damping / h
    if viscous != 0.0 and math.isfinite(gap0):
        drag, d_rate = contact_laws.sliding_damper(gap0, gap1, (gap1 - gap0) / h, stiffness, exponent, viscous)
        if elastic + drag <= 0.0:
            return 0.0, 0.0, 0.0
        elastic, slope = elastic + drag, slope + d_rate / h
    filtered = 0.0
    if is_filtered(cylinder, gap0):
        # the change of the depth, whose work is exact also where the point leaves
        part = 1.0 if gap1 < 0.0 else gap0 / (gap0 - gap1)
        k = 0.5 * chi * stiffness
        filtered = k * part * (gap0 - min(gap1, 0.0) - sank)
        if elastic + filtered <= 0.0:
            return 0.0, 0.0, 0.0
        elastic, slope = elastic + filtered, slope - (k if gap1 < 0.0 else filtered / (gap1 - gap0))
    return elastic, slope, filtered


@inlined
def is_filtered(cylinder, gap0):
    """Whether the filter acts on a point: one that is in contact, with a stiffness that is a constant."""
    return cylinder.law == contact_laws.HUNT_CROSSLEY and cylinder.exponent == 1.0 and gap0 < 0.0


@inlined
def _rub(point, cylinder, body, move, arm, normal, lam, h):
    """Friction on a contact point over a step, and the energy of its bristle before and after: (x, y, z, U0, U1).

    Parameters
    ----------
    move : displacement of the point; arm : its mean position from the body's origin; normal : unit; inertial axes

    Notes
    -----
    The bristle slides against the body by the displacement less v h + w h x arm, means over the step, whose work with
    the force is exact. Its force is that of the step's end, and never gives back more than its energy.
    """
    R, v, w, q = body.R, body.v, body.w, point.stick
    bx, by, bz = cross(w[0], w[1], w[2], arm[0], arm[1], arm[2])
    sx, sy, sz = contact_laws.tangential(
        move[0] - h * (v[0] + bx), move[1] - h * (v[1] + by), move[2] - h * (v[2] + bz), normal[0], normal[1], normal[2]
    )
    ux, uy, uz = turn(R, q[0], q[1], q[2])
    ux, uy, uz = contact_laws.tangential(ux, uy, uz, normal[0], normal[1], normal[2])
    found = contact_laws.friction(
        ux, uy, uz, sx, sy, sz, lam, cylinder.friction, cylinder.stick_stiffness, cylinder.stick_damping, h
    )
    half, q1, t = 0.5 * cylinder.stick_stiffness, point.stick1, point.t
    before = half * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    q1[0], q1[1], q1[2] = turn_back(R, found[3], found[4], found[5])
    after = half * (q1[0] * q1[0] + q1[1] * q1[1] + q1[2] * q1[2])
    t[0], t[1], t[2] = found[8], found[9], found[10]
    point.along, point.across, point.by_normal = found[11], found[12], found[13]
    point.drag1[0], point.drag1[1], point.drag1[2] = found[0], found[1], found[2]
    slip = -(found[0] * sx + found[1] * sy + found[2] * sz) - (after - before)
    return found[0], found[1], found[2], slip, after


@indirect(types.UniTuple(REAL, 2)(VECTOR, VECTOR, REAL, REAL, REAL, REAL, MODEL, VECTOR))
def add_contact_step(y0, y1, h, soft, chi, ratio, model, F):
    """Forces of all contacts over a step into F and the bodies' wrenches, at the mean position of the bodies.

    Returns the energies that normal forces and friction take, J. Gaps are those of `measure_gaps`; `soft` times the
    stiffness is taken; chi and ratio are those of the filter, whose loss is not a contact's.
    """
    cylinders, contacts, bodies = model.flexible.cylinders, model.flexible.contact_points, model.bodies
    n_q, lost, rubbed = model.info.nq, 0.0, 0.0
    for k in range(cylinders.size):
        if cylinders[k].under >= 0:
            continue
        b = cylinders[k].body
        cx, cy, cz, ax, ay, az = _frame(bodies, b, cylinders[k].centre, cylinders[k].axis)
        G = cylinders[k].F
        for c in range(6):
            G[c] = 0.0
        X, surface = bodies[b].x, cylinders[k].surface
        normal = 0.0
        for i in range(cylinders[k].first, cylinders[k].last):
            arrives = not math.isfinite(contacts[i].gap)
            contacts[i].rest1 = max(-contacts[i].gap1, 0.0)
            if not arrives:
                contacts[i].rest1 = min(contacts[i].rest, contacts[i].rest1)
            gap0 = contacts[i].gap + contacts[i].rest
            gap1 = math.inf if arrives else contacts[i].gap1 + contacts[i].rest
            contacts[i].force, contacts[i].along, contacts[i].across, contacts[i].by_normal = 0.0, 0.0, 0.0, 0.0
            q, q1 = contacts[i].stick, contacts[i].stick1
            held = 0.5 * cylinders[k].stick_stiffness * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
            q1[0] = q1[1] = q1[2] = 0.0
            before = contact_laws.contact_energy(gap0, cylinders[k].stiffness, cylinders[k].exponent)
            stored = contact_laws.contact_energy(gap1, cylinders[k].stiffness, cylinders[k].exponent)
            lam, slope, filtered = _pressed(
                cylinders[k], contacts[i].viscous, gap0, gap1, h, soft, chi, ratio * contacts[i].sank
            )
            lost -= filtered * (contacts[i].offset - contacts[i].distance)
            if lam == 0.0:
                lost += before - stored
                rubbed += held
                continue
            contacts[i].force, contacts[i].d_gap = lam, slope
            S, iq = contacts[i].S, contacts[i].iq
            x0, y00, z0 = contact_laws.point_position(y0, iq, S)
            x1, y11, z1 = contact_laws.point_position(y1, iq, S)
            mx, my, mz = 0.5 * (x0 + x1), 0.5 * (y00 + y11), 0.5 * (z0 + z1)
            dx, dy, dz = mx - cx, my - cy, mz - cz
            total = contacts[i].distance + contacts[i].offset
            if surface == surfaces.PLANE:
                nx, ny, nz, turning = ax, ay, az, -lam
            else:  # of a body that turns s is not dm . am
                s, _ = surfaces.step_position(surface, contacts[i].xi, contacts[i].xi1, cylinders[k].half_length)
                nx, ny, nz = 2.0 * (dx - s * ax) / total, 2.0 * (dy - s * ay) / total, 2.0 * (dz - s * az) / total
                turning = 2.0 * lam * s / total
            n, f = contacts[i].n, contacts[i].f
            n[0], n[1], n[2] = nx, ny, nz
            f[0], f[1], f[2] = lam * nx, lam * ny, lam * nz
            lost += lam * (contacts[i].offset - contacts[i].distance) - (stored - before)
            normal += lam
            if cylinders[k].friction > 0.0:
                size = math.sqrt(nx * nx + ny * ny + nz * nz)
                ex, ey, ez = mx - X[0], my - X[1], mz - X[2]
                found = _rub(
                    contacts[i], cylinders[k], bodies[b], (x1 - x0, y11 - y00, z1 - z0), (ex, ey, ez),
                    (nx / size, ny / size, nz / size), lam, h,
                )  # fmt: skip
                f[0], f[1], f[2] = f[0] + found[0], f[1] + found[1], f[2] + found[2]
                rubbed += found[3]
                cylinders[k].energy += found[4]
                rigid.add_wrench(G, ex, ey, ez, -found[0], -found[1], -found[2])
            for j in range(4):
                at, share = contacts[i].iv[j] - n_q, S[j]
                F[at] -= share * f[0]
                F[at + 1] -= share * f[1]
                F[at + 2] -= share * f[2]
            rigid.add_wrench(G, cx - X[0], cy - X[1], cz - X[2], -lam * nx, -lam * ny, -lam * nz)
            tx, ty, tz = cross(ax, ay, az, turning * dx, turning * dy, turning * dz)
            G[3] -= tx
            G[4] -= ty
            G[5] -= tz
        for c in range(6):
            bodies[b].F[c] += G[c]
        cylinders[k].normal = normal
    return lost, rubbed


@indirect(void(VECTOR, VECTOR, MODEL, SPARSE))
def add_contact_step_tangents(y0, y1, model, matrix):
    """Add twice the derivative of `add_contact_step`, of the last call, with respect to the step's end."""
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    cylinders, contacts = flexible.cylinders, flexible.contact_points
    J, K, W = flexible.J[1], flexible.K12, flexible.K24
    for r in range(12):
        for c in range(12):
            W[r, c] = 0.0
    for k in range(cylinders.size):
        if cylinders[k].under >= 0:
            continue
        b = cylinders[k].body
        moves = bodies[b].motion != rigid.DRIVEN
        R, X = bodies[b].R, bodies[b].x
        _, _, _, ax, ay, az = _frame(bodies, b, cylinders[k].centre, cylinders[k].axis)
        a, last = (ax, ay, az), -1  # contact point whose element's sum is in W
        surface, half = cylinders[k].surface, cylinders[k].half_length
        for i in range(cylinders[k].first, cylinders[k].last):
            lam, slope = contacts[i].force, contacts[i].d_gap
            if lam == 0.0:
                continue
            S, n, t = contacts[i].S, contacts[i].n, contacts[i].t
            size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            unit = (n[0] / size, n[1] / size, n[2] / size)
            x0, y00, z0 = contact_laws.point_position(y0, contacts[i].iq, S)
            x1, y11, z1 = contact_laws.point_position(y1, contacts[i].iq, S)
            total = contacts[i].distance + contacts[i].offset
            # direction at the end: 2 n - what the start has of it
            px, py, pz = 0.5 * (x0 + x1) - X[0], 0.5 * (y00 + y11) - X[1], 0.5 * (z0 + z1) - X[2]
            e = (x1 - x0, y11 - y00, z1 - z0)
            share = 0.0  # of the axis, along which the distance does not change
            if surface != surfaces.PLANE:
                _, share = surfaces.step_position(surface, contacts[i].xi, contacts[i].xi1, half)
            along = share * (e[0] * ax + e[1] * ay + e[2] * az)
            d1 = contacts[i].distance
            n1 = (
                (0.5 * total * n[0] + 0.5 * (e[0] - along * ax)) / d1,
                (0.5 * total * n[1] + 0.5 * (e[1] - along * ay)) / d1,
                (0.5 * total * n[2] + 0.5 * (e[2] - along * az)) / d1,
            )
            if surface == surfaces.PLANE:
                n1 = a
            for p in range(3):
                for q in range(3):
                    same = 1.0 if p == q else 0.0
                    turning = (same - share * a[p] * a[q] - n[p] * n1[q]) / total
                    if surface == surfaces.PLANE:
                        turning = 0.0
                    tt = t[p] * t[q]
                    drag = contacts[i].along * tt + contacts[i].across * (same - unit[p] * unit[q] - tt)
                    pressed = slope * (n[p] - contacts[i].by_normal * t[p]) * n1[q]
                    K[p, q] = 2.0 * (drag - pressed - lam * turning)
            if last >= 0 and contacts[last].element != contacts[i].element:
                add_sum(matrix, contacts[last].iv, n_q, W)
            last = i
            add_share(W, S, K)
            if not moves:
                continue
            q = flexible.e[2]
            q[0], q[1], q[2] = turn_back(R, px, py, pz)
            body_columns(model, b, q, True, J)
            f = (-contacts[i].f[0], -contacts[i].f[1], -contacts[i].f[2])
            for p in range(4):
                add_relative(matrix, model, b, J, K, f, contacts[i].iv[p] - n_q, S[p])
            add_relative_body(matrix, model, b, True, J, K, f)
        if last >= 0:
            add_sum(matrix, contacts[last].iv, n_q, W)


@indirect(void(MODEL))
def end_contacts(model):
    """Make bristles and depths of a step's end those of the next one's start, and keep how far its points sank."""
    cylinders, contacts = model.flexible.cylinders, model.flexible.contact_points
    for k in range(cylinders.size):
        for i in range(cylinders[k].first, cylinders[k].last):
            gap0, gap1, rest = contacts[i].gap, contacts[i].gap1, contacts[i].rest
            stays = is_filtered(cylinders[k], gap0 + rest) and gap1 + rest < 0.0
            contacts[i].sank = gap0 - gap1 if stays else 0.0
            contacts[i].rest = contacts[i].rest1
            for c in range(3):
                contacts[i].stick[c] = contacts[i].stick1[c]


def clear_gaps(model):
    """Forget the gaps of steps before. Not compiled."""
    contacts = model.flexible.contact_points
    contacts["gap"], contacts["gap1"] = np.inf, np.inf
    contacts["force"] = 0.0
    contacts["stick"], contacts["stick1"], contacts["t"], contacts["rest"] = 0.0, 0.0, 0.0, 0.0
    contacts["sank"] = 0.0
