"""Observations of joints, links, guides and hinges: reactions, angles and travels.

A multiplier la acts on side b with the force -la g_b, where g_b is the gradient of the constraint; of a direction u_b
held against u_a, with the moment -la u_b x u_a.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.kernels import hinge as hinge_kernels
from evolvent.kernels import joint as kernels
from evolvent.kernels.constraint_rows import GUIDE, LINK
from evolvent.kernels.sides import ON_COORDINATES
from evolvent.observe.variables import Observed, dot, norm, turned
from evolvent.observe.view import Side, View
from evolvent.solvers.solution import first_latch

Array = np.ndarray


def rows_of(view: View, name: str) -> list[int]:
    """Rows of the family `joints` that a part has written."""
    return [k for k, owner in enumerate(view.assembly.joint_parts) if owner == name]


def reactions(view: View, rows: list[int]) -> tuple[Array, Array, Array]:
    """Force and moment on the second side of joint rows, inertial axes, and the place at which the force acts.

    Returns
    -------
    force, moment : (nt, 3) float, N and N m; the moment about that place
    place : (nt, 3) float, m; NaN where the rows hold directions alone
    """
    n = view.t.size
    force, moment, place = np.zeros((n, 3)), np.zeros((n, 3)), np.full((n, 3), np.nan)
    for k in rows:
        row, la = view.model.flexible.joints[k], view.solution.la[:, k]
        if row["kind"] == kernels.ANGLE:
            index = int(row["index"][1])
            moment -= la[:, None] * turned(view.pose(index).R, view.model.bodies["axis"][index])
            place = view.pose(index).x
            continue
        is_place = row["kind"] != kernels.DIRECTION
        a, b = (view.side(row, which, is_place=is_place) for which in (0, 1))
        if not is_place:
            moment -= la[:, None] * np.cross(b.u, a.u)
            continue
        along = row["along"]
        if row["kind"] == kernels.DISTANCE:
            along = (b.u - a.u) / norm(b.u - a.u)[:, None]
        force -= la[:, None] * along
        place = b.u
    return force, moment, place


def observe_joint(view: View, name: str) -> Observed:
    """Reaction force and moment, angle or travel of a joint or of a prescribed motion."""
    rows, found = rows_of(view, name), Observed()
    joints = view.model.flexible.joints
    force, moment, place = reactions(view, rows)
    acts = view.t <= joints["until"][rows[0]]
    found.vector("force", force, "N", "force on the second side, inertial axes")
    found.vector("moment", moment, "N m", "moment on the second side about the joint, inertial axes")
    found.vector("position", place, "m", "position of the joint, inertial axes")
    found.scalar("closed", acts, "1", "1 while the joint holds, 0 once it is released")
    found.drawn = [{"marks": {"points": ["position"]}}, {"forces": {"points": "position", "vectors": "force"}}]
    found.plots = ["force"]
    if np.any(joints["kind"][rows] == kernels.ANGLE):
        found.scalar("angle", view.y[:, int(joints["iq"][rows[0], 1])], "rad", "angle of the body about its axis")
        axis = turned(
            view.pose(int(joints["index"][rows[0], 1])).R, view.model.bodies["axis"][joints["index"][rows[0], 1]]
        )
        found.scalar("torque", dot(moment, axis), "N m", "torque of the drive about the axis")
        found.plots = ["torque"]
        return found
    if joints["kind"][rows[0]] == kernels.DISTANCE:
        a, b = (view.side(joints[rows[0]], which, is_place=True) for which in (0, 1))
        found.scalar("length", norm(b.u - a.u), "m", "distance of the two places")
        found.scalar("tension", dot(force, (a.u - b.u) / norm(a.u - b.u)[:, None]), "N", "positive where it pulls")
        found.plots = ["tension"]
    if getattr(view.part(name), "type", "") == "revolute":
        angle = revolute_angle(view, name, rows)
        if angle is not None:
            found.scalar(
                "angle", angle, "rad", "angle of the second side about the axis, from the start, any number of turns"
            )
            found.scalar(
                "rate",
                np.gradient(angle, view.t) if view.t.size > 1 else np.zeros(1),
                "rad s-1",
                "rate of the angle, by differences of the samples",
            )
            found.plots = ["angle"]
    if np.any(joints["path"][rows] == kernels.LINEAR):
        row = joints[rows[0]]
        a, b = (view.side(row, which, is_place=True) for which in (0, 1))
        found.scalar("travel", (b.u - a.u) @ row["along"], "m", "travel along the direction of the drive")
    return found


def revolute_angle(view: View, name: str, rows: list[int]) -> Array | None:
    """Angle about the axis of a revolute joint from the start, continuous; None where its second side is no frame."""
    joints = view.model.flexible.joints
    part = view.part(name)
    axis = np.asarray(part.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    held = [joints[k] for k in rows if joints["kind"][k] == kernels.DIRECTION]
    if not held:
        return None
    body = int(held[0]["index"][0])
    R = view.pose(body).R
    local = R[0].T @ axis  # the start is the first sample
    follower = _follower(view, rows, held[0], axis)
    if follower is None:
        return None
    e = follower - dot(follower, turned(R, local))[:, None] * turned(R, local)
    zero = R[0].T @ e[0]
    zero = zero / np.linalg.norm(zero)
    x, y = turned(R, zero), turned(R, np.cross(local, zero))
    found: Array = np.unwrap(np.arctan2(dot(e, y), dot(e, x)))
    return found


def _follower(view: View, rows: list[int], held: Any, axis: Array) -> Array | None:
    """A direction of the second side across the axis: (nt, 3)."""
    second = int(held["index"][1])
    if held["on"][1] == 0 and second >= 0:
        R = view.pose(second).R
        across = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
        return turned(R, R[0].T @ across)
    place = next((k for k in rows if view.model.flexible.joints["kind"][k] == kernels.PLACE), None)
    if place is None:
        return None
    return view.coordinates(int(view.model.flexible.joints["iq"][place, 1]) + 3)  # the node's slope along its axis


def multipliers(view: View, kind: int, index: int) -> Array | None:
    """Multipliers of a row of explicit methods at the samples; None where there is none."""
    model = view.model
    found = [r for r in range(model.rows.size) if model.rows["kind"][r] == kind and model.rows["index"][r] == index]
    if not found:
        return None
    from evolvent.flow.needs import load_explicit
    from evolvent.flow.rhs import rhs

    load_explicit(model)
    values, dy = np.empty(view.t.size), np.empty(view.y.shape[1])
    for k, t in enumerate(view.t):
        rhs(t, np.ascontiguousarray(view.y[k]), np.ascontiguousarray(view.s[k]), model, dy)
        values[k] = model.la[found[0]]
    return values


def observe_link(view: View, name: str) -> Observed:
    """Length and tension of a link or cord."""
    index, found = view.index(name), Observed()
    row = view.model.links[index]
    (a, _), (b, _) = view.marker(int(row["a"])), view.marker(int(row["b"]))
    tension = multipliers(view, LINK, index) if view.explicit else view.solution.la[:, rows_of(view, name)[0]]
    found.scalar("length", norm(b - a), "m", "distance of its ends")
    found.scalar("tension", tension, "N", "tension, positive where it pulls")
    found.along("ends", "end", np.stack([a, b], axis=1), "m", "ends a and b, inertial axes")
    found.drawn = [{"line": {"points": "ends", "kind": "rod", "values": ["tension"]}}]
    found.plots = ["tension"]
    return found


def observe_guide(view: View, name: str) -> Observed:
    """Reaction of a guide: a force along its direction, or a moment about the axis that it holds."""
    index, found = view.index(name), Observed()
    row = view.model.guides[index]
    la = multipliers(view, GUIDE, index) if view.explicit else view.solution.la[:, rows_of(view, name)[0]]
    unit = "N m" if view.part(name).axis is not None else "N"
    found.scalar("reaction", la, unit, "reaction of the guide")
    found.vector("position", view.pose(int(row["body"])).x, "m", "position of the guided body, inertial axes")
    found.plots = ["reaction"]
    return found


def observe_hinge(view: View, name: str) -> Observed:
    """Angle, rate, torque and latch of a hinge's spring."""
    hinges, index, found = view.model.flexible.hinges, view.index(name), Observed()
    row = hinges[index]
    switch = int(row["switch"])
    second = _second_direction(view, row)
    pose = view.pose(int(row["body"]))
    axis, zero = turned(pose.R, row["axis"]), turned(pose.R, row["zero"])
    across = np.cross(axis, zero)
    p, q = dot(second.u, zero), dot(second.u, across)
    wrapped = np.arctan2(q, p)
    quarters = hinge_kernels.QUARTER * view.s[:, switch]
    angle = wrapped + hinge_kernels.TURN * np.round((quarters - wrapped) / hinge_kernels.TURN)
    seen = second.rate - np.cross(pose.w, second.u)
    rate = (p * dot(seen, across) - q * dot(seen, zero)) / (p * p + q * q)
    latched = view.s[:, switch + 1]
    laws = [
        hinge_kernels.hinge_law(hinges, index, int(on), float(x), float(v))
        for on, x, v in zip(latched, angle, rate, strict=True)
    ]
    torque, energy, lost = (np.array([law[k] for law in laws]) for k in (0, 3, 4))
    found.scalar("angle", angle, "rad", "angle of the second side as seen from the first, any number of turns")
    found.scalar("rate", rate, "rad s-1", "rate of the angle")
    found.scalar("torque", torque, "N m", "torque of spring, damper, stops and latch that resists the angle")
    found.scalar("energy_elastic", energy, "J", "elastic energy of spring, stops and latch")
    found.scalar("dissipation", lost, "W", "power dissipated by the dampers of hinge and latch")
    found.scalar("latched", latched, "1", "1 once the latch has locked")
    found.scalar("latch_time", np.full(view.t.size, latch_time(view, index)), "s", "time at which the latch has locked")
    found.plots = ["angle", "torque"]
    return found


def _second_direction(view: View, row: Any) -> Side:
    """Second direction of a hinge and its rate."""
    if row["on"] == ON_COORDINATES:
        return Side(view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"])), -1)
    pose = view.pose(int(row["other"]))
    u = turned(pose.R, row["local"])
    return Side(u, np.cross(pose.w, u), int(row["other"]))


def latch_time(view: View, index: int) -> float:
    """Time at which a hinge has locked, s: that of the run's event, or of its start; NaN where it has not."""
    solution = view.solution
    events = solution.event_times[solution.event_kinds == first_latch(view.model) + index]
    if events.size:
        return float(events[0])
    locked = view.t.size > 0 and view.s[0, int(view.model.flexible.hinges["switch"][index]) + 1] != 0
    return float(view.t[0]) if locked else math.nan
