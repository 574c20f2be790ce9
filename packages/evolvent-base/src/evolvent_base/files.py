"""Files that are written whole or not at all, and what is in the way of writing them."""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import math
import os
import pathlib
import platform
import re
import tempfile
import time
import uuid
from collections.abc import Iterator
from typing import Any

from evolvent_base.errors import InputError, reason_of

#: Name of a temporary file: computer and process that write it.
_PART = re.compile(r"\..*\.([0-9a-f]{8})-(\d{1,9})-[0-9a-f]{12}\.part")


#: Folders and when they were last searched for temporary files that were left, s; after how long they are again.
_LOOKED: dict[str, float] = {}


_EVERY = 60.0


#: Longest name of a file, bytes, on all common file systems.
_LONGEST = 255


def write_file(path: str | os.PathLike[str], content: bytes | memoryview | str) -> None:
    """Write a file, whole or not at all: see `writing`. A text is written in UTF-8.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with writing(path) as temporary, pathlib.Path(temporary).open("wb") as file:
        file.write(content.encode("utf-8") if isinstance(content, str) else content)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[str]:
    """A temporary name beside `path`; what was written there replaces it if all went well, else it is removed.

    A link is followed: the file that it points to is replaced. What killed processes have left in the folder goes.

    Raises
    ------
    InputError
        If the file cannot be written, by an error of the operating system.
    """
    name = check_writable(path)
    real = os.path.realpath(name)
    folder, short = os.path.dirname(real), os.path.basename(real)[:40]
    _remove_left(folder)
    temporary = os.path.join(folder, f".{short}.{_host()}-{os.getpid()}-{uuid.uuid4().hex[:12]}.part")
    try:
        yield temporary
        os.replace(temporary, real)
    except OSError as error:
        raise InputError(f"cannot write {name!r}: {reason_of(error)}") from None
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)


@functools.cache
def _host() -> str:
    """A short name of this computer."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def _remove_left(folder: str) -> None:
    """Remove temporary files of this computer's processes that are no more; looks at a folder once a minute."""
    now = time.monotonic()
    if now - _LOOKED.get(folder, -math.inf) < _EVERY or os.name != "posix":
        return
    _LOOKED[folder] = now
    with contextlib.suppress(OSError):
        for name in os.listdir(folder):
            found = _PART.fullmatch(name)
            if found and found[1] == _host() and not _is_running(int(found[2])):
                with contextlib.suppress(OSError):
                    os.unlink(os.path.join(folder, name))


def _is_running(process: int) -> bool:
    """Whether there is a process of this number."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def check_writable(path: str | os.PathLike[str]) -> str:
    """Refuse a file that could not be written, before any work is done for it; returns its name.

    Raises
    ------
    InputError
        If its folder is missing or closed to writing, or it is there already and no file that may be written.
    """
    name = _named(path, "write")
    real = os.path.realpath(name)
    folder = os.path.dirname(real)
    if os.path.isdir(real) or name.endswith(os.sep):
        raise InputError(f"cannot write {name!r}: it is a folder")
    if not os.path.isdir(folder):
        raise InputError(f"cannot write {name!r}: there is no folder {os.path.dirname(name) or folder!r}")
    if os.path.exists(real) and not os.path.isfile(real):
        raise InputError(f"cannot write {name!r}: it is not a regular file")
    if os.path.exists(real) and not os.access(real, os.W_OK):
        raise InputError(f"cannot write {name!r}: permission denied")
    _probe(folder, name)
    return name


def check_writable_folder(path: str | os.PathLike[str]) -> str:
    """Refuse a folder that could not be made or written into, before any work is done for it; nothing is made yet.

    Raises
    ------
    InputError
        If it is a file, or it, or the nearest folder above it that exists, is closed to writing.
    """
    name = _named(path, "write into")
    place = os.path.realpath(name)
    while not os.path.lexists(place):
        place = os.path.dirname(place)
    if not os.path.isdir(place):
        raise InputError(f"cannot write into {name!r}: {os.path.relpath(place)!r} is not a folder")
    _probe(place, name)
    return name


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make a folder if need be.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    name = check_writable_folder(path)
    try:
        os.makedirs(os.path.realpath(name), exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write into {name!r}: {reason_of(error)}") from None


def _named(path: Any, verb: str) -> str:
    """The name of a file or folder as a text; refuses what can be none."""
    if not isinstance(path, (str, os.PathLike)):
        raise InputError(f"cannot {verb} {path!r}: a file is named by a text or a path")
    name = os.fsdecode(path)
    if not name:
        raise InputError(f"cannot {verb} '': the name is empty")
    if "\0" in name:
        raise InputError(f"cannot {verb} {name!r}: no name may hold a null character")
    try:
        os.lstat(name)
    except OSError as error:
        too_long = error.errno == errno.ENAMETOOLONG
    else:
        too_long = False
    if too_long or any(len(os.fsencode(part)) > _LONGEST for part in pathlib.Path(name).parts):
        raise InputError(f"cannot {verb} {name[:40] + '...'!r}: the name is too long, with {len(name)} characters")
    return name


def _probe(folder: str, name: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write {name!r}: {reason_of(error)}") from None
