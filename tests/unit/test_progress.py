"""Progress of long operations: what is reported, and what a terminal shows of it."""

from __future__ import annotations

import io
import math
import re
import sys
import time

import pytest

import evolvent
from evolvent import parts
from evolvent_base import console, progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


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
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(console, "DELAY", 0.05 if slow else 1e9)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")

    def wait_for(words):
        end = time.monotonic() + (20.0 if slow else 0.1)
        while words not in terminal.getvalue() and time.monotonic() < end:
            time.sleep(0.01)

    with console.showing_progress() as say:
        progress.report("drawing frames", 0, 4)
        wait_for("drawing frames")
        progress.report("drawing frames", 2, 4)
        wait_for("2 of 4")
        say("one sentence")
    text = terminal.getvalue()
    assert "evolvent: one sentence" in text
    assert ("drawing frames" in text) == slow
    assert ("2 of 4" in text) == slow


def test_quiet_shows_nothing(monkeypatch, capsys):
    with console.showing_progress(quiet=True):
        progress.report("drawing frames", 0, 4)
    assert capsys.readouterr() == ("", "")


def test_lines_say_how_long_it_will_take():
    """The first after two seconds, then ever more rarely; the time left follows from the pace since the line before."""
    now, said = [0.0], []
    lines = progress.ProgressLines(said.append, clock=lambda: now[0])
    for k in range(400):
        now[0] = 0.5 * k
        lines.show(progress.Stage("running", 0.01 * k if k < 20 else 0.2 + 1e-5 * (k - 20), 10.0, "s"))
    assert said[0] == "running: 0.04 of 10 s after 2 s, about 8.3 min left"
    assert said[1] == "running: 0.08 of 10 s after 4 s, about 8.3 min left"
    assert said[-1].endswith("days left")
    assert len(said) < 12


@pytest.mark.parametrize(
    ("seconds", "words"), [(3.14, "3 s"), (45.0, "45 s"), (300.0, "5.0 min"), (3000.0, "50 min"), (9000.0, "2.5 h")]
)
def test_durations(seconds, words):
    assert progress.spoken(seconds) == words


def test_a_run_from_python_says_how_long_it_takes(monkeypatch, capsys):
    """On stderr, where no other report is asked for; a short run prints nothing."""
    system = evolvent.System()
    system.add(parts.Point(position=(1.0, 0.0, 0.0), mass=1.0), "mass")
    system.add(parts.Spring(a=("ground", (0.0, 0.0, 0.0)), b="mass", stiffness=1.0, length=0.5), "spring")
    asked = {"until": 50.0, "method": "rk4", "step": 0.01, "fine": False}
    system.simulate(**asked)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress, "FIRST", 0.0)
    system.simulate(**asked)
    assert re.match(r"evolvent: running: [\d.]+ of 50 s after [\d.]+ s, about [\d.]+ s left\n", capsys.readouterr().err)
    stages = []
    with progress.shown_by(stages.append):
        system.simulate(**asked)
    assert capsys.readouterr().err == ""


def test_a_bar_is_written_anew_and_cleared(monkeypatch):
    now, terminal = [0.0], Terminal()
    bar = progress.Bar(terminal, clock=lambda: now[0])
    for k in range(25):
        now[0] = 0.25 * k
        bar.show(progress.Stage("running", 0.25 * k, 10.0, "s"))
    states = terminal.getvalue().split("\r")[1:]
    assert len(states) == 17
    assert states[0].startswith("evolvent: running  " + 4 * "\N{FULL BLOCK}" + 16 * "\N{LIGHT SHADE}" + "  2 of")
    assert states[0].endswith("2 of 10 s, about 8 s left")
    bar.show(progress.Stage("running", 10.0, 10.0, "s"))
    assert terminal.getvalue().split("\r")[-2:] == [" " * len(states[-1].rstrip()), ""]


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_compilation_from_python_is_shown_from_its_start_on(monkeypatch, stream):
    """A line at once, then how long it will take, as the compilation itself estimates it."""
    shown = stream()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setattr(progress, "FIRST", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    progress.report_compilation(progress.Compilation(0, 3, math.nan))
    assert shown.getvalue() == "evolvent: compiling 3 functions for this machine, once\n"
    progress.report_compilation(progress.Compilation(1, 3, 44.0))
    progress.report_compilation(progress.Compilation(3, 3, 0.0))
    assert "1 of 3 functions" in shown.getvalue()
    assert "about 44 s left" in shown.getvalue()
    assert shown.getvalue().endswith("\r" if stream is Terminal else "left\n")
    before = shown.getvalue()
    with progress.compilation_shown_by(lambda state: None):
        progress.report_compilation(progress.Compilation(0, 3, math.nan))
    with progress.shown_by(lambda stage: None):
        progress.report_compilation(progress.Compilation(0, 3, math.nan))
    assert shown.getvalue() == before


def test_a_command_without_a_terminal_says_how_long_it_takes(monkeypatch, capsys):
    monkeypatch.setattr(progress, "FIRST", 0.0)
    for quiet in (False, True):
        with console.showing_progress(quiet=quiet):
            for done in (0.0, 1.0, 2.0):
                progress.report("running", done, 4.0, "s")
        said = capsys.readouterr().err
        assert ("evolvent: running: 1 of 4 s after 0 s, about 0 s left" in said) is not quiet
