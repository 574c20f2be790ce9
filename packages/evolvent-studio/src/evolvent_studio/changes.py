"""What differs between two cases, with values as they were written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolvent import cases
from evolvent_base.errors import EvolventError
from evolvent_studio.form import text_of

#: Text of a key that only the first case has, and of a section that only the second one has.
REMOVED, ADDED = "removed", "added"


def flat(content: Any, before: str = "") -> dict[str, Any]:
    """Values of a case by dotted key; lists are values."""
    if not isinstance(content, Mapping) or (not content and before):
        return {before: content}
    found: dict[str, Any] = {}
    for key, value in content.items():
        found |= flat(value, f"{before}.{key}" if before else str(key))
    return found


def full(content: Any) -> Any:
    """A case with all defaults, in SI units; as it is where it cannot be used."""
    try:
        return cases.load(content).model_dump(mode="json", exclude_none=True)
    except EvolventError:
        return content


def changes(base: Any, content: Any) -> list[tuple[str, str]]:
    """Keys whose values differ from those of another case, each with its text.

    Parameters
    ----------
    base, content : mapping, cases as they were written

    Returns
    -------
    list of (dotted key, text), the text as it was written in `content`
    """
    first, second = full(base), full(content)
    before, after = flat(first), flat(second)
    found: dict[str, str] = {}
    for key in dict.fromkeys([*before, *after]):
        if key in before and key in after and before[key] == after[key]:
            continue
        if key not in after:
            found[_first_missing(key, second)] = REMOVED
        elif (section := _first_missing(key, first)) != key:
            found[section] = ADDED
        else:
            at, value = written(content, key, after[key])
            found[at] = text_of(value)
    return list(found.items())


def written(content: Any, key: str, otherwise: Any) -> tuple[str, Any]:
    """Where a case holds a dotted key and its value there: at the key itself, or in a list or word above it."""
    passed: list[str] = []
    for part in key.split("."):
        if not isinstance(content, Mapping):
            return ".".join(passed), content
        if part not in content:
            return key, otherwise
        passed.append(part)
        content = content[part]
    return key, content


def _first_missing(key: str, content: Any) -> str:
    """The shortest leading part of a dotted key that a case does not have; the key itself where it has all of it."""
    passed: list[str] = []
    for part in key.split("."):
        passed.append(part)
        if not isinstance(content, Mapping) or part not in content:
            return ".".join(passed)
        content = content[part]
    return key
