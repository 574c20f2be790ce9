"""Runs by implicit steps, under any of `METHODS`: plan one, then run it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evolvent.algebra.sparse import SparseBlocks
from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import zeros_record
from evolvent.kernels import law_means, rigid
from evolvent.model import Model
from evolvent.model.registry import along_axes, asked, families as table
from evolvent.parts.checks import number, positive
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.laws import refusing_laws, try_laws
from evolvent.solvers.common.matrices import matrix_for, matrix_of
from evolvent.solvers.common.sizes import energy_floor, round_off_energy, sizes
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.start import STEP_ALLOWED, acts_from_outside, check_start, sample_times
from evolvent.solvers.time.implicit import reactions
from evolvent.solvers.time.implicit.methods import ENERGY_MOMENTUM, METHODS, NAME
from evolvent.solvers.time.implicit.run import ImplicitRun, rows_of_part
from evolvent.solvers.time.implicit.setup import error_sizes, paid_out_energy, shares, stops_of, workspace
from evolvent.solvers.time.implicit.step_error import LEAST_NEWTON, LEFT_SHARE, rate_tolerance
from evolvent.solvers.time.implicit.workspace import OPTIONS, Workspace
from evolvent_base.errors import InputError

__all__ = [
    "ENERGY_MOMENTUM",
    "METHODS",
    "NAME",
    "ImplicitPlan",
    "ImplicitRun",
    "matrix_of",
    "plan",
    "rows_of_part",
    "solve_implicit",
]

#: Part of the energy moved that energy-momentum may gain by round-off and by what Newton's method leaves.
LARGEST_GAIN = 1e-3


@dataclasses.dataclass(frozen=True)
class ImplicitPlan:
    """An implicit run, checked and prepared.

    Attributes
    ----------
    assembly : Assembly, with a model of the run's own
    method : one of `METHODS`
    times : (nt,) float, s, of the samples
    step : float, s, of fixed steps; None where they follow from the tolerance
    matrix : SparseBlocks, room for the tangent and its factors
    weight : (nv,) float, size of each unknown that counts as 1
    options : record `workspace.OPTIONS`
    asked : what the numbers of `options` follow from
    """

    assembly: Assembly
    method: str
    times: np.ndarray
    step: float | None
    matrix: SparseBlocks
    weight: np.ndarray
    options: np.record
    asked: _Asked

    #: Fields of the workspace that a plan has made.
    made: ClassVar[tuple[str, ...]] = ("options", "weight", "error_weight", "shares", "stops")

    def again(self, assembly: Assembly) -> dict[str, Any]:
        """The fields `made` of the plan that another model of the same structure would have.

        Parameters
        ----------
        assembly : with a model of its own, that of the plan with other numbers

        Raises
        ------
        InputError
            Where loads change at another number of times.
        """
        model, (weight, options) = assembly.model, _numbers(assembly, self.asked)
        stops, conserves = stops_of(assembly, self.times), bool(options.midpoint)
        if stops.shape != self._stops.shape:
            raise InputError(
                "other values change the number of times at which loads change; use evolvent.simulate_many"
            )
        return {
            "options": options, "weight": weight, "stops": stops,
            "error_weight": error_sizes(model, weight, conserves=conserves),
            "shares": shares(model, weight, conserves=conserves),
        }  # fmt: skip

    @functools.cached_property
    def _stops(self) -> np.ndarray:
        """Times at which loads or joints change (`setup.stops_of`)."""
        return stops_of(self.assembly, self.times)

    def workspace(self) -> Workspace:
        """The loop's workspace at the start of a run."""
        return workspace(self.assembly, self.times, self.weight, self.options.copy())

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Integrate; `progress` is called with the time reached, a few times a second.

        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

        Raises
        ------
        InputError
            For constraints that contradict or repeat one another.
        """
        return ImplicitRun(self).solution(progress)


def plan(
    assembly: Assembly,
    *,
    samples: Any,
    method: str = NAME,
    step: float | None = None,
    tolerance: float = 1e-4,
    spectral_radius: float | None = None,
    newton: float | None = None,
    largest_gain: float | None = None,
    longest_step: float | None = None,
    own: bool = False,
) -> ImplicitPlan:
    """Check and prepare a run by implicit steps, joints as constraints of index 3.

    Parameters
    ----------
    assembly : Assembly, which is left as it is unless `own`
    samples : (nt,) float, s, increasing; the first is the start, the last the end; they cut no step
    method : one of `METHODS`
    step : float, s, fixed; None has it follow from `tolerance`
    tolerance : float, error of a step that is accepted, beside the size of the system (or 1 for slopes and turns); that
        of rates beside the fastest one follows from it (`step_error.rate_tolerance`)
    spectral_radius : float, at infinite frequency: 1 damps nothing. Of generalized-alpha 0 to 1, 0.3 if left out; 0
        damps all that the step does not resolve. Of energy-momentum 1/3 to 1, 1/3 if left out, which dissipates most;
        where nothing holds the system from outside the strains alone are filtered, which keeps the angular momentum.
    newton : float, correction at which an iteration has converged, beside the same sizes; left out, that of adaptive
        steps follows from the tolerance of rates as well (`step_error.newton_limit`)
    largest_gain : float, part of the energy moved that the balance may gain before the run fails
    longest_step : float, s, of an adaptive run
    own : bool, whether the run may take the model of the assembly, which nobody else uses, in place of a copy

    Raises
    ------
    InputError
        For arguments out of range, parts that the method does not support, constraints that contradict the start.
    """
    times, of = sample_times(samples), METHODS[method]
    span = float(times[-1] - times[0])
    rho = of.radius if spectral_radius is None else number(
        "spectral_radius", spectral_radius, allowed=f"from {of.least} to 1"
    )  # fmt: skip
    if not of.least_radius <= rho <= 1.0:
        under = f"under {method} " if of.least_radius > 0.0 else ""
        raise InputError(f"spectral_radius is {spectral_radius!r}; {under}it must be from {of.least} to 1")
    if step is not None:
        step = positive("step", step, allowed=STEP_ALLOWED)
    tolerance = positive("tolerance", tolerance)
    largest_gain = None if largest_gain is None else positive("largest_gain", largest_gain)
    newton = None if newton is None else positive("newton", newton)
    longest = span if longest_step is None else positive("longest_step", longest_step)
    families.check(assembly, of.solver, method)
    copied = assembly
    if not own:
        copied = dataclasses.replace(assembly, model=assembly.model.copy())
        needs.note_alike(assembly.model, copied.model)
    mine = with_positions(copied, float(times[0]))
    try_laws(mine, times[0], times[-1])
    with refusing_laws(mine):
        check_start(mine, float(times[0]))
    asked = _Asked(method, times, step, tolerance, rho, newton, largest_gain, longest)
    weight, options = _numbers(mine, asked)
    return ImplicitPlan(mine, method, times, step, matrix_for(mine), weight, options, asked)


class _Asked(NamedTuple):
    """Arguments of `plan`, checked."""

    method: str
    times: np.ndarray
    step: float | None
    tolerance: float
    rho: float
    newton: float | None
    largest_gain: float | None
    longest: float


def _numbers(mine: Assembly, asked: _Asked) -> tuple[np.ndarray, np.record]:
    """Sizes of the unknowns (nv,), and options of a run (`workspace.OPTIONS`)."""
    method, times, step, tolerance, rho, newton, largest_gain, longest = asked
    of, span = METHODS[method], float(times[-1] - times[0])
    weight, mass = sizes(mine)
    adaptive, conserves = step is None, bool(of.flags["conserves"])
    rated = adaptive and (conserves or rho < 1.0)  # undamped, algorithmic accelerations alternate
    sharp = LEFT_SHARE if rated and newton is None else 0.0
    floor, first = energy_floor(mine, mass, weight), min(1e-5 * span, 1e-4) if step is None else step
    if conserves:
        # the energy that a law between points states may be off what its forces do
        gain = eb.GAINED if _states_energies(mine.model) else LARGEST_GAIN
    else:
        gain, span = eb.GAINED, 10.0 * first if adaptive else first
        floor *= gain if largest_gain is None else largest_gain
    floor += round_off_energy(mine, times[0], (weight, mass))
    floor += (gain if largest_gain is None else largest_gain) * paid_out_energy(mine, times[0], times[-1])
    options = zeros_record(
        OPTIONS,
        method=of.code,
        newton=_newton(mine, conserves, step, tolerance) if newton is None else newton,
        sharp=sharp,
        tolerance=tolerance if adaptive else 0.0,
        rates=rate_tolerance(tolerance) if rated else 0.0,
        smallest=1e-13 * float(times[-1] - times[0]),
        longest=longest,
        first=first if conserves or not adaptive else 0.1 * span,
        gain=gain if largest_gain is None else largest_gain,
        floor=floor,
        mass=mass,
        span=span,
        laws=int(conserves and law_means.USED_FOR(mine.model)),
        **of.flags,
        **of.constants(rho),
    )
    return weight, options


def _states_energies(model: Model) -> bool:
    """Whether users' laws state energies of forces."""
    return any(any(law.stated for law in own.laws) and own.records(model).size for own in table().values())


def _newton(assembly: Assembly, conserves: bool, step: float | None, tolerance: float) -> float:
    """Correction at which an iteration has converged where none is given, beside the size of the unknowns."""
    model = assembly.model
    if conserves:
        return LEAST_NEWTON if step is not None or not acts_from_outside(model) else min(1e-3 * tolerance, 1e-6)
    taut = ((mask, getattr(model, name)) for name, mask in asked("implicit.taut").items())
    if any(rows.size and np.any(mask(rows)) for mask, rows in taut):
        return 1e-13
    free = np.sum(model.bodies["motion"] == rigid.FREE) - sum(own.size for own in along_axes(model))
    spins = bool(free > 0)  # bodies but the nodes of rods, whose error adds up step by step
    stiff = model.info.slender > 0
    if step is not None and (spins or (reactions.is_held(model) and not stiff)):  # what is held shows in reactions
        return 1e-12
    return 1e-9 if step is not None else min(1e-3 * tolerance, 1e-7)


def solve_implicit(assembly: Assembly, *, progress: Callable[[float], None] | None = None, **options: Any) -> Solution:
    """Integrate an assembled model by implicit steps: `plan`, whose options these are, and run.

    Parameters
    ----------
    progress : called with the time reached (s), a few times a second

    Returns
    -------
    Solution
        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

    Raises
    ------
    InputError
        As of `plan` and `ImplicitPlan.run`.
    """
    return plan(assembly, **options).run(progress)
