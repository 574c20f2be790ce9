"""Contacts of beams with surfaces and with one another, and of two bodies: forces, and what a step leaves behind.

`surfaces` and `body_gaps` measure the geometry of a contact (gap, normal, points of both sides), `contact_laws` has its
law; here its force acts on both sides, and `contact_tangent` has the derivatives. All forces are those of an interval
of length h between two states; h = 0 is a state (explicit methods, generalized-alpha, statics, modes), else bodies
hold their mean positions over a step that conserves energy. The reaction acts at the same point: momenta are kept.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import ancf, body_gaps, contact_laws, rigid, surfaces
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.model import MODEL

USED_FOR = contact_laws.CONTACTS
_PAIR = types.UniTuple(REAL, 2)


@inlined
def any_contact(model):
    """Whether a model has contacts."""
    own = model.contact_surfaces.size > 0 or model.body_contacts.size > 0
    return own or model.contacts_passing_calls.size > 0


@inlined
def add_contacts(y0, y1, h, step, soft, chi, ratio, model, F):
    """Forces of all contacts over an interval into F and the bodies' wrenches; fills the records with results.

    Parameters
    ----------
    y0, y1 : (ny,) float, states at both ends, whose gaps are measured; of a state both are the same
    h : float, s, length of the step that conserves energy, 0 of a state, or KEPT of one with its bristles among the
        accounts
    step : float, s, length of the step that ends in y1, infinity within a step of an explicit method; 0 where a run
        begins; below 0 without steps (statics, samples)
    soft, chi, ratio : float, of `contact_laws.press`; 1, 0 and 0 of a state

    Returns
    -------
    lost, rubbed : float, J, what normal forces (but for the filter) and friction take; of a state W, and 0
    """
    lost = rubbed = 0.0
    if model.contact_surfaces.size > 0:
        lost, rubbed = add_points(y0, y1, h, step, soft, chi, ratio, model, F)
    if model.body_contacts.size > 0:
        by_bodies, by_rubbing = add_bodies(y1, h, step, soft, chi, ratio, model)
        lost, rubbed = lost + by_bodies, rubbed + by_rubbing
    return lost, rubbed


@inlined
def end_contacts(y, model):
    """Make the end of a step the start of the next; what friction and damping took, J (`contact_laws.end_point`)."""
    slip = damped = 0.0
    if model.contact_surfaces.size > 0:
        slip, damped = end_points(y, model)
    if model.body_contacts.size > 0:
        by_bodies, damped_bodies = end_bodies(model)
        slip, damped = slip + by_bodies, damped + damped_bodies
    return slip, damped


@inlined
def keep_bristles(y, model):
    """Write the bristles at the start of the next step into the accounts of the state y."""
    contact_surfaces, contacts, rows = model.contact_surfaces, model.contact_points, model.body_contacts
    for k in range(contact_surfaces.size):
        at = contact_surfaces[k].account
        for i in range(contact_surfaces[k].first, contact_surfaces[k].last if at >= 0 else 0):
            for c in range(3):
                y[at + 3 * (i - contact_surfaces[k].first) + c] = contacts[i].stick[c]
    for k in range(rows.size):
        for c in range(3 if rows[k].account >= 0 else 0):
            y[rows[k].account + c] = rows[k].stick[c]


@inlined
def energy_of(model):
    """Energy of all contacts by the last forces, J, of bristles too."""
    contact_surfaces, rows, total = model.contact_surfaces, model.body_contacts, 0.0
    for k in range(contact_surfaces.size):
        total += contact_surfaces[k].energy
    for k in range(rows.size):
        total += rows[k].energy
    return total


def clear_history(rows):
    """Make contacts forget the steps before. Not compiled."""
    rows["gap"], rows["gap1"] = math.inf, math.inf
    for name in ("force", "stick", "stick1", "t", "sank", "drag", "drag1", "damper"):
        rows[name] = 0.0


@indirect(_PAIR(VECTOR, VECTOR, REAL, REAL, REAL, REAL, REAL, MODEL, VECTOR), used_for="contact_surfaces")
def add_points(y0, y1, h, step, soft, chi, ratio, model, F):
    """`add_contacts` of contact points of beams."""
    bodies, n_q, lost, rubbed = model.bodies, model.info.nq, 0.0, 0.0
    contact_surfaces, contacts, elements = model.contact_surfaces, model.contact_points, model.elements
    explicit, h = h < 0.0, max(h, 0.0)
    if h == 0.0:
        surfaces.measure_points(y1, surfaces.STATE, model)
    for k in range(contact_surfaces.size):
        row, body = contact_surfaces[k], bodies[contact_surfaces[k].body]
        force, moment = row.force, row.moment
        half = NODE_VECTORS[model.beams[row.under].kind] if row.under >= 0 else 0
        o, a = surfaces.frame(bodies, row)
        for c in range(3):
            force[c] = moment[c] = 0.0
        normal = energy = power = 0.0
        for i in range(row.first, row.last):
            point = contacts[i]
            contact_laws.clear_point(point)
            if h == 0.0 and not point.gap1 < 0.0:
                continue
            gap0, gap1 = contact_laws.depths(point, h)
            if not (gap1 < 0.0 or gap0 < 0.0):
                rubbed += contact_laws.bristle_energy(point, row)
                continue
            p, arm, u, c, L = place(y0, y1, point, row, body, elements, half, h)
            m, unit, fell, same = _normal(point, row, elements, p, u, c, o, a, gap0 - gap1, h)
            if not same:
                point.rest1, gap1 = max(-point.gap1, 0.0), math.inf
            rate = m[0] * u[0] + m[1] * u[1] + m[2] * u[2]
            lam, loss, stored = press(point, row, gap0, gap1, rate, fell, h, soft, chi, ratio)
            energy += stored
            if h == 0.0:
                power += loss
            else:
                lost += loss
                if lam == 0.0:
                    rubbed += contact_laws.bristle_energy(point, row)
                    continue
            f, n, whole = (lam * m[0], lam * m[1], lam * m[2]), point.n, point.f
            if row.friction > 0.0:
                at = row.account + 3 * (i - row.first) if explicit else -1
                drag, slip, held = _rub(y1, point, row, body, elements, half, u, arm, p, a, unit, lam, h, step, at)
                f = (f[0] + drag[0], f[1] + drag[1], f[2] + drag[2])
                energy += held
                rubbed += slip if h != 0.0 else 0.0
            normal += lam
            n[0], n[1], n[2] = m
            whole[0], whole[1], whole[2] = f
            _push(F, force, moment, point, elements, c, L, half, arm, f, n_q)
        for c in range(3):
            body.F[c] -= force[c]
            body.F[3 + c] -= moment[c]
        row.normal, row.energy, row.power = normal, energy, power
        lost += power
    return lost, rubbed


@indirect(void(VECTOR, MODEL), used_for="contact_surfaces")
def evaluate_points(y, model):
    """Evaluate all contact points of beams in a state, after `kinematics`, into their records; overwrites `Model.F`.

    `apart` is the gap, NaN beyond an obstacle's ends and where a point is too far from it; places and normals are those
    of far points too. Sliding is damped as if the state were the start of its step as well.
    """
    contacts, damped = model.contact_points, False
    for i in range(contacts.size):
        contacts[i].gap, damped = math.inf, damped or contacts[i].viscous > 0.0
    for _ in range(2 if damped else 1):
        add_points(y, y, 0.0, -1.0, 1.0, 0.0, 0.0, model, model.F)
        for i in range(contacts.size):
            contacts[i].gap = contacts[i].gap1
            contacts[i].apart = contacts[i].gap1 if contacts[i].gap1 < math.inf else math.nan
    surfaces.measure_points(y, surfaces.END, model)


@inlined
def press(point, row, gap0, gap1, rate, fell, h, soft, chi, ratio):
    """Normal force of a contact, N; what it takes (J, of a state W); the energy of the contact, J.

    Parameters
    ----------
    gap0, gap1 : float, m, of the law; fell : float, m, by how much the gap falls by the work of the force
    rate : float, m/s, of a state
    """
    before = contact_laws.contact_energy(gap0, row.stiffness, row.exponent)
    stored = contact_laws.contact_energy(gap1, row.stiffness, row.exponent)
    lam, filtered = contact_laws.press(point, row, gap0, gap1, rate, h, soft, chi, ratio)
    if h == 0.0:
        return lam, -point.damper1 * rate, stored
    if lam == 0.0:
        return lam, before - stored, stored
    return lam, lam * fell - (stored - before) - filtered * (gap0 - gap1), stored


@inlined
def place(y0, y1, point, row, body, elements, half, h):
    """Where a contact point is over an interval: (p, arm, u, c, L).

    p (m): mean position; arm (m): from the origin of the surface's body, or from the point below; u: displacement over
    a step (m), or velocity of a state (m/s), against the obstacle; c, L: element below, -1 of none, and its factors.
    """
    X, v, w, L = body.x, body.v, body.w, (0.0, 0.0, 0.0, 0.0)
    x0, y00, z0 = surfaces.point_position(y0, point.iq, point.S)
    x1, y11, z1 = surfaces.point_position(y1, point.iq, point.S)
    p = (0.5 * (x0 + x1), 0.5 * (y00 + y11), 0.5 * (z0 + z1))
    ux, uy, uz = surfaces.point_position(y1, point.iv, point.S) if h == 0.0 else (x1 - x0, y11 - y00, z1 - z0)
    if row.under < 0:
        arm = (p[0] - X[0], p[1] - X[1], p[2] - X[2])
        bx, by, bz = cross(w[0], w[1], w[2], arm[0], arm[1], arm[2])
        if h == 0.0:
            return p, arm, (ux - v[0] - bx, uy - v[1] - by, uz - v[2] - bz), -1, L
        return p, arm, (ux - h * (v[0] + bx), uy - h * (v[1] + by), uz - h * (v[2] + bz)), -1, L
    c, xi = surfaces.below(point, h)
    L, at = ancf.cubic(elements[c].length, xi), elements[c].iq
    a, b = surfaces.combined(y0, at, half, L), surfaces.combined(y1, at, half, L)
    arm = (0.5 * (x0 + x1 - a[0] - b[0]), 0.5 * (y00 + y11 - a[1] - b[1]), 0.5 * (z0 + z1 - a[2] - b[2]))
    if h == 0.0:
        vx, vy, vz = surfaces.combined(y1, elements[c].iv, half, L)
        return p, arm, (ux - vx, uy - vy, uz - vz), c, L
    bx, by, bz = cross(w[0], w[1], w[2], arm[0], arm[1], arm[2])
    return p, arm, (ux - b[0] + a[0] - h * bx, uy - b[1] + a[1] - h * by, uz - b[2] + a[2] - h * bz), c, L


@inlined
def _normal(point, row, elements, p, u, c, o, a, sank, h):
    """Direction of the normal force over an interval, unit normal, fall of the gap by its work, whether it lasts."""
    m, fell, same = (point.n1[0], point.n1[1], point.n1[2]), sank, True
    unit = m
    if row.under >= 0:
        m, unit, same = surfaces.turn_normal(point, u, elements[c].length, h)
        fell = -(m[0] * u[0] + m[1] * u[1] + m[2] * u[2])
    elif h != 0.0:
        m = surfaces.step_normal(row, point, (p[0] - o[0], p[1] - o[1], p[2] - o[2]), a)
        size = math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
        unit = (m[0] / size, m[1] / size, m[2] / size)
    return m, unit, fell, same


@inlined
def _push(F, force, moment, point, elements, c, L, half, arm, f, n_q):
    """Subtract the force f on a contact point from F; the reaction acts on element c, or on the body where c < 0."""
    couple = cross(arm[0], arm[1], arm[2], f[0], f[1], f[2])
    for i in range(3):
        force[i] += f[i] if c < 0 else 0.0
        moment[i] += couple[i]
        for j in range(4):
            F[point.iv[j] - n_q + i] -= point.S[j] * f[i]
            if c >= 0:
                F[elements[c].iv + 3 * (j % 2 + half * (j // 2)) - n_q + i] += L[j] * f[i]


@inlined
def turn_axes(a, n):
    """Axes of a bristle against a turn of a coil with the axis a, n the unit normal: along the turn, and beside it."""
    ex, ey, ez = cross(a[0], a[1], a[2], n[0], n[1], n[2])
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / size, ey / size, ez / size
    return (ex, ey, ez), cross(n[0], n[1], n[2], ex, ey, ez), (0.0, 0.0, 0.0)


@inlined
def _rub(y, point, row, body, elements, half, u, arm, p, a, n, lam, h, step, at):
    """`contact_laws.rub` of a contact point with the unit normal n, whose u, arm and p are those of `place`.

    Notes
    -----
    Against a body the bristle's axes are those of the body; the displacement of a state is that from where the point
    was in these at the step's start, `anchor`; that of a step, means over it, does the exact work. Against a turn the
    bristle lies along the turn and the axis, and turns with the coil; the displacement of a state, which `anchor`
    keeps, is that from what was below at the step's start.
    """
    s, q, axes = u if h != 0.0 else (0.0, 0.0, 0.0), point.anchor, contact_laws.body_axes(body.R)
    if row.under < 0:
        if h == 0.0 and step > 0.0:
            x, yy, z = turn(body.R, q[0], q[1], q[2])
            s = (arm[0] - x, arm[1] - yy, arm[2] - z)
    else:
        axes = turn_axes(a, n)
        if h == 0.0 and step > 0.0 and point.carrier >= 0:
            c, off = point.carrier, point.offset
            x, yy, z = surfaces.combined(y, elements[c].iq, half, ancf.cubic(elements[c].length, point.xi))
            s = (p[0] - x - off * a[0], p[1] - yy - off * a[1], p[2] - z - off * a[2])
    f, slip, held, slide = contact_laws.rub(y, at, point, row, axes, n, s, u, lam, step)
    if row.under >= 0:
        q[0], q[1], q[2] = slide
    return f, slip, held


@indirect(_PAIR(VECTOR, MODEL), used_for="contact_surfaces")
def end_points(y, model):
    """`end_contacts` of contact points of beams."""
    bodies, slip, damped = model.bodies, 0.0, 0.0
    contact_surfaces, contacts, elements = model.contact_surfaces, model.contact_points, model.elements
    for k in range(contact_surfaces.size):
        row, R, X = contact_surfaces[k], bodies[contact_surfaces[k].body].R, bodies[contact_surfaces[k].body].x
        _, a = surfaces.frame(bodies, row)
        for i in range(row.first, row.last):
            point, slide = contacts[i], (0.0, 0.0, 0.0)
            q, rest, p = point.anchor, point.rest, surfaces.point_position(y, point.iq, point.S)
            if row.under >= 0:
                if point.force != 0.0:
                    slide = (q[0], q[1], q[2])
                point.carrier, point.xi = point.carrier1, point.xi1
                if point.carrier >= 0:
                    c, half = point.carrier, NODE_VECTORS[model.beams[row.under].kind]
                    x = surfaces.combined(y, elements[c].iq, half, ancf.cubic(elements[c].length, point.xi))
                    point.offset = (p[0] - x[0]) * a[0] + (p[1] - x[1]) * a[1] + (p[2] - x[2]) * a[2]
            elif row.friction > 0.0:
                x = turn_back(R, p[0] - X[0], p[1] - X[1], p[2] - X[2])
                slide = (x[0] - q[0], x[1] - q[1], x[2] - q[2])
                q[0], q[1], q[2] = x
            by_slip, by_damping = contact_laws.end_point(point, row, point.gap + rest, point.gap1 + rest, slide)
            slip, damped, point.rest = slip + by_slip, damped + by_damping, point.rest1
    return slip, damped


@indirect(_PAIR(VECTOR, REAL, REAL, REAL, REAL, REAL, MODEL), used_for="body_contacts")
def add_bodies(y, h, step, soft, chi, ratio, model):
    """`add_contacts` of two bodies."""
    rows, bodies, lost, rubbed = model.body_contacts, model.bodies, 0.0, 0.0
    explicit, h = h < 0.0, max(h, 0.0)
    if h == 0.0:
        body_gaps.measure_bodies(surfaces.STATE, model)
    for k in range(rows.size):
        row, A, B = rows[k], bodies[rows[k].a], bodies[rows[k].b]
        contact_laws.clear_point(row)
        n, c, rubbing, slide, on_a, on_b, n1 = row.n, row.c, row.rubbing, row.slide, row.on_a, row.on_b, row.n1
        for i in range(3):
            on_a[i] = on_a[3 + i] = on_b[i] = on_b[3 + i] = rubbing[i] = slide[i] = 0.0
            n[i] = n1[i]
        (p, q, e, g), xa, xb = body_gaps.body_axes(row, bodies), A.x, B.x
        d, s, size, by_u, by_v, by_w = body_gaps.body_offset(row, bodies, p, q), row.s1, 1.0, 0.0, 0.0, 0.0
        if row.surface == body_gaps.EDGES:
            by_w = body_gaps.fade_slope(row.w1 if h == 0.0 else row.w0, row.w1, row.radius)
        if h != 0.0:
            if row.surface == body_gaps.BOX:
                n[0], n[1], n[2] = body_gaps.box_step_normal(row, B.R)
            else:
                by_d, by_u, by_v, turned = _shares(row)
                by_w += turned
                for i in range(3):
                    n[i] = 2.0 * by_d * d[i] + by_u * e[i] + by_v * g[i]
            s, size = 0.5 * (row.s0 + row.s1), math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            size = size if size > 0.0 else 1.0
        unit, r = (n[0] / size, n[1] / size, n[2] / size), row.radius_a
        for i in range(3):
            c[i] = xa[i] + p[i] + s * e[i] - r * unit[i]  # where a's surface touches b
        row.energy = row.power = 0.0
        if h == 0.0 and row.gap1 >= 0.0:
            continue
        arm_a, arm_b = (c[0] - xa[0], c[1] - xa[1], c[2] - xa[2]), (c[0] - xb[0], c[1] - xb[1], c[2] - xb[2])
        v = rigid.relative_velocity(A, B, arm_a, arm_b)
        rate = n[0] * v[0] + n[1] * v[1] + n[2] * v[2]
        if by_w != 0.0 and h == 0.0:
            wa, wb = A.w, B.w
            rate += by_w * dot((wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2]), cross(e[0], e[1], e[2], g[0], g[1], g[2]))
        lam, loss, row.energy = press(row, row, row.gap, row.gap1, rate, row.gap - row.gap1, h, soft, chi, ratio)
        lost += loss
        if h == 0.0:  # at the point of contact; else at the middles, with moments by the axes
            row.power, p, q = loss, arm_a, arm_b
        elif lam == 0.0:
            rubbed += contact_laws.bristle_energy(row, row)
            continue
        _add_both(on_a, on_b, p, q, (lam * n[0], lam * n[1], lam * n[2]))
        _add_moment(on_a, e, lam, by_u, d, by_w, g)
        _add_moment(on_b, g, lam, by_v, d, by_w, e)
        if h != 0.0 and row.surface == body_gaps.BOX:  # whose axes turn with b
            _add_moment(on_b, n, lam, 1.0, d, 0.0, e)
        if row.friction > 0.0:
            at = row.account if explicit else -1
            f, slip, held = _rub_bodies(y, row, A, B, arm_a, arm_b, v, unit, lam, h, step, at)
            rubbed += slip if h != 0.0 else 0.0
            row.energy += held
            rubbing[0], rubbing[1], rubbing[2] = f
            _add_both(on_a, on_b, arm_a, arm_b, f)
        for i in range(6):
            A.F[i] += on_a[i]
            B.F[i] += on_b[i]
    return lost, rubbed


@inlined
def _shares(row):
    """Changes of the distance by d, u, v and w over a step: factors of 2 dm.dd, du, dv and dw.

    Notes
    -----
    With d from the middle of b's segment to that of a's, their axes e and g, u = d.e, v = d.g, w = e.g and the closest
    places s and t, the squared distance p^2 = d.d + s^2 + t^2 + 2 s u - 2 t v - 2 s t w changes, with means m, by

        2 dm.dd + 2 sm du - 2 tm dv - 2 (s t)m dw + rho,  rho = 2 (sm + um - wm tm) ds + 2 (tm - vm - wm sm) dt

    where s and t depend on u, v and w alone: rho, of third order where they lie inside, is shared among du, dv and dw
    in proportion to them. u, v and w are quadratic in vectors that are fixed to the bodies, whose changes are
    theta x mean: so the force lam times this over p0 + p1 does the work of the gap's change exactly, depends on the
    bodies' points against each other alone, and keeps both momenta. The distance from a plane is v.
    """
    if row.surface == surfaces.PLANE:
        return 0.0, 0.0, 1.0, 0.0
    s, t = 0.5 * (row.s0 + row.s1), 0.5 * (row.t0 + row.t1)
    u, v, w = 0.5 * (row.u0 + row.u1), 0.5 * (row.v0 + row.v1), 0.5 * (row.w0 + row.w1)
    ds, dt = row.s1 - row.s0, row.t1 - row.t0
    rho = 2.0 * ((s + u - w * t) * ds + (t - v - w * s) * dt)
    by_u, by_v, by_w = 2.0 * s, -2.0 * t, -(row.s0 * row.t0 + row.s1 * row.t1)
    length = min(row.half_a, row.half_b)
    du = row.u1 - row.u0 if row.half_a > 0.0 else 0.0
    dv = row.v1 - row.v0 if row.half_b > 0.0 else 0.0
    dw = length * (row.w1 - row.w0)
    total = du * du + dv * dv + dw * dw
    if rho != 0.0 and total > 0.0:
        by_u, by_v, by_w = by_u + rho * du / total, by_v + rho * dv / total, by_w + rho * length * dw / total
    scale = 1.0 / (row.distance0 + row.distance)
    return scale, scale * by_u, scale * by_v, scale * by_w


@inlined
def _add_both(on_a, on_b, p, q, f):
    """Add a force at p from the origin of a to its wrench, and the reaction at q to that of b."""
    rigid.add_wrench(on_a, p[0], p[1], p[2], f[0], f[1], f[2])
    rigid.add_wrench(on_b, q[0], q[1], q[2], -f[0], -f[1], -f[2])


@inlined
def _add_moment(wrench, e, lam, by_d, d, by_g, g):
    """Add the moment lam e x (by_d d + by_g g)."""
    x, y, z = lam * (by_d * d[0] + by_g * g[0]), lam * (by_d * d[1] + by_g * g[1]), lam * (by_d * d[2] + by_g * g[2])
    x, y, z = cross(e[0], e[1], e[2], x, y, z)
    wrench[3], wrench[4], wrench[5] = wrench[3] + x, wrench[4] + y, wrench[5] + z


@inlined
def _rub_bodies(y, row, A, B, arm_a, arm_b, v, n, lam, h, step, at):
    """`contact_laws.rub` of two bodies: the bristle's axes are those of b; it stands in the state at `at` >= 0.

    The displacement of a state is that of a's material at the point of contact in the axes of b, from where it was in
    these at the step's start: a sphere that rolls does not slide.
    """
    axes, s, slide, X = contact_laws.body_axes(B.R), (h * v[0], h * v[1], h * v[2]), row.slide, row.X
    if h == 0.0 and step > 0.0:
        x, yy, z = turn_back(A.R, arm_a[0], arm_a[1], arm_a[2])
        qx, qy, qz = turn(row.Q, x, yy, z)
        x, yy, z = turn_back(B.R, arm_b[0], arm_b[1], arm_b[2])
        s = turn(B.R, x - X[0] - qx, yy - X[1] - qy, z - X[2] - qz)
    f, slip, held, moved = contact_laws.rub(y, at, row, row, axes, n, s, v, lam, step)
    slide[0], slide[1], slide[2] = moved
    return f, slip, held


@indirect(_PAIR(MODEL), used_for="body_contacts")
def end_bodies(model):
    """`end_contacts` of two bodies."""
    bodies, rows, slip, damped = model.bodies, model.body_contacts, 0.0, 0.0
    for k in range(rows.size):
        row = rows[k]
        by_slip, by_damping = contact_laws.end_point(row, row, row.gap, row.gap1, row.slide)
        slip, damped = slip + by_slip, damped + by_damping
        A, B, X, Q, xa, xb = bodies[row.a].R, bodies[row.b].R, row.X, row.Q, bodies[row.a].x, bodies[row.b].x
        X[0], X[1], X[2] = turn_back(B, xa[0] - xb[0], xa[1] - xb[1], xa[2] - xb[2])
        for i in range(3):
            for j in range(3):
                Q[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
    return slip, damped
