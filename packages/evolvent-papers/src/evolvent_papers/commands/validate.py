"""The command `evolvent validate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import echo, showing_progress
from evolvent_base.errors import InputError, RunFailed

if TYPE_CHECKING:
    from evolvent_papers.laboratory.book import Verdict, Verdicts

book = lazy.load("evolvent_papers.laboratory.book", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
laboratory = lazy.load("evolvent_papers.laboratory", suppress_warning=True)
plots = lazy.load("evolvent_base.plots", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("name", metavar="[SET]", required=False)
@click.option(
    "--all", "every", is_flag=True, help="All sets, and the coverage of their bands; those without data are left out."
)
@shared.single("--data", metavar="FOLDER|FILE", text="Other measurements of the same form.")
@shared.assignments
@shared.single("--figure", metavar="FIGURE.PNG", text="Draw prediction and measurement; further figures get numbers.")
@shared.output("VERDICT.JSON", "Keep all comparisons as a file.")
@shared.quiet()
def validate(
    name: str | None, every: bool, data: str | None, assignments: tuple[str, ...], figure: str | None,
    output: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Predict measured motion, and compare. Without a SET the sets of measurements are listed.

    Each comparison states its band before it is made: uncertainty of the measurement, of the parameters and of the
    numerics. The exit code is 1 where a goal is missed.

    \b
    evolvent validate
    evolvent validate --all -o all.json
    evolvent validate triple-pendulum --figure pendulum.png
    evolvent validate triple-pendulum --data recordings --set fitted=5
    """  # noqa: D301
    if name is None or every:
        if name is not None or data is not None or assignments or figure is not None:
            what = "--all takes no SET and none of --data, --set and --figure" if every else "a SET is missing"
            raise InputError(f"{what}; known: {', '.join(laboratory.SETS)}")
        if not every:
            if output is not None:
                raise InputError(f"a SET is missing, or --all; known: {', '.join(laboratory.SETS)}")
            _list()
            return
    shared.check_files(figure=figure, output=output)
    found: Verdict | Verdicts
    found = _every(quiet=quiet) if every else _one(str(name), data, cases.parse_assignments(assignments), quiet=quiet)
    answer = found.answer()
    if not quiet:
        showing.show(answer)
    for k, drawn in enumerate(answer.figures if figure is not None else ()):
        path = str(figure) if k == 0 else str(figure).replace(".", f"-{k + 1}.", 1)
        echo(f"figure: {plots.save(drawn, path)}")
    shared.write_files(answer, "verdict", output=output)
    if found.missed_goals:
        raise RunFailed(f"goals are missed: {'; '.join(found.missed_goals)}", None)


def _list() -> None:
    """Print the names and titles of all sets."""
    width = max(map(len, laboratory.SETS))
    for name in laboratory.SETS:
        one = laboratory.found(name)
        echo(f"{name:<{width}}  {one.title}" + (f" (--data FOLDER: {one.needs})" if one.needs else ""))


def _one(name: str, data: str | None, overrides: dict[str, Any], *, quiet: bool) -> Verdict:
    """Predict and compare one set."""
    asked = laboratory.found(name)
    with showing_progress(quiet=quiet):
        found: Verdict = asked.validate(overrides, data)
    return found


def _every(*, quiet: bool) -> Verdicts:
    """Predict and compare all sets whose measurements the package has."""
    sets = [laboratory.found(name) for name in laboratory.SETS]
    with showing_progress(quiet=quiet):
        found: Verdicts = book.Verdicts({one: None if one.needs else one.validate() for one in sets})
    return found
