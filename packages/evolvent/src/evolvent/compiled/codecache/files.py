"""Files of stored machine code: a check sum before the content, so that damage is found before anything is unpickled.

The check sum is no protection from attack: whoever can write such a file can run code. Hence a file is only read where
it, and the folder that it is in (`codecache.folder`), belong to the user and nobody else may write to them.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import pathlib
import stat
import sys
import uuid

_HEAD = b"evolvent machine code 1\n"
_SUM = 32
#: Bytes of a file of machine code, at most.
_LARGEST = 500_000_000
#: Sentences that were said.
_said: set[str] = set()
#: Files that could not be used.
_unusable: set[pathlib.Path] = set()


def say_once(topic: str, sentence: str) -> None:
    """A sentence to stderr, the first of its topic in this process."""
    if topic not in _said:
        _said.add(topic)
        print(f"evolvent: {sentence}", file=sys.stderr, flush=True)


def may_be_changed(found: os.stat_result) -> str:
    """How others may change a file or folder that `found` describes; '' where it is the user's alone, and on Windows.

    A group of the user's own name that nobody else is in is no other, nor is the administrator, who may change all.
    """
    if not hasattr(os, "geteuid"):
        return ""
    if found.st_uid not in (os.geteuid(), 0):
        return "belongs to another user"
    if found.st_mode & stat.S_IWOTH:
        return "can be changed by all users"
    if found.st_mode & stat.S_IWGRP and not _is_private(found.st_gid):
        return "can be changed by its group"
    return ""


def _is_private(group: int) -> bool:
    """Whether a group is that of this user alone, as many systems make one for every user."""
    import grp  # not on Windows
    import pwd

    with contextlib.suppress(KeyError):
        user, own = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
        return own.gr_gid == user.pw_gid and own.gr_name == user.pw_name and set(own.gr_mem) <= {user.pw_name}
    return False


def read(path: pathlib.Path, key: str, *, is_own: bool = True) -> bytes | None:
    """Content of a file; None where there is none, or where it cannot be used, which is said on stderr.

    Parameters
    ----------
    key : str, of what the file holds, which enters its check sum
    is_own : bool, whether the file must be the user's own
    """
    try:
        number = os.open(path, os.O_RDONLY | _flag("O_NOFOLLOW") | _flag("O_NONBLOCK") | _flag("O_BINARY"))
    except FileNotFoundError:
        return None
    except OSError as error:
        is_link = error.errno == errno.ELOOP
        return _cannot_use(path, "it is a symbolic link" if is_link else (error.strerror or str(error)).lower())
    found = os.fstat(number)
    changed = may_be_changed(found) if is_own else ""
    if not stat.S_ISREG(found.st_mode) or changed or found.st_size > _LARGEST:
        os.close(number)
        return _cannot_use(
            path, f"it {changed or ('is too large' if stat.S_ISREG(found.st_mode) else 'is not a file')}"
        )
    try:
        with os.fdopen(number, "rb") as file:
            given = file.read()
    except OSError as error:
        return _cannot_use(path, (error.strerror or str(error)).lower())
    head, content = given[: len(_HEAD) + _SUM], given[len(_HEAD) + _SUM :]
    if head != _HEAD + _check_sum(key, content):
        return _cannot_use(path, "its check sum differs" if given else "it is empty")
    return content


def _check_sum(key: str, content: bytes) -> bytes:
    digest = hashlib.blake2b(content, digest_size=_SUM)
    digest.update(key.encode("utf-8", "surrogatepass"))
    return digest.digest()


def _cannot_use(path: pathlib.Path, why: str) -> bytes | None:
    _unusable.add(path)
    say_once("read", f"stored machine code in {os.fspath(path)!r} cannot be used: {why}; it is compiled again")
    return None


def cannot_load(path: pathlib.Path, error: Exception) -> None:
    """Say of a file with the right check sum that its content cannot be loaded."""
    _cannot_use(path, " ".join(f"{type(error).__name__}: {error}".split()))


def write(path: pathlib.Path, key: str, content: bytes) -> None:
    """Write a file under another name and rename it; where it cannot be written, that is said on stderr."""
    other = path.with_name(f"{uuid.uuid4().hex}.tmp")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _flag("O_NOFOLLOW") | _flag("O_BINARY")
        with os.fdopen(os.open(other, flags, 0o600), "wb") as file:
            file.write(_HEAD + _check_sum(key, content) + content)
        os.replace(other, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            other.unlink()
        if path not in _unusable:
            why = (error.strerror or str(error)).lower()
            say_once("write", f"a compiled function cannot be stored in {os.fspath(path)!r}: {why}; this run goes on")


def _flag(name: str) -> int:
    """A flag of `os.open`; none where the system lacks it."""
    return getattr(os, name, 0)
