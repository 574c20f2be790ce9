"""A body on springs: what was put into the simulation comes out, with intervals that hold it."""

from __future__ import annotations

import pathlib

import h5py
import numpy as np
import pytest
import scipy.io

import evolvent
import evolvent.results
from book import Book
from evolvent import InputError
from evolvent_massprops import load, mass_properties
from evolvent_massprops.inertia import Body, linear_model
from massprops import rig

EXAMPLE = rig.EXAMPLES / "stand.yaml"
CENTRED = Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 43920.0, 43920.0))


def within(found: object, truth: dict[str, float], *, times: float = 4.0) -> None:
    """Every value lies within so many standard uncertainties of the truth."""
    for k, output in enumerate(found.outputs):  # type: ignore[attr-defined]
        off = abs(found.values[k] - truth[output.key]) / found.std[k]  # type: ignore[attr-defined]
        assert off < times, output.key


@pytest.mark.slow
def test_inertia_with_the_centre_of_mass_known(tmp_path: pathlib.Path, book: Book) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock())
    found = mass_properties(path, EXAMPLE, rig.SET)
    assert [o.key for o in found.outputs] == ["Ixx", "Izz"]
    within(found, {"Ixx": 3703.0, "Izz": 43920.0}, times=1.0)
    assert np.all(found.std / found.values < 1.5e-3)
    e = found.evaluations[0]
    np.testing.assert_allclose(e.agreement, 1.0, atol=1e-4)
    assert 0.0 < e.consistency < 2.0
    assert found.has_uncertainties
    assert not found.warnings
    assert any("Iyy does not show" in why for _, why in e.cannot)
    assert e.candidates[0].mac > 0.99 > e.candidates[1].mac
    book(
        "Inertia stand and identification", "Moments from springs, noisy recording",
        reference="Ixx 3703, Izz 43920 kg m2", source="put into the simulation",
        error=np.abs((found.values - [3703.0, 43920.0]) / found.std).max(), allowed=1.0, unit="u",
    )  # fmt: skip


@pytest.mark.slow
def test_products_of_a_clean_swing_are_no_modes(tmp_path: pathlib.Path, book: Book) -> None:
    run = evolvent.run("inertia-stand")  # without noise, so that what is faint is found too
    evolvent.results.save(run, tmp_path / "swing.nc")
    found = mass_properties(tmp_path / "swing.nc", EXAMPLE)
    e = found.evaluations[0]
    assert e.modal.modes.order > 3
    np.testing.assert_allclose(e.modal.frequency[list(e.used)], [13.962, 16.422, 24.590], atol=1e-3)
    assert any("Fainter than 0.001" in why for why in e.why)
    np.testing.assert_allclose([found["Ixx"], found["Izz"]], [3703.0, 43920.0], rtol=2e-5)
    book(
        "Inertia stand and identification", "Moments from springs, clean recording",
        reference="Ixx 3703, Izz 43920 kg m2", source="put into the simulation",
        error=np.abs(np.array([found["Ixx"], found["Izz"]]) / [3703.0, 43920.0] - 1.0).max(), allowed=2e-5,
    )  # fmt: skip


@pytest.mark.slow
def test_everything_that_vertical_motion_tells(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock())
    asked = {f"body.{k}": "unknown" for k in ("mass", "offset_x", "offset_z", "Ixz")}
    found = mass_properties(path, EXAMPLE, asked)
    within(found, {"mass": 15190.0, "offset_x": 0.1, "offset_z": 0.05, "Ixx": 3703.0, "Izz": 43920.0, "Ixz": 0.0})
    assert found["mass"] == pytest.approx(15190.0, rel=1e-3)


@pytest.mark.slow
def test_the_stiffness_where_the_mass_is_known(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(stiffness=0.98 * rig.K))
    found = mass_properties(path, EXAMPLE, {**rig.THREE, "stand.common_factor": "unknown"})
    within(found, {"Ixx": 3703.0, "Izz": 43920.0, "common_factor": 0.98})
    assert found["common_factor"] == pytest.approx(0.98, rel=1e-3)


@pytest.mark.slow
def test_monte_carlo_agrees_with_the_linear_propagation(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock())
    linear = mass_properties(path, EXAMPLE, rig.THREE)
    drawn = mass_properties(
        path, EXAMPLE, {**rig.THREE, "uncertainty.method": "monte-carlo", "uncertainty.draws": 2000}
    )
    np.testing.assert_allclose(drawn.std, linear.std, rtol=0.06)
    np.testing.assert_allclose(drawn.interval, linear.interval, atol=0.2 * linear.std.max())


@pytest.mark.slow
def test_an_input_gives_what_a_new_evaluation_gives(tmp_path: pathlib.Path) -> None:
    """Signed shares of the budget against differences of whole evaluations."""
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(noise=1e-6))
    given = {
        **rig.THREE,
        "stand.points": [["2 +- 0.001", 0, 0.8696], [2, 0, -0.8696], [-2, 0, -0.8696], [-2, 0, 0.8696]],
        "signals.clock": "1 +- 1e-4",
        "stand.lateral_stiffness": "1000 +- 500 N/m",
        "stand.gravity": "9.80665 +- 0.01",
    }
    content = rig.description()
    del content["stand"]["half_length"], content["stand"]["half_width"]
    base = mass_properties(path, content, given)
    moved = {
        "stand.points.0.x": {"stand.points.0.0": "2.001 +- 0.001 m"},
        "signals.clock": {"signals.clock": 1.0001},
        "stand.stiffness 1": {"stand.stiffness": [f"{rig.K * 1.001} N/m", *[f"{rig.K} N/m"] * 3]},
        "body.offset_x": {"body.offset_x": "0.1005 m"},
        "body.mass": {"body.mass": "15193 kg"},
        "stand.natural_length 2": {"stand.natural_length": [0.5, 0.501, 0.5, 0.5]},
    }
    shares = {s.label: s.contribution for s in base.shares}
    for label, change in moved.items():
        other = mass_properties(path, content, {**given, **change})
        step = other.values - base.values
        tolerance = 0.02 * np.abs(shares[label]).max() + 1e-3
        np.testing.assert_allclose(shares[label], step, atol=tolerance, err_msg=label)


@pytest.mark.slow
def test_recordings_are_averaged_and_share_the_stand(tmp_path: pathlib.Path) -> None:
    paths = [rig.write_csv(tmp_path / f"{k}.csv", *rig.knock(seed=k)) for k in range(4)]
    one, four = mass_properties(paths[0], EXAMPLE, rig.THREE), mass_properties(paths, EXAMPLE, rig.THREE)
    within(four, {"Ixx": 3703.0, "Izz": 43920.0})
    assert np.all(four.std < 1.01 * one.std)
    assert np.all(four.std > 0.9 * one.std)  # geometry dominates, and is the same in all
    np.testing.assert_allclose(four.values, np.mean([e.values for e in four.evaluations], axis=0))


@pytest.mark.slow
def test_gaps_are_bridged_and_told(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    x[100:140, 2] = np.nan
    keep = np.ones(len(t), dtype=bool)
    keep[300:320] = False  # rows that are missing altogether
    path = rig.write_csv(tmp_path / "a.csv", t[keep], x[keep])
    found = mass_properties(path, EXAMPLE, rig.THREE)
    within(found, {"Ixx": 3703.0, "Izz": 43920.0}, times=1.0)
    assert "20 rows that are missing in the file are gaps" in found.warnings[0]
    assert "sensor 3 lacks 60 of 612 samples" in found.warnings[1]


@pytest.mark.slow
def test_range_units_and_sensitivity(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    volts = x * np.array([500.0, 500.0, 1000.0, -500.0])  # 0.5 V/mm, 1 V/mm, and one turned over
    path = rig.write_csv(tmp_path / "a.csv", t + 3.0, volts, unit=" [V]")
    content = rig.description()
    for k, sensitivity in enumerate(("0.5 V/mm", "0.5 V/mm +- 0.2 %", "1 V/mm", "-500 V/m")):
        content["signals"]["sensors"][k]["sensitivity"] = sensitivity
    found = mass_properties(path, content, {**rig.THREE, "signals.start": "4 s", "signals.end": "14 s"})
    within(found, {"Ixx": 3703.0, "Izz": 43920.0}, times=1.0)
    assert found.evaluations[0].modal.reading.unit == "mm"
    asked = {f"body.{k}": "unknown" for k in ("mass", "offset_x", "offset_z", "Ixz")} | {"identification.order": 3}
    shares = {s.label: s.contribution for s in mass_properties(path, content, {**asked, "signals.start": "4 s"}).shares}
    content["signals"]["sensors"][1]["sensitivity"] = "0.501 V/mm"  # 0.2 % more
    moved = mass_properties(path, content, {**asked, "signals.start": "4 s"})
    content["signals"]["sensors"][1]["sensitivity"] = "0.5 V/mm"
    step = moved.values - mass_properties(path, content, {**asked, "signals.start": "4 s"}).values
    share = shares["signals.sensors.1.sensitivity, relative"]
    np.testing.assert_allclose(share, step, rtol=0.03, atol=0.02 * found.std.min() * 0.01)
    assert found.evaluations[0].modal.shapes.max() == pytest.approx(5.0, rel=0.5)
    assert "samples from 4 s to 14 s" in found.warnings[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.wav", "a.mat", "a.h5", "a.tdms"])
def test_every_format_gives_the_same(tmp_path: pathlib.Path, name: str) -> None:
    """Columns by number, the rate from the file."""
    _, x = rig.knock()
    path = tmp_path / name
    match path.suffix:
        case ".wav":
            scipy.io.wavfile.write(path, int(rig.RATE), (50.0 * x).astype("float32"))
        case ".mat":
            scipy.io.savemat(path, {"x": 50.0 * x, "fs": rig.RATE})
        case ".h5":
            with h5py.File(path, "w") as file:
                file["x"], file["fs"] = 50.0 * x, rig.RATE
        case ".tdms":
            tdms = pytest.importorskip("nptdms")
            with tdms.TdmsWriter(str(path)) as writer:
                writer.write_segment(
                    [tdms.ChannelObject("g", f"c{k}", 50.0 * x[:, k], {"wf_increment": 0.02}) for k in range(4)]
                )
    content = rig.description()
    content["signals"] = {
        "unit": "V",
        "sensors": [{"column": k, "point": k, "sensitivity": "50 V/m"} for k in (1, 2, 3, 4)],
    }
    found = mass_properties(path, content, rig.THREE)
    within(found, {"Ixx": 3703.0, "Izz": 43920.0}, times=1.0)


@pytest.mark.slow
def test_a_run_of_the_package_is_read(tmp_path: pathlib.Path) -> None:
    """The nonlinear simulation of the built-in case, weighed with the example's description."""
    evolvent = pytest.importorskip("evolvent")
    run = evolvent.run("inertia-stand", {"sensors.noise": "0.1 mm"})
    from evolvent import results

    results.save(run, tmp_path / "run.nc")
    found = mass_properties(tmp_path / "run.nc", EXAMPLE)
    within(found, {"Ixx": 3703.0, "Izz": 43920.0}, times=2.0)


@pytest.mark.slow
def test_all_ten_numbers_from_six_modes(tmp_path: pathlib.Path) -> None:
    """Three sensors at each of four points, an oblique release: the whole tensor."""
    body = Body(
        mass=15190.0,
        centre=(0.1, -0.3, 0.05),
        inertia=[[3703.0, 50.0, 120.0], [50.0, 43920.0, -80.0], [120.0, -80.0, 43000.0]],
    )
    s = rig.stand(lateral_stiffness=2e5, damping=300.0, lateral_damping=300.0)
    modes = linear_model(s, body).modes()
    points, ways = np.repeat(s.points, 3, axis=0), np.tile(np.eye(3), (4, 1))
    t = np.arange(2000) / 50.0
    x = modes.motion(t, modes.release((4e3, -8e3, 6e3), (2.0, 0.2, 0.8696)), points, ways).T
    x += 2e-6 * np.random.default_rng(3).standard_normal(x.shape)
    path = rig.write_csv(tmp_path / "a.csv", t, x)
    content = rig.description()
    content["signals"]["sensors"] = [
        {"column": f"sensor {3 * k + i + 1}", "point": k + 1, "direction": "xyz"[i]} for k in range(4) for i in range(3)
    ]
    content["body"] = {"name": "body"} | dict.fromkeys(
        ("mass", "offset_x", "offset_z", "height", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), "unknown"
    )
    found = mass_properties(path, content, {"stand.lateral_stiffness": "2e5 N/m +- 0.1 %", "identification.order": 6})
    truth = {"mass": 15190.0, "offset_x": 0.1, "height": 0.3, "offset_z": 0.05}
    truth |= {"Ixx": 3703.0, "Iyy": 43920.0, "Izz": 43000.0, "Ixy": 50.0, "Ixz": 120.0, "Iyz": -80.0}
    within(found, truth)
    assert found["Iyy"] == pytest.approx(43920.0, rel=2e-3)


@pytest.mark.slow
def test_intervals_cover(tmp_path: pathlib.Path) -> None:
    """Coverage of the noise's part: 20 knocks, exact stand, k = 2."""
    content = rig.description()
    content["stand"] |= {"half_length": 2, "half_width": 0.8696, "stiffness": rig.K, "natural_length": 0.5}
    content["body"] |= {"mass": 15190, "offset_x": 0.1, "offset_z": 0.05, "height": 0, "Iyy": 43920, "Ixz": 0}
    held = 0
    for seed in range(20):
        t, x = rig.knock(seed=100 + seed, damping=0.0)
        path = rig.write_csv(tmp_path / "a.csv", t, 0.04 * x)  # so small that the amplitude shifts nothing
        found = mass_properties(path, content, {"identification.order": 3})
        held += int(np.sum(np.abs(found.values - [3703.0, 43920.0]) < found.expanded))
    assert 34 <= held <= 40  # 38.2 of 40 expected, 1.3 is their standard deviation


def test_descriptions_are_written_back_and_read_again() -> None:
    given = load(EXAMPLE)
    assert load(given) == given
    assert load(rig.EXAMPLES / "trifilar.yaml").recordings["5s_0.25.csv"] == {"tare.0.radius": "0.25 m"}


@pytest.mark.slow
def test_faster_modes_that_look_the_same_are_told(tmp_path: pathlib.Path) -> None:
    """At 6.25 Hz the roll at 24.6 rad/s is seen at 14.7 rad/s, and both are a body's."""
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(rate=6.25, samples=80, body=CENTRED))
    found = mass_properties(path, EXAMPLE)
    assert found["Ixx"] == pytest.approx(10389.0, rel=0.02)
    assert any("faster modes look the same and fit as well (24." in w and "Ixx = 370" in w for w in found.warnings)
    near = mass_properties(path, EXAMPLE, {"body.Ixx": "unknown near 10000"})
    assert not any("look the same" in w for w in near.warnings)
    assert dict(near.evaluations[0].assumed)["sampling"].startswith("no mode of the body lies above half the sampling")
    eccentric = rig.write_csv(tmp_path / "b.csv", *rig.knock(rate=6.25, samples=80))
    with pytest.raises(InputError, match=r"the modes fit better as faster ones .24.65.* Ixx = 370"):
        mass_properties(eccentric, EXAMPLE, rig.SET)


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"body.Ixz": "0 +- 1000 kg m^2"}, {"body.offset_x": "0 +- 60 mm"}])
def test_inputs_that_act_in_the_second_order_count(tmp_path: pathlib.Path, change: dict[str, str]) -> None:
    """A body in the middle of its springs: first derivatives by its offsets and Ixz are zero."""
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(body=CENTRED))
    three = {"identification.order": 3}
    base, wide = (mass_properties(path, EXAMPLE, three | more) for more in ({}, change))
    drawn = mass_properties(
        path, EXAMPLE, three | change | {"uncertainty.method": "monte-carlo", "uncertainty.draws": 1000}
    )
    assert wide.std[1] > 3.0 * base.std[1]
    np.testing.assert_allclose(wide.std[1], drawn.std[1], rtol=0.1)
    assert any(f"{next(iter(change))} with +-" in w and "monte-carlo" in w for w in wide.warnings)
    assert not any("in proportion" in w for w in base.warnings)


@pytest.mark.slow
def test_a_noise_stated_too_small_is_told(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock())
    stated = {f"signals.sensors.{k}.noise": "0.0002 mm" for k in range(4)}
    told = mass_properties(path, EXAMPLE, rig.SET | stated).warnings
    assert any("is stated as 2e-07 m, but the modes leave 0.000" in w and "it is stated too small" in w for w in told)
    assert not any("not white" in w for w in told)


@pytest.mark.slow
def test_contributions_that_are_rounding_are_zero(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock(body=CENTRED))
    sizes = np.abs([s.contribution for s in mass_properties(path, EXAMPLE, {"identification.order": 3}).shares])
    assert sizes[sizes > 0.0].min() > 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("support", ["hanging", "guided"])
def test_what_the_amplitude_shifts_is_known_and_told(tmp_path: pathlib.Path, support: str) -> None:
    """Ten centimetres on springs of half a metre: the true error of the nonlinear run."""
    run = evolvent.run("inertia-stand", {"excitation.force": [0.0, -1e5, 0.0], "stand.support": support})
    evolvent.results.save(run, tmp_path / "swing.nc")
    found = mass_properties(tmp_path / "swing.nc", EXAMPLE, {"stand.support": support})
    share = next(s.contribution for s in found.shares if s.label == "amplitude of the swing")
    np.testing.assert_allclose(share, found.values - [3703.0, 43920.0], rtol=0.1)
    told = [w for w in found.warnings if "the springs' ends move by 101 mm" in w]
    assert "shifts Ixx by about 3" in told[0]


def test_a_swing_as_long_as_the_springs_is_refused(tmp_path: pathlib.Path) -> None:
    t, x = rig.knock()
    path = rig.write_csv(tmp_path / "a.csv", t, 100.0 * x)
    with pytest.raises(InputError, match=r"sensor 1 moves by 0.99\d* m, but the springs are 0.5 m long; check units"):
        mass_properties(path, EXAMPLE, rig.SET)


@pytest.mark.slow
def test_a_hanging_stand_with_products_and_two_sways_in_one(tmp_path: pathlib.Path) -> None:
    """Six modes at twelve sensors: those of the swing's second order and the two equal sways are set aside.

    Their number is given: to find it takes six times as long, and other tests do.
    """
    ask = {"sensors.directions": "horizontal and vertical", "sensors.noise": "0.01 mm", "sensors.duration": "20 s"}
    ask |= {"excitation.force": [3000.0, -9800.0, 4000.0], "identification.order": 4}  # of the run's own, not used here
    run = evolvent.run("inertia-stand", ask)
    evolvent.results.save(run, tmp_path / "swing.nc")
    content = rig.description()
    content["signals"]["sensors"] = [
        {"column": f"sensor {3 * k + i + 1}", "point": k + 1, "direction": "xyz"[i]} for k in range(4) for i in range(3)
    ]
    found = mass_properties(tmp_path / "swing.nc", content, {"identification.order": 6})
    np.testing.assert_allclose([found["Ixx"], found["Izz"]], [3703.0, 43920.0], rtol=1e-3)
    e = found.evaluations[0]
    np.testing.assert_allclose(e.modal.frequency[list(e.used)], [5.414, 13.964, 16.421, 24.584], rtol=2e-3)
    assert any(
        "of stronger modes in a motion that is not quite linear: " in why and "is twice 4.2" in why for why in e.why
    )
    told = "the body's modes at 4.2214 and 4.2214 rad/s cannot be distinguished in 20 s and appear as one at 4.2"
    assert any(w.startswith(told) for w in found.warnings)


@pytest.mark.slow
def test_a_stated_damping_is_said_to_be_unused(tmp_path: pathlib.Path) -> None:
    path = rig.write_csv(tmp_path / "a.csv", *rig.knock())
    found = mass_properties(path, EXAMPLE, rig.SET | {"stand.damping": "200 N s/m"})
    assert "it is not used" in dict(found.evaluations[0].assumed)["damping of the springs"]
