"""Derivatives of the results of a design by the shares of the ways between the bounds."""

from __future__ import annotations

import numpy as np

from evolvent import cases
from evolvent.analysis.margins.kept import AT_REST, others_of
from evolvent.base.errors import EvolventError, InputError
from evolvent.design.optimization.runs import Runs

Array = np.ndarray
#: Share of the way between the bounds by which a key changes for a difference: results of adaptive steps have errors
#: of some 1e-6 that vary from run to run.
STEP = 1e-3
#: How derivatives are found: of the discrete solution where it has them, or by differences alone.
DISCRETE, DIFFERENCES = "discrete", "differences"
WAYS = (DISCRETE, DIFFERENCES)
#: Designs one after another without derivatives of the discrete solution from which on only differences are taken.
_GIVEN_UP = 3


class Slopes:
    """Derivatives of the discrete solution (`evolvent.System.sensitivity`), or central differences.

    Differences are one-sided at a bound and where one of the two designs has no result. Margins at rest, which need no
    run, are always differences.

    Parameters
    ----------
    runs : Runs
    way : one of `WAYS`
    """

    def __init__(self, runs: Runs, way: str) -> None:
        self._runs, self._problem = runs, runs.problem
        self._known: dict[tuple[bytes, tuple[int, ...]], tuple[Array, Array]] = {}
        self._margins = tuple(name for name in runs.problem.keep if not others_of([name]))
        self._counts = {DISCRETE: 0, DIFFERENCES: 0}
        self._why, self._failed = "", 0
        if way == DIFFERENCES:
            self._failed = _GIVEN_UP
        elif runs.problem.content["system"] != "structure":
            self._give_up("the case is no structure")
        elif runs.problem.dispersed is not None:
            self._give_up("results are quantiles")
        elif any(name.rpartition(".")[2] != AT_REST for name in self._margins):
            self._give_up("margins along the run have none")

    def _give_up(self, why: str) -> None:
        self._why, self._failed = why, _GIVEN_UP

    @property
    def found_by(self) -> str:
        """How derivatives were found; '' where none were."""
        discrete, differences = self._counts[DISCRETE], self._counts[DIFFERENCES]
        exact = "those of the discrete solution" + (", of margins central differences" if self._margins else "")
        central = f"central differences{f' ({self._why})' if self._why else ''}"
        if not discrete or not differences:
            return (exact if discrete else central) if discrete or differences else ""
        return f"{exact}, of {discrete} designs; {central} of {differences}"

    def at(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array]:
        """Derivatives of the objective (variables,), and of the requirements' values (requirements, variables).

        Parameters
        ----------
        place : (variables,) float, from 0 to 1
        chosen : numbers of the choices

        Raises
        ------
        OutOfRuns
        """
        key = (place.tobytes(), chosen)
        if key not in self._known:
            self._known[key] = self._discrete(place, chosen) or self._differences(place, chosen)
        return self._known[key]

    def _discrete(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array] | None:
        """Those of the discrete solution; None where it has none."""
        if self._failed >= _GIVEN_UP:
            return None
        try:
            found = self._of_run(place, chosen) | self._of_margins(place, chosen)
        except EvolventError as error:
            self._why, self._failed = " ".join(str(error).split()), self._failed + 1
            return None
        self._failed = 0
        self._counts[DISCRETE] += 1
        rows = np.array([found[one.keep] for one in self._problem.requirements]).reshape(-1, place.size)
        return np.sum([found[name] for name in self._problem.objective_keep], axis=0), rows

    def _of_run(self, place: Array, chosen: tuple[int, ...]) -> dict[str, Array]:
        """Derivatives of what needs a run, by name: the sum over a variable's keys, each times its way."""
        names, variables = others_of(self._problem.keep), self._problem.continuous
        if not names:
            return {}
        keys = [key.key for one in variables for key in one.keys]
        self._runs.take(1 + 2 * len(keys))
        case = cases.load(self._problem.content, self._problem.overrides(place, chosen))
        system = cases.system(case.system).system(case)
        table = system.sensitivity(names, keys, fine=False, check=False, progress=lambda t: None).derivative
        found = np.zeros((len(names), place.size))
        for k, one in enumerate(variables):
            for key in one.keys:
                found[:, k] += table.sel(key=key.key).values * (key.high - key.low)
        if not np.all(np.isfinite(found)):
            raise InputError("a derivative is not finite")
        return dict(zip(names, found, strict=True))

    def _of_margins(self, place: Array, chosen: tuple[int, ...]) -> dict[str, Array]:
        """Central differences of margins at rest, by name."""
        found = {name: np.zeros(place.size) for name in self._margins}
        for k, unit in enumerate(np.eye(place.size) if found else ()):
            ends = [np.clip(place + side * STEP * unit, 0.0, 1.0) for side in (-1.0, 1.0)]
            low, high = (self._runs.margins(end, chosen, self._margins) for end in ends)
            for name in found:
                found[name][k] = (high[name] - low[name]) / (ends[1][k] - ends[0][k])
        return found

    def _differences(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array]:
        around = [np.clip(place + side * STEP * unit, 0.0, 1.0) for unit in np.eye(place.size) for side in (-1.0, 1.0)]
        found = self._runs.of([place, *around], chosen)
        self._counts[DIFFERENCES] += 1
        middle, others = found[0], found[1:]
        objective = np.zeros(place.size)
        values = np.zeros((middle.values.size, place.size))
        for k in range(place.size):
            low, high = others[2 * k], others[2 * k + 1]
            a, b = (low, around[2 * k]) if low.sound else (middle, place)
            c, d = (high, around[2 * k + 1]) if high.sound else (middle, place)
            if d[k] > b[k]:
                objective[k] = (c.objective - a.objective) / (d[k] - b[k])
                values[:, k] = (c.values - a.values) / (d[k] - b[k])
        return objective, values
