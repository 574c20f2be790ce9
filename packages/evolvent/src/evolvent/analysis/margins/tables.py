"""Tables of margins: along the travel at rest, and along the simulated motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins import contacts, factors as of
from evolvent.analysis.margins.coordinates import MarginCoordinate
from evolvent.analysis.margins.factors import Standard
from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.positions import Direction, Position
from evolvent.analysis.margins.shares import Share
from evolvent.model.shares import ACCELERATION, FRICTION, SPRING

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray

#: Relative difference of what two stations ask for that is round-off.
ALIKE = 1e-9
#: Pace of viscoelastic parts along a run.
IN_RUN = "run"
#: Loss of elastic energy beside its range over the travel that is a snap.
_SNAP = 0.05


@dataclasses.dataclass(frozen=True, eq=False)
class MarginTable:
    """What drives and resists one coordinate, station by station.

    Attributes
    ----------
    coordinate : MarginCoordinate
    shares : list of Share
    x : (n,) float, rad or m, the coordinate; time : (n,) float, s, of a motion, else empty
    values : (number of shares, n) float, N m or N, above 0 where a share drives
    inertia : (n,) float, kg m2 or kg, reflected to the coordinate
    standard : Standard
    evidence : str, of what has no own, the specified acceleration among it
    snaps : (k,) int, stations before which elastic parts lose energy that no station shows
    slack : (k,) int, stations at which all cords that only pull are slack for the last time, or again for the first one
    touches : mapping, contacts that touch at a station -> value of the coordinate from which on, rad or m
    behind : int, of a motion, the first sample of the run behind the table
    pace : str, at which viscoelastic parts are taken to move: a word of the key `pace`, or that of the run; '' without
        such parts
    """

    coordinate: MarginCoordinate
    shares: list[Share]
    x: Array
    time: Array
    values: Array
    inertia: Array
    standard: Standard
    evidence: str
    snaps: tuple[int, ...] = ()
    touches: Mapping[str, float] = dataclasses.field(default_factory=dict)
    behind: int = 0
    pace: str = ""
    slack: tuple[int, ...] = ()

    def drives(self) -> dict[str, Array]:
        """What drives, by category: (n,) each."""
        found: dict[str, Array] = {}
        for share, value in zip(self.shares, self.values, strict=True):
            found[share.category] = found.get(share.category, 0.0) + np.maximum(value, 0.0)
        return found

    def resists(self) -> dict[tuple[str, str], Array]:
        """What resists, by category and evidence: (n,) each; the specified acceleration among it."""
        found: dict[tuple[str, str], Array] = {}
        for share, value in zip(self.shares, self.values, strict=True):
            key = share.category, share.evidence
            found[key] = found.get(key, 0.0) + np.maximum(-value, 0.0)
        if self.coordinate.acceleration > 0.0:
            key = ACCELERATION, self.evidence
            found[key] = found.get(key, 0.0) + self.inertia * self.coordinate.acceleration
        return found

    def by_category(self) -> dict[str, Array]:
        """Sum of what drives less what resists, by category: (n,) each."""
        found = dict(self.drives())
        for (category, _), value in self.resists().items():
            found[category] = found.get(category, 0.0) - value
        return found

    @property
    def available(self) -> Array:
        """What counts as actuation: (n,), N m or N."""
        return np.zeros(self.x.size) + self.standard.available(self.drives())

    def required(self, name: str) -> Array:
        """What a requirement asks for, T_min: (n,), N m or N."""
        return np.zeros(self.x.size) + self.standard.required(name, self.resists())

    def margin(self, name: str) -> Array:
        """Margin by a requirement: (n,)."""
        found: Array = of.ratio(self.available, self.required(name))
        return found

    def governing(self) -> tuple[str, int]:
        """Requirement and station of the least margin; of equal margins that with the largest deficit."""
        found = []
        for order, name in enumerate(self.standard.requirements):
            margin, deficit = self.margin(name), self.required(name) - self.available
            n = int(np.lexsort((-deficit, margin))[0])
            found.append((float(margin[n]), -float(deficit[n]), order, n))
        _, _, order, n = min(found)
        return list(self.standard.requirements)[order], n

    def spring_to_add(self) -> float:
        """Driving torque of springs (N m or N) over the whole travel that brings the least margin to 0.

        Below 0: what springs may lose.
        """
        return self.spring_change()[0]

    def spring_change(self) -> tuple[float, int]:
        """`spring_to_add`, and the station that decides it: of the largest deficit, not always of the least margin."""
        counts = self.standard.driving.get(SPRING, 0.0)
        if counts == 0.0:
            return np.nan, -1
        deficit = np.max([self.required(name) - self.available for name in self.standard.requirements], axis=0)
        return self._largest(deficit / counts)

    def friction_to_lose(self) -> float:
        """Friction (N m or N) that has to go for the least margin to be 0; not a number where no friction does it.

        Below 0: what friction may grow by.
        """
        return self.friction_change()[0]

    def friction_change(self) -> tuple[float, int]:
        """`friction_to_lose`, and the station that decides it; -1 where no friction does it."""
        friction = {key: value for key, value in self.resists().items() if key[0] == FRICTION}
        there = np.zeros(self.x.size) + sum(friction.values())
        words = [evidence for _, evidence in friction] or [self.evidence]
        lost = np.full(self.x.size, -np.inf)
        for name, one in self.standard.requirements.items():
            factor = min(one.factor(FRICTION, evidence) for evidence in words)
            deficit = self.required(name) - self.available
            if factor == 0.0:
                if np.any(deficit > 0.0):
                    return np.nan, -1
                continue
            asked = deficit / factor
            if np.any(asked > there * (1.0 + 1e-12)):
                return np.nan, -1
            lost = np.maximum(lost, asked)
        return self._largest(lost)

    def _largest(self, asked: Array) -> tuple[float, int]:
        """The largest of what stations ask for, and its station: that of the least margin where it asks for as much."""
        _, governing = self.governing()
        n = int(np.argmax(asked))
        alike = abs(asked[n] - asked[governing]) <= ALIKE * abs(asked[n])
        return float(asked[n]), governing if alike else n


def along_travel(
    mechanism: Mechanism, coordinate: MarginCoordinate, shares: list[Share], targets: Mapping[int, Array],
    slack: tuple[int, ...], at: Position, known: tuple[Standard, str],
) -> MarginTable:  # fmt: skip
    """The table at rest, station by station.

    Parameters
    ----------
    targets, slack : values (n,) at the stations of the coordinate and of those that are held, by row, and the stations
        where slack ends, as of `Mechanism.refined`
    at : a position at rest, from which the first station is sought
    known : the table of factors, and the evidence of what has no own
    """
    k = coordinate.k
    xs = targets[k]
    rows = [k, *(j for j in targets if j != k)]
    values, inertia = np.zeros((len(shares), xs.size)), np.zeros(xs.size)
    energy, before, touches = np.zeros(xs.size), None, dict[str, float]()
    for n, (there, direction) in enumerate(mechanism.stations(k, coordinate.sense, targets, at)):
        found = contacts.touching(mechanism, shares, direction, there)
        contacts.refuse_undetermined(mechanism, found, rows, there)
        for name in found.keys() - touches.keys():
            share, _ = found[name]
            near = {j: (float(own[max(n - 1, 0)]), float(own[n])) for j, own in targets.items()}
            touches[name] = contacts.first_touch(mechanism, share, near, direction, k, before)
        before = there
        energy[n] = 0.0 if mechanism.elastic is None else mechanism.elastic.energy(there)
        values[:, n], inertia[n] = _powers(mechanism, shares, direction, there, rows, None), direction.inertia
    snaps = _snaps(xs, energy, values[[share.stores for share in shares]].sum(axis=0))
    if mechanism.hangs(at) and any(np.ptp(own) > 0.0 for j, own in targets.items() if j != k):
        snaps = ()  # what all coordinates are given together is in no single table
    return MarginTable(
        coordinate, shares, xs, np.zeros(0), values, inertia, *known, snaps, touches, pace=mechanism.pace, slack=slack
    )


def _snaps(x: Array, energy: Array, given: Array) -> tuple[int, ...]:
    """Stations to which the energy falls by more than what is given at both ends, (n,) N m or N, can account for."""
    way = np.abs(np.diff(x))
    lost = -np.diff(energy) - np.maximum(given[1:], given[:-1]) * way
    large = np.abs(np.diff(given)) * way + _SNAP * np.ptp(energy)
    return tuple(int(n) + 1 for n in np.flatnonzero(lost > large))


def along_motion(
    mechanism: Mechanism, coordinates: list[MarginCoordinate], shares: list[Share], solution: Solution,
    known: tuple[Standard, str],
) -> list[MarginTable | None]:  # fmt: skip
    """The table along a run of each coordinate, until it reaches its end; None where no sample of the run is before.

    It begins where hold-downs let the coordinate move. Positions, rates and what viscoelastic parts have relaxed are
    those of the run; the direction is that of the coordinate with the others held.
    """
    rows: dict[int, list[tuple[float, float, Array, float, int]]] = {one.k: [] for one in coordinates}
    moving = list(coordinates)
    for n in range(solution.t.size):
        at = mechanism.of_run(solution, n)
        moving = [one for one in moving if one.sense * (float(at.x[one.k]) - one.end) < 0.0]
        if not moving:
            break
        for one in moving:
            held = [mechanism.names.index(name) for name in one.held]
            if not rows[one.k] and mechanism.waits(one.k, held, at):  # its margin begins with its release
                continue
            direction = mechanism.direction(one.k, held, one.sense, at, still=False)
            found = contacts.touching(mechanism, shares, direction, at)
            contacts.refuse_undetermined(mechanism, found, [], at)
            powers = _powers(mechanism, shares, direction, at, [one.k, *held], solution.la[n])
            rows[one.k].append((at.t, float(at.x[one.k]), powers, direction.inertia, n + 1))
    pace = IN_RUN if mechanism.pace else ""
    return [_of_rows(one, shares, rows[one.k], known, pace) for one in coordinates]


def _of_rows(
    coordinate: MarginCoordinate, shares: list[Share], rows: list[tuple[float, float, Array, float, int]],
    known: tuple[Standard, str], pace: str,
) -> MarginTable | None:  # fmt: skip
    """The table of what was found at each sample; None without any."""
    if not rows:
        return None
    time, xs, values, inertia, behind = zip(*rows, strict=True)
    return MarginTable(
        coordinate, shares, np.array(xs), np.array(time), np.array(values).reshape(len(xs), len(shares)).T,
        np.array(inertia), *known, behind=behind[-1], pace=pace,
    )  # fmt: skip


def _powers(
    mechanism: Mechanism, shares: list[Share], direction: Direction, at: Position, rows: list[int], la: Array | None
) -> Any:
    """Virtual power of every share; `rows` and `la` as of `model.shares.Shares.together`."""
    together = dict.fromkeys(share.evaluated.together for share in shares)
    known: dict[str, float] = {}
    for evaluate in together:
        known |= {} if evaluate is None else evaluate(mechanism, shares, direction, at, rows, la)
    return np.array([
        known[share.label] if share.label in known else mechanism.power(share, at, direction, still=la is None)
        for share in shares
    ])  # fmt: skip
