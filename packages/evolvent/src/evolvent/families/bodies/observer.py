"""Observations of bodies and point masses."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.families.joints.observer import reactions
from evolvent.kernels import rigid
from evolvent.model import RESULTS
from evolvent.results.observe.shapes import solids_of
from evolvent.results.observe.variables import Observed, Variable, cross, dot, norm, observer, turned_back
from evolvent.results.observe.view import View
from evolvent.results.rotations import quaternions

Array = np.ndarray


@observer("bodies")
def observe_body(view: View, name: str) -> Observed:
    """Position, attitude, velocity and rate of a rigid body; momenta and energy of one that moves.

    Notes
    -----
    Of a free body, linear momentum m v, angular momentum about the centre of mass R J R^T w and energy
    (m v.v + w.J w)/2. Of a spinning body the angular momentum about its axis a, (a.J a) times its rate, and the energy
    of that. A driven body has neither: its motion is given, and no balance counts it.
    """
    index = view.index(name)
    row, pose, found = view.model.bodies[index], view.pose(index), Observed()
    found.vector("position", pose.x, "m", "position of the centre of mass, inertial axes")
    text = "attitude, quaternion from body to inertial axes, scalar first, without jumps"
    found.variables["attitude"] = Variable(("time", "quaternion"), attitude(view, row), "1", text)
    found.vector("velocity", pose.v, "m s-1", "velocity of the centre of mass, inertial axes")
    own = turned_back(pose.R, pose.w)
    found.vector("rate", own, "rad s-1", "angular velocity, body axes")
    angle = view.angle(index)
    if angle is not None:
        found.scalar("angle", angle, "rad", "angle about its axis, over any number of turns")
    if row["motion"] == rigid.FREE:
        axis = pose.R @ row["axis"]
        tilt = np.arctan2(norm(cross(axis[:1], axis)), dot(axis[:1], axis))
        found.scalar("tilt", tilt, "rad", "angle of its axis from that at the start")
    if row["motion"] != rigid.DRIVEN:
        free = bool(row["motion"] == rigid.FREE)
        found.results("bodies", view.fields["bodies"], index, {"angular"} if free else {"linear", "angular"})
        variable, unit, text = RESULTS["bodies"]["angular"]
        spin = view.fields["bodies"]["angular"][:, index]
        found.vector(variable, spin, unit, text.format(about="the centre of mass" if free else "its axis"))
    rows = view.joint_rows.get(name, [])
    if rows:
        held = reactions(view, rows)
        found.vector("force", -held.force, "N", "force that fixes the body to its node, inertial axes")
        text = "moment about the node that fixes the body to it, inertial axes"
        found.vector("moment", -held.moment, "N m", text)
    solids = solids_of(view, name, row)
    found.drawn = [{"frame": {"origin": "position", "attitude": "attitude", "solids": solids}}]
    found.plots = ["rate"]
    if row["iq"] >= 0 and angle is None:
        found.plots.append("position")
    return found


def attitude(view: View, row: Any) -> Array:
    """Quaternion (nt, 4) of a body, which turns on over any number of turns without a change of sign."""
    if row["motion"] == rigid.FREE:
        return view.attitude_of(row)
    angle = view.y[:, int(row["iq"])] if row["motion"] == rigid.SPIN else row["rate"] * view.t
    start = quaternions(row["R0"])
    w, u = np.cos(0.5 * angle), np.sin(0.5 * angle)[:, None] * row["axis"]
    scalar = start[0] * w - u @ start[1:]
    vector = w[:, None] * start[1:] + start[0] * u + np.cross(start[1:], u)
    return np.concatenate([scalar[:, None], vector], axis=1)


@observer("points")
def observe_point(view: View, name: str) -> Observed:
    """Position, velocity, momentum and energy of a point mass; the force that holds it, where it is fixed to a part."""
    index, found = view.index(name), Observed()
    row = view.model.points[index]
    x, v = view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"]))
    found.vector("position", x, "m", "position, inertial axes")
    found.vector("velocity", v, "m s-1", "velocity, inertial axes")
    found.scalar("speed", norm(v), "m s-1", "speed")
    found.results("points", view.fields["points"], index)
    found.drawn = [{"marks": {"points": ["position"]}}]
    found.plots = ["position"]
    rows = view.joint_rows.get(name, [])
    if rows:
        found.vector("force", reactions(view, rows).force, "N", "force that fixes the point mass, inertial axes")
    return found
