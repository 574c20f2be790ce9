"""A clamped rod with a weight at its tip, at large deflection: the model of measured spars and strips."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np

from evolvent.analysis.system import System
from evolvent.elements import SectionInertia, SectionStiffness
from evolvent.parts import Joint, Load, Rod
from evolvent_base import units
from evolvent_papers.laboratory.book import Array

#: Gravity, m/s2.
G = 9.80665
Deviation = Annotated[float, units.Quantity(what="a part", unit="", example="0.03", least=0.0, below=1.0)]
#: Mass and moments per length, kg/m and kg m: what a rod must have, without effect at rest.
_MASS = SectionInertia(mass_per_length=0.1, inertia_y=1e-6, inertia_z=1e-6)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Clamped:
    """A rod along x, horizontal without load; weights act along -z.

    Attributes
    ----------
    stiffness : (6, 6) float, N, N m and N m2, as of `SectionStiffness`
    length : float, m
    turn : float, rad, of the root about the axis x, from y towards z
    elements : int
    own_weight : float, N/m
    """

    stiffness: Array
    length: float
    turn: float = 0.0
    elements: int = 22
    own_weight: float = 0.0

    def deflection(self, weight: float, at: float) -> Array:
        """Displacement (3,), m, along x, y and z, of the point at the length `at`, m, by a weight at the tip, N."""
        system = System()
        c, s = math.cos(self.turn), math.sin(self.turn)
        rod = Rod(
            length=self.length, section=SectionStiffness(matrix=self.stiffness), inertia=_MASS, elements=self.elements,
            normal=(0.0, c, s),
        )  # fmt: skip
        system.add(rod, "rod")
        system.add(Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"), "clamp")
        system.add(Load(at="rod.tip", force=(0.0, 0.0, -weight)), "weight")
        if self.own_weight > 0.0:
            system.add(Load(along="rod", force=(0.0, 0.0, -self.own_weight)), "own weight")
        found = system.equilibrium()["rod"]
        along, across, down = found.deflection.values[-1].T
        moved = np.array([np.interp(at, rod.arc, one) for one in (along, across, down)])
        return np.array([moved[0], c * moved[1] - s * moved[2], s * moved[1] + c * moved[2]])

    def predicted(self, weight: float, at: float, *changes: Mapping[str, Any]) -> tuple[Array, list[Array]]:
        """`deflection`, and how each set of other attributes changes it."""
        found = self.deflection(weight, at)
        return found, [dataclasses.replace(self, **one).deflection(weight, at) - found for one in changes]
