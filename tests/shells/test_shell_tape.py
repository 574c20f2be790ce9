"""A tape spring as a shell against the theory of its section; finer meshes are in benchmarks/tape_shell.py."""

from __future__ import annotations

import importlib.util
import pathlib
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent.closed_forms.tapes import flattened_bending, snap

PATH = pathlib.Path(__file__).parents[2] / "benchmarks" / "tape_shell.py"
CHAPTER = "Statics of shells"


@pytest.fixture(scope="module")
def tape() -> Any:
    """The module benchmarks/tape_shell.py."""
    spec = importlib.util.spec_from_file_location("tape_shell", PATH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_a_section_that_is_flat_is_that_of_wuest(tape: Any) -> None:
    """In a fold both theories have the same moment; unbent the arc of 90 degrees is 8 % softer than a shallow one."""
    assert tape.propagation(1.0) == pytest.approx(snap(tape.TAPE, tape.STEEL, 1).propagation_moment, rel=1e-3)
    unbent = tape.uniform_bending(0.01).moment / 0.01
    half, R, t = 0.5 * tape.TAPE.angle, tape.TAPE.radius, tape.TAPE.thickness
    assert unbent == pytest.approx(
        tape.STEEL.E * t * R**3 * (half + 0.5 * np.sin(2.0 * half) - 2.0 * np.sin(half) ** 2 / half), rel=1e-3
    )
    assert unbent == pytest.approx(0.916 * float(flattened_bending(tape.TAPE, tape.STEEL, 0.01)[0]) / 0.01, rel=2e-3)


@pytest.mark.slow
def test_a_tape_flattens_as_its_section(tape: Any, book: Book) -> None:
    """A tape of 300 mm between rigid ends: its middle up to 0.45 1/m, and its peak, which the ends raise."""
    found = tape.bent(0.15, (60, 8), steps=56)
    inside = (found.curvature > 0.15) & (found.curvature < 0.45)
    assert inside.sum() > 5
    wanted = np.array([tape.uniform_bending(float(k)).moment for k in found.curvature[inside]])
    book(
        CHAPTER, "Tape spring, moment in its middle up to 0.45 1/m (quarter, 60 x 8)", reference="uniform bending",
        source="least energy of the section", error=np.abs(found.moment[inside] / wanted - 1.0).max(), allowed=0.015,
    )  # fmt: skip
    book(
        CHAPTER, "Tape spring of 300 mm between rigid ends, peak (quarter, 60 x 8)", reference="0.37911 N m",
        source="Wuest 1954, without ends", error=abs(found.moment.max() / 0.37911 - 1.0), allowed=0.04,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("sense", "name"), [(1.0, "opposite"), (-1.0, "equal")])
def test_a_fold_grows_at_the_propagation_moment(tape: Any, book: Book, sense: float, name: str) -> None:
    """Snap, and a fold that runs, from 100 to 150 degrees."""
    found, wanted = tape.grown(0.06, (24, 5), sense), snap(tape.TAPE, tape.STEEL, int(sense)).propagation_moment
    book(
        CHAPTER, f"Tape spring, fold that grows in {name} sense (quarter, 24 x 5)", reference=f"{wanted:.5f} N m",
        source="Maxwell line of Wuest 1954", error=abs(found.moment / wanted - 1.0), allowed=0.05,
    )  # fmt: skip
    assert found.defect < 0.02
