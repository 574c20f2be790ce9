"""Calibration: known parameters are found again, with standard errors that hold; bad input is refused by name."""

from __future__ import annotations

import contextlib
import json
import pathlib
import sqlite3
from typing import Any

import numpy as np
import pytest
import yaml

import evolvent
from evolvent import cases
from evolvent.design import calibration
from evolvent.design.calibration import data
from evolvent_base import showing
from evolvent_base.errors import InputError
from evolvent_papers.wire_booms import closed_form, log
from evolvent_papers.wire_booms.structure import timeline

HEAD = "pair,start_utc,end_utc,stroke_before_m,stroke_after_m,clicks,rate_before_rpm,rate_after_rpm\n"
FIT = ["wire.tip_mass,wire.line_density,start_lengths.1,rates"]


def made_log(path: pathlib.Path, *, tip_mass: float, density: float, hidden: float, noise: float = 0.0) -> str:
    """A log of the built-in case with other wires, whose second group begins at a length that the log does not hold."""
    changes = {"wire.tip_mass": tip_mass, "wire.line_density": density, "start_lengths.1": hidden}
    case = cases.load("wire-booms", changes)
    line, rng = timeline(case), np.random.default_rng(3)
    before, after = (closed_form(case, t)["spin_rate"] / log.RPM for t in (line.before, line.after))
    before, after = before + noise * rng.standard_normal(before.size), after + noise * rng.standard_normal(after.size)
    rows, k = [], 0
    for group in case.groups:
        for pair, start, end, duration in group:
            minutes, seconds = divmod(int(duration), 60)
            times = f"2012-09-{10 + k:02d}T10:00:00,2012-09-{10 + k:02d}T10:{minutes:02d}:{seconds:02d}"
            rows.append(f"{pair},{times},{start},{end},0,{before[k]:.9f},{after[k]:.9f}\n")
            k += 1
    path.write_text(HEAD + "".join(rows), encoding="utf-8")
    return str(path)


@pytest.mark.slow
def test_the_parameters_of_a_made_log_are_found_again(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0)
    found = calibration.calibrate("wire-booms", source, fit=FIT, observe=["spin_rate"])
    assert [p.key for p in found.parameters][:3] == ["wire.tip_mass", "wire.line_density", "start_lengths.1"]
    np.testing.assert_allclose(found.values[:3], [0.12, 0.003, 11.0], rtol=1e-5)
    assert found.rms < 1e-6
    assert found.model == "closed form"
    assert found._repr_html_().count("<img") == 1


@pytest.mark.slow
def test_a_fit_stays_within_bounds(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0)
    key = "wire.tip_mass"
    asked: dict[str, Any] = {"fit": FIT, "observe": ["spin_rate"], "references": False}
    found = calibration.calibrate("wire-booms", source, bounds={key: ["80 g", "100 g"]}, **asked)
    assert 0.09 < found.values[0] <= 0.1
    wide = calibration.calibrate("wire-booms", source, bounds={key: (0.05, 0.2)}, **asked)
    assert wide.values[0] == pytest.approx(0.12, rel=1e-4)
    for bounds, sentence in (
        ({"wire.tip_mas": (0, 1)}, "names 'wire.tip_mas', which is not fitted; did you mean 'wire.tip_mass'?"),
        ({key: ["1 m", "2 m"]}, "must be two numbers in kg"),
        ({key: (0.1, 0.2)}, "they must hold the value 0.091 at which the fit starts"),
    ):
        with pytest.raises(InputError) as refused:
            calibration.calibrate("wire-booms", source, bounds=bounds, **asked)
        assert sentence in str(refused.value)


@pytest.mark.slow
def test_standard_errors_cover_the_noise(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0, noise=0.005)
    found = calibration.calibrate("wire-booms", source, fit=FIT, observe=["spin_rate"])
    off = np.abs(found.values[:3] - [0.12, 0.003, 11.0]) / found.errors[:3]
    assert off.max() < 3.0
    assert 0.003 < found.rms < 0.008
    assert found.references["eq. (18), roots on the axis"].rms > found.rms
    assert found.correlation[0, 1] < -0.5


@pytest.mark.slow
def test_a_stopped_calibration_goes_on(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0)
    options: Any = {"fit": FIT, "observe": ["spin_rate"], "folder": tmp_path / "kept", "references": False}
    counts = []

    def stop(count: int, rms: float) -> None:
        counts.append(rms)
        if len(counts) == 9:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calibration.calibrate("wire-booms", source, progress=stop, **options)
    again = calibration.calibrate("wire-booms", source, **options)
    whole = calibration.calibrate("wire-booms", source, **options | {"folder": None})
    assert again.reused >= 7
    np.testing.assert_array_equal(again.values, whole.values)
    third = calibration.calibrate("wire-booms", source, **options)
    assert third.evaluations == 0


def changed(kept: pathlib.Path, statement: str) -> None:
    """Change the file as another program can."""
    with contextlib.closing(sqlite3.connect(kept)) as file, file:
        file.execute(statement)


#: How a file of evaluations may be damaged, and how many of its records are then left out.
DAMAGES: dict[str, tuple[Any, int]] = {
    "empty": (lambda kept: kept.write_bytes(b""), 0),
    "words": (lambda kept: kept.write_bytes(b"all is well" * 1000), 1),
    "no database": (lambda kept: kept.write_bytes(b"[" * 100_000), 1),
    "another table": (lambda kept: changed(kept, "CREATE TABLE more (a)"), 1),
    "a view": (lambda kept: changed(kept, "CREATE VIEW more AS SELECT * FROM evaluations"), 1),
    "other values": (lambda kept: changed(kept, "UPDATE evaluations SET content = x'00' WHERE number < 4"), 3),
    "numbers": (lambda kept: changed(kept, "UPDATE evaluations SET content = 7, digest = 'x' WHERE number = 1"), 1),
    "key of another": (
        lambda kept: changed(kept, "UPDATE evaluations SET keys = (SELECT keys FROM evaluations WHERE number = 2) "
                                   "WHERE number = 1"), 1),
}  # fmt: skip


@pytest.mark.slow
def test_evaluations_that_were_altered_are_computed_again(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0)
    said: list[str] = []
    fit = ["wire.tip_mass,start_lengths.1"]
    options: Any = {"fit": fit, "observe": ["spin_rate"], "folder": tmp_path / "kept", "references": False}
    options["report"] = said.append
    whole = calibration.calibrate("wire-booms", source, **options)
    (kept,) = (tmp_path / "kept").iterdir()
    again = calibration.calibrate("wire-booms", source, **options)
    assert (again.evaluations, again.reused, said) == (0, whole.evaluations, [])
    for name, (damage, damaged) in DAMAGES.items():
        said.clear()
        damage(kept)
        again = calibration.calibrate("wire-booms", source, **options)
        np.testing.assert_array_equal(again.values, whole.values, err_msg=name)
        assert again.evaluations > 0, name
        assert again.evaluations + again.reused == whole.evaluations, name
        many = "1 record" if damaged == 1 else f"{damaged} records"
        verb = "is" if damaged == 1 else "are"
        assert said == ([f"{many} in {str(kept)!r} {verb} damaged or altered, and computed again"] if damaged else [])
        assert calibration.calibrate("wire-booms", source, **options).evaluations == 0, name  # written again
    kept.unlink()
    kept.mkdir()
    with pytest.raises(InputError, match=r"evaluations-.*it is a folder"):
        calibration.calibrate("wire-booms", source, **options)
    with pytest.raises(InputError, match=r"cannot write into .*log\.csv"):
        calibration.calibrate("wire-booms", source, **options | {"folder": source})


@pytest.mark.slow
def test_a_history_of_a_users_structure(tmp_path: pathlib.Path) -> None:
    """Mass and stiffness of an oscillator: the data hold their ratio, and refuse both."""
    case = {
        "system": "structure",
        "parts": {
            "load": {"kind": "point", "mass": "2 kg", "position": [1.1, 0, 0]},
            "spring": {"kind": "spring", "a": [0, 0, 0], "b": "load", "length": "1 m", "stiffness": "50 N/m"},
        },
        "simulate": {"until": "4 s", "every": "20 ms", "method": "dopri5", "tolerance": 1e-10},
    }
    t = np.linspace(0.1, 3.9, 60)
    w = np.sqrt(70.0 / 2.0)
    x = 1.0 + 0.1 * np.cos(w * t)
    path = tmp_path / "swing.csv"
    rows = "".join(f"{a:.6f},{1e3 * b:.9f}\n" for a, b in zip(t, x, strict=True))
    path.write_text(f"time (s),place (mm)\n{rows}", encoding="utf-8")
    observe = ["load.position.x=place"]
    found = calibration.calibrate(case, str(path), fit=["parts.spring.stiffness"], observe=observe)
    assert found.values[0] == pytest.approx(70.0, rel=1e-5)
    with pytest.raises(InputError, match=r"the data cannot separate parts.load.mass, parts.spring.stiffness"):
        calibration.calibrate(case, str(path), fit=["parts.load.mass,parts.spring.stiffness"], observe=observe)


@pytest.mark.slow
def test_moments_of_the_inertia_stand_from_one_sensor(tmp_path: pathlib.Path) -> None:
    """Entries of a list with units are fitted, to the reading of one of four sensors."""
    known = {"body.inertia": ["3600 kg m^2", "43920 kg m^2", "43000 kg m^2"], "sensors.duration": "3 s"}
    run = evolvent.run("inertia-stand", known)
    noise = 0.01 * np.random.default_rng(0).standard_normal(run.time.size)
    readings = 1e3 * run.sensor_true.sel(sensor=1).values + noise
    rows = "".join(f"{t:.6f},{x:.9f}\n" for t, x in zip(run.time.values, readings, strict=True))
    path = tmp_path / "swing.csv"
    path.write_text(f"time (s),reading (mm)\n{rows}", encoding="utf-8")
    # what is fitted needs no mode of the signals
    plain = {"sensors.duration": "3 s", "identification.way": "none", "identification.method": "prony"}
    case = cases.content_of("inertia-stand", plain)
    found = calibration.calibrate(
        case, str(path), fit=["body.inertia.0,body.inertia.2"], observe=["sensor_true[1]=reading"]
    )
    assert np.all(np.abs(found.values - [3600.0, 43000.0]) < 4.0 * found.errors)
    assert found.rms == pytest.approx(0.01, rel=0.2)
    assert "kg m^2" in str(found)
    with pytest.raises(InputError, match=r"'sensor_true\[7\]': sensor_true has no 7; it has 1, 2, 3, 4"):
        calibration.calibrate(case, str(path), fit=["body.inertia.0"], observe=["sensor_true[7]=reading"])


def test_a_table_of_runs(tmp_path: pathlib.Path) -> None:
    """One run a row, whose keys the row sets: the fall of a mass by a quarter of a second gives the gravity."""
    case = {
        "system": "structure",
        "gravity": [0, 0, "-5 m/s^2"],
        "parts": {"load": {"kind": "point", "mass": "2 kg", "velocity": [0, 0, 0]}},
        "simulate": {"until": "0.25 s", "every": "0.05 s", "method": "dopri5"},
    }
    rows = "".join(f"{v},{v * 0.25 - 0.5 * 9.81 * 0.0625}\n" for v in (0.0, 1.0, 2.0))
    path = tmp_path / "falls.csv"
    path.write_text(f"parts.load.velocity.2 (m/s),height (m)\n{rows}", encoding="utf-8")
    found = calibration.calibrate(case, str(path), fit=["gravity.2"], observe=["load.position.z=height"])
    assert found.values[0] == pytest.approx(-9.81, rel=1e-6)


def test_what_cannot_be_fitted_is_refused(tmp_path: pathlib.Path) -> None:
    source = made_log(tmp_path / "log.csv", tip_mass=0.12, density=0.003, hidden=11.0)
    for fit, observe, text in (
        ("wire.tip_mas", "spin_rate", "tip_mass"),
        ("title", "spin_rate", "only numbers are fitted"),
        ("wire.tip_mass,wire.tip_mass", "spin_rate", "twice"),
        ("wire.tip_mass", "lag", "holds spin_rate alone"),
        ("start_lengths.3", "spin_rate", "start_lengths has entries 0 to 2"),
        ("wire.stiffness", "spin_rate", "do not depend on wire.stiffness"),
        ("wire.tip_mass,wire.line_density,body.inertia,rates", "spin_rate", "cannot separate"),
    ):
        with pytest.raises(InputError, match=text):
            calibration.calibrate("wire-booms", source, fit=[fit], observe=[observe])
    broken = tmp_path / "broken.csv"
    broken.write_text(HEAD + "1-2,2012-09-13T10:00:00,2012-09-13T10:10:00,0,x,84,7.0,6.9\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"line 2 holds 'x' in column 'stroke_after_m', where a number must be"):
        data.read(str(broken), "wire-booms", ["spin_rate"])


@pytest.mark.slow
def test_the_report_of_the_flight_log(tmp_path: pathlib.Path) -> None:
    """The log of Van Allen Probe A: `docs/guide/calibrate.md` shows these numbers."""
    source = pathlib.Path(log.__file__).with_name("rbsp-a.csv")
    found = calibration.calibrate("wire-booms", str(source), fit=FIT, observe=["spin_rate"])
    assert found.rms <= 0.0080
    assert found.values[2] == pytest.approx(10.1, abs=0.2)
    assert found.references["eq. (18), roots on the axis"].rms >= 1.5 * found.rms
    showing.fill(found.answer(), tmp_path)
    written = json.loads((tmp_path / "calibration.json").read_text(encoding="utf-8"))
    assert written["parameters"][2]["key"] == "start_lengths.1"
    again = cases.load(str(tmp_path / "case.yaml"))
    assert again.start_lengths[1] == pytest.approx(found.values[2])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "says nothing of the lag" in page
    assert "<svg" in page or "data:image/svg" in page


def swing(path: pathlib.Path, noise: float) -> tuple[dict[str, Any], str]:
    """An oscillator as a case, and its motion with noise as a file."""
    system = evolvent.System()
    system.add(evolvent.parts.Point(mass=2.0, position=(1.2, 0.0, 0.0)), "mass")
    system.add(evolvent.parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=9.0, length=0.9), "spring")
    t = np.arange(0.0, 3.01, 0.05)
    x = 1.0 + 0.2 * np.cos(2.0 * t) + noise * np.random.default_rng(5).standard_normal(t.size)
    path.write_text("time (s),x (m)\n" + "".join(f"{a:.6f},{b:.9f}\n" for a, b in zip(t, x, strict=True)), "utf-8")
    settings: Any = {"until": "3 s", "every": "0.05 s", "method": "energy-momentum", "step": "0.005 s"}
    return cases.content_of(yaml.safe_load(system.to_yaml(**settings))), str(path)


@pytest.mark.slow
def test_the_derivatives_of_a_structure_are_those_of_its_discrete_solution(tmp_path: pathlib.Path) -> None:
    """x = L + (x0 - L) cos(w t), w^2 = k/m: covariance of k and L by hand, and by differences of runs."""
    noise = 1e-3
    case, source = swing(tmp_path / "swing.csv", noise)
    options: Any = {
        "fit": ["parts.spring.stiffness,parts.spring.length"],
        "observe": ["mass.position.x=x"],
        "deviations": [noise],
    }
    found = calibration.calibrate(case, source, **options)
    assert found.derivatives == "those of the discrete solution"
    assert found.evaluations < 10
    k, length = found.values
    np.testing.assert_allclose(found.values, [8.0, 1.0], rtol=0.01)
    times = found.series[0].times
    assert times is not None
    t, m, x0 = times(case), 2.0, 1.2
    w = np.sqrt(k / m)
    by = np.stack([-(x0 - length) * t * np.sin(w * t) * w / (2.0 * k), 1.0 - np.cos(w * t)], axis=1) / noise
    expected = np.sqrt(np.diag(np.linalg.inv(by.T @ by)))
    np.testing.assert_allclose(found.errors - found.integration, expected, rtol=2e-4)
    explicit = {**case, "simulate": {**case["simulate"], "method": "rk4"}}
    other = calibration.calibrate(explicit, source, **options)
    assert other.derivatives.startswith("central differences (sensitivities are of the steps of")
    np.testing.assert_allclose(other.errors - other.integration, found.errors - found.integration, rtol=1e-3)
    np.testing.assert_allclose(other.values, found.values, rtol=1e-3)
    assert other.evaluations > found.evaluations
