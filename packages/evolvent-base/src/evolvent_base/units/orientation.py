"""Orientations: a quaternion, an axis with an angle, or Euler angles with their order."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import GetJsonSchemaHandler
from pydantic_core import PydanticCustomError

from evolvent_base.schema import shown
from evolvent_base.units.parsing import is_list
from evolvent_base.units.quantities import Quantity, Vector

_ANGLE = Quantity(what="an angle", unit="rad", example="10 deg")
_AXIS = Vector(quantity=Quantity(what="a plain number", unit="", example="0.5"), direction=True)
_ANGLES = Vector(quantity=_ANGLE)
#: Readers of the keys of each form beside the quaternion; None of the order of Euler angles.
_FORMS: tuple[dict[str, Any], ...] = ({"axis": _AXIS, "angle": _ANGLE}, {"euler": _ANGLES, "order": None})
#: Orders of Euler angles: no axis follows itself.
ORDERS = [a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c]


class Turned(tuple[float, ...]):
    """A quaternion that knows the form in which it was given.

    Parameters
    ----------
    values : (4,) float, of length 1, scalar part first
    given : mapping, what `Orientation` has read
    """

    given: Mapping[str, Any]

    def __new__(cls, values: Sequence[float], given: Mapping[str, Any]) -> Turned:
        """The quaternion."""
        found = super().__new__(cls, values)
        found.given = given
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """How it is copied."""
        return Turned, (tuple(self), dict(self.given))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Orientation(Vector):
    """A pydantic annotation: a quaternion (scalar part first), or one of two mappings, kept as a `Turned`.

    ``{axis: [0, 0, 1], angle: 90 deg}`` is a turn about an axis. ``{euler: [10 deg, 0, 5 deg], order: xyz}`` are three
    turns after one another: small letters are the fixed axes of the frame that the orientation is given in (extrinsic),
    capital letters the axes as the turns before have left them (intrinsic). Orders are those of
    ``scipy.spatial.transform.Rotation.from_euler``.
    """

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        return (
            super().allowed
            + ", or a mapping such as {axis: [0, 0, 1], angle: 90 deg} or {euler: [10 deg, 0, 5 deg], order: xyz}"
        )

    def inner_keys(self) -> Mapping[str, Any]:
        """Types of the keys that may be set one by one."""
        return {"axis": (tuple, _AXIS), "angle": (float, _ANGLE), "euler": (tuple, _ANGLES), "order": (str, None)}

    def read(self, value: Any) -> tuple[float, ...]:
        """`value` as a quaternion; a `PydanticCustomError` says what is allowed."""
        if isinstance(value, Turned):
            return value
        if is_list(value):  # whose errors say what is wrong with a quaternion
            return Vector(quantity=self.quantity, size=4, direction=True, normalised=True).read(value)
        if not isinstance(value, Mapping):
            raise PydanticCustomError("quantity", "it must be {allowed}", {"allowed": self.allowed})
        form = next((form for form in _FORMS if set(form) == set(value)), None)
        if form is None:
            raise PydanticCustomError("quantity", "it must be {allowed}", {"allowed": self.allowed})
        given: dict[str, Any] = {}
        for key, reader in form.items():
            try:
                given[key] = _order(value[key]) if reader is None else reader.read(value[key])
            except PydanticCustomError as error:
                context = {"key": key, "value": shown(value[key]), "message": error.message()}
                raise PydanticCustomError("quantity", "its key {key} is {value}; {message}", context) from None
        if "axis" in given:
            return Turned(quaternion_about(given["axis"], given["angle"]), given)
        return Turned(quaternion_of_euler(given["euler"], given["order"]), given)

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it, in the form in which it was given."""
        if not isinstance(value, Turned):
            return super().write(value)
        form = next(form for form in _FORMS if set(form) == set(value.given))
        return {key: one if form[key] is None else form[key].write(one) for key, one in value.given.items()}

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array, or an object of one of the forms."""
        array = super().__get_pydantic_json_schema__(schema, handler)
        choices: list[dict[str, Any]] = [{key: one for key, one in array.items() if key != "description"}]
        orders = {"enum": [*ORDERS, *(order.upper() for order in ORDERS)]}
        for form in _FORMS:
            properties = {
                key: orders if reader is None else reader.__get_pydantic_json_schema__(schema, handler)
                for key, reader in form.items()
            }
            choices.append(
                {"type": "object", "properties": properties, "required": list(form), "additionalProperties": False}
            )
        return {"anyOf": choices, "description": self.allowed}


def _order(value: Any) -> str:
    """An order of Euler angles."""
    if not isinstance(value, str) or value not in (*ORDERS, *(order.upper() for order in ORDERS)):
        allowed = (
            "it must be three letters such as xyz or zxz, none twice in a row: small ones are fixed axes (extrinsic), "
            "capital ones turned axes (intrinsic)"
        )
        raise PydanticCustomError("quantity", "{allowed}", {"allowed": allowed})
    return value


def product(p: Sequence[float], q: Sequence[float]) -> tuple[float, float, float, float]:
    """Product (4,) of two quaternions, scalar part first: the turn q, then p, both about fixed axes."""
    a, b, c, d = p
    e, f, g, h = q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def quaternion_about(axis: Sequence[float], angle: float) -> tuple[float, float, float, float]:
    """Quaternion (4,), scalar part first, of a turn about an axis of any length.

    Parameters
    ----------
    axis : (3,) float
    angle : float, rad
    """
    size = math.sin(0.5 * angle) / math.hypot(*axis)
    x, y, z = axis
    return math.cos(0.5 * angle), size * x, size * y, size * z


def quaternion_of_euler(angles: Sequence[float], order: str) -> tuple[float, float, float, float]:
    """Quaternion (4,), scalar part first, of three turns after one another.

    Parameters
    ----------
    angles : (3,) float, rad
    order : str, axes of the turns: small letters are fixed axes, capital letters turned ones
    """
    turns = [
        quaternion_about([float(axis == letter) for letter in "xyz"], angle)
        for axis, angle in zip(order.lower(), angles, strict=True)
    ]
    # turns about turned axes are those about fixed axes in the opposite order
    return functools.reduce(product, turns if order.isupper() else turns[::-1])
