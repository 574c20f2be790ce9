"""Fields on wound thread, and on what moves with the end of a thread on a body."""

from numba import void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.fields import acceleration, add_body_point
from evolvent.kernels.markers import ON_BODY
from evolvent.kernels.rigid import add_wrench
from evolvent.kernels.rotations import cross
from evolvent.kernels.thread.end import is_end
from evolvent.kernels.thread.spool import MOVING, ring_radius
from evolvent.kernels.thread.wound import spool_axis, wound_mass
from evolvent.model import MODEL


def USED_FOR(model):  # noqa: N802
    """Fields and threads."""
    return model.threads.size and model.fields.size


@inlined
def _end_field(t, model, p):
    """Force of fields on the mass at the end of thread p onto its body; returns its power, W."""
    bodies, nodes, e = model.bodies, model.nodes, model.threads[p].end
    if e < 0 or model.markers[e].kind != ON_BODY:  # a point mass has it in its own mass
        return 0.0
    k, b, x, v = model.threads[p].node, model.markers[e].index, model.scratch[1], model.scratch[2]
    for c in range(3):
        x[c], v[c] = nodes[k].x[c], nodes[k].v[c]
    ax, ay, az = acceleration(t, model, x, v)
    m, at = nodes[k].mass, bodies[b].x
    add_wrench(bodies[b].F, x[0] - at[0], x[1] - at[1], x[2] - at[2], m * ax, m * ay, m * az)
    return m * (ax * v[0] + ay * v[1] + az * v[2])


@inlined
def _half_element(outer, model, p):
    """Place and velocity of the material at the fixed end (`outer`) or at Q of thread p into scratch.

    Of a mesh that moves. Returns the mass of half an element, kg.
    """
    threads, nodes, x, v = model.threads, model.nodes, model.scratch[1], model.scratch[2]
    first, n, Q, rest = threads[p].node, threads[p].n, threads[p].Q, threads[p].element
    for c in range(3):
        if outer:
            inner = nodes[first + 1].x[c]
            x[c] = nodes[first].x[c]
            v[c] = nodes[first].v[c] + threads[p].taken[1] / rest * (x[c] - inner)
        else:
            x[c] = Q[c]
            v[c] = Q[3 + c] + threads[p].b[1] / rest * (nodes[first + n - 1].x[c] - Q[c])
    return 0.5 * threads[p].density * rest


@inlined
def note_end_fields(t, model, p):
    """Accelerations by fields at both ends of thread p, on a mesh that moves, after its `spring_points`."""
    threads, x, v = model.threads, model.scratch[1], model.scratch[2]
    _half_element(False, model, p)
    out = threads[p].exit_field
    out[0], out[1], out[2] = acceleration(t, model, x, v)
    if threads[p].end >= 0:
        _half_element(True, model, p)
        out = threads[p].end_field
        out[0], out[1], out[2] = acceleration(t, model, x, v)


@indirect(REAL(REAL, INTEGERS, MODEL, VECTOR))
def add_node_fields(t, s, model, force):
    """Add the resultant of all fields on released nodes, whose places are known, to force : (3,); returns the power, W.

    Without the ends on bodies and points (`wound_fields`, `fields.add_field_forces`).
    """
    threads, nodes, x, v, power = model.threads, model.nodes, model.scratch[1], model.scratch[2], 0.0
    for p in range(threads.size):
        for i in range(s[p]):
            if is_end(threads, p, i):
                continue
            k = threads[p].node + i
            for c in range(3):
                x[c], v[c] = nodes[k].x[c], nodes[k].v[c]
            a, m = acceleration(t, model, x, v), threads[p].copies * nodes[k].mass
            for c in range(3):
                force[c] += m * a[c]
                power += m * a[c] * v[c]
        for end in range(2 if threads[p].kind == MOVING else 0):
            if end == 0 and threads[p].end < 0:
                continue
            m = _half_element(end == 0, model, p)
            a = acceleration(t, model, x, v)
            for c in range(3):
                force[c] += m * a[c]
                power += m * a[c] * v[c]
    return power


@indirect(REAL(REAL, INTEGERS, MODEL))
def wound_fields(t, s, model):
    """Forces of fields on wound thread and ends onto the bodies that carry them, after `reels`; returns the power, W.

    Notes
    -----
    The ring of `wound.carry_wound` is integrated by four points, which have its second moments. It turns with the
    body and the spool: what the fields do by the spool's rate is kept in `field`, for it comes off the spool's power.
    """
    threads, bodies = model.threads, model.bodies
    x, v = model.scratch[1], model.scratch[2]
    power = 0.0
    for p in range(threads.size):
        threads[p].field = 0.0
        power += _end_field(t, model, p)
        if not threads[p].carried:
            continue
        r = ring_radius(s, threads, p)
        m = _ring_share(s, model, p)
        for i in range(4):
            dx, dy, dz, sx, sy, sz = _ring_point(model, p, r, i, x, v)
            ax, ay, az = acceleration(t, model, x, v)
            add_wrench(bodies[threads[p].body].F, dx, dy, dz, m * ax, m * ay, m * az)
            power += m * (ax * v[0] + ay * v[1] + az * v[2])
            threads[p].field += m * (ax * sx + ay * sy + az * sz)
    return power


@inlined
def _ring_share(s, model, p):
    """Mass of each of the four points of the ring on spool p, kg."""
    threads = model.threads
    return 0.25 * threads[p].copies * (wound_mass(s, threads, model.nodes, p) - threads[p].leaving)


@inlined
def _ring_point(model, p, r, i, x, v):
    """Place and velocity of point i of the ring of radius r on spool p into x and v : (3,).

    Returns its arm from the body's origin and its velocity relative to the body: six floats.
    """
    threads, bodies, X, b = model.threads, model.bodies, model.threads[p].X, model.threads[p].body
    at, moves, w = bodies[b].x, bodies[b].v, bodies[b].w
    cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
    zx, zy, zz = cross(nx, ny, nz, X[0], X[1], X[2])
    along = r if i == 0 else (-r if i == 1 else 0.0)
    across = r if i == 2 else (-r if i == 3 else 0.0)
    ex, ey, ez = along * X[0] + across * zx, along * X[1] + across * zy, along * X[2] + across * zz
    dx, dy, dz = cx + ex, cy + ey, cz + ez
    ux, uy, uz = cross(w[0], w[1], w[2], dx, dy, dz)
    rate = threads[p].b[1] / threads[p].r
    sx, sy, sz = cross(nx, ny, nz, ex, ey, ez)
    sx, sy, sz = rate * sx, rate * sy, rate * sz
    x[0], x[1], x[2] = at[0] + dx, at[1] + dy, at[2] + dz
    v[0], v[1], v[2] = moves[0] + ux + sx, moves[1] + uy + sy, moves[2] + uz + sz
    return dx, dy, dz, sx, sy, sz


@indirect(void(REAL, REAL, MODEL, SPARSE))
def add_wound_field_tangents(t, c_rate, model, matrix):
    """Add what fields on wound thread and on ends change with the motion of the bodies that carry them.

    Left out is what the rate of a free spool changes in fields that depend on velocity.
    """
    threads, nodes, s, x, v = model.threads, model.nodes, model.switches, model.scratch[1], model.scratch[2]
    for p in range(threads.size):
        e = threads[p].end
        if e >= 0 and model.markers[e].kind == ON_BODY:
            k = threads[p].node
            for c in range(3):
                x[c], v[c] = nodes[k].x[c], nodes[k].v[c]
            add_body_point(t, model.markers[e].index, nodes[k].mass, c_rate, model, matrix)
        if threads[p].carried:
            m, r = _ring_share(s, model, p), ring_radius(s, threads, p)
            for i in range(4):
                _ring_point(model, p, r, i, x, v)
                add_body_point(t, threads[p].body, m, c_rate, model, matrix)
        if threads[p].kind == MOVING:
            m = _half_element(False, model, p)
            add_body_point(t, threads[p].body, m, c_rate, model, matrix)
