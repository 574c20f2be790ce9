"""An explicit run: the compiled loop, its energy balance checked on the way, and what it returns."""

from __future__ import annotations

import functools
import math
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import zeros_record
from evolvent.model.registry import asked, forget_steps
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.laws import broken_law
from evolvent.solvers.common.observations import sums_of
from evolvent.solvers.common.sampled import balances
from evolvent.solvers.common.sizes import round_off_energy, strain_round_off
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time import event_search, run
from evolvent.solvers.time.explicit import events as ex, loop as explicit
from evolvent.solvers.time.explicit.messages import explicit_reason, explicit_stalled, unbalanced
from evolvent.solvers.time.explicit.methods import METHODS, Method
from evolvent.solvers.time.pace import Stall

#: Defect, in parts of the energy moved, at which a run is ended early. Smaller ones are judged at the end: at the start
#: of a motion from rest hardly any energy was moved.
DIVERGED = 10.0
#: Number of samples whose balance is evaluated where it closes; all where it does not.
LOOKED_AT = 100
#: Share of a run in which a whole log of events is not plausible: the same ones fire again and again.
CHATTER = 1e-6
#: Most energy checks over a run with fixed steps, and fewest steps between two of them; adaptive steps take these.
CHECKS, CHECK_EVERY = 50, 2000


def cache_name(assembly: Assembly, method: str) -> str:
    """Name by which `codecache` knows whether the functions of a run are compiled; beams need more of them."""
    long = next((name for name in asked("stability.waves") if getattr(assembly.model, name).size), "")
    return f"{method} with {long}" if long and method in METHODS else method


class ExplicitRun(run.MotionRun):
    """A plan that runs: its loop, and the balances evaluated so far.

    The balance is checked after numbers of steps that do not depend on the machine's speed, so that a run ends the same
    way every time.
    """

    budget, least, most = 500, 100, 10_000_000

    def __init__(self, of: Any) -> None:
        super().__init__(of)
        self.tableau = METHODS[of.method]
        self.span = float(of.times[-1] - of.times[0])
        began = clock.perf_counter()
        self.advance = load(self.model, self.tableau, rtol=of.rtol, atol=of.atol)
        self.compile_time = of.compile_time + clock.perf_counter() - began
        forget_steps(self.model)
        self.work = _workspace(self.assembly, of.times, self.tableau, of.step)
        self.begin_checks()

    def begin_checks(self, start: np.ndarray | None = None) -> None:
        """Begin to check the energy balance; start : (1, n) float, balance at the start, evaluated if None."""
        self.logged: list[tuple[np.ndarray, np.ndarray]] = []
        times, step = self.plan.times, self.plan.step
        first = np.array([times[0]])
        self.seen = [self._look(first, self.work.y[None], self.work.s[None]) if start is None else (first, start)]
        self.watch = eb.Watch(self.seen[0][1][0].tolist())
        self.found: eb.Closure | None = None
        self.every = CHECK_EVERY if step is None else max(CHECK_EVERY, math.ceil(self.span / step / CHECKS))
        self.check, self.filled = self.every, -math.inf

    @functools.cached_property
    def unresolved(self) -> float:
        """Energy that steps do not resolve, J."""
        return strain_round_off(self.model)

    @functools.cached_property
    def floor(self) -> float:
        """Energy that is round-off, J."""
        return round_off_energy(self.assembly, float(self.plan.times[0]))

    @property
    def name(self) -> str:
        """As of all runs."""
        return cache_name(self.assembly, self.plan.method)

    def _look(self, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times, and the balances there as rows of numbers: NumPy joins these many times faster than records."""
        found = np.asarray(balances(self.model, y, sums_of(self.model, t, y, s)))
        return t, found.view(float).reshape(t.size, -1)

    def look(self) -> np.ndarray:
        """The balance by now, a row of numbers, which is kept."""
        if len(self.seen) > 2 * LOOKED_AT:
            del self.seen[1::2]
        self.seen.append(self._look(np.array([self.reached]), self.work.y[None], self.work.s[None]))
        self.found = None
        return self.seen[-1][1][0]

    def closure(self, samples: int) -> eb.Closure:
        """How well the balance closes where it was checked, and at so many of the samples kept."""
        work, kept = self.work, int(self.work.loop.sample)
        looks = list(self.seen)
        if samples and kept:
            chosen = chosen_samples(kept, samples)
            looks.append(self._look(work.samples[chosen], work.out_y[chosen], work.out_s[chosen]))
        order = np.argsort(np.concatenate([t for t, _ in looks]), kind="stable")
        whole = np.concatenate([one for _, one in looks])[order].view(eb.BALANCE)[:, 0].view(np.recarray)
        self.found = eb.closure(whole, unresolved=self.unresolved, damps=False, floor=self.floor)
        return self.found

    def is_lost(self) -> bool:
        """Whether the balance is off by far more than the energy moved, or is not finite."""
        if self.watch.defect(self.look().tolist()) <= DIVERGED * self.watch.moved:
            return False  # and where this is more: round-off is allowed, too
        return self.closure(0).share > DIVERGED and self.closure(int(self.work.loop.sample)).share > DIVERGED

    def has_failed(self) -> bool:
        """Whether the balance is off by more than the rule allows."""
        self.look()
        return self.closure(LOOKED_AT).fails and self.closure(int(self.work.loop.sample)).fails

    def slice(self, budget: int) -> run.Ending | None:
        """Go on for `budget` steps; returns how the run has ended, None where it goes on."""
        length = max(1, min(budget, self.check - int(self.work.loop.steps)))
        try:
            code = self.advance(self.work, length)
        except Exception:  # of a user's law: up to where it raises, the samples are kept
            if self.plan.step is None and _shorter(self.work, 1e-6 * self.span):
                return None
            raise
        return self.after(code)

    def after(self, code: int) -> run.Ending | None:
        """How the run has ended when its loop has returned a status code; None where it goes on."""
        if code == ex.LOG_FULL and self.reached - self.filled > CHATTER * self.span:
            self.make_room()
            self.filled = self.reached
        elif code != ex.BUDGET:
            return self._ending(code)
        if self.work.loop.steps >= self.check:
            self.check += self.every
            if self.is_lost():
                return self._ending(code)
        return None

    def make_room(self) -> None:
        """Make room in the loop's log of events."""
        self.logged.append(self._log())
        self.work.loop.fired = 0

    def _log(self) -> tuple[np.ndarray, np.ndarray]:
        count = int(self.work.loop.fired)
        return self.work.log_t[:count].copy(), self.work.log_k[:count].copy()

    def all_logged(self) -> tuple[np.ndarray, np.ndarray]:
        """Times of the events by now, s, and their numbers."""
        times, kinds = zip(*self.logged, self._log(), strict=True)
        return np.concatenate(times), np.concatenate(kinds)

    def _ending(self, code: int) -> run.Ending:
        """Status and message of a run whose loop has ended with a status code."""
        if code < 0 or code == ex.LOG_FULL:
            message = explicit_reason(code, self)
            if code in (ex.NOT_FINITE, ex.TOO_SMALL):
                later = self.reached + 1e-6 * float(self.work.samples[-1])  # past a step that shrank to nothing
                message += broken_law(self.assembly, [*self.moments(), (later, self.work.y, self.work.s)])
            return "failed", message
        if self.has_failed():
            return "failed", unbalanced(self, self.found or self.closure(0))
        if code == ex.STOPPED:
            return self.stopped()
        return run.FINISHED

    def stall_message(self, stall: Stall) -> str:
        """Why a run of ever smaller steps is ended."""
        return explicit_stalled(stall, self)

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""
        work, t, h = self.work, self.reached, float(self.work.loop.step)
        found = [(t, work.y, work.s)]
        for length in (h, min(h, float(work.samples[-1]) - t)):
            found += [(t + float(c) * length, work.w, work.s) for c in np.unique(self.tableau.c)]
            found.append((t + length, work.y1, work.s))
        return found

    def result(self, status: str, message: str, wall_time: float) -> Solution:
        """What the run has reached, with what the loop has counted."""
        work, kept, (event_times, event_kinds) = self.work, int(self.work.loop.sample), self.all_logged()
        found = self.found or self.closure(0)
        return Solution(
            assembly=self.assembly,
            method=self.plan.method,
            t=work.samples[:kept].copy(),
            y=work.out_y[:kept],
            s=work.out_s[:kept],
            status=status,
            message=message,
            statistics={
                "steps": int(work.loop.steps),
                "rejected_steps": int(work.loop.rejected),
                "rhs_evaluations": int(work.loop.rhs_evaluations),
                "events": event_times.size,
                "step": math.nan if self.plan.step is None else self.plan.step,
                "mean_step": (self.reached - float(self.plan.times[0])) / max(int(work.loop.steps), 1),
                "stability_limit": self.plan.limit,
                "energy_moved": found.moved,
                "energy_defect": found.share,
            },
            event_times=event_times,
            event_kinds=event_kinds,
            wall_time=wall_time,
            compile_time=self.compile_time,
        )


def chosen_samples(kept: int, samples: int) -> np.ndarray:
    """Numbers of at most `samples` evenly spaced ones of the `kept` samples that a run has stored."""
    return np.unique(np.linspace(0, kept - 1, min(kept, samples)).astype(int))


def _workspace(assembly: Assembly, times: np.ndarray, tableau: Method, step: float | None) -> ex.ExplicitWorkspace:
    """The loop's workspace at the start of a run."""
    n, n_s, n_e = assembly.y.size, assembly.s.size, int(assembly.model.info.ne)
    releases = int(assembly.model.info.releases)
    log = 1000 + 2 * ex.rounds(releases) * (releases // 2 + 1)
    return ex.ExplicitWorkspace(
        y=assembly.y.copy(),
        s=assembly.s.copy(),
        loop=loop_record(times, step),
        samples=times.copy(),
        out_y=np.zeros((times.size, n)),
        out_s=np.zeros((times.size, n_s), dtype=np.int64),
        log_t=np.zeros(log),
        log_k=np.zeros(log, dtype=np.int64),
        K=np.zeros((tableau.b.size, n)),
        w=np.zeros(n),
        y1=np.zeros(n),
        jump=np.zeros(n if assembly.model.info.rubbed >= 0 else 0),
        g=np.zeros(n_e),
        g0=np.zeros(n_e),
        scalars=ex.scalars_of_events(assembly.model),
        search=event_search.room(ex.always_due(assembly.model)),
        **{name: np.zeros((assembly.model.bodies.size, 3, 3)) for name in ("R0", "R1")},
        **{name: np.zeros((assembly.model.bodies.size, 3)) for name in ("x0", "x1")},
    )


def loop_record(times: np.ndarray, step: float | None) -> np.record:
    """What the loop counts and carries at the start of a run over times (nt,), s."""
    first = step if step is not None else 1e-6 * (times[-1] - times[0])
    return zeros_record(ex.LOOP, time=times[0], step=first, origin=times[0], last_error=1e-4, turn=np.inf, starts=1)


def _shorter(work: ex.ExplicitWorkspace, least: float) -> bool:
    """Try the step of the adaptive method again with a fifth of its length, unless that is below `least`."""
    if not 0.2 * work.loop.step > least:
        return False
    work.loop.step *= 0.2
    work.loop.stale = 1
    return True


def load(model: mdl.Model, tableau: Method, *, rtol: float, atol: float) -> Callable[[ex.ExplicitWorkspace, int], int]:
    """The time loop, loaded with all that it calls, as a function of what it carries and its budget."""
    options = (tableau.A, tableau.b, tableau.c, tableau.error, tableau.dense, tableau.inner, rtol, atol)
    needs.load(model, explicit.start_up, ex.fire, explicit.advance)

    def advance(work: ex.ExplicitWorkspace, budget: int) -> int:
        model.info.stepping = 1
        try:
            return int(explicit.advance(*options, model, work, budget))
        finally:
            model.info.stepping = 0

    return advance
