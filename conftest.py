"""What all tests share: seeds, figures without a screen, and one compilation before several workers start."""

from __future__ import annotations

import gc
import os
import pathlib
import sys

os.environ.setdefault("MPLBACKEND", "Agg")
# packages that a user has added change what is listed; tests of plug-ins ask for them
os.environ["EVOLVENT_PLUGINS"] = os.environ.get("EVOLVENT_TEST_PLUGINS", "none")
# the matrices are small: threads of the linear algebra only get into each other's way
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings

from book import Book, short_name
from evolvent_base import cli

settings.register_profile("seeded", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("seeded")

#: Thresholds of the garbage collector while tests run; with Python's defaults it takes 4 % of their time.
THRESHOLDS = (5_000, 20, 20)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20140)


@pytest.fixture
def call(monkeypatch, capsys, tmp_path):
    """Call the command line in an empty folder; returns (code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["evolvent", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return ended.value.code, out, err

    return run


@pytest.fixture
def sketched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are files of one byte or point, for tests of what is written where: drawing them takes a second a run."""
    from evolvent_base import plots

    monkeypatch.setattr(plots, "picture", lambda figure, kind, **_: b"-")
    monkeypatch.setattr(plots, "sheet", lambda figure, **_: None)
    monkeypatch.setattr(plots, "_points", lambda drawn: (np.zeros((1, 1, 3), dtype=np.uint8), 72.0))


@pytest.fixture
def book(request: pytest.FixtureRequest) -> Book:
    """Where a test enters what it has found against a reference (`tests/book.py`)."""
    return Book(short_name(request.node.nodeid.split("[")[0]))


@pytest.fixture(autouse=bool(os.environ.get("EVOLVENT_ROUND_OFF")))
def _round_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """With $EVOLVENT_ROUND_OFF=SEED the start states of all models are off by round-off, as on another processor."""
    from evolvent.assembly.assembled import Assembly
    from evolvent.assembly.builder import Builder

    build = Builder.build

    def off(builder: Builder) -> Assembly:
        found, rng = build(builder), np.random.default_rng(int(os.environ["EVOLVENT_ROUND_OFF"]))
        places = found.y[: int(found.model.info.nq)]
        places *= 1.0 + np.finfo(float).eps * rng.choice([-1.0, 0.0, 1.0], size=places.size)
        return found

    monkeypatch.setattr(Builder, "build", off)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name failed tests in the file $EVOLVENT_FAILED_TESTS; `start.py test` shows them at its end."""
    path = os.environ.get("EVOLVENT_FAILED_TESTS")
    if path:
        reports = [report for kind in ("failed", "error") for report in terminalreporter.stats.get(kind, ())]
        pathlib.Path(path).write_text("".join(f"{name}\n" for name in dict.fromkeys(one.nodeid for one in reports)))


def pytest_collection() -> None:
    """Collect garbage rarely while tests are collected: what that makes stays, and is looked through in vain."""
    gc.set_threshold(100_000, 50, 100)


def pytest_collection_finish() -> None:
    """Lower the thresholds of the garbage collector again, and exempt the collected tests from it."""
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile all functions once, before workers that share its cache folder would each do so at the same time."""
    several = bool(getattr(session.config.option, "numprocesses", None))
    on_worker = hasattr(session.config, "workerinput")
    if not several or on_worker or session.config.option.collectonly:
        return
    from evolvent.compiled import precompile

    precompile.compile_all()
