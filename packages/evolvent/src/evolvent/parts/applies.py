"""Which keys of a part apply, by what other keys hold: the studio hides the others, parts refuse them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from evolvent_base.errors import InputError


@dataclasses.dataclass(frozen=True)
class When:
    """A condition on other keys of a part.

    Attributes
    ----------
    keys : tuple of str, of which one or more must be given; where `absent`, none
    values : tuple of str, of which the (one) key must have one, "" where it may be left out; empty for any value
    absent : bool
    """

    keys: tuple[str, ...]
    values: tuple[str, ...] = ()
    absent: bool = False

    def holds(self, given: Mapping[str, Any]) -> bool:
        """Whether it holds.

        Parameters
        ----------
        given : mapping, key -> value or text; None and '' stand for what is left out
        """
        if self.values:
            value = given.get(self.keys[0])
            return ("" if value is None else str(value)) in self.values
        return any(given.get(key) not in (None, "") for key in self.keys) is not self.absent


#: Key of a part -> conditions, all of which must hold where it applies.
Applies = Mapping[str, tuple[When, ...]]


def one_of(key: str, *values: str) -> When:
    """The condition that a key has one of some values."""
    return When((key,), values)


def given(*keys: str) -> When:
    """The condition that one or more of some keys are given."""
    return When(keys)


def left_out(*keys: str) -> When:
    """The condition that none of some keys is given."""
    return When(keys, absent=True)


#: Of a part that takes a law.
OF_LAW: Applies = {"parameters": (given("law"),), "constants": (given("law"),)}


#: Values of another key that a message lists, at most.
_LISTED = 3


def refuse_unfit(name: str, part: Any) -> None:
    """Refuse a key of a part that is given where it does not apply, or is left out where it is needed.

    A key at its default counts as left out.

    Parameters
    ----------
    name : str, of the part, for messages
    part : Part

    Raises
    ------
    InputError
    """
    fields = type(part).model_fields
    values = {key: getattr(part, key) for key in fields}
    kept = {key: value for key, value in values.items() if value != fields[key].default}
    for key, conditions in part.applies.items():
        unmet = next((when for when in conditions if not when.holds(values if when.values else kept)), None)
        if unmet is None and key in part.needed and key not in kept:
            raise InputError(f"{name}.{key} is missing; {_with(name, conditions, values)} needs it")
        if unmet is not None and key in kept and key not in part.always_allowed:
            raise InputError(_unfit(name, key, unmet, values, kept))


def _with(name: str, conditions: tuple[When, ...], values: Mapping[str, Any]) -> str:
    """What a key applies to, for messages: the value of the key that decides it."""
    keys = [when.keys[0] for when in conditions if when.values]
    return f"{name}.{keys[0]} {values[keys[0]]!r}" if keys else name


def _unfit(name: str, key: str, unmet: When, values: Mapping[str, Any], kept: Mapping[str, Any]) -> str:
    """A sentence on a key that is given and does not apply."""
    others = [f"{name}.{other}" for other in unmet.keys]
    if unmet.values:
        is_what = f"{name}.{key} is given, but {others[0]} is {values[unmet.keys[0]]!r}"
        allowed = [repr(word) for word in unmet.values if word]
        return f"{is_what}, which has none" if len(allowed) > _LISTED else f"{is_what}, not {' or '.join(allowed)}"
    if unmet.absent:
        other = next(f"{name}.{other}" for other in unmet.keys if other in kept)
        return f"{name}.{key} and {other} are both given; leave one of them out"
    return f"{name}.{key} is given without {' or '.join(others)}, to which it belongs"
