"""The command `evolvent identify`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click

from evolvent_base import files, progress
from evolvent_base.console import echo, made_table, once, showing_progress
from evolvent_base.errors import InputError, visible
from evolvent_base.overrides import parse_assignments

if TYPE_CHECKING:
    from evolvent_massprops.estimates import MassProperties
    from evolvent_massprops.modal import Modal

#: Rows of the budget that are shown.
_MOST_ROWS = 6
#: Results beside one another in a table of the budget.
_MOST_COLUMNS = 6
#: Warnings that are shown.
_MOST_WARNINGS = 8


@click.command()
@click.argument("signals", metavar="SIGNALS...", nargs=-1, required=True)
@click.option("--stand", metavar="STAND.YAML", help="Description of the signals, the stand and the body.")
@click.option("--variables", metavar="NAME,NAME", help="Columns, or variables of a run, that are the sensors.")
@click.option(
    "-o", "--output", multiple=True, callback=once, metavar="REPORT.HTML", help="Write a certificate as one HTML page."
)
@click.option("--figures", metavar="FOLDER", help="Draw signals, spectra and amplitudes of the modes into a folder.")
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the description.")
@click.option("--quiet", is_flag=True, help="Print no table.")
def identify(
    signals: tuple[str, ...],
    stand: str | None,
    variables: str | None,
    output: str | None,
    figures: str | None,
    assignments: tuple[str, ...],
    quiet: bool,
) -> None:
    """Find modes in recorded SIGNALS of free vibration, and with a stand the mass properties of the body on it.

    SIGNALS are CSV, TSV, TDMS, UFF 58, MAT, HDF5 or WAV files, or runs of evolvent. With a stand several recordings are
    averaged; of a body in several mountings, or with tare, they go into one estimate.

    \b
    evolvent identify slew.nc --variables boom.tip_deflection.y --set signals.start='2 s' --figures modes
    evolvent identify knock.csv --stand stand.yaml -o certificate.html
    """  # noqa: D301
    from evolvent_massprops import certificate, description
    from evolvent_massprops.measurement import mass_properties, vibration

    overrides = parse_assignments(assignments)
    columns = [name.strip() for name in (variables or "").split(",") if name.strip()]
    if figures is not None:
        files.check_writable_folder(figures)
    if stand is None:
        if output is not None:
            raise InputError(
                f"-o {output!r} asks for a certificate, which needs a description of the stand: give --stand"
            )
        with showing_progress(quiet=quiet):
            found_modes = [vibration(path, columns, overrides) for path in progress.track(signals, "finding modes")]
        for found in found_modes if not quiet else ():
            _vibration(found)
        _draw(figures, found_modes)
        return
    if output is not None:
        files.check_writable(output)
        _not_an_input(output, {stand: "the stand's file", **dict.fromkeys(signals, "one of the signals' files")})
    if columns:
        overrides = {"signals.sensors": [{"column": name} for name in columns]} | overrides
    given = description.load(stand, overrides)
    with showing_progress(quiet=quiet):
        measured = mass_properties(signals, given)
        if output is not None:
            progress.report("writing the certificate")
            certificate.write(measured, output)
    _draw(figures, [one.modal for one in measured.evaluations])
    if not quiet:
        _table(measured)
        if output is not None:
            echo(f"certificate: {output}")


def _draw(folder: str | None, several: Sequence[Modal]) -> None:
    """Draw the modes of every recording; of several, each in its own folder, named as its file."""
    from evolvent_base import plots
    from evolvent_massprops import mode_figures

    if folder is None:
        return
    for found in several:
        name = os.path.splitext(os.path.basename(found.reading.source.path))[0]
        drawn = mode_figures.figures(found.modes, found.reading.unit)
        echo(f"figures: {', '.join(plots.draw(drawn, os.path.join(folder, name) if len(several) > 1 else folder))}")


def _not_an_input(output: str, inputs: Mapping[str, str]) -> None:
    """Refuse to write over a file that is read."""
    for path, what in inputs.items():
        if os.path.exists(output) and os.path.exists(path) and os.path.samefile(output, path):
            raise InputError(f"-o {output!r} is {what}; name another, such as 'certificate.html'")


def _vibration(found: Modal) -> None:
    """Print the modes of one recording, with the largest amplitude of each and where it is, and warnings."""
    import math

    from rich.console import Console
    from rich.text import Text

    from evolvent_massprops.rounding import shown

    console, m, reading = Console(highlight=False), found.modes, found.reading
    unit = "" if reading.unit == "dimensionless" else f" {reading.unit}"
    table = made_table(
        f"modes of {visible(os.path.basename(reading.source.path))}",
        "",
        "frequency Hz",
        "frequency rad/s",
        "damping ratio",
        "largest amplitude",
    )
    for k in range(m.order):
        wide, c = found.widening[k], int(m.amplitude[k].argmax())
        f, std = m.frequency[k], wide * m.frequency_std[k]
        turn = 2.0 * math.pi
        row = shown(f / turn, std / turn), shown(f, std), shown(m.damping_ratio[k], wide * m.damping_ratio_std[k])
        where = f", {reading.names[c]}" if len(reading.names) > 1 else ""
        table.add_row(f"mode {k + 1}", *row, f"{m.amplitude[k, c]:.4g}{unit}{where}")
    console.print(table)
    for text in (*reading.notes, *found.warnings):
        console.print(Text.assemble(("warning: ", "yellow"), text), soft_wrap=True)


def _table(found: MassProperties) -> None:
    """Print modes, results, the largest shares of the budget, and warnings."""
    import numpy as np
    from rich.console import Console
    from rich.text import Text

    from evolvent_massprops.rounding import rounded, shown

    console = Console(highlight=False)

    several = len(found.evaluations) > 1
    modes = made_table(
        "modes" if not several else "recordings", "", "frequency rad/s", "decay rate 1/s", "damping ratio", ""
    )
    for e in found.evaluations:
        m, name = e.modal.modes, visible(os.path.basename(e.modal.reading.source.path))
        for k in e.used if several else range(m.order):
            wide = e.modal.widening[k]
            last = " ".join(shown(v, s) for v, s in zip(e.values, e.std, strict=True)) if several else ""
            if found.combined:
                misfit = f"{e.consistency:.2f}" if np.isfinite(e.consistency) else "-"
                last = f"misfit {misfit}" if several and k == e.used[0] else ""
            modes.add_row(
                name if several else f"mode {k + 1}",
                shown(m.frequency[k], wide * m.frequency_std[k]),
                shown(m.decay_rate[k], wide * m.decay_rate_std[k]),
                shown(m.damping_ratio[k], wide * m.damping_ratio_std[k]),
                last or ("" if k in e.used else "left out"),
            )
    console.print(modes)
    results = made_table("result", "", "value", "u", "k", "U", "unit")
    for k, output in enumerate(found.outputs):
        u, U = found.std[k], found.expanded[k]
        known = found.has_uncertainties and u > 0.0
        results.add_row(
            output.key,
            rounded(found.values[k], u) if known else f"{found.values[k]:.6g}",
            rounded(u, u) if known else "-",
            f"{found.factor[k]:.2f}" if known else "-",
            rounded(U, U) if known else "-",
            output.unit,
        )
    console.print()
    console.print(results)
    if found.shares:
        part = np.array([s.contribution**2 for s in found.shares])
        part = 100.0 * part / np.maximum(part.sum(axis=0), 1e-300)
        for first in range(0, len(found.outputs), _MOST_COLUMNS):
            columns = slice(first, first + _MOST_COLUMNS)
            budget = made_table("largest shares of the variance", "", *(o.key for o in found.outputs[columns]))
            for k in np.argsort(-part[:, columns].max(axis=1))[:_MOST_ROWS]:
                budget.add_row(found.shares[k].label, *(f"{x:.1f} %" for x in part[k, columns]))
            console.print()
            console.print(budget)
    if found.combined:
        console.print(found.evaluations[0].why[-1], soft_wrap=True)
        for what, text in found.evaluations[0].cannot:
            console.print(f"not determined: {what} ({text})", soft_wrap=True)
    for what, text in found.evaluations[0].assumed:
        if what == "sampling":
            console.print(f"assumed: {text}", soft_wrap=True)
    left = len(found.warnings) - _MOST_WARNINGS
    for text in found.warnings[: _MOST_WARNINGS if left > 1 else None]:
        console.print(Text.assemble(("warning: ", "yellow"), text), soft_wrap=True)
    if left > 1:
        console.print(Text(f"and {left} more warnings, all in the certificate"))
    if not found.has_uncertainties:
        console.print(Text("the method gives no uncertainty of the frequencies; use varpro for a certificate"))
