"""The command `evolvent plan`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from evolvent.base import files
from evolvent.base.console import echo, once, showing_progress
from evolvent.base.errors import InputError

if TYPE_CHECKING:
    from evolvent.massprops.planning import Option, Plan

#: Inputs that are shown.
_MOST_ROWS = 6


@click.command()
@click.argument("stand", metavar="STAND.YAML")
@click.option(
    "--uncertainty",
    required=True,
    metavar="0.1%",
    help="Wanted: U over the value, of every mass and moment that is asked.",
)
@click.option("--check", "runs", type=click.IntRange(10, 100_000), metavar="RUNS", help="Simulate so many recordings.")
@click.option(
    "-o", "--output", multiple=True, callback=once, metavar="FIGURE.PNG", help="Draw uncertainty over record length."
)
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the description.")
def plan(stand: str, uncertainty: str, runs: int | None, output: str | None, assignments: tuple[str, ...]) -> None:
    """Plan a measurement on springs: which spring to load, how fast and how long to record, with which sensors.

    STAND.YAML describes the stand as for `evolvent identify`. Unknowns have the value that is expected (Ixx: unknown
    near 3700 kg m^2), and `plan` states the pull (plan: {force: 1000 N, noise: 0.1 mm}).

    \b
    evolvent plan stand.yaml --uncertainty 0.2%
    evolvent plan stand.yaml --uncertainty 0.2% --check 200 -o plan.png
    """  # noqa: D301
    from evolvent import cases
    from evolvent.massprops import planning
    from evolvent.view import plots

    overrides = cases.parse_assignments(assignments)
    wanted = _share(uncertainty)
    if output is not None:
        plots.format_of(output)
        files.check_writable(output)
    with showing_progress(quiet=False):
        found = planning.plan(stand, wanted, overrides)
        ratios = None if runs is None else planning.check(stand, found.best, overrides, runs=runs)
        drawn = None if output is None else planning.curves(stand, found, overrides)
    _print(found)
    if ratios is not None and runs is not None:
        texts = ", ".join(
            f"{key} {'-' if math.isnan(ratio) else format(ratio, '.2f')}"
            for key, ratio in zip(found.best.keys, ratios, strict=True)
        )
        echo(
            f"{runs} simulated recordings: deviation by noise over the promised one: {texts} "
            f"(each to {1.0 / math.sqrt(2.0 * runs):.0%})"
        )
    if drawn is not None and output is not None:
        from evolvent.massprops.mode_figures import planned

        echo(f"figure: {plots.save(planned(*drawn, found), output)}")


def _share(text: str) -> float:
    """A relative uncertainty, such as 0.1% or 0.001."""
    allowed = f"--uncertainty is {text!r}; it must be a share such as 0.1% or 0.001"
    try:
        value = float(text.strip().removesuffix("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError:
        raise InputError(allowed) from None
    if not 0.0 < value <= 1.0:
        raise InputError(f"{allowed}, above 0 and at most 100%")
    return value


def _print(found: Plan) -> None:
    """Print what is recommended, what was compared, what limits it, and the paper's rules."""
    from rich.console import Console
    from rich.text import Text

    from evolvent.commands.massprops import made_table

    console, best = Console(highlight=False), found.best
    verdict = (
        f"release the pull at spring {best.spring} and record {best.duration:.3g} s at {best.rate:.4g} Hz "
        f"({best.samples} samples)"
    )
    if best.reached:
        console.print(Text(verdict, style="bold"), soft_wrap=True)
    else:
        console.print(
            Text(f"{100.0 * found.wanted:.3g} % is not reached; nearest: {verdict}", style="bold"), soft_wrap=True
        )
    console.print(f"U (k = {found.factor:g}) over the value; in brackets what the noise alone gives")
    for title, options in (("springs", found.springs), ("rates", found.rates), ("sensors", found.sensors)):
        if len(options) > 1:
            console.print()
            console.print(_options(made_table, title, options))
    if found.floor:
        table = made_table("what a longer record does not improve", "", "part of U, over the value")
        for label, share in found.floor[:_MOST_ROWS]:
            table.add_row(label, f"{100.0 * share:.3g} %")
        console.print()
        console.print(table)
    console.print()
    rules = made_table("the paper's rules and the Cramér-Rao bound", "", "asks", "the bound gives", "holds")
    for rule in found.rules:
        rules.add_row(rule.name, rule.asks, rule.finds, rule.verdict)
    console.print(rules)
    for text in found.warnings:
        console.print(Text.assemble(("warning: ", "yellow"), text), soft_wrap=True)


def _options(made_table: Any, title: str, options: tuple[Option, ...]) -> Any:
    keys = next((o.keys for o in options if o.keys), ())
    table = made_table(title, "", "record s", "rate Hz", *keys)
    for o in options:
        first = {"springs": f"spring {o.spring}", "rates": f"{o.samples} samples"}.get(
            title, "sensors " + " ".join(map(str, o.sensors))
        )
        cells = [
            "-" if math.isnan(r) else f"{100.0 * r:.3g} % ({100.0 * n:.2g} %)"
            for r, n in zip(o.relative, o.noise, strict=True)
        ]
        length = f"{o.duration:.3g}" + ("" if o.reached else " at most")
        table.add_row(first, length, f"{o.rate:.4g}", *(cells or [o.reason]))
    return table
