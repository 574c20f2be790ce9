"""The command `evolvent figure`."""

from __future__ import annotations

import os

import click
import lazy_loader as lazy

from evolvent_base import files
from evolvent_base.console import INTERRUPTED, echo, figure_format, note, once, showing_progress
from evolvent_base.errors import InputError

papers = lazy.load("evolvent_papers.papers", suppress_warning=True)
plots = lazy.load("evolvent_base.plots", suppress_warning=True)

#: Endings of the files of each kind.
ENDINGS = {"table": (".md",), "figure": (".png", ".svg", ".pdf")}


@click.command()
@click.argument("name", metavar="list|NAME")
@click.option("-o", "--output", multiple=True, callback=once, metavar="FILE", help="Table as .md, figure as .png, .svg "
              "or .pdf.  [default: NAME.FORMAT of a figure, none of a table]")  # fmt: skip
@figure_format
@click.option("--quick", is_flag=True, help="Fewer runs, and a reference of longer steps.")
def figure(name: str, output: str | None, kind: str, quick: bool) -> None:
    """Compute a table or figure of a paper again; `list` names them.

    It prints a Markdown table. A run that fails is a row of it. Ctrl-C ends the runs and keeps what was computed.
    """
    if name == "list":
        for key, one in papers.ENTRIES.items():
            echo(f"{key}  {one.paper}, {one.title} ({_minutes(one.seconds[0])})")
        return
    entry = papers.entry(name)
    path = _claimed(output if output is not None or entry.kind == "table" else f"{name}.{kind}", entry.kind)
    note(f"{entry.paper}, {entry.title}: {_minutes(entry.seconds[quick])}")
    with showing_progress() as say:
        made = entry.make(papers.Options(quick=quick, report=say))
    echo(made.text)
    if path is not None:
        _write(made, path)
    if not made.complete:
        note("interrupted; what was computed is kept")
        raise click.exceptions.Exit(INTERRUPTED)


def _minutes(seconds: int) -> str:
    """A duration in words."""
    return f"about {seconds} s" if seconds < 90 else f"about {round(seconds / 60)} min"


def _claimed(path: str | None, kind: str) -> str | None:
    """Refuse a file that could not be written, before the runs."""
    if path is None:
        return None

    if os.path.splitext(path)[1].lower() not in ENDINGS[kind]:
        raise InputError(f"cannot write {path!r}: the file of a {kind} ends with {' or '.join(ENDINGS[kind])}")
    return files.check_writable(path)


def _write(made: object, path: str) -> None:
    """Keep a table or figure in a file."""
    assert isinstance(made, papers.Made)
    if made.figure is not None:
        plots.save(made.figure, path)
    else:
        files.write_file(path, f"{made.text}\n")
    note(f"written to {path}")
