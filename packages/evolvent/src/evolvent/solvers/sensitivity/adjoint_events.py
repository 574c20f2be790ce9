"""Steps that end on a latch, an event, a change of loads or the end of a run, as linear maps for the adjoint.

They are found by neighbours of the run, from states and parameters that are changed one by one, which take the steps as
those of sensitivities do (`evolvent.solvers.sensitivity.steps_beside`).
"""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.equations.implicit import residual
from evolvent.kernels.blocks import displace
from evolvent.solvers.sensitivity import recorded_steps
from evolvent.solvers.sensitivity.patches import Patch, Sides
from evolvent.solvers.sensitivity.steps_beside import (
    EVENT,
    HASTY,
    N_FACTORED,
    N_PACE,
    NONE,
    RATIO,
    SINCE,
    TOGETHER,
    TRIED,
    UNLIKE,
    step_beside,
    take_step,
)
from evolvent.solvers.time.implicit import loop as implicit_loop
from evolvent.solvers.time.implicit.messages import reason
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.workspace import AT_RESTART, BUDGET, DONE, SAMPLED, STOPPED
from evolvent_base.errors import InputError

Array = np.ndarray
#: Changes of states, of the size of the unknowns, to both sides, and to one side, with the same error; of rates and
#: accelerations those that move as far in a step.
CHANGE, ONE_SIDE = 1e-6, 1e-7
#: Behind a step that ends on a latch or event, in place of a factor of the length.
_HAPPENS = 1.0


@dataclasses.dataclass
class Parameter:
    """A parameter and its two neighbours.

    Attributes
    ----------
    name : str; change : float, of the parameter to both sides
    sides : Sides, what it changes; stops : times on which the steps of both neighbours land
    rows : (nv + nj,) bool, equations that it changes; group : int, of parameters that change others
    patches : what is changed in the equations of steps: one patch where they are linear in what it changes, else both
    change_of_rows : float, of the parameter by them
    """

    name: str
    change: float
    sides: Sides
    stops: tuple[Array, Array]
    rows: Array
    group: int = -1
    patches: tuple[Patch, ...] = ()
    change_of_rows: float = 1.0


@dataclasses.dataclass(frozen=True)
class Dense:
    """Steps as a dense map.

    Attributes
    ----------
    by_state : (m, m) float, of the state at the start; by_parameter : (m, parameters) float
    samples : (n, 2 nv, m) float, samples in the steps, by the state; sampled : (n, 2 nv, parameters) float
    event : (m + parameters,) float, time of the event by both
    """

    by_state: Array
    by_parameter: Array
    samples: Array
    sampled: Array
    event: Array


@dataclasses.dataclass(frozen=True)
class Jump:
    """Steps that end on an event.

    Attributes
    ----------
    first, last : int, samples in the steps, from the first up to the last
    event : float, s, time of the event in them, NaN of none
    dense : returns them as a map
    """

    first: int
    last: int
    event: float
    dense: Callable[[], Dense]


def carried(work: Any) -> list[Array]:
    """What a step starts from beside the state: accelerations, or changes of velocities over the step before."""
    return [work.step.before] if work.options["midpoint"] else [work.a1, work.dv1]


def state_of(work: Any, model: Any) -> tuple[Array, Array]:
    """The state of a workspace, and (v, what is `carried`, time)."""
    n_q, n_v = int(model.info["nq"]), work.dq.size
    return work.y.copy(), np.concatenate([work.y[n_q : n_q + n_v], *carried(work), [work.loop["time"]]])


def difference(up: tuple[Array, Array], down: tuple[Array, Array], factor: float, model: Any) -> Array:
    """Difference of two states of `state_of`, in coordinates of the state, times a factor: (m,)."""
    n_v = int(model.info["nv"])
    return factor * np.concatenate([between(up[0], down[0], model)[:n_v], up[1] - down[1]])


def between(up: Array, down: Array, model: Any) -> Array:
    """Change of the coordinates and rates from one state to another near it, (2 nv,)."""
    found = np.empty(2 * int(model.info["nv"]))
    recorded_steps.change_of(up - down, down, model, found)
    return found


class _Step(NamedTuple):
    """A step that the run has taken or tried, and its middle: what neighbours need to take it.

    Attributes
    ----------
    kind, latch : as of `steps_beside.step_beside`
    model, work : of the run behind the step
    middle, matrix, factored : of the middle
    """

    kind: int
    latch: int
    model: Any
    work: Any
    middle: Any
    matrix: Any
    factored: Array


class _Start(NamedTuple):
    """A start at an event or change of loads.

    Attributes
    ----------
    by_accelerations : bool; resolves : int, whether with those of the step (`alpha_start.start_accelerations`)
    held : float, whether velocities are filtered then
    """

    by_accelerations: bool
    resolves: int
    held: float


@dataclasses.dataclass(frozen=True)
class Jumps:
    """A run whose steps to events are taken with neighbours.

    Attributes
    ----------
    lead, middle : ImplicitRun, and another one of the same plan; room : SparseBlocks, scratch
    parameters : list of Parameter
    """

    lead: ImplicitRun
    middle: ImplicitRun
    room: Any
    parameters: Sequence[Parameter]

    @property
    def n_v(self) -> int:
        """Velocities."""
        return int(self.lead.model.info.nv)

    @property
    def n_u(self) -> int:
        """Unknowns: velocities and multipliers."""
        return self.n_v + int(self.lead.model.constraints.size)

    def take(self, searched: tuple[int, int, int] | None) -> tuple[int, str, Jump | None]:
        """Have the run take the steps to an event or a given time, with neighbours.

        Parameters
        ----------
        searched : what `take_step` has returned of a step that has just been taken back; None before any

        Returns
        -------
        status; why it failed; the steps, None where they failed

        Raises
        ------
        InputError
            Where the motion has no derivative.
        """
        lead, middle = self.lead, self.middle
        middle.model.take(lead.model)
        middle.work.take(lead.work)
        if searched is not None:
            middle.work.loop.event_step = math.inf
        start = middle.model.copy(), middle.work.copy()
        pace, factored = np.zeros(N_PACE), np.zeros(N_FACTORED)
        pace[RATIO], pace[SINCE] = 1.0, math.inf
        first, latches, event = int(lead.work.loop.sample), int(lead.work.loop.latches), math.nan
        code, taken, steps = BUDGET, searched, list[_Step | _Start | float]()
        while True:
            step = float(lead.work.loop.step)
            code, kind, latch = taken or take_step(lead.model, lead.matrix, lead.work)
            taken = None
            if code in (TOGETHER, HASTY):
                raise InputError(f"latches or events at t = {lead.reached:.6g} s come in one step, or in one too short")
            if code not in (BUDGET, DONE, STOPPED, AT_RESTART):
                return code, reason(code, lead), None
            if latch == TRIED and not math.isfinite(lead.work.loop.event_step):
                steps.append(float(lead.work.loop.step) / step)
                middle.work.loop.step *= steps[-1]
                continue
            found = step_beside(
                kind, latch, True, lead.model, lead.work, lead.work, middle.model, middle.matrix, middle.work, pace,
                factored,
            )  # fmt: skip
            if found <= 0 or pace[UNLIKE]:
                raise self._left(float(middle.work.loop.time))
            own = [one.copy() for one in (lead.model, lead.work, middle.work, middle.matrix, factored)]
            steps.append(_Step(kind, latch, *own))
            if latch != TRIED and int(lead.work.loop.latches) > latches:
                steps.append(_HAPPENS)
                if not math.isnan(event):
                    raise InputError(
                        f"latches or events at t = {event:.6g} and {lead.reached:.6g} s are less than a few steps apart"
                    )
                event, latches = float(lead.reached), int(lead.work.loop.latches)
            short = kind == EVENT and latch == NONE and code == BUDGET  # of an event
            if code == AT_RESTART:
                failure = lead.restart()
                middle.work.loop.follows = resolves = int(lead.work.loop.resolves)
                failure = failure or middle.restart()
                if failure:
                    return code, failure, None
                steps.append(_Start(not lead.midpoint, resolves, float(lead.work.step.step.held)))
                code = BUDGET
            if latch != TRIED and not short and not (code == BUDGET and self._grows()):
                break
        last = int(lead.work.loop.sample)
        dense = functools.partial(self._dense, start, steps, first, last)
        if code == BUDGET and int(lead.work.loop.sample) == lead.work.samples.size:
            code = DONE
        return code, "", Jump(first, last, event, dense)

    def _grows(self) -> bool:
        """Whether steps, which follow from the one to the event, are still to grow up to the given length."""
        loop, options = self.lead.work.loop, self.lead.work.options
        return bool(options.divides) and float(options.tolerance) <= 0.0 and float(loop.step) != float(loop.wanted)

    def _changes(self, model: Any, work: Any) -> tuple[list[Callable[[Any, Any, float], None]], Array]:
        """What changes a model and a workspace to a side, 1 or -1, of numbers of the start, and sizes of the changes.

        Positions are changed as far as the constraints allow, which all states at the ends of steps fit: what does not
        fit would be large rates in a short step.
        """
        n_v, n_q = self.n_v, int(model.info.nq)
        h, weight = float(work.loop.last), work.weight[:n_v]
        powers = [0, 1, 1] if self.lead.midpoint else [0, 1, 2, 2]
        part = CHANGE if self.lead.midpoint else ONE_SIDE
        sizes = np.append(np.concatenate([part * weight / h**power for power in powers]), part * h)
        G = self._constraints(model, work)
        inverse = np.linalg.pinv(G)
        allowed = part * weight[:, None] * (np.eye(n_v) - inverse @ G)

        def number(j: int, own: Any, at: Any, side: float) -> None:
            kind, i, d = j // n_v, j % n_v, side * sizes[j]
            if kind == 0:
                displace(work.y, side * np.ascontiguousarray(allowed[:, i]), False, own, at.y)
            elif kind == 1:
                at.y[n_q + i] += d
            elif j < sizes.size - 1:
                carried(at)[kind - 2][i] += d
            else:
                at.loop.time += d

        def parameter(one: Parameter, own: Any, at: Any, side: float) -> None:
            k = 0 if side > 0.0 else 1
            one.sides.patches[k].write(own)
            at.stops[:] = one.stops[k]
            if np.any(one.rows[n_v:]):
                displace(work.y, -weight * (inverse @ self._gaps(own, work, at.y)), False, own, at.y)

        found: list[Callable[[Any, Any, float], None]] = [functools.partial(number, j) for j in range(sizes.size)]
        found += [functools.partial(parameter, one) for one in self.parameters]
        return found, np.concatenate([sizes, [one.change for one in self.parameters]])

    def _gaps(self, model: Any, work: Any, y: Array) -> Array:
        """What constraints leave in a state, (nj,); 0 of those that do not hold."""
        r = np.zeros(self.n_u)
        residual(float(work.loop.time), y, work.dv1, work.la, 0.0, 1.0, model, r, np.zeros(work.powers.shape[1]))
        rows, t = model.constraints, float(work.loop.time)
        held = (rows["stiffness"] <= 0.0) & (t <= rows["until"])
        return np.where(held, r[self.n_v :], 0.0)

    def _constraints(self, base: Any, work: Any) -> Array:
        """Derivatives of the gaps by the coordinates, beside their sizes: (nj, nv)."""
        model, y, weight = base.copy(), work.y, work.weight[: self.n_v]
        found = np.zeros((self.n_u - self.n_v, self.n_v))
        for j in range(self.n_v if found.size else 0):
            sides = []
            for sign in (CHANGE, -CHANGE):
                move, state = np.zeros(self.n_v), y.copy()
                move[j] = sign * weight[j]
                displace(y, move, False, model, state)
                sides.append(self._gaps(model, work, state))
            found[:, j] = (sides[0] - sides[1]) / (2.0 * CHANGE)
        return found

    @staticmethod
    def _left(t: float) -> InputError:
        return InputError(
            f"the motion has no derivative at t = {t:.6g} s, where a neighbour does not take the step; "
            f"take another step"
        )

    def _dense(
        self, start: tuple[Any, Any], steps: Sequence[_Step | _Start | float], first: int, last: int
    ) -> Dense:  # fmt: skip
        """The steps as a map, by neighbours that take them one after another.

        Numbers of the start are changed to both sides; of generalized-alpha to one, where the steps behind an event do
        not follow from a very short one.

        Parameters
        ----------
        start : Model and Workspace with which the steps start
        steps : steps, starts between them, and factors by which the length is divided
        first, last : as of `Jump`
        """
        n_v, (changes, sizes) = self.n_v, self._changes(*start)
        m = sizes.size - len(self.parameters)
        model, work = (one.copy() for one in start)
        moves = model.moves(start[0]) + work.moves(start[1], without=SAMPLED)
        found, samples = np.zeros((sizes.size, m)), np.zeros((sizes.size, last - first, 2 * n_v))
        event = np.zeros(sizes.size)

        def end(change: Callable[[Any, Any, float], None] | None, side: float) -> tuple[float, Any, Array]:
            for move in moves:
                ctypes.memmove(*move)
            if change is not None:
                change(model, work, side)
            happens = self._take_beside(model, work, steps)
            return happens, state_of(work, model), work.out_y[first:last].copy()

        middle = end(None, 0.0)
        for k, (change, size) in enumerate(zip(changes, sizes, strict=True)):
            one_side = k < m and not self.lead.midpoint
            factor = 1.0 / size if one_side else 0.5 / size
            up, down = end(change, 1.0), middle if one_side else end(change, -1.0)
            event[k] = factor * (up[0] - down[0])
            found[k] = difference(up[1], down[1], factor, model)
            for n in range(last - first):
                samples[k, n] = factor * between(up[2][n], down[2][n], model)
        found, sampled = found.T, np.moveaxis(samples, 0, 2)
        return Dense(found[:, :m], found[:, m:], sampled[..., :m], sampled[..., m:], event)

    def _take_beside(self, model: Any, work: Any, steps: Sequence[_Step | _Start | float]) -> float:
        """Have a neighbour take the steps of the run; returns the time of the event in them, 0 of none."""
        happens = 0.0
        recorded_steps.note_start(model, work)
        pace = np.zeros(N_PACE)
        pace[RATIO], pace[SINCE] = 1.0, math.inf
        for one in steps:
            if isinstance(one, float):
                happens = float(work.loop.time) if one == _HAPPENS else happens
                work.loop.step *= one
                continue
            if isinstance(one, _Start):
                self._start_again(one, model, work)
                continue
            found = step_beside(
                one.kind, one.latch, False, one.model, one.work, one.middle, model, one.matrix, work, pace, one.factored
            )
            if found <= 0 or pace[UNLIKE]:
                raise self._left(float(work.loop.time))
        return happens

    def _start_again(self, of: _Start, model: Any, work: Any) -> None:
        """Have a neighbour start again behind an event."""
        work.step.step.held = of.held
        if of.by_accelerations:
            loop = work.loop
            loop.follows = of.resolves
            after = float(loop["time"] + max(1e-9 * loop["last"], 20.0 * work.options["smallest"]))
            if implicit_loop.restart(after, model, self.room, work) != DONE:
                raise InputError(f"a neighbour does not start again at t = {after:.6g} s")
