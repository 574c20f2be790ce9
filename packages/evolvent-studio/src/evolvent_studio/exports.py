"""Downloads that take long: each is written by its own process, whose progress the page shows."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import pathlib
import secrets
import subprocess
import tempfile
import threading

from evolvent.exports import moving
from evolvent_base.errors import InputError
from evolvent_studio import child, warm
from evolvent_studio.exporter import KINDS

#: Downloads whose files are kept until the studio ends; those before are removed.
_KEPT = 6
#: Seconds that a process has to end.
_GRACE = 3.0


@dataclasses.dataclass
class Export:
    """A download that is being written, or is ready.

    Attributes
    ----------
    key : str, by which the page fetches it
    path : pathlib.Path
    name : str, of the file
    text : str, what is being done
    share : float, from 0 to 1, how far that is; 0 where it is not known
    error : str, why it failed, '' where it did not
    ready : bool
    """

    key: str
    path: pathlib.Path
    name: str
    text: str = "starting"
    share: float = 0.0
    error: str = ""
    ready: bool = False
    process: child.Process | None = dataclasses.field(default=None, repr=False)


class Exports:
    """The downloads of a studio."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._exports: dict[str, Export] = {}
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def start(self, kind: str, run: pathlib.Path, name: str) -> Export:
        """Begin to write a download.

        Parameters
        ----------
        kind : a key of `KINDS`
        run : path of the results file
        name : str, of the run; the name of the file begins with it

        Raises
        ------
        InputError
            If something is missing that it needs.
        """
        if kind not in KINDS:
            raise InputError(f"the download {kind!r} is not known")
        if reason := missing(kind):
            raise InputError(reason)
        with self._lock:
            if self._folder is None:
                self._folder = tempfile.TemporaryDirectory(prefix="evolvent-downloads-")
            place = pathlib.Path(self._folder.name)
            key = secrets.token_hex(12)
            export = Export(key, place / f"{key}{os.path.splitext(KINDS[kind])[1]}", f"{name}{KINDS[kind]}")
            self._exports[key] = export
            for old in list(self._exports)[:-_KEPT]:
                self._remove(old)
            export.process = warm.start("exporter", kind, run, export.path, folder=place, stderr=subprocess.PIPE)
        threading.Thread(target=_follow, args=(export, export.process), daemon=True).start()
        return export

    def ready(self, key: str) -> Export | None:
        """A download that can be fetched; None where there is none of that key."""
        found = self._exports.get(key)
        return found if found is not None and found.ready else None

    def cancel(self, export: Export) -> None:
        """End a download, and remove what was written."""
        with self._lock:
            self._remove(export.key)

    def stop(self) -> None:
        """End all downloads, and remove their files."""
        with self._lock:
            for key in list(self._exports):
                self._remove(key)
            if self._folder is not None:
                self._folder.cleanup()
                self._folder = None

    def _remove(self, key: str) -> None:
        export = self._exports.pop(key, None)
        if export is None:
            return
        if export.process is not None and export.process.poll() is None:
            export.process.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                export.process.wait(timeout=_GRACE)
        with contextlib.suppress(OSError):
            export.path.unlink(missing_ok=True)


def missing(kind: str) -> str:
    """What a download needs that is not installed, as a sentence; '' for nothing."""
    if kind == "mp4":
        try:
            moving.ffmpeg()
        except InputError:
            return "MP4 needs the encoder ffmpeg; install it with: pip install 'evolvent[export]', or use GIF"
    return ""


def _follow(export: Export, process: child.Process) -> None:
    """Read the progress of a process until it ends."""
    assert process.stdout is not None
    assert process.stderr is not None
    error = ""
    for line in process.stdout:
        with contextlib.suppress(ValueError):
            message = json.loads(line)
            error = message.get("error", error)
            if "what" in message:
                done, total = message["done"], message["total"]
                export.share = min(done / total, 1.0) if total else 0.0
                export.text = f"{message['what']}: {done:.0f} of {total:.0f}" if total else message["what"]
    printed = process.stderr.read().strip().splitlines()
    process.wait()
    child.close(process)
    if process.returncode == 0 and export.path.is_file():
        export.ready = True
    else:
        export.error = error or (f"its process ended: {printed[-1]}" if printed else "its process was ended")
