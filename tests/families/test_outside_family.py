"""A family from outside the package needs one file, found by its entry point: a force, and a row of constraint."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import pytest

OUTSIDE = pathlib.Path(__file__).parents[1] / "outside"


@pytest.mark.parametrize(("name", "most"), [("rotary_damper", 90), ("tie", 140)])
def test_it_is_one_short_file(name: str, most: int) -> None:
    assert len((OUTSIDE / f"{name}.py").read_text().splitlines()) <= most


@pytest.mark.slow
def test_every_method_margin_and_sensitivity_takes_them() -> None:
    """In one process, which finds the entry points of both."""
    paths = [str(OUTSIDE), *sys.path]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "EVOLVENT_TEST_PLUGINS": "all"}
    checks = [str(OUTSIDE / name) for name in ("checks.py", "tie_checks.py")]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *checks]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
