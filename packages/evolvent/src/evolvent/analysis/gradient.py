"""Sensitivities by the adjoint: derivatives of few values by many keys, in one run and one pass back through it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent.analysis import trees
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.variants import Changes
from evolvent.kernels.blocks import displace
from evolvent.results.kept import EXTREME, Kept, kept_of, reduce, split
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.sensitivity.adjoint import Adjoint
from evolvent.solvers.sensitivity.patches import Patch, Sides, restore
from evolvent_base.errors import EvolventError, InputError, RunFailed

if TYPE_CHECKING:
    from evolvent.analysis.composition import Composition
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: Changes of keys, beside their sizes, and of coordinates and rates at samples, beside the sizes of the unknowns.
CHANGE, MOVE, RATE = 1e-6, 1e-5, 1e-4
#: Second differences beside the largest first one, and beside values, from which on a kink is looked for, and what of
#: them is left at half the distance.
BENT, ROUND_OFF, KINK = 0.2, 1e-10, 0.4
#: Largest relative difference of an extreme over all steps from that of the samples, whose derivative is computed.
EXTREME_TOLERANCE = 1e-6
#: Keys of which each is tried alone, whether a value depends on it.
FEW = 1
#: Coordinates and rates of which each is tried, whether a value is a function of it.
FEW_COORDINATES = 50
#: What a solution keeps beside its states and the balance.
LOST = ("acceleration", "la", "forces", "points", "momenta")


class Changed(NamedTuple):
    """A key: its name, its change to both sides, and what the systems with it larger and smaller have changed."""

    name: str
    change: float
    sides: Sides


class ChangedNumbers:
    """What keys change in the model of a system.

    A changed system of which records and parameters alone differ, and that starts as the system does, is not assembled:
    its numbers are written into one model of the first system, which serves all of them.

    Parameters
    ----------
    system, assembly : the system, and as it is assembled
    """

    def __init__(self, system: Composition, assembly: Assembly) -> None:
        self._system, self._base, self._variants = system, assembly, system._variants
        self._scratch: Any = None

    def of(self, changed: Composition) -> Changes | Assembly:
        """What differs in a changed system, which is assembled only where more than numbers may.

        Raises
        ------
        InputError
            Where it cannot be assembled.
        """
        variants, found = self._variants, None
        starts_alike = not (self._system.sections or changed.sections)
        if variants is not None and starts_alike and self._base.touched is not None:
            found = variants.changes(changed._gravity, changed.parts)
        return changed._assembled() if found is None else found

    def sides(self, name: str, up: Changes | Assembly, down: Changes | Assembly) -> Sides:
        """What a key changes, by what differs in the systems with it larger and smaller.

        Raises
        ------
        InputError
            As of `Patch.between`.
        """
        (above, y), (below, y_below) = (self._side(name, one) for one in (up, down))
        return Sides((above, below), (y, y_below))

    def _side(self, name: str, found: Changes | Assembly) -> tuple[Patch, Array]:
        if isinstance(found, Assembly):
            return Patch.between(self._base, found, name), found.y
        assert self._variants is not None
        first, arrays = self._variants.first.model, self._base.touched or frozenset()
        if self._scratch is None:
            self._scratch = first.copy()
            needs.note_alike(first, self._scratch)
        touched = self._variants.write(found, self._scratch)
        try:
            patch = Patch.in_arrays(self._base.model, self._scratch, sorted(touched | arrays), name)
        finally:
            restore(first, self._scratch, touched)
        return patch, self._base.y


@dataclasses.dataclass(frozen=True)
class Gradient:
    """Values of a run and their derivatives.

    Attributes
    ----------
    kept : Kept, the values; values : (n,) float; derivative : (n, keys) float, SI
    plan : of the run; solution : Solution
    """

    kept: Kept
    values: Array
    derivative: Array
    plan: Any
    solution: Solution


def gradient(
    assembly: Assembly, make: Callable[[], Any], keys: Sequence[Changed],
    together: Callable[[Mapping[int, float]], Assembly], names: Sequence[str],
    read: Callable[[Solution], tuple[Kept, Array]], progress: Callable[[float], None] | None,
) -> Gradient:  # fmt: skip
    """Run, and find derivatives of values by keys.

    Parameters
    ----------
    make : returns a plan of the run, another one each time
    keys : what the keys are and change
    together : returns the system with several keys, given by their numbers, changed at once
    names : of the values
    read : returns values of a solution, and as numbers

    Raises
    ------
    InputError, RunFailed
        As of `evolvent.System.sensitivity`.
    """
    adjoint = Adjoint(make, keys)
    try:
        status, message = adjoint.run(progress)
    except EvolventError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
        raise RunFailed(law_failure(assembly, error, adjoint.lead.moments()), None) from None
    solution = adjoint.lead.result(status, message, 0.0)
    if status == "failed":
        raise RunFailed(message, trees.tree(solution.or_start(0.0), case="", why=""))
    kept, values = read(solution)
    seeds = [_seeds(solution, name, value, adjoint) for name, value in zip(names, values, strict=True)]
    found = adjoint.gradients(np.array([one[0] for one in seeds]), np.array([one[1] for one in seeds]))
    for k, name in enumerate(names):
        if split(name)[1]:
            found[k] += _own_change(solution, name, keys, together)
    return Gradient(kept, values, found, adjoint.lead.plan, solution)


def _series(solution: Solution, name: str, assembly: Assembly | None = None) -> Array:
    """A variable at the samples of a solution, (nt,), of coordinates and rates alone: all else that is kept is NaN."""
    kept, y, info = solution.kept, solution.y.copy(), solution.assembly.model.info
    y[:, int(info.nq) + int(info.nv) :] = np.nan
    if kept is not None:
        kept = kept._replace(
            balance=kept.balance.copy(),
            **{name: np.full_like(getattr(kept, name), np.nan) for name in LOST if getattr(kept, name) is not None},
        )
        for field in kept.balance.dtype.names:
            kept.balance[field] = np.nan
    of = dataclasses.replace(
        solution, y=y, kept=kept, reactions=None, assembly=solution.assembly if assembly is None else assembly
    )  # fmt: skip
    found = kept_of(of, [name], dict, fine=np.zeros(of.t.size, dtype=bool), why="")  # type: ignore[arg-type]
    values = np.asarray(found[name], dtype=float)
    if values.shape != (of.t.size,):
        raise InputError(f"{name!r} is no single number at a time; name a component")
    if np.any(np.isnan(values)):
        raise InputError(
            f"the adjoint of {name!r} is not supported, which does not follow from coordinates and rates alone; take "
            f"mode 'forward'"
        )
    return values


def _own_change(
    solution: Solution, name: str, keys: Sequence[Changed], together: Callable[[Mapping[int, float]], Assembly]
) -> Array:
    """Derivatives of a value by keys where the states stay, (keys,).

    Keys that leave the value as it is are found many at a time: halves of those that change it are tried in turn.
    """
    variable, reduction = split(name)
    weights = _weights(_series(solution, variable), solution.t, reduction)
    samples = np.flatnonzero(weights)
    chosen, found = solution.chosen(np.append([0], samples)), np.zeros(len(keys))
    values, shares = _series(chosen, variable), np.random.default_rng(0).uniform(0.5, 1.0, len(keys))
    tried = [list(range(len(keys)))]
    while tried:
        some = tried.pop()
        if len(some) > FEW:
            one = together({j: float(shares[j]) * keys[j].change for j in some})
            if not np.array_equal(_series(chosen, variable, one), values):
                tried += [some[: len(some) // 2], some[len(some) // 2 :]]
            continue
        for j in some:
            ends = [together({j: side * keys[j].change}) for side in (1.0, -1.0)]
            sides = [weights[samples] @ _series(chosen, variable, one)[1:] for one in ends]
            found[j] = (sides[0] - sides[1]) / (2.0 * keys[j].change)
    return found


def _weights(values: Array, t: Array, reduction: str) -> Array:
    """Derivatives of what a series is reduced to by its values, (nt,)."""
    found, n = np.zeros(t.size), t.size
    if reduction in ("min", "max", "abs_max"):
        k = int({"min": np.nanargmin, "max": np.nanargmax}.get(reduction, lambda x: np.nanargmax(np.abs(x)))(values))
        found[k] = np.sign(values[k]) if reduction == "abs_max" else 1.0
    elif reduction in ("mean", "integral"):
        weights = np.full(n, 1.0 / n) if reduction == "mean" else np.zeros(n)
        if reduction == "integral":
            steps = np.diff(t)
            weights[:-1] += 0.5 * steps
            weights[1:] += 0.5 * steps
        return weights
    else:  # straight lines between samples
        for k in range(n):
            unit = np.zeros(n)
            unit[k] = 1.0
            found[k] = float(reduce(unit, t, reduction)) if _near(k, t, reduction) else 0.0
    return found


def _near(k: int, t: Array, reduction: str) -> bool:
    """Whether sample k may count in a value at a time; all may of `first` and `last`."""
    return reduction not in ("first", "last") or k in (0, t.size - 1)


def _seeds(solution: Solution, name: str, value: float, adjoint: Adjoint) -> tuple[Array, Array]:
    """Derivatives of a value by coordinates and rates at the samples, and by the times of events."""
    n_v, times = adjoint.n_v, solution.event_times
    by_sample, by_event = np.zeros((solution.t.size, 2 * n_v)), np.zeros(times.size)
    variable, reduction = split(name)
    if not reduction:
        at = np.flatnonzero(times == value)
        if at.size != 1:
            raise InputError(
                f"the adjoint of {name!r} is not supported, which is no time of a latch or event; take mode 'forward'"
            )
        by_event[at[0]] = 1.0
        return by_sample, by_event
    series = _series(solution, variable)
    weights = _weights(series, solution.t, reduction)
    samples = np.flatnonzero(weights)
    at_samples = reduce(series, solution.t, reduction) if reduction in EXTREME else value
    if abs(value - at_samples) > EXTREME_TOLERANCE * abs(value):
        raise InputError(
            f"the adjoint of {name!r} is not supported: the value is {value:.6g} over all steps and {at_samples:.6g} "
            f"at the samples; take mode 'forward', or more samples"
        )
    if not np.array_equal(_series(solution.chosen(np.append([0], samples)), variable)[1:], series[samples]):
        raise InputError(
            f"the adjoint of {name!r} is not supported, which follows from several samples; take mode 'forward'"
        )
    size = np.concatenate([MOVE * adjoint.lead.work.weight[:n_v], RATE * adjoint.lead.work.weight[:n_v]])
    of = _acting(solution, variable, samples, size, adjoint)
    values = _beside(solution, variable, samples, size, of, adjoint)
    middle, least = series[samples, None], ROUND_OFF * np.abs(series).max(initial=0.0)
    bend = np.abs(values.sum(axis=2) - 2.0 * middle)
    bent = bend > np.maximum(BENT * np.abs(values[..., 0] - values[..., 1]).max(axis=1, initial=0.0)[:, None], least)
    if np.any(bent):  # half of it at half the distance, where the value has a kink, a quarter where it is smooth
        nearer = np.abs(_beside(solution, variable, samples, 0.5 * size, of, adjoint).sum(axis=2) - 2.0 * middle)
        if np.any(nearer[bent] > KINK * bend[bent]):
            raise InputError(
                f"the adjoint of {name!r} is not supported, which has a kink there, such as the largest of several "
                f"values that are alike; take mode 'forward', or a value of one node"
            )
    by_sample[np.ix_(samples, of)] = weights[samples, None] * (values[..., 0] - values[..., 1]) / (2.0 * size[of])
    if (samples.size and samples[0] > 0) or samples.size > 1:
        by_sample[0] += _by_start(solution, variable, weights, size, adjoint)
    return by_sample, by_event


def _acting(solution: Solution, variable: str, samples: Array, size: Array, adjoint: Adjoint) -> Array:
    """Coordinates and rates of which a variable at samples is a function, (n,) int: many are tried at once."""
    many = max(1, int(math.sqrt(size.size)))
    if size.size < FEW_COORDINATES:
        return np.arange(size.size)
    parts, shares = np.array_split(np.arange(size.size), many), np.random.default_rng(0).uniform(0.5, 1.0, size.size)
    moves = np.zeros((many, size.size))
    for k, own in enumerate(parts):
        moves[k, own] = shares[own] * size[own]
    states = solution.chosen(np.concatenate([[0], np.repeat(samples, 1 + many)]))
    y = states.y.copy()
    for k in range(samples.size):
        for i, move in enumerate(moves):
            row = 2 + k * (1 + many) + i
            y[row] = _moved(y[row], move, adjoint)
    values = _series(dataclasses.replace(states, y=y), variable)[1:].reshape(samples.size, 1 + many)
    acts = np.any(values[:, 1:] != values[:, :1], axis=0)
    return np.concatenate([own for own, one in zip(parts, acts, strict=True) if one] or [np.zeros(0, dtype=np.int64)])


def _beside(solution: Solution, variable: str, samples: Array, size: Array, of: Array, adjoint: Adjoint) -> Array:
    """A variable (samples, n, 2) at samples where n coordinates and rates are larger and smaller by their sizes."""
    moved = solution.chosen(np.concatenate([[0], np.repeat(samples, 2 * of.size)]))
    states, row = moved.y.copy(), 1
    for _ in samples:
        for j in of.tolist():
            for sign in (1.0, -1.0):
                states[row] = _moved(states[row], _single(j, sign * size[j], size.size), adjoint)
                row += 1
    return _series(dataclasses.replace(moved, y=states), variable)[1:].reshape(samples.size, of.size, 2)


def _single(j: int, d: float, n: int) -> Array:
    """A change (n,) of one coordinate or rate."""
    found = np.zeros(n)
    found[j] = d
    return found


def _moved(y: Array, change: Array, adjoint: Adjoint) -> Array:
    """A state with its coordinates and, behind them in `change`, its rates changed."""
    model, n_v, found = adjoint.lead.model, adjoint.n_v, y.copy()
    if np.any(change[:n_v]):
        displace(y, np.ascontiguousarray(change[:n_v]), False, model, found)
    n_q = int(model.info.nq)
    found[n_q : n_q + n_v] += change[n_v:]
    return found


def _by_start(solution: Solution, name: str, weights: Array, size: Array, adjoint: Adjoint) -> Array:
    """Derivatives by the first sample of a variable that refers to it, at the others."""
    samples = np.flatnonzero(weights)
    samples = np.concatenate([[0], samples[samples > 0]])
    chosen = solution.chosen(samples)

    def others(j: int, d: float) -> float:
        y = chosen.y.copy()
        y[0] = _moved(y[0], _single(j, d, size.size), adjoint)
        return float(weights[samples[1:]] @ _series(dataclasses.replace(chosen, y=y), name)[1:])

    y = chosen.y.copy()
    y[0] = _moved(y[0], size * np.random.default_rng(0).uniform(0.5, 1.0, size.size), adjoint)
    changed = _series(dataclasses.replace(chosen, y=y), name)[1:]
    if np.array_equal(changed, _series(chosen, name)[1:]):
        return np.zeros(size.size)
    return np.array([(others(j, d) - others(j, -d)) / (2.0 * d) for j, d in enumerate(size)])
