"""Reduced bodies made from shells, against the shells: statics, frequencies and a swing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from shells.plates import material

SIZE, ELEMENTS, EDGE = (0.6, 0.3), (6, 3), [0, 1, 2, 3]


def shell(**keys: Any) -> parts.Shell:
    """A panel of 0.6 x 0.3 m."""
    return parts.Shell(size=SIZE, elements=ELEMENTS, thickness=0.004, material=material(5e9, 0.3), **keys)


@pytest.fixture(name="path", scope="module")
def _path(tmp_path_factory: pytest.TempPathFactory) -> str:
    system, path = System(), str(tmp_path_factory.mktemp("models") / "panel.npz")
    system.add(shell(), "panel")
    linear = system.linearize([], [], modes=40, method="craig-bampton", boundary=["panel.x0", "panel[27]"])
    assert linear.boundary == (*(f"panel[{k}]" for k in EDGE), "panel[27]")
    linear.reduced_body({"root": "panel.x0", "tip": "panel[27]"}, path)
    return path


def hinged(part: Any, root: str, **keys: Any) -> System:
    """The panel on a hinge along its edge with a torsion spring, on the ground."""
    system = System()
    system.add(part, "panel")
    system.add(parts.Seam(a=root, stiffness=keys.get("stiffness", 5.0), type="revolute"), "hinge")
    if "force" in keys:
        system.add(parts.Load(at=keys["at"], force=(0.0, 0.0, keys["force"])), "push")
    return system


def test_statics_and_frequencies(path: str) -> None:
    """Deflection at a corner by a force there: exact by constraint modes; slowest frequencies to 1e-4."""
    reduced, full = parts.ReducedBody(file=path), shell()
    assert reduced.model.names == ("root 0", "root 1", "root 2", "root 3", "tip")
    found = hinged(reduced, "panel.root", force=1e-3, at="panel.tip").equilibrium()
    wanted = hinged(full, "panel.x0", force=1e-3, at="panel[27]").equilibrium()
    moved = found["panel"]["interface_position"].values[-1, -1, 2]
    assert moved == pytest.approx(wanted["panel"]["position"].values[-1, -1, 2], rel=1e-4)
    assert moved > 1e-5
    f, w = (hinged(*one).modes(count=6).frequency_hz for one in ((reduced, "panel.root"), (full, "panel.x0")))
    assert f == pytest.approx(w, rel=1e-4)


@pytest.mark.slow
def test_swing(path: str) -> None:
    """A small swing from a push: the tip's path agrees."""
    found = []
    for part, root, at in (
        (parts.ReducedBody(file=path), "panel.root", "panel.tip"),
        (shell(), "panel.x0", "panel[27]"),
    ):
        system = hinged(part, root)
        system.add(parts.Load(at=at, direction=(0, 0, 1), profile=[(0, 0), (0.05, 2e-3), (0.1, 0)]), "push")
        run = system.simulate(until=0.5, every=0.05, step=0.005, method="energy-momentum")
        own = run["panel"]
        x = own["interface_position"] if "interface_position" in own else own["position"]
        found.append(x.values[:, -1, 2])
    assert found[0] == pytest.approx(found[1], abs=2e-3 * np.abs(found[1]).max())


def test_thin_panel() -> None:
    """Its rigid motions are not lost beside the stiffness of a wall of 0.3 mm."""
    system = System()
    thin = parts.Shell(size=(1.0, 0.5), elements=(6, 3), thickness=3e-4, material=material(60e9, 0.3))
    system.add(thin, "panel")
    linear = system.linearize([], [], modes=25, method="craig-bampton", boundary=["panel.x0", "panel[27]"])
    assert linear.rigid == 6
    w = system.modes(count=9).frequency[6:]
    assert np.sqrt(np.sort(linear.square)[6:9]) == pytest.approx(w, rel=1e-3)


def test_edges_that_cannot_be_kept() -> None:
    """One sentence each."""
    system = System()
    system.add(shell(clamped=("x0",)), "panel")
    for edge, message in (
        ("panel.x2", "boundary holds 'panel.x2'; panel has no edge 'x2'; give one of"),
        ("panel.x0", "boundary holds 'panel.x0', whose nodes all stand still; leave it out"),
    ):
        with pytest.raises(InputError, match=message):
            system.linearize([], [], modes=2, method="craig-bampton", boundary=[edge])
