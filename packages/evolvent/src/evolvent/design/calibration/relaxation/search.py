"""Least squares of a Prony series: where it starts, and how many terms the data determine."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import scipy.optimize

from evolvent.design.calibration.relaxation.curves import ROUND_OFF
from evolvent.design.calibration.relaxation.response import LN10, Response, Rows, decay, thinned
from evolvent.design.calibration.relaxation.shifts import Shift
from evolvent.elements.viscoelastic import MOST_DECADES

Array = np.ndarray
#: Most terms that are tried, and how many more than the best number so far.
MOST_TERMS, _BEYOND = 15, 2
#: Relaxation times lie between the first time over this, and the last time by that.
SHORTER, LONGER = 5.0, 10.0
#: What stays, at least, in parts of the largest force: a case needs a share that never relaxes.
LEAST = 1e-6
#: Amplitude of a term, in parts of the largest force, up to which it is none.
NOTHING = 1e-9
#: Natural logarithm of the largest ratio of instantaneous forces of two curves.
MOST_RATIO = 5.0
#: Smallest singular value of the scaled derivatives over the largest.
_SINGULAR = 1e-9
#: Rows of a curve, and relaxation times a decade, by which starts are found; steps of shifts, decades.
_ROWS, _PER_DECADE, _STEP = 30, 4, 0.25
#: Rows of a curve to which those of long records are averaged while starts are compared.
_MANY_ROWS = 300
#: Natural logarithms of ratios of instantaneous forces that are tried.
_SCALES = np.linspace(-0.4, 0.4, 9)


class Solved(NamedTuple):
    """A least squares solution.

    Attributes
    ----------
    response : Response
    x : (p,) float, parameters, as of `Response`
    residuals : (n,) float, modelled less measured, in parts of the largest force
    covariance : (p, p) float, of the parameters for residuals of standard deviation 1; None where they are not
        determined
    criterion : float, Bayesian information criterion
    """

    response: Response
    x: Array
    residuals: Array
    covariance: Array | None
    criterion: float

    @property
    def terms(self) -> int:
        """Number of terms."""
        return self.response.terms

    @property
    def rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def freedom(self) -> int:
        """Values less parameters."""
        return self.residuals.size - self.response.size


@dataclasses.dataclass(frozen=True)
class Search:
    """Fits of one set of rows.

    Attributes
    ----------
    rows : Rows
    curves : int, of how many curves the instantaneous force is a parameter
    deviation : float, of the forces, in parts of the largest; None where the residuals show it
    span : (2,) float, ln of the shortest and longest relaxation time that is tried, s at the reference
    """

    rows: Rows
    curves: int
    deviation: float | None
    span: tuple[float, float]

    def solve(self, response: Response, start: Array, *, fine: bool = True) -> Solved:
        """The least squares from a start; not `fine` while numbers of terms are compared."""
        low, high = np.full(response.size, -np.inf), np.full(response.size, np.inf)
        amplitudes, times, shift, curves = response.places
        low[curves], high[curves] = -MOST_RATIO, MOST_RATIO
        low[amplitudes], low[0] = 0.0, LEAST
        low[times], high[times] = self.span
        low[shift], high[shift] = response.shift.bounds()
        inner = 1e-9 * np.maximum(1.0, np.abs(start))
        start = np.clip(start, low + inner, high - inner)

        weight = np.sqrt(response.rows.merged)

        def residuals(x: Array) -> Array:
            return weight * (response.at(x)[0] - response.rows.force)

        found = scipy.optimize.least_squares(
            residuals, start, jac=lambda x: weight[:, None] * response.at(x)[1], bounds=(low, high), x_scale="jac",
            xtol=1e-11, ftol=1e-11 if fine else 1e-7, gtol=1e-14, max_nfev=200 if fine else 60,
        )  # fmt: skip
        known = _covariance(found.jac) if np.all(found.x[amplitudes][1:] > NOTHING) else None
        return Solved(response, found.x, found.fun, known, self.criterion(found.fun, response.size))

    def criterion(self, r: Array, parameters: int) -> float:
        """Bayesian information criterion of residuals (Schwarz 1978)."""
        square = float(r @ r)
        if self.deviation is not None:
            misfit = square / self.deviation**2
        else:
            misfit = r.size * float(np.log(max(square / r.size, ROUND_OFF**2)))
        return misfit + parameters * float(np.log(r.size))

    def is_exact(self, r: Array) -> bool:
        """Whether residuals are those of round-off."""
        return float(r @ r) <= r.size * (10.0 * ROUND_OFF) ** 2

    # -------------------------------------------------------------------------------------------- number of terms

    def chosen(
        self, shift: Shift, places: Sequence[tuple[Array, Array]], *, terms: int | None,
        report: Callable[[int], None] | None = None,
    ) -> tuple[Solved | None, list[Solved]]:  # fmt: skip
        """The solution with the least criterion that the data determine, and all that were tried.

        Parameters
        ----------
        places : shifts and ln of forces at which the search starts, as of `aligned`
        terms : int, how many; None for as many as the criterion asks for
        report : called with the number that is tried
        """
        tried: list[Solved] = []
        best: Solved | None = None
        last: Solved | None = None
        few = thinned(self.rows, _MANY_ROWS)
        few = few if 2 * few.time.size < self.rows.time.size else self.rows
        for n in range(1, (terms or MOST_TERMS) + 1):
            response = Response(self.rows, shift, n, self.curves)
            if response.size >= self.rows.time.size:
                break
            if report is not None:
                report(n)
            quick = dataclasses.replace(response, rows=few)
            solved = [self.solve(quick, x, fine=False) for x in self._starts(response, places, last)]
            if not solved:
                break
            last = min(solved, key=lambda one: float(one.residuals @ one.residuals))
            if few is not self.rows:
                last = self.solve(response, last.x, fine=False)
            tried.append(last)
            is_known = last.covariance is not None
            if is_known and (n == terms or (terms is None and (best is None or last.criterion < best.criterion))):
                best = last
            if terms is None and n >= (best.terms if best else _BEYOND) + _BEYOND:
                break
        if best is not None:
            fine = self.solve(best.response, best.x)
            best = best if fine.covariance is None else fine
        return best, tried

    def _starts(
        self, response: Response, places: Sequence[tuple[Array, Array]], before: Solved | None
    ) -> Iterator[Array]:
        """Where the least squares start: at terms of a dense series, and at those of one term fewer with one more."""
        rows = thinned(self.rows, 2 * _ROWS)
        for decades, logs in places:
            scaled = rows._replace(force=rows.force / np.exp(logs[rows.curve]))
            grid = self._grid(2 * _PER_DECADE)
            times = _merged(grid, _nonnegative(scaled, decades, grid)[0][1:], response.terms)
            if times.size == response.terms:
                of, start = _nonnegative(scaled, decades, times)[0], response.shift.start(decades)
                yield np.concatenate([of, times, start, logs[1:] if self.curves else logs[:0]])
        if before is None:
            return
        _, at, of_shift, of_curve = before.response.places
        decades = before.response.shift.at(before.x[of_shift])[0]
        logs = np.concatenate([[0.0], before.x[of_curve]]) if self.curves else np.zeros(int(rows.curve.max()) + 1)
        scaled = rows._replace(force=rows.force / np.exp(logs[rows.curve]))
        tries = [np.append(before.x[at], one) for one in self._grid(_PER_DECADE)[::2]]
        fits = [_nonnegative(scaled, decades, one) for one in tries]
        k = int(np.argmin([fit[1] for fit in fits]))
        order = np.argsort(tries[k])
        of = np.concatenate([fits[k][0][:1], fits[k][0][1:][order]])
        yield np.concatenate([of, tries[k][order], before.x[of_shift], before.x[of_curve]])

    def _grid(self, per_decade: int) -> Array:
        low, high = self.span
        return np.linspace(low, high, max(4, round((high - low) / LN10 * per_decade) + 1))


def _covariance(J: Array) -> Array | None:
    """Inverse of J^T J; None where it has none."""
    norms = np.linalg.norm(J, axis=0)
    if not np.all(norms > 0.0):
        return None
    _, s, vt = np.linalg.svd(J / norms, full_matrices=False)
    if s[-1] < _SINGULAR * s[0]:
        return None
    return np.asarray((vt.T / s**2) @ vt / np.outer(norms, norms))


def _nonnegative(rows: Rows, decades: Array, times: Array) -> tuple[Array, float]:
    """What stays and amplitudes, none below 0, of given ln tau; and the norm of the residuals."""
    factor = np.exp(LN10 * np.clip(decades, -MOST_DECADES, MOST_DECADES)[rows.level])[:, None]
    share = decay(rows.time[:, None], rows.ramp[:, None], np.exp(times) * factor)[0]
    weight = np.sqrt(rows.merged)
    columns = np.column_stack([np.ones(rows.time.size), share])
    found, norm = scipy.optimize.nnls(columns * weight[:, None], rows.force * weight)
    return found, float(norm)


def _merged(grid: Array, amplitudes: Array, terms: int) -> Array:
    """So many ln tau of a dense series: neighbours are merged, the nearest first; fewer where it has fewer."""
    rows = np.flatnonzero(amplitudes > 0.0)
    times, weights = list(grid[rows]), list(amplitudes[rows])
    while len(times) > terms:
        k = int(np.argmin([(b - a) * min(u, v) for a, b, u, v in zip(times, times[1:], weights, weights[1:])]))  # noqa: B905
        total = weights[k] + weights[k + 1]
        times[k : k + 2] = [(times[k] * weights[k] + times[k + 1] * weights[k + 1]) / total]
        weights[k : k + 2] = [total]
    return np.array(times)


# ------------------------------------------------------------------------------------------------ shifts


def aligned(rows: Rows, levels: int, *, own: bool) -> tuple[Array, Array]:
    """Shifts and forces with which the curves lie on one another, to the steps of a search.

    From the coldest on each curve is moved towards longer times until a series of many terms fits it and those before
    it best; and is scaled, where it has an instantaneous force of its own.

    Parameters
    ----------
    levels : int, number of temperatures

    Returns
    -------
    (m,) float, decades from the first temperature, and (curves,) float, ln of instantaneous forces over that of the
    first curve
    """
    few = thinned(rows, _ROWS)
    decades, logs = np.zeros(levels), np.zeros(int(few.curve.max()) + 1)
    if levels == 1 and not own:
        return decades, logs
    wide = [_span(few.time[few.level == k]) for k in range(levels)]
    of_curve = [int(few.level[few.curve == k][0]) for k in range(logs.size)]
    order = sorted(range(logs.size), key=of_curve.__getitem__)
    groups = [[k] for k in order] if own else [[k for k in order if of_curve[k] == level] for level in range(levels)]
    known = np.isin(few.curve, groups[0])
    for before, group in itertools.pairwise(groups):
        level, last = of_curve[group[0]], of_curve[before[0]]
        known |= np.isin(few.curve, group)
        used = Rows(*(column[known] for column in few))
        most = wide[last] - (min(1.0, 0.5 * wide[last]) if own else -_STEP)  # of scaled ones a part lies on the others
        steps = np.arange(0.0, most, _STEP) if level > last else [0.0]
        tries = []
        for step, log in itertools.product(steps, _SCALES if own else [0.0]):
            decades[level:], logs[group] = decades[last] - step, log
            low, high = span(used, decades)
            times = np.linspace(low, high, round((high - low) / LN10 * _PER_DECADE) + 1)
            scaled = used._replace(force=used.force / np.exp(logs[used.curve]))
            tries.append((_nonnegative(scaled, decades, times)[1] * (1.0 + log**2), step, log))
        _, step, log = min(tries)
        decades[level:], logs[group] = decades[last] - step, log
    return decades, logs - logs[0]


def _span(time: Array) -> float:
    """Decades between the first and the last time."""
    time = time[time > 0.0]
    return float(np.log10(time.max() / time.min()))


def span(rows: Rows, decades: Array) -> tuple[float, float]:
    """The shortest and longest relaxation time that rows can show, ln of s at the reference."""
    reduced = rows.time / np.exp(LN10 * decades[rows.level])
    reduced = reduced[reduced > 0.0]
    return float(np.log(reduced.min() / SHORTER)), float(np.log(reduced.max() * LONGER))
