"""Contacts of beams with surfaces and with one another, and of two bodies: forces, tangents, what a step leaves behind.

All forces are those of an interval of length h between two states, whose gaps `surfaces` measures and whose laws are
those of `contact_laws`; h = 0 is a state (explicit methods, generalized-alpha, statics, modes), else bodies hold their
mean positions over a step that conserves energy. The reaction acts at the same point: momenta are kept.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.kernels import body_contact, contact_laws, rigid, surfaces
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_relative, add_relative_body, body_columns
from evolvent.kernels.sparse import SPARSE, add_block, add_inner, first_entry, inner
from evolvent.model import MODEL

_I = types.int64
_PAIR = types.UniTuple(REAL, 2)


@inlined
def any_contact(model):
    """Whether a model has contacts."""
    return model.contact_surfaces.size > 0 or model.body_contacts.size > 0


@inlined
def measure(y, what, model):
    """Gaps of all contacts by the state y and the bodies' current positions (`surfaces.measure_points`)."""
    if model.contact_surfaces.size > 0:
        surfaces.measure_points(y, what, model)
    if model.body_contacts.size > 0:
        body_contact.measure_bodies(what, model)


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
        by_bodies, by_rubbing = body_contact.add_bodies(y1, h, step, soft, chi, ratio, model)
        lost, rubbed = lost + by_bodies, rubbed + by_rubbing
    return lost, rubbed


@inlined
def add_tangents(y0, y1, h, c_rate, model, matrix):
    """Add the derivative of `add_contacts` by y1, twice that of a step; with c_rate times that by velocity."""
    if model.contact_surfaces.size > 0:
        add_point_tangents(y0, y1, h, c_rate, model, matrix)
    if model.body_contacts.size > 0:
        body_contact.add_body_tangents(h, c_rate, model, matrix)


@inlined
def end_contacts(y, model):
    """Make the end of a step the start of the next; what friction and damping took, J (`contact_laws.end_point`)."""
    slip = damped = 0.0
    if model.contact_surfaces.size > 0:
        slip, damped = end_points(y, model)
    if model.body_contacts.size > 0:
        by_bodies, damped_bodies = body_contact.end_bodies(model)
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


@inlined
def pressed(model):
    """A number that encodes which contacts press: it changes where the set does."""
    contacts, rows, found = model.contact_points, model.body_contacts, 0
    for i in range(contacts.size):
        if contacts[i].force != 0.0:
            found += i * i + 1
    for i in range(rows.size):
        if rows[i].force != 0.0:
            found += 104729 * (i * i + 1)
    return found


def clear_history(model):
    """Forget the steps before. Not compiled."""
    for rows in (model.contact_points, model.body_contacts):
        rows["gap"], rows["gap1"] = math.inf, math.inf
        for name in ("force", "stick", "stick1", "t", "sank", "drag", "drag1", "damper"):
            rows[name] = 0.0
    model.contact_points["rest"], model.contact_points["rest1"], model.contact_points["carrier"] = 0.0, 0.0, -1
    model.body_contacts["energy"] = 0.0
    model.contact_surfaces["impulse"] = model.body_contacts["impulse"] = 0.0


@indirect(_PAIR(VECTOR, VECTOR, REAL, REAL, REAL, REAL, REAL, MODEL, VECTOR))
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
            before = contact_laws.contact_energy(gap0, row.stiffness, row.exponent)
            stored = contact_laws.contact_energy(gap1, row.stiffness, row.exponent)
            kept, lam, filtered = contact_laws.bristle_energy(point, row), 0.0, 0.0
            p = arm = u = (0.0, 0.0, 0.0)
            c, L = -1, (0.0, 0.0, 0.0, 0.0)
            if gap1 < 0.0 or gap0 < 0.0:
                p, arm, u, c, L = _place(y0, y1, point, row, body, elements, half, h)
                rate = point.n1[0] * u[0] + point.n1[1] * u[1] + point.n1[2] * u[2]
                lam, filtered = contact_laws.press(point, row, gap0, gap1, rate, h, soft, chi, ratio)
                power -= point.damper1 * rate
            if h != 0.0 and lam == 0.0:
                lost += before - stored
                rubbed += kept
                energy += stored
                continue
            m, unit, fell, same = _normal(point, row, elements, p, u, c, o, a, gap0 - gap1, h)
            if not same:
                point.force, point.rest1 = 0.0, max(-point.gap1, 0.0)
                lost += before
                rubbed += kept
                continue
            if h != 0.0:
                lost += lam * fell - (stored - before) - filtered * (gap0 - gap1)
            f, n, whole = (lam * m[0], lam * m[1], lam * m[2]), point.n, point.f
            if row.friction > 0.0:
                at = row.account + 3 * (i - row.first) if explicit else -1
                drag, slip, held = _rub(y1, point, row, body, elements, half, u, arm, p, a, unit, lam, h, step, at)
                f = (f[0] + drag[0], f[1] + drag[1], f[2] + drag[2])
                energy += held
                rubbed += slip if h != 0.0 else 0.0
            energy += stored
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


@indirect(void(VECTOR, MODEL))
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
def _place(y0, y1, point, row, body, elements, half, h):
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
    L, at = surfaces.shape(elements[c].length, xi), elements[c].iq
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
def _rub(y, point, row, body, elements, half, u, arm, p, a, n, lam, h, step, at):
    """`contact_laws.rub` of a contact point with the unit normal n, whose u, arm and p are those of `_place`.

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
        ex, ey, ez = cross(a[0], a[1], a[2], n[0], n[1], n[2])
        size = math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = ex / size, ey / size, ez / size
        axes = ((ex, ey, ez), cross(n[0], n[1], n[2], ex, ey, ez), (0.0, 0.0, 0.0))
        if h == 0.0 and step > 0.0 and point.carrier >= 0:
            c, off = point.carrier, point.offset
            x, yy, z = surfaces.combined(y, elements[c].iq, half, surfaces.shape(elements[c].length, point.xi))
            s = (p[0] - x - off * a[0], p[1] - yy - off * a[1], p[2] - z - off * a[2])
    f, slip, held, slide = contact_laws.rub(y, at, point, row, axes, n, s, u, lam, step)
    if row.under >= 0:
        q[0], q[1], q[2] = slide
    return f, slip, held


@indirect(_PAIR(VECTOR, MODEL))
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
                    x = surfaces.combined(y, elements[c].iq, half, surfaces.shape(elements[c].length, point.xi))
                    point.offset = (p[0] - x[0]) * a[0] + (p[1] - x[1]) * a[1] + (p[2] - x[2]) * a[2]
            elif row.friction > 0.0:
                x = turn_back(R, p[0] - X[0], p[1] - X[1], p[2] - X[2])
                slide = (x[0] - q[0], x[1] - q[1], x[2] - q[2])
                q[0], q[1], q[2] = x
            by_slip, by_damping = contact_laws.end_point(point, row, point.gap + rest, point.gap1 + rest, slide)
            slip, damped, point.rest = slip + by_slip, damped + by_damping, point.rest1
    return slip, damped


@indirect(void(VECTOR, VECTOR, REAL, REAL, MODEL, SPARSE))
def add_point_tangents(y0, y1, h, c_rate, model, matrix):
    """`add_tangents` of contact points of beams."""
    bodies, n_q = model.bodies, model.info.nq
    contact_surfaces, contacts = model.contact_surfaces, model.contact_points
    J, K, W, factor = model.J[1], model.K12, model.K24, 1.0 if h == 0.0 else 2.0
    for k in range(contact_surfaces.size):
        if contact_surfaces[k].under >= 0:
            add_turn_tangents(y1, h, c_rate, model, k, matrix)
            continue
        _clear(W, 12)
        row, b = contact_surfaces[k], contact_surfaces[k].body
        moves, R = bodies[b].motion != rigid.DRIVEN, bodies[b].R
        o, a = surfaces.frame(bodies, row)
        element, nodes = -1, (0, 0)  # whose sum is in W
        for i in range(row.first, row.last):
            point, lam = contacts[i], contacts[i].force
            if lam == 0.0:
                continue
            S, n, slope, share, total = point.S, point.n, 1.0, 0.0, point.distance + point.offset
            x, arm, u, _, _ = _place(y0, y1, point, row, bodies[b], model.elements, 0, h)
            if h == 0.0:
                s = (x[0] - o[0]) * a[0] + (x[1] - o[1]) * a[1] + (x[2] - o[2]) * a[2]
                H = surfaces.curvature(
                    row.surface, s, row.half_length, n[0], n[1], n[2], a[0], a[1], a[2], point.distance
                )
                g = _state_slope(point, u, H, c_rate)
            else:
                slope, H = point.d_gap, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                p, q = surfaces.point_position(y0, point.iq, S), surfaces.point_position(y1, point.iq, S)
                g, share = surfaces.step_end(row, point, (q[0] - p[0], q[1] - p[1], q[2] - p[2]), a)
            for p in range(3):
                for q in range(3):
                    bent = H[p] if p == q else H[2 + p + q]
                    if h != 0.0 and row.surface != surfaces.PLANE:
                        bent = ((1.0 if p == q else 0.0) - share * a[p] * a[q] - n[p] * g[q]) / total
                    K[p, q] = factor * (contact_laws.slope_by(point, slope, g, p, q) - lam * bent)
            if element >= 0 and element != point.element:
                _add_sum(matrix, nodes, 2, W)
            element, nodes = point.element, (point.iv[0] - n_q, point.iv[2] - n_q)
            for p in range(4):
                for q in range(4):
                    s = S[p] * S[q]
                    for r in range(3):
                        for c in range(3):
                            W[3 * p + r, 3 * q + c] += s * K[r, c]
            if not moves:
                continue
            local = model.e[2]
            local[0], local[1], local[2] = turn_back(R, arm[0], arm[1], arm[2])
            body_columns(model, b, local, True, J)
            f = (-point.f[0], -point.f[1], -point.f[2])
            for p in range(4):
                add_relative(matrix, model, b, J, K, f, point.iv[p] - n_q, S[p])
            add_relative_body(matrix, model, b, True, J, K, f)
        if element >= 0:
            _add_sum(matrix, nodes, 2, W)


@inlined
def _state_slope(point, v, H, c_rate):
    """Derivative of a state's normal force by the position of the point, which moves at v against the body."""
    n, normal, d_rate = point.n, point.d_gap + c_rate * point.d_rate, point.d_rate
    return (
        normal * n[0] + d_rate * (H[0] * v[0] + H[3] * v[1] + H[4] * v[2]),
        normal * n[1] + d_rate * (H[3] * v[0] + H[1] * v[1] + H[5] * v[2]),
        normal * n[2] + d_rate * (H[4] * v[0] + H[5] * v[1] + H[2] * v[2]),
    )


@inlined
def _clear(W, size):
    """Clear the sum of the tangents of contact points."""
    for r in range(size):
        for c in range(size):
            W[r, c] = 0.0


@kernel
def _add_sum(matrix, nodes, count, W):
    """Add the sum W of the tangents of contact points between `count` nodes, from the unknowns given on; clear it."""
    for p in range(count):
        for q in range(count):
            add_block(matrix, nodes[p], nodes[q], W, 6 * p, 6 * q, 6, 6, 1.0)
    _clear(W, 6 * count)


@indirect(void(VECTOR, REAL, REAL, MODEL, _I, SPARSE))
def add_turn_tangents(y1, h, c_rate, model, k, matrix):
    """Tangents of cylinder k's layer, within the pattern of the matrix or through inner unknowns.

    Notes
    -----
    Any part of a turn may lie on any part of the next. Where the pattern does not couple them, inner unknowns do, which
    costs more, and without the part by which the normal turns: with u the displacement of p against r, as columns U of
    the coordinates, and K = -df/du, the forces add U K U^T to the matrix, as eliminating z = U^T x does from
    A x + U K z and U^T x - z = 0: along n alone without friction.
    """
    n_q = model.info.nq
    row, contacts, elements = model.contact_surfaces[k], model.contact_points, model.elements
    half, W, factor = NODE_VECTORS[model.beams[row.under].kind], model.K24, 1.0 if h == 0.0 else 2.0
    K, B, C = matrix_view(model.work, 0, 3, 24), model.work[72:80], model.work[80:88]
    upper, lower, coupled, nodes = -1, -1, False, (0, 0, 0, 0)  # whose sum is in W
    _clear(W, 24)
    for i in range(row.first, row.last):
        point = contacts[i]
        if point.force == 0.0:
            continue
        c, xi = surfaces.below(point, h)
        if point.element != upper or c != lower:
            if coupled:
                _add_sum(matrix, nodes, 4, W)
            upper, lower = point.element, c
            q, at = elements[upper].iv - n_q, elements[c].iv - n_q
            nodes = (q, q + 3 * half, at, at + 3 * half)
            coupled = _couples(matrix, nodes)
        S, L = point.S, surfaces.shape(elements[c].length, xi)
        D = surfaces.shape(elements[c].length, point.xi1) if point.carrier1 == c else L
        for q in range(4):
            B[q], C[q], B[4 + q], C[4 + q] = S[q], S[q], -L[q], -D[q]
        slope = point.d_gap + c_rate * point.d_rate
        if not coupled:
            _add_inner(matrix, point, row, factor, slope, elements[c].iv, half, n_q, B)
            continue
        n1, lam = point.n1, point.force if point.carrier1 == c else 0.0
        e, T, bent = surfaces.turning(y1, elements, point.carrier1, half, point.xi1, n1)
        for a in range(3):
            for b in range(3):
                drag = factor * contact_laws.drag_slope(point, a, b)
                normal = factor * contact_laws.normal_slope(point, slope, n1, a, b) - lam * bent * e[a] * e[b]
                for q in range(8):
                    K[a, 3 * q + b] = normal * C[q] + drag * B[q]
                for q in range(4):
                    K[a, 12 + 3 * q + b] += lam * e[a] * n1[b] * T[q]
        for p in range(8):
            for a in range(3):
                for q in range(24):
                    W[3 * p + a, q] += B[p] * K[a, q]
    if coupled:
        _add_sum(matrix, nodes, 4, W)


@inlined
def _couples(matrix, nodes):
    """Whether the pattern of a matrix couples the first two of four nodes with the others."""
    a, b = first_entry(matrix, nodes[0], nodes[2])[0], first_entry(matrix, nodes[0], nodes[3])[0]
    return min(a, b, first_entry(matrix, nodes[1], nodes[2])[0], first_entry(matrix, nodes[1], nodes[3])[0]) >= 0


@inlined
def _add_inner(matrix, point, row, factor, slope, lower, half, n_q, B):
    """Add the tangent of a contact point through inner unknowns, B: factors of its 8 vectors."""
    n, n1, rubs = point.n, point.n1, row.friction > 0.0
    size = math.sqrt(factor * (abs(slope) + point.along + point.across))
    if not size > 0.0:
        return
    q = inner(matrix, 3 if rubs else 1)
    for j in range(8):
        at, s = point.iv[j] if j < 4 else lower + 3 * (j % 2 + half * (j // 2 - 2)), B[j]
        for a in range(3):
            if rubs:
                for b in range(3):
                    value = factor * contact_laws.slope_by(point, slope, n1, a, b)
                    add_inner(matrix, at - n_q + a, q + b, s * value / size, size * s * (1.0 if a == b else 0.0))
            else:
                add_inner(matrix, at - n_q + a, q, -s * n[a] * factor * slope / size, size * s * n1[a])
