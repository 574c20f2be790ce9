"""A study that takes a moment: short deployments of blades of few nodes."""

import copy
from collections.abc import Callable
from typing import Any

import pytest

from evolvent.design import studies

#: A grid of 6 cases.
STUDY = {
    "study": "short",
    "case": "heliogyro",
    "set": {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "0.5 s"},
    "over": {"spool.rate": {"from": "3 rad/s", "to": "4 rad/s", "points": 3}, "blade.nodes": [3, 5]},
    "keep": ["body_rate.last", "blade-1.lag.max", "steps"],
}


@pytest.fixture
def study():
    """A copy of the study that may be changed."""
    return copy.deepcopy(STUDY)


@pytest.fixture(scope="session")
def swept(tmp_path_factory):
    """The folder of the study, swept here in batches of two."""
    folder = tmp_path_factory.mktemp("swept") / "s"
    studies.sweep(copy.deepcopy(STUDY) | {"batch": 2}, output=folder)
    return folder


@pytest.fixture(scope="session")
def whole():
    """Results of the study, computed here."""
    return studies.sweep(copy.deepcopy(STUDY))


@pytest.fixture
def replace_run(monkeypatch) -> Callable[[Any, Callable[[Any, Callable[[], Any]], Any]], None]:
    """Replace what the plans of a system run: by a function of the case and of the run that it replaces."""

    originals: dict[str, Any] = {}

    def replace(module: Any, run: Callable[[Any, Callable[[], Any]], Any]) -> None:
        plan = originals.setdefault(module.__name__, module.SYSTEM.plan)

        def planned(case: Any, **options: Any) -> Any:
            found = plan(case, **options)
            return found._replace(run=lambda progress=None: run(case, lambda: found.run(progress)), keep=None)

        monkeypatch.setattr(type(module.SYSTEM), "plan", staticmethod(planned))

    return replace
