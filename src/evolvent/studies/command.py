"""The command `evolvent sweep`."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import click

from evolvent.errors import RunFailed
from evolvent.options import once

if TYPE_CHECKING:
    import xarray as xr

#: Exit code of a sweep that was interrupted.
INTERRUPTED = 130


@click.command()
@click.argument("study", metavar="STUDY|FILE")
@click.option(
    "-o", "--output", multiple=True, callback=once, metavar="DIR", help="Folder of the study; left out, its name."
)
@click.option("--workers", type=click.IntRange(min=1), metavar="N", help="Processes; left out, as many as it is worth.")
@click.option("--scheduler", metavar="ADDRESS", help="Use the workers of a Dask scheduler, such as tcp://host:8786.")
@click.option("--figures", metavar="DIR", help="Draw lines and maps into a folder.")
@click.option("--quiet", is_flag=True, help="Print no summary and no progress.")
def sweep(
    study: str, output: str | None, workers: int | None, scheduler: str | None, figures: str | None, quiet: bool
) -> None:
    """Run all cases of a built-in STUDY or a study FILE.

    The same command goes on after Ctrl-C or any other end; cases that are done are not computed again.
    """
    from evolvent.studies import read as read_study
    from evolvent.studies import runner, store

    runner.check_installed()
    with _progress(quiet) as (progress, tell):
        with runner.compilation(tell):  # the variables of a run are found by observing its start
            asked = read_study(study)
        folder = output or asked.name
        if figures is not None:
            from evolvent import results

            results.check_writable_folder(figures)
        try:
            found = runner.sweep(
                asked, output=folder, workers=workers, scheduler=scheduler, progress=progress.reach, tell=tell
            )
        except KeyboardInterrupt:
            done = f"{store.kept(folder)} of {asked.count} cases are kept in {folder}"
            tell(f"stopped; {done}, and the same command goes on from there")
            raise click.exceptions.Exit(INTERRUPTED) from None
    if not quiet:
        _summary(found, folder, progress)
    if figures is not None:
        from evolvent.studies import draw

        paths = draw.write(found, figures)
        if not quiet:
            click.echo(f"figures: {len(paths)} in {figures}" if paths else "figures: none, for nothing varies")
    if bool((found.status == "failed").all()):
        raise RunFailed(f"all {found.status.size} cases failed; the first: {found.reason.values.flat[0]}", found)


class _Reached:
    """How far a sweep is."""

    def __init__(self, show: Callable[[int, int], None]) -> None:
        self.before, self.done, self._show = -1, 0, show

    def reach(self, done: int, count: int) -> None:
        """Called with the number of cases done and of all."""
        self.before = done if self.before < 0 else self.before
        self.done = done
        self._show(done, count)


@contextlib.contextmanager
def _progress(quiet: bool) -> Iterator[tuple[_Reached, Callable[[str], None]]]:
    """A progress bar on stderr if somebody watches; yields what to call with progress and with sentences."""
    if quiet or not sys.stderr.isatty():
        yield _Reached(lambda done, count: None), lambda sentence: click.echo(f"evolvent: {sentence}", err=True)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = MofNCompleteColumn(), TextColumn("cases"), BarColumn(), TimeRemainingColumn(), TextColumn("left")
    with Progress(*columns, console=Console(stderr=True, highlight=False), transient=True) as bar:
        task = bar.add_task("sweep", total=None)
        yield (
            _Reached(lambda done, count: bar.update(task, completed=done, total=count)),
            lambda sentence: bar.console.print(f"evolvent: {sentence}", markup=False),
        )


def _summary(found: xr.Dataset, folder: str, progress: _Reached) -> None:
    """Print what came of the cases."""
    count = found.status.size
    here = progress.done - progress.before
    there = f", {progress.before} of them before" if progress.before else ""
    click.echo(f"{found.attrs['title']}: {count} cases, {here} computed now{there}")
    failed = (found.status == "failed").values
    if failed.any():
        click.echo(f"failed: {failed.sum()} of {count}; the first: {found.reason.values[failed][0]}")
    click.echo(f"results: {folder}/results.zarr")
    if json.loads(found.attrs.get("stages", "[]")):
        click.echo(f"runs of the stages: {folder}/stages, each a file for evolvent plot")
