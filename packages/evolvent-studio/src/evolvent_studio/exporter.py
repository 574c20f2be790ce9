"""The process that writes one download, as `evolvent_studio.child` starts it with KIND, RUN and FILE.

Its progress goes to stdout, one JSON object a line; the end of stdin stops it.
"""

from __future__ import annotations

import os
import pathlib
import sys
import tempfile
import threading
import zipfile
from typing import Any

from evolvent import cases, results
from evolvent.exports import drawings, gltf, matlab, moving, report, table, vtk
from evolvent.exports.request import Request
from evolvent.view import animation
from evolvent_base import progress
from evolvent_base.errors import EvolventError, reason_of
from evolvent_studio import child

#: Kinds of downloads that are written by a process of their own: ending of the file's name.
KINDS = {
    "report": "-report.html", "figures": "-figures.zip", "csv": "-csv.zip", "mat": ".mat", "vtk": "-vtk.zip",
    "glb": ".glb", "mp4": ".mp4", "gif": ".gif",
}  # fmt: skip


def main(kind: str, run: str, target: str) -> int:
    """Write the download `kind` of the results file `run` to `target`."""
    send = child.channel()
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    try:
        with progress.shown_by(lambda stage: send(what=stage.what, done=stage.done, total=stage.total)):
            _write(kind, run, target)
    except EvolventError as error:
        send(error=str(error))
        return 1
    except OSError as error:
        send(error=f"the file cannot be written: {reason_of(error)}")
        return 1
    return 0


def _end_with_stdin() -> None:
    sys.stdin.read()
    os._exit(1)


def _write(kind: str, path: str, target: str) -> None:
    progress.report("reading the results")
    run = results.open(path)
    match kind:
        case "report":
            progress.report("drawing figures and animation")
            report.write(run, target)
        case "mp4" | "gif":
            getattr(moving, kind)(run, target, Request())
        case "glb" | "mat":
            progress.report(f"writing {kind.upper()}")
            (gltf if kind == "glb" else matlab).write(run, target, Request())
        case _:
            with tempfile.TemporaryDirectory(prefix="evolvent-export-") as folder:
                _fill(kind, run, folder)
                _pack(folder, target)


def _fill(kind: str, run: Any, folder: str) -> None:
    """Write the files of a download into a folder."""
    if kind == "figures":
        drawings.write(run, cases.presenter(run).figures(run), animation.of_run(run), folder)
        return
    progress.report(f"writing {kind.upper()}")
    (vtk if kind == "vtk" else table).write(run, folder, Request())


def _pack(folder: str, target: str) -> None:
    root = pathlib.Path(folder)
    files = sorted(path for path in root.rglob("*") if path.is_file())
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in progress.track(files, "compressing"):
            archive.write(path, path.relative_to(root).as_posix())
