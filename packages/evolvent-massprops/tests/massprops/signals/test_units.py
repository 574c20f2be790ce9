"""Units of a recording's columns: the file's own in any spelling, the description's above it, the default below it."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops import recordings
from evolvent_massprops.description import Signals

G0 = 9.80665
TIME = 0.01 * np.arange(200)


def reading(folder: pathlib.Path, head: str, given: dict[str, Any], columns: int = 1) -> recordings.Reading:
    """One ramp, or several, in a file with a head."""
    path = folder / "a.csv"
    rows = [",".join([f"{t:.2f}", *[f"{t + c:.4f}" for c in range(columns)]]) for t in TIME]
    path.write_text(head + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return recordings.read(signals.read(str(path)), Signals.model_validate(given))


@pytest.mark.parametrize(
    ("head", "given", "unit", "size", "note"),
    [
        ("time (s),acc (g)", {}, "m/s^2", G0, ""),
        ("time (s),acc (mg)", {}, "m/s^2", G0 / 1000, ""),
        ("time (s),acc [m/s²]", {}, "m/s^2", 1.0, ""),
        ("time (s),acc (m/s2)", {}, "m/s^2", 1.0, ""),
        ("time (s),rate (dps)", {}, "rad/s", np.pi / 180.0, ""),
        ("time (s),torque (in-lbf)", {}, "N m", 0.112984829, ""),
        ("time (s),u (Volts)", {}, "V", 1.0, ""),
        ("time (s),u (mVolts)", {"sensors": [{"column": "u", "sensitivity": "100 mV/g"}]}, "m/s^2", G0 / 100, ""),
        ("time (s),u (V)", {"sensors": [{"column": "u", "sensitivity": "10.2 mV/(m/s2)"}]}, "m/s^2", 1 / 0.0102, ""),
        ("time (s),u", {"unit": "Newtons"}, "N", 1.0, ""),
        ("time (s),u (-)", {"unit": "mm"}, "m", 0.001, ""),
        ("time (s),u (N)", {"unit": "mm"}, "N", 1.0, ""),
        ("time (s),u (kN)", {"sensors": [{"column": "u", "unit": "N"}]}, "N", 1.0, "not in kN as the file states"),
        ("time (s),u (left)", {"sensors": [{"column": "u", "unit": "mm"}]}, "m", 0.001, "not in left as the file"),
        ("time (s),u (lb)", {"sensors": [{"column": "u", "unit": "lbf"}]}, "N", 4.4482216, "not in lb as the file"),
        ("time (s),u (Newton)", {"sensors": [{"column": "u", "unit": "N"}]}, "N", 1.0, ""),
    ],
)
def test_what_a_column_is_in(
    head: str, given: dict[str, Any], unit: str, size: float, note: str, tmp_path: pathlib.Path
) -> None:
    from evolvent_base import units

    found = reading(tmp_path, head, given)
    assert found.data[:, 0] * units.factor(found.unit, unit) == pytest.approx(size * TIME, rel=1e-6)
    assert any(note in one for one in found.notes) if note else not any("as the file states" in n for n in found.notes)


def test_the_noise_in_another_spelling(tmp_path: pathlib.Path) -> None:
    found = reading(tmp_path, "time (s),acc (g)", {"sensors": [{"column": "acc", "noise": "2 mg"}]})
    assert found.noise is not None
    assert found.noise[0] == pytest.approx(0.002)


@pytest.mark.parametrize(
    ("head", "given", "sentence"),
    [
        ("time (s),u (lb)", {}, "unit of the column 'u': 'lb' may be lbf or lb; .*signals.sensors.0.unit overrules"),
        ("time (s),u (left)", {}, "'left' is not a known unit; .*signals.sensors.0.unit overrules the file"),
        ("time (s),u", {}, "neither the file nor the description states the unit of 'u'"),
        ("time (s),u (-)", {}, "neither the file nor the description states the unit of 'u'"),
        ("time (s),u", {"unit": "fathm"}, "signals.unit: 'fathm' is not a known unit; known: "),
        (
            "time (s),u (mm)",
            {"sensors": [{"column": "u", "noise": "2 V"}]},
            "noise is '2 V'; it must be a value such",
        ),
    ],
)
def test_what_is_refused(head: str, given: dict[str, Any], sentence: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=sentence):
        reading(tmp_path, head, given)


def test_columns_of_two_kinds_are_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="gyr is in deg/s, acc in g_0; they must be of one kind"):
        reading(tmp_path, "time (s),acc (g),gyr (dps)", {}, 2)
    found = reading(tmp_path, "time (s),acc (g),second (m/s2)", {}, 2)
    assert found.data[:, 1] == pytest.approx((TIME + 1.0) / G0, rel=1e-6)
