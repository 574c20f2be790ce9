"""Vectors and powers of loads by laws, and of moments and follower forces on beams, over all samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import elements
from evolvent.kernels import node_loads
from evolvent.kernels.flexible import CABLE
from evolvent.results.observe.variables import cross, dot, norm
from evolvent.results.observe.view import View

Array = np.ndarray


def law_values(view: View, address: int, first: int, last: int, x: Array, v: Array) -> Array:
    """What a law returns at points x with velocities v, (nt, 3) each: (nt, 3)."""
    parameters = np.ascontiguousarray(view.model.parameters[first:last])
    law = view.assembly.expressions[first][0] if first in view.assembly.expressions else view.assembly.laws[address]
    found = [
        law(np.ascontiguousarray(x[k]), np.ascontiguousarray(v[k]), t, parameters)
        for k, t in enumerate(view.t.tolist())
    ]
    return np.array(found, dtype=float).reshape(-1, 3)


def node_vectors(view: View, row: Any) -> tuple[Array, Array]:
    """Force or moment of a load on a beam's node for a value of 1, and what it does for that, (nt, 3) and (nt,)."""
    cable = view.model.flexible.beams["kind"][row["beam"]] == CABLE
    iq, iv, k = int(row["iq"]), int(row["iv"]), 2 if cable else 4
    nodes, rates = (np.stack([view.coordinates(at + 3 * i) for i in range(k)], axis=1) for at in (iq, iv))
    v = section_turns(nodes, rates) if row["kind"] == node_loads.MOMENT else rates[:, 0]
    vector = np.broadcast_to(row["axis"], v.shape)
    if row["law"] != 0:
        vector = law_values(view, int(row["law"]), int(row["first"]), int(row["last"]), nodes[:, 0], v)
    if row["frame"] != 0:
        vector = np.einsum("tij,ti->tj", section_axes(nodes), vector)
    return vector, dot(vector, v)


def section_axes(nodes: Array) -> Array:
    """Axes (nt, 3, 3), a row each, of the sections of a node (nt, 4, 3): `node_loads.section_axes`."""
    n = cross(nodes[:, 2], nodes[:, 3])
    n = n / norm(n)[:, None]
    b = nodes[:, 2] / norm(nodes[:, 2])[:, None]
    return np.stack([n, b, cross(n, b)], axis=1)


def section_turns(nodes: Array, rates: Array) -> Array:
    """Angular velocity (nt, 3) of the sections of a node (nt, 2 or 4, 3): `node_loads.section_turn`."""
    if nodes.shape[1] == 2:
        return np.asarray(cross(nodes[:, 1], rates[:, 1]) / dot(nodes[:, 1], nodes[:, 1])[:, None])
    b, c, u, v = nodes[:, 2], nodes[:, 3], rates[:, 2], rates[:, 3]
    n = cross(b, c)
    area = norm(n)[:, None]
    n = n / area
    p, q = cross(c, n) / area, cross(n, b) / area
    turn = -p * dot(n, u)[:, None] - q * dot(n, v)[:, None]
    return np.asarray(0.5 * (cross(n, turn) + cross(p, u) + cross(q, v)))


def line_resultant(view: View, row: Any, nodes: Array, rates: Array) -> tuple[Array, Array]:
    """Resultant (nt, 3) and power (nt,) of a force per length by a law on a beam's nodes (nt, n + 1, vectors, 3)."""
    n = nodes.shape[1] - 1
    step = float(view.model.flexible.beams["length"][row["beam"]]) / n
    force, power = np.zeros((view.t.size, 3)), np.zeros(view.t.size)
    for i in range(n):
        for xi, weight in node_loads.GAUSS:
            S = elements.axis_shape(step, xi)
            x, v = (
                S[0] * of[:, i, 0] + S[1] * of[:, i, 1] + S[2] * of[:, i + 1, 0] + S[3] * of[:, i + 1, 1]
                for of in (nodes, rates)
            )
            f = weight * step * law_values(view, int(row["law"]), int(row["first"]), int(row["last"]), x, v)
            force += f
            power += dot(f, v)
    return force, power
