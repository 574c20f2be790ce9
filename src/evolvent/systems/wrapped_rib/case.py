"""What a user writes about a wrapped rib."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from evolvent import units
from evolvent.errors import InputError, nearest
from evolvent.schema import Section
from evolvent.systems.wrapped_rib import reference

if TYPE_CHECKING:
    from evolvent.elements import CrossSection, Material

#: The implicit method; the explicit ones take penalties in place of joints.
IMPLICIT = "generalized-alpha"
Torque = Annotated[float, units.Quantity(what="a torque", unit="N m", example="0.2 N m", above=0.0)]
Strain = Annotated[float, units.Quantity(what="a strain", unit="", example="1e-3", above=0.0, most=0.5)]
Stiffness = Annotated[
    float | str, units.Quantity(what="a stiffness", unit="N/m", example="1e3 N/m", above=0.0, auto=True)
]
Exponent = Annotated[float, units.Quantity(what="a plain number", unit="", example="1.5", least=1.0, most=4.0)]
Friction = Annotated[float, units.Quantity(what="a plain number", unit="", example="0.3", least=0.0, most=10.0)]
Points = Annotated[int, units.Whole(least=1, most=64)]
#: Strain at the root from which on a case is refused.
STRAIN_REFUSED = 0.5
#: Parts of the hub's radius by which a wound rib sinks in, and a bit of rib that falls on the hub, at most, where the
#: contact's stiffness is left to be found.
SINKS, FALLS = 1e-4, 1e-3
#: Most elements of a rib.
MOST_ELEMENTS = 10_000
#: Largest step of RK4 for an undamped oscillation, times its frequency in rad/s.
RK4_LIMIT = 2.8

ElementNumber = Annotated[int, units.Whole(least=1, most=MOST_ELEMENTS)]


def _key(default: Any, text: str) -> Any:
    """A key with its default (... for none) and what it is."""
    return Field(default, description=text)


class Rib(Section):
    """Every rib: a thin strip, straight at rest, that winds with its flat side on the hub."""

    formulation: Literal["cable", "cable_stretch", "assumed_strain", "elastic_line", "nu_split", "full"] = _key(
        "cable",
        "of the elements: cable (position and slope), cable_stretch (engineering strain, for more than 1 % of it), "
        "assumed_strain (the beam that does not lock), or beams that lock: elastic_line, nu_split, full (the paper's)",
    )
    elements: Annotated[int, units.Whole(least=1, most=MOST_ELEMENTS)] = _key(40, "elements of equal length")
    length: units.Length = _key(12.0, "from root to tip")
    width: units.Length = _key(0.03, "along the hub's axis")
    thickness: units.Length = _key(0.0003, "across the flat side, at the root")
    tip_thickness: units.Length | None = _key(None, "at the tip, of a linear taper; left out: the same")
    density: units.Density = _key(1600.0, "mass per volume")
    young_modulus: units.Modulus = _key(5e6, "E")
    poisson: units.PoissonRatio = _key(0.3, "nu, above -1 and below 0.5; a cable does not use it")
    count: Points = _key(1, "ribs, evenly spaced round the hub")
    root: Literal["hinge", "clamp"] = _key(
        "hinge", "hinge: turns freely about the hub's axis; clamp: keeps its direction"
    )
    root_stiffness: units.RotationalStiffnessOrZero = _key(
        0.0, "of a spring in the hinge, at rest in the start direction"
    )
    root_damping: units.RotationalDampingOrZero = _key(0.0, "of a damper in the hinge")
    start_angle: units.Angle = _key(
        0.0, "of the straight rib from outwards, positive in the winding sense; 90 deg of a carried tip"
    )

    @model_validator(mode="after")
    def _check(self) -> Rib:
        if abs(self.start_angle) > 0.5 * math.pi * (1.0 + 1e-9):
            raise InputError(
                f"rib.start_angle is {math.degrees(self.start_angle):.4g} deg; it must be from -90 to 90 deg, beyond "
                f"which the rib starts inside the hub"
            )
        thickest = max(self.thickness, self.tip_thickness or 0.0)
        if self.element_length < thickest:
            most = int(self.length / thickest)
            allowed = f"rib.elements may be {most} at most" if most else "the rib must be longer"
            raise InputError(
                f"rib.length is {self.length:g} m, which makes each of {self.elements} elements "
                f"{self.element_length:.4g} m long, shorter than its thickness {thickest:g} m; {allowed}"
            )
        if thickest > self.width:
            raise InputError(f"rib.thickness is {thickest:g} m, more than rib.width {self.width:g} m; exchange them")
        if self.root == "clamp":
            for key in ("root_stiffness", "root_damping"):
                if getattr(self, key) > 0.0:
                    raise InputError(f"rib.{key} is given, but rib.root is 'clamp', which does not turn; take a hinge")
        return self

    @property
    def element_length(self) -> float:
        """Of one element, m."""
        return self.length / self.elements

    @property
    def vectors(self) -> int:
        """Vectors of a node: place and slope of a cable; place and three slopes of a beam."""
        return 2 if self.formulation in ("cable", "cable_stretch") else 4

    @property
    def material(self) -> Material:
        """What `evolvent.elements` takes."""
        from evolvent.elements import Material

        return Material(young_modulus=self.young_modulus, poisson_ratio=self.poisson, density=self.density)

    def thickness_at(self, share: Any) -> Any:
        """Thickness at shares of the length from the root, m."""
        tip = self.thickness if self.tip_thickness is None else self.tip_thickness
        return self.thickness + share * (tip - self.thickness)

    @property
    def profile(self) -> CrossSection:
        """Section of the whole rib."""
        from evolvent.elements import Rectangle, Taper

        root = Rectangle(thickness=self.thickness, width=self.width)
        if self.tip_thickness is None:
            return root
        return Taper(root=root, tip=Rectangle(thickness=self.tip_thickness, width=self.width))

    def section(self, element: int) -> CrossSection:
        """Section of an element, counted from 0 at the root."""
        return self.profile.between(element / self.elements, (element + 1) / self.elements)


class Hub(Section):
    """The rigid hub, a cylinder about z, its middle at the origin; the ribs are hinged at half its height."""

    radius: units.Length = _key(0.6, "of the surface that the ribs wind on")
    height: units.Length = _key(3.0, "along its axis")
    motion: Literal["fixed", "free", "spin", "driven"] = _key(
        "fixed", "fixed, free in space, free to spin about its axis, or driven about it"
    )
    mass: units.Mass | None = _key(None, "without the ribs; needed for motion: free")
    inertia: units.Inertias | None = _key(
        None, "about every axis, or principal moments; needed for motion: free and spin"
    )

    @model_validator(mode="after")
    def _check(self) -> Hub:
        if isinstance(self.inertia, tuple):
            if len(self.inertia) != 3:
                raise InputError(
                    f"hub.inertia has {len(self.inertia)} values; it must be one, or three principal moments"
                )
            if 2.0 * max(self.inertia) > sum(self.inertia) * (1.0 + 1e-9):
                raise InputError(
                    f"hub.inertia is {self.inertia} kg m^2; no body has it: one principal moment exceeds the sum of "
                    f"the others"
                )
        if self.motion == "free" and self.mass is None:
            raise InputError("hub.mass is missing; a hub with motion 'free' needs it, such as '200 kg'")
        if self.motion in ("free", "spin") and self.inertia is None:
            raise InputError(f"hub.inertia is missing; a hub with motion {self.motion!r} needs it, such as '50 kg m^2'")
        return self


class Drive(Section):
    """What winds the rib; the winding sense is counterclockwise about the hub's axis."""

    kind: Literal["torque", "hub", "tip"] = _key(
        "torque",
        "torque: spread over the rib, about the hub's axis; hub: it turns, the rib is held back; tip: it is carried",
    )
    torque: Torque | None = _key(None, "on each rib; of kind hub what holds it back, optional")
    rate: units.AngularRate | None = _key(None, "of kinds hub and tip; negative unwinds, in phase deploy")
    ramp: units.DurationOrZero = _key(0.0, "time in which the torque or rate is smoothly reached")
    stretch: Strain = _key(1e-3, "strain with which a carried tip holds the rib taut, of kind tip")

    @model_validator(mode="after")
    def _check(self) -> Drive:
        if self.kind == "torque" and self.torque is None:
            raise InputError("drive.torque is missing; a drive of kind 'torque' needs it, such as '0.2 N m'")
        if self.kind == "tip" and self.torque is not None:
            raise InputError(
                "drive.torque is given, but a drive of kind 'tip' carries the tip at drive.rate; leave it out"
            )
        if self.kind == "torque" and self.rate is not None:
            raise InputError("drive.rate is given, but a drive of kind 'torque' has none; leave it out")
        if self.kind != "torque":
            if self.rate is None:
                raise InputError(f"drive.rate is missing; a drive of kind {self.kind!r} needs it, such as '0.1 rad/s'")
            if self.rate == 0.0:
                raise InputError("drive.rate is 0 rad/s; nothing would move, give one such as '0.1 rad/s'")
        if self.kind != "tip" and self.stretch != type(self).model_fields["stretch"].default:
            raise InputError(f"drive.stretch is given, but a drive of kind {self.kind!r} has none; it is for kind tip")
        return self


class Hold(Section):
    """The rib wound and held by the drive."""

    time: units.Duration = _key(60.0, "that it is held")


class Damping(Section):
    """Damping of the rib's material and of its motion through space (Rayleigh)."""

    alpha: units.RateOrZero = _key(0.2, "times the mass: drag on every motion in inertial space")
    beta: units.DurationOrZero = _key(0.0, "times the stiffness")
    kind: Literal["objective", "paper"] = _key(
        "objective", "of beta: objective acts on rates of strain alone; paper's resists rotation too"
    )
    elements: Literal["all", "first"] | tuple[ElementNumber, ...] = _key(
        "all", "that are damped: all, first (at the root), or a list of numbers from 1"
    )

    @model_validator(mode="after")
    def _check(self) -> Damping:
        if isinstance(self.elements, tuple):
            if not self.elements:
                raise InputError("damping.elements is empty; give all, first, or a list of numbers from 1")
            if len(set(self.elements)) < len(self.elements):
                raise InputError(f"damping.elements is {list(self.elements)}; it names an element twice")
        return self


class Contact(Section):
    """Contact of the rib's axis with the hub at contact points, force K d^n (penetration d) along the normal."""

    law: Literal["paper", "hunt-crossley", "conservative"] = _key(
        "hunt-crossley",
        "hunt-crossley: K d^n (1 + a d'), never pulling (Hunt & Crossley 1975); paper: K d^n + c d', which "
        "jumps at the touch; conservative: K d^n",
    )
    stiffness: Stiffness = _key(
        "auto",
        "K, of each contact point (1e6 in the paper), per m^(n-1); auto: the wound rib sinks in by 1e-4 of "
        "the hub's radius at most, a bit of it that springs open and falls back by 1e-3",
    )
    exponent: Exponent = _key(1.0, "n")
    damping: units.DampingOrZero = _key(1e3, "c, of law paper")
    dissipation: units.ContactDampingOrZero = _key(0.5, "a, of law hunt-crossley")
    points: Points = _key(4, "contact points in each element")
    friction: Friction = _key(0.0, "mu, Coulomb friction with the hub, and between turns")
    self: bool = _key(False, "whether turns touch and lie over one another; takes several times as long")


class Solver(Section):
    """The time integration."""

    method: Literal["generalized-alpha", "rk4", "heun"] = _key(
        "generalized-alpha", "implicit, or explicit ones of many short steps"
    )
    duration: units.DurationOrAuto = _key(
        "auto",
        "auto: wind: until a light string is wound, and a fifth more; hold: hold.time; deploy: the closed form's end",
    )
    step: units.DurationOrAuto = _key("auto", "auto: adaptive, or a safe share of the stability limit")
    tolerance: units.Tolerance = _key(3e-4, "relative error of an adaptive step")
    spectral_radius: units.Fraction = _key(0.3, "of generalized-alpha: 1 keeps high frequencies, 0 damps them")

    @model_validator(mode="after")
    def _check(self) -> Solver:
        if self.step != "auto" and self.duration != "auto" and float(self.step) > float(self.duration):
            raise InputError(f"solver.step is {self.step:g} s, more than solver.duration {self.duration:g} s")
        return self


class Output(Section):
    """What is kept."""

    every: units.Duration = _key(0.5, "time between samples")
    points: Points = _key(4, "of each element at which shape, curvature and tension are kept")


class Case(Section):
    """A case of the system `wrapped-rib`."""

    system: Literal["wrapped-rib"] = "wrapped-rib"
    phase: Literal["wind", "hold", "deploy"] = _key(
        ..., "wind: the drive winds the rib; hold: it holds the wound rib; deploy: the rib springs open"
    )
    start: str = _key(
        "auto",
        "auto: straight in phase wind, else wound; wound: on the hub, without stretch; or a saved run, "
        "run.nc, whose last sample is taken",
    )
    rib: Rib = Rib()
    hub: Hub = Hub()
    drive: Drive | None = _key(None, "needed in phases wind and hold")
    hold: Hold | None = _key(None, "needed in phase hold")
    damping: Damping = Damping()
    contact: Contact = Contact()
    solver: Solver = Solver()
    output: Output = Output()

    @model_validator(mode="after")
    def _check(self) -> Case:
        self._check_phase()
        self._check_drive()
        self._check_geometry()
        self._check_step()
        return self

    def _check_phase(self) -> None:
        if self.start not in ("auto", "straight", "wound") and not self.start.endswith(".nc"):
            guess = nearest(self.start, ("auto", "straight", "wound"))
            raise InputError(f"start is {self.start!r}; it must be auto, straight, wound or a saved run *.nc; {guess}")
        if self.start == "wound" and self.phase == "wind":
            raise InputError("start is 'wound', but phase is 'wind'; leave start out, or take phase hold or deploy")
        if self.start == "straight" and self.phase != "wind":
            raise InputError(f"start is 'straight', but phase {self.phase!r} starts from a wound rib; leave start out")
        if self.begins != "straight" and self.rib.start_angle != 0.0:
            raise InputError("rib.start_angle is given, but the rib does not start straight; leave it out")
        if self.phase == "hold":
            if self.hold is None:
                raise InputError("hold is missing; phase 'hold' needs it, such as {time: 60 s}")
            if self.solver.duration not in ("auto", self.hold.time):
                raise InputError(
                    f"solver.duration is {self.solver.duration:g} s, but hold.time is {self.hold.time:g} s; leave "
                    f"solver.duration out"
                )
        elif self.hold is not None:
            raise InputError(f"hold is given, but phase is {self.phase!r}; leave it out, or take phase hold")

    def _check_drive(self) -> None:
        drive, motion = self.drive, self.hub.motion
        if drive is None:
            if self.phase != "deploy":
                raise InputError(
                    f"drive is missing; phase {self.phase!r} needs it, such as {{kind: torque, torque: 0.2 N m}}"
                )
            if motion == "driven":
                raise InputError(
                    "hub.motion is 'driven', but drive is missing; give it, such as {kind: hub, rate: ...}"
                )
            return
        if self.phase == "deploy" and drive.kind != "hub":
            raise InputError(
                f"drive.kind is {drive.kind!r}, but in phase 'deploy' the rib opens by itself; leave drive out"
            )
        if self.phase == "hold" and drive.kind == "tip":
            raise InputError("drive.kind is 'tip', but phase 'hold' holds the rib by a torque; take kind torque")
        if drive.kind == "hub" and motion != "driven":
            raise InputError(f"hub.motion is {motion!r}, but drive.kind 'hub' turns the hub; it must be 'driven'")
        if drive.kind != "hub" and motion == "driven":
            raise InputError(f"hub.motion is 'driven', but drive.kind is {drive.kind!r}; take drive.kind hub")
        if drive.kind == "tip" and motion != "fixed":
            raise InputError(
                f"hub.motion is {motion!r}, but a carried tip goes round a hub at rest; it must be 'fixed'"
            )
        if self.phase != "deploy" and drive.rate is not None and drive.rate < 0.0:
            raise InputError(f"drive.rate is {drive.rate:g} rad/s; phase {self.phase!r} needs one above 0 rad/s")
        if drive.torque is not None:
            strain = reference.root_strain(self.strip, drive.torque)
            if strain >= STRAIN_REFUSED:
                most = STRAIN_REFUSED * drive.torque / strain
                raise InputError(
                    f"drive.torque is {drive.torque:g} N m, which stretches the wound rib's root by "
                    f"{100.0 * strain:.3g} % and tears it; it must be below {most:.3g} N m"
                )

    def _check_geometry(self) -> None:
        if self.rib.width > self.hub.height:
            raise InputError(f"rib.width is {self.rib.width:g} m, more than hub.height {self.hub.height:g} m")
        angle = self.rib.element_length / self.hub.radius
        if angle > math.pi:
            least = math.ceil(self.rib.length / (math.pi * self.hub.radius) - 1e-9)
            allowed = f"it must be {least} or more"
            if least > MOST_ELEMENTS:
                allowed = (
                    f"even {MOST_ELEMENTS} bear a rib of {MOST_ELEMENTS * math.pi * self.hub.radius:.4g} m at most; "
                    f"look at rib.length, {self.rib.length:g} m, and hub.radius, {self.hub.radius:g} m"
                )
            raise InputError(
                f"rib.elements is {self.rib.elements}, of which each would go {math.degrees(angle):.4g} deg round the "
                f"hub; {allowed}"
            )
        if self.contact_spacing >= 2.0 * self.hub.radius:
            least = int(self.rib.length / (self.rib.elements * 2.0 * self.hub.radius)) + 1
            raise InputError(
                f"contact.points is {self.contact.points}, contact points {self.contact_spacing:.4g} m apart; "
                f"the rib would pass between them through the hub, {2.0 * self.hub.radius:.4g} m across; it must be "
                f"{least} or more"
            )
        if self.contact.self and self.contact.law == "conservative":
            raise InputError(
                "contact.law is 'conservative', which contact of the turns does not know; take hunt-crossley, or "
                "contact.self: false"
            )
        if isinstance(self.damping.elements, tuple) and max(self.damping.elements) > self.rib.elements:
            raise InputError(
                f"damping.elements names element {max(self.damping.elements)}, but rib.elements is {self.rib.elements}"
            )
        if self.damping.beta > 0.0 and self.damping.kind == "paper" and self.rib.formulation == "cable_stretch":
            raise InputError(
                "damping.kind is 'paper', but rib.formulation 'cable_stretch' has the objective one only; take damping."
                "kind: objective, or rib.formulation: cable"
            )
        if self.damping.alpha > 0.0 or self.damping.beta > 0.0:
            return
        if self.damping.elements != "all":
            raise InputError("damping.elements is given, but damping.alpha and damping.beta are 0; leave it out")

    def _check_step(self) -> None:
        if self.solver.method != "rk4" or self.solver.step == "auto":
            return
        most = RK4_LIMIT / self.contact_frequency
        if float(self.solver.step) > most:
            raise InputError(
                f"solver.step is {self.solver.step:g} s, too large for the contact, which rk4 bears up to {most:.3g} "
                f"s; take step: auto, or a smaller contact.stiffness"
            )

    @property
    def contact_spacing(self) -> float:
        """Length of rib between contact points of the contact, m."""
        return self.rib.element_length / self.contact.points

    @property
    def begins(self) -> str:
        """Where the run starts: "straight", "wound", or the name of a saved run."""
        if self.start == "auto":
            return "straight" if self.phase == "wind" else "wound"
        return self.start

    @property
    def first_direction(self) -> float:
        """Of a rib that starts straight, rad from outwards: a carried tip begins its involute on the tangent."""
        return 0.5 * math.pi if self.drive is not None and self.drive.kind == "tip" else self.rib.start_angle

    @property
    def strip(self) -> reference.Strip:
        """What the closed forms take; of a tapered rib, the means over its length."""
        rib = self.rib
        ends = (rib.thickness, rib.thickness if rib.tip_thickness is None else rib.tip_thickness)
        area = rib.width * 0.5 * sum(ends)
        # the mean of t^3 over a linear taper is (a + b)(a^2 + b^2)/4
        moment = rib.width * sum(ends) * (ends[0] ** 2 + ends[1] ** 2) / 48.0
        return reference.Strip(
            radius=self.hub.radius,
            length=rib.length,
            line_density=rib.density * area,
            bending_stiffness=rib.young_modulus * moment,
            axial_stiffness=rib.young_modulus * area,
            taper=ends[1] / ends[0],
        )

    @property
    def damped(self) -> tuple[int, ...]:
        """Elements that are damped, from 0."""
        chosen = self.damping.elements
        if chosen == "all":
            return tuple(range(self.rib.elements))
        return (0,) if chosen == "first" else tuple(sorted(int(k) - 1 for k in chosen))

    @property
    def damped_arcs(self) -> tuple[tuple[float, float], ...] | None:
        """Arc lengths from the root, from and to, of what is damped, m; None for all of it."""
        length = self.rib.element_length
        return None if self.damping.elements == "all" else tuple((k * length, (k + 1) * length) for k in self.damped)

    @property
    def contact_stiffness(self) -> float:
        """Stiffness of the contact, N/m^n; see `Contact.stiffness`."""
        contact, strip, drive = self.contact, self.strip, self.drive
        if contact.stiffness != "auto":
            return float(contact.stiffness)
        R, n = strip.radius, contact.exponent
        spacing = self.contact_spacing
        pull = strip.bending_stiffness / R**2
        if drive is not None and drive.torque is not None:
            pull += drive.torque / R
        elif drive is not None and drive.kind == "tip":
            pull += strip.axial_stiffness * drive.stretch
        elif drive is not None and drive.rate is not None:  # drag of a straight rib
            arcs = self.damped_arcs or ((0.0, strip.length),)
            third = sum(b**3 - a**3 for a, b in arcs) / 3.0
            pull += self.damping.alpha * strip.line_density * abs(drive.rate) * third / R
        held = pull / R * spacing / (SINKS * R) ** n
        speed = reference.deployment_speed(strip)
        falls = 0.5 * (n + 1.0) * strip.line_density * spacing * speed**2 / (FALLS * R) ** (n + 1.0)
        return max(held, falls)

    @property
    def penalty(self) -> tuple[float, float]:
        """Stiffness of what holds a root under explicit methods: of its place (N/m) and of its direction (N m).

        As a quarter of an element's length would stretch, and a tenth of what the element's slopes feel: so it gives
        little way, and is about as fast as the element itself.
        """
        EA, length = self.strip.axial_stiffness, self.rib.element_length
        return 4.0 * EA / length, 0.1 * EA * length

    @property
    def contact_frequency(self) -> float:
        """Frequency at which one contact point, with its share of the rib's mass, would bounce on the hub, rad/s.

        Of a law that is not linear, at a penetration of the rib's thickness.
        """
        rib, contact = self.rib, self.contact
        mass = self.strip.line_density * self.contact_spacing
        stiffness = contact.exponent * self.contact_stiffness * rib.thickness ** (contact.exponent - 1.0)
        return math.sqrt(stiffness / mass)

    @property
    def string(self) -> reference.Winding:
        """A light string under the drive's torque."""
        assert self.drive is not None
        assert self.drive.torque is not None
        return reference.string_winding(
            self.strip, self.drive.torque, self.damping.alpha, damped=self.damped_arcs, start_angle=self.rib.start_angle
        )

    @property
    def duration(self) -> float:
        """Time that the run covers, s."""
        if self.solver.duration != "auto":
            return float(self.solver.duration)
        if self.hold is not None:
            return self.hold.time
        drive = self.drive
        turns = self.rib.length / self.hub.radius
        if drive is not None and drive.kind == "torque" and drive.torque is not None:
            motion = self.string
            if not math.isfinite(motion.end_time):
                raise InputError(
                    f"solver.duration is auto, but under drive.torque {drive.torque:g} N m a light string is not wound "
                    f"within {motion.time[-1]:.3g} s; give it, such as '60 s', or a greater torque"
                )
            return 1.2 * motion.end_time + drive.ramp
        if drive is not None and drive.rate is not None:
            return 1.2 * turns / abs(drive.rate) + drive.ramp
        return reference.deployment_time(self.strip)
