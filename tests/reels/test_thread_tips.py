"""The end of a thread as a point of joints, springs, points and forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, System, parts

R = 0.05
RATE = (0.0, 0.0, 0.3)
METHODS: dict[str, dict[str, Any]] = {
    "rk4": {"step": 1e-3},
    "generalized-alpha": {"step": 1e-3, "spectral_radius": 1.0},
}


def ship(*, out: float = 1.0, rate: float = 0.0, turn: Any = RATE, **thread: Any) -> System:
    """A free ship with a tether of 2 m along x, of which some is out; its outer end is at (0.5 + out, 0.1, 0)."""
    system = System()
    system.add(parts.RigidBody(mass=40.0, inertia=(3.0, 4.0, 5.0), angular_velocity=turn), "ship")
    drive = parts.ConstantDrive(rate=rate, angle=out / R)
    system.add(parts.Reel(body="ship", radius=R, centre=(0.5, 0.1, -R), drive=drive), "reel")
    given = {"length": 2.0, "line_density": 0.05, "nodes": 4, "stiffness": 2000.0, "damping": 0.5, "tip_mass": 0.3}
    system.add(parts.Thread(**({"reel": "reel"} | given | thread)), "tether")
    return system


def satellite() -> parts.RigidBody:
    moving = {"position": (1.6, 0.1, 0.0), "velocity": (-0.03, 0.55, 0.0), "points": {"hook": (-0.1, 0.0, 0.0)}}
    return parts.RigidBody(mass=5.0, inertia=(0.1, 0.2, 0.25), angular_velocity=RATE, **moving)


def simulated(system: System, method: str, until: float = 1.5) -> Any:
    return system.simulate(until=until, every=0.25, method=method, **METHODS[method])


def with_end(end: str, *, rate: float = 1.0) -> System:
    """The satellite fixed by `Thread.end`, or by a joint: to its hook, or to itself, whose point is then the tip."""
    found = System()
    for name, part in ship(rate=rate).parts.items():
        if name == "tether":
            found.add(satellite(), "satellite")
            if end == "end":
                part = part.model_copy(update={"end": "satellite.hook"})
        found.add(part, name)
    if end != "end":
        ends = {"hook": ("tether.tip", "satellite.hook"), "alone": ("satellite", "tether.tip")}[end]
        found.add(parts.Joint(a=ends[0], b=ends[1]), "joint")
    return found


@pytest.mark.parametrize("method", METHODS)
def test_a_spherical_joint_is_the_end_of_the_thread(method: str) -> None:
    """The same state at all times; the force on point b is the thread's pull, or its reaction."""
    found = {end: simulated(with_end(end), method) for end in ("end", "hook", "alone")}
    for end, sign in (("hook", 1.0), ("alone", -1.0)):
        for variable in ("satellite/position", "tether/position", "tether/tension"):
            np.testing.assert_allclose(found[end][variable], found["end"][variable], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found[end]["joint/force"], sign * found["end"]["tether/end_force"], atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_point_at_the_tip_is_a_tip_mass(method: str) -> None:
    """A mass by `Point.at` moves as one by `tip_mass`."""
    whole, joined = ship(rate=1.0, tip_mass=0.8), ship(rate=1.0)
    joined.add(parts.Point(mass=0.5, at="tether.tip"), "mass")
    runs = [simulated(system, method) for system in (whole, joined)]
    np.testing.assert_allclose(runs[1]["tether/tip_position"], runs[0]["tether/tip_position"], atol=2e-6)
    np.testing.assert_allclose(runs[1]["mass/position"], runs[1]["tether/tip_position"], atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_spring_at_the_tip(method: str, book: Book) -> None:
    """Ground, spring, tip, thread of one segment, ground: m x'' = F - (c + k) x; the force F acts from the start."""
    k, c, m, rho, F = 30.0, 20.0, 1.5, 0.2, 0.6
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="hub", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    thread = parts.Thread(reel="reel", length=1.0, line_density=rho, nodes=1, stiffness=c, tip_mass=m)
    system.add(thread, "thread")
    system.add(parts.Spring(a="thread.tip", b=(2.0, 0.0, 0.0), stiffness=k), "spring")
    system.add(parts.Load(at="thread.tip", force=(F, 0.0, 0.0)), "push")
    run = simulated(system, method, until=3.0)
    w = np.sqrt((c + k) / (m + 0.5 * rho))
    exact = F / (c + k) * (1.0 - np.cos(w * run["time"].values))
    error = np.abs(run["thread/tip_position"].values[:, 0] - 1.0 - exact).max() / exact.max()
    book(
        "Threads, reels, tethers", f"spring and force at the end of a thread ({method})", reference="closed form",
        source="oscillator of one mass on two springs", error=error, allowed=1e-7 if method == "rk4" else 1e-3,
    )  # fmt: skip
    assert np.abs(run["energy_defect"]).max() < 1e-5
    np.testing.assert_allclose(run["thread/energy_kinetic"], run["energy_kinetic"], atol=1e-12)


def test_other_joints_at_the_tip() -> None:
    """Held at a distance, on a line and in a plane, as constraints between the tip and the ground."""
    for kind in ("distance", "point-on-line", "in-plane"):
        system = ship(turn=(0.0, 0.0, 0.0))
        system.add(parts.Load(at="tether.tip", force=(0.5, 1.0, 0.0)), "push")
        place = (1.5, 0.1, -1.0) if kind == "distance" else (1.5, 0.1, 0.0)
        system.add(parts.Joint(a=place, b="tether.tip", type=kind, axis=(0.0, 1.0, 0.0)), "joint")
        tip = simulated(system, "generalized-alpha", 0.5)["tether/tip_position"].values
        off = {
            "distance": np.linalg.norm(tip - place, axis=1) - 1.0,
            "point-on-line": (tip - place)[:, [0, 2]],
            "in-plane": (tip - place)[:, 1],
        }[kind]
        assert np.abs(off).max() < 1e-7
        assert np.linalg.norm(tip[-1] - tip[0]) > 1e-3


def test_refusals() -> None:
    def refused(words: str, part: Any, **thread: Any) -> None:
        system = ship(**thread)
        system.add(part, "p")
        with pytest.raises(InputError, match=words):
            system.assemble()

    ground = (1.5, 0.1, 0.0)
    for kind in ("revolute", "universal", "clamp", "prismatic", "cylindrical"):
        refused(f"p.type is '{kind}', but p.b is 'tether.tip', the end of a thread, which has no rotation; use type "
                "'spherical', or join a body to it", parts.Joint(a=ground, b="tether.tip", type=kind))  # fmt: skip
    refused("p.a is 'tether.tip', the end of a thread, to which no axis can be fixed; give it as p.b",
            parts.Joint(a="tether.tip", b=ground, type="in-plane"))  # fmt: skip
    refused("two points are .* m apart", parts.Joint(a="tether.tip", b=(3.0, 0.0, 0.0)))
    refused("on the body of 'reel' itself", parts.Joint(a="tether.tip", b="ship"))
    spring = parts.Spring(a="tether.tip", b=(3.0, 0.0, 0.0), stiffness=1.0)
    refused("p.a is 'tether.tip', but nothing of 'tether' is out", spring, out=0.0)
    refused("p.a is 'tether.tip'; it needs tether.segments 'springs'", spring, segments="inextensible")
    refused("p.at is 'tether.tip'; it must be a node of a beam or rod; for other points add a Joint",
            parts.RigidBody(mass=1.0, inertia=1.0, at="tether.tip"))  # fmt: skip
    refused("'tether' is a Thread, not a body, point or beam; its end is 'tether.tip'",
            parts.Spring(a="tether[1]", b=(3.0, 0.0, 0.0), stiffness=1.0))  # fmt: skip
