"""The quadratic forms against energies that are integrated point by point, and against the paper's table."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from elements.helpers import damped_force, difference, energy, force, gradients, green, points, shape_gradients, tangent
from evolvent.elements import (
    FORMULATIONS,
    PARTS,
    General,
    Material,
    Rectangle,
    Taper,
    beam_form,
    beam_parts,
    cable_bending,
    cable_form,
    cable_parts,
    line_stiffness,
    line_strains,
    straight_beam,
    straight_cable,
)
from evolvent.kernels import ancf
from evolvent_base.errors import InputError

LENGTH = 1.3
MATERIAL = Material(young_modulus=2.1, poisson_ratio=0.3, density=1.7)
BAR = Rectangle(thickness=0.4, width=0.7)
TAPER = Taper(root=BAR, tip=Rectangle(thickness=0.6, width=0.3))
SECTIONS = pytest.mark.parametrize("section", [BAR, TAPER], ids=["prismatic", "tapered"])
FORMS = [*FORMULATIONS, "cable"]


def shape_of(formulation: str, rng: np.random.Generator, spread: float = 0.3) -> np.ndarray:
    straight = straight_cable(LENGTH) if formulation == "cable" else straight_beam(LENGTH)
    return straight + rng.uniform(-spread, spread, straight.size)


def form_of(formulation: str, section=BAR, **options):
    if formulation == "cable":
        return cable_form(LENGTH, section, MATERIAL, **options)
    return beam_form(formulation, LENGTH, section, MATERIAL, **options)


# ------------------------------------------------------------------------------------------------ energies by points


def over_volume(section, density) -> float:
    """Integral of density(x, y, z)."""
    total = 0.0
    for x, wx in points(8, 0.0, LENGTH):
        here = section.at(x / LENGTH)
        for y, wy in points(3, -here.thickness / 2, here.thickness / 2):
            for z, wz in points(3, -here.width / 2, here.width / 2):
                total += wx * wy * wz * density(x, y, z)
    return total


def lame() -> tuple[float, float]:
    E, nu = MATERIAL.E, MATERIAL.nu
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def full_energy(e, section) -> float:
    lam, mu = lame()

    def density(x, y, z):
        strain = green(gradients(e, LENGTH, x, y, z))
        return 0.5 * lam * np.trace(strain) ** 2 + mu * np.sum(strain**2)

    return over_volume(section, density)


def nu_split_energy(e, section) -> float:
    lam, mu = lame()
    k = section.at(0.0).properties(MATERIAL.nu).shear_y

    def without_poisson(x, y, z):
        E = green(gradients(e, LENGTH, x, y, z))
        normal = 0.5 * MATERIAL.E * np.sum(np.diag(E) ** 2)
        return normal + 2.0 * mu * (E[1, 2] ** 2 + k * E[0, 1] ** 2 + k * E[0, 2] ** 2)

    total = over_volume(section, without_poisson)
    for x, w in points(8, 0.0, LENGTH):
        normal = np.diag(green(gradients(e, LENGTH, x, 0.0, 0.0)))
        rest = 0.5 * lam * normal.sum() ** 2 + (mu - 0.5 * MATERIAL.E) * np.sum(normal**2)
        total += w * section.at(x / LENGTH).properties(MATERIAL.nu).area * rest
    return total


def axis_strains(e, x) -> np.ndarray:
    """In the order of `ancf.STRAINS`."""
    r = gradients(e, LENGTH, x, 0.0, 0.0)
    nodes = e.reshape(8, 3)
    by, cz = (nodes[6] - nodes[2]) / LENGTH, (nodes[7] - nodes[3]) / LENGTH
    E = green(r)
    twist = 0.5 * (by @ r.z - cz @ r.y)
    return np.array([E[0, 0], 2 * E[0, 1], 2 * E[0, 2], twist, r.x @ by, r.x @ cz, E[1, 1], E[2, 2], 2 * E[1, 2]])


def stiffness(section, x) -> np.ndarray:
    s, mu = section.at(x / LENGTH).properties(MATERIAL.nu), lame()[1]
    EA, GA = MATERIAL.E * s.area, mu * s.area
    return np.array([EA, s.shear_y * GA, s.shear_z * GA, mu * s.J, MATERIAL.E * s.Iz, MATERIAL.E * s.Iy, EA, EA, GA])


def line_energy(e, section, rules) -> float:
    total = 0.0
    for strain, rule in enumerate(rules):
        total += sum(0.5 * w * stiffness(section, x)[strain] * axis_strains(e, x)[strain] ** 2 for x, w in rule)
    return total


def elastic_line_energy(e, section) -> float:
    # 7 points, as the form takes them: J of a taper is not a polynomial
    return line_energy(e, section, [points(7, 0.0, LENGTH)] * 9)


def assumed_strain_energy(e, section) -> float:
    three, two = points(3, 0.0, LENGTH), points(2, 0.0, LENGTH)
    ends = [(0.0, LENGTH / 2), (LENGTH, LENGTH / 2)]
    simpson = [(0.0, LENGTH / 6), (LENGTH / 2, 4 * LENGTH / 6), (LENGTH, LENGTH / 6)]
    return line_energy(e, section, [three, simpson, simpson, two, two, two, ends, ends, ends])


def cable_energy(e, section) -> float:
    nodes = e.reshape(4, 3)

    def derivative(x, order):
        xi = x / LENGTH
        if order == 1:
            S = [6 * xi * (xi - 1) / LENGTH, 1 - 4 * xi + 3 * xi**2, 6 * xi * (1 - xi) / LENGTH, 3 * xi**2 - 2 * xi]
        else:
            S = [(12 * xi - 6) / LENGTH**2, (6 * xi - 4) / LENGTH, (6 - 12 * xi) / LENGTH**2, (6 * xi - 2) / LENGTH]
        return np.array(S) @ nodes

    total = 0.0
    for x, w in points(3, 0.0, LENGTH):
        EA = MATERIAL.E * section.at(x / LENGTH).properties(MATERIAL.nu).area
        total += 0.5 * w * EA * (0.5 * (derivative(x, 1) @ derivative(x, 1) - 1.0)) ** 2
    for x, w in points(8, 0.0, LENGTH):
        EI = MATERIAL.E * section.at(x / LENGTH).properties(MATERIAL.nu).Iz
        total += 0.5 * w * EI * derivative(x, 2) @ derivative(x, 2)
    return total


ENERGIES = {
    "full": full_energy,
    "nu_split": nu_split_energy,
    "elastic_line": elastic_line_energy,
    "assumed_strain": assumed_strain_energy,
    "cable": cable_energy,
}


@SECTIONS
@pytest.mark.parametrize("formulation", FORMS)
def test_energy_is_what_the_points_give(formulation, section, rng):
    form = form_of(formulation, section)
    for _ in range(3):
        e = shape_of(formulation, rng)
        assert_allclose(energy(form, e), ENERGIES[formulation](e, section), rtol=1e-12)


# ------------------------------------------------------------------------------------------------ derivatives


@SECTIONS
@pytest.mark.parametrize("formulation", FORMS)
def test_force_and_tangent_are_derivatives(formulation, section, rng):
    form = form_of(formulation, section)
    e = shape_of(formulation, rng)
    f, K = force(form, e), tangent(form, e)
    assert_allclose(f, difference(lambda x: energy(form, x), e, 0.05), rtol=0.0, atol=1e-10 * np.abs(f).max())
    assert_allclose(K, difference(lambda x: force(form, x), e, 0.05), rtol=0.0, atol=1e-10 * np.abs(K).max())
    assert_allclose(K, K.T, rtol=0.0, atol=1e-14 * np.abs(K).max())


@pytest.mark.parametrize("formulation", FORMS)
def test_force_is_added_and_the_tangent_written(formulation, rng):
    form = form_of(formulation)
    e = shape_of(formulation, rng)
    f = np.ones(e.size)
    damped_force(form, e, np.zeros(e.size), 0.0, f)
    assert_allclose(f, 1.0 + force(form, e), rtol=1e-14, atol=1e-15)
    assert np.isfinite(tangent(form, e)).all()


# ------------------------------------------------------------------------------------------------ the paper's table


@functools.cache
def paper_table() -> tuple[np.ndarray, np.ndarray]:
    """K1 : (8, 8) and C : (8, 8, 8, 8), one entry for each pair of nodal vectors; S,ab = S,a^T S,b.

    The 24^4 table repeats them for x, y and z: (S_ab)_i e is a sum of scalars S,a S,b times vectors.
    """
    lam, mu = lame()
    K1, C = np.zeros((8, 8)), np.zeros((8, 8, 8, 8))
    for x, wx in points(5, 0.0, LENGTH):
        for y, wy in points(3, -BAR.thickness / 2, BAR.thickness / 2):
            for z, wz in points(3, -BAR.width / 2, BAR.width / 2):
                w, S = wx * wy * wz, shape_gradients(LENGTH, x, y, z)
                trace = sum(np.outer(a, a) for a in S)
                K1 -= 0.5 * (3 * lam + 2 * mu) * w * trace
                C += 0.5 * lam * w * np.multiply.outer(trace, trace)
                for a in S:
                    for b in S:
                        half = 0.5 * (np.outer(a, b) + np.outer(b, a))
                        C += mu * w * np.multiply.outer(half, half)
    return K1, C


def paper_stiffness(e: np.ndarray) -> np.ndarray:
    """K_e = K1 + K2(e), (K2)_ij = e^T C^ij e, C^ij the product of the rows i and j of the matrices S,ab; (24, 24)."""
    K1, C = paper_table()
    nodes = e.reshape(8, 3)
    K2 = np.einsum("ikjl,kc,ld->icjd", C, nodes, nodes).reshape(24, 24)
    return np.kron(K1, np.eye(3)) + K2


def test_the_papers_table_gives_the_full_force(rng):
    form = form_of("full")
    for _ in range(3):
        e = shape_of("full", rng)
        f = paper_stiffness(e) @ e
        assert_allclose(force(form, e), f, rtol=0.0, atol=1e-12 * np.abs(f).max())


def test_the_papers_table_gives_the_papers_damping(rng):
    form = form_of("full")
    e, u = shape_of("full", rng), rng.normal(size=24)
    f = np.zeros(24)
    power = ancf.paper_damped_force_of(e, u, 0.7, form.H, form.h, ancf.N, np.zeros(ancf.WORK), f)
    damping = 0.7 * paper_stiffness(e) @ u
    assert_allclose(f - force(form, e), damping, rtol=0.0, atol=1e-12 * np.abs(damping).max())
    assert_allclose(power, u @ damping, rtol=1e-12)


# ------------------------------------------------------------------------------------------------ parts and rest shapes


@pytest.mark.parametrize("formulation", FORMS)
def test_the_parts_add_up(formulation, rng):
    e = shape_of(formulation, rng)
    if formulation == "cable":
        parts = cable_parts(LENGTH, BAR, MATERIAL)
        assert tuple(parts) == ("membrane", "bending")
    else:
        parts = beam_parts(formulation, LENGTH, BAR, MATERIAL)
        assert tuple(parts) == PARTS
    total = sum(energy(part, e) for part in parts.values())
    assert_allclose(total, energy(form_of(formulation), e), rtol=1e-12)


@pytest.mark.parametrize("formulation", ["elastic_line", "assumed_strain"])
def test_parts_of_a_stretched_a_bent_and_a_twisted_element(formulation):
    parts = beam_parts(formulation, LENGTH, BAR, MATERIAL)
    s, straight = BAR.properties(MATERIAL.nu), straight_beam(LENGTH).reshape(8, 3)

    stretched = straight.copy()
    stretched[4, 0] *= 1.1
    stretched[[1, 5], 0] = 1.1
    strain = 0.5 * (1.1**2 - 1.0)
    found = {name: energy(part, stretched.ravel()) for name, part in parts.items()}
    assert_allclose(found.pop("membrane"), 0.5 * MATERIAL.E * s.area * strain**2 * LENGTH, rtol=1e-12)
    assert_allclose(list(found.values()), 0.0, atol=1e-14)

    a = 1e-3
    twisted = straight.copy()
    twisted[6], twisted[7] = [0, np.cos(a), np.sin(a)], [0, -np.sin(a), np.cos(a)]
    found = {name: energy(part, twisted.ravel()) for name, part in parts.items()}
    GJ = MATERIAL.E / (2 * (1 + MATERIAL.nu)) * s.J
    assert_allclose(found["torsion"], 0.5 * GJ * a**2 / LENGTH, rtol=1e-5)
    assert_allclose([found["membrane"], found["bending"]], 0.0, atol=1e-16)

    for director, moment in ((6, s.Iz), (7, s.Iy)):
        bent = straight.copy()
        bent[director, 0] = -a
        found = {name: energy(part, bent.ravel()) for name, part in parts.items()}
        assert_allclose(found["bending"], 0.5 * MATERIAL.E * moment * a**2 / LENGTH, rtol=1e-5)


@pytest.mark.parametrize("formulation", FORMS)
def test_no_force_in_the_rest_shape(formulation, rng):
    straight = straight_cable(LENGTH) if formulation == "cable" else straight_beam(LENGTH)
    form = form_of(formulation)
    scale = np.abs(tangent(form, straight)).max()
    assert abs(energy(form, straight)) < 1e-15 * scale
    assert np.abs(force(form, straight)).max() < 1e-14 * scale
    assert np.linalg.eigvalsh(tangent(form, straight)).min() > -1e-13 * scale
    # the rigid motions, and of a cable also the turn about its axis, which it does not feel
    free = np.sum(np.linalg.eigvalsh(tangent(form, straight)) < 1e-11 * scale)
    assert free == (5 if formulation == "cable" else 6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_curved_rest_shape_has_neither_energy_nor_force(formulation):
    angle = 0.2
    radius = LENGTH / angle
    rest = straight_beam(LENGTH).reshape(8, 3)
    rest[4] = radius * np.array([np.sin(angle), 1 - np.cos(angle), 0])
    for k, direction in ((5, [np.cos(angle), np.sin(angle), 0]), (6, [-np.sin(angle), np.cos(angle), 0])):
        rest[k] = direction
    form = form_of(formulation, rest=rest)
    scale = np.abs(tangent(form, rest.ravel())).max()
    assert abs(energy(form, rest.ravel())) < 1e-15 * scale
    assert np.abs(force(form, rest.ravel())).max() < 1e-14 * scale
    straight = straight_beam(LENGTH)
    bending = beam_parts(formulation, LENGTH, BAR, MATERIAL, rest=rest)["bending"]
    moment = BAR.properties(MATERIAL.nu).Iz
    assert_allclose(energy(bending, straight), 0.5 * MATERIAL.E * moment * angle**2 / LENGTH, rtol=0.02)


def test_the_cables_curvature_makes_its_bending_energy(rng):
    e = shape_of("cable", rng).reshape(4, 3)
    v = np.array([e[1], e[2] - e[0], e[3]])
    q = cable_bending(LENGTH, BAR, MATERIAL)[:, :3] @ v
    bending = cable_parts(LENGTH, BAR, MATERIAL)["bending"]
    assert_allclose(0.5 * np.sum(q**2), energy(bending, e.ravel()), rtol=1e-12)


# ------------------------------------------------------------------------------------------------ strains and sections


def test_strains_and_forces_of_the_line(rng):
    e = shape_of("elastic_line", rng)
    strains = np.zeros(9)
    for xi in (0.0, 0.3, 1.0):
        ancf.line_strains(e, LENGTH, xi, strains)
        assert_allclose(strains, axis_strains(e, xi * LENGTH), rtol=1e-12, atol=1e-14)
        assert_allclose(strains, line_strains("elastic_line", LENGTH, xi, e), rtol=1e-12, atol=1e-14)
        assert_allclose(line_strains("elastic_line", LENGTH, xi, straight_beam(LENGTH)), 0.0, atol=1e-15)
        assert_allclose(line_stiffness(xi, TAPER, MATERIAL), stiffness(TAPER, xi * LENGTH), rtol=1e-12)


def test_shape_functions_and_their_gradients(rng):
    e = rng.normal(size=24)
    S = np.zeros(8)

    def place(x):
        ancf.beam_shape(LENGTH, x[0] / LENGTH, x[1], x[2], S)
        return np.array(ancf.interpolate(S, e))

    at = np.array([0.37, 0.11, -0.2])
    assert_allclose(difference(place, at, 0.05), np.column_stack(gradients(e, LENGTH, *at)), rtol=1e-10, atol=1e-12)
    assert_allclose(place(np.zeros(3)), e[:3], rtol=1e-14)
    assert_allclose(place(np.array([LENGTH, 0.0, 0.0])), e[12:15], rtol=1e-14)


def test_torsion_constant_of_rectangles():
    # Timoshenko & Goodier: J/(w t^3) = 0.1406, 0.229, 0.312 for w/t = 1, 2, 10; the sides may be exchanged
    for ratio, k in ((1.0, 0.1406), (2.0, 0.2287), (10.0, 0.3123)):
        upright = Rectangle(thickness=1.0, width=ratio).properties(0.3)
        lying = Rectangle(thickness=ratio, width=1.0).properties(0.3)
        assert_allclose(upright.J, k * ratio, rtol=1e-3)
        assert_allclose(lying.J, upright.J, rtol=1e-12)
        assert_allclose((upright.Iy, upright.Iz), (ratio**3 / 12, ratio / 12), rtol=1e-14)


def test_a_general_section_of_a_rectangles_properties_is_the_rectangle():
    s = BAR.properties(MATERIAL.nu)
    general = General(area=s.area, Iy=s.Iy, Iz=s.Iz, J=s.J, shear_y=s.shear_y, shear_z=s.shear_z)
    for formulation in ("elastic_line", "assumed_strain"):
        one, other = (beam_form(formulation, LENGTH, section, MATERIAL) for section in (BAR, general))
        assert_allclose(one.H, other.H, rtol=1e-14)


def test_a_taper_can_be_cut():
    half = TAPER.between(0.5, 1.0)
    assert half.at(0.0).thickness == pytest.approx(0.5)
    assert half.at(1.0) == TAPER.at(1.0)
    assert half.at(0.5).width == pytest.approx(TAPER.at(0.75).width)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Material(young_modulus=-1.0, poisson_ratio=0.3, density=1.0),
            "Material.young_modulus is -1.0; it must be a modulus above 0",
        ),
        (lambda: Material(young_modulus=1.0, poisson_ratio=0.51, density=1.0), "Material.poisson_ratio is 0.51"),
        (lambda: Material(young_modulus=1.0, poisson_ratio=0.3, density=float("nan")), "Material.density is nan"),
        (lambda: Rectangle(thickness=0.0, width=1.0), "Rectangle.thickness is 0.0"),
        (lambda: General(area=1.0, Iy=1.0, Iz=1.0, J=-1.0), "General.J is -1.0"),
        (
            lambda: Taper(root=BAR, tip=General(area=1.0, Iy=1.0, Iz=1.0, J=1.0)),
            "Rectangle and General; they must be of the",
        ),
        (lambda: beam_form("ful", 1.0, BAR, MATERIAL), "formulation of a beam is 'ful'; it must be one of full"),
        (lambda: beam_form("full", 0.0, BAR, MATERIAL), "length of an element is 0.0; it must be above 0"),
        (lambda: cable_form(float("inf"), BAR, MATERIAL), "length of an element is inf"),
        (lambda: cable_bending(-1.0, BAR, MATERIAL), "length of an element is -1.0"),
        (
            lambda: beam_form("full", 1.0, General(area=1.0, Iy=1.0, Iz=1.0, J=1.0), MATERIAL),
            "formulations full and nu_split need a Rectangle",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(InputError, match=re.escape(message)):
        make()


def test_a_material_that_keeps_its_volume() -> None:
    """Beams and rods take a Poisson ratio of 0.5; a continuum is refused."""
    rubber = Material(young_modulus=1e6, poisson_ratio=0.5, density=1100.0)
    assert rubber.shear_modulus == pytest.approx(1e6 / 3.0)
    for formulation in FORMULATIONS:
        if formulation in ("full", "nu_split"):
            with pytest.raises(InputError, match=f"poisson_ratio is 0.5; formulation '{formulation}' .* below 0.5"):
                beam_form(formulation, LENGTH, BAR, rubber)
        else:
            assert np.all(np.isfinite(beam_form(formulation, LENGTH, BAR, rubber).H))
