"""What the annotations of a field of a case say of its form: units, limits, how lists and mappings are written."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from evolvent_base.schema import OneOf, Section
from evolvent_base.units import Either, Quantity, Whole


def section_of(annotation: Any) -> type[Section] | None:
    """The section that a field holds, alone or beside None."""
    kinds = [a for a in (get_args(annotation) or (annotation,)) if a is not NoneType]
    only = kinds[0] if len(kinds) == 1 else None
    if inspect.isclass(only) and issubclass(only, Section) and get_origin(annotation) is not tuple:
        return only
    return None


def direct(info: FieldInfo) -> Iterator[Any]:
    """Annotations of a field itself and of the types that a union offers, not of entries of lists."""
    yield from info.metadata
    if get_origin(info.annotation) in (Union, UnionType):
        for argument in get_args(info.annotation):
            yield from getattr(argument, "__metadata__", ())


def of_the_whole(mark: Any) -> bool:
    """Whether an annotation of a list says what the whole list must be, not each of its entries."""
    return bool(getattr(mark, "allowed", "")) and not isinstance(mark, (Quantity, Whole))


def structure_of(info: FieldInfo) -> str:
    """How a mapping is written that stands in one field; '' of a field of another kind."""
    choice = next((mark for mark in direct(info) if isinstance(mark, OneOf)), None)
    if choice is not None:
        return " or ".join(f"{{{name}: {_keys_of(kind)}}}" for name, kind in choice.kinds.items())
    found = [kind for kind in _sections(info.annotation) if get_origin(info.annotation) is not tuple]
    return " or ".join(_keys_of(kind) for kind in found)


def _keys_of(kind: type[Section]) -> str:
    """Keys of a mapping, with those of sections inside it that are written as mappings alone."""
    found = []
    for name, info in kind.model_fields.items():
        inner = section_of(info.annotation) if is_mapping_alone(info) else None
        found.append(f"{name}: {'...' if inner is None else _keys_of(inner)}")
    return f"{{{', '.join(found)}}}"


def rows_of(info: FieldInfo) -> str:
    """How a table is written whose columns are of quantities of their own; '' of a field that holds none."""
    for kind in (info.annotation, *get_args(info.annotation)):
        row = get_args(kind)[0] if get_origin(kind) is tuple else None
        if get_origin(row) is tuple and Ellipsis not in get_args(row):
            found = [next((mark for mark in _inner(one) if isinstance(mark, Quantity)), None) for one in get_args(row)]
            words = [re.sub("^an? ", "", mark.what) if mark else "..." for mark in found]
            units = [f" ({mark.unit})" if mark and mark.unit else "" for mark in found]
            return f"rows [{', '.join(map(''.join, zip(words, units, strict=True)))}]"
    return ""


def columns_of(info: FieldInfo) -> tuple[str, ...]:
    """What the columns of a table hold, with their units in brackets, of a field that takes rows; empty of others."""
    if any(isinstance(mark, OneOf) for mark in direct(info)):  # whose rows stand under the name of a kind
        return ()
    inner = (field.annotation for section in _sections(info.annotation) for field in section.model_fields.values())
    row = next((row for kind in (info.annotation, *inner) for row in _rows_in(kind)), None)
    return () if row is None else tuple(map(_column, get_args(row)))


def _rows_in(annotation: Any) -> Iterator[Any]:
    """Types of the rows of all tables of any length in an annotation."""
    found = get_args(annotation)
    if get_origin(annotation) is tuple and found[-1:] == (Ellipsis,):
        row = found[0]
        if get_origin(row) is tuple and len(get_args(row)) > 1 and Ellipsis not in get_args(row):
            yield row
        return
    if get_origin(annotation) is not Literal:
        for inner in found:
            yield from _rows_in(inner)


def _column(annotation: Any) -> str:
    mark = next((one for one in _inner(annotation) if isinstance(one, (Quantity, Either))), None)
    kinds = mark.quantities if isinstance(mark, Either) else [mark] if mark is not None else []
    what = " or ".join(re.sub("^an? ", "", one.what) for one in kinds) or "value"
    unit = " or ".join(one.unit for one in kinds if one.unit)
    return f"{what} ({unit})" if unit else what


def is_mapping_alone(info: FieldInfo) -> bool:
    """Whether a field holds one section or nothing, which is written as a mapping and in no shorter way."""
    return section_of(info.annotation) is not None and info.default is None and not info.metadata


def marks_of(info: FieldInfo) -> Iterator[Any]:
    """Annotations of a field for pydantic, also inside unions and tuples."""
    yield from info.metadata
    yield from _inner(info.annotation)


def _inner(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for argument in get_args(annotation):
        if get_origin(annotation) is not Literal:
            yield from _inner(argument)


def literals_of(annotation: Any) -> Iterator[tuple[Any, ...]]:
    """Choices of each `Literal` that a field allows, but for entries of lists."""
    if get_origin(annotation) is Literal:
        yield get_args(annotation)
        return
    if get_origin(annotation) is tuple:
        return
    for argument in get_args(annotation):
        yield from literals_of(argument)


def unit_of(mark: Any) -> str:
    """The unit of what an annotation reads; '' for none."""
    while not isinstance(mark, Quantity | Either):  # annotations of several values hold that of one
        inner = getattr(mark, "quantity", None) or getattr(mark, "each", None)
        if inner is None or isinstance(inner, str):
            return ""
        mark = inner
    return mark.unit


def shape_of(annotation: Any) -> str:
    """How a list is written that has no annotation."""
    plain = [a for a in (get_args(annotation) or (annotation,)) if a is not NoneType]
    whole = annotation if get_origin(annotation) is tuple else next((a for a in plain if get_origin(a) is tuple), None)
    if whole is None:
        return ""
    inner = get_args(whole)
    section = next(iter(_sections(whole)), None)
    if section is not None:
        return f"a list such as [{{{', '.join(f'{name}: ...' for name in section.model_fields)}}}]"
    if len(inner) > 1 and inner[-1] is not Ellipsis:
        return f"{len(inner)} values in brackets"
    return "a list in brackets"


def _sections(annotation: Any) -> Iterator[type[Section]]:
    if inspect.isclass(annotation) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from _sections(argument)


def written(info: FieldInfo, marks: list[Any]) -> Any:
    """A default as a case file holds it."""
    value = info.default
    for mark in marks:
        if not hasattr(mark, "write"):
            continue
        try:
            return (
                [mark.write(v) for v in value]
                if isinstance(mark, Quantity) and isinstance(value, tuple)
                else mark.write(value)
            )
        except (TypeError, AttributeError):
            continue
    kinds = get_args(info.annotation)
    if isinstance(value, tuple) and value and len(kinds) == len(value):
        writers = ([mark.write for mark in get_args(kind)[1:] if hasattr(mark, "write")] for kind in kinds)
        return [write[0](v) if write else v for write, v in zip(writers, value, strict=True)]
    return value
