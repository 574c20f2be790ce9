"""The command `evolvent sweep`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click
import lazy_loader as lazy

from evolvent_base import files, options as shared, progress
from evolvent_base.console import INTERRUPTED, echo, figure_format, showing_progress
from evolvent_base.errors import RunFailed

if TYPE_CHECKING:
    import xarray as xr

draw = lazy.load("evolvent.design.studies.draw", suppress_warning=True)
runner = lazy.load("evolvent.design.studies.runner", suppress_warning=True)
store = lazy.load("evolvent.design.studies.store", suppress_warning=True)
studies = lazy.load("evolvent.design.studies", suppress_warning=True)


@click.command()
@click.argument("study", metavar="STUDY|FILE")
@shared.output("DIR", "Folder of the study. [default: name of the study]")
@shared.workers
@shared.scheduler
@click.option("--figures", metavar="DIR", help="Draw lines and maps into a folder.")
@figure_format
@shared.quiet("Print no summary and no progress.")
def sweep(
    study: str,
    output: str | None,
    workers: int | None,
    scheduler: str | None,
    figures: str | None,
    kind: str,
    quiet: bool,
) -> None:
    """Run all cases of a built-in STUDY or a study FILE.

    Run the same command again to continue after Ctrl-C or any other end; finished cases are not computed again.
    """
    runner.check_installed()
    reached = Reached()
    with showing_progress(quiet=quiet) as say:
        asked = studies.read(study)  # the variables of a run are found by observing its start: this compiles
        folder = output or asked.name
        if figures is not None:
            files.check_writable_folder(figures)
        try:
            found = runner.sweep(
                asked, output=folder, workers=workers, scheduler=scheduler, progress=reached.reach, report=say
            )
        except KeyboardInterrupt:
            done = f"{store.finished_cases(folder)} of {asked.count} cases are kept in {folder}"
            say(f"stopped; {done}, and the same command continues from there")
            raise click.exceptions.Exit(INTERRUPTED) from None
    if not quiet:
        _summary(found, folder, reached)
    if figures is not None:
        with showing_progress(quiet=quiet):
            paths = draw.write(found, figures, kind=kind)
        if not quiet:
            echo(f"figures: {len(paths)} in {figures}" if paths else "figures: none, since nothing varies")
    if bool((found.status == "failed").all()):
        raise RunFailed(f"all {found.status.size} cases failed; the first: {found.reason.values.flat[0]}", found)


class Reached:
    """How far a sweep is."""

    def __init__(self) -> None:
        self.before, self.done = -1, 0

    def reach(self, done: int, count: int) -> None:
        """Called with the number of cases done and of all."""
        self.before = done if self.before < 0 else self.before
        self.done = done
        progress.report("running cases", done, count, "cases")


def _summary(found: xr.Dataset, folder: str, reached: Reached) -> None:
    """Print what came of the cases."""
    count = found.status.size
    here = reached.done - reached.before
    there = f", {reached.before} of them before" if reached.before else ""
    echo(f"{found.attrs['title']}: {count} cases, {here} run now{there}")
    failed = (found.status == "failed").values
    if failed.any():
        echo(f"failed: {failed.sum()} of {count}; the first: {found.reason.values[failed][0]}")
    echo(f"results: {folder}/results.zarr")
    if json.loads(found.attrs.get("stages", "[]")):
        echo(f"runs of the stages: {folder}/stages, each a file for evolvent plot")
