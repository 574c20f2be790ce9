"""Functions of every form with every part that takes a law: the right ones are taken, others refused by name."""

from __future__ import annotations

import inspect
import re
import typing

import numpy as np
import pytest
from numba import config

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


def misplaced(x, t, v, p):
    return -v


def a_drive(t, p):
    return 0.0, 0.0, 0.0


def an_event(t, y, p):
    return t - 100.0


def an_element(t, x, v, p, f):
    return 0.0, 0.0


FUNCTIONS = {
    "force": a_force, "torque": a_torque, "spring": a_spring, "drive": a_drive, "event": an_event,
    "element": an_element,
}  # fmt: skip
#: Kinds of which a key takes a function of each kind.
TAKES = {kind: [kind] for kind in FUNCTIONS} | {"torque": ["torque", "force"]}


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
    "Motor": ("it.law", "spring", with_part("it", lambda law: parts.Motor(joint="hinge", law=law))),
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


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="functions of as many arguments differ where they are compiled")
@pytest.mark.parametrize("place", PLACES)
def test_a_function_of_other_arguments_is_refused(place):
    key, wanted, add = PLACES[place]
    for kind, function in FUNCTIONS.items():
        if kind in TAKES[wanted]:
            add(evolvent.law(function)).assemble()
            continue
        with pytest.raises(InputError) as caught:
            add(evolvent.law(function)).assemble()
        said = str(caught.value)
        assert said.startswith((f"{key} is the law {function.__name__!r}", f"{key}: the law "))
        assert any(FORMS[one].text in said for one in TAKES[wanted])
    with pytest.raises(
        InputError, match=f"{key} is '{FUNCTIONS[wanted].__name__}', a function that is no law; decorate"
    ):
        add(FUNCTIONS[wanted]).assemble()


@pytest.mark.parametrize("place", ["Spring", "Motor", "FreeSpool", "Field", "Load", "Load, torque"])
def test_the_time_is_the_third_argument_or_the_first(place):
    key, wanted, add = PLACES[place]
    with pytest.raises(InputError, match=rf"^{key} is the law 'misplaced' .* has the time as argument 2; it must"):
        add(evolvent.law(misplaced)).assemble()
    if wanted == "spring":
        add(evolvent.law(a_motor)).assemble()


def test_one_law_in_two_parts():
    """The part says how the function is called."""
    both = evolvent.law(a_motor)
    for place in ("Spring", "Motor"):
        PLACES[place][2](both).assemble()


@pytest.mark.parametrize("place", [place for place in PLACES if "," not in place])
def test_the_list_of_parts_shows_how_a_law_is_called(place):
    """With as many arguments as the form has, under names of the part's own, and the time where it may be."""
    kind = getattr(parts, place)
    form = FORMS[PLACES[place][1]]
    shown = re.findall(r"``law\(([^)]*)\)\s*->\s*([^`]*)``", inspect.getdoc(kind) or "")
    assert shown
    for arguments, _ in shown:
        names = [name.strip() for name in arguments.split(",")]
        assert any(len(names) == len(order) and names[order.index("t")] == "t" for order in form.orders) or (
            names == list(FORMS["torque"].arguments)
        )


@pytest.mark.slow
@pytest.mark.parametrize("first", ["x", "t"])
def test_a_brake(first):
    """v' = -c v is exp(-c t), in either order of arguments."""

    def brake(x, v, t, p):
        return -p[0] * v

    def time_first(t, x, v, p):
        return -p[0] * v

    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1, rate=1), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel"), "hinge")
    law = evolvent.law(brake if first == "x" else time_first)
    system.add(parts.Motor(joint="hinge", law=law, parameters=(0.5,)), "motor")
    run = system.simulate(until="2 s")
    assert float(run["wheel"].rate[-1, 2]) == pytest.approx(np.exp(-1.0), rel=1e-5)
