"""Solutions as labelled trees."""

from __future__ import annotations

import dataclasses
import datetime
import json
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np

from evolvent import cases, results
from evolvent.analysis import accessor as accessor, start_state  # the first registers run.ev
from evolvent.analysis.closure import check_energy_gain, warning_of
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import axial
from evolvent.model.registry import motions_of
from evolvent.results import display
from evolvent.results.happened import EVENTS, LATCHED, in_order, written_events
from evolvent.results.kept import is_local
from evolvent.results.observe import observe
from evolvent.results.observe.variables import AXES
from evolvent.results.tree import keep_solution, root_of, tree_of
from evolvent.results.variables import SHARED, owner
from evolvent.solvers.common.sampled import empty
from evolvent.solvers.common.solution import Solution
from evolvent_base import units

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.solvers.common.solution import Solution
else:
    xr = lazy.load("xarray")


def without(
    solution: Solution, root: dict[str, Any], kept: np.ndarray
) -> tuple[Solution, dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]]:
    """A solution and variables of its root at the samples that are `kept`: (nt,) bool."""
    if kept.all():
        return solution, root
    chosen = {
        name: (dims, values[kept] if dims[:1] == ("time",) else values, *texts)
        for name, (dims, values, *texts) in root.items()
    }
    return solution.chosen(kept), chosen


def at_start(assembly: Assembly, method: str, t: float = 0.0) -> Solution:
    """A solution with one sample, the start, before anything is solved; what a solver finds is NaN.

    Parameters
    ----------
    method : one of `METHODS`
    t : float, s
    """
    nothing = Solution(
        assembly=assembly,
        method=method,
        t=np.zeros(0),
        y=np.zeros((0, assembly.y.size)),
        s=np.zeros((0, assembly.s.size), dtype=assembly.s.dtype),
        status="success",
        message="success",
        statistics={},
        event_times=np.zeros(0),
        event_kinds=np.zeros(0, dtype=int),
        wall_time=0.0,
        compile_time=0.0,
        kept=empty(assembly.model, 0),
    )
    return nothing.or_start(t)


def tree(
    solution: Solution,
    *,
    case: str | Callable[[], str],
    why: str,
    system: str = "structure",
    title: str = "",
    root: dict[str, tuple[tuple[str, ...], np.ndarray, str, str]] | None = None,
    warning: str | None = None,
    keep_states: bool = False,
) -> xr.DataTree:
    """A solution as a labelled tree.

    Parameters
    ----------
    case : str, as YAML, or a function that returns it, called when the root is first accessed
    why : str, why the method was taken
    system : str, its name
    title : str, what it is; after the system's name if left out
    root : more variables of the root: name -> (dimensions, values, units, long name)
    warning : str, what the table and the pages warn of, '' for nothing; None: that of `warning_of`
    keep_states : bool, whether the states stay in memory with the tree, for margins along the run in a report
    """
    solution, now = check_energy_gain(solution), datetime.datetime.now(datetime.UTC)
    files = cases.files_of_case(solution.assembly.parts) if case else {}

    def attributes() -> dict[str, Any]:
        text = case if isinstance(case, str) else case()
        found = _attributes(solution, case=text, system=system, date=now) | {"method_reason": why}
        optional = {
            "title": title,
            "warning": warning_of(solution) if warning is None else warning,
            "latches": latches_of(solution),
            cases.FILES: json.dumps(files) if files and text else "",
            EVENTS: written_events(solution),
            start_state.ATTRIBUTE: start_state.end_of(solution),
        }
        return found | {name: text for name, text in optional.items() if text}

    found = tree_of(solution, attributes, root)
    if keep_states:
        keep_solution(found, solution)
    return found


def over(tree: xr.DataTree, times: np.ndarray, words: str) -> xr.DataTree:
    """A tree of equilibria with times of their own, (nt,) float, s, in place of that of drives and loads."""
    groups = {path: one.drop_vars("time", errors="ignore") for path, one in tree.to_dict().items()}
    groups["/"] = groups["/"].assign_coords(time=("time", times, {"units": "s", "long_name": words}))
    return xr.DataTree.from_dict(groups)


def latches_of(solution: Solution) -> str:
    """Sentences on the latches that have locked in a run, in order of time; '' where none has."""
    rows, found = motions_of(solution.assembly.model), []
    names = {place: name for name, place in solution.assembly.names.items()}
    for time, place, what in in_order(solution):
        if what == LATCHED and place in names:
            row = rows[place[1]]
            factor, unit = display.shown_unit("rad s-1" if row["kind"] == axial.ANGLE else "m s-1")
            rate = abs(factor * row["caught"])
            found.append(f"{names[place]!r} at t = {time:.6g} s, at {rate:.4g} {units.unit_text(unit)}")
    return "; ".join(found)


def _attributes(solution: Solution, *, case: str, system: str, date: datetime.datetime) -> dict[str, Any]:
    laws = {str(k): getattr(law, "__name__", str(k)) for k, law in solution.assembly.laws.items()}
    return results.attributes(
        system=system,
        case=case,
        method=solution.method,
        solution=solution,
        laws=dict.fromkeys(sorted(set(laws.values())), ""),
        date=date,
    )


def observed(
    solution: Solution,
    names: Iterable[str],
    *,
    system: str = "structure",
    root: dict[str, tuple[tuple[str, ...], np.ndarray, str, str]] | None = None,
) -> xr.Dataset:
    """Some variables of a solution, named as in `evolvent.results.variables.flat`; other parts are not observed.

    Parameters
    ----------
    names : full names of variables; those that are not there are left out
    system, root : as of `tree`
    """
    wanted = list(names)
    of_parts = all(owner(name) in solution.assembly.parts for name in wanted)
    if of_parts and is_local(solution.assembly, wanted):
        solution = dataclasses.replace(solution, reactions=None)
    times = {"time": xr.Variable(("time",), solution.t, {"units": "s", "long_name": "time"})}
    data: dict[str, Any] = {}
    for name, seen in observe(solution, [owner(name) for name in wanted]).items():
        for key, v in seen.variables.items():
            full = f"{name}.{key}"
            if any(
                one == full or one.startswith((f"{full}.", f"{name}[", f"{name}.root.", f"{name}.tip."))
                for one in wanted
            ):
                dims = tuple(d if d in SHARED else f"{name}.{d}" for d in v.dims)
                data[full] = xr.Variable(dims, v.values, {"units": v.units, "long_name": v.long_name})
                for place, c in seen.coordinates.items():
                    if f"{name}.{place}" in dims:
                        own_attrs = {"units": c.units, "long_name": c.long_name}
                        data[f"{name}.{place}"] = xr.Variable((f"{name}.{place}",), c.values, own_attrs)
    if of_parts:
        found = xr.Dataset(data, times | ({"axis": list(AXES)} if any("axis" in v.dims for v in data.values()) else {}))
    else:
        found = root_of(solution, root or {}).assign(data)
    now = datetime.datetime.now(datetime.UTC)
    found.attrs = _attributes(check_energy_gain(solution), case="", system=system, date=now)
    return found
