"""Files and cases made to break a reader: one sentence and exit code 2 from each, and no large memory."""

from __future__ import annotations

import contextlib
import io
import json
import pathlib
import struct
import zipfile
from collections.abc import Callable

import numpy as np
import pytest

from evolvent import InputError, cases
from evolvent.elements import nastran
from evolvent.elements.reduced_files import read_model
from evolvent_base import files
from evolvent_base.answer import Answer, as_csv

MODEL = read_model("solar-panel")
DIGITS = "9" * 5000


def npy(values: np.ndarray) -> bytes:
    content = io.BytesIO()
    np.lib.format.write_array(content, values)
    return content.getvalue()


def head(text: str) -> bytes:
    raw = text.encode() + b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(raw)) + raw + bytes(64)


def archive(
    mass: bytes, method: int = zipfile.ZIP_DEFLATED, patch: Callable[[bytearray], None] = lambda raw: None
) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as file:
        for key, value in (("stiffness", npy(MODEL.stiffness)), ("mass", mass), ("positions", npy(MODEL.positions))):
            file.writestr(f"{key}.npy", value)
    raw = bytearray(content.getvalue())
    patch(raw)
    return bytes(raw)


def encrypted(raw: bytearray) -> None:
    for sign, place in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
        raw[raw.find(sign) + place] |= 1


def unknown_method(raw: bytearray) -> None:
    for sign, place in ((b"PK\x01\x02", 10), (b"PK\x03\x04", 8)):
        at = raw.find(sign) + place
        raw[at : at + 2] = struct.pack("<H", 99)


def spoiled(raw: bytearray) -> None:
    raw[120] ^= 0xFF
    raw[160] ^= 0xFF


MASS = npy(MODEL.mass)
ARCHIVES = {
    "of 1e12 numbers": archive(head("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }")),
    "of 1e20 numbers": archive(head("{'descr': '<f8', 'fortran_order': False, 'shape': (10" + "0" * 19 + ",), }")),
    "of -1 numbers": archive(head("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -8), }")),
    "of objects": archive(head("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }")),
    "head is not closed": archive(head("((((")),
    "head is no text": archive(b"\x93NUMPY\x01\x00\xff\xff" + bytes(100)),
    "version 9": archive(b"\x93NUMPY\x09\x00" + bytes(100)),
    "empty member": archive(b""),
    "encrypted": archive(MASS, patch=encrypted),
    "unknown method": archive(MASS, patch=unknown_method),
    **{f"spoiled {method}": archive(MASS, method, spoiled) for method in (zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA)},
    **{f"cut at {k}": archive(MASS)[:k] for k in (0, 1, 30, 500, -30, -1)},
}
LISTS = {"stiffness": MODEL.stiffness.tolist(), "mass": MODEL.mass.tolist(), "positions": MODEL.positions.tolist()}
TEXTS = {
    "many digits": '{"mass": ' + DIGITS + "}",
    "1e400 written out": json.dumps({**LISTS, "mass": [[10**400]]}),
    **{f"{key} is {value}": json.dumps({**LISTS, key: value}) for key in (*LISTS, "recovery", "names")
       for value in (5, None, True, "x", {"a": 1}, [], [[]], [[[1.0]]])},
    "half a letter": '{"\\ud800": 1}', "no object": "5", "deep": "[" * 5000 + "]" * 5000, "empty": "",
}  # fmt: skip


@pytest.mark.parametrize("name", ARCHIVES)
def test_an_archive_of_a_model_is_refused(name: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "m.npz").write_bytes(ARCHIVES[name])
    with pytest.raises(InputError, match=r"m\.npz"):
        read_model(str(tmp_path / "m.npz"))


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_of_a_model_is_refused_or_read(name: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "m.json").write_text(TEXTS[name])
    with contextlib.suppress(InputError):
        assert read_model(str(tmp_path / "m.json")).stiffness.shape == MODEL.stiffness.shape


@pytest.mark.parametrize(
    "line", ["SPOINT,1,THRU,99999999", "SPOINT         1    THRU99999999", "spoint,1,thru," + "9" * 30,
             "\n".join(f"SPOINT,{k}00001,THRU,{k}60000" for k in (1, 2, 3))]
)  # fmt: skip
def test_ranges_of_bulk_data_are_bounded(line: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "m.asm").write_text("GRID,1,,0.,0.,0.\n" + line + "\n")
    with pytest.raises(InputError, match="the range of SPOINT stands for more than 100000 points"):
        nastran._check_ranges(str(tmp_path / "m.asm"))


TABLES = {
    "a cell of 140 000 letters": "1" * 140_000 + ",2\n",
    "a carriage return": "0,0\n1\r2,3\n",
    "a quote that is not closed": '0,"0\n1,1\n',
    "NUL": "0,0\n1\0,1\n",
    "blanks": " " * 1_000_000 + "\n",
    "many digits": f"0,{DIGITS}\n",
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_refused_or_read(name: str, call, tmp_path: pathlib.Path) -> None:
    """As the table of a part, the column of a distribution, and measured data."""
    (tmp_path / "t.csv").write_text("angle (deg),torque (N m)\n" + TABLES[name], newline="")
    harness = {"kind": "resistance", "type": "harness", "joint": "hinge", "torque": "t.csv"}
    (tmp_path / "case.yaml").write_text(json.dumps({"parts": {"w": harness}, "simulate": {"until": 1}}))
    content = {"case": "heliogyro", "over": {"blade.length": "table(t.csv, angle)"}, "sample": "monte-carlo"}
    (tmp_path / "study.yaml").write_text(json.dumps({**content, "samples": 3}))
    for words in (
        ("modes", "case.yaml"),
        ("sweep", "study.yaml"),
        ("calibrate", "two-booms", "t.csv", "--fit", "parts.hub.mass", "--observe", "x"),
        ("calibrate", "wire-booms", "t.csv", "--fit", "wire.tip_mass", "--observe", "spin_rate"),
        ("identify", "t.csv"),
    ):
        code, _, err = call(*words)
        assert code == 2, (words, err)
        assert "Traceback" not in err


@pytest.mark.parametrize(
    "text", ["5", "[1, 2]", "{}", "{system: 5}", "{system: [structure]}", "{system: {a: 1}}", "{system: nothing}",
             "{case: heliogyro, over: {blade.length: [1]}}", "{? a, ? b}", "{parts: 3}", "{parts: {a: {kind: [b]}}}"]
)  # fmt: skip
def test_what_is_no_case_is_refused_by_every_command(text: str, call, tmp_path: pathlib.Path) -> None:
    (tmp_path / "case.yaml").write_text(text)
    (tmp_path / "data.csv").write_text("time (s),x (m)\n0,0\n1,1\n")
    for words in (
        ("run",), ("modes",), ("equilibrium",), ("margin",), ("fmu",), ("design-drive",), ("permissible-torque",),
        ("sensitivity", "--of", "a.position.x", "--by", "parts.a.mass"),
        ("design", "--vary", "parts.a.mass=1 to 2", "--minimize", "a.position.x.last"),
        ("disperse", "--vary", "parts.a.mass=uniform(1, 2)", "--keep", "a.position.x.last"),
        ("calibrate", "data.csv", "--fit", "parts.a.mass", "--observe", "x"),
    ):  # fmt: skip
        code, _, err = call(words[0], "case.yaml", *words[1:])
        assert code == 2, (words, err)
        assert "Traceback" not in err


def test_sensitivities_are_written_whole_or_not_at_all(call, tmp_path: pathlib.Path, monkeypatch) -> None:
    class System:
        Case = None

        def system(self, case):
            return self

        def sensitivity(self, *_, mode):
            return self

        named = "sensitivities"

        def answer(self):
            return Answer(title="", files={"s.csv": lambda: as_csv([["value", "key"], ["a", "b"]])})

    monkeypatch.setattr(cases, "load", lambda *_: type("Case", (), {"system": "x"}))
    monkeypatch.setattr(cases, "system", lambda name: System())
    (tmp_path / "s.csv").write_text("before")
    words = ("sensitivity", "x.yaml", "--of", "a", "--by", "b", "--quiet", "-o", "s.csv")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(files.os, "replace", full)
        assert call(*words)[0] == 2
    assert (tmp_path / "s.csv").read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["s.csv"]
    assert call(*words)[0] == 0
    assert (tmp_path / "s.csv").read_bytes() == b"value,key\na,b\n"
