"""Coordinates by kind: what happens to all coordinates of a state is a loop over these few.

Velocities of a rotation (a quaternion) are in body axes. Angles are those of bodies about fixed axes, scalars those of
wheels and free spools, modal coordinates and transverse curvatures, and rates velocities without a coordinate.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import VECTOR, indirect, inlined
from evolvent.kernels.rigid import normalise_quaternion
from evolvent.model import MODEL

POSITION, SLOPE, ROTATION, ANGLE, SCALAR, RATE = range(6)
#: In place of the switch of coordinates: they always move, or are fixed to another part.
MOVES, FIXED = -1, -2


@indirect(void(VECTOR, VECTOR, types.boolean, MODEL, VECTOR))
def displace(y0, dq, tangents, model, y):
    """Coordinates of y = those of y0 moved by dq; velocities are left.

    Parameters
    ----------
    tangents : bool, whether turns of bodies are given by 2 tan(angle/2) about their axis, else by the angle
    """
    n_q, blocks = model.info.nq, model.blocks
    for k in range(blocks.size):
        kind, q, at = blocks[k].kind, blocks[k].iq, blocks[k].iv - n_q
        if kind == ROTATION:
            x, yy, z = dq[at], dq[at + 1], dq[at + 2]
            c, s = 1.0, 0.5
            if not tangents:
                angle = math.sqrt(x * x + yy * yy + z * z)
                s = math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5 - angle * angle / 48.0
                c = math.cos(0.5 * angle)
            _turn(y0, q, c, s * x, s * yy, s * z, y)
        elif kind == ANGLE and tangents:
            y[q] = y0[q] + 2.0 * math.atan(0.5 * dq[at])
        elif kind != RATE:
            for i in range(blocks[k].count):
                y[q + i] = y0[q + i] + dq[at + i]


@inlined
def _turn(y0, q, c, bx, by, bz, y):
    """Quaternion at y[q : q + 4] = the one of y0 times (c, b), brought to length 1."""
    w, x, yy, z = y0[q], y0[q + 1], y0[q + 2], y0[q + 3]
    a = w * c - x * bx - yy * by - z * bz
    b = w * bx + x * c + yy * bz - z * by
    d = w * by - x * bz + yy * c + z * bx
    e = w * bz + x * by - yy * bx + z * c
    n = 1.0 / math.sqrt(a * a + b * b + d * d + e * e)
    y[q], y[q + 1], y[q + 2], y[q + 3] = n * a, n * b, n * d, n * e


@inlined
def normalise(blocks, y):
    """Quaternions of a state to length 1."""
    for k in range(blocks.size):
        if blocks[k].kind == ROTATION:
            normalise_quaternion(y, blocks[k].iq)


@inlined
def largest_turn(dq, angles, n_q, blocks):
    """Largest turn of a body in increments of the coordinates, rad; those about fixed axes count if `angles`."""
    largest = 0.0
    for k in range(blocks.size):
        if blocks[k].kind == ROTATION or (angles and blocks[k].kind == ANGLE):
            at, square = blocks[k].iv - n_q, 0.0
            for i in range(blocks[k].count):
                square += dq[at + i] * dq[at + i]
            largest = max(largest, square)
    return math.sqrt(largest)


@inlined
def is_idle(k, s, model):
    """Whether block k is a node that has not left its spool, or is fixed to another part."""
    switch = model.blocks[k].switch
    return switch == FIXED or (switch >= 0 and model.blocks[k].node >= s[switch])


def idle(model, s):
    """`is_idle` of all blocks: (n,) bool; not compiled."""
    switch, node = model.blocks["switch"], model.blocks["node"]
    counts = np.append(s, 0)[np.where(switch >= 0, switch, len(s))]
    return (switch == FIXED) | ((switch >= 0) & (node >= counts))


def block_at(model, velocity):
    """Block of a velocity, counted from the first one; not compiled."""
    first = model.blocks["iv"] - model.info.nq
    return model.blocks[(first <= velocity) & (velocity < first + model.blocks["count"])][0]


def indices(blocks, field, size=3):
    """The first `size` indices in the state of the coordinates ("iq") or velocities ("iv") of blocks: (n, size)."""
    return blocks[field][:, None] + np.arange(size)
