"""Contacts between two rigid bodies over a step that conserves energy.

With d from the middle of b's segment to that of a's, the axes e of a and g of b, u = d.e, v = d.g, w = e.g and the
closest points s and t, the squared distance is

    p^2 = d.d + s^2 + t^2 + 2 s u - 2 t v - 2 s t w

and changes over a step, with means m of both ends, by

    2 dm.dd + 2 sm du - 2 tm dv - 2 (s t)m dw + rho,
    rho = 2 (sm + um - wm tm) ds + 2 (tm - vm - wm sm) dt

where s and t depend on u, v and w alone: rho, of third order where s and t lie inside, is shared among du, dv and dw in
proportion to them. u, v and w are quadratic in vectors that are fixed to the bodies, whose changes are
theta x mean. So the force lam times this over p0 + p1 does the work of the gap's change exactly; it depends on the
bodies' points against each other alone, and keeps both momenta. The distance from a plane is v. The normal law and
friction are those of `kernels.contact_step`.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels import contact_laws, surfaces
from evolvent.kernels.body_contact import add_pair, axes_of, clear, curvature, measure, position_of, push
from evolvent.kernels.contact_step import _pressed, _rub, is_filtered
from evolvent.kernels.rotations import cross
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL

_I = types.int64


@indirect(void(_I, MODEL))
def measure_body_gaps(end, model):
    """Gaps by the bodies' current positions: of a step's end (1), with the contacts' energies, or its start (0)."""
    rows, bodies = model.flexible.body_contacts, model.bodies
    for k in range(rows.size):
        row = rows[k]
        d, e, g = axes_of(row, bodies)
        gap, distance, n, u, v, w, s, t = measure(row, d, e, g)
        if end == 1:
            row.gap1, row.distance, row.u1, row.v1, row.w1, row.s1, row.t1 = gap, distance, u, v, w, s, t
            n1 = row.n1
            n1[0], n1[1], n1[2] = n
            row.energy = contact_laws.contact_energy(gap, row.stiffness, row.exponent)
        else:
            row.gap, row.distance0, row.u0, row.v0, row.w0, row.s0, row.t0 = gap, distance, u, v, w, s, t


@inlined
def _shares(row):
    """Changes of the distance by d, u, v and w over a step: factors of 2 dm.dd, du, dv and dw."""
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


@indirect(types.UniTuple(REAL, 2)(REAL, REAL, REAL, REAL, MODEL))
def add_body_contact_step(h, soft, chi, ratio, model):
    """Forces of all contacts over a step into the bodies' wrenches, at their mean position.

    Parameters and what is returned are those of `contact_step.add_contact_step`.
    """
    rows, bodies, lost, rubbed = model.flexible.body_contacts, model.bodies, 0.0, 0.0
    for k in range(rows.size):
        row = rows[k]
        gap0, gap1, q = row.gap, row.gap1, row.stick
        held = 0.5 * row.stick_stiffness * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
        before = contact_laws.contact_energy(gap0, row.stiffness, row.exponent)
        stored = contact_laws.contact_energy(gap1, row.stiffness, row.exponent)
        clear(row)
        row.gap1, row.energy = gap1, stored
        q1 = row.stick1
        q1[0] = q1[1] = q1[2] = 0.0
        d, e, g = axes_of(row, bodies)
        lam, slope, filtered = _pressed(row, row.viscous, gap0, gap1, h, soft, chi, ratio * row.sank)
        lost -= filtered * (gap0 - gap1)
        by_d, by_u, by_v, by_w = _shares(row)
        n, c = row.n, row.c
        for i in range(3):
            n[i] = 2.0 * by_d * d[i] + by_u * e[i] + by_v * g[i]
        size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        unit = (n[0] / size, n[1] / size, n[2] / size)
        at = position_of(row, bodies, e, 0.5 * (row.s0 + row.s1), unit)
        c[0], c[1], c[2] = at
        if lam == 0.0:
            lost += before - stored
            rubbed += held
            continue
        row.force, row.d_gap = lam, slope
        lost += lam * (gap0 - gap1) - (stored - before)
        _press(row, bodies, lam, d, e, g, by_u, by_v, by_w)
        if row.friction > 0.0:
            a, b = row.a, row.b
            va, wa, xa, xb = bodies[a].v, bodies[a].w, bodies[a].x, bodies[b].x
            x, y, z = cross(wa[0], wa[1], wa[2], at[0] - xa[0], at[1] - xa[1], at[2] - xa[2])
            move = (h * (va[0] + x), h * (va[1] + y), h * (va[2] + z))
            arm = (at[0] - xb[0], at[1] - xb[1], at[2] - xb[2])
            found = _rub(row, row, bodies[b], move, arm, unit, lam, h)
            rubbing = row.rubbing
            rubbing[0], rubbing[1], rubbing[2] = found[0], found[1], found[2]
            push(row, bodies, at, (found[0], found[1], found[2]))
            rubbed += found[3]
            row.energy += found[4]
    return lost, rubbed


@inlined
def _press(row, bodies, lam, d, e, g, by_u, by_v, by_w):
    """The normal force of a step onto the bodies: a force lam n at the middles, and moments by the axes."""
    n = row.n
    f = (lam * n[0], lam * n[1], lam * n[2])
    push(row, bodies, position_of(row, bodies, e, 0.0, (0.0, 0.0, 0.0)), f)
    # push() takes both at a's middle; on b it acts at b's: -f moves by d, which gives b the moment d x f
    x, y, z = cross(d[0], d[1], d[2], f[0], f[1], f[2])
    bx, by, bz = lam * (by_v * d[0] + by_w * e[0]), lam * (by_v * d[1] + by_w * e[1]), lam * (by_v * d[2] + by_w * e[2])
    bx, by, bz = cross(g[0], g[1], g[2], bx, by, bz)
    ax, ay, az = lam * (by_u * d[0] + by_w * g[0]), lam * (by_u * d[1] + by_w * g[1]), lam * (by_u * d[2] + by_w * g[2])
    ax, ay, az = cross(e[0], e[1], e[2], ax, ay, az)
    A, B, ma, mb = bodies[row.a].F, bodies[row.b].F, row.moment_a, row.moment_b
    on_a, on_b = (ax, ay, az), (x + bx, y + by, z + bz)
    for i in range(3):
        A[3 + i] += on_a[i]
        B[3 + i] += on_b[i]
        ma[i] += on_a[i]
        mb[i] += on_b[i]


@indirect(void(MODEL, SPARSE))
def add_body_contact_step_tangents(model, matrix):
    """Add twice the derivative of `add_body_contact_step`, of the last call, with respect to the step's end."""
    rows, bodies, K = model.flexible.body_contacts, model.bodies, model.flexible.K12
    for k in range(rows.size):
        row = rows[k]
        lam, slope = row.force, row.d_gap
        if lam == 0.0:
            continue
        _, e, g = axes_of(row, bodies)
        n, n1, t, c = row.n, row.n1, row.t, row.c
        size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        unit = (n[0] / size, n[1] / size, n[2] / size)
        total = row.distance0 + row.distance
        H = curvature(row, n1, e, g)  # times the distance at the end
        for i in range(3):
            for j in range(3):
                turning = H[3 * i + j] * row.distance / total
                K[i, j] = -2.0 * (slope * n[i] * n1[j] + lam * turning)
        r = row.radius_a
        at = (c[0] + r * unit[0], c[1] + r * unit[1], c[2] + r * unit[2])
        add_pair(matrix, model, row.a, row.b, at, (-lam * n[0], -lam * n[1], -lam * n[2]), K)
        if row.along == 0.0 and row.across == 0.0 and row.by_normal == 0.0:
            continue
        for i in range(3):
            for j in range(3):
                same = 1.0 if i == j else 0.0
                tt = t[i] * t[j]
                K[i, j] = 2.0 * (row.along * tt + row.across * (same - unit[i] * unit[j] - tt))
                K[i, j] += 2.0 * row.by_normal * slope * t[i] * n1[j]
        q = row.rubbing
        add_pair(matrix, model, row.a, row.b, (c[0], c[1], c[2]), (-q[0], -q[1], -q[2]), K)


@indirect(void(MODEL))
def end_body_contact_step(model):
    """Make bristles of a step's end those of the next one's start, and keep how far the bodies sank into each other."""
    rows = model.flexible.body_contacts
    for k in range(rows.size):
        row = rows[k]
        row.sank = row.gap - row.gap1 if is_filtered(row, row.gap) and row.gap1 < 0.0 else 0.0
        for i in range(3):
            row.stick[i] = row.stick1[i]


def clear_body_gaps(model):
    """Forget the steps before. Not compiled."""
    rows = model.flexible.body_contacts
    rows["gap"], rows["gap1"] = math.inf, math.inf
    for name in ("force", "stick", "stick1", "t", "sank", "drag", "drag1", "damper", "energy"):
        rows[name] = 0.0
