"""Shells of viscoelastic walls and plies: relaxation, creep, storage, balance of energy, tangents."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.equations import implicit
from evolvent.families.shells import stiffness
from evolvent.families.shells.family import kept_strains
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.storage import store
from evolvent.solvers.static.work import sparse_of
from evolvent_base.errors import InputError
from implicit.rigs import forces
from shells.plates import loaded
from shells.test_shell_kernels import WARPED, differences, disturbed

Array = np.ndarray
CHAPTER = "Relaxation and storage"
LAW: Any = {"prony": [(0.35, 1.0), (0.25, 20.0)]}
#: Of the closed forms of creep: E_inf = 0.4, E_1 = 0.6, tau = 1 s.
ONE: Any = {"prony": [(0.6, 1.0)]}
SHIFT: Any = {"arrhenius": {"energy": "80 kJ/mol", "reference": "20 degC"}}
#: A ply whose matrix creeps, and fibres of the same sizes that do not.
CREEPING = Material(
    young_modulus=8e9, young_modulus_2=6e9, poisson_ratio=0.3, shear=2e9, shear_23=1.5e9, density=1200.0,
    viscoelastic={"prony": [(0.3, "1 h"), (0.2, "30 days")], "shift": SHIFT},
)  # fmt: skip
STIFF = Material(young_modulus=120e9, young_modulus_2=8e9, poisson_ratio=0.3, shear=5e9, density=1600.0)
OTHER = STIFF.replaced(viscoelastic={"prony": [(0.1, "1 day")]})


def left(t: Any, prony: Any) -> Array:
    """Share of the instantaneous stiffness that is left after a hold."""
    return np.asarray(1.0 - sum(share * (1.0 - np.exp(-np.asarray(t) / time)) for share, time in prony))


def material(E: float = 1e9, nu: float = 0.0, law: Any = LAW) -> Material:
    return Material(young_modulus=E, poisson_ratio=nu, density=1000.0, viscoelastic=law)


def bent(
    curvature: float, elements: tuple[int, int], clamped: tuple[str, ...], stretch: float = 1.0, **keys: Any
) -> parts.Shell:
    """A strip of 0.5 x 0.1 m that starts on a cylinder about axis 2."""
    s, y = np.linspace(0.0, 0.5 * stretch, elements[0] + 1), np.linspace(0.0, 0.1, elements[1] + 1)
    angle, across = np.repeat(curvature * s, y.size), np.tile(y, s.size)
    x = np.stack([np.sin(angle) / curvature, across, (1.0 - np.cos(angle)) / curvature], axis=1)
    normals = np.stack([-np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    return parts.Shell(
        size=(0.5, 0.1), elements=elements, clamped=clamped, start=x.tolist(), start_normals=normals.tolist(), **keys
    )


def system_of(shell: parts.Shell) -> System:
    system = System()
    system.add(shell, "shell")
    return system


@pytest.mark.parametrize("as_matrix", [False, True])
def test_a_strip_held_at_a_curvature_relaxes(as_matrix: bool, book: Book) -> None:
    """Homogeneous, and by a matrix with the same law: moments, and the curvature that is kept."""
    keys: Any = {"thickness": 1e-3, "material": material()}
    shell = bent(2.0, (6, 1), ("x0", "x1"), **keys)
    if as_matrix:
        wall = {"matrix": shell.wall().stiffness, "mass_per_area": 1.0, "viscoelastic": LAW}
        shell = bent(2.0, (6, 1), ("x0", "x1"), section={"stiffness": wall})
    system = system_of(shell)
    system.sections["store"] = {"time": "7 s"}
    found = system.storage()
    run = found.run
    moment = run["shell"]["moment_1"].values
    assert moment[0] == pytest.approx(-2.0 * 1e9 * 1e-9 / 12.0, rel=2e-4)
    name = "by its matrix" if as_matrix else "homogeneous"
    book(
        CHAPTER, f"Shell bent and held for 7 tau ({name}): moment", reference="E(t) of its Prony series",
        source="closed form", error=np.abs(moment / moment[0] - left(run["time"].values, LAW["prony"])[:, None]).max(),
        allowed=1e-9,
    )  # fmt: skip
    kept = {words: value for _, words, value, _ in found.sets}
    assert kept["largest curvature along axis 1"] == pytest.approx(-2.0 * (1.0 - left(7.0, LAW["prony"])), rel=2e-4)
    assert {"moment_1", "principal_moment"} <= {one.name for one in found.forces}


def _hand(angles: Any, plies: Any, h: float) -> Array:
    """Stiffness (6, 6) of plies of the thickness h in plane stress, by tensors turned with a matrix (3, 3)."""
    C, z = np.zeros((6, 6)), -0.5 * h * len(angles)
    for angle, ply in zip(angles, plies, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        if ply is not None:
            S = np.diag([1.0 / ply.E, 1.0 / ply.young_modulus_2, 1.0 / ply.shear_modulus])
            S[0, 1] = S[1, 0] = -ply.nu / ply.E
            T = np.array([[c * c, s * s, -2 * c * s], [s * s, c * c, 2 * c * s], [c * s, -c * s, c * c - s * s]])
            Q = T @ np.linalg.inv(S) @ T.T
            for i in range(2):
                for j in range(2):
                    n = i + j + 1
                    C[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += Q * ((z + h) ** n - z**n) / n
        z += h
    return C


def test_plies_that_relax_beside_others_that_do_not(book: Book) -> None:
    """Every node held, stretched and bent, at 40 degC: forces and moments of three plies of three laws."""
    angles, plies, h = (0.0, math.pi / 2.0, math.pi / 6.0), (STIFF, CREEPING, OTHER), 0.4e-3
    strong = CREEPING.replaced(tensile_strength=1e8)
    section: Any = {
        "laminate": [
            {"material": ply, "thickness": h, "angle": angle}
            for ply, angle in zip((STIFF, strong, OTHER), angles, strict=True)
        ]
    }
    shell = bent(0.5, (2, 1), ("x0", "x1", "y0", "y1"), stretch=1.001, section=section)
    system = system_of(shell)
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "free")  # a structure has something that moves
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b="free", type="spherical"), "held")
    T, hold = 313.15, 5 * 86_400.0
    system.sections["store"] = {"time": hold, "temperature": T}
    run = system.storage().run
    names = ("membrane_force_1", "membrane_force_2", "membrane_shear", "moment_1", "moment_2", "twisting_moment")
    F = np.stack([run["shell"][name].values[:, 0] for name in names], axis=1)
    whole = _hand(angles, plies, h)
    strain = np.linalg.solve(whole, F[0])
    assert strain == pytest.approx([1e-3, 0.0, 0.0, -0.5, 0.0, 0.0], abs=2e-3)
    creeping, other = _hand(angles, (None, CREEPING, None), h), _hand(angles, (None, None, OTHER), h)
    assert CREEPING.viscoelastic is not None
    a = CREEPING.viscoelastic.factor(T, "T")
    lost = (
        creeping * (1.0 - left(hold, [(0.3, a * 3600.0), (0.2, a * 30 * 86_400.0)]))
        + other * (1.0 - left(hold, [(0.1, 86_400.0)]))
    )  # fmt: skip
    wanted = (whole - lost) @ strain
    book(
        CHAPTER, "Laminate [0/90/30] of an elastic ply and two that relax, held for 5 days at 40 degC",
        reference="sum over the plies", source="theory of laminates by hand",
        error=np.max(np.abs(F[-1] / wanted - 1.0)), allowed=1e-9,
    )  # fmt: skip
    assert run["shell"]["curvature_1"].values[:, 0] == pytest.approx(strain[3], rel=1e-9)
    index = run["shell"]["failure_index"].values[:, 0]
    share = left(hold, [(0.3, a * 3600.0), (0.2, a * 30 * 86_400.0)])
    assert index[-1] / index[0] == pytest.approx(share, rel=1e-9)
    del system.sections["store"]
    kept = kept_strains(store(system.assemble(), hold, T).assembly.model, 0)
    assert kept[:, :6] == pytest.approx(np.tile(np.linalg.solve(whole, lost @ strain), (2, 1)), rel=1e-8, abs=1e-12)


def test_a_plate_in_biaxial_strain_and_shear_relaxes() -> None:
    """A distorted mesh: all forces are those of the strain, and fall by the series."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 3), indexing="ij")
    nodes = np.stack([u, v, 0.0 * u], axis=-1)
    nodes[1, 1] += [0.1, -0.07, 0.0]
    F = np.array([[1.01, 0.004, 0.0], [0.002, 0.995, 0.0], [0.0, 0.0, 1.0]])
    E = 0.5 * (F.T @ F - np.eye(3))
    keys: Any = {"nodes": nodes.tolist(), "start": (nodes @ F.T).tolist(), "elements": (2, 2), "thickness": 0.02}
    system = system_of(
        parts.Shell(material=material(nu=0.25), clamped=("x0", "x1", "y0", "y1"), direction=(1, 0, 0), **keys)
    )
    system.sections["store"] = {"time": "3 s"}
    run = system.storage().run
    A = 1e9 * 0.02 / (1.0 - 0.25**2)
    wanted = A * np.array([E[0, 0] + 0.25 * E[1, 1], E[1, 1] + 0.25 * E[0, 0], 0.75 * E[0, 1]])
    names = ("membrane_force_1", "membrane_force_2", "membrane_shear")
    for name, force in zip(names, wanted, strict=True):
        values = run["shell"][name].values
        assert values[0] == pytest.approx(force, rel=1e-6)
        assert values[-1] == pytest.approx(force * left(3.0, LAW["prony"]), rel=1e-6)


def test_creep_under_a_constant_moment(book: Book) -> None:
    """A cantilever turns by M L/(E I) times the creep compliance."""
    M, L = 0.02, 0.5
    shell = parts.Shell(size=(L, 0.1), elements=(6, 1), thickness=1e-3, material=material(law=ONE), clamped=("x0",))
    found = store(loaded(shell, "x1", torque=(0.0, M, 0.0)).assemble(), 8.0)
    body = int(found.assembly.model.shells[0]["first_body"]) + int(shell.edge("x1")[0])
    q = int(found.assembly.model.bodies["iq"][body])
    turned = 2.0 * np.arctan2(found.solution.y[:, q + 5], found.solution.y[:, q + 3])
    exact = M * L / (1e9 * 1e-9 / 12.0) * (1.0 - 0.6 * np.exp(-0.4 * found.times)) / 0.4
    assert turned[-1] > 0.25
    assert turned[0] == pytest.approx(exact[0], rel=1e-5)
    book(
        CHAPTER, "Shell under a constant moment for 8 relaxation times: creep", source="closed form",
        reference="(1 - 0.6 exp(-0.4 t/tau))/0.4", error=np.max(np.abs(turned / exact - 1.0)), allowed=1e-5,
    )  # fmt: skip


def test_storage_of_a_strip_is_that_of_a_rod() -> None:
    """Strips under their tips' loads, far beyond small deflections: both creep to the same place."""
    load, law, n = 0.03, ONE, 16
    shell = parts.Shell(size=(0.5, 0.1), elements=(n, 1), thickness=1e-3, material=material(law=law), clamped=("x0",))
    rods = System()
    section = Rectangle(width=0.1, thickness=1e-3)
    rods.add(parts.Rod(length=0.5, elements=n, section=section, material=material(law=law)), "rod")
    rods.add(parts.Joint(a="ground", b="rod.root", type="clamp"), "root")
    rods.add(parts.Load(at="rod.tip", force=(0.0, load, 0.0)), "load")
    rods.sections["store"] = {"time": "2 s"}
    bending = rods.storage().run["rod"]["position"].values[:, -1, 1]
    system = loaded(shell, "x1", force=(0.0, 0.0, load / 0.1))
    system.sections["store"] = {"time": "2 s"}
    x = system.storage().run["shell"]["position"].values[:, -1, 2]
    assert x[0] > 0.1
    assert x[-1] > 1.5 * x[0]
    assert (x[0], x[-1]) == pytest.approx((bending[0], bending[-1]), rel=2e-3)


def test_a_coiled_tape_spring_relaxes_alike_everywhere(book: Book) -> None:
    """A tape that is coiled to its own radius and held for years: stresses fall by E(t), whatever they are."""
    R, half, L, n = 0.015, math.pi / 6.0, 0.03, (8, 4)
    law = {"prony": [(0.2, "1 day"), (0.15, "1 year")]}
    s, w = np.linspace(0.0, L, n[0] + 1), np.linspace(-half * R, half * R, n[1] + 1)
    angle, across = np.repeat(s / R, w.size), np.tile(w, s.size)
    start = np.stack([R * np.sin(angle), across, R * (1.0 - np.cos(angle))], axis=1)
    normals = np.stack([-np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    shell = parts.Shell(
        formula=[f"{L}*u", "R*sin(A*(v - 0.5))", "R*cos(A*(v - 0.5))"], constants={"R": R, "A": 2.0 * half},
        elements=n, thickness=1e-4, material=material(E=20e9, nu=0.3, law=law), clamped=("x0", "x1"),
        start=start.tolist(), start_normals=normals.tolist(),
    )  # fmt: skip
    system = system_of(shell)
    system.sections["store"] = {"time": "10 years"}
    found = system.storage()
    moments = found.run["shell"]["principal_moment"].values
    assert found.steps < 60
    factor = float(left(10 * 365.25 * 86_400.0, [(0.2, 86_400.0), (0.15, 365.25 * 86_400.0)]))
    size = np.abs(moments[0]).max()
    book(
        CHAPTER,
        "Tape spring as a shell, coiled to its own radius for ten years: moments",
        reference="E(t)",
        source="closed form",
        error=np.abs(moments[-1] - factor * moments[0]).max() / size,
        allowed=1e-5,
    )  # fmt: skip  (springs of drilling do not relax)
    elastic = found.run["energy_elastic"].values
    shares = sum(g * math.exp(-2.0 * 10 * 365.25 * 86_400.0 / t) for g, t in [(0.2, 86_400.0), (0.15, 3.15576e7)])
    assert elastic[-1] / elastic[0] == pytest.approx(0.65 + shares, rel=1e-5)


def released() -> System:
    """A bent laminate strip whose tip is let go after a storage."""
    section: Any = {
        "laminate": [
            {"material": material(nu=0.3), "thickness": "1 mm"},
            {"material": material(E=3e9, nu=0.3, law={"prony": [(0.4, 0.02)]}), "thickness": "0.5 mm"},
        ]
    }
    shell = bent(1.0, (4, 1), ("x0",), section=section)
    system = system_of(shell)
    x, _ = shell.start_nodes()
    for node in shell.edge("x1"):
        clamp = parts.Joint(a=tuple(x[node]), b=f"shell[{node}]", type="clamp", until=2e-3)
        system.add(clamp, f"hold {node}")
    system.sections["store"] = {"time": "10 s"}
    return system


def test_the_balance_of_a_release_closes(book: Book) -> None:
    """Energy that is stored, moved and dissipated; nothing is gained."""
    run = released().simulate(
        until=0.05, every=0.005, fine=False, method="energy-momentum", step=5e-4, spectral_radius=1.0
    )
    assert run.attrs["status"] == "success"
    scale, lost = float(run["energy_elastic"].values[0]), run["energy_dissipated"].values
    book(
        CHAPTER, "Balance of a bent shell of two laws that is released, energy-momentum", reference="0",
        source="balance of energy", error=np.abs(run["energy_defect"].values).max() / scale, allowed=1e-9,
    )  # fmt: skip
    assert np.all(np.diff(lost) >= -1e-12 * scale)
    assert lost[-1] > 0.02 * scale


def relaxing(clamped: tuple[str, ...] = ()) -> Any:
    """The disturbed shell of the tests of kernels, of two plies that relax by other laws."""
    plies = [(material(1e3, 0.3), 0.3), (material(2e3, 0.2, ONE), 0.2)]
    section = {"laminate": [{"material": one, "thickness": h} for one, h in plies]}
    return disturbed(section=section, thickness=None, material=None, clamped=clamped)


@pytest.mark.parametrize("span", [0.0, 0.7, math.inf])
def test_forces_and_tangent_after_a_time(span: float) -> None:
    assembly, y = relaxing(("x0",))
    assembly.model.prony_terms["span"] = span
    found = forces(assembly, y)
    matrix = matrix_of(assembly.model)
    implicit.tangent(0.0, y, np.zeros(0), 0.0, 0.0, 1.0, assembly.model, matrix)
    K = sparse_of(matrix).toarray()
    assert K == pytest.approx(differences(forces, assembly, y, 1e-6).T, abs=1e-8 * np.abs(K).max())
    elastic = forces(disturbed(clamped=("x0",), thickness=0.5, material=material(1e3, 0.3, None))[0], y)
    assert np.abs(found - elastic).max() > 1e-3 * np.abs(found).max()


def test_parts_of_the_stiffness_make_up_the_whole() -> None:
    """Of a warped element: parts that are no multiples of the whole are symmetric, take no energy and sum up."""
    section: Any = {
        "laminate": [{"material": ply, "thickness": 0.01, "angle": 0.4 * k} for k, ply in enumerate((CREEPING, OTHER))]
    }
    shell = parts.Shell(nodes=WARPED, elements=(2, 1), section=section)
    mesh, wall = shell.mesh(), shell.wall()
    own = mesh.R[mesh.quads]
    split = [part for _, part in wall.relaxing]
    assert sum(split) == pytest.approx(wall.stiffness, rel=1e-12, abs=1e-9 * wall.stiffness.max())
    found = stiffness.constants("shell", mesh.x[mesh.quads], own, own[..., 0].sum(axis=1), wall.stiffness, parts=split)
    for k, name in enumerate(("stiffness", "resultants")):
        whole = getattr(found, name)
        assert sum(part[k] for part in found.parts) == pytest.approx(whole, abs=1e-12 * np.abs(whole).max())
    for K, _ in found.parts:
        values = np.linalg.eigvalsh(K)
        assert values.min() > -1e-12 * values.max()


def test_explicit_methods_are_refused() -> None:
    with pytest.raises(InputError, match=r"a viscoelastic shell, .* use generalized-alpha or energy-momentum"):
        released().simulate(until=0.01, method="rk4")
