"""Values with units: what a case file writes, kept as SI floats."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
import numbers
import re
from collections.abc import Mapping, Sequence, Set
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from evolvent.base import startup
from evolvent.base.errors import counted

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
#: Longest text of a unit, and what none needs: a power of a power, of a number but 10, or above 99, each of which may
#: take the units library forever.
_LONGEST_UNIT = 100
_TOWER = re.compile(
    r"(?:\*\*|\^)(?:[\s(+-]*\d{3}|[\s(+-]*[\d.]+[\s)]*(?:\*\*|\^))"  # m^100, m^2^3
    r"|(?<![A-Za-z_])(?!10\b)\d+[\d.]*\s*(?:\*\*|\^)"  # 9^9
    r"|\d\s*(?:\*\*|\^)\s*\("  # 10^(9*9)
    r"|\)\s*(?:\*\*|\^).*\)\s*(?:\*\*|\^)"  # ((m)^9)^9
)
#: Digits of exponents that stand high.
_RAISED, _LOWERED = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+"), str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")

#: Units that are read without the units library, which takes a moment to load: factor to the SI unit of the key.
COMMON: dict[str, dict[str, float]] = {
    "": {},
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0},
    "s": {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    "kg": {"kg": 1.0, "g": 0.001},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "rad/s": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "kg m^2": {"kg m^2": 1.0, "g m^2": 0.001},
    "kg/m": {"kg/m": 1.0, "g/m": 0.001},
    "N/m": {"N/m": 1.0, "kN/m": 1000.0},
    "N s/m": {"N s/m": 1.0},
    "Pa": {"Pa": 1.0, "uPa": 1e-6, "MPa": 1e6, "GPa": 1e9},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1000.0},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "m^4": {"m^4": 1.0, "cm^4": 1e-8, "mm^4": 1e-12},
    "N m/rad": {"N m/rad": 1.0, "N m": 1.0},
    "N m s/rad": {"N m s/rad": 1.0, "N m s": 1.0},
    "1/s": {"1/s": 1.0},
    "1/K": {"1/K": 1.0},
    "K": {"K": 1.0},
    "K/m": {"K/m": 1.0},
    "1/m": {"1/m": 1.0},
}
#: Units of contact laws, whose dimension other keys decide (exponent n, law): what may stand for them.
OF_CONTACT = {"N/m^n": r"N/m(\^\d+(\.\d+)?)?", "s/m": "s/m|N s/m"}

#: Largest size of a value, in SI units, and the inverse of the least: far beyond any that can be meant, and near enough
#: for products of several to be finite.
LARGEST = 1e30
#: Deviation of the length of a quaternion from 1 that is taken for rounding; it is then normalised.
UNIT_LENGTH = 1e-3


class UnitError(ValueError):
    """A text that is no value of the wanted kind; the message says why."""


def is_list(value: Any) -> bool:
    """Whether a value is a list, a tuple or an array: no text, and nothing whose entries have no order."""
    return hasattr(value, "__len__") and not isinstance(value, (str, bytes, Mapping, Set))


def _float(value: numbers.Real) -> float:
    """`value` as a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value == abs(value) else -math.inf


@functools.cache
def _registry() -> Any:
    return startup.load("pint").UnitRegistry()


def parse(text: str, unit: str) -> float:
    """The value of `text` in `unit`.

    Parameters
    ----------
    text : str, a number and a unit ('0.735 g/m', '0.004 kg m^2' or 'kg m2', '30 rpm'); a number alone is in `unit`
    unit : str, the wanted unit, '' for none

    Raises
    ------
    UnitError
        If the text is not a number with a unit of the same dimension.
    """
    match = split(text)
    if match is None:
        raise UnitError("it is not a number with a unit")
    value, given = float(match[1]), " ".join(match[2].split())
    if not given:
        return value
    if given == unit:
        return value
    if given in COMMON.get(unit, {}):
        return value * COMMON[unit][given]
    if unit in OF_CONTACT:
        if re.fullmatch(OF_CONTACT[unit], given):
            return value
        raise UnitError(f"{given!r} is a unit of something else, or not of SI")
    if unit.startswith("rad") and re.search(r"hertz|Hz\b", given):
        raise UnitError("hertz does not say whether it counts turns or radians")
    exponents = re.sub(r"(?<=[A-Za-z])(-?[2-6])(?![\w.])", r"^\1", given)  # "kg m2" and "m/s2" as well
    try:
        return float(_registry().Quantity(value, known(exponents)).to(known(unit)).magnitude)
    except startup.load("pint").DimensionalityError:
        raise UnitError(f"{_cut(given)!r} is a unit of something else") from None
    except Exception:  # noqa: BLE001  (the units library raises many kinds of errors on what it cannot read)
        raise UnitError(f"{_cut(given)!r} is not a known unit") from None


def known(unit: str) -> Any:
    """A unit as the units library holds it.

    Raises
    ------
    UnitError
        If the library does not know it, or could take very long to read it.
    """
    try:
        plain = _RAISED.sub(lambda digits: f"^{digits[0]}".translate(_LOWERED), unit)
        if len(unit) <= _LONGEST_UNIT and not _TOWER.search(plain):
            return _registry().parse_units(unit)
    except Exception:  # noqa: BLE001  (see `parse`)
        pass
    raise UnitError(f"{_cut(unit)!r} is not a known unit")


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST_UNIT else f"{text[:40]}..."


def split(text: Any) -> re.Match[str] | None:
    """A number in group 1 and what follows it in group 2; None of what begins with no number."""
    return _NUMBER.fullmatch(text.strip()) if isinstance(text, str) else None


def base_exponents(unit: str) -> dict[str, float] | None:
    """Exponents of base units, by their full names, in a coherent unit of SI; None of what is no such unit."""
    try:
        found = _registry().Quantity(1.0, known(unit)).to_base_units()
    except Exception:  # noqa: BLE001  (see `parse`)
        return None
    return dict(found.units._units) if found.magnitude == 1.0 else None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quantity:
    """A pydantic annotation: a float in `unit`, read from a number or from a text with a unit.

    Parameters
    ----------
    what : str, with its article ("a length")
    unit : str, SI, '' for a plain number
    example : str, a valid text
    above, least, most, below : float, optional bounds (`above` and `below` themselves are excluded)
    auto : bool, whether the word 'auto' is a value too
    """

    what: str
    unit: str
    example: str
    above: float | None = None
    least: float | None = None
    most: float | None = None
    below: float | None = None
    auto: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        unit = f" {self.unit}" if self.unit else ""
        bounds = []
        if self.above is not None:
            bounds.append(f" above {self.above:g}{unit if self.above else ''}")
        if self.least is not None:
            bounds.append(f" of {self.least:g}{unit if self.least else ''} or above")
        if self.most is not None:
            bounds.append(f" up to {self.most:g}{unit}")
        if self.below is not None:
            bounds.append(f" below {self.below:g}{unit}")
        text = f"{self.what}{' and'.join(bounds)}, such as {self.example!r}"
        if self.unit:
            text += f" (a plain number is in {self.unit})"
        return text + (", or 'auto'" if self.auto else "")

    def read(self, value: Any) -> float | str:
        """`value` in `unit`; a `PydanticCustomError` says what is allowed."""
        reason = ""
        if self.auto and value == "auto":
            return "auto"
        try:
            if isinstance(value, bool) or not isinstance(value, (str, numbers.Real)):
                raise UnitError("it is not a number")
            number = parse(value, self.unit) if isinstance(value, str) else _float(value)
            if not math.isfinite(number):
                raise UnitError("it is not finite")
            if abs(number) > LARGEST or (self.above == 0.0 and 0.0 < number < 1.0 / LARGEST):
                raise UnitError(f"its size is not between {1.0 / LARGEST:g} and {LARGEST:g}")
        except UnitError as error:
            reason = f"; {error}"
        else:
            high = (self.most is not None and number > self.most) or (self.below is not None and number >= self.below)
            low = self.least is not None and number < self.least
            if not (high or low or (self.above is not None and number <= self.above)):
                return number
        raise PydanticCustomError(
            "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": reason}
        )

    def write(self, value: float | str) -> float | str:
        """`value` as a case file holds it: exact, with its unit."""
        return f"{value!r} {self.unit}" if self.unit and isinstance(value, float) else value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer to a text with its unit."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number within the bounds, or a text."""
        number: dict[str, Any] = {"type": "number"}
        bounds = {"exclusiveMinimum": self.above, "minimum": self.least, "maximum": self.most}
        for key, bound in {**bounds, "exclusiveMaximum": self.below}.items():
            if bound is not None:
                number[key] = bound
        return {"anyOf": [number, {"type": "string", "examples": [self.example]}], "description": self.allowed}


class Measured(float):
    """A value whose unit was given, where another key decides which quantity it must be.

    Parameters
    ----------
    value : float, in SI units
    unit : str, the SI unit of its quantity
    """

    unit: str

    def __new__(cls, value: Any, unit: str = "") -> Measured:
        """The value, which knows its unit."""
        found = super().__new__(cls, value)
        found.unit = unit
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """How it is copied."""
        return Measured, (float(self), self.unit)


@dataclasses.dataclass(frozen=True)
class Either:
    """A pydantic annotation: a float of one of two quantities, which the meaning of another key decides.

    Parameters
    ----------
    one, other : Quantity
    """

    one: Quantity
    other: Quantity

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        return (
            f"{self.one.what} or {self.other.what}, such as {self.one.example!r} or {self.other.example!r} "
            f"(a plain number is in {self.one.unit} or {self.other.unit})"
        )

    def read(self, value: Any) -> float | str:
        """`value` in SI units, a `Measured` where it has a unit; a `PydanticCustomError` says what is allowed."""
        for quantity in (self.one, self.other):
            if isinstance(value, Measured) and value.unit != quantity.unit:
                continue
            with contextlib.suppress(PydanticCustomError):
                found = quantity.read(value)
                has_unit = isinstance(value, Measured) or unit_of(value)
                return Measured(found, quantity.unit) if has_unit else found
        raise PydanticCustomError("quantity", "it must be {allowed}", {"allowed": self.allowed})

    def write(self, value: float) -> float | str:
        """`value` as a case file holds it: exact, with its unit where it has been given one."""
        return f"{value!r} {value.unit}" if isinstance(value, Measured) else value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer to a text with its unit."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number, or a text."""
        text = {"type": "string", "examples": [self.one.example, self.other.example]}
        return {"anyOf": [{"type": "number"}, text], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class OneOrMore:
    """A pydantic annotation: one value of a `Quantity`, or a list of them (kept as a tuple).

    Parameters
    ----------
    quantity : Quantity
    each : str, what the values of a list belong to ("one per blade")
    """

    quantity: Quantity
    each: str

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        return f"{self.quantity.allowed}, or a list with {self.each}"

    def read(self, value: Any) -> Any:
        """`value` as a float or a tuple of floats."""
        try:
            if isinstance(value, (list, tuple)) and value:
                return tuple(self.quantity.read(v) for v in value)
            return self.quantity.read(value)
        except PydanticCustomError as error:
            reason = (error.context or {}).get("reason", "")
            context = {"allowed": self.allowed, "reason": reason}
            raise PydanticCustomError("quantity", "it must be {allowed}{reason}", context) from None

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it."""
        if isinstance(value, tuple):
            return [self.quantity.write(v) for v in value]
        return self.quantity.write(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """One value or an array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        return {"anyOf": [*one, {"type": "array", "items": {"anyOf": one}}], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Vector:
    """A pydantic annotation: a list of values of one `Quantity`, kept as a tuple of floats.

    Where the last entry alone has a unit, it is the unit of all: ``[20, 0, 5 cm]``.

    Parameters
    ----------
    quantity : Quantity
    size : int, how many values; 0 for any number
    direction : bool, whether the values must not all be zero
    empty : bool, whether there may be none
    normalised : bool, whether the sum of the squares must be 1, to within `UNIT_LENGTH`
    """

    quantity: Quantity
    size: int = 3
    direction: bool = False
    empty: bool = False
    normalised: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        unit = f" (plain numbers are in {self.quantity.unit})" if self.quantity.unit else ""
        number = f"{self.size} values" if self.size else "values"
        example = ", ".join(["1", "0", "0", "0"] if self.size == 4 else ["0", "0", "1"][: self.size or 2]) + (
            f" {self.quantity.unit}" if self.quantity.unit else ""
        )
        limit = ", of length 1" if self.normalised else ", not all zero" if self.direction else ""
        return f"a list of {number}, such as [{example}]{unit}{limit}"

    def read(self, value: Any) -> tuple[float, ...]:
        """`value` as a tuple of floats; a `PydanticCustomError` says what is allowed."""
        reason = ""
        try:
            if not is_list(value):
                raise UnitError("it is not a list")
            if len(value) != self.size if self.size else len(value) == 0 and not self.empty:
                raise UnitError(f"it has {counted(len(value), 'value')}")
            found = tuple(self.quantity.read(v) for v in shared_unit(list(value)))
            if not self.direction or any(found):
                if self.normalised:
                    _check_length(found)
                return found  # type: ignore[return-value]
            if self.normalised:
                raise UnitError("all are 0")
        except UnitError as error:
            reason = f"; {error}"
        except PydanticCustomError as error:
            reason = (error.context or {}).get("reason", "") or f"; one of its values is not {self.quantity.allowed}"
        raise PydanticCustomError(
            "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": reason + self._axis(value)}
        )

    def _axis(self, value: Any) -> str:
        """How a direction is written that is given by the name of an axis; '' for other values."""
        found = re.fullmatch(r"([-+]?)([xyz])", value.strip().lower()) if isinstance(value, str) else None
        if found is None or not self.direction or self.size != 3:
            return ""
        sign = -1 if found[1] == "-" else 1
        return f"; did you mean {[sign * (letter == found[2]) for letter in 'xyz']}?"

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it: its unit stands in the last entry."""
        if not self.quantity.unit or not value:
            return list(value)
        return [*value[:-1], self.quantity.write(value[-1])]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        sizes = {"minItems": self.size, "maxItems": self.size} if self.size else {"minItems": int(not self.empty)}
        return {"type": "array", "items": {"anyOf": one}, **sizes, "description": self.allowed}


def _check_length(values: Sequence[Any]) -> None:
    """Refuse a quaternion whose length differs from 1 by more than `UNIT_LENGTH`."""
    length = math.hypot(*values)
    if abs(length - 1.0) > UNIT_LENGTH:
        raise UnitError(f"its length is {length:.6g}; normalised it is {[v / length for v in values]}")


def shared_unit(values: list[Any]) -> list[Any]:
    """The entries of a list, all in the unit of the last one where that alone has one.

    Raises
    ------
    UnitError
        If some entries have units and others, not zero, have none, unless the last entry alone has one.
    """
    units = [unit_of(v) for v in values]
    if not any(units):
        return values
    plain = [isinstance(v, numbers.Real) or (isinstance(v, str) and _is_plain(v)) for v in values]
    if units[-1] and all(plain[:-1]):
        return [f"{v} {units[-1]}" for v in values[:-1]] + values[-1:]
    without = next((v for p, v in zip(plain, values, strict=True) if p and _number_of(v) != 0.0), None)
    if without is not None:
        with_unit = next(v for v, unit in zip(values, units, strict=True) if unit)
        raise UnitError(
            f"{with_unit!r} has a unit and {without!r} has none; give every value its unit, or one unit in the last "
            f"entry alone"
        )
    return values


def unit_of(value: Any) -> str:
    """The unit in a text such as "2 m"; '' of a number, and of a text that is none."""
    match = split(value)
    return "" if match is None else match[2]


def _is_plain(text: Any) -> bool:
    match = split(text)
    return match is not None and not match[2]


def _number_of(value: Any) -> float:
    return _float(value) if isinstance(value, numbers.Real) else float(value)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tensor:
    """A pydantic annotation: one value of a `Quantity` about every axis, three principal ones, or a 3 x 3 tensor.

    Lists are kept as tuples; where the last entry of a list alone has a unit, it is the unit of all.

    Parameters
    ----------
    quantity : Quantity
    """

    quantity: Quantity

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        return f"{self.quantity.allowed}, three principal ones, or the rows of a 3 x 3 tensor"

    def read(self, value: Any) -> Any:
        """`value` as a float, a tuple of three, or three of them."""
        reason = ""
        try:
            if not is_list(value):
                return self.quantity.read(value)
            row = Vector(quantity=self.quantity).read
            if len(value) != 3:
                raise UnitError(f"it has {counted(len(value), 'value')}")
            if not any(map(is_list, value)):
                return row(value)
            return tuple(row(v) for v in self._rows(value))
        except UnitError as error:
            reason = f"; {error}"
        except PydanticCustomError as error:
            reason = (error.context or {}).get("reason", "")
        raise PydanticCustomError(
            "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": reason}
        )

    def _rows(self, value: Any) -> list[Any]:
        """Rows of a tensor, the unit of the very last entry in each of them."""
        rows = [list(row) if is_list(row) else [row] for row in value]
        last = rows[-1][-1] if rows[-1] else 0.0
        match = split(last)
        if match is None or not match[2]:
            return rows
        for row in rows[:-1]:
            if row and (isinstance(row[-1], numbers.Real) or _is_plain(row[-1])):
                row[-1] = f"{row[-1]} {match[2]}"
        return rows

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it."""
        if not isinstance(value, tuple):
            return self.quantity.write(value)
        if not isinstance(value[0], tuple):
            return Vector(quantity=self.quantity).write(value)
        return [*(list(row) for row in value[:-1]), Vector(quantity=self.quantity).write(value[-1])]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """One value or an array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        array = {"type": "array", "minItems": 3, "maxItems": 3}
        return {"anyOf": [*one, array], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Whole:
    """A pydantic annotation: a whole number of at least `least` and at most `most`."""

    least: int
    most: int

    def read(self, value: Any) -> int:
        """`value` as an int."""
        if isinstance(value, str) and value.strip().isdecimal():
            value = float(value)
        number = int(value) if isinstance(value, numbers.Integral) else value
        whole = isinstance(number, (int, float)) and not isinstance(value, bool)
        if whole and self.least <= number <= self.most and number == int(number):
            return int(number)
        raise PydanticCustomError(
            "whole", "it must be a whole number from {least} to {most}", {"least": self.least, "most": self.most}
        )

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An integer within the bounds."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


_LENGTH: dict[str, Any] = {"what": "a length", "unit": "m", "example": "5 m"}
_TIME: dict[str, Any] = {"what": "a time", "unit": "s", "example": "2.5 s"}
_MASS: dict[str, Any] = {"what": "a mass", "unit": "kg", "example": "0.5 g"}

Length = Annotated[float, Quantity(**_LENGTH, above=0.0)]
LengthOrZero = Annotated[float, Quantity(**_LENGTH, least=0.0)]
Time = Annotated[float, Quantity(**_TIME)]
Duration = Annotated[float, Quantity(**_TIME, above=0.0)]
DurationOrZero = Annotated[float, Quantity(**_TIME, least=0.0)]
DurationOrAuto = Annotated[float | str, Quantity(**_TIME, above=0.0, auto=True)]
Mass = Annotated[float, Quantity(**_MASS, above=0.0)]
MassOrZero = Annotated[float, Quantity(**_MASS, least=0.0)]
_INERTIA = Quantity(what="a moment of inertia", unit="kg m^2", example="0.004 kg m^2", above=0.0)
_ANGULAR_RATE = Quantity(what="an angular rate", unit="rad/s", example="6 rad/s")
Inertia = Annotated[float, _INERTIA]
Inertias = Annotated[float | tuple[float, ...], OneOrMore(quantity=_INERTIA, each="the three principal moments")]
Angle = Annotated[float, Quantity(what="an angle", unit="rad", example="10 deg")]
AngularRate = Annotated[float, _ANGULAR_RATE]
AngularRates = Annotated[float | tuple[float, ...], OneOrMore(quantity=_ANGULAR_RATE, each="one per blade")]
PositiveRate = Annotated[float, Quantity(what="an angular velocity", unit="rad/s", example="1.1e-3 rad/s", above=0.0)]
GravitationalParameter = Annotated[
    float, Quantity(what="a gravitational parameter", unit="m^3/s^2", example="3.986e14 m^3/s^2", above=0.0)
]
LineDensity = Annotated[float, Quantity(what="a mass per length", unit="kg/m", example="0.735 g/m", above=0.0)]
Stiffness = Annotated[float, Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", above=0.0)]
DampingOrZero = Annotated[float, Quantity(what="a damping coefficient", unit="N s/m", example="1e-3 N s/m", least=0.0)]
PressureOrZero = Annotated[float, Quantity(what="a pressure", unit="Pa", example="4.56e-6 Pa", least=0.0)]
_SPEED = Quantity(what="a velocity", unit="m/s", example="0.1 m/s")
_FORCE = Quantity(what="a force", unit="N", example="0.1 N")
_TORQUE = Quantity(what="a torque", unit="N m", example="0.2 N m")
_PLAIN = Quantity(what="a plain number", unit="", example="0.5")
_FREQUENCY = Quantity(what="a frequency", unit="Hz", example="0.25 Hz", above=0.0)
Force = Annotated[float, _FORCE]
Torque = Annotated[float, _TORQUE]
LineForce = Annotated[float, Quantity(what="a force per length", unit="N/m", example="0.1 N/m")]
Frequency = Annotated[float, _FREQUENCY]
Speed = Annotated[float, _SPEED]
_ANGLE = Quantity(what="an angle", unit="rad", example="10 deg")
AngleOrLength = Annotated[float, Either(_ANGLE, Quantity(**_LENGTH))]
AngularRateOrSpeed = Annotated[float, Either(_ANGULAR_RATE, _SPEED)]
Triple = tuple[float, float, float]
Position = Annotated[Triple, Vector(quantity=Quantity(**_LENGTH))]
Velocity = Annotated[Triple, Vector(quantity=_SPEED)]
AngularVelocity = Annotated[Triple, Vector(quantity=_ANGULAR_RATE)]
Acceleration = Annotated[Triple, Vector(quantity=Quantity(what="an acceleration", unit="m/s^2", example="9.81 m/s^2"))]
ForceVector = Annotated[Triple, Vector(quantity=_FORCE)]
TorqueOrZero = Annotated[float, Quantity(what="a torque", unit="N m", example="0.2 N m", least=0.0)]
TorqueVector = Annotated[Triple, Vector(quantity=_TORQUE)]
LineForceVector = Annotated[Triple, Vector(quantity=Quantity(what="a force per length", unit="N/m", example="0.1 N/m"))]
_IMPULSE = Quantity(what="an impulse", unit="N s", example="-500 N s")
_PRODUCT = Quantity(what="a product of inertia", unit="kg m^2", example="20 kg m^2")
Coordinate = Annotated[float, Quantity(**_LENGTH)]
ImpulseVector = Annotated[Triple, Vector(quantity=_IMPULSE)]
RotationVector = Annotated[Triple, Vector(quantity=_ANGLE)]
Moments = Annotated[Triple, Vector(quantity=_INERTIA)]
Products = Annotated[Triple, Vector(quantity=_PRODUCT)]
Curvatures = Annotated[Triple, Vector(quantity=Quantity(what="a curvature", unit="1/m", example="0.1 1/m"))]
Times = Annotated[tuple[float, ...], Vector(quantity=Quantity(**_TIME), size=0)]
Direction = Annotated[Triple, Vector(quantity=_PLAIN, direction=True)]
Quaternion = Annotated[
    tuple[float, float, float, float], Vector(quantity=_PLAIN, size=4, direction=True, normalised=True)
]
Numbers = Annotated[tuple[float, ...], Vector(quantity=_PLAIN, size=0)]
StiffnessOrZero = Annotated[float, Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", least=0.0)]
Number = Annotated[float, Quantity(what="a plain number", unit="", example="0.5")]
Fraction = Annotated[float, Quantity(what="a plain number", unit="", example="0.9", least=0.0, most=1.0)]
Tolerance = Annotated[float, Quantity(what="a plain number", unit="", example="1e-8", above=0.0, most=0.1)]
AngleOrZero = Annotated[float, Quantity(what="an angle", unit="rad", example="10 deg", least=0.0)]
Modulus = Annotated[float, Quantity(what="a modulus", unit="Pa", example="70 GPa", above=0.0)]
PoissonRatio = Annotated[float, Quantity(what="a plain number", unit="", example="0.3", above=-1.0, below=0.5)]
Density = Annotated[float, Quantity(what="a density", unit="kg/m^3", example="1600 kg/m^3", above=0.0)]
Area = Annotated[float, Quantity(what="an area", unit="m^2", example="2 mm^2", above=0.0)]
ProductOfArea = Annotated[float, Quantity(what="a product of area", unit="m^4", example="-4 mm^4")]
ThermalExpansion = Annotated[float, Quantity(what="a thermal expansion", unit="1/K", example="24e-6 1/K")]
Temperature = Annotated[float, Quantity(what="a change of temperature", unit="K", example="50 K")]
TemperatureGradient = Annotated[float, Quantity(what="a gradient of temperature", unit="K/m", example="200 K/m")]
LineInertia = Annotated[float, Quantity(what="an inertia per length", unit="kg m", example="2e-5 kg m", above=0.0)]
LineProduct = Annotated[float, Quantity(what="an inertia per length", unit="kg m", example="2e-5 kg m")]
Gradings = Annotated[
    float | tuple[float, ...],
    OneOrMore(
        quantity=Quantity(what="a plain number", unit="", example="3", above=0.0), each="the length of each element"
    ),
]
Pair = Annotated[tuple[float, float], Vector(quantity=Quantity(**_LENGTH), size=2)]
Curvature = Annotated[Triple, Vector(quantity=Quantity(what="a curvature", unit="1/m", example="0.5 1/m"))]
SecondMoment = Annotated[float, Quantity(what="a second moment of area", unit="m^4", example="40 mm^4", above=0.0)]
InertiaTensor = Annotated[
    float | Triple | tuple[Triple, Triple, Triple],
    Tensor(quantity=Quantity(what="a moment of inertia", unit="kg m^2", example="0.004 kg m^2")),
]
_TURN_STIFFNESS: dict[str, Any] = {"what": "a rotational stiffness", "unit": "N m/rad", "example": "0.5 N m/rad"}
_TURN_DAMPING: dict[str, Any] = {"what": "a rotational damping", "unit": "N m s/rad", "example": "0.01 N m s/rad"}
RotationalStiffnessOrZero = Annotated[float, Quantity(**_TURN_STIFFNESS, least=0.0)]
RotationalDampingOrZero = Annotated[float, Quantity(**_TURN_DAMPING, least=0.0)]
ForceOrZero = Annotated[float, Quantity(what="a force", unit="N", example="0.1 N", least=0.0)]
TorqueOrForce = Annotated[float, Either(_TORQUE, _FORCE)]
TorqueOrForceLimit = Annotated[
    float,
    Either(
        Quantity(what="a torque", unit="N m", example="0.2 N m", above=0.0),
        Quantity(what="a force", unit="N", example="0.1 N", above=0.0),
    ),
]
RateLimit = Annotated[
    float,
    Either(
        Quantity(what="an angular rate", unit="rad/s", example="10 rpm", above=0.0),
        Quantity(what="a speed", unit="m/s", example="0.1 m/s", above=0.0),
    ),
]
CoordinateStiffnessOrZero = Annotated[
    float,
    Either(
        Quantity(**_TURN_STIFFNESS, least=0.0), Quantity(what="a stiffness", unit="N/m", example="1e4 N/m", least=0.0)
    ),
]
CoordinateDampingOrZero = Annotated[
    float,
    Either(
        Quantity(**_TURN_DAMPING, least=0.0),
        Quantity(what="a damping coefficient", unit="N s/m", example="1e-3 N s/m", least=0.0),
    ),
]
Gains = Annotated[
    float | tuple[float, ...],
    OneOrMore(quantity=Quantity(**_TURN_STIFFNESS, least=0.0), each="the three axes"),
]
RateGains = Annotated[
    float | tuple[float, ...], OneOrMore(quantity=Quantity(**_TURN_DAMPING, least=0.0), each="the three axes")
]
RateOrZero = Annotated[float, Quantity(what="an inverse time", unit="1/s", example="0.1 1/s", least=0.0)]
ContactStiffness = Annotated[
    float, Quantity(what="a contact stiffness", unit="N/m^n", example="1e6 N/m^1.5", above=0.0)
]
ContactDampingOrZero = Annotated[float, Quantity(what="a contact damping", unit="s/m", example="0.1 s/m", least=0.0)]
Exponent = Annotated[float, Quantity(what="a plain number", unit="", example="1.5", least=1.0)]
NumberOrZero = Annotated[float, Quantity(what="a plain number", unit="", example="0.3", least=0.0)]
PositiveNumber = Annotated[float, Quantity(what="a plain number", unit="", example="0.5", above=0.0)]
Parameters = Annotated[tuple[float, ...], Vector(quantity=_PLAIN, size=0, empty=True)]


def unit_text(unit: str) -> str:
    """A unit as a figure shows it: 'kg m2 s-1' -> 'kg m²/s'."""
    powers = str.maketrans("234", "²³⁴")
    above: list[str] = []
    below: list[str] = []
    for word in unit.split():
        letters = word.rstrip("-0123456789")
        power = word[len(letters) :]
        (below if power.startswith("-") else above).append(
            letters + power.lstrip("-").replace("1", "").translate(powers)
        )
    top = " ".join(above) or "1"
    if not below:
        return top if above else unit
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"
