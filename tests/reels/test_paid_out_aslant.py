"""The damper of the segment at the spool, where the thread leaves aslant to the pay-out axis.

A mass m on a light thread from a reel at rest moves with the angular momentum m h about the exit: at the distance b it
pulls with m h^2/b^3 where b grows steadily, and a damper of what does not stretch takes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from evolvent import System, model as mdl, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.observations import observe
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import Array, Run, fitted_order, run, tangent_error

M, B0, SPEED, ACROSS, RADIUS = 1.0, 1.0, 0.2, 0.05, 0.1
H2 = (B0 * ACROSS) ** 2
SAMPLES = np.linspace(0.0, 6.0, 61)


def tether(lag: float, *, drive: Any = None, damping: float = 20.0, out: float = 0.0, **thread: Any) -> Assembly:
    """A thread, 1 m of it out and stretched by its first tension, `lag` rad aslant to the pay-out axis x."""
    stiffness = thread.setdefault("stiffness", 2000.0)
    along, across = (math.cos(lag), math.sin(lag), 0.0), (-math.sin(lag), math.cos(lag), 0.0)
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=SPEED / RADIUS, angle=B0 / RADIUS) if drive is None else drive
    system.add(parts.Reel(body="hub", radius=RADIUS, centre=(0.0, 0.0, -RADIUS), drive=drive), "reel")
    length = B0 + M * H2 / B0**3 / stiffness
    velocity = tuple(SPEED * a + ACROSS * c for a, c in zip(along, across, strict=True))
    system.add(parts.Point(mass=M, position=tuple(length * a for a in along), velocity=velocity), "end")
    given = {"nodes": 1, "length": 3.0, "line_density": 1e-9, "boundary_segment": "constant"} | thread
    system.add(parts.Thread(reel="reel", end="end", damping=damping, **given), "tether")
    return system.assemble()


def alpha(assembly: Assembly, step: float = 0.01, **options: Any) -> Run:
    solution = solve_implicit(assembly, samples=SAMPLES, step=step, spectral_radius=0.9, **options)
    assert solution.success, solution.message
    return Run(assembly, solution, observe(assembly.model, solution.t, solution.y, solution.s))


def energy_momentum(assembly: Assembly) -> Run:
    solution = solve_energy(assembly, samples=SAMPLES, step=0.01, spectral_radius=0.9)
    assert solution.success, solution.message
    return Run(assembly, solution, observe(assembly.model, solution.t, solution.y, solution.s))


def explicit(assembly: Assembly) -> Run:
    return run(assembly, SAMPLES, rtol=1e-10, atol=1e-12)


METHODS: dict[str, Callable[[Assembly], Run]] = {
    "dopri5": explicit, "generalized-alpha": alpha, "energy-momentum": energy_momentum,
}  # fmt: skip


@pytest.mark.parametrize("thread", [{}, {"slack": True, "boundary_segment": "by-length"}], ids=["plain", "slack"])
@pytest.mark.parametrize("lag", [60.0, 110.0])
@pytest.mark.parametrize("method", METHODS)
def test_a_damper_does_not_pull_what_does_not_stretch(method: str, lag: float, thread: dict[str, Any]) -> None:
    """Millinewtons, beside 20 N s/m times 0.2 m/s; the drive takes in m h^2 (1/b0^2 - 1/b^2)/2, the damper nothing."""
    found = METHODS[method](tether(math.radians(lag), **thread))
    b, kinetic = B0 + SPEED * SAMPLES, 0.5 * M * H2 / B0**2
    later = SAMPLES > 0.5
    np.testing.assert_allclose(found.seen.tension[later, 0], (M * H2 / b**3)[later], rtol=0.02)
    assert found.seen.tension[:, 0].min() > 0.0
    taken = -0.5 * M * H2 * (1.0 / B0**2 - 1.0 / b**2)
    np.testing.assert_allclose(found.accounts[:, mdl.SPOOL], taken, atol=2e-3 * kinetic)
    assert -1e-12 < found.accounts[:, mdl.DISSIPATED].min()
    assert found.accounts[:, mdl.DISSIPATED].max() < 1e-4 * kinetic
    assert np.abs(found.energy_defect).max() < 1e-4 * kinetic


@pytest.mark.parametrize("method", METHODS)
def test_a_free_spool_is_pulled_by_what_stretches_alone(method: str) -> None:
    """(m + S/r^2) b'' = m h^2/b^3, whose solution is a parabola of b^2."""
    S = 0.004
    drive = parts.FreeSpool(inertia=S, angle=B0 / RADIUS, rate=SPEED / RADIUS)
    found = METHODS[method](tether(1.0, drive=drive))
    share = M / (M + S / RADIUS**2)
    square = B0**2 + 2.0 * B0 * SPEED * SAMPLES + (SPEED**2 + share * H2 / B0**2) * SAMPLES**2
    b, later = np.sqrt(square), SAMPLES > 0.5
    spool = int(found.assembly.model.threads["spool_q"][0])
    np.testing.assert_allclose(RADIUS * found.y[:, spool], b, rtol=1e-5)
    np.testing.assert_allclose(found.seen.tension[later, 0], (S / RADIUS**2 * share * H2 / b**3)[later], rtol=0.03)
    assert np.abs(found.energy_defect).max() < 1e-4 * 0.5 * M * ACROSS**2


def test_its_order() -> None:
    """Second, under generalized-alpha, of a spring so soft that its damper matters."""
    exact = explicit(tether(1.0, stiffness=20.0, damping=2.0)).y
    steps, errors = np.array([0.1, 0.05, 0.025]), []
    for step in steps:
        errors.append(np.abs(alpha(tether(1.0, stiffness=20.0, damping=2.0), float(step)).y - exact)[-1].max())
    assert 1.8 < fitted_order(steps, np.array(errors)) < 2.4


def test_nodes_leave_a_spool_that_is_aslant() -> None:
    """Every 2.5 s; the segment that begins has no elongation yet, and the mass swings by that for half a second."""
    found = alpha(tether(1.0, nodes=6, line_density=1e-4, slack=True, damping=60.0), tolerance=1e-7)
    b, later = B0 + SPEED * SAMPLES, np.fmod(SAMPLES + 1e-9, 2.5) > 0.8
    released = found.solution.s[:, 0]
    assert released[-1] == released[0] + 2
    hub = found.seen.tension[np.arange(SAMPLES.size), released - 1]
    np.testing.assert_allclose(hub[later], (M * H2 / b**3)[later], rtol=0.03)
    assert hub[1:].min() > 0.0


@pytest.mark.parametrize("boundary", ["constant", "by-length"])
@pytest.mark.parametrize("motion", ["driven", "spin", "free"])
def test_the_tangent_with_its_damper(motion: str, boundary: str, rng: np.random.Generator) -> None:
    """Of a tape aslant on a free spool, its body turning, its end on another body: central differences."""
    hub: dict[str, Any] = {"motion": motion, "axis": (0.0, 0.6, 0.8), "inertia": 0.4, "rate": 2.0}
    if motion == "free":
        hub = {"mass": 4.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.2, 0.5, 2.0)}
    system = System()
    system.add(parts.RigidBody(**hub), "hub")
    drive = parts.FreeSpool(inertia=2e-3, angle=14.0, rate=3.0)
    system.add(parts.Reel(body="hub", radius=RADIUS, centre=(0.5, 0.1, -RADIUS), drive=drive), "reel")
    hook = {"hook": (-0.1, 0.02, 0.0)}
    end = {"position": (1.4, 1.2, 0.3), "velocity": (0.1, 3.0, 0.2), "angular_velocity": (0.1, 0.4, -0.3)}
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.15), points=hook, **end), "load")
    system.add(
        parts.Thread(
            reel="reel", end="load.hook", length=4.0, line_density=0.1, nodes=4, stiffness=30.0, damping=5.0,
            thickness=1e-3, wound_mass="carried", boundary_segment=boundary,
        ),
        "tether",
    )  # fmt: skip
    assembly = system.assemble()
    assert assembly.s[0] == 2
    y: Array = assembly.y.copy()
    q, v = int(assembly.model.threads["iq"][0]), int(assembly.model.threads["iv"][0])
    y[q + 3 : q + 6] += (0.02, -0.1, 0.1)
    y[v + 3 : v + 6] += (0.3, -0.5, 0.4)
    assert tangent_error(assembly, y, rng) < 1e-6
