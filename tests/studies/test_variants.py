"""Variants of one structure: the bits of runs made one by one, for any number of workers; failures are results."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import InputError, System, parts
from evolvent.compiled import jit
from evolvent.design import studies
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.evaluator.runs import CaseRuns
from evolvent.design.studies.runner import Points, runs_of
from evolvent.solvers.time.explicit import loop as explicit
from evolvent.solvers.time.implicit import loop as implicit_loop
from margin_cases import zero

pytestmark = pytest.mark.slow

STIFFNESSES = [0.4, 0.5, 0.6, 0.7]
KEEP = ["hinge.latch_time.last", "panel.rate.z", "hinge.torque.max", "steps"]


def flap(friction: float = 0.0) -> System:
    """A panel on a hinge with a latch."""
    system = System(settings={"until": 3.0, "every": 0.1})
    system.add(parts.RigidBody(motion="driven", points={"eye": (0.0, 0.0, 0.0)}), "hub")
    turned, place = (math.cos(0.75), 0.0, 0.0, math.sin(0.75)), (0.5 * math.cos(1.5), 0.5 * math.sin(1.5), 0.0)
    panel = {"mass": 2.0, "inertia": (0.2, 0.2, 0.3), "points": {"root": (-0.5, 0.0, 0.0)}}
    system.add(parts.RigidBody(position=place, orientation=turned, **panel), "panel")
    system.add(parts.Joint(a="hub.eye", b="panel.root", type="revolute", axis=(0.0, 0.0, 1.0)), "pivot")
    system.add(
        parts.JointSpring(
            a="hub", b="panel", axis=(0.0, 0.0, 1.0), start=1.5, rest=-0.2, stiffness=0.5, damping=0.2, latch=0.0,
            latch_stiffness=500.0, latch_damping=10.0, friction=friction
        ),
        "hinge",
    )  # fmt: skip
    return system


@pytest.fixture(scope="module")
def system() -> System:
    return flap()


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_variants_have_the_bits_of_runs_made_one_by_one(system: System, workers: int) -> None:
    found = evolvent.simulate_many(system, {"hinge.stiffness": STIFFNESSES}, KEEP, workers=workers)
    assert found.sizes == {"variant": 4, "time": 31}
    np.testing.assert_array_equal(found["hinge.stiffness"], STIFFNESSES)
    for k, stiffness in enumerate(STIFFNESSES):
        alone = flap().with_values({"hinge.stiffness": stiffness}).simulate(keep=KEEP)
        for name in KEEP:
            values = found[name.replace(".", "_")][k]
            assert values.values.tobytes() == np.asarray(alone[name], dtype=float).tobytes(), name
    assert found.hinge_latch_time_last.attrs["units"] == "s"
    assert set(found.status.values) == {"success"}
    assert np.all(np.diff(found.hinge_latch_time_last) < 0.0)  # a stiffer spring is faster


def test_a_variant_that_fails_is_a_result_and_leaves_the_others_alone(system: System) -> None:
    values = [{"hinge.stiffness": 0.5}, {"hinge.stiffness": -1.0}, {"panel.mass": "2 kg", "hinge.damping": 0.3}]
    found = evolvent.simulate_many(system, values, ["hinge.latch_time.last"], workers=2)
    assert found.status.values.tolist() == ["success", "failed", "success"]
    assert "stiffness" in str(found.reason.values[1])
    assert found.reason.values[0] == ""
    assert np.isfinite(found.hinge_latch_time_last.values).tolist() == [True, False, True]
    assert found["panel.mass"].values.tolist() == ["", "", "2 kg"]
    assert np.isnan(found["hinge.damping"].values[:2]).all()
    page = found.ev._repr_html_()
    assert "3: 2 success, 1 failed" in page
    assert "its own, 2 kg" in page
    assert "1 case failed: " in page


def test_settings_hold_for_all_variants_and_may_be_a_key(system: System) -> None:
    found = evolvent.simulate_many(system, [{}, {"simulate.until": "1 s"}], ["panel.rate.z"], until=2.0, every=0.5)
    assert found.sizes["time"] == 5
    short = evolvent.simulate_many(flap(), [{"simulate.until": "1 s"}], ["hinge.angle.last"])
    assert short.hinge_angle_last.item() == flap().simulate(until=1.0, keep=["hinge.angle.last"])["hinge.angle.last"]


@pytest.mark.parametrize(
    ("values", "more", "sentence"),
    [
        ([], {}, "the values must hold a mapping of keys for every variant"),
        ("stiffness", {}, "they must be a list of mappings, or a mapping of lists"),
        ([0.5], {}, "the values must hold a mapping of keys"),
        ({"hinge.stiffness": 0.5}, {}, "each of its keys must have a list, with an entry a variant"),
        ({"hinge.stiffness": [0.5], "hinge.damping": [0.1, 0.2]}, {}, "'hinge.stiffness' 1, 'hinge.damping' 2"),
        ([{}], {"keep": ["hinge.angel.last"]}, "hinge"),
        ([{}], {"keep": []}, "keep is empty; name what is kept of every run"),
        ([{}], {"workers": 0}, "workers is 0; it must be a whole number from 1, or left out"),
        ([{}], {"untill": 3.0}, "simulate_many has no argument 'untill'; did you mean 'until'?"),
        ([{}], {"until": "-1 s"}, "until is '-1 s'"),
    ],
)
def test_refused_in_one_sentence(system: System, values: Any, more: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as refusal:
        evolvent.simulate_many(system, values, **{"keep": ["hinge.angle.last"], **more})
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interruption_ends_all_variants(system: System, workers: int) -> None:
    def interrupt(done: int, count: int) -> None:
        assert count == 40
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evolvent.simulate_many(system, [{}] * 40, ["hinge.angle.last"], workers=workers, progress=interrupt)


def test_margins_are_kept_of_variants() -> None:
    """Half the spring has half the torque everywhere: its margin is less."""
    system = flap(friction=0.01)
    system.sections = {"margin": {"zero": zero("friction")}}
    names = ["hinge.margin", "hinge.margin_in_run"]
    expected = [system.with_values({"hinge.stiffness": v}).simulate(keep=names) for v in (0.5, 0.25)]
    found = evolvent.simulate_many(system, {"hinge.stiffness": [0.5, 0.25]}, names, workers=2)
    assert found.hinge_margin.values.tolist() == [one[names[0]] for one in expected]
    assert found.hinge_margin_in_run.values.tolist() == [one[names[1]] for one in expected]
    assert found.hinge_margin.values[1] < found.hinge_margin.values[0]


# ------------------------------------------------------------------------------------------------ in studies

STUDY: dict[str, Any] = {
    "study": "flaps",
    "sample": "monte-carlo",
    "samples": 9,
    "over": {"parts.hinge.stiffness": "normal(nominal, 5%)", "parts.panel.mass": "3%"},
    "keep": ["hinge.latch_time.last", "hinge.torque.max"],
}


def test_studies_of_variants_have_the_bits_of_cases_run_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    study = STUDY | {"case": flap()}
    assert runs_of(studies.read(study), ".").most_threads > 1
    threads = studies.sweep(study, workers=2)
    batches = studies.sweep(study | {"batch": 4}, workers=1)
    monkeypatch.setattr(CaseRuns, "_are_of_parts", lambda *arguments: False)
    one_by_one = studies.sweep(study, workers=1)
    xr.testing.assert_identical(threads, one_by_one)
    xr.testing.assert_equal(batches, one_by_one)


def test_a_study_counts_a_refused_variant_with_the_sentence_of_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    study = studies.read({**STUDY, "case": flap(), "samples": 3})
    values = list(study.axes[0].values)
    broken = copy.copy(study.axes[0])
    object.__setattr__(broken, "values", (values[0], -1.0, values[2]))
    object.__setattr__(study, "axes", (broken, *study.axes[1:]))
    found = Evaluator(runs_of(study, "."), workers=2, batch=1).of(Points(study), numbered=True)
    assert [one.status for one in found] == ["success", "failed", "success"]
    monkeypatch.setattr(CaseRuns, "_are_of_parts", lambda *arguments: False)
    assert found[1].reason == Evaluator(runs_of(study, ".")).of([Points(study)[1]])[0].reason
    assert "parts.hinge" in found[1].reason


def test_other_studies_go_their_own_way() -> None:
    by_time = {**STUDY, "case": flap(), "over": {"simulate.until": "5%"}}
    assert runs_of(studies.read(by_time), ".").most_threads == 1
    assert runs_of(studies.read({**STUDY, "case": flap(), "keep": []}), ".").most_threads == 1
    heliogyro = {"case": "heliogyro", "over": {"spool.rate": [3.0, 3.5]}, "keep": ["body_rate.last"]}
    assert runs_of(studies.read(heliogyro), ".").most_threads == 1


def test_time_loops_let_other_threads_run() -> None:
    if not isinstance(implicit_loop.advance, jit.Indirect):
        pytest.skip("nothing is compiled")
    for loop in (implicit_loop.advance, explicit.advance):
        assert loop.dispatcher.targetoptions["nogil"]


def test_a_panel_without_a_latch_keeps_no_time() -> None:
    system = flap()
    found = evolvent.simulate_many(system, [{"hinge.latch": math.inf}, {}], ["hinge.latch_time.last"])
    assert np.isnan(found.hinge_latch_time_last.values).tolist() == [True, False]
