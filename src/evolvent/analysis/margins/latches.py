"""How the run ends at a latch or a stop: time, rate, energy, peak load, and the load at the root."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.tables import Table
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import sides
from evolvent.results.observe import observe

if TYPE_CHECKING:
    from evolvent.solvers.solution import Solution


def latch_of(mechanism: Mechanism, table: Table, motion: Table | None, solution: Solution) -> dict[str, Any]:
    """What a run says of the end of a coordinate's travel.

    Parameters
    ----------
    table, motion : at rest, and along the run

    Returns
    -------
    dict
        time (s) and rate (rad/s or m/s) at the latch, or at the first sample at the end of the travel; energy (J) of
        the coordinate's motion there, by the inertia reflected to it; peak_load (N m or N) of the latch over all steps;
        joint, and root_force (N), root_moment (N m), its largest reactions at the samples from then on. Not a number
        where the run does not tell.
    """
    assembly, coordinate = mechanism.assembly, table.coordinate
    found: dict[str, Any] = {"time": np.nan, "rate": np.nan, "energy": np.nan, "peak_load": np.nan}
    found |= {"joint": "", "root_force": np.nan, "root_moment": np.nan}
    if math.isfinite(assembly.model.coordinates["latch"][coordinate.k]):
        seen = observe(solution, [coordinate.name])[coordinate.name].variables
        peak = "latch_torque_peak" if coordinate.angle else "latch_force_peak"
        last = {name: float(np.asarray(seen[name].values)[-1]) for name in ("latch_time", "latch_rate", peak)}
        if math.isfinite(last["latch_time"]):
            found |= {"time": last["latch_time"], "rate": last["latch_rate"], "peak_load": last[peak]}
    if math.isnan(found["time"]):
        n = 0 if motion is None else motion.time.size  # the first sample after those before the end
        if n >= solution.t.size:
            return found
        found["time"], found["rate"] = float(solution.t[n]), mechanism.rate(coordinate.k, solution, n)
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
