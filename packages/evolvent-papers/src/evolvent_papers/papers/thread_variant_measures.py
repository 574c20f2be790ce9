"""Measurements for Tenenbaum (2014) on other models of the thread, on the film and on the spool.

The other models are those of `evolvent_papers.papers.thread_variants`. The quick rows have springs of 1e3 N/m, which
change the lag by 0.016 deg and the rates by 0.01 %.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

import evolvent
from evolvent import cases
from evolvent_papers.heliogyro.free_body import largest_difference
from evolvent_papers.papers.thread_runs import RIGID, STIFFNESS, deployed, stability_limit, tree
from evolvent_papers.papers.thread_spool_node import paid_out
from evolvent_papers.papers.thread_variants import SHARE, Data, deploy

if TYPE_CHECKING:
    from evolvent_papers.papers.thread_variants import Data, Deployment, Start

#: Mean lag of the tip of the limit of many nodes between 20 and 60 s, degrees.
LAG = 13.32
LINKS = {"blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "1 s"}


def _data(nodes: int = 20, stiffness: float = 1e3) -> Data:
    return Data(nodes=nodes, stiffness=stiffness)


@functools.cache
def _deploy(nodes: int = 20, stiffness: float = 1e3, start: Start = "departure", **options: Any) -> Deployment:
    return deploy(_data(nodes, stiffness), start, **options)


def scheme() -> Mapping[str, float]:
    """The paper's scheme by its own model, beside the engine."""
    own = _deploy()
    engine = evolvent.run("heliogyro", {"blade.stiffness": 1e3, "output.every": own.t[20], "output.fine": False})
    lag = np.degrees(engine.tip_lag.values[1:, 0])
    return {
        "rate": float(own.rate[-1]),
        "rate_engine": float(engine.body_rate.values[-1]),
        "lag": own.mean_lag(20.0, 60.0),
        "lag_gap": float(np.abs(own.lag[20::20] - lag).max()),
        "gain": 100.0 * float(own.momentum[-1] / own.momentum[0] - 1.0),
    }


def chord() -> Mapping[str, float]:
    """Least distance from the spool's axis of the line from the boundary node to the next one, mean over a run, of r.

    Of the film with 6 nodes a turn over its first turns, and of 20 nodes; `departure` is that of the line to Q.
    """
    six, twenty = paid_out(6, start="departure"), (_data(20), _deploy())
    found = {name: _to_the_spool(*run) for name, run in (("six", six), ("twenty", twenty))}
    return {name: line for name, (line, _) in found.items()} | {"departure": found["six"][1]}


def _to_the_spool(data: Data, found: Deployment) -> tuple[float, float]:
    """Mean least distance from the spool's axis, of r, of lines from the boundary node: to the next node, and to Q."""
    lines = []
    for t, x in zip(found.t[1:], found.positions[1:, :, ::2], strict=True):
        out = int(np.isfinite(x[:, 0]).sum())
        if out == data.nodes:
            break
        angle = data.spool_rate * t - data.segment / data.radius * out
        lines.append([
            _least_distance(x[out - 1], data.radius * np.array(end))
            for end in ((math.sin(angle), math.cos(angle)), (0.0, 1.0))
        ])  # fmt: skip
    spool, to_q = np.mean(lines, axis=0) / data.radius
    return float(spool), float(to_q)


def _least_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Least distance from the origin of the points of the line from a to b."""
    along = b - a
    share = np.clip(-(a @ along) / max(float(along @ along), 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(a + share * along))


def any_step() -> Mapping[str, float]:
    """Pitch of 10 and 20 nodes on the spool, rad, and what they change in mean lags (deg) and rate (rad/s) from 40.

    `spool` is the rate at the end of 20 nodes by (3, 4) for the boundary node, `fine` that of 40 by (7, 8), rad/s.
    """
    windows = ((7.0, 20.0), (20.0, 60.0), (60.0, 100.0), (100.0, 142.0))
    runs = {n: _deploy(n, stiffness=50.0 * n) for n in (10, 20, 40)}
    found = {"fine": float(runs[40].rate[-1]), "spool": float(_deploy(start="spool node").rate[-1])}
    for n in (10, 20):
        lags = [abs(runs[n].mean_lag(*window) - runs[40].mean_lag(*window)) for window in windows]
        found |= {f"step_{n}": 5.0 / (n * 0.01), f"lag_{n}": max(lags)}
        found[f"rate_{n}"] = float(np.abs(np.interp(runs[40].t, runs[n].t, runs[n].rate) - runs[40].rate).max())
    return found


def boundary() -> Mapping[str, float]:
    """Rest length of (10) and distance from Q of the boundary node, m, and their largest difference, of l0."""
    found = _deploy(stiffness=1e4)
    out = np.isfinite(found.positions[:, :, 0]).sum(axis=1)
    node = found.positions[np.arange(out.size), out - 1] - np.array([0.0, 0.0, 0.01])
    rest, distance = 0.035 * found.t - 0.25 * (out - 1), np.linalg.norm(node, axis=1)
    return {
        "rest": float(rest[-8]),
        "distance": float(distance[-8]),
        "gap": float(np.abs(rest - distance).max()) / 0.25,
    }


def at_departure() -> Mapping[str, float]:
    """Eq. (11) with its distance, with none, and with a million times it, over 30 s at 1e3 N/m.

    Share of the samples that are finite with and without it, and what the larger distance changes in the lag, deg.
    """
    runs = {tiny: _deploy(until=30.0, tiny=tiny) for tiny in (1e-10, 0.0, 1e-4)}
    right, without, wide = runs.values()
    count = wide.t.size
    return {
        "with_it": right.t.size / count,
        "without": without.t.size / count,
        "wider": float(np.abs(right.lag - wide.lag)[right.t > 1.0].max()),
    }


def node_n() -> Mapping[str, float]:
    """Body's rate at the end where node n is released by (1) and where it stays on the spool, rad/s."""
    return {"released": float(_deploy().rate[-1]), "held": float(_deploy(held=True).rate[-1])}


def _boundary_stiffness(nodes: int) -> tuple[Deployment, Deployment]:
    """60 s with a constant stiffness of the boundary segment, and with that of its length."""
    return _deploy(nodes, until=60.0), _deploy(nodes, start="scaled", until=60.0)


def boundary_across() -> Mapping[str, float]:
    """What the stiffness of the boundary segment changes in the lag after 7 s, deg, and in the body's rate, rad/s."""
    found = {}
    for nodes in (20, 40):
        constant, scaled = _boundary_stiffness(nodes)
        lag = np.interp(constant.t, scaled.t, scaled.lag)
        rate = np.interp(constant.t, scaled.t, scaled.rate)
        found[f"lag_{nodes}"] = float(np.abs(constant.lag - lag)[constant.t > 7.0].max())
        found[f"rate_{nodes}"] = float(np.abs(constant.rate - rate).max())
    return found


def boundary_along() -> Mapping[str, float]:
    """Largest tension at the spool, mN, with both stiffnesses of the boundary segment; its change, percent.

    Over 36 s, which hold the largest of all, with a quarter of the usual step: RK4 near its stability limit damps the
    overshoot after a release, by 9 % and by 35 % where the segment is stiffer.
    """
    found: dict[str, float] = {}
    for nodes in (20, 40):
        peaks = []
        for start in ("departure", "scaled"):
            step = 0.25 * SHARE * _data(nodes).stable_step(start)
            peaks.append(1e3 * float(np.nanmax(_deploy(nodes, start=start, until=36.0, step=step).pull)))
        constant, scaled = peaks
        found |= {f"constant_{nodes}": constant, f"scaled_{nodes}": scaled}
        found[f"percent_{nodes}"] = 100.0 * abs(scaled / constant - 1.0)
    return found


def boundary_by_length() -> Mapping[str, float]:
    """What the option of the engine changes in 60 s at 1e3 N/m: lag after 7 s (deg), rate (rad/s), ringing (mN).

    Ringing: root mean square of the tension at the spool about its mean over 1 s.
    """
    found: dict[str, float] = {}
    for nodes in (20, 40):
        runs = []
        for kind in ("constant", "by-length"):
            given = {"blade.nodes": nodes, "blade.stiffness": 1e3, "blade.boundary_segment": kind}
            keys = {"solver.duration": 60.0, "output.every": 0.01, "output.fine": False}
            runs.append(evolvent.run("heliogyro", given | keys))
            tension = runs[-1].hub_tension.values[:, 0]
            about = tension[50:-50] - np.convolve(tension, np.full(101, 1.0 / 101.0), "valid")
            found[f"ring_{kind[:2]}_{nodes}"] = 1e3 * float(
                np.sqrt(np.mean(about[runs[-1].time.values[50:-50] > 7.2] ** 2))
            )
        constant, scaled = runs
        late = constant.time.values > 7.0
        lag = np.degrees(constant.tip_lag.values - scaled.tip_lag.values)[late]
        found[f"lag_{nodes}"] = float(np.abs(lag).max())
        found[f"rate_{nodes}"] = float(np.abs(constant.body_rate.values - scaled.body_rate.values).max())
    return found


def unequal_blades() -> Mapping[str, float]:
    """Difference of two blades' rates, percent, that tilts a free body by 1 deg in closed form; a run with it.

    Largest nutation of the run and of rigid blades, deg, offset of the mass centre, mm; and the tilt in closed form at
    that difference of a body whose moments of inertia differ half as much.
    """
    case, half = (
        cases.load("heliogyro-unequal", {"spool.rate": 3.5, "body.inertia": [moment, moment, 0.004]})
        for moment in (0.00328, 0.00364)
    )
    share = largest_difference(case, math.radians(1.0))
    run = evolvent.run("heliogyro-unequal", {"spool.rate": [3.5, 3.5 * (1.0 - share)]})
    return {
        "limit": 100.0 * share,
        "limit_half": 100.0 * largest_difference(half, math.radians(1.0)),
        "nutation": math.degrees(float(run.nutation.values.max())),
        "rigid": math.degrees(float(run.nutation_rigid.values.max())),
        "offset": 1e3 * float(np.linalg.norm(run.mass_centre.values, axis=1).max()),
    }


def torque_as_printed() -> Mapping[str, float]:
    """Body's rate at the end with eq. (15) as printed, rad/s, and by (18); angular momentum over that at the start."""
    right, n20, n40 = _deploy(), _deploy(printed=True), _deploy(40, printed=True)
    return {
        "right": float(right.rate[-1]),
        "n20": float(n20.rate[-1]),
        "n40": float(n40.rate[-1]),
        "formula": 6.0 * 0.004 / (0.004 + 2.0 / 3.0 * 0.000735 * 125.0 + 2.0 * 0.0005 * 25.0),
        "momentum": float(n20.momentum[-1] / n20.momentum[0]),
    }


def sazonov() -> Mapping[str, float]:
    """Nodes added at the spool, with and without the influx of momentum, beside the departure point."""
    right, found = _deploy(), {}
    for nodes in (20, 40):
        for name, influx in (("plain", False), ("influx", True)):
            one = _deploy(nodes, start="growing", influx=influx)
            found[f"lag_{name}_{nodes}"] = abs(one.mean_lag(20.0, 60.0) - LAG)
            found[f"gain_{name}_{nodes}"] = 100.0 * float(one.momentum[-1] / one.momentum[0] - 1.0)
            if nodes == 20:
                found[f"rate_{name}"] = float(one.rate[-1])
                found["steps"] = one.steps / right.steps
    return found


def more_accurate() -> Mapping[str, float]:
    """How far 20 nodes are from many: rate at the end, percent, and mean lag from 20 to 60 s, deg.

    By the paper's model, and by nodes added at the spool without and with the influx of momentum; many nodes are 80 of
    links of fixed length, whose lag is that of 160 to 0.01 deg.
    """
    fine = deployed(RIGID | {"blade.nodes": 80})
    lag = float(fine.lag[(fine.t >= 20.0) & (fine.t <= 60.0)].mean())
    found = {}
    for name, run in (
        ("paper", _deploy()), ("plain", _deploy(start="growing")), ("influx", _deploy(start="growing", influx=True)),
    ):  # fmt: skip
        found[f"rate_{name}"] = 100.0 * abs(float(run.rate[-1] / fine.rate[-1]) - 1.0)
        found[f"lag_{name}"] = abs(run.mean_lag(20.0, 60.0) - lag)
    return found


def film_over_nodes() -> Mapping[str, float]:
    """Stiffness of a segment of a film of 1e9 N/m2, 20 um and 26.25 mm, by the case, N/m."""
    film = {"blade.young_modulus": "1 GPa", "blade.thickness": "20 um", "blade.width": "26.25 mm"}
    loaded = {n: cases.load("heliogyro", film | {"blade.nodes": n}) for n in (20, 40, 80)}
    return {f"c{n}": case.blade.segment_stiffness for n, case in loaded.items()}


def paper_case() -> Mapping[str, float]:
    """The case `heliogyro-paper`, whole; stable steps at 1e7 N/m, 1e-6 s, and steps of links of fixed length."""
    rigid = tree(RIGID)

    found = evolvent.run("heliogyro-paper", {"output.fine": False})
    inside = (found.time.values >= 20.0) & (found.time.values <= 60.0)
    return {
        "rate": float(found.body_rate.values[-1]),
        "lag": float(np.degrees(found.tip_lag.values[inside, 0]).mean()),
        "steps": 1e-6 * json.loads(found.attrs["statistics"])["steps"],
        "limit_20": 1e6 * stability_limit(20, STIFFNESS),
        "limit_40": 1e6 * stability_limit(40, STIFFNESS),
        "rigid_rate": float(rigid.body_rate.values[-1]),
        "rigid": 1e-3 * json.loads(rigid.attrs["statistics"])["steps"],
    }


def spiral() -> Mapping[str, float]:
    """Time that 5 m take on a spool that a film of 0, 5 and 20 um is wound on."""
    found = {h: evolvent.run("heliogyro", LINKS | {"spool.film_thickness": f"{h} um"}) for h in (0, 5, 20)}
    times = {f"t{h}": float(run.time.values[-1]) for h, run in found.items()}
    return times | {"percent": 100.0 * (times["t20"] / times["t0"] - 1.0)}


def free_spool() -> Mapping[str, float]:
    """A spool that the thread turns against a viscous brake of 20 uN m s."""
    free = {"inertia": 1e-6, "viscous_damping": 2e-5, "rate": 3.5}
    changes = LINKS | {"spool.rate": None, "spool.free": free, "spool.start_length": "0.1 m", "solver.duration": 300.0}
    found = evolvent.run("heliogyro", changes)
    length = found.deployed_length.values[:, 0]
    return {
        "half": float(np.interp(2.5, length, found.time.values)),
        "length": float(length[-1]),
        "lag": float(np.degrees(found.tip_lag.values[:, 0]).max()),
    }
