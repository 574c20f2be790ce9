"""Where a case can hold a law of relaxation: a part's own key, or that of its material; and what puts one there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from evolvent import cases
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.parts.base import Part
from evolvent_base import schema
from evolvent_base.schema import OneOf, Section, SectionsByName


def places(content: Mapping[str, Any]) -> list[str]:
    """Dotted keys of a case that can hold a law of relaxation, of sections that are given and keys that apply.

    Raises
    ------
    InputError
        If the system of the case is not known.
    """
    return list(_places(cases.system_of(content).Case, content, ""))


def held(content: Mapping[str, Any], place: str) -> bool:
    """Whether a case holds a law at a place already."""
    for name in place.split("."):
        content = content[name] if isinstance(content, Mapping) and content.get(name) is not None else {}
    return bool(content)


def with_law(content: Mapping[str, Any], law: Mapping[str, Any], at: Sequence[str]) -> dict[str, Any]:
    """A case with a law at some places; a material that is given by its name is written out there.

    Raises
    ------
    InputError
        If a place cannot be set.
    """
    return cases.content_of(content, {place: dict(law) for place in at})


def _places(kind: type[Section], content: Mapping[str, Any], before: str) -> Iterator[str]:
    """Places in a section."""
    for name, field in kind.model_fields.items():
        key, value = f"{before}{name}", content.get(name)
        kinds = list(schema.sections(field.annotation))
        if Viscoelastic in kinds and _applies(kind, name, content):
            yield key
            continue
        for mark in schema.marks(field):
            if isinstance(mark, SectionsByName) and isinstance(value, Mapping):
                for part in value:
                    section = mark.section_of(mark.content_of(value, part))
                    if section is not None and isinstance(value[part], Mapping):
                        yield from _places(section, value[part], f"{key}.{part}.")
            elif isinstance(mark, OneOf) and isinstance(value, Mapping):
                for word, inner in value.items():
                    if word in mark.kinds and isinstance(inner, Mapping):
                        yield from _places(mark.kinds[word], inner, f"{key}.{word}.")
        if value is not None:
            for section in kinds:
                yield from _places(section, value if isinstance(value, Mapping) else {}, f"{key}.")


def _applies(kind: type[Section], key: str, content: Mapping[str, Any]) -> bool:
    """Whether a key applies beside the others of its section."""
    if not issubclass(kind, Part):
        return True
    defaults = {name: field.default for name, field in kind.model_fields.items() if isinstance(field.default, str)}
    return all(when.holds({**defaults, **content} if when.values else content) for when in kind.applies.get(key, ()))
