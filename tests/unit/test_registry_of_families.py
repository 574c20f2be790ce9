"""What families of other distributions may not be, and what follows where a family says nothing."""

from __future__ import annotations

import dataclasses
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import parts
from evolvent.algebra.sparse import N_COUNTS, OUTSIDE
from evolvent.kernels import calls
from evolvent.kernels.ends import of_bodies
from evolvent.model import registry
from evolvent.model.family import Family, record
from evolvent.model.fields import ModelFields
from evolvent.model.layout import Events
from evolvent.model.questions import Explicit, Inertia, Rows
from evolvent.solvers.common import matrices
from evolvent_base.errors import InputError


@calls.force
def pull(interval, model):
    """No force."""


def family(name: str = "pulls", **given: Any) -> Family:
    return Family(name, **{"record": record("a b"), "order": 600.0, "ends": of_bodies("a", "b")} | given)


#: Answers of rows of constraint that all methods need.
ROWS = Rows(**{name.removeprefix("rows."): pull for name in registry.QUESTIONS if name.startswith("rows.")})


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (family("springs"), "'springs' has the name of a field of the model"),
        (family("F"), "'F' has the name of a field of the model"),
        (family(force=pull), "a force without its tangent"),
        (family(events=(Events(lambda found: found.size, lambda found, k: (k, "gone")),)), "events without `values`"),
        (family(rows=Rows()), "rows of constraint without `rows.measure`"),
        (
            family(rows=dataclasses.replace(ROWS, alone=lambda found: found["a"] > 0)),
            "rows `alone` and shares in margins",
        ),
        (family(rows=ROWS, category="spring"), "rows `alone` and shares in margins"),
        (family(rows=ROWS, record=record("a event")), "a field `event` without `switch`"),
        (family(force=pull, tangent=pull, ends=None), "a force without `ends`"),
        (family(explicit=Explicit(force=pull)), "a force of some methods without `force`"),
        (family(inertia=Inertia(force=pull)), "states inertia"),
        (family(concerned={"pull": np.isfinite}), "says what 'pull' concerns, which is not asked of families"),
        (family(events=(Events(len, lambda _, k: (k, "gone"), values=pull, fire=pull, is_watched=False),)), "watched"),
    ],
)
def test_what_cannot_be_used_is_named(one: Family, words: str) -> None:

    assert words in registry._refused(one, {*ModelFields._declared, *registry.families()})


@pytest.mark.parametrize(
    ("segments", "asked"),
    [
        ("springs", {"node_events_values": 1, "node_events_project": 0, "node_events_is_due": 0}),
        ("inextensible", {"node_events_project": 1}),
    ],
)
def test_what_concerns_no_record_of_a_model_is_not_called(segments: str, asked: dict[str, int]) -> None:
    system = evolvent.System()
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "body")
    drive = parts.ConstantDrive(rate=1.0, angle=10.0)
    system.add(parts.Reel(body="body", centre=(0.1, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    stiff = {"stiffness": 1e4} if segments == "springs" else {}
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-3, nodes=5, segments=segments, **stiff), "thread")
    model = system.assemble().model

    assert {question: getattr(model, f"{question}_calls").size for question in asked} == asked


def test_a_family_that_says_nothing_of_it_is_never_isolated() -> None:
    found = record("a b")

    one, none = np.zeros(1, dtype=found), np.zeros(0, dtype=found)
    assert not family().may_be_isolated(one, {}.__getitem__)
    assert family().may_be_isolated(none, {}.__getitem__)
    assert family(isolated=True).may_be_isolated(one, {}.__getitem__)


def test_all_families_of_the_package_can_be_used() -> None:
    assert not registry.unusable()
    for name, one in registry.families().items():
        if not one.events and one.rows is None and not one.inertia.force and one.ends is not None:
            assert registry._refused(one, set()) == "", name


def test_tables_of_calls_follow_from_the_groups() -> None:
    assert {"force", "samples.evaluate", "rows.measure", "step.inertia"} <= set(registry.QUESTIONS)
    assert "samples_evaluate_calls" in registry.TABLES
    assert len(set(registry.TABLES)) == len(registry.TABLES)
    assert set(registry._OTHERWISE) | set(registry._OTHERWISE.values()) <= set(registry.QUESTIONS)


def test_the_guide_names_all_groups() -> None:
    guide = (pathlib.Path(__file__).parents[2] / "docs/guide/extend.md").read_text(encoding="utf-8")
    groups = [one for one in dataclasses.fields(Family) if dataclasses.is_dataclass(one.default_factory)]
    assert len(groups) > 10
    assert not [one.name for one in groups if f"`{one.name}`" not in guide or f"`{one.type}`" not in guide]


def test_a_tangent_that_ends_do_not_cover_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of families of other packages; the package's own leave out what only slows Newton's method."""
    model = SimpleNamespace(pulls=np.zeros(1))
    matrix = SimpleNamespace(counts=np.zeros(N_COUNTS, dtype=np.int64))
    matrix.counts[OUTSIDE] = 2
    matrices.check_covered(model, matrix)
    monkeypatch.setattr(matrices, "of_others", lambda: ("pulls",))
    with pytest.raises(InputError, match="2 entries of the tangent couple parts that the `ends` of no family couple"):
        matrices.check_covered(model, matrix)
