"""Copies of a prepared explicit run: see `evolvent.solvers.time.copies`."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.assembly import needs
from evolvent.compiled.lane_types import WIDTH
from evolvent.model import Model
from evolvent.solvers.time.copies import GOES_ON, HAS_FAILED, STEPS, STOPPED_BY_EVENT, Copies
from evolvent.solvers.time.explicit import events as ex, loop as explicit
from evolvent.solvers.time.explicit.lanes import Lanes
from evolvent.solvers.time.explicit.many_steps import advance_many, tableau_of
from evolvent.solvers.time.explicit.run import ExplicitRun, loop_record
from evolvent.solvers.time.explicit.stable_copies import StableCopies
from evolvent.solvers.time.run import FINISHED

Array = np.ndarray
#: Arrays of the workspace that are written before they are read.
_LATER = ("out_y", "out_s", "log_t", "log_k")


class ExplicitCopies(Copies):
    """Copies of an explicit run; of fixed steps they go side by side where that is faster (`explicit.lanes`)."""

    run: ExplicitRun

    def __init__(self, run: ExplicitRun, count: int, workers: int) -> None:
        super().__init__(run, count, workers, {"model": run.model, "work": run.work}, _LATER)
        self.tableau = tableau_of(run)
        needs.load(run.model, advance_many, explicit.start_up, ex.fire, explicit.advance)
        self.codes, self._budgets = self._codes, np.zeros(count, dtype=np.int64)
        self._lanes = Lanes(self)
        self.side_by_side = 1 if self._lanes.why_alone else WIDTH

    def keep_plan(self, which: Array, write: Callable[[Array, Array, Array], None]) -> Array:
        """As of all copies: those in which the step that was asked for is stable."""
        if not StableCopies.apply(self.run):
            return super().keep_plan(which, write)
        found = [
            self._stable.of(np.arange(some.size), self.memory.addresses(blocks, "model"), models)
            for some, blocks, models in self.models_apart(which, write)
        ]
        return np.concatenate([*found, np.zeros(0, dtype=bool)])

    @functools.cached_property
    def _stable(self) -> StableCopies:
        return StableCopies(self.run)

    def sampled(self, which: Array, model: Model) -> dict[str, Any]:
        """As of all copies."""
        found = {}
        for name in ("y", "s"):
            now, kept = self.values("work", name), self.values("work", f"out_{name}")
            if now is None or kept is None:
                found[name] = np.zeros((2 * which.size, 0), dtype=getattr(self.run.work, name).dtype)
            else:
                found[name] = np.stack([kept[which, 0], now[which]], axis=1).reshape(2 * which.size, -1)
        return {**found, "kept": None}

    def events(self, k: int) -> tuple[Array, Array]:
        """As of all copies."""
        found: tuple[Array, Array] = self.of(k).all_logged()
        return found

    def _begin(self, which: Array) -> None:
        """As of all copies."""
        for name in ("y", "s"):
            now, kept = self.values("work", name), self.values("work", f"out_{name}")
            if now is not None and kept is not None:
                kept[which, 0] = now[which]
        for k in which.tolist():
            self._guarded(k, lambda one: "")  # which looks at its start

    def _go_on(self, which: Array, ends: Array, changed: Array) -> Array:
        """As of all copies. Steps restart, as those of a stepper do."""
        times, step = np.array([0.0, 1.0]), self.run.plan.step
        for name in ("origin", "last_error", "turn", "starts", "stale", "grid", "next_break", "rubs0", "rubs1"):
            self.loop[name][which] = loop_record(times, step)[name]
        self.loop["origin"][which] = self.time[which]
        if step is None:
            self.loop["step"][which] = 1e-6 * (ends - self.time[which])
        self.loop["sample"][which] = 0
        return np.zeros(which.size, dtype=bool)

    def _take_steps(self, which: Array) -> None:
        """As of all copies."""
        for k in which.tolist():
            self._budgets[k] = max(1, min(STEPS, self.of(k).check - int(self.loop["steps"][k])))
        self._lanes.take_steps(which, self._budgets)

    def take_steps_alone(self, which: Array, budgets: Array) -> None:
        """Take `budgets` (count,) steps of copies, one copy after the other; `codes` get the statuses."""
        advance_many(self.tableau, which, *self._structs.values(), self._codes, budgets)

    def _ended(self, which: Array) -> Array:
        """As of all copies."""
        for k in which.tolist():
            self._guarded(k, self._after)
        return which[(self.status[which] == GOES_ON) & (self._codes[which] != ex.DONE)]

    def _after(self, one: Any) -> str:
        """Look at a copy after its steps; returns why it has failed."""
        k = one.number
        code = int(self._codes[k])
        if code == ex.DONE and one.reached < one.plan.times[-1]:  # of the samples, but not of the run
            return ""
        ending = one.after(code)
        if ending is None:
            self._look(k)
            return ""
        status, message = ending
        self._codes[k] = ex.DONE
        if status == "failed":
            return str(message)
        if ending != FINISHED:
            self.status[k] = STOPPED_BY_EVENT
        return ""

    def _fail(self, k: int, why: str) -> None:
        self.of(k).model.info.stepping = 0
        self.status[k], self.reasons[k] = HAS_FAILED, why

    def _run_of(self, views: dict[str, Any], number: int) -> Any:
        """As of all copies."""
        found = object.__new__(_CopiedRun)
        found.__dict__.update(self.run.__dict__)
        for name in ("unresolved", "floor"):  # of its own model
            found.__dict__.pop(name, None)
        needs.note_alike(self.run.model, views["model"])
        found.number, found.model, found.work = number, views["model"], views["work"]
        found.assembly = dataclasses.replace(self.run.assembly, model=found.model)
        step = None if self.run.plan.step is None else float(found.work.loop.step)
        found.plan = dataclasses.replace(self.run.plan, assembly=found.assembly, step=step)
        found.begin_checks()
        return found


class _CopiedRun(ExplicitRun):
    """The run of a copy: see `ExplicitRun`.

    Attributes
    ----------
    number : int, of the copy
    """

    number: int
