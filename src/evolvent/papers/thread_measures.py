"""Measurements of the claims of Tenenbaum (2014): each returns the numbers that a row of the ledger keeps.

Whatever stiffness does not change is measured on links of fixed length, or with springs of 1e4 N/m: their lag is that
of the paper's 1e7 N/m to 5e-6 and 0.0015 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from evolvent.papers.thread_runs import (
    QUICK_STIFFNESS,
    RIGID,
    STIFFNESS,
    Deployment,
    deployed,
    gap,
    largest,
    means,
    stability_limit,
    tree,
)

Numbers = Mapping[str, float]
#: Time after which the lags of runs are compared, s: the start's swing has died out.
LATE = 7.0
#: Springs of the quick runs, with RK4 and the step that a run chooses.
SPRINGS = {"blade.stiffness": QUICK_STIFFNESS, "solver.method": "rk4"}


def _rigid(nodes: int) -> Deployment:
    return deployed(RIGID | {"blade.nodes": nodes})


def _largest_difference(a: Deployment, b: Deployment, since: float = LATE) -> float:
    """Largest difference of two lags, deg."""
    return largest(a.lag - b.lag, a.t, since)


def deployment() -> Numbers:
    """Time of the deployment, and rate of the body at its end."""
    one = _rigid(20)
    return {"time": float(one.t[-1]), "rate": float(one.rate[-1])}


def releases() -> Numbers:
    """When the last node leaves, and the time that (1) gives, s."""
    run = tree(RIGID)
    out = run["blade-1"].released.values.sum(axis=1)
    first = int(np.flatnonzero(out == out.max())[0])
    return {
        "before": float(run.time.values[first - 1]),
        "after": float(run.time.values[first]),
        "nodes": float(out.max()),
    }


def start() -> Numbers:
    """Position of node 2 at the start in the frame of the spool, mm."""
    x, _, z = tree(RIGID)["blade-1"].position.values[0, 1]
    return {"x": 1e3 * (x - 0.05), "z": 1e3 * z}


def model_size() -> Numbers:
    """Springs beside links of fixed length: lag in degrees, relative rate of the body."""
    springs, rigid = deployed(SPRINGS), _rigid(20)
    rate = float(np.max(np.abs(springs.rate / rigid.rate - 1.0)))
    return {"lag": _largest_difference(springs, rigid), "rate": 1e5 * rate}


def boundary() -> Numbers:
    """Rest length between departure point and boundary node, and their distance in the run, mm."""
    from evolvent.papers.thread_schematics import R, drawn

    seen = drawn()
    node = seen.nodes[seen.out - 1] - np.array([0.0, 0.0, R])
    return {"rest": 1e3 * R * seen.wound[seen.out - 1], "distance": 1e3 * float(np.linalg.norm(node))}


def spacecraft() -> Numbers:
    """Lag of the tip in the schematic, deg."""
    from evolvent.papers.thread_schematics import drawn

    return {"lag": math.degrees(drawn().lag)}


def velocity_turn() -> Numbers:
    """What (12) changes: mean lags in the four windows, deg, and angular momentum, percent of the start."""
    turned, not_turned = SPRINGS, SPRINGS | {"blade.velocity_turn": False}
    lags = np.abs(np.subtract(means(deployed(turned)), means(deployed(not_turned))))
    return {"three": float(lags[:3].max()), "last": float(lags[3]), "lost": _gain(not_turned) - _gain(turned)}


def _gain(overrides: Mapping[str, object]) -> float:
    """Angular momentum that releases bring in, percent of the start."""
    run = tree(overrides)
    return float(100.0 * run.angular_momentum_jumps.values[-1] / run.angular_momentum.values[0, 2])


def momentum() -> Numbers:
    """Angular momentum that appears at releases without (12), that of the wound thread at the start, percent."""
    run = tree(RIGID)
    wound = run.angular_momentum_wound.values[0] / run.angular_momentum.values[0, 2]
    carried = tree(RIGID | {"blade.wound_mass": "carried"})
    change = carried.body_rate.values[-1] / run.body_rate.values[-1] - 1.0
    return {
        "gained": _gain(SPRINGS | {"blade.velocity_turn": False}),
        "wound": float(100.0 * wound),
        "rate": float(100.0 * change),
    }


def steady_lag() -> Numbers:
    """Lag at the end of a pay-out from 1 m at a constant rate of the body, and asin(2 v / (L0 W)), deg."""
    steady = math.degrees(math.asin(2.0 * 0.035 / (0.05 * 6.0)))
    given = {"body.motion": "driven", "spool.start_length": 1.0, "solver.duration": 20.0}
    run = tree(RIGID | given | {"spool.start_lag": f"{steady} deg"})
    return {"lag": float(np.degrees(run.tip_lag.values[-1, 0])), "closed": steady}


def formula() -> Numbers:
    """Largest gap of (18) to the computed rate, percent."""
    return {f"n{n}": float(gap(one.formula, one.rate).max()) for n in (20, 40) for one in [_rigid(n)]}


def corrected() -> Numbers:
    """Largest gap of the corrected formula, percent: from the momentum of body and tips, and of the body alone."""
    found: dict[str, float] = {}
    for n in (20, 40):
        one = _rigid(n)
        alone = one.corrected / (1.0 + 2.0 * 0.0005 * 0.05**2 / 0.004)
        found |= {f"n{n}": float(gap(one.corrected, one.rate).max()), f"body{n}": float(gap(alone, one.rate).max())}
    return found


def lags() -> Numbers:
    """Mean lag of the tip in four windows, n = 40, deg."""
    return dict(zip(("first", "second", "third", "last"), means(_rigid(40)), strict=True))


def damping() -> Numbers:
    """Largest change of the lag between the paper's least and largest damping after the first second, deg.

    It is largest in the first seconds, so that 20 s are run; figure IV.3 has the whole deployment.
    """
    least, most = (deployed(SPRINGS | {"blade.damping": d, "solver.duration": 20.0}) for d in (1e-6, 1.0))
    return {"lag": _largest_difference(least, most, since=1.0)}


def nodes() -> Numbers:
    """Lag with n = 20 and 40 beside each other: largest difference in deg and percent, and of the means."""
    a, b = _rigid(20), _rigid(40)
    late = a.t >= LATE
    return {
        "lag": _largest_difference(a, b),
        "percent": float(np.max(np.abs(a.lag / b.lag - 1.0)[late])) * 100.0,
        "mean": float(np.abs(np.subtract(means(a), means(b))).max()),
    }


def convergence() -> Numbers:
    """Largest difference of the lag from that with n = 160 after 5 s, deg."""
    fine = _rigid(160)
    return {f"n{n}": _largest_difference(_rigid(n), fine, since=5.0) for n in (20, 40, 80)}


def stiffness() -> Numbers:
    """Largest change of the lag between 1e7 and 1e9 N/m after the first second, 1e-6 deg, by generalized-alpha."""
    soft, middle, stiff = (
        deployed({"blade.stiffness": c, "solver.method": "generalized-alpha", "solver.step": 1e-3})
        for c in (1e7, 1e8, 1e9)
    )
    return {"c8": 1e6 * _largest_difference(soft, middle, 1.0), "c9": 1e6 * _largest_difference(soft, stiff, 1.0)}


def film() -> Numbers:
    """Largest difference of the lag with the film's stiffness from that of links of fixed length, deg."""
    return {"lag": _largest_difference(deployed(SPRINGS | {"blade.stiffness": 2e3}), _rigid(20))}


def taut() -> Numbers:
    """Least tension at the spool after the first second, mN, and how far the lag varies along the blade, deg."""
    run = tree(RIGID | {"blade.nodes": 40})
    late = run.time.values >= 1.0
    lag = np.degrees(run["blade-1"].signed_lag.values[late & (run.time.values >= LATE)])
    spread = np.nanmax(lag, axis=1) - np.nanmin(lag, axis=1)
    return {"tension": 1e3 * float(run.hub_tension.values[late].min()), "spread": float(np.nanmax(spread))}


def step_limit() -> Numbers:
    """Longest stable step of RK4, 1e-6 s."""
    return {f"n{n}": 1e6 * stability_limit(n, STIFFNESS) for n in (20, 40)}


def cost() -> Numbers:
    """Steps of a deployment, thousands: RK4 at its limit with 1e7 N/m, and links of fixed length."""
    import json

    steps = json.loads(tree(RIGID).attrs["statistics"])["steps"]
    return {"rk4": 1e-3 * 142.857 / stability_limit(20, STIFFNESS), "rigid": 1e-3 * steps}
