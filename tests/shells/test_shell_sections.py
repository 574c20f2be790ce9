"""Sections of shells against the theory of laminates: couplings, symmetric plies, a matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, parts
from evolvent.elements import Material
from evolvent.elements.laminates import Laminate, MatrixWall, Ply
from shells.plates import distorted, loaded, placed

Array = np.ndarray
#: T300/5208 (Tsai & Hahn 1980).
PLY = Material(
    young_modulus=181e9, young_modulus_2=10.3e9, poisson_ratio=0.28, shear=7.17e9, shear_23=3.5e9, density=1600.0
)
STRAIN = 1e-11


def laminate(*angles: float, thickness: float = 0.125e-3) -> Laminate:
    """Plies of T300/5208 at angles, deg, from the bottom."""
    return Laminate(plies=tuple(Ply(material=PLY, thickness=thickness, angle=np.radians(one)) for one in angles))


def test_ply() -> None:
    """Reduced stiffness of T300/5208: 181.8, 10.34, 2.897 and 7.17 GPa; at 45 deg 56.66, 42.32, 46.59, 42.87 GPa."""
    for angle, wanted in ((0.0, (181.8, 10.34, 2.897, 7.17, 0.0)), (45.0, (56.66, 56.66, 42.32, 46.59, 42.87))):
        A = laminate(angle, thickness=1.0).properties().stiffness / 1e9
        found = (A[0, 0], A[1, 1], A[0, 1], A[2, 2], A[0, 2])
        assert found == pytest.approx(wanted, rel=1e-3, abs=1e-9)
        assert laminate(angle, thickness=1.0).properties().stiffness[3:6, 3:6] == pytest.approx(A[:3, :3] * 1e9 / 12.0)


def test_homogeneous_wall() -> None:
    """Equal plies are one wall, and an isotropic material gives Kirchhoff's plate."""
    steel = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
    one = parts.Shell(size=(1.0, 1.0), elements=(1, 1), thickness=2e-3, material=steel).wall()
    many = Laminate(plies=4 * (Ply(material=steel, thickness=0.5e-3),)).properties()
    assert many.stiffness == pytest.approx(one.stiffness, abs=1e-9 * one.stiffness.max())
    assert (many.mass, many.inertia) == pytest.approx((one.mass, one.inertia))
    D = 210e9 * 8e-9 / (12.0 * 0.91)
    assert np.diag(one.stiffness)[3:] == pytest.approx([D, D, 0.35 * D, *2 * (5.0 / 6.0 * 2e-3 * 210e9 / 2.6,)])


def test_matrix_is_the_laminate() -> None:
    """A wall by the matrix of a laminate moves as this does."""
    plies = laminate(0.0, 30.0, 90.0)
    keys: Any = {"size": (1.0, 0.3), "elements": (4, 2), "clamped": ("x0",)}
    own = plies.properties()
    by_matrix = MatrixWall(matrix=own.stiffness, mass_per_area=own.mass)
    found = [
        placed(loaded(parts.Shell(section=section, **keys), "x1", force=(1.0, 0.1, 1e-3)))
        for section in (plies, by_matrix)
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-12)


@pytest.mark.parametrize("amount", [0.0, 0.3])
def test_unsymmetric_laminate_bends_under_tension(amount: float) -> None:
    """A [0/90] strip that is pulled bends: curvatures by the inverse of its matrix, on any mesh (patch test)."""
    section, size, elements = laminate(0.0, 90.0), (0.2, 0.05), (4, 2)
    nodes: Any = np.concatenate([distorted(size, elements, amount), np.zeros((5, 3, 1))], axis=-1)
    compliance = np.linalg.inv(section.properties().stiffness[:6, :6])
    N = STRAIN / compliance[0, 0]
    strains = compliance[:, 0] * N
    assert abs(strains[3]) > 0.1 * STRAIN / 0.25e-3  # it does bend
    shell = parts.Shell(nodes=nodes, elements=elements, section=section, direction=(1.0, 0.0, 0.0))
    x = placed(_pulled(shell, N))
    p, q = nodes.reshape(-1, 3)[:, 0], nodes.reshape(-1, 3)[:, 1]
    moved = x - nodes.reshape(-1, 3)
    wanted = -0.5 * (strains[3] * p**2 + strains[4] * q**2)
    off = moved[:, 2] - wanted
    fit = np.linalg.lstsq(np.stack([np.ones_like(p), p, q], axis=1), off, rcond=None)[0]
    off -= np.stack([np.ones_like(p), p, q], axis=1) @ fit
    assert np.abs(off).max() < 1e-5 * np.abs(wanted).max()
    stretch = moved[shell.edge("x1"), 0].mean() - moved[shell.edge("x0"), 0].mean()
    assert stretch == pytest.approx(strains[0] * size[0], rel=1e-5)


def _pulled(shell: parts.Shell, N: float) -> Any:
    """A shell pulled at both ends, held at three points as a rigid body alone."""
    system = loaded(shell, "x1", force=(N, 0.0, 0.0))
    for node, share in zip(shell.edge("x0"), shell.edge_shares("x0"), strict=True):
        system.add(parts.Load(at=f"shell[{node}]", force=(-N * share, 0.0, 0.0)), f"back {node}")
    x = shell.mesh().x
    corner, far, beside = shell.edge("x0")[0], shell.edge("x1")[0], shell.edge("x0")[-1]
    rows: Any = (
        (corner, "spherical", None),
        (far, "point-on-line", (1.0, 0.0, 0.0)),
        (beside, "in-plane", (0.0, 0.0, 1.0)),
    )
    for node, type_, axis in rows:
        keys: Any = {} if axis is None else {"axis": axis}
        system.add(parts.Joint(type=type_, a=tuple(x[node]), b=f"shell[{node}]", **keys), f"held {node}")
    return system


def test_cross_ply_strip_deflects() -> None:
    """A [0/90]s cantilever: P L^3/(3 E I), E I of the plate's compliance, and of shear P L/S."""
    section, L, b = laminate(0.0, 90.0, 90.0, 0.0), 0.1, 0.01
    C = section.properties().stiffness
    assert np.abs(C[:3, 3:6]).max() < 1e-9 * C[0, 0] * 0.5e-3
    d11 = np.linalg.inv(C[3:6, 3:6])[0, 0]
    P = 1e-6
    shell = parts.Shell(size=(L, b), elements=(16, 1), section=section, clamped=("x0",))
    found = placed(loaded(shell, "x1", force=(0.0, 0.0, P / b)))[shell.edge("x1"), 2].mean()
    assert found == pytest.approx(P * L**3 * d11 / (3.0 * b) + P * L / (b * C[6, 6]), rel=2e-3)


def test_keys_of_a_case() -> None:
    """A list of plies stands for a laminate; a shell is read from what it writes, with a seam and loads."""
    ply = {"material": "cfrp-ud", "thickness": "0.2 mm", "angle": "90 deg"}
    keys: Any = {"formula": ["2*u", "v", "c*u**2"], "constants": {"c": 0.1}, "elements": [4, 2]}
    shell = parts.Shell(section={"laminate": [ply]}, **keys)
    found: Any = (
        shell,
        parts.Shell(section={"stiffness": {"matrix": 8 * [2.0], "mass_per_area": "1 kg/m^2"}}, **keys),
        parts.Seam(a="wing.x1", b="flap.edge[3]", stiffness="2 N/rad", rest="3 deg"),
        parts.Load(along="flap.edge[1]", direction=(1, 0, 0), profile={"constant": "0.2 N/m"}),
        parts.Load(at=("flap", (2.5, 0.25, 0.1)), force=(0, 0, 1)),
    )
    for part in found:
        written = part.as_keys()
        assert type(part)(**{key: value for key, value in written.items() if key != "kind"}) == part


def test_refusals() -> None:
    """One sentence each."""
    plain: Any = {"size": (1.0, 1.0), "elements": (1, 1)}
    with pytest.raises(InputError, match=r"shell.thickness is missing; give thickness and material, or section"):
        parts.Shell(**plain).wall()
    with pytest.raises(InputError, match=r"s.thickness and s.section are both given; leave one of them out"):
        parts.Shell(thickness=1e-3, section=laminate(0.0), **plain).mesh("s")
    with pytest.raises(InputError, match=r"the laminate has no plies; it must have one or more"):
        parts.Shell(section={"laminate": []}, **plain)
    with pytest.raises(InputError, match=r"its entry \(8, 8\) is 0; it must be above 0"):
        parts.Shell(section={"stiffness": {"matrix": [*7 * (1.0,), 0.0], "mass_per_area": 1.0}}, **plain)
    with pytest.raises(InputError, match="a stiffness matrix: 8 rows of 8 values"):
        parts.Shell(section={"stiffness": {"matrix": 6 * (1.0,), "mass_per_area": 1.0}}, **plain)
    with pytest.raises(InputError, match=r"young_modulus_2 is 1e\+11 Pa; with the Poisson ratio 0\.4 it must be below"):
        Material(young_modulus=10e9, young_modulus_2=100e9, poisson_ratio=0.4, density=1.0)
    assert parts.Shell(
        section={"laminate": [{"material": "cfrp-ud", "thickness": "0.1 mm", "angle": "45 deg"}]}, **plain
    )
