"""Shells whose elements no longer hold are named with the element and the time."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.families.shells.shell_limits import beyond_elements
from shells.plates import loaded, material


def test_fold_that_is_too_coarse() -> None:
    """A moment rolls a strip of three elements up to a circle, by some 110 degrees an element; five elements
    turn by 72 degrees each.
    """
    for elements in (3, 5):
        shell = parts.Shell(
            size=(12.0, 1.0), elements=(elements, 1), thickness=0.1, material=material(1.2e6), clamped=("x0",)
        )
        run = loaded(shell, "x1", torque=(0.0, -50.0 * np.pi / 3.0, 0.0)).equilibrium(load_steps=4)
        assert run.attrs["status"] == "success", run.attrs["message"]
        found = re.search(r"the normals of element (\d) of 'shell' are (\d+) deg apart", run.attrs.get("warning", ""))
        assert (found is not None) == (elements == 3)
        assert found is None or (found[1] == "2" and 100 < int(found[2]) < 125)


def test_inverted_element() -> None:
    """A node that has passed the opposite side of its element, beside nodes that are clamped."""
    system = System()
    system.add(
        parts.Shell(size=(2.0, 1.0), elements=(2, 1), thickness=0.1, material=material(1e6), clamped=("x0",)), "shell"
    )
    assembly = system.assemble()
    moved = assembly.y.copy()
    node = assembly.model.bodies[1 + 4]  # at (2, 0)
    moved[int(node["iq"])] = 0.9
    solution = SimpleNamespace(assembly=assembly, t=np.array([0.0, 0.5]), y=np.stack([assembly.y, moved]))
    (found,) = beyond_elements(solution)
    assert "element 1 of 'shell' is inverted at t = 0.5 s" in found
    solution = SimpleNamespace(assembly=assembly, t=np.zeros(1), y=assembly.y[None])
    assert not list(beyond_elements(solution))


@pytest.mark.parametrize("corner", [(1.2, 0.4), (0.5, 0.8)])
def test_elements_that_are_refused(corner: tuple[float, float]) -> None:
    """A corner of the second element lies beyond its diagonal: its Jacobian is negative there, or it folds back."""
    x = np.zeros((3, 2, 3))
    x[..., 0], x[..., 1] = np.arange(3.0)[:, None], np.arange(2.0)
    x[2, 0, :2] = corner
    nodes: Any = x
    system = System()
    system.add(parts.Shell(nodes=nodes, elements=(2, 1), thickness=0.1, material=material(1e6)), "shell")
    with pytest.raises(InputError, match=r"element 1 (of shell is not convex|are 180 deg apart)"):
        system.assemble()
