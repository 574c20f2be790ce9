"""What each tab of a browser has open, kept in the working folder: the case in its form, the measurement, the view.

The working folder may come from elsewhere: files are signed with the secret of the user, and others are left out.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import stat
from collections.abc import Mapping
from typing import Any

from evolvent_base.errors import InputError
from evolvent_studio.folder import OWN, Folder
from evolvent_studio.signing import Signer

#: Folder of the files, one for each tab; so many of them are kept.
_PLACE, _KEPT = "pages", 40
#: The name that a browser gives a tab.
_NAME = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
#: Largest file that is read, bytes.
_LARGEST = 4_000_000


def is_name(name: object) -> bool:
    """Whether a text is the name of a tab, and can be that of a file."""
    return isinstance(name, str) and _NAME.fullmatch(name) is not None


def load(folder: Folder, signer: Signer, name: str) -> dict[str, Any]:
    """What a tab had open; of a new one, what was open last in any tab; empty where nothing can be read."""
    files = _files(folder)
    for file in [name] if name in files else files[:1]:
        with contextlib.suppress(InputError, ValueError, RecursionError):
            kept = json.loads(folder.read(OWN, _PLACE, f"{file}.json", most=_LARGEST))
            if isinstance(kept, dict) and signer.is_signed(kept.get("content"), kept.get("signature")):
                found = kept["content"]
                return found if isinstance(found, dict) else {}
    return {}


def save(folder: Folder, signer: Signer, name: str, content: Mapping[str, Any]) -> None:
    """Keep what a tab has open; files of tabs that were used longest ago are removed.

    Raises
    ------
    InputError
        If the folder of the files is a link.
    OSError
        If the file cannot be written.
    """
    plain = json.loads(json.dumps(content))
    text = json.dumps({"content": plain, "signature": signer.sign(plain)})
    with contextlib.suppress(InputError, FileExistsError):
        folder.make(OWN, _PLACE)
    folder.write(OWN, _PLACE, f"{name}.json", content=text.encode())
    for old in _files(folder)[_KEPT:]:
        with contextlib.suppress(OSError):
            os.unlink(folder.own / _PLACE / f"{old}.json")


def _files(folder: Folder) -> list[str]:
    """Names of tabs with a file, the one written last first; links are left out."""
    found: list[tuple[float, str]] = []
    with contextlib.suppress(OSError), os.scandir(folder.root / OWN / _PLACE) as entries:
        for entry in entries:
            name, ending = os.path.splitext(entry.name)
            if ending == ".json" and is_name(name):
                status = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(status.st_mode):
                    found.append((status.st_mtime, name))
    return [name for _, name in sorted(found, reverse=True)]
