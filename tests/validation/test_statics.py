"""Equilibria of beams and cables against closed forms, published numbers and shooting by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from book import Book
from evolvent import System, parts
from evolvent.elements import General, Material, Rectangle
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import rows_of_part
from helpers import fitted_order
from static.composing import EI, STEEL, STRIP, beam, nodes, solved, tip_force

Array = np.ndarray
CHAPTER = "Statics of beams"


def test_elastica_at_three_loads(book: Book) -> None:
    a = beam("cable", 40, more=tip_force(0.0, 10.0 * EI, 0.0))
    found = solved(solve_static(a, load_steps=[0.1, 0.3]))
    wanted = {1.0: (0.0564332363, 0.3017207738), 3.0: (0.2544201846, 0.6032534411), 10.0: (0.5549955978, 0.8106090249)}
    for load, (back, up) in wanted.items():
        k = int(np.argmin(np.abs(found.path.factor - 0.1 * load)))
        assert found.path.factor[k] == pytest.approx(0.1 * load, rel=1e-9)
        tip = nodes(a, found.y[k])[-1, 0]
        book(
            CHAPTER, f"Elastica, P L^2/EI = {load:g} (cable, 40 elements)", reference=f"tip {back:.8f}, {up:.8f} L",
            source="closed form, elliptic integrals", error=max(abs(1.0 - tip[0] - back), abs(tip[1] - up)),
            allowed=2e-5, unit="L",
        )  # fmt: skip


THICK, STOUT = Rectangle(thickness=0.5, width=0.1), Material(young_modulus=2.07e11, poisson_ratio=0.3, density=7850.0)


def reissner(push: float) -> tuple[float, float]:
    """Shortening and deflection of a clamped beam of 2 m with shear and stretch under a dead force (Reissner 1972)."""
    s = THICK.properties(STOUT.nu)
    EA, GA, bend = STOUT.E * s.area, s.shear_y * STOUT.shear_modulus * s.area, STOUT.E * s.Iz

    def rates(_: float, y: Array) -> list[float]:
        theta, curvature = y[:2]
        e, g = push * np.sin(theta) / EA, push * np.cos(theta) / GA
        dx = (1.0 + e) * np.cos(theta) - g * np.sin(theta)
        dy = (1.0 + e) * np.sin(theta) + g * np.cos(theta)
        return [curvature, -push * dx / bend, dx, dy]

    def end(curvature: float) -> Array:
        return solve_ivp(rates, (0.0, 2.0), [0.0, curvature, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    curvature = brentq(lambda c: end(c)[1], 1e-6, push * 2.4 / bend, xtol=1e-13)
    return 2.0 - end(curvature)[2], end(curvature)[3]


def thick(formulation: str, n: int, push: float) -> Array:
    """Shortening and deflection of the engine's beam."""
    a = beam(formulation, n, section=THICK, material=STOUT, length=2.0, more=tip_force(0.0, push, 0.0))
    tip = nodes(a, solved(solve_static(a)))[-1, 0]
    return np.array([2.0 - tip[0], tip[1]])


@pytest.mark.slow
def test_thick_cantilever(book: Book) -> None:
    """Strains of 14 % at the surface: Green's strain is then another law than Reissner's, and the gap its square."""
    assert reissner(62.5e6) == pytest.approx((0.15097114, 0.71056860), abs=1e-7)
    loads, gaps = np.array([62.5e6, 20e6, 6.25e6]), []
    for push in loads:
        coarse, fine = (thick("assumed_strain", n, push)[1] for n in (16, 32))
        limit = fine + (fine - coarse) / 3.0
        gaps.append(abs(limit / reissner(push)[1] - 1.0))
    order = fitted_order(loads, gaps)
    assert order == pytest.approx(2.0, abs=0.15)
    case = "Thick cantilever, L/h = 4"
    book(
        CHAPTER, f"{case}, a tenth of the force (assumed_strain, limit)", reference="Reissner beam",
        source="SciPy DOP853, shooting", error=gaps[-1], allowed=2e-4, order=order, wanted="2, in the load",
    )  # fmt: skip
    for formulation, allowed in (("assumed_strain", 0.011), ("nu_split", 0.008), ("full", 0.22)):
        off = abs(thick(formulation, 32, 62.5e6)[1] / 0.71056860 - 1.0)
        book(
            CHAPTER, f"{case}, 14 % strain ({formulation}, 32 elements)", reference="Reissner beam, 0.71056860 m",
            source="SciPy DOP853, shooting", error=off, allowed=allowed,
        )  # fmt: skip


def rod(force: Array, length: float, stretch: Array, bending: Array, curvature: float = 0.0) -> Array:
    """Tip of a clamped rod of Reissner and Simo, m, from the moments at its root that leave none at the tip.

    Stiffnesses are of stretch and both shears (N), of torsion and both bendings (N m2); `curvature` is that at rest.
    """

    def end(moment: Array, part: float) -> Array:
        def rates(_: float, y: Array) -> Array:
            R = y[3:12].reshape(3, 3)
            dr = R @ (np.array([1.0, 0.0, 0.0]) + R.T @ (part * force) / stretch)
            kx, ky, kz = R.T @ y[12:] / bending + np.array([0.0, 0.0, curvature])
            turn = np.array([[0.0, -kz, ky], [kz, 0.0, -kx], [-ky, kx, 0.0]])
            return np.concatenate([dr, (R @ turn).ravel(), -np.cross(dr, part * force)])

        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), moment])
        return solve_ivp(rates, (0.0, length), start, "DOP853", rtol=1e-10, atol=1e-10).y[:, -1]

    arm, before = end(np.zeros(3), 0.0)[:3], 0.1
    moment = before * np.cross(arm, force)
    for part in (0.1, 0.3, 0.6, 1.0):
        found = fsolve(lambda m, part=part: end(m, part)[12:], moment * part / before, full_output=True)
        moment, before = found[0], part
        assert np.abs(end(moment, part)[12:]).max() < 1e-7 * np.abs(moment).max()
    return end(moment, 1.0)[:3]


@pytest.mark.parametrize(("angle", "wanted"), [(0, (10.7135, 0.0)), (45, (8.8873, 109.0358)), (90, (0.0, 146.2530))])
def test_princeton_beam(angle: int, wanted: tuple[float, float], book: Book) -> None:
    section, material = (
        Rectangle(thickness=3.2024e-3, width=12.3777e-3),
        Material(young_modulus=71.7e9, poisson_ratio=0.31, density=2700.0),
    )
    s, shear = section.properties(0.31), material.shear_modulus
    force = 8.896 * np.array([0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    exact = 1e3 * rod(
        force, 0.508, s.area * np.array([material.E, shear * s.shear_y, shear * s.shear_z]),
        np.array([shear * s.J, material.E * s.Iy, material.E * s.Iz]),
    )[[2, 1]]  # fmt: skip
    assert exact == pytest.approx(wanted, abs=1e-4)
    tips = []
    for n in (16, 32):
        a = beam("assumed_strain", n, section=section, material=material, length=0.508, more=tip_force(*force))
        tips.append(1e3 * nodes(a, solved(solve_static(a)))[-1, 0, [2, 1]])
    for name, tip, allowed in (
        ("32 elements", tips[1], 4e-2),
        ("limit", tips[1] + (tips[1] - tips[0]) / 3.0, 1e-3),
    ):
        book(
            CHAPTER, f"Princeton beam, 8.896 N at {angle} degrees (assumed_strain, {name})",
            reference=f"tip {wanted[0]:g}, {wanted[1]:g} mm", source="rod of Reissner and Simo, SciPy DOP853",
            error=np.abs(tip - exact).max(), allowed=allowed, unit="mm",
        )  # fmt: skip


def frame(load: float, n: int) -> float:
    """Least square of a frequency of the right-angle frame, 0.24 m, 30 x 0.6 mm, under a force at its tip along x.

    Torsion as of a strip without ends, J = w t^3/3, as in Argyris et al. (1979).
    """
    material = Material(young_modulus=71.24e9, poisson_ratio=0.31, density=2700.0)
    section = General(area=1.8e-5, Iy=6e-4 * 0.03**3 / 12.0, Iz=5.4e-13, J=2.16e-12)
    common = {"length": 0.24, "section": section, "material": material, "elements": n, "normal": (0.0, 0.0, 1.0)}
    system = System()
    system.add(parts.Beam(formulation="assumed_strain", **common), "first")
    second = {"position": (0.24, 0.0, 0.0), "direction": (0.0, 1.0, 0.0)}
    system.add(parts.Beam(formulation="assumed_strain", **second, **common), "second")
    system.add(parts.RigidBody(mass=1e-3, inertia=1e-8, position=(0.24, 0.0, 0.0)), "corner")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="first.root", type="clamp"))
    system.add(parts.Joint(a="corner", b="first.tip", type="clamp"))
    system.add(parts.Joint(a="corner", b="second.root", type="clamp"))
    system.add(parts.Load(at="second.tip", force=(load, 0.0, 0.0)))
    return float(modes(system.assemble(), count=1).square[0])


@pytest.mark.slow
@pytest.mark.parametrize(("sign", "wanted"), [(1.0, 1.08752), (-1.0, 0.68043)])
def test_right_angle_frame_buckles(sign: float, wanted: float, book: Book) -> None:
    coarse, fine = (brentq(lambda p, n=n: frame(sign * p, n), 0.98 * wanted, 1.02 * wanted, xtol=1e-5) for n in (8, 16))
    book(
        CHAPTER, f"Right-angle frame, sideways buckling, {sign:+g} x (assumed_strain, limit)",
        reference=f"{wanted} N", source="transcendental equation; Argyris et al. 1979",
        error=abs((fine + (fine - coarse) / 3.0) / wanted - 1.0), allowed=2e-4,
    )  # fmt: skip


def test_bar_with_the_strain_of_green(book: Book) -> None:
    a = beam("cable", 4, more=tip_force(0.1 * STEEL.E * STRIP.properties(0.3).area, 0.0, 0.0))
    tip = nodes(a, solved(solve_static(a)))[-1, 0]
    book(
        CHAPTER, "Bar pulled, Green strain (cable)", reference="stretch 1.0880339 of P/EA = 0.1",
        source="closed form, x^3 - x = 2 P/EA", error=abs(tip[0] / 1.0880339 - 1.0), allowed=1e-7,
    )  # fmt: skip


def test_elastic_catenary(book: Book) -> None:
    length, span, n = 10.0, 8.0, 40
    half = brentq(lambda b: length * np.sin(b) / b - span, 0.1, 3.0)
    radius, angle = 0.5 * length / half, np.linspace(-half, half, n + 1)
    start = np.zeros((n + 1, 2, 3))
    start[:, 0, 0], start[:, 0, 2] = 0.5 * span + radius * np.sin(angle), radius * (np.cos(half) - np.cos(angle))
    start[:, 1, 0], start[:, 1, 2] = np.cos(angle), np.sin(angle)
    a = beam(
        "cable_stretch", n, ("spherical", "spherical"), section=Rectangle(thickness=1e-4, width=1.0),
        material=Material(young_modulus=1e7, poisson_ratio=0.3, density=1.0), length=length, nodes=start,
        more=lambda s: s.add(parts.Load(along="beam", force=(0.0, 0.0, -5.0)), "weight"),
    )  # fmt: skip
    r = solved(solve_static(a))
    H, middle = abs(r.la[-1][rows_of_part(a, "root")][0]), nodes(a, r)[n // 2, 0, 2]
    book(
        CHAPTER, "Elastic catenary (cable_stretch, 40 elements)", reference="pull 15.8479468 N, sag 2.8129019 m",
        source="closed form", error=max(abs(H / 15.8479468 - 1.0), abs(middle / -2.8129019 - 1.0)), allowed=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("k", [0.3, 0.8])
def test_cable_that_turns(k: float, book: Book) -> None:
    material, section = (
        Material(young_modulus=1e6, poisson_ratio=0.3, density=1000.0),
        Rectangle(thickness=1e-3, width=1e-2),
    )
    a = beam("cable_stretch", 16, section=section, material=material)
    r = solved(solve_static(a, rotating=(0.0, 0.0, k * np.sqrt(1e6 / 1000.0))))
    error = abs(nodes(a, r)[-1, 0, 0] / (np.tan(k) / k) - 1.0)
    book(
        CHAPTER, f"Elastic cable that turns, k L = {k:g} (cable_stretch)", reference="tip radius tan(k L)/k",
        source="closed form", error=error, allowed=1e-9,
    )  # fmt: skip


BEND = General(area=1.0, Iy=1.0 / 12.0, Iz=1.0 / 12.0, J=1.0 / 6.0, shear_y=1.0, shear_z=1.0)


def bend(load: float, n: int) -> Array:
    """Tip of an eighth of a circle of 100 m, bent out of its plane."""
    angle = np.linspace(0.0, 0.25 * np.pi, n + 1)
    start = np.zeros((n + 1, 4, 3))
    start[:, 0, 0], start[:, 0, 1] = 100.0 * np.sin(angle), 100.0 * (1.0 - np.cos(angle))
    start[:, 1, 0], start[:, 1, 1] = np.cos(angle), np.sin(angle)
    start[:, 2, 0], start[:, 2, 1] = -np.sin(angle), np.cos(angle)
    start[:, 3, 2] = 1.0
    a = beam(
        "assumed_strain", n, section=BEND, length=25.0 * np.pi,
        material=Material(young_modulus=1e7, poisson_ratio=0.0, density=1.0),
        nodes=start, rest="start", more=tip_force(0.0, 0.0, load),
    )  # fmt: skip
    return nodes(a, solved(solve_static(a)))[-1, 0]


@pytest.mark.slow
@pytest.mark.parametrize(("load", "wanted"), [(300.0, (58.84, 22.33, 40.08)), (600.0, (47.23, 15.79, 53.37))])
def test_bend_of_45_degrees(load: float, wanted: tuple[float, ...], book: Book) -> None:
    """What was published was computed with 8 elements; the equations themselves give 0.1 m less."""
    coarse, fine = bend(load, 8), bend(load, 16)
    limit = fine + (fine - coarse) / 3.0
    exact = rod(
        np.array([0.0, 0.0, load]), 25.0 * np.pi, np.array([1e7, 5e6, 5e6]),
        np.array([5e6 / 6.0, 1e7 / 12.0, 1e7 / 12.0]), 0.01,
    )  # fmt: skip
    for reference, source, value, allowed in (
        ("rod of Reissner and Simo", "SciPy DOP853, shooting", exact, 0.01),
        (f"tip {wanted[0]}, {wanted[1]}, {wanted[2]} m", "Simo & Vu-Quoc 1986, 8 elements", np.array(wanted), 0.15),
    ):
        book(
            CHAPTER, f"Bend of 45 degrees, {load:g} N (assumed_strain, limit)", reference=reference, source=source,
            error=np.abs(limit - value).max(), allowed=allowed, unit="m",
        )  # fmt: skip


@pytest.mark.parametrize(("ratio", "wanted"), [(1, 0.1405770), (2, 0.4573634), (5, 1.4565838), (10, 3.1232504)])
def test_torsion_constant_of_a_rectangle(ratio: int, wanted: float, book: Book) -> None:
    J = Rectangle(thickness=1.0, width=float(ratio)).properties(0.3).J
    book(
        CHAPTER, f"Torsion constant of a rectangle, 1 : {ratio}", reference=f"J/c^4 = {wanted:.7f}",
        source="St Venant's series", error=abs(J / wanted - 1.0), allowed=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["clamp", "revolute"])
def test_torsion_of_a_held_rod(kind: str, book: Book) -> None:
    """The joint takes the torque by one director of the root, where the section shears a little: more, the finer."""
    section, material = (
        Rectangle(thickness=3.2024e-3, width=12.3777e-3),
        Material(young_modulus=71.7e9, poisson_ratio=0.31, density=2700.0),
    )
    torque = 0.01 * material.shear_modulus * section.properties(0.31).J / 0.508
    system = System()
    system.add(
        parts.Beam(length=0.508, section=section, material=material, elements=32, formulation="assumed_strain"), "rod"
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type=kind))
    if kind == "revolute":
        system.add(parts.JointSpring(a="ground", b="rod.root", stiffness=100.0))
    system.add(parts.Load(at="rod.tip", torque=(0.0, 0.0, 0.5 * torque), slope=2))
    system.add(parts.Load(at="rod.tip", torque=(0.0, -0.5 * torque, 0.0), slope=3))
    a = system.assemble()
    tip = nodes(a, solved(solve_static(a)), "rod")[-1]
    book(
        CHAPTER, f"Rod twisted at its tip, root on a {kind} (assumed_strain, 32 elements)", reference="T L/(G J)",
        source="closed form", error=abs(0.5 * (tip[2, 2] - tip[3, 1]) / 0.01 - 1.0), allowed=2e-4,
    )  # fmt: skip
