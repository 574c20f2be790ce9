"""The command `evolvent calibrate`."""

from __future__ import annotations

import os
import pathlib

import click
import lazy_loader as lazy

from evolvent_base import files, options as shared, progress
from evolvent_base.console import INTERRUPTED, echo, showing_progress

errors = lazy.load("evolvent_base.errors", suppress_warning=True)
fitting = lazy.load("evolvent.design.calibration.fit", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.argument("data", metavar="DATA")
@click.option(
    "--fit",
    multiple=True,
    required=True,
    metavar="KEY[,KEY]",
    help="Keys that are fitted; for a list, all its entries.",
)
@click.option("--bounds", multiple=True, metavar="KEY=LOW,HIGH", help="Within which a fitted key stays.")
@click.option("--observe", multiple=True, required=True, metavar="VARIABLE[=COLUMN]", help="What was measured.")
@shared.single("--std", metavar="X[,X]", text="Standard deviation of each observed variable, in its unit.")
@shared.single(
    "--model", metavar="auto|runs|closed-form",
    text="What is fitted; auto takes the system's closed form where it has one.  [default: auto]",
)  # fmt: skip
@shared.output("DIR", "Folder.  [default: CASE-calibration]")
@shared.quiet("Print no progress.")
def calibrate(
    case: str, data: str, fit: tuple[str, ...], bounds: tuple[str, ...], observe: tuple[str, ...],
    std: str | None, model: str | None, output: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Fit parameters of a case to measured DATA by least squares.

    DATA is a history (a column of times), a table of runs (columns named by keys of the case), or a log that the system
    reads. The folder keeps report.html, calibration.json, the case with the fitted values, a figure, and every
    evaluation: the same command continues where it was stopped.
    """
    name = os.path.splitext(os.path.basename(case))[0]
    folder = pathlib.Path(output or f"{name}-calibration")
    files.check_writable_folder(str(folder))
    try:
        deviations = None if std is None else [float(x) for x in std.split(",")]
    except ValueError:
        raise errors.InputError(
            f"--std is {std!r}; it must be numbers with commas between them, such as 0.01,0.2"
        ) from None

    limits = {}
    for text in bounds:
        key, equals, ends = (part.strip() for part in text.partition("="))
        if not equals or ends.count(",") != 1:
            raise errors.InputError(
                f"--bounds {text!r} is not of the form KEY=LOW,HIGH, such as 'body.inertia=1,3 kg m^2'"
            )
        limits[key] = [end.strip() for end in ends.split(",")]

    def show(count: int, rms: float) -> None:
        progress.report(f"fitting: root mean square {rms:.4g}", count, unit="evaluations")

    with showing_progress(quiet=quiet) as say:
        try:
            found = fitting.calibrate(
                case, data, fit=fit, observe=observe, model="auto" if model is None else model,
                deviations=deviations, folder=folder, progress=show, report=say, bounds=limits,
            )  # fmt: skip
        except KeyboardInterrupt:
            say(f"stopped; every evaluation is kept in {folder}, and the same command continues")
            raise click.exceptions.Exit(INTERRUPTED) from None
    answer = found.answer()
    showing.show(answer)
    paths = showing.fill(answer, folder)
    echo(f"results: {', '.join(paths)} in {folder}")
