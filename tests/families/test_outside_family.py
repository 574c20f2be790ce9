"""A family from outside the package needs one file: `tests/outside/rotary_damper.py`, found by its entry point."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import pytest

OUTSIDE = pathlib.Path(__file__).parents[1] / "outside"


def test_it_is_one_short_file() -> None:
    assert len((OUTSIDE / "rotary_damper.py").read_text().splitlines()) <= 90


@pytest.mark.slow
def test_every_method_margin_and_sensitivity_takes_it() -> None:
    paths = [str(OUTSIDE), *sys.path]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "EVOLVENT_TEST_PLUGINS": "all"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(OUTSIDE / "checks.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
