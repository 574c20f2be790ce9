"""Which lines of a text are the rows of its table: the longest run of lines with equally many cells and numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from evolvent_base.errors import InputError, counted
from evolvent_base.tables.layout import Kinds, is_comment, kinds, split

#: Characters of the beginning in which every cell is examined.
_CLOSELY = 1_000_000
#: Rows at the beginning of a run by which the kinds of its columns are judged.
_JUDGED = 60
#: Lines between rows that are none, for each row, above which a text is no table.
_MOST_OTHERS = 0.25
#: Rows from which on a word alone in a table of one column is a row, not a head.
_MANY = 10
#: Most digits of the number of a row.
_LONGEST_COUNT = 15
#: What a row may begin with; other lines are examined in full.
_BEGINNINGS = frozenset("0123456789+-.,;|\t\"' \u2212")


@dataclasses.dataclass
class Block:
    """Rows of a table by their places among the lines.

    Attributes
    ----------
    rows : places of the rows
    width, least : most cells of a row, and most without the empty ones at its end
    letters : kinds of the cells of the first rows
    short, others, heads : places of rows with fewer cells, of lines that are none, and of heads that stand again
    cut : those of the others that are rows with fewer cells, with rows behind them
    long : place of the first row with too many cells, or -1
    counts : whether the first cells are the numbers of the rows
    named : cells of the line above the first row, a head
    """

    rows: list[int]
    width: int
    least: int
    letters: list[str] = dataclasses.field(default_factory=list)
    short: list[int] = dataclasses.field(default_factory=list)
    others: list[int] = dataclasses.field(default_factory=list)
    heads: list[int] = dataclasses.field(default_factory=list)
    cut: list[int] = dataclasses.field(default_factory=list)
    long: int = -1
    counts: bool = False
    named: int = 0

    def fits(self, row: Kinds) -> bool:
        """Whether a line has as many cells as the rows, but for empty ones at the end."""
        return row.least <= self.width and self.least <= row.width

    def add(self, place: int, row: Kinds) -> None:
        """Take a line as a row."""
        self.rows.append(place)
        self.width, self.least = max(self.width, row.width), max(self.least, row.least)
        if len(self.letters) < 2 * _JUDGED:
            self.letters.append(row.letters)


def block_of(
    lines: Sequence[str], separator: str, path: str, begin: int = 0, end: int | None = None
) -> tuple[Block, int]:
    """The rows of the longest table in a text from one line to another, and how many tables there are.

    Raises
    ------
    InputError
        If there is none.
    """
    found = _Blocks(lines, separator).find(begin, len(lines) if end is None else end)
    if not found:
        raise InputError(f"cannot read {path!r}: it is no table of numbers")
    best = max(found, key=lambda block: (len(block.rows), block.width))
    many = len(best.others) + len(best.heads)
    if many > 5 and many > _MOST_OTHERS * len(best.rows):
        raise InputError(
            f"cannot read {path!r}: it is no table of numbers; {counted(many, 'line')} between its "
            f"{len(best.rows)} rows have other cells"
        )
    _trim(best)
    firsts = [split(lines[place], separator)[0] for place in best.rows[:_JUDGED]]
    origin = int(firsts[0]) if firsts[0].isdecimal() and len(firsts[0]) <= _LONGEST_COUNT else -1
    best.counts = len(firsts) > 1 and firsts == [str(origin + k) for k in range(len(firsts))]
    place = next(k for k, one in enumerate(found) if one is best)
    others = [len(one.rows) for one in found[:place] if len(one.rows) > max(2, len(best.rows) // 4)]
    return best, 1 + len(others) + len(found[place + 1 :])


class _Blocks:
    """Runs of rows in order. A run goes on behind heads that stood above it, messages, and rows of other widths."""

    def __init__(self, lines: Sequence[str], separator: str) -> None:
        self.lines, self.separator = lines, separator
        self.found: list[Block] = []
        self.seen: set[str] = set()  # lines above the current run
        self.waiting: list[tuple[int, Kinds]] = []  # lines since its last row
        self.named = 0  # cells of the line above it
        self.all_short = False  # whether those lines are rows with fewer cells

    def find(self, begin: int, end: int) -> list[Block]:
        """All runs."""
        quick, read = self.separator not in ("", " "), 0
        for place in range(begin, end):
            line = self.lines[place]
            read += len(line)
            if read > _CLOSELY and quick and self.found and not self.waiting and '"' not in line:
                block = self.found[-1]
                if line[:1] in _BEGINNINGS and block.least <= line.count(self.separator) + 1 <= block.width:
                    block.rows.append(place)
                    continue
            if not line.strip() or is_comment(line, self.separator):
                continue
            row = kinds(line, self.separator)
            if row.least:
                self._take(place, row)
        if self.found and self.waiting:
            self._sort(is_end=True)
        return self.found

    def _take(self, place: int, row: Kinds) -> None:
        if not self.found:
            if row.is_row:
                self._begin(place, row)
            else:
                self.seen.add(self.lines[place].strip())
                self.named = row.least
            return
        block = self.found[-1]
        again = self.lines[place].strip() in self.seen and ("w" in row.letters or not row.is_row)
        lone = (
            not row.is_row
            and block.fits(row)
            and len(block.rows) >= _MANY
            and len(set(split(self.lines[place], self.separator))) == 1
        )
        if again or not block.fits(row) or not (row.is_row or lone):
            is_short = row.is_row and not again and row.least < block.least and self.separator not in ("", " ")
            self.all_short = is_short and (self.all_short or not self.waiting)
            self.waiting.append((place, row))
            if row.is_row and not again and len(self.waiting) > 1:
                self._begin_behind()
        elif all(self._is_between(*one) for one in self.waiting):
            self._sort()
            block.add(place, row)
        else:
            self._begin(place, row)

    def _begin(self, place: int, row: Kinds) -> None:
        """A new run."""
        self.seen |= {self.lines[k].strip() for k, _ in self.waiting}
        if self.found and len(self.found[-1].rows) < _JUDGED:
            self.seen |= {self.lines[k].strip() for k in self.found[-1].rows}
        if self.waiting:
            self.named = 0 if self.waiting[-1][1].is_row else self.waiting[-1][1].least
        self.waiting = []
        self.found.append(Block([], row.width, row.least, named=self.named))
        self.found[-1].add(place, row)

    def _begin_behind(self) -> None:
        """A new run where the last line is a row that the line before, a row or a line of names, fits."""
        (before, one), (place, row) = self.waiting[-2:]
        if not Block([], one.width, one.least).fits(row) or self.lines[before].strip() in self.seen:
            return
        if self.all_short and len(self.waiting) <= len(self.found[-1].rows):
            return  # columns that end before others
        self.waiting.pop()
        rows = [(place, row)]
        while self.waiting and self.waiting[-1][1].is_row and Block([], row.width, row.least).fits(self.waiting[-1][1]):
            rows.insert(0, self.waiting.pop())
        self._begin(*rows[0])
        for later in rows[1:]:
            self.found[-1].add(*later)

    def _is_between(self, place: int, row: Kinds) -> bool:
        """Whether a run goes on behind a line: a head seen before, a row of another width, a text of fewer cells."""
        block = self.found[-1]
        return self.lines[place].strip() in self.seen or row.is_row or row.least < block.least

    def _sort(self, *, is_end: bool = False) -> None:
        """Keep the lines between rows with the run. Shorter rows are its rows where several follow one another."""
        block = self.found[-1]
        are_rows = self.all_short and len(self.waiting) > 1
        for place, row in self.waiting:
            if self.lines[place].strip() in self.seen:
                block.heads.append(place)
            elif row.is_row and row.least > max(block.width, block.named):
                block.long = place if block.long < 0 else block.long
            elif row.is_row and row.least > block.width:
                block.rows.append(place)
                block.width = row.width
            elif are_rows:
                block.short.append(place)
                block.rows.append(place)
            else:
                block.others.append(place)
                if row.is_row and not is_end:
                    block.cut.append(place)
        self.waiting = []


def _trim(block: Block) -> None:
    """Leave out rows at the beginning with words where the columns hold numbers: lines of keys and values."""
    letters = block.letters
    later = letters[len(letters) // 2 :]
    usual = [{row[c : c + 1] for row in later} for c in range(block.width)]
    k = 0
    while k < min(len(letters) - 1, len(letters) // 2):
        words = [c for c, one in enumerate(letters[k]) if one == "w" and usual[c] & {"n", "t"} and "w" not in usual[c]]
        if not words or words[0] != 0:
            break
        k += 1
    del block.rows[:k]
