"""Implicit runs by generalized-alpha: plan one, run it with its energy balance checked, report how it ended."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError
from evolvent.compiled import codecache
from evolvent.kernels import rigid
from evolvent.kernels.sparse import SparseBlocks
from evolvent.parts.checks import number, positive
from evolvent.solvers import alpha_loop, alpha_samples, alpha_state, reactions, redundancy
from evolvent.solvers import balance as eb
from evolvent.solvers.drive import STEP_ALLOWED, sample_times
from evolvent.solvers.implicit_messages import reason, stalled
from evolvent.solvers.implicit_setup import check_start, energy_floor, matrix_of, options_of, sizes, workspace
from evolvent.solvers.laws import broken_law, large_law, law_failure, refusing_laws, try_laws
from evolvent.solvers.pace import Pace, Stall
from evolvent.solvers.releases import Releases, reason_of_outrun, write_accounts
from evolvent.solvers.sampled import Sampled
from evolvent.solvers.solution import Solution, first_latch
from evolvent.solvers.step_error import LEFT_SHARE, rate_tolerance

#: Name of the method.
NAME = "generalized-alpha"
_SLICE = 0.15  # s of wall time between two looks at a running loop


@dataclasses.dataclass(frozen=True)
class Plan:
    """An implicit run, checked and prepared.

    Attributes
    ----------
    assembly : Assembly, with a model of the run's own
    times : (nt,) float, s, of the samples
    step : float, s, of fixed steps; None where they follow from the tolerance
    matrix : SparseBlocks, room for the tangent and its factors
    weight : (nv,) float, size of each unknown that counts as 1
    options : record `alpha_state.OPTIONS`
    """

    assembly: Assembly
    times: np.ndarray
    step: float | None
    matrix: SparseBlocks
    weight: np.ndarray
    options: np.record

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Integrate; `progress` is called with the time reached, a few times a second.

        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

        Raises
        ------
        InputError
            For constraints that contradict or repeat one another.
        """
        return Run(self).solution(progress)


def plan(
    assembly: Assembly,
    *,
    samples: Any,
    step: float | None = None,
    tolerance: float = 1e-4,
    spectral_radius: float = 0.3,
    newton: float | None = None,
    largest_gain: float = eb.GAINED,
    longest_step: float | None = None,
) -> Plan:
    """Check and prepare a run by generalized-alpha, joints as constraints of index 3.

    Parameters
    ----------
    assembly : Assembly, which is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end; they cut no step
    step : float, s, fixed; None has it follow from `tolerance`
    tolerance : float, error of a step that is accepted, beside the size of the system (or 1 for slopes and turns)
    spectral_radius : float, 0 to 1, at infinite frequency: 1 damps nothing, 0 all that the step does not resolve
    newton : float, correction at which an iteration has converged, beside the same sizes
    largest_gain : float, part of the energy moved that the balance may gain before the run fails
    longest_step : float, s, of an adaptive run

    Raises
    ------
    InputError
        For arguments out of range, parts that have no implicit form, or constraints that contradict the start.
    """
    times = sample_times(samples)
    span = float(times[-1] - times[0])
    if not 0.0 <= number("spectral_radius", spectral_radius, allowed="from 0 to 1") <= 1.0:
        raise InputError(f"spectral_radius is {spectral_radius!r}; it must be from 0 to 1")
    if step is not None:
        step = positive("step", step, allowed=STEP_ALLOWED)
    tolerance, largest_gain = positive("tolerance", tolerance), positive("largest_gain", largest_gain)
    newton = None if newton is None else positive("newton", newton)
    longest = span if longest_step is None else positive("longest_step", longest_step)
    families.check(assembly, families.IMPLICIT)
    own = dataclasses.replace(assembly, model=assembly.model.copy())
    model = own.model
    try_laws(own, times[0], times[-1])
    with refusing_laws(own):
        check_start(own, float(times[0]))
    weight, mass = sizes(own)
    adaptive, sharp = step is None, 0.0
    rated = adaptive and spectral_radius < 1.0  # undamped, algorithmic accelerations alternate
    if newton is None:
        sharp = LEFT_SHARE if rated else 0.0
        newton = 1e-9 if step is not None else min(1e-3 * tolerance, 1e-7)
        free = np.sum(model.bodies["motion"] == rigid.FREE) - np.sum(model.flexible.rods["elements"] + 1)
        spins = bool(free > 0)  # bodies but the nodes of rods, whose error adds up step by step
        stiff = model.flexible.elements.size > 0 or model.flexible.rods.size > 0
        if step is not None and (spins or (reactions.is_held(model) and not stiff)):  # what is held shows in reactions
            newton = 1e-12
        if model.threads.size:  # whose springs are so stiff that little lengths are large forces
            newton = 1e-13
    first = step if step is not None else min(1e-5 * span, 1e-4)
    options = options_of(
        spectral_radius,
        newton=newton,
        sharp=sharp,
        tolerance=tolerance if adaptive else 0.0,
        rates=rate_tolerance(tolerance) if rated else 0.0,
        smallest=1e-13 * span,
        longest=longest,
        gain=largest_gain,
        mass=mass,
        floor=energy_floor(own, mass, weight),
        span=first if step is not None else 10.0 * first,
    )
    return Plan(own, times, step, matrix_of(model), weight, options)


def solve_implicit(
    assembly: Assembly,
    *,
    samples: Any,
    step: float | None = None,
    tolerance: float = 1e-4,
    spectral_radius: float = 0.3,
    newton: float | None = None,
    largest_gain: float = eb.GAINED,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Integrate an assembled model with generalized-alpha: `plan` and run.

    Parameters
    ----------
    assembly, samples, step, tolerance, spectral_radius, newton, largest_gain, longest_step : as of `plan`
    progress : called with the time reached (s), a few times a second

    Returns
    -------
    Solution
        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

    Raises
    ------
    InputError
        As of `plan` and `Plan.run`.
    """
    prepared = plan(
        assembly,
        samples=samples,
        step=step,
        tolerance=tolerance,
        spectral_radius=spectral_radius,
        newton=newton,
        largest_gain=largest_gain,
        longest_step=longest_step,
    )
    return prepared.run(progress)


class Run:
    """A plan that runs: its workspace, and the switches and events that the loop does not keep.

    Runs of other implicit methods override what depends on their loop: `name`, `begin`, `advance`, `moments`,
    `_kept` and `counted`.

    Attributes
    ----------
    name : str, of the method
    work : alpha_state.Workspace
    releases : Releases, of a model with threads, else None
    ranks : redundancy.Ranks, of the constraints
    """

    name: ClassVar[str] = NAME

    def __init__(self, of: Any) -> None:
        self.plan, self.assembly, self.model = of, of.assembly, of.assembly.model
        self.releases: Releases | None = None
        self.ranks = redundancy.Ranks(of.assembly)
        began = clock.perf_counter()
        self.work: Any = self._loaded()
        self.compile_time = clock.perf_counter() - began

    def _loaded(self) -> Any:
        """The loop's workspace, when the functions that the run calls are loaded."""
        of = self.plan
        self.model.flexible.switches[:] = of.assembly.s
        self._hold_joints()
        self.releases = Releases(self.model) if self.model.threads.size else None
        needs.load(self.model, alpha_loop.begin, alpha_loop.advance, alpha_loop.restart)
        return workspace(of.assembly, of.times, of.weight, of.options.copy())

    def _hold_joints(self) -> None:
        """Joints and motors that events or latches release hold again, as before a run."""
        for rows in (self.model.flexible.joints, self.model.flexible.motors):
            released = rows["event"] != -1
            rows["until"][released] = rows["latest"][released]

    @property
    def reached(self) -> float:
        """Time reached, s."""
        return float(self.work.loop.time)

    def failure_message(self, code: int) -> str:
        """Why the loop has ended with a status below zero."""
        return reason(code, self.work, self.plan.step, self.assembly) + broken_law(self.assembly, self.moments())

    def stalled(self, stall: Stall) -> str:
        """Why a run of ever smaller steps is ended."""
        return stalled(stall, large_law(self.assembly, self.moments()))

    def begin(self) -> str:
        """Start the loop; returns why that failed, '' where it did not.

        Raises
        ------
        InputError
            For redundant constraints that cannot be allowed.
        """
        if self.releases is not None and self.releases.fire(self.reached, self.work.y) < 0:
            return reason_of_outrun(self.reached)
        self.find_rank(self.reached, self.work.y)
        code = alpha_loop.begin(self.model, self.plan.matrix, self.work)
        return "" if code == alpha_state.DONE else self.failure_message(code)

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
        """Room for the tangent by which the rank is found."""
        return self.plan.matrix

    @property
    def inertia(self) -> tuple[float, float]:
        """c_mass (1/s2) of a step too short to feel stiffness, and a typical mass (kg)."""
        return alpha_state.SHORT / float(self.plan.options.span) ** 2, float(self.plan.options.mass)

    @property
    def after(self) -> float:
        """Just after the time reached, where what ends then does not act any more, s."""
        return self.reached + max(1e-9 * float(self.work.loop.last_step), 20.0 * float(self.work.options.smallest))

    def restart(self) -> str:
        """Start again where loads or joints change at once; returns why that failed, '' where it did not."""
        failure = self.find_rank(self.after, self.work.y)
        if failure:
            return failure
        code = alpha_loop.restart(
            self.reached, float(self.work.loop.last_step), self.model, self.plan.matrix, self.work
        )
        return "" if code == alpha_state.DONE else self.failure_message(code)

    def advance(self, budget: int) -> tuple[bool, str]:
        """Take `budget` steps; returns whether the loop goes on after them, and why it failed, '' where it did not."""
        code = alpha_loop.advance(self.model, self.plan.matrix, self.work, budget)
        if code == alpha_state.AT_STOP and self.releases is not None:
            if self.releases.resume(self.work) < 0:
                return True, reason_of_outrun(self.reached)
            return True, self.restart() if self.ranks.is_due(self.after, int(self.work.loop.latches)) else ""
        if code == alpha_state.AT_RESTART:
            return True, self.restart()
        if code == alpha_state.BUDGET:
            return True, ""
        return False, "" if code == alpha_state.DONE else self.failure_message(code)

    def solution(self, progress: Callable[[float], None] | None) -> Solution:
        """Run to the end, or as far as the run comes."""
        status, message = "success", "the run reached its end"
        began = clock.perf_counter()
        try:
            failure = self.begin() or self._loop(progress)
            if failure:
                status, message = "failed", failure
        except KeyboardInterrupt:
            status, message = "interrupted", f"interrupted at t = {self.reached:.6g} s; what was computed is kept"
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
            failure = law_failure(self.assembly, error, self.moments())
            status, message = "failed", f"{failure}; what was computed is kept"
        if self.ranks.text:
            message = f"{message}; {self.ranks.text}"
        wall_time = clock.perf_counter() - began
        codecache.mark_warm(self.name)
        found = self.counted(self._solution(status, message, wall_time))
        found.statistics |= {"energy_moved": float(eb.moved(self.work.loop))}
        found.statistics |= {"energy_moved": found.closure.moved, "energy_defect": found.closure.share}
        found.statistics |= self.ranks.statistics
        return found

    def _loop(self, progress: Callable[[float], None] | None) -> str:
        """Call the compiled loop until it ends; returns why it failed, '' where it did not."""
        work, budget = self.work, 20
        pace = Pace(self.reached)
        while True:
            slice_began = clock.perf_counter()
            goes_on, failure = self.advance(budget)
            if self.ranks.now is not None and not failure:
                failure = self.ranks.now.contradiction(self.gaps(), self.reached)
            if failure or not goes_on:
                break
            now = clock.perf_counter()
            budget = max(10, min(int(budget * min(_SLICE / max(now - slice_began, 1e-6), 4.0)), 1_000_000))
            stall = pace.stall(self.reached, int(work.loop.steps), self.plan.times[-1], fixed=self.plan.step)
            if stall is not None:
                return self.stalled(stall)
            if progress is not None:
                progress(self.reached)
        if self.releases is not None and not failure:  # what is due at the very end still happens
            if self.releases.resume(work) < 0:
                failure = reason_of_outrun(self.reached)
            alpha_samples.keep_sample(work.samples.size - 1, 1.0, self.reached, 0.0, self.model, work)
        return failure

    def gaps(self) -> np.ndarray:
        """Gaps of the joints at the end of the last step, (nj,)."""
        return np.array(self.model.flexible.joints["gap"])

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""
        work, s = self.work, self.model.flexible.switches
        t, h = self.reached, float(work.loop.step)
        later = np.append(work.stops, work.samples[-1])
        ends = [t + h, *np.sort(later[later > t])[:1].tolist()]
        return [(end, work.y, s) for end in ends] + [(t, work.y0, s), (t, work.y, s)]

    def _events(self) -> tuple[np.ndarray, np.ndarray]:
        """Times and kinds of all events: of threads, the user's, and latches."""
        count, releases = int(self.work.loop.latches), self.releases
        own, first = self.work.log_k[:count], 2 * self.model.threads.size  # of users' events
        latches = np.where(own >= 0, first_latch(self.model) + own, first - 1 - own)
        times = np.append(np.array(releases.times if releases is not None else [], float), self.work.log_t[:count])
        kinds = np.append(np.array(releases.kinds if releases is not None else [], np.int64), latches)
        order = np.argsort(times, kind="stable")
        return times[order], kinds[order]

    def _solution(self, status: str, message: str, wall_time: float) -> Solution:
        """What the run has reached, with what the loop has counted."""
        work, loop = self.work, self.work.loop
        n, steps = int(loop.sample), int(loop.steps)
        balance = work.out_balance[:n].copy().view(eb.BALANCE).reshape(n).view(np.recarray)
        write_accounts(self.model, work.out_y[:n], balance)
        event_times, event_kinds = self._events()
        return Solution(
            assembly=self.assembly,
            method=self.name,
            t=self.plan.times[:n].copy(),
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
            },
            event_times=event_times,
            event_kinds=event_kinds,
            wall_time=wall_time,
            compile_time=self.compile_time,
            kept=self._kept(n, balance),
        )

    def _kept(self, n: int, balance: Any) -> Sampled:
        """What the loop has kept of the first n samples."""
        work = self.work
        if reactions.applies(self.model, adaptive=self.plan.step is None):
            reactions.evaluate(self.model, self.plan.matrix, work, n, self.ranks.use)
        forces = work.out_cylinders[:n], work.out_bodies[:n]
        touches = work.out_touches[:n], work.out_friction[:n]
        momenta = None if self.model.threads.size else work.out_momenta[:n]
        return Sampled(work.out_a[:n], work.out_la[:n], balance, *forces, *touches, momenta=momenta)

    def counted(self, found: Solution) -> Solution:
        """The solution with what generalized-alpha alone counts."""
        found.statistics |= {"energy_gained": float(self.work.loop.gain)}
        return found


def rows_of_part(assembly: Assembly, name: str) -> slice:
    """Rows of the multipliers `la` that belong to the joint called `name`."""
    start = assembly.index(name, "joints")
    others = [index for family, index in assembly.names.values() if family == "joints" and index > start]
    return slice(start, min(others, default=assembly.model.flexible.joints.size))
