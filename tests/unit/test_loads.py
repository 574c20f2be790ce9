"""Loads as sections: what is refused, where they are written, round trips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, elements, force_law, parts
from evolvent.parts.base import Part

ROWS = [(0, 0), (1, 0.2)]
Y = (0, 1, 0)


@force_law
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
    "force on a body": parts.Force(at="hub", force=(1, 0, "2 N"), frame="body", start="1 s", until="2 s"),
    "force at a point": parts.Force(at=("hub", (0, 0, 1)), direction=Y, profile=ROWS),
    "force on a point": parts.Force(at="ball", direction=Y, profile={"pulse": {"value": "1 N", "duration": 1}}),
    "force on a node": parts.Force(at="boom[1]", force=(1, 2, 3), ramp=1.0),
    "torque": parts.Torque(at="hub", torque=(0, 0, "2 N m")),
    "torque of a profile": parts.Torque(at="wheel", axis=Y, profile=ROWS),
    "line": parts.LineLoad(part="boom", force=(0, 0, "1 N/m")),
    "line of a profile": parts.LineLoad(part="boom", direction=Y, profile={"constant": "1 N/m"}, until=3.0),
    "distributed": parts.DistributedTorque(part="boom", torque="1 N m", centre=(0, 1, 0), axis=(1, 0, 1), start=1.0),
    "distributed by a profile": parts.DistributedTorque(part="boom", profile=ROWS),
    "slope": parts.SlopeLoad(at="boom.tip", slope=1, force=(0, 0, 1)),
    "uniform": parts.UniformLoad(thread="blade", force=(0, 0, "1 mN/m"), frame="body"),
    "light": parts.RadiationPressure(thread="blade", pressure="4.56 uPa", width="10 cm", reflectivity=0.9),
    "law": parts.LawLoad(thread="blade", law=["-c*vx", "-c*vy", "-c*vz"], constants={"c": 1e-3}),
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
    model = system(parts.Force(at="ball", direction=(0, 3, 4), profile=ROWS)).assemble().model
    assert model.parameters[model.loads["first"][0] :][:3] == pytest.approx([0.0, 0.6, 0.8])
    row = system(parts.LineLoad(part="boom", direction=(0, 3, 4), profile=ROWS)).assemble().model.beam_loads[0]
    assert row["axis"] == pytest.approx([0.0, 0.6, 0.8])


def test_law_in_python_and_as_expressions() -> None:
    """Three expressions give what a Python law gives."""
    from evolvent.solvers import solve

    found = []
    for load in (
        parts.LawLoad(thread="blade", law=drag, parameters=[1e-3]),
        parts.LawLoad(thread="blade", law=["-c*vx", "-c*vy", "-c*vz"], constants={"c": 1e-3}),
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
    "no vector": (lambda: parts.Force(at="hub"), "load.force is missing; give force, or direction and profile"),
    "both": (
        lambda: parts.Force(at="hub", force=Y, profile=ROWS),
        "load.force and load.profile are both given; give force, or direction and profile",
    ),
    "both directions": (
        lambda: parts.Torque(at="hub", torque=Y, axis=Y),
        "load.torque and load.axis are both given; give torque, or axis and profile",
    ),
    "no profile": (lambda: parts.Torque(at="hub", axis=Y), "load.profile is missing"),
    "no direction": (lambda: parts.Force(at="hub", profile=ROWS), "load.direction is missing"),
    "unknown": (lambda: parts.Force(at="hbu", force=Y), "'load' refers to 'hbu', .* did you mean 'hub'"),
    "whole beam": (lambda: parts.Force(at="boom", force=Y), r"load.at is 'boom'; 'boom' is a beam; give .* 'boom.tip'"),
    "no node": (lambda: parts.Force(at="boom.end", force=Y), "'boom' has no 'end'; give 'boom.root'"),
    "far node": (lambda: parts.Force(at="boom[9]", force=Y), r"'boom' has no node 9; .* 'boom\[3\]'"),
    "point of a body": (lambda: parts.Force(at="hub.tip", force=Y), r"'hub' has no point 'tip'"),
    "body axes of a node": (lambda: parts.Force(at="boom.tip", force=Y, frame="body"), "load.frame is 'body', but"),
    "body axes of a point": (lambda: parts.Force(at="ball", force=Y, frame="body"), "load.at is 'ball'; .* a body"),
    "torque on a point": (lambda: parts.Torque(at="ball", torque=Y), "load.at is 'ball'; this load needs a body"),
    "torque on a node": (lambda: parts.Torque(at="boom.tip", torque=Y, frame="body"), "load.frame is 'body', but"),
    "frame": (lambda: parts.Force(at="hub", force=Y, frame="bdy"), "Force.frame is 'bdy'; did you mean 'body'"),
    "times": (
        lambda: parts.Force(at="hub", force=Y, start=2, until=1),
        "load.until is 1.0; it must be after start 2.0",
    ),
    "times of a node": (lambda: parts.Force(at="boom.tip", force=Y, start=2, until=1), "load.until is 1.0 s; .* 2.0 s"),
    "ramp": (lambda: parts.Force(at="hub", force=Y, ramp=-1), "Force.ramp is -1; it must be a time of 0 or above"),
    "unit": (lambda: parts.Torque(at="hub", torque=(0, 0, "1 N")), "Torque.torque is .* 'N' is a unit of something"),
    "zero axis": (lambda: parts.Torque(at="hub", axis=(0, 0, 0), profile=ROWS), "Torque.axis is .* not all zero"),
    "line: none": (lambda: parts.LineLoad(part="boom"), "load.force is missing; give force, or direction and profile"),
    "line: direction": (lambda: parts.LineLoad(part="boom", force=Y, direction=Y), "direction goes with load.profile"),
    "line: profile": (lambda: parts.LineLoad(part="boom", profile=ROWS), "load.direction is missing; it goes with"),
    "line: beam": (lambda: parts.LineLoad(part="hub", force=Y), "no beam is called 'hub'"),
    "distributed: none": (lambda: parts.DistributedTorque(part="boom"), "load.torque is missing; give torque, or pro"),
    "distributed: both": (
        lambda: parts.DistributedTorque(part="boom", torque=1, profile=ROWS),
        "load.torque and load.profile are both given; give torque, or profile",
    ),
    "slope": (lambda: parts.SlopeLoad(at="boom.tip", slope=2, force=Y), "load.slope is 2; .* the slope 1 alone"),
    "slope: range": (lambda: parts.SlopeLoad(at="boom.tip", slope=4, force=Y), "SlopeLoad.slope is 4; .* from 1 to 3"),
    "slope: point": (lambda: parts.SlopeLoad(at=Y, slope=1, force=Y), "it must be a node of a beam"),
    "uniform: thread": (lambda: parts.UniformLoad(thread="blad", force=Y), "'load' refers to 'blad'"),
    "uniform: force": (lambda: parts.UniformLoad(thread="blade", force=(0, 1)), "UniformLoad.force is .* 2 values"),
    "light: pressure": (
        lambda: parts.RadiationPressure(thread="blade", pressure=-1, width=0.1),
        "RadiationPressure.pressure is -1; it must be a pressure of 0 or above",
    ),
    "light: reflectivity": (
        lambda: parts.RadiationPressure(thread="blade", pressure=1, width=0.1, reflectivity=1.1),
        "RadiationPressure.reflectivity is 1.1; .* up to 1",
    ),
    "law: two": (lambda: parts.LawLoad(thread="blade", law=["x", "y"]), "LawLoad.law is .* three of them"),
    "law: name": (
        lambda: parts.LawLoad(thread="blade", law=["x", "y", "vw"]),
        "load.law is 'vw'; 'vw' at character 1 is neither a variable nor a constant",
    ),
    "law: parameters": (
        lambda: parts.LawLoad(thread="blade", law=["x", "y", "z"], parameters=[1.0]),
        "load.parameters are those of a Python law; an expression takes load.constants",
    ),
    "law: constants": (
        lambda: parts.LawLoad(thread="blade", law=drag, constants={"c": 1.0}),
        "load.constants are those of an expression; a Python law takes load.parameters",
    ),
    "law: undecorated": (
        lambda: parts.LawLoad(thread="blade", law=lambda x, v, t, p: (0.0, 0.0, 0.0)),
        "@evolvent.force_law",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    make, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        system(make()).assemble()


def test_a_python_law_cannot_stand_in_a_file() -> None:
    load = parts.LawLoad(thread="blade", law=drag, parameters=[1.0])
    with pytest.raises(InputError, match=r"^the law 'drag' is a Python function, which a file cannot hold; give"):
        load.model_dump(mode="json")
    assert load.model_dump()["law"] is drag
