"""Form of a net by force densities, and lengths to which its cords are cut.

The force density of a cord is its tension over its length (Schek 1974, "The force density method for form finding and
computation of general networks"): with densities q the equilibrium of the free nodes is linear in their positions,
C_f^T Q (C_f x_f + C_r x_r) = p.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.nets.topology import Topology
from evolvent_base.errors import InputError

Array = np.ndarray
#: Most iterations of densities, and the change of positions, beside the size of the rim, by which they end.
MOST, CHANGE = 100, 1e-13
#: How much shorter than its length a slack cord is at least, beside it.
SLACK = 1e-3


class Form(NamedTuple):
    """A net in equilibrium, with the ends of its ties.

    Attributes
    ----------
    x : (n, 3) float, m, nodes
    density : (m,) float, N/m, force densities of the cords
    tie : (f,) float, N/m, force densities of the ties of the free nodes; empty without ties
    base : (n, 3) or (f, 3) float, m, nodes of the rear net or anchors of the ties; empty without ties
    """

    x: Array
    density: Array
    tie: Array
    base: Array


class Pull(NamedTuple):
    """What ties do.

    Attributes
    ----------
    height : function of x and y (f,), m, to the heights onto which they pull the free nodes; None with a tension
    tension : float, N, of all ties; 0 with heights
    """

    height: Callable[[Array, Array], Array] | None
    tension: float


class Rear(NamedTuple):
    """A rear net: (m,) force densities of its cords, N/m, and its rim (r, 3), m."""

    density: Array
    rim: Array


def branches(topology: Topology) -> scipy.sparse.csr_matrix:
    """Matrix C (m, n) of the cords: C x are their vectors, from the first node to the second."""
    return _differences(topology.cords, len(topology.plan))


def _differences(cords: Array, count: int) -> scipy.sparse.csr_matrix:
    """C (m, count) of cords (m, 2)."""
    m = len(cords)
    rows = np.repeat(np.arange(m), 2)
    return scipy.sparse.csr_matrix((np.tile([-1.0, 1.0], m), (rows, cords.ravel())), shape=(m, count))


def densities(topology: Topology, density: Array) -> scipy.sparse.csc_matrix:
    """C^T Q C (n, n), N/m."""
    C = branches(topology)
    return (C.T @ scipy.sparse.diags(density) @ C).tocsc()


def find_form(topology: Topology, rim: Array, density: Array) -> Array:
    """Positions (n, 3), m, of the nodes of a net without ties.

    Parameters
    ----------
    rim : (r, 3) float, m, of the nodes that are held
    density : (m,) float, N/m, force densities of the cords
    """
    return _solved(topology, rim, densities(topology, density), np.zeros(0), np.zeros((0, 3)))


def axial_form(topology: Topology, rim: Array, density: Array, pull: Pull) -> tuple[Array, Array]:
    """Positions (n, 3), m, of the nodes of a net whose ties pull along -z, and their tensions (f,), N."""
    D, free = densities(topology, density), topology.free
    x = _solved(topology, rim, D, np.zeros(0), np.zeros((0, 3)))
    if pull.height is not None:
        x[free, 2] = pull.height(x[free, 0], x[free, 1])
        return x, -(D @ x)[free, 2]
    load = np.full(len(free), pull.tension)
    x[free, 2] = scipy.sparse.linalg.splu(D[free][:, free]).solve(-load - (D[free][:, topology.rim] @ rim)[:, 2])
    return x, load


def tied_form(topology: Topology, rim: Array, density: Array, pull: Pull, start: tuple[Array, Array], base: Array,
              rear: Rear | None) -> Form:  # fmt: skip
    """A net with ties whose lower ends are anchors or nodes of a rear net.

    Parameters
    ----------
    start : nodes (n, 3), m, and tensions of the ties (f,), N, from which the iteration begins: those of `axial_form`
    base : (f, 3) or (n, 3) float, m, anchors, or nodes of the rear net from which it begins

    Notes
    -----
    With the densities of the ties both nets are linear in their positions. Those follow from the heights, or from the
    tension over the length, and are iterated: where ties are along z the first ones are exact.
    """
    D, free, size = densities(topology, density), topology.free, float(np.ptp(rim, axis=0).max())
    x, tension = start[0].copy(), start[1]
    behind = None if rear is None else densities(topology, rear.density)
    for _ in range(MOST):
        low = base if rear is None else base[free]
        along = x[free] - low
        if pull.height is not None and along[:, 2].min(initial=1.0) <= 0.0:
            raise InputError(
                f"the rear net comes above the net at node {free[int(along[:, 2].argmin())]}; give a greater distance "
                f"of both"
            )
        tie = tension / (along[:, 2] if pull.height is not None else np.linalg.norm(along, axis=1))
        new = _solved(topology, rim, D, tie, low)
        if pull.height is not None:
            new[free, 2] = pull.height(new[free, 0], new[free, 1])
            tension = -(D @ new)[free, 2]
        moved = float(np.abs(new - x).max())
        x = new
        if rear is not None:
            before, base = base, _solved(topology, rear.rim, behind, tie, x[free])
            moved = max(moved, float(np.abs(base - before).max()))
        if moved <= CHANGE * size:
            return Form(x, density, tie, base)
    raise InputError(
        f"the form of the net was not found in {MOST} iterations: ties are far from the direction of its axis; move "
        f"the rims of both nets, or the anchors, below one another"
    )


def _solved(topology: Topology, rim: Array, D: scipy.sparse.csc_matrix, tie: Array, low: Array) -> Array:
    """Nodes (n, 3) in equilibrium on the rim and ties with densities (f,) to their ends (f, 3)."""
    free, held = topology.free, topology.rim
    x = np.zeros((len(topology.plan), 3))
    x[held] = rim
    K, load = D[free][:, free], -(D[free][:, held] @ rim)
    if tie.size:
        K, load = K + scipy.sparse.diags(tie), load + tie[:, None] * low
    x[free] = scipy.sparse.linalg.splu(K.tocsc()).solve(load)
    return x


def slack_form(x: Array, free: Array, cords: Array, length: Array) -> Array:
    """Positions (n, 3), m, of the nodes with all cords shorter than their lengths, if there are such.

    Parameters
    ----------
    x : (n, 3) float, m, where the search begins; the nodes that are not free stay there
    free : (f,) int, nodes; cords : (m, 2) int; length : (m,) float, m, without tension

    Notes
    -----
    The nodes begin in the middle of their neighbours. The squares of what cords are longer than 0.999 of their
    lengths are then made least, until none is.
    """
    x, most = x.copy(), (1.0 - SLACK) * length
    C = _differences(cords, len(x))
    even = (C.T @ C).tocsc()
    held = np.setdiff1d(np.arange(len(x)), free)
    if not free.size:
        return x
    x[free] = scipy.sparse.linalg.splu(even[free][:, free]).solve(-(even[free][:, held] @ x[held]))

    def over(at: Array) -> tuple[float, Array]:
        x[free] = at.reshape(-1, 3)
        d = C @ x
        now = np.linalg.norm(d, axis=1)
        more = np.maximum(now - most, 0.0)
        slope = C.T @ (d * (2.0 * more / np.maximum(now, 1e-300))[:, None])
        return float(more @ more), np.asarray(slope)[free].ravel()

    options = {"maxiter": 5000, "maxfun": 10000, "ftol": 0.0, "gtol": 1e-9 * float(length.max())}
    found = scipy.optimize.minimize(over, x[free].ravel(), jac=True, method="L-BFGS-B", options=options)
    x[free] = found.x.reshape(-1, 3)
    return x


def cut_lengths(length: Array, tension: Array, stiffness: Array | float) -> Array:
    """Lengths without tension to which cords are cut, m.

    Parameters
    ----------
    length : float, m, under tension, N; stiffness : float, N, EA
    """
    return length / (1.0 + tension / stiffness)
