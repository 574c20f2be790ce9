"""The working folder: the only folder that the studio reads from and writes to.

What it holds is not trusted: it may be an unpacked archive or a cloned repository. Files are opened from the folder
down, one component of the path after the other, and no symbolic link is followed on the way; only regular files are
read, up to a given size; files are written under a new name and then renamed. Where the system has no such calls
(Windows), each component is checked before it is used.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import pathlib
import re
import secrets
import stat
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

from evolvent import cases
from evolvent.design.studies import store
from evolvent_base import safe_open
from evolvent_base.errors import InputError, reason_of
from evolvent_studio import placing, reading
from evolvent_studio.jobkinds import DISPERSED, REPORT
from evolvent_studio.listing import Listing, Written
from evolvent_studio.places import (
    CREATE,
    HAS_DIR_FD,
    LARGEST,
    LARGEST_SIGNALS,
    NO_LINK,
    READ,
    Place,
    is_junction,
    is_link,
)

#: Folder inside the working folder that holds the queue, its runs, and what was dropped on the page.
OWN = ".evolvent-studio"
#: Files that are listed and entries that are looked at, at most, and levels of folders that are looked into.
_MOST, _LOOKED, _DEEP = 500, 20_000, 3
#: Uploads of one name, at most.
_MOST_SAME = 1000


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
        self._listing = Listing(self.root, lambda: self.files(".yaml", ".yml"), self.text)

    @property
    def own(self) -> pathlib.Path:
        """The folder of the studio's own files; made when first asked for."""
        with self._place(OWN, make=True):
            return self.root / OWN

    # -------------------------------------------------------------------------------------------- opened without links

    @contextlib.contextmanager
    def _place(self, *parts: str, make: bool = False) -> Iterator[Place]:
        """A folder below the working folder, reached through no link.

        Raises
        ------
        InputError
            If one of its components is a link.
        OSError
            If it cannot be opened.
        """
        place = Place(f"{self.root}{os.sep}", None)
        if HAS_DIR_FD:
            place = Place("", os.open(self.root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))
        try:
            for k, part in enumerate(parts):
                if make:
                    with contextlib.suppress(FileExistsError):
                        place.mkdir(part)
                if place.is_link(part):
                    raise InputError(f"{'/'.join(parts[: k + 1])!r} is a link; it must be a folder")
                if place.fd is None:
                    place = Place(f"{place.prefix}{part}{os.sep}", None)
                    if not os.path.isdir(place.prefix):
                        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), part)
                else:
                    below = place.open(part, os.O_RDONLY | os.O_DIRECTORY | NO_LINK)
                    os.close(place.fd)
                    place = Place("", below)
            yield place
        finally:
            if place.fd is not None:
                os.close(place.fd)

    @contextlib.contextmanager
    def opened(self, *parts: str) -> Iterator[BinaryIO]:
        """A regular file below the working folder for reading, reached through no link.

        Raises
        ------
        InputError
            If there is none, or it is a link, or no regular file.
        """
        name = "/".join(parts)
        try:
            with self._place(*parts[:-1]) as place:
                if place.is_link(parts[-1]):
                    raise InputError(f"{name!r} is a link; it must be a file")
                file = open(place.open(parts[-1], READ), "rb")  # noqa: SIM115
        except OSError as error:
            raise InputError(f"cannot read {name!r}: {reason_of(error)}") from None
        with file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"cannot read {name!r}: it is not a regular file")
            yield file

    def read(self, *parts: str, most: int = LARGEST) -> bytes:
        """Content of a file below the working folder, reached through no link.

        Raises
        ------
        InputError
            If it is a link, is not a regular file, or holds more than `most` bytes.
        """
        with self.opened(*parts) as file:
            content = safe_open.read_most(file, most)
        if len(content) > most:
            raise InputError(f"cannot read {'/'.join(parts)!r}: it is too large; {most // 1000} kB are read at most")
        return content

    def write(self, *parts: str, content: bytes) -> None:
        """Write a file below the working folder, whole or not at all; one that is there is replaced, also a link.

        Raises
        ------
        InputError
            If one of its folders is a link.
        OSError
            If it cannot be written.
        """
        with self._place(*parts[:-1]) as place:
            temporary = f".{secrets.token_hex(8)}.part"
            try:
                with open(place.open(temporary, CREATE), "wb") as file:
                    file.write(content)
                place.replace(temporary, parts[-1])
            finally:
                place.unlink(temporary)

    def create(self, *parts: str) -> BinaryIO:
        """A new file below the working folder for writing; one that is there is removed before, also a link.

        Raises
        ------
        InputError
            If one of its folders is a link.
        OSError
            If it cannot be made.
        """
        with self._place(*parts[:-1]) as place:
            place.unlink(parts[-1])
            return open(place.open(parts[-1], CREATE), "wb")

    def make(self, *parts: str) -> None:
        """Make a new folder below the working folder.

        Raises
        ------
        InputError
            If one of its folders is a link.
        OSError
            If it cannot be made, or is there already.
        """
        with self._place(*parts[:-1]) as place:
            place.mkdir(parts[-1])

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep every other studio out of this folder.

        Raises
        ------
        InputError
            If there is another, or the folder of the studio's files is a link or cannot be written.
        """
        try:
            with self._place(OWN, make=True) as place:
                if place.is_link("lock"):
                    raise InputError(f"'{OWN}/lock' is a link; it must be a file")
                flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NONBLOCK", 0) | NO_LINK
                file = open(place.open("lock", flags), "r+b", buffering=0)  # noqa: SIM115
        except OSError as error:
            raise InputError(f"cannot write '{OWN}/lock': {reason_of(error)}") from None
        with file, store.locked_file(file, self.root):
            yield

    def existing(self, *parts: str) -> pathlib.Path | None:
        """Path of a file or folder below the working folder, None where there is none or a link on the way."""
        path = self.root
        try:
            for part in parts:
                path = path / part
                if is_link(path):
                    return None
            return path if path.is_file() or path.is_dir() else None
        except OSError:
            return None

    def check_plain(self, path: pathlib.Path) -> None:
        """Refuse a folder of the working folder that holds anything but folders and regular files.

        Raises
        ------
        InputError
            It names the entry.
        """
        for folder, folders, files in os.walk(path):
            for name in (*folders, *files):
                found = pathlib.Path(folder, name)
                mode = found.lstat().st_mode
                if is_junction(found) or not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                    raise InputError(f"{self.name(found)!r} is neither a regular file nor a folder; it is not opened")

    # -------------------------------------------------------------------------------------------- the user's files

    def inside(self, name: str) -> pathlib.Path:
        """A path below the working folder, links resolved.

        Raises
        ------
        InputError
            If it lies outside, or is no name of a file.
        """
        if not isinstance(name, str) or not name or "\0" in name:
            raise InputError(f"{name!r:.200} does not name a file of the working folder")
        if name.startswith(("\\\\", "//")):  # of a network: not even asked for
            raise InputError(f"{name!r:.200} is outside the working folder, where the studio opens no files")
        try:
            path = (self.root / name).resolve()
            with contextlib.suppress(FileNotFoundError, NotADirectoryError, PermissionError):
                path.lstat()  # fails where the name is too long
        except (OSError, RuntimeError, ValueError):
            raise InputError(f"{name!r:.200} does not name a file of the working folder") from None
        if path == self.root or not path.is_relative_to(self.root):
            raise InputError(f"{name!r:.200} is outside the working folder, where the studio opens no files")
        return path

    def file(self, name: str, most: int | None = None) -> pathlib.Path:
        """A regular file below the working folder, links resolved.

        Parameters
        ----------
        most : int, bytes that it may have, any number unless given

        Raises
        ------
        InputError
            If there is none, it lies outside or is too large.
        """
        path = self.inside(name)
        try:
            found = path.stat()
        except OSError as error:
            raise InputError(f"cannot read {name!r:.200}: {reason_of(error)}") from None
        if not stat.S_ISREG(found.st_mode):
            raise InputError(f"cannot read {name!r:.200}: it is not a regular file")
        if most is not None and found.st_size > most:
            raise InputError(f"cannot read {name!r:.200}: it is too large; {most // 1_000_000} MB are read at most")
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
        size = len(os.fsencode(os.path.basename(name)))
        if size > 200:
            raise InputError(f"the name takes {size} bytes; at most 200 are taken")
        path = self.inside(name)
        if path.is_relative_to(self.root / OWN):
            raise InputError(f"{name!r} is among the studio's own files; choose another name")
        if path.name.startswith("."):
            raise InputError(f"{name!r} begins with a dot, and such files are not listed; give another name")
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

    def yaml(self) -> dict[str, Written]:
        """YAML files that hold a mapping, name -> what is known of it."""
        return {name: found for name, found in self._listing.known().items() if found.keys}

    def unreadable(self) -> dict[str, str]:
        """YAML files that cannot be read, hold no mapping, or are being read, and which of these; `text` says why."""
        return {name: found.reason for name, found in self._listing.known().items() if not found.keys}

    def content(self, name: str) -> Any:
        """What a YAML file holds, for a form.

        Raises
        ------
        InputError
            If it cannot be read, or holds more than a form shows.
        """
        return reading.content(self.text(name), name)

    def text(self, name: str) -> str:
        """What a YAML file holds.

        Raises
        ------
        InputError
            If it lies outside, is too large, or is no text.
        """
        path = self.inside(name)
        try:
            return self.read(*path.relative_to(self.root).parts).decode("utf-8")
        except UnicodeDecodeError:
            raise InputError(f"cannot read {name!r}: it is not UTF-8 text") from None

    def runs(self) -> list[str]:
        """Files of runs: those of NetCDF but for the results of studies."""
        studies = {f"{name}/" for name in self.studies()}
        return [name for name in self.files(".nc") if f"{name.rpartition('/')[0]}/" not in studies]

    def studies(self, *, dispersed: bool | None = None) -> list[str]:
        """Folders that hold a study.

        Parameters
        ----------
        dispersed : bool, whether those with the answer of a dispersion are meant, or the others; all unless given
        """
        every = list(itertools.islice(self._walk(self.root, _DEEP), _LOOKED))
        found = {path.parent for path in every if path.name == "study.json"}
        with_answer = {path.parent for path in every if path.name == DISPERSED}
        meant = found if dispersed is None else found & with_answer if dispersed else found - with_answer
        return sorted(self.name(path) for path in meant if path != self.root)

    def report(self, name: str) -> pathlib.Path | None:
        """The page with the answer of a dispersion, in its folder; None where there is none."""
        return self.existing(*name.split("/"), REPORT) if name in self.studies(dispersed=True) else None

    def _walk(self, folder: pathlib.Path, deep: int) -> Iterator[pathlib.Path]:
        try:
            entries = sorted(folder.iterdir())
        except OSError:
            return
        for entry in entries:
            if entry.name.startswith(".") or is_link(entry):
                continue
            if entry.is_dir():
                if deep > 1 and not entry.name.endswith(".zarr"):
                    yield from self._walk(entry, deep - 1)
            else:
                yield entry

    def keep(self, name: str, content: bytes) -> str:
        """Keep a file that was uploaded; returns its name from the working folder on.

        No file is replaced: where another of this name is there, a number is put behind it.

        Raises
        ------
        InputError
            If it is too large, or the folder of uploads is a link.
        """
        if len(content) > LARGEST_SIGNALS:
            raise InputError(
                f"the file {name!r:.200} is too large; at most {LARGEST_SIGNALS // 1_000_000} MB are taken"
            )
        plain = re.sub(r"[^\w.\- ]", "_", os.path.basename(name.replace("\\", "/"))).lstrip(".")
        plain = os.fsencode(plain)[-190:].decode("utf-8", "ignore") or "file"
        stem, ending = os.path.splitext(plain)
        with self._place(OWN, "uploads", make=True) as place:
            for number in range(1, _MOST_SAME + 1):
                shown = plain if number == 1 else f"{stem}-{number}{ending}"
                try:
                    with open(place.open(shown, CREATE), "wb") as file:
                        try:
                            file.write(content)
                        except OSError:
                            place.unlink(shown)
                            raise
                    return f"{OWN}/uploads/{shown}"
                except FileExistsError:
                    if self._is_same(shown, content):
                        return f"{OWN}/uploads/{shown}"
        raise InputError(
            f"{_MOST_SAME} uploads are called {plain!r}; remove some of '{OWN}/uploads', or rename the file"
        )

    def _is_same(self, shown: str, content: bytes) -> bool:
        try:
            return self.read(OWN, "uploads", shown, most=LARGEST_SIGNALS) == content
        except InputError:
            return False

    def study(self, name: str) -> Any:
        """Content of a study of the working folder, its case and the files that it names in place.

        Raises
        ------
        InputError
            If a file cannot be read, or lies outside.
        """
        content = self.content(name)
        if not isinstance(content, Mapping):
            raise InputError(f"{name}: it holds no study; a study is a mapping of keys to values")
        case = content.get("case")
        if isinstance(case, str) and case not in cases.built_in() and re.search(r"[./\\]", case):
            path = str(self.inside(name).parent / case)
            own = reading.content(self.text(path), case)
            content = {**content, "case": self.placed(own, self.name(self.inside(path)))}
        return self.placed(content, name)

    def placed(self, content: Any, beside: str = "") -> Any:
        """A case or study whose files are named by absolute paths, as processes in other folders need them.

        Parameters
        ----------
        beside : str, the file that holds it, '' for none: names count from its folder on, where there is such a file,
            else from the working folder on

        Raises
        ------
        InputError
            It names a value that is a file outside the working folder.
        """
        above = pathlib.PurePath(beside).parent.parts

        def place(name: str) -> pathlib.Path:
            near = (*above, *pathlib.PurePath(name).parts)
            return self.inside(os.path.join(*near) if above and self.existing(*near) else name)

        return placing.placed(content, place)
