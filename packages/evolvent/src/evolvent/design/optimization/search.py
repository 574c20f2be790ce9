"""Search of the best design: sequential quadratic programming from several starts, for every combination of choices."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent.analysis.system import System
from evolvent.design.optimization.answer import Design, Found
from evolvent.design.optimization.problem import Progress, read
from evolvent.design.optimization.runs import Designs, OutOfRuns
from evolvent.design.optimization.slopes import AUTO, WAYS, Slopes
from evolvent.design.optimization.trade import trade
from evolvent_base.errors import InputError, RunFailed

Array = np.ndarray
#: Optimisers of SciPy that are used.
OPTIMIZERS = ("slsqp", "cobyqa")
#: Accuracy of the objective and of requirements, as shares of their sizes.
ACCURACY = 1e-6
#: What stands for the objective and the requirements of a design without a result, in multiples of their sizes.
_NOTHING = 1e3
#: Most times that a search goes on with requirements that are tighter by what was missed, since a solution of
#: quadratic programmes meets them to `ACCURACY` alone.
_REPAIRS = 3


def optimize(
    case: Any,
    *,
    vary: Mapping[str, Any] | Sequence[str],
    minimize: str | Sequence[str] = (),
    maximize: str | Sequence[str] = (),
    subject_to: str | Sequence[str] = (),
    disperse: Mapping[str, Any] | None = None,
    samples: int = 32,
    quantile: float = 0.95,
    tolerances: Mapping[str, Any] | None = None,
    starts: int = 1,
    optimizer: str = "slsqp",
    derivatives: str = AUTO,
    most_runs: int = 5000,
    seed: int = 0,
    workers: int | None = 1,
    overrides: Mapping[str, Any] | None = None,
    until: Any = None,
    progress: Progress | None = None,
) -> Design:
    """Find the values of keys of a case that minimize a result and meet requirements.

    Parameters
    ----------
    case : name of a built-in case, file, content or `System`
    vary : mapping, key -> bounds ``"0.1 to 0.5 N m/rad"``, ``"50% to 200%"`` of the case's value, or a list of
        choices; keys joined by commas vary together. A list of keys varies each from half to twice its value
    minimize, maximize : str or list, names whose sum is the objective (``"hinge 1.latch_work.last"``); a variable over
        time without a reduction counts with its worst value (largest where it is minimized)
    subject_to : str or list, ``"hinge 1.latch_time <= 20 s"``, ``"margin >= 0"`` (every coordinate's); ``<=`` holds
        for the largest value over time and ``>=`` for the least, unless the name has a reduction
    disperse : mapping, key -> distribution about every design (``"5%"``, ``"normal(nominal, 2%)"``): objective and
        requirements are then quantiles over `samples` runs by the same Latin hypercube
    samples, quantile : of the dispersion
    tolerances : mapping, key -> tolerance (``"5%"``) whose cost is found; left out 1 % of every key that varies
    starts : int, searches for every combination of choices: from the case, then from points of a Sobol sequence
    optimizer : "slsqp" (sequential quadratic programming, by derivatives) or "cobyqa" (trust region without
        derivatives, for results that jump or have kinks)
    derivatives : "adjoint" or "discrete" (those of the discrete solution where a run has them, by the adjoint or by
        neighbours as of `evolvent.System.sensitivity`, else differences), "differences" (central ones), or "auto"
        ("adjoint" where it is estimated to take less time than "differences")
    most_runs : int, runs at most; those beside a run, of its derivatives, count as well
    seed : int, of the starts and the dispersion
    workers : int or None, processes; None takes all cores where the work is worth their start
    overrides : mapping, keys of the case that change before
    until : float, s, or with a unit, how long a structure is followed; as its settings say if left out
    progress : called with the number of runs and the best objective so far

    Returns
    -------
    Design
        Also where no design meets all requirements: the one that misses them least, with ``met`` False.

    Raises
    ------
    InputError
        For keys, names, bounds and requirements that cannot be used; one sentence.
    RunFailed
        If no run of any start gives a result.

    Notes
    -----
    Each key is scaled to the way between its bounds, objective and requirements to their sizes at the start.
    Derivatives are those of `slopes`. Quadratic programmes meet requirements to 1e-6 of their sizes; they are asked for
    2e-6 more, and for more again where that is missed, so that the design meets its requirements exactly.

    Examples
    --------
    >>> import evolvent
    >>> found = evolvent.optimize(
    ...     "solar-array", vary={"parts.hinge 1.stiffness": "0.1 to 0.4 N m/rad"}, minimize="hinge 1.latch_rate.last",
    ...     subject_to=["hinge 1.latch_time <= 12 s"],
    ... )  # doctest: +SKIP
    """
    if optimizer not in OPTIMIZERS:
        raise InputError(f"optimizer is {optimizer!r}; it must be one of {', '.join(OPTIMIZERS)}")
    if derivatives not in WAYS:
        raise InputError(f"derivatives is {derivatives!r}; it must be one of {', '.join(WAYS)}")
    for name, value in (("starts", starts), ("most_runs", most_runs), ("workers", workers or 1)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise InputError(f"{name} is {value!r}; it must be a whole number from 1")
    problem = read(
        cases.content_of(_content(case), {**(overrides or {}), **({} if until is None else {"simulate.until": until})}),
        vary=dict.fromkeys(_names(vary)) if not isinstance(vary, Mapping) else vary,
        minimize=_names(minimize), maximize=_names(maximize), subject_to=_names(subject_to), disperse=disperse,
        samples=samples, quantile=quantile, seed=seed,
    )  # fmt: skip
    with Designs(problem, workers, most_runs, progress) as runs:
        return _Search(runs, optimizer, derivatives, starts, seed).design(tolerances)


def _content(case: Any) -> Any:
    """A case, of a system as a file holds it."""
    return cases.parse_yaml(case.to_yaml(), "the system") if isinstance(case, System) else case


def _names(given: Any) -> list[str]:
    return [given] if isinstance(given, str) else list(given)


class _Search:
    """The searches of one problem."""

    def __init__(self, runs: Designs, optimizer: str, derivatives: str, starts: int, seed: int) -> None:
        self.runs, self.problem, self.optimizer = runs, runs.problem, optimizer
        self.slopes = Slopes(runs, derivatives)
        self._starts, self._seed = starts, seed

    def design(self, tolerances: Mapping[str, Any] | None) -> Design:
        """Search from every start, for every combination of choices; then find what governs the best design."""
        own, ends, exhausted = self._own(), [], False
        first = self._found(np.array([one.start for one in self.problem.continuous]), own, "the case as it is")
        try:
            for chosen in self._combinations(own):
                for place in self._places():
                    ends.append(self._end(place, chosen))
        except OutOfRuns:
            exhausted = True
            tried = (Found(place=p, chosen=c, result=r, message="no runs left") for p, c, r in self.runs.designs)
            ends.append(min(tried, key=self._rank, default=first))
        sound = [one for one in (*ends, first) if one.result.sound]
        if not sound:
            reason = first.result.reason or (ends[0].result.reason if ends else "no runs are left")
            raise RunFailed(f"no design that was tried gives a result; of the case itself: {reason}", None)
        best = min(sound, key=self._rank)
        met = self.runs.meets(best.result)
        found = None
        if met and self.problem.continuous:
            try:
                found = trade(self.runs, self.slopes, best.place, best.chosen, tolerances)
            except OutOfRuns:
                exhausted = True
        return Design(
            problem=self.problem, start=first, best=best, met=met, ends=tuple(ends), trade=found,
            history=self.runs.history, runs=self.runs.count, exhausted=exhausted,
            derivatives=self.slopes.found_by, finer=self.runs.finer(best.place, best.chosen),
        )  # fmt: skip

    def _own(self) -> tuple[int, ...]:
        """The case's own choices; the first one where its value is none of them."""
        return tuple(
            one.keys[0].choices.index(one.keys[0].start) if one.keys[0].start in one.keys[0].choices else 0
            for one in self.problem.discrete
        )

    def _combinations(self, own: tuple[int, ...]) -> list[tuple[int, ...]]:
        """All combinations of choices, the case's own first."""
        every = itertools.product(*(range(one.choices) for one in self.problem.discrete))
        return sorted(every, key=lambda chosen: chosen != own)

    def _places(self) -> list[Array]:
        """Where searches start."""
        own = np.array([one.start for one in self.problem.continuous])
        if own.size == 0:
            return [own]
        size = 2 ** max(math.ceil(math.log2(max(self._starts - 1, 1))), 0)
        others = scipy.stats.qmc.Sobol(own.size, rng=np.random.default_rng(self._seed)).random(size)
        return [own, *others[: self._starts - 1]]

    def _found(self, place: Array, chosen: tuple[int, ...], message: str) -> Found:
        return Found(place=place, chosen=chosen, result=self.runs.of([place], chosen)[0], message=message)

    def _rank(self, one: Found) -> tuple[float, float]:
        """Order of designs: those that meet all requirements first, by the objective; others by what they miss."""
        both = zip(self.problem.requirements, one.result.values, self.runs.sizes[1], strict=True)
        missed = sum(max(r.short(value), 0.0) / size for r, value, size in both)
        return missed, one.result.objective * (-1.0 if self.problem.maximize else 1.0)

    def _end(self, place: Array, chosen: tuple[int, ...]) -> Found:
        """Where a search from a place ends."""
        at = self._found(place, chosen, "evaluated")
        if place.size == 0 or not at.result.sound:
            return at
        scaled = _Scaled(self.runs, self.slopes, chosen)
        message, tight = "", np.full(len(self.problem.requirements), 2.0 * ACCURACY)
        for _ in range(1 + _REPAIRS):
            place, message = scaled.minimum(place, tight, self.optimizer)
            missed = scaled.missed(place)
            if not np.any(missed > 0.0) or np.any(missed > 1e3 * ACCURACY):
                break
            tight = tight + np.where(missed > 0.0, np.maximum(2.0 * missed, 4.0 * ACCURACY), 0.0)
        return self._found(place, chosen, message)


class _Scaled:
    """Objective and requirements of designs with one combination of choices, scaled to their sizes at the start."""

    def __init__(self, runs: Designs, slopes: Slopes, chosen: tuple[int, ...]) -> None:
        self._runs, self._slopes, self._chosen = runs, slopes, chosen
        problem = runs.problem
        self._sense = -1.0 if problem.maximize else 1.0
        self._size, self._sizes = runs.sizes
        self._bounds = np.array([one.value for one in problem.requirements])
        self._upper = np.array([1.0 if one.upper else -1.0 for one in problem.requirements])

    def objective(self, place: Array) -> float:
        """The objective, to be minimized."""
        found = self._runs.of([_inside(place)], self._chosen)[0]
        return self._sense * found.objective / self._size if found.sound else _NOTHING

    def slack(self, place: Array) -> Array:
        """What is left to every requirement, above 0 where it is met."""
        found = self._runs.of([_inside(place)], self._chosen)[0]
        if not found.sound:
            return np.full(self._bounds.size, -_NOTHING)
        return self._upper * (self._bounds - found.values) / self._sizes

    def missed(self, place: Array) -> Array:
        """By how much requirements are missed."""
        return -self.slack(place)

    def minimum(self, place: Array, tight: Array, optimizer: str) -> tuple[Array, str]:
        """The end of a search from a place with requirements that are tighter, and the optimiser's message."""
        bounds = [(0.0, 1.0)] * place.size
        if optimizer == "cobyqa":
            constraints: Any = (
                [scipy.optimize.NonlinearConstraint(lambda x: self.slack(x) - tight, 0.0, np.inf)] if tight.size else []
            )
            found = scipy.optimize.minimize(
                self.objective, place, method="COBYQA", bounds=bounds, constraints=constraints,
                options={"initial_tr_radius": 0.1, "final_tr_radius": 1e-6},
            )  # fmt: skip
        else:
            constraints = [
                {"type": "ineq", "fun": lambda x: self.slack(x) - tight, "jac": lambda x: self._slack_slopes(x)}
            ]
            found = scipy.optimize.minimize(
                self.objective, place, jac=self._objective_slopes, method="SLSQP", bounds=bounds,
                constraints=constraints if tight.size else [], options={"ftol": ACCURACY, "maxiter": 200},
            )  # fmt: skip
        return _inside(found.x), str(found.message)

    def _objective_slopes(self, place: Array) -> Array:
        objective, _ = self._slopes.at(_inside(place), self._chosen)
        return self._sense * objective / self._size

    def _slack_slopes(self, place: Array) -> Array:
        _, values = self._slopes.at(_inside(place), self._chosen)
        return -self._upper[:, None] * values / self._sizes[:, None]


def _inside(place: Array) -> Array:
    """A place within the bounds, which optimisers leave by round-off."""
    return np.clip(np.asarray(place, dtype=float), 0.0, 1.0)
