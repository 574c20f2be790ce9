"""Which cause can explain the differences of a set: each by the pattern of changes that it makes in the predictions.

A cause, such as another thickness, changes every prediction by its size times a pattern of its own. Least squares give
its size, with the measurement's uncertainty, and what it leaves. A cause is not taken into the prediction: the table
says what the measurements allow.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy import stats

from evolvent_base import answer as an

Array = np.ndarray
#: A cause does not explain differences that it would leave in fewer than this share of all measurements.
LEAST_PROBABLE = 1e-3
#: Changes below this part of the largest one of a pattern are taken for round-off.
NEGLIGIBLE = 1e-3
#: Sizes agree, and signs are sure, within this number of standard deviations.
SURE = 3.0


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Cause:
    """What may differ between model and measured thing.

    Attributes
    ----------
    name, unit : str
    pattern : (n,) float, change of every prediction by one unit
    least : float, smallest size that is physically possible, units
    """

    name: str
    unit: str
    pattern: Array
    least: float = -math.inf


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """Sizes of causes by least squares of some differences.

    Attributes
    ----------
    values, deviations : (p,) float, units of the causes
    left : (n,) float, what stays of all differences, over their uncertainty
    chosen : (n,) bool, differences of the fit
    """

    values: Array
    deviations: Array
    left: Array
    chosen: Array

    @property
    def chi2(self) -> float:
        """Sum of the squares of what stays of the fitted differences."""
        return float(np.sum(self.left[self.chosen] ** 2))

    @property
    def probable(self) -> float:
        """Share of measurements in which at least as much would stay, if the causes were the true ones."""
        free = max(int(np.count_nonzero(self.chosen)) - self.values.size, 1)
        return float(stats.chi2.sf(self.chi2, free))

    @property
    def criterion(self) -> float:
        """Bayesian information criterion (BIC): chi2 and a price of each cause."""
        return self.chi2 + self.values.size * math.log(np.count_nonzero(self.chosen))


def fitted(causes: Sequence[Cause], differences: Array, deviation: Array, chosen: Array) -> Fit:
    """Sizes of causes that together leave least of the chosen differences, measured less predicted.

    Parameters
    ----------
    differences, deviation : (n,) float, and standard uncertainty of each
    chosen : (n,) bool
    """
    y = differences / deviation
    if not causes:
        return Fit(values=np.zeros(0), deviations=np.zeros(0), left=y, chosen=chosen)
    A = np.stack([one.pattern for one in causes], axis=1)
    A = np.where(np.abs(A) > NEGLIGIBLE * np.abs(A).max(axis=0), A, 0.0) / deviation[:, None]
    normal = np.linalg.pinv(A[chosen].T @ A[chosen])
    values = normal @ (A[chosen].T @ y[chosen])
    return Fit(values=values, deviations=np.sqrt(np.diag(normal)), left=y - A @ values, chosen=chosen)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """A cause beside groups of differences, each of which it may explain.

    Attributes
    ----------
    cause : Cause
    fits : mapping, group -> Fit of that group alone
    """

    cause: Cause
    fits: Mapping[str, Fit]

    @property
    def explained(self) -> list[str]:
        """Groups that the cause explains."""
        return [name for name, one in self.fits.items() if one.probable >= LEAST_PROBABLE]

    @property
    def possible(self) -> bool:
        """Whether a size that explains a group, or the size of each where none does, is physically possible."""
        names = self.explained or list(self.fits)
        return all(
            self.fits[name].values[0] + SURE * self.fits[name].deviations[0] >= self.cause.least for name in names
        )

    @property
    def agrees(self) -> bool:
        """Whether all groups ask for the same size."""
        ones = list(self.fits.values())
        spread = max(float(one.values[0]) for one in ones) - min(float(one.values[0]) for one in ones)
        return spread <= SURE * math.hypot(*(float(one.deviations[0]) for one in ones))

    @property
    def text(self) -> str:
        """What is said of the cause."""
        if not self.possible:
            return f"ruled out: it would have to be below {self.cause.least:g}"
        if not self.explained:
            return "ruled out: wrong pattern"
        if len(self.explained) < len(self.fits):
            others = [name for name in self.fits if name not in self.explained]
            return f"explains {' and '.join(self.explained)}, not {' and '.join(others)}"
        return "explains all" if self.agrees else "ruled out: each group asks for another size"


def explanations(
    causes: Sequence[Cause], differences: Array, deviation: Array, groups: Mapping[str, Array]
) -> list[Explanation]:
    """Each cause alone, fitted to every group of differences, (n,) bool each."""
    return [
        Explanation(
            cause=one, fits={name: fitted([one], differences, deviation, chosen) for name, chosen in groups.items()}
        )
        for one in causes
    ]


def best_pair(causes: Sequence[Cause], differences: Array, deviation: Array, chosen: Array) -> tuple[list[Cause], Fit]:
    """The two causes that together leave least of the chosen differences, of those whose sizes are possible."""
    found = []
    for pair in itertools.combinations(causes, 2):
        fit = fitted(pair, differences, deviation, chosen)
        if all(v + SURE * d >= one.least for v, d, one in zip(fit.values, fit.deviations, pair, strict=True)):
            found.append((list(pair), fit))
    return min(found, key=lambda one: one[1].chi2)


def table(
    found: Sequence[Explanation], baseline: Fit, witness: Mapping[str, tuple[str, Array]], title: str
) -> an.Table:
    """Causes, a row each: size and chi2 by each group, chi2 of the witnesses, and what is said.

    Parameters
    ----------
    baseline : Fit, without a cause
    witness : mapping, name of other differences -> group whose fit predicts them, and which they are, (n,) bool
    """
    fits = found[0].fits
    heads, none = ["cause"], ["none"]
    for name, one in fits.items():
        heads += [f"size by {np.count_nonzero(one.chosen)} {name}", "chi2"]
        none += ["-", f"{np.sum(baseline.left[one.chosen] ** 2):.0f}"]
    heads += [f"chi2 of {np.count_nonzero(which)} {name}" for name, (_, which) in witness.items()]
    none += [f"{np.sum(baseline.left[which] ** 2):.0f}" for _, which in witness.values()]
    rows = [(*none, "")]
    for each in found:
        row = [each.cause.name]
        for one in each.fits.values():
            size = f"{one.values[0]:+.3g} ± {one.deviations[0]:.2g} {each.cause.unit}"
            row += [size if one.deviations[0] > 0.0 else "no effect", f"{one.chi2:.0f}"]
        row += [f"{np.sum(each.fits[group].left[which] ** 2):.0f}" for group, which in witness.values()]
        rows.append((*row, each.text))
    return an.Table(heads=(*heads, "verdict"), rows=rows, title=title)
