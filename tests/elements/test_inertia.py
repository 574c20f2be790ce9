"""Mass of elements against integrals over their points."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from elements.helpers import points, skew
from evolvent.elements import (
    General,
    Material,
    Rectangle,
    Taper,
    beam_mass,
    cable_mass,
    straight_beam,
)
from evolvent.kernels import ancf

LENGTH = 1.3
MATERIAL = Material(young_modulus=2.1, poisson_ratio=0.3, density=1.7)
BAR = Rectangle(thickness=0.4, width=0.7)
TAPER = Taper(root=BAR, tip=Rectangle(thickness=0.6, width=0.3))
SECTIONS = pytest.mark.parametrize("section", [BAR, TAPER], ids=["prismatic", "tapered"])


def shape(x: float, y: float, z: float) -> np.ndarray:
    S = np.zeros(8)
    ancf.beam_shape(LENGTH, x / LENGTH, y, z, S)
    return S


@SECTIONS
def test_masses_are_integrals_over_the_volume(section):
    wanted = np.zeros((8, 8))
    for x, wx in points(8, 0.0, LENGTH):
        here = section.at(x / LENGTH)
        for y, wy in points(2, -here.thickness / 2, here.thickness / 2):
            for z, wz in points(2, -here.width / 2, here.width / 2):
                wanted += MATERIAL.density * wx * wy * wz * np.outer(shape(x, y, z), shape(x, y, z))
    beam, cable = beam_mass(LENGTH, section, MATERIAL), cable_mass(LENGTH, section, MATERIAL)
    assert_allclose(beam, wanted, rtol=1e-12, atol=1e-15)
    # a cable's is that of the axis
    axis = np.ix_([0, 1, 4, 5], [0, 1, 4, 5])
    assert_allclose(cable, wanted[axis], rtol=1e-12, atol=1e-15)
    assert np.linalg.eigvalsh(beam).min() > 0.0
    assert np.linalg.eigvalsh(cable).min() > 0.0


def test_a_spinning_bar_has_the_energy_of_a_rigid_body():
    e, omega, v = straight_beam(LENGTH).reshape(8, 3), np.array([0.3, -0.5, 0.7]), np.array([0.2, 0.1, -0.4])
    u = e @ skew(omega).T
    u[[0, 4]] += v
    m, s = MATERIAL.density * BAR.thickness * BAR.width * LENGTH, BAR.properties(MATERIAL.nu)
    density = MATERIAL.density * LENGTH
    inertia = density * np.diag([s.Iy + s.Iz, s.Iy, s.Iz]) + m * LENGTH**2 / 12 * np.diag([0, 1, 1])
    centre = v + np.cross(omega, [LENGTH / 2, 0, 0])
    wanted = 0.5 * m * centre @ centre + 0.5 * omega @ inertia @ omega
    assert_allclose(ancf.kinetic_energy(beam_mass(LENGTH, BAR, MATERIAL), u.ravel()), wanted, rtol=1e-12)


@pytest.mark.parametrize("vectors", [8, 4])
def test_kinetic_energy_is_the_quadratic_form_of_the_mass_matrix(vectors, rng):
    M = beam_mass(LENGTH, BAR, MATERIAL) if vectors == 8 else cable_mass(LENGTH, BAR, MATERIAL)
    x = rng.normal(size=3 * vectors)
    assert_allclose(ancf.kinetic_energy(M, x), 0.5 * x @ np.kron(M, np.eye(3)) @ x, rtol=1e-12)


def test_general_sections_have_mass_too():
    s = BAR.properties(MATERIAL.nu)
    general = General(area=s.area, Iy=s.Iy, Iz=s.Iz, J=s.J)
    assert_allclose(beam_mass(LENGTH, general, MATERIAL), beam_mass(LENGTH, BAR, MATERIAL), rtol=1e-14)
