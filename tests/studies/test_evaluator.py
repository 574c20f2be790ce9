"""The evaluator: each point once, from memory or the log; what fails or is stopped; differences at bounds."""

from __future__ import annotations

import contextlib
import dataclasses
import pathlib
import threading
from typing import Any

import numpy as np
import pytest
import xarray as xr

from evolvent.design.evaluator.differences import central
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.evaluator.log import Log
from evolvent.design.evaluator.record import Outcome
from evolvent.design.evaluator.task import Check, EvaluationTask, Runs
from evolvent_base.errors import InputError, RunFailed


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Squares(Runs):
    """Squares of a key; a negative one is a failed run, one above 100 raises."""

    seen: list[float] = dataclasses.field(default_factory=list)
    lacks: tuple[str, ...] = ()

    @property
    def most_threads(self) -> int:
        """As many as are wanted."""
        return 8

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[Outcome]:
        """The square of `x`, and the level."""
        found = []
        for number, point in zip(task.numbers, task.points, strict=True):
            x = point["x"]
            self.seen.append(x)
            if x > 100.0:
                raise RunFailed("too large", None)
            status = "success" if x >= 0.0 else "failed"
            values = {"square": xr.Variable((), x * x), "level": xr.Variable((), task.level)}
            reason = "negative" if x < 0.0 else ""
            found.append(Outcome(index=number, status=status, reason=reason, variables=values, missing=self.lacks))
        return found


def points(*values: float) -> list[dict[str, Any]]:
    """Points at values of the key."""
    return [{"x": value} for value in values]


def squares(rows: Any) -> list[float]:
    """What rows hold."""
    return [float(row.values("square")) for row in rows]


def test_each_point_is_evaluated_once() -> None:
    runs = Squares()
    evaluator = Evaluator(runs)
    assert squares(evaluator.of(points(1.0, 2.0, 1.0))) == [1.0, 4.0, 1.0]
    assert squares(evaluator.of(points(3.0, 2.0))) == [9.0, 4.0]
    assert runs.seen == [1.0, 2.0, 3.0]
    (finer,) = evaluator.of(points(2.0), level=1.0)
    assert float(finer.values("level")) == 1.0
    assert evaluator.evaluations == 4
    assert evaluator.table().cases == (0, 1, 3, 5)  # numbers of what was asked
    (failed,) = evaluator.of(points(-1.0))
    assert (failed.status, failed.reason, failed.values("none")) == ("failed", "negative", None)


def test_what_a_log_keeps_is_not_evaluated_again(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "kept.sqlite"
    with contextlib.closing(Log(path)) as log:
        evaluator = Evaluator(Squares(), log=log, batch=1)
        evaluator.of(points(1.0, 2.0))
        with pytest.raises(RunFailed):
            evaluator.of(points(3.0, 101.0))
        with pytest.raises(InputError, match="another process works in"):
            Log(path)
    runs = Squares()
    with contextlib.closing(Log(path)) as log:
        assert log.done == 3
        evaluator = Evaluator(runs, log=log)
        assert squares(evaluator.of(points(4.0, 3.0, 2.0))) == [16.0, 9.0, 4.0]
        assert (evaluator.evaluations, evaluator.reused) == (1, 2)
        evaluator.of(points(2.0))
        assert evaluator.reused == 2
    assert runs.seen == [4.0]


def test_threads_take_what_the_first_point_leaves() -> None:
    seen: list[tuple[int, int]] = []
    with Evaluator(Squares(), workers=3, batch=1, progress=lambda *n: seen.append(n)) as evaluator:
        found = evaluator.of(points(*map(float, range(20))), numbered=True)
        assert any(one.name.startswith("evolvent-variant") for one in threading.enumerate())
    assert squares(found) == [float(k * k) for k in range(20)]
    assert seen == [(k, 20) for k in range(21)]
    assert not any(one.name.startswith("evolvent-variant") for one in threading.enumerate())


def test_names_that_no_run_has_are_refused_by_the_first_task() -> None:
    with pytest.raises(InputError, match="keep holds 'squrae', which no run has"):
        Evaluator(Squares(lacks=("squrae",))).of(points(1.0))


def test_differences_are_one_sided_at_bounds_and_beside_failures() -> None:
    asked: list[int] = []

    def values(places: list[np.ndarray]) -> list[np.ndarray]:
        asked.append(len(places))
        return [np.array([x[0] ** 2 + x[1], x[1]]) if x[1] <= 2.0 else np.full(2, np.nan) for x in places]

    found = central(values, np.array([1.0, 2.0]), 0.25, 0.0, np.array([1.0, 3.0]))
    np.testing.assert_allclose(found, [[(1.0 - 0.75**2) / 0.25, 1.0], [0.0, 1.0]])
    assert asked == [5]
    assert np.all(np.isnan(central(values, np.array([1.0, 2.5]), 0.25, 0.0, 3.0)[:, 1]))
