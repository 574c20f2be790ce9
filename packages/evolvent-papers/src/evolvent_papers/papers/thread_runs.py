"""Deployments of the heliogyro with the data of Tenenbaum (2014), for figures and claims."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

import evolvent
from evolvent import cases
from evolvent.solvers.time.explicit.plan import choose_step

Array = np.ndarray
CASE = "heliogyro"
#: The paper's stiffness of a segment, N/m, and the one of the quick forms.
STIFFNESS, QUICK_STIFFNESS = 1e7, 1e4
#: Step of explicit RK4, of its stability limit.
SHARE = 0.8
#: Intervals over which lags are averaged, s.
WINDOWS = ((7.0, 20.0), (20.0, 60.0), (60.0, 100.0), (100.0, 142.0))
#: Keys that all runs of figures share; tests shorten them.
SHARED: dict[str, Any] = {}
#: Links of fixed length: the limit of infinite stiffness.
RIGID = {"blade.segments": "inextensible", "solver.method": "dopri5"}
#: The same with tolerances that leave the fifth decimal of a lag in degrees.
TIGHT = RIGID | {"solver.rtol": 1e-11, "solver.atol": 1e-13}


class Trial(NamedTuple):
    """A deployment that is asked for.

    Attributes
    ----------
    label : str
    overrides : mapping, of the case's keys
    seconds : float, CPU time that it takes, about
    """

    label: str
    overrides: Mapping[str, Any]
    seconds: float


class Deployment(NamedTuple):
    """What figures need of a run.

    Attributes
    ----------
    t : (nt,) float, s
    lag : (nt,) float, deg, of the tip; NaN at the start
    rate, formula, corrected : (nt,) float, rad/s, of the body: computed, by (18), and by (18) with the spools' offset
    status : str
    """

    t: Array
    lag: Array
    rate: Array
    formula: Array
    corrected: Array
    status: str


def tree(overrides: Mapping[str, Any]) -> Any:
    """The results of the case with other values of its keys; kept, so that claims share runs."""
    return _tree(tuple(sorted(overrides.items())))


@functools.lru_cache(maxsize=24)
def _tree(overrides: tuple[tuple[str, Any], ...]) -> Any:
    return evolvent.run(CASE, dict(overrides))


def deployed(overrides: Mapping[str, Any]) -> Deployment:
    """A deployment with other values of the case's keys."""
    return read(tree(overrides))


def read(run: Any) -> Deployment:
    """The results that figures need."""
    return Deployment(
        t=run.time.values,
        lag=np.degrees(run.tip_lag.values[:, 0]),
        rate=run.body_rate.values,
        formula=run.body_rate_paper.values,
        corrected=run.body_rate_corrected.values,
        status=run.attrs["status"],
    )


@functools.cache
def stability_limit(nodes: int, stiffness: float, damping: float = 1e-3) -> float:
    """Longest stable step of RK4, s."""
    given = {"blade.nodes": nodes, "blade.stiffness": stiffness, "blade.damping": damping}
    case = cases.load(CASE, given)
    return float(choose_step(cases.system(case.system).build(case).assemble(), "rk4", None, 1.0)[1])


def springs(nodes: int, stiffness: float, *, damping: float = 1e-3, step: float | None = None) -> Trial:
    """A run of springs: generalized-alpha with a step, RK4 near its stability limit without."""
    keys = {"blade.nodes": nodes, "blade.stiffness": stiffness, "blade.damping": damping}
    if step is None:
        step = SHARE * stability_limit(nodes, stiffness, damping)
        method, cost = "rk4", 0.2e-6 + 3.5e-8 * nodes
    else:
        method, cost = "generalized-alpha", 5e-6 + 4e-7 * nodes
    label = f"n = {nodes}, c = {stiffness:g} N/m, d = {damping:g} N s/m, {method}, step {step:.3g} s"
    return Trial(label, keys | {"solver.method": method, "solver.step": step}, 1.0 + cost * 142.857 / step)


def run_all(trials: Sequence[Trial], report: Callable[[str], None]) -> Iterator[tuple[Trial, Deployment]]:
    """Run one trial after another; Ctrl-C ends them, and an interrupted run is the last one.

    Raises
    ------
    KeyboardInterrupt
        Where it ends the first run.
    """
    left, spent, done = sum(one.seconds for one in trials), 0.0, 0.0
    for k, trial in enumerate(trials):
        scale = spent / done if done > 0.0 else 1.0
        report(f"run {k + 1} of {len(trials)}: {trial.label}; about {math.ceil(left * scale)} s left")
        began = time.perf_counter()
        try:
            found = read(evolvent.run(CASE, {**trial.overrides, **SHARED}))
        except KeyboardInterrupt:  # while a function is compiled
            if k == 0:
                raise
            return
        spent, done, left = spent + time.perf_counter() - began, done + trial.seconds, left - trial.seconds
        yield trial, found
        if found.status == "interrupted":
            return


def means(one: Deployment) -> list[float]:
    """Mean lag of the tip over `WINDOWS`, deg; NaN of those that the run does not reach."""
    parts = [one.lag[(one.t >= low) & (one.t <= high)] for low, high in WINDOWS]
    return [
        float(part.mean()) if one.t[-1] >= high else math.nan for part, (_, high) in zip(parts, WINDOWS, strict=True)
    ]


def gap(formula: Array, rate: Array) -> Array:
    """Distance of a formula from the computed rate, of the computed rate, percent."""
    return 100.0 * np.abs(formula - rate) / rate


def largest(difference: Array, t: Array, since: float = 1.0) -> float:
    """Largest absolute difference after the first second."""
    return float(np.abs(difference[t >= since]).max())
