"""Observations of joints, links and guides: reactions, angles and travels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.references import split_reference
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.angles import coordinate_at_samples
from evolvent.families.joints.observer_gears import observe_gear
from evolvent.kernels import axial, sides
from evolvent.kernels.constraint_rows import CENTRE
from evolvent.model import RESULTS, zeros
from evolvent.results.observe.variables import Observed, dot, norm, observer, unwrapped
from evolvent.results.observe.view import View

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


def add_release(view: View, row: Any, found: Observed) -> None:
    """Add the event that a joint's row no longer holds; of one that an event releases it is known to a sample."""
    if np.isfinite(row["until"]):
        found.happens("released", float(row["until"]), view.t)
    else:
        found.changes(view.t, acts(view, row).astype(int), {0: "released"})


def reactions(view: View, rows: list[int]) -> Reaction:
    """Force and moment of joint rows on their second side, and their energy."""
    fields, joints, position = view.fields["joints"], view.model.joints, np.full((view.t.size, 3), np.nan)
    energy = np.zeros(view.t.size)
    for k in rows:
        if joints["kind"][k] != kernels.GEAR and not _holds_directions(joints[k]):
            position = fields["u"][:, k, 1]
        if joints["stiffness"][k] > 0.0:
            energy += np.where(acts(view, joints[k]), fields["stored"][:, k], 0.0)
    return Reaction(fields["force"][:, rows].sum(axis=1), fields["moment"][:, rows].sum(axis=1), position, energy)


def _holds_directions(row: Any) -> bool:
    """Whether a row holds directions, so that it transmits a moment."""
    of_section = row["kind"] == kernels.ALONG and row["on"][0] == sides.ON_NODE
    return bool(row["kind"] == kernels.DIRECTION or of_section)


@observer("joints")
def observe_joint(view: View, name: str) -> Observed:
    """Reaction force and moment, angle or travel of a joint, or of one with a drive."""
    part, rows, found = view.part(name), rows_of(view, name), Observed()
    joints = view.model.joints
    if joints["kind"][rows[0]] == kernels.GEAR:
        return observe_gear(view, name, joints[rows[0]], acts(view, joints[rows[0]]))
    row, sign = joints[rows[0]], -1.0 if _is_turned_round(view, name) else 1.0
    reaction = reactions(view, rows)
    on = _called(part.b)
    for field, values in (("force", reaction.force), ("moment", reaction.moment)):
        key, unit, text = RESULTS["joints"][field]
        found.vector(key, sign * values, unit, text.format(on=on))
    found.vector("position", reaction.position, "m", "position of the joint, inertial axes")
    found.scalar("closed", acts(view, row), "1", "1 while the joint holds, 0 once it is released")
    add_release(view, row, found)
    if np.any(joints["stiffness"][rows] > 0.0):
        found.scalar(RESULTS["joints"]["stored"][0], reaction.energy, *RESULTS["joints"]["stored"][1:])
    found.drawn = [{"marks": {"points": ["position"]}}, {"forces": {"points": "position", "vectors": "force"}}]
    found.plots = ["force", "moment"] if any(_holds_directions(joints[k]) for k in rows) else ["force"]
    measured = view.fields["joints"]["measured"][:, rows[0]]
    if row["kind"] == kernels.ANGLE:
        found.scalar("angle", measured, "rad", "angle of the body about its axis")
        found.scalar("rate", view.y[:, int(row["iv"][1])], "rad s-1", "rate of the body about its axis")
        torque = -view.solution.la[:, rows[0]]
        found.scalar("torque", torque, "N m", "torque of the drive on the body about its axis")
        found.plots = ["torque"]
    elif row["kind"] in kernels.LENGTHS:
        found.scalar("length", measured, "m", kernels.LENGTHS[row["kind"]][1])
        tension = view.solution.la[:, rows[0]]
        found.scalar("tension", tension, "N", "tension between the two ends, positive where it pulls")
        found.plots = ["tension"]
    elif row["path"] == kernels.LINEAR:
        found.scalar("travel", measured, "m", "travel along the direction of the drive")
        found.plots = ["travel", "force"]
    elif row["path"] == kernels.INVOLUTE:
        found.scalar(
            "angle", _wound(view, rows[0]), "rad", "angle of the thread wound onto the circle, of where the end is"
        )
        found.plots = ["angle", "force"]
    elif getattr(part, "type", "") == "screw":
        travel, turned = (coordinate_at(view, one) for one in _coordinates(view, rows))
        found.scalar("travel", travel[0], "m", "travel of b along the joint's axis since the start")
        found.scalar("angle", unwrapped(view.t, *turned), "rad", "angle of b about the joint's axis since the start")
        found.plots = ["angle", "travel"]
    elif getattr(part, "type", "") == "revolute":
        turn = revolute(view, rows) if view.wants("angle", "rate") else None
        if turn is not None:
            text = "of b against a about the joint's axis"
            found.scalar("angle", sign * turn[0], "rad", f"angle {text} since the start, over any number of turns")
            found.scalar("rate", sign * turn[1], "rad s-1", f"rate {text}")
            found.plots = ["angle"]
    return found


def _coordinates(view: View, rows: list[int]) -> Iterator[Any]:
    """Rows of the family `coordinates` of the travel and the angle of a screw joint."""
    joints, coordinates = view.model.joints, view.model.gear_coordinates
    gear = next(joints[k] for k in rows if joints["kind"][k] == kernels.GEAR)
    for one in coordinates[int(gear["first"]) : int(gear["last"])]:
        row = zeros("coordinates", 1)
        for key in ("kind", "body", "on", "other", "axis", "zero", "local"):
            row[key] = one[key]
        yield row


def _called(place: Any) -> str:
    """A point as texts call it."""
    if isinstance(place, str):
        return place
    return str(place[0]) if isinstance(place[0], str) else "the ground"


def _is_turned_round(view: View, name: str) -> bool:
    """Whether a joint's rows have its ends the other way round: a body is always their first side."""
    part, row = view.part(name), view.model.joints[rows_of(view, name)[0]]
    if tuple(row["on"][:2]) != (sides.ON_BODY, sides.ON_COORDINATES) or getattr(part, "a", None) is None:
        return False
    if not isinstance(part.a, str):
        return False
    return bool(view.assembly.names[split_reference(part.a)[0]][0] not in ("bodies", "rods", "reduced_bodies"))


def _wound(view: View, k: int) -> Array:
    """Angle by which the thread of an involute is wound, of where its end is, rad; NaN once it is released.

    Notes
    -----
    With the free part s = sqrt(d^2 - r^2), d the end's distance from the circle's axis: (length - s)/r.
    """
    row = view.model.joints[k]
    arm = view.fields["joints"]["u"][:, k, 1] - row["centre"]
    off = arm - (arm @ row["axis"])[:, None] * row["axis"]
    free = np.sqrt(np.maximum(dot(off, off) - row["radius"] ** 2, 0.0))
    return np.where(acts(view, row), (row["value"] - free) / row["radius"], np.nan)


def revolute(view: View, rows: list[int]) -> tuple[Array, Array] | None:
    """Angle (rad) and rate (rad/s) of the second side of a revolute joint against the first, (nt,) each.

    None where the second side has no direction that shows it, a cable whose own axis is that of the joint, and between
    beams.
    """
    joints = view.model.joints
    held = [joints[k] for k in rows if joints["kind"][k] == kernels.DIRECTION]
    if any(row["on"][0] != sides.ON_BODY for row in held):
        return None
    last = held[-1]  # which always holds the axis itself
    body, axis = int(last["index"][0]), last["local"][0]
    if last["on"][1] == sides.ON_BODY:
        second = [{"on": sides.ON_BODY, "other": last["index"][1], "local": last["local"][1]}]
    else:  # of a node's slopes the one that is most across the axis
        place = next(joints[k] for k in rows if joints["kind"][k] == kernels.POINT)
        q, v = int(place["iq"][1]), int(place["iv"][1])
        offs = range(3, 3 * view.node_vectors(q), 3)
        second = [{"on": sides.ON_COORDINATES, "iq": q + off, "iv": v + off} for off in offs]
    found = []
    for fields in second:
        row = zeros("coordinates", 1)
        for key, value in {"kind": axial.ANGLE, "body": body, "axis": axis, **fields}.items():
            row[key] = value
        own = row[0]
        start = view.initial.vector(own["on"], own["other"], own["iq"], own["iv"], own["local"], is_point=False).u[0]
        start = view.initial.pose(body).R[0].T @ start
        found.append((start - (start @ axis) * axis, row))
    zero, row = max(found, key=lambda one: float(np.linalg.norm(one[0])))
    if np.linalg.norm(zero) < 1e-6:
        return None
    row["zero"] = zero / np.linalg.norm(zero)
    angle, rate = coordinate_at(view, row)
    return unwrapped(view.t, angle, rate), rate


def coordinate_at(view: View, row: Any) -> tuple[Array, Array]:
    """Angle within half a turn, or travel, and its rate, of a row of the family `coordinates` at the samples: (nt,)."""
    found = np.empty((2, view.t.size))
    t, y = np.ascontiguousarray(view.t), np.ascontiguousarray(view.y)
    coordinate_at_samples(t, y, np.zeros(1, dtype=np.int64), row, view.model, found)
    return found[0], found[1]


@observer("links")
def observe_link(view: View, name: str) -> Observed:
    """Length and tension of a link or cord."""
    found, link, k = Observed(), view.model.links[view.index(name)], rows_of(view, name)[0]
    fields = view.fields["joints"]
    ends = fields["u"][:, k, :2]
    found.scalar("tension", view.solution.la[:, k], "N", "tension, positive where it pulls")
    if link["drum"] > 0.0:
        free = norm(ends[:, 1] - ends[:, 0])
        found.scalar("length", free, "m", "length of the cord's free part, from the drum to end b")
        found.scalar("wound_length", float(link["length"]) - free, "m", "length of the cord's wound part")
        found.along("ends", "end", ends, "m", "where the cord leaves the drum, and b, inertial axes")
    else:
        found.scalar("length", fields["measured"][:, k], "m", "distance of its ends")
        found.along("ends", "end", ends, *RESULTS["joints"]["u"][1:])
    text = "force on end b, inertial axes; on end a it is the opposite"
    found.vector("force", fields["force"][:, k], "N", text)
    found.drawn = [{"line": {"points": "ends", "kind": "rod", "values": ["tension"]}}]
    found.plots = ["tension"]
    add_release(view, view.model.joints[k], found)
    return found


@observer("guides")
def observe_guide(view: View, name: str) -> Observed:
    """Reaction of a guide: a force along its direction, or a moment about the axis that it holds."""
    found, guide, k = Observed(), view.model.guides[view.index(name)], rows_of(view, name)[0]
    what, unit = ("force", "N") if guide["kind"] == CENTRE else ("moment", "N m")
    along = "along its direction" if what == "force" else "about axis_b x axis"
    found.scalar("reaction", -view.solution.la[:, k], unit, f"{what} of the guide on the body {along}")
    values = view.fields["joints"][what][:, k]
    found.vector(what, values, unit, f"{what} of the guide on the body, inertial axes")
    found.vector("position", view.pose(int(guide["body"])).x, "m", "position of the guided body, inertial axes")
    found.plots = ["reaction"]
    return found
