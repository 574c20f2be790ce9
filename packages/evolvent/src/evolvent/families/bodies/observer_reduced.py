"""Observations of reduced flexible bodies: motion of frame and interface nodes, modes, interface loads."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.families import bodies_of
from evolvent.families.bodies.observer import attitude
from evolvent.families.joints.observer import reactions
from evolvent.results.observe.shapes import solids_of
from evolvent.results.observe.variables import Observed, Variable, norm, observer, turned_back
from evolvent.results.observe.view import View

Array = np.ndarray
#: Rows of the family `joints` of each interface node.
_ROWS = 6


@observer("reduced_bodies")
def observe_reduced(view: View, name: str) -> Observed:
    """Motion of the frame, displacements, rotations and loads of the interface nodes, modal coordinates, energies.

    Notes
    -----
    Displacements and rotations are those against the undeformed body that moves with the frame, in the axes of the
    model. Forces and moments are those of the flexible body on what is attached to its node. It is drawn as the box of
    uniform density that has the mass and the moments of inertia of the body, and moves with the frame.
    """
    index, part, found = view.index(name), view.part(name), Observed()
    frame, *nodes = bodies_of(view.model, "reduced_bodies", index)
    row, pose, axes = view.model.reduced_bodies[index], view.pose(frame), part.axes
    found.vector("position", pose.x, "m", "position of the frame, the centre of mass undeformed, inertial axes")
    text = "attitude of the frame, quaternion from the axes of the model to inertial axes, scalar first, without jumps"
    found.variables["attitude"] = Variable(("time", "quaternion"), attitude(view, view.model.bodies[frame]), "1", text)
    found.vector("velocity", pose.v, "m s-1", "velocity of the frame, inertial axes")
    found.vector("rate", turned_back(pose.R, pose.w), "rad s-1", "angular velocity of the frame, its axes")
    found.coordinate("interface", "interface", np.array(part.model.names), "1", "names of the interface nodes")
    x = view.poses(nodes).x
    found.along("interface_position", "interface", x, "m", "positions of the interface nodes, inertial axes")
    q = view.coordinates(int(row["iq"]), int(row["modes"]))
    moved = (q @ axes.shapes[: 6 * len(nodes)].T).reshape(len(q), len(nodes), 6)
    words = "of the interface nodes against the frame, axes of the model"
    found.along("displacement", "interface", moved[..., :3], "m", f"displacements {words}")
    found.along("rotation", "interface", moved[..., 3:], "rad", f"rotations {words}")
    rows = view.joint_rows[name]
    held = [reactions(view, rows[_ROWS * k :][:_ROWS]) for k in range(len(nodes))]
    words = "of the body on what is attached to each interface node, inertial axes"
    found.along("force", "interface", np.stack([one.force for one in held], axis=1), "N", f"force {words}")
    found.along("moment", "interface", np.stack([one.moment for one in held], axis=1), "N m", f"moment {words}")
    found.coordinate("frequency", "mode", np.sqrt(axes.square) / (2.0 * np.pi), "Hz", "frequency of the free mode")
    found.along("mode_amplitude", "mode", q, "m", "coordinates of the free modes, root mean square displacement")
    found.results("reduced_bodies", view.fields["reduced_bodies"], index)
    text = "rate of the frame over the lowest frequency with one node held, which must stay well below 1"
    found.scalar("spin_ratio", norm(pose.w) / axes.held, "1", text)
    solids = solids_of(view, name, view.model.bodies[frame])
    found.drawn = [{"frame": {"origin": "position", "attitude": "attitude", "solids": solids}}]
    found.plots = ["displacement", "rate"]
    return found
