"""The energy balance of a run: what every solver keeps of it, the energy that was moved, and the rule for a defect.

The functions take one record, or a whole array of them (`numpy.recarray`), in Python and in compiled code.

The rule, for every method: a defect counts beside the energy moved, not beside that of the state, whose zero is
arbitrary. Moved is the largest of

- the range of the kinetic energy, and of the potential energy (of elements, springs, threads, contacts and joints),
- the sum of the magnitudes of all work since the start, and that of all losses,
- `SPIN` of the largest kinetic energy, which its range does not show where bodies pass it to one another, or spin.

It never falls over a run. What is gained is the largest rise of the defect, lost its largest fall. See `Closure`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from evolvent.compiled.jit import inlined

#: Energies now. elastic: of elements, springs, threads and contacts, of which bending (of beams) and contact; coupled:
#: of joint coordinates and penalties.
ENERGIES = ("kinetic", "elastic", "bending", "contact", "coupled")
#: What came in since the start: work of loads, of drives and of spools, and what nodes brought in at their release.
WORK = ("loads", "drives", "spools", "released")
#: What was dissipated since the start, by causes.
LOSSES = ("by_mass", "by_stiffness", "by_contact", "by_friction", "by_joints", "by_springs")
#: One record of the balance, J.
BALANCE = np.dtype([(name, np.float64) for name in (*ENERGIES, *WORK, *LOSSES)], align=True)
#: What a loop keeps to know the energy moved, J: extremes of the energies, and the largest sums of the magnitudes of
#: all work and of all losses.
EXTREMES = tuple(
    (name, np.float64) for name in ("kinetic_low", "kinetic_high", "potential_low", "potential_high", "worked", "lost")
)
#: Part of the largest kinetic energy that counts as moved in any case.
SPIN = 0.5
#: Part of the energy moved from which a defect is reported, and from which a run that gains it has failed.
WARNED = GAINED = 0.01
#: The same of motions so small that the steps of implicit methods are not meant to resolve them.
GAINED_UNRESOLVED = 0.1
#: Part of the largest energy, and of the energies that steps do not resolve, below which a defect is round-off.
ROUND_OFF, RESOLVED = 1e-6, 1e-5
#: Least energy beside which a defect counts, J: a structure at rest has none but round-off.
LEAST_ENERGY = 1e-18


def energy(balance: Any) -> Any:
    """Kinetic and potential energy, J."""
    return balance.kinetic + balance.elastic + balance.coupled


def work(balance: Any) -> Any:
    """All that came in since the start, J."""
    return balance.loads + balance.drives + balance.spools + balance.released


def dissipated(balance: Any) -> Any:
    """All that was dissipated since the start, J."""
    return (
        balance.by_mass + balance.by_stiffness + balance.by_contact + balance.by_friction + balance.by_joints
        + balance.by_springs
    )  # fmt: skip


def defect(balance: Any, start: Any) -> Any:
    """Energy less that at the start and less work, plus losses, J: zero but for the numerical error."""
    return (
        balance.kinetic + balance.elastic + balance.coupled - start
        - (balance.loads + balance.drives + balance.spools + balance.released)
        + (balance.by_mass + balance.by_stiffness + balance.by_contact)
        + (balance.by_friction + balance.by_joints + balance.by_springs)
    )  # fmt: skip


def potential(balance: Any) -> Any:
    """Potential energy, J: of elements, springs, threads, contacts, joints and laws between points."""
    return balance.elastic + balance.coupled


def worked(balance: Any) -> Any:
    """Sum of the magnitudes of all work, J, of a run whose work begins at zero."""
    return abs(balance.loads) + abs(balance.drives) + abs(balance.spools) + abs(balance.released)


def lost(balance: Any) -> Any:
    """Sum of the magnitudes of all losses, J, of a run whose losses begin at zero."""
    return (
        abs(balance.by_mass) + abs(balance.by_stiffness) + abs(balance.by_contact)
        + abs(balance.by_friction) + abs(balance.by_joints) + abs(balance.by_springs)
    )  # fmt: skip


def begin(found: Any, kinetic: Any, potential: Any) -> None:
    """Begin the extremes with the energies at the start."""
    found.kinetic_low = found.kinetic_high = kinetic
    found.potential_low = found.potential_high = potential
    found.worked = found.lost = 0.0


def extend(found: Any, kinetic: Any, potential: Any, worked: Any, lost: Any) -> None:
    """Extend the extremes by another moment."""
    found.kinetic_low = min(found.kinetic_low, kinetic)
    found.kinetic_high = max(found.kinetic_high, kinetic)
    found.potential_low = min(found.potential_low, potential)
    found.potential_high = max(found.potential_high, potential)
    found.worked = max(found.worked, worked)
    found.lost = max(found.lost, lost)


def largest(found: Any) -> Any:
    """Magnitude of the largest energy, J, of the extremes of a run."""
    return max(found.kinetic_high, abs(found.potential_low), abs(found.potential_high))


def moved(found: Any) -> Any:
    """Energy moved, J, of the extremes of a run."""
    swing = max(found.kinetic_high - found.kinetic_low, found.potential_high - found.potential_low)
    return max(swing, found.worked, found.lost, SPIN * found.kinetic_high)


#: The same for compiled code.
energy_of, defect_of, potential_of = inlined(energy), inlined(defect), inlined(potential)
worked_of, lost_of, moved_of, largest_of = inlined(worked), inlined(lost), inlined(moved), inlined(largest)
begin_extremes, extend_extremes = inlined(begin), inlined(extend)


def moved_over(balance: Any) -> np.ndarray:
    """Energy moved from the first sample to each: (nt,) float, J; see `moved`. Samples of NaN move nothing."""
    found = _moved(columns(balance), _over_time(np.fmax.accumulate), _over_time(np.fmin.accumulate))
    return np.asarray(np.nan_to_num(found, nan=0.0, posinf=math.inf))


def _moved(of: SimpleNamespace, high: Callable[[Any], Any], low: Callable[[Any], Any]) -> Any:
    """Energy moved, J, of columns over time, by the largest and the least values of a column, up to each or of all."""
    since = SimpleNamespace(**{name: getattr(of, name) - getattr(of, name)[..., :1] for name in (*WORK, *LOSSES)})
    swings = [high(values) - low(values) for values in (of.kinetic, potential(of))]
    return np.maximum.reduce([*swings, high(worked(since)), high(lost(since)), SPIN * high(of.kinetic)])


def _over_time(act: Callable[..., Any]) -> Callable[[Any], Any]:
    """A function of NumPy, applied along time, the last axis."""
    return functools.partial(act, axis=-1)


def columns(balance: Any) -> SimpleNamespace:
    """Columns of (nt,) records by name, whose attributes are found without the detours of record arrays."""
    if isinstance(balance, SimpleNamespace):
        return balance
    plain = np.asarray(balance)
    return SimpleNamespace(**{name: plain[name] for name in plain.dtype.names or ()})


def records(size: int) -> Any:
    """Room for the balances of `size` samples: fields are attributes."""
    return np.zeros(size, dtype=BALANCE).view(np.recarray)


class Closure(NamedTuple):
    """How well the balance of a run closes, and what follows.

    Attributes
    ----------
    moved : float, J, energy that was moved
    gained, lost : float, J, largest rise and largest fall of the defect
    largest : float, J, magnitude of the largest energy
    unresolved : float, J, energies that the steps of an implicit method are not meant to resolve; 0 of explicit ones
    damps : bool, whether the method has numerical damping, which may take energy, and give back some of it
    net : float, J, largest rise of the defect above its start
    floor : float, J, round-off of the energies and works that the run handles, though it may hardly move any
    """

    moved: float
    gained: float
    lost: float
    largest: float
    unresolved: float
    damps: bool
    net: float = 0.0
    floor: float = 0.0

    @property
    def defect(self) -> float:
        """The larger of what was gained and what was lost, J."""
        return max(self.gained, self.lost)

    @property
    def round_off(self) -> float:
        """Defect that is round-off, J."""
        return ROUND_OFF * self.largest + RESOLVED * self.unresolved + self.floor + LEAST_ENERGY

    @property
    def share(self) -> float:
        """The defect beside the energy moved; infinity where they are not finite, 0 of round-off without a motion."""
        if not math.isfinite(self.moved + self.defect):
            return math.inf
        return self.defect / max(self.moved, self.round_off)

    @property
    def fails(self) -> bool:
        """Whether the run has failed: it has gained too much, or lost it where the method does not damp."""
        if not math.isfinite(self.moved + self.defect):
            return True
        wrong = self.net if self.damps else self.defect
        allowed = min(GAINED * (self.moved + self.unresolved), GAINED_UNRESOLVED * self.moved)
        returned = self.damps and self.gained > max(GAINED_UNRESOLVED * self.moved, self.round_off)
        return returned or wrong > max(allowed, self.round_off)

    @property
    def warns(self) -> bool:
        """Whether the defect is to be reported."""
        return self.defect > max(WARNED * self.moved, self.round_off)


class Watch:
    """The defect and the energy moved of a run, extended by one balance at a time.

    Parameters
    ----------
    start : the balance at the start of the run, J, in the order of `BALANCE`

    Attributes
    ----------
    moved : float, J, energy moved by now
    """

    def __init__(self, start: Sequence[float]) -> None:
        self.extremes = SimpleNamespace()
        first = self._named(start)
        begin(self.extremes, first.kinetic, potential(first))
        self.low = self.high = defect(first, 0.0)
        self.largest = self.moved = 0.0

    @staticmethod
    def _named(balance: Sequence[float]) -> SimpleNamespace:
        return SimpleNamespace(**dict(zip(BALANCE.names or (), balance, strict=True)))

    def defect(self, balance: Sequence[float]) -> float:
        """Extend the run by a balance; returns its largest rise or fall of the defect, J, NaN from where that is."""
        now = self._named(balance)
        extend(self.extremes, now.kinetic, potential(now), worked(now), lost(now))
        self.moved, found = moved(self.extremes), defect(now, 0.0)
        self.largest = max(self.largest + 0.0 * found, found - self.low, self.high - found)
        self.low, self.high = min(self.low, found), max(self.high, found)
        return self.largest


def columns_of(rows: np.ndarray) -> SimpleNamespace:
    """Columns (..., nt) by name of balances (..., nt, n), whose last axis is in the order of `BALANCE`."""
    return SimpleNamespace(**{name: rows[..., k] for k, name in enumerate(BALANCE.names or ())})


def closure(
    balance: Any, *, moved: float = 0.0, unresolved: float = 0.0, damps: bool = True, floor: float = 0.0
) -> Closure:
    """How well the balances at the samples of a run, (nt,) records, close.

    Parameters
    ----------
    moved : float, J, energy that was moved as a loop saw it, between samples too
    unresolved, damps, floor : as of `Closure`
    """
    of = SimpleNamespace(**{name: values[None] for name, values in vars(columns(balance)).items()})
    (found,) = closures(of, [moved], unresolved=unresolved, damps=damps, floor=floor)
    return found


def closures(
    of: SimpleNamespace, moved: Sequence[float], *, unresolved: float = 0.0, damps: bool = True, floor: float = 0.0
) -> list[Closure]:
    """How well the balances at the samples of several runs close.

    Parameters
    ----------
    of : columns (k, nt) of `BALANCE` by name
    moved : (k,) float, J, energies that were moved as a loop saw it, between samples too
    unresolved, damps, floor : as of `Closure`
    """
    found, high = defect(of, 0.0), functools.partial(np.fmax.reduce, axis=-1, initial=0.0)  # which skips NaN
    finite = np.isfinite(found).all(axis=-1)
    at_samples = np.zeros(len(found))
    if found.shape[-1]:
        at_samples = np.fmax(_moved(of, _over_time(np.fmax.reduce), _over_time(np.fmin.reduce)), 0.0)
    rises = high(found - np.fmin.accumulate(found, axis=-1))
    falls = high(np.fmax.accumulate(found, axis=-1) - found)
    energies = np.maximum(high(np.abs(of.kinetic)), high(np.abs(potential(of))))
    net = high(found - found[..., :1])
    each = []
    for k, own in enumerate(moved):
        if damps or finite[k]:
            whole = max(own, float(at_samples[k]))
            rise, fall, most = float(rises[k]), float(falls[k]), float(energies[k])
            each.append(Closure(whole, rise, fall, most, unresolved, damps, float(net[k]), floor))
        else:  # samples of other methods may have no balance
            each.append(Closure(own, math.inf, math.inf, math.inf, unresolved, damps))
    return each
