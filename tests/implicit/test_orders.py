"""Generalized-alpha and HHT are of second order: positions, velocities and multipliers, from the first step on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.time.implicit.methods import HHT, NAME
from helpers import rotation
from implicit.rigs import RUBBER, SQUARE, run

Array = np.ndarray
G = np.array([0.0, -9.81, 0.0])
TIMES = np.linspace(0.0, 1.0, 11)


def orders(steps: list[float], errors: list[list[float]]) -> Array:
    """Slopes of log error over log step, of each kind of error."""
    return np.polyfit(np.log(steps), np.log(np.array(errors)), 1)[0]


def point() -> Assembly:
    """A point on a rod, in three dimensions."""
    system = System(gravity=G)
    system.add(parts.Point(mass=1.3, position=(1.0, 0.2, 0.0), velocity=(-0.2, 1.0, 2.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance"), "rod")
    return system.assemble()


def point_exact() -> tuple[Array, Array, Array]:
    """Places, velocities and the rod's multiplier."""
    square = 1.04

    def rates(t: float, y: Array) -> Array:
        x, v = y[:3], y[3:]
        return np.concatenate([v, G - (v @ v + G @ x) / square * x])

    y = solve_ivp(rates, (0.0, 1.0), [1.0, 0.2, 0.0, -0.2, 1.0, 2.0], "DOP853", TIMES, rtol=1e-13, atol=1e-13).y.T
    la = 1.3 * ((y[:, 3:] ** 2).sum(axis=1) + y[:, :3] @ G) / np.sqrt(square)
    return y[:, :3], y[:, 3:], la[:, None]


INERTIA, MASS = np.array([0.05, 0.12, 0.1]), 2.0
ARM = np.array([0.5, 0.1, -0.2])


def body(spin: Array) -> Callable[[], Assembly]:
    """A rigid body that hangs from a point of itself off its principal axes."""

    def make() -> Assembly:
        system = System(gravity=G)
        system.add(
            parts.RigidBody(
                mass=MASS, inertia=tuple(INERTIA), position=ARM, velocity=np.cross(spin, ARM), angular_velocity=spin
            ),
            "body",
        )
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("body", tuple(-ARM))), "pivot")
        return system.assemble()

    return make


def body_exact(spin: Array) -> tuple[Array, Array, Array]:
    """Coordinates, velocities and force at the pivot, by Euler's equations about it."""
    about = np.diag(INERTIA) + MASS * (ARM @ ARM * np.eye(3) - np.outer(ARM, ARM))

    def acceleration(R: Array, w: Array) -> Array:
        return np.linalg.solve(about, MASS * np.cross(ARM, R.T @ G) - np.cross(w, about @ w))

    def rates(t: float, y: Array) -> Array:
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        dq = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([dq, acceleration(rotation(q), w)])

    y = solve_ivp(rates, (0.0, 1.0), [1.0, 0.0, 0.0, 0.0, *spin], "DOP853", TIMES, rtol=1e-13, atol=1e-13).y.T
    x, v, la = [], [], []
    for k in range(len(y)):
        R, w = rotation(y[k, :4]), y[k, 4:]
        a = R @ (np.cross(acceleration(R, w), ARM) + np.cross(w, np.cross(w, ARM)))
        x.append([*(R @ ARM), *y[k, :4]])
        v.append([*(R @ np.cross(w, ARM)), *w])
        la.append(MASS * (G - a))
    return np.array(x), np.array(v), np.array(la)


SLOW, TOP = np.array([0.5, -1.0, 2.0]), np.array([15.0, 3.0, -6.0])
PENDULUMS = {
    "point": (point, point_exact),
    "body": (body(SLOW), lambda: body_exact(SLOW)),
    "top": (body(TOP), lambda: body_exact(TOP)),
}


METHODS = {NAME: "Generalized-alpha", HHT: "HHT"}
SOURCES = {NAME: "Arnold & Bruls 2007", HHT: "Negrut et al. 2007"}
RADII = [*((NAME, rho) for rho in (0.0, 0.3, 0.9, 1.0)), *((HHT, rho) for rho in (0.5, 0.9, 1.0))]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "rho"), RADII)
@pytest.mark.parametrize("name", sorted(PENDULUMS))
def test_orders_of_pendulums(name: str, method: str, rho: float, book: Book) -> None:
    """At 1 nothing damps what the multipliers' errors alternate by; their means over neighbouring steps are as good."""
    make, exact = PENDULUMS[name]
    x, v, la = exact()
    n, m = x.shape[1], v.shape[1]
    steps = [1.0 / n for n in ((320, 640, 1280) if name == "top" else (160, 320, 640))]
    errors = []
    for h in steps:
        times = np.unique(np.round(np.add.outer(TIMES[1:-1], h * np.array([-1, 0, 1])), 12))
        found = run(make(), [0.0, *times], method=method, step=h, spectral_radius=rho, newton=1e-13, largest_gain=10.0)
        q, u = found.y[2::3, :n], found.y[2::3, n : n + m]
        mean = found.la[2::3]
        if rho == 1.0:
            mean = 0.25 * (found.la[1::3] + 2.0 * mean + found.la[3::3])
        pairs = ((q, x[1:-1]), (u, v[1:-1]), (mean, la[1:-1]))
        errors.append([float(np.abs(a - b).max()) for a, b in pairs])
    found_orders = orders(steps, errors)
    case = {"point": "point on a rod", "body": "body on a pivot", "top": "fast top on a pivot"}[name]
    book(
        "Dynamics", f"{METHODS[method]}, {case}, rho {rho:g}: order of q, v and la", reference="2",
        source=f"{SOURCES[method]}; SciPy DOP853, 1e-13", error=np.abs(found_orders - 2.0).max(), allowed=0.1,
        unit="in the order", order=found_orders[np.abs(found_orders - 2.0).argmax()], wanted="2",
    )  # fmt: skip


@pytest.mark.parametrize(("method", "rho"), [row for row in RADII if row != (NAME, 0.3)])
def test_multipliers_are_of_second_order_in_the_first_steps(method: str, rho: float, book: Book) -> None:
    """Without the offsets of the start they are of the first: Arnold, Bruls & Cardona (2015)."""
    steps, errors = [1.0 / n for n in (100, 200, 400)], []
    for h in steps:
        found = run(
            point(), h * np.arange(6), method=method, step=h, spectral_radius=rho, newton=1e-13, largest_gain=10.0
        )
        x, v = found.y[:, :3], found.y[:, 3:6]
        la = 1.3 * ((v**2).sum(axis=1) + x @ G) / np.sqrt(1.04)
        errors.append([float(np.abs(found.la[1:, 0] - la[1:]).max())])
    order = orders(steps, errors)[0]
    book(
        "Dynamics", f"{METHODS[method]}, first five steps, rho {rho:g}: order of la", reference="2",
        source="Arnold, Bruls & Cardona 2015", error=abs(order - 2.0), allowed=0.15, unit="in the order", order=order,
        wanted="2",
    )  # fmt: skip


def amplification(alpha: float, turn: float) -> Array:
    """The map of (u, h u', h^2 u'') of u'' = -w^2 u over a step h = turn/w, of HHT as Hilber, Hughes & Taylor print it.

    u1'' + (1 + alpha) w^2 u1 - alpha w^2 u0 = 0, with Newmark's u1 and u1'.
    """
    beta, gamma, square = 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha, turn * turn
    left = np.array([[1.0, 0.0, -beta], [0.0, 1.0, -gamma], [(1.0 + alpha) * square, 0.0, 1.0]])
    right = np.array([[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma], [alpha * square, 0.0, 0.0]])
    return np.linalg.solve(left, right)


@pytest.mark.parametrize("alpha", [-1.0 / 3.0, -0.3, -0.05, 0.0])
@pytest.mark.parametrize("turn", [0.1, 1.0, 10.0])
def test_hht_is_the_method_of_hilber_hughes_and_taylor(alpha: float, turn: float) -> None:
    """Places at steps in a row solve the difference equation of the method's amplification matrix."""
    h, radius = 0.01, (1.0 + alpha) / (1.0 - alpha)
    system = System()
    system.add(parts.Point(mass=2.0, position=(1.01, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=2.0 * (turn / h) ** 2, length=1.0))
    found = run(
        system.assemble(), h * np.arange(9), method=HHT, step=h, spectral_radius=radius, newton=1e-13, largest_gain=10.0
    )
    u, coefficients = found.y[:, 0] - 1.0, np.poly(amplification(alpha, turn))
    left = np.array([coefficients @ u[k : k + 4][::-1] for k in range(6)])
    assert np.abs(left).max() < 1e-9 * np.abs(u).max()
    assert np.abs(np.linalg.eigvals(amplification(alpha, 1e6))).max() == pytest.approx(radius, abs=1e-4)


def cable(n: int = 10, **fields: object) -> Assembly:
    """The pendulum of point 10 of the reference computations: 2 m, pinned."""
    system = System(gravity=G)
    system.add(
        parts.Beam(length=2.0, section=SQUARE, material=RUBBER, elements=n, **{"formulation": "cable", **fields}),
        "cable",
    )  # type: ignore[arg-type]
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="cable.root"), "pin")
    return system.assemble()


def test_energy_error_of_the_cable_pendulum_falls_by_four(book: Book) -> None:
    gained = []
    for h in (2e-3, 1e-3, 5e-4):
        found = run(cable(), [0.0, 0.25, 0.5, 0.75, 1.0], step=h, spectral_radius=0.9)
        gained.append(np.abs(found.energy_defect).max())
    assert 3.6 < gained[0] / gained[1] < 4.4
    assert 3.6 < gained[1] / gained[2] < 4.4
    book(
        "Dynamics", "Energy error of the cable pendulum under generalized-alpha",
        reference="falls by 4 with half the step", source="order of the method",
        error=max(abs(np.log2(gained[k] / gained[k + 1]) - 2.0) for k in (0, 1)), allowed=0.16, unit="in the order",
        order=np.log2(gained[1] / gained[2]), wanted="2",
    )  # fmt: skip


def pair() -> Assembly:
    """Two arms in a plane, thrown from above."""
    system = System(gravity=G)
    for k, (x, inner) in enumerate(((0.1, (0.0, 0.0, 0.0)), (0.3, "arm 1.outer")), start=1):
        ends = {"inner": (-0.1, 0.0, 0.0), "outer": (0.1, 0.0, 0.0)}
        arm = parts.RigidBody(
            mass=0.5, inertia=1e-3, position=(x, 0.0, 0.0), points=ends, angular_velocity=(0.0, 0.0, 8.0),
            velocity=(0.0, 8.0 * x, 0.0),
        )  # fmt: skip
        system.add(arm, f"arm {k}")
        system.add(parts.Joint(a=inner, b=f"arm {k}.inner", type="revolute", axis=(0, 0, 1)), f"pivot {k}")
    return system.assemble()


def pair_exact() -> Array:
    """Places of the second arm's centre by Lagrange's equations."""
    m, length, c, J = 0.5, 0.2, 0.1, 1e-3

    def rates(t: float, y: Array) -> Array:
        a, b, u, v = y
        M = np.array([
            [J + m * c * c + m * length**2, m * length * c * np.cos(a - b)],
            [m * length * c * np.cos(a - b), J + m * c * c],
        ])  # fmt: skip
        s = m * length * c * np.sin(a - b)
        weights = -9.81 * m * np.array([(c + length) * np.cos(a), c * np.cos(b)])
        return np.concatenate([[u, v], np.linalg.solve(M, weights + np.array([-s * v * v, s * u * u]))])

    a, b = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0, 8.0, 8.0], "DOP853", TIMES, rtol=1e-12, atol=1e-12).y[:2]
    return np.stack([length * np.cos(a) + c * np.cos(b), length * np.sin(a) + c * np.sin(b)], axis=1)


def test_adaptive_steps_follow_their_tolerance() -> None:
    """The error goes by the tolerance to the power 2/3, and few steps are rejected: their length changes seldom."""
    exact, errors = pair_exact(), []
    for tolerance in (1e-6, 1e-8):
        found = run(pair(), TIMES, tolerance=tolerance)
        place = found.y[:, 7:9] if np.allclose(found.y[0, 7:9], (0.3, 0.0)) else found.y[:, 3:5]
        errors.append(np.abs(place - exact).max())
        assert found.statistics["rejected_steps"] < 0.06 * found.statistics["steps"]
    assert 1e-7 < errors[1] < errors[0] / 8.0
    assert errors[1] < 2e-5
