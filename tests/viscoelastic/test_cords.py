"""Viscoelastic cords: joints that keep a length by a penalty."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy

from evolvent import System, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.storage import store
from evolvent_base.errors import InputError

PRONY = [(0.3, 0.1), (0.3, 1.0)]
STIFFNESS, WEIGHT = 200.0, 9.81


def hung(kind: str, prony: Any = None, **keys: Any) -> System:
    """A mass of 1 kg on a cord along x, which a pulley may lead there from the side; it has no tension at the start."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0, 0)), "mass")
    law = {"prony": PRONY if prony is None else prony}
    own: dict[str, Any] = {"stiffness": STIFFNESS, "viscoelastic": law} | keys
    if kind == "pulley":
        system.add(parts.Point(mass=1.0, position=(0.0, 0.5, 0)), "post")
        system.add(parts.Joint(a=(0.0, 0.5, 0), b="post", type="spherical"), "held")
        own |= {"over": (0.0, 0, 0), "a": "post"}
    system.add(parts.Joint(**({"a": (0.0, 0, 0), "b": "mass", "type": kind} | own)), "cord")
    system.add(parts.Load(at="mass", direction=(1, 0, 0), profile={"constant": WEIGHT}), "weight")
    return system


def integrated(until: float) -> float:
    """Stretch by SciPy."""
    share, time = np.array(PRONY).T

    def rates(_: float, z: Any) -> list[float]:
        force = STIFFNESS * ((1.0 - share.sum()) * z[0] + share @ z[2:])
        return [z[1], WEIGHT - force, *(z[1] - z[2:] / time)]

    found = scipy.integrate.solve_ivp(rates, (0.0, until), [0.0] * 4, rtol=1e-12, atol=1e-14)
    return float(found.y[0, -1])


@pytest.mark.parametrize("kind", ["distance", "pulley"])
@pytest.mark.parametrize("method", ["rk4", "generalized-alpha", "energy-momentum"])
def test_a_mass_on_a_cord_moves_as_in_a_second_implementation(method: str, kind: str) -> None:
    exact, errors, steps = integrated(0.6), [], (0.004, 0.002)
    for step in steps:
        options: dict[str, Any] = {} if method == "rk4" else {"spectral_radius": 1.0}
        run = hung(kind).simulate(until=0.6, every=0.1, fine=False, method=method, step=step, **options)
        errors.append(abs(float(run["mass"].position.values[-1, 0]) - 1.0 - exact))
    if method == "rk4":
        assert errors[1] < 1e-8
    else:
        assert 3.5 < errors[0] / errors[1] < 4.5  # second order
    defect = np.abs(run.energy_defect.values).max()
    assert defect < {"rk4": 1e-7, "generalized-alpha": 1e-3, "energy-momentum": 1e-12}[method]
    assert float(run.energy_dissipated.values[-1]) > 0.02


def test_a_cord_creeps_under_a_load() -> None:
    """Strain (1/E_inf)(1 - (E_1/E_0) exp(-t E_inf/(E_0 tau))) sigma, modes by the law."""
    prony, time, first = [(0.6, 1.0)], 1.5, WEIGHT / STIFFNESS
    system = hung("distance", prony)
    found = store(system.assemble(), time, tolerance=1e-8)
    stretch = float(found.solution.y[-1, 0]) - 1.0
    assert stretch == pytest.approx(first / 0.4 * (1.0 - 0.6 * math.exp(-0.4 * time)), rel=1e-6)
    relaxed = solve_static(system.assemble(), relaxed=True)
    assert float(relaxed.y[-1, 0]) - 1.0 == pytest.approx(first / 0.4, rel=1e-9)
    s = complex(modes(system.assemble(), damped=True, count=3).pole[2])  # behind the two of a pendulum
    law = Viscoelastic(prony=prony)
    assert abs(s * s + STIFFNESS * complex(law.dynamic_modulus(np.array(s)))) < 1e-8


def test_a_cord_that_is_released_leaves_the_balance() -> None:
    for method in ("rk4", "energy-momentum"):
        options: dict[str, Any] = {} if method == "rk4" else {"spectral_radius": 1.0}
        run = hung("distance", until=0.31).simulate(
            until=0.5, every=0.1, fine=False, method=method, step=0.002, **options
        )
        assert np.abs(run.energy_defect.values).max() < {"rk4": 1e-7, "energy-momentum": 1e-12}[method]
        speed = run["mass"].velocity.values[:, 0]
        assert speed[-1] - speed[-2] == pytest.approx(0.1 * WEIGHT, rel=1e-9)


def test_what_is_no_cord_is_refused() -> None:
    with pytest.raises(InputError, match=r"cord\.viscoelastic"):
        hung("distance", stiffness=0.0).assemble()
    with pytest.raises(InputError, match=r"cord\.viscoelastic"):
        hung("spherical", a=(1.0, 0, 0)).assemble()
