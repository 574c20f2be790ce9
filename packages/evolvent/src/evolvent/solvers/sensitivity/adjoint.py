"""The adjoint of a run by implicit steps: derivatives of few values by many parameters, in one pass backwards.

The run keeps its steps as linear maps (`evolvent.solvers.sensitivity.recorded_steps`). Those that end on a latch, an
event, a change of loads or the end of the run are found by neighbours that take them from states and parameters
changed one by one.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import config

from evolvent.algebra.sparse import INNER
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.step_end import start_run
from evolvent.model.registry import asked, cubic
from evolvent.solvers.common.matrices import matrix_for
from evolvent.solvers.sensitivity import adjoint_start, recorded_energy_steps, recorded_steps
from evolvent.solvers.sensitivity.adjoint_events import Jump, Jumps, Parameter, between, carried, difference, state_of
from evolvent.solvers.sensitivity.adjoint_start import Start
from evolvent.solvers.sensitivity.adjoint_support import are_smooth, by_rates, check, depends_on_time
from evolvent.solvers.sensitivity.colours import coloured, equations_of, joined
from evolvent.solvers.sensitivity.parameter_groups import group_parameters
from evolvent.solvers.sensitivity.patches import Patch, Sides
from evolvent.solvers.sensitivity.recorded_steps import (
    FULL,
    KIND,
    LANDS,
    LATCH,
    SEARCHES,
    SHIFTED,
    STEPS,
    TIMED,
    RecordedSteps,
)
from evolvent.solvers.sensitivity.steps_beside import TOGETHER, step_beside, take_step
from evolvent.solvers.sensitivity.transposed import (
    FACTOR,
    N_PACE,
    N_PARTS,
    Linear,
    columns_of,
    entries_of,
    turned_of,
    work_of_factors,
)
from evolvent.solvers.sensitivity.windows import windows_of
from evolvent.solvers.time import run as runs
from evolvent.solvers.time.implicit import loop as implicit_loop
from evolvent.solvers.time.implicit.messages import reason
from evolvent.solvers.time.implicit.methods import METHODS
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.setup import stops_of
from evolvent.solvers.time.implicit.workspace import BUDGET, DONE, STOPPED
from evolvent_base.errors import InputError

Array = np.ndarray
#: Steps of a record, and bytes of all at most.
STEPS_OF_TAPE, MOST_BYTES = 256, 4e9
#: Largest correction at which an iteration has converged; the same with beams, rods and shells, whose stiff directions
#: rotate, so that forces along these are accurate.
NEWTON = 1e-10, 1e-12


def _stops(base: Assembly, patch: Patch, times: Array) -> Array:
    """Times on which the steps of a neighbour land."""
    if not {*asked("drives.stops"), "breaks"}.intersection(key for key, *_ in patch.changes):
        return stops_of(base, times)
    model = base.model.copy()
    patch.write(model)
    return stops_of(dataclasses.replace(base, model=model), times)


class OtherEquations(Exception):
    """A parameter changes other equations than at the start, in a group with others."""


class Adjoint:
    """A run by implicit steps that keeps them.

    Parameters
    ----------
    make : returns a plan of the run, another one each time
    parameters : name, change, and what the parameter changed by it to both sides changes

    Attributes
    ----------
    lead : ImplicitRun; parameters : list of Parameter
    parts : list of (RecordedSteps, number of steps, Model at them) and Jump, in the order of time
    """

    def __init__(self, make: Callable[[], Any], parameters: Sequence[tuple[str, float, Sides]]) -> None:
        plans = [make() for _ in range(2)]
        for one in plans:
            one.options.corrects = 0
            if not one.options.midpoint:
                sharp = NEWTON[int(one.assembly.model.info.slender > 0)]
                one.options.newton = min(float(one.options.newton), sharp)
        base = plans[0].assembly
        check(plans[0])
        self.lead, self.middle = (ImplicitRun(one) for one in plans)
        self.room, self.transposed, model, times = matrix_for(base), matrix_for(base), base.model, plans[0].times
        self.n_v, self.n_u = int(model.info.nv), int(model.info.nv) + model.constraints.size
        self.parameters = [
            Parameter(
                name, change, sides, (_stops(base, sides.patches[0], times), _stops(base, sides.patches[1], times)),
                np.zeros(self.n_u, dtype=bool),
            )
            for name, change, sides in parameters
        ]  # fmt: skip
        for one in self.parameters:
            if any(stops.size != self.lead.work.stops.size for stops in one.stops):
                raise InputError(
                    f"{one.name!r} moves a time at which loads change onto another one; there is no derivative by it"
                )
        own = METHODS[plans[0].method]
        others = frozenset().union(*(row.modules for row in METHODS.values() if row.code != own.code))
        roots = [
            recorded_steps.advance_keeping,
            recorded_steps.note_start,
            recorded_steps.change_of,
            recorded_steps.find_mass,
            recorded_steps.pull_back_sample,
            take_step,
            step_beside,
            implicit_loop.begin,
        ]
        if self.lead.midpoint:
            roots += [recorded_energy_steps.evaluate, recorded_energy_steps.pull_back]
            self.colours = recorded_energy_steps.colours_of(base)
        else:
            roots += [implicit_loop.restart, recorded_steps.pull_back, adjoint_start.pull_back_start]
        for run in (self.lead, self.middle):
            needs.load(run.model, *roots, without=others)
        self.jumps = Jumps(self.lead, self.middle, self.room, self.parameters)
        self.parts: list[tuple[RecordedSteps, int, Any] | Jump] = []
        self.bytes = 0
        self.shifted, self.timed = False, depends_on_time(model)

    # -------------------------------------------------------------------------------------------- forwards

    def run(self, progress: Callable[[float], None] | None = None) -> runs.Ending:
        """Run to the end; returns how.

        Raises
        ------
        InputError
            Where the motion has no derivative.
        """
        model, work = self.lead.model.copy(), self.lead.work.copy()
        failure = self.lead.begin()
        if failure:
            return "failed", failure
        if model.info.redundant or self.lead.model.info.redundant:
            raise InputError("constraints are redundant, which the adjoint does not support; take mode 'forward'")
        self.start = model, work, self.lead.work.copy()
        group_parameters(self.lead, self.middle, self.parameters)
        lead, recorded, code = self.lead, self._new_record(), BUDGET
        self._at_steps = lead.model.copy()
        while code not in (DONE, STOPPED):
            code = recorded_steps.advance_keeping(200, lead.model, lead.matrix, lead.work, recorded)
            searched = (BUDGET, int(recorded.counts[KIND]), int(recorded.counts[LATCH])) if code == SEARCHES else None
            if code in (FULL, LANDS, SEARCHES):
                recorded = self._close(recorded)
            if code == TOGETHER:
                raise InputError(
                    f"a latch or event at t = {lead.reached:.6g} s is at the end of a step by chance; take another step"
                )
            if code in (LANDS, SEARCHES):
                code, failure, jump = self.jumps.take(searched)
                if jump is None:
                    return "failed", failure
                if cubic(lead.model) and not math.isnan(jump.event):
                    raise InputError(
                        f"the adjoint does not support latches and events beside {cubic(lead.model)}; take rods, or "
                        "mode 'forward'"
                    )
                self.parts.append(jump)
                self.shifted = True
                recorded = self._new_record()
                self._at_steps = lead.model.copy()
            elif code == FULL:
                code = BUDGET
            elif code == DONE:
                self._close(recorded)
            elif code not in (BUDGET, DONE, STOPPED):
                return "failed", reason(code, lead)
            if progress is not None:
                progress(lead.reached)
        return lead.stopped() if code == STOPPED else runs.FINISHED

    def _new_record(self) -> RecordedSteps:
        n, work = STEPS_OF_TAPE, self.lead.work
        counts = np.zeros(recorded_steps.N_COUNTS, dtype=np.int64)
        counts[SHIFTED], counts[TIMED] = self.shifted, self.shifted and self.timed
        return RecordedSteps(
            counts=counts, numbers=np.zeros((n, recorded_steps.N_NUMBERS)), y0=np.zeros((n, work.y.size)),
            y1=np.zeros((n, work.y.size)), dq=np.zeros((n, self.n_v)), a=np.zeros((n, self.n_v)),
            la=np.zeros((n, work.la.size)), switches=np.zeros((n, self.lead.model.switches.size), dtype=np.int64),
        )  # fmt: skip

    def _close(self, recorded: RecordedSteps) -> RecordedSteps:
        """Keep a record, if it has steps; returns another one."""
        steps = int(recorded.counts[STEPS])
        if not steps:
            return recorded
        self.parts.append((recorded, steps, self._at_steps))
        self.bytes += sum(value.nbytes for value in recorded)
        if self.bytes > MOST_BYTES:
            raise InputError(
                f"the steps to t = {self.lead.reached:.6g} s take {self.bytes / 1e9:.2g} GB; take a longer step, a "
                f"shorter run, or mode 'forward'"
            )
        return self._new_record()

    def _part(self) -> None:
        """Each parameter in a group of its own."""
        for k, one in enumerate(self.parameters):
            one.group, one.rows[:] = k, True

    def _changed_models(self, model: Any) -> tuple[list[Any], Any]:
        """Models of the neighbours of each group, from that of the run, and their addresses."""
        groups = 1 + max((one.group for one in self.parameters), default=-1)
        models = [model.copy() for _ in range(2 * groups)]
        for one in self.parameters:
            for side, patch in enumerate(one.patches):
                patch.write(models[2 * one.group + side])
        if config.DISABLE_JIT:
            return models, models
        return models, np.array([one.address for one in models], dtype=np.int64)

    # -------------------------------------------------------------------------------------------- backwards

    def gradients(self, by_sample: Array, by_event: Array) -> Array:
        """Derivatives of values by the parameters.

        Parameters
        ----------
        by_sample : (values, samples, 2 nv) float, derivatives of the values by coordinates and rates at the samples
        by_event : (values, events) float, by the times of events

        Returns
        -------
        (values, parameters) float, without what parameters change in the values themselves

        Raises
        ------
        InputError
            Where a step has no derivative.
        """
        try:
            return self._gradients(by_sample, by_event)
        except OtherEquations:
            self._part()
            return self._gradients(by_sample, by_event)

    def _gradients(self, by_sample: Array, by_event: Array) -> Array:
        """As `gradients`.

        Raises
        ------
        OtherEquations
        """
        n, m, lead = by_sample.shape[0], (2 + len(carried(self.lead.work))) * self.n_v + 1, self.lead
        now, found = np.zeros((n, m)), np.zeros((n, len(self.parameters)))
        states, move, event = np.zeros((4, lead.work.y.size)), np.zeros(self.n_v), by_event.shape[1]
        seeded = np.flatnonzero(np.any(by_sample, axis=(0, 2)))
        change, linear, groups = np.zeros(2 * self.n_v), self._linear(n), self._sides().size
        if not self.lead.midpoint:
            self.windows = windows_of(self._columns(), groups, n, are_smooth(self.lead.model))
        changed: tuple[Any, Any, Any] = None, None, None
        for part in reversed(self.parts):
            if isinstance(part, Jump):
                times, seeds = np.zeros(n), by_sample[:, part.first : part.last]
                if not math.isnan(part.event):
                    event -= 1
                    times = by_event[:, event]
                if np.any(now) or np.any(seeds) or np.any(times):
                    dense = part.dense()
                    timed = np.outer(times, dense.event)
                    found += now @ dense.by_parameter + np.einsum("vsi,sik->vk", seeds, dense.sampled) + timed[:, m:]
                    now = now @ dense.by_state + np.einsum("vsi,sim->vm", seeds, dense.samples) + timed[:, :m]
                continue
            recorded, steps, model = part
            if changed[0] is not model:
                changed = model, *self._changed_models(model)
            rows = np.zeros((n * groups, self.n_u))
            last = steps - 1
            of = np.searchsorted(recorded.numbers[:steps, recorded_steps.END_SAMPLE], seeded, side="right")
            of[seeded < recorded.numbers[0, recorded_steps.FIRST_SAMPLE]] = steps
            for k in np.unique(of[of < steps])[::-1].tolist():
                numbers, starts, own = recorded.numbers[k], np.zeros((n, m)), seeded[of == k].tolist()
                self._pull(k + 1, last, part, changed[2], linear, now, rows)
                h = float(numbers[recorded_steps.LENGTH])
                for sample in own:
                    theta = (float(lead.work.samples[sample]) - float(numbers[recorded_steps.TIME])) / h
                    for q in range(n):
                        recorded_steps.pull_back_sample(
                            1.0 if theta > 1.0 - 1e-9 else max(theta, 0.0), h, recorded.y0[k], recorded.y1[k],
                            by_sample[q, sample], lead.model, states, move, change, starts[q], now[q],
                        )  # fmt: skip
                self._pull(k, k, part, changed[2], linear, now, rows)
                now += starts
                last = k - 1
            self._pull(0, last, part, changed[2], linear, now, rows)
            by_group = rows.reshape(n, -1, self.n_u)
            for k, one in enumerate(self.parameters):
                found[:, k] -= np.sum(by_group[:, one.group] * one.rows, axis=1) / one.change_of_rows
        now[:, : 2 * self.n_v] += by_sample[:, 0]
        found += self._by_start(now, linear)
        for one in self.parameters:
            own_rows = [other.rows for other in self.parameters if other.group == one.group]
            if len(own_rows) > 1 and np.any((linear.changes[one.group] != 0) & ~np.any(own_rows, axis=0)):
                raise OtherEquations(one.name)
        return found

    def _by_start(self, now: Array, linear: Linear) -> Array:
        """Derivatives by parameters, (values, parameters), from those by the state with which the run starts.

        Of energy-momentum that is the state of the plan. Of generalized-alpha its accelerations follow from the
        equations; where a parameter also changes the state of the plan, its neighbours start.
        """
        found, (_, work, after) = np.zeros((now.shape[0], len(self.parameters))), self.start
        still = [all(np.array_equal(y, work.y) for y in one.sides.starts) for one in self.parameters]
        rows = np.zeros((0, self.n_u))
        if not self.lead.midpoint and linear.M.size and any(still):
            rows = self._rows_of_start(now, linear)
        by_group = rows.reshape(now.shape[0], -1, self.n_u)
        for k, (one, same) in enumerate(zip(self.parameters, still, strict=True)):
            if self.lead.midpoint:
                up, down = one.sides.starts
                change = between(up, down, self.lead.model) * (0.5 / one.change)
                found[:, k] = now[:, : 2 * self.n_v] @ change
            elif same and rows.size:
                found[:, k] = np.sum(by_group[:, one.group] * one.rows, axis=1) / -one.change_of_rows
            else:
                found[:, k] = now @ self._begin_beside(one, int(after.loop.resolves))
        return found

    def _rows_of_start(self, now: Array, linear: Linear) -> Array:
        """Products of the equations of the start by groups of parameters with their solutions, as of `pull_back`."""
        (given, before, after), n = self.start, now.shape[0]
        model, work = given.copy(), after.copy()
        models, addresses = self._changed_models(model)
        for own in (model, *models):
            start_run(float(work.loop.time), 1.0, 0.0, before.y, own, work.booked)
        starts, columns, first, rows = self._shared("colours", self._colours_of_start)
        start = Start(
            y=before.y.copy(), A=after.dv1.copy(), la=after.la.copy(), starts=starts, columns=columns, first=first,
            rows=rows, near=np.zeros((3, before.y.size)), beside=np.zeros((2, self.n_u)), back=np.zeros((n, self.n_v)),
            jerk=np.zeros((n, self.n_v)), scratch=np.zeros((adjoint_start.N_ROWS, self.n_u)),
        )  # fmt: skip
        found = np.zeros((n * self._sides().size, self.n_u))
        if adjoint_start.pull_back_start(model, addresses, work, self.room, self.transposed, linear, start, now, found):
            raise InputError("the start has no derivative; take mode 'forward'")
        return found

    def _colours_of_start(self) -> tuple[Array, Array, Array, Array]:
        """Colours of the coordinates in constraints, and the constraints of each coordinate, as of `Start`."""
        equations = [one[one >= self.n_v] for one in equations_of(self.lead.plan.assembly)]
        starts, columns = joined(coloured(equations, (j for j in range(self.n_v) if equations[j].size)))
        return starts, columns, *joined([equations[j] for j in columns])

    def _begin_beside(self, one: Parameter, resolves: int) -> Array:
        """Derivatives of the start by a parameter, (m,), by neighbours."""
        model, work, _ = self.start
        sides = []
        for patch, y in zip(one.sides.patches, one.sides.starts, strict=True):
            own, start = model.copy(), work.copy()
            patch.write(own)
            start.y[:], start.loop.follows = y, resolves
            if implicit_loop.begin(own, self.room, start) != DONE:
                raise InputError(f"with {one.name!r} a little larger or smaller the run does not start")
            sides.append(state_of(start, model))
        return difference(sides[0], sides[1], 0.5 / one.change, model)

    def _sides(self) -> Array:
        """Neighbours that are evaluated of each group, (groups,) int."""
        found = np.full(1 + max((one.group for one in self.parameters), default=-1), 2, dtype=np.int64)
        for one in self.parameters:
            found[one.group] = len(one.patches)
        return found

    def _shared(self, name: str, make: Callable[[], Any]) -> Any:
        """The result of `make`, shared by variants of a system: it depends on structure and matrix layout alone."""
        base = self.lead.plan.assembly
        if base.shared is None or base.model.info.releases:
            return make()
        key = f"{name} of {self.room.values.size}"
        if key not in base.shared:
            base.shared[key] = make()
        return base.shared[key]

    def _columns(self) -> tuple[Array, Array, Array]:
        """Possible entries of the matrix, by columns, as of `columns_of`."""
        base = self.lead.plan.assembly
        found: tuple[Array, Array, Array] = self._shared("columns", lambda: columns_of(equations_of(base), self.room))
        return found

    def _linear(self, values: int) -> Linear:
        """Room for a step as a linear map, with the mass matrix, and derivatives of values."""
        size, sides, model = self.room.values.size, self._sides(), self.lead.model
        steady, rated = by_rates(model)
        none = np.zeros((0, 5), dtype=np.int64)
        turned = none if self.lead.midpoint else self._shared("turned", lambda: turned_of(model, self.room))
        found = Linear(
            A=np.zeros(size), K=np.zeros(size), M=np.zeros(0), places=np.zeros((0, 3), dtype=np.int64),
            turned=turned,
            steady=np.array(steady, dtype=np.int64), rated=np.array(rated, dtype=np.int64),
            rows=np.zeros((sides.size + 1, self.n_u)), changes=np.zeros((sides.size, self.n_u), dtype=np.int64),
            sides=sides, r=np.zeros(self.n_u), right=np.zeros(self.n_u), W=np.zeros((values, self.n_u)),
            before=np.zeros((3, values, self.n_u)), parts=np.zeros((N_PARTS, self.n_u)), pace=np.zeros(N_PACE),
        )  # fmt: skip
        found.pace[FACTOR] = work_of_factors(self.room)
        first = next((part for part in self.parts if not isinstance(part, Jump)), None)
        if first is not None:
            recorded_steps.find_mass(0, first[2], self.lead.work, first[0], self.room, found)
            if self.room.counts[INNER]:
                raise InputError("torques spread over a beam are not supported by the adjoint; take mode 'forward'")
            M, places = entries_of(self.room.values, self.room)
            found = Linear(**(found._asdict() | {"M": M, "places": places}))
        return found

    def _pull(self, first: int, last: int, part: Any, models: Any, linear: Linear, now: Array, rows: Array) -> None:
        if last < first or not np.any(now):
            return
        recorded, _, model = part
        if self.lead.midpoint:
            left = recorded_energy_steps.pull_back(
                first, last, recorded, self.room, self.transposed, model, models, self.middle.work, linear,
                self.colours, now, rows,
            )  # fmt: skip
        else:
            left = recorded_steps.pull_back(
                first, last, recorded, self.room, self.transposed, model, models, self.lead.work, linear, self.windows,
                now, rows,
            )  # fmt: skip
        if left >= 0:
            t = float(recorded.numbers[left - 1, recorded_steps.TIME])
            raise InputError(f"the step from t = {t:.6g} s has no derivative; take a shorter step, or mode 'forward'")
