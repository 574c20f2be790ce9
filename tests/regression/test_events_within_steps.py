"""Events and latches that a step passes and leaves again: found under every method, at the time of the closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, parts

pytestmark = pytest.mark.slow

#: Methods, with the fixed step of those that need one.
METHODS = {"dopri5": {}, "rk4": {"step": 0.05}, "heun": {"step": 0.05}, "generalized-alpha": {}, "energy-momentum": {}}
G = 9.81


def mover(law: str, constants: dict[str, float] | None = None, **keys: object) -> System:
    """A point at x = t, whose steps become long, and an event."""
    system = System()
    system.add(parts.Point(mass=1.0, velocity=(1.0, 0.0, 0.0)), "ball")
    variables = {"x": "ball.position.x"}
    system.add(parts.Event(law=law, variables=variables, constants=constants, **keys), "event")
    return system


@pytest.mark.parametrize("method", METHODS)
def test_a_window_within_a_step_stops_the_run(method: str) -> None:
    """The value is above zero for 2 w seconds around 0.437 s; steps are up to 0.8 s long."""
    for w in (0.05, 1e-3, 1e-5):
        system = mover("w - abs(x - 0.437)", {"w": w}, stops=True)
        run = system.simulate(until=1.0, every=0.1, method=method, fine=False, **METHODS[method])
        assert run.attrs["status"] == "stopped by event"
        assert float(run.time[-1]) == pytest.approx(0.437 - w, abs=min(1e-6, 0.5 * w))


@pytest.mark.parametrize("method", METHODS)
def test_a_dip_within_a_step_fires_where_it_ends(method: str) -> None:
    """The value starts above zero, and falls below it for 2e-3 s."""
    system = mover("abs(x - 0.437) - 1e-3")
    run = system.simulate(until=1.0, every=0.1, method=method, fine=False, **METHODS[method])
    assert run.ev.events["time"].values == pytest.approx([0.438], abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("peak", [1.0005, 1.02, 1.3])
def test_a_throw_that_just_reaches_a_height(method: str, peak: float) -> None:
    """A ball thrown up to `peak` m passes 1 m at (v - sqrt(v^2 - 2 g))/g; one that stays below does not end the run."""
    keys = METHODS[method]
    for height in (peak, 2.0 - peak):
        v = math.sqrt(2.0 * G * height)
        system = System(gravity=(0.0, 0.0, -G))
        system.add(parts.Point(mass=1.0, velocity=(1.0, 0.0, v)), "ball")
        system.add(parts.Event(law="z - 1", variables={"z": "ball.position.z"}, stops=True), "event")
        run = system.simulate(until=2.0, every=0.1, method=method, fine=False, **keys)
        reached = height > 1.0
        time = (v - math.sqrt(v * v - 2.0 * G)) / G if reached else 2.0
        tolerance = 5e-3 if method == "heun" else 1e-5
        assert float(run.time[-1]) == pytest.approx(time, abs=tolerance), height


def test_every_rise_of_an_event_fires_under_dopri5() -> None:
    """A value of time with five periods in the run, which the motion takes in ten steps."""
    run = mover("sin(31.4 * t) - 0.9 + 0 * x").simulate(until=1.0, every=0.1, method="dopri5", fine=False)
    times = (math.asin(0.9) + 2.0 * math.pi * np.arange(5)) / 31.4
    assert run.ev.events["time"].values == pytest.approx(times, abs=1e-9)


TORQUE, INERTIA, LATCH = 0.4, 0.5, 1.0


def turned(beyond: float, *, joint: bool = False, **spring: object) -> tuple[System, float]:
    """A hub that turns to `beyond` times 1 rad and back under a constant torque; and the rate at the start."""
    system, rate = System(), math.sqrt(2.0 * TORQUE / INERTIA * LATCH * beyond)
    if joint:
        inertia = (INERTIA,) * 3
        system.add(parts.RigidBody(mass=1.0, inertia=inertia, angular_velocity=(0.0, 0.0, rate)), "hub")
        system.add(parts.Joint(a="ground", b="hub", type="revolute", position=(0.0, 0.0, 0.0)), "pin")
        system.add(parts.JointSpring(joint="pin", **spring), "spring")
    else:
        system.add(parts.RigidBody(motion="spin", inertia=INERTIA, rate=rate), "hub")
        system.add(parts.JointSpring(a="ground", b="hub", start=0.0, **spring), "spring")
    system.add(parts.Load(at="hub", torque=(0.0, 0.0, -TORQUE)), "torque")
    return system, rate


@pytest.mark.parametrize("beyond", [1.0005, 1.05])
def test_a_latch_within_a_step_under_dopri5(beyond: float) -> None:
    """It locks at the closed form's time, and the energy balance closes."""
    system, rate = turned(beyond, latch=LATCH, latch_stiffness=20.0, latch_damping=1.0)
    run = system.simulate(until=4.0, every=0.1, fine=False)
    time = (rate - math.sqrt(rate * rate - 2.0 * TORQUE / INERTIA * LATCH)) * INERTIA / TORQUE
    assert run.attrs["method"] == "dopri5"
    assert run["spring"].latch_time.values.ravel()[-1] == pytest.approx(time, abs=1e-6)
    assert float(run["spring"].angle.values[-1]) == pytest.approx(LATCH - TORQUE / 20.0, abs=0.01)


def test_a_latch_that_is_not_reached_stays_open() -> None:
    """The hub turns back, several radians in a step: its turns are counted right."""
    system, rate = turned(0.99, latch=LATCH, latch_stiffness=20.0, latch_damping=1.0)
    run = system.simulate(until=6.0, every=0.1, fine=False)
    t = run.time.values
    assert np.isnan(run["spring"].latch_time.values).all()
    assert run["spring"].angle.values.ravel() == pytest.approx(rate * t - 0.5 * TORQUE / INERTIA * t * t, abs=1e-6)


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_latches_and_stops_within_an_implicit_step(method: str) -> None:
    """Steps of 0.2 s around the turn, in which the hub is beyond the latch, or the stop, for as long."""
    system, rate = turned(1.008, joint=True, latch=LATCH, latch_stiffness=20.0, latch_damping=1.0)
    run = system.simulate(until=2.2, every=0.1, method=method, step=0.2, fine=False)
    time = (rate - math.sqrt(rate * rate - 2.0 * TORQUE / INERTIA * LATCH)) * INERTIA / TORQUE
    assert run["spring"].latch_time.values.ravel()[-1] == pytest.approx(time, abs=0.06)
    system, rate = turned(1.008, joint=True, high=LATCH, stop=2e4)
    step = 0.2 if method == "energy-momentum" else 2e-3  # longer ones do not resolve the stop, which is said
    run = system.simulate(until=2.2, every=0.1, method=method, step=step, fine=False)
    assert float(run["spring"].angle.values.max()) < LATCH + 0.004  # 1.008 without the stop
