"""Keys of nested content that are changed one by one: dotted paths, as of ``--set``."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from evolvent_base.errors import InputError
from evolvent_base.schema import shown
from evolvent_base.texts import key_problem, parse_yaml
from evolvent_base.units import UnitError, shared_unit, unit_of


def copied(content: Any) -> Any:
    """A copy of nested mappings and sequences as dicts and lists, which may be changed."""
    if isinstance(content, Mapping):
        for key in content:
            if not isinstance(key, str):
                raise InputError(f"in the case {key_problem(key)}")
        return {key: copied(value) for key, value in content.items()}
    return [copied(value) for value in content] if isinstance(content, (list, tuple)) else content


def parse_assignment(assignment: str) -> tuple[str, Any]:
    """Key and value of ``key.path=value``; the value is read as YAML.

    Raises
    ------
    InputError
        If it has no ``=`` or no key.
    """
    key, equals, value = assignment.partition("=")
    if not equals or not re.fullmatch(r"\w+(\.\w[\w -]*)*", key.strip()):
        raise InputError(f"--set {assignment!r} is not of the form key.path=value, such as blade.nodes=40")
    return key.strip(), parse_yaml(value, f"--set {assignment}")


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """What several ``--set`` change; no key twice."""
    found: dict[str, Any] = {}
    for assignment in assignments:
        key, value = parse_assignment(assignment)
        if key in found:
            raise InputError(f"--set gives {key!r} twice; give it once")
        found[key] = value
    return found


def override(
    content: dict[str, Any], key: str, value: Any, *, shares_unit: Callable[[str], bool] = lambda place: True
) -> None:
    """Put `value` in the place of a dotted key; a number in the key counts the entries of a list, from 0.

    Parameters
    ----------
    shares_unit : function of the dotted key of a list: whether a unit in its last entry alone is that of all entries
        A row [share, time] of a table has a quantity of its own in each column.
    """
    *path, last = parts = key.split(".")
    place: Any = content
    shared = False
    for k, name in enumerate(path):
        if isinstance(place, dict) and name not in place:
            if parts[k + 1].isdecimal():
                raise InputError(f"cannot set {key!r}: {'.'.join(path[: k + 1])!r} is not given; give the whole list")
            place[name] = {}
        place = place[_subscript(place, name, key, ".".join(path[:k]))]
        if isinstance(place, list) and shares_unit(".".join(path[: k + 1])):
            shared = _write_units(place) or shared
    at = _subscript(place, last, key, ".".join(path))
    if shared and isinstance(value, (int, float)) and not isinstance(value, bool) and (unit := unit_of(place[at])):
        value = f"{value!r} {unit}"  # in the unit of its list
    place[at] = value


def _write_units(values: list[Any]) -> bool:
    """Give each entry of a list the unit that stands in the last one alone, and so each column of a table.

    Returns whether a unit was added.
    """
    before = list(values)
    with contextlib.suppress(UnitError):
        if all(isinstance(row, list) and len(row) == len(before[0]) for row in before):
            columns = [shared_unit(list(column)) for column in zip(*before, strict=True)]
            values[:] = [list(row) for row in zip(*columns, strict=True)]
        elif not any(isinstance(value, (list, dict)) for value in before):
            values[:] = shared_unit(before)
    return values != before


def _subscript(place: Any, name: str, key: str, before: str) -> str | int:
    """What `name` stands for in a dict or list at the key `before`."""
    if isinstance(place, dict):
        return name
    if not isinstance(place, list):
        raise InputError(f"cannot set {key!r}: {before!r} is {shown(place)}, which has no keys")
    if name.isdecimal() and name in map(str, range(len(place))):
        return int(name)
    raise InputError(f"cannot set {key!r}: {before!r} is a list of {len(place)}, counted from 0; it has no {name!r}")
