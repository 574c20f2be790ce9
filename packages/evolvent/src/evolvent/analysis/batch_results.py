"""Results of the copies of a batch, in one array a name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from evolvent.analysis.batch_parameters import BatchParameters
from evolvent.analysis.step_results import ResultAddress, StepResults
from evolvent.analysis.varied_run import VariedRun
from evolvent.assembly.variants import Change
from evolvent.results.kept import follows_from_reactions, is_local
from evolvent.results.observe import View, observe_part
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.copies import Copies

Array = np.ndarray


class BatchResults:
    """Results that are bound: evaluated of all copies at once where they depend on their states alone.

    Parameters
    ----------
    copies : Copies
    varied, parameters : VariedRun and BatchParameters, what copies have of their own

    Notes
    -----
    Copies are then the samples of one solution. Whether a result depends on what copies have of their own is found by
    evaluating it with NaN in the place of that, and with the parts of other copies.
    """

    def __init__(self, copies: Copies, varied: VariedRun, parameters: BatchParameters) -> None:
        self._copies, self._varied, self._parameters = copies, varied, parameters
        self._addresses: dict[str, ResultAddress] = {}
        self._bound: dict[str, Array] = {}
        self._together: dict[str, bool] = {}

    def bind(self, name: str) -> Array:
        """A result of every copy: see `evolvent.analysis.batch.Batch.bind`."""
        if name not in self._bound:
            self._addresses[name] = address = StepResults(self._copies.run.assembly, self._start).address(name)
            self._bound[name] = np.zeros((self._copies.count, *np.shape(address.at)))
            self._write([name], np.arange(self._copies.count))
        return self._bound[name]

    def parameters_changed(self) -> None:
        """Forget which results depend on what copies have of their own."""
        self._together = {}

    def refresh(self, which: Array) -> None:
        """Evaluate what is bound of some of the copies."""
        if self._bound and which.size:
            self._write([*self._bound], which)

    def _write(self, names: Sequence[str], which: Array) -> None:
        """Evaluate results of some of the copies."""
        solution = self._solution(which)
        for name in names:
            if name not in self._together:
                self._together[name] = self._is_of_states(self._addresses[name], solution)
        views: dict[str, Any] = {}
        view = View(solution)
        for name in names:
            if self._together[name]:
                self._bound[name][which] = _values(view, self._addresses[name], views)[1::2]
        apart = [name for name in names if not self._together[name]]
        for k in which.tolist() if apart else ():
            own = View(self._solution(np.array([k]), self._copies.of(k).model.copy(), self._parameters.parts(k)))
            seen: dict[str, Any] = {}
            for name in apart:
                self._bound[name][k] = _values(own, self._addresses[name], seen)[-1]

    def _start(self) -> Solution:
        """The start as a run of two samples."""
        return self._solution(np.zeros(1, dtype=np.int64))

    def _is_of_states(self, address: ResultAddress, solution: Solution) -> bool:
        """Whether a result of all copies can be evaluated with one model."""
        name = f"{address.part}.{address.variable}"
        if not (is_local(solution.assembly, [name]) or follows_from_reactions(solution.assembly, name)):
            return False
        changed, own = self._varied.changed, solution.assembly
        if not changed:
            return True
        others = [{"model": _poisoned(own.model, changed.values())}, *({"parts": one} for one in self._varied.parts)]
        try:
            found = _values(View(solution), address, {})
            without = [
                _values(View(dataclasses.replace(solution, assembly=dataclasses.replace(own, **one))), address, {})
                for one in others
            ]
        except Exception:  # noqa: BLE001  (whatever a number that is none makes of an evaluation)
            return False
        return all(found.tobytes() == one.tobytes() for one in without)

    def _solution(self, which: Array, model: Any = None, parts: Any = None) -> Solution:
        """States of copies at the start and now, as samples of one solution, in turn.

        What follows its value at the sample before, as the sign of a quaternion does, so follows that at the start.
        """
        copies, run = self._copies, self._copies.run
        model, parts = run.model if model is None else model, run.assembly.parts if parts is None else parts
        times = np.full((which.size, 2), float(run.plan.times[0]))
        times[:, 1] = copies.time[which]
        return Solution(
            assembly=dataclasses.replace(run.assembly, model=model, parts=dict(parts), shared=None),
            method=run.plan.method,
            t=times.ravel(),
            status="success",
            message="",
            statistics={},
            event_times=np.zeros(0),
            event_kinds=np.zeros(0, dtype=np.int64),
            wall_time=0.0,
            compile_time=0.0,
            **copies.sampled(which, model),
        )


def _values(view: View, address: ResultAddress, seen: dict[str, Any]) -> Array:
    """A result at all samples of a view: (nt, ...)."""
    if address.part not in seen:
        seen[address.part] = observe_part(view, address.part)
    variable = seen[address.part].variables[address.variable]
    values, count = np.asarray(variable.values, dtype=float), view.t.size
    if variable.dims[:1] != ("time",):
        values = np.broadcast_to(values, (count, *values.shape))
    return np.ascontiguousarray(values.reshape(count, -1)[:, address.at])


def _poisoned(model: Any, changed: Iterable[Change]) -> Any:
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
