"""Which columns of a file are signals, and at which times: rates and times that are stated, guessed, or contradict."""

from __future__ import annotations

import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import scipy.io

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops.measurement import vibration
from evolvent_massprops.modal import Modal

RATE, SIZE = 20.0, 400
TIME = np.arange(SIZE) / RATE
RANDOM = np.random.default_rng(1)
DECAY = 5.0 * np.exp(-0.16 * TIME) * np.cos(2.0 * np.pi * 1.3 * TIME) + 0.01 * RANDOM.standard_normal(SIZE)
WARM = 20.0 + np.cumsum(RANDOM.random(SIZE))
RATED = {"signals.rate": "20 Hz"}
NO_UNIT = "the time states no unit: taken in s"


def written(path: pathlib.Path, columns: Mapping[str, Any]) -> pathlib.Path:
    """A CSV file of columns of numbers or words."""
    cells = [[one if isinstance(one, str) else f"{one:.9g}" for one in column] for column in columns.values()]
    path.write_text("\n".join([",".join(columns), *map(",".join, zip(*cells, strict=True))]) + "\n")
    return path


def hertz(found: Modal) -> Any:
    return found.frequency / (2.0 * np.pi)


#: Columns, keys -> start, and the notes on times; all decay at 1.3 Hz in the column x.
WAYS: dict[str, tuple[dict[str, Any], dict[str, str], float, tuple[str, ...]]] = {
    "s": ({"time (s)": TIME - 2.0, "x": DECAY}, {}, -2.0, ()),
    "ms": ({"time (ms)": 1e3 * (TIME - 2.0), "x": DECAY}, {}, -2.0, ()),
    "no unit": ({"time": TIME - 2.0, "x": DECAY}, {}, -2.0, (NO_UNIT,)),
    "ms, by the rate": ({"time": 1e3 * (TIME - 2.0), "x": DECAY}, {"signals.rate": "20 Hz"}, -2.0,
                        ("the column 'time' states no unit; by signals.rate it is in ms",)),
    "us, by the rate": ({"t": 1e6 * TIME, "x": DECAY}, {"signals.rate": "20 Hz"}, 0.0,
                        ("the column 't' states no unit; by signals.rate it is in us",)),
    "min, by the rate": ({"t": TIME / 60.0, "x": DECAY}, {"signals.rate": "20 Hz"}, 0.0,
                         ("the column 't' states no unit; by signals.rate it is in min",)),
    "rate and s": ({"time": TIME - 2.0, "x": DECAY}, {"signals.rate": "20 Hz"}, -2.0, ()),
    "rate alone": ({"x": DECAY}, {"signals.rate": "20 Hz"}, 0.0, ()),
    "another name": ({"clock cycle (ms)": 1e3 * TIME, "x": DECAY}, {"signals.time": "clock cycle"}, 0.0, ()),
    "T is no time": ({"time (s)": TIME, "T": WARM, "x": DECAY}, {}, 0.0, ()),
    "T is no time beside a rate": ({"T": WARM, "x": DECAY}, {"signals.rate": "20 Hz"}, 0.0, ()),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_times(way: str, tmp_path: pathlib.Path) -> None:
    columns, keys, start, notes = WAYS[way]
    found = vibration(written(tmp_path / "a.csv", columns), ["x"], keys)
    assert hertz(found) == pytest.approx([1.3], rel=2e-3)
    assert found.reading.start == pytest.approx(start, abs=1e-9)
    assert found.reading.notes == notes


@pytest.mark.parametrize(
    ("columns", "keys", "said"),
    [
        ({"time (ms)": TIME, "x": DECAY}, RATED, "is 20 Hz, but by the column 'time' .* has 20000 Hz"),
        ({"time": 1.1 * TIME, "x": DECAY}, RATED, "is 20 Hz, but by the column 'time' .* has 18.1818 Hz"),
        ({"t": 1.1 * TIME, "x": DECAY}, RATED, "is 20 Hz, but by the column 't' .* has 18.1818 Hz"),
        ({"x": DECAY, "y": DECAY}, {}, "states neither times nor a rate; give signals.rate, such as 50 Hz, or signals"),
        ({"time (mm)": TIME, "x": DECAY}, {"signals.time": "time"}, "has the unit 'mm'"),
    ],
)  # fmt: skip
def test_times_that_are_refused(
    columns: dict[str, Any], keys: dict[str, str], said: str, tmp_path: pathlib.Path
) -> None:
    with pytest.raises(InputError, match=said):
        vibration(written(tmp_path / "a.csv", columns), ["x"], keys)


def test_columns_that_are_no_signals(tmp_path: pathlib.Path) -> None:
    """Counters, further times and constants are left out, unless they are named."""
    columns = {
        "sample": np.arange(SIZE), "time (s)": TIME, "x": DECAY, "cycle": np.arange(SIZE) // 100,
        "dead": 0.0 * TIME + 3.0,
        "tick": np.arange(SIZE) % 256, "elapsed time (ms)": 1e3 * TIME + 7.0, "state": ["ok"] * SIZE,
    }  # fmt: skip
    path = written(tmp_path / "a.csv", columns)
    found = vibration(path)
    assert found.reading.names == ("x",)
    assert hertz(found) == pytest.approx([1.3], rel=1e-3)
    text = "; ".join(found.reading.notes)
    whys = {"sample": "it counts", "cycle": "it counts", "tick": "it counts", "dead": "all its samples are 3"}
    for name, why in (whys | {"elapsed time": "it is another time", "state": "no cell"}).items():
        assert f"'{name}' is left out: {why}" in text
    assert vibration(path, ["x", "tick"]).reading.names == ("x", "tick")


def test_only_the_columns_that_are_wanted_are_judged(tmp_path: pathlib.Path) -> None:
    some = ["ok" if k % 3 else "1.5" for k in range(SIZE)]
    path = written(tmp_path / "a.csv", {"time (s)": TIME, "x": DECAY, "far": np.full(SIZE, np.inf), "some": some})
    assert hertz(vibration(path, ["x"])) == pytest.approx([1.3], rel=1e-3)
    with pytest.raises(InputError, match=r"the column 'some' of .* is no signal"):
        vibration(path, ["some"])
    with pytest.raises(InputError, match=r"'some'|'far'"):
        vibration(path)


def test_columns_are_counted_as_the_file_has_them(tmp_path: pathlib.Path) -> None:
    found = signals.read(written(tmp_path / "a.csv", {"time (s)": TIME, "state": ["ok"] * SIZE, "x": DECAY}))
    assert found.names[found.index(3)] == "x"
    with pytest.raises(InputError, match=r"column is 'state', which is no signal in .*: no cell holds a number"):
        found.index(2)
    with pytest.raises(InputError, match=r"column is 4, but .* has 3 columns, counted from 1: time, state, x"):
        found.index(4)


def test_times_of_several_columns_go_to_those_behind_them(tmp_path: pathlib.Path) -> None:
    """Or to those with their number."""
    fine = 0.5 * TIME
    for columns in (
        {"Run 1: Time (s)": TIME, "Run 1: x": DECAY, "Run 2: Time (s)": fine, "Run 2: x": DECAY},
        {"t1": TIME, "t2": fine, "x1": DECAY, "x2": DECAY},
        {"Zeit": TIME, "x": DECAY, "Zeit ": fine, "y": DECAY},
    ):
        path = written(tmp_path / "a.csv", columns)
        first, second = [name for name in columns if "x" in name or "y" in name]
        assert hertz(vibration(path, [first])) == pytest.approx([1.3], rel=1e-3)
        assert hertz(vibration(path, [second])) == pytest.approx([2.6], rel=1e-3)
        with pytest.raises(InputError, match="columns of different times"):
            vibration(path)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t,
X_Columns\tNo
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t400\t400\t
Y_Unit_Label\tNewtons\tm/s^2\t
X_Dimension\tTime\tTime\t
X0\t-2,0000000000000000E+0\t-2,0000000000000000E+0\t
Delta_X\t5,000000E-2\t5,000000E-2\t
***End_of_Header***\t\t\t
X_Value\tExcitation (Trigger)\tResponse (Trigger)\tComment
"""


def test_names_units_and_start_of_labview(tmp_path: pathlib.Path) -> None:
    rows = [f"\t{y:.6f}\t{x:.6f}".replace(".", ",") for x, y in zip(DECAY, WARM, strict=True)]
    (tmp_path / "a.lvm").write_text(LVM + "\n".join(rows) + "\n")
    found = vibration(tmp_path / "a.lvm", ["Response (Trigger)"], {"signals.start": "-1 s"})
    assert hertz(found) == pytest.approx([1.3], rel=1e-3)
    assert found.reading.start == pytest.approx(-1.0)
    assert found.reading.source.names == ("Excitation (Trigger)", "Response (Trigger)")
    assert found.reading.unit == "m/s^2"


def test_the_notes_are_in_what_is_measured(tmp_path: pathlib.Path, call: Any) -> None:
    """On the terminal, in a certificate and in Python."""
    from evolvent_massprops.measurement import mass_properties

    path = written(tmp_path / "a.csv", {"time": TIME, "x": DECAY})
    stand = {"stand": {"kind": "torsion", "stiffness": "0.35 N m/rad"}, "body": {}, "signals": {"unit": "mm"}}
    found = mass_properties(path, stand)
    assert NO_UNIT in found.notes
    found.report(tmp_path / "c.html")
    assert NO_UNIT[1:] in (tmp_path / "c.html").read_text(encoding="utf-8")  # with a capital letter
    code, out, _ = call("identify", str(path))
    assert code == 0
    assert NO_UNIT in " ".join(out.split())


@pytest.mark.parametrize("line", ["# Ts = 0.05 s", "dt (ms),50", "# fs: 0.02 kHz", "Sample rate,20,Hz"])
@pytest.mark.parametrize(("name", "beside"), [("T", 20.0 + 0.2 * TIME), ("time", 1000.0 * TIME)])
def test_a_rate_above_the_head_comes_before_a_guessed_time(
    tmp_path: pathlib.Path, line: str, name: str, beside: Any
) -> None:
    path = written(tmp_path / "a.csv", {name: beside, "x": DECAY})
    path.write_text(f"{line}\n{path.read_text()}")
    assert hertz(vibration(path, ["x"])) == pytest.approx([1.3], rel=1e-3)


def test_samples_of_full_scale(tmp_path: pathlib.Path) -> None:
    scipy.io.wavfile.write(tmp_path / "a.wav", int(RATE), (0.1 * DECAY).astype("f4"))
    found = vibration(tmp_path / "a.wav", (), {"signals.start": "1 s"})
    assert found.reading.start == pytest.approx(1.0)
    assert "the samples of a WAV file are parts of full scale" in found.reading.notes
    assert signals.read(tmp_path / "a.wav").units == ("",)


def test_a_unit_that_is_none_of_a_time_is_named(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time (parsec),a (mm)\n" + "\n".join(f"{k / 20:.2f},{np.cos(0.4 * k):.4f}" for k in range(100)))
    with pytest.raises(InputError, match=r"'time' has the unit 'parsec'; a time is in s, ms, us or min"):
        vibration(path)
