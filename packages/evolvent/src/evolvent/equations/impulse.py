"""Impulses: what jumps when a force acts for no time, all constraints answering."""

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, kernel
from evolvent.kernels import ancf_beams, constraint_rows, points, reduced, rigid, thread
from evolvent.model import MODEL

USED_FOR = ("rows", "threads")


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def prepare(t, y, s, model):
    """Kinematics, masses and factors for an impulse; forces and rows' right-hand sides are cleared.

    A node that is leaving its spool is at Q and moves with it; it no longer belongs to the thread wound.
    """
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    rigid.kinematics(t, y, model)
    if threads.size > 0:
        thread.reels(t, y, s, model)
        thread.lock_spools(model)
        thread.carry_wound(s, model)
    for p in range(threads.size):
        if threads[p].leaving > 0.0:
            d = threads[p].d
            rigid.add_mass(bodies, threads[p].body, threads[p].copies * threads[p].leaving, d[0], d[1], d[2])
        if threads[p].kind == thread.MOVING:
            thread.carry_root(p, model)
    rigid.factorise(bodies)
    for b in range(bodies.size):
        for c in range(6):
            bodies[b].F[c] = 0.0
            bodies[b].a[c] = 0.0
    points.clear_forces(model.points)
    for k in range(nodes.size):
        nodes[k].rhs = 0.0
    if model.rows.size > 0:
        constraint_rows.build_rows(t, y, s, model)
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
    bodies, dy = model.bodies, model.dy[1]
    for b in range(bodies.size):
        rigid.respond(bodies, b, bodies[b].F, bodies[b].a)
    if model.beams.size > 0 or model.reduced_bodies.size > 0:
        for i in range(dy.size):
            dy[i] = 0.0
    jump(y, s, model, dy)


@indirect(void(VECTOR, INTEGERS, MODEL, VECTOR))
def jump(y, s, model, dy):
    """Velocities jump as bodies' twists a, points' forces and beams' velocities dy say, all constraints answering."""
    bodies, threads = model.bodies, model.threads
    if model.rows.size > 0:
        constraint_rows.solve_rows(s, model, dy)
    for b in range(bodies.size):
        rigid.kick(y, bodies, b, bodies[b].a)
    points.kick_points(y, model.points)
    ancf_beams.kick_beams(y, model, dy)
    if model.reduced_bodies.size > 0:
        reduced.kick_modes(y, model, dy)
    for k in range(threads.size):
        if threads[k].kind == thread.INEXTENSIBLE:
            thread.kick_chain(y, s, model, k)
        if threads[k].kind == thread.MOVING:
            thread.kick_moving(y, k, model)
