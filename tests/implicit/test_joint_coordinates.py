"""Springs, friction, motors, cables and latches on the coordinates of joints: closed forms, balances, refusals."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent
from book import Book
from evolvent import InputError, System, parts
from evolvent.parts.base import unit
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from implicit.test_tangent import bodies, disturbed, worst

Array = np.ndarray
ALPHA = {"tolerance": 1e-7, "spectral_radius": 0.9}
ENERGY = {"tolerance": 1e-7, "spectral_radius": 1.0}
#: Ways to integrate, and what their motions may be off.
METHODS: dict[str, tuple[Any, dict[str, Any], float]] = {
    "rk4": (solve, {"method": "rk4", "step": 1e-3}, 1e-6),
    "alpha": (solve_implicit, ALPHA, 1e-4),
    "energy": (solve_energy, ENERGY, 1e-4),
}
IMPLICIT = ("alpha", "energy")


def run(system: System, times: Any, method: str, **options: Any) -> Solution:
    function, own, _ = METHODS[method]
    found = function(system.assemble(), samples=times, **(own | options))
    assert found.success, found.message
    return found


def seen(solution: Solution, name: str) -> dict[str, Array]:
    return {key: variable.values for key, variable in observe(solution)[name].variables.items()}


def wheel(inertia: float = 0.4, rate: float = 0.0, **spring: Any) -> System:
    """A body that spins about an axis on the ground, with a spring of its coordinate."""
    system, axis = System(), (0.6, 0.0, 0.8)
    system.add(parts.RigidBody(motion="spin", inertia=inertia, axis=axis, rate=rate), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel", axis=axis, **spring), "hinge")
    return system


# ------------------------------------------------------------------------------------------------ travels


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("ground", ("free", (0.1, 0.2, -0.3))), ("free", ("spin", (0.2, -0.1, 0.3))), ("spin", "point"),
        ("free", "point"), ("driven", ("free", (0.0, 0.2, 0.0))), ("free", ("driven", (0.3, 0.0, 0.1))),
        ("free", "beam.tip"), ("spin", ("free", (0.3, 0.1, 0.0))),
    ],
)  # fmt: skip
def test_tangent_of_a_travel_against_differences(a: str, b: Any, rng: np.random.Generator) -> None:
    """Between sides of every kind."""
    system = System()
    bodies(system)
    system.add(parts.Beam(length=1.0, section=evolvent.Rectangle(thickness=0.02, width=0.02),
                          material=evolvent.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0),
                          elements=1, formulation="cable"), "beam")  # fmt: skip
    given = {"stiffness": 40.0, "rest": 0.3, "low": -0.2, "high": 1.0, "stop": 300.0, "start": 0.7}
    system.add(parts.JointSpring(a=a, b=b, axis=(0.3, 1.0, -0.2), motion="translation", **given), "slide")
    assert worst(disturbed(system.assemble(), rng), np.zeros(0)) < 1e-6


@pytest.mark.parametrize("step", [0.02, None])
def test_a_travel_between_tumbling_bodies_keeps_energy_and_momentum(step: float | None) -> None:
    """Under energy-momentum at any step, to what Newton's method leaves; the stop lets it rebound."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.3, 0.25, 0.2), angular_velocity=(0.3, -0.8, 1.4)), "hub")
    turned = {"orientation": unit((0.8, 0.3, -0.4, 0.2)), "angular_velocity": (-0.2, 0.9, 0.5)}
    system.add(parts.RigidBody(mass=2.0, inertia=(0.3, 0.2, 0.4), position=(1.0, 0.0, 0.0), **turned), "slider")
    given = {"stiffness": 5.0, "rest": 0.7, "low": -0.2, "high": 1.1, "stop": 80.0, "start": 1.0}
    slide = parts.JointSpring(
        a="hub", b=("slider", (0.1, 0.2, -0.1)), axis=(1.0, 0.2, -0.1), motion="translation", **given
    )
    system.add(slide, "slide")
    options = {"step": step} if step is not None else {"tolerance": 1e-5}
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 4.0, 9), spectral_radius=1.0, **options)
    assert found.success, found.message
    assert np.ptp(found.sampled.balance.kinetic) > 0.1
    assert np.abs(found.energy_defect).max() < 2e-9 * found.energy[0]
    ends = found.momentum
    assert np.abs(ends.linear - ends.linear[0]).max() < 1e-11
    if step is not None:
        assert np.abs(ends.angular[-1] - ends.angular[0]).max() < 1e-8


@pytest.mark.parametrize("method", METHODS)
def test_a_damped_travel_on_a_turning_body(method: str) -> None:
    """A point in a slot of a driven turntable: x'' = (w^2 - k/m) x - c/m x' along the slot; across it two springs."""
    k, c, m, w, x0 = 30.0, 0.8, 1.0, 2.0, 0.3
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=w), "table")
    system.add(parts.Point(mass=m, position=(x0, 0.0, 0.0), velocity=(0.0, w * x0, 0.0)), "bead")
    spring = parts.JointSpring(
        a="table", b="bead", axis=(1.0, 0.0, 0.0), motion="translation", start=x0, stiffness=k, damping=c
    )
    system.add(spring, "slot")
    system.add(
        parts.JointSpring(a="table", b="bead", axis=(0.0, 1.0, 0.0), motion="translation", stiffness=4e3), "wall"
    )
    times = np.linspace(0.0, 3.0, 13)
    found = run(system, times, method)
    s = np.roots([m, c, k - m * w * w])
    exact = (x0 * (s[1] * np.exp(np.outer(times, s[0]).ravel()) - s[0] * np.exp(np.outer(times, s[1]).ravel())) / (
        s[1] - s[0])).real  # fmt: skip
    # the wall yields by the Coriolis force, 2 m w x' / 4e3, which acts back on the travel by its rate
    assert np.abs(seen(found, "slot")["travel"] - exact).max() < 3e-3
    assert np.abs(found.energy_defect).max() < 20.0 * METHODS[method][2]
    slot = seen(found, "slot")
    lost = found.balance.by_joints[-1] + found.balance.by_springs[-1]
    assert slot["damper_work"][-1] == pytest.approx(lost, rel=1e-4)


# ------------------------------------------------------------------------------------------------ friction


def sledge(
    friction: float, gravity: float = 0.0, stiffness: float = 0.0, x0: float = 0.0, v: float = 0.0, **more: float
) -> System:
    """A mass of 2 kg in a slot along x."""
    system = System(gravity=(gravity, 0.0, 0.0))
    system.add(parts.Point(mass=2.0, position=(x0, 0.0, 0.0), velocity=(v, 0.0, 0.0)), "mass")
    spring = {"stiffness": stiffness, "start": x0, "friction": friction}
    system.add(
        parts.JointSpring(a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation", **spring, **more), "slot"
    )
    return system


@pytest.mark.parametrize("method", IMPLICIT)
def test_oscillation_decays_by_coulomb_friction(book: Book, method: str) -> None:
    """The amplitude falls by 4 F/k a cycle, and the mass stops where k x < F; the balance closes."""
    k, F, x0 = 50.0, 0.3, 0.2
    period = 2.0 * math.pi / math.sqrt(k / 2.0)
    found = run(sledge(F, stiffness=k, x0=x0), period * np.arange(11), method)
    x, cycles = seen(found, "slot")["travel"], np.arange(9)
    book(
        "Rigid bodies", f"Mass on a spring with Coulomb friction ({method}): amplitude after 1 to 8 cycles",
        reference="4 F/k less each", source="piecewise closed form",
        error=np.abs(x[:9] - (x0 - 4.0 * F / k * cycles)).max() / x0, allowed=5e-4,
    )  # fmt: skip
    assert np.abs(x[-2:]).max() < F / k
    assert abs(x[-1] - x[-2]) < 1e-5
    slot = seen(found, "slot")
    assert slot["friction_work"] == pytest.approx(found.balance.by_friction)
    assert np.abs(slot["friction_force"]).max() <= F * (1.0 + 1e-9)
    assert np.abs(found.energy_defect).max() < (1e-12 if method == "energy" else 1e-5)


@pytest.mark.parametrize("method", IMPLICIT)
def test_block_on_an_incline(book: Book, method: str) -> None:
    """It stays, to a part of the bristle's deflection, where m g sin < F; else it slides at g sin - F/m."""
    held = run(sledge(3.0, gravity=1.2), [0.0, 100.0, 1000.0], method, tolerance=1e-5)
    slot = seen(held, "slot")
    assert np.abs(slot["travel"]).max() < 5e-5  # it slips when it is released, and no more
    assert slot["friction_force"][-1] == pytest.approx(2.4, rel=1e-3)
    assert held.statistics["steps"] < 2000
    times = np.linspace(0.0, 2.0, 5)
    # of a bristle that yields by d = F/k the mass breaks loose at a speed of sqrt(F d/m)
    slid = run(sledge(2.0, gravity=1.2, bristle_stiffness=1e10), times, method)
    error = np.abs(seen(slid, "slot")["travel"] - 0.5 * (1.2 - 1.0) * times**2).max() / 0.4
    book(
        "Rigid bodies", f"Block that slides down with friction ({method})", reference="(g sin - F/m) t^2/2",
        source="closed form", error=error, allowed=2e-4,
    )  # fmt: skip
    stops = run(sledge(2.0, v=1.0), [0.0, 1.0, 3.0], method)
    assert seen(stops, "slot")["travel"][1:] == pytest.approx([0.5, 0.5], rel=1e-3)


def test_equilibrium_and_modes_with_friction_that_sticks() -> None:
    """Held by the bristle, which slips after 1e-5 m: m g/(F/1e-5); so are its modes; beyond F it slips."""
    system = sledge(3.0, gravity=1.2, stiffness=10.0)
    for k, axis in ((1, (0.0, 1.0, 0.0)), (2, (0.0, 0.0, 1.0))):
        system.add(
            parts.JointSpring(a="ground", b="mass", axis=axis, motion="translation", stiffness=1e9), f"across {k}"
        )
    found = solve_static(system.assemble())
    stick = 3.0 / 1e-5
    assert seen(found, "slot")["travel"][-1] == pytest.approx(2.4 / (10.0 + stick), rel=1e-9)
    assert seen(found, "slot")["force"][-1] == pytest.approx(2.4, rel=1e-9)
    frequency = modes(system.assemble(), equilibrium=found, count=1).frequency[0]
    assert frequency == pytest.approx(math.sqrt((10.0 + stick) / 2.0), rel=1e-9)
    slips = sledge(1.0, gravity=1.2, stiffness=10.0)
    assert seen(solve_static(slips.assemble()), "slot")["travel"][-1] == pytest.approx((2.4 - 1.0) / 10.0, rel=1e-6)


# ------------------------------------------------------------------------------------------------ motors


@evolvent.law
def speed_control(t, x, v, p):  # type: ignore[no-untyped-def]
    """Torque in proportion to the rate that is missing."""
    return p[0] * (p[1] - v)


@pytest.mark.parametrize("method", METHODS)
def test_motor_by_profile_and_law(method: str) -> None:
    """x = T t^2/(2 J) of a constant torque; v = v0 (1 - exp(-k t/J)) of a speed control; work is kinetic energy."""
    J, T, times = 0.4, 0.3, np.linspace(0.0, 2.0, 5)
    system = wheel(J)
    system.add(parts.Motor(joint="hinge", torque={"constant": T}), "motor")
    found = run(system, times, method)
    motor = seen(found, "motor")
    assert motor["angle"] == pytest.approx(0.5 * T / J * times**2, abs=5e-5)
    assert motor["work"] == pytest.approx(found.energy, rel=1e-4, abs=1e-9)
    assert found.balance.drives == pytest.approx(motor["work"])
    expression = {"law": "k*(w - v)", "constants": {"k": 0.5, "w": 3.0}}
    for keys in ({"law": speed_control, "parameters": (0.5, 3.0)}, expression):
        system = wheel(J)
        system.add(parts.Motor(joint="hinge", **keys), "motor")
        found = run(system, times, method)
        assert seen(found, "motor")["rate"] == pytest.approx(3.0 * (1.0 - np.exp(-0.5 / J * times)), abs=5e-4)
        assert np.abs(found.energy_defect).max() < 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_motor_follows_a_motion_within_its_limits(method: str) -> None:
    """A slew by 1 rad at 0.2 rad/s at most, with 0.5 N m at most: it turns at the limit, then settles."""
    system = wheel(0.4)
    limits = {"limit": 0.5, "rate_limit": 0.2}
    drive = parts.ConstantDrive(rate=0.0, angle=1.0)
    system.add(parts.Motor(joint="hinge", motion=drive, position_gain=4.0, velocity_gain=4.0, **limits), "motor")
    times = np.linspace(0.0, 12.0, 121)
    found = run(system, times, method)
    motor = seen(found, "motor")
    assert np.abs(motor["torque"]).max() == pytest.approx(0.5)
    assert motor["rate"].max() == pytest.approx(0.2, abs=1e-3)
    assert motor["rate"].max() <= 0.2 + 1e-4
    assert motor["error"][-1] == pytest.approx(0.0, abs=2e-3)
    # at rest after the torque's limit, T/J t, and cruise: 1 rad takes 5 s and a little
    assert motor["angle"][50] == pytest.approx(0.2 * 5.0, abs=0.1)
    assert np.abs(found.energy_defect).max() < 1e-5


@pytest.mark.parametrize("motion", ["revolute", "spring"])
def test_motor_on_a_joint_between_bodies(motion: str) -> None:
    """Its torque is internal: angular momentum stays, bodies turn in the ratio of their inertias."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=0.3), "hub")
    system.add(parts.RigidBody(mass=1e-3, inertia=0.1, position=(0.0, 0.0, 0.2)), "rotor")
    system.add(parts.Joint(a="hub", b="rotor", type="revolute", position=(0.0, 0.0, 0.2)), "bearing")
    on = "bearing"
    if motion == "spring":
        system.add(parts.JointSpring(joint="bearing", damping=0.0), "coordinate")
        on = "coordinate"
    system.add(parts.Motor(joint=on, torque=[["0 s", "0.2 N m"], ["1 s", "0.2 N m"], ["1 s", 0], ["3 s", 0]]), "motor")
    found = run(system, np.linspace(0.0, 2.0, 5), "energy")
    relative = 0.2 / 0.3 + 0.2 / 0.1
    assert seen(found, "motor")["rate"][-1] == pytest.approx(relative, rel=1e-4)
    assert np.abs(found.momentum.angular[-1]).max() < 1e-10
    assert found.balance.drives[-1] == pytest.approx(found.energy[-1], rel=1e-9)


# ------------------------------------------------------------------------------------------------ joints by name


def test_a_joint_by_name_is_the_same_as_its_ends() -> None:
    """Also with the body as the second end, where the angle stays that of b against a."""

    def system(flip: bool, named: bool) -> System:
        found = System()
        found.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.3), position=(0.5, 0.0, 0.0)), "panel")
        ends: tuple[Any, Any] = ((0.0, 0.0, 0.0), ("panel", (-0.5, 0.0, 0.0)))
        a, b = reversed(ends) if flip else ends
        found.add(parts.Joint(a=a, b=b, type="revolute"), "pin")
        keys = {"joint": "pin"} if named else {"a": "panel" if flip else "ground", "b": "ground" if flip else "panel"}
        found.add(parts.JointSpring(**keys, stiffness=3.0, start=0.7, damping=0.2), "hinge")
        return found

    times = np.linspace(0.0, 1.0, 4)
    for flip in (False, True):
        named, own = (seen(run(system(flip, way), times, "energy"), "hinge")["angle"] for way in (True, False))
        np.testing.assert_array_equal(named, own)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rate", [10.0, -10.0])
def test_an_angle_goes_on_from_half_a_turn(method: str, rate: float, tmp_path: pathlib.Path) -> None:
    """From a file: 180 deg at the start, then six turns more or less; the samples are further apart than a turn."""
    (tmp_path / "fold.yaml").write_text(
        f"""system: structure
parts:
  panel: {{kind: rigid-body, motion: spin, inertia: 0.4 kg m^2, rate: {rate} rad/s}}
  hinge: {{kind: joint-spring, a: ground, b: panel, start: 180 deg}}
simulate: {{until: 4 s, every: 1 s}}
"""
    )
    found = run(evolvent.load(tmp_path / "fold.yaml"), np.arange(5.0), method)
    assert seen(found, "hinge")["angle"] == pytest.approx(math.pi + rate * np.arange(5.0), abs=1e-3)


# ------------------------------------------------------------------------------------------------ latches


@pytest.mark.parametrize("method", IMPLICIT)
def test_panel_latches_with_its_energy_balance(book: Book, method: str) -> None:
    """The rate at the latch from the spring's energy less friction; what the latch takes; its peak moment.

    Until the latch J w^2/2 = k ((x0 - rest)^2 - rest^2)/2 - F x0. The latch without a damper is a spring kl: its first
    peak is at the angle d where J w^2/2 + (k rest) d - F d = (kl + k) d^2/2, on the way that the panel moves on.
    """
    J, k, F, x0, rest, kl = 0.4, 0.5, 0.1, math.pi, -0.3, 60.0
    hinge = {"stiffness": k, "rest": rest, "friction": F, "start": x0, "latch": 0.0, "latch_stiffness": kl}
    times = np.linspace(0.0, 8.0, 81)
    found = run(wheel(J, **hinge), times, method)
    energy = 0.5 * k * ((x0 - rest) ** 2 - rest**2) - F * x0
    rate, got = -math.sqrt(2.0 * energy / J), seen(found, "hinge")
    push = k * abs(rest) - F
    d = (push + math.sqrt(push**2 + 2.0 * (kl + k) * energy)) / (kl + k)
    for what, value, exact, allowed in (
        ("rate as it latches", got["latch_rate"][-1], rate, 2e-4),
        ("peak moment of the latch", got["latch_torque_peak"][-1], kl * d, 5e-4),
    ):
        book(
            "Rigid bodies", f"Spring-latch panel with Coulomb friction ({method}): {what}",
            reference="balance of energies", source="closed form", error=abs(value / exact - 1.0), allowed=allowed,
        )  # fmt: skip
    assert got["angle"][0] == pytest.approx(x0, abs=1e-12)
    assert np.abs(found.energy_defect).max() < (1e-10 if method == "energy" else 2e-4)


@pytest.mark.parametrize("method", METHODS)
def test_energy_lost_at_a_latch(book: Book, method: str) -> None:
    """With its own damper the latch takes all that is left: the kinetic energy, and the spring's change."""
    J, k, x0, rest, kl = 0.4, 0.5, math.pi, -0.3, 60.0
    hinge = {"stiffness": k, "rest": rest, "start": x0, "latch": 0.0, "latch_stiffness": kl, "latch_damping": 3.0}
    found = run(wheel(J, **hinge), np.linspace(0.0, 12.0, 25), method)
    got = seen(found, "hinge")
    end = k * rest / (k + kl)
    left = 0.5 * k * (end - rest) ** 2 + 0.5 * kl * end**2
    exact = 0.5 * k * (x0 - rest) ** 2 - left
    book(
        "Rigid bodies", f"Spring-latch panel ({method}): energy that the latch takes",
        reference="balance of energies", source="closed form",
        error=abs(got["latch_work"][-1] / exact - 1.0), allowed=5e-4,
    )  # fmt: skip
    assert got["angle"][-1] == pytest.approx(end, rel=1e-3)
    assert got["latch_rate"][-1] == pytest.approx(-math.sqrt(k * ((x0 - rest) ** 2 - rest**2) / J), rel=5e-4)
    assert got["latch_torque_peak"][-1] >= 3.0 * abs(got["latch_rate"][-1]) * (1.0 - 1e-9)
    assert found.event_times.size == 1


@pytest.mark.parametrize("method", METHODS)
def test_a_travel_latches(method: str) -> None:
    """As a hinge does; two stages of a telescope that a cable holds together latch at once."""
    system = System()
    for n in (1, 2):
        system.add(parts.Point(mass=1.0, position=(0.0, float(n), 0.0)), f"stage {n}")
        latch = {"latch": 0.5, "latch_stiffness": 200.0, "latch_damping": 5.0}
        pull = {"stiffness": 4.0 * n, "rest": 0.6}
        system.add(
            parts.JointSpring(a="ground", b=f"stage {n}", axis=(1.0, 0.0, 0.0), motion="translation", **pull, **latch),
            f"slide {n}",
        )
    system.add(parts.Joint(type="synchronization", joints=["slide 1", "slide 2"], stiffness=5e3, damping=10.0), "cable")
    found = run(system, np.linspace(0.0, 3.0, 7), method)
    one, two = (seen(found, f"slide {n}") for n in (1, 2))
    w = math.sqrt(12.0 / 2.0)  # of both
    assert one["latch_time"][-1] == pytest.approx(math.acos(1.0 / 6.0) / w, rel=5e-3)
    assert two["latch_time"][-1] == pytest.approx(one["latch_time"][-1], rel=5e-3)
    assert np.abs(found.energy_defect).max() < 1e-3
    lost = sum(float(part["damper_work"][-1]) for part in (one, two, seen(found, "cable")))
    lost += sum(float(part["latch_work"][-1]) for part in (one, two))
    assert lost == pytest.approx(found.balance.by_joints[-1] + found.balance.by_springs[-1], rel=2e-3)


# ------------------------------------------------------------------------------------------------ refusals


def test_refusals() -> None:
    """One line each, which names the part."""

    def refused(match: str, **added: parts.JointSpring | Any) -> None:
        system = wheel(start=0.1)
        system.add(parts.RigidBody(mass=1.0, inertia=0.1), "body")
        system.add(parts.Joint(a="body", b=(0.0, 0.0, 0.0)), "ball")
        for name, part in added.items():
            system.add(part, name)
        with pytest.raises(InputError, match=match) as found:
            system.assemble()
        assert "\n" not in str(found.value)

    turn: dict[str, Any] = {"torque": {"constant": 1.0}}
    refused("motor.joint is 'ball', a joint of type 'spherical'", motor=parts.Motor(joint="ball", **turn))
    refused("motor.joint is 'body', a RigidBody, which has no coordinate", motor=parts.Motor(joint="body", **turn))
    refused("motor has no torque", motor=parts.Motor(joint="hinge"))
    refused("motor has torque and law", motor=parts.Motor(joint="hinge", law="1.0", **turn))
    drive = parts.ConstantDrive(rate=0.0)
    refused("motor.position_gain and motor.velocity_gain are 0", motor=parts.Motor(joint="hinge", motion=drive))
    capped = parts.Motor(joint="hinge", motion=drive, position_gain=1.0, rate_limit=1.0)
    refused("motor.velocity_gain is 0; motor.rate_limit", motor=capped)
    refused("motor.rate_limit belongs to motor.motion", motor=parts.Motor(joint="hinge", rate_limit=1.0, **turn))
    refused(
        "cable.joints is .*; a synchronization needs two",
        cable=parts.Joint(type="synchronization", joints=["hinge"], stiffness=1),
    )
    both = parts.Joint(type="synchronization", joints=["hinge", "slot"], stiffness=1)
    refused(
        "cable.joints has both",
        slot=parts.JointSpring(a="ground", b="body", axis=(1.0, 0.0, 0.0), motion="translation"),
        cable=both,
    )
    wrong = parts.Joint(type="synchronization", joints=["hinge", "hinge 2"], ratios=(1.0, 0.0), stiffness=1)
    refused("none of them can be 0", **{"hinge 2": parts.JointSpring(a="ground", b="body"), "cable": wrong})
    stops = parts.JointSpring(
        a="ground", b="body", axis=(1.0, 0.0, 0.0), motion="translation", low=0.3, high=0.1, stop=1.0
    )
    refused("slot.low is 0.3 m, above slot.high, 0.1 m", slot=stops)
    refused("spring.joint is 'ball', a joint of type 'spherical'", spring=parts.JointSpring(joint="ball"))
    beside = parts.JointSpring(joint="ball", a="body")
    refused("spring.joint and spring.a are both given", spring=beside)
    beside = parts.JointSpring(joint="ball", axis=(0.0, 0.0, 1.0))
    refused("spring.axis and spring.joint, 'ball', are both given", spring=beside)
    refused("spring.b is missing", spring=parts.JointSpring(a="ground"))

    @evolvent.law
    def short(t, x):  # type: ignore[no-untyped-def]
        return t * x

    refused("motor.law is the law 'short' .*, which takes 2 arguments", motor=parts.Motor(joint="hinge", law=short))
