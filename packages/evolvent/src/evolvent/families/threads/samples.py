"""Threads between the ends of a step: segments at the spools, whose length the drive changes, and moving meshes."""

from __future__ import annotations

import math

from numba import void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.between import vector_at
from evolvent.kernels.markers import marker_kinematics
from evolvent.kernels.rotations import turn
from evolvent.kernels.thread import MOVING, is_end, paid_out, spool, take_up
from evolvent.model import MODEL

USED_FOR = "threads"


@inlined
def _from_spool(t, y, k, q, model):
    """Vector to the node at q from where thread k leaves its spool, and the rest length of that segment."""
    rigid.kinematics(t, y, model)
    b, d = model.threads[k].body, model.threads[k].departure
    R, x = model.bodies[b].R, model.bodies[b].x
    dx, dy, dz = turn(R, d[0], d[1], d[2])
    phi, _, _ = spool(t, y, model.threads, model.parameters, k)
    rest = paid_out(model.threads, k, phi) - (model.switches[k] - 1) * model.threads[k].segment
    return y[q] - x[0] - dx, y[q + 1] - x[1] - dy, y[q + 2] - x[2] - dz, max(rest, 0.0)


@inlined
def keep_strains(theta, t, h, k, y0, y1, y, model):
    """Move the nodes of thread k, on a mesh that moves, to where its elements' strains lie on straight lines.

    Where the outer end is fixed, what is left over there is spread over the length.
    """
    q, last, held = model.threads[k].iq, model.threads[k].n - 1, is_end(model.threads, k, 0)
    first, rest0 = _exit(t, y0, k, model)
    outer0 = _outer_end(y0, k, model)
    end, rest1 = _exit(t + h, y1, k, model)
    outer1 = _outer_end(y1, k, model)
    place, rest = _exit(t + theta * h, y, k, model)
    outer = _outer_end(y, k, model)
    moved = old = place
    for i in range(last, -1, -1):
        at = q + 3 * i
        next0, next1, here = vector_at(y0, at), vector_at(y1, at), vector_at(y, at)
        if held and i == 0:
            next0, next1, here = outer0, outer1, outer
        a = _distance(next0, first) / rest0
        b = _distance(next1, end) / rest1
        first, end = next0, next1
        size = _distance(here, old)
        scale = (a + theta * (b - a)) * rest / size if size > 0.0 else 1.0
        moved = (
            moved[0] + scale * (here[0] - old[0]), moved[1] + scale * (here[1] - old[1]),
            moved[2] + scale * (here[2] - old[2]),
        )  # fmt: skip
        old = here
        if not (held and i == 0):
            y[at], y[at + 1], y[at + 2] = moved
    for i in range(1, last + 1 if held else 0):
        part = (last + 1 - i) / (last + 1)
        for c in range(3):
            y[q + 3 * i + c] += part * (outer[c] - moved[c])


@inlined
def _distance(y, x):
    """Distance of two places, m."""
    a, b, c = y[0] - x[0], y[1] - x[1], y[2] - x[2]
    return math.sqrt(a * a + b * b + c * c)


@inlined
def _exit(t, y, k, model):
    """Place (three floats) where thread k leaves its spool, and the rest length of an element of its moving mesh."""
    rigid.kinematics(t, y, model)
    b, d = model.threads[k].body, model.threads[k].departure
    R, x = model.bodies[b].R, model.bodies[b].x
    dx, dy, dz = turn(R, d[0], d[1], d[2])
    phi, _, _ = spool(t, y, model.threads, model.parameters, k)
    take_up(t, model.threads, model.parameters, k)
    out = paid_out(model.threads, k, phi) - model.threads[k].taken[0]
    return (x[0] + dx, x[1] + dy, x[2] + dz), out / model.threads[k].n


@inlined
def _outer_end(y, k, model):
    """Place of the fixed end of thread k, after `kinematics`; of another thread none is needed."""
    if model.threads[k].end < 0:
        return 0.0, 0.0, 0.0
    place = marker_kinematics(y, model.markers, model.points, model.bodies, model.threads[k].end)
    return place[0], place[1], place[2]


@indirect(void(REAL, REAL, REAL, VECTOR, VECTOR, MODEL, VECTOR))
def keep_lengths_at_spools(theta, t, h, y0, y1, model, y):
    """Move threads to where the elongations of their segments at the spools lie on straight lines.

    A segment that is slack at an end of the step stays where it is.
    """
    for k in range(model.threads.size):
        count = model.switches[k]
        held = is_end(model.threads, k, 0)  # what the end is fixed to stays where it is
        if model.threads[k].kind == MOVING:
            if model.threads[k].slack == 0:
                keep_strains(theta, t, h, k, y0, y1, y, model)
            continue
        if count <= (1 if held else 0) or model.switches[model.threads.size + k] != 0:  # wound, or gone
            continue
        q = model.threads[k].iq
        at = q + 3 * (count - 1)
        a, b, c, rest = _from_spool(t, y0, k, at, model)
        first = math.sqrt(a * a + b * b + c * c) - rest
        a, b, c, rest = _from_spool(t + h, y1, k, at, model)
        last = math.sqrt(a * a + b * b + c * c) - rest
        if model.threads[k].slack != 0 and min(first, last) <= 0.0:
            continue
        a, b, c, rest = _from_spool(t + theta * h, y, k, at, model)
        size = math.sqrt(a * a + b * b + c * c)
        more = (rest + first + theta * (last - first)) / size - 1.0 if size > 0.0 else 0.0
        for i in range(1 if held else 0, count):
            part = more * i / (count - 1) if held else more
            y[q + 3 * i] += part * a
            y[q + 3 * i + 1] += part * b
            y[q + 3 * i + 2] += part * c
