"""Copies of a prepared explicit run: see `evolvent.solvers.time.copies`."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from evolvent.assembly import needs
from evolvent.compiled.lane_types import WIDTH
from evolvent.model import N_INVENTORY, Model
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.sampled import balances
from evolvent.solvers.time.copies import GOES_ON, HAS_FAILED, STEPS, STOPPED_BY_EVENT, TOGETHER, Copies
from evolvent.solvers.time.explicit import events as ex, loop as explicit
from evolvent.solvers.time.explicit.lanes import Lanes
from evolvent.solvers.time.explicit.many_steps import advance_many, inventories_many, tableau_of
from evolvent.solvers.time.explicit.run import LOOKED_AT, ExplicitRun, chosen_samples, loop_record
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
        self._starts = np.zeros((count, len(eb.BALANCE.names or ())))
        self._checks = np.zeros(count, dtype=np.int64)
        self._closures: dict[int, eb.Closure] = {}

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

    def kept_samples(self, which: Array, at: Array, model: Model, *, without: Collection[str] = ()) -> dict[str, Any]:
        """As of all copies."""
        found = {}
        for name in ("y", "s"):
            kept = self.values("work", f"out_{name}")
            none = np.zeros((*at.shape, 0), dtype=getattr(self.run.work, name).dtype)
            found[name] = (none if kept is None else kept[which[:, None], at]).reshape(at.size, -1)
        return {**found, "kept": None}

    def closes(self, which: Array) -> Array:
        """As of all copies."""
        close = np.array([k in self._closures for k in which.tolist()], dtype=bool)
        return close & (self.status[which] == GOES_ON) & (self.loop["sample"][which] == self.samples.shape[1])

    def events(self, k: int) -> tuple[Array, Array]:
        """As of all copies."""
        if k not in self._runs:  # whose log has not been full
            times, kinds = (self.memory.values(self.blocks, "work", name) for name in ("log_t", "log_k"))
            count = int(self.loop["fired"][k])
            return times[k, :count].copy(), kinds[k, :count].copy()
        found: tuple[Array, Array] = self._runs[k].all_logged()
        return found

    def _begin(self, which: Array) -> None:
        """As of all copies."""
        for name in ("y", "s"):
            now, kept = self.values("work", name), self.values("work", f"out_{name}")
            if now is not None and kept is not None:
                kept[which, 0] = now[which]
        self._checks[which] = self.run.every
        for k in which.tolist():
            self._closures.pop(k, None)
        for part in self._parts(which):
            try:
                self._starts[part] = self._balances_at(part, "y", "s", self.time[part, None])[:, 0]
            except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                self._starts[part] = np.nan
                self._fail(int(part[0]), self._failure_of(int(part[0]), error))

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
        self._budgets[which] = np.clip(self._checks[which] - self.loop["steps"][which], 1, STEPS)
        self._lanes.take_steps(which, self._budgets)

    def take_steps_alone(self, which: Array, budgets: Array) -> None:
        """Take `budgets` (count,) steps of copies, one copy after the other; `codes` get the statuses."""
        advance_many(self.tableau, which, *self._structs.values(), self._codes, budgets)

    def _ended(self, which: Array) -> Array:
        """As of all copies."""
        codes, steps, is_single = self._codes[which], self.loop["steps"][which], np.ones(which.size, dtype=bool)
        is_single[(codes == ex.BUDGET) & (steps < self._checks[which])] = False
        for k in which[~is_single].tolist():
            self._look(k)
        ended = (codes == ex.DONE) | (codes == ex.STOPPED)
        is_late = (codes != ex.DONE) | (self.time[which] >= self.run.plan.times[-1])
        self._codes[which[ended]] = ex.DONE
        is_single[ended & ~is_late] = False  # at the last sample, but not at the end of the run
        judged = np.flatnonzero(ended & is_late)
        # only copies without a run of their own have the balance of their start in `_starts`
        judged = judged[[k not in self._runs for k in which[judged].tolist()]]
        is_single[judged[self._balances_close(which[judged])]] = False
        self.status[which[ended & ~is_single & (codes == ex.STOPPED)]] = STOPPED_BY_EVENT
        for k, code in zip(which[is_single].tolist(), codes[is_single].tolist(), strict=True):
            self._codes[k] = code
            self._guarded(k, self._after)
            if k in self._runs:
                self._checks[k] = self._runs[k].check
        return which[(self.status[which] == GOES_ON) & (self._codes[which] != ex.DONE)]

    def _balances_close(self, which: Array) -> Array:
        """Whether the energy balances of copies that have ended close even without round-off: (k,) bool.

        They are checked at the same samples as those of single runs (`ExplicitRun.has_failed`).
        """
        found = np.zeros(which.size, dtype=bool)
        counts = self.loop["sample"][which]
        for kept in np.unique(counts).tolist():
            of = np.flatnonzero(counts == kept)
            for first in range(0, of.size, TOGETHER):
                some = of[first : first + TOGETHER]
                found[some] = self._balances_close_at(which[some], chosen_samples(kept, LOOKED_AT) if kept else None)
        return found

    def _balances_close_at(self, which: Array, samples: Array | None) -> Array:
        """See `_balances_close`; samples : (m,) int, numbers of the stored samples that are checked, or None."""
        first, last = np.full((which.size, 1), float(self.run.plan.times[0])), self.time[which, None]
        times, looks = [first, last], [self._starts[which, None], self._balances_at(which, "y", "s", last)]
        if samples is not None:
            times.append(self.samples[which[:, None], samples])
            looks.append(self._balances_at(which, "out_y", "out_s", times[-1], samples))
        order = np.argsort(np.concatenate(times, axis=1), axis=1, kind="stable")[:, :, None]
        rows = np.take_along_axis(np.concatenate(looks, axis=1), order, axis=1)
        closures = eb.closures(eb.columns_of(rows), [0.0] * which.size, damps=False)
        self._closures |= {k: own for k, own in zip(which.tolist(), closures, strict=True) if not own.fails}
        return np.array([not own.fails for own in closures])

    def _balances_at(self, which: Array, y: str, s: str, times: Array, samples: Array | None = None) -> Array:
        """Energy balances of copies, (k, nt, n) float, at their states, or at stored samples.

        Parameters
        ----------
        y, s : names of the states and of the switches in the workspace
        times : (k, nt) float, s
        samples : (nt,) int, numbers of the samples; None for the states
        """
        at = (which,) if samples is None else (which[:, None], samples)
        model, given = self.run.model, self.values("work", y)
        states = np.zeros((*times.shape, 0)) if given is None else given[at]
        states = np.ascontiguousarray(states.reshape(*times.shape, -1))
        given = self.values("work", s)
        switches = np.zeros((*times.shape, 0), dtype=np.int64) if given is None else given[at]
        switches = np.ascontiguousarray(switches.reshape(*times.shape, -1))
        sums = np.empty((*times.shape, N_INVENTORY))
        needs.load(model, inventories_many)
        inventories_many(which, self._structs["model"], np.ascontiguousarray(times), states, switches, sums)
        rows = np.asarray(balances(model, states.reshape(times.size, -1), sums.reshape(times.size, -1)))
        return rows.view(float).reshape(*times.shape, -1)

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
        found.begin_checks(self._starts[number, None])
        found.check = int(self._checks[number])
        if self.round_offs is not None:
            found.__dict__["unresolved"], found.__dict__["floor"] = self.round_offs
        if number in self._closures:
            found.found = self._closures[number]._replace(unresolved=found.unresolved, floor=found.floor)
        return found


class _CopiedRun(ExplicitRun):
    """The run of a copy: see `ExplicitRun`.

    Attributes
    ----------
    number : int, of the copy
    """

    number: int
