"""Modes of hanging, turning and pressed cables and beams."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from book import Book
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modal.modes import modes
from helpers import fitted_order
from static.composing import EI, STEEL, beam, tip_force
from static.test_modes import BAR, UNIT, across

CHAPTER = "Modes"


def test_hanging_chain(book: Book) -> None:
    """A cable of hardly any bending stiffness, hung by one end; zeros of Bessel's J0."""
    thin, material, n = (
        Rectangle(thickness=1e-5, width=1e-2),
        Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0),
        32,
    )
    start = np.zeros((n + 1, 2, 3))
    start[:, 0, 1], start[:, 1, 1] = -np.linspace(0.0, 1.0, n + 1), -1.0
    a = beam("cable", n, ("spherical",), section=thin, material=material, nodes=start, gravity=(0.0, -9.81, 0.0))
    found = modes(a, count=6)
    w = found.frequency[found.frequency > 0.1][::2][:2] / np.sqrt(9.81)
    book(
        CHAPTER, "Hanging chain (cable, 32 elements)", reference="1.202413, 2.760039 sqrt(g/L)",
        source="closed form, zeros of J0", error=np.abs(w / (1.202413, 2.760039) - 1.0).max(), allowed=1e-3,
    )  # fmt: skip


SECOND = {2.0: 22.614922, 6.0: 26.809082, 12.0: 37.603112}


@pytest.mark.parametrize("eta", list(SECOND))
def test_second_modes_of_a_turning_cantilever(eta: float, book: Book) -> None:
    found = modes(beam("cable", 24, section=BAR), rotating=(0.0, 0.0, eta * UNIT), count=6)
    w = found.frequency / UNIT
    flap, lag = w[across(found, 2)[1]], w[across(found, 1)[1]]
    book(
        CHAPTER, f"Turning cantilever, second flap, eta = {eta:g} (cable)", reference=f"{SECOND[eta]} sqrt(EI/m L^4)",
        source="series solution", error=abs(flap / SECOND[eta] - 1.0), allowed=1e-4,
    )  # fmt: skip
    book(
        CHAPTER, f"Turning cantilever, second lag, eta = {eta:g} (cable)", reference="lag^2 = flap^2 - eta^2",
        source="closed form", error=abs(lag / np.sqrt(SECOND[eta] ** 2 - eta**2) - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("ends", "name", "factor"), [(("clamp",), "clamped and free", 0.25), (("spherical", "spherical"), "pinned", 1.0)]
)
def test_euler_buckling(ends: tuple[str, ...], name: str, factor: float, book: Book) -> None:
    section = Rectangle(thickness=1e-3, width=2e-2)

    def least(part: float) -> float:
        force = -factor * np.pi**2 * EI * part
        if len(ends) == 1:
            a = beam("cable", 16, ends, section=section, more=tip_force(force, 0.0, 0.0))
        else:  # between pins, by the stretch that it is held with
            strain = force / (STEEL.E * 2e-5)
            start = np.zeros((17, 2, 3))
            start[:, 0, 0], start[:, 1, 0] = np.linspace(0.0, 1.0 + strain, 17), 1.0 + strain
            a = beam("cable", 16, ends, section=section, nodes=start)
        return float(modes(a, count=1).square[0])

    found = brentq(least, 0.99, 1.01, xtol=1e-7)
    book(
        "Statics of beams", f"Euler's load, {name} (cable, 16 elements)",
        reference=f"{factor:g} pi^2 EI/L^2", source="closed form", error=abs(found - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.slow
def test_timoshenko_beam(book: Book) -> None:
    """A thick beam between pins, L/h = 10: shear and rotary inertia take 1.6, 6 and 12 % off what Euler's beam has."""
    section = Rectangle(thickness=0.1, width=0.16)
    p, E, rho = section.properties(STEEL.nu), STEEL.E, STEEL.density
    shear = p.shear_y * E / (2.0 * (1.0 + STEEL.nu))
    k = np.pi * np.arange(1, 4)
    # rho^2 I/(ks G) w^4 - [rho A + rho I (1 + E/(ks G)) k^2] w^2 + E I k^4 = 0
    a, b = rho**2 * p.Iz / shear, rho * p.area + rho * p.Iz * (1.0 + E / shear) * k**2
    exact = np.sqrt((b - np.sqrt(b * b - 4.0 * a * E * p.Iz * k**4)) / (2.0 * a))
    counts, errors = (16, 32, 64), []
    for count in counts:
        found = modes(beam("assumed_strain", count, ("spherical", "spherical"), section=section), count=12)
        bent = found.frequency[across(found, 1)]
        errors.append(bent[bent > 1.0][:3] / exact - 1.0)  # but the turn about its own axis
    order = fitted_order([1.0 / n for n in counts], [np.abs(e).max() for e in errors])
    assert order == pytest.approx(2.0, abs=0.15)
    for name, error, allowed in (
        ("64 elements", errors[-1], 1e-3), ("limit", (4.0 * errors[-1] - errors[-2]) / 3.0, 1e-5),
    ):  # fmt: skip
        book(
            CHAPTER, f"Timoshenko's beam, pinned, L/h = 10: 3 frequencies (assumed_strain, {name})",
            reference="1419.34, 5427.19, 11443.1 rad/s", source="closed form", error=np.abs(error).max(),
            allowed=allowed, order=order if name != "limit" else None, wanted="2",
        )  # fmt: skip
    assert exact == pytest.approx([1419.34, 5427.19, 11443.1], rel=1e-5)
