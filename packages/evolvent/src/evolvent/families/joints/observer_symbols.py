"""Symbols of joints: by their type, pins, rails, balls, blocks, wheels and drives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.kernels import axial, gaps, sides
from evolvent.kernels.constraint_rows import CENTRE
from evolvent.results.observe.symbols import (
    Seat,
    Z,
    add_cable,
    ball,
    entry,
    moved,
    own_axis,
    pin,
    placed,
    revolved,
    ring,
    seat_of,
    symbol,
)
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View

Array = np.ndarray


@placed("joint")
def _seat(view: View, name: str, part: Any) -> Seat | None:
    return joint_seat(view, name, part, 0)


def joint_seat(view: View, name: str, part: Any, side: int) -> Seat | None:
    """Where a joint is, on its first (0) or second (1) side."""
    row = point_row(view, name)
    if row is None:
        return None
    axis = np.array(part.axis, dtype=float) / np.linalg.norm(part.axis)
    for which in (side, 1 - side):
        if int(row["on"][which]) == sides.ON_BODY and (which == side or side == 0):
            body = int(row["index"][which])
            return Seat(body, np.array(row["local"][which]), view.initial.pose(body).R[0].T @ axis)
    return Seat(-1, view.side(row, side, is_point=True).u, axis)


def point_row(view: View, name: str) -> Any:
    """The row of a joint that holds points; None of one that holds directions alone."""
    for k in view.joint_rows.get(name, []):
        row = view.model.joints[k]
        if row["kind"] not in (gaps.DIRECTION, gaps.ANGLE, gaps.GEAR):
            return row
    return None


@symbol("joint")
def _joint(view: View, name: str, found: Observed) -> None:
    """A joint by its type: pins of rotations, rails of travels, balls, blocks of clamps, and the rod of a distance."""
    part = view.part(name)
    own = _driven if part.drive is not None else _OF_TYPE.get(part.type)
    if own is not None:
        own(view, name, found)
        return
    row = point_row(view, name)
    if row is None or view.assembly.names[name][0] == "links":  # which is drawn by its ends
        return
    if row["kind"] in gaps.LENGTHS:
        ends = np.stack([view.side(row, which, is_point=True).u for which in gaps.LENGTHS[row["kind"]][0]], axis=1)
        found.along("ends", "end", ends, "m", "the two ends, inertial axes")
        found.drawn.append({"line": {"points": "ends", "kind": "rod", "values": ["tension"], "tip": None}})
        return
    seat = joint_seat(view, name, part, 0)
    assert seat is not None
    axis = own_axis(view, seat)
    if part.type in _AT_ONE_PLACE:
        found.drawn.append(entry(view, found, seat, solids=_AT_ONE_PLACE[part.type](axis)))
        if part.type == "universal":
            other = part.model_copy(update={"axis": part.axis_b})
            second = joint_seat(view, name, other, 1)
            if second is not None and second.body >= 0:
                cross = [pin(0.25, -0.9, 0.9, own_axis(view, second))]
                found.drawn.append(entry(view, found, second, solids=cross))
        return
    found.drawn.append(entry(view, found, seat, solids=[_RAILS.get(part.type, _RAILS["cylindrical"])(axis)]))
    slider = joint_seat(view, name, part, 1)
    if slider is not None:
        solid = ball(0.5) if part.type in ("point-on-line", "in-plane") else None
        solid = solid or pin(0.45, -0.8, 0.8, own_axis(view, slider))
        found.drawn.append(entry(view, Observed(variables=found.variables), slider, solids=[solid]))


_AT_ONE_PLACE: dict[str, Callable[[list[float]], list[dict[str, Any]]]] = {
    "revolute": lambda axis: [pin(0.35, -1.0, 1.0, axis)],
    "universal": lambda axis: [pin(0.25, -0.9, 0.9, axis), ball(0.4)],
    "spherical": lambda _: [ball(0.55)],
    "clamp": lambda _: [{"box": {"edges": [0.8, 0.8, 0.8]}}],
}
_RAILS: dict[str, Callable[[list[float]], dict[str, Any]]] = {
    "prismatic": lambda axis: pin(0.18, -2.5, 2.5, axis),
    "cylindrical": lambda axis: pin(0.25, -2.5, 2.5, axis),
    "point-on-line": lambda axis: pin(0.12, -2.5, 2.5, axis),
    "in-plane": lambda axis: pin(1.8, -0.05, 0.05, axis),
}


def _synchronization(view: View, name: str, found: Observed) -> None:
    """A cable from hinge to hinge."""
    seats = [seat for hinge in view.part(name).joints if (seat := seat_of(view, hinge)) is not None]
    add_cable(view, found, seats, "position of each hinge, inertial axes")


def _gear(view: View, name: str, found: Observed) -> None:
    """Wheels as circles with spokes, that turn with what they are on; a belt between pulleys and between travels."""
    part, model = view.part(name), view.model
    row = model.joints[view.joint_rows[name][0]]
    rows = model.gear_coordinates[int(row["first"]) : int(row["last"])]
    start, seats, axes = view.initial, [], []
    for key, one in zip("ab", rows, strict=True):
        where, other = getattr(part, key), int(one["other"])
        axis = start.pose(int(one["body"])).R[0] @ one["axis"]
        place = np.zeros(3)
        if getattr(view.assembly.parts[where], "kind", "") == "joint":
            place = np.array(point_row(view, where)["local"][1])
        axes.append(axis)
        seats.append(Seat(other, place, start.pose(other).R[0].T @ axis))
    a, b = (moved(start, seat)[0] for seat in seats)
    kinds, apart = [int(one["kind"]) for one in rows], b - a
    radii = _wheel_radii(kinds, float(part.ratio), axes, apart)
    for seat, kind, radius in zip(seats, kinds, radii, strict=True):
        axis = own_axis(view, seat)
        if kind == axial.TRAVEL:
            found.drawn.append(entry(view, found, seat, solids=[pin(0.2, -3.0, 3.0, axis)]))
        elif radius > 0.0:
            found.drawn.append(entry(view, found, seat, outline=ring(radius, axis, spokes=2)))
        else:
            size = -radius
            found.drawn.append(entry(view, found, seat, solids=[pin(size, -0.15, 0.15, axis)]))
    if kinds[0] == kinds[1] and not max(radii) > 0.0:
        add_cable(view, found, seats, "points between which the gear acts, inertial axes")


def _wheel_radii(kinds: list[int], ratio: float, axes: list[Array], apart: Array) -> tuple[float, float]:
    """Radii of the wheels of a gear, m; where these are not known, in units of the symbols' size with a minus.

    Notes
    -----
    Meshing wheels at the distance d have the radii d/(1 + i) and i d/(1 + i), i = r_b/r_a. A rack and pinion has the
    radius of the pinion as its ratio, or the inverse.
    """
    if kinds == [axial.TRAVEL, axial.ANGLE]:
        return 0.0, abs(ratio)
    if kinds == [axial.ANGLE, axial.TRAVEL]:
        return 1.0 / abs(ratio), 0.0
    along = float(axes[0] @ axes[1])
    off = float(np.linalg.norm(apart - (apart @ axes[0]) * axes[0]))
    signed = ratio * np.sign(along)
    if kinds == [axial.ANGLE, axial.ANGLE] and abs(abs(along) - 1.0) < 1e-6 and signed > 0.0 and off > 0.0:
        return off / (1.0 + signed), signed * off / (1.0 + signed)
    share = float(np.clip(abs(ratio), 0.25, 4.0)) ** 0.5
    return -1.2 / share, -1.2 * share


def _driven(view: View, name: str, found: Observed) -> None:
    """A drive: a motor on the axis of a spinning body, a cone along a line, a disc on an involute."""
    part = view.part(name)
    if part.type == "revolute":
        seat = seat_of(view, part.b)
        if seat is not None:
            solids = [pin(0.8, -0.6, 0.6, own_axis(view, seat), turned="angle")]
            found.drawn.append(entry(view, found, seat, solids=solids, lift=True))
        return
    on_line, axis = part.type == "point-on-line", np.array(part.axis, dtype=float)
    seat = Seat(-1, found.variables["position"].values, axis / np.linalg.norm(axis))
    profile = [(0.4, 0.6), (1.6, 0.0)] if on_line else [(-0.15, 1.0), (0.15, 1.0)]
    found.drawn.append(entry(view, found, seat, solids=[revolved(profile, list(Z))]))


def _guide(view: View, name: str, found: Observed) -> None:
    """The bearing of a guide: a plate across the direction in which it holds its body."""
    row = view.model.guides[view.index(name)]
    along = row["direction"] if row["kind"] == CENTRE else np.cross(row["axis"], row["direction"])
    if np.linalg.norm(along) > 0.0:
        seat = Seat(-1, found.variables["position"].values, np.asarray(along, dtype=float))
        found.drawn.append(entry(view, found, seat, solids=[pin(0.9, -0.1, 0.1, list(Z))]))


#: What draws joints that are not points which coincide or slide.
_OF_TYPE: dict[str, Callable[[View, str, Observed], None]] = {
    "guide": _guide, "gear": _gear, "synchronization": _synchronization,
}  # fmt: skip
