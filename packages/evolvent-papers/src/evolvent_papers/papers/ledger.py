"""Statements of the papers, each with the verdict that follows from our measured values, and the command that shows it.

The rows are data: `claims/PAPER.yaml` holds what the paper says, how we measure it and from which values it holds;
`claims/PAPER.json` holds the values as measured last, with their date; `evolvent claims PAPER --all -o` writes it.
"""

from __future__ import annotations

import dataclasses
import datetime
import functools
import importlib
import json
import math
import pathlib
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from typing import Any, Literal, get_args

from evolvent import cases
from evolvent.assembly import expressions
from evolvent_base import __version__, files
from evolvent_base.errors import InputError, nearest
from evolvent_papers import papers

Verdict = Literal["holds", "in part", "refuted", "open"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
#: How we know what the paper states: its text is legible; a formula or number is lost and reconstructed by us; or the
#: statement is a finding of ours that the paper does not make, which is counted apart.
Source = Literal["read", "reconstructed", "own"]
SOURCES: tuple[Source, ...] = get_args(Source)

FOLDER = pathlib.Path(__file__).with_name("claims")
#: CPU time, s, up to which the tests measure a claim again.
QUICK = 3


@dataclasses.dataclass(frozen=True)
class Measurement:
    """Values of a claim as measured once.

    Attributes
    ----------
    values : mapping, key -> number
    date : str, "2026-11-24"
    version : str, of evolvent
    seconds : float, CPU time
    """

    values: Mapping[str, float]
    date: str
    version: str
    seconds: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Claim:
    """One statement, figure or table of a paper.

    Attributes
    ----------
    name : str, unique, starts with the paper's short name ("thread-eq-18")
    where : str, its location in the paper ("section IV, eq. (18)"); of a finding of ours "not in the paper", which may
        be followed by what it stands beside ("not in the paper, beside figure 5")
    claim : str, what the paper says, in our words, one sentence
    source : how we know what the paper says
    paper : str, the paper's number; "" where it gives none
    ours : str, what we find, one or two sentences; "{key}" and "{key:.2f}" stand for measured values
    measure : str, module and function of `evolvent_papers.papers` that measures the values; "" for none
    holds : tuple of str, comparisons of measured values; the claim holds where all are true
    in_part : tuple of str, the same for "in part", where it does not hold; where these are not true either it is
        refuted
    undecided : str, why the claim is open, in place of comparisons
    limits : tuple of str, reasons of the numbers in the comparisons, one sentence each
    absent : str, what of the claim evolvent cannot show, "" where that is nothing; it stands behind the finding, and is
        looked at again when a kind of part or a case is added, as a row that is open is
    tolerance : float, relative difference up to which a new measurement agrees with the stored values; or one per key
    negligible : float, difference that always agrees: of round-off, or of adaptive steps
    seconds : int, CPU time of the measurement with compiled kernels; tests run those of at most `QUICK`
    command : str, a command that shows the claim; "" for `evolvent claims NAME`
    measured : values as measured last, None where nothing is measured
    """

    name: str
    where: str
    claim: str
    source: Source
    paper: str = ""
    ours: str
    measure: str = ""
    holds: tuple[str, ...] = ()
    in_part: tuple[str, ...] = ()
    undecided: str = ""
    limits: tuple[str, ...] = ()
    absent: str = ""
    tolerance: float | Mapping[str, float] = 0.01
    negligible: float = 1e-9
    seconds: int = 1
    command: str = ""
    measured: Measurement | None = None

    @property
    def values(self) -> Mapping[str, float]:
        """The values as measured last."""
        return {} if self.measured is None else self.measured.values

    @property
    def rule(self) -> str:
        """From which comparisons the verdict follows, one sentence; "" where nothing is compared."""
        found = [
            f"{verdict.capitalize()} where {' and '.join(texts)}"
            for verdict, texts in (("holds", self.holds), ("in part", self.in_part))
            if texts
        ]
        return "; ".join(found[:1] + [one[0].lower() + one[1:] for one in found[1:]]) + "." if found else ""

    @property
    def shown_by(self) -> str:
        """The command that shows the claim."""
        return self.command or f"evolvent claims {self.name}"

    @property
    def needed(self) -> set[str]:
        """Names of the measured values that the comparisons use."""
        known = {*expressions.FUNCTIONS, *expressions.CONSTANTS}
        return {name for text in (*self.holds, *self.in_part) for name in expressions.names(text)} - known

    def verdict(self, values: Mapping[str, float] | None = None) -> Verdict:
        """Whether the claim holds, by the stored values or by `values`; open where a value is missing."""
        values = self.values if values is None else values
        if self.undecided or not self.needed <= values.keys():
            return "open"
        for verdict, comparisons in (("holds", self.holds), ("in part", self.in_part)):
            if comparisons and all(expressions.is_true(text, values) for text in comparisons):
                return verdict  # type: ignore[return-value]
        return "refuted"

    def text(self, values: Mapping[str, float] | None = None) -> str:
        """Our finding, with the stored values or with `values`."""
        found: dict[str, float] = defaultdict(lambda: math.nan, self.values if values is None else values)
        return " ".join(filter(None, (self.ours.format_map(found), self.absent)))

    @property
    def to_review(self) -> bool:
        """Whether a new kind of part or a new case can make the row false."""
        return bool(self.absent) or self.verdict() == "open"

    def run(self) -> Measurement:
        """Measure the values again."""
        module, _, function = self.measure.partition(".")
        began = time.process_time()
        values = getattr(importlib.import_module(f"evolvent_papers.papers.{module}"), function)()
        seconds = round(time.process_time() - began, 1)
        found = {key: float(f"{value:.6g}") for key, value in values.items()}
        return Measurement(found, datetime.datetime.now(tz=datetime.UTC).date().isoformat(), __version__, seconds)

    def allowed(self, key: str) -> float:
        """Difference up to which a value agrees with the stored one."""
        share = self.tolerance if isinstance(self.tolerance, int | float) else self.tolerance.get(key, 0.01)
        return max(share * abs(self.values[key]), self.negligible)

    def differences(self, values: Mapping[str, float]) -> list[str]:
        """What of a new measurement does not agree with the stored one, a sentence each."""
        if values.keys() != self.values.keys():
            return [f"measured are {', '.join(values)}, stored are {', '.join(self.values)}"]
        found = [
            f"{key} is {values[key]:.6g}, stored is {stored:.6g} (allowed {self.allowed(key):g})"
            for key, stored in self.values.items()
            if not abs(values[key] - stored) <= self.allowed(key)
        ]
        if self.verdict(values) != self.verdict():
            found.append(f"the verdict is {self.verdict(values)!r}, stored is {self.verdict()!r}")
        return found


def read(path: str | pathlib.Path) -> dict[str, Measurement]:
    """Measurements in a file, by the name of the claim; none where there is no file.

    Raises
    ------
    InputError
        If the file does not hold measurements of claims.
    """
    path = pathlib.Path(path)
    if not path.exists():
        return {}
    try:
        found = {name: Measurement(**one) for name, one in json.loads(path.read_text(encoding="utf-8")).items()}
        if not all(isinstance(value, int | float) for one in found.values() for value in one.values.values()):
            raise ValueError
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{str(path)!r} exists and holds no measurements of claims; give another file") from None
    return found


@functools.cache
def claims(paper: str) -> tuple[Claim, ...]:
    """The claims of a paper by its short name.

    Raises
    ------
    InputError
        If there is no such paper.
    """
    measured = read(FOLDER / f"{paper}.json")
    content = _content(paper)
    return tuple(_claim(row, content["limits"], measured.get(row["name"])) for row in content["claims"])


def places(paper: str) -> dict[str, set[str]]:
    """What the paper numbers ("section", "figure", "table", "eq", ...), and the numbers."""
    return {kind: {str(number) for number in numbers} for kind, numbers in _content(paper)["places"].items()}


def shared_limits(paper: str) -> dict[str, str]:
    """Reasons of limits that several rows of a paper share, by their names."""
    return dict(_content(paper)["limits"])


@functools.cache
def _content(paper: str) -> dict[str, Any]:
    if paper not in papers.CLAIMS_OF:
        raise InputError(f"no paper is called {paper!r}; {nearest(paper, papers.CLAIMS_OF)}")
    found: dict[str, Any] = cases.parse_yaml((FOLDER / f"{paper}.yaml").read_text(encoding="utf-8"), f"{paper}.yaml")
    return found


def _claim(row: dict[str, Any], shared: Mapping[str, str], measured: Measurement | None) -> Claim:
    """The claim of a row, whose limits are sentences, or names of those that rows share."""
    lists: dict[str, Any] = {key: tuple(row[key]) for key in ("holds", "in_part") if key in row}
    limits = tuple(shared.get(text, text) for text in row.get("limits", ()))
    return Claim(**row | lists | {"limits": limits}, measured=measured)


def every() -> list[Claim]:
    """The claims of all papers."""
    return [one for paper in papers.CLAIMS_OF for one in claims(paper)]


def claim(name: str) -> Claim:
    """The claim of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    known = {one.name: one for one in every()}
    if name not in known:
        raise InputError(f"no claim is called {name!r}; {nearest(name, [*papers.CLAIMS_OF, *known])}")
    return known[name]


def keep(measured: Mapping[str, Measurement], path: str | pathlib.Path) -> None:
    """Write measurements to a file, beside those of other claims that it holds."""
    found = read(path) | dict(measured)
    kept = {one.name: dataclasses.asdict(found[one.name]) for one in every() if one.name in found}
    files.write_file(path, json.dumps(kept, indent=1) + "\n")


def counts(found: Iterable[Claim]) -> str:
    """How many statements of the paper and findings of ours there are, by verdict, one sentence."""
    every = list(found)
    groups = {
        "statements": [one for one in every if one.source != "own"],
        "own findings": [one for one in every if one.source == "own"],
    }
    sentences = []
    for what, group in groups.items():
        number = Counter(one.verdict() for one in group)
        parts = [f"{number[verdict]} {verdict}" for verdict in VERDICTS if number[verdict]]
        what = what[:-1] if len(group) == 1 else what
        sentences.append(f"{len(group)} {what}" + (f": {', '.join(parts)}" if parts else ""))
    return "; ".join(sentences)


def markdown(paper: str) -> str:
    """The ledger of a paper as Markdown: the counts, a table of its statements, and a table of our own findings."""
    lines = [f"{counts(claims(paper))}."]
    for title, own in (("Statements of the paper", False), ("Own findings", True)):
        found = [one for one in claims(paper) if (one.source == "own") == own]
        head = ["where", "claim" if own else "the paper says", *([] if own else ["source"]), "verdict"]
        head += ["our result", "measured", "command"] if own else ["paper", "our result", "measured", "command"]
        rows = [
            [
                one.where,
                one.claim,
                *([] if own else [one.source]),
                one.verdict(),
                *([] if own else [one.paper or "no number"]),
                " ".join(filter(None, (one.text(), one.undecided, one.rule, *one.limits))),
                one.measured.date if one.measured else "",
                f"`{one.shown_by}`",
            ]
            for one in found
        ]
        if found:
            lines += ["", f"**{title}**", "", _row(head), "|" + "---|" * len(head), *map(_row, rows)]
    return "\n".join(lines)


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
