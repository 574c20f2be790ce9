"""An answer as data: what an analysis found, in sentences, tables and figures. `evolvent_base.showing` shows it."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from evolvent_base.errors import counted
from evolvent_base.figures import Figure
from evolvent_base.pages import Picture

#: Where sections and tables are shown: everywhere; on the screen where details are asked for, and on pages; on pages.
EVERYWHERE, DETAIL, PAGE = 0, 1, 2
#: Reasons of failed cases that are shown, at most.
_REASONS = 3


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """Texts in rows; a table without rows is not shown.

    Attributes
    ----------
    heads : (columns,) str, with units; empty for none
    rows : (rows, columns) str
    title : str
    words : int, how many columns at the left hold words; numbers of the others are at the right
    kind : str, the table's class on a page
    level : int, where it is shown: EVERYWHERE, DETAIL or PAGE
    most : int, rows that the screen and notebooks show, the first ones; 0 for all
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    words: int = 1
    kind: str = ""
    level: int = EVERYWHERE
    most: int = 0

    @classmethod
    def of(cls, rows: Sequence[Sequence[str]], **options: Any) -> Table:
        """A table whose first row has its heads."""
        return cls(heads=rows[0], rows=rows[1:], **options)


class Listing(NamedTuple):
    """A text with its own lines, as of a case; on pages alone."""

    text: str


class Remark(NamedTuple):
    """A sentence that explains what a page shows; on pages alone."""

    text: str


class Points(NamedTuple):
    """Sentences one below the other, numbered or not."""

    texts: Sequence[str]
    numbered: bool = False


class Captioned(NamedTuple):
    """An image with its caption below it; on pages alone."""

    picture: Picture
    caption: str


class Frame(NamedTuple):
    """A page within a page, and images that stand for it on paper."""

    title: str
    page: str
    stills: Sequence[Picture]


Block = str | Table | Figure | Picture | Listing | Remark | Points | Captioned | Frame


@dataclasses.dataclass(frozen=True, kw_only=True)
class Section:
    """Part of an answer.

    Attributes
    ----------
    title : str, '' for none
    blocks : sequence, or function that makes it where it is shown; a text is a sentence
    level : int, where it is shown: EVERYWHERE, DETAIL or PAGE
    kind : str, its class on a page: "warning", "failure", "note", "good", "sign"; '' for a part with a title of its own
    """

    title: str
    blocks: Sequence[Block] | Callable[[], Sequence[Block]] = ()
    level: int = EVERYWHERE
    kind: str = ""

    def made(self) -> Sequence[Block]:
        """Its blocks."""
        return self.blocks() if callable(self.blocks) else self.blocks


@dataclasses.dataclass(frozen=True, kw_only=True)
class Answer:
    """What an analysis found.

    Attributes
    ----------
    title : str
    about : str, what kind of answer it is, above the title of a page
    status : (str, bool), how it ended and whether that is well; None where nothing is to be said
    facts : (label, value) each, what is known first
    heads : sentences that a reader needs first
    warnings : sentences that no reader may miss
    sections : sequence of Section
    notes : sentences on what was assumed
    files : mapping, name of a file -> function that makes its content
    made : str, what made it; pages state it with the date
    style : str, the style sheet of its page
    contents : bool, whether its page begins with links to its sections
    """

    title: str
    about: str = ""
    status: tuple[str, bool] | None = None
    facts: Sequence[tuple[str, str]] = ()
    heads: Sequence[str] = ()
    warnings: Sequence[str] = ()
    sections: Sequence[Section] = ()
    notes: Sequence[str] = ()
    files: Mapping[str, Callable[[], str | bytes | memoryview]] = dataclasses.field(default_factory=dict)
    made: str = ""
    style: str = "report.css"
    contents: bool = False

    def of_kind(self, kind: type) -> list[Any]:
        """Blocks of a kind in all sections whose blocks are known: `Table`, `Figure`, `str`."""
        known = (section.blocks for section in self.sections if not callable(section.blocks))
        return [block for blocks in known for block in blocks if isinstance(block, kind)]

    @property
    def figures(self) -> list[Figure]:
        """Its figures."""
        return self.of_kind(Figure)


def plain(value: Any) -> Any:
    """A number, or numbers, as JSON has them: None for what is not finite; texts and truth values as they are."""
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, Mapping):
        return {key: plain(one) for key, one in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value if isinstance(value, int) else float(value) if math.isfinite(value) else None


def as_json(content: Any) -> str:
    """Content of a JSON file; numbers as of `plain`."""
    return json.dumps(plain(content), indent=1, allow_nan=False) + "\n"


def as_csv(rows: Iterable[Iterable[Any]]) -> str:
    """Content of a CSV file."""
    stream = io.StringIO(newline="")
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def failed(reasons: Iterable[str]) -> list[str]:
    """Sentences on cases that failed, the most frequent reason first; of many reasons the first `_REASONS`."""
    found = Counter(reasons).most_common()
    left = len(found) - _REASONS
    return [f"{counted(count, 'case')} failed: {why}" for why, count in found[:_REASONS]] + (
        [f"{counted(left, 'more reason')} of failures"] if left > 0 else []
    )


def within(answer: Answer) -> list[Block]:
    """An answer as blocks of a section of another one: its sentences, tables with titles, figures and notes."""
    found: list[Block] = [*answer.warnings, *answer.heads]
    for section in answer.sections:
        for block in section.made():
            if isinstance(block, Table):
                found.append(dataclasses.replace(block, title=block.title or section.title))
            elif not isinstance(block, Listing):
                found.append(block)
    return [*found, Points(answer.notes)] if answer.notes else found
