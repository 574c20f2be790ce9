"""Temperatures of beams, rods and shells."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator

from evolvent.assembly.builder import Builder
from evolvent.elements.heat import HeatBalance
from evolvent.families.loads.part_rows import window
from evolvent.model.registry import families
from evolvent.parts.base import Group, Part, Reference, unit
from evolvent.parts.profile import AS_PROFILE, Profile, write_profile
from evolvent_base import units
from evolvent_base.dense import legendre, product
from evolvent_base.errors import InputError, nearest

_TemperatureProfile = Annotated[Profile[units.Temperature], AS_PROFILE]
_GradientProfile = Annotated[Profile[units.TemperatureGradient], AS_PROFILE]


def _pairs(value: Any) -> Any:
    """Rows of arrays as lists."""
    return value.tolist() if isinstance(value, np.ndarray) else value


class ThermalLoad(Part):
    """A change of the temperature of a beam, a rod or a shell, uniform in the section and with gradients across it.

    Parameters
    ----------
    part : str
        The beam, rod or shell; its materials need `thermal_expansion`.
    temperature : optional
        Change of the temperature of the axis, or of the middle of the wall, against that at which the part is without
        stress, K, as a function of time.
    gradient_y, gradient_z : optional
        Gradients of the temperature along y and z of the section, K/m, as functions of time. Not of a cable, whose
        section has no axes. Of a shell z is its normal, along which the temperature is linear.
    along : rows [position, factor], optional
        Factors of all three at positions along the beam, from 0 (root) to 1 (tip), or along side 1 of a shell, straight
        lines between them; 1 everywhere if left out.
    balance : HeatBalance, optional
        Of a shell, in place of the above: its temperatures follow, element by element, from sunlight on both faces,
        emission, conduction through the thickness and capacity.

    Notes
    -----
    A free beam takes the strain alpha T and the curvatures alpha gradient_y and alpha gradient_z without stress: the
    hotter side is the longer one. Strain, axial force, bending moments and strain energy of the beam are those of the
    strain less the free one. The energy that comes in as the free strain changes counts as work of loads. The section
    itself keeps its size, and stiffness and damping do not depend on temperature; damping by the stiffness acts on the
    rate of the whole strain. An element of a rod or a shell has the mean of `along` over it. In equilibria and modes
    the temperature is that at `time`, times the load factor.

    A shell takes the strains and curvatures at which its plies, which expand by `thermal_expansion` along the fibres
    and `thermal_expansion_2` across them, have neither a force nor a moment together: an unsymmetric laminate bends by
    a uniform temperature. Squares of the gradients are left out.

    With a `balance` the sunlight on an element follows its normal as the shell moves. A step takes the temperatures
    that follow from those at its start and their rates over the step before; in equilibria they are those at which as
    much heat goes as comes, and in modes they stand still. Neither conduction from element to element, nor shadows,
    nor light from other parts is modelled.
    """

    kind: Literal["thermal-load"] = "thermal-load"
    group = Group.LOADS
    part: Annotated[str, Reference(what="a beam, a rod or a shell")]
    temperature: _TemperatureProfile | None = None
    gradient_y: _GradientProfile | None = None
    gradient_z: _GradientProfile | None = None
    along: Annotated[tuple[tuple[units.Fraction, units.Number], ...], BeforeValidator(_pairs)] | None = None
    balance: HeatBalance | None = None

    def factor(self, place: Any) -> np.ndarray:
        """Factor of the temperatures at positions along the beam, from 0 to 1."""
        if self.along is None:
            return np.ones(np.shape(place))
        x, values = zip(*self.along, strict=True)
        return np.asarray(np.interp(place, x, values))

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `thermal_loads`, the constants of its elements into the parameters."""
        own, index = builder.names.get(self.part, ("", -1))
        heat = families()[own].parts.heat if own in families() else None
        if index < 0 or heat is None:
            heated = [one for one, (of, _) in builder.names.items() if families()[of].parts.heat is not None]
            raise InputError(
                f"{name}.part is {self.part!r}, which takes no thermal load: it must be a beam, a rod or a shell; "
                f"{nearest(self.part, heated)}"
            )
        self._check(builder, name)
        places = {}
        for key in ("temperature", "gradient_y", "gradient_z"):
            profile = getattr(self, key)
            places[key] = -1
            if profile is not None:
                places[key] = builder.parameters(write_profile(builder, f"{name}.{key}", profile))[0]
        others = dict.fromkeys(("beam", "rod", "shell", "expansions", "walls", "light"), -1)
        fields = others | places | {"constants": len(builder.values)}
        found = heat(builder, self.part, self, name)
        for key, target in found.items():
            if any(
                key not in ("expansions", "walls", "light") and row[key] == target
                for row in builder.rows["thermal_loads"]
            ):
                raise InputError(f"{name}.part is {self.part!r}, which has a thermal load already; one {key} takes one")
        builder.names[name] = ("thermal_loads", builder.add("thermal_loads", **fields | found))

    def write_walls(
        self, builder: Builder, name: str, elements: range, mass: float, thickness: float
    ) -> dict[str, int]:
        """Write the balance of heat of elements of a shell; returns the fields `walls` and `light` of the load.

        Parameters
        ----------
        elements : range of records of `shell_elements`; mass : float, kg/m^2; thickness : float, m
        """
        given, load = self.balance, len(builder.rows["thermal_loads"])
        assert given is not None
        rows = [builder.add("heated_walls", element=k, load=load, account=-1) for k in elements]
        begin = given.reference if given.initial is None else given.initial
        values = [
            *(given.flux * unit(given.direction)), *window(builder, name, given), *given.absorptivities,
            *given.emissivities, given.surroundings, given.specific_heat * mass, given.conductivity / thickness,
            given.reference, begin, thickness,
        ]  # fmt: skip
        return {"walls": rows[0], "light": builder.parameters(values)[0]}

    def means(self, ends: np.ndarray) -> np.ndarray:
        """Means of the factor over elements between the positions `ends`, from 0 to 1: (elements,)."""
        at, weights = legendre(4)
        places = ends[:-1, None] + np.diff(ends)[:, None] * (0.5 + 0.5 * at)
        return product(np.asarray(self.factor(places)), 0.5 * weights)

    def _check(self, builder: Builder, name: str) -> None:
        """Refuse a load without temperatures, and positions that do not fit."""
        profiles = [key for key in ("temperature", "gradient_y", "gradient_z") if getattr(self, key) is not None]
        if self.balance is None and not profiles:
            raise InputError(f"{name}.temperature is missing; give temperature, gradient_y or gradient_z")
        if self.balance is not None and (profiles or self.along is not None):
            key = profiles[0] if profiles else "along"
            raise InputError(
                f"{name}.{key} is given beside {name}.balance, from which temperatures follow; leave one out"
            )
        x = [place for place, _ in self.along or ()]
        if self.along is not None and (not x or any(b <= a for a, b in itertools.pairwise(x))):
            raise InputError(f"{name}.along has the positions {x!r}; they must increase")
