"""Bending stiffness of an element that is wound on a hub, over the true one: what locks, and how much.

An element of a rib (12 m x 0.03 m x 0.0003 m; Yi et al. 2017) spans the angle l/R of the hub. Directors and slopes at
its ends stand as on the arc; chord and lengths of slopes and directors are those of least energy. The reference values
were found before by other means, to three or four digits; the elastic line's with nu = 0.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from elements.helpers import is_beam
from evolvent.elements import Form, Material, Rectangle, beam_form, cable_form, straight_beam, straight_cable
from evolvent.elements.forms import products

RADIUS, RIB = 0.6, 12.0
SECTION = Rectangle(thickness=3e-4, width=0.03)


def arc(form: Form, length: float, p: np.ndarray) -> np.ndarray:
    """Coordinates from chord/length, length of the slopes and, of a beam, lengths of both directors."""
    a = 0.5 * length / RADIUS
    nodes = []
    for x, angle in ((0.0, -a), (p[0] * length, a)):
        t, n = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
        nodes += [np.array([x, 0.0, 0.0]), p[1] * t]
        if is_beam(form):
            nodes += [p[2] * n, np.array([0.0, 0.0, p[3]])]
    return np.concatenate(nodes)


def bending_ratio(formulation: str, elements: int, nu: float = 0.3) -> float:
    """Least energy of an element on the arc over 1/2 EI l/R^2."""
    length, material = RIB / elements, Material(young_modulus=5e6, poisson_ratio=nu, density=1600.0)
    bending = 0.5 * material.E * SECTION.properties(nu).Iz * length / RADIUS**2
    a = 0.5 * length / RADIUS
    if formulation == "cable":
        form = cable_form(length, SECTION, material)
        straight, start = straight_cable(length), [np.sin(a) / a, 1.0]
    else:
        form = beam_form(formulation, length, SECTION, material)
        straight, start = straight_beam(length), [np.sin(a) / a, 1.0, 1.0, 1.0]
    g0 = products(straight)
    values, vectors = np.linalg.eigh(form.H)
    root = np.sqrt(np.clip(values, 0.0, None))[:, None] * vectors.T / np.sqrt(bending)
    found = least_squares(
        lambda p: root @ (products(arc(form, length, p)) - g0),
        start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15,
    )  # fmt: skip
    g = products(arc(form, length, found.x))
    ratio = found.cost
    if formulation == "cable":  # its bending stands in h alone; without stretch it does not choose the lengths
        ratio += (form.H @ g0 - form.h) @ g / bending
    return ratio


TABLE = {
    ("full", 0.3): {10: 2.35e6, 20: 9.7e4, 40: 4947, 80: 293, 320: 2.47, 1280: 1.351},
    ("elastic_line", 0.0): {10: 1.96e6, 20: 8.4e4, 40: 4435, 80: 266, 320: 2.02, 1280: 1.004},
    ("assumed_strain", 0.3): {10: 0.516, 20: 0.847, 40: 0.959, 80: 0.990, 320: 0.999, 1280: 1.000},
    ("cable", 0.3): {10: 1.020, 20: 1.0014, 40: 1.0001, 80: 1.0000},
}


@pytest.mark.parametrize(("formulation", "nu"), TABLE)
def test_bending_stiffness_on_the_hub_is_that_of_the_reference(formulation, nu, book):
    wanted = TABLE[formulation, nu]
    found = [bending_ratio(formulation, n, nu) for n in wanted]
    assert_allclose(found, list(wanted.values()), rtol=1e-4 if formulation == "cable" else 0.01)
    first, last = min(wanted), max(wanted)
    book(
        "Statics of beams", f"Bending stiffness on a hub ({formulation}, {first} to {last} elements)",
        reference="table of EI over true EI", source="independent computation, 3 to 4 digits",
        error=max(abs(a / b - 1.0) for a, b in zip(found, wanted.values(), strict=True)),
        allowed=1e-4 if formulation == "cable" else 0.01,
    )  # fmt: skip


def test_splitting_nu_cures_poisson_locking_but_not_that_of_curvature():
    coarse, fine = bending_ratio("nu_split", 40), bending_ratio("nu_split", 1280)
    assert coarse > 4000.0
    assert_allclose(fine, 1.004, rtol=1e-3)
