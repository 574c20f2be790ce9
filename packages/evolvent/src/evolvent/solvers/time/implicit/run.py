"""An implicit run: the compiled loop, with its energy balance checked, and what it returns."""

from __future__ import annotations

import functools
import math
import time as clock
from typing import Any

import numpy as np

from evolvent.algebra.sparse import INNER, SparseBlocks
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.implicit import residual, tangent
from evolvent.model.registry import asked, families as table, motions_of
from evolvent.solvers.common import balance as eb, redundancy
from evolvent.solvers.common.closing import closed
from evolvent.solvers.common.coordinates import evaluate_multipliers
from evolvent.solvers.common.matrices import check_covered, matrix_of
from evolvent.solvers.common.sampled import Sampled
from evolvent.solvers.common.solution import Solution, event_numbers
from evolvent.solvers.common.start import acts_from_outside
from evolvent.solvers.time import run
from evolvent.solvers.time.implicit import loop as implicit_loop, reactions, samples as implicit_samples
from evolvent.solvers.time.implicit.alpha_tangent import SHORT
from evolvent.solvers.time.implicit.captures import Captures
from evolvent.solvers.time.implicit.messages import reason, stalled
from evolvent.solvers.time.implicit.methods import METHODS
from evolvent.solvers.time.implicit.releases import releases_of, resume, write_accounts
from evolvent.solvers.time.implicit.workspace import AT_RESTART, AT_STOP, BUDGET, DONE, STOPPED, Workspace
from evolvent.solvers.time.messages import outrun
from evolvent.solvers.time.pace import Stall
from evolvent_base.errors import InputError

#: Inner unknowns, summed over steps, after which turns that have come to lie on one another are coupled directly.
MOST_INNER = 20


class ImplicitRun(run.MotionRun):
    """A plan that runs: its workspace, and the switches and events that the loop does not keep.

    Attributes
    ----------
    plan : ImplicitPlan
    work : implicit_state.Workspace
    releases : list of what changes the number of moving nodes between steps (`NodeEvents.between_steps`)
    ranks : redundancy.Ranks, of the constraints
    captures : captures.Captures, by latches in steps of a fixed length
    round_offs : as of `Solution`, where they are known
    matrix : SparseBlocks, of the tangent; of energy-momentum ordered again where turns come to lie on one another
    """

    round_offs: tuple[float, float] | None = None

    def __init__(self, of: Any) -> None:
        super().__init__(of)
        self.matrix = of.matrix
        self.midpoint, self.inner, self.is_stopped = bool(of.options.midpoint), 0, False
        self.has_layers = any(
            np.any(mask(getattr(self.model, name))) and (self.midpoint or table()[name].coupling.always)
            for name, mask in asked("coupling.layered").items()
        )
        self.ranks, self.captures = redundancy.Ranks(of.assembly), Captures()
        began = clock.perf_counter()
        self._hold_again()
        self.releases = releases_of(of.assembly)
        self._load()
        self.work: Workspace = of.workspace()
        self.compile_time = clock.perf_counter() - began

    def _load(self) -> None:
        """Load the functions that the run calls."""
        roots: list[Any] = [implicit_loop.begin, implicit_loop.advance]
        if not self.midpoint:
            roots.append(implicit_loop.restart)
        elif self.model.constraints.size:  # for the rank of the constraints
            roots += [residual, tangent]
        others = frozenset().union(*(row.modules for row in METHODS.values()))
        needs.load(self.model, *roots, without=others - METHODS[self.plan.method].modules)

    def _hold_again(self) -> None:
        """Rows and records that events or latches release hold again, as before a run."""
        of_families = (f.records(self.model) for f in table().values() if "latest" in (f.record.names or ()))
        for rows in (self.model.constraints, *of_families):
            released = rows["event"] != -1
            rows["until"][released] = rows["latest"][released]

    @property
    def tried(self) -> float:
        """Length of the step that was tried last, s."""
        if self.midpoint:
            return float(self.work.step.step.h)
        return self.plan.step if self.plan.step is not None else float(self.work.loop.step)

    def begin(self) -> str:
        """Start the loop; returns why that failed, '' where it did not.

        Raises
        ------
        InputError
            For redundant constraints that cannot be allowed.
        """
        for releases in self.releases:
            if releases.fire(self.reached, self.work.y) < 0:
                return outrun(self.reached)
            self.work.dv1[:] = releases.accelerations(self.reached, self.work.y)
        self.find_rank(self.reached, self.work.y)
        self._close()
        code = implicit_loop.begin(self.model, self.matrix, self.work)
        if self.has_layers:
            self._couple_layers()
        return "" if code == DONE else reason(code, self)

    def _close(self) -> None:
        """Bring the start onto its constraints."""
        if self.ranks.found:
            model, y = self.ranks.model_apart(), self.work.y
            y[:] = closed(model, self._rank_matrix(), self.reached, y.copy(), self.inertia)

    def find_rank(self, t: float, y: np.ndarray) -> str:
        """Find the rank of the constraints at t again where it may have changed; returns why that failed, or ''.

        Raises
        ------
        InputError
            At the start of a run, for redundant constraints that cannot be allowed.
        """
        latches = int(self.work.loop.latches)
        if not self.ranks.is_due(t, latches):
            return ""
        try:
            self.ranks.find(t, y, self._rank_matrix(), self.plan.weight, self.inertia, latches)
        except InputError as error:
            if not self.work.loop.steps:
                raise
            return f"{error} (at t = {t:.6g} s)"
        return ""

    def _rank_matrix(self) -> SparseBlocks:
        """Room for the tangent by which the rank is found, which does not couple turns on one another directly."""
        return matrix_of(self.model) if self.has_layers else self.matrix

    @property
    def inertia(self) -> tuple[float, float]:
        """c_mass (1/s2) of a step too short to feel stiffness, and a typical mass (kg)."""
        return SHORT / float(self.plan.options.span) ** 2, float(self.plan.options.mass)

    @property
    def after(self) -> float:
        """Just after the time reached, where what ends then does not act any more, s."""
        return self.reached + max(1e-9 * float(self.work.loop.last), 20.0 * float(self.work.options.smallest))

    def restart(self) -> str:
        """Start again where loads or joints change at once; returns why that failed, '' where it did not."""
        after = self.after
        if self.midpoint:
            step = self.work.step.step
            step.held = float(self.plan.options.chi > 0.0 and acts_from_outside(self.model, after))
        failure = self.find_rank(after, self.work.y)
        if failure or self.midpoint:
            return failure
        code = implicit_loop.restart(after, self.model, self.matrix, self.work)
        return "" if code == DONE else reason(code, self)

    def _couple_layers(self) -> None:
        """Order the tangent again where turns have come to lie on one another."""
        self.matrix, self.inner = matrix_of(self.model, layers=True), 0
        self.work.loop.factored = 0.0

    def advance(self, budget: int) -> tuple[bool, str]:
        """Take `budget` steps; returns whether the loop goes on after them, and why it failed, '' where it did not."""
        budget = 1 if self.captures.is_due else budget
        if not self.has_layers:
            code = implicit_loop.advance(self.model, self.matrix, self.work, budget)
        for _ in range(budget if self.has_layers else 0):
            code = implicit_loop.advance(self.model, self.matrix, self.work, 1)
            self.inner += int(self.matrix.counts[INNER])
            if self.inner > MOST_INNER:
                self._couple_layers()
            if code != BUDGET:
                break
        if self.plan.step is not None:
            self.captures.look(motions_of(self.model), self.work)
        if code == AT_STOP and self.releases:
            if not self._release():
                return True, outrun(self.reached)
            return True, self.restart() if self.ranks.is_due(self.after, int(self.work.loop.latches)) else ""
        if code == AT_RESTART:
            return True, self.restart()
        if code == BUDGET:
            return True, ""
        if code == STOPPED:
            self.is_stopped = True
            return False, ""
        return False, "" if code == DONE else reason(code, self)

    def _release(self) -> bool:
        """Carry out what changes the number of moving nodes now; returns False where that is not possible."""
        return all(resume(releases, self.model, self.work) >= 0 for releases in self.releases)

    def start(self) -> run.Ending | None:
        """Start the loop; returns how that failed, None where it did not."""
        failure = self.begin()
        return ("failed", failure) if failure else None

    def slice(self, budget: int) -> run.Ending | None:
        """Go on for `budget` steps; returns how the run has ended, None where it goes on."""
        goes_on, failure = self.advance(budget)
        if self.ranks.now is not None and not failure:
            failure = self.ranks.now.contradiction(self.gaps(), self.reached)
        if goes_on and not failure:
            return None
        if self.is_stopped and not failure:
            return self.stopped()
        if self.releases and not failure:  # what is due at the very end still happens
            if not self._release():
                failure = outrun(self.reached)
            implicit_samples.keep_sample(self.work.samples.size - 1, 1.0, self.reached, 0.0, self.model, self.work)
        return ("failed", failure) if failure else run.FINISHED

    def stall_message(self, stall: Stall) -> str:
        """Why a run of ever smaller steps is ended."""
        return stalled(stall, self)

    def gaps(self) -> np.ndarray:
        """Gaps of the constraints at the end of the last step, (nj,)."""
        return np.array(self.model.constraints["gap1" if self.midpoint else "gap"])

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""
        work, s = self.work, self.model.switches
        if self.midpoint:
            t, h = float(work.step.step.t), float(work.step.step.h)
            return [(t + 0.5 * h, work.step.ym, s), (t + h, work.y, s), (t, work.y0, s)]
        t, h = self.reached, float(work.loop.step)
        later = np.append(work.stops, work.samples[-1])
        ends = [t + h, *np.sort(later[later > t])[:1].tolist()]
        return [(end, work.y, s) for end in ends] + [(t, work.y0, s), (t, work.y, s)]

    def _events(self) -> tuple[np.ndarray, np.ndarray]:
        """Times and kinds of all events: releases, the user's, and latches."""
        count = int(self.work.loop.latches)
        latches, log = event_numbers(self.model, self.work.log_k[:count]), self.work.log_t[:count]
        times = np.concatenate([*(np.array(one.times, float) for one in self.releases), log])
        kinds = np.concatenate([*(np.array(one.kinds, np.int64) for one in self.releases), latches])
        order = np.argsort(times, kind="stable")
        return times[order], kinds[order]

    def result(self, status: str, message: str, wall_time: float) -> Solution:
        """What the run has reached, with what the loop has counted."""
        check_covered(self.model, self.matrix)
        if self.ranks.text:
            message = f"{message}; {self.ranks.text}"
        work, loop = self.work, self.work.loop
        self.model.info.over, self.model.info.checks = 0.0, 0  # where a law has raised within a step
        n, steps = int(loop.sample), int(loop.steps)
        balance = work.out_balance[:n].copy().view(eb.BALANCE).reshape(n).view(np.recarray)
        write_accounts(self.model, work.out_y[:n], balance)
        event_times, event_kinds = self._events()
        counted: dict[str, float] = {"energy_gained": float(loop.gain)}
        if self.midpoint:
            counted = {"divided_steps": int(loop.divided), "staged_steps": int(loop.stages)}
        found = Solution(
            assembly=self.assembly,
            method=self.plan.method,
            t=work.samples[:n].copy(),
            y=work.out_y[:n],
            s=work.out_s[:n],
            status=status,
            message=message,
            statistics={
                "steps": steps,
                "rejected_steps": int(loop.rejected),
                "iterations": int(loop.iterations),
                "factorizations": int(loop.factorizations),
                "events": event_times.size,
                "step": math.nan if self.plan.step is None else self.plan.step,
                "mean_step": (self.reached - float(self.plan.times[0])) / max(steps, 1),
                "smallest_pivot": float(loop.quality),
                "energy_moved": float(eb.moved(loop)),
                **counted,
            },
            event_times=event_times,
            event_kinds=event_kinds,
            wall_time=wall_time,
            compile_time=self.compile_time,
            kept=self._kept(n, balance),
            reactions=self._reactions(n),
            captures=tuple(self.captures.found),
            round_offs=self.round_offs,
        )
        found.statistics |= {"energy_moved": found.closure.moved, "energy_defect": found.closure.share}
        found.statistics |= self.ranks.statistics
        return found

    def _kept(self, n: int, balance: Any) -> Sampled:
        """What the loop has kept of the first n samples."""
        work = self.work
        evaluate_multipliers(self.assembly, work.samples[:n], work.out_y[:n], work.out_s[:n], work.out_la[:n])
        return Sampled(
            work.out_a[:n],
            work.out_la[:n],
            balance,
            work.out_forces[:n],
            work.out_points[:n] if self.midpoint else None,
            None if self.model.info.releases else work.out_momenta[:n],
        )

    @functools.cached_property
    def evaluates_reactions(self) -> bool:
        """Whether reactions are evaluated at the samples, which the loop does not keep."""
        return reactions.applies(self.model, self.plan.options)

    def _reactions(self, n: int) -> reactions.PendingReactions | None:
        """What evaluates reactions at the first n samples; None where the loop keeps them."""
        if not self.evaluates_reactions:
            return None
        done = np.zeros(n, dtype=bool)
        return reactions.PendingReactions(self.model, self.matrix, self.work, self.ranks, np.arange(n), done)


def rows_of_part(assembly: Assembly, name: str) -> slice:
    """Rows of the multipliers `la` that belong to the part called `name`."""
    own = np.flatnonzero(np.array(assembly.row_parts) == name)
    return slice(int(own[0]), int(own[-1]) + 1)
