"""The command `evolvent fmu`."""

from __future__ import annotations

import os

import click

from evolvent.errors import InputError
from evolvent.studies.command import once


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the case.")
@click.option("-o", "--output", multiple=True, callback=once, metavar="MODEL.FMU", help="[default: CASE.fmu]")
@click.option(
    "--bodies", multiple=True, callback=once, metavar="NAME,NAME", help="Whose in- and outputs. [default: all]"
)
@click.option("--method", multiple=True, callback=once, metavar="NAME", help="The same as --set solver.method=NAME.")
@click.option("--step", multiple=True, callback=once, metavar="TIME", help="The same as --set solver.step=TIME.")
@click.option(
    "--until", type=float, metavar="S", help="End of the time that can be stepped through. [default: the run's]"
)
def fmu(
    case: str,
    assignments: tuple[str, ...],
    output: str | None,
    bodies: str | None,
    method: str | None,
    step: str | None,
    until: float | None,
) -> None:
    """Write a CASE as an FMU 3.0 for co-simulation.

    Force and torque on bodies go in; position, velocity, quaternion, rate and the structure's force and torque come
    out. Whoever runs it needs a Python with evolvent.
    """
    from evolvent import cases, results

    given = [f"solver.{key}={value}" for key, value in (("method", method), ("step", step)) if value is not None]
    overrides = cases.parse_assignments([*assignments, *given])
    target = os.path.splitext(os.path.basename(case))[0] + ".fmu" if output is None else output
    results.claim(target)
    if os.path.exists(target) and os.path.exists(case) and os.path.samefile(case, target):
        raise InputError(f"-o {target!r} is the case file itself; name another, such as 'model.fmu'")
    names = None if bodies is None else [name.strip() for name in bodies.split(",")]
    from evolvent.fmu.write import write

    click.echo(f"fmu: {write(case, target, overrides=overrides, bodies=names, until=until)}")
