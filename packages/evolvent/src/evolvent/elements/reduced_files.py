"""Files of reduced models: archives of NumPy, text in JSON, and files of Nastran."""

from __future__ import annotations

import io
import json
import math
import pathlib
import zipfile
from typing import IO, Any

import numpy as np

from evolvent.elements import nastran
from evolvent.elements.reduced_models import ReducedModel, check_model
from evolvent_base import files, safe_open
from evolvent_base.errors import InputError, nearest

#: Keys of a file: names, and whether it must have them.
KEYS = {
    "stiffness": True, "mass": True, "positions": True, "names": False, "recovery": False, "recovery_names": False,
    "recovery_units": False, "warning": False,
}  # fmt: skip
_TEXTS = ("names", "recovery_names", "recovery_units", "warning")
#: Folder of the models that are shipped.
SHIPPED = pathlib.Path(__file__).parent / "models"
#: Endings of files that are read.
ENDINGS = (".npz", ".json")
READ = (*ENDINGS, *nastran.ENDINGS)


def read_model(path: str, length: float = 1.0, mass: float = 1.0, bulk: str | None = None) -> ReducedModel:
    """A reduced model of a file.

    Parameters
    ----------
    path : str, ending with .npz (an archive of `numpy.savez`) or .json (an object of lists), with the keys `KEYS`; a
        file of Nastran (`evolvent.elements.nastran`); or the name of a model that is shipped, without an ending:
        solar-panel
    bulk : str, optional; bulk data with the points of Nastran's matrices
    length, mass : float, m and kg, units in which the file is written

    Raises
    ------
    InputError
        Where the file cannot be read, or holds no model of a free body; one sentence.
    """
    ending = pathlib.Path(path).suffix.lower()
    if not ending and path in shipped_models():
        path, ending = str(SHIPPED / f"{path}.npz"), ".npz"
    if ending not in READ:
        raise InputError(
            f"{path!r} is no file of a reduced model; it must end with {', '.join(READ[:-1])} or {READ[-1]}, or be a "
            f"shipped one: {', '.join(shipped_models())}"
        )
    if ending in nastran.ENDINGS:
        model = nastran.read_nastran(path, bulk)
        check_model(model, repr(path))
        return model.scaled(length, mass)
    if bulk is not None:
        raise InputError(f"bulk is {bulk!r}, but {path!r} is no file of Nastran; leave bulk out")
    found = _archive(path) if ending == ".npz" else _text(path)
    for key in found:
        if key not in KEYS:
            raise InputError(f"{path!r} has the key {key!r}; {nearest(key, KEYS)}")
    for key, needed in KEYS.items():
        if needed and key not in found:
            raise InputError(f"{path!r} has no key {key!r}, which a reduced model needs")
    numbers = {key: _numbers(path, key, found[key]) for key in KEYS if key in found and key not in _TEXTS}
    texts = {key: tuple(str(one) for one in np.ravel(found.get(key, ()))) for key in _TEXTS}
    size = len(np.atleast_1d(numbers["stiffness"]))
    recovery = numbers.get("recovery", np.zeros((0, size)))
    nodes, results = len(np.atleast_1d(numbers["positions"])), len(np.atleast_1d(recovery))
    _check_texts(path, texts, nodes, results)
    model = ReducedModel(
        numbers["stiffness"], numbers["mass"], numbers["positions"],
        texts["names"] or tuple(f"node{k}" for k in range(nodes)), recovery,
        texts["recovery_names"] or tuple(f"result{k}" for k in range(results)),
        texts["recovery_units"] or ("1",) * results, "; ".join(texts["warning"]),
    )  # fmt: skip
    check_model(model, repr(path))
    return model.scaled(length, mass)


def files_read(path: str) -> list[str]:
    """Paths of the files that `read_model` reads for a path: of Nastran also those beside it."""
    if path in shipped_models():
        return [str(SHIPPED / f"{path}.npz")]
    return [path, *nastran.beside(path)] if path.lower().endswith(nastran.ENDINGS) else [path]


def shipped_models() -> list[str]:
    """Names of the models that are shipped."""
    return sorted(path.stem for path in SHIPPED.glob("*.npz"))


def write_model(path: str, model: ReducedModel) -> None:
    """Write a reduced model as a file that `read_model` reads, in SI units."""
    content: dict[str, Any] = {key: getattr(model, key) for key in KEYS if key != "warning" or model.warning}
    if not len(model.recovery):
        content = {key: value for key, value in content.items() if not key.startswith("recovery")}
    if path.lower().endswith(".npz"):
        arrays: dict[str, Any] = {key: np.array(value) for key, value in content.items()}
        packed = io.BytesIO()
        np.savez_compressed(packed, **arrays)
        files.write_file(path, packed.getvalue())
        return
    if not path.lower().endswith(".json"):
        raise InputError(f"{path!r} is no file of a reduced model; it must end with {' or '.join(ENDINGS)}")
    lists = {key: np.array(value).tolist() for key, value in content.items()}
    files.write_file(path, json.dumps(lists, indent=1) + "\n")


def _archive(path: str) -> dict[str, Any]:
    raw = safe_open.content(path)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            safe_open.check_declared(sum(entry.file_size for entry in archive.infolist()), len(raw), path)
            for entry in archive.infolist():
                with archive.open(entry) as file:
                    _check_head(file, entry.file_size)
        with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
            return {key: arrays[key] for key in arrays.files}
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001  (each compression and kind of head has its own)
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"cannot read {path!r}: it is no archive of NumPy ({why})") from None


def _check_head(file: IO[bytes], size: int) -> None:
    """Refuse an array whose head states more numbers than its file of `size` bytes has."""
    form = np.lib.format
    head = {(1, 0): form.read_array_header_1_0, (2, 0): form.read_array_header_2_0}.get(form.read_magic(file))
    if head is None:
        raise ValueError("an array of an unknown version")
    shape, _, kind = head(file)
    if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize > size:
        raise ValueError(f"an array of the shape {shape} in {size} bytes")


def _text(path: str) -> dict[str, Any]:
    try:
        found = json.loads(safe_open.text(path))
    except (ValueError, RecursionError) as error:  # of numbers of very many digits as well
        raise InputError(f"cannot read {path!r}: {error}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path!r} is no object of JSON; it must have the keys {', '.join(KEYS)}")
    return found


def _numbers(path: str, key: str, value: Any) -> np.ndarray:
    try:
        if isinstance(value, np.ndarray) and np.iscomplexobj(value):
            return nastran.real(value, repr(path), key)
        return np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path!r}: {key} is no array of real numbers") from None


def _check_texts(path: str, texts: dict[str, tuple[str, ...]], nodes: int, results: int) -> None:
    """Refuse names that are not one for each node or result, or not unique."""
    for key, found in texts.items():
        if key == "warning":
            continue
        wanted = nodes if key == "names" else results
        if found and len(found) != wanted:
            raise InputError(f"{path!r}: {key} has {len(found)} entries; it must have {wanted}")
        if key != "recovery_units" and len(set(found)) < len(found):
            raise InputError(f"{path!r}: {key} has one name twice; they must differ")
