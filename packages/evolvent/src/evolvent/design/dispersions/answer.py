"""A dispersion as an answer: bounds, sensitivities, quantiles, failures, figures and files."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.design.dispersions import order, sensitivity
from evolvent.results.kept import stored_name
from evolvent_base import answer as an
from evolvent_base.errors import InputError, counted, visible
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown
from evolvent_base.units import unit_text

Array = np.ndarray
#: Most failed runs that are listed.
_MOST_FAILURES = 50
#: Letters of a name on an axis of the tornado.
_NAME = 40


def number(value: float, unit: str = "") -> str:
    """A number of five digits, with its unit; a dash where there is none."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "above all" if value > 0 else "below all"
    return f"{value:.5g} {unit}" if unit else f"{value:.5g}"


def answer_of(found: Dispersion) -> an.Answer:
    """What the runs say."""
    bounds = an.Section(title="Results", blocks=[_summary(found), *sentences(found)])
    draws = [
        (d.name, d.text, *(number(float(of(d.values)), unit_text(d.unit)) for of in (np.mean, np.std)))
        for d in found.draws
    ]
    drawn = ("key", "distribution", "mean, drawn", "standard deviation, drawn")
    again = an.Remark("Saved as a file, this study can be run again: evolvent disperse study.yaml.")
    return an.Answer(
        title=f"Dispersion {found.name}",
        warnings=an.failed(one.reason for one in found.failures),
        sections=[
            *_limits(found),
            bounds,
            an.Section(title="Keys that vary", blocks=[an.Table(heads=drawn, rows=draws, words=2)], level=an.PAGE),
            *_failures(found),
            *(_section(found, one) for one in found.outputs),
            an.Section(title="Study", blocks=[again, an.Listing(found.dataset.attrs["study"])], level=an.PAGE),
        ],
        files={"dispersion.csv": lambda: an.as_csv(runs(found)), "dispersion.nc": lambda: _netcdf(found)},
        made=results.made_with(),
    )  # fmt: skip


def _limits(found: Dispersion) -> list[an.Section]:
    """The share of the runs that meets each limit of the case."""
    rows = [(one.text, f"{100.0 * one.share:.4g} %", f"{one.count} of {found.count}") for one in found.limits]
    table = an.Table(heads=("limit", "met in", "runs"), rows=rows)
    missed = [one.text for one in found.limits if one.count < found.count]
    kind = "warning" if missed else "good"
    text = f"Missed in some runs: {'; '.join(missed)}." if missed else "All runs meet all limits."
    return [an.Section(title="Limits", blocks=[table]), an.Section(title="", blocks=[text], kind=kind)] if rows else []


def _failures(found: Dispersion) -> list[an.Section]:
    """The runs that failed."""
    rows = [
        (str(f.case), f.reason, ", ".join(f"{key} = {_short(value)}" for key, value in f.keys.items()))
        for f in found.failures
    ]
    left = [f"and {len(rows) - _MOST_FAILURES} more"] if len(rows) > _MOST_FAILURES else []
    table = an.Table(heads=("case", "reason", "keys"), rows=rows[:_MOST_FAILURES], words=3, most=3)
    title = f"{counted(len(rows), 'run')} failed"
    return [an.Section(title=title, blocks=[table, *left])] if rows else []


def _section(found: Dispersion, one: Output) -> an.Section:
    """Figures, sensitivities, quantiles and extremes of a result."""
    rows, about = sensitivities(found, one)
    title = f"Quantiles, with intervals of {100 * found.confidence:.6g} %"
    quantiles = [(f"{100 * q.probability:.6g} %", *map(number, (q.value, q.low, q.high))) for q in one.quantiles]
    unit = f", {one.unit}" if one.unit else ""
    tables = [
        an.Table(heads=sensitivity_heads(one), rows=rows),
        an.Table(heads=("probability", *(f"{word}{unit}" for word in ("quantile", "from", "to"))), rows=quantiles,
                 title=title, level=an.PAGE),
        an.Table(heads=("", "keys", "case", f"value{unit}"), rows=worst(found, one), title="Extremes", words=2,
                 level=an.EVERYWHERE if found.sample == "corners" else an.PAGE),
    ]  # fmt: skip
    return an.Section(title=_named(one), blocks=[one.text, *figures(found, one), about, *tables])


def _summary(found: Dispersion) -> an.Table:
    """Results: name with unit, mean, standard deviation, smallest, largest, lower and upper bound."""
    heads = ("result", "mean", "std", "smallest", "largest", f"{found.statement} lower", f"{found.statement} upper")
    rows = []
    for one in found.outputs:
        m = one.moments
        row = [_named(one), *(number(m[key]) for key in ("mean", "std", "least", "largest"))]
        rows.append((*row, number(one.lower.value), number(one.upper.value)))
    return an.Table(heads=heads, rows=rows)


def sentences(found: Dispersion) -> list[str]:
    """What the runs are, what they do not give, and why."""
    ways = {
        "monte-carlo": "plain random", "latin-hypercube": "a Latin hypercube", "sobol": "a scrambled Sobol sequence",
        "saltelli": "samples by Saltelli", "corners": "all corners",
    }  # fmt: skip
    lines = [f"{found.count} runs, {ways[found.sample]} over {len(found.draws)} draw{'s' * (len(found.draws) != 1)}"]
    lines += list(found.notes)
    for why in dict.fromkeys(b.why for one in found.outputs for b in (one.upper, one.lower) if b.why):
        lines.append(f"no {found.statement} bound: {why}")
    ranks = {(b.rank, b.confidence) for one in found.outputs for b in (one.upper, one.lower) if b.rank}
    for rank, reached in sorted(ranks):
        which = "the extreme value" if rank == 1 else f"the {_ordinal(rank)} most extreme value"
        lines.append(
            f"each {found.statement} bound is {which}: one-sided, of any distribution, with a confidence of "
            f"{100 * reached:.4g} % that {100 * found.coverage:.6g} % of all runs lie within it"
        )
    return lines


def _ordinal(k: int) -> str:
    ending = "th" if 10 <= k % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(k % 10, "th")
    return f"{k}{ending}"


def sensitivities(found: Dispersion, one: Output) -> tuple[list[tuple[str, ...]], str]:
    """Rows of the keys of a result, the strongest first, and a sentence on what they rest on."""
    rows: list[tuple[str, ...]] = []
    if one.indices is not None:
        s = one.indices
        if s.why:
            return [], f"no indices: {s.why}"
        rows = [
            (
                draw.name,
                f"{s.first[k]:.3f}", f"{s.first_low[k]:.3f} to {s.first_high[k]:.3f}",
                f"{s.total[k]:.3f}", f"{s.total_low[k]:.3f} to {s.total_high[k]:.3f}",
            )
            for k, draw in _ranked(found, s.total)
        ]  # fmt: skip
        left = f", {s.left_out} rows left out for lack of a value" if s.left_out else ""
        return (
            rows,
            f"indices of Sobol from {s.rows} rows{left}; intervals of {100 * found.confidence:.6g} % by bootstrap",
        )
    r = one.regression
    if r.why:
        return [], f"no sensitivities: {r.why}"
    for k, draw in _ranked(found, np.abs(r.coefficients)):
        interval = "-" if found.sample == "corners" else f"{r.low[k]:+.3f} to {r.high[k]:+.3f}"
        rows.append((draw.name, f"{r.coefficients[k]:+.3f}", interval))
    text = f"linear regression on {r.runs} runs, R2 = {r.r2:.4f}"
    if r.r2 < 0.9:
        text += "; what is left is not linear: sample: saltelli gives the indices of Sobol"
    return rows, text


def _ranked(found: Dispersion, strength: Any) -> list[tuple[int, Any]]:
    places = np.argsort(-np.nan_to_num(strength), kind="stable")
    return [(int(k), found.draws[int(k)]) for k in places]


def sensitivity_heads(one: Output) -> tuple[str, ...]:
    """Heads of the columns of `sensitivities`."""
    if one.indices is not None:
        return ("key", "first order", "interval", "total", "interval")
    return ("key", "standardised coefficient", "interval")


def worst(found: Dispersion, one: Output) -> list[tuple[str, ...]]:
    """Rows of the smallest and the largest value: its keys, case and value."""
    rows: list[tuple[str, ...]] = []
    for which, case in zip(("smallest", "largest"), one.extremes, strict=True):
        if case >= 0:
            keys = ", ".join(f"{d.name} = {d.values[case]:.5g}{f' {d.unit}' if d.unit else ''}" for d in found.draws)
            rows.append((which, keys, str(case), number(float(one.values[case]))))
    return rows


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _named(one: Output) -> str:
    return f"{one.name} [{one.unit}]" if one.unit else one.name


# ------------------------------------------------------------------------------------------------ figures


def figures(found: Dispersion, one: Output) -> Iterable[Figure]:
    """A histogram with bounds, and a chart of sensitivities, of a result."""
    own = stored_name(one.name).strip("_")
    if one.finite.size > 1 and np.ptp(one.finite) > 0.0 and found.sample != "corners":
        yield _histogram(found, one, f"{own}-histogram")
    if not (one.indices.why if one.indices is not None else one.regression.why):
        yield _tornado(found, one, f"{own}-sensitivity")


def _histogram(found: Dispersion, one: Output, name: str) -> Figure:
    counts, edges = np.histogram(one.finite, bins=np.histogram_bin_edges(one.finite, bins=_bins(one.finite)))
    x = np.repeat(edges, 2)
    y = np.concatenate([[0.0], np.repeat(counts.astype(float), 2), [0.0]])
    lines = [Line(x=x, y=y, color=1, fill="#9ecae1", label=f"{one.finite.size} runs")]
    top = 1.05 * float(counts.max())
    for bound, label in ((one.lower, "lower"), (one.upper, "upper")):
        if bound.rank:
            at = np.array([bound.value, bound.value])
            lines.append(
                Line(
                    x=at,
                    y=np.array([0.0, top]),
                    color=2 if label == "upper" else 3,
                    label=f"{found.statement} {label} bound",
                )
            )
    median = next((q.value for q in one.quantiles if q.probability == 0.5), math.nan)
    if math.isfinite(median):
        lines.append(Line(x=np.array([median, median]), y=np.array([0.0, top]), color=0, style=":", label="median"))
    x_label = f"{one.name}, {one.unit}" if one.unit else one.name
    panel = Panel(x_label=x_label, y_label="runs", lines=lines, y_zero=True)
    lacking = f"; {one.lacking} runs have no value" if one.lacking else ""
    return Figure(name=name, title=f"{one.text}, dispersed{lacking}", panels=[panel], height=80.0)


def _bins(values: Any) -> int:
    """Number of bins by Freedman and Diaconis, from 5 to 60."""
    quartiles = np.quantile(values, [0.25, 0.75])
    width = 2.0 * float(quartiles[1] - quartiles[0]) / np.cbrt(values.size)
    return 10 if width <= 0.0 else int(np.clip(np.ceil(np.ptp(values) / width), 5, 60))


def _tornado(found: Dispersion, one: Output, name: str) -> Figure:
    """Bars of the sensitivities with their intervals, the strongest on top."""
    if one.indices is not None:
        s = one.indices
        sets = [(s.total, s.total_low, s.total_high, "total index", "#9ecae1"),
                (s.first, s.first_low, s.first_high, "first-order index", "#fdae6b")]  # fmt: skip
        label, strength = "index of Sobol", s.total
    else:
        r = one.regression
        sets = [(r.coefficients, r.low, r.high, "standardised coefficient", "#9ecae1")]
        label, strength = "standardised regression coefficient", np.abs(r.coefficients)
    ranked = [k for k, _ in _ranked(found, strength)]
    lines, names = [], {}
    size = 0.7 / len(sets)
    for row, k in enumerate(ranked):
        at = float(len(ranked) - 1 - row)
        names[at] = short_name(found.draws[k].name)
        for which, (values, low, high, text_, colour) in enumerate(sets):
            y0 = at + 0.35 - which * size
            box = np.array([0.0, values[k], values[k], 0.0, 0.0])
            lines.append(Line(x=box, y=np.array([y0, y0, y0 - size, y0 - size, y0]), color=1, width=0.8, fill=colour,
                              label=text_ if row == 0 else ""))  # fmt: skip
            if found.sample != "corners":
                middle = y0 - 0.5 * size
                lines.append(Line(x=np.array([low[k], high[k]]), y=np.array([middle, middle]), color=0, marker="|",
                                  label="interval" if row == 0 and which == 0 else ""))  # fmt: skip
    panel = Panel(x_label=label, y_label="", lines=lines, y_names=names)
    explained = "" if one.indices is not None else f", R2 = {one.regression.r2:.3f}"
    height = 30.0 + 9.0 * len(ranked) * (1 + 0.3 * (len(sets) - 1))
    return Figure(name=name, title=f"Sensitivity of {one.name}{explained}", panels=[panel], height=max(height, 50.0))


def short_name(name: str) -> str:
    """Keys of parts in at most so many letters as an axis holds."""
    name = name.replace("parts.", "")
    return name if len(name) <= _NAME else f"{name[: _NAME - 3]}..."


# ------------------------------------------------------------------------------------------------ files


def runs(found: Dispersion) -> list[list[Any]]:
    """A row for every run, below one of heads: case, status, reason, keys and results with their units."""
    dataset = found.dataset
    keys = json.loads(dataset.attrs["keys"])
    units = [dataset[key].attrs.get("units", "1") for key in keys]
    head = [f"{key} [{unit}]" if unit != "1" else key for key, unit in zip(keys, units, strict=True)]
    rows: list[list[Any]] = [[visible(one) for one in ("case", "status", "reason", *head, *map(_named, found.outputs))]]
    columns = [dataset[key].values for key in keys] + [one.values for one in found.outputs]
    for k in range(found.count):
        cells = [column[k].item() for column in columns]
        numbers = [repr(cell) if isinstance(cell, float) else visible(str(cell)) for cell in cells]
        reason = visible(str(dataset["reason"].values[k]))
        rows.append([k, dataset["status"].values[k], reason, *numbers])
    return rows


def _netcdf(found: Dispersion) -> memoryview:
    """All runs as NetCDF, with the bounds of every result as attributes of its variable."""
    dataset = found.dataset.copy()
    dataset = dataset.reset_coords([c for c in dataset.coords if c not in dataset.dims])  # no blanks in lists of names
    stated = {}
    for one in found.outputs:
        own = {**one.moments, "lower": one.lower.value, "upper": one.upper.value, "confidence": one.upper.confidence}
        stated[one.name] = {**own, "lacking": one.lacking}
    dataset.attrs = {**dataset.attrs, "coverage": found.coverage, "confidence": found.confidence}
    dataset.attrs["dispersion"] = json.dumps(an.plain(stated))
    return results.image(dataset)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Draw:
    """A draw: the keys that follow it, its distribution as the study states it, and values of its first key.

    Attributes
    ----------
    keys : tuple of str
    text : str
    unit : str, SI, of the first key
    values : (n,) float, of the first key; NaN where it takes no numbers
    """

    keys: tuple[str, ...]
    text: str
    unit: str
    values: Array

    @property
    def name(self) -> str:
        """The keys in one text."""
        return ", ".join(self.keys)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Failure:
    """A run that failed: its case, why, and the values of its keys."""

    case: int
    reason: str
    keys: Mapping[str, Any]


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Output:
    """One result over all runs.

    Attributes
    ----------
    name : str, as the study asks for it, with its entry where a variable has several
    text : str, what it is
    unit : str
    values : (n,) float, of all runs; NaN of a run that failed or has no value
    seen : (k,) bool, the runs that bounds, moments and quantiles rest on: all, of a sample by Saltelli the first two
        samples
    moments : mapping: mean, std, least, largest
    upper, lower : order.Bound
    quantiles : list of order.Quantile
    regression : sensitivity.Regression
    indices : sensitivity.Indices or None
    """

    name: str
    text: str
    unit: str
    values: Array
    seen: Array
    moments: Mapping[str, float]
    upper: order.Bound
    lower: order.Bound
    quantiles: list[order.Quantile]
    regression: sensitivity.Regression
    indices: sensitivity.Indices | None

    @property
    def finite(self) -> Array:
        """Values that bounds and moments rest on."""
        own = self.values[self.seen]
        return own[np.isfinite(own)]

    @property
    def lacking(self) -> int:
        """Number of runs without a value among those that bounds rest on."""
        return int(np.sum(~np.isfinite(self.values[self.seen])))

    @property
    def extremes(self) -> tuple[int, int]:
        """Cases with the smallest and the largest value; -1 where none has one."""
        if not np.isfinite(self.values).any():
            return -1, -1
        return int(np.nanargmin(self.values)), int(np.nanargmax(self.values))


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Met:
    """How many runs meet a limit of the case, and their share of all."""

    text: str
    count: int
    share: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Dispersion(Shown):
    """An evaluated study.

    Attributes
    ----------
    dataset : xarray.Dataset, of `evolvent.sweep`
    name, sample : str, of the study
    count : int, runs
    coverage, confidence : float, of the bounds
    draws : tuple of Draw
    outputs : tuple of Output
    failures : tuple of Failure
    notes : tuple of str, what a reader must know
    limits : tuple of Met, of the limits of the case
    """

    dataset: xr.Dataset
    name: str
    sample: str
    count: int
    coverage: float
    confidence: float
    draws: tuple[Draw, ...]
    outputs: tuple[Output, ...]
    failures: tuple[Failure, ...]
    notes: tuple[str, ...]
    limits: tuple[Met, ...] = ()

    named = "results"
    endings = (".csv", ".nc")

    def __getitem__(self, name: str) -> Output:
        """The result of a name."""
        for one in self.outputs:
            if one.name == name:
                return one
        raise InputError(f"no result is called {name!r}; known: {', '.join(one.name for one in self.outputs)}")

    @property
    def statement(self) -> str:
        """Coverage and confidence in short: "95/95"."""
        return f"{100 * self.coverage:.6g}/{100 * self.confidence:.6g}"

    def answer(self) -> an.Answer:
        """Bounds of the results, what the runs are, sensitivities, failures, figures and files."""
        return answer_of(self)
