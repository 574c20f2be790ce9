"""Bad input is refused in one sentence that names the key, the value, what is allowed and the nearest valid name."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest

from evolvent import InputError, RunFailed, System, cases, parts
from evolvent.analysis import closure
from evolvent.compiled import laws
from evolvent.results import variables
from evolvent.solvers.common import hints
from evolvent_base.errors import counted
from rods.building import RUBBER, STRIP

BOB = {"kind": "point", "mass": "1 kg", "position": [0, 0, "1 m"]}
WHEEL = {"kind": "rigid-body", "inertia": "1 kg m^2", "motion": "spin", "axis": [0, 0, 1]}
PUSH = {"kind": "load", "at": "bob", "direction": [0, 0, 1]}
SPRING = {"kind": "spring", "a": [0, 0, 0], "b": "bob", "length": "0.5 m"}


def with_part(**keys: Any) -> dict[str, Any]:
    return {"system": "structure", "parts": {"bob": BOB, "wheel": WHEEL, "x": keys}}


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "top-level key": ({"partz": {"bob": BOB}}, "unknown key 'partz'; did you mean 'parts'?"),
    "key system": ({"systm": "heliogyro"}, "unknown key 'systm'; did you mean 'system'?"),
    "kind of a profile": (
        with_part(**PUSH, profile={"kind": "sin", "amplitude": 1}),
        "parts.x.profile is {'kind': 'sin', 'amplitude': 1}; the kind is the key of a mapping; did you mean "
        "{sine: ...}?",
    ),
    "unknown kind of a profile": (
        with_part(**PUSH, profile={"kind": "qqq"}),
        "'qqq' is not a kind; known: constant, expression, pulse, ramp, sine, table",
    ),
    "kind of a drive": (
        with_part(kind="joint", a="ground", b="wheel", type="revolute", drive={"kind": "ramp", "rate": 1}),
        "did you mean {ramp: ...}?",
    ),
    "drive as a word": (
        with_part(kind="joint", a="ground", b="wheel", type="revolute", drive="constnt"),
        "parts.x.drive is 'constnt'; the kind is the key of a mapping; did you mean {constant: ...}?",
    ),
    "axis by name": (with_part(**WHEEL | {"axis": "-Z"}), "it is not a list; did you mean [0, 0, -1]?"),
    "unused constant": (
        with_part(**SPRING, law="-k*x", constants={"k": 10, "k3": 4}),
        "x.constants has 'k3', which x.law, '-k*x', does not use; leave it out, or use it",
    ),
    "unused constant of a profile": (
        with_part(**PUSH, profile={"expression": "a*t", "constants": {"a": 1, "b": 4}}),
        "x.profile.constants has 'b', which x.profile.expression, 'a*t', does not use",
    ),
    "unused constant of a drive": (
        with_part(
            kind="joint", a="ground", b="wheel", type="revolute", drive={"expression": "t", "constants": {"w": 4}}
        ),
        "has 'w', which x.expression, 't', does not use",
    ),
    "constants without a law": (
        with_part(**SPRING, stiffness=1, constants={"k": 10}),
        "x.constants is given without x.law",
    ),
    "quaternion": (
        with_part(kind="rigid-body", mass=1, inertia=1, orientation=[1, 0, 0, 1]),
        "of length 1; its length is 1.41421; normalised it is [0.7071067811865475, 0.0, 0.0, 0.7071067811865475]",
    ),
    "mixed units": (
        with_part(kind="point", mass=1, position=["1 cm", 2, 3]),
        "'1 cm' has a unit and 2 has none; give every value its unit, or one unit in the last entry alone",
    ),
    "mixed units of a drive": (
        with_part(
            kind="joint",
            a="ground",
            b="wheel",
            type="revolute",
            drive={"table": {"time": [0, 1, 2], "rate": ["1 rpm", 2, 3]}},
        ),
        "'1 rpm' has a unit and 2 has none",
    ),
    "one value": (with_part(kind="point", mass=1, position=[1]), "it has 1 value"),
    "panel on the ground": (
        with_part(kind="radiation", at=[0, 0, 1], area=1, normal=[0, 0, 1], pressure=1),
        "x.at is (0.0, 0.0, 1.0), on the ground, which no load moves",
    ),
    "thruster on the ground": (
        with_part(kind="thruster", at=[0, 0, 1], direction=[0, 0, 1], thrust=1),
        "x.at is (0.0, 0.0, 1.0), on the ground, which no load moves",
    ),
    "travel on an angle": (
        with_part(kind="joint", a="ground", b="wheel", type="revolute", drive={"constant": {"rate": "1 m/s"}}),
        "x.drive.rate is 1 m/s, but its coordinate is an angle; give it in rad/s",
    ),
    "stiffness of a travel on an angle": (
        with_part(kind="joint-spring", a="ground", b="wheel", stiffness="5 N/m"),
        "x.stiffness is 5 N/m, but its coordinate is an angle; give it in N m/rad",
    ),
    "stiffness of a rotation between points": (
        with_part(kind="joint", a="ground", b="bob", stiffness="3 N m/rad"),
        "x.stiffness is 3 N m/rad; of a joint of type 'spherical' it is in N/m",
    ),
    "a drive of no motion": (
        with_part(kind="joint", a="ground", b="wheel", drive={"constant": {"rate": 1}}),
        "x.drive is given, but x.type is 'spherical', not 'revolute' or 'point-on-line' or 'involute'",
    ),
    "a drive about another axis": (
        with_part(
            kind="joint", a="ground", b="wheel", type="revolute", axis=[1, 0, 0], drive={"constant": {"rate": 0}}
        ),
        "x.axis is (1.0, 0.0, 0.0), but 'wheel' spins about [0.0, 0.0, 1.0]; give that axis",
    ),
    "a guide from a body": (
        with_part(kind="joint", a="bob", b="wheel", type="guide"),
        "x.a is 'bob'; of a joint of type 'guide' it must be on the ground",
    ),
    "one end": (with_part(kind="joint", b="wheel"), "x.a is missing; x.type 'spherical' needs it"),
    "angle on a travel": (
        with_part(kind="joint", a="ground", b="bob", type="point-on-line", drive={"constant": {"rate": "6 rpm"}}),
        "x.drive.rate is 0.628319 rad/s, but its coordinate is a travel; give it in m/s",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_case_is_refused(name: str) -> None:
    content, words = REFUSED[name]
    with pytest.raises(InputError) as refused:
        cases.system("structure").build(cases.load(content)).assemble()
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a 1\nc:\n  <<: *a\n", "line 1, column 4: the merge key '<<' takes a mapping, as in <<: *name"),
        ("a:\n\tb: 1\n", "line 2, column 1: a tab is not allowed here; indent with spaces"),
        ("a: *x\n", "*x refers to &x, which is not defined above"),
        ("a: [1, 2}\n", "a comma or the closing ] is missing before this character"),
        ("a: {b: 1\n", "a comma or the closing } is missing before this character"),
        ("a: 1\n  b: 2\n", "line 2, column 4: a ':' is not allowed here; check the indentation"),
        ("a:\n  b: 1\n c: 2\n", "line 3, column 2: this line does not fit those above"),
        ("a: 'b\n", "a quotation mark is opened but not closed"),
        ("a: @b\n", "a value cannot begin with @; put it in quotation marks"),
        ("a: 1\n---\nb: 1\n", "a second document begins with '---'"),
        ("a: &x 1\nb: &x 2\n", "is defined twice"),
        ('a: "\\q"\n', "\\q is no escape sequence; write \\\\q"),
        ("a: !foo 3\n", "the tag !foo is not supported; write a plain value"),
        ("a: !!binary 3\n", "the tag !!binary is not supported"),
        ("a: \x01\n", "the character '\\x01' at position 3 is not allowed"),
    ],
)
def test_words_for_errors_of_yaml(text: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        cases.parse_yaml(text, "case.yaml")
    assert str(refused.value).startswith("case.yaml")
    assert words in str(refused.value)


def test_a_quaternion_of_rounded_numbers_is_normalised() -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, orientation=(0.9659258, 0, 0, 0.2588190)), "body")
    assembly = system.assemble()
    assert math.hypot(*assembly.y[3:7]) == pytest.approx(1.0, abs=1e-15)


def test_zeros_need_no_unit() -> None:
    assert parts.Point(mass=1.0, position=("1 cm", 0, 0.0)).position == (0.01, 0.0, 0.0)
    assert parts.Point(mass=1.0, position=(1, 2, "3 cm")).position == (0.01, 0.02, 0.03)


def test_singular_and_plural() -> None:
    assert [counted(1, "value"), counted(2, "value"), counted(0.9999999, "radius", "radii")] == [
        "1 value", "2 values", "1 radius"
    ]  # fmt: skip
    assert counted(1.5, "radius", "radii") == "1.5 radii"


def test_gravity_is_written_with_its_unit() -> None:
    system = System(gravity=(0, 0, -9.81))
    system.add(parts.Point(mass=1.0), "bob")
    assert "gravity: [0.0, 0.0, -9.81 m/s^2]" in system.to_yaml()
    assert cases.load(cases.parse_yaml(system.to_yaml(), "case")).gravity == (0.0, 0.0, -9.81)


def on_spring(**law: Any) -> System:
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.5, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", length=1.0, **law), "spring")
    return system


def test_a_law_that_returns_too_few_numbers_is_named() -> None:
    def short(x, v, t, p):
        return 1.0, 2.0

    words = r"the law 'short' .*returns .*2.*; it must (return three|be law).* \(fx, fy, fz\)"
    with pytest.raises(InputError, match=words):
        laws.try_law(laws.law(short).of("force"), np.zeros(3), np.zeros(3), 0.0, np.zeros(0), kind="force")


def test_a_law_that_returns_too_many_numbers_is_named() -> None:
    def long(x, v, t, p):
        return 1.0, 2.0

    with pytest.raises(InputError, match=r"'long' .*returns .*; it must (return one finite|be law)"):
        laws.try_law(laws.law(long).of("spring"), 0.0, 0.0, 0.0, np.zeros(0), kind="spring")


def test_a_law_that_is_not_finite_at_the_start_is_named() -> None:
    words = (
        r"'spring' at t = 0 s: the expression 'sqrt\(t-1\)' returns nan; it must return one finite number, the force"
    )
    with pytest.raises(InputError, match=words):
        on_spring(law="sqrt(t-1)").simulate(until=1.0, method="dopri5")


@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha", "energy-momentum"])
def test_a_law_that_is_not_finite_in_a_run_is_named(method: str) -> None:
    words = r"at t = 0\.5\d* s 'spring': the expression 'sqrt\(0\.5-t\)' returns nan; it must return one finite number"
    with pytest.raises(RunFailed, match=words) as failed:
        on_spring(law="sqrt(0.5-t)").simulate(until=1.0, every=0.1, method=method)
    assert failed.value.run["time"].values[-1] > 0.3


def test_an_unknown_axis_is_named() -> None:
    run = on_spring(stiffness=1.0).simulate(until=0.1, every=0.05, method="dopri5")
    with pytest.raises(InputError, match=r"'bob\.velocity\.q': the variable has no component 'q'; known: x, y, z"):
        variables.get(run, "bob.velocity.q")


@pytest.mark.parametrize(
    ("add", "warns"),
    [
        (None, True),
        (parts.Load(at="tether[2]", force=(1.0, 0.0, 0.0)), True),
        (parts.Load(at="tether.tip", force=(1.0, 0.0, 0.0)), False),
        (parts.Load(at="tether[0]", force=(1.0, 0.0, 0.0)), False),
        (parts.Field(law=["1", "0", "0"]), False),
    ],
)
def test_only_loads_on_the_tip_suppress_the_warning_about_it(add: Any, warns: bool) -> None:
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=80.0)
    system.add(parts.Reel(body="hub", centre=(0.1, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=0.1, nodes=4, stiffness=1e3, tip_mass=0.5), "tether")
    system.add(parts.Load(along="tether", law=["1", "0", "0"]), "wind")
    if add is not None:
        system.add(add, "more")
    assert ("acts per length of 'tether'" in closure.unloaded_tips(system.assemble())) == warns


def test_a_load_of_a_kind_of_its_own_counts_as_one() -> None:
    """Of a plug-in, derived from a load."""

    class Gust(parts.Load):
        kind: Literal["gust"] = "gust"  # type: ignore[assignment]

    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=80.0)
    system.add(parts.Reel(body="hub", centre=(0.1, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=0.1, nodes=4, stiffness=1e3, tip_mass=0.5), "tether")
    system.add(Gust(along="tether", law=["1", "0", "0"]), "gust")
    assert "'gust' acts per length of 'tether'" in closure.unloaded_tips(system.assemble())


@pytest.mark.parametrize(("angle", "named"), [(70.0, False), (95.0, True)])
def test_only_elements_that_are_bent_far_are_named(angle: float, named: bool) -> None:
    """A rod of one element, bent in its state: 70 degrees are no cause of a failure, whose limit is 120."""
    system = System()
    rod = parts.Rod(length=1.0, elements=1, section=STRIP, material=RUBBER)
    system.add(rod, "rod")
    assembly = system.assemble()
    y = assembly.y.copy()
    first, last = (int(body["iq"]) + 3 for body in assembly.model.bodies[-2:])
    y[last : last + 4] = _after(y[first : first + 4], math.radians(angle))
    assert ("'rod' is bent or twisted" in hints.hints_on(assembly, y)) == named


def _after(q: np.ndarray, angle: float) -> np.ndarray:
    """Quaternion of a turn about the third body axis after q."""
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    w, x, y, z = q
    return np.array([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s])
