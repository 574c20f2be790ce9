"""The command `run`: results, figures, tables and files of a case."""

from __future__ import annotations

import itertools
import os
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import click
import lazy_loader as lazy

from evolvent_base import files, options as shared, progress, startup
from evolvent_base.console import INTERRUPTED, figure_format, note, once, say, showing_progress
from evolvent_base.errors import InputError, RunFailed, visible

if TYPE_CHECKING:
    import xarray as xr

    from evolvent_base.schema import Section

animation = lazy.load("evolvent.view.animation", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
drawings = lazy.load("evolvent.exports.drawings", suppress_warning=True)
report = lazy.load("evolvent.exports.report", suppress_warning=True)
results = lazy.load("evolvent.results", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@click.option(
    "-o",
    "--output",
    multiple=True,
    callback=once,
    metavar="RUN.NC",
    help="File of the results (NetCDF).  [default: run.nc in the new folder CASE-run]",
)
@click.option(
    "--figures",
    multiple=True,
    callback=once,
    metavar="DIR",
    help="Folder for figures and animation.  [default: RUN-figures, or CASE-run]",
)
@click.option("--no-figures", is_flag=True, help="Write the results only: no figures, animation or report.")
@figure_format
@shared.quiet()
def run(
    case: str,
    assignments: tuple[str, ...],
    output: str | None,
    figures: str | None,
    no_figures: bool,
    kind: str,
    quiet: bool,
) -> None:
    """Run a built-in CASE or a case FILE, print its results and draw figures.

    Without -o the new folder CASE-run keeps all of it: run.nc, figures, animation.html and report.html. Ctrl-C ends the
    run and keeps what was computed.
    """
    loaded = cases.load(case, cases.parse_assignments(assignments))
    module = cases.system(loaded.system)
    targets = _targets(case, output, figures, no_figures)
    _refuse_input(loaded, output)
    plan = module.plan(loaded)
    if plan.note and not quiet:
        note(plan.note)
    with showing_progress(quiet=quiet or not plan.solver):
        found = plan.run(lambda reached: progress.report("running", reached, plan.duration, "s"))
    _store(found, targets, kind, quiet)
    status, message = found.attrs["status"], found.attrs["message"]
    if status == "failed":
        raise RunFailed(message, found)
    if status == "interrupted":
        note(message)
        raise click.exceptions.Exit(INTERRUPTED)
    if missed := results.limits.verdict(results.limits.of_run(found)):
        note(f"{missed}: {'; '.join(one.text for one in results.limits.of_run(found) if not one.is_met)}")
        raise click.exceptions.Exit(1)


class _Targets(NamedTuple):
    """Where a run is kept: folder that is made for it, file of the results, folder of figures, file of the report."""

    folder: str | None
    results: str
    figures: str | None
    report: str | None


def _targets(case: str, output: str | None, figures: str | None, no_figures: bool) -> _Targets:
    """Where a run is kept; what could not be written is refused."""
    if no_figures and figures is not None:
        raise InputError(f"--figures {figures!r} and --no-figures are both given; give one of them")
    if output is None:
        folder = _unused(os.path.splitext(os.path.basename(case))[0] + "-run")
        for needed in (figures, folder):
            if needed is not None:
                files.check_writable_folder(needed)
        drawings = None if no_figures else folder if figures is None else figures
        report = None if no_figures else os.path.join(folder, "report.html")
        return _Targets(folder, os.path.join(folder, "run.nc"), drawings, report)
    files.check_writable(output)
    if case not in cases.built_in() and os.path.exists(output) and os.path.samefile(case, output):
        raise InputError(f"-o {output!r} is the case file itself; name another, such as 'run.nc'")
    if no_figures:
        return _Targets(None, output, None, None)
    drawings = beside(output) if figures is None else figures
    try:
        files.check_writable_folder(drawings)
    except InputError as error:
        raise InputError(f"{error} (--no-figures draws none)") from None
    if os.path.realpath(output) in _with_parents(os.path.realpath(drawings)):
        raise InputError(f"--figures {drawings!r} cannot be a folder, for -o writes the file {output!r}")
    return _Targets(None, output, drawings, None)


def _unused(folder: str) -> str:
    """`folder`, or the first of `folder`-2, `folder`-3, ... that does not exist."""
    names = itertools.chain([folder], (f"{folder}-{k}" for k in itertools.count(2)))
    return next(name for name in names if not os.path.lexists(name))


def _refuse_input(case: Section, output: str | None) -> None:
    """Refuse to write over a file that the case reads, such as the run that it starts from."""
    if output is None or not os.path.exists(output):
        return
    for key, value in _words(case.model_dump()):
        if os.path.isfile(value) and os.path.samefile(value, output):
            raise InputError(f"-o {output!r} is the file that {key} names; name another, such as 'run.nc'")


def _words(content: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Dotted keys and values of a case's words."""
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _words(value, f"{before}{key}.")
        elif isinstance(value, str):
            yield before + key, value


def beside(path: str) -> str:
    """The folder of the figures of a run, beside its file."""
    return os.path.splitext(path)[0] + "-figures"


def _with_parents(path: str) -> list[str]:
    """`path` and all folders above it."""
    above = os.path.dirname(path)
    return [path] if above == path else [path, *_with_parents(above)]


def _store(found: xr.Dataset, targets: _Targets, kind: str, quiet: bool) -> None:
    """Table, results file, figures and report of a run: what is wanted first and is quick comes first."""
    try:
        if not quiet:
            table(found)
    finally:  # where it cannot be printed the results are kept all the same
        if targets.folder is not None:
            files.make_folder(targets.folder)
        results.save(found, targets.results)
    written = [] if targets.figures is None else draw(found, targets.figures, kind, quiet)
    if targets.report is not None:
        with showing_progress(quiet=quiet):
            progress.report("writing the report")
            report.write(found, targets.report, written=written)
    if quiet:
        return
    if targets.folder is None:
        say(f"results: {targets.results}")
        list_names(written, targets.figures)
    elif targets.figures in (None, targets.folder):
        names = ["run.nc", *map(os.path.basename, written), *(["report.html"] if targets.report else [])]
        say(f"results: {', '.join(names)} in {targets.folder}")
    else:
        say(f"results: run.nc, report.html in {targets.folder}")
        list_names(written, targets.figures)


def list_names(written: Sequence[str], folder: str | None) -> None:
    """Print the names of figures."""
    if written:
        say(f"figures: {', '.join(map(os.path.basename, written))} in {folder}")


def draw(found: xr.Dataset, folder: str, kind: str, quiet: bool) -> list[str]:
    """Figures and animation of a run; returns the files' paths."""
    with showing_progress(quiet=quiet):
        progress.report("drawing figures")
        startup.load_drawing()
        figures, motion = cases.presenter(found).figures(found), animation.of_run(found)
        if not figures and motion is None:
            note("no figures, for the run holds too little to draw")
            return []
        return drawings.write(found, figures, motion, folder, kind=kind)


def table(found: xr.Dataset) -> None:
    """Print the results that a user wants to see at once."""
    status = found.attrs["status"]
    message = found.attrs["message"].removeprefix(status).lstrip()
    words = status if status == "success" else f"{status}: {message}"
    missed = results.limits.verdict(results.limits.of_run(found))
    rows = [("status", f"{words}, but {missed}" if missed else words)]
    rows += [(number.label, number.value) for number in cases.presenter(found).numbers(found)]
    print_rows(rows, status=status, well=not missed)


def print_rows(rows: Sequence[tuple[str, str]], *, status: str = "", well: bool = True) -> None:
    """Print labels and texts, which are wrapped beside them; "status" is coloured, green where all is `well`."""
    wide = max(len(label) for label, _ in rows)
    room = max(shutil.get_terminal_size().columns - wide - 2, 20)
    plain = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
    well = well and status in ("success", "stopped by event")
    for label, value in rows:
        label, lines = visible(label), textwrap.wrap(visible(value), room, break_on_hyphens=False) or [""]
        if status and label == "status" and not plain:
            lines[0] = lines[0].replace(status, click.style(status, fg="green" if well else "red", bold=not well), 1)
        name = f"{label:<{wide}}" if plain else click.style(f"{label:<{wide}}", dim=True)
        for line in lines:
            say(f"{name}  {line}", styled=True)
            name = " " * wide
