"""Shells in free flight: energy-momentum keeps both momenta and the energy."""

from __future__ import annotations

import numpy as np

from evolvent import System, parts
from shells.plates import material


def tumbling(load: float) -> System:
    """A sheet is pushed at two corners, bends and tumbles."""
    system = System()
    system.add(
        parts.Shell(
            size=(1.0, 0.5), elements=(6, 3), thickness=0.01, material=material(1e7, 0.3), velocity=(0.1, 0.2, 0.3)
        ),
        "shell",
    )
    system.add(parts.Load(at="shell[0]", force=(0.0, 0.0, load), until=0.1), "push")
    system.add(parts.Load(at="shell[27]", torque=(0.01 * load, 0.02 * load, 0.0), until=0.1), "turn")
    return system


def test_energy_in_free_flight() -> None:
    """Without the filter of steps the balance closes to round-off."""
    run = tumbling(5.0).simulate(until=1.0, every=0.1, method="energy-momentum", step=0.01, spectral_radius=1.0)
    assert run.attrs["status"] == "success", run.attrs["message"]
    energy = run["energy"].values[2:]
    assert run["shell"]["energy_elastic"].values[2:].max() > 0.1 * energy[0]
    assert np.ptp(energy) < 1e-11 * energy[0]
    assert np.abs(run["energy_defect"].values).max() < 1e-11 * energy[0]


def test_momenta_in_free_flight() -> None:
    run = tumbling(1.0).simulate(until=2.0, every=0.05, method="energy-momentum", step=0.01)
    assert run.attrs["status"] == "success", run.attrs["message"]
    for name in ("momentum", "angular_momentum"):
        values = run["shell"][name].values[run["time"].values > 0.11]
        assert np.abs(values - values[0]).max() < 1e-12 * np.abs(values[0]).max()
