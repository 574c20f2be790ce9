"""Keys that hold names of files: marked in the schema, found in what a user writes, and known by the files' content."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from pydantic_core import PydanticCustomError

from evolvent_base import safe_open, schema
from evolvent_base.errors import InputError


@dataclasses.dataclass(frozen=True, eq=False)
class FileKey:
    """A pydantic annotation: the key is the name of a file, or may be.

    Every key whose file is read must have it: results are kept under the content of the files that it marks.

    Parameters
    ----------
    endings : of names that are files; empty where every text is one
    rows : function of a name that returns what the key would hold in the place of the file: the rows of a table
    reads : function of a name that returns the paths of all files that are read for it; the name itself if left out
    """

    endings: tuple[str, ...] = ()
    rows: Callable[[str], Any] | None = None
    reads: Callable[[str], Iterable[str]] | None = None

    def paths(self, value: Any) -> list[str]:
        """Paths of the files that are read for a value; none where it names no file."""
        if not isinstance(value, str) or not value:
            return []
        if self.reads is not None:
            return list(self.reads(value))
        return [value] if not self.endings or value.lower().endswith(self.endings) else []

    def may_be(self, text: str) -> bool:
        """Whether a text may name a file: one of `endings` is anywhere in it."""
        return not self.endings or any(ending in text.lower() for ending in self.endings)


def in_place(kind: type[schema.Section], content: Mapping[str, Any]) -> dict[str, Any]:
    """A case as it is written, with rows in the place of the files of its tables.

    A table that cannot be read keeps its name; what is wrong with it is said where the case is checked.
    """
    found: dict[str, Any] = _with_rows(_whole(kind), content)
    return found


def value_in_place(kind: type[schema.Section], key: str, value: Any, content: Mapping[str, Any]) -> Any:
    """The value of a dotted key of a case, with rows in the place of files; as it is where the case has no such key."""
    try:
        return _with_rows(schema.locate(kind, key, content), value)
    except InputError:
        return value


def paths(kind: type[schema.Section], content: Mapping[str, Any]) -> list[str]:
    """Paths of all files that a case names, of parts that are repeated those of each."""
    return sorted({path for mark, value in _marked(_whole(kind), content) for path in mark.paths(value)})


def paths_of(section: schema.Section) -> list[str]:
    """Paths of all files that a checked section names, and those within it."""
    return sorted(set(_paths_of(section)))


def _paths_of(value: Any) -> Iterator[str]:
    if isinstance(value, schema.Section):
        for key, field in type(value).model_fields.items():
            own = getattr(value, key)
            for mark in schema.marks(field):
                if isinstance(mark, FileKey):
                    yield from mark.paths(own)
            yield from _paths_of(own)
    elif isinstance(value, Mapping):
        for one in value.values():
            yield from _paths_of(one)
    elif isinstance(value, tuple) and value and isinstance(value[0], schema.Section):
        for one in value:
            yield from _paths_of(one)


def digest(path: str) -> str:
    """SHA-256 of a file's bytes, hexadecimal; '' where it cannot be read, which is said where it is."""
    found = hashlib.sha256()
    try:
        with safe_open.binary(path) as file:
            while block := file.read(1 << 20):
                found.update(block)
    except (InputError, OSError):
        return ""
    return found.hexdigest()


def state(path: str | os.PathLike[str]) -> tuple[int, ...]:
    """What changes with a file or folder, other than its time of change, which any program may set.

    For pages that show large files alone: results are kept under `digest`.

    Raises
    ------
    OSError
    """
    found = os.stat(path)
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _whole(kind: type[schema.Section]) -> schema.Located:
    return schema.Located([(kind, ())], "", entry=False)


def _mark(place: schema.Located) -> Iterator[FileKey]:
    for _, own in place.types:
        yield from (mark for mark in own if isinstance(mark, FileKey))


def _with_rows(place: schema.Located, value: Any) -> Any:
    """A value as a user writes it, with rows in the place of files."""
    for mark in _mark(place):
        if mark.rows is not None and mark.paths(value):
            try:
                return mark.rows(value)
            except (InputError, PydanticCustomError):
                return value
    if isinstance(value, Mapping):
        return {name: _with_rows(schema.inner(place, str(name), value), one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_with_rows(schema.inner(place, str(k), value), one) for k, one in enumerate(value)]
    return value


def _marked(place: schema.Located, value: Any) -> Iterator[tuple[FileKey, Any]]:
    """Marks of a value as a user writes it, and what stands under each."""
    yield from ((mark, value) for mark in _mark(place))
    if isinstance(value, Mapping):
        stands = next((m for _, own in place.types for m in own if isinstance(m, schema.SectionsByName)), None)
        for name, one in value.items():
            inner = schema.inner(place, str(name), value)
            for own in (one,) if stands is None else stands.members_of(one):
                yield from _marked(inner, own)
    elif isinstance(value, list | tuple):
        for k, one in enumerate(value):
            yield from _marked(schema.inner(place, str(k), value), one)


def renamed(
    kind: type[schema.Section], content: Any, change: Callable[[str], str], key: str = "", case: Any = None
) -> Any:
    """Content of a case, or values of one of its keys, with all texts changed that may name files.

    Parameters
    ----------
    kind : of the case
    content : as it is written
    change : function of such a text
    key : str, dotted, of which `content` is a value, or several in lists and mappings
    case : mapping, the case that the key belongs to
    """
    place: schema.Located | None = schema.Located([(kind, ())], "", entry=False)
    for name in filter(None, key.split(".")):
        place = None if place is None else schema.within(place, name, case)
        case = case.get(name) if isinstance(case, Mapping) else None
    return content if place is None else _renamed(place, content, change)


def _renamed(place: schema.Located, content: Any, change: Callable[[str], str]) -> Any:
    names = [mark for _, own in place.types for mark in own if isinstance(mark, FileKey)]

    def inner(name: Any, value: Any) -> Any:
        found = schema.within(place, name, content) if isinstance(name, str) else None
        found = found or (place if names else None)
        return value if found is None else _renamed(found, value, change)

    if isinstance(content, Mapping):
        return {name: inner(name, value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [inner(str(k), value) for k, value in enumerate(content)]
    return change(content) if isinstance(content, str) and any(one.may_be(content) for one in names) else content
