"""Verdicts that are stored with the package; release tests compute them again."""

from __future__ import annotations

import json
import math

from evolvent_base import answer as an
from evolvent_papers.laboratory import credibility
from evolvent_papers.laboratory.book import Band, Comparison, Verdict


def stored(name: str) -> Verdict:
    """Verdict of a set as `evolvent validate NAME -o` has written it into the package."""
    held = json.loads((credibility.DATA / "verdicts" / f"{name}.json").read_text(encoding="utf-8"))
    found = []
    for one in held["comparisons"]:
        numbers = {key: math.nan if one[key] is None else one[key] for key in ("predicted", "measured", "allowed")}
        parts = {key: one["uncertainty"][key] for key in ("measurement", "parameters", "numerics", "how")}
        found.append(Comparison(what=one["what"], unit=one["unit"], goal=one["goal"], band=Band(**parts), **numbers))
    tables = [
        an.Table(title=one["title"], heads=tuple(one["heads"]), rows=[tuple(row) for row in one["rows"]])
        for one in held.get("tables", ())
    ]
    return Verdict(comparisons=tuple(found), figures=(), notes=tuple(held["notes"]), tables=tuple(tables))
