"""What is known of the YAML files of the working folder; each is read again only when it changed."""

from __future__ import annotations

import contextlib
import pathlib
import threading
from collections.abc import Callable, Iterable
from typing import NamedTuple

from evolvent_base import file_keys
from evolvent_base.errors import InputError
from evolvent_studio import reading

#: Time that a list of the files waits for those that are read, s; at first, until the process is there that reads.
_WAIT, _FIRST = 1.0, 30.0


class Written(NamedTuple):
    """What is known of a YAML file.

    Attributes
    ----------
    keys : names of the first level, none where it is no mapping or not read
    is_stand : bool, whether it describes a stand
    reason : str, "cannot be read" or "is being read" of a file without keys
    """

    keys: frozenset[str]
    is_stand: bool
    reason: str


class Listing:
    """What is known of files.

    Parameters
    ----------
    root : pathlib.Path, of the working folder
    names : function that returns the files' names
    text : function that returns what a file of a name holds
    """

    def __init__(self, root: pathlib.Path, names: Callable[[], Iterable[str]], text: Callable[[str], str]) -> None:
        self._root, self._names, self._text = root, names, text
        self._read: dict[str, tuple[tuple[int, ...], Written]] = {}  # name -> (its state, what it holds)
        self._wanted: dict[str, tuple[int, ...]] = {}  # files that are still to be read
        self._listing = threading.Condition()
        self._busy = self._is_ready = False

    def known(self) -> dict[str, Written]:
        """What is known of the YAML files; each is read again only when it changed.

        They are read by `evolvent_studio.reading`, one after the other. This waits for them for `_WAIT` seconds; others
        follow while the studio goes on.
        """
        stamps: dict[str, tuple[int, ...]] = {}
        for name in self._names():
            with contextlib.suppress(OSError):
                stamps[name] = file_keys.state(self._root / name)
        with self._listing:
            self._read = {name: kept for name, kept in self._read.items() if stamps.get(name) == kept[0]}
            self._wanted = {name: stamp for name, stamp in stamps.items() if name not in self._read}
            if self._wanted and not self._busy:
                self._busy = True
                threading.Thread(target=self._look, daemon=True).start()
            self._listing.wait_for(lambda: self._is_ready or not self._wanted, _FIRST)
            self._listing.wait_for(lambda: not self._wanted, _WAIT)
            pending = {name: Written(frozenset(), False, "is being read") for name in self._wanted}
            return {name: found for name, (_, found) in self._read.items()} | pending

    def _look(self) -> None:
        """Read the files that are wanted."""
        while True:
            with self._listing:
                if not self._wanted:
                    self._busy = False
                    return
                name, stamp = next(iter(self._wanted.items()))
            found = Written(frozenset(), False, "cannot be read")
            with contextlib.suppress(InputError, OSError):
                facts = reading.reader("reading").ask("facts", reading.TEXT, source=self._text(name), name=name)
                if facts is not None:
                    found = Written(frozenset(facts["keys"]), facts["is_stand"], "")
            with self._listing:
                self._is_ready = True
                if self._wanted.get(name) == stamp:
                    del self._wanted[name]
                    self._read[name] = stamp, found
                self._listing.notify_all()
