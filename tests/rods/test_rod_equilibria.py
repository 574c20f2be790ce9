"""Slender rods under follower loads and torques of fixed axes: equilibria against integrations, stability."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from book import Book
from evolvent import System, parts
from evolvent.elements import General, Material, Rectangle
from evolvent.elements.rods import section_stiffness
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.modal.positions import linearized_points
from evolvent.solvers.static.static import solve_static
from rods.building import cantilever
from static.composing import STEEL

Array = np.ndarray
CHAPTER = "Statics of beams"
MATERIAL = Material(young_modulus=1e8, poisson_ratio=0.0, density=1.0)
BEND: dict[str, Any] = {
    "length": 25.0 * np.pi, "section": General(area=1.0, Iy=1.0 / 12.0, Iz=1.0 / 12.0, J=1.0 / 6.0),
    "material": Material(young_modulus=1e7, poisson_ratio=0.0, density=1.0), "curvature": (0.0, 0.0, 0.01),
}  # fmt: skip


def slender(EA: float = 1e8, GJ: float = 1.0) -> dict[str, Any]:
    """A straight rod with E I = L = 1."""
    section = General(area=1e-8 * EA, Iy=1e-8, Iz=1e-8, J=2e-8 * GJ)
    return {"length": 1.0, "section": section, "material": MATERIAL}


def helix(turns: int, rise: float) -> dict[str, Any]:
    """A helical spring of radius 1 with E I = 1 and a thick wire; `rise` per radian."""
    square = 1.0 + rise * rise
    section = General(area=1e-4, Iy=1e-8, Iz=1e-8, J=1.6e-8)
    curved = {"curvature": (rise / square, 0.0, 1.0 / square), "length": 2.0 * np.pi * turns * np.sqrt(square)}
    return {"section": section, "material": MATERIAL, **curved}


def found(*loads: parts.Part, **keys: Any) -> tuple[Solution, Array, Array]:
    """The equilibrium of a cantilever, its tip, and the rotation matrix of its tip."""
    system = cantilever(**keys)
    for load in loads:
        system.add(load)
    assembly = system.assemble()
    r = solve_static(assembly)
    assert r.success, r.message
    w, x, y, z = r.y[-1, int(assembly.model.bodies["iq"][-1]) + 3 :][:4]
    at = linearized_points(assembly, r.y[-1])["rod.tip"].position
    return r, at, Rotation.from_quat([x, y, z, w]).as_matrix()


def crossed(a: Array) -> Array:
    """The matrix of the product a x b."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def integrated(force: Any, torque: Any, R: Array, *, frame: str = "inertial", **keys: Any) -> Array:
    """Tip of the rod of Reissner and Simo by integration from the tip to the root; R is where its rotation is sought.

    Loads in the tip's axes fix all that is integrated; else the rotation of the tip is sought for which the root is
    clamped along x.
    """
    C = np.diag(section_stiffness(keys["section"], keys["material"]))
    rest, length = np.array(keys.get("curvature", (0.0, 0.0, 0.0))), keys["length"]

    def from_tip(R: Array) -> tuple[Array, Array]:
        turn = R if frame == "body" else np.eye(3)

        def slope(_: float, y: Array) -> Array:
            Q, m = y[3:12].reshape(3, 3), y[12:]
            gamma, k = Q.T @ n / C[:3] + np.array([1.0, 0.0, 0.0]), Q.T @ m / C[3:] + rest
            along, turning = Q @ gamma, Q @ crossed(k)
            return np.concatenate([along, turning.ravel(), -crossed(along) @ n])

        n, m = turn @ np.array(force), turn @ np.array(torque)
        y0 = np.concatenate([np.zeros(3), R.ravel(), m])
        end = solve_ivp(slope, (length, 0.0), y0, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        return end[:3], end[3:12].reshape(3, 3)

    def off(turn: Array) -> Array:
        return Rotation.from_matrix(from_tip(R @ Rotation.from_rotvec(turn).as_matrix())[1]).as_rotvec()

    if frame == "body":
        x, Q = from_tip(np.eye(3))
        return -Q.T @ x
    sought = root(off, np.zeros(3), tol=1e-13)
    assert np.abs(off(sought.x)).max() < 1e-10
    assert np.abs(sought.x).max() < 1e-2  # the branch that was found
    return -from_tip(R @ Rotation.from_rotvec(sought.x).as_matrix())[0]


def enter(book: Book, case: str, x: Array, wanted: Array, allowed: float, size: float = 1.0) -> None:
    book(
        CHAPTER, f"{case} (rod)", reference="tip", source="rod of Reissner and Simo, SciPy DOP853",
        error=float(np.abs(x - wanted).max() / size), allowed=allowed, unit="L",
    )  # fmt: skip


def quadratic(r: Solution) -> bool:
    """Whether the last correction is that of a quadratic convergence from the one before.

    Its factor is large, since what a turn stretches is second order in it, and E A is 1e8 times E I/L^2.
    """
    newton = r.path.newton  # type: ignore[union-attr]
    last = newton.correction[newton.step == newton.step[-1]]
    assert np.isnan(last[-1])
    return bool(last[-2] < 1e4 * last[-3] ** 2 + 1e-13)


# ---------------------------------------------------------------------------------------------- equilibria


def test_a_small_force_beside_a_torque_is_right_to_its_own_size() -> None:
    """Of a force of 1e-4 E I/L^2 across a rod that a torque bends; E A = 1e8 E I/L^2 hides nothing."""
    loads = parts.Load(at="rod.tip", torque=(0.0, 0.0, 1.0)), parts.Load(at="rod.tip", force=(0.0, 0.0, 1e-4))
    r, x, R = found(*loads, elements=20, **slender())
    wanted = integrated((0.0, 0.0, 1e-4), (0.0, 0.0, 1.0), R, **slender())
    assert x[2] == pytest.approx(wanted[2], rel=1e-6)
    assert quadratic(r)


@pytest.mark.slow
@pytest.mark.parametrize("torque", [(0.5, 0.0, 1.0), (1.0, 0.0, 2.0), (2.0, 1.0, 3.0)])
def test_torque_about_a_fixed_axis(torque: tuple[float, ...], book: Book) -> None:
    r, x, R = found(parts.Load(at="rod.tip", torque=torque), elements=20, **slender())
    wanted = integrated((0.0, 0.0, 0.0), torque, R, **slender())
    enter(book, f"Torque {torque} EI/L of fixed axis, 20 elements", x, wanted, 1e-6)
    assert quadratic(r)


def test_a_dead_force_along_and_across() -> None:
    force = (-0.74, 0.12, 0.0)
    r, x, R = found(parts.Load(at="rod.tip", force=force), elements=20, **slender())
    assert x == pytest.approx(integrated(force, (0.0, 0.0, 0.0), R, **slender()), abs=1e-7)
    assert r.statistics["iterations"] < 60


@pytest.mark.parametrize("load", [300.0, 600.0])
def test_bend_of_45_degrees_under_a_follower_force(load: float, book: Book) -> None:
    push = parts.Load(at="rod.tip", force=(0.0, 0.0, load), frame="body")
    (r, coarse, R), (_, fine, _) = (found(push, elements=n, **BEND) for n in (16, 32))
    wanted = integrated((0.0, 0.0, load), (0.0, 0.0, 0.0), R, frame="body", **BEND)
    limit = fine + (fine - coarse) / 15.0
    enter(book, f"Bend of 45 degrees, follower force of {load:g} N, limit", limit, wanted, 1e-6, BEND["length"])
    assert quadratic(r)


def elastica(load: float, share: float) -> Array:
    """Tip of a cantilever along x, E I = L = 1, under (-load, share load, 0): closed form.

    With the angle a between the tangent and the direction against the force, sin(a/2) = k sin(phi): sqrt(F) s is the
    difference of the elliptic integrals of the first kind.
    """
    F, start = load * np.hypot(1.0, share), np.arctan(share)

    def ends(k: float) -> float:
        return float(np.arcsin(min(np.sin(0.5 * start) / k, 1.0)))

    def short(k: float) -> float:
        return float(ellipk(k * k) - ellipkinc(ends(k), k * k) - np.sqrt(F))

    k = brentq(short, np.sin(0.5 * start) * (1.0 + 1e-12), 1.0 - 1e-14, xtol=1e-15)
    phi, root_f = ends(k), np.sqrt(F)
    along = (2.0 * (ellipe(k * k) - ellipeinc(phi, k * k)) - (ellipk(k * k) - ellipkinc(phi, k * k))) / root_f
    across = 2.0 * k * np.cos(phi) / root_f
    c, s = np.cos(start), np.sin(start)
    return np.array([c * along + s * across, -s * along + c * across, 0.0])


@pytest.mark.parametrize(("share", "side"), [(1.05, 1e-3), (1.5, 1e-2), (3.0, 1e-2)])
def test_column_beyond_its_critical_load(share: float, side: float, book: Book) -> None:
    """With a side force that bends it one way; found is the branch to that side, which is stable."""
    load = share * 0.25 * np.pi**2
    r, x, _ = found(parts.Load(at="rod.tip", force=(-load, side * load, 0.0)), elements=20, **slender())
    wanted = elastica(load, side)
    book(
        CHAPTER, f"Column at {share:g} of its critical load (rod, 20 elements)", reference="tip",
        source="closed form, elliptic integrals", error=float(np.abs(x - wanted).max()), allowed=2e-5, unit="L",
    )  # fmt: skip
    assert r.path is not None
    assert r.path.unstable == 0
    assert quadratic(r)


@pytest.mark.slow
def test_helical_spring_with_force_and_moment_of_fixed_axes(book: Book) -> None:
    force, torque, keys = (0.03, -0.02, 0.05), (0.05, 0.1, 0.04), helix(3, 0.15)
    loads = parts.Load(at="rod.tip", force=force), parts.Load(at="rod.tip", torque=torque)
    (_, coarse, _), (_, fine, R) = (found(*loads, elements=n, **keys) for n in (24, 48))
    wanted = integrated(force, torque, R, **keys)
    limit = fine + (fine - coarse) / 3.0
    enter(book, "Helical spring of 3 turns, force and moment at its end, limit", limit, wanted, 1e-5, keys["length"])


# ---------------------------------------------------------------------------------------------- stability


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rod", "assumed_strain"])
def test_flutter_of_becks_column(kind: str) -> None:
    """A follower force makes a cantilever flutter from 20.05 E I/L^2 on, at 11.0 sqrt(EI/(m L^4)); stable below."""
    keys: dict[str, Any]
    if kind == "rod":
        keys, EI, m = slender(), 1.0, 1.0
    else:
        section = Rectangle(thickness=1e-3, width=2e-3)
        keys = {"length": 1.0, "section": section, "material": STEEL}
        EI, m = STEEL.E * section.properties(0.3).Iz, STEEL.density * 2e-6
    for load, stable in ((5.0, True), (15.0, True), (19.9, True), (20.3, False), (30.0, False)):
        system = System()
        part = parts.Rod(elements=16, **keys) if kind == "rod" else parts.Beam(elements=16, formulation=kind, **keys)
        system.add(part, "rod")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"))
        system.add(parts.Load(at="rod.tip", force=(-load * EI, 0.0, 0.0), frame="body"))
        r = solve_static(system.assemble())
        assert r.success, r.message
        assert r.path is not None
        assert (r.path.unstable == 0) == stable, (load, r.message)
        assert ("flutter" in r.message) != stable
        if load == 20.3:
            rate = float(r.message.rpartition(" at ")[2].split()[0])
            assert rate == pytest.approx(11.0 * np.sqrt(EI / m), rel=0.02)


@pytest.mark.slow
def test_damping_lowers_the_load_of_flutter() -> None:
    """By the stiffness, however little, to about 10.94 E I/L^2 (Bolotin 1963; Herrmann & Jong 1965)."""
    for load, stable in ((10.0, True), (12.0, False)):
        push = parts.Load(at="rod.tip", force=(-load, 0.0, 0.0), frame="body")
        r, _, _ = found(push, elements=16, stiffness_damping=1e-4, **slender())
        assert r.path is not None
        assert (r.path.unstable == 0) == stable
