"""Where states of shells leave the range in which their elements hold."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.shells.stiffness import LARGEST_TURN, largest_turns

Array = np.ndarray


def beyond_elements(solution: Any) -> Iterator[str]:
    """Elements between whose nodes the normals turn too far, and those that are inverted, at the samples."""
    model = solution.assembly.model
    for name, (family, index) in solution.assembly.names.items():
        if family != "shells":
            continue
        row = model.shells[index]
        first, count = int(row["first_element"]), int(row["elements"])
        quads = model.shell_elements["nodes"][first : first + count] - int(row["first_body"])
        x, normals = _nodes(solution, int(row["first_body"]), int(row["nodes"]))
        turn = np.stack([largest_turns(own[quads]) for own in normals])
        k, element = np.unravel_index(turn.argmax(), turn.shape)
        if turn[k, element] > LARGEST_TURN:
            yield (
                f"the normals of element {element} of {name!r} are {turn[k, element]:.0f} deg apart at "
                f"t = {solution.t[k]:.6g} s; its strains hold up to {LARGEST_TURN:g} deg: the fold needs smaller "
                f"elements"
            )
        sense = np.stack([_senses(own[quads], axes[quads]) for own, axes in zip(x, normals, strict=True)])
        k, element = np.unravel_index(sense.argmin(), sense.shape)
        if sense[k, element] <= 0.0:
            yield (
                f"element {element} of {name!r} is inverted at t = {solution.t[k]:.6g} s: its nodes no longer go round "
                f"their normals; use smaller elements there, or smaller loads"
            )


def _nodes(solution: Any, first: int, count: int) -> tuple[Array, Array]:
    """Positions and normals of nodes, (nt, count, 3) each."""
    bodies = solution.assembly.model.bodies[first : first + count]
    x = np.broadcast_to(bodies["x0"], (len(solution.t), count, 3)).copy()
    normals = np.broadcast_to(bodies["R0"][:, :, 2], x.shape).copy()
    free = np.flatnonzero(bodies["iq"] >= 0)
    q = solution.y[:, bodies["iq"][free, None] + np.arange(7)]
    x[:, free] = q[..., :3]
    w, a, b, c = np.moveaxis(q[..., 3:], -1, 0)
    normals[:, free] = np.stack([2.0 * (a * c + w * b), 2.0 * (b * c - w * a), 1.0 - 2.0 * (a * a + b * b)], axis=-1)
    return x, normals


def _senses(x: Array, normals: Array) -> Array:
    """Least sine of the inner angles of elements (n, 4, 3) about the normals of their nodes, (n,)."""
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    sizes = np.linalg.norm(after, axis=2) * np.linalg.norm(before, axis=2)
    turned = np.sum(np.cross(after, before) * normals, axis=2)
    return np.asarray((turned / np.maximum(sizes, 1e-300)).min(axis=1))
