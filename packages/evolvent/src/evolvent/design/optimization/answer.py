"""A design as an answer: keys, requirements, tolerances, searches, a figure."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.design.dispersions.answer import short_name
from evolvent.design.optimization.problem import DesignProblem, Variable
from evolvent.design.optimization.runs import DesignResult
from evolvent.design.optimization.trade import Trade
from evolvent.results import made_with
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown

Array = np.ndarray
#: Colours of what meets all requirements, and of what misses one.
_MEETS, _MISSES = "#2a7f3f", "#c0392b"
#: Relative amount by which a requirement that is missed with finer integration alone is said to be.
MISSED = 1e-5
#: Stationarity above which the derivatives at the end do not fit an optimum.
_STATIONARY = 0.1

Rows = list[tuple[str, ...]]


def answer_of(found: Design) -> an.Answer:
    """What was found."""
    title = f"Design: {found.problem.aim}"
    made = {
        "Keys": key_table(found),
        "Requirements": requirement_table(found),
        "What tolerances do, to first order": tolerance_table(found),
        "Searches": end_table(found),
    }
    missed = f"no design that was tried meets all requirements; missed: {'; '.join(found.missed())}"
    case = an.Listing(cases.dump(found.content))
    return an.Answer(
        title=title, heads=sentences(found), warnings=[] if found.met else [missed],
        sections=[
            *(an.Section(title=name, blocks=[table]) for name, table in made.items()),
            an.Section(title="Search", blocks=[figure(found)], level=an.PAGE),
            an.Section(title="Case", blocks=[an.Remark("The case with the design."), case], level=an.PAGE),
        ],
        files={"design.yaml": lambda: f"# A design: {found.problem.aim}\n{case.text}"},
        made=made_with(),
    )  # fmt: skip


def number(value: float) -> str:
    """A number of five digits; a dash where there is none."""
    return f"{value:.5g}" if math.isfinite(value) else "-"


def _with_unit(value: float, unit: str) -> str:
    return f"{number(value)} {unit}".rstrip()


def sentences(found: Design) -> list[str]:
    """What was searched, how it ended, and what a reader must know."""
    problem = found.problem
    best, start = (_with_unit(one, problem.unit) for one in (found.objective, found.start.result.objective))
    searches = f"{len(found.ends)} {'search' if len(found.ends) == 1 else 'searches'}"
    lines = [
        f"{problem.aim}: {best}, {start} of the case as it is",
        f"{found.runs} runs, {searches}; the best ended with: {found.best.message}",
    ]
    if found.derivatives:
        lines.append(f"derivatives: {found.derivatives}")
    if problem.dispersed is not None:
        spread = problem.dispersed
        lines.append(
            f"every design has {len(spread.probabilities)} runs with dispersed keys, by the same draws; objective and "
            f"requirements are their {100 * spread.quantile:.6g} % quantiles on the worse side, by order"
        )
    lines.append(_integration(found))
    if found.exhausted:
        lines.append("the search ended since it had no runs left; more are allowed by most_runs (--runs)")
    if found.trade is not None:
        lines += found.trade.at_bounds
        if found.trade.residual > _STATIONARY:
            lines.append(
                f"the derivatives at the end are no optimum's to {100 * found.trade.residual:.2g} %: results have "
                f"kinks or jumps there, or the search ended early; try other starts, or the optimizer cobyqa"
            )
    return lines


def _integration(found: Design) -> str:
    """A sentence on the error of integration of the best design."""
    own, finer, problem = found.best.result, found.finer, found.problem
    if not finer.sound:
        return f"the error of integration is not known: with finer integration {finer.reason}"
    off = abs(finer.objective - own.objective)
    parts = [f"the objective by {_with_unit(off, problem.unit)}"]
    both = zip(problem.requirements, own.values, finer.values, strict=True)
    parts += [f"{one.text} by {number(abs(b - a))}" for one, a, b in both]
    line = f"error of integration: a finer one changes {', '.join(parts)}"
    missed = [
        f"{one.text} (it is {number(value)})"
        for one, value, before in zip(problem.requirements, finer.values, own.values, strict=True)
        if one.short(value) > MISSED * max(abs(one.value), abs(value)) and not one.short(before) > 0.0
    ]
    return line + (f"; with it {'; '.join(missed)} is missed" if missed else "")


def key_table(found: Design) -> an.Table:
    """The keys: name with unit, lower bound, case, design, upper bound."""
    rows: Rows = []
    own = found.values
    for one in found.problem.variables:
        for key in one.keys:
            name = f"{key.key} [{key.unit}]" if key.unit else key.key
            value = own[key.key]
            shown = _shown(value, key.unit)
            start = "-" if key.start is None else _shown(key.start, key.unit)
            low, high = ("choices", str(len(key.choices))) if key.choices else (number(key.low), number(key.high))
            rows.append((name, low, start, shown, high))
    return an.Table(heads=("key", "lower", "case", "design", "upper"), rows=rows)


def _shown(value: object, unit: str) -> str:
    if isinstance(value, str) and unit:
        value = value.removesuffix(f" {unit}")
        return number(float(value)) if value.replace(".", "", 1).replace("e-", "", 1).isdigit() else value
    return number(float(value)) if isinstance(value, float) else str(value)


def requirement_table(found: Design) -> an.Table:
    """The requirements: text, value of the case, of the design, slack, multiplier."""
    rows: Rows = []
    for k, one in enumerate(found.problem.requirements):
        value = float(found.best.result.values[k])
        left = -one.short(value)
        state = "active" if found.trade is not None and found.trade.multipliers[k] > 0.0 else "met"
        gain = "-" if found.trade is None else number(float(found.trade.multipliers[k]))
        start = number(float(found.start.result.values[k]))
        rows.append((one.text, start, number(value), number(left), state if left >= 0.0 else "MISSED", gain))
    worth = f"worth of a unit, {found.problem.unit or 'objective'}"
    return an.Table(heads=("requirement", "case", "design", "slack", "state", worth), rows=rows)


def tolerance_table(found: Design) -> an.Table:
    """The tolerances: keys, tolerance, change of the objective, cost, requirements that it would break."""
    rows: Rows = []
    for one in found.trade.tolerances if found.trade is not None else ():
        broken = ", ".join(
            f"{found.problem.requirements[k].name} by {number(_beyond(found, one.changes, k))}" for k in one.exceeds
        )
        rows.append((one.name, one.text, number(one.objective), number(one.cost), broken or "none"))
    unit = found.problem.unit or "1"
    return an.Table(heads=("keys", "tolerance", f"objective changes by, {unit}", f"cost, {unit}", "breaks"), rows=rows)


def _beyond(found: Design, changes: np.ndarray, k: int) -> float:
    assert found.trade is not None
    return float(changes[k] - max(found.trade.slacks[k], 0.0))


def end_table(found: Design) -> an.Table:
    """The searches: choices, objective, whether all requirements are met, message."""
    rows: Rows = []
    for k, one in enumerate(found.ends):
        met = one.result.sound and all(
            r.short(v) <= 0.0 for r, v in zip(found.problem.requirements, one.result.values, strict=True)
        )
        rows.append(
            (
                str(k + 1),
                _choices(found, one),
                number(one.result.objective),
                "yes" if met else "no",
                one.result.reason or one.message,
            )
        )
    level = an.EVERYWHERE if len(rows) > 1 else an.PAGE
    return an.Table(heads=("search", "choices", "objective", "requirements met", "ended with"), rows=rows, level=level)


def _choices(found: Design, one: Found) -> str:
    def text(variable: Variable, number: int) -> str:
        return f"{variable.name} = {variable.keys[0].choices[number]}"

    return ", ".join(text(v, n) for v, n in zip(found.problem.discrete, one.chosen, strict=True)) or "-"


def figure(found: Design) -> Figure:
    """Objective over the runs of the search, and the design between its bounds."""
    panels = []
    runs, values, met = (np.array(one) for one in zip(*found.history, strict=True))
    ok = met.astype(bool)
    lines = (
        [Line(x=runs[~ok], y=values[~ok], style="", marker=".", color=_MISSES, label="misses a requirement")]
        if np.any(~ok)
        else []
    )
    if np.any(ok):
        best = (np.maximum if found.problem.maximize else np.minimum).accumulate(values[ok])
        lines += [Line(x=runs[ok], y=values[ok], style="", marker=".", color=_MEETS, label="meets all requirements"),
                  Line(x=runs[ok], y=best, color=_MEETS, width=0.9, label="best so far")]  # fmt: skip
    log = bool(np.all(values > 0.0) and values.max() > 20.0 * values.min())
    panels.append(
        Panel(
            x_label="runs",
            y_label=f"objective, {found.problem.unit}" if found.problem.unit else "objective",
            lines=lines,
            log=log,
        )
    )
    if found.problem.continuous:
        bars, names = [], {}
        for row, (one, share) in enumerate(zip(found.problem.continuous, found.best.place, strict=True)):
            y = float(len(found.problem.continuous) - 1 - row)
            names[y] = short_name(one.name)
            bars.append(Line(x=np.array([0.0, 100.0]), y=np.array([y, y]), color="#bbbbbb", width=3.0))
            bars.append(
                Line(
                    x=np.array([100.0 * one.start]),
                    y=np.array([y]),
                    style="",
                    marker="|",
                    color=0,
                    label="case" if row == 0 else "",
                )
            )
            bars.append(
                Line(
                    x=np.array([100.0 * share]),
                    y=np.array([y]),
                    style="",
                    marker="o",
                    color=1,
                    label="design" if row == 0 else "",
                )
            )
        panels.append(Panel(x_label="way from the lower to the upper bound, %", y_label="", lines=bars, y_names=names))
    return Figure(
        name="design",
        title=f"Design: {found.problem.aim}",
        panels=panels,
        height=70.0 + 9.0 * len(found.problem.continuous),
    )


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """A design that a search ended with.

    Attributes
    ----------
    place : (variables with bounds,) float, shares of the ways between their bounds
    chosen : tuple of int, numbers of the choices
    result : DesignResult
    message : str, of the optimiser
    """

    place: Array
    chosen: tuple[int, ...]
    result: DesignResult
    message: str


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Design(Shown):
    """The outcome of a search.

    Attributes
    ----------
    problem : DesignProblem
    start : Found, the case as it is (its own choices, or the first ones)
    best : Found
    met : bool, whether the best design meets all requirements
    ends : tuple of Found, the end of every search
    trade : Trade or None, multipliers and costs of tolerances; None where a requirement is missed, and of choices alone
    history : list of (runs, objective, whether all requirements are met)
    runs : int
    exhausted : bool, whether the search ended since it had no runs left
    derivatives : str, how they were found, those of the discrete solution or differences; '' where none were
    finer : DesignResult, of the best design with finer integration of its runs: what differs is their error
    """

    problem: DesignProblem
    start: Found
    best: Found
    met: bool
    ends: tuple[Found, ...]
    trade: Trade | None
    history: Sequence[tuple[int, float, bool]]
    runs: int
    exhausted: bool
    derivatives: str
    finer: DesignResult

    named = "designs"
    endings = (".yaml",)

    @property
    def values(self) -> dict[str, Any]:
        """Key of the case -> its value in the best design."""
        return self.problem.overrides(self.best.place, self.best.chosen)

    @property
    def objective(self) -> float:
        """The best objective, in its unit."""
        return self.best.result.objective

    @property
    def content(self) -> dict[str, Any]:
        """The case with the best design, as a file holds it."""
        return cases.written(cases.load(self.problem.content, self.values))

    def answer(self) -> an.Answer:
        """The design, what it was sought for, its keys, requirements and tolerances, figure and file."""
        return answer_of(self)

    def missed(self) -> list[str]:
        """Requirements that the best design does not meet, with its values."""
        both = zip(self.problem.requirements, self.best.result.values, strict=True)
        return [f"{one.text} (it is {value:.6g})" for one, value in both if not one.short(value) <= 0.0]
