"""Loads as sections: what is refused, where they are written, round trips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, cases, elements, law, parts
from evolvent.design.studies.axes import annotation
from evolvent.parts.base import Part

ROWS = [(0, 0), (1, 0.2)]
Y = (0, 1, 0)


@law
def drag(x, v, t, p):  # type: ignore[no-untyped-def]
    return -p[0] * v[0], -p[0] * v[1], -p[0] * v[2]


def system(load: Part) -> System:
    found = System()
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.02, width=0.02)
    found.add(parts.RigidBody(mass=1.0, inertia=1.0, motion="free"), "hub")
    found.add(parts.Point(mass=1.0), "ball")
    found.add(parts.RigidBody(inertia=1.0, motion="spin"), "wheel")
    found.add(parts.Beam(length=1.0, section=section, material=material, elements=3, formulation="cable"), "boom")
    found.add(parts.Reel(body="wheel", radius=0.01, drive=parts.ConstantDrive(rate=3.5, angle=100.0)), "reel")
    found.add(parts.Thread(reel="reel", length=2.0, line_density=7e-4, nodes=3, stiffness=1e3), "blade")
    found.add(load, "load")
    return found


WRITTEN = {
    "force on a body": parts.Load(at="hub", force=(1, 0, "2 N"), frame="body", start="1 s", until="2 s"),
    "force at a point": parts.Load(at=("hub", (0, 0, 1)), direction=Y, profile=ROWS),
    "force on a point": parts.Load(at="ball", direction=Y, profile={"pulse": {"value": "1 N", "duration": 1}}),
    "force on a node": parts.Load(at="boom[1]", force=(1, 2, 3), ramp=1.0),
    "torque": parts.Load(at="hub", torque=(0, 0, "2 N m")),
    "torque of a profile": parts.Load(at="wheel", axis=Y, profile=ROWS),
    "line": parts.Load(along="boom", force=(0, 0, "1 N/m")),
    "line of a profile": parts.Load(along="boom", direction=Y, profile={"constant": "1 N/m"}, until=3.0),
    "distributed": parts.Load(along="boom", torque=(1, 0, "1 N m"), centre=(0, 1, 0), start=1.0),
    "distributed by a profile": parts.Load(along="boom", axis=(0.0, 0.0, 1.0), profile=ROWS),
    "slope": parts.Load(at="boom.tip", slope=1, torque=(0, 0, 1)),
    "uniform": parts.Load(along="blade", force=(0, 0, "1 mN/m"), frame="body"),
    "light": parts.Radiation(along="blade", pressure="4.56 uPa", width="10 cm", specular=0.9),
    "law": parts.Load(along="blade", law=["-c*vx", "-c*vy", "-c*vz"], constants={"c": 1e-3}),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_written_and_read_again(name: str) -> None:
    load = WRITTEN[name]
    model = system(load).assemble().model
    assert model.loads.size + model.beam_loads.size == 1
    written = load.model_dump(mode="json", exclude_defaults=True)
    again = type(load).model_validate({"kind": load.kind, **written})  # type: ignore[attr-defined]
    assert again == load
    assert system(again).assemble().model.parameters.tolist() == model.parameters.tolist()


def test_directions_are_unit_vectors() -> None:
    model = system(parts.Load(at="ball", direction=(0, 3, 4), profile=ROWS)).assemble().model
    assert model.parameters[model.loads["first"][0] :][:3] == pytest.approx([0.0, 0.6, 0.8])
    row = system(parts.Load(along="boom", direction=(0, 3, 4), profile=ROWS)).assemble().model.beam_loads[0]
    assert row["axis"] == pytest.approx([0.0, 0.6, 0.8])


@pytest.mark.parametrize(
    ("keys", "force", "profile"),
    [
        ({"at": "hub"}, "N", "N"),
        ({"along": "boom"}, "N/m", "N/m"),
        ({"along": "boom", "torque": [0, 0, 1]}, "N/m", "N m"),
        ({"at": "hub", "axis": [0, 0, 1]}, "N", "N m"),
        ({"at": "hub", "type": "torque"}, "N", "N m"),
    ],
)
def test_units_of_keys_follow_from_other_keys(keys: dict[str, Any], force: str, profile: str) -> None:
    """As studies, fits and sensitivities find them."""
    content = {"parts": {"load": {"kind": "load", **keys}}}
    for key, unit in (("force.1", force), ("profile.table.1.1", profile), ("profile.ramp.final", profile)):
        reader, _ = annotation(cases.system("structure").Case, f"parts.load.{key}", content)
        assert reader.unit == unit


def test_law_in_python_and_as_expressions() -> None:
    """Three expressions give what a Python law gives."""
    from evolvent.solvers import solve

    found = []
    for load in (
        parts.Load(along="blade", law=drag, parameters=[1e-3]),
        parts.Load(along="blade", law=["-c*vx", "-c*vy", "-c*vz"], constants={"c": 1e-3}),
    ):
        reeled = System()
        reeled.add(parts.RigidBody(inertia=0.004, motion="spin", rate=6.0), "wheel")
        drive = parts.ConstantDrive(rate=3.5, angle=100.0)
        reeled.add(parts.Reel(body="wheel", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
        reeled.add(parts.Thread(reel="reel", length=2.0, line_density=7e-4, nodes=3, stiffness=1e3), "blade")
        reeled.add(load, "air")
        found.append(solve(reeled.assemble(), samples=[0.0, 0.05], method="rk4", step=1e-5).y[-1])
    assert found[1] == pytest.approx(found[0], rel=1e-12, abs=1e-14)
    assert np.all(np.isfinite(found[0]))


REFUSED: dict[str, tuple[Any, str]] = {
    "no vector": (lambda: parts.Load(at="hub"), "load.force is missing; give force, torque, direction and profile"),
    "both": (
        lambda: parts.Load(at="hub", force=Y, profile=ROWS),
        "load.force and load.profile are both given; leave one of them out",
    ),
    "both directions": (
        lambda: parts.Load(at="hub", torque=Y, axis=Y),
        "load.torque and load.axis are both given; leave one of them out",
    ),
    "no profile": (lambda: parts.Load(at="hub", axis=Y), "load.profile is missing"),
    "no direction": (lambda: parts.Load(at="hub", profile=ROWS), "load.direction is missing"),
    "unknown": (lambda: parts.Load(at="hbu", force=Y), "'load' refers to 'hbu', .* did you mean 'hub'"),
    "whole beam": (lambda: parts.Load(at="boom", force=Y), r"load.at is 'boom'; 'boom' is a beam; give .* 'boom.tip'"),
    "no node": (lambda: parts.Load(at="boom.end", force=Y), "'boom' has no 'end'; give 'boom.root'"),
    "far node": (lambda: parts.Load(at="boom[9]", force=Y), r"'boom' has no node 9; .* 'boom\[3\]'"),
    "point of a body": (lambda: parts.Load(at="hub.tip", force=Y), r"'hub' has no point 'tip'"),
    "body axes of a node": (lambda: parts.Load(at="boom.tip", force=Y, frame="body"), "load.frame is 'body', but"),
    "body axes of a point": (lambda: parts.Load(at="ball", force=Y, frame="body"), "load.at is 'ball'; .* a body"),
    "torque on a point": (lambda: parts.Load(at="ball", torque=Y), "load.at is 'ball'; this load needs a body"),
    "torque on a node": (lambda: parts.Load(at="boom.tip", torque=Y, frame="body"), "load.frame is 'body', but"),
    "frame": (lambda: parts.Load(at="hub", force=Y, frame="bdy"), "Load.frame is 'bdy'; did you mean 'body'"),
    "times": (
        lambda: parts.Load(at="hub", force=Y, start=2, until=1),
        "load.until is 1.0 s; it must be after load.start, 2.0 s",
    ),
    "times of a node": (lambda: parts.Load(at="boom.tip", force=Y, start=2, until=1), "load.until is 1.0 s; .* 2.0 s"),
    "ramp": (lambda: parts.Load(at="hub", force=Y, ramp=-1), "Load.ramp is -1; it must be a time of 0 or above"),
    "unit": (lambda: parts.Load(at="hub", torque=(0, 0, "1 N")), "load.torque has the unit N; it must be in N m"),
    "zero axis": (lambda: parts.Load(at="hub", axis=(0, 0, 0), profile=ROWS), "Load.axis is .* not all zero"),
    "no place": (lambda: parts.Load(force=Y), "load.at is missing; give at, along or over"),
    "two places": (lambda: parts.Load(at="hub", along="boom", force=Y), "load.at and load.along are both given"),
    "type": (
        lambda: parts.Load(at="hub", type="torque", force=Y),
        "force is given, but load.type is 'torque', not 'fo",
    ),
    "both vectors": (lambda: parts.Load(at="hub", torque=Y, force=Y), "load.force and load.torque are both given"),
    "unit of a point": (
        lambda: parts.Load(at="hub", force=(0, 0, "1 N/m")),
        "load.force has the unit N/m; it must be in N",
    ),
    "unit along": (
        lambda: parts.Load(along="boom", force=(0, 0, "1 N")),
        "load.force has the unit N; it must be in N/m",
    ),
    "line: none": (lambda: parts.Load(along="boom", type="force"), "force is missing; give force, direction and prof"),
    "line: direction": (
        lambda: parts.Load(along="boom", force=Y, direction=Y),
        "load.force and load.direction are both given",
    ),
    "line: frame": (lambda: parts.Load(along="boom", force=Y, frame="body"), "along which a load has inertial axes"),
    "line: profile": (lambda: parts.Load(along="boom", profile=ROWS), "load.direction is missing; it goes with"),
    "line: beam": (
        lambda: parts.Load(along="hub", force=Y),
        "load.along is 'hub'; it must be a beam, a rod, a thread or an edge of a surface; known: ",
    ),
    "distributed: none": (
        lambda: parts.Load(along="boom", type="torque"),
        "load.torque is missing; give torque, axis and profile, or law",
    ),
    "distributed: law": (lambda: parts.Load(along="boom", type="torque", law=["x", "y", "z"]), "'boom' has no law"),
    "distributed: at": (lambda: parts.Load(at="hub", torque=Y, pitch=1), "load.pitch is given without load.along"),
    "distributed: both": (
        lambda: parts.Load(along="boom", torque=(0.0, 0.0, 1), profile=ROWS),
        "load.torque and load.profile are both given; leave one of them out",
    ),
    "slope": (lambda: parts.Load(at="boom.tip", slope=2, torque=Y), "load.slope is 2; .* the slope 1 alone"),
    "slope: range": (lambda: parts.Load(at="boom.tip", slope=4, torque=Y), "Load.slope is 4; .* from 1 to 3"),
    "slope: point": (lambda: parts.Load(at=Y, slope=1, torque=Y), "it must be a node of a beam"),
    "uniform: thread": (lambda: parts.Load(along="blad", force=Y), "'load' refers to 'blad'"),
    "uniform: force": (lambda: parts.Load(along="blade", force=(0, 1)), "Load.force is .* 2 values"),
    "uniform: times": (lambda: parts.Load(along="blade", force=Y, ramp=1), "load.ramp is given, but load.along is 'bl"),
    "uniform: torque": (lambda: parts.Load(along="blade", torque=Y), "load.torque is given, but load.along is 'blade'"),
    "light: width": (lambda: parts.Radiation(along="blade", pressure=1), "load.width is missing; 'blade' is a thread"),
    "light: area": (lambda: parts.Radiation(at="hub", pressure=1), "load.area is missing; a panel needs it"),
    "light: two": (
        lambda: parts.Radiation(at="hub", along="blade", pressure=1),
        "load.at and load.along are both given",
    ),
    "light: width of a panel": (
        lambda: parts.Radiation(at="hub", area=1, normal=Y, width=1, pressure=1),
        "load.width is given without load.along, to which it belongs",
    ),
    "light: pressure": (
        lambda: parts.Radiation(along="blade", pressure=-1, width=0.1, specular=1.0),
        "Radiation.pressure is -1; it must be a pressure of 0 or above",
    ),
    "light: specular": (
        lambda: parts.Radiation(along="blade", pressure=1, width=0.1, specular=1.1),
        "Radiation.specular is 1.1; .* up to 1",
    ),
    "law: two": (lambda: parts.Load(along="blade", law=["x", "y"]), "Load.law is .* three of them"),
    "law: name": (
        lambda: parts.Load(along="blade", law=["x", "y", "vw"]),
        "load.law is 'vw'; 'vw' at character 1 is neither a variable nor a constant",
    ),
    "law: parameters": (
        lambda: parts.Load(along="blade", law=["x", "y", "z"], parameters=[1.0]),
        "load.parameters are those of a Python law; an expression takes load.constants",
    ),
    "law: constants": (
        lambda: parts.Load(along="blade", law=drag, constants={"c": 1.0}),
        "load.constants are those of an expression; a Python law takes load.parameters",
    ),
    "law: undecorated": (
        lambda: parts.Load(along="blade", law=lambda x, v, t, p: (0.0, 0.0, 0.0)),
        "@evolvent.law",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    make, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        system(make()).assemble()


def test_a_python_law_cannot_stand_in_a_file() -> None:
    load = parts.Load(along="blade", law=drag, parameters=[1.0])
    with pytest.raises(InputError, match=r"^the law 'drag' is a Python function, which a file cannot hold; give"):
        load.model_dump(mode="json")
    assert load.model_dump()["law"] is drag
