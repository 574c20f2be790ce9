"""Texts of LabVIEW (LVM): a header with its own end, for each segment again."""

from __future__ import annotations

from collections.abc import Sequence

from evolvent_base import units as texts
from evolvent_base.tables.blocks import Block, block_of
from evolvent_base.tables.heads import Head, distinct, head_of
from evolvent_base.tables.layout import split
from evolvent_base.tables.stamps import DAY, clock_seconds

_END = "***end_of_header***"
#: Largest difference of the steps of channels, and of a segment's start from the end of the one before, in steps.
_SAME, _NEXT = 1e-9, 1.0


def is_lvm(lines: Sequence[str]) -> bool:
    """Whether lines are those of LabVIEW's format."""
    return any(line.strip().strip('"').lower().startswith(_END) for line in lines[:200])


def first_row(lines: Sequence[str]) -> int:
    """Place behind the header of the first segment."""
    ends = [k for k, line in enumerate(lines[:400]) if line.strip().strip('"')[: len(_END)].lower() == _END]
    return ends[min(1, len(ends) - 1)] + 1


def sections(lines: list[str], separator: str, path: str) -> tuple[Block, Head]:
    """Rows and head of all segments that follow one another; else those of the first, and a note."""
    ends = [k for k, line in enumerate(lines) if line.strip().strip('"')[: len(_END)].lower() == _END]
    whole: dict[str, list[str]] = {}
    if len(ends) > 1 and any(split(line, separator)[0].lower() == "writer_version" for line in lines[: ends[0]]):
        whole = _stated(lines[: ends[0]], separator)
        first = ends[0] + 1
        ends = ends[1:]
    else:
        first = 0
        whole = _stated(lines[: ends[0]], separator)
    begins = [first]
    for end in ends[:-1]:  # the header of the next segment begins with the line that names its channels
        after = (k for k in range(end + 1, len(lines)) if split(lines[k], separator)[0].lower() == "channels")
        begins.append(next(after, len(lines)))
    begins.append(len(lines))
    found: list[tuple[Block, dict[str, list[str]]]] = []
    for k, end in enumerate(ends):
        block, _ = block_of(lines, separator, path, end + 1, begins[k + 1])
        found.append((block, _stated(lines[begins[k] : end], separator)))
    block, stated = found[0]
    head = head_of(lines, separator, block)
    head = _head(head, whole, stated, block)
    return _joined(lines, separator, found, head)


def _stated(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    """Cells of a header by their keys, the key first."""
    rows = [split(line, separator) for line in lines if line.strip()]
    return {row[0].lower(): row for row in reversed(rows)}


def _head(head: Head, whole: dict[str, list[str]], stated: dict[str, list[str]], block: Block) -> Head:
    def cells(key: str) -> list[str]:
        return [cell for cell in stated.get(key, [])[1:] if cell]

    decimal = (whole.get("decimal_separator") or stated.get("decimal_separator") or ["", ""])[1:2]
    sign = decimal[0] if decimal and decimal[0] in (".", ",") else ""
    names, units = list(head.names), list(head.units)
    for c, title in enumerate(head.heads):
        if units[c] and units[c] in title and not texts.is_unit(units[c]):
            names[c], units[c] = title, ""  # "Response (Trigger)" is a name
    own = stated.get("y_unit_label", [])
    dimensions = [cell.lower() for cell in cells("x_dimension")]
    is_time = not dimensions or set(dimensions) == {"time"}
    for c, name in enumerate(head.names):
        if name.lower().startswith("x_value"):
            units[c] = units[c] or ("s" if is_time else "")
        elif c < len(own) and own[c]:
            units[c] = own[c]
    rate, start = None, 0.0
    try:
        steps = [texts.parse(cell.replace(",", "."), "s") for cell in cells("delta_x")]
        starts = [texts.parse(cell.replace(",", "."), "s") for cell in cells("x0")]
    except texts.UnitError:
        steps, starts = [], []
    if is_time and steps and steps[0] > 0.0 and max(steps) - min(steps) <= _SAME * steps[0]:
        rate = 1.0 / steps[0]
        start = starts[0] if starts and max(starts) == min(starts) else 0.0
    return head._replace(units=units, names=distinct(names), rate=rate, start=start, decimal=sign)


def _joined(
    lines: list[str], separator: str, found: list[tuple[Block, dict[str, list[str]]]], head: Head
) -> tuple[Block, Head]:
    """Rows of the segments that follow one another."""
    block, stated = found[0]
    if len(found) == 1:
        return block, head
    first, count, all_rise = _begin(stated), len(block.rows), True
    for k, (other, own) in enumerate(found[1:], start=2):
        begin = _begin(own)
        step = None if head.rate is None else 1.0 / head.rate
        same = (
            other.least <= block.width and block.least <= other.width and own.get("channels") == stated.get("channels")
        )
        rises = _first(lines, separator, other.rows[0]) > _first(lines, separator, block.rows[-1])
        follows = False
        if first is not None and begin is not None and step is not None:
            late = (begin - first - count * step + 0.5 * DAY) % DAY - 0.5 * DAY
            follows = abs(late) <= _NEXT * step
        if not same or not (rises or follows):
            note = (
                f"the file has {len(found)} segments; those from number {k} on do not go on where the one before ends, "
                "and are left out"
            )
            return block, head._replace(notes=(*head.notes, note))
        block.rows += other.rows
        count += len(other.rows)
        all_rise = all_rise and rises
    if not all_rise:  # times that begin at 0 in each segment are none; the rate stands for them
        for row in block.rows:
            lines[row] = separator + lines[row].partition(separator)[2]
    return block, head._replace(notes=(*head.notes, f"the {len(found)} segments of the file follow one another"))


def _first(lines: Sequence[str], separator: str, place: int) -> float:
    """The time of a row, NaN where it has none."""
    try:
        return float(split(lines[place], separator)[0].replace(",", "."))
    except ValueError:
        return float("nan")


def _begin(stated: dict[str, list[str]]) -> float | None:
    """Time of day at which a segment begins, s."""
    cells = [cell for cell in stated.get("time", [])[1:] if cell]
    return clock_seconds(cells[0]) if cells else None
