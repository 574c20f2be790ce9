"""Limits of a case, its key `limits`: bounds on results, "hinge 1.torque.abs_max <= 2 N m", which a run is judged by.

Runs, dispersions and designs read and check them alike: of a variable over time its worst value counts.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis import kept_clearances
from evolvent.analysis.margins.kept_margins import AT_REST, IN_RUN, KeptMargins, others_of
from evolvent.results import variables
from evolvent.results.kept import check_names, kept_of, split, unit_of
from evolvent.results.limits import LIMITS
from evolvent.results.tree import root_of
from evolvent_base import units
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

_REQUIREMENT = re.compile(r"(.+?)\s*(<=|>=)\s*(.+)")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Requirement:
    """A bound on a result: ``name <= value`` (upper) or ``name >= value``.

    Attributes
    ----------
    name : str, as it was asked
    keep : str, what is kept of a run for it
    upper : bool
    value : float, in `unit`
    unit : str, SI
    text : str, the requirement as it was asked
    """

    name: str
    keep: str
    upper: bool
    value: float
    unit: str
    text: str

    def short(self, value: float) -> float:
        """By how much a value misses it; below 0 where it meets it."""
        return value - self.value if self.upper else self.value - value

    def is_met(self, value: float) -> bool:
        """Whether a value meets it; one that is not a number does not."""
        return self.short(value) <= 0.0


class Names:
    """Names of results of a case's runs.

    Parameters
    ----------
    start : function that returns the results at the start of a run, or None where there are none before it runs
    coordinates : function that returns the names of the coordinates that have margins
    parts : function that returns the parts of the case by name
    who : str, who asks, for messages
    """

    def __init__(
        self,
        start: Callable[[], Any],
        coordinates: Callable[[], Sequence[str]],
        parts: Callable[[], Mapping[str, Any]],
        who: str = "the design asks for",
    ) -> None:
        self._start, self.having_margins, self._parts, self._who = start, coordinates, parts, who

    @functools.cached_property
    def start(self) -> Any:
        """Results at the start of a run; None where there are none before it runs."""
        return self._start()

    def kept(self, name: str, reduction: str) -> str:
        """Name of what is kept for a name: of a variable over time its worst value, unless the name says another."""
        if not isinstance(name, str) or not name.strip():
            raise InputError(f"{name!r} is no name of a result; give one such as 'hinge 1.latch_time'")
        if not others_of([name]) or self.start is None:
            self._check(name)
            return name
        self._check(name)
        own, asked = split(name)
        try:
            found = variables.get(self.start, own)
        except InputError:  # a statistic, which the run knows
            return name
        if sizes := {dim: size for dim, size in found.sizes.items() if dim != "time" and size > 1}:
            many = " x ".join(f"{size} ({dim})" for dim, size in sizes.items())
            raise InputError(f"{own!r} has {many} values; name one of them, such as {own}.x or {own}[0]")
        return f"{name}.{reduction}" if "time" in found.dims and not asked else name

    def _check(self, name: str) -> None:
        if kept_clearances.is_clearance(name):
            kept_clearances.check(self._parts(), [name])
        if self.start is not None and others_of([name]):
            try:
                check_names([name], self.start)
            except InputError as error:
                raise InputError(str(error).replace("keep holds", self._who)) from None

    def unit(self, kept: str) -> str:
        """Unit of a name of what is kept; '' where it has none, or is a statistic."""
        if kept_clearances.is_clearance(kept):
            return kept_clearances.UNIT
        if self.start is None or not others_of([kept]):
            return ""
        name, reduction = split(kept)
        try:
            unit = unit_of(str(variables.get(self.start, name).attrs.get("units", "1")), reduction)
        except InputError:
            return ""
        return "" if unit == "1" else units.unit_text(unit)


def requirements(text: Any, names: Names) -> list[Requirement]:
    """A requirement, or one for every coordinate where it is on ``margin`` alone.

    Raises
    ------
    InputError
        If the text is none; the sentence has it.
    """
    match = _REQUIREMENT.fullmatch(text.strip()) if isinstance(text, str) else None
    if match is None:
        raise InputError(
            f"the requirement {text!r} is not of the form 'NAME <= VALUE' or 'NAME >= VALUE', such as "
            f"'hinge 1.latch_time <= 20 s'"
        )
    if match[1] in (AT_REST, IN_RUN):
        return [one for name in names.having_margins() for one in requirements(f"{name}.{text.strip()}", names)]
    name, upper = match[1], match[2] == "<="
    kept = names.kept(name, "max" if upper else "min")
    unit = names.unit(kept)
    try:
        value = units.parse(match[3], unit)
    except units.UnitError as error:
        wanted = f"a number in {unit}, or with a unit of that kind" if unit else "a plain number"
        raise InputError(f"the requirement {text!r} has the bound {match[3]!r}; it must be {wanted}; {error}") from None
    if not math.isfinite(value):
        raise InputError(f"the requirement {text!r} has the bound {match[3]!r}; it must be a finite number")
    return [Requirement(name=name, keep=kept, upper=upper, value=value, unit=unit, text=text.strip())]


def of_texts(texts: Sequence[str], names: Names) -> tuple[Requirement, ...]:
    """The limits of a case.

    Raises
    ------
    InputError
        For a text that is no limit, and a name that runs of the case do not have.
    """
    try:
        return tuple(one for text in dict.fromkeys(texts) for one in requirements(text, names))
    except InputError as error:
        raise InputError(f"{LIMITS}: {error}") from None


def written(
    wanted: Sequence[Requirement], section: Mapping[str, Any], solution: Solution, root: Mapping[str, Any]
) -> str:
    """What a run makes of limits, as its attribute `LIMITS` holds it.

    Parameters
    ----------
    section : the key `margin` of the case, empty where it has none
    root : more variables of the root of its results, as of `evolvent.results.tree.root_of`
    """
    names = tuple(dict.fromkeys(one.keep for one in wanted))
    margins = KeptMargins.of(solution.assembly, section, names)
    fine = np.zeros(solution.t.size, dtype=bool)
    found = kept_of(solution, margins.others, lambda: root_of(solution, dict(root)), fine=fine, why="")
    found = margins.added(found, solution)
    rows = []
    for one in wanted:
        value = float(found[one.keep]) if one.keep in found else math.nan
        rows.append([one.text, value if math.isfinite(value) else None, one.unit, one.is_met(value)])
    return json.dumps(rows)
