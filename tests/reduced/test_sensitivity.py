"""Sensitivities of runs with a reduced body: against its closed form, and against central differences."""

from __future__ import annotations

import math
import pathlib

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements.reduced_files import write_model
from families.reduced import OTHERS, STIFFNESS, two_nodes
from structures.test_sensitivity import BOTH, differences

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = pathlib.Path(tmp_path_factory.mktemp("reduced")) / "two-nodes.npz"
    write_model(str(path), two_nodes(np.array([STIFFNESS, *5 * (OTHERS,)]), np.ones(6)))
    return str(path)


@BOTH
def test_those_of_a_node_that_falls_on_its_spring_are_its_closed_form(file: str, method: str) -> None:
    """u = g m/k (1 - cos(w t)), w^2 = k/m: by gravity u/g, to the second order of the step."""
    w, t, fall, errors = math.sqrt(STIFFNESS), 0.7, 0.5, []
    for step in (0.004, 0.002):
        system = System(gravity=(fall, 0.0, 0.0))
        system.add(parts.ReducedBody(file=file), "arm")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="arm.root", type="clamp"), "root")
        found = system.sensitivity(
            "arm[1].interface_position.x.last", "gravity.0", until=t, step=step, method=method, spectral_radius=1.0
        ).dataset
        errors.append(abs(found.derivative.item() - (1.0 - math.cos(w * t)) / w**2))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 1e-4


@BOTH
def test_those_of_a_panel_on_a_hinge_are_central_differences(file: str, method: str) -> None:
    """A body that bends and turns far, with modal damping, against a spring."""
    system = System(gravity=(0.3, -2.0, 0.1))
    system.add(parts.ReducedBody(file=file, damping_ratio=0.02), "panel")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="panel.root", type="revolute", axis=(0.0, 0.0, 1.0)), "hinge")
    system.add(parts.JointSpring(joint="hinge", stiffness=4.0, rest=0.3, damping=0.2), "spring")
    settings = {"until": 1.2, "step": 0.01, "method": method, "spectral_radius": 0.9}
    for name in ("spring.angle.last", "energy_kinetic.last"):
        for key, at in (("spring.stiffness", 4.0), ("panel.damping_ratio", 0.02), ("gravity.1", -2.0)):
            found = system.sensitivity(name, key, **settings).dataset
            compared = differences(system, name, key, at, **settings)
            assert found.derivative.item() == pytest.approx(compared, rel=1e-6, abs=1e-9), (name, key)
