"""Sensitivities of a run: derivatives of its values by keys of its parts, of the discrete solution.

The system is assembled with every key a little larger and a little smaller, and these take the steps of the run beside
it (`evolvent.solvers.sensitivity.neighbours`). A value of the results is the same function of all of them.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np

from evolvent import cases
from evolvent.analysis import accuracy, gradient, runs, simulation, start_motion, trees, variation
from evolvent.analysis.closure import warning_of
from evolvent.analysis.composition import Composition
from evolvent.analysis.methods import choose_method
from evolvent.analysis.sensitivity_results import Sensitivities
from evolvent.analysis.settings import check_run, sample_times
from evolvent.analysis.storage import storage_of
from evolvent.assembly.families import owner
from evolvent.families.coordinates.part import JointSpring
from evolvent.families.joints.part import Joint
from evolvent.model.registry import families
from evolvent.results.fine_samples import Times
from evolvent.results.kept import Kept, is_local, kept_of, refusal
from evolvent.results.tree import root_of
from evolvent.results.variables import names
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.sensitivity import adjoint_support
from evolvent.solvers.sensitivity.neighbours import Neighbours, TooFar
from evolvent.solvers.time.implicit import plan as implicit
from evolvent_base import schema, units
from evolvent_base.errors import EvolventError, InputError, RunFailed, nearest

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution
else:
    xr = lazy.load("xarray")

Array = np.ndarray
#: Changes of a key to both sides, relative to it, or of one that is 0 in its SI unit: the next one where the runs
#: beside the run do not take its steps, or other contacts touch in one.
CHANGES = (1e-6, 1e-7)
#: Mean of the changes of a value to both sides beside half their difference, and beside the value, above which the
#: derivatives to both sides differ: of a smooth value both are of the order of the change.
UNEVEN, RESOLVED, ROUND_OFF = 1e-2, 1e-7, 1e-13
#: Levels of integration (`evolvent.analysis.accuracy`), of half and of twice as many steps, by which errors are found,
#: and their share of what these change: of methods of second order. The second is for runs that the first cannot do.
BESIDE = {-0.5: 1.0 / 3.0, 0.5: 4.0 / 3.0}
#: Error of a derivative, and of what it changes beside the value where the key changes by its own size, above which a
#: table warns.
LARGEST_ERROR, RESOLVED_RESULT = 0.05, 1e-6
#: Keys of one call at most, by neighbours; and how derivatives are found.
MOST, MODES = 200, ("forward", "adjoint")


@dataclasses.dataclass(frozen=True)
class Key:
    """A key by which values are derived: its name, value and unit (SI), and its size, what counts as 1.

    `column` says whether it is in a row of a table, beside numbers of other quantities.
    """

    name: str
    value: float
    unit: str
    size: float
    column: bool = False

    def at(self, change: float) -> Mapping[str, Any]:
        """The key with a change of its value, for `variation.with_values`; in a table it needs its unit."""
        value = self.value + change
        return {self.name: f"{value!r} {self.unit}" if self.column and self.unit else value}


def key_of(system: Composition, name: str) -> Key:
    """A key of a part, or of all that a name stands for (`variation.parts_of`), of the gravity or of storage, by name.

    Raises
    ------
    InputError
        For a key that is not there, or is no number with a unit.
    """
    words = name.removeprefix("parts.")
    part, _, rest = words.partition(".")
    named = variation.parts_of(system, words) if rest else []
    if named:
        part = named[0]
        place, content = f"parts.{part}.{rest}", {"parts": {part: system._written(part), **_joints_of(system, part)}}
        values: Any = {"parts": {part: system.parts[part].model_dump()}}
    elif part == "gravity":
        place, content, values = name, {}, {"gravity": system._gravity.tolist()}
    elif part in system.sections and part in start_motion.KEYS:
        motion = start_motion.StartMotion.of(system.sections)
        place, content, values = name, {part: system.sections[part]}, motion.model_dump()
    elif part == "store" and "store" not in system.sections:
        raise InputError(f"there is no key {name!r}: the system is not stored; give store: {{time: ...}} first")
    elif part == "store" and (section := storage_of(system.sections)) is not None:
        place, content, values = name, {"store": system.sections["store"]}, {"store": section.model_dump()}
    else:
        raise InputError(f"there is no key {name!r}: no part is called {part!r}; {nearest(part, system.parts)}")
    case, written = cases.system("structure").Case, {**content, "system": "structure"}
    found = schema.locate(case, place, written)
    value: Any = values
    for word in place.split("."):
        if isinstance(value, list | tuple) and word.isdigit() and int(word) < len(value):
            value = value[int(word)]
        elif isinstance(value, Mapping):
            value = value.get(word, value)  # what is missing of a key that exists is the name of a choice
        else:
            value = None
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{name!r} is {schema.shown(value)}; a derivative is by a key that holds a number")
    marks = [getattr(mark, "quantity", mark) for _, own_marks in found.types for mark in own_marks]
    quantity = next((mark for mark in marks if isinstance(mark, units.Quantity)), None)
    if quantity is None:
        raise InputError(f"{name!r} is no quantity; a derivative is by a number with a unit")
    column = found.entry and schema.has_columns(schema.locate(case, place.rpartition(".")[0], written))
    return Key(name, float(value), quantity.unit, abs(float(value)) or 1.0, column)


def _joints_of(system: Composition, name: str) -> dict[str, Any]:
    """What a part acts on, joints and springs of them, as a case file holds it."""
    found: dict[str, Any] = {}
    for other in system.parts[name].references():
        part = system.parts.get(other)
        if isinstance(part, Joint | JointSpring) and other != name:
            with contextlib.suppress(InputError):
                found[other] = system._written(other)
                found = _joints_of(system, other) | found
    return found


def check(assembly: Assembly, method: str) -> None:
    """Refuse methods and parts through which a run has no derivative, by name.

    Raises
    ------
    InputError
    """
    if method not in implicit.METHODS:
        raise InputError(
            f"sensitivities are of the steps of {' and '.join(implicit.METHODS)}, but the method is {method}; name one "
            f"of them as `method`"
        )
    for family in families().values():
        found = family.records(assembly.model)
        smooth = family.smooth(found) if callable(family.smooth) else np.full(found.size, family.smooth)
        if not family.of and not np.all(smooth):
            k = int(np.argmin(smooth))
            raise InputError(
                f"{owner(assembly, family.name, k)!r} is {family.called(found[k : k + 1])}, through which "
                f"sensitivities are not supported"
            )


def sensitivity(
    system: Composition, values: Sequence[str], keys: Sequence[str], *, progress: Callable[[float], None] | None,
    until: float, every: float | None = None, fine: bool = True, mode: str = "forward", check: bool = True,
    **settings: Any,
) -> Sensitivities:  # fmt: skip
    """Derivatives of values of a run by keys: see `evolvent.System.sensitivity`."""
    values, of = _names("values", values), [key_of(system, name) for name in _names("keys", keys)]
    if mode not in MODES:
        raise InputError(f"mode is {mode!r}; it must be one of {', '.join(MODES)}")
    assembly, settings = _checked(system, of, settings, mode)
    if not system._found.issuperset(values):
        simulation.check_kept(assembly, values, method=settings["method"])
        system._found.update(values)
    samples = sample_times(until, every, values=assembly.y.size)
    check_run(assembly, samples, settings.get("step"))

    def table(progress: Callable[[float], None] | None, settings: Mapping[str, Any]) -> xr.Dataset:
        if mode == "adjoint":
            return _by_adjoint(system, assembly, of, values, samples, progress, settings)
        times = Times.of(samples, fine=fine and not is_local(assembly, values), values=assembly.y.size)
        change, solutions, plan = _solutions(system, assembly, of, times.all, progress, settings)
        lead = solutions[0]
        kept_samples = times.kept(lead)
        found = [_kept(one.chosen(kept_samples), values) for one in solutions]
        changes = change * np.array([key.size for key in of])
        return _dataset(found, values, of, changes, plan=plan, warning=warning_of(lead))

    found = table(progress, settings)
    return Sensitivities(_checked_by_other_steps(found, table, assembly, samples, settings) if check else found)


def _checked_by_other_steps(
    found: xr.Dataset, table: Callable[[None, Mapping[str, Any]], xr.Dataset], assembly: Assembly, samples: Array,
    settings: Mapping[str, Any],
) -> xr.Dataset:  # fmt: skip
    """Values and derivatives with their errors of integration, or with the reason why there are none."""
    why = ""
    for level, factor in BESIDE.items():
        try:
            beside = table(None, accuracy.settings_at(level, assembly, samples, settings))
        except EvolventError as error:
            why = why or str(error)
        else:
            return _with_errors(found, beside, factor)
    return found.assign_attrs(integration=f"errors of integration are not known: with other steps {why}")


def _with_errors(found: xr.Dataset, beside: xr.Dataset, factor: float) -> xr.Dataset:
    """Values and derivatives with their errors of integration: a share of what other steps change."""
    off = {name: factor * abs(found[name] - beside[name]) for name in ("derivative", "result")}
    names = {
        f"{name}_error": one.assign_attrs(long_name=f"error of the {name} by integration") for name, one in off.items()
    }
    found = found.assign(names)
    share = off["derivative"] * abs(found["at"]) > RESOLVED_RESULT * abs(found["result"])
    wrong = np.argwhere(((off["derivative"] > LARGEST_ERROR * abs(found["derivative"])) & share).values)
    sentence = "errors of integration are estimated from a run with other steps"
    if not wrong.size:
        return found.assign_attrs(integration=sentence)
    i, j = wrong[0]
    value, key = str(found["value"].values[i]), str(found["key"].values[j])
    percent = 100.0 * float(off["derivative"][i, j] / abs(found["derivative"][i, j]))
    warning = (
        f"the derivative of {value!r} by {key!r} has an error of some {percent:.2g} % by integration; take a smaller "
        f"tolerance or step"
    )
    before = found.attrs.get("warning", "")
    return found.assign_attrs(integration=sentence, warning="; ".join(filter(None, (before, warning))))


def _by_adjoint(
    system: Composition, assembly: Assembly, of: Sequence[Key], values: Sequence[str], samples: Array,
    progress: Callable[[float], None] | None, settings: Mapping[str, Any],
) -> xr.Dataset:  # fmt: skip
    """Derivatives by the adjoint."""

    def read(solution: Solution) -> tuple[Kept, Array]:
        kept = _kept(solution, values)
        return kept, np.array([_number(kept, name) for name in values])

    change, numbers = gradient.CHANGE, gradient.ChangedNumbers(system, assembly)
    keys = []
    for key in of:
        with _on_both_sides(key):
            d = change * key.size
            up, down = (numbers.of(variation.with_values(system, key.at(side * d))) for side in (1.0, -1.0))
        keys.append(gradient.Changed(key.name, d, numbers.sides(key.name, up, down)))

    def together(changes: Mapping[int, float]) -> Assembly:
        values = {name: value for k, d in changes.items() for name, value in of[k].at(d).items()}
        return variation.with_values(system, values)._assembled()

    found = gradient.gradient(
        assembly, lambda: runs.plan(assembly, samples, **settings)[0], keys, together, values, read, progress
    )
    attrs = {"change": change, "mode": "adjoint"}
    return _table(found.kept, values, of, found.values, found.derivative, found.plan, attrs, warning_of(found.solution))


def adjoint_cost(system: Composition, values: Sequence[str], keys: Sequence[str]) -> float:
    """Estimated time of the derivatives of values of a run by keys by the adjoint, beside that of the run.

    Raises
    ------
    InputError
        For methods, parts and keys that have no adjoint; not all of them.
    """
    settings = system._run_settings({})
    until, every, _ = (settings.pop(name, None) for name in ("until", "every", "fine"))
    of = [key_of(system, name) for name in _names("keys", keys)]
    assembly, settings = _checked(system, of, settings, "adjoint")
    samples = sample_times(until, every, values=assembly.y.size)
    return adjoint_support.cost(runs.plan(assembly, samples, **settings)[0], len(values), len(of))


def jacobian(
    system: Composition, evaluate: Callable[[Solution], Array], keys: Sequence[str], *, until: float,
    every: float | None = None, fine: bool = True, **settings: Any,
) -> tuple[Array, Array]:  # fmt: skip
    """What a function makes of the solution of a run, and its derivatives by keys.

    Parameters
    ----------
    system : Composition
    evaluate : function of a `Solution`, at samples that are alike in all of them, to an array (n,)
    keys : as of `evolvent.System.sensitivity`; until, every, fine, settings : as of `evolvent.System.simulate`

    Returns
    -------
    values : (n,) float; derivatives : (n, keys) float, by the keys in SI units

    Raises
    ------
    InputError, RunFailed
        As of `evolvent.System.sensitivity`.
    """
    of = [key_of(system, name) for name in _names("keys", keys)]
    assembly, settings = _checked(system, of, settings, "forward")
    samples = sample_times(until, every, values=assembly.y.size)
    check_run(assembly, samples, settings.get("step"))
    times = Times.of(samples, fine=fine, values=assembly.y.size)
    change, solutions, _ = _solutions(system, assembly, of, times.all, None, settings)
    kept_samples = times.kept(solutions[0])
    values, _, *sides = [np.asarray(evaluate(one.chosen(kept_samples)), dtype=float) for one in solutions]
    odd = np.stack([0.5 * (up - down) for up, down in zip(sides[::2], sides[1::2], strict=True)], axis=1)
    return values, odd / (change * np.array([key.size for key in of]))


def _checked(
    system: Composition, of: Sequence[Key], settings: dict[str, Any], mode: str
) -> tuple[Assembly, dict[str, Any]]:
    """The assembled system, and settings of its run with the method that is taken, if both have derivatives."""
    if len(of) > MOST and mode == "forward":
        raise InputError(f"there are {len(of)} keys, of at most {MOST} in a call; take mode 'adjoint'")
    assembly = system._assembled()
    method, _ = choose_method(assembly, settings.get("method", "auto"))
    check(assembly, method)
    return assembly, settings | {"method": method}


def _solutions(
    system: Composition, assembly: Assembly, of: Sequence[Key], times: Array, progress: Callable[[float], None] | None,
    settings: Mapping[str, Any],
) -> tuple[float, list[Solution], Any]:  # fmt: skip
    """The change of keys, solutions of the run, of its middle and of its neighbours to both sides, and its plan."""

    def plan(one: Assembly) -> Any:
        return runs.plan(one, times, **settings)[0]

    for change in CHANGES:
        changed = [_changed(system, key, side * change) for key in of for side in (1.0, -1.0)]
        beside = Neighbours(plan(assembly), plan(assembly), [plan(one) for one in changed])
        try:
            status, message = beside.run(progress)
            break
        except TooFar as left:
            if change == CHANGES[-1]:
                name = of[max(left.index, 0) // 2].name
                raise InputError(
                    f"the run has no derivative by {name!r}: with {change:g} of it more or less, {left.why}"
                ) from None
        except EvolventError:
            raise
        except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
            moments = [moment for one in (beside.lead, *beside.all) for moment in one.moments()]
            why = law_failure(assembly, error, moments)
            raise RunFailed(why, None) from None
    solutions = [one.result(status, message, 0.0) for one in (beside.lead, *beside.all)]
    if status == "failed":
        raise RunFailed(message, trees.tree(solutions[0].or_start(0.0), case="", why=""))
    return change, solutions, beside.lead.plan


def _names(what: str, given: Any) -> list[str]:
    names = [given] if isinstance(given, str) else list(given)
    if not names or not all(isinstance(name, str) for name in names):
        raise InputError(f"{what} are {given!r}; they must be one or more names")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{what} name {twice!r} twice")
    return names


def _changed(system: Composition, key: Key, side: float) -> Assembly:
    """The system with a key changed to one side, assembled."""
    with _on_both_sides(key):
        return variation.with_values(system, key.at(side * key.size))._assembled()


@contextlib.contextmanager
def _on_both_sides(key: Key) -> Iterator[None]:
    """State that a derivative by a key needs values on both sides, where a system with one is refused."""
    try:
        yield
    except InputError as error:
        raise InputError(
            f"a derivative by {key.name!r}, which is {key.value:g} {key.unit}, needs values on both sides: {error}"
        ) from None


def _kept(solution: Solution, values: Sequence[str]) -> Kept:
    found = kept_of(
        solution, values, lambda: root_of(solution, {}), fine=np.zeros(solution.t.size, dtype=bool), why=""
    )  # fmt: skip
    if found.missing:
        known = names(trees.tree(solution, case="", why=""), over_time=False)
        raise refusal(found.missing[0], [*known, *solution.statistics])
    return found


def _number(found: Kept, name: str) -> float:
    """A value that is one number, also where it is kept at every sample and is the same at all of them."""
    values = np.asarray(found[name], dtype=float).ravel()
    if values.size > 1 and not np.all((values == values[0]) | np.isnan(values)):
        raise InputError(
            f"{name!r} has {values.size} values; a derivative is of one: name a component and how it is reduced over "
            f"time, such as '{name}.last'"
        )
    if not np.isfinite(values[0]):
        raise InputError(f"{name!r} is {values[0]} in this run; a derivative is of a number")
    return float(values[0])


def _dataset(
    found: list[Kept], names: Sequence[str], keys: Sequence[Key], changes: Array, *, plan: Any, warning: str
) -> xr.Dataset:
    """Values, derivatives, and what they are beside values and keys."""
    own, middle = found[0], found[1]
    sides = np.array([[_number(one, name) for one in found[2:]] for name in names]).reshape(len(names), len(keys), 2)
    value, centre = (np.array([_number(one, name) for name in names]) for one in (own, middle))
    odd = 0.5 * (sides[..., 0] - sides[..., 1])
    even = np.abs(0.5 * (sides[..., 0] + sides[..., 1]) - centre[:, None])
    for i, j in np.argwhere((even > UNEVEN * np.abs(odd)) & (even > RESOLVED * np.abs(centre[:, None]) + ROUND_OFF)):
        up, down = (sides[i, j, 0] - centre[i]) / changes[j], (centre[i] - sides[i, j, 1]) / changes[j]
        raise InputError(
            f"{names[i]!r} has no derivative by {keys[j].name!r}: it is {up:.6g} towards larger values and {down:.6g} "
            f"towards smaller ones"
        )
    attrs = {"change": float(changes[0] / keys[0].size), "mode": "forward"}
    return _table(own, names, keys, value, odd / changes, plan, attrs, warning)


def _table(
    own: Kept, names: Sequence[str], keys: Sequence[Key], value: Array, derivative: Array, plan: Any,
    attrs: Mapping[str, Any], warning: str,
) -> xr.Dataset:  # fmt: skip
    """Values and derivatives with their units."""
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = derivative * np.array([key.value for key in keys]) / value[:, None]
    unit = [own.units(name) for name in names]
    by = [key.unit or "1" for key in keys]
    both = ("value", "key")
    return xr.Dataset(
        {
            "derivative": (both, derivative, {"long_name": "derivative of the value by the key, SI"}),
            "relative": (both, relative, {"units": "1", "long_name": "relative change of the value by the key's"}),
            "result": (("value",), value, {"long_name": "the value itself, SI"}),
            "at": (("key",), np.array([key.value for key in keys]), {"long_name": "value of the key, SI"}),
        },
        coords={
            "value": list(names), "key": [key.name for key in keys], "value_unit": (("value",), unit),
            "key_unit": (("key",), by), "unit": (both, [[_ratio(a, b) for b in by] for a in unit]),
        },
        attrs={
            "method": plan.method, "steps": "fixed" if plan.step is not None else "as in the run", **attrs,
            **({"warning": warning} if warning else {}),
        },
    )  # fmt: skip


def _ratio(unit: str, by: str) -> str:
    """Unit of a derivative."""
    if by in ("", "1"):
        return unit
    return f"{unit}/({by})" if any(mark in by for mark in " /") else f"{unit}/{by}"
