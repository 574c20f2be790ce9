"""Bearings: friction by reactions against closed forms, sticking, self-locking, energy balances, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import InputError, System, parts
from evolvent.solvers.static.static import solve_static
from resistances.rigs import IMPLICIT, run, seen

Array = np.ndarray
G, MASS, INERTIA, MU, RADIUS = 9.81, 3.0, (0.2, 0.3, 0.4), 0.1, 0.01
#: Ways to step: adaptive, and fixed.
STEPS: tuple[dict[str, Any], ...] = ({}, {"step": 1e-3})


def block(
    type_: str = "prismatic", *, gravity: Any = (0.0, 0.0, -G), axis: Any = (1.0, 0.0, 0.0), **keys: Any
) -> System:
    """A body on a joint of the ground; `keys` with a dot belong to the body, the others to the bearing."""
    own = {key[5:]: value for key, value in keys.items() if key.startswith("body_")}
    given = {"coefficient": MU, "bristle_stiffness": 1e5} | {k: v for k, v in keys.items() if not k.startswith("body_")}
    system, at = System(gravity=gravity), own.pop("at", (0.0, 0.0, 0.0))
    system.add(parts.RigidBody(**({"mass": MASS, "inertia": INERTIA} | own)), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=["body", at], type=type_, axis=axis), "joint")
    system.add(parts.Bearing(joint="joint", **given), "bearing")
    return system


# ------------------------------------------------------------------------------------------------ hinges


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("options", STEPS)
def test_a_rotor_in_its_journal(book: Book, method: str, options: dict[str, Any]) -> None:
    """It slows down by mu r N/J, N its weight, and with its mass beside the bearing by what both ends carry."""
    times, rate, errors = np.linspace(0.0, 1.0, 5), 2.0, []
    for beside, span in ((0.0, 0.1), (0.04, 0.1), (0.2, 0.1)):
        system = block(
            "revolute", journal_radius=RADIUS, span=span, body_angular_velocity=(rate, 0.0, 0.0),
            body_at=(-beside, 0.0, 0.0), body_position=(beside, 0.0, 0.0), bristle_stiffness=1e6,
        )  # fmt: skip
        found = run(system, times, method, **options)
        own, load = seen(found, "bearing"), MASS * G * max(1.0, 2.0 * beside / span)
        assert own["radial_force"] == pytest.approx(load, rel=1e-8)
        assert own["torque"][1:] == pytest.approx(MU * RADIUS * load, rel=1e-8)
        slowed = (rate - own["rate"][-1]) / times[-1] * INERTIA[0] / (MU * RADIUS * load)
        errors.append(abs(slowed - 1.0))
        assert np.abs(found.energy_defect).max() < 1e-11
        assert found.balance.by_friction[-1] == pytest.approx(own["friction_work"][-1], rel=1e-12)
    book(
        "Rigid bodies",
        f"Rotor in a journal bearing ({method}, {'fixed' if options else 'adaptive'} steps): deceleration",
        reference="mu r N/J", source="closed form, N of both ends of the bearing", error=max(errors),
        allowed=2e-5 if method == "energy" and not options else 1e-6,  # by the angle turned in a step
    )  # fmt: skip


@pytest.mark.parametrize("method", IMPLICIT)
def test_thrust_and_preload(method: str) -> None:
    """A rotor about the vertical rubs on its thrust face, by its weight and the preload."""
    keys: dict[str, Any] = {"thrust_radius": 0.02, "preload": 5.0, "journal_radius": 0.01, "span": 0.1}
    system = block("revolute", axis=(0.0, 0.0, 1.0), body_angular_velocity=(0.0, 0.0, 3.0), **keys)
    own = seen(run(system, [0.0, 0.5], method, step=5e-3), "bearing")
    torque = MU * 0.02 * (MASS * G + 5.0)
    assert own["torque"][-1] == pytest.approx(torque, rel=1e-9)
    assert own["axial_force"][-1] == pytest.approx(MASS * G, rel=1e-9)
    assert own["rate"][-1] == pytest.approx(3.0 - 0.5 * torque / INERTIA[2], rel=1e-6)


def pendulum(t: Array, length: float, rate: float, mu: float) -> Array:
    """Angle of a pendulum while it swings on from straight down: reactions by its acceleration, friction by these."""
    J = INERTIA[1] + MASS * length**2

    def rates(_: float, x: Array) -> list[float]:
        phi, w = x
        a = -MASS * G * length * math.sin(phi) / J
        for _ in range(60):
            along, across = MASS * (G * math.cos(phi) + length * w * w), MASS * (G * math.sin(phi) + length * a)
            a = -(MASS * G * length * math.sin(phi) + mu * 0.05 * math.hypot(along, across) * np.sign(w)) / J
        return [w, a]

    found = solve_ivp(rates, (0.0, t[-1]), (0.0, rate), t_eval=t, rtol=1e-12, atol=1e-13, method="DOP853")
    return np.asarray(found.y[0])


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_pendulum(method: str) -> None:
    """Its reactions and its friction depend on each other; second order in the step, towards the equation of motion."""
    length, rate, times = 0.4, 5.0, np.linspace(0.0, 0.2, 5)
    exact, off = pendulum(times, length, rate, 0.3), []
    for step in (2e-3, 1e-3):
        system = block(
            "revolute", axis=(0.0, 1.0, 0.0), journal_radius=0.05, span=0.1, coefficient=0.3, bristle_stiffness=1e9,
            body_at=(0.0, 0.0, length), body_position=(0.0, 0.0, -length), body_angular_velocity=(0.0, -rate, 0.0),
            body_velocity=(length * rate, 0.0, 0.0),
        )  # fmt: skip
        found = run(system, times, method, step=step)
        off.append(np.abs(-seen(found, "bearing")["angle"] - exact).max())
    assert off[1] < 2e-6
    assert math.log2(off[0] / off[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("method", IMPLICIT)
def test_capstan_of_a_pin(book: Book, method: str) -> None:
    """Masses on both strands of a pulley go on at one speed where T2/T1 = (1 + mu r/R)/(1 - mu r/R)."""
    R, r, mu, speed, depth = 0.1, 0.03, 0.4, 0.2, 1.0
    c = mu * r / R
    ratio = (1.0 + c) / (1.0 - c)

    def system(heavier: float, start: float) -> System:
        found = System(gravity=(0.0, -G, 0.0))
        found.add(
            parts.RigidBody(mass=1e-7, inertia=(1e-8, 1e-8, 1e-8), angular_velocity=(0.0, 0.0, -start / R)), "pulley"
        )
        found.add(parts.Joint(a=(0.0, 0.0, 0.0), b="pulley", type="revolute"), "pin")
        for side, sense, mass in ((1.0, -1, heavier), (-1.0, 1, 1.0)):
            name = "heavy" if side > 0.0 else "light"
            at = {"position": (side * R, -depth, 0.0), "velocity": (0.0, -side * start, 0.0)}
            found.add(parts.Point(mass=mass, **at), name)
            length = depth + 0.5 * math.pi * R
            cord: dict[str, Any] = {"length": length, "drum": R, "anchor": (0.0, 1.0, 0.0), "sense": sense}
            found.add(parts.Joint(a="pulley", b=name, type="link", **cord), f"strand {name}")
        keys = {"coefficient": mu, "journal_radius": r, "span": 0.05, "bristle_stiffness": 1e4}
        found.add(parts.Bearing(joint="pin", **keys), "bearing")
        return found

    found = run(system(ratio, speed), [0.0, 0.5], method, step=5e-3)
    rate = seen(found, "bearing")["rate"]
    error = abs(rate[-1] - rate[0]) * R / 0.5 / G
    book(
        "Rigid bodies", f"Pulley on a pin ({method}): acceleration at the ratio of pulls (1 + mu r/R)/(1 - mu r/R)",
        reference="0 g", source="capstan of a pin, closed form", error=error, allowed=1e-6,
    )  # fmt: skip
    for part, slides in ((0.97, False), (1.03, True)):
        one = seen(run(system(1.0 + part * (ratio - 1.0), 0.0), [0.0, 0.4, 0.5], method, step=1e-3), "bearing")
        assert (abs(one["angle"][2] - one["angle"][1]) > 1e-3) == slides
        assert (abs(one["torque"][-1]) < 0.999 * one["torque_limit"][-1]) != slides


# ------------------------------------------------------------------------------------------------ slides


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("options", STEPS)
def test_a_block_on_an_incline(book: Book, method: str, options: dict[str, Any]) -> None:
    """It slides where the slope is above mu, at g (sin - mu cos), and rests below."""
    mu, times = 0.3, np.linspace(0.0, 0.5, 6)

    def system(slope: float, **keys: Any) -> System:
        gravity = (G * math.sin(slope), 0.0, -G * math.cos(slope))
        return block(gravity=gravity, coefficient=mu, span=0.2, **({"bristle_stiffness": 1e5} | keys))

    below = 0.97 * math.atan(mu)
    still = seen(run(system(below), times, method, **options), "bearing")
    force = MASS * G * math.sin(below)
    assert np.abs(still["travel"]).max() < 2e-3
    assert np.abs(np.diff(still["travel"][2:])).max() < 1e-5
    assert still["force"][-1] == pytest.approx(force, rel=1e-3)
    slope, v = math.atan(mu) + 0.3, 0.5
    found = run(system(slope, body_velocity=(v, 0.0, 0.0), bristle_stiffness=1e8), times, method, **options)
    own = seen(found, "bearing")
    exact = G * (math.sin(slope) - mu * math.cos(slope))
    error = np.abs((own["rate"][1:] - v) / times[1:] / exact - 1.0).max()
    book(
        "Rigid bodies",
        f"Block above the angle of friction ({method}, {'fixed' if options else 'adaptive'} steps): acceleration",
        reference="g (sin - mu cos)", source="closed form", error=error, allowed=1e-6,
    )  # fmt: skip
    assert np.abs(found.energy_defect).max() < 1e-11


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("offset", [0.95, 1.05])
def test_a_drawer_jams(method: str, offset: float) -> None:
    """Pulled beside its guide by more than span/(2 mu) it locks itself, however hard the pull is."""
    mu, span, pull = 0.4, 0.2, 50.0
    e = offset * span / (2.0 * mu)
    for force in (pull, 100.0 * pull):
        system = block(gravity=(0.0, 0.0, 0.0), coefficient=mu, span=span, bristle_stiffness=1e7)
        system.add(parts.Load(at=["body", (0.0, e, 0.0)], force=(force, 0.0, 0.0)), "pull")
        own = seen(run(system, [0.0, 0.1, 0.15], method, step=2e-3), "bearing")
        assert own["tilting_moment"][-1] == pytest.approx(force * e, rel=1e-6)
        assert own["radial_force"][-1] == pytest.approx(2.0 * force * e / span, rel=1e-6)
        gained = (own["rate"][2] - own["rate"][1]) / 0.05 * MASS / force
        assert gained == pytest.approx(max(0.0, 1.0 - offset), abs=1e-3 if offset > 1.0 else 1e-6)
        if offset > 1.0:
            assert own["force"][-1] == pytest.approx(force, rel=1e-2)
            assert own["force_limit"][-1] == pytest.approx(offset * force, rel=1e-6)


@pytest.mark.parametrize("method", IMPLICIT)
def test_rails_carry_a_moment_about_the_axis(method: str) -> None:
    """A weight beside a slide with two rails: 2 M/width beside the weight."""
    system = block(
        body_velocity=(1.0, 0.0, 0.0), body_at=(0.0, -0.3, 0.0), span=0.2, width=0.15, body_position=(0.0, 0.3, 0.0)
    )
    own = seen(run(system, [0.0, 0.1], method, step=5e-3), "bearing")
    force, weight = 0.0, MASS * G
    for _ in range(60):  # which slows the mass beside the slide
        force = MU * (2.0 * math.hypot(0.5 * weight, force * 0.3 / 0.2) + 2.0 * weight * 0.3 / 0.15)
    assert own["force"][-1] == pytest.approx(force, rel=1e-9)


# ------------------------------------------------------------------------------------------------ sticking


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("options", STEPS)
def test_it_breaks_away(method: str, options: dict[str, Any]) -> None:
    """Under a pull that grows, at the static friction, then against the kinetic one."""
    static, kinetic, growth = 0.3, 0.2, 20.0
    system = block(coefficient=kinetic, static_coefficient=static, bristle_stiffness=1e5, span=0.2)
    system.add(parts.Load(at="body", direction=(1.0, 0.0, 0.0), profile=[[0.0, 0.0], [1.0, growth]]), "pull")
    times = np.linspace(0.0, 0.8, 81)
    own = seen(run(system, times, method, **options), "bearing")
    when = static * MASS * G / growth
    before, after = times < when - 5e-3, times > when + 2e-2
    lag = 0.5 * options.get("step", 0.0) if method == "energy" else 0.0  # whose forces are means over a step
    assert own["force"][before][2:] == pytest.approx(growth * (times[before][2:] - lag), abs=0.3)  # the bristle swings
    assert np.abs(own["travel"][before]).max() < 1.2e-4  # of the bristle
    exact = (0.5 * growth * (times**2 - when**2) - kinetic * MASS * G * (times - when)) / MASS
    assert own["rate"][after] == pytest.approx(exact[after], abs=1e-2)
    assert own["force"][after] == pytest.approx(kinetic * MASS * G, rel=1e-6)


@pytest.mark.parametrize("method", IMPLICIT)
def test_stick_and_slip(method: str) -> None:
    """A block that a spring draws along: it slips over and over, each time from the static friction on."""
    static, kinetic, k, v = 0.3, 0.2, 200.0, 0.1
    system = block(coefficient=kinetic, static_coefficient=static, bristle_stiffness=1e6, span=0.2)
    system.add(parts.JointSpring(joint="joint"), "spring")
    drive = parts.ConstantDrive(rate=v)
    system.add(parts.Motor(joint="spring", motion=drive, position_gain=k), "drawn")
    times = np.linspace(0.0, 3.0, 601)
    found = run(system, times, method)
    own = seen(found, "bearing")
    rate, force = own["rate"], own["force"]
    assert force.max() == pytest.approx(static * MASS * G, rel=2e-2)
    w, drop = math.sqrt(k / MASS), (static - kinetic) * MASS * G
    assert rate.max() == pytest.approx(v + math.hypot(v, drop / math.sqrt(k * MASS)), rel=2e-2)
    # stuck while the spring takes up twice the drop, slips over pi + 2 atan(v w/...) of its swing
    slip = 2.0 * (math.pi - math.atan(drop / (math.sqrt(k * MASS) * v))) / w
    period = 2.0 * drop / (k * v) + slip
    starts = times[1:][(rate[1:] > 0.02) & (rate[:-1] <= 0.02)]
    assert np.diff(starts) == pytest.approx(period, rel=2e-2)
    assert np.abs(found.energy_defect).max() < 1e-3 * found.balance.by_friction[-1]


@pytest.mark.parametrize("step", [0.02, 0.002])
def test_the_balance_closes_at_long_steps(step: float) -> None:
    """Of a spatial pendulum in a bearing, under energy-momentum without numerical damping."""
    system = block(
        "revolute", axis=(0.0, 1.0, 0.0), journal_radius=0.05, thrust_radius=0.08, span=0.1, coefficient=0.3,
        static_coefficient=0.4, body_at=(0.0, 0.1, 0.4), body_position=(0.0, -0.1, -0.4),
        body_angular_velocity=(0.0, -5.0, 0.0), body_velocity=(2.0, 0.0, 0.0), gravity=(0.0, 2.0, -G),
        body_inertia=[[0.2, 0.02, 0.01], [0.02, 0.3, 0.0], [0.01, 0.0, 0.4]], bristle_stiffness=1e4,
    )  # fmt: skip
    found = run(system, np.linspace(0.0, 2.0, 5), "energy", step=step)
    assert np.abs(found.energy_defect).max() < 1e-12 * found.energy[0]
    assert found.balance.by_friction[-1] > 0.3
    assert np.all(np.diff(found.balance.by_friction) >= 0.0)


def test_equilibrium() -> None:
    """A pendulum that friction holds beside its lowest position, and one of a soft joint alike."""
    for joint in ({}, {"stiffness": 1e6, "rotational_stiffness": 1e4}):
        system = System(gravity=(0.0, 0.0, -G))
        system.add(parts.RigidBody(mass=MASS, inertia=INERTIA, position=(0.0, 0.0, -0.4)), "body")
        system.add(parts.Joint(a=(0, 0, 0), b=["body", (0, 0, 0.4)], type="revolute", axis=(0, 1, 0), **joint), "pivot")
        keys = {"coefficient": MU, "journal_radius": 0.05, "span": 0.1, "bristle_stiffness": 1e6}
        system.add(parts.Bearing(joint="pivot", **keys), "bearing")
        system.add(parts.Load(at="body", torque=(0.0, -0.5, 0.0)), "load")
        found = solve_static(system.assemble())
        assert found.success, found.message
        torque = MU * 0.05 * MASS * G
        own = seen(found, "bearing")
        assert own["torque"][-1] == pytest.approx(-torque, rel=1e-3)
        assert math.sin(-own["angle"][-1]) == pytest.approx((0.5 - torque) / (MASS * G * 0.4), rel=1e-3)


# ------------------------------------------------------------------------------------------------ refusals


REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("spherical", {}, r"bearing\.joint is 'joint', a joint of type 'spherical'; a bearing needs one of type"),
    ("revolute", {}, r"bearing has no radius; give bearing\.journal_radius, bearing\.thrust_radius, or both"),
    ("revolute", {"width": 1.0}, r"bearing\.width belongs to a joint of type 'prismatic', but 'joint' is of type"),
    ("prismatic", {"journal_radius": 0.1}, r"bearing\.journal_radius belongs to a joint of type 'revolute'"),
    ("revolute", {"journal_radius": 0.1, "preload": 3.0}, r"bearing\.preload acts along the axis of a hinge; it needs"),
    ("prismatic", {"static_coefficient": 0.05}, r"bearing\.static_coefficient is 0\.05, below bearing\.coeffic"),
    ("prismatic", {"bristle_stiffness": "3 N m/rad"}, r"bearing\.bristle_stiffness is 3 N m/rad, but its coordinate"),
    ("prismatic", {"joint": "body"}, r"bearing\.joint is 'body', a RigidBody; a bearing needs a joint of type"),
]  # fmt: skip


@pytest.mark.parametrize(("type_", "keys", "sentence"), REFUSED)
def test_refusals(type_: str, keys: dict[str, Any], sentence: str) -> None:
    system = System()
    system.add(parts.RigidBody(mass=MASS, inertia=INERTIA), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="body", type=type_), "joint")
    system.add(parts.Bearing(**({"joint": "joint", "coefficient": MU} | keys)), "bearing")
    with pytest.raises(InputError, match=sentence):
        system.assemble()


def test_two_bearings_of_a_joint_are_refused() -> None:
    system = block()
    system.add(parts.Bearing(joint="joint", coefficient=0.2), "second")
    with pytest.raises(InputError, match=r"'bearing' and 'second' are both bearings of the joint 'joint'"):
        system.assemble()


def test_explicit_methods_are_refused() -> None:
    with pytest.raises(InputError, match=r"'bearing' is a bearing, which rk4, heun and dopri5 do not support"):
        run(block(), [0.0, 1.0], "rk4")
