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


def refuse_unfit(name: str, part: Any) -> None:
    """Refuse a key of a part that is given where it does not apply; one at its default is not given.

    Parameters
    ----------
    name : str, of the part, for messages
    part : Part
    """
    fields = type(part).model_fields
    values = {key: getattr(part, key) for key in fields}
    kept = {key: value for key, value in values.items() if value != fields[key].default}
    for key, conditions in part.applies.items():
        for when in conditions if key in kept else ():
            if when.holds(values if when.values else kept):
                continue
            others = [f"{name}.{other}" for other in when.keys]
            if when.values:
                value = values[when.keys[0]]
                allowed = " or ".join(repr(word) for word in when.values if word)
                raise InputError(f"{name}.{key} is given, but {others[0]} is {value!r}, not {allowed}")
            if when.absent:
                other = next(f"{name}.{other}" for other in when.keys if other in kept)
                raise InputError(f"{name}.{key} and {other} are both given; leave one of them out")
            raise InputError(f"{name}.{key} is given without {' or '.join(others)}, to which it belongs")
