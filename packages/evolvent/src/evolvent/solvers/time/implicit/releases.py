"""Nodes that leave and reach their spools under an implicit method: when, and what becomes of the state then.

The drives are prescribed, so the times are known beforehand; the solver lands on them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.events import DUE, OVERRUN, apply_event, event_values
from evolvent.equations.fixed_lengths import write_directions, write_positions
from evolvent.equations.implicit import residual
from evolvent.equations.rhs import rhs
from evolvent.kernels import rigid, thread
from evolvent.kernels.drive import FREE, drive
from evolvent.kernels.thread.free import WINDOW
from evolvent.model.powers import DRIVEN, SPOOLS
from evolvent.solvers.common.balance import dissipated, energy, extend, lost, potential, worked
from evolvent.solvers.common.fixed_lengths import hold_segments, segment_nodes
from evolvent.solvers.time.implicit.balance import fill_energies
from evolvent.solvers.time.implicit.samples import begin_next
from evolvent.solvers.time.implicit.workspace import Workspace

#: Intervals in which changes of a drive's direction are looked for.
_INTERVALS = 4096
#: Part of a segment that leaves its spool while velocities change, of the difference that gives accelerations.
_SHORT = 1e-4
#: Part of a segment that may have left a free spool where its node is due: twice that of `kernels.thread.free`.
_PAST = 2.0 * WINDOW


def release_times(assembly: Assembly, start: float, end: float) -> np.ndarray:
    """Times (s) between start and end at which an event of a thread falls due."""
    model = assembly.model
    if not model.threads.size:
        return np.zeros(0)
    from scipy.optimize import brentq  # 0.2 s that other models do not need

    inner = model.breaks[(model.breaks > start) & (model.breaks < end)]
    times = np.union1d(np.linspace(start, end, _INTERVALS + 1), inner)
    found = []
    for row in model.threads[
        (model.threads["drive"] != FREE) & (model.threads["kind"] != thread.MOVING)
    ]:  # the loop finds those of free spools
        parameters = model.parameters[int(row["first"]) : int(row["last"])]

        def paid(t: float, row: Any = row, parameters: np.ndarray = parameters) -> float:
            """Nodes' worth of thread that is out."""
            angle = drive(int(row["drive"]), parameters, int(row["law"]), float(t))[0]
            return float((angle * row["radius"] - 0.5 * row["coiling"] * angle**2) / row["segment"])

        n = int(row["n"])
        up = np.append(np.arange(n, dtype=float), n if row["separates"] else n + OVERRUN)
        down = np.append(np.arange(n) + float(row["capture"]), -OVERRUN)
        out = _values(paid, times)
        for k in np.flatnonzero(np.diff(out) != 0.0):
            low, high = sorted((out[k], out[k + 1]))
            levels = up if out[k + 1] > out[k] else down
            for level in levels[(levels > low) & (levels <= high)]:
                gap = [out[k] - level, out[k + 1] - level]
                at = times[k + int(gap[1] == 0.0)]
                if gap[0] * gap[1] < 0.0:
                    with contextlib.suppress(Exception):  # as in `_values`
                        at = brentq(
                            lambda t, paid=paid, level=level: paid(t) - level, times[k], times[k + 1], xtol=1e-14
                        )
                found.append(float(at))
    return np.unique(np.array(found, dtype=float))


def _values(paid: Callable[[float], float], times: np.ndarray) -> np.ndarray:
    """Nodes' worth of thread that is out, up to the time at which a user's law raises: there the run fails."""
    found = []
    for t in times:
        try:
            found.append(paid(t))
        except Exception:  # noqa: BLE001  (of the user's code)
            break
    return np.array(found)


class Releases:
    """Carries out the events of a model's threads.

    Attributes
    ----------
    times, kinds : events so far, as in `evolvent.solvers.Solution`
    acceleration : (nv,) float, m/s2, of all coordinates after the last event, of models with segments of fixed length
    tension : (nn,) float, N, of the segments at the nodes then
    """

    def __init__(self, assembly: Assembly) -> None:
        self.model, self.directions = assembly.model, assembly.directions
        self.times: list[float] = []
        self.kinds: list[int] = []
        if self.directions is None:
            needs.load(self.model, event_values, apply_event)
        else:
            self.directions = self.directions.copy()
            needs.load(self.directions, event_values, apply_event, write_positions, write_directions, rhs)
        self._values = np.zeros(int(self.model.info.ne))
        self.acceleration = np.zeros(int(self.model.info.nv))
        self.tension = np.zeros(self.model.nodes.size)
        self._has_springs = bool(np.any(np.isin(self.model.threads["kind"], (thread.SPRINGS, thread.MOVING))))

    def fire(self, t: float, y: np.ndarray) -> int:
        """Carry out what is due at t on the state y; returns how many events, -1 where a drive outruns its thread."""
        if self.directions is None:
            return self._fire(t, y, self.model)
        s, by = self.model.switches, self.directions
        before, state = s.copy(), y.copy()
        by.constraints["until"] = self.model.constraints["until"][self.model.constraints["alone"] == 0]
        by.motors["until"] = self.model.motors["until"]
        write_directions(t, state, s, by)
        excess = self._turn_back(state, by)
        start = state.copy()
        write_positions(t, start, s, by)
        count = self._fire(t, state, by)
        if count > 0:
            self.acceleration = self._accelerations(t, state, by)
            ways = state.copy()
            write_positions(t, state, s, by)
            # nodes keep what the method leaves of their constraints, and with it the momentum
            y += state - start
            for p, row in enumerate(by.threads):
                low, high = sorted((int(before[p]), int(s[p])))
                for first in (int(row["iq"]), int(row["iv"])):
                    y[first + 3 * low : first + 3 * high] = state[first + 3 * low : first + 3 * high]
                    if int(s[p]) > int(before[p]):
                        own = slice(first + 3 * high - 3, first + 3 * high)
                        y[own] += excess[p] * ways[own]
            hold_segments(t, y, s, self.model)
        return count

    def _turn_back(self, y: np.ndarray, by: mdl.Model) -> np.ndarray:
        """Turn free spools back to where their next nodes leave; returns the lengths (m) by which steps passed that.

        A link's turning has a regular solution from the length 0 on.
        """
        s, found = self.model.switches, np.zeros(by.threads.size)
        for p, row in enumerate(by.threads):
            if row["drive"] != FREE or s[p] >= row["n"] or y[int(row["spool_v"])] <= 0.0:
                continue
            phi = float(y[int(row["spool_q"])])
            radius = float(row["radius"] - row["coiling"] * phi)
            past = phi * (float(row["radius"]) - 0.5 * float(row["coiling"]) * phi) - float(s[p] * row["segment"])
            if 0.0 < past < _PAST * float(row["segment"]):
                y[int(row["spool_q"])] -= past / radius
                found[p] = past
        return found

    def accelerations(self, t: float, y: np.ndarray) -> np.ndarray:
        """Accelerations (nv,) of a state with positions, by the equations of explicit methods; zeros without these."""
        if self.directions is None:
            return np.zeros(int(self.model.info.nv))
        state = y.copy()
        write_directions(t, state, self.model.switches, self.directions)
        return self._accelerations(t, state, self.directions)

    def _accelerations(self, t: float, y: np.ndarray, by: mdl.Model) -> np.ndarray:
        """Accelerations (nv,) of a state with directions, as those of positions, by a difference of velocities."""
        s, dy = self.model.switches, np.zeros_like(y)
        by.nodes["tension"] = 0.0
        rhs(t, y, s, by, dy)
        self.tension = by.nodes["tension"].copy()
        speed = np.abs(by.threads["b"][:, 1])
        d = _SHORT * float(np.min(by.threads["segment"][speed > 0.0] / speed[speed > 0.0], initial=1.0))
        now, later = y.copy(), y + d * dy
        write_positions(t, now, s, by)
        write_positions(t + d, later, s, by)
        first, count = int(by.info.nq), int(by.info.nv)
        found: np.ndarray = (later - now)[first : first + count] / d
        return found

    def _fire(self, t: float, y: np.ndarray, model: mdl.Model) -> int:
        """Carry out what is due at t on a state of the model."""
        s, n, count = self.model.switches, model.threads.size, 0
        for _ in range(2 * n + 64):
            event_values(t, y, s, model, self._values)
            due = np.flatnonzero(self._values[: 2 * n] >= DUE)
            if not due.size:
                break
            first = int(due[0])
            free = model.threads["n"]
            leaves = [int(k) for k in due if k % 2 == 0 and s[k // 2] < free[k // 2]]
            together = leaves if first in leaves else [first]
            if apply_event(t, y, s, model, first, self._values) < 0:
                return -1
            self.times += [t] * len(together)
            self.kinds += together
            count += len(together)
        return count

    def resume(self, work: Workspace) -> int:
        """Events at the loop's time: state, accelerations, energies and balance; returns what `fire` returns.

        Notes
        -----
        A node that leaves goes on as its neighbour does: what its spring would do to it at once is far shorter than a
        step. So are the powers of the spool and of what drives its body, which the balance takes the mean of over the
        step: they go on as well, but where a whole thread separates. What an event brings in or takes away is
        `released` in the balance.
        """
        model, t = self.model, float(work.loop.time)
        before, powers = model.switches.copy(), work.powers[0].copy()
        count = self.fire(t, work.y)
        if count < 0:
            return count
        n_q = int(model.info.nq)
        kept = (work.step.before, work.rate, work.acceleration) if work.options.midpoint else (work.a1, work.dv1)
        for p, row in enumerate(model.threads):
            at, was, now = int(row["iv"]) - n_q, int(before[p]), int(model.switches[p])
            for i in range(was, now):
                k = at + 3 * i
                for values in kept:
                    values[k : k + 3] = values[k - 3 : k] if i > 0 else 0.0
            for i in range(now, was):
                for values in kept:
                    values[at + 3 * i : at + 3 * i + 3] = 0.0
                work.y[n_q + at + 3 * i : n_q + at + 3 * i + 3] = 0.0
        if count > 0 and self.directions is not None:
            self._begin_again(work)
        if not work.options.midpoint:  # whose powers and loads are those of whole steps
            residual(t, work.y, work.dv1, work.la, 0.0, 1.0, model, work.r, work.powers[0])
            whole = slice(model.threads.size, 2 * model.threads.size)
            if self._has_springs and count > 0 and np.array_equal(before[whole], model.switches[whole]):
                for k in (SPOOLS, DRIVEN):
                    work.powers[0, k] = powers[k]
            work.loads1[:] = model.P
        model.wheels["motor0"], model.wheels["drag0"] = model.wheels["motor"], model.wheels["drag"]
        model.thrusters["push0"] = model.thrusters["push"]
        had = energy(work.balance)
        fill_energies(t, model, work)
        work.balance.released += energy(work.balance) - had
        balance = work.balance
        extend(work.loop, balance.kinetic, potential(balance), worked(balance), lost(balance))
        work.loop.factored = 0.0
        begin_next(model, work)
        return count

    def _begin_again(self, work: Workspace) -> None:
        """Give a step the accelerations and tensions after an event, which change there at once.

        Beside threads with segments of springs, whose accelerations are not those of a step, only the nodes'.
        """
        model, A, rows = self.model, self.acceleration, self.model.constraints
        own = np.full(A.size, not self._has_springs)
        for row in model.threads[model.threads["kind"] == thread.JOINED]:
            first = int(row["iv"] - model.info.nq)
            own[first : first + 3 * int(row["n"])] = True
        if work.options.midpoint:
            for row in model.bodies[model.bodies["carried"] != 0.0]:  # whose changes are those of a common centre
                own[int(row["iv"] - model.info.nq) :][:3] &= row["motion"] != rigid.FREE
            work.step.before[own] = A[own] * float(work.loop.last)
        else:
            work.a1[own] += A[own] - work.dv1[own]
            work.dv1[own] = A[own]
        own = np.flatnonzero(rows["alone"])
        work.la[own] = work.la0[own] = self.tension[segment_nodes(model)]


def write_accounts(model: mdl.Model, y: np.ndarray, balance: Any) -> None:
    """Write what an energy balance holds into the accounts of states (nt, ny), where explicit methods have it."""
    accounts = y[:, int(model.info.nq + model.info.nv) :]
    accounts[:, mdl.DISSIPATED], accounts[:, mdl.SPOOL] = dissipated(balance), balance.spools
    accounts[:, mdl.LOAD], accounts[:, mdl.DRIVE] = balance.loads, balance.drives
