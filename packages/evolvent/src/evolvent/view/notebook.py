"""What a notebook shows of an object: its facts, warnings and a short table, as HTML in which every text is escaped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from evolvent_base import pages
from evolvent_base.errors import counted
from evolvent_base.figures import Figure

#: Rows of a table in a notebook, at most.
MOST = 12
#: Dots per inch of a small figure, and reasons of failed cases that are shown at most.
_SMALL, _REASONS = 80.0, 3


def summary(
    title: str,
    facts: Sequence[tuple[str, str]] = (),
    *,
    rows: Sequence[Sequence[str]] = (),
    warnings: Sequence[str] = (),
    notes: Sequence[str] = (),
    figures: Sequence[Figure] = (),
) -> str:
    """A short description as HTML.

    Parameters
    ----------
    title : str
    facts : (label, value) each
    rows : a table, its head first; of a long one the first `MOST` rows
    warnings, notes : sentences above and below the tables
    figures : drawn below them, small
    """
    from evolvent_base import plots

    left = len(rows) - 1 - MOST
    more = [f"{counted(left, 'more row')}"] if left > 0 else []
    table = [list(row) for row in rows[: MOST + 1]]
    return pages.render(
        "notebook.html", title=title, facts=[list(fact) for fact in facts], rows=table, warnings=list(warnings),
        notes=[*more, *notes],
        pictures=[pages.picture(plots.picture(one, "png", dpi=_SMALL), "png", one.title) for one in figures],
    )  # fmt: skip


def failed(reasons: Iterable[str]) -> list[str]:
    """Sentences on cases that failed, the most frequent reason first; of many reasons the first `_REASONS`."""
    found = Counter(reasons).most_common()
    left = len(found) - _REASONS
    return [f"{counted(count, 'case')} failed: {why}" for why, count in found[:_REASONS]] + (
        [f"{counted(left, 'more reason')} of failures"] if left > 0 else []
    )


class Sheets(list[Any]):
    """Figures of matplotlib, which a notebook shows one below the other."""

    def _repr_html_(self) -> str:
        """The figures as images."""
        return pages.render(
            "notebook_figures.html", pictures=[pages.picture(sheet._repr_png_(), "png", "") for sheet in self]
        )


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
