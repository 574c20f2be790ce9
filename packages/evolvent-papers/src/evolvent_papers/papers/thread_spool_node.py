"""Figures III.3 and III.4 of Tenenbaum (2014), and a map, ours: a thread that is paid out with no forces on it.

The body is at rest. How far nodes leave the plane z = r depends on the nodes a turn, on the stiffness of a segment,
c = E b h / l0, on its damping d, on the weight at the tip and on the length that is out. The paper gives none of these
for figure III.3; table IV.1 has them for the heliogyro.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from evolvent_base.figures import Figure, Line, Map, Note, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.thread_variants import Data, Deployment, Start, deploy
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
#: Radius, rate of the spool, line density and weight of the paper's data.
PAPER = Data()
#: E b h, N, of a film of 1e9 N/m2 with the line density of table IV.1 and 1400 kg/m3.
FILM = 500.0
#: E b h (N) and d (N s/m) of the regular case, and of the film with the package's damping.
REGULAR, STIFF = (0.5, 0.1), (FILM, 1e-3)
#: Turns over which the figures and the map go, nodes a turn, and shares of the time at which shapes are drawn.
TURNS, MAP_TURNS, NODES, SHAPES = 1.2, 0.6, (6, 12, 24, 64), (0.25, 0.5, 1.0)
#: E b h (N) and d (N s/m, the paper's range) of the map, and of its quick form.
TENSILE, QUICK_TENSILE = (0.05, 0.5, 5.0, 50.0, 500.0), (0.05, 0.5, 5.0)
DAMPINGS, QUICK_DAMPINGS = (1e-6, 1e-3, 1e-2, 0.1, 1.0), (1e-6, 1e-3, 0.1)
#: Change of the stiffness of a second run, and difference of both amplitudes from which a motion counts as chaotic.
CHANGE, CHAOTIC = 1e-3, 0.05
#: Largest distance from the plane, of r, with which a number of nodes suffices: ours, the paper gives none.
SUFFICES = 0.1


class Amplitude(NamedTuple):
    """What a run shows.

    Attributes
    ----------
    off : float, largest distance of a released node from the plane z = r, of r
    out : float, x of the tip over the length that has been paid out: 1 of a thread that leaves straight
    chaotic : bool, whether a change of c by 0.1 % changes `off` by more than 5 %
    """

    off: float
    out: float
    chaotic: bool


@functools.cache
def paid_out(
    nodes_a_turn: int,
    tensile: float = FILM,
    damping: float = 1e-3,
    *,
    weight: bool = False,
    turns: float = TURNS,
    start: Start = "spool node",
    kick: float = 0.0,
) -> tuple[Data, Deployment]:
    """A thread that is paid out over so many turns, rounded up to a whole segment.

    Parameters
    ----------
    tensile : float, E b h, N
    damping : float, d of a segment, N s/m
    weight : bool, whether the weight of table IV.1 hangs at the tip
    kick : float, speed of the tip along Z at the start, of the pay-out's
    """
    segment = 2.0 * math.pi * PAPER.radius / nodes_a_turn
    count = math.ceil(turns * nodes_a_turn)
    data = dataclasses.replace(
        PAPER, rate=0.0, nodes=count + 1, length=(count + 1) * segment, stiffness=tensile / segment, damping=damping,
        tip_mass=PAPER.tip_mass if weight else 0.0,
    )  # fmt: skip
    across = (0.0, 0.0, kick * data.speed)
    return data, deploy(data, start, until=count * segment / data.speed, samples=4, kick=across)


def off(found: tuple[Data, Deployment]) -> float:
    """Largest distance of a released node from the plane z = r, of r."""
    data, run = found
    return run.off_plane / data.radius


def bent(found: tuple[Data, Deployment]) -> float:
    """Largest distance of a released node from the straight line from Q to the tip, of r."""
    data, run = found
    from_q = run.positions[1:] - np.array([0.0, 0.0, data.radius])
    tip = from_q[:, :1]
    along = np.sum(from_q * tip, axis=2, keepdims=True) / np.sum(tip * tip, axis=2, keepdims=True)
    return float(np.nanmax(np.linalg.norm(from_q - along * tip, axis=2))) / data.radius


def out(found: tuple[Data, Deployment]) -> float:
    """The tip's x over the length that has been paid out."""
    data, run = found
    return float(run.positions[-1, 0, 0]) / (data.speed * float(run.t[-1]))


def amplitude(nodes_a_turn: int, tensile: float, damping: float, *, weight: bool) -> Amplitude:
    """The larger one of two runs over 0.6 turns whose stiffnesses differ by 0.1 %."""
    runs = [
        paid_out(nodes_a_turn, tensile * (1.0 + change), damping, weight=weight, turns=MAP_TURNS)
        for change in (0.0, CHANGE)
    ]
    one, other = (off(run) for run in runs)
    return Amplitude(max(one, other), min(map(out, runs)), abs(one - other) > CHAOTIC * max(one, other))


def figure_3_3(options: Options) -> Made:
    """Shapes of the thread where the boundary node is pulled towards the next node, on the spool."""
    title = (
        "Results of the numerical integration of the unwinding of the thread where eqs. (3, 4) are used to calculate "
        "the reactions of the links on boundary nodes (no external forces) (Tenenbaum 2014, figure III.3; ours: "
        "$c$, $d$, length, numbers of nodes)"
    )
    return _unwinding("thread-figure-3-3", title, "spool node")


def figure_3_4(options: Options) -> Made:
    """Shapes of the thread where the boundary node is pulled towards the departure point."""
    title = (
        "Unwinding of the thread where eqs. (7, 8) are used for boundary nodes (Tenenbaum 2014, figure III.4; ours: "
        "caption, which is lost, $c$, $d$, length, numbers of nodes)"
    )
    return _unwinding("thread-figure-3-4", title, "departure")


def _unwinding(name: str, title: str, start: Start) -> Made:
    """Shapes in the plane of X and Z for each number of nodes on a turn; below them the film, ours.

    With the departure point the tip of the film starts along Z, since the thread leaves straight by symmetry else.
    """
    cases = [(nodes, *REGULAR, 0.0) for nodes in NODES] + [(12, *STIFF, 0.1 if start == "departure" else 0.0)]
    panels, rows = [], []
    distances: list[Line] = []
    for nodes, tensile, damping, kick in cases:
        data, run = paid_out(nodes, tensile, damping, start=start, kick=kick)
        regular = (tensile, damping) == REGULAR
        film = "" if regular else f"ours: the film, {tensile:g} N, "
        across = ", tip starts along $Z$" if kick else ""
        panels.append(_shapes(f"{film}{nodes} nodes on a turn{across}", data, run, start))
        far = np.nanmax(np.abs(run.positions[:, :, 2] / data.radius - 1.0), axis=1, initial=0.0)
        turns = data.spool_rate * run.t / (2.0 * math.pi)
        label = f"{nodes} nodes" if regular else f"film, {nodes} nodes{across}"
        distances.append(Line(x=turns, y=far, label=label, color=len(distances), width=1.2))
        values = (off((data, run)), run.positions[-1, 0, 0] / data.radius, data.speed * run.t[-1] / data.radius)
        rows.append([str(nodes), f"{tensile:g}", f"{damping:g}", *(f"{value:.4f}" for value in values)])
    panels.append(
        Panel(
            x_label="turns", y_label="largest |z - r| / r", lines=distances, y_zero=True, y_span=1.0,
            title="ours: distance from the plane",
        )
    )  # fmt: skip
    head = ["nodes on a turn", "E b h, N", "d, N s/m", "largest distance from z = r over r"]
    head += ["x / r of the tip at the end", "length out / r"]
    note = (
        "No external forces, body at rest, no weight at the tip; r, rate of the spool and mass per length of the "
        "paper. Our reading: shapes in the plane of X and Z. The paper gives no c, d and length for the figure; our "
        f"choice: a regular motion, E b h = c l0 = {REGULAR[0]:g} N, d = {REGULAR[1]:g} N s/m, {TURNS:g} turns, "
        f"rounded up to a whole segment. With the film of table IV.1, {STIFF[0]:g} N, and d = {STIFF[1]:g} N s/m the "
        "motion by (3, 4) is chaotic; `evolvent figure thread-spool-node-map` has others. Computed with the equations "
        "of the paper, by RK4, without the package's solvers.\n"
    )
    figure = Figure(name=name, title=title, panels=panels, columns=2, height=205.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure)


def _shapes(title: str, data: Data, run: Deployment, start: Start) -> Panel:
    """Shapes at times in the plane of X and Z, with the spool."""
    turn = np.linspace(0.0, 2.0 * math.pi, 121)
    lines = [Line(x=np.cos(turn), y=np.sin(turn), color="0.6", width=1.0)]
    for k, share in enumerate(SHAPES):
        at = round(share * (len(run.t) - 1))
        x, z = _shape(data, start, float(run.t[at]), run.positions[at]).T / data.radius
        label = f"{data.spool_rate * run.t[at] / (2.0 * math.pi):.2f} turns"
        marker = "o" if data.nodes < 40 else "."
        lines.append(Line(x=x, y=z, label=label, color=k / (len(SHAPES) - 1), marker=marker, width=1.2))
    return Panel(x_label="X / r", y_label="Z / r", lines=lines, equal=True, title=title)


def _shape(data: Data, start: Start, t: float, nodes: Array) -> Array:
    """Coordinates x and z of the free nodes and of what the boundary node is pulled towards, (k, 2), m."""
    free = nodes[np.isfinite(nodes[:, 0])][:, [0, 2]]
    angle = data.spool_rate * t - data.segment / data.radius * len(free) if start == "spool node" else 0.0
    return np.vstack([free, data.radius * np.array([math.sin(angle), math.cos(angle)])])


def node_map(options: Options) -> Made:
    """Distance from the plane over c, d and the nodes a turn, without and with the weight at the tip, ours."""
    tensile, dampings = (QUICK_TENSILE, QUICK_DAMPINGS) if options.quick else (TENSILE, DAMPINGS)
    panels, rows = [], []
    for nodes in NODES:
        for weight in (False, True):
            found = [[amplitude(nodes, force, d, weight=weight) for d in dampings] for force in tensile]
            words = "weight $m_k$" if weight else "no weight"
            panels.append(_cells(f"{nodes} nodes on a turn, {words}", tensile, dampings, found, marked=not weight))
            for force, line in zip(tensile, found, strict=True):
                rows.append([str(nodes), "yes" if weight else "no", f"{force:g}", *map(_written, line)])
            options.report(f"{nodes} nodes on a turn, {words}")
    head = ["nodes on a turn", "weight", "E b h, N", *(f"d = {d:g}" for d in dampings)]
    note = (
        f"Ours: largest |z - r| / r of the nodes over {MAP_TURNS:g} turns of the spool, with eqs. (3, 4) on the "
        "boundary node, no external forces and the body at rest. c = E b h / l0, d in N s/m over the paper's range. "
        f"~ a chaotic motion: a change of c by {100.0 * CHANGE:g} % changes the value by more than "
        f"{100.0 * CHAOTIC:g} %; the larger one is given. m_k = {1e3 * PAPER.tip_mass:g} g at the tip, as "
        f"in table IV.1. Blue: below {SUFFICES:g} r.\n"
    )
    title = f"ours: largest |z - r| / r over {MAP_TURNS:g} turns by eqs. (3, 4); ~: chaotic; blue: below {SUFFICES:g}"
    figure = Figure(name="thread-spool-node-map", title=title, panels=panels, columns=2, height=225.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure)


def _written(one: Amplitude) -> str:
    """The amplitude, of r, in two digits."""
    digits = max(1 - math.floor(math.log10(max(one.off, 1e-3))), 0)
    return f"{'~' if one.chaotic else ''}{one.off:.{min(digits, 3)}f}"


def _cells(
    title: str,
    tensile: tuple[float, ...],
    dampings: tuple[float, ...],
    found: list[list[Amplitude]],
    *,
    marked: bool,
) -> Panel:
    """A map with the value in each cell, and boxes about the cases of figure III.3."""
    x, y = np.arange(float(len(dampings))), np.arange(float(len(tensile)))
    values = np.array([[one.off for one in line] for line in found]).T
    notes = [Note(at=(k, j), text=_written(one)) for j, line in enumerate(found) for k, one in enumerate(line)]
    lines = []
    for case, label, color in ((REGULAR, "figure III.3", "black"), (STIFF, "film", "gold")):
        if marked and case[0] in tensile and case[1] in dampings:
            k, j = dampings.index(case[1]), tensile.index(case[0])
            corners = 0.47 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
            lines.append(Line(x=k + corners[:, 0], y=j + corners[:, 1], label=label, color=color, width=2.0))
    ends = (SUFFICES / 100.0, 100.0 * SUFFICES)
    drawn = Map(x=x, y=y, values=values, label="largest |z - r| / r", limits=ends, log=True, colors="RdBu_r")
    return Panel(
        x_label="d, N s/m", y_label="$c\\,l_0 = E\\,b\\,h$, N", lines=lines, title=title, map=drawn, notes=notes,
        x_names={float(k): f"{d:g}" for k, d in enumerate(dampings)},
        y_names={float(k): f"{force:g}" for k, force in enumerate(tensile)},
    )  # fmt: skip
