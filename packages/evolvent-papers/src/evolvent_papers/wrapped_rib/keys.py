"""The keys of the wrapped rib's case, section by section."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from evolvent.elements import Material, Rectangle, Taper
from evolvent.parts.curve import AnyCurve
from evolvent_base import units
from evolvent_base.schema import Section

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


RootRest = Annotated[float | str, units.Quantity(what="an angle", unit="rad", example="90 deg", auto=True)]


Points = Annotated[int, units.Whole(least=1, most=64)]


#: Strain at the root from which on a case is refused.
STRAIN_REFUSED = 0.5


#: Depths, in radii of the hub, to which a wound rib and a piece of it that falls on the hub sink in at most; the
#: automatic stiffness of the contact follows from them.
SINKS, TIP_FALL = 1e-4, 1e-3


#: Keys of the hinge at the root, and the greatest angle at which it can lock, where a wound rib starts, rad.
HINGE = (
    "root_stiffness", "root_rest", "root_damping", "root_friction", "root_latch", "root_latch_stiffness",
    "root_latch_damping",
)  # fmt: skip


LATCHES = 0.5 * math.pi


#: Most elements of a rib.
MOST_ELEMENTS = 10_000


#: Kinds of drive in each phase, motions of the hub with each kind, and keys of a drive that a kind needs and refuses.
KINDS = {"wind": ("torque", "hub", "tip"), "hold": ("torque", "hub"), "deploy": ("none", "hub")}


MOTIONS = dict.fromkeys(("none", "torque"), ("fixed", "free", "spin")) | {"hub": ("driven",), "tip": ("fixed",)}


NEEDED = {"torque": {"torque": "0.2 N m"}, "hub": {"rate": "0.1 rad/s"}, "tip": {"rate": "0.1 rad/s"}}


REFUSED = {"torque": ("rate", "stretch"), "hub": ("stretch",), "tip": ("torque",)}


ElementNumber = Annotated[int, units.Whole(least=1, most=MOST_ELEMENTS)]


def key(default: Any, text: str) -> Any:
    """A key with its default (... for none) and what it is."""
    return Field(default, description=text)


class Rib(Section):
    """Every rib: a thin strip, straight at rest or of a `shape`, that winds with its flat side on the hub."""

    formulation: Literal["cable", "cable_stretch", "assumed_strain", "elastic_line", "nu_split", "full"] = key(
        "cable",
        "of the elements: cable (position and slope), cable_stretch (engineering strain, for more than 1 % of it), "
        "assumed_strain (the beam that does not lock), or beams that lock: elastic_line, nu_split, full (the paper's)",
    )
    elements: Annotated[int, units.Whole(least=1, most=MOST_ELEMENTS)] = key(40, "elements of equal length")
    length: units.Length = key(12.0, "from root to tip")
    width: units.Length = key(0.03, "along the hub's axis")
    thickness: units.Length = key(0.0003, "across the flat side, at the root")
    tip_thickness: units.Length | None = key(None, "at the tip, of a linear taper; left out: the same")
    density: units.Density = key(1600.0, "mass per volume")
    young_modulus: units.Modulus = key(5e6, "E")
    poisson: units.PoissonRatio = key(0.3, "nu, above -1 and up to 0.5; a cable does not use it")
    count: Points = key(1, "ribs, evenly spaced round the hub")
    root: Literal["hinge", "clamp"] = key("hinge", "hinge: turns about the hub's axis; clamp: keeps its direction")
    root_stiffness: units.RotationalStiffnessOrZero = key(0.0, "of a spring in the hinge")
    root_rest: RootRest = key(
        "auto",
        "direction of the root without moment of its spring, from outwards in the winding sense; auto: the start",
    )
    root_damping: units.RotationalDampingOrZero = key(0.0, "of a damper in the hinge")
    root_friction: units.TorqueOrZero = key(0.0, "torque of Coulomb friction in the hinge, which sticks below it")
    root_latch: units.Angle | None = key(
        None, "direction, from outwards in the winding sense, in which the hinge of a rib that deploys locks for good"
    )
    root_latch_stiffness: units.RotationalStiffnessOrZero = key(0.0, "of the latch")
    root_latch_damping: units.RotationalDampingOrZero = key(0.0, "of the latch")
    pitch: units.LengthOrZero = key(
        0.0, "advance along the hub's axis in one turn, of a rib wound as a helix; 0: turns on one another"
    )
    root_height: Height = key(
        "auto", "of the root above the hub's middle; auto: a helix lies evenly about the middle, other ribs in it"
    )
    start_angle: units.Angle = key(0.0, "of the straight rib from outwards, in the winding sense; not of a carried tip")
    shape: AnyCurve | None = key(
        None,
        "stress-free shape of a deployed rib that is curved in the winding sense, such as {parabola: {focal_length: "
        "2 m}}; with formulation assumed_strain; left out: straight",
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
        yield from self._refused_hinge()
        if self.shape is not None and self.vectors == 2:
            yield (
                f"rib.shape is given and rib.formulation is {self.formulation!r}; a cable is straight at rest, use "
                f"assumed_strain"
            )
        if self.shape is not None and self.pitch > 0.0:
            yield "rib.shape and rib.pitch are both given; a curved rib is wound in its plane, leave one of them out"

    def _refused_hinge(self) -> Iterator[str]:
        for key in HINGE:
            if self.root == "clamp" and getattr(self, key) != type(self).model_fields[key].default:
                yield f"rib.{key} is given, but rib.root is 'clamp', which does not turn; use a hinge"
        if self.root_rest != "auto" and self.root_stiffness == 0.0:
            yield "rib.root_rest is given, but rib.root_stiffness is 0; the hinge has no spring, give its stiffness"
        for key in ("root_latch_stiffness", "root_latch_damping"):
            if self.root_latch is None and getattr(self, key) > 0.0:
                yield f"rib.{key} is given without rib.root_latch; give the direction in which the hinge locks"
        if self.root_latch is None:
            return
        degrees = f"rib.root_latch is {math.degrees(self.root_latch):.4g} deg"
        if self.root_latch_stiffness == 0.0:
            yield f"{degrees}, but rib.root_latch_stiffness is 0; a latch needs one, such as '1 N m/rad'"
        if not -LATCHES - 1e-9 < self.root_latch < LATCHES * (1.0 - 1e-3):
            yield (
                f"{degrees}; the root of a wound rib starts at 90 deg, along the hub, and opens to smaller angles: it "
                f"must be from -90 to below 90 deg, such as '0 deg', outwards"
            )

    @property
    def curvatures(self) -> tuple[float, float]:
        """Least and largest curvature of the stress-free shape in the winding sense, 1/m."""
        if self.shape is None:
            return 0.0, 0.0
        found = self.shape.curvature(np.linspace(0.0, self.length, 1001))
        return float(found.min()), float(found.max())

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
        return Material(young_modulus=self.young_modulus, poisson_ratio=self.poisson, density=self.density)

    @property
    def profile(self) -> CrossSection:
        """Section of the whole rib."""
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

    radius: units.Length = key(0.6, "of the surface that the ribs wind on")
    height: units.Length = key(3.0, "along its axis")
    motion: Literal["fixed", "free", "spin", "driven"] = key(
        "fixed", "spin: free about its axis; driven: turned about it"
    )
    mass: units.Mass | None = key(None, "without the ribs; motion: free needs it, or density")
    inertia: units.Inertias | None = key(
        None, "about every axis, or principal moments; free, left out: of a uniform hub"
    )
    density: units.Density | None = key(None, "of the hub's material, in place of mass and inertia")
    wall: units.Length | None = key(None, "thickness of the wall of a hollow hub without ends; left out: solid")

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

    kind: Literal["torque", "hub", "tip"] = key(
        "torque", "torque: spread over the rib, about the hub's axis; hub: the hub turns; tip: the tip is carried round"
    )
    torque: Torque | None = key(None, "on each rib; of kind hub what holds it back, optional")
    rate: units.AngularRate | None = key(None, "of kinds hub and tip; negative unwinds, in phase deploy")
    ramp: units.DurationOrZero = key(0.0, "time in which the torque or rate is smoothly reached")
    stretch: Strain = key(1e-3, "strain with which a carried tip holds the rib taut, of kind tip")

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

    time: units.Duration = key(60.0, "that it is held")


class Damping(Section):
    """Damping of the rib's material and of its motion through space (Rayleigh)."""

    alpha: units.RateOrZero = key(0.2, "times the mass: drag on every motion in inertial space")
    beta: units.DurationOrZero = key(0.0, "times the stiffness")
    kind: Literal["objective", "paper"] = key("objective", "of beta: on rates of strain; paper: on rotation as well")
    elements: Literal["all", "first"] | tuple[ElementNumber, ...] = key("all", "damped: all, first, or numbers from 1")

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

    law: Literal["paper", "hunt-crossley", "conservative"] = key(
        "hunt-crossley", "hunt-crossley: K d^n (1 + a d'), never pulling; paper: K d^n + c d'; conservative: K d^n"
    )
    stiffness: Stiffness = key(
        "auto", "K, of each contact point, per m^(n-1); auto: depths of 1e-4 (wound) and 1e-3 (falling) of the radius"
    )
    exponent: units.Exponent = key(1.0, "n")
    damping: units.DampingOrZero = key(1e3, "c, of law paper")
    dissipation: units.ContactDampingOrZero = key(0.5, "a, of law hunt-crossley")
    points: Points = key(4, "contact points in each element")
    friction: units.NumberOrZero = key(0.0, "mu, Coulomb friction with the hub, and between turns")
    self: bool = key(False, "whether turns touch and lie on one another; takes several times as long")


class Solver(Section):
    """The time integration."""

    method: Literal["auto", "energy-momentum", "generalized-alpha", "rk4", "heun"] = key(
        "auto", "auto: energy-momentum, which gains no energy at any step; with the paper's damping generalized-alpha"
    )
    duration: units.DurationOrAuto = key(
        "auto", "auto: wind: 1.2 times as long as a string takes; hold: hold.time; deploy: the closed form's end"
    )
    step: units.DurationOrAuto = key("auto", "auto: adaptive, or a safe share of the stability limit")
    tolerance: units.Tolerance = key(3e-4, "relative error of an adaptive step")
    spectral_radius: units.Fraction | None = key(
        None, "of implicit methods: 1 keeps high frequencies, 0 damps them; left out: 0.3, of energy-momentum 1/3"
    )

    def refusals(self) -> Iterator[str]:
        """Rules between the keys."""
        if self.step != "auto" and self.duration != "auto" and float(self.step) > float(self.duration):
            yield f"solver.step is {self.step:g} s, more than solver.duration {self.duration:g} s"


class Output(Section):
    """What is kept."""

    every: units.Duration = key(0.5, "time between samples")
    fine: bool = key(True, "whether finer samples are kept where the motion is fast")
    points: Points = key(4, "of each element at which shape and curvature are drawn")
