"""Where tasks are evaluated beside one another: threads, processes of this machine, workers of a Dask scheduler."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import resource_tracker
from typing import Any

from evolvent.design.evaluator.task import EvaluationTask, compute
from evolvent_base.cores import cores as cores
from evolvent_base.errors import EvolventError, InputError

#: Seconds between looks for workers that are gone.
_EVERY = 1.0

Report = Callable[[str], None]


def is_death(error: BaseException) -> bool:
    """Whether an error of a task says that the process that had it has died."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"  # of Dask


class Pool:
    """An executor of tasks.

    Attributes
    ----------
    executor : concurrent.futures.Executor
    workers : int, tasks that it evaluates beside one another
    """

    executor: Executor
    workers: int

    def submit(self, task: EvaluationTask) -> Future[Any]:
        """Give it a task."""
        return self.executor.submit(compute, task)

    def watch(self, report: Report) -> None:
        """Report of workers that are gone; called from time to time."""

    def renewed(self, report: Report) -> Pool:
        """What goes on where a process has died, with which all tasks are lost."""
        return self

    def interrupt(self) -> None:
        """End the tasks that it has."""

    def close(self, *, at_once: bool = False) -> None:
        """End it; at once, with all tasks that it has."""
        if at_once:
            self.interrupt()
        self.executor.shutdown(wait=True, cancel_futures=at_once)


class Threads(Pool):
    """Threads of this process, for variants of one structure: compiled time loops let the others run."""

    def __init__(self, workers: int) -> None:
        self.workers, self._ends = workers, threading.Event()
        self.executor = ThreadPoolExecutor(workers, thread_name_prefix="evolvent-variant")

    def submit(self, task: EvaluationTask) -> Future[Any]:
        """Give it a task."""
        return self.executor.submit(compute, task, self._check)

    def _check(self, _: float) -> None:
        if self._ends.is_set():
            raise KeyboardInterrupt

    def interrupt(self) -> None:
        """End the tasks that it has."""
        self._ends.set()


class Processes(Pool):
    """Processes of this machine, which end with this one."""

    executor: ProcessPoolExecutor

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self.executor = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin)

    def submit(self, task: EvaluationTask) -> Future[Any]:
        """Give it a task, for which it may start a process."""
        with _ctrl_c_held():  # workers must not take it; only this process does
            return super().submit(task)

    def renewed(self, report: Report) -> Pool:
        """New processes in the place of these."""
        report("a worker stopped; its cases are given to others")
        self.close(at_once=True)
        return Processes(self.workers)

    def interrupt(self) -> None:
        """End the tasks that it has."""
        for process in list((self.executor._processes or {}).values()):  # Python has no other way before 3.14
            process.terminate()


def _begin() -> None:
    """Leave Ctrl-C to the process that has started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def end() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end, daemon=True).start()


@contextlib.contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Keep Ctrl-C back meanwhile, and for good from threads and processes that start now."""
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # its start would let Ctrl-C through to the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Dask(Pool):
    """Workers of a Dask scheduler.

    Raises
    ------
    InputError
        If there is no scheduler at the address, or it has no workers.
    """

    def __init__(self, address: str) -> None:
        from distributed import Client  # an extra

        try:
            self._client = Client(address, timeout="10s")
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(
                f"cannot reach a Dask scheduler at {address!r} ({' '.join(str(error).split())}); "
                f"give its address, such as tcp://127.0.0.1:8786"
            ) from None
        self.executor, self.workers = self._client.get_executor(pure=False, retries=0), len(self._client.nthreads())
        self._looked = time.monotonic()
        if not self.workers:
            self.close(at_once=True)
            raise InputError(f"the scheduler at {address!r} has no workers; start one with: dask worker {address}")

    def watch(self, report: Report) -> None:
        """Report of workers that are gone; called from time to time."""
        if time.monotonic() - self._looked < _EVERY:
            return
        self._looked = time.monotonic()
        if self._client.status not in ("running", "connecting"):
            raise EvolventError("the scheduler has stopped; run the sweep again to continue")
        with contextlib.suppress(OSError, TimeoutError):
            now = len(self._client.nthreads())
            if now < self.workers:
                report(f"a worker stopped; its cases are given to others ({now} left)")
            self.workers = max(now, 1)

    def close(self, *, at_once: bool = False) -> None:
        """End it; at once, with all tasks that it has."""
        with contextlib.suppress(Exception):
            self.executor.shutdown(wait=not at_once)
        self._client.close()
