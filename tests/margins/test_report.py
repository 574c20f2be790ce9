"""Margins in the report of a run: the tables of `evolvent margin`, latches from the results, sentences without them."""

import math
from typing import Any

import pytest

import evolvent
from evolvent import cases, results
from evolvent.exports import report
from evolvent_base.answer import Points, Table
from margin_cases import NONE, case

pytestmark = pytest.mark.slow


def margins_of(run: Any) -> list[Any]:
    """Blocks of the margins of a run."""
    return report._margins(run, report._Stored.of(run))[1]


@pytest.fixture(scope="module")
def run():
    return evolvent.load(case()).simulate()


def tables_of(blocks):
    """Rows of the tables by their titles, heads first."""
    return {one.title: [list(row) for row in (one.heads, *one.rows)] for one in blocks if isinstance(one, Table)}


def notes_of(blocks):
    """The notes."""
    return [text for one in blocks if isinstance(one, Points) for text in one.texts]


def test_tables_are_those_of_margin(run):
    margins = evolvent.load(case()).margin()
    found = margins_of(run)
    tables = tables_of(found)
    own = tables["Margins by ECSS-E-ST-33-01C"]
    assert own == margins.rows()
    assert float(own[1][4]) == pytest.approx(margins.motion("hinge").margin("motorization").min(), abs=1e-4)
    assert tables["What brings each margin to 0"] == margins.balance_rows()
    assert tables["hinge: what counts where its margin is least"] == margins.contributions("hinge")
    assert tables["Latches and stops in the run"] == margins.latch_rows()
    assert math.isfinite(margins.latches[0]["energy"])
    assert found[0] == "every margin holds"


def test_a_file_has_no_states_for_the_margins_along_the_run(run, tmp_path):
    """So they are left out, and the reason is a note."""
    results.save(run, str(tmp_path / "run.nc"))
    found = margins_of(evolvent.open(str(tmp_path / "run.nc")))
    rows = tables_of(found)["Margins by ECSS-E-ST-33-01C"]
    assert rows == evolvent.load(case()).margin(motion=False).rows()
    assert "margin in the run" not in rows[0]
    assert any(note.startswith("no margins along the run: a file of results has no states") for note in notes_of(found))
    assert not any(note.startswith("no margins along") for note in notes_of(margins_of(run)))


def test_the_report_has_the_section(run, tmp_path):
    report.write(run, str(tmp_path / "r.html"))
    page = (tmp_path / "r.html").read_text()
    assert '<a href="#margins">Margins</a>' in page
    assert "Every margin holds" in page
    assert 'alt="Margins by ECSS-E-ST-33-01C"' in page
    assert page.index('id="figures"') < page.index('id="margins"') < page.index('id="balances"')


def test_a_stop_without_a_latch():
    content = case()
    for key in ("latch", "latch_stiffness"):
        del content["parts"]["hinge"][key]
    content["parts"]["hinge"] |= {"low": -9.0, "high": 1.0, "stop": 500.0}
    content["margin"]["lines"] = {"hinge": {"travel": [0.0, 1.0]}}
    system = evolvent.load(content)
    rows = tables_of(margins_of(system.simulate()))["Latches and stops in the run"]
    assert rows == system.margin().latch_rows()
    assert rows[1][1] != "-"


def changed(run, **margin):
    """The run, as if its case had other keys of the margin."""
    content = cases.parse_yaml(run.attrs["case"], "case")
    content["margin"] = content["margin"] | margin
    other = run.copy()
    other.attrs = dict(run.attrs) | {"case": cases.dump(content)}
    return other


@pytest.mark.parametrize(
    ("margin", "sentence"),
    [
        ({"zero": NONE}, "are not stated: margin: friction of 'hinge' is declared to be zero"),
        ({"factors": "own.yaml"}, "are not stated: the run does not hold the factors of 'own.yaml'"),
        ({"stations": 1}, "are not stated: margin.stations is 1"),
    ],
)
def test_margins_that_are_not_stated(run, margin, sentence, tmp_path):
    other = changed(run, **margin)
    assert sentence in margins_of(other)[0]
    report.write(other, str(tmp_path / "r.html"))


def test_a_case_without_margins_has_no_section(tmp_path):
    plain = evolvent.load({key: value for key, value in case().items() if key != "margin"}).simulate()
    assert margins_of(plain) == []
    report.write(plain, str(tmp_path / "r.html"))
    assert "#margins" not in (tmp_path / "r.html").read_text()
