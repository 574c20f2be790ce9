"""The search for equilibria: load steps, slides down the energy, steps along an arc."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.algebra.singular import null_vectors
from evolvent.assembly import families
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.hints import hints_on
from evolvent.solvers.common.sampled import empty, forces_of
from evolvent.solvers.common.solution import NEWTON, Path, Solution
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.linear_motion import growing_motions, has_gyroscopic_forces
from evolvent.solvers.static.ranked import HELD, RankedNewton, for_free_motions
from evolvent.solvers.static.work import MOST_ITERATIONS, RESOLVED, Work, add_turn

Array = np.ndarray

#: Iterations of a slide to an equilibrium.
MOST_SLIDES = 2000
#: What is said of an equilibrium under the whole load.
CARRIED = "the whole load is carried"
#: Correction beside the tolerance from which on an equilibrium is said to be uncertain by it.
UNCERTAIN = 100.0
#: Load step below which there is no going on, and the first one.
SMALLEST_STEP, FIRST_STEP = 1e-6, 0.1
#: Load step above which none is accepted in which a slope turns by more than a right angle: it has turned over.
CAREFUL = 1e-3


class StaticSearch:
    """The path so far, and how it goes on."""

    def __init__(self, work: Work, tolerance: float, most: int, progress: Callable[[float], None] | None) -> None:
        self.work, self.tolerance, self.most, self.progress = work, tolerance, most, progress
        self.kept: list[tuple[Any, ...]] = []
        self.status, self.message = "success", CARRIED
        self.reached, self.steps, self.rejected, self.slides = 0.0, 0, 0, 0
        self.worst = 1.0
        self.free: list[str] = []
        self.unstable = -1
        #: Newton's method once pivots do not show the rank of the tangent.
        self.ranked: RankedNewton | None = None
        #: Rows of `Path.newton`, and how many there were before each point that is kept.
        self.newton: list[tuple[Any, ...]] = []
        self.marks: list[int] = []
        #: In how many directions the energy falls after the last step; -1 where that is not watched.
        self.falling = -1
        self._start = work.balance.y.copy()

    # ------------------------------------------------------------------------------------------ one step

    def _balance(self, factor: float, share: float = 1.0) -> int:
        w, b = self.work, self.work.balance
        w.couple()
        if self.ranked is None:
            state = self._state()
            found = int(
                eq.balance(w.time, w.step, factor, share, self.tolerance, MOST_ITERATIONS, w.model, w.matrix, b)
            )
            resolved = found >= 0 and b.loop.loose == 0 and b.loop.quality > RESOLVED
            if resolved or w.redundancy is None:
                return found
            self._back(state)
            self.ranked = RankedNewton(w)
        return self.ranked.balance(factor, share, self.tolerance, MOST_ITERATIONS)

    def _free_motions(self, factor: float) -> tuple[int, list[str]]:
        """How many motions are free at a load factor, and the parts that they move."""
        w = self.work
        if self.ranked is not None:
            X = self.ranked.free_motions(factor)
            return X.shape[1], w.moved(X) if X.size else []
        count = w.probe(factor)
        return count, w.free_motions(factor) if count > 0 else []

    def _note(self, factor: float) -> None:
        """Keep how Newton's method has come to the accepted state."""
        b = self.work.balance
        for i, row in enumerate(b.history[: int(b.loop.noted)].tolist()):
            self.newton.append((self.steps, i, factor, *row))

    def _state(self) -> tuple[Array, Array, Array, Array]:
        b = self.work.balance
        return b.y.copy(), b.la.copy(), b.before.copy(), self.work.model.switches.copy()

    def _back(self, state: tuple[Array, Array, Array, Array]) -> None:
        b = self.work.balance
        b.y[:], b.la[:], b.before[:], self.work.model.switches[:] = state

    def _turned_over(self, before: Array) -> bool:
        """Whether a beam's slope points against where it was, or a node of a rod has turned by a right angle."""
        slopes, turns, y = self.work.slopes, self.work.turns, self.work.balance.y
        if np.any(np.einsum("ij,ij->i", before[slopes], y[slopes]) < 0.0):
            return True
        return bool(np.any(np.abs(np.einsum("ij,ij->i", before[turns], y[turns])) < math.sqrt(0.5)))

    def _store_point(self, factor: float) -> None:
        """Accept the state, and keep it as a point of the path."""
        w = self.work
        b, model, energies = w.balance, w.model, np.zeros(5)
        eq.accept(w.time, w.model, b, energies)
        b.loop.factor = self.reached = factor
        self.worst = min(self.worst, float(b.loop.quality))
        y = b.y.copy()
        add_turn(w.model, b.spin * math.sqrt(max(factor, 0.0)), y)
        self.kept.append((factor, y, model.switches.copy(), b.la.copy(), energies, model.P.copy(), forces_of(model)))
        self.marks.append(len(self.newton))
        if self.progress is not None:
            self.progress(factor)

    def keep_start(self) -> None:
        """Keep the state that the search began with, where nothing was kept; what was not computed is NaN."""
        if not self.kept:
            w = self.work
            sizes = w.n_j, len(eb.ENERGIES), w.n_v, forces_of(w.model).size
            unknown = [np.full(size, np.nan) for size in sizes]
            self.kept.append((0.0, self._start, w.assembly.s.copy(), *unknown))

    def _slide(self, factor: float) -> bool:
        """Slide to an equilibrium at a factor, then balance."""
        w = self.work
        b = w.balance
        self.slides += 1
        m = w.mass().diagonal()
        w.probe(factor)
        ratio = np.abs(b.r[: w.n_v]) / (m * b.weight)
        shift, goal = max(float(ratio.max()) / 0.05, 1e-12), 1e-3
        for _ in range(4):
            w.couple()
            w.model.info.compliance = w.compliance
            found = eq.relax(w.time, w.step, factor, shift, goal, MOST_SLIDES, w.model, w.matrix, b)
            if found < 0:
                return False
            state = self._state()
            if self._balance(factor) >= 0:
                return True
            self._back(state)
            shift *= goal
        return False

    # ------------------------------------------------------------------------------------------ by load steps

    def by_steps(self, targets: Array, *, whole: bool) -> None:
        """Land on every target; the start's unbalance fades out on the way, or before where targets are given."""
        w, b = self.work, self.work.balance
        w.probe(0.0)
        b.start[:] = b.r
        balanced = b.loop.unbalance == 0.0
        if not whole:
            if not self._advance(lambda s: (0.0, s), np.ones(1)):
                return
            balanced = True
            b.start[:] = 0.0
        if balanced:
            eq.unbalance(w.time, w.step, 0.0, 1.0, w.model, b, b.r)
            self._store_point(0.0)
        if not self._advance(lambda s: (s, s), targets):
            return
        self._end(1.0)
        by_energy = families.has_symmetric_stiffness(w.model) and not has_gyroscopic_forces(w)
        if self.unstable > 0 and self.slides == 0 and by_energy:
            if np.any(w.model.constraints["alone"]):
                self._start_lower(targets, whole=whole)
            else:
                self._follow_again(targets)

    def _start_lower(self, targets: Array, *, whole: bool) -> None:
        """Go over the targets again from where the start slides to under the whole load.

        Segments of fixed length far from their equilibrium have no stiffness across them but what unbalanced
        multipliers give: Newton's method may lead to one in which a thread stands on end.
        """
        w, b = self.work, self.work.balance
        state, kept = self._state(), (self.kept, self.marks, self.newton, self.message, self.unstable)
        b.y[:], b.la[:], w.model.switches[:] = self._start, 0.0, w.assembly.s
        self.kept, self.marks, self.newton, self.message, self.unstable = [], [], [], CARRIED, -1
        if self._slide(1.0):
            self.by_steps(targets, whole=whole)
        else:
            self._back(state)
            self.kept, self.marks, self.newton, self.message, self.unstable = kept

    def _follow_again(self, targets: Array) -> None:
        """Follow the path again from the last stable point on, with steps between which no direction becomes unstable.

        A step over a critical load may lead to another branch. Where the path itself becomes unstable, as that of a
        perfectly straight strut, it is followed on.
        """
        w, b = self.work, self.work.balance

        def falling_at(point: int) -> int:
            _, y, switches, la, *_ = self.kept[point]
            b.y[: w.n_q], b.la[:], w.model.switches[:] = y[: w.n_q], la, switches
            eq.unbalance(w.time, w.step, self.kept[point][0], 1.0, w.model, b, b.r)
            return w.falling_directions()

        first, last = 0, len(self.kept) - 1
        least = falling_at(first)
        if least < 0 or least >= self.unstable:
            falling_at(last)
            return
        while last - first > 1:
            middle = (first + last) // 2
            first, last = (middle, last) if falling_at(middle) <= least else (first, middle)
        step = 0.25 * (self.kept[last][0] - self.kept[first][0])
        falling_at(first)
        reached = self.kept[first][0]
        del self.kept[first:], self.newton[self.marks[first] :], self.marks[first:]
        self._store_point(reached)
        self.falling, self.message = least, CARRIED
        if self._advance(lambda s: (s, s), targets[targets > reached], reached, step):
            self._end(1.0)

    def _advance(
        self,
        at: Callable[[float], tuple[float, float]],
        targets: Array,
        reached: float = 0.0,
        step: float = FIRST_STEP,
    ) -> bool:
        """Go over the targets in steps that follow from how they converge; at(s) = (factor, share)."""
        step = min(step, float(targets[0]))
        for target in targets:
            while reached < target:
                if self.steps + self.rejected >= self.most:
                    return self._fail(at(reached)[0], f"{self.most} steps were not enough")
                lands = reached + step >= target * (1.0 - 1e-12)
                s = float(target) if lands else reached + step
                state = self._state()
                found = self._balance(*at(s))
                if found < 0 or (s - reached > CAREFUL and self._turned_over(state[0])):
                    self._back(state)
                    self.rejected += 1
                    step = 0.25 * (s - reached)
                    if step >= SMALLEST_STEP:
                        continue
                    if self.ranked is None and (ranked := for_free_motions(self.work)) is not None:
                        self.ranked = ranked
                        step = FIRST_STEP
                        continue
                    return self._leave_path(at, reached, s, state, found)
                if self.falling >= 0 and self._crosses(s - reached):
                    self._back(state)
                    self.rejected += 1
                    step = 0.25 * (s - reached)
                    continue
                self.steps += 1
                self._note(at(s)[0])
                reached = s
                step = max(step, 0.0) * (2.0 if found <= 5 else 1.0 if found <= 9 else 0.5)
                if at(s)[0] > 0.0 or at(s)[1] == 1.0:
                    self._store_point(at(s)[0])
        return True

    def _crosses(self, step: float) -> bool:
        """Whether the energy falls in more directions than before the step, which can still be cut."""
        falling = self.work.falling_directions()
        if falling > self.falling and step > SMALLEST_STEP:
            return True
        self.falling = max(falling, 0)
        return False

    def _leave_path(
        self, at: Callable[[float], tuple[float, float]], reached: float, s: float, state: Any, found: int
    ) -> bool:
        """Slide from the end of a path to another equilibrium under the whole load."""
        if not self._slide(at(1.0)[0]):
            self._back(state)
            return self._fail(at(reached)[0], self._failure_message(found, at(s)[0]))
        self._note(at(1.0)[0])
        self._store_point(at(1.0)[0])
        self.message = (
            f"no equilibrium path continues beyond load factor {at(reached)[0]:.4g}; the state moved to "
            "another equilibrium"
        )
        return True

    def _end(self, factor: float) -> None:
        """Say what is loose or unstable at the end."""
        w = self.work
        if factor < 1.0:
            return
        left = float(w.balance.loop.correction)
        if left > UNCERTAIN * self.tolerance:
            self.message += f"; round-off leaves it uncertain by {left:.1g} of its size"
        count, free = self._free_motions(factor)
        if count > 0:
            self.free = free
            eq.unbalance(w.time, w.step, factor, 1.0, w.model, w.balance, w.balance.r)
            if self.ranked is None and not np.any(w.balance.spin[:3]):
                count = null_vectors(w.tangent(0.0, 0.0), HELD).shape[1] or count
        elif not families.has_symmetric_stiffness(w.model):
            eq.unbalance(w.time, w.step, factor, 1.0, w.model, w.balance, w.balance.r)
            count, self.free = w.unsymmetric_free_motions()
        if count == 0:
            self._judge_stability()
        elif self.free:
            self.message += f"; nothing holds {_names(self.free)} against {_motions(count)}"

    def _judge_stability(self) -> None:
        """Whether the last state is stable: by its energy, or by the linear motion where that does not decide."""
        w = self.work
        if families.has_symmetric_stiffness(w.model):
            self.unstable = w.falling_directions()
            if self.unstable <= 0:
                return
            if not has_gyroscopic_forces(w):
                self.message += f"; it is unstable in {_ways(self.unstable)}"
                return
            self.unstable = -1
        poles = growing_motions(w)
        if poles is None:
            return
        self.unstable = len(poles)
        if len(poles):
            fastest = f"flutter at {poles[0].imag:.4g} rad/s" if poles[0].imag > 0.0 else "divergence"
            self.message += f"; it is unstable in {_ways(self.unstable)}: {fastest}"

    # ------------------------------------------------------------------------------------------ along an arc

    def along_an_arc(self, first: float) -> None:
        """From the equilibrium without load to a factor of 1."""
        w, b = self.work, self.work.balance
        w.probe(0.0)
        b.start[:] = b.r
        if not self._advance(lambda s: (0.0, s), np.ones(1)):
            return
        b.start[:] = 0.0
        self.kept.clear()
        self.marks.clear()
        self._store_point(0.0)
        state = self._state()
        if self._balance(1e-3 * first) < 0:
            self._fail(0.0, self._failure_message(eq.NO_CONVERGENCE, 1e-3 * first))
            return
        length = 1e3 * math.sqrt(float(np.mean((b.total / b.weight) ** 2)))
        if length == 0.0:
            if self._balance(1.0) < 0:
                self._fail(0.0, self._failure_message(eq.NO_CONVERGENCE, 1.0))
                return
            self._note(1.0)
            self._store_point(1.0)
            self._end(1.0)
            return
        rising = b.total.copy()
        self._back(state)
        longest, shortest = 4.0 * length, 1e-6 * length
        b.before[:] = rising
        while True:
            if self.steps + self.rejected >= self.most:
                self._fail(self.reached, f"{self.most} steps along the arc were not enough")
                return
            state, factor = self._state(), self.reached
            w.couple()
            w.model.info.compliance = w.compliance
            found = eq.follow(w.time, w.step, length, self.tolerance, MOST_ITERATIONS, w.model, w.matrix, b)
            sharp = found >= 0 and length > 1e2 * shortest and self._cosine(state[2]) < 0.5
            if found < 0 or sharp:
                self._back(state)
                b.loop.factor = factor
                self.rejected += 1
                length *= 0.5 if sharp else 0.25
                if length < shortest:
                    self._fail(factor, self._failure_message(int(found), factor))
                    return
                continue
            self.steps += 1
            now = float(b.loop.factor)
            if factor < 1.0 <= now:
                b.before[:] = b.total
                if self._balance(1.0) < 0:
                    self._fail(factor, self._failure_message(eq.NO_CONVERGENCE, 1.0))
                    return
                self.steps += 1
                self._note(1.0)
                self._store_point(1.0)
                self._end(1.0)
                return
            self._note(now)
            b.before[:] = b.total
            self._store_point(now)
            length = min(length * min(2.0, max(0.5, math.sqrt(4.0 / max(found, 1)))), longest)

    def _cosine(self, before: Array) -> float:
        b = self.work.balance
        p, q = b.total / b.weight, before / b.weight
        size = math.sqrt((p @ p) * (q @ q))
        return float(p @ q) / size if size > 0.0 else 1.0

    # ------------------------------------------------------------------------------------------ the end

    def _failure_message(self, code: int, factor: float) -> str:
        """Why a step failed, in words."""
        b = self.work.balance
        found, free = self._free_motions(self.reached)
        if found > 0 and (self.ranked is None or self.ranked.free == 0):  # else no force acts along what is free
            found, free = self._free_under_load(found, free)
            if free:
                self.free = free
                return f"nothing holds {_names(free)} against {_motions(found)}{self._acting(free)}"
        if code == eq.NOT_FINITE:
            return f"the state stopped being finite at load factor {factor:.6g}{self._hint()}"
        if code in (eq.SINGULAR, eq.UNBALANCED) or b.loop.quality < 1e-11:
            return f"the tangent is singular at load factor {factor:.6g}: a limit of the load, or something is not held"
        beyond = f"{self.reached:.6g}{self._hint()}"
        return (
            f"Newton's method does not converge beyond load factor {beyond}; arc_length may lead on, and `simulate` "
            f"follows what snaps in time"
        )

    def _free_under_load(self, count: int, free: list[str]) -> tuple[int, list[str]]:
        """Of motions that are free at the factor reached, and the parts that they move, those that no load holds."""
        w, la = self.work, self.work.balance.la.copy()
        if free and w.carry():
            count, under = self._free_motions(1.0)
            free = [name for name in free if name in under]
            w.balance.la[:] = la
            w.probe(self.reached)
        return count, free

    def _hint(self) -> str:
        """What may be wrong in the last equilibrium, in words; "" of nothing."""
        return hints_on(self.work.assembly, self.kept[-1][1] if self.kept else self._start)

    def _acting(self, free: list[str]) -> str:
        """Which loads act on parts that nothing holds, in words."""
        found = self.work.loads_on(free)
        if not found:
            return ""
        acts = "acts" if len(found) == 1 else "act"
        return f", on which {_names(found)} {acts} at t = {self.work.time:g} s (argument `time`)"

    def _fail(self, factor: float, why: str) -> bool:
        if not self.kept:  # a search that reaches nothing keeps where it stood
            self._store_point(factor)
        self.reached = factor
        self.status, self.message = "failed", why
        return False

    def solution(self, wall_time: float, compile_time: float) -> Solution:
        """Everything that was kept."""
        w, n = self.work, len(self.kept)
        out = empty(w.model, n)
        newton = np.array(self.newton, dtype=NEWTON).view(np.recarray)
        factor, loads, y = np.zeros(n), np.zeros((n, w.n_v)), np.zeros((n, w.balance.y.size))
        s = np.zeros((n, w.assembly.s.size), dtype=np.int64)
        for k, (own, state, switches, la, energies, weights, forces) in enumerate(self.kept):
            factor[k], y[k], s[k], loads[k] = own, state, switches, weights
            out.la[k], out.forces[k] = la, forces
            for name, value in zip(eb.ENERGIES, energies, strict=True):
                out.balance[name][k] = value
        for name in (*eb.WORK, *eb.LOSSES):  # a path of equilibria has none over time
            out.balance[name] = np.nan
        return Solution(
            assembly=w.assembly,
            method="static",
            t=np.full(n, w.time),
            y=y,
            s=s,
            status=self.status,
            message=self.message,
            statistics={
                "steps": self.steps,
                "rejected_steps": self.rejected,
                "iterations": int(w.balance.loop.iterations),
                "factorizations": int(w.balance.loop.factorizations),
                "slides": self.slides,
                "events": 0,
                "step": math.nan,
                "energy_defect": math.nan,
                "smallest_pivot": self.worst,
                "unbalanced_force": float(newton.force[-1]) if newton.size else math.nan,
                "unbalanced_moment": float(newton.moment[-1]) if newton.size else math.nan,
            },
            event_times=np.zeros(0),
            event_kinds=np.zeros(0, dtype=np.int64),
            wall_time=wall_time,
            compile_time=compile_time,
            kept=out,
            path=Path(factor, loads, w.balance.spin, self.free, self.unstable, newton),
        )


def _names(names: list[str]) -> str:
    return " and ".join(repr(name) for name in names[:4]) + (" and others" if len(names) > 4 else "")


def _ways(count: int) -> str:
    return "one way" if count == 1 else f"{count} ways"


def _motions(count: int) -> str:
    return "one motion" if count == 1 else f"{count} motions"
