"""Every format is read back as it was written, and what is no signal is refused in one sentence."""

from __future__ import annotations

import hashlib
import pathlib
import subprocess
import sys
import warnings

import h5py
import numpy as np
import pytest
import scipy.io

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops.measurement import vibration

RATE = 50.0


@pytest.fixture
def samples() -> np.ndarray:
    """(200, 3): time and two sensors in mm."""
    t = np.arange(200) / RATE
    noise = np.random.default_rng(7).standard_normal((200, 2))
    return np.column_stack([t, np.cos(14.0 * t), np.sin(9.0 * t)]) + np.column_stack([0 * t, 0.01 * noise])


def check(found: signals.Signals, samples: np.ndarray, *, format_: str, rate: float | None) -> None:
    """The two sensors are there to single precision."""
    assert found.format == format_
    np.testing.assert_allclose(found.data[:, -2:], samples[:, 1:], atol=2e-6)
    if rate is None:
        assert found.rate is None
        np.testing.assert_allclose(found.column(1), samples[:, 0], atol=1e-12)
    else:
        assert found.rate == pytest.approx(rate, rel=1e-9)
    assert found.sha256 == hashlib.sha256(pathlib.Path(found.path).read_bytes()).hexdigest()


@pytest.mark.parametrize(
    ("separator", "decimal", "head", "names"),
    [
        (",", ".", "time (s),left (mm),right (mm)\n", ("time", "left", "right")),
        ("\t", ".", "# written by hand\ntime\tleft\tright\ns\tmm\tmm\n", ("time", "left", "right")),
        (";", ",", "t;A [mm];B [mm]\n", ("t", "A", "B")),
        (" ", ".", "", ("column 1", "column 2", "column 3")),
        (",", ".", "Rig 3, channel list follows\n\ntime,left,right\n", ("time", "left", "right")),
    ],
)
def test_texts_tell_their_separator_decimal_sign_names_and_units(
    tmp_path: pathlib.Path, samples: np.ndarray, separator: str, decimal: str, head: str, names: tuple[str, ...]
) -> None:
    path = tmp_path / "knock.csv"
    rows = "\n".join(separator.join(f"{x:.9f}".replace(".", decimal) for x in row) for row in samples)
    path.write_text(head + rows + "\n", encoding="utf-8")
    found = signals.read(path)
    check(found, samples, format_="CSV", rate=None)
    assert found.names == names
    if "mm" in head:
        assert found.units[1:] == ("mm", "mm")


def test_texts_with_empty_entries_and_columns_of_words(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "knock.csv"
    path.write_text("time,left,label\n0,1.5,ok\n0.1,,ok\n0.2,nan,ok\n0.3,2.5,ok\n", encoding="utf-16")
    found = signals.read(path)
    assert found.names == ("time", "left")
    np.testing.assert_array_equal(found.column("left"), [1.5, np.nan, np.nan, 2.5])


def test_tdms(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    tdms = pytest.importorskip("nptdms")
    path = tmp_path / "knock.tdms"
    channels = [
        tdms.ChannelObject("rig", n, samples[:, k], {"wf_increment": 1.0 / RATE, "unit_string": "mm"})
        for k, n in ((1, "left"), (2, "right"))
    ]
    with tdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)
    found = signals.read(path)
    check(found, samples, format_="TDMS", rate=RATE)
    assert (found.names, found.units) == (("left", "right"), ("mm", "mm"))


def test_uff58(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "knock.uff"
    sets = [
        pyuff.prepare_58(
            binary=0,
            func_type=1,
            rsp_node=node,
            rsp_dir=2,
            ref_node=0,
            ref_dir=0,
            x=samples[:, 0],
            data=samples[:, node],
            abscissa_spacing=1,
            abscissa_inc=1.0 / RATE,
            abscissa_min=0.0,
            num_pts=len(samples),
            ordinate_axis_units_lab="mm",
            ord_data_type=4,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=8,
            orddenom_spec_data_type=0,
            z_axis_spec_data_type=0,
        )
        for node in (1, 2)
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    found = signals.read(path)
    check(found, samples, format_="UFF 58", rate=RATE)
    assert found.names == ("1+Y", "2+Y")
    assert found.units == ("mm", "mm")


def test_mat_of_all_versions(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    path = tmp_path / "knock.mat"
    for version in ("5", "4"):
        scipy.io.savemat(path, {"x": samples[:, 1:], "fs": RATE}, format=version)
        found = signals.read(path)
        check(found, samples, format_="MAT", rate=RATE)
        assert found.names == ("x 1", "x 2")
    with h5py.File(path, "w", userblock_size=512) as file:  # version 7.3 is HDF5, turned over
        file["x"], file["fs"] = samples[:, 1:].T, np.array([[RATE]])
    content = bytearray(path.read_bytes())
    content[:10] = b"MATLAB 7.3"
    path.write_bytes(bytes(content))
    check(signals.read(path), samples, format_="MAT", rate=RATE)


def test_hdf5_with_units_and_rate_as_attributes(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    path = tmp_path / "knock.h5"
    with h5py.File(path, "w") as file:
        for k, name in ((1, "left"), (2, "right")):
            file[f"rig/{name}"] = samples[:, k]
            file[f"rig/{name}"].attrs["units"] = "mm"
        file.attrs["sample_rate"] = RATE
    found = signals.read(path)
    check(found, samples, format_="HDF5", rate=RATE)
    assert (found.names, found.units) == (("rig/left", "rig/right"), ("mm", "mm"))


@pytest.mark.parametrize("kind", ["float32", "int16", "int32", "uint8"])
def test_wav(tmp_path: pathlib.Path, samples: np.ndarray, kind: str) -> None:
    path, x = tmp_path / "knock.wav", 0.5 * samples[:, 1:]
    scale = {"float32": 1.0, "int16": 2.0**15, "int32": 2.0**31, "uint8": 2.0**7}[kind]
    scipy.io.wavfile.write(path, int(RATE), (x * scale + (128.0 if kind == "uint8" else 0.0)).astype(kind))
    found = signals.read(path)
    assert (found.format, found.rate, found.names) == ("WAV", RATE, ("channel 1", "channel 2"))
    np.testing.assert_allclose(found.data, x, atol=max(1e-6, 1.0 / scale if kind != "float32" else 0.0))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", b"", "it is empty"),
        ("a.csv", b" \n \n", "it is empty"),
        ("a.csv", b"only words\nand more of them\n", "it is no table of numbers"),
        ("a.csv", b"t,x\n0,1\n1,2\n2,3\n3,4\n4,5\n5,6\n6,7\n7,8\n8,9\n9,1,7\n", "line 11 has more cells than the 2"),
        ("a.xlsx", b"PK\x03\x04" + bytes(200), "it is none of CSV"),
        ("a.dat", bytes(range(256)) * 8, "it is none of CSV"),
        ("a.tdms", b"TDSm" + bytes(100), "begins like a TDMS file, but is damaged"),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + bytes(100), "it is not an HDF5 file, or it is damaged"),
        ("a.wav", b"RIFF\x00\x00\x00\x00WAVE" + bytes(10), "begins like a WAV file, but is damaged"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + bytes(200), "begins like a MAT file, but is damaged"),
        ("a.uff", b"    -1\n    58\nrubbish\n    -1\n", "UFF 58 file"),
    ],
)
def test_what_is_no_signal_is_refused(tmp_path: pathlib.Path, name: str, content: bytes, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        signals.read(path)
    assert said in str(error.value)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def test_files_that_are_cut_off_are_refused(
    tmp_path: pathlib.Path, samples: np.ndarray, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.wav"
    scipy.io.wavfile.write(path, int(RATE), samples[:, 1:].astype("float32"))
    path.write_bytes(path.read_bytes()[:-403])
    with pytest.raises(InputError, match="begins like a WAV file, but is damaged"):
        signals.read(path)
    tdms = pytest.importorskip("nptdms")
    path = tmp_path / "a.tdms"
    with tdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([tdms.ChannelObject("rig", f"{k}", samples[:, k]) for k in (1, 2)])
    path.write_bytes(path.read_bytes()[:-700])
    found = signals.read(path)
    with pytest.raises(InputError, match=r"unequal numbers of samples \(1: 200, 2: \d+\)"):
        found.data  # noqa: B018
    assert "the file ends within a segment" in found.columns[0].notes[0]
    assert capfd.readouterr() == ("", "")


def test_a_rate_on_a_group_and_structs(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["rig/x"] = samples[:, 1:]
        file["rig"].attrs["fs"] = RATE
    assert signals.read(tmp_path / "a.h5").rate == RATE
    scipy.io.savemat(tmp_path / "a.mat", {"s": {"x": samples, "fs": RATE}})
    assert signals.read(tmp_path / "a.mat").names == ("s.x 1", "s.x 2", "s.x 3")
    assert signals.read(tmp_path / "a.mat").rate == RATE


def test_names_parted_by_another_sign_than_the_numbers(tmp_path: pathlib.Path, samples: np.ndarray) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time (s),left (mm),right (mm)\n" + "\n".join(";".join(f"{x:.9f}" for x in row) for row in samples))
    found = signals.read(path)
    assert (found.names, found.units) == (("time", "left", "right"), ("s", "mm", "mm"))


def test_missing_files_and_folders(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        signals.read(tmp_path / "none.csv")
    with pytest.raises(InputError, match="it is a folder"):
        signals.read(tmp_path)


def test_columns_of_unequal_length(tmp_path: pathlib.Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["left"], file["right"] = np.arange(10.0), np.arange(9.0)
    found = signals.read(tmp_path / "a.h5")
    with pytest.raises(InputError, match=r"unequal numbers of samples \(left: 10, right: 9\)"):
        found.data  # noqa: B018


def test_wrong_columns_are_told_with_the_nearest(tmp_path: pathlib.Path) -> None:
    (tmp_path / "a.csv").write_text("time,left\n0,1\n1,2\n2,4\n")
    found = signals.read(tmp_path / "a.csv")
    with pytest.raises(InputError, match="did you mean 'left'"):
        found.column("lft")
    with pytest.raises(InputError, match="has 2 columns, counted from 1: time, left"):
        found.column(3)


def test_a_library_that_is_missing_is_named(tmp_path: pathlib.Path) -> None:
    (tmp_path / "a.tdms").write_bytes(b"TDSm" + bytes(100))
    code = (
        "import sys; sys.modules['nptdms'] = None\n"
        "from evolvent import InputError\n"
        "from evolvent_base import signals\n"
        "try:\n    signals.read(sys.argv[1])\nexcept InputError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a.tdms")], capture_output=True, text=True, check=True
    )
    assert "TDMS files need the package 'nptdms'; pip install nptdms" in done.stdout


@pytest.mark.parametrize("mark", ["-9999", "99999", "1e10", "32767"])
def test_marks_of_missing_samples_are_refused(tmp_path: pathlib.Path, mark: str) -> None:
    path = tmp_path / "a.csv"
    rows = [f"{k / 20:.2f},{np.cos(0.4 * k):.4f}" if k != 37 else f"{k / 20:.2f},{mark}" for k in range(100)]
    path.write_text("time (s),a (mm)\n" + "\n".join(rows))
    with pytest.raises(InputError, match=r"sample 38 of 'a' .* far from all others; leave the cell empty"):
        vibration(path)
