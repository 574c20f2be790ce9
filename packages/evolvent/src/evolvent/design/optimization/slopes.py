"""Derivatives of the results of a design by the shares of the ways between the bounds."""

from __future__ import annotations

import dataclasses

import numpy as np

from evolvent.analysis.margins.kept_margins import AT_REST, others_of
from evolvent.design.evaluator.differences import central
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.optimization.runs import Designs, value_of
from evolvent_base.errors import EvolventError, InputError

Array = np.ndarray
#: Share of the way between the bounds by which a key changes for a difference: results of adaptive steps have errors
#: of some 1e-6 that vary from run to run.
STEP = 1e-3
#: How derivatives are found: by the adjoint where it is estimated to take less time than differences, else by these; of
#: the discrete solution where it has them, by the adjoint or by neighbours; or by differences alone.
AUTO, ADJOINT, DISCRETE, DIFFERENCES = "auto", "adjoint", "discrete", "differences"
WAYS = (AUTO, ADJOINT, DISCRETE, DIFFERENCES)
#: Designs one after another without derivatives of the discrete solution from which on only differences are taken.
_GIVEN_UP = 3


class Slopes:
    """Derivatives of the discrete solution (`evolvent.System.sensitivity`), or central differences.

    Of the discrete solution by the adjoint, or by neighbours. `AUTO` takes the adjoint where it is estimated to take
    less time than differences; where a run turns out to have none, differences from then on.

    Differences are one-sided at a bound and where one of the two designs has no result. Margins at rest, which need no
    run, are always differences.

    Parameters
    ----------
    runs : Designs
    way : one of `WAYS`
    """

    def __init__(self, runs: Designs, way: str) -> None:
        self._runs, self._problem = runs, runs.problem
        self._known: dict[tuple[bytes, tuple[int, ...]], tuple[Array, Array]] = {}
        self._margins = tuple(name for name in runs.problem.keep if not others_of([name]))
        self._at_rest = Evaluator(dataclasses.replace(runs.runs, keep=self._margins))
        self._counts = {DISCRETE: 0, DIFFERENCES: 0}
        self._mode = "forward" if way == DISCRETE else "adjoint"
        self._most, self._chosen = _GIVEN_UP, ""
        self._why, self._failed = "", 0
        if way == DIFFERENCES:
            self._failed = _GIVEN_UP
        elif runs.problem.content["system"] != "structure":
            self._give_up("the case is no structure")
        elif runs.problem.dispersed is not None:
            self._give_up("results are quantiles")
        elif any(name.rpartition(".")[2] != AT_REST for name in self._margins):
            self._give_up("margins along the run and clearances have none")
        elif way == AUTO and others_of(runs.problem.keep):
            self._most = 1  # until one is found
            self._choose()

    def _choose(self) -> None:
        """Give the adjoint up where there is none, or differences are estimated to take less time."""
        problem = self._problem
        place, chosen = np.array([one.start for one in problem.continuous]), (0,) * len(problem.discrete)
        keys, most = [key.key for one in problem.continuous for key in one.keys], 2 * place.size
        if not keys:
            return
        try:
            cost = self._runs.runs.adjoint_cost(problem.overrides(place, chosen), keys)
        except EvolventError as error:
            self._give_up(_short(error))
            return
        if cost >= most:
            self._give_up(f"they take {most} runs, the adjoint some {cost:.0f}")
        else:
            self._chosen = f", by the adjoint: the time of some {cost:.0f} runs, where differences take {most}"

    def _give_up(self, why: str) -> None:
        self._why, self._failed = why, _GIVEN_UP

    @property
    def found_by(self) -> str:
        """How derivatives were found; '' where none were."""
        discrete, differences = self._counts[DISCRETE], self._counts[DIFFERENCES]
        by = self._chosen or (", by the adjoint" if self._mode == "adjoint" else "")
        exact = f"those of the discrete solution{by}" + (", of margins central differences" if self._margins else "")
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
            self._why, self._failed = _short(error), self._failed + 1
            if self._failed >= self._most:
                self._failed = _GIVEN_UP
            return None
        self._failed, self._most = 0, _GIVEN_UP
        self._counts[DISCRETE] += 1
        rows = np.array([found[one.keep] for one in self._problem.requirements]).reshape(-1, place.size)
        return np.sum([found[name] for name in self._problem.objective_keep], axis=0), rows

    def _of_run(self, place: Array, chosen: tuple[int, ...]) -> dict[str, Array]:
        """Derivatives of what needs a run, by name: the sum over a variable's keys, each times its way."""
        names, variables = others_of(self._problem.keep), self._problem.continuous
        if not names:
            return {}
        keys = [key.key for one in variables for key in one.keys]
        self._runs.take(1 if self._mode == "adjoint" else 1 + 2 * len(keys))
        by_key = self._runs.runs.derivatives(self._problem.overrides(place, chosen), keys, mode=self._mode)
        ways = [(k, key.high - key.low) for k, one in enumerate(variables) for key in one.keys]
        found = np.zeros((len(names), place.size))
        for own, (k, way) in zip(by_key.T, ways, strict=True):
            found[:, k] += own * way
        if not np.all(np.isfinite(found)):
            raise InputError("a derivative is not finite")
        return dict(zip(names, found, strict=True))

    def _of_margins(self, place: Array, chosen: tuple[int, ...]) -> dict[str, Array]:
        """Central differences of margins at rest, by name."""

        def values(places: list[Array]) -> list[Array]:
            found = self._at_rest.of([self._problem.overrides(one, chosen) for one in places])
            for one in found:
                if one.status == "failed":
                    raise InputError(one.reason)
            return [np.array([value_of(one, name) for name in self._margins]) for one in found]

        return dict(zip(self._margins, central(values, place, STEP, 0.0, 1.0), strict=True)) if self._margins else {}

    def _differences(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array]:
        """Central differences; 0 where neither side has a result."""

        def values(places: list[Array]) -> list[Array]:
            return [np.array([one.objective, *one.values]) for one in self._runs.of(places, chosen)]

        found = np.nan_to_num(central(values, place, STEP, 0.0, 1.0))
        self._counts[DIFFERENCES] += 1
        return found[0], found[1:]


def _short(error: EvolventError) -> str:
    """Why there are no derivatives, in one line, without the advice to take another mode."""
    return " ".join(str(error).split()).partition("; take mode")[0]
