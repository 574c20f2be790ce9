"""Prony series fitted to simulated relaxation curves: the series is found again, within what is stated of it."""

from __future__ import annotations

import json
import pathlib
import re
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import yaml

from evolvent.commands.calibrate import calibrate
from evolvent.design.calibration import Relaxation, fit_relaxation
from evolvent.design.calibration.relaxation import curves, response, shifts
from evolvent.elements import viscoelastic
from evolvent.elements.materials import Material
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent_base.errors import InputError

Array = np.ndarray
ROOM, FORCE = 293.15, 2.5
SERIES = Viscoelastic(prony=[[0.15, 3.0], [0.25, 120.0], [0.2, 6000.0]])
TIMES = np.geomspace(0.5, 1e5, 80)
#: Curves of three hours at several temperatures, which hold relaxation times of months.
LONG, HOURS = [[0.1, 10.0], [0.15, 1e3], [0.2, 1e5], [0.15, 1e7]], np.geomspace(1.0, 1e4, 40)
WARM = np.array([293.15, 308.15, 323.15, 338.15, 353.15])
LAWS: dict[str, Any] = {
    "arrhenius": {"energy": 1.5e5, "reference": ROOM},
    "wlf": {"c1": 10.0, "c2": 120.0, "reference": ROOM},
    "table": {"rows": [[float(T), -0.065 * (float(T) - ROOM)] for T in WARM], "reference": ROOM},
}


def noise(seed: int, size: int) -> Array:
    return np.random.default_rng(seed).standard_normal(size)


def warm_curves(law: str) -> tuple[Viscoelastic, list[Array]]:
    """Simulated forces at `HOURS` and each temperature of `WARM`."""
    series = Viscoelastic(prony=LONG, shift={law: LAWS[law]})
    at = [Viscoelastic(prony=LONG, shift={law: LAWS[law]}, temperature=float(T)) for T in WARM]
    return series, [FORCE * one.modulus(HOURS) for one in at]


def numbers(found: Relaxation) -> list[Any]:
    return [*found.shares, *found.times, found.instantaneous, found.left]


def truth(series: Viscoelastic) -> list[float]:
    return [*(g for g, _ in series.prony), *(tau for _, tau in series.prony), FORCE, series.left]


def check_covered(found: list[Relaxation], wanted: list[float], of: Any = numbers) -> None:
    """The truth lies within the 95 % bounds as often as it should, and standard uncertainties are of its deviation."""
    all_of = [of(one) for one in found]
    inside = [one.low <= true <= one.high for values in all_of for one, true in zip(values, wanted, strict=True)]
    off = [(one.value - true) / one.error for values in all_of for one, true in zip(values, wanted, strict=True)]
    assert np.mean(inside) > 0.88
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.35


# ------------------------------------------------------------------------------------------------ one curve


def test_the_series_of_exact_data_is_found_again() -> None:
    found = fit_relaxation(TIMES, FORCE * SERIES.modulus(TIMES))
    assert found.terms == 3
    np.testing.assert_allclose([one.value for one in numbers(found)], truth(SERIES), rtol=1e-6)
    assert found.equilibrium.value == pytest.approx(FORCE * SERIES.left, rel=1e-6)
    assert found.share_left(50.0).value == pytest.approx(float(SERIES.modulus(np.array(50.0))), rel=1e-6)
    section = Viscoelastic(**yaml.safe_load(found.section)["viscoelastic"])
    np.testing.assert_allclose(section.prony, SERIES.prony, rtol=1e-6)
    assert found.viscoelastic.shift is None


def test_number_of_terms_and_uncertainties_hold_for_noise() -> None:
    exact = FORCE * SERIES.modulus(TIMES)
    found = [fit_relaxation(TIMES, exact + 0.008 * noise(seed, TIMES.size)) for seed in range(20)]
    right = [one for one in found if one.terms == 3]
    assert len(right) >= 18
    check_covered(right, truth(SERIES))


def test_more_noise_shows_fewer_terms_and_a_given_deviation_counts() -> None:
    weak = Viscoelastic(prony=[[0.3, 20.0], [0.02, 3000.0]])
    force = FORCE * weak.modulus(TIMES)
    assert fit_relaxation(TIMES, force + 0.002 * noise(1, TIMES.size)).terms == 2
    blurred = force + 0.08 * noise(1, TIMES.size)
    assert fit_relaxation(TIMES, blurred).terms == 1
    given = fit_relaxation(TIMES, blurred, deviation=0.08)
    assert given.factor == pytest.approx(1.96)
    assert given.instantaneous.error == pytest.approx(fit_relaxation(TIMES, blurred).instantaneous.error, rel=0.3)
    assert "standard deviation that is given" in " ".join(
        fit_relaxation(TIMES, blurred, deviation=0.3).answer().warnings
    )
    assert fit_relaxation(TIMES, force + 0.002 * noise(1, TIMES.size), terms=1).terms == 1


def test_what_the_data_do_not_show_is_said() -> None:
    slow = Viscoelastic(prony=[[0.1, 20.0], [0.6, 3e5]])
    said = " ".join(fit_relaxation(TIMES, FORCE * slow.modulus(TIMES) + 0.005 * noise(2, 80)).answer().warnings)
    assert re.search(r"the longest relaxation time, .* is not within the longest time measured, 27\.8 h", said)
    assert "10 years are 3.16e+03 times the longest time measured" in said
    fluid = FORCE * np.exp(-TIMES / 1e4)
    found = fit_relaxation(TIMES, fluid + 0.005 * noise(3, 80))
    assert "the force that stays is not distinguished from 0" in " ".join(found.answer().warnings)
    assert Viscoelastic(**yaml.safe_load(found.section)["viscoelastic"]).left > 0.0
    drift = np.convolve(noise(4, TIMES.size + 9), np.full(10, 0.1), "valid")
    said = " ".join(fit_relaxation(TIMES, FORCE * SERIES.modulus(TIMES) + 0.05 * drift, terms=3).answer().warnings)
    assert "residuals follow one another" in said
    fast = Viscoelastic(prony=[[0.3, 0.15], [0.2, 100.0]])
    at = np.concatenate([[0.0], TIMES])
    said = " ".join(fit_relaxation(at, FORCE * fast.modulus(at)).answer().warnings)
    assert "the shortest relaxation time, 0.15 s, is below the first time measured after the step, 0.5 s" in said


def test_a_long_record_is_fitted_as_exactly() -> None:
    times = np.linspace(0.0, 2000.0, 4001)
    series = Viscoelastic(prony=[[0.3, 5.0], [0.2, 300.0]])
    found = fit_relaxation(times, -FORCE * series.modulus(times))  # a torque of the other sense
    np.testing.assert_allclose([one.value for one in numbers(found)], truth(series), rtol=1e-6)


# ------------------------------------------------------------------------------------------------ ramps


def ramped(series: Viscoelastic, times: Array, begin: float, end: float) -> Array:
    """Force while and after the position is moved at a constant rate: the hereditary integral, by quadrature."""
    found = []
    for t in times:
        low, high = t - min(max(t, begin), end), t - begin
        whole = scipy.integrate.quad(lambda s: float(series.modulus(np.array(s))), low, high)[0] if high > 0.0 else 0.0
        found.append(FORCE * whole / (end - begin))
    return np.array(found)


@pytest.mark.parametrize("begin", [0.0, 4.0])
def test_a_loading_ramp_is_taken_into_account(begin: float) -> None:
    end = begin + 6.0
    series = Viscoelastic(prony=[[0.15, 5.0], [0.25, 120.0]])
    times = np.concatenate([np.arange(0.0, 30.0, 0.5), np.geomspace(30.0, 1500.0, 30)])
    force = ramped(series, times, begin, end)
    found = fit_relaxation(times, force)
    np.testing.assert_allclose([one.value for one in numbers(found)], truth(series), rtol=1e-6)
    assert f"from {begin:g} s to {end:g} s, the end of a loading ramp" in found.measured.notes[0]
    held = times >= end
    alone = fit_relaxation(times[held] - end, force[held], ramp="6 s")
    np.testing.assert_allclose([one.value for one in numbers(alone)], truth(series), rtol=1e-6)
    without = fit_relaxation(times, force, ramp=0.0)
    assert without.shares[0].value < 0.7 * 0.15  # most of the fast term relaxed during the ramp


def test_a_ramp_before_rows_begin_is_the_straight_line_to_zero() -> None:
    times = np.arange(0.5, 60.0, 0.25)
    series = Viscoelastic(prony=[[0.3, 30.0]])
    found = fit_relaxation(times, ramped(series, times, 0.0, 2.0))
    assert found.measured.curves[0].ramp == pytest.approx(2.0, abs=0.05)
    np.testing.assert_allclose([one.value for one in numbers(found)], truth(series), rtol=2e-3)


# ------------------------------------------------------------------------------------------------ temperatures


@pytest.mark.parametrize("law", LAWS)
def test_exact_curves_of_several_temperatures_give_series_and_shift(law: str) -> None:
    series, forces = warm_curves(law)
    found = fit_relaxation([HOURS] * WARM.size, forces, temperatures=WARM, shift=law)
    np.testing.assert_allclose([one.value for one in numbers(found)], truth(series), rtol=1e-6)
    assert series.shift is not None
    wanted = [series.shift.decades(float(T)) for T in WARM]
    assert found.free is not None
    for of in (found.solved, found.free):
        np.testing.assert_allclose([one.value for one in found.decades(of)], wanted, atol=1e-6)
    section = Viscoelastic(**yaml.safe_load(found.section)["viscoelastic"])
    for T in WARM:
        assert section.factor(float(T), "T") == pytest.approx(series.factor(float(T), "T"), rel=1e-5)
    assert found.viscoelastic.factor(float(WARM[2]), "T") == pytest.approx(
        section.factor(float(WARM[2]), "T"), rel=1e-5
    )


@pytest.mark.parametrize(("law", "wanted"), [("arrhenius", [1.5]), ("wlf", [10.0, 120.0])])
def test_uncertainties_of_shifts_hold_for_noise(law: str, wanted: list[float]) -> None:
    _, forces = warm_curves(law)
    found = [
        fit_relaxation(
            [HOURS] * WARM.size, [f + 0.01 * noise(10 * seed + k, f.size) for k, f in enumerate(forces)],
            temperatures=WARM, shift=law, reference="20 degC", terms=4,
        )
        for seed in range(8)
    ]  # fmt: skip
    check_covered(found, [*(g for g, _ in LONG), *wanted], lambda one: [*one.shares, *one.constants])
    assert not any("fits worse" in one for each in found for one in each.warnings)


def test_the_reference_may_lie_between_and_beyond_the_temperatures() -> None:
    series, forces = warm_curves("arrhenius")
    asked: dict[str, Any] = {"temperatures": WARM}
    for reference, law in ((300.0, "table"), (273.15, "arrhenius")):
        found = fit_relaxation([HOURS] * WARM.size, forces, shift=law, reference=reference, **asked)
        assert found.reference == reference
        for T in WARM[1:]:
            ours = found.viscoelastic.factor(float(T), "T") * found.times[-1].value
            assert ours == pytest.approx(series.factor(float(T), "T") * LONG[-1][1], rel=1e-5)


def test_rows_of_several_temperatures_and_curves_of_other_specimens() -> None:
    series, forces = warm_curves("arrhenius")
    rows = np.concatenate(forces)
    asked: dict[str, Any] = {"shift": "arrhenius", "reference": ROOM}
    flat = fit_relaxation(np.tile(HOURS, WARM.size), rows, temperatures=np.repeat(WARM, HOURS.size), **asked)
    np.testing.assert_allclose([one.value for one in numbers(flat)], truth(series), rtol=1e-6)
    factors = [1.0, 1.1, 0.95, 1.05, 0.9]
    others = [
        f * force + 0.005 * noise(k, force.size) for k, (f, force) in enumerate(zip(factors, forces, strict=True))
    ]
    own = fit_relaxation([HOURS] * WARM.size, others, temperatures=WARM, own_forces=True, **asked)
    check_covered([own], [*truth(series), 1.5], lambda one: [*numbers(one), *one.constants])
    assert [own.whole(k) / own.whole(0) for k in range(WARM.size)] == pytest.approx(factors, rel=0.01)
    common = fit_relaxation([HOURS] * WARM.size, others, temperatures=WARM, terms=4, **asked)
    assert "one instantaneous force of all curves fits worse than one of each (own forces)" in " ".join(common.warnings)


def test_a_law_that_does_not_fit_the_shifts_is_named() -> None:
    _, forces = warm_curves("wlf")
    noisy = [force + 0.005 * noise(k, force.size) for k, force in enumerate(forces)]
    found = fit_relaxation([HOURS] * WARM.size, noisy, temperatures=WARM, shift="arrhenius")
    assert "the law of Arrhenius fits worse than shifts without a law" in " ".join(found.warnings)


# ------------------------------------------------------------------------------------------------ the model


def test_derivatives_of_the_response_are_those_of_differences() -> None:
    some = [
        curves.Curve(
            times=np.geomspace(0.5, 100.0, 7), forces=np.ones(7), temperature=T, ramp=ramp, label="", noise=0.0
        )
        for T, ramp in ((290.0, 0.0), (310.0, 2.0), (330.0, 0.5))
    ]
    T = np.array([290.0, 310.0, 330.0])
    laws = [(shifts.Free, [-0.4, -1.1]), (shifts.Arrhenius, [0.8]), (shifts.WLF, [9.0, 80.0])]
    for law, x in laws:
        model = response.Response(
            response.rows_of(some, [0, 1, 2], 1.0), law(temperatures=T, reference=297.0), 2, len(some) - 1
        )
        at = np.array([0.4, 0.3, 0.2, 0.5, 3.0, *x, 0.1, -0.2])
        steps = 1e-6 * np.eye(at.size)
        wanted = np.column_stack([(model.at(at + step)[0] - model.at(at - step)[0]) / 2e-6 for step in steps])
        np.testing.assert_allclose(model.at(at)[1], wanted, rtol=1e-6, atol=1e-9)


# ------------------------------------------------------------------------------------------------ refusals

GOOD = FORCE * SERIES.modulus(TIMES)


@pytest.mark.parametrize(
    ("times", "forces", "asked", "sentence"),
    [
        (TIMES - 1.0, GOOD, {}, "the curve begins at -0.5 s; times count from the moment at which the"),
        (TIMES[:3], GOOD[:3], {}, "the curve has 3 values; a relaxation curve needs 4 or more"),
        (TIMES[:6], GOOD[:6], {"terms": 3}, "6 values from the hold on, but 3 terms and what stays are 7 parameters"),
        (TIMES, GOOD[:-1], {}, "the curve has 80 times and 79 forces"),
        (TIMES, GOOD * np.nan, {}, "holds a time or a force that is not finite"),
        (TIMES, ["a"] * 80, {}, "holds a time or a force that is no number"),
        (1.0, GOOD, {}, "times and forces must be arrays of one curve"),
        (TIMES, 1e200 * GOOD, {}, "e+200 in size; it must be between 1e-30 and 1e+30"),
        (np.ones(80), GOOD, {}, "the curve has one time, 1 s; force over time is needed"),
        (TIMES, np.where(TIMES == TIMES[40], 10.0, GOOD), {}, "the force rises by"),
        (TIMES, 1.0 + 0.5 * np.log(1.0 + TIMES) / 12.0, {}, "a force that relaxes falls all the time"),
        (TIMES, GOOD - 0.6 * FORCE, {}, "the force changes its sign at"),
        (TIMES, 1.0 + 0.01 * noise(1, 80), {}, "the force does not fall by more than it scatters"),
        (TIMES, np.ones(80), {}, "the force does not fall by more than it scatters"),
        (TIMES, GOOD, {"terms": 0}, "terms is 0; it must be from 1 to 15"),
        (TIMES, GOOD, {"deviation": 0.0}, "the standard deviation is 0; it must be above 0"),
        (TIMES, GOOD + 0.01 * noise(1, 80), {"terms": 15}, "the data do not determine 15 terms"),
        (TIMES, GOOD, {"shift": "wlf"}, "shift is 'wlf', but the data have one temperature"),
        (TIMES, GOOD, {"shift": "wfl"}, "shift is 'wfl'; did you mean 'wlf'?"),
        (TIMES, GOOD, {"temperatures": "20 degC", "reference": 350.0}, "reference is 76.85 degC, but the data have"),
        (TIMES, GOOD, {"temperatures": -5.0}, "temperatures is -5.0, -5 K; it must be an absolute temperature"),
        (TIMES, GOOD, {"ramp": "1 m"}, "ramp is '1 m'; it must be a duration, such as '2 s'"),
        (TIMES, GOOD, {"ramp": 1e6}, "ramp is 1e+06 s; it must be 0 s or longer, and shorter than the curve"),
    ],
)  # fmt: skip
def test_bad_curves_are_refused(times: Array, forces: Array, asked: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        fit_relaxation(times, forces, **asked)


@pytest.mark.parametrize(
    ("warm", "asked", "sentence"),
    [
        ([GOOD, FORCE * SERIES.modulus(TIMES / 30.0)], {}, "at 40 degC relaxes no faster than that at 20 degC"),
        ([GOOD, FORCE * SERIES.modulus(30.0 * TIMES)], {"shift": "wlf"}, "which has 2 constants, but the data have"),
        ([GOOD, 0.3 * GOOD], {}, "the curves at 20 degC and 40 degC do not overlap: the force ends at"),
        ([GOOD, np.full(80, 0.4 * FORCE)], {}, "curve 2: the force does not fall by more than it scatters"),
        ([GOOD, FORCE * SERIES.modulus(30.0 * TIMES)], {"reference": 400.0}, "between the temperatures of the data"),
        ([GOOD], {}, "temperatures holds 2 values; give one for each curve, or one"),
    ],
)  # fmt: skip
def test_temperatures_that_do_not_fit_are_refused(warm: list[Array], asked: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        fit_relaxation([TIMES] * len(warm), warm, temperatures=["20 degC", "40 degC"], **asked)


# ------------------------------------------------------------------------------------------------ the command


def written(folder: pathlib.Path) -> tuple[str, list[str]]:
    """A file of simulated torques with a column of temperatures, and one of each temperature."""
    _, forces = warm_curves("arrhenius")
    head, rows, names = "time (min),oven (degC),torque (N mm)", [], []
    for k, (T, force) in enumerate(zip(WARM, forces, strict=True)):
        torque = force + 0.01 * noise(k, force.size)
        oven = T - 273.15 + 0.1 * noise(50 + k, force.size)
        own = [f"{t / 60.0:.9g},{warm:.2f},{M:.6f}" for t, warm, M in zip(HOURS, oven, torque, strict=True)]
        rows += own
        names.append(str(folder / f"at-{k}.csv"))
        pathlib.Path(names[-1]).write_text("\n".join([head, *own]), encoding="utf-8")
    path = folder / "hinge.csv"
    path.write_text("\n".join([head, *rows]), encoding="utf-8")
    return str(path), names


def ran(*words: str) -> None:
    calibrate.main([*words, "--quiet"], standalone_mode=False)


def test_the_command_writes_the_section_of_a_case(tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, names = written(tmp_path)
    out = tmp_path / "found"
    ran(path, "--relaxation", "torque", "--temperature", "oven", "--shift", "arrhenius", "-o", str(out))
    printed = capsys.readouterr().out
    section = (out / "viscoelastic.yaml").read_text(encoding="utf-8")
    assert section in printed
    material = Material(young_modulus="3 GPa", density="1600 kg/m^3", **yaml.safe_load(section))
    read = material.viscoelastic
    assert read is not None
    assert isinstance(read.shift, viscoelastic.Arrhenius)
    assert read.shift.energy == pytest.approx(1.5e5, rel=0.01)
    assert [g for g, _ in read.prony] == pytest.approx([g for g, _ in LONG], abs=0.01)
    for text in ("instantaneous force", "N mm", "reference: 20 degC"):
        assert text in printed
    kept = json.loads((out / "relaxation.json").read_text(encoding="utf-8"))
    assert [one["temperature"] - 273.15 for one in kept["shift"]["temperatures"]] == pytest.approx([20, 35, 50, 65, 80])
    assert kept["terms"][0]["share"]["low"] < 0.1 < kept["terms"][0]["share"]["high"]
    assert {one.name for one in out.iterdir()} >= {"report.html", "relaxation.png"}
    warm = [word for T in WARM for word in ("--temperature", f"{T - 273.15:g} degC")]
    ran(*names, "--relaxation", "torque (N mm)", *warm, "--shift", "arrhenius", "-o", str(tmp_path / "other"))
    other = yaml.safe_load((tmp_path / "other" / "viscoelastic.yaml").read_text(encoding="utf-8"))["viscoelastic"]
    np.testing.assert_allclose(np.array(Viscoelastic(**other).prony), np.array(read.prony), rtol=1e-6)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["hinge.csv", "--relaxation", "torqe"], "has no column 'torqe'; did you mean 'torque'?"),
        (["hinge.csv", "--relaxation", "torque"], "name the column with --temperature oven"),
        (["hinge.csv", "--relaxation", "torque", "--temperature", "of"], "has no column 'of'"),
        (["hinge.csv", "--relaxation", "torque", "--temperature", "torque"], "'N mm' is a unit of something else"),
        (
            ["at-0.csv", "--relaxation", "torque", "--shift", "wlf"],
            "--shift is 'wlf', but the data have one temperature",
        ),
        (
            ["at-0.csv", "at-1.csv", "--relaxation", "torque", "--temperature", "20 degC"],
            "--temperature is given 1 time for 2 files",
        ),
        (["at-0.csv", "--relaxation", "torque", "--terms", "two"], "--terms is 'two'; it must be a whole number"),
        (["at-0.csv", "--relaxation", "torque", "--std", "1,2"], "--std has 2 values; one column is fitted, give one"),
        (["at-0.csv", "--relaxation", "torque", "--fit", "x"], "--fit is of the parameters of a case"),
        (["x", "at-0.csv", "--fit", "x", "--observe", "y", "--ramp", "2 s"], "--ramp is of a relaxation curve"),
    ],
)
def test_the_command_refuses_what_it_cannot_use(
    words: list[str], sentence: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=re.escape(sentence)):
        ran(*words, "-o", "found")
