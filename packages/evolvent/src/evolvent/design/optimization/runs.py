"""Designs of a problem: each evaluated once, here or beside one another, and what they give."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.evaluator.record import CaseRow
from evolvent.design.evaluator.runs import CaseRuns, files_of
from evolvent.design.evaluator.task import Point
from evolvent.design.optimization.problem import DesignProblem, Progress
from evolvent.results.kept import stored_name
from evolvent_base.errors import InputError

Array = np.ndarray
#: Times that designs are expected to be evaluated in a search, for the worth of processes.
_EXPECTED = 60


@dataclasses.dataclass(frozen=True, eq=False)
class DesignResult:
    """What a design gives.

    Attributes
    ----------
    objective : float, in its unit; NaN where a run has failed or lacks a value
    values : (requirements,) float
    reason : str, why the design gives nothing; else empty
    """

    objective: float
    values: Array
    reason: str = ""

    @property
    def sound(self) -> bool:
        """Whether the objective and all values are there."""
        return math.isfinite(self.objective) and bool(np.all(np.isfinite(self.values)))


class OutOfRuns(Exception):
    """The number of runs that a search may take is used up."""


class Designs:
    """The designs of a problem, a context at whose end its processes end.

    Parameters
    ----------
    problem : DesignProblem
    workers : int or None, processes or threads; None takes all cores where the work is worth their start
    most : int, runs at most
    progress : called with the number of runs and the best objective so far
    """

    def __init__(self, problem: DesignProblem, workers: int | None, most: int, progress: Progress | None) -> None:
        self.problem, self.most, self.count = problem, most, 0
        self._progress: Callable[[int, float], None] = progress or (lambda runs, best: None)
        self._known: dict[tuple[bytes, tuple[int, ...]], DesignResult] = {}
        dispersed = problem.dispersed.keys if problem.dispersed is not None else ()
        varied = [key.key for one in problem.variables for key in one.keys] + [spread.key for spread, _ in dispersed]
        choices = [one.overrides(k) for one in problem.discrete for k in range(one.choices)]
        files = files_of(problem.content, [{}, *choices])
        self.runs = CaseRuns(content=problem.content, keep=problem.keep, files=files, varied=tuple(varied))
        self._evaluator = Evaluator(self.runs, workers=workers, calls=_EXPECTED)
        self.designs: list[tuple[Array, tuple[int, ...], DesignResult]] = []  # that gave a result
        self._sizes: tuple[float, Array] | None = None
        self.history: list[tuple[int, float, bool]] = []  # runs, objective, whether all requirements are met

    def __enter__(self) -> Designs:
        return self

    def __exit__(self, *error: Any) -> None:
        self._evaluator.__exit__(*error)

    def of(self, places: Sequence[Array], chosen: tuple[int, ...]) -> list[DesignResult]:
        """What designs give, in order.

        Raises
        ------
        OutOfRuns
            If they would take more runs than `most`.
        InputError
            If the runs do not have a result that is asked for.
        """
        keys = [(place.tobytes(), chosen) for place in places]
        new = {key: place for key, place in zip(keys, places, strict=True) if key not in self._known}
        each = [(key, self._cases(place, chosen)) for key, place in new.items()]
        several = [runs for _, runs in each if not isinstance(runs, str)]
        if self.count + sum(map(len, several)) > self.most:
            raise OutOfRuns
        results = iter(self._results(several))
        for key, runs in each:
            if isinstance(runs, str):
                self._known[key] = self._nothing(runs)
                continue
            self.count += len(runs)
            found = self._known[key] = next(results)
            if found.sound:
                self._sizes = self._sizes or (size(found.objective), self._sizes_of(found.values))
                self.history.append((self.count, found.objective, self.meets(found)))
                self.designs.append((new[key], chosen, found))
            self._progress(self.count, self.best())
        return [self._known[key] for key in keys]

    def beside(self, place: Array, chosen: tuple[int, ...], changes: Sequence[Mapping[str, Any]]) -> list[DesignResult]:
        """What a design gives where keys of the case change as well: one result for each of `changes`.

        Raises
        ------
        OutOfRuns
        """
        several = [[{**run, **one} for run in self.problem.runs(place, chosen)] for one in changes]
        self.take(sum(map(len, several)))
        return self._results(several)

    def finer(self, place: Array, chosen: tuple[int, ...]) -> DesignResult:
        """What a design gives with finer integration of its runs, which are not counted."""
        return self._results([self.problem.runs(place, chosen)], level=1.0)[0]

    def take(self, runs: int) -> None:
        """Count runs that are made elsewhere.

        Raises
        ------
        OutOfRuns
        """
        if self.count + runs > self.most:
            raise OutOfRuns
        self.count += runs

    @property
    def sizes(self) -> tuple[float, Array]:
        """What counts as 1 of the objective, and of every requirement: its bound, or its value in the first design."""
        return self._sizes or (1.0, np.ones(len(self.problem.requirements)))

    def _sizes_of(self, values: Array) -> Array:
        return np.array([size(one.value, value) for one, value in zip(self.problem.requirements, values, strict=True)])

    def best(self) -> float:
        """Best objective so far of designs that meet all requirements; NaN without one."""
        met = [value for _, value, meets in self.history if meets]
        return (max(met) if self.problem.maximize else min(met)) if met else math.nan

    def meets(self, found: DesignResult) -> bool:
        """Whether a design meets all requirements."""
        return all(one.short(value) <= 0.0 for one, value in zip(self.problem.requirements, found.values, strict=True))

    def _cases(self, place: Array, chosen: tuple[int, ...]) -> list[dict[str, Any]] | str:
        """Keys of the runs of a design, or why it has none."""
        try:
            return self.problem.runs(place, chosen)
        except InputError as error:
            return str(error)

    def _nothing(self, reason: str) -> DesignResult:
        return DesignResult(math.nan, np.full(len(self.problem.requirements), math.nan), reason)

    def _results(self, several: Sequence[Sequence[Point]], level: float = 0.0) -> list[DesignResult]:
        """The results of designs from the keys of their runs, which are evaluated together."""
        rows = iter(self._evaluator.of([run for own in several for run in own], level=level))
        return [self._result([next(rows) for _ in own]) for own in several]

    def _result(self, outcomes: Sequence[CaseRow]) -> DesignResult:
        """The result of a design from those of its runs: of a dispersion quantiles, with failed runs as worst."""
        failed = next((one.reason for one in outcomes if one.status == "failed"), "")
        rows = [self._row(one) for one in outcomes]
        if self.problem.dispersed is None:
            if failed:
                return self._nothing(failed)
            lacking = self._lacking(rows[0])
            return DesignResult(rows[0][0], rows[0][1], lacking)
        share = self.problem.dispersed.quantile
        objective = quantile([row[0] for row in rows], share, upper=not self.problem.maximize)
        values = [
            quantile([row[1][k] for row in rows], share, upper=one.upper)
            for k, one in enumerate(self.problem.requirements)
        ]
        found = DesignResult(objective, np.array(values))
        if found.sound:
            return found
        return dataclasses.replace(found, reason=failed or self._lacking((objective, found.values)))

    def _row(self, one: CaseRow) -> tuple[float, Array]:
        terms = [value_of(one, name) for name in self.problem.objective_keep]
        return sum(terms), np.array([value_of(one, r.keep) for r in self.problem.requirements])

    def _lacking(self, row: tuple[float, Array]) -> str:
        """Which results a run does not have."""
        names = [" + ".join(self.problem.objective)] if not math.isfinite(row[0]) else []
        names += [
            one.name for one, value in zip(self.problem.requirements, row[1], strict=True) if not math.isfinite(value)
        ]
        return f"{', '.join(dict.fromkeys(names))} has no value in the run" if names else ""


def value_of(one: CaseRow, name: str) -> float:
    """What a run has of a name; NaN where it has none."""
    found = one.values(stored_name(name))
    if found is None:
        return math.nan
    if found.ndim:
        raise InputError(f"{name!r} has {found.shape} values in a run; name one of them")
    return float(found)


def size(*values: float) -> float:
    """The largest magnitude of values, 1 where all are 0."""
    return max(map(abs, values)) or 1.0


def quantile(values: Sequence[float], share: float, *, upper: bool) -> float:
    """The value that a share of the runs does not exceed (`upper`), or does not fall below: an order statistic.

    Runs without a value count as beyond all others; NaN where the quantile is one of them.
    """
    signed = np.array(values) * (1.0 if upper else -1.0)
    ordered = np.sort(np.where(np.isfinite(signed), signed, math.inf))
    found = float(ordered[min(math.ceil(share * ordered.size - 1e-9), ordered.size) - 1])
    return (found if upper else -found) if math.isfinite(found) else math.nan
