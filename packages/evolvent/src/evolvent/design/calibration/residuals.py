"""What a fit evaluates: values of measured series by the runs of a case, or by its closed form, and their residuals."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import itertools
import json
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis import trees
from evolvent.analysis.sensitivity import jacobian
from evolvent.design.calibration import observed, uncertainty
from evolvent.design.evaluator.differences import central
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.evaluator.log import Log
from evolvent.design.evaluator.record import Outcome
from evolvent.design.evaluator.sources import sources, versions
from evolvent.design.evaluator.task import Check, EvaluationTask, Point, Runs
from evolvent.results.kept import split
from evolvent.results.measurements import Measurements
from evolvent_base import files
from evolvent_base.errors import EvolventError, InputError, RunFailed, nearest

Array = np.ndarray
#: Relative change of a parameter by which derivatives are taken: of runs, whose errors of integration change with it,
#: and of closed forms.
STEP_OF_RUNS, STEP_OF_FORMULAS = 1e-3, 1e-5
#: Evaluations that may be taken at most.
MOST_EVALUATIONS = 2000


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class SeriesRuns(Runs):
    """Runs of a case as values of measured series; one that fails raises.

    Attributes
    ----------
    content : mapping, the case
    measured : Measurements
    weights : sequence of float, of the residuals of every series
    closed_form : bool, whether the system's closed form is evaluated in their place
    """

    content: Mapping[str, Any]
    measured: Measurements
    weights: Sequence[float]
    closed_form: bool

    @property
    def system(self) -> Any:
        """Definition of the system."""
        return cases.system(self.content["system"])

    def outcomes(self, task: EvaluationTask, check: Check | None = None) -> list[Outcome]:
        """Values of every series, in its unit, by its number."""
        return [
            Outcome(index=number, status="success", variables=self._values(point, task.level))
            for number, point in zip(task.numbers, task.points, strict=True)
        ]

    def _values(self, point: Point, level: float) -> dict[str, xr.Variable]:
        runs = [self._run(cases.content_of(self.content, {**row, **point}), level) for row in self.measured.rows]
        each = zip(*runs, strict=True)
        return {str(k): xr.Variable(("value",), np.concatenate(values)) for k, values in enumerate(each)}

    def _run(self, content: Any, level: float) -> list[Array]:
        """Values of every series of one run."""
        series, case = self.measured.series, cases.load(content)
        if self.closed_form:
            found = []
            for one in series:
                assert one.times is not None
                formulas = self.system.closed_form(case, one.times(content))
                if one.name not in formulas:
                    raise InputError(f"the closed form has no variable {one.name!r}; {nearest(one.name, formulas)}")
                values, unit = formulas[one.name]
                found.append(values * observed.factor(unit, one))
            return found
        plan = self.system.finer(level).plan(case)
        run = plan.observe(self._names) if plan.observe is not None else plan.run(None)
        if run.attrs["status"] == "failed":
            raise RunFailed(str(run.attrs["message"]), run)
        if run.attrs["status"] == "interrupted":
            raise KeyboardInterrupt
        return [observed.values(run, one, content) for one in series]

    @property
    def _names(self) -> list[str]:
        """Names of the variables that a run is observed by."""
        names = [split(one.name)[0] if one.times is None else one.name for one in self.measured.series]
        return names + [name.partition("[")[0] for name in names if name.endswith("]")]

    def derivatives(self, point: Point, keys: Sequence[str], level: float = 0.0) -> Array:
        """Derivatives of all residuals by keys of a point: those of the discrete solution."""
        blocks = []
        for row in self.measured.rows:
            content = cases.content_of(self.content, {**row, **point})
            system = self.system.finer(level).system(cases.load(content))

            def series(solution: Any, content: Any = content) -> Array:
                run = trees.observed(solution, self._names, system=content["system"], root={})
                both = zip(self.measured.series, self.weights, strict=True)
                return np.concatenate([observed.values(run, one, content) * w for one, w in both])

            blocks.append(jacobian(system, series, list(keys), **system.settings)[1])
        if len(blocks) == 1:
            return np.asarray(blocks[0])
        ends = np.cumsum([0, *(one.values.size // len(blocks) for one in self.measured.series)])
        return np.concatenate([block[a:b] for a, b in itertools.pairwise(ends) for block in blocks])

    @contextlib.contextmanager
    def kept_in(
        self, folder: str | os.PathLike[str] | None, report: Callable[[str], None] | None
    ) -> Iterator[Log | None]:
        """The log of evaluations in a folder, in a file named by what is asked: case, data, sources and versions."""
        if folder is None:
            yield None
            return
        measured = [
            (s.name, s.unit, s.values.tolist(), None if s.times is None else s.times(self.content).tolist())
            for s in self.measured.series
        ]
        checked = cases.load(dict(self.content)).model_dump(mode="json")
        rows = [dict(row) for row in self.measured.rows]
        asked = [self.content, checked, self.files, self.closed_form, sources(), versions(), measured, rows]
        digest = hashlib.sha256(json.dumps(asked, sort_keys=True, default=str).encode()).hexdigest()[:16]
        files.make_folder(folder)
        with contextlib.closing(Log(pathlib.Path(folder) / f"evaluations-{digest}.sqlite")) as log:
            if log.damaged and report is not None:
                report(log.sentence())
            yield log


class Residuals:
    """Residuals of measured series as functions of scaled parameters.

    Parameters
    ----------
    runs : SeriesRuns
    parameters : sequence of `fit.Parameter`
    log : Log or None, that keeps the evaluations
    progress : called with the number of evaluations and the root mean square reached

    Attributes
    ----------
    scales : (p,) float, what counts as 1 of every parameter
    level : int, of finer integration (`evolvent.analysis.accuracy`)
    evaluator : Evaluator
    """

    def __init__(self, runs: SeriesRuns, parameters: Any, log: Log | None, progress: Any) -> None:
        self.runs, self.parameters, self.progress = runs, parameters, progress
        self.series, self.level = runs.measured.series, 0
        self.scales = np.array([p.scale for p in parameters])
        self.evaluator = Evaluator(runs, log=log)
        self._differences = "the case is no structure"  # why derivatives are differences; empty where they are not
        if runs.closed_form:
            self._differences = "of the closed form"
        elif runs.content["system"] == "structure":
            self._differences = ""

    @property
    def derived_by(self) -> str:
        """How derivatives were found."""
        return f"central differences ({self._differences})" if self._differences else "those of the discrete solution"

    def overrides(self, x: Array) -> dict[str, Any]:
        """The fitted keys and their values, SI."""
        return {p.key: float(v * p.scale) for p, v in zip(self.parameters, x, strict=True)}

    def values(self, x: Array, *, finer: int = 0) -> tuple[Array, ...]:
        """What the model gives for every series, in its unit, by integration that is finer by so many levels."""
        if self.evaluator.evaluations >= MOST_EVALUATIONS:
            raise RunFailed(f"the fit took {MOST_EVALUATIONS} evaluations and did not converge", None)
        (found,) = self.evaluator.of([self.overrides(x)], level=self.level + finer)
        each = [found.values(str(k)) for k in range(len(self.series))]
        return tuple(one for one in each if one is not None)

    def weighted(self, values: Sequence[Array]) -> Array:
        """Weighted differences of the model's values from those that were measured."""
        both = zip(self.runs.weights, values, self.series, strict=True)
        return np.concatenate([w * (v - one.values) for w, v, one in both])

    def at(self, x: Array, *, first: bool = False) -> Array:
        """Weighted differences; not a number, which shortens the step of the least squares, where a run fails."""
        try:
            whole = self.weighted(self.values(x))
        except EvolventError:
            if first:
                raise
            return np.full(sum(one.values.size for one in self.series), np.nan)
        if self.progress is not None:
            count = self.evaluator.evaluations + self.evaluator.reused
            self.progress(count, float(np.sqrt(np.mean(whole**2))))
        return whole

    def off(self, found: Any) -> tuple[Array, str]:
        """By how much finer integration would change the parameters of a fit, in their scales; and why it is not known.

        Parameters
        ----------
        found : as of `scipy.optimize.least_squares`
        """
        try:
            change = self.weighted(self.values(found.x, finer=1))
        except EvolventError as error:
            return np.zeros(found.x.size), f"the error of integration is not known: with finer integration {error}"
        return np.abs(uncertainty.shift(found.jac, change - found.fun)), ""

    def accuracy(self) -> str:
        """A sentence on the integration of the runs."""
        if self.runs.closed_form:
            return ""
        how = self.runs.system.finer(self.level).integration(cases.load(dict(self.runs.content)))
        again = ", finer than the case says" if self.level else ""
        return f"integration ({how}{again}): the errors include what a finer one changes"

    def derivatives(self, x: Array, low: Array, high: Array) -> Array:
        """Derivatives of the discrete solution, or where it has none central differences."""
        if not self._differences:
            try:
                point = self.overrides(x)
                whole = self.runs.derivatives(point, list(point), self.level) * self.scales
                if not np.all(np.isfinite(whole)):
                    raise InputError("a derivative is not finite")
                return whole
            except EvolventError as error:
                self._differences = str(error)
        step = STEP_OF_FORMULAS if self.runs.closed_form else STEP_OF_RUNS
        found = central(lambda places: [self.at(one) for one in places], x, step, low, high)
        for k in np.flatnonzero(~np.all(np.isfinite(found), axis=0))[:1]:
            one = self.parameters[k]
            raise RunFailed(
                f"the fit cannot take the derivative by {one.key}: runs near {x[k] * one.scale:g} {one.unit} fail", None
            )
        return found
