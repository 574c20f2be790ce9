"""What shows an answer: on the screen, as a page, in a notebook, as files."""

from __future__ import annotations

import datetime
import io
import os
import re
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from evolvent_base import files, pages, plots
from evolvent_base.answer import EVERYWHERE, Answer, Block, Points, Section, Table
from evolvent_base.console import made_table, say
from evolvent_base.errors import InputError, counted, visible
from evolvent_base.figures import Figure

#: Columns of a text that no terminal bounds, and least columns of words in a table.
_WIDE, _WORDS = 10_000, 16
#: Warnings that the screen shows.
_MOST_WARNINGS = 8
#: Rows of a table in a notebook, at most; dots per inch of its figures.
MOST, _SMALL = 12, 80.0
#: Largest figure that a page keeps as lines; a larger one is kept as points, bytes.
_LARGEST_SVG = 250_000


class Answered:
    """What can be printed, and is shown in notebooks: its class says by `answer` what is shown."""

    def answer(self) -> Answer:
        """What it says."""
        raise NotImplementedError

    def __str__(self) -> str:
        """The answer as lines."""
        return text(self.answer())

    def _repr_html_(self) -> str:
        """The answer in short, for notebooks."""
        return notebook(self.answer())


class Shown(Answered):
    """A result whose answer can be drawn, and kept as files.

    Attributes
    ----------
    named : str, what messages call it, such as "margins"
    endings : tuple of str, of the files that `save` writes
    """

    named: ClassVar[str] = "results"
    endings: ClassVar[tuple[str, ...]] = ()

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Draw the first figure.

        Parameters
        ----------
        path : str, optional, file that ends with .png, .svg or .pdf

        Returns
        -------
        matplotlib.figure.Figure, or the path that was written

        Raises
        ------
        InputError
            If there is nothing to draw, or the file cannot be written.
        """
        drawn = self.answer().figures
        if not drawn:
            raise InputError(f"the {self.named} have no figure")
        return plots.sheet(drawn[0]) if path is None else plots.save(drawn[0], path)

    def report(self, path: str | os.PathLike[str], *, date: datetime.datetime | None = None) -> str:
        """Write the answer as one HTML page that needs nothing else; returns the path.

        Parameters
        ----------
        date : the moment that it states; now unless given

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        files.write_file(path, page(self.answer(), date=date).encode())
        return os.fspath(path)

    def save(self, path: str | os.PathLike[str]) -> str:
        """Write the answer as a file of the kind that its ending names; returns the path.

        Raises
        ------
        InputError
            If the file cannot be written, or its ending is none of `endings`.
        """
        self.check_ending(path)
        return save(self.answer(), path)

    @classmethod
    def check_ending(cls, path: str | os.PathLike[str]) -> None:
        """Refuse a file whose ending is none of `endings`."""
        check_ending(path, cls.endings, cls.named)


def check_ending(path: str | os.PathLike[str], endings: Sequence[str], named: str) -> None:
    """Refuse a file whose ending is none of those in which something is written."""
    ending = os.path.splitext(path)[1]
    if not endings:
        raise InputError(f"{named} are not saved as files; report() writes a page, plot() a figure")
    if ending not in endings:
        raise InputError(f"{os.fspath(path)!r} ends with {ending!r}; {named} are written as {', '.join(endings)}")


# ------------------------------------------------------------------------------------------------ screen


def show(answer: Answer, *, level: int = EVERYWHERE) -> None:
    """Print an answer to stdout, with what is shown up to a level."""
    from rich.console import Console  # help and lists do without it

    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        say(text(answer, level=level))
        return
    with console.capture() as captured:
        _print(console, answer, level)
    say(captured.get().rstrip("\n"), styled=True)


def text(answer: Answer, *, level: int = EVERYWHERE) -> str:
    """An answer as lines, with what is shown up to a level."""
    from rich.console import Console  # help and lists do without it

    file = io.StringIO()
    _print(Console(file=file, width=_WIDE, highlight=False, markup=False, color_system=None), answer, level)
    return "\n".join(line.rstrip() for line in file.getvalue().rstrip("\n").splitlines())


def _print(console: Any, answer: Answer, level: int) -> None:
    """Print an answer: sentences, facts, sections, notes, and warnings last, where a terminal shows them."""
    from rich.text import Text  # help and lists do without it

    wide = max((len(label) for label, _ in answer.facts), default=0)
    facts = [(f"{label:<{wide}}  {value}", "") for label, value in answer.facts]
    parts: list[list[tuple[Any, str]]] = [[(one, "") for one in answer.heads], [*facts]]
    for section in answer.sections:
        if section.level <= level:
            parts.append(list(_section(section, level)))
    parts.append([(one, "") for one in answer.notes])
    left = len(answer.warnings) - _MOST_WARNINGS
    warnings = answer.warnings[: _MOST_WARNINGS if left > 1 else None]
    parts.append([(Text.assemble(("warning: ", "yellow"), visible(one)), "") for one in warnings])
    if left > 1:
        parts[-1].append((f"and {left} more warnings, all in the report", ""))
    for k, part in enumerate(one for one in parts if one):
        if k:
            console.print()
        for shown, style in part:
            if _is_table(shown):
                screen = console.width
                console.width = max(screen, _least_width(shown))
                console.print(shown)
                console.width = screen
            else:
                console.print(Text(visible(shown), style) if isinstance(shown, str) else shown, soft_wrap=True)


def _is_table(shown: Any) -> bool:
    return hasattr(shown, "columns")


def _least_width(table: Any) -> int:
    """Width at which no number is folded: the terminal wraps lines that are longer than itself."""
    wide = [max(len(str(cell)) for cell in [column.header, *column.cells]) for column in table.columns]
    words = [column.justify == "left" for column in table.columns]
    return sum(min(n, _WORDS) if is_words else n for n, is_words in zip(wide, words, strict=True)) + len(wide)


def _section(section: Section, level: int) -> Iterator[tuple[Any, str]]:
    """Lines and tables of a section, with their styles; none where it has nothing for the screen."""
    found: list[tuple[Any, str]] = []
    for block in section.made():
        if isinstance(block, str):
            found.append((block, ""))
        elif isinstance(block, Points):
            found += [(one, "") for one in block.texts]
        elif isinstance(block, Table) and block.level <= level and block.rows:
            if block.title:
                found.append((block.title, "bold"))
            rows = block.rows[: block.most or None]
            found.append((made_table(block.heads, rows, words=block.words), ""))
            if len(rows) < len(block.rows):
                found.append((f"and {counted(len(block.rows) - len(rows), 'more row')}", ""))
    if found and section.title:
        yield section.title, "bold"
    yield from found


# ------------------------------------------------------------------------------------------------ pages


def page(answer: Answer, *, date: datetime.datetime | None = None) -> str:
    """An answer as one HTML page that needs nothing else.

    Parameters
    ----------
    date : the moment that it states; now unless given
    """
    moment = date or datetime.datetime.now(datetime.UTC)
    sections = [
        {"id": _slug(one.title), "title": one.title, "kind": one.kind, "blocks": blocks}
        for one in answer.sections
        if (blocks := [_on_page(block) for block in one.made() if not isinstance(block, Table) or block.rows])
    ]
    made = f"{moment.day} {moment:%B %Y, %H:%M} UTC, {answer.made}" if answer.made else ""
    return pages.render("answer.html", answer=answer, sections=sections, made=made)


def _on_page(block: Block) -> tuple[str, Any]:
    """A block for the template: what it is, and it; a figure as an image."""
    if isinstance(block, Figure):
        return "picture", figure_picture(block)
    return {"str": "text"}.get(type(block).__name__, type(block).__name__.lower()), block


def _slug(title: str) -> str:
    return re.sub(r"\W+", "-", title.lower()).strip("-")


def figure_picture(figure: Figure) -> pages.Picture:
    """A figure as an image in the page, whose text is its title."""
    content, kind = plots.picture(figure, "svg", title=False), "svg+xml"
    if len(content) > _LARGEST_SVG:
        points = plots.picture(figure, "png", dpi=150, title=False)
        content, kind = (points, "png") if len(points) < len(content) else (content, kind)
    return pages.picture(content, kind, figure.title)


def notebook(answer: Answer) -> str:
    """An answer in short: warnings, facts, its first table, the sentences beside it, its first figure."""
    tables = [table for table in answer.of_kind(Table) if table.rows][:1]
    rows = [row for table in tables for row in (table.heads, *table.rows[:MOST])]
    left = len(tables[0].rows) - MOST if tables else 0
    more = [counted(left, "more row")] if left > 0 else []
    beside = [block for one in answer.sections[:1] for block in one.made() if isinstance(block, str)]
    return pages.render(
        "notebook.html", title=answer.title, facts=answer.facts, rows=rows, warnings=answer.warnings,
        notes=[*more, *answer.heads, *beside],
        pictures=[
            pages.picture(plots.picture(one, "png", dpi=_SMALL), "png", one.title) for one in answer.figures[:1]
        ],
    )  # fmt: skip


class Sheets(list[Any]):
    """Figures of matplotlib, which a notebook shows one below the other."""

    def _repr_html_(self) -> str:
        """The figures as images."""
        shown = [pages.picture(sheet._repr_png_(), "png", "") for sheet in self]
        return pages.render("notebook_figures.html", pictures=shown)


class Page:
    """A whole HTML page, which a notebook shows in a frame of its own.

    Parameters
    ----------
    content : bytes, the page
    """

    def __init__(self, content: bytes) -> None:
        self.content = content

    def __repr__(self) -> str:
        return f"<Page of {len(self.content)} bytes>"

    def _repr_html_(self) -> str:
        """The page in a frame, which cannot reach the notebook around it."""
        return pages.render("notebook_page.html", content=self.content.decode())


# ------------------------------------------------------------------------------------------------ files


def save(answer: Answer, path: str | os.PathLike[str]) -> str:
    """Write the file of an answer that has the ending of `path`, or its only one; returns the path."""
    ending = os.path.splitext(path)[1]
    fitting = [make for name, make in answer.files.items() if len(answer.files) == 1 or name.endswith(ending)]
    files.write_file(path, fitting[0]())
    return os.fspath(path)


def fill(answer: Answer, folder: str | os.PathLike[str], *, kind: str = "png", drawn: bool = True) -> list[str]:
    """Write all files of an answer into a folder, with its figures and report.html; returns their names.

    Parameters
    ----------
    kind : str, format of the figures
    drawn : bool, whether figures and the report are written

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    files.make_folder(folder)
    contents = {name: make() for name, make in answer.files.items()}
    contents |= {"report.html": page(answer).encode()} if drawn else {}
    for name, content in contents.items():
        files.write_file(os.path.join(folder, name), content)
    paths = plots.draw(answer.figures, folder, kind=kind) if drawn else []
    return [*contents, *map(os.path.basename, paths)]
