"""Equilibria of rods against closed forms and integrations of Reissner's and Simo's equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import General, Material, Rectangle, Taper
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from helpers import fitted_order
from rods.building import RUBBER, STRIP, bent, cantilever, tip

Array = np.ndarray
CHAPTER = "Statics of beams"
BEND: dict[str, Any] = {
    "length": 25.0 * np.pi, "section": General(area=1.0, Iy=1.0 / 12.0, Iz=1.0 / 12.0, J=1.0 / 6.0),
    "material": Material(young_modulus=1e7, poisson_ratio=0.0, density=1.0), "curvature": (0.0, 0.0, 0.01),
}  # fmt: skip


@pytest.mark.parametrize(
    ("load", "wanted"),
    [
        (300.0, (-11.93178, -7.04464, 40.19239)),
        (450.0, (-18.47242, -10.78126, 48.50349)),
        (600.0, (-23.56058, -13.60463, 53.47548)),
    ],
)
def test_bend_of_45_degrees(load: float, wanted: tuple[float, ...], book: Book) -> None:
    """Bathe & Bolourchi's arc; elements that are curved without stress converge with the fourth order."""
    counts = (8, 16, 32)
    start = parts.Rod(elements=1, **BEND).start_nodes()[0][-1]
    found = [bent(parts.Load(at="rod.tip", force=(0.0, 0.0, load)), elements=n, **BEND) - start for n in counts]
    limit = found[-1] + (found[-1] - found[-2]) / 15.0
    order = fitted_order(1.0 / np.array(counts), [float(np.linalg.norm(x - limit)) for x in found])
    assert order == pytest.approx(4.0, abs=0.2)
    size = np.linalg.norm(wanted)
    book(
        CHAPTER, f"Bend of 45 degrees, {load:g} N (rod, limit)", reference=f"displacement {wanted} m",
        source="rod of Reissner and Simo, SciPy DOP853", error=np.abs(limit - wanted).max() / size, allowed=2e-7,
        order=order, wanted="4",
    )  # fmt: skip
    book(
        CHAPTER, f"Bend of 45 degrees, {load:g} N (rod, 16 elements)", reference="its limit",
        source="Richardson", error=np.abs(found[1] - limit).max() / size, allowed=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_roll_up(turns: float, book: Book) -> None:
    """Constant curvature is exact at the nodes of any mesh."""
    EI = RUBBER.E * STRIP.properties(0.3).Iz
    torque = parts.Load(at="rod.tip", torque=(0.0, 0.0, 2.0 * np.pi * turns * EI))
    wanted = (0.0, 2.0 / np.pi, 0.0) if turns == 0.5 else (0.0, 0.0, 0.0)
    book(
        CHAPTER, f"Roll-up to {turns:g} of a circle (rod, 5 elements)", reference="a circle", source="closed form",
        error=np.abs(bent(torque, elements=5) - wanted).max(), allowed=1e-9, unit="L",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("load", "up", "back"),
    [
        (1.0, 0.3017207738, 0.0564332363),
        (3.0, 0.6032534411, 0.2544201846),
        (10.0, 0.8106090249, 0.5549955978),
    ],
)
def test_elastica(load: float, up: float, back: float, book: Book) -> None:
    """A rod so thin that it neither stretches nor shears; it does not lock."""
    thin = Rectangle(thickness=1e-4, width=1e-3)
    EI = RUBBER.E * thin.properties(0.3).Iz
    found = bent(parts.Load(at="rod.tip", force=(0.0, load * EI, 0.0)), elements=20, section=thin)
    book(
        CHAPTER, f"Elastica, P L^2/EI = {load:g} (rod, 20 elements)", reference=f"tip {back:.8f}, {up:.8f} L",
        source="closed form, elliptic integrals", error=np.abs(found - (1.0 - back, up, 0.0)).max(), allowed=3e-5,
        unit="L",
    )  # fmt: skip


@pytest.mark.slow
def test_thick_cantilever(book: Book) -> None:
    """Surface strains of 14 %, at which elements of Green's strain are 1 % off; 1e-4 with 4 elements already."""
    thick, steel = Rectangle(thickness=0.5, width=0.1), Material(young_modulus=2.07e11, density=7850.0)
    push, counts = parts.Load(at="rod.tip", force=(0.0, 62.5e6, 0.0)), (4, 8, 16)
    found = [bent(push, length=2.0, section=thick, material=steel, elements=n) for n in counts]
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    order = fitted_order(1.0 / np.array(counts), [float(np.linalg.norm(x - limit)) for x in found])
    assert np.abs(found[0] - limit).max() < 2e-4
    book(
        CHAPTER, "Thick cantilever, L/h = 4, 14 % strain (rod, limit)", reference="Reissner beam, 0.71056860 m",
        source="SciPy DOP853, shooting", error=np.abs(limit - (2.0 - 0.15097114, 0.71056860, 0.0)).max(),
        allowed=1e-6, unit="m", order=order, wanted="2",
    )  # fmt: skip
    assert order == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(("angle", "wanted"), [(0, (10.7135, 0.0)), (45, (8.8873, 109.0358)), (90, (0.0, 146.2530))])
def test_princeton_beam(angle: int, wanted: tuple[float, float], book: Book) -> None:
    section = Rectangle(thickness=3.2024e-3, width=12.3777e-3)
    material = Material(young_modulus=71.7e9, poisson_ratio=0.31, density=2700.0)
    force = 8.896 * np.array([0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    push, common = parts.Load(at="rod.tip", force=tuple(force)), {"length": 0.508, "section": section}
    coarse, fine = (1e3 * bent(push, material=material, elements=n, **common)[[2, 1]] for n in (16, 32))
    for name, found, allowed in (("32 elements", fine, 1e-3), ("limit", fine + (fine - coarse) / 3.0, 1e-4)):
        book(
            CHAPTER, f"Princeton beam, 8.896 N at {angle} degrees (rod, {name})",
            reference=f"tip {wanted[0]:g}, {wanted[1]:g} mm", source="rod of Reissner and Simo, SciPy DOP853",
            error=np.abs(found - wanted).max(), allowed=allowed, unit="mm",
        )  # fmt: skip


@pytest.mark.slow
def test_lateral_buckling(book: Book) -> None:
    """A deep cantilever under a force at its tip turns over at 4.0126 sqrt(EI GJ)/L^2."""
    section = General(area=1.0, Iy=1e-6, Iz=1.0, J=4e-6, shear_y=1e3, shear_z=1e3)
    material = Material(young_modulus=1e7, poisson_ratio=0.0, density=1.0)
    critical = np.sqrt(1e7 * 1e-6 * 5e6 * 4e-6)

    def load(count: int) -> float:
        shares, squares = np.array([3.98, 4.02, 4.06]), []
        for share in shares:
            push = parts.Load(at="rod.tip", force=(0.0, float(share * critical), 0.0))
            system = cantilever(push, section=section, material=material, elements=count)
            squares.append(float(modes(system.assemble(), count=1).square[0]))
        roots = np.roots(np.polyfit(shares, squares, 2))
        return float(roots[np.argmin(np.abs(roots - 4.0))].real)

    coarse, fine = load(10), load(20)
    book(
        CHAPTER, "Lateral buckling of a deep cantilever (rod, limit)",
        reference="4.0125993 sqrt(EI GJ)/L^2", source="closed form, Bessel functions",
        error=abs((fine + (fine - coarse) / 3.0) / 4.0125993 - 1.0), allowed=2e-4,
    )  # fmt: skip


@pytest.mark.parametrize("slenderness", [1e1, 1e3, 1e5])
def test_no_locking(slenderness: float) -> None:
    """One element has the deflection of Timoshenko's beam, however thin; twice as wide a taper that of its integral."""
    section = Rectangle(thickness=1.0 / slenderness, width=2.0 / slenderness)
    s = section.properties(0.3)
    P = 1e-7 * RUBBER.E * s.Iz
    wanted = P / (3.0 * RUBBER.E * s.Iz) + P / (s.shear_y * RUBBER.shear_modulus * s.area)
    found = bent(parts.Load(at="rod.tip", force=(0.0, P, 0.0)), section=section, elements=1)
    assert found[1] == pytest.approx(wanted, rel=1e-8)


def test_taper() -> None:
    """Bending about z of a taper in width, EI (2 - x): w = P/EI int (1 - x)^2/(2 - x) dx."""
    taper = Taper(root=Rectangle(thickness=1e-3, width=4e-3), tip=Rectangle(thickness=1e-3, width=2e-3))
    EI = RUBBER.E * taper.tip.properties(0.3).Iz
    found = bent(parts.Load(at="rod.tip", force=(0.0, 1e-5 * EI, 0.0)), section=taper, elements=2)
    assert found[1] == pytest.approx(1e-5 * (np.log(2.0) - 0.5), rel=2e-5)


def test_torsion(book: Book) -> None:
    GJ = RUBBER.shear_modulus * STRIP.properties(0.3).J
    assembly = cantilever(parts.Load(at="rod.tip", torque=(3.0 * GJ, 0.0, 0.0)), elements=2).assemble()
    found = solve_static(assembly)
    q = int(assembly.model.bodies["iq"][-1]) + 3
    book(
        CHAPTER, "Rod twisted by 3 rad at its tip (rod, 2 elements)", reference="T L/(G J)", source="closed form",
        error=abs(2.0 * np.arctan2(found.y[-1, q + 1], found.y[-1, q]) / 3.0 - 1.0), allowed=1e-9,
    )  # fmt: skip


def test_equilibrium_does_not_depend_on_the_path() -> None:
    """Loads in another order, and there and back."""
    first, last = (0.0, 0.0, 8.0), (0.0, 3.0, 8.0)

    def solved(force: tuple[float, ...], y: Array | None = None) -> Array:
        assembly = cantilever(parts.Load(at="rod.tip", force=force), elements=5).assemble()
        found = solve_static(assembly, y=y)
        assert found.success, found.message
        return found.y[-1]

    y = solved(first)
    direct = solved(last)
    assembly = cantilever(elements=5).assemble()
    for other in (solved(last, y), solved(last, solved((0.0, 3.0, 0.0)))):
        for node in range(6):
            where = f"rod[{node}]"
            assert tip(assembly, other, where) == pytest.approx(tip(assembly, direct, where), abs=1e-9)
    back = solved((0.0, 0.0, 0.0), direct)
    assert tip(assembly, back) == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)


def test_steady_turn(book: Book) -> None:
    """A rod that turns with the frame stretches by tan(k L)/k - L, k = w sqrt(rho/E)."""
    system = System()
    material = Material(young_modulus=1e7, poisson_ratio=0.0, density=1000.0)
    system.add(parts.Rod(length=1.0, section=STRIP, material=material, elements=8), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"))
    assembly = system.assemble()
    found = solve_static(assembly, rotating=(0.0, 0.0, 30.0))
    k = 30.0 * np.sqrt(1000.0 / 1e7)
    book(
        CHAPTER, "Rod that turns steadily, k L = 0.3 (rod, 8 elements)", reference="tip radius tan(k L)/k",
        source="closed form", error=abs(tip(assembly, found.y[-1])[0] * k / np.tan(k) - 1.0), allowed=2e-4,
    )  # fmt: skip
