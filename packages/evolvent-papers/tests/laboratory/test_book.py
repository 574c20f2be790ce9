"""The laboratory book: bands, covariances of correlated residuals, tables, coverage over sets and the command."""

from __future__ import annotations

import json
import math
import pathlib

import numpy as np
import pytest

from evolvent_base.errors import InputError
from evolvent_papers import laboratory
from evolvent_papers.laboratory import book, tables
from evolvent_papers.laboratory.book import Band, Comparison, NoSettings, Set, Verdict


def test_bands_and_verdicts() -> None:
    band = Band(measurement=0.3, parameters=0.4, numerics=0.0)
    assert band.half_width == pytest.approx(1.96 * 0.5)
    inside = Comparison(what="a", unit="Hz", predicted=10.5, measured=10.0, band=band, allowed=0.4, goal="4 %")
    outside = Comparison(what="b", unit="Hz", predicted=12.0, measured=10.0, band=band)
    verdict = Verdict(comparisons=(inside, outside), figures=())
    assert (inside.covered, inside.meets, outside.covered, outside.meets) == (True, False, False, True)
    assert (verdict.goals, verdict.coverage) == ((0, 1), (1, 2))
    assert verdict.missed == [inside]
    assert verdict.text == "0 of 1 goals are met; 1 of 2 differences are within their bands of 95 %"
    assert book.table(verdict).rows[0][-1] == "MISSED, within"
    assert math.isnan(outside.allowed)


def test_the_covariance_of_a_fit_is_that_of_repeated_fits() -> None:
    """A line through noise of which neighbours are alike: the spread of 400 fits is what one fit states."""
    rng, n = np.random.default_rng(7), 300
    x = np.linspace(0.0, 1.0, n)
    J = np.stack([np.ones(n), x], axis=1)
    fits, stated, lengths = [], [], []
    for _ in range(400):
        noise = np.convolve(rng.standard_normal(n + 9), np.full(10, 10.0**-0.5), "valid")  # triangle of 10 samples
        found = np.linalg.lstsq(J, noise, rcond=None)[0]
        residuals = noise - J @ found
        lengths.append(book.samples_per_independent([residuals]))
        stated.append(np.diag(book.covariance_of(J, residuals, lengths[-1])))
        fits.append(found)
    assert np.median(lengths) == pytest.approx(10.0, rel=0.25)
    np.testing.assert_allclose(np.sqrt(np.mean(stated, axis=0)), np.std(fits, axis=0), rtol=0.2)
    assert book.samples_per_independent([rng.standard_normal(2000)]) < 1.5
    assert book.samples_per_independent([np.zeros(5)]) == 1.0


def test_a_direction_without_a_trace_gets_no_variance() -> None:
    J = np.stack([np.arange(1.0, 9.0), 2.0 * np.arange(1.0, 9.0)], axis=1)
    covariance = book.covariance_of(J, np.tile([1.0, -1.0], 4), 1.0)
    deviation = book.by_parameters(lambda p: np.array([p[0] + 2.0 * p[1], 5.0]), np.zeros(2), covariance)
    # of one parameter through the origin: s^2 / sum x^2; two parameters were asked for
    assert deviation[0] == pytest.approx(math.sqrt(8.0 / 6.0 / 204.0), rel=1e-6)
    assert deviation[1] == 0.0
    np.testing.assert_array_equal(book.by_parameters(lambda p: p, np.ones(2), np.zeros((2, 2))), [0.0, 0.0])


def test_tables_are_read_or_refused(tmp_path) -> None:
    for text in ("t,x\n0,1.5\n1,2\n", "\ufeffx;t\n1,5;0\n2;1\n", "t\tx\t\n0\t1.5\t\n1\t2\t\n"):
        np.testing.assert_array_equal(tables.table("a", text.encode(), ("t", "x")), [[0.0, 1.5], [1.0, 2.0]])
    for text, sentence in (
        ("t,y\n0,1\n", r"a: the columns must be t,x"),
        ("t,x\n0,b\n", r"cannot read 'a': line 2 holds 'b' in column 'x', where a number must be"),
        ("t,x\n0,1\n", r"a: it needs two rows of finite numbers"),
        ("t,x\n0,1\n0,nan\n", r"a: it needs two rows of finite numbers"),
    ):
        with pytest.raises(InputError, match=sentence):
            tables.table("a", text.encode(), ("t", "x"))
    with pytest.raises(InputError, match="is not a folder"):
        tables.contents(str(tmp_path / "none"), pathlib.Path("stored.zip"))


def made_set(name: str, difference: float, needs: str = "") -> Set:
    """A set of one comparison with a band of 1.96 and a goal of 1."""
    one = Comparison(
        what="x", unit="m", predicted=difference, measured=0.0, allowed=1.0, goal="1 m",
        band=Band(measurement=1.0, parameters=0.0, numerics=0.0),
    )  # fmt: skip
    verdict = Verdict(comparisons=(one,), figures=())
    return Set(
        name=name, title=f"Set {name}", source="", Settings=NoSettings, run=lambda settings, data: verdict, needs=needs
    )


def test_all_sets_and_their_coverage(call, tmp_path, monkeypatch) -> None:
    sets = {one.name: one for one in (made_set("a", 0.5), made_set("b", 1.5), made_set("c", 9.0, needs="ask"))}
    monkeypatch.setattr(laboratory, "SETS", dict.fromkeys(sets, ""))
    monkeypatch.setattr(laboratory, "found", sets.get)
    code, out, err = call("validate", "--all", "-o", "all.json")
    assert code == 1
    assert "goals are missed: b: x" in err
    lines = [line.split() for line in out.splitlines()]
    assert lines[1] == ["a", "1", "of", "1", "1", "of", "1", "100", "not", "stated", "-"]
    assert lines[2] == ["b", "0", "of", "1", "1", "of", "1", "100", "not", "stated", "x"]
    assert lines[3][:4] == ["c", "-", "-", "-"]
    assert "1 of 2 goals are met; 2 of 2 differences are within their bands of 95 %" in out
    written = json.loads((tmp_path / "all.json").read_text())
    assert (written["goals_met"], written["covered"]) == ([1, 2], [2, 2])
    assert [one["set"] for one in written["sets"]] == ["a", "b"]
    assert written["without_measurements"] == ["c"]
    alone = sets["a"].validate()
    assert str(alone).splitlines()[-1] == "1 of 1 goals are met; 1 of 1 differences are within their bands of 95 %"
    assert "Set a" in alone._repr_html_()
    assert json.loads(pathlib.Path(alone.save(tmp_path / "a.json")).read_text()) == written["sets"][0]
    code, _, err = call("validate", "c")
    assert (code, err.strip()) == (2, "evolvent: c needs --data FOLDER: ask")
    assert call("validate", "a")[0] == 0
    code, out, _ = call("validate")
    assert out.splitlines()[-1] == "c  Set c (--data FOLDER: ask)"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["tripel-pendulum"], "no set of measurements is called 'tripel-pendulum'; did you mean 'triple-pendulum'?"),
        (["triple-pendulum", "--set", "fited=2"], "unknown key 'fited'; did you mean 'fitted'?"),
        (["triple-pendulum", "--set", "fitted=-2"], "fitted is -2"),
        (["triple-pendulum", "--data", "none"], "'none' is not a folder with CSV files"),
        (["driven-arm", "--data", "none"], "'none' is not a folder with CSV files"),
        (["rbsp", "--data", "none"], "'none' is no log of wire booms: it has the columns pair, start_utc"),
        (["trifilar", "--data", "none"], "'none' is not a folder with recordings"),
        (["trifilar"], "trifilar needs --data FOLDER: the recordings are published in the repository morloy/"),
        (["rbsp", "--set", "fitted=2"], "fitted"),
        (["triple-pendulum", "--figure", "a.txt"], "a.txt"),
        (["--set", "fitted=2"], "a SET is missing; known: double-pendulum, triple-pendulum"),
        (["-o", "a.json"], "a SET is missing, or --all; known: double-pendulum, triple-pendulum"),
        (["--all", "--set", "fitted=2"], "--all takes no SET and none of --data, --set and --figure"),
    ],
)
def test_what_cannot_be_validated_is_refused(call, words, sentence) -> None:
    code, out, err = call("validate", *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_sets_are_listed(call) -> None:
    code, out, _ = call("validate")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(laboratory.SETS)
    assert "GPL-2, and are not shipped" in out
