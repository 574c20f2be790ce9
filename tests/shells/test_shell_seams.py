"""Edges of shells that are clamped, hinged and folded; stiffeners."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.elements import Rectangle
from shells.plates import loaded, material, placed

Array = np.ndarray
E, H, B = 1e9, 0.01, 0.2
D = E * H**3 / 12.0


def panel(length: float, elements: int, begin: float = 0.0, **keys: Any) -> parts.Shell:
    """A strip of the width B along x."""
    return parts.Shell(
        size=(length, B), elements=(elements, 2), position=(begin, 0.0, 0.0), thickness=H, material=material(E), **keys
    )


def two_panels(torque: float = 0.0, **seam: Any) -> System:
    """Two panels, the first clamped at its root, with a seam between them; a torque about y per length at the end."""
    system = System()
    second = panel(0.5, 4, begin=0.5)
    system.add(panel(0.5, 4, clamped=("x0",)), "one")
    system.add(second, "two")
    system.add(parts.Seam(a="one.x1", b="two.x0", **seam), "seam")
    for node, share in zip(second.edge("x1"), second.edge_shares("x1"), strict=True):
        system.add(parts.Load(at=f"two[{node}]", torque=(0.0, share * torque, 0.0)), f"load {node}")
    return system


def found_of(system: System) -> Any:
    """Equilibrium."""
    run = system.equilibrium()
    assert run.attrs["status"] == "success", run.attrs["message"]
    return run


def test_clamped_seam_is_no_seam() -> None:
    """Two panels that are clamped to one another are one."""
    whole = placed(loaded(panel(1.0, 8, clamped=("x0",)), "x1", torque=(0.0, -5.0, 0.0)))
    run = found_of(two_panels(-5.0, type="clamp"))
    assert run["two"]["position"].values[-1] == pytest.approx(whole[12:], abs=1e-8)


def test_fold() -> None:
    """The normals on both sides of a fold differ by the moment over its stiffness, and by the angle at rest."""
    k, m = 4.0, -0.8
    for keys, torque, wanted in (({}, m, m / k), ({"rest": 0.3}, 0.0, 0.3)):  # about y, which is along the edge
        run = found_of(two_panels(torque, stiffness=k, **keys))
        one, two = (run[name]["normal"].values[-1].reshape(5, 3, 3) for name in ("one", "two"))
        angle = np.arctan2(two[0, :, 0], two[0, :, 2]) - np.arctan2(one[-1, :, 0], one[-1, :, 2])
        assert angle == pytest.approx([wanted] * 3, abs=1e-6)
        assert run["two"]["position"].values[-1][:3] == pytest.approx(run["one"]["position"].values[-1][-3:], abs=1e-9)
    assert run["energy_elastic"].values[-1] < 1e-12


@pytest.mark.parametrize("body", [None, "hub"])
def test_hinge_along_an_edge(body: str | None) -> None:
    """A panel on a hinge with a stiffness, of the ground or of a body, is turned by a torque at its end."""
    k, shell, system = 3.0, panel(0.5, 4), System()
    keys: Any = {} if body is None else {"b": body}
    system.add(parts.RigidBody(motion="driven", position=(-0.2, 0.0, 0.0)), "hub")
    system.add(shell, "shell")
    system.add(parts.Seam(a="shell.x0", stiffness=k, **keys), "hinge")
    for node, share in zip(shell.edge("x0"), shell.edge_shares("x0"), strict=True):
        system.add(parts.Load(at=f"shell[{node}]", torque=(0.0, -share * 0.9, 0.0)), f"load {node}")
    run = found_of(system)
    x = run["shell"]["position"].values[-1]
    assert np.arctan2(x[-1, 2], x[-1, 0]) == pytest.approx(0.3, abs=1e-6)
    assert np.abs(x[:3] - shell.mesh().x[:3]).max() < 1e-9


def test_corners_on_one_body_are_joined_once() -> None:
    """Two walls that are clamped to a body at one edge and joined along another: no constraint repeats others."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=(-0.1, 0.0, 0.0)), "hub")
    for name in ("one", "two"):
        system.add(panel(0.5, 2), name)
        system.add(parts.Seam(a=f"{name}.x0", b="hub", type="clamp"), f"root {name}")
    system.add(parts.Seam(a="one.y0", b="two.y0"), "seam")
    assembly = system.assemble()
    assert assembly.model.constraints.size == 2 * 3 * 6 + 2 * 5
    assert "seam 0" not in assembly.parts
    assert "seam 1" in assembly.parts


def test_edge_on_a_body() -> None:
    """A free body on the edge of a cantilever, with a torque: M L^2/(2 D B) and M L/(D B)."""
    system, M = System(), 1e-3
    system.add(panel(0.5, 8, clamped=("x0",)), "shell")
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(0.5, 0.5 * B, 0.0)), "bar")
    system.add(parts.Seam(a="shell.x1", b="bar", type="clamp"), "seam")
    system.add(parts.Load(at="bar", torque=(0.0, -M, 0.0)), "load")
    place = found_of(system)["bar"]["position"].values[-1]
    assert place[2] == pytest.approx(M * 0.25 / (2.0 * D * B), rel=1e-4)


def test_stiffeners() -> None:
    """Rods along both long edges: the bending stiffness is the sum."""
    F = 1e-3
    shell, section = panel(1.0, 8, clamped=("x0",)), Rectangle(width=0.01, thickness=0.02)
    system = loaded(shell, "x1", force=(0.0, 0.0, F / B))
    for k, edge in enumerate(("y0", "y1")):
        rod = parts.Rod(
            length=1.0, elements=8, section=section, material=material(E), position=(0.0, k * B, 0.0),
            normal=(0.0, 0.0, 1.0),
        )  # fmt: skip
        system.add(rod, f"rod {k}")
        system.add(parts.Seam(a=f"shell.{edge}", b=f"rod {k}", type="clamp"), f"seam {k}")
    bent = D * B + 2.0 * E * section.properties(0.0).Iz
    found = placed(system)[shell.edge("x1"), 2].mean()
    assert found == pytest.approx(F / (3.0 * bent), rel=0.01)


def test_refusals() -> None:
    """One sentence each."""
    for keys, message in (
        ({"a": "one"}, "seam.a is 'one', a whole surface; give an edge, such as"),
        ({"a": "p"}, r"seam.a is 'p'; it must be an edge of a surface, such as 'panel.x1', or a rod"),
        ({"a": "one.x1", "b": "p"}, "seam.b is 'p'; it must be an edge of a surface, a rod or a rigid body"),
        ({"a": "one.x1", "b": "two.x1"}, "node 12 of 'one' is 0.5 m from the nearest node of 'two.x1'; nodes of both"),
        ({"a": "one.x0"}, "seam joins nodes that all stand still; leave it out"),
        ({"a": "one.x1", "type": "clamp", "stiffness": 1.0}, "seam.stiffness is given, but seam.type is 'clamp'"),
        ({"a": "one.x1", "b": "two.x0", "latch": 1.0}, "seam.latch_stiffness is 0.0; a latch needs one above 0 N/rad"),
    ):
        wrong, system = dict[str, Any](keys), System()
        system.add(panel(0.5, 4, clamped=("x0",)), "one")
        system.add(panel(0.5, 4, begin=0.5), "two")
        system.add(parts.Point(mass=1.0), "p")
        system.add(parts.Seam(**wrong), "seam")
        with pytest.raises(InputError, match=message):
            system.assemble()
