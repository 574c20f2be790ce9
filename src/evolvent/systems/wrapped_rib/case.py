"""What a user writes about a wrapped rib."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from evolvent import closed_forms
from evolvent.base import units
from evolvent.base.errors import InputError, nearest
from evolvent.base.schema import Section

if TYPE_CHECKING:
    from evolvent.elements import CrossSection, Material

#: The implicit method; the explicit ones take penalties in place of the joints on the rib's nodes.
ALPHA = "generalized-alpha"
#: Methods that take joints on the rib's nodes as constraints.
ENERGY = "energy-momentum"
IMPLICIT = (ALPHA, ENERGY)
Torque = Annotated[float, units.Quantity(what="a torque", unit="N m", example="0.2 N m", above=0.0)]
Strain = Annotated[float, units.Quantity(what="a strain", unit="", example="1e-3", above=0.0, most=0.5)]
Stiffness = Annotated[
    float | str, units.Quantity(what="a stiffness", unit="N/m", example="1e3 N/m", above=0.0, auto=True)
]
Height = Annotated[float | str, units.Quantity(what="a height", unit="m", example="-0.2 m", auto=True)]
Points = Annotated[int, units.Whole(least=1, most=64)]
#: Strain at the root from which on a case is refused.
STRAIN_REFUSED = 0.5
#: Depths, in radii of the hub, to which a wound rib and a piece of it that falls on the hub sink in at most; the
#: automatic stiffness of the contact follows from them.
SINKS, TIP_FALL = 1e-4, 1e-3
#: Most elements of a rib.
MOST_ELEMENTS = 10_000
#: Kinds of drive in each phase, motions of the hub with each kind, and keys of a drive that a kind needs and refuses.
KINDS = {"wind": ("torque", "hub", "tip"), "hold": ("torque", "hub"), "deploy": ("none", "hub")}
MOTIONS = dict.fromkeys(("none", "torque"), ("fixed", "free", "spin")) | {"hub": ("driven",), "tip": ("fixed",)}
NEEDED = {"torque": {"torque": "0.2 N m"}, "hub": {"rate": "0.1 rad/s"}, "tip": {"rate": "0.1 rad/s"}}
REFUSED = {"torque": ("rate", "stretch"), "hub": ("stretch",), "tip": ("torque",)}
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
    root: Literal["hinge", "clamp"] = _key("hinge", "hinge: turns about the hub's axis; clamp: keeps its direction")
    root_stiffness: units.RotationalStiffnessOrZero = _key(0.0, "of a spring in the hinge, without moment at the start")
    root_damping: units.RotationalDampingOrZero = _key(0.0, "of a damper in the hinge")
    root_friction: units.TorqueOrZero = _key(0.0, "torque of Coulomb friction in the hinge, which sticks below it")
    pitch: units.LengthOrZero = _key(
        0.0, "advance along the hub's axis in one turn, of a rib wound as a helix; 0: turns on one another"
    )
    root_height: Height = _key(
        "auto", "of the root above the hub's middle; auto: a helix lies evenly about the middle, other ribs in it"
    )
    start_angle: units.Angle = _key(
        0.0, "of the straight rib from outwards, in the winding sense; not of a carried tip"
    )

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        thickest = max(self.thickness, self.tip_thickness or 0.0)
        most = int(self.length / thickest)
        if abs(self.start_angle) > 0.5 * math.pi * (1.0 + 1e-9):
            degrees = f"{math.degrees(self.start_angle):.4g} deg"
            yield f"rib.start_angle is {degrees}; beyond -90 and 90 deg the rib starts inside the hub"
        if self.element_length < thickest:
            allowed = f"rib.elements may be {most} at most" if most else "the rib must be longer"
            yield (
                f"rib.length is {self.length:g} m, which makes each of {self.elements} elements shorter than its "
                f"thickness {thickest:g} m; {allowed}"
            )
        if thickest > self.width:
            yield f"rib.thickness is {thickest:g} m, more than rib.width {self.width:g} m; exchange them"
        for key in ("root_stiffness", "root_damping", "root_friction"):
            if self.root == "clamp" and getattr(self, key) > 0.0:
                yield f"rib.{key} is given, but rib.root is 'clamp', which does not turn; use a hinge"

    @property
    def element_length(self) -> float:
        """Of one element, m."""
        return self.length / self.elements

    @property
    def vectors(self) -> int:
        """Vectors of a node: position and slope of a cable; position and three slopes of a beam."""
        return 2 if self.formulation in ("cable", "cable_stretch") else 4

    @property
    def material(self) -> Material:
        """What `evolvent.elements` takes."""
        from evolvent.elements import Material

        return Material(young_modulus=self.young_modulus, poisson_ratio=self.poisson, density=self.density)

    @property
    def profile(self) -> CrossSection:
        """Section of the whole rib."""
        from evolvent.elements import Rectangle, Taper

        root = Rectangle(thickness=self.thickness, width=self.width)
        if self.tip_thickness is None:
            return root
        return Taper(root=root, tip=Rectangle(thickness=self.tip_thickness, width=self.width))

    def thickness_of(self, element: int) -> float:
        """Thickness in the middle of an element, m."""
        tip = self.thickness if self.tip_thickness is None else self.tip_thickness
        return self.thickness + (element + 0.5) / self.elements * (tip - self.thickness)

    @property
    def thinnest(self) -> int:
        """Number of the thinnest element, from 0 at the root."""
        return 0 if self.tip_thickness is None or self.tip_thickness > self.thickness else self.elements - 1

    def section(self, element: int) -> CrossSection:
        """Section of an element, counted from 0 at the root."""
        return self.profile.between(element / self.elements, (element + 1) / self.elements)


class Hub(Section):
    """The rigid hub, a cylinder about z, its middle at the origin."""

    radius: units.Length = _key(0.6, "of the surface that the ribs wind on")
    height: units.Length = _key(3.0, "along its axis")
    motion: Literal["fixed", "free", "spin", "driven"] = _key(
        "fixed", "spin: free about its axis; driven: turned about it"
    )
    mass: units.Mass | None = _key(None, "without the ribs; motion: free needs it, or density")
    inertia: units.Inertias | None = _key(
        None, "about every axis, or principal moments; free, left out: of a uniform hub"
    )
    density: units.Density | None = _key(None, "of the hub's material, in place of mass and inertia")
    wall: units.Length | None = _key(None, "thickness of the wall of a hollow hub without ends; left out: solid")

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        for key in ("mass", "inertia"):
            if self.density is not None and getattr(self, key) is not None:
                yield f"hub.density and hub.{key} are both given; leave one of them out"
        if self.wall is None:
            return
        if self.wall > self.radius:
            yield f"hub.wall is {self.wall:g} m, more than hub.radius {self.radius:g} m; leave it out for a solid hub"
        if self.inertia is not None:
            yield "hub.wall and hub.inertia are both given; leave one of them out"
        elif self.density is None and (self.mass is None or self.motion != "free"):
            yield "hub.wall is given without hub.density, which it needs for the inertia; give hub.density"

    @property
    def given_mass(self) -> float | None:
        """Mass as given, or of the density, kg."""
        if self.density is None:
            return self.mass
        return self.density * math.pi * (self.radius**2 - self._inner**2) * self.height

    @property
    def given_inertia(self) -> Any:
        """Inertia as given, or of the density or of a wall, kg m^2; None for that of a solid hub of the given mass."""
        mass = self.given_mass
        if mass is None or (self.density is None and self.wall is None):
            return self.inertia
        square = self.radius**2 + self._inner**2
        across = mass * (3.0 * square + self.height**2) / 12.0
        return (across, across, 0.5 * mass * square)

    @property
    def _inner(self) -> float:
        """Inner radius, m."""
        return 0.0 if self.wall is None else self.radius - self.wall


class Drive(Section):
    """What winds the rib; the winding sense is counterclockwise about the hub's axis."""

    kind: Literal["torque", "hub", "tip"] = _key(
        "torque", "torque: spread over the rib, about the hub's axis; hub: the hub turns; tip: the tip is carried round"
    )
    torque: Torque | None = _key(None, "on each rib; of kind hub what holds it back, optional")
    rate: units.AngularRate | None = _key(None, "of kinds hub and tip; negative unwinds, in phase deploy")
    ramp: units.DurationOrZero = _key(0.0, "time in which the torque or rate is smoothly reached")
    stretch: Strain = _key(1e-3, "strain with which a carried tip holds the rib taut, of kind tip")

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        kind = f"a drive of kind {self.kind!r}"
        for key, example in NEEDED[self.kind].items():
            if getattr(self, key) is None:
                yield f"drive.{key} is missing; {kind} needs it, such as {example!r}"
        for key in REFUSED[self.kind]:
            if getattr(self, key) != type(self).model_fields[key].default:
                yield f"drive.{key} is given, but {kind} has none; leave it out"
        if self.rate == 0.0:
            yield "drive.rate is 0 rad/s; there would be no motion, give one such as '0.1 rad/s'"


class Hold(Section):
    """The rib wound and held by the drive."""

    time: units.Duration = _key(60.0, "that it is held")


class Damping(Section):
    """Damping of the rib's material and of its motion through space (Rayleigh)."""

    alpha: units.RateOrZero = _key(0.2, "times the mass: drag on every motion in inertial space")
    beta: units.DurationOrZero = _key(0.0, "times the stiffness")
    kind: Literal["objective", "paper"] = _key("objective", "of beta: on rates of strain; paper: on rotation as well")
    elements: Literal["all", "first"] | tuple[ElementNumber, ...] = _key("all", "damped: all, first, or numbers from 1")

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        if self.elements == ():
            yield "damping.elements is empty; give all, first, or a list of numbers from 1"
        if isinstance(self.elements, tuple) and len(set(self.elements)) < len(self.elements):
            yield f"damping.elements is {list(self.elements)}; it names an element twice"
        if self.elements != "all" and self.alpha == 0.0 and self.beta == 0.0:
            yield "damping.elements is given, but damping.alpha and damping.beta are 0; leave it out"


class Contact(Section):
    """Contact of the rib's axis with the hub at contact points, force K d^n (penetration d) along the normal."""

    law: Literal["paper", "hunt-crossley", "conservative"] = _key(
        "hunt-crossley", "hunt-crossley: K d^n (1 + a d'), never pulling; paper: K d^n + c d'; conservative: K d^n"
    )
    stiffness: Stiffness = _key(
        "auto", "K, of each contact point, per m^(n-1); auto: depths of 1e-4 (wound) and 1e-3 (falling) of the radius"
    )
    exponent: units.Exponent = _key(1.0, "n")
    damping: units.DampingOrZero = _key(1e3, "c, of law paper")
    dissipation: units.ContactDampingOrZero = _key(0.5, "a, of law hunt-crossley")
    points: Points = _key(4, "contact points in each element")
    friction: units.NumberOrZero = _key(0.0, "mu, Coulomb friction with the hub, and between turns")
    self: bool = _key(False, "whether turns touch and lie on one another; takes several times as long")


class Solver(Section):
    """The time integration."""

    method: Literal["auto", "energy-momentum", "generalized-alpha", "rk4", "heun"] = _key(
        "auto", "auto: energy-momentum, which gains no energy at any step; with the paper's laws generalized-alpha"
    )
    duration: units.DurationOrAuto = _key(
        "auto", "auto: wind: 1.2 times as long as a string takes; hold: hold.time; deploy: the closed form's end"
    )
    step: units.DurationOrAuto = _key("auto", "auto: adaptive, or a safe share of the stability limit")
    tolerance: units.Tolerance = _key(3e-4, "relative error of an adaptive step")
    spectral_radius: units.Fraction | None = _key(
        None, "of implicit methods: 1 keeps high frequencies, 0 damps them; left out: 0.3, of energy-momentum 1/3"
    )

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        if self.step != "auto" and self.duration != "auto" and float(self.step) > float(self.duration):
            yield f"solver.step is {self.step:g} s, more than solver.duration {self.duration:g} s"


class Output(Section):
    """What is kept."""

    every: units.Duration = _key(0.5, "time between samples")
    fine: bool = _key(True, "whether finer samples are kept where the motion is fast")
    points: Points = _key(4, "of each element at which shape and curvature are drawn")


class Case(Section):
    """A case of the system `wrapped-rib`."""

    system: Literal["wrapped-rib"] = "wrapped-rib"
    phase: Literal["wind", "hold", "deploy"] = _key(
        ..., "wind: the drive winds the rib; hold: it holds the wound rib; deploy: the rib springs open"
    )
    start: str = _key(
        "auto", "straight, or wound on the hub without stretch; auto: by the phase; or a saved run, run.nc, at its end"
    )
    rib: Rib = Rib()
    hub: Hub = Hub()
    drive: Drive | None = _key(None, "needed in phases wind and hold")
    hold: Hold | None = _key(None, "needed in phase hold")
    damping: Damping = Damping()
    contact: Contact = Contact()
    solver: Solver = Solver()
    output: Output = Output()

    def refusals(self) -> Iterator[str]:
        """Rules between the sections."""
        for rules in (self._refused_phase, self._refused_drive, self._refused_geometry, self._refused_helix):
            yield from rules()

    def _refused_phase(self) -> Iterator[str]:
        phase, hold, duration = self.phase, self.hold, self.solver.duration
        starts = ("auto", "straight" if phase == "wind" else "wound")
        if self.start not in starts and not self.start.endswith(".nc"):
            allowed = f"phase {phase!r} starts from {' or '.join(starts)}, or from a saved run *.nc"
            yield f"start is {self.start!r}; {allowed}; {nearest(self.start, starts)}"
        if self.begins != "straight" and self.rib.start_angle != 0.0:
            yield "rib.start_angle is given, but the rib does not start straight; leave it out"
        if phase == "hold" and hold is None:
            yield "hold is missing; phase 'hold' needs it, such as {time: 60 s}"
        if phase != "hold" and hold is not None:
            yield f"hold is given, but phase is {phase!r}; leave it out, or use phase hold"
        if hold is not None and duration not in ("auto", hold.time):
            yield f"solver.duration is {duration:g} s, but hold.time is {hold.time:g} s; leave solver.duration out"

    def _refused_drive(self) -> Iterator[str]:
        drive, motion, phase = self.drive, self.hub.motion, self.phase
        kind = "none" if drive is None else drive.kind
        if drive is None and phase != "deploy":
            yield f"drive is missing; phase {phase!r} needs it, such as {{kind: torque, torque: 0.2 N m}}"
        if kind not in KINDS[phase]:
            yield f"drive.kind is {kind!r}; in phase {phase!r} it must be {' or '.join(KINDS[phase])}"
        if motion not in MOTIONS[kind]:
            yield f"hub.motion is {motion!r}; with drive.kind {kind!r} it must be {' or '.join(MOTIONS[kind])}"
        if drive is None:
            return
        if phase != "deploy" and drive.rate is not None and drive.rate < 0.0:
            yield f"drive.rate is {drive.rate:g} rad/s; phase {phase!r} needs one above 0 rad/s"
        strain = 0.0 if drive.torque is None else closed_forms.root_strain(self.strip, drive.torque)
        if drive.torque is not None and strain >= STRAIN_REFUSED:
            yield (
                f"drive.torque is {drive.torque:g} N m, which strains the wound rib's root by {100.0 * strain:.3g} %; "
                f"it must be below {STRAIN_REFUSED * drive.torque / strain:.3g} N m"
            )

    def _refused_geometry(self) -> Iterator[str]:
        rib, R, contact, numbers = self.rib, self.hub.radius, self.contact, self.damping.elements
        if rib.width > self.hub.height:
            yield f"rib.width is {rib.width:g} m, more than hub.height {self.hub.height:g} m"
        angle, least = rib.element_length / R, math.ceil(rib.length / (math.pi * R) - 1e-9)
        if angle > math.pi:
            most = f"even with {MOST_ELEMENTS} of them rib.length is {MOST_ELEMENTS * math.pi * R:.4g} m at most"
            yield (
                f"rib.elements is {rib.elements}, of which each would span {math.degrees(angle):.4g} deg of the hub; "
                + (f"it must be {least} or more" if least <= MOST_ELEMENTS else most)
            )
        if self.contact_spacing >= 2.0 * R:
            yield (
                f"contact.points is {contact.points}, contact points {self.contact_spacing:.4g} m apart, between which "
                f"the rib would pass through the hub, {2.0 * R:.4g} m across; it must be "
                f"{int(rib.length / (rib.elements * 2.0 * R)) + 1} or more"
            )
        if contact.self and contact.law == "conservative":
            yield "contact.law is 'conservative', which contact.self does not support; use hunt-crossley"
        elif contact.law == "conservative" and self.solver.method == ALPHA:
            yield (
                f"contact.law is 'conservative', which solver.method {ALPHA} does not support; use energy-momentum, "
                f"or contact.law hunt-crossley"
            )
        if isinstance(numbers, tuple) and max(numbers) > rib.elements:
            yield f"damping.elements names element {max(numbers)}, but rib.elements is {rib.elements}"
        if rib.root_friction > 0.0 and self.method not in IMPLICIT:
            yield (
                f"rib.root_friction is given, but solver.method {self.method!r} does not support friction; use "
                f"{ENERGY} or {ALPHA}"
            )

    def _refused_helix(self) -> Iterator[str]:
        rib, hub, drive, rise = self.rib, self.hub, self.drive, self.rise
        half = 0.5 * rib.width * math.cos(self.helix_angle)
        low, high = self.root_height - half, self.root_height + rise + half
        if rise + 2.0 * half > hub.height:
            yield (
                f"rib.pitch is {rib.pitch:g} m, with which the wound rib takes {rise + 2.0 * half:.4g} m of the hub's "
                f"axis, but hub.height is {hub.height:g} m; it must be {self._largest_pitch:.4g} m at most"
            )
        elif low < -0.5 * hub.height * (1.0 + 1e-9) or high > 0.5 * hub.height * (1.0 + 1e-9):
            least, most = -0.5 * hub.height + half, 0.5 * hub.height - rise - half
            yield (
                f"rib.root_height is {self.root_height:g} m, with which the wound rib lies from {low:.4g} to "
                f"{high:.4g} m, beyond the hub's ends at {0.5 * hub.height:g} m; it must be from {least:.4g} to "
                f"{most:.4g} m"
            )
        if rib.pitch == 0.0:
            return
        if self.contact.self and self.turns_overlap:
            yield (
                f"rib.pitch is {rib.pitch:g} m, with which turns overlap in part, which contact.self does not support; "
                f"it must be 0, or {self.clear_pitch:.4g} m or more"
            )
        if drive is None or drive.kind != "hub" or self.phase == "deploy":
            return
        if drive.torque is None:
            yield (
                "drive.torque is missing; with rib.pitch a drive of kind 'hub' needs it, such as '0.2 N m': a hub that "
                "turns against drag alone does not push the rib along its axis"
            )
        if self.damping.elements != "all" and self.damping.alpha > 0.0:
            yield "damping.elements is given, but with rib.pitch a drive of kind 'hub' needs drag on all; leave it out"

    @property
    def method(self) -> str:
        """The time integration; `auto` is generalized-alpha for the paper's laws of contact and damping only."""
        if self.solver.method != "auto":
            return self.solver.method
        paper = self.contact.law == "paper" or (self.damping.kind == "paper" and self.damping.beta > 0.0)
        return ALPHA if paper else ENERGY

    @property
    def contact_spacing(self) -> float:
        """Length of rib between contact points of the contact, m."""
        return self.rib.element_length / self.contact.points

    @property
    def helix_angle(self) -> float:
        """Angle between the wound rib and the plane across the hub's axis, rad."""
        return math.atan(self.rib.pitch / (2.0 * math.pi * self.hub.radius))

    @property
    def rise(self) -> float:
        """Height of the wound rib's tip above its root, m."""
        return self.rib.length * math.sin(self.helix_angle)

    @property
    def root_height(self) -> float:
        """Height of the root above the hub's middle, m."""
        return -0.5 * self.rise if self.rib.root_height == "auto" else float(self.rib.root_height)

    @property
    def turn_distance(self) -> float:
        """Distance of the middles of turns of a helix that lie beside one another, across the rib, m."""
        return self.rib.pitch / self.rib.count * math.cos(self.helix_angle)

    @property
    def turns_overlap(self) -> bool:
        """Whether turns of a helix overlap in part."""
        return 0.0 < self.turn_distance < self.rib.width * (1.0 - 1e-3)

    @property
    def clear_pitch(self) -> float:
        """Pitch with which turns lie beside one another without a gap, m; infinite where ribs are too many."""
        around = self.rib.width * self.rib.count / (2.0 * math.pi * self.hub.radius)
        return math.inf if around >= 1.0 else self.rib.width * self.rib.count / math.sqrt(1.0 - around**2)

    @property
    def _largest_pitch(self) -> float:
        """Pitch of a rib that, wound, takes all of the hub's height, m."""
        # L sin(a) + w cos(a) = H
        L, w, H = self.rib.length, self.rib.width, self.hub.height
        return 2.0 * math.pi * self.hub.radius * math.tan(math.asin(min(H / math.hypot(L, w), 1.0)) - math.atan2(w, L))

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
    def strip(self) -> closed_forms.Strip:
        """What the closed forms take; of a tapered rib, the means over its length.

        Of a helix it is the rib as seen along the hub's axis: the same mass, energy of bending and tension about it.
        """
        rib = self.rib
        ends = (rib.thickness, rib.thickness if rib.tip_thickness is None else rib.tip_thickness)
        area = rib.width * 0.5 * sum(ends)
        # the mean of t^3 over a linear taper is (a + b)(a^2 + b^2)/4
        moment = rib.width * sum(ends) * (ends[0] ** 2 + ends[1] ** 2) / 48.0
        cosine = math.cos(self.helix_angle)
        return closed_forms.Strip(
            radius=self.hub.radius,
            length=rib.length * cosine,
            line_density=rib.density * area / cosine,
            bending_stiffness=rib.young_modulus * moment * cosine**3,
            axial_stiffness=rib.young_modulus * area * cosine,
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
        R, n, spacing = strip.radius, contact.exponent, self.contact_spacing
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
        speed = closed_forms.deployment_speed(strip)
        falls = 0.5 * (n + 1.0) * strip.line_density * spacing * speed**2 / (TIP_FALL * R) ** (n + 1.0)
        return max(held, falls)

    @property
    def penalty(self) -> tuple[float, float]:
        """Stiffness of the penalties of a root under explicit methods: position (N/m) and direction (N m).

        That of a quarter of an element, and a tenth of that of its slopes: about as fast as the element itself.
        """
        EA, length = self.strip.axial_stiffness, self.rib.element_length
        return 4.0 * EA / length, 0.1 * EA * length

    @property
    def contact_frequency(self) -> float:
        """Frequency of a contact point with its share of the mass on the hub, rad/s, at a depth of the thickness."""
        n, mass = self.contact.exponent, self.strip.line_density * self.contact_spacing
        return math.sqrt(n * self.contact_stiffness * self.rib.thickness ** (n - 1.0) / mass)

    @property
    def string(self) -> closed_forms.Winding:
        """A string without bending stiffness under the drive's torque."""
        assert self.drive is not None
        assert self.drive.torque is not None
        return closed_forms.string_winding(
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
                    f"solver.duration is auto, but drive.torque {drive.torque:g} N m does not wind a string without "
                    f"bending stiffness within {motion.time[-1]:.3g} s; give it, such as '60 s', or a greater torque"
                )
            return 1.2 * motion.end_time + drive.ramp
        if drive is not None and drive.rate is not None:
            return 1.2 * turns / abs(drive.rate) + drive.ramp
        return closed_forms.deployment_time(self.strip)
