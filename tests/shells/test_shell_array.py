"""The built-in case `flexible-array-shell`: folds that open and latch, and what is conserved."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent

FOLDS = {"root": -90.0, "fold 1": -177.707, "fold 2": 175.415}  # deg, latches


@pytest.mark.slow
def test_array_of_shells_deploys() -> None:
    """Held for 0.5 s, then all folds open and latch at all nodes; momenta stay zero and the balance is closed."""
    run = evolvent.run("flexible-array-shell", {"simulate.until": 6.0})
    time, moved = run["time"].values, float(run["energy_moved"].values.max())
    assert moved > 2.5  # of 2.72 J in the folds
    assert np.abs(run["energy_defect"].values).max() < 1e-8 * moved
    for name, latch in FOLDS.items():
        found = [run[f"{name} spring {k}"] for k in range(4)]
        angle = np.degrees([one["angle"].values for one in found])
        assert np.abs(angle[:, time < 0.5]).max() < 0.2
        assert np.abs(angle[:, -1] - latch).max() < 1.5
        locked = [float(one["latch_time"].values[-1]) for one in found]
        assert np.ptp(locked) < 2e-3  # a flexible edge locks node by node
    tip = run["panel 3"]["position"].values[-1, -1]
    assert tip[0] == pytest.approx(2.95, abs=0.1)
    assert np.abs(run["momentum"].values).max() < 1e-9
    angular = np.abs(run["angular_momentum"].values).max(axis=1)
    assert angular[time < 2.6].max() < 1e-9  # until the first latch samples are ends of steps
    assert angular.max() < 1e-3 * np.abs(run["panel 3"]["angular_momentum"].values).max()
