"""Entry points: what the packages of evolvent offer, and what packages outside add."""

from __future__ import annotations

import contextlib
import functools
import importlib.metadata
import importlib.util
import os
import pathlib
import signal
import sys
import threading
from collections.abc import Iterator
from typing import Any

from evolvent_base import packages
from evolvent_base.errors import InputError

#: Environment variable that leaves out all packages outside where it is "none".
VARIABLE = "EVOLVENT_PLUGINS"
#: Sentences of `load` that stand on stderr already.
said: set[str] = set()


def entry_points(group: str) -> list[importlib.metadata.EntryPoint]:
    """Entry points of a group, by name; a name of evolvent's own packages is theirs.

    Raises
    ------
    InputError
        If the environment variable `EVOLVENT_PLUGINS` holds another word than "none" or "all".
    """
    asked = os.environ.get(VARIABLE) or "all"
    if asked not in ("none", "all"):
        raise InputError(f"the environment variable {VARIABLE} is {asked[:40]!r}; it must be 'none' or 'all'")
    found: list[importlib.metadata.EntryPoint] = list(_every(tuple(sys.path)).select(group=group))
    own = [entry for entry in found if packages.is_own(entry.module)]
    names = {entry.name for entry in own}
    added = [entry for entry in found if not packages.is_own(entry.module) and entry.name not in names]
    return sorted([*own, *(added if asked == "all" else ())], key=lambda entry: entry.name)


@functools.lru_cache(maxsize=1)
def _every(path: tuple[str, ...]) -> Any:
    """Entry points of all packages on a path: reading the files of all of them takes 10 ms and more."""
    return importlib.metadata.entry_points()


def outside(group: str) -> list[importlib.metadata.EntryPoint]:
    """Entry points of a group, by name, that packages outside add."""
    return [entry for entry in entry_points(group) if not packages.is_own(entry.module)]


def load(entry: importlib.metadata.EntryPoint, called: str) -> Any:
    """The object of an entry point.

    An import that would end the process is reported on stderr at once; Ctrl-C ends it all the same.

    Parameters
    ----------
    called : str, what to call it in sentences

    Raises
    ------
    InputError
        Whatever the package raises as it is imported.
    """
    pressed: list[int] = []
    try:
        with _noting_ctrl_c(pressed):
            return entry.load()
    except BaseException as error:
        if pressed:
            raise
        reason = " ".join(f"{type(error).__name__}: {error}".split()).rstrip(": ")
        sentence = f"{called} cannot be loaded: {reason}"
        if not isinstance(error, Exception) and sentence not in said:
            said.add(sentence)
            print(f"evolvent: {sentence}", file=sys.stderr, flush=True)
        raise InputError(sentence) from error


def files_of(entry: importlib.metadata.EntryPoint) -> list[tuple[str, pathlib.Path]]:
    """Files of the package or module that an entry point is in, which its results may depend on: names and paths.

    None where it is not found, which `load` says.
    """
    name = entry.module.partition(".")[0]
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError, AttributeError):
        return []
    if spec is None:
        return []
    if spec.submodule_search_locations is None:
        return [(name, pathlib.Path(spec.origin))] if spec.origin and os.path.isfile(spec.origin) else []
    found = []
    for folder in map(pathlib.Path, spec.submodule_search_locations):
        paths = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
        found += [(f"{name}/{path.relative_to(folder).as_posix()}", path) for path in paths]
    return sorted(found)


@contextlib.contextmanager
def _noting_ctrl_c(pressed: list[int]) -> Iterator[None]:
    """Note Ctrl-C, which a package may raise as well: an exception does not tell them apart."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return

    def note(number: int, frame: Any) -> None:
        pressed.append(number)
        before(number, frame)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is note:
            signal.signal(signal.SIGINT, before)
