"""The shipped model of a solar panel against its script and plates of the literature, and the array that has three."""

from __future__ import annotations

import importlib.util
import pathlib
from types import ModuleType

import numpy as np
import pytest
import scipy.linalg

import evolvent as ev
from evolvent.elements.reduced_files import read_model
from evolvent.elements.reduced_models import mean_axes

SCRIPT = pathlib.Path(__file__).parents[2] / "tools" / "solar_panel.py"
#: w a^2 sqrt(m/D) of a square plate with free edges, Poisson's ratio 0.3: Leissa (1973), J. Sound Vib. 31, 257-293.
FREE_SQUARE = (13.489, 19.789, 24.432, 35.024)


@pytest.fixture(name="script", scope="module")
def _script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("solar_panel", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_plate_elements_against_a_free_square_plate(script: ModuleType) -> None:
    """Leissa's values, by Ritz's method with beam functions, lie up to 1.5 % above the exact ones."""
    plate = script.Plate(width=1.0, along=12, across=12)
    K, M, _ = script.assembled(plate)
    square = scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, 9])
    found = np.sqrt(np.abs(square)) * np.sqrt(plate.mass / (plate.length * plate.width * plate.bending))
    assert found[:6].max() < 1e-2
    assert found[6:] == pytest.approx(FREE_SQUARE, rel=1.5e-2)


def test_the_shipped_model_is_that_of_the_script(script: ModuleType) -> None:
    shipped, made = read_model("solar-panel"), script.reduced(script.Plate())
    assert shipped.names == made.names == ("inner", "outer")
    for one, other in ((shipped.stiffness, made.stiffness), (shipped.mass, made.mass)):  # but for the modes' signs
        assert np.abs(np.abs(one) - np.abs(other)).max() < 1e-8 * np.abs(one).max()
        assert np.abs(one - other)[:12, :12].max() < 1e-8 * np.abs(one[:12, :12]).max()
    found = mean_axes(shipped, "panel")
    assert found.mass + 2 * found.node_mass == pytest.approx(4.0, rel=1e-9)
    full_K, full_M, _ = script.assembled(script.Plate())
    full = np.sqrt(scipy.linalg.eigh(full_K, full_M, eigvals_only=True, subset_by_index=[6, 7]))
    assert np.all(np.sqrt(found.square[:2]) > full)  # whose hinge lines are not rigid
    more = mean_axes(script.reduced(script.Plate(), 40), "panel")
    assert np.sqrt(found.square[:4]) == pytest.approx(np.sqrt(more.square[:4]), rel=6e-3)


@pytest.mark.slow
def test_the_flexible_array_opens_as_the_rigid_one_until_a_latch_locks() -> None:
    """Its first latch locks at the time of the rigid array; later the panels swing. Momenta are kept."""
    flexible, rigid = ev.run("solar-array-flexible"), ev.run("solar-array")
    first = [run["hinge 2/latch_time"].values[-1] for run in (flexible, rigid)]
    assert first[0] == pytest.approx(first[1], rel=1e-3)
    assert np.isfinite([flexible[f"hinge {k}/latch_time"].values[-1] for k in (1, 2, 3)]).all()
    assert np.abs(flexible["angular_momentum"].values).max() < 1e-9
    before = flexible["time"].values < first[0]
    moved = np.abs(flexible["panel 3/displacement"].values).max(axis=(1, 2))
    assert moved[~before].max() > 10.0 * moved[before].max()
    assert not flexible.attrs.get("warning")
