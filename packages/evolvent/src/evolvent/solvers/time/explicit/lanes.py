"""Explicit runs of fixed steps side by side: copies of one model in the lanes of vector instructions.

The loop is `loop.advance` itself, compiled for lanes (`compiled.lanes`). Copies go side by side for some steps at a
time. Where a branch or an event would part them, those steps are taken back; they go side by side up to that step, take
it alone, and come back. Copies whose integers differ, as of a latch that one has locked, form lanes of their own. So
every copy gets the bits that it gets alone.

Whether copies go side by side follows from times that are measured: of a step of a copy alone and in lanes, and of what
is left to do beside the compilation of functions that were never compiled for lanes.
"""

from __future__ import annotations

import contextlib
import threading
import time as clock
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numba import config, types
from numba.core.errors import NumbaError

from evolvent.assembly import needs
from evolvent.compiled.jit import Attempt, count_missing, indirect, load
from evolvent.compiled.lane_types import WIDTH, lane_zeros
from evolvent.compiled.lanes import PARTED, lane_type
from evolvent.compiled.pointer import address
from evolvent.model import MODEL
from evolvent.model.lanes import LaneCopies
from evolvent.model.registry import TABLES, asked
from evolvent.solvers.time.copies import GOES_ON
from evolvent.solvers.time.explicit import events as ex, loop as explicit
from evolvent.solvers.time.explicit.many_steps import TABLEAU, Tableau

Array = np.ndarray
#: Copies fewer than which go alone: `WIDTH` lanes take as long as two to three copies.
LEAST = 3
#: Steps that copies go side by side before they are looked at: first, at least, and at most.
FIRST, FEWEST, MOST = 64, 4, 1024
#: Processor time to compile a function for lanes, s, and the part of a step's time that lanes save. Functions are
#: compiled where what is left to do, or was done alone, would have saved the time of that.
COMPILE, SAVED = 2.0, 0.6
#: Steps after which lanes are judged; calls in which copies go alone where they were slower, at first and at most.
JUDGED, PAUSE, LONGEST_PAUSE = 8 * WIDTH * FIRST, 4, 256
#: What counts, or is written once, for each copy on its own.
_COUNTS = ("steps", "rhs_evaluations", "rejected", "fired")
_WRITTEN = ("out_y", "out_s", "log_t", "log_k")
#: What a run calls.
_ROOTS = (explicit.start_up, ex.fire, explicit.advance)
_I = types.int64
_advance: Any = explicit.advance if config.DISABLE_JIT else Attempt(explicit.advance.lanes)


@indirect(_I(lane_type(TABLEAU), lane_type(MODEL), lane_type(ex.WORKSPACE), _I))
def advance_lanes(tableau, model, work, budget):
    """`loop.advance` of copies side by side; `PARTED` less a mask where they have parted."""
    A, b, c, E, P, Q = tableau.A, tableau.b, tableau.c, tableau.error, tableau.dense, tableau.inner
    rtol, atol = tableau.tolerances[0], tableau.tolerances[1]
    return _advance(A, b, c, E, P, Q, rtol, atol, model, work, budget)


class Lanes:
    """Steps of copies, side by side where that is faster.

    Parameters
    ----------
    copies : ExplicitCopies

    Attributes
    ----------
    why_alone : str, why they never go side by side, a half sentence; '' where they can
    together, parted : int, steps of copies in lanes, and how often copies have parted
    """

    def __init__(self, copies: Any) -> None:
        self.copies, self.why_alone = copies, _why_alone(copies)
        self.together = self.parted = 0
        self.alone = Cost()
        self._threads, self._lock = threading.local(), threading.Lock()
        self._functions: list[Any] | None = None
        self._missing, self._is_loaded = 0, False

    def take_steps(self, which: Array, budgets: Array) -> None:
        """Take `budgets` (count,) steps of the copies `which` (k,), or fewer; the codes of the copies get statuses."""
        if self.why_alone or which.size < LEAST or not self._is_worth_it():
            self.take_alone(which, budgets)
            return
        own = getattr(self._threads, "own", None)
        if own is None:
            self._threads.own = own = _Group(self)
        own.take_steps(which, budgets)

    def take_alone(self, which: Array, budgets: Array) -> None:
        """Take steps of copies one after the other."""
        if not self.why_alone and not self.alone.steps:
            budgets = np.minimum(budgets, FIRST)  # which are timed
        with self.alone.of(self.copies, which):
            self.copies.take_steps_alone(which, budgets)

    def _is_worth_it(self) -> bool:
        """Whether functions for lanes are loaded; they are compiled where what is done alone takes longer than that."""
        if self._is_loaded or not self.alone.steps:
            return self._is_loaded
        with self._lock:
            if self._is_loaded or self.why_alone:
                return self._is_loaded
            copies = self.copies
            if self._functions is None:
                model = copies.run.model
                self._functions = [one.lanes for one in needs.needed(model, _ROOTS, needs.absent(model))]
                self._functions.append(advance_lanes)
                self._missing = count_missing(self._functions)
            left = np.maximum(copies.samples[:, -1] - copies.time, 0.0)[copies.status == GOES_ON].sum()
            rest = self.alone.rate * float(left) / copies.run.plan.step / copies.workers
            if SAVED * max(rest, self.alone.seconds) < COMPILE * self._missing:
                return False
            try:
                load(self._functions)
                self._is_loaded = True
            except NumbaError as error:
                self.why_alone = f"not all functions have a form for lanes ({str(error).splitlines()[0]})"
        return self._is_loaded


class Cost:
    """Processor time of steps.

    Attributes
    ----------
    seconds : float; steps : int
    """

    def __init__(self) -> None:
        self.seconds, self.steps = 0.0, 0

    @property
    def rate(self) -> float:
        """Time of a step, s."""
        return self.seconds / max(self.steps, 1)

    @contextlib.contextmanager
    def of(self, copies: Any, which: Array) -> Iterator[None]:
        """Count what the calling thread does to copies."""
        before, began = int(copies.loop["steps"][which].sum()), clock.thread_time()
        yield
        self.seconds += clock.thread_time() - began
        self.steps += int(copies.loop["steps"][which].sum()) - before


class _Group:
    """Lanes of one thread, which some of the copies take in turn."""

    def __init__(self, lanes: Lanes) -> None:
        self.lanes, self.copies = lanes, lanes.copies
        run, memory = self.copies.run, self.copies.memory
        fields = [f"{family}.{field}" for family, callers in asked("parts.calls").items() for field in callers.values()]
        self._models = LaneCopies(memory, "model", run.model, slots={*TABLES, *fields})
        apart = {*_WRITTEN, *(f"loop.{name}" for name in _COUNTS)}
        self._works = LaneCopies(memory, "work", run.work, apart=apart)
        self.model, self.work = self._models.struct, self._works.struct
        self._tableau = _for_lanes(self.copies.tableau)
        self._places = address(self.copies.blocks) + memory.size * np.arange(self.copies.count)
        self._chunk, self._wait = FIRST, 1
        #: Steps of the grid from and up to which a copy goes alone; copies that are reset are before them.
        self._away: dict[int, range] = {}
        self._cost, self._pause, self._rests = Cost(), PAUSE, 0

    def take_steps(self, which: Array, budgets: Array) -> None:
        """Take steps of copies: see `Lanes.take_steps`."""
        if self._rests > 0:
            self._rests -= 1
            self.lanes.take_alone(which, budgets)
            return
        with self._cost.of(self.copies, which):
            self._go(which, budgets)
        if self._cost.steps > JUDGED:
            if self._cost.rate > self.lanes.alone.rate:
                self._rests, self._pause = self._pause, min(2 * self._pause, LONGEST_PAUSE)
            else:
                self._pause = PAUSE
            self._cost = Cost()

    def _go(self, which: Array, budgets: Array) -> None:
        loop, codes = self.copies.loop, self.copies.codes
        goals = {c: int(loop["steps"][c] + budgets[c]) for c in which.tolist()}
        going = [*goals]
        codes[which] = ex.BUDGET
        while going:
            grid = {c: int(loop["grid"][c]) for c in going}
            behind = min(grid.values())
            level = [c for c in going if grid[c] == behind]
            steps = min([self._chunk, *(grid[c] - behind for c in going if grid[c] > behind)])
            for group in self._groups(level, behind):
                most = min(goals[c] - int(loop["steps"][c]) for c in group)
                if len(group) < LEAST:
                    self._alone(group, min(steps, most))
                else:
                    self._side_by_side(group, min(steps, most))
            going = [c for c in going if codes[c] == ex.BUDGET and loop["steps"][c] < goals[c]]

    def _groups(self, level: list[int], grid: int) -> list[list[int]]:
        """Copies that may go side by side, and those that go alone."""
        found, alone = list[list[int]](), list[list[int]]()
        for c in level:
            if grid in self._away.get(c, ()):
                alone.append([c])
                continue
            for group in found:
                if len(group) < WIDTH and self._are_alike(group[0], c):
                    group.append(c)
                    break
            else:
                found.append([c])
        return found + alone

    def _are_alike(self, a: int, b: int) -> bool:
        return all(one.are_alike(self._places[a], self._places[b]) for one in (self._models, self._works))

    def _alone(self, group: list[int], steps: int) -> None:
        """Advance copies alone."""
        budgets = np.full(self.copies.count, steps)
        self.copies.take_steps_alone(np.array(group), budgets)

    def _side_by_side(self, group: list[int], steps: int) -> None:
        """Advance copies side by side; where they part, up to that step, which each takes alone."""
        before = int(self.copies.loop["grid"][group[0]])
        code = self._try(group, steps)
        if code > PARTED:
            if self._keep(group):
                self._chunk = min(2 * self._chunk, MOST)
                self.copies.codes[group] = ex.BUDGET if code == ex.LOG_FULL else code
            return
        self.lanes.parted += 1
        done = int(self.work.loop["grid"]) - before
        if done > 0 and self._try(group, done) == ex.BUDGET:
            if not self._keep(group):
                return
            self._wait = 1
        elif done == 0:
            self._send_away(group, PARTED - code, before)
        self._chunk = max(FEWEST, min(self._chunk // 2, MOST))
        self._alone(group, 1)

    def _send_away(self, group: list[int], mask: int, grid: int) -> None:
        """Let copies that part from the others at once go alone for some steps."""
        true = [c for k, c in enumerate(group) if mask >> k & 1]
        others = [c for c in group if c not in true]
        self._wait = min(2 * self._wait, MOST)
        for c in min((true, others), key=len) or group:
            self._away[c] = range(grid, grid + self._wait)

    def _try(self, group: Sequence[int], steps: int) -> int:
        """Put copies into the lanes and go on for some steps; returns a status, copies do not change."""
        places = self._places[group]
        self._models.gather(places)
        self._works.gather(places)
        for name in _COUNTS:
            self.work.loop[name] = 0
        self.model.info["stepping"] = 1
        self._first = int(self.work.loop["sample"])
        code = int(advance_lanes(self._tableau, self.model, self.work, steps))
        self.model.info["stepping"] = 0
        return code

    def _keep(self, group: list[int]) -> bool:
        """Take what the lanes have reached as the copies' own, unless a log of events lacks the room."""
        loop = self.copies.loop
        fired, last = int(self.work.loop["fired"]), int(self.work.loop["sample"])
        full = [c for c in group if loop["fired"][c] + fired > self.copies.run.work.log_t.size]
        if full:
            self.copies.codes[full] = ex.LOG_FULL
            return False
        places = self._places[group]
        self._models.scatter(places)
        self._works.scatter(places)
        self.lanes.together += len(group) * int(self.work.loop["steps"])
        for c in group if fired else ():
            at = slice(int(loop["fired"][c]), int(loop["fired"][c]) + fired)
            self._values("log_t")[c, at] = self.work.log_t["lanes"][:fired, group.index(c)]
            self._values("log_k")[c, at] = self.work.log_k[:fired]
        if last > self._first:
            at = slice(self._first, last)
            self._values("out_y")[group, at] = np.moveaxis(self.work.out_y["lanes"][at, :, : len(group)], 2, 0)
            if self.work.out_s.size:
                self._values("out_s")[group, at] = self.work.out_s[at]
        for name in _COUNTS:
            loop[name][group] += int(self.work.loop[name])
        return True

    def _values(self, name: str) -> Array:
        """An array of the workspaces of all copies."""
        return self.copies.memory.values(self.copies.blocks, "work", name)


def _for_lanes(own: Tableau) -> Any:
    """Numbers of a method for lanes."""
    kind = lane_type(TABLEAU).struct
    values = {name: lane_zeros(getattr(own, name).shape, field.dtype) for name, field in kind._fields.items()}
    for name, value in values.items():
        value["lanes"] = getattr(own, name)[..., None]
    return kind(**values)


def _why_alone(copies: Any) -> str:
    """Why copies never go side by side, a half sentence; '' where they can."""
    run = copies.run
    if config.DISABLE_JIT:
        return "nothing is compiled"
    if copies.count < LEAST:
        return f"they are fewer than {LEAST}"
    if run.tableau.is_adaptive:
        return f"the steps of {run.plan.method} adapt, each copy's to itself"
    if run.assembly.laws or run.assembly.expressions:
        return "laws of users and expressions are evaluated one copy at a time"
    return ""
