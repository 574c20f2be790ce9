"""Points on cords that only pull, beside a coordinate: the mechanism in equilibrium where cords are slack or not.

Points that nothing but such cords holds, as the nodes of a net, have no place of their own while the cords are slack.
The energy of the cords is a convex function of the places of their ends. So it has one least value over the places of
the points, with all else where it is, and the forces on all else are the same wherever it has that value. At a
position the mechanism is first in equilibrium without these cords, and the least energy is sought on it. Where it is 0
the cords are slack, and that is the equilibrium. Else the mechanism is in equilibrium with them, sought from the last
such position, or from there.

Notes
-----
The least energy is 0 where the points have places at which no cord is longer than it is without tension. They are
sought with cords that are shorter by a billionth: then they are found by a finite number of iterations where there is
some room, and the forces of the cords are 0, not nearly so.

Iterations are those of Newton with a stiffness of the points that is added to the tangent and falls with their forces,
mu = max|F|/delta: what no cord holds moves by delta at most, and the rate of convergence stays quadratic also where a
least value is no point (Li, Fukushima, Qi & Yamashita 2004, "Regularized Newton methods for convex minimization
problems with singular solutions"). It is in no force, and so in no equilibrium. A point whose cords are all slack is in
no equation of the others, and stays where it is.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import weakref
from typing import Any

import numpy as np
import scipy

from evolvent.analysis.margins.positions import Position
from evolvent.analysis.margins.smoothed import SmoothedCords, cords_of
from evolvent.analysis.margins.stiffness import LARGEST, Stiffness, fulfils, independent, is_settled, scale_of
from evolvent.equations.implicit import tangent
from evolvent.kernels.blocks import POSITION, ROTATION, displace
from evolvent.solvers.static.work import falling, sparse_of

Array = np.ndarray

#: Factors of the lengths without tension: of cords that are never taut, and of those with which points are sought.
_NEVER, _SHORTER = 1e9, 1.0 - 1e-9
#: Least stiffness of the points beside the largest, at which they have a place.
_SINGULAR = 1e-13
#: Move of what nothing holds (delta) beside the size of the system, forces that are 0 beside stiffness times size.
_STEP, _BALANCED = 0.01, 1e-14
#: Iterations to the least energy and to an equilibrium; parts of a move that are tried; what is left of the slope
#: along it.
_ITERATIONS, _BALANCES, _TRIES, _LEFT = 200, 30, 30, 0.5
#: Least eigenvalue beside the largest diagonal that is round-off.
_STABLE = 1e-12


def pulling(model: Any, factor: float) -> dict[str, Array]:
    """Records of a model with the lengths of what only pulls times a factor; none where nothing only pulls."""
    found = dict[str, Array]()
    for name, rows in cords_of(model).items():
        found[name] = getattr(model, name).copy()
        found[name]["length"][rows] *= factor
    return found


class LoosePoints:
    """Points that cords alone hold, some of which are slack.

    Parameters
    ----------
    elastic : elastic.Elastic
    free : (n,) int, velocities of the points
    """

    def __init__(self, elastic: Any, free: Array) -> None:
        model, self._elastic, self._mechanism, self.free = elastic.model, elastic, elastic.mechanism, free
        self.model = model
        self.without = model._replace(**pulling(model, _NEVER))
        self._shorter = model._replace(**pulling(model, _SHORTER))
        self._size = float(np.median(elastic.weight[free]))
        self._smoothed = SmoothedCords(elastic, free, self._carried)
        #: Motions (nv, j) that nothing resists, as of the last iteration.
        self.flying = np.zeros((self._mechanism.n_v, 0))
        self._known = weakref.WeakKeyDictionary[Position, dict[tuple[int, ...], _Known]]()

    @classmethod
    def of(cls, elastic: Any, at: Position) -> LoosePoints | None:
        """Those of a position; None where there are none, or all have a place of their own."""
        never, one = pulling(elastic.model, _NEVER), elastic.mechanism
        blocks = one.bare.blocks
        places = blocks[blocks["kind"] == POSITION]
        points = places[~np.isin(places["iq"] + 3, blocks["iq"][blocks["kind"] == ROTATION])]
        if not never or not points.size:
            return None
        own = points["iv"][:, None] - one.n_q + np.arange(3)
        K = _tangent(elastic, at.y, at.t, elastic.model._replace(**never))
        held = np.abs(at.G).sum(axis=0) + np.abs(at.J).sum(axis=0) + np.abs(K).sum(axis=0).A1
        free = own[(held[own] == 0.0).all(axis=1) & (at.mass.diagonal()[own] > 0.0).all(axis=1)].ravel()
        if not free.size:
            return None
        squares = np.linalg.eigvalsh(_tangent(elastic, at.y, at.t, elastic.model)[free][:, free].toarray())
        if squares[0] > _SINGULAR * squares[-1]:
            return None
        found = cls(elastic, free)
        found.flying = found._flying(at)
        return found

    def _flying(self, at: Position) -> Array:
        """Motions (nv, j) that neither joints, nor held coordinates, nor a stiffness resist, but for the points."""
        A = np.vstack([at.G, self._mechanism.tied(at.J), at.J])
        found, _ = self._stiffness(at, A, list(range(at.x.size)), self.without, exact=True)
        N, S = _projected(found)
        even = _SINGULAR * float(np.abs(S.diagonal()).max(initial=0.0))
        try:
            np.linalg.cholesky(S - even * np.eye(len(S)))
            return self.flying
        except np.linalg.LinAlgError:
            squares, modes = np.linalg.eigh(S)
            return np.asarray(N @ modes[:, np.abs(squares) <= even])

    # ------------------------------------------------------------------------------------------------ equilibria

    def stand(self, rows: list[int], values: Array, at: Position) -> Position | None:
        """The equilibrium without the cords, with the least energy of these; rows, values, at: as of `settle`."""
        bare = self._balance(rows, values, at, self.without)
        return None if bare is None else self.least(bare)

    def settle(self, rows: list[int], values: Array, at: Position) -> Position | None:
        """The equilibrium in which the coordinates `rows` have `values`, sought from another position; or None."""
        found = None if self.is_slack(at) else self._taut(rows, values, at)
        if found is not None:
            return found
        least = self.stand(rows, values, at)
        return least if least is None or self.is_slack(least) else self._taut(rows, values, least)

    def _taut(self, rows: list[int], values: Array, at: Position) -> Position | None:
        """`settle` where cords pull at the position from which it is sought."""
        smoothed = self._smoothed.follow(rows, values, at, self.flying)
        if smoothed is None:
            return None
        found = self._balance(rows, values, smoothed, self.model) or smoothed
        self._smoothed.remember(found)
        return found

    def is_slack(self, at: Position) -> bool:
        """Whether no cord pulls at a position."""
        one = self._mechanism
        taut, without = (one.left(at.t, at.y, model, factor=1.0) for model in (self.model, self.without))
        return bool(np.array_equal(taut, without))

    def least(self, at: Position) -> Position:
        """The position at which the energy of the cords is least, with all but the points where it is."""
        y = at.y
        if not np.any(self._mechanism.left(at.t, y, self.without, factor=1.0)[self.free]):
            y = self._least(y, at.t, self._shorter, until_slack=True)
            if self.is_slack(at := self._mechanism.at(at.t, y)):
                return at
        return self._mechanism.at(at.t, self._least(y, at.t, self.model, until_slack=False))

    def _least(self, y: Array, t: float, model: Any, *, until_slack: bool) -> Array:
        """The state of least energy over the places of the points."""
        one, free = self._mechanism, self.free
        loaded = until_slack and one.left(t, y, self.without, factor=1.0)
        for _ in range(_ITERATIONS):
            if until_slack and np.array_equal(one.left(t, y, self.model, factor=1.0), loaded):
                break
            F = one.left(t, y, model, factor=1.0)[free]
            K = _tangent(self._elastic, y, t, model)[free][:, free]
            largest = float(np.abs(F).max())
            if largest <= _BALANCED * K.diagonal().max(initial=0.0) * self._size:
                break
            K = K + largest / (_STEP * self._size) * scipy.sparse.eye(free.size)
            d = np.zeros(one.n_v)
            d[free] = -scipy.sparse.linalg.splu(K.tocsc()).solve(F)
            y = self._moved(y, t, model, d, None)
        return y

    def _moved(self, y: Array, t: float, model: Any, d: Array, la: Array | None) -> Array:
        """The state after a part of a move d (nv,) with which the slope of the energy along it has fallen."""
        one = self._mechanism

        def slope(part: float) -> tuple[float, Array]:
            moved = y.copy()
            displace(y, part * d, False, one.bare, moved)
            return float(one.left(t, moved, model, la=la, factor=1.0)[: one.n_v] @ d), moved

        first, part = slope(0.0)[0], 1.0
        low, below, high, above = 0.0, first, math.inf, 0.0
        for _ in range(_TRIES):
            now, moved = slope(part)
            if first >= 0.0 or abs(now) <= _LEFT * abs(first) or (part == 1.0 and now <= 0.0):
                break
            if now > 0.0:
                high, above = part, now
            else:
                low, below = part, now
            part = low + (high - low) * min(max(below / (below - above), 0.1), 0.9)
        return moved

    def _balance(self, rows: list[int], values: Array, at: Position, model: Any) -> Position | None:
        """Newton's method with the coordinates held; the points stay where the cords are left out."""
        one, elastic, alone = self._mechanism, self._elastic, model is self.without
        before, left = math.inf, np.setdiff1d(np.arange(one.n_v), self.free)
        for _ in range(_BALANCES):
            x = at.x
            A = np.vstack([at.G, one.tied(at.J), at.J[rows]])
            b = -np.concatenate([at.gaps, one.stretch(x), x[rows] - values])
            try:
                found, balanced = self._stiffness(at, A, rows, model)
                F = found.F.copy()
                if alone:
                    F[self.free] = 0.0
                d, flying = found.move(b, F)
            except (np.linalg.LinAlgError, RuntimeError, ValueError):
                return None
            self.flying = flying
            size = float(np.abs(d / elastic.weight)[left].max(initial=0.0))
            if not math.isfinite(size):
                return None
            off = float(np.abs(b).max(initial=0.0))
            if is_settled(off, size, before) and (alone or balanced):
                return at
            before = size
            d *= min(1.0, LARGEST / max(float(np.abs(d / elastic.weight).max()), LARGEST))
            if fulfils(off) and not alone:
                y = self._moved(at.y, at.t, model, d, elastic.multipliers)
            else:
                y = self._carried(at.y, d)
            at = one.at(at.t, y)
        return None

    def _carried(self, y: Array, d: Array) -> Array:
        """The state after a move d (nv,) in which each body moves on the helix of its own velocity and turn.

        Bodies that turn together about an axis do so without a strain, however far.
        """
        one, moved = self._mechanism, y.copy()
        displace(y, d, False, one.bare, moved)
        blocks = one.bare.blocks
        turns = blocks[blocks["kind"] == ROTATION]
        turns = turns[np.isin(turns["iq"] - 3, blocks["iq"][blocks["kind"] == POSITION])]
        if not turns.size:
            return moved
        q, v = turns["iq"][:, None], turns["iv"][:, None] - one.n_q
        turned = scipy.spatial.transform.Rotation.from_quat(y[q + np.array([1, 2, 3, 0])])
        phi, along = turned.apply(d[v + np.arange(3)]), d[v - 3 + np.arange(3)]
        angle = np.linalg.norm(phi, axis=1)[:, None]
        small = angle < 1e-4
        size = np.where(small, 1.0, angle)
        first = np.where(small, 0.5, (1.0 - np.cos(size)) / size**2)
        second = np.where(small, 1.0 / 6.0, (size - np.sin(size)) / size**3)
        across = np.cross(phi, along)
        moved[q - 3 + np.arange(3)] += first * across + second * np.cross(phi, across)
        return moved

    def _stiffness(
        self, at: Position, A: Array, rows: list[int], model: Any, *, exact: bool = False
    ) -> tuple[Stiffness, bool]:
        """Forces and stiffness of a position, with that which is added for the points, and whether they are balanced.

        A, rows, model: as of `Elastic.tangent`; `exact`: nothing is added but of points whose cords are all slack.
        """
        elastic, free = self._elastic, self.free
        K, F = elastic.tangent(at, A, rows, model)
        stiff = K.diagonal()[free]
        typical = float(stiff.max(initial=0.0)) or 1.0
        largest = 0.0 if model is self.without else float(np.abs(F[free]).max())
        balanced = largest <= _BALANCED * typical * self._size
        added = np.zeros(K.shape[0])
        added[free] = np.where(abs(K[free][:, free]).sum(axis=1).A1 == 0.0, typical, 0.0)
        if not exact:
            added[free] += largest / (_STEP * self._size)
        K = (K + scipy.sparse.diags(added)).tocsr()
        scale = scale_of(K, elastic.weight)
        held, _ = independent(A * scale, mode="r")
        return Stiffness(K, at.mass, A, held, F, scale, self.flying, 0.0), balanced

    # ------------------------------------------------------------------------------------------------ directions

    def velocities(self, at: Position, A: Array, rows: list[int], b: Array, *, still: bool) -> tuple[Array, float]:
        """As `Elastic.velocities`; one decomposition for all coordinates that hold the same others."""
        first = A.shape[0] - len(rows)
        order = np.concatenate([np.arange(first), first + np.argsort(rows)])
        key = tuple(sorted(rows))
        known = self._known.setdefault(at, {})
        if key not in known:
            known[key] = _Known(self._stiffness(at, A[order], list(key), self.model, exact=True)[0])
        own = known[key]
        return own.found.move(b[order], np.zeros(own.found.F.size))[0], own.lowest if still else 0.0


@dataclasses.dataclass(frozen=True)
class _Known:
    """Stiffness of a position, with what is found of it once."""

    found: Stiffness

    @functools.cached_property
    def lowest(self) -> float:
        """Lowest eigenvalue of S where it is below 0, else 0."""
        found, D = self.found, scipy.sparse.diags(self.found.scale)
        K = D @ found.K @ D
        even = _STABLE * float(np.abs(K.diagonal()).max(initial=0.0))
        A = found.A[found.rows] * found.scale
        if falling(K + even * scipy.sparse.eye(K.shape[0]), A / np.linalg.norm(A, axis=1)[:, None]) == 0:
            return 0.0
        S = _projected(found)[1]
        S += _STABLE * float(np.abs(S.diagonal()).max(initial=0.0)) * np.eye(len(S))
        return min(float(np.linalg.eigvalsh(S).min(initial=0.0)), 0.0)


def _projected(found: Stiffness) -> tuple[Array, Array]:
    """Motions N (nv, n) that nothing holds, and the stiffness S = N^T K N along them."""
    _, N = independent(found.A * found.scale)
    N = found.scale[:, None] * N
    S = N.T @ (found.K @ N)
    return N, 0.5 * (S + S.T)


def _tangent(elastic: Any, y: Array, t: float, model: Any) -> Any:
    """Derivatives (nv, nv) of the forces of a model without those of what holds, sparse."""
    one = elastic.mechanism
    one.left(t, y, model, factor=1.0)
    tangent(t, y, one.none[1], 0.0, 0.0, 1.0, model, elastic.matrix)
    return sparse_of(elastic.matrix)[: one.n_v, : one.n_v]
