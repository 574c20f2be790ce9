"""Steps that end on a latch, an event, a change of loads or the end of a run, as linear maps for the adjoint.

They are found by neighbours of the run, from states and parameters that are changed one by one, which take the steps as
those of sensitivities do (`evolvent.solvers.steps_beside`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError
from evolvent.flow.implicit import residual
from evolvent.kernels.blocks import RATE, ROTATION, displace
from evolvent.solvers import implicit_loop, tape as tapes
from evolvent.solvers.implicit_run import Run
from evolvent.solvers.implicit_state import AT_RESTART, BUDGET, DONE, STOPPED
from evolvent.solvers.messages import reason
from evolvent.solvers.patches import Patch
from evolvent.solvers.steps_beside import (
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

Array = np.ndarray
#: Changes of states, of the size of the unknowns; of rates and accelerations those that move as far in a step.
CHANGE = 1e-6


@dataclasses.dataclass
class Parameter:
    """A parameter and its two neighbours.

    Attributes
    ----------
    name : str; change : float, of the parameter to both sides
    up, down : Assembly, with it; patches : (2,) Patch, of the models; stops : times on which their steps land
    rows : (nv + nj,) bool, equations that it changes; group : int, of parameters that change others
    """

    name: str
    change: float
    up: Assembly
    down: Assembly
    patches: tuple[Patch, Patch]
    stops: tuple[Array, Array]
    rows: Array
    group: int = -1


@dataclasses.dataclass(frozen=True)
class Jump:
    """A step that ends on an event, as a dense map.

    Attributes
    ----------
    by_state : (m, m) float, of the state at its start, m = 4 nv + 1; by_parameter : (m, parameters) float
    first, samples : int and (n, 2 nv, m) float, samples in the step, by the state; sampled : (n, 2 nv, parameters)
    event : float, s, time of the event at its end, NaN of none
    """

    by_state: Array
    by_parameter: Array
    first: int
    samples: Array
    sampled: Array
    event: float


def state_of(work: Any, model: Any) -> tuple[Array, Array]:
    """The state of a workspace, and (v, a, d, time)."""
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    return work.y.copy(), np.concatenate([work.y[n_q : n_q + n_v], work.a1, work.dv1, [work.loop.time]])


def difference(up: tuple[Array, Array], down: tuple[Array, Array], factor: float, model: Any) -> Array:
    """Difference of two states of `state_of`, in coordinates of the state, times a factor: (4 nv + 1,)."""
    return factor * np.concatenate([between(up[0], down[0], model), up[1] - down[1]])


def between(up: Array, down: Array, model: Any) -> Array:
    """Change of the coordinates from one state to another near it, (nv,)."""
    blocks, n_q, found = model.blocks, int(model.info.nq), np.zeros(int(model.info.nv))
    for kind, q, v, count in zip(blocks["kind"], blocks["iq"], blocks["iv"], blocks["count"], strict=True):
        at = v - n_q
        if kind == ROTATION:
            a, b = down[q : q + 4], up[q : q + 4] - down[q : q + 4]
            found[at : at + 3] = 2.0 * (a[0] * b[1:] - a[1:] * b[0] - np.cross(a[1:], b[1:]))
        elif kind != RATE:
            found[at : at + count] = up[q : q + count] - down[q : q + count]
    return found


@dataclasses.dataclass(frozen=True)
class Jumps:
    """A run whose steps to events are taken with neighbours.

    Attributes
    ----------
    lead, middle : Run, and another one of the same plan; room : SparseBlocks, scratch
    parameters : list of Parameter
    """

    lead: Run
    middle: Run
    room: Any
    parameters: Sequence[Parameter]

    @property
    def n_v(self) -> int:
        """Velocities."""
        return int(self.lead.model.info.nv)

    @property
    def n_u(self) -> int:
        """Unknowns: velocities and multipliers."""
        return self.n_v + int(self.lead.model.joints.size)

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
        sides, sizes = self._changed()
        pace, factored = np.zeros((1 + len(sides), N_PACE)), np.zeros(N_FACTORED)
        pace[:, RATIO], pace[:, SINCE] = 1.0, math.inf
        first, latches = int(lead.work.loop.sample), int(lead.work.loop.latches)
        code = BUDGET
        taken = searched
        while True:
            step = float(lead.work.loop.step)
            code, kind, latch = taken or take_step(lead.model, lead.matrix, lead.work)
            taken = None
            if code in (TOGETHER, HASTY):
                raise InputError(f"latches or events at t = {lead.reached:.6g} s come in one step, or in one too short")
            if code not in (BUDGET, DONE, STOPPED, AT_RESTART):
                return code, reason(code, lead), None
            if latch == TRIED and not math.isfinite(lead.work.loop.event_step):
                for _, work in [(None, middle.work), *sides]:
                    work.loop.step *= float(lead.work.loop.step) / step
                continue
            self._step_neighbours(kind, latch, sides, pace, factored)
            if latch != TRIED and not (kind == EVENT and latch == NONE and code == BUDGET):  # just short of an event
                break
        if code == AT_RESTART:
            failure = lead.restart() or middle.restart()
            if failure:
                return code, failure, None
            self._restart_neighbours(sides)
            code = BUDGET
        event = float(lead.reached) if int(lead.work.loop.latches) > latches else math.nan
        if code == BUDGET and int(lead.work.loop.sample) == lead.work.samples.size:
            code = DONE
        return code, "", self._dense(sides, sizes, first, event)

    def _changed(self) -> tuple[list[tuple[Any, Any]], Array]:
        """Models and workspaces from which neighbours start, to both sides, and the sizes of the changes.

        Positions are changed as far as the constraints allow, which all states at the ends of steps fit: what does not
        fit would be large rates in a short step.
        """
        middle, n_v, n_q = self.middle, self.n_v, int(self.lead.model.info.nq)
        h, weight = float(middle.work.loop.last), middle.work.weight[:n_v]
        sizes = np.concatenate([CHANGE * weight, CHANGE * weight / h, CHANGE * weight / h**2, CHANGE * weight / h**2])
        sizes = np.append(sizes, CHANGE * h)
        G = self._constraints(weight)
        inverse = np.linalg.pinv(G)
        allowed = CHANGE * weight[:, None] * (np.eye(n_v) - inverse @ G)
        found = []
        for j in range(4 * n_v + 1):
            for sign in (1.0, -1.0):
                model, work = middle.model.copy(), middle.work.copy()
                kind, at, d = j // n_v, j % n_v, sign * sizes[j]
                if kind == 0:
                    displace(middle.work.y, sign * np.ascontiguousarray(allowed[:, at]), False, model, work.y)
                elif kind == 1:
                    work.y[n_q + at] += d
                elif kind == 2:
                    work.a1[at] += d
                elif kind == 3:
                    work.dv1[at] += d
                else:
                    work.loop.time += d
                found.append((model, work))
        for one in self.parameters:
            for patch, stops in zip(one.patches, one.stops, strict=True):
                model, work = middle.model.copy(), middle.work.copy()
                patch.write(model)
                work.stops[:] = stops
                if np.any(one.rows[n_v:]):
                    gaps = self._gaps(model, work.y)
                    displace(middle.work.y, -weight * (inverse @ gaps), False, model, work.y)
                found.append((model, work))
        for model, work in found:
            tapes.note_start(model, work)
        return found, np.concatenate([sizes, [one.change for one in self.parameters]])

    def _gaps(self, model: Any, y: Array) -> Array:
        """What joints leave of their constraints in a state, (nj,); 0 of those that do not hold."""
        work, r = self.middle.work, np.zeros(self.n_u)
        residual(float(work.loop.time), y, work.dv1, work.la, 0.0, 1.0, model, r, np.zeros(work.powers.shape[1]))
        joints, t = model.joints, float(work.loop.time)
        held = (joints["stiffness"] <= 0.0) & (t <= joints["until"])
        return np.where(held, r[self.n_v :], 0.0)

    def _constraints(self, weight: Array) -> Array:
        """Derivatives of the gaps by the coordinates, beside their sizes: (nj, nv)."""
        model, y, found = self.middle.model.copy(), self.middle.work.y, np.zeros((self.n_u - self.n_v, self.n_v))
        for j in range(self.n_v if found.size else 0):
            sides = []
            for sign in (CHANGE, -CHANGE):
                move, state = np.zeros(self.n_v), y.copy()
                move[j] = sign * weight[j]
                displace(y, move, False, model, state)
                sides.append(self._gaps(model, state))
            found[:, j] = (sides[0] - sides[1]) / (2.0 * CHANGE)
        return found

    def _step_neighbours(self, kind: int, latch: int, sides: list[Any], pace: Array, factored: Array) -> None:
        """Have the neighbours take the last step of the run."""
        lead, middle = self.lead, self.middle
        found = step_beside(
            kind, latch, True, lead.model, lead.work, lead.work, middle.model, middle.matrix, middle.work, pace[0],
            factored,
        )  # fmt: skip
        for k, (model, work) in enumerate(sides):
            if found <= 0:
                break
            found = step_beside(
                kind, latch, False, lead.model, lead.work, middle.work, model, middle.matrix, work, pace[1 + k],
                factored,
            )  # fmt: skip
        if found <= 0 or np.any(pace[:, UNLIKE]):
            raise InputError(
                f"the motion has no derivative at t = {lead.reached:.6g} s, where a neighbour does not take the step; "
                f"take another step"
            )

    def _restart_neighbours(self, sides: list[Any]) -> None:
        """Start the neighbours again behind a latch, a release or a change of loads."""
        for model, work in sides:
            after = float(work.loop.time) + max(1e-9 * float(work.loop.last), 20.0 * float(work.options.smallest))
            if implicit_loop.restart(after, model, self.room, work) != DONE:
                raise InputError(f"a neighbour does not start again at t = {self.lead.reached:.6g} s")

    def _dense(self, sides: list[Any], sizes: Array, first: int, event: float) -> Jump:
        """Differences of neighbours as a map."""
        model, m, last = self.lead.model, 4 * self.n_v + 1, int(self.lead.work.loop.sample)
        n_q = int(model.info.nq)
        columns, samples = [], []
        for k, size in enumerate(sizes):
            (_, up), (_, down) = sides[2 * k], sides[2 * k + 1]
            columns.append(difference(state_of(up, model), state_of(down, model), 0.5 / size, model))
            samples.append([
                np.concatenate([
                    between(up.out_y[n], down.out_y[n], model),
                    (up.out_y[n] - down.out_y[n])[n_q : n_q + self.n_v],
                ]) * (0.5 / size)
                for n in range(first, last)
            ])  # fmt: skip
        found = np.array(columns).T
        sampled = np.moveaxis(np.array(samples).reshape(len(sizes), last - first, 2 * self.n_v), 0, 2)
        return Jump(found[:, :m], found[:, m:], first, sampled[..., :m], sampled[..., m:], event)
