"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from evolvent.base.console import once

Decorator = Callable[[Any], Any]


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
