"""Credibility of the package after NASA-STD-7009B: a level for each factor, with the evidence that it rests on.

Evidence is what is shipped: the rows of the validation book (`data/checks.json`, written by the tests) and the verdicts
of the laboratory book (`data/verdicts/`, written by ``evolvent validate SET -o``). The levels follow from them by rules
that stand here; they are an own assessment.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import pathlib
from collections import Counter
from typing import Any

from evolvent_papers import laboratory

DATA = pathlib.Path(__file__).parent / "data"
#: A set counts as validated where its goals are met and this share of its differences is within their bands.
WITHIN = 0.9
#: Sets that count, from which on validation is claimed at level 2.
FEWEST_SETS = 2
#: Rows of every chapter and rows with an order of convergence, from which on verification is claimed at level 3.
FEWEST_ROWS, FEWEST_ORDERS = 20, 50
OPEN = "not claimed: it belongs to each use of a result"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Factor:
    """A factor of credibility.

    Attributes
    ----------
    name : str
    level : int, claimed, 0 (no evidence) to 4
    why : str, what it rests on, Markdown
    missing : str, what the next level would need
    """

    name: str
    level: int
    why: str
    missing: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Compared:
    """What the stored verdict of a set says.

    Attributes
    ----------
    name, title : str
    goals, met : int, comparisons with a goal, and those that meet it
    differences, within : int, comparisons with a measurement, and those within their bands of 95 %
    stored : bool, whether there is a verdict
    blind : bool, whether its bands were fixed before the comparison, or new measurements have decided since
    marked : str, when its bands were fixed
    """

    name: str
    title: str
    goals: int = 0
    met: int = 0
    differences: int = 0
    within: int = 0
    stored: bool = False
    blind: bool = True
    marked: str = ""

    @property
    def validated(self) -> bool:
        """Whether all goals are met, and nearly all differences are within bands that were not widened for them."""
        covered = self.blind and 0 < self.differences and self.within >= WITHIN * self.differences
        return covered and self.met == self.goals

    @property
    def text(self) -> str:
        """The verdict in words."""
        if not self.stored:
            return "no verdict is stored"
        goals = f"{self.met} of {self.goals} goals are met; " if self.goals else ""
        return f"{goals}{self.within} of {self.differences} differences are within their bands of 95 %"


@functools.cache
def checks() -> tuple[dict[str, Any], ...]:
    """The rows of the validation book."""
    return tuple(json.loads((DATA / "checks.json").read_text(encoding="utf-8")))


def compared() -> list[Compared]:
    """All sets of the laboratory book with their stored verdicts."""
    return [_compared(name) for name in laboratory.SETS]


def _compared(name: str) -> Compared:
    path, of = DATA / "verdicts" / f"{name}.json", laboratory.found(name)
    stated: dict[str, Any] = {"name": name, "title": of.title, "blind": of.blind, "marked": of.marked}
    if not path.exists():
        return Compared(**stated)
    rows = json.loads(path.read_text(encoding="utf-8"))["comparisons"]
    measured = [row for row in rows if row["measured"] is not None]
    goals = [row for row in measured if row["allowed"] is not None]
    return Compared(
        **stated, goals=len(goals), met=sum(bool(row["meets"]) for row in goals),
        differences=len(measured), within=sum(bool(row["covered"]) for row in measured), stored=True,
    )  # fmt: skip


def verification_level(rows: tuple[dict[str, Any], ...]) -> int:
    """3 where all chapters have rows enough, and many have an order of convergence; 2 with rows, 0 without."""
    chapters = Counter(row["chapter"] for row in rows)
    orders = sum(row["order"] is not None for row in rows)
    enough = bool(rows) and min(chapters.values()) >= FEWEST_ROWS and orders >= FEWEST_ORDERS
    return 3 if enough else 2 if rows else 0


def validation_level(sets: list[Compared]) -> int:
    """2 where sets enough are validated, 1 where any is compared, 0 without."""
    if sum(one.validated for one in sets) >= FEWEST_SETS:
        return 2
    return int(any(one.stored for one in sets))


def factors() -> list[Factor]:
    """The factors of the capability of the package, then those of the results of a run."""
    rows, sets = checks(), compared()
    tests, orders = len({row["test"] for row in rows}), sum(row["order"] is not None for row in rows)
    validated = [one.name for one in sets if one.validated]
    return [
        Factor(
            name="Data pedigree", level=2,
            why="each built-in case, each material and each set of measurements names its source, with its licence "
            f"(`PROVENANCE.md`); uncertainties are stated for the {len(sets)} sets of [the laboratory book]"
            "(guide/laboratory.md)",
            missing="uncertainties of the data of all built-in cases",
        ),
        Factor(
            name="Verification", level=verification_level(rows),
            why=f"{len(rows)} comparisons by {tests} tests with closed forms, published results and other programs, "
            f"{orders} of them with a fitted order of convergence ([the validation book](validation.md)); every run "
            "closes its energy balance or says by how much it does not",
            missing="an estimate of the numerical error of every result, and a team of its own that verifies",
        ),
        Factor(
            name="Validation", level=validation_level(sets),
            why=f"{sum(one.stored for one in sets)} sets of measurements are predicted and compared; all goals, with "
            f"{100 * WITHIN:.0f} % of the differences within bands that were fixed before, are met by "
            f"{', '.join(validated) or 'none'}",
            missing=f"{FEWEST_SETS} such sets; and then measured deployments of flight hardware, predicted beforehand",
        ),
        Factor(
            name="Technical review of the development", level=0, why="no review by others is recorded",
            missing="a recorded review by peers",
        ),
        Factor(
            name="Management of the development", level=2,
            why="all changes are under version control, with a changelog; tests, types and layers are checked as a "
            "whole before a release (`CONTRIBUTING.md`)",
            missing="measured quality of the process, audited by others",
        ),
        Factor(
            name="Assessment of the use", level=0, why=f"{OPEN}; [what is modelled](scope.md) states the limits",
            missing="a comparison of the intended use with what is validated",
        ),
        Factor(
            name="Input pedigree", level=0,
            why=f"{OPEN}; a result keeps its whole case, with units", missing="sources and uncertainties of its inputs",
        ),
        Factor(
            name="Uncertainty characterization", level=0,
            why=f"{OPEN}; [dispersions](guide/dispersions.md) draw inputs and bound results",
            missing="dispersed runs with justified distributions",
        ),
        Factor(
            name="Results robustness", level=0,
            why=f"{OPEN}; [sensitivities](guide/sensitivities.md) of a run are computed exactly",
            missing="the sensitivities of the result to the inputs that matter",
        ),
        Factor(
            name="Technical review of the use", level=0, why=OPEN, missing="a recorded review by peers",
        ),
        Factor(
            name="Management of the use", level=1,
            why="a saved result has its case, version, packages, processor and date, and a digest by which changes "
            "show", missing="a controlled procedure by which results are made and released",
        ),
    ]  # fmt: skip


#: Factors of the capability of the package; the others belong to the results of a run.
CAPABILITY = 5


def statement() -> str:
    """What saved results carry: what was verified and validated, and the levels, in one line."""
    rows, sets = checks(), compared()
    own = ", ".join(f"{one.name.lower()} {one.level}" for one in factors()[:CAPABILITY])
    stored = [one for one in sets if one.stored]
    goals, met = (sum(getattr(one, key) for one in stored) for key in ("goals", "met"))
    return (
        f"solver verified by {len(rows)} comparisons of {len({row['test'] for row in rows})} tests; predictions "
        f"compared with {len(stored)} sets of measurements ({', '.join(one.name for one in stored)}), {met} of {goals} "
        f"goals met; capability by the factors of NASA-STD-7009B, own assessment, 0 to 4: {own}; the factors of the "
        f"result itself are for its user to assess"
    )


def page() -> str:
    """The page of the documentation, Markdown."""
    lines = [
        "# Credibility",
        "",
        "What supports the results of the package, by the factors of NASA-STD-7009B (2024): those of its capability, "
        "and those of each result. The names of the factors follow the standard. The levels, from 0 for no evidence to "
        "4, are an own assessment, which nobody else has reviewed. The levels of verification and validation follow "
        "from the evidence below by the rules at the end. The page is made from what is shipped.",
        "",
        "Saved results carry the statement in their attribute `credibility`:",
        "",
        f"> {statement()}",
        "",
    ]
    for title, part in (("Capability", factors()[:CAPABILITY]), ("Results", factors()[CAPABILITY:])):
        lines += [f"## {title}", "", "| factor | level | why | the next level would need |", "|---|---|---|---|"]
        lines += [f"| {one.name} | {one.level} | {one.why} | {one.missing} |" for one in part]
        lines.append("")
    lines += ["## Evidence of verification", "", "| chapter | comparisons | with an order | median of error/allowed |"]
    lines.append("|---|---|---|---|")
    for chapter, count in Counter(row["chapter"] for row in checks()).items():
        own = [row for row in checks() if row["chapter"] == chapter]
        ratios = sorted(row["error"] / row["allowed"] for row in own)
        anchor = "".join(letter for letter in chapter.lower().replace(" ", "-") if letter.isalnum() or letter == "-")
        orders = sum(row["order"] is not None for row in own)
        median = ratios[len(ratios) // 2]
        shown = f"{median:.{max(0, -math.floor(math.log10(median)))}f}"
        lines.append(f"| [{chapter}](validation.md#{anchor}) | {count} | {orders} | {shown} |")
    lines += ["", "## Evidence of validation", "", "| set | | verdict | bands | counts |", "|---|---|---|---|---|"]
    for one in compared():
        counts = "yes" if one.validated else "no"
        lines.append(f"| [`{one.name}`](guide/laboratory.md) | {one.title} | {one.text} | {one.marked} | {counts} |")
    lines += [
        "",
        f"A set counts where all its goals are met and {100 * WITHIN:.0f} % of its differences are within bands that "
        "were fixed before the comparison; a set whose bands were widened counts when new measurements have decided. "
        f"Validation is claimed at level 1 where any set is compared, at level 2 from {FEWEST_SETS} sets that count. "
        f"Verification is claimed at level 3 where every chapter has {FEWEST_ROWS} comparisons or more, and "
        f"{FEWEST_ORDERS} or more have an order of convergence.",
        "",
    ]
    return "\n".join(lines)
