"""Coulomb friction in the root's hinge of a rib: how it slows a rib, how it sticks, and its account of energy."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent
from evolvent import results
from rib.reading import balance

#: A short stiff rib, which swings about its root as a rigid body: mass 0.24 kg, m L^2/3 = 0.08 kg m^2.
STIFF = {
    "rib.length": 1, "rib.elements": 2, "rib.thickness": "2 cm", "rib.density": 400, "rib.young_modulus": "200 GPa",
    "damping.alpha": 0, "output.every": 0.02, "solver.tolerance": 1e-5,
}  # fmt: skip
INERTIA = 400 * 0.03 * 0.02 / 3.0
METHODS = ["energy-momentum", "generalized-alpha"]


@pytest.fixture(scope="module")
def swinging(tmp_path_factory):
    """Path of a run that sets the rib swinging."""
    run = evolvent.run("wrapped-rib", STIFF | {"drive.torque": 0.02, "rib.start_angle": -0.6, "solver.duration": 1.5})
    path = str(tmp_path_factory.mktemp("runs") / "swinging.nc")
    results.save(run, path)
    return path


@pytest.mark.parametrize("method", METHODS)
def test_friction_slows_a_rib_at_its_torque_over_the_inertia_until_it_sticks(book, swinging, method):
    changes = {
        "start": swinging,
        "rib.root_friction": 0.02,
        "solver.duration": 1.2,
        "solver.method": method,
        "solver.tolerance": 1e-5,
    }
    run = evolvent.run("wrapped-rib-deploy", STIFF | changes)
    t, hinge = run["time"].values, run["hinge-1"]
    rate = hinge["rate"].values
    slope = 0.02 / INERTIA
    stops = rate[0] / slope
    assert 0.5 < stops < 1.5
    slipping, rests = (t > 0.02) & (t < stops - 0.05), t > stops + 0.15
    fit = -np.polyfit(t[slipping], rate[slipping], 1)[0]
    assert fit == pytest.approx(slope, rel=5e-3)
    assert np.abs(rate[rests]).max() < 0.02 * rate[0]
    assert np.ptp(hinge["angle"].values[rests]) < 1e-3
    turned = 0.5 * rate[0] ** 2 / slope
    assert hinge["angle"].values[-1] - hinge["angle"].values[0] == pytest.approx(turned, rel=0.01)
    lost = run["energy_losses"].sel(cause="friction").values
    assert lost[-1] == pytest.approx(0.02 * turned, rel=0.01)
    assert hinge["friction_work"].values[-1] == pytest.approx(lost[-1], rel=1e-9)
    assert np.abs(balance(run)).max() < 0.01
    book(
        "Wrapped rib", f"Root friction, {method}: deceleration of a stiff rib", reference="friction/(m L^2/3)",
        source="closed form", error=abs(fit / slope - 1.0), allowed=5e-3,
    )  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("friction", [0.015, 0.005])
def test_a_rib_sticks_below_the_friction_and_slips_above(method, friction):
    """A torque about the hub's axis on a rib straight outwards: its moment about the root is known."""
    R, L = 0.6, 1.0
    moment = 0.02 * (L**3 / 3.0 + R * L**2 / 2.0) / (((R + L) ** 3 - R**3) / 3.0)
    sticks = moment < friction
    drive = {"drive.torque": 0.02, "drive.ramp": 0.4 if sticks else 0.0}
    changes = drive | {"rib.root_friction": friction, "solver.duration": 0.5, "solver.method": method}
    run = evolvent.run("wrapped-rib", STIFF | changes)
    hinge, t = run["hinge-1"], run["time"].values
    if sticks:  # it slips after 1e-4 rad
        angle = hinge["angle"].values - hinge["angle"].values[0]
        assert angle[-1] == pytest.approx(1e-4 * moment / friction, rel=0.1)
        assert hinge["friction_torque"].values[-1] == pytest.approx(moment, rel=0.1)
        assert np.abs(angle).max() < 1e-4
        assert run["energy_losses"].sel(cause="friction").values[-1] < 0.3 * run["work_loads"].values[-1]
    else:
        slope = np.polyfit(t[t > 0.1], hinge["rate"].values[t > 0.1], 1)[0]
        assert slope == pytest.approx((moment - friction) / INERTIA, rel=0.01)
        assert np.abs(balance(run)).max() < 0.01
