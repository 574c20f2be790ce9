"""The ledger of the papers' claims: quick ones are measured again, the command, names and counts."""

import itertools
import shlex

import pytest

from evolvent import cases, papers, studies
from evolvent.papers import ledger
from evolvent.papers.ledger import Claim

ALL = [one for paper in papers.CLAIMS_OF for one in ledger.claims(paper)]
QUICK = [one for one in ALL if one.measure is not None and one.seconds <= ledger.QUICK]


@pytest.mark.parametrize("one", QUICK, ids=lambda one: one.name)
def test_the_stored_numbers_are_measured_again(one):
    assert one.differences(one.measure()) == []


@pytest.mark.parametrize("paper", papers.CLAIMS_OF)
def test_names_and_texts(paper):
    for one in ledger.claims(paper):
        assert one.name.startswith(f"{paper}-")
        assert one.verdict in ledger.VERDICTS
        assert "{" not in one.text()
        assert one.claim
        assert one.where


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
    one = Claim(name="a", where="b", claim="c", verdict="holds", ours="{x:.1f}", values={"x": 1.0}, tolerance=0.1)
    assert one.differences({"x": 1.05}) == []
    assert one.differences({"x": 1.2}) == ["x is 1.2, stored is 1 (allowed 0.1)"]
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
        assert out.startswith(f"{len(ledger.claims(paper))} claims: ")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["threads"], "no claim is called 'threads'; did you mean 'thread'?"),
        (["--markdown"], "--markdown needs a PAPER; give one of thread, rib, stand"),
    ],
)
def test_refusals(call, words, sentence):
    code, out, err = call("claims", *words)
    assert (code, out) == (2, "")
    assert sentence in err
