"""Beams, rods, cables, threads and wheels beside a joint, against closed forms and calculations by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.analysis.margins import factors, mechanism
from evolvent.elements.reduced_files import write_model
from evolvent_base.errors import InputError
from margin_cases import NONE, zero
from reduced import beam_model

pytestmark = pytest.mark.slow

STILL = {"motion": False, "stations": 5}
G, E, DENSITY = 9.81, 70e9, 2700.0
LENGTH, WIDTH, THICKNESS = 1.0, 0.02, 1e-3
EI = E * WIDTH * THICKNESS**3 / 12.0
STRIP = {
    "length": LENGTH, "elements": 8, "normal": (0.0, 1.0, 0.0),
    "section": {"rectangle": {"width": WIDTH, "thickness": THICKNESS}},
    "material": {"young_modulus": E, "poisson_ratio": 0.3, "density": DENSITY},
}  # fmt: skip


def of(table, label):
    """Values of a share."""
    return table.values[[one.label for one in table.shares].index(label)]


def across(part, end=math.pi / 2, mass=2.0, **more):
    """A strip from the ground to a body whose angle is held and which is free beside."""
    system = System()
    inertia = (0.05 * mass, 0.05 * mass, 0.1 * mass)
    system.add(parts.RigidBody(mass=mass, inertia=inertia, position=(LENGTH, 0.0, 0.0)), "end")
    system.add(part, "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "clamp")
    system.add(parts.Joint(a="strip.tip", b="end", type="clamp"), "weld")
    spring = {"stiffness": 1.0, "rest": 2.0, "latch": end, "latch_stiffness": 500.0, **more}
    system.add(parts.JointSpring(a="ground", b="end", axis=(0, 0, 1), **spring), "hinge")
    return system


@pytest.mark.parametrize(("kind", "elements", "off"), [(parts.Rod, 6, 1e-8), (parts.Beam, 8, 0.02)])
def test_a_strip_across_that_bends_to_an_arc(kind, elements, off):
    """The body comes to where the strip has its moment alone, EI x/length: it resists, at any angle."""
    found = across(kind(**STRIP | {"elements": elements})).margin(zero=NONE, **STILL)
    table = found["hinge"]
    moment = EI * table.x / LENGTH
    assert of(table, "strip") == pytest.approx(-moment, rel=off, abs=1e-12)
    assert table.required("motorization") == pytest.approx(2.4 * moment, rel=off, abs=1e-12)
    share = next(one for one in table.shares if one.label == "strip")
    assert (share.category, share.evidence) == ("elastic parts", "theoretical")
    assert any("elastic parts stand in equilibrium" in note for note in found.notes())
    # the body on its arc: the path of its centre has the slope of the end of a circle
    x = table.x[1:]
    along = LENGTH * np.array([(x * np.cos(x) - np.sin(x)) / x**2, (x * np.sin(x) + np.cos(x) - 1.0) / x**2])
    assert table.inertia[1:] == pytest.approx(0.2 + 2.0 * np.sum(along**2, axis=0), rel=0.02)


def test_a_reduced_body_across_bends_as_a_beam(tmp_path):
    """Small angles: off by their square; the arm that carries such a body has its mass."""
    path = str(tmp_path / "beam.npz")
    write_model(path, beam_model.reduced())
    long, stiff = beam_model.LENGTH, beam_model.YOUNG * beam_model.I_Z
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(long, 0.0, 0.0)), "end")
    system.add(parts.ReducedBody(file=path), "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "clamp")
    system.add(parts.Joint(a="strip.tip", b="end", type="clamp"), "weld")
    spring = {"stiffness": 1.0, "rest": 2.0, "latch": 0.01, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(a="ground", b="end", axis=(0, 0, 1), **spring), "hinge")
    table = system.margin(zero=NONE, **STILL)["hinge"]
    assert of(table, "strip") == pytest.approx(-stiff * table.x / long, rel=3e-5, abs=1e-12)
    arm = System()
    arm.add(parts.ReducedBody(file=path), "strip")
    arm.add(parts.Joint(a="ground", b="strip.root", type="revolute", axis=(0, 0, 1)), "pin")
    arm.add(parts.JointSpring(a="ground", b="strip.root", axis=(0, 0, 1), **spring | {"latch": 1.0}), "hinge")
    table = arm.margin(zero=NONE, **STILL)["hinge"]
    assert of(table, "strip") == pytest.approx(0.0, abs=1e-9)
    assert table.inertia == pytest.approx(beam_model.MASS * long**2 / 3.0, rel=1e-3)


def test_the_error_of_the_beam_across_falls_with_its_elements():
    """By an order of 2 at least."""
    off = []
    for elements in (4, 8):
        table = across(parts.Beam(**STRIP | {"elements": elements})).margin(zero=NONE, **STILL)["hinge"]
        off.append(abs(of(table, "strip")[-1] / (EI * table.x[-1]) + 1.0))
    assert off[1] < off[0] / 3.5


@pytest.mark.parametrize(("kind", "off"), [(parts.Rod, 0.02), (parts.Beam, 0.02)])
def test_a_slide_across_a_clamped_and_guided_beam(kind, off):
    """12 EI/l3 drives to the shape without stress, and resists past it."""
    travel = 1e-5
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(LENGTH, 0.0, 0.0)), "slider")
    system.add(parts.Joint(a=(LENGTH, 0.0, 0.0), b="slider", type="prismatic", axis=(0, 1, 0)), "rail")
    keys = {"stiffness": 0.0, "low": -travel, "high": travel, "stop": 1e3}
    system.add(parts.JointSpring(joint="rail", **keys), "slide")
    system.add(parts.Motor(joint="slide", torque={"constant": 1e-3}), "motor")
    system.add(kind(**STRIP), "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "clamp")
    system.add(parts.Joint(a="strip.tip", b="slider", type="clamp"), "weld")
    line = {"slide": {"travel": (-travel, travel)}}
    table = system.margin(zero=NONE, lines=line, **STILL)["slide"]
    force = -12.0 * EI / LENGTH**3 * table.x
    assert of(table, "strip") == pytest.approx(force, rel=off, abs=1e-12)
    assert table.available == pytest.approx(1e-3 + 0.8 * np.maximum(force, 0.0), rel=off)


def carried(kind, *, gravity=(0.0, 0.0, 0.0), free=False, young=E, settings=None):
    """An arm of 0.5 m on a hinge, and on it a boom of 1 m."""
    system = System(gravity=gravity, settings=settings or {})
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.25, 0.0, 0.0)), "arm")
    if free:
        system.add(parts.RigidBody(mass=20.0, inertia=(3.0, 4.0, 5.0), position=(-0.5, 0.1, 0.0)), "satellite")
    root = ("satellite", (0.5, -0.1, 0.0)) if free else (0.0, 0.0, 0.0)
    system.add(parts.Joint(a=root, b=("arm", (-0.25, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 0.1, "rest": math.pi, "latch": math.pi / 2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    thick = {"section": {"rectangle": {"width": WIDTH, "thickness": 0.01}}}
    steel = {"material": {"young_modulus": young, "poisson_ratio": 0.3, "density": DENSITY}}
    system.add(kind(**STRIP | thick | steel | {"position": (0.5, 0.0, 0.0), "elements": 6}), "boom")
    system.add(parts.Joint(a=("arm", (0.25, 0.0, 0.0)), b="boom.root", type="clamp"), "clamp")
    return system


BOOM = DENSITY * WIDTH * 0.01 * LENGTH
#: Of arm and boom as one rigid body: mass, inertia about the centre, centre from the hinge.
WHOLE = 2.0 + BOOM
CENTRE = (2.0 * 0.25 + BOOM * 1.0) / WHOLE
ABOUT = 0.2 + 2.0 * 0.25**2 + BOOM * (1.0 / 12.0 + 1.0) - WHOLE * CENTRE**2


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
@pytest.mark.parametrize("free", [False, True])
def test_a_boom_that_the_arm_carries_counts_as_a_rigid_mass(kind, free):
    """With the spring alone, on the ground and on a free satellite; nothing bends it."""
    table = carried(kind, free=free).margin(zero=zero("acceleration"), lines={"hinge": {"duration": 20.0}}, **STILL)[
        "hinge"
    ]
    assert of(table, "boom") == pytest.approx(np.zeros(5), abs=1e-12)
    inertia = np.full(5, ABOUT + WHOLE * CENTRE**2)
    if free:  # the reduced mass of two bodies in a plane, as the turn without angular momentum leaves it
        mu = 20.0 * WHOLE / (20.0 + WHOLE)
        rb = CENTRE * np.array([np.cos(table.x), np.sin(table.x)])
        d = rb - np.array([[-0.5], [0.1]])
        twice = 5.0 + ABOUT + mu * np.sum(d * d, axis=0)
        once = ABOUT + mu * np.sum(d * rb, axis=0)
        inertia = ABOUT + mu * CENTRE**2 - once**2 / twice
    assert table.inertia == pytest.approx(inertia, rel=2e-4)
    required = 1.25 * inertia * 2.0 * (math.pi / 2) / 20.0**2
    assert table.margin("motorization") == pytest.approx(table.available / required - 1.0, rel=2e-4)


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_the_weight_of_a_boom_that_hardly_bends(kind):
    """As that of a rigid mass; what it gains by its sag comes from its elastic energy."""
    table = carried(kind, gravity=(0.0, -1.0, 0.0), young=100.0 * E).margin(zero=NONE, **STILL)["hinge"]
    weight = -WHOLE * CENTRE * np.cos(table.x)
    assert of(table, "gravity") == pytest.approx(weight, rel=2e-5, abs=1e-9)
    # the sag's energy q^2 cos(x)^2 l^5/(40 EI) changes with the angle
    q, stiffness = BOOM / LENGTH, 100.0 * E * WIDTH * 0.01**3 / 12.0
    given = q**2 * LENGTH**5 / (40.0 * stiffness) * np.sin(2.0 * table.x)
    assert of(table, "boom") == pytest.approx(given, rel=0.05, abs=1e-9)


def test_a_free_satellite_in_a_uniform_field_bends_nothing():
    table = carried(parts.Rod, free=True, gravity=(0.0, -1.0, 0.0)).margin(zero=NONE, **STILL)["hinge"]
    assert table.values[1:] == pytest.approx(np.zeros((3, 5)), abs=1e-9)


def test_a_cable_is_slack_then_taut():
    """Its pull times the lever of the hinge, once it is longer than at rest."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 1.0, "rest": math.pi, "latch": 1.2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    system.add(parts.Point(mass=0.01, position=(0.5, -0.5, 0.0)), "knot")
    rest = 0.75  # of each half; both together reach at an angle of 61 degrees or so
    law = {"law": "50*max(x, 0)"}
    system.add(parts.Spring(a=(0.0, -1.0, 0.0), b="knot", length=rest, **law), "lower")
    system.add(parts.Spring(a="knot", b=("arm", (0.5, 0.0, 0.0)), length=rest, **law), "upper")
    table = system.margin(zero=NONE, **STILL)["hinge"]
    length = np.hypot(np.cos(table.x), np.sin(table.x) + 1.0)
    pull = 25.0 * np.maximum(length - 2.0 * rest, 0.0)
    lever = np.cos(table.x) / length  # d length/dx
    assert pull[0] == 0.0
    assert pull[-1] > 1.0
    both = of(table, "lower") + of(table, "upper")
    assert both == pytest.approx(-pull * lever, rel=1e-8, abs=1e-12)


def pulled(part, name="cable", **more):
    """A hinged arm, and a cable of the length 2^(1/2) m from below the hinge to its end."""
    system = System(**more)
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 1.0, "rest": math.pi, "latch": 1.2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    system.add(part, name)
    return system


def stretch(x):
    """Of that cable, and the lever of its pull."""
    length = np.hypot(np.cos(x), np.sin(x) + 1.0)
    return length / math.sqrt(2.0), np.cos(x) / length


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch"])
def test_a_beam_without_torsion_as_a_cable(formulation):
    """By Green's strain and by the stretch less 1, far beyond small strains."""
    section = {"circle": {"radius": 5e-4}}
    soft = {"young_modulus": 1e8, "poisson_ratio": 0.3, "density": 1000.0}
    start = {"position": (0.0, -1.0, 0.0), "direction": (1.0, 1.0, 0.0), "formulation": formulation}
    system = pulled(parts.Beam(length=math.sqrt(2.0), elements=4, section=section, material=soft, **start))
    system.add(parts.Joint(a=(0.0, -1.0, 0.0), b="cable.root", type="spherical"), "low")
    system.add(parts.Joint(a=("arm", (0.5, 0.0, 0.0)), b="cable.tip", type="spherical"), "high")
    table = system.margin(zero=NONE, **STILL)["hinge"]
    s, lever = stretch(table.x)
    strain = 0.5 * (s**3 - s) if formulation == "cable" else s - 1.0
    assert of(table, "cable") == pytest.approx(-1e8 * math.pi * 25e-8 * strain * lever, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("slack", [False, True])
def test_a_thread_that_a_hinge_pulls_taut(slack):
    """Four segments of 200 N/m; the reel beside it has no margin of its own."""
    drive = {"constant": {"rate": 0.0, "angle": math.sqrt(2.0) / 0.02}}
    keys = {"line_density": 1e-4, "nodes": 4, "stiffness": 200.0, "damping": 0.1, "slack": slack}
    reel = parts.Reel(body="ground", centre=(0.0, -1.0, -0.02), radius=0.02, drive=drive)
    system = pulled(reel, "reel")
    end = {"end": ("arm", (0.5, 0.0, 0.0))}
    system.add(parts.Thread(reel="reel", length=math.sqrt(2.0), **end, **keys), "thread")
    ask = {"zero": NONE, "lines": {"reel": {"leave_out": "stands"}}, **STILL}
    table = system.margin(**ask)["hinge"]
    s, lever = stretch(table.x)
    assert of(table, "thread") == pytest.approx(-50.0 * math.sqrt(2.0) * (s - 1.0) * lever, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_a_heated_strip_is_straight_at_another_angle(kind):
    """Hotter at y it bends towards -y by itself: -EI (x/length + a g)."""
    expands = STRIP["material"] | {"thermal_expansion": 2e-5}
    system = across(kind(**STRIP | {"material": expands}), end=0.2)
    gradient = 2000.0
    system.add(parts.ThermalLoad(part="strip", gradient_y={"constant": gradient}), "sun")
    table = system.margin(zero=NONE, **STILL)["hinge"]
    moment = EI * (table.x / LENGTH + 2e-5 * gradient)
    assert of(table, "strip") == pytest.approx(-moment, rel=2e-3)


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_a_line_load_on_a_boom(kind):
    """Its lever is that of a rigid boom, where it hardly bends."""
    system = carried(kind, young=100.0 * E)
    system.add(parts.Load(along="boom", force=(0.0, -0.5, 0.0)), "load")
    table = system.margin(zero=zero("load"), **STILL)["hinge"]
    labels = [one.label for one in table.shares if one.category == "load"]
    total = sum(of(table, label) for label in labels)
    assert total == pytest.approx(-0.5 * LENGTH * 1.0 * np.cos(table.x), rel=1e-4, abs=1e-9)


def test_variants_share_stations_unless_their_elastic_parts_differ():
    mechanism._PLACES.clear()
    across(parts.Rod(**STRIP)).margin(zero=NONE, **STILL)
    assert len(mechanism._PLACES) == 1
    harder = across(parts.Rod(**STRIP)).with_values({"hinge.stiffness": 3.0})
    harder.margin(zero=NONE, **STILL)
    assert len(mechanism._PLACES) == 1
    across(parts.Rod(**STRIP | {"length": 1.01 * LENGTH})).margin(zero=NONE, **STILL)
    assert len(mechanism._PLACES) == 2


def test_along_a_run_the_strip_resists_as_at_rest():
    """Turned slowly by a damper, so that its moment is that of the arc."""
    system = across(parts.Rod(**STRIP | {"elements": 4, "stiffness_damping": 0.2}), end=0.5, mass=0.02, damping=20.0)
    system.settings = {"until": "6 s", "every": "0.2 s"}
    found = system.margin(zero=NONE, stations=3)
    table = found.motion("hinge")
    assert table is not None
    assert table.time.size > 20
    assert of(table, "strip")[5:] == pytest.approx(-EI * table.x[5:] / LENGTH, rel=0.02)
    assert found["hinge"].governing()[1] == 2


def test_a_table_of_factors_may_have_its_own_for_elastic_parts():
    own = factors.built_in()["ECSS-E-ST-33-01C"].model_copy(update={"driving": {"spring": 0.8, "elastic parts": 0.5}})
    assert own.counts("elastic parts") == 0.5
    assert factors.built_in()["ECSS-E-ST-33-01C"].counts("elastic parts") == 0.8
    one = factors.built_in()["ECSS-E-ST-33-01C"].requirements["motorization"]
    assert one.factor("elastic parts", "measured") == one.factor("spring", "measured") == 2.4


def test_a_strip_that_buckles_is_refused():
    """Pushed together beyond Euler's load it has two shapes."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(LENGTH, 0.0, 0.0)), "slider")
    system.add(parts.Joint(a=(LENGTH, 0.0, 0.0), b="slider", type="prismatic", axis=(1, 0, 0)), "rail")
    system.add(parts.JointSpring(joint="rail", low=-1e-4, high=1.0, stop=1e3), "slide")
    system.add(parts.Motor(joint="slide", torque={"constant": -100.0}), "motor")
    system.add(parts.Rod(**STRIP), "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "clamp")
    system.add(parts.Joint(a="strip.tip", b="slider", type="clamp"), "weld")
    ask = {"zero": NONE, "motion": False, "stations": 3}
    # 4 pi^2 EI/(EA l) = 3.3e-6 m
    short = system.margin(lines={"slide": {"travel": (0.0, -3e-6)}}, **ask)["slide"]
    assert of(short, "strip") == pytest.approx(E * WIDTH * THICKNESS / LENGTH * short.x, rel=1e-6)
    with pytest.raises(InputError, match=r"in no stable equilibrium where 'slide' is at -3\.6e-06 m"):
        system.margin(lines={"slide": {"travel": (0.0, -3.6e-6)}}, **ask)


# --------------------------------------------------------------------------------------- wheels, thrusters


def with_satellite(*more):
    """An arm on a free satellite."""
    system = carried(parts.Rod, free=True)
    for name, part in more:
        system.add(part, name)
    return system


def test_a_wheel_without_a_torque_has_no_share():
    found = with_satellite(("wheel", parts.ReactionWheel(body="satellite", inertia=0.1, rate=300.0))).margin(
        zero=NONE, **STILL
    )
    without = with_satellite().margin(zero=NONE, **STILL)
    assert found["hinge"].values == pytest.approx(without["hinge"].values, abs=1e-12)
    assert any("momentum of 'wheel' does no work" in note for note in found.notes())


def test_a_thruster_is_a_load():
    """Its force times its lever along the direction; of a satellite that does not turn there is none."""
    thruster = parts.Thruster(at=("arm", (0.25, 0.0, 0.0)), direction=(0.0, -1.0, 0.0), thrust=0.2, profile=CONSTANT)
    system = carried(parts.Rod)
    system.add(thruster, "thruster")
    table = system.margin(zero=zero("load"), **STILL)["hinge"]
    assert of(table, "thruster") == pytest.approx(np.full(5, -0.05 * 0.5), rel=1e-9)
    assert next(one for one in table.shares if one.label == "thruster").category == "load"


CONSTANT = {"constant": 0.05}


@pytest.mark.parametrize(
    ("name", "part", "sentence"),
    [
        ("wheel", parts.ReactionWheel(body="satellite", inertia=0.1, torque=0.1), "'wheel' is a wheel with a motor"),
        (
            "wheel", parts.ReactionWheel(body="satellite", inertia=0.1, rate=3.0, friction_torque=0.1),
            "'wheel' is a wheel with a motor or with friction, which turns its body; take it out",
        ),
    ],
)  # fmt: skip
def test_what_wheels_refuse(name, part, sentence):
    with pytest.raises(InputError) as error:
        with_satellite((name, part)).margin(zero=NONE, **STILL)
    assert sentence in str(error.value)


def test_a_controller_is_refused_by_name():
    system = with_satellite(("wheel", parts.ReactionWheel(body="satellite", inertia=0.1)))
    keys = {"body": "satellite", "actuators": ("wheel",), "proportional": (0, 0, 1.0), "derivative": (0, 0, 1.0)}
    system.add(parts.AttitudeController(**keys), "control")
    with pytest.raises(InputError, match="'control' is one of the controllers, which margins of hinges and slides do"):
        system.margin(zero=NONE, **STILL)


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_a_steady_turn_pulls_at_a_boom(kind):
    """The centrifugal forces of arm and boom about a point beside the hinge, times their levers."""
    rate, aside = 0.5, np.array([[0.0], [0.3]])
    turn = {"spin": (0.0, 0.0, rate), "centre": (0.0, 0.3, 0.0)}
    table = carried(kind, young=100.0 * E).margin(zero=NONE, **turn, **STILL)["hinge"]
    r = np.array([np.cos(table.x), np.sin(table.x)])
    across_ = np.array([-np.sin(table.x), np.cos(table.x)])
    # of a mass at the distance s: m s W^2 (s r - c) . t = -m s W^2 c . t
    torque = -WHOLE * CENTRE * rate**2 * np.sum(aside * across_, axis=0)
    assert np.sum(r * across_, axis=0) == pytest.approx(np.zeros(5), abs=1e-15)
    assert of(table, "spin") == pytest.approx(torque, rel=1e-4, abs=1e-9)


def test_a_snap_between_stations_is_noted():
    """A soft spring pushes the apex of a flat truss through; a stiff one holds it on its way."""

    def truss(stiffness):
        system = System()
        system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.5, 0.0)), "slider")
        system.add(parts.Joint(a=(0.0, 0.5, 0.0), b="slider", type="prismatic", axis=(0, -1, 0)), "rail")
        system.add(parts.JointSpring(joint="rail", low=-1.0, high=0.6, stop=1e3), "slide")
        system.add(parts.Motor(joint="slide", torque={"constant": 20.0}), "motor")
        system.add(parts.RigidBody(mass=0.1, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.1, 0.0)), "apex")
        system.add(parts.Joint(a=(0.0, 0.1, 0.0), b="apex", type="prismatic", axis=(0, -1, 0)), "guide")
        system.add(parts.Rod(**STRIP | {"elements": 2, "position": (0.0, 0.0, 1.0)}), "aside")
        system.add(parts.Joint(a=(0.0, 0.0, 1.0), b="aside.root", type="clamp"), "clamp")
        for name, x in (("left", -0.5), ("right", 0.5)):
            keys = {"length": math.hypot(0.5, 0.1), "stiffness": 5000.0}
            system.add(parts.Spring(a=(x, 0.0, 0.0), b="apex", **keys), name)
        system.add(parts.Spring(a="slider", b="apex", length=0.4, stiffness=stiffness), "push")
        line = {"slide": {"travel": (0.0, 0.3)}}
        return system.margin(zero=NONE, lines=line, motion=False, stations=41)

    held, pushed = truss(5000.0), truss(60.0)
    assert not any("snap" in note for note in held.notes())
    assert len(held["slide"].snaps) == 0
    notes = [note for note in pushed.notes() if "snap" in note]
    assert len(notes) == len(pushed["slide"].snaps) == 1
