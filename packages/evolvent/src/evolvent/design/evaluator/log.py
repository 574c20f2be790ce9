"""A log of evaluations in a file (SQLite): a batch is there whole or not at all, whatever ends the process."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import pathlib
import sqlite3
from collections.abc import Sequence

from evolvent.design.evaluator import record
from evolvent_base import files
from evolvent_base.errors import InputError, counted

#: The only table; a file with any other one, or with views and triggers, is none of ours.
_TABLE = "CREATE TABLE evaluations (number INTEGER PRIMARY KEY, keys BLOB, content BLOB, digest BLOB)"
#: Errors of a file that is damaged, or is no database; others are of the disk or of its rights.
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_FORMAT, sqlite3.SQLITE_TOOBIG)

#: Key of an evaluation: the number of a case, or its keys as text.
Key = int | str


class Log:
    """Batches of evaluations that a file keeps, each with its check sum; it is closed to other processes meanwhile.

    What is damaged or was altered is left out, and the file is then written again without it.

    Parameters
    ----------
    path : of the file, which is made if need be

    Attributes
    ----------
    found : list of (keys, table), the batches that were there
    damaged : int, batches that are left out; 1 for a file that is none of a log

    Raises
    ------
    InputError
        If the file cannot be written, or another process has it open.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = pathlib.Path(files.check_writable(path))
        self.found: list[tuple[list[Key], record.CaseTable]] = []
        self.damaged = 0
        try:
            self._read()
            if self.damaged:
                self.close()
                for ending in ("", "-wal", "-shm", "-journal"):
                    pathlib.Path(f"{self.path}{ending}").unlink(missing_ok=True)
                self._open()
                for keys, rows in self.found:
                    self._insert(keys, rows)
        except (sqlite3.Error, OSError) as error:
            self.close()
            raise self._refusal(error) from None

    @property
    def done(self) -> int:
        """Number of evaluations that were there."""
        return sum(len(keys) for keys, _ in self.found)

    def _open(self) -> None:
        self._file = sqlite3.connect(self.path, isolation_level=None, timeout=0.0)
        for pragma in ("trusted_schema=OFF", "locking_mode=EXCLUSIVE", "journal_mode=WAL", "synchronous=FULL"):
            self._file.execute(f"PRAGMA {pragma}")
        if not self._file.execute("SELECT * FROM sqlite_schema").fetchall():
            self._file.execute(_TABLE)

    def _read(self) -> None:
        """Read the batches that are whole."""
        try:
            self._open()
            if [sql for (sql,) in self._file.execute("SELECT sql FROM sqlite_schema")] != [_TABLE]:
                self.damaged = 1
                return
            last, seen = 0, set()
            for number, *row in self._file.execute("SELECT * FROM evaluations ORDER BY number"):
                keys, content, digest = (one if isinstance(one, bytes) else b"" for one in row)
                if number <= last or _digest(keys, content) != digest or keys in seen:
                    self.damaged += 1
                    if number <= last:  # pages that hold one another have no end
                        break
                    continue
                last = number
                seen.add(keys)
                self.found.append((json.loads(keys), record.decode(content)))
        except sqlite3.Error as error:
            if getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF not in _DAMAGE:
                raise
            self.damaged += 1

    def _insert(self, keys: Sequence[Key], rows: record.CaseTable) -> None:
        own, content = json.dumps(list(keys)).encode(), record.encode(rows)
        insert = "INSERT INTO evaluations (keys, content, digest) VALUES (?, ?, ?)"
        self._file.execute(insert, (own, content, _digest(own, content)))

    def append(self, keys: Sequence[Key], rows: record.CaseTable) -> None:
        """Keep a batch for good.

        Raises
        ------
        InputError
            If it cannot be written; the log then stays as it was.
        """
        try:
            self._insert(keys, rows)
        except sqlite3.Error as error:
            raise self._refusal(error) from None

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(sqlite3.Error, AttributeError):
            self._file.close()

    def sentence(self) -> str:
        """What to say of what is left out."""
        many = counted(self.damaged, "record")
        verb = "is" if self.damaged == 1 else "are"
        return f"{many} in {str(self.path)!r} {verb} damaged or altered, and computed again"

    def _refusal(self, error: Exception) -> InputError:
        if getattr(error, "sqlite_errorcode", 0) & 0xFF == sqlite3.SQLITE_BUSY:
            place = str(self.path.parent)
            return InputError(f"another process works in {place!r}; wait for it, or give another folder")
        return InputError(f"cannot write {str(self.path)!r}: {error}")


def _digest(keys: bytes, content: bytes) -> bytes:
    """Check sum of a batch."""
    return hashlib.sha256(len(keys).to_bytes(8) + keys + content).digest()
