"""Joints that are released beside others: the rank of the constraints is found again, the motion goes on as it should.

The model of every hold-down is a hinge and a second joint between the same two parts, which is released. Before that
their constraints repeat one another; what is left afterwards does not, or in another way.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import System, elements, parts
from evolvent.solvers import Solution
from evolvent.solvers.common.sizes import sizes
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

Array = np.ndarray
G, ORIGIN, Z = 9.81, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ALPHA, ENERGY = "generalized-alpha", "energy-momentum"
#: Methods, adaptive and with a fixed step.
WAYS = [pytest.param(m, h, id=f"{m}, {h or 'adaptive'}") for m in (ALPHA, ENERGY) for h in (None, 4e-3)]
#: A panel of 1 m on a hinge at its edge: mass, moment of inertia about its centre and about the hinge.
MASS, OWN = 2.0, 0.4
ABOUT = OWN + 0.25 * MASS
STIFFNESS, REST = 3.0, 0.8


def panel(*more: tuple[Any, str], gravity: tuple[float, float, float] = ORIGIN, stiffness: float = STIFFNESS) -> System:
    """A panel on a hinge with a torsion spring, at rest, and what holds it down."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(mass=MASS, inertia=(0.3, 0.2, OWN), position=(0.5, 0.0, 0.0)), "panel")
    system.add(parts.Joint(a="ground", b=("panel", (-0.5, 0.0, 0.0)), type="revolute", axis=Z), "hinge")
    system.add(parts.JointSpring(joint="hinge", stiffness=stiffness, rest=REST), "spring")
    for part, name in more:
        system.add(part, name)
    return system


def hold(kind: str, x: float, **release: Any) -> parts.Joint:
    """A joint between the panel and the ground at x along it."""
    return parts.Joint(a=(x, 0.0, 0.0), b=("panel", (x - 0.5, 0.0, 0.0)), type=kind, axis=Z, **release)


def swung(t: Array, released: float) -> Array:
    """Angle of the panel, which a spring turns from rest."""
    w = math.sqrt(STIFFNESS / ABOUT)
    return np.where(t > released, REST * (1.0 - np.cos(w * (t - released))), 0.0)


def run(system: System, end: float, method: str, step: float | None, tolerance: float = 1e-4) -> Any:
    """A run of 50 samples a second; the tolerance is that of adaptive steps."""
    return system.simulate(
        until=end, every=0.02, method=method, **({"tolerance": tolerance} if step is None else {"step": step})
    )


def check_energy(found: Any, allowed: float = 2e-4) -> None:
    """The balance closes."""
    assert np.abs(found["energy_defect"]).max() < allowed * max(np.abs(found["energy"]).max(), 0.1)


def ranks(found: Any) -> tuple[int, int]:
    """Rank and number of the constraints while they repeat one another."""
    statistics = found.attrs["statistics"]
    statistics = json.loads(statistics) if isinstance(statistics, str) else statistics
    return statistics["rank"], statistics["constraints"]


# ------------------------------------------------------------------------------------------------ hold-downs

HOLDS = {
    "a clamp": ([(hold("clamp", 1.0, until=1.0), "hold")], (6, 11)),
    "a clamp at the hinge": ([(hold("clamp", 0.0, until=1.0), "hold")], (6, 11)),
    "a spherical joint elsewhere": ([(hold("spherical", 0.8, until=1.0), "hold")], (6, 8)),
    "a second hinge": ([(hold("revolute", 0.8, until=1.0), "hold")], (6, 10)),
    "an event": (
        [(parts.Event(law="t - 1"), "clock"), (hold("clamp", 1.0, released_by="clock"), "hold")], (6, 11),
    ),
    "two, one after the other": (
        [(hold("clamp", 1.0, until=0.4), "first"), (hold("spherical", 0.6, until=1.0), "hold")], (6, 14),
    ),
    "two at once": (
        [(hold("clamp", 1.0, until=1.0), "first"), (hold("spherical", 0.6, until=1.0), "hold")], (6, 14),
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), WAYS)
@pytest.mark.parametrize("kind", HOLDS)
def test_a_panel_opens_when_its_hold_down_is_released(kind: str, method: str, step: float | None) -> None:
    """theta = rest (1 - cos w t) from the release on, w^2 = k/J; before it nothing moves."""
    more, rank = HOLDS[kind]
    found = run(panel(*more), 2.0, method, step, tolerance=1e-6)
    t = found["time"].values
    assert ranks(found) == rank
    assert found["hinge"].angle.values == pytest.approx(swung(t, 1.0), abs=3e-4)
    check_energy(found)
    for _, name in more:
        if name not in found.children or "closed" not in found[name]:
            continue
        closed = found[name].closed.values
        assert closed[t < (0.39 if name == "first" and rank == (6, 14) and kind.startswith("two, ") else 0.99)].all()
        for value in (found[name].force, found[name].moment):
            assert np.abs(value.values[closed == 0]).max() == 0.0
    w, a = math.sqrt(STIFFNESS / ABOUT), found["hinge"].angle.values
    rate, turn = REST * w * np.sin(w * (t - 1.0)), REST * w * w * np.cos(w * (t - 1.0))
    radial, across = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    wanted = 0.5 * MASS * (turn * across - rate**2 * radial)
    late = t > 1.05
    assert found["hinge"].force.values[late][:, :2] == pytest.approx(wanted.T[late], abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), WAYS)
def test_reactions_of_the_hold_are_those_of_least_norm(method: str, step: float | None) -> None:
    """Of all forces and moments of hinge and clamp that carry weight and spring, those reported are the least."""
    system = panel((hold("clamp", 1.0, until=0.5), "hold"), gravity=(1.0, -2.0, -3.0))
    found = run(system, 0.6, method, step)
    length = float(sizes(system.assemble())[0].max())
    columns, weight = [], []
    for x, turns in ((0.0, np.eye(3)[:2]), (1.0, np.eye(3))):
        arm = np.array([x - 0.5, 0.0, 0.0])
        columns += [np.append(e, np.cross(arm, e)) for e in np.eye(3)] + [np.append(np.zeros(3), e) for e in turns]
        weight += [1.0] * 3 + [1.0 / length] * len(turns)
    load = np.array([-1.0 * MASS, 2.0 * MASS, 3.0 * MASS, 0.0, 0.0, -STIFFNESS * REST])
    least = np.linalg.lstsq(np.array(columns).T / weight, load, rcond=None)[0] / weight
    at = int(np.argmin(np.abs(found["time"].values - 0.3)))
    given = [found[name][key].values[at] for name in ("hinge", "hold") for key in ("force", "moment")]
    given[1] = given[1][:2]
    assert np.concatenate(given) == pytest.approx(least, rel=1e-3, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", [ALPHA, ENERGY])
def test_a_long_hold_stays_where_it_is(method: str) -> None:
    """Steps grow while nothing moves: what is held twice does not yield by a compliance that grows with them."""
    system = panel((hold("clamp", 1.0, until=500.0), "hold"), gravity=(0.0, -G, 0.0))
    found = system.simulate(until=501.0, every=0.5, method=method)
    t, x = found["time"].values, found["panel"].position.values
    assert np.abs(x[t <= 500.0] - [0.5, 0.0, 0.0]).max() < 1e-8
    at = found["hold"].force.values[t < 499.0] + found["hinge"].force.values[t < 499.0]
    assert at == pytest.approx(np.tile([0.0, MASS * G, 0.0], (len(at), 1)), abs=1e-3)
    swing = solve_ivp(
        lambda _, z: [z[1], (STIFFNESS * (REST - z[0]) - 0.5 * MASS * G * math.cos(z[0])) / ABOUT],
        (0.0, 1.0), [0.0, 0.0], "DOP853", t[t >= 500.0] - 500.0, rtol=1e-11, atol=1e-12,
    ).y[0]  # fmt: skip
    assert found["hinge"].angle.values[t >= 500.0] == pytest.approx(swing, abs=2e-3)


# ------------------------------------------------------------------------------------------------ in motion


def pair(**release: Any) -> System:
    """Two panels that swing as one on a hinge, until a clamp between them is released."""
    system = panel(gravity=(0.0, -G, 0.0), stiffness=0.0)
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.2), position=(1.4, 0.0, 0.0)), "outer")
    system.add(parts.Joint(a="panel", b=("outer", (-0.4, 0.0, 0.0)), type="revolute", axis=Z), "knee")
    if "released_by" in release:
        where = {"y": "outer.position.y"}
        system.add(parts.Event(law="-0.5 - y", variables=where), release["released_by"])
    system.add(parts.Joint(a="panel", b=("outer", (0.0, 0.3, 0.0)), type="clamp", **release), "hold")
    return system


def double_pendulum(t: Array, released: Callable[[float], float] | float) -> tuple[Array, float]:
    """Angles of both panels from the horizontal at t, and the time of the release, by Lagrange's equations."""
    m1, I1, c1, l1, m2, I2, c2 = MASS, OWN, 0.5, 1.0, 1.0, 0.2, 0.4

    def free(_: float, z: Array) -> list[float]:
        a, b, u, v = z
        M = np.array(
            [
                [I1 + m1 * c1**2 + m2 * l1**2, m2 * l1 * c2 * math.cos(a - b)],
                [m2 * l1 * c2 * math.cos(a - b), I2 + m2 * c2**2],
            ]
        )
        s = m2 * l1 * c2 * math.sin(a - b)
        f = [-s * v * v - G * (m1 * c1 + m2 * l1) * math.cos(a), s * u * u - G * m2 * c2 * math.cos(b)]
        return [u, v, *np.linalg.solve(M, f)]

    whole = I1 + m1 * c1**2 + I2 + m2 * (l1 + c2) ** 2

    def stiff(_: float, z: Array) -> list[float]:
        turn = -G * (m1 * c1 + m2 * (l1 + c2)) * math.cos(z[0]) / whole
        return [z[2], z[3], turn, turn]

    start, until = np.zeros(4), 10.0
    events = None
    if callable(released):
        events = lambda _, z: released(z[0])  # noqa: E731
        events.terminal = True  # type: ignore[attr-defined]
    else:
        until = released
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}
    first = solve_ivp(stiff, (0.0, until), start, dense_output=True, events=events, **options)
    until = first.t[-1]
    second = solve_ivp(free, (until, t[-1]), first.y[:, -1], dense_output=True, **options)
    return np.where(t <= until, first.sol(np.minimum(t, until)), second.sol(np.maximum(t, until)))[:2], until


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), WAYS)
@pytest.mark.parametrize("by", ["time", "event"])
def test_what_swings_as_one_goes_on_as_two(by: str, method: str, step: float | None) -> None:
    """Both panels against the equations of a double pendulum, from a release in motion on."""
    release = {"until": 0.4} if by == "time" else {"released_by": "low"}
    found = run(pair(**release), 1.2, method, step, tolerance=1e-6)
    t = found["time"].values
    angles, until = double_pendulum(t, 0.4 if by == "time" else lambda a: -0.5 - 1.4 * math.sin(a))
    assert found["hinge"].angle.values == pytest.approx(angles[0], abs=1e-3)
    assert found["knee"].angle.values == pytest.approx(angles[1] - angles[0], abs=2e-3)
    assert np.all(found["hold"].force.values[t > until + 1e-3] == 0.0)
    check_energy(found)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), WAYS)
def test_a_link_beside_a_released_joint(method: str, step: float | None) -> None:
    """A bob on a link and on a joint to the ground is a pendulum once the joint is released."""
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=ORIGIN, b="bob", type="link"), "link")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b="bob", until=0.5), "hold")
    found = run(system, 1.5, method, step, tolerance=1e-6)
    t = found["time"].values
    swing = solve_ivp(
        lambda _, z: [z[1], -G * math.cos(z[0])], (0.0, 1.0), [0.0, 0.0], "DOP853", dense_output=True,
        rtol=1e-11, atol=1e-12,
    ).sol(np.maximum(t - 0.5, 0.0))  # fmt: skip
    assert ranks(found) == (3, 4)
    assert found["bob"].position.values[:, :2] == pytest.approx(
        np.array([np.cos(swing[0]), np.sin(swing[0])]).T, abs=1e-3
    )
    late = t > 0.55
    tension = swing[1] ** 2 - G * np.sin(swing[0])
    assert found["link"].tension.values[late] == pytest.approx(
        tension[late], abs=0.5 if method == ENERGY else 0.02
    )  # means over steps
    check_energy(found)


# ------------------------------------------------------------------------------------------------ beams


def solved(system: System, start: Array | None, times: Array, method: str, step: float) -> Solution:
    """A run at solver level, from the coordinates and velocities `start`."""
    assembly = system.assemble()
    if start is not None:
        y = assembly.y.copy()
        y[: start.size] = start
        assembly = dataclasses.replace(assembly, y=y)
    solver = solve_implicit if method == ALPHA else solve_energy
    found = solver(assembly, samples=times, step=step)
    assert found.success, found.message
    return found


@pytest.mark.slow
@pytest.mark.parametrize("method", [ALPHA, ENERGY])
@pytest.mark.parametrize("at", ["root", "tip"])
def test_a_beam_goes_on_without_its_clamp(at: str, method: str) -> None:
    """A beam on a hinge and a clamp, against a run of the hinge alone that starts in the state of the release."""

    def beam(clamped: bool) -> System:
        system = System(gravity=(0.0, -G, 0.0))
        steel = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0)
        section = elements.Rectangle(thickness=0.02, width=0.02)
        system.add(parts.Beam(length=1.0, elements=4, section=section, material=steel), "boom")
        system.add(parts.Joint(a=ORIGIN, b="boom.root", type="revolute", axis=Z), "hinge")
        if clamped:
            place = ORIGIN if at == "root" else (1.0, 0.0, 0.0)
            system.add(parts.Joint(a=place, b=f"boom.{at}", type="clamp", until=0.1), "hold")
        return system

    times = np.linspace(0.0, 0.2, 9)  # a step of 1 ms does not resolve what the released moment sets off
    found = solved(beam(True), None, times, method, 2.5e-4)
    n = int(found.assembly.model.info.nq + found.assembly.model.info.nv)
    alone = solved(beam(False), found.y[4, :n], times[4:] - 0.1, method, 2.5e-4)
    tip = slice(found.assembly.model.info.nq - 6, found.assembly.model.info.nq - 3)
    assert np.abs(found.y[:5, tip] - found.y[0, tip]).max() > (1e-3 if at == "root" else -1.0)
    assert found.y[4:, tip] == pytest.approx(alone.y[:, tip], abs=2e-3)
    rows = found.assembly.model.constraints["until"] < 1.0
    assert np.all(found.la[5:, rows] == 0.0)
    assert np.abs(found.energy_defect).max() < 2e-2 * np.abs(found.energy).max()  # numerical damping of what rings


# ------------------------------------------------------------------------------------------------ latches


def array(latched: bool) -> System:
    """Two panels, the outer one clamped to the inner one until the latch of the first hinge locks; or from then on."""
    system, lock = System(), {"latch": 0.5, "latch_stiffness": 200.0}
    system.add(parts.RigidBody(mass=MASS, inertia=(0.3, 0.2, OWN), position=(0.5, 0.0, 0.0)), "panel")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.2), position=(1.4, 0.0, 0.0)), "outer")
    system.add(parts.Joint(a="ground", b=("panel", (-0.5, 0.0, 0.0)), type="revolute", axis=Z), "hinge")
    system.add(parts.Joint(a="panel", b=("outer", (-0.4, 0.0, 0.0)), type="revolute", axis=Z), "knee")
    system.add(parts.JointSpring(joint="hinge", stiffness=STIFFNESS, rest=REST, **({} if latched else lock)), "spring")
    system.add(parts.JointSpring(joint="knee", stiffness=2.0, rest=0.6), "other")
    if latched:
        system.add(parts.JointSpring(joint="hinge", stiffness=200.0, rest=0.5), "lock")
    else:
        system.add(parts.Joint(a="panel", b=("outer", (0.0, 0.3, 0.0)), type="clamp", released_by="spring"), "hold")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("method", [ALPHA, ENERGY])
def test_a_release_together_with_a_latch(method: str) -> None:
    """Against a run from the state in which the latch locks, with a spring in its place and without the clamp."""
    (when,) = solved(array(False), None, np.linspace(0.0, 2.0, 3), method, 1e-3).event_times
    whole = ABOUT + 0.2 + 1.4**2
    assert when == pytest.approx(math.acos(1.0 - 0.5 / REST) / math.sqrt(STIFFNESS / whole), abs=1e-4)
    later = when + np.linspace(0.0, 1.0, 21)
    found = solved(array(False), None, np.append(0.0, later), method, 1e-3)
    n = int(found.assembly.model.info.nq + found.assembly.model.info.nv)
    alone = solved(array(True), found.y[1, :n], later - when, method, 1e-3)
    assert found.y[1:, :14] == pytest.approx(alone.y[:, :14], abs=1e-3)
    hold = np.isfinite(found.assembly.model.constraints["until"])
    assert hold.sum() == 6
    assert np.all(found.la[2:, hold] == 0.0)
    assert np.abs(found.energy_defect).max() < 2e-4 * np.abs(found.energy).max()


# ------------------------------------------------------------------------------------------------ yo-yo


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), [*WAYS, pytest.param("rk4", 5e-4, id="rk4")])
def test_yo_yo_with_a_late_release(method: str, step: float | None) -> None:
    """Masses on cords, held on the drum for 0.3 s: with A = R^2 + I/m both invariants of the motion give the rate by l.

    A w + l^2 u and A w^2 + l^2 u^2 stay, u the rate at which the free part of a cord turns; from l0 and w = u = w0 on.
    Without l0 that is Fedor's w = w0 (A - l^2)/(A + l^2) (validation.md).
    """
    inertia, drum, mass, spin, free, total = 300.0, 1.5, 3.0, 5.0, 0.05, 12.0
    A, release = drum**2 + inertia / (2.0 * mass), 0.3
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=inertia, rate=spin), "body")
    wound = (total - free) / drum
    for k, side in enumerate((1.0, -1.0)):
        place = (side * drum, -side * free, 0.0)
        velocity = (side * free * spin, side * drum * spin, 0.0)
        system.add(parts.Point(mass=mass, position=place, velocity=velocity), f"mass {k}")
        anchor = (side * math.cos(wound), side * math.sin(wound), 0.0)
        system.add(
            parts.Joint(a="body", b=f"mass {k}", type="link", length=total, drum=drum, anchor=anchor, sense=-1),
            f"cord {k}",
        )
        stiffness = 1e6 if method == "rk4" else 0.0
        system.add(parts.Joint(a=("body", place), b=f"mass {k}", until=release, stiffness=stiffness), f"hold {k}")
    found = run(system, YOYO_END, method, step)
    t, w, l = found["time"].values, found["body"].rate.values, found["cord 0"].length.values  # noqa: E741
    if w.ndim > 1:
        w = w[:, 2]
    held = t < release - 1e-3
    assert w[held] == pytest.approx(spin, rel=2e-3)
    p, q = A * l**2 + A**2, A * (A + free**2) * spin
    wanted = (q - np.sqrt(np.maximum(q**2 - p * (A + free**2) * spin**2 * (A + free**2 - l**2), 0.0))) / p
    late = t > release + 0.05
    assert w[late] == pytest.approx(wanted[late], abs=1e-2 * spin)
    assert w[-1] / spin == pytest.approx(-0.344, abs=0.02)
    for k in range(2):
        assert np.all(found[f"hold {k}"].force.values[late] == 0.0)
    check_energy(found, 3e-3)


#: The cords are 10.35 m long then, and the body turns at -0.344 of its rate at the start.
YOYO_END = 1.68


# ------------------------------------------------------------------------------------------------ explicit methods


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "dopri5"])
@pytest.mark.parametrize("by", ["time", "event"])
def test_hold_downs_of_penalties(by: str, method: str) -> None:
    """Under explicit methods, by penalties; `tests/analytic/test_explicit_joints.py` has constraints."""
    system = System()
    system.add(parts.RigidBody(mass=MASS, inertia=(0.3, 0.2, OWN), position=(0.5, 0.0, 0.0)), "panel")
    stiff = {"axis": Z, "stiffness": 1e5, "damping": 30.0}
    system.add(parts.Joint(a="ground", b=("panel", (-0.5, 0.0, 0.0)), type="revolute", **stiff), "hinge")
    system.add(parts.JointSpring(joint="hinge", stiffness=STIFFNESS, rest=REST), "spring")
    system.add(parts.Event(law="t - 1"), "clock")
    release = {"until": 1.0} if by == "time" else {"released_by": "clock"}
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b=("panel", (0.5, 0.0, 0.0)), type="clamp", **stiff, **release), "hold")
    found = system.simulate(until=2.0, every=0.02, method=method)
    t = found["time"].values
    assert found["hinge"].angle.values == pytest.approx(swung(t, 1.0), abs=2e-3)
    assert np.all(found["hold"].force.values[t > 1.001] == 0.0)
    check_energy(found)
