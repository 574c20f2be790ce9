"""The statement of credibility: levels by their rules, from what is shipped."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import pytest

import book
import evolvent
from evolvent import parts
from evolvent_papers import laboratory
from evolvent_papers.laboratory import credibility
from evolvent_papers.laboratory.credibility import Compared

VERDICTS = sorted((credibility.DATA / "verdicts").glob("*.json"))


@pytest.mark.slow
def test_the_statement_of_results_is_that_of_what_is_shipped() -> None:
    shipped = book.STATEMENT.read_text(encoding="utf-8").strip()
    assert shipped == credibility.statement(), book.RENEW
    assert len(shipped) < 1000
    assert f"{len(book.shipped())} comparisons of {len(book.tests_with_rows())} tests" in shipped


def test_runs_carry_the_statement_into_their_files(tmp_path: pathlib.Path) -> None:
    system = evolvent.System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, velocity=(1.0, 0.0, 0.0)), "body")
    run = system.simulate(until=0.1, every=0.05)
    assert run.attrs["credibility"] == credibility.statement()
    run.ev.save(str(tmp_path / "run.nc"))
    assert evolvent.open(tmp_path / "run.nc").attrs["credibility"] == credibility.statement()


def row(chapter: str, order: float | None = None) -> dict[str, Any]:
    return {"chapter": chapter, "order": order}


def test_levels_follow_from_the_evidence() -> None:
    few, many = credibility.FEWEST_ROWS - 1, credibility.FEWEST_ROWS + credibility.FEWEST_ORDERS
    assert credibility.verification_level(()) == 0
    assert credibility.verification_level(tuple(many * [row("a", 2.0)])) == 3
    assert credibility.verification_level(tuple(many * [row("a", 2.0)] + few * [row("b")])) == 2
    assert credibility.verification_level(tuple(many * [row("a")])) == 2
    good = Compared(name="a", title="", goals=2, met=2, differences=10, within=9, stored=True)
    missed = Compared(name="b", title="", goals=2, met=1, differences=10, within=10, stored=True)
    outside = Compared(name="c", title="", differences=10, within=8, stored=True)
    none = Compared(name="d", title="")
    alone = Compared(name="e", title="", stored=True)
    widened = Compared(name="f", title="", goals=2, met=2, differences=10, within=10, stored=True, blind=False)
    others = (missed, outside, none, alone, widened)
    assert [one.validated for one in (good, *others)] == [True] + 5 * [False]
    assert credibility.validation_level([none]) == 0
    assert credibility.validation_level([good, missed, outside, none]) == 1
    assert credibility.validation_level([good, good]) == 2
    assert missed.text == "1 of 2 goals are met; 10 of 10 differences are within their bands of 95 %"
    assert none.text == "no verdict is stored"


def test_no_level_is_claimed_beyond_its_rule() -> None:
    factors = credibility.factors()
    levels = {one.name: one.level for one in factors}
    assert len(levels) == len(factors) == 11
    assert levels["Verification"] == credibility.verification_level(credibility.checks())
    assert levels["Validation"] == credibility.validation_level(credibility.compared())
    assert max(levels.values()) <= 3
    assert levels["Technical review of the development"] == 0
    for one in factors:
        assert one.why
        assert one.missing
    page = credibility.page()
    assert "own assessment" in page
    for chapter in book.CHAPTERS:
        assert f"[{chapter}](validation.md#" in page
    for name in laboratory.SETS:
        assert f"[`{name}`]" in page


@pytest.mark.parametrize("path", VERDICTS, ids=lambda path: path.stem)
def test_stored_verdicts_are_those_of_the_sets(path: pathlib.Path) -> None:
    held, of = json.loads(path.read_text(encoding="utf-8")), laboratory.found(path.stem)
    assert (held["set"], held["title"], held["source"]) == (of.name, of.title, of.source)
    found = next(one for one in credibility.compared() if one.name == path.stem)
    assert found.text == held["verdict"]


@pytest.mark.slow
@pytest.mark.release
@pytest.mark.parametrize("path", VERDICTS, ids=lambda path: path.stem)
def test_stored_verdicts_are_found_again(path: pathlib.Path) -> None:
    held, found = json.loads(path.read_text(encoding="utf-8")), laboratory.found(path.stem).validate()
    again = f"run `evolvent validate {path.stem} --quiet -o {path}` and `python tests/book.py none`, and commit both"
    assert [one.what for one in found.comparisons] == [one["what"] for one in held["comparisons"]], again
    assert [one.meets for one in found.comparisons] == [one["meets"] for one in held["comparisons"]], again
