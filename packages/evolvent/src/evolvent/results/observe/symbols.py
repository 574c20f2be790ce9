"""Symbols of parts that have no extent of their own, such as joints, motors and thrusters.

A part states the name of its symbol (`Part.symbol`). "pin", "disc", "ball" and "block" stand where any part acts; the
others are functions beside the families that have them. A symbol is fixed to a body, or moves with a variable of the
part. Its solids are in units of the symbols' size, which `view.drawing` takes from the structure; outlines are in m.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.ends import ends_of
from evolvent.model.registry import families
from evolvent.parts.base import unit
from evolvent.results.observe.variables import Observed, observers, turned
from evolvent.results.observe.view import View
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
Z = (0.0, 0.0, 1.0)


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


#: Variable of a part that is 1 while it holds, 0 once it is released; its symbol, and those on it, are drawn so long.
HOLDS = "closed"
Drawn = Callable[[View, str, Observed], None]
Placed = Callable[[View, str, Any], Seat | None]
#: What draws symbols, by their names, and where kinds of parts are.
_SYMBOLS: dict[str, Drawn] = {}
_SEATS: dict[str, Placed] = {}


def symbol(name: str) -> Callable[[Drawn], Drawn]:
    """Decorator of the function of a view, the name of a part and its results that draws a symbol."""

    def register(function: Drawn) -> Drawn:
        _SYMBOLS[name] = function
        return function

    return register


def placed(kind: str) -> Callable[[Placed], Placed]:
    """Decorator of the function of a view, a name and the part that says where other parts find a kind of part."""

    def register(function: Placed) -> Placed:
        _SEATS[kind] = function
        return function

    return register


def add_symbols(view: View, name: str, found: Observed) -> None:
    """Add the symbol of a part to what is drawn of it, and the variables with which it moves.

    Raises
    ------
    InputError
        If the part states a symbol that there is not.
    """
    observers()
    stated = view.part(name).symbol
    if stated and stated not in _SYMBOLS:
        raise InputError(f"the symbol of {name!r} is {stated!r}; {nearest(stated, _SYMBOLS)}")
    if stated and view.t.size:
        _SYMBOLS[stated](view, name, found)
    holder, bodies = _holder(view, name), _bodies_of(view, name)
    for drawn in found.drawn:
        if own := drawn.get("symbol"):
            own["near"] = bodies
        for kind in ("symbol", "marks"):
            if kind in drawn and (holder != name or HOLDS in found.variables):
                drawn[kind]["while"] = f"{holder}.{HOLDS}"


def _holder(view: View, name: str) -> str:
    """Name of the joint on which a part is, by way of what it acts on; of one on no joint its own."""
    while isinstance(joint := getattr(view.assembly.parts.get(name), "joint", None), str):
        name = joint
    return name


def _bodies_of(view: View, name: str) -> list[str]:
    """Names of the bodies that a part acts on."""
    family, index = view.assembly.names.get(name, ("", 0))
    if family not in families():
        return []
    records = functools.partial(getattr, view.model)
    rows = view.joint_rows.get(name, []) if family == "joints" else [index]
    found = {int(i) for k in rows for what, i in ends_of(family, records(family)[k], records) if what == "bodies"}
    return [n for n, (kind, k) in view.assembly.names.items() if kind == "bodies" and k in found]


# ------------------------------------------------------------------------------------------------ points


def seat_of(view: View, name: str) -> Seat | None:
    """Where a part is: one that is `placed`, a body, what acts on a joint, or else on bodies, at the first of them.

    None of what acts on no body, and of one away from any known point.
    """
    part = view.assembly.parts.get(name)
    function = _SEATS.get(str(getattr(part, "kind", "")))
    if function is not None:
        return function(view, name, part)
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
    return Seat(body, np.zeros(3), view.initial.pose(body).R[0].T @ unit(getattr(part, "axis", Z)))


def moved(view: View, seat: Seat) -> Array:
    """Position (nt, 3) of a seat, inertial axes."""
    return seat.position if seat.body < 0 else view.on_body(seat.body, seat.position)[0]


def entry(view: View, found: Observed, seat: Seat, **drawn: Any) -> dict[str, Any]:
    """A symbol at a seat, with `solids` and `outline` about it; without a body, their z is the axis of the seat."""
    name = next((n for n, at in view.assembly.names.items() if at == ("bodies", seat.body)), None)
    if seat.body >= 0 and name is not None:
        return {"symbol": {"body": name, "centre": np.asarray(seat.position).tolist(), **drawn}}
    axis = np.broadcast_to(seat.axis, (view.t.size, 3))
    if seat.body >= 0:  # a body without its own name: a node of a rod
        axis = turned(view.pose(seat.body).R, seat.axis)
    if "position" not in found.variables:
        found.vector("position", moved(view, seat), "m", "position, inertial axes")
    # not "axis": in a file, that is the dimension that counts x, y, z
    if "axis_direction" not in found.variables:
        found.vector("axis_direction", axis, "1", "direction of the axis, inertial axes")
    return {"symbol": {"origin": "position", "along": "axis_direction", **drawn}}


def own_axis(view: View, seat: Seat) -> list[float]:
    """The axis of a seat in the axes in which its solids are."""
    named = any(at == ("bodies", seat.body) for at in view.assembly.names.values())
    return np.asarray(seat.axis).tolist() if seat.body >= 0 and named else list(Z)


# ------------------------------------------------------------------------------------------------ solids


def revolved(profile: list[tuple[float, float]], axis: list[float], **more: Any) -> dict[str, Any]:
    """A surface of revolution about an axis through the seat."""
    return {"revolution": {"profile": [list(p) for p in profile], "centre": [0.0, 0.0, 0.0], "axis": axis}, **more}


def pin(radius: float, low: float, high: float, axis: list[float], **more: Any) -> dict[str, Any]:
    """A cylinder from one height above the seat to another."""
    return revolved([(low, radius), (high, radius)], axis, **more)


def ball(radius: float) -> dict[str, Any]:
    """A ball about the seat."""
    angles = np.linspace(0.0, np.pi, 9)
    return revolved([(-radius * float(np.cos(a)), radius * float(np.sin(a))) for a in angles], list(Z))


def ring(radius: float, axis: Any, height: float = 0.0, *, spokes: int = 0) -> list[list[list[float]]]:
    """A circle about an axis through the seat, and its spokes: polylines, m."""
    x, y, z = basis(axis)
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    circle = height * z + radius * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y)
    lines = [circle]
    for k in range(spokes):
        a = np.pi * k / spokes
        tip = radius * (np.cos(a) * x + np.sin(a) * y)
        lines.append(np.array([height * z - tip, height * z + tip]))
    return [line.tolist() for line in lines]


def basis(axis: Any) -> tuple[Array, Array, Array]:
    """Unit vectors x and y across an axis, and the axis."""
    z = np.array(axis, dtype=float) / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z


def add_cable(view: View, found: Observed, seats: list[Seat], text: str) -> None:
    """A line from seat to seat."""
    if len(seats) > 1:
        found.along("cable", "station", np.stack([moved(view, seat) for seat in seats], axis=1), "m", text)
        found.drawn.append({"line": {"points": "cable", "kind": "line", "tip": None}})


# ------------------------------------------------------------------------------------------------ any part


@symbol("pin")
def _pin_of(view: View, name: str, found: Observed) -> None:
    """A pin along the axis."""
    _add(view, name, found, lambda axis: pin(0.35, -1.0, 1.0, axis))


@symbol("disc")
def _disc_of(view: View, name: str, found: Observed) -> None:
    """A disc across the axis, which turns with the variable "angle", if there is one."""
    turned_by = {"turned": "angle"} if "angle" in found.variables else {}
    _add(view, name, found, lambda axis: pin(1.2, -0.2, 0.2, axis, **turned_by))


@symbol("ball")
def _ball_of(view: View, name: str, found: Observed) -> None:
    """A ball."""
    _add(view, name, found, lambda _: ball(0.55))


@symbol("block")
def _block_of(view: View, name: str, found: Observed) -> None:
    """A cube."""
    _add(view, name, found, lambda _: {"box": {"edges": [0.8, 0.8, 0.8]}})


def _add(view: View, name: str, found: Observed, solid: Callable[[list[float]], dict[str, Any]]) -> None:
    """A solid, a function of its axis, where a part is."""
    seat = seat_of(view, name)
    if seat is not None:
        found.drawn.append(entry(view, found, seat, solids=[solid(own_axis(view, seat))]))
