"""Form of a net by force densities, and lengths to which its cords are cut.

The force density of a cord is its tension over its length (Schek 1974, "The force density method for form finding and
computation of general networks"): with densities q the equilibrium of the free nodes is linear in their positions,
C_f^T Q (C_f x_f + C_r x_r) = p.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from evolvent.nets.topology import Topology

Array = np.ndarray


class Form(NamedTuple):
    """A net in equilibrium.

    Attributes
    ----------
    x : (n, 3) float, m, nodes
    length : (m,) float, m, of the cords
    tension : (m,) float, N
    tie : (n,) float, N, forces of the ties against z, 0 at the rim
    rim_force : (r, 3) float, N, of the net on what holds it at its rim
    """

    x: Array
    length: Array
    tension: Array
    tie: Array
    rim_force: Array


def branches(topology: Topology) -> scipy.sparse.csr_matrix:
    """Matrix C (m, n) of the cords: C x are their vectors, from the first node to the second."""
    m = len(topology.cords)
    rows = np.repeat(np.arange(m), 2)
    return scipy.sparse.csr_matrix(
        (np.tile([-1.0, 1.0], m), (rows, topology.cords.ravel())), shape=(m, len(topology.plan))
    )


def densities(topology: Topology, x: Array, density: Array) -> scipy.sparse.csc_matrix:
    """C^T Q C (n, n), N/m."""
    C = branches(topology)
    return (C.T @ scipy.sparse.diags(density) @ C).tocsc()


def find_form(topology: Topology, rim: Array, density: Array, *, tie: Array | None = None,
              wanted: object = None) -> Form:  # fmt: skip
    """Positions of the free nodes in equilibrium.

    Parameters
    ----------
    rim : (r, 3) float, m, positions of the nodes that are held
    density : (m,) float, N/m, force densities of the cords
    tie : (n,) float, N, forces of ties against z; with a wanted surface those that bring the nodes onto it
    wanted : Surface, optional
    """
    C = branches(topology)
    D = (C.T @ scipy.sparse.diags(density) @ C).tocsc()
    free, held = topology.free, topology.rim
    x = np.zeros((len(topology.plan), 3))
    x[held] = rim
    load = np.zeros_like(x)
    if tie is not None:
        load[:, 2] = -tie
    solve = scipy.sparse.linalg.splu(D[free][:, free])
    x[free] = solve.solve(load[free] - D[free][:, held] @ rim)
    if wanted is not None:
        x[free, 2] = wanted.height(x[free, 0], x[free, 1])
    residual = D @ x
    pull = np.zeros(len(x))
    pull[free] = -residual[free, 2]
    along = C @ x
    length = np.linalg.norm(along, axis=1)
    return Form(x, length, density * length, pull, -residual[held])


def cut_lengths(length: Array, tension: Array, stiffness: Array | float, strain: float = 0.0) -> Array:
    """Lengths without tension to which cords are cut, m.

    Parameters
    ----------
    length : float, m, under tension, N; stiffness : float, N, EA
    strain : float, by which the cords are longer, warmer or colder than when they are cut
    """
    return length / ((1.0 + tension / stiffness) * (1.0 + strain))
