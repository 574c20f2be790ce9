"""Reaction wheels, thrusters and attitude controllers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import yaml

from attitude.building import J, bus
from book import Book
from evolvent import InputError, System, parts
from evolvent.parts.registry import read_parts
from helpers import run


def turned(angle: float, axis: int = 2) -> tuple[float, ...]:
    q = [math.cos(0.5 * angle), 0.0, 0.0, 0.0]
    q[1 + axis] = math.sin(0.5 * angle)
    return tuple(q)


@pytest.mark.parametrize("method", ["dopri5", "rk4", "heun"])
def test_angular_momentum_of_body_and_wheels(method: str, book: Book) -> None:
    """Kept while a controller slews the body and wheels rub; the energy balances."""
    control = {"proportional": 2.0, "derivative": 2.0, "path": parts.RampDrive(steps=[(0.0, 1.0, 0.5)])}
    system = bus({"viscous_damping": 1e-3, "friction_torque": 1e-3}, control, angular_velocity=(0.1, 0.3, 0.2))
    options = {"rtol": 1e-9, "atol": 1e-11} if method == "dopri5" else {"step": 2e-3}
    found = run(system.assemble(), np.linspace(0.0, 4.0, 9), method, **options)
    H, allowed = found.momentum, 1e-8 if method != "heun" else 1e-5
    error = np.abs(H - H[0]).max() / np.linalg.norm(H[0])
    assert error < allowed
    assert np.abs(found.energy_defect).max() < allowed * found.energy[0]
    book(
        "Rigid bodies", f"Body with four wheels under a controller ({method}): angular momentum",
        reference="conserved", source="invariant", error=error, allowed=allowed,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("P", "D"), [(2.0, 1.0), (2.0, 8.0)])
def test_slew_by_a_controller(P: float, D: float, book: Book) -> None:
    """About one axis the error is a damped oscillator: J e'' + D e' + P e = 0, over a large angle too."""
    start = 2.0
    system = bus({"rate": 0.0}, {"proportional": P, "derivative": D, "target": (1, 0, 0, 0)}, orientation=turned(start))
    found = system.simulate(until=15.0, every=0.5, method="dopri5", tolerance=1e-10)
    t = found.time.values
    own = J[2] - 4 * 0.05 * 0.5  # what the torque turns: without the wheels about their axes
    roots = np.roots([own, D, P]).astype(complex)
    exact = (start * (roots[1] * np.exp(roots[0] * t) - roots[0] * np.exp(roots[1] * t)) / (roots[1] - roots[0])).real
    error = np.abs(found["control"].error.values[:, 2] - exact).max() / start
    assert error < 1e-7
    assert np.abs(found["control"].error.values[:, :2]).max() < 1e-9
    # every wheel takes its share: 4 J_w W / sqrt(2) = h
    h = J[2] * found["bus"].rate.values[:, 2]
    assert found["w0"].wheel_momentum.values == pytest.approx(-h / (4.0 / math.sqrt(2.0)), abs=1e-7)
    damping = D / (2.0 * math.sqrt(P * own))
    book(
        "Rigid bodies", f"Slew by 2 rad under a PD controller (damping ratio {damping:.2g})",
        reference="J e'' + D e' + P e = 0", source="closed form", error=error, allowed=1e-7,
    )  # fmt: skip


def test_a_slew_that_follows_a_path() -> None:
    """The controller lags its path by J a / P while that accelerates, and stands on it at last."""
    control = {
        "proportional": 40.0, "derivative": 25.0, "axis": (1.0, 2.0, 3.0),
        "path": parts.RampDrive(steps=[(0.0, 2.0, 0.2), (6.0, 2.0, 0.0)]),
    }  # fmt: skip
    found = bus({"rate": 0.0}, control).simulate(until=20.0, every=0.5, method="dopri5")
    assert float(found["control"].error_angle[-1]) < 1e-4
    axis = np.array((1.0, 2.0, 3.0)) / math.sqrt(14.0)
    assert found["bus"].attitude.values[-1] == pytest.approx([math.cos(0.6), *(math.sin(0.6) * axis)], abs=1e-4)


def test_free_gyrostat(book: Book) -> None:
    """A symmetric body with a spinning wheel: its rates across the axis turn at ((C - A) w3 + h)/A."""
    A, C, h, w3 = 2.0, 3.0, 0.05 * 40.0, 0.3
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(A, A, C), angular_velocity=(0.2, 0.0, w3)), "bus")
    system.add(parts.ReactionWheel(body="bus", inertia=0.05, rate=40.0), "wheel")
    found = run(system.assemble(), np.linspace(0.0, 10.0, 21), rtol=1e-11, atol=1e-13)
    first = int(found.assembly.model.bodies["iv"][1]) + 3
    turn = ((C - A) * w3 + h) / A * found.t
    exact = 0.2 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    error = np.abs(found.y[:, first : first + 2] - exact).max() / 0.2
    assert error < 1e-8
    book(
        "Rigid bodies", "Free gyrostat: rates across its axis", reference="((C - A) w3 + h)/A", source="closed form",
        error=error, allowed=1e-8,
    )  # fmt: skip


def test_viscous_friction_takes_the_wheel_along() -> None:
    """W = W0 exp(-c (1/I + 1/(J - I)) t), relative to the body."""
    c, inertia, C = 0.01, 0.05, 0.4
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=C, axis=(0.0, 0.0, 1.0)), "bus")
    system.add(parts.ReactionWheel(body="bus", inertia=inertia, rate=40.0, viscous_damping=c), "wheel")
    found = system.simulate(until=5.0, every=0.5, method="dopri5", tolerance=1e-10)
    exact = 40.0 * np.exp(-c * (1.0 / inertia + 1.0 / (C - inertia)) * found.time.values)
    assert found["wheel"].rate.values == pytest.approx(exact, rel=1e-7)
    assert found["wheel"].friction_torque.values == pytest.approx(-c * exact, rel=1e-7)


def test_limits_hold() -> None:
    """Torque and rate of a wheel; torque of a controller."""
    wheel = {"rate": 0.0, "torque_limit": 0.1, "rate_limit": 4.0}
    control = {"proportional": 5.0, "derivative": 5.0, "target": turned(1.0)}
    found = bus(wheel, control).simulate(until=20.0, every=0.1, method="dopri5")
    for k in range(4):
        assert np.abs(found[f"w{k}"].torque.values).max() <= 0.1
        assert 3.9 < np.abs(found[f"w{k}"].rate.values).max() < 4.0 + 1e-6
    found = bus(control=control | {"limit": 0.3, "dead_band": 0.1}).simulate(until=3.0, every=0.1, method="dopri5")
    torque = found["control"].torque.values
    assert np.abs(torque).max() == pytest.approx(0.3)
    asked = -5.0 * (found["control"].error.values + found["control"].rate_error.values)
    np.testing.assert_allclose(np.abs(torque), np.clip(np.abs(asked) - 0.1, 0.0, 0.3), atol=1e-12)


def test_motor_by_a_profile_and_a_law() -> None:
    """A pulse on the wheel turns the body back by the same impulse; a law brakes it."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "bus")
    pulse = {"pulse": {"value": 0.1, "start": 1.0, "duration": 2.0}}
    system.add(parts.ReactionWheel(body="bus", inertia=0.1, profile=pulse), "wheel")
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(3.0, 0.0, 0.0)), "other")
    law = {"law": "-k*v", "constants": {"k": 0.2}}
    system.add(parts.ReactionWheel(body="other", inertia=0.1, rate=5.0, **law), "second")
    found = system.simulate(until=4.0, every=0.5, method="dopri5", tolerance=1e-10)
    assert float(found["bus"].rate[-1, 2]) == pytest.approx(-0.2 / 0.9, rel=1e-8)
    exact = 5.0 * np.exp(-0.2 * (1.0 / 0.1 + 1.0 / 0.9) * found.time.values)
    assert found["second"].rate.values == pytest.approx(exact, rel=1e-6)


def thrusters() -> tuple[System, list[str]]:
    """Twelve thrusters in pairs of couples about all axes."""
    system = System()
    system.add(parts.RigidBody(mass=10.0, inertia=tuple(J), orientation=turned(0.5, 0)), "bus")
    names = []
    for i in range(3):
        for side in (1.0, -1.0):
            for sense in (1.0, -1.0):
                place, direction = side * np.eye(3)[i], sense * np.eye(3)[(i + 1) % 3]
                thruster = parts.Thruster(at=("bus", tuple(place)), direction=tuple(direction), thrust=2.0)
                names.append(system.add(thruster, f"t{len(names)}"))
    return system, names


def test_thrusters_under_a_controller() -> None:
    """They make pure couples: the body does not drift, and turns as a damped oscillator."""
    system, names = thrusters()
    control = {"proportional": 2.0, "derivative": 4.0, "target": (1, 0, 0, 0)}
    system.add(parts.AttitudeController(body="bus", actuators=names, **control), "control")
    found = system.simulate(until=6.0, every=0.25, method="dopri5", tolerance=1e-10)
    t = found.time.values
    exact = 0.5 * (1.0 + t) * np.exp(-t)  # critically damped, P = D^2/(4 J)
    assert found["control"].error.values[:, 0] == pytest.approx(exact, abs=1e-7)
    assert np.abs(found["bus"].position.values).max() < 1e-12
    pushes = np.array([found[name].thrust.values for name in names])
    assert pushes.min() >= 0.0
    assert pushes.max() <= 2.0
    assert sum(float(found[name].impulse[-1]) for name in names) > 0.0


def test_a_thruster_by_a_profile() -> None:
    """Its impulse and what it does to the body; the force stops at `thrust`."""
    system = System()
    system.add(parts.RigidBody(mass=4.0, inertia=1.0, points={"nozzle": (-1.0, 0.0, 0.0)}), "bus")
    burn = {"table": [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]}
    system.add(parts.Thruster(at="bus.nozzle", direction=(1.0, 0.0, 0.0), thrust=1.0, profile=burn), "engine")
    found = system.simulate(until=2.0, every=0.25, method="dopri5", tolerance=1e-10)
    assert float(found["engine"].thrust.max()) == 1.0
    assert float(found["engine"].impulse[-1]) == pytest.approx(1.5, rel=1e-6)
    assert float(found["bus"].velocity[-1, 0]) == pytest.approx(1.5 / 4.0, rel=1e-6)


FILE = """
bus: {kind: rigid-body, mass: 10 kg, inertia: [2, 3, 4 kg m^2], points: {nozzle: [1, 0, 0 m]}}
wheel: {kind: reaction-wheel, body: bus, axis: [0, 0, 1], inertia: 0.05 kg m^2, rate: 100 rpm, torque_limit: 50 mN m,
        rate_limit: 6000 rpm, viscous_damping: 1e-5 N m s/rad, radius: 10 cm}
engine: {kind: thruster, at: bus.nozzle, direction: [0, 1, 0], thrust: 1 N,
         profile: {pulse: {value: 0.1 N, duration: 1 s}}}
control: {kind: attitude-controller, body: bus, actuators: [wheel], proportional: [0, 0, 0.4 N m/rad],
          derivative: [0, 0, 3 N m s/rad], path: {ramp: {steps: [[0 s, 2 s, 1 deg/s]]}}, limit: 1 N m}
"""


def test_a_file() -> None:
    found = read_parts(yaml.safe_load(FILE))
    again = read_parts(yaml.safe_load(yaml.safe_dump({name: part.as_keys() for name, part in found.items()})))
    assert again == found
    system = System()
    for name, part in found.items():
        system.add(part, name)
    ran = system.simulate(until=1.0, every=0.5)
    assert float(ran["engine"].impulse[-1]) == pytest.approx(0.1, rel=1e-6)
    assert float(ran["wheel"].rate[0]) == pytest.approx(100.0 * 2.0 * math.pi / 60.0)


def wheel(**keys: Any) -> parts.ReactionWheel:
    return parts.ReactionWheel(**{"body": "bus", "inertia": 0.05} | keys)


def controlled(actuators: Any, **keys: Any) -> parts.AttitudeController:
    return parts.AttitudeController(
        **{"body": "bus", "actuators": actuators, "proportional": 1.0, "derivative": 1.0} | keys
    )


BUS = parts.RigidBody(mass=1.0, inertia=1.0)
BAD: dict[str, tuple[Any, str]] = {
    "wheel on ground": (
        lambda: [wheel(body="ground")],
        "reactionwheel-1.body is 'ground', the ground; it must be a free",
    ),
    "wheel on a driven body": (
        lambda: [(parts.RigidBody(motion="driven"), "bus"), wheel()],
        "reactionwheel-1.body is 'bus', a driven body",
    ),
    "wheel too heavy": (lambda: [(BUS, "bus"), wheel(inertia=1.0)], "it must be below 1 kg m2"),
    "wheel too fast": (lambda: [(BUS, "bus"), wheel(rate=3.0, rate_limit=2.0)], "rate is 3.0 rad/s"),
    "thruster on ground": (
        lambda: [parts.Thruster(at="ground", direction=(1, 0, 0), thrust=1.0)],
        "thruster-1.at is 'ground', on the ground, which no load moves; give a point on a free or spinning body",
    ),
    "thruster that pulls": (
        lambda: [(BUS, "bus"), parts.Thruster(at="bus", direction=(1, 0, 0), thrust=-1.0)],
        "thruster-1.thrust is -1.0 N; it must be above 0 N",
    ),
    "no actuator": (lambda: [(BUS, "bus"), controlled(["wheel"])], "wheel"),
    "not an actuator": (lambda: [(BUS, "bus"), controlled(["bus"])], "'bus' is not a reaction wheel or thruster"),
    "an axis without a wheel": (
        lambda: [(BUS, "bus"), (wheel(), "wheel"), controlled(["wheel"])],
        "these wheels cannot produce a torque about x alone",
    ),
    "a wheel of another body": (
        lambda: [(BUS, "bus"), (BUS, "other"), (wheel(body="other"), "wheel"), controlled(["wheel"])],
        "'wheel' is not on 'bus'",
    ),
    "two gains": (
        lambda: [(BUS, "bus"), (wheel(), "wheel"), controlled(["wheel"], proportional=(1.0, 2.0))],
        "proportional has 2 values",
    ),
    "no gain": (
        lambda: [(BUS, "bus"), (wheel(), "wheel"), controlled(["wheel"], proportional=0.0, derivative=0.0)],
        "0 about every axis",
    ),
}


def composed(make: Any) -> None:
    """Add what `make` returns to a system, and assemble it."""
    system = System()
    for entry in make():
        part, name = entry if isinstance(entry, tuple) else (entry, None)
        system.add(part, name)
    system.assemble()


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gives_one_clear_line(case: str) -> None:
    make, message = BAD[case]
    with pytest.raises(InputError, match=message) as refused:
        composed(make)
    assert "\n" not in str(refused.value)
