"""The command `evolvent disperse`: what it refuses, in one sentence, before anything runs."""

import pytest

VARY = ["--vary", "spool.rate=5%"]
KEEP = ["--keep", "body_rate.last"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["heliogyro"], "no key varies; give --vary 'KEY=DISTRIBUTION'"),
        (["heliogyro", *VARY], "no result is kept; give --keep NAME"),
        (["heliogyr", *VARY, *KEEP], "no case is called 'heliogyr'; did you mean 'heliogyro'?"),
        (["heliogyro", "--vary", "spool.rate", *KEEP], "--vary 'spool.rate' is not of the form KEY=DISTRIBUTION"),
        (["heliogyro", *VARY, *VARY, *KEEP], "--vary gives 'spool.rate' twice"),
        (
            ["heliogyro", "--vary", "spool.rate=5", *KEEP],
            "over.spool.rate is '5'; it must be a tolerance such as '10%'",
        ),
        (["heliogyro", "--vary", "spool.rat=5%", *KEEP], "unknown key 'spool.rat'; did you mean 'spool.rate'?"),
        (["heliogyro", *VARY, *KEEP, "--coverage", "0"], "--coverage is 0; it must be above 0 and below 100"),
        (["heliogyro", *VARY, *KEEP, "--confidence", "nan"], "--confidence is nan; it must be above 0"),
        (["heliogyro", *VARY, *KEEP, "--sample", "random"], "sample is 'random'; "),
        (["heliogyro", *VARY, *KEEP, "--sample", "sobol"], "samples is missing; sample: sobol needs"),
        (["heliogyro", *VARY, *KEEP, "--correlate", "spool.rate=1"], "must name two keys and a number from -1 to 1"),
        (["heliogyro-payout"], "the study 'heliogyro-payout' has sample: grid, which draws nothing"),
        (["heliogyro", *VARY, *KEEP, "--samples", "0"], "invalid value for '--samples'"),
    ],
)
def test_what_cannot_be_dispersed_is_refused(call, words, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = call("disperse", *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_case_is_dispersed_and_evaluated(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = ["blade.segments=inextensible", "solver.method=dopri5", "solver.duration=0.2 s", "blade.nodes=3"]
    words = [word for one in short for word in ("--set", one)]
    words += [*VARY, "--vary", "blade.length, blade.tip_mass=normal(nominal, 1%)", *KEEP, "--correlate"]
    words += ["spool.rate, blade.length=0.5", "--samples", "6", "--coverage", "50", "--confidence", "90"]
    code, out, err = call("disperse", "heliogyro", *words, "--workers", "1")
    assert (code, err) == (0, "")
    assert "6 runs, plain random over 2 draws" in out
    assert "50/90 upper" in out
    names = {path.name for path in (tmp_path / "heliogyro-dispersion").iterdir()}
    assert {"dispersion.csv", "dispersion.nc", "report.html", "study.yaml", "body_rate_last-histogram.png"} <= names
    kept = tmp_path / "heliogyro-dispersion" / "study.yaml"
    code, again, _ = call("disperse", str(kept), "-o", "heliogyro-dispersion", "--coverage", "50", "--confidence", "90")
    assert code == 0
    assert again.splitlines()[:4] == out.splitlines()[:4]
