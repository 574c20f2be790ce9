"""The command `evolvent reflector`."""

from __future__ import annotations

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import showing_progress
from evolvent_base.errors import InputError, RunFailed

answer = lazy.load("evolvent_base.answer", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
results = lazy.load("evolvent.analysis.reflector_results", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@shared.single("--after", metavar="RUN.NC", text="State the surface at the end of a run of the case beside it.")
@click.option(
    "--check",
    is_flag=True,
    help="Exit with code 1 where a cord is slack, the limit is exceeded, or another surface fits.",
)
@shared.output("REFLECTOR.JSON|CSV", "Keep nodes, cut lengths, tensions and errors as a file.")
@shared.single("--figure", metavar="REFLECTOR.PNG", text="Draw the net and its tensions.")
@shared.single("--report", metavar="REFLECTOR.HTML", text="Write everything on one page.")
@shared.quiet("Print no tables and no progress.")
def reflector(
    case: str, assignments: tuple[str, ...], after: str | None, check: bool, output: str | None, figure: str | None,
    report: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Show what the net of a CASE is as a reflector: lengths to cut, tensions, errors of its surface, tolerances.

    The form follows from force densities, on a rim that bends under the tensions. The key reflector of the case says
    at which frequency, with which errors of lengths and at which change of temperature it is judged.

    \b
    evolvent reflector rib-antenna --figure net.png
    evolvent reflector rib-antenna --set reflector.frequency="12 GHz" -o cut.json
    evolvent reflector rib-antenna --after run.nc
    """  # noqa: D301
    if output is not None:
        results.ReflectorResults.check_ending(output)
    shared.check_files(output=output, figure=figure, report=report)
    loaded = cases.load(case, cases.parse_assignments(assignments))
    if "reflector" not in type(loaded).model_fields:
        raise InputError(
            f"the system {loaded.system!r} has no key `reflector`; the command is for cases with system: structure"
        )
    with showing_progress(quiet=quiet):
        found = cases.system(loaded.system).system(loaded).reflector(**({} if after is None else {"after": after}))
    shown = found.answer()
    if not quiet:
        showing.show(shown, level=answer.EVERYWHERE)
    shared.write_files(shown, found.named, output=output, figure=figure, report=report)
    if check and found.fails:
        raise RunFailed(f"{found.name!r} fails: {'; '.join(found.fails)}", found)
