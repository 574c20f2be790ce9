"""The surface of a net at the end of a run, over its last swing where it still swings."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy

from evolvent import results
from evolvent.analysis.reflector import NetInSystem
from evolvent.nets.error import SurfaceError
from evolvent_base.errors import InputError

Array = np.ndarray
#: Least height of a swing that counts, beside the range in the last part of the run, and that part.
_PROMINENCE, _LAST = 0.2, 0.25


@dataclasses.dataclass(frozen=True)
class AfterRun:
    """A surface at the end of a run.

    Attributes
    ----------
    since, until : float, s, over which the places of the nodes are averaged: the last swing, or the last sample alone
    x : (n, 3) float, m, nodes in the axes of the net
    error : SurfaceError
    moved : float, m, largest distance of a node from where it is in equilibrium
    slack : int, number of cords that are slack in the last sample
    """

    since: float
    until: float
    x: Array
    error: SurfaceError
    moved: float
    slack: int


def surface_after(path: str, of: NetInSystem, form: Array) -> AfterRun:
    """The surface of a net after a run.

    Parameters
    ----------
    path : str, file of a run of the same system
    of : NetInSystem
    form : (n, 3) float, m, the nodes in equilibrium, axes of the net

    Raises
    ------
    InputError
        If the file cannot be read, or has no net of that name and so many nodes.
    """
    run: Any = results.open(path)
    key = f"reflector.after is {path!r}"
    if of.name not in getattr(run, "children", {}) or "position" not in run[of.name]:
        raise InputError(f"{key}, a run without positions of the net {of.name!r}; give a run of the same case")
    net, t = run[of.name], np.asarray(run["time"].values)
    x = np.asarray(net["position"].values)
    if x.shape[1:] != form.shape:
        raise InputError(f"{key}, whose net {of.name!r} has {x.shape[1]} nodes; that of the case has {len(form)}")
    x = of.net.seen(x)
    first = last_swing(t, (x - form)[:, :, 2].mean(axis=1))
    mean = x[-1] if first == len(t) - 1 else np.trapezoid(x[first:], t[first:], axis=0) / (t[-1] - t[first])
    slack = int((net["tension"].values[-1] <= 0.0).sum())
    moved = float(np.linalg.norm(mean - form, axis=1).max())
    return AfterRun(float(t[first]), float(t[-1]), mean, of.error_of(mean), moved, slack)


def last_swing(t: Array, values: Array) -> int:
    """First sample of the last swing: of as long a time before the end as the last two maxima, or minima, are apart.

    Parameters
    ----------
    t : (nt,) float, s; values : (nt,) float

    Returns
    -------
    int
        The last sample where there are no two of them in the last quarter of the time.
    """
    own = np.flatnonzero(t >= t[-1] - _LAST * (t[-1] - t[0]))
    part, found = values[own], len(t) - 1
    for one in (part, -part):
        peaks = scipy.signal.find_peaks(one, prominence=max(_PROMINENCE * float(np.ptp(part)), 1e-300))[0]
        if peaks.size >= 2:
            period = t[own[peaks[-1]]] - t[own[peaks[-2]]]
            found = min(found, int(np.searchsorted(t, t[-1] - period)))
    return found
