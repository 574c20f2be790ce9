"""The folder of a study: what it is, a log of finished batches that survives any end of the process, the results.

========================  ======================================================================================
``study.json``            name, hashes of cases and sources, versions; written once, whole
``study.yaml``            the study with its whole case; it can be swept again
``cases.sqlite``          finished batches (`evolvent.design.evaluator.log`); open to one process at a time
``results.zarr``          the labelled results, there once every case is
``stages``                runs of the stages of every case, ``000012-wind.nc``, where the study has stages
========================  ======================================================================================
"""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import shutil
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy

from evolvent import results
from evolvent.design.evaluator.log import Log
from evolvent.design.evaluator.sources import sources, versions
from evolvent.design.studies.study import Study
from evolvent_base import files, locks, safe_open
from evolvent_base.errors import InputError, reason_of

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

RESULTS = "results.zarr"
_MANIFEST, _STUDY, _LOG = "study.json", "study.yaml", "cases.sqlite"
#: What to do with results that cannot be read.
_AGAIN = "remove it and sweep the study again, which writes it from the cases that are kept"


def write(folder: str | os.PathLike[str], dataset: Any) -> None:
    """Write the results into a study's folder, whole or not at all.

    Raises
    ------
    InputError
        If they cannot be written.
    """
    target, temporary = (pathlib.Path(folder) / name for name in (RESULTS, f"{RESULTS}.part"))
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        dataset = dataset.assign_attrs({results.DIGEST: results.digest(dataset)})
        # a file lists coordinates by their names, parted by blanks; `read` makes those with a blank in it again
        dataset = dataset.reset_coords([c for c in dataset.coords if " " in str(c) and c not in dataset.dims])
        dataset.to_zarr(temporary, mode="w", zarr_format=2, consolidated=True, write_empty_chunks=True)
        os.replace(temporary, target)
        _sync(target.parent)
    except OSError as error:
        shutil.rmtree(temporary, ignore_errors=True)
        raise InputError(f"cannot write {str(target)!r}: {reason_of(error)}") from None


@contextlib.contextmanager
def opened(folder: str | os.PathLike[str], study: Study) -> Iterator[Log]:
    """The log of a study in `folder`: a new one, or one of the very same study, which is then continued.

    Raises
    ------
    InputError
        If the folder holds something else, belongs to another study, or another process works in it.
    """
    place = pathlib.Path(folder)
    files.check_writable_folder(place)
    manifest = {"study": study.name, "cases": study.count, "versions": versions()}
    manifest["hashes"] = {**study.digests, "sources": sources()}
    existing = os.listdir(place) if place.is_dir() else []
    strange = InputError(f"the folder {str(place)!r} holds other files and no study; give another one with -o")
    if _MANIFEST not in existing and any(n != _STUDY and not n.startswith((".", _LOG)) for n in existing):
        raise strange
    files.make_folder(place)
    with contextlib.closing(Log(place / _LOG)) as log:
        if _MANIFEST in existing:
            _compare(place, _manifest(place), manifest)
        elif log.found:
            raise strange
        else:
            _write_text(place / _STUDY, study.text)
            _write_text(place / _MANIFEST, json.dumps(manifest, indent=2) + "\n")
        _sync(place)
        yield log


def finished_cases(folder: str | os.PathLike[str]) -> int:
    """Number of cases that a study's folder keeps."""
    place = pathlib.Path(folder) / _LOG
    if not place.exists():
        return 0
    with contextlib.closing(Log(place)) as log:
        return log.done


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
def locked_file(file: Any, place: pathlib.Path) -> Iterator[None]:
    """Lock a file that is open; `place` is the folder that a message names."""
    try:
        is_ours = locks.is_locked_now(file)
    except OSError:
        is_ours = False
    if not is_ours:
        raise InputError(f"another process works in {str(place)!r}; wait for it, or give another folder")
    yield
