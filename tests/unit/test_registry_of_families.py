"""What families of other distributions may not be, and what follows where a family says nothing."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent.kernels import calls
from evolvent.kernels.ends import of_bodies
from evolvent.model import registry
from evolvent.model.family import Family, record
from evolvent.model.fields import ModelFields
from evolvent.model.layout import Events, Rows


@calls.force
def pull(interval, model):
    """No force."""


def family(name: str = "pulls", **given: object) -> Family:
    return Family(name, record("a b"), order=600.0, ends=of_bodies("a", "b"), **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (family("springs"), "'springs' has the name of a field of the model"),
        (family("F"), "'F' has the name of a field of the model"),
        (family(force=pull), "a force without its tangent"),
        (family(events=(Events(lambda found: found.size, lambda found, k: (k, "gone")),)), "events without `values`"),
        (family(rows=Rows()), "rows of constraint without `row_measure`"),
    ],
)
def test_what_cannot_be_used_is_named(one: Family, words: str) -> None:

    assert words in registry._refused(one, {*ModelFields._declared, *registry.families()})


def test_a_family_that_says_nothing_of_it_is_never_isolated() -> None:
    found = record("a b")

    one, none = np.zeros(1, dtype=found), np.zeros(0, dtype=found)
    assert not family().may_be_isolated(one, {}.__getitem__)
    assert family().may_be_isolated(none, {}.__getitem__)
    assert family(isolated=True).may_be_isolated(one, {}.__getitem__)


def test_all_families_of_the_package_can_be_used() -> None:
    assert not registry.unusable()
    for name, one in registry.families().items():
        assert registry._refused(one, set()) == "" or one.events or one.rows is not None, name
