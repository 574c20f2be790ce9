"""Keys of a description that are neither numbers nor texts: columns, points, directions."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from evolvent_base.schema import Annotation
from evolvent_massprops import uncertain
from evolvent_massprops.uncertain import Uncertain

DIRECTIONS = {"x": (1.0, 0.0, 0.0), "vertical": (0.0, 1.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Key(Annotation):
    """A pydantic annotation with a `read` of its own."""

    allowed = ""

    def refuse(self) -> PydanticCustomError:
        """The error that says what is allowed."""
        return PydanticCustomError("value", "it must be {allowed}", {"allowed": self.allowed})

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """What is allowed, in words."""
        return {"description": self.allowed}


class ColumnKey(Key):
    """A column of a recording."""

    allowed = "a column's name, or its number from 1"

    def read(self, value: Any) -> str | int:
        """The value as it is kept."""
        if isinstance(value, bool) or not isinstance(value, (str, int)) or value == "":
            raise self.refuse()
        return value


class TextKey(Key):
    """A number or a text with a unit, whose unit the sensor gives."""

    def __init__(self, allowed: str) -> None:
        self.allowed = allowed

    def read(self, value: Any) -> str:
        """The value as it is kept."""
        if isinstance(value, bool) or not isinstance(value, (str, int, float)) or value == "":
            raise self.refuse()
        return str(value)


class PointKey(Key):
    """A point: that of a spring, or a position."""

    allowed = "the number of a spring, or three lengths (x, y, z), such as [2 m, 0 m, 0.87 m +- 1 mm]"
    _position = uncertain._position()

    def read(self, value: Any) -> int | tuple[Uncertain, ...]:
        """The value as it is kept."""
        if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
            return value
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            raise self.refuse()
        return tuple(self._position.read(v) for v in value)

    def write(self, value: Any) -> Any:
        """The value as a file has it."""
        return value if isinstance(value, int) else [self._position.write(v) for v in value]


class DirectionKey(Key):
    """A direction of a sensor."""

    allowed = "vertical, x, y, z, or three numbers that are not all zero"

    def read(self, value: Any) -> str | tuple[float, ...]:
        """The value as it is kept."""
        if isinstance(value, str) and value in DIRECTIONS:
            return value
        numbers = isinstance(value, (list, tuple)) and all(isinstance(v, (int, float)) for v in value)
        if not numbers or len(value) != 3 or not any(value) or not np.all(np.isfinite(value)):
            raise self.refuse()
        return tuple(float(v) for v in value)

    def write(self, value: Any) -> Any:
        """The value as a file has it."""
        return value if isinstance(value, str) else list(value)
