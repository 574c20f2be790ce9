"""Balance of heat of a wall: sunlight, emission of both faces, conduction through the thickness, capacity."""

from __future__ import annotations

from collections.abc import Iterator

from evolvent_base import units
from evolvent_base.schema import Section

#: Flux of sunlight at one astronomical unit, W/m^2.
SOLAR_FLUX = 1361.0


class HeatBalance(Section):
    """What the temperatures of both faces of a wall follow from.

    Parameters
    ----------
    conductivity : float, W/(m K)
        Through the thickness.
    specific_heat : float, J/(kg K)
        Of the wall.
    absorptivity : float
        Fraction of sunlight that the top takes, the face to which the normal points.
    emissivity : float
        Of the top, in the infrared.
    absorptivity_bottom, emissivity_bottom : float, optional
        Of the bottom; those of the top if left out.
    flux : float, W/m^2
        Of sunlight across its direction; 1361 W/m^2 at one astronomical unit. 0 for none.
    direction : (3,) float
        In which the light travels, inertial axes. It lights the face towards it, by the cosine of its angle to the
        normal, which moves with the shell.
    start : float, s
        When the light begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly.
    surroundings : float, K
        Temperature of what both faces see, as a black body; that of space if left out.
    reference : float, K
        Temperature at which the wall is without stress.
    initial : float, K, optional
        Temperature where a run begins; `reference` if left out. Equilibria have that of the balance.
    """

    conductivity: units.Conductivity
    specific_heat: units.SpecificHeat
    absorptivity: units.Fraction
    emissivity: units.Fraction
    absorptivity_bottom: units.Fraction | None = None
    emissivity_bottom: units.Fraction | None = None
    flux: units.HeatFlux = SOLAR_FLUX
    direction: units.Direction = (0.0, 0.0, 1.0)
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0
    surroundings: units.AbsoluteTemperature = 2.7
    reference: units.AbsoluteTemperature = 293.15
    initial: units.AbsoluteTemperature | None = None

    def refusals(self) -> Iterator[str]:
        """A wall that keeps all heat."""
        if self.emissivities == (0.0, 0.0):
            yield "emissivity and emissivity_bottom are 0; at least one face must emit"

    @property
    def absorptivities(self) -> tuple[float, float]:
        """Of top and bottom."""
        return self.absorptivity, self.absorptivity if self.absorptivity_bottom is None else self.absorptivity_bottom

    @property
    def emissivities(self) -> tuple[float, float]:
        """Of top and bottom."""
        return self.emissivity, self.emissivity if self.emissivity_bottom is None else self.emissivity_bottom
