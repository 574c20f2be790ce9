"""Readers of files, one a format; the file's content determines the format, not its name."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import scipy

from evolvent_base import mat_file, packages, safe_open, tables
from evolvent_base.errors import EvolventError, InputError, visible
from evolvent_base.signals import hdf5, tdms, text, trees, uff
from evolvent_base.signals.recording import Column, Signals, column
from evolvent_base.tables import distinct
from evolvent_base.units import head_and_unit, is_unit

_HDF5 = b"\x89HDF\r\n\x1a\n"
FORMATS = "CSV, TSV, TDMS, UFF 58, MAT, HDF5, WAV, and runs of evolvent"


class Content(NamedTuple):
    """Columns of a file, names of what else it holds -> why that is no column, and notes on all of it."""

    columns: list[Column]
    left: Mapping[str, str] = MappingProxyType({})
    notes: Sequence[str] = ()
    places: Sequence[str] = ()


def read(path: str | os.PathLike[str], variables: Iterable[str] = ()) -> Signals:
    """Columns of a file.

    Parameters
    ----------
    path : str
        A CSV or TSV text (with or without a line of names and one of units; decimal point or comma), TDMS, UFF
        data set 58, MAT (all versions), HDF5, WAV, or a run of this package.
    variables : full names of variables of a run, such as "boom.tip_deflection.y", which become columns; of a run with
        sensors its `sensor_displacement` is read besides. Columns of other files are all read.

    Raises
    ------
    InputError
        If the file is missing, empty, damaged or of another kind, or if the library for its format is not installed.
    """
    name = os.fspath(path)
    raw = _bytes(name)
    format_, reader = _reader(raw, name)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content = _run(name, variables) if format_ == "run" else reader(name, raw)
    except EvolventError:
        raise
    except ImportError as error:
        raise InputError(
            f"cannot read {name!r}: {format_} files need the package {error.name!r}; pip install {error.name}"
        ) from None
    except Exception:  # noqa: BLE001  (the libraries raise many kinds of errors on a damaged file)
        raise InputError(f"cannot read {name!r}: it begins like a {format_} file, but is damaged") from None
    columns = [one for one in content.columns if one.size]
    names = distinct(visible(one.name) for one in columns)
    if not names:
        others = "".join(f"; {key!r} is none: {why}" for key, why in list(content.left.items())[:1])
        raise InputError(f"cannot read {name!r}: this {format_} file holds no signal{others}")
    columns = [_rated(one) for one in columns]
    new_names = dict(zip([one.name for one in columns], names, strict=True))
    return Signals(
        columns=tuple(
            dataclasses.replace(one, name=n, unit=_unit(one, format_), times=new_names.get(one.times, ""))
            for one, n in zip(columns, names, strict=True)
        ),
        path=name,
        format=format_,
        sha256=hashlib.sha256(raw).hexdigest(),
        notes=content.notes,
        places=content.places,
        left_out={visible(key): visible(why) for key, why in content.left.items()},
    )


def _unit(one: Column, format_: str) -> str:
    """Unit of a column as the file states it, else behind its name, as in "x (mm)"; those of texts are known."""
    unit = visible(one.unit).strip()
    if unit or format_ in ("CSV", "run"):
        return unit
    behind = head_and_unit(one.name)[1]
    return behind if is_unit(behind) else ""


def _rated(one: Column) -> Column:
    """A column without its rate where that is no rate."""
    if one.rate is None or 0.0 < one.rate < np.inf:
        return one
    note = f"the file states a sampling rate of {one.rate:g} Hz, which is none"
    return dataclasses.replace(one, rate=None, notes=(*one.notes, note))


def is_text(raw: bytes, name: str) -> bool:
    """Whether a file is a table in a text, by its first bytes."""
    return _reader(raw, name)[0] == "CSV"


def _bytes(name: str) -> bytes:
    """The file's bytes; refused where there are none."""
    raw = safe_open.content(name)
    if not raw.strip():
        raise InputError(f"cannot read {name!r}: it is empty")
    return raw


def _reader(raw: bytes, name: str) -> tuple[str, Callable[[str, bytes], Content]]:
    """Name and reader of a format, by the file's first bytes."""
    if raw.startswith(b"TDSm"):
        return "TDMS", _tdms
    if raw.startswith((b"RIFF", b"RIFX")) and raw[8:12] == b"WAVE":
        return "WAV", _wav
    if raw.startswith(_HDF5):
        return ("run" if name.endswith(".nc") else "HDF5"), _hdf5
    if _is_mat_7_3(raw):
        return "MAT", _hdf5
    if raw.startswith(b"MATLAB") or name.lower().endswith(".mat"):
        return "MAT", _mat
    if uff.begins(raw):
        return "UFF 58", _uff
    if raw.startswith((b"PK\x03\x04", b"%PDF", b"\x1f\x8b", b"\x89PNG", b"CDF")) or not tables.is_text(raw):
        raise InputError(f"cannot read {name!r}: it is none of {FORMATS}")
    return "CSV", _text


def _is_mat_7_3(raw: bytes) -> bool:
    """Whether a file is HDF5 behind the head of MATLAB."""
    return raw.startswith(b"MATLAB") and raw[512:520] == _HDF5


def _text(name: str, raw: bytes) -> Content:
    return Content(*text.read(raw, name))


def _tdms(name: str, raw: bytes) -> Content:
    return Content(*tdms.read(raw))


def _uff(name: str, raw: bytes) -> Content:
    return Content(*uff.read(raw, name))


def _wav(name: str, raw: bytes) -> Content:
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*(EOF|truncat|incomplete).*")
        rate, data = scipy.io.wavfile.read(io.BytesIO(raw))
    data = data.reshape(len(data), -1)
    values = data.astype(float)
    if data.dtype.kind == "u":
        values -= 128.0
    if data.dtype.kind in "iu":
        values /= 128.0 if data.dtype.kind == "u" else -float(np.iinfo(data.dtype).min)
    notes = ("the samples of a WAV file are parts of full scale",)
    return Content([column(f"channel {c + 1}", x, rate=float(rate), notes=notes) for c, x in enumerate(values.T)])


def _mat(name: str, raw: bytes) -> Content:
    if mat_file.is_version_5(raw):
        leaves, others = mat_file.read(raw, name)
    else:
        leaves, others = _mat_4(raw), {}
    return Content(*trees.columns(trees.Tree(leaves, others, {}, ".")))


def _mat_4(raw: bytes) -> dict[tuple[str, ...], np.ndarray | tuple[str, ...]]:
    found = {(key,): value for key, value in scipy.io.loadmat(io.BytesIO(raw)).items() if key[:2] != "__"}
    return {key: tuple(map(str, value)) if value.dtype.kind == "U" else value for key, value in found.items()}


def _hdf5(name: str, raw: bytes) -> Content:
    tree = hdf5.read(raw, name, of_matlab=_is_mat_7_3(raw))
    return Content(*trees.columns(tree))


def _run(name: str, wanted: Iterable[str]) -> Content:
    read: Any = packages.module("evolvent.results.sensors", f"{name!r} is a run of evolvent, which")
    return Content([column(key, x, unit, times=times) for key, x, unit, times in read.columns(name, wanted)])
