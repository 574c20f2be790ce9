"""Inputs and outputs of a linear model by name: "hub.torque.z", "boom.tip.displacement.y", "boom[5].force.x"."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.model.questions import LinearizedPoint
from evolvent.solvers.modal.positions import find_moving, nodal
from evolvent_base.errors import InputError, nearest

Array = np.ndarray

AXES = "xyz"


class Quantity(NamedTuple):
    """What an input or output is: whether it turns, its order of derivative by time, its unit."""

    turns: bool
    order: int
    unit: str


INPUTS = {"force": Quantity(False, 0, "N"), "torque": Quantity(True, 0, "N m")}
OUTPUTS = {
    "position": Quantity(False, 0, "m"),
    "displacement": Quantity(False, 0, "m"),
    "velocity": Quantity(False, 1, "m/s"),
    "acceleration": Quantity(False, 2, "m/s2"),
    "rotation": Quantity(True, 0, "rad"),
    "rate": Quantity(True, 1, "rad/s"),
    "angular_acceleration": Quantity(True, 2, "rad/s2"),
}


class Channel(NamedTuple):
    """One input or output.

    Attributes
    ----------
    name : str
    point : str, as the name has it
    quantity : Quantity
    row : (nv,) float
        Displacement or rotation along the axis per unit of the velocities' coordinates; of an input also the
        generalised forces of 1 N or 1 N m (virtual work).
    at_rest : float, value of a position at the equilibrium, m; 0 of all others
    """

    name: str
    place: str
    quantity: Quantity
    row: Array
    at_rest: float


def channels(
    kind: str,
    names: Sequence[str],
    known: dict[str, LinearizedPoint],
    assembly: Assembly,
    quantities: dict[str, Quantity],
) -> list[Channel]:
    """Channels of names; a name without an axis stands for all three.

    Parameters
    ----------
    kind : {"inputs", "outputs"}, as messages call them
    names : sequence of str, "point.quantity.axis" or "point.quantity"
    known : points by name (`evolvent.solvers.modal.positions.linearized_points`)
    assembly : Assembly
    quantities : `INPUTS` or `OUTPUTS`

    Raises
    ------
    InputError
        For a name that is not known, with the nearest one that is.
    """
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise InputError(f"{kind} is {names!r}; it must be a list of names such as {_example(known, quantities)!r}")
    found: list[Channel] = []
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"{kind} holds {name!r}; give names such as {_example(known, quantities)!r}")
        found.extend(_channels_of(kind, name, known, assembly, quantities))
    seen: set[str] = set()
    for channel in found:
        if channel.name in seen:
            raise InputError(f"{kind} holds {channel.name!r} twice")
        seen.add(channel.name)
    return found


def _example(known: dict[str, LinearizedPoint], quantities: dict[str, Quantity]) -> str:
    place = next(iter(known))
    return f"{place}.{_of(known[place], quantities)[0]}.x"


def _of(place: LinearizedPoint, quantities: dict[str, Quantity]) -> list[str]:
    """Quantities that a point has."""
    maps = place.displacement, place.rotation
    return [name for name, quantity in quantities.items() if maps[quantity.turns] is not None]


def _channels_of(
    kind: str, name: str, known: dict[str, LinearizedPoint], assembly: Assembly, quantities: dict[str, Quantity]
) -> list[Channel]:
    words = name.rsplit(".", 2)
    if len(words) >= 2 and (words[-1] in quantities or ".".join(words[:-1]) in known):
        words = [".".join(words[:-1]), words[-1], ""]
    if len(words) < 3:
        words = [name, "", ""]
    where, what, axis = words
    if where not in known:
        _refuse_point(kind, name, where, what, axis, known, assembly, quantities)
    place, having = known[where], _of(known[where], quantities)
    if what not in having:
        options = [_joined(where, word, axis) for word in having]
        raise InputError(f"{kind} holds {name!r}; {nearest(name, options)}")
    if axis not in ("", *AXES):
        raise InputError(f"{kind} holds {name!r}; {nearest(name, [_joined(where, what, a) for a in AXES])}")
    quantity = quantities[what]
    T = place.rotation if quantity.turns else place.displacement
    assert T is not None
    found = []
    for i, letter in enumerate(AXES):
        if axis in ("", letter):
            row = np.zeros(int(assembly.model.info.nv))
            row[place.where] = T[i]
            at_rest = float(place.position[i]) if what == "position" else 0.0
            found.append(Channel(f"{where}.{what}.{letter}", where, quantity, row, at_rest))
    return found


def _joined(where: str, what: str, axis: str) -> str:
    return ".".join(word for word in (where, what, axis) if word)


def _refuse_point(
    kind: str, name: str, where: str, what: str, axis: str, known: dict[str, LinearizedPoint], assembly: Assembly,
    quantities: dict[str, Quantity],
) -> None:  # fmt: skip
    """Raise InputError for a name whose point is not known."""
    part, _, node = where.partition("[")
    row = assembly.names.get(part)
    own = None if f"{part}.root" not in known or row is None else nodal(assembly, part)
    if row is not None and own is not None:
        ends = f"'{part}.root', '{part}.tip' or '{part}[0]' to '{part}[{own[0] - 1}]'"
        raise InputError(f"{kind} holds {name!r}; a point of the {row[0][:-1]} {part!r} is {ends}")
    if row is not None and not node:
        find_moving(assembly, part)
    # nodes by number would fill the message
    places = [place for place in known if not place.endswith("]")]
    options = [_joined(place, what, axis) for place in places if not what or what in _of(known[place], quantities)]
    if not what:
        options = [f"{place}.{word}.x" for place in places for word in _of(known[place], quantities)]
    raise InputError(f"{kind} holds {name!r}; {nearest(name, options or places)}")
