"""Nodes that leave and reach their spools under an implicit method: when, and what becomes of the state then.

The drives are prescribed, so the times are known beforehand; the solver lands on them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.families.threads.directions import write_directions, write_positions
from evolvent.families.threads.events import OVERRUN
from evolvent.families.threads.family_positions import hold_segments, segment_nodes
from evolvent.kernels import rigid, thread
from evolvent.kernels.drive import FREE, drive
from evolvent.kernels.thread.free import WINDOW
from evolvent.model.layout import DUE
from evolvent.model.questions import Equations
from evolvent.model.registry import families

#: Intervals in which changes of a drive's direction are looked for.
_INTERVALS = 4096
#: Part of a segment that leaves its spool while velocities change, of the difference that gives accelerations.
_SHORT = 1e-4
#: Part of a segment that may have left a free spool where its node is due: twice that of `kernels.thread.free`.
_PAST = 2.0 * WINDOW


def release_times(model: Any, start: float, end: float) -> np.ndarray:
    """Times (s) between start and end at which a node leaves or reaches a driven spool (`Drives.stops`)."""
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
    begins_again : whether accelerations and tensions change at once, of models with segments of fixed length
    acceleration : (nv,) float, m/s2, of all coordinates after the last event, of models with segments of fixed length
    tension : (nn,) float, N, of the segments at the nodes then
    """

    def __init__(self, assembly: Any, equations: Equations) -> None:
        self.model, self.directions = assembly.model, assembly.directions
        self.event_values, self.apply_event, self.rhs, load = equations
        self.times: list[float] = []
        self.kinds: list[int] = []
        if self.directions is None:
            load(self.model, self.event_values, self.apply_event)
        else:
            self.directions = self.directions.copy()
            own = self.event_values, self.apply_event, write_positions, write_directions, self.rhs
            load(self.directions, *own)
        self.begins_again = self.directions is not None
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
        for family in families().values():
            if family.rows is None and "latest" in (family.record.names or ()):
                family.records(by)["until"] = family.records(self.model)["until"]
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
            own = thread.strains_of(self.model)
            for field in ("x0", "w0", "x", "w"):
                self.model.branch_strains[field][own] = by.branch_strains[field][own]
        return count

    def _turn_back(self, y: np.ndarray, by: Any) -> np.ndarray:
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

    def _accelerations(self, t: float, y: np.ndarray, by: Any) -> np.ndarray:
        """Accelerations (nv,) of a state with directions, as those of positions, by a difference of velocities."""
        s, dy = self.model.switches, np.zeros_like(y)
        by.nodes["tension"] = 0.0
        self.rhs(t, y, s, by, dy)
        self.tension = by.nodes["tension"].copy()
        speed = np.abs(by.threads["b"][:, 1])
        d = _SHORT * float(np.min(by.threads["segment"][speed > 0.0] / speed[speed > 0.0], initial=1.0))
        now, later = y.copy(), y + d * dy
        write_positions(t, now, s, by)
        write_positions(t + d, later, s, by)
        first, count = int(by.info.nq), int(by.info.nv)
        found: np.ndarray = (later - now)[first : first + count] / d
        return found

    def _fire(self, t: float, y: np.ndarray, model: Any) -> int:
        """Carry out what is due at t on a state of the model."""
        s, n, count = self.model.switches, model.threads.size, 0
        for _ in range(2 * n + 64):
            self.event_values(t, y, s, model, self._values)
            due = np.flatnonzero(self._values[: 2 * n] >= DUE)
            if not due.size:
                break
            first = int(due[0])
            free = model.threads["n"]
            leaves = [int(k) for k in due if k % 2 == 0 and s[k // 2] < free[k // 2]]
            together = leaves if first in leaves else [first]
            if self.apply_event(t, y, s, model, first, self._values) < 0:
                return -1
            self.times += [t] * len(together)
            self.kinds += together
            count += len(together)
        return count

    def keeps_powers(self, before: np.ndarray) -> bool:
        """Whether springs drive on as before, from the switches before: unless a whole thread has separated."""
        whole = slice(self.model.threads.size, 2 * self.model.threads.size)
        return self._has_springs and np.array_equal(before[whole], self.model.switches[whole])

    def begin_again(self, work: Any) -> None:
        """Give a step the accelerations and tensions after an event, which change there at once.

        Beside threads with segments of springs, whose accelerations are not those of a step, only the nodes'.
        """
        model, A = self.model, self.acceleration
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
        own = np.flatnonzero(model.constraints["alone"])
        work.la[own] = work.la0[own] = self.tension[segment_nodes(model)]
