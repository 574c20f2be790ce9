"""Samples of a run: the regular ones, and finer ones that are kept where the motion is fast.

A run is evaluated at finer times between its samples. Of these the samples are kept that straight lines between the
others miss: in order of the miss, until every velocity is followed to within `SHARE` of the largest range of a speed.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evolvent.kernels.blocks import ANGLE, MOVES, POSITION, ROTATION
from evolvent.results.observe.view import View

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: Variable of the root that marks fine samples; only of runs that have some.
MARK = "fine_sample"
#: Equal parts of an interval between samples at whose ends a run is evaluated, and the most values of the state there.
PARTS, MOST_VALUES = 10, 20_000_000
#: Number of velocity components per batch, approximately.
MOST_AT_ONCE = 200_000
#: Miss of a velocity at which a sample is kept, of the largest range of any speed over the run.
SHARE = 0.01
#: The same, of the median miss of an interval: what moves as fast everywhere has no event.
OF_MEDIAN = 3.0
#: Share of the largest speed that a range counts at least: below is round-off of a steady motion.
LEAST_RANGE = 1e-3


class Times(NamedTuple):
    """Times at which a run is evaluated.

    Attributes
    ----------
    all : (n,) float, s
    regular : (n,) bool, the samples that every run keeps
    derived : (n,) bool, these and those that `SystemDefinition.derived` gets
    fine : bool, whether fine samples are kept
    """

    all: Array
    regular: Array
    derived: Array
    fine: bool

    @classmethod
    def of(cls, regular: Array, between: Array | None = None, *, fine: bool, values: int) -> Times:
        """Regular times together with others between them.

        Parameters
        ----------
        regular : (nt,) float, s
        between : (k,) float, s, more times for `derived`
        fine : bool, whether finer times are added, evenly in every interval, of which fine samples are kept
        values : int, of the state at a sample
        """
        more = np.zeros(0) if between is None else between
        parts = min(PARTS, 1 + MOST_VALUES // (regular.size * max(values, 1))) if fine else 1
        share = np.arange(1, parts) / parts
        inner = (regular[:-1, None] + np.diff(regular)[:, None] * share).ravel()
        candidates, is_derived = np.concatenate([more, inner]), np.arange(more.size + inner.size) < more.size
        candidates, is_derived = _distinct_times(regular, candidates, is_derived)
        times = np.concatenate([regular, candidates])
        order = np.argsort(times, kind="stable")
        is_regular = order < regular.size
        found = np.concatenate([np.ones(regular.size, dtype=bool), is_derived])[order]
        return cls(times[order], is_regular, found, fine)

    def kept(self, solution: Solution) -> Array:
        """Which samples of a solution at these times are kept: (nt,) bool."""
        found = self.regular[: solution.t.size].copy()
        found[-1] = True  # where it ended
        if self.fine and solution.t.size > 2 and not found.all():
            velocities = tracked_velocities(solution)
            if velocities.shape[1]:
                add_fine(solution.t, velocities, found)
        return found

    def chosen(self, solution: Solution) -> tuple[Solution, Array]:
        """A solution at the samples that `derived` gets, and which of them are kept."""
        kept = self.kept(solution)
        seen = kept | self.derived[: solution.t.size]
        return (solution if seen.all() else solution.chosen(seen)), kept[seen]

    def is_fine(self, t: Array) -> Array:
        """Which of the samples at times t, of which the last is the end of the run, are not regular: (nt,) bool."""
        if self.regular.all():
            return np.zeros(t.size, dtype=bool)
        fine = ~np.isin(t, self.all[self.regular])
        fine[-1:] = False
        return fine

    def mark(self, t: Array) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
        """The variable of the root that marks the fine ones among samples at times t; empty where there are none."""
        fine = self.is_fine(t)
        text = "1 of a sample between the regular ones, kept where the motion is fast"
        return {MARK: (("time",), fine.astype(np.int8), "1", text)} if fine.any() else {}


def _distinct_times(regular: Array, candidates: Array, is_derived: Array) -> tuple[Array, Array]:
    """Candidates inside the regular times that coincide neither with these nor with one another, in order."""
    inside = (candidates > regular[0]) & (candidates < regular[-1])
    candidates, is_derived = candidates[inside], is_derived[inside]
    order = np.lexsort((~is_derived, candidates))
    candidates, is_derived = candidates[order], is_derived[order]
    after, near = np.searchsorted(regular, candidates), 1e-9 * regular[-1]
    alone = np.minimum(candidates - regular[after - 1], regular[after] - candidates) > near
    candidates, is_derived = candidates[alone], is_derived[alone]
    close = np.diff(candidates) <= near  # of two that coincide the one for `derived` stays
    double = np.zeros(candidates.size, dtype=bool)
    double[1:] = close & ~is_derived[1:]
    double[:-1] |= close & ~is_derived[:-1] & is_derived[1:]
    return candidates[~double], is_derived[~double]


def tracked_velocities(solution: Solution) -> Array:
    """Velocities of the nodes of threads and beams, of points and of bodies that move: (nt, k, 3), of their range.

    The range is the largest of any speed over the run. The last ones are the angular velocities of bodies, in their own
    axes, of their own largest range.
    """
    view, model = View.of(solution), solution.assembly.model
    speeds: list[Array] = []
    rates: list[Array] = []
    if model.threads.size:
        speeds.append(solution.observations.velocity)
    for block in model.blocks[model.blocks["switch"] == MOVES]:
        at = int(block["iv"])
        if block["kind"] == POSITION:
            speeds.append(view.coordinates(at)[:, None])
        elif block["kind"] == ROTATION:
            rates.append(view.coordinates(at)[:, None])
        elif block["kind"] == ANGLE:
            rates.append(view.coordinates(at, 1)[:, None] * model.bodies["axis"][block["owner"]])
    groups = [np.concatenate(group, axis=1) for group in (speeds, rates) if group]
    return np.concatenate([np.zeros((solution.t.size, 0, 3)), *map(_of_range, groups)], axis=1)


def _of_range(vectors: Array) -> Array:
    """Vectors (nt, k, 3) over the largest range of any one's size; without those that are not finite."""
    vectors = vectors[:, np.all(np.isfinite(vectors), axis=(0, 2))]
    if not vectors.size:
        return vectors
    sizes = _size(vectors)
    scale = max(float(np.ptp(sizes, axis=0).max()), LEAST_RANGE * float(sizes.max()))
    return np.asarray(vectors / scale if scale > 0.0 else vectors)


def _size(vectors: Array) -> Array:
    """Sizes of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def add_fine(t: Array, vectors: Array, kept: Array) -> None:
    """Add samples to those that are `kept` until straight lines between these follow all vectors to within `SHARE`.

    What counts is the smaller of the miss of the vector, which a steady turn has as well, and that of its size, which a
    passage through zero has as well. The largest come first; at most as many are added as are kept before.

    Parameters
    ----------
    t : (nt,) float, s
    vectors : (nt, k, 3) float
    kept : (nt,) bool, which is changed
    """
    sizes = _size(vectors)

    def misses(inner: Array, first: Array, last: Array) -> Array:
        """Miss at samples between two others: (n,) of (n,) numbers."""
        share = (t[inner] - t[first]) / (t[last] - t[first])
        of_size = np.abs(sizes[inner] - sizes[first] - share[:, None] * (sizes[last] - sizes[first]))
        straight = vectors[first] + share[:, None, None] * (vectors[last] - vectors[first])
        return np.asarray(np.minimum(of_size, _size(vectors[inner] - straight)).max(axis=1))

    places = np.flatnonzero(kept)
    block = 1 + MOST_AT_ONCE // max(vectors[0].size, 1)
    queue = _largest_in_each(misses, places, block)
    limit = max(SHARE, -OF_MEDIAN * float(np.median([miss for miss, *_ in queue])))
    heapq.heapify(queue)
    for _ in range(len(places)):
        miss, at, first, last = queue[0]
        if -miss <= limit:
            return
        kept[at] = True
        before, after = _largest_in_each(misses, np.array([first, at, last]), block)
        heapq.heapreplace(queue, before)
        heapq.heappush(queue, after)


def _largest_in_each(
    misses: Callable[[Array, Array, Array], Array], places: Array, block: int
) -> list[tuple[float, int, int, int]]:
    """Of all pairs of neighbours: the largest miss between them, negative, where it is, and the two."""
    between = np.delete(np.arange(places[0], places[-1]), places[:-1] - places[0])
    pair = np.searchsorted(places, between) - 1
    blocks = [slice(k, k + block) for k in range(0, between.size, block)]
    found = [misses(between[one], places[pair[one]], places[pair[one] + 1]) for one in blocks]
    miss = np.concatenate([np.zeros(0), *found])
    most, at = np.zeros(places.size - 1), places[:-1].copy()
    np.maximum.at(most, pair, miss)
    equal = np.flatnonzero(miss == most[pair])[::-1]  # the first of a pair is written last
    at[pair[equal]] = between[equal]
    return list(zip((-most).tolist(), at.tolist(), places[:-1].tolist(), places[1:].tolist(), strict=True))
