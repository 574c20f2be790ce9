"""The command `evolvent design`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared, progress
from evolvent_base.console import showing_progress
from evolvent_base.errors import InputError, RunFailed

cases = lazy.load("evolvent.cases", suppress_warning=True)
search = lazy.load("evolvent.design.optimization.search", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--vary", multiple=True, metavar="KEY[=BOUNDS]", help="A key that varies: 'KEY=0.1 to 0.5 N m/rad', "
              "'KEY=50% to 200%', 'KEY=[a, b, c]'; keys with commas vary together.  [bounds: 50% to 200%]")  # fmt: skip
@click.option("--minimize", multiple=True, metavar="NAME", help="A result, such as 'hinge 1.latch_work.last'; of "
              "several, the sum.")  # fmt: skip
@click.option("--maximize", multiple=True, metavar="NAME", help="The same, to be maximized.")
@click.option("--subject-to", multiple=True, metavar="REQUIREMENT", help="'hinge 1.latch_time <= 20 s', 'margin >= 0'.")
@click.option("--disperse", multiple=True, metavar="KEY=DISTRIBUTION", help="Disperse a key about every design: "
              "objective and requirements are then quantiles.")  # fmt: skip
@click.option("--samples", type=click.IntRange(min=2), default=32, show_default=True, metavar="N", help="Runs of every "
              "design, with --disperse.")  # fmt: skip
@click.option("--quantile", type=float, default=95.0, show_default=True, metavar="PERCENT", help="Of the dispersion.")
@click.option("--tolerance", multiple=True, metavar="KEY=TOLERANCE", help="A tolerance whose cost is found.  "
              "[default: 1% of every key that varies]")  # fmt: skip
@click.option("--starts", type=click.IntRange(min=1), default=1, show_default=True, metavar="N", help="Searches, for "
              "every combination of choices.")  # fmt: skip
@click.option("--optimizer", type=str, default="slsqp", show_default=True, metavar="NAME", help="slsqp, or cobyqa "
              "(without derivatives).")  # fmt: skip
@click.option("--derivatives", type=str, default="auto", show_default=True, metavar="NAME", help="differences; adjoint "
              "or discrete: those of the discrete solution where a run has them; auto: the cheaper of the adjoint and "
              "differences.")  # fmt: skip
@click.option("--runs", type=click.IntRange(min=1), default=5000, show_default=True, metavar="N", help="Runs at most.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, metavar="N", help="Of the starts and "
              "the dispersion.")  # fmt: skip
@shared.assignments
@shared.output("DESIGN.YAML", "The case with the design, for evolvent run.")
@shared.single("--report", metavar="DESIGN.HTML", text="Write everything on one page.")
@shared.single("--figure", metavar="DESIGN.PNG", text="Draw the search and the design between its bounds.")
@shared.workers
@shared.quiet()
def design(case: str, **options: Any) -> None:
    """Find values of keys of a CASE that minimize a result and meet requirements.

    The exit code is 1 where no design meets all requirements; the nearest one is written all the same.

    \b
    evolvent design solar-array --vary "parts.hinge 1.stiffness=0.1 to 0.4 N m/rad" \\
        --minimize "hinge 1.latch_work.last" --subject-to "margin >= 0" --subject-to "hinge 1.latch_time <= 15 s"
    """  # noqa: D301
    output, page, picture = options["output"], options["report"], options["figure"]
    shared.check_output(output, case, "design.yaml")
    shared.check_files(figure=picture, report=page)
    if not 50.0 <= options["quantile"] < 100.0:
        raise InputError(f"--quantile is {options['quantile']:g}; it must be from 50 and below 100, in percent")

    def show(runs: int, best: float) -> None:
        progress.report("searching" if best != best else f"searching, best {best:.5g}", runs, unit="runs")

    with showing_progress(quiet=options["quiet"]):
        found = search.optimize(
            case, vary=_pairs("--vary", options["vary"], "KEY=BOUNDS", bare=True), minimize=options["minimize"],
            maximize=options["maximize"], subject_to=options["subject_to"],
            disperse=_pairs("--disperse", options["disperse"], "KEY=DISTRIBUTION"), samples=options["samples"],
            quantile=options["quantile"] / 100.0,
            tolerances=_pairs("--tolerance", options["tolerance"], "KEY=TOLERANCE") or None, starts=options["starts"],
            optimizer=options["optimizer"], derivatives=options["derivatives"], most_runs=options["runs"],
            seed=options["seed"], workers=options["workers"], overrides=cases.parse_assignments(options["assignments"]),
            progress=show,
        )  # fmt: skip
    answer = found.answer()
    if not options["quiet"]:
        showing.show(answer)
    shared.write_files(answer, "case", output=output, figure=picture, report=page)
    if not found.met:
        raise RunFailed(f"no design that was tried meets all requirements; missed: {'; '.join(found.missed())}", found)


def _pairs(option: str, given: Iterable[str], form: str, *, bare: bool = False) -> dict[str, Any]:
    """Keys and values of an option that may be given several times; a value in brackets is a list.

    Parameters
    ----------
    bare : whether a key may stand alone
    """
    found: dict[str, Any] = {}
    for text in given:
        keys, equals, value = (part.strip() for part in text.partition("="))
        if not keys or (not equals and not bare) or (equals and not value):
            raise InputError(f"{option} {text!r} is not of the form {form}")
        if keys in found:
            raise InputError(f"{option} gives {keys!r} twice; give it once")
        is_list = bool(re.fullmatch(r"\[.*\]", value))
        found[keys] = cases.parse_yaml(value, f"{option} {keys}") if is_list else value or None
    return found
