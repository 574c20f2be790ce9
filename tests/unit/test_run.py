"""Runs of the heliogyro: contents, accounts, laws, refusals, and files."""

import json
import math
import os
import re

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import cases, results
from evolvent.results import netcdf, variables
from evolvent_base import files

heliogyro = cases.system("heliogyro")
QUICK = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "9 s", "blade.nodes": 40}


@pytest.fixture(scope="module")
def quick():
    return evolvent.run("heliogyro", QUICK)


def test_drawn_spools_turn_so_that_the_thread_goes_out(quick):
    spools = heliogyro.motion(quick).frames[0].solids[1:]
    assert len(spools) == 2
    for spool in spools:
        radius = spool.profile[0][1]
        top = np.cross(spool.axis, (0.0, 0.0, radius))  # velocity where the thread leaves, for a rate of 1 rad/s
        out = np.array(spool.centre) / np.linalg.norm(spool.centre)
        np.testing.assert_allclose(top, radius * out, atol=1e-15)
        np.testing.assert_array_equal(spool.turned, quick["reel-1"].angle.values)


def test_has_all_variables_with_units(quick):
    blade, time, vector = ("time", "blade"), ("time",), ("time", "axis")
    wanted = {
        "tip_lag": (blade, "rad"),
        "deployed_length": (blade, "m"),
        "hub_tension": (blade, "N"),
        "body_rate": (time, "rad s-1"),
        "body_angle": (time, "rad"),
        "body_rate_paper": (time, "rad s-1"),
        "body_rate_corrected": (time, "rad s-1"),
        "angular_momentum": (vector, "kg m2 s-1"),
        "momentum": (vector, "kg m s-1"),
        "angular_momentum_body": (time, "kg m2 s-1"),
        "angular_momentum_released": (time, "kg m2 s-1"),
        "angular_momentum_wound": (time, "kg m2 s-1"),
        "angular_momentum_jumps": (time, "kg m2 s-1"),
        "energy_kinetic": (time, "J"),
        "energy_elastic": (time, "J"),
        "energy_dissipated": (time, "J"),
        "energy_released": (time, "J"),
        "work_spools": (time, "J"),
        "work_loads": (time, "J"),
        "work_drives": (time, "J"),
        "energy_defect": (time, "J"),
        "energy_moved": (time, "J"),
    }
    for name, (dims, unit) in wanted.items():
        assert quick[name].dims == dims, name
        assert quick[name].attrs["units"] == unit, name
    assert list(quick.children) == ["body", "reel-1", "blade-1"]
    own = {"position": "m", "velocity": "m s-1", "tension": "N", "lag": "rad", "signed_lag": "rad", "released": "1"}
    for name, unit in own.items():
        assert quick["blade-1"][name].dims[:2] == ("time", "node"), name
        assert quick["blade-1"][name].attrs["units"] == unit, name
    assert quick["reel-1"].angle.attrs["units"] == "rad"
    for name, variable in variables.flat(quick).variables.items():
        if name != "axis":
            assert {"units", "long_name"} <= set(variable.attrs), name
    assert quick.sizes["blade"] == 2
    assert list(quick.axis.values) == ["x", "y", "z"]
    assert list(quick["blade-1"].node.values) == list(range(40))
    assert quick.time.attrs["units"] == "s"


def test_says_where_it_comes_from(quick):
    attrs = quick.attrs
    assert (attrs["status"], attrs["system"], attrs["method"]) == ("success", "heliogyro", "dopri5")
    assert attrs["version"] == evolvent.__version__
    assert json.loads(attrs["statistics"])["steps"] > 100
    assert attrs["wall_time_s"] > 0.0
    assert attrs["compile_time_s"] >= 0.0
    assert cases.load(cases.parse_yaml(attrs["case"], "case")) == cases.load("heliogyro", QUICK)


def test_its_own_case_gives_the_same_numbers(quick):
    again = evolvent.run(cases.parse_yaml(quick.attrs["case"], "case"))
    xr.testing.assert_equal(again, quick)


def test_times_end_with_the_duration():
    run = evolvent.run("heliogyro", {**QUICK, "solver.duration": "0.25 s"})
    np.testing.assert_allclose(run.ev.regular().time.values, [0.0, 0.1, 0.2, 0.25], rtol=1e-15)
    assert heliogyro.plan(cases.load("heliogyro")).duration == pytest.approx(5.0 / 0.035, rel=1e-14)


def in_body(run, line):
    """Points of the tip, and of all of a blade, in body axes."""
    return heliogyro.motion(run).in_body().lines[line].points


def test_geometry(quick):
    """Links have their lengths, the first two released nodes their tension, copies are turned by half a turn."""
    blade = quick["blade-1"]
    position, released = blade.position.values, blade.released.values > 0.0
    gaps = np.linalg.norm(np.diff(position, axis=1), axis=-1)
    both = released[:, 1:]
    np.testing.assert_allclose(gaps[both], 5.0 / 40, rtol=1e-8)
    count = released.sum(axis=1)
    assert count[-1] == math.floor(0.035 * 9.0 / (5.0 / 40)) + 1
    np.testing.assert_allclose(quick["reel-1"].angle.values, 3.5 * quick.time.values, atol=1e-12)
    np.testing.assert_allclose(quick.deployed_length.values, 0.035 * quick.time.values[:, None] * [1, 1], atol=1e-14)
    assert np.array_equal(np.isnan(blade.tension.values), ~released)
    one, two = (in_body(quick, k) for k in (0, 1))
    np.testing.assert_allclose(two[..., :2], -one[..., :2], atol=1e-14)
    np.testing.assert_allclose(two[..., 2], one[..., 2], atol=1e-14)


def test_lag_is_the_papers_formula(quick):
    x, y, z = np.moveaxis(in_body(quick, 0)[1:, 0] - [0.05, 0.0, 0.01], -1, 0)
    lag = np.arccos(x / np.sqrt(x**2 + y**2 + z**2))
    np.testing.assert_allclose(quick["blade-1"].lag.values[1:, 0], lag, rtol=1e-8)
    np.testing.assert_allclose(np.abs(quick.tip_lag.values[1:]), lag[:, None] * [1, 1], rtol=1e-6)
    assert np.degrees(quick["blade-1"].lag.sel(time=slice(7, 9)).values[:, 0].mean()) == pytest.approx(13.46, abs=0.05)


def test_velocity_is_the_rate_of_position():
    fine = evolvent.run("heliogyro", {**QUICK, "solver.duration": "1 s", "output.every": "1 ms"})
    blade = fine["blade-1"]
    t, x, v = fine.time.values, blade.position.values[:, 0], blade.velocity.values[:, 0]
    rate = (x[2:] - x[:-2]) / (t[2:] - t[:-2])[:, None]
    np.testing.assert_allclose(rate[100:], v[101:-1], atol=1e-5)


def test_formulas(quick):
    length = 0.035 * quick.time.values
    rho, tip, J, L0 = 7.35e-4, 5e-4, 0.004, 0.05
    paper = J * 6.0 / (J + 2.0 / 3.0 * rho * length**3 + 2.0 * tip * length**2)
    np.testing.assert_allclose(quick.body_rate_paper.values, paper, rtol=1e-13)
    inertia = J + 2.0 * rho * ((L0 + length) ** 3 - L0**3) / 3.0 + 2.0 * tip * (L0 + length) ** 2
    np.testing.assert_allclose(quick.body_rate_corrected.values, 6.0 * inertia[0] / inertia, rtol=1e-13)
    assert abs(quick.body_rate_corrected / quick.body_rate - 1.0).max() < 2e-3
    np.testing.assert_allclose(quick.angular_momentum_body, J * quick.body_rate, rtol=1e-13)


def test_accounts_close(quick):
    assert abs(quick.energy_defect).max() < 1e-6 * quick.energy.max()
    assert quick.momentum_balance.max() < 1e-6
    total = quick.angular_momentum_body + quick.angular_momentum_released
    np.testing.assert_allclose(quick.angular_momentum[:, 2], total, rtol=1e-14)
    assert quick.work_spools[-1] < 0.0
    booked = quick.work_spools + quick.energy_released - quick.energy_dissipated
    energy = quick.energy_kinetic + quick.energy_elastic
    np.testing.assert_allclose(energy - energy[0], booked, atol=1e-6 * float(energy[0]))
    np.testing.assert_allclose(quick.hub_tension[-1, 0], np.nanmax(quick["blade-1"].tension[-1]), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.release
def test_whole_paper_case():
    """The built-in case's numbers against the reference results of the paper's model.

    `tests/docs/test_sentences.py` holds them with fewer digits, `tests/analytic/test_heliogyro_reference.py` the lags.
    """
    run = evolvent.run("heliogyro")
    assert float(run.body_rate[-1]) == pytest.approx(0.2601, abs=2e-4)
    assert float((abs(run.body_rate_paper - run.body_rate) / run.body_rate).max()) == pytest.approx(0.0428, abs=1e-4)
    lag = np.degrees(run["blade-1"].lag.values[:, 0])
    for low, high, mean in ((7, 20, 13.46), (20, 60, 13.32), (60, 100, 12.94)):
        inside = (run.time.values >= low) & (run.time.values <= high)
        assert lag[inside].mean() == pytest.approx(mean, abs=0.01)
    assert run.attrs["warning"].startswith("'blade-1' pushes where a thread would go slack")
    labels = [number.label for number in heliogyro.numbers(run)]
    assert "warning" in labels
    values = {number.label: number.value for number in heliogyro.numbers(run)}
    assert values["largest gap to eq. (18)"].startswith("4.28 %")


def test_mirrored_spin_mirrors_the_blades(quick):
    mirrored = evolvent.run("heliogyro", {**QUICK, "body.rate": "-6 rad/s"})
    np.testing.assert_allclose(mirrored.body_rate, -quick.body_rate, rtol=1e-9)
    np.testing.assert_allclose(in_body(mirrored, 0)[:, 0] * [1, -1, 1], in_body(quick, 0)[:, 0], atol=1e-9)


def test_free_body_moves_as_the_spinning_one_if_its_blades_are_alike():
    short = {**QUICK, "solver.duration": "5 s", "blade.nodes": 20, "blade.wound_mass": "carried"}
    spin = evolvent.run("heliogyro", short)
    free = evolvent.run("heliogyro", {**short, "body.motion": "free", "body.mass": "2 kg"})
    np.testing.assert_allclose(free.body_rate, spin.body_rate, rtol=1e-6)
    np.testing.assert_allclose(free.body_angle, spin.body_angle, atol=1e-5)
    np.testing.assert_allclose(free["blade-1"].position, spin["blade-1"].position, atol=1e-5)
    assert free["body"].attitude.dims == ("time", "quaternion")
    assert abs(free.momentum - free.momentum[0]).max() < 1e-8


def test_unequal_drives_give_unequal_blades():
    run = evolvent.run("heliogyro", {**QUICK, "spool.rate": ["3.5 rad/s", "3 rad/s"], "solver.duration": "4 s"})
    np.testing.assert_allclose(run.deployed_length[-1], [0.14, 0.12], rtol=1e-12)
    lag = np.degrees(run.tip_lag.values[-1])
    assert lag[0] - lag[1] > 1.0
    last = {number.label: number.value for number in heliogyro.numbers(run)}
    assert last["deployed length"] == "0.14 / 0.12 m"


def test_driven_body_holds_its_rate_and_the_straight_blade():
    run = evolvent.run(
        "heliogyro",
        {**QUICK, "body.motion": "driven", "spool.start_length": "0.5 m", "spool.start_lag": math.asin(0.07 / 0.3)},
    )
    assert "body_rate_paper" not in run
    np.testing.assert_allclose(run.body_rate, 6.0, rtol=1e-15)
    np.testing.assert_allclose(run.tip_lag.values[:, 0], math.asin(0.07 / 0.3), atol=1e-6)


def test_stop_and_reel_in():
    changes = [{"time": "4 s", "rate": 0, "ramp": "1 s"}, {"time": "6 s", "rate": "-3.5 rad/s", "ramp": "1 s"}]
    run = evolvent.run("heliogyro", {**QUICK, "spool.changes": changes, "solver.duration": "10 s"})
    np.testing.assert_allclose(run.deployed_length.sel(time=[5.5]).values[0], 0.035 * 4.5, rtol=1e-12)
    np.testing.assert_allclose(run.deployed_length[-1], 0.035 * (4.5 - 3.5), rtol=1e-9)
    out = run["blade-1"].released.sum(dim="node").values
    assert out.max() > out[-1]
    lag, signed = run["blade-1"].lag.values[1:, :1] * [1, 1], run.tip_lag.values[1:]
    np.testing.assert_allclose(np.abs(signed), lag, atol=1e-6)
    assert np.all(signed[run.time.values[1:] < 4.0] > 0.0)
    assert signed[-10:].min() < -1.0
    mirrored = evolvent.run(cases.parse_yaml(run.attrs["case"], "case"), {"body.rate": -6})
    np.testing.assert_allclose(mirrored.tip_lag.values[1:], signed, atol=1e-6)
    even = run.ev.regular()
    after, signed = (even.time.values >= 7.0)[1:], even.tip_lag.values[1:]
    rows = {number.label: number.value for number in heliogyro.numbers(run)}
    assert rows["mean tip lag, 7 to 10 s"] == f"{np.degrees(signed[after, 0].mean()):.4g} deg"


def test_table_and_ramp():
    table = {**QUICK, "spool.rate": None, "spool.table": [[0, 2], [2, 2], [3, 3]], "solver.duration": "4 s"}
    run = evolvent.run("heliogyro", table)
    assert float(run.deployed_length.sel(time=2.0)[0]) == pytest.approx(0.04, rel=1e-12)
    ramp = {**QUICK, "spool.ramp": "1 s", "spool.start_length": "5 mm", "solver.duration": "4 s"}
    run = evolvent.run("heliogyro", ramp)
    assert float(run.deployed_length[-1, 0]) == pytest.approx(0.005 + 0.035 * 3.5, rel=1e-12)


def test_letting_go_leaves_straight_lines():
    case = {**QUICK, "blade.length": "0.2 m", "blade.nodes": 4, "blade.separates": True, "solver.duration": "7 s"}
    run = evolvent.run("heliogyro", case)
    gone = run["blade-1"].separated.values > 0.0
    assert run.time.values[gone][0] == pytest.approx(0.2 / 0.035, abs=0.1)
    assert np.all(run.hub_tension.values[gone] == 0.0)
    np.testing.assert_allclose(run.body_rate.values[gone], run.body_rate.values[-1], rtol=1e-12)
    assert np.all(np.isnan(run.body_rate_paper.values[gone]))
    released = float(run.time.values[~gone][-1])
    for figure in heliogyro.figures(run):
        for panel in figure.panels:
            for line in panel.lines:
                if figure.name in ("tip_lag", "tension") and panel.x_label == "time, s":
                    assert np.all(np.isnan(line.y[line.x > released]))
                if line.label and figure.name in ("shape", "tension") and panel.x_label != "time, s":
                    assert float(line.label.removesuffix(" s")) <= released + 1e-2


@pytest.mark.slow
def test_springs_ring_and_their_tension_is_a_mean_beside_a_sample(quick):
    run = evolvent.run("heliogyro", {"solver.duration": "30 s"})
    rows = {number.label: number.value for number in heliogyro.numbers(run)}
    mean = float(rows["largest hub tension, mean of 1.9 s"].split()[0])
    sample = float(rows["largest hub tension, one sample"].split()[0])
    assert "the springs ring" in rows["largest hub tension, one sample"]
    assert mean == pytest.approx(0.0167, rel=0.01)  # as of links of fixed length
    assert sample == pytest.approx(float(run.hub_tension.max()), rel=1e-3)
    assert sample > 1.1 * mean
    panel = next(figure for figure in heliogyro.figures(run) if figure.name == "tension").panels[0]
    middle, least, largest = (line.y for line in panel.lines)
    assert np.all((least <= middle) & (middle <= largest))
    assert "springs ring" in panel.title
    assert "largest hub tension" in {number.label for number in heliogyro.numbers(quick)}


def test_an_energy_account_that_does_not_close_is_told(quick):
    assert "warning" not in quick.attrs
    run = evolvent.run("heliogyro", {**QUICK, "solver.rtol": 1e-3, "solver.atol": 1e-4})
    words = re.search(r"the energy balance is off by up to (\S+) of the energy at the start", run.attrs["warning"])
    start = float(run.energy_kinetic[0] + run.energy_elastic[0])
    defect = float(abs(run.energy_defect).max())
    assert defect > 1e-5 * start
    assert float(words[1]) == pytest.approx(defect / start, rel=0.05)
    assert "solver.rtol" in {number.label: number.value for number in heliogyro.numbers(run)}["warning"]


def test_a_pay_out_too_fast_for_a_steady_lag_is_reported():
    run = evolvent.run("heliogyro", {**QUICK, "spool.rate": "16 rad/s", "solver.duration": "0.5 s"})
    assert "the pay-out speed of 0.16 m/s is not below L0 W0 / 2 = 0.15 m/s" in run.attrs["warning"]


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"solver.duration": "200 s"}, ["outruns the thread 'blade-1'", "blade.length is 5 m", "blade.separates"]),
        ({"spool.changes": [{"time": 20, "rate": 0, "ramp": 1}]}, ["solver.duration is auto"]),
        (
            {"spool.changes": [{"time": 2, "rate": -3.5, "ramp": 1}], "solver.duration": 9},
            ["reels in more of the thread 'blade-1' than is out"],
        ),
        ({"spool.rate": None}, ["spool.rate is missing", "spool.table"]),
        ({"spool.rate": None, "spool.table": [[1, 1], [2, 2]]}, ["spool.table starts at 1 s"]),
        (
            {"blade.segments": "inextensible", "spool.ramp": 1},
            ["spool starts at rest with nothing out", "spool.start_length above 0"],
        ),
        (
            {"blade.segments": "inextensible", "spool.changes": [{"time": 2, "rate": 1}], "solver.duration": 9},
            ["spool.changes holds one of no duration"],
        ),
        ({"output.every": 1e-9}, ["output.every is 1e-09 s", "samples"]),
        ({"solver.step": "1 ms"}, ["solver.step is 0.001 s", "stability limit"]),
        (
            {"solver.step": "1 ns"},
            ["solver.step is 1e-09 s", "1.4e+11 steps", "use a longer solver.step, or shorten solver.duration"],
        ),
        ({"blade.stiffness": 1e15}, ["steps in all", "'blade-1'", "less damping or stiffness"]),
        ({"blade.stiffness": 1e15, "solver.method": "dopri5"}, ["steps in all", "less damping or stiffness"]),
        ({"spool.rate": 0}, ["solver.duration is auto, but no blade is ever all out", "such as '60 s'"]),
        ({"spool.rate": [-3, 0]}, ["solver.duration is auto"]),
        ({"spool.rate": None, "spool.table": [[0, 1], [1, 0]]}, ["solver.duration is auto"]),
        ({"spool.start_length": 5}, ["solver.duration is auto", "after the start"]),
        (
            {"spool.rate": -3, "solver.duration": 5},
            ["reels in more of the thread", "start with more thread out (spool.start_length)"],
        ),
        ({"body.motion": "free"}, ["body.mass is missing"]),
        ({"body.inertia": [1, 2]}, ["body.inertia is"]),
        ({"body.inertia": [1, 2, 9]}, ["body.inertia is (1.0, 2.0, 9.0)", "exceeds the sum of the others"]),
        ({"spool.rate": None, "spool.table": [[0, 1], [0, 2]]}, ["spool: row 2 of the table is at 0.0 s"]),
        ({"spool.rate": None, "spool.table": [[0, 1]]}, ["spool: the table has 1 time and 1 value", "two or more"]),
        (
            {"spool.changes": [{"time": 5, "rate": 1, "ramp": 5}, {"time": 8, "rate": 1}]},
            ["spool.changes: the step at 8.0 s starts before the last one has ended"],
        ),
        ({"spool.start_length": 6}, ["spool.start_length is 6 m, more than blade.length 5 m"]),
        ({"solver.method": "dopri5", "solver.step": 0.1}, ["solver.step is 0.1 s", "dopri5"]),
    ],
)
def test_what_cannot_be_run_is_refused(overrides, words):
    with pytest.raises(evolvent.InputError) as caught:
        evolvent.run("heliogyro", overrides)
    for word in words:
        assert word in str(caught.value)


@evolvent.law
def weight(x, v, t, parameters):
    return 0.0, 0.0, -parameters[0]


@evolvent.law
def fails(x, v, t, parameters):
    if t > 0.5:
        raise ValueError("no force is known beyond half a second")
    return 0.0, 0.0, 0.0


@evolvent.law
def steady(t, parameters):
    return parameters[0] * t, parameters[0], 0.0


@evolvent.law
def at_time(t, y, parameters):
    return t - parameters[0]


@pytest.mark.slow
def test_laws_take_their_places(quick):
    run = evolvent.run("heliogyro", {**QUICK, "spool.rate": None}, laws={"drive": (steady, (3.5,))})
    np.testing.assert_allclose(run.body_rate, quick.body_rate, rtol=1e-6)
    assert json.loads(run.attrs["laws"]) == {"drive": "steady"}
    run = evolvent.run("heliogyro", {**QUICK, "solver.duration": "2 s"}, laws={"force": (weight, [1e-3])})
    assert float(run["blade-1"].position[-1, 0, 2]) < float(quick["blade-1"].position.sel(time=2.0)[0, 2]) - 1e-4
    assert float(run.work_loads[-1]) > 0.0
    assert "momentum_balance" not in run
    run = evolvent.run("heliogyro", QUICK, laws={"event": (at_time, (1.23,))})
    assert run.attrs["status"] == "stopped by event"
    assert float(run.time[-1]) == pytest.approx(1.23, rel=1e-12)


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        ({"forces": weight}, "no law is called 'forces'; did you mean 'force'"),
        ({"force": lambda x, v, t, p: (0.0, 0.0, 0.0)}, "a function that is no law; decorate it with @evolvent.law"),
        ({"force": (weight, "x")}, "they must be numbers"),
        ({"force": (weight,)}, "has 1 entries"),
        ({3: weight}, "no law is called 3; known: drive, event, force"),
        ([weight], "the laws are .*; they must be a mapping"),
    ],
)
def test_laws_that_cannot_be_used(laws, words):
    with pytest.raises(evolvent.InputError, match=words):
        evolvent.run("heliogyro", QUICK, laws=laws)


def test_a_law_that_raises_ends_the_run_and_keeps_what_was_computed():
    words = r"the law 'fails' \(.*test_run.py:\d+\) .*ValueError: no force is known beyond half a second"
    with pytest.raises(evolvent.RunFailed, match=words) as failed:
        evolvent.run("heliogyro", QUICK, laws={"force": fails})
    assert failed.value.run.attrs["status"] == "failed"
    assert 0.3 < float(failed.value.run.time[-1]) <= 0.5


def test_a_short_run_has_its_start_and_end():
    run = evolvent.run("heliogyro", {"solver.duration": "1e-12 s"})
    assert run.time.values.tolist() == [0.0, 1e-12]


def test_what_is_no_progress_is_refused():
    with pytest.raises(evolvent.InputError, match="progress is 3; it must be a function"):
        evolvent.run("heliogyro", QUICK, progress=3)


@pytest.mark.slow
def test_progress_is_told():
    told = []
    evolvent.run("heliogyro", {"blade.stiffness": "1e6 N/m", "solver.duration": "9 s"}, progress=told.append)
    assert told == sorted(told)
    assert 0.0 < told[0] <= 9.0


def test_a_failed_run_is_raised_with_what_was_computed(monkeypatch):
    from evolvent.solvers.common import balance

    monkeypatch.setattr(balance, "GAINED", 1e-30)
    monkeypatch.setattr(balance, "ROUND_OFF", 0.0)
    with pytest.raises(evolvent.RunFailed, match="energy balance") as caught:
        evolvent.run("heliogyro", QUICK)
    assert caught.value.run.attrs["status"] == "failed"
    assert caught.value.run.sizes["time"] > 1


def test_file_round_trip(quick, tmp_path):
    path = tmp_path / "run.nc"
    results.save(quick, path)
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]
    again = evolvent.open(path)
    xr.testing.assert_identical(again, quick)
    assert heliogyro.numbers(again) == heliogyro.numbers(quick)


def test_nothing_is_left_of_a_file_that_could_not_be_written(quick, tmp_path, monkeypatch):
    def breaks(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", breaks)
    (tmp_path / "run.nc").write_text("old")
    with pytest.raises(evolvent.InputError, match="no space left"):
        results.save(quick, tmp_path / "run.nc")
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]
    assert (tmp_path / "run.nc").read_text() == "old"


def test_files_that_are_no_runs(quick, tmp_path):
    results.save(quick, tmp_path / "run.nc")
    (tmp_path / "cut.nc").write_bytes((tmp_path / "run.nc").read_bytes()[:4000])
    (tmp_path / "text.nc").write_text("hello")
    xr.Dataset({"x": 1.0}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    for name, words in (
        ("none.nc", "no such file"),
        ("cut.nc", "not a NetCDF file, or it is damaged"),
        ("text.nc", "not a NetCDF file, or it is damaged"),
        ("other.nc", "not a run of evolvent"),
        ("", "it is a folder"),
    ):
        with pytest.raises(evolvent.InputError, match=words):
            evolvent.open(tmp_path / name)


def test_where_files_may_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    files.check_writable(tmp_path / "run.nc")
    files.check_writable_folder(tmp_path / "a" / "b")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    for refuse, path, words in (
        (files.check_writable, tmp_path, "it is a folder"),
        (files.check_writable, tmp_path / "none" / "run.nc", "there is no folder"),
        (files.check_writable_folder, tmp_path / "file", "is not a folder"),
        (files.check_writable_folder, tmp_path / "file" / "x", "is not a folder"),
        (files.make_folder, tmp_path / "file", "is not a folder"),
        (files.check_writable, "/dev/null", "it is not a regular file"),
        (files.check_writable, "", "the name is empty"),
        (files.check_writable, "a\0b", "no name may hold a null character"),
        (files.check_writable, 5, "a file is named by a text or a path"),
        (files.check_writable, tmp_path / ("x" * 300), "the name is too long"),
        (files.check_writable_folder, "", "the name is empty"),
        (files.check_writable_folder, tmp_path / ("x" * 300) / "f", "the name is too long"),
        (files.make_folder, "", "the name is empty"),
        (evolvent.open, 5, "cannot read 5: a file is named by"),
        (evolvent.open, "", "the name is empty"),
        (evolvent.open, "/dev/null", "it is not a regular file"),
    ):
        with pytest.raises(evolvent.InputError, match=words):
            refuse(path)
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_file_that_may_not_be_written_is_refused(tmp_path, monkeypatch):
    (tmp_path / "run.nc").write_text("old")
    monkeypatch.setattr(results.os, "access", lambda path, mode: False)
    with pytest.raises(evolvent.InputError, match="permission denied"):
        files.check_writable(tmp_path / "run.nc")


@pytest.mark.slow
def test_links_are_followed(quick, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.nc").symlink_to(tmp_path / "folder" / "run.nc")
    for _ in range(2):
        results.save(quick, tmp_path / "link.nc")
        assert (tmp_path / "link.nc").is_symlink()
        assert [p.name for p in (tmp_path / "folder").iterdir()] == ["run.nc"]
    assert evolvent.open(tmp_path / "link.nc").attrs["status"] == "success"
    results.save(quick, tmp_path / ("x" * 252 + ".nc"))


def _without(run, key):
    return {name: value for name, value in run.attrs.items() if name != key}


def _group(run, name, change):
    """A run with a part's results changed."""
    found = run.copy()
    found[name] = xr.DataTree(change(run[name].to_dataset(inherit=False)))
    return found


def _root(run, change):
    """A run with the data set of its root changed."""
    found = run.copy()
    found.dataset = change(run.to_dataset())
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda run: _root(run, lambda d: d.assign_attrs(system=3)), "'system' is 3; it must be a text"),
        (
            lambda run: _root(run, lambda d: d.drop_attrs(deep=False).assign_attrs(_without(run, "method"))),
            "'method' is missing",
        ),
        (
            lambda run: _root(run, lambda d: d.assign_attrs(system="heliogiro")),
            "'system' is 'heliogiro', but its case is of 'heliogyro'",
        ),
        (lambda run: _root(run, lambda d: d.assign_attrs(status="good")), "'status' is 'good'; known: success"),
        (
            lambda run: _root(run, lambda d: d.assign_attrs(wall_time_s="long")),
            "'wall_time_s' is long; it must be a number",
        ),
        (lambda run: _root(run, lambda d: d.assign_attrs(statistics="{")), "'statistics' is '{'; it must be a mapping"),
        (lambda run: _root(run, lambda d: d.assign_attrs(laws="[]")), "'laws' is '\\[\\]'; it must be a mapping"),
        (lambda run: _root(run, lambda d: d.assign_attrs(warning=1.0)), "'warning' is 1.0"),
        (lambda run: _root(run, lambda d: d.assign_attrs(case="a: [")), "its case, line 1"),
        (lambda run: _root(run, lambda d: d.assign_attrs(case="system: heliogyro")), "body is missing"),
        (lambda run: _root(run, lambda d: d.drop_vars("body_rate")), "the variable 'body_rate' is missing"),
        (lambda run: run.isel(time=slice(0)), "has 0 of 'time'; it must have at least one"),
        (lambda run: _group(run, "blade-1", lambda d: d.isel(node=slice(3))), "has 3 of 'node'; it must have 40"),
        (lambda run: _group(run, "blade-1", lambda d: d.drop_vars("line")), "the variable 'blade-1.line' is missing"),
        (lambda run: _group(run, "blade-1", lambda d: d.drop_attrs(deep=False)), "'drawn' of its part 'blade-1'"),
        (lambda run: _root(run, lambda d: d.assign(body_rate=d.tip_lag)), r"'body_rate' is over \('time', 'blade'\)"),
        (lambda run: _root(run, lambda d: d.assign(body_rate=("time", ["x"] * d.sizes["time"]))), "holds no numbers"),
        (lambda run: _root(run, lambda d: d.assign_coords(time=d.time * np.nan)), "'time' is not finite"),
        (lambda run: _root(run, lambda d: d.assign_coords(time=0.0 * d.time)), "'time' does not rise from sample"),
        (lambda run: run.isel(time=slice(None, None, -1)), "'time' does not rise from sample to sample"),
    ],
)
def test_damaged_runs_are_refused_in_one_sentence(quick, tmp_path, change, words):
    (tmp_path / "run.nc").write_bytes(netcdf.image(change(quick)))
    with pytest.raises(evolvent.InputError, match=words) as caught:
        evolvent.open(tmp_path / "run.nc")
    assert "run.nc" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_part_of_a_run_can_be_saved(quick, tmp_path):
    """What a caller has selected is what the file lists; the run itself stays as it is."""
    before = dict(quick.attrs)
    chosen = quick.isel(time=slice(0, 20), node=slice(5), missing_dims="ignore")
    results.save(chosen, tmp_path / "part.nc")
    found = evolvent.open(tmp_path / "part.nc")
    assert found["blade-1"].sizes["node"] == 5
    assert found.sizes["time"] == 20
    assert quick.attrs == before
