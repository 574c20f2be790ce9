"""Shells on distorted, warped and thin meshes: patch tests, and no locking."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import parts
from shells.plates import distorted, loaded, material, placed

Array = np.ndarray
CHAPTER = "Statics of shells"
E = 1e9


def flat(mesh: Array) -> Any:
    return np.concatenate([mesh, np.zeros((*mesh.shape[:2], 1))], axis=-1)


@pytest.mark.parametrize("kind", ["tension", "bending"])
def test_patch(kind: str) -> None:
    """Constant strain and constant curvature are exact on a mesh that is distorted by 30 %."""
    h, size, elements = 0.01, (2.0, 1.0), (4, 3)
    nodes = flat(distorted(size, elements, 0.3))
    shell = parts.Shell(nodes=nodes, elements=elements, thickness=h, material=material(E), clamped=("x0",))
    strain = curvature = 1e-7
    if kind == "tension":
        moved = placed(loaded(shell, "x1", force=(E * h * strain, 0.0, 0.0))) - nodes.reshape(-1, 3)
        wanted = strain * nodes.reshape(-1, 3)[:, 0]
        assert moved[:, 0] == pytest.approx(wanted, abs=1e-6 * strain)
        assert np.abs(moved[:, 1:]).max() < 1e-6 * strain
    else:
        torque = (0.0, -E * h**3 / 12.0 * curvature, 0.0)
        moved = placed(loaded(shell, "x1", torque=torque)) - nodes.reshape(-1, 3)
        wanted = 0.5 * curvature * nodes.reshape(-1, 3)[:, 0] ** 2
        assert moved[:, 2] == pytest.approx(wanted, abs=1e-6 * curvature)


@pytest.mark.parametrize(("amount", "elements", "allowed"), [(0.0, 8, 8e-3), (0.3, 8, 0.02), (0.3, 16, 4e-3)])
def test_quarter_of_a_ring(amount: float, elements: int, allowed: float, book: Book) -> None:
    """Bending without stretching, at a radius of 1000 thicknesses."""
    h, count = 1e-3, (elements, elements)
    mesh = distorted((0.5 * np.pi, 1.0), count, amount)
    turn, y = mesh[..., 0], mesh[..., 1]
    nodes: Any = np.stack([np.sin(turn), y, np.cos(turn)], axis=-1)
    normals: Any = np.stack([np.sin(turn), 0.0 * y, np.cos(turn)], axis=-1)
    shell = parts.Shell(
        nodes=nodes, normals=normals, elements=count, thickness=h, material=material(E), clamped=("x0",)
    )
    force = 1e-5 * E * h**3 / 12.0
    x = placed(loaded(shell, "x1", force=(0.0, 0.0, force)))[shell.edge("x1")]
    found, wanted = float(np.mean(x[:, 2])), 1e-5 * (0.75 * np.pi - 2.0)  # int (1 - sin t)^2 dt
    what = "distorted by 30 %" if amount else "regular"
    book(
        CHAPTER, f"Quarter of a ring, R/h = 1000 ({elements} x {elements}, {what})", reference="end of a thin arc",
        source="closed form", error=abs(found / wanted - 1.0), allowed=allowed,
    )  # fmt: skip


@pytest.mark.parametrize("amount", [0.0, 0.3])
def test_twisted_strip(amount: float, book: Book) -> None:
    """MacNeal's strip, twisted by 90 degrees, of a thickness of 1/344 of its width: warped elements do not lock."""
    mesh = distorted((1.0, 1.1), (24, 4), amount)
    turn, y = 0.5 * np.pi * mesh[..., 0], mesh[..., 1] - 0.55
    nodes: Any = np.stack([12.0 * mesh[..., 0], y * np.cos(turn), y * np.sin(turn)], axis=-1)
    shell = parts.Shell(nodes=nodes, elements=(24, 4), thickness=0.0032, material=material(29e6, 0.22), clamped=("x0",))
    tip, errors = shell.edge("x1"), []
    for axis, wanted in ((1, 1.294e-3), (2, 5.256e-3)):
        force = np.zeros(3)
        force[axis] = 1e-8 / 1.1
        moved = placed(loaded(shell, "x1", force=force))[tip] - nodes.reshape(-1, 3)[tip]
        errors.append(abs(float(np.mean(moved[:, axis])) / (1e-2 * wanted) - 1.0))
    what = "distorted by 30 %" if amount else "regular"
    book(
        CHAPTER, f"Twisted strip, h = 0.0032 (24 x 4, {what})", reference="5.256e-3, 1.294e-3",
        source="MacNeal & Harder 1985; Belytschko", error=max(errors), allowed=6e-3,
    )  # fmt: skip
