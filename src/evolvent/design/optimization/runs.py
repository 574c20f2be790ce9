"""Runs of a design problem: each design once, here or on several processes, and what they give."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
import multiprocessing
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.assembly.variants import Variants
from evolvent.base.errors import InputError
from evolvent.design.optimization.problem import Problem, Progress, Requirement
from evolvent.design.studies import record, runner, tasks
from evolvent.results.kept import stored_name

Array = np.ndarray
#: Seconds of work from which other processes are started, and runs a variable that a search is expected to take.
_SMALL, _EXPECTED = 15.0, 60
#: The case, what is kept of its runs, and what they share, in a process that is one of several.
_OWN: dict[str, Any] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class Result:
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


class Runs:
    """The runs of a problem.

    Parameters
    ----------
    problem : Problem
    workers : int or None, processes; None takes all cores where the work is worth their start
    most : int, runs at most
    progress : called with the number of runs and the best objective so far
    """

    def __init__(self, problem: Problem, workers: int | None, most: int, progress: Progress | None) -> None:
        self.problem, self.most, self._workers = problem, most, workers
        self._progress: Callable[[int, float], None] = progress or (lambda runs, best: None)
        self._pool: concurrent.futures.ProcessPoolExecutor | None = None
        self._known: dict[tuple[bytes, tuple[int, ...]], Result] = {}
        self.files = _files_of(problem)
        self.designs: list[tuple[Array, tuple[int, ...], Result]] = []  # that gave a result
        self._sizes: tuple[float, Array] | None = None
        self.history: list[tuple[int, float, bool]] = []  # runs, objective, whether all requirements are met
        self.count, self._cost, self._variants = 0, 0.0, Variants()

    def __enter__(self) -> Runs:
        return self

    def __exit__(self, *error: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=not any(error), cancel_futures=True)

    def of(self, places: Sequence[Array], chosen: tuple[int, ...]) -> list[Result]:
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
        new_runs = sum(len(runs) for _, runs in each if not isinstance(runs, str))
        if self.count + new_runs > self.most:
            raise OutOfRuns
        outcomes = iter(self._outcomes([one for _, runs in each if not isinstance(runs, str) for one in runs]))
        for key, runs in each:
            if isinstance(runs, str):
                self._known[key] = self._nothing(runs)
                continue
            own = [next(outcomes) for _ in runs]
            self.count += len(own)
            found = self._known[key] = self._result(own)
            if found.sound:
                self._sizes = self._sizes or (size(found.objective), self._sizes_of(found.values))
                self.history.append((self.count, found.objective, self.meets(found)))
                self.designs.append((new[key], chosen, found))
            self._progress(self.count, self.best())
        return [self._known[key] for key in keys]

    def beside(self, place: Array, chosen: tuple[int, ...], changes: Sequence[Mapping[str, Any]]) -> list[Result]:
        """What a design gives where keys of the case change as well: one result for each of `changes`.

        Raises
        ------
        OutOfRuns
        """
        several = [[{**run, **one} for run in self.problem.runs(place, chosen)] for one in changes]
        if self.count + sum(map(len, several)) > self.most:
            raise OutOfRuns
        outcomes = iter(self._outcomes([run for own in several for run in own]))
        self.count += sum(map(len, several))
        return [self._result([next(outcomes) for _ in own]) for own in several]

    def finer(self, place: Array, chosen: tuple[int, ...]) -> Result:
        """What a design gives with finer integration of its runs, which are not counted."""
        keep, shared = self.problem.keep, Variants()
        runs = self.problem.runs(place, chosen)
        return self._result([tasks.outcome_of(self.problem.content, one, keep, shared, level=1.0) for one in runs])

    def take(self, runs: int) -> None:
        """Count runs that are made elsewhere.

        Raises
        ------
        OutOfRuns
        """
        if self.count + runs > self.most:
            raise OutOfRuns
        self.count += runs

    def margins(self, place: Array, chosen: tuple[int, ...], names: Sequence[str]) -> dict[str, float]:
        """Margins at rest of a design by name, without a run.

        Raises
        ------
        InputError
            Where the design has none.
        """
        overrides = self.problem.overrides(place, chosen)
        found = tasks.outcome_of(self.problem.content, overrides, names, self._variants)
        if found.status == "failed":
            raise InputError(found.reason)
        return {name: float(found.variables[stored_name(name)].values) for name in names}

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

    def meets(self, found: Result) -> bool:
        """Whether a design meets all requirements."""
        return all(short(one, value) <= 0.0 for one, value in zip(self.problem.requirements, found.values, strict=True))

    def _cases(self, place: Array, chosen: tuple[int, ...]) -> list[dict[str, Any]] | str:
        """Keys of the runs of a design, or why it has none."""
        try:
            return self.problem.runs(place, chosen)
        except InputError as error:
            return str(error)

    def _nothing(self, reason: str) -> Result:
        return Result(math.nan, np.full(len(self.problem.requirements), math.nan), reason)

    def _outcomes(self, runs: Sequence[Mapping[str, Any]]) -> list[record.Outcome]:
        """What is kept of runs, in order."""
        began, found = time.perf_counter(), []
        if self._pool is None and self._is_worth_processes(len(runs)):
            self._pool = concurrent.futures.ProcessPoolExecutor(
                self._workers or runner.cores(), mp_context=multiprocessing.get_context("spawn"), initializer=_begin,
                initargs=(self.problem.content, self.problem.keep),
            )  # fmt: skip
        if self._pool is not None and len(runs) > 1:
            found = list(self._pool.map(_outcome, runs))
        else:
            own = self.problem.content, self.problem.keep
            found = [tasks.outcome_of(own[0], one, own[1], self._variants) for one in runs]
            self._cost = (time.perf_counter() - began) / max(len(runs), 1)
        cases.check_files(self.files)
        if self.count == 0:
            record.check_kept(found)
        return found

    def _is_worth_processes(self, batch: int) -> bool:
        if self._workers is not None:
            return self._workers > 1 and batch > 1 and self.count > 0
        return batch > 1 and runner.cores() > 1 and self._cost * _EXPECTED * batch > _SMALL

    def _result(self, outcomes: Sequence[record.Outcome]) -> Result:
        """The result of a design from those of its runs: of a dispersion quantiles, with failed runs as worst."""
        failed = next((one.reason for one in outcomes if one.status == "failed"), "")
        rows = [self._row(one) for one in outcomes]
        if self.problem.dispersed is None:
            if failed:
                return self._nothing(failed)
            lacking = self._lacking(rows[0])
            return Result(rows[0][0], rows[0][1], lacking)
        share = self.problem.dispersed.quantile
        objective = quantile([row[0] for row in rows], share, upper=not self.problem.maximize)
        values = [
            quantile([row[1][k] for row in rows], share, upper=one.upper)
            for k, one in enumerate(self.problem.requirements)
        ]
        found = Result(objective, np.array(values))
        if found.sound:
            return found
        return dataclasses.replace(found, reason=failed or self._lacking((objective, found.values)))

    def _row(self, one: record.Outcome) -> tuple[float, Array]:
        def value(name: str) -> float:
            variable = one.variables.get(stored_name(name))
            if variable is None:
                return math.nan
            if variable.ndim:
                raise InputError(f"{name!r} has {variable.shape} values in a run; name one of them")
            return float(variable.values)

        terms = [value(name) for name in self.problem.objective_keep]
        return sum(terms), np.array([value(r.keep) for r in self.problem.requirements])

    def _lacking(self, row: tuple[float, Array]) -> str:
        """Which results a run does not have."""
        names = [" + ".join(self.problem.objective)] if not math.isfinite(row[0]) else []
        names += [
            one.name for one, value in zip(self.problem.requirements, row[1], strict=True) if not math.isfinite(value)
        ]
        return f"{', '.join(dict.fromkeys(names))} has no value in the run" if names else ""


def _files_of(problem: Problem) -> dict[str, str]:
    """Files that the runs of a problem read (`cases.files_of`)."""
    found = cases.files_of(problem.content)
    for one in problem.discrete:
        for number in range(one.choices):
            found |= cases.files_of(cases.content_of(problem.content, one.overrides(number)))
    return found


def size(*values: float) -> float:
    """The largest magnitude of values, 1 where all are 0."""
    return max(map(abs, values)) or 1.0


def short(one: Requirement, value: float) -> float:
    """By how much a value misses a requirement; below 0 where it meets it."""
    return value - one.value if one.upper else one.value - value


def quantile(values: Sequence[float], share: float, *, upper: bool) -> float:
    """The value that a share of the runs does not exceed (`upper`), or does not fall below: an order statistic.

    Runs without a value count as beyond all others; NaN where the quantile is one of them.
    """
    signed = np.array(values) * (1.0 if upper else -1.0)
    ordered = np.sort(np.where(np.isfinite(signed), signed, math.inf))
    found = float(ordered[min(math.ceil(share * ordered.size - 1e-9), ordered.size) - 1])
    return (found if upper else -found) if math.isfinite(found) else math.nan


def _begin(content: dict[str, Any], keep: tuple[str, ...]) -> None:
    """Set what the runs of this process have in common."""
    _OWN.update(content=content, keep=keep, variants=Variants())


def _outcome(overrides: Mapping[str, Any]) -> record.Outcome:
    """What is kept of the run of a design."""
    return tasks.outcome_of(_OWN["content"], overrides, _OWN["keep"], _OWN["variants"])
