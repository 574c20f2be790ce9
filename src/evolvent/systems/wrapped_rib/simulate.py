"""Runs of a case: what is refused before one, its solver, its samples."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, codecache
from evolvent.errors import InputError, in_keys, naming_keys
from evolvent.systems._common import refuse_laws, sample_times
from evolvent.systems.wrapped_rib import advice
from evolvent.systems.wrapped_rib.case import IMPLICIT, Case
from evolvent.systems.wrapped_rib.dataset import dataset_of
from evolvent.systems.wrapped_rib.kinematics import Motion, motion_of
from evolvent.systems.wrapped_rib.show import estimating_string
from evolvent.systems.wrapped_rib.start import start
from evolvent.systems.wrapped_rib.structure import build

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers import Solution

#: Largest number of steps of a fixed length that a run may take.
MOST_STEPS = 100_000_000
#: Where the tip's speed is looked for between samples, of the time in which a light string is wound; and how finely.
WHIP, WHIP_SAMPLES = (0.99, 1.05), 2000
#: Keys of what messages of the solvers name of the parts.
KEYS = {"law": "contact.law", "damping": "contact.damping", "stiffness_damping": "damping.beta"}


def stepping(case: Case) -> dict[str, Any]:
    """What the section ``solver`` asks of an `evolvent.Stepper`, by the names of its arguments."""
    solver = case.solver
    if solver.method != IMPLICIT:
        raise InputError(f"solver.method is {solver.method!r}; a rib is stepped from outside by {IMPLICIT} alone")
    step = None if solver.step == "auto" else float(solver.step)
    return {"step": step, "tolerance": solver.tolerance, "spectral_radius": solver.spectral_radius}


def plan(case: Case, *, laws: Mapping[str, Any] | None = None) -> cases.Plan:
    """Check and prepare a case; nothing long is compiled.

    Raises
    ------
    InputError
        If laws are given (this system places none), or the case cannot be run.
    """
    refuse_laws(laws, case.system)
    _check(case)
    samples = _samples(case)
    begin = start(case)
    assembly = build(case, begin=begin).assemble()
    method, step = case.solver.method, case.solver.step
    keys = cases.solver_keys(case) | KEYS
    ready, solver, note = None, IMPLICIT, ""
    if method != IMPLICIT:
        solver = _compiled(method)
        if step != "auto":
            with naming_keys(cases.solver_keys(case)):
                ready = _explicit(case, assembly, samples)
        length = advice.explicit_step(case)
        note = (
            f"{method} takes {'' if step != 'auto' else 'about '}{case.duration / length:.2g} steps of "
            f"{length:.2g} s over {case.duration:.6g} s, with penalties of {case.penalty[0]:.3g} N/m in place of the "
            f"ribs' joints; {IMPLICIT} takes some thousand"
        )

    def run(progress: Callable[[float], None] | None = None) -> xr.Dataset:
        every, kept = _with_whip(case, samples)
        with naming_keys(keys):
            prepare = _implicit if method == IMPLICIT else _explicit
            solution = (ready or prepare(case, assembly, every)).run(progress)
        if method != IMPLICIT:
            codecache.mark_warm(solver)
            solution.message = solution.message.replace("or `method` dopri5", f"or `method` {IMPLICIT}")
            solution.statistics["penalty_stiffness"] = case.penalty[0]
        solution = dataclasses.replace(solution, message=in_keys(solution.message, keys))
        solution = solution.or_start(float(samples[0]))
        peaks = _peaks(case, motion_of(case, begin, solution.assembly, solution), solution.t)
        return dataset_of(case, begin, solution.assembly, _thinned(solution, kept[: solution.t.size]), peaks)

    return cases.Plan(duration=float(samples[-1]), run=run, solver=solver, note=note)


def _compiled(method: str) -> str:
    """Name under which an explicit method with beams is known as compiled, for it compiles more than without."""
    return f"{method} with beams"


def _check(case: Case) -> None:
    """Refuse what no part does yet."""
    if case.solver.method != IMPLICIT:
        _check_explicit(case)
    step = case.solver.step
    if step != "auto" and case.duration > MOST_STEPS * float(step):
        raise InputError(
            f"solver.step is {float(step):.3g} s; that makes {case.duration / float(step):.2g} steps, more than "
            f"{MOST_STEPS:.0e}; take a longer one"
        )


def _check_explicit(case: Case) -> None:
    """Refuse what explicit methods cannot carry, and a run of too many steps."""
    solver, drive = case.solver, case.drive
    instead = f"take solver.method: {IMPLICIT}"
    if drive is not None and drive.kind != "torque":
        moved = "the hub" if drive.kind == "hub" else "the tip"
        raise InputError(
            f"drive.kind is {drive.kind!r}, which moves {moved} by a law that {solver.method} cannot follow; {instead}"
        )
    if case.contact.friction > 0.0:
        raise InputError(
            f"contact.friction is {case.contact.friction:g}, which is known step by step only, not to {solver.method}; "
            f"{instead}, or leave it out"
        )
    if case.contact.self:
        raise InputError(f"contact.self is true, which {solver.method} does not know; {instead}, or leave it out")
    step = advice.explicit_step(case)
    if case.duration > MOST_STEPS * step:
        which = "solver.step" if solver.step != "auto" else f"the longest safe step of {solver.method}"
        raise InputError(
            f"{which} is about {step:.2g} s; that makes {case.duration / step:.2g} steps over {case.duration:.6g} s, "
            f"more than {MOST_STEPS:.0e}; shorten solver.duration, take cables, fewer rib.elements or a smaller "
            f"contact.stiffness, or {instead}"
        )


def _samples(case: Case) -> np.ndarray:
    """Times of the samples; no fixed step is cut short for one."""
    every = case.output.every
    if case.solver.step != "auto":
        every = max(every, float(case.solver.step))
    return sample_times(every, case.duration, values=24 * case.rib.count * (case.rib.elements + 1))


def _implicit(case: Case, assembly: Assembly, samples: np.ndarray) -> Any:
    """The run by generalized-alpha, prepared."""
    from evolvent.solvers.implicit import plan as plan_implicit

    solver = case.solver
    step = None if solver.step == "auto" else float(solver.step)
    return plan_implicit(
        assembly, samples=samples, step=step, tolerance=solver.tolerance, spectral_radius=solver.spectral_radius
    )


def _explicit(case: Case, assembly: Assembly, samples: np.ndarray) -> Any:
    """The run by an explicit method, prepared; a step of its own choice is a share of the stability limit of rk4."""
    from evolvent.solvers.drive import METHODS
    from evolvent.solvers.drive import plan as plan_explicit
    from evolvent.solvers.stability import stability_limit

    solver = case.solver
    if solver.step != "auto":
        return plan_explicit(assembly, samples=samples, method=solver.method, step=float(solver.step))
    found = plan_explicit(assembly, samples=samples, method=solver.method)
    assert found.mode is not None
    assert found.step is not None
    limit = stability_limit(METHODS["rk4"], found.mode, float(samples[-1]))
    return dataclasses.replace(found, step=min(found.step, advice.SHARE * limit))


def _with_whip(case: Case, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times of the samples with those between them at which the tip's speed is looked at; which of them are kept.

    The last bit of a rib whips onto the hub within some ms.
    """
    string = estimating_string(case) if case.solver.step == "auto" else None
    if string is None or not math.isfinite(string.end_time):
        return samples, np.ones(samples.size, dtype=bool)
    low, high = (share * string.end_time for share in WHIP)
    between = np.linspace(low, high, WHIP_SAMPLES)
    between = between[between < samples[-1]]
    nearest = np.abs(samples[np.clip(np.searchsorted(samples, between), 1, None) - 1] - between)
    nearest = np.minimum(nearest, np.abs(samples[np.searchsorted(samples, between)] - between))
    times = np.concatenate([samples, between[nearest > 1e-9 * samples[-1]]])
    order = np.argsort(times)
    return times[order], order < samples.size


def _thinned(solution: Solution, kept: np.ndarray) -> Solution:
    """The samples that are kept, and the last one."""
    chosen = kept.copy()
    chosen[-1] = True
    return solution.chosen(chosen)


def _peaks(case: Case, motion: Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest speed of each tip (m/s), and when (s)."""
    speed = np.linalg.norm(motion.rates[:, :, -1, 0], axis=-1)
    at = np.argmax(speed, axis=0)
    return speed[at, np.arange(case.rib.count)], time[at]
