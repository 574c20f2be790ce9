"""The command `evolvent sensitivity`."""

from __future__ import annotations

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import showing_progress

cases = lazy.load("evolvent.cases", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
shown = lazy.load("evolvent.analysis.sensitivity_results", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--of", "values", multiple=True, required=True, metavar="VALUE", help="A value of the run.")
@click.option("--by", "keys", multiple=True, required=True, metavar="KEY", help="A key of a part that holds a number.")
@click.option("--adjoint", is_flag=True, help="By one pass back through the run, for many keys.")
@shared.assignments
@shared.output("SENSITIVITIES.CSV|NC", "Write the table as a file.")
@shared.single("--figure", metavar="SENSITIVITIES.PNG", text="Draw relative changes as bars.")
@shared.quiet("Print no table and no progress.")
def sensitivity(
    case: str, values: tuple[str, ...], keys: tuple[str, ...], adjoint: bool, assignments: tuple[str, ...],
    output: str | None, figure: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Find derivatives of values of a CASE's run by keys of its parts.

    They are those of the discrete solution, through latches and contacts as well. The last column is the relative
    change of the value by that of the key.

    \b
    evolvent sensitivity solar-array --of "hinge 1.latch_time" --by "parts.hinge 1.stiffness" --by "parts.panel 1.mass"
    """  # noqa: D301
    if output is not None:
        shown.Sensitivities.check_ending(output)
    shared.check_files(output=output, figure=figure)
    loaded = cases.load(case, cases.parse_assignments(assignments))
    definition = cases.system(loaded.system)
    with showing_progress(quiet=quiet):
        found = definition.system(loaded).sensitivity(
            list(values), list(keys), mode="adjoint" if adjoint else "forward"
        )
    answer = found.answer()
    if not quiet:
        showing.show(answer)
    shared.write_files(answer, found.named, output=output, figure=figure)
