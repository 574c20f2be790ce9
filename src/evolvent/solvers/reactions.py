"""Accelerations and reactions at the samples of an implicit run, from the states alone.

The multipliers that generalized-alpha carries along oscillate from step to step where it damps little (spectral radius
near 1) and where steps change; the positions and velocities do not. At the samples accelerations and multipliers
therefore follow from M v' + F + G^T la = 0 and g'' = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.flow.implicit import residual
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers.alpha_start import accelerations_at
from evolvent.solvers.alpha_state import SHORT, factor_at


def applies(model: mdl.Model, *, adaptive: bool) -> bool:
    """Whether reactions are evaluated at the samples: of adaptive steps, without contacts and threads.

    Multipliers of fixed steps are of second order. Forces of contacts belong to a step, and springs of threads are not
    resolved by one.
    """
    return adaptive and is_held(model) and not model.flexible.cylinders.size and not model.threads.size


def is_held(model: mdl.Model) -> bool:
    """Whether a model has constraints."""
    return bool(np.any(model.flexible.joints["stiffness"] == 0.0))


def evaluate(model: mdl.Model, matrix: SparseBlocks, work: Any, count: int) -> None:
    """Write accelerations, multipliers and wrenches of the first `count` samples into the workspace's records."""
    f, c_mass = model.flexible, SHORT / float(work.options.span) ** 2
    A, la = np.zeros(work.dq.size), np.zeros(work.la.size)
    counted = int(work.loop.factorizations), float(work.loop.quality)
    for n in range(count):
        t, y = float(work.samples[n]), work.out_y[n]
        f.switches[:] = work.out_s[n]
        A[:], la[:] = work.out_a[n], 0.0
        residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
        if factor_at(t, y, la, c_mass, 0.0, c_mass * work.options.mass, model, matrix, work) != 0:
            continue  # singular there: what the method carries stays
        try:
            accelerations_at(t, y, model, matrix, work, A, la)
        except Exception:  # noqa: BLE001  (of a user's law, which it evaluates beside the sample as well)
            continue
        if not (np.all(np.isfinite(A)) and np.all(np.isfinite(la))):
            continue
        residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
        work.out_a[n], work.out_la[n] = A, la
        work.out_bodies[n] = model.bodies["F"]
    work.loop.factorizations, work.loop.quality = counted  # those of the steps
