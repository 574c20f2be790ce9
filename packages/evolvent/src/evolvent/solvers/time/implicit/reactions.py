"""Accelerations and reactions at the samples of an implicit run, from the states of its steps alone.

The multipliers that generalized-alpha carries along oscillate from step to step where it damps little (spectral radius
near 1) and where steps change; the positions and velocities do not. Accelerations and multipliers therefore follow from
M v' + F + G^T la = 0 and g'' = 0: at the sample where nothing is stiff, else at both ends of its step, whose states are
in balance with stiff forces as interpolated ones are not, and between them on straight lines. For systems without beams
and penalties they are computed by the equations of explicit methods, whose matrix has rows for constraints only, unless
constraints are redundant: there joints share loads by their compliance.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numba import types, void

from evolvent import model as mdl
from evolvent.algebra.sparse import SPARSE, SparseBlocks
from evolvent.assembly import needs
from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.equations.rhs import rhs
from evolvent.kernels.ancf_beams import is_finite
from evolvent.model.family import EXPLICIT, some
from evolvent.model.registry import families, whole
from evolvent.solvers.common.redundancy import Ranks
from evolvent.solvers.time.implicit.alpha_start import forces_at
from evolvent.solvers.time.implicit.workspace import DONE, WORKSPACE

_I = types.int64
#: Part of a step by which the times of its ends lie inside it: loads that begin or end there are those within it.
_INSIDE = 1e-9


def applies(model: mdl.Model, options: Any) -> bool:
    """Whether reactions are evaluated at the samples: of adaptive steps of generalized-alpha, by forces of a state.

    Multipliers of fixed steps are of second order. Forces of contacts and of joints' friction belong to a step, and
    springs of threads are not resolved by one.
    """
    if options.midpoint or not (options.tolerance > 0.0 and is_held(model)):
        return False
    return not any(some(family.of_step, family.records(model)) for family in whole())


def has_stiffness(model: mdl.Model) -> bool:
    """Whether anything but constraints resists a change of shape."""
    for family in whole():
        found = family.records(model)
        if some(family.stiff, found) or any(np.any(law.which(found)) for law in family.laws if law.is_force):
            return True
    return False


def is_held(model: mdl.Model) -> bool:
    """Whether a model has constraints."""
    return bool(np.any(model.constraints["stiffness"] == 0.0))


def has_explicit_equations(model: mdl.Model) -> bool:
    """Whether the equations of explicit methods give the accelerations and multipliers of a model at all states.

    They do not for beams and threads, whose coordinates have rates of their own, for penalties, which have no
    multipliers there, and for kinds that explicit methods do not support.
    """
    present = [family for family in families().values() if family.records(model).size]
    if model.constraints["stiffness"].any() or any(one.explicit.rate or one.explicit.carried for one in present):
        return False
    return all(
        EXPLICIT in kind.solvers or not kind.mask(family.records(model)).any()
        for family in present
        for kind in family.kinds
    )


@dataclasses.dataclass(frozen=True, eq=False)
class PendingReactions:
    """Accelerations, multipliers and wrenches of a run's samples, evaluated for those that are asked for.

    Attributes
    ----------
    model, matrix, work : of the run
    ranks : redundancy.Ranks, with the compliance that joints had
    samples : (k,) int, the run's samples that are asked for
    done : (nt,) bool, of all samples of the run, which have been evaluated
    """

    model: mdl.Model
    matrix: SparseBlocks
    work: Any
    ranks: Ranks
    samples: np.ndarray
    done: np.ndarray

    def chosen(self, samples: Any) -> PendingReactions:
        """Those of some of the samples: (k,) bool, or indices."""
        return dataclasses.replace(self, samples=self.samples[samples])

    def evaluated(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations (k, nv), multipliers (k, nj) and forces (k, n) as `sampled.Sampled` holds them."""
        wanted = np.zeros(self.done.size, dtype=bool)
        wanted[self.samples] = True
        _evaluate(self, wanted & ~self.done)
        self.done[wanted] = True
        work = self.work
        return work.out_a[self.samples], work.out_la[self.samples], work.out_forces[self.samples]


def _evaluate(run: PendingReactions, wanted: np.ndarray) -> None:
    """Write accelerations, multipliers and wrenches of the samples `wanted`, (nt,) bool, into the workspace's records.

    A step is evaluated from its first sample, so that values do not depend on which samples are wanted. Where it cannot
    be, what the method carries stays.
    """
    model, matrix, work = run.model, run.matrix, run.work
    samples = np.flatnonzero(wanted)
    if not samples.size:
        return
    counted = int(work.loop.factorizations), float(work.loop.quality)
    stiff, ends, times = has_stiffness(model), work.end_times, work.samples[samples]
    steps = samples
    if stiff:
        begins = np.ones(wanted.size, dtype=bool)  # samples that are the first one of their step
        begins[1:] = np.any(ends[1 : wanted.size] != ends[: wanted.size - 1], axis=1)
        steps = np.maximum.accumulate(np.where(begins, np.arange(wanted.size), 0))[samples]
        times = ends[steps, 1] - _INSIDE * (ends[steps, 1] - ends[steps, 0])
    needs.load(model, evaluate_steps)
    rows = [
        np.zeros((2 if stiff else 1, size))
        for size in (work.out_a.shape[1], work.out_la.shape[1], 6 * model.bodies.size)
    ]
    dy = np.zeros(work.y.size if has_explicit_equations(model) else 0)
    ranks, reached = run.ranks.at(times), np.zeros(1, dtype=np.int64)
    for own in np.split(np.arange(samples.size), np.flatnonzero(np.diff(ranks)) + 1):
        run.ranks.use(int(ranks[own[0]]))
        by_rates = dy if model.info.redundant == 0 else dy[:0]
        left = own
        while left.size:
            try:
                evaluate_steps(samples[left], steps[left], reached, model, matrix, work, *rows, by_rates)
                break
            except Exception:  # noqa: BLE001  (of a user's law, which is evaluated beside the state as well)
                left = left[steps[left] > steps[left[reached[0]]]]
    run.ranks.use(-1)  # with which a run goes on
    work.loop.factorizations, work.loop.quality = counted  # those of the steps


@indirect(_I(REAL, VECTOR, mdl.MODEL, VECTOR, VECTOR, VECTOR), used_for=has_explicit_equations)
def solve_explicit_equations(t, state, model, dy, a, la):  # type: ignore[no-untyped-def]
    """Accelerations a and multipliers la at a state by the equations of explicit methods; 1 if finite, else 0."""
    rows, n_q = model.rows, model.info.nq
    rhs(t, state, model.switches, model, dy)
    for i in range(a.size):
        a[i] = dy[n_q + i]
    for r in range(rows.size):
        la[rows[r].index] = model.la[r]
    return 1 if is_finite(a) and is_finite(la) else 0


@inlined
def _evaluate_state(t, state, model, matrix, work, dy, a, la):  # type: ignore[no-untyped-def]
    """Accelerations a, multipliers la and forces at a state; returns whether they could be computed."""
    if dy.size > 0 and solve_explicit_equations(t, state, model, dy, a, la) != 0:
        return True
    return forces_at(t, state, model, matrix, work, a, la) == DONE


@indirect(void(INTEGERS, INTEGERS, INTEGERS, mdl.MODEL, SPARSE, WORKSPACE, MATRIX, MATRIX, MATRIX, VECTOR))
def evaluate_steps(  # type: ignore[no-untyped-def]
    samples, steps, reached, model, matrix, work, a, la, F, dy
):
    """Evaluate samples of steps: at the sample where a, la and F have one row, else at both ends of the step.

    Parameters
    ----------
    samples, steps : (n,) int, in order, and the first sample of the step of each
    reached : (1,) int, output: number of the one that is evaluated
    a, la, F : (1 or 2, ...) float, room for accelerations, multipliers and wrenches
    dy : (ny,) float, scratch, if the model has explicit equations (`has_explicit_equations`) and no redundant
        constraints, else (0,)
    """
    ends, bodies, found = len(a), model.bodies, False
    for i in range(len(samples)):
        n, first = samples[i], steps[i]
        reached[0] = i
        start, end = work.end_times[first, 0], work.end_times[first, 1]
        h, theta = end - start, 1.0
        if ends == 2 and h > 0.0:
            theta = min(max((work.samples[n] - start) / h, 0.0), 1.0)
        if i == 0 or first != steps[i - 1]:
            for k in range(len(model.switches)):
                model.switches[k] = work.out_s[first, k]
            found = True
            for e in range(ends):
                if ends == 1:
                    ok = _evaluate_state(work.samples[n], work.out_y[n], model, matrix, work, dy, a[e], la[e])
                else:
                    t = start + _INSIDE * h if e == 0 else end - _INSIDE * h
                    ok = _evaluate_state(t, work.ends[first, e], model, matrix, work, dy, a[e], la[e])
                found = found and ok
                for b in range(bodies.size):
                    for k in range(6):
                        F[e, 6 * b + k] = bodies[b].F[k]
        if found:
            last = ends - 1
            for k in range(a.shape[1]):
                work.out_a[n, k] = a[0, k] + theta * (a[last, k] - a[0, k])
            for k in range(la.shape[1]):
                work.out_la[n, k] = la[0, k] + theta * (la[last, k] - la[0, k])
            for k in range(F.shape[1]):
                work.out_forces[n, k] = F[0, k] + theta * (F[last, k] - F[0, k])
