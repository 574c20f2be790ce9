"""Results of shells by name: resultants, energies and how a shell is drawn, against closed forms."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipk

import evolvent
from evolvent import parts
from evolvent.view.drawing import motion_of
from shells.plates import loaded, material

E, LENGTH, WIDTH, THICKNESS = 1.2e6, 12.0, 2.0, 0.1


def strip(**load: Any) -> Any:
    """A strip that is clamped at one end, in equilibrium under a force or torque per length of the other."""
    shell = parts.Shell(
        size=(LENGTH, WIDTH), elements=(6, 2), thickness=THICKNESS, material=material(E), clamped=("x0",)
    )
    return loaded(shell, "x1", **load).equilibrium()


@pytest.mark.slow
def test_a_strip_that_a_moment_bends(tmp_path: Any) -> None:
    """To a quarter of a circle: M = E h^3/12 (pi/2)/L everywhere, and nothing else."""
    D = E * THICKNESS**3 / 12.0
    moment = D * 0.5 * np.pi / LENGTH
    run = strip(torque=(0.0, -moment, 0.0))
    found = run["shell"]
    for name, wanted in (("moment_1", -moment), ("principal_moment", -moment), ("twisting_moment", 0.0)):
        assert found[name].dims == ("time", "element")
        assert found[name].values == pytest.approx(np.full((1, 12), wanted), abs=2e-3 * moment)
        assert found[name].attrs["units"] == "N"
    assert found["membrane_force_1"].attrs["units"] == found["shear_force_2"].attrs["units"] == "N m-1"
    assert found["energy_density"].values == pytest.approx(np.full((1, 12), 0.5 * moment**2 / D), rel=4e-3)
    elastic = float(found["energy_elastic"].values[-1])
    assert elastic == pytest.approx(LENGTH * WIDTH * 0.5 * moment**2 / D, rel=4e-3)
    assert float((found["energy_density"] * LENGTH * WIDTH / 12.0).sum()) == pytest.approx(elastic, rel=1e-9)
    assert float(found["energy_bending"].values[-1]) == pytest.approx(elastic, rel=1e-2)
    assert float(found["energy_drilling"].values[-1]) < 1e-6 * elastic
    # the tip is at 2 L/pi along both axes
    tip = found["displacement"].values[-1, -1] + [LENGTH, WIDTH, 0.0]
    assert tip == pytest.approx([2.0 * LENGTH / np.pi, WIDTH, 2.0 * LENGTH / np.pi], abs=2e-3 * LENGTH)
    assert found["direction_1"].values[-1, -1] == pytest.approx([np.sin(np.pi / 24), 0.0, np.cos(np.pi / 24)], abs=5e-3)
    q = found["attitude"].values[-1, -1]
    assert q == pytest.approx([np.cos(np.pi / 4), 0.0, -np.sin(np.pi / 4), 0.0], abs=2e-3)
    evolvent.save(run, tmp_path / "run.nc")
    assert evolvent.open(tmp_path / "run.nc").identical(run)


@pytest.mark.slow
def test_a_strip_that_a_force_stretches() -> None:
    """N = F; a shell that does not bend shows its membrane forces first."""
    run = strip(force=(30.0, 0.0, 0.0))
    found = run["shell"]
    assert found["membrane_force_1"].values == pytest.approx(np.full((1, 12), 30.0), rel=1e-3)
    assert found["principal_membrane_force"].values == pytest.approx(np.full((1, 12), 30.0), rel=1e-3)
    motion = motion_of(run)
    assert motion is not None
    (surface,) = motion.surfaces
    assert next(iter(surface.values)) == "principal membrane force [N m-1]"
    assert set(surface.data) >= {"moment 1 [N]", "membrane shear [N m-1]", "shear force 2 [N m-1]"}
    assert surface.thickness == pytest.approx(THICKNESS)
    assert surface.points[-1] == pytest.approx(found["position"].values[-1])
    corners = surface.points[0][surface.faces]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert np.linalg.norm(normal, axis=1) == pytest.approx(np.full(12, 2.0 * LENGTH * WIDTH / 12.0), rel=1e-3)
    assert (np.sum(normal * surface.normals[0][surface.faces[:, 0]], axis=1) > 0.0).all()
    assert json.loads(found.attrs["plots"]) == ["largest_displacement", "energy_elastic"]


@pytest.mark.slow
def test_a_stiff_plate_swings_as_a_pendulum() -> None:
    """From the horizontal down in K(1/2) sqrt(2 L/3 g); masses at nodes make it longer by 1/(4 n^2) of n elements."""
    run = evolvent.run("plate-swing", {"parts.plate.thickness": "20 mm", "simulate.until": "0.6 s"})
    x = run["plate"]["position"].values[:, -5]
    angle = -np.unwrap(np.arctan2(x[:, 2], x[:, 0]))
    down = float(np.interp(0.5 * np.pi, angle, run["time"].values))
    assert down == pytest.approx(float(ellipk(0.5)) * np.sqrt(2.0 / (3.0 * 9.81)), rel=6e-3)
    defect = np.abs(run["energy_defect"].values).max()
    assert defect < 1e-2 * float(run["energy_kinetic"].values.max())
