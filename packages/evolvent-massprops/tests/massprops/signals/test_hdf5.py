"""HDF5 as programs lay it out: groups, attributes, scales of axes, tables of records, frames of pandas."""

from __future__ import annotations

import pathlib
from collections.abc import Callable

import h5py
import numpy as np
import pytest

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops.measurement import vibration

RATE, SIZE = 20.0, 400
TIME = np.arange(SIZE) / RATE
DECAY = 5.0 * np.exp(-0.16 * TIME) * np.cos(2.0 * np.pi * 1.3 * TIME)
X = DECAY[:, None] + 0.01 * np.random.default_rng(1).standard_normal((SIZE, 3))
WORD = h5py.string_dtype()


def attributes(file: h5py.File) -> None:
    file["rig/left"] = X[:, 0]
    file["rig/left"].attrs.update({"units": "mm", "fs": "20 Hz"})
    file["rig/slow"] = np.arange(50.0) ** 2
    file["rig/slow"].attrs["fs"] = 2.5


def step_in_ms(file: h5py.File) -> None:
    file["left"] = X[:, 0]
    file["dt"] = 50.0
    file["dt"].attrs["units"] = "ms"


def start_of_waveform(file: h5py.File) -> None:
    file["left"] = X[:, 0]
    file["left"].attrs.update({"wf_increment": 1.0 / RATE, "wf_start_offset": -1.0})


def rate_with_blank(file: h5py.File) -> None:
    file["left (mm)"] = X[:, 0]
    file.attrs["Sampling Frequency [Hz]"] = np.array([20], dtype="i4")


def another_group(file: h5py.File) -> None:
    file["data/left"] = X[:, 0]
    file["axes/time"] = TIME - 1.0
    file["axes/other/time"] = 3.0 * np.arange(50)


def scale(file: h5py.File) -> None:
    """As xarray writes it: (channel, time)."""
    file["left"] = X.T
    file["clock"], file["channel"] = 1e3 * (TIME - 1.0), np.array(["a", "b", "c"], dtype=WORD)
    file["clock"].attrs["units"] = "milliseconds since 2024-01-01"
    for axis, name in enumerate(("channel", "clock")):
        file[name].make_scale(name)
        file["left"].dims[axis].attach_scale(file[name])


def records(file: h5py.File) -> None:
    table = np.zeros(SIZE, dtype=[("time", "f8"), ("left", "f4"), ("n", "i4")])
    table["time"], table["left"], table["n"] = TIME - 1.0, X[:, 0], np.arange(SIZE)
    file["log/table"] = table


def frame(file: h5py.File) -> None:
    """As pandas writes a frame in the fixed form."""
    file["df/axis0"] = file["df/block0_items"] = np.array([b"left", b"right", b"top"])
    file["df/axis1"], file["df/block0_values"] = np.arange(SIZE), X
    file.attrs["sample_rate"] = RATE


#: Writer -> names of the signals, the unit, and the start in s; names are given where another column has other times.
WAYS: dict[Callable[[h5py.File], None], tuple[tuple[str, ...], str, float]] = {
    attributes: (("rig/left",), "mm", 0.0),
    step_in_ms: (("left",), "", 0.0),
    start_of_waveform: (("left",), "", -1.0),
    rate_with_blank: (("left (mm)",), "mm", 0.0),
    another_group: (("data/left",), "", -1.0),
    scale: (("a", "b", "c"), "", -1.0),
    records: (("log/table/left",), "", -1.0),
    frame: (("left", "right", "top"), "", 0.0),
}


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_a_decay_in_every_layout(way: Callable[[h5py.File], None], tmp_path: pathlib.Path) -> None:
    names, unit, start = WAYS[way]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        way(file)
    found = vibration(tmp_path / "a.h5", names if way is attributes else ())
    assert found.reading.names == names
    assert found.reading.source.units[found.reading.source.index(names[0])] == unit
    assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert found.reading.start == pytest.approx(start, abs=1e-9)
    short = names[0].rpartition("/")[2]
    assert signals.read(tmp_path / "a.h5").index(short) == found.reading.source.index(names[0])


def test_rates_of_data_sets_are_listed(tmp_path: pathlib.Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        attributes(file)
    with pytest.raises(
        InputError, match=r"rig/left at 20 Hz with 400 samples; rig/slow at 2\.5 Hz with 50 samples; name"
    ):
        vibration(tmp_path / "a.h5")


def test_what_nobody_asks_for(tmp_path: pathlib.Path) -> None:
    """Infinite samples, words, other lengths and complex numbers beside the column that is wanted."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["left"], file["infinite"], file["long"] = X[:, 0], np.full(SIZE, np.inf), np.arange(3.0 * SIZE) ** 2
        file["words"], file["complex"] = ["a", "b"], X[:, 0] * 1j
        file.attrs["fs"] = RATE
    assert vibration(tmp_path / "a.h5", ["left"]).frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    with pytest.raises(InputError, match="sample 1 of 'infinite' is infinite"):
        vibration(tmp_path / "a.h5", ["infinite"])
    with pytest.raises(InputError, match=r"'complex', which is no signal in .*: it holds no real numbers"):
        vibration(tmp_path / "a.h5", ["complex"])
