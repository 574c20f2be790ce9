"""Rows of the ledger against the papers' places, the product's parts and cases, and the words that a row may use."""

import ast
import json
import pathlib
import re
import sys

import pytest

from evolvent import cases
from evolvent.parts import registry
from evolvent_papers import papers
from evolvent_papers.papers import ledger

ALL = ledger.every()
#: Kinds of parts and cases that existed when the rows that are open, or name what is absent, were looked at last.
LOOKED_AT = pathlib.Path(__file__).with_name("looked_at.json")

OWN = "not in the paper"
NUMBER = r"\(?[IVX\d]+(?:\.\d+)*\)?"
#: "section III.3", "eqs. (4) to (7)", "sections 2.3 and 3.2", "figures 7 and 9".
PLACE = re.compile(
    rf"\b(section|figure|table|eq|step|conclusion|reference)s?\.? ({NUMBER}(?:(?:, | and | to ){NUMBER})*)"
)
#: The history of the project, which the reader of a row does not know.
HISTORY = re.compile(r"our earlier|earlier notes|formerly|previously|we used to|until now|no longer", re.I)
#: Words that say that something is missing; they belong into `absent` or `undecided`.
MISSING = re.compile(
    r"\b(not (drawn|found|built|computed|compared|measured|sought|modelled|simulated) here|not among|"
    r"(is|are) not (compared|measured|sought|modelled|simulated|followed))\b"
)


def existing() -> dict[str, list[str]]:
    """Kinds of parts, and built-in cases."""
    return {"kinds of parts": sorted(registry.kinds()), "cases": sorted(cases.built_in())}


def places_in(text: str) -> list[tuple[str, str]]:
    """Kind and number of each place that a text names; ranges by their ends."""
    return [
        (kind, number.strip("()"))
        for kind, numbers in PLACE.findall(text)
        for number in re.split(r", | and | to ", numbers)
    ]


def test_places_are_read():
    assert places_in("section 2.1, figure 3, eqs. (1) and (2)") == [
        ("section", "2.1"), ("figure", "3"), ("eq", "1"), ("eq", "2"),
    ]  # fmt: skip
    assert places_in("section III.3, conclusion 1") == [("section", "III.3"), ("conclusion", "1")]


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_places_of_a_row_exist(one):
    known = ledger.places(one.name.partition("-")[0])
    for kind, number in places_in(one.where):
        assert number in known.get(kind, ()), f"the paper has no {kind} {number}"


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_an_own_finding_is_not_in_the_paper(one):
    assert (one.source == "own") == one.where.startswith(OWN)
    if one.source == "own":
        assert one.where == OWN or one.where.startswith(f"{OWN}, beside ")


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_a_row_speaks_of_the_paper_and_of_the_measurement(one):
    assert not HISTORY.search(" ".join((one.claim, one.ours, one.undecided, one.absent)))
    assert not MISSING.search(one.ours), "what evolvent does not have stands in `absent`, where it is looked at again"


@pytest.mark.parametrize("one", [one for one in ALL if one.holds], ids=lambda one: one.name)
def test_numbers_of_comparisons_have_a_reason(one):
    """0 and 1 stand for themselves; any other number of a comparison is explained to the reader."""
    trees = [ast.parse(text, mode="eval") for text in (*one.holds, *one.in_part)]
    numbers = {node.value for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    assert one.limits or numbers <= {0, 1}
    for text in one.limits:
        assert " " in text, f"{text!r} is no sentence and no limit that rows share"


def test_shared_limits_are_used():
    for paper in papers.CLAIMS_OF:
        used = {text for one in ledger.claims(paper) for text in one.limits}
        assert set(ledger.shared_limits(paper).values()) <= used


def test_open_rows_are_looked_at():
    """A new kind of part or a new case may make a row false that is open or names what is absent."""
    before = json.loads(LOOKED_AT.read_text(encoding="utf-8"))
    rows = ", ".join(one.name for one in ALL if one.to_review)
    for what, names in existing().items():
        new = sorted(set(names) ^ set(before[what]))
        assert not new, (
            f"the {what} {', '.join(new)} were added or removed since the rows that are open or name what is absent "
            f"were looked at. Read {rows}; then run python {pathlib.Path(__file__).name}"
        )


if __name__ == "__main__":
    LOOKED_AT.write_text(json.dumps(existing(), indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"written to {LOOKED_AT}\n")
