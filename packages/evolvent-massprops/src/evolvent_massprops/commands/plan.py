"""The command `evolvent plan`."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import click

from evolvent_base import files
from evolvent_base.console import echo, made_table, once, showing_progress
from evolvent_base.errors import InputError
from evolvent_base.overrides import parse_assignments

if TYPE_CHECKING:
    from evolvent_massprops.planning import Option, Plan

#: Inputs that are shown, and quantities of which each has its column.
_MOST_ROWS, _MOST_QUANTITIES = 6, 3


@click.command()
@click.argument("stand", metavar="STAND.YAML|CASE")
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
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the file or case.")
def plan(stand: str, uncertainty: str, runs: int | None, output: str | None, assignments: tuple[str, ...]) -> None:
    """Plan a measurement on springs: where to pull, how fast and how long to record, with which sensors and mountings.

    STAND.YAML describes the stand as for `evolvent identify`. Unknowns have the value that is expected (Ixx: unknown
    near 3700 kg m^2), and `plan` states the pull (plan: {force: 1000 N, noise: 0.1 mm}). A case of the system
    inertia-stand, by its name or file, is taken as a stand that is known, with unknown Ixx and Izz.

    \b
    evolvent plan stand.yaml --uncertainty 0.2%
    evolvent plan inertia-stand --uncertainty 0.1% --set body.offset_x='0.3 m'
    evolvent plan stand.yaml --uncertainty 0.2% --check 200 -o plan.png
    """  # noqa: D301
    from evolvent_base import plots
    from evolvent_massprops import planning

    overrides = parse_assignments(assignments)
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
            f"{runs} simulated recordings: deviation by noise over the predicted one: {texts} "
            f"(each to {1.0 / math.sqrt(2.0 * runs):.0%})"
        )
    if drawn is not None and output is not None:
        from evolvent_massprops.mode_figures import planned

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

    console, best, several = Console(highlight=False), found.best, len(found.names) > 1
    record = f"{best.duration:.3g} s at {best.rate:.4g} Hz ({best.samples} samples)"
    verdict = f"release the pull at {best.label} and record {record}"
    if several:
        verdict = f"make {len(found.names)} recordings, each of {record}"
    if not best.reached:
        verdict = f"{100.0 * found.wanted:.3g} % is not reached; nearest: {verdict}"
    console.print(Text(verdict, style="bold"), soft_wrap=True)
    tables = [*([_recordings(found)] if several else []), _expected(found)]
    console.print(f"U (k = {found.factor:g}) over the value; in brackets what the noise alone gives")
    tables += [
        _options(title, options)
        for title, options in (("pulls", found.pulls), ("rates", found.rates), ("sensors", found.sensors))
        if len(options) > 1
    ]
    if found.sets:
        tables.append(_mountings("mountings that suffice", "recordings with the body",
                                 [(", ".join(one.names), one.option) for one in found.sets]))  # fmt: skip
    if found.further:
        title = "one mounting more, each recording as long"
        tables.append(_mountings(title, "rotation", [(one.rotation, one.option) for one in found.further]))
    tables.append(_modes(found))
    if found.floor:
        table = made_table("what a longer record does not improve", "", "part of U, over the value")
        for label, share in found.floor[:_MOST_ROWS]:
            table.add_row(label, f"{100.0 * share:.3g} %")
        tables.append(table)
    tables.append(_needs(found))
    if found.calibrations:
        tables.append(_calibrations(found))
    rules = made_table("the paper's rules and the Cramér-Rao bound", "", "asks", "the bound gives", "holds")
    for rule in found.rules:
        rules.add_row(rule.name, rule.asks, rule.finds, rule.verdict)
    for table in (*tables, rules):
        console.print()
        console.print(table)
    for text in found.warnings:
        console.print(Text.assemble(("warning: ", "yellow"), text), soft_wrap=True)


def _expected(found: Plan) -> Any:
    """Every quantity that is asked, with the uncertainties of the recommended plan."""
    best = found.best
    table = made_table("what it gives", "", "expected", "U", "unit", "over the value", "by noise alone")
    for key, value, std, unit, share, noise in zip(
        best.keys, best.values, best.std, found.units, best.relative, best.noise, strict=True
    ):
        relative = ["-" if math.isnan(x) else f"{100.0 * x:.3g} %" for x in (share, noise)]
        table.add_row(key, f"{value:.6g}", f"{found.factor * std:.3g}", unit, *relative)
    return table


def _recordings(found: Plan) -> Any:
    """How the body is mounted and set swinging in each of several recordings."""
    table = made_table("recordings", "", "rotation", "pull", "least energy J")
    for name, rotation, pull in zip(found.names, found.rotations, found.best.pulls, strict=True):
        table.add_row(name, rotation, pull.label, f"{pull.least:.3g}")
    return table


def _modes(found: Plan) -> Any:
    """The modes of every recording as they will be identified."""
    from evolvent_massprops.rounding import shown

    head = ("frequency rad/s", "decay rate 1/s", "damping ratio", "energy J", "amplitude mm")
    table = made_table("modes", "", *head)
    last = None
    for k, m in enumerate(found.modes):
        first = f"mode {k + 1}" if not m.recording else "" if m.recording == last else m.recording
        last = m.recording
        table.add_row(
            first, shown(m.frequency, m.frequency_std), shown(m.decay_rate, m.decay_rate_std),
            shown(m.damping_ratio, m.damping_ratio_std), f"{m.energy:.3g}", f"{1e3 * m.amplitude:.3g}",
        )  # fmt: skip
    return table


def _needs(found: Plan) -> Any:
    """How well the stand has to be known, and other inputs that count."""
    from evolvent_massprops.spring_keys import CALIBRATED

    title = f"u that {100.0 * found.wanted:.3g} % needs, with the others as stated, and with all else exact"
    table = made_table(title, "", "value", "u stated", "part of U", "needed", "all else exact", "unit")
    for one in found.needs[: len(CALIBRATED) + _MOST_ROWS]:
        stated = f"{one.std:.3g}" if one.std else "exact"
        part = f"{100.0 * one.part:.3g} %" if one.std else "-"
        needed = f"{one.needed:.3g}" if one.needed > 0.0 else "not by it alone"
        table.add_row(one.key, f"{one.value:.6g}", stated, part, needed, f"{one.alone:.3g}", one.unit)
    return table


def _calibrations(found: Plan) -> Any:
    """What ways of calibrating the stand give."""
    from evolvent_massprops.spring_keys import CALIBRATED

    head = ("largest U", "u(a)/a", "u(b)/b", "u(k)/k", "")
    table = made_table("half-length a, half-width b and mean stiffness k, calibrated", "", *head)
    for one in found.calibrations:
        worst = f"{100.0 * one.option.worst:.3g} %" if math.isfinite(one.option.worst) else "-"
        cells = ["-" if math.isnan(one.std[key]) else f"{100.0 * one.std[key]:.2g} %" for key in CALIBRATED]
        text = one.option.reason.removeprefix("the data do not determine the unknowns: ")
        table.add_row(one.label, worst, *cells, text or ("reached" if one.option.reached else "not reached"))
    return table


def _mountings(title: str, head: str, rows: list[tuple[str, Option]]) -> Any:
    """The largest uncertainty with some recordings, or what they leave open."""
    table = made_table(title, head, "largest U, over the value", "")
    for label, option in rows:
        text = option.reason.removeprefix("the data do not determine the unknowns: ")
        text = re.sub(r"; \d mountings? of the body (is|are) recorded.*", "", text)
        worst = f"{100.0 * option.worst:.3g} %" if math.isfinite(option.worst) else "-"
        table.add_row(label, worst, text or ("reached" if option.reached else "not reached"))
    return table


def _options(title: str, options: tuple[Option, ...]) -> Any:
    """Options one below the other; of more than a few quantities that of the largest uncertainty."""
    keys = next((o.keys for o in options if o.keys), ())
    few = len(keys) <= _MOST_QUANTITIES
    energy = ("least energy J",) if title == "pulls" else ()
    table = made_table(title, "", *energy, "record s", "rate Hz", *(keys if few else ("largest",)))
    for o in options:
        first = {"pulls": o.label, "rates": f"{o.samples} samples"}.get(
            title, "sensors " + " ".join(map(str, o.sensors))
        )
        cells = [
            "-" if math.isnan(r) else f"{100.0 * r:.3g} % ({100.0 * n:.2g} %)"
            for r, n in zip(o.relative, o.noise, strict=True)
        ]
        if cells and not few:
            worst = max(range(len(cells)), key=lambda k: -1.0 if math.isnan(o.relative[k]) else o.relative[k])
            cells = [f"{keys[worst]} {cells[worst]}"]
        length = f"{o.duration:.3g}" + ("" if o.reached else " at most")
        least = (f"{o.pulls[0].least:.3g}",) if energy else ()
        table.add_row(first, *least, length, f"{o.rate:.4g}", *(cells or [o.reason]))
    return table
