"""Guards of the energy count beside what a run handles, not beside what has moved so far."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, elements, parts

G, MASS, STIFFNESS = 9.81, 5.0, 2e4


@pytest.mark.parametrize("method", ["dopri5", "rk4", "generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("law", ["k*x", "k*x + 200*v"])
def test_a_mass_rests_on_a_spring_by_a_law(law: str, method: str) -> None:
    """What moves is the round-off of its place, 1e-16 of 4 m, times the weight."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=MASS, position=(0.0, 0.0, -4.0 - MASS * G / STIFFNESS)), "load")
    spring = parts.Spring(a=(0.0, 0.0, 0.0), b="load", length=4.0, law=law, constants={"k": STIFFNESS})
    system.add(spring, "cable")
    run = system.simulate(until=2.0, method=method)
    assert run.attrs["status"] == "success"
    np.testing.assert_allclose(run["load"].position.values[-1, 2], -4.0 - MASS * G / STIFFNESS, atol=1e-9)


def test_forces_of_laws_alone_rest() -> None:
    """Two laws that pull against each other, without weight."""
    system = System()
    system.add(parts.Point(mass=MASS, position=(3.0, 0.0, 0.0)), "load")
    for name, at in (("left", 0.0), ("right", 6.1)):
        pulled = parts.Spring(a=(at, 0.0, 0.0), b="load", length=1.0, law="300*tanh(x - 2)")
        system.add(pulled, name)
    system.add(parts.Load(at="load", law=["-300*tanh(0.1)", "0", "0"]), "push")
    assert system.simulate(until=2.0).attrs["status"] == "success"


@pytest.mark.slow
def test_a_boom_pays_out_from_rest() -> None:
    """Its drive starts smoothly: what moves in the first steps is 1e-13 J of 2.8e-5 J."""
    system = System()
    drive = {"ramp": {"angle": 0.1, "steps": [(0.0, 2.0, 0.05)]}}
    boom = parts.Rod(
        length=3, section=elements.Tube(radius=8e-3, thickness=1e-4), material="beryllium-copper", elements=8,
        normal=(0, 0, 1), payout=drive, stiffness_damping="2 ms",
    )  # fmt: skip
    system.add(boom, "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "exit")
    run = system.simulate(until=10.0)
    assert run["boom"].tip_position.values[-1, 0] == pytest.approx(0.55, abs=1e-9)


@pytest.mark.slow
def test_a_pay_out_stops_at_a_node_and_goes_on() -> None:
    """Segments of 1 m: 2 m are out at 4 s, where the drive stands until 6 s; the node leaves then."""
    radius, rate = 0.05, 0.5
    steps = [(0.0, 1.0, rate / radius), (3.0, 1.0, 0.0), (6.0, 1.0, rate / radius)]
    system = System()
    system.add(parts.RigidBody(mass=300, inertia=(90, 100, 120), angular_velocity=(0, 0, 2)), "craft")
    reel = parts.Reel(
        body="craft", radius=radius, centre=(0.6, 0, 0), payout_axis=(1, 0, 0), spool_axis=(0, 0, 1),
        drive={"ramp": {"angle": 0.5 / radius, "steps": steps}},
    )  # fmt: skip
    system.add(reel, "reel")
    wire = parts.Thread(
        reel="reel", length=4, line_density="3.4 g/m", nodes=4, tip_mass="90 g", segments="inextensible",
        wound_mass="carried",
    )  # fmt: skip
    system.add(wire, "wire")
    run = system.simulate(until=10.0, every=0.5, method="dopri5")
    out, t = run["wire"].deployed_length.values, run.time.values
    np.testing.assert_allclose(out[(t >= 4.0) & (t <= 6.0)], 2.0, atol=1e-9)
    assert out[-1] == pytest.approx(3.75, abs=1e-9)
    assert math.isfinite(run.energy_defect.values[-1])
    assert np.abs(run.energy_defect.values).max() < 1e-3 * run.energy_moved.values[-1]
