"""Accelerations and reactions at the samples of an implicit run, from the states of its steps alone.

The multipliers that generalized-alpha carries along oscillate from step to step where it damps little (spectral radius
near 1) and where steps change; the positions and velocities do not. Accelerations and multipliers therefore follow from
M v' + F + G^T la = 0 and g'' = 0: at the sample where nothing is stiff, else at both ends of its step, whose states are
in balance with stiff forces as interpolated ones are not, and between them on straight lines.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.flow.implicit import residual
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers.alpha_start import accelerations_at
from evolvent.solvers.alpha_state import SHORT, factor_at


def applies(model: mdl.Model, options: Any) -> bool:
    """Whether reactions are evaluated at the samples: of adaptive steps of generalized-alpha, no contacts, no threads.

    Multipliers of fixed steps are of second order. Forces of contacts and of joints' friction belong to a step, and
    springs of threads are not resolved by one.
    """
    if np.any(model.coordinates["friction"] > 0.0) or options.midpoint:
        return False
    return bool(options.tolerance > 0.0) and is_held(model) and _without_contacts(model) and not model.threads.size


def _without_contacts(model: mdl.Model) -> bool:
    return not model.contact_surfaces.size and not model.body_contacts.size


def has_stiffness(model: mdl.Model) -> bool:
    """Whether anything but constraints resists a change of shape."""
    stiff = (
        model.elements.size + model.rods.size + model.coordinates.size + model.custom_forces.size + model.springs.size
    )
    return bool(stiff) or bool(np.any(model.joints["stiffness"] > 0.0))


def is_held(model: mdl.Model) -> bool:
    """Whether a model has constraints."""
    return bool(np.any(model.joints["stiffness"] == 0.0))


def evaluate(model: mdl.Model, matrix: SparseBlocks, work: Any, count: int, use_rank: Callable[[float], None]) -> None:
    """Write accelerations, multipliers and wrenches of the first `count` samples into the workspace's records.

    Parameters
    ----------
    use_rank : gives the model the compliance that its joints had at a time (`redundancy.Ranks.use`)
    """
    counted = int(work.loop.factorizations), float(work.loop.quality)
    at, stiff = np.full(2, np.nan), has_stiffness(model)
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray] | None] = []
    for n in range(count):
        t, times = float(work.samples[n]), work.end_times[n]
        h = float(times[1] - times[0])
        theta = 1.0 if h <= 0.0 or not stiff else min(max((t - float(times[0])) / h, 0.0), 1.0)
        if not stiff or not np.array_equal(at, times):  # of the next step
            at = times
            use_rank(t if not stiff else float(at[1]) - 1e-9 * h)
            model.switches[:] = work.out_s[n]
            states = [(t, work.out_y[n])]
            if stiff:  # loads that begin or end with the step are those within it
                states = [(at[0] + 1e-9 * h, work.ends[n, 0]), (at[1] - 1e-9 * h, work.ends[n, 1])]
            found = [_evaluated(time, y, work.out_a[n], model, matrix, work) for time, y in states]
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
    A, la, c_mass = a.copy(), np.zeros(work.la.size), SHORT / float(work.options.span) ** 2
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    if factor_at(t, y, la, c_mass, 0.0, c_mass * work.options.mass, model, matrix, work) != 0:
        return None  # singular there
    try:
        accelerations_at(t, y, model, matrix, work, A, la)
    except Exception:  # noqa: BLE001  (of a user's law, which it evaluates beside the state as well)
        return None
    if not (np.all(np.isfinite(A)) and np.all(np.isfinite(la))):
        return None
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    return A, la, model.bodies["F"].ravel()  # the first ones of `work.out_forces`
