"""A run that gains energy that matters fails; round-off does not, and the warning names it."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts
from evolvent.analysis import closure
from evolvent.analysis.system import System
from evolvent.solvers import Solution
from evolvent.solvers.time.implicit.plan import solve_implicit


def beam(speed: float) -> System:
    """A steel cantilever whose tip has a speed, m/s; E A L of its elements is 2e7 J."""
    system, about = System(), {"length": 1.0, "section": ev.Rectangle(thickness=0.01, width=0.05), "material": "steel"}
    nodes = parts.Beam(**about, elements=4).start_nodes()
    rates = np.zeros_like(nodes)
    rates[-1, 0, 1] = speed
    system.add(parts.Beam(**about, elements=4, nodes=nodes, rates=rates), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "clamp")
    return system


@pytest.fixture(scope="module")
def swing() -> Solution:
    """A weight on a string of 1 m that swings by 5 mrad: 12 uJ, beside 1 J to lift it by the string's length."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(motion="spin", mass=1e3, inertia=1.0), "hub")
    system.add(parts.Reel(body="hub", radius=0.01, drive=parts.ConstantDrive(rate=0.0, angle=100.0)), "reel")
    system.add(
        parts.Thread(reel="reel", length=1.0, line_density=1e-3, tip_mass=0.1, nodes=3, direction=(0.005, 0.0, -1.0)),
        "line",
    )
    return solve_implicit(system.assemble(), samples=np.linspace(0.0, 2.0, 41))


def gaining(solution: Solution, gain: float) -> Solution:
    """The same solution, its kinetic energy raised over the run by a gain, J."""
    assert solution.kept is not None
    balance = solution.kept.balance.copy()
    balance["kinetic"] += gain * np.linspace(0.0, 1.0, solution.t.size)
    return dataclasses.replace(solution, kept=solution.kept._replace(balance=balance))


def test_a_gain_that_matters_fails(swing: Solution) -> None:
    """The solver itself passes gains up to 1e-4 of the weight lifted by the string's length, here 98 uJ."""
    moved = swing.closure.moved
    assert 1e-6 < moved < 2e-3
    assert closure.check_energy_gain(swing) is swing
    assert swing.closure.gained < 0.02 * moved
    assert closure.check_energy_gain(gaining(swing, 0.05 * moved)).success
    assert gaining(swing, 0.05 * moved).closure.warns
    words = r"the energy balance has gained \S+ J, \S+ % of the \S+ J that were moved"
    assert re.match(words, closure.unclosed(gaining(swing, 1.7 * moved)))
    failed = closure.check_energy_gain(gaining(swing, 1.7 * moved))
    assert failed.status == "failed"
    assert "J that were moved; use a smaller `tolerance` or `step`" in failed.message


def test_a_failed_or_interrupted_run_stays_what_it_is(swing: Solution) -> None:
    other = dataclasses.replace(gaining(swing, 1.0), status="interrupted", message="interrupted at t = 1 s")
    assert closure.check_energy_gain(other) is other


@pytest.mark.parametrize("speed", [0.0, 1e-6])
@pytest.mark.parametrize(("method", "step"), [("energy-momentum", 0.01), ("generalized-alpha", 0.02)])
def test_round_off_is_no_failure(speed: float, method: str, step: float) -> None:
    """Energies of 1e-8 J beside elements of 2e7 J gain what they have, by the last digit alone."""
    run = beam(speed).simulate(until=0.3, every=0.05, method=method, step=step)
    assert run.attrs["status"] == "success"
    assert float(np.abs(run.energy_defect).max()) > 0.1 * float(run.energy.max())
    assert "is round-off compared with the energies of its elements and weights" in run.attrs["warning"]
    assert "the method itself" not in run.attrs["warning"]


@pytest.mark.slow
def test_energies_above_round_off_are_not_called_so() -> None:
    run = beam(0.1).simulate(until=0.01, every=0.001, method="energy-momentum")
    assert run.attrs["status"] == "success"
    assert "round-off" not in run.attrs.get("warning", "")
    defect = run.energy_defect.values
    climb = defect - np.minimum.accumulate(defect)
    assert float(climb.max()) < 1e-3 * float(run.energy.max())
