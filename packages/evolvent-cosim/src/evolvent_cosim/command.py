"""The command `evolvent fmu`."""

from __future__ import annotations

import os

import click

from evolvent_base import files, options as shared
from evolvent_base.console import echo, once
from evolvent_base.errors import InputError


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@click.option("-o", "--output", multiple=True, callback=once, metavar="UNIT.FMU", help="[default: CASE.fmu]")
@click.option(
    "--inputs", multiple=True, callback=once, metavar="BODY,BODY", help="Bodies on which the importer sets forces."
)
@click.option(
    "--outputs",
    multiple=True,
    callback=once,
    metavar="NAME,NAME",
    help="Results in addition to position, attitude, velocity and rate of bodies.",
)
def fmu(case: str, assignments: tuple[str, ...], output: str | None, inputs: str | None, outputs: str | None) -> None:
    """Write a CASE as a functional mock-up unit (FMI 3.0, co-simulation).

    \b
    evolvent fmu boom-slew --inputs hub --outputs boom.tip.position,boom.tip_deflection.y

    Other simulators import it on this machine: the model runs in the Python that wrote it.
    """  # noqa: D301  (click wants the \b)
    from evolvent import cases  # help does without it

    stem = os.path.splitext(os.path.basename(case))[0]
    target = f"{stem}.fmu" if output is None else output
    files.check_writable(target)
    if os.path.exists(target) and os.path.exists(case) and os.path.samefile(case, target):
        raise InputError(f"-o {target!r} is the case file itself; name another, such as '{stem}.fmu'")
    from evolvent_cosim.fmu import contents, write  # help does without it

    write.platform_of()  # before anything is compiled
    write.compiler()
    made = contents.contents(case, cases.parse_assignments(assignments), _names(inputs), _names(outputs))
    write.write(made, target)
    kinds = [variable.causality for variable in made.variables]
    echo(
        f"fmu: {target}, {kinds.count('input')} inputs, {kinds.count('output')} outputs, "
        f"{kinds.count('parameter')} parameters"
    )


def _names(text: str | None) -> list[str]:
    return [name.strip() for name in (text or "").split(",") if name.strip()]
