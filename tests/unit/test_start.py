"""What `start.py` chooses to run; nothing is installed or run."""

from __future__ import annotations

import importlib.util
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[2]


def test_the_comparison_runs_by_its_name_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("start", ROOT / "start.py")
    assert spec is not None
    assert spec.loader is not None
    start = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(start)
    calls: list[list[str]] = []

    def call(command: list[str]) -> int:
        calls.append([pathlib.Path(command[1]).stem, *command[2:]])
        return 0

    monkeypatch.setattr(start, "set_up", lambda extra: 0)
    monkeypatch.setattr(start, "call", call)
    assert start.bench([]) == 0
    every = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    assert {name for (name,) in calls} == every - {"compare"}
    calls.clear()
    assert start.bench(["compare", "--repeat", "2"]) == 0
    assert calls == [["compare", "--repeat", "2"]]
    assert start.bench(["--repeat", "2"]) == 2
