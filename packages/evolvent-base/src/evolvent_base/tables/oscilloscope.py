"""Texts of oscilloscopes that hold their settings in columns beside the samples (Tektronix TDS)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from evolvent_base.tables.blocks import Block
from evolvent_base.tables.cells import is_number
from evolvent_base.tables.heads import Head, distinct
from evolvent_base.tables.layout import split

#: Rows among which the settings stand.
_SETTINGS = 40


class Signals(NamedTuple):
    """The head of the columns of samples, and the first of them."""

    head: Head
    first: int


def beside(lines: Sequence[str], separator: str, block: Block) -> Signals | None:
    """The columns of samples of such a text, None of any other: time and signal."""
    rows = [split(lines[k], separator) for k in block.rows[:_SETTINGS]]
    stated = {row[0].rstrip(":").lower(): row[1] for row in rows if len(row) > 3 and row[0]}
    if not {"record length", "sample interval"} <= set(stated):
        return None
    full = [c for c in range(2, block.width) if all(c < len(row) and is_number(row[c]) for row in rows)]
    if len(full) != 2 or full[1] != full[0] + 1:
        return None
    lacking = [""] * (block.width - full[1] - 1)
    heads = ["time", stated.get("source", "") or "signal", *lacking]
    units = [stated.get("horizontal units", ""), stated.get("vertical units", ""), *lacking]
    return Signals(Head(heads, distinct(heads), units), full[0])
