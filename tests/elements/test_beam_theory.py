"""Chains of elements in equilibrium against beam theory."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from elements.helpers import Chain, chain, rotation_by
from evolvent.elements import FORMULATIONS, General, Material, Rectangle, Taper, beam_form

REMEDIES = ("nu_split", "elastic_line", "assumed_strain")


def tip_load(c: Chain, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    load = np.zeros_like(c.q)
    load[-1, 0] = x, y, z
    return load


# ------------------------------------------------------------------------------------------------ small deflections


def deflection_ratio(formulation: str, count: int, nu: float, across: int = 1) -> float:
    """Tip deflection of a slender cantilever under a small load, over F L^3/(3 EI)."""
    length, section, material = (
        1.0,
        Rectangle(thickness=1e-3, width=2e-3),
        Material(young_modulus=1e9, poisson_ratio=nu, density=1.0),
    )
    s = section.properties(nu)
    EI = material.E * (s.Iz if across == 1 else s.Iy)
    c = chain(formulation, count, length, section, material)
    F = 1e-6 * 3.0 * EI / length**3
    load = tip_load(c)
    load[-1, 0, across] = F
    q = c.solve(c.q, c.clamped(), load, tolerance=1e-9)
    return q[-1, 0, across] / 1e-6


@pytest.mark.parametrize("across", [1, 2], ids=["thickness", "width"])
@pytest.mark.parametrize("formulation", [*REMEDIES, "full"])
def test_a_cantilever_bends_as_much_as_linear_curvature_lets_it(formulation, across, book):
    # of n elements with a constant curvature each: 1 - 1/(4 n^2); `full` only without Poisson's coupling
    nu = 0.0 if formulation == "full" else 0.3
    counts = (1, 2, 4, 8)
    side = "thickness" if across == 1 else "width"
    errors = [abs(deflection_ratio(formulation, n, nu, across) / (1.0 - 0.25 / n**2) - 1.0) for n in counts]
    book(
        "Statics of beams", f"Element chain, small tip load across the {side} ({formulation}, nu {nu:g})",
        reference="1 - 1/(4 n^2) of F L^3/3 EI, n = 1 to 8", source="closed form", error=max(errors), allowed=2e-5,
    )  # fmt: skip


def test_the_full_continuum_stays_too_stiff(book):
    # all of the section held in its shape: E/(lam + 2 mu) = (1 + nu)(1 - 2 nu)/(1 - nu) = 0.742857
    found = deflection_ratio("full", 40, 0.3)
    assert_allclose(found, 0.7427, rtol=2e-4)
    book(
        "Statics of beams", "Poisson locking of the continuum (full, 40 elements)", reference="26/35 of F L^3/3 EI",
        source="closed form", error=abs(found / (26 / 35 * (1.0 - 0.25 / 40**2)) - 1.0), allowed=2e-4,
    )  # fmt: skip


@pytest.mark.parametrize("across", [1, 2])
def test_a_cantilever_of_cables_is_exact_under_a_small_load(across):
    # a cubic is the exact shape; the stiffness is E Iz in both planes, a quarter of E Iy here
    wanted = 1.0 if across == 1 else 4.0
    assert_allclose(deflection_ratio("cable", 1, 0.3, across), wanted, rtol=1e-5)


@pytest.mark.parametrize("formulation", [*REMEDIES, "cable"])
def test_a_bar_stretches(formulation):
    section, material = (
        Rectangle(thickness=0.02, width=0.05),
        Material(young_modulus=7e5, poisson_ratio=0.3, density=1.0),
    )
    c = chain(formulation, 3, 1.2, section, material)
    strain = 1e-6
    load = tip_load(c, x=material.E * 0.02 * 0.05 * strain)
    free = c.clamped()
    free[0, 1:] = True  # the section may become thinner
    free[:, :, 1:] = False
    if formulation != "cable":
        free[:, 2, 1] = free[:, 3, 2] = True
    q = c.solve(c.q, free, load)
    assert_allclose(q[-1, 0, 0] - 1.2, 1.2 * strain, rtol=1e-5)
    if formulation == "nu_split":
        # Poisson's contraction, which strains of a line do not know
        assert_allclose(q[1, 2, 1] - 1.0, -0.3 * strain, rtol=1e-5)


@pytest.mark.parametrize("formulation", ["elastic_line", "assumed_strain"])
def test_a_taper_bends_by_its_moments(formulation):
    start, end, length = General(area=1.0, Iy=1e-4, Iz=2e-4, J=1e-4), General(area=1.0, Iy=1e-4, Iz=1e-4, J=1e-4), 2.0
    rib, material, n, F = (
        Taper(root=start, tip=end),
        Material(young_modulus=1e6, poisson_ratio=0.3, density=1.0),
        16,
        1e-3,
    )
    forms = [beam_form(formulation, length / n, rib.between(k / n, (k + 1) / n), material) for k in range(n)]
    c = Chain(forms, length)
    q = c.solve(c.q, c.clamped(), tip_load(c, y=F))
    x = np.linspace(0.0, length, 20001)
    bending = np.trapezoid(F * (length - x) ** 2 / (material.E * (2e-4 - 0.5e-4 * x)), x)
    shear = F * length / (material.shear_modulus * 1.0 * 5 / 6)
    assert_allclose(q[-1, 0, 1], bending + shear, rtol=2e-3)


# ------------------------------------------------------------------------------------------------ large deflections

STRIP = Rectangle(thickness=1e-3, width=2e-2)
STEEL = Material(young_modulus=2e11, poisson_ratio=0.3, density=7800.0)
EI = STEEL.E * STRIP.properties(0.3).Iz


def rolled_up(formulation: str, count: int, turns: float = 1.0) -> Chain:
    """A strip of 1 m under an end moment of 2 pi EI/L times `turns`."""
    c = chain(formulation, count, 1.0, STRIP, STEEL)
    # the moment acts on what tells the section's direction: the director, of a cable the slope
    vector = 1 if formulation == "cable" else 2
    q, steps = c.q, 12
    for k in range(1, steps + 1):
        q = c.solve(q, c.clamped(), moment=(vector, 2.0 * np.pi * EI * turns * k / steps), tolerance=1e-9)
    c.q = q
    return c


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "order"), [("assumed_strain", 2.0), ("cable", 4.0)])
def test_an_end_moment_rolls_a_strip_up_to_a_circle(formulation, order, book):
    counts = (10, 20)
    gaps = [np.linalg.norm(rolled_up(formulation, n).q[-1, 0]) for n in counts]
    assert gaps[1] < (0.05 if formulation == "assumed_strain" else 1e-4)
    assert_allclose(np.log2(gaps[0] / gaps[1]), order, atol=0.4)
    book(
        "Statics of beams", f"Element chain rolled up to a circle ({formulation}, 20 elements)",
        reference="tip back at the clamp", source="closed form", error=gaps[1],
        allowed=0.05 if formulation == "assumed_strain" else 1e-4, unit="L", order=np.log2(gaps[0] / gaps[1]),
        wanted=f"{order:g}",
    )  # fmt: skip


def test_half_a_circle_has_its_radius(book):
    c = rolled_up("cable", 16, turns=0.5)
    centre = np.array([0.0, 1.0 / np.pi, 0.0])
    assert_allclose(np.linalg.norm(c.q[:, 0] - centre, axis=1), 1.0 / np.pi, rtol=1e-4)
    book(
        "Statics of beams", "Roll-up to half a circle (cable, 16 elements)", reference="tip (0, 2/pi) L",
        source="closed form", error=np.abs(c.q[-1, 0] - 2.0 * centre).max(), allowed=1e-4, unit="L",
    )  # fmt: skip


@functools.cache
def elastica(load: float) -> tuple[float, float]:
    """Tip of a cantilever of length and EI 1 under a transverse dead load: theta'' = -load cos(theta)."""

    def integrate(curvature: float):
        def rhs(s, y):
            return [y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(rhs, (0.0, 1.0), [0.0, curvature, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]

    curvature = brentq(lambda k: integrate(k)[1], 1e-3, load, xtol=1e-12)
    return tuple(integrate(curvature)[2:])


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "count", "tolerance"), [("assumed_strain", 32, 1e-3), ("cable", 40, 3e-5)])
def test_a_cantilever_under_a_large_tip_load_is_an_elastica(formulation, count, tolerance):
    load = 10.0
    c = chain(formulation, count, 1.0, STRIP, STEEL)
    q = c.q
    for part in (0.02, 0.1, 0.3, 0.6, 1.0):
        q = c.solve(q, c.clamped(), tip_load(c, y=part * load * EI), tolerance=1e-9)
    # Bisshopp & Drucker (1945): 0.555 and 0.811 for this load
    assert_allclose(elastica(load), (1.0 - 0.55500, 0.81061), atol=1e-4)
    assert_allclose(q[-1, 0, :2], elastica(load), atol=tolerance)


def test_the_elastica_converges_as_stated(book):
    errors = []
    for count in (8, 16):
        c = chain("assumed_strain", count, 1.0, STRIP, STEEL)
        q = c.q
        for part in (0.05, 0.3, 1.0):
            q = c.solve(q, c.clamped(), tip_load(c, y=part * 4.0 * EI), tolerance=1e-9)
        errors.append(np.abs(q[-1, 0, :2] - elastica(4.0)).max())
    assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.15)
    book(
        "Statics of beams", "Elastica, P L^2/EI = 4 (assumed_strain, 16 elements)", reference="tip",
        source="shooting, SciPy, 1e-11", error=errors[1], allowed=2e-3, unit="L", order=np.log2(errors[0] / errors[1]),
        wanted="2",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ torsion


def torque(formulation: str, section, angle: float, count: int = 4, length: float = 2.0) -> float:
    """Torque that holds the last section turned about the axis."""
    material = Material(young_modulus=2.6e5, poisson_ratio=0.3, density=1.0)
    c = chain(formulation, count, length, section, material)
    turned, free = c.q.copy(), c.clamped()
    R = rotation_by(np.array([angle, 0.0, 0.0]))
    for k in range(1, count + 1):
        turn = rotation_by(np.array([angle * k / count, 0.0, 0.0]))
        turned[k, 2:] = c.q[k, 2:] @ turn.T
    assert_allclose(turned[-1, 2], R[:, 1])
    free[-1, 2:] = False
    q = c.solve(turned, free)
    f = c.force(q)
    return float(np.cross(q[-1], f[-1]).sum(axis=0)[0])


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_twist_is_torque_over_the_torsional_stiffness(formulation, book):
    section, length, angle, G = Rectangle(thickness=0.01, width=0.05), 2.0, 1e-3, 1e5
    s = section.properties(0.3)
    # the sections of the first two do not warp, and are stiffer for it
    J = s.Iy + s.Iz if formulation == "full" else s.J
    if formulation == "nu_split":
        J = s.shear_y * (s.Iy + s.Iz)
    reference = {"full": "J = Iy + Iz, no warping", "nu_split": "J = 0.85 (Iy + Iz)"}.get(formulation, "J of St Venant")
    book(
        "Statics of beams", f"Torsion of a rod 1 : 5 ({formulation})", reference=reference, source="closed form",
        error=abs(torque(formulation, section, angle) / (G * J * angle / length) - 1.0), allowed=1e-4,
    )  # fmt: skip


def test_torsion_of_a_general_section():
    section = General(area=1e-3, Iy=1e-7, Iz=2e-7, J=5e-8)
    assert_allclose(torque("assumed_strain", section, 1e-3), 1e5 * 5e-8 * 1e-3 / 2.0, rtol=1e-4)


# ------------------------------------------------------------------------------------------------ bending and torsion


def princeton(load: float, angle: float, count: int = 8) -> np.ndarray:
    """Last node of the Princeton beam (Dowell & Traybar 1975), turned about its axis against a vertical tip load.

    20 x 0.5 x 0.125 inch of aluminium; the load's components are along y (thickness) and z (width).
    """
    section = Rectangle(thickness=3.2024e-3, width=12.377e-3)
    c = chain(
        "assumed_strain", count, 0.508, section, Material(young_modulus=71.7e9, poisson_ratio=0.31, density=2700.0)
    )
    q = c.q
    for part in (0.1, 0.4, 1.0):
        q = c.solve(q, c.clamped(), part * tip_load(c, y=load * np.sin(angle), z=load * np.cos(angle)), tolerance=1e-9)
    return q[-1]


def test_the_princeton_beam_under_small_loads():
    s, E, length = Rectangle(thickness=3.2024e-3, width=12.377e-3).properties(0.31), 71.7e9, 0.508
    load, angle = 4.448e-3, np.radians(45.0)
    tip = princeton(load, angle)[0]
    assert_allclose(tip[1], load * np.sin(angle) * length**3 / (3 * E * s.Iz), rtol=0.01)
    assert_allclose(tip[2], load * np.cos(angle) * length**3 / (3 * E * s.Iy), rtol=0.01)


def test_the_princeton_beam_under_large_loads():
    s, E, length = Rectangle(thickness=3.2024e-3, width=12.377e-3).properties(0.31), 71.7e9, 0.508
    load = 13.345
    flat, edge, oblique = (princeton(load, np.radians(a)) for a in (90.0, 0.0, 45.0))
    linear = load * length**3 / (3 * E * s.Iz)
    # a long way across the thickness, where it is an elastica; hardly any across the width
    assert flat[0][1] < 0.9 * linear
    assert_allclose(flat[0][:2] / length, elastica(load * length**2 / (E * s.Iz)), atol=1e-3)
    assert_allclose(flat[0][2], 0.0, atol=1e-9)
    assert_allclose(edge[0][2], load * length**3 / (3 * E * s.Iy), rtol=0.01)
    assert_allclose(edge[0][1], 0.0, atol=1e-9)
    # oblique: the section twists, so that it gives more across its width than linear theory says
    assert oblique[0][2] > 1.2 * load * np.cos(np.radians(45.0)) * length**3 / (3 * E * s.Iy)
    twist = np.degrees(np.arctan2(oblique[2][2], oblique[2][1]))
    assert 0.5 < abs(twist) < 6.0
    finer = princeton(load, np.radians(45.0), count=16)
    assert_allclose(oblique[0], finer[0], rtol=0.02)


def buckling_factor(count: int) -> float:
    """Tip load at which a deep cantilever strip gives way sideways, times L^2/sqrt(E I G J)."""
    section, material, length = Rectangle(thickness=1e-3, width=5e-2), STEEL, 1.0
    s = section.properties(material.nu)
    unit = np.sqrt(material.E * s.Iz * material.shear_modulus * s.J) / length**2
    c = chain("assumed_strain", count, length, section, material)
    free = c.clamped()
    planar = free.copy()
    planar[:, [0, 1, 3], 1] = planar[:, 2, [0]] = planar[:, 2, 2:] = False  # no motion out of the strip's plane
    keep = free.ravel()
    state = {"q": c.q}

    def lowest(factor: float) -> float:
        state["q"] = c.solve(state["q"], planar, tip_load(c, z=-factor * unit), tolerance=1e-9)
        K = c.tangent(state["q"])[np.ix_(keep, keep)]
        scale = 1.0 / np.sqrt(np.diag(K))
        return float(np.linalg.eigvalsh(K * np.outer(scale, scale))[0])

    return brentq(lowest, 3.5, 4.5, xtol=1e-4)


def test_a_deep_strip_buckles_sideways_at_the_load_of_theory(book):
    # from above: 6.3, 1.6, 0.44, 0.15 % at 4, 8, 16, 32 elements
    assert_allclose(buckling_factor(8), 4.0126, rtol=0.02)
    book(
        "Statics of beams", "Lateral buckling, element chain (assumed_strain, 32 elements)",
        reference="4.0125993 sqrt(EI GJ)/L^2", source="closed form, Prandtl 1899",
        error=abs(buckling_factor(32) / 4.0125993 - 1.0), allowed=3e-3,
    )  # fmt: skip
