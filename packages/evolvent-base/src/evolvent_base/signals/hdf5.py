"""HDF5 files, and MAT files of version 7.3, which are HDF5: numbers and texts in groups."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np

from evolvent_base import safe_open
from evolvent_base.signals.statements import is_statement
from evolvent_base.signals.trees import Path, Tree

if TYPE_CHECKING:
    import h5py
else:
    h5py = lazy.load("h5py")

#: Levels of cells and structs that refer to others, at most, and texts of a data set that are read.
_DEEPEST, _MOST = 32, 10_000
_ATTRIBUTES = ("unit", "units", "label")


def read(raw: bytes, name: str, *, of_matlab: bool) -> Tree:
    """All numbers and texts of a file.

    Raises
    ------
    InputError
        If the file is not whole in itself: see `evolvent_base.safe_open.check_hdf5`.
    """
    safe_open.check_hdf5(io.BytesIO(raw), name)
    with h5py.File(io.BytesIO(raw), "r") as file:
        reader = _Reader(file, of_matlab=of_matlab)
        reader.attributes(file, ())
        file.visititems(reader.visit)
        return Tree(reader.leaves, reader.others, reader.scales, "." if of_matlab else "/")


class _Reader:
    def __init__(self, file: Any, *, of_matlab: bool) -> None:
        self.file, self.of_matlab = file, of_matlab
        self.leaves: dict[Path, np.ndarray | tuple[str, ...]] = {}
        self.others: dict[str, str] = {}
        self.scales: dict[Path, dict[int, Path]] = {}
        self.count = 0

    def visit(self, key: str, item: Any) -> None:
        """Keep what one name of the file stands for."""
        path = tuple(key.split("/"))
        if path[0].startswith("#"):
            return  # what cells and structs of MATLAB refer to
        self.attributes(item, path)
        self.item(item, path, 0)

    def attributes(self, item: Any, path: Path) -> None:
        """Keep attributes that state a rate, a start or a unit."""
        for key in item.attrs:
            if key.lower() not in _ATTRIBUTES and not is_statement(key):
                continue
            value = item.attrs[key]
            lowered = "units" if key.lower() == "unit" else key
            if isinstance(value, (str, bytes)):
                self.leaves[*path, lowered] = (_text(value),)
            elif np.size(value) == 1 and np.asarray(value).dtype.kind in "biufSUO":
                one = np.asarray(value).ravel()[0]
                self.leaves[*path, lowered] = (_text(one),) if isinstance(one, (str, bytes)) else np.asarray(one)

    def item(self, item: Any, path: Path, deep: int) -> None:
        """Keep a data set; of a group, its data sets are visited themselves."""
        self.count += 1
        if not isinstance(item, h5py.Dataset) or item.shape is None or deep > _DEEPEST or self.count > 10 * _MOST:
            return
        class_ = _text(item.attrs.get("MATLAB_class", "")) if self.of_matlab else ""
        if "MATLAB_empty" in item.attrs and self.of_matlab:
            return
        if "MATLAB_object_decode" in item.attrs and self.of_matlab:
            self.others[".".join(path)] = f"an object of the class {class_!r}"
        elif h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            if self.of_matlab and item.size <= _MOST:
                self._references(item, path, class_, deep)
        elif class_ == "char":
            rows = np.atleast_2d(np.asarray(item[()]).T)
            if item.size <= _MOST:
                self.leaves[path] = tuple("".join(map(chr, row)).rstrip(" \0") for row in rows)
        elif item.dtype.kind in "biufc":
            value = np.asarray(item[()])
            self.leaves[path] = value.T if self.of_matlab else value
            self.scales[path] = dict(self._scales(item))
        elif item.dtype.kind == "V" and item.dtype.names:
            table = item[()]
            for field in item.dtype.names:
                self.leaves[*path, field] = np.asarray(table[field])
        elif item.dtype.kind in "SO" and len(item.shape) <= 1 and item.size <= _MOST:
            self.leaves[path] = tuple(map(_text, np.atleast_1d(np.asarray(item[()]))))

    def _scales(self, item: Any) -> Iterator[tuple[int, Path]]:
        """The data sets that the file states for axes."""
        if "DIMENSION_LIST" not in item.attrs:
            return
        for axis, dimension in enumerate(item.dims):
            if len(dimension):
                yield axis, tuple(dimension[0].name.strip("/").split("/"))

    def _references(self, item: Any, path: Path, class_: str, deep: int) -> None:
        """Keep what the cells of MATLAB, or the field of an array of structs, refer to."""
        signs = ("{", "}") if class_ == "cell" else ("(", ")")
        texts: list[tuple[Path, str]] = []
        references = np.asarray(item[()]).T.ravel(order="F")
        where = -1 if class_ == "cell" else -2
        for k, reference in enumerate(references):
            if not reference:
                continue
            own = list(path)
            if len(references) > 1 and len(path) >= -where:
                own[where] = f"{own[where]}{signs[0]}{k + 1}{signs[1]}"
            target = self.file[reference]
            self._branch(target, tuple(own), deep + 1)
            found = self.leaves.get(tuple(own))
            if isinstance(found, tuple) and len(found) <= 1:
                texts.append((tuple(own), found[0] if found else ""))
        if class_ == "cell" and texts and len(texts) == len(references):
            for own_path, _ in texts:
                del self.leaves[own_path]
            self.leaves[path] = tuple(text for _, text in texts)

    def _branch(self, item: Any, path: Path, deep: int) -> None:
        """Keep a data set, or all of a group, that is referred to."""
        if isinstance(item, h5py.Group) and deep <= _DEEPEST and self.count <= 10 * _MOST:
            for key, one in item.items():
                self._branch(one, (*path, key), deep + 1)
        else:
            self.item(item, path, deep)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
