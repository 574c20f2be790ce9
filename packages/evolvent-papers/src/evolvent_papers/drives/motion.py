"""Motion of the thread under a drive, and the measures of it that are bounded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent.families.bodies.observer import observe_body
from evolvent.families.threads.observer import observe_thread
from evolvent.results.observe import View
from evolvent_papers import links
from evolvent_papers.drives.bounds import DriveTask

Array = np.ndarray
#: Samples of a motion: evenly spread until the drive ends, close to each of its ends, and after it.
_EVEN, _CLOSE, _AFTER = 301, 30, 361
#: Periods of the lag for which a motion goes on after its drive.
AFTER_PERIODS = 2.0
#: Share of a segment below which the part of it that is out has no direction of its own.
_SHORT = 0.1
#: Stiffness of segments above which springs are checked at this one, N/m: stiffer ones are nearer to links.
_STIFF = 1e4


class Measures(NamedTuple):
    """What bounds are compared with: rad, rad/s, N and N m; both swings with `Bounds.residual_swing`."""

    peak_lag: float
    tip_swing: float
    spool_swing: float
    lag_rate: float
    tension: float
    spool_torque: float

    @property
    def residual_swing(self) -> float:
        """The larger of both swings, rad."""
        return max(self.tip_swing, self.spool_swing)


#: Key of the bound of each measure.
BOUND_OF = {key: "residual_swing" if key.endswith("swing") else key for key in Measures._fields}


class Motion(NamedTuple):
    """A run under a drive.

    Attributes
    ----------
    time : (nt,) float, s
    lag, spool_lag : (nt,) float, rad, of the tip, and of the last segment that is out, at the spool
    tension, deployed, body_rate : (nt,) float, N, m and rad/s; tension at the spool
    end : float, s, when the drive ends
    radius, segment : float, m, of the spool; length of a segment
    failed : str, why the run ended early; '' of a whole one
    """

    time: Array
    lag: Array
    spool_lag: Array
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
            return Measures(*(math.inf,) * len(Measures._fields))
        tension = float(self.tension.max())
        return Measures(
            peak_lag=float(np.abs(self.lag[~self.ended]).max()),
            tip_swing=float(np.abs(self.lag[self.ended]).max()),
            spool_swing=float(np.abs(self.spool_lag[self.ended]).max()),
            lag_rate=float(np.abs(self.lag_rate).max()),
            tension=tension,
            spool_torque=tension * self.radius,
        )


def sample_times(end: float, after: float) -> Array:
    """Times at which a motion is sampled, s: until the drive ends, and for `after` s then."""
    close = end / _EVEN * np.linspace(0.0, 1.0, _CLOSE, endpoint=False)[1:]
    until = np.concatenate([np.linspace(0.0, end, _EVEN), close, end - close])
    return np.unique(np.concatenate([until, end + after * np.linspace(0.0, 1.0, _AFTER)]))


def after(task: DriveTask) -> float:
    """Time for which a motion goes on after its drive, s."""
    return AFTER_PERIODS * task.period(task.bounds.length or 0.0)


def run(
    task: DriveTask, table: Any, *, end: float, inertia: float = 1.0, spin: float = 1.0, nodes: int | None = None,
    springs: bool = False,
) -> Motion:  # fmt: skip
    """The motion under a table of rates.

    Parameters
    ----------
    table : rows (s, rad/s)
    end : float, s, when the drive ends
    inertia, spin : float, factors of the body's moment of inertia and of the spin at the start
    nodes : int, of the blade; those of the case if left out
    springs : bool, segments are the case's springs in place of links of fixed length
    """
    body, blade, left, count = task.case.body, task.case.blade, after(task), nodes or task.case.blade.nodes
    moments = tuple(inertia * x for x in body.inertia) if isinstance(body.inertia, tuple) else inertia * body.inertia
    given = table_keys(table) | {
        "body.inertia": moments, "body.rate": spin * body.rate, "solver.duration": end + left, "blade.nodes": count,
    }  # fmt: skip
    if springs:
        stiffness = blade.segment_stiffness * (1.0 if blade.young_modulus is None else count / blade.nodes)
        given |= {
            "blade.segments": "springs", "blade.young_modulus": None, "blade.thickness": None,
            "blade.stiffness": min(stiffness, _STIFF), "solver.method": "rk4",
        }  # fmt: skip
    solution = links.solve(task.case, given, sample_times(end, left))
    view, segment = View(solution), blade.length / count
    seen = observe_thread(view, "blade-1").variables
    return Motion(
        time=solution.t,
        lag=np.nan_to_num(seen["tip_lag"].values),  # nothing is out at the start
        spool_lag=_spool_lag(seen, segment),
        tension=np.nan_to_num(seen["hub_tension"].values),
        deployed=seen["deployed_length"].values,
        body_rate=observe_body(view, "body").variables["rate"].values[:, 2],
        end=end,
        radius=task.case.spool.radius,
        segment=segment,
        failed="" if solution.status == "success" else solution.message,
    )


def others(task: DriveTask, table: Any, *, end: float) -> dict[str, Motion]:
    """Motions under a table of other models of the blade, by name: finer meshes, and springs where the case has them.

    A case with n nodes: 2 n and 4 n links of fixed length, n and 2 n springs.
    """
    n = task.case.blade.nodes
    found = {f"{k * n} links": run(task, table, end=end, nodes=k * n) for k in (2, 4)}
    if task.case.blade.segments == "springs":
        found |= {f"{k * n} springs": run(task, table, end=end, nodes=k * n, springs=True) for k in (1, 2)}
    return found


def _spool_lag(blade: Mapping[str, Any], segment: float) -> Array:
    """Lag of the last segment that is out, rad, (nt,); of the one before it where hardly any of the last is out."""
    lags, out = blade["signed_lag"].values, (blade["released"].values > 0.0).sum(axis=1)
    short = blade["deployed_length"].values - (out - 1) * segment < _SHORT * segment
    last = np.clip(out - 1 - short, 0, lags.shape[1] - 1)
    return np.nan_to_num(np.take_along_axis(lags, last[:, None], axis=1)[:, 0])


def constant_table(task: DriveTask) -> list[list[float]]:
    """Table of the case's constant rate, which starts and stops at once."""
    end = task.constant_time
    return [[0.0, task.rate], [end, task.rate], [end * (1.0 + 1e-9), 0.0], [2.0 * end, 0.0]]


def table_keys(table: Any) -> dict[str, Any]:
    """Keys of the case that give a table of rates."""
    return links.spool_keys(table=[list(row) for row in table])
