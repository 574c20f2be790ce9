"""Copies of a prepared run in one block of memory each, which compiled code steps on several threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numba import config

from evolvent.assembly import needs
from evolvent.compiled.pointer import Struct
from evolvent.model.memory import Memory
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.time.pace import Pace
from evolvent_base.errors import InputError

Array = np.ndarray
#: Steps that a copy takes before Python looks at it again, and copies of one call of compiled code, at most.
STEPS, TOGETHER = 2000, 64
#: Parts, for each thread, in which copies are distributed; and time, s, up to which one thread steps more at once.
PARTS, PART_TIME = 4, 0.3
#: States of a copy.
GOES_ON, STOPPED_BY_EVENT, HAS_FAILED = 0, 1, 2


class Copies:
    """Copies of a run that has not begun, each in its block of memory.

    Parameters
    ----------
    run : MotionRun, prepared; its own memory is that of none of the copies
    count : int, of copies
    workers : int, threads that step them beside one another
    structs : mapping, name -> struct of the run, in the order in which compiled code takes their addresses
    later : names of arrays of the workspace that are written before they are read

    Attributes
    ----------
    memory : Memory, of the structs
    blocks : (count, size) uint8
    round_offs : energies (J), as of `Solution`, that replace those of single copies (`of`); None if each copy uses
        its own
    check : called from time to time with the time that a copy has reached; what it raises ends the call
    side_by_side : int, copies that had better be stepped by one thread
    status : (count,) int, `GOES_ON`, `STOPPED_BY_EVENT` or `HAS_FAILED`; reasons : mapping, of those that have failed
    """

    check: Callable[[float], None] | None
    side_by_side = 1
    round_offs: tuple[float, float] | None = None

    def __init__(
        self, run: Any, count: int, workers: int, structs: Mapping[str, Struct], later: Collection[str]
    ) -> None:  # fmt: skip
        self.run, self.count, self.workers, self.check = run, count, workers, None
        self.memory = Memory(structs, {("work", name) for name in later})
        self.blocks = self.memory.room(count)
        self._at_once = 1
        self.status, self.reasons = np.zeros(count, dtype=np.int64), dict[int, str]()
        self._codes = np.zeros(count, dtype=np.int64)
        self._runs: dict[int, Any] = {}
        self._views: dict[int, dict[str, Any]] = {}
        self._pace: dict[int, Pace] = {}
        self._room = threading.local()
        self._pool: ThreadPoolExecutor | None = None
        self._apart: tuple[Array, list[Any]] | None = None
        self._ends = threading.Event()
        self._structs: dict[str, Any] = {name: [None] * count for name in structs}
        if not config.DISABLE_JIT:
            self._structs = {name: self.memory.addresses(self.blocks, name) for name in structs}
        self.loop = self.memory.values(self.blocks, "work", "loop")
        self.samples = self.memory.values(self.blocks, "work", "samples")

    def values(self, *path: str) -> Array | None:
        """An array of all copies; None of one without entries."""
        return self.memory.values(self.blocks, *path) if path in self.memory.places else None

    # ------------------------------------------------------------------------------------------------ solver

    def models_apart(
        self, which: Array, write: Callable[[Array, Array, Array], None]
    ) -> Iterator[tuple[Array, Array, Sequence[Any]]]:  # fmt: skip
        """Models of copies as they are at the start, in blocks beside those of the copies, some at a time.

        Parameters
        ----------
        which, write : as of `keep_plan`

        Yields
        ------
        some : (m,) int, copies
        blocks : of which they have the first; models : views of theirs, which may be written to
        """
        size = min(TOGETHER, which.size)
        if self._apart is None or len(self._apart[0]) < size:
            blocks = self.memory.room(size)
            views = [self.memory.views(block)["model"] for block in blocks]
            for view in views:
                needs.note_alike(self.run.model, view)
            self._apart = blocks, views
        blocks, views = self._apart
        for first in range(0, which.size, len(blocks)):
            some = which[first : first + len(blocks)]
            at = np.arange(some.size)
            self.memory.fill(blocks, at)
            write(blocks, at, some)
            yield some, blocks, views[: some.size]

    def keep_plan(self, which: Array, write: Callable[[Array, Array, Array], None]) -> Array:
        """Whether copies with what is their own surely have the plan of the run, (k,) bool; none where that is unknown.

        Parameters
        ----------
        which : (k,) int
        write : writes into blocks, those numbered by a second argument, what the copies of a third one have
        """
        return np.zeros(which.size, dtype=bool)

    def sampled(self, which: Array, model: Any) -> dict[str, Any]:
        """States of copies at the start and now, in turn: `y`, `s` and `kept` of a solution of 2 k samples."""
        raise NotImplementedError

    def kept_samples(self, which: Array, at: Array, model: Any, *, without: Collection[str] = ()) -> dict[str, Any]:
        """Stored samples of copies, one copy after the other: `y`, `s` and `kept` of a solution of k m samples.

        Parameters
        ----------
        which : (k,) int, numbers of the copies
        at : (k, m) int, numbers of their samples
        without : fields of `kept` that are None
        """
        raise NotImplementedError

    def closes(self, which: Array) -> Array:
        """Whether copies have finished, stored all samples, and closed their energy balance even without round-off.

        Returns
        -------
        (k,) bool; False if this is not known
        """
        raise NotImplementedError

    def events(self, k: int) -> tuple[Array, Array]:
        """Times of the events of a copy, s, and their numbers among all of the model."""
        raise NotImplementedError

    def _begin(self, which: Array) -> None:
        """Start copies whose blocks have been written."""
        raise NotImplementedError

    def _go_on(self, which: Array, ends: Array, changed: Array) -> Array:
        """Prepare copies to go on to times; returns whose loads have jumped, (k,) bool. Arguments as of `go_to`."""
        raise NotImplementedError

    def _restart(self, which: Array) -> None:
        """Start copies again where loads or joints change at once."""
        raise NotImplementedError

    def _take_steps(self, which: Array) -> None:
        """Take up to `STEPS` steps of copies, with status codes to `_codes`."""
        raise NotImplementedError

    def _ended(self, which: Array) -> Array:
        """What copies do after a call of compiled code; returns those that go on."""
        raise NotImplementedError

    def _run_of(self, views: dict[str, Any], number: int) -> Any:
        """The run of a copy, of views of its block."""
        raise NotImplementedError

    # ------------------------------------------------------------------------------------------------ start

    def place(self, which: Array, write: Callable[[Array], None]) -> None:
        """Put copies at the start of the run.

        Parameters
        ----------
        which : (k,) int
        write : writes what is their own, given `which`, into their blocks
        """
        self.status[which] = GOES_ON
        for k in which.tolist():
            self.reasons.pop(k, None)
            self._runs.pop(k, None)
            self._pace.pop(k, None)

        def start(part: Array) -> None:
            self.memory.fill(self.blocks, part)
            write(part)
            for k in part.tolist() if config.DISABLE_JIT else ():
                views = self.memory.views(self.blocks[k])
                for name, structs in self._structs.items():
                    structs[k] = views[name]
            self._begin(part)

        self._each(which, start)

    def _parts(self, which: Array) -> Sequence[Array]:
        """Copies that one call of compiled code takes: single ones where users' laws may raise."""
        if self.run.assembly.laws or self.run.assembly.expressions or config.DISABLE_JIT:
            return [which[k : k + 1] for k in range(which.size)]
        return [which] if which.size else []

    def _guarded(self, k: int, act: Callable[[Any], str]) -> bool:
        """Act on the run of a copy; returns whether it goes on."""
        try:
            failure = act(self.of(k))
        except InputError as error:
            failure = str(error)
        except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
            failure = self._failure_of(k, error)
        if failure:
            self._fail(k, failure)
        return not failure

    def _failure_of(self, k: int, error: Exception) -> str:
        """What a user's law has raised in a copy."""
        own = self.of(k)
        return law_failure(own.assembly, error, own.moments())

    def _fail(self, k: int, why: str) -> None:
        self.status[k], self.reasons[k] = HAS_FAILED, why

    def of(self, k: int) -> Any:
        """The run of a copy, whose structs share the memory of its block."""
        if k not in self._runs:
            if k not in self._views:
                self._views[k] = self.memory.views(self.blocks[k])
            self._runs[k] = self._run_of(self._views[k], k)
        return self._runs[k]

    # ------------------------------------------------------------------------------------------------ time

    @property
    def time(self) -> Array:
        """(count,) float, s, times reached."""
        return np.asarray(self.loop["time"])

    def go_to(
        self, which: Array, ends: Array, changed: Array, progress: Callable[[int, int], None] | None = None
    ) -> None:
        """Go on with copies to times; those that have failed or stopped stay where they are.

        Parameters
        ----------
        which : (k,) int; ends : (k,) float, s, after the times reached
        changed : (k,) bool, whose loads have jumped
        """
        moves = (self.status[which] == GOES_ON) & (ends > self.time[which])
        which, ends, changed = which[moves], ends[moves], changed[moves]
        self.samples[which, 0], self.samples[which, 1] = self.time[which], ends
        jumps = np.zeros(self.count, dtype=bool)
        jumps[which] = self._go_on(which, ends, changed)
        self._each(which, lambda part: self._advance(part, jumps), progress)

    def run_to_end(self, which: Array) -> None:
        """Go on with copies that stand at their start to the last sample."""
        self._each(which[self.status[which] == GOES_ON], lambda part: self._advance(part, np.zeros(self.count, bool)))

    def _advance(self, which: Array, jumps: Array) -> None:
        """Go on with copies to their last samples."""
        jumped = which[jumps[which]]
        if jumped.size:
            self._restart(jumped)
        which = which[self.status[which] == GOES_ON]
        while which.size and not self._ends.is_set():
            left = list[Array]()
            for part in self._parts(which):
                try:
                    self._take_steps(part)
                except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                    self._fail(int(part[0]), self._failure_of(int(part[0]), error))
                    continue
                left.append(self._ended(part))
                if self.check is not None:
                    self.check(float(self.time[part[0]]))
            which = np.concatenate([*left, np.zeros(0, dtype=np.int64)])

    def _look(self, k: int) -> None:
        """End a copy whose steps become ever smaller."""
        row = self.loop[k]
        pace = self._pace.setdefault(k, Pace(float(row["time"])))
        end = float(self.samples[k, -1])
        stall = pace.stall(float(row["time"]), int(row["steps"]), end, fixed=self.run.plan.step)
        if stall is not None:
            self._fail(k, self.of(k).stall_message(stall))

    # ------------------------------------------------------------------------------------------------ threads

    def _each(
        self, which: Array, act: Callable[[Array], None], progress: Callable[[int, int], None] | None = None
    ) -> None:
        """Act on copies, on all threads; `progress` is called with the number of those that are done and of all."""
        if not which.size:
            return
        if self.workers == 1:
            done, least = 0, -(-which.size // PARTS)
            while done < which.size:
                part = which[done : done + self._rounded_up(min(TOGETHER, max(least, self._at_once)))]
                began = time.perf_counter()
                act(part)
                seconds = (time.perf_counter() - began) / part.size
                self._at_once = max(1, min(TOGETHER, int(PART_TIME / max(seconds, 1e-9))))
                done += part.size
                if progress is not None:
                    progress(done, which.size)
            return
        size = self._rounded_up(min(TOGETHER, -(-which.size // (PARTS * self.workers))))
        parts = [which[k : k + size] for k in range(0, which.size, size)]
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.workers, thread_name_prefix="evolvent-batch")
        self._ends.clear()
        left, done = {self._pool.submit(act, part): part.size for part in parts}, 0
        try:
            while left:
                for future in wait(left, return_when=FIRST_COMPLETED).done:
                    done += left.pop(future)
                    future.result()
                if progress is not None:
                    progress(done, which.size)
        except BaseException:
            self._ends.set()
            for future in left:
                future.cancel()
            wait(left)
            self._ends.clear()
            raise

    def _rounded_up(self, size: int) -> int:
        """A number of copies, rounded up to a multiple of those that are stepped side by side."""
        return -(-size // self.side_by_side) * self.side_by_side

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
        self._pool = None
