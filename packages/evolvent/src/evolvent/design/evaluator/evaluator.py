"""Evaluate runs at points: hand out those that are new, keep what comes back, go on after any end."""

from __future__ import annotations

import contextlib
import json
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import Any, Self

import numpy as np

from evolvent.compiled import codecache
from evolvent.design.evaluator import pools, record, sources
from evolvent.design.evaluator.log import Key, Log
from evolvent.design.evaluator.task import EvaluationResult, EvaluationTask, Point, Runs, compute, one_thread
from evolvent_base.console import compiling
from evolvent_base.errors import EvolventError, InputError

#: Seconds that an automatic task takes, once the cost of a point is known.
_TASK = 1.0
#: Seconds of work that are left for this process, rather than to start others for them.
_SMALL = 8.0
#: Points from which their cost is measured before processes are started, whatever their number.
_MANY = 50
#: Expected seconds from which a forecast of the duration is given.
_LONG = 10.0
#: Tasks that wait at every worker.
_AHEAD = 2
#: Number of times that a point may terminate its process while it is evaluated alone; then it is marked as failed.
_DEATHS = 2

Progress = Callable[[int, int], None]


class Evaluator:
    """Kept values of runs at points, each evaluated once; a context, at whose end its processes end.

    Parameters
    ----------
    runs : Runs
        What is evaluated.
    log : Log, optional
        Keeps every evaluation; what it has found is not evaluated again.
    workers : int or None
        1 computes here, None takes all cores where the work is worth their start; threads up to the runs'
        `most_threads`, else processes.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers are taken.
    batch : int
        Points a task; 0 for about a second of work.
    calls : int
        How often `of` is expected to be called with so many points, for the worth of processes.
    one_thread : bool
        Whether linear algebra takes one thread, so that bits are those of any machine.
    progress : called with the number of points done and of all
    report : called with a sentence about what a user should know (a compilation, a worker that died)

    Attributes
    ----------
    tables : list of record.Table, of all that is known
    evaluations, reused : int, points that were evaluated, and that were taken from the log
    """

    def __init__(
        self, runs: Runs, *, log: Log | None = None, workers: int | None = 1, scheduler: str | None = None,
        batch: int = 0, calls: int = 1, one_thread: bool = False, progress: Progress | None = None,
        report: pools.Report | None = None,
    ) -> None:  # fmt: skip
        self.runs, self.workers, self.scheduler, self.batch, self.calls = runs, workers, scheduler, batch, calls
        self.one_thread, self.progress, self.report = one_thread, progress or _silent, report or _silent
        self._log, self.name = log, uuid.uuid4().hex
        self.pool: pools.Pool | None = None
        self.tables: list[record.CaseTable] = []
        self.known: dict[Key, record.CaseRow] = {}
        self.evaluations = self.reused = self.tasks = self._asked = 0
        self.cost = 0.0  # s, of a point in the last task
        for keys, rows in log.found if log is not None else ():
            self._add(keys, rows)
        self._stored = set(self.known)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self.pool is not None:
            self.pool.close(at_once=any(error))
        self.pool = None

    def of(self, points: Sequence[Point], *, numbered: bool = False, level: float = 0.0) -> list[record.CaseRow]:
        """What is kept at points, in order.

        Parameters
        ----------
        points : sequence of Point; one may find them as they are asked for
        numbered : bool, whether points are known by their numbers, as cases of a study are, instead of their content
        level : float, of finer integration (`evolvent.analysis.accuracy`)

        Raises
        ------
        InputError
            If none of the first runs has what is to be kept, or the log cannot be written.
        EvolventError
            If a scheduler stops or loses tasks.
        KeyboardInterrupt
            On Ctrl-C; what was finished is kept.
        """
        keys: Sequence[Key] = range(len(points)) if numbered else [_key(one, level) for one in points]
        with one_thread(self.one_thread):
            _Call(self, points, keys, 0 if numbered else self._asked, level).run()
        self._asked += len(keys)
        reused = self._stored.intersection(keys)
        self._stored -= reused
        self.reused += len(reused)
        return [self.known[key] for key in keys]

    def table(self) -> record.CaseTable:
        """Everything that is known, a row each in the order of the points' numbers."""
        return record.join(self.tables)

    def keep(self, keys: Sequence[Key], result: EvaluationResult) -> None:
        """Keep a finished task."""
        if result.refused and self.tasks == 0:
            raise InputError(result.refused)
        for sentence in result.notes:
            self.report(sentence)
        if self._log is not None:
            self._log.append(keys, result.rows)
        self._add(keys, result.rows)
        self.tasks += 1
        self.evaluations += len(keys)
        self.cost = result.seconds / len(keys)

    def _add(self, keys: Sequence[Key], rows: record.CaseTable) -> None:
        self.tables.append(rows)
        self.known |= {key: record.CaseRow(rows, place) for place, key in enumerate(keys)}


class _Call:
    """One call of `Evaluator.of`: the points that are new."""

    def __init__(
        self, evaluator: Evaluator, points: Sequence[Point], keys: Sequence[Key], first: int, level: float
    ) -> None:
        self.of, self.points, self.keys, self.first, self.level = evaluator, points, keys, first, level
        new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in evaluator.known}
        self.pending = deque(sorted(new.values()))
        self.done = len(keys) - len(self.pending)
        self.running: dict[Future[Any], Sequence[int]] = {}
        self.suspects: deque[int] = deque()  # whose process has died
        self.deaths: Counter[int] = Counter()  # of points that were evaluated alone
        self.is_alone = self.has_died = False

    def run(self) -> None:
        """Evaluate all that is pending."""
        self.of.progress(self.done, len(self.keys))
        if self.pending and self.of.pool is None:
            self._start()
        try:
            while self.of.pool is not None and (self.running or self.suspects or self.pending):
                self._turn()
        except BaseException as error:
            self.of.__exit__(error)
            raise
        while self.pending:
            self._here(self._size(1))

    # -------------------------------------------------------------------------------------------- where

    def _start(self) -> None:
        """Start a pool where it is worth it; what is compiled is compiled here before."""
        of = self.of
        if of.scheduler is not None:
            of.pool = pools.Dask(of.scheduler)
            return
        if of.tasks == 0:
            self._warm_up()
        each = 0.0
        if of.workers is None or len(self.pending) >= _MANY:
            each = of.cost if of.tasks > 1 else self._measured()
        left, workers = len(self.pending), of.workers
        if workers is None:
            workers = pools.cores() if each * left * of.calls > _SMALL else 1
        expected = each * left / max(min(workers, left), 1)
        if expected >= _LONG:
            on = "one core" if workers == 1 else f"{workers} cores"
            of.report(f"{left} cases of about {each:.2g} s each: about {_duration(expected)} on {on}")
        if min(workers, left) < 2:
            return
        workers = min(workers, left) if of.calls == 1 else workers
        if workers <= of.runs.most_threads:
            if of.tasks == 0:  # what all share is found by the first run, and functions are compiled
                self._here()
            of.pool = pools.Threads(workers)
        else:
            of.pool = pools.Processes(workers)

    def _warm_up(self) -> None:
        """Compile here what is not compiled yet, by evaluating one point, before several processes do so at once."""
        solver = self.of.runs.solver(self.points[self.pending[0]])
        if solver and not codecache.is_warm(solver):
            with compiling(self.of.report) if self.of.report is not _silent else contextlib.nullcontext():
                self._here()

    def _measured(self) -> float:
        """Time that a point takes, s, found by computing for a second or two; 0 where nothing is left."""
        if self.pending:
            self._here()  # loads what is loaded once
        began, before, size = time.perf_counter(), self.done, 1
        while self.pending and time.perf_counter() - began < _TASK:
            self._here(min(size, self.of.batch or size))
            size *= 2
        return (time.perf_counter() - began) / max(self.done - before, 1)

    # -------------------------------------------------------------------------------------------- tasks

    def _here(self, size: int = 1) -> None:
        places = self._next(size)
        self._keep(places, compute(self._task(places)))

    def _size(self, workers: int) -> int:
        """Points of the next task: as was asked, or for about a second of work, and less near the end."""
        by_cost = int(_TASK / self.of.cost) if self.of.cost > 0.0 else 1
        share = -(-len(self.pending) // (2 * workers)) if workers > 1 else by_cost
        return self.of.batch or max(1, min(by_cost, share))

    def _next(self, size: int) -> list[int]:
        """Places of the next points."""
        return [self.pending.popleft() for _ in range(min(size, len(self.pending)))]

    def _task(self, places: Sequence[int]) -> EvaluationTask:
        return EvaluationTask(
            runs=self.of.runs, numbers=[self.first + k for k in places], points=[self.points[k] for k in places],
            level=self.level, owner=self.of.name, one_thread=self.of.one_thread,
            sources="" if self.of.scheduler is None else sources.sources(),
        )  # fmt: skip

    def _keep(self, places: Sequence[int], result: EvaluationResult) -> None:
        self.of.keep([self.keys[k] for k in places], result)
        self.done += len(places)
        self.of.progress(self.done, len(self.keys))

    def _turn(self) -> None:
        """Keep the workers busy, and what has ended; points whose process has died are evaluated alone."""
        assert self.of.pool is not None
        if self.has_died and not self.running:
            self.of.pool = self.of.pool.renewed(self.of.report)
            self.has_died = False
        pool, self.is_alone = self.of.pool, self.is_alone and bool(self.running)
        if self.suspects and not self.running:
            self.is_alone = True
            self._give(pool, [self.suspects.popleft()])
        most = 0 if self.is_alone or self.suspects else _AHEAD * pool.workers
        while self.pending and len(self.running) < most and not self.has_died:
            self._give(pool, self._next(self._size(pool.workers)))
        for future in wait(self.running, timeout=0.5, return_when=FIRST_COMPLETED)[0]:
            self._end(future)
        pool.watch(self.of.report)

    def _give(self, pool: pools.Pool, places: Sequence[int]) -> None:
        try:
            self.running[pool.submit(self._task(places))] = places
        except BrokenExecutor:  # a process has died between two tasks; these points are not to blame
            self.has_died = True
            (self.suspects if self.is_alone else self.pending).extendleft(reversed(places))

    def _end(self, future: Future[Any]) -> None:
        """Keep what a task gave, or suspect its points if a process died of it."""
        places = self.running.pop(future)
        if future.cancelled():
            raise EvolventError("the scheduler lost a task; run the sweep again to continue")
        error = future.exception()
        if error is None:
            self._keep(places, future.result())
            return
        if not pools.is_death(error):
            raise error
        self.has_died = True
        for place in places:
            self.deaths[place] += self.is_alone
            if self.deaths[place] < _DEATHS:
                self.suspects.append(place)
                continue
            why = "the process that computed it died, repeatedly"
            rows = record.table([record.Outcome(index=self.first + place, status="failed", reason=why)])
            self._keep([place], EvaluationResult(rows=rows, seconds=self.of.cost))


def _key(point: Point, level: float) -> str:
    """What a point is known by."""
    own = {**point, "level": level} if level else point
    return json.dumps(own, sort_keys=True, default=lambda value: np.asarray(value).tolist())


def _silent(*given: object) -> None:
    """Report nothing."""


def _duration(seconds: float) -> str:
    """A duration in words, two digits."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s"
