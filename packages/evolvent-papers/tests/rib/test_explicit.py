"""The wrapped rib by an explicit method, with penalties in place of its joints, beside the implicit one."""

import json

import numpy as np
import pytest

import evolvent
from evolvent import cases, results
from evolvent.results import variables
from evolvent_base.errors import RunFailed
from evolvent_papers import wrapped_rib as system
from rib.reading import balance, work

SHORT = {"rib.elements": 12, "rib.length": 4, "output.every": 0.02, "solver.duration": 4}
RK4 = SHORT | {"solver.method": "rk4"}


@pytest.fixture(scope="module")
def both():
    """A rib of which 40 % are wound, by both methods."""
    return evolvent.run("wrapped-rib", SHORT | {"solver.tolerance": 1e-5}), evolvent.run("wrapped-rib", RK4)


@pytest.mark.slow
def test_both_methods_wind_alike(both):
    implicit, explicit = both
    assert set(variables.names(explicit)) == {*variables.names(implicit), "root-1.energy_elastic"}
    assert float(explicit.wrap_angle[-1, 0]) > 0.35 * 4.0 / 0.6
    for name, part in {
        "rib-1.position": 2e-3, "tip_radius": 2e-3, "wrap_angle": 3e-3, "rib-1.tip_speed": 0.015,
        "contact-1.impulse": 0.01, "work_loads": 1e-3, "energy_kinetic": 5e-3, "energy_losses": 1e-3,
        "angular_momentum": 5e-3,
    }.items():  # fmt: skip
        wanted, found = (variables.get(run.ev.regular(), name).values for run in both)
        assert found == pytest.approx(wanted, abs=part * np.abs(wanted).max()), name
    # what rings or touches is compared by its mean over the last half
    for name in ("hub_torque", "rib-1.energy_elastic", "rib-1.axial_force"):
        means = [float(variables.get(run.ev.regular(), name).sel(time=slice(2.0, 4.0)).mean()) for run in both]
        assert means[1] == pytest.approx(means[0], rel=0.03), name


def test_its_account_closes(both):
    run = both[1]
    assert np.abs(balance(run)).max() < 1e-5
    losses = run.energy_losses
    assert losses.sum("cause").values == pytest.approx(run.energy_dissipated.values, abs=1e-15)
    gained = run.energy + losses.sum("cause") - work(run)
    assert gained.values == pytest.approx(run.energy_defect.values, abs=1e-12)
    assert float(losses.sel(cause="mass damping")[-1]) > 0.1
    assert float(losses.sel(cause="contact")[-1]) > 0.0
    rate = np.diff(run["contact-1"]["impulse"].values)
    assert np.all(rate >= 0.0)
    told = {n.label: n.value for n in system.numbers(run)}
    assert told["roots held by penalties of"].startswith("540 N/m")
    # the root gives way by the tension over the penalty's stiffness
    root = np.linalg.norm(run["rib-1"]["position"].values[:, 0] - [0.6, 0.0, 0.0], axis=-1)
    assert 0.0 < root.max() < 3.0 * 3.0 * 0.2 / 0.6 / 540.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"rib.root": "clamp", "rib.start_angle": "90 deg", "solver.duration": 1},
        {"hub.motion": "free", "hub.mass": 20, "hub.inertia": 5, "solver.duration": 2},
        {"hub.motion": "spin", "hub.inertia": 5, "rib.count": 2, "rib.root_stiffness": 1e-3, "solver.duration": 1},
        {"rib.formulation": "cable_stretch", "damping.beta": 1e-3, "damping.elements": [1, 2], "solver.duration": 1},
        {"rib.formulation": "assumed_strain", "rib.elements": 6, "rib.thickness": "3 mm", "solver.duration": 0.05},
        {"solver.method": "heun", "solver.duration": 0.5},
    ],
)
def test_every_kind_of_rib_runs(changes):
    run = evolvent.run("wrapped-rib", RK4 | changes)
    other = evolvent.run("wrapped-rib", SHORT | changes | {"solver.method": "generalized-alpha"})
    assert run["rib-1"]["position"].values == pytest.approx(other["rib-1"]["position"].values, abs=0.01)
    assert run.hub_angle.values == pytest.approx(other.hub_angle.values, abs=1e-4)
    assert np.abs(balance(run)).max() < 1e-4


@pytest.mark.slow
def test_a_run_goes_on_and_is_shown(both, tmp_path):
    path = str(tmp_path / "wound.nc")
    results.save(both[1], path)
    again = results.open(path)
    assert system.numbers(again) == system.numbers(both[1])
    assert system.figures(again)
    changes = {"start": path, "rib.length": 4, "rib.elements": 12, "solver.duration": 0.2, "output.every": 0.1}
    run = evolvent.run("wrapped-rib-deploy", changes | {"solver.method": "rk4"})
    starts, ended = run["rib-1"]["position"].values[0], both[1]["rib-1"]["position"].values[-1]
    assert starts == pytest.approx(ended, abs=1e-9)


def test_a_step_that_is_stable_and_yet_too_long_fails_and_keeps_what_it_has():
    with pytest.raises(RunFailed, match=r"energy balance is off by .* energy-momentum") as caught:
        evolvent.run("wrapped-rib", RK4 | {"solver.step": "1.2 ms", "solver.duration": 8})
    run = caught.value.run
    assert float(run.time[-1]) > 2.0
    assert np.all(np.isfinite(run["rib-1"]["position"].values))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"solver.step": "2 ms"}, "above the stability limit 0.00144"),
        ({"solver.step": "10 ms"}, "above the stability limit"),
        ({"solver.step": "1 ns", "solver.duration": 6}, "more than 1e+09; use a longer solver.step"),
    ],
)
def test_what_it_cannot_do_is_refused_in_a_line(call, changes, words):
    sets = [item for key, value in (RK4 | changes).items() for item in ("--set", f"{key}={json.dumps(value)}")]
    code, _, message = call("run", "wrapped-rib", "--no-figures", *sets)
    assert code == 2
    assert words in message
    assert "\n" not in message.rstrip()


@pytest.mark.slow
def test_the_number_of_steps_is_reported_before_a_run(call):
    plan = system.SYSTEM.plan(cases.load("wrapped-rib", {"solver.method": "rk4"}))
    assert plan.note.startswith("rk4 takes 1.2e+06 steps of 0.00013 s over 150 s; energy-momentum takes far fewer")
    assert system.SYSTEM.plan(cases.load("wrapped-rib")).note == ""
    sets = [
        item
        for key, value in (RK4 | {"solver.duration": 0.1}).items()
        for item in ("--set", f"{key}={json.dumps(value)}")
    ]
    code, _, notes = call("run", "wrapped-rib", "--no-figures", *sets)
    assert code == 0
    assert "rk4 takes" in notes
