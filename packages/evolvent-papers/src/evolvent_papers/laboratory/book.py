"""Predictions of measured quantities: what was predicted with which band, what was measured, and the verdict."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent_base import answer as an
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure
from evolvent_base.schema import Section
from evolvent_base.showing import Shown
from evolvent_papers.laboratory.bands import COVERED, Band as Band, Budget as Budget, Contribution as Contribution

Array = np.ndarray
#: Smallest eigenvalue of a fit's normal matrix over the largest, below which the data say nothing of a direction.
LEAST = 1e-10


@dataclasses.dataclass(frozen=True, kw_only=True)
class Comparison:
    """One predicted quantity beside the measured one.

    Attributes
    ----------
    what : str
    unit : str
    predicted, measured : float; of a record, the root mean square of the difference and 0; measured is NaN where
        nothing is
    band : Band
    allowed : float, largest difference by which the goal is met; NaN without a goal
    goal : str, the goal in words
    """

    what: str
    unit: str
    predicted: float
    measured: float
    band: Band
    allowed: float = math.nan
    goal: str = ""

    @property
    def difference(self) -> float:
        """Predicted less measured."""
        return self.predicted - self.measured

    @property
    def compared(self) -> bool:
        """Whether there is a measurement: without one the prediction stands alone, with its band."""
        return math.isfinite(self.measured)

    @property
    def covered(self) -> bool:
        """Whether the difference lies within the band."""
        return bool(abs(self.difference) <= self.band.half_width)

    @property
    def meets(self) -> bool:
        """Whether the goal is met; True without one, and without a measurement."""
        return not (self.compared and math.isfinite(self.allowed)) or abs(self.difference) <= self.allowed


class NoSettings(Section):
    """Of a set without keys."""


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Verdict(Shown):
    """What a set says.

    Attributes
    ----------
    comparisons : tuple of Comparison
    figures : tuple of Figure
    notes : tuple of str, sentences on what was done and what a reader must know
    tables : tuple of evolvent_base.answer.Table, of what the differences say
    of : Set, to which it belongs; set by `Set.validate`, None before
    settings : Section, by which it was found; set by `Set.validate`
    """

    comparisons: tuple[Comparison, ...]
    figures: tuple[Figure, ...]
    notes: tuple[str, ...] = ()
    tables: tuple[an.Table, ...] = ()
    of: Set | None = None
    settings: Section = dataclasses.field(default_factory=NoSettings)

    named, endings = "verdicts", (".json",)

    def answer(self) -> an.Answer:
        """The comparisons, a row each, figures, notes, and a file."""
        title = "Set of measurements" if self.of is None else self.of.title
        stated = []
        if self.budget is not None:
            stated.append(an.Section(title="Bands", blocks=[self.budget_table(), self.budget.text]))
        return an.Answer(
            title=title, sections=[*stated, an.Section(title="", blocks=[table(self), *self.tables, *self.figures])],
            notes=[*self.notes, self.text], files={"verdict.json": lambda: an.as_json(content(self))},
        )  # fmt: skip

    @property
    def budget(self) -> Budget | None:
        """What the bands contain."""
        return None if self.of is None else self.of.budget

    def budget_table(self) -> an.Table:
        """Contributions to the bands, a row each, with their shares of the variance."""
        assert self.budget is not None
        rows = self.budget.rows(self.settings, [one.band for one in self.comparisons])
        heads = ("a band contains", "as", "standard uncertainty", "source", "share of its square, %")
        return an.Table(heads=heads, rows=rows, words=4)

    @property
    def missed(self) -> list[Comparison]:
        """Comparisons that do not meet their goals."""
        return [one for one in self.comparisons if not one.meets]

    @property
    def missed_goals(self) -> list[str]:
        """What does not meet its goal, in words."""
        return [one.what for one in self.missed]

    @property
    def goals(self) -> tuple[int, int]:
        """Goals that are met, and all of them."""
        count = sum(one.compared and math.isfinite(one.allowed) for one in self.comparisons)
        return count - len(self.missed), count

    @property
    def coverage(self) -> tuple[int, int]:
        """Comparisons within their bands, and all of them; not those without a measurement."""
        return sum(one.covered for one in self.comparisons), sum(one.compared for one in self.comparisons)

    @property
    def text(self) -> str:
        """The verdict in one sentence."""
        return sentence(self.goals, self.coverage)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Set:
    """A set of measurements.

    Attributes
    ----------
    name, title : str
    source : str, where the measurements are from, with their licence
    Settings : class of the keys that `--set` changes
    run : function of the settings, and of a folder or file with measurements of the same form (None for those of the
        package), to the verdict
    needs : str, where measurements that the package does not hold are published; empty where it holds them
    budget : Budget, what the bands contain, of every set of the package
    """

    name: str
    title: str
    source: str
    Settings: type[Section]
    run: Callable[[Any, str | None], Verdict]
    needs: str = ""
    budget: Budget | None = None

    @property
    def blind(self) -> bool:
        """Whether the coverage of its bands is a test."""
        return self.budget is not None and self.budget.blind

    @property
    def marked(self) -> str:
        """When its bands were fixed, in few words."""
        return "not stated" if self.budget is None else self.budget.marked

    def validate(self, overrides: Mapping[str, Any] | None = None, data: str | None = None) -> Verdict:
        """Predict and compare.

        Parameters
        ----------
        overrides : mapping, keys of the settings
        data : str, folder or file with measurements of the same form

        Raises
        ------
        InputError
            For keys and files that cannot be used, and where the measurements are missing.
        """
        try:
            settings = self.Settings(**dict(overrides or {}))
        except InputError as error:
            raise InputError(str(error).replace(f"{self.Settings.__name__}.", "")) from None
        if self.needs and data is None:
            raise InputError(f"{self.name} needs --data FOLDER: {self.needs}")
        found = dataclasses.replace(self.run(settings, data), of=self, settings=settings)
        unstated = [] if self.budget is None else self.budget.unstated([one.band for one in found.comparisons])
        if unstated:
            named = ", ".join(unstated)
            raise ValueError(f"{self.name}: the budget does not state what bands contain as {named}")
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class Verdicts(Shown):
    """What several sets say.

    Attributes
    ----------
    found : mapping, Set -> Verdict, None of one without measurements
    """

    found: Mapping[Set, Verdict | None]

    named, endings = "verdicts", (".json",)

    @property
    def compared(self) -> list[Verdict]:
        """Those of the sets with measurements."""
        return [one for one in self.found.values() if one is not None]

    @property
    def missed_goals(self) -> list[str]:
        """What does not meet its goal, in words, with the names of sets; coverage last."""
        found = [f"{of.name}: {goal}" for of, one in self.found.items() if one for goal in one.missed_goals]
        return found if self.covers else [*found, self.coverage_text]

    @property
    def covers(self) -> bool:
        """Whether the share of differences within their bands is that of bands of 95 %, to the next whole number."""
        inside, count = self.totals[1]
        return math.floor(COVERED[0] * count) <= inside <= math.ceil(COVERED[1] * count)

    @property
    def coverage_text(self) -> str:
        """The coverage over all sets beside its goal, in words."""
        wanted = f"wanted {100 * COVERED[0]:.0f} to {100 * COVERED[1]:.0f} %"
        return f"coverage of the bands of all sets: {_percent(self.totals[1])} %, {wanted}"

    @property
    def totals(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Goals that are met of all, and differences within their bands of all."""
        return self.totals_of(blind=False)

    def totals_of(self, *, blind: bool) -> tuple[tuple[int, int], tuple[int, int]]:
        """Goals that are met of all, and differences within bands of all; of all sets, or of those not widened."""
        both = [(one.goals, one.coverage) for of, one in self.found.items() if one and (of.blind or not blind)]
        goals, coverage = ((sum(p[k][0] for p in both), sum(p[k][1] for p in both)) for k in (0, 1))
        return goals, coverage

    def answer(self) -> an.Answer:
        """Sets, a row each, the counts over all, and a file."""
        sections = [an.Section(title="", blocks=[self._overview()])]
        notes = [sentence(*self.totals), self.coverage_text]
        return an.Answer(
            title="Sets of measurements", sections=sections, notes=notes,
            files={"verdict.json": lambda: an.as_json(self._content())},
        )  # fmt: skip

    def _overview(self) -> an.Table:
        """Sets, a row each."""
        rows = list[tuple[str, ...]]()
        for of, one in self.found.items():
            if one is None:
                rows.append((of.name, "-", "-", "-", of.marked, "no measurements: needs --data FOLDER"))
                continue
            missed = "; ".join(each.what for each in one.missed) or "-"
            rows.append((of.name, *_counted(one.goals, one.coverage), of.marked, missed))
        rows.append(("all", *_counted(*self.totals), "", ""))
        rows.append(("bands fixed before", *_counted(*self.totals_of(blind=True)), "", ""))
        heads = ("set", "goals met", "within their bands", "%", "bands", "missed")
        return an.Table(heads=heads, rows=rows)

    def _content(self) -> dict[str, Any]:
        """The sets with their comparisons, and the counts over all, for JSON."""
        goals, coverage = self.totals
        return {
            "verdict": sentence(goals, coverage), "goals_met": list(goals), "covered": list(coverage),
            "covered_with_bands_fixed_before": list(self.totals_of(blind=True)[1]), "covers": self.covers,
            "sets": [content(one) for one in self.compared],
            "without_measurements": [of.name for of, one in self.found.items() if one is None],
        }  # fmt: skip


# ------------------------------------------------------------------------------------------------ uncertainty


def samples_per_independent(pieces: Sequence[Array]) -> float:
    """Number of residuals of pieces of a record that count as one independent one, 1 or more.

    Parameters
    ----------
    pieces : (n,) or (n, m) float each, residuals in the order of time, of m quantities

    Notes
    -----
    1 + 2 sum of the autocorrelation up to its first zero, over all pieces and quantities.
    """
    longest = max(len(piece) for piece in pieces)
    sums = np.zeros(longest)
    for piece in pieces:
        for column in np.reshape(piece, (len(piece), -1)).T:
            sums[: column.size] += np.correlate(column, column, "full")[column.size - 1 :]
    if sums[0] <= 0.0:
        return 1.0
    rho = sums / sums[0]
    below = np.flatnonzero(rho < 0.0)
    return float(max(1.0, 1.0 + 2.0 * rho[1 : below[0] if below.size else longest].sum()))


def covariance_of(jacobian: Array, residuals: Array, per_independent: float) -> Array:
    """Covariance of fitted parameters by the residuals of a fit, whose samples are correlated: (p, p).

    Parameters
    ----------
    jacobian : (n, p) float
    residuals : (n,) float
    per_independent : float, residuals that count as one independent one

    Notes
    -----
    Inverse of J^T J times the variance of the residuals, their squares over independent ones less parameters, times the
    number of residuals of each. A direction of which the residuals say
    nothing gets no variance: predictions of the same kind do not depend on it.
    """
    count, p = jacobian.shape
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh((jacobian / scale).T @ (jacobian / scale))
    known = values > LEAST * values[-1]
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(scale, scale)
    return np.asarray(inverse * float(residuals @ residuals) / max(count / per_independent - p, 1.0))


def by_parameters(predict: Callable[[Array], Array], values: Array, covariance: Array) -> Array:
    """Standard deviation of what is predicted by the covariance of parameters, along its principal axes, linearly.

    Parameters
    ----------
    predict : function of the parameters (p,) to an array
    values : (p,) float
    covariance : (p, p) float
    """
    scale = np.sqrt(np.diag(covariance))
    scale[scale == 0.0] = 1.0
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    base = predict(values)
    squares = np.zeros_like(base)
    for variance, axis in zip(variances, axes.T, strict=True):
        if variance > 1e-12 * variances[-1] > 0.0:
            squares = squares + (predict(values + math.sqrt(variance) * scale * axis) - base) ** 2
    return np.asarray(np.sqrt(squares))


def rms(differences: Sequence[Array] | Array) -> float:
    """Root mean square of all entries."""
    joined = np.concatenate([np.ravel(one) for one in differences])
    return float(np.sqrt(np.mean(joined**2)))


# ------------------------------------------------------------------------------------------------ words


def sentence(goals: tuple[int, int], coverage: tuple[int, int]) -> str:
    """A verdict in words: goals that are met of all, differences within their bands of all."""
    if coverage[1] == 0:
        return "nothing is measured: the predictions stand with their bands"
    met = f"{goals[0]} of {goals[1]} goals are met; " if goals[1] else ""
    return f"{met}{coverage[0]} of {coverage[1]} differences are within their bands of 95 %"


def _percent(counts: tuple[int, int]) -> str:
    """A share in percent; '-' of none."""
    return f"{100.0 * counts[0] / counts[1]:.0f}" if counts[1] else "-"


def _counted(goals: tuple[int, int], coverage: tuple[int, int]) -> tuple[str, str, str]:
    """Goals that are met, differences within their bands, and the share of these in percent."""
    return f"{goals[0]} of {goals[1]}", f"{coverage[0]} of {coverage[1]}", _percent(coverage)


def table(found: Verdict) -> an.Table:
    """The comparisons, a row each."""
    heads = ("what", "predicted", "measured", "difference", "band, 95 %", "goal", "verdict")
    rows = []
    for one in found.comparisons:
        unit = f" {one.unit}" if one.unit and one.unit != "1" else ""
        measured, difference, verdict = "-", "-", "predicted"
        if one.compared:
            measured, difference = f"{one.measured:.4g}{unit}", f"{one.difference:+.3g}"
            verdict = ("met" if one.meets else "MISSED") if math.isfinite(one.allowed) else "-"
            verdict += ", within" if one.covered else ", outside"
        rows.append((
            one.what, f"{one.predicted:.4g}{unit}", measured, difference, f"{one.band.half_width:.2g}",
            one.goal or "-", verdict,
        ))  # fmt: skip
    return an.Table(heads=heads, rows=rows)


def content(found: Verdict) -> dict[str, Any]:
    """A set with its comparisons, for JSON."""
    of = found.of
    stated: dict[str, Any] = {} if of is None else {"set": of.name, "title": of.title, "source": of.source}
    if found.budget is not None:
        stated["band"] = found.budget.content(found.settings)
    return {
        **stated, "verdict": found.text, "notes": list(found.notes),
        "tables": [
            {"title": one.title, "heads": list(one.heads), "rows": [list(row) for row in one.rows]}
            for one in found.tables
        ],
        "comparisons": [
            {
                "what": one.what, "unit": one.unit, "predicted": one.predicted,
                "measured": one.measured if one.compared else None,
                "difference": one.difference if one.compared else None, "half_width": one.band.half_width,
                "uncertainty": {
                    "measurement": one.band.measurement, "parameters": one.band.parameters,
                    "numerics": one.band.numerics, "how": one.band.how, "contributions": dict(one.band.shares),
                },
                "covered": one.covered, "goal": one.goal, "meets": one.meets,
                "allowed": one.allowed if math.isfinite(one.allowed) else None,
            }
            for one in found.comparisons
        ],
    }  # fmt: skip
