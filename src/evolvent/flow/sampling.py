"""Compiled functions that evaluate the states of a finished run."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.flow.inventory import inventory
from evolvent.flow.rhs import rhs
from evolvent.kernels import hinge, joint, rigid, springs, thread
from evolvent.kernels.rotations import cross
from evolvent.model import KEPT, MODEL

_3D, _4D = types.Array(REAL, 3, "C"), types.Array(REAL, 4, "C")


@indirect(
    void(
        VECTOR, MATRIX, types.Array(types.int64, 2, "C"), MODEL, _3D, _3D, MATRIX, _3D, _4D, _3D, _3D, _3D, MATRIX, _3D
    )
)  # fmt: skip
def fill_observations(times, Y, S, model, position, velocity, tension, spool, R, X, V, W, sums, thread_sums):
    """Fill `observations.Observations`, all but the first four arguments, from the states Y, S at `times`."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    for n in range(times.size):
        rhs(times[n], Y[n], S[n], model, model.dy[0])
        for p in range(threads.size):
            for i in range(S[n, p]):
                tension[n, threads[p].node + i] = nodes[threads[p].node + i].tension
        inventory(times[n], Y[n], S[n], model, sums[n])
        for p in range(threads.size):
            thread.thread_inventory(Y[n], S[n], model, p, thread_sums[n, p])
            first, b = threads[p].node, threads[p].body
            spool[n, p, 0] = threads[p].phi
            spool[n, p, 1] = threads[p].b[1] / threads[p].r
            for i in range(threads[p].n):
                k = first + i
                if i < S[n, p]:
                    for c in range(3):
                        position[n, k, c] = nodes[k].x[c]
                        velocity[n, k, c] = nodes[k].v[c]
                    continue
                node = thread.wound_node(threads, bodies, p, i)
                w = bodies[b].w
                turning = cross(w[0], w[1], w[2], node[0], node[1], node[2])
                for c in range(3):
                    position[n, k, c] = bodies[b].x[c] + node[c]
                    velocity[n, k, c] = bodies[b].v[c] + turning[c] + node[3 + c]
        for b in range(bodies.size):
            for c in range(3):
                X[n, b, c] = bodies[b].x[c]
                V[n, b, c] = bodies[b].v[c]
                W[n, b, c] = bodies[b].w[c]
                for d in range(3):
                    R[n, b, c, d] = bodies[b].R[c, d]


@indirect(void(REAL, VECTOR, INTEGERS, VECTOR, MODEL))
def evaluate(t, y, s, la, model):
    """Fields that are results, of a state with the multipliers la of joints, into the records."""
    f = model.flexible
    rigid.kinematics(t, y, model)
    if model.springs.size > 0:
        springs.evaluate_springs(t, y, model)
    if f.hinges.size > 0:
        hinge.add_hinges(t, y, KEPT, s, model, f.F)
    for k in range(f.joints.size):
        joint.joint_geometry(t, y, k, model)
        joint.note_reaction(k, la[k], model)
