"""Sweeps over keys of a structure: any key of any part, any variable kept, refused in one sentence before a run."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from evolvent import InputError, cases
from evolvent.design import studies
from evolvent.design.evaluator import record
from evolvent.design.studies import draw
from evolvent.design.studies.axes import annotation
from evolvent.results import kept
from evolvent.systems.structure import StructureCase

#: A mass on a spring, and another that falls.
CASE = {
    "system": "structure",
    "gravity": [0, 0, "-10 m/s^2"],
    "parts": {
        "left post": {"kind": "rigid-body", "motion": "driven", "points": {"eye": [0, 0, "10 mm"]}},
        "tip-mass": {"kind": "point", "mass": "2 kg", "position": [100, 0, "10 mm"]},
        "stone": {"kind": "point", "mass": "1 kg", "velocity": [1, 0, "0 m/s"]},
        "spring": {"kind": "spring", "a": "left post.eye", "b": "tip-mass", "stiffness": "8 N/m"},
        "push": {
            "kind": "load",
            "at": "stone",
            "direction": [0, 1, 0],
            "profile": [["0 s", "0 N"], ["1 s", "2 N"]],
        },
    },
    "simulate": {"until": "0.5 s", "every": "10 ms", "tolerance": 1e-9},
}
STUDY = {
    "case": CASE,
    "over": {"parts.tip-mass.mass": ["1 kg", "2 kg"], "parts.spring.stiffness": {"from": 4, "to": 8, "points": 2}},
    "keep": ["stone.position.z.last", "spring.force.max", "energy_defect.max", "left post.position", "steps"],
}


@pytest.fixture
def study():
    return copy.deepcopy(STUDY)


@pytest.mark.parametrize(
    ("key", "unit", "what"),
    [
        ("parts.tip-mass.mass", "kg", "Of the point."),
        ("parts.left post.points.eye.2", "m", "Points of the body"),
        ("parts.push.profile.table.1.0", "s", "Rows [time, value]"),
        ("parts.push.profile.table.1.1", "N", "Rows [time, value]"),
        ("parts.push.profile.sine.amplitude", "N", "Values"),
        ("gravity.2", "m/s^2", "acts on every mass"),
        ("simulate.until", "s", "end of the run"),
        ("parts.spring.a", "", "Ends"),
    ],
)
def test_keys_have_their_units_and_meaning(key, unit, what):
    reader, text = annotation(StructureCase, key, CASE)
    assert getattr(reader, "unit", "") == unit
    assert text.startswith(what)


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("parts.sprin.stiffness", "over: 'parts.sprin.stiffness': no part is called 'sprin'; did you mean 'spring'?"),
        ("parts.spring.stifness", "over: unknown key 'parts.spring.stifness'; did you mean 'parts.spring.stiffness'?"),
        ("part.spring.stiffness", "over: unknown key 'part.spring.stiffness'; did you mean 'parts'?"),
        ("parts.tip-mass.mass.x", "over: unknown key 'parts.tip-mass.mass.x'; 'parts.tip-mass.mass' has no keys"),
        ("parts.push.profile.tabel", "over: unknown key 'parts.push.profile.tabel'; did you mean 'parts.push."),
        ("simulate.untill", "over: unknown key 'simulate.untill'; did you mean 'simulate.until'?"),
    ],
)  # fmt: skip
def test_a_misspelt_key_is_refused_with_the_nearest(study, key, sentence):
    study["over"] = {key: [1, 2]}
    with pytest.raises(InputError) as refused:
        studies.read(study)
    assert str(refused.value).startswith(sentence)


@pytest.mark.parametrize(
    ("keep", "sentence"),
    [
        ("spring.forc.max", "keep holds 'spring.forc.max'; no variable is called 'spring.forc'; did you mean"),
        ("spring.force.mx", "keep holds 'spring.force.mx'; after the variable, did you mean 'max'?"),
        ("spring", "keep holds 'spring'; 'spring' is a part; give one of its variables: "),
        ("energy_defct.max", "keep holds 'energy_defct.max'; no variable is called 'energy_defct'; did you mean"),
        ("tip-mass.position.q.last", "keep holds 'tip-mass.position.q.last'; 'tip-mass.position.q': the variable has"),
        ("step_s", "keep holds 'step_s', which no run has; did you mean 'steps'?"),
    ],
)  # fmt: skip
def test_a_misspelt_variable_is_refused_with_the_nearest(study, keep, sentence):
    with pytest.raises(InputError) as refused:
        studies.sweep(study | {"keep": [keep]})
    assert str(refused.value).startswith(sentence)


def test_names_that_would_coincide_are_refused(study):
    study["keep"] = ["tip-mass.position.x.last", "tip_mass.position.x.last"]
    with pytest.raises(InputError, match="would both be in the results as 'tip_mass_position_x_last'"):
        studies.read(study)


def test_stages_are_for_systems_that_start_from_a_run():
    stages = [{"name": "one"}, {"name": "two"}]
    with pytest.raises(InputError, match="no run of 'heliogyro' can start from another; leave them out"):
        studies.read({"case": "heliogyro", "stages": stages, "over": {"blade.nodes": [3, 5]}})


@pytest.mark.slow
def test_a_grid_over_parts_has_the_closed_forms(study, tmp_path):
    found = studies.sweep(study, output=tmp_path / "out")
    assert found.sizes["parts.tip-mass.mass"] == 2
    assert found["parts.spring.stiffness"].attrs["units"] == "N/m"
    assert (found.status == "success").all()
    # a stone falls; the spring, 0.1 m long, is stretched sideways by gravity: the force of the stiffer one is larger
    assert found.stone_position_z_last.values == pytest.approx(np.full((2, 2), -0.5 * 10.0 * 0.25), abs=1e-9)
    assert found.stone_position_z_last.attrs["units"] == "m"
    assert found.stone_position_z_last.attrs["long_name"].startswith("stone.position.z: position")
    assert found.stone_position_z_last.attrs["long_name"].endswith(", at the end")
    assert found.left_post_position.dims[2:] == ("time", "axis")
    found.to_netcdf(tmp_path / "study.nc")
    # the same numbers as a run of the whole system, all of which is observed
    case = cases.load(CASE, {"parts.tip-mass.mass": 1.0, "parts.spring.stiffness": 8.0})
    run = cases.system("structure").plan(case).run(None)
    assert found.spring_force_max.values[0, 1] == run["spring"]["force"].values.max()
    assert found.energy_defect_max.values[0, 1] == run["energy_defect"].values.max()
    assert "spring_force_max" in draw.figures(found)


def test_a_sweep_goes_on_and_keeps_failures(study, tmp_path):
    study["over"] = {"parts.tip-mass.mass": [1, 2], "simulate.step": ["0.01 s", "1 ms"]}
    study["set"] = {"simulate.method": "rk4", "simulate.tolerance": None}
    study["over"]["parts.spring.stiffness"] = [8.0, 1e9]
    first = studies.sweep(study, output=tmp_path / "out")
    failed = (first.status == "failed").values
    assert failed.any()
    assert not failed.all()
    assert all(str(reason) for reason in first.reason.values[failed])
    again = []
    studies.sweep(study, output=tmp_path / "out", progress=lambda done, count: again.append((done, count)))
    assert again == [(8, 8)]


@pytest.mark.release
def test_workers_give_the_same_bits(study):
    here = studies.sweep(study)
    there = studies.sweep(study | {"batch": 1}, workers=2)
    for name in here.data_vars:
        np.testing.assert_array_equal(here[name].values, there[name].values)


def test_entries_of_lists_keep_the_unit_of_their_list(study):
    read = lambda **changes: cases.load(CASE, changes)  # noqa: E731
    assert read(**{"parts.tip-mass.position.2": "0.5 m"}).parts["tip-mass"].position == pytest.approx((0.1, 0.0, 0.5))
    assert read(**{"parts.tip-mass.position.0": 300}).parts["tip-mass"].position == pytest.approx((0.3, 0.0, 0.01))
    assert read(**{"parts.tip-mass.position.2": 300}).parts["tip-mass"].position == pytest.approx((0.1, 0.0, 0.3))
    # a range has SI units, whatever the list has
    study["over"] = {"parts.tip-mass.position.0": {"from": "100 mm", "to": 0.3, "points": 2}}
    found = studies.read(study)
    positions = [cases.load(found.content, found.overrides(k)).parts["tip-mass"].position[0] for k in (0, 1)]
    assert positions == pytest.approx([0.1, 0.3])
    assert found.axes[0].values == pytest.approx((0.1, 0.3))


def test_rows_that_stand_for_a_table_can_be_changed(study):
    changed = cases.load(CASE, {"parts.push.profile.table.1.1": "3 N"})
    assert changed.parts["push"].profile.table == ((0.0, 0.0), (1.0, 3.0))
    study |= {"over": {"parts.push.profile.table.1.1": [0, "4 N"]}, "keep": ["stone.velocity.y.last"]}
    found = studies.sweep(study)
    # the force grows as F t over 1 s
    assert found.stone_velocity_y_last.values == pytest.approx([0.0, 4.0 * 0.5**2 / 2.0], abs=1e-9)


def test_sections_and_whole_parts_may_vary(study):
    study["over"] = {"parts.push.profile": [{"constant": "1 N"}, {"sine": {"amplitude": "1 N", "frequency": "1 Hz"}}]}
    study["keep"] = ["stone.velocity.y.last"]
    speed = studies.sweep(study).stone_velocity_y_last.values
    assert speed == pytest.approx([0.5, (1.0 - math.cos(math.pi)) / (2.0 * math.pi)], abs=1e-8)


def test_set_may_add_a_part_but_not_by_a_slip():
    added = cases.load(CASE, {"parts.ball.kind": "point", "parts.ball.mass": "3 kg"})
    assert added.parts["ball"].mass == 3.0
    with pytest.raises(InputError) as refused:
        cases.load(CASE, {"parts.tip mass.mass": "3 kg"})
    assert (
        str(refused.value) == "cannot set 'parts.tip mass.mass': no part is called 'tip mass'; did you mean 'tip-mass'?"
    )
    assert cases.parse_assignment("parts.left post.rate=3 rad/s") == ("parts.left post.rate", "3 rad/s")


def test_names_that_are_kept():
    assert kept.split("hub.rate.z.last") == ("hub.rate.z", "last")
    assert kept.split("boom[5].position.max") == ("boom[5].position", "max")
    assert kept.split("steps") == ("steps", "")
    assert kept.stored_name("tip mass[5].position.x.max") == "tip_mass_5_position_x_max"


@pytest.mark.slow
def test_values_at_a_time_and_integrals_are_kept(study):
    """The stone moves at 1 m/s; a run that ends before the time has failed, and says why."""
    study["over"] = {"simulate.until": ["0.2 s", "0.5 s"]}
    study["keep"] = ["stone.position.x.at(0.255 s)", "stone.velocity.x.integral"]
    found = studies.sweep(study)
    assert found.stone_position_x_at_0_255_s.values[1] == pytest.approx(0.255, rel=1e-9)
    assert found.stone_velocity_x_integral.values[1] == pytest.approx(0.5, rel=1e-9)
    assert found.stone_velocity_x_integral.attrs["units"] == "m"
    assert found.status.values.tolist() == ["failed", "success"]
    assert "at(0.255 s) is outside the run, which is from 0 s to 0.2 s" in str(found.reason.values[0])


def test_a_tree_gives_the_same_values_as_what_is_kept():
    keep = ["stone.position.y.at(0.255 s)", "stone.velocity.y.integral", "energy_defect.at(0.3 s)"]
    plan = cases.system("structure").plan
    whole = record.outcome(0, plan(cases.load(CASE)).run(None), keep).variables
    alone = plan(cases.load(CASE), keep=keep).keep()
    for name in keep:
        np.testing.assert_array_equal(whole[kept.stored_name(name)].values, alone[name])
