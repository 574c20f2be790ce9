"""The command `evolvent validate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from evolvent.base import files
from evolvent.base.console import aligned, echo, say, showing_progress
from evolvent.base.errors import InputError, RunFailed
from evolvent.commands import options as shared

if TYPE_CHECKING:
    from evolvent.laboratory.book import Verdict


@click.command()
@click.argument("name", metavar="[SET]", required=False)
@shared.single("--data", metavar="FOLDER|FILE", text="Other measurements of the same form.")
@shared.assignments
@shared.single("--figure", metavar="FIGURE.PNG", text="Draw prediction and measurement; further figures get numbers.")
@shared.output("VERDICT.JSON", "Keep all comparisons as a file.")
@shared.quiet()
def validate(
    name: str | None, data: str | None, assignments: tuple[str, ...], figure: str | None, output: str | None,
    quiet: bool,
) -> None:  # fmt: skip
    """Predict measured motion, and compare. Without a SET the sets of measurements are listed.

    Each comparison states its band before it is made: uncertainty of the measurement, of the parameters and of the
    numerics. The exit code is 1 where a goal is missed.

    \b
    evolvent validate
    evolvent validate triple-pendulum --figure pendulum.png
    evolvent validate triple-pendulum --data recordings --set fitted=5
    """  # noqa: D301
    from evolvent import cases, laboratory
    from evolvent.laboratory import book
    from evolvent.view import plots

    if name is None:
        if data is not None or assignments or figure is not None or output is not None:
            raise InputError(f"a SET is missing; known: {', '.join(laboratory.SETS)}")
        width = max(map(len, laboratory.SETS))
        for one in laboratory.SETS:
            echo(f"{one:<{width}}  {laboratory.found(one).title}")
        return
    asked = laboratory.found(name)
    if figure is not None:
        plots.format_of(figure)
    for path in filter(None, (figure, output)):
        files.check_writable(path)
    with showing_progress(quiet=quiet):
        found = asked.validate(cases.parse_assignments(assignments), data)
    if not quiet:
        _print(found)
    if output is not None:
        files.write_file(output, book.as_json(asked, found))
        echo(f"verdict: {output}")
    if figure is not None:
        for k, drawn in enumerate(found.figures):
            path = figure if k == 0 else figure.replace(".", f"-{k + 1}.", 1)
            echo(f"figure: {plots.save(drawn, path)}")
    if found.missed:
        raise RunFailed(f"goals are missed: {'; '.join(one.what for one in found.missed)}", found)


def _print(found: Verdict) -> None:
    """Print comparisons, notes and the verdict."""
    from evolvent.laboratory import book

    say("\n".join(aligned(book.rows(found))))
    for note in found.notes:
        say(note)
    say(found.text)
