"""Elastic parts beside joints: the mechanism in equilibrium at a position, and how it moves on slowly from there.

Beams, rods, threads and points on springs follow the coordinates of joints, and yield to what touches them. With the
coordinates held, the gradients A of joints, loops of cables and held coordinates, and the forces F of all elastic
parts, springs, contacts, loads and weights on the left of the equations, a position is in equilibrium where
F + A^T la = M a, with an acceleration a along those motions alone that nothing resists, such as those of a free
satellite.

Notes
-----
Moves are d = D u, with scales D by which the stiffness of every coordinate is near 1. Of those that A lets free,
u = N w, S = N^T D K D N with the tangent K of F + A^T la. Motions X of S X = 0 are free; they have the acceleration
a = -X (X^T M X)^-1 X^T F, and none of them is in a move. Eigenvalues of S below 0 are those of a shape that snaps. A
direction fulfils (K v)_N = 0: it is the tangent of the path of equilibria, so the share of an elastic part is the rate
at which it gives up its energy on the way. One that is carried along alone has none.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.algebra.sparse import clear
from evolvent.analysis.margins.loose import LoosePoints
from evolvent.analysis.margins.positions import MechanismModels, Position
from evolvent.analysis.margins.shares import is_held, of_family
from evolvent.analysis.margins.stiffness import LARGEST, Stiffness, independent, is_settled, scale_of
from evolvent.equations.implicit import energies, tangent
from evolvent.kernels.blocks import displace
from evolvent.model.registry import families, motions, motions_of
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.common.sizes import sizes
from evolvent.solvers.static import equilibrium
from evolvent.solvers.static.work import spare_of, sparse_of
from evolvent_base.errors import InputError

Array = np.ndarray

#: Rank of constraints; eigenvalue of S below which a motion is free.
_RANK, _FREE = 1e-10, 1e-13
#: What masses of the tangent may be off those of the residual, of the largest.
_SAME = 1e-12
#: Iterations.
_ITERATIONS = 30
#: Largest move of a coordinate in a step, rad or m, and the smallest part of a step, also where cords are taut: softly
#: held parts that many cords bend would ask for too many steps.
_MOVE, _SMALLEST, _SMALLEST_TAUT = 0.2, 1.0 / 1024.0, 1.0 / 32.0
#: Function of coordinates that are held, their values, and a position to another one; None where it is not found.
Search = Callable[[list[int], Array, Position], Position | None]


class Elastic:
    """Equilibria of a mechanism with elastic parts.

    Parameters
    ----------
    mechanism : MechanismModels, of which the coordinates are held
    """

    def __init__(self, mechanism: MechanismModels) -> None:
        whole, self.mechanism = mechanism.whole, mechanism
        still = motions_of(mechanism.bare).copy()
        still["stiffness"] = 1.0
        changes, pushing = {motions(): still}, dict[str, Array]()
        for family in families().values():
            own = of_family(family.name)
            if is_held(family):
                changes[family.name] = mdl.zeros(family.name, 0)
            elif own.contact is not None:
                changes[family.name] = own.contact.pressing(family.records(whole), False)
            if own.elastic is not None and own.elastic.pushing is not None:
                pushing |= own.elastic.pushing(whole)
        #: The model with all forces but friction and those of held coordinates, whose springs stand for the torques
        #: that hold them.
        self.model = whole._replace(**changes)
        #: The same with threads that push as well, which show how they go taut; None without any that go slack.
        self._pushing = self.model._replace(**pushing) if pushing else None
        self.matrix = matrix_of(self.model, spare=spare_of(self.model))
        self.weight, _ = sizes(mechanism.assembly)
        self._last: tuple[Position, list[int], Any, Stiffness] | None = None
        #: Of the last tangent, multipliers of the joints (nj,).
        self.multipliers = mechanism.none[1]
        self._loose: LoosePoints | None = None
        self._asked = False

    def loose(self, at: Position) -> LoosePoints | None:
        """Points that cords alone hold, if some have no place of their own at the first position that is asked for."""
        if not self._asked:
            self._loose, self._asked = LoosePoints.of(self, at), True
        return self._loose

    def mass(self, at: Position) -> Any:
        """Mass matrix of a position by the tangent, (nv, nv), sparse; None where that has more than masses."""
        one, found = self.mechanism, list[Any]()
        one.left(at.t, at.y, one.bare)
        for c_mass in (1.0, 0.0):
            tangent(at.t, at.y, one.none[1], c_mass, 0.0, 0.0, one.bare, self.matrix)
            found.append(sparse_of(self.matrix)[: one.n_v, : one.n_v])
        M = found[0] - found[1]
        M = 0.5 * (M + M.T)
        a = np.cos(np.arange(one.n_v))
        wanted = one.left(at.t, at.y, one.bare, a=a)[: one.n_v] - at.zero
        off, size = np.abs(M @ a - wanted), abs(M) @ np.abs(a) + np.abs(wanted)
        return M if np.all(off <= _SAME * size.max(initial=0.0)) and np.all(M.diagonal() > 0.0) else None

    def tangent(self, at: Position, A: Array, rows: list[int], model: Any) -> tuple[Any, Array]:
        """Tangent (nv, nv), sparse, and forces (nv,) of a position.

        Parameters
        ----------
        A : (n, nv) float, gradients of the joints, of loops of cables and of the coordinates `rows`
        model : `Elastic.model`, or that with threads that push
        """
        one, n_v = self.mechanism, self.mechanism.n_v
        a = None
        if np.any(one.spin[:3]):
            a = np.zeros(n_v)
            equilibrium.turning(1.0, one.spin, at.y, model, a)
        motions_of(model)["rest"] = at.x
        F = one.left(at.t, at.y, model, a=a, factor=1.0)[:n_v]
        # those of the motion from rest: in equilibrium what is out of balance accelerates free motions alone
        B = at.mass.half(A.T)
        acts = np.any(B, axis=1)
        norms = np.linalg.norm(B, axis=0)
        norms[norms == 0.0] = 1.0
        la = -np.linalg.lstsq((B / norms)[acts], at.mass.half(F)[acts], rcond=_RANK)[0] / norms
        # the torques that hold the coordinates, since their gradients turn as well
        torques = np.zeros(at.x.size)
        for tie, mu in zip(one.ties, la[one.n_j :], strict=False):
            for k, ratio in zip(tie.motions, tie.ratios, strict=True):
                torques[k] += ratio * mu
        torques[rows] += la[one.n_j + len(one.ties) :]
        motions_of(model)["rest"] = at.x - torques
        self.multipliers = multipliers = np.ascontiguousarray(la[: one.n_j])
        one.left(at.t, at.y, model, a=a, la=multipliers, factor=1.0)
        tangent(at.t, at.y, multipliers, 0.0, 0.0, 1.0, model, self.matrix)
        K = sparse_of(self.matrix)[:n_v, :n_v]
        if a is not None:
            clear(self.matrix)
            equilibrium.add_turning_tangent(1.0, one.spin, at.y, model, self.matrix)
            K = K + sparse_of(self.matrix)[:n_v, :n_v]
        return K, F

    def stiffness(self, at: Position, A: Array, rows: list[int], model: Any) -> Stiffness:
        """Forces and stiffness of a position; A, rows, model: as of `tangent`."""
        if self._last is not None and self._last[0] is at and self._last[1] == rows and self._last[2] is model:
            return self._last[3]
        K, F = self.tangent(at, A, rows, model)
        scale = scale_of(K, self.weight)
        held, N = independent(A * scale)
        N = scale[:, None] * N
        S = N.T @ (K @ N)
        squares, modes = np.linalg.eigh(0.5 * (S + S.T))
        resists = np.abs(squares) > _FREE * np.abs(squares).max(initial=0.0)
        lowest = float(squares[resists].min(initial=0.0))
        found = Stiffness(K, at.mass, A, held, F, scale, N @ modes[:, ~resists], lowest)
        self._last = at, list(rows), model, found
        return found

    def velocities(self, at: Position, A: Array, rows: list[int], b: Array, *, still: bool) -> tuple[Array, float]:
        """Velocities v with A v = b along the path of equilibria, (nv,), and the lowest eigenvalue of S.

        Parameters
        ----------
        still : bool, whether the position is to be an equilibrium, of which the latter counts
        """
        loose = self.loose(at)
        try:
            if loose is not None:
                return loose.velocities(at, A, rows, b, still=still)
            found = self.stiffness(at, A, rows, self.model)
            return found.move(b, np.zeros(found.F.size))[0], found.lowest
        except (np.linalg.LinAlgError, RuntimeError, ValueError):
            k, one = rows[-1], self.mechanism
            raise InputError(
                f"the stiffness of the elastic parts says nothing of how they move where {one.names[k]!r} is at "
                f"{float(at.x[k]):.6g} {one.unit(k)}: it is singular there"
            ) from None

    def energy(self, at: Position) -> float:
        """Elastic energy of all but the coordinates, J."""
        found, one = np.zeros(3), self.mechanism
        one.left(at.t, at.y, self.model, factor=1.0)
        energies(at.t, at.y, self.model, found)
        return float(found[1])

    def move(self, targets: dict[int, float], at: Position, *, by: Search | None = None) -> Position:
        """The equilibrium in which coordinates have the values `targets`, from another position.

        Parameters
        ----------
        by : finds what is sought in place of the equilibrium, None where that is not there

        Raises
        ------
        InputError
            If it is not found.
        """
        one, rows = self.mechanism, list(targets)
        start, end = at.x[rows].copy(), np.array([targets[k] for k in rows])
        share, step = 0.0, min(1.0, _MOVE / max(float(np.abs(end - start).max(initial=0.0)), _MOVE))
        left, loose = None, self.loose(at)
        smallest = _SMALLEST if loose is None or by is not None else _SMALLEST_TAUT
        by = by or (None if loose is None else loose.settle)
        while share < 1.0:
            upto, switches = min(1.0, share + step), one.bare.switches.copy()
            values, near = start + (end - start) * upto, at
            if by is not None:
                found = by(rows, values, at)
            else:
                if self._pushing is not None:
                    near = self._balance(rows, values, at, left, 1.0 - upto, self._pushing)[0] or at
                found, first = self._balance(rows, values, near, left, 1.0 - upto, self.model)
                if left is None:
                    left = first
            if found is not None:
                share, at = upto, found
                one.count_turns()
                continue
            one.bare.switches[:] = switches
            step *= 0.5
            if step < smallest:
                k = rows[0]
                raise InputError(
                    f"the elastic parts have no equilibrium that is found beyond {float(at.x[k]):.6g} {one.unit(k)} of "
                    f"{one.names[k]!r}, with the coordinates held; where all open at once give `others: together`; "
                    "a run finds what happens there"
                )
        return at

    def _balance(
        self, rows: list[int], values: Array, at: Position, left: Array | None, share: float, model: Any
    ) -> tuple[Position | None, Array | None]:
        """Newton's method; None where it does not converge. `share` of the forces `left` may be out of balance.

        Returns
        -------
        position, and the forces out of balance at the first one
        """
        one, before, first = self.mechanism, math.inf, left
        found: Stiffness | None = None
        decomposed: Position | None = None  # where `found` knows the free motions by themselves
        for _ in range(_ITERATIONS):
            x = at.x
            A = np.vstack([at.G, one.tied(at.J), at.J[rows]])
            b = -np.concatenate([at.gaps, one.stretch(x), x[rows] - values])
            try:
                if found is None:
                    found, decomposed = self.stiffness(at, A, rows, model), at
                else:
                    K, F = self.tangent(at, A, rows, model)
                    found = dataclasses.replace(found, K=K, F=F, M=at.mass, A=A)
                first = found.F if first is None else first
                d, free = found.move(b, found.F - share * first)
            except (np.linalg.LinAlgError, RuntimeError, ValueError):  # singular or not finite
                if decomposed is at:
                    return None, first
                found = None
                continue
            found = dataclasses.replace(found, free=free)
            size = float(np.abs(d / self.weight).max(initial=0.0))
            if not math.isfinite(size):
                return None, first
            off = float(np.abs(b).max(initial=0.0))
            if is_settled(off, size, before):
                if decomposed is at:
                    return at, first
                found, before = None, size  # what was free before may have a stiffness now
                continue
            before = size
            moved = at.y.copy()
            displace(at.y, d * min(1.0, LARGEST / size), False, one.bare, moved)
            at = one.at(at.t, moved)
        return None, first
