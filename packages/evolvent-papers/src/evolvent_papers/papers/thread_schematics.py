"""Figures II.1, III.1, III.2 and IV.1 of Tenenbaum (2014): schematics of the model, drawn from a run with few nodes.

Each title is the paper's caption, translated; what is ours is named in the picture. Lengths are those of the run: a
thread of 0.12 m in 24 segments, about 12 to a turn of the spool (figure III.2: in 10), with the paper's body, spool and
rates.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from evolvent_base.figures import Figure, Line, Note, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.thread_runs import RIGID, tree
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
#: Radius of the spool, its rate, its distance from the spin axis, length of the thread (m, rad/s).
R, SPOOL, L0, LENGTH = 0.01, 3.5, 0.05, 0.12
#: A whole turn of the spool holds this many nodes, about; older turns lie under the first.
SHOWN = 12
#: Nodes and time (s) of the run: 24 of which eight have left the spool; of figure III.2 10 of which one has.
SEEN, BOUNDARY = (24, 1.1), (10, 0.2)
#: Angle by which the frame of the body leads the inertial frame in the drawing of the sail, rad.
TURN = 0.7
GREY = "0.45"


class Drawn(NamedTuple):
    """The run's last sample, in the frame of the spool.

    Attributes
    ----------
    nodes : (n, 3) float, m, from the tip to the spool
    out : int, nodes that are released
    phi : float, rad, angle of the spool
    lag : float, rad, of the tip
    segment : float, m, length of a segment
    """

    nodes: Array
    out: int
    phi: float
    lag: float
    segment: float

    @property
    def wound(self) -> Array:
        """Angle of each node on the spool from the departure point, rad (eq. 2): below zero, before it leaves."""
        return self.phi - self.segment / R * np.arange(len(self.nodes))


@functools.cache
def drawn(nodes: int = SEEN[0], time: float = SEEN[1]) -> Drawn:
    """The thread of few nodes at a time."""
    changes = {"blade.length": LENGTH, "blade.nodes": nodes, "solver.duration": time, "output.every": time}
    run = tree(RIGID | changes)
    blade, angle = run["blade-1"], run.body_angle.values[-1]
    x, y, z = blade.position.values[-1].T
    turned = np.column_stack(
        [x * math.cos(angle) + y * math.sin(angle) - L0, y * math.cos(angle) - x * math.sin(angle), z]
    )
    out = int(np.sum(blade.released.values[-1] > 0.0))
    return Drawn(turned, out, SPOOL * time, float(run.tip_lag.values[-1, 0]), LENGTH / nodes)


def _arc(
    radius: float, start: float = 0.0, stop: float = 2.0 * math.pi, centre: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """Points of an arc, as (2, k): angles from the x axis."""
    turn = np.linspace(start, stop, 121)
    return np.array([centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn)])


def _line(points: Array, **given: object) -> Line:
    """A line through points (2, k), in millimetres."""
    return Line(x=1e3 * points[0], y=1e3 * points[1], **given)  # type: ignore[arg-type]


def _between(a: tuple[float, float], b: tuple[float, float], **given: object) -> Line:
    return _line(np.array([a, b]).T, **given)


def _arrow(start: tuple[float, float], end: tuple[float, float], **given: object) -> list[Line]:
    """A line with a head at its end."""
    along = np.array(end) - np.array(start)
    along *= 1.6e-3 / np.linalg.norm(along)
    across = 0.4 * np.array([-along[1], along[0]])
    head = np.array([end - along + across, end, end - along - across]).T
    given = {"color": 0, "width": 0.9} | given
    return [_between(start, end, **given), _line(head, **given)]


def _note(at: tuple[float, float], text: str, points_to: tuple[float, float] | None = None) -> Note:
    """A note at a position in metres."""
    there = None if points_to is None else (1e3 * points_to[0], 1e3 * points_to[1])
    return Note(at=(1e3 * at[0], 1e3 * at[1]), text=text, points_to=there)


def _turned(radius: float, angle: float) -> tuple[float, float]:
    """The point at an angle from the x axis."""
    return radius * math.cos(angle), radius * math.sin(angle)


def _made(name: str, title: str, lines: list[Line], notes: list[Note], text: str) -> Made:
    panel = Panel(x_label="", y_label="", lines=lines, notes=notes, axes=False, equal=True)
    figure = Figure(name=name, title=title, panels=[panel])
    return Made(text=text, figure=figure)


def _side(seen: Drawn) -> list[Line]:
    """The spool and its thread in the plane of X and Z, with nodes as marks."""
    wound = _arc(1.0, 0.5 * math.pi, 0.5 * math.pi + seen.segment / R * SHOWN)
    thread = seen.nodes[: seen.out + SHOWN - 1]
    last = seen.out - 1
    free = np.vstack([seen.nodes[: seen.out], [0.0, 0.0, R]])
    return [
        _line(_arc(R), color=GREY, width=1.2),
        _line(R * wound, color=1, width=2.2),
        _line(free[:, [0, 2]].T, color=1, width=2.2),
        _line(thread[:last, [0, 2]].T, color=2, style="", marker="o"),
        _line(thread[last : seen.out, [0, 2]].T, color=0, style="", marker="D"),
        _line(thread[seen.out :, [0, 2]].T, color=3, style="", marker="s"),
    ]


def _tangent(angle: float, scale: float = 1.0) -> tuple[float, float]:
    """The point on the spool at an angle before the departure point (below zero: wound)."""
    return scale * R * math.sin(angle), scale * R * math.cos(angle)


def figure_2_1(options: Options) -> Made:
    """The spool, its thread with both ends, and the frame."""
    seen = drawn()
    far, high, end = seen.nodes[0, 0] + 0.012, 2.6 * R, -math.radians(125.0)
    wound = _arc(1.0, 0.5 * math.pi, 0.5 * math.pi - end)
    tip = (seen.nodes[0, 0], R)
    weight = np.array([[0.0, 2.0, 2.0, 0.0, 0.0], [-1.0, -1.0, 1.0, 1.0, -1.0]]) * 1.5e-3
    lines = [
        _line(_arc(R), color=GREY, width=1.2),
        _line(R * wound, color=1, width=2.2),
        _between((0.0, R), tip, color=1, width=2.2),
        _line(weight + np.array([[tip[0]], [tip[1]]]), color=2, width=1.6),
        _between(_tangent(end), _tangent(end), color=3, style="", marker="o"),
        _between((0.0, R), (0.0, R), color=0, style="", marker="s"),
        *_arrow((-1.7 * R, 0.0), (far, 0.0)),
        *_arrow((0.0, -1.7 * R), (0.0, high)),
        _line(_arc(0.55 * R, 0.1 * math.pi, 0.45 * math.pi), color=GREY, width=0.9),
        *_arrow(_tangent(0.35 * math.pi, 0.55), _tangent(0.4 * math.pi, 0.55), color=GREY),
    ]
    notes = [
        _note((far + 0.002, 0.0), "$X$"),
        _note((0.0, high + 0.002), "$Z$"),
        _note((-1.2 * R, 2.1 * R), "$Q$ (ours)", (0.0, R)),
        _note((-2.4 * R, -1.7 * R), "point where the thread is\nfixed to the spool", _tangent(end)),
        _note((-2.4 * R, 0.9 * R), "thread on the spool", _tangent(-0.3 * math.pi)),
        _note((1.9 * R, -1.3 * R), "spool", _tangent(0.7 * math.pi)),
        _note((tip[0], 2.2 * R), "weight at the end\nof the thread", (tip[0] + 1.5e-3, R + 1.5e-3)),
        _note((0.55 * tip[0], -2.0 * R), "ours: lengths, where the thread is fixed"),
        _note((0.25 * R, 0.3 * R), r"$\varphi(t)$"),
    ]
    head = ["part", "x / r", "z / r"]
    parts = {"departure point Q": (0.0, R), "attachment": _tangent(end), "weight": tip}
    rows = [[name, f"{x / R:.3f}", f"{z / R:.3f}"] for name, (x, z) in parts.items()]
    text = f"Frame of the spool; Y is its axis. Where the thread is attached is our choice.\n\n{markdown(head, rows)}"
    title = "Scheme of the unwinding of the thread from the spool (Tenenbaum 2014, figure II.1)"
    return _made("thread-figure-2-1", title, lines, notes, text)


def figure_3_1(options: Options) -> Made:
    """Nodes on the spool and off it, with their numbers and the angular pitch."""
    seen = drawn()
    first = seen.out + 2
    lines = [
        *_side(seen),
        *_arrow((0.0, 0.0), (seen.nodes[0, 0] + 0.008, 0.0)),
        *_arrow((0.0, 0.0), (0.0, 2.1 * R)),
        *(_between((0.0, 0.0), _tangent(seen.wound[k]), color=GREY, width=0.9) for k in (first, first + 1)),
        _line(_arc(0.55 * R, *(0.5 * math.pi - seen.wound[first + np.arange(2)])), color=GREY, width=0.9),
    ]
    middle = 0.5 * float(seen.wound[first] + seen.wound[first + 1])
    notes = [_note((seen.nodes[k, 0], R + 0.0022), str(k + 1)) for k in range(seen.out)]
    notes += [_note(_tangent(seen.wound[k], 1.22), str(k + 1)) for k in range(seen.out, seen.out + SHOWN - 1)]
    notes += [
        _note((0.6 * R, 1.8 * R), "$Q$", (0.0, R)),
        _note((0.9 * seen.nodes[0, 0], 0.4 * R), "free nodes", (seen.nodes[2, 0], R)),
        _note((2.2 * R, 0.4 * R), "boundary node", (seen.nodes[seen.out - 1, 0], R)),
        _note((2.6 * R, -0.9 * R), "nodes on the spool (wound)", _tangent(seen.wound[seen.out + 6], 0.98)),
        _note((2.6 * R, -1.5 * R), "ours: number of nodes, $Q$"),
        _note((-0.3 * R, -0.45 * R), r"$\Delta\varphi$", _tangent(middle, 0.55)),
        _note((seen.nodes[0, 0] + 0.0095, 0.0), "$X$"),
        _note((0.0, 2.25 * R), "$Z$"),
    ]
    rows = [
        [str(k + 1), _state(k, seen.out), f"{seen.wound[k]:.3f}",
         f"{1e3 * seen.nodes[k, 0]:.3f}", f"{1e3 * seen.nodes[k, 2]:.3f}"]
        for k in range(seen.out + SHOWN - 1)
    ]  # fmt: skip
    head = ["node", "state", "phi_i = phi - dphi (i - 1), rad", "x, mm", "z, mm"]
    note = f"Frame of the spool; the spool has turned by phi = {seen.phi:.3g} rad, dphi = {seen.segment / R:g} rad.\n"
    title = "Scheme of the mathematical model (Tenenbaum 2014, figure III.1)"
    text = f"{note}\n{markdown(head, rows)}"
    return _made("thread-figure-3-1", title, lines, notes, text)


def _state(node: int, out: int) -> str:
    """Group of a node by section III of the paper."""
    if node >= out:
        return "on the spool"
    return "boundary" if node == out - 1 else "free"


def figure_3_2(options: Options) -> Made:
    """The boundary node, its neighbour on the spool off the true thread, and the departure point in its place."""
    seen = drawn(*BOUNDARY)
    rest = R * seen.wound[0]
    node, inwards = seen.nodes[:2]
    straight = 0.5 * (node + inwards)
    lines = [
        _line(_arc(R, 0.1 * math.pi, 0.9 * math.pi), color=GREY, width=1.2),
        _line(R * _arc(1.0, 0.5 * math.pi, 0.9 * math.pi), color=1, width=2.2),
        _between((0.0, R), (node[0], node[2]), color=1, width=2.2),
        _line(np.array([[node[0]], [node[2]]]), color=0, style="", marker="D"),
        _line(np.array([[inwards[0]], [inwards[2]]]), color=3, style="", marker="s"),
        _between((0.0, R), (0.0, R), color=2, style="", marker="o"),
        _between((node[0], node[2]), (inwards[0], inwards[2]), color=3, style="--", width=1.2),
        _between((0.0, R + 0.0012), (node[0], R + 0.0012), color=GREY, width=0.9, marker="|"),
    ]
    notes = [
        _note((0.5 * node[0], R + 0.0021), f"$l_{{00}}$ = {1e3 * rest:.2f} mm"),
        _note((node[0] + 0.0032, R - 0.0012), "boundary node\n$i$ = 1", (node[0], node[2])),
        _note((0.0045, R - 0.0052), "link of eqs. (3, 4),\nnot along the thread", (straight[0], straight[2])),
        _note((inwards[0] - 0.0035, inwards[2] + 0.0022), "next node $i$ = 2,\non the spool", (inwards[0], inwards[2])),
        _note((-0.0008, R - 0.0042), "$Q$, $V_Q$ = ($r\\dot{\\varphi}$, 0, 0)", (0.0, R)),
        _note((0.0, 0.0028), "ours: lengths"),
    ]
    distance = float(np.linalg.norm(node - np.array([0.0, 0.0, R])))
    off = _to_the_axis(node[[0, 2]], inwards[[0, 2]])
    head = ["quantity", "value"]
    rows = [
        ["rest length l00 = r (phi - dphi (i - 1)), mm", f"{1e3 * rest:.4f}"],
        ["distance from Q in the run, mm", f"{1e3 * distance:.4f}"],
        ["least distance of the link of eqs. (3, 4) from the spool's axis over r", f"{off / R:.3f}"],
    ]
    title = "Scheme for the derivation of the equations of motion of boundary nodes (Tenenbaum 2014, figure III.2)"
    return _made("thread-figure-3-2", title, lines, notes, markdown(head, rows))


def _to_the_axis(a: Array, b: Array) -> float:
    """Least distance of the line from a to b from the origin."""
    along = b - a
    return float(np.linalg.norm(a + np.clip(-(a @ along) / (along @ along), 0.0, 1.0) * along))


def figure_4_1(options: Options) -> Made:
    """The spacecraft from above: two blades, their lag, and the rate of the body."""
    seen = drawn()
    blade = np.vstack([seen.nodes[: seen.out], [0.0, 0.0, R]])[:, :2].T + np.array([[L0], [0.0]])
    lag, reach = seen.lag, blade[0, 0]
    steady = math.asin(2.0 * R * SPOOL / (L0 * 6.0))
    lines = [
        _line(_arc(0.7 * L0), color=GREY, width=1.2),
        *_arrow((-1.1 * reach, 0.0), (1.25 * reach, 0.0)),
        *_arrow((0.0, -0.9 * L0), (0.0, 1.1 * L0)),
        *_arrow((0.0, 0.0), _turned(1.15 * L0, -TURN), color=GREY),
        *_arrow((0.0, 0.0), _turned(1.1 * L0, 0.5 * math.pi - TURN), color=GREY),
        _line(blade, color=1, width=2.0, marker="o"),
        _line(-blade, color=1, width=2.0, marker="o"),
        _line(_arc(0.5 * L0, -TURN, 0.45 * math.pi), color=2, width=1.6),
        *_arrow(_turned(0.5 * L0, 0.44 * math.pi), _turned(0.5 * L0, 0.46 * math.pi), color=2, width=1.6),
        _line(_arc(0.6 * (reach - L0), -lag, 0.0, (L0, 0.0)), color=2, width=1.6),
        _between((0.0, -1.05 * L0), (L0, -1.05 * L0), color=GREY, width=0.9, marker="|"),
    ]
    for side in (1.0, -1.0):
        box = np.array([[-R, R, R, -R, -R], [-0.7 * R, -0.7 * R, 0.7 * R, 0.7 * R, -0.7 * R]])
        lines.append(_line(box + np.array([[side * L0], [0.0]]), color=GREY, width=1.2))
    middle = (L0 + 0.6 * (reach - L0) * math.cos(0.5 * lag), -0.6 * (reach - L0) * math.sin(0.5 * lag))
    notes = [
        _note((1.3 * reach, 0.0), "$X_1$"),
        _note((0.0, 1.2 * L0), "$Y_1$"),
        _note(_turned(1.25 * L0, -TURN), "$X$"),
        _note(_turned(1.2 * L0, 0.5 * math.pi - TURN), "$Y$"),
        _note((0.33 * L0, 0.13 * L0), r"$\Omega_{KA}$"),
        _note((0.5 * L0, -0.95 * L0), "$L_0$"),
        _note((1.05 * reach, 0.7 * L0), r"$\Delta_1$", middle),
        _note((-0.3 * L0, -0.35 * L0), "$J_{KA}$"),
        _note((1.15 * L0, 0.9 * L0), "spool", (L0, 0.7 * R)),
        _note((1.25 * reach, -0.45 * L0), "$i$ = 1, $m_K$", (float(blade[0, 0]), float(blade[1, 0]))),
        _note((-0.75 * reach, -0.8 * L0), "ours: lengths, shape of the\nbody, eight nodes out"),
    ]
    head = ["quantity", "value"]
    rows = [
        ["lag of the tip in the run, deg", f"{math.degrees(lag):.2f}"],
        ["steady lag asin(2 r omega / (L_0 Omega_0)), deg", f"{math.degrees(steady):.2f}"],
    ]
    title = "Scheme of the model of deployment of a rotary solar sail with two blades (Tenenbaum 2014, figure IV.1)"
    return _made("thread-figure-4-1", title, lines, notes, markdown(head, rows))
