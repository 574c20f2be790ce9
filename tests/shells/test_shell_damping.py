"""Damping of shells by mass and stiffness: ratios of modes, tangent, and the balance of energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from shells.plates import material
from shells.test_shell_kernels import disturbed, forces

Array = np.ndarray


def strip(**keys: Any) -> System:
    """A cantilever of 1 x 0.2 m."""
    system = System()
    shell = parts.Shell(
        size=(1.0, 0.2), elements=(6, 1), thickness=0.02, material=material(1e9, 0.3), clamped=("x0",), **keys
    )
    system.add(shell, "shell")
    return system


def tangent(assembly: Assembly, y: Array, c_rate: float) -> Array:
    """Tangent of the equations without masses."""
    matrix = matrix_of(assembly.model)
    forces(assembly, y)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, c_rate, 1.0, assembly.model, matrix)
    return np.asarray(sparse_of(matrix).toarray())


def test_ratios_of_modes() -> None:
    """alpha/(2 w) + beta w/2 of each mode."""
    alpha, beta = 3.0, 2e-5
    plain = strip().modes(count=4)
    found = strip(mass_damping=alpha, stiffness_damping=beta).modes(count=4, damped=True)
    w = plain.frequency
    assert found.damping_ratio == pytest.approx(alpha / (2.0 * w) + 0.5 * beta * w, rel=1e-5)


def test_forces_by_velocities() -> None:
    """The damping forces of a state are its tangent by rates times the velocities, and take energy."""
    assembly, y = disturbed()
    damped, _ = disturbed(mass_damping=0.3, stiffness_damping=0.02)
    n_q, n_v = int(assembly.model.info.nq), int(assembly.model.info.nv)
    v = 0.1 * np.random.default_rng(3).standard_normal(n_v)
    y[n_q : n_q + n_v] = v
    viscous = forces(damped, y) - forces(assembly, y)
    C = tangent(damped, y, 1.0) - tangent(damped, y, 0.0) - tangent(assembly, y, 1.0) + tangent(assembly, y, 0.0)
    assert C @ v == pytest.approx(viscous, abs=1e-9 * np.abs(viscous).max())
    assert np.linalg.eigvalsh(0.5 * (C + C.T)).min() > -1e-12 * np.abs(C).max()


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_balance(method: str) -> None:
    """A strip that is released under a load loses what its damping takes."""
    system = strip(mass_damping=1.0, stiffness_damping=1e-3)
    system.add(parts.Load(along="shell.x1", force=(0.0, 0.0, 20.0), ramp=0.02), "load")
    run = system.simulate(until=0.3, every=0.1, method=method)
    assert run.attrs["status"] == "success"
    lost = run["energy_dissipated"].values[-1]
    assert lost > 0.1 * run["energy_elastic"].values[-1]
    assert np.abs(run["energy_defect"].values).max() < 2e-3 * lost
