"""Texts of oscilloscopes that hold their settings in columns beside the samples (Tektronix TDS)."""

from __future__ import annotations

from collections.abc import Sequence

from evolvent.base.tables.blocks import Block
from evolvent.base.tables.cells import is_number
from evolvent.base.tables.heads import Head, distinct
from evolvent.base.tables.layout import split

#: Rows among which the settings stand.
_SETTINGS = 40


def beside(lines: Sequence[str], separator: str, block: Block) -> Head | None:
    """The head of such a text, None of any other: time and signal are in the last two columns."""
    rows = [split(lines[k], separator) for k in block.rows[:_SETTINGS]]
    stated = {row[0].rstrip(":").lower(): row[1] for row in rows if len(row) > 3 and row[0]}
    if not {"record length", "sample interval"} <= set(stated):
        return None
    full = [c for c in range(2, block.width) if all(c < len(row) and is_number(row[c]) for row in rows)]
    if len(full) != 2:
        return None
    heads, units = [""] * block.width, [""] * block.width
    heads[full[0]], heads[full[1]] = "time", stated.get("source", "") or "signal"
    units[full[0]] = stated.get("horizontal units", "").strip('"')
    units[full[1]] = stated.get("vertical units", "").strip('"')
    return Head(heads, distinct(heads), units)
