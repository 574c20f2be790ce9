"""Numbers of the ledger on Yi, Yuan, Dong & Li (2017), computed again: detection of contact, its effect, the hinge."""

from __future__ import annotations

from typing import Any

import numpy as np

import evolvent
from evolvent.elements import axis_shape
from evolvent_papers.papers.rib_runs import ALPHAS, winding
from evolvent_papers.papers.winding import ALPHA, Model, Trial

Array = np.ndarray
Values = dict[str, float]
#: Radius of the hub, m; points of an element at which overlaps are looked for beside its contact points.
R, DENSE = 0.6, 64
#: Shortly before the whip with alpha = 0.2 1/s, s.
BEFORE_THE_WHIP = 66.0


def _gaps(run: Any, xi: Array) -> Array:
    """Distances of places of all elements from the hub, (nt, elements, k), m."""
    ends = np.concatenate([run.x[:, :-1], run.x[:, 1:]], axis=2)  # (nt, elements, 4, 3)
    x = np.einsum("jk,tnji->tnki", np.array(axis_shape(run.case.rib.element_length, xi)), ends)
    found: Array = np.hypot(x[..., 0], x[..., 1]) - R
    return found


def _unseen(run: Any) -> float:
    """Deepest overlap before the whip of an element none of whose contact points touches, m."""
    before = run.t <= BEFORE_THE_WHIP
    touched = run.touching.reshape(run.t.size, run.case.rib.elements, -1).any(axis=2)
    deep = np.where(touched, 0.0, -_gaps(run, np.arange(1, DENSE + 1) / DENSE).min(axis=2))
    return float(deep[before].max())


def detection() -> Values:
    """Gaps of contact points beside |r| - R, m, points wrongly found to touch, and the deepest unseen overlap, mm."""
    run = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2])
    points = run.case.contact.points
    gap = _gaps(run, np.arange(1, points + 1) / points).reshape(run.t.size, -1)
    known = np.isfinite(run.gap)
    return {
        "off": float(np.abs(gap - run.gap)[known].max()),
        "wrong": float(((gap < 0.0) != run.touching).sum()),
        "unseen": 1e3 * _unseen(run),
    }


def more_points() -> Values:
    """Deepest overlap that no contact point sees, mm, with 1, 2, 4 and 8 points in each element."""
    found = {}
    for points in (1, 2, 4, 8):
        run = winding(damping__alpha=0.2, solver__duration=BEFORE_THE_WHIP, contact__points=points)
        found[f"p{points}"] = 1e3 * _unseen(run)
    return found


def stability() -> Values:
    """When contact begins and how much of the time it acts, and where steps of 0.1 s fail, s.

    `c` and the tenths of alpha: with contact. `free`: without, alpha = 0.2 1/s, where 80 s is the end.
    """
    run = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2])
    whip, touches = run.t[run.peak], run.points > 0.0
    first = float(run.t[np.argmax(touches)])

    def reached(alpha: float, end: float, **changes: float) -> float:
        keys = {"damping.alpha": alpha} | {key.replace("__", "."): value for key, value in changes.items()}
        return float(Model("wrapped-rib", end, keys).run(Trial(ALPHA, step=0.1)).t[-1])

    return {
        "first": first,
        "whip": float(whip),
        "share": 100.0 * float(touches[(run.t >= first) & (run.t < whip - 0.2)].mean()),
        "c0": reached(0.0, 40.0),
        "c2": reached(0.2, 80.0),
        "c5": reached(0.5, 160.0),
        "free": reached(0.2, 80.0, contact__stiffness=1e-9),
    }


def hinge() -> Values:
    """Largest distance of the root from the hinge in the winding, m, and the balance of angular momentum to 64 s.

    `off` is what the drive, the drag and the hinge's force leave of the change of the momentum about the hub's axis,
    over the impulse of the drive; `held` is that of the hinge's force, N m s.
    """
    run = evolvent.run("wrapped-rib", {"solver.duration": 64, "output.every": 0.05, "output.fine": False})
    t, momentum, alpha = run.time.values, run.angular_momentum.values[:, 2], 0.2
    given, dragged, held = (
        float(np.trapezoid(rate, t)) for rate in (np.full(t.size, 0.2), alpha * momentum, run.hub_torque.values)
    )
    place = run["rib-1"].position.values[:, 0]
    return {
        "drift": float(np.abs(place - place[0]).max()),
        "held": held,
        "off": abs(float(momentum[-1] - momentum[0]) - (given - dragged - held)) / given,
    }
