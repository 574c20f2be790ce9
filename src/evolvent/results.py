"""Run: an xarray.Dataset with units on every variable, its case and its solver's account; NetCDF in and out."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import tempfile
from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr

from evolvent import __version__
from evolvent.errors import InputError

#: Engine that reads and writes NetCDF files.
_ENGINE: Literal["h5netcdf"] = "h5netcdf"


def variable(dims: tuple[str, ...], values: Any, units: str, long_name: str, **attrs: Any) -> xr.Variable:
    """A variable with its units and name."""
    return xr.Variable(dims, np.asarray(values), {"units": units, "long_name": long_name, **attrs})


def label(
    dataset: xr.Dataset, *, system: str, case: str, method: str, solution: Any, laws: Mapping[str, str]
) -> xr.Dataset:
    """Write down on a run where it comes from and how it ended.

    Parameters
    ----------
    case : str, the whole case as YAML
    solution : evolvent.solvers.Solution
    laws : mapping, name -> name of the user's law that took its place (a case cannot hold those)
    """
    dataset.attrs = {
        "title": f"evolvent run of {system}",
        "system": system,
        "case": case,
        "version": __version__,
        "solver": method,
        "status": solution.status,
        "message": solution.message,
        "statistics": json.dumps({k: v if np.isfinite(v) else None for k, v in solution.statistics.items()}),
        "wall_time_s": float(solution.wall_time),
        "compile_time_s": float(solution.compile_time),
        "laws": json.dumps(dict(laws)),
    }
    return dataset


def open(path: str | os.PathLike[str]) -> xr.Dataset:  # noqa: A001  (evolvent.open is the public name)
    """Read a run that was saved as NetCDF.

    Raises
    ------
    InputError
        If the file cannot be read, or holds something else.
    """
    name = os.fspath(path)
    if os.path.isdir(name):
        raise InputError(f"cannot read {name!r}: it is a folder")
    try:
        with pathlib.Path(name).open("rb") as file:
            file.read(1)
    except OSError as error:
        raise InputError(f"cannot read {name!r}: {(error.strerror or str(error)).lower()}") from None
    try:
        dataset = xr.load_dataset(name, engine=_ENGINE, decode_times=False)
    except Exception:  # noqa: BLE001  (the back end raises many kinds of errors on a damaged file)
        raise InputError(f"cannot read {name!r}: it is not a NetCDF file, or it is damaged") from None
    if not {"system", "case", "version", "status"} <= set(dataset.attrs):
        raise InputError(f"cannot read {name!r}: it is a NetCDF file, but not a run of evolvent")
    return dataset


def save(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a run as NetCDF, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with writing(path) as temporary:
        dataset.to_netcdf(temporary, engine=_ENGINE)


@contextlib.contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[str]:
    """A temporary name beside `path`; what was written there takes its place if all went well, else it is removed."""
    name = os.fspath(path)
    claim(name)
    temporary = os.path.join(os.path.dirname(name) or ".", f".{os.path.basename(name)}.{os.getpid()}.part")
    try:
        yield temporary
        os.replace(temporary, name)
    except OSError as error:
        raise InputError(f"cannot write {name!r}: {(error.strerror or str(error)).lower()}") from None
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)


def claim(path: str | os.PathLike[str]) -> None:
    """Refuse a file that could not be written, before any work is done for it.

    Raises
    ------
    InputError
        If its folder is missing or closed to writing, or it is a folder itself.
    """
    name = os.fspath(path)
    folder = os.path.dirname(name) or "."
    if os.path.isdir(name) or not os.path.basename(name):
        raise InputError(f"cannot write {name!r}: it is a folder")
    if not os.path.isdir(folder):
        raise InputError(f"cannot write {name!r}: there is no folder {folder!r}")
    _probe(folder, name)


def claim_folder(path: str | os.PathLike[str]) -> None:
    """Refuse a folder that could not be made or written into, before any work is done for it; nothing is made yet.

    Raises
    ------
    InputError
        If it is a file, or it, or the nearest folder above it that exists, is closed to writing.
    """
    name = os.fspath(path)
    place = os.path.abspath(name)
    while not os.path.lexists(place):
        place = os.path.dirname(place)
    if not os.path.isdir(place):
        raise InputError(f"cannot write into {name!r}: {os.path.relpath(place)!r} is not a folder")
    _probe(place, name)


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make a folder if need be.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write into {os.fspath(path)!r}: {(error.strerror or str(error)).lower()}") from None


def _probe(folder: str, name: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write {name!r}: {(error.strerror or str(error)).lower()}") from None
