"""What follows from what a family says: one that says nothing is refused by name, or takes the way that is right."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System
from evolvent.analysis import sensitivity
from evolvent.analysis.margins import elastic, shares
from evolvent.assembly import variants
from evolvent.model.registry import families
from evolvent.model.shares import DAMPING, SPRING
from evolvent.solvers.time.implicit.methods import NAME
from margin_cases import case


def arm() -> System:
    """The arm of `margin_cases`, which a cord pulls as well."""
    content = case()
    content["parts"]["cord"] = {"kind": "spring", "a": [0, 1, 0], "b": "arm", "stiffness": 2.0, "length": 0.1}
    return evolvent.load(content)


def let_springs_say(monkeypatch: pytest.MonkeyPatch, **answers: Any) -> None:
    """Let the family of springs say something else, as one from outside may."""
    found = families() | {"springs": dataclasses.replace(families()["springs"], **answers)}
    for module in (shares, elastic, sensitivity, variants):
        monkeypatch.setattr(module, "families", lambda: found)


def test_a_family_that_says_nothing_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    let_springs_say(monkeypatch, shares=None, smooth=False)
    system = arm()
    with pytest.raises(InputError, match="'cord' is one of the springs, which margins of hinges and slides do not"):
        system.margin(motion=False)
    with pytest.raises(InputError, match="'cord' is a spring, through which sensitivities are not supported"):
        sensitivity.check(system.assemble(), NAME)


@pytest.mark.parametrize("category", [SPRING, DAMPING])
def test_a_category_alone_is_one_share(category: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its force is that of its records, which the mechanism without forces does not have."""
    before = shares_of(arm())
    let_springs_say(monkeypatch, shares=None, category=category)
    after = shares_of(arm())
    assert after.keys() == before.keys()
    assert {label: one[0] for label, one in after.items()} == {label: one[0] for label, one in before.items()} | {
        "cord": category
    }
    for label, (_, values) in after.items():
        assert values == pytest.approx(before[label][1], rel=1e-12, abs=1e-14)


def shares_of(system: System) -> dict[str, tuple[str, np.ndarray]]:
    """Category and values of each share of the arm."""
    (table,) = system.margin(motion=False).still
    assert table is not None
    return {one.label: (one.category, values) for one, values in zip(table.shares, table.values, strict=True)}


@pytest.mark.parametrize(("key", "question"), [("cord.stiffness", "changes"), ("arm.mass", "reads_inertia")])
def test_a_variant_is_assembled_whole_where_a_family_does_not_say_otherwise(
    key: str, question: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for whole in (1, 2):
        system = arm()
        system.with_values({}).assemble()
        system.with_values({key: 3.0}).assemble()
        assert system._variants is not None
        assert (system._variants.fast, system._variants.whole) == (2 - whole, whole)
        let_springs_say(monkeypatch, parts=dataclasses.replace(families()["springs"].parts, **{question: None}))
