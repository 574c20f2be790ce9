"""Part: what every part is - a section of keys that writes itself into the model - and how parts name one another."""

from __future__ import annotations

import contextlib
import dataclasses
import enum
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, get_origin

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import check_name, split_reference
from evolvent.parts.applies import Applies
from evolvent_base import units
from evolvent_base.dense import norm
from evolvent_base.errors import InputError
from evolvent_base.schema import Annotation, Section, marks

__all__ = [
    "Arrays",
    "Group",
    "Part",
    "PointReference",
    "Reference",
    "Spread",
    "check_name",
    "kind_of",
    "split_reference",
    "unit",
]


class Group(enum.StrEnum):
    """Groups of kinds of parts, in the order in which a structure is built up."""

    BODIES = "bodies, beams and threads"
    JOINTS = "joints"
    SPRINGS = "springs and resistances"
    CONTROL = "motors, control and events"
    CONTACT = "contact"
    LOADS = "loads and fields"
    OTHERS = "of other packages"


class Spread(NamedTuple):
    """Nodes of a part along which loads and joints act, at the start.

    Attributes
    ----------
    nodes : (k,) int, numbers
    shares : (k,) float, m, lengths that they stand for, or of a `surface` areas, m2
    tangents : (k, 3) float, unit vectors along the line, inertial axes
    """

    nodes: np.ndarray
    shares: np.ndarray
    tangents: np.ndarray
    surface: bool


class Part(Section):
    """A part: frozen, checked when it is made, with the same keys in Python and in case files.

    A subclass has a field ``kind`` with its name in case files, such as ``kind: Literal["point"] = "point"``, and says
    in `applies` which keys have a meaning only beside others, in `needed` which of these it needs there.
    """

    #: Keys that apply only under conditions on other keys; the rest apply always.
    applies: ClassVar[Applies] = {}
    #: Keys that may be left out only where they do not apply.
    needed: ClassVar[tuple[str, ...]] = ()
    #: Keys that may be given where they do not apply.
    always_allowed: ClassVar[tuple[str, ...]] = ()
    #: Group of kinds in which lists show it: one of `Group`, or a name of its own.
    group: ClassVar[str] = Group.OTHERS
    #: Whether it writes parts of its own, whose names begin with its name and a blank; others may refer to these.
    writes_others: ClassVar[bool] = False
    #: Symbol that stands for it in drawings, of `evolvent.results.observe.symbols`, beside what `observe` draws.
    symbol: ClassVar[str] = ""

    def write(self, builder: Builder, name: str) -> None:
        """Append rows, coordinates and parameters; register `name`."""
        raise NotImplementedError(f"{type(self).__name__} has no write()")

    def observe(self, view: Any, name: str, found: Any) -> None:
        """Add results of the part to those of its family.

        Parameters
        ----------
        view : evolvent.results.observe.View, of the finished run
        name : str, of the part
        found : evolvent.results.observe.Observed, results of its family; what it holds may be changed
        """

    @classmethod
    def acts_on_travel(cls, content: Mapping[str, Any], travels: Callable[[Any], bool]) -> bool | None:
        """Whether keys of an angle or a travel (`units.Either`) are of a travel, in a part as a case file holds it.

        None of parts that do not act on a coordinate.

        Parameters
        ----------
        travels : whether the coordinate of the part of a name, a joint or a spring of one, is a travel
        """
        return travels(content.get("joint")) if "joint" in cls.model_fields else None

    @classmethod
    def has_travel(cls, content: Mapping[str, Any], travels: Callable[[Any], bool]) -> bool:
        """Whether the coordinate of a part as a case file holds it is a travel, for what acts on it."""
        return bool(cls.acts_on_travel(content, travels))

    def as_keys(self) -> dict[str, Any]:
        """The part as plain values of a case file, with units: its kind, and what differs from the defaults."""
        given = self.model_dump(mode="json", exclude_defaults=True)
        return {"kind": type(self).model_fields["kind"].default, **given}

    def with_keys(self, **keys: Any) -> Self:
        """The part with other values of some keys."""
        return type(self)(**({key: getattr(self, key) for key in self.model_fields_set} | keys))

    def refined(self, name: str, parts: Mapping[str, Part]) -> Part:
        """The part with twice as many elements, each of half the length; itself where it has none.

        Parameters
        ----------
        name : str, of the part, for messages
        parts : mapping, name -> part, all of the system

        Raises
        ------
        InputError
            If a key holds what belongs to single nodes or elements.
        """
        return self

    def refined_node(self, node: int) -> int:
        """Number that a node has in the part as `refined`."""
        return 2 * node

    def spread(self, name: str, on: str | int | None) -> Spread | None:
        """Nodes of the part, or of what is called `on` on it, along which loads and joints act; None of other parts.

        Parameters
        ----------
        name : str, of the part; on : str or int, as of `split_reference`
        """
        return None

    def references(self) -> Iterator[str]:
        """Names of the parts that this one refers to, which must be written before it."""
        for key, field in type(self).model_fields.items():
            mark = next((m for m in marks(field) if isinstance(m, Reference)), None)
            if mark is not None:
                for name in mark.names(getattr(self, key)):
                    if name != "ground":
                        yield name


def kind_of(found: Any) -> str:
    """The name in case files of a class of parts; nothing of what is none, or only the base of some."""
    field = found.model_fields.get("kind") if isinstance(found, type) and issubclass(found, Part) else None
    return field.default if field is not None and get_origin(field.annotation) is Literal else ""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reference(Annotation):
    """A pydantic annotation: a reference to another part.

    Parameters
    ----------
    what : str, with its article ("a body")
    points : bool, whether a point on the part may be meant: "boom.tip", "boom[5]", ("hub", (x, y, z)), or (x, y, z) of
        the ground
    several : bool, whether a list of names is wanted
    alone : bool, whether one of `several` may stand without a list
    edges : bool, whether an edge of the part may be meant: "panel.x0"
    """

    what: str
    points: bool = False
    several: bool = False
    alone: bool = False
    edges: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, as the end of a sentence."""
        if self.points and self.several and not self.alone:
            return (
                f"a list of {self.what}, each a part's name, 'boom.tip', 'boom[5]', [hub, [0, 0, 1 m]], or a position "
                f"on the ground"
            )
        if self.points:
            return (
                f"{self.what}: a part's name, 'boom.tip', 'boom[5]', [hub, [0, 0, 1 m]], or a position on the ground, "
                f"[0, 0, 1 m]{', or a list of these' if self.alone else ''}"
            )
        return f"a list of names of {self.what}" if self.several else f"the name of {self.what}"

    def names(self, value: Any) -> Iterator[str]:
        """Names of parts in a value that was read."""
        if value is None:
            return
        if isinstance(value, str):
            yield split_reference(value)[0]
        elif self.several:
            for one in value:
                if self.points:
                    yield from _POINT.names(one)
                else:
                    yield split_reference(one)[0]
        elif isinstance(value[0], str):
            yield value[0]

    def each(self, value: Any) -> Any:
        """The single references of a value of `several`, as they were typed."""
        if self.alone:
            with contextlib.suppress(PydanticCustomError):
                return [value] if isinstance(value, str) or _POINT.read(value) else value
        return value

    def read(self, value: Any) -> Any:
        """A name as it is; (name, position) and positions as tuples."""
        value = self.each(value)
        try:
            if isinstance(value, str) and not self.several:
                name, point = split_reference(value)
                if point is None or self.points or (self.edges and isinstance(point, str)):
                    return value.strip()
                raise InputError(f"{name!r} alone is meant")
            if not units.is_list(value) or (self.alone and not value):
                raise InputError("it is no list, or an empty one")
            if self.several and self.points:
                return tuple(_POINT.read(one) for one in value)
            if self.several:
                return tuple(v if split_reference(v)[1] is None else _refuse(v) for v in value)
            if self.points and len(value) == 2 and isinstance(value[0], str):
                return value[0], _POSITION.read(value[1])
            if self.points and len(value) == 3:
                return _POSITION.read(value)
        except (InputError, PydanticCustomError, TypeError, AttributeError):
            pass
        raise PydanticCustomError("reference", "it must be {allowed}", {"allowed": self.allowed})

    def write(self, value: Any) -> Any:
        """A value as a case file holds it."""
        if value is None or isinstance(value, str):
            return value
        if self.several:
            found = [_POINT.write(one) for one in value] if self.points else list(value)
            return found[0] if self.alone and len(found) == 1 else found
        return [value[0], _POSITION.write(value[1])] if isinstance(value[0], str) else _POSITION.write(value)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A text, or a list."""
        if self.several and not self.alone:
            items = {"anyOf": [{"type": "string"}, {"type": "array"}]} if self.points else {"type": "string"}
            return {"type": "array", "items": items, "description": self.allowed}
        if self.points:
            return {"anyOf": [{"type": "string"}, {"type": "array"}], "description": self.allowed}
        return {"type": "string", "description": self.allowed}


def _refuse(value: str) -> str:
    raise InputError(value)


_POSITION = units.Vector(quantity=units.Quantity(what="a length", unit="m", example="1 m"))
_POINT = Reference(what="a point", points=True)
#: A point on a body, a node of a beam, a point mass, or a position on the ground.
PointReference = Annotated[str | tuple[str, units.Triple] | units.Triple, _POINT]
PointReferences = Annotated[
    tuple[str | tuple[str, units.Triple] | units.Triple, ...], Reference(what="points", points=True, several=True)
]
BodyName = Annotated[str, Reference(what="a body")]
JointName = Annotated[str, Reference(what="a joint")]
CoordinateName = Annotated[str, Reference(what="a spring of a joint, or a joint")]
CoordinateNames = Annotated[tuple[str, ...], Reference(what="springs of joints, or joints", several=True)]
ReelName = Annotated[str, Reference(what="a reel")]


@dataclasses.dataclass(frozen=True)
class Arrays:
    """A pydantic annotation: an array of finite numbers, kept as nested tuples; `shape` says what it holds."""

    shape: str

    def read(self, value: Any) -> Any:
        """Nested tuples of floats."""
        try:
            array = np.array(value, dtype=float)
        except (TypeError, ValueError):
            array = np.full(1, np.nan)
        if array.ndim == 0 or not np.all(np.isfinite(array)):
            raise PydanticCustomError("array", "it must be finite numbers, {shape}", {"shape": self.shape})
        return _nested(array.tolist())

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer to nested lists."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: np.asarray(value).tolist(), when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """An array."""
        return {"type": "array", "description": self.shape}


def _nested(value: Any) -> Any:
    return tuple(_nested(v) for v in value) if isinstance(value, list) else value


def unit(direction: Any) -> np.ndarray:
    """(3,) float of length 1, of a direction that is not zero."""
    array = np.array(direction, dtype=float)
    return array / norm(array)
