"""Equal parts in a row, round a ring or without a place of their own, written once in a case file."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Part, Reference
from evolvent_base import units
from evolvent_base.dense import norm
from evolvent_base.errors import InputError
from evolvent_base.schema import Section, marks, shown
from evolvent_base.units.orientation import product, quaternion_about

#: Key of a part that is repeated.
KEY = "repeat"
#: Parts that a case may have after repetition.
MOST = 10_000
#: The number of a part in a text: {n}, {n-1}, {n+1}.
_NUMBER = re.compile(r"\{n(?:([+-])(\d{1,4}))?\}")
#: The number at the end of a name.
NUMBERED = re.compile(rf" {_NUMBER.pattern}$")
#: Keys in inertial axes by kind: positions, which move and turn; vectors, which turn; and orientations.
_INERTIAL: dict[str, tuple[str, str, str]] = {
    "rigid-body": ("position", "velocity direction", "orientation"),
    "point": ("position", "velocity", ""),
    "beam": ("position", "direction normal velocity angular_velocity", ""),
    "rod": ("position", "direction normal velocity angular_velocity", ""),
    "shell": ("position", "direction normal velocity angular_velocity", ""),
    "joint": ("position", "axis axis_b anchor", ""),
    "joint-spring": ("", "axis zero", ""),
    "spring": ("", "axis", ""),
}
#: Keys in the axes of the part itself or of its body, which stay.
_OWN: dict[str, str] = {
    "rigid-body": "inertia points angular_velocity axis",
    "beam": "curvature",
    "rod": "curvature",
    "attitude-controller": "axis",
}
#: Keys with many places or directions, which do not move along.
_STANDING: dict[str, str] = {"shell": "normals start start_normals"}
#: Keys that must be given on a ring, since they turn along.
_TURNING: dict[str, str] = {"beam": "normal", "rod": "normal", "shell": "direction normal"}
#: Keys whose defaults are places and directions too.
_WITH_DEFAULTS = {"position", "orientation", "direction", "axis"}


#: Keys of `Repeat` that apply only beside others.
APPLIES: Applies = {
    "step": (left_out("axis"),),
    "axis": (left_out("step"),),
    "center": (given("axis"),),
    "angle": (given("axis"),),
}


class Repeat(Section):
    """How a part is repeated: `count` equal parts, in a row (`step`), round a ring (`axis`), or with numbers alone."""

    count: Annotated[int, units.Whole(least=1, most=1000)] = Field(description="number of parts")
    first: Annotated[int, units.Whole(least=0, most=1_000_000)] = Field(
        1, description="number of the first part, which is the one that is written"
    )
    step: units.Position | None = Field(None, description="in a row: from each part to the next, inertial axes")
    axis: units.Direction | None = Field(None, description="of a ring: its axis, inertial axes")
    center: units.Position | None = Field(None, description="of a ring: a point on its axis; the origin if left out")
    angle: units.Angle | None = Field(
        None, description="of a ring: from each part to the next; a whole turn by count if left out"
    )

    def check(self, key: str) -> None:
        """Refuse keys that exclude one another.

        Raises
        ------
        InputError
        """
        if self.step is not None and self.axis is not None:
            raise InputError(f"{key}.step and {key}.axis are both given; a row has a step, a ring an axis")
        for name in ("center", "angle"):
            if getattr(self, name) is not None and self.axis is None:
                raise InputError(f"{key}.{name} is given without {key}.axis, to which it belongs")

    @property
    def closes(self) -> bool:
        """Whether the last part of a ring is the neighbour of the first one."""
        return self.axis is not None and self.angle is None

    def numbered(self, value: Any, k: int) -> Any:
        """A value of the part of index `k` (from 0): its numbers put into texts."""
        if isinstance(value, str):
            return _NUMBER.sub(lambda found: str(self._number(k, found)), value)
        if isinstance(value, Mapping):
            return {self.numbered(key, k): self.numbered(one, k) for key, one in value.items()}
        return [self.numbered(one, k) for one in value] if isinstance(value, (list, tuple)) else value

    def _number(self, k: int, found: re.Match[str]) -> int:
        at = k + int(f"{found[1]}{found[2]}" if found[2] else 0)
        return self.first + (at % self.count if self.closes else at)

    def motion(self, k: int) -> _Motion:
        """What takes the first part to the place of that of index `k`."""
        if self.axis is None:
            return _Motion((1.0, 0.0, 0.0, 0.0), np.zeros(3), k * np.array(self.step or (0.0, 0.0, 0.0)))
        angle = 2.0 * math.pi * k / self.count if self.angle is None else k * self.angle
        return _Motion(quaternion_about(self.axis, angle), np.array(self.center or (0.0, 0.0, 0.0)), np.zeros(3))


@dataclasses.dataclass(frozen=True)
class _Motion:
    """A turn about a centre, and a shift.

    Attributes
    ----------
    turn : (4,) float, quaternion
    center, shift : (3,) float, m
    """

    turn: tuple[float, float, float, float]
    center: np.ndarray
    shift: np.ndarray

    def vector(self, value: Any) -> np.ndarray:
        """A vector (3,), turned."""
        return _matrix(self.turn) @ np.array(value, dtype=float)

    def position(self, value: Any) -> np.ndarray:
        """A position (3,), m, turned about the centre and shifted."""
        return self.center + self.vector(np.array(value) - self.center) + self.shift

    def on_body(self, local: Any, position: Any, orientation: Any) -> np.ndarray:
        """A point (3,), m, in the axes of a body that does not move with it.

        Parameters
        ----------
        local : (3,) float, m, body axes
        position : (3,) float, m; orientation : (4,) float, of the body
        """
        R = _matrix(orientation)
        moved: np.ndarray = R.T @ (self.position(np.array(position) + R @ np.array(local)) - np.array(position))
        return moved


def _matrix(quaternion: Any) -> np.ndarray:
    R, q4 = np.empty((3, 3)), np.array(quaternion, dtype=float)
    rotation_from_quaternion(*(q4 / norm(q4)), R)
    return R


def repeated(
    name: str, given: Mapping[str, Any], how: Repeat, part: Part, key: str, fixed: Mapping[str, Part]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """The parts for which one stands: names and keys.

    Parameters
    ----------
    name : str, of the part as it is written
    given : mapping, its keys, without `KEY`
    how : Repeat
    part : Part, the first of them
    key : str, of the part in messages
    fixed : mapping, parts that are not repeated

    Raises
    ------
    InputError
        For keys that cannot be repeated; the sentence names the key.
    """
    how.check(f"{key}.{KEY}")
    _check_keys(part, how, key)
    for k in range(how.count):
        content = how.numbered(given, k)
        if k > 0 and (how.step is not None or how.axis is not None):
            content |= _moved(given, part, how, k, key, fixed)
        yield f"{name} {how.first + k}", content


def _check_keys(part: Part, how: Repeat, key: str) -> None:
    """Refuse keys that hold places or directions of which it is not known how they move along."""
    if how.step is None and how.axis is None:
        return
    kind = type(part).model_fields["kind"].default
    known = {word for words in _INERTIAL.get(kind, ()) for word in words.split()} | set(_OWN.get(kind, "").split())
    for name in part.model_fields_set - known:
        field = type(part).model_fields[name]
        vectors = [one for one in marks(field) if isinstance(one, (units.Vector, units.Tensor))]
        moves = any(one.quantity.unit == "m" or how.axis is not None for one in vectors if getattr(one, "size", 3) == 3)
        standing = _STANDING.get(kind, "").split() + (["file"] if how.axis is not None else [])
        if moves or name in ("nodes", "rates") or name in standing:
            raise InputError(
                f"{key}.{name} cannot be repeated {'on a ring' if how.axis is not None else 'in a row'}; give {KEY} a "
                f"count alone, or write the parts out"
            )
    for name in _TURNING.get(kind, "").split() if how.axis is not None else ():
        if name not in part.model_fields_set:
            raise InputError(f"{key}.{name} is missing; on a ring it must be given, for it turns along")


def _moved(
    given: Mapping[str, Any], part: Part, how: Repeat, k: int, key: str, fixed: Mapping[str, Part]
) -> dict[str, Any]:
    """Keys of the part of index `k` that differ from those of the first one by its place."""
    kind, motion = type(part).model_fields["kind"].default, how.motion(k)
    positions, vectors, orientations = (set(words.split()) for words in _INERTIAL.get(kind, ("", "", "")))
    found: dict[str, Any] = {}
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        follows = name == "position" and getattr(part, "at", None) is not None
        if value is None or (name not in given and (name not in _WITH_DEFAULTS or follows or _is_defined(part, name))):
            continue
        if name in positions:
            found[name] = motion.position(value).tolist()
        elif name in vectors and how.axis is not None:
            found[name] = motion.vector(value).tolist()
        elif name in orientations and how.axis is not None:
            found[name] = list(product(motion.turn, value))
        else:
            mark = next((one for one in marks(field) if isinstance(one, Reference) and one.points), None)
            if mark is not None:
                where, raw = f"{key}.{name}", given.get(name, value)
                pairs = zip(value, mark.each(raw), strict=True) if mark.several else ((value, raw),)
                ends = [_end(one, text, how, k, where, fixed) for one, text in pairs]
                moved = ends if mark.several else ends[0]
                if moved != value:
                    found[name] = how.numbered(moved, k)
    return found


def _is_defined(part: Part, name: str) -> bool:
    """Whether another part says what stands at a key that is left out: a joint or a driven body its axis."""
    driven = getattr(part, "drive", None) is not None and getattr(part, "type", "") == "revolute"
    return name == "axis" and (driven or getattr(part, "joint", None) is not None)


def _end(value: Any, given: Any, how: Repeat, k: int, key: str, fixed: Mapping[str, Part]) -> Any:
    """A point of another part, or of the ground, for the part of index `k`."""
    if isinstance(value, str):
        return given
    if not isinstance(value[0], str):
        return how.motion(k).position(value).tolist()
    name, local = value
    if _NUMBER.search(str(given[0])):
        return [given[0], list(local)]  # a point of a part that is repeated as well, in its own axes
    if name == "ground":
        return [name, how.motion(k).position(local).tolist()]
    body = fixed.get(name)
    position, orientation = getattr(body, "position", None), getattr(body, "orientation", None)
    if position is None or orientation is None or getattr(body, "at", None) is not None:
        raise InputError(
            f"{key} is {shown(given)}; a repeated point must be on the ground, on a body with a position of its own, "
            f"or on a part of the same number, such as '{name} {{n}}'"
        )
    return [name, how.motion(k).on_body(local, position, orientation).tolist()]
