"""What a user writes about a heliogyro."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from evolvent import units
from evolvent.errors import InputError
from evolvent.schema import Section


class Body(Section):
    """The spinning body."""

    inertia: units.Inertias = Field(
        description="about every axis (only the spin axis counts unless free), or three principal moments; no thread"
    )
    rate: units.AngularRate = Field(description="spin about Z at the start")
    spool_offset: units.Length = Field(description="L0, from the spin axis to the axis of each spool")
    blades: Annotated[int, units.Whole(least=1, most=64)] = Field(2, description="evenly spaced about Z")
    motion: Literal["spin", "free", "driven"] = Field(
        "spin", description="spin about a fixed axis, free in six degrees of freedom, or driven at a constant rate"
    )
    mass: units.Mass | None = Field(None, description="without the thread; needed for motion: free")

    @property
    def spin_inertia(self) -> float:
        """J, kg m2."""
        return self.inertia[2] if isinstance(self.inertia, tuple) else self.inertia


class Blade(Section):
    """Every blade, a thread."""

    length: units.Length
    line_density: units.LineDensity
    tip_mass: units.MassOrZero = 0.0
    nodes: Annotated[int, units.Whole(least=1, most=10_000)] = 20
    segments: Literal["springs", "inextensible"] = "springs"
    stiffness: units.Stiffness = Field(1e4, description="of one segment (springs)")
    damping: units.DampingOrZero = Field(1e-3, description="of one segment (springs)")
    velocity_turn: bool = Field(True, description="turn a released node's velocity along the thread, eq. 12 (springs)")
    wound_mass: Literal["ignored", "carried"] | None = Field(
        None, description="whether wound thread acts on the body; left out: ignored, but carried on a free body"
    )
    lets_go: bool = Field(False, description="whether the thread leaves the spool when it is all out")
    width: units.Length | None = Field(None, description="chord of the blade, needed for sunlight")


class Change(Section):
    """A change of the spools' rate."""

    time: units.DurationOrZero = Field(description="when it begins")
    rate: units.AngularRates = Field(description="the new rate: 0 stops, a negative one reels in")
    ramp: units.DurationOrZero = Field(0.0, description="time that the smooth change takes")


class Spool(Section):
    """The spools and their law of turning: `rate` with `ramp` and `changes`, or a `table`."""

    radius: units.Length
    rate: units.AngularRates | None = Field(None, description="positive pays out")
    ramp: units.DurationOrZero = Field(0.0, description="time in which the rate is smoothly reached from rest")
    changes: tuple[Change, ...] = Field((), description="later changes of the rate, in order of time")
    table: tuple[tuple[units.Time, units.AngularRate], ...] | None = Field(
        None, description="pairs (time, rate) in place of rate, with a smooth monotone curve through them"
    )
    start_length: units.LengthOrZero = Field(0.0, description="thread already out at the start")
    start_lag: units.Angle = Field(0.0, description="lag angle of the thread already out")

    @model_validator(mode="after")
    def _check(self) -> Spool:
        if self.table is not None:
            for key in ("rate", "ramp", "changes"):
                if key in self.model_fields_set and getattr(self, key) != type(self).model_fields[key].default:
                    raise InputError(f"spool.{key} and spool.table are both given; give the rate or the table")
        if self.start_lag != 0.0 and self.start_length == 0.0:
            raise InputError("spool.start_lag is given, but spool.start_length is 0; give the length already out")
        return self


class Sunlight(Section):
    """Radiation pressure on the blades, whose chord keeps the direction of their spool's axis."""

    pressure: units.PressureOrZero = Field(4.56e-6, description="of light that is wholly absorbed, normal incidence")
    direction: units.Direction = Field((0.0, 0.0, 1.0), description="in which the light travels, inertial axes")
    reflectivity: units.Fraction = Field(1.0, description="0 absorbs all, 1 is a mirror")


class Solver(Section):
    """The time integration."""

    method: Literal["rk4", "heun", "dopri5", "generalized-alpha"] = Field(
        "rk4", description="explicit methods; generalized-alpha is implicit, for stiff springs with steps of 1 to 10 ms"
    )
    step: units.DurationOrAuto = Field("auto", description="of rk4, heun and generalized-alpha")
    rtol: units.Tolerance = Field(1e-8, description="relative tolerance of dopri5")
    atol: units.Tolerance = Field(1e-10, description="absolute tolerance of dopri5")
    duration: units.DurationOrAuto = Field("auto", description="auto: until the first blade is all out")


class Output(Section):
    """What is kept."""

    every: units.Duration = Field(0.1, description="time between samples")
    fine: bool = Field(True, description="whether finer samples are kept where the motion is fast")


class Case(Section):
    """A case of the system `heliogyro`."""

    system: Literal["heliogyro"] = "heliogyro"
    body: Body
    blade: Blade
    spool: Spool
    sunlight: Sunlight | None = None
    solver: Solver = Solver()
    output: Output = Output()

    @model_validator(mode="after")
    def _check(self) -> Case:
        given = [("spool.rate", self.spool.rate)]
        given += [(f"spool.changes.{k}.rate", change.rate) for k, change in enumerate(self.spool.changes)]
        for key, rate in given:
            if isinstance(rate, tuple) and len(rate) != self.body.blades:
                raise InputError(f"{key} has {len(rate)} values, but body.blades is {self.body.blades}")
        if self.body.motion == "free" and self.blade.wound_mass == "ignored":
            raise InputError("blade.wound_mass is 'ignored'; on a body with motion 'free' it must be 'carried'")
        if self.sunlight is not None and self.blade.width is None:
            raise InputError("blade.width is missing; sunlight needs it, such as '10 cm'")
        out, length = self.spool.start_length, self.blade.length
        if out > length:
            raise InputError(f"spool.start_length is {out:g} m, more than blade.length {length:g} m")
        return self

    @property
    def carried(self) -> bool:
        """Whether wound thread acts on the body."""
        return self.blade.wound_mass == "carried" or self.body.motion == "free"
