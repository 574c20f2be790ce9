"""What each tab of a browser has open, kept in the working folder: the case in its form, the measurement, the view."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Mapping
from typing import Any

from evolvent.errors import InputError
from evolvent.studio.folder import OWN, Folder

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
    names = _names(folder)
    for one in [name] if name in names else names[:1]:
        with contextlib.suppress(InputError, ValueError, RecursionError):
            found = json.loads(folder.read(OWN, _PLACE, f"{one}.json", most=_LARGEST))
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
    if folder.existing(OWN, _PLACE) is None:
        folder.make(OWN, _PLACE)
    folder.write(OWN, _PLACE, f"{name}.json", content=json.dumps(content).encode())
    for old in _names(folder)[_KEPT:]:
        (folder.own / _PLACE / f"{old}.json").unlink(missing_ok=True)


def _names(folder: Folder) -> list[str]:
    """Names of tabs with a file, the one written last first; links are left out."""
    place = folder.existing(OWN, _PLACE)
    if place is None:
        return []
    found: list[tuple[float, str]] = []
    with contextlib.suppress(OSError):
        for path in place.glob("*.json"):
            if is_name(path.stem) and path.is_file() and not path.is_symlink():
                found.append((path.stat().st_mtime, path.stem))
    return [name for _, name in sorted(found, reverse=True)]
