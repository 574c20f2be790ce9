"""Tables in a field of a form: rows that were pasted from a spreadsheet, and the curve that they are."""

from __future__ import annotations

import re
from collections.abc import Sequence

from nicegui import ui

from evolvent import cases
from evolvent_base import units
from evolvent_base.errors import InputError

#: A number, and what may stand behind it.
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*)", re.I | re.S)
#: Unit in the head of a column: "time (ms)", "torque [N m]", "angle, deg".
_UNIT = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$|,\s*([^,]+?)\s*$")
#: Rows that are written below one another, at most; points of a curve, at most; its size, px.
_BELOW, _POINTS = 12, 2000
_WIDE, _HIGH = 320, 70


def pasted(text: str) -> str:
    r"""Rows of a spreadsheet as they are written in a case; '' of any other text.

    Columns stand apart by tabs, semicolons, commas or blanks; beside tabs and semicolons numbers may have a decimal
    comma. Units of a head go to the numbers below it.

    Examples
    --------
    >>> pasted("time (ms)\ttorque\n0\t0\n10\t0,5")
    '[[0 ms, 0],\n [10 ms, 0.5]]'
    """
    lines = [line.strip() for line in text.strip().splitlines() if line.strip()]
    if len(lines) < 2 or re.search(r"[\[\]{}:]", "".join(lines[1:])):
        return ""
    mark = next((one for one in ("\t", ";", ",") if all(one in line for line in lines)), None)
    rows = [[cell.strip().strip('"') for cell in (line.split(mark) if mark else line.split())] for line in lines]
    if mark in ("\t", ";"):
        rows = [[re.sub(r"^([-+]?\d*),(\d)", r"\1.\2", cell) for cell in row] for row in rows]
    behind = [""] * len(rows[0])
    if not any(_NUMBER.fullmatch(cell) for cell in rows[0]):
        behind = [next((f" {one}" for one in match.groups() if one), "") if (match := _UNIT.search(cell)) else ""
                  for cell in rows.pop(0)]  # fmt: skip
    whole = len(rows) > 0 and {len(row) for row in rows} == {len(behind)} and len(behind) > 1
    if not whole or not all(_NUMBER.fullmatch(cell) for row in rows for cell in row):
        return ""
    texts = [
        f"[{', '.join(cell if _unit(cell) else cell + unit for cell, unit in zip(row, behind, strict=True))}]"
        for row in rows
    ]
    return f"[{(',' + chr(10) + ' ').join(texts) if len(texts) <= _BELOW else ', '.join(texts)}]"


def _unit(cell: str) -> str:
    match = _NUMBER.fullmatch(cell)
    return match[2].strip() if match else ""


def curve(text: str) -> tuple[list[tuple[float, float]], tuple[str, str]]:
    """The first two columns of rows as points, and the units of both, those of the first rows that have some."""
    try:
        rows = cases.parse_yaml(text, "rows") if text.strip().startswith("[") else None
    except InputError:
        rows = None
    if not isinstance(rows, list) or len(rows) < 2:
        return [], ("", "")
    if not all(isinstance(row, list) and len(row) > 1 for row in rows):
        return [], ("", "")
    columns, shown = [], []
    for k in (0, 1):
        cells = [str(row[k]) for row in rows]
        unit = next((found for cell in cells if (found := _unit(cell))), "")
        values = []
        for cell in cells:
            match = _NUMBER.fullmatch(cell.strip())
            if match is None:
                return [], ("", "")
            own = match[2].strip()
            try:
                values.append(units.parse(cell, unit) if own and own != unit else float(match[1]))
            except units.UnitError:
                return [], ("", "")
        columns.append(values)
        shown.append(unit)
    return list(zip(*columns, strict=True))[:_POINTS], (shown[0], shown[1])


def draw_curve(text: str, names: Sequence[str]) -> None:
    """Draw the curve of rows, with its ends in words; nothing of what is no table.

    Parameters
    ----------
    names : what the two columns are and their units, for rows of plain numbers
    """
    points, written = curve(text)
    if not points:
        return
    ends = [(min(column), max(column)) for column in zip(*points, strict=True)]
    (x0, x1), (y0, y1) = ends
    at = " ".join(
        f"{4 + (_WIDE - 8) * (x - x0) / ((x1 - x0) or 1.0):.1f},"
        f"{_HIGH - 4 - (_HIGH - 8) * (y - y0) / ((y1 - y0) or 1.0):.1f}"
        for x, y in points
    )
    with ui.element("svg").props(f'viewBox="0 0 {_WIDE} {_HIGH}" preserveAspectRatio=none aria-hidden=true'):
        if y0 < 0.0 < y1:
            zero = f"{_HIGH - 4 + (_HIGH - 8) * y0 / (y1 - y0):.1f}"
            ui.element("line").props(f"x1=0 x2={_WIDE} y1={zero} y2={zero} class=ev-zero")
        ui.element("polyline").props(f'points="{at}"')
    words = []
    for name, (low, high), unit in zip(names, ends, written, strict=True):
        what, _, plain = name.partition(" (")
        text = f"{'value' if ' or ' in what else what} {low:.4g} to {high:.4g}"
        words.append(f"{text} {unit or ('' if ' or ' in plain else plain.rstrip(')'))}".strip())
    ui.label(f"{len(points)} rows: {', '.join(words)}").classes("ev-what")
