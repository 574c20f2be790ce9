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
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers.alpha_start import accelerations_at
from evolvent.solvers.alpha_state import factor_at, short_c_mass


def applies(model: mdl.Model) -> bool:
    """Whether reactions are evaluated at the samples: with constraints, but without contacts and threads.

    Forces of contacts belong to a step, and springs of threads are not resolved by one.
    """
    joints = model.flexible.joints
    held = bool(np.any(joints["stiffness"] == 0.0))
    return held and not model.flexible.cylinders.size and not model.threads.size


def evaluate(model: mdl.Model, matrix: SparseBlocks, work: Any, count: int) -> None:
    """Write accelerations, multipliers and wrenches of the first `count` samples into the workspace's records."""
    f, c_mass = model.flexible, short_c_mass(work.options)
    A, la = np.zeros(work.dq.size), np.zeros(work.la.size)
    counted = int(work.loop.factorizations), float(work.loop.quality)
    for n in range(count):
        t, y = float(work.samples[n]), work.out_y[n]
        f.switches[:] = work.out_s[n]
        A[:], la[:] = work.out_a[n], 0.0
        residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
        if factor_at(t, y, la, c_mass, 0.0, c_mass * work.options.mass, model, matrix, work) != 0:
            continue  # singular there: what the method carries stays
        accelerations_at(t, y, model, matrix, work, A, la)
        if not (is_finite(A) and is_finite(la)):
            continue
        residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
        work.out_a[n], work.out_la[n] = A, la
        work.out_bodies[n] = model.bodies["F"]
    work.loop.factorizations, work.loop.quality = counted  # those of the steps
