"""The command `evolvent design`: what it writes, and what it refuses in one sentence."""

from __future__ import annotations

import pytest

from evolvent import cases

#: A short pay-out on links of fixed length.
SHORT = ["blade.segments=inextensible", "solver.method=dopri5", "blade.length=0.5 m", "blade.nodes=4"]
SET = [word for one in SHORT for word in ("--set", one)]
VARY = ["--vary", "spool.rate=1 to 8 rad/s"]
AIM = ["--maximize", "reel-1.rate.last"]


@pytest.mark.slow
def test_the_fastest_payout_within_a_lag(call, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["heliogyro", *SET, *VARY, *AIM, "--subject-to", "blade-1.tip_lag <= 20 deg", "--workers", "1"]
    code, out, err = call("design", *words, "-o", "d.yaml", "--report", "d.html", "--figure", "d.png")
    assert (code, err) == (0, "")
    assert "blade-1.tip_lag <= 20 deg" in out
    assert "active" in out
    assert {one.name for one in tmp_path.iterdir()} == {"d.yaml", "d.html", "d.png"}
    found = cases.load("d.yaml")
    assert f"{found.spool.rate:.5g}" in out


@pytest.mark.slow
def test_what_is_not_met_ends_with_1(call, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = [*SET, "--vary", "spool.rate=[3, 4]", *AIM, "--subject-to", "blade-1.tip_lag <= 1 deg"]
    code, out, err = call("design", "heliogyro", *words, "--quiet", "-o", "d.yaml")
    assert code == 1
    assert "no design that was tried meets all requirements; missed: blade-1.tip_lag <= 1 deg (it is 0." in err
    assert out == "case: d.yaml\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["heliogyro", *AIM], "vary is empty; it must name keys of the case"),
        (["heliogyro", *VARY], "a design needs one of minimize and maximize"),
        (["heliogyr", *VARY, *AIM], "no case is called 'heliogyr'; did you mean 'heliogyro'?"),
        (["heliogyro", "--vary", "=1 to 2", *AIM], "--vary '=1 to 2' is not of the form KEY=BOUNDS"),
        (["heliogyro", *VARY, *VARY, *AIM], "--vary gives 'spool.rate' twice"),
        (
            ["heliogyro", "--vary", "spool.rat=1 to 2", *AIM],
            "vary: unknown key 'spool.rat'; did you mean 'spool.rate'?",
        ),
        (["heliogyro", *VARY, *AIM, "--quantile", "20"], "--quantile is 20; it must be from 50 and below 100"),
        (["heliogyro", *VARY, *AIM, "--tolerance", "spool.rate"], "--tolerance 'spool.rate' is not of the form"),
        (["heliogyro", *VARY, *AIM, "--figure", "d.txt"], "d.txt"),
    ],
)
def test_what_cannot_be_designed_is_refused(call, words, sentence, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call("design", *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
