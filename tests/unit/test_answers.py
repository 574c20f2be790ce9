"""Answers as text, page, in a notebook and as files: what is shown where, and that texts stay texts."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from evolvent_base import answer as an, showing
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel


def figure(name: str) -> Figure:
    x = np.arange(3.0)
    panel = Panel(x_label="x, m", y_label="y, m", lines=[Line(x=x, y=x)])
    return Figure(name=name, title=f"Title of {name}", panels=[panel])


class Bridge(showing.Shown):
    """A result of everything that an answer may have."""

    named, endings = "bridges", (".csv", ".json")

    def answer(self) -> an.Answer:
        rows = [("mast [m]", "1.5"), ("cable", "12"), ("deck", "-")]
        return an.Answer(
            title="Bridge", facts=[("span", "40 m"), ("mass", "2 t")], heads=["it stands"], warnings=["it sways"],
            sections=[
                an.Section(title="Parts", blocks=[
                    an.Table(heads=("part", "length, m"), rows=rows, most=2), "see below",
                ]),
                an.Section(title="Shares", blocks=[an.Table(heads=("a", "b"), rows=[("1", "2")])], level=an.DETAIL),
                an.Section(title="Shape", blocks=lambda: [figure("later")], level=an.PAGE),
                an.Section(title="Plan", blocks=[figure("plan"), an.Listing("kind: mast")]),
            ],
            notes=["wind is left out"],
            files={
                "bridge.csv": lambda: an.as_csv([("part", "x"), ("mast", 1.5)]),
                "bridge.json": lambda: an.as_json({"x": np.array([1.0, np.inf]), "n": 3, "ok": True, "none": math.nan}),
            },
        )  # fmt: skip


def test_text_has_what_the_screen_shows() -> None:
    """Sentences first, warnings last; names in brackets are no markup; figures and texts of cases are for pages."""
    expected = """\
it stands

span  40 m
mass  2 t

Parts
part      length, m
mast [m]        1.5
cable            12
and 1 more row
see below

wind is left out

warning: it sways"""
    assert str(Bridge()) == expected
    assert "Shares\na  b\n1  2" in showing.text(Bridge().answer(), level=an.DETAIL)


def test_page_and_notebook() -> None:
    page = showing.page(Bridge().answer())
    for text in ("Shape", "Title of later", "Title of plan", "kind: mast", "deck", "It sways", "Wind is left out"):
        assert text in page
    short = Bridge()._repr_html_()
    assert short.count("<img") == 1
    for text in ("it sways", "40 m", "mast [m]", "it stands", "see below"):
        assert text in short
    assert "wind is left out" not in short


def test_a_table_of_many_columns_is_closer() -> None:
    """Its heads are folded, as all heads of numbers, so that a page of usual width holds it whole."""
    heads = ["mode", *(f"inertia about {a}, kg m2" for a in "abcdefgh")]
    tables = [an.Table(heads=heads[:n], rows=[["1"] * n], kind=kind) for n, kind in ((9, ""), (9, "wide"), (8, ""))]
    page = showing.page(an.Answer(title="modes", sections=[an.Section(title="", blocks=tables)]))
    assert re.findall("<table.*>", page) == ['<table class="many">', '<table class="wide many">', "<table>"]
    assert "th.n { white-space: normal; }" in page


def test_files(tmp_path) -> None:
    found = Bridge()
    assert found.save(tmp_path / "any.csv") == str(tmp_path / "any.csv")
    assert (tmp_path / "any.csv").read_text() == "part,x\nmast,1.5\n"
    with pytest.raises(InputError, match=r"ends with '.txt'; bridges are written as \.csv, \.json"):
        found.save("bridge.txt")
    names = showing.fill(found.answer(), tmp_path / "all")
    assert names == ["bridge.csv", "bridge.json", "report.html", "plan.png"]
    assert sorted(path.name for path in (tmp_path / "all").iterdir()) == sorted(names)
    content = json.loads((tmp_path / "all" / "bridge.json").read_text())
    assert content == {"x": [1.0, None], "n": 3, "ok": True, "none": None}
    assert showing.fill(found.answer(), tmp_path / "few", drawn=False) == names[:2]
    assert found.plot(tmp_path / "plan.svg") == str(tmp_path / "plan.svg")


def test_an_answer_within_another() -> None:
    blocks = an.within(Bridge().answer())
    assert blocks[:2] == ["it sways", "it stands"]
    assert [one.title for one in blocks if isinstance(one, an.Table)] == ["Parts", "Shares"]
    assert blocks[-1] == an.Points(["wind is left out"])


def test_reasons_of_failures_are_counted() -> None:
    assert an.failed(["a", "b", "b", "c", "d"]) == [
        "2 cases failed: b", "1 case failed: a", "1 case failed: c", "1 more reason of failures"
    ]  # fmt: skip
