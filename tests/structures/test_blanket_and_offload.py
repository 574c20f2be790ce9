"""The built-in cases `z-fold` and `offload` against least energy and against equations of motion, by SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

import evolvent as ev
from evolvent import System

Array = np.ndarray

# ------------------------------------------------------------------------------------------------ blanket

STIFFNESS, REST = 0.02, np.radians([-20.0, 20.0, -20.0, 20.0, -20.0])
#: From the inner to the outer crease of each panel as it is folded, m; and where the mast holds the last one, m.
LINKS = np.array([[0.01, 0.5], [0.01, -0.5]] * 3)
END = np.array([2.9, 0.0])


@pytest.fixture(scope="module")
def blanket() -> xr.DataTree:
    return ev.load("z-fold").simulate()


def tip(angles: Array) -> Array:
    c, s = np.cos(angles), np.sin(angles)
    return np.array([np.sum(c * LINKS[:, 0] - s * LINKS[:, 1]), np.sum(s * LINKS[:, 0] + c * LINKS[:, 1])])


@pytest.mark.slow
def test_blanket_ends_where_the_springs_have_least_energy(blanket: xr.DataTree) -> None:
    """It still vibrates by some thousandths of a radian, in which the energy is of second order."""
    found = minimize(
        lambda x: 0.5 * STIFFNESS * np.sum((np.diff(x) - REST) ** 2),
        np.radians([-75.0, 75.0] * 3),
        constraints={"type": "eq", "fun": lambda x: tip(x) - END},
        tol=1e-14,
    )
    angles = [float(blanket[f"spring {k}"].angle.values[-1]) for k in range(1, 6)]
    np.testing.assert_allclose(angles, np.diff(found.x), atol=6e-3)
    stored = sum(float(blanket[f"spring {k}"].energy_elastic.values[-1]) for k in range(1, 6))
    assert stored == pytest.approx(found.fun, rel=3e-4)
    mast = blanket["mast"].position.values[-1]
    np.testing.assert_allclose(mast, [2.92, 0.0, 0.0], atol=1e-9)


@pytest.mark.slow
def test_stack_is_pressed_and_stays_apart(blanket: xr.DataTree) -> None:
    """Springs press the panels on one another at the start; they never lie deeper in one another than these do."""
    assert min(float(blanket[f"stack {k}"].impulse.values[-1]) for k in range(1, 6)) > 1e-4
    deepest = min(float(blanket[f"stack {k}"].gap.min()) for k in range(1, 6))
    assert -1e-3 < deepest < 0.0
    assert all(float(blanket[f"stack {k}"].normal_force.values[-1]) == 0.0 for k in range(1, 6))


@pytest.mark.slow
def test_energy_of_the_blanket_balances(blanket: xr.DataTree) -> None:
    assert abs(float(blanket.energy_defect.values[-1])) < 1e-2 * float(np.abs(blanket.energy.values).max())


# ------------------------------------------------------------------------------------------------ offload

MASS, WEIGHT, ARM, PULLEY, G = 4.0, 4.0, 0.5, np.array([0.35, 5.0]), 9.81
INERTIA = MASS * (1.0 + 0.02**2) / 12.0 + MASS * ARM**2
SPRING, DAMPER, SPRING_REST, LATCH = 1.0, 0.5, math.radians(110.0), 0.5 * math.pi


def opening(weight: float, g: float) -> tuple[float, float, object]:
    """Time (s) and rate (rad/s) at which the panel reaches its latch, and its motion, of an ideal cord.

    With the angle x from upright, the middle at ARM (sin x, cos x) and the length r of the cord above it,
    (I + w r_x^2) x'' + w r_x r_xx x'^2 - m g ARM sin x + w g r_x = spring.
    """

    def length(x: float) -> tuple[float, float, float]:
        d = PULLEY - ARM * np.array([math.sin(x), math.cos(x)])
        t, n = ARM * np.array([math.cos(x), -math.sin(x)]), -ARM * np.array([math.sin(x), math.cos(x)])
        r = float(np.linalg.norm(d))
        first = -float(d @ t) / r
        return r, first, (float(t @ t) - float(d @ n) - first**2) / r

    def rates(_: float, y: Array) -> list[float]:
        _, first, second = length(y[0])
        torque = SPRING * (SPRING_REST - y[0]) - DAMPER * y[1] + MASS * g * ARM * math.sin(y[0]) - weight * g * first
        return [y[1], (torque - weight * first * second * y[1] ** 2) / (INERTIA + weight * first**2)]

    def latched(_: float, y: Array) -> float:
        return float(y[0] - LATCH)

    latched.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(rates, (0.0, 20.0), [0.0, 0.0], rtol=1e-10, atol=1e-12, events=latched, dense_output=True)
    return float(found.t[-1]), float(found.y[1, -1]), found.sol


def test_offload_moves_as_its_equation_says() -> None:
    time, rate, motion = opening(WEIGHT, G)
    run = ev.load("offload").simulate()
    hinge = run["hinge"]
    before = run.time.values < time
    np.testing.assert_allclose(hinge.angle.values[before], motion(run.time.values[before])[0], atol=1e-4)  # type: ignore[operator]
    assert float(hinge.latch_time[-1]) == pytest.approx(time, rel=1e-4)
    assert float(hinge.latch_rate[-1]) == pytest.approx(rate, rel=1e-3)


def test_offload_beside_orbit() -> None:
    """In orbit, the same panel without cord and counterweight: the cord's slant opens it 11 % sooner, and slower."""
    given = ev.load("offload")
    orbit = System()
    for name in ("panel", "pivot", "hinge"):
        orbit.add(given.parts[name], name)
    hinge = orbit.simulate(until=10.0, every=0.02)["hinge"]
    time, rate, _ = opening(0.0, 0.0)
    assert float(hinge.latch_time[-1]) == pytest.approx(time, rel=1e-4)
    assert (time, rate) == pytest.approx((1.818, 1.210), abs=1e-3)
    assert opening(WEIGHT, G)[:2] == pytest.approx((1.615, 1.088), abs=1e-3)
