"""Margins as one HTML page that needs nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from evolvent.base.files import write_file
from evolvent.exports.report import figure_picture
from evolvent.results import made_with
from evolvent.view import pages

if TYPE_CHECKING:
    from evolvent.analysis.margins.results import MarginResults


def write(found: MarginResults, path: str) -> str:
    """Write the page; returns its path.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    tables = [
        ("Margins", found.rows()),
        ("What brings each margin to 0", found.balance_rows()),
        *((f"{one.coordinate.name}: what counts where its margin is least", found.contributions(one.coordinate.name))
          for one in found.still),
    ]  # fmt: skip
    if found.latches:
        tables.append(("Latches and stops in the run", found.latch_rows()))
    negative = ", ".join(map(repr, found.negative))
    page = pages.render(
        "margins.html",
        title=f"Margins of {found.title or 'a mechanism'}",
        verdict=f"The margin of {negative} is below 0." if negative else "Every margin holds.",
        tables=tables,
        drawn=figure_picture(found.figure()),
        notes=[*found.notes(), *filter(None, [found.standard.source]), f"made with {made_with()}"],
        case=found.case,
    )
    write_file(path, page.encode())
    return path
