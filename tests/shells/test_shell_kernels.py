"""Elements of shells: forces and tangents against differences of the energy, strains in rigid motions."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import rods
from evolvent.equations import energy_momentum as flow, implicit
from evolvent.families.shells import shell, shell_strains
from evolvent.kernels.rigid import kinematics
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from implicit.rigs import forces, moved, step_tangents
from shells.plates import material

Array = np.ndarray
#: A warped mesh of two elements.
WARPED = (
    ((0.0, 0.0, 0.0), (-0.1, 0.9, 0.1)),
    ((1.1, 0.1, 0.2), (1.0, 1.0, -0.1)),
    ((2.0, -0.1, 0.1), (2.2, 0.8, 0.3)),
)


def disturbed(size: float = 0.1, **keys: object) -> tuple[Assembly, Array]:
    """A warped shell, and a state far from its start."""
    system = System()
    common: dict = {"nodes": WARPED, "elements": (2, 1), "thickness": 0.5, "material": material(1e3, 0.3)}
    system.add(parts.Shell(**(common | {"drilling": 0.3} | keys)), "shell")
    assembly = system.assemble()
    y, n_q = assembly.y.copy(), int(assembly.model.info.nq)
    y[:n_q] += size * np.random.default_rng(1).standard_normal(n_q)
    return assembly, y


def energy(assembly: Assembly, y: Array) -> float:
    kinematics(0.0, y, assembly.model)
    out = np.zeros(3)
    shell.evaluate_shells(assembly.model, out)
    return float(out[1])


def differences(function, assembly: Assembly, y: Array, h: float) -> Array:
    """Derivatives by the velocities' coordinates, in rows."""
    unit = np.eye(int(assembly.model.info.nv))
    ends = [[function(assembly, moved(assembly, y, s * h * e)) for s in (1.0, -1.0)] for e in unit]
    return np.array([(high - low) / (2.0 * h) for high, low in ends])


@pytest.mark.parametrize("clamped", [(), ("x0",)])
def test_forces_and_tangent(clamped: tuple[str, ...]) -> None:
    assembly, y = disturbed(clamped=clamped)
    found = forces(assembly, y)
    assert found == pytest.approx(differences(energy, assembly, y, 1e-5), abs=1e-7 * np.abs(found).max())
    matrix = matrix_of(assembly.model)
    forces(assembly, y)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    assert K == pytest.approx(differences(forces, assembly, y, 1e-6).T, abs=1e-8 * np.abs(K).max())


def test_start_is_without_stress_and_six_motions_without_stiffness() -> None:
    assembly, _ = disturbed()
    assert np.abs(forces(assembly, assembly.y)).max() < 1e-11
    matrix = matrix_of(assembly.model)
    forces(assembly, assembly.y)
    implicit.tangent(0.0, assembly.y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    assert K == pytest.approx(K.T, abs=1e-12 * np.abs(K).max())
    found = np.linalg.eigvalsh(K)
    assert np.abs(found[:6]).max() < 1e-12 * found[-1] < 1e-9 * found[6]


def test_measures_do_not_change_in_a_rigid_motion() -> None:
    assembly, y = disturbed()
    model, out = assembly.model, np.zeros((2, shell_strains.MEASURES))
    kinematics(0.0, y, model)
    shell_strains.measure_element(1, model, out[0])
    turn = rods.rotation(np.array([0.7, -1.9, 2.3]))
    for b in range(1, model.bodies.size):
        model.bodies["R"][b] = turn @ model.bodies["R"][b]
        model.bodies["x"][b] = turn @ model.bodies["x"][b] + np.array([3.0, -5.0, 2.0])
    shell_strains.measure_element(1, model, out[1])
    assert out[1] == pytest.approx(out[0], abs=1e-13)


def test_slopes_make_changes_of_the_measures_exact() -> None:
    """Over a step of any size: G of the means times the change of the products is the change of the strains."""
    rng, m = np.random.default_rng(2), np.zeros((2, shell_strains.MEASURES))
    for one in m:
        shell_strains.measure_vectors(0.5 * rng.standard_normal((shell_strains.VECTORS, 3)), one)
    G, products = np.zeros((shell_strains.STRAINS, 20)), shell_strains.PRODUCTS
    shell_strains.slopes(m[0], m[1], G)
    change = m[1] - m[0]
    wanted = change[shell_strains.STRAIN : shell_strains.DRILLING]
    assert G @ change[:products] == pytest.approx(wanted, rel=1e-12, abs=1e-12)


def test_isometric_bending_leaves_no_membrane_strain() -> None:
    """A sheet bent to another radius of a cylinder, of a distorted element: strains of fourth order in its size."""
    flat = np.array([(-0.6, -0.4), (0.5, -0.55), (0.4, 0.6), (-0.5, 0.35)])
    worst = []
    for size in (0.4, 0.2, 0.1):
        strains = []
        for radius in (1.0, 1.25):
            turn = size * flat[:, 0] / radius
            x = np.stack([radius * np.sin(turn), size * flat[:, 1], radius * np.cos(turn)], axis=1)
            d = np.stack([np.sin(turn), 0.0 * turn, np.cos(turn)], axis=1)
            signs, out = np.array(shell_strains.SIGNS), np.zeros(shell_strains.MEASURES)
            shell_strains.measure_vectors(np.concatenate([signs[1:] @ x, signs @ d]) / 4.0, out)
            strains.append(out[shell_strains.STRAIN : shell_strains.STRAIN + 5])
        worst.append(np.abs(strains[1] - strains[0]).max() / size**2)
    assert worst[0] < 1e-3
    assert np.log2(worst[0] / worst[1]) == pytest.approx(4.0, abs=0.3)
    assert np.log2(worst[1] / worst[2]) == pytest.approx(4.0, abs=0.3)


def test_tangent_of_the_energy_momentum_step() -> None:
    """Exact but for how the bodies' inertia and the curved strains change within a step."""
    assembly, _ = disturbed()
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=0.02)
    model, step = plan.assembly.model, plan.workspace().step
    step.step.h, step.step.ratio = 0.02, 1.0
    flow.measure(0, model, step)
    rng = np.random.default_rng(0)
    before = model.shell_elements["before"]
    before[:] = 1e-3 * rng.standard_normal(before.shape)
    n_v = int(model.info.nv)
    start = 2e-2 * rng.standard_normal(n_v)

    found, wanted = step_tangents(plan, step, start)
    assert np.abs(found - wanted).max() < 5e-3 * np.abs(wanted).max()
