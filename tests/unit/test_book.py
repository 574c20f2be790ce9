"""The validation book: the table that is shipped, and how fresh entries renew it."""

from __future__ import annotations

import pathlib
from typing import Any

import pytest

import book

ENTRY: dict[str, Any] = {
    "chapter": "Modes", "case": "Rod of 10 elements", "reference": "pi c/L", "source": "closed form",
    "error": 1.234e-4, "allowed": 1e-3, "unit": "", "order": 1.9834, "wanted": "2",
    "test": "unit/test_book.py::test_rows_are_rounded_so_that_processors_agree",
}  # fmt: skip


@pytest.mark.slow
def test_every_test_that_enters_rows_has_some_in_the_table_that_is_shipped() -> None:
    rows = book.shipped()
    assert book.missing(rows) == [], f"these tests have no row in the table; {book.RENEW}"
    known = set(book.tests_with_rows())
    assert {row["test"] for row in rows} <= known, f"the table has rows of tests that are gone; {book.RENEW}"
    assert len({book.key_of(row) for row in rows}) == len(rows) > 400
    assert {row["chapter"] for row in rows} == set(book.CHAPTERS)
    for row in rows:
        assert 0.0 < row["error"] <= row["allowed"], row
        assert book.rounded(row) == row, f"{row['case']}: it was changed by hand; {book.RENEW}"


def test_fresh_entries_agree_with_the_table_or_the_run_says_so(tmp_path: pathlib.Path, monkeypatch: Any) -> None:
    """As `start.py test` does at its end: 1 where rows are new, gone or restated, 0 where they are measured again."""
    monkeypatch.setenv("EVOLVENT_BOOK", str(tmp_path / "entries"))
    monkeypatch.setattr(book, "tests_with_rows", lambda: ["a.py::test_a", "b.py::test_b"])
    monkeypatch.setattr(book, "ROOT", tmp_path)
    monkeypatch.setattr(book, "SHIPPED", tmp_path / "table.json")
    monkeypatch.setattr(book, "state", list)
    about = {"reference": "r", "source": "closed form"}
    for test in ("a.py::test_a", "b.py::test_b"):
        for case in ("one", "two"):
            book.Book(test)("Modes", case, error=2.2e-4, allowed=1e-3, **about)
    folder = str(tmp_path / "entries")
    assert book.main([folder]) == 1, "all rows are new"
    assert [row["error"] for row in book.shipped()] == 4 * [3e-4]
    assert book.main([folder]) == 0
    book.Book("a.py::test_a")("Modes", "one", error=8e-4, allowed=1e-3, **about)
    assert book.main([folder]) == 0, "measured again"
    assert [row["error"] for row in book.shipped()] == 4 * [3e-4]
    book.Book("a.py::test_a")("Modes", "one", error=1e-5, allowed=1e-3, **about)
    assert book.main([folder]) == 0
    assert [row["error"] for row in book.shipped()].count(1e-5) == 1
    book.Book("a.py::test_a")("Modes", "one", error=1e-5, allowed=1e-4, **about)
    assert book.main([folder]) == 1, "another bound"
    for path in (tmp_path / "entries").glob("*.json"):
        path.unlink()
    book.Book("a.py::test_a")("Modes", "one", error=1e-5, allowed=1e-4, **about)
    assert book.main([folder]) == 0, "a part of the tests leaves the other rows as they are"
    assert len(book.shipped()) == 4
    assert book.main([folder, "--whole"]) == 1, "the test enters its second row no longer"
    assert [row["case"] for row in book.shipped()] == ["one", "one", "two"]
    assert book.missing(book.shipped()) == []
    monkeypatch.setattr(book, "tests_with_rows", lambda: ["a.py::test_a", "c.py::test_c"])
    assert book.main([folder]) == 1, "a test is gone"
    assert book.missing(book.shipped()) == ["c.py::test_c"]
    assert "Not measured: `c.py::test_c`." in book.table(book.shipped())
    assert book.main([]) == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("error", "allowed", "held", "shown"),
    [
        (1.234e-4, 1e-3, 2e-4, "0.0002"), (2e-4, 1e-3, 2e-4, "0.0002"), (9.1e-4, 1e-3, 1e-3, "0.001"),
        (3e-14, 1e-9, 1e-9, "< 1e-09"), (0.0, 1e-12, 1e-12, "< 1e-12"), (0.96, 0.97, 0.97, "0.97"),
    ],
)  # fmt: skip
def test_rows_are_rounded_so_that_processors_agree(
    error: float, allowed: float, held: float, shown: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(book, "tests_with_rows", list)  # which reads all files of tests
    row = book.rounded(ENTRY | {"error": error, "allowed": allowed})
    assert (row["error"], row["order"]) == (pytest.approx(held, rel=1e-12), 2.0)
    assert book.rounded(row) == row
    assert shown in book.table([row])
    assert book.agrees(ENTRY | {"error": 2.0 * error, "allowed": allowed}, row)
    assert not book.agrees(ENTRY | {"error": error, "allowed": allowed, "order": None}, row)
    assert not book.agrees(ENTRY | {"error": error, "allowed": 2.0 * allowed}, row)
