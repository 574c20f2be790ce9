"""Files of results that were altered: opened with a warning, or refused in one sentence, never a traceback."""

from __future__ import annotations

import json
import pathlib
import shutil
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
import pytest

from evolvent import results
from evolvent_base.errors import InputError

pytestmark = pytest.mark.slow

DEEP = "[" * 900 + "]" * 900
ROOT = {
    "laws": [DEEP, f'{{"a": {DEEP}}}', '{"x": 5}', "[]"],
    "statistics": [DEEP, f'{{"a": {DEEP}}}', '{"steps": "x"}', '{"steps": [1]}'],
    "variables": [DEEP, f'{{"a": {DEEP}}}', '{"x": 5}', '{"x": {"y": [1]}}', '{"x": {"y": "z"}}'],
    "parts": [DEEP, '{"hub": 1}', '["hub", ["x"]]', '[{"a": 1}]', '["hub"]', '["nobody"]'],
    "title": ["a\x1b[2J", "a\u202eb"],
}
PART = {
    "drawn": [DEEP, "[1]", '["x"]', "[null]", '[["a"]]', '[{"line": {}}]', '[{"frame": 5}]', '[{"spool": {}}]',
              '[{"symbol": {"body": "nobody"}}]', '[{"marks": {"points": ["x"]}}]'],
    "plots": [DEEP, "[1]", "[null]", '[["a"]]', '[{"x": 1}]', '{"x": 1}'],
    "variables": [DEEP, "[1]", '{"x": 5}', '{"x": {"time": 2.5}}'],
}  # fmt: skip


@pytest.fixture
def path(structure_run: pathlib.Path, tmp_path: pathlib.Path) -> pathlib.Path:
    """A copy of a run of a hub and a boom."""
    return pathlib.Path(shutil.copy(structure_run, tmp_path / "run.nc"))


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in ROOT.items() for value in values])
def test_attributes_of_the_root(key: str, value: str, path: pathlib.Path) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs[key] = value
    with pytest.raises(InputError, match="no whole run"):
        results.open(path)


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in PART.items() for value in values])
def test_attributes_of_a_part(key: str, value: str, path: pathlib.Path) -> None:
    with h5py.File(path, "r+") as file:
        file["hub"].attrs[key] = value
    with pytest.raises(InputError, match="no whole run"):
        results.open(path)


def swapped(file: Any) -> None:
    file.move("hub", "other")
    file.move("boom", "hub")
    file.move("other", "boom")


def copied(file: Any) -> None:
    file.copy("hub", "second")


def nested(file: Any) -> None:
    file.copy(file["hub"], file["boom"], "inner")


def dotted(file: Any) -> None:
    file["hub.rate"] = np.zeros((6, 3))


@pytest.mark.parametrize("change", [swapped, copied, nested, dotted])
def test_groups_and_names(change: Callable[[Any], None], path: pathlib.Path) -> None:
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(InputError, match="no whole run"):
        results.open(path)


@pytest.mark.parametrize("value", [5, np.zeros(2), "x" * 10, None])
def test_damaged_lists_of_dimensions(value: Any, path: pathlib.Path) -> None:
    """Opened with a warning, or refused."""
    with h5py.File(path, "r+") as file:
        for name in ("energy", "hub/rate"):
            del file[name].attrs["DIMENSION_LIST"]
            if value is not None:
                file[name].attrs["DIMENSION_LIST"] = value
    try:
        assert "altered" in results.open(path).attrs["warning"]
    except InputError as error:
        assert "cannot read" in str(error)  # noqa: PT017  (either end is right)


def test_statistics_without_steps_are_shown(path: pathlib.Path) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs["statistics"] = json.dumps({"iterations": None})
    run = results.open(path)
    assert "altered" in run.attrs["warning"]
    assert any(number.label == "steps" for number in results.closing_numbers(run))
