"""The page on batches: what it shows runs."""

from __future__ import annotations

import pathlib
import re

import numpy as np
import pytest

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "guide" / "batches.md"
FIRST, SECOND = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def test_the_batch_of_the_page_latches() -> None:
    names: dict = {}
    exec(FIRST, names)
    assert names["batch"].status.tolist() == ["running"] * 8
    assert np.all(np.abs(names["angle"]) < 1e-3)
    assert [what for _, _, what in names["batch"].events(0)] == ["latched"] * 3


def test_the_environment_of_the_page_is_one_of_gymnasium() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    names: dict = {}
    exec(SECOND, names)
    environment = names["Slew"](3, duration=0.5)
    assert isinstance(environment, gymnasium.vector.VectorEnv)
    first, _ = environment.reset(seed=2)
    rows = [environment.step(np.zeros((3, 1)))[:4] for _ in range(7)]
    again, _ = environment.reset(seed=2)
    assert np.array_equal(first, again)
    assert environment.observation_space.contains(rows[0][0])
    assert [bool(cut.all()) for *_, cut in rows] == [False, False, False, False, True, False, False]
    assert np.all(rows[5][1] == 0.0)  # the reward of the step that begins again
