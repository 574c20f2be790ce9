"""Observations of seams: sums over their nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from evolvent.assembly.references import split_reference
from evolvent.families.coordinates.observer import observe_coordinate
from evolvent.families.joints.observer import observe_joint, rows_of
from evolvent.results.observe.variables import Observed, Variable, cross, observer
from evolvent.results.observe.view import View

Array = np.ndarray


@observer("seams")
def observe_seam(view: View, name: str) -> Observed:
    """Force and moment of a whole seam, its angle, and torque and energy of the springs at its nodes.

    Notes
    -----
    Forces act on b, and angles are those of b as seen from a, also where b is the ground.
    """
    row, found = view.model.seams[view.index(name)], Observed()
    sign = float(row["sense"])
    numbers = [k for k in range(int(row["nodes"])) if f"{name} {k}" in view.assembly.names]
    joints = [observe_joint(view, f"{name} {k}").variables for k in numbers]
    x, force, moment = (
        np.stack([one[key].values for one in joints], axis=1) for key in ("position", "force", "moment")
    )
    for k in np.flatnonzero(np.isnan(x[0, :, 0])):  # of joints that hold directions alone
        x[:, k] = view.pose(int(view.model.joints["index"][rows_of(view, f"{name} {numbers[k]}")[0], 0])).x
    middle, force = x.mean(axis=1), sign * force
    found.vector("position", middle, "m", "middle of the nodes that are joined, inertial axes")
    found.vector("force", force.sum(axis=1), "N", "force on b, all nodes together, inertial axes")
    text = "moment of the joints on b about the middle of the nodes, without the torque of springs, inertial axes"
    whole = sign * moment + cross(x - middle[:, None], force)
    found.vector("moment", whole.sum(axis=1), "N m", text)
    found.along("node_force", "joined", force, "N", "force on b at each node, inertial axes")
    found.coordinate("joined", "joined", np.array(numbers), "1", "number of the node along the edge")
    found.plots = ["force"]
    if "angle" in joints[0]:
        part, on = split_reference(view.part(name).a)
        shares = view.assembly.parts[part].spread(part, on).shares[numbers]
        angle, rate = (sign * _stacked(joints, key) for key in ("angle", "rate"))
        text = "of b as seen from a, mean along the edge"
        found.scalar("angle", angle @ shares / shares.sum(), "rad", f"angle {text}, since the start")
        found.scalar("angle_range", np.ptp(angle, axis=1), "rad", "difference of the largest and the smallest angle")
        found.scalar("rate", rate @ shares / shares.sum(), "rad s-1", f"rate of the angle {text}")
        found.plots = ["angle", "force"]
    if row["sprung"]:
        springs = [observe_coordinate(view, f"{name} spring {k}").variables for k in numbers]
        for key, text in (
            ("torque", "torque of all springs, positive against the angle"),
            ("energy_elastic", "energy in all springs"),
        ):
            values = np.sum([one[key].values for one in springs], axis=0)
            found.scalar(key, sign * values if key == "torque" else values, springs[0][key].units, text)
        latched = np.mean([one["latched"].values for one in springs], axis=0)
        found.scalar("latched", latched, "1", "share of the nodes whose latches have locked")
        found.plots = ["angle", "torque"]
    return found


def _stacked(joints: Sequence[Mapping[str, Variable]], key: str) -> Array:
    """A variable of all joints, the second dimension."""
    return np.stack([one[key].values for one in joints], axis=1)
