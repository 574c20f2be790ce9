"""The accessor `run.ev`: what can be done with a run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np
import xarray as xr

from evolvent import analysis, cases, results
from evolvent.results import WELL, display, happened, limits, statistics_of, unfinished, variables
from evolvent.view import show
from evolvent_base import answer as an
from evolvent_base.errors import InputError, counted
from evolvent_base.figures import Figure, Line, Number, spectrum
from evolvent_base.showing import Answered, Page, Sheets
from evolvent_base.units import unit_text

if TYPE_CHECKING:
    from evolvent.analysis.clearance_results import Clearances
    from evolvent.analysis.sensitivity_results import Sensitivities
    from evolvent.results.motion import Motion
    from evolvent.view import animation
    from evolvent_base import plots
else:  # most runs are not asked for it
    animation = lazy.load("evolvent.view.animation", suppress_warning=True)
    plots = lazy.load("evolvent_base.plots", suppress_warning=True)

#: Names of parts that a notebook shows, at most.
_SHOWN = 12


@xr.register_datatree_accessor("ev")
class RunAccessor(Answered):
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

    @property
    def statistics(self) -> Mapping[str, float | None]:
        """The method's account of the run by name, such as "steps"; None for what is not finite."""
        return MappingProxyType(statistics_of(self._run))

    @property
    def events(self) -> xr.Dataset:
        """What happened, in order of time: see `evolvent.results.happened.events_of`; ``.to_pandas()`` is a table."""
        return happened.events_of(self._run)

    @property
    def latches(self) -> xr.Dataset:
        """The latches that have locked: see `evolvent.results.happened.latches_of`."""
        return happened.latches_of(self._run)

    def answer(self) -> an.Answer:
        """Status, warning, latches and sizes."""
        run, attrs, names = self._run, self._run.attrs, variables.parts(self._run)
        missed = limits.verdict(limits.of_run(run))
        facts = [
            ("status", f"{attrs['status']}{f', but {missed}' if missed else ''}"),
            ("method", str(attrs["method"])),
        ]
        facts += [(f"limit {one.text}", one.shown) for one in limits.of_run(run)]
        if attrs["status"] not in WELL:
            facts.append(("message", str(attrs["message"])))
        if "time" in run.coords:
            times = np.asarray(run["time"])
            facts.append(("time", f"{times[0]:.6g} s to {times[-1]:.6g} s, {counted(times.size, 'sample')}"))
        facts.append(("steps", f"{int(self.statistics.get('steps') or 0):,} in {float(attrs['wall_time_s']):.3g} s"))
        if names:
            facts.append(
                ("parts", f"{len(names)}: {', '.join(names[:_SHOWN])}{', ...' if len(names) > _SHOWN else ''}")
            )
        facts += [("events", str(count))] if (count := self.events.sizes["event"]) else []
        held = self.latches
        rows = [
            [str(one.latch.values), f"{float(one.time):.6g} s", _shown_rate(float(one.rate), str(one.rate_unit.values)),
             f"{float(one.peak):.4g} {one.peak_unit.values}"]
            for one in (held.isel(latch=k) for k in range(held.sizes["latch"]))
        ]  # fmt: skip
        warnings = [str(attrs["warning"])] if attrs.get("warning") else []
        title = str(attrs.get("title") or f"evolvent run of {attrs['system']}")
        table = an.Table(heads=("latch", "time", "rate", "peak"), rows=rows)
        sections = [an.Section(title="Latches", blocks=[table])] if rows else []
        return an.Answer(title=title, facts=facts, sections=sections, warnings=warnings)

    def plot(
        self, *names: str, path: str | os.PathLike[str] | None = None, units: str | None = None
    ) -> Any:  # fmt: skip
        """Plot variables over time; without names, the default figures.

        Parameters
        ----------
        names : full names
        path : str, optional, PNG file (with names) or folder (without)
        units : str, of angles and rates of the variables that are named: "deg" (and deg/s), "rpm" (and deg) or "rad";
            left out, rpm for the rates of parts whose rates were written so, else deg

        Returns
        -------
        matplotlib.figure.Figure (a list of them without names), which a notebook shows, or the paths that were written
        """
        drawn: list[Figure] = [show.figure(self._run, names, units=units)] if names else self._system.figures(self._run)
        if path is None:
            sheets = [plots.sheet(figure) for figure in drawn]
            return sheets[0] if names else Sheets(sheets)
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
        if not names:
            raise InputError("no variable is named; give names such as 'boom.tip_deflection.y'")
        lines: list[Line] = []
        even = results.regular(self._run)
        for name in names:
            lines += show.lines_of(even, name, first=len(lines))
        unit = unit_text(str(display.shown(variables.get(self._run, names[0])).attrs.get("units", "1")))
        drawn = spectrum(lines, unit=unit, title=f"Spectra of {', '.join(names[:4])}")
        return plots.sheet(drawn) if path is None else plots.save(drawn, path)

    def motion(self) -> Motion | None:
        """Bodies, lines, forces and marks at every sample; None where there is nothing to draw."""
        found: Motion | None = self._system.motion(self._run)
        return found

    def clearance(self, pairs: Iterable[Sequence[str]] | None = None) -> Clearances:
        """Signed distances over time between the rigid bodies that have a shape, and where they interfere.

        Parameters, results and errors are those of `evolvent.analysis.clearance.clearances`. Needs the package coal.
        """
        return analysis.clearance.clearances(self._run, pairs)

    def animate(
        self, path: str | os.PathLike[str] | None = None, *, clearance: Clearances | None = None
    ) -> Any:  # fmt: skip
        """Write the animation, or of a single sample, such as an equilibrium, the picture as one HTML page.

        Parameters
        ----------
        path : str, optional, file that ends with .html; left out, nothing is written
        clearance : Clearances, optional
            Of `clearance`; bodies that interfere are red at these samples.

        Returns
        -------
        The path, or without one the page, which a notebook shows

        Raises
        ------
        InputError
            If the run holds nothing to draw, or the file cannot be written.
        """
        found = self.motion()
        if found is None:
            raise InputError("the run has nothing to draw, so there is no animation")
        if clearance is not None:
            found = clearance.marked(found)
        motion = found.labelled(unfinished(self._run))
        return Page(animation.page(motion)[0]) if path is None else animation.write(motion, path)

    def regular(self) -> xr.DataTree:
        """The run at its regular samples alone: without those that were kept where the motion is fast."""
        found: xr.DataTree = results.regular(self._run)
        return found

    def sensitivity(self, values: str | Sequence[str], keys: str | Sequence[str]) -> Sensitivities:
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
        cases.check_files_of_run(self._run)
        case = cases.of_run(text)
        found: Sensitivities = cases.system(case.system).system(case).sensitivity(values, keys)
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run as NetCDF."""
        results.save(self._run, path)


def _shown_rate(rate: float, unit: str) -> str:
    """A rate of a joint as people read it; unit : "rad/s" or "m/s"."""
    factor, name = display.shown_unit({"rad/s": "rad s-1"}.get(unit, unit))
    return f"{factor * rate:.4g} {unit_text(name)}"
