"""Hinges with springs and latches between two bodies, by every solver: against closed forms and integrated angles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import InputError, System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.parts.base import unit
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit
from implicit.rigs import Equations
from implicit.test_tangent import bodies, disturbed, worst

Array = np.ndarray
GROUND_TO_PANEL = {"a": "ground", "b": "panel"}
#: Ways to integrate, and what their motions may be off.
METHODS: dict[str, tuple[dict[str, Any], float]] = {
    "rk4": ({"method": "rk4", "step": 1e-3}, 1e-8),
    "dopri5": ({"method": "dopri5", "rtol": 1e-9, "atol": 1e-11}, 1e-7),
    "alpha-step": ({"step": 1e-3, "spectral_radius": 0.95}, 1e-4),
    "alpha-tolerance": ({"tolerance": 1e-7, "spectral_radius": 0.95}, 1e-4),
}


def integrated(assembly: Assembly, samples: Any, method: str) -> Solution:
    options = METHODS[method][0]
    found = (solve if "method" in options else solve_implicit)(assembly, samples=samples, **options)
    assert found.success, found.message
    return found


def seen(solution: Solution, name: str = "hinge") -> dict[str, Array]:
    return {key: variable.values for key, variable in observe(solution)[name].variables.items()}


def panel(inertia: float = 0.4, rate: float = 0.0, **hinge: Any) -> Assembly:
    """A body that spins about an axis on the ground, with a hinge about that axis."""
    system = System()
    axis = (0.6, 0.0, 0.8)
    system.add(parts.RigidBody(motion="spin", inertia=inertia, axis=axis, rate=rate, position=(1.0, 0.0, 0.0)), "panel")
    system.add(parts.JointSpring(**GROUND_TO_PANEL, axis=axis, **hinge), "hinge")
    return system.assemble()


# ------------------------------------------------------------------------------------------------ springs


@pytest.mark.parametrize("method", ["alpha-step", "alpha-tolerance"])
def test_a_body_on_a_joint_swings_on_its_spring(method: str) -> None:
    """phi = phi0 cos(w t), w^2 = k/(J + m r^2): any amplitude, since the spring is linear."""
    k, m, J, r, start = 3.0, 2.0, 0.3, 0.5, 1.2
    system = System()
    system.add(parts.RigidBody(mass=m, inertia=(0.1, 0.2, J), position=(r, 0.0, 0.0)), "panel")
    system.add(parts.Joint(**GROUND_TO_PANEL, type="revolute", position=(0.0, 0.0, 0.0)), "pin")
    system.add(parts.JointSpring(**GROUND_TO_PANEL, stiffness=k, start=start), "hinge")
    w = math.sqrt(k / (J + m * r * r))
    times = np.linspace(0.0, 3.0 * 2.0 * math.pi / w, 25)
    found = seen(integrated(system.assemble(), times, method))
    assert np.abs(found["angle"] - start * np.cos(w * times)).max() < 2e-4
    assert np.abs(found["rate"] + start * w * np.sin(w * times)).max() < 5e-4
    assert found["torque"] == pytest.approx(k * found["angle"])


@pytest.mark.parametrize("method", METHODS)
def test_two_free_bodies_turn_against_each_other(method: str) -> None:
    """The relative angle has w^2 = k (1/J1 + 1/J2); the torque is internal, so the angular momentum is kept."""
    k, J1, J2, start = 5.0, 0.3, 0.7, 2.0
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.4, J1), angular_velocity=(0.0, 0.0, 0.3)), "hub")
    turned = (math.cos(0.4), 0.0, 0.0, math.sin(0.4))
    body = parts.RigidBody(
        mass=1.0, inertia=(0.5, 0.6, J2), position=(1.0, 2.0, 0.0), orientation=turned, angular_velocity=(0.0, 0.0, 0.3)
    )
    system.add(body, "panel")
    system.add(parts.JointSpring(a="hub", b="panel", stiffness=k, start=start), "hinge")
    w = math.sqrt(k * (1.0 / J1 + 1.0 / J2))
    times = np.linspace(0.0, 2.0, 11)
    solution = integrated(system.assemble(), times, method)
    assert np.abs(seen(solution)["angle"] - start * np.cos(w * times)).max() < 3.0 * METHODS[method][1]
    angular = solution.momentum.angular
    assert angular[0] == pytest.approx([0.0, 0.0, 0.3 * (J1 + J2)])
    assert np.abs(angular[-1] - angular[0]).max() < 1e-9
    assert np.abs(angular - angular[0]).max() < 1e-6  # between steps, too
    assert np.abs(solution.energy_defect).max() < 10.0 * METHODS[method][1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("motion", ["free", "spin"])
def test_a_hinge_in_space_keeps_momentum_and_energy(motion: str, method: str) -> None:
    """Bodies that tumble, the second direction off the plane across the axis: the torque does what its energy says."""
    system = System()
    common = {"inertia": (0.3, 0.25, 0.2), "angular_velocity": (0.3, -0.2, 0.4)}
    system.add(parts.RigidBody(mass=1.0, **common), "hub")
    if motion == "free":
        common["angular_velocity"] = (-0.2, 0.3, 0.5)
        system.add(
            parts.RigidBody(mass=2.0, position=(1.0, 0.0, 0.0), orientation=unit((0.8, 0.3, -0.4, 0.2)), **common),
            "panel",
        )
    else:
        system.add(parts.RigidBody(motion="spin", inertia=0.4, axis=(0.1, 0.2, 1.0), rate=0.6), "panel")
    given = {"stiffness": 2.0, "damping": 0.3, "rest": 0.4, "low": -0.2, "high": 0.5, "stop": 8.0}
    system.add(parts.JointSpring(a="hub", b="panel", axis=(0.2, 0.1, 1.0), **given), "hinge")
    solution = integrated(system.assemble(), np.linspace(0.0, 1.5, 7), method)
    size = solution.energy[0]
    assert np.abs(solution.energy_defect).max() < 20.0 * METHODS[method][1] * size
    lost = solution.balance.by_joints + solution.balance.by_springs
    assert lost[-1] > 0.05 * size
    if motion == "free":
        angular = solution.momentum.angular
        assert np.abs(angular[-1] - angular[0]).max() < (1e-9 if "alpha" in method else METHODS[method][1])
        assert np.abs(angular - angular[0]).max() < (1e-9 if method == "alpha-step" else 1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_the_angle_goes_on_over_any_number_of_turns(method: str) -> None:
    """From three turns through all half turns to three turns back, and the spring with it."""
    k, J, start = 2.0, 0.4, 6.0 * math.pi
    assembly = panel(J, stiffness=k, start=start)
    w = math.sqrt(k / J)
    times = np.linspace(0.0, 4.0, 41)
    solution = integrated(assembly, times, method)
    found = seen(solution)
    assert np.abs(found["angle"] - start * np.cos(w * times)).max() < 2.0 * start * METHODS[method][1]
    assert found["angle"].min() < -5.0 * math.pi
    assert np.abs(solution.energy_defect).max() < 50.0 * METHODS[method][1] * 0.5 * k * start**2


@pytest.mark.parametrize("method", ["dopri5", "alpha-tolerance"])
def test_a_hinge_without_torque_turns_with_its_body(method: str) -> None:
    """Steps that could be long are not so long that a turn is lost; samples may be many turns apart."""
    solution = integrated(panel(rate=40.0, stiffness=0.0), [0.0, 3.0, 10.0], method)
    assert seen(solution)["angle"] == pytest.approx([0.0, 120.0, 400.0], rel=1e-6)


def test_equilibrium_and_modes_between_two_springs() -> None:
    """Where their torques cancel, after more than half a turn; w^2 = k/J there."""
    k, J, other, rest = 2.0, 0.4, 3.0, 9.0
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=J), "panel")
    system.add(parts.JointSpring(**GROUND_TO_PANEL, stiffness=k, rest=-0.5), "hinge")
    system.add(parts.JointSpring(**GROUND_TO_PANEL, stiffness=other, rest=rest), "other")
    assembly = system.assemble()
    found = solve_static(assembly)
    assert found.success
    assert found.path is not None
    assert not found.path.free
    assert seen(found)["angle"][-1] == pytest.approx((other * rest - 0.5 * k) / (k + other), rel=1e-9)
    frequency = modes(assembly, equilibrium=found, count=1).frequency[0]
    assert frequency == pytest.approx(math.sqrt((k + other) / J), rel=1e-9)


def test_modes_of_two_free_bodies() -> None:
    k, J1, J2 = 5.0, 0.3, 0.7
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.4, J1)), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.5, 0.6, J2), position=(1.0, 2.0, 0.0)), "panel")
    system.add(parts.JointSpring(a="hub", b="panel", stiffness=k, damping=0.1), "hinge")
    assembly = system.assemble()
    found = modes(assembly, count=12)
    assert found.frequency[:11] == pytest.approx(0.0, abs=1e-5)
    w = math.sqrt(k * (1.0 / J1 + 1.0 / J2))
    assert found.frequency[11] == pytest.approx(w, rel=1e-9)
    damped = modes(assembly, count=12, damped=True)
    assert damped.decay_rate[-1] == pytest.approx(0.5 * 0.1 * (1.0 / J1 + 1.0 / J2), rel=1e-6)


@pytest.mark.parametrize(
    ("a", "b"),
    [("ground", "free"), ("free", "spin"), ("spin", "other body"), ("driven", "free"), ("other body", "free")],
)
def test_tangent_against_differences(a: str, b: str, rng: np.random.Generator) -> None:
    system = System()
    bodies(system)
    body = parts.RigidBody(
        mass=1.0, inertia=(0.2, 0.3, 0.4), orientation=unit((0.7, -0.2, 0.3, 0.4)), angular_velocity=(0.4, 0.2, 0.6)
    )
    system.add(body, "other body")
    for latch in (0.2, None):
        locked = {} if latch is None else {"latch": latch, "latch_stiffness": 700.0, "latch_damping": 0.1}
        given = {"stiffness": 40.0, "damping": 0.2, "rest": 0.3, "low": -0.2, "high": 1.0, "stop": 300.0, "start": 0.7}
        system.add(parts.JointSpring(a=a, b=b, axis=(0.3, 1.0, -0.2), **given, **locked))
    equations: Equations = disturbed(system.assemble(), rng)
    model = equations.assembly.model
    model.switches[model.coordinates["switch"] + 1] = (1, 0)
    assert worst(equations, np.zeros(0)) < 1e-6


# ------------------------------------------------------------------------------------------------ latches


def opening(start: float) -> tuple[dict[str, float], float, float, Any]:
    """A panel that opens from +-180 degrees onto its latch: its hinge, when it latches, at which rate, its motion."""
    J, side = 0.4, math.copysign(1.0, start)
    hinge = {
        "stiffness": 0.5,
        "damping": 0.05,
        "rest": -0.3 * side,
        "latch": 0.0,
        "latch_stiffness": 60.0,
        "latch_damping": 2.0,
    }

    def rates(t: float, y: Array, locked: float) -> list[float]:
        torque = hinge["stiffness"] * (y[0] - hinge["rest"]) + hinge["damping"] * y[1]
        torque += locked * (hinge["latch_stiffness"] * y[0] + hinge["latch_damping"] * y[1])
        return [y[1], -torque / J]

    def reached(t: float, y: Array, locked: float) -> float:
        return float(y[0])

    reached.terminal = True  # type: ignore[attr-defined]
    tight = {"rtol": 1e-12, "atol": 1e-13, "dense_output": True}
    free = solve_ivp(rates, [0.0, 20.0], [start, 0.0], events=reached, args=(0.0,), **tight)
    when = float(free.t[-1])
    held = solve_ivp(rates, [when, when + 20.0], free.y[:, -1], args=(1.0,), **tight)
    return (
        hinge,
        when,
        J,
        lambda t: np.where(t < when, free.sol(np.minimum(t, when))[0], held.sol(np.maximum(t, when))[0]),
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [math.pi, -math.pi])
def test_a_folded_panel_opens_and_latches(start: float, method: str) -> None:
    """Time and motion of an independent integration; the energy balance closes with the latch's damping."""
    hinge, when, J, angle = opening(start)
    times = np.linspace(0.0, when + 2.0, 41)
    solution = integrated(panel(J, start=start, **hinge), times, method)
    found, allowed = seen(solution), METHODS[method][1]
    assert solution.event_times == pytest.approx([when], rel=2.0 * allowed)
    assert solution.event_kinds.tolist() == [0]
    assert np.all(found["latch_time"] == solution.event_times[0])
    assert np.array_equal(found["latched"], times >= solution.event_times[0])
    assert np.abs(found["angle"] - angle(times)).max() < 20.0 * allowed
    begun = 0.5 * hinge["stiffness"] * (start - hinge["rest"]) ** 2
    lost = solution.balance.by_joints[-1] + solution.balance.by_springs[-1]
    assert solution.energy[-1] + lost == pytest.approx(begun, rel=50.0 * allowed)
    assert np.abs(solution.energy_defect).max() < 50.0 * allowed * begun


def array(panels: int = 3) -> System:
    """A free hub with panels of 1 m, folded back and forth along y, on sprung hinges that latch in line with it."""
    system = System()
    system.add(parts.RigidBody(mass=20.0, inertia=(2.0, 2.0, 3.0)), "hub")
    before, at = "hub", np.array([0.5, 0.0, 0.0])
    for k in range(panels):
        up = 1.0 if k % 2 == 0 else -1.0
        along = np.array([0.0, up, 0.0])
        turned = (math.sqrt(0.5), 0.0, 0.0, up * math.sqrt(0.5))
        body = parts.RigidBody(
            mass=1.0, inertia=(0.02, 0.09, 0.1), position=tuple(at + 0.5 * along), orientation=turned
        )
        system.add(body, f"panel {k}")
        both = {"a": before, "b": f"panel {k}"}
        system.add(parts.Joint(**both, type="revolute", position=tuple(at)), f"joint {k}")
        folded = up * (0.5 * math.pi if k == 0 else math.pi)
        spring = {"stiffness": 0.3, "damping": 0.05, "rest": -0.3 * up}
        latch = {"latch": 0.0, "latch_stiffness": 40.0, "latch_damping": 3.0}
        system.add(parts.JointSpring(**both, start=folded, **spring, **latch), f"hinge {k}")
        before, at = f"panel {k}", at + along
    return system


def test_a_solar_array_unfolds() -> None:
    """Three panels folded by 90, -180 and 180 degrees: all latch; momentum is kept and the balance closes."""
    times = np.linspace(0.0, 30.0, 31)
    solution = solve_implicit(array().assemble(), samples=times, tolerance=1e-6, spectral_radius=0.8)
    assert solution.success, solution.message
    assert sorted(solution.event_kinds.tolist()) == [0, 1, 2]
    for k, folded in enumerate((0.5 * math.pi, -math.pi, math.pi)):
        found = seen(solution, f"hinge {k}")
        assert found["angle"][0] == pytest.approx(folded, abs=1e-12)
        when = found["latch_time"][0]
        assert np.array_equal(found["latched"], times >= when)
        # the spring pulls the latch by k (rest - 0)/(k + latch_stiffness) off its angle
        assert found["angle"][-1] == pytest.approx(-0.3 * math.copysign(1.0, folded) * 0.3 / 40.3, abs=2e-3)
    assert np.abs(solution.momentum.linear).max() < 1e-9
    assert np.abs(solution.momentum.angular[-1]).max() < 1e-7
    assert np.abs(solution.momentum.angular).max() < 1e-5  # between steps, too
    begun, left = solution.energy[0], solution.energy[-1]
    assert solution.balance.by_joints[-1] == pytest.approx(begun - left, rel=1e-2)


def test_a_hinge_that_starts_at_its_latch_is_locked() -> None:
    locked = {"latch": 0.7, "start": 0.7, "latch_stiffness": 60.0}
    assembly = panel(0.4, stiffness=2.0, **locked)
    found = seen(solve_static(assembly))
    assert found["angle"][-1] == pytest.approx(0.7 * 60.0 / 62.0, rel=1e-9)
    assert found["latched"][-1] == 1.0
    assert found["latch_time"][-1] == 0.0
    assert modes(assembly, count=1).frequency[0] == pytest.approx(math.sqrt(62.0 / 0.4), rel=1e-9)


def test_two_latches_and_a_user_event_are_told_apart() -> None:
    system = System()
    for k, latch in enumerate((0.8, 0.3)):
        system.add(parts.RigidBody(motion="spin", inertia=1.0, rate=1.0), f"panel {k}")
        given = {"latch": latch, "latch_stiffness": 10.0, "latch_damping": 5.0}
        system.add(parts.JointSpring(a="ground", b=f"panel {k}", **given), f"hinge {k}")
    assembly = system.assemble()
    for method, (_, allowed) in METHODS.items():
        solution = integrated(assembly, [0.0, 0.5, 1.0], method)
        assert solution.event_times == pytest.approx([0.3, 0.8], abs=allowed)
        assert solution.event_kinds.tolist() == [1, 0]
        assert [seen(solution, f"hinge {k}")["latched"].tolist() for k in (0, 1)] == [[0, 0, 1], [0, 1, 1]]


# ------------------------------------------------------------------------------------------------ refusals


def test_bad_hinges() -> None:
    def refused(match: str, **fields: Any) -> None:
        system = System()
        system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "hub")
        system.add(parts.Point(mass=1.0), "mass")
        system.add(parts.JointSpring(**fields), "hinge")
        with pytest.raises(InputError, match=match):
            system.assemble()

    refused("hinge.a and hinge.b are one body, 'hub'", a="hub", b="hub")
    refused("hinge.b is 'mass', a point mass", a="hub", b="mass")
    refused("'hob'.*did you mean 'hub'", a="hob", b="hub")
    refused("hinge.zero is given, but hinge.b is a body; give hinge.start", a="ground", b="hub", zero=(1.0, 0.0, 0.0))
    refused("latch_stiffness", a="ground", b="hub", latch=1.0)
    system = System()
    from implicit.test_tangent import beam

    system.add(beam(), "beam")
    hinge = parts.JointSpring(a="ground", b="beam.root", zero=(1.0, 0.0, 0.0), start=1.0)
    system.add(hinge, "hinge")
    with pytest.raises(InputError, match=r"hinge.start is 1 rad, but hinge.b is at 0 rad from hinge.zero"):
        system.assemble()


def test_the_angle_of_a_beams_node_may_count_turns() -> None:
    from implicit.test_tangent import beam

    for given in ({"zero": (1.0, 0.0, 0.0), "start": 2.0 * math.pi}, {"start": 2.0 * math.pi}):
        system = System()
        system.add(beam(), "beam")
        system.add(parts.JointSpring(a="ground", b="beam.root", stiffness=1.0, **given), "hinge")
        assembly = system.assemble()
        assert assembly.s.tolist() == [4, 0]
