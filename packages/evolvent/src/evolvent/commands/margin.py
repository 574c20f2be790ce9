"""The command `evolvent margin`."""

from __future__ import annotations

from typing import Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import showing_progress
from evolvent_base.errors import RunFailed

answer = lazy.load("evolvent_base.answer", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
results = lazy.load("evolvent.analysis.margins.results", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@shared.single(
    "--factors", metavar="NAME|FILE.YAML",
    text="Table of factors: a standard, or an own table.  [default: the case's margin.factors, or ECSS-E-ST-33-01C]",
)  # fmt: skip
@click.option("--at-rest", is_flag=True, help="Leave out the margins along the simulated motion.")
@click.option("--details", is_flag=True, help="Print every share at the governing positions.")
@click.option("--check", is_flag=True, help="Exit with code 1 where a margin is below 0.")
@shared.output("MARGINS.NC|JSON|CSV", "Keep all tables as a file.")
@shared.single("--figure", metavar="MARGINS.PNG", text="Draw torque over angle.")
@shared.single("--report", metavar="MARGINS.HTML", text="Write everything on one page.")
@shared.quiet("Print no tables and no progress.")
def margin(
    case: str, assignments: tuple[str, ...], factors: str | None, at_rest: bool, details: bool, check: bool,
    output: str | None, figure: str | None, report: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Find the torque and force margins of a CASE: every hinge and slide, over its whole travel.

    What drives and what resists is the mechanism's that is simulated, part by part; the factors are a standard's. The
    exit code is 0 whatever the margins are, unless --check is given.

    \b
    evolvent margin solar-array
    evolvent margin solar-array --factors NASA-STD-5017B --check -o margins.json
    """  # noqa: D301
    if output is not None:
        results.MarginResults.check_ending(output)
    shared.check_files(output=output, figure=figure, report=report)
    loaded, keys = _loaded(case, cases.parse_assignments(assignments))
    if factors is not None:
        keys["factors"] = factors
    with showing_progress(quiet=quiet):
        found = cases.system(loaded.system).margin(loaded, motion=False if at_rest else None, **keys)
    if not quiet:
        showing.show(found.answer(), level=answer.DETAIL if details else answer.EVERYWHERE)
    shared.write_files(found.answer(), found.named, output=output, figure=figure, report=report)
    if check and found.negative:
        raise RunFailed(f"the margin of {', '.join(map(repr, found.negative))} is below 0", found)


def _loaded(case: str, given: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """A case with the values of its keys, and keys of margins, where the cases of its system have no key `margin`."""
    own = {key: value for key, value in given.items() if key.startswith("margin.")}
    loaded = cases.load(case, {key: value for key, value in given.items() if key not in own})
    if "margin" in type(loaded).model_fields:
        return cases.load(case, given), {}
    asked: dict[str, Any] = {"margin": {}}
    for key, value in own.items():
        cases.override(asked, key, value)
    return loaded, asked["margin"]
