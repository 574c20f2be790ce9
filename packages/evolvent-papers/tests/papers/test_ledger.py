"""The ledger of the papers' claims: quick ones are measured again, the command, names, verdicts and counts."""

import itertools
import shlex

import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent_papers import papers
from evolvent_papers.papers import ledger
from evolvent_papers.papers.ledger import Claim

ALL = ledger.every()
QUICK = [one for one in ALL if one.measure and one.seconds <= ledger.QUICK]
#: Claims whose measurements take longest and run in release tests only; verdicts on stored numbers are always tested.
LONG = (
    "stand-accuracy",
    "stand-euler-angles",
    "stand-motion",
    "stand-plan",
    "stand-product",
    "stand-prony-accuracy",
    "stand-scheme",
    "stand-signals",
    "stand-step-1",
    "stand-step-10",
    "stand-step-6",
    "stand-step-7",
    "stand-step-error",
    "thread-any-step",
    "thread-boundary-along",
    "thread-boundary-time",
    "thread-damping",
    "thread-eq-7",
    "thread-figure-3-4",
    "thread-figure-4-4",
    "thread-momentum-kept",
    "thread-more-accurate",
    "thread-needs-spin",
    "thread-one-rotation",
    "thread-only",
    "thread-stiffness-lowered",
    "thread-strip-buckling",
    "thread-variant-scheme",
    "thread-variant-torque-as-printed",
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "one",
    [pytest.param(one, marks=pytest.mark.release if one.name in LONG else (), id=one.name) for one in QUICK],
)
def test_the_stored_numbers_are_measured_again(one):
    assert one.differences(one.run().values) == []


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_a_row_is_complete(one):
    assert one.name.partition("-")[0] in papers.CLAIMS_OF
    assert one.source in ledger.SOURCES
    assert one.claim
    assert one.where
    assert "{" not in one.text()
    assert "nan" not in one.text().split()
    assert bool(one.measure) == (one.measured is not None)
    assert bool(one.undecided) != bool(one.holds)
    assert one.measure or one.undecided
    assert one.measured is None or one.measured.date


@pytest.mark.parametrize("one", [one for one in ALL if one.holds], ids=lambda one: one.name)
def test_a_verdict_does_not_hang_on_the_tolerance(one):
    """Each value may change by what a new measurement is allowed to, and the verdict stays."""
    for key, value in one.values.items():
        for change in (-one.allowed(key), one.allowed(key)):
            assert one.verdict({**one.values, key: value + change}) == one.verdict(), key


@pytest.mark.parametrize("one", [one for one in ALL if one.holds], ids=lambda one: one.name)
def test_a_verdict_uses_measured_values(one):
    assert one.needed
    assert one.needed <= one.values.keys()


def test_names_are_unique():
    names = [one.name for one in ALL]
    assert len(names) == len(set(names))


def test_figures_of_commands_exist():
    for one in ALL:
        words = one.command.split()
        if words[:2] == ["evolvent", "figure"]:
            assert words[2] in papers.ENTRIES, one.name


def test_cases_and_studies_of_commands_exist():
    for one in ALL:
        words = shlex.split(one.command)
        if words[:2] == ["evolvent", "run"]:
            changes = dict(word.split("=", 1) for flag, word in itertools.pairwise(words) if flag == "--set")
            assert cases.load(words[2], changes), one.name
        elif words[:2] == ["evolvent", "sweep"]:
            assert words[2] in studies.built_in(), one.name


def test_a_difference_is_a_sentence():
    one = Claim(
        name="a", where="b", claim="c", source="read", ours="{x:.1f}", measure="m.f", holds=("0 < x < 2",),
        in_part=("x < 3", "x > 0"), tolerance=0.1, measured=ledger.Measurement({"x": 1.0}, "", "", 0.0),
    )  # fmt: skip
    assert one.differences({"x": 1.05}) == []
    assert one.differences({"x": 1.2}) == ["x is 1.2, stored is 1 (allowed 0.1)"]
    assert one.differences({"x": 2.5})[1:] == ["the verdict is 'in part', stored is 'holds'"]
    assert one.verdict({"x": 4.0}) == "refuted"
    assert one.differences({"y": 1.0}) == ["measured are y, stored are x"]


def test_the_command_lists_and_counts(call):
    code, out, _ = call("claims")
    assert code == 0
    assert [line.partition("  ")[0] for line in out.splitlines()] == list(papers.CLAIMS_OF)
    for paper in papers.CLAIMS_OF:
        code, out, _ = call("claims", paper)
        assert code == 0
        assert len(out.splitlines()) == len(ledger.claims(paper)) + 1
        code, out, _ = call("claims", paper, "--markdown")
        assert code == 0
        assert out.startswith(ledger.counts(ledger.claims(paper)))


def test_measurements_are_kept_beside_others(call, tmp_path):
    file = tmp_path / "measured.json"
    for name in ("stand-partial-frequencies", "stand-axes"):
        code, out, _ = call("claims", name, "-o", str(file))
        assert code == 0
        assert "measured now: " in out
    kept = ledger.read(file)
    assert set(kept) == {"stand-partial-frequencies", "stand-axes"}
    assert kept["stand-axes"].values.keys() == ledger.claim("stand-axes").values.keys()
    assert kept["stand-axes"].date


@pytest.mark.parametrize(
    "content", ["[1,2", "[" * 100_000, "3", '{"stand-axes": 1}', '{"stand-axes": {"values": {"at": "x"}}}',
                '{"stand-axes": {"values": {"at": "x"}, "date": "", "version": "", "seconds": 1}}'],
    ids=range(6),
)  # fmt: skip
def test_other_files_are_refused(call, tmp_path, content):
    file = tmp_path / "other.json"
    file.write_text(content)
    code, _, err = call("claims", "stand-axes", "-o", str(file))
    assert code == 2
    assert "exists and holds no measurements of claims" in err
    assert file.read_text() == content


def test_all_of_a_paper_are_measured(call, monkeypatch):
    monkeypatch.setattr(Claim, "run", lambda one: one.measured)
    code, out, _ = call("claims", "stand", "--all")
    lines = out.splitlines()
    assert code == 0
    assert lines[-1] == f"{len(lines) - 1} measured, 0 differ from the stored values"
    assert len(lines) == 1 + sum(bool(one.measure) for one in ledger.claims("stand"))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["threads"], "no claim is called 'threads'; did you mean 'thread'?"),
        (["--markdown"], "--markdown needs a PAPER; give one of thread, rib, stand"),
        (["stand-axes", "--markdown"], "--markdown needs a PAPER, 'stand-axes' is a claim; give one of thread, rib"),
        (["stand", "-o", "x.json"], "-o needs --all or a CLAIM"),
        (["stand", "--all", "-o", "no/x.json"], "there is no folder"),
        (["stand", "--all", "-o", __file__], "exists and holds no measurements of claims; give another file"),
    ],
)
def test_refusals(call, words, sentence):
    code, out, err = call("claims", *words)
    assert (code, out) == (2, "")
    assert sentence in err
