"""Files that others wrote, opened so that they can neither reach other files nor fill the memory.

Every reader of the package opens its files here. HDF5 and NetCDF files and Zarr stores pass an allow-list first: all
values lie in the file or store itself, and their declared sizes fit its size.
"""

from __future__ import annotations

import itertools
import json
import math
import operator
import os
import pathlib
import stat
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

from evolvent_base import packages
from evolvent_base.errors import InputError, counted, reason_of

#: Environment variable with the most bytes of values that one file may hold, and what it is if not set.
VARIABLE, LARGEST = "EVOLVENT_LARGEST_FILE", 8_000_000_000
#: Environment variable with a folder: where it is set, a process and those that it starts open files in it alone, and
#: those of the package.
ONLY_BELOW = "EVOLVENT_ONLY_BELOW"
#: Values beside the bytes that hold them, at most, in files above `SMALL` bytes of values.
RATIO, SMALL = 100, 256_000_000
#: Largest text file, bytes.
LARGEST_TEXT = 5_000_000
#: Objects of an HDF5 file, and levels of groups, at most.
_MOST_OBJECTS, _DEEPEST = 100_000, 32
#: Texts of an attribute that are read without a look at their lengths, each of which may be that of the file.
_FEW_TEXTS = 64
#: Bytes that are read at a time beyond the size that the system states.
_BLOCK = 1 << 20
#: Filters of HDF5 that the library has itself: deflate, shuffle, Fletcher, szip, n-bit, scale-offset, LZF.
_FILTERS = (1, 2, 3, 4, 5, 6, 32000)
#: Codecs of Zarr arrays that read numbers and texts alone; a pickle is none of them.
_CODECS = ("blosc", "bz2", "crc32", "delta", "gzip", "lz4", "lzma", "shuffle", "vlen-utf8", "zlib", "zstd")


# ------------------------------------------------------------------------------------------------ any file


def binary(path: str | os.PathLike[str], *, links: bool = True) -> BinaryIO:
    """A regular file, open for reading bytes.

    Parameters
    ----------
    path : str
    links : bool, whether the last part of the path may be a symbolic link

    Raises
    ------
    InputError
        If it is missing, closed to reading, not a regular file, or not in the folder of `ONLY_BELOW`.
    """
    name = os.fspath(path)
    below = os.environ.get(ONLY_BELOW)
    try:
        if below:
            real = pathlib.Path(os.path.realpath(name))
            if not any(
                real.is_relative_to(one)
                for one in (os.path.realpath(below), *map(os.path.realpath, packages.folders().values()))
            ):
                raise InputError(f"cannot read {_short(name)}: it is outside the folder {_short(below)}")
        if os.path.isdir(name):
            raise InputError(f"cannot read {_short(name)}: it is a folder")
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        number = os.open(name, flags if links else flags | getattr(os, "O_NOFOLLOW", 0))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot read {_short(name)}: {reason.lower()}") from None
    if not stat.S_ISREG(os.fstat(number).st_mode):
        os.close(number)
        raise InputError(f"cannot read {_short(name)}: it is not a regular file")
    return os.fdopen(number, "rb")


def content(path: str | os.PathLike[str], *, most: int | None = None) -> bytes:
    """All bytes of a regular file.

    Raises
    ------
    InputError
        If it cannot be read, or holds more than `most` bytes (left out, `largest`).
    """
    limit = largest() if most is None else most
    with binary(path) as file:
        check_size(os.fstat(file.fileno()).st_size, limit, os.fspath(path), raised=most is None)
        try:
            found = read_most(file, limit)
        except OSError as error:
            raise InputError(f"cannot read {_short(os.fspath(path))}: {reason_of(error)}") from None
    check_size(len(found), limit, os.fspath(path), raised=most is None)
    return found


def read_most(file: BinaryIO, most: int) -> bytes:
    """The rest of an open file, up to `most` bytes and one more; takes the memory of what is there, not of `most`."""
    pieces = [file.read(min(os.fstat(file.fileno()).st_size, most) + 1)]
    left = most + 1 - len(pieces[0])
    while left > 0 and pieces[-1]:  # a file that grows, or of /proc, whose size is 0
        pieces.append(file.read(min(left, _BLOCK)))
        left -= len(pieces[-1])
    return pieces[0] if len(pieces) <= 2 and not pieces[-1] else b"".join(pieces)


def text(path: str | os.PathLike[str]) -> str:
    """A text file in UTF-8, of `LARGEST_TEXT` bytes at most.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        return content(path, most=LARGEST_TEXT).decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InputError(f"cannot read {_short(os.fspath(path))}: it is not a text file") from None


def largest() -> int:
    """Bytes of values that one file may hold at most: `LARGEST`, or what the environment says."""
    given = os.environ.get(VARIABLE, "")
    if not given:
        return LARGEST
    try:
        found = float(given)
    except ValueError:
        found = math.nan
    if not 1.0 <= found < 1e18:
        raise InputError(f"the environment variable {VARIABLE} is {given[:40]!r}; it must be a number of bytes")
    return int(found)


def check_size(size: int, limit: int, name: str, *, raised: bool = True) -> None:
    """Refuse a file of too many bytes."""
    if size > limit:
        hint = f" ({VARIABLE} raises this)" if raised else ""
        raise InputError(f"cannot read {_short(name)}: it has {_bytes(size)}; at most {_bytes(limit)} are read{hint}")


def check_declared(declared: int, stored: int, name: str) -> None:
    """Refuse a file whose values would take far more memory than the file has bytes.

    Parameters
    ----------
    declared : bytes of all values, decompressed
    stored : bytes of the file
    """
    limit = min(largest(), max(SMALL, RATIO * stored))
    if declared > limit:
        raise InputError(
            f"cannot read {_short(name)}: its values would take {_bytes(declared)}; of a file of {_bytes(stored)} "
            f"{_bytes(limit)} are read at most" + (f" ({VARIABLE} raises this)" if limit == largest() else "")
        )


def _bytes(size: float) -> str:
    for factor, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return counted(int(size), "byte")


def _short(name: str) -> str:
    return repr(name if len(name) <= 200 else f"{name[:40]}...")


# ------------------------------------------------------------------------------------------------ HDF5


def check_hdf5(file: BinaryIO, name: str) -> None:
    """Refuse an HDF5 or NetCDF file that is not whole in itself; no link is followed.

    All links are hard, no group has two parents, all data sets are compact, contiguous or in chunks in the file
    itself, their filters are those of the HDF5 library, and all values and texts fit `check_declared`.

    Parameters
    ----------
    file : open for reading bytes; left at its start
    name : str, for messages

    Raises
    ------
    InputError
    """
    import h5py  # cases are read without it

    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    try:
        with h5py.File(file, "r") as opened:
            _Hdf5(name, size).check(h5py.h5g.open(opened.id, b"/"))
    except InputError:
        raise
    except Exception:  # noqa: BLE001  (the library raises many kinds of errors on a damaged file)
        kind = "a NetCDF" if name.endswith(".nc") else "an HDF5"
        raise InputError(f"cannot read {_short(name)}: it is not {kind} file, or it is damaged") from None
    file.seek(0)


class _Hdf5:
    """What `check_hdf5` has seen of a file of `size` bytes, and the bytes that its values and texts take."""

    def __init__(self, name: str, size: int) -> None:
        self.name, self.size, self.declared = name, size, 0

    def check(self, root: Any) -> None:
        """Go through all objects that hard links reach."""
        from h5py import h5d, h5g, h5o  # cases are read without it

        groups, waiting, count = {h5o.get_info(root).addr}, [(root, "", 0)], 0
        self._attributes(root)
        while waiting:
            group, path, deep = waiting.pop()
            count += len(group)
            if count > _MOST_OBJECTS:
                raise self._error(f"it holds more than {_MOST_OBJECTS} groups and data sets")
            for key in list(group):
                place = f"{path}/{key.decode('utf-8', 'replace')}"
                self._link(group.links.get_info(key).type, place)
                item = h5o.open(group, key)
                if isinstance(item, h5g.GroupID):
                    address = h5o.get_info(item).addr
                    if address in groups:
                        raise self._error(f"the group {_short(place)} has two parents")
                    if deep >= _DEEPEST:
                        raise self._error(f"its groups are nested more than {_DEEPEST} levels deep")
                    groups.add(address)
                    waiting.append((item, place, deep + 1))
                elif isinstance(item, h5d.DatasetID):
                    self._data_set(item, place)
                self._attributes(item)

    def _error(self, why: str) -> InputError:
        return InputError(f"cannot read {_short(self.name)}: {why}")

    def _add(self, count: int) -> None:
        self.declared += count
        check_declared(self.declared, self.size, self.name)

    def _link(self, kind: int, place: str) -> None:
        """Refuse a link that is not hard."""
        from h5py import h5l  # cases are read without it

        if kind != h5l.TYPE_HARD:
            what = {h5l.TYPE_SOFT: "a soft link", h5l.TYPE_EXTERNAL: "a link into another file"}
            raise self._error(
                f"{_short(place)} is {what.get(kind, 'a link of an unknown kind')}, which is not followed"
            )

    def _data_set(self, item: Any, place: str) -> None:
        """Refuse a data set whose values lie elsewhere, are decoded by a plug-in, or would fill the memory."""
        import h5py  # cases are read without it
        from h5py import h5d  # cases are read without it

        layout = item.get_create_plist()  # looks into no other file, as the shape of a virtual data set does
        kind = layout.get_layout()
        if kind == h5d.VIRTUAL or (kind == h5d.CONTIGUOUS and layout.get_external_count()):
            raise self._error(f"the data set {_short(place)} takes its values from other files, which are not opened")
        if kind not in (h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED):
            raise self._error(f"the data set {_short(place)} is stored in an unknown way")
        filters = [layout.get_filter(k)[0] for k in range(layout.get_nfilters())]
        if any(one not in _FILTERS for one in filters):
            raise self._error(f"the data set {_short(place)} is compressed by a plug-in of HDF5, which is not loaded")
        type_, shape = item.get_type(), item.shape or ()
        count = math.prod(shape)
        if kind == h5d.CHUNKED:
            self._add(max(math.prod(layout.get_chunk()) * type_.get_size() - SMALL, 0))
        self._add(count * type_.get_size())
        if not _varies(type_):
            return
        if not isinstance(type_, h5py.h5t.TypeStringID) or len(shape) > 1 or count > _MOST_OBJECTS:
            raise self._error(f"the data set {_short(place)} holds lists or texts of varying lengths in an unknown way")
        texts, block = h5py.Dataset(item), max(1, SMALL // (self.size + 1))
        for first in range(0, count, block):
            self._add(sum(map(len, texts[first : first + block] if shape else [texts[()]])))

    def _attributes(self, item: Any) -> None:
        """Count texts of attributes; refuse long lists of them: each may be as long as the file."""
        import h5py  # cases are read without it
        import numpy as np  # cases are listed without it
        from h5py import h5a  # cases are read without it

        for k in range(h5a.get_num_attrs(item)):
            attribute = h5a.open(item, index=k)
            type_, count = attribute.get_type(), math.prod(attribute.shape or ())
            if _varies(type_):
                if count > _FEW_TEXTS:
                    check_declared(count * self.size, self.size, self.name)
                if isinstance(type_, h5py.h5t.TypeStringID):
                    values = np.empty(attribute.shape or (), dtype=h5py.string_dtype())
                    attribute.read(values)
                    self._add(sum(map(len, values.ravel())))


def _varies(type_: Any) -> bool:
    """Whether values of an HDF5 type have varying lengths."""
    from h5py import h5t  # cases are read without it

    if isinstance(type_, h5t.TypeStringID):
        return bool(type_.is_variable_str())
    if isinstance(type_, h5t.TypeCompoundID):
        return any(_varies(type_.get_member_type(k)) for k in range(type_.get_nmembers()))
    if isinstance(type_, h5t.TypeArrayID):
        return _varies(type_.get_super())
    return isinstance(type_, h5t.TypeVlenID)


# ------------------------------------------------------------------------------------------------ Zarr


def check_zarr(folder: pathlib.Path) -> None:
    """Refuse a Zarr store (format 2, one group) that is not whole in itself, or not as its metadata say.

    It holds regular files alone: metadata, and in a folder an array all of its chunks. The arrays are of numbers or
    texts, their codecs read nothing else, and all values fit `check_declared`.

    Raises
    ------
    InputError
    """
    listed = _json(folder, ".zmetadata").get("metadata")
    if not isinstance(listed, dict):
        raise _damaged(folder, "'.zmetadata' has no 'metadata'")
    found, stored, declared = {".zmetadata"}, 0, 0
    for name, entry in listed.items():
        array, _, last = str(name).rpartition("/")
        if "/" in array or array in (".", "..") or last not in (".zgroup", ".zattrs", ".zarray"):
            raise _damaged(folder, f"its metadata name {_short(name)}, which is no file of the store")
        if _json(folder, name) != entry:
            raise _damaged(folder, f"{_short(name)} differs from '.zmetadata'")
        found.add(name)
        if last == ".zarray":
            size, chunks = _zarr_array(entry, array, folder)
            declared += size
            check_declared(declared, SMALL, str(folder))
            found |= {f"{array}/{chunk}" for chunk in chunks}
    for name, size in _files(folder):
        if name not in found:
            raise _damaged(folder, f"{_short(name)} belongs to no array")
        stored += size
        found.remove(name)
    if found:
        raise _damaged(folder, f"{_short(min(found))} is missing")
    check_declared(declared, stored, str(folder))


def _damaged(folder: pathlib.Path, why: str) -> InputError:
    return InputError(f"cannot read {_short(str(folder))}: {why}")


def _files(folder: pathlib.Path) -> Iterator[tuple[str, int]]:
    """Names and sizes of all files of a store; refuses links, and what is neither a file nor a folder."""
    for above, folders, files in os.walk(folder):
        for one in (*folders, *files):
            path = pathlib.Path(above, one)
            name, status = path.relative_to(folder).as_posix(), path.lstat()
            if stat.S_ISREG(status.st_mode):
                yield name, status.st_size
            elif not stat.S_ISDIR(status.st_mode):
                what = "a link" if stat.S_ISLNK(status.st_mode) else "no regular file"
                raise _damaged(folder, f"{_short(name)} is {what}; a store must hold all its values")


def _json(folder: pathlib.Path, name: str) -> dict[str, Any]:
    """A file of metadata."""
    path = folder / name
    if path.parent != folder and path.parent.is_symlink():
        raise _damaged(folder, f"{_short(path.parent.name)} is a link; a store must hold all its values")
    try:
        with binary(path, links=False) as file:
            found = json.loads(read_most(file, LARGEST_TEXT)[:LARGEST_TEXT])
    except (InputError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise _damaged(folder, f"{_short(name)} is missing or damaged")
    return found


def _zarr_array(entry: Mapping[str, Any], name: str, folder: pathlib.Path) -> tuple[int, Iterator[str]]:
    """Bytes and names of chunks of an array; refuses one that is not plain numbers or texts."""
    codecs = [entry.get("compressor"), *(entry.get("filters") or ())]
    ids = [codec.get("id") if isinstance(codec, Mapping) else codec for codec in codecs if codec is not None]
    unknown = [one for one in ids if one not in _CODECS]
    if unknown:
        raise _damaged(
            folder, f"the array {_short(name)} has the codec {_short(str(unknown[0]))}, which is not allowed"
        )
    import numpy as np  # cases are listed without it

    try:
        type_ = np.dtype(entry["dtype"])
        shape, chunks = ([operator.index(n) for n in entry[key]] for key in ("shape", "chunks"))
        plain = (
            type_.kind in "biufcU" and len(shape) == len(chunks) and min(shape, default=0) >= 0 < min(chunks, default=1)
        )
        separator = {".": ".", "/": ""}[entry.get("dimension_separator", ".")]
    except (KeyError, TypeError, ValueError):
        plain, separator = False, ""
    if not plain or not separator or entry.get("zarr_format") != 2:
        raise _damaged(folder, f"the array {_short(name)} is not one of numbers or texts in chunks")
    check_declared(math.prod(chunks) * type_.itemsize, SMALL, str(folder))
    counts = [range(-(-n // c)) for n, c in zip(shape, chunks, strict=True)]
    if math.prod(map(len, counts)) > _MOST_OBJECTS:
        raise _damaged(folder, f"the array {_short(name)} has more than {_MOST_OBJECTS} chunks")
    names = (separator.join(map(str, place)) or "0" for place in itertools.product(*counts))
    return math.prod(shape) * type_.itemsize, names
