"""A case under the general engine, whose adaptive method stands beside the fixed steps of the batches."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from evolvent import cases, parts
from evolvent.batch.rates import N_STATE
from evolvent.errors import RunFailed, in_keys, naming_keys
from evolvent.model import DISSIPATED
from evolvent.motion import rotation_matrices
from evolvent.solvers import solve
from evolvent.system import System

if TYPE_CHECKING:
    from evolvent.systems.inertia_stand.prepare import Prepared


def build(item: Prepared) -> System:
    """The case composed from a body and springs."""
    given, stand = item.suspended, item.stand
    system = System(gravity=given.gravity.tolist())
    body = system.add(
        parts.RigidBody(
            mass=given.mass,
            inertia=given.inertia.tolist(),
            position=given.state[:3].tolist(),
            orientation=given.state[3:7].tolist(),
            velocity=given.state[7:10].tolist(),
            angular_velocity=(rotation_matrices(given.state[3:7]).T @ given.state[10:13]).tolist(),
        ),
        name="body",
    )
    for k in range(len(given.stiffness)):
        system.add(
            parts.Spring(
                a=tuple(given.ground[k]),
                b=(body, tuple(given.attachment[k])),
                stiffness=float(given.stiffness[k]),
                damping=float(given.damping[k]),
                length=float(given.length[k]),
                lateral_stiffness=float(given.lateral_stiffness[k]),
                lateral_damping=float(given.lateral_damping[k]),
                axis=tuple(given.axis[k]),
            )
        )
    if stand.support == "guided":
        system.add(parts.Guide(body=body, direction=(1.0, 0.0, 0.0)))
        system.add(parts.Guide(body=body, direction=(0.0, 0.0, 1.0)))
        system.add(parts.Guide(body=body, direction=(0.0, 0.0, 1.0), axis=(1.0, 0.0, 0.0)))
    return system


def integrate(
    item: Prepared, progress: Callable[[float], None] | None
) -> tuple[np.ndarray, dict[str, float], float, float]:
    """States (samples, 14) as of `evolvent.batch`, statistics, times of the solve and of compilation, s.

    Raises
    ------
    RunFailed
        If the solver did not reach the end.
    """
    sensors, solver = item.case.sensors, item.case.solver
    assembly = build(item).assemble()
    keys = cases.solver_keys(item.case)
    with naming_keys(keys):
        solution = solve(
            assembly,
            samples=np.arange(sensors.samples) / sensors.rate,
            method=solver.method,
            rtol=solver.rtol,
            atol=solver.atol,
            progress=progress,
        )
    if not solution.success:
        raise RunFailed(in_keys(solution.message, keys), None)
    states = np.empty((len(solution.t), N_STATE))
    states[:, :10] = solution.y[:, :10]
    own = solution.y[:, 10:13]
    states[:, 10:13] = np.einsum("tij,tj->ti", rotation_matrices(states[:, 3:7]), own)
    accounts = int(assembly.model.info.nq + assembly.model.info.nv)
    states[:, 13] = solution.y[:, accounts + DISSIPATED]
    return states, dict(solution.statistics), solution.wall_time, solution.compile_time
