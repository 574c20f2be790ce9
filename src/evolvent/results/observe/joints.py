"""Observations of joints, links and guides: reactions, angles and travels.

A multiplier la acts on side b with the force -la g_b, where g_b is the gradient of the constraint; of a direction u_b
held against u_a, with the moment -la u_b x u_a.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.references import split_reference
from evolvent.kernels import joint as kernels
from evolvent.kernels import sides
from evolvent.kernels.constraint_rows import CENTRE
from evolvent.results.observe.gears import observe_gear
from evolvent.results.observe.variables import Observed, cross, dot, norm, turned, unwrapped
from evolvent.results.observe.view import Side, View

Array = np.ndarray


class Reaction(NamedTuple):
    """What joint rows do to their second side.

    Attributes
    ----------
    force, moment : (nt, 3) float, N and N m, inertial axes; the moment about `position`
    position : (nt, 3) float, m, at which the force acts; NaN where the rows hold directions alone
    energy : (nt,) float, J, of penalties
    """

    force: Array
    moment: Array
    position: Array
    energy: Array


def rows_of(view: View, name: str) -> list[int]:
    """Rows of the family `joints` that a part has written."""
    return view.joint_rows.get(name, [])


def acts(view: View, row: Any) -> Array:
    """Whether a joint's row holds at each sample, (nt,): explicit methods release it at `until`, others just after."""
    found: Array = view.t < row["until"] if view.explicit else view.t <= row["until"]
    if row["switch"] >= 0:
        found = found & (view.s[:, int(row["switch"])] == 0)
    return found


def reactions(view: View, rows: list[int]) -> Reaction:
    """Force and moment of joint rows on their second side, and their energy."""
    n = view.t.size
    force, moment, position, energy = np.zeros((n, 3)), np.zeros((n, 3)), np.full((n, 3), np.nan), np.zeros(n)
    for k in rows:
        row, la = view.model.flexible.joints[k], view.solution.la[:, k]
        if row["kind"] == kernels.ANGLE:
            index = int(row["index"][1])
            moment -= la[:, None] * turned(view.pose(index).R, view.model.bodies["axis"][index])
            position = view.pose(index).x
            continue
        is_point = bool(row["kind"] != kernels.DIRECTION)
        a, b = (view.side(row, which, is_point=is_point) for which in (0, 1))
        if not is_point:
            within = row["on"][0] == sides.ON_NODE and row["iq"][0] == row["iq"][1]  # a section keeps its shape
            moment -= 0.0 if within else la[:, None] * cross(b.u, a.u)
            gap = dot(a.u, b.u)
        elif row["kind"] == kernels.ALONG:
            along = view.side(row, 2, is_point=False).u
            gap = dot(along, b.u - a.u)
            if row["on"][0] == sides.ON_NODE:  # of directions
                moment -= la[:, None] * cross(b.u, along)
            else:
                force -= la[:, None] * along
                position = b.u
        else:
            along = row["along"] if row["kind"] == kernels.POINT else (b.u - a.u) / norm(b.u - a.u)[:, None]
            force -= la[:, None] * along
            position = b.u
            gap = dot(b.u - a.u, along)
        if row["stiffness"] > 0.0:
            energy += np.where(acts(view, row), 0.5 * row["stiffness"] * (gap - row["value"]) ** 2, 0.0)
    return Reaction(force, moment, position, energy)


def observe_joint(view: View, name: str) -> Observed:
    """Reaction force and moment, angle or travel of a joint or of a prescribed motion."""
    part, rows, found = view.part(name), rows_of(view, name), Observed()
    joints = view.model.flexible.joints
    if joints["kind"][rows[0]] == kernels.GEAR:
        return observe_gear(view, name, joints[rows[0]], acts(view, joints[rows[0]]))
    row, sign = joints[rows[0]], -1.0 if _is_turned_round(view, name) else 1.0
    reaction = reactions(view, rows)
    on = _called(next(getattr(part, key) for key in ("b", "at", "body") if hasattr(part, key)))
    found.vector("force", sign * reaction.force, "N", f"force of the joint on {on}, inertial axes")
    found.vector(
        "moment",
        sign * reaction.moment,
        "N m",
        f"moment of the joint on {on} about the joint's position, inertial axes",
    )
    found.vector("position", reaction.position, "m", "position of the joint, inertial axes")
    found.scalar("closed", acts(view, row), "1", "1 while the joint holds, 0 once it is released")
    if np.any(joints["stiffness"][rows] > 0.0):
        found.scalar("energy_elastic", reaction.energy, "J", "elastic energy of the penalties that hold the joint")
    found.drawn = [{"marks": {"points": ["position"]}}, {"forces": {"points": "position", "vectors": "force"}}]
    found.plots = ["force", "moment"] if _restrains_rotation(joints[rows]) else ["force"]
    if row["kind"] == kernels.ANGLE:
        _observe_rotation(view, row, reaction.moment, found)
    elif row["kind"] == kernels.DISTANCE:
        a, b = (view.side(row, which, is_point=True) for which in (0, 1))
        found.scalar("length", norm(b.u - a.u), "m", "distance of the two ends")
        tension = dot(reaction.force, (a.u - b.u) / norm(a.u - b.u)[:, None])
        found.scalar("tension", tension, "N", "tension between the two ends, positive where it pulls")
        found.plots = ["tension"]
    elif row["path"] == kernels.LINEAR:
        a, b = (view.side(row, which, is_point=True) for which in (0, 1))
        found.scalar("travel", (b.u - a.u) @ row["along"], "m", "travel along the direction of the drive")
        found.plots = ["travel", "force"]
    elif row["path"] == kernels.INVOLUTE:
        found.scalar(
            "angle", _wound(view, row), "rad", "angle of the thread wound onto the circle, of where the end is"
        )
        found.plots = ["angle", "force"]
    elif getattr(part, "type", "") == "revolute":
        turn = revolute(view, rows)
        if turn is not None:
            text = "of b against a about the joint's axis"
            found.scalar("angle", sign * turn[0], "rad", f"angle {text} since the start, over any number of turns")
            found.scalar("rate", sign * turn[1], "rad s-1", f"rate {text}")
            found.plots = ["angle"]
    return found


def _restrains_rotation(rows: Array) -> bool:
    """Whether rows of a joint hold directions, so that the joint transmits a moment."""
    of_sections = (rows["kind"] == kernels.ALONG) & (rows["on"][:, 0] == sides.ON_NODE)
    return bool(np.any((rows["kind"] == kernels.DIRECTION) | of_sections))


def _called(place: Any) -> str:
    """A point as texts call it."""
    if isinstance(place, str):
        return place
    return str(place[0]) if isinstance(place[0], str) else "the ground"


def _is_turned_round(view: View, name: str) -> bool:
    """Whether a joint's rows have its ends the other way round: a body is always their first side."""
    part, row = view.part(name), view.model.flexible.joints[rows_of(view, name)[0]]
    if tuple(row["on"][:2]) != (sides.ON_BODY, sides.ON_COORDINATES) or getattr(part, "a", None) is None:
        return False
    if not isinstance(part.a, str):
        return False
    return bool(view.assembly.names[split_reference(part.a)[0]][0] not in ("bodies", "rods"))


def _observe_rotation(view: View, row: Any, moment: Array, found: Observed) -> None:
    """A spinning body that a drive turns."""
    index = int(row["index"][1])
    axis = turned(view.pose(index).R, view.model.bodies["axis"][index])
    found.scalar("angle", view.y[:, int(row["iq"][1])], "rad", "angle of the body about its axis")
    found.scalar("rate", view.y[:, int(row["iv"][1])], "rad s-1", "rate of the body about its axis")
    found.scalar("torque", dot(moment, axis), "N m", "torque of the drive on the body about its axis")
    found.plots = ["torque"]


def _wound(view: View, row: Any) -> Array:
    """Angle by which the thread of an involute is wound, of where its end is, rad; NaN once it is released.

    Notes
    -----
    With the free part s = sqrt(d^2 - r^2), d the end's distance from the circle's axis: (length - s)/r.
    """
    arm = view.side(row, 1, is_point=True).u - row["centre"]
    off = arm - (arm @ row["axis"])[:, None] * row["axis"]
    free = np.sqrt(np.maximum(dot(off, off) - row["radius"] ** 2, 0.0))
    return np.where(acts(view, row), (row["value"] - free) / row["radius"], np.nan)


def revolute(view: View, rows: list[int]) -> tuple[Array, Array] | None:
    """Angle (rad) and rate (rad/s) of the second side of a revolute joint against the first, (nt,) each.

    None where the second side has no direction that shows it, a cable whose own axis is that of the joint, and between
    beams.
    """
    joints = view.model.flexible.joints
    held = [joints[k] for k in rows if joints["kind"][k] == kernels.DIRECTION]
    if any(row["on"][0] != sides.ON_BODY for row in held):
        return None
    place = next(joints[k] for k in rows if joints["kind"][k] == kernels.POINT)
    body, axis = int(held[-1]["index"][0]), held[-1]["local"][0]  # the last row always holds the axis itself

    def zero_of(side: Side) -> Array:
        """Where the second side's direction is at the start, across the axis, in axes of the first body."""
        e: Array = view.initial.pose(body).R[0].T @ side.u[0]
        return e - (e @ axis) * axis

    if held[-1]["on"][1] == sides.ON_BODY:
        chosen = view.side(held[-1], 1, is_point=False)
        zero = zero_of(view.initial.side(held[-1], 1, is_point=False))
    else:  # of a node's slopes the one that is most across the axis
        q, v = int(place["iq"][1]), int(place["iv"][1])
        offs = [3 * i for i in range(1, view.node_vectors(q))]
        zeros = [
            zero_of(Side(view.initial.coordinates(q + off), view.initial.coordinates(v + off), -1)) for off in offs
        ]
        best = int(np.argmax([np.linalg.norm(z) for z in zeros]))
        zero, off = zeros[best], offs[best]
        chosen = Side(view.coordinates(q + off), view.coordinates(v + off), -1)
    if np.linalg.norm(zero) < 1e-6:
        return None
    zero = zero / np.linalg.norm(zero)
    pose = view.pose(body)
    x, y = turned(pose.R, zero), turned(pose.R, np.cross(axis, zero))
    p, q_ = dot(chosen.u, x), dot(chosen.u, y)
    seen = chosen.rate - cross(pose.w, chosen.u)
    rate = (p * dot(seen, y) - q_ * dot(seen, x)) / (p * p + q_ * q_)
    return unwrapped(view.t, np.arctan2(q_, p), rate), rate


def observe_link(view: View, name: str) -> Observed:
    """Length and tension of a link or cord."""
    found, row = Observed(), view.model.links[view.index(name)]
    (a, _), (b, _) = view.marker(int(row["a"])), view.marker(int(row["b"]))
    apart = b - a
    tension = view.solution.la[:, rows_of(view, name)[0]]
    found.scalar("tension", tension, "N", "tension, positive where it pulls")
    if row["drum"] > 0.0:
        radius, body = float(row["drum"]), int(view.model.markers["index"][row["a"]])
        square = dot(apart, apart)
        free = np.sqrt(np.maximum(square - radius**2, 0.0))
        across = cross(turned(view.pose(body).R, row["axis"]), apart)
        a = a + (radius / square)[:, None] * (radius * apart - float(row["sense"]) * free[:, None] * across)
        found.scalar("length", free, "m", "length of the cord's free part, from the drum to end b")
        found.scalar("wound_length", float(row["length"]) - free, "m", "length of the cord's wound part")
        found.along(
            "ends", "end", np.stack([a, b], axis=1), "m", "where the cord leaves the drum, and b, inertial axes"
        )
    else:
        found.scalar("length", norm(apart), "m", "distance of its ends")
        found.along("ends", "end", np.stack([a, b], axis=1), "m", "ends a and b, inertial axes")
    apart = a - b
    length = norm(apart)[:, None]
    pull = np.divide(apart, length, out=np.zeros_like(apart), where=length > 0.0)
    found.vector("force", tension[:, None] * pull, "N", "force on end b, inertial axes; on end a it is the opposite")
    found.drawn = [{"line": {"points": "ends", "kind": "rod", "values": ["tension"]}}]
    found.plots = ["tension"]
    return found


def observe_guide(view: View, name: str) -> Observed:
    """Reaction of a guide: a force along its direction, or a moment about the axis that it holds."""
    found, row = Observed(), view.model.guides[view.index(name)]
    la, pose = view.solution.la[:, rows_of(view, name)[0]], view.pose(int(row["body"]))
    if row["kind"] == CENTRE:
        found.scalar("reaction", -la, "N", "force of the guide on the body along its direction")
        found.vector("force", -la[:, None] * row["direction"], "N", "force of the guide on the body, inertial axes")
    else:
        moment = -la[:, None] * cross(turned(pose.R, row["axis"]), row["direction"])
        found.scalar("reaction", -la, "N m", "moment of the guide on the body about axis x direction")
        found.vector("moment", moment, "N m", "moment of the guide on the body, inertial axes")
    found.vector("position", pose.x, "m", "position of the guided body, inertial axes")
    found.plots = ["reaction"]
    return found
