"""Conduct a study: hand out its cases, keep what comes back, go on after any end, and label the results."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import xarray as xr

from evolvent import cases
from evolvent.base.console import compiling
from evolvent.base.errors import EvolventError, InputError
from evolvent.design.studies import label, record, tasks, variants
from evolvent.design.studies.store import Store, opened, read
from evolvent.design.studies.study import Study, read as read_study

#: Seconds that an automatic task takes, once the cost of a case is known.
_TASK = 1.0
#: Seconds of work that are left for this process, rather than to start others for them.
_SMALL = 8.0
#: Cases from which their cost is measured before processes are started, whatever their number.
_MANY = 50
#: Expected seconds from which a forecast of the duration is given.
_LONG = 10.0
#: Tasks that wait at every worker.
_AHEAD = 2
#: How often a case may end its process while it runs alone, before it is given up.
_DEATHS = 2

Progress = Callable[[int, int], None]
Report = Callable[[str], None]


def sweep(
    study: str | os.PathLike[str] | Mapping[str, Any] | Study,
    *,
    output: str | os.PathLike[str] | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    report: Report | None = None,
) -> xr.Dataset:
    """Run all cases of a study and return what is kept of them, labelled.

    Parameters
    ----------
    study : str, path, mapping or Study
        Name of a built-in study, a YAML file, or content.
    output : path, optional
        Folder of the study. Finished batches are kept there at once, so that the same call goes on after any end of
        the process; a study that is finished is only read. Without it nothing is left behind.
    workers : int or None
        Processes: 1 computes here, None takes all cores where the work is worth their start. A script that asks for
        several keeps its own work under ``if __name__ == "__main__":``, since they import it. Up to four are threads of
        this process where the cases are variants of one structure, which differ in keys of its parts.
    scheduler : str, optional
        Address of a Dask scheduler (``tcp://host:8786``) whose workers have the same evolvent.
    progress : called with the number of cases done and of all
    report : called with a sentence about what a user should know (a compilation, a worker that died)

    Returns
    -------
    xarray.Dataset
        Over the varied keys of a grid, or over ``case``, with ``status`` and ``reason`` of every case; what a failed
        case lacks is NaN. Its bits do not depend on the number of workers, on batches or on interruptions.

    Raises
    ------
    InputError
        If the study, the folder or the scheduler cannot be used; the message is one sentence.
    KeyboardInterrupt
        On Ctrl-C; what was finished is kept in `output`.

    Examples
    --------
    >>> import evolvent
    >>> study = {"case": "heliogyro", "over": {"spool.rate": [3.0, 3.5]}, "keep": ["body_rate.last"]}
    >>> evolvent.sweep(study).body_rate_last  # doctest: +SKIP
    """
    check_installed()
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
        raise InputError(f"workers is {workers!r}; it must be a whole number from 1, or left out")
    if scheduler is not None and workers not in (None, 1):
        raise InputError("workers and scheduler are both given; a scheduler has its own workers")
    asked = study if isinstance(study, Study) else read_study(study)
    with contextlib.ExitStack() as stack:
        if output is None:
            output = stack.enter_context(tempfile.TemporaryDirectory(prefix="evolvent-study-"))
        store = stack.enter_context(opened(output, asked))
        _Sweep(store, progress, report).run(workers, scheduler)
        if not store.complete:
            store.write(label.dataset(asked, record.join(store.rows)))
        return read(output)


def check_installed() -> None:
    """Refuse a sweep without the packages that it needs.

    Raises
    ------
    InputError
        With the command that installs them.
    """
    import importlib.util

    wanted = ("dask", "distributed", "threadpoolctl", "zarr")
    missing = [name for name in wanted if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"a sweep needs {', '.join(missing)}; install them with: pip install 'evolvent[sweep]'")


class _Sweep:
    """One call of `sweep`."""

    def __init__(self, store: Store, progress: Progress | None, report: Report | None) -> None:
        self.store, self.study = store, store.study
        self._progress = progress or (lambda done, count: None)
        self.report = report or (lambda sentence: None)
        self.pending = deque(store.pending())
        self.cost = 0.0  # s, of a case in the last task
        self._tasks = 0
        self._done = store.done

    def run(self, workers: int | None, scheduler: str | None) -> None:
        """Compute all cases that are pending."""
        if self.store.torn:
            self.report("the log ends in an unfinished record, which is cut off; its cases are computed again")
        self._progress(self._done, self.study.count)
        if not self.pending:
            return
        if scheduler is not None:
            with _scheduler(scheduler) as client:
                self._spread(client)
            return
        self._warm_up()
        each = self._cost_of_a_case() if workers is None or len(self.pending) >= _MANY else 0.0
        if workers is None:
            workers = cores() if each * len(self.pending) > _SMALL else 1
        workers = min(workers, len(self.pending))
        self._forecast(each, workers)
        threads = workers if workers <= variants.MOST_THREADS and tasks.are_variants(self.study) else 1
        if workers > threads:
            with _cluster(workers) as client:
                self._spread(client)
        while self.pending:
            self._here(self.take(1), threads)

    def _spread(self, client: Any) -> None:
        spread = _Spread(self, client)
        with _ctrl_c_noted(spread.pressed):
            spread.run()

    def _here(self, indices: Sequence[int], threads: int = 1) -> None:
        self.keep(tasks.compute(tasks.task(self.study, indices, self.store.folder), threads), len(indices))

    def take(self, workers: int) -> list[int]:
        """The next cases for a task: as the study says, or for about a second of work, and less near the end."""
        size = self.study.batch
        if not size:
            by_cost = int(_TASK / self.cost) if self.cost > 0.0 else 1
            share = -(-len(self.pending) // (2 * workers)) if workers > 1 else by_cost
            size = max(1, min(by_cost, share))
        return [self.pending.popleft() for _ in range(min(size, len(self.pending)))]

    def keep(self, result: tasks.Result, count: int) -> None:
        """Keep a finished task."""
        if result.refused and self._tasks == 0:
            raise InputError(result.refused)
        for sentence in result.notes:
            self.report(sentence)
        self.store.append(result.content)
        self._tasks += 1
        self._done += count
        self.cost = result.seconds / count
        self._progress(self._done, self.study.count)

    def _warm_up(self) -> None:
        """Compile here what is not compiled yet, by running one case, before several processes do so at once."""
        try:
            first = cases.load(self.study.content, self.study.overrides(self.pending[0]))
            module = cases.system(first.system)
            solver = module.plan(first).solver
        except InputError:
            return
        if not solver:
            return
        from evolvent.compiled import codecache

        if not codecache.is_warm(solver):
            with compiling(self.report):
                self._here([self.pending.popleft()])

    def _cost_of_a_case(self) -> float:
        """Time that a case takes, s, found by computing for a second or two; 0 where nothing is left."""
        if self.pending:
            self._here([self.pending.popleft()])  # loads what is loaded once
        began, before = time.perf_counter(), self._done
        while self.pending and time.perf_counter() - began < _TASK:
            self._here([self.pending.popleft()])
        return (time.perf_counter() - began) / max(self._done - before, 1)

    def _forecast(self, each: float, workers: int) -> None:
        """Report how long the cases that are left will take, where that is long."""
        left = len(self.pending)
        expected = each * left / max(workers, 1)
        if expected < _LONG:
            return
        on = "one core" if workers == 1 else f"{workers} cores"
        self.report(f"{left} cases of about {each:.2g} s each: about {_duration(expected)} on {on}")


def _duration(seconds: float) -> str:
    """A duration in words, two digits."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s"


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


# ------------------------------------------------------------------------------------------------ Dask


class _Spread:
    """A sweep on the workers of a Dask client."""

    def __init__(self, sweep: _Sweep, client: Any) -> None:
        self.sweep, self.client = sweep, client
        self.running: dict[Any, list[int]] = {}
        self.ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.suspects: deque[int] = deque()
        self.alone = -1
        self.deaths: dict[int, int] = {}
        self.workers = set(client.nthreads())
        self.looked = time.monotonic()
        self.pressed = threading.Event()

    def run(self) -> None:
        """Compute all that is pending."""
        try:
            while True:
                if self.pressed.is_set():
                    raise KeyboardInterrupt
                self._submit()
                if not self.running:
                    self._look(at_once=True)
                    return
                with contextlib.suppress(queue.Empty):
                    self._end(self.ended.get(timeout=0.5))
                self._look()
        finally:
            if self.running:
                with contextlib.suppress(Exception):
                    self.client.cancel(list(self.running), force=True)

    def _submit(self) -> None:
        """Keep the workers busy; cases whose process died run alone, so that others are not blamed."""
        self.alone = -1 if not self.running else self.alone
        workers = max(len(self.workers), 1)
        while len(self.running) < _AHEAD * workers and self.sweep.pending and not self.suspects and self.alone < 0:
            self._start(self.sweep.take(workers))
        if self.suspects and not self.running:
            self.alone = self.suspects.popleft()
            self._start([self.alone])

    def _start(self, indices: list[int]) -> None:
        future = self.client.submit(
            tasks.compute, tasks.task(self.sweep.study, indices, self.sweep.store.folder), pure=False, retries=0
        )
        self.running[future] = indices
        future.add_done_callback(self.ended.put)

    def _end(self, future: Any) -> None:
        """Keep what a task gave, or suspect its cases if a process died of it."""
        from distributed.scheduler import KilledWorker

        indices = self.running.pop(future)
        if future.status == "finished":
            self.sweep.keep(future.result(), len(indices))
            return
        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            for index in indices:
                self._suspect(index)
        elif error is None:
            raise EvolventError("the scheduler lost a task; run the sweep again to continue")
        else:
            raise error

    def _suspect(self, index: int) -> None:
        """Compute a case again, or give it up."""
        self.deaths[index] = self.deaths.get(index, 0) + (index == self.alone)
        if self.deaths[index] < _DEATHS:
            self.suspects.append(index)
            return
        outcome = record.Outcome(index=index, status="failed", reason="the process that computed it died, repeatedly")
        content = record.encode(record.table([outcome]))
        self.sweep.keep(tasks.Result(content=content, seconds=self.sweep.cost, refused=""), 1)

    def _look(self, *, at_once: bool = False) -> None:
        """Report of workers that are gone, looking every second."""
        if time.monotonic() - self.looked < 1.0 and not at_once:
            return
        self.looked = time.monotonic()
        if self.client.status not in ("running", "connecting"):
            raise EvolventError("the scheduler has stopped; run the sweep again to continue")
        try:
            now = set(self.client.nthreads())
        except (OSError, TimeoutError):
            return
        for _ in self.workers - now:
            self.sweep.report(f"a worker stopped; its cases are given to others ({len(now)} left)")
        if self.workers and not now:
            self.sweep.report("no worker is left; waiting for one")
        self.workers = now


@contextlib.contextmanager
def _cluster(workers: int) -> Iterator[Any]:
    """A client of a cluster of processes on this machine, one thread each, that ends with this process."""
    import dask
    from distributed import Client, LocalCluster

    quiet: dict[str, Any] = {"distributed.scheduler.allowed-failures": 0, "distributed.admin.tick.limit": "1h"}
    with dask.config.set(quiet), contextlib.ExitStack() as stack:
        scratch = stack.enter_context(
            tempfile.TemporaryDirectory(prefix="evolvent-workers-", ignore_cleanup_errors=True)
        )
        with _ctrl_c_held():  # workers must not take it; only this process does
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    silence_logs="CRITICAL",
                    local_directory=scratch,
                )
            )
            client = stack.enter_context(Client(cluster))
        yield client


@contextlib.contextmanager
def _scheduler(address: str) -> Iterator[Any]:
    """A client of a scheduler that runs already."""
    from distributed import Client

    try:
        client = Client(address, timeout="10s")
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"cannot reach a Dask scheduler at {address!r} ({' '.join(str(error).split())}); "
            f"give its address, such as tcp://127.0.0.1:8786"
        ) from None
    with client:
        if not client.nthreads():
            raise InputError(f"the scheduler at {address!r} has no workers; start one with: dask worker {address}")
        yield client


@contextlib.contextmanager
def _ctrl_c_noted(pressed: threading.Event) -> Iterator[None]:
    """Have the first Ctrl-C set an event: raised inside a finalizer of a library, it would be lost."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: Any) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Keep Ctrl-C back meanwhile, and for good from threads and processes that start now."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # its start would let Ctrl-C through to the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
