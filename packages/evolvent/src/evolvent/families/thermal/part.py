"""Temperatures of beams and rods."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator

from evolvent.assembly.builder import Builder
from evolvent.elements.sections import TapeSection
from evolvent.model.registry import families
from evolvent.parts.base import BeamName, Group, Part
from evolvent.parts.profile import GradientProfile, TemperatureProfile, write_profile
from evolvent_base import units
from evolvent_base.dense import legendre, product
from evolvent_base.errors import InputError

#: Formulations of beams that a temperature strains.
HEATED = ("assumed_strain", "elastic_line", "cable", "cable_stretch")


def _pairs(value: Any) -> Any:
    """Rows of arrays as lists."""
    return value.tolist() if isinstance(value, np.ndarray) else value


class ThermalLoad(Part):
    """A change of the temperature of a beam or a rod, uniform in the section and with gradients across it.

    Parameters
    ----------
    part : str
        The beam or rod; its material needs `thermal_expansion`.
    temperature : optional
        Change of the temperature of the axis against that at which the beam is without stress, K, as a function of
        time.
    gradient_y, gradient_z : optional
        Gradients of the temperature along y and z of the section, K/m, as functions of time. Not of a cable, whose
        section has no axes.
    along : rows [position, factor], optional
        Factors of all three at positions along the beam, from 0 (root) to 1 (tip), straight lines between them; 1
        everywhere if left out.

    Notes
    -----
    A free beam takes the strain alpha T and the curvatures alpha gradient_y and alpha gradient_z without stress: the
    hotter side is the longer one. Strain, axial force, bending moments and strain energy of the beam are those of the
    strain less the free one. The energy that comes in as the free strain changes counts as work of loads. The section
    itself keeps its size, and stiffness and damping do not depend on temperature; damping by the stiffness acts on the
    rate of the whole strain. An element of a rod has the mean of `along` over it. In equilibria and modes the
    temperature is that at `time`, times the load factor.
    """

    kind: Literal["thermal-load"] = "thermal-load"
    group = Group.LOADS
    part: BeamName
    temperature: TemperatureProfile | None = None
    gradient_y: GradientProfile | None = None
    gradient_z: GradientProfile | None = None
    along: Annotated[tuple[tuple[units.Fraction, units.Number], ...], BeforeValidator(_pairs)] | None = None

    def factor(self, place: Any) -> np.ndarray:
        """Factor of the temperatures at positions along the beam, from 0 to 1."""
        if self.along is None:
            return np.ones(np.shape(place))
        x, values = zip(*self.along, strict=True)
        return np.asarray(np.interp(place, x, values))

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `thermal_loads`, the constants of its elements into the parameters."""
        own, index = builder.names.get(self.part, ("beams", -1))
        heat = families()[own].parts.heat if own in families() else None
        if index < 0 or heat is None:
            raise builder.not_found(self.part, "beams")
        beam = builder.specs[self.part]
        self._check(builder, name, beam, (own, index))
        places = {}
        for key in ("temperature", "gradient_y", "gradient_z"):
            profile = getattr(self, key)
            places[key] = -1
            if profile is not None:
                places[key] = builder.parameters(write_profile(builder, f"{name}.{key}", profile))[0]
        fields = {"beam": -1, "rod": -1, "expansions": -1, **places, "constants": len(builder.values)}
        fields |= heat(builder, self.part, self)
        builder.names[name] = ("thermal_loads", builder.add("thermal_loads", **fields))

    def means(self, ends: np.ndarray) -> np.ndarray:
        """Means of the factor over the elements of a rod between the positions `ends`, from 0 to 1: (elements,)."""
        at, weights = legendre(4)
        places = ends[:-1, None] + np.diff(ends)[:, None] * (0.5 + 0.5 * at)
        return product(np.asarray(self.factor(places)), 0.5 * weights)

    def _check(self, builder: Builder, name: str, beam: Any, target: tuple[str, int]) -> None:
        """Refuse a beam that the load cannot act on, and keys that do not fit it."""
        key = "rod" if target[0] == "rods" else "beam"
        if target[0] == "rods" and beam.payout is not None:
            raise InputError(
                f"{name}.part is {self.part!r}, a rod with `payout`, on which thermal loads are not supported; leave "
                f"one of them out"
            )
        gradients = [key for key in ("gradient_y", "gradient_z") if getattr(self, key) is not None]
        if self.temperature is None and not gradients:
            raise InputError(f"{name}.temperature is missing; give temperature, gradient_y or gradient_z")
        if key == "beam" and gradients and beam.vectors == 2:
            raise InputError(
                f"{name}.{gradients[0]} is given, but {self.part!r} is a {beam.formulation}, whose section has no "
                f"axes; leave it out, or use the formulation 'assumed_strain'"
            )
        if key == "beam" and beam.formulation not in HEATED:
            raise InputError(
                f"{name}.part is {self.part!r}, whose formulation is {beam.formulation!r}; a thermal load needs "
                f"{', '.join(map(repr, HEATED[:-1]))} or {HEATED[-1]!r}"
            )
        if isinstance(beam.section, TapeSection):
            raise InputError(
                f"{name}.part is {self.part!r}, whose section is a tape; a thermal load needs a section that does not "
                f"flatten, such as an arc"
            )
        if beam.material is None:
            raise InputError(
                f"{name}.part is {self.part!r}, whose section is given by its stiffness matrix; a thermal load needs a "
                f"rod with a material"
            )
        if key == "rod" and beam.couples_twist:
            raise InputError(
                f"{name}.part is {self.part!r}, a rod whose tension resists twist; a thermal load needs one with "
                f"{self.part}.tension_twist false"
            )
        if beam.material.thermal_expansion is None:
            raise InputError(
                f"{name}.part is {self.part!r}, whose material has no thermal_expansion; give {self.part}.material "
                f"one, such as 24e-6 1/K"
            )
        if any(row[key] == target[1] for row in builder.rows["thermal_loads"]):
            raise InputError(f"{name}.part is {self.part!r}, which has a thermal load already; one {key} takes one")
        if self.along is None:
            return
        x = [place for place, _ in self.along]
        if not x or any(b <= a for a, b in itertools.pairwise(x)):
            raise InputError(f"{name}.along has the positions {x!r}; they must increase")
