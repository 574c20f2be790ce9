"""The command `evolvent permissible-torque`."""

from __future__ import annotations

from typing import Annotated

import click
import lazy_loader as lazy
from pydantic import Field

from evolvent_base import options as shared, progress, units
from evolvent_base.console import showing_progress
from evolvent_base.errors import RunFailed
from evolvent_base.schema import Section

cases = lazy.load("evolvent.cases", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
spin_up = lazy.load("evolvent_papers.spin_up", suppress_warning=True)


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
    overrides = cases.parse_assignments(assignments)
    asked = None if lengths is None else tuple(one.strip() for one in lengths.split(","))
    options = shared.section(Options, {"lengths": asked, "rate": rate, "ramp": ramp})
    shared.check_files(figure=output)
    with showing_progress(quiet=quiet):
        found = spin_up.permissible_torque(
            case, options.lengths, overrides, rate=options.rate, ramp=options.ramp,
            progress=lambda done, count: progress.report("searching", done, count, "lengths"),
        )  # fmt: skip
    if not quiet:
        showing.show(found.answer())
    shared.write_files(found.answer(), figure=output)
    if found.failed:
        raise RunFailed("; ".join(found.failed), found)
