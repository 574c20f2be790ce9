"""Parts: names, references and bad input, each of which gives one clear line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.compiled import laws
from evolvent_base.errors import InputError

nan, inf = math.nan, math.inf


@laws.law
def drag(x, v, t, p):
    return -p[0] * v[0], -p[0] * v[1], -p[0] * v[2]


@laws.law
def linear(extension, rate, t, p):
    return p[0] * extension


def plain(extension, rate, t, p):
    return extension


def body(**changes):
    return parts.RigidBody(**{"motion": "spin", "inertia": 0.004, "rate": 6.0} | changes)


def free(**changes):
    return parts.RigidBody(**{"mass": 1.0, "inertia": (0.1, 0.2, 0.25)} | changes)


def reel(**changes):
    return parts.Reel(**{"body": "hub", "radius": 0.01, "drive": parts.ConstantDrive(rate=3.5)} | changes)


def thread(**changes):
    return parts.Thread(**{"reel": "reel", "length": 5.0, "line_density": 7e-4, "nodes": 4} | changes)


def table(**changes):
    return reel(drive=parts.TableDrive(**{"time": (0.0, 1.0), "rate": (0.0, 1.0)} | changes))


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
    "point: no mass": (lambda: [parts.Point(mass=0.0)], "Point.mass is 0.0"),
    "point: negative mass": (lambda: [parts.Point(mass=-1.0)], "Point.mass is -1.0"),
    "point: mass nan": (lambda: [parts.Point(mass=nan)], "Point.mass is nan"),
    "point: mass is a word": (lambda: [parts.Point(mass="heavy")], "Point.mass is 'heavy'"),
    "point: two coordinates": (lambda: [parts.Point(mass=1.0, position=(1.0, 2.0))], "Point.position"),
    "point: position inf": (lambda: [parts.Point(mass=1.0, position=(inf, 0.0, 0.0))], "Point.position"),
    "point: velocity nan": (lambda: [parts.Point(mass=1.0, velocity=(nan, 0.0, 0.0))], "Point.velocity"),
    "point: position is a word": (lambda: [parts.Point(mass=1.0, position="here")], "Point.position"),
    "body: unknown motion": (lambda: [body(motion="spinning")], "'spin'"),
    "body: no inertia about the axis": (lambda: [body(inertia=0.0)], "inertia"),
    "body: free without mass": (lambda: [free(mass=0.0)], "hub.mass is 0"),
    "body: negative mass": (lambda: [free(mass=-2.0)], "RigidBody.mass is -2.0"),
    "body: negative moment": (lambda: [free(inertia=(0.1, -0.1, 0.1))], "inertia"),
    "body: impossible moments": (lambda: [free(inertia=(0.1, 0.1, 0.3))], "no body has it"),
    "body: tensor not symmetric": (lambda: [free(inertia=np.eye(3) + np.eye(3, k=1))], "symmetric"),
    "body: four moments": (lambda: [free(inertia=(1.0, 1.0, 1.0, 1.0))], "inertia"),
    "body: inertia nan": (lambda: [free(inertia=nan)], "inertia"),
    "body: axis zero": (lambda: [body(axis=(0.0, 0.0, 0.0))], "RigidBody.axis"),
    "body: quaternion zero": (lambda: [free(orientation=(0.0, 0.0, 0.0, 0.0))], "RigidBody.orientation"),
    "body: rate nan": (lambda: [body(rate=nan)], "RigidBody.rate is nan"),
    "spring: negative stiffness": (lambda: [POINT, parts.Spring(**AT, stiffness=-1.0)], "Spring.stiffness is -1.0"),
    "spring: negative damping": (lambda: [POINT, parts.Spring(**AT, damping=-1.0)], "Spring.damping is -1.0"),
    "spring: negative length": (lambda: [POINT, parts.Spring(**AT, length=-1.0)], "Spring.length is -1.0"),
    "spring: unknown end": (lambda: [POINT, parts.Spring(a=(0.0, 0.0, 0.0), b="point1")], "did you mean 'point-1'"),
    "spring: end nan": (lambda: [POINT, parts.Spring(a=(nan, 0.0, 0.0), b="point-1", stiffness=1.0)], "nan"),
    "spring: an undecorated law": (lambda: [POINT, parts.Spring(**AT, law=plain)], "@evolvent.law"),
    "spring: a law of another kind": (lambda: [POINT, parts.Spring(**AT, law=drag)], "the law 'drag'"),
    "load: no beam at all": (
        lambda: [body(), parts.Load(along="rib", torque=(0.0, 0.0, 1.0))],
        "'load-1' refers to 'rib', but no part is called that",
    ),
    "load: unknown body": (lambda: [body(), reel(body=3)], "Reel.body is 3; it must be the name of a body"),
    "link: wrong length": (lambda: [POINT, parts.Joint(type="link", **AT, length=2.0)], "'joint-1'"),
    "link: no length": (
        lambda: [POINT, parts.Joint(a="point-1", b=tuple(POINT.position), type="link")],
        "joint-1.length",
    ),
    "link: negative length": (lambda: [POINT, parts.Joint(type="link", **AT, length=-1.0)], "Joint.length is -1.0"),
    "link: negative drum": (lambda: [POINT, parts.Joint(type="link", **AT, drum=-0.1)], "Joint.drum is -0.1"),
    "link: a drum without a length": (
        lambda: [POINT, parts.Joint(type="link", **AT, drum=0.1)],
        "joint-1.length is missing",
    ),
    "link: a drum on a point": (
        lambda: [POINT, parts.Joint(a="point-1", b=(0.0, 0.0, 0.0), type="link", drum=0.1, length=2.0)],
        "joint-1.a",
    ),
    "link: inside the drum": (lambda: [POINT, parts.Joint(type="link", **AT, drum=2.0, length=2.0)], "inside the drum"),
    "link: sense": (lambda: [POINT, parts.Joint(type="link", **AT, sense=0)], "Joint.sense is 0"),
    "link: twice the same": (
        lambda: [POINT, parts.Joint(type="link", **AT), parts.Joint(type="link", **AT)],
        "redundant",
    ),
    "reel: no radius": (lambda: [body(), reel(radius=0.0)], "Reel.radius is 0.0"),
    "reel: unknown body": (lambda: [body(), reel(body="hubb")], "did you mean 'hub'"),
    "reel: axes not across": (lambda: [body(), reel(spool_axis=(1.0, 0.0, 0.0))], "reel.payout_axis"),
    "reel: centre": (lambda: [body(), reel(centre=(nan, 0.0, 0.0))], "Reel.centre"),
    "reel: free spool heavier than its body": (lambda: [free(), reel(drive=parts.FreeSpool(inertia=9.0))], "includes"),
    "thread: no reel": (lambda: [body(), thread()], "'blade' refers to 'reel', but no part is called that"),
    "thread: unknown reel": (lambda: [body(), reel(), thread(reel="real")], "did you mean 'reel'"),
    "thread: no nodes": (lambda: [body(), reel(), thread(nodes=0)], "Thread.nodes is 0"),
    "thread: half a node": (lambda: [body(), reel(), thread(nodes=2.5)], "Thread.nodes is 2.5"),
    "thread: nodes is a word": (lambda: [body(), reel(), thread(nodes="many")], "Thread.nodes is 'many'"),
    "thread: no length": (lambda: [body(), reel(), thread(length=0.0)], "Thread.length is 0.0"),
    "thread: no density": (lambda: [body(), reel(), thread(line_density=0.0)], "Thread.line_density is 0.0"),
    "thread: negative tip": (lambda: [body(), reel(), thread(tip_mass=-1.0)], "Thread.tip_mass is -1.0"),
    "thread: no stiffness": (lambda: [body(), reel(), thread(stiffness=0.0)], "blade.stiffness is 0.0"),
    "thread: negative damping": (lambda: [body(), reel(), thread(damping=-1.0)], "Thread.damping is -1.0"),
    "thread: unknown segments": (lambda: [body(), reel(), thread(segments="spring")], "did you mean 'springs'"),
    "thread: unknown wound mass": (lambda: [body(), reel(), thread(wound_mass="carry")], "did you mean 'carried'"),
    "thread: no copies": (lambda: [body(), reel(), thread(multiplicity=0)], "Thread.multiplicity is 0"),
    "thread: copies on a free body": (lambda: [free(), reel(), thread(multiplicity=2)], "blade.multiplicity is 2"),
    "thread: no capture": (lambda: [body(), reel(), thread(capture_fraction=0.0)], "Thread.capture_fraction is 0.0"),
    "drive: more out than there is": (
        lambda: [body(), reel(drive=parts.ConstantDrive(rate=1.0, angle=600.0)), thread()],
        "more",
    ),
    "drive: negative angle": (
        lambda: [body(), reel(drive=parts.ConstantDrive(rate=1.0, angle=-1.0)), thread()],
        "reel.drive.angle is",
    ),
    "drive: rate nan": (
        lambda: [body(), reel(drive=parts.ConstantDrive(rate=nan)), thread()],
        "ConstantDrive.rate is nan",
    ),
    "ramp: out of order": (
        lambda: [body(), reel(drive=parts.RampDrive(steps=[(2.0, 1.0, 1.0), (1.0, 1.0, 2.0)])), thread()],
        "1.0 s",
    ),
    "ramp: negative duration": (
        lambda: [body(), reel(drive=parts.RampDrive(steps=[(2.0, -1.0, 1.0)])), thread()],
        "RampDrive.steps.0.1 is -1.0",
    ),
    "ramp: rate nan": (
        lambda: [body(), reel(drive=parts.RampDrive(steps=[(2.0, 1.0, nan)])), thread()],
        "RampDrive.steps.0.2 is nan",
    ),
    "table: nan": (lambda: [body(), table(rate=(0.0, nan)), thread()], "TableDrive.rate.1 is nan"),
    "table: time nan": (lambda: [body(), table(time=(nan, 1.0)), thread()], "TableDrive.time is (nan, 1.0)"),
    "table: backwards": (lambda: [body(), table(time=(1.0, 0.0)), thread()], "row 2"),
    "table: one row": (lambda: [body(), table(time=(1.0,), rate=(1.0,)), thread()], "two or more"),
    "table: unequal": (lambda: [body(), table(rate=(0.0, 1.0, 2.0)), thread()], "3 values"),
    "table: rate and angle": (lambda: [body(), table(angle=(0.0, 1.0)), thread()], "either rate or angle"),
    "table: neither": (lambda: [body(), table(rate=None), thread()], "either rate or angle"),
    "drive: of another kind": (
        lambda: [body(), reel(drive=parts.LawDrive(law=linear)), thread()],
        "drive.law is the law 'linear'",
    ),
    "free spool: negative inertia": (
        lambda: [body(), reel(drive=parts.FreeSpool(inertia=-1.0)), thread()],
        "FreeSpool.inertia is -1.0",
    ),
    "uniform: unknown thread": (
        lambda: [*BLADE, parts.Load(along="blad", force=(0, 0, 1))],
        "did you mean 'blade'",
    ),
    "uniform: force": (
        lambda: [*BLADE, parts.Load(along="blade", force=(0, 0))],
        "Load.force is (0, 0)",
    ),
    "uniform: frame": (
        lambda: [*BLADE, parts.Load(along="blade", force=(0, 0, 1), frame="bodi")],
        "did you mean 'body'",
    ),
    "light: specular": (
        lambda: [*BLADE, parts.Radiation(along="blade", pressure=1e-6, width=0.1, specular=1.1)],
        "specular is 1.1",
    ),
    "light: pressure": (
        lambda: [*BLADE, parts.Radiation(along="blade", pressure=-1.0, width=0.1, specular=1.0)],
        "pressure is -1.0",
    ),
    "light: width": (
        lambda: [*BLADE, parts.Radiation(along="blade", pressure=1e-6, width=nan, specular=1.0)],
        "width is nan",
    ),
    "law load: undecorated": (lambda: [*BLADE, parts.Load(along="blade", law=plain)], "@evolvent.law"),
    "law load: of another kind": (lambda: [*BLADE, parts.Load(along="blade", law=linear)], "the law 'linear'"),
    "force: body frame on a point": (
        lambda: [POINT, parts.Load(at="point-1", force=(1, 0, 0), frame="body")],
        "load-1.at is 'point-1'",
    ),
    "force: over before it starts": (
        lambda: [POINT, parts.Load(at="point-1", force=(1, 0, 0), start=2.0, until=1.0)],
        "load-1.until",
    ),
    "torque: on a point": (lambda: [POINT, parts.Load(at="point-1", torque=(1, 0, 0))], "load-1.at is 'point-1'"),
    "event: undecorated": (lambda: [POINT, parts.Event(law=plain)], "@evolvent.law"),
}


@pytest.mark.parametrize(("listed", "words"), BAD.values(), ids=BAD.keys())
def test_bad_input_gives_one_clear_line(listed, words):
    with pytest.raises(InputError) as caught:
        assemble(*listed())
    message = str(caught.value)
    assert words in message
    assert "\n" not in message
    assert len(message) < 260  # with the path and line of a law


@pytest.mark.slow
def test_what_the_bad_inputs_are_made_from_is_good():
    """Each case above differs from one of these in one thing."""
    assert assemble(*BLADE).model.threads.size == 1
    assert assemble(free(), reel(), thread()).model.threads.size == 1
    assert assemble(body(), table(), thread()).model.threads.size == 1
    assert assemble(POINT, parts.Joint(type="link", **AT)).model.rows.size == 1
    assert assemble(POINT, parts.Spring(**AT, law=linear, parameters=(1.0,))).model.springs.size == 1
    assert assemble(*BLADE, parts.Load(along="blade", law=drag, parameters=(1.0,))).model.loads.size == 1


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


def test_a_name_is_taken_once():
    system = System()
    system.add(body(), "hub")
    with pytest.raises(InputError, match="'hub' is already taken"):
        system.add(POINT, "hub")
    with pytest.raises(InputError, match="'ground', which is the inertial frame"):
        system.add(POINT, "ground")


def test_parts_may_be_added_in_any_order():
    first, last = System(), System()
    for system, order in ((first, (0, 1, 2)), (last, (2, 1, 0))):
        for k in order:
            system.add(BLADE[k], ("hub", "reel", "blade")[k])
    np.testing.assert_array_equal(first.assemble().y, last.assemble().y)


def test_parts_in_a_circle_are_refused():
    system = System()
    system.add(parts.Point(mass=1.0, at="b"), "a")
    system.add(parts.Point(mass=1.0, at="a"), "b")
    with pytest.raises(
        InputError, match="the parts 'a' -> 'b' -> 'a' refer to one another in a cycle; one of them must"
    ):
        system.assemble()


@pytest.mark.parametrize(
    "part", [parts.Spring(a="bob", b="bob", stiffness=1.0), parts.Joint(a="bob", b="bob", type="link", length=1.0)]
)
def test_two_ends_at_one_place_are_refused(part):
    system = System()
    system.add(POINT, "bob")
    system.add(part, "rod")
    with pytest.raises(InputError, match=r"rod\.a and rod\.b are the same point, 'bob'; give two points"):
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


@pytest.mark.parametrize("part", [POINT, body(), reel(), thread(), parts.Spring(**AT), parts.Joint(type="link", **AT)])
def test_parts_are_frozen(part):
    with pytest.raises(InputError, match=f"{type(part).__name__}.kind cannot be changed; make another one"):
        part.kind = None


def test_another_part_with_other_values_is_checked():
    assert POINT.replaced(mass="2 g") == parts.Point(mass=0.002, position=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"Point.mass is -1"):
        POINT.replaced(mass=-1)


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
    drive = parts.ConstantDrive(rate=3.5, angle=150.0)  # 1.5 m of 5 m: 2 of 4 nodes
    assembly = assemble(body(), reel(drive=drive, centre=(0.05, 0.0, 0.0)), thread())
    first = int(assembly.model.threads["iq"][0])
    v = int(assembly.model.threads["iv"][0])
    x = assembly.y[first : first + 6].reshape(2, 3)
    np.testing.assert_allclose(x, [[1.55, 0.0, 0.01], [0.3, 0.0, 0.01]], atol=1e-14)
    speeds = assembly.y[v : v + 6].reshape(2, 3)
    np.testing.assert_allclose(speeds, [[0.035, 6.0 * 1.55, 0.0], [0.035, 6.0 * 0.3, 0.0]], atol=1e-13)
    assert assembly.s[0] == 2


@pytest.mark.parametrize("where", [3.0, (), (1.0, 2.0, 3.0, 4.0)])
def test_what_is_no_place_is_refused(where: object) -> None:
    with pytest.raises(InputError, match=r"Joint.a is .*; it must be a point: a part's name, 'boom.tip'"):
        parts.Joint(a=where, b="body")
