"""Parts of bicycles on a torsion rig: periods and lines of an orientation by the others, and wrong records.

A bar of which a rod gives the stiffness carries a frame, a fork or a wheel in several orientations. Each set is a table
of readings. Every part is evaluated as `evolvent identify` does; each orientation is then predicted by the others.

Source: data/bicycles/*/RawData of the public repository moorepants/BicycleParameters (BSD-2-Clause licence).
"""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from evolvent.analysis.system import System
from evolvent.parts import Joint, JointSpring, RigidBody
from evolvent_base import progress, units
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Panel, stacked
from evolvent_base.schema import Section
from evolvent_massprops import torsion_rig
from evolvent_papers.laboratory import tables
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, Set, Verdict

SOURCE = (
    "public repository moorepants/BicycleParameters, folder data/bicycles (periods, masses, lengths and angles of the "
    "files *Measured.txt); BSD-2-Clause licence"
)
HEAD = ("quantity", "reading", "value", "uncertainty")
#: Parts by their letters; other letters keep theirs.
PARTS = {"B": "frame", "F": "front wheel", "R": "rear wheel", "G": "handlebar", "S": "fork", "H": "fork and handlebar"}
WHEELS = ("F", "R")
#: Goal: rms of the periods of a frame's orientations, each predicted by the others, part of the period.
GOAL = 0.015
#: Relative difference of the engine's periods from the closed form that is allowed.
SAME = 1e-6
BUDGET = Budget(
    contributions=(
        Contribution(
            name="records and mounting", kind="measurement",
            size="rms of those of the predictions and records; a mounting: {angle:g} deg, {moment:.1%} of a moment, "
            "{distance:g} m, with an offset of {line_offset:g} m that a part's distances share",
            source="records: stated by the source; mounting: assumed",
        ),
        Contribution(
            name="pendulum", kind="parameters", size="of the moment about the axle by pendulum and bar",
            source="periods, lengths and masses as the source states them",
        ),
        Contribution(
            name="engine", kind="numerics", size="difference of its periods from the closed forms", source="computed",
        ),
    ),
    widened="to what a mounting repeats was chosen with the sets of the package at hand, since parts that are clamped "
    "again scatter more than the source states",
)  # fmt: skip
#: Panels of the figure, at most.
_PANELS = 6


class Settings(Section):
    """What `--set` changes: what an orientation repeats to when the part is clamped again, standard uncertainties."""

    moment: Annotated[float, units.Quantity(
        what="a share", unit="", example="0.3 %", least=0.0, most=0.5,
    )] = Field(0.003, description="of a moment, part of it")  # fmt: skip
    angle: Annotated[float, units.Quantity(
        what="an angle in degrees", unit="", example="1", least=0.0, most=20.0,
    )] = Field(1.0, description="of the direction of the bar's line in the part, degrees")  # fmt: skip
    distance: units.Length = Field(0.003, description="of the distance of the bar's line, m")
    line_offset: units.Length = Field(0.005, description="of an offset that all distances of a part share, m")
    false_alarms: Annotated[float, units.Quantity(
        what="a share", unit="", example="1 %", above=0.0, most=0.2,
    )] = Field(0.01, description="how often a record of a part may be called wrong where none is")  # fmt: skip


class Evaluated(NamedTuple):
    """A part of a set.

    Attributes
    ----------
    bicycle, part, letter : str
    found : torsion_rig.RigProperties
    """

    bicycle: str
    part: str
    letter: str
    found: torsion_rig.RigProperties

    @property
    def name(self) -> str:
        """Set and part."""
        return f"{self.bicycle}, {self.part}"


Readings = Mapping[str, Sequence[str]]


def readings_of(name: str, raw: bytes) -> dict[str, list[str]]:
    """Readings of a table by quantity, as a description writes them.

    Raises
    ------
    InputError
        If it has other columns, or lacks the rod.
    """
    found: dict[str, list[str]] = {}
    for row in tables.rows(name, raw, HEAD, ("uncertainty",), ("quantity",)):
        std = row["uncertainty"] if math.isfinite(row["uncertainty"]) else 0.0
        found.setdefault(row["quantity"], []).append(f"{row['value']!r} +- {std!r}")
    missing = [key for key in ("mP", "dP", "lP", "TtP1") if key not in found]
    if missing:
        raise InputError(
            f"{name}: {missing[0]} is missing; mass, diameter, length and period of the rod are mP, dP, lP, TtP1"
        )
    return found


def description(letter: str, given: Readings, settings: Settings) -> dict[str, Any] | None:
    """The stand with one part as `evolvent identify` reads it; None of a part that was not measured so.

    Parameters
    ----------
    letter : str, of the part
    given : mapping, readings by quantity
    settings : Settings
    """
    wheel = letter in WHEELS
    orientations = []
    numbers = sorted(int(one[3:]) for one in given if re.fullmatch(rf"Tt{letter}\d+", one))
    for k in numbers:
        one: dict[str, Any] = {"name": f"{letter}{k}", "period": given[f"Tt{letter}{k}"]}
        if wheel:
            one["about"] = "normal" if k == 2 else "plane"
        elif f"alpha{letter}{k}" in given:
            one["angle"] = [f"{text} deg" for text in given[f"alpha{letter}{k}"]]
            if f"a{letter}{k}" in given:
                one["distance"] = given[f"a{letter}{k}"]
        else:
            continue
        orientations.append(one)
    if f"m{letter}" not in given or not orientations or (not wheel and len(orientations) < 3):
        return None
    again = {"moment": settings.moment, "angle": f"{settings.angle!r} deg", "distance": settings.distance}
    if wheel:
        place = {"length": given[f"l{letter}"]} if f"l{letter}" in given else None
    else:
        lines = sum("distance" in one for one in orientations)
        place = {"pivot": ["0 m", "0 m"]} if lines >= 2 else None
    swing = f"Tc{letter}1"
    return {
        "title": f"{PARTS.get(letter, letter)} on a torsion rig",
        "stand": {
            "kind": "torsion", "remounting": again, "line_offset": f"0 +- {settings.line_offset!r} m",
            "rod": {"mass": given["mP"], "diameter": given["dP"], "length": given["lP"], "period": given["TtP1"]},
            **({"gravity": given["g"][0]} if "g" in given else {}),
        },
        "body": {
            "name": PARTS.get(letter, letter), "mass": given[f"m{letter}"][0], "shape": "round" if wheel else "general",
        },
        "orientations": orientations,
        "pendulums": [{"name": swing, "period": given[swing], **place}] if swing in given and place else [],
        "uncertainty": {"false_alarms": settings.false_alarms},
    }  # fmt: skip


def bicycles(data: str | None) -> dict[str, dict[str, list[str]]]:
    """Readings of the sets of the package, or of a folder or file with tables of the same form.

    Raises
    ------
    InputError
        If there is none.
    """
    if data is not None and os.path.isfile(data):
        folder = os.path.dirname(data) or "."
        files = [one for one in tables.contents(folder, pathlib.Path()) if one[0] == os.path.basename(data)]
    else:
        files = tables.contents(data, pathlib.Path(__file__).with_name("data") / "torsion.zip")
    files = tables.having(files, HEAD, str(data))
    return {os.path.splitext(name)[0]: readings_of(name, raw) for name, raw in files}


def evaluated(data: str | None, settings: Settings) -> tuple[list[Evaluated], list[str]]:
    """Every part of every set, and sentences on those that cannot be evaluated."""
    parts, notes = [], []
    for bicycle, given in progress.track(bicycles(data).items(), "evaluating sets"):
        letters = sorted({one[2] for one in given if re.fullmatch(r"Tt[A-Z]\d+", one)} - {"P"})
        for letter in letters:
            part = PARTS.get(letter, f"part {letter}")
            asked = description(letter, given, settings)
            if asked is None:
                notes.append(f"{bicycle}, {part}: not evaluated, for want of angles or a mass")
                continue
            try:
                parts.append(Evaluated(bicycle, part, letter, torsion_rig.evaluate(asked)))
            except InputError as error:
                notes.append(f"{bicycle}, {part}: not evaluated, {error}")
    return parts, notes


# ------------------------------------------------------------------------------------------------ the engine


def engine_period(inertia: Array, angle: float, stiffness: float) -> float:
    """Period of a body on a torsion spring about a line of direction (cos, 0, -sin), s, as the engine has it.

    Parameters
    ----------
    inertia : (3, 3) float, kg m2
    angle : float, rad
    stiffness : float, N m/rad
    """
    line = (math.cos(angle), 0.0, -math.sin(angle))
    system = System()
    system.add(RigidBody(mass=1.0, inertia=inertia), "part")
    system.add(Joint(a=(0.0, 0.0, 0.0), b="part", type="revolute", axis=line), "bar")
    system.add(JointSpring(joint="bar", stiffness=stiffness), "spring")
    return 1.0 / float(system.modes(count=1).frequency_hz[0])


def engine_swing(mass: float, moment: float, centre: Sequence[float], gravity: float) -> float:
    """Period of a small swing about the origin, s, of a body that hangs from there, as the engine has it.

    Parameters
    ----------
    mass, moment : float, kg, and kg m2 about the axis y through the centre of mass
    centre : (2,) float, m, x and z of the centre of mass
    gravity : float, m/s2
    """
    x, z = centre
    length = math.hypot(x, z)
    system = System(gravity=(gravity * x / length, 0.0, gravity * z / length))
    body = RigidBody(
        mass=mass, inertia=np.diag([moment, moment, moment]), position=(x, 0.0, z), points={"pivot": (-x, 0.0, -z)}
    )
    system.add(body, "part")
    system.add(Joint(a=(0.0, 0.0, 0.0), b="part.pivot", type="revolute", axis=(0.0, 1.0, 0.0)), "pivot")
    return 1.0 / float(system.modes(count=1).frequency_hz[0])


def engine_differences(one: Evaluated) -> list[float]:
    """Relative differences of the engine's periods from the closed forms, of a part's orientations and of its swing."""
    found, off = one.found, []
    moments, keys = found.moments, [o.key for o in found.outputs]
    if moments is None or not {"Iyy", "x", "I2"} <= set(keys) or found["I2"] <= 0.0:
        return []
    flat = found["Ixx"] + found["Izz"]  # about y, where it plays no part in a turn about a line of the plane
    inertia = np.array([[found["Ixx"], 0.0, found["Ixz"]], [0.0, flat, 0.0], [found["Ixz"], 0.0, found["Izz"]]])
    for name, predicted in zip([e.name for e in moments.every.equations], moments.accepted.predicted, strict=True):
        inputs = moments.every.of.inputs
        angle = inputs.listed[inputs.place[f"{name}.angle"]].value
        closed = 2.0 * math.pi * math.sqrt(predicted / found["k"])
        off.append(engine_period(inertia, angle, found["k"]) / closed - 1.0)
    given = found.description
    assert given.body.mass is not None
    mass, gravity, length = given.body.mass.value, given.stand.gravity.value, math.hypot(found["x"], found["z"])
    closed = 2.0 * math.pi * math.sqrt((found["Iyy"] + mass * length**2) / (mass * gravity * length))
    off.append(engine_swing(mass, found["Iyy"], (found["x"], found["z"]), gravity) / closed - 1.0)
    return off


# ------------------------------------------------------------------------------------------------ the verdict


def run(settings: Settings, data: str | None) -> Verdict:
    """Every part by its records; each orientation by the others."""
    parts, notes = evaluated(data, settings)
    if not parts:
        raise InputError(f"no part of {data or 'the sets'} can be evaluated: {'; '.join(notes)}")
    general = [one for one in parts if one.letter not in WHEELS]
    numerics = max((abs(x) for one in general for x in engine_differences(one)), default=0.0)
    if numerics > SAME:
        raise InputError(f"the engine's periods are {numerics:.1e} off the closed forms, more than {SAME:g}")
    comparisons = []
    notes = [
        *(f"{one.name}: {text}" for one in parts for text in one.found.warnings),
        *(f"{one.name}: {text}" for one in parts for text in one.found.notes),
        *notes,
    ]
    for one in parts:
        comparisons += [*_moments(one, numerics), *_lines(one), *_axle(one)]
    notes.append(
        f"a mounting is taken to repeat to {settings.angle:g} deg, {100.0 * settings.moment:g} % of a moment and "
        f"{1e3 * settings.distance:g} mm, standard uncertainties, beside what the source states: assumed, with the "
        "sets of the package at hand"
    )
    notes.append(
        f"periods of torsion and swing by the engine are within {max(numerics, 1e-15):.0e} of the closed forms"
    )
    return Verdict(comparisons=tuple(comparisons), figures=tuple(_figures(general)), notes=tuple(notes))


def _moments(one: Evaluated, numerics: float) -> list[Comparison]:
    """Periods of the orientations that are used, each predicted by the others."""
    judged = one.found.moments
    if judged is None or judged.accepted.redundancy < 1 or one.letter in WHEELS:
        return []
    used = judged.accepted
    rms, _ = used.period_errors
    deviation, std = (row[used.used] / used.measured[used.used] for row in used.left_out)
    known = np.isfinite(deviation)
    expected = float(np.sqrt(np.mean((0.5 * std[known]) ** 2)))
    goal = one.letter == "B"
    return [
        Comparison(
            what=f"{one.name}: periods of {int(known.sum())} orientations, each by the others, rms of the difference",
            unit="%", predicted=100.0 * rms, measured=0.0, allowed=100.0 * GOAL if goal else math.nan,
            goal=f"{100.0 * GOAL:g} %" if goal else "",
            band=BUDGET.band({"records and mounting": 100.0 * expected, "engine": 100.0 * numerics}),
        )
    ]  # fmt: skip


def _lines(one: Evaluated) -> list[Comparison]:
    """Distances of the bar's line, each predicted by the others."""
    judged = one.found.centre
    if judged is None:
        return []
    used = judged.accepted
    deviation, std = used.left_out
    lines = np.array([e.kind == "line" for e in used.equations]) & used.used & np.isfinite(deviation)
    if not lines.any():
        return []
    return [
        Comparison(
            what=f"{one.name}: distances of {int(lines.sum())} lines, each by the others, rms of the difference",
            unit="mm", predicted=1e3 * float(np.sqrt(np.mean(deviation[lines] ** 2))), measured=0.0,
            band=BUDGET.band({"records and mounting": 1e3 * float(np.sqrt(np.mean(std[lines] ** 2)))}),
        )
    ]  # fmt: skip


def _axle(one: Evaluated) -> list[Comparison]:
    """Moment of a wheel about its axle: by the pendulum, and by torsion where that was measured."""
    judged, found = one.found.centre, one.found
    if one.letter not in WHEELS or judged is None:
        return []
    every = judged.every
    swings = [k for k, e in enumerate(every.equations) if e.kind == "pendulum"]
    turned = [k for k, e in enumerate(every.equations) if e.kind == "normal"]
    if not swings:
        return []
    alone = math.isnan(every.scatter)
    predicted, measured, u = found["Iyy"], math.nan, float(found.std[found.place("Iyy")])
    if turned and not alone:
        deviation, std = every.left_out
        measured = float(every.measured[turned[0]])
        predicted, u = measured - float(deviation[turned[0]]), float(std[turned[0]])
    return [
        Comparison(
            what=f"{one.name}: moment about the axle by the pendulum; measured: by torsion", unit="kg m2",
            predicted=predicted, measured=measured,
            band=BUDGET.band({"pendulum": u}),
        )
    ]  # fmt: skip


def _figures(parts: Sequence[Evaluated]) -> list[Figure]:
    """Moments over the angle, of parts whose records can be tested; a panel each."""
    panels: list[Panel] = []
    for one in parts:
        judged = one.found.moments
        if judged is None or judged.accepted.redundancy < 1 or len(panels) == _PANELS:
            continue
        moments = torsion_rig.moments_over_angle(judged)
        panels.append(dataclasses.replace(moments, y_label=f"{one.name}: moment, kg m²"))
    if not panels:
        return []
    title = "Moments about the bar's line: planar tensor, and orientations"
    return [Figure(name="torsion", title=title, panels=panels, height=stacked(len(panels)))]


SETS = {
    "torsion": Set(
        name="torsion", title="Parts of bicycles on a torsion rig: each orientation by the others, and wrong records",
        source=SOURCE, Settings=Settings, run=run, budget=BUDGET,
    ),
}  # fmt: skip
