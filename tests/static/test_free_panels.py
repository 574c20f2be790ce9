"""Equilibria and modes of flexible panels on preloaded hinges of a free satellite, against those of rigid panels."""

import math

import numpy as np
import pytest

import evolvent
from evolvent import System, parts

pytestmark = pytest.mark.slow

ALUMINIUM = {"young_modulus": 70e9, "poisson_ratio": 0.3, "density": 2700.0}
#: Stiffness (N m/rad) and rest of the hinge, and the angle at the start.
K, REST, START = 0.5, -0.4, math.pi / 2


def satellite(kind):
    """A free body with a panel of 1 m, folded by a right angle and driven beyond its stretched place."""
    system = System()
    system.add(parts.RigidBody(mass=50.0, inertia=(6.0, 6.0, 8.0), points={"corner": (0.5, 0.0, 0.0)}), "hub")
    place = {"position": (0.5, 0.0, 0.0), "direction": (0.0, 1.0, 0.0)}
    section = {"rectangle": {"thickness": "4 mm", "width": "300 mm"}}
    if kind == "rigid":
        mass = 2700.0 * 0.004 * 0.3
        x, y, z = (mass / 12.0 * (a * a + b * b) for a, b in ((1.0, 0.3), (0.3, 0.004), (1.0, 0.004)))
        root = {"points": {"root": (0, -0.5, 0)}, "position": (0.5, 0.5, 0.0)}
        system.add(parts.RigidBody(mass=mass, inertia=(x, y, z), **root), "panel")
    else:
        made = {"rod": parts.Rod, "beam": parts.Beam}[kind]
        system.add(
            made(length=1.0, section=section, material=ALUMINIUM, elements=6, normal=(1, 0, 0), **place), "panel"
        )
    system.add(parts.Joint(a="hub.corner", b="panel.root", type="revolute", axis=(0, 0, 1)), "pivot")
    system.add(parts.JointSpring(joint="pivot", start=START, stiffness=K, rest=REST), "hinge")
    return system


@pytest.mark.parametrize("kind", ["rod", "beam"])
def test_a_panel_of_a_beam_on_a_preloaded_hinge(kind):
    system, rigid = satellite(kind), satellite("rigid")
    at_rest = system.equilibrium()
    assert float(at_rest["hinge"].angle[-1]) == pytest.approx(REST, abs=1e-9)
    found, wanted = system.modes(count=8), rigid.modes(count=7)
    assert found.frequency[:6] == pytest.approx(np.zeros(6), abs=1e-5)
    assert found.frequency[6] == pytest.approx(float(wanted.frequency[6]), rel=5e-3)
    assert found.frequency[7] > 10.0 * found.frequency[6]


def test_the_array_with_flexible_panels():
    """Its hinges rest where those of the rigid array do, and swing as fast."""
    flexible, rigid = evolvent.load("solar-array-flexible"), evolvent.load("solar-array")
    at_rest = flexible.equilibrium()
    angles = [float(at_rest[f"hinge {k}"].angle[-1]) for k in (1, 2, 3)]
    assert angles == pytest.approx(np.radians([-20.0, 20.0, -20.0]), abs=1e-9)
    found, wanted = flexible.modes(count=10), rigid.modes(count=9)
    for one in (found, wanted):
        assert one.frequency[:6] == pytest.approx(np.zeros(6), abs=1e-6)
        assert one.equilibrium.message.endswith("against 6 motions")
    assert found.frequency[6:9] == pytest.approx(wanted.frequency[6:9], rel=1e-3)
    assert found.frequency_hz[9] > 2.0  # of the panels
