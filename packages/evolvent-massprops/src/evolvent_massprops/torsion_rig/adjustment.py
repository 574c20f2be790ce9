"""Least squares of a rig's equations by the uncertainties of all measured numbers, and records that do not fit."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.torsion_rig.equations import Centre, Equation, Moments, directions

Problem: TypeAlias = Moments | Centre


def listed(names: Sequence[str]) -> str:
    """Names in a row: "A, B and C"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


#: Twice the logarithm of 100: what is this much less likely is ruled out.
RULED_OUT = 2.0 * math.log(100.0)
#: Iterations of Gauss and Newton, and the change at which they end, of the parameters' size.
_MOST, _SMALL = 50, 1e-11
#: Part of a variance below which an equation has no redundancy.
_NONE = 1e-8
#: Smallest singular value of equations, each by its uncertainty, over the largest, that determine the parameters.
_SINGULAR = 1e-4
#: Records that are left out together, at most.
_TOGETHER = 3


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """Parameters of a problem by some of its equations.

    Attributes
    ----------
    of : Problem
    used : (n,) bool, equations that give the parameters
    values : (p,) parameters
    measured, predicted : (n,), by all of these
    slope : (n, q) derivative of measured less predicted by the measured numbers
    design : (n, p) derivative of predicted by the parameters
    weight_inputs : (q,) variances of the measured numbers by which equations are weighted
    """

    of: Problem
    used: np.ndarray
    values: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    slope: np.ndarray
    design: np.ndarray
    weight_inputs: np.ndarray

    @property
    def equations(self) -> tuple[Equation, ...]:
        """The equations of the problem."""
        return self.of.equations

    @property
    def residual(self) -> np.ndarray:
        """(n,) measured less predicted."""
        return self.measured - self.predicted

    @functools.cached_property
    def variance(self) -> np.ndarray:
        """(n, n) covariance of the equations by what weighs them."""
        return np.asarray((self.slope * self.weight_inputs) @ self.slope.T)

    @functools.cached_property
    def _weights(self) -> np.ndarray:
        return np.linalg.inv(self.variance[np.ix_(self.used, self.used)])

    @functools.cached_property
    def _normal(self) -> np.ndarray:
        """(p, p) inverse of the normal matrix: covariance by what weighs the equations."""
        A = self.design[self.used]
        return np.linalg.inv(A.T @ self._weights @ A)

    @property
    def own_covariance(self) -> np.ndarray:
        """(p, p) covariance of the parameters by what weighs the equations; of moments without the bar's stiffness."""
        return self._normal

    @functools.cached_property
    def influence(self) -> np.ndarray:
        """(p, q) derivative of the parameters by the measured numbers."""
        return self._normal @ self.design[self.used].T @ self._weights @ self.slope[self.used]

    @property
    def step(self) -> np.ndarray:
        """(p,) the step of Gauss and Newton."""
        A = self.design[self.used]
        return np.asarray(self._normal @ A.T @ self._weights @ self.residual[self.used])

    @property
    def redundancy(self) -> int:
        """Equations more than parameters."""
        return int(self.used.sum()) - len(self.values)

    @property
    def chi2(self) -> float:
        """Weighted squares of the residuals."""
        r = self.residual[self.used]
        return float(r @ self._weights @ r)

    @property
    def scatter(self) -> float:
        """Residuals over what their uncertainties let expect; NaN without redundancy."""
        return math.sqrt(self.chi2 / self.redundancy) if self.redundancy > 0 else math.nan

    @functools.cached_property
    def left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) measured less what the other equations predict, and its standard uncertainty; NaN without redundancy.

        Notes
        -----
        With R = W - W A (A^T W A)^-1 A^T W the deviation of an equation from the fit without it is (W r)_i / R_ii, and
        its variance 1 / R_ii (Baarda 1968): no second fit is needed.
        """
        used, A, W = self.used, self.design[self.used], self._weights
        R = W - W @ A @ self._normal @ A.T @ W
        deviation, std = np.full(used.size, np.nan), np.full(used.size, np.nan)
        own = np.diag(R)
        known = own > _NONE * np.diag(W)
        place = np.flatnonzero(used)[known]
        deviation[place] = (W @ self.residual[used])[known] / own[known]
        std[place] = 1.0 / np.sqrt(own[known])
        for k in np.flatnonzero(~used):
            a = self.design[k]
            deviation[k] = self.residual[k]
            std[k] = math.sqrt(self.variance[k, k] + a @ self._normal @ a)
        return deviation, std

    @property
    def period_errors(self) -> tuple[float, float]:
        """Deviations of the periods of orientations from what the others predict, of those that are used.

        Returns
        -------
        rms, weighted : float, parts of the period: root mean square, and the same weighted by 1 / u^2 of each; NaN
            without redundancy
        """
        deviation, std = (row[self.used] / self.measured[self.used] for row in self.left_out)
        known = np.isfinite(deviation)
        if not known.any():
            return math.nan, math.nan
        squares, weights = (0.5 * deviation[known]) ** 2, 1.0 / std[known] ** 2
        return math.sqrt(float(squares.mean())), math.sqrt(float(squares @ weights / weights.sum()))

    def deviance(self, squares: float = 1.0) -> float:
        """Twice the negative logarithm of the likelihood, up to a constant.

        Parameters
        ----------
        squares : float, 1 or more, by which the variances of all records are multiplied

        Notes
        -----
        A record that is left out counts with a deviation of its own.
        """
        return self.chi2 / squares + float(np.sum(np.log(np.diag(self.variance))))


def fit(of: Problem, used: np.ndarray | None = None) -> Fit:
    """Parameters by least squares; weights follow from the uncertainties of the measured numbers.

    Parameters
    ----------
    of : Problem
    used : (n,) bool, equations to use; all unless given

    Raises
    ------
    InputError
        A record without uncertainty, equations that do not determine the parameters.
    """
    inputs = of.inputs
    y = inputs.values
    variance = inputs.std**2 * (1.0 if of.shared else inputs.own)
    used = np.ones(len(of.equations), dtype=bool) if used is None else used
    p = of.start(y)
    for _ in range(_MOST):
        step = _at(of, used, p, y, variance).step
        p = p + step
        if np.max(np.abs(step)) <= _SMALL * max(np.max(np.abs(p)), 1e-12):
            break
    return _at(of, used, p, y, variance)


def _at(of: Problem, used: np.ndarray, p: np.ndarray, y: np.ndarray, variance: np.ndarray) -> Fit:
    """The equations at parameters, with derivatives by central differences."""
    std = of.inputs.std
    rows = np.flatnonzero(std > 0.0)
    size = np.maximum(0.1 * std[rows], 1e-7 * np.abs(y[rows]))
    shift = np.zeros((rows.size, y.size))
    shift[np.arange(rows.size), rows] = size
    slope = np.zeros((len(of.equations), y.size))
    if rows.size:
        ahead = of.measured(y + shift) - of.predicted(p, y + shift)
        behind = of.measured(y - shift) - of.predicted(p, y - shift)
        slope[:, rows] = ((ahead - behind) / (2.0 * size[:, None])).T
    h = 1e-6 * np.maximum(np.abs(p), 1e-3 * max(float(np.max(np.abs(p))), 1e-9))
    design = ((of.predicted(p + np.diag(h), y) - of.predicted(p - np.diag(h), y)) / (2.0 * h[:, None])).T
    found = Fit(of, used, p, of.measured(y), of.predicted(p, y), slope, design, variance)
    own = np.diag(found.variance)
    bad = np.flatnonzero(~(own > 0.0))
    if bad.size:
        one = of.equations[int(bad[0])]
        what = {"line": "distance", "moment": "period and angle"}.get(one.kind, "period")
        raise InputError(
            f"{one.name} states no uncertainty of its {what}, by which records are weighted and tested; write it "
            "behind +-, such as 0.95692 +- 0.00002 s, or give stand.remounting"
        )
    A = design[used] / np.sqrt(own[used])[:, None]
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    if A.shape[0] < A.shape[1] or np.linalg.svd(A, compute_uv=False)[-1] < _SINGULAR:
        raise InputError(_undetermined(of, used))
    return found


def _undetermined(of: Problem, used: np.ndarray) -> str:
    names = listed([one.name for one, u in zip(of.equations, used, strict=True) if u])
    asked = listed(of.parameters)
    return (
        f"the records {names} do not determine {asked}; it needs orientations whose angles differ, also modulo "
        f"180 deg, {'two' if isinstance(of, Centre) else 'three'} or more"
    )


# ------------------------------------------------------------------------------------------------ wrong records


@dataclasses.dataclass(frozen=True, eq=False)
class Judged:
    """What a test of records says.

    Attributes
    ----------
    every : Fit, of all records
    accepted : Fit, without those that are called wrong
    alarm : bool, whether the records contradict one another
    wrong : tuple of int, records that are called wrong
    suspects : tuple of tuple of int, sets of records of which one would explain the contradiction, the likeliest first;
        more than one where the records cannot tell
    alternatives : tuple of Fit, without each of `suspects`
    critical : float, deviation over uncertainty above which one record is called wrong
    """

    every: Fit
    accepted: Fit
    alarm: bool
    wrong: tuple[int, ...]
    suspects: tuple[tuple[int, ...], ...]
    alternatives: tuple[Fit, ...]
    critical: float


def critical_value(count: int, false_alarms: float) -> float:
    """Deviation over uncertainty that none of `count` records exceeds, but in this part of all tests (Bonferroni)."""
    return float(scipy.stats.norm.isf(0.5 * false_alarms / max(count, 1)))


def judge(of: Problem, false_alarms: float) -> Judged:
    """Fit all records, test them, and find which are wrong.

    Parameters
    ----------
    of : Problem
    false_alarms : float, part of all tests that may raise an alarm where nothing is wrong

    Notes
    -----
    An alarm needs a record that deviates from what the others predict by more than the critical value, or a sum of
    squares above its own, each at half the rate of false alarms. Then every set of one, two or three records is left
    out that leaves a redundancy, so that wrong records do not hide one another. Each record more must make the others a
    hundred times likelier, and one set is called wrong where all others of as many records are a hundred times less
    likely. All are compared at the scatter of the records that agree best: that which their uncertainties state where
    they agree within them, else a larger one.
    """
    every = fit(of)
    deviation, std = every.left_out
    tested = np.isfinite(deviation)
    critical = critical_value(int(tested.sum()), 0.5 * false_alarms)
    sound = Judged(every, every, False, (), (), (), critical)
    if every.redundancy < 1:
        return sound
    off = bool(np.any(np.abs(deviation[tested]) > critical * std[tested]))
    if not off and every.chi2 <= scipy.stats.chi2.isf(0.5 * false_alarms, every.redundancy):
        return sound
    candidates = np.flatnonzero(tested)
    if every.redundancy == 1:
        tried = sorted(_left_out(of, candidates, 1), key=lambda one: one[0].deviance())
        return Judged(every, every, True, (), tuple(out for _, out in tried), tuple(one for one, _ in tried), critical)
    best, likely, count = every, list[tuple[Fit, tuple[int, ...]]](), 0
    for more in range(1, min(every.redundancy, _TOGETHER + 1)):
        tried = _left_out(of, candidates, more)
        if not tried:
            continue
        least, _ = min(tried, key=lambda one: one[0].deviance())
        squares = 1.0 if _agree(least, false_alarms) else least.scatter**2
        tried.sort(key=lambda one: one[0].deviance(squares))
        smallest = tried[0][0].deviance(squares)
        if smallest < best.deviance(squares) - RULED_OUT * (more - count):
            best, count = tried[0][0], more
            likely = [(one, out) for one, out in tried if one.deviance(squares) < smallest + RULED_OUT]
        if _agree(best, false_alarms):
            break
    one_set = len(likely) == 1
    return Judged(
        every, best if one_set else every, True, likely[0][1] if one_set else (), tuple(out for _, out in likely),
        tuple(one for one, _ in likely), critical,
    )  # fmt: skip


def _agree(one: Fit, false_alarms: float) -> bool:
    """Whether records agree within their uncertainties."""
    return bool(one.chi2 <= scipy.stats.chi2.isf(0.5 * false_alarms, one.redundancy))


def _left_out(of: Problem, candidates: Sequence[int] | np.ndarray, count: int) -> list[tuple[Fit, tuple[int, ...]]]:
    """Fits without each set of so many records."""
    found = []
    for out in itertools.combinations([int(k) for k in candidates], count):
        used = np.ones(len(of.equations), dtype=bool)
        used[list(out)] = False
        try:
            found.append((fit(of, used), out))
        except InputError:
            continue
    return found


# ------------------------------------------------------------- which orientation is missing


class Deciding(NamedTuple):
    """A further orientation that distinguishes the suspects.

    Attributes
    ----------
    angle : float, degrees, modulo 180
    moments : tuple of float, kg m2, that it has if each of the suspects is wrong
    apart : float, smallest difference of two of them, in standard uncertainties
    """

    angle: float
    moments: tuple[float, ...]
    apart: float


def deciding(judged: Judged) -> Deciding | None:
    """The orientation in which the moments by all alternatives differ most; None where there is nothing to distinguish.

    Notes
    -----
    The smallest difference of two alternatives is the largest there, over the uncertainty of the less certain one and
    of a record that is read and mounted like the others.
    """
    of = judged.every.of
    if len(judged.alternatives) < 2 or not isinstance(of, Moments) or of.round:
        return None
    angle = np.radians(np.arange(0.0, 180.0))
    G, slope = directions(angle), (directions(angle + 1e-4) - directions(angle - 1e-4)) / 2e-4
    std, at, name = of.inputs.std, of.inputs.place, of.equations[0].name
    turned, share = math.hypot(std[at[f"{name}.angle"]], std[at[f"{name}.tilt"]]), std[at[f"{name}.moment"]]
    moments = np.stack([G @ one.values for one in judged.alternatives])
    squares = np.stack([
        np.einsum("ni,ij,nj->n", G, one.own_covariance, G)
        + (turned * (slope @ one.values)) ** 2 + (share * (G @ one.values)) ** 2
        for one in judged.alternatives
    ])  # fmt: skip
    apart = np.min([
        np.abs(moments[i] - moments[k]) / np.sqrt(np.maximum(squares[i], squares[k]))
        for i, k in itertools.combinations(range(len(moments)), 2)
    ], axis=0)  # fmt: skip
    best = int(np.argmax(apart))
    return Deciding(float(best), tuple(float(x) for x in moments[:, best]), float(apart[best]))
