"""The folder of a study: what it is, a log of finished batches that survives any end of the process, the results.

========================  ======================================================================================
``study.json``            name, hashes of cases and sources, versions; written once, whole
``study.yaml``            the study with its whole case; it can be swept again
``cases.log``             finished batches, one record each: size, hash, bytes of `record.encode`; only ever appended
``results.zarr``          the labelled results, there once every case is
``stages``                runs of the stages of every case, ``000012-wind.nc``, where the study has stages
``lock``                  held by the process that works here
========================  ======================================================================================
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import json
import os
import pathlib
import platform
import shutil
import struct
import sys
from collections.abc import Iterator
from typing import Any

import evolvent
from evolvent import cases, results
from evolvent.base import file_keys, files, locks, packages, plugins, safe_open
from evolvent.base.errors import InputError, reason_of
from evolvent.design.studies import record
from evolvent.design.studies.study import Study
from evolvent.parts import registry

RESULTS = "results.zarr"
_MANIFEST, _STUDY, _LOG, _LOCK = "study.json", "study.yaml", "cases.log", "lock"
#: What to do with results that cannot be read.
_AGAIN = "remove it and sweep the study again, which writes it from the cases that are kept"
_HEAD = struct.Struct("<4sQ32s")
_MAGIC = b"evc1"
#: What the results of runs cannot depend on: pictures, the command, what is evaluated of them.
_NOT_SOURCES = (
    "evolvent_studio/",
    "evolvent_cosim/",
    "evolvent/commands/",
    "evolvent/view/",
    "evolvent/analysis/accessor.py",
    "evolvent/results/figures.py",
    "evolvent/results/solids.py",
    "evolvent/design/studies/draw.py",
    "evolvent/design/studies/accessor.py",
    "evolvent/design/dispersions/",
    "evolvent_massprops/commands/",
    "evolvent_papers/commands/",
    "evolvent_papers/papers/",
    "evolvent_papers/laboratory/",
)


@functools.cache
def sources() -> str:
    """Hash of all sources that results depend on: of evolvent, and of packages outside that add systems and parts."""
    digest = hashlib.sha256()
    for package, folder in packages.folders().items():
        for path in sorted(folder.rglob("*.py")):
            name = f"{package}/{path.relative_to(folder).as_posix()}"
            if not name.startswith(_NOT_SOURCES):
                digest.update(name.encode() + b"\0" + path.read_bytes())
    for group in (cases.GROUP, registry.GROUP):
        for point in plugins.outside(group):
            for label, path in plugins.files_of(point):
                digest.update(label.encode() + b"\0" + file_keys.digest(str(path)).encode())
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of what computes; also of packages outside that add systems and parts."""
    found = {"evolvent": evolvent.__version__, "python": platform.python_version()}
    for group in (cases.GROUP, registry.GROUP):
        added = [point.dist for point in plugins.outside(group) if point.dist is not None]
        found |= {package.name: package.version for package in added}
    return found | {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "numba")}


class Store:
    """A study's folder, while one process works in it.

    Attributes
    ----------
    folder : Path
    study : Study
    found : int, number of cases that were there already
    torn : int, bytes of an unfinished record that were cut off the log
    rows : list of record.Table, of the cases that are done
    """

    def __init__(self, folder: pathlib.Path, study: Study, log: Any, rows: list[record.Table], torn: int) -> None:
        self.folder, self.study, self.rows, self.torn = folder, study, rows, torn
        self._log = log
        self.found = self.done

    @property
    def done(self) -> int:
        """Number of cases that are done."""
        return sum(len(rows.cases) for rows in self.rows)

    @property
    def failed(self) -> list[tuple[int, str]]:
        """Cases that failed, with their reasons."""
        rows = [(r.cases, r.status, r.reason) for r in self.rows]
        return sorted((c, why) for cs, ss, ws in rows for c, s, why in zip(cs, ss, ws, strict=True) if s == "failed")

    @property
    def complete(self) -> bool:
        """Whether the results are written."""
        return (self.folder / RESULTS).exists()

    def pending(self) -> list[int]:
        """Cases that are still to be computed."""
        done = {case for rows in self.rows for case in rows.cases}
        return [case for case in range(self.study.count) if case not in done]

    def append(self, content: bytes) -> record.Table:
        """Keep a finished batch for good."""
        rows = record.decode(content)
        number = self._log.fileno()
        before = os.fstat(number).st_size
        left = memoryview(_HEAD.pack(_MAGIC, len(content), hashlib.sha256(content).digest()) + content)
        try:
            while left:  # without a buffer, which would be written again as the file is closed
                left = left[os.write(number, left) :]
            os.fsync(number)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(number, before)
            raise InputError(f"cannot write {str(self.folder / _LOG)!r}: {reason_of(error)}") from None
        self.rows.append(rows)
        return rows

    def write(self, dataset: Any) -> None:
        """Write the results, whole or not at all."""
        target = self.folder / RESULTS
        temporary = self.folder / f"{RESULTS}.part"
        shutil.rmtree(temporary, ignore_errors=True)
        try:
            dataset = dataset.assign_attrs({results.DIGEST: results.digest(dataset)})
            # a file lists coordinates by their names, parted by blanks; `read` makes those with a blank in it again
            dataset = dataset.reset_coords([c for c in dataset.coords if " " in str(c) and c not in dataset.dims])
            dataset.to_zarr(temporary, mode="w", zarr_format=2, consolidated=True, write_empty_chunks=True)
            os.replace(temporary, target)
            _sync(self.folder)
        except OSError as error:
            shutil.rmtree(temporary, ignore_errors=True)
            raise InputError(f"cannot write {str(target)!r}: {reason_of(error)}") from None


@contextlib.contextmanager
def opened(folder: str | os.PathLike[str], study: Study) -> Iterator[Store]:
    """The store of a study in `folder`: a new one, or one of the very same study, which is then continued.

    Raises
    ------
    InputError
        If the folder holds something else, belongs to another study, or another process works in it.
    """
    place = pathlib.Path(folder)
    files.check_writable_folder(place)
    manifest = {"study": study.name, "cases": study.count, "versions": versions()}
    manifest["hashes"] = {**study.digests, "sources": sources()}
    existing = sorted(set(os.listdir(place)) - {_LOCK}) if place.is_dir() else []
    if _MANIFEST not in existing and [n for n in existing if n != _STUDY and not n.startswith(".")]:
        raise InputError(f"the folder {str(place)!r} holds other files and no study; give another one with -o")
    files.make_folder(place)
    with locked(place):
        if _MANIFEST in existing:
            _compare(place, _manifest(place), manifest)
        else:
            _write_text(place / _STUDY, study.text)
            _write_text(place / _MANIFEST, json.dumps(manifest, indent=2) + "\n")
        try:
            log = (place / _LOG).open("a+b")
        except OSError as error:
            raise InputError(f"cannot write {str(place / _LOG)!r}: {reason_of(error)}") from None
        with log:
            _sync(place)
            rows, torn = _read_log(log)
            yield Store(place, study, log, rows, torn)


def finished_cases(folder: str | os.PathLike[str]) -> int:
    """Number of cases that a study's folder keeps."""
    try:
        with (pathlib.Path(folder) / _LOG).open("r+b") as log:
            return sum(len(rows.cases) for rows in _read_log(log)[0])
    except OSError:
        return 0


def _read_log(log: Any) -> tuple[list[record.Table], int]:
    """All whole records; what follows them is cut off."""
    whole = log.seek(0, os.SEEK_END)
    log.seek(0)
    rows: list[record.Table] = []
    seen: set[int] = set()
    good = 0
    while True:
        head = log.read(_HEAD.size)
        if len(head) < _HEAD.size:
            break
        magic, size, digest = _HEAD.unpack(head)
        content = log.read(size) if magic == _MAGIC and size <= whole else b""
        if len(content) < size or hashlib.sha256(content).digest() != digest:
            break
        good = log.tell()
        found = record.decode(content)
        if not seen.intersection(found.cases):  # a log that was copied behind itself holds them twice
            rows.append(found)
            seen.update(found.cases)
    torn = whole - good
    if torn:
        log.truncate(good)
        os.fsync(log.fileno())
    return rows, torn


def _manifest(place: pathlib.Path) -> dict[str, Any]:
    """What a folder says about its study."""
    try:
        found = json.loads(safe_open.text(place / _MANIFEST))
    except (ValueError, RecursionError):
        found = None
    kinds = {"study": str, "cases": int, "versions": dict, "hashes": dict}
    if isinstance(found, dict) and all(isinstance(found.get(key), kind) for key, kind in kinds.items()):
        return found
    raise InputError(f"cannot read {str(place / _MANIFEST)!r}: it does not describe a study")


def _compare(place: pathlib.Path, there: dict[str, Any], here: dict[str, Any]) -> None:
    """Refuse to mix two studies in one folder."""
    differ = [name for name, value in here["hashes"].items() if there["hashes"].get(name) != value]
    for name, version in here["versions"].items():
        if there["versions"].get(name) != version:
            differ.append(f"{name} ({there['versions'].get(name)} there, {version} here)")
    if differ:
        raise InputError(
            f"the folder {str(place)!r} holds the study {there['study']!r} with other {' and '.join(differ)}; give "
            f"another folder with -o, or remove this one"
        )


def read(folder: str | os.PathLike[str]) -> Any:
    """The results in a study's folder; see `evolvent.design.studies.open`."""
    import xarray as xr

    place = pathlib.Path(folder)
    if not place.is_dir():
        raise InputError(f"cannot read {str(place)!r}: there is no such folder")
    if not (place / _MANIFEST).exists():
        raise InputError(f"cannot read {str(place)!r}: it is not the folder of a study")
    count = _manifest(place)["cases"]
    if not (place / RESULTS).exists():
        raise InputError(f"the study in {str(place)!r} is not finished; sweep it again to compute the rest of {count}")
    try:
        safe_open.check_zarr(place / RESULTS)
        with xr.open_dataset(place / RESULTS, engine="zarr", chunks=None, decode_times=False) as dataset:
            found = dataset.load()
            digest = results.digest(found)
    except InputError as error:
        raise InputError(f"{error}; {_AGAIN}") from None
    except Exception:  # noqa: BLE001  (the back end raises many kinds of errors on a damaged store)
        raise InputError(f"cannot read {str(place / RESULTS)!r}: it is damaged; {_AGAIN}") from None
    if found.attrs.pop(results.DIGEST, None) != digest:
        raise InputError(f"cannot read {str(place / RESULTS)!r}: its values were altered; {_AGAIN}")
    return found.set_coords([key for key in json.loads(found.attrs["keys"]) if key in found.data_vars])


def _write_text(path: pathlib.Path, content: str) -> None:
    files.write_file(path, content)
    try:
        _sync(path.parent)
    except OSError as error:
        raise InputError(f"cannot write {str(path)!r}: {reason_of(error)}") from None


def _sync(folder: pathlib.Path) -> None:
    """Make names in a folder durable, where the system can."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def locked(place: pathlib.Path) -> Iterator[None]:
    """Keep every other process out; the lock goes with the process."""
    try:
        file = (place / _LOCK).open("a+b")
    except OSError as error:
        raise InputError(f"cannot write {str(place / _LOCK)!r}: {reason_of(error)}") from None
    with file, locked_file(file, place):
        yield


@contextlib.contextmanager
def locked_file(file: Any, place: pathlib.Path) -> Iterator[None]:
    """Lock a file that is open; `place` is the folder that a message names."""
    try:
        is_ours = locks.is_locked_now(file)
    except OSError:
        is_ours = False
    if not is_ours:
        raise InputError(f"another process works in {str(place)!r}; wait for it, or give another folder")
    yield
