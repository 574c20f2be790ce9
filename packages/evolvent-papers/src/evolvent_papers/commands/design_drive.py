"""The command `evolvent design-drive`."""

from __future__ import annotations

from typing import Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared, progress
from evolvent_base.console import showing_progress
from evolvent_base.errors import InputError, RunFailed

cases = lazy.load("evolvent.cases", suppress_warning=True)
drives = lazy.load("evolvent_papers.drives", suppress_warning=True)
safe_open = lazy.load("evolvent_base.safe_open", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)

#: Options that are bounds, with what they bound.
_BOUNDS = {
    "peak-lag": ("14deg", "Largest lag of the tip.  [default: 1.02 times the steady lag]"),
    "residual-swing": (
        "0.2deg",
        "Largest lag after the drive, of the tip and at the spool.  [default: 0.2deg]",
    ),
    "lag-rate": ("5deg/s", "Largest rate of the lag."),
    "tension": ("20mN", "Largest tension at the spool."),
    "spool-torque": ("'0.2 mN m'", "Largest torque of the thread on the spool."),
    "time": (
        "150s",
        "Time that the drive takes, neither more nor less.  [default: 1.1 times that of the constant rate]",
    ),
    "length": ("50cm", "Length out at the end; below spool.start_length it reels in.  [default: blade.length]"),
    "error": ("0.1", "Relative error of inertia and spin.  [default: 0.1]"),
}


def _bounds(command: Any) -> Any:
    """The options of the bounds."""
    for name, (example, what) in reversed(_BOUNDS.items()):
        command = shared.single(f"--{name}", metavar=example, text=what)(command)
    return command


@click.command("design-drive")
@click.argument("case", metavar="CASE|FILE")
@_bounds
@shared.single("--bounds", "file", metavar="FILE", text="Bounds in a YAML file: keys as the options, with _ for -.")
@shared.output("DRIVE.YAML", "The case with the drive, for evolvent run.")
@shared.single("--figure", metavar="DRIVE.PNG", text="Draw the drive and the lag.")
@shared.assignments
@shared.quiet()
def design_drive(
    case: str, file: str | None, output: str | None, figure: str | None, assignments: tuple[str, ...], quiet: bool,
    **options: str | None,
) -> None:  # fmt: skip
    """Design the drive of the spools of a heliogyro: start, steady part and stop, or reeling in, within bounds.

    The case has the constant rate spool.rate, which the drive improves on. The exit code is 1 where a bound is not
    met; the nearest drive is written all the same.

    \b
    evolvent design-drive heliogyro -o drive.yaml --figure drive.png
    evolvent design-drive heliogyro --peak-lag 14deg --time 150s -o drive.yaml
    evolvent run drive.yaml
    """  # noqa: D301
    bounds = _read(file, options)
    shared.check_files(figure=figure)
    shared.check_output(output, case, "drive.yaml")

    def show(runs: int, _: float) -> None:
        progress.report("searching", runs, unit="runs")

    with showing_progress(quiet=quiet):
        found = drives.design(case, bounds, cases.parse_assignments(assignments), progress=show)
    answer = found.answer()
    if not quiet:
        showing.show(answer)
    shared.write_files(answer, "case", output=output, figure=figure)
    if answer.warnings:
        raise RunFailed("; ".join(answer.warnings), found)


def _read(file: str | None, options: dict[str, str | None]) -> Any:
    """The bounds of a file and of the options; an option comes before the file."""
    content: Any = {} if file is None else cases.parse_yaml(safe_open.text(file), file)
    if not isinstance(content, dict):
        raise InputError(f"{file}: bounds are a mapping of keys to values, such as peak_lag: 14 deg; this is not")
    given = {str(key): value for key, value in content.items()}
    return shared.section(drives.Bounds, given | {key: value for key, value in options.items() if value is not None})
