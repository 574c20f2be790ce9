"""The commands `evolvent export` and `evolvent report`."""

from __future__ import annotations

import math
import os
from typing import Any

import click
import lazy_loader as lazy

from evolvent_base import files, progress
from evolvent_base.console import echo, once, showing_progress
from evolvent_base.errors import InputError, nearest

gltf = lazy.load("evolvent.exports.gltf", suppress_warning=True)
matlab = lazy.load("evolvent.exports.matlab", suppress_warning=True)
moving = lazy.load("evolvent.exports.moving", suppress_warning=True)
page = lazy.load("evolvent.exports.page", suppress_warning=True)
report_page = lazy.load("evolvent.exports.report", suppress_warning=True)
request = lazy.load("evolvent.exports.request", suppress_warning=True)
results = lazy.load("evolvent.results", suppress_warning=True)
table = lazy.load("evolvent.exports.table", suppress_warning=True)
vtk = lazy.load("evolvent.exports.vtk", suppress_warning=True)

#: Formats: ending of what is written unless named.
ENDINGS = {
    "vtk": "-vtk", "csv": "-csv", "mat": ".mat", "glb": ".glb", "gif": ".gif", "mp4": ".mp4", "html": ".html",
}  # fmt: skip
#: Formats that fill a folder, that are pictures, that move, and that can take the axes of a body.
_FOLDERS, _PICTURES = ("vtk", "csv"), ("gif", "mp4", "html")
_MOVING, _TURNING = (*_PICTURES, "glb"), ("vtk", "glb", "gif", "mp4")
_AXES = ("inertial", "body")


@click.command()
@click.argument("path", metavar="RUN.NC")
@click.option("--to", "kind", multiple=True, callback=once, metavar="|".join(ENDINGS),
              help="Format.  [default: that of OUT, where it ends in .mat, .glb, .gif, .mp4 or .html]")  # fmt: skip
@click.option(
    "-o", "--output", multiple=True, callback=once, metavar="OUT", help="File or folder.  [default: next to the run]"
)
@click.option(
    "--frames", type=click.IntRange(min=1), metavar="N", help="Number of samples that are written, evenly spaced."
)
@click.option("--speed", type=float, metavar="X", help="Playback speed; 1 is real time (gif, mp4, html, glb).")
@click.option("--axes", metavar="|".join(_AXES), help="Axes of positions (vtk, glb, gif, mp4).")
@click.option("--decimal", metavar=".|,", help="Decimal sign; columns are separated by ; where it is a comma (csv).")
@click.option("--clearance", is_flag=True, help="Show bodies that interfere in red (gif, mp4, html); needs coal.")
@click.option("--large", is_flag=True, help="Write even more than 200 MB.")
def export(
    path: str,
    kind: str | None,
    output: str | None,
    frames: int | None,
    speed: float | None,
    axes: Any,
    decimal: Any,
    clearance: bool,
    large: bool,
) -> None:
    """Write a results file for other programs.

    \b
    vtk   folder of time series for ParaView: lines, surfaces, bodies, forces
    csv   folder of tables for a spreadsheet
    mat   struct for MATLAB and Octave
    glb   animated model (glTF) for viewers and Blender
    gif, mp4, html   animation
    """  # noqa: D301  (click wants the \b)
    if kind is None and output is not None:
        kind = next((name for name in ENDINGS if name not in _FOLDERS and output.endswith(ENDINGS[name])), None)
    if kind not in ENDINGS:
        given = "--to is not given" if kind is None else f"--to is {kind!r}"
        raise InputError(f"{given}; {nearest(kind or '', ENDINGS)}")
    if speed is not None and not (math.isfinite(speed) and 1e-6 <= speed <= 1e6):
        raise InputError(f"--speed is {speed:g}; it must be a number from 1e-6 to 1e6, such as 10")
    if speed is not None and kind not in _MOVING:
        raise InputError(f"--speed is for {', '.join(_MOVING)}; --to {kind} has none")
    if axes is not None and axes not in _AXES:
        raise InputError(f"--axes is {axes!r}; {nearest(axes, _AXES)}")
    if axes is not None and kind not in _TURNING:
        raise InputError(f"--axes is for {', '.join(_TURNING)}; --to {kind} has none")
    if decimal is not None and decimal not in (".", ","):
        raise InputError(f"--decimal is {decimal!r}; it must be '.' or ','")
    if decimal is not None and kind != "csv":
        raise InputError(f"--decimal is for csv; --to {kind} has none")
    if clearance and kind not in _PICTURES:
        raise InputError(f"--clearance is for {', '.join(_PICTURES)}; --to {kind} has no colours")
    found = results.open(path)
    target = os.path.splitext(path)[0] + ENDINGS[kind] if output is None else output
    _check_target(path, target, folder=kind in _FOLDERS)
    struck = found.ev.clearance() if clearance else None
    with showing_progress():
        progress.report(f"writing {kind}")
        asked = request.Request(
            frames=frames, speed=speed, axes=axes, large=large, decimal=decimal or ".", clearance=struck
        )
        written = writer(kind)(found, target, asked)
    echo(f"{kind}: {written}")
    _print_label(found)


@click.command()
@click.argument("path", metavar="RUN.NC")
@click.option("-o", "--output", multiple=True, callback=once, metavar="REPORT.HTML", help="[default: RUN-report.html]")
@click.option("--clearance", is_flag=True, help="Add clearances between bodies; needs the package coal.")
def report(path: str, output: str | None, clearance: bool) -> None:
    """Write a report of a results file as one self-contained HTML page."""
    found = results.open(path)
    target = os.path.splitext(path)[0] + "-report.html" if output is None else output
    _check_target(path, target, folder=False)
    with showing_progress():
        progress.report("writing the report")
        size = report_page.write(found, target, clearance=clearance)
    echo(f"report: {target} ({request.shown_size(size)})")
    _print_label(found)


def _check_target(path: str, target: str, *, folder: bool) -> None:
    """Refuse what could not be written, or is the run itself."""
    if os.path.exists(target) and os.path.samefile(path, target):
        raise InputError(f"-o {target!r} is the run itself; name another")
    if folder:
        files.check_writable_folder(target)
    else:
        files.check_writable(target)


def _print_label(found: Any) -> None:
    """Print the label of a run that did not reach its end."""
    if label := results.unfinished(found):
        echo(f"label on the files: {label}")


def writer(kind: str) -> Any:
    """What writes a format; its libraries are loaded with it."""
    if kind in ("gif", "mp4"):
        return getattr(moving, kind)
    modules: dict[str, Any] = {"vtk": vtk, "csv": table, "mat": matlab, "html": page, "glb": gltf}
    return modules[kind].write
