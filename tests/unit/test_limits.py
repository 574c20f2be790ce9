"""Limits of a case: the same in runs, dispersions and designs, and first in the report."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import evolvent
from evolvent import cases
from evolvent.commands.run import run as run_command
from evolvent.design.dispersions.dispersed import evaluate
from evolvent.exports import report
from evolvent.results import limits
from evolvent_base.errors import InputError

#: A flap on a spring, 30 degrees from its rest: the torque is 0.5236 N m at the start, where it is largest.
LARGEST = np.pi / 6.0
CASE = {
    "system": "structure",
    "title": "RCubeSat flap",
    "parts": {
        "bus": {"kind": "rigid-body", "motion": "driven", "rate": "0 rad/s"},
        "flap": {"kind": "rigid-body", "mass": "1 kg", "inertia": "0.1 kg m^2", "position": [0.5, 0.0, "0 m"]},
        "pin": {
            "kind": "joint", "a": ["bus", [0.0, 0.0, "0 m"]], "b": ["flap", [-0.5, 0.0, "0 m"]], "type": "revolute",
            "axis": [0, 0, 1],
        },
        "hinge": {
            "kind": "joint-spring", "joint": "pin", "stiffness": "1 N m/rad", "rest": "30 deg",
            "damping": "0.01 N m s/rad",
        },
    },
    "limits": ["hinge.torque.abs_max <= 500 mN m", "flap.rate.z <= 2 rad/s"],
    "simulate": {"until": "1 s", "every": "0.02 s"},
}  # fmt: skip


def test_a_run_is_judged_by_its_limits(tmp_path):
    ran, simulated = evolvent.run(CASE), evolvent.load(CASE).simulate()
    evolvent.save(ran, tmp_path / "run.nc")
    for found in (ran, simulated, evolvent.open(tmp_path / "run.nc")):
        torque, rate = limits.of_run(found)
        assert (torque.unit, torque.is_met, rate.is_met) == ("N m", False, True)
        assert torque.value == pytest.approx(LARGEST, rel=1e-6)
        assert rate.value == pytest.approx(float(found["flap"].rate[:, 2].max()))
        assert limits.verdict(limits.of_run(found)) == "1 of 2 limits is missed"
        rows = cases.presenter(found).numbers(found)
        assert rows[0].value == "missed, 0.5236 N m, 523.6 mN m"
        assert ("status", "success, but 1 of 2 limits is missed") in list(found.ev.answer().facts)
    report.write(ran, str(tmp_path / "report.html"))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "success, but 1 of 2 limits is missed" in page
    assert page.index("Verdict") < page.index("Limit hinge.torque.abs_max") < page.index("limit hinge")
    assert "Structure: RCubeSat flap" in page  # titles are not changed


def test_a_momentum_of_round_off_is_no_number_of_the_report(tmp_path):
    free = {**CASE["parts"], "bus": {"kind": "rigid-body", "mass": "1 kg", "inertia": "1 kg m^2"}}
    report.write(evolvent.run(CASE | {"parts": free}), str(tmp_path / "report.html"))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Linear momentum: zero throughout." in page


def test_the_command_ends_with_1_where_a_limit_is_missed(tmp_path):
    path, output = tmp_path / "case.yaml", str(tmp_path / "run.nc")
    for bound, code in (("0.5 N m", 1), ("0.6 N m", 0)):
        path.write_text(json.dumps(CASE | {"limits": [f"hinge.torque.abs_max <= {bound}"]}), encoding="utf-8")
        found = CliRunner().invoke(run_command, [str(path), "-o", output, "--no-figures"])
        assert found.exit_code == code, found.output
        assert ("1 of 1 limit is missed" in found.output) == bool(code)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hinge.torque", "limits: the requirement 'hinge.torque' is not of the form"),
        ("hinge.torqe <= 2 N m", "limits: it asks for 'hinge.torqe'; .* did you mean 'hinge.torque'"),
        (
            "flap.rate.abs_max <= 2 rad/s",
            r"limits: 'flap.rate' has 3 \(axis\) values; name one of them, such as flap.rate.x",
        ),
        ("hinge.torque <= 2 m", "limits: the requirement 'hinge.torque <= 2 m' has the bound '2 m'"),
    ],
)
def test_what_is_no_limit_is_refused_before_the_run(text, message):
    case = cases.load(CASE | {"limits": [text]})
    with pytest.raises(InputError, match=message):
        cases.system(case.system).plan(case)


def test_dispersions_and_designs_take_the_same_limits():
    """Stiffnesses of corners, 0.9 and 1.1 N m/rad: the torque of one of them is 0.4712 N m, below the limit."""
    pytest.importorskip("dask")
    study = {"case": CASE, "sample": "corners", "over": {"parts.hinge.stiffness": "10%"}, "keep": ["flap.rate.z.max"]}
    dispersed = evolvent.disperse(study)
    torque, rate = dispersed.limits
    assert (torque.count, torque.share, rate.share) == (1, 0.5, 1.0)
    again = evaluate(dispersed.dataset)  # of a study that was run before
    assert [(one.text, one.count) for one in again.limits] == [(one.text, one.count) for one in dispersed.limits]
    found = evolvent.optimize(CASE, vary={"parts.hinge.stiffness": "0.2 to 2 N m/rad"}, maximize="flap.rate.z.max")
    assert found.problem.requirements[0].text == "hinge.torque.abs_max <= 500 mN m"
    assert found.met
    assert found.best.result.values[0] == pytest.approx(0.5, rel=1e-4)  # the stiffest that meets it


#: Two blocks that approach one another at 1 m/s from 0.4 m to 0.2 m, and a third one that stays at 1 m from the first.
BLOCKS = {
    "system": "structure",
    "parts": {
        "a": {"kind": "rigid-body", "mass": "1 kg", "shape": {"box": [0.2, 0.2, "0.2 m"]}},
        "b": {
            "kind": "rigid-body", "mass": "1 kg", "shape": {"box": [0.2, 0.2, "0.2 m"]}, "position": [0.6, 0, "0 m"],
            "velocity": [-1, 0, "0 m/s"],
        },
        "c": {
            "kind": "rigid-body", "mass": "1 kg", "shape": {"box": [0.2, 0.2, "0.2 m"]}, "position": [0, 1.2, "0 m"],
        },
    },
    "limits": ["clearance >= 250 mm", "a - c.clearance >= 250 mm"],
    "simulate": {"until": "0.2 s", "every": "0.05 s"},
}  # fmt: skip


def test_clearances_are_limits():
    """Of all pairs, and of one; in runs, dispersions and designs."""
    pytest.importorskip("coal")
    run = evolvent.run(BLOCKS)
    smallest, one = limits.of_run(run)
    assert (smallest.is_met, one.is_met) == (False, True)
    assert (smallest.value, one.value) == pytest.approx((0.2, 1.0), abs=1e-9)
    assert smallest.shown == "missed, 0.2 m, 200 mm"
    assert smallest.value == pytest.approx(float(run.ev.clearance().dataset.smallest.min()), abs=1e-12)
    study = {"case": BLOCKS, "sample": "corners", "over": {"parts.b.velocity.0": "50%"}, "keep": ["b.position.x.last"]}
    pytest.importorskip("dask")
    found = evolvent.disperse(study)
    assert [met.count for met in found.limits] == [1, 2]  # 0.3 m and 0.1 m are left of the first
    vary = {"parts.b.velocity.0": "-1.5 to -0.5 m/s"}
    best = evolvent.optimize(BLOCKS, vary=vary, minimize="b.position.x.last")
    assert best.met
    assert best.best.result.values[0] == pytest.approx(0.25, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a - d.clearance >= 5 mm", "'a - d.clearance' is of no pair of bodies; did you mean 'a - "),
        ("clearance.min >= 5 mm", "but 'clearance' is the smallest over the run; write 'clearance'"),
        ("clearance >= 5 N", "has the bound '5 N'; it must be a number in m"),
    ],
)
def test_what_is_no_clearance_is_refused_before_the_run(text, message):
    pytest.importorskip("coal")
    with pytest.raises(InputError, match=message):
        evolvent.load(BLOCKS | {"limits": [text]}).simulate()
