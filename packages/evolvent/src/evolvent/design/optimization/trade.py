"""What governs a design: active requirements with their multipliers, and what tolerances cost."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent.design.optimization.problem import DesignProblem, Spread, paths
from evolvent.design.optimization.runs import Designs
from evolvent.design.optimization.slopes import Slopes

Array = np.ndarray
#: Slack of a requirement, as a share of its size, and distance to a bound, as a share of the way, that count as none.
ACTIVE, AT_BOUND = 1e-4, 1e-6
#: Tolerance of keys that vary where none is given.
DEFAULT = "1%"


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Tolerance:
    """What a tolerance of keys does to the best design, to first order.

    Attributes
    ----------
    name : str, the keys
    text : str, the tolerance
    objective : float, largest change of the objective, in its unit
    changes : (requirements,) float, largest change of every requirement's value
    exceeds : tuple of int, requirements that the change of the value would break
    cost : float, by how much the objective gets worse where the design leaves room for the changes
    """

    name: str
    text: str
    objective: float
    changes: Array
    exceeds: tuple[int, ...]
    cost: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Trade:
    """Multipliers and tolerances of a design.

    Attributes
    ----------
    multipliers : (requirements,) float, how much better the objective gets for each unit by which the requirement is
        relaxed; 0 of a requirement that is not active
    slacks : (requirements,) float, what is left, in the unit of the requirement
    at_bounds : tuple of str, sentences on keys at their bounds
    residual : float, what is left of the objective's derivatives (by shares of the ways) without the multipliers' part,
        over their size or the objective, whichever is larger: near 0 at a smooth optimum
    tolerances : tuple of Tolerance, the dearest first
    """

    multipliers: Array
    slacks: Array
    at_bounds: tuple[str, ...]
    residual: float
    tolerances: tuple[Tolerance, ...]


def trade(
    runs: Designs, slopes: Slopes, place: Array, chosen: tuple[int, ...], tolerances: Mapping[str, Any] | None
) -> Trade:
    """What governs a design that meets all requirements.

    Parameters
    ----------
    runs, slopes : of the search
    place, chosen : the design
    tolerances : mapping, keys -> tolerance; None for `DEFAULT` of every variable

    Raises
    ------
    InputError
        For tolerances that cannot be used.
    OutOfRuns
    """
    problem = runs.problem
    result = runs.of([place], chosen)[0]
    objective, values = slopes.at(place, chosen)
    sense = -1.0 if problem.maximize else 1.0
    slacks = np.array([-one.short(v) for one, v in zip(problem.requirements, result.values, strict=True)])
    multipliers, sides, left = _multipliers(problem, place, runs.sizes[1], sense * objective, values, slacks)
    size = max(float(np.linalg.norm(objective)), abs(result.objective))
    found = [
        _tolerance(names, text, slope, problem, multipliers, slacks)
        for names, text, slope in _changes(runs, place, chosen, tolerances)
    ]
    return Trade(
        multipliers=multipliers, slacks=slacks, at_bounds=tuple(sides), residual=left / size if size > 0.0 else 0.0,
        tolerances=tuple(sorted(found, key=lambda one: -one.cost)),
    )  # fmt: skip


def _multipliers(
    problem: DesignProblem, place: Array, sizes: Array, slopes: Array, values: Array, slacks: Array
) -> tuple[Array, list[str], float]:
    """Multipliers of the requirements, sentences on the keys at their bounds, and the size of what is left of `slopes`.

    Notes
    -----
    Karush, Kuhn and Tucker: the derivative of what is minimized is a combination, with factors from 0, of the
    derivatives of the slacks of active requirements and bounds; the factors are found by least squares.
    """
    upper = np.array([1.0 if one.upper else -1.0 for one in problem.requirements])
    active = [k for k in range(slacks.size) if slacks[k] <= ACTIVE * sizes[k]]
    columns = [-upper[k] * values[k] / sizes[k] for k in active]
    ends: list[tuple[int, float]] = []
    for k in range(place.size):
        for side, at in ((1.0, place[k] <= AT_BOUND), (-1.0, place[k] >= 1.0 - AT_BOUND)):
            if at:
                ends.append((k, side))
                columns.append(side * np.eye(place.size)[k])
    multipliers = np.zeros(slacks.size)
    if not columns:
        return multipliers, [], float(np.linalg.norm(slopes))
    factors, left = scipy.optimize.nnls(np.stack(columns, axis=1), slopes)
    for k, factor in zip(active, factors, strict=False):
        multipliers[k] = factor / sizes[k]
    sentences = []
    for (k, side), factor in zip(ends, factors[len(active) :], strict=True):
        one = problem.continuous[k]
        bound = one.keys[0].low if side > 0.0 else one.keys[0].high
        which = "lower" if side > 0.0 else "upper"
        gain = factor / (one.keys[0].high - one.keys[0].low)
        unit = f" {one.keys[0].unit}" if one.keys[0].unit else ""
        sentences.append(
            f"{one.name} is at its {which} bound, {bound:.6g}{unit}: each unit beyond it changes the objective by "
            f"{gain:.4g}{f' {problem.unit}' if problem.unit else ''}"
        )
    return multipliers, sentences, float(left)


def _changes(
    runs: Designs, place: Array, chosen: tuple[int, ...], tolerances: Mapping[str, Any] | None
) -> list[tuple[str, str, tuple[float, Array]]]:
    """Largest change of objective and values by every tolerance: (keys, text, (objective, values))."""
    problem = runs.problem
    own = problem.overrides(place, chosen)
    if tolerances is None:
        tolerances = {one.name: DEFAULT for one in problem.continuous}
    case = cases.load(problem.content, own)
    kind = cases.system(problem.content["system"]).Case
    found = []
    for names, text in tolerances.items():
        ends: list[dict[str, Any]] = [{}, {}]
        for key in paths(str(names), problem.content):
            spread = Spread.of(key, text, "tolerance", kind, problem.content)
            for end, value in zip(ends, spread.about(case).ends(), strict=True):
                end[key] = spread.written(value)
        low, middle, high = runs.beside(place, chosen, [ends[0], {}, ends[1]])
        sides = [one for one in (low, high) if one.sound]
        if not sides:
            found.append((str(names), str(text), (math.nan, np.full(middle.values.size, math.nan))))
            continue
        objective = max(abs(one.objective - middle.objective) for one in sides)
        values = np.max([np.abs(one.values - middle.values) for one in sides], axis=0)
        found.append((str(names), str(text), (objective, values)))
    return found


def _tolerance(
    name: str, text: str, change: tuple[float, Array], problem: DesignProblem, multipliers: Array, slacks: Array
) -> Tolerance:
    objective, values = change
    exceeds = tuple(int(k) for k in np.flatnonzero(~(values <= slacks)))
    cost = float(np.sum(multipliers * np.maximum(np.nan_to_num(values) - np.maximum(slacks, 0.0), 0.0)))
    return Tolerance(name=name, text=text, objective=objective, changes=values, exceeds=exceeds, cost=cost)
