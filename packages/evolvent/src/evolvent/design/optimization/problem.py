"""What a design asks: the keys that vary between bounds, what is minimized, and the requirements."""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.analysis import limits
from evolvent.analysis.limits import Requirement
from evolvent.design.studies import distributions, draws
from evolvent.design.studies.axes import annotation, value_at, written
from evolvent.results.limits import LIMITS
from evolvent_base import schema, units
from evolvent_base.errors import InputError

Array = np.ndarray
#: Bounds of a key that is given without any, as multiples of the case's value.
SHARES = (0.5, 2.0)
#: Most values of a key that takes whole numbers or words, and most combinations of such values.
MOST_CHOICES, MOST_COMBINATIONS = 100, 1000
#: Most keys that vary continuously.
MOST_KEYS = 60
_RANGE = re.compile(r"(.+?)\s+to\s+(.+)")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Key:
    """A key of the case that varies between two bounds (SI), or among values.

    Attributes
    ----------
    key : str, dotted
    unit, what : str, as the schema says
    entry : bool, whether it is an entry of a list, whose others may have another unit
    low, high : float, bounds; NaN of a key that takes one of `choices`
    start : the case's own value
    choices : tuple, values, one of which is taken; empty of a key with bounds
    """

    key: str
    unit: str
    what: str
    entry: bool
    low: float
    high: float
    start: Any
    choices: tuple[Any, ...] = ()

    def written(self, value: Any) -> Any:
        """A value as a case holds it."""
        return written(value, self.unit, entry=self.entry)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variable:
    """Keys that vary together: each stands at the same share of the way between its bounds, or at the same choice."""

    keys: tuple[Key, ...]

    @property
    def name(self) -> str:
        """The keys in one text."""
        return ", ".join(key.key for key in self.keys)

    @property
    def choices(self) -> int:
        """Number of values to choose from; 0 of a variable with bounds."""
        return len(self.keys[0].choices)

    @property
    def start(self) -> float:
        """Share of the way between the bounds at which the case's own value stands, at most at a bound."""
        first = self.keys[0]
        return min(max((first.start - first.low) / (first.high - first.low), 0.0), 1.0)

    def overrides(self, place: float) -> dict[str, Any]:
        """Keys of the case at a share of the way (or at the number of a choice)."""
        if self.choices:
            return {key.key: key.written(key.choices[int(place)]) for key in self.keys}
        return {key.key: key.written(float(key.low + place * (key.high - key.low))) for key in self.keys}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Spread:
    """A key with a distribution about the value that a design gives it.

    Attributes
    ----------
    key : str, dotted; called : str, what gives the distribution, for messages
    text : str, the distribution
    reader : what reads the key's value
    """

    key: str
    called: str
    text: str
    reader: Any

    @classmethod
    def of(cls, key: str, text: str, called: str, kind: Any, content: Mapping[str, Any]) -> Spread:
        """The distribution of a key of a case.

        Raises
        ------
        InputError
            If the case has no such key.
        """
        reader, _ = annotation(kind, key, content, called=called)
        return cls(key=key, called=called, text=text, reader=reader)

    def about(self, case: Any) -> distributions.Distribution:
        """The distribution about the value of a checked case.

        Raises
        ------
        InputError
            If it is none.
        """
        own = functools.partial(value_at, case, self.key)
        return distributions.read(f"{self.called}.{self.key}", self.text, self.reader, own)

    def written(self, value: Any) -> Any:
        """A value as a case holds it."""
        unit = getattr(self.reader, "unit", "") or ""
        return written(value, unit, entry=self.key.rpartition(".")[2].isdecimal())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Dispersed:
    """Keys that are dispersed about every design, by the same draws.

    Attributes
    ----------
    keys : tuple of (Spread, number of its draw)
    probabilities : (samples, draws) float, in (0, 1)
    quantile : float, share of the runs that a result must cover
    """

    keys: tuple[tuple[Spread, int], ...]
    probabilities: Array
    quantile: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class DesignProblem:
    """A checked design problem.

    Attributes
    ----------
    content : dict, the case
    variables : tuple of Variable
    objective : tuple of str, names whose sum is minimized (or maximized), as asked
    objective_keep : tuple of str, the same as names of what is kept of a run
    maximize : bool
    unit : str, of the objective
    requirements : tuple of Requirement
    dispersed : Dispersed or None
    """

    content: dict[str, Any]
    variables: tuple[Variable, ...]
    objective: tuple[str, ...]
    objective_keep: tuple[str, ...]
    maximize: bool
    unit: str
    requirements: tuple[Requirement, ...]
    dispersed: Dispersed | None

    @property
    def keep(self) -> tuple[str, ...]:
        """What is kept of every run."""
        return tuple(dict.fromkeys((*self.objective_keep, *(one.keep for one in self.requirements))))

    @functools.cached_property
    def continuous(self) -> tuple[Variable, ...]:
        """Variables with bounds."""
        return tuple(one for one in self.variables if not one.choices)

    @functools.cached_property
    def discrete(self) -> tuple[Variable, ...]:
        """Variables that take one of several values."""
        return tuple(one for one in self.variables if one.choices)

    @property
    def aim(self) -> str:
        """The objective in words."""
        what = " + ".join(self.objective)
        if self.dispersed is not None:
            share = self.dispersed.quantile if not self.maximize else 1.0 - self.dispersed.quantile
            what = f"{100.0 * share:.6g} % quantile of {what}"
        return f"{'maximize' if self.maximize else 'minimize'} {what}"

    def overrides(self, place: Array, chosen: Sequence[int]) -> dict[str, Any]:
        """Keys of the case of a design: shares of the ways of `continuous`, and numbers of choices of `discrete`."""
        found: dict[str, Any] = {}
        for one, share in zip(self.continuous, place, strict=True):
            found |= one.overrides(float(share))
        for one, number in zip(self.discrete, chosen, strict=True):
            found |= one.overrides(number)
        return found

    def runs(self, place: Array, chosen: Sequence[int]) -> list[dict[str, Any]]:
        """Keys of the case of every run of a design: one, or one a draw of the dispersion."""
        own = self.overrides(place, chosen)
        if self.dispersed is None:
            return [own]
        case = cases.load(self.content, own)
        found = [dict(own) for _ in range(len(self.dispersed.probabilities))]
        for spread, draw in self.dispersed.keys:
            drawn = spread.about(case).quantiles(self.dispersed.probabilities[:, draw])
            for one, value in zip(found, drawn, strict=True):
                one[spread.key] = spread.written(value)
        return found


# ------------------------------------------------------------------------------------------------ reading


def read(
    content: dict[str, Any],
    *,
    vary: Mapping[str, Any],
    minimize: Sequence[str] = (),
    maximize: Sequence[str] = (),
    subject_to: Sequence[str] = (),
    disperse: Mapping[str, Any] | None = None,
    samples: int = 32,
    quantile: float = 0.95,
    seed: int = 0,
) -> DesignProblem:
    """A checked design problem.

    Parameters
    ----------
    content : the case as it is written
    vary : mapping, keys (with commas between those that vary together) -> bounds or choices
    minimize, maximize : names whose sum is the objective; one of them is given
    subject_to : requirements, ``"hinge 1.latch_time <= 20 s"``, beside the case's own `limits`
    disperse : mapping, keys -> distribution, as of a dispersion
    samples, quantile, seed : of the dispersion

    Raises
    ------
    InputError
        One sentence that names the key or name, its value and what is allowed.
    """
    if bool(minimize) == bool(maximize):
        raise InputError("a design needs one of minimize and maximize, such as minimize='hinge 1.latch_work.last'")
    if not isinstance(vary, Mapping) or not vary:
        raise InputError(
            "vary is empty; it must name keys of the case, such as {'parts.hinge 1.stiffness': '50% to 200%'}"
        )
    system = cases.system_of(content)
    content = cases.in_place(content)
    case = cases.load(content)
    found = tuple(_variable(str(names), given, system.Case, content, case) for names, given in vary.items())
    own = [key.key for one in found for key in one.keys]
    twice = next((key for key in own if own.count(key) > 1), None)
    if twice is not None:
        raise InputError(f"vary names {twice!r} twice; a key varies in one way")
    if math.prod(one.choices or 1 for one in found) > MOST_COMBINATIONS:
        raise InputError(f"the choices have more than {MOST_COMBINATIONS} combinations; give fewer of them")
    if sum(not one.choices for one in found) > MOST_KEYS:
        raise InputError(f"vary names {len(found)} variables with bounds; at most {MOST_KEYS} are possible")
    names = _names_of(system, case)
    objective = tuple(minimize or maximize)
    kept = tuple(names.kept(name, "max" if minimize else "min") for name in objective)
    given = (*(content.get(LIMITS) or ()), *subject_to)
    wanted = tuple(one for text in dict.fromkeys(given) for one in limits.requirements(text, names))
    spread = _dispersed(disperse or {}, system.Case, content, case, samples, quantile, seed)
    units_ = {names.unit(name) for name in kept}
    if len(units_) > 1:
        raise InputError(f"the objective sums {' and '.join(sorted(units_))}; its terms must have one unit")
    return DesignProblem(
        content=content, variables=found, objective=objective, objective_keep=kept, maximize=bool(maximize),
        unit=units_.pop(), requirements=wanted, dispersed=spread,
    )  # fmt: skip


def _names_of(system: Any, case: Any) -> limits.Names:
    """Names of results of a case's runs."""

    def start() -> Any:
        plan = system.plan(case)
        return plan.start() if plan.start is not None else None

    return limits.Names(start, lambda: system.margin(case, motion=False).names, lambda: system.system(case).parts)


def paths(names: str, content: Mapping[str, Any]) -> list[str]:
    """Keys of a case in a text with commas between them; ``parts.`` may be left out before a part's name."""
    keys, parts = [one.strip() for one in names.split(",")], content.get("parts") or {}
    return [f"parts.{key}" if key.partition(".")[0] in parts else key for key in keys]


def _variable(names: str, given: Any, kind: Any, content: Mapping[str, Any], case: Any) -> Variable:
    keys = tuple(_key(one, given, kind, content, case) for one in paths(names, content))
    if len({len(one.choices) for one in keys}) > 1:
        raise InputError(f"vary.{names}: these keys vary together, but have different numbers of choices")
    return Variable(keys=keys)


def _key(key: str, given: Any, kind: Any, content: Mapping[str, Any], case: Any) -> Key:
    """A key with its bounds or choices."""
    reader, what = annotation(kind, key, content, called="vary")
    try:
        own = value_at(case, key)
    except (KeyError, IndexError, TypeError, AttributeError):
        own = None
    whole = isinstance(reader, units.Whole)
    unit = getattr(reader, "unit", "") or ""
    shared = {"key": key, "unit": unit, "what": what, "entry": key.rpartition(".")[2].isdecimal(), "start": own}
    if isinstance(given, (list, tuple)):
        return Key(**shared, low=math.nan, high=math.nan, choices=_choices(key, given, reader))
    if reader is None:
        raise InputError(f"vary.{key} takes words or lists, so it has no bounds; give a list of choices")
    is_number = isinstance(own, (int, float)) and not isinstance(own, bool)
    low, high = _bounds(key, given, reader, own if is_number else None)
    if whole:
        if high - low + 1 > MOST_CHOICES:
            raise InputError(f"vary.{key} has {high - low + 1:.0f} whole numbers; at most {MOST_CHOICES} are possible")
        return Key(**shared, low=math.nan, high=math.nan, choices=tuple(range(math.ceil(low), math.floor(high) + 1)))
    if not is_number:
        shared["start"] = 0.5 * (low + high)
    return Key(**shared, low=low, high=high)


def _choices(key: str, given: Sequence[Any], reader: Any) -> tuple[Any, ...]:
    if not 1 <= len(given) <= MOST_CHOICES:
        raise InputError(f"vary.{key} lists {len(given)} choices; it must list 1 to {MOST_CHOICES}")
    if reader is None or isinstance(reader, units.Whole):
        return tuple(given)
    return tuple(distributions.number(f"vary.{key}", {"choice": one}, "choice", reader) for one in given)


def _bounds(key: str, given: Any, reader: Any, own: float | None) -> tuple[float, float]:
    """Bounds of a key in its unit."""
    where = f"vary.{key}"

    def nominal() -> float:
        if own is None:
            raise InputError(
                f"{where} is {schema.shown(given)}, but the case gives no number there; give bounds with values"
            )
        return own

    if given is None or given == "":
        low, high = sorted(share * nominal() for share in SHARES)
    else:
        match = _RANGE.fullmatch(given.strip()) if isinstance(given, str) else None
        if match is None:
            raise InputError(
                f"{where} is {schema.shown(given)}; it must be bounds such as '0.1 to 0.5 N m/rad' or '50% to 200%', "
                f"or a list of choices"
            )
        first, last = match[1], match[2]
        unit = units.unit_of(last)
        if unit and not units.unit_of(first) and not first.endswith("%"):
            first = f"{first} {unit}"
        low, high = (distributions.value(where, given, one, reader, nominal) for one in (first, last))
    low, high = max(low, _least(reader)), min(high, _most(reader))
    if not low < high:
        raise InputError(
            f"{where} is {schema.shown(given)}; the lower bound ({low:.6g}) must be below the upper one ({high:.6g})"
        )
    return low, high


def _least(reader: Any) -> float:
    """Smallest value that a key allows."""
    above = getattr(reader, "above", None)
    bounds = [getattr(reader, "least", None), None if above is None else math.nextafter(above, math.inf)]
    return max((one for one in bounds if one is not None), default=-math.inf)


def _most(reader: Any) -> float:
    """Largest value that a key allows."""
    below = getattr(reader, "below", None)
    bounds = [getattr(reader, "most", None), None if below is None else math.nextafter(below, -math.inf)]
    return min((one for one in bounds if one is not None), default=math.inf)


def _dispersed(
    given: Mapping[str, Any], kind: Any, content: Mapping[str, Any], case: Any, samples: int, quantile: float, seed: int
) -> Dispersed | None:
    """The dispersion about every design."""
    if not given:
        return None
    if isinstance(quantile, bool) or not isinstance(quantile, (int, float)) or not 0.5 <= quantile < 1.0:
        raise InputError(f"quantile is {quantile!r}; it must be from 0.5 and below 1, such as 0.95")
    if isinstance(samples, bool) or not isinstance(samples, int) or not 2 <= samples <= 10_000:
        raise InputError(f"samples is {samples!r}; it must be a whole number from 2 to 10000")
    found = []
    for draw, (names, text) in enumerate(given.items()):
        for key in paths(str(names), content):
            spread = Spread.of(key, text, "disperse", kind, content)
            spread.about(case)
            found.append((spread, draw))
    probabilities = draws.probabilities("latin-hypercube", samples, len(given), seed)
    return Dispersed(keys=tuple(found), probabilities=probabilities, quantile=float(quantile))


#: What a search reports while it goes on: the number of runs, and the best objective so far (NaN without one).
Progress = Callable[[int, float], None]
