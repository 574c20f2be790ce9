"""How the run ends at a latch or a stop: time, rate, energy, peak load, and the load at the root."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.tables import MarginTable
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.constraints import ends_of_row, family_of
from evolvent.kernels import sides
from evolvent.model.registry import motions_of
from evolvent.results.observe import observe

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.solvers.common.solution import Solution

Array = np.ndarray


#: Variables of a part over time, by its name and theirs: (nt,) or (nt, 3).
Variables = Callable[[str], Mapping[str, Array]]


def of_solution(
    mechanism: Mechanism, table: MarginTable, motion: MarginTable | None, solution: Solution, *, held: bool
) -> dict[str, Any]:
    """What a run says of the end of a coordinate's travel, as `latch_of`.

    Parameters
    ----------
    table, motion : at rest, and along the run
    held : bool, whether the coordinate is held throughout the run
    """

    def variables(name: str) -> Mapping[str, Array]:
        return {key: np.asarray(v.values) for key, v in observe(solution, [name])[name].variables.items()}

    n = motion.behind if motion is not None else solution.t.size if held else 0
    arrival = math.nan, math.nan
    if n < solution.t.size:
        arrival = float(solution.t[n]), mechanism.rate(table.coordinate.k, solution, n)
    return latch_of(mechanism.assembly, table, solution.t, variables, arrival)


def of_tree(assembly: Assembly, table: MarginTable, run: xr.DataTree) -> dict[str, Any]:
    """What the results of a run say of the end of a coordinate's travel, as `latch_of`."""

    def variables(name: str) -> Mapping[str, Array]:
        return {str(key): v.values for key, v in run.children[name].data_vars.items()} if name in run.children else {}

    one, t = table.coordinate, np.asarray(run["time"].values)
    own = variables(one.name)
    x, arrival = own.get("angle" if one.angle else "travel"), (math.nan, math.nan)
    arrived = np.zeros(0) if x is None else np.flatnonzero(one.sense * (x - one.end) >= 0.0)
    if arrived.size:
        n = int(arrived[0])
        arrival = float(t[n]), float(own["rate"][n])
    return latch_of(assembly, table, t, variables, arrival)


def latch_of(
    assembly: Assembly, table: MarginTable, t: Array, variables: Variables, arrival: tuple[float, float]
) -> dict[str, Any]:
    """What a run says of the end of a coordinate's travel.

    Parameters
    ----------
    table : at rest
    t : (nt,) float, s
    variables : of the parts of the run
    arrival : time (s) and rate (rad/s or m/s) at the first sample at the end of the travel, NaN for none

    Returns
    -------
    dict
        time (s) and rate (rad/s or m/s) at the latch, or at the first sample at the end of the travel; energy (J) of
        the coordinate's motion there, by the inertia reflected to it; peak_load (N m or N) of the latch over all steps;
        joint, and root_force (N), root_moment (N m), its largest reactions at the samples from then on. Not a number
        where the run does not tell.
    """
    coordinate = table.coordinate
    found: dict[str, Any] = {"time": arrival[0], "rate": arrival[1], "peak_load": np.nan}
    found |= {"joint": "", "root_force": np.nan, "root_moment": np.nan}
    if math.isfinite(motions_of(assembly.model)["latch"][coordinate.k]):
        own, peak = variables(coordinate.name), "latch_torque_peak" if coordinate.angle else "latch_force_peak"
        time, rate, load = (_last(own, name) for name in ("latch_time", "latch_rate", peak))
        if math.isfinite(time):
            found |= {"time": time, "rate": rate, "peak_load": load}
    found["energy"] = 0.5 * float(table.inertia[-1]) * found["rate"] ** 2
    joint = _joint_of(assembly, coordinate.k)
    if joint and math.isfinite(found["time"]):
        reactions, after = variables(joint), t >= found["time"]
        found["joint"] = joint
        for key in ("force", "moment"):
            if key in reactions and np.any(after):
                found[f"root_{key}"] = float(np.linalg.norm(reactions[key][after], axis=-1).max())
    return found


def _last(variables: Mapping[str, Array], name: str) -> float:
    """The last value of a variable, NaN where there is none."""
    return float(np.atleast_1d(variables.get(name, np.nan))[-1])


def _joint_of(assembly: Assembly, k: int) -> str:
    """The joint between the two bodies of a coordinate, '' for none."""
    row = motions_of(assembly.model)[k]
    if row["on"] != sides.ON_BODY:
        return ""
    pair = {("bodies", int(row["body"])), ("bodies", int(row["other"]))}
    for index, name in enumerate(assembly.row_parts):
        ends = {*itertools.islice(ends_of_row(assembly.model, index), 2)}
        is_own = family_of(assembly.model, index)[0] == assembly.names[name][0]
        if is_own and ends == pair and not assembly.model.constraints["turns"][index]:
            return name
    return ""
