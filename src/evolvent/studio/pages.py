"""What each tab of a browser has open, kept in the working folder: the case in its form, the measurement, the view."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import re
from collections.abc import Mapping
from typing import Any

from evolvent.errors import InputError
from evolvent.studio.folder import Folder

#: Folder of the files, one for each tab; so many of them are kept.
_PLACE, _KEPT = "pages", 40
#: The name that a browser gives a tab.
_NAME = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
#: Largest file that is read, bytes.
_LARGEST = 4_000_000


def is_name(name: object) -> bool:
    """Whether a text is the name of a tab, and can be that of a file."""
    return isinstance(name, str) and _NAME.fullmatch(name) is not None


def load(folder: Folder, name: str) -> dict[str, Any]:
    """What a tab had open; of a new one, what was open last in any tab; empty where nothing can be read."""
    files = _files(folder)
    own = [path for path in files if path.stem == name]
    for path in own or files[:1]:
        with contextlib.suppress(OSError, ValueError):
            if path.stat().st_size <= _LARGEST:
                found = json.loads(path.read_text(encoding="utf-8"))
                if isinstance(found, dict):
                    return found
    return {}


def save(folder: Folder, name: str, content: Mapping[str, Any]) -> None:
    """Keep what a tab has open; files of tabs that were used longest ago are removed.

    Raises
    ------
    InputError
        If the folder of the files is a link.
    OSError
        If the file cannot be written.
    """
    place = _place(folder)
    place.mkdir(exist_ok=True)
    path = place / f"{name}.json"
    temporary = place / f"{name}.part"
    temporary.unlink(missing_ok=True)
    with temporary.open("x", encoding="utf-8") as file:  # a new file: no link is followed
        json.dump(content, file)
    os.replace(temporary, path)
    for old in _files(folder)[_KEPT:]:
        old.unlink(missing_ok=True)


def _place(folder: Folder) -> pathlib.Path:
    place = folder.own / _PLACE
    if place.is_symlink():
        raise InputError(f"{folder.name(place)!r} is a link; it must be a folder")
    return place


def _files(folder: Folder) -> list[pathlib.Path]:
    """Files of tabs, the one written last first; links are left out."""
    place = _place(folder)
    found: list[tuple[float, pathlib.Path]] = []
    with contextlib.suppress(OSError):
        for path in place.glob("*.json"):
            if is_name(path.stem) and path.is_file() and not path.is_symlink():
                found.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(found, reverse=True)]
