"""Parts of a case by name, as the page changes them: added, renamed with all references, duplicated, checked."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from evolvent import cases
from evolvent.assembly.references import check_name
from evolvent.parts import repetition
from evolvent.parts.base import Part, Reference
from evolvent.parts.registry import kinds, not_known
from evolvent_base.errors import InputError
from evolvent_base.schema import Located, Section, by_name, within

#: Parts of a case as they were typed: name -> keys and values.
Parts = dict[str, Any]


def key_of(case: type[Section]) -> str:
    """The key of a case that holds parts by name; '' where it has none."""
    return next(iter(by_name(case)), "")


def kind_of(content: Any) -> type[Part] | None:
    """The class of a part as it was typed; None where its kind is not known."""
    name = content.get("kind") if isinstance(content, Mapping) else None
    return kinds().get(name) if isinstance(name, str) else None


def one_by_one(content: Mapping[str, Any]) -> dict[str, Any]:
    """A case whose repeated parts are written out where single ones of them have values of their own."""
    for one in content.values():
        if isinstance(one, Mapping) and any(isinstance(part, Mapping) and "kind" not in part for part in one.values()):
            with contextlib.suppress(InputError):
                return cases.expanded(content)
    return dict(content)


def proposed_name(parts: Mapping[str, Any], kind: str) -> str:
    """A name for another part: that of its kind, or of the part that it is a copy of, with a number."""
    stem = re.sub(r" \d+$", "", kind.replace("-", " "))
    if stem not in parts:
        return stem
    number = 2
    while f"{stem} {number}" in parts:
        number += 1
    return f"{stem} {number}"


def checked_name(parts: Mapping[str, Any], name: str) -> str:
    """A name that a part may take.

    Raises
    ------
    InputError
    """
    name = check_name(name.strip())
    if name in parts:
        raise InputError(f"the name {name!r} is already taken by another part")
    return name


def added(parts: Mapping[str, Any], name: str, content: Mapping[str, Any]) -> Parts:
    """The parts and one more.

    Raises
    ------
    InputError
        If the name cannot be used, or the kind is not known.
    """
    if kind_of(content) is None:
        kind = content.get("kind")
        raise InputError(f"the kind of the part is {kind!r}; {not_known(kind)}")
    return {**parts, checked_name(parts, name): dict(content)}


def renamed(parts: Mapping[str, Any], old: str, new: str) -> Parts:
    """The parts with one of another name; references to it in the other parts follow.

    Raises
    ------
    InputError
        If the name cannot be used.
    """
    if new.strip() == old:
        return dict(parts)
    new = checked_name(parts, new)
    many = is_repeated(parts[old])
    return {
        new if name == old else name: _followed(content, old, new, numbered=many) for name, content in parts.items()
    }


def is_repeated(content: Any) -> bool:
    """Whether a part as it was typed stands for several."""
    return isinstance(content, Mapping) and repetition.KEY in content


def _followed(content: Any, old: str, new: str, *, numbered: bool = False) -> Any:
    """A part whose references to a part name it as it is called now; of a repeated one they have numbers."""
    kind = kind_of(content)
    if kind is None:
        return content

    def rename(value: Any) -> Any:
        return _reference(value, old, new, numbered=numbered)

    found = dict(_renamed_within(Located([(kind, ())], "", entry=False), content, rename))
    if isinstance(variables := content.get("variables"), Mapping):  # of an event: letter -> "hub.rate.z"
        found["variables"] = {letter: rename(text) for letter, text in variables.items()}
    return found


def _renamed_within(place: Located, content: Mapping[str, Any], rename: Callable[[Any], Any]) -> dict[str, Any]:
    """A section at a place with its references renamed, and those of the sections in it."""
    found = dict(content)
    for key, value in content.items():
        inner = within(place, str(key), content)
        if inner is None:
            continue
        if any(isinstance(mark, Reference) for _, marks in inner.types for mark in marks):
            found[key] = rename(value)
        elif isinstance(value, Mapping):
            found[key] = _renamed_within(inner, value, rename)
        elif isinstance(value, (list, tuple)):
            entry = within(inner, "0", value)
            if entry is not None:
                found[key] = [_renamed_within(entry, one, rename) if isinstance(one, Mapping) else one for one in value]
    return found


def _reference(value: Any, old: str, new: str, *, numbered: bool = False) -> Any:
    """A reference as it was typed - 'hub', 'boom.tip', 'boom[5]', [hub, [0, 0, 1]], or a list of them - renamed."""
    if isinstance(value, str):
        number = r"(?= (?:\d+|\{n(?:[+-]\d+)?\})(?:\s*$|[.\[])|\s*$)" if numbered else r"(?=\s*$|[.\[])"
        return re.sub(rf"^(\s*){re.escape(old)}{number}", lambda match: match[1] + new, value)
    if isinstance(value, (list, tuple)):
        return [_reference(one, old, new, numbered=numbered) for one in value]
    return value


def referring(parts: Mapping[str, Any], name: str) -> list[str]:
    """Names of the parts that refer to another one."""
    mark = "a part of another name"
    many = is_repeated(parts.get(name))
    return [
        other
        for other, content in parts.items()
        if other != name and _followed(content, name, mark, numbered=many) != content
    ]


def problems(parts: Any, key: str = "parts") -> dict[str, str]:
    """What is wrong with parts, each by itself: dotted key -> sentence; references are not checked."""
    if not isinstance(parts, Mapping):
        return {key: f"{key} must be a mapping of names to parts"}
    found: dict[str, str] = {}
    for name, content in parts.items():
        found |= {f"{key}.{name}.{own}".rstrip("."): text for own, text in part_problems(name, content, key).items()}
    return found


def part_problems(name: Any, content: Any, key: str = "parts") -> dict[str, str]:
    """What is wrong with a part: key of its own, '' for the part itself -> sentence."""
    try:
        check_name(name)
    except InputError as error:
        return {"": str(error)}
    if not isinstance(content, Mapping):
        return {"": f"{key}.{name} must be a mapping of keys to values"}
    kind = kind_of(content)
    if kind is None:
        if "kind" not in content:
            return {"": f"the kind is missing; known: {', '.join(sorted(kinds()))}"}
        return {"": f"the kind is {content['kind']!r}; {not_known(content['kind'])}"}
    return own_problems(content, kind)


def own_problems(content: Mapping[str, Any], kind: type[Part]) -> dict[str, str]:
    """What is wrong with the keys of a part, and with how it is repeated: dotted key -> sentence."""
    if repetition.KEY not in content:
        return cases.problems(content, kind)
    given = {key: value for key, value in content.items() if key != repetition.KEY}
    written, before = content[repetition.KEY], f"{repetition.KEY}."
    if not isinstance(written, Mapping):
        return {repetition.KEY: f"{repetition.KEY} must be a mapping of keys to values, such as {{count: 6}}"}
    wrong = cases.problems(written, repetition.Repeat)
    if wrong:
        return {f"{before}{key}".rstrip("."): text if text.startswith(before) else f"{before}{text}"
                for key, text in wrong.items()}  # fmt: skip
    how = repetition.Repeat.model_validate(dict(written))
    try:
        how.check(repetition.KEY)
    except InputError as error:
        return {f"{before}{'step' if how.step is not None and how.axis is not None else 'axis'}": str(error)}
    return cases.problems(how.numbered(given, 0), kind)


def named_in(sentence: str, parts: Mapping[str, Any]) -> str:
    """The key that a sentence about assembled parts is about, 'boom.length' or 'boom'; '' for none."""
    match = re.match(r"'(?P<name>[^']+)' refers to '(?P<other>[^']+)'", sentence)
    if match is not None and match["name"] in parts:
        before = parts[match["name"]]
        after = _followed(before, match["other"], "a part of another name")
        return ".".join([match["name"], *(key for key in before if before[key] != after[key])][:2])
    found = []
    for name, content in parts.items():
        before = r"(?:(?<=\bparts\.)|(?<![\w.-]))"
        match = re.search(rf"{before}{re.escape(name)}(?:(?: \d+)?\.(?P<key>\w+))?(?![\w-])", sentence)
        if match is not None:
            kind = kind_of(content)
            known = {*kind.model_fields, repetition.KEY} if kind is not None else set()
            key = match["key"] if match["key"] in known else None
            found.append((key is None, match.start(), f"{name}.{key}" if key else name))
    return min(found)[2] if found else ""


def words(parts: Mapping[str, Any]) -> Sequence[str]:
    """What a reference may be: names of parts, and of points on them."""
    found = []
    for written, content in parts.items():
        name = f"{written} {{n}}" if is_repeated(content) else written  # {n} in a part that is repeated as well
        found.append(name)
        if not isinstance(content, Mapping):
            continue
        if content.get("kind") in ("beam", "rod"):
            found += [f"{name}.root", f"{name}.tip"]
        points = content.get("points")
        if isinstance(points, Mapping):
            found += [f"{name}.{point}" for point in points]
    return [*found, "ground"]
