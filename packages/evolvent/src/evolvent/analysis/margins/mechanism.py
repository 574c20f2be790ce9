"""A mechanism at a position: the direction in which it moves there, and the virtual power of each part along it.

Every force is the engine's: the residual of the equations of motion (`evolvent.equations.implicit.residual`) of the
model with one part's force alone. So gradients of constraints, levers of weights and neighbours' springs are those of
a run.

Notes
-----
With the gradients G of the constraints, J of the coordinates and the mass matrix M, the direction v of coordinate c is
the one of least kinetic energy v.M v/2 among those with G v = 0, J_c v = 1, and J_j v = 0 of the coordinates j that are
held. What is neither held nor driven, such as a free satellite, so follows by its inertia; elastic parts follow by
their stiffness (`elastic`). A part with the generalised force Q has the share Q.v, and the reflected inertia is v.M v.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins import contacts
from evolvent.analysis.margins.elastic import Elastic
from evolvent.analysis.margins.loose import LoosePoints
from evolvent.analysis.margins.mass import Mass
from evolvent.analysis.margins.positions import Direction, MechanismModels, Position
from evolvent.analysis.margins.shares import (
    GRAVITY,
    SPIN,
    Share,
    bytes_of,
    has_elastic_parts,
)
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import Struct
from evolvent.kernels.blocks import displace
from evolvent.model.shares import Elastic as ElasticShares, Tie
from evolvent.solvers.common.standing import at_time
from evolvent.solvers.static import equilibrium
from evolvent.solvers.static.work import velocities_of
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray

#: Rank of constraints beside the largest singular value, and what an equation of the direction may be off.
_RANK, _OFF = 1e-10, 1e-7
#: Part of what a force does in single velocities below which their sum is round-off.
_ROUND_OFF = 1e-12
#: Largest move between two positions, rad and m; iterations to a position, and what it may be off.
_MOVE, _ITERATIONS, _REACHED = 0.2, 30, 1e-13
#: Places and directions of the travels that were found last, and how many of them are kept.
_PLACES: dict[Any, list[tuple[Position, Array]]] = {}
_DIRECTIONS: dict[Any, list[Direction]] = {}
_MOST_KEPT = 32
#: Halvings of the way between two stations, to where cords become taut, and stations that are added from there.
_HALVINGS, _ADDED = 12, 7


class Mechanism(MechanismModels):
    """Forces, constraints and positions of an assembled system.

    Parameters
    ----------
    assembly : Assembly
    spin : (6,) float, rad/s and m, rate and centre of a steady turn of everything
    opened : rows of constraint that are released already
    relaxed : bool, whether viscoelastic parts have relaxed whole, whatever their history
    """

    def __init__(self, assembly: Assembly, spin: Array, opened: Sequence[int] = (), *, relaxed: bool = False) -> None:
        super().__init__(assembly, spin, opened, relaxed=relaxed)
        #: Models of `with_share`, each with the bytes of its records, by the label of the share.
        self._shares: dict[str, tuple[Any, Array]] = {}
        #: Equilibria of elastic parts, None without any.
        self.elastic = Elastic(self) if has_elastic_parts(self.whole) else None
        #: What `refined` has found, by the path.
        self._refined: dict[Any, tuple[Mapping[int, Array], tuple[int, ...]]] = {}
        self._digest = _digest(self.bare if self.elastic is None else self.elastic.model, self.ties, spin)

    # ------------------------------------------------------------------------------------------------ the engine

    def with_share(self, share: Share, at: Position | None = None, direction: Direction | None = None) -> Any:
        """The bare model with records of a share, which are of the present position where that is given.

        It is made once, later its records are overwritten.
        """
        records, own = share.taken(getattr(self.whole, share.family)), share.evaluated
        if own.prepare is not None:
            own.prepare(self, share, at, direction, records)
        known = self._shares.get(share.label)
        if known is None:
            model = self.bare._replace(**{share.family: records})
            known = self._shares[share.label] = model, bytes_of(getattr(model, share.family))
        else:
            known[1][:] = bytes_of(records)
        return known[0]

    def of_run(self, solution: Solution, n: int) -> Position:
        """The mechanism at sample n of a run, with the strains that the branches of viscoelastic parts have there."""
        self._switch(solution.s[n])
        self.remember(float(solution.t[n]), solution.y[n])
        return self.at(float(solution.t[n]), solution.y[n])

    def _switch(self, s: Array) -> None:
        """Let switches be s, among them those of what events and latches release."""
        self.bare.switches[:] = s
        held = self.whole.constraints
        rows = np.flatnonzero(held["switch"] >= 0)
        held["until"][rows] = np.where(s[held["switch"][rows]] != 0, -np.inf, held["latest"][rows])

    def holds(self, t: float) -> Array:
        """Rows of constraint that hold at a time (s) and are to be released later."""
        rows = self.whole.constraints
        later = np.isfinite(rows["latest"]) | (rows["event"] != -1)
        return np.flatnonzero(later & (t <= rows["until"]))

    def closed(self, t: float) -> str:
        """Names of the parts of `holds`, '' for none."""
        parts = self.assembly.row_parts
        return ", ".join(repr(name) for name in dict.fromkeys(parts[k] for k in self.holds(t)))

    def rate(self, k: int, solution: Solution, n: int) -> float:
        """Rate of coordinate k (rad/s or m/s) at sample n of a run."""
        at = self.of_run(solution, n)
        return float(at.J[k] @ at.y[self.n_q : self.n_q + self.n_v])

    def at_rest(self, t: float) -> Position:
        """The mechanism at a time (s), where the system starts, without rates."""
        assembly, y = self.assembly, None
        if self.bare.info.releases:
            assembly, y = at_time(assembly, None, t)
        self._switch(assembly.s)
        y = np.array(assembly.y if y is None else y)
        y[self.n_q : self.n_q + self.n_v] = 0.0
        self.remember(t, None)
        return self.at(t, y)

    def power(self, share: Share, at: Position, direction: Direction, *, still: bool = False) -> float:
        """Virtual power of a share along a direction: N m or N, above 0 where it drives.

        Parameters
        ----------
        still : bool, whether the mechanism is at rest: a motor that follows a motion then has its limit, since where
            its reference would be is not known

        Raises
        ------
        InputError
            For such a motor without a limit.
        """
        power = share.evaluated.power
        known = None if power is None else power(self, share, at, direction, still)
        if known is not None:
            return float(known)
        parts = (at.zero - self._force(share, at, direction, still)) * direction.v
        found = float(parts.sum())
        return found if abs(found) > _ROUND_OFF * float(np.abs(parts).sum()) else 0.0

    def force(self, share: Share, at: Position, direction: Direction, *, still: bool) -> Array:
        """Generalised forces of a share on the left of the equations, (nv,); `still` as of `power`."""
        return np.asarray(self._force(share, at, direction, still) - at.zero)

    def _force(self, share: Share, at: Position, direction: Direction, still: bool) -> Array:
        """Generalised forces of a share, on the left of the equations, with those of the bare model."""
        t, y, own = at.t, at.y, share.evaluated
        if share.label == GRAVITY:
            return self.left(t, y, self.once(GRAVITY, info=self.whole.info), factor=1.0)[: self.n_v]
        if share.label == SPIN:
            a = np.zeros(self.n_v)
            equilibrium.turning(1.0, self.spin, y, self.whole, a)
            return self.left(t, y, self.bare, a=a)[: self.n_v]
        known = None if own.force is None else own.force(self, share, at, direction, still)
        if known is not None:
            return np.asarray(known)
        if own.elastic is not None:
            return self._elastic_force(share, own.elastic, at)
        if own.contact is not None:
            return contacts.force(self, share, at, direction)
        model = self.with_share(share, at, direction)
        if own.standing:
            weight = self.left(t, y, self.bare, factor=1.0) - self.left(t, y, self.bare)
            return (self.left(t, y, model, factor=1.0) - weight)[: self.n_v]
        if share.rates is None:
            return self.left(t, y, model)[: self.n_v]
        slow = y.copy()
        slow[self.n_q : self.n_q + self.n_v] = 0.0
        first, then = (y, slow) if share.rates else (slow, slow)
        without = model if share.rates else self.bare
        return at.zero + (self._force_of(t, first, model) - self._force_of(t, then, without))

    def _force_of(self, t: float, y: Array, model: Any) -> Array:
        """Forces of a model at a state on the left of the equations, without those of the bare one."""
        return (self.left(t, y, model) - self.left(t, y, self.bare))[: self.n_v]

    def _elastic_force(self, share: Share, elastic: ElasticShares, at: Position) -> Array:
        """Generalised forces by which an elastic part resists its strains, as of `_force`; without its damping."""
        whole, (k,) = self.whole, share.rows
        model = self.once(share.label if elastic.alone else share.family, **elastic.stiff(whole, self.bare, k))
        y = at.y.copy()
        y[self.n_q : self.n_q + self.n_v] = 0.0
        force = (self.left(at.t, y, model, factor=1.0) - self.left(at.t, y, self.bare, factor=1.0))[: self.n_v]
        if not elastic.alone:  # else it is that of the one with a stiffness, also on what it ends at
            own = velocities_of(whole, share.family, k)
            force, every = np.zeros(self.n_v), force
            force[own] = every[own]
        return np.asarray(at.zero + force)

    # ------------------------------------------------------------------------------------------------ directions

    def direction(self, k: int, held: list[int], sense: float, at: Position, *, still: bool) -> Direction:
        """How the mechanism moves with coordinate k at the rate `sense`, 1 or -1; `still` as of `power`.

        Raises
        ------
        InputError
            If it cannot, or elastic parts that stand there are about to snap.
        """
        found = None
        if self.elastic is None:
            found = self._solved(k, held, sense, at)
        elif not self.waits(k, held, at):
            A, b = self._held(k, held, sense, at)
            v, lowest = self.elastic.velocities(at, A, [*held, k], b, still=still)
            found = self._checked(v, A, b, at)
            if still and lowest < 0.0:
                raise InputError(
                    f"the elastic parts are in no stable equilibrium where {self.names[k]!r} is at "
                    f"{float(at.x[k]):.6g} {self.unit(k)}: they snap to another shape; see by a run what happens there"
                )
        if found is None:
            where = f"{self.names[k]!r} cannot move at {float(at.x[k]):.6g} {self.unit(k)}"
            closed = self.closed(at.t)
            if closed:
                raise InputError(
                    f"{where}: at the time {at.t:.9g} s it is held by {closed}; give margin.time one behind its release"
                )
            raise InputError(f"{where}: the constraints and the coordinates that are held do not let it")
        return found

    def waits(self, k: int, held: list[int], at: Position) -> bool:
        """Whether coordinate k cannot move, and a joint that is released later holds."""
        return bool(self.holds(at.t).size) and self._solved(k, held, 1.0, at) is None

    def _solved(self, k: int, held: list[int], sense: float, at: Position) -> Direction | None:
        A, b = self._held(k, held, sense, at)
        return self._checked(_least(at.mass, A, b), A, b, at)

    @staticmethod
    def _checked(v: Array, A: Array, b: Array, at: Position) -> Direction | None:
        """A direction, None where it does not fulfil A v = b."""
        if float(np.abs(A @ v - b).max()) > _OFF:
            return None
        return Direction(v, at.J @ v, float(v @ (at.mass @ v)))

    def _held(self, k: int, held: list[int], sense: float, at: Position) -> tuple[Array, Array]:
        """Gradients A of all that holds a mechanism in which k moves, and the rates b = A v."""
        A = np.vstack([at.G, self.tied(at.J), at.J[held], at.J[[k]]])
        b = np.zeros(A.shape[0])
        b[-1] = sense
        return A, b

    def held_with(self, k: int, at: Position) -> tuple[list[int], list[int]]:
        """Coordinates that can be held while k moves, and those that follow it, by the constraints."""
        held: list[int] = []
        follow: list[int] = []
        for j in range(len(self.names)):
            if j == k or j in self.measured:
                continue
            free = self._solved(k, [*held, j], 1.0, at) is not None
            (held if free else follow).append(j)
        return held, follow

    # ------------------------------------------------------------------------------------------------ positions

    def stations(
        self, k: int, sense: float, targets: Mapping[int, Array], at: Position
    ) -> Iterator[tuple[Position, Direction]]:
        """Positions along a travel, one after the other, with the direction of coordinate k there.

        Positions do not depend on what is in no constraint and no mass, such as stiffnesses: mechanisms that differ in
        that alone share them, and so do coordinates that move together.

        Parameters
        ----------
        sense : 1 or -1, of the direction
        targets : values (n,) at the stations of coordinate k and of those that are held, by row
        at : a position at rest, from which the first one is sought
        """
        key = self._key(targets, at)
        held = [j for j in targets if j != k]
        places, directions = _PLACES.pop(key, []), _DIRECTIONS.pop((*key, k, sense), [])
        for n in range(targets[k].size):
            if n == len(places):
                at = self.move({j: float(values[n]) for j, values in targets.items()}, at)
                places.append((at, self.bare.switches.copy()))
            at, self.bare.switches[:] = places[n]
            if n == len(directions):
                directions.append(self.direction(k, held, sense, at, still=True))
        _PLACES[key], _DIRECTIONS[*key, k, sense] = places, directions
        for kept in (_PLACES, _DIRECTIONS):
            if len(kept) > _MOST_KEPT:
                del kept[next(iter(kept))]
        for (there, switches), direction in zip(places, directions, strict=True):
            self.bare.switches[:] = switches
            yield there, direction

    def hangs(self, at: Position) -> LoosePoints | None:
        """Points that cords alone hold, which are slack at the start; `at` is any position."""
        return None if self.elastic is None else self.elastic.loose(at)

    def _key(self, targets: Mapping[int, Array], at: Position) -> Any:
        """What the positions at stations follow from."""
        return self._digest, _path(targets), at.t, at.y.tobytes()

    def refined(self, targets: Mapping[int, Array], at: Position) -> tuple[Mapping[int, Array], tuple[int, ...]]:
        """Targets as of `stations`, with more stations from where cords become taut to the next one.

        Returns
        -------
        targets, and the stations at which all cords are slack for the last time, or again for the first time
        """
        loose = self.hangs(at)
        if loose is None:
            return targets, ()
        path = _path(targets)
        if path not in self._refined:
            first, switches = at, self.bare.switches.copy()
            values, places, ends = self._with_ends_of_slack(loose, targets, at)
            self.bare.switches[:] = switches
            self._refined[path] = dict(zip(targets, np.ascontiguousarray(values.T), strict=True)), ends
            _PLACES[self._key(self._refined[path][0], first)] = places
        return self._refined[path]

    def _with_ends_of_slack(
        self, loose: LoosePoints, targets: Mapping[int, Array], at: Position
    ) -> tuple[Array, list[tuple[Position, Array]], tuple[int, ...]]:
        """Values (n, m) of the coordinates at stations of `refined`, the positions there, and where slack ends."""
        assert self.elastic is not None

        def stands(values: Array, near: Position) -> tuple[Position, Array, bool]:
            wanted = dict(zip(targets, values.tolist(), strict=True))
            there = self.elastic.move(wanted, near, by=loose.stand)
            return there, self.bare.switches.copy(), loose.is_slack(there)

        found, places, ends = list[Array](), list[tuple[Position, Array, bool]](), list[int]()
        for values in np.array(list(targets.values())).T:
            there = stands(values, places[-1][0] if places else at)
            if places and there[2] != places[-1][2]:
                before = (found[-1], places[-1]), (values, there)
                (a, slack), (b, taut) = before if places[-1][2] else before[::-1]
                last = b
                for _ in range(_HALVINGS):
                    middle = stands(0.5 * (a + b), slack[0])
                    if middle[2]:
                        a, slack = 0.5 * (a + b), middle
                    else:
                        b = 0.5 * (a + b)
                order = 1 if places[-1][2] else -1
                ends.append(len(found) + (0 if order > 0 else _ADDED))
                found += list(np.linspace(a, last, _ADDED + 2)[:-1])[::order]
                places += [slack, *([(taut[0], slack[1], False)] * _ADDED)][::order]
            found.append(values)
            places.append(there)
        return np.array(found), self._with_taut(loose, list(targets), found, places), tuple(ends)

    def _with_taut(
        self, loose: LoosePoints, rows: list[int], values: list[Array], places: list[tuple[Position, Array, bool]]
    ) -> list[tuple[Position, Array]]:
        """Positions at stations with those in which cords are taut in equilibrium.

        Stations up to the last one are followed backwards from that, others forwards from where the cords are slack.
        """
        assert self.elastic is not None
        found = [(there, switches) for there, switches, _ in places]
        taut = [n for n, (_, _, slack) in enumerate(places) if not slack]
        at_end = [n for n in taut if all(not slack for _, _, slack in places[n:])]
        for group in (at_end[::-1], [n for n in taut if n not in at_end]):
            for i, n in enumerate(group):
                behind = i > 0 and abs(n - group[i - 1]) == 1
                near = found[group[i - 1]][0] if behind else found[n][0]
                self.bare.switches[:] = found[n][1]
                there = self.elastic.move(dict(zip(rows, values[n].tolist(), strict=True)), near)
                found[n] = there, found[n][1]
        return found

    def move(self, targets: dict[int, float], at: Position) -> Position:
        """The position in which coordinates have the values `targets`, at rest, from another one.

        Raises
        ------
        InputError
            If the mechanism does not reach it.
        """
        if self.elastic is not None:
            return self.elastic.move(targets, at)
        rows = list(targets)
        start, end = at.x[rows], np.array([targets[k] for k in rows])
        steps = max(1, math.ceil(float(np.abs(end - start).max(initial=0.0)) / _MOVE))
        for i in range(1, steps + 1):
            at = self._newton(rows, start + (end - start) * i / steps, at)
            self.count_turns()
        return at

    def _newton(self, rows: list[int], values: Array, at: Position) -> Position:
        M = at.mass
        for _ in range(_ITERATIONS):
            x = at.x
            A = np.vstack([at.G, self.tied(at.J), at.J[rows]])
            b = -np.concatenate([at.gaps, self.stretch(x), x[rows] - values])
            off = float(np.abs(b).max(initial=0.0))
            if off <= _REACHED:
                return at
            moved = at.y.copy()
            displace(at.y, _least(M, A, b), False, self.bare, moved)
            at = self.at(at.t, moved)
        if off <= 1e3 * _REACHED:
            return at
        k = rows[int(np.argmax(np.abs(x[rows] - values)))]
        raise InputError(
            f"{self.names[k]!r} does not reach {values[rows.index(k)]:.6g} {self.unit(k)}: the constraints and the "
            f"coordinates that are held stop it at {x[k]:.6g} {self.unit(k)}"
        )


def _path(targets: Mapping[int, Array]) -> tuple[tuple[int, bytes], ...]:
    """Values of coordinates at stations, to compare."""
    return tuple((j, values.tobytes()) for j, values in targets.items())


def _digest(model: Any, ties: list[Tie], spin: Array) -> str:
    """Hash of all that positions and directions follow from."""
    found = hashlib.sha256(repr(ties).encode() + spin.tobytes())
    waiting = [model]
    while waiting:
        for one in waiting.pop():
            if isinstance(one, Struct):
                waiting.append(one)
            else:
                found.update(np.asarray(one).tobytes())
    return found.hexdigest()


def _least(M: Mass, A: Array, b: Array) -> Array:
    """The x of least x.M x with A x = b, in the sense of least squares where that has no solution."""
    B = M.half(A.T).T
    size = np.linalg.norm(B, axis=1)
    size[size == 0.0] = 1.0
    w, acts = np.zeros(B.shape[1]), np.any(B, axis=0)
    w[acts] = np.linalg.lstsq((B / size[:, None])[:, acts], b / size, rcond=_RANK)[0]
    return M.back(w)
