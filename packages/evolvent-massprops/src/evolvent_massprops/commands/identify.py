"""The command `evolvent identify`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click
import lazy_loader as lazy

from evolvent_base import files, progress
from evolvent_base.console import echo, once, showing_progress
from evolvent_base.errors import InputError
from evolvent_base.overrides import parse_assignments

if TYPE_CHECKING:
    from evolvent_massprops.modal import Modal

description = lazy.load("evolvent_massprops.description", suppress_warning=True)
measurement = lazy.load("evolvent_massprops.measurement", suppress_warning=True)
plots = lazy.load("evolvent_base.plots", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
torsion_rig = lazy.load("evolvent_massprops.torsion_rig", suppress_warning=True)


@click.command()
@click.argument("signals", metavar="[SIGNALS...]", nargs=-1)
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
    averaged; of a body in several mountings, or with tare, they go into one estimate. A torsion rig has no SIGNALS: its
    description states the periods.

    \b
    evolvent identify slew.nc --variables boom.tip_deflection.y --set signals.start='2 s' --figures modes
    evolvent identify knock.csv --stand stand.yaml -o certificate.html
    evolvent identify --stand torsion.yaml -o certificate.html
    """  # noqa: D301
    overrides = parse_assignments(assignments)
    columns = [name.strip() for name in (variables or "").split(",") if name.strip()]
    if figures is not None:
        files.check_writable_folder(figures)
    if output is not None and stand is not None:
        files.check_writable(output)
        _not_an_input(output, {stand: "the stand's file", **dict.fromkeys(signals, "one of the signals' files")})
    if stand is not None and torsion_rig.states_rig(stand, overrides):
        _rig(signals, stand, output, figures, overrides, quiet=quiet)
        return
    if not signals:
        raise InputError("SIGNALS are missing; name at least one file (a torsion rig states its periods in --stand)")
    if stand is None:
        if output is not None:
            raise InputError(
                f"-o {output!r} asks for a certificate, which needs a description of the stand: give --stand"
            )
        with showing_progress(quiet=quiet):
            found_modes = [
                measurement.vibration(path, columns, overrides) for path in progress.track(signals, "finding modes")
            ]
        for found in found_modes if not quiet else ():
            showing.show(found.answer())
        _draw(figures, found_modes)
        return
    if columns:
        overrides = {"signals.sensors": [{"column": name} for name in columns]} | overrides
    given = description.load(stand, overrides)
    with showing_progress(quiet=quiet):
        measured = measurement.mass_properties(signals, given)
        if output is not None:
            progress.report("writing the certificate")
            measured.report(output)
    _draw(figures, [one.modal for one in measured.evaluations])
    if not quiet:
        showing.show(measured.answer())
        if output is not None:
            echo(f"certificate: {output}")


def _rig(
    signals: tuple[str, ...],
    stand: str,
    output: str | None,
    figures: str | None,
    overrides: dict[str, Any],
    *,
    quiet: bool,
) -> None:
    """Mass properties of a part on a torsion rig."""
    if signals:
        raise InputError(f"{signals[0]!r}: a torsion rig takes no SIGNALS; its periods stand in {stand!r}")
    found = torsion_rig.evaluate(stand, overrides)
    if output is not None:
        found.report(output)
    if figures is not None:
        echo(f"figures: {', '.join(plots.draw(found.answer().figures, figures))}")
    if not quiet:
        showing.show(found.answer())
        if output is not None:
            echo(f"certificate: {output}")


def _draw(folder: str | None, several: Sequence[Modal]) -> None:
    """Draw the modes of every recording; of several, each in its own folder, named as its file."""
    if folder is None:
        return
    for found in several:
        name = os.path.splitext(os.path.basename(found.reading.source.path))[0]
        drawn = found.answer().figures
        echo(f"figures: {', '.join(plots.draw(drawn, os.path.join(folder, name) if len(several) > 1 else folder))}")


def _not_an_input(output: str, inputs: Mapping[str, str]) -> None:
    """Refuse to write over a file that is read."""
    for path, what in inputs.items():
        if os.path.exists(output) and os.path.exists(path) and os.path.samefile(output, path):
            raise InputError(f"-o {output!r} is {what}; name another, such as 'certificate.html'")
