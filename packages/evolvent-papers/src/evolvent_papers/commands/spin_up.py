"""The command `evolvent permissible-torque`."""

from __future__ import annotations

import math
from typing import Annotated, Any

import click
from pydantic import Field

from evolvent_base import files, options as shared, progress, units
from evolvent_base.console import echo, made_table, showing_progress
from evolvent_base.errors import RunFailed
from evolvent_base.schema import Section


class Options(Section):
    """Values of the options, with units."""

    lengths: Annotated[tuple[units.Length, ...], Field(min_length=1)] | None = None
    rate: units.PositiveRate | None = None
    ramp: units.DurationOrZero = 0.0


@click.command("permissible-torque")
@click.argument("case", metavar="CASE|FILE")
@shared.single("--lengths", metavar="1m,2m,5m", text="Lengths of the blades.  [default: blade.length]")
@shared.single("--rate", metavar="0.3rad/s", text="Spin before the torque acts.")
@shared.single("--ramp", metavar="10s", text="Time over which the torque grows smoothly.")
@shared.output("FIGURE.PNG", "Draw torque over length.")
@shared.assignments
@shared.quiet()
def permissible_torque(
    case: str, lengths: str | None, rate: str | None, ramp: str | None, output: str | None,
    assignments: tuple[str, ...], quiet: bool,
) -> None:  # fmt: skip
    """Largest torque that spins up a heliogyro before its blades wind onto the body, over the length of the blades.

    The blades are wholly out, straight and radial, and turn with the body; the torque acts on the body. They wind onto
    it where the lag at the spool reaches 90 degrees. Without --rate the spin is what pay-out leaves of body.rate. The
    exit code is 1 where the torque of a length is not found; the others are printed all the same.

    \b
    evolvent permissible-torque heliogyro --lengths 1m,2m,5m,10m -o spin-up.png
    """  # noqa: D301
    from evolvent import cases
    from evolvent_base import plots
    from evolvent_papers import spin_up

    overrides = cases.parse_assignments(assignments)
    asked = None if lengths is None else tuple(one.strip() for one in lengths.split(","))
    options = shared.section(Options, {"lengths": asked, "rate": rate, "ramp": ramp})
    if output is not None:
        plots.format_of(output)
        files.check_writable(output)
    with showing_progress(quiet=quiet):
        found = spin_up.permissible_torque(
            case, options.lengths, overrides, rate=options.rate, ramp=options.ramp,
            progress=lambda done, count: progress.report("searching", done, count, "lengths"),
        )  # fmt: skip
    if not quiet:
        _print(found)
    if output is not None:
        echo(f"figure: {plots.save(spin_up.figure(found), output)}")
    if found.failed:
        raise RunFailed("; ".join(found.failed), found)


def _print(found: Any) -> None:
    from rich.console import Console

    columns = ("length m", "spin rad/s", "thread N m", "rigid blade N m", "thread / rigid", "rigid, slow torque N m")
    table = made_table("permissible torque", *columns)
    for length, rate, thread, rigid, slow in zip(
        found.length, found.rate, found.thread, found.rigid, found.slow, strict=True
    ):
        ratio = thread / rigid if math.isfinite(rigid) else math.nan
        shown = ["-" if math.isnan(value) else f"{value:.4g}" for value in (rate, thread, rigid, ratio, slow)]
        table.add_row(f"{length:g}", *shown)
    Console(highlight=False).print(table)
