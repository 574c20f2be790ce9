"""A spring at a beam's tip, by a point mass that is fixed there."""

from __future__ import annotations

import numpy as np

import evolvent as ev
from evolvent import parts
from evolvent.analysis.system import System
from evolvent.solvers.static.static import solve_static


def test_a_spring_at_the_tip_of_a_cantilever() -> None:
    """A weightless tip pulled by k (u0 - u): u = k u0/(k + 3 EI/l^3), less shear of a per mille."""
    tube, length, stretch = ev.Tube(radius="1 cm", thickness="1 mm"), 1.0, 1e-4
    EI = ev.ALUMINIUM.E * tube.properties(ev.ALUMINIUM.nu).Iz
    stiffness = 3.0 * EI / length**3
    system = System()
    system.add(parts.Spring(a=(length, 1.0, 0.0), b="tip", stiffness=stiffness, length=1.0 - stretch), "spring")
    system.add(parts.Joint(a="ground", b="boom.root", type="clamp"), "root")
    system.add(parts.Beam(length=length, section=tube, material="aluminium", elements=8), "boom")
    system.add(parts.Point(mass="1 g", at="boom.tip"), "tip")
    assembly = system.assemble()
    found = solve_static(assembly)
    assert found.success, found.message
    row = assembly.model.points[assembly.index("tip")]
    tip = found.y[-1][row["iq"] : row["iq"] + 3]
    np.testing.assert_allclose(tip[1], 0.5 * stretch, rtol=2e-3)
