"""Impulses: what jumps when a force acts for no time, all constraints answering."""

from numba import types, void

from evolvent.jit import INTEGERS, REAL, VECTOR, indirect, kernel
from evolvent.kernels import constraint_rows, rigid, thread
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def prepare(t, y, s, model):
    """Kinematics, masses and factors for an impulse; forces and rows' right-hand sides are cleared.

    A node that is leaving its spool is at Q and moves with it; it no longer belongs to the thread wound.
    """
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    rigid.kinematics(t, y, model)
    if threads.size > 0:
        thread.reels(t, y, s, model)
        thread.carry_wound(s, model)
    for p in range(threads.size):
        if threads[p].leaving > 0.0:
            d = threads[p].d
            rigid.add_mass(bodies, threads[p].body, threads[p].copies * threads[p].leaving, d[0], d[1], d[2])
    rigid.factorise(bodies)
    for b in range(bodies.size):
        for c in range(6):
            bodies[b].F[c] = 0.0
            bodies[b].a[c] = 0.0
    for i in range(model.points.size):
        for c in range(3):
            model.points[i].f[c] = 0.0
    for k in range(nodes.size):
        nodes[k].rhs = 0.0
    if model.rows.size > 0:
        constraint_rows.build_rows(y, s, model)
        for r in range(model.rows.size):
            model.rows[r].rx = 0.0


@kernel
def strike(model, p, fx, fy, fz, couple):
    """Add an impulse (N s) at the departure point of thread p, and a couple (N m s), to its body's wrench."""
    threads = model.threads
    F, d = model.bodies[threads[p].body].F, threads[p].d
    k = float(threads[p].copies)
    rigid.add_wrench(F, d[0], d[1], d[2], k * fx, k * fy, k * fz)
    for c in range(3):
        F[3 + c] += k * couple[c]


@indirect(void(VECTOR, INTEGERS, MODEL))
def impulse(y, s, model):
    """Let every constraint answer the impulses in the bodies' wrenches and the points' forces; velocities jump.

    Call after `prepare`. Constraint rows may carry a wanted jump of their rate in rx.
    """
    bodies, points, threads = model.bodies, model.points, model.threads
    for b in range(bodies.size):
        rigid.respond(bodies, b, bodies[b].F, bodies[b].a)
    if model.rows.size > 0:
        constraint_rows.solve_rows(s, model)
    for b in range(bodies.size):
        rigid.kick(y, bodies, b, bodies[b].a)
    for i in range(points.size):
        for c in range(3):
            y[points[i].iv + c] += points[i].f[c] * points[i].compliance
    for k in range(threads.size):
        if threads[k].kind == thread.INEXTENSIBLE:
            kick_chain(y, s, model, k)


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64))
def kick_chain(y, s, model, p):
    """Jumps of the tangents' rates of an inextensible thread from the impulsive tensions T."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    links, bound = thread.chain_links(s, threads, p)
    first, q, v, j = threads[p].node, threads[p].iq, threads[p].iv, s[p]
    if threads[p].feed == thread.FREE_SPOOL and bound:
        y[threads[p].spool_v] += threads[p].radius * nodes[first + links].tension / threads[p].spool
    for c in range(3):
        outer = pull = 0.0
        for i in range(j):
            inner = nodes[first + i].tension * y[q + 3 * i + c] if (i < links or bound) else 0.0
            jump = (pull - inner) / nodes[first + i].mass
            if i > 0:
                y[v + 3 * (i - 1) + c] += (outer - jump) / threads[p].segment
            outer, pull = jump, inner
        if j > 0 and not bound:
            y[v + 3 * (j - 1) + c] += outer
        elif j > 0 and threads[p].b[0] > thread.SHORT * threads[p].segment:
            b = threads[p].body
            d = threads[p].d
            a = bodies[b].a
            spin = cross(a[3], a[4], a[5], d[0], d[1], d[2])
            y[v + 3 * links + c] += (outer - a[c] - spin[c]) / threads[p].b[0]
    if bound:  # what the jump of b' left along the tangent does not belong to its turning
        a, k = q + 3 * links, v + 3 * links
        along = y[k] * y[a] + y[k + 1] * y[a + 1] + y[k + 2] * y[a + 2]
        for c in range(3):
            y[k + c] -= along * y[a + c]
