"""Options that several commands have."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click
import lazy_loader as lazy

from evolvent_base import files
from evolvent_base.console import echo, once
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

if TYPE_CHECKING:
    from evolvent_base.answer import Answer

plots = lazy.load("evolvent_base.plots", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)

Decorator = Callable[[Any], Any]
Kind = TypeVar("Kind", bound=Section)


def single(*names: str, metavar: str, text: str) -> Decorator:
    """An option that is given once at most; None where it is left out.

    Parameters
    ----------
    names : str, of the option, such as "-o", "--output"
    metavar : str, an example or the name of the value
    text : str, of the help
    """
    return click.option(*names, multiple=True, callback=once, metavar=metavar, help=text)


def output(metavar: str, text: str) -> Decorator:
    """-o, what the command writes."""
    return single("-o", "--output", metavar=metavar, text=text)


def quiet(text: str = "Print no table and no progress.") -> Decorator:
    """--quiet, whether less is printed; `text` says what is not."""
    return click.option("--quiet", is_flag=True, help=text)


#: Changes of keys of the case.
assignments = click.option(
    "--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the case."
)
#: How cases run side by side.
workers = click.option(
    "--workers", type=click.IntRange(min=1), metavar="N", help="Number of processes. [default: chosen automatically]"
)
scheduler = click.option(
    "--scheduler", metavar="ADDRESS", help="Use the workers of a Dask scheduler, such as tcp://host:8786."
)


def section(kind: type[Kind], given: Mapping[str, Any]) -> Kind:
    """The checked section of what is not None; messages have its keys alone, which are what the user knows."""
    try:
        return kind(**{key: value for key, value in given.items() if value is not None})
    except InputError as error:
        raise InputError(str(error).removeprefix(f"{kind.__name__}.")) from None


def check_output(path: str | None, case: str, instead: str) -> None:
    """Refuse a file that could not be written, and the case file itself, before any work is done.

    Parameters
    ----------
    instead : str, an example of a name
    """
    if path is None:
        return
    files.check_writable(path)
    if os.path.exists(path) and os.path.exists(case) and os.path.samefile(case, path):
        raise InputError(f"-o {path!r} is the case file itself; name another, such as {instead!r}")


def check_files(*, figure: str | None = None, **others: str | None) -> None:
    """Refuse files that could not be written, and a figure of an unknown format, before any work is done."""
    if figure is not None:
        plots.format_of(figure)
    for path in filter(None, (*others.values(), figure)):
        files.check_writable(path)


def write_files(
    answer: Answer, named: str = "", *, output: str | None = None, figure: str | None = None, report: str | None = None
) -> None:
    """Write an answer as files that are asked for, its only or first one, first figure and page, and name them."""
    if output is not None:
        echo(f"{named}: {showing.save(answer, output)}")
    if figure is not None:
        if not answer.figures:
            raise InputError(f"--figure {figure!r} is not written: there is nothing to draw")
        echo(f"figure: {plots.save(answer.figures[0], figure)}")
    if report is not None:
        files.write_file(report, showing.page(answer).encode())
        echo(f"report: {report}")
