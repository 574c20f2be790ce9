"""Analyses of a system: the method is chosen from its parts, the run becomes a tree of named results."""

from __future__ import annotations

import dataclasses
import datetime
import json
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.closure import check_energy_gain, warning_of
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.constraints import ends_of_row
from evolvent.kernels import axial, rigid
from evolvent.model import family, registry as family_registry
from evolvent.results.fine_samples import Times
from evolvent.solvers.common.laws import refusing_laws
from evolvent.solvers.common.standing import check_drives
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import energy_momentum, plan as implicit
from evolvent_base import units
from evolvent_base.errors import InputError, RunFailed, nearest

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.solvers.common.solution import Solution

#: Methods that `simulate` takes by name.
METHODS = (*explicit_plan.METHODS, *implicit.METHODS)
#: Samples of a run where no interval is given.
SAMPLES = 400
#: Default spectral radius of implicit methods: vibrations that the steps resolve keep their energy.
SPECTRAL_RADIUS = 0.9
#: Largest number of values of the state that a run may keep.
MOST_VALUES = 200_000_000
_TIME = units.Quantity(what="a time", unit="s", example="20 s", above=0.0)


def seconds(name: str, value: Any) -> float:
    """A time above zero, of a number or a text with a unit.

    Raises
    ------
    InputError
    """
    from pydantic_core import PydanticCustomError

    try:
        return float(_TIME.read(value))
    except PydanticCustomError as error:
        raise InputError(f"{name} is {value!r}; {error.message()}") from None


def sample_times(until: Any, every: Any = None, *, values: int = 1) -> np.ndarray:
    """Times from 0 to `until`, `every` so many seconds (the last interval may be shorter).

    Raises
    ------
    InputError
        If a time is not above zero, or a run would keep more than `MOST_VALUES` numbers.
    """
    end = seconds("until", until)
    step = end / SAMPLES if every is None else seconds("every", every)
    count = end / step
    if count * values > MOST_VALUES:
        raise InputError(f"every is {step:g} s; that makes {count:.3g} samples over {end:g} s, too many")
    samples = step * np.arange(int(count + 1e-9) + 1)
    if samples.size == 1 or end - samples[-1] > 1e-6 * step:
        return np.append(samples, end)
    samples[-1] = end
    return samples


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


def choose_method(assembly: Assembly, method: str = "auto") -> tuple[str, str]:
    """The method of a simulation, and why it is taken.

    Parameters
    ----------
    assembly : Assembly
    method : "auto", or one of `METHODS`

    Raises
    ------
    InputError
        If no such method is known, or it does not support a part: the sentence names one that does.
    """
    if assembly.shared is None:
        return _method_of(assembly, method)
    known = assembly.shared.setdefault("methods", {})
    if method not in known:
        known[method] = _method_of(assembly, method)
    found: tuple[str, str] = known[method]
    return found


def _method_of(assembly: Assembly, method: str) -> tuple[str, str]:
    """See `choose_method`."""
    if families.reacts(assembly.model):
        from evolvent.analysis import feedback

        return feedback.method_of(assembly, method)
    if method != "auto":
        if method not in METHODS:
            raise InputError(f"method is {method!r}; {nearest(str(method), [*METHODS, 'auto'])}")
        if method in implicit.METHODS:
            families.check(assembly, implicit.METHODS[method].solver, method)
        else:
            families.check(assembly, family.EXPLICIT)
        return method, "as asked for"
    refused = {}
    for solver in (family.EXPLICIT, family.IMPLICIT, family.ENERGY):
        try:
            families.check(assembly, solver)
        except InputError as error:
            refused[solver] = str(error)
    model = assembly.model
    if len(refused) == 3:
        raise InputError(f"no method supports this system: {refused[family.EXPLICIT]}; {refused[family.IMPLICIT]}")
    own = [one for one in family_registry.families().values() if one.records(model).size]
    conserved = [one.conserved for one in own if one.conserved]
    if conserved and family.ENERGY not in refused:
        return energy_momentum.NAME, f"{' and '.join(conserved)}: steps of any length gain no energy"
    adaptive = families.suit_adaptive_steps(model)
    if adaptive and all(adaptive) and family.EXPLICIT not in refused:
        return "dopri5", adaptive[0]
    stiff = _better_implicit(assembly)
    if stiff and family.EXPLICIT not in refused and len(refused) < 2:
        refused[family.EXPLICIT] = f"{stiff}; "
    if family.EXPLICIT in refused and family.ENERGY not in refused and has_loops(model):
        return energy_momentum.NAME, "loops of joints, which may pass positions where they depend on one another"
    if family.EXPLICIT in refused and family.IMPLICIT not in refused:
        return implicit.NAME, refused[family.EXPLICIT].partition("; ")[0]
    if family.EXPLICIT in refused:
        return energy_momentum.NAME, refused[family.IMPLICIT].partition("; ")[0]
    if family.IMPLICIT in refused:
        return "dopri5" if all(adaptive) else "rk4", refused[family.IMPLICIT].partition("; ")[0]
    stiff = next(filter(None, (one.short_steps(one.records(model)) for one in own if one.short_steps is not None)), "")
    if stiff or model.info.penalties:
        return implicit.NAME, stiff or "penalties are stiff"
    return "dopri5", "bodies, points and springs: adaptive steps of fifth order"


def _better_implicit(assembly: Any) -> str:
    """Why implicit methods suit a constraint (but for links and guides) or friction better; nothing without one."""
    known = family_registry.families()
    for one in known.values():
        mask, why = one.implicit or (None, "")
        for k in np.flatnonzero(mask(one.records(assembly.model))) if mask is not None else ():
            name = families.owner(assembly, one.name, int(k))
            of = known.get(assembly.names.get(name, ("",))[0])
            if of is None or not of.explicit:
                return f"{name!r} {why}"
    return ""


def has_loops(model: Any) -> bool:
    """Whether joints close a loop of three parts or more, what does not move being one part."""
    edges = set()
    for k in np.flatnonzero(model.constraints["turns"] == 0):
        ends = set()
        for what, index in ends_of_row(model, int(k)):
            if what not in family_registry.asked("consists") and not (
                what == "bodies" and model.bodies["motion"][index] == rigid.DRIVEN
            ):
                ends.add(f"{what} {index}")
        edges.add(tuple(sorted(ends)) if len(ends) == 2 else ("", *ends))
    group: dict[str, str] = {}

    def root(name: str) -> str:
        while group.setdefault(name, name) != name:
            name = group[name]
        return name

    for a, b in (edge for edge in sorted(edges) if len(edge) == 2):
        first, second = root(a), root(b)
        if first == second:
            return True
        group[first] = second
    return False


def plan(
    assembly: Assembly,
    samples: np.ndarray,
    *,
    method: str = "auto",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    absolute_tolerance: float | None = None,
    own: bool = False,
) -> tuple[Any, str]:
    """A prepared run, and why its method is taken.

    Parameters
    ----------
    method, step, tolerance, spectral_radius : as of `evolvent.System.simulate`
    absolute_tolerance : float, of dopri5; a hundredth of `tolerance` if left out
    own : bool, whether an implicit run may take the model of the assembly in place of a copy

    Raises
    ------
    InputError
        As of `choose_method` and of the solvers; also for an option that the method does not have.
    """
    method, why = choose_method(assembly, method)
    explicit = explicit_plan.METHODS.get(method)
    adaptive = explicit is not None and explicit.is_adaptive
    if absolute_tolerance is not None and (not adaptive or tolerance is None):
        raise InputError(
            f"absolute_tolerance is {absolute_tolerance!r}, but the method is {method}; only dopri5 has one, "
            f"in addition to `tolerance`"
        )
    if method in implicit.METHODS:
        of = implicit.METHODS[method]
        options: dict[str, Any] = {"method": method, "step": step, "own": own}
        options["tolerance"] = of.tolerance if tolerance is None else tolerance
        least = max(SPECTRAL_RADIUS, of.least_radius)
        options["spectral_radius"] = least if spectral_radius is None else spectral_radius
        return implicit.plan(assembly, samples=samples, **options), why
    if spectral_radius is not None:
        raise InputError(
            f"spectral_radius is {spectral_radius!r}, but the method is {method}; only "
            f"{', '.join(implicit.METHODS)} have one"
        )
    options = {"method": method}
    if adaptive:
        if step is not None:
            raise InputError(
                f"step is {step!r} s, but the method is {method}, which chooses its steps; give `tolerance`"
            )
        if tolerance is not None:
            absolute = 1e-2 * tolerance if absolute_tolerance is None else absolute_tolerance
            options |= {"rtol": tolerance, "atol": absolute}
    else:
        if tolerance is not None:
            raise InputError(
                f"tolerance is {tolerance!r}, but the method is {method}, which has fixed steps; give `step`"
            )
        options["step"] = step
    from evolvent.analysis import feedback

    return feedback.prepared(assembly, samples, **options), why


def check_run(assembly: Assembly, samples: np.ndarray, step: float | None = None) -> None:
    """Refuse what is known before anything is compiled: too many steps, drives that pay out more than their thread.

    Raises
    ------
    InputError
    """
    duration = float(samples[-1] - samples[0])
    if step is not None and 0.0 < explicit_plan.MOST_STEPS * step < duration:
        raise InputError(
            f"step is {step:.3g} s; that makes {duration / step:.2g} steps over {duration:.6g} s, more than "
            f"{explicit_plan.MOST_STEPS:.0e}; use a longer `step`, or shorten `until`"
        )
    with refusing_laws(assembly):
        check_drives(assembly, float(samples[-1]))


def at_start(assembly: Assembly, method: str, t: float = 0.0) -> Solution:
    """A solution with one sample, the start, before anything is solved; what a solver finds is NaN.

    Parameters
    ----------
    method : one of `METHODS`
    t : float, s
    """
    from evolvent.solvers.common.sampled import empty
    from evolvent.solvers.common.solution import Solution

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
    case: str,
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
    case : str, as YAML
    why : str, why the method was taken
    system : str, its name
    title : str, what it is; after the system's name if left out
    root : more variables of the root: name -> (dimensions, values, units, long name)
    warning : str, what the table and the pages warn of, '' for nothing; None: that of `warning_of`
    keep_states : bool, whether the states stay in memory with the tree, for margins along the run in a report
    """
    from evolvent import cases
    from evolvent.analysis import accessor  # noqa: F401  (it registers run.ev)
    from evolvent.results.happened import EVENTS, written_events
    from evolvent.results.tree import keep_solution, tree_of

    solution, now = check_energy_gain(solution), datetime.datetime.now(datetime.UTC)
    files = cases.files_of_case(solution.assembly.parts) if case else {}

    def attributes() -> dict[str, Any]:
        found = _attributes(solution, case=case, system=system, date=now) | {"method_reason": why}
        optional = {
            "title": title,
            "warning": warning_of(solution) if warning is None else warning,
            "latches": latches_of(solution),
            cases.FILES: json.dumps(files) if files else "",
            EVENTS: written_events(solution),
        }
        return found | {name: text for name, text in optional.items() if text}

    found = tree_of(solution, attributes, root)
    if keep_states:
        keep_solution(found, solution)
    return found


def latches_of(solution: Solution) -> str:
    """Sentences on the latches that have locked in a run, in order of time; '' where none has."""
    from evolvent.results import display
    from evolvent.results.happened import LATCHED, in_order

    rows, found = family_registry.motions_of(solution.assembly.model), []
    names = {place: name for name, place in solution.assembly.names.items()}
    for time, place, what in in_order(solution):
        if what == LATCHED and place in names:
            row = rows[place[1]]
            factor, unit = display.shown_unit("rad s-1" if row["kind"] == axial.ANGLE else "m s-1")
            rate = abs(factor * row["caught"])
            found.append(f"{names[place]!r} at t = {time:.6g} s, at {rate:.4g} {units.unit_text(unit)}")
    return "; ".join(found)


def _attributes(solution: Solution, *, case: str, system: str, date: datetime.datetime) -> dict[str, Any]:
    from evolvent import results

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
    import xarray as xr

    from evolvent.results.kept import is_local
    from evolvent.results.observe import observe
    from evolvent.results.observe.variables import AXES
    from evolvent.results.tree import root_of
    from evolvent.results.variables import SHARED, owner

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


def solve(
    assembly: Assembly,
    *,
    until: float,
    every: float | None = None,
    fine: bool = True,
    progress: Callable[[float], None] | None = None,
    **settings: Any,
) -> tuple[Solution, str, Times]:
    """The motion of an assembled system, why its method is taken, and the times of its samples.

    Parameters
    ----------
    until, every : float, s
    fine : bool, whether finer samples are kept where the motion is fast
    settings : method and options of `plan`
    """
    samples = sample_times(until, every, values=assembly.y.size)
    check_run(assembly, samples, settings.get("step"))
    times = Times.of(samples, fine=fine, values=assembly.y.size)
    prepared, why = plan(assembly, times.all, **settings)
    solution, _ = times.chosen(prepared.run(progress).or_start(float(samples[0])))
    return check_energy_gain(solution), why, times


def simulate(
    assembly: Assembly, *, case: str, title: str = "", keep_states: bool = False, **settings: Any
) -> xr.DataTree:
    """Run an assembled system.

    Parameters
    ----------
    case : str, as YAML
    title, keep_states : as of `tree`
    settings : as of `solve`

    Raises
    ------
    RunFailed
        If the run did not reach its end; ``.run`` holds what was computed.
    """
    solution, why, times = solve(assembly, **settings)
    found = tree(solution, case=case, why=why, title=title, root=times.mark(solution.t), keep_states=keep_states)
    if solution.status == "failed":
        raise RunFailed(solution.message, found)
    return found
