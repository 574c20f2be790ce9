"""What `start.py` chooses to run; nothing is installed or run."""

from __future__ import annotations

import ast
import importlib.util
import os
import pathlib
import subprocess
import sys
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
    for words, files in (([], start.quick_files()), (["-k", "rotation"], []), (["tests/rods", "-x"], [])):
        calls.clear()
        assert start.quick(words) == 0
        ((program, *options),) = calls
        assert pathlib.Path(program).stem == "pytest"
        assert options == ["-q", "-m", "not slow and not release", "-n", "2", *files, *words]


def is_slow(path: pathlib.Path) -> list[bool]:
    """Whether each test of a file has the marker `slow`, of its own or of the file."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    whole = any(isinstance(node, ast.Assign) and "mark.slow" in ast.unparse(node) for node in body)
    tests = [node for node in body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    return [whole or any("mark.slow" in ast.unparse(one) for one in test.decorator_list) for test in tests]


def test_quick_has_tests_of_every_folder(start: Any) -> None:
    chosen = [pathlib.Path(name) for name in start.quick_files()]
    for folder in {path.parent for path in start.test_files()}:
        assert not all(slow for path in chosen if path.parent == folder for slow in is_slow(path)), folder.name


def test_what_runs_under_another_processor_alone_enters_no_rows(start: Any) -> None:
    """The step `digits` has no book: a test that asks for it may not be `slow` and `digits`."""
    for name in start.with_digits():
        for node in ast.parse((ROOT / name).read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and "book" in [argument.arg for argument in node.args.args]:
                marks = {ast.unparse(one) for one in node.decorator_list}
                assert not {"pytest.mark.slow", "pytest.mark.digits"} <= marks, node.name


def test_all_steps_run_and_a_failure_names_its_tests_at_the_end(start: Any, monkeypatch: Any, tmp_path: Any) -> None:
    """Whatever a later step prints; the tests that compare digits run once more, and enter nothing into the book."""
    calls: list[list[str]] = []

    def call(command: list[str], output: Any = None, **environment: str) -> int:
        name = pathlib.Path(command[0]).stem
        calls.append([name, *command[1:]])
        if name == "mypy":
            output.write(b"no error\n")
        if "digits" in command:
            assert environment["OPENBLAS_CORETYPE"]
            assert environment["EVOLVENT_BOOK"] == ""
            return 0
        assert environment == {}
        if name == "pytest":
            pathlib.Path(os.environ["EVOLVENT_FAILED_TESTS"]).write_text("tests/a.py::test_x[1]\ntests/b.py::test_y\n")
        return int(name == "pytest")

    for name in ("FAILED", "BOOK"):
        monkeypatch.setattr(start, name, tmp_path / name / "file")
    for name in ("EVOLVENT_BOOK", "EVOLVENT_FAILED_TESTS"):
        monkeypatch.setenv(name, "")
    said: list[str] = []
    monkeypatch.setattr(start, "call", call)
    monkeypatch.setattr(start, "say", said.append)
    monkeypatch.setattr(start, "find_browser", lambda: None)
    assert start.test([]) == 1
    names = [name for name, *_ in calls]
    steps = ["ruff", "ruff", "mypy", "lint-imports", "python", "pytest", "python", "pytest", "sphinx-build"]
    assert sorted(names) == sorted(steps)
    assert ["python", "tests/book.py", str(start.BOOK)] in calls, "without --whole, since tests have failed"
    assert [name for name in names if name in ("pytest", "python")] == ["python", "pytest", "python", "pytest"]
    assert "precompile" in calls[names.index("python")][-1]
    assert names.index("sphinx-build") > names.index("python"), "which loads compiled functions"
    (again,) = (words for words in calls if "digits" in words)
    assert "tests/docs/test_sentences.py" in again
    assert "tests/unit/test_run.py" not in again, "which has none"
    assert said[-1].splitlines() == ["failed: tests", "  tests/a.py::test_x[1]", "  tests/b.py::test_y"]
    assert [text for text in said if text.startswith("no error\n--- types: ok in ")]
    for words, options in (
        ([], ["-m", "not release and not (slow and digits)"]),
        (["-k", "rotation"], ["-m", "not release", "-k", "rotation"]),
        (["--release", "-k", "rotation"], ["-k", "rotation"]),
    ):
        calls.clear()
        assert start.test(words) == 1
        first = next(command for command in calls if command[0] == "pytest")
        assert first == ["pytest", "-q", "-rs", f"--junitxml={start.DURATIONS}", *start.in_parallel(), *options]


@pytest.mark.slow
def test_the_tests_write_down_which_of_them_failed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "conftest.py").write_text((ROOT / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    tests = "import pytest\n@pytest.fixture\ndef broken(): 1 / 0\ndef test_a(): pass\n"
    tests += "@pytest.mark.parametrize('x', [1, 2])\ndef test_b(x): assert x == 1\ndef test_c(broken): pass\n"
    (tmp_path / "test_some.py").write_text(tests)
    environment = {"PYTHONPATH": f"{ROOT / 'tests'}", "EVOLVENT_FAILED_TESTS": str(tmp_path / "failed")}
    paths = [environment["PYTHONPATH"], os.environ.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", "pytest.ini", "."]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | environment, capture_output=True, check=False)
    assert done.returncode == 1
    assert (tmp_path / "failed").read_text().splitlines() == ["test_some.py::test_b[2]", "test_some.py::test_c"]


def test_the_comparison_runs_by_its_name_alone(start: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[list[str]] = []

    def call(command: list[str]) -> int:
        calls.append([pathlib.Path(command[1]).stem, *command[2:]])
        return 0

    monkeypatch.setattr(start, "call", call)
    assert start.bench([]) == 0
    every = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    assert {name for (name,) in calls} == every - set(start.BY_NAME)
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
