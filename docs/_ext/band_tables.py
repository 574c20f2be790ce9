"""Tables of the laboratory's pages that follow from what sets state and from their stored verdicts.

In a page they stand between the lines `<!-- bands of SET -->` or `<!-- coverage -->` and `<!-- end -->`.
"""

from __future__ import annotations

import json
import pathlib
import re

from evolvent_papers import laboratory
from evolvent_papers.laboratory import credibility

BLOCK = re.compile(r"(<!-- (bands of (?P<set>\S+)|coverage) -->\n).*?(<!-- end -->)", re.DOTALL)


def renewed(text: str) -> str:
    """A page with its tables as they follow now."""

    def one(found: re.Match[str]) -> str:
        made = coverage() if found["set"] is None else bands(found["set"])
        return f"{found[1]}{made}\n{found[4]}"

    return BLOCK.sub(one, text)


def sets_in(text: str) -> list[str]:
    """Sets whose bands a page states."""
    return [found["set"] for found in BLOCK.finditer(text) if found["set"] is not None]


def pages(folder: pathlib.Path) -> dict[pathlib.Path, str]:
    """Pages with such tables, renewed."""
    files = [*sorted((folder / "laboratory").glob("*.md")), folder / "guide" / "laboratory.md"]
    return {path: renewed(path.read_text(encoding="utf-8")) for path in files}


def bands(name: str) -> str:
    """What the bands of a set contain, with shares in those of the stored verdict."""
    of, path = laboratory.found(name), credibility.DATA / "verdicts" / f"{name}.json"
    if of.budget is None:
        raise ValueError(f"{name} does not say what its bands contain")
    stored = json.loads(path.read_text(encoding="utf-8"))["comparisons"] if path.exists() else []
    parts = [row["uncertainty"]["contributions"] for row in stored]
    rows = of.budget.rows(of.Settings(), [of.budget.band(one) for one in parts if one])
    heads = ("a band contains", "as", "standard uncertainty", "source", "share of its square, %")
    return "\n".join([*_table(heads, rows), "", f"{of.budget.text[0].upper()}{of.budget.text[1:]}."])


def coverage() -> str:
    """Sets with their goals, coverage and when their bands were fixed, and the counts over all."""
    sets = credibility.compared()
    rows = [(one.name, *_counted([one]), one.marked) for one in sets]
    rows += [("all", *_counted(sets), ""), ("bands fixed before", *_counted([one for one in sets if one.blind]), "")]
    return "\n".join(_table(("set", "goals met", "within the bands", "%", "bands"), rows))


def _counted(sets: list[credibility.Compared]) -> tuple[str, str, str]:
    met, goals, within, count = (
        sum(getattr(one, key) for one in sets) for key in ("met", "goals", "within", "differences")
    )
    return f"{met} of {goals}", f"{within} of {count}", f"{100.0 * within / count:.0f}" if count else "-"


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    lines = ["| " + " | ".join(row) + " |" for row in (heads, *rows)]
    return [lines[0], "|" + len(heads) * "---|", *lines[1:]]
