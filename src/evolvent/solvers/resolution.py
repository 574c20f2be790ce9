"""Which modes an eigenproblem resolves: what names a mode, and what a motion without stiffness strains."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels.blocks import OWNERS, block_at
from evolvent.solvers.positions import moving, rigid_motions

Array = np.ndarray

#: Part of a mode's mass by which it may differ from rigid motions of its beams and rods where it has no stiffness.
STRAINED = 1e-4
#: Singular values, beside the largest, below which a rigid motion of a part moves none of its coordinates.
INDEPENDENT = 1e-9
#: Most motions among which those without stiffness are looked for.
MOST = 600


class Naming:
    """Names of what moves in the shapes of one structure, for `evolvent.solvers.eigenproblem.Problem`.

    Parameters
    ----------
    assembly : Assembly
    y : (ny,) float, state about which motions are small
    M : (nv, nv) sparse, mass matrix
    """

    def __init__(self, assembly: Assembly, y: Array, M: Any) -> None:
        self.assembly, self.y, self.M = assembly, y, M

    def where(self, shape: Array) -> str:
        """Name of the part to which the largest entry of a shape (nv,) belongs."""
        block = block_at(self.assembly.model, int(np.argmax(np.abs(shape))))
        return repr(owner(self.assembly, OWNERS[block["family"]], int(block["owner"])))

    def _elastic(self) -> Iterator[tuple[str, slice, Array]]:
        """Beams and rods: names, coordinates, and rigid motions of these (n, 6)."""
        motions = rigid_motions(self.assembly, self.y, np.zeros(3))
        for name, (family, _, at) in moving(self.assembly).items():
            if family in ("beams", "rods"):
                own = motions[at].copy()
                own[:, 3:] -= own[:, :3] @ own[:3, 3:]  # about the root, whose position comes first
                yield name, at, own

    def rigid(self, weight: Array) -> Array | None:
        """Motions of all coordinates, of beams and rods as rigid bodies: (nv, r); None where they are too many.

        Parameters
        ----------
        weight : (nv,) float, size of each coordinate that counts as 1; beside it the motions are orthonormal
        """
        found, others = [], np.ones(weight.size, dtype=bool)
        for _, at, motions in self._elastic():
            others[at] = False
            U, size, _ = np.linalg.svd(motions / weight[at, None], full_matrices=False)
            whole = np.zeros((weight.size, int(np.sum(size > INDEPENDENT * size[0]))))
            whole[at] = weight[at, None] * U[:, : whole.shape[1]]  # a straight cable has no twist
            found.append(whole)
        if sum(motions.shape[1] for motions in found) + int(np.sum(others)) > MOST:
            return None
        return np.hstack([*found, np.diag(weight)[:, others]])

    def strains(self, V: Array) -> str:
        """The first beam or rod that moves otherwise than a rigid body in one of the shapes V (nv, k), or ''.

        Notes
        -----
        Elements of beams and rods have stiffness against all other motions, whatever joints, springs and loads are.
        """
        for name, at, motions in self._elastic():
            M, own = self.M[at, at], V[at]
            R = motions / np.maximum(np.sqrt(np.einsum("ij,ij->j", motions, M @ motions)), 1e-300)
            rest = own - R @ np.linalg.lstsq(R.T @ (M @ R), R.T @ (M @ own), rcond=1e-12)[0]
            if np.any(np.einsum("ij,ij->j", rest, M @ rest) > STRAINED * np.einsum("ij,ij->j", V, self.M @ V)):
                return name
        return ""
