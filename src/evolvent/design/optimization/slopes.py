"""Derivatives of the results of a design by the shares of the ways between the bounds."""

from __future__ import annotations

import numpy as np

from evolvent.design.optimization.runs import Runs

Array = np.ndarray
#: Share of the way between the bounds by which a key changes for a difference: results of adaptive steps have errors
#: of some 1e-6 that vary from run to run.
STEP = 1e-3


class Slopes:
    """Derivatives by central differences, one-sided at a bound and where one of the two designs has no result."""

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._known: dict[tuple[bytes, tuple[int, ...]], tuple[Array, Array]] = {}

    def at(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array]:
        """Derivatives of the objective (variables,), and of the requirements' values (requirements, variables).

        Parameters
        ----------
        place : (variables,) float, from 0 to 1
        chosen : numbers of the choices
        """
        key = (place.tobytes(), chosen)
        if key not in self._known:
            self._known[key] = self._differences(place, chosen)
        return self._known[key]

    def _differences(self, place: Array, chosen: tuple[int, ...]) -> tuple[Array, Array]:
        around = [np.clip(place + side * STEP * unit, 0.0, 1.0) for unit in np.eye(place.size) for side in (-1.0, 1.0)]
        found = self._runs.of([place, *around], chosen)
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
