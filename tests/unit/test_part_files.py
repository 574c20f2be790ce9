"""Parts as a case file holds them: the same keys, units and refusals as in Python; every part there and back."""

from __future__ import annotations

import importlib
import json
import math
import pkgutil
import re
from typing import Any, Literal

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter, ValidationError

import evolvent as ev
from evolvent import cases, parts
from evolvent.analysis.system import System
from evolvent.model import registry as family_registry
from evolvent.parts import registry
from evolvent.parts.base import Part, kind_of
from evolvent.parts.registry import PartsByName, kinds, read_parts
from evolvent_base import plugins, schema
from evolvent_base.errors import InputError
from evolvent_base.schema import Section, descriptions

TUBE = ev.Tube(radius="1 cm", thickness="0.3 mm")
NODES = parts.Beam(length=1.0, section=TUBE, material=ev.CFRP, elements=2).start_nodes() + 1.0 / 3.0
EVERY: dict[str, Part] = {
    "point": parts.Point(mass="0.1 g", position=(0.1, 0.2, 0.3), velocity=(0.0, 1e-9, 0.0)),
    "fixed point": parts.Point(mass=0.1, at=("hub", (0.1, 0.2, 0.3))),
    "body": parts.RigidBody(
        mass=20.0,
        inertia=(1.2, 1.3, 2.0),
        position=(1.0, 2.0, 3.0),
        orientation=(0.5, 0.5, 0.5, 0.5),
        points={"left": (-0.5, 0.0, 0.0), "far right": (0.7, 0.0, 0.1)},
    ),
    "body with a tensor": parts.RigidBody(mass=1.0, inertia=((1.0, 0.1, 0.0), (0.1, 1.2, 0.0), (0.0, 0.0, 1.3))),
    "box": parts.RigidBody(shape=parts.Box(size=(0.1, 0.2, 0.3)), density="2700 kg/m^3"),
    "cylinder": parts.RigidBody(shape=parts.Cylinder(radius=0.3, length=1.0, axis=(1.0, 0.0, 0.0)), mass=3.0),
    "sphere": parts.RigidBody(motion="spin", shape={"sphere": 0.1}, mass=0.3, rate="10 rpm"),
    "beam": parts.Beam(
        position=(0.2, 0.0, 0.0), direction=(0.0, 1.0, 0.0), length=3.0, section=TUBE, material=ev.CFRP, elements=12
    ),
    "beam that starts bent": parts.Beam(
        length=1.0,
        section=ev.Circle(radius=0.01),
        material="kapton",
        elements=2,
        nodes=NODES,
        rates=0.1 * NODES,
        rest="start",
        damped=(0, 1),
        stiffness_damping=1e-3,
    ),
    "thermal load": parts.ThermalLoad(
        part="boom",
        temperature={"ramp": {"final": 40.0, "duration": 60.0}},
        gradient_y={"constant": 200.0},
        along=((0.0, 0.5), (1.0, 1.0)),
    ),
    "graded beam with inertia": parts.Beam(
        length=1.0,
        section=ev.Angle(height=0.04, width=0.03, thickness=0.003),
        material="cfrp-ud",
        inertia=ev.SectionInertia(mass_per_length="0.3 kg/m", inertia_y=1e-5, offset=(0.0, "2 mm")),
        elements=3,
        grading=(1.0, 2.0, 3.0),
    ),
    "curved beam": parts.Beam(
        length=1.0,
        section=ev.Arc(radius=0.02, angle="80 deg", thickness=1e-4),
        material=ev.Material(young_modulus=1e9, density=1e3, shear="0.1 GPa", thermal_expansion="2e-5 1/K"),
        elements=3,
        grading=2.0,
        curvature=(0.0, 0.1, "0.5 1/m"),
    ),
    "tapered general section": parts.Beam(
        length=1.0,
        section=ev.Taper(
            root=ev.General(area=1e-4, Iy=1e-9, Iz=2e-9, J=1e-9, Iyz=-1e-10, shear_centre=(0.0, "1 mm")),
            tip=ev.General(area=1e-4, Iy=1e-9, Iz=2e-9, J=1e-9),
        ),
        material="invar",
        elements=3,
    ),
    "I-beam": parts.Beam(
        length=1.0, section=ev.IBeam(height=0.1, width=0.05, web=0.004, flange=0.006), material="steel", elements=3
    ),
    "body on a node": parts.RigidBody(mass=1.0, inertia=0.1, at="boom[2]", position=(0.0, 0.1, 0.0)),
    "clamp of all coordinates": parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp", hold="all"),
    "tapered beam": parts.Beam(
        length=1.0,
        section=ev.Taper(root=ev.Rectangle(thickness=0.1, width=0.2), tip=ev.Rectangle(thickness=0.1, width=0.1)),
        material=ev.Material(young_modulus="70 GPa", density=1600.0),
        elements=3,
        formulation="cable",
    ),
    "general beam": parts.Beam(
        length=1.0, section=ev.General(area=1e-4, Iy=1e-9, Iz=2e-9, J=3e-9), material=ev.STEEL, elements=1
    ),
    "joint": parts.Joint(a="hub", b="boom.root", type="clamp"),
    "revolute": parts.Joint(
        a=("hub", (0.1, 0.0, 0.0)),
        b=(0.3, 0.0, 0.1),
        type="revolute",
        axis=(0.0, 1.0, 1.0),
        stiffness=1e4,
        rotational_stiffness=20.0,
        until=3.0,
    ),
    "joint of bodies": parts.Joint(a="hub", b="panel", position=(1.0, 0.0, 0.0)),
    "link": parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link", length=2.0, drum=0.1, sense=-1),
    "spring": parts.Spring(a=(0.0, 0.0, 0.1), b="hub.left", stiffness=3.0, damping=0.1, length=0.0),
    "guide": parts.Joint(a="ground", b="hub", type="guide", axis=(1.0, 0.0, 0.0), axis_b=(0.0, 1.0, 0.0)),
    "rotational spring": parts.JointSpring(
        a="hub", b="boom.root", stiffness=0.5, low="-10 deg", high=0.3, stop=9.0, latch=0.2, latch_stiffness=7.0
    ),
    "spring of a joint": parts.JointSpring(joint="pin", stiffness=0.5, friction="0.1 N m", bristle_stiffness=900.0),
    "translational spring": parts.JointSpring(
        a="hub",
        b=("panel", (0.1, 0.0, 0.0)),
        axis=(0.0, 0.0, 1.0),
        motion="translation",
        start="1 mm",
        friction=0.2,
        low=-0.1,
        stop=1e4,
    ),
    "synchronization": parts.Joint(
        type="synchronization", joints=["one", "two"], ratios=(2.0, -1.0), stiffness="20 N m/rad"
    ),
    "bearing": parts.Bearing(
        joint="pin",
        coefficient=0.1,
        static_coefficient=0.2,
        journal_radius="5 mm",
        thrust_radius=8e-3,
        span="3 cm",
        preload="2 N",
        bristle_stiffness="40 N m/rad",
    ),
    "motor": parts.Motor(joint="pin", torque=[[0.0, 0.0], [1.0, 0.3]], limit=0.2),
    "motor that follows": parts.Motor(
        joint="pin", motion=parts.RampDrive(rate=0.0, steps=[(1.0, 2.0, 0.1)]), position_gain=3.0, velocity_gain=2.0
    ),
    "electric motor": parts.Motor(
        joint="pin",
        voltage={"constant": "28 V"},
        torque_constant="0.05 N m/A",
        resistance="12 ohm",
        ratio=100.0,
        detent_torque=3e-3,
        detents=24,
        hysteresis_torque=1e-3,
        eddy_damping=1e-6,
        efficiency=0.7,
        back_efficiency=0.0,
        holding_torque="2 N m",
        bristle_stiffness="3e4 N m/rad",
    ),
    "harness": parts.Resistance(
        joint="pin",
        type="harness",
        torque=[[0, 0], ["30 deg", "0.1 N m"]],
        bristles=[[2.0, "0.1 N m"]],
        law="dahl",
        set=0.1,
        relaxed_at=0.2,
    ),
    "harness by a loop": parts.Resistance(
        joint="pin", type="harness", loop=[[0.0, 0.0], [1.0, 1.0], [0.0, -0.1], [0.0, 0.0]], misfit=0.2
    ),
    "tape-spring hinge": parts.Resistance(
        joint="pin",
        type="tape-spring",
        straight=[[-0.1, -2.0], [0.1, 2.0]],
        folded=[[0.05, 0.2], ["3 rad", "0.2 N m"]],
        state="straight",
    ),
    "adhesion": parts.Resistance(joint="pin", type="adhesion", strength="0.4 N m", distance="0.1 deg"),
    "cylinder contact": parts.Contact(
        a=["boom", "other"], b="hub", shape=parts.Cylinder(radius=0.3), stiffness="1e6 N/m^1.5", exponent=1.5
    ),
    "sphere contact": parts.Contact(a="boom", b="hub", shape=parts.Sphere(radius=0.3), stiffness=1e6, damping=0.1),
    "capsule contact": parts.Contact(
        a="boom", b="hub", shape=parts.Capsule(radius=0.3, length=1.0, axis=(1.0, 0.0, 0.0)), stiffness=1e6
    ),
    "plane contact": parts.Contact(
        a="boom", b="ground", shape=parts.Plane(normal=(0.0, 0.0, 1.0), size=2.0), clearance=0.1, stiffness=1e6
    ),
    "contact of the paper": parts.Contact(
        a="boom", b="ground", shape=parts.Cylinder(radius=0.3, length=2.0), law="paper", damping="0.1 N s/m"
    ),
    "contact of turns": parts.Contact(a="boom", b="other", around="hub", thickness=(1e-3, 2e-3), width=0.01),
    "tether": parts.Thread(reel="reel", length=5.0, line_density=7e-4, end=("hub", (0.1, 0.0, 0.2)), thickness="50 um"),
    "reaction wheel": parts.ReactionWheel(
        body="hub", inertia=0.05, rate="100 rpm", torque_limit=0.1, friction_torque=1e-3
    ),
    "thruster": parts.Thruster(at="hub.left", direction=(0.0, 1.0, 0.0), thrust="1 N"),
    "attitude controller": parts.AttitudeController(
        body="hub", actuators=["one", "two"], proportional=2.0, derivative=(1.0, 2.0, 0.0), target=(0.8, 0.0, 0.0, 0.6)
    ),
    "thread": parts.Thread(
        reel="reel", length=5.0, line_density=7e-4, nodes=4, direction=(1.0, 0.1, 0.0), separates=True
    ),
}


@pytest.mark.parametrize("part", EVERY.values(), ids=EVERY.keys())
def test_a_part_in_a_file_is_the_same_part(part: Part) -> None:
    """Also through the text of the file; all numbers are exact."""
    keys = part.as_keys()
    text = yaml.safe_dump({"it": keys})
    assert read_parts(yaml.safe_load(text))["it"] == part
    assert read_parts(json.loads(json.dumps({"it": keys})))["it"] == part
    assert part.replaced() == part
    given = part.model_dump(mode="json", exclude_defaults=True)
    assert type(part)(**given) == part


def test_every_kind_is_tried_above() -> None:
    """All but those that hold a drive, a law or a load, which have tests of their own."""
    tried = {type(part) for part in EVERY.values()}
    own = {"beam", "joint", "joint_spring", "reel", "spring", "thread", "point", "rigid_body"}
    own |= {"contact", "motor", "attitude", "resistance"}
    there = {part for part in kinds().values() if part.__module__.rpartition(".")[2] in own}
    assert there - tried == {parts.Reel} & there


def test_sources_declare_all_parts() -> None:
    """The search of the sources finds the same classes as imports: parts with a kind, and sections in `__all__`."""
    shared = [importlib.import_module(f"{parts.__name__}.{one.name}") for one in pkgutil.iter_modules(parts.__path__)]
    found: dict[str, type] = {}
    for module in (*shared, *family_registry.beside("part")):
        own = {name: one for name, one in vars(module).items() if getattr(one, "__module__", "") == module.__name__}
        sections = {name: one for name, one in own.items() if isinstance(one, type) and issubclass(one, Section)}
        named = {name for name in getattr(module, "__all__", ()) if not issubclass(sections.get(name, Part), Part)}
        found |= {name: one for name, one in sections.items() if kind_of(one) or name in named}
    assert parts.__all__ == sorted(found) == dir(parts)
    assert all(getattr(parts, name) is value for name, value in found.items())
    assert {one.kind for one in parts.definitions().values()} - {""} == {kind_of(one) for one in found.values()} - {""}
    assert not hasattr(parts, "Reference")  # in the `__all__` of its module, but not a section


def test_parts_are_found_without_their_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a distribution that has compiled modules alone."""
    found = dict(parts.definitions())

    def missing(*_: str) -> None:
        raise FileNotFoundError

    monkeypatch.setattr(family_registry.pkgutil, "get_data", missing)
    assert parts.definitions.__wrapped__() == found


def test_names_for_users_may_stand_below_their_classes() -> None:
    assert parts._declared_kinds('class Ring(Section):\n    pass\n__all__ = ["Ring"]\n') == {"Ring": ""}


def test_a_body_written_by_hand() -> None:
    """A list has its unit once, in its last entry; short forms of shapes and sections."""
    found = read_parts(
        yaml.safe_load(
            """
            hub: {kind: rigid-body, mass: 20 kg, inertia: [1.2, 1.2, 2 kg m^2], shape: {box: [60, 60, 80 cm]},
                  points: {left: [-50, 0, 0 cm]}}
            boom: {kind: beam, position: [0.2, 0, 0 m], length: 3 m, section: {tube: {radius: 1 cm, thickness: 0.3 mm}},
                   material: cfrp, elements: 12}
            root: {kind: joint, a: hub, b: boom.root, type: clamp}
            """
        )
    )
    hub = parts.RigidBody(
        mass=20.0, inertia=(1.2, 1.2, 2.0), shape=parts.Box(size=(0.6, 0.6, 0.8)), points={"left": (-0.5, 0.0, 0.0)}
    )
    assert found["hub"] == hub
    assert found["boom"] == parts.Beam(position=(0.2, 0, 0), length=3.0, section=TUBE, material=ev.CFRP, elements=12)
    system = System()
    for name in ("root", "boom", "hub"):
        system.add(found[name], name)
    assembly = system.assemble()
    assert assembly.model.joints["local"][0, 0].tolist() == pytest.approx([0.2, 0.0, 0.0])


BEAM = {"kind": "beam", "length": 1, "section": {"circle": "1 cm"}, "material": "steel", "elements": 2}
BAD: dict[str, tuple[Any, tuple[Any, ...], str]] = {
    "no mapping": ([1], (), r"parts is \[1\]; it must be a mapping of names to parts"),
    "a part that is none": ({"hub": 3}, ("hub",), "parts.hub is 3; it must be a mapping"),
    "no kind": (
        {"hub": {"mass": 1}},
        ("hub", "kind"),
        "parts.hub.kind is missing; known: attitude-controller, beam, ",
    ),
    "a kind as type": (
        {"hub": {"type": "reel", "radius": 1}},
        ("hub", "kind"),
        "parts.hub.kind is missing; give kind: reel in place of type$",
    ),
    "a misspelt kind": (
        {"hub": {"kind": "rigid body"}},
        ("hub", "kind"),
        "parts.hub.kind is 'rigid body'; did you mean 'rigid-body'?",
    ),
    "a type without its kind": (
        {"rod": {"type": "link", "a": "hub", "b": "bob"}},
        ("rod", "kind"),
        "parts.rod.kind is missing; 'link' is a type: give kind: joint, type: link",
    ),
    "a type as kind": (
        {"rod": {"kind": "gear"}},
        ("rod", "kind"),
        "parts.rod.kind is 'gear'; 'gear' is a type: give kind: joint, type: gear",
    ),
    "a kind of more words": ({"c": {"kind": "beam-contact"}}, ("c", "kind"), "did you mean 'contact'?"),
    "what a kind is for": ({"l": {"kind": "drag"}}, ("l", "kind"), "'drag' occurs in the description of load"),
    "what no kind is": (
        {"l": {"kind": "qqq"}},
        ("l", "kind"),
        "parts.l.kind is 'qqq'; known: attitude-controller, beam, ",
    ),
    "no type": (
        {"r": {"kind": "resistance", "joint": "pin"}},
        ("r", "type"),
        "parts.r.type is missing; it must be one of harness, tape-spring, adhesion",
    ),
    "a kind that is no word": ({"hub": {"kind": [1]}}, ("hub", "kind"), r"parts.hub.kind is \[1\]; "),
    "a bad name": ({"2nd": {"kind": "point", "mass": 1}}, ("2nd",), "parts: the name of a part is '2nd'; it must"),
    "a name with a dot": ({"a.b": {"kind": "point"}}, ("a.b",), "the name of a part is 'a.b'"),
    "the ground": ({"ground": {"kind": "point"}}, ("ground",), "'ground', which is the inertial frame"),
    "a misspelt key": (
        {"hub": {"kind": "rigid-body", "masss": 1}},
        ("hub", "masss"),
        "unknown key 'parts.hub.masss'; did you mean 'parts.hub.mass'?",
    ),
    "a misspelt key of a section": (
        {"boom": {**BEAM, "section": {"tube": {"radius": 1, "thicknes": 0.1}}}},
        ("boom", "section", "tube", "thicknes"),
        "unknown key 'parts.boom.section.tube.thicknes'; did you mean 'parts.boom.section.tube.thickness'?",
    ),
    "a misspelt section": (
        {"boom": {**BEAM, "section": {"tub": 1}}},
        ("boom", "section"),
        "'tub' is none of its kinds; did you mean 'tube'?",
    ),
    "a misspelt material": ({"boom": {**BEAM, "material": "stel"}}, ("boom", "material"), "did you mean 'steel'?"),
    "a missing key": (
        {"bob": {"kind": "point"}},
        ("bob", "mass"),
        "parts.bob.mass is missing; it must be a mass above 0",
    ),
    "a unit of something else": (
        {"bob": {"kind": "point", "mass": "3 m"}},
        ("bob", "mass"),
        "parts.bob.mass is '3 m'; .*'m' is a unit of something",
    ),
    "a unit of another exponent": (
        {"c": {"kind": "contact", "a": "b", "b": "hub", "stiffness": "1e4 N/m^1.5"}},
        ("c", "stiffness"),
        r"parts\.c\.stiffness is '1e4 N/m\^1.5'; with an exponent of 1 it is in N/m",
    ),
    "a unit of another law": (
        {"c": {"kind": "contact", "a": "b", "b": "hub", "damping": "2 N s/m"}},
        ("c", "damping"),
        r"parts\.c\.damping is '2 N s/m'; of the law 'hunt-crossley' it is in s/m",
    ),
    "out of its limits": (
        {"boom": {**BEAM, "elements": 0}},
        ("boom", "elements"),
        "parts.boom.elements is 0; it must be",
    ),
    "no reference": (
        {"j": {"kind": "joint", "a": "hub", "b": "boom.tip.end"}},
        ("j", "b"),
        "parts.j.b is 'boom.tip.end'; it must be a point",
    ),
    "one name is meant": (
        {"b": {"kind": "bearing", "joint": "pin.left", "coefficient": 0.1}},
        ("b", "joint"),
        "a joint",
    ),
    "a point's name": (
        {"h": {"kind": "rigid-body", "points": {"a.b": [0, 0, 0]}}},
        ("h", "points"),
        "the name 'a.b' must start with a letter",
    ),
}


@pytest.mark.parametrize(("given", "where", "words"), BAD.values(), ids=BAD.keys())
def test_what_is_wrong_in_a_file_is_said_in_one_sentence(given: Any, where: tuple[Any, ...], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_parts(given)
    assert "\n" not in str(caught.value)

    class Case(Section):
        parts: PartsByName

    with pytest.raises(ValidationError) as found:
        TypeAdapter(Case).validate_python({"parts": given})
    first = found.value.errors()[0]
    assert (first["type"], first["loc"]) == ("sentence", ("parts", *where))
    with pytest.raises(InputError, match=words):
        Case(parts=given)


@pytest.mark.slow
def test_parts_of_a_case_are_written_and_described() -> None:
    class Case(Section):
        parts: PartsByName

    case = Case(parts={"bob": {"kind": "point", "mass": "2 g"}, "root": EVERY["joint"]})
    wanted = {"kind": "joint", "a": "hub", "b": "boom.root", "type": "clamp"}
    assert case.model_dump(mode="json")["parts"] == {"bob": {"kind": "point", "mass": "0.002 kg"}, "root": wanted}
    assert Case(**case.model_dump(mode="json")) == case
    schema = Case.model_json_schema()
    offered = schema["properties"]["parts"]["additionalProperties"]["oneOf"]
    own = [one for one in offered if one.get("required") == ["kind"]]
    assert len(own) == len(kinds())
    # what differs of one of repeated parts has no kind
    assert [one for one in offered if one not in own] == [{"type": "object", "not": {"required": ["kind"]}}]
    beam = schema["$defs"]["Beam"]["properties"]
    assert beam["length"]["description"] == "Length of the axis without stress."
    assert beam["formulation"]["enum"][0] == "assumed_strain"
    assert beam["length"]["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0.0}


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_every_key_is_explained(kind: str) -> None:
    """In the docstring, from which documentation, schema and form take it."""
    assert all(descriptions(kinds()[kind]).values()), [k for k, text in descriptions(kinds()[kind]).items() if not text]


class Hoop(Part):
    kind: Literal["hoop"] = "hoop"
    radius: float


class Entry:
    """An entry point of a package."""

    def __init__(self, value: Any) -> None:
        self.name, self.value, self.dist, self.module = "hoops", value, None, "rings"

    def load(self) -> Any:
        if isinstance(self.value, Exception):
            raise self.value
        return self.value


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Hoop, None),
        (ImportError("no module\nnamed 'x'"), "the plug-in 'hoops' cannot be loaded: ImportError: no module named 'x'"),
        (3, "the plug-in 'hoops' is 3; it must be a subclass of evolvent.parts.base.Part"),
        (parts.Point, "the plug-in 'hoops' adds a part of kind 'point', which is already known"),
    ],
)
def test_a_package_adds_a_kind(value: Any, words: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EVOLVENT_PLUGINS", "all")
    others = plugins.entry_points
    monkeypatch.setattr(
        plugins, "entry_points", lambda group: [Entry(value)] if group == registry.GROUP else others(group)
    )
    registry._kinds_and_failures.cache_clear()
    try:
        assert "point" in kinds()  # whatever the package does, the other parts can be used
        assert read_parts({"bob": {"kind": "point", "mass": 2}})["bob"] == parts.Point(mass=2.0)
        if words is None:
            assert read_parts({"ring": {"kind": "hoop", "radius": 2}})["ring"] == Hoop(radius=2.0)
        else:
            with pytest.raises(InputError, match=rf"^parts.ring.kind is 'hoops'; {words}"):
                read_parts({"ring": {"kind": "hoops", "radius": 2}})
            assert any(sentence.startswith(words) for sentence in cases.unusable())
    finally:
        registry._kinds_and_failures.cache_clear()


# ---------------------------------------------------------------------------------------------- sections and shapes


def test_a_tube_is_a_hole_in_a_rod() -> None:
    outer, inner, tube = (
        section.properties(0.3)
        for section in (ev.Circle(radius=0.02), ev.Circle(radius=0.015), ev.Tube(radius=0.02, thickness=0.005))
    )
    for key in ("area", "Iy", "Iz", "J"):
        assert getattr(tube, key) == pytest.approx(getattr(outer, key) - getattr(inner, key), rel=1e-14)
    assert outer.area == pytest.approx(math.pi * 4e-4)
    assert outer.Iy == pytest.approx(math.pi * 0.02**4 / 4.0)
    assert outer.J == pytest.approx(math.pi * 0.02**4 / 2.0)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_shear_factors_of_a_tube_are_cowpers(nu: float) -> None:
    """Of a thin wall 2 (1 + nu)/(4 + 3 nu), of a full circle 6 (1 + nu)/(7 + 6 nu) (Cowper 1966)."""
    thin = ev.Tube(radius=1.0, thickness=1e-7).properties(nu)
    assert thin.shear_y == thin.shear_z == pytest.approx(2.0 * (1.0 + nu) / (4.0 + 3.0 * nu), rel=1e-6)
    assert thin.area == pytest.approx(2.0 * math.pi * 1e-7, rel=1e-6)
    assert thin.Iy == pytest.approx(math.pi * 1e-7, rel=1e-6)
    full = ev.Tube(radius=1.0, thickness=1.0).properties(nu)
    assert full == pytest.approx(ev.Circle(radius=1.0).properties(nu), rel=1e-14)
    assert full.shear_y == pytest.approx(6.0 * (1.0 + nu) / (7.0 + 6.0 * nu), rel=1e-14)


def test_shapes_have_the_mass_properties_of_many_small_cubes() -> None:
    """Integrals over the volume on a fine grid, whatever their closed forms."""
    line = (np.arange(120) + 0.5) / 120 * 2.0 - 1.0
    x = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    along = x @ axis
    solids = {
        parts.Box(size=(1.0, 1.5, 0.5)): np.all(np.abs(x) < [0.5, 0.75, 0.25], axis=1),
        parts.Sphere(radius=0.8): np.sum(x * x, axis=1) < 0.64,
        parts.Cylinder(radius=0.5, length=1.2, axis=tuple(axis)): (np.abs(along) < 0.6)
        & (np.sum(x * x, axis=1) - along**2 < 0.25),
    }
    for shape, inside in solids.items():
        volume, y = inside.sum() * (2.0 / 120) ** 3, x[inside]
        inertia = np.mean(np.sum(y * y, axis=1)) * np.eye(3) - y.T @ y / len(y)
        assert shape.volume == pytest.approx(volume, rel=5e-3)
        np.testing.assert_allclose(shape.inertia_per_mass(), inertia, atol=5e-3 * inertia.max())
        body = parts.RigidBody(shape=shape, density=2.0)
        mass, tensor = body.mass_properties()
        assert mass == pytest.approx(2.0 * shape.volume)
        np.testing.assert_allclose(tensor, mass * shape.inertia_per_mass())


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"density": 1.0}, "hub.density is given without hub.shape"),
        ({"density": 1.0, "shape": {"sphere": 1}, "mass": 1}, "hub.density and hub.mass are both given"),
        ({"density": 1.0, "shape": {"sphere": 1}, "inertia": 1}, "hub.density and hub.inertia are both given"),
        ({}, "hub.mass is missing; a free body needs a mass above 0, or a density and a shape"),
        ({"mass": 1}, "hub.inertia is missing; a free body needs it, or a shape"),
        ({"motion": "spin"}, "hub.inertia is missing; about the axis of a spinning body it must be above 0"),
    ],
)
def test_mass_properties_that_contradict_or_miss_are_refused(given: dict[str, Any], words: str) -> None:
    system = System()
    system.add(parts.RigidBody(**given), "hub")
    with pytest.raises(InputError, match=words):
        system.assemble()


# ---------------------------------------------------------------------------------------------- references to places


def craft() -> System:
    """A hub that turns, with a named point, a boom and a mass."""
    system = System()
    turned = (math.cos(0.3), 0.0, 0.0, math.sin(0.3))
    system.add(
        parts.RigidBody(
            mass=1.0,
            inertia=1.0,
            position=(1.0, 2.0, 0.0),
            orientation=turned,
            velocity=(0.1, 0.0, 0.0),
            angular_velocity=(0.0, 0.0, 2.0),
            points={"left": (-0.5, 0.0, 0.0)},
        ),
        "hub",
    )
    system.add(parts.Beam(length=1.0, section=TUBE, material=ev.CFRP, elements=2, position=(3.0, 0.0, 0.0)), "boom")
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 9.0)), "bob")
    system.add(parts.Point(mass=1.0, position=(4.0, 0.0, 0.0)), "near")
    system.add(parts.Beam(length=1.0, section=TUBE, material=ev.CFRP, elements=1, position=(4.0, 0.0, 0.0)), "next")
    return system


def test_a_mass_at_a_place_starts_there_with_its_velocity() -> None:
    """hub.left turns with the hub: v + w x r."""
    system = craft()
    system.add(parts.Point(mass=1.0, at="hub.left"), "a")
    system.add(parts.Point(mass=1.0, at=("hub", (-0.5, 0.0, 0.0))), "b")
    system.add(parts.Point(mass=1.0, at="boom[1]"), "c")
    assembly = system.assemble()
    arm = -0.5 * np.array([math.cos(0.6), math.sin(0.6), 0.0])
    place, speed = np.add([1.0, 2.0, 0.0], arm), np.add([0.1, 0.0, 0.0], np.cross([0.0, 0.0, 2.0], arm))
    for name, x, v in (
        ("a", place, speed),
        ("b", place, speed),
        ("c", [3.5, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ):
        row = assembly.model.points[assembly.index(name)]
        np.testing.assert_allclose(assembly.y[row["iq"] :][:3], x, atol=1e-14)
        np.testing.assert_allclose(assembly.y[row["iv"] :][:3], v, atol=1e-14)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (parts.Spring(a="hub.lft", b="bob"), "held.a is 'hub.lft'; 'hub' has no point 'lft'; did you mean 'left'?"),
        (parts.Spring(a=r"hub[2]", b="bob"), r"held.a is 'hub\[2\]'; 'hub' has no node 2; known: left"),
        (parts.Spring(a="bob.tip", b="hub"), "held.a is 'bob.tip'; 'bob' is a point mass, which has no 'tip'"),
        (
            parts.Joint(a="bob", b="boom.tip", type="link"),
            "held.b is 'boom.tip', a node of a beam, .* add a Point with at='boom.tip'",
        ),
        (parts.RigidBody(mass=1, inertia=1, at="bob"), "held.at is 'bob'; it must be a node of a beam"),
        (parts.RigidBody(motion="driven", at="boom.tip"), "held.motion is 'driven'; .* must be 'free'"),
        (
            parts.RigidBody(mass=1, inertia=1, at="boom.tip", velocity=(1, 0, 0)),
            "held.velocity and held.at are both given",
        ),
        (
            parts.Joint(a="boom", b="bob"),
            r"held.a is 'boom'; 'boom' is a beam; give 'boom.root', .*'boom\[0\]' to 'boom\[2\]'",
        ),
        (parts.Joint(a="boom[3]", b="bob"), r"'boom' has no node 3; give 'boom.root', 'boom.tip'"),
        (parts.Joint(a="boom.mid", b="bob"), "'boom' has no 'mid'; give 'boom.root'"),
        (parts.Joint(a="huub", b="bob"), "'held' refers to 'huub', but no part is called that; did you mean 'hub'?"),
        (parts.Joint(a="hub", b="ground"), r"held.a and held.b are both bodies named alone, .*; give held.position"),
        (parts.Joint(a="hub.left", b="hub"), "held.a and held.b are on one body, 'hub.left'; a joint needs two parts"),
        (parts.Joint(a="hub.left", b="bob", position=(0, 0, 1)), "held.position is given, but .* already define where"),
        (
            parts.Joint(a="hub", b="bob", type="distance", position=(0, 0, 1)),
            "held.type is 'distance', which has none",
        ),
        (parts.Joint(a="boom.tip", b="boom.root", type="clamp"), "apart at the start; they must coincide"),
        (parts.Joint(a="boom.tip", b="near", type="clamp"), "held.type is 'clamp', but a point mass has no directions"),
        (
            parts.Joint(a="hub", b="near", type="revolute"),
            "held.type is 'revolute', but a point mass has no directions",
        ),
        (parts.JointSpring(a="hub", b="bob"), "held.b is 'bob'"),
        (parts.Point(mass=1.0, at="boom.tip", position=(0, 0, 1)), "held.position and held.at are both given"),
    ],
)
def test_a_place_that_is_not_there_is_refused(part: Part, words: str) -> None:
    system = craft()
    system.add(part, "held")
    with pytest.raises(InputError, match=words):
        system.assemble()


def test_a_body_named_alone_is_joined_where_the_other_end_is() -> None:
    """The same as with the point of the hub written out; of two bodies, at a position."""
    found = []
    for a, b, place in (
        ("hub", "bob", {}),
        (("hub", (0.0, 0.0, 0.25)), "bob", {}),
        ("hub", "bar", {"position": (0.0, 0.0, 0.25)}),
    ):
        system = System()
        system.add(parts.RigidBody(mass=1.0, inertia=1.0), "hub")
        system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(0.0, 0.0, 1.0)), "bar")
        system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 0.25)), "bob")
        system.add(parts.Joint(a=a, b=b, **place), "joint")
        found.append(system.assemble().model.joints["local"])
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_allclose(found[2][0][:2], [[0.0, 0.0, 0.25], [0.0, 0.0, -0.75]])


def test_a_beam_takes_a_normal_near_y_of_itself() -> None:
    """Of a beam along y it is z; the section's axes are a right-handed frame."""
    for direction, normal in (((1, 0, 0), (0, 1, 0)), ((0, -2, 0), (0, 0, 1)), ((1, 1, 0), (-1, 1, 0))):
        nodes = parts.Beam(direction=direction, length=1.0, section=TUBE, material=ev.CFRP, elements=1).start_nodes()
        np.testing.assert_allclose(nodes[0, 2], np.array(normal) / np.linalg.norm(normal), atol=1e-15)
        np.testing.assert_allclose(nodes[0, 3], np.cross(nodes[0, 1], nodes[0, 2]), atol=1e-15)


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("spring.stiffness", "N/m"), ("spring.start", "m"), ("harness.stiffness", "N/m"), ("motor.limit", "N m"),
        ("gear.stiffness", "N/m"), ("cables.damping", "N m s/rad"), ("pin.stiffness", "N/m"), ("other.rest", "m"),
        ("many.latch", "m"), ("motor.motion.constant.rate", "rad/s"),
    ],
)  # fmt: skip
def test_keys_of_an_angle_or_a_travel_have_the_unit_of_their_joint(key: str, unit: str) -> None:
    """Studies, fits and sensitivities read such keys with it."""
    content = {
        "pin": {"kind": "joint", "type": "revolute"},
        "rail": {"kind": "joint", "type": "prismatic"},
        "rails": {"kind": "joint", "type": "prismatic", "repeat": {"count": 2}},
        "spring": {"kind": "joint-spring", "joint": "rail"},
        "other": {"kind": "joint-spring", "a": "ground", "motion": "translation"},
        "many": {"kind": "joint-spring", "joint": "rails {n}", "repeat": {"count": 2}},
        "harness": {"kind": "resistance", "type": "harness", "joint": "spring"},
        "motor": {"kind": "motor", "joint": "pin"},
        "gear": {"kind": "joint", "type": "gear", "a": "rail", "b": "pin"},
        "cables": {"kind": "joint", "type": "synchronization", "joints": ["pin", "other pin"]},
    }
    found = schema.locate(cases.system("structure").Case, f"parts.{key}", {"system": "structure", "parts": content})
    assert [mark.unit for _, own in found.types for mark in own] == [unit]


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_texts_of_keys_have_no_words_of_python(kind: str) -> None:
    for key, text in descriptions(kinds()[kind]).items():
        assert not re.search(r"^[({\"]|\b(float|bool|str|int|None|optional)\b", text), f"{key}: {text}"
