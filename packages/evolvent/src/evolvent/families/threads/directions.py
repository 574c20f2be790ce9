"""States of threads with segments of fixed length: directions as coordinates, or positions.

Both functions are given the model of explicit methods, whose coordinates are directions.
"""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect
from evolvent.kernels import rigid, thread
from evolvent.model import MODEL


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def write_positions(t, y, s, model):
    """Write positions and velocities of the nodes in place of the directions; zeros of wound nodes."""
    threads, nodes = model.threads, model.nodes
    rigid.kinematics(t, y, model)
    thread.reels(t, y, s, model)
    for p in range(threads.size):
        if threads[p].kind != thread.INEXTENSIBLE:
            continue
        thread.chain_points(y, s, model, p)
        for i in range(threads[p].n):
            q, v, k = threads[p].iq + 3 * i, threads[p].iv + 3 * i, threads[p].node + i
            for c in range(3):
                y[q + c] = nodes[k].x[c] if i < s[p] else 0.0
                y[v + c] = nodes[k].v[c] if i < s[p] else 0.0


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def write_directions(t, y, s, model):
    """Write directions and their rates in place of positions and velocities of the nodes.

    Of a segment without length those of its neighbour, or the direction in which the thread leaves its spool.
    """
    threads = model.threads
    rigid.kinematics(t, y, model)
    thread.reels(t, y, s, model)
    for p in range(threads.size):
        if threads[p].kind != thread.INEXTENSIBLE:
            continue
        last, Q = s[p] - 1, threads[p].Q
        for i in range(s[p]):
            q, v = threads[p].iq + 3 * i, threads[p].iv + 3 * i
            if i == last and s[threads.size + p] != 0:
                continue
            square = along = 0.0
            for c in range(3):
                y[q + c] -= y[q + 3 + c] if i < last else Q[c]
                y[v + c] -= y[v + 3 + c] if i < last else Q[3 + c]
                square += y[q + c] * y[q + c]
            length = math.sqrt(square)
            if i == last and length <= thread.SHORT * threads[p].segment:
                for c in range(3):
                    y[q + c] = y[q - 3 + c] if i > 0 else threads[p].X[c]
                    y[v + c] = y[v - 3 + c] if i > 0 else 0.0
                continue
            for c in range(3):
                y[q + c] /= length
                along += y[q + c] * y[v + c]
            for c in range(3):
                y[v + c] = (y[v + c] - along * y[q + c]) / length
        for i in range(s[p], threads[p].n):
            for c in range(3):
                y[threads[p].iq + 3 * i + c] = threads[p].X[c]
                y[threads[p].iv + 3 * i + c] = 0.0
