"""Measurements for Tenenbaum (2014), section III.3: eqs. (3, 4) or (7, 8) on the boundary node, without forces."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np

from evolvent_papers.papers import thread_spool_node as sn
from evolvent_papers.papers.thread_variants import Data

#: Largest E b h / d, m/s, of the cells of the map in which the motion is regular and 64 nodes a turn suffice.
REGULAR = 50.0


def _film(nodes_a_turn: int, dampings: tuple[float, ...] = (1e-3,), runs: int = 8) -> float:
    """Mean distance from the plane, of r, of runs of the film over 0.6 turns that differ by 1e-6 of the stiffness."""
    changes = [sn.FILM * (1.0 + 1e-6 * k) for k in range(1, runs + 1)]
    found = [sn.paid_out(nodes_a_turn, c, d, turns=sn.MAP_TURNS) for c in changes for d in dampings]
    return float(np.mean([sn.off(one) for one in found]))


def spool_node() -> Mapping[str, float]:
    """Figure III.3: distance from the plane, of r, and least share of the length by which the tip is out.

    Over 1.2 turns of the regular case. Of the film, over 0.6 turns, the mean of 8 runs, which is reproducible to 10 %.
    """
    runs = {nodes: sn.paid_out(nodes, *sn.REGULAR) for nodes in sn.NODES}
    found = {f"off_{nodes}": sn.off(one) for nodes, one in runs.items()}
    return found | {"out": min(map(sn.out, runs.values())), "film_6": _film(6), "film_12": _film(12)}


def departure_point() -> Mapping[str, float]:
    """Figure III.4: a tip that starts along Z at a tenth of the pay-out's speed, 6 nodes a turn, over 1.2 turns.

    Largest distance of a node from the straight line from Q to the tip, of r, with the departure point, of the film and
    of the regular case the larger one, and with the next node on the spool (of the film the mean of 8 runs); z of the
    tip at the end over that of a tip that nothing pulls.
    """
    straight = [sn.paid_out(6, *case, start="departure", kick=0.1) for case in (sn.STIFF, sn.REGULAR)]
    film = [sn.paid_out(6, sn.FILM * (1.0 + 1e-6 * k), kick=0.1) for k in range(1, 9)]
    data, run = straight[0]
    rise = float(run.positions[-1, 0, 2]) - data.radius
    return {
        "bent": max(map(sn.bent, straight)),
        "bent_film": float(np.mean([sn.bent(one) for one in film])),
        "bent_regular": sn.bent(sn.paid_out(6, *sn.REGULAR, kick=0.1)),
        "drift": rise / (0.1 * data.speed * float(run.t[-1])),
    }


@functools.cache
def _region(nodes_a_turn: int, *, weight: bool = False) -> dict[tuple[float, float], float]:
    """Distances from the plane, of r, in the cells of the map with E b h / d <= 50 m/s and d < 1 N s/m."""
    cells = [(c, d) for c in sn.TENSILE for d in sn.DAMPINGS if d < 1.0 and c <= REGULAR * d * (1.0 + 1e-9)]
    return {cell: sn.amplitude(nodes_a_turn, *cell, weight=weight).off for cell in cells}


def nodes_64() -> Mapping[str, float]:
    """Nodes of the blade at 64 nodes a turn, distance from the plane, of r, over 0.6 turns, and work beside 20 nodes.

    The largest distance in the regular cells of the map with 64 and 24 nodes a turn; of the film the mean over dampings
    of 1e-6 to 0.1 N s/m. The work is that of the nodes and of the stable step of a film.
    """
    nodes = round(64 / Data(nodes=1).nodes_a_turn)
    return {
        "nodes": float(nodes),
        "work": (nodes / 20.0) ** 2,
        "off": max(_region(64).values()),
        "fewer": max(_region(24).values()),
        "film": _film(64, (1e-6, 1e-3, 1e-2, 0.1), runs=1),
    }


def node_map() -> Mapping[str, float]:
    """What the map shows in its regular cells with d below 1 N s/m, over 0.6 turns, distances of r.

    `fall_12`, `fall_24`: least ratio of the distance to that with twice the nodes. `off_64` without and `weight_64`
    with the weight at the tip. `tenth`: largest change where E b h and d are both ten times as large. `longer`: of the
    case of figure III.3 with 64 nodes, over 1.2 turns in place of 0.6.
    """
    six, twelve, many = (_region(nodes) for nodes in (6, 12, 24))
    scaled = [(cell, (10.0 * cell[0], 10.0 * cell[1])) for cell in six if cell[1] >= 1e-2]
    pairs = [(cells[a], cells[b]) for cells in (six, twelve, many) for a, b in scaled if b in cells]
    return {
        "fall_12": min(six[cell] / twelve[cell] for cell in six),
        "fall_24": min(twelve[cell] / many[cell] for cell in six),
        "off_64": max(_region(64).values()),
        "weight_64": max(_region(64, weight=True).values()),
        "tenth": max(abs(a / b - 1.0) for a, b in pairs),
        "longer": sn.off(sn.paid_out(64, *sn.REGULAR)) / sn.off(sn.paid_out(64, *sn.REGULAR, turns=sn.MAP_TURNS)),
    }
