"""What stands above the rows of a table: names, units, a sampling rate, the decimal sign."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from evolvent_base import units as texts
from evolvent_base.tables import words
from evolvent_base.tables.blocks import Block
from evolvent_base.tables.layout import SEPARATORS, is_comment, kind, split

#: Lines above the rows among which names and units are looked for, and those of which may be heads.
_NEAR, _HEADS = 40, 5
#: Longest line that may state a rate.
_LONGEST = 200
_SIGN_OF_COMMENT = re.compile(r"\s*(?:#+|%+|//|;|!)\s*")
_RULE = re.compile(r"[-=_*+|:\s]+")
#: A line of a head that states a rate or a step: its key, and its value with a unit.
_RATE = re.compile(
    r"[#%/;!\s\"]*(sampl(?:e|ing)[ _]?(?:rate|frequency|interval|period)|(?:frame|scan|acquisition|data) ?rate"
    r"|abtastrate|abtastfrequenz|delta[ _]?t|dt|ts|fs)"
    r"(?:\s*[\[(]\s*([^\])]*?)\s*[\])])?[\s\"]*[:=,;\t|][\s\"]*([-+.,\deE]+)[\s\"]*([A-Za-zµ/]*).*",
    re.IGNORECASE,
)


#: Start and step in the head of an oscilloscope: "t0 = -1.5s, tInc = 0.05".
_STEP = re.compile(r"t0 ?= ?([-+.\deE]+) ?s?, ?tInc ?= ?([-+.\deE]+) ?s?", re.IGNORECASE)


#: First cells of lines that state the unit of the time, in group 1, or those of the other columns.
_UNITS = re.compile(r"(?:(horizontal|x) |vertical |channel |y )?(?:units?|einheit(?:en)?)(?: label)?:?", re.IGNORECASE)


#: What may stand before names in a comment.
_LABEL = re.compile(r"(?:headers?|columns?|fields?|names?|channels?|spalten) ?[:=]?", re.IGNORECASE)


class Head(NamedTuple):
    """Heads of columns as they stand, their names and units; rate in Hz and time of the first row in s, if stated."""

    heads: list[str]
    names: list[str]
    units: list[str]
    rate: float | None = None
    start: float = 0.0
    decimal: str = ""
    notes: tuple[str, ...] = ()


def head_of(lines: Sequence[str], separator: str, block: Block) -> Head:
    """The head of a table."""
    above = _above(lines, separator, block)
    found = _names(above, block)
    found = _with_units(lines[max(0, block.rows[0] - _NEAR) : block.rows[0]], separator, found)
    stated = _instrument(above, found, block) or found
    times = words.time_columns(stated.names, stated.units)
    dated = block.letters[0] if block.letters else ""
    if stated.rate is None and not any(stated.units[k] or dated[k : k + 1] == "t" for k in times):
        rate = _rate(lines[: block.rows[0]])
        if rate is not None:
            return stated._replace(rate=rate)
    return stated


def _with_units(lines: Sequence[str], separator: str, head: Head) -> Head:
    """The head with the units that a line above states by a word in its first cell."""
    units = list(head.units)
    for line in lines:
        cells = split(line, separator) if len(line) <= _LONGEST else [""]
        found = _UNITS.fullmatch(cells[0])
        if found and found[1]:
            units[0] = units[0] or _known(cells[1 % len(cells)])
        elif found:
            pairs = itertools.zip_longest(units[1:], cells[1:], fillvalue="")
            units[1:] = [unit or _known(cell) for unit, cell in pairs]
    return head._replace(units=units[: len(head.units)])


def _known(unit: str) -> str:
    return unit if texts.is_unit(unit) or words.is_unit_of_time(unit) else ""


def distinct(names: Iterable[str]) -> list[str]:
    """Names, a number behind those that stand twice, and behind "column" in place of an empty one."""
    taken: set[str] = set()
    last: dict[str, int] = {}
    found: list[str] = []
    for name in names:
        name = name.strip() or f"column {len(found) + 1}"
        fresh = name
        while fresh in taken:
            last[name] = last.get(name, 1) + 1
            fresh = f"{name} ({last[name]})"
        taken.add(fresh)
        found.append(fresh)
    return found


def _whole(cells: Sequence[str]) -> bool:
    """Whether no unit in brackets has been parted from its name, as in "force (N)"."""
    bracketed = [cell[:1] in ("(", "[") for cell in cells]
    return all(bracketed) or not any(bracketed)


def _above(lines: Sequence[str], separator: str, block: Block) -> list[list[str]]:
    """Cells of the lines above the rows that may be heads, the nearest first."""
    found: list[list[str]] = []
    for place in range(block.rows[0] - 1, max(-1, block.rows[0] - _NEAR - 1), -1):
        line = lines[place]
        if not line.strip() or (_RULE.fullmatch(line) and line.strip(separator + " ")):
            continue
        if found and len(line) <= _LONGEST and _RATE.fullmatch(line):  # it states a rate, it names no columns
            continue
        comment = is_comment(line, separator)
        line = _SIGN_OF_COMMENT.sub("", line, count=1) if comment else line
        cells = split(line, separator)
        if not found and (separator == " " or not _fits(cells, block)):  # names may be parted otherwise than numbers
            others = [split(line, sign) for sign in SEPARATORS if sign not in (separator, " ")]
            others += [re.split(r"\s{2,}", line.strip()) if len(line) <= _LONGEST else [], cells, line.split()]
            others = [other for other in others if _whole(other)]
            cells = next((other for other in others if len(other) == block.width > 1), cells)
        if comment and len(cells) == block.width + 1 and _LABEL.fullmatch(cells[0]):
            cells = cells[1:]
        if comment and (len(cells) != block.width or any(cell.endswith(":") for cell in cells)):
            continue
        if _fits(cells, block) and any(cells):
            found.append(cells)
        elif not comment:
            break
        if len(found) == _HEADS:
            break
    return found


def _fits(cells: list[str], block: Block) -> bool:
    """Whether a line has a cell for each column, but for one."""
    full = len(cells) - next((k for k, cell in enumerate(reversed(cells)) if cell), len(cells))
    if block.width == 1:
        return len(cells) == 1
    return full <= block.width + 1 and len(cells) >= max(2, min(block.width, block.least) - 1)


def _names(above: list[list[str]], block: Block) -> Head:
    """Names and units from the rows above."""
    width = block.width
    rows = list(above)
    while rows and not any(kind(cell) == "w" for cell in rows[0]):
        rows.pop(0)  # numbers above the rows are no names
    if not rows:
        return Head([""] * width, distinct([""] * width), [""] * width)
    place = _place_of_names(rows)
    notes: list[str] = []
    heads = _aligned(rows[place], block, notes)
    parted = [texts.head_and_unit(head) for head in heads]
    if _is_iso(heads):
        parted = [(head.split("/")[0].strip(), head.split("/", 1)[1].strip()) if head else ("", "") for head in heads]
    marks = next((_aligned(rows[k], block, []) for k in range(place) if _is_units(rows[k], rows[place])), [""] * width)
    units = [unit or mark.strip("[](){} ") for (_, unit), mark in zip(parted, marks, strict=True)]
    units = ["" if unit in ("-", "--") else unit for unit in units]
    return Head(heads, distinct(name for name, _ in parted), units, notes=tuple(notes))


def _place_of_names(rows: list[list[str]]) -> int:
    """Which of the rows above, the nearest first, holds the names."""
    times = [set(words.time_columns([texts.head_and_unit(cell)[0] for cell in row], [""] * len(row))) for row in rows]
    for k, row in enumerate(rows):
        if times[k]:  # "seconds" below "time" is its unit
            return k + 1 if k + 1 < len(rows) and times[k] & times[k + 1] else k
        if not all(kind(cell) in "we" for cell in row):
            break
    if len(rows) > 1 and any(kind(cell) == "w" for cell in rows[1]):
        if _is_units(rows[0], rows[1]):
            return 1
        near, far = ([cell for cell in row if cell] for row in rows[:2])
        if len(set(near)) < len(near) and len(set(far)) == len(far) and len(far) >= len(near):
            return 1
    return 0


def _is_units(row: list[str], names: list[str]) -> bool:
    """Whether a row holds units: that of the time below the name of the time, or at least as many units as others."""
    cells = [cell for cell in row if cell]
    if not cells:
        return False
    if all(cell[0] + cell[-1] in ("[]", "()", "{}") for cell in cells):
        return True
    times = words.time_columns([texts.head_and_unit(cell)[0] for cell in names], [""] * len(names))
    if any(k < len(row) and words.is_unit_of_time(row[k].strip("[](){} ")) for k in times):
        return True
    if times and any(k < len(row) and row[k] for k in times):
        return False
    if row[0] and names[0].lower() in words.AXES and words.is_unit_of_time(row[0]):
        return True
    known = [cell in ("-", "--", "1", "%") or texts.is_unit(cell.strip("[](){} ")) for cell in cells]
    return 2 * sum(known) >= len(known)


def _aligned(cells: list[str], block: Block, notes: list[str]) -> list[str]:
    """Cells of a head, one for each column: a column of row numbers at the beginning may have none."""
    cells = list(cells)
    while len(cells) > block.width and not cells[-1]:
        cells.pop()
    if len(cells) < block.width:
        lacking = block.width - len(cells)
        last = {row[block.width - 1 : block.width] for row in block.letters}
        first = {row[:1] for row in block.letters}
        if lacking == 1 and not last <= {"", "e"} and (first == {"w"} or block.counts):
            cells = ["", *cells]
        else:
            cells += [""] * lacking
            if not last <= {"", "e"} and lacking == 1:
                notes.append(f"the head names {block.width - 1} of {block.width} columns; the last has no name")
    return cells[: block.width]


def _is_iso(heads: list[str]) -> bool:
    """Whether all heads are of the form "F/N": different quantities, and known units."""
    parts = [head.split("/", 1) for head in heads if head]
    if len(parts) < 2 or not all(len(part) == 2 and part[0].strip() and part[1].strip() for part in parts):
        return False
    if any(sign in head for head in heads for sign in "[]("):
        return False
    return len({part[0] for part in parts}) == len(parts) and all(texts.is_unit(part[1].strip()) for part in parts)


def _instrument(above: list[list[str]], found: Head, block: Block) -> Head | None:
    """The step that the head of an oscilloscope states in columns "Start" and "Increment"."""
    stated = _STEP.fullmatch(", ".join(cell for cell in found.heads if "=" in cell)) if found.heads else None
    if stated:
        heads = ["" if "=" in head else head for head in found.heads]
        try:
            start, increment = float(stated[1]), float(stated[2])
        except ValueError:
            return None
        names = distinct(texts.head_and_unit(head)[0] for head in heads)
        return found._replace(heads=heads, names=names, rate=1.0 / increment, start=start) if increment > 0.0 else None
    for k, row in enumerate(above):
        low = [cell.lower() for cell in row]
        if k and "start" in low and "increment" in low:
            values = above[k - 1]
            first, step = low.index("start"), low.index("increment")
            try:
                start, increment = float(values[first]), float(values[step])
            except (ValueError, IndexError):
                continue
            columns = [c for c in range(block.width) if c not in (first, step)]
            names = [row[c] if c < len(row) and c in columns else "" for c in range(block.width)]
            units = [values[c] if c < len(values) and c in columns else "" for c in range(block.width)]
            units = ["" if unit.lower() == "sequence" or kind(unit) == "n" else unit for unit in units]
            if increment > 0.0:
                return Head(names, distinct(names), units, 1.0 / increment, start)
    return None


def _rate(lines: Sequence[str]) -> float | None:
    """A sampling rate, Hz, that a line of the head states."""
    for line in lines:
        found = _RATE.fullmatch(line) if len(line) <= _LONGEST else None
        if found is None:
            continue
        key, unit = found[1].lower(), found[2] or found[4] or ""
        is_step = key.endswith(("interval", "period", "t", "ts")) and not key.startswith("abtast")
        try:
            value = float(found[3].replace(",", "."))
            value *= texts.parse(f"1 {unit or ('s' if is_step else 'Hz')}", "s" if is_step else "Hz")
        except (ValueError, texts.UnitError):
            continue
        if value > 0.0:
            return 1.0 / value if is_step else value
    return None
