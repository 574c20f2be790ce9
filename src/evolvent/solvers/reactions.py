"""Accelerations and reactions at the samples of an implicit run, from the states of its steps alone.

The multipliers that generalized-alpha carries along oscillate from step to step where it damps little (spectral radius
near 1) and where steps change; the positions and velocities do not. Accelerations and multipliers therefore follow from
M v' + F + G^T la = 0 and g'' = 0: at the sample where nothing is stiff, else at both ends of its step, whose states are
in balance with stiff forces as interpolated ones are not, and between them on straight lines.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers.alpha_start import forces_at
from evolvent.solvers.implicit_state import DONE


def applies(model: mdl.Model, options: Any) -> bool:
    """Whether reactions are evaluated at the samples: of adaptive steps of generalized-alpha, no contacts, no threads.

    Multipliers of fixed steps are of second order. Forces of contacts and of joints' friction belong to a step, and
    springs of threads are not resolved by one.
    """
    if (
        np.any(model.coordinates["friction"] > 0.0)
        or model.resistances.size
        or model.drivetrains.size
        or options.midpoint
    ):
        return False
    if model.bearings.size:
        return False
    return bool(options.tolerance > 0.0) and is_held(model) and _without_contacts(model) and not model.threads.size


def _without_contacts(model: mdl.Model) -> bool:
    return not model.contact_surfaces.size and not model.body_contacts.size


def has_stiffness(model: mdl.Model) -> bool:
    """Whether anything but constraints resists a change of shape."""
    stiff = (
        model.elements.size
        + model.rods.size
        + model.coordinates.size
        + model.custom_forces.size
        + model.springs.size
        + model.modes.size
    )
    return bool(stiff) or bool(np.any(model.joints["stiffness"] > 0.0))


def is_held(model: mdl.Model) -> bool:
    """Whether a model has constraints."""
    return bool(np.any(model.joints["stiffness"] == 0.0))


@dataclasses.dataclass(frozen=True, eq=False)
class Pending:
    """Accelerations, multipliers and wrenches of a run's samples, evaluated for those that are asked for.

    Attributes
    ----------
    model, matrix, work : of the run
    use_rank : gives the model the compliance that its joints had at a time (`redundancy.Ranks.use`)
    samples : (k,) int, the run's samples that are asked for
    done : (nt,) bool, of all samples of the run, which have been evaluated
    """

    model: mdl.Model
    matrix: SparseBlocks
    work: Any
    use_rank: Callable[[float], None]
    samples: np.ndarray
    done: np.ndarray

    def chosen(self, samples: Any) -> Pending:
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


def _evaluate(run: Pending, wanted: np.ndarray) -> None:
    """Write accelerations, multipliers and wrenches of the samples `wanted`, (nt,) bool, into the workspace's records.

    A step is evaluated from its first sample, so that values do not depend on which samples are wanted.
    """
    model, matrix, work = run.model, run.matrix, run.work
    counted = int(work.loop.factorizations), float(work.loop.quality)
    stiff, ends = has_stiffness(model), work.end_times[: wanted.size]
    begins = np.ones(wanted.size, dtype=bool)  # samples that are the first one of their step
    if stiff and wanted.size:
        begins[1:] = np.any(ends[1:] != ends[:-1], axis=1)
    first_of_step = np.maximum.accumulate(np.where(begins, np.arange(wanted.size), 0))
    step, found = -1, list[tuple[np.ndarray, np.ndarray, np.ndarray] | None]()
    for n in np.flatnonzero(wanted).tolist():
        t, first_sample = float(work.samples[n]), int(first_of_step[n])
        start, end = ends[first_sample].tolist()
        h = end - start
        theta = 1.0 if h <= 0.0 or not stiff else min(max((t - start) / h, 0.0), 1.0)
        if step != first_sample:
            step = first_sample
            run.use_rank(t if not stiff else end - 1e-9 * h)
            model.switches[:] = work.out_s[step]
            states = [(t, work.out_y[n])]
            if stiff:  # loads that begin or end with the step are those within it
                states = [(start + 1e-9 * h, work.ends[step, 0]), (end - 1e-9 * h, work.ends[step, 1])]
            carried = work.out_a[step].copy()
            found = [_evaluated(time, y, carried, model, matrix, work) for time, y in states]
        first, last = found[0], found[-1]
        if first is None or last is None:
            continue  # what the method carries stays
        for kept, a, b in zip((work.out_a, work.out_la, work.out_forces), first, last, strict=True):
            kept[n, : a.size] = a + theta * (b - a)
    work.loop.factorizations, work.loop.quality = counted  # those of the steps


def _evaluated(
    t: float, y: np.ndarray, a: np.ndarray, model: mdl.Model, matrix: SparseBlocks, work: Any
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Accelerations, multipliers and wrenches of a state; None where they cannot be found."""
    A, la = a.copy(), np.zeros(work.la.size)
    try:
        if forces_at(t, y, model, matrix, work, A, la) != DONE:
            return None
    except Exception:  # noqa: BLE001  (of a user's law, which is evaluated beside the state as well)
        return None
    return A, la, np.asarray(model.bodies["F"]).flatten()  # the first ones of `work.out_forces`
