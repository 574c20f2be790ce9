"""Pages made from numbers of the package: `python docs/_ext/made_pages.py` writes them where they have changed.

They are files of the repository, so that they can be read there without a build; a test compares them.
"""

from __future__ import annotations

import pathlib
import sys

DOCS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [path for path in (str(DOCS.parent / "tests"), str(DOCS / "_ext")) if path not in sys.path]
import band_tables  # noqa: E402  (docs/_ext/band_tables.py)
import coverage_page  # noqa: E402  (docs/_ext/coverage_page.py)

import book  # noqa: E402  (tests/book.py)
from evolvent_papers.laboratory import credibility  # noqa: E402


def contents() -> dict[pathlib.Path, str]:
    """The validation book, the statement of credibility that builds on it, coverage of the truth, laboratory tables."""
    made = {
        "validation.md": book.table(book.shipped()),
        "credibility.md": credibility.page(),
        "coverage.md": coverage_page.page(),
    }
    return {DOCS / name: text.rstrip("\n") + "\n" for name, text in made.items()} | band_tables.pages(DOCS)


def changed() -> dict[pathlib.Path, str]:
    """Those whose file is another."""
    return {
        path: text for path, text in contents().items() if not path.exists() or path.read_text(encoding="utf-8") != text
    }


def write() -> None:
    """Write those whose file is another."""
    for path, text in changed().items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
