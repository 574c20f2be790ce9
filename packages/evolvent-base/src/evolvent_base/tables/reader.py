"""From the bytes of a file to its table."""

from __future__ import annotations

import re
from collections.abc import Sequence

from evolvent_base.errors import InputError, counted
from evolvent_base.tables import labview, oscilloscope, serial
from evolvent_base.tables.blocks import Block, block_of
from evolvent_base.tables.cells import is_missing, quantity
from evolvent_base.tables.heads import Head, head_of
from evolvent_base.tables.layout import decoded, is_comment, kind, kinds, lines_of, separator_of, split
from evolvent_base.tables.table import TextTable
from evolvent_base.tables.words import time_columns

#: Rows that show whether cells are parted by decimal commas.
_JUDGED = 200
#: Characters of a line that a sentence shows.
_SHOWN = 40
#: A whole number, its digits grouped or not; by points as well.
_WHOLE = re.compile(r"[-+\u2212]?\d+(?:[ '\u00a0\u202f]\d{3})*")
_GROUPED = re.compile(r"[-+\u2212]?\d+(?:[ '.\u00a0\u202f]\d{3})*")


def read(raw: bytes, path: str, *, whole: bool = False) -> TextTable:
    """The table in a text file.

    Parameters
    ----------
    raw : the bytes of the file
    path : its name, for messages
    whole : whether lines within or behind the table that are no rows are refused, not noted: every row counts

    Raises
    ------
    InputError
        If it is no text, or holds no table of numbers or times; or its cells cannot be told apart.
    """
    text = decoded(raw, path)
    lines, numbers = lines_of(text)
    lines, stamps = serial.unstamped(lines)
    labelled = serial.unlabelled(lines)
    if labelled is not None:
        lines, numbers, stamps = labelled, [1, *numbers], ["", *stamps] if stamps else []
    is_lvm = labview.is_lvm(lines)
    separator = separator_of(lines[labview.first_row(lines) :] if is_lvm else lines)
    if stamps:
        lines = serial.stamped(lines, stamps, separator)
        separator = separator or "\t"
    found = labview.sections(lines, separator, path) if is_lvm else None
    if found is None:
        block, tables = block_of(lines, separator, path)
        if separator == "," and _is_decimal_comma(lines, numbers, block, path):
            separator = ""
            block, tables = block_of(lines, separator, path)
        head = head_of(lines, separator, block)
        signals = oscilloscope.beside(lines, separator, block)
        if signals is not None:
            head, lines = signals.head, [separator.join(split(line, separator)[signals.first :]) for line in lines]
            block.width -= signals.first
            block.letters = [row[signals.first :] for row in block.letters]
    else:
        block, head, tables = *found, 1
    notes = [*head.notes, *_notes(block, lines, numbers, tables)]
    if whole:
        _check_whole(block, lines, numbers, separator, path)
    if block.long >= 0:
        raise InputError(
            f"cannot read {path!r}: line {numbers[block.long]} has more cells than the {block.width} of the others"
        )
    head = _without_empty_ends(head._replace(notes=tuple(notes)), block, lines, separator)
    rows = block.rows
    if len(rows) < 2 and not any(head.heads):
        raise InputError(f"cannot read {path!r}: it is no table of numbers of two lines or more")
    first = block.letters[: max(1, len(block.letters) // 2)]
    clocks = [c for c in range(block.width) if {row[c : c + 1] for row in first} in ({"t"}, {"t", "e"})]
    if block.cut and not clocks and not time_columns(head.names, head.units):  # without times every row counts
        rows = sorted([*rows, *block.cut])
        head = head._replace(notes=(*head.notes, f"rows cut off that stand for missing samples: {len(block.cut)}"))
    cut = set(block.cut)
    own = ["" if k in cut else lines[k] for k in rows]
    marks = _units_in_cells(own, separator, len(head.units))
    head = head._replace(units=[unit or marks.get(c, "") for c, unit in enumerate(head.units)])
    return TextTable(path, head, own, [numbers[k] for k in rows], separator, block.width, clocks, marks)


def _units_in_cells(lines: Sequence[str], separator: str, count: int) -> dict[int, str]:
    """Units that stand behind the numbers of a column in every cell."""
    rows = [split(line, separator) for line in lines[:_JUDGED]]
    if not any(quantity(cell) for cell in rows[0]):
        return {}
    marks = {}
    for c in range(count):
        found = [quantity(row[c]) for row in rows if c < len(row) and not is_missing(row[c])]
        units = {one[1] if one else "" for one in found}
        if len(units) == 1 and units != {""}:
            marks[c] = units.pop()
    return marks


def _is_decimal_comma(lines: Sequence[str], numbers: Sequence[int], block: Block, path: str) -> bool:
    """Whether the commas of a table are decimal signs of its only column; refused where they part cells as well."""
    judged = [lines[k] for k in block.rows[:_JUDGED]]
    rows = [split(line, ",") for line in judged]
    head = head_of(lines, ",", block)
    named = len([one for one in head.heads if one]) or _words_above(lines, block)
    filled = max((c + 1 for row in rows for c, cell in enumerate(row) if cell), default=0)  # not the trailing commas
    whole = _GROUPED if named == 1 or 0 < named < min(filled, block.width - 1) else _WHOLE
    if any('"' in line for line in judged) or not all(is_missing(x) or whole.fullmatch(x) for row in rows for x in row):
        return False
    later = [cell for row in rows for cell in row[1:]]
    zeros = sum(len(cell) > 1 and cell[0] == "0" for cell in later)
    if block.width == 2 and (named == 1 or zeros):
        return True
    above = any(line.strip() for line in lines[: block.rows[0]])
    if (
        block.width == 2
        and not above
        and len({len(cell) for cell in later}) == 1
        and all(x[:1].isdigit() for x in later)
    ):
        raise InputError(
            f"cannot read {path!r}: its commas may part two columns of whole numbers, or be decimal signs of one; name "
            "the columns in a first line, or write it with semicolons or decimal points"
        )
    is_odd = zeros > len(rows) // 10 or any(
        not cell.lstrip("+-\u2212").isdigit() for row in rows for cell in row if cell
    )
    if (named and named < block.width - 1) or (named != block.width and is_odd):
        names = f"the head names {counted(named, 'column')}, " if named else ""
        raise InputError(
            f"cannot read {path!r}: {names}line {numbers[block.rows[0]]} has {block.width} cells without decimals; "
            "commas part the cells and seem to be decimal signs as well, so that the cells cannot be told apart; write "
            "it with semicolons between the cells"
        )
    return False


def _check_whole(block: Block, lines: Sequence[str], numbers: Sequence[int], separator: str, path: str) -> None:
    """Refuse lines that are no rows, but those above the table that hold no numbers."""
    known = {*block.rows, *block.heads}
    for k, line in enumerate(lines):
        if k in known or not line.strip() or is_comment(line, separator):
            continue
        row = kinds(line, separator)
        if row.least and (row.is_row or k > block.rows[0]):
            text = line.strip()
            raise InputError(f"cannot read {path!r}: line {numbers[k]} is no row of the table: {text[:_SHOWN]!r}")


def _words_above(lines: Sequence[str], block: Block) -> int:
    """How many cells the nearest of the lines above the rows has that holds words alone; 0 where none does."""
    above = [split(line, ",") for line in lines[max(0, block.rows[0] - 5) : block.rows[0]] if line.strip()]
    return next((len(cells) for cells in reversed(above) if all(kind(cell) == "w" for cell in cells)), 0)


def _notes(block: Block, lines: Sequence[str], numbers: Sequence[int], tables: int) -> list[str]:
    """Sentences on lines that are no rows."""
    notes = []
    if tables > 1:
        notes.append(
            f"the file holds {tables} tables; the longest, from line {numbers[block.rows[0]]} to line "
            f"{numbers[block.rows[-1]]}, is read"
        )
    if block.heads:
        notes.append(f"the head stands again in line {numbers[block.heads[0]]}; the rows below it are read as well")
    if block.others:
        first = block.others[0]
        text = lines[first].strip()
        shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
        notes.append(
            f"{counted(len(block.others), 'line')} within or behind the table {_are(block.others)} no whole row and "
            f"left out, the first line {numbers[first]}: {shown!r}"
        )
    if block.short:
        notes.append(
            f"{counted(len(block.short), 'row')} of the file {'has' if len(block.short) == 1 else 'have'} fewer cells "
            f"than the others, the first line {numbers[block.short[0]]}; those that lack are empty"
        )
    return notes


def _are(places: Sequence[int]) -> str:
    return "is" if len(places) == 1 else "are"


def _without_empty_ends(head: Head, block: Block, lines: Sequence[str], separator: str) -> Head:
    """The head without columns at the end that have neither a name nor a cell."""
    width = len(head.heads)
    while width > 1 and not head.heads[width - 1]:
        sample = (split(lines[k], separator) for k in block.rows)
        if any(len(row) >= width and not is_missing(row[width - 1]) for row in sample):
            break
        width -= 1
    return head._replace(heads=head.heads[:width], names=head.names[:width], units=head.units[:width])
