"""What rigid bodies are drawn as."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from evolvent.assembly.references import split_reference
from evolvent.kernels import rigid
from evolvent.results.observe.view import View
from evolvent_base.errors import InputError

Array = np.ndarray
#: Radius of a bar as a share of the distance between the points that it joins; height of a disc, of its radius.
_BAR, _DISC = 0.03, 0.4


def solids_of(view: View, name: str, row: Any) -> list[dict[str, Any]]:
    """Solids of a body, as `view.drawing` takes them: its shape, or what stands for one that it does not state.

    Notes
    -----
    Without a shape: bars between the points of its joints and springs, where two joints that turn, or more, hold a body
    whose moments of inertia are equal and do not show its shape; else the box of uniform density with its mass and
    moments of inertia, whose edges a, b, c follow from a^2 = 6 (Iy + Iz - Ix)/m and so on; of a body without mass that
    turns about an axis a disc which reaches the points that other parts are attached to.
    """
    part, mass = view.part(name), float(row["mass"])
    own = _of_shape(getattr(part, "shape", None))
    if own:
        return own
    moments = np.diag(row["inertia"])
    if np.ptp(moments) <= 1e-9 * moments.max() and len(_points(view, name, _turns)) > 1:
        return _bars(
            _points(
                view, name, lambda part: _turns(part) or part.kind == "spring" or getattr(part, "type", "") == "link"
            )
        )
    if mass > 0.0 and np.any(moments):
        squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
        thin = 0.02 * np.sqrt(max(float(squares.max()), 0.0))
        return [{"box": {"edges": [max(float(np.sqrt(max(x, 0.0))), thin) for x in squares]}}]
    return _disc(view, name, row) if row["motion"] != rigid.FREE else []


def _of_shape(shape: Any, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> list[dict[str, Any]]:
    """Solids of a stated shape about its centre."""
    at = list(centre)
    match type(shape).__name__:
        case "Box":
            return [{"box": {"edges": list(shape.size), "centre": at}}]
        case "Cylinder":
            return [_cylinder(shape.radius, shape.length, at, list(shape.axis))]
        case "Sphere":
            angles = np.linspace(0.0, np.pi, 17)
            profile = [[-shape.radius * float(np.cos(a)), shape.radius * float(np.sin(a))] for a in angles]
            return [{"revolution": {"profile": profile, "centre": at, "axis": [0.0, 0.0, 1.0]}}]
        case "Capsule":
            return [_capsule(shape.radius, shape.length, at, list(shape.axis))]
        case "Plane":  # a thin disc below it
            ends = [[-0.01 * shape.size, 0.5 * shape.size], [0.0, 0.5 * shape.size]]
            return [{"revolution": {"profile": ends, "centre": at, "axis": list(shape.normal)}}]
    return []


def touched(view: View, shape: Any, body: int, centre: Array) -> list[dict[str, Any]]:
    """What is drawn of a shape that a contact states: nothing where its body is drawn by it, or by a symbol."""
    name = body_name(view, body)
    if shape == getattr(view.assembly.parts.get(name), "shape", None) or type(shape).__name__ == "Cylinder":
        return []
    solids = _of_shape(shape, centre.tolist())
    return [{"surface": {"body": name, "solids": solids}}] if solids else []


def body_name(view: View, index: int) -> str:
    """Name of a body, 'ground' for the ground."""
    return next(name for name, found in view.assembly.names.items() if found == ("bodies", index))


def _capsule(radius: float, length: float, centre: list[float], axis: list[float]) -> dict[str, Any]:
    """A capsule, as `evolvent.view.drawing` takes it."""
    profile = []
    for end in (-1.0, 1.0):
        for angle in np.linspace(0.0, 0.5 * np.pi, 9)[:: int(end)]:
            along = end * (0.5 * length + radius * float(np.cos(angle)))
            profile.append([along, radius * float(np.sin(angle))])
    return {"revolution": {"profile": profile, "centre": centre, "axis": axis}}


def _cylinder(radius: float, length: float, centre: list[float], axis: list[float]) -> dict[str, Any]:
    ends = [[-0.5 * length, radius], [0.5 * length, radius]]
    return {"revolution": {"profile": ends, "centre": centre, "axis": axis}}


def _bars(places: list[Array]) -> list[dict[str, Any]]:
    """Bars from point to point, and back to the first one of three or more."""
    ends = [*places, places[0]] if len(places) > 2 else places
    found = []
    for a, b in itertools.pairwise(ends):
        length = float(np.linalg.norm(b - a))
        middle, axis = (0.5 * (a + b)).tolist(), ((b - a) / length).tolist()
        found.append(_cylinder(_BAR * length, length, middle, axis))
    return found


def _disc(view: View, name: str, row: Any) -> list[dict[str, Any]]:
    """A disc about the axis of a body, as large as the points and drums that other parts have on it."""
    axis = np.asarray(row["axis"], dtype=float)
    reach = [0.0]
    for part, place in _attached(view, name):
        reach.append(float(np.linalg.norm(place - (place @ axis) * axis)) + float(getattr(part, "drum", 0.0) or 0.0))
    radius = max(reach)
    return [_cylinder(radius, _DISC * radius, [0.0, 0.0, 0.0], axis.tolist())] if radius > 0.0 else []


def _turns(part: Any) -> bool:
    """Whether a part is a joint that lets its ends turn."""
    return getattr(part, "kind", "") == "joint" and part.type in ("revolute", "spherical")


def _points(view: View, name: str, counts: Callable[[Any], bool]) -> list[Array]:
    """Points of a body, each once, that the parts which count are attached to."""
    found: list[Array] = []
    for part, place in _attached(view, name):
        if counts(part) and all(np.linalg.norm(place - other) > 1e-9 for other in found):
            found.append(place)
    return found


def _attached(view: View, name: str) -> Iterator[tuple[Any, Array]]:
    """Parts that refer to a body, and where on it, body axes; its centre of mass where no point is named."""
    points = getattr(view.part(name), "points", None) or {}
    for part in view.assembly.parts.values():
        fields = getattr(type(part), "model_fields", {})
        values = [getattr(part, key) for key in fields if key not in ("kind", "type", "points")]
        for value in [one for v in values for one in ([v] if _is_point(v) or not isinstance(v, tuple | list) else v)]:
            place = point_on(value, name, points)
            if place is not None:
                centre = getattr(part, "centre", None)
                yield part, np.array(centre, dtype=float) if isinstance(centre, tuple) else place


def _is_point(value: Any) -> bool:
    """Whether a value is a point in the axes of a body, such as ("hub", (0, 0, 1))."""
    return isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], tuple) and isinstance(value[0], str)


def point_on(value: Any, name: str, points: Any) -> Array | None:
    """The point that a reference names on a body; None of other references, and of what is none."""
    if _is_point(value):
        return np.array(value[1], dtype=float) if value[0] == name else None
    if not isinstance(value, str):
        return None
    try:
        owner, on = split_reference(value)
    except InputError:
        return None
    if owner != name or (on is not None and on not in points):
        return None
    return np.array(points[on] if on is not None else (0.0, 0.0, 0.0), dtype=float)
