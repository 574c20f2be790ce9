"""What can be read off the states of a finished run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types, void

from evolvent import jit
from evolvent.flow import needs
from evolvent.flow.inventory import inventory
from evolvent.flow.rhs import rhs
from evolvent.jit import MATRIX, REAL, VECTOR, indirect
from evolvent.kernels import thread
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL, N_INVENTORY, Model


class Observations(NamedTuple):
    """Quantities at every sample, inertial frame, SI.

    Attributes
    ----------
    position, velocity : (nt, nn, 3) float, of all threads' nodes, wound ones on their spools
    tension : (nt, nn) float, N, of the segment inwards of each node (0 while it is wound)
    spool : (nt, np, 2) float, angle and rate of each thread's spool, rad and rad/s
    body_rotation : (nt, nb, 3, 3) float, body to inertial axes
    body_position, body_velocity, body_rate : (nt, nb, 3) float
    inventory : (nt, N_INVENTORY) float, energies and momenta (see `evolvent.flow.inventory`)
    """

    position: np.ndarray
    velocity: np.ndarray
    tension: np.ndarray
    spool: np.ndarray
    body_rotation: np.ndarray
    body_position: np.ndarray
    body_velocity: np.ndarray
    body_rate: np.ndarray
    inventory: np.ndarray


_3D, _4D = types.Array(REAL, 3, "C"), types.Array(REAL, 4, "C")


@indirect(
    void(VECTOR, MATRIX, types.Array(types.int64, 2, "C"), MODEL, _3D, _3D, MATRIX, _3D, _4D, _3D, _3D, _3D, MATRIX)
)
def fill_observations(times, Y, S, model, position, velocity, tension, spool, R, X, V, W, sums):
    """Fill `Observations`, all but the first four arguments, from the states Y, S at `times`."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    for n in range(times.size):
        rhs(times[n], Y[n], S[n], model, model.dy[0])
        for p in range(threads.size):
            for i in range(S[n, p]):
                tension[n, threads[p].node + i] = nodes[threads[p].node + i].tension
        inventory(times[n], Y[n], S[n], model, sums[n])
        for p in range(threads.size):
            first, b = threads[p].node, threads[p].body
            spool[n, p, 0] = threads[p].phi
            spool[n, p, 1] = threads[p].b[1] / threads[p].radius
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


def empty_observations(model: Model, n_t: int) -> Observations:
    """Room for `n_t` samples."""
    n_n, n_p, n_b = model.nodes.size, model.threads.size, model.bodies.size
    return Observations(
        np.zeros((n_t, n_n, 3)),
        np.zeros((n_t, n_n, 3)),
        np.zeros((n_t, n_n)),
        np.zeros((n_t, n_p, 2)),
        np.zeros((n_t, n_b, 3, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, N_INVENTORY)),
    )


def observe(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> Observations:
    """Evaluate all quantities at the samples of a run.

    Parameters
    ----------
    model : Model
    t, y, s : (nt,), (nt, ny), (nt, ns), as in `evolvent.solvers.Solution`
    """
    out = empty_observations(model, t.size)
    jit.load((*needs.explicit(model), fill_observations))
    fill_observations(t, np.ascontiguousarray(y), np.ascontiguousarray(s), model, *out)
    return out


def sums_of(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Energies and momenta of states: (nt, N_INVENTORY) float, see `evolvent.flow.inventory`.

    Parameters
    ----------
    t, y, s : (nt,), (nt, ny), (nt, ns), as in `evolvent.solvers.Solution`
    """
    out = np.empty((t.size, N_INVENTORY))
    needs.load_explicit(model)
    y, s = np.ascontiguousarray(y), np.ascontiguousarray(s)
    for k in range(t.size):
        inventory(t[k], y[k], s[k], model, out[k])
    return out
