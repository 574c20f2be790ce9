"""The accessor `run.ev`: what can be done with a run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import xarray as xr

from evolvent import cases
from evolvent.base.errors import InputError
from evolvent.base.units import unit_text
from evolvent.results import variables
from evolvent.results.figures import Figure, Line, Number
from evolvent.view import show

if TYPE_CHECKING:
    from evolvent.results.motion import Motion


@xr.register_datatree_accessor("ev")
class RunAccessor:
    """What can be done with a run: ``run.ev.plot("boom.tip_deflection")``.

    Parameters
    ----------
    run : xarray.DataTree, of `System.simulate`, `evolvent.run` or `evolvent.open`
    """

    def __init__(self, run: xr.DataTree) -> None:
        self._run = run

    @property
    def _system(self) -> Any:
        """The definition that the run is shown by."""
        return cases.presenter(self._run)

    def names(self) -> list[str]:
        """Full names of all variables over time."""
        return variables.names(self._run)

    def get(self, name: str) -> xr.DataArray:
        """A variable by its full name, such as 'hub.rate.z' or 'boom[5].position'."""
        return variables.get(self._run, name)

    def table(self) -> list[Number]:
        """The rows of the table on the screen."""
        found: list[Number] = self._system.numbers(self._run)
        return found

    def plot(self, *names: str, path: str | os.PathLike[str] | None = None) -> Any:
        """Plot variables over time; without names, the default figures.

        Parameters
        ----------
        names : full names
        path : str, optional, PNG file (with names) or folder (without)

        Returns
        -------
        matplotlib.figure.Figure (a list of them without names), or the paths that were written
        """
        from evolvent.view import plots

        drawn: list[Figure] = [show.figure(self._run, names)] if names else self._system.figures(self._run)
        if path is None:
            sheets = [plots.sheet(figure) for figure in drawn]
            return sheets[0] if names else sheets
        if names:
            return plots.save(drawn[0], path)
        return plots.draw(drawn, path)

    def spectrum(self, *names: str, path: str | os.PathLike[str] | None = None) -> Any:
        """Plot amplitude spectra of variables over time (Hann window).

        Parameters
        ----------
        names : full names, of variables of one unit
        path : str, optional, PNG file

        Returns
        -------
        matplotlib.figure.Figure, or the path that was written
        """
        from evolvent import results
        from evolvent.view import plots

        if not names:
            raise InputError("no variable is named; give names such as 'boom.tip_deflection.y'")
        lines: list[Line] = []
        even = results.regular(self._run)
        for name in names:
            lines += show.lines_of(even, name, first=len(lines))
        unit = unit_text(str(variables.get(self._run, names[0]).attrs.get("units", "1")))
        drawn = show.spectrum(lines, unit=unit, title=f"Spectra of {', '.join(names[:4])}")
        return plots.sheet(drawn) if path is None else plots.save(drawn, path)

    def motion(self) -> Motion | None:
        """Bodies, lines, forces and marks at every sample; None where there is nothing to draw."""
        found: Motion | None = self._system.motion(self._run)
        return found

    def clearance(self, pairs: Iterable[Sequence[str]] | None = None) -> xr.Dataset:
        """Signed distances over time between the rigid bodies that have a shape, and where they interfere.

        Parameters, results and errors are those of `evolvent.analysis.clearance.clearances`. Needs the package coal.
        """
        from evolvent.analysis.clearance import clearances

        return clearances(self._run, pairs)

    def animate(self, path: str | os.PathLike[str], *, clearance: xr.Dataset | None = None) -> str:
        """Write the animation, or of a single sample, such as an equilibrium, the picture as one HTML page.

        Parameters
        ----------
        path : str
        clearance : xarray.Dataset, optional
            Of `clearance`; bodies that interfere are red at these samples.

        Returns
        -------
        str
            The path.

        Raises
        ------
        InputError
            If the run holds nothing to draw, or the file cannot be written.
        """
        from evolvent.results import unfinished
        from evolvent.view import animation

        found = self.motion()
        if found is None:
            raise InputError("the run has nothing to draw, so there is no animation")
        if clearance is not None:
            from evolvent.analysis.clearance_results import marked

            found = marked(found, clearance)
        return animation.write(found.labelled(unfinished(self._run)), path)

    def regular(self) -> xr.DataTree:
        """The run at its regular samples alone: without those that were kept where the motion is fast."""
        from evolvent import results

        found: xr.DataTree = results.regular(self._run)
        return found

    def sensitivity(self, values: str | Sequence[str], keys: str | Sequence[str]) -> xr.Dataset:
        """Derivatives of values of the run by keys of its parts: it is run again, as its case says.

        Parameters
        ----------
        values, keys : as of `evolvent.System.sensitivity`

        Raises
        ------
        InputError
            As of that, and for a run whose case is not kept, as it has a law in Python.
        """
        text = str(self._run.attrs.get("case", ""))
        if not text:
            raise InputError("the run does not hold its case, so that it cannot be run again for sensitivities")
        case = cases.of_run(text)
        found: xr.Dataset = cases.system(case.system).system(case).sensitivity(values, keys)
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run as NetCDF."""
        from evolvent import results

        results.save(self._run, path)
