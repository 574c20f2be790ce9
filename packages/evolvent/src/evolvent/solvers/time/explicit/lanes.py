"""Explicit runs of fixed steps side by side: copies of one model in the lanes of vector instructions.

The loop is `loop.advance` itself, compiled for lanes (`compiled.lanes`). Copies go side by side for some steps at a
time. Where a branch or an event would part them, those steps are taken back; they go side by side up to that step, take
it alone, and come back. Copies whose integers differ, as of a latch that one has locked, form lanes of their own. So
every copy gets the bits that it gets alone.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import config, types
from numba.core.errors import NumbaError

from evolvent.assembly import needs
from evolvent.compiled.jit import Attempt, indirect
from evolvent.compiled.lane_types import WIDTH, lane_zeros
from evolvent.compiled.lanes import PARTED, lane_type
from evolvent.compiled.pointer import Struct, array
from evolvent.model import MODEL
from evolvent.model.lanes import LaneCopies
from evolvent.model.registry import TABLES, asked
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.explicit import events as ex, loop as explicit
from evolvent.solvers.time.explicit.run import ExplicitRun, grow_log

#: Copies fewer than which go alone: `WIDTH` lanes take as long as two to three copies.
LEAST = 3
#: Steps that copies go side by side before they are looked at: first, at least, and at most.
FIRST, FEWEST, MOST = 64, 4, 512
#: What counts, or is written once, for each copy on its own.
_COUNTS = ("steps", "rhs_evaluations", "rejected", "fired")
_WRITTEN = ("out_y", "out_s", "log_t", "log_k")
_I = types.int64


class Tableau(Struct):
    """Numbers of a method, as arguments of `loop.advance`; tolerances: relative and absolute."""

    A: np.ndarray = array(2)
    b: np.ndarray = array(1)
    c: np.ndarray = array(1)
    error: np.ndarray = array(1)
    dense: np.ndarray = array(2)
    inner: np.ndarray = array(2)
    tolerances: np.ndarray = array(1)


_advance: Any = explicit.advance if config.DISABLE_JIT else Attempt(explicit.advance.lanes)


@indirect(_I(lane_type(Tableau._numba_type_), lane_type(MODEL), lane_type(ex.WORKSPACE), _I))
def advance_lanes(tableau, model, work, budget):
    """`loop.advance` of copies side by side; `PARTED` less a mask where they have parted."""
    A, b, c, E, P, Q = tableau.A, tableau.b, tableau.c, tableau.error, tableau.dense, tableau.inner
    rtol, atol = tableau.tolerances[0], tableau.tolerances[1]
    return _advance(A, b, c, E, P, Q, rtol, atol, model, work, budget)


#: Functions of which some have no form for lanes: reasons, by the functions.
_lacking: dict[tuple[Any, ...], str] = {}


def reason_alone(runs: Sequence[ExplicitRun]) -> str:
    """Why runs cannot go side by side, a half sentence; '' where they can, with the functions for that loaded."""
    first = runs[0]
    if config.DISABLE_JIT:
        return "nothing is compiled"
    if len(runs) < LEAST:
        return f"they are fewer than {LEAST}"
    if first.tableau.is_adaptive:
        return f"the steps of {first.plan.method} adapt, each copy's to itself"
    if any(run.plan.method != first.plan.method or run.plan.step != first.plan.step for run in runs):
        return "their methods or steps differ"
    if any(not np.array_equal(run.plan.times, first.plan.times) for run in runs):
        return "their samples differ"
    if any(run.assembly.laws or run.assembly.expressions for run in runs):
        return "laws of users and expressions are evaluated one copy at a time"
    if any(_sizes(run) != _sizes(first) for run in runs):
        return "their models differ in more than numbers"
    return _load(first)


def _sizes(run: ExplicitRun) -> list[Any]:
    """What copies must have alike to be copies: sizes of arrays, and the functions that they call."""
    fields = type(run.model)._fields
    found = [getattr(run.model, name).shape for name in run.model._own() if fields[name].struct is None]
    return [*found, *(getattr(run.model, name).tolist() for name in TABLES), run.work.y.size, run.work.g.size]


def _load(run: ExplicitRun) -> str:
    roots = (explicit.start_up, ex.fire, explicit.advance)
    found = tuple(needs.needed(run.model, roots, needs.absent(run.model)))
    if found not in _lacking:
        try:
            needs.load_lanes(found)
            _lacking[found] = ""
        except NumbaError as error:
            _lacking[found] = f"not all functions have a form for lanes ({str(error).splitlines()[0]})"
    return _lacking[found]


class Lanes:
    """Explicit runs of copies of one model, up to `WIDTH` of which go side by side.

    Parameters
    ----------
    runs : for which `reason_alone` has none
    """

    def __init__(self, runs: Sequence[ExplicitRun]) -> None:
        self.runs = list(runs)
        fields = [f"{family}.{field}" for family, callers in asked("parts.calls").items() for field in callers.values()]
        self._models = LaneCopies([run.model for run in runs], slots={*TABLES, *fields})
        apart = {*_WRITTEN, *(f"loop.{name}" for name in _COUNTS)}
        self._works = LaneCopies([run.work for run in runs], apart=apart)
        self.model, self.work = self._models.struct, self._works.struct
        self._tableau = _tableau(runs[0])
        self._chunk, self._wait = FIRST, 1
        #: Step of the grid up to which a copy goes alone.
        self._away = [0] * len(self.runs)
        self.counts = {"side by side": 0, "alone": 0, "parted": 0}

    def advance(self, active: Sequence[int], budget: int) -> dict[int, int]:
        """Advance copies by `budget` steps of the grid, or until they end; returns statuses of `loop.advance`."""
        codes = dict.fromkeys(active, ex.BUDGET)
        goal = max(self._grid(c) for c in active) + budget
        while True:
            going = [c for c in active if codes[c] == ex.BUDGET and self._grid(c) < goal]
            if not going:
                return codes
            behind = min(self._grid(c) for c in going)
            steps = min(self._chunk, goal - behind)
            level = [c for c in going if self._grid(c) == behind]
            if len(level) < len(going):
                steps = min(steps, min(self._grid(c) for c in going if c not in level) - behind)
            for group in self._groups(level):
                if len(group) < LEAST:
                    for c in group:
                        codes[c] = self._alone(c, steps)
                else:
                    codes.update(self._side_by_side(group, steps))

    def _grid(self, c: int) -> int:
        return int(self.runs[c].work.loop.grid)

    def _groups(self, level: list[int]) -> list[list[int]]:
        """Copies that may go side by side, and those that go alone."""
        found, alone = list[list[int]](), list[list[int]]()
        for c in level:
            if self._away[c] > self._grid(c):
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
        return self._models.are_alike(a, b) and self._works.are_alike(a, b)

    def _alone(self, c: int, steps: int) -> int:
        """Advance a copy alone."""
        run, goal, code = self.runs[c], self._grid(c) + steps, ex.BUDGET
        self.counts["alone"] += steps
        while code == ex.BUDGET and self._grid(c) < goal:
            code = run.advance(run.work, goal - self._grid(c))
            if code == ex.LOG_FULL:
                run.work, code = grow_log(run.work), ex.BUDGET
        return code

    def _side_by_side(self, group: list[int], steps: int) -> dict[int, int]:
        """Advance copies side by side; where they part, up to that step, which each takes alone."""
        before = self._grid(group[0])
        code = self._try(group, steps)
        if code > PARTED:
            self._keep(group)
            self._chunk = min(2 * self._chunk, MOST)
            return dict.fromkeys(group, ex.BUDGET if code == ex.LOG_FULL else code)
        self.counts["parted"] += 1
        done = int(self.work.loop["grid"]) - before
        if done > 0 and self._try(group, done) == ex.BUDGET:
            self._keep(group)
            self._wait = 1
        elif done == 0:
            self._send_away(group, PARTED - code)
        self._chunk = max(FEWEST, min(self._chunk // 2, MOST))
        return {c: self._alone(c, 1) for c in group}

    def _send_away(self, group: list[int], mask: int) -> None:
        """Let copies that part from the others at once go alone for some steps."""
        true = [c for k, c in enumerate(group) if mask >> k & 1]
        others = [c for c in group if c not in true]
        fewer = min((true, others), key=len) or group
        self._wait = min(2 * self._wait, MOST)
        for c in fewer:
            self._away[c] = self._grid(c) + self._wait

    def _try(self, group: Sequence[int], steps: int) -> int:
        """Put copies into the lanes and go on for some steps."""
        self._models.gather(group)
        self._works.gather(group)
        return self.step(steps)

    def step(self, steps: int) -> int:
        """Go on with what is in the lanes; returns the status of `advance_lanes`, copies do not change."""
        for name in _COUNTS:
            self.work.loop[name] = 0
        self.model.info["stepping"] = 1
        self._first = int(self.work.loop["sample"])
        code = int(advance_lanes(self._tableau, self.model, self.work, steps))
        self.model.info["stepping"] = 0
        return code

    def _keep(self, group: list[int]) -> None:
        """Take what the lanes have reached as the copies' own."""
        self._models.scatter(group)
        self._works.scatter(group)
        self.counts["side by side"] += len(group) * int(self.work.loop["steps"])
        fired, last = int(self.work.loop["fired"]), int(self.work.loop["sample"])
        counts = [(name, int(self.work.loop[name])) for name in _COUNTS if self.work.loop[name]]
        for k, c in enumerate(group):
            run = self.runs[c]
            while int(run.work.loop.fired) + fired > run.work.log_t.size:
                run.work = grow_log(run.work)
            if fired > 0:
                at = slice(int(run.work.loop.fired), int(run.work.loop.fired) + fired)
                run.work.log_t[at] = self.work.log_t["lanes"][:fired, k]
                run.work.log_k[at] = self.work.log_k[:fired]
            for name, count in counts:
                run.work.loop[name] += count
            if last > self._first:
                run.work.out_y[self._first : last] = self.work.out_y["lanes"][self._first : last, :, k]
                run.work.out_s[self._first : last] = self.work.out_s[self._first : last]


def _tableau(run: ExplicitRun) -> Any:
    """Numbers of a run's method for lanes."""
    own, values = run.tableau, {}
    given = {name: getattr(own, name) for name in ("A", "b", "c", "error", "dense", "inner")}
    for name, value in (given | {"tolerances": np.array([run.plan.rtol, run.plan.atol])}).items():
        values[name] = lane_zeros(value.shape, lane_type(Tableau._numba_type_).fields[name].dtype)
        values[name]["lanes"] = value[..., None]
    return lane_type(Tableau._numba_type_).struct(**values)


def run_together(plans: Sequence[Any]) -> list[Solution]:
    """Run explicit plans of copies of one model, side by side where they can; each has the bits that it has alone.

    Parameters
    ----------
    plans : list of `ExplicitPlan`
    """
    runs = [ExplicitRun(plan) for plan in plans]
    if reason_alone(runs):
        return [run.solution(None) for run in runs]
    lanes, began = Lanes(runs), clock.perf_counter()
    found: dict[int, Solution] = {}
    while active := [c for c in range(len(runs)) if c not in found]:
        budget = min(max(1, runs[c].check - int(runs[c].work.loop.steps)) for c in active)
        for c, code in lanes.advance(active, budget).items():
            ending = runs[c].after(code)
            if ending is not None:
                found[c] = runs[c].ended(*ending, (clock.perf_counter() - began) / len(runs))
    return [found[c] for c in range(len(runs))]
