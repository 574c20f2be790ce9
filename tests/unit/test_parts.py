"""Parts: names, references and bad input, each of which gives one clear line."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from evolvent import laws, parts
from evolvent.errors import InputError
from evolvent.system import System

nan, inf = math.nan, math.inf


@laws.force_law
def drag(x, v, t, p):
    return -p[0] * v[0], -p[0] * v[1], -p[0] * v[2]


@laws.spring_law
def linear(extension, rate, t, p):
    return p[0] * extension


def plain(extension, rate, t, p):
    return extension


def body(**changes):
    return parts.RigidBody(**{"motion": "spin", "inertia": 0.004, "rate": 6.0} | changes)


def free(**changes):
    return parts.RigidBody(**{"mass": 1.0, "inertia": (0.1, 0.2, 0.25)} | changes)


def reel(**changes):
    return parts.Reel(**{"body": "hub", "radius": 0.01, "feed": parts.ConstantFeed(rate=3.5)} | changes)


def thread(**changes):
    return parts.Thread(**{"reel": "reel", "length": 5.0, "line_density": 7e-4, "nodes": 4} | changes)


def table(**changes):
    return reel(feed=parts.TableFeed(**{"time": (0.0, 1.0), "rate": (0.0, 1.0)} | changes))


def assemble(*listed):
    """Assemble parts, of which some have names of their own."""
    names = {parts.RigidBody: "hub", parts.Reel: "reel", parts.Thread: "blade"}
    system = System()
    for part in listed:
        system.add(part, names.get(type(part)))
    return system.assemble()


POINT = parts.Point(mass=1.0, position=(1.0, 0.0, 0.0))
AT = {"a": (0.0, 0.0, 0.0), "b": "point-1"}
BLADE = (body(), reel(), thread())

BAD = {
    "point: no mass": ([parts.Point(mass=0.0)], "point-1.mass is 0.0"),
    "point: negative mass": ([parts.Point(mass=-1.0)], "point-1.mass is -1.0"),
    "point: mass nan": ([parts.Point(mass=nan)], "point-1.mass is nan"),
    "point: mass is a word": ([parts.Point(mass="heavy")], "point-1.mass is 'heavy'"),
    "point: two coordinates": ([parts.Point(mass=1.0, position=(1.0, 2.0))], "point-1.position"),
    "point: position inf": ([parts.Point(mass=1.0, position=(inf, 0.0, 0.0))], "point-1.position"),
    "point: velocity nan": ([parts.Point(mass=1.0, velocity=(nan, 0.0, 0.0))], "point-1.velocity"),
    "point: position is a word": ([parts.Point(mass=1.0, position="here")], "point-1.position"),
    "body: unknown motion": ([body(motion="spinning")], "'spin'"),
    "body: no inertia about the axis": ([body(inertia=0.0)], "inertia"),
    "body: free without mass": ([free(mass=0.0)], "hub.mass is 0"),
    "body: negative mass": ([free(mass=-2.0)], "hub.mass is -2.0"),
    "body: negative moment": ([free(inertia=(0.1, -0.1, 0.1))], "inertia"),
    "body: impossible moments": ([free(inertia=(0.1, 0.1, 0.3))], "no body has it"),
    "body: tensor not symmetric": ([free(inertia=np.eye(3) + np.eye(3, k=1))], "symmetric"),
    "body: four moments": ([free(inertia=(1.0, 1.0, 1.0, 1.0))], "inertia"),
    "body: inertia nan": ([free(inertia=nan)], "inertia"),
    "body: axis zero": ([body(axis=(0.0, 0.0, 0.0))], "hub.axis"),
    "body: quaternion zero": ([free(orientation=(0.0, 0.0, 0.0, 0.0))], "hub.orientation"),
    "body: rate nan": ([body(rate=nan)], "hub.rate is nan"),
    "spring: negative stiffness": ([POINT, parts.Spring(**AT, stiffness=-1.0)], "spring-1.stiffness is -1.0"),
    "spring: negative damping": ([POINT, parts.Spring(**AT, damping=-1.0)], "spring-1.damping is -1.0"),
    "spring: negative length": ([POINT, parts.Spring(**AT, length=-1.0)], "spring-1.length is -1.0"),
    "spring: unknown end": ([POINT, parts.Spring(a=(0.0, 0.0, 0.0), b="point1")], "did you mean 'point-1'"),
    "spring: end nan": ([POINT, parts.Spring(a=(nan, 0.0, 0.0), b="point-1", stiffness=1.0)], "nan"),
    "spring: an undecorated law": ([POINT, parts.Spring(**AT, law=plain)], "@evolvent.spring_law"),
    "spring: a law of another kind": ([POINT, parts.Spring(**AT, law=drag)], "@evolvent.spring_law"),
    "load: no beam at all": (
        [body(), parts.FieldTorque(beam="rib", torque=1.0)],
        "no beam is called 'rib'; there is none",
    ),
    "load: unknown body": ([body(), reel(body=3)], "no body is called 3; known: ground, hub"),
    "link: wrong length": ([POINT, parts.Link(**AT, length=2.0)], "'link-1'"),
    "link: no length": ([POINT, parts.Link(a="point-1", b="point-1")], "link-1.length"),
    "link: negative length": ([POINT, parts.Link(**AT, length=-1.0)], "link-1.length is -1.0"),
    "link: negative drum": ([POINT, parts.Link(**AT, drum=-0.1)], "link-1.drum is -0.1"),
    "link: a drum without a length": ([POINT, parts.Link(**AT, drum=0.1)], "link-1.length is missing"),
    "link: a drum on a point": ([POINT, parts.Link(a="point-1", b=(0.0, 0.0, 0.0), drum=0.1, length=2.0)], "link-1.a"),
    "link: inside the drum": ([POINT, parts.Link(**AT, drum=2.0, length=2.0)], "inside the drum"),
    "link: sense": ([POINT, parts.Link(**AT, sense=0)], "link-1.sense is 0"),
    "link: twice the same": ([POINT, parts.Link(**AT), parts.Link(**AT)], "redundant"),
    "reel: no radius": ([body(), reel(radius=0.0)], "reel.radius is 0.0"),
    "reel: unknown body": ([body(), reel(body="hubb")], "did you mean 'hub'"),
    "reel: axes not across": ([body(), reel(spool_axis=(1.0, 0.0, 0.0))], "reel.feed_axis"),
    "reel: centre": ([body(), reel(centre=(nan, 0.0, 0.0))], "reel.centre"),
    "reel: free spool on a free body": ([free(), reel(feed=parts.FreeSpool(inertia=1e-6))], "free spool"),
    "thread: no reel": ([body(), thread()], "blade.reel"),
    "thread: unknown reel": ([body(), reel(), thread(reel="real")], "did you mean 'reel'"),
    "thread: no nodes": ([body(), reel(), thread(nodes=0)], "blade.nodes is 0"),
    "thread: half a node": ([body(), reel(), thread(nodes=2.5)], "blade.nodes is 2.5"),
    "thread: nodes is a word": ([body(), reel(), thread(nodes="many")], "blade.nodes is 'many'"),
    "thread: no length": ([body(), reel(), thread(length=0.0)], "blade.length is 0.0"),
    "thread: no density": ([body(), reel(), thread(line_density=0.0)], "blade.line_density is 0.0"),
    "thread: negative tip": ([body(), reel(), thread(tip_mass=-1.0)], "blade.tip_mass is -1.0"),
    "thread: no stiffness": ([body(), reel(), thread(stiffness=0.0)], "blade.stiffness is 0.0"),
    "thread: negative damping": ([body(), reel(), thread(damping=-1.0)], "blade.damping is -1.0"),
    "thread: unknown segments": ([body(), reel(), thread(segments="spring")], "did you mean 'springs'"),
    "thread: unknown wound mass": ([body(), reel(), thread(wound_mass="carry")], "did you mean 'carried'"),
    "thread: no copies": ([body(), reel(), thread(copies=0)], "blade.copies is 0"),
    "thread: copies on a free body": ([free(), reel(), thread(copies=2)], "blade.copies is 2"),
    "thread: no capture": ([body(), reel(), thread(capture=0.0)], "blade.capture is 0.0"),
    "feed: more out than there is": ([body(), reel(feed=parts.ConstantFeed(rate=1.0, angle=600.0)), thread()], "more"),
    "feed: negative angle": ([body(), reel(feed=parts.ConstantFeed(rate=1.0, angle=-1.0)), thread()], "reel.angle is"),
    "feed: rate nan": ([body(), reel(feed=parts.ConstantFeed(rate=nan)), thread()], "reel.rate is nan"),
    "ramp: out of order": (
        [body(), reel(feed=parts.RampFeed(steps=[(2.0, 1.0, 1.0), (1.0, 1.0, 2.0)])), thread()],
        "1.0 s",
    ),
    "ramp: negative duration": ([body(), reel(feed=parts.RampFeed(steps=[(2.0, -1.0, 1.0)])), thread()], "duration"),
    "ramp: rate nan": ([body(), reel(feed=parts.RampFeed(steps=[(2.0, 1.0, nan)])), thread()], "reel.steps"),
    "table: nan": ([body(), table(rate=(0.0, nan)), thread()], "row 2"),
    "table: time nan": ([body(), table(time=(nan, 1.0)), thread()], "row 1"),
    "table: backwards": ([body(), table(time=(1.0, 0.0)), thread()], "row 2"),
    "table: one row": ([body(), table(time=(1.0,), rate=(1.0,)), thread()], "two or more"),
    "table: unequal": ([body(), table(rate=(0.0, 1.0, 2.0)), thread()], "3 values"),
    "table: rate and angle": ([body(), table(angle=(0.0, 1.0)), thread()], "either rate or angle"),
    "table: neither": ([body(), table(rate=None), thread()], "either rate or angle"),
    "feed law: of another kind": ([body(), reel(feed=parts.LawFeed(law=linear)), thread()], "@evolvent.feed_law"),
    "free spool: negative inertia": (
        [body(), reel(feed=parts.FreeSpool(inertia=-1.0)), thread()],
        "reel.inertia is -1.0",
    ),
    "uniform: unknown thread": ([*BLADE, parts.UniformLoad(thread="blad", force=(0, 0, 1))], "did you mean 'blade'"),
    "uniform: force": ([*BLADE, parts.UniformLoad(thread="blade", force=(0, 0))], "uniformload-1.force"),
    "uniform: frame": (
        [*BLADE, parts.UniformLoad(thread="blade", force=(0, 0, 1), frame="bodi")],
        "did you mean 'body'",
    ),
    "light: reflectivity": (
        [*BLADE, parts.RadiationPressure(thread="blade", pressure=1e-6, width=0.1, reflectivity=1.1)],
        "reflectivity is 1.1",
    ),
    "light: pressure": (
        [*BLADE, parts.RadiationPressure(thread="blade", pressure=-1.0, width=0.1)],
        "pressure is -1.0",
    ),
    "light: width": ([*BLADE, parts.RadiationPressure(thread="blade", pressure=1e-6, width=nan)], "width is nan"),
    "law load: undecorated": ([*BLADE, parts.LawLoad(thread="blade", law=plain)], "@evolvent.force_law"),
    "law load: of another kind": ([*BLADE, parts.LawLoad(thread="blade", law=linear)], "@evolvent.force_law"),
    "force: body frame on a point": (
        [POINT, parts.Force(at="point-1", force=(1, 0, 0), frame="body")],
        "force-1.at is 'point-1'",
    ),
    "force: over before it starts": (
        [POINT, parts.Force(at="point-1", force=(1, 0, 0), start=2.0, end=1.0)],
        "force-1.end",
    ),
    "torque: on a point": ([POINT, parts.Torque(at="point-1", force=(1, 0, 0))], "torque-1.at is 'point-1'"),
    "event: undecorated": ([POINT, parts.Event(law=plain)], "@evolvent.event_law"),
}


@pytest.mark.parametrize(("listed", "words"), BAD.values(), ids=BAD.keys())
def test_bad_input_gives_one_clear_line(listed, words):
    with pytest.raises(InputError) as caught:
        assemble(*listed)
    message = str(caught.value)
    assert words in message
    assert "\n" not in message
    assert len(message) < 200


def test_what_the_bad_inputs_are_made_from_is_good():
    """Each case above differs from one of these in one thing."""
    assert assemble(*BLADE).model.threads.size == 1
    assert assemble(free(), reel(), thread()).model.threads.size == 1
    assert assemble(body(), table(), thread()).model.threads.size == 1
    assert assemble(POINT, parts.Link(**AT)).model.rows.size == 1
    assert assemble(POINT, parts.Spring(**AT, law=linear, parameters=(1.0,))).model.springs.size == 1
    assert assemble(*BLADE, parts.LawLoad(thread="blade", law=drag, parameters=(1.0,))).model.loads.size == 1


@pytest.mark.parametrize("thing", [5, None, "ball", parts.Point])
def test_what_is_no_part_is_refused(thing):
    with pytest.raises(InputError, match="is not a part; add one of"):
        System().add(thing)


def test_a_name_is_a_word():
    with pytest.raises(InputError, match="the name of a part is 5"):
        System().add(POINT, 5)


def test_names_are_made_from_kind_and_number():
    system = System()
    assert system.add(POINT) == "point-1"
    assert system.add(POINT) == "point-2"
    assert system.add(body(), "hub") == "hub"
    assert system.add(body()) == "rigidbody-2"


@pytest.mark.parametrize("name", ["ground", "hub"])
def test_a_name_is_taken_once(name):
    system = System()
    system.add(body(), "hub")
    with pytest.raises(InputError, match=f"'{name}' is already taken"):
        system.add(POINT, name)


def test_a_part_refers_only_to_parts_before_it():
    system = System()
    system.add(parts.Spring(**AT, stiffness=1.0))
    system.add(POINT)
    with pytest.raises(InputError, match="point-1"):
        system.assemble()


def test_index_finds_parts_by_name_and_family():
    assembly = assemble(POINT, *BLADE)
    assert assembly.index("blade") == 0
    assert assembly.index("hub", "bodies") == 1  # the ground is the first
    with pytest.raises(InputError, match="did you mean 'blade'"):
        assembly.index("blades")
    with pytest.raises(InputError, match="'hub' is one of the bodies, not of the threads"):
        assembly.index("hub", "threads")


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (0.0, 0.0, nan)])
def test_gravity_is_three_finite_numbers(gravity):
    with pytest.raises(InputError, match="gravity"):
        System(gravity=gravity)


@pytest.mark.parametrize(
    "part", [POINT, body(), reel(), thread(), parts.Spring(**AT), parts.Link(**AT), parts.RampFeed()]
)
def test_specifications_are_frozen(part):
    field = dataclasses.fields(part)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(part, field, None)


def test_assembling_twice_gives_the_same_state():
    system = System()
    for part, name in zip(BLADE, ("hub", "reel", "blade"), strict=True):
        system.add(part, name)
    first, second = system.assemble(), system.assemble()
    np.testing.assert_array_equal(first.y, second.y)
    np.testing.assert_array_equal(first.s, second.s)
    assert first.y is not second.y


def test_masses_are_those_of_equation_6():
    """Tenenbaum (2014), eq. 6: m_i = rho l0, the tip m_k + rho l0 / 2."""
    masses = assemble(body(), reel(), thread(nodes=4, length=2.0, line_density=0.1, tip_mass=0.3)).model.nodes["mass"]
    np.testing.assert_allclose(masses, [0.3 + 0.025, 0.05, 0.05, 0.05], rtol=1e-15)


def test_out_at_the_start_is_straight_and_turns_with_the_body():
    feed = parts.ConstantFeed(rate=3.5, angle=150.0)  # 1.5 m of 5 m: 2 of 4 nodes
    assembly = assemble(body(), reel(feed=feed, centre=(0.05, 0.0, 0.0)), thread())
    first = int(assembly.model.threads["iq"][0])
    v = int(assembly.model.threads["iv"][0])
    x = assembly.y[first : first + 6].reshape(2, 3)
    np.testing.assert_allclose(x, [[1.55, 0.0, 0.01], [0.3, 0.0, 0.01]], atol=1e-14)
    speeds = assembly.y[v : v + 6].reshape(2, 3)
    np.testing.assert_allclose(speeds, [[0.035, 6.0 * 1.55, 0.0], [0.035, 6.0 * 0.3, 0.0]], atol=1e-13)
    assert assembly.s[0] == 2


@pytest.mark.parametrize("where", [None, 3.0, (), (1.0, 2.0, 3.0, 4.0)])
def test_what_is_no_place_is_refused(where: object) -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "body")
    system.add(parts.Joint(a=where, b="body"))
    with pytest.raises(InputError, match="is no place; give a name"):
        system.assemble()
