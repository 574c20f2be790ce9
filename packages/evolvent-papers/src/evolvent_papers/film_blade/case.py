"""What a user writes about film blades that are paid out."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from evolvent.closed_forms import Film, Rotor, payout_lag
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

#: Twist between two sections from which on the blade counts as buckled, rad.
BUCKLED = math.radians(5.0)


class Body(Section):
    """The spinning body, which turns freely about a fixed axis."""

    inertia: units.Inertia = Field(description="about the spin axis, without blades")
    rate: units.PositiveRate = Field(description="spin before the blades leave, whose angular momentum is kept")
    root_offset: units.Length = Field(description="L0, from the spin axis to the roots of the blades")
    blades: Annotated[int, units.Whole(least=1, most=64)] = Field(2, description="alike; one of them is computed")


class Blade(Section):
    """Every blade, a strip of film."""

    width: units.Length
    thickness: units.Length
    young_modulus: units.Modulus
    poisson_ratio: units.PoissonRatio = 0.3
    density: units.Density
    tip_mass: units.Mass = Field(description="a bar along the chord at the tip")
    root: Literal["free", "held"] = Field(
        "free", description="whether the root turns in the plane of the spin (free) or keeps its direction (held)"
    )
    pitch: units.Angle = Field(
        math.radians(0.5), description="of the root, kept: the imperfection from which buckling grows, up to 2.5 deg"
    )
    elements: Annotated[int, units.Whole(least=4, most=1000)] = 8
    stiffness_damping: units.DurationOrZero = Field(0.01, description="of strains, times the stiffness")


class Payout(Section):
    """The length that is out."""

    rate: units.Speed
    start: units.Length = Field(description="length that is out at the start")
    length: units.Length = Field(description="length at which the run ends")
    ramp: units.DurationOrZero = Field(0.0, description="time in which the rate rises smoothly from zero")


class Solver(Section):
    """The time integration, by generalized-alpha."""

    tolerance: units.Tolerance | None = Field(None, description="relative; that of the method if left out")


class Output(Section):
    """What is kept."""

    samples: Annotated[int, units.Whole(least=10, most=100_000)] = Field(
        400, description="equal times between the samples"
    )


class Case(Section):
    """A case of the system `film-blade`."""

    system: Literal["film-blade"] = "film-blade"
    title: str = Field("", description="title of figures")
    body: Body
    blade: Blade
    payout: Payout
    solver: Solver = Solver()
    output: Output = Output()

    @model_validator(mode="after")
    def _check(self) -> Case:
        out = self.payout
        if out.rate <= 0.0:
            raise InputError(f"payout.rate is {out.rate:g} m/s; it must be above 0 m/s")
        if not 1e-3 * out.length <= out.start < out.length:
            raise InputError(
                f"payout.start is {out.start:g} m; it must be below payout.length, {out.length:g} m, and at least a "
                f"thousandth of it"
            )
        if self.blade.width <= self.blade.thickness:
            raise InputError(
                f"blade.width is {self.blade.width:g} m; it must be above blade.thickness, {self.blade.thickness:g} m"
            )
        if not 0.0 < abs(self.blade.pitch) <= 0.5 * BUCKLED:
            most = math.degrees(0.5 * BUCKLED)
            raise InputError(
                f"blade.pitch is {math.degrees(self.blade.pitch):g} deg; it must be within {most:g} deg, half of the "
                f"twist of a buckled blade, and not 0, from which buckling does not grow"
            )
        if out.ramp > 0.5 * self.duration:
            raise InputError(f"payout.ramp is {out.ramp:g} s; it must be at most half of the run, {self.duration:g} s")
        if self.blade.root == "free" and math.isnan(self.steady_lag):
            fastest = 0.5 * self.momentum * self.body.root_offset / self.body.inertia
            raise InputError(
                f"payout.rate is {out.rate:g} m/s; it must be below {fastest:g} m/s, from which on a blade that is "
                f"free at its root has no steady lag"
            )
        return self

    @property
    def duration(self) -> float:
        """Of the run, s; a ramp pays out half of what its time would at the whole rate."""
        out = self.payout
        return (out.length - out.start) / out.rate + 0.5 * out.ramp

    @property
    def film(self) -> Film:
        """The section of a blade."""
        own = self.blade
        return Film(own.width, own.thickness, own.young_modulus, own.poisson_ratio)

    @property
    def rotor(self) -> Rotor:
        """Body and blades."""
        own, body = self.blade, self.body
        mass = own.density * own.width * own.thickness
        return Rotor(body.inertia, body.root_offset, body.blades, mass, own.tip_mass)

    @property
    def momentum(self) -> float:
        """Angular momentum of the body and the tip masses at its roots, kg m2/s."""
        body = self.body
        return (body.inertia + body.blades * self.blade.tip_mass * body.root_offset**2) * body.rate

    @property
    def steady_lag(self) -> float:
        """Lag of a thread in steady pay-out, rad; NaN where there is none."""
        return payout_lag(self.rotor, self.payout.rate, self.momentum)
