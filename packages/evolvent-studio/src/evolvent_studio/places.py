"""Files that are opened step by step below a folder, where no link is followed."""

from __future__ import annotations

import contextlib
import errno
import os
import pathlib
import stat
from typing import NamedTuple

#: Largest YAML file that is read, bytes.
LARGEST = 500_000
#: Largest upload, and largest file of signals in the folder that is read, bytes.
LARGEST_SIGNALS, LARGEST_RECORDING = 200_000_000, 4_000_000_000
NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)


#: Opening a FIFO does not wait for its other end; what is opened is checked before it is read.
READ = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0) | NO_LINK


CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | NO_LINK


HAS_DIR_FD = {os.open, os.mkdir, os.stat, os.unlink} <= os.supports_dir_fd and hasattr(os, "O_NOFOLLOW")


class Place(NamedTuple):
    """A folder that is open; its files are named `prefix` + name, relative to the descriptor `fd` if there is one."""

    prefix: str
    fd: int | None

    def is_link(self, name: str) -> bool:
        """Whether an entry is a symbolic link (or, on Windows, a junction)."""
        try:
            found = os.stat(self.prefix + name, dir_fd=self.fd, follow_symlinks=False)
        except OSError:
            return False
        return stat.S_ISLNK(found.st_mode) or (self.fd is None and is_junction(self.prefix + name))

    def open(self, name: str, flags: int) -> int:
        """Open an entry that is no link."""
        if self.fd is None and self.is_link(name):
            raise OSError(errno.ELOOP, "it is a link", name)
        return os.open(self.prefix + name, flags, 0o666, dir_fd=self.fd)

    def mkdir(self, name: str) -> None:
        """Make a folder."""
        os.mkdir(self.prefix + name, dir_fd=self.fd)

    def replace(self, old: str, new: str) -> None:
        """Rename an entry; another of the new name goes."""
        os.replace(self.prefix + old, self.prefix + new, src_dir_fd=self.fd, dst_dir_fd=self.fd)

    def unlink(self, name: str) -> None:
        """Remove an entry that is no folder, where it is there."""
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self.prefix + name, dir_fd=self.fd)


def is_link(path: pathlib.Path) -> bool:
    """Whether a path is a link of any kind."""
    return path.is_symlink() or is_junction(path)


def is_junction(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a junction, which Windows follows as it does a link."""
    try:
        tag = getattr(os.lstat(path), "st_reparse_tag", 0)
    except OSError:
        return False
    return bool(tag) and tag == getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", 0)
