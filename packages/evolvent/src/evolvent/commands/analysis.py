"""The commands `modes` and `equilibrium`."""

from __future__ import annotations

import os
from typing import Any

import click
import lazy_loader as lazy

from evolvent.commands.run import print_rows
from evolvent_base import files, options as shared
from evolvent_base.console import echo, once
from evolvent_base.errors import RunFailed

animation = lazy.load("evolvent.view.animation", suppress_warning=True)
cases = lazy.load("evolvent.cases", suppress_warning=True)
mesh = lazy.load("evolvent.analysis.mesh_error", suppress_warning=True)
pictures = lazy.load("evolvent.exports.pictures", suppress_warning=True)
plots = lazy.load("evolvent_base.plots", suppress_warning=True)
results = lazy.load("evolvent.results", suppress_warning=True)
show = lazy.load("evolvent.view.show", suppress_warning=True)
showing = lazy.load("evolvent_base.showing", suppress_warning=True)
table = lazy.load("evolvent.view.table", suppress_warning=True)


def _loaded(case: str, assignments: tuple[str, ...]) -> tuple[Any, Any]:
    """The checked case, and the definition of its system."""
    loaded = cases.load(case, cases.parse_assignments(assignments))
    return loaded, cases.system(loaded.system)


def _check_targets(output: str | None, figures: str | None, case: str) -> None:
    """Refuse files and folders that could not be written, and results in place of the case, before any work is done."""
    shared.check_output(output, case, "run.nc")
    if output is not None:
        showing.check_ending(output, (".nc",), "results")
    if figures is not None:
        files.check_writable_folder(figures)


mesh_errors = click.option(
    "--mesh-error", is_flag=True, help="Estimate the error of the mesh, by another solution with elements in halves."
)


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@click.option("--count", type=click.IntRange(min=1), help="How many modes.  [default: the case's modes.count, or 10]")
@mesh_errors
@click.option("-o", "--output", multiple=True, callback=once, metavar="MODES.NC", help="Keep the modes as NetCDF.")
@click.option("--figures", multiple=True, callback=once, metavar="DIR", help="Folder for an animation of every mode.")
def modes(
    case: str, assignments: tuple[str, ...], count: int | None, mesh_error: bool, output: str | None,
    figures: str | None,
) -> None:  # fmt: skip
    """Find the slowest modes of a CASE about its equilibrium.

    Prints frequencies (Hz), damping ratios and effective masses.
    """
    _check_targets(output, figures, case)
    loaded, definition = _loaded(case, assignments)
    found = definition.modes(loaded, count=count, mesh_error=mesh_error)
    showing.show(found.answer())
    if output is not None:
        found.save(output)
        echo(f"modes: {output}")
    if figures is not None:
        files.make_folder(figures)
        for k in range(len(found.pole)):
            found.animate(k, os.path.join(figures, f"mode-{k:02d}.html"))
        echo(f"animations: mode-00.html to mode-{len(found.pole) - 1:02d}.html in {figures}")


@click.command()
@click.argument("case", metavar="CASE|FILE")
@shared.assignments
@mesh_errors
@click.option("-o", "--output", multiple=True, callback=once, metavar="RUN.NC", help="Keep the results as NetCDF.")
@click.option(
    "--figures", multiple=True, callback=once, metavar="DIR", help="Folder for figures and a page of the shape."
)
def equilibrium(
    case: str, assignments: tuple[str, ...], mesh_error: bool, output: str | None, figures: str | None
) -> None:
    """Find the equilibrium of a CASE under its loads, from its start."""
    _check_targets(output, figures, case)
    loaded, definition = _loaded(case, assignments)
    found = definition.equilibrium(loaded, mesh_error=mesh_error)
    rows = [("status", found.attrs["status"])]
    rows += [("message", found.attrs["message"])] if found.attrs["status"] != "failed" else []  # else the error says it
    rows += [(n.label, n.value) for n in table.numbers(found)] + mesh.lines(found)
    print_rows(rows, status=found.attrs["status"])
    if output is not None:
        results.save(found, output)
        echo(f"results: {output}")
    if figures is not None:
        _draw(found, figures)
    if found.attrs["status"] == "failed":
        raise RunFailed(found.attrs["message"], found)


def _draw(found: Any, folder: str) -> None:
    """Figures along the parts, pictures of surfaces, and the shape as a page."""
    paths = plots.draw(show.figures(found), folder, label=results.unfinished(found))
    motion = show.motion(found)
    if motion is not None:
        paths += pictures.write_shapes(motion, folder, label=results.unfinished(found))
        paths.append(animation.write(motion, os.path.join(folder, "shape.html")))
    echo(f"figures: {', '.join(map(os.path.basename, paths))} in {folder}" if paths else "no figures")
