"""The estimate of the error of a shell's mesh: elements in halves along both sides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.analysis.mesh_error import refined
from shells.plates import material

WALL: Any = {"thickness": 0.01, "material": material(1e9)}


def hinged(**keys: Any) -> System:
    """Two panels with a fold between them, pushed at a corner and at a node in the middle."""
    system = System()
    system.add(parts.Shell(size=(0.5, 0.2), elements=(2, 2), clamped=("x0",), **WALL), "one")
    system.add(parts.Shell(size=(0.5, 0.2), elements=(2, 2), position=(0.5, 0.0, 0.0), **WALL, **keys), "two")
    system.add(parts.Seam(a="one.x1", b="two.x0", stiffness=20.0), "fold")
    system.add(parts.Load(at="two[4]", force=(0.0, 0.0, 0.01)), "push")
    return system


def test_nodes_keep_their_places() -> None:
    """References to nodes follow."""
    finer = refined(hinged())
    assert finer.parts["two"].elements == (4, 4)
    coarse, fine = (one.parts["two"].mesh().x for one in (hinged(), finer))
    assert fine[int(finer.parts["push"].at.split("[")[1][:-1])] == pytest.approx(coarse[4])
    assert finer.parts["push"].at == "two[12]"


def test_frequencies_and_equilibrium() -> None:
    """Extrapolated frequencies are nearer to those of a finer mesh; seams have estimates, their nodes none."""
    found = hinged().modes(count=3, mesh_error=True)
    exact = refined(refined(hinged())).modes(count=3).frequency_hz
    assert np.abs(found.mesh.extrapolated - exact).max() < 0.35 * np.abs(found.frequency_hz - exact).max()
    run = hinged().equilibrium(mesh_error=True)
    assert run["fold"]["angle"].attrs["mesh_error"] < 0.05
    assert "mesh_error" not in run["fold 1"]["angle"].attrs


def test_what_cannot_be_refined() -> None:
    """A mesh that is given by its nodes."""
    x = parts.Shell(size=(0.5, 0.2), elements=(1, 1), **WALL).mesh().x.reshape(2, 2, 3)
    system = System()
    system.add(parts.Shell(nodes=x, elements=(1, 1), clamped=("x0",), **WALL), "panel")
    with pytest.raises(InputError, match=r"needs a finer mesh, but panel\.nodes has this one; compare with a case"):
        system.modes(count=1, mesh_error=True)
