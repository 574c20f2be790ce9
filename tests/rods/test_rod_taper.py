"""Tapered rods: their masses are lumped by their own distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from evolvent import System, parts
from evolvent.elements import Circle, Taper, rods
from evolvent.elements.inertia import OWN_INERTIA
from evolvent.elements.materials import Material

E, RHO, R, L = 1e6, 1000.0, 0.01, 1.0


def reference(tip: float, elements: int = 200) -> np.ndarray:
    """Frequencies (Hz) of a clamped cone by cubic elements of Euler and Bernoulli, `tip` the ratio of the radii."""
    n, h = 2 * (elements + 1), L / elements
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        own = slice(2 * e, 2 * e + 4)
        for p, w in zip(*np.polynomial.legendre.leggauss(6), strict=True):
            x = 0.5 * (p + 1.0)
            r = R * (1.0 + (tip - 1.0) * (e + x) / elements)
            B = np.array([-6 + 12 * x, h * (-4 + 6 * x), 6 - 12 * x, h * (-2 + 6 * x)]) / h**2
            N = np.array([1 - 3 * x**2 + 2 * x**3, h * x * (1 - x) ** 2, 3 * x**2 - 2 * x**3, h * x**2 * (x - 1)])
            K[own, own] += E * np.pi * r**4 / 4 * np.outer(B, B) * w * h / 2
            M[own, own] += RHO * np.pi * r**2 * np.outer(N, N) * w * h / 2
    return np.sqrt(eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True)[:2]) / (2.0 * np.pi)


@pytest.mark.slow
@pytest.mark.parametrize("tip", [0.5, 0.1, 0.01])
def test_two_modes_of_a_cone(tip):
    """By ten elements both within 1 %; with half of the mass at each node the second would be 23 % off at 0.01."""
    section = Taper(root=Circle(radius=R), tip=Circle(radius=R * tip))
    system = System()
    material = {"young_modulus": E, "poisson_ratio": 0.3, "density": RHO}
    system.add(parts.Rod(length=L, section=section, material=material, elements=10), "cone")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="cone.root", type="clamp"), "clamp")
    found = system.modes(count=4).frequency_hz[::2]
    assert found == pytest.approx(reference(tip), rel=1e-2)


@pytest.mark.parametrize("tip", [0.999999, 0.5, 0.05])
def test_lumped_masses_keep_mass_and_first_moment(tip):
    """Sums over an element are those of its distribution; of a nearly uniform one those of a uniform one."""
    material = Material(young_modulus=E, poisson_ratio=0.3, density=RHO)
    section = Taper(root=Circle(radius=R), tip=Circle(radius=R * tip))
    a, b = rods.element_inertia(L, section, material, OWN_INERTIA)
    x = np.linspace(0.0, L, 20_001)
    m = RHO * np.pi * (R * (1.0 + (tip - 1.0) * x / L)) ** 2
    assert a.mass + b.mass == pytest.approx(np.trapezoid(m, x), rel=1e-6)
    assert a.moment + b.moment + L * b.mass == pytest.approx(np.trapezoid(m * x, x), rel=1e-6)
    if tip > 0.9:
        one, two = rods.element_inertia(L, Circle(radius=R), material, OWN_INERTIA)
        assert [a.mass, b.mass, a.moment, b.moment] == pytest.approx(
            [one.mass, two.mass, one.moment, two.moment], rel=1e-4
        )
