"""Free vibration of cantilevers of cables and beams: frequency, and the decay that the damping gives."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from elements.helpers import chain, damped_force, damped_tangent, is_beam
from evolvent.elements import Material, Rectangle, beam_mass, cable_bending, cable_mass
from evolvent.families.beams import cable

SECTION, MATERIAL = (
    Rectangle(thickness=0.01, width=0.02),
    Material(young_modulus=1e7, poisson_ratio=0.3, density=1000.0),
)
COUNT, LENGTH, B_TIME = 4, 1.0, 0.01
B = cable_bending(LENGTH / COUNT, SECTION, MATERIAL)
#: First mode of a cantilever: 1.8751^2 sqrt(EI/(rho A L^4)).
OMEGA = 1.875104**2 * np.sqrt(1e7 * 0.01**2 / 12.0 / 1000.0)


def assembled(c, element) -> np.ndarray:
    m = c.q[0].size
    A = np.zeros((c.q.size, c.q.size))
    for k in range(len(c.forms)):
        here = slice(k * m, (k + 2) * m)
        A[here, here] += element
    return A


def damped(c, q: np.ndarray, u: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Force and its derivative."""
    m, f, A = c.q[0].size, np.zeros(q.size), np.zeros((q.size, q.size))
    for k, form in enumerate(c.forms):
        s = slice(k * m, (k + 2) * m)
        damped_force(form, q[s], u[s], B_TIME, f[s])
        K = damped_tangent(form, q[s], u[s], B_TIME, rate)
        if not is_beam(form):
            cable.add_bending_damping(q[s], u[s], B_TIME, B, f[s])
            cable.add_bending_damping_tangent(q[s], u[s], B_TIME, rate, B, K)
        A[s, s] += K
    return f, A


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_the_first_mode_has_its_frequency_and_decays_by_half_b_omega_squared(formulation, book):
    c = chain(formulation, COUNT, LENGTH, SECTION, MATERIAL)
    make = cable_mass if formulation == "cable" else beam_mass
    M = assembled(c, np.kron(make(LENGTH / COUNT, SECTION, MATERIAL), np.eye(3)))
    free = c.clamped()
    free[:, :, 2] = False  # in the plane x, y
    if formulation != "cable":
        free[:, 3] = False
    keep = free.ravel()
    block = np.ix_(keep, keep)
    squares, modes = eigh(c.tangent(c.q)[block], M[block])
    omega = np.sqrt(squares[0])
    assert_allclose(omega, OMEGA, rtol=1e-3 if formulation == "cable" else 0.015)

    mode = np.zeros(c.q.size)
    mode[keep] = modes[:, 0]
    mode /= mode.reshape(c.q.shape)[-1, 0, 1]
    amplitude = 0.02
    q, u = c.q.ravel() + amplitude * mode, np.zeros(c.q.size)
    steps, iterations = 60, 0
    h = 2.0 * np.pi / omega / steps
    for _ in range(2 * steps):  # two periods, implicit midpoint rule
        new = u.copy()
        for _ in range(15):
            f, A = damped(c, q + 0.25 * h * (u + new), 0.5 * (u + new), 2.0 / h)
            residual = M @ (new - u) / h + f
            step = np.linalg.solve((M / h + 0.25 * h * A)[block], residual[keep])
            new[keep] -= step
            iterations += 1
            if np.abs(step).max() < 1e-9 * amplitude:
                break
        else:
            raise AssertionError("Newton does not converge")
        q, u = q + 0.5 * h * (u + new), new
    tip = q.reshape(c.q.shape)[-1, 0, 1] / amplitude
    assert_allclose(tip, np.exp(-0.5 * B_TIME * omega**2 * 4.0 * np.pi / omega), rtol=5e-3)
    assert iterations < 7 * 2 * steps
    book(
        "Modes", f"Cantilever of 4 elements, decay by stiffness damping ({formulation})",
        reference="exp(-b w^2 t/2) after two periods", source="closed form",
        error=abs(tip / np.exp(-0.5 * B_TIME * omega**2 * 4.0 * np.pi / omega) - 1.0), allowed=5e-3,
    )  # fmt: skip
