"""Drives as sections: mappings and Python, round trips, expressions, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, law as user_law, parts
from evolvent.assembly.builder import Builder
from evolvent.parts import law
from evolvent.parts.base import Part
from evolvent.solvers import solve


class Holder(Part):
    """A part that holds a drive, and nothing else."""

    drive: law.Drive | None = None
    path: law.PathDrive | None = None


@user_law
def steady(t, p):  # type: ignore[no-untyped-def]
    return p[0] * t, p[0], 0.0


def motion(drive: Any, times: Any) -> np.ndarray:
    """(angle, rate, acceleration) of a drive at times."""
    builder = Builder(np.zeros(3))
    row = drive.write(builder, "drive")
    return np.array([drive.at(builder, row, float(t)) for t in times])


PYTHON = {
    "constant": (parts.ConstantDrive(rate=3.5, angle=2.0), {"constant": {"rate": "3.5 rad/s", "angle": "2.0 rad"}}),
    "ramp": (
        parts.RampDrive(rate=1.0, steps=[(1, 2, "30 deg/s")]),
        {"ramp": {"rate": "1.0 rad/s", "steps": [["1.0 s", "2.0 s", f"{math.pi / 6!r} rad/s"]]}},
    ),
    "table": (
        parts.TableDrive(time=np.array([0.0, 1.0, 3.0]), rate=np.array([0.0, 2.0, 2.0]), start=0.5),
        {
            "table": {
                "time": [0.0, 1.0, "3.0 s"],
                "rate": ["0.0 rad/s", "2.0 rad/s", "2.0 rad/s"],
                "start": "0.5 rad",
            }
        },
    ),
    "angles": (
        parts.TableDrive(time=[0.0, 1.0, 3.0], angle=[0.0, -2.0, 1.0]),
        {"table": {"time": [0.0, 1.0, "3.0 s"], "angle": ["0.0 rad", "-2.0 rad", "1.0 rad"]}},
    ),
    "free": (
        parts.FreeSpool(inertia="2 kg m^2", torque=-0.1, rate=1.0),
        {"free": {"inertia": "2.0 kg m^2", "torque": "-0.1 N m", "rate": "1.0 rad/s"}},
    ),
    "expression": (
        parts.ExpressionDrive(expression="a*(1 - cos(w*t))", constants={"a": 0.3, "w": 2}),
        {"expression": "a*(1 - cos(w*t))", "constants": {"a": 0.3, "w": 2.0}},
    ),
}


@pytest.mark.parametrize("kind", PYTHON)
def test_round_trip(kind: str) -> None:
    drive, written = PYTHON[kind]
    holder = Holder(drive=drive)
    assert holder.model_dump(mode="json", exclude_defaults=True) == {"drive": written}
    again = Holder.model_validate({"drive": written})
    assert again.model_dump(mode="json") == holder.model_dump(mode="json")
    assert isinstance(again.drive, type(drive))
    times = np.linspace(0.0, 4.0, 9)
    assert motion(again.drive, times).tolist() == motion(drive, times).tolist()


def test_paths_are_in_metres_or_radians() -> None:
    for rate in ("100 mm/s", "0.1 rad/s", 0.1):
        holder = Holder(path={"constant": {"rate": rate}})
        assert holder.path is not None
        assert motion(holder.path, [2.0]).tolist() == [[0.2, 0.1, 0.0]]
        assert Holder.model_validate(holder.model_dump(mode="json", exclude_defaults=True)) == holder


def test_expression_is_differentiated() -> None:
    drive = parts.ExpressionDrive(expression="a*(1 - cos(w*t))", constants={"a": 0.3, "w": 2.0})
    t = np.linspace(0.0, 3.0, 7)
    exact = np.stack([0.3 * (1.0 - np.cos(2.0 * t)), 0.6 * np.sin(2.0 * t), 1.2 * np.cos(2.0 * t)], axis=-1)
    assert motion(drive, t) == pytest.approx(exact, abs=1e-15)


def test_spool_by_an_expression() -> None:
    """A thread paid out by an expression is that paid out by the drive it writes down."""
    found = []
    for drive in (
        parts.ConstantDrive(rate=3.5, angle=100.0),
        parts.ExpressionDrive(expression="100 + r*t", constants={"r": 3.5}),
    ):
        system = System()
        system.add(parts.RigidBody(inertia=0.004, motion="spin", rate=6.0), "wheel")
        system.add(parts.Reel(body="wheel", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
        system.add(parts.Thread(reel="reel", length=2.0, line_density=7e-4, nodes=3, stiffness=1e3), "blade")
        found.append(solve(system.assemble(), samples=[0.0, 0.2], method="rk4", step=1e-5).y[-1])
    assert found[1] == pytest.approx(found[0], rel=1e-9, abs=1e-11)


def test_a_python_law_cannot_stand_in_a_file() -> None:
    holder = Holder(drive=parts.LawDrive(law=steady, parameters=[2.0]))
    with pytest.raises(InputError, match="the law 'steady' is a Python function, which a file cannot hold"):
        holder.model_dump(mode="json")


REFUSED: dict[str, tuple[Any, str]] = {
    "number": (
        3,
        r"^Holder\.drive is 3; it must be a mapping with one of the keys constant, ramp, table, free",
    ),
    "empty": ({}, "it must be a mapping with one of the keys"),
    "two": ({"constant": {"rate": 1}, "ramp": {}}, "it must be a mapping with one of the keys"),
    "unknown": ({"rmap": {}}, r"^Holder\.drive is \{'rmap': \{\}\}; 'rmap' is no drive; did you mean 'ramp'\?$"),
    "inner": ({"ramp": {"rates": 3}}, "unknown key 'Holder.drive.ramp.rates'; did you mean 'Holder.drive.ramp.rate'"),
    "row": ({"ramp": {"steps": [[1, 2]]}}, r"Holder\.drive\.ramp\.steps\.0 is \[1, 2\]; it must have 3 values, not 2"),
    "duration": ({"ramp": {"steps": [[1, -2, 3]]}}, r"Holder\.drive\.ramp\.steps\.0\.1 is -2; .* a time of 0 or above"),
    "missing": ({"free": {}}, r"Holder\.drive\.free\.inertia is missing; it must be a moment of inertia above 0"),
    "unit": ({"constant": {"rate": "3 m/s"}}, r"Holder\.drive\.constant\.rate is '3 m/s'; .* something else"),
    "constants": ({"constant": {"rate": 1}, "constants": {"a": 1}}, "constants go with expression, not with constant"),
    "grammar": ({"expression": "t.x"}, r"Holder\.drive\.expression is 't\.x'; 't\.x' at character 1 is not allowed"),
    "function": ({"expression": steady}, "Holder.drive.expression is .* it must be an expression such as"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    given, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        Holder(drive=given)


WRITTEN: dict[str, tuple[Any, str]] = {
    "angle": (parts.ConstantDrive(rate=1, angle=-1), r"reel\.angle is -1\.0; it must be 0 or above"),
    "order": (parts.RampDrive(steps=[(2, 1, 1), (1, 1, 2)]), r"reel\.steps: the step at 1\.0 s starts before the last"),
    "neither": (parts.TableDrive(time=[0, 1]), "reel: a table needs either rate or angle in addition to time"),
    "sizes": (parts.TableDrive(time=[0, 1], rate=[1]), "reel: the table has 2 times and 1 value;"),
    "times": (parts.TableDrive(time=[0, 1, 1], rate=[1, 1, 1]), r"reel: row 3 of the table is at 1\.0 s, not after"),
    "name": (parts.ExpressionDrive(expression="w*t"), "reel.expression is 'w.t'; 'w' at character 1 is neither a var"),
}


@pytest.mark.parametrize("case", WRITTEN)
def test_refused_where_it_is_written(case: str) -> None:
    drive, message = WRITTEN[case]
    with pytest.raises(InputError, match=message):
        drive.write(Builder(np.zeros(3)), "reel")


def test_path_in_neither_unit() -> None:
    with pytest.raises(InputError, match=r"Holder\.path\.constant\.rate is '1 kg'; it must be an angular rate or"):
        Holder(path={"constant": {"rate": "1 kg"}})


def test_schema() -> None:
    """The JSON schema knows the keys of every kind."""
    schema = Holder.model_json_schema()
    keys = schema["properties"]["drive"]["anyOf"][0]["properties"]
    assert set(keys) == {"constant", "ramp", "table", "free", "feedback", "expression", "constants"}
    rate = schema["$defs"][keys["constant"]["anyOf"][0]["$ref"].rpartition("/")[2]]["properties"]["rate"]
    assert "rad/s" in rate["description"]


def turned(expression: str, *, until: float | None = None, **constants: float) -> System:
    """A wheel whose angle follows an expression, from rest."""
    system = System()
    drive = parts.ExpressionDrive(expression=expression, constants=constants or None)
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "wheel")
    system.add(parts.Joint(a="ground", b="wheel", type="revolute", drive=drive, until=until), "pin")
    return system


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("where(t < 1, 0, 0.3*(t - 1))", r"the rate of pin\.drive jumps from 0 to 0\.3 rad/s at t = 1 s"),
        ("0.3*max(t - t0, 0)", r"the rate of pin\.drive jumps from 0 to 0\.3 rad/s at t = 2 s"),
        ("0.1*abs(2*t - 3) + 0.2*t", r"the rate of pin\.drive jumps from 0 to 0\.4 rad/s at t = 1\.5 s"),
        ("max(0, min(t - 1, 1))", r"the rate of pin\.drive jumps from 0 to 1 rad/s at t = 1 s"),
        ("where(t < 1, t**2, 5)", r"^pin\.drive jumps from 1 to 5 rad at t = 1 s"),
        ("0.5*sign(t - 3)", r"^pin\.drive jumps from -0\.5 to 0\.5 rad at t = 3 s"),
    ],
)
def test_an_expression_that_jumps_is_refused(expression: str, words: str) -> None:
    constants = {"t0": 2.0} if "t0" in expression else {}
    with pytest.raises(InputError, match=words + ", which needs an infinite force; give an expression whose rate"):
        turned(expression, **constants).assemble()
    assert turned(expression, until=0.5, **constants).assemble()  # the joint is released by then


@pytest.mark.parametrize(
    "expression",
    [
        "where(t < 1, 0, 0.3*(t - 1)**2)",
        "2.84 * min(t/20, 1)**3 * (10 - 15*min(t/20, 1) + 6*min(t/20, 1)**2)",
        "where(t < pi, 1 - cos(t), 2 + 0*t)",
        "sin(abs(t - 1)**2) - 1e3*t",
        "where(t < 1, 0, 1e-5*(t - 1)**3) + 100*t",
        "where(t < 3, t**2, log(2 - t))",  # which is not finite from 3 s on
    ],
)
def test_an_expression_that_goes_over_smoothly_is_taken(expression: str) -> None:
    assert turned(expression).assemble()


def test_a_drive_that_begins_with_another_rate_is_explained() -> None:
    words = (
        r"'pin' does not fit the velocities at the start: at t = 0 s its drive has 0\.3 rad/s, and what it moves has 0 "
        r"rad/s; give what it moves 0\.3 rad/s, or a drive that begins with 0 rad/s, such as a ramp"
    )
    with pytest.raises(InputError, match=words):
        turned("0.3*t").simulate(until=1.0)
