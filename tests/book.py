"""The validation book: what tests find against references, and the table made of it.

A test asks for the fixture `book` and calls it with what it has found; the call fails where the error is too large, so
that an entry and a passed test are the same thing. With $EVOLVENT_BOOK=FOLDER every entry is also written there, a file
each, so that several processes may write; and

    python tests/book.py FOLDER

enters them into the table that is shipped, `SHIPPED`, and renews the `STATEMENT` of credibility. `start.py test` does
both, and the documentation shows the table. With `--whole` the folder holds all entries of its tests; rows that they no
longer enter are dropped.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import json
import math
import os
import pathlib
import re
import subprocess
import sys
from typing import Any

ROOT = pathlib.Path(__file__).resolve().parents[1]
#: The table that is shipped: a row a line, in the order of `_in_order`.
SHIPPED = ROOT / "packages/evolvent-papers/src/evolvent_papers/laboratory/data/checks.json"
#: What saved results carry of it, a sentence.
STATEMENT = ROOT / "packages/evolvent/src/evolvent" / "results" / "credibility.txt"
#: Errors below it are round-off, which is each processor's own.
ROUND_OFF = 1e-9
#: How a row of the table is found again, and what of it a test states.
KEY = ("test", "chapter", "case", "reference")
STATED = ("source", "allowed", "unit", "wanted")
#: How to renew the table.
RENEW = (
    "renew the table by `python3 start.py test`, or by `EVOLVENT_BOOK=FOLDER pytest TESTS` and "
    "`python tests/book.py FOLDER`, and commit it"
)
#: Chapters, in the order of the table.
CHAPTERS = (
    "Statics of beams",
    "Statics of shells",
    "Modes",
    "Dynamics",
    "Threads, reels, tethers",
    "Contact",
    "Rigid bodies",
    "Wrapped rib",
    "Relaxation and storage",
    "Inertia stand and identification",
)
HEAD = """# Validation book

Made by the tests themselves: every row was written by a test that passed. *Error* is the largest one that the test saw,
rounded up to one digit, *allowed* what it would have failed beyond; *order* is the fitted order of convergence, where
the test fits one. Errors are relative to the reference unless a unit is given; those of round-off are stated as below
1e-9, or as below what is allowed. In brackets after a case stand the formulation and the mesh; *limit* is what the two
finest meshes point to (Richardson), *kernel* a compiled law stepped by the test itself. `python3 start.py test`
measures all rows again; [the credibility statement](credibility.md) builds on them.
"""


class Book:
    """Checks an entry, and writes it where the book is kept."""

    def __init__(self, test: str) -> None:
        self.test = test

    def __call__(
        self,
        chapter: str,
        case: str,
        *,
        reference: str,
        source: str,
        error: float,
        allowed: float,
        unit: str = "",
        order: float | None = None,
        wanted: str = "",
    ) -> None:
        """One row.

        Parameters
        ----------
        chapter : str, one of `CHAPTERS`
        case, reference, source : str, what is computed, with what it is compared, and where that is from
        error, allowed : float, in `unit`, "" for relative ones
        order : float, fitted order of convergence; wanted : str, what it should be
        """
        assert chapter in CHAPTERS, chapter
        assert error <= allowed, f"{case}: error {error:.3g}, allowed {allowed:.3g} {unit}"
        entry: dict[str, Any] = {
            "chapter": chapter, "case": case, "reference": reference, "source": source, "error": float(error),
            "allowed": allowed, "unit": unit, "order": None if order is None else float(order), "wanted": wanted,
            "test": self.test,
        }  # fmt: skip
        folder = os.environ.get("EVOLVENT_BOOK")
        if folder:
            path = pathlib.Path(folder)
            path.mkdir(parents=True, exist_ok=True)
            # a second run into the same folder writes over the first one's
            name = hashlib.sha256("\n".join((self.test, chapter, case, reference)).encode()).hexdigest()[:32]
            (path / f"{name}.json").write_text(json.dumps(entry))


def rounded(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry as the table holds it: the error rounded up to one digit, and the order of convergence to two."""
    error = float(entry["error"])
    if error > ROUND_OFF:
        unit = 10.0 ** math.floor(math.log10(error))
        error = float(f"{math.ceil(error / unit * (1.0 - 1e-12)) * unit:.0e}")
    order = entry["order"]
    return entry | {
        "error": min(max(error, ROUND_OFF), entry["allowed"]),
        "order": None if order is None else round(order, 1),
    }


def agrees(entry: dict[str, Any], row: dict[str, Any]) -> bool:
    """Whether a fresh entry leaves its row as it is: the same statement, the error within a factor of three."""
    fresh = rounded(entry)
    if any(entry[name] != row[name] for name in STATED) or (fresh["order"] is None) is not (row["order"] is None):
        return False
    near = row["error"] / 3.0 <= fresh["error"] <= 3.0 * row["error"]
    return near and (fresh["order"] is None or abs(entry["order"] - row["order"]) < 0.15)


def key_of(entry: dict[str, Any]) -> tuple[str, ...]:
    """How an entry is found again."""
    return tuple(entry[name] for name in KEY)


def renewed(
    rows: list[dict[str, Any]], entries: list[dict[str, Any]], *, whole: bool = False
) -> tuple[list[dict[str, Any]], list[str]]:
    """The rows of the table with fresh entries, and what has changed, a sentence each.

    Parameters
    ----------
    whole : bool, whether whole tests have run, so that rows which they no longer enter are dropped; those of tests
        that are no longer there always are
    """
    old, new = {key_of(row): row for row in rows}, {key_of(entry): entry for entry in entries}
    known, ran = set(tests_with_rows()), {entry["test"] for entry in entries}
    found, changes = {}, []
    for key, row in old.items():
        if key in new or (row["test"] in known and not (whole and row["test"] in ran)):
            found[key] = row
        else:
            changes.append(f"gone: {row['case']} ({row['test']})")
    for key, entry in new.items():
        if key not in old:
            changes.append(f"new: {entry['case']} ({entry['test']})")
        elif not agrees(entry, old[key]):
            same = all(entry[name] == old[key][name] for name in STATED)
            what = f"{old[key]['error']:g} to {entry['error']:.2g}"
            changes.append(f"{'measured' if same else 'restated'}: {entry['case']} ({entry['test']}), {what}")
        else:
            continue
        found[key] = rounded(entry)
    order = {chapter: k for k, chapter in enumerate(CHAPTERS)}
    return sorted(found.values(), key=lambda row: (order[row["chapter"]], *_in_order(row), key_of(row))), changes


def test_folders() -> list[pathlib.Path]:
    """Folders of tests: of the core, and of each package."""
    return [ROOT / "tests", *sorted((ROOT / "packages").glob("*/tests"))]


def short_name(name: str) -> str:
    """Name of a test from its folder of tests on."""
    return re.sub(r"^(.*/)?tests/", "", name)


@functools.cache
def tests_with_rows() -> list[str]:
    """All tests that enter rows: those that ask for `book`."""
    found = []
    for path in sorted(path for folder in test_folders() for path in folder.rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if "book: Book" not in text and "book(" not in text:
            continue
        for node in ast.parse(text).body:
            if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
                continue
            if "book" in [argument.arg for argument in (*node.args.args, *node.args.kwonlyargs)]:
                found.append(f"{short_name(path.relative_to(ROOT).as_posix())}::{node.name}")
    return found


def shipped() -> list[dict[str, Any]]:
    """The rows of the table that is shipped."""
    found: list[dict[str, Any]] = json.loads(SHIPPED.read_text(encoding="utf-8")) if SHIPPED.exists() else []
    return found


def missing(rows: list[dict[str, Any]]) -> list[str]:
    """Tests that enter rows, of which the table has none."""
    return sorted(set(tests_with_rows()) - {row["test"] for row in rows})


def _in_order(entry: dict[str, Any]) -> tuple[list[tuple[float, str]], str]:
    """Cases by name, the numbers in them by size."""
    pieces = re.split(r"(\d+(?:\.\d+)?)", entry["case"])
    return [(float(x), "") if k % 2 else (0.0, x) for k, x in enumerate(pieces)], entry["test"]


def _error(row: dict[str, Any]) -> str:
    """The error of a row in words."""
    below = "< " if row["error"] <= ROUND_OFF else ""
    return f"{below}{row['error']:.2g}{' ' if row['unit'] else ''}{row['unit']}"


def table(rows: list[dict[str, Any]]) -> str:
    """The book, Markdown."""
    lines = [HEAD, f"{len(rows)} rows.\n"]
    lines += [f"Not measured: `{test}`.\n" for test in missing(rows)]
    for chapter in CHAPTERS:
        own = [row for row in rows if row["chapter"] == chapter]
        if not own:
            continue
        lines += [f"## {chapter}\n", "| case | reference | source | error | allowed | order | test |"]
        lines.append("|---|---|---|---|---|---|---|")
        for row in own:
            unit = f" {row['unit']}" if row["unit"] else ""
            order = (
                "" if row["order"] is None else f"{row['order']:.1f}" + (f" ({row['wanted']})" if row["wanted"] else "")
            )
            cells = [
                row["case"], row["reference"], row["source"], _error(row), f"{row['allowed']:.2g}{unit}", order,
                f"`{row['test']}`",
            ]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def read(folder: pathlib.Path) -> list[dict[str, Any]]:
    """All entries in a folder."""
    return [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]


def renew(folder: pathlib.Path, *, whole: bool = False) -> list[str]:
    """Enter what a folder holds into the table that is shipped; what has changed, a sentence each."""
    rows, changes = renewed(shipped(), read(folder), whole=whole)
    if changes:
        lines = ",\n".join(json.dumps(row, ensure_ascii=False, sort_keys=True) for row in rows)
        SHIPPED.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    return changes


def state() -> list[str]:
    """Write the statement that saved results carry; a sentence where it has changed."""
    from evolvent_papers.laboratory import credibility

    credibility.checks.cache_clear()
    text = f"{credibility.statement()}\n"
    if STATEMENT.exists() and STATEMENT.read_text(encoding="utf-8") == text:
        return []
    STATEMENT.write_text(text, encoding="utf-8")
    return ["new: the statement of credibility"]


def main(words: list[str]) -> int:
    """Renew the table that is shipped; 1 where rows are new, gone or restated, and not only measured again."""
    folders = [word for word in words if word != "--whole"]
    if len(folders) != 1:
        print("usage: python tests/book.py FOLDER [--whole]", file=sys.stderr)
        return 2
    changes = renew(pathlib.Path(folders[0]), whole="--whole" in words)
    changes += state()
    print("\n".join([*changes, f"{len(shipped())} rows in {SHIPPED.relative_to(ROOT)}, {len(changes)} changes"]))
    if all(text.startswith("measured") for text in changes):
        return 0
    print("the table was renewed; commit it")
    return 1


if __name__ == "__main__":
    answer = main(sys.argv[1:])
    subprocess.run([sys.executable, ROOT / "docs" / "_ext" / "made_pages.py"], check=True)  # that show the table
    sys.exit(answer)
