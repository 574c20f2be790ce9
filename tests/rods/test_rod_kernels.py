"""Elements of rods: their forces and tangents against differences of the energy, strains in rigid motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import General, Material, Rectangle, SectionInertia, SectionStiffness, Taper, rods
from evolvent.equations import energy_momentum as flow, implicit
from evolvent.families.rods import rod, rod_strains
from evolvent.kernels.rigid import kinematics
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from implicit.rigs import forces, moved, step_tangents
from rods.building import RUBBER, STRIP

Array = np.ndarray
#: A section by its stiffness matrix, whose strains are all coupled, in place of one of a material.
COUPLED: dict[str, Any] = {
    "section": SectionStiffness(
        matrix=np.diag([8e4, 2e4, 3e4, 1.0, 1.3, 5.0])
        + np.fromfunction(
            lambda i, k: np.where(i == k, 0.0, (-1.0) ** (i + k) * np.where(i + k > 7, 0.1, 0.05)), (6, 6)
        )
        * np.sqrt(np.outer([8e4, 2e4, 3e4, 1.0, 1.3, 5.0], [8e4, 2e4, 3e4, 1.0, 1.3, 5.0]))
    ),
    "material": None,
    "inertia": SectionInertia(mass_per_length=0.8, inertia_y=3e-5, inertia_z=1e-4),
}
#: Tension resists twist, on a rod that is twisted and curved without stress.
TWISTED: dict[str, Any] = {"tension_twist": True}


def disturbed(seed: int = 1, size: float = 0.15, **keys: Any) -> tuple[Assembly, Array]:
    """A rod that is curved without stress, and a state far from its start."""
    system = System()
    common = {"length": 1.0, "section": STRIP, "material": RUBBER, "elements": 3, "curvature": (0.3, 0.2, -0.4)}
    system.add(parts.Rod(**(common | keys)), "rod")
    assembly = system.assemble()
    y, rng = assembly.y.copy(), np.random.default_rng(seed)
    n_q = int(assembly.model.info.nq)
    y[:n_q] += size * rng.standard_normal(n_q)
    return assembly, y


def energy(assembly: Assembly, y: Array) -> float:
    kinematics(0.0, y, assembly.model)
    out = np.zeros(3)
    rod.evaluate_rods(assembly.model, out)
    return float(out[1])


def by_differences(assembly: Assembly, y: Array, h: float = 1e-6) -> Array:
    """Tangent (nv, nv) by central differences of the forces."""
    columns = [
        (forces(assembly, moved(assembly, y, h * e)) - forces(assembly, moved(assembly, y, -h * e))) / (2.0 * h)
        for e in np.eye(int(assembly.model.info.nv))
    ]
    return np.array(columns).T


@pytest.mark.parametrize("keys", [{}, COUPLED, TWISTED])
def test_forces_are_the_gradient_of_the_energy(keys: dict[str, Any]) -> None:
    assembly, y = disturbed(**keys)
    n_v, h = int(assembly.model.info.nv), 1e-5
    found = forces(assembly, y)
    gradient = [
        (energy(assembly, moved(assembly, y, h * e)) - energy(assembly, moved(assembly, y, -h * e))) / (2.0 * h)
        for e in np.eye(n_v)
    ]
    assert found == pytest.approx(np.array(gradient), abs=1e-8 * np.abs(found).max())


@pytest.mark.parametrize("keys", [{}, COUPLED, TWISTED])
def test_tangent(keys: dict[str, Any]) -> None:
    assembly, y = disturbed(**keys)
    matrix = matrix_of(assembly.model)
    forces(assembly, y)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    assert K == pytest.approx(by_differences(assembly, y), abs=1e-8 * np.abs(K).max())


def test_tangent_of_damping() -> None:
    assembly, y = disturbed(size=0.02, stiffness_damping=0.1, mass_damping=3.0)
    model, h = assembly.model, 1e-4
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    found = []
    for c_rate in (0.0, 1.0):
        matrix = matrix_of(model)
        forces(assembly, y)
        implicit.tangent(0.0, y, np.zeros(0), 0.0, c_rate, 1.0, model, matrix)
        found.append(sparse_of(matrix).toarray())
    C = found[1] - found[0]
    by_rate = []
    for e in np.eye(n_v):
        ends = []
        for s in (1.0, -1.0):
            other = y.copy()
            other[n_q : n_q + n_v] += s * h * e
            ends.append(forces(assembly, other))
        by_rate.append((ends[0] - ends[1]) / (2.0 * h))
    assert C == pytest.approx(np.array(by_rate).T, abs=1e-6 * np.abs(C).max())
    assert np.linalg.eigvalsh(0.5 * (C + C.T)).min() > 0.0


@pytest.mark.parametrize("keys", [{}, TWISTED])
def test_tangent_of_the_energy_momentum_step(keys: dict[str, Any]) -> None:
    """Exact but for how the bodies' inertia and the strains' second derivatives change within a step."""
    system = System()
    system.add(
        parts.Rod(length=1.0, section=STRIP, material=RUBBER, elements=2, angular_velocity=(0.3, 0.5, 2.0),
                  curvature=(0.0, 0.0, 0.5), stiffness_damping=1e-3, mass_damping=0.2, **keys), "rod",
    )  # fmt: skip
    plan = energy_momentum.plan(system.assemble(), samples=[0.0, 1.0], step=0.02)
    model, step = plan.assembly.model, plan.workspace().step
    step.step.h, step.step.ratio = 0.02, 1.0
    flow.measure(0, model, step)
    rng = np.random.default_rng(0)
    before = model.rod_elements["before"]
    before[:] = 1e-3 * rng.standard_normal(before.shape)
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    start = 0.02 * step.y0[n_q : n_q + n_v] + 1e-3 * rng.standard_normal(n_v)

    found, wanted = step_tangents(plan, step, start)
    for rows in range(0, n_v, 3):
        for columns in range(0, n_v, 3):
            block = np.s_[rows : rows + 3, columns : columns + 3]
            allowed = 0.02 * max(np.abs(wanted[block]).max(), 1e-6 * np.abs(wanted).max())
            assert np.abs(found[block] - wanted[block]).max() < allowed, block


def test_strains_do_not_change_in_a_rigid_motion() -> None:
    assembly, y = disturbed()
    model, n_v, out = assembly.model, int(assembly.model.info.nv), np.zeros((2, rod_strains.MEASURES))
    kinematics(0.0, y, model)
    rod_strains.measure_element(1, model, out[0])
    turn, shift = rods.rotation(np.array([0.7, -1.9, 2.3])), np.array([3.0, -5.0, 2.0])
    for b in range(1, model.bodies.size):
        model.bodies["R"][b] = turn @ model.bodies["R"][b]
        model.bodies["x"][b] = turn @ model.bodies["x"][b] + shift
    rod_strains.measure_element(1, model, out[1])
    assert n_v == 24
    assert out[1] == pytest.approx(out[0], abs=1e-13)


def test_strains_of_a_helix_are_exact() -> None:
    """Whatever it turns by in an element, the strain of the curve through its ends is found; NumPy and kernel alike."""
    for turn in (1e-6, 0.01, 0.3, 1.0, 2.0):
        curvature = turn * np.array([0.6, -0.48, 0.64])
        x, R = rods.advanced(curvature, 1.0)
        found = rods.strains(np.array([np.zeros(3), x]), np.array([np.eye(3), R]), 1.0)[0]
        assert found == pytest.approx([1.0, 0.0, 0.0, *curvature], abs=2e-13)
    assembly, y = disturbed()
    kinematics(0.0, y, assembly.model)
    arms, model, out = assembly.parts["rod"].arms(), assembly.model, np.zeros(rod_strains.MEASURES)
    R = model.bodies["R"][1:]
    x = model.bodies["x"][1:] + np.einsum("nij,nj->ni", R, arms)
    for k in range(3):
        rod_strains.measure_element(k, model, out)
        rest = model.rod_elements["rest"][k]
        assert out[rod_strains.STRAIN :] + rest == pytest.approx(rods.strains(x, R, 1.0 / 3.0)[k], abs=1e-12)


def test_factors_of_the_angle() -> None:
    """The series joins the closed form, and the derivatives are those of the factors."""
    for c in (0.9, 0.9 - 1e-13, 0.9999, 1.0, 0.5, -0.4):
        angle = np.arccos(c)
        phi, psi = rod_strains.angle_factors(c)
        assert phi == pytest.approx(angle / np.sin(angle) if angle else 1.0, rel=1e-11)
        h = 1e-5
        for which in (0, 1):
            low, mid, high = (rod_strains.angle_factors(c + s * h)[which] for s in (-1.0, 0.0, 1.0))
            first, second = rod_strains.angle_slopes(c)[which], rod_strains.angle_slopes(c)[2 + which]
            assert first == pytest.approx((high - low) / (2.0 * h), rel=1e-7)
            assert second == pytest.approx((high - 2.0 * mid + low) / h**2, rel=1e-3, abs=1e-4)
        assert psi == pytest.approx((1.0 - phi) / (1.0 - c * c) if c < 0.99 else -1.0 / 6.0, rel=1e-3)
    assert np.isnan(rod_strains.angle_factors(-0.6)).all()


def test_compliance_of_elements() -> None:
    """Of a straight uniform one with the bending by linear moments; of a taper by quadrature; curved ones symmetric."""
    material, straight = Material(young_modulus=7e10, poisson_ratio=0.3, density=1.0), np.eye(6)[0]
    section = General(area=2.0, Iy=3.0, Iz=5.0, J=7.0)
    found, C = rods.element_stiffness(0.5, section, material, straight), rods.section_stiffness(section, material)
    wanted = 1.0 / np.diag(C)
    wanted[1] += 0.25 / 12.0 / C[5, 5]
    wanted[2] += 0.25 / 12.0 / C[4, 4]
    assert np.linalg.inv(found) == pytest.approx(np.diag(wanted), rel=1e-12, abs=1e-12 * wanted.max())
    taper = Taper(root=Rectangle(thickness=0.2, width=0.1), tip=Rectangle(thickness=0.1, width=0.1))
    mean = np.linalg.inv(rods.element_stiffness(1.0, taper, material, straight))[0, 0]
    assert mean == pytest.approx(np.log(2.0) / (7e10 * 0.1 * 0.1), rel=1e-5)  # int dx/(E w (0.2 - 0.1 x))
    curved = rods.element_stiffness(0.5, section, material, np.array([1.0, 0.0, 0.0, 0.2, -0.5, 0.9]))
    assert np.linalg.eigvalsh(curved).min() > 0.0
