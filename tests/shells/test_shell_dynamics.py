"""Motions of shells: what is conserved in steps of any length, the order in time, an independent pendulum."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material
from evolvent.equations import energy_momentum as flow
from evolvent.equations.implicit import momenta
from evolvent.kernels.rigid import kinematics
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order
from implicit.rigs import step_tangents
from shells.plates import material

Array = np.ndarray
CHAPTER = "Dynamics"
SOLVERS: dict[str, Callable[..., Any]] = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}


#: A part of a cylinder that spins at 6.4 rad/s about an axis that is none of its principal ones.
SPINNING: dict[str, Any] = {
    "size": (1.0, 0.6), "radius": 0.8, "elements": (2, 2), "thickness": 0.05, "material": material(1e6, 0.3),
    "angular_velocity": (1.0, 2.0, 6.0),
}  # fmt: skip
#: One whose deformation steps of some milliseconds resolve.
SOFT = SPINNING | {"thickness": 0.1, "material": material(2e4, 0.3)}


def tumbling(**keys: Any) -> Assembly:
    system = System()
    system.add(parts.Shell(**(SPINNING | keys)), "shell")
    return system.assemble()


class Flight(NamedTuple):
    """Both momenta (nt, 6) and the energies (nt,) of a run."""

    momenta: Array
    energy: Array
    elastic: Array
    divided: int

    def off(self, first: int) -> float:
        """Change of the linear (0) or angular (3) momentum, relative."""
        own = self.momenta[:, first : first + 3]
        return float(np.abs(own - own[0]).max() / np.linalg.norm(own[0]))


def flown(assembly: Assembly, steps: int, step: float, radius: float, samples: int = 100) -> Flight:
    times = np.linspace(0.0, steps * step, samples + 1)
    found: Any = solve_energy(assembly, samples=times, step=step, spectral_radius=radius)
    assert found.success, found.message
    sums = np.zeros((times.size, 6))
    for y, row in zip(found.y, sums, strict=True):
        kinematics(0.0, y, assembly.model)
        momenta(y, assembly.model, row)
    balance = found.kept.balance
    return Flight(sums, balance.kinetic + balance.elastic, balance.elastic, int(found.statistics["divided_steps"]))


@pytest.mark.parametrize("radius", [1.0, 1.0 / 3.0])
def test_free_shell_in_large_steps(radius: float, book: Book) -> None:
    """It tumbles by 0.13 rad a step, bent by its spin; all is kept but the energy that a radius below 1 dissipates."""
    found = flown(tumbling(elements=(3, 3), velocity=(0.3, 0.0, 0.0)), 200, 0.02, radius)
    assert found.divided == 0
    assert found.elastic.max() > 1e-3 * found.energy[0]
    name = f"Free shell, 0.13 rad a step (radius {radius:.2g})"
    book(
        CHAPTER, f"{name}: momenta", reference="constant", source="closed form",
        error=max(found.off(0), found.off(3)), allowed=1e-12,
    )  # fmt: skip
    if radius == 1.0:
        book(
            CHAPTER, f"{name}: energy", reference="constant", source="closed form",
            error=np.abs(found.energy / found.energy[0] - 1.0).max(), allowed=1e-12,
        )  # fmt: skip
    assert found.energy.max() < found.energy[0] * (1.0 + 1e-12)
    assert radius == 1.0 or found.energy[-1] < found.energy[0] * (1.0 - 1e-5)


@pytest.mark.parametrize("step", [0.05, 0.1])
def test_large_steps_gain_no_energy(step: float) -> None:
    """Steps of 0.3 and 0.6 rad, and of many periods of the fastest modes."""
    found = flown(tumbling(), 60, step, 0.5, samples=60)
    assert found.divided == 0
    assert found.energy.max() < found.energy[0] * (1.0 + 1e-12)
    assert found.off(3) < 1e-12


@pytest.mark.slow
def test_thousand_turns(book: Book) -> None:
    """Of 0.13 rad a step, so thick that what is strained does not leak into modes which the steps do not resolve.

    Its centre of mass rests. Where it flies away at 3.7 m/s it ends 3.6 km off, where positions are rounded to
    4.5e-13 m: beside an element of 0.3 m this is 1.5e-12, and momentum about the origin is as coarse.
    """
    count = 49100
    assert 0.02 * count * np.sqrt(41.0) > 2000.0 * np.pi
    shell = tumbling(thickness=0.1)
    sums = np.zeros(6)
    kinematics(0.0, shell.y, shell.model)
    momenta(shell.y, shell.model, sums)
    centre = -sums[:3] / shell.model.bodies["mass"].sum()
    found = flown(tumbling(thickness=0.1, velocity=tuple(centre.tolist())), count, 0.02, 1.0)
    assert found.divided == 0
    for what, error, allowed in (
        ("angular momentum", found.off(3), 1e-12), ("energy", np.abs(found.energy / found.energy[0] - 1.0).max(), 2e-12)
    ):  # fmt: skip
        book(
            CHAPTER, f"Free shell, 1000 turns in {count} steps: {what}", reference="constant", source="closed form",
            error=error, allowed=allowed,
        )  # fmt: skip


@pytest.mark.parametrize("method", SOLVERS)
def test_order_in_time(method: str, book: Book) -> None:
    assembly = tumbling(**SOFT)
    n_q, steps = int(assembly.model.info.nq), np.array([8e-3, 4e-3, 2e-3, 1e-3])
    ends = []
    for step in steps:
        found = SOLVERS[method](assembly, samples=(0.0, 0.24), step=step, spectral_radius=0.9)
        assert found.success, found.message
        ends.append(found.y[-1][:n_q])
    limit = ends[-1] + (ends[-1] - ends[-2]) / 3.0
    errors = [float(np.linalg.norm(end - limit)) for end in ends[:-1]]
    book(
        CHAPTER, f"Free shell, steps of 4 ms ({method})", reference="limit of the steps", source="extrapolation",
        error=errors[1] / np.linalg.norm(ends[-1] - assembly.y[:n_q]), allowed=5e-3,
        order=fitted_order(steps[:-1], errors), wanted="2",
    )  # fmt: skip
    assert fitted_order(steps[:-1], errors) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("method", SOLVERS)
def test_swinging_strip(method: str, book: Book) -> None:
    """The flexible pendulum of the rods, as a shell that hinges along its edge."""
    system = System(gravity=(0.0, 0.0, -9.81))
    soft = Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0)
    shell = parts.Shell(size=(1.0, 0.02), elements=(40, 1), thickness=0.02, material=soft)
    system.add(shell, "shell")
    for node in shell.edge("x0"):
        system.add(parts.Joint(a=tuple(shell.mesh()[0].reshape(-1, 3)[node]), b=f"shell[{node}]"), f"hinge {node}")
    assembly = system.assemble()
    found = SOLVERS[method](assembly, samples=[0.0, 0.5, 1.0], step=1e-3, spectral_radius=0.9)
    assert found.success, found.message
    tip = shell.edge("x1")[0]
    for k, wanted in enumerate(((-0.193659, -0.952471), (-0.92709, 0.10384))):
        kinematics(0.0, found.y[1 + k], assembly.model)
        x = assembly.model.bodies["x"][1 + tip]
        book(
            CHAPTER, f"Flexible pendulum of 1 m, tip at {0.5 * (k + 1):g} s (shell, 40 elements, {method})",
            reference=f"Reissner's beam, ({wanted[0]:g}, {wanted[1]:g}) m", source="finite volumes, SciPy DOP853",
            error=np.linalg.norm(x[[0, 2]] - wanted), allowed=1e-3, unit="m",
        )  # fmt: skip


def test_tangent_of_a_step_is_exact() -> None:
    """In a step that turns the shell by 0.13 rad and strains it."""
    assembly = tumbling()
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=0.02, spectral_radius=1.0)
    model, step = plan.assembly.model, plan.workspace().step
    n_q, n_v, h = int(model.info.nq), int(model.info.nv), 0.02
    step.y0[:] = assembly.y[: step.y0.size]
    step.step.h = h
    flow.measure(0, model, step)
    start = h * assembly.y[n_q : n_q + n_v] + 2e-3 * np.random.default_rng(0).standard_normal(n_v)

    found, wanted = step_tangents(plan, step, start)
    assert found == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())


def test_methods_agree_and_results_hold_the_balance() -> None:
    """Explicit steps of fifth order, and steps that conserve energy; results hold energies and momenta."""
    system = System()
    system.add(parts.Shell(**SOFT), "shell")
    runs = [
        system.simulate(until=0.24, every=0.04, method="dopri5", tolerance=1e-7),
        system.simulate(until=0.24, every=0.04, method="energy-momentum", step=2.5e-4),
    ]
    first, second = (run["shell"]["position"].values for run in runs)
    assert second == pytest.approx(first, abs=5e-6)
    for run in runs:
        own: Any = run["shell"]
        energy = own["energy_kinetic"] + own["energy_elastic"]
        assert own["energy_elastic"].max() > 0.05 * energy[0]
        assert energy.values == pytest.approx(energy.values[0], rel=1e-5)
        assert own["momentum"].values == pytest.approx(np.tile(own["momentum"].values[0], (7, 1)), abs=1e-9)
        spin = own["angular_momentum"].values
        assert spin == pytest.approx(np.tile(spin[0], (7, 1)), rel=1e-6, abs=1e-6)
        assert (own["energy_bending"] + own["energy_drilling"] < own["energy_elastic"])[1:].all()
