"""The validation book: what tests find against references, and the table made of it.

A test asks for the fixture `book` and calls it with what it has found; the call fails where the error is too large, so
that an entry and a passed test are the same thing. With $EVOLVENT_BOOK=FOLDER every entry is also written there, and

    python tests/book.py FOLDER TABLE.md

makes the table.
"""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
import re
import sys
from typing import Any

#: Chapters, in the order of the table.
CHAPTERS = (
    "Statics of beams",
    "Modes",
    "Dynamics",
    "Threads, reels, tethers",
    "Contact",
    "Rigid bodies",
    "Wrapped rib",
    "Inertia stand and identification",
)
HEAD = """# Validation book

Made by the tests themselves: every row was written by a test that passed. *Error* is the largest one that the test saw,
*allowed* what it would have failed beyond; *order* is the fitted order of convergence, where the test fits one. Errors
are relative to the reference unless a unit is given. In brackets after a case stand the formulation and the mesh;
*limit* is what the two finest meshes point to (Richardson), *kernel* a compiled law stepped by the test itself.
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


def _in_order(entry: dict[str, Any]) -> tuple[list[tuple[float, str]], str]:
    """Cases by name, the numbers in them by size."""
    pieces = re.split(r"(\d+(?:\.\d+)?)", entry["case"])
    return [(float(x), "") if k % 2 else (0.0, x) for k, x in enumerate(pieces)], entry["test"]


def table(entries: list[dict[str, Any]]) -> str:
    """The book, Markdown."""
    lines = [HEAD, f"{len(entries)} entries.\n"]
    for chapter in CHAPTERS:
        rows = sorted((e for e in entries if e["chapter"] == chapter), key=_in_order)
        if not rows:
            continue
        lines += [f"## {chapter}\n", "| case | reference | source | error | allowed | order | passed | test |"]
        lines.append("|---|---|---|---|---|---|---|---|")
        for e in rows:
            unit = f" {e['unit']}" if e["unit"] else ""
            order = "" if e["order"] is None else f"{e['order']:.2f}" + (f" ({e['wanted']})" if e["wanted"] else "")
            cells = [
                e["case"], e["reference"], e["source"], f"{e['error']:.2g}{unit}", f"{e['allowed']:.2g}{unit}", order,
                "yes", f"`{e['test']}`",
            ]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def read(folder: pathlib.Path) -> list[dict[str, Any]]:
    """All entries in a folder."""
    return [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python tests/book.py FOLDER TABLE.md")
    found = read(pathlib.Path(sys.argv[1]))
    pathlib.Path(sys.argv[2]).write_text(table(found))
    print(f"{len(found)} entries in {sys.argv[2]}")
