"""Reaction wheels, thrusters and controllers under generalized-alpha and energy-momentum."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from attitude.building import J, bus
from book import Book
from evolvent import System, elements, parts
from evolvent.solvers import Solution, solve
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from implicit.rigs import Equations, coordinates

Array = np.ndarray
SOLVERS = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}
BOTH = pytest.mark.parametrize("method", SOLVERS)


def ran(system: System, method: str, end: float, count: int = 11, **options: Any) -> Solution:
    found = SOLVERS[method](system.assemble(), samples=np.linspace(0.0, end, count), **options)
    assert found.success, found.message
    return found


def exact(system: System, end: float, count: int = 11) -> Solution:
    return solve(system.assemble(), samples=np.linspace(0.0, end, count), method="dopri5", rtol=1e-11, atol=1e-13)


def off(found: Solution, reference: Solution) -> float:
    """Largest difference of coordinates and velocities."""
    info = found.assembly.model.info
    n = int(info.nq + info.nv)
    return float(np.abs(found.y - reference.y)[:, :n].max())


def thrusters(**control: Any) -> System:
    """Twelve thrusters in pairs of couples about all axes, under a controller, and an engine."""
    system, names = System(), []
    system.add(parts.RigidBody(mass=10.0, inertia=tuple(J), angular_velocity=(0.1, 0.2, 0.0)), "bus")
    for i in range(3):
        for side in (1.0, -1.0):
            for sense in (1.0, -1.0):
                place, direction = side * np.eye(3)[i], sense * np.eye(3)[(i + 1) % 3]
                thruster = parts.Thruster(at=("bus", tuple(place)), direction=tuple(direction), thrust=0.8)
                names.append(system.add(thruster, f"t{len(names)}"))
    system.add(parts.AttitudeController(body="bus", actuators=names, **control), "control")
    burn = {"table": [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]}
    system.add(parts.Thruster(at=("bus", (0.0, 0.1, 0.0)), direction=(1.0, 0.0, 0.0), thrust=1.5, profile=burn), "jet")
    return system


@BOTH
def test_free_gyrostat(method: str, book: Book) -> None:
    """Rates across the axis of a symmetric body with a wheel turn at ((C - A) w3 + h)/A, to the second order."""
    A, C, h, w3, end = 2.0, 3.0, 0.05 * 40.0, 0.3, 5.0
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(A, A, C), angular_velocity=(0.2, 0.0, w3)), "bus")
    system.add(parts.ReactionWheel(body="bus", inertia=0.05, rate=40.0), "wheel")
    errors, steps = [], (0.05, 0.025, 0.0125)
    for step in steps:
        found = ran(system, method, end, step=step)
        first = int(found.assembly.model.bodies["iv"][1]) + 3
        turn = ((C - A) * w3 + h) / A * found.t
        rates = 0.2 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        errors.append(np.abs(found.y[:, first : first + 2] - rates).max() / 0.2)
        momentum = found.momentum
        assert np.abs(momentum.drift_angular).max() < 1e-10 * np.abs(momentum.angular).max()
        if method == "energy-momentum":
            assert np.abs(found.energy - found.energy[0]).max() < 1e-10 * found.energy[0]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        "Rigid bodies", f"Free gyrostat ({method}): rates across its axis", reference="((C - A) w3 + h)/A",
        source="closed form", error=errors[-1], allowed=2e-3, order=order, wanted="2",
    )  # fmt: skip


@BOTH
def test_slew_by_a_controller(method: str) -> None:
    """About one axis the error is the damped oscillator J e'' + D e' + P e = 0, to the second order."""
    P, D, start, errors, steps = 2.0, 1.0, 2.0, [], (0.1, 0.05, 0.025)
    turned = (math.cos(0.5 * start), 0.0, 0.0, math.sin(0.5 * start))
    control = {"proportional": P, "derivative": D, "target": (1, 0, 0, 0)}
    roots = np.roots([J[2] - 4 * 0.05 * 0.5, D, P]).astype(complex)
    for step in steps:
        found = ran(bus({"rate": 0.0}, control, orientation=turned), method, 10.0, step=step)
        e0, e1 = np.exp(roots[:, None] * found.t)
        error = (start * (roots[1] * e0 - roots[0] * e1) / (roots[1] - roots[0])).real
        x = coordinates(found.assembly, found.y, "bus")
        errors.append(np.abs(2.0 * np.arctan2(x[:, 6], x[:, 3]) - error).max())
        assert found.statistics["iterations"] < 4.0 * found.statistics["steps"]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)
    assert errors[-1] < 2e-3


@BOTH
def test_three_axes_with_friction(method: str) -> None:
    """Momentum and energy of a slew by a path, with friction in the wheels; the motion by the tight solution."""
    control = {"proportional": 2.0, "derivative": 2.0, "path": parts.RampDrive(steps=[(0.0, 1.0, 0.5)])}
    system = bus({"viscous_damping": 1e-3, "friction_torque": 1e-3}, control, angular_velocity=(0.1, 0.3, 0.2))
    found = ran(system, method, 2.0, step=5e-3)
    assert np.abs(found.momentum.drift_angular).max() < 1e-9
    allowed = 1e-8 if method == "energy-momentum" else 1e-4
    assert np.abs(found.energy_defect).max() < allowed * found.energy[0]
    assert np.abs(found.balance.drives).max() > 0.1 * found.energy[0]
    assert found.balance.by_springs[-1] > 0.0
    reference = exact(system, 2.0)
    assert off(found, reference) < 4e-3  # of rates of 30 rad/s
    if method == "generalized-alpha":  # those of the other are means over steps
        assert np.abs(found.wrenches - reference.wrenches).max() < 1e-3 * np.abs(reference.wrenches).max()


@BOTH
def test_tolerance_of_a_slew(method: str) -> None:
    """Adaptive steps reach what they are asked for."""
    system = bus({"rate": 0.0}, {"proportional": 2.0, "derivative": 3.0, "target": (0.8, 0.0, 0.6, 0.0)})
    reference = exact(system, 4.0)
    for tolerance in (1e-4, 1e-6):
        found = ran(system, method, 4.0, tolerance=tolerance)
        x = coordinates(found.assembly, found.y - reference.y, "bus")
        assert np.abs(x).max() < 30.0 * tolerance


LIMITS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "torque and rate of wheels": ({"rate": 0.0, "torque_limit": 0.1, "rate_limit": 1.0}, {}),
    "torque and dead band": ({}, {"limit": 0.3, "dead_band": 0.1}),
    "stiff gains": (
        {"rate": 0.0},
        {"proportional": 4e4, "derivative": 3e4, "target": None, "path": parts.RampDrive(steps=[(0.0, 1.0, 0.5)])},
    ),
}


@BOTH
@pytest.mark.parametrize("limits", LIMITS)
def test_limits(method: str, limits: str) -> None:
    """Saturated motors, limited commands and gains that a step does not resolve."""
    wheels, control = LIMITS[limits]
    target = (math.cos(0.5), 0.0, 0.0, math.sin(0.5))
    system = bus(wheels, {"proportional": 5.0, "derivative": 5.0, "target": target} | control)
    found, reference = ran(system, method, 6.0, 26, step=0.02), exact(system, 6.0, 26)
    assert found.statistics["iterations"] < 4.0 * found.statistics["steps"]
    x = [coordinates(one.assembly, one.y, "bus")[:, 3:] for one in (found, reference)]
    assert np.abs(x[0] - x[1])[2:].max() < 2e-3
    assert np.abs(found.momentum.drift_angular).max() < 1e-8


@BOTH
def test_thrusters(method: str) -> None:
    """Position, attitude and impulses of thrusters that saturate; the work that they do."""
    system = thrusters(proportional=2.0, derivative=4.0, target=(0.8, 0.0, 0.6, 0.0))
    found, reference = ran(system, method, 3.0, step=5e-3), exact(system, 3.0)
    assert off(found, reference) < 1e-3
    first = int(found.assembly.model.thrusters["iv"][-1])
    assert found.y[-1, first] == pytest.approx(2.0 - 0.125, rel=1e-3)  # the profile above 1.5 N is cut off
    assert np.ptp(reference.y[:, first - 12 : first], axis=0).max() > 0.3
    allowed = 1e-9 if method == "energy-momentum" else 1e-4
    assert np.abs(found.energy_defect).max() < allowed * found.energy.max()


@BOTH
def test_a_wheel_across_a_fixed_axis(method: str) -> None:
    """On a body that spins about an axis, 45 degrees off it, with friction: W falls by c (1/I + n^2/(C - I n^2))."""
    c, inertia, C, n2, end = 0.01, 0.05, 0.4, 0.5, 3.0
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=C, axis=(0.0, 0.0, 1.0)), "bus")
    system.add(parts.ReactionWheel(body="bus", inertia=inertia, axis=(0, 1, 1), rate=40.0, viscous_damping=c), "wheel")
    found = ran(system, method, end, step=0.01)
    rate = 40.0 * np.exp(-c * (1.0 / inertia + n2 / (C - inertia * n2)) * found.t)
    assert found.y[:, int(found.assembly.model.wheels["iv"][0])] == pytest.approx(rate, rel=1e-4)
    assert np.abs(found.energy_defect).max() < (1e-11 if method == "energy-momentum" else 1e-4) * found.energy[0]


@pytest.mark.parametrize("kind", ["wheels", "thrusters"])
def test_tangent(kind: str, rng: np.random.Generator) -> None:
    """The tangent is the derivative of the residual, at large errors and with friction."""
    control = {"proportional": (3.0, 4.0, 5.0), "derivative": 2.0, "target": (0.5, 0.5, -0.5, 0.5)}
    if kind == "wheels":
        law = {
            "law": "-0.3*v + 0.2*sin(x)",
            "friction_torque": 0.1,
            "slip_rate": 3.0,
            "viscous_damping": 0.2,
            "rate_limit": 31.0,
        }
        system = bus(law, control, angular_velocity=(0.3, -0.2, 0.5))
    else:
        system = thrusters(**control)
    assembly = system.assemble()
    model = assembly.model
    model.thrusters["limit"] = 1e3
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y, a = assembly.y.copy(), rng.normal(size=n_v)
    y[n_q : n_q + n_v] += 0.1 * rng.normal(size=n_v)
    equations = Equations(assembly, 0.3, y, a, 50.0, 7.0)
    found, h = equations.tangent(np.zeros(0)), 1e-5
    wanted = np.zeros_like(found)
    for i in range(n_v):
        d = np.zeros(n_v)
        d[i] = h
        wanted[:, i] = (equations.residual(d, np.zeros(0)) - equations.residual(-d, np.zeros(0))) / (2.0 * h)
    if kind == "thrusters":
        inertia = equations._replace(c_mass=0.0).tangent(np.zeros(0)) - found
        assert np.abs(found[3:6, 3:6]).max() > 2.0 * np.abs(inertia[3:6, 3:6]).max() * 0.01
    assert found == pytest.approx(wanted, abs=2e-6 * np.abs(wanted).max())


# ------------------------------------------------------------------------------------------- a flexible satellite

GOAL = math.radians(30.0)


def satellite(**wheel: Any) -> System:
    """A satellite with two beams clamped to it, whose wheel turns it about z by 30 degrees."""
    system = System()
    system.add(parts.RigidBody(mass=50.0, inertia=(4.0, 5.0, 6.0)), "bus")
    for name, side in (("left", -1.0), ("right", 1.0)):
        boom = parts.Beam(
            length=3.0, section=elements.Rectangle(thickness=0.001, width=0.03), elements=3, formulation="cable",
            material=elements.Material(young_modulus=7e10, poisson_ratio=0.3, density=2700.0),
            stiffness_damping=0.2, position=(0.4 * side, 0.0, 0.0), direction=(side, 0.0, 0.0),
        )  # fmt: skip
        system.add(boom, name)
        system.add(parts.Joint(a=("bus", (0.4 * side, 0.0, 0.0)), b=f"{name}.root", type="clamp"), f"{name} root")
    system.add(parts.ReactionWheel(body="bus", inertia=0.02, **wheel), "wheel")
    gains = {"proportional": (0.0, 0.0, 1.0), "derivative": (0.0, 0.0, 5.0)}
    target = (math.cos(0.5 * GOAL), 0.0, 0.0, math.sin(0.5 * GOAL))
    system.add(parts.AttitudeController(body="bus", actuators=["wheel"], target=target, **gains), "control")
    return system


@BOTH
def test_slew_of_a_flexible_satellite(method: str, book: Book) -> None:
    """It reaches its attitude, the beams are at rest there; momentum stays 0 and the energy balance is closed."""
    options = {"newton": 1e-13} if method == "energy-momentum" else {}
    found = ran(
        satellite(viscous_damping=1e-4, friction_torque=1e-4),
        method,
        80.0,
        41,
        step=0.05,
        spectral_radius=0.9,
        **options,
    )
    x = coordinates(found.assembly, found.y, "bus")
    angle = 2.0 * np.arctan2(x[:, 6], x[:, 3])
    wheel = found.assembly.model.wheels[0]
    h = wheel["inertia"] * found.y[:, int(wheel["iv"])]
    drift = np.abs(found.momentum.angular).max() / np.abs(h).max()
    defect = np.abs(found.energy_defect).max() / np.abs(found.balance.drives).max()
    assert abs(angle[-1] - GOAL) < 1e-4
    assert abs(h[-1]) < 1e-3 * np.abs(h).max()
    tip = coordinates(found.assembly, found.y, "right")[:, -1, 0] - x[:, :3]
    across = np.cos(angle) * tip[:, 1] - np.sin(angle) * tip[:, 0]
    assert np.abs(across).max() > 0.1
    assert abs(across[-1]) < 1e-3
    assert defect < (1e-8 if method == "energy-momentum" else 2e-3)
    book(
        "Dynamics", f"Satellite with two beams, slewed by a wheel ({method}): angular momentum", reference="0",
        source="invariant", error=drift, allowed=1e-9,
    )  # fmt: skip


def test_a_fixed_step_without_a_solution_is_divided() -> None:
    """At 11.55 s the beams pass the straight line: along it they are a million times stiffer than across it."""
    system = satellite(viscous_damping=1e-4, friction_torque=1e-4)
    found, half = (ran(system, "generalized-alpha", 12.0, step=step, spectral_radius=0.0) for step in (0.05, 0.025))
    assert found.statistics["steps"] > 240
    model = found.assembly.model
    columns = [*range(int(model.bodies["iq"][1]), int(model.bodies["iq"][1]) + 7), int(model.wheels["iv"][0])]
    a, b = found.y[:, columns], half.y[:, columns]
    assert np.abs(a - b).max() < 1e-2 * np.ptp(a, axis=0).max()


def test_both_solvers_agree_on_the_flexible_satellite() -> None:
    """Motions of the bus and of the wheel over the first seconds."""
    runs = [ran(satellite(rate=5.0), method, 6.0, 13, step=0.01) for method in SOLVERS]
    model = runs[0].assembly.model
    columns = [*range(int(model.bodies["iq"][1]), int(model.bodies["iq"][1]) + 7), int(model.wheels["iv"][0])]
    a, b = (run.y[:, columns] for run in runs)
    assert np.abs(a - b).max() < 2e-3 * np.ptp(a, axis=0).max()
