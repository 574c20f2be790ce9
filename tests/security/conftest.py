"""A run, a recording and a study that the attacks start from."""

from __future__ import annotations

import pathlib
import shutil

import pytest

from evolvent import cases, results
from evolvent.design import studies

#: A case of few samples, and a study of two of it.
CASE = "heliogyro"
SHORT = {"blade.nodes": 4, "blade.length": "0.2 m", "output.every": "0.5 s"}
STUDY = {
    "study": "pay-out",
    "case": CASE,
    "set": SHORT,
    "over": {"spool.rate": ["2 rad/s", "3 rad/s"]},
    "keep": ["body_rate.last", "tip_lag"],
}


@pytest.fixture(scope="session")
def whole_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A saved run."""
    path = tmp_path_factory.mktemp("run") / "run.nc"
    case = cases.load(CASE, SHORT)
    results.save(cases.system(case.system).plan(case).run(None), path)
    return path


@pytest.fixture(scope="session")
def structure_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A saved run of a structure, with a group for each part."""
    path = tmp_path_factory.mktemp("structure") / "run.nc"
    case = cases.load("boom-slew", {"simulate.until": "0.5 s", "simulate.every": "0.1 s"})
    results.save(cases.system(case.system).plan(case).run(None), path)
    return path


@pytest.fixture(scope="session")
def whole_study(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The folder of a finished study."""
    folder = tmp_path_factory.mktemp("study") / "pay-out"
    studies.sweep(STUDY, output=folder, workers=1)
    return folder


@pytest.fixture
def run_copy(whole_run: pathlib.Path, tmp_path: pathlib.Path) -> pathlib.Path:
    """A copy of the run that a test may damage."""
    return pathlib.Path(shutil.copy(whole_run, tmp_path / "run.nc"))


@pytest.fixture
def study_copy(whole_study: pathlib.Path, tmp_path: pathlib.Path) -> pathlib.Path:
    """A copy of the study that a test may damage."""
    return pathlib.Path(shutil.copytree(whole_study, tmp_path / "pay-out"))
