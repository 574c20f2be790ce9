"""Tables of runs beside one another: what differs between their cases, and their results with differences and units."""

from __future__ import annotations

from collections.abc import Sequence

from evolvent import cases
from evolvent.results.motion import prefixed_unit
from evolvent_base.figures import Number, Quantity
from evolvent_base.units import unit_text
from evolvent_studio.changes import flat, full, written
from evolvent_studio.differences import difference
from evolvent_studio.form import text_of

#: Size beside the largest number of a result, below which a number is round-off.
_ROUND_OFF = 1e-9


def less(names: Sequence[str]) -> str:
    """What the last column but one holds, in words."""
    return f"{names[1]} less {names[0]}" if len(names) == 2 else "largest less least"


def differing(texts: Sequence[str]) -> list[list[str]]:
    """Keys of cases whose values are not the same: the key, each value as it was written, the difference, its unit.

    Parameters
    ----------
    texts : the cases as YAML
    """
    contents = [cases.parse_yaml(text, "the run's case") for text in texts]
    values = [flat(full(content)) for content in contents]
    rows: dict[str, list[str]] = {}
    for key in dict.fromkeys(key for one in values for key in one):
        if all(key in one and one[key] == values[0].get(key) for one in values):
            continue
        found = [
            written(content, key, one[key]) if key in one else (key, "-")
            for content, one in zip(contents, values, strict=True)
        ]
        place = min((at for at, _ in found), key=len)
        rows[place] = [text_of(value) for _, value in found]
    return [[key, *own, difference(own), ""] for key, own in rows.items()] or [
        ["nothing", *("" for _ in texts), "", ""]
    ]


def results(runs: Sequence[Sequence[Number]]) -> list[list[str]]:
    """Results of runs, a row a number: what it is, its value in each run, the difference and the unit of all of them.

    Of three or more runs the difference is the spread. Results of runs that say different things, and those without
    numbers, are one row with their texts. Components that are nothing but round-off in every run have no row.
    """
    every = [{number.label: number for number in one if number.label != "warning"} for one in runs]
    rows: list[list[str]] = []
    for label in dict.fromkeys(label for one in every for label in one):
        found = [one.get(label) for one in every]
        quantities = [one.quantities for one in found if one is not None]
        alike = {tuple((own.unit, own.what) for own in one) for one in quantities}
        if len(quantities) < len(found) or len(alike) > 1 or not quantities[0]:
            texts = ["-" if one is None else one.value for one in found]
            rows.append([label, *texts, difference(texts), ""])
            continue
        largest: dict[str, float] = {}
        for own in (own for one in quantities for own in one):
            largest[own.unit] = max(largest.get(own.unit, 0.0), abs(own.value))
        columns = [list(column) for column in zip(*quantities, strict=True)]
        kept = [
            column for column in columns
            if len(columns) == 1 or any(abs(own.value) > _ROUND_OFF * largest[own.unit] for own in column)
        ]  # fmt: skip
        for column in kept or columns[:1]:
            rows.append(_row(label, column))
    return rows


def _row(label: str, column: Sequence[Quantity]) -> list[str]:
    """One number of a result of all runs."""
    values, unit, what = [own.value for own in column], unit_text(column[0].unit), column[0].what
    size = max(map(abs, values))
    factor, shown = prefixed_unit(size, "" if unit == "1" else unit)
    spread = values[1] - values[0] if len(values) == 2 else max(values) - min(values)
    sign = "+" if len(values) == 2 and spread else ""
    text = f"{spread / factor:{sign}.4g}" if abs(spread) > 1e-12 * size else "0"
    name = f"{label} {what}" if what.startswith("at the") else f"{label}, {what}" if what else label
    return [name, *(f"{value / factor + 0.0:.5g}" for value in values), text, shown]
