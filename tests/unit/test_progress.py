"""Progress of long operations: what is reported, and what a terminal shows of it."""

from __future__ import annotations

import io
import sys
import time

import pytest

from evolvent import console, progress


def test_stages_reach_the_listener_and_nobody_else():
    stages = []
    progress.report("before", 1, 2)  # nobody listens
    with progress.shown_by(stages.append):
        assert list(progress.track("abc", "letters")) == ["a", "b", "c"]
        progress.report("running", 1.5, 3.0, "s")
    progress.report("after")
    assert stages[0] == progress.Stage("letters", 0.0, 3.0)
    assert [stage.done for stage in stages] == [0.0, 1.0, 2.0, 3.0, 1.5]
    assert stages[-1] == progress.Stage("running", 1.5, 3.0, "s")


def test_an_iterator_of_unknown_length_is_tracked():
    stages = []
    with progress.shown_by(stages.append):
        assert list(progress.track(iter("ab"), "letters")) == ["a", "b"]
        assert list(progress.track(iter("ab"), "letters", 2)) == ["a", "b"]
    assert {stage.total for stage in stages[:3]} == {0.0}
    assert {stage.total for stage in stages[3:]} == {2.0}


@pytest.mark.parametrize("slow", [True, False])
def test_a_terminal_shows_what_takes_longer_than_a_second(monkeypatch, slow):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(console, "DELAY", 0.05 if slow else 1e9)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    with console.showing_progress() as say:
        progress.report("drawing frames", 0, 4)
        time.sleep(0.4)
        progress.report("drawing frames", 2, 4)
        time.sleep(0.3)
        say("one sentence")
    text = terminal.getvalue()
    assert "evolvent: one sentence" in text
    assert ("drawing frames" in text) == slow
    assert ("2 of 4" in text) == slow


def test_quiet_shows_nothing(monkeypatch, capsys):
    with console.showing_progress(quiet=True):
        progress.report("drawing frames", 0, 4)
    assert capsys.readouterr() == ("", "")
