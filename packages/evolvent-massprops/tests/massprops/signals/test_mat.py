"""MAT files as MATLAB, Simulink and others write them: structs, cells, names, rates and times near the arrays."""

from __future__ import annotations

import io
import pathlib
import struct
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from evolvent import InputError
from evolvent_base import mat_file, signals
from evolvent_massprops.measurement import vibration

RATE, SIZE = 20.0, 400
TIME = np.arange(SIZE) / RATE
DECAY = 5.0 * np.exp(-0.16 * TIME) * np.cos(2.0 * np.pi * 1.3 * TIME)
X = DECAY[:, None] + 0.01 * np.random.default_rng(1).standard_normal((SIZE, 3))
CELL = np.array(["left", "right", "top"], dtype=object)


def saved(path: pathlib.Path, content: dict[str, Any], **how: Any) -> pathlib.Path:
    scipy.io.savemat(path, content, **how)
    return path


def turned(leaf: Any, file: h5py.File, place: str, references: h5py.Group) -> None:
    """Write a value as MATLAB does in its version 7.3."""
    if isinstance(leaf, dict):
        group = file.create_group(place)
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, value in leaf.items():
            turned(value, file, f"{place}/{key}", references)
    elif isinstance(leaf, str):
        file[place] = np.array([[ord(letter)] for letter in leaf], dtype="u2")
        file[place].attrs["MATLAB_class"] = np.bytes_("char")
    elif isinstance(leaf, np.ndarray) and leaf.dtype == object:
        names = []
        for value in leaf.ravel():
            names.append(f"#refs#/{len(references)}")
            turned(value, file, names[-1], references)
        file[place] = np.array([[file[name].ref] for name in names], dtype=h5py.ref_dtype).T
        file[place].attrs["MATLAB_class"] = np.bytes_("cell")
    else:
        file[place] = np.atleast_2d(leaf).T.astype(float)
        file[place].attrs["MATLAB_class"] = np.bytes_("double")


def saved_73(path: pathlib.Path, content: dict[str, Any]) -> pathlib.Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        references = file.create_group("#refs#")
        for key, value in content.items():
            turned(value, file, key, references)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


#: Content -> names, units, frequency in Hz and start in s.
WAYS: dict[str, tuple[dict[str, Any], tuple[str, ...], str, float, float]] = {
    "row and Fs": ({"x": X[:, :1].T, "Fs": RATE}, ("x",), "", 1.3, 0.0),
    "dt": ({"x": X, "dt": 1.0 / RATE}, ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "dt_ms": ({"x": X, "dt_ms": 1e3 / RATE}, ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "fs_khz": ({"x": X, "fs_kHz": 1e-3 * RATE}, ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "a column of times": ({"t": TIME - 2.0, "x": X}, ("x 1", "x 2", "x 3"), "", 1.3, -2.0),
    "times in ms": ({"time_ms": 1e3 * TIME, "x": X}, ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "rows": ({"t": TIME - 2.0, "x": X.T}, ("x 1", "x 2", "x 3"), "", 1.3, -2.0),
    "both agree": ({"t": TIME - 2.0, "x": X, "fs": RATE}, ("x 1", "x 2", "x 3"), "", 1.3, -2.0),
    "times in ms by the rate": ({"t": 1e3 * (TIME - 2.0), "x": X, "fs": RATE}, ("x 1", "x 2", "x 3"), "", 1.3, -2.0),
    "a struct": ({"s": {"x": X, "fs": RATE, "unit": "m/s^2"}}, ("s.x 1", "s.x 2", "s.x 3"), "m/s^2", 1.3, 0.0),
    "its settings in one": ({"s": {"x": X, "set": {"fs": RATE, "who": "me"}}}, ("s.x 1", "s.x 2", "s.x 3"), "",
                            1.3, 0.0),
    "names and units": ({"x": X, "fs": RATE, "channel_names": CELL, "x_units": np.array(["mm"] * 3, dtype=object)},
                        ("left", "right", "top"), "mm", 1.3, 0.0),
    "To Workspace": ({"out": {"time": TIME - 1.0, "signals": {"values": X, "label": "acc", "dimensions": 3.0}}},
                     ("out.signals.values 1", "out.signals.values 2", "out.signals.values 3"), "", 1.3, -1.0),
    "To Workspace, one": ({"out": {"time": TIME - 1.0,
                                   "signals": {"values": X[:, :1], "label": "acc", "dimensions": 1.0},
                                   "blockName": "model/To Workspace"}}, ("acc",), "", 1.3, -1.0),
    "Testlab": ({"Signal_0": {"x_values": {"start_value": -1.0, "increment": 1.0 / RATE, "number_of_values": 400.0},
                              "y_values": {"values": X[:, :1], "quantity": {"label": "g"}}}},
                ("Signal_0.y_values.values",), "g", 1.3, -1.0),
    "two structs": ({"a": {"x": X[:, :1], "fs": RATE}, "b": {"y": X[:, :1][::2], "fs": 0.5 * RATE}},
                    ("a.x",), "", 1.3, 0.0),
    "T beside Ts": ({"x": X, "T": 20.0 + np.random.default_rng(3).standard_normal(SIZE), "Ts": 1.0 / RATE},
                    ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "rising T beside Ts": ({"x": X, "T": 20.0 + np.cumsum(np.random.default_rng(3).random(SIZE)), "Ts": 1.0 / RATE},
                           ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "constants": ({"x": X, "fs": RATE, "cal": np.array([1.0, 2.0]), "other": np.arange(50.0) ** 2, "text": "abc"},
                  ("x 1", "x 2", "x 3"), "", 1.3, 0.0),
    "identification toolbox": ({"z": {"OutputData": X, "Ts": 1.0 / RATE, "OutputName": CELL, "OutputUnit": "mm"}},
                               ("left", "right", "top"), "mm", 1.3, 0.0),
    "a column of times each": ({"D_AI_1": X[:, :1], "D_time_AI_1": TIME - 1.0, "D_AI_2": X[::2, :1],
                                "D_time_AI_2": 2.0 * TIME[:200]}, ("D_AI_1",), "", 1.3, -1.0),
    "a rate as text": ({"x": X[:, :1], "Fs": "20 Hz"}, ("x",), "", 1.3, 0.0),
    "a rate in a cell": ({"x": X[:, :1], "Fs": np.array([RATE], dtype=object)}, ("x",), "", 1.3, 0.0),
    "times in a named matrix": ({"m": np.column_stack([TIME - 1.0, X[:, :2]]),
                                 "names": np.array(["time", "left", "right"], dtype=object)},
                                ("left", "right"), "", 1.3, -1.0),
}  # fmt: skip
NAMED = ("a column of times each", "two structs", "T beside Ts", "rising T beside Ts", "constants")


@pytest.mark.parametrize("version", ["5", "5 compressed", "7.3"])
@pytest.mark.parametrize("way", WAYS)
def test_a_decay_in_every_form(way: str, version: str, tmp_path: pathlib.Path) -> None:
    content, names, unit, hertz, start = WAYS[way]
    path = tmp_path / "a.mat"
    if version == "7.3":
        saved_73(path, content)
    else:
        saved(path, content, do_compression="c" in version)
    found = vibration(path, names if way in NAMED else ())
    assert found.reading.names == names
    assert found.reading.source.units[found.reading.source.index(names[0])] == unit
    assert found.frequency / (2.0 * np.pi) == pytest.approx([hertz], rel=3e-3)
    assert found.reading.start == pytest.approx(start, abs=1e-9)
    open_ = any(word in way for word in ("column of times", "rows", "Workspace", "matrix"))
    assert ("the time states no unit: taken in s" in found.reading.notes) == open_


def test_structs_in_arrays_and_cells(tmp_path: pathlib.Path) -> None:
    one = np.zeros((1, 2), dtype=[("values", object), ("label", object)])
    one[0, 0], one[0, 1] = (X[:, :1], "left"), (X[:, 1:2], "right")
    path = saved(
        tmp_path / "a.mat", {"out": {"time": TIME, "signals": one}, "c": np.array([X[:, 2:], "word"], dtype=object)}
    )
    found = signals.read(path)
    assert found.names == ("out.time", "left", "right", "c{1}")
    assert found.index("out.signals(2).values") == 2
    assert vibration(path, ["left", "right"]).frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)


def test_samples_are_along_the_axis_that_is_as_long_as_the_times(tmp_path: pathlib.Path) -> None:
    wide = np.random.default_rng(2).standard_normal((50, 60))
    deep = np.random.default_rng(2).standard_normal((1, 3, 50))
    path = saved(tmp_path / "a.mat", {"t": TIME[:50], "x": wide, "y": deep, "z": np.zeros((2, 3, 4))})
    found = signals.read(path)
    np.testing.assert_array_equal(found.column("x 60"), wide[:, 59])
    np.testing.assert_array_equal(found.column("y 3"), deep[0, 2])
    assert found.left_out == {"z": "it has 3 dimensions"}


def test_days_and_counts_since_1970(tmp_path: pathlib.Path) -> None:
    """Times without a unit whose size says what they count."""
    for time, what in (
        (738_000.5 + TIME / 86400.0, "days as datenum does"),
        (1.7e9 + TIME, "s since 1970"),
        (1.7e12 + 1e3 * TIME, "ms since 1970"),
    ):
        found = vibration(saved(tmp_path / "a.mat", {"time": time, "x": X[:, 0]}))
        assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=3e-3)
        assert f"the time states no unit: by its size it counts {what}" in " ".join(found.reading.notes)


def test_a_column_that_rises_evenly_is_offered_as_the_time(tmp_path: pathlib.Path) -> None:
    path = saved(tmp_path / "a.mat", {"m": np.column_stack([TIME, X])})
    with pytest.raises(InputError, match=r"states neither times nor a rate; .*; 'm 1' rises evenly, as times do"):
        vibration(path)
    assert vibration(path, (), {"signals.time": "m 1"}).reading.names == ("m 2", "m 3", "m 4")
    other = saved(tmp_path / "b.mat", {"t": TIME[1:], "x": X})
    with pytest.raises(InputError, match="'t' has 399 values for 400 samples of 'x 1'"):
        vibration(other)


def test_two_bases_are_listed(tmp_path: pathlib.Path) -> None:
    path = saved(tmp_path / "a.mat", WAYS["two structs"][0])
    with pytest.raises(
        InputError, match=r"a\.x at 20 Hz with 400 samples; b\.y at 10 Hz with 200 samples; name the ones"
    ):
        vibration(path)


def test_a_rate_and_times_that_contradict_each_other(tmp_path: pathlib.Path) -> None:
    path = saved(tmp_path / "a.mat", {"time": 1.1 * TIME, "x": X, "fs": RATE})
    with pytest.raises(InputError, match=r"states a rate of 20 Hz, but by its column 'time' it has 18\.1818 Hz"):
        vibration(path)
    found = vibration(path, (), {"signals.time": "time"})
    assert "the file states a rate of 20 Hz, its column 'time' has 18.1818 Hz" in found.reading.notes
    both = saved(tmp_path / "b.mat", {"dt": 0.1, "x": X, "fs": RATE})
    with pytest.raises(
        InputError, match=r"neither times nor a rate; .*; the file states different sampling rates of 'x'"
    ):
        vibration(both)
    assert vibration(both, (), {"signals.rate": "20 Hz"}).frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=3e-3)


def opaque(name: bytes, class_: bytes) -> bytes:
    """An object as MATLAB writes it: flags, its name, MCOS, its class, a number."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    parts = element(6, struct.pack("<II", 17, 0)) + b"".join(element(1, word) for word in (name, b"MCOS", class_))
    flags, shape = element(6, struct.pack("<II", 13, 0)), element(5, struct.pack("<ii", 1, 1))
    parts += element(14, flags + shape + element(1, b"") + element(6, struct.pack("<I", 5)))
    return element(14, parts)


@pytest.mark.parametrize(
    ("class_", "how"),
    [
        ("table", r"x = run\.Variables; save\('file\.mat', 'x'\)"),
        ("timetable", r"t = seconds\(run\.Properties\.RowTimes\); x = run\.Variables; save\('file\.mat', 't', 'x'\)"),
        ("timeseries", r"t = run\.Time; x = run\.Data; save\('file\.mat', 't', 'x'\)"),
        ("string", r"x = double\(run\); save\('file\.mat', 'x'\)"),
    ],
)
def test_objects_are_refused_with_what_to_do(class_: str, how: str, tmp_path: pathlib.Path) -> None:
    stream = io.BytesIO()
    scipy.io.savemat(stream, {"n": 1.0})
    path = tmp_path / "a.mat"
    path.write_bytes(stream.getvalue() + opaque(b"run", class_.encode()))
    said = rf"'run' is none: it is an object of the class '{class_}', which MATLAB alone reads; save arrays: {how}"
    with pytest.raises(InputError, match=said):
        signals.read(path)
    scipy.io.savemat(stream := io.BytesIO(), {"x": X, "fs": RATE})
    path.write_bytes(stream.getvalue() + opaque(b"run", class_.encode()))
    assert vibration(path).frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        file["run"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4")
        file["run"].attrs["MATLAB_class"], file["run"].attrs["MATLAB_object_decode"] = np.bytes_(class_), 3
    with (tmp_path / "b.mat").open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    with pytest.raises(InputError, match=said):
        signals.read(tmp_path / "b.mat")


def test_numbers_of_all_kinds_and_both_orders(tmp_path: pathlib.Path) -> None:
    """As SciPy reads them; it is another implementation. The order of bytes of a file is turned by hand."""
    kinds = ("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?")
    content = {kind.replace("?", "b"): np.arange(-3 if kind[0] in "fi" else 0, 9).astype(kind)[None] for kind in kinds}
    content |= {"c": np.array([[1.0 + 2.0j, 3.0]]), "m": np.arange(6.0).reshape(2, 3), "e": np.zeros((0, 3)), "s": "ab"}
    path = saved(tmp_path / "a.mat", content)
    leaves, others = mat_file.read(path.read_bytes(), "a.mat")
    theirs = {key: value for key, value in scipy.io.loadmat(path).items() if key[:2] != "__"}
    assert not others
    assert {key for (key,) in leaves} == set(theirs)
    for key, value in theirs.items():
        mine = leaves[key,]
        if key == "s":
            assert mine == ("ab",)
        else:
            np.testing.assert_array_equal(mine, value)
            assert isinstance(mine, np.ndarray)
            assert mine.shape == value.shape


def test_a_struct_that_is_cut_off(tmp_path: pathlib.Path) -> None:
    raw = saved(tmp_path / "a.mat", WAYS["To Workspace"][0]).read_bytes()
    for cut in range(8, len(raw) - 128, 97):
        (tmp_path / "a.mat").write_bytes(raw[:-cut])
        with pytest.raises(InputError, match="cannot read"):
            signals.read(tmp_path / "a.mat")


def test_structs_in_one_another_have_an_end(tmp_path: pathlib.Path) -> None:
    content: dict[str, Any] = {"x": X}
    for _ in range(40):
        content = {"s": content}
    with pytest.raises(InputError, match="its array 's' is damaged"):
        signals.read(saved(tmp_path / "a.mat", content))
