"""Logs for `evolvent calibrate` as people have them: each dialect holds the same times and values, or is refused."""

from __future__ import annotations

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from evolvent.design import calibration
from evolvent.design.calibration import data, observed
from evolvent.results.measurements import Series
from evolvent_base.errors import InputError

CASE = {
    "system": "structure",
    "parts": {
        "panel": {"kind": "rigid-body", "motion": "spin", "inertia": "2 kg m^2"},
        "spring": {
            "kind": "joint-spring", "a": "ground", "b": "panel", "start": "0.1 rad", "stiffness": "6 N m/rad",
            "damping": "0.2 N m s/rad",
        },
    },
    "simulate": {"until": "10 s", "every": "0.1 s"},
}  # fmt: skip
N = 101
TIME = np.linspace(0.0, 10.0, N)


def angle(time: np.ndarray) -> np.ndarray:
    """The panel with 8 N m/rad and 0.2 N m s/rad from 0.1 rad at rest."""
    a = 0.05
    w = np.sqrt(4.0 - a * a)
    return np.asarray(0.1 * np.exp(-a * time) * (np.cos(w * time) + a / w * np.sin(w * time)))


ANGLE = angle(TIME)
VARIABLE = "spring.angle"


def comma(value: float, digits: int = 6) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


def text(head: str, row: Callable[[int], str], rows: Any = range(N)) -> str:
    return head + "\n" + "\n".join(map(row, rows)) + "\n"


T, X, D = TIME, ANGLE, np.degrees(ANGLE)
#: Text, column, and what a note must say; all are the same times in s and angles.
DIALECTS: dict[str, tuple[str, str, str]] = {
    "plain": (text("time (s),angle (rad)", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angle", ""),
    "German": (text("\ufeffZeit (s);Winkel (°)", lambda i: f"{comma(T[i], 2)};{comma(D[i])}"), "Winkel", ""),
    "ISO 80000": (text("t / s\tphi / °", lambda i: f"{comma(T[i], 2)}\t{comma(D[i])}"), "phi", ""),
    "radians": (text("time (sec),angle (radians)", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angle (radians)", ""),
    "milliseconds": (text("time_ms;angle [deg]", lambda i: f"{1e3 * T[i]:.0f};{D[i]:.6f}"), "angle (deg)", ""),
    "minutes": (text("time (min),angle (mrad)", lambda i: f"{T[i] / 60:.8f},{1e3 * X[i]:.5f}"), "angle", ""),
    "no unit": (text("time,angle", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angle", "time states no unit: taken in s"),
    "epoch": (text("time (s),angle (rad)", lambda i: f"{1.7e9 + T[i]:.2f},{X[i]:.6f}"), "angle", "from the first row"),
    "epoch ms": (
        text("timestamp,angle (rad)", lambda i: f"{1.7e12 + 1e3 * T[i]:.0f},{X[i]:.6f}"), "angle", "counts ms",
    ),
    "stamps": (
        text("date time,angle (rad)", lambda i: f"2026-11-28T23:59:{50 + T[i]:05.2f},{X[i]:.6f}", range(N - 1)),
        "angle", "from the first row",
    ),
    "shuffled": (
        text("time (s),angle (rad)", lambda i: f"{T[37 * i % N]:.2f},{X[37 * i % N]:.6f}"), "angle", "order of time",
    ),
    "twice": (
        text("time (s),angle (rad)", lambda i: f"{T[i // 2]:.2f},{X[i // 2]:.6f}", range(2 * N)), "angle",
        "stand twice",
    ),
    "gaps": (
        text("time (s),angle (rad)", lambda i: f"{T[i]:.2f},{f'{X[i]:.6f}' if i % 7 else ('', 'NaN', '-')[i % 3]}"),
        "angle", "15 of 101 rows have no value",
    ),
    "trailing": (text("time (s);angle (rad)", lambda i: f"{T[i]:.2f};{X[i]:.6f};"), "angle", ""),
    "others": (
        text("no,time (s),state,angle (rad),u (foo)", lambda i: f"{i},{T[i]:.2f},{'no' * (i % 2)},{X[i]:.6f},x"),
        "angle", "",
    ),
    "two angles": (
        text("time (s),angle (deg),angle (rad)", lambda i: f"{T[i]:.2f},{7 * D[i]:.6f},{X[i]:.6f}"), "angle (rad)", "",
    ),
    "wrapped": (
        text("time (s),angle (deg)", lambda i: f"{T[i]:.2f},{(D[i] + 360.0) % 360.0:.6f}"), "angle", "jumps by a turn",
    ),
}  # fmt: skip


def read(tmp_path: pathlib.Path, content: str, column: str) -> Any:
    path = tmp_path / "log.csv"
    path.write_text(content, encoding="utf-8")
    return data.read(str(path), CASE, [f"{VARIABLE}={column}"])


@pytest.mark.parametrize("name", DIALECTS)
def test_dialects_hold_the_same(tmp_path: pathlib.Path, name: str) -> None:
    content, column, note = DIALECTS[name]
    found = read(tmp_path, content, column)
    (one,) = found.series
    times = one.times(CASE)
    assert len(times) == {"gaps": 86, "stamps": 100}.get(name, N)
    np.testing.assert_allclose(np.diff(times) > 0.0, True)
    values = one.values * (observed.units.factor(one.unit, "rad") if one.unit else 1.0)
    np.testing.assert_allclose(values, angle(times), atol=2e-6)
    assert any(note in sentence for sentence in found.notes) if note else not found.notes


REFUSED = {
    "restart": (
        text("time (s),angle (rad)", lambda i: f"{T[i % 50]:.2f},{X[i]:.6f}"), "angle",
        r"the time of '.*log.csv' begins again in line 52: it holds 3 runs; give the rows of one",
    ),
    "mark": (
        text("time (s),angle (rad)", lambda i: f"{T[i]:.2f},{-9999 if i == 50 else X[i]:.6f}"), "angle",
        r"line 52 of '.*' holds -9999 in column 'angle', far from all others; leave the cell empty",
    ),
    "coarse": (
        text("time (s),angle (rad)", lambda i: f"{T[i]:.0f},{X[i]:.6f}"), "angle",
        r"the times of '.*' are too coarse: \d+ of 101 rows have that of the row before and another value",
    ),
    "two angles": (
        text("time (s),angle (deg),angle (rad)", lambda i: f"{T[i]:.2f},{D[i]:.6f},{X[i]:.6f}"), "angle",
        r"has 2 columns 'angle': 'angle \(deg\)' and 'angle \(rad\)'; write --observe NAME=COLUMN",
    ),
    "no column": (
        text("time (s),angle (rad)", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angel",
        "has no column 'angel'; did you mean 'angle'.*; or write --observe NAME=COLUMN",
    ),
    "no time": (
        text("place (m),angle (rad)", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angle",
        "has neither a column 'time' nor columns named by keys of the case; .* its columns are 'place', 'angle'",
    ),
    "word": (
        text("time (s),angle (rad)", lambda i: f"{T[i]:.2f},{'off' if i == 3 else f'{X[i]:.6f}'}"), "angle",
        "line 5 holds 'off' in column 'angle', where a number must be",
    ),
    "unit of time": (
        text("time (V),angle (rad)", lambda i: f"{T[i]:.2f},{X[i]:.6f}"), "angle", "neither a column 'time'",
    ),
    "groups": (
        text("time (s);angle (deg)", lambda i: f"{i};{'1.031' if i % 2 else '998'}"), "angle",
        r"whether '\.' is the decimal sign or groups thousands",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_may_mean_something_else_is_refused(tmp_path: pathlib.Path, name: str) -> None:
    content, column, sentence = REFUSED[name]
    with pytest.raises(InputError, match=sentence):
        read(tmp_path, content, column)


def test_recordings_that_are_no_texts(tmp_path: pathlib.Path) -> None:
    """A MAT file with times, and with a rate, beside a vector of another length."""
    path = tmp_path / "log.mat"
    savemat(path, {"t": TIME, "angle": ANGLE, "other": np.arange(7.0)})
    (one,) = data.read(str(path), CASE, [f"{VARIABLE}=angle"]).series
    np.testing.assert_allclose(one.times(CASE), TIME, atol=1e-12)
    savemat(path, {"fs": 10.0, "angle": ANGLE})
    (one,) = data.read(str(path), CASE, [f"{VARIABLE}=angle"]).series
    np.testing.assert_allclose(one.times(CASE), TIME, atol=1e-12)
    np.testing.assert_array_equal(one.values, ANGLE)


def test_a_table_of_runs_in_units_of_its_file(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "runs.csv"
    path.write_text(
        "no.;date;parts.panel.inertia (lb-in2);parts.spring.stiffness (Nm/rad);spring.angle.max (°)\n"
        "1;2026-11-01;1000,5;6,5;5,7\n2;2026-11-02;2000,5;6,25;5,5\n"
    )
    found = data.read(str(path), CASE, ["spring.angle.max"])
    assert found.rows[0] == {"parts.panel.inertia": "1000.5 lb in^2", "parts.spring.stiffness": "6.5 N m/rad"}
    np.testing.assert_array_equal(found.series[0].values, [5.7, 5.5])
    assert any("'no.' is no key of the case" in note for note in found.notes)
    path.write_text("parts.spring.stifness (N m),spring.angle.max (deg),parts.panel.inertia\n1,2,3\n1,2,3\n")
    with pytest.raises(InputError, match=r"parts\.spring\.stifness.*did you mean"):
        data.read(str(path), CASE, ["spring.angle.max"])
    path.write_text("parts.panel.inertia (mm);spring.angle.max\n1;2\n2;3\n")
    with pytest.raises(InputError, match=r"the column 'parts\.panel\.inertia \(mm\)' of .*: 'mm' is a unit of"):
        data.read(str(path), CASE, ["spring.angle.max"])


@pytest.mark.parametrize(
    ("unit", "file", "factor"),
    [("rad", "°", 180.0 / np.pi), ("m s-2", "g", 1.0 / 9.80665), ("kg", "g", 1e3), ("N m", "in-lb", 8.8507458),
     ("rad s-1", "RPM", 30.0 / np.pi), ("1", "%", 100.0), ("m", "", 1.0)],
)  # fmt: skip
def test_values_of_a_run_in_the_unit_of_the_data(unit: str, file: str, factor: float) -> None:
    one = Series(name="x", unit=file, values=np.zeros(1), labels=("",))
    assert observed.factor(unit, one) == pytest.approx(factor, rel=1e-7)


@pytest.mark.parametrize(("unit", "file"), [("rad", "mm"), ("rad s-1", "Hz"), ("rad", "counts"), ("K", "°C")])
def test_units_of_another_kind_are_refused(unit: str, file: str) -> None:
    with pytest.raises(InputError, match=f"the data of 'x' are in {file}, the variable in {unit}; '{file}' "):
        observed.factor(unit, Series(name="x", unit=file, values=np.zeros(1), labels=("",)))


def test_data_beside_the_model_are_told() -> None:
    scatter = 0.01 * np.sin(np.arange(50.0))
    one = Series(name="x", unit="deg", values=3.0 + scatter, labels=("",) * 50)
    (sentence,) = observed.offsets([one], [np.zeros(50)])
    assert sentence.startswith("The data of x lie 3 deg above the fitted model on average")
    assert observed.offsets([one], [np.full(50, 3.0)]) == []


@pytest.mark.slow
def test_a_fit_to_a_log_with_rounded_minutes_and_to_one_in_ms(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text("Zeit (min);Winkel (°)", lambda i: f"{comma(T[i] / 60, 6)};{comma(D[i])}"), encoding="cp1252")
    asked: Any = {"fit": ["parts.spring.stiffness"], "observe": [f"{VARIABLE}=Winkel"]}
    found = calibration.calibrate(CASE, str(path), **asked)
    assert found.values[0] == pytest.approx(8.0, rel=1e-4)
    path.write_text(text("Zeit;Winkel (°)", lambda i: f"{1000 * T[i]:.0f};{comma(D[i])}"), encoding="cp1252")
    with pytest.raises(InputError, match=r"from 0 s to 10000 s, .*; if their time is in ms, its head must say so"):
        calibration.calibrate(CASE, str(path), **asked)
