"""Shells that start in another shape than that without stress."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from shells.plates import distorted, material, placed
from shells.test_shell_kernels import energy

Array = np.ndarray
E, H = 1e9, 0.005


def shell(nodes: Array, elements: tuple[int, int], start: Any = None, **keys: Any) -> System:
    """A shell without stress at `nodes`."""
    system, given = System(), dict[str, Any](nodes=nodes, start=start)
    system.add(parts.Shell(elements=elements, thickness=H, material=material(E), **given, **keys), "shell")
    return system


def flat(amount: float) -> Array:
    """A mesh of 1 x 0.3 m."""
    mesh = distorted((1.0, 0.3), (12, 4), amount)
    return np.concatenate([mesh, np.zeros((13, 5, 1))], axis=-1)


@pytest.mark.parametrize("amount", [0.0, 0.3])
def test_turned_start_is_without_stress(amount: float) -> None:
    """A start that is moved and turned as a rigid body has no energy."""
    nodes = flat(amount)
    turn, _ = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))
    turn *= np.linalg.det(turn)
    assembly = shell(nodes, (12, 4), nodes @ turn.T + [1.0, 2.0, 3.0]).assemble()
    assert energy(assembly, assembly.y) < 1e-20 * E * H


def test_rolled_start() -> None:
    """A strip that starts on an arc has the energy of its bending, D k^2/2 per area, and in equilibrium is flat."""
    nodes, k = flat(0.0), 2.0
    s = nodes[..., 0]
    arc = np.stack([np.sin(k * s) / k, nodes[..., 1], (np.cos(k * s) - 1.0) / k], axis=-1)
    normals = np.stack([np.sin(k * s), 0.0 * s, np.cos(k * s)], axis=-1)
    for keys, error in (({"start_normals": normals}, 1e-4), ({}, 0.05)):
        given: Any = keys
        system = shell(nodes, (12, 4), arc, clamped=("x0",), **given)
        assembly = system.assemble()
        assert energy(assembly, assembly.y) == pytest.approx(0.3 * 0.5 * E * H**3 / 12.0 * k * k, rel=error)
        if keys:
            assert placed(system) == pytest.approx(nodes.reshape(-1, 3), abs=1e-9)


def test_start_by_a_formula() -> None:
    """The positions and exact normals of the formula, in the axes of the shell at its place, with shared constants."""
    place: Any = {"position": (1.0, 2.0, 3.0), "direction": (0, 1, 0), "normal": (0, 0, 1), "elements": (8, 2)}
    wall: Any = {"thickness": H, "material": material(E), "constants": {"k": 2.0}}
    k, s = 2.0, np.linspace(0.0, 0.8, 9)[:, None]
    y = np.broadcast_to(np.linspace(0.0, 0.3, 3), (9, 3))
    arc = np.stack([1.0 - y, 2.0 + np.sin(k * s) / k + 0.0 * y, 3.0 + (np.cos(k * s) - 1.0) / k + 0.0 * y], axis=-1)
    normals = np.stack([0.0 * y, np.sin(k * s) + 0.0 * y, np.cos(k * s) + 0.0 * y], axis=-1)
    rolled = ("sin(0.8*k*u)/k", "0.3*v", "(cos(0.8*k*u) - 1)/k")
    by_formula = parts.Shell(size=(0.8, 0.3), start_formula=rolled, **place, **wall)
    del wall["constants"]
    by_arrays: Any = parts.Shell(size=(0.8, 0.3), start=arc, start_normals=normals, **place, **wall)
    for found, wanted in zip(by_formula.start_nodes(), by_arrays.start_nodes(), strict=True):
        assert found == pytest.approx(wanted, abs=1e-9)
    with pytest.raises(InputError, match=r"shell.constants has 'b', which shell.start_formula, .* does not use"):
        by_formula.model_copy(update={"constants": {"k": 2.0, "b": 1.0}}).start_nodes()
    with pytest.raises(InputError, match="start_formula"):
        by_arrays.model_copy(update={"start_formula": rolled}).mesh()


def test_refusal() -> None:
    """The shape of the array in one sentence."""
    with pytest.raises(InputError, match=r"shell.start has the shape \(5, 3\); it must have the vectors of all 65"):
        shell(flat(0.0), (12, 4), np.zeros((5, 3))).assemble()
