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
    """A force lifts one side of the slit; the other one is clamped. The polygon of the mesh costs 0.6 % alone."""
    n1, n2 = 6, 30
    r, turn = np.linspace(6.0, 10.0, n1 + 1)[:, None], np.linspace(0.0, 2.0 * np.pi, n2 + 1)
    nodes: Any = np.stack([r * np.cos(turn), r * np.sin(turn), 0.0 * r * turn], axis=-1)
    shell = parts.Shell(nodes=nodes, elements=(n1, n2), thickness=0.03, material=material(21e6), clamped=("y0",))
    for factor, wanted, allowed in ((0.1, (4.277, 5.876), 0.012), (1.0, (13.891, 17.528), 0.02)):
        x = placed(loaded(shell, "y1", force=(0.0, 0.0, 0.8 * factor)), 2 if factor == 0.1 else 10)
        found = x[[shell.node(0, n2), shell.node(n1, n2)], 2]
        book(
            CHAPTER, f"Slit annular plate, {factor:g} of the force (6 x 30)", reference=f"{wanted[0]}, {wanted[1]}",
            source="Sze, Liu & Lo 2004", error=np.abs(found / wanted - 1.0).max(), allowed=allowed,
        )  # fmt: skip


def test_pulled_cylinder(book: Book) -> None:
    """An open cylinder pulled apart at two points snaps; an eighth of it. At the end normals beside the force are
    68 deg apart."""
    radius = 4.953
    shell = parts.Shell(
        size=(5.175, 0.5 * np.pi * radius), radius=radius, elements=(16, 24), thickness=0.094,
        material=material(10.5e6, 0.3125), normal=(0.0, 0.0, 1.0),
    )  # fmt: skip
    for force, steps, wanted, allowed in (
        (250.0, None, 0.819, 5e-3), (5000.0, [0.05, 0.2, 0.4, 0.6, 0.8], 2.473, 0.012),
        (10000.0, [0.025, 0.1, 0.2, 0.3, 0.4, 0.5], 2.768, 0.02),
    ):  # fmt: skip
        system = System()
        system.add(shell, "shell")
        add_symmetry(system, shell, {"x0": 0, "y0": 1, "y1": 1})
        system.add(parts.Load(at="shell[0]", force=(0.0, 0.0, force)), "pull")
        found = placed(system, steps)[0, 2]
        book(
            CHAPTER, f"Open cylinder pulled by {4.0 * force:g} (16 x 24)", reference=f"{wanted}",
            source="Sze, Liu & Lo 2004", error=abs(found / wanted - 1.0), allowed=allowed,
        )  # fmt: skip
