"""Shells in free flight: energy-momentum keeps both momenta and the energy."""

from __future__ import annotations

import numpy as np

from evolvent import System, parts
from shells.plates import material


def test_free_flight() -> None:
    """A sheet is pushed at two corners, bends and tumbles, without the filter of steps."""
    system = System()
    system.add(
        parts.Shell(
            size=(1.0, 0.5), elements=(6, 3), thickness=0.01, material=material(1e7, 0.3), velocity=(0.1, 0.2, 0.3)
        ),
        "shell",
    )
    system.add(parts.Load(at="shell[0]", force=(0.0, 0.0, 5.0), until=0.125), "push")
    system.add(parts.Load(at="shell[27]", torque=(0.05, 0.1, 0.0), until=0.125), "turn")
    run = system.simulate(until=2.0, every=0.125, method="energy-momentum", step=2.0**-7, spectral_radius=1.0)
    assert run.attrs["status"] == "success", run.attrs["message"]
    found = run["shell"]
    free = run["time"].values > 0.15
    energy = run["energy"].values[free]
    assert found["energy_elastic"].values[free].max() > 0.2 * energy[0]
    assert np.ptp(energy) < 1e-11 * energy[0]
    assert np.abs(run["energy_defect"].values).max() < 1e-11 * energy[0]
    for name in ("momentum", "angular_momentum"):
        values = found[name].values[free]
        assert np.abs(values - values[0]).max() < 1e-12 * np.abs(values[0]).max()
