"""Meshes of shells by a formula and from files: the same as those on grids."""

from __future__ import annotations

import pathlib
import sys
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, parts
from evolvent.families.shells import part_mesh
from shells.plates import loaded, material, placed

Array = np.ndarray
WALL: Any = {"thickness": 0.01, "material": material(1e9, 0.3)}


def shuffled(quads: Array, count: int, seed: int = 2) -> tuple[Array, Array]:
    """Elements in another order, some in the other sense, with other numbers of nodes; and the node of each number."""
    random = np.random.default_rng(seed)
    order = random.permutation(count)
    number = np.argsort(order)
    found = [
        np.roll(number[quad], k)[:: 1 if k else -1]
        for quad, k in zip(quads, random.integers(0, 4, len(quads)), strict=True)
    ]
    return random.permutation(np.array(found)), order


def test_formula_is_the_cylinder() -> None:
    """A formula with constants in place of size and radius: nodes and axes."""
    place: Any = {"position": (1.0, 2.0, 3.0), "direction": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    wanted = parts.Shell(size=(2.0, 1.2), radius=0.8, elements=(4, 5), **place, **WALL).mesh()
    formula: Any = ["2*u", "r*sin(1.2*v/r)", "r*(cos(1.2*v/r) - 1)"]
    found = parts.Shell(formula=formula, constants={"r": 0.8}, elements=(4, 5), **place, **WALL).mesh()
    assert found.x == pytest.approx(wanted.x, abs=1e-14)
    assert found.R == pytest.approx(wanted.R, abs=1e-11)
    with pytest.raises(InputError, match=r"s.formula has no finite value or no normal at u = 0, v = 0; it must be a"):
        parts.Shell(formula=["u*v", "0*v", "u"], elements=(2, 2), **WALL).mesh("s")
    with pytest.raises(InputError, match=r"'w' at character 1 is neither a variable nor a constant"):
        parts.Shell(formula=["w", "v", "0"], elements=(2, 2), **WALL).mesh("s")


def test_free_mesh_finds_edges_normals_and_axes() -> None:
    """A shuffled mesh of a part of a cylinder: four edges, in turn; normals to second order; axis 1 by `direction`."""
    grid = parts.Shell(size=(2.0, 1.2), radius=0.8, elements=(6, 8), **WALL).mesh()
    quads, order = shuffled(grid.quads, len(grid.x))
    found = part_mesh.free_mesh("m", grid.x[order], quads, np.array([1.0, 0.0, 0.0]), {})
    sign = float(np.sign(found.R[0, :, 2] @ grid.R[order][0, :, 2]))
    assert np.abs(sign * found.R[:, :, 2] - grid.R[order][:, :, 2]).max() < 6e-3
    assert np.abs(found.R[:, :, 0] - grid.R[order][:, :, 0]).max() < 1e-12
    edges = {frozenset(order[part_mesh.nodes_of(sides)].tolist()) for sides in found.edges.values()}
    assert edges == {frozenset(part_mesh.nodes_of(sides).tolist()) for sides in grid.edges.values()}
    lengths = [part_mesh.shares_of(found.x, sides).sum() for sides in found.edges.values()]
    assert sorted(lengths) == pytest.approx([1.2, 1.2, 2.0, 2.0], rel=2e-3)
    sides = list(found.edges.values())
    assert [own[-1, 1] for own in sides] == [own[0, 0] for own in sides[1:] + sides[:1]]
    assert part_mesh.areas_of(found).sum() == pytest.approx(part_mesh.areas_of(grid).sum())


def test_hole_is_an_edge() -> None:
    """The boundary of a hole without corners is one edge; what is no surface is refused."""
    r, n = np.array([1.0, 1.5, 2.0]), 24
    turn = np.arange(n) * 2.0 * np.pi / n
    x = np.array([[a * np.cos(t), a * np.sin(t), 0.0] for a in r for t in turn])
    k = np.arange(3 * n).reshape(3, n)
    quads = np.array(
        [[k[i, j], k[i + 1, j], k[i + 1, (j + 1) % n], k[i, (j + 1) % n]] for i in (0, 1) for j in range(n)]
    )
    found = part_mesh.free_mesh("m", x, quads, np.array([1.0, 0.0, 0.0]), {})
    lengths = [part_mesh.shares_of(x, sides).sum() for sides in found.edges.values()]
    assert lengths == pytest.approx([2.0 * n * np.sin(np.pi / n), 4.0 * n * np.sin(np.pi / n)])
    with pytest.raises(InputError, match="m has 3 elements at the side between nodes 0 and 24; two at most"):
        part_mesh.free_mesh("m", x, np.vstack([quads, [[0, 24, 30, 31]]]), np.array([1.0, 0.0, 0.0]), {})
    with pytest.raises(InputError, match=r"m.direction is normal to the surface at node 0"):
        part_mesh.free_mesh("m", x, quads, np.array([0.0, 0.0, 1.0]), {})
    strip = np.array([[i, i + 1, n + i + 1, n + i] for i in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]])
    with pytest.raises(InputError, match="m has one side alone, as a Moebius strip; a shell must have two"):
        part_mesh.free_mesh("m", x[: 2 * n], strip, np.array([1.0, 0.0, 0.0]), {})


@pytest.mark.parametrize("ending", [".msh", ".bdf"])
def test_file(ending: str, tmp_path: pathlib.Path) -> None:
    """A cantilever from a file in mm with a set for the clamp deflects as that on a grid."""
    meshio = pytest.importorskip("meshio")
    grid = parts.Shell(size=(1.0, 0.2), elements=(6, 2), clamped=("x0",), **WALL)
    mesh = grid.mesh()
    quads, order = shuffled(mesh.quads, len(mesh.x))
    x, number = mesh.x[order], np.argsort(order)
    lines = number[mesh.edges["x0"]]
    path = str(tmp_path / f"panel{ending}")
    cells = [("line", lines), ("quad", quads)]
    groups = {"gmsh:physical": [np.full(2, 7), np.full(12, 1)], "gmsh:geometrical": [np.full(2, 1), np.full(12, 1)]}
    keys: Any = {"cell_data": groups, "field_data": {"root": np.array([7, 1]), "wall": np.array([1, 2])}}
    if ending == ".msh":
        meshio.write(path, meshio.Mesh(1e3 * x, cells, **keys), file_format="gmsh22")
    else:
        meshio.write(path, meshio.Mesh(1e3 * x, cells[1:]))
    shell = parts.Shell(file=path, length_unit="1 mm", clamped=("root",) if ending == ".msh" else (), **WALL)
    found = shell.mesh()
    assert found.x == pytest.approx(x, abs=1e-9)
    tip = next(name for name in found.edges if set(shell.edge(name)) == set(number[grid.edge("x1")]))
    if ending == ".bdf":
        root = next(name for name in found.edges if set(shell.edge(name)) == set(number[grid.edge("x0")]))
        shell = shell.with_keys(clamped=(root,))
    wanted = placed(loaded(grid, "x1", force=(0.0, 0.0, 1.0)))
    assert placed(loaded(shell, tip, force=(0.0, 0.0, 1.0))) == pytest.approx(wanted[order], abs=1e-8)


def test_refusals_of_files(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles, other endings, other edges, a package that is missing: a sentence."""
    meshio = pytest.importorskip("meshio")
    x, path = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]), str(tmp_path / "a.msh")
    with pytest.raises(InputError, match=r"is no file of a mesh that is read; its name must end with \.msh, \.bdf"):
        parts.Shell(file="a.stl", **WALL).mesh()
    cells = [("quad", [[0, 1, 2, 3]]), ("triangle", [[1, 4, 2]])]
    meshio.write(path, meshio.Mesh(x, cells), file_format="gmsh22")
    with pytest.raises(InputError, match="has 1 elements of the kind 'triangle'; a shell needs quadrilaterals of four"):
        parts.Shell(file=path, **WALL).mesh()
    meshio.write(path, meshio.Mesh(x, cells[:1]), file_format="gmsh22")
    with pytest.raises(InputError, match=r"s has no edge 'x0'; give one of edge\[0\], edge\[1\], edge\[2\], edge\[3\]"):
        parts.Shell(file=path, **WALL).edge("x0", "s")
    (tmp_path / "b.msh").write_text("$MeshFormat\n")
    with pytest.raises(InputError, match=r"cannot read '.*b\.msh' as a mesh of Gmsh"):
        parts.Shell(file=str(tmp_path / "b.msh"), **WALL).mesh()
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(InputError, match=r"need the package meshio: pip install 'evolvent\[mesh\]'"):
        parts.Shell(file=str(tmp_path / "b.msh"), **WALL).mesh()
