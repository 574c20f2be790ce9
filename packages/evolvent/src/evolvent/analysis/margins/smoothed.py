"""Equilibria in which many cords go taut or slack, with cords that pull a little where they are slack.

The tension T of a cord with the stiffness k and the extension x is k max(x, 0). With T = k (x + s) and T s = mu it is
smooth, and so are the equilibria along a travel: which cords pull follows from them. As mu falls they tend to those of
the cords themselves (the path of an interior-point method).

Notes
-----
T and s of each cord are unknowns of their own, and so are the strains by which the stresses of other stiff parts bend
the tangent: from an iteration to the next they change by what is linear in the move. Those that follow from the places
are off by squares of turns, times a stiffness that is a million times that of bending, and such a tangent is of no use
beyond turns of a thousandth (mixed integration points: Magisano, Leonetti & Garcea 2017). At the end both are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evolvent.analysis.margins.positions import Position
from evolvent.analysis.margins.shares import of_family
from evolvent.analysis.margins.stiffness import LARGEST, Stiffness, fulfils, independent, is_settled, scale_of
from evolvent.kernels.blocks import displace
from evolvent.model.registry import families

Array = np.ndarray

#: The parameter mu beside the largest T^2/k of a cord, and beside k times the square of the size of the system.
_SMOOTH, _LEAST = 1e-3, 1e-17
#: By how much mu is lowered at the end of a travel, how often, and what T s may be off it.
_LOWER, _LOWERED, _OFF = 1e-2, 5, 1e-3
#: Iterations; few, after which steps grow by a factor, and short ones that end a search; their length.
_ITERATIONS, _FEW, _GROW, _SHORT, _SHORTEST = 40, 10, 1.4, 3, 0.02
#: Part of the way to T = 0 or s = 0 that an iteration may take.
_INSIDE = 0.95
#: Steps of coordinates, rad or m: the first one, the largest and the smallest.
_FIRST, _MOST, _SMALLEST = 0.01, 0.06, 1e-5
#: Largest move by which derivatives of strains are found as differences, beside the size of the system.
_SMALL = 1e-4


def cords_of(model: Any) -> dict[str, Array]:
    """Rows of what only pulls, by the name of the array of records."""
    found = dict[str, Array]()
    for family in families().values():
        pulling = of_family(family.name).pulling
        if pulling is not None and (rows := pulling(model)).size:
            found[family.name] = rows
    return found


class _State(NamedTuple):
    """A smoothed equilibrium: the position, and T (n,), N, and s (n,), m, of the cords."""

    at: Position
    T: Array
    s: Array


class SmoothedCords:
    """Smoothed equilibria of a mechanism with cords.

    Parameters
    ----------
    elastic : elastic.Elastic
    free : (n,) int, velocities of points that cords alone hold
    carried : function of a state and a move (nv,) to the state after it
    """

    def __init__(self, elastic: Any, free: Array, carried: Callable[[Array, Array], Array]) -> None:
        model, self._elastic, self._carried = elastic.model, elastic, carried
        self._mechanism = one = elastic.mechanism
        self._left = np.setdiff1d(np.arange(one.n_v), free)
        self._cords = cords_of(model)
        own = [of_family(family.name).elastic for family in families().values()]
        self._strained = [found.strained for found in own if found is not None and found.strained is not None]
        names = [*self._cords, *(strained.records for strained in self._strained)]
        self._own = {name: getattr(model, name).copy() for name in names}
        #: Models with cords that push as well: by whose records strains are measured, and with other stresses.
        self._measuring, self._stressed = (
            model._replace(**{name: records.copy() for name, records in self._own.items()}) for _ in range(2)
        )
        for found in (self._measuring, self._stressed):
            for name, rows in self._cords.items():
                getattr(found, name)["slack"][rows] = 0
        self._k, self._length = (self._given(key) for key in ("stiffness", "length"))
        self._size = float(np.median(elastic.weight[free]))
        self._step = _FIRST
        self._last: tuple[Position, _State] | None = None
        self._reached: _State | None = None

    def remember(self, at: Position) -> None:
        """Let the last equilibrium of `follow` be that which is followed from a position."""
        assert self._reached is not None
        self._last = at, self._reached

    def follow(self, rows: list[int], values: Array, at: Position, flying: Array) -> Position | None:
        """The equilibrium in which the coordinates `rows` have `values`, followed from another position; or None.

        Its cords have what is left of their smoothing: tensions are right to 1e-7 of the largest one.

        Parameters
        ----------
        flying : (nv, j) float, motions that nothing resists
        """
        one, start = self._mechanism, at.x[rows].copy()
        known = self._last is not None and self._last[0] is at
        state = self._last[1] if known and self._last is not None else self._begin(at)
        share, size = 0.0, float(np.abs(values - start).max(initial=0.0))
        while share < 1.0:
            upto = min(1.0, share + self._step / max(size, self._step))
            switches = one.bare.switches.copy()
            found, iterations = self._balance(rows, start + (values - start) * upto, state, self._mu(state), flying)
            if found is None:
                one.bare.switches[:] = switches
                if self._step < _SMALLEST:
                    self._step = _FIRST
                    return None
                self._step = 0.5 * min(self._step, max(size * (upto - share), _SMALLEST))
                continue
            share, state = upto, found
            one.count_turns()
            if iterations <= _FEW:
                self._step = min(_GROW * self._step, _MOST)
        self._reached, mu = state, self._mu(state)
        for _ in range(_LOWERED):
            mu *= _LOWER
            found, _ = self._balance(rows, values, state, mu, flying)
            if found is None:
                break
            state = found
        return state.at

    def _begin(self, at: Position) -> _State:
        """Tensions at a position that is no smoothed equilibrium."""
        x = self._measured(at.y, at.t)[0]
        T = self._k * np.maximum(x, 0.0)
        mu = self._mu(_State(at, T, T))
        T = np.maximum(T, np.sqrt(self._k * mu))
        return _State(at, T, np.maximum(mu / T, -x))

    def _mu(self, state: _State) -> float:
        """The parameter of a state, J."""
        return max(_SMOOTH * float(np.max(state.T**2 / self._k)), _LEAST * float(np.median(self._k)) * self._size**2)

    def _given(self, key: str) -> Array:
        """A field of the cords."""
        return np.concatenate([self._own[name][key][rows] for name, rows in self._cords.items()])

    def _give(self, model: Any, stiffness: Array, length: Array) -> None:
        """Let the cords of a model have other stiffnesses and lengths."""
        first = 0
        for name, rows in self._cords.items():
            records, own = getattr(model, name), slice(first, first + rows.size)
            records["stiffness"][rows], records["length"][rows] = stiffness[own], length[own]
            first += rows.size

    def _measured(self, y: Array, t: float) -> tuple[Array, list[Array]]:
        """Extensions of the cords (n,), m, and strains of other parts, at a state."""
        model = self._measuring
        self._give(model, self._k, self._length)
        self._mechanism.left(t, y, model, factor=1.0)
        x = np.concatenate([getattr(model, name)["extension"][rows] for name, rows in self._cords.items()])
        return x, [one.measured(getattr(model, one.records)).copy() for one in self._strained]

    def _changes(self, at: Position, d: Array) -> tuple[Array, list[Array]]:
        """What is linear of the changes of `_measured` in a move d (nv,)."""
        part = min(1.0, _SMALL / max(float(np.abs(d / self._elastic.weight).max()), _SMALL * _SMALL))
        ends = []
        for sign in (part, -part):
            moved = at.y.copy()
            displace(at.y, sign * d, False, self._mechanism.bare, moved)
            ends.append(self._measured(moved, at.t))
        (x1, e1), (x0, e0) = ends
        return (x1 - x0) / (2.0 * part), [(b - a) / (2.0 * part) for a, b in zip(e0, e1, strict=True)]

    def _balance(
        self, rows: list[int], values: Array, state: _State, mu: float, flying: Array
    ) -> tuple[_State | None, int]:
        """Newton's method for the places, T and s; None where it does not converge, and the number of iterations."""
        one, elastic, k, weight = self._mechanism, self._elastic, self._k, self._elastic.weight
        at, T, s = state
        before, short, strains = np.inf, 0, self._measured(at.y, at.t)[1]
        for n in range(_ITERATIONS):
            A = np.vstack([at.G, one.tied(at.J), at.J[rows]])
            b = -np.concatenate([at.gaps, one.stretch(at.x), at.x[rows] - values])
            x, measured = self._measured(at.y, at.t)
            stiff = T / (s + T / k)
            for strained, now, then in zip(self._strained, measured, strains, strict=True):
                name = strained.records
                strained.shift(getattr(self._stressed, name), self._own[name], then - now)
            self._give(self._stressed, stiff, self._length + x - T / stiff)
            try:
                K, _ = elastic.tangent(at, A, rows, self._stressed)
                pull = T + (mu - T * (T / k - x)) / (s + T / k)  # in which the changes of T and s are eliminated
                self._give(self._measuring, k, self._length + x - pull / k)
                F = one.left(at.t, at.y, self._measuring, factor=1.0)[: one.n_v]
                scale = scale_of(K, weight)
                held, _ = independent(A * scale, mode="r")
                d, _ = Stiffness(K, at.mass, A, held, F, scale, flying, 0.0).move(b, F)
            except (np.linalg.LinAlgError, RuntimeError, ValueError):
                return None, n
            size = float(np.abs(d / weight).max(initial=0.0))
            if not np.isfinite(size):
                return None, n
            moved, off = float(np.abs(d / weight)[self._left].max(initial=0.0)), float(np.abs(b).max(initial=0.0))
            uneven = float(np.abs(T * s / mu - 1.0).max())
            if is_settled(off, moved, before) and uneven < _OFF:
                return _State(at, T, s), n
            before = moved
            dx, de = self._changes(at, d)
            dT = pull - T + stiff * dx
            ds = (T + dT) / k - s - x - dx
            nearest = max(float((-dT / T).max()), float((-ds / s).max()), _INSIDE)
            part = min(_INSIDE / nearest, LARGEST / max(size, LARGEST))
            short = short + 1 if part < _SHORTEST else 0
            if short == _SHORT and not fulfils(off):
                return None, n
            T, s = T + part * dT, s + part * ds
            strains = [now + part * change for now, change in zip(measured, de, strict=True)]
            at = one.at(at.t, self._carried(at.y, part * d))
        return None, _ITERATIONS
