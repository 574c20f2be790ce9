"""The command `evolvent disperse`."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import click
import lazy_loader as lazy

from evolvent.commands.sweep import Reached
from evolvent_base import options as shared
from evolvent_base.console import INTERRUPTED, figure_format, say, showing_progress
from evolvent_base.errors import InputError, RunFailed

if TYPE_CHECKING:
    from evolvent.design.studies import Study

cases = lazy.load("evolvent.cases", suppress_warning=True)
dispersed = lazy.load("evolvent.design.dispersions.dispersed", suppress_warning=True)
order = lazy.load("evolvent.design.dispersions.order", suppress_warning=True)
progress = lazy.load("evolvent_base.progress", suppress_warning=True)
runner = lazy.load("evolvent.design.studies.runner", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
st = lazy.load("evolvent.design.studies.study", suppress_warning=True)
store = lazy.load("evolvent.design.studies.store", suppress_warning=True)

#: Names in a key of a case, and several keys that share one draw.
_KEYS = r"\w+(?:\.\w[\w -]*)*(?:\s*,\s*\w+(?:\.\w[\w -]*)*)*"


@click.command()
@click.argument("case", metavar="CASE|STUDY|FILE")
@click.option("--vary", multiple=True, metavar="KEY=DISTRIBUTION", help="Draw a key; keys with commas share one draw.")
@click.option("--correlate", multiple=True, metavar="KEY,KEY=VALUE", help="Correlation of two keys, from -1 to 1.")
@click.option("--keep", multiple=True, metavar="NAME", help="A result, such as 'hinge 1.latch_time.last'.")
@shared.assignments
@shared.single(
    "--sample", metavar="WAY",
    text="monte-carlo, latin-hypercube, sobol, saltelli (indices of Sobol) or corners.  [default: monte-carlo]",
)  # fmt: skip
@click.option("--samples", type=click.IntRange(min=1), metavar="N", help="Number of samples.  [default: the fewest "
              "that give the bound; 59 for 95/95]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the random numbers.  [default: 0]")
@click.option("--coverage", type=float, default=95.0, show_default=True, metavar="PERCENT", help="Runs within a bound.")
@click.option("--confidence", type=float, default=95.0, show_default=True, metavar="PERCENT", help="Of bounds.")
@shared.output("DIR", "Folder of runs, report, tables and figures.  [default: CASE-dispersion]")
@shared.workers
@shared.scheduler
@click.option("--no-figures", is_flag=True, help="Write tables only: no figures and no report.")
@figure_format
@shared.quiet()
def disperse(case: str, **options: Any) -> None:
    """Run a CASE with dispersed keys and state bounds, quantiles and sensitivities of its results.

    \b
    evolvent disperse solar-array --vary "parts.hinge 1.stiffness=normal(nominal, 5%)" \\
        --keep "hinge 1.latch_time.last"

    Distributions: 10% (tolerance about the case's value), tolerance(-5%, 10%), uniform(LOW, HIGH), triangular(LOW,
    MODE, HIGH), normal(MEAN, STD), truncated-normal(MEAN, STD, LOW, HIGH), table(VALUE, VALUE, ...), table(FILE.csv),
    table(FILE.csv, COLUMN). Run the same command again to continue after Ctrl-C or any other end.
    """  # noqa: D301
    runner.check_installed()
    coverage, confidence = (_share(name, options[name]) for name in ("coverage", "confidence"))
    quiet, reached = options["quiet"], Reached()
    with showing_progress(quiet=quiet) as report_line:
        study = _study(case, options, coverage, confidence)
        folder = options["output"] or f"{study.name}-dispersion"
        try:
            found = dispersed.disperse(
                study, coverage=coverage, confidence=confidence, output=folder, workers=options["workers"],
                scheduler=options["scheduler"], progress=reached.reach, report=report_line,
            )  # fmt: skip
        except KeyboardInterrupt:
            report_line(
                f"stopped; {store.finished_cases(folder)} of {study.count} runs are kept in {folder}, and the same "
                f"command continues from there"
            )
            raise click.exceptions.Exit(INTERRUPTED) from None
        progress.report("writing tables and figures")
        answer = found.answer()
        written = showing.fill(answer, folder, kind=options["kind"], drawn=not options["no_figures"])
    if not quiet:
        showing.show(answer)
        say(f"results: {', '.join(written)} in {folder}")
    if len(found.failures) == found.count:
        raise RunFailed(f"all {found.count} runs failed; the first: {found.failures[0].reason}", found)


def _share(name: str, percent: float) -> float:
    """A percentage of an option as a share."""
    if not 0.0 < percent < 100.0:
        raise InputError(f"--{name} is {percent:g}; it must be above 0 and below 100, in percent")
    return percent / 100.0


def _study(case: str, options: Mapping[str, Any], coverage: float, confidence: float) -> Study:
    """The study of a case with the options, or the study of that name or file, changed by them."""
    changes: dict[str, Any] = {
        "over": dict(_pairs("--vary", options["vary"], _distribution)),
        "set": cases.parse_assignments(options["assignments"]),
    }
    changes |= {key: options[key] for key in ("sample", "samples", "seed") if options[key] is not None}
    if options["keep"]:
        changes["keep"] = list(options["keep"])
    if options["correlate"]:
        changes["correlation"] = [[*keys, value] for keys, value in _pairs("--correlate", options["correlate"], _pair)]
    if st.is_study(case):
        found = st.read(case, changes)
    else:
        if not changes["over"]:
            raise InputError("no key varies; give --vary 'KEY=DISTRIBUTION', such as 'parts.hinge 1.stiffness=10%'")
        if not options["keep"]:
            raise InputError("no result is kept; give --keep NAME, such as 'hinge 1.latch_time.last'")
        sample = changes.setdefault("sample", "monte-carlo")
        if sample == "monte-carlo":
            changes.setdefault("samples", order.least_runs(coverage, confidence))
        name = re.sub(r"[^\w.-]", "-", os.path.splitext(os.path.basename(case))[0])
        found = st.read({"study": name, "case": cases.content_of(case)}, changes)
    dispersed.check(found)
    if not found.keep:
        raise InputError(f"the study {found.name!r} keeps no results; give --keep NAME")
    return found


def _pairs(option: str, given: Iterable[str], read: Callable[[str, str, str], Any]) -> list[tuple[Any, Any]]:
    """Keys and values of an option that may be given several times; no keys twice."""
    found: dict[str, Any] = {}
    for text in given:
        keys, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not re.fullmatch(_KEYS, keys):
            form = "KEY=DISTRIBUTION, such as 'parts.hinge 1.stiffness=10%'"
            form = form if option == "--vary" else "KEY,KEY=VALUE, such as 'parts.a.mass, parts.b.mass=0.5'"
            raise InputError(f"{option} {text!r} is not of the form {form}")
        if keys in found:
            raise InputError(f"{option} gives {keys!r} twice; give it once")
        found[keys] = read(text, keys, value)
    return list(found.values())


def _distribution(text: str, keys: str, value: str) -> tuple[str, str]:
    return keys, value


def _pair(text: str, keys: str, value: str) -> tuple[list[str], float]:
    names = [name.strip() for name in keys.split(",")]
    try:
        number = float(value)
    except ValueError:
        number = 2.0
    if len(names) != 2 or not -1.0 <= number <= 1.0:
        raise InputError(f"--correlate {text!r} must name two keys and a number from -1 to 1")
    return names, number
