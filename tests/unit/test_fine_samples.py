"""Samples between the regular ones: where they are kept, what they are for, and what stays as it is without them."""

import json

import numpy as np
import pytest

import evolvent
from evolvent import System, cases, parts, results
from evolvent.design.evaluator import record
from evolvent.results import fine_samples
from evolvent.results.fine_samples import MARK, Times

OFF = {"simulate.fine": False}


def fine_of(run):
    """Whether each sample of a run is a fine one."""
    return run[MARK].values == 1 if MARK in run.data_vars else np.zeros(run.sizes["time"], dtype=bool)


# ------------------------------------------------------------------------------------------------ the times


def test_times_hold_regular_ones_those_for_derived_quantities_and_finer_ones():
    samples = np.array([0.0, 1.0, 2.0, 3.0])
    between = np.array([-1.0, 0.5, 1.0, 1.0 + 1e-12, 2.5, 2.7, 3.0, 4.0])
    times = Times.of(samples, between, fine=False, values=1)
    np.testing.assert_array_equal(times.all, [0.0, 0.5, 1.0, 2.0, 2.5, 2.7, 3.0])
    np.testing.assert_array_equal(times.all[times.regular], samples)
    assert times.derived.all()
    assert Times.of(samples, fine=False, values=1).regular.all()
    times = Times.of(samples, between, fine=True, values=1)
    assert times.all.size == 1 + 3 * fine_samples.PARTS  # 0.5, 2.5 and 2.7 are among the tenths
    np.testing.assert_array_equal(times.all[times.regular], samples)
    np.testing.assert_array_equal(times.all[times.derived & ~times.regular], [0.5, 2.5, 2.7])
    assert np.all(np.diff(times.all) > 0.09)


def test_finer_times_are_fewer_for_a_large_state():
    samples = np.linspace(0.0, 1.0, 401)
    assert Times.of(samples, fine=True, values=100).all.size == 1 + 400 * fine_samples.PARTS
    few = Times.of(samples, fine=True, values=10_000).all.size
    assert 401 < few <= fine_samples.MOST_VALUES / 10_000 + 401
    assert Times.of(samples, fine=True, values=10_000_000).all.size == 401


# ------------------------------------------------------------------------------------------------ which are kept


def kept_of(t, values, regular):
    kept = np.isin(np.arange(t.size), regular)
    vectors = values if values.shape[1] == 3 else np.pad(values, ((0, 0), (0, 2)))
    fine_samples.add_fine(t, vectors[:, None], kept)
    return kept


def test_a_pulse_between_samples_is_kept_and_followed_everywhere():
    t = np.linspace(0.0, 10.0, 1001)
    values = np.exp(-(((t - 5.23) / 0.03) ** 2))[:, None]
    kept = kept_of(t, values, np.arange(0, 1001, 20))
    assert kept.sum() - 51 <= 25
    assert np.all(np.abs(t[kept & (np.arange(1001) % 20 != 0)] - 5.23) < 0.2)
    assert np.abs(np.interp(t, t[kept], values[kept, 0]) - values[:, 0]).max() <= fine_samples.SHARE
    assert values[kept].max() > 0.99 * values.max()


def test_a_steady_motion_and_a_vibration_that_is_sampled_too_coarsely_get_no_fine_samples():
    t = np.linspace(0.0, 10.0, 1001)
    regular = np.arange(0, 1001, 10)
    for values in (t, t - 5.03, t**2, np.sin(40.0 * t), np.zeros_like(t)):
        assert kept_of(t, values[:, None], regular).sum() == regular.size
    turning = np.stack([np.cos(20.0 * t), np.sin(20.0 * t), 0.01 * t], axis=1)
    assert kept_of(t, turning, regular).sum() == regular.size


def test_fine_samples_are_at_most_as_many_as_the_regular_ones():
    t = np.linspace(0.0, 10.0, 1001)
    noisy = np.where(t > 8.0, np.random.default_rng(3).normal(size=t.size), 0.0)[:, None]
    kept = kept_of(t, noisy, np.arange(0, 1001, 20))
    assert kept.sum() == 2 * 51


# ------------------------------------------------------------------------------------------------ runs


#: Mass (kg), weight (m/s2), height (m) and stiffness (N/m) of a ball that falls onto a spring and bounces.
M, G, H, K = 1.0, 9.81, 1.0, 1e5
BOUNCES = 3.0


def bouncing(**settings):
    """A ball that bounces on a spring that only pushes, sampled at intervals in which its speed turns."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=M, position=(0.0, 0.0, H)), "ball")
    system.add(parts.Spring(a="ball", b=(0.0, 0.0, -1.0), length=1.0, law=f"{K} * min(x, 0)"), "floor")
    return system.simulate(until=BOUNCES, every=0.1, tolerance=1e-8, **settings)


def test_the_speed_before_and_after_every_bounce_is_among_the_samples():
    """The largest speed of a fall onto a spring is sqrt(2 g h + m g2 / k), where the spring bears the weight."""
    run, coarse = bouncing(), bouncing(fine=False)
    speeds = {k: np.linalg.norm(one["ball"]["velocity"].values, axis=1) for k, one in enumerate((run, coarse))}
    peak = np.sqrt(2.0 * G * H + M * G**2 / K)
    assert abs(speeds[0].max() / peak - 1.0) < 0.02
    assert speeds[1].max() < 0.98 * peak
    time, fall = run["time"].values, np.sqrt(2.0 * H / G)
    period = 2.0 * fall + np.pi / np.sqrt(K / M)
    first = np.arange(fall, BOUNCES, period)
    for bounce in first:  # the speed is caught about each of them, not about the largest alone
        near = np.abs(time - bounce) < 0.05
        assert speeds[0][near].max() > 0.96 * peak
    fine = fine_of(run)
    assert np.all(np.abs(time[fine][:, None] - first).min(axis=1) < 0.11)
    assert fine.sum() <= (~fine).sum()


def test_regular_samples_are_bit_for_bit_those_of_a_run_without_fine_ones():
    run, coarse = bouncing(), bouncing(fine=False)
    assert MARK not in coarse.data_vars
    even = results.regular(run)
    for path, variables in (("/", coarse.to_dataset().variables), ("ball", coarse["ball"].variables)):
        for name, values in variables.items():
            if name == "energy_moved":  # ranges of energies, of which finer samples see more
                assert np.all(even[path].variables[name].values >= values.values)
                continue
            np.testing.assert_array_equal(even[path].variables[name].values, values.values, err_msg=name)
    assert run["energy_defect"].dims == ("time",)
    assert np.abs(run["energy_defect"].values).max() < 1e-5 * M * G * H
    assert results.regular(coarse) is coarse


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("two-booms", {"simulate.until": "4 s"}),  # energy-momentum
        ("solar-array", {}),  # generalized-alpha, latches
        ("hanging-chain", {}),  # dopri5
        ("heliogyro", {"solver.duration": "3 s", "spool.changes": [{"time": "2 s", "rate": 0}]}),  # rk4, threads
    ],
)
def test_states_at_regular_samples_do_not_depend_on_fine_ones(name, changes):
    key = "output.fine" if name == "heliogyro" else "simulate.fine"
    run, coarse = evolvent.run(name, changes), evolvent.run(name, changes | {key: False})
    even = results.regular(run)
    states = [one for one in coarse.children if "position" in coarse[one].data_vars]
    assert states
    for one in states:
        np.testing.assert_array_equal(even[one]["position"].values, coarse[one]["position"].values)
    np.testing.assert_array_equal(even["energy_defect"].values, coarse["energy_defect"].values)
    assert run.sizes["time"] <= 2 * coarse.sizes["time"]


@pytest.mark.slow
def test_the_whip_of_a_rib_is_among_its_samples():
    """The largest tip speed, sought at 2000 times about the end of winding, is that of the samples."""
    run = evolvent.run("wrapped-rib", {"rib.elements": 12})
    peak = run["tip_speed_peak"].values[0]
    series = run["rib-1"]["tip_speed"].values
    fine = fine_of(run)
    assert abs(series.max() / peak - 1.0) < 0.02
    assert series[~fine].max() < 0.9 * peak
    assert run.sizes["time"] <= 2 * (~fine).sum()


# ------------------------------------------------------------------------------------------------ who reads them


@pytest.mark.slow
def test_fine_samples_are_marked_in_files_and_left_out_of_spectra_studies_and_signals(tmp_path):
    from evolvent_base.signals import formats

    run = bouncing()
    even = results.regular(run)
    np.testing.assert_allclose(np.diff(even["time"].values), 0.1)
    run.ev.save(tmp_path / "run.nc")
    again = evolvent.open(tmp_path / "run.nc")
    np.testing.assert_array_equal(again[MARK].values, run[MARK].values)
    assert MARK in json.loads(again.attrs["variables"])
    even.ev.save(tmp_path / "even.nc")
    assert MARK not in evolvent.open(tmp_path / "even.nc")
    run.ev.spectrum("ball.position.z")
    kept = record.outcome(0, run, ["ball.position", "energy.max"])
    assert kept.variables["ball_position"].sizes["time"] == even.sizes["time"]
    content = formats._run(str(tmp_path / "run.nc"), ["ball.position.z"])
    times = next(one for one in content.columns if one.name == "time")
    np.testing.assert_array_equal(times.samples(), even["time"].values)


def test_a_plan_observes_what_its_run_has():
    case = cases.load("solar-array")
    plan = cases.system(case.system).plan(case)
    name = f"{next(iter(case.parts))}.position"
    found, run = plan.observe([name]), plan.run(None)
    assert MARK in run.data_vars
    np.testing.assert_array_equal(results.regular(found)["time"].values, results.regular(run)["time"].values)


def test_derived_quantities_get_all_times_that_they_ask_for(monkeypatch):
    """A boom on a hub: `derived` gets times between the samples, which are not kept without need."""
    system = cases.system("structure")
    changes = {"simulate.until": "1 s", "simulate.every": "0.25 s"}
    wanted = evolvent.run("boom-slew", changes | OFF)
    between = np.linspace(0.0, 1.0, 101)
    monkeypatch.setattr(type(system), "between", lambda self, case: between)

    def derived(self, case, solution):
        seen = np.array([solution.t.size])
        return {"seen": (("count",), seen, "1", "samples"), "at": (("time",), solution.t, "s", "time of each sample")}

    monkeypatch.setattr(type(system), "derived", derived)
    run = evolvent.run("boom-slew", changes | OFF)
    assert run["seen"].values == [101]
    np.testing.assert_array_equal(run["at"].values, run["time"].values)
    np.testing.assert_array_equal(run["time"].values, wanted["time"].values)
    assert run["hub"]["rate"].shape == wanted["hub"]["rate"].shape


@pytest.mark.slow
def test_no_fine_samples_in_signals_of_a_stand():
    assert MARK not in evolvent.run("inertia-stand", {"solver.method": "dopri5"}).data_vars
