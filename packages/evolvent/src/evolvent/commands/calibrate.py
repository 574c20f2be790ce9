"""The command `evolvent calibrate`."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click
import lazy_loader as lazy

from evolvent_base import files, options as shared, progress
from evolvent_base.console import INTERRUPTED, echo, showing_progress

if TYPE_CHECKING:
    from evolvent_base.answer import Answer

errors = lazy.load("evolvent_base.errors", suppress_warning=True)
series = lazy.load("evolvent.design.calibration.relaxation.fit", suppress_warning=True)
fitting = lazy.load("evolvent.design.calibration.fit", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("files_", nargs=-1, required=True, metavar="[CASE|FILE] DATA...")
@click.option(
    "--fit",
    multiple=True,
    metavar="KEY[,KEY]",
    help="Keys that are fitted; for a list, all its entries.",
)
@click.option("--bounds", multiple=True, metavar="KEY=LOW,HIGH", help="Within which a fitted key stays.")
@click.option("--observe", multiple=True, metavar="VARIABLE[=COLUMN]", help="What was measured.")
@shared.single("--std", metavar="X[,X]", text="Standard deviation of each observed variable, in its unit.")
@shared.single(
    "--model", metavar="auto|runs|closed-form",
    text="What is fitted; auto takes the system's closed form where it has one.  [default: auto]",
)  # fmt: skip
@shared.single(
    "--relaxation", metavar="COLUMN",
    text="Fit a Prony series to this force or torque over time at a held position, of one or more files of DATA.",
)  # fmt: skip
@click.option(
    "--temperature",
    multiple=True,
    metavar="COLUMN|T",
    help="Of relaxation: a column, or that of each file.",
)
@shared.single(
    "--shift",
    metavar="table|wlf|arrhenius",
    text="Of relaxation times by temperature.  [default: table]",
)
@shared.single(
    "--reference",
    metavar="T",
    text="Temperature of the series.  [default: that of the data next to 20 degC]",
)
@shared.single("--terms", metavar="N", text="Terms of the series.  [default: by the data]")
@shared.single("--ramp", metavar="TIME", text="Length of the loading before the hold.  [default: that of the data]")
@click.option("--own-forces", is_flag=True, help="Each file has an instantaneous force of its own: other specimens.")
@shared.output("DIR", "Folder.  [default: CASE-calibration]")
@shared.quiet("Print no progress.")
def calibrate(
    files_: tuple[str, ...], fit: tuple[str, ...], bounds: tuple[str, ...], observe: tuple[str, ...],
    std: str | None, model: str | None, output: str | None, quiet: bool, relaxation: str | None, **of_series: Any,
) -> None:  # fmt: skip
    """Fit parameters of a case to measured DATA by least squares, or a Prony series to relaxation curves.

    DATA is a history (a column of times), a table of runs (columns named by keys of the case), or a log that the system
    reads. The folder keeps report.html, calibration.json, the case with the fitted values, a figure, and every
    evaluation: the same command continues where it was stopped.

    With --relaxation no case is given: DATA is force or torque over time at a held position, and the folder keeps the
    section `viscoelastic` for a case.

    \b
    evolvent calibrate wire-booms rbsp-a.csv --fit wire.tip_mass --observe spin_rate
    evolvent calibrate hinge.csv --relaxation torque --temperature oven --shift arrhenius
    """  # noqa: D301
    of_case = {"fit": fit, "bounds": bounds, "observe": observe, "model": model}
    folder = pathlib.Path(output or f"{os.path.splitext(os.path.basename(files_[0]))[0]}-calibration")
    deviations = _deviations(std)
    if relaxation is not None:
        _refuse(of_case, "is of the parameters of a case; leave it out with --relaxation")
        files.check_writable_folder(str(folder))
        answer = _series(files_, relaxation, deviations, of_series, quiet=quiet)
    else:
        _refuse(of_series, "is of a relaxation curve; give --relaxation COLUMN as well")
        if len(files_) != 2:
            raise click.UsageError(
                "Missing argument 'DATA'." if len(files_) < 2 else f"Got unexpected extra argument ({files_[2]})"
            )
        lacking = next((name for name in ("fit", "observe") if not of_case[name]), None)
        if lacking is not None:
            raise click.UsageError(f"Missing option '--{lacking}'.")
        files.check_writable_folder(str(folder))
        answer = _parameters(*files_, fit, observe, model, deviations, _limits(bounds), folder, quiet=quiet)
    showing.show(answer)
    paths = showing.fill(answer, folder)
    echo(f"results: {', '.join(paths)} in {folder}")


def _refuse(given: Mapping[str, Any], why: str) -> None:
    """Refuse options that have no meaning beside the others."""
    name = next((name for name, value in given.items() if value), None)
    if name is not None:
        raise errors.InputError(f"--{name.replace('_', '-')} {why}")


def _deviations(std: str | None) -> list[float] | None:
    try:
        return None if std is None else [float(x) for x in std.split(",")]
    except ValueError:
        raise errors.InputError(
            f"--std is {std!r}; it must be numbers with commas between them, such as 0.01,0.2"
        ) from None


def _limits(bounds: Sequence[str]) -> dict[str, list[str]]:
    limits = {}
    for text in bounds:
        key, equals, ends = (part.strip() for part in text.partition("="))
        if not equals or ends.count(",") != 1:
            raise errors.InputError(
                f"--bounds {text!r} is not of the form KEY=LOW,HIGH, such as 'body.inertia=1,3 kg m^2'"
            )
        limits[key] = [end.strip() for end in ends.split(",")]
    return limits


def _parameters(
    case: str, data: str, fit: Sequence[str], observe: Sequence[str], model: str | None,
    deviations: Sequence[float] | None, limits: Mapping[str, Sequence[str]], folder: pathlib.Path, *, quiet: bool,
) -> Answer:  # fmt: skip
    """Fit parameters of a case."""

    def show(count: int, rms: float) -> None:
        progress.report(f"fitting: root mean square {rms:.4g}", count, unit="evaluations")

    with showing_progress(quiet=quiet) as say:
        try:
            return fitting.calibrate(
                case, data, fit=fit, observe=observe, model="auto" if model is None else model,
                deviations=deviations, folder=folder, progress=show, report=say, bounds=limits,
            ).answer()  # fmt: skip
        except KeyboardInterrupt:
            say(f"stopped; every evaluation is kept in {folder}, and the same command continues")
            raise click.exceptions.Exit(INTERRUPTED) from None


def _series(
    paths: Sequence[str], column: str, deviations: Sequence[float] | None, asked: Mapping[str, Any], *, quiet: bool
) -> Answer:
    """Fit a Prony series."""
    if deviations is not None and len(deviations) != 1:
        raise errors.InputError(f"--std has {len(deviations)} values; one column is fitted, give one")
    terms = asked["terms"]
    if terms is not None and not terms.isdecimal():
        raise errors.InputError(f"--terms is {terms!r}; it must be a whole number, 1 or above")

    def show(count: int) -> None:
        progress.report("fitting a Prony series", count, unit="terms")

    keys = {name: f"--{name.replace('_', '-')}" for name in asked}
    keys |= {"column": "--relaxation", "temperatures": keys["temperature"]}
    with showing_progress(quiet=quiet), errors.naming_keys(keys):
        return series.fit_files(
            paths, column, temperatures=asked["temperature"], shift=asked["shift"], reference=asked["reference"],
            ramp=asked["ramp"], own_forces=asked["own_forces"], terms=None if terms is None else int(terms),
            deviation=None if deviations is None else deviations[0], report=show,
        ).answer()  # fmt: skip
