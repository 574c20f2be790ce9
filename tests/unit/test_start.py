"""What `start.py` chooses to run; nothing is installed or run."""

from __future__ import annotations

import importlib.util
import pathlib
from typing import Any

import pytest

ROOT = pathlib.Path(__file__).parents[2]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Any:
    """`start.py` as a module that installs nothing."""
    spec = importlib.util.spec_from_file_location("start", ROOT / "start.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "set_up", lambda extra: 0)
    return module


def test_quick_runs_pytest_alone(start: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[list[str]] = []
    monkeypatch.setattr(start, "call", lambda command: calls.append(command) or 0)
    monkeypatch.setattr(start, "in_parallel", lambda: ["-n", "2"])
    folders = [str(ROOT / name) for name in start.QUICK]
    assert all(pathlib.Path(folder).is_dir() for folder in folders)
    for words, expected in (
        ([], folders),
        (["-k", "rotation"], [*folders, "-k", "rotation"]),
        (["tests/rib", "-x"], ["tests/rib", "-x"]),
        (["tests/unit/test_start.py::test_x"], ["tests/unit/test_start.py::test_x"]),
    ):
        calls.clear()
        assert start.quick(words) == 0
        ((program, *options),) = calls
        assert pathlib.Path(program).stem == "pytest"
        assert options == ["-q", "-m", "not slow", "-n", "2", *expected]


def test_the_comparison_runs_by_its_name_alone(start: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[list[str]] = []

    def call(command: list[str]) -> int:
        calls.append([pathlib.Path(command[1]).stem, *command[2:]])
        return 0

    monkeypatch.setattr(start, "call", call)
    assert start.bench([]) == 0
    every = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    assert {name for (name,) in calls} == every - {"compare"}
    calls.clear()
    assert start.bench(["compare", "--repeat", "2"]) == 0
    assert calls == [["compare", "--repeat", "2"]]
    assert start.bench(["--repeat", "2"]) == 2


def test_bytecode_is_kept_in_the_environment(start: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.delenv("PYTHONPYCACHEPREFIX", raising=False)
    start.keep_bytecode()
    assert "PYTHONDONTWRITEBYTECODE" not in start.os.environ
    assert pathlib.Path(start.os.environ["PYTHONPYCACHEPREFIX"]) == start.VENV / "bytecode"
