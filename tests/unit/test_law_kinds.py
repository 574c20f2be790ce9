"""Every decorator of laws with every part that takes a law: the right one is taken, all others are refused by name."""

from __future__ import annotations

import typing

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, parts
from evolvent.compiled.laws import FORMS
from evolvent.families.springs.part_custom import _Law as LawOfPoints
from evolvent.parts.expression import Law
from evolvent_base.schema import Section


def a_force(x, v, t, p):
    return 0.0, 0.0, 0.0


def a_torque(t, x, R, w, p):
    return 0.0, 0.0, 0.0


def a_spring(x, v, t, p):
    return -v


def a_motor(t, x, v, p):
    return -v


def a_drive(t, p):
    return 0.0, 0.0, 0.0


def an_event(t, y, p):
    return t - 100.0


def an_element(t, x, v, p, f):
    return 0.0, 0.0


FUNCTIONS = {
    "force": a_force, "torque": a_torque, "spring": a_spring, "motor": a_motor, "drive": a_drive, "event": an_event,
    "element": an_element,
}  # fmt: skip


@pytest.fixture(scope="module")
def laws():
    """One law under each decorator."""
    return {kind: getattr(evolvent, f"{kind}_law")(function) for kind, function in FUNCTIONS.items()}


def bodies():
    """A body and a point, a hinge, a beam and a rod."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=0.1), "hub")
    system.add(parts.Point(mass=1.0, position=(2.0, 0.0, 0.0)), "point")
    system.add(parts.RigidBody(motion="spin", inertia=1.0, position=(0.0, 5.0, 0.0)), "rotor")
    system.add(parts.JointSpring(a="ground", b="rotor"), "hinge")
    steel = {"young_modulus": 70e9, "poisson_ratio": 0.3, "density": 2700.0}
    section = {"circle": {"radius": 0.01}}
    for name, kind, at in (("beam", parts.Beam, 8.0), ("rod", parts.Rod, 9.0)):
        system.add(kind(length=1.0, section=section, material=steel, elements=2, position=(0.0, at, 0.0)), name)
    return system


def with_part(name, part):
    def add(law):
        system = bodies()
        system.add(part(law), name)
        return system

    return add


def reeled(drive):
    def add(law):
        system = bodies()
        system.add(parts.Reel(body="ground", radius=0.1, drive=drive(law)), "reel")
        system.add(parts.Thread(reel="reel", length=5.0, line_density=1e-3, nodes=4, stiffness=10.0), "line")
        return system

    return add


def loaded(law):
    system = reeled(lambda _: parts.ConstantDrive(rate=0.1))(law)
    system.add(parts.Load(along="line", law=law), "it")
    return system


#: By class and place: the key, the kind of its laws, and a system with one.
PLACES = {
    "Spring": ("it.law", "spring", with_part("it", lambda law: parts.Spring(a=(0, 0, 0), b="point", law=law))),
    "ReactionWheel": (
        "it.law",
        "spring",
        with_part("it", lambda law: parts.ReactionWheel(body="hub", axis=(0, 0, 1), inertia=0.01, law=law)),
    ),
    "Motor": ("it.law", "motor", with_part("it", lambda law: parts.Motor(joint="hinge", law=law))),
    "Field": ("it.law", "force", with_part("it", lambda law: parts.Field(law=law))),
    "Load, along a thread": ("it.law", "force", loaded),
    "Load, along a beam": ("it.law", "force", with_part("it", lambda law: parts.Load(along="beam", law=law))),
    "Load, along a rod": ("it.law", "force", with_part("it", lambda law: parts.Load(along="rod", law=law))),
    "Load": ("it.law", "force", with_part("it", lambda law: parts.Load(at="hub", law=law))),
    "Load, point": ("it.law", "force", with_part("it", lambda law: parts.Load(at="point", law=law))),
    "Load, node": ("it.law", "force", with_part("it", lambda law: parts.Load(at="beam.tip", law=law))),
    "Load, rod": ("it.law", "force", with_part("it", lambda law: parts.Load(at="rod.tip", law=law))),
    "Load, torque": ("it.law", "torque", with_part("it", lambda law: parts.Load(at="hub", type="torque", law=law))),
    "Load, torque on a rod": (
        "it.law",
        "torque",
        with_part("it", lambda law: parts.Load(at="rod.tip", type="torque", law=law)),
    ),
    "Event": ("it.law", "event", with_part("it", lambda law: parts.Event(law=law))),
    "CustomForce": ("it.law", "element", with_part("it", lambda law: parts.CustomForce(points=["point"], law=law))),
    "LawDrive": ("reel.drive.law", "drive", reeled(lambda law: parts.LawDrive(law=law))),
    "FreeSpool": ("reel.drive.law", "spring", reeled(lambda law: parts.FreeSpool(inertia=0.1, law=law))),
}


def _annotations(found):
    """An annotation and all within it."""
    yield found
    for inner in (*typing.get_args(found), *getattr(found, "__metadata__", ())):
        yield from _annotations(inner)


def _classes(kind):
    for one in kind.__subclasses__():
        yield one
        yield from _classes(one)


def test_every_part_with_a_law_is_here():
    assert parts.__all__  # loads the modules of all
    found = set()
    own = (one for one in _classes(Section) if one.__module__.startswith("evolvent."))  # not those of other tests
    for one in own:
        for field in one.model_fields.values():
            within = [*_annotations(field.annotation), *field.metadata]
            if any(isinstance(a, LawOfPoints) or (isinstance(a, Law) and a.python) for a in within):
                found.add(one.__name__)
    assert found == {place.partition(",")[0] for place in PLACES}
    assert set(FUNCTIONS) == set(FORMS)


@pytest.mark.parametrize("place", PLACES)
def test_the_wrong_decorator_is_refused(place, laws):
    key, wanted, add = PLACES[place]
    for kind, law in laws.items():
        if kind == wanted or (wanted == "torque" and kind == "force"):
            add(law).assemble()
            continue
        with pytest.raises(InputError) as caught:
            add(law).assemble()
        said = str(caught.value)
        assert said.startswith(f"{key} is '{FUNCTIONS[kind].__name__}', a law under @evolvent.{kind}_law;")
        assert f"it must be decorated with @evolvent.{wanted}_law, as {FORMS[wanted]}" in said
    with pytest.raises(InputError, match=f"{key} is '{FUNCTIONS[wanted].__name__}', a function under no decorator"):
        add(FUNCTIONS[wanted]).assemble()


def test_one_function_under_two_decorators(laws):
    """The kind is that of the decorator, not of the function."""
    both = evolvent.spring_law(a_motor)
    _, _, spring = PLACES["Spring"]
    _, _, motor = PLACES["Motor"]
    spring(both).assemble()
    motor(laws["motor"]).assemble()
    with pytest.raises(InputError, match=r"@evolvent\.spring_law; it must be decorated with @evolvent\.motor_law"):
        motor(both).assemble()


@pytest.mark.slow
def test_a_brake_under_each_decorator():
    """v' = -c v: the right one is exp(-c t), the wrong one is not run."""

    def wheel(law):
        system = System()
        system.add(parts.RigidBody(motion="spin", inertia=1, rate=1), "wheel")
        system.add(parts.JointSpring(a="ground", b="wheel"), "hinge")
        system.add(parts.Motor(joint="hinge", law=law, parameters=(0.5,)), "motor")
        return system

    def brake(t, x, v, p):
        return -p[0] * v

    run = wheel(evolvent.motor_law(brake)).simulate(until="2 s")
    assert float(run["wheel"].rate[-1, 2]) == pytest.approx(np.exp(-1.0), rel=1e-5)
    with pytest.raises(InputError, match=r"motor\.law is 'brake', a law under @evolvent\.spring_law"):
        wheel(evolvent.spring_law(brake)).simulate(until="2 s")
