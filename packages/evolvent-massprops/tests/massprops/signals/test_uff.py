"""Universal files as programs write them: binary sets, other sets before, units, starts, and damage."""

from __future__ import annotations

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from evolvent import InputError
from evolvent_base import signals
from evolvent_massprops.measurement import vibration

pyuff = pytest.importorskip("pyuff")
#: pyuff leaves files open when it writes binary sets.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
RATE, SIZE = 20.0, 400
DECAY = 5.0 * np.exp(-0.16 * np.arange(SIZE) / RATE) * np.cos(2.0 * np.pi * 1.3 * np.arange(SIZE) / RATE)
NOISE = 0.01 * np.random.default_rng(1).standard_normal(SIZE)


def set_58(**changed: Any) -> dict[str, Any]:
    """A data set 58 as pyuff takes it."""
    noise = 0.01 * np.random.default_rng(changed.get("rsp_node", 1)).standard_normal(SIZE)
    content = {
        "type": 58, "binary": 0, "byte_ordering": 1, "fp_format": 2, "n_ascii_lines": 11, "n_bytes": 8 * SIZE,
        "id1": "r", "id2": "NONE", "id3": "01-Jan-24 00:00:00", "id4": "NONE", "id5": "NONE",
        "func_type": 1, "ver_num": 0, "load_case_id": 0, "rsp_ent_name": "P", "rsp_node": 1, "rsp_dir": 3,
        "ref_ent_name": "NONE", "ref_node": 0, "ref_dir": 0, "ord_data_type": 4, "num_pts": SIZE,
        "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1.0 / RATE, "z_axis_value": 0.0,
        "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s", "abscissa_axis_lab": "Time",
        "ordinate_spec_data_type": 12, "ordinate_axis_units_lab": "m/s^2", "ordinate_axis_lab": "Acc",
        "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "data": DECAY + noise, "x": np.arange(SIZE) / RATE,
    }  # fmt: skip
    return content | changed


def head_151() -> dict[str, Any]:
    return {
        "type": 151, "model_name": "m", "description": "d", "db_app": "p", "date_db_created": "1-Jan-24",
        "time_db_created": "0:0:0", "version_db1": 0, "version_db2": 0, "file_type": 0, "date_db_saved": "1-Jan-24",
        "time_db_saved": "0:0:0", "program": "x", "date_db_written": "1-Jan-24", "time_db_written": "0:0:0",
    }  # fmt: skip


def units_164(length: float) -> dict[str, Any]:
    return {
        "type": 164, "units_code": 9, "units_description": "own", "temp_mode": 1,
        "length": length, "force": 1.0, "temp": 1.0, "temp_offset": 0.0,
    }  # fmt: skip


def written(path: pathlib.Path, *sets: dict[str, Any], raw: Any = None) -> pathlib.Path:
    """A file of data sets; `raw` : what is done to its bytes."""
    path.unlink(missing_ok=True)  # pyuff overwrites heads of binary sets as well
    for one in sets:
        pyuff.UFF(str(path))._write_set(one, "add", force_double=one.get("ord_data_type") != 2)
    if raw is not None:
        path.write_bytes(raw(path.read_bytes()))
    return path


def turned(type_: str, first: bytes, kind: int = 4) -> Callable[[bytes], bytes]:
    """The data of the only set 58b in another form of numbers."""

    def turn(raw: bytes) -> bytes:
        head = raw.split(b"\n", 13)
        data = np.frombuffer(head[13][: 8 * SIZE], dtype="<f8").astype(type_).tobytes()
        head[1] = first % len(data)
        head[8] = b"%10d" % kind + head[8][10:]
        return b"\n".join(head[:13]) + b"\n" + data + head[13][8 * SIZE :]

    return turn


def without_bytes(raw: bytes) -> bytes:
    """The first line of a set 58b without a number of bytes."""
    return raw.replace(b"%12d" % (8 * SIZE), b"%12d" % 0)


WAYS: dict[str, tuple[list[dict[str, Any]], Any]] = {
    "58": ([set_58()], None),
    "58b first": ([set_58(binary=1)], None),
    "58b of 4 bytes": ([set_58(binary=1)], turned("<f4", b"    58b     1     2          11%12d", 2)),
    "58 of 13 signs": ([set_58(ord_data_type=2)], None),
    "58b, big endian": ([set_58(binary=1)], turned(">f8", b"    58b     2     2          11%12d")),
    "58b without its size": ([set_58(binary=1)], without_bytes),
    "151 and 164 before": ([head_151(), units_164(1.0), set_58()], None),
    "151 and 164 before 58b": ([head_151(), units_164(1.0), set_58(binary=1)], None),
    "two sets 58b": ([set_58(binary=1), set_58(binary=1, rsp_node=2)], None),
    "lines of 80": ([set_58()], lambda raw: b"\n".join(line.ljust(80) for line in raw.split(b"\n"))),
    "lines without blanks": ([set_58()], lambda raw: b"\n".join(line.rstrip() for line in raw.split(b"\n"))),
    "CR LF": ([set_58()], lambda raw: raw.replace(b"\n", b"\r\n")),
    "powers with D": ([set_58()], lambda raw: raw.replace(b"e+", b"D+").replace(b"e-", b"D-")),
    "empty lines before": ([set_58()], lambda raw: b"\n\n" + raw),
    "no last line": ([set_58()], lambda raw: raw.rstrip()[:-2].rstrip(b" ")),
    "padded": ([set_58(data=np.append(DECAY + NOISE, np.zeros(100)), x=np.arange(SIZE + 100) / RATE)], None),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_a_decay_in_every_form(way: str, tmp_path: pathlib.Path) -> None:
    sets, raw = WAYS[way]
    path = written(tmp_path / "a.uff", *sets, raw=raw)
    if way == "padded":
        path.write_bytes(path.read_bytes().replace(b"%10d" % (SIZE + 100), b"%10d" % SIZE))
    found = signals.read(path)
    assert found.names == ("1+Z", "2+Z")[: sum(one["type"] == 58 for one in sets)]
    assert (found.format, found.units[0]) == ("UFF 58", "m/s^2")
    assert found.rate == pytest.approx(RATE, rel=1e-5)
    np.testing.assert_allclose(
        found.column("1+Z"), DECAY + NOISE, rtol=1e-6 if "4" in way or "13" in way else 1e-9, atol=1e-5
    )


def test_pyuff_reads_the_same(tmp_path: pathlib.Path) -> None:
    """Its reader is another implementation."""
    for binary in (0, 1):
        path = written(tmp_path / "a.uff", head_151(), set_58(binary=binary), set_58(binary=binary, rsp_node=7))
        theirs = [one for one in pyuff.UFF(str(path)).read_sets() if one["type"] == 58]
        for mine, one in zip(signals.read(path).columns, theirs, strict=True):
            np.testing.assert_array_equal(mine.samples(), one["data"])


@pytest.mark.parametrize(("unit", "second"), [("s", 1.0), ("ms", 1e-3), ("MS", 1e-3), ("NONE", 1.0)])
def test_the_abscissa_has_a_start_and_a_unit(unit: str, second: float, tmp_path: pathlib.Path) -> None:
    """The pre-trigger is cut in the file's own time."""
    data = np.append(NOISE[:40], DECAY + NOISE)
    one = set_58(
        abscissa_min=-2.0 / second, abscissa_inc=1.0 / RATE / second, num_pts=data.size, data=data,
        abscissa_axis_units_lab=unit, x=(np.arange(data.size) / RATE - 2.0) / second,
    )  # fmt: skip
    path = written(tmp_path / "a.uff", one)
    found = vibration(path, (), {"signals.start": "0 s"})
    assert found.frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert found.reading.start == pytest.approx(0.0, abs=1e-9)
    assert ("the time states no unit: taken in s" in found.reading.notes) == (unit == "NONE")


def test_an_abscissa_without_a_unit_and_a_forced_rate(tmp_path: pathlib.Path) -> None:
    """The rate says what the unit is; it is refused where no unit would do."""
    time = 1e3 * np.arange(SIZE) / RATE - 2000.0
    path = written(tmp_path / "a.uff", set_58(abscissa_axis_units_lab="NONE", x=time))
    found = vibration(path, (), {"signals.rate": "20 Hz"}).reading
    assert found.start == pytest.approx(-2.0)
    assert found.notes == ("the time states no unit; by signals.rate it is in ms",)
    with pytest.raises(InputError, match=r"signals\.rate is 21 Hz, but by its own rate .* has 0\.02 Hz"):
        vibration(path, (), {"signals.rate": "21 Hz"})
    path = written(tmp_path / "b.uff", set_58(x=time))
    with pytest.raises(InputError, match=r"signals\.rate is 20 Hz, but by its own rate .* has 0\.02 Hz"):
        vibration(path, (), {"signals.rate": "20 Hz"})


def test_times_that_are_listed(tmp_path: pathlib.Path) -> None:
    """Also of several sets: equal times are one column."""
    time = np.arange(SIZE) / RATE
    for kind in (2, 4):
        sets = [set_58(abscissa_spacing=0, x=time - 1.0, rsp_node=node, ord_data_type=kind) for node in (1, 2)]
        found = signals.read(written(tmp_path / "a.uff", *sets))
        assert found.names == ("time", "1+Z", "2+Z")
        np.testing.assert_allclose(found.column("time"), time - 1.0, atol=1e-5)
        assert vibration(found, (), {"signals.start": "0 s"}).reading.start == pytest.approx(0.0, abs=1e-6)


def test_sets_of_different_steps(tmp_path: pathlib.Path) -> None:
    """Refused with a list, unless the ones that are wanted are named."""
    fine = set_58(rsp_node=2, abscissa_inc=0.5 / RATE, x=0.5 * np.arange(SIZE) / RATE)
    path = written(tmp_path / "a.uff", set_58(), fine, set_58(rsp_node=3))
    said = r"columns of different times: 1\+Z, 3\+Z at 20 Hz with 400 samples; 2\+Z at 40 Hz with 400 samples; name the"
    with pytest.raises(InputError, match=said):
        vibration(path)
    assert vibration(path, ["1+Z", "3+Z"]).frequency / (2.0 * np.pi) == pytest.approx([1.3], rel=1e-3)
    assert vibration(path, ["2+Z"]).frequency / (2.0 * np.pi) == pytest.approx([2.6], rel=1e-3)
    with pytest.raises(InputError, match="name columns of different times"):
        vibration(path, ["1+Z", "2+Z"])


@pytest.mark.parametrize(("kind", "unit"), [(8, "m"), (11, "m/s"), (12, "m/s^2")])
def test_units_of_the_whole_file(kind: int, unit: str, tmp_path: pathlib.Path) -> None:
    """A data set 164 in mm: samples are divided by 1000; a label of the set itself comes first."""
    one = set_58(ordinate_spec_data_type=kind, ordinate_axis_units_lab="NONE")
    found = signals.read(written(tmp_path / "a.uff", units_164(1000.0), one))
    assert found.units == (unit,)
    np.testing.assert_allclose(found.column(1), 1e-3 * (DECAY + NOISE), rtol=1e-9)
    assert f"the unit of '1+Z', {unit}, is by the file's data set 164" in found.columns[0].notes[0]
    found = signals.read(written(tmp_path / "a.uff", units_164(1000.0), one | {"ordinate_axis_units_lab": "g"}))
    assert found.units == ("g",)
    np.testing.assert_allclose(found.column(1), DECAY + NOISE, rtol=1e-9)


def test_functions_of_frequency_are_left_out(tmp_path: pathlib.Path) -> None:
    other = set_58(func_type=1, abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz", rsp_node=4)
    found = vibration(written(tmp_path / "a.uff", other, set_58())).reading
    assert found.names == ("1+Z",)
    assert "'4+Z' is left out: it is a function of frequency, not of time" in found.notes
    with pytest.raises(InputError, match=r"'4\+Z' is none: it is a function of frequency, not of time"):
        signals.read(written(tmp_path / "b.uff", other))


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("cut", [200, 1900])
def test_a_set_that_is_cut_off(binary: int, cut: int, tmp_path: pathlib.Path) -> None:
    path = written(tmp_path / "a.uff", set_58(binary=binary), raw=lambda raw: raw[:-cut])
    with pytest.raises(InputError, match=r"its data set 1 states 400 samples, but holds \d+"):
        signals.read(path)


def test_floating_point_numbers_of_other_machines(tmp_path: pathlib.Path) -> None:
    path = written(
        tmp_path / "a.uff", set_58(binary=1), raw=lambda raw: raw.replace(b"58b     1     2", b"58b     1     1")
    )
    with pytest.raises(InputError, match="another kind than IEEE 754"):
        signals.read(path)
