"""What a key of a case may hold, in which units: a quantity, a vector, a tensor, a whole number."""

from __future__ import annotations

import dataclasses
import math
import numbers
import re
from collections.abc import Sequence
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from evolvent_base.errors import counted
from evolvent_base.schema import Annotation, Section
from evolvent_base.units.parsing import (
    LARGEST,
    READ_AS_WRITTEN,
    UNIT_LENGTH,
    Measured,
    UnitError,
    is_list,
    split,
    to_float,
)
from evolvent_base.units.written import parse

#: Units with a zero of their own.
OFFSET = ("degC", "degF")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quantity(Annotation):
    """A pydantic annotation: a float in `unit`, read from a number or from a text with a unit.

    Parameters
    ----------
    what : str, with its article ("a length")
    unit : str, SI, '' for a plain number
    example : str, a valid text
    above, least, most, below : float, optional bounds (`above` and `below` themselves are excluded)
    auto : bool, whether the word 'auto' is a value too
    difference : bool, whether it is a change, which no unit with a zero of its own (degC, degF) measures
    """

    what: str
    unit: str
    example: str
    above: float | None = None
    least: float | None = None
    most: float | None = None
    below: float | None = None
    auto: bool = False
    difference: bool = False

    @property
    def bounded(self) -> str:
        """What it is, with its bounds."""
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
        return f"{self.what}{' and'.join(bounds)}"

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        text = f"{self.bounded}, such as {self.example!r}"
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
            if self.difference and (unit := unit_of(value)) in OFFSET:
                raise UnitError(f"{unit} has a zero of its own; write the change in {self.unit}")
            number = parse(value, self.unit) if isinstance(value, str) else to_float(value)
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
                return self._as_written(value, number)
        raise PydanticCustomError(
            "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": reason}
        )

    def _as_written(self, value: Any, number: float) -> float:
        """`number`, which knows the text that it was written as where people go on reading it in that unit."""
        if isinstance(value, str) and unit_of(value) in READ_AS_WRITTEN.get(self.unit, ()):
            return Measured(number, self.unit, value.strip())
        return value if isinstance(value, Measured) and value.text and value.unit == self.unit else number

    def write(self, value: float | str) -> float | str:
        """`value` as a case file holds it: exact, with its unit."""
        if isinstance(value, Measured) and value.text:
            return value.text
        return f"{value!r} {self.unit}" if self.unit and isinstance(value, float) else value

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number within the bounds, or a text."""
        number: dict[str, Any] = {"type": "number"}
        bounds = {"exclusiveMinimum": self.above, "minimum": self.least, "maximum": self.most}
        for key, bound in {**bounds, "exclusiveMaximum": self.below}.items():
            if bound is not None:
                number[key] = bound
        return {"anyOf": [number, {"type": "string", "examples": [self.example]}], "description": self.allowed}


@dataclasses.dataclass(frozen=True)
class Either(Annotation):
    """A pydantic annotation: a float of one of several quantities, which the meaning of another key decides.

    Parameters
    ----------
    quantities : tuple of Quantity
    """

    quantities: tuple[Quantity, ...]

    @property
    def unit(self) -> str:
        """The units, as words."""
        return " or ".join(one.unit for one in self.quantities)

    def meant(self, *, second: bool | None) -> Quantity | Either:
        """The quantity that is meant, of two; itself where it is not known."""
        return self if second is None else self.quantities[second]

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        examples = " or ".join(repr(one.example) for one in self.quantities)
        whats = [*(one.what for one in self.quantities[:-1]), self.quantities[-1].bounded]
        return f"{' or '.join(whats)}, such as {examples} (a plain number is in {self.unit})"

    def read(self, value: Any) -> float | str:
        """`value` in SI units, a `Measured` where it has a unit; a `PydanticCustomError` says what is allowed."""
        reasons = []
        for quantity in self.quantities:
            if isinstance(value, Measured) and value.unit != quantity.unit:
                continue
            try:
                found = quantity.read(value)
            except PydanticCustomError as error:
                reasons.append(str((error.context or {}).get("reason", "")))
                continue
            if isinstance(found, Measured):
                return found
            has_unit = isinstance(value, Measured) or unit_of(value)
            return Measured(found, quantity.unit) if has_unit else found
        meant = [reason for reason in reasons if "did you mean" in reason or reasons.count(reason) > 1]
        raise PydanticCustomError(
            "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": meant[0] if meant else ""}
        )

    def write(self, value: float) -> float | str:
        """`value` as a case file holds it: exact, with its unit where it has been given one."""
        return value.text or f"{value!r} {value.unit}" if isinstance(value, Measured) else value

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number, or a text."""
        text = {"type": "string", "examples": [one.example for one in self.quantities]}
        return {"anyOf": [{"type": "number"}, text], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class OneOrMore(Annotation):
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

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """One value or an array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        return {"anyOf": [*one, {"type": "array", "items": {"anyOf": one}}], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Vector(Annotation):
    """A pydantic annotation: a list of values of one `Quantity`, kept as a tuple of floats.

    Where the last entry alone has a unit, it is the unit of all: ``[20, 0, 5 cm]``.

    Parameters
    ----------
    quantity : Quantity or Either
    size : int, how many values; 0 for any number
    direction : bool, whether the values must not all be zero
    empty : bool, whether there may be none
    normalised : bool, whether the sum of the squares must be 1, to within `UNIT_LENGTH`
    """

    quantity: Quantity | Either
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
            f" {self.quantity.unit.partition(' or ')[0]}" if self.quantity.unit else ""
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
                return _of_usual_size(found) if self.direction else found  # type: ignore[return-value]
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
        """`value` as a case file holds it: its unit stands in the last entry, or as written in each."""
        if not self.quantity.unit or not value:
            return list(value)
        if any(isinstance(v, Measured) and v.text for v in value):
            return [self.quantity.write(v) for v in value]
        first = [float(v) if isinstance(v, Measured) else v for v in value[:-1]]
        return [*first, self.quantity.write(value[-1])]

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        sizes = {"minItems": self.size, "maxItems": self.size} if self.size else {"minItems": int(not self.empty)}
        return {"type": "array", "items": {"anyOf": one}, **sizes, "description": self.allowed}


def _of_usual_size(direction: Sequence[Any]) -> tuple[Any, ...]:
    """A direction whose squares are numbers above 0: one of extreme length is divided by its largest component."""
    largest = max(map(abs, direction))
    return tuple(direction) if 1e-100 < largest < 1e100 else tuple(v / largest for v in direction)


def _check_length(values: Sequence[Any]) -> None:
    """Refuse a quaternion whose length differs from 1 by more than `UNIT_LENGTH`."""
    length = math.hypot(*values)
    if abs(length - 1.0) > UNIT_LENGTH:
        raise UnitError(f"its length is {length:.6g}; normalised it is {[v / length for v in values]}")


def units_as_written(value: Any) -> set[str]:
    """Units in which people go on reading values (`READ_AS_WRITTEN`), of a value, of lists and of sections of keys."""
    if isinstance(value, Measured):
        return {unit_of(value.text)} - {""}
    if isinstance(value, Section):
        inner: Any = [getattr(value, key) for key in type(value).model_fields]
    else:
        inner = value if isinstance(value, (list, tuple)) else ()
    return {unit for one in inner for unit in units_as_written(one)}


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
    return to_float(value) if isinstance(value, numbers.Real) else float(value)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tensor(Annotation):
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

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """One value or an array."""
        one = self.quantity.__get_pydantic_json_schema__(schema, handler)["anyOf"]
        array = {"type": "array", "minItems": 3, "maxItems": 3}
        return {"anyOf": [*one, array], "description": self.allowed}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Blocks(Annotation):
    """A pydantic annotation: a square matrix of blocks, of 3 x 3 values if not of other `widths`, each of a `Quantity`.

    A list of values alone is a diagonal matrix. Entries are numbers or texts with a unit; a file holds plain numbers.

    Parameters
    ----------
    what : str, with its article
    quantities : rows of Quantity, one for each block
    widths : tuple of int, rows and columns of the blocks, where they are not all 3
    """

    what: str
    quantities: tuple[tuple[Quantity, ...], ...]
    widths: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self._blocks)

    @property
    def _blocks(self) -> list[int]:
        """The block of each row."""
        widths = self.widths or (3,) * len(self.quantities)
        return [k for k, width in enumerate(widths) for _ in range(width)]

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        units = ", ".join("|".join(one.unit for one in row) for row in self.quantities)
        return f"{self.what}: {self.size} rows of {self.size} values, or the {self.size} on its diagonal, in {units}"

    def read(self, value: Any) -> tuple[tuple[float, ...], ...]:
        """`value` as rows of floats."""
        n, rows, of = self.size, [], self._blocks
        given = list(value) if is_list(value) else []
        if len(given) == n and not any(map(is_list, given)):
            given = [[one if i == k else 0.0 for k in range(n)] for i, one in enumerate(given)]
        if len(given) != n or any(not is_list(row) or len(row) != n for row in given):
            shape = f"{len(given)} x {len(given[0])}" if given and is_list(given[0]) else counted(len(given), "value")
            reason = f"; it has {shape}" if given else ""
            raise PydanticCustomError(
                "quantity", "it must be {allowed}{reason}", {"allowed": self.allowed, "reason": reason}
            )
        for i, row in enumerate(given):
            found = []
            for k, one in enumerate(row):
                try:
                    found.append(float(self.quantities[of[i]][of[k]].read(one)))
                except PydanticCustomError as error:
                    message = f"its entry ({i + 1}, {k + 1}) is {one!r}; {error.message()}"
                    raise PydanticCustomError("quantity", "{message}", {"message": message}) from None
            rows.append(tuple(found))
        return tuple(rows)

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it: plain numbers."""
        return [list(row) for row in value]

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array."""
        return {"type": "array", "minItems": self.size, "maxItems": self.size, "description": self.allowed}


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
