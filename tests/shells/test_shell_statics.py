"""Equilibria of shells: published large displacements, closed forms, patch tests, distorted and thin meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from helpers import fitted_order
from shells.plates import add_symmetry, loaded, material, placed

Array = np.ndarray
CHAPTER = "Statics of shells"


def cantilever(elements: int) -> Array:
    """Displacements u and w of a cantilever of 10 x 1 x 0.1 under an end force of 4."""
    shell = parts.Shell(
        size=(10.0, 1.0), elements=(elements, 1), thickness=0.1, material=material(1.2e6), clamped=("x0",)
    )
    x = placed(loaded(shell, "x1", force=(0.0, 0.0, 4.0)), 4)[-1]
    return np.array([10.0 - x[0], x[2]])


def test_cantilever(book: Book) -> None:
    """An elastica that stretches and shears; second order."""
    wanted, counts = np.array([3.2893, 6.6999]), (8, 16, 32)
    found = [cantilever(n) for n in counts]
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    order = fitted_order(1.0 / np.array(counts), [float(np.linalg.norm(one - limit)) for one in found])
    assert order == pytest.approx(2.0, abs=0.1)
    book(
        CHAPTER, "Cantilever, end force of 4 (16 x 1)", reference="u 3.2893, w 6.6999", source="elastica with stretch",
        error=np.abs(found[1] / wanted - 1.0).max(), allowed=1.5e-3, order=order, wanted="2",
    )  # fmt: skip
    book(
        CHAPTER, "Cantilever, end force of 4 (limit)", reference="u 3.2893, w 6.6999", source="elastica with stretch",
        error=np.abs(limit / wanted - 1.0).max(), allowed=2e-4,
    )  # fmt: skip


def test_roll_up(book: Book) -> None:
    """An end moment rolls a strip up to a circle; its middle surface is shorter by h^2/(12 R^2) = 2.3e-4."""
    shell = parts.Shell(size=(12.0, 1.0), elements=(16, 1), thickness=0.1, material=material(1.2e6), clamped=("x0",))
    system = loaded(shell, "x1", torque=(0.0, -50.0 * np.pi / 3.0, 0.0))
    run = system.equilibrium(load_steps=[0.25, 0.5, 0.75, 1.0])
    assert run.attrs["status"] == "success", run.attrs["message"]
    x = run["shell"]["position"].values[-1, -1]
    book(
        CHAPTER, "Roll-up to a circle (16 x 1)", reference="u 12, w 0", source="closed form",
        error=max(abs(12.0 - x[0] - 12.0), abs(x[2])) / 12.0, allowed=5e-4, unit="L",
    )  # fmt: skip
    half = placed(loaded(shell, "x1", torque=(0.0, -25.0 * np.pi / 3.0, 0.0)))[-1]
    book(
        CHAPTER, "Roll-up to half a circle (16 x 1)", reference="u 12, w 7.6394", source="closed form",
        error=max(abs(half[0]), abs(half[2] - 24.0 / np.pi)) / 12.0, allowed=5e-4, unit="L",
    )  # fmt: skip


def test_slit_annular_plate(book: Book) -> None:
    """A force lifts one side of the slit; the other one is clamped.

    The polygon of the mesh costs 0.4 % to 0.65 %, and 0.5 % the layer at free edges, as wide as the thickness, in which
    twisting moments fall to zero: elements of 0.04 have it.
    """
    n1, n2 = 6, 30
    for layer, factor, wanted, allowed in (
        (False, 0.1, (4.277, 5.876), 0.012), (True, 1.0, (13.891, 17.528), 6e-3),
    ):  # fmt: skip
        width = [0.04, 0.54, 2.0, 3.46, 3.96] if layer else 4.0 * np.arange(1, n1) / n1
        r, turn = 6.0 + np.array([0.0, *width, 4.0])[:, None], np.linspace(0.0, 2.0 * np.pi, n2 + 1)
        nodes: Any = np.stack([r * np.cos(turn), r * np.sin(turn), 0.0 * r * turn], axis=-1)
        shell = parts.Shell(nodes=nodes, elements=(n1, n2), thickness=0.03, material=material(21e6), clamped=("y0",))
        x = placed(loaded(shell, "y1", force=(0.0, 0.0, 0.8 * factor)), 2 if factor == 0.1 else 10)
        found = x[[shell.node(0, n2), shell.node(n1, n2)], 2]
        mesh = "6 x 30, finer at free edges" if layer else "6 x 30"
        book(
            CHAPTER, f"Slit annular plate, {factor:g} of the force ({mesh})", reference=f"{wanted[0]}, {wanted[1]}",
            source="Sze, Liu & Lo 2004", error=np.abs(found / wanted - 1.0).max(), allowed=allowed,
        )  # fmt: skip


@pytest.mark.parametrize("layer", [False, True])
def test_torsion_of_a_strip(layer: bool, book: Book) -> None:
    """Torsional stiffness beside G b h^3/3: not softer with one square element across, and with elements as small as
    the layer at free edges, in which twisting moments fall to zero, that of Reissner's plate. The rate of twist is
    that of the middle third."""
    h, length, n1 = (0.1, 3.0, 6) if layer else (0.01, 12.0, 12)
    half = 0.5 * np.array([0.0, 0.04, 0.13, 0.38, 1.0])
    y = np.append(half, 1.0 - half[-2::-1]) - 0.5 if layer else np.array([-0.5, 0.5])
    nodes: Any = np.stack(np.broadcast_arrays(np.linspace(0.0, length, n1 + 1)[:, None], y, 0.0), axis=-1)
    n2 = len(y) - 1
    shell = parts.Shell(nodes=nodes, elements=(n1, n2), thickness=h, material=material(1e6), clamped=("x0",))
    stiffness, torque = 0.5e6 * h**3 / 3.0, 1e-6 if h == 0.01 else 1e-3
    z = placed(loaded(shell, "x1", torque=(torque, 0.0, 0.0)))[:, 2].reshape(n1 + 1, n2 + 1)
    twist = (z[2 * n1 // 3] - z[n1 // 3])[[0, -1]] @ [-1.0, 1.0] / (length / 3.0)
    wide = 0.5 * np.sqrt(10.0) / h
    book(
        CHAPTER, f"Torsion of a strip ({'free edges resolved' if layer else 'one element across'})",
        reference="1 - tanh(k)/k, k = sqrt(2.5) b/h" if layer else "G b h^3/3", source="closed form",
        error=abs(torque / twist / stiffness / (1.0 - np.tanh(wide) / wide if layer else 1.0) - 1.0),
        allowed=4e-3 if layer else 2e-3,
    )  # fmt: skip


@pytest.mark.parametrize("grading", [0.0, 0.8])
def test_pulled_cylinder(grading: float, book: Book) -> None:
    """An open cylinder pulled apart at two points snaps; an eighth of it. Beside the force it folds: on a uniform mesh
    the normals there are 68 deg apart at the end. With a grading, elements there are a fifth as long as the mean."""
    u = [(1.0 - grading) * one + grading * one**2 for one in (np.linspace(0.0, 1.0, n + 1) for n in (16, 24))]
    along, turn = 5.175 * u[0][:, None], 0.5 * np.pi * u[1]
    zero, radius = 0.0 * along * turn, 4.953
    nodes: Any = np.stack([along + zero, radius * np.sin(turn) + zero, radius * np.cos(turn) + zero], axis=-1)
    normals: Any = np.stack([zero, np.sin(turn) + zero, np.cos(turn) + zero], axis=-1)
    shell = parts.Shell(
        nodes=nodes, normals=normals, elements=(16, 24), thickness=0.094, material=material(10.5e6, 0.3125)
    )
    loads: list[tuple[float, Any, float, float]] = [
        (250.0, None, 0.819, 3e-3), (5000.0, [0.05, 0.2, 0.4, 0.6, 0.8], 2.473, 3e-3),
        (10000.0, [0.025, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9], 2.768, 7e-3),
    ]  # fmt: skip
    for force, steps, wanted, allowed in loads[:1] if grading == 0.0 else loads[1:]:
        system = System()
        system.add(shell, "shell")
        add_symmetry(system, shell, {"x0": 0, "y0": 1, "y1": 1})
        system.add(parts.Load(at="shell[0]", force=(0.0, 0.0, force)), "pull")
        found = placed(system, steps)[0, 2] - radius
        mesh = "16 x 24, finer at the force" if grading else "16 x 24"
        book(
            CHAPTER, f"Open cylinder pulled by {4.0 * force:g} ({mesh})", reference=f"{wanted}",
            source="Sze, Liu & Lo 2004", error=abs(found / wanted - 1.0), allowed=allowed,
        )  # fmt: skip
