"""Flexible motion and time stepping against published numbers, closed forms and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import System, law, parts
from evolvent.elements import Material, Rectangle
from evolvent.equations.rhs import rhs
from evolvent.solvers.static.static import solve_static
from helpers import fitted_order, run as march
from implicit.rigs import coordinates, run

CHAPTER = "Dynamics"
G = 9.81


@law
def spin_up(t, parameters):  # type: ignore[no-untyped-def]
    """6 rad/s in 15 s: rate (6/15) [t - 15/(2 pi) sin(2 pi t/15)] (Simo & Vu-Quoc 1986)."""
    rate, end = parameters[0], parameters[1]
    if t >= end:
        return rate * t - 0.5 * rate * end, rate, 0.0
    w = 2.0 * np.pi / end
    angle = rate / end * (0.5 * t * t + (np.cos(w * t) - 1.0) / (w * w))
    return angle, rate / end * (t - np.sin(w * t) / w), rate / end * (1.0 - np.cos(w * t))


def spinning(n: int) -> System:
    """L 10, EA 2.8e7, EI 1.4e4, rho A 1.2, clamped to an axis."""
    thickness = np.sqrt(12.0 * 1.4e4 / 2.8e7)
    material = Material(young_modulus=2.8e7 / thickness, poisson_ratio=0.3, density=1.2 / thickness)
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
    system.add(
        parts.Beam(length=10.0, section=Rectangle(thickness=thickness, width=1.0), material=material, elements=n,
                   formulation="cable_stretch"), "beam",
    )  # fmt: skip
    system.add(parts.Joint(a="hub", b="beam.root", type="clamp"))
    return system


def test_spin_up(book: Book) -> None:
    system = spinning(8)
    system.add(
        parts.Joint(a="ground", b="hub", type="revolute", drive=parts.LawDrive(law=spin_up, parameters=(6.0, 15.0))),
        "turn",
    )
    assembly = system.assemble()
    times = np.concatenate([[0.0], np.linspace(6.5, 7.0, 101), np.linspace(15.0, 20.0, 501)])
    found = run(assembly, times, step=5e-3, spectral_radius=0.9)
    angle = coordinates(assembly, found.y, "hub")[:, 0]
    tip = coordinates(assembly, found.y, "beam")[:, -1, 0]
    along = tip[:, 0] * np.cos(angle) + tip[:, 1] * np.sin(angle) - 10.0
    across = tip[:, 1] * np.cos(angle) - tip[:, 0] * np.sin(angle)
    case, early, late = "Spin-up to 6 rad/s in 15 s (cable_stretch, 8 elements)", times < 10.0, times >= 15.0
    book(
        CHAPTER, f"{case}: largest lag", reference="-0.57383 m", source="independent computation",
        error=abs(across[early].min() / -0.57383 - 1.0), allowed=3e-4,
    )  # fmt: skip
    assert times[early][across[early].argmin()] == pytest.approx(6.75, abs=0.02)
    book(
        CHAPTER, f"{case}: extension at the end, mean", reference="5.143175e-4 m",
        source="closed form, tan(k L)/k - L", error=abs(along[late].mean() / 5.143175e-4 - 1.0), allowed=2e-3,
    )  # fmt: skip


def test_steady_turn(book: Book) -> None:
    assembly = spinning(8).assemble()
    r = solve_static(assembly, rotating=(0.0, 0.0, 6.0))
    assert r.success, r.message
    tip = coordinates(assembly, r.y, "beam")[-1, -1, 0]
    book(
        "Statics of beams", "Beam of the spin-up turning steadily (cable_stretch)", reference="extension 5.143175e-4 m",
        source="closed form, tan(k L)/k - L", error=abs((tip[0] - 10.0) / 5.143175e-4 - 1.0), allowed=1e-4,
    )  # fmt: skip


#: Tip of the flexible pendulum at 0.5 s and at 1 s, m.
REISSNER = ((-0.193659, -0.952471), (-0.92709, 0.10384))
GREEN = ((-0.193592, -0.952432), (-0.926474, 0.104443))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "n", "beam", "wanted", "allowed"),
    [
        ("cable_stretch", 40, "Reissner's", REISSNER, (1e-3, 1.5e-3)),
        ("assumed_strain", 80, "Reissner's", REISSNER, (2e-4, 1e-3)),
        ("assumed_strain", 80, "Green's", GREEN, (1e-4, 1e-4)),
    ],
)
def test_flexible_pendulum(
    formulation: str, n: int, beam: str, wanted: tuple, allowed: tuple[float, float], book: Book
) -> None:
    """E is so low that the pendulum stretches by 0.4 % and more, which tells the measures of strain apart.

    Both references (`flexible_pendulum.py`) have shear and rotary inertia, which a cable has not; with Green's strain
    the bending stiffness grows with the square of the stretch.
    """
    system = System(gravity=(0.0, -G, 0.0))
    part = parts.Beam(length=1.0, section=Rectangle(thickness=0.02, width=0.02), elements=n, formulation=formulation,
                      material=Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0))  # fmt: skip
    system.add(part, "beam")
    kind = "revolute" if formulation == "assumed_strain" else "spherical"
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type=kind))
    assembly = system.assemble()
    found = run(assembly, [0.0, 0.5, 1.0], step=5e-4, spectral_radius=0.9)
    tip = coordinates(assembly, found.y, "beam")[1:, -1, 0, :2]
    for k, time in enumerate((0.5, 1.0)):
        book(
            CHAPTER, f"Flexible pendulum of 1 m, tip at {time:g} s ({formulation}, {n} elements)",
            reference=f"{beam} beam, ({wanted[k][0]:g}, {wanted[k][1]:g}) m", source="finite volumes, SciPy DOP853",
            error=np.linalg.norm(tip[k] - wanted[k]), allowed=allowed[k], unit="m",
        )  # fmt: skip


def test_generalized_alpha_on_a_pendulum(book: Book) -> None:
    """Errors of places, velocities and multiplier are those of another implementation of Arnold & Bruls (2007)."""
    others = {0.01: (2.284e-3, 1.0055e-2, 4.536e-2), 0.00125: (3.572e-5, 1.572e-4, 7.094e-4)}
    errors = []
    for h, other in others.items():
        times = h * np.arange(round(2.0 / h) + 1)
        y = solve_ivp(
            lambda t, y: [y[1], -G * np.sin(y[0])], (0.0, 2.0), [0.5 * np.pi, 0.0], "DOP853", times, rtol=1e-12,
            atol=1e-13,
        ).y  # fmt: skip
        x = np.array([np.sin(y[0]), -np.cos(y[0])]).T
        v = y[1][:, None] * np.array([np.cos(y[0]), np.sin(y[0])]).T
        la = y[1] ** 2 + G * np.cos(y[0])
        system = System(gravity=(0.0, -G, 0.0))
        system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance"))
        found = run(system.assemble(), times, step=h, spectral_radius=0.9, newton=1e-14, largest_gain=10.0)
        pairs = ((found.y[:, :2], x), (found.y[:, 3:5], v), (np.abs(found.la[:, 0]), np.abs(la)))
        errors.append([np.abs(a - b).max() for a, b in pairs])
        book(
            CHAPTER, f"Generalized-alpha, rho 0.9, h = {h:g} s: largest errors on a pendulum",
            reference="{:.4g}, {:.4g}, {:.4g} (q, v, la)".format(*other), source="another implementation",
            error=np.abs(np.array(errors[-1]) / other - 1.0).max(), allowed=3e-3,
        )  # fmt: skip
    order = np.log(np.array(errors[0]) / errors[1]) / np.log(8.0)
    assert order == pytest.approx([2.0] * 3, abs=0.02)


def fold(links: int) -> tuple[np.ndarray, np.ndarray]:
    """Fall and speed of the free end of a chain of 1 m in `links` rigid links, folded, when it is let go."""
    k, h = links // 2, 1.0 / links
    x = [(0.0, -h * (i + 1), 0.0) for i in range(k)] + [(h, -h * (k - i), 0.0) for i in range(k + 1)]
    system = System(gravity=(0.0, -G, 0.0))
    previous: object = (0.0, 0.0, 0.0)
    for i, place in enumerate(x):
        point = system.add(parts.Point(mass=h if i < links - 1 else 0.5 * h, position=place), f"p{i}")
        system.add(parts.Joint(a=previous, b=point, type="link", length=h))
        previous = point
    seen = march(system.assemble(), np.linspace(0.0, 0.4, 201), rtol=1e-8, atol=1e-10)
    n = 3 * links
    return -seen.y[:, n - 2], -seen.y[:, 2 * n - 2]


def test_folded_falling_chain(book: Book) -> None:
    """Towards it from below, as links at the fold swing: slowly, and only with the number of links."""
    counts, errors = (11, 21, 41), []
    for links in counts:
        fall, speed = fold(links)
        assert np.all(np.diff(fall[: np.searchsorted(fall, 0.5) + 2]) > 0.0)
        errors.append(abs(np.interp(0.5, fall, speed) / np.sqrt(G * 0.5 * 1.5 / 0.5) - 1.0))
    order = fitted_order(1.0 / np.array(counts), errors)
    assert order > 0.6
    book(
        CHAPTER, "Folded falling chain, half its length fallen (41 links)", reference="v^2 = g x (2 L - x)/(L - x)",
        source="closed form, energy", error=errors[-1], allowed=0.05, order=order, wanted="in the links, about 1",
    )  # fmt: skip


def test_travelling_string(book: Book) -> None:
    """A closed chain of links on an ellipse, moving along itself at 1 m/s: a quarter of the way round."""
    a, b, counts, off, pull = 1.0, 0.6, (20, 40, 80), [], []
    s = np.linspace(0.0, 2.0 * np.pi, 20001)
    speed = np.hypot(a * np.sin(s), b * np.cos(s))
    arc = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(s))])
    for n in counts:
        p = np.interp(np.arange(n) / n * arc[-1], arc, s)
        x = np.array([a * np.cos(p), b * np.sin(p), 0.0 * p]).T
        v = np.array([-a * np.sin(p), b * np.cos(p), 0.0 * p]).T
        v /= np.linalg.norm(v, axis=1)[:, None]
        chord, following = np.roll(x, -1, axis=0) - x, np.roll(np.arange(n), -1)
        A = np.zeros((n, n, 3))  # lengths' rates
        A[np.arange(n), np.arange(n)], A[np.arange(n), following] = -chord, chord
        A = A.reshape(n, 3 * n)
        v = (v.ravel() - np.linalg.lstsq(A, A @ v.ravel(), rcond=None)[0]).reshape(n, 3)
        system = System()
        for i in range(n):
            system.add(parts.Point(mass=arc[-1] / n, position=x[i], velocity=v[i]), f"p{i}")
        for i in range(n):
            system.add(parts.Joint(a=f"p{i}", b=f"p{following[i]}", type="link"))
        assembly = system.assemble()
        seen = march(assembly, np.linspace(0.0, 0.25 * arc[-1], 11), rtol=1e-8, atol=1e-10)
        y = seen.y[:, : 3 * n].reshape(11, n, 3)
        off.append(np.abs(np.hypot(y[..., 0] / a, y[..., 1] / b) - 1.0).max())
        rhs(0.25 * arc[-1], np.ascontiguousarray(seen.y[-1]), assembly.s, assembly.model, assembly.model.dy[0])
        pull.append(np.abs(assembly.model.la - 1.0).max())
    order = fitted_order(1.0 / np.array(counts), off)
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        "Threads, reels, tethers", "Travelling string, closed, on an ellipse (80 links): shape",
        reference="keeps its shape", source="closed form", error=off[-1], allowed=2e-3, order=order, wanted="2",
    )  # fmt: skip
    book(
        "Threads, reels, tethers", "Travelling string, closed, on an ellipse (80 links): tension",
        reference="rho A v^2", source="closed form", error=pull[-1], allowed=5e-3,
    )  # fmt: skip


#: Root and tip of the beam in free flight at 0.5 s and at 1 s, m, by `free_flight.py`.
FLIGHT = (((0.281194, 0.502518), (0.932654, -0.205217)), ((0.614933, 0.739517), (0.538567, -0.239648)))


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "n", "allowed"), [("cable_stretch", 40, 3e-3), ("assumed_strain", 80, 2e-3)])
def test_flexible_beam_in_free_flight(formulation: str, n: int, allowed: float, book: Book) -> None:
    """Nothing holds the beam of the pendulum; a dead force pulls its root for 0.2 s, and it tumbles and bends."""
    force, end, mass = np.array([2.0, 4.0]), 0.2, 7200.0 * 0.02**2
    system = System()
    part = parts.Beam(length=1.0, section=Rectangle(thickness=0.02, width=0.02), elements=n, formulation=formulation,
                      material=Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0))  # fmt: skip
    system.add(part, "beam")
    system.add(parts.Load(at="beam.root", force=(*force, 0.0), until=end), "pull")
    assembly, times = system.assemble(), np.array([0.0, 0.5, 1.0])
    found = coordinates(assembly, run(assembly, times, step=2.5e-4, spectral_radius=0.9).y, "beam")[1:, :, :2, :2]
    name = f"Flexible beam in free flight ({formulation}, {n} elements)"
    book(
        CHAPTER, f"{name}: ends at 0.5 and 1 s", reference="Reissner's beam, tip at (0.538567, -0.239648) m at last",
        source="finite volumes, SciPy DOP853", error=np.abs(found[:, [0, -1], 0] - FLIGHT).max(), allowed=allowed,
        unit="m",
    )  # fmt: skip
    places, slopes = found[:, :, 0], found[:, :, 1]
    middle = 0.5 * (places[:, 1:] + places[:, :-1]).mean(axis=1) + (slopes[:, 0] - slopes[:, -1]) / (12.0 * n**2)
    exact = np.array([0.5, 0.0]) + force / mass * (end * times[1:, None] - 0.5 * end**2)
    book(
        CHAPTER, f"{name}: centre of mass", reference="F/m (T t - T^2/2)", source="closed form",
        error=np.abs(middle - exact).max(), allowed=1e-10, unit="m",
    )  # fmt: skip
