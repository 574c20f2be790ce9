"""The command `evolvent plan`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import click
import lazy_loader as lazy

from evolvent_base import options as shared
from evolvent_base.console import echo, once, showing_progress
from evolvent_base.errors import InputError
from evolvent_base.overrides import parse_assignments

planning = lazy.load("evolvent_massprops.planning", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
torsion_rig = lazy.load("evolvent_massprops.torsion_rig", suppress_warning=True)

#: Lengths of the record in the figure.
_POINTS = 24


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
    inertia-stand, by its name or file, is taken as a stand that is known, with unknown Ixx and Izz. Of a torsion rig
    the orientations are planned, and how often each is clamped (plan: {Ixx: 2.2 kg m^2, Izz: 2.3 kg m^2}).

    \b
    evolvent plan stand.yaml --uncertainty 0.2%
    evolvent plan inertia-stand --uncertainty 0.1% --set body.offset_x='0.3 m'
    evolvent plan stand.yaml --uncertainty 0.2% --check 200 -o plan.png
    """  # noqa: D301
    overrides = parse_assignments(assignments)
    wanted = _share(uncertainty)
    shared.check_files(figure=output)
    if torsion_rig.states_rig(stand, overrides):
        _rig(stand, wanted, runs, output, overrides)
        return
    with showing_progress(quiet=False):
        found = planning.plan(stand, wanted, overrides, points=0 if output is None else _POINTS)
        ratios = None if runs is None else planning.check(stand, found.best, overrides, runs=runs)
    answer = found.answer()
    showing.show(answer)
    if ratios is not None and runs is not None:
        _checked(runs, "recordings", dict(zip(found.best.keys, ratios, strict=True)))
    shared.write_files(answer, figure=output)


def _rig(stand: str, wanted: float, runs: int | None, output: str | None, overrides: dict[str, Any]) -> None:
    """Orientations of a part on a torsion rig, and how often each is clamped."""
    found = torsion_rig.plan(stand, wanted, overrides)
    answer = found.answer()
    showing.show(answer)
    if runs is not None:
        _checked(runs, "measurements", torsion_rig.check(stand, found.best, overrides, runs=runs))
    shared.write_files(answer, figure=output)


def _checked(runs: int, of: str, ratios: Mapping[str, float]) -> None:
    """State how simulated measurements scatter."""
    texts = ", ".join(f"{key} {'-' if math.isnan(ratio) else format(ratio, '.2f')}" for key, ratio in ratios.items())
    echo(
        f"{runs} simulated {of}: deviation by noise over the predicted one: {texts} "
        f"(each to {1.0 / math.sqrt(2.0 * runs):.0%})"
    )


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
