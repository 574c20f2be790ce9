"""The command `evolvent sensitivity`."""

from __future__ import annotations

from typing import Any

import click

from evolvent_base import files, options as shared
from evolvent_base.console import echo, made_table, showing_progress


@click.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--of", "values", multiple=True, required=True, metavar="VALUE", help="A value of the run.")
@click.option("--by", "keys", multiple=True, required=True, metavar="KEY", help="A key of a part that holds a number.")
@click.option("--adjoint", is_flag=True, help="By one pass back through the run, for many keys.")
@shared.assignments
@shared.output("FILE.CSV", "Write the table as a file.")
@shared.quiet("Print no table and no progress.")
def sensitivity(
    case: str, values: tuple[str, ...], keys: tuple[str, ...], adjoint: bool, assignments: tuple[str, ...],
    output: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Find derivatives of values of a CASE's run by keys of its parts.

    They are those of the discrete solution, through latches and contacts as well. The last column is the relative
    change of the value by that of the key.

    \b
    evolvent sensitivity solar-array --of "hinge 1.latch_time" --by "parts.hinge 1.stiffness" --by "parts.panel 1.mass"
    """  # noqa: D301
    from evolvent import cases
    from evolvent_base.errors import InputError

    if output is not None:
        if not output.endswith(".csv"):
            raise InputError(f"-o is {output!r}; the table is written as CSV, with the ending .csv")
        files.check_writable(output)
    loaded = cases.load(case, cases.parse_assignments(assignments))
    definition = cases.system(loaded.system)
    with showing_progress(quiet=quiet):
        found = definition.system(loaded).sensitivity(
            list(values), list(keys), mode="adjoint" if adjoint else "forward"
        )
    rows = _rows(found)
    if not quiet:
        _print(rows, found.attrs)
    if output is not None:
        import csv
        import io

        table = io.StringIO(newline="")
        csv.writer(table).writerows(rows)
        files.write_file(output, table.getvalue())
        echo(f"sensitivities: {output}")


def _rows(found: Any) -> list[list[str]]:
    """The table, its heading first."""
    rows = [["value", "key", "derivative", "unit", "relative", "error"]]
    for i, value in enumerate(found["value"].values):
        for j, key in enumerate(found["key"].values):
            derivative, relative = float(found.derivative[i, j]), float(found.relative[i, j])
            error = f"{float(found.derivative_error[i, j]):.2g}" if "derivative_error" in found else "-"
            unit = str(found.unit.values[i, j])
            rows.append([str(value), str(key), f"{derivative:.7g}", unit, f"{relative:.5g}", error])
    return rows


def _print(rows: list[list[str]], attrs: Any) -> None:
    from rich.console import Console

    table = made_table(f"sensitivities, by {attrs['method']}", *rows[0])
    for row in rows[1:]:
        table.add_row(*row)
    console = Console(highlight=False)
    console.print(table)
    if "integration" in attrs:
        console.print(attrs["integration"], soft_wrap=True)
    if "warning" in attrs:
        console.print(f"warning: {attrs['warning']}", soft_wrap=True)
