"""Runs by the energy-momentum method: plan one, run it, report how it ended."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError
from evolvent.compiled.pointer import zeros_record
from evolvent.flow import energy_momentum as flow
from evolvent.flow.implicit import residual, tangent
from evolvent.flow.powers import N_POWERS
from evolvent.kernels import (
    contact,
    joint,
    rigid,
    rod,
    sides,
    springs,
)
from evolvent.kernels.sparse import INNER, SparseBlocks
from evolvent.parts.checks import number, positive
from evolvent.solvers import energy_loop, implicit
from evolvent.solvers.alpha_state import SHORT
from evolvent.solvers.balance import BALANCE, GAINED
from evolvent.solvers.drive import STEP_ALLOWED, sample_times
from evolvent.solvers.energy_messages import reason, stalled
from evolvent.solvers.implicit_messages import redundant
from evolvent.solvers.implicit_setup import check_start, energy_floor, matrix_of, shares, sizes
from evolvent.solvers.laws import broken_law, large_law, refusing_laws, try_laws
from evolvent.solvers.pace import Stall
from evolvent.solvers.sampled import Sampled, empty
from evolvent.solvers.solution import Solution
from evolvent.solvers.step_error import LEAST_NEWTON, LEFT_SHARE, rate_tolerance

#: Name of the method.
NAME = "energy-momentum"
#: Inner unknowns, summed over steps, after which turns that have come to lie on one another are coupled directly.
MOST_INNER = 20


@dataclasses.dataclass(frozen=True)
class Plan:
    """A run, checked and prepared.

    Attributes
    ----------
    assembly : Assembly, with a model of the run's own
    times : (nt,) float, s, of the samples
    step : float, s, of fixed steps; None where they follow from the tolerance
    matrix : SparseBlocks; weight : (nv,) float; options : record `energy_loop.OPTIONS`
    """

    assembly: Assembly
    times: np.ndarray
    step: float | None
    matrix: SparseBlocks
    weight: np.ndarray
    options: np.record

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Integrate; a run that fails keeps the samples that it reached."""
        return Run(self).solution(progress)


def plan(
    assembly: Assembly,
    *,
    samples: Any,
    step: float | None = None,
    tolerance: float = 1e-4,
    spectral_radius: float = 1.0 / 3.0,
    newton: float | None = None,
) -> Plan:
    """Check and prepare a run by the energy-momentum method.

    Parameters
    ----------
    assembly : Assembly, which is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end; they cut no step
    step : float, s, fixed; None has it follow from `tolerance`
    tolerance : float, error of a step that is accepted, beside the size of the system (or 1 for slopes and turns); that
        of rates beside the fastest one follows from it (`step_error.rate_tolerance`)
    spectral_radius : float, 1/3 to 1, at infinite frequency: 1 conserves energy, 1/3 dissipates most. Where nothing
        holds the system from outside the strains alone are filtered, which keeps the angular momentum.
    newton : float, correction at which an iteration has converged, beside the same sizes; left out, that of adaptive
        steps follows from the tolerance of rates as well (`step_error.newton_limit`)

    Raises
    ------
    InputError
        For arguments out of range, parts that the method does not support, constraints that contradict the start.
    """
    times = sample_times(samples)
    span = float(times[-1] - times[0])
    rho = number("spectral_radius", spectral_radius, allowed="from 1/3 to 1")
    if not 1.0 / 3.0 - 1e-9 <= rho <= 1.0:
        raise InputError(f"spectral_radius is {spectral_radius!r}; under {NAME} it must be from 1/3 to 1")
    if step is not None:
        step = positive("step", step, allowed=STEP_ALLOWED)
    tolerance = positive("tolerance", tolerance)
    families.check(assembly, families.ENERGY)
    own = dataclasses.replace(assembly, model=assembly.model.copy())
    try_laws(own, times[0], times[-1])
    with refusing_laws(own):
        check_start(own, float(times[0]))
    weight, mass = sizes(own)
    adaptive, sharp = step is None, 0.0
    if newton is None:
        newton = LEAST_NEWTON if not adaptive or not is_held(own.model) else min(1e-3 * tolerance, 1e-6)
        sharp = LEFT_SHARE if adaptive else 0.0
    options = zeros_record(
        energy_loop.OPTIONS,
        chi=rho * (1.0 - rho) / (1.0 + rho) ** 2,
        tolerance=tolerance if adaptive else 0.0,
        rates=rate_tolerance(tolerance) if adaptive else 0.0,
        newton=newton,
        sharp=sharp,
        smallest=1e-13 * span,
        longest=span,
        mass=mass,
        # laws between points alone are not made to do the work that they state; that is of third order in the step
        gain=energy_loop.LARGEST_GAIN if not own.model.flexible.custom_forces.size else GAINED,
        floor=energy_floor(own, mass, weight),
        first=min(1e-5 * span, 1e-4),
    )
    return Plan(own, times, step, matrix_of(own.model), weight, options)


def solve_energy(assembly: Assembly, *, progress: Callable[[float], None] | None = None, **options: Any) -> Solution:
    """Integrate an assembled model by the energy-momentum method: `plan`, whose options these are, and run."""
    return plan(assembly, **options).run(progress)


def is_held(model: Any, t: float = -math.inf) -> bool:
    """Whether something joins, pushes or pulls on the system from outside at t, beside gravity and loads."""
    f, free = model.flexible, model.bodies["motion"] == rigid.FREE
    joints, hinges, markers = f.joints[t <= f.joints["until"]], f.hinges, model.markers
    fixed = [~free[joints["index"][joints["on"] == sides.ON_BODY]], joints["kind"] == joint.ANGLE]
    fixed += [~free[hinges["body"]], ~free[hinges["other"][hinges["on"] == sides.ON_BODY]]]
    fixed += [~free[f.cylinders["body"]], ~free[f.body_contacts["a"]], ~free[f.body_contacts["b"]]]
    fixed += [~free[f.gear_coordinates["body"]], ~free[f.gear_coordinates["other"]]]
    own = [np.arange(row["first_marker"], row["first_marker"] + row["points"]) for row in f.custom_forces]
    used = np.concatenate([model.springs["a"], model.springs["b"], *own]).astype(int)
    fixed += [f.custom_forces["points"] == 1]
    fixed += [~free[markers["index"][used][markers["kind"][used] == springs.ON_BODY]]]
    return any(bool(np.any(one)) for one in fixed)


def workspace(of: Plan) -> energy_loop.EnergyLoop:
    """The loop's workspace at the start of a run."""
    assembly, model, times = of.assembly, of.assembly.model, of.times
    f, n_v, n_b = model.flexible, int(model.info.nv), model.bodies.size
    n_j, n_c, fields = f.joints.size, f.cylinders.size, len(BALANCE.names or ())
    contact.clear_history(model)
    chi = float(of.options.chi)
    f.switches[:] = assembly.s
    until = f.joints["until"]
    stops = np.unique(np.concatenate([f.beam_loads["start"] + f.beam_loads["ramp"], model.breaks, until]))
    stops = stops[(stops > times[0]) & (stops < times[-1])]
    step = flow.EnergyStep(
        step=zeros_record(flow.STEP, t=times[0], chi=chi, chi_v=chi if is_held(model) else 0.0, soft=1.0),
        **{name: assembly.y.copy() for name in ("y0", "y1", "ym")},
        **{name: np.zeros(n_v) for name in ("dq", "dv", "before")},
        la=np.zeros(n_j),
        r=np.zeros(n_v + n_j),
        strains=np.zeros((f.elements.size, 28)),
        strains_before=np.zeros((f.elements.size, 28)),
        **{name: np.zeros((f.rod_elements.size, rod.MEASURES)) for name in ("rods0", "rods1")},
        **{name: np.zeros((f.rod_elements.size, 6)) for name in ("rods", "rods_before")},
        **{name: np.zeros((n_b, 3, 3)) for name in ("R0", "R1")},
        **{name: np.zeros((n_b, 3)) for name in ("x0", "x1")},
        powers=np.zeros(N_POWERS),
        contact=np.zeros(2),
    )
    first = of.step if of.step is not None else float(of.options.first)
    out = empty(model, times.size)
    return energy_loop.EnergyLoop(
        step=step,
        options=of.options.copy(),
        loop=zeros_record(
            energy_loop.LOOP, time=times[0], wanted=first, length=first, event_step=math.inf, quality=1.0
        ),
        weight=of.weight,
        shares=shares(model, of.weight),
        x=np.zeros(n_v + n_j),
        la0=np.zeros(n_j),
        dq0=np.zeros(n_v),
        la1=np.zeros(n_j),
        rate=np.zeros(n_v),
        acceleration=np.zeros(n_v),
        paths=np.zeros(n_j),
        balance0=np.zeros(fields),
        balance=np.zeros(fields),
        energies=np.zeros(3),
        impulse0=np.zeros(n_c),
        impulse=np.zeros(n_c),
        touched0=np.zeros(f.body_contacts.size),
        touched=np.zeros(f.body_contacts.size),
        wrenches=np.zeros((n_b, 6)),
        momenta=np.zeros(6),
        samples=times.copy(),
        stops=stops,
        out_y=np.zeros((times.size, assembly.y.size)),
        out_a=out.acceleration,
        out_la=out.la,
        log_t=np.zeros(f.hinges.size + model.events.size),
        log_k=np.zeros(f.hinges.size + model.events.size, dtype=np.int64),
        out_s=np.zeros((times.size, assembly.s.size), dtype=np.int64),
        out_balance=np.zeros((times.size, fields)),
        out_momenta=np.zeros((times.size, 6)),
        out_cylinders=out.cylinders,
        out_touches=out.touches,
        out_friction=out.friction,
        out_points=np.zeros((times.size, f.contact_points.size)),
        out_bodies=out.wrenches,
    )


class Run(implicit.Run):
    """A plan that runs."""

    name = NAME

    def _loaded(self) -> Any:
        """The loop's workspace, when the functions that the run calls are loaded."""
        self._hold_joints()
        for_rank = (residual, tangent) if self.model.flexible.joints.size else ()
        needs.load(self.model, energy_loop.begin, energy_loop.advance, *for_rank)
        self.has_layers = bool(np.any(self.model.flexible.cylinders["under"] >= 0))
        return workspace(self.plan)

    def begin(self) -> str:
        """Start the loop; as of generalized-alpha."""
        self.find_rank(self.reached, self.assembly.y)
        energy_loop.begin(self.model, self.plan.matrix, self.work)
        if self.has_layers:
            self._couple_layers()
        return ""

    def _rank_matrix(self) -> SparseBlocks:
        """As of generalized-alpha, whose tangent does not couple turns on one another directly."""
        return matrix_of(self.model) if self.has_layers else self.plan.matrix

    @property
    def inertia(self) -> tuple[float, float]:
        """As of generalized-alpha."""
        of = self.plan
        return SHORT / float(of.times[-1] - of.times[0]) ** 2, float(of.options.mass)

    @property
    def after(self) -> float:
        """As of generalized-alpha."""
        return self.reached + 20.0 * float(self.work.options.smallest)

    def restart(self) -> str:
        """Find the rank again where it may have changed, and whether anything holds the system from outside."""
        step = self.work.step.step
        step.chi_v = float(self.plan.options.chi) if is_held(self.model, self.after) else 0.0
        return self.find_rank(self.after, self.work.step.y0)

    def _couple_layers(self) -> None:
        """Order the tangent again where turns have come to lie on one another."""
        self.plan = dataclasses.replace(self.plan, matrix=matrix_of(self.model, layers=True))
        self.inner = 0
        self.work.loop.factored = 0.0

    def advance(self, budget: int) -> tuple[bool, str]:
        """Take `budget` steps; returns whether the loop goes on after them, and why it failed, '' where it did not."""
        if not self.has_layers:
            code = energy_loop.advance(self.model, self.plan.matrix, self.work, budget)
        for _ in range(budget if self.has_layers else 0):
            code = energy_loop.advance(self.model, self.plan.matrix, self.work, 1)
            self.inner += int(self.plan.matrix.counts[INNER])
            if self.inner > MOST_INNER:
                self._couple_layers()
            if code != energy_loop.BUDGET:
                break
        if code == energy_loop.AT_RESTART:
            return True, self.restart()
        return code == energy_loop.BUDGET, "" if code >= 0 else self.failure_message(code)

    def gaps(self) -> np.ndarray:
        """Gaps of the joints at the end of the last step, (nj,)."""
        return np.array(self.model.flexible.joints["gap1"])

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""
        step, s = self.work.step, self.model.flexible.switches
        t, h = float(step.step.t), float(step.step.h)
        return [(t + 0.5 * h, step.ym, s), (t + h, step.y1, s), (t, step.y0, s)]

    def failure_message(self, code: int) -> str:
        """Why the loop has ended with a status below zero.

        Raises
        ------
        InputError
            For constraints that are redundant from the start.
        """
        if code == energy_loop.REDUNDANT and self.work.loop.steps == 0:
            raise InputError(redundant(self.assembly, self.plan.matrix))
        found = reason(code, self.work, self.assembly, fixed=self.plan.step is not None)
        return found + broken_law(self.assembly, self.moments())

    def stalled(self, stall: Stall) -> str:
        """As of generalized-alpha, with the part that makes the steps so short."""
        return stalled(self.work, self.assembly, stall, large_law(self.assembly, self.moments()))

    def _kept(self, n: int, balance: Any) -> Sampled:
        """What the loop has kept of the first n samples."""
        work = self.work
        unknowns = (work.out_a[:n], work.out_la[:n])
        forces = work.out_cylinders[:n], work.out_bodies[:n], work.out_touches[:n], work.out_friction[:n]
        return Sampled(*unknowns, balance, *forces, work.out_points[:n], work.out_momenta[:n])

    def counted(self, found: Solution) -> Solution:
        """The solution with what this method alone counts."""
        loop = self.work.loop
        found.statistics |= {"divided_steps": int(loop.divided), "staged_steps": int(loop.stages)}
        return found
