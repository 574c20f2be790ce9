"""What touches what: beams, rods or shells a surface, bodies one another, turns of beams those on which they lie."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import scipy
from pydantic import ValidationError, field_serializer, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from evolvent.assembly.builder import Builder
from evolvent.families.beams.part import Beam
from evolvent.families.contact.part_beams import add_surface, add_turns
from evolvent.families.contact.part_bodies import add_bodies, add_nodes
from evolvent.families.contact.part_faces import add_faces
from evolvent.families.rods.part import Rod
from evolvent.kernels import contact_laws
from evolvent.model.registry import asked
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Group, Part, PointReference, Reference
from evolvent.parts.shapes import ContactShape, SolidContactShape
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

LAWS = {
    "paper": contact_laws.PAPER,
    "hunt-crossley": contact_laws.HUNT_CROSSLEY,
    "conservative": contact_laws.CONSERVATIVE,
}
#: Default of `sliding_damping`. Vibration of cables that slide round drums, else undamped, grows by 3 1/s at most
#: with it, and by 480 to 930 1/s without.
SLIDING_DAMPING = 0.1
_THICKNESS = units.Quantity(what="a length", unit="m", example="0.3 mm", above=0.0)


class _Touch(NamedTuple):
    """What a contact is between, what writes it, its laws, and the keys that apply beside those of all contacts."""

    what: str
    add: Callable[[Contact, Builder, str], None]
    laws: tuple[str, ...]
    keys: frozenset[str]


_SMOOTH = ("hunt-crossley", "conservative")
_OF_POINTS = frozenset(("shape", "clearance", "skip", "initial_overlap", "sliding_damping"))
_BEAMS = _Touch("beams and a surface", add_surface, tuple(LAWS), _OF_POINTS | {"points"})
_NODES = _Touch("nodes and a surface", add_nodes, _SMOOTH, _OF_POINTS)
_BODIES = _Touch("bodies", add_bodies, _SMOOTH, frozenset(("shape", "shape_a", "rounding", "initial_overlap")))
_FACES = _Touch("shells", add_faces, _SMOOTH, _OF_POINTS - {"shape"} | {"apart"})
_TURNS = _Touch(
    "turns of beams", add_turns, ("hunt-crossley", "paper"),
    frozenset(("points", "around", "axis", "sense", "thickness", "width")),
)  # fmt: skip


def _wrong_unit(key: str, values: Mapping[str, Any], message: str) -> ValidationError:
    """An error of one key of a section, for a validator of all of them."""
    error = PydanticCustomError("contact", "{message}", {"message": message})
    return ValidationError.from_exception_data("Contact", [InitErrorDetails(type=error, loc=(key,), input=values[key])])


class Restitution(Section):
    """Damping of a contact point by the part of the speed that an impact leaves, at one speed before it.

    Parameters
    ----------
    coefficient : float
        Speed after the impact over that before, above 0 and up to 1.
    speed : float, m/s
        Speed before the impact at which it holds. Slower impacts lose a smaller part of it.
    """

    coefficient: units.PositiveFraction
    speed: units.PositiveSpeed

    @property
    def damping(self) -> float:
        """The damping d of Hunt & Crossley's law, s/m.

        Of a point whose motion nothing else changes, v dv = -(K/m) delta^n (1 + d v) d delta, integrated from the speed
        v to -e v at the same depth, gives k (1 + e) = ln((1 + k)/(1 - e k)) with k = d v, for any exponent.
        """
        e = self.coefficient
        near = 1.5 * (1.0 - e) / (1.0 - e + e * e)  # k as e tends to 1
        if e > 1.0 - 1e-6:
            return near / self.speed

        def of(s: float) -> float:  # s = -ln(1 - e k) keeps its digits where e k is near 1
            k = -math.expm1(-s) / e
            return k * (1.0 + e) - math.log1p(k) - s

        s = scipy.optimize.brentq(of, 0.5 * e * near, (1.0 + e) / e, xtol=1e-14)
        return float(-math.expm1(-s) / (e * self.speed))


class Contact(Part):
    """Contact of beams, rods or shells with a surface, of shells, of two bodies, or of turns of beams.

    Two capsules touch at one point, where their axes are closest. This point is not unique where the axes are parallel:
    replace one capsule by spheres along its axis, with a contact for each. A capsule touches a plane at two points, its
    ends. A box touches a plane with its eight corners, a sphere and the ends of a capsule with its faces, edges and
    corners, the side of a capsule with its edges, and another box with corners on faces and edges that cross; the
    `stiffness` is that of each of these points. Edges of two boxes that are within 10 degrees of parallel do not touch
    one another.

    Shells touch with both faces, by their nodes. What is narrower than an element, and corners and edges of boxes, pass
    between nodes: elements must be smaller than what they touch.

    Of two shells, and of a shell with itself, the nodes of each touch the other's surface, smooth over its elements,
    with half of the stiffness; `stiffness` is that of the whole of `a`. They need an implicit method or statics.

    Turns of a beam that is wound round a body lie on turns of the same beam, or of a neighbour. They need an implicit
    method or statics. Under `generalized-alpha` a point that moves past the end of the beam below gains or loses the
    energy of its contact, and a step with k points that touch costs of the order of k^2 times the number of elements
    more. Under `energy-momentum` it never gains energy there, and a step costs a few times as much.

    Parameters
    ----------
    a : beams, rods, shells or a point of a body
        What touches `b`: a beam or a list of beams, by their contact points; a rod or a list of rods, by their nodes
        but the root; a shell or a list of shells, by spheres of its thickness at their nodes; or a body, by its
        `shape_a` centred at a point such as "ball", "arm.tip" or ("arm", (0, 0, 1)).
        Of turns, the beam whose contact points are pushed out.
    b : point, a shell, or a beam
        Centre of `shape`, or a point of the plane: a point of a body, or a position on the ground. A shell is touched
        by the shells `a`, or by itself, on both faces. A beam means turns of `a` that lie on turns of it: `a` itself,
        or, of several beams hinged round a body, the next one in the sense of winding.
    shape : sphere, capsule, cylinder, plane or box, optional
        Shape at `b`, along the axes of its body; the `shape` of this body if left out. Beams, rods and shells touch
        spheres, capsules, cylinders (of rods and shells, without a length) and planes, rods and shells also boxes;
        bodies touch spheres, capsules, planes and boxes.
    shape_a : sphere, capsule or box, optional
        Shape of a body at `a`, likewise. A box needs a plane or a box as `shape`.
    law : {"hunt-crossley", "conservative", "paper"}
        Law of the normal force against the depth: hunt-crossley damps in proportion to the elastic force, paper by
        a damper beside it; conservative, of energy-momentum, gives back over a step all of the energy that it stores.
        All but energy-momentum take hunt-crossley in its place. Bodies and rods do not support paper, nor turns
        conservative.
    stiffness : float, N/m^n
        Of each contact point; of a shell that of all of its nodes together, each of which has the share of its area, as
        of the bristles' stiffness and damping.
    exponent : float
        Power n of the depth.
    damping : float, s/m (N s/m of the law paper)
        Of the normal force.
    restitution : mapping, optional
        In place of `damping`: {coefficient, speed}, the speed after an impact of a contact point over that before, and
        the speed at which it holds.
    friction : float
        Coefficient of friction.
    bristle_stiffness, bristle_damping : float, N/m and N s/m
        Of the tangential spring of a contact point that sticks.
    clearance : float, m
        Distance of the axes of beams and rods from the surface at which they touch it: half their thickness, above 0 of
        a plane. Of shells beyond half their thickness, which is 0 of a wall by its stiffness matrix.
    points : int
        Contact points of an element of a beam, evenly spaced, its second node included.
    skip : int
        Contact points next to the root that are left out (where the root itself is joined to the surface); of shells
        the first nodes.
    initial_overlap : float, optional
        Depth up to which what touches may overlap at the start: of beams and rods in radii of `shape` with the
        clearance (of a plane, clearances), 0.001 if left out; of shells in halves of their thickness, of bodies in
        radii of `shape_a` (of a box, half its smallest side), 0.1 if left out.
    sliding_damping : float
        Share of critical damping, of the mass of a contact point of a beam, rod or shell on its stiffness, by which its
        normal motion is damped where it has friction: without any, a beam that slides vibrates at the frequency of its
        contact points.
    rounding : float, m, optional
        Radius of the edges and corners of boxes, within their size. Left out, a tenth of the smallest side between two
        boxes, which need one, else 0. Edges of two boxes are not seen deeper than both radii.
    around : point of a body, optional
        Of turns: a point on the axis that they are wound round.
    axis : (3,) float
        Axis of the turns, body axes.
    sense : {1, -1}
        Of winding about the axis.
    thickness : float or one of each element, m, optional
        Of both beams across their flat side: the distance of touching axes of turns.
    width : float, m, optional
        Of the beams along the axis, beyond which turns lie side by side; without limit if left out.
    apart : float, m, optional
        Of shells, distance of a node from a face without stress within which they do not touch: of a shell and itself
        along the surface, two longest sides of elements and four thicknesses if left out; of two shells in space, 0 if
        left out: of walls that are joined, how far from the seam they part.
    """

    applies: ClassVar[Applies] = {
        "bristle_stiffness": (given("friction"),),
        "bristle_damping": (given("friction"),),
        "shape": (left_out("around"),),
        "shape_a": (left_out("around"),),
        "clearance": (left_out("around", "shape_a"),),
        "points": (left_out("shape_a"),),
        "skip": (left_out("around", "shape_a"),),
        "initial_overlap": (left_out("around"),),
        "sliding_damping": (given("friction"), left_out("around", "shape_a")),
        "rounding": (left_out("around"),),
        **{key: (given("around"),) for key in ("axis", "sense", "thickness", "width")},
    }
    kind: Literal["contact"] = "contact"
    group = Group.CONTACT
    symbol = "cylinder"
    a: Annotated[
        tuple[str | tuple[str, units.Triple] | units.Triple, ...],
        Reference(what="beams, rods, shells or a point of a body", points=True, several=True, alone=True),
    ]
    b: PointReference
    law: Literal["hunt-crossley", "conservative", "paper"] = "hunt-crossley"
    stiffness: units.ContactStiffness = 1e4
    exponent: units.Exponent = 1.0
    damping: units.ContactDampingOrZero = 0.0
    restitution: Restitution | None = None
    friction: units.NumberOrZero = 0.0
    bristle_stiffness: units.StiffnessOrZero = 1e3
    bristle_damping: units.DampingOrZero = 0.0
    shape: ContactShape | None = None
    shape_a: SolidContactShape | None = None
    clearance: units.LengthOrZero = 0.0
    points: Annotated[int, units.Whole(least=1, most=1000)] = 2
    skip: Annotated[int, units.Whole(least=0, most=100_000)] = 0
    initial_overlap: units.NumberOrZero | None = None
    sliding_damping: units.Fraction = SLIDING_DAMPING
    rounding: units.LengthOrZero | None = None
    around: PointReference | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)
    sense: Literal[1, -1] = 1
    thickness: (
        Annotated[float | tuple[float, ...], units.OneOrMore(quantity=_THICKNESS, each="one of each element")] | None
    ) = None
    width: units.Length | None = None
    apart: units.Length | None = None

    @model_validator(mode="before")
    @classmethod
    def _check_units(cls, values: Any) -> Any:
        """Refuse units that belong to another exponent or law."""
        if not isinstance(values, Mapping):
            return values
        power = re.search(r"N/m(?:\^(\d+(?:\.\d+)?))?\s*$", str(values.get("stiffness", "")))
        exponent = str(values.get("exponent", cls.model_fields["exponent"].default)).strip()
        if power is not None and re.fullmatch(r"\d+\.?\d*", exponent) and float(power[1] or 1) != float(exponent):
            wanted = "N/m" if float(exponent) == 1.0 else f"N/m^{float(exponent):g}"
            raise _wrong_unit("stiffness", values, f"with an exponent of {float(exponent):g} it is in {wanted}")
        damping, paper = str(values.get("damping", "")), values.get("law") == "paper"
        newtons = re.search(r"N s/m\s*$", damping) is not None
        if re.search(r"[a-z]", damping) and newtons != paper and damping.rstrip().endswith("s/m"):
            law = values.get("law", cls.model_fields["law"].default)
            raise _wrong_unit("damping", values, f"of the law {law!r} it is in {'N s/m' if paper else 's/m'}")
        return values

    @field_serializer("stiffness", when_used="json")
    def _write_stiffness(self, value: float) -> str:
        return f"{value!r} N/m" if self.exponent == 1.0 else f"{value!r} N/m^{self.exponent!r}"

    @field_serializer("damping", when_used="json")
    def _write_damping(self, value: float) -> str:
        return f"{value!r} N s/m" if self.law == "paper" else f"{value!r} s/m"

    def refined(self, name: str, parts: Mapping[str, Part]) -> Part:
        """Refused of beams and rods: finer ones have more contact points, and the stiffness is that of a point.

        Points of shells have shares of the whole stiffness.
        """
        if self.skip or any(isinstance(parts.get(one), (Beam, Rod)) for one in self.a if isinstance(one, str)):
            counts = "`skip` counts contact points" if self.skip else "stiffness is that of a contact point"
            raise InputError(
                f"an estimate of the mesh error does not support {name!r}, whose {counts}: elements of half the length "
                f"have others; compare with a case of more elements"
            )
        return self

    def law_fields(self, weight: float = 1.0) -> dict[str, Any]:
        """Fields of the law in the model, of a contact point with a share of the stiffness."""
        shared = {key: weight * getattr(self, key) for key in ("stiffness", "bristle_stiffness", "bristle_damping")}
        return {
            "law": LAWS[self.law],
            **shared,
            **{key: getattr(self, key) for key in ("exponent", "friction")},
            "damping": self.damping if self.restitution is None else self.restitution.damping,
        }

    def viscosity(self, mass: float) -> float:
        """`viscous` of `contact_laws.sliding_damper`, kg^(1/2), of a point with a mass in kg; 0 without friction."""
        return float(contact_laws.sliding_viscosity(self.sliding_damping, mass)) if self.friction > 0.0 else 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the contact points, and the surface or the turns that they touch."""
        touch = self._touch(builder, name)
        if self.law not in touch.laws:
            known = " or ".join(map(repr, touch.laws))
            raise InputError(
                f"{name}.law is {self.law!r}, which a contact of {touch.what} does not support; use {known}"
            )
        if self.restitution is not None and "damping" in self.model_fields_set:
            raise InputError(f"{name}.damping is given beside {name}.restitution, which is in its place; leave one out")
        if self.restitution is not None and self.law == "paper":
            raise InputError(
                f"{name}.restitution is given, but {name}.law is 'paper', whose damping it does not follow; use "
                f"'hunt-crossley' or 'conservative', or give {name}.damping"
            )
        of_others = (_BEAMS.keys | _BODIES.keys | _FACES.keys | _TURNS.keys) - touch.keys
        for key in sorted(self.model_fields_set & of_others):
            if getattr(self, key) is not None:
                raise InputError(
                    f"{name}.{key} is given, which has no meaning in a contact of {touch.what}; leave it out"
                )
        touch.add(self, builder, name)

    def _touch(self, builder: Builder, name: str) -> _Touch:
        """What the contact is between."""

        def family(where: Any) -> str:
            return builder.names.get(where, ("", 0))[0] if isinstance(where, str) else ""

        found = [family(one) for one in self.a]
        if len(set(self.a)) < len(self.a):
            again = next(one for k, one in enumerate(self.a) if one in self.a[:k])
            raise InputError(f"{name}.a names {again!r} twice; name it once")
        if family(self.b) == "beams":
            if found != ["beams"]:
                raise InputError(
                    f"{name}.b is the beam {self.b!r}, on whose turns only a beam can lie; give one as {name}.a"
                )
            return _TURNS
        touching, with_faces = asked("parts.touches"), asked("parts.faces")
        if family(self.b) in with_faces and all(of in with_faces for of in found):
            return _FACES
        if family(self.b) in touching and any(of in touching or of == "beams" for of in found):
            kind = builder.specs[str(self.b)].kind
            one = next(one for one, of in zip(self.a, found, strict=True) if of in touching or of == "beams")
            raise InputError(
                f"{name}.b is the {kind} {self.b!r}; contact of a {kind} with {one!r} is not implemented: of parts "
                f"with nodes only shells touch shells, else give a point of a body"
            )
        if family(self.b) in with_faces:
            kind = builder.specs[str(self.b)].kind
            raise InputError(
                f"{name}.b is the {kind} {self.b!r}, which {self.a[0]!r} cannot touch; give the {kind} as {name}.a, "
                f"and as {name}.b a body with {name}.shape"
            )
        other = next((one for one, of in zip(self.a, found, strict=True) if of != "beams" and of not in touching), None)
        if other is not None:
            builder.location(other, f"{name}.a")
            if len(self.a) > 1:
                raise InputError(
                    f"{name}.a is a list that holds {other!r}, which has no contact points of its own; give each its "
                    f"own contact"
                )
            return _BODIES
        if len(set(found)) > 1:
            one, other = (self.a[found.index(of)] for of in sorted(set(found), reverse=True)[:2])
            kind = builder.specs[str(one)].kind
            raise InputError(
                f"{name}.a holds the {kind} {one!r} and {other!r}, which is no {kind}; give each its own contact"
            )
        return _BEAMS if found[0] == "beams" else _NODES
