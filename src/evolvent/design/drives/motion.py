"""Motion of the thread under a drive, and the measures of it that are bounded."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from evolvent.design import links
from evolvent.design.drives.bounds import Task

Array = np.ndarray
#: Samples of a motion: evenly spread until the drive ends, close to each of its ends, and after it.
_EVEN, _CLOSE, _AFTER = 301, 30, 61


class Measures(NamedTuple):
    """What bounds are compared with: rad, rad, rad/s, N and N m, as in `Bounds`."""

    peak_lag: float
    residual_swing: float
    lag_rate: float
    tension: float
    spool_torque: float


class Motion(NamedTuple):
    """A run under a drive.

    Attributes
    ----------
    time : (nt,) float, s
    lag, tension, deployed, body_rate : (nt,) float, rad, N, m and rad/s; lag of the tip, tension at the spool
    end : float, s, when the drive ends
    radius, segment : float, m, of the spool; length of a segment
    failed : str, why the run ended early; '' of a whole one
    """

    time: Array
    lag: Array
    tension: Array
    deployed: Array
    body_rate: Array
    end: float
    radius: float
    segment: float
    failed: str

    @property
    def ended(self) -> Array:
        """Whether the drive has ended, (nt,) bool."""
        return self.time >= self.end * (1.0 - 1e-12)

    @property
    def lag_rate(self) -> Array:
        """Rate of the lag, rad/s, (nt,); 0 where less than one segment is out, a direction of no blade."""
        out, found = self.deployed >= self.segment, np.zeros_like(self.lag)
        if out.sum() > 1:
            found[out] = np.gradient(self.lag[out], self.time[out])
        return found

    def measures(self) -> Measures:
        """The largest values; infinite of a run that failed."""
        if self.failed:
            return Measures(*(math.inf,) * 5)
        tension = float(self.tension.max())
        return Measures(
            peak_lag=float(np.abs(self.lag[~self.ended]).max()),
            residual_swing=float(np.abs(self.lag[self.ended]).max()),
            lag_rate=float(np.abs(self.lag_rate).max()),
            tension=tension,
            spool_torque=tension * self.radius,
        )


def sample_times(end: float, after: float) -> Array:
    """Times at which a motion is sampled, s: until the drive ends, and for `after` s then."""
    close = end / _EVEN * np.linspace(0.0, 1.0, _CLOSE, endpoint=False)[1:]
    until = np.concatenate([np.linspace(0.0, end, _EVEN), close, end - close])
    return np.unique(np.concatenate([until, end + after * np.linspace(0.0, 1.0, _AFTER)]))


def run(
    task: Task, table: Any, *, end: float, inertia: float = 1.0, spin: float = 1.0, nodes: int | None = None
) -> Motion:
    """The motion under a table of rates.

    Parameters
    ----------
    table : rows (s, rad/s)
    end : float, s, when the drive ends
    inertia, spin : float, factors of the body's moment of inertia and of the spin at the start
    nodes : int, of the blade; those of the case if left out
    """
    from evolvent.results.observe import View
    from evolvent.results.observe.lumped import observe_body
    from evolvent.results.observe.threads import observe_thread

    body, after = task.case.body, task.period(task.bounds.length or 0.0)
    moments = tuple(inertia * x for x in body.inertia) if isinstance(body.inertia, tuple) else inertia * body.inertia
    given = table_keys(table) | {
        "body.inertia": moments, "body.rate": spin * body.rate, "solver.duration": end + after,
        "blade.nodes": nodes or task.case.blade.nodes,
    }  # fmt: skip
    solution = links.solve(task.case, given, sample_times(end, after))
    view = View(solution)
    blade = observe_thread(view, "blade-1").variables
    return Motion(
        time=solution.t,
        lag=np.nan_to_num(blade["tip_lag"].values),  # nothing is out at the start
        tension=np.nan_to_num(blade["hub_tension"].values),
        deployed=blade["deployed_length"].values,
        body_rate=observe_body(view, "body").variables["rate"].values[:, 2],
        end=end,
        radius=task.case.spool.radius,
        segment=task.case.blade.length / (nodes or task.case.blade.nodes),
        failed="" if solution.status == "success" else solution.message,
    )


def constant_table(task: Task) -> list[list[float]]:
    """Table of the case's constant rate, which starts and stops at once."""
    end = task.constant_time
    return [[0.0, task.rate], [end, task.rate], [end * (1.0 + 1e-9), 0.0], [2.0 * end, 0.0]]


def table_keys(table: Any) -> dict[str, Any]:
    """Keys of the case that give a table of rates."""
    return links.spool_keys(table=[list(row) for row in table])
