"""Threads under energy-momentum: energy and angular momentum to round-off, and the motion of dopri5."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import Solution, solve
from evolvent.solvers.common.sampled import angular_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy

END = 0.6
DRIVE = parts.RampDrive(rate=0.0, angle=4.0, steps=[(0.1, 0.4, 10.0)])
FREE = {"mass": 5.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.1, 0.05, 1.5)}
SPIN = {"motion": "spin", "inertia": 0.5, "axis": (0.0, 0.0, 1.0), "rate": 1.5}
DRIVEN = {"motion": "driven", "axis": (0.0, 0.0, 1.0), "rate": 1.5}


def craft(
    hub: dict[str, Any], *, drive: Any = DRIVE, end: bool = False, gravity: Any = (0.0, 0.0, 0.0), **thread: Any
) -> Assembly:
    """A hub that turns, and a thread from its reel off the axis, at whose end another body may be."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(**hub), "hub")
    system.add(parts.Reel(body="hub", centre=(0.3, 0.05, -0.1), radius=0.1, drive=drive), "reel")
    if end:
        system.add(
            parts.RigidBody(
                mass=1.0, inertia=(0.02, 0.03, 0.04), position=(0.71, 0.05, 0.0), velocity=(0.0, 1.2, 0.1),
                points={"hook": (-0.01, 0.0, 0.0)}, angular_velocity=(0.2, 0.3, 1.0),
            ),
            "end",
        )  # fmt: skip
        thread["end"] = "end.hook"
    fields = {"wound_mass": "carried", "stiffness": 2e3} | thread
    system.add(parts.Thread(reel="reel", length=1.5, nodes=6, line_density=0.4, tip_mass=0.1, **fields), "thread")
    return system.assemble()


def run(assembly: Assembly, step: float, rho: float = 1.0) -> Solution:
    found = solve_energy(assembly, samples=np.array([0.0, END]), step=step, spectral_radius=rho)
    assert found.success, found.message
    return found


CASES = {
    "end on a body": craft(FREE, end=True),
    "tape on a spinning hub": craft(SPIN, thickness=1e-3, multiplicity=2),
    "driven hub, damped": craft(DRIVEN, damping=2.0, gravity=(0.0, 0.0, -1.0)),
    "slack": craft(FREE, slack=True, wound_mass="ignored"),
    "free spool": craft(
        FREE, drive=parts.FreeSpool(inertia=0.002, angle=4.0, rate=3.0, viscous_damping=1e-3, torque=1e-2)
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_energy_closes(name: str) -> None:
    """Without numerical damping to round-off: the drive's work is that of the tension on what it pays out."""
    found = run(CASES[name], 0.004)
    assert found.statistics["events"] >= (1 if name != "free spool" else 0)
    assert found.statistics["energy_defect"] < 1e-12


@pytest.mark.parametrize("name", ["end on a body", "free spool"])
def test_angular_momentum_is_kept(name: str) -> None:
    """Wound thread, spools and an end body are part of it, over steps that do not resolve the segments."""
    found = run(CASES[name], 0.01)
    H = angular_momentum(found.sums)
    assert np.abs(H[-1] - H[0]).max() < 2e-9  # what Newton's method may leave


@pytest.mark.parametrize("name", CASES)
def test_the_motion_is_that_of_dopri5(name: str) -> None:
    """Of second order in the step, through a release."""
    assembly = CASES[name]
    exact = solve(assembly, samples=np.array([0.0, END]), method="dopri5", rtol=1e-9, atol=1e-11).y[-1]
    n = int(assembly.model.info.nq)
    off = [np.abs(run(assembly, step).y[-1] - exact)[:n].max() for step in (2e-3, 1e-3, 5e-4)]
    assert off[2] < 2e-5
    assert 0.5 * np.log2(off[0] / off[2]) == pytest.approx(2.0, abs=0.3)
