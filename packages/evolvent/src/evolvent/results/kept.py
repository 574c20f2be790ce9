"""What is kept of a run by name, `keep` of simulations and studies: values over time, or reduced, without a tree.

A run needs no finer samples where the values at a sample depend on that sample alone (`is_local`), and no others where
the first or the last value is asked for.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent.model.family import EXTREMES
from evolvent.model.registry import families
from evolvent.parts.base import Part
from evolvent.results import variables
from evolvent.results.observe import observe_part
from evolvent.results.observe.symbols import add_symbols
from evolvent.results.observe.variables import AXES, Observed
from evolvent.results.observe.view import View
from evolvent.results.tree import OF_A_SAMPLE, balances_of
from evolvent_base import units
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution

#: What may be kept of a variable over time, ``NAME.last`` and so on: functions of the values and of the times.
REDUCTIONS: dict[str, Callable[[np.ndarray, np.ndarray], Any]] = {
    "first": lambda values, t: values[0],
    "last": lambda values, t: values[-1],
    "min": lambda values, t: np.fmin.reduce(values, axis=0),
    "max": lambda values, t: np.fmax.reduce(values, axis=0),
    "abs_max": lambda values, t: np.fmax.reduce(np.abs(values), axis=0),
    "mean": lambda values, t: values.mean(axis=0, dtype=float),
    "integral": lambda values, t: np.trapezoid(values, t, axis=0),
}
#: Reductions that are extremes; they use the extremes over all steps if these are known.
EXTREME = ("min", "max", "abs_max")
#: Words of each of them.
_HOW = {
    "first": "at the start", "last": "at the end", "min": "least", "max": "largest", "abs_max": "largest magnitude",
    "mean": "mean", "integral": "integral over time",
}  # fmt: skip
#: The value at a time, ``NAME.at(2.5 s)``; and what names may end with.
_AT = re.compile(r"at\((?P<time>[^()]*)\)")
ENDINGS = (*REDUCTIONS, "at(2.5 s)")
#: Part of a run by which a time may lie outside of it, by round-off.
_ROUND_OFF = 1e-9
#: Variables of joints that follow from the reactions at a sample.
_REACTIONS = {"force", "moment", "torque", "tension"}


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Kept(Mapping[str, Any]):
    """Values of a run by the names that were asked for: a float, or an array of what has several values.

    Attributes
    ----------
    attrs : mapping, how the run ended: status, message, warning, method, method_reason, wall_time_s, compile_time_s,
        and statistics, a mapping of numbers
    variables : mapping, the same values with their dimensions, units and words
    coordinates : mapping, dimension -> its coordinate
    missing : tuple of str, names that the run does not have
    known : tuple of str, names that it has, where some are missing
    """

    attrs: Mapping[str, Any]
    variables: Mapping[str, xr.Variable]
    coordinates: Mapping[str, xr.Variable] = dataclasses.field(default_factory=dict)
    missing: tuple[str, ...] = ()
    known: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Any:
        """Value of a name."""
        values = self.variables[name].values
        return values.item() if values.ndim == 0 else values

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def __repr__(self) -> str:
        return f"Kept({dict(self)!r}, status={self.attrs['status']!r})"

    def units(self, name: str) -> str:
        """Unit of a value, SI; "1" where it has none."""
        return str(self.variables[name].attrs.get("units", "1"))


def stored_name(wanted: str) -> str:
    """A name without dots and blanks: "tip mass.position.x.max" -> "tip_mass_position_x_max"."""
    name = re.sub(r"\W+", "_", wanted)
    return name.rstrip("_") if wanted.endswith(")") else name


@functools.lru_cache(maxsize=1024)
def split(wanted: str) -> tuple[str, str]:
    """Name of a variable, and what is kept of it over time, one of `REDUCTIONS` or ``at(TIME)``; '' for all of it."""
    at = re.search(rf"\.({_AT.pattern})$", wanted)
    name, last = (wanted[: at.start()], at[1]) if at else wanted.rpartition(".")[::2]
    return (name, last) if is_reduction(last) and name else (wanted, "")


def is_reduction(text: str) -> bool:
    """Whether a text says what is kept of a variable over time."""
    return text in REDUCTIONS or _AT.fullmatch(text) is not None


def reduce(values: np.ndarray, t: np.ndarray, reduction: str, extremes: np.ndarray | None = None) -> Any:
    """Values over time in one.

    Parameters
    ----------
    values : (nt, ...) float; t : (nt,) float, s
    reduction : one of `REDUCTIONS`, or ``at(TIME)``: straight lines between the samples
    extremes : (2, ...) float, least and largest values over all steps, which are reduced together with the samples

    Raises
    ------
    InputError
        For a time that is none, or outside the run.
    """
    if reduction in REDUCTIONS:
        if reduction in EXTREME and extremes is not None:
            values = np.concatenate([values, extremes])
        return REDUCTIONS[reduction](values, t)
    at, near = _time_of(reduction), _ROUND_OFF * abs(float(t[-1]))
    if not t[0] - near <= at <= t[-1] + near:
        raise InputError(f"{reduction} is outside the run, which is from {t[0]:.6g} s to {t[-1]:.6g} s")
    k = int(np.clip(np.searchsorted(t, at), 1, max(t.size - 1, 1)))
    if t.size == 1 or at <= t[0]:
        return values[0]
    share = min((at - float(t[k - 1])) / float(t[k] - t[k - 1]), 1.0)
    return values[k] if share > 1.0 - _ROUND_OFF else values[k - 1] + share * (values[k] - values[k - 1])


def _time_of(reduction: str) -> float:
    """The time of ``at(TIME)``, s."""
    match = _AT.fullmatch(reduction)
    assert match is not None
    try:
        found = units.parse(match["time"], "s")
    except units.UnitError as error:
        raise InputError(f"{reduction} must hold a time, such as at(2.5 s); {error}") from None
    if not np.isfinite(found):
        raise InputError(f"{reduction} must hold a finite time, such as at(2.5 s)")
    return float(found)


def unit_of(unit: str, reduction: str) -> str:
    """Unit of what is kept of a variable: of an integral over time another one, "rad s-1" -> "rad"."""
    if reduction != "integral":
        return unit
    words = unit.split()
    power = next((int(word[1:] or 1) for word in words if re.fullmatch(r"s(-?\d)?", word)), 0)
    others = [word for word in words if word != "1" and not re.fullmatch(r"s(-?\d)?", word)]
    seconds = {0: [], 1: ["s"]}.get(power + 1, [f"s{power + 1}"])
    return " ".join([*others, *seconds]) or "1"


def reduced(values: xr.Variable, reduction: str, name: str, t: np.ndarray) -> xr.Variable:
    """Values over time in one value.

    Parameters
    ----------
    values : with the dimension time
    reduction : as of `reduce`
    name : str, that stands for words that are missing
    t : (nt,) float, s, times of the values

    Raises
    ------
    InputError
        As of `reduce`.
    """
    ordered = values.transpose("time", ...)
    own = reduced_values(ordered.values, ordered.attrs, reduction, name, t, variables.extremes_of(values))
    return variables.without_extremes(xr.Variable(ordered.dims[1:], *own))


def reduced_values(
    values: np.ndarray, attrs: Mapping[Any, Any], reduction: str, name: str, t: np.ndarray, extremes: np.ndarray | None
) -> tuple[Any, dict[Any, Any]]:
    """Reduction of values (nt, ...) over time, and its attributes: see `reduced`."""
    try:
        found = reduce(values, t, reduction, extremes)
    except InputError as error:
        raise InputError(f"keep holds '{name}.{reduction}'; {error}") from None
    own = {**attrs, "long_name": f"{attrs.get('long_name', name)}, {_HOW.get(reduction, reduction)}"}
    if "units" in own:
        own["units"] = unit_of(own["units"], reduction)
    return found, own


def check_names(keep: Sequence[str], run: xr.Dataset | xr.DataTree) -> None:
    """Refuse names of `keep` that a run will not have.

    Parameters
    ----------
    keep : names; a word alone may be a statistic, of which the run itself decides
    run : the results at the start

    Raises
    ------
    InputError
        The sentence names the nearest variable.
    """
    for wanted in keep:
        name, reduction = split(wanted)
        if wanted == name and not re.search(r"[.\[]", wanted) and wanted not in variables.parts(run):
            continue
        head, _, last = name.rpartition(".")
        if not reduction and head and not _has(run, name) and _has(run, head):
            raise InputError(f"keep holds {wanted!r}; after the variable, {nearest(last, ENDINGS)}")
        try:
            found = variables.get(run, name)
        except InputError as error:
            raise InputError(f"keep holds {wanted!r}; {error}") from None
        if reduction not in (*REDUCTIONS, ""):
            try:
                _time_of(reduction)
            except InputError as error:
                raise InputError(f"keep holds {wanted!r}; {error}") from None
        if reduction and "time" not in found.dims:
            raise InputError(f"keep holds {wanted!r}, but {name!r} has no time to reduce; write {name!r}")


def refusal(wanted: str, known: Iterable[str]) -> InputError:
    """Why a name of `keep` that no run has is refused; `known` : names that runs have."""
    variable, reduction = split(wanted)
    if reduction and variable in known:
        return InputError(f"keep holds {wanted!r}, but {variable!r} has no time to reduce; write {variable!r}")
    return InputError(f"keep holds {wanted!r}, which no run has; {nearest(variable, known)}")


def _has(run: xr.Dataset | xr.DataTree, name: str) -> bool:
    """Whether a run has a variable of a full name."""
    try:
        variables.get(run, name)
    except InputError:
        return False
    return True


# ------------------------------------------------------------------------------------------------ of a solution


def is_local(assembly: Assembly, keep: Sequence[str]) -> bool:
    """Whether values of all names at a sample depend on that sample and the first one alone."""
    others = {variables.owner(name) for name in keep if not is_balance(assembly, name)}
    return all(_is_local(assembly, part) for part in others)


def is_of_part(assembly: Assembly, name: str) -> bool:
    """Whether a name of a kept value is that of a variable of a part."""
    return variables.owner(name) in assembly.parts


def is_balance(assembly: Assembly, name: str) -> bool:
    """Whether a name of a kept value is that of an energy, work or momentum of the run at a sample."""
    own = re.split(r"[.\[]", split(name)[0])[0]
    return own in OF_A_SAMPLE and own not in assembly.parts


def _is_local(assembly: Assembly, part: str) -> bool:
    if not _is_of_family(assembly, part) or part in assembly.row_parts:
        return False
    family = families().get(assembly.names[part][0])
    return family is not None and family.samples.local


def _is_of_family(assembly: Assembly, part: str) -> bool:
    """Whether the results of a part are those of its family alone."""
    own = assembly.parts.get(part)
    return own is not None and type(own).observe is Part.observe


def follows_from_reactions(assembly: Assembly, name: str) -> bool:
    """Whether a variable at a sample depends on the reactions and the state there alone."""
    part, match = variables.owner(name), variables.matched(name)
    if match is None or not _is_of_family(assembly, part) or part not in assembly.row_parts:
        return False
    return match["variable"] in _REACTIONS


def is_of_samples(assembly: Assembly, keep: Sequence[str]) -> bool:
    """Whether values of all names at a sample depend on that sample, its reactions and the first one alone."""
    return is_local(assembly, [name for name in keep if not follows_from_reactions(assembly, split(name)[0])])


def kept_of(
    solution: Solution, keep: Sequence[str], root: Callable[[], xr.Dataset], *, fine: np.ndarray, why: str,
    warning: str = "", view_of: Callable[..., View] = View,
) -> Kept:  # fmt: skip
    """What is kept of a solution, at the samples that all runs of a case have; nothing of a run that has failed.

    Parameters
    ----------
    solution : Solution
    keep : names, with their reductions; those that are not there are `missing`
    root : returns the variables of the root of its results; called where a name is of no part
    fine : (nt,) bool, samples that other runs of the case may not have
    why : str, why the method was taken
    warning : str, what the run warns of
    view_of : class of the view through which results of parts are read
    """
    attrs = {
        "status": solution.status, "message": solution.message, "warning": warning, "method": solution.method,
        "method_reason": why, "wall_time_s": solution.wall_time, "compile_time_s": solution.compile_time,
        "statistics": dict(solution.statistics),
    }  # fmt: skip
    if solution.status == "failed":
        return Kept(attrs=attrs, variables={}, missing=tuple(keep))
    samples, statistics, assembly = np.flatnonzero(~fine), solution.statistics, solution.assembly
    of_reactions = [name for name in keep if follows_from_reactions(assembly, split(name)[0])]
    owners = {variables.owner(name) for name in keep} & assembly.parts.keys()
    local = is_of_samples(assembly, keep)
    if local:
        if all(split(name)[1] in ("first", "last") for name in keep):
            samples = np.unique(samples[[0, -1]])
        if not of_reactions:
            solution = dataclasses.replace(solution, reactions=None)
        if samples.size < solution.t.size:
            solution = solution.chosen(samples)
            samples = np.arange(samples.size)
    families_read = {assembly.names[name][0] for name in owners if _is_of_family(assembly, name)}
    view = view_of(solution, joints=bool(of_reactions) or not local, families=families_read)
    roots, chosen = functools.cache(root), solution
    sums = functools.cache(lambda: balances_of(chosen))
    seen: dict[str, Observed] = {}
    found: dict[str, xr.Variable] = {}
    coordinates: dict[str, xr.Variable] = {}
    for wanted in keep:
        name, reduction = split(wanted)
        if variables.owner(name) in assembly.parts:
            own = _of_part(view, name, reduction, seen, samples)
        elif is_balance(assembly, wanted):
            own = _chosen(_of_balance(sums(), view.t, name), name, reduction, samples, view.t)
        else:
            own = _chosen(_of_root(roots(), statistics, name), name, reduction, samples, view.t)
        if own is not None:
            found[wanted] = own[0]
            coordinates |= {dim: one for dim, one in own[1].items() if dim in own[0].dims}
    missing = tuple(name for name in keep if name not in found)
    return Kept(attrs=attrs, variables=found, coordinates=coordinates, missing=missing)


#: A variable and the coordinates of its dimensions.
Labelled = tuple[xr.Variable, Mapping[str, xr.Variable]]


def _chosen(own: Labelled | None, name: str, reduction: str, samples: np.ndarray, times: np.ndarray) -> Labelled | None:
    """A variable of the root at some of the samples, or reduced over them; None of one without time to reduce."""
    if own is None or (reduction and "time" not in own[0].dims):
        return None
    values, along = _at(own[0], samples), {dim: _at(one, samples) for dim, one in own[1].items()}
    t = along["time"].values if "time" in along else times[samples]
    return (reduced(values, reduction, name, t) if reduction else values), along


def _at(values: xr.Variable, samples: np.ndarray) -> xr.Variable:
    """Values at some of the samples."""
    if "time" not in values.dims or samples.size == values.sizes["time"]:
        return values
    return values.isel(time=samples)


def _of_part(view: View, name: str, reduction: str, seen: dict[str, Observed], samples: np.ndarray) -> Labelled | None:
    """A variable of a part by its full name, at some of the samples or reduced over them; None where there is none."""
    match, part = variables.matched(name), variables.owner(name)
    if match is None or match["variable"] is None:
        return None
    family = families().get(view.assembly.names[part][0])
    if name not in seen:
        of_family = _is_of_family(view.assembly, part) and family is not None and family.observe is None
        view.wanted = {match["variable"]} if of_family else None  # others may follow from one another
        seen[name] = observe_part(view, part)
        view.wanted = None
    of = seen[name]
    if match["variable"] not in of.variables and match["variable"] not in of.coordinates:
        if part not in seen:
            seen[part] = observe_part(view, part)
            add_symbols(view, part, seen[part])
        of = seen[part]
    given = of.variables.get(match["variable"]) or of.coordinates.get(match["variable"])
    if given is None or (reduction and "time" not in given.dims):
        return None
    texts: dict[Hashable, str] = {dim: one.long_name for dim, one in of.coordinates.items()}
    try:
        found = variables.entry(given, match, name, texts)
    except InputError:
        return None
    t, timed = view.t, "time" in found.dims
    if timed and samples.size < t.size:
        found, t = found.isel({"time": samples}), t[samples]
    dims, values = found.dims, found.values
    text = f"{name}: {found.long_name}" if found.long_name else name
    attrs: dict[Any, Any] = {"units": found.units, "long_name": text}
    if timed and reduction:
        values, attrs = reduced_values(values, attrs, reduction, name, t, found.extremes)
        dims = dims[1:]
    elif timed and view.is_of_copies and found.extremes is not None:
        attrs[EXTREMES] = found.extremes
    new = {dim: _dimension(part, dim) for dim in dims}
    along = {}
    for dim in dims:
        if dim == "time":
            along[dim] = xr.Variable(("time",), t, {"units": "s", "long_name": "time"})
        elif dim == "axis":
            along[dim] = xr.Variable(("axis",), list(AXES))
        elif dim in of.coordinates:
            one = of.coordinates[dim]
            along[new[dim]] = xr.Variable((new[dim],), one.values, {"units": one.units, "long_name": one.long_name})
    return xr.Variable(tuple(new.values()), values, attrs), along


def _dimension(part: str, dim: str) -> str:
    """A dimension of a part's variable that can stand beside those of other parts."""
    return dim if dim in variables.SHARED else stored_name(f"{part}.{dim.removeprefix(f'{part}.')}")


def _of_balance(balances: Mapping[str, xr.Variable], t: np.ndarray, name: str) -> Labelled | None:
    """A variable of the root that is an energy, work or momentum, by its full name; None where there is none."""
    own = re.split(r"[.\[]", name)[0]
    time, values = ("time", t, {"units": "s", "long_name": "time"}), balances[own]
    if own == name and values.dims == ("time",):  # without a table of its own
        return values.to_base_variable(), {"time": xr.Variable(*time)}
    along = {"time": time, "axis": list(AXES), "cause": balances["cause"]}
    return of_run(xr.Dataset({own: values}, {dim: along[str(dim)] for dim in values.dims}), name)


def _of_root(root: xr.Dataset, statistics: Mapping[str, float], name: str) -> Labelled | None:
    """A variable of the root, or a statistic; None where there is none."""
    if name in statistics and name not in root.variables:
        return number(name, statistics[name]), {}
    return of_run(root, name)


def of_run(run: xr.Dataset | xr.DataTree, name: str) -> Labelled | None:
    """A variable of a run by its full name; None where there is none."""
    is_own = name in run.data_vars and "." not in name
    if name == "time" or not (is_own or _has(run, name)):
        return None
    found = run.data_vars[name] if is_own else variables.get(run, name)
    along = {str(dim): found.coords[dim].variable.to_base_variable() for dim in found.dims if dim in found.coords}
    values = found.variable.to_base_variable()
    return (values, along) if is_own else _named(values, along, name)


def _named(values: xr.Variable, along: Mapping[str, xr.Variable], name: str) -> Labelled:
    """A variable under its full name, whose dimensions can stand beside those of other parts."""
    part, text = variables.owner(name), values.attrs.get("long_name", "")
    new = {str(dim): _dimension(part, str(dim)) for dim in values.dims}
    attrs = {**values.attrs, "long_name": f"{name}: {text}" if text else name}
    coordinates = {new[dim]: xr.Variable((new[dim],), one.values, one.attrs) for dim, one in along.items()}
    return xr.Variable(tuple(new[str(dim)] for dim in values.dims), values.values, attrs), coordinates


def number(name: str, value: float) -> xr.Variable:
    """A statistic."""
    return xr.Variable((), float(value), {"long_name": name.replace("_", " ")})
