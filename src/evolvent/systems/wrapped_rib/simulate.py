"""Runs of a case: what is refused before one, its solver, its samples."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import analysis, cases, codecache
from evolvent.errors import InputError, in_keys, naming_keys
from evolvent.systems._common import refuse_laws
from evolvent.systems.wrapped_rib import advice, results
from evolvent.systems.wrapped_rib.case import IMPLICIT, Case
from evolvent.systems.wrapped_rib.show import estimating_string
from evolvent.systems.wrapped_rib.start import start
from evolvent.systems.wrapped_rib.structure import build

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers.solution import Solution

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
    every = case.output.every if case.solver.step == "auto" else max(case.output.every, float(case.solver.step))
    size = 24 * case.rib.count * (case.rib.elements + 1)
    with naming_keys({"every": "output.every"}):  # no fixed step is cut short for a sample
        samples = analysis.sample_times(case.duration, every, values=size)
    begin = start(case)
    assembly = build(case, begin=begin).assemble()
    _check(case, assembly)
    method, step = case.solver.method, case.solver.step
    keys, prepared, note = cases.solver_keys(case) | KEYS, None, ""
    if method != IMPLICIT:
        if step != "auto":
            with naming_keys(keys):
                prepared = _prepared(case, assembly, samples)
        length = advice.explicit_step(case)
        note = (
            f"{method} takes {'' if step != 'auto' else 'about '}{case.duration / length:.2g} steps of {length:.2g} s "
            f"over {case.duration:.6g} s, with penalties of {case.penalty[0]:.3g} N/m in place of the ribs' joints; "
            f"{IMPLICIT} takes some thousand"
        )
    solver = method if method == IMPLICIT else f"{method} with beams"  # which compiles more than without

    def solve(progress: Callable[[float], None] | None) -> tuple[Solution, results.Root]:
        every, kept = _with_whip(case, samples)
        with naming_keys(keys):
            found = (prepared or _prepared(case, assembly, every)).run(progress)
        message = found.message
        if method != IMPLICIT:
            codecache.mark_warm(solver)
            message = message.replace("or `method` dopri5", f"or `method` {IMPLICIT}")
            found.statistics["penalty_stiffness"] = case.penalty[0]
        found = dataclasses.replace(found, message=in_keys(message, keys)).or_start(float(samples[0]))
        peaks, kept = results.peaks_of(case, found), kept[: found.t.size].copy()
        kept[-1] = True
        found = found.chosen(kept)
        return found, results.derived(case, begin, found, peaks)

    def run(progress: Callable[[float], None] | None = None) -> xr.DataTree:
        solution, root = solve(progress)
        tree = analysis.tree(solution, case=cases.to_yaml(case), why="as asked for", system=case.system, root=root)
        tree.dataset = tree.to_dataset().set_coords("arc")
        tree.attrs.pop("warning", None)
        warnings = results.warnings(case, begin, tree)
        if warnings:
            tree.attrs["warning"] = "; ".join(warnings)
        return tree

    def observe(names: Iterable[str]) -> xr.Dataset:
        solution, root = solve(None)
        return analysis.observed(solution, names, system=case.system, root=root)

    def at_start() -> xr.DataTree:
        solution = analysis.at_start(assembly, method, float(samples[0]))
        root = results.derived(case, begin, solution, results.peaks_of(case, solution))
        return analysis.tree(solution, case="", why="", system=case.system, root=root)

    return cases.Plan(float(samples[-1]), run, solver=solver, note=note, start=at_start, observe=observe)


def _check(case: Case, assembly: Assembly) -> None:
    """Refuse what the method does not support, and a run of too many steps."""
    solver = case.solver
    analysis.choose_method(assembly, solver.method)
    if solver.step == "auto" and solver.method == IMPLICIT:
        return
    step = advice.explicit_step(case) if solver.step == "auto" else float(solver.step)
    if case.duration > MOST_STEPS * step:
        which = "solver.step is" if solver.step != "auto" else f"the longest safe step of {solver.method} is about"
        raise InputError(
            f"{which} {step:.3g} s; that makes {case.duration / step:.2g} steps over {case.duration:.6g} s, more than "
            f"{MOST_STEPS:.0e}; shorten solver.duration or take a longer step; explicit methods take longer ones with "
            f"cables, fewer rib.elements or a smaller contact.stiffness"
        )


def _prepared(case: Case, assembly: Assembly, samples: np.ndarray) -> Any:
    """The run, prepared; a step that an explicit method chooses is a share of the stability limit of rk4."""
    from evolvent.solvers.drive import METHODS
    from evolvent.solvers.stability import stability_limit

    solver = case.solver
    options: dict[str, Any] = {"method": solver.method, "step": None if solver.step == "auto" else float(solver.step)}
    if solver.method == IMPLICIT:
        options |= {"tolerance": solver.tolerance, "spectral_radius": solver.spectral_radius}
    found, _ = analysis.plan(assembly, samples, **options)
    if solver.method == IMPLICIT or solver.step != "auto":
        return found
    limit = stability_limit(METHODS["rk4"], found.mode, float(samples[-1]))
    return dataclasses.replace(found, step=min(found.step, advice.SHARE * limit))


def _with_whip(case: Case, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times of the samples with those between them at which the tip's speed is looked at; which of them are kept.

    The last bit of a rib whips onto the hub within some ms.
    """
    string = estimating_string(case) if case.solver.step == "auto" else None
    if string is None or not math.isfinite(string.end_time):
        return samples, np.ones(samples.size, dtype=bool)
    between = string.end_time * np.linspace(*WHIP, WHIP_SAMPLES)
    between = between[between < samples[-1]]
    after = np.clip(np.searchsorted(samples, between), 1, None)
    nearest = np.minimum(np.abs(samples[after - 1] - between), np.abs(samples[after] - between))
    times = np.concatenate([samples, between[nearest > 1e-9 * samples[-1]]])
    order = np.argsort(times)
    return times[order], order < samples.size
