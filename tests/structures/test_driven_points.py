"""Points of bodies, and nodes of rods and shells, that a drive moves along a line."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import Rectangle, System, parts

DRIVE = {"expression": "0.02*(1 - cos(2*t))**2"}
STEEL = {"young_modulus": "2 GPa", "poisson_ratio": 0.3, "density": "2000 kg/m^3"}
MASS, INERTIA, LEVER = 2.0, 0.1, 0.3


def moved(t: float) -> float:
    return 0.02 * (1 - math.cos(2 * t)) ** 2


@pytest.mark.parametrize("method", ["energy-momentum", "generalized-alpha", "dopri5"])
def test_a_point_of_a_body(method: str) -> None:
    """The body hangs on the point like a pendulum whose pivot is shaken: its energy is the work of the drive."""
    s = System()
    s.add(parts.RigidBody(mass=MASS, inertia=(INERTIA,) * 3, points={"pin": (-LEVER, 0, 0)}), "box")
    s.add(parts.Joint(a="ground", b="box.pin", type="point-on-line", axis=(0, 1, 0), drive=DRIVE), "shaker")
    run = s.simulate(until=1.0, method=method, step=None if method == "dopri5" else 0.005)
    at, t = run["shaker"].position.values, run.time.values
    assert at[:, 1] == pytest.approx([moved(one) for one in t], abs=1e-6)
    assert np.abs(at[:, [0, 2]] - [-LEVER, 0.0]).max() < 1e-6
    energy = float(run.energy[-1] - run.energy[0])
    assert energy == pytest.approx(float(run.work_drives[-1]), rel=1e-4)

    def pendulum(t: float, w: np.ndarray) -> list[float]:
        pivot = 0.16 * (math.sin(2 * t) ** 2 + math.cos(2 * t) * (1 - math.cos(2 * t)))
        return [w[1], -MASS * LEVER * math.cos(w[0]) * pivot / (INERTIA + MASS * LEVER**2)]

    beside = solve_ivp(pendulum, (0.0, 1.0), [0.0, 0.0], rtol=1e-9, atol=1e-12).y[1, -1]
    assert float(run["box"].rate.sel(axis="z")[-1]) == pytest.approx(beside, rel=1e-3)


@pytest.mark.parametrize("at", ["rod.root", "rod[1]"])
def test_a_node_of_a_rod(at: str) -> None:
    s = System()
    s.add(parts.Rod(length=0.5, section=Rectangle(thickness=0.005, width=0.02), material=STEEL, elements=2), "rod")
    s.add(parts.Joint(a="ground", b=at, type="point-on-line", axis=(0, 0, 1), drive=DRIVE), "shaker")
    run = s.simulate(until=0.5, method="energy-momentum", step=0.002)
    assert run["shaker"].position.values[-1, 2] == pytest.approx(moved(0.5), abs=1e-6)
    energy = float(run.energy[-1] - run.energy[0])
    assert energy > 0.0
    assert energy == pytest.approx(float(run.work_drives[-1]), rel=1e-5)


def test_a_node_of_a_shell() -> None:
    s = System()
    s.add(parts.Shell(size=(0.2, 0.1), elements=(2, 1), thickness=1e-3, material=STEEL), "sheet")
    s.add(parts.Joint(a="ground", b="sheet[0]", type="point-on-line", axis=(0, 0, 1), drive=DRIVE), "shaker")
    run = s.simulate(until=0.2, method="energy-momentum", step=0.005)
    assert run["shaker"].position.values[-1, 2] == pytest.approx(moved(0.2), abs=1e-6)
    assert float(run.energy[-1] - run.energy[0]) == pytest.approx(float(run.work_drives[-1]), rel=1e-4)
