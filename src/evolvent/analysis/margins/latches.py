"""How the run ends at a latch or a stop: time, rate, energy, peak load, and the load at the root."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins.tables import Table
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import sides
from evolvent.results.observe import observe

if TYPE_CHECKING:
    from evolvent.solvers.solution import Solution


def latch_of(assembly: Assembly, table: Table, solution: Solution) -> dict[str, Any]:
    """What a run says of the end of a coordinate's travel.

    Returns
    -------
    dict
        time (s) and rate (rad/s or m/s) at the latch, or at the first sample at the end of the travel; energy (J) of
        the coordinate's motion there, by the inertia reflected to it; peak_load (N m or N) of the latch over all steps;
        joint, and root_force (N), root_moment (N m), its largest reactions at the samples from then on. Not a number
        where the run does not tell.
    """
    coordinate = table.coordinate
    seen = observe(solution, [coordinate.name]).get(coordinate.name)
    found: dict[str, Any] = {"time": np.nan, "rate": np.nan, "energy": np.nan, "peak_load": np.nan}
    found |= {"joint": "", "root_force": np.nan, "root_moment": np.nan}
    if seen is None or not solution.t.size:
        return found
    variables = {name: np.asarray(v.values) for name, v in seen.variables.items()}
    x, rate = variables["angle" if coordinate.angle else "travel"], variables["rate"]
    found["time"] = float(variables["latch_time"][-1])
    if np.isfinite(found["time"]):
        found["rate"] = float(variables["latch_rate"][-1])
        found["peak_load"] = float(variables["latch_torque_peak" if coordinate.angle else "latch_force_peak"][-1])
    else:
        arrived = np.flatnonzero(coordinate.sense * (x - coordinate.end) >= 0.0)
        if not arrived.size:
            return found
        n = int(arrived[0])
        found["time"], found["rate"] = float(solution.t[n]), float(rate[n])
    found["energy"] = 0.5 * float(table.inertia[-1]) * found["rate"] ** 2
    joint = _joint_of(assembly, coordinate.k)
    if joint:
        reactions = observe(solution, [joint])[joint].variables
        after = solution.t >= found["time"]
        found["joint"] = joint
        for key in ("force", "moment"):
            if key in reactions and np.any(after):
                size = np.linalg.norm(np.asarray(reactions[key].values)[after], axis=-1)
                found[f"root_{key}"] = float(size.max())
    return found


def _joint_of(assembly: Assembly, k: int) -> str:
    """The joint between the two bodies of a coordinate, '' for none."""
    row = assembly.model.coordinates[k]
    if row["on"] != sides.ON_BODY:
        return ""
    pair = {int(row["body"]), int(row["other"])}
    for index, name in enumerate(assembly.joint_parts):
        one = assembly.model.joints[index]
        both = one["on"][0] == sides.ON_BODY and one["on"][1] == sides.ON_BODY
        if both and {int(one["index"][0]), int(one["index"][1])} == pair and assembly.names[name][0] == "joints":
            return name
    return ""
