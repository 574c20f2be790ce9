"""Search of a drive: rates at knots of time by least squares over the motions of the thread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent_base.errors import RunFailed
from evolvent_papers.drives import motion as mo
from evolvent_papers.drives.answer import Design
from evolvent_papers.drives.bounds import Bounds, DriveTask, task as task_of

Array = np.ndarray
#: Most nodes of the blade in the first round of the search.
FEW_NODES = 10
#: Periods of the lag over which the rate changes at both ends, and shares of the whole time that this takes at least
#: and at most.
PERIODS, LEAST, MOST = 1.0, 0.04, 0.45
#: Knots of an end. Of one that takes less than `BRIEF` of the time the shape is that of a smooth step.
KNOTS, BRIEF_KNOTS, BRIEF = 9, 4, 0.1
#: First rate of a spool with nothing out, over the constant rate: a link without length has no direction at rest.
CREEP = 0.1
#: Shares of the bounds that the search aims at.
AIM = {"residual_swing": 0.7, "peak_lag": 0.995, "lag_rate": 0.99, "tension": 0.995, "spool_torque": 0.995}
#: Weights in the sum of squares: of the nominal swing, of other bounds, of swings of the corners, of bends of the rate.
NOMINAL, BOUNDED, CORNER, SMOOTH = 10.0, 100.0, 0.3, 0.1
#: Iterations of each round of the search: with few nodes, then with those of the case and with twice as many.
ROUNDS = (7, 6)
#: Iterations of a further round, and most such rounds; they go on while a bound is missed.
FURTHER, MOST_FURTHER = 4, 3


def design(
    case: Any,
    bounds: Bounds | Mapping[str, Any] | None = None,
    overrides: Mapping[str, Any] | None = None,
    *,
    progress: Callable[[int, float], None] | None = None,
) -> Design:
    """A drive of the spools that keeps bounds, robust to errors of inertia and spin.

    Parameters
    ----------
    case : str or mapping, of the system `heliogyro`, with the constant `spool.rate` that the drive improves on
    bounds : Bounds or mapping of its keys
    overrides : mapping, keys of the case
    progress : function of the number of runs and of the sum of squares

    Returns
    -------
    Design
        Also where bounds are missed; see `Design.missed`.

    Raises
    ------
    InputError
        For a case or bounds that cannot be used.
    RunFailed
        If the thread cannot be run under the drive that was found.

    Notes
    -----
    Rates at knots are the unknowns; the curve through them is the case's `spool.table`, scaled so that the length is
    right. The search begins with smooth ramps over periods of `closed_forms.lag_frequency`. The sum of squares has
    what exceeds the bounds, and the swings after the stop at the four corners of inertia and spin. The first round has
    few nodes; the second weights the corners by their swings, and has the nodes of the case and twice as many, so that
    the bounds do not hang on the mesh. Up to `MOST_FURTHER` rounds like the second follow while a bound is missed. The
    drive always takes the time of the bounds: the time is no unknown of the search.
    """
    given = bounds if isinstance(bounds, Bounds) else Bounds(**dict(bounds or {}))
    return DriveSearch(task_of(cases.load(case, dict(overrides or {})), given), progress).design()


class DriveSearch:
    """The search for one task."""

    def __init__(self, task: DriveTask, progress: Callable[[int, float], None] | None = None) -> None:
        self.task, self.progress = task, progress
        self.end = float(task.bounds.time or task.constant_time)
        self.start_share, self.stop_share = (
            float(np.clip(PERIODS * task.period(length) / self.end, LEAST, MOST))
            for length in (task.case.spool.start_length, task.bounds.length or 0.0)
        )
        self.corners = task.corners
        self.weights = np.ones(len(self.corners))
        self.nodes: tuple[int, ...] = (min(task.case.blade.nodes, FEW_NODES),)
        self.runs = 0
        self.first = CREEP if task.case.spool.start_length == 0.0 else 0.0
        self.time, self.shape = self._knots()

    def _knots(self) -> tuple[Array, Array]:
        """Knots after the first, s, and the matrix that gives their rates by the unknowns; the last rate is zero."""
        start, stop = self.start_share, self.stop_share
        middle = np.linspace(start, 1.0 - stop, 4)
        parts, rows = [middle], [np.eye(4)]
        for end, share, cruise in (("start", start, 0), ("stop", stop, 3)):
            brief = share < BRIEF
            count = BRIEF_KNOTS if brief else KNOTS
            inner = np.linspace(0.0, 1.0, count + 1)[1:-1]  # from the end inwards
            block = np.zeros((count - 1, rows[0].shape[1]))
            if brief:
                block[:, rows[0].shape[1] - 4 + cruise if end == "stop" else cruise] = _smooth(inner)
            else:
                rows = [np.pad(one, ((0, 0), (count - 1, 0) if end == "start" else (0, count - 1))) for one in rows]
                block = np.zeros((count - 1, rows[0].shape[1]))
                place = 0 if end == "start" else block.shape[1] - count + 1
                block[:, place : place + count - 1] = np.eye(count - 1)
            if end == "start":
                parts, rows = [share * inner, *parts], [block, *rows]
            else:
                block = block if not brief else block[::-1]
                parts, rows = [*parts, 1.0 - share * inner[::-1]], [*rows, block]
        shape = np.concatenate(rows)
        return self.end * np.append(np.concatenate(parts), 1.0), np.vstack([shape, np.zeros(shape.shape[1])])

    def table(self, x: Array) -> list[list[float]]:
        """Rows of the table by the unknowns, rates over the constant rate, scaled to the length that is asked."""
        time = np.round(np.append(0.0, self.time), 6)
        rates = np.append(self.first, self.shape @ x)
        turned = float(scipy.interpolate.PchipInterpolator(time, rates).antiderivative()(time[-1]))
        wanted = self.task.angles[1] - self.task.angles[0]
        return [[float(t), float(f"{r * wanted / turned:.9g}")] for t, r in zip(time, rates, strict=True)]

    def start(self) -> Array:
        """The unknowns at the start of the search.

        Notes
        -----
        Half the rate for half a period of the lag, whose swing cancels that of the first step, with smooth steps.
        """
        lengths = self.task.case.spool.start_length, self.task.bounds.length or 0.0
        half = [0.5 * self.task.period(length) / self.end for length in lengths]
        share, room = self.time / self.end, (self.start_share, self.stop_share)
        two = [
            np.ones(at.size)
            if most < BRIEF
            else 0.5 * _smooth(at / step) + 0.5 * _smooth((at - min(own, most - step)) / step)
            for at, own, most, step in zip((share, 1.0 - share), half, room, (0.3 * r for r in room), strict=True)
        ]
        inside = self.shape.sum(axis=1) == 1.0  # but for the knots of a brief end
        found = np.linalg.lstsq(self.shape[inside], (two[0] * two[1])[inside], rcond=None)[0]
        return np.clip(found, 0.01, 2.0)

    def residuals(self, x: Array) -> Array:
        """What the search squares and adds up."""
        table, bounds, found = self.table(x), self.task.bounds, []
        for weight, corner in zip(self.weights, self.corners, strict=True):
            one = self._run(table, corner[0], corner[1])
            after = np.concatenate([one.lag[one.ended], one.spool_lag[one.ended]])
            found.append(CORNER * weight * after / bounds.residual_swing / np.sqrt(one.ended.sum()))
        for nodes in self.nodes:
            one = self._run(table, nodes=nodes)
            swing = np.abs(np.concatenate([one.lag[one.ended], one.spool_lag[one.ended]])) / bounds.residual_swing
            found.append(NOMINAL * np.maximum(swing - AIM["residual_swing"], 0.0) / np.sqrt(one.ended.sum()))
            series = {"peak_lag": one.lag[~one.ended], "lag_rate": one.lag_rate, "tension": one.tension}
            series["spool_torque"] = one.tension * one.radius
            for key, values in series.items():
                bound = getattr(bounds, key)
                if bound is not None:
                    found.append(BOUNDED * np.maximum(np.abs(values) / bound - AIM[key], 0.0))
        found.append(SMOOTH * np.diff(self.shape @ x, 2))
        everything = np.concatenate(found)
        if self.progress is not None:
            self.progress(self.runs, float(everything @ everything))
        return everything

    def _run(
        self, table: list[list[float]], inertia: float = 1.0, spin: float = 1.0, nodes: int | None = None
    ) -> mo.Motion:
        self.runs += 1
        found = mo.run(self.task, table, end=self.end, inertia=inertia, spin=spin, nodes=nodes or self.nodes[0])
        if not found.failed:
            return found
        times = mo.sample_times(self.end, mo.after(self.task))
        worst = np.full(times.size, np.pi)
        return found._replace(
            time=times, lag=worst, spool_lag=worst, tension=0.0 * worst, deployed=np.full(times.size, np.inf),
            body_rate=worst, failed="",
        )  # fmt: skip

    def design(self) -> Design:
        """The drive, and the motions under it with all nodes."""

        def improved(x: Array, evaluations: int) -> Array:
            found = scipy.optimize.least_squares(
                self.residuals, x, bounds=(0.0, 3.0), diff_step=1e-3, max_nfev=evaluations, ftol=1e-4, xtol=1e-4
            )
            return np.asarray(found.x)

        x, all_nodes = self.start(), self.task.case.blade.nodes
        for k, evaluations in enumerate(ROUNDS):
            if k:
                self.nodes = (all_nodes, 2 * all_nodes)
            x = improved(x, evaluations)
            if k + 1 < len(ROUNDS) and self.corners:
                table = self.table(x)
                swings = np.array(
                    [self._run(table, corner[0], corner[1]).measures().residual_swing for corner in self.corners]
                )
                self.weights = self.weights * np.sqrt(swings / max(float(swings.mean()), 1e-12))
        found = self.verified(self.table(x))
        for _ in range(MOST_FURTHER):
            if not found.missed():
                break
            before, x = x, improved(x, FURTHER)
            if np.array_equal(x, before):
                break
            found = self.verified(self.table(x))
        return found

    def verified(self, table: list[list[float]]) -> Design:
        """A drive with the motions of the whole thread under it."""
        task, end = self.task, self.end
        nominal, others = mo.run(task, table, end=end), mo.others(task, table, end=end)
        for name, one in {f"{task.case.blade.nodes} links": nominal, **others}.items():
            if one.failed:
                raise RunFailed(f"the run with {name} under the drive found has failed: {one.failed}", one)
        return Design(
            task=task, table=table, end=end, nominal=nominal, others=others,
            constant=mo.run(task, mo.constant_table(task), end=task.constant_time),
            corners={
                (inertia, spin): mo.run(task, table, end=end, inertia=inertia, spin=spin)
                for inertia, spin in self.corners
            },
            evaluations=self.runs,
        )  # fmt: skip


def _smooth(s: Array) -> Array:
    """The quintic smooth step, from 0 to 1 on 0 <= s <= 1."""
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s * s))
