"""Modes of shells: plates against Leissa's and an independent method of Ritz, cylinders against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.polynomial import Legendre, Polynomial

from book import Book
from evolvent import System, parts
from evolvent.solvers.modal.modes import modes
from helpers import fitted_order
from shells.plates import add_symmetry, material

Array = np.ndarray
CHAPTER = "Modes"
E, NU, DENSITY = 1e9, 0.3, 1000.0


def ritz(clamped: bool, terms: int = 12) -> Array:
    """Five parameters omega a^2 sqrt(m/D) of a thin square plate, free or with the side x = 0 clamped.

    Kirchhoff's energy with Legendre polynomials, times x^2 where it is clamped; the free plate's first three are left
    out.
    """
    x, w = np.polynomial.legendre.leggauss(terms + 6)
    x, w = 0.5 * (x + 1.0), 0.5 * w

    def shapes(factor: Polynomial) -> list[Array]:
        own = [Legendre.basis(i, domain=[0.0, 1.0]).convert(kind=Polynomial) * factor for i in range(terms)]
        return [np.array([(p.deriv(k) if k else p)(x) for p in own]) for k in range(3)]

    X, Y = shapes(Polynomial([0.0, 0.0, 1.0] if clamped else [1.0])), shapes(Polynomial([1.0]))

    def term(i: int, j: int, k: int, m: int) -> Array:
        return np.kron((X[i] * w) @ X[j].T, (Y[k] * w) @ Y[m].T)

    bent = term(2, 2, 0, 0) + term(0, 0, 2, 2) + NU * (term(2, 0, 0, 2) + term(0, 2, 2, 0))
    squares = scipy.linalg.eigh(bent + 2.0 * (1.0 - NU) * term(1, 1, 1, 1), term(0, 0, 0, 0), eigvals_only=True)
    return np.sqrt(squares[slice(0, 5) if clamped else slice(3, 8)])


def square(edges: str, thickness: float, elements: int) -> Array:
    """Five parameters of a plate of 1 m x 1 m whose edges are all free, all supported, or clamped at x = 0."""
    clamped: Any = ("x0",) if edges == "clamped" else ()
    shell = parts.Shell(
        size=(1.0, 1.0), elements=(elements, elements), thickness=thickness, material=material(E, NU), clamped=clamped
    )
    system = System()
    system.add(shell, "plate")
    if edges == "supported":
        add_supports(system, shell)
    rigid = {"clamped": 0, "supported": 3, "free": 6}[edges]
    found = modes(system.assemble(), count=rigid + 5).frequency
    assert np.abs(found[:rigid]).max(initial=0.0) < 1e-2 * found[rigid]
    return np.asarray(found[rigid:] * np.sqrt(12.0 * (1.0 - NU**2) * DENSITY / E) / thickness)


def add_supports(system: System, shell: parts.Shell) -> None:
    """Hold the deflection of all edges, and their turn across the normal of the edge."""
    x, done = shell.mesh()[0].reshape(-1, 3), set()
    edges: Any = ("x0", "x1", "y0", "y1")
    for edge in edges:
        along = (0.0, 1.0, 0.0) if edge[0] == "x" else (1.0, 0.0, 0.0)
        for k in shell.edge(edge):
            common: dict[str, Any] = {"type": "guide", "a": tuple(x[k]), "b": f"plate[{k}]"}
            if k not in done:
                system.add(parts.Joint(**common, axis=(0.0, 0.0, 1.0)), f"deflection {k}")
                done.add(k)
            system.add(parts.Joint(**common, axis=along, axis_b=(0.0, 0.0, 1.0)), f"turn {edge} {k}")


@pytest.mark.parametrize(
    ("edges", "reference", "leissa", "allowed"),
    [
        ("clamped", lambda: ritz(True), "3.492, 8.525, 21.43, 27.33, 31.11", 0.012),
        ("supported", lambda: np.pi**2 * np.array([2.0, 5.0, 5.0, 8.0, 10.0]), "19.739, 49.348, 78.957, 98.696", 0.012),
        ("free", lambda: ritz(False), "13.489, 19.789, 24.432, 35.024", 0.017),
    ],
)
def test_square_plate(edges: str, reference: Callable[[], Array], leissa: str, allowed: float, book: Book) -> None:
    """Of a thickness of 1/100 of its side; shear lowers the frequencies of a free one by 0.2 %."""
    wanted = reference()
    assert wanted[:2] == pytest.approx([float(word) for word in leissa.split(", ")][:2], rel=0.012)
    counts = (4, 8, 16)
    found = [square(edges, 0.01, n) for n in counts]
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    book(
        CHAPTER, f"Square plate, {edges}, h/a = 0.01: 5 frequencies (16 x 16)", reference=leissa,
        source="Leissa 1973; Ritz, Legendre polynomials", error=np.abs(found[-1] / wanted - 1.0).max(),
        allowed=allowed, order=fitted_order(1.0 / np.array(counts), [abs(one[0] / wanted[0] - 1.0) for one in found])
        if edges != "free" else None, wanted="2" if edges != "free" else "",
    )  # fmt: skip
    book(
        CHAPTER, f"Square plate, {edges}, h/a = 0.01: 5 frequencies (limit)", reference=leissa,
        source="Leissa 1973; Ritz, Legendre polynomials", error=np.abs(limit / wanted - 1.0).max(), allowed=8e-3,
    )  # fmt: skip


def test_very_thin_plate(book: Book) -> None:
    """Nothing locks at a thickness of 1/1000 of the side."""
    book(
        CHAPTER, "Square plate, supported, h/a = 0.001: first frequency (16 x 16)", reference="2 pi^2",
        source="closed form", error=abs(square("supported", 1e-3, 16)[0] / (2.0 * np.pi**2) - 1.0), allowed=3e-3,
    )  # fmt: skip


def test_breathing_modes_of_a_cylinder(book: Book) -> None:
    """Two, four and six waves about an infinite cylinder of R/h = 100, a quarter of it between planes of symmetry."""
    h, n = 0.01, np.array([2.0, 4.0, 6.0])
    wanted = n * (n * n - 1.0) / np.sqrt(n * n + 1.0) * np.sqrt(E / (1.0 - NU**2) * h * h / (12.0 * DENSITY))
    counts, found = (12, 24, 48), []
    for count in counts:
        shell = parts.Shell(
            size=(0.1, 0.5 * np.pi), radius=1.0, elements=(1, count), thickness=h, material=material(E, NU)
        )
        system = System()
        system.add(shell, "shell")
        add_symmetry(system, shell, {"x0": 0, "x1": 0, "y0": 1, "y1": 1})
        found.append(modes(system.assemble(), count=3).frequency)
    errors = np.array([np.abs(one / wanted - 1.0).max() for one in found])
    book(
        CHAPTER, "Breathing modes of a cylinder, R/h = 100: n = 2, 4, 6 (48 elements a quarter)",
        reference="n (n^2 - 1)/sqrt(n^2 + 1) sqrt(D/(m R^4))", source="closed form", error=errors[-1], allowed=5e-3,
        order=fitted_order(1.0 / np.array(counts), errors), wanted="2",
    )  # fmt: skip


def love(waves: int, length: float, h: float) -> float:
    """First circular frequency of a cylinder of radius 1 on diaphragms, one half-wave along it, rad/s.

    Love's strains of u = U cos(k x) cos(n t), v = V sin(k x) sin(n t), w = W sin(k x) cos(n t), without rotary inertia.
    """
    k, n = np.pi / length, float(waves)
    strain = np.array([[-k, 0.0, 0.0], [0.0, n, 1.0], [-n, k, 0.0]])
    bending = np.array([[0.0, 0.0, k * k], [0.0, n, n * n], [0.0, 2.0 * k, 2.0 * k * n]])
    C = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]]) * E / (1.0 - NU**2)
    K = h * strain.T @ C @ strain + h**3 / 12.0 * bending.T @ C @ bending
    return float(np.sqrt(np.linalg.eigvalsh(K)[0] / (DENSITY * h)))


def test_cylinder_on_diaphragms(book: Book) -> None:
    """An eighth of a cylinder of R/h = 100 and L/R = 2; of the even modes those of six and four waves are slowest."""
    h, length = 0.01, 2.0
    wanted, errors, counts = np.array([love(n, length, h) for n in (6, 4)]), [], (6, 12)
    for count in counts:
        shell = parts.Shell(
            size=(0.5 * length, 0.5 * np.pi), radius=1.0, elements=(count, 2 * count), thickness=h,
            material=material(E, NU),
        )  # fmt: skip
        system = System()
        system.add(shell, "shell")
        add_symmetry(system, shell, {"x1": 0, "y0": 1, "y1": 1})
        x, R = shell.mesh()[:2]
        ends = shell.edge("x0")
        for node in ends:
            common: dict[str, Any] = {"type": "guide", "a": tuple(x[node]), "b": f"shell[{node}]"}
            system.add(parts.Joint(**common, axis=tuple(R[node][:, 2])), f"deflection {node}")
            if node not in (ends[0], ends[-1]):  # there the planes of symmetry hold the rest
                _, two, three = R[node].T
                system.add(parts.Joint(**common, axis=tuple(two)), f"slip {node}")
                system.add(parts.Joint(**common, axis=tuple(two), axis_b=tuple(three)), f"turn {node}")
        found = modes(system.assemble(), count=2).frequency
        errors.append(np.abs(found / wanted - 1.0).max())
    book(
        CHAPTER, "Cylinder on diaphragms, R/h = 100, L/R = 2: n = 6, 4 (12 x 24 of an eighth)",
        reference="closed form of Love's strains", source="Leissa 1973, Vibration of shells", error=errors[-1],
        allowed=6e-3, order=fitted_order(1.0 / np.array(counts), errors), wanted="2",
    )  # fmt: skip
