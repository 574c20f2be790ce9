"""What `storage` shows: rows that count, shapes that are kept, a figure whose curves can be distinguished."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import System, elements, parts
from evolvent.analysis.storage_shapes import kept_figure
from evolvent_base import plots
from evolvent_base.figures import Figure
from viscoelastic_rods import bent_rod

YEAR = 365.25 * 86_400.0
TAPES = ("tape 1", "tape 2")


def figure(system: System) -> Figure:
    found = system.storage(motion=False).figure()
    assert found is not None
    return found


def test_curves_that_lie_on_each_other_are_one_line_that_follows_the_law() -> None:
    hinge = evolvent.load("hinge-stored")
    (panel,) = figure(hinge).panels
    (line,) = panel.lines
    law = hinge.parts["hinge"].viscoelastic
    assert line.label == "hinge: torque"
    assert line.x[-1] == pytest.approx(10.0 * YEAR, rel=1e-12)
    assert np.max(np.abs(line.y - law.modulus(line.x))) < 2e-4  # 27 equilibria, which are exact
    assert {"1 h", "10 days", "1 year", "10 years"} <= set((panel.x_names or {}).values())
    axis = plots.sheet(figure(hinge)).axes[0]
    assert axis.get_xlabel() == "time in storage"
    assert [one.get_text() for one in axis.get_xticklabels()] == list((panel.x_names or {}).values())
    (panel,) = figure(evolvent.load("tape-rods-stored")).panels
    assert [one.label for one in panel.lines] == ["tape 1, tape 2: all forces and moments"]


def test_a_coil_that_creeps_on_its_drum_takes_fewer_steps_in_storage_than_in_its_deployment() -> None:
    """So storage and deployment take less than twice the time of the deployment, on any machine."""
    found = evolvent.load("boom-on-drum-stored").storage(motion=False)
    assert found.steps < 0.3 / 0.5e-3 / 2.0
    assert {one.name: one.after for one in found.forces}["bending_moment_z"] == pytest.approx(0.01148258, rel=1e-6)


def springs(*laws: Any) -> System:
    system = System(sections={"store": {"time": "1 day"}})
    for k, law in enumerate(laws):
        name = chr(ord("a") + k)
        system.add(parts.Point(mass=1.0, position=(1.1, k, 0)), f"mass {name}")
        spring = parts.Spring(a=(0.0, k, 0), b=f"mass {name}", stiffness=100.0, length=1.0, viscoelastic=law)
        system.add(spring, name)
        system.add(parts.Joint(a=(1.1, k, 0), b=f"mass {name}", type="spherical"), f"hold {name}")
    return system


def test_curves_apart_have_a_line_each_and_many_parts_are_counted() -> None:
    one, other = {"prony": [(0.3, "1 h")]}, {"prony": [(0.4, "1 h")]}
    (panel,) = figure(springs(one, other, one, one, one, one)).panels
    assert [line.label for line in panel.lines] == ["a, c, d, e and 1 more: force", "b: force"]
    assert [line.y[-1] for line in panel.lines] == pytest.approx([0.7, 0.6], rel=1e-9)


def bar(load: parts.Load, **keys: Any) -> System:
    material = elements.Material(
        young_modulus=5e9, poisson_ratio=0.3, density=1200.0, viscoelastic={"prony": [(0.3, "1 h")]}
    )
    system = System(sections={"store": {"time": "2 h"}})
    section = elements.Rectangle(width=0.02, thickness=0.002)
    system.add(parts.Rod(length=1.0, elements=4, section=section, material=material, **keys), "bar")
    system.add(parts.Joint(a="ground", b="bar.root", type="clamp"), "root")
    system.add(load, "load")
    return system


@pytest.mark.parametrize(
    ("load", "keys", "names"),
    [
        ({"torque": (0.0, 0.0, 0.1)}, {}, {"bending_moment_z"}),  # axial and shear forces are round-off
        (
            {"force": (0.0, -0.2, 0.0)}, {"direction": (1.0, 0.0, 1.0)},  # those across the plane are
            {"axial_force", "shear_force_y", "bending_moment_z"},
        ),
    ],
)  # fmt: skip
def test_forces_that_are_round_off_have_no_row(load: Any, keys: Any, names: set[str]) -> None:
    found = bar(parts.Load(at="bar.tip", **load), **keys).storage(motion=False)
    assert {one.name for one in found.forces} == names


def test_the_force_of_a_cord_at_an_angle_is_its_tension_and_has_one_row() -> None:
    system = System(gravity=(6.0, 8.0, 0.0), sections={"store": {"time": "1 h"}})
    system.add(parts.Point(mass=1.0, position=(0.6, 0.8, 0.0)), "load")
    law = {"prony": [(0.3, "1 h")]}
    cord = parts.Joint(a=(0.0, 0, 0), b="load", type="distance", stiffness=1000.0, viscoelastic=law)
    system.add(cord, "cord")
    (row,) = system.storage(motion=False).forces
    assert row.name == "tension"
    assert row.before == pytest.approx(10.0, rel=1e-9)
    assert row.after == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_rods_and_beams_keep_curvature(kind: Any) -> None:
    """A bent part held for 10 relaxation times keeps 0.5999728 of its curvature."""
    system = bent_rod({"prony": [(0.6, 1.0)]}, curvature=0.1, kind=kind)
    system.sections["store"] = {"time": "10 s"}
    found = system.storage(motion=False)
    kept = {words: value for _, words, value, _ in found.sets}
    assert kept["largest curvature about z"] == pytest.approx(0.1 * 0.5999728, rel=2e-3)
    assert kept["integral of the curvature about z from root to tip"] == pytest.approx(
        math.degrees(0.1 * 0.5999728), rel=1e-3
    )
    (along,) = found.along
    assert along[:2] == (found.sets[0][0], "curvature about z")
    assert along.values == pytest.approx(np.full(along.arc.size, 0.1 * 0.5999728), rel=2e-3)
    assert along.arc[0] + along.arc[-1] == pytest.approx(1.0, rel=1e-12)


def test_the_tape_hinge_after_ten_years_has_margins_a_latch_and_an_angle_that_stays() -> None:
    hinge = evolvent.load("tape-hinge-stored")
    found, left = hinge.storage(), float(hinge.parts["tape 1"].viscoelastic.modulus(10.0 * YEAR))
    assert {one.part: one.after / one.before for one in found.forces} == pytest.approx(dict.fromkeys(TAPES, left))
    before, after = (one.least for one in found.margins)
    assert before > after > 0.0
    assert [(part, unit) for part, _, _, unit in found.sets] == [(name, "deg") for name in TAPES]
    assert all(0.0 < value < 5.0 for _, _, value, _ in found.sets)  # past the snap at 5 deg, short of the latch
    (_, row) = found.latch_rows()
    assert row[0] == "hinge"
    assert float(row[1].split()[0]) < float(row[2].split()[0])


def test_a_boom_has_its_time_to_deploy_and_its_shapes_before_and_after() -> None:
    found = evolvent.load("boom-on-drum-stored").storage()
    before, after = next(row[1:] for row in found.event_rows() if row[0] == "out")
    assert float(before.split()[0]) < float(after.split()[0])
    for run, text in zip(found.runs, (before, after), strict=True):
        place = np.interp(float(text.split()[0]), run.time.values, run["boom"].tip_position.values[:, 0])
        assert place == pytest.approx(0.36, abs=1e-3)
    drawn = found.shape_figure()
    assert drawn is not None
    stowed, deployed = drawn.panels
    assert [line.label for line in stowed.lines] == ["before storage", "after storage"]
    for line, run in zip(deployed.lines, found.runs, strict=True):
        assert [line.x[-1], line.y[-1]] == pytest.approx(run["boom"].tip_position.values[-1, :2], rel=1e-12)
    along = kept_figure(found.along)
    assert along is not None
    (curvature,) = along.panels
    assert np.abs(curvature.lines[0].y).max() == pytest.approx(4.029, rel=1e-3)
