"""Locks of files, which end with the process that holds them, and a turn that is waited for."""

from __future__ import annotations

import contextlib
import errno
import os
import pathlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import IO

#: Between two looks at a lock, and after how long without a sign of life its holder is waited for no longer, s.
_EVERY, STALE = 0.2, 120.0


def is_locked_now(file: IO[bytes]) -> bool:
    """Lock an open file for this process; False where another process holds it.

    Raises
    ------
    OSError
        If files of its folder cannot be locked.
    """
    try:
        if sys.platform == "win32":
            import msvcrt  # Windows alone

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # not on Windows

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK, errno.EWOULDBLOCK):
            return False
        raise
    return True


@contextlib.contextmanager
def turn(path: pathlib.Path, is_needed: Callable[[], bool]) -> Iterator[Callable[[], None]]:
    """Wait until no other process has this turn, or what it is needed for is there; then have it.

    A holder that has ended has lost it. One that has given no sign of life for `STALE` seconds, because it was stopped
    or is on a machine that is gone, is waited for no longer; nor is anybody where files cannot be locked.

    Parameters
    ----------
    path : of the file that is locked; it stays
    is_needed : function that tells whether there still is something to do

    Yields
    ------
    function, to be called from time to time as a sign of life
    """
    with contextlib.ExitStack() as stack:
        file = None
        with contextlib.suppress(OSError):
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            file = stack.enter_context(path.open("a+b"))
            last, since = -1, time.monotonic()
            while is_needed() and not is_locked_now(file):
                now = os.fstat(file.fileno()).st_mtime_ns
                if now != last:
                    last, since = now, time.monotonic()
                if time.monotonic() - since > STALE:
                    break
                time.sleep(_EVERY)

        def live() -> None:
            with contextlib.suppress(OSError, TypeError, ValueError):
                if file is not None:
                    os.utime(file.fileno() if os.utime in os.supports_fd else path)

        live()
        yield live
