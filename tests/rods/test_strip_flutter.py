"""Flutter of a strip under sunlight: growth rates about the coned equilibrium, against an independent small model."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest
import scipy.linalg

from book import Book
from evolvent import System, parts
from evolvent.elements import Material, Strip

Array = np.ndarray
CHORD, THICKNESS, ELEMENTS = 0.02, 1e-5, 12
PAGE = pathlib.Path(__file__).parents[2] / "docs" / "theory" / "strip-blade.md"


def mirror(p: float, edgewise: float, damping: float) -> System:
    """A strip of length, mass and rate 1 that flaps freely and is held edgewise and in pitch at its root.

    Parameters
    ----------
    p : float, of `sunlight_coning` over l; edgewise : float, EI/(m W^2 l^4)
    damping : float, of the strains' rates, over the rate of the spin
    """
    area = CHORD * THICKNESS
    material = Material(young_modulus=12.0 * edgewise / (area * CHORD**2), poisson_ratio=0.3, density=1.0 / area)
    system = System()
    rod = parts.Rod(
        length=1.0, section=Strip(thickness=THICKNESS, width=CHORD), material=material, elements=ELEMENTS,
        normal=(0, 0, 1), angular_velocity=(0, 0, 1.0), stiffness_damping=damping,
    )  # fmt: skip
    system.add(rod, "strip")
    system.add(parts.RigidBody(motion="driven", rate=1.0), "base")
    system.add(parts.Joint(a=("base", (0, 0, 0)), b="strip.root", type="revolute", axis=(0, 1, 0)), "flap")
    if p > 0.0:
        system.add(parts.Radiation(along="strip", pressure=0.5 * p / CHORD, specular=1.0), "light")
    return system


def growth(p: float, edgewise: float, damping: float = 0.0) -> tuple[float, float]:
    """Largest growth rate and its frequency, over the rate of the spin."""
    pole = mirror(p, edgewise, damping).modes(count=8, rotating=(0, 0, 1.0), damped=True).pole
    k = int(np.argmax(pole.real))
    return float(pole[k].real), abs(float(pole[k].imag))


def small_model(p: float, edgewise: float, terms: int = 8) -> tuple[float, float]:
    """The same by two fields, edgewise deflection v and twist u, on the coned strip w = 2 p ln(1 + x), to first order.

    Notes
    -----
    Edgewise curvature v'' + u w'', light -p u along v, Legendre polynomials (Ritz). Without Coriolis forces, whose
    effect on v and u is of the order p^2.
    """
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = 0.5 * (x + 1.0), 0.5 * weight

    def fields(first: int) -> Array:
        own = np.polynomial.Polynomial([0.0] * first + [1.0])
        made = [
            np.polynomial.Legendre.basis(k, domain=[0, 1]).convert(kind=np.polynomial.Polynomial) * own
            for k in range(terms)
        ]
        return np.array([[f(x), f.deriv()(x), f.deriv(2)(x)] for f in made])

    def mean(a: Array, b: Array, factor: Array) -> Array:
        return np.asarray((a * (weight * factor)) @ b.T)

    V, U, one, r2 = fields(2), fields(1), np.ones_like(x), CHORD**2 / 12.0
    w2, N = -2.0 * p / (1.0 + x) ** 2, 0.5 * (1.0 - x * x)
    M, J = mean(V[:, 0], V[:, 0], one), r2 * mean(U[:, 0], U[:, 0], one)
    own = mean(V[:, 1], V[:, 1], N) - M + edgewise * mean(V[:, 2], V[:, 2], one)
    twist = r2 * mean(U[:, 1], U[:, 1], N) + J + edgewise * mean(U[:, 0], U[:, 0], w2**2)
    bend, light = edgewise * mean(V[:, 2], U[:, 0], w2), p * mean(V[:, 0], U[:, 0], one)
    square = scipy.linalg.eigvals(np.block([[own, bend + light], [bend.T, twist]]), scipy.linalg.block_diag(M, J))
    pole = np.sqrt(-square.astype(complex))
    pole = np.where(pole.real < 0.0, -pole, pole)
    k = int(np.argmax(pole.real))
    return float(pole[k].real), abs(float(pole[k].imag))


@pytest.mark.slow
def test_growth_against_a_small_model(book: Book) -> None:
    errors = []
    for p, edgewise in ((0.01, 0.1), (0.03, 0.1)):
        found, wanted = np.array(growth(p, edgewise)), np.array(small_model(p, edgewise))
        errors.append(np.abs(found / wanted - 1.0).max())
    assert growth(0.003, 0.1)[0] < 1e-9  # the small model has none either
    assert small_model(0.003, 0.1)[0] < 1e-9
    book(
        "Modes", "flutter of a spinning strip under sunlight: growth rate and frequency (rod, 12 elements)",
        reference="Ritz, two fields", source="independent small model", error=max(errors), allowed=0.01,
    )  # fmt: skip


def row_of(edgewise: float, damping: float) -> str:
    """A row of the page: largest growth rates at each p."""
    found = [growth(p, edgewise, damping)[0] for p in (0.001, 0.003, 0.01, 0.03)]
    words = ["0" if one < 1e-9 else f"{one:.1e}" for one in found]
    return f"| {edgewise:g} | {damping:g} | " + " | ".join(words) + " |"


@pytest.mark.slow
@pytest.mark.parametrize(("edgewise", "damping"), [(0.01, 0.0), (0.01, 0.01), (0.1, 0.0), (0.1, 0.01)])
def test_growth_rates_of_the_page(edgewise: float, damping: float) -> None:
    row = row_of(edgewise, damping)
    assert row in PAGE.read_text(encoding="utf-8"), row
