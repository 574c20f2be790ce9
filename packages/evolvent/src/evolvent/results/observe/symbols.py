"""Symbols of parts that have no extent of their own: joints, hinges, gears, motors, wheels, thrusters, panels.

A part states the name of its symbol (`Part.symbol`): "pin", "disc", "ball", "block", "hinge" and "motor" stand where
any part acts; "joint", "wheel", "thruster", "panel" and "cylinder" are of the parts that have their keys. A symbol is
fixed to a body, or moves with a variable of the part. Its solids are in units of the symbols' size, which
`view.drawing` takes from the structure; outlines are in m.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from evolvent.assembly.ends import ends_of
from evolvent.kernels import axial, joint as joints, sides
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.constraint_rows import CENTRE
from evolvent.model.registry import families
from evolvent.parts.base import unit
from evolvent.parts.joint import Joint
from evolvent.parts.joint_spring import JointSpring
from evolvent.results.observe.shapes import point_on
from evolvent.results.observe.variables import Observed, turned
from evolvent.results.observe.view import View
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
_Z = (0.0, 0.0, 1.0)
#: What draws symbols, by their names (`symbol`): a function of a view of a run, the name of a part and its results.
SYMBOLS: dict[str, Callable[[View, str, Observed], None]] = {}
Symbol = TypeVar("Symbol", bound=Callable[[View, str, Observed], None])


class Seat(NamedTuple):
    """Where a symbol is.

    Attributes
    ----------
    body : int, index of the body to which it is fixed; -1 for none
    position : (3,) float, m, body axes; (nt, 3) in inertial axes without a body
    axis : (3,) float, of the joint, body axes; inertial axes at the start without a body
    """

    body: int
    position: Array
    axis: Array


def add_symbols(view: View, name: str, found: Observed) -> None:
    """Add the symbol of a part to what is drawn of it, and the variables with which it moves.

    Raises
    ------
    InputError
        If the part states a symbol that there is not.
    """
    stated = view.part(name).symbol
    if stated and stated not in SYMBOLS:
        raise InputError(f"the symbol of {name!r} is {stated!r}; {nearest(stated, SYMBOLS)}")
    if stated and view.t.size:
        SYMBOLS[stated](view, name, found)


def symbol(name: str) -> Callable[[Symbol], Symbol]:
    """Decorator of the function that draws a symbol."""

    def register(function: Symbol) -> Symbol:
        SYMBOLS[name] = function
        return function

    return register


# ------------------------------------------------------------------------------------------------ points


def seat_of(view: View, name: str) -> Seat | None:
    """Where a part is: a joint, a body, what acts on a joint, or else on bodies, at the centre of the first of them.

    None of what acts on no body, and of a spring away from any known point.
    """
    part = view.assembly.parts.get(name)
    if isinstance(part, Joint):
        return _joint_seat(view, name, part, 0)
    if isinstance(part, JointSpring):
        return _hinge_seat(view, name, part)
    if isinstance(joint := getattr(part, "joint", None), str):
        return seat_of(view, joint)
    family, index = view.assembly.names.get(name, ("", 0))
    if family == "bodies":
        return Seat(index, np.zeros(3), np.asarray(view.model.bodies["axis"][index], dtype=float))
    if part is None or family not in families():
        return None
    records = functools.partial(getattr, view.model)
    body = next((int(i) for what, i in ends_of(family, records(family)[index], records) if what == "bodies"), None)
    if body is None:
        return None
    return Seat(body, np.zeros(3), view.initial.pose(body).R[0].T @ unit(getattr(part, "axis", _Z)))


def _joint_seat(view: View, name: str, part: Any, side: int) -> Seat | None:
    """Where a joint is, on its first (0) or second (1) side."""
    row = _point_row(view, name)
    if row is None:
        return None
    axis = np.array(part.axis, dtype=float) / np.linalg.norm(part.axis)
    for which in (side, 1 - side):
        if int(row["on"][which]) == sides.ON_BODY and (which == side or side == 0):
            body = int(row["index"][which])
            return Seat(body, np.array(row["local"][which]), view.initial.pose(body).R[0].T @ axis)
    return Seat(-1, view.side(row, side, is_point=True).u, axis)


def _point_row(view: View, name: str) -> Any:
    """The row of a joint that holds points; None of one that holds directions alone."""
    for k in view.joint_rows.get(name, []):
        row = view.model.joints[k]
        if row["kind"] not in (joints.DIRECTION, joints.ANGLE, joints.GEAR):
            return row
    return None


def _hinge_seat(view: View, name: str, part: Any) -> Seat | None:
    """Where a spring of a joint is: at its joint, at that between the same parts, or at its second end."""
    row = view.model.coordinates[view.index(name)]
    body, axis = int(row["body"]), np.array(row["axis"], dtype=float)
    if row["kind"] == axial.TRAVEL:
        return Seat(body, np.array(row["zero"]), axis)
    if part.joint is not None:
        return seat_of(view, part.joint)
    other = int(row["other"])
    for joint, candidate in view.assembly.parts.items():
        if isinstance(candidate, Joint) and candidate.type in ("revolute", "cylindrical", "universal"):
            found = _point_row(view, joint)
            if found is not None and {(int(found["on"][i]), int(found["index"][i])) for i in (0, 1)} == {
                (sides.ON_BODY, body), (sides.ON_BODY, other),
            }:  # fmt: skip
                return seat_of(view, joint)
    if row["on"] == sides.ON_COORDINATES:
        return Seat(-1, _node_of_slope(view, int(row["iq"])), view.initial.pose(body).R[0] @ axis)
    owner = next(n for n, at in view.assembly.names.items() if at == ("bodies", other))
    place = point_on(part.b, owner, getattr(view.assembly.parts.get(owner), "points", None) or {})
    back = view.initial.pose(other).R[0].T @ view.initial.pose(body).R[0]
    return Seat(other, np.zeros(3) if place is None else place, back @ axis)


def _node_of_slope(view: View, iq: int) -> Array:
    """Position (nt, 3) of the node of a beam that has the slope with the coordinate iq."""
    beams = view.model.beams
    row = beams[np.flatnonzero((beams["iq"] >= 0) & (beams["iq"] <= iq))[-1]]
    node = 3 * NODE_VECTORS[int(row["kind"])]
    return view.coordinates(iq - (iq - int(row["iq"])) % node)


def _moved(view: View, seat: Seat) -> Array:
    """Position (nt, 3) of a seat, inertial axes."""
    return seat.position if seat.body < 0 else view.on_body(seat.body, seat.position)[0]


def _entry(view: View, found: Observed, seat: Seat, **drawn: Any) -> dict[str, Any]:
    """A symbol at a seat, with `solids` and `outline` about it; without a body, their z is the axis of the seat."""
    name = next((n for n, at in view.assembly.names.items() if at == ("bodies", seat.body)), None)
    if seat.body >= 0 and name is not None:
        return {"symbol": {"body": name, "centre": np.asarray(seat.position).tolist(), **drawn}}
    axis = np.broadcast_to(seat.axis, (view.t.size, 3))
    if seat.body >= 0:  # a body without its own name: a node of a rod
        axis = turned(view.pose(seat.body).R, seat.axis)
    if "position" not in found.variables:
        found.vector("position", _moved(view, seat), "m", "position, inertial axes")
    # not "axis": in a file, that is the dimension that counts x, y, z
    if "axis_direction" not in found.variables:
        found.vector("axis_direction", axis, "1", "direction of the axis, inertial axes")
    return {"symbol": {"origin": "position", "along": "axis_direction", **drawn}}


def _own_axis(view: View, seat: Seat) -> list[float]:
    """The axis of a seat in the axes in which its solids are."""
    named = any(at == ("bodies", seat.body) for at in view.assembly.names.values())
    return np.asarray(seat.axis).tolist() if seat.body >= 0 and named else list(_Z)


# ------------------------------------------------------------------------------------------------ solids


def _round(profile: list[tuple[float, float]], axis: list[float], **more: Any) -> dict[str, Any]:
    """A surface of revolution about an axis through the seat."""
    return {"revolution": {"profile": [list(p) for p in profile], "centre": [0.0, 0.0, 0.0], "axis": axis}, **more}


def _pin(radius: float, low: float, high: float, axis: list[float], **more: Any) -> dict[str, Any]:
    """A cylinder from one height above the seat to another."""
    return _round([(low, radius), (high, radius)], axis, **more)


def _ball(radius: float) -> dict[str, Any]:
    angles = np.linspace(0.0, np.pi, 9)
    return _round([(-radius * float(np.cos(a)), radius * float(np.sin(a))) for a in angles], list(_Z))


def _cube() -> dict[str, Any]:
    return {"box": {"edges": [0.8, 0.8, 0.8]}}


def _ring(radius: float, axis: Any, height: float = 0.0, *, spokes: int = 0) -> list[list[list[float]]]:
    """A circle about an axis through the seat, and its spokes: polylines, m."""
    x, y, z = _basis(axis)
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    circle = height * z + radius * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y)
    lines = [circle]
    for k in range(spokes):
        a = np.pi * k / spokes
        tip = radius * (np.cos(a) * x + np.sin(a) * y)
        lines.append(np.array([height * z - tip, height * z + tip]))
    return [line.tolist() for line in lines]


def _basis(axis: Any) -> tuple[Array, Array, Array]:
    """Unit vectors x and y across an axis, and the axis."""
    z = np.array(axis, dtype=float) / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z


# ------------------------------------------------------------------------------------------------ joints


@symbol("joint")
def _joint(view: View, name: str, found: Observed) -> None:
    """A joint by its type: pins of rotations, rails of travels, balls, blocks of clamps, and the rod of a distance."""
    part = view.part(name)
    own = _driven if part.drive is not None else _OF_TYPE.get(part.type)
    if own is not None:
        own(view, name, found)
        return
    row = _point_row(view, name)
    if row is None or view.assembly.names[name][0] == "links":  # which is drawn by its ends
        return
    if row["kind"] in joints.LENGTHS:
        ends = np.stack([view.side(row, which, is_point=True).u for which in joints.LENGTHS[row["kind"]][0]], axis=1)
        found.along("ends", "end", ends, "m", "the two ends, inertial axes")
        found.drawn.append({"line": {"points": "ends", "kind": "rod", "values": ["tension"], "tip": None}})
        return
    seat = _joint_seat(view, name, part, 0)
    assert seat is not None
    axis = _own_axis(view, seat)
    if part.type in _AT_ONE_PLACE:
        found.drawn.append(_entry(view, found, seat, solids=_AT_ONE_PLACE[part.type](axis)))
        if part.type == "universal":
            other = part.model_copy(update={"axis": part.axis_b})
            second = _joint_seat(view, name, other, 1)
            if second is not None and second.body >= 0:
                cross = [_pin(0.25, -0.9, 0.9, _own_axis(view, second))]
                found.drawn.append(_entry(view, found, second, solids=cross))
        return
    found.drawn.append(_entry(view, found, seat, solids=[_RAILS.get(part.type, _RAILS["cylindrical"])(axis)]))
    slider = _joint_seat(view, name, part, 1)
    if slider is not None:
        solid = _ball(0.5) if part.type in ("point-on-line", "in-plane") else None
        solid = solid or _pin(0.45, -0.8, 0.8, _own_axis(view, slider))
        found.drawn.append(_entry(view, Observed(variables=found.variables), slider, solids=[solid]))


_AT_ONE_PLACE: dict[str, Callable[[list[float]], list[dict[str, Any]]]] = {
    "revolute": lambda axis: [_pin(0.35, -1.0, 1.0, axis)],
    "universal": lambda axis: [_pin(0.25, -0.9, 0.9, axis), _ball(0.4)],
    "spherical": lambda _: [_ball(0.55)],
    "clamp": lambda _: [_cube()],
}
_RAILS: dict[str, Callable[[list[float]], dict[str, Any]]] = {
    "prismatic": lambda axis: _pin(0.18, -2.5, 2.5, axis),
    "cylindrical": lambda axis: _pin(0.25, -2.5, 2.5, axis),
    "point-on-line": lambda axis: _pin(0.12, -2.5, 2.5, axis),
    "in-plane": lambda axis: _pin(1.8, -0.05, 0.05, axis),
}


@symbol("hinge")
def _joint_spring(view: View, name: str, found: Observed) -> None:
    """Two flanges at the ends of a hinge's pin; nothing of a travel, whose ends are drawn."""
    seat = seat_of(view, name) if "angle" in found.variables else None
    if seat is not None:
        axis = _own_axis(view, seat)
        flanges = [_pin(0.7, low, low + 0.25, axis) for low in (-1.25, 1.0)]
        found.drawn.append(_entry(view, found, seat, solids=flanges))


@symbol("motor")
def _motor(view: View, name: str, found: Observed) -> None:
    """A rotor beside its joint that turns with the angle; of a travel a cone along the axis."""
    seat = seat_of(view, name)
    if seat is None:
        return
    axis = _own_axis(view, seat)
    if "angle" in found.variables:
        solids = [_pin(0.8, 1.3, 2.5, axis, turned="angle")]
    else:
        solids = [_round([(0.6, 0.7), (1.8, 0.0)], axis)]
    found.drawn.append(_entry(view, found, seat, solids=solids))


def _synchronization(view: View, name: str, found: Observed) -> None:
    """A cable from hinge to hinge."""
    seats = [seat for hinge in view.part(name).joints if (seat := seat_of(view, hinge)) is not None]
    _add_cable(view, found, seats, "position of each hinge, inertial axes")


def _add_cable(view: View, found: Observed, seats: list[Seat], text: str) -> None:
    """A line from seat to seat."""
    if len(seats) > 1:
        found.along("cable", "station", np.stack([_moved(view, seat) for seat in seats], axis=1), "m", text)
        found.drawn.append({"line": {"points": "cable", "kind": "line", "tip": None}})


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
        if isinstance(view.assembly.parts[where], Joint):
            place = np.array(_point_row(view, where)["local"][1])
        axes.append(axis)
        seats.append(Seat(other, place, start.pose(other).R[0].T @ axis))
    a, b = (_moved(start, seat)[0] for seat in seats)
    kinds, apart = [int(one["kind"]) for one in rows], b - a
    radii = _wheel_radii(kinds, float(part.ratio), axes, apart)
    for seat, kind, radius in zip(seats, kinds, radii, strict=True):
        axis = _own_axis(view, seat)
        if kind == axial.TRAVEL:
            found.drawn.append(_entry(view, found, seat, solids=[_pin(0.2, -3.0, 3.0, axis)]))
        elif radius > 0.0:
            found.drawn.append(_entry(view, found, seat, outline=_ring(radius, axis, spokes=2)))
        else:
            size = -radius
            found.drawn.append(_entry(view, found, seat, solids=[_pin(size, -0.15, 0.15, axis)]))
    if kinds[0] == kinds[1] and not max(radii) > 0.0:
        _add_cable(view, found, seats, "points between which the gear acts, inertial axes")


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
            solids = [_pin(0.8, -0.6, 0.6, _own_axis(view, seat), turned="angle")]
            found.drawn.append(_entry(view, found, seat, solids=solids, lift=True))
        return
    on_line, axis = part.type == "point-on-line", np.array(part.axis, dtype=float)
    seat = Seat(-1, found.variables["position"].values, axis / np.linalg.norm(axis))
    profile = [(0.4, 0.6), (1.6, 0.0)] if on_line else [(-0.15, 1.0), (0.15, 1.0)]
    found.drawn.append(_entry(view, found, seat, solids=[_round(profile, list(_Z))]))


def _guide(view: View, name: str, found: Observed) -> None:
    """The bearing of a guide: a plate across the direction in which it holds its body."""
    row = view.model.guides[view.index(name)]
    along = row["direction"] if row["kind"] == CENTRE else np.cross(row["axis"], row["direction"])
    if np.linalg.norm(along) > 0.0:
        seat = Seat(-1, found.variables["position"].values, np.asarray(along, dtype=float))
        found.drawn.append(_entry(view, found, seat, solids=[_pin(0.9, -0.1, 0.1, list(_Z))]))


#: What draws joints that are not points which coincide or slide.
_OF_TYPE: dict[str, Callable[[View, str, Observed], None]] = {
    "guide": _guide, "gear": _gear, "synchronization": _synchronization,
}  # fmt: skip


# ------------------------------------------------------------------------------------------------ any part


@symbol("pin")
def _pin_of(view: View, name: str, found: Observed) -> None:
    """A pin along the axis."""
    _add(view, name, found, lambda axis: _pin(0.35, -1.0, 1.0, axis))


@symbol("disc")
def _disc_of(view: View, name: str, found: Observed) -> None:
    """A disc across the axis, which turns with the variable "angle", if there is one."""
    turned_by = {"turned": "angle"} if "angle" in found.variables else {}
    _add(view, name, found, lambda axis: _pin(1.2, -0.2, 0.2, axis, **turned_by))


@symbol("ball")
def _ball_of(view: View, name: str, found: Observed) -> None:
    """A ball."""
    _add(view, name, found, lambda _: _ball(0.55))


@symbol("block")
def _block_of(view: View, name: str, found: Observed) -> None:
    """A cube."""
    _add(view, name, found, lambda _: _cube())


def _add(view: View, name: str, found: Observed, solid: Callable[[list[float]], dict[str, Any]]) -> None:
    """A solid, a function of its axis, where a part is."""
    seat = seat_of(view, name)
    if seat is not None:
        found.drawn.append(_entry(view, found, seat, solids=[solid(_own_axis(view, seat))]))


# ------------------------------------------------------------------------------------------------ hardware


@symbol("wheel")
def _wheel(view: View, name: str, found: Observed) -> None:
    """A disc that turns, unless its radius is stated and it is drawn with that, and its axis."""
    part, row = view.part(name), view.model.wheels[view.index(name)]
    axis = np.asarray(row["axis"], dtype=float)
    seat = Seat(int(row["body"]), np.array(part.centre, dtype=float), axis)
    if part.radius is not None:
        shaft = (np.array([[-0.5], [0.5]]) * part.radius * axis).tolist()
        found.drawn.append(_entry(view, found, seat, outline=[shaft], lift=True))
        return
    own = axis.tolist()
    solids = [_pin(1.4, -0.3, 0.3, own, turned="angle"), _pin(0.18, -1.2, 1.2, own)]
    found.drawn.append(_entry(view, found, seat, solids=solids, lift=True))


@symbol("thruster")
def _thruster(view: View, name: str, found: Observed) -> None:
    """A nozzle, and a plume whose size follows the thrust."""
    row = view.model.thrusters[view.index(name)]
    seat = Seat(int(row["body"]), np.array(row["local"]), np.asarray(row["direction"], dtype=float))
    back = (-np.asarray(row["direction"], dtype=float)).tolist()
    plume = _round([(0.0, 0.55), (3.5, 0.0)], back, scaled="thrust", most=float(row["limit"]))
    plume["revolution"]["centre"] = [1.2 * c for c in back]
    found.drawn.append(_entry(view, found, seat, solids=[_round([(0.0, 0.25), (1.2, 0.7)], back), plume]))


@symbol("panel")
def _panel(view: View, name: str, found: Observed) -> None:
    """The outline of a square panel of the area that the light falls on."""
    part = view.part(name)
    if part.at is None:
        return
    marker = view.model.markers[int(view.model.loads["target"][view.index(name)])]
    x, y, _ = _basis(part.normal)
    half = 0.5 * float(part.area) ** 0.5
    corners = [half * (i * x + j * y) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    lines = [corners, [corners[0], corners[2]], [corners[1], corners[3]]]
    seat = Seat(int(marker["index"]), np.array(marker["local"]), np.array(part.normal, dtype=float))
    outline = [[point.tolist() for point in line] for line in lines]
    found.drawn.append(_entry(view, found, seat, outline=outline))


@symbol("cylinder")
def _contact(view: View, name: str, found: Observed) -> None:
    """A cylinder that is touched as two circles and four lines; one without ends as long as it is wide."""
    part, family = view.part(name), view.assembly.names[name][0]
    if type(part.shape).__name__ != "Cylinder":
        return
    row = getattr(view.model, family)[view.index(name)]
    body, centre = (row["body"], row["centre"]) if family == "contact_surfaces" else (row["b"], row["place_b"])
    radius = part.shape.radius
    half = radius if part.shape.length is None else 0.5 * part.shape.length
    x, y, z = _basis(part.shape.axis)
    lines = [*_ring(radius, part.shape.axis, -half), *_ring(radius, part.shape.axis, half)]
    for side in (x, y, -x, -y):
        lines.append([(radius * side - half * z).tolist(), (radius * side + half * z).tolist()])
    found.drawn.append(_entry(view, found, Seat(int(body), centre, z), outline=lines))
