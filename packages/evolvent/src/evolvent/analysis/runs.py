"""Runs of an assembled system: planned, solved, and made a tree of results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis import closed_loops
from evolvent.analysis.closure import check_energy_gain
from evolvent.analysis.methods import choose_method
from evolvent.analysis.settings import check_run, sample_times
from evolvent.analysis.trees import tree
from evolvent.assembly.assembled import Assembly
from evolvent.results.fine_samples import Times
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import plan as implicit
from evolvent_base.errors import InputError, RunFailed

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.solvers.common.solution import Solution
#: Default spectral radius of implicit methods: vibrations that the steps resolve keep their energy.
SPECTRAL_RADIUS = 0.9


def plan(
    assembly: Assembly,
    samples: np.ndarray,
    *,
    method: str = "auto",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    absolute_tolerance: float | None = None,
    own: bool = False,
) -> tuple[Any, str]:
    """A prepared run, and why its method is taken.

    Parameters
    ----------
    method, step, tolerance, spectral_radius : as of `evolvent.System.simulate`
    absolute_tolerance : float, of dopri5; a hundredth of `tolerance` if left out
    own : bool, whether an implicit run may take the model of the assembly in place of a copy

    Raises
    ------
    InputError
        As of `choose_method` and of the solvers; also for an option that the method does not have.
    """
    method, why = choose_method(assembly, method)
    explicit = explicit_plan.METHODS.get(method)
    adaptive = explicit is not None and explicit.is_adaptive
    if absolute_tolerance is not None and (not adaptive or tolerance is None):
        raise InputError(
            f"absolute_tolerance is {absolute_tolerance!r}, but the method is {method}; only dopri5 has one, "
            f"in addition to `tolerance`"
        )
    if method in implicit.METHODS:
        of = implicit.METHODS[method]
        options: dict[str, Any] = {"method": method, "step": step, "own": own}
        options["tolerance"] = of.tolerance if tolerance is None else tolerance
        least = max(SPECTRAL_RADIUS, of.least_radius)
        options["spectral_radius"] = least if spectral_radius is None else spectral_radius
        return implicit.plan(assembly, samples=samples, **options), why
    if spectral_radius is not None:
        raise InputError(
            f"spectral_radius is {spectral_radius!r}, but the method is {method}; only "
            f"{', '.join(implicit.METHODS)} have one"
        )
    options = {"method": method}
    if adaptive:
        if step is not None:
            raise InputError(
                f"step is {step!r} s, but the method is {method}, which chooses its steps; give `tolerance`"
            )
        if tolerance is not None:
            absolute = 1e-2 * tolerance if absolute_tolerance is None else absolute_tolerance
            options |= {"rtol": tolerance, "atol": absolute}
    else:
        if tolerance is not None:
            raise InputError(
                f"tolerance is {tolerance!r}, but the method is {method}, which has fixed steps; give `step`"
            )
        options["step"] = step
    return closed_loops.prepared(assembly, samples, **options), why


def solve(
    assembly: Assembly,
    *,
    until: float,
    every: float | None = None,
    fine: bool = True,
    progress: Callable[[float], None] | None = None,
    **settings: Any,
) -> tuple[Solution, str, Times]:
    """The motion of an assembled system, why its method is taken, and the times of its samples.

    Parameters
    ----------
    until, every : float, s
    fine : bool, whether finer samples are kept where the motion is fast
    settings : method and options of `plan`
    """
    samples = sample_times(until, every, values=assembly.y.size)
    check_run(assembly, samples, settings.get("step"))
    times = Times.of(samples, fine=fine, values=assembly.y.size)
    prepared, why = plan(assembly, times.all, **settings)
    solution, _ = times.chosen(prepared.run(progress).or_start(float(samples[0])))
    return check_energy_gain(solution), why, times


def simulate(
    assembly: Assembly, *, case: str | Callable[[], str], title: str = "", keep_states: bool = False,
    judge: Callable[[Solution], Mapping[str, str]] | None = None, **settings: Any,
) -> xr.DataTree:  # fmt: skip
    """Run an assembled system.

    Parameters
    ----------
    case, title, keep_states : as of `tree`
    judge : returns more attributes of the results of a solution
    settings : as of `solve`

    Raises
    ------
    RunFailed
        If the run did not reach its end; ``.run`` holds what was computed.
    """
    solution, why, times = solve(assembly, **settings)
    found = tree(solution, case=case, why=why, title=title, root=times.mark(solution.t), keep_states=keep_states)
    judged = {} if judge is None else judge(solution)
    if judged:  # without them the root is not computed yet
        found.attrs.update(judged)
    if solution.status == "failed":
        raise RunFailed(solution.message, found)
    return found
