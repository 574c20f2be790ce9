"""The working folder: the only place that the studio reads from and writes to."""

from __future__ import annotations

import contextlib
import itertools
import os
import pathlib
import re
from collections.abc import Iterator, Mapping
from typing import Any

from evolvent import cases
from evolvent.errors import InputError

#: Folder inside the working folder that holds the queue, its runs, and what was dropped on the page.
OWN = ".evolvent-studio"
#: Files that are listed and entries that are looked at, at most, and levels of folders that are looked into.
_MOST, _LOOKED, _DEEP = 500, 20_000, 3
#: Largest YAML file that is read, bytes.
LARGEST = 500_000
#: Endings of files that hold signals.
SIGNALS = (".csv", ".tsv", ".txt", ".tdms", ".uff", ".unv", ".mat", ".h5", ".hdf5", ".wav", ".nc")


class Folder:
    """A working folder.

    Parameters
    ----------
    path : str
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.root = pathlib.Path(path).resolve()
        if not self.root.is_dir():
            raise InputError(f"{os.fspath(path)!r} is not a folder")
        self._read: dict[str, tuple[tuple[int, int], Any]] = {}  # name -> (its date and size, what it holds)

    @property
    def own(self) -> pathlib.Path:
        """The folder of the studio's own files; made when first asked for."""
        path = self.root / OWN
        if path.is_symlink():
            raise InputError(f"{OWN!r} is a link; it must be a folder of the working folder itself")
        path.mkdir(exist_ok=True)
        return path

    def inside(self, name: str) -> pathlib.Path:
        """A path below the working folder, links resolved.

        Raises
        ------
        InputError
            If it lies outside, or is no name of a file.
        """
        if not isinstance(name, str) or not name or "\0" in name:
            raise InputError(f"{name!r} does not name a file of the working folder")
        try:
            path = (self.root / name).resolve()
        except (OSError, RuntimeError, ValueError):
            raise InputError(f"{name!r} does not name a file of the working folder") from None
        if path == self.root or not path.is_relative_to(self.root):
            raise InputError(f"{name!r} lies outside the working folder; the studio opens nothing there")
        return path

    def new(self, name: str, ending: str) -> pathlib.Path:
        """A file of the working folder that is to be written.

        Raises
        ------
        InputError
            If it lies outside, has another ending, or is there already.
        """
        name = name.strip()
        if name and not name.endswith(ending):
            name += ending
        path = self.inside(name)
        if path.is_relative_to(self.root / OWN):
            raise InputError(f"{name!r} lies among the studio's own files; give a name of yours")
        if path.name.startswith("."):
            raise InputError(f"{name!r} begins with a dot, and such files are not listed; give another name")
        if len(os.fsencode(path.name)) > 200:
            raise InputError(f"the name takes {len(os.fsencode(path.name))} bytes; at most 200 are taken")
        if path.exists():
            raise InputError(f"{name!r} is there already; give another name")
        if not path.parent.is_dir():
            raise InputError(f"{name!r} cannot be written: there is no folder {path.parent.name!r}")
        return path

    def name(self, path: pathlib.Path) -> str:
        """A path as it is shown, from the working folder on."""
        return path.relative_to(self.root).as_posix()

    def files(self, *endings: str) -> list[str]:
        """Files with these endings, the studio's own not among them."""
        found = []
        for path in itertools.islice(self._walk(self.root, _DEEP), _LOOKED):
            name = self.name(path)
            plain = name.encode("utf-8", "ignore").decode() == name  # else no page can show it
            if path.name.lower().endswith(endings) and plain and path.is_file():
                found.append(name)
            if len(found) >= _MOST:
                break
        return sorted(found)

    def yaml(self) -> dict[str, Mapping[str, Any]]:
        """YAML files that hold a mapping, name -> content."""
        return {name: content for name, content in self._yaml().items() if isinstance(content, Mapping)}

    def unreadable(self) -> list[str]:
        """YAML files that cannot be read, or hold no mapping; `text` or who reads them says why."""
        return [name for name, content in self._yaml().items() if not isinstance(content, Mapping)]

    def _yaml(self) -> dict[str, Any]:
        """YAML files, name -> content, None where it cannot be read; each is read again only when it changed."""
        before, self._read = self._read, {}
        for name in self.files(".yaml", ".yml"):
            path = self.root / name
            try:
                status = path.stat()
            except OSError:
                continue
            stamp = status.st_mtime_ns, status.st_size
            if name in before and before[name][0] == stamp:
                self._read[name] = before[name]
                continue
            content = None
            with contextlib.suppress(InputError):
                content = cases.parse_yaml(self.text(name), name)
            self._read[name] = stamp, content
        return {name: content for name, (_, content) in self._read.items()}

    def text(self, name: str) -> str:
        """What a YAML file holds.

        Raises
        ------
        InputError
            If it lies outside, is too large, or is no text.
        """
        path = self.inside(name)
        try:
            if path.stat().st_size > LARGEST:
                raise InputError(f"{name!r} is too large for a YAML file; {LARGEST // 1000} kB are read at most")
            return path.read_text(encoding="utf-8")
        except OSError as error:
            raise InputError(f"cannot read {name!r}: {(error.strerror or str(error)).lower()}") from None
        except UnicodeDecodeError:
            raise InputError(f"cannot read {name!r}: it is no text in UTF-8") from None

    def studies(self) -> list[str]:
        """Folders that hold a study."""
        every = itertools.islice(self._walk(self.root, _DEEP), _LOOKED)
        found = {path.parent for path in every if path.name == "study.json"}
        return sorted(self.name(path) for path in found if path != self.root)

    def _walk(self, folder: pathlib.Path, deep: int) -> Iterator[pathlib.Path]:
        try:
            entries = sorted(folder.iterdir())
        except OSError:
            return
        for entry in entries:
            if entry.name.startswith(".") or entry.is_symlink():
                continue
            if entry.is_dir():
                if deep > 1 and not entry.name.endswith(".zarr"):
                    yield from self._walk(entry, deep - 1)
            else:
                yield entry

    def keep(self, name: str, content: bytes) -> str:
        """Keep a file that was dropped on the page; returns its name from the working folder on."""
        plain = re.sub(r"[^\w.\- ]", "_", os.path.basename(name.replace("\\", "/"))).lstrip(".")
        plain = os.fsencode(plain)[-200:].decode("utf-8", "ignore") or "file"
        place = self.own / "uploads"
        if place.is_symlink():
            raise InputError(f"'{OWN}/uploads' is a link; it must be a folder")
        place.mkdir(exist_ok=True)
        path = place / plain
        if path.is_symlink():
            raise InputError(f"'{OWN}/uploads/{plain}' is a link; it must be a file")
        path.write_bytes(content)
        return self.name(path)

    def check_case(self, content: Any, beside: pathlib.Path | None = None) -> None:
        """Refuse a case or study that names a file outside.

        Parameters
        ----------
        beside : folder that its names start from, the working folder unless given

        Raises
        ------
        InputError
            It names the value.
        """
        if isinstance(content, Mapping):
            for value in content.values():
                self.check_case(value, beside)
        elif isinstance(content, (list, tuple)):
            for value in content:
                self.check_case(value, beside)
        elif isinstance(content, str) and re.search(r"\.(nc|ya?ml)\s*$", content):
            self.inside(str((beside or self.root) / content.strip()))
