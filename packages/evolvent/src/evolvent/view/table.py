"""The table of any run: latches, events, what variables reach and when, balances, how it was run.

Rows of repeated parts that are equal are one row, and many that are not are one with the ranges of their numbers.
Zeros and round-off are named, and have no rows.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.results import display, happened, limits, variables
from evolvent.results.motion import prefixed_unit, quantity
from evolvent.view import balance
from evolvent.view.curves import NUMBERED, Peak, first_peak, largest_of, listed, peak_over_time
from evolvent.view.show import plots_of, round_off
from evolvent_base.figures import Number, Quantity
from evolvent_base.units import unit_text

#: Most times of events of one kind in a row, most rows that variables take, and most names in the row of zeros.
_EVENTS, _ROWS, _ZEROS = 4, 20, 8
#: Share of the largest value below which another is shown as 0.
_ROUND_OFF = 1e-7
#: Share of the largest number of a unit in a row within which rows are equal.
_SAME = 1e-4
#: Most different rows of repeated parts that are not joined to one with ranges.
_DIFFERENT = 4


@dataclasses.dataclass(frozen=True, kw_only=True)
class Row:
    """A row of one part.

    Attributes
    ----------
    part : str, '' for none
    rest : str, what follows the part's name in the label
    text : str
    numbers : its numbers
    sizes, sizes_text : the same of magnitudes, which parts round a ring share; without numbers where there is none
    event : str, what happened, of a row of events
    """

    part: str
    rest: str
    text: str
    numbers: tuple[Quantity, ...] = ()
    sizes: tuple[Quantity, ...] = ()
    sizes_text: str = ""
    event: str = ""

    @property
    def number(self) -> Number:
        """The row as it is shown."""
        return Number(label=self.part + self.rest, value=self.text, quantities=self.numbers)


# ------------------------------------------------------------------------------------------------ repeated parts


def joined(rows: Iterable[Row]) -> list[Number]:
    """Rows with those of repeated parts in one, at the place of the first.

    Rows of parts of which only a number in the name differs are joined where their numbers are equal but for round-off,
    or those of their magnitudes. Of those that remain, more than a few are joined to one row with the range of each
    number.
    """
    repeated: dict[Any, list[Row]] = {}
    for row in rows:
        match = NUMBERED.fullmatch(row.part)
        words = tuple((one.unit, one.what) for one in row.numbers)
        kind = row.event or words or row.text
        key: Any = (match[1], match[3], row.rest, kind) if match else id(row)
        repeated.setdefault(key, []).append(row)
    found: list[Number] = []
    for own in repeated.values():
        groups: list[list[Row]] = []
        for row in own:
            same = next((group for group in groups if _equal(group[0].numbers, row.numbers)), None)
            same = same or next((group for group in groups if row.sizes and _equal(group[0].sizes, row.sizes)), None)
            if same is None:
                groups.append([row])
            else:
                same.append(row)
        found += [_ranges(own)] if len(groups) > _DIFFERENT and own[0].numbers else [_one(group) for group in groups]
    return found


def _equal(a: Sequence[Quantity], b: Sequence[Quantity]) -> bool:
    """Whether two rows have the same numbers, but for a share of the largest of each unit."""
    if [one[1:] for one in a] != [one[1:] for one in b]:
        return False
    largest: dict[str, float] = {}
    for one in (*a, *b):
        largest[one.unit] = max(largest.get(one.unit, 0.0), abs(one.value))
    return all(abs(x.value - y.value) <= _SAME * largest[x.unit] for x, y in zip(a, b, strict=True))


def _one(group: Sequence[Row]) -> Number:
    """One row for equal ones: the first one's numbers, or magnitudes where these alone are equal."""
    first = group[0]
    if len(group) == 1:
        return first.number
    label = listed([row.part for row in group]) + first.rest
    if all(_equal(first.numbers, row.numbers) for row in group):
        return Number(label=label, value=first.text, quantities=first.numbers)
    return Number(label=label, value=first.sizes_text, quantities=first.sizes)


def _ranges(rows: Sequence[Row]) -> Number:
    """One row for different ones: the range of each number, and whose is the largest; of events, of all times."""
    texts, numbers = list[str](), list[Quantity]()
    label = listed([row.part for row in rows]) + rows[0].rest
    if event := rows[0].event:
        times = [one.value for row in rows for one in row.numbers]
        first, last = min(times), max(times)
        numbers = [Quantity(first, "s", f"{event} first"), Quantity(last, "s", f"{event} last")]
        return Number(label=label, value=f"at {first:.5g} to {last:.5g} s", quantities=tuple(numbers))
    own = [row.sizes or row.numbers for row in rows]
    for k, one in enumerate(own[0]):
        values = np.array([each[k].value for each in own])
        unit = "" if one.unit == "1" else one.unit
        low, high = float(values.min()), float(values.max())
        text = " to ".join(dict.fromkeys(quantity(value, unit) for value in (low, high)))
        whose = f" ({rows[int(np.argmax(np.abs(values)))].part})" if one.what.startswith("largest") else ""
        texts.append(f"{one.what} {text}{whose}".strip())
        numbers += [Quantity(low, one.unit, f"least {one.what}".strip()), Quantity(high, one.unit, f"most {one.what}")]
    return Number(label=label, value=", ".join(texts), quantities=tuple(numbers))


# ------------------------------------------------------------------------------------------------ rows


def event_rows(run: xr.DataTree) -> list[Row]:
    """When events of parts happened other than latches, the first ones of many."""
    found: dict[tuple[str, str], list[float]] = {}
    events = happened.events_of(run)
    for time, part, what in zip(events.time.values, events.part.values, events.what.values, strict=True):
        if what != happened.LATCHED:
            found.setdefault((str(part), str(what)), []).append(float(time))
    rows = []
    for (part, what), times in found.items():
        more = f", and {len(times) - _EVENTS} more" if len(times) > _EVENTS else ""
        text = f"at {', '.join(f'{time:.5g}' for time in times[:_EVENTS])} s{more}"
        numbers = tuple(Quantity(time, "s", f"{what} {k}".strip()) for k, time in enumerate(times[:_EVENTS], 1))
        rest = "" if what == happened.EVENT else f", {what}"
        rows.append(Row(part=part or what, rest=rest, text=text, numbers=numbers, event=what))
    return rows


def latch_rows(run: xr.DataTree) -> list[Row]:
    """When each latch locked, how fast the joint moved, and the latch's largest force or torque.

    In order of time, those that have not locked first.
    """
    found: list[tuple[float, Row]] = []
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        if "latch_rate" not in group:
            continue
        time = float(group["latch_time"].values.flat[-1])
        if not np.isfinite(time):
            found.append((-np.inf, Row(part=part, rest=", latch", text="has not locked")))
            continue
        peak = next(name for name in ("latch_torque_peak", "latch_force_peak") if name in group)
        kind = peak.split("_")[1]
        shown = display.shown(group["latch_rate"])
        largest, rate = float(group[peak].values.flat[-1]), abs(float(shown.values.flat[-1]))
        force, speed = (unit_text(str(one.attrs["units"])) for one in (group[peak], shown))
        text = f"locks at {quantity(time, 's')} with a rate of {quantity(rate, speed)}, largest {kind} "
        numbers = (
            Quantity(time, "s", "time"),
            Quantity(rate, speed, "rate"),
            Quantity(largest, force, f"largest {kind}"),
        )
        finite = tuple(one for one in numbers if math.isfinite(one.value))
        found.append((time, Row(part=part, rest=", latch", text=text + quantity(largest, force), numbers=finite)))
    return [row for _, row in sorted(found, key=lambda one: one[0])]


def variable_rows(run: xr.DataTree, without: Collection[str] = ()) -> tuple[list[list[Row]], list[Row]]:
    """What the variables of the default figures reach, part by part, and rows of those that are zero or round-off.

    Parameters
    ----------
    without : names of variables that are not listed
    """
    root = variables.root_dataset(run)
    times = root["time"].values if "time" in root else np.zeros(1)
    least, found, nothing = round_off(run), [], []
    for part in variables.parts(run):
        group, own = variables.group_of(run, part), []
        words: dict[str, str] = json.loads(group.attrs.get("one_sided", "{}"))
        for name in plots_of(run, part):
            if name not in group.data_vars or f"{part}.{name}" in without:
                continue
            size = size_of(group[name])
            if size <= least.get(str(group[name].attrs.get("units", "")), 0.0):
                nothing.append(Row(part=part, rest=f".{name}", text="0"))
            elif name in words and len(times) > 1:
                own.append(_pulls(run, part, name, times, words[name]))
            else:
                own.append(_reached(run, part, name, times))
        found.append(own)
    return found, nothing


def numbers(run: xr.DataTree, *, without: Collection[str] = ()) -> list[Number]:
    """Rows of the table.

    Parameters
    ----------
    without : names of variables that are not listed
    """
    of_parts, nothing = variable_rows(run, without)
    found = limits.numbers(run) + joined(latch_rows(run)) + joined(event_rows(run))
    rows = joined(row for own in of_parts for row in own)
    ranks = {row.rest: rank for own in reversed(of_parts) for rank, row in enumerate(own)}
    order = sorted(range(len(rows)), key=lambda k: ranks[rows[k].label[rows[k].label.rfind(".") :]])
    shown = set(order[:_ROWS])  # of each part the first ones
    found += [number for k, number in enumerate(rows) if k in shown]
    if len(rows) > len(shown):
        found.append(Number(label="more variables", value=f"{len(rows) - len(shown)}; `evolvent info` lists them all"))
    if nothing:
        names = [number.label for number in joined(nothing)]
        more = f", and {len(names) - _ZEROS} more" if len(names) > _ZEROS else ""
        found.append(Number(label="zero throughout", value=", ".join(names[:_ZEROS]) + more))
    if run.sizes.get("time", 1) > 1:
        found += balance.balance_numbers(run)
    reason = run.attrs.get("method_reason", "")
    if reason and reason != "as asked for":
        found.append(Number(label="method", value=f"{run.attrs['method']}: {reason}"))
    return found + results.closing_numbers(variables.root_dataset(run))


def size_of(found: xr.DataArray) -> float:
    """Largest magnitude of a variable, of its samples and of all steps."""
    extremes = variables.extremes_of(found)
    return max(largest_of(found.values), 0.0 if extremes is None else largest_of(extremes))


def _shown(run: xr.DataTree, name: str) -> tuple[xr.DataArray, np.ndarray, str, float]:
    """A variable in the unit in which it is shown, its values over time in columns, that unit, and the largest one."""
    found = display.shown(variables.get(run, name))
    return found, variables.values(found), unit_text(str(found.attrs.get("units", ""))), size_of(found)


def _pulls(run: xr.DataTree, part: str, name: str, times: np.ndarray, word: str) -> Row:
    """Mean and largest value of what acts one way, such as a tension, and for what share of the time it is zero."""
    found, columns, unit, size = _shown(run, f"{part}.{name}")
    values = np.nan_to_num(columns[:, 0])
    peak = peak_over_time(values, variables.extremes_of(found))
    span = float(np.ptp(times))
    mean = float(np.trapezoid(values, times)) / span
    none = np.abs(values) <= 1e-6 * size
    share = float(np.sum(np.diff(times)[none[1:] & none[:-1]])) / span
    factor, prefixed = prefixed_unit(size, unit)
    text = f"mean {mean / factor:.4g} {prefixed}, largest {peak.value / factor:.5g} {prefixed}{_at(times, peak)}"
    text += f", {word} in {100.0 * share:.3g} % of the time" if share > 0.0 else ""
    numbers = [(mean, unit, "mean"), (peak.value, unit, "largest")]
    numbers += [(times[peak.k], "s", _when(peak.between))] if peak.near else []
    numbers += [(100.0 * share, "%", f"share of the time in which it is {word}")]
    return Row(part=part, rest=f".{name}", text=text, numbers=tuple(Quantity(float(x), *rest) for x, *rest in numbers))


def _reached(run: xr.DataTree, part: str, name: str, times: np.ndarray) -> Row:
    """Last and largest value of a variable, with its unit and time; of a vector, its components at the end."""
    found, columns, unit, size = _shown(run, f"{part}.{name}")
    finite = columns[np.isfinite(columns)]
    if not finite.size:
        return Row(part=part, rest=f".{name}", text="none")
    plain = unit or "1"
    factor, unit = prefixed_unit(size, "" if unit == "1" else unit)
    columns = np.where(np.abs(columns) < _ROUND_OFF * size, 0.0, columns) / factor + 0.0  # without a zero's sign
    finite, unit = columns[np.isfinite(columns)], f" {unit}" if unit else ""

    def row(text: str, *own: Quantity, sizes: tuple[Quantity, ...] = (), sizes_text: str = "") -> Row:
        kept = tuple(one for one in own if math.isfinite(one.value))
        return Row(part=part, rest=f".{name}", text=text, numbers=kept, sizes=sizes, sizes_text=sizes_text)

    def of(value: float, what: str) -> Quantity:
        return Quantity(float(factor * value), plain, what)

    if found.ndim == 1:
        text = f"{columns[-1, 0]:.5g}{unit}"
        if len(columns) == 1:
            return row(text, of(columns[-1, 0], ""))
        extremes = variables.extremes_of(found)
        peak = peak_over_time(columns[:, 0], None if extremes is None else extremes / factor)
        largest = "largest of the samples" if _is_missed(run, part, name) else "largest"
        text += f" at the end, {largest} {peak.value:.5g}{unit}{_at(times, peak)}"
        when = Quantity(float(times[peak.k]), "s", _when(peak.between or largest != "largest"))
        return row(text, of(columns[-1, 0], "at the end"), of(peak.value, largest), *([when] if peak.near else []))
    if columns.shape[1] > 4:
        low, high = finite.min(), finite.max()
        return row(f"from {low:.5g} to {high:.5g}{unit}", of(low, "least"), of(high, "largest"))
    end = ", ".join(f"{v:.5g}" for v in columns[-1])
    at_end = f"({end}){unit}" if columns[-1].any() else f"0{unit}"
    letters = next((x for d, x in (("axis", "xyz"), ("quaternion", "wxyz")) if d in found.dims), "")
    letters = letters if len(letters) == columns.shape[1] else "1234"[: columns.shape[1]]
    if len(columns) == 1:
        return row(f"({end}){unit}", *(of(v, letter) for v, letter in zip(columns[-1], letters, strict=True)))
    sizes = np.linalg.norm(columns, axis=1)
    k = first_peak(sizes)
    largest = f"largest magnitude {sizes[k]:.5g}{unit}{_at(times, Peak(k, sizes[k], between=False, near=True))}"
    both = of(sizes[k], "largest magnitude"), Quantity(float(times[k]), "s", "time of the largest magnitude")
    return row(
        f"{at_end} at the end, {largest}",
        *(of(v, f"{letter} at the end") for v, letter in zip(columns[-1], letters, strict=True)), *both,
        sizes=(of(sizes[-1], "magnitude at the end"), *both) if np.isfinite(sizes[-1]) else (),
        sizes_text=f"magnitude {sizes[-1]:.5g}{unit} at the end, {largest}",
    )  # fmt: skip


def _is_missed(run: xr.DataTree, part: str, name: str) -> bool:
    """Whether a variable has no known extremes, while samples of other variables of the part miss theirs."""
    group = variables.group_of(run, part)
    if variables.extremes_of(group[name]) is not None:
        return False
    noted = ((one, variables.extremes_of(one)) for one in group.data_vars.values() if one.dims == ("time",))
    known = ((one.values, over) for one, over in noted if over is not None and np.any(np.isfinite(one.values)))
    return any(peak_over_time(np.nan_to_num(own), over).between for own, over in known)


def _when(between: bool) -> str:
    """Label of the time of the largest value."""
    return "time of the largest of the samples" if between else "time of the largest"


def _at(times: np.ndarray, peak: Peak) -> str:
    """Time of a largest value, or of the nearest sample; '' at the start and the end, which the table shows."""
    shown = peak.near and (peak.between or 0 < peak.k < len(times) - 1)
    return f" {peak.when} {times[peak.k]:.4g} s" if shown else ""
