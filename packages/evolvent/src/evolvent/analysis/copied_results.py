"""What is kept of copies of a run, evaluated of many at once where it depends on their states alone."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent.analysis.batch_parameters import BatchParameters
from evolvent.analysis.varied_run import VariedRun
from evolvent.assembly.variants import Change
from evolvent.results.kept import Kept, is_local, kept_of, reduced_values, split
from evolvent.results.tree import root_of
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.copies import Copies
from evolvent.solvers.time.run import FINISHED

Array = np.ndarray
#: Fewest copies that are evaluated together.
LEAST = 2


class CopiedResults:
    """What is kept of copies that have ended.

    Parameters
    ----------
    copies : Copies
    varied, parameters : VariedRun and BatchParameters, what copies have of their own
    keep : names of what is kept
    why : str, why the method was taken

    Notes
    -----
    Samples of all copies are then those of one solution. Whether what is kept depends on anything else is found by
    evaluating it with NaN in the place of what copies have of their own and of the states of the copy before, and with
    the parts of other copies.
    """

    def __init__(
        self, copies: Copies, varied: VariedRun, parameters: BatchParameters, keep: Sequence[str], why: str
    ) -> None:  # fmt: skip
        self._copies, self._varied, self._parameters, self._why = copies, varied, parameters, why
        self._keep = {name: split(name) for name in keep}
        self._names = [*dict.fromkeys(name for name, _ in self._keep.values())]
        self._is_local = is_local(copies.run.assembly, keep) and all(how for _, how in self._keep.values())
        self._known: tuple[tuple[int, int], bool] | None = None
        ends = {how for _, how in self._keep.values()} <= {"first", "last"}
        count = copies.run.plan.times.size
        self._at = np.unique([0, count - 1]) if ends else np.arange(count)

    def of(self, which: Array) -> dict[int, Kept]:
        """What is kept of some of the copies; of others it must be found one by one.

        Returns
        -------
        dict
            By the number of the copy. The attributes have no statistics.
        """
        changed = len(self._varied.changed), len(self._varied.parts)
        if not self._is_local or which.size < LEAST or self._known == (changed, False):
            return {}
        which = which[self._copies.closes(which)]
        if which.size < LEAST:
            return {}
        solution = self._solution(which)
        found = self._kept(solution)
        if found is None:
            return {}
        if self._known is None or self._known[0] != changed:
            self._known = changed, self._is_of_states(which, solution, found)
        if not self._known[1]:
            return {}
        return dict(zip(which.tolist(), self._apart(found, which.size), strict=True))

    def _solution(self, which: Array) -> Solution:
        """Samples of copies, one copy after the other, as those of one solution."""
        copies, run = self._copies, self._copies.run
        status, message = FINISHED
        return Solution(
            assembly=run.assembly,
            method=run.plan.method,
            t=np.tile(run.plan.times[self._at], which.size),
            status=status,
            message=message,
            statistics={},
            event_times=np.zeros(0),
            event_kinds=np.zeros(0, dtype=np.int64),
            wall_time=math.nan,
            compile_time=run.compile_time,
            **copies.kept_samples(which, np.repeat(self._at[None], which.size, axis=0), run.model),
        )

    def _kept(self, solution: Solution) -> Kept | None:
        """Variables over the samples of all copies; None where they cannot be evaluated."""
        try:
            found = kept_of(
                solution,
                self._names,
                lambda: root_of(solution, {}),
                fine=np.zeros(solution.t.size, bool),
                why=self._why,
            )
        except Exception:  # noqa: BLE001  (whatever a number that is none makes of an evaluation)
            return None
        if found.missing or any(one.dims[:1] != ("time",) for one in found.variables.values()):
            return None
        return found

    def _is_of_states(self, which: Array, solution: Solution, found: Kept) -> bool:
        """Whether what is kept follows from the states of the copies."""
        own, count = solution.assembly, self._at.size
        other: list[dict[str, Any]] = [{"parts": dict(one)} for one in self._varied.parts]
        if self._varied.changed:
            other.append({"model": poisoned(own.model, self._varied.changed.values())})
        again = [self._kept(dataclasses.replace(solution, assembly=dataclasses.replace(own, **one))) for one in other]
        if not all(one is not None and _bits(one) == _bits(found) for one in again):
            return False
        behind = self._kept(_without(self._solution(which), count))
        return behind is not None and _bits(behind, count) == _bits(found, count)

    def _apart(self, found: Kept, count: int) -> Iterable[Kept]:
        """What is kept of each of so many copies."""
        t, size = self._copies.run.plan.times[self._at], self._at.size
        kept: list[dict[str, xr.Variable]] = [{} for _ in range(count)]
        for wanted, (name, how) in self._keep.items():
            own = found.variables[name]
            for k, variables in enumerate(kept):
                values, attrs = reduced_values(own.values[k * size : (k + 1) * size], own.attrs, how, name, t)
                variables[wanted] = xr.Variable(own.dims[1:], values, attrs)
        along = {dim: one for dim, one in found.coordinates.items() if dim != "time"}
        for variables in kept:
            yield dataclasses.replace(found, variables=variables, coordinates=along)


def poisoned(model: Any, changed: Iterable[Change]) -> Any:
    """A copy of a model with NaN in all that copies have of their own."""
    found, records = model.copy(), False
    for one in changed:
        if not one.field:
            getattr(found, one.family)[one.row] = np.nan
            continue
        own, records = getattr(found, one.family)[one.field], True
        own[one.row] = np.nan if np.issubdtype(own.dtype, np.floating) else own[one.row] + 1
    if records:  # from which these follow
        found.blocks["inertia"], found.G[:] = np.nan, np.nan
    return found


def _without(solution: Solution, count: int) -> Solution:
    """A solution with NaN in the place of its first samples."""
    for values in (solution.y, *(() if solution.kept is None else solution.kept)):
        if values is not None and values.dtype.names is None:
            values[:count] = np.nan
        for name in () if values is None else values.dtype.names or ():
            values[name][:count] = np.nan
    return solution


def _bits(kept: Kept, first: int = 0) -> list[Any]:
    """Names, dimensions, attributes and bits of what is kept, from one of the samples on."""
    timeless = {name: one for name, one in kept.coordinates.items() if name != "time"}
    return [
        *((name, one.dims, one.attrs, one.values[first:].tobytes()) for name, one in kept.variables.items()),
        *((name, one.dims, one.attrs, one.values.tobytes()) for name, one in timeless.items()),
    ]
