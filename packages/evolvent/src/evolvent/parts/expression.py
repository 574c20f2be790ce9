"""Keys that hold a law: a Python function under `evolvent.law`, or an arithmetic expression."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.compiled.laws import FORMS
from evolvent.kernels import expression as kernels
from evolvent_base.errors import InputError
from evolvent_base.schema import Annotation
from evolvent_base.units import Quantity

#: Variables of the expressions of each kind of law.
VARIABLES = {
    "spring": ("x", "v", "t"),
    "force": ("x", "y", "z", "vx", "vy", "vz", "t"),
    "torque": (
        "x", "y", "z", "vx", "vy", "vz", "t", "r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33",
    ),
    "drive": ("t",),
    "feedback": ("t", "x", "v"),
    "surface": ("u", "v"),
    "height": ("x", "y"),
}  # fmt: skip
#: Kinds with three numbers.
_VECTORS = ("force", "torque", "surface")
_EXAMPLES = {"spring": "k*x + k3*x**3", "force": "[-c*vx, -c*vy, -c*vz]", "drive": "a*(1 - cos(w*t))", "event": "t - 2",
             "feedback": "r - k*lag_rate", "torque": "[-c*vx, -c*vy, m*r11]",
             "surface": "[2*u, v, 0.1*u**2]", "height": "0.05*(x**2 + y**2)"}  # fmt: skip
_RUN = {
    "spring": kernels.spring_expression,
    "force": kernels.force_expression,
    "drive": kernels.drive_expression,
    "event": kernels.event_expression,
}
_SLOPES = {
    "spring": kernels.scalar_expression_slope,
    "force": kernels.force_expression_slope,
}


@dataclasses.dataclass(frozen=True)
class Law(Annotation):
    """A pydantic annotation: a compiled Python law, or the text of an expression (of a force, three texts).

    Parameters
    ----------
    kind : {"spring", "force", "torque", "drive", "event", "feedback", "surface", "height"}
    python : bool, whether a Python law is allowed
    """

    kind: str
    python: bool = True

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        example = _EXAMPLES[self.kind]
        text = f"{example!r}" if self.kind not in _VECTORS else f"three of them, {example}"
        function = f", or a function under @evolvent.law, {FORMS[self.kind].text}" if self.python else ""
        return f"an expression such as {text}{function}"

    def read(self, value: Any) -> Any:
        """`value`, an expression with single blanks."""
        if callable(value) and self.python:
            return value
        texts = value if self.kind in _VECTORS and isinstance(value, (list, tuple)) else [value]
        if not all(isinstance(text, str) for text in texts) or (self.kind in _VECTORS and len(texts) != 3):
            raise PydanticCustomError("law", "it must be {allowed}", {"allowed": self.allowed})
        try:
            found = tuple(expressions.check_grammar(text) for text in texts)
        except ValueError as error:
            raise PydanticCustomError("expression", "{why}", {"why": str(error)}) from None
        return found if self.kind in _VECTORS else found[0]

    def write(self, value: Any) -> Any:
        """`value` as a case file holds it."""
        if callable(value):
            name = getattr(value, "__name__", repr(value))
            raise InputError(
                f"the law {name!r} is a Python function, which a file cannot hold; give an expression, such as "
                f"{_EXAMPLES[self.kind]!r}, with its constants"
            )
        return list(value) if isinstance(value, tuple) else value

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A text, or three."""
        text: dict[str, Any] = {"type": "string"}
        if self.kind in _VECTORS:
            return {"type": "array", "items": text, "minItems": 3, "maxItems": 3, "description": self.allowed}
        return {**text, "description": self.allowed}


@dataclasses.dataclass(frozen=True)
class _Constants:
    """A pydantic annotation: constants of an expression by name."""

    allowed = "a mapping of names to plain numbers in SI units, such as {k: 10, k3: 4}"

    def read(self, value: Any) -> dict[str, float]:
        """Names and finite numbers."""
        if not isinstance(value, Mapping) or not all(expressions.is_name(key) for key in value):
            raise PydanticCustomError("constants", "it must be {allowed}", {"allowed": self.allowed})
        return {key: _number(number, self.allowed) for key, number in value.items()}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An object of numbers."""
        return {"type": "object", "additionalProperties": {"type": "number"}, "description": self.allowed}


@dataclasses.dataclass(frozen=True)
class _Parameters:
    """A pydantic annotation: parameters of a Python law, in the order in which it reads them."""

    allowed = "a list of plain numbers"

    def read(self, value: Any) -> tuple[float, ...]:
        """Finite numbers."""
        if isinstance(value, str) or not hasattr(value, "__iter__"):
            raise PydanticCustomError("parameters", "it must be {allowed}", {"allowed": self.allowed})
        return tuple(_number(number, self.allowed) for number in value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array of numbers."""
        return {"type": "array", "items": {"type": "number"}, "description": self.allowed}


def _number(value: Any, allowed: str) -> float:
    try:
        if not isinstance(value, bool) and isinstance(value, numbers.Real) and math.isfinite(value):
            return float(value)
    except OverflowError:
        pass
    raise PydanticCustomError("constants", "it must be {allowed}", {"allowed": allowed})


SpringLaw = Annotated[Any, Law("spring")]
ForceLaw = Annotated[Any, Law("force")]
DriveLaw = Annotated[Any, Law("drive")]
EventLaw = Annotated[Any, Law("event")]
#: x, y and z of u and v.
SurfaceExpressions = Annotated[tuple[str, ...], Law("surface", python=False)]
#: z of x and y.
HeightExpression = Annotated[str, Law("height", python=False)]
FeedbackLaw = Annotated[str, Law("feedback", python=False)]
#: An expression of t.
TimeExpression = Annotated[str, Law("drive", python=False)]
#: One of them, by which a study may vary it.
_Plain = Annotated[float, Quantity(what="a number in SI units", unit="", example="2.5")]
#: Constants of an expression, and parameters of a Python law.
Constants = Annotated[dict[str, _Plain], _Constants()]
Parameters = Annotated[tuple[_Plain, ...], _Parameters()]


def refuse_unused(where: str, constants: Mapping[str, float] | None, key: str, texts: Sequence[str]) -> None:
    """Refuse constants that none of the expressions uses.

    Parameters
    ----------
    where, key : str, the keys of the constants and of the expressions, for messages
    """
    used = {name for text in texts for name in expressions.names(text)}
    for name in constants or {}:
        if name not in used:
            shown = ", ".join(repr(text) for text in texts)
            raise InputError(f"{where} has {name!r}, which {key}, {shown}, does not use; leave it out, or use it")


def refuse_without_law(name: str, part: Any) -> None:
    """Refuse parameters or constants of a part that has no law."""
    for key in ("parameters", "constants"):
        if getattr(part, key):
            raise InputError(f"{name}.{key} is given without {name}.law, to which it belongs")


def write_law(builder: Builder, name: str, law: Any, kind: str, parameters: Sequence[float] = (),
              constants: Mapping[str, float] | None = None, *, key: str = "law", variables: Sequence[str] = (),
              before: Sequence[float] = ()) -> dict[str, int]:  # fmt: skip
    """Store the law of a row, and its parameters or constants; the times at which an expression jumps become breaks.

    Parameters
    ----------
    builder : Builder
    name : str, of the part
    law : compiled Python law, or expression
    kind : {"spring", "force", "torque", "drive", "event"}
    parameters : of a Python law; constants : of an expression
    key : str, the key that holds the law, for messages
    variables : of an expression; those of `VARIABLES` if left out
    before : numbers that stand before an expression's instructions

    Returns
    -------
    dict, the row's fields law, first and last

    Raises
    ------
    InputError
    """
    form = "force" if kind == "torque" else kind  # of the function, whose position goes on with the attitude
    if callable(law):
        if constants:
            raise InputError(f"{name}.constants are those of an expression; a Python law takes {name}.parameters")
        address = builder.law(law, kind, key=f"{name}.{key}")
        first, last = builder.parameters(parameters)
        return {"law": address, "first": first, "last": last}
    if len(parameters):
        raise InputError(f"{name}.parameters are those of a Python law; an expression takes {name}.constants")
    texts = law if kind in _VECTORS else (law,)
    known = variables or VARIABLES[kind]
    programs = [expressions.compile_expression(text, known, constants, name=f"{name}.{key}") for text in texts]
    refuse_unused(f"{name}.constants", constants, f"{name}.{key}", texts)
    builder.breaks.update(t for program in programs for t in program.corners if t > 0.0)
    code = [*before, *(number for program in programs for number in program.code)]
    shown = ", ".join(repr(program.text) for program in programs)
    what = "the expression" if len(programs) == 1 else "the expressions"
    return builder.expression(_RUN[form], form, code, f"{what} {shown}", _SLOPES.get(form))
