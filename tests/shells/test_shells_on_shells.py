"""Contact of shells with shells and with themselves: nodes of each on smooth faces of the other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from shells.plates import material

METHODS = ("generalized-alpha", "energy-momentum")
G = 9.81
#: N, of `panel`.
WEIGHT = 0.4 * 0.3 * 0.01 * 1000.0 * G


def panel(**keys: Any) -> parts.Shell:
    """A panel of 10 mm."""
    given = {"size": (0.4, 0.3), "elements": (4, 3), "thickness": 0.01, "material": material(1e7, 0.3)}
    return parts.Shell(**(given | keys))


def collide(**law: Any) -> Any:
    """Two free panels that meet aslant, by steps of 1 ms that conserve energy."""
    system = System()
    system.add(panel(), "low")
    flight = {"velocity": (0.3, 0.1, -1.0), "angular_velocity": (0.5, 1.0, 0.3)}
    system.add(panel(position=(0.07, 0.05, 0.02), **flight), "high")
    system.add(parts.Contact(a="high", b="low", stiffness=2e4, law="conservative", **law), "hit")
    run = system.simulate(until=0.05, every=2e-3, method="energy-momentum", step=1e-3, spectral_radius=1.0)
    assert run.attrs["status"] == "success"
    assert float(run["hit"].normal_force.max()) > 10.0
    assert float(run["hit"].normal_force.values[-1]) == 0.0
    for name in ("momentum", "angular_momentum"):
        whole = run["low"][name].values + run["high"][name].values
        assert np.abs(whole - whole[0]).max() < 1e-12 * np.linalg.norm(whole[0])
    return run


def test_panels_that_collide_keep_momenta_and_energy() -> None:
    """On faces that pass over to others, with the law conservative."""
    run = collide()
    assert float(np.abs(run.energy_defect).max()) < 1e-12 * float(run.energy.max())
    assert float(np.abs(run.energy - run.energy[0]).max()) < 1e-12 * float(run.energy[0])


def test_friction_takes_energy_and_no_momentum() -> None:
    run = collide(friction=0.3, bristle_stiffness=1e4)
    assert float(np.abs(run["hit"].point_friction).max()) > 0.1
    assert float(np.abs(run.energy_defect).max()) < 1e-12 * float(run.energy.max())
    assert float(run.energy[-1]) < 0.99 * float(run.energy[0])
