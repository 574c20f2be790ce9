"""TDMS as LabVIEW and others write it: starts, units, rates of channels, channels of times and of words."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops.measurement import vibration

tdms = pytest.importorskip("nptdms")
RATE, SIZE = 20.0, 400
TIME = np.arange(SIZE) / RATE
DECAY = 5.0 * np.exp(-0.16 * TIME) * np.cos(2.0 * np.pi * 1.3 * TIME)
STEP = {"wf_increment": 1.0 / RATE}


def noisy(seed: int = 1, data: np.ndarray = DECAY) -> np.ndarray:
    return data + 0.01 * np.random.default_rng(seed).standard_normal(data.size)


def written(path: pathlib.Path, *channels: tuple[str, Any, dict[str, Any]]) -> pathlib.Path:
    """A file of channels, each "group/name", samples and properties."""
    with tdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([tdms.ChannelObject(*name.split("/"), data, own) for name, data, own in channels])
    return path


def frequencies(path: pathlib.Path, *columns: str, **keys: Any) -> Any:
    return vibration(path, columns, keys).frequency / (2.0 * np.pi)


def test_the_waveform_has_a_start(tmp_path: pathlib.Path) -> None:
    data = noisy(data=np.append(np.zeros(40), DECAY))
    for start, own in (
        (-2.0, {"wf_start_offset": -2.0}),
        (-2.0, {"wf_start_offset": -2000.0, "wf_increment": 50.0, "wf_xunit_string": "ms"}),
    ):
        found = vibration(written(tmp_path / "a.tdms", ("g/a", data, STEP | own)), (), {"signals.start": "0 s"})
        assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
        assert found.reading.source.columns[0].start == pytest.approx(start)


def test_channels_that_start_at_other_times(tmp_path: pathlib.Path) -> None:
    """Each has its own clock time: they are no samples of one time."""
    first = np.datetime64("2024-01-01T00:00:00.0", "us")
    path = written(
        tmp_path / "a.tdms",
        ("g/a", noisy(1), STEP | {"wf_start_time": first}),
        ("g/b", noisy(2), STEP | {"wf_start_time": first + np.timedelta64(500, "ms")}),
    )
    with pytest.raises(InputError, match=r"a at 20 Hz with 400 samples; b at 20 Hz from 0.5 s with 400 samples"):
        vibration(path)
    assert frequencies(path, "b") == pytest.approx([1.3], rel=1e-3)


def test_channels_of_several_rates(tmp_path: pathlib.Path) -> None:
    path = written(
        tmp_path / "a.tdms",
        ("g/a", noisy(1), STEP),
        ("g/b", noisy(2), STEP),
        ("slow/temperature", np.linspace(20.0, 21.0, 80), {"wf_increment": 0.25}),
        ("slow/remark", ["a"] * 80, {}),
        ("g/infinite", np.full(SIZE, np.inf), STEP),
    )
    with pytest.raises(InputError, match="sample 1 of 'infinite' is infinite"):
        vibration(path)
    with pytest.raises(
        InputError, match=r"name columns of different times: a at 20 Hz .*; temperature at 4 Hz with 80"
    ):
        vibration(path, ["a", "temperature"])
    assert frequencies(path, "a", "b") == pytest.approx([1.3], rel=1e-3)
    with pytest.raises(InputError, match=r"column is 'remark', which is no signal in .*: its channel holds no numbers"):
        vibration(path, ["remark"])


@pytest.mark.parametrize("name", ["Time", "Time Stamp", "time_ms", "Zeit", "t"])
def test_a_channel_of_times(name: str, tmp_path: pathlib.Path) -> None:
    """Also beside channels of another group with its own times."""
    factor = 1e3 if name == "time_ms" else 1.0
    path = written(
        tmp_path / "a.tdms",
        (f"g/{name}", factor * TIME - 2.0, {}),
        ("g/a", noisy(), {"NI_UnitDescription": "g"}),
        (f"h/{name}", 2.0 * factor * TIME, {}),
        ("h/b", noisy(2), {}),
    )
    assert frequencies(path, "a") == pytest.approx([1.3], rel=1e-3)
    assert frequencies(path, "b") == pytest.approx([0.65], rel=1e-3)
    assert signals.read(path).units[1] == "g"
    assert vibration(path, ["a"]).reading.start == pytest.approx(-2.0 / factor)
    with pytest.raises(InputError, match="columns of different times: a at the times of"):
        vibration(path)


def test_a_channel_of_dates(tmp_path: pathlib.Path) -> None:
    stamps = np.datetime64("2024-01-01T23:59:55", "us") + (1e6 * TIME).astype("timedelta64[us]")
    path = written(tmp_path / "a.tdms", ("g/clock", stamps, {}), ("g/a", noisy(), {}))
    found = vibration(path, (), {"signals.time": "clock"})
    assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert frequencies(path) == pytest.approx([1.3], rel=1e-3)


def test_names(tmp_path: pathlib.Path) -> None:
    """Of the group where two are alike, of the input where LabVIEW gave none."""
    path = written(
        tmp_path / "a.tdms",
        ("g/a", noisy(1), STEP),
        ("h/a", noisy(2), STEP),
        ("h/Untitled", noisy(3), STEP | {"NI_ChannelName": "Mod1/ai0"}),
        ("h/b", noisy(4), STEP),
    )
    assert signals.read(path).names == ("g/a", "h/a", "Mod1/ai0", "b")
    assert frequencies(path, "h/b") == pytest.approx([1.3], rel=1e-3)


def test_steps_that_others_state(tmp_path: pathlib.Path) -> None:
    """The property of another writer, or the other channels of a group."""
    path = written(tmp_path / "a.tdms", ("g/a (mm)", noisy(1), {"Sampling Rate": RATE}), ("g/b (mm)", noisy(2), {}))
    found = vibration(path)
    assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert found.reading.unit == "mm"
    assert found.reading.notes == ("'b (mm)' states no step: that of 'a (mm)' was taken",)


def test_what_is_no_function_of_time_and_what_counts(tmp_path: pathlib.Path) -> None:
    path = written(
        tmp_path / "a.tdms",
        ("g/spectrum", noisy(2), {"wf_increment": 0.5, "wf_xunit_string": "Hz"}),
        ("g/sample", np.arange(SIZE), STEP),
        ("g/dead", np.full(SIZE, 3.0), STEP),
        ("g/a", noisy(), STEP),
    )
    assert vibration(path).reading.notes == (
        "'spectrum' is left out: it is a function in steps of Hz, not of time",
        "'sample' is left out: it counts samples",
        "'dead' is left out: all its samples are 3",
    )


def test_channels_that_end_a_sample_earlier(tmp_path: pathlib.Path) -> None:
    """As those of a recorder that was stopped: what all of them have is used."""
    path = written(tmp_path / "a.tdms", ("g/a", noisy(1), STEP), ("g/b", noisy(2)[:-1], STEP))
    found = vibration(path)
    assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert found.reading.data.shape == (SIZE - 1, 2)
    assert found.reading.notes == (f"'a' and others go on behind the {SIZE - 1} samples that all columns have",)


def test_scaled_samples(tmp_path: pathlib.Path) -> None:
    first = "NI_Scale[0]_"
    own = STEP | {"NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled", f"{first}Scale_Type": "Linear"}
    own |= {f"{first}Linear_Slope": 0.5, f"{first}Linear_Y_Intercept": 1.0}
    own |= {f"{first}Linear_Input_Source": tdms.types.Uint32(0xFFFFFFFF)}
    raw = np.arange(SIZE, dtype="i2") % 7
    found = signals.read(written(tmp_path / "a.tdms", ("g/a", raw, own)))
    np.testing.assert_allclose(found.column("a"), 1.0 + 0.5 * raw)
