"""Claims of a paper, each with a verdict, the paper's number, ours, and the command that computes ours again."""

from __future__ import annotations

import dataclasses
import importlib
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Literal, get_args

from evolvent import papers
from evolvent.errors import InputError, nearest

Verdict = Literal["holds", "in part", "refuted", "open"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim, figure or table of a paper.

    Attributes
    ----------
    name : str, unique, starts with the paper's short name ("thread-eq-18")
    where : str, its location in the paper ("eq. (18)", "figure IV.3")
    claim : str, what the paper says, in our words, one sentence
    verdict : whether it holds
    paper : str, the paper's number; "" where it gives none
    ours : str, what we find, one or two sentences; "{key}" and "{key:.2f}" stand for `values`
    values : mapping, key -> our number, as measured
    tolerance : float, relative difference at which a new measurement no longer agrees with `values`; or one per key
    measure : function that computes `values` again; None where nothing is computed
    seconds : int, CPU time of `measure` with compiled kernels; tests run those of at most `QUICK`
    command : str, a command that shows the claim; "" for `evolvent claims NAME`
    """

    name: str
    where: str
    claim: str
    verdict: Verdict
    paper: str = ""
    ours: str
    values: Mapping[str, float] = dataclasses.field(default_factory=dict)
    tolerance: float | Mapping[str, float] = 0.01
    measure: Callable[[], Mapping[str, float]] | None = None
    seconds: int = 1
    command: str = ""

    @property
    def shown_by(self) -> str:
        """The command that shows the claim."""
        return self.command or f"evolvent claims {self.name}"

    def text(self, values: Mapping[str, float] | None = None) -> str:
        """Our finding, with the stored numbers or with `values`."""
        return self.ours.format(**(self.values if values is None else values))

    def differences(self, values: Mapping[str, float]) -> list[str]:
        """Numbers of a new measurement that do not agree with the stored ones, a sentence each."""
        found = []
        if values.keys() != self.values.keys():
            found.append(f"measured are {', '.join(values)}, stored are {', '.join(self.values)}")
        for key in self.values.keys() & values.keys():
            allowed = self.tolerance if isinstance(self.tolerance, int | float) else self.tolerance.get(key, 0.01)
            if not math.isclose(values[key], self.values[key], rel_tol=allowed):
                found.append(f"{key} is {values[key]:.6g}, stored is {self.values[key]:.6g} (allowed {allowed:g})")
        return found


#: CPU time, s, up to which the tests measure a claim again.
QUICK = 3


def claims(paper: str) -> tuple[Claim, ...]:
    """The claims of a paper by its short name.

    Raises
    ------
    InputError
        If there is no such paper.
    """
    if paper not in papers.CLAIMS_OF:
        raise InputError(f"no paper is called {paper!r}; {nearest(paper, papers.CLAIMS_OF)}")
    module = importlib.import_module(f"evolvent.papers.{papers.CLAIMS_OF[paper][1]}")
    found: tuple[Claim, ...] = module.CLAIMS
    return found


def claim(name: str) -> Claim:
    """The claim of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    known = {one.name: one for paper in papers.CLAIMS_OF for one in claims(paper)}
    if name not in known:
        raise InputError(f"no claim is called {name!r}; {nearest(name, [*papers.CLAIMS_OF, *known])}")
    return known[name]


def counts(found: Iterable[Claim]) -> str:
    """How many claims there are, by verdict, one sentence."""
    number = Counter(one.verdict for one in found)
    return f"{number.total()} claims: " + ", ".join(f"{number[verdict]} {verdict}" for verdict in VERDICTS)


def markdown(paper: str) -> str:
    """The ledger of a paper as a Markdown table, with the counts above it."""
    found = claims(paper)
    head = "| where | claim | verdict | paper | our result | command |"
    rows = [
        [one.where, one.claim, one.verdict, one.paper or "no number", one.text(), f"`{one.shown_by}`"] for one in found
    ]
    table = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join([f"{counts(found)}.", "", head, "|---|---|---|---|---|---|", *table])
