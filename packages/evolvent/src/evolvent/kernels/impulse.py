"""Impulses: what jumps when a force acts for no time, all constraints answering."""

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import constraint_rows, points, rigid
from evolvent.kernels.calls import kick_at, lock_at
from evolvent.model import MODEL


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def prepare(t, y, s, model):
    """Kinematics, masses and factors for an impulse; forces and rows' right-hand sides are cleared."""
    bodies, calls = model.bodies, model.inertia_lock_calls
    rigid.kinematics(t, y, model)
    for k in range(calls.size):
        lock_at(model, calls[k])(t, y, s, model)
    rigid.factorise(bodies)
    clear_wrenches_and_twists(model)
    _prepare_rows(t, y, s, model)


@inlined
def _prepare_rows(t, y, s, model):
    """Build the constraint rows, without right-hand sides, and set the forces on points to zero."""
    points.clear_forces(model.points)
    if model.rows.size > 0:
        constraint_rows.build_rows(t, y, s, model)
        for r in range(model.rows.size):
            model.rows[r].rx = 0.0


@inlined
def clear_wrenches_and_twists(model):
    """Set the wrenches and acceleration twists of all bodies to zero."""
    for b in range(model.bodies.size):
        _clear(model.bodies, b)


@inlined
def _clear(bodies, b):
    """Set the wrench and the acceleration twist of body b to zero."""
    for c in range(6):
        bodies[b].F[c] = 0.0
        bodies[b].a[c] = 0.0


@inlined
def prepare_constrained_bodies(t, y, s, model):
    """`prepare` for the bodies on which constraint rows act; for models without families that lock inertia.

    The twists and wrenches of the other bodies stay as they are.
    """
    bodies, sides = model.bodies, model.row_sides
    rigid.family_kinematics(t, y, model)
    for i in range(sides.size):
        b = sides[i].body
        if b >= 0:
            rigid.body_kinematics(t, y, b, model)
            rigid.factorise_body(bodies, b)
            _clear(bodies, b)
    _prepare_rows(t, y, s, model)


@indirect(void(VECTOR, INTEGERS, MODEL))
def impulse(y, s, model):
    """Let every constraint answer the impulses in the bodies' wrenches and the points' forces; velocities jump.

    Call after `prepare`. Constraint rows may carry a wanted jump of their rate in rx.
    """
    bodies, dy = model.bodies, model.dy[1]
    for b in range(bodies.size):
        rigid.respond(bodies, b, bodies[b].F, bodies[b].a)
    for i in range(dy.size):
        dy[i] = 0.0
    jump(y, s, model, dy)


@indirect(void(VECTOR, INTEGERS, MODEL, VECTOR))
def jump(y, s, model, dy):
    """Velocities jump as bodies' twists a, points' forces and beams' velocities dy say, all constraints answering."""
    if model.rows.size > 0:
        constraint_rows.solve_rows(s, model, dy)
    calls = model.inertia_kick_calls
    for k in range(calls.size):
        kick_at(model, calls[k])(y, s, model, dy)
