"""The command `evolvent storage`."""

from __future__ import annotations

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import showing_progress
from evolvent_base.errors import InputError, RunFailed

answer = lazy.load("evolvent_base.answer", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
results = lazy.load("evolvent.analysis.storage_results", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@click.option("--at-rest", is_flag=True, help="Leave out the simulated deployments.")
@click.option("--check", is_flag=True, help="Exit with code 1 where a margin after storage is below 0.")
@shared.output("STORAGE.NC|JSON|CSV", "Keep the equilibria over storage, or the numbers, as a file.")
@shared.single("--figure", metavar="STORAGE.PNG", text="Draw torque over angle before and after, the margin shaded.")
@shared.single("--report", metavar="STORAGE.HTML", text="Write everything on one page.")
@shared.quiet("Print no tables and no progress.")
def storage(
    case: str, assignments: tuple[str, ...], at_rest: bool, check: bool, output: str | None, figure: str | None,
    report: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Show what storage in the stowed position leaves of a CASE: forces, shapes, margins, deployment.

    The case says by its key store how long it is stored, and at which temperature. Materials and springs with the key
    viscoelastic relax. Margins are shown where the case has the key margin, deployments where it has simulate.

    \b
    evolvent storage tape-hinge-stored
    evolvent storage tape-hinge-stored --set store.time="5 years" --report storage.html
    """  # noqa: D301
    if output is not None:
        results.StorageResults.check_ending(output)
    shared.check_files(output=output, figure=figure, report=report)
    loaded = cases.load(case, cases.parse_assignments(assignments))
    if "store" not in type(loaded).model_fields:
        raise InputError(
            f"the system {loaded.system!r} has no key `store`; `storage` is of cases with system: structure"
        )
    with showing_progress(quiet=quiet):
        found = cases.system(loaded.system).system(loaded).storage(motion=False if at_rest else None)
    if not quiet:
        showing.show(found.answer(), level=answer.EVERYWHERE)
    shared.write_files(found.answer(), found.named, output=output, figure=figure, report=report)
    if check and found.margins and found.margins[1].negative:
        raise RunFailed(f"the margin of {', '.join(map(repr, found.margins[1].negative))} is below 0", found)
