"""Which keys of a part apply, by what other keys hold: the studio hides the others, parts refuse them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any


@dataclasses.dataclass(frozen=True)
class When:
    """A condition on other keys of a part.

    Attributes
    ----------
    keys : tuple of str, of which one or more must be given; where `absent`, none
    values : tuple of str, of which the (one) key must have one; empty for any value
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
            return str(given.get(self.keys[0])) in self.values
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


#: Of a load or a part that takes a law.
OF_LAW: Applies = {"parameters": (given("law"),), "constants": (given("law"),)}


def either(constant: str, direction: str) -> Applies:
    """Of a load: a constant value, or a direction and a profile, or a law."""
    return {
        constant: (left_out(direction, "profile", "law"),),
        direction: (left_out(constant, "law"),),
        "profile": (left_out(constant, "law"),),
        "law": (left_out(constant, direction, "profile"),),
        **OF_LAW,
    }
