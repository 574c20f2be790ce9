"""Sections by their stiffness matrix: couplings against closed forms, axes, energy of motions, what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import yaml

import evolvent as ev
from evolvent import InputError, System, parts
from evolvent.elements import rods
from evolvent.solvers.static.static import solve_static
from rods.building import RUBBER, STRIP, cantilever, tip

Array = np.ndarray
#: Mass per length and moments of the strips.
MASS = ev.SectionInertia(mass_per_length=0.08, inertia_y=2e-8, inertia_z=6e-6)


def coupled() -> Array:
    """A full matrix: that of a strip, with every pair of strains coupled by up to a fifth."""
    scale = np.sqrt(np.array([4e4, 2e3, 3e3, 0.4, 0.5, 30.0]))
    unit = np.random.default_rng(3).uniform(-0.2, 0.2, (6, 6))
    unit = 0.5 * (unit + unit.T)
    np.fill_diagonal(unit, 1.0)
    return np.asarray(np.outer(scale, scale) * unit)


def strip(load: Any = None, matrix: Array | None = None, **keys: Any) -> System:
    section = ev.SectionStiffness(matrix=coupled() if matrix is None else matrix)
    return cantilever(load, **({"section": section, "material": None, "inertia": MASS} | keys))


def turn_of_tip(assembly: Any, y: Array) -> Array:
    """Quaternion of the last node."""
    q = int(assembly.model.bodies["iq"][-1]) + 3
    return np.asarray(y[q : q + 4])


def linear_tip(C: Array, force: Array, moment: Array) -> tuple[Array, Array]:
    """Small displacement and rotation of the tip of a cantilever of 1 m along x by Gauss's rule.

    The section at x has the force F and the moment M + (1 - x) e_x x F; rotations are the integrals of K, displacements
    those of Gamma + rotation x e_x.
    """
    S, e = np.linalg.inv(C), np.array([1.0, 0.0, 0.0])
    x, w = np.polynomial.legendre.leggauss(8)
    turned, moved = np.zeros(3), np.zeros(3)
    for at, weight in zip(0.5 + 0.5 * x, 0.5 * w, strict=True):
        strain = S @ np.concatenate([force, moment + (1.0 - at) * np.cross(e, force)])
        turned += weight * strain[3:]
        moved += weight * (strain[:3] + (1.0 - at) * np.cross(strain[3:], e))
    return moved, turned


@pytest.mark.parametrize("elements", [1, 4])
@pytest.mark.parametrize("k", range(6))
def test_small_deflections_by_every_load(k: int, elements: int) -> None:
    """Displacement and rotation of the tip by every force and moment, all strains coupled; exact at nodes."""
    load = np.zeros(6)
    load[k] = 1e-6
    part = (
        parts.Load(at="rod.tip", force=tuple(load[:3])) if k < 3 else parts.Load(at="rod.tip", torque=tuple(load[3:]))
    )
    assembly = strip(part, elements=elements).assemble()
    found = solve_static(assembly)
    assert found.success, found.message
    moved, turned = linear_tip(coupled(), load[:3], load[3:])
    size = np.abs(np.linalg.inv(coupled())).max() * 1e-6
    assert tip(assembly, found.y[-1]) - np.array([1.0, 0.0, 0.0]) == pytest.approx(moved, abs=1e-5 * size)
    assert 2.0 * turn_of_tip(assembly, found.y[-1])[1:] == pytest.approx(turned, abs=1e-5 * size)


def test_bending_twists_a_coupled_strip() -> None:
    """By a moment about y the tip twists by S_45 M L, S the inverse of the matrix."""
    C = np.diag([4e6, 2.6e5, 5.5e5, 0.368, 0.522, 298.0])
    C[3, 4] = C[4, 3] = -0.102
    assembly = strip(parts.Load(at="rod.tip", torque=(0.0, 1e-6, 0.0)), C, elements=3).assemble()
    S = 0.102 / (0.368 * 0.522 - 0.102**2)
    assert 2.0 * turn_of_tip(assembly, solve_static(assembly).y[-1])[1] == pytest.approx(S * 1e-6, rel=1e-6)


@pytest.mark.slow
def test_a_pull_twists_by_any_angle() -> None:
    """Extension and twist coupled: by a force F along the rod the strains are S F all along, at any twist."""
    C = np.diag([4e4, 2e3, 3e3, 0.4, 0.5, 30.0])
    C[0, 3] = C[3, 0] = -60.0
    S, F = np.linalg.inv(C), 500.0
    assembly = strip(parts.Load(at="rod.tip", force=(F, 0.0, 0.0)), C, elements=4).assemble()
    found = solve_static(assembly)
    assert found.success, found.message
    q = turn_of_tip(assembly, found.y[-1])
    twist = S[3, 0] * F
    assert 2.0 < twist < 3.0
    assert 2.0 * math.atan2(q[1], q[0]) == pytest.approx(twist, rel=1e-9)
    assert tip(assembly, found.y[-1]) == pytest.approx((1.0 + S[0, 0] * F, 0.0, 0.0), abs=1e-9)


def test_results_hold_the_constitutive_law() -> None:
    """Forces and moments of the elements are the matrix times their strains."""
    run = strip(parts.Load(at="rod.tip", force=(0.0, 0.03, -0.2)), elements=4).equilibrium()["rod"]
    strains = [run[key].values[-1] for key in
               ("strain", "shear_strain_y", "shear_strain_z", "twist", "curvature_y", "curvature_z")]  # fmt: skip
    forces = [run[key].values[-1] for key in
              ("axial_force", "shear_force_y", "shear_force_z", "torsional_moment", "bending_moment_y",
               "bending_moment_z")]  # fmt: skip
    assert coupled() @ np.array(strains) == pytest.approx(np.array(forces), abs=1e-9 * np.abs(forces).max())


@pytest.mark.parametrize("angle", [0.3, 1.2, -2.0])
def test_axes_of_the_section_do_not_matter(angle: float) -> None:
    """Axes y and z turned, and the matrix written in the turned axes: the same shape, at large deflection."""
    load = parts.Load(at="rod.tip", force=(0.0, 0.4, -0.9))
    found = []
    c, s = math.cos(angle), math.sin(angle)
    T = np.kron(np.eye(2), np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]))
    for normal, C in (((0.0, 1.0, 0.0), coupled()), ((0.0, c, s), T.T @ coupled() @ T)):
        assembly = strip(load, 0.5 * (C + C.T), normal=normal, elements=6).assemble()
        solved = solve_static(assembly)
        assert solved.success, solved.message
        found.append(tip(assembly, solved.y[-1]))
    assert np.linalg.norm(found[0] - (1.0, 0.0, 0.0)) > 0.3
    assert found[0] == pytest.approx(found[1], abs=1e-7)


def test_a_matrix_of_a_plain_section_is_that_section() -> None:
    """Element by element, and with the mass of its material."""
    s = STRIP.properties(0.3)
    mass = ev.SectionInertia(
        mass_per_length=RUBBER.density * s.area, inertia_y=RUBBER.density * s.Iy, inertia_z=RUBBER.density * s.Iz
    )
    plain = cantilever().assemble().model
    given = strip(matrix=rods.section_stiffness(STRIP, RUBBER), inertia=mass).assemble().model
    for name in ("stiffness", "section", "rest"):
        np.testing.assert_array_equal(given.rod_elements[name], plain.rod_elements[name])
    for name in ("mass", "inertia"):
        np.testing.assert_allclose(given.bodies[name], plain.bodies[name], rtol=1e-14, atol=1e-20)


@pytest.mark.slow
def test_energy_of_a_swing() -> None:
    """A coupled strip falls under its weight: its energy stays, and three methods find the same motion."""
    system = System(gravity=(0.0, 0.0, -9.81))
    section = ev.SectionStiffness(matrix=coupled())
    system.add(parts.Rod(length=1.0, section=section, inertia=MASS, elements=4), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"), "clamp")
    implicit: dict[str, Any] = {"step": 5e-4, "spectral_radius": 1.0}
    ends = []
    for method, keys, allowed in (
        ("energy-momentum", implicit, 1e-10),
        ("generalized-alpha", implicit, 1e-5),
        ("rk4", {}, 1e-8),
    ):
        run = system.simulate(until=0.5, every=0.01, method=method, **keys)
        moved = float(run.energy_moved[-1])
        assert moved > 0.1
        assert np.abs(run.energy_defect.values).max() < allowed * moved, method
        ends.append(run["rod"].tip_position.values[-1])
    assert abs(ends[0][2]) > 0.2
    assert ends[0] == pytest.approx(ends[2], abs=1e-5)
    assert ends[1] == pytest.approx(ends[2], abs=1e-5)


@pytest.mark.parametrize(
    ("matrix", "sentence"),
    [
        ([1.0, 1.0, 1.0], "rod.section.stiffness.matrix is [1.0, 1.0, 1.0]; it must be a stiffness matrix: 6 rows of 6 "
                          "values, or the 6 on its diagonal, in N|N m, N m|N m^2; it has 3 values"),
        (np.eye(3).tolist(), "it has 3 x 3"),
        ([[*row[:5]] for row in np.eye(6).tolist()], "it has 6 x 5"),
        (np.diag([1.0, 1.0, -2.0, 1.0, 1.0, 1.0]).tolist(), "its entry (3, 3) is -2; it must be above 0"),
        (["1 N", 1, 1, "1 N m", 1, 1], "its entry (4, 4) is '1 N m'; it must be a stiffness, such as '0.7 N m^2'"),
        ([1.0, 1.0, 1.0, 1.0, 1.0, math.nan], "its entry (6, 6) is nan"),
        ((np.eye(6) + 0.1 * np.eye(6, k=3)).tolist(), "(1, 4) and (4, 1) are 0.1 and 0; it must be symmetric"),
        ((np.eye(6) + 1.1 * (np.eye(6, k=3) + np.eye(6, k=-3))).tolist(), "its least eigenvalue is -0.1"),
    ],
)  # fmt: skip
def test_what_is_no_stiffness_is_refused(matrix: Any, sentence: str) -> None:
    case = {"parts": {"rod": {"kind": "rod", "length": 1.0, "section": {"stiffness": matrix}, "elements": 2}}}
    with pytest.raises(InputError) as error:
        ev.load(case)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_what_does_not_fit_a_matrix_is_refused() -> None:
    with pytest.raises(InputError, match=r"rod\.material is given beside a section by its stiffness matrix"):
        strip(material=RUBBER).assemble()
    with pytest.raises(InputError, match=r"rod\.inertia is missing; a section by its stiffness matrix needs mass_per_"):
        strip(inertia=None).assemble()
    with pytest.raises(InputError, match=r"rod\.inertia\.inertia_z is missing; a section that is given by its stiff"):
        strip(inertia=ev.SectionInertia(mass_per_length=1.0, inertia_y=1.0)).assemble()
    with pytest.raises(InputError, match=r"rod\.material is missing"):
        cantilever(material=None).assemble()
    with pytest.raises(InputError, match=r"load\.part is 'rod', whose section is given by its stiffness matrix"):
        strip(parts.ThermalLoad(part="rod", temperature={"constant": 10.0})).assemble()
    section = ev.SectionStiffness(matrix=coupled())
    with pytest.raises(InputError, match=r"Beam\.section.*a mapping with one of the keys angle, arc, circle"):
        parts.Beam(length=1.0, section=section, material=RUBBER, elements=2)


def test_a_file_holds_a_matrix() -> None:
    """Written and read again it is the same; entries may have units, and a diagonal is enough."""
    system = strip()
    again = ev.load(yaml.safe_load(system.to_yaml(until="1 s")))
    np.testing.assert_array_equal(
        again.assemble().model.rod_elements["stiffness"], system.assemble().model.rod_elements["stiffness"]
    )
    diagonal = ev.SectionStiffness(matrix=["3.7 MN", "0.26 MN", 2.9e5, "183 N mm m", 0.707, "276 N m^2"])
    assert np.array(diagonal.matrix) == pytest.approx(np.diag([3.7e6, 2.6e5, 2.9e5, 0.183, 0.707, 276.0]))
    assert diagonal == ev.SectionStiffness(matrix=np.array(diagonal.matrix))
