"""Values with a standard uncertainty, as a description of a stand writes them: '740250 +- 740 N/m'."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler
from pydantic_core import PydanticCustomError

from evolvent_base import units
from evolvent_base.schema import Annotation

_BETWEEN = re.compile(r"\+-|\+/-|±")
_UNKNOWN = re.compile(r"unknown(?:\s+near\s+(?P<near>.+))?", re.DOTALL)


def parts_of(text: str) -> list[str]:
    """What stands before, between and behind the signs of an uncertainty, "+-" and its like, without blanks."""
    return [part.strip() for part in _BETWEEN.split(text)]


@dataclasses.dataclass(frozen=True)
class Uncertain:
    """A value with its standard uncertainty, or an unknown.

    Attributes
    ----------
    value : float, SI; nan for an unknown of which nothing is known
    std : float, SI; 0 for a value that is exact, or whose uncertainty is not stated
    unknown : bool, to be found from the signals; then `value` is where to start, and with `std` another measurement
    """

    value: float
    std: float = 0.0
    unknown: bool = False


@dataclasses.dataclass(frozen=True, kw_only=True)
class Measured(Annotation):
    """A pydantic annotation: an `Uncertain` of a quantity.

    Parameters
    ----------
    quantity : units.Quantity
    unknown : bool, whether it may be asked for with the word 'unknown'
    """

    quantity: units.Quantity
    unknown: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        text = f"{self.quantity.allowed}, with +- and its standard uncertainty where known"
        return text + (", or 'unknown'" if self.unknown else "")

    def read(self, value: Any) -> Uncertain:
        """`value` from a number, a text, or a mapping with value and std."""
        if isinstance(value, Uncertain):
            return value
        try:
            if self.unknown and isinstance(value, str) and (match := _UNKNOWN.fullmatch(value.strip())):
                near = self._known(match["near"]) if match["near"] else Uncertain(math.nan)
                return dataclasses.replace(near, unknown=True)
            return self._known(value)
        except (PydanticCustomError, units.UnitError) as error:
            context = error.context if isinstance(error, PydanticCustomError) else {"reason": f"; {error}"}
            reason = (context or {}).get("reason", "")
            text = "it must be {allowed}{reason}"
            raise PydanticCustomError("quantity", text, {"allowed": self.allowed, "reason": reason}) from None

    def _known(self, value: Any) -> Uncertain:
        std: Any = 0.0
        if isinstance(value, Mapping):
            if not {"value"} <= set(value) <= {"value", "std"}:
                raise units.UnitError("a mapping has the keys value and std only")
            value, std = value["value"], value.get("std", 0.0)
        elif isinstance(value, str):
            parts = parts_of(value)
            if len(parts) > 2:
                raise units.UnitError("it has more than one +-")
            if len(parts) == 2:
                value, std = _shared_unit(*parts)
        number = float(self.quantity.read(value))
        if isinstance(std, str) and std.rstrip().endswith("%"):
            share = units.parse(std.rstrip()[:-1], "")
            deviation = abs(number) * share / 100.0
        else:
            free = dataclasses.replace(self.quantity, above=None, least=None, most=None)
            deviation = float(free.read(std))
        if not deviation >= 0.0:
            raise units.UnitError("a standard uncertainty is 0 or above")
        return Uncertain(number, deviation)

    def write(self, value: Uncertain) -> str:
        """`value` as a description holds it."""
        unit = f" {self.quantity.unit}" if self.quantity.unit else ""
        text = f"{value.value!r}" + (f" +- {value.std!r}" if value.std else "") + unit
        if not value.unknown:
            return text
        return "unknown" if math.isnan(value.value) else f"unknown near {text}"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number, a text, or value and std."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        pair = {
            "type": "object",
            "properties": {"value": {"anyOf": one}, "std": {"anyOf": one}},
            "required": ["value"],
            "additionalProperties": False,
        }
        return {"anyOf": [*one, pair], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class MeasuredList(units.OneOrMore):
    """A pydantic annotation: one `Uncertain` for all, or a list with one each; kept as a tuple."""

    quantity: Measured  # type: ignore[assignment]  # it reads, writes and says what is allowed as a `Quantity` does
    each: str = "one per spring"

    def read(self, value: Any) -> tuple[Uncertain, ...]:
        """`value` as a tuple, of length 1 where one stands for all."""
        if isinstance(value, (list, tuple)) and value:
            return tuple(self.quantity.read(v) for v in value)
        return (self.quantity.read(value),)

    def write(self, value: tuple[Uncertain, ...]) -> Any:
        """`value` as a description holds it."""
        texts = [self.quantity.write(v) for v in value]
        return texts[0] if len(texts) == 1 else texts


def _shared_unit(value: str, std: str) -> tuple[str, str]:
    """Both texts with a unit: where one has none it takes the other's."""
    first, second = units.split(value), units.split(std)
    if not first or not second:
        raise units.UnitError("both sides of +- must be numbers")
    if not second[2]:
        return value, f"{std} {first[2]}"
    if not first[2] and second[2] != "%":
        return f"{value} {second[2]}", std
    return value, std


def _kind(*, unknown: bool = False, **fields: Any) -> Measured:
    return Measured(quantity=units.Quantity(**fields), unknown=unknown)


def _position(unknown: bool = False) -> Measured:
    return _kind(what="a length", unit="m", example="0 +- 0.5 mm", unknown=unknown)


_MASS: dict[str, Any] = {"what": "a mass", "unit": "kg", "example": "15190 +- 3 kg"}
_INERTIA: dict[str, Any] = {"what": "a moment of inertia", "unit": "kg m^2", "example": "3703 +- 4 kg m^2"}
_STIFFNESS: dict[str, Any] = {"what": "a stiffness", "unit": "N/m", "example": "740250 +- 740 N/m"}
_LENGTH: dict[str, Any] = {"what": "a length", "unit": "m", "example": "2 m +- 0.3 mm", "above": 0.0}
_PRODUCT: dict[str, Any] = {"what": "a product of inertia", "unit": "kg m^2", "example": "0 +- 20 kg m^2"}

Position = Annotated[Uncertain, _position()]
PositionOrUnknown = Annotated[Uncertain, _position(unknown=True)]
Mass = Annotated[Uncertain, _kind(**_MASS, above=0.0)]
MassOrUnknown = Annotated[Uncertain, _kind(**_MASS, above=0.0, unknown=True)]
InertiaOrZero = Annotated[Uncertain, _kind(**_INERTIA, least=0.0)]
InertiaOrZeroOrUnknown = Annotated[Uncertain, _kind(**_INERTIA, least=0.0, unknown=True)]
MassOrZeroOrUnknown = Annotated[Uncertain, _kind(**_MASS, least=0.0, unknown=True)]
InertiaOrUnknown = Annotated[Uncertain, _kind(**_INERTIA, above=0.0, unknown=True)]
ProductOrUnknown = Annotated[Uncertain, _kind(**_PRODUCT, unknown=True)]
Length = Annotated[Uncertain, _kind(**_LENGTH)]
LengthOrUnknown = Annotated[Uncertain, _kind(**_LENGTH, unknown=True)]
LengthOrZero = Annotated[Uncertain, _kind(what="a length", unit="m", example="0.25 m +- 0.5 mm", least=0.0)]
Lengths = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_kind(**_LENGTH))]
Stiffnesses = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_kind(**_STIFFNESS, above=0.0))]
Laterals = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_kind(**_STIFFNESS, least=0.0))]
Dampings = Annotated[
    tuple[Uncertain, ...],
    MeasuredList(quantity=_kind(what="a damping coefficient", unit="N s/m", example="100 N s/m", least=0.0)),
]
FactorOrUnknown = Annotated[
    Uncertain, _kind(what="a plain number", unit="", example="1 +- 0.001", above=0.0, unknown=True)
]
Gravity = Annotated[Uncertain, _kind(what="an acceleration", unit="m/s^2", example="9.81553 +- 1e-5 m/s^2", above=0.0)]
Torsion = Annotated[
    Uncertain, _kind(what="a torsional stiffness", unit="N m/rad", example="0.35 +- 0.001 N m/rad", above=0.0)
]
TorsionOrZero = Annotated[
    Uncertain, _kind(what="a torsional stiffness", unit="N m/rad", example="0.01 +- 0.001 N m/rad", least=0.0)
]
Turn = Annotated[Uncertain, _kind(what="an angle", unit="rad", example="5 +- 1 deg", least=0.0, most=3.0)]
Density = Annotated[Uncertain, _kind(what="a density", unit="kg/m^3", example="1.204 +- 0.005 kg/m^3", least=0.0)]
Factor = Annotated[Uncertain, _kind(what="a plain number", unit="", example="1 +- 0.1", least=0.0)]

_READING = "one a reading"
LengthReadings = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_kind(**_LENGTH), each=_READING)]
MassReadings = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_kind(**_MASS, above=0.0), each=_READING)]
PeriodReadings = Annotated[
    tuple[Uncertain, ...],
    MeasuredList(
        quantity=_kind(what="a period", unit="s", example="0.95692 +- 0.00002 s", above=0.0), each=_READING
    ),
]  # fmt: skip
AngleReadings = Annotated[
    tuple[Uncertain, ...],
    MeasuredList(
        quantity=_kind(what="an angle", unit="rad", example="55.7 +- 0.1 deg", least=-10.0, most=10.0), each=_READING
    ),
]  # fmt: skip
DistanceReadings = Annotated[tuple[Uncertain, ...], MeasuredList(quantity=_position(), each=_READING)]
Damping = Annotated[
    Uncertain, _kind(what="a damping ratio", unit="", example="0.01 +- 0.002", least=0.0, most=0.3)
]  # fmt: skip
