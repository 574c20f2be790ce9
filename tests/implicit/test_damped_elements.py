"""Damping of chosen elements: its power by quadrature, its tangent, its modes, its account."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, model as mdl, parts
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit
from evolvent.model import powers
from evolvent.solvers.static.linear_motion import matrices
from evolvent.solvers.static.work import Work
from helpers import accounts, derivative, run as run_explicit
from implicit.rigs import RUBBER, SQUARE, run
from implicit.test_tangent import disturbed, worst

Array = np.ndarray
ALPHA, LENGTH, N = 0.7, 1.2, 4
GAUSS, WEIGHT = np.polynomial.legendre.leggauss(8)


def system(formulation: str, damped: list[int] | None, beta: float = 0.0, **fields: object) -> Assembly:
    """A free beam, damped in some of its elements."""
    found = System()
    found.add(
        parts.Beam(
            length=LENGTH, section=SQUARE, material=RUBBER, elements=N, formulation=formulation, mass_damping=ALPHA,
            stiffness_damping=beta, damped=damped, **fields,  # type: ignore[arg-type]
        ),
        "beam",
    )  # fmt: skip
    return found.assemble()


def shapes(xi: float, eta: float, zeta: float, h: float, vectors: int) -> Array:
    """Shape functions of an element's vectors at (xi, eta, zeta), in parts of its length."""
    S = [1 - 3 * xi**2 + 2 * xi**3, h * (xi - 2 * xi**2 + xi**3), 3 * xi**2 - 2 * xi**3, h * (xi**3 - xi**2)]
    if vectors == 2:
        return np.array(S)
    return np.array([*S[:2], h * eta * (1 - xi), h * zeta * (1 - xi), *S[2:], h * xi * eta, h * xi * zeta])


def twice_kinetic(rates: Array, element: int) -> float:
    """Integral of rho |v|^2 over the volume of one element, by Gauss's points. rates : (n + 1, vectors, 3)."""
    h, vectors = LENGTH / N, rates.shape[1]
    u = rates[element : element + 2].reshape(-1, 3)
    half = 0.5 * SQUARE.thickness / h, 0.5 * SQUARE.width / h
    total = 0.0
    for x, wx in zip(0.5 * (1 + GAUSS), 0.5 * WEIGHT, strict=True):
        for y, wy in zip(half[0] * GAUSS, 0.5 * WEIGHT, strict=True):
            for z, wz in zip(half[1] * GAUSS, 0.5 * WEIGHT, strict=True):
                v = shapes(x, y, z, h, vectors) @ u
                total += wx * wy * wz * float(v @ v)
    return RUBBER.density * SQUARE.thickness * SQUARE.width * h * total


def rates_of(assembly: Assembly, y: Array) -> Array:
    row = assembly.model.beams[0]
    k = 2 if row["kind"] == 0 else 4
    iv = int(assembly.model.elements["iv"][0])
    return y[iv : iv + 3 * k * (N + 1)].reshape(N + 1, k, 3)


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch", "assumed_strain"])
def test_power_of_a_chosen_element(formulation: str, rng: np.random.Generator) -> None:
    """alpha v^T M_e v of the implicit residual, of the explicit account and of the modes' damping matrix."""
    assembly = system(formulation, [2])
    equations = disturbed(assembly, rng)
    expected = ALPHA * twice_kinetic(rates_of(assembly, equations.y), 2)
    model, n_q, n_v = assembly.model, int(assembly.model.info.nq), int(assembly.model.info.nv)
    power, r = np.zeros(powers.N_POWERS), np.zeros(4 * n_v)
    implicit.residual(0.0, equations.y, np.zeros(n_v), np.zeros(0), 0.0, 1.0, model, r, power)
    assert power[powers.MASS_DAMPING] == pytest.approx(expected, rel=1e-10)
    dy = derivative(assembly)(0.0, equations.y)
    booked = accounts(assembly, dy)
    assert booked[mdl.N_ACCOUNTS + mdl.BY_MASS] == pytest.approx(expected, rel=1e-10)
    assert booked[mdl.DISSIPATED] == pytest.approx(expected, rel=1e-10)
    v = equations.y[n_q : n_q + n_v]
    C = matrices(Work(assembly, assembly.y, 0.0, np.zeros(9)))[1]
    assert v @ (C @ v) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch", "assumed_strain"])
def test_all_elements_named_are_the_whole_beam(formulation: str, rng: np.random.Generator) -> None:
    named, whole = system(formulation, [3, 1, 0, 2]), system(formulation, None)
    state = disturbed(whole, rng).y
    one, other = derivative(named)(0.0, state), derivative(whole)(0.0, state)
    assert one == pytest.approx(other, rel=1e-13, abs=1e-13 * np.abs(other).max())


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch", "assumed_strain"])
def test_tangent(formulation: str, rng: np.random.Generator) -> None:
    equations = disturbed(system(formulation, [0, 3], beta=2e-3), rng)
    assert worst(equations, np.zeros(0)) < 1e-7


def test_the_account_closes_and_both_methods_take_the_same() -> None:
    """A thrown beam that is damped at one end."""
    straight = system("cable", None)
    rates = np.cross([0.3, -0.2, 1.0], straight.y[: 6 * (N + 1)].reshape(N + 1, 2, 3))
    rates[:, 0] += [0.1, 0.2, -0.3]
    assembly = system("cable", [3], rates=rates)
    samples = np.linspace(0.0, 1.0, 5)
    exact = run_explicit(assembly, samples, "dopri5", rtol=1e-10, atol=1e-12)
    assert np.abs(exact.energy_defect).max() < 1e-8 * exact.energy[0]
    taken = exact.accounts[-1, mdl.N_ACCOUNTS + mdl.BY_MASS]
    assert taken > 0.05 * exact.energy[0]
    found = run(assembly, samples, step=1e-3, spectral_radius=0.8)
    assert found.balance.by_mass[-1] == pytest.approx(taken, rel=1e-4)
    energy = found.balance.kinetic + found.balance.elastic
    assert energy[0] - energy[-1] == pytest.approx(taken, rel=1e-3)
