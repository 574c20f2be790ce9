"""Measurements for Tenenbaum (2014) on other models of the thread, on the film and on the spool.

The other models are those of `evolvent.papers.thread_variants`. The quick rows have springs of 1e3 N/m, which change
the lag by 0.016 deg and the rates by 0.01 %.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from evolvent.papers.thread_variants import Data, Deployment, Start

#: E thickness width of the film, N: 2e3 N/m for a segment of 0.25 m.
FILM = 500.0
#: Mean lag of the tip of the limit of many nodes between 20 and 60 s, degrees.
LAG = 13.32
LINKS = {"blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "1 s"}


def _deploy(nodes: int = 20, stiffness: float = 1e3, start: Start = "departure", **options: Any) -> Deployment:
    from evolvent.papers.thread_variants import Data, deploy

    return deploy(Data(nodes=nodes, stiffness=stiffness), start, **options)


def _on_the_spool(per_turn: int, turns: float, start: Start = "spool node") -> tuple[Data, Deployment]:
    """The film with so many nodes a turn, over the first turns of the spool."""
    from evolvent.papers.thread_variants import Data, deploy

    nodes = round(per_turn / Data(nodes=1).nodes_a_turn)
    data = Data(nodes=nodes, stiffness=FILM * nodes / 5.0)
    return data, deploy(data, start, until=turns * 2.0 * math.pi / data.spool_rate, samples=4)


def _off(data: Data, found: Deployment) -> float:
    return found.off_plane / data.radius


def scheme() -> Mapping[str, float]:
    """The paper's scheme by its own model, beside the engine."""
    import evolvent

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


def spool_node() -> Mapping[str, float]:
    """Nodes on the spool as neighbours of the boundary node, 6 and 12 a turn, over two turns."""
    found = {per: _on_the_spool(per, 2.0) for per in (6, 12)}
    return {f"off_{per}": _off(*one) for per, one in found.items()} | {
        f"swing_{per}": float(np.ptp(one.lag[one.t > 1.0])) for per, (_, one) in found.items()
    }


def departure_point() -> Mapping[str, float]:
    """The same with the departure point."""
    data, found = _on_the_spool(6, 2.0, "departure")
    return {"off": _off(data, found), "swing": float(np.ptp(found.lag[found.t > 1.0]))}


def nodes_64() -> Mapping[str, float]:
    """64 nodes a turn, over two turns."""
    found = {per: _on_the_spool(per, 2.0) for per in (24, 64)}
    nodes = found[64][0].nodes
    return {
        "nodes": float(nodes),
        "off_24": _off(*found[24]),
        "off_64": _off(*found[64]),
        "work": (nodes / 20.0) ** 2,
    }


def torque_as_printed() -> Mapping[str, float]:
    """Rate of the body at the end with eq. (15) as printed."""
    right, n20, n40 = _deploy(), _deploy(printed=True), _deploy(40, printed=True)
    return {
        "right": float(right.rate[-1]),
        "n20": float(n20.rate[-1]),
        "n40": float(n40.rate[-1]),
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


def film_over_nodes() -> Mapping[str, float]:
    """Stiffness of a segment of the film, of a width and thickness that make 500 N."""
    from evolvent import cases

    film = {"blade.young_modulus": "5 GPa", "blade.thickness": "5 um", "blade.width": "2 cm"}
    loaded = {n: cases.load("heliogyro", film | {"blade.nodes": n}) for n in (20, 40, 80)}
    return {f"c{n}": case.blade.segment_stiffness for n, case in loaded.items()}


def slip_of_units() -> Mapping[str, float]:
    """What 1e7 N/m would be of a film, and the lag at the film's own stiffness."""
    film, links = _deploy(stiffness=2e3), _deploy(stiffness=5e4)
    return {
        "product": 1e7 * 5.0 / 20.0,
        "ratio": 1e7 / 2e3,
        "lag": float(np.abs(film.lag[20::20] - links.lag[20::20]).max()),
    }


def paper_case() -> Mapping[str, float]:
    """The case `heliogyro-paper`, whole."""
    import evolvent

    found = evolvent.run("heliogyro-paper", {"output.fine": False})
    inside = (found.time.values >= 20.0) & (found.time.values <= 60.0)
    return {
        "rate": float(found.body_rate.values[-1]),
        "lag": float(np.degrees(found.tip_lag.values[inside, 0]).mean()),
        "steps": 1e-6 * json.loads(found.attrs["statistics"])["steps"],
    }


def spiral() -> Mapping[str, float]:
    """Time that 5 m take on a spool that a film of 0, 5 and 20 um is wound on."""
    import evolvent

    found = {h: evolvent.run("heliogyro", LINKS | {"spool.film_thickness": f"{h} um"}) for h in (0, 5, 20)}
    return {f"t{h}": float(run.time.values[-1]) for h, run in found.items()}


def free_spool() -> Mapping[str, float]:
    """A spool that the thread turns against a viscous brake of 20 uN m s."""
    import evolvent

    free = {"inertia": 1e-6, "viscous": 2e-5, "rate": 3.5}
    changes = LINKS | {"spool.rate": None, "spool.free": free, "spool.start_length": "0.1 m", "solver.duration": 300.0}
    found = evolvent.run("heliogyro", changes)
    length = found.deployed_length.values[:, 0]
    return {
        "half": float(np.interp(2.5, length, found.time.values)),
        "length": float(length[-1]),
        "lag": float(np.degrees(found.tip_lag.values[:, 0]).max()),
    }
