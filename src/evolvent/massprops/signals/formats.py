"""Readers of files, one a format; the file's content determines the format, not its name."""

from __future__ import annotations

import hashlib
import importlib
import io
import logging
import os
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from evolvent.base import safe_open
from evolvent.base.errors import EvolventError, InputError, visible
from evolvent.massprops.signals.recording import Signals, Words, distinct
from evolvent.massprops.signals.text import read_text

#: Scalars of a MAT or HDF5 file that are its sampling rate, Hz, or its step, s; letter case does not matter.
RATES = ("rate", "fs", "sample_rate", "samplerate", "sampling_rate", "samplingrate", "sampling_frequency")
STEPS = ("dt", "step", "time_step", "timestep")
FORMATS = "CSV, TSV, TDMS, UFF 58, MAT, HDF5, WAV, and runs of evolvent"


class Content(NamedTuple):
    """Columns of a file: name -> samples, their units, the rate if the file states one, and columns of words."""

    columns: dict[str, np.ndarray]
    units: dict[str, str]
    rate: float | None
    left_out: Mapping[str, Words] = MappingProxyType({})


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
        If the file is missing, empty, damaged or of another kind, if its columns have unequal lengths, or if the
        library for its format is not installed.
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
            f"cannot read {name!r}: {format_} files need the package {error.name!r}; pip install 'evolvent[signals]'"
        ) from None
    except Exception:  # noqa: BLE001  (the libraries raise many kinds of errors on a damaged file)
        raise InputError(f"cannot read {name!r}: it begins like a {format_} file, but is damaged") from None
    return _signals(content, name, format_, hashlib.sha256(raw).hexdigest())


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
    if raw.startswith(b"\x89HDF\r\n\x1a\n"):
        return ("run" if name.endswith(".nc") else "HDF5"), _hdf5
    if raw.startswith(b"MATLAB 7.3"):
        return "MAT", _hdf5
    if raw.startswith(b"MATLAB 5") or name.lower().endswith(".mat"):
        return "MAT", _mat
    first, _, rest = raw[:4096].lstrip().partition(b"\n")
    if first.strip() == b"-1" and rest[:1000].split(maxsplit=1)[:1] and rest.split(maxsplit=1)[0].isdigit():
        return "UFF 58", _uff
    foreign = raw.startswith((b"PK\x03\x04", b"%PDF", b"\x1f\x8b", b"\x89PNG", b"CDF")) or b"\0" in raw[:4096]
    if foreign and not raw.startswith((b"\xff\xfe", b"\xfe\xff")):  # those begin a text in UTF-16
        raise InputError(f"cannot read {name!r}: it is none of {FORMATS}")
    return "CSV", lambda path, content: Content(*read_text(content, path))


def _signals(content: Content, name: str, format_: str, digest: str) -> Signals:
    """The result, its columns of equal length."""
    columns = {key: np.asarray(value, dtype=float).ravel() for key, value in content.columns.items()}
    columns = {key: value for key, value in columns.items() if value.size}
    names = tuple(distinct(map(visible, columns)))
    if not columns:
        raise InputError(f"cannot read {name!r}: this {format_} file holds no signal")
    lengths = {value.size for value in columns.values()}
    if len(lengths) > 1:
        listed = ", ".join(f"{key}: {value.size}" for key, value in list(columns.items())[:8])
        raise InputError(f"cannot read {name!r}: its columns have unequal numbers of samples ({listed})")
    for key, value in columns.items():
        if np.isinf(value).any():
            raise InputError(f"cannot read {name!r}: sample {np.argmax(np.isinf(value)) + 1} of {key!r} is infinite")
    if content.rate is not None and not 0.0 < content.rate < np.inf:
        raise InputError(f"cannot read {name!r}: it states a sampling rate of {content.rate:g} Hz; it must be positive")
    return Signals(
        names=names,
        data=np.column_stack(list(columns.values())),
        units=tuple(visible(content.units.get(key, "")).strip() for key in columns),
        rate=content.rate,
        path=name,
        format=format_,
        sha256=digest,
        left_out={visible(key): found._replace(first=visible(found.first)) for key, found in content.left_out.items()},
    )


def _one_rate(steps: Iterable[float], name: str) -> float | None:
    """The rate of columns that each state a step, s; refused where they differ."""
    known = [float(step) for step in steps if step and np.isfinite(step)]
    if not known:
        return None
    if max(known) - min(known) > 1e-9 * max(map(abs, known)):
        raise InputError(
            f"cannot read {name!r}: its columns are sampled at different rates "
            f"({1.0 / max(known):.6g} to {1.0 / min(known):.6g} Hz)"
        )
    return 1.0 / known[0]


def _tdms(name: str, raw: bytes) -> Content:
    TdmsFile = importlib.import_module("nptdms").TdmsFile

    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)  # the library logs what is damaged beside raising it
    try:
        file = TdmsFile.read(io.BytesIO(raw))
    finally:
        logging.disable(before)
    channels = [c for group in file.groups() for c in group.channels() if len(c) and c.dtype.kind in "biuf"]
    count = Counter(c.name for c in channels)
    names = distinct(c.name if count[c.name] == 1 else f"{c.group_name}/{c.name}" for c in channels)
    return Content(
        {n: c[:] for n, c in zip(names, channels, strict=True)},
        {n: str(c.properties.get("unit_string", "")) for n, c in zip(names, channels, strict=True)},
        _one_rate((c.properties.get("wf_increment", 0.0) for c in channels), name),
    )


def _uff(name: str, raw: bytes) -> Content:
    pyuff = importlib.import_module("pyuff")
    file = pyuff.UFF(name)
    sets = file.read_sets([k for k, kind in enumerate(file.get_set_types()) if kind == 58])
    sets = sets if isinstance(sets, list) else [sets]
    times = [s for s in sets if s.get("func_type") in (0, 1) and not np.iscomplexobj(s["data"])]
    if sets and not times:
        raise InputError(f"cannot read {name!r}: its data sets 58 are functions of frequency, not of time")
    names = distinct(_uff_name(s) for s in times)
    uneven = [s for s in times if not s.get("abscissa_spacing", 1)]
    columns = {"time": np.asarray(times[0]["x"], dtype=float)} if uneven else {}
    columns |= {n: np.asarray(s["data"], dtype=float) for n, s in zip(names, times, strict=True)}
    units = {n: str(s.get("ordinate_axis_units_lab", "")) for n, s in zip(names, times, strict=True)}
    units = {n: "" if unit.strip() == "NONE" else unit for n, unit in units.items()}
    steps = [] if uneven else [s.get("abscissa_inc", 0.0) or s["x"][1] - s["x"][0] for s in times]
    return Content(columns, units | ({"time": "s"} if uneven else {}), _one_rate(steps, name))


def _uff_name(data_set: Mapping[str, Any]) -> str:
    """Response node and direction, such as '3+Y'; else the first line of identification."""
    direction = {1: "X", 2: "Y", 3: "Z", 4: "RX", 5: "RY", 6: "RZ"}
    node, way = int(data_set.get("rsp_node", 0)), int(data_set.get("rsp_dir", 0))
    if node and abs(way) in direction:
        return f"{node}{'-' if way < 0 else '+'}{direction[abs(way)]}"
    text = str(data_set.get("id1", "")).strip()
    return "" if text == "NONE" else text


def _wav(name: str, raw: bytes) -> Content:
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*(EOF|truncat|incomplete).*")
        rate, data = wavfile.read(io.BytesIO(raw))
    data = data.reshape(len(data), -1)
    values = data.astype(float)
    if data.dtype.kind == "u":
        values -= 128.0
    if data.dtype.kind in "iu":
        values /= 128.0 if data.dtype.kind == "u" else -float(np.iinfo(data.dtype).min)
    return Content({f"channel {c + 1}": values[:, c] for c in range(values.shape[1])}, {}, float(rate))


def _mat(name: str, raw: bytes) -> Content:
    from scipy.io import loadmat

    plain, others = safe_open.plain_mat(raw, name)
    found = {key: value for key, value in loadmat(io.BytesIO(plain), squeeze_me=True).items() if key[:2] != "__"}
    content = _arrays(found, {}, name)
    if others and not content.columns:
        raise InputError(
            f"cannot read {name!r}: it holds no array of numbers, and {others[0]!r} is a struct or cell, which is not "
            "read; save its fields as arrays of their own"
        )
    return content


def _hdf5(name: str, raw: bytes) -> Content:
    import h5py

    safe_open.check_hdf5(io.BytesIO(raw), name)
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    with h5py.File(io.BytesIO(raw), "r") as file:
        transposed = raw.startswith(b"MATLAB 7.3")

        def visit(key: str, item: Any) -> None:
            if isinstance(item, h5py.Group):
                rates(item)
            if not isinstance(item, h5py.Dataset) or key.startswith("#") or item.dtype.kind not in "biuf":
                return
            value = np.asarray(item[()])
            arrays[key] = np.squeeze(value.T if transposed else value)
            unit = item.attrs.get("units", item.attrs.get("unit", ""))
            units[key] = unit.decode() if isinstance(unit, bytes) else str(unit)
            rates(item)

        def rates(item: Any) -> None:
            for attribute, number in item.attrs.items():
                if attribute.lower() in (*RATES, *STEPS) and np.size(number) == 1:
                    arrays.setdefault(attribute, np.asarray(number).ravel()[0])

        file.visititems(visit)
        rates(file)
    return _arrays(arrays, units, name)


def _arrays(found: Mapping[str, Any], units: Mapping[str, str], name: str) -> Content:
    """Vectors and matrices (one column a signal) of named arrays; scalars among them may be the rate."""
    columns: dict[str, np.ndarray] = {}
    of: dict[str, str] = {}
    steps = []
    for key, value in found.items():
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            continue
        last = key.rpartition("/")[2].lower()
        if array.size == 1 and float(array.ravel()[0]) > 0.0:
            if last in RATES:
                steps.append(1.0 / float(array.ravel()[0]))
            elif last in STEPS:
                steps.append(float(array.ravel()[0]))
        if array.size == 1 or array.ndim > 2:
            continue
        if array.ndim == 1:
            columns[key], of[key] = array, units.get(key, "")
            continue
        table = array.T if array.shape[0] < array.shape[1] else array
        for c in range(table.shape[1]):
            columns[f"{key} {c + 1}"], of[f"{key} {c + 1}"] = table[:, c], units.get(key, "")
    return Content(columns, of, _one_rate(steps, name))


def _run(name: str, wanted: Iterable[str]) -> Content:
    from evolvent import results
    from evolvent.results import variables

    run = results.regular(results.open(name))
    columns = {"time": np.asarray(run["time"].values, dtype=float)}
    units = {"time": "s"}
    if "sensor_displacement" in run:
        data = run["sensor_displacement"]
        for k, sensor in enumerate(run["sensor"].values):
            columns[f"sensor {sensor}"], units[f"sensor {sensor}"] = data.values[:, k], str(data.attrs["units"])
    for one in wanted:
        if one in columns:
            continue
        found = variables.get(run, one)
        if found.dims != ("time",):
            hint = f"{one}.{found['axis'].values[0]}" if "axis" in found.dims and "axis" in found.coords else ""
            raise InputError(
                f"{one!r} of {name!r} is no single number over time; name one of its components or entries"
                + (f", such as {hint}" if hint else "")
            )
        columns[one] = np.asarray(found.values, dtype=float)
        units[one] = _plain_unit(str(found.attrs.get("units", "")))
    if len(columns) == 1:
        raise InputError(
            f"{name!r} is a run of {run.attrs['system']}, which has no sensors; name the variables that they read with "
            f"--variables or in signals.sensors, such as {_example(run)}"
        )
    return Content(columns, units, None)


def _example(run: Any) -> str:
    """A variable of a run that a sensor might read."""
    from evolvent.results import variables

    dims = {name: variables.get(run, name).dims for name in variables.names(run)}
    known = [name for name, own in dims.items() if own in (("time",), ("time", "axis"))]
    best = next((name for name in known if name.endswith("deflection")), known[-1])
    return f"{best}.y" if "axis" in dims[best] else best


def _plain_unit(unit: str) -> str:
    """A unit as results hold it, "kg m2 s-1", in the form of case files, "kg*m^2/s"."""
    above: list[str] = []
    below: list[str] = []
    for letters, sign, power in re.findall(r"([^\s\d-]+)(-?)(\d*)", unit):
        (below if sign else above).append(letters + (f"^{power}" if power not in ("", "1") else ""))
    return "/".join(["*".join(above) or "1", *below])
