"""Rods whose section flattens: the law of the section, gradients and tangents, folds, balances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Arc, Lenticular, Material, TapeSection
from evolvent.elements.rods import quaternion
from evolvent.equations import implicit
from evolvent.families.rods import tape as kernel
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.work import sparse_of
from evolvent_base.errors import InputError
from rods.test_rod_kernels import energy, forces, moved

Array = np.ndarray
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
TAPE = TapeSection(radius=0.015, angle=math.pi / 2.0, thickness=1e-4)
CUBE = Material(young_modulus=131e9, poisson_ratio=0.3, density=8250.0)
LENS = Lenticular(radius=0.015, angle=math.pi / 2.0, thickness=1e-4)
CUBE_TAPE = TapeSection(radius=0.0133, angle=math.radians(106.0), thickness=1e-4)


def wuest(section: TapeSection, material: Material, k: Array | float) -> Array:
    """Moment of uniform bending in opposite sense, N m (Wuest 1954, Mansfield 1973)."""
    k, nu, t = np.asarray(k, dtype=float), material.nu, section.thickness
    s, k0 = section.radius * section.angle, 1.0 / section.radius
    D = material.E * t**3 / (12.0 * (1.0 - nu**2))
    L = (3.0 * (1.0 - nu**2)) ** 0.25 * s / np.sqrt(t / np.abs(k))
    F1 = 2.0 / L * (np.cosh(L) - np.cos(L)) / (np.sinh(L) + np.sin(L))
    F2 = F1 / 4.0 - np.sinh(L) * np.sin(L) / (np.sinh(L) + np.sin(L)) ** 2
    return s * D * (k + nu * k0 - nu * (k0 + nu * k) * F1 + (k0 + nu * k) ** 2 * F2 / k)


def disturbed(**keys: Any) -> tuple[Assembly, Array]:
    """A short rod in a state far from its start."""
    system = System()
    common = {"length": 0.06, "section": TAPE, "material": STEEL, "elements": 3}
    system.add(parts.Rod(**(common | keys)), "rod")
    assembly = system.assemble()
    y, rng, model = assembly.y.copy(), np.random.default_rng(3), assembly.model
    n_q = int(model.info.nq)
    scale = np.full(n_q, 0.05)
    scale[model.tape_nodes["iq"]] = 20.0
    for b in model.bodies[1:]:
        scale[b["iq"] : b["iq"] + 3] = 1e-4
    y[:n_q] += scale * rng.standard_normal(n_q)
    return assembly, y


def units(assembly: Assembly) -> Array:
    """Sizes of changes of the velocities' coordinates for differences."""
    n_v, model = int(assembly.model.info.nv), assembly.model
    found = np.full(n_v, 1e-6)
    found[model.tape_nodes["iv"] - int(model.info.nq)] = 1e-3
    return found


@pytest.mark.parametrize("closed", [0, 1])
@pytest.mark.parametrize("u", [1e-3, 1.0, 15.9, 16.1, 300.0, 4e5])
def test_profile_has_its_derivatives(u: float, closed: int) -> None:
    h = 1e-4 * u
    N, first, second = kernel.profile(u, closed)
    ends = [kernel.profile(u + s * h, closed) for s in (-1.0, 1.0)]
    assert 0.7 <= N < 1.0
    assert (ends[1][0] - ends[0][0]) / (2.0 * h) == pytest.approx(first, rel=1e-5, abs=1e-12 / h)
    assert (ends[1][1] - ends[0][1]) / (2.0 * h) == pytest.approx(second, rel=1e-5, abs=1e-14 / h)


@pytest.mark.parametrize("closed", [0, 1])
def test_series_meets_the_closed_form(closed: int) -> None:
    below, above = (kernel.profile(16.0 * (1.0 + s * 1e-12), closed) for s in (-1.0, 1.0))
    assert below == pytest.approx(above, rel=1e-7)


def shell(section: TapeSection, material: Material, x: float, nodes: int = 2001) -> float:
    """Energy per length, J/m, of two arcs on hinged edges in one plane: least over deflections at points."""
    s, t, D = section.radius * section.angle, section.thickness, material.E * section.thickness**3 / 12.0
    D /= 1.0 - material.nu**2
    h, n = s / (nodes - 1), nodes - 2
    second = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)).tocsc() / h**2
    rest = np.full(n, 1.0 / section.radius)
    w = splu((D * second.T @ second + material.E * t * x * x * sparse.identity(n)).tocsc()).solve(D * second.T @ rest)
    bent = second @ w - rest
    return float(h * (D * bent @ bent + material.E * t * x * x * w @ w) + s * D * x * x)


@pytest.mark.parametrize("x", [1.0, 20.0, 66.0])
def test_a_lenticular_section_has_the_energy_of_its_shells(x: float) -> None:
    own = LENS.flattening(STEEL)
    N, g = kernel.profile(own.slenderness * x * x, 1)[0], own.slenderness * own.stretching * x * x
    found = 0.5 * own.bending * (x * x + N * g / (N + g) * own.transverse**2)
    assert found == pytest.approx(shell(LENS, STEEL, x), rel=2e-5)


def test_properties_of_a_lenticular_section() -> None:
    """Of thin walls, by sums along them."""
    R, t, p = LENS.radius, LENS.thickness, 0.5 * LENS.angle
    angle = p * (np.arange(4000) + 0.5) / 4000.0
    y, z, ds = R * (np.cos(angle) - math.cos(p)), R * np.sin(angle), R * p / 4000.0
    found = LENS.properties(0.3)
    assert found.area == pytest.approx(4.0 * R * p * t)
    assert found.Iz == pytest.approx(4.0 * t * ds * (y @ y), rel=1e-6)
    assert found.Iy == pytest.approx(4.0 * t * ds * (z @ z), rel=1e-6)
    enclosed = 4.0 * float(y @ np.cos(angle)) * ds
    assert found.J == pytest.approx(4.0 * enclosed**2 * t / (4.0 * R * p), rel=1e-6)
    for moment, factor, Q in (
        (found.Iz, found.shear_y, np.cumsum(y)), (found.Iy, found.shear_z, np.cumsum(z[::-1])),
    ):  # fmt: skip
        flow = t * ds * Q
        assert factor == pytest.approx(moment**2 / (found.area * 4.0 * ds / t * (flow @ flow)), rel=2e-3)


@pytest.mark.parametrize("section", [TAPE, LENS])
def test_forces_are_the_gradient_of_the_energy(section: TapeSection) -> None:
    assembly, y = disturbed(section=section)
    h, found = units(assembly), forces(assembly, y)
    gradient = [
        (energy(assembly, moved(assembly, y, h[i] * e)) - energy(assembly, moved(assembly, y, -h[i] * e)))
        / (2.0 * h[i])
        for i, e in enumerate(np.eye(h.size))
    ]
    assert found * h == pytest.approx(np.array(gradient) * h, abs=1e-6 * np.abs(found * h).max())


@pytest.mark.parametrize("section", [TAPE, LENS])
def test_tangent(section: TapeSection) -> None:
    assembly, y = disturbed(section=section)
    h, matrix = units(assembly), matrix_of(assembly.model)
    forces(assembly, y)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    columns = [
        (forces(assembly, moved(assembly, y, h[i] * e)) - forces(assembly, moved(assembly, y, -h[i] * e)))
        / (2.0 * h[i])
        for i, e in enumerate(np.eye(h.size))
    ]
    scaled = K * h * h[:, None]
    assert scaled == pytest.approx(np.array(columns).T * h * h[:, None], abs=1e-6 * np.abs(scaled).max())
    own = assembly.model.tape_nodes["iv"] - int(assembly.model.info.nq)
    assert K[:, own] == pytest.approx(np.array(columns)[own].T, rel=1e-5, abs=1e-7 * np.abs(K[:, own]).max())
    assert K[own] == pytest.approx(np.array(columns).T[own], rel=1e-5, abs=1e-7 * np.abs(K[own]).max())


def bent(section: TapeSection, material: Material, moment: float) -> Assembly:
    """An element clamped at its root, with a moment at its tip."""
    system = System()
    system.add(parts.Rod(length=0.02, section=section, material=material, elements=1), "tape")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="tape.root", type="clamp"), "clamp")
    system.add(parts.Load(at="tape.tip", torque=(0.0, 0.0, moment)), "moment")
    return system.assemble()


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("section", "material", "peak"), [(TAPE, STEEL, 0.37911), (CUBE_TAPE, CUBE, 0.34181)])
def test_uniform_bending_follows_wuest(section: TapeSection, material: Material, peak: float, sense: float) -> None:
    """Along the arc, over the peak in opposite sense."""
    assembly = bent(section, material, 0.6 * sense)
    found = solve_static(assembly, arc_length=True, load_steps=50, most_steps=700)
    assert found.path is not None
    q = int(assembly.model.bodies["iq"][-1])
    k = 2.0 * np.arctan2(found.y[1:, q + 6], found.y[1:, q + 3]) / 0.02
    M = 0.6 * sense * np.asarray(found.path.factor)[1:]
    assert M == pytest.approx(wuest(section, material, k), abs=1e-9)
    assert np.abs(k).max() > 0.75
    if sense > 0.0:
        assert M.max() == pytest.approx(peak, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("first", [2, 20])
def test_an_arc_begins_with_rising_load(first: int) -> None:
    found = solve_static(bent(TAPE, STEEL, 0.6), arc_length=True, load_steps=first, most_steps=3)
    assert found.path is not None
    assert np.all(np.diff(np.asarray(found.path.factor)) > 0.0)


def test_initial_stiffness() -> None:
    for section, material, wanted in ((TAPE, STEEL, 0.94137), (CUBE_TAPE, CUBE, 0.92770)):
        assert wuest(section, material, 0.01) / 0.01 == pytest.approx(wanted, rel=1e-3)


def folded(sense: float) -> System:
    """A tape with a fold of a right angle that carries a panel."""
    system = System()
    rod = parts.Rod(
        length=0.1, section=TAPE, material=STEEL, elements=16, stiffness_damping=1e-4,
        folds=({"at": 0.05, "angle": sense * math.pi / 2.0},),
    )  # fmt: skip
    x, R = rod.start_nodes()
    system.add(rod, "tape")
    system.add(
        parts.RigidBody(
            mass=0.5, inertia=(1e-3, 5e-3, 5e-3), position=tuple(x[-1] + R[-1] @ np.array([0.15, 0.0, 0.0])),
            orientation=tuple(quaternion(R[-1])), points={"edge": (-0.15, 0.0, 0.0)},
        ), "panel",
    )  # fmt: skip
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="tape.root", type="clamp"), "root")
    system.add(parts.Joint(a="tape.tip", b="panel.edge", type="clamp"), "mount")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("step", [4e-4, 1e-3])
def test_a_folded_hinge_deploys_with_a_closed_balance(sense: float, step: float) -> None:
    """The fold pushes with about its propagation moment, in both senses."""
    found: Any = folded(sense).simulate(until=0.4, every=0.01, method="energy-momentum", step=step, spectral_radius=1.0)
    moved = float(found["energy_elastic"].values[0])
    assert np.abs(found["energy_defect"].values).max() < 1e-10 * moved
    D = STEEL.E * TAPE.thickness**3 / (12.0 * (1.0 - STEEL.nu**2))
    least = (1.0 + sense * STEEL.nu) * D * TAPE.angle
    moment = found["tape"]["bending_moment_z"].values[10:, 6:10].mean(axis=1)
    assert np.mean(moment) == pytest.approx(sense * least, rel=0.1)
    flat = found["tape"]["transverse_curvature"].values[-1]
    assert flat[8] < 0.05 / TAPE.radius
    assert flat[0] > 0.8 / TAPE.radius


STRAIGHT: dict[str, Any] = {"length": 0.1, "section": TAPE, "material": STEEL, "elements": 4}
ARC = Arc(radius=0.015, angle=1.5, thickness=1e-4)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"curvature": (0.0, 0.0, 1.0)}, "curved without stress"),
        ({"folds": ({"at": 0.01, "angle": 3.0},)}, "behind the fold"),
        ({"folds": ({"at": 0.05, "angle": 0.0},)}, r"folds\[0\].angle is 0; it must not be 0"),
        ({"section": ARC, "folds": ({"at": 0.05, "angle": 1.0},)}, "only a section that is a tape has a radius"),
        ({"material": STEEL.model_copy(update={"shear": 8e10})}, "isotropic"),
    ],
)
def test_refusals(keys: dict[str, Any], message: str) -> None:
    system = System()
    system.add(parts.Rod(**(STRAIGHT | keys)), "rod")
    with pytest.raises(InputError, match=message):
        system.assemble()


@pytest.mark.parametrize("angle", [0.0, 3.0])
def test_an_arc_too_flat_or_too_deep_is_refused(angle: float) -> None:
    with pytest.raises(InputError, match=f"angle is {math.degrees(angle):.6g} deg; it must be from 5.73 to 135 deg"):
        TapeSection(radius=0.015, angle=angle, thickness=1e-4)
