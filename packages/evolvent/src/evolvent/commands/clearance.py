"""The command `evolvent clearance`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared, progress
from evolvent_base.console import echo, showing_progress
from evolvent_base.errors import InputError, RunFailed

if TYPE_CHECKING:
    from evolvent.analysis.clearance_results import Clearances

cases = lazy.load("evolvent.cases", suppress_warning=True)
distances = lazy.load("evolvent.analysis.clearance", suppress_warning=True)
export = lazy.load("evolvent.commands.export", suppress_warning=True)
request = lazy.load("evolvent.exports.request", suppress_warning=True)
results = lazy.load("evolvent.results", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
shown = lazy.load("evolvent.analysis.clearance_results", suppress_warning=True)

#: Endings of animations.
_MOVING = (".html", ".gif", ".mp4")


@click.command()
@click.argument("run", metavar="RUN.NC|CASE|FILE")
@click.option("--pair", "pairs", multiple=True, metavar="BODY,BODY",
              help="A pair that is checked.  [default: all that no joint holds together]")  # fmt: skip
@shared.assignments
@click.option("--check", is_flag=True, help="Exit with code 1 where bodies interfere.")
@shared.output("CLEARANCE.NC|JSON", "Keep all distances as a file.")
@shared.single("--figure", metavar="CLEARANCE.PNG", text="Draw clearances over time.")
@shared.single(
    "--animation", metavar="RUN.HTML|GIF|MP4", text="Write the animation, in which bodies that interfere are red."
)
@shared.quiet()
def clearance(
    run: str, pairs: tuple[str, ...], assignments: tuple[str, ...], check: bool, output: str | None,
    figure: str | None, animation: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Find clearances between the bodies of a results file, or of the run of a CASE: smallest ones and interference.

    Rigid bodies with a shape are checked, at all samples; beams, rods and threads are not. Needs the package coal
    (evolvent[clearance]).

    \b
    evolvent clearance solar-array --figure clearance.png
    evolvent clearance run.nc --pair "panel 1,satellite" --check
    """  # noqa: D301
    if output is not None:
        shown.Clearances.check_ending(output)
    if animation is not None and os.path.splitext(animation)[1] not in _MOVING:
        raise InputError(f"--animation is {animation!r}; its name must end in {', '.join(_MOVING)}")
    shared.check_files(output=output, figure=figure, animation=animation)
    asked = [_pair(text) for text in pairs] or None
    distances.check_package()
    made = _run(run, assignments, quiet)
    found = distances.clearances(made, asked)
    answer = found.answer()
    if not quiet:
        showing.show(answer)
    shared.write_files(answer, found.named, output=output, figure=figure)
    if animation is not None:
        _write_animation(made, animation, found)
    if check and found.interfering:
        raise RunFailed(f"bodies interfere: {', '.join(found.interfering)}", found)


def _write_animation(run: Any, path: str, found: Clearances) -> None:
    """Write the animation in the format that its name has."""
    with showing_progress():
        echo(f"animation: {export.writer(os.path.splitext(path)[1][1:])(run, path, request.Request(clearance=found))}")


def _pair(text: str) -> list[str]:
    """The names of --pair."""
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or not all(names):
        raise InputError(f"--pair is {text!r}; it must be two names of bodies, such as 'panel 1,satellite'")
    return names


def _run(source: str, assignments: tuple[str, ...], quiet: bool) -> Any:
    """The run of a results file, or of a case."""
    from evolvent.analysis import accessor as accessor  # registers run.ev, with the engine

    if os.path.splitext(source)[1] == ".nc":
        if assignments:
            raise InputError("--set is for cases; a results file has run already")
        return results.open(source)
    loaded = cases.load(source, cases.parse_assignments(assignments))
    plan = cases.system(loaded.system).plan(loaded)
    with showing_progress(quiet=quiet or not plan.solver):
        found = plan.run(lambda reached: progress.report("running", reached, plan.duration, "s"))
    if found.attrs["status"] == "failed":
        raise RunFailed(found.attrs["message"], found)
    return found
