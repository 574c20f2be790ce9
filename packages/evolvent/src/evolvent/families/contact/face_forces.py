"""Contact of shells with shells: forces of nodes on faces over an interval, and what a step leaves behind.

A contact point is a sphere round a node, as wide as its shell is thick, and the closest point of a face on one side of
it (`face_search`). Its normal force has the law of `contact_laws` of the gap, the distance less both half thicknesses,
and acts along the line from the face to the node; friction acts where the faces meet. The reaction is that at the
face's point, on its nodes by their weights (`face_patch`), so that both momenta are kept.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.contact import face_patch, face_search
from evolvent.kernels import contact_laws
from evolvent.kernels.contact import press
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.kernels.surfaces import STATE
from evolvent.model import MODEL

USED_FOR = "face_contacts"
_PAIR = types.UniTuple(REAL, 2)
#: Differences of squares of distances, beside these, that are round-off.
_ROUND_OFF = 1e-13


@inlined
def _scaled(s, v):
    return s * v[0], s * v[1], s * v[2]


@inlined
def ends_of(point, model, h):
    """Faces and weights of a contact point at both ends of an interval, into its record; gaps, and share of the end's.

    Returns
    -------
    gap0, gap1 : float, m; share : float, of the force along the distance from the point that is closest at the end

    Notes
    -----
    A node that was, or is, too far away from all faces has the face of the other end at both.
    """
    faces, bodies, W0, W1 = model.faces, model.bodies, point.W0, point.W1
    if point.face1 >= 0:
        face_patch.write_weights(point.xi1, point.eta1, W1)
        point.of1, point.d1 = point.face1, point.distance
    if h == 0.0:
        point.of0 = point.of1
        return point.gap, point.gap1, 1.0
    if point.face0 >= 0:
        face_patch.write_weights(point.xi0, point.eta0, W0)
        point.of0, point.d0 = point.face0, point.distance0
    if point.face1 < 0:
        point.of1 = point.face0
        for i in range(face_patch.WEIGHTS):
            W1[i] = W0[i]
    if point.face0 < 0:
        point.of0 = point.face1
        for i in range(face_patch.WEIGHTS):
            W0[i] = W1[i]
    D1, V1 = face_patch.offset_of(point.body, faces, point.of1, W1, bodies)
    D0, V0 = face_patch.offset_of(point.body, faces, point.of0, W0, bodies)
    by1, by0 = 2.0 * h * dot(D1, V1), 2.0 * h * dot(D0, V0)
    if point.face0 < 0:
        point.d0 = math.sqrt(max(point.d1 * point.d1 - by1, 0.0))
    if point.face1 < 0:
        point.d1 = math.sqrt(max(point.d0 * point.d0 + by0, 0.0))
    first, last = point.d0 * point.d0, point.d1 * point.d1
    a, b, share = first + by0 - last, last - by1 - first, 0.5
    if abs(a + b) > _ROUND_OFF * (first + last):
        share = min(max(a / (a + b), 0.0), 1.0)
    for i in range(3):
        point.D0[i], point.D1[i] = D0[i], D1[i]
    point.fell = -((1.0 - share) * by0 + share * by1) / (point.d0 + point.d1)
    thick = point.radius + faces[point.of1].radius
    return point.d0 - (point.radius + faces[point.of0].radius), point.d1 - thick, share


@inlined
def place_of(point, model):
    """Unit normal, distance and rate of the faces against one another where friction acts: (n, d, u).

    By the bodies' current positions and rates, and the weights of the interval's end.
    """
    faces, bodies, W = model.faces, model.bodies, point.W1
    D, u = face_patch.offset_of(point.body, faces, point.of1, W, bodies)
    d = math.sqrt(dot(D, D))
    n, w = _scaled(1.0 / d if d > 0.0 else 0.0, D), bodies[point.body].w
    r = cross(w[0], w[1], w[2], n[0], n[1], n[2])
    ux, uy, uz = u[0] - point.radius * r[0], u[1] - point.radius * r[1], u[2] - point.radius * r[2]
    for a in range(4):
        share = (d - point.radius) * face_patch.bilinear(point.xi, point.eta, a)
        w = bodies[faces[point.of1].nodes[a]].w
        r = cross(w[0], w[1], w[2], n[0], n[1], n[2])
        ux, uy, uz = ux - share * r[0], uy - share * r[1], uz - share * r[2]
    return n, d, (ux, uy, uz)


@inlined
def _slid(point, n, model):
    """Displacement of the faces against one another since the step's start, of a state, by the arms noted there."""
    faces, bodies = model.faces, model.bodies
    face_patch.write_weights(point.xi0, point.eta0, point.W0)
    D, _ = face_patch.offset_of(point.body, faces, point.face0, point.W0, bodies)
    arm, arms = point.arm, point.arms
    x, y, z = turn(bodies[point.body].R, arm[0], arm[1], arm[2])
    sx, sy, sz = D[0] - x, D[1] - y, D[2] - z
    for a in range(4):
        x, y, z = turn(bodies[faces[point.face0].nodes[a]].R, arms[a, 0], arms[a, 1], arms[a, 2])
        sx, sy, sz = sx - x, sy - y, sz - z
    return sx, sy, sz


@inlined
def _rub(y, point, model, lam, h, step):
    """`contact_laws.rub` of a contact point; pushes its friction.

    The bristle's axes are those of the node.
    """
    faces, bodies = model.faces, model.bodies
    point.xi = point.xi1 if point.face1 >= 0 else point.xi0
    point.eta = point.eta1 if point.face1 >= 0 else point.eta0
    n, d, u = place_of(point, model)
    s = _scaled(h, u)
    if h == 0.0:
        s = _slid(point, n, model) if step > 0.0 and point.face0 >= 0 else (0.0, 0.0, 0.0)
    axes, slide = contact_laws.body_axes(bodies[point.body].R), point.slide
    f, slip, held, moved = contact_laws.rub(y, -1, point, point, axes, n, s, u, lam, step)
    if h == 0.0 and point.face0 < 0:  # it arrives
        point.along = point.across = 0.0
    slide[0], slide[1], slide[2] = moved
    face_patch.push(faces, point.of1, point.W1, bodies, point.body, f)
    t = cross(n[0], n[1], n[2], f[0], f[1], f[2])
    F = bodies[point.body].F
    for i in range(3):
        F[3 + i] -= point.radius * t[i]
    for a in range(4):
        share = (d - point.radius) * face_patch.bilinear(point.xi, point.eta, a)
        F = bodies[faces[point.of1].nodes[a]].F
        for i in range(3):
            F[3 + i] -= share * t[i]
    return f, slip, held


@indirect(_PAIR(VECTOR, REAL, REAL, REAL, REAL, REAL, MODEL))
def add_faces(y, h, step, soft, chi, ratio, model):
    """`contact.add_contacts` of nodes on faces."""
    points, faces, bodies, lost, rubbed = model.face_points, model.faces, model.bodies, 0.0, 0.0
    h = max(h, 0.0)
    if h == 0.0:
        face_search.measure_faces(STATE, model)
    for k in range(model.face_contacts.size):
        row, total = model.face_contacts[k], model.face_contacts[k].force
        normal = energy = power = touching = 0.0
        total[0] = total[1] = total[2] = 0.0
        for i in range(row.first, row.last):
            point = points[i]
            contact_laws.clear_point(point)
            whole, drag, m = point.whole, point.rubbing, point.n
            for c in range(3):
                whole[c] = drag[c] = 0.0
            if h == 0.0 and not point.gap1 < 0.0:
                continue
            if not (point.gap1 < 0.0 or point.gap < 0.0):
                rubbed += contact_laws.bristle_energy(point, point)
                continue
            gap0, gap1, share = ends_of(point, model, h)
            rate, fell = 0.0, 0.0
            if h == 0.0:
                D, u = face_patch.offset_of(point.body, faces, point.of1, point.W1, bodies)
                n = _scaled(1.0 / point.distance if point.distance > 0.0 else 0.0, D)
                rate = dot(n, u)
                m[0], m[1], m[2] = n
            else:
                fell = point.fell
            lam, loss, stored = press(point, point, gap0, gap1, rate, fell, h, soft, chi, ratio)
            energy += stored
            if h == 0.0:
                power += loss
                f = _scaled(lam, (m[0], m[1], m[2]))
                face_patch.push(faces, point.of1, point.W1, bodies, point.body, f)
            else:
                lost += loss
                if lam == 0.0:
                    rubbed += contact_laws.bristle_energy(point, point)
                    continue
                scale = 2.0 / (point.d0 + point.d1)
                D0, D1 = point.D0, point.D1
                point.share1, point.share0 = scale * share, scale * (1.0 - share)
                f1 = _scaled(lam * point.share1, (D1[0], D1[1], D1[2]))
                f0 = _scaled(lam * point.share0, (D0[0], D0[1], D0[2]))
                face_patch.push(faces, point.of1, point.W1, bodies, point.body, f1)
                face_patch.push(faces, point.of0, point.W0, bodies, point.body, f0)
                f = (f1[0] + f0[0], f1[1] + f0[1], f1[2] + f0[2])
                for c in range(3):
                    m[c] = f[c] / lam
            for c in range(3):
                whole[c] = f[c]
            if point.friction > 0.0:
                f, slip, held = _rub(y, point, model, lam, h, step)
                energy += held
                rubbed += slip if h != 0.0 else 0.0
                for c in range(3):
                    drag[c] = f[c]
                    whole[c] += f[c]
            normal += lam
            touching += 1.0
            for c in range(3):
                total[c] += point.sense * whole[c]
        row.normal, row.energy, row.touching = normal, energy, touching
        lost += power
    return lost, rubbed


@indirect(_PAIR(MODEL))
def end_faces(model):
    """`contact.end_contacts` of nodes on faces."""
    points, faces, bodies, slip, damped = model.face_points, model.faces, model.bodies, 0.0, 0.0
    for i in range(points.size):
        point = points[i]
        gap0, gap1 = point.gap, point.gap1
        by_slip, by_damping = contact_laws.end_point(point, point, gap0, gap1, point.slide)
        slip, damped = slip + by_slip, damped + by_damping
        point.face0, point.xi0, point.eta0, point.distance0 = point.face1, point.xi1, point.eta1, point.distance
        if point.friction > 0.0 and point.face1 >= 0:
            n, arm, arms = point.n1, point.arm, point.arms
            r = point.radius
            arm[0], arm[1], arm[2] = turn_back(bodies[point.body].R, r * n[0], r * n[1], r * n[2])
            for a in range(4):
                r = (point.distance - point.radius) * face_patch.bilinear(point.xi1, point.eta1, a)
                R = bodies[faces[point.face1].nodes[a]].R
                arms[a, 0], arms[a, 1], arms[a, 2] = turn_back(R, r * n[0], r * n[1], r * n[2])
    face_search.note_ways(model)
    return slip, damped


@indirect(void(MODEL))
def measure_slides(model):
    """Sliding velocities of contact points that touch, in the axes of their nodes (`turning.measure_rates`)."""
    points = model.face_points
    for i in range(points.size):
        point, slid = points[i], points[i].slid1
        slid[0] = slid[1] = slid[2] = 0.0
        if point.friction > 0.0 and point.gap1 < 0.0:
            face_patch.write_weights(point.xi1, point.eta1, point.W1)
            point.of1, point.xi, point.eta = point.face1, point.xi1, point.eta1
            n, _, u = place_of(point, model)
            axes = contact_laws.body_axes(model.bodies[point.body].R)
            slid[0], slid[1], slid[2] = contact_laws.into_axes(axes, contact_laws.tangential(u, n))
