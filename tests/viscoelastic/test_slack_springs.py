"""Viscoelastic springs that only pull: a second implementation in motion, energy, storage, modes."""

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

PRONY = [(0.3, 0.4), (0.3, 4.0)]
STIFFNESS, LENGTH, WEIGHT, SPEED = 40.0, 5.0, 9.81, -3.0


def bungee(start: float, prony: Any = None, **content: Any) -> System:
    """A mass of 1 kg that hangs on a bungee along x and jumps up."""
    system = System(**content)
    system.add(parts.Point(mass=1.0, position=(start, 0, 0), velocity=(SPEED, 0, 0)), "mass")
    law = {"prony": PRONY if prony is None else prony}
    cord = parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=STIFFNESS, length=LENGTH, slack=True, viscoelastic=law)
    system.add(cord, "cord")
    system.add(parts.Load(at="mass", direction=(1, 0, 0), profile={"constant": WEIGHT}), "weight")
    return system


def integrated(start: float, until: float, prony: Any, dashpots: Any) -> float:
    """Position by SciPy, with the strains of the dashpots as states."""
    share, time = np.array(prony).T

    def rates(_: float, z: Any) -> list[float]:
        without = float(share @ z[2:])
        x = max(z[0] - LENGTH, without)
        return [z[1], WEIGHT - STIFFNESS * (x - without), *((x - z[2:]) / time)]

    begin = [start, SPEED, *dashpots]
    found = scipy.integrate.solve_ivp(rates, (0.0, until), begin, rtol=1e-11, atol=1e-13, max_step=1e-3)
    return float(found.y[0, -1])


def moved(system: System, until: float, method: str, **options: Any) -> tuple[float, Any]:
    if "step" in options and method != "rk4":
        options["spectral_radius"] = 1.0
    run = system.simulate(until=until, every=0.05, fine=False, method=method, **options)
    return float(run["mass"].position.values[-1, 0]), run


@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha", "energy-momentum"])
def test_a_bungee_goes_slack_as_in_a_second_implementation(method: str) -> None:
    exact = integrated(5.5, 2.0, PRONY, (0.0, 0.0))
    if method == "dopri5":
        x, run = moved(bungee(5.5), 2.0, method, tolerance=1e-10)
        assert abs(x - exact) < 1e-6
    elif method == "rk4":
        x, run = moved(bungee(5.5), 2.0, method, step=0.002)
        assert abs(x - exact) < 1e-5
    else:
        errors = []
        for step in (0.02, 0.01, 0.005):
            x, run = moved(bungee(5.5), 2.0, method, step=step)
            errors.append(abs(x - exact))
        assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]  # of second order but for where it goes slack
        assert errors[2] < 1e-3
    force = run["cord"].force.values
    assert force.min() == 0.0
    assert force.max() > 20.0
    assert 0.1 < np.mean(force == 0.0) < 0.6
    defect = np.abs(run.energy_defect.values).max()
    assert defect < {"rk4": 1e-4, "dopri5": 1e-3, "generalized-alpha": 1e-2, "energy-momentum": 1e-11}[method]
    assert np.all(np.diff(run.energy_dissipated.values) >= 0.0)


@pytest.mark.parametrize("step", [0.05, 0.3, 1.7])
def test_no_step_gains_energy_whatever_its_length(step: float) -> None:
    run = moved(bungee(5.5), 20.0 * step, "energy-momentum", step=step)[1]
    assert np.all(np.diff(run.energy_dissipated.values) >= -1e-12)
    assert np.abs(run.energy_defect.values).max() < 1e-9


def test_a_stored_bungee_has_crept_and_is_longer_when_it_goes_slack() -> None:
    """Creep under the weight, strain (1/E_inf)(1 - (E_1/E_0) exp(-t E_inf/(E_0 tau))) sigma; then the jump."""
    prony, time = [(0.6, 1.0)], 1.5
    first = WEIGHT / STIFFNESS
    system = bungee(LENGTH + first, prony)
    found = store(system.assemble(), time, tolerance=1e-8)
    x = float(found.solution.y[-1, 0])
    creep = first / 0.4 * (1.0 - 0.6 * math.exp(-0.4 * time))
    assert x == pytest.approx(LENGTH + creep, rel=1e-6)
    relaxed = solve_static(system.assemble(), relaxed=True)
    assert float(relaxed.y[-1, 0]) == pytest.approx(LENGTH + first / 0.4, rel=1e-9)
    dashpot = (creep - first) / 0.6  # K (x - 0.6 dashpot) is the weight
    (row,) = found.assembly.model.branch_strains
    assert row["x"] - row["w"] == pytest.approx(dashpot, rel=1e-5)
    exact = integrated(x, 1.0, prony, (dashpot,))
    stored = bungee(LENGTH + first, prony, sections={"store": {"time": time, "tolerance": 1e-8}})
    for method, step, error in (("energy-momentum", 0.005, 1e-3), ("rk4", 0.002, 1e-5)):
        at, run = moved(stored, 1.0, method, step=step)
        assert abs(at - exact) < error
        assert run["cord"].force.values.min() == 0.0
    pole = modes(system.assemble(), damped=True, count=3).pole  # behind the two of a pendulum
    law = Viscoelastic(prony=prony)
    s = complex(pole[2])
    assert abs(s * s + STIFFNESS * complex(law.dynamic_modulus(np.array(s)))) < 1e-8
