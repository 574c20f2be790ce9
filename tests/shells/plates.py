"""Shells for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import System, parts
from evolvent.elements import Material

Array = np.ndarray


def material(E: float, nu: float = 0.0) -> Material:
    """Material of the density 1000."""
    return Material(young_modulus=E, poisson_ratio=nu, density=1000.0)


def loaded(shell: parts.Shell, edge: Any, force: Any = None, torque: Any = None) -> System:
    """A shell with a force or torque per length of an edge, of a direction that does not change."""
    system = System()
    system.add(shell, "shell")
    for node, share in zip(shell.edge(edge), shell.edge_shares(edge), strict=True):
        kind = {"force": force} if torque is None else {"torque": torque}
        keys: Any = {key: tuple(share * np.array(value)) for key, value in kind.items()}
        system.add(parts.Load(at=f"shell[{node}]", **keys), f"load {node}")
    return system


def add_symmetry(system: System, shell: parts.Shell, edges: dict[Any, int]) -> None:
    """Keep edges in planes across an axis (0 or 1) of their nodes, about which the shell is symmetric."""
    x, R = shell.mesh()[:2]
    done: set[Any] = set()
    for edge, axis in edges.items():
        for node in shell.edge(edge):
            for other in range(3):
                held = (int(node), axis if other == axis else frozenset((axis, other)))
                if held in done:
                    continue
                done.add(held)
                keys: Any = {} if other == axis else {"axis_b": tuple(R[node][:, other])}
                guide = parts.Joint(
                    type="guide", a=tuple(x[node]), b=f"shell[{node}]", axis=tuple(R[node][:, axis]), **keys
                )
                system.add(guide, f"{edge} {node} {other}")


def placed(system: System, steps: Any = None) -> Array:
    """Nodes of the shell in equilibrium, (n, 3), m."""
    run = system.equilibrium(load_steps=steps)
    assert run.attrs["status"] == "success", run.attrs["message"]
    return np.asarray(run["shell"]["position"].values[-1])


def distorted(size: tuple[float, float], elements: tuple[int, int], amount: float, seed: int = 1) -> Array:
    """Coordinates (n1 + 1, n2 + 1, 2) of a mesh whose inner nodes are off by up to `amount` of an element."""
    grid = [np.linspace(0.0, length, n + 1) for length, n in zip(size, elements, strict=True)]
    found = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1)
    off = amount * np.random.default_rng(seed).uniform(-1.0, 1.0, found.shape)
    off[[0, -1], :, 0] = off[:, [0, -1], 1] = 0.0
    return np.asarray(found + off * np.array(size) / elements)
