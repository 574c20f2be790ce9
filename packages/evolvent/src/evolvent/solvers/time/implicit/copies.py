"""Copies of a prepared implicit run in one block of memory each, which compiled code steps on several threads."""

from __future__ import annotations

import copy
import dataclasses
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numba import config

from evolvent.algebra.sparse import SparseBlocks
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.model import Model
from evolvent.model.memory import Memory
from evolvent.solvers.common import redundancy
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.common.start import acts_from_outside
from evolvent.solvers.time.implicit.captures import Captures
from evolvent.solvers.time.implicit.many_steps import advance_many, begin_many, count_open, restart_many
from evolvent.solvers.time.implicit.messages import reason
from evolvent.solvers.time.implicit.methods import METHODS
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.workspace import AT_RESTART, BUDGET, DONE, SAMPLED, STOPPED, Workspace
from evolvent.solvers.time.pace import Pace
from evolvent_base.errors import InputError

Array = np.ndarray
#: Steps that a copy takes before Python looks at it again, and copies of one call of compiled code, at most.
STEPS, TOGETHER = 2000, 64
#: Parts, for each thread, in which copies are handed out.
PARTS = 4
#: Structs of a copy, in the order in which compiled code takes their addresses.
STRUCTS = ("model", "matrix", "work")
#: States of a copy.
GOES_ON, STOPPED_BY_EVENT, HAS_FAILED = 0, 1, 2


class Copies:
    """Copies of a run that has not begun, each in its block of memory.

    Parameters
    ----------
    run : ImplicitRun, prepared; its own memory is that of none of the copies
    count : int, of copies
    workers : int, threads that step them beside one another

    Attributes
    ----------
    memory : Memory, of the model, the matrix and the workspace
    blocks : (count, size) uint8
    check : called from time to time with the time that a copy has reached; what it raises ends the call
    status : (count,) int, `GOES_ON`, `STOPPED_BY_EVENT` or `HAS_FAILED`; reasons : mapping, of those that have failed
    ranks_apart : bool, whether Python finds ranks of constraints, copy by copy: where they have been redundant
    """

    check: Callable[[float], None] | None

    def __init__(self, run: ImplicitRun, count: int, workers: int) -> None:
        self.run, self.count, self.workers = run, count, workers
        self.midpoint, self.check = run.midpoint, None
        later = {("work", name) for name in SAMPLED}
        self.memory = Memory({"model": run.model, "matrix": run.matrix, "work": run.work}, later)
        self.blocks = self.memory.room(count)
        self.status, self.reasons = np.zeros(count, dtype=np.int64), dict[int, str]()
        self._codes = np.zeros(count, dtype=np.int64)
        self._runs: dict[int, ImplicitRun] = {}
        self._views: dict[int, dict[str, Any]] = {}
        self._pace: dict[int, Pace] = {}
        self._room = threading.local()
        self._pool: ThreadPoolExecutor | None = None
        self._ends = threading.Event()
        others = frozenset().union(*(row.modules for row in METHODS.values())) - METHODS[run.plan.method].modules
        roots: list[Any] = [begin_many, advance_many]
        roots += [count_open] if run.model.constraints.size else []
        roots += [] if self.midpoint else [restart_many]
        needs.load(run.model, *roots, without=others)
        self._structs: list[Any] = [[None] * count for _ in STRUCTS]
        if not config.DISABLE_JIT:
            self._structs = [self.memory.addresses(self.blocks, name) for name in STRUCTS]
        self.loop = self.memory.values(self.blocks, "work", "loop")
        self.samples = self.memory.values(self.blocks, "work", "samples")
        self.stops = self._values("work", "stops")
        self.rows = self._values("model", "constraints")
        ranks = run.ranks.found
        self.ranks_apart = bool(config.DISABLE_JIT or any(one.redundancy is not None for one in ranks))
        self._ranked = np.repeat(ranks[0].held[None], count, axis=0) if ranks else np.zeros((count, 0), dtype=bool)
        self._ranked_latches = np.zeros(count, dtype=np.int64)

    def _values(self, *path: str) -> Array | None:
        """An array of all copies; None of one without entries."""
        return self.memory.values(self.blocks, *path) if path in self.memory.places else None

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
            if self.run.ranks.found:
                self._ranked[part], self._ranked_latches[part] = self.run.ranks.found[0].held, 0
            for k in part.tolist() if config.DISABLE_JIT else ():
                views = self.memory.views(self.blocks[k])
                for structs, name in zip(self._structs, STRUCTS, strict=True):
                    structs[k] = views[name]
            self._begin(part)

        self._each(which, start)

    def _begin(self, which: Array) -> None:
        """Start the loops of copies."""
        first = self.run.ranks.found
        if first and first[0].redundancy is not None:  # whose compliance follows from the masses
            for k in which.tolist():
                self._guarded(k, lambda one: one.begin_anew())
            return
        for part in self._parts(which):
            try:
                begin_many(part, *self._structs, self._codes)
            except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                self._fail(int(part[0]), self._failure_of(int(part[0]), error))
                continue
            for k in part[self._codes[part] != DONE].tolist():
                self._guarded(k, lambda one: reason(int(self._codes[one.number]), one))

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
            self._runs[k] = _run_of(self.run, self._views[k], k)
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
        self.loop["sample"][which] = 1
        jumps = np.zeros(self.count, dtype=bool)
        jumps[which] = changed | self._pass_stops(which)
        self._each(which, lambda part: self._advance(part, jumps), progress)

    def run_to_end(self, which: Array) -> None:
        """Go on with copies that stand at their start to the last sample."""
        self._each(which[self.status[which] == GOES_ON], lambda part: self._advance(part, np.zeros(self.count, bool)))

    def _pass_stops(self, which: Array) -> Array:
        """Pass stops at the ends of the steps before; returns at which copies there was one, (k,) bool."""
        found = np.zeros(which.size, dtype=bool)
        if self.stops is None:
            return found
        near = 10.0 * float(self.run.plan.options.smallest)
        while True:
            at = self.loop["stop"][which]
            left = at < self.stops.shape[1]
            next_one = self.stops[which, np.minimum(at, self.stops.shape[1] - 1)]
            passed = left & (next_one <= self.time[which] + near)
            if not passed.any():
                return found
            self.loop["stop"][which[passed]] += 1
            found |= passed

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
                    advance_many(part, *self._structs, self._codes, STEPS)
                except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                    self._fail(int(part[0]), self._failure_of(int(part[0]), error))
                    continue
                left.append(self._ended(part))
                if self.check is not None:
                    self.check(float(self.time[part[0]]))
            which = np.concatenate([*left, np.zeros(0, dtype=np.int64)])

    def _ended(self, which: Array) -> Array:
        """What copies do after a call of compiled code; returns those that go on."""
        codes = self._codes[which]
        self.status[which[codes == STOPPED]] = STOPPED_BY_EVENT
        for k in which[codes < 0].tolist():
            self._guarded(k, lambda one: reason(int(self._codes[one.number]), one))
        restarts = which[codes == AT_RESTART]
        if restarts.size:
            self._restart(restarts)
        for k in which[codes == BUDGET].tolist():
            self._look(k)
        goes_on = (codes == AT_RESTART) | (codes == BUDGET)
        if (ranked := self.run.ranks.now) is not None:
            for k in which[codes >= 0].tolist():
                self._guarded(k, lambda one: (one.ranks.now or ranked).contradiction(one.gaps(), one.reached))
        return which[goes_on & (self.status[which] == GOES_ON)]

    def _look(self, k: int) -> None:
        """End a copy whose steps become ever smaller."""
        row = self.loop[k]
        pace = self._pace.setdefault(k, Pace(float(row["time"])))
        end = float(self.samples[k, -1])
        stall = pace.stall(float(row["time"]), int(row["steps"]), end, fixed=self.run.plan.step)
        if stall is not None:
            self._fail(k, self.of(k).stall_message(stall))

    def _restart(self, which: Array) -> None:
        """Start copies again where loads or joints change at once."""
        smallest = 20.0 * float(self.run.plan.options.smallest)
        after = np.zeros(self.count)
        after[which] = self.time[which] + np.maximum(1e-9 * self.loop["last"][which], smallest)
        due = which[self._is_due(which, after[which])]
        if due.size:
            self._find_ranks(due, after)
        which = which[self.status[which] == GOES_ON]
        if self.midpoint:
            for k in which.tolist():
                self._hold(k, float(after[k]))
            return
        for part in self._parts(which):
            try:
                restart_many(part, after, *self._structs, self._codes)
            except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                self._fail(int(part[0]), self._failure_of(int(part[0]), error))
                continue
            for k in part[self._codes[part] != DONE].tolist():
                self._guarded(k, lambda one: reason(int(self._codes[one.number]), one))

    def _hold(self, k: int, after: float) -> None:
        """Note whether something acts on a copy of energy-momentum from outside."""
        one = self.of(k)
        one.work.step.step.held = float(one.plan.options.chi > 0.0 and acts_from_outside(one.model, after))

    def _held(self, which: Array, times: Array) -> Array:
        """Rows that are constraints and hold at times (k,), s: (k, nj) bool (`redundancy.is_held`)."""
        assert self.rows is not None
        stiffness, until = self.rows["stiffness"][which], self.rows["until"][which]
        return np.asarray((stiffness == 0.0) & (times[:, None] <= until))

    def _is_due(self, which: Array, after: Array) -> Array:
        """Whether the rank of the constraints of copies may have changed (`redundancy.Ranks.is_due`), (k,) bool."""
        if self.rows is None:
            return np.zeros(which.size, dtype=bool)
        due = self._ranked_latches[which] != self.loop["latches"][which]
        if not due.all():
            own = self.rows["alone"][which] == 0
            due |= np.any((self._ranked[which] != self._held(which, after)) & own, axis=1)
        return np.asarray(due)

    def _find_ranks(self, which: Array, after: Array) -> None:
        """Find the ranks of the constraints of copies just after the times reached, (count,) float, s.

        Where they are not redundant compiled code finds that.
        """
        held = self._held(which, after[which])
        apart = which[:0] if self.ranks_apart else which[np.any(held, axis=1)]
        self._codes[which] = -1 if self.ranks_apart else 0
        if apart.size:
            room = self._rank_room()
            count_open(apart, after, *self._structs, *room, self._codes)
        for k in which[self._codes[which] != 0].tolist():
            self._guarded(k, self._find_rank)
        self._ranked[which], self._ranked_latches[which] = held, self.loop["latches"][which]

    def _rank_room(self) -> tuple[Any, ...]:
        """What `count_open` takes of this thread: what moves to a model that is evaluated, the model, and scratch."""
        if not hasattr(self._room, "found"):
            model, n_v = self.run.model.copy(), int(self.run.model.info.nv)
            needs.note_alike(self.run.model, model)
            first = self.memory.views(self.blocks[0])["model"]
            moves = np.array(model.moves(first), dtype=np.int64).reshape(-1, 3)
            assert not np.any(moves[:, 2] % 8)
            moves[:, 2] //= 8
            n_j = self.run.model.constraints.size
            self._room.found = moves, first.address, model, np.zeros(n_j), np.zeros(n_v), np.zeros(n_v + n_j)
        found: tuple[Any, ...] = self._room.found
        return found

    def _find_rank(self, one: Any) -> str:
        """Find the rank of the constraints of a copy, with the room of this thread."""
        one.ranks._apart = getattr(self._room, "model", None)
        try:
            return str(one.find_rank(one.after, one.work.y))
        finally:
            self._room.model, one.ranks._apart = one.ranks._apart, None

    # ------------------------------------------------------------------------------------------------ threads

    def _each(
        self, which: Array, act: Callable[[Array], None], progress: Callable[[int, int], None] | None = None
    ) -> None:
        """Act on copies, on all threads; `progress` is called with the number of those that are done and of all."""
        if not which.size:
            return
        size = max(1, min(TOGETHER, -(-which.size // (PARTS * self.workers))))
        parts = [which[k : k + size] for k in range(0, which.size, size)]
        if self.workers == 1 or len(parts) == 1:
            for n, part in enumerate(parts, 1):
                act(part)
                if progress is not None:
                    progress(min(n * size, which.size), which.size)
            return
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

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
        self._pool = None


class _CopiedRun(ImplicitRun):
    """The run of a copy: see `ImplicitRun`.

    Attributes
    ----------
    number : int, of the copy
    """

    number: int

    def begin_anew(self) -> str:
        """Find the rank of the constraints and start the loop; returns why that failed, '' where it did not."""
        self.ranks.found = []
        return self.begin()


def _run_of(run: ImplicitRun, views: dict[str, Any], number: int) -> _CopiedRun:
    """The run of a copy, of views of its block; it has begun where `run` has not."""
    found = object.__new__(_CopiedRun)
    found.__dict__.update(run.__dict__)
    model: Model = views["model"]
    matrix: SparseBlocks = views["matrix"]
    work: Workspace = views["work"]
    needs.note_alike(run.model, model)
    assembly: Assembly = dataclasses.replace(run.assembly, model=model)
    found.number, found.assembly, found.model, found.matrix, found.work = number, assembly, model, matrix, work
    found.plan = dataclasses.replace(
        run.plan, assembly=assembly, matrix=matrix, weight=work.weight, options=work.options
    )
    found.__dict__["evaluates_reactions"] = run.evaluates_reactions  # found once
    found.captures, found.ranks = Captures(), redundancy.Ranks(assembly)
    found.ranks.found = copy.copy(run.ranks.found)
    return found


def prepared(run: ImplicitRun) -> ImplicitRun:
    """A run of which copies are made, with the rank of its constraints at the start.

    Raises
    ------
    InputError
        Where copies cannot be stepped by compiled code alone.
    """
    what = "; simulate variants of it by evolvent.simulate_many"
    if run.releases:
        raise InputError(f"a batch cannot have threads that are paid out or taken up node by node{what}")
    if run.has_layers:
        raise InputError(f"a batch cannot have layers that come to lie on one another{what}")
    run.find_rank(run.reached, run.work.y)
    return run
