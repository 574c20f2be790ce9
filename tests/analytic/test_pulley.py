"""Cords over a point against closed forms and independent equations, under all methods."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from book import Book
from evolvent import InputError, System, parts
from evolvent.families.joints import joint
from evolvent.kernels import gaps, rigid
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order
from implicit.rigs import momenta

G = 9.81
METHODS = ("rk4", "dopri5", "generalized-alpha", "hht", "energy-momentum")


def solved(system: System, times: Any, method: str, step: float, **options: Any) -> Solution:
    """A run that ends well."""
    assembly = system.assemble()
    if method == "rk4":
        found = solve(assembly, samples=times, method=method, step=step)
    elif method == "dopri5":
        found = solve(assembly, samples=times, method=method)
    elif method == "energy-momentum":
        found = solve_energy(assembly, samples=times, step=step, spectral_radius=1.0, **options)
    else:
        found = solve_implicit(assembly, samples=times, method=method, step=step, spectral_radius=0.9, **options)
    assert found.success, found.message
    return found


def tackle(ratio: float | None, first: float, second: float, **fields: Any) -> System:
    """Two masses that hang on one cord over a point, the second on `ratio` parts of it."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=first, position=(0.0, 0.0, -1.0)), "first")
    system.add(parts.Point(mass=second, position=(0.0, 0.0, -2.0)), "second")
    cord = parts.Joint(a="first", b="second", over=(0.0, 0.0, 0.0), type="pulley", ratio=ratio, **fields)
    system.add(cord, "cord")
    return system


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("ratio", [None, 3.0])
def test_atwoods_machine_and_a_tackle(ratio: float | None, method: str) -> None:
    """z1'' = -n z2'' with m1 z1'' = T - m1 g and m2 z2'' = n T - m2 g."""
    first, second, n = 1.3, 2.0, ratio or 1.0
    times = np.linspace(0.0, 0.3, 4)
    found = solved(tackle(ratio, first, second), times, method, 1e-2)
    fall = G * (second - n * first) / (second + n * n * first)
    tension = first * (G + n * fall)
    assert found.y[:, 2] == pytest.approx(-1.0 + 0.5 * n * fall * times**2, abs=1e-6)
    assert found.y[:, 5] == pytest.approx(-2.0 - 0.5 * fall * times**2, abs=1e-6)
    seen = observe(found)["cord"].variables
    assert seen["tension"].values == pytest.approx(np.full(4, tension), rel=1e-5)
    assert seen["length"].values == pytest.approx(np.full(4, 1.0 + 2.0 * n), rel=1e-8)
    assert seen["force"].values[:, 2] == pytest.approx(np.full(4, n * tension), rel=1e-5)
    assert seen["ends"].values[0].tolist() == [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, -2.0]]


#: Of the swinging mass and the other, kg; length and angle at the start, m and rad.
SWINGING, OTHER, LENGTH, ANGLE = 1.0, 2.5, 1.0, 1.2


def swinging(times: Any) -> np.ndarray:
    """Length and angle of the swinging end and their rates (Tufillaro, Abbott & Griffiths, 1984)."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        r, angle, dr, turn = y
        pull = SWINGING * r * turn**2 + G * (SWINGING * math.cos(angle) - OTHER)
        return [dr, turn, pull / (SWINGING + OTHER), -(2.0 * dr * turn + G * math.sin(angle)) / r]

    found = solve_ivp(rates, (0.0, times[-1]), [LENGTH, ANGLE, 1.2, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12)
    return np.asarray(found.y.T)


def swinging_system() -> System:
    system, u = System(gravity=(0.0, 0.0, -G)), np.array([math.sin(ANGLE), 0.0, -math.cos(ANGLE)])
    system.add(parts.Point(mass=OTHER, position=(0.0, 0.0, -2.0), velocity=(0.0, 0.0, 1.2)), "other")
    system.add(parts.Point(mass=SWINGING, position=tuple(LENGTH * u), velocity=tuple(1.2 * u)), "swings")
    system.add(parts.Joint(a="other", b="swings", over=(0.0, 0.0, 0.0), type="pulley"), "cord")
    return system


@pytest.mark.parametrize("method", METHODS)
def test_order_on_a_swinging_atwoods_machine(method: str, book: Book) -> None:
    """Of the place of both masses; the adaptive method is held at its tolerance."""
    times = np.linspace(0.0, 0.8, 5)
    r, angle = swinging(times).T[:2]
    exact = np.column_stack([0.0 * r, 0.0 * r, -(3.0 - r), r * np.sin(angle), 0.0 * r, -r * np.cos(angle)])
    counts = np.array([1]) if method == "dopri5" else np.array([20, 40, 80]) * (1 if method == "rk4" else 4)
    wanted, errors = 4 if method == "rk4" else 2, []
    for count in counts:
        found = solved(swinging_system(), times, method, 0.8 / count)
        errors.append(float(np.abs(found.y[:, :6] - exact).max()))
    assert errors[-1] < 1e-4
    if method == "dopri5":
        return
    order = fitted_order(0.8 / counts, errors)
    book(
        "Dynamics", f"Swinging Atwood's machine under {method}: order of places", reference=str(wanted),
        source="Tufillaro, Abbott & Griffiths 1984; SciPy DOP853, 1e-12", error=abs(order - wanted), allowed=0.25,
        unit="in the order", order=order, wanted=str(wanted),
    )  # fmt: skip


def test_energy_is_conserved() -> None:
    found = solved(swinging_system(), np.linspace(0.0, 3.0, 31), "energy-momentum", 0.02)
    y = found.y
    kinetic = 0.5 * OTHER * (y[:, 6:9] ** 2).sum(axis=1) + 0.5 * SWINGING * (y[:, 9:12] ** 2).sum(axis=1)
    energy = kinetic + G * (OTHER * y[:, 2] + SWINGING * y[:, 5])
    assert np.ptp(energy) < 1e-9 * np.ptp(kinetic)


BODY: dict[str, Any] = {"inertia": [[0.2, 0.01, 0.02], [0.01, 0.3, -0.02], [0.02, -0.02, 0.25]]}


def free(velocity: Any = (0.0, 0.0, 0.0), **fields: Any) -> System:
    """Three bodies that turn, with a cord between points of theirs."""
    system = System()
    for name, x, w in (("a", (1.0, 0.0, 0.2), (0.3, -1.0, 0.5)), ("b", (0.0, 1.0, 0.0), (-1.0, 0.4, 0.6)),
                       ("c", (0.0, 0.0, 0.0), (0.5, 0.7, -0.9))):  # fmt: skip
        moves = {"velocity": tuple(velocity)} if name == "a" else {}
        system.add(parts.RigidBody(mass=1.5, position=x, angular_velocity=w, **moves, **BODY), name)
    places = {"a": ("a", (-0.1, 0.1, 0.0)), "b": ("b", (0.0, -0.1, 0.2)), "over": ("c", (0.1, 0.1, -0.1))}
    system.add(parts.Joint(type="pulley", ratio=2.0, **places, **fields), "cord")
    return system


def on_a_cord(stiffness: float, damping: float = 0.0) -> System:
    """The same; a constraint starts with velocities that it allows."""
    if stiffness > 0.0:
        return free(stiffness=stiffness, damping=damping)
    assembly = free().assemble()
    rigid.kinematics(0.0, assembly.y, assembly.model)
    joint.joint_geometry(0.0, assembly.y, 0, assembly.model)
    rate, g = assembly.model.constraints[0]["rate"], assembly.model.joints[0]["g"]
    return free(-rate * g[0])


@pytest.mark.parametrize("stiffness", [0.0, 40.0])
def test_momenta_and_energy_of_free_bodies_on_a_cord(stiffness: float) -> None:
    """All three ends move and turn; energy-momentum keeps all that the motion keeps."""
    found = solved(on_a_cord(stiffness), np.linspace(0.0, 2.0, 11), "energy-momentum", 0.02)
    assert np.ptp(momenta(found.assembly, found), axis=0).max() < 1e-10
    assert np.abs(found.energy_defect).max() < 1e-10 * found.statistics["energy_moved"]


@pytest.mark.parametrize("stiffness", [0.0, 40.0])
def test_methods_agree_on_free_bodies(stiffness: float) -> None:
    times = np.linspace(0.0, 1.0, 6)
    runs = {}
    for method in METHODS:
        runs[method] = solved(on_a_cord(stiffness, 3.0), times, method, 2e-3)
    exact = runs["dopri5"].y[:, :21]
    for method, found in runs.items():
        assert np.abs(found.y[:, :21] - exact).max() < 2e-5, method


def loop(offset: float = 0.0) -> System:
    """A mass on a cord between two points: it moves on an ellipse whose foci are the points."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=2.0, position=(offset, 0.0, -0.8 * math.sqrt(1.0 - offset * offset))), "load")
    system.add(parts.Joint(a=(-0.6, 0.0, 0.0), b=(0.6, 0.0, 0.0), over="load", type="pulley"), "cord")
    return system


def test_a_load_that_rolls_on_a_cord_hangs_in_the_middle() -> None:
    """Semi-axes 1 and 0.8 (foci at 0.6): w^2 = g b/a^2 along the cord, g/b across; the tension is m g/(2 cos)."""
    found = modes(loop().assemble(), count=2)
    assert np.sort(np.abs(found.pole)) == pytest.approx([math.sqrt(G * 0.8), math.sqrt(G / 0.8)], rel=1e-7)
    still = solve_static(loop(0.3).assemble())
    assert still.success, still.message
    assert still.y[-1, :3] == pytest.approx([0.0, 0.0, -0.8], abs=1e-7)
    assert still.la[-1] == pytest.approx([2.0 * G / (2.0 * 0.8)], rel=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_load_rolls_along_an_ellipse(method: str) -> None:
    """The period of a large swing, by its quadrature, and the place on the ellipse."""
    start = 0.7
    found = solved(loop(start), np.linspace(0.0, 3.0, 601), method, 2e-3)
    x, z = found.y[:, 0], found.y[:, 2]
    assert x**2 + (z / 0.8) ** 2 == pytest.approx(np.ones(601), abs=1e-6)
    turned = math.asin(start)  # x = sin(s), z = -0.8 cos(s)
    s = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 4001)
    at = turned * np.sin(s)  # which takes out the root at the ends
    speed = np.sqrt(np.maximum(2.0 * G * 0.8 * (np.cos(at) - math.cos(turned)), 1e-300))
    path = np.sqrt(np.cos(at) ** 2 + (0.8 * np.sin(at)) ** 2)
    rate = np.where(np.abs(np.cos(s)) > 1e-6, turned * np.cos(s) * path / speed, np.nan)
    rate[[0, -1]] = 2.0 * rate[1] - rate[2], 2.0 * rate[-2] - rate[-3]
    period = 2.0 * np.trapezoid(rate, s)
    crossing = brentq(lambda t: float(np.interp(t, found.t, x)), 0.1 * period, 0.4 * period)
    assert crossing == pytest.approx(0.25 * period, rel=2e-4)


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum", "rk4"])
def test_a_cord_that_stretches(method: str) -> None:
    """Of both masses z'' = -/+ k u/m about Atwood's motion, with the elongation u: w^2 = k (1/m1 + 1/m2)."""
    k, first, second = 300.0, 1.3, 2.0
    system, times = tackle(None, first, second, stiffness=k), np.linspace(0.0, 0.5, 51)
    found = solved(system, times, method, 1e-3)
    w = math.sqrt(k * (1.0 / first + 1.0 / second))
    rest = 2.0 * first * second * G / (first + second) / k
    u = -found.y[:, 2] - found.y[:, 5] - 3.0
    assert u == pytest.approx(rest * (1.0 - np.cos(w * times)), abs=2e-3 * rest)


def test_a_cord_that_is_cut_lets_fall() -> None:
    found = solved(tackle(None, 1.0, 1.0, until=0.2), np.linspace(0.0, 0.4, 5), "generalized-alpha", 1e-2)
    assert found.y[:3, 2] == pytest.approx(-np.ones(3), abs=1e-9)
    assert found.y[-1, 2] == pytest.approx(-1.0 - 0.5 * G * 0.04, abs=1e-6)


@pytest.mark.parametrize(("method", "stiffness"), [("generalized-alpha", 0.0), ("energy-momentum", 0.0), ("rk4", 5e3)])
@pytest.mark.parametrize(("lift", "warned"), [(0.0, False), (24.0, True)])
def test_a_cord_that_pushes_is_warned_of(method: str, stiffness: float, lift: float, warned: bool) -> None:
    """Two masses of 1 kg, one of which is lifted by a force: the cord pulls with g - lift/2."""
    system = System(gravity=(0.0, 0.0, -G))
    for name, z in (("first", -1.0), ("second", -2.0)):
        system.add(parts.Point(mass=1.0, position=(0.0, 0.0, z)), name)
    cord: dict[str, Any] = {"stiffness": stiffness, "damping": 20.0} if stiffness else {}
    system.add(parts.Joint(a="first", b="second", over=(0.0, 0.0, 0.0), type="pulley", **cord), "cord")
    system.add(parts.Load(at="first", force=(0.0, 0.0, lift)), "lift")
    run = system.simulate(until=0.25, method=method, step=1e-4 if stiffness else 1e-2)
    assert float(run["cord"].tension[-1]) == pytest.approx(G - 0.5 * lift, abs=0.2 if stiffness else 1e-6)
    assert run.attrs.get("warning", "").startswith("'cord' pushes where a thread would go slack") is warned


def test_a_cord_on_a_drum_that_pushes_is_warned_of() -> None:
    system = System()
    system.add(parts.RigidBody(mass=20.0, inertia=(1.0, 1.0, 2.0)), "hub")
    system.add(parts.Point(mass=1.0, position=(2.0, -0.2, 0.0), velocity=(0.0, 1.0, 0.0)), "mass")
    drum: dict[str, Any] = {"length": 2.0, "drum": 0.2, "anchor": (0.0, -1.0, 0.0), "sense": 1}
    system.add(parts.Joint(a="hub", b="mass", type="link", **drum), "cord")
    system.add(parts.Load(at="mass", force=(-3.0, 0.0, 0.0)), "push")
    warning = system.simulate(until=0.1).attrs["warning"]
    assert warning.startswith("'cord' pushes where a thread would go slack: tension below zero in ")


def test_a_cord_is_a_row_of_its_own() -> None:
    row = tackle(2.0, 1.0, 1.0).assemble().model.joints[0]
    assert (row["kind"], row["radius"], row["value"]) == (gaps.PULLEY, 2.0, 5.0)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"over": None}, "cord.over is missing; the cord of a pulley runs over a point"),
        ({"over": (0.0, 0.0, -1.0)}, "cord.a and cord.over coincide at the start"),
        ({"over": "first"}, "cord.a and cord.over coincide at the start"),
        ({"ratio": 0.0}, "ratio"),
        ({"position": (0.0, 0.0, 0.0)}, "cord.position is given, but cord.type is 'pulley', which has none"),
        ({"pitch": 0.1}, "cord.pitch is given, but cord.type is 'pulley', not 'screw'"),
        ({"type": "distance"}, "cord.over is given, but cord.type is 'distance', not 'pulley'"),
        ({"type": "distance", "over": None, "ratio": 2.0}, "cord.ratio is given, but cord.type is 'distance'"),
        ({"b": "ground", "over": (0.0, 0.0, 1.0)}, "cord.b and cord.over are on one body"),
    ],
)
def test_what_no_cord_can_be_is_refused(fields: dict[str, Any], message: str) -> None:
    given = {"a": "first", "b": "second", "over": (0.0, 0.0, 0.0), "type": "pulley"}
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, -1.0)), "first")
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, -2.0)), "second")

    def assemble() -> None:
        system.add(parts.Joint(**(given | fields)), "cord")
        system.assemble()

    with pytest.raises(InputError, match=message):
        assemble()
