"""What all tests share: seeds, figures without a screen, and one compilation before several workers start."""

from __future__ import annotations

import os
import sys

os.environ.setdefault("MPLBACKEND", "Agg")
# packages that a user has added change what is listed; tests of plug-ins ask for them
os.environ["EVOLVENT_PLUGINS"] = "none"
# the matrices are small: threads of the linear algebra only get into each other's way
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings

from book import Book
from evolvent import cli

settings.register_profile("seeded", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("seeded")


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
def book(request: pytest.FixtureRequest) -> Book:
    """Where a test enters what it has found against a reference (`tests/book.py`)."""
    return Book(request.node.nodeid.split("[")[0].removeprefix("tests/"))


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile all functions once, before workers that share its cache folder would each do so at the same time."""
    several = bool(getattr(session.config.option, "numprocesses", None))
    on_worker = hasattr(session.config, "workerinput")
    if not several or on_worker or session.config.option.collectonly:
        return
    from evolvent import precompile

    precompile.load_all()
