"""What a user writes about a heliogyro."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from evolvent.assembly import expressions
from evolvent.parts.expression import Constants, FeedbackLaw
from evolvent.parts.feedback import RATE, Limits, Sensor
from evolvent.parts.profile import TorqueProfile
from evolvent_base import units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section

#: Ways in which spools turn, in place of their rate.
WAYS = ("table", "free", "feedback")


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
    stiffness: units.Stiffness = Field(1e4, description="of one segment (springs), or give young_modulus")
    young_modulus: units.Modulus | None = Field(
        None, description="of the film, with thickness and width: stiffness = E thickness width / (length / nodes)"
    )
    thickness: units.Length | None = Field(None, description="of the film, needed for young_modulus")
    damping: units.DampingOrZero = Field(1e-3, description="of one segment (springs)")
    mesh: Literal["material", "moving"] = Field(
        "material",
        description="nodes fixed to the material, or a mesh through which it flows, which needs start_length (springs)",
    )
    boundary_segment: Literal["constant", "by-length"] = Field(
        "constant",
        description="stiffness and damping of the segment at the spool: of a whole one, or of its length (springs)",
    )
    shortest_fraction: units.PositiveNumber = Field(
        0.1, description="of a segment, at most 1: below this length the boundary segment gets no stiffer (by-length)"
    )
    rotate_velocity: bool = Field(
        True, description="turn a released node's velocity along the thread, eq. 12 (springs)"
    )
    wound_mass: Literal["ignored", "carried"] | None = Field(
        None, description="whether wound thread acts on the body; left out: ignored, but carried on a free body"
    )
    separates: bool = Field(False, description="whether the thread leaves the spool when it is all out")
    width: units.Length | None = Field(None, description="chord, needed for sunlight and young_modulus")

    @model_validator(mode="after")
    def _check(self) -> Blade:
        if self.young_modulus is None:
            if self.thickness is not None:
                raise InputError("blade.thickness is given without blade.young_modulus; give both or neither")
            return self
        if self.stiffness != type(self).model_fields["stiffness"].default:
            raise InputError("blade.stiffness and blade.young_modulus are both given; give one of them")
        for key, example in (("thickness", "5 um"), ("width", "10 cm")):
            if getattr(self, key) is None:
                raise InputError(f"blade.{key} is missing; blade.young_modulus needs it, such as '{example}'")
        return self

    @property
    def segment_stiffness(self) -> float:
        """Stiffness of one segment, N/m; that of a film follows from the number of nodes."""
        if self.young_modulus is None or self.thickness is None or self.width is None:
            return self.stiffness
        return self.young_modulus * self.thickness * self.width / (self.length / self.nodes)


class Change(Section):
    """A change of the spools' rate."""

    time: units.DurationOrZero = Field(description="when it begins")
    rate: units.AngularRates = Field(description="the new rate: 0 stops, a negative one reels in")
    ramp: units.DurationOrZero = Field(0.0, description="time that the smooth change takes")


class FreeSpool(Section):
    """A spool that the thread's tension turns, against a motor or brake: pay-out is then an unknown."""

    inertia: units.Inertia = Field(description="of the empty spool about its axis")
    torque: units.Torque = Field(0.0, description="of a motor, constant; positive pays out")
    brake: units.TorqueOrZero = Field(0.0, description="of a brake: it holds up to this torque, then slips at it")
    friction_torque: units.TorqueOrZero = Field(0.0, description="Coulomb friction of the bearing, added to the brake")
    viscous_damping: units.RotationalDampingOrZero = Field(
        0.0, description="coefficient of viscous friction of the bearing"
    )
    rate: units.AngularRate = Field(0.0, description="at the start; positive pays out")


class Feedback(Section):
    """A drive that reacts to what is measured of the motion, sampled and held (`evolvent.parts.FeedbackDrive`)."""

    law: FeedbackLaw = Field(
        description="rate to which the spools are commanded, rad/s: an expression of t (s), the spool's angle x and "
        "rate v, and of what is measured: lag (rad), out (m), spin (rad/s), each also with _rate behind it"
    )
    marker: units.LengthOrZero = Field(
        0.0, description="along the blade from its tip to the node next to it whose lag is measured"
    )
    constants: Constants = Field({}, description="of the law, in SI units")
    sensor: Sensor = Field(description="period, delay, filter, noise and seed of the measurement")
    limits: Limits = Field(Limits(), description="of rate and acceleration")
    rate: units.AngularRate = Field(0.0, description="at the start; positive pays out")

    def variables(self, blade: str, segment: float) -> dict[str, str]:
        """Results that the law, or its noise, names; segment : float, m, between nodes."""
        lag = f"{blade}[{round(self.marker / segment)}].signed_lag"
        known = {"lag": lag, "out": f"{blade}.deployed_length", "spin": "body.rate.z"}
        used = expressions.names(self.law) | set(self.sensor.noise)
        return {name: result for name, result in known.items() if used & {name, f"{name}{RATE}"}}

    @model_validator(mode="after")
    def _check(self) -> Feedback:
        for name in self.sensor.noise:
            if name not in self.variables("", 1.0):
                raise InputError(f"spool.feedback.sensor.noise has {name!r}; {nearest(name, ('lag', 'out', 'spin'))}")
        if not self.variables("", 1.0):
            raise InputError(
                f"spool.feedback.law is {self.law!r}, which reads nothing that is measured; use lag, out or spin, or "
                f"give spool.table"
            )
        return self


class Spool(Section):
    """The spools and how they turn: `rate` with `ramp` and `changes`, a `table`, `free`, or `feedback`."""

    radius: units.Length
    rate: units.AngularRates | None = Field(None, description="positive pays out")
    ramp: units.DurationOrZero = Field(0.0, description="time in which the rate rises smoothly from zero")
    changes: tuple[Change, ...] = Field((), description="later changes of the rate, in order of time")
    table: tuple[tuple[units.Time, units.AngularRate], ...] | None = Field(
        None, description="pairs (time, rate) in place of rate, with a smooth monotone curve through them"
    )
    free: FreeSpool | None = Field(None, description="spools turned by the thread, in place of rate and table")
    feedback: Feedback | None = Field(None, description="a law of what is measured, in place of rate and table")
    film_thickness: units.LengthOrZero = Field(
        0.0, description="by which the radius decreases per turn (spiral); radius is then that of the full spool"
    )
    start_length: units.LengthOrZero = Field(0.0, description="thread already out at the start")
    start_lag: units.Angle = Field(0.0, description="lag angle of the thread already out")

    @model_validator(mode="after")
    def _check(self) -> Spool:
        ways = [key for key in ("rate", "ramp", "changes", *WAYS) if self._is_given(key)]
        for way in (key for key in WAYS if key in ways):
            if ways[0] != way:
                wanted = "the rate or the table" if way == "table" else "one of them"
                raise InputError(f"spool.{ways[0]} and spool.{way} are both given; give {wanted}")
        if self.start_lag != 0.0 and self.start_length == 0.0:
            raise InputError("spool.start_lag is given, but spool.start_length is 0; give the length already out")
        return self

    def _is_given(self, key: str) -> bool:
        return key in self.model_fields_set and getattr(self, key) != type(self).model_fields[key].default

    @property
    def start_angle(self) -> float:
        """Angle that the spools have turned at the start, rad."""
        return self.angle_at(self.start_length, "spool.start_length")

    def square(self, out: Any) -> Any:
        """Square of the radius at which the thread leaves the spool with the length `out` (m) out, m2."""
        return self.radius**2 - self.film_thickness * out / math.pi

    def angle_at(self, out: float, key: str) -> float:
        """Angle of the spools at which the length `out` is out, rad: radius phi - film_thickness phi^2/(4 pi).

        Parameters
        ----------
        out : float, m
        key : str, that gives it, for messages
        """
        full, square = self.radius, self.square(out)
        if square <= 0.0:
            most = math.pi * full * full / out
            raise InputError(
                f"spool.film_thickness is {self.film_thickness:g} m; with {key} {out:g} m out it must be "
                f"below {most:.6g} m"
            )
        return 2.0 * out / (full + math.sqrt(square))


class Sunlight(Section):
    """Radiation pressure on the blades, whose chord keeps the direction of their spool's axis."""

    pressure: units.PressureOrZero = Field(4.56e-6, description="of light that is wholly absorbed, normal incidence")
    direction: units.Direction = Field((0.0, 0.0, 1.0), description="in which the light travels, inertial axes")
    specular: units.Fraction = Field(1.0, description="0 absorbs all, 1 is a mirror")


class SpinUp(Section):
    """A torque on the body about its spin axis: constant, or by a profile."""

    torque: units.Torque | None = Field(None, description="constant; negative slows the body down")
    profile: TorqueProfile | None = Field(None, description="of time, in place of torque")
    start: units.Time = Field(0.0, description="when the torque begins")
    until: units.Time | None = Field(None, description="when it ends; left out: never")
    ramp: units.DurationOrZero = Field(0.0, description="time over which it grows smoothly")

    @model_validator(mode="after")
    def _check(self) -> SpinUp:
        if (self.torque is None) == (self.profile is None):
            found = "are both missing" if self.torque is None else "are both given"
            raise InputError(f"spin_up.torque and spin_up.profile {found}; give one of them")
        return self


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
    spin_up: SpinUp | None = None
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
        if self.body.motion == "driven" and self.spin_up is not None:
            raise InputError("spin_up is given, but body.motion is 'driven', at a constant rate; use 'spin' or 'free'")
        marker = 0.0 if self.spool.feedback is None else self.spool.feedback.marker
        if marker >= self.blade.length:
            raise InputError(
                f"spool.feedback.marker is {marker:g} m; it must be below blade.length, {self.blade.length:g} m"
            )
        if self.sunlight is not None and self.blade.width is None:
            raise InputError("blade.width is missing; sunlight needs it, such as '10 cm'")
        out, length = self.spool.start_length, self.blade.length
        if out > length:
            raise InputError(f"spool.start_length is {out:g} m, more than blade.length {length:g} m")
        return self

    @property
    def carried(self) -> bool:
        """Whether wound thread acts on the body."""
        return self.blade.wound_mass == "carried" or self.body.motion == "free" or self.blade.mesh == "moving"
