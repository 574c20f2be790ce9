"""Which modes an eigenproblem resolves: what names a mode, and what a motion without stiffness strains."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.assembly.blocks import owner_of
from evolvent.assembly.families import owner
from evolvent.kernels.blocks import block_at, displace
from evolvent.model.registry import asked, families
from evolvent.solvers.modal.positions import moving, rigid_motions
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.work import Work

Array = np.ndarray

#: Part of a mode's mass by which it may differ from rigid motions of its beams and rods where it has no stiffness.
STRAINED = 1e-4
#: Singular values, beside the largest, below which a rigid motion of a part moves none of its coordinates.
INDEPENDENT = 1e-9
#: Most motions among which those without stiffness are looked for.
MOST = 600
#: Part of the size of each coordinate by which states are displaced to see whether a spring resists; change of its
#: length beside that, below which it is round-off and curvature.
STEP, STRETCHED = 1e-3, 1e-5


class Naming:
    """Names of what moves in the shapes of one structure, for `evolvent.algebra.eigenproblem.Eigenproblem`.

    Parameters
    ----------
    work : Work, about whose state motions are small
    M : (nv, nv) sparse, mass matrix
    """

    def __init__(self, work: Work, M: Any) -> None:
        self.work, self.M = work, M
        self.assembly, self.y = work.assembly, work.balance.y.copy()

    def where(self, shape: Array) -> str:
        """Name of the part to which the largest entry of a shape (nv,) belongs."""
        block = block_at(self.assembly.model, int(np.argmax(np.abs(shape))))
        return repr(owner(self.assembly, *owner_of(block)))

    def _elastic(self) -> Iterator[tuple[str, slice, Array]]:
        """Beams and rods: names, coordinates, and rigid motions of these (n, 6)."""
        motions = rigid_motions(self.assembly, self.y, np.zeros(3))
        for name, (family, _, at) in moving(self.assembly).items():
            if families()[family].energies.bending is not None:
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

    def strains(self, V: Array, noise: Array, lost: Array) -> str:
        """The first beam, rod or spring that is strained in one of the shapes V (nv, k) without stiffness, or ''.

        Parameters
        ----------
        V : (nv, k) float
        noise : (k,) float, rad2/s2, what round-off may hide of their stiffness
        lost : (k,) bool, whether that may be a slow mode of a beam or rod; otherwise the load is a critical one

        Notes
        -----
        Elements of beams and rods have stiffness against all but rigid motions, whatever joints, springs and loads are.
        Springs count where round-off may hide what they add: otherwise something else has taken it away.
        """
        for name, at, motions in self._elastic():
            M, own = self.M[at, at], V[at][:, lost]
            R = motions / np.maximum(np.sqrt(np.einsum("ij,ij->j", motions, M @ motions)), 1e-300)
            rest = own - R @ np.linalg.lstsq(R.T @ (M @ R), R.T @ (M @ own), rcond=1e-12)[0]
            if np.any(np.einsum("ij,ij->j", rest, M @ rest) > STRAINED * np.einsum("ij,ij->j", V, self.M @ V)[lost]):
                return name
        for v, hidden in zip(V.T, noise, strict=True):
            name = self._hidden_spring(v, float(hidden))
            if name:
                return name
        return ""

    def _hidden_spring(self, v: Array, noise: float) -> str:
        """The first spring that resists a motion v (nv,) by less than `noise`, or ''."""
        weight = self.work.balance.weight
        step = STEP / float(np.max(np.abs(v) / weight))
        ends = [self._springs(sign * step * v) for sign in (1.0, -1.0)]
        self._springs(np.zeros(v.size))
        own = asked("energies.resists").items()
        for (name, (length, *_)), (x, force), (x_back, force_back) in zip(own, *ends, strict=True):
            dx, change = x - x_back, force - force_back
            size = STEP * (np.max(weight) if families()[name].results[length][1] == "m" else 1.0)
            square = np.abs(dx * change) / (4.0 * step**2 * float(v @ (self.M @ v)))
            moved = (np.abs(dx) > STRETCHED * size) & (np.abs(change) > 1e-9 * np.abs(force))
            found = np.flatnonzero(moved & (square <= noise))
            if found.size:
                return owner(self.assembly, name, int(found[0]))
        return ""

    def _springs(self, d: Array) -> list[tuple[Array, Array]]:
        """Lengths and forces of all springs where the state is displaced by d (nv,)."""
        work, b = self.work, self.work.balance
        displace(self.y, d, False, work.model, b.y)
        eq.unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
        rows = ((getattr(work.model, name), fields) for name, fields in asked("energies.resists").items())
        return [(row[x].copy(), sum(row[name] for name in forces)) for row, (x, *forces) in rows]
