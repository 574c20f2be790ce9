"""Schematics of the model of Yi, Yuan, Dong & Li (2017), figures 1 to 5, drawn from their captions and our model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.elements import axis_shape, nodal
from evolvent_base.figures import Figure, Line, Note, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.rib_captions import title
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
#: Directions of x, y and z on the sheet, of bodies in space.
SPACE = np.array([[0.9, -0.22], [0.42, 0.48], [0.0, 1.0]])
#: Hub's radius and height, rib's length and width, m; elements of the paper.
R, HEIGHT, LENGTH, WIDTH, ELEMENTS = 0.6, 3.0, 12.0, 0.03, 10
#: Thickness of the rib, m; ribs that are drawn on the folded antenna, and the distance of their turns there, m.
THICKNESS, RIBS, APART = 0.0003, 6, 0.14
#: From the middle of the free part to the text, for each stage of the winding, m.
STAGE_NOTES = ((0.3, -0.14), (0.55, 0.75), (-0.9, 0.3), (-0.25, -0.28))
SECOND_AXIS = np.array([0.0, 0.0, 1.0])


def _moved(at: Array, *by: float) -> Array:
    """A point that is moved."""
    return np.asarray(at) + np.array(by)


def _line(points: Any, **how: Any) -> Line:
    """A polyline of points on the sheet (n, 2), or in space (n, 3)."""
    at = np.asarray(points, dtype=float)
    at = at @ SPACE if at.shape[1] == 3 else at
    return Line(x=at[:, 0], y=at[:, 1], **how)


def _arrow(start: Any, end: Any, *, head: float = 0.12, **how: Any) -> Line:
    """An arrow on the sheet, or in space; `head` is the length of its head over its own."""
    a, b = (np.asarray(at, dtype=float) for at in (start, end))
    if a.size == 3:
        a, b = a @ SPACE, b @ SPACE
    along = head * (b - a)
    across = 0.4 * np.array([-along[1], along[0]])
    return _line([a, b, b - along + across, b, b - along - across], **how)


def _circle(centre: Any, radius: float, first: float = 0.0, last: float = 2.0 * math.pi, **how: Any) -> Line:
    angle = np.linspace(first, last, 181)
    return _line(np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), **how)


def _note(at: Any, text: str) -> Note:
    at = np.asarray(at, dtype=float)
    at = at @ SPACE if at.size == 3 else at
    return Note(at=(float(at[0]), float(at[1])), text=text)


def _made(number: int, lines: list[Line], notes: list[Note], rows: list[list[str]], *, ours: str = "") -> Made:
    panel = Panel(x_label="", y_label="", lines=lines, notes=notes, axes=False, equal=True)
    text = title(number, ours)
    figure = Figure(name=f"rib-figure-{number}", title=text, panels=[panel])
    note = "Schematic, drawn by us from the caption and the text; the paper's own drawing is not reproduced."
    return Made(text=f"{text}\n\n{note}\n\n{markdown(('quantity', 'value'), rows)}", figure=figure)


def _axis(nodes: Array, length: float, xi: Array) -> Array:
    """Points (k, 3) of an element's axis; `nodes` (2, vectors, 3)."""
    ends = np.stack([nodes[0, 0], nodes[0, 1], nodes[1, 0], nodes[1, 1]])
    found: Array = np.einsum("jk,ji->ki", np.array(axis_shape(length, xi)), ends)
    return found


def _spiral(first: float, turns: float, apart: float) -> Array:
    """Points of a rib wound from the angle `first`, its turns `apart` from one another, (k, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, 241)
    radius = R + apart * angle / (2.0 * np.pi)
    return radius[:, None] * np.stack([np.cos(first + angle), np.sin(first + angle)], axis=1)


def figure_1(options: Options) -> Made:
    """The antenna folded in orbit: ribs wound on the hub, along its axis."""
    lines = [_circle((0.0, 0.0), R, color="gray", width=1.6, fill="lightgray")]
    turns = LENGTH / (2.0 * np.pi * R)
    for k in range(RIBS):
        root = 2.0 * np.pi * k / RIBS
        lines.append(_line(_spiral(root, turns, APART), color=k, width=1.0))
        lines.append(_line([[R * math.cos(root), R * math.sin(root)]], color=k, style="", marker="o"))
    edge = R + APART * turns
    notes = [
        _note((0.0, 0.08), "rigid hub"),
        _note((0.0, -0.08), f"radius {R:g} m"),
        Note(at=(0.95, 0.92), text="flexible ribs, wound turn after turn", points_to=(edge * 0.72, edge * 0.68)),
        Note(
            at=(-1.05, -0.92),
            text="hinge of a rib",
            points_to=(R * math.cos(4.0 * np.pi / 3.0), R * math.sin(4.0 * np.pi / 3.0)),
        ),
    ]
    rows = [["ribs drawn", f"{RIBS} (the paper's number is not known)"],
            ["turns of a rib of 12 m on the hub", f"{turns:.2f}"],
            ["thickness of the wound layers, so many ribs", f"{1e3 * RIBS * turns * THICKNESS:.2g} mm"]]  # fmt: skip
    return _made(1, lines, notes, rows, ours=f"{RIBS} ribs; distance of the turns not to scale")


def figure_2(options: Options) -> Made:
    """The winding: the rib straight, partly wound and wound, along the hub's axis."""
    shown = 0.3 * LENGTH
    lines = [_circle((0.0, 0.0), R, color="gray", width=1.6, fill="lightgray")]
    lines.append(_line([[R, 0.0]], color="black", style="", marker="o"))
    notes = [_note((0.0, 0.0), "hub"), Note(at=(0.95, -0.55), text="hinge", points_to=(R + 0.02, -0.03))]
    stages = ((0.0, "1: start, straight"), (0.25, "2: swings to the tangent"), (0.8, "3: winds, free part straight"),
              (1.7, "4: turn after turn"))  # fmt: skip
    for k, (wound, text) in enumerate(stages):
        lying = max(wound - 0.25, 0.0) * np.pi
        angle = np.linspace(0.0, lying, 81)
        path = (R + 0.012 * k) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        # off the hub along the tangent; before it lies on the hub it points outwards, then to the tangent
        direction = lying + min(wound / 0.25, 1.0) * 0.5 * np.pi
        tip = path[-1] + (shown - R * lying) * np.array([math.cos(direction), math.sin(direction)])
        lines.append(_line(np.vstack([path, tip]), color=k, width=1.8))
        notes.append(_note(0.45 * path[-1] + 0.55 * tip + STAGE_NOTES[k], text))
    turn = np.linspace(0.15, 1.1, 41)
    sweep = 1.9 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    lines += [_line(sweep, color="gray", width=1.0), _arrow(sweep[-4], sweep[-1], head=1.2, color="gray")]
    notes.append(_note((2.0, 1.5), "torque about\nthe hub's axis"))
    rows = [["drawn of the rib", f"{shown:g} m of its {LENGTH:g} m"],
            ["the rib rotates about the hub", f"{LENGTH / R:g} rad in all"],
            ["strain of its surface on the hub, t/2R", f"{50.0 * THICKNESS / R:.3g} %"]]  # fmt: skip
    return _made(2, lines, notes, rows)


def figure_3(options: Options) -> Made:
    """An element: nodes, positions, slopes, and its section."""
    length, half = 1.0, (0.1, 0.16)
    nodes = nodal(
        np.array([[0.0, 0.0, 0.0], [0.88, 0.3, 0.12]]), np.array([[1.0, -0.15, 0.25], [0.75, 0.75, 0.0]]), SECOND_AXIS,
        vectors=4,
    )  # fmt: skip
    xi = np.linspace(0.0, 1.0, 41)
    axis = _axis(nodes, length, xi)
    y, z = ((1.0 - xi)[:, None] * nodes[0, k] + xi[:, None] * nodes[1, k] for k in (2, 3))
    corners = [(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
    lines = [_line(axis + a * half[0] * y + b * half[1] * z, color="gray", width=0.8) for a, b in corners[:4]]
    for k in (0, 10, 20, 30, 40):
        section = [axis[k] + a * half[0] * y[k] + b * half[1] * z[k] for a, b in corners]
        lines.append(_line(section, color="gray", width=1.4 if k in (0, 40) else 0.6))
    lines.append(_line(axis, color=0, width=2.0))
    origin = np.array([-0.45, -0.35, -0.2])
    notes = [_note(_moved(origin, 0.0, 0.0, -0.05), "$O$")]
    for unit, text in zip(np.eye(3), "XYZ", strict=True):
        lines.append(_arrow(origin, origin + 0.25 * unit, color="gray"))
        notes.append(_note(origin + 0.3 * unit, f"${text}$"))
    for node, name in zip(nodes, "pq", strict=True):
        lines.append(_arrow(origin, node[0], head=0.05, color=2, width=1.2))
        lines.append(_line(node[:1], color=0, style="", marker="o"))
        notes.append(_note(_moved(0.45 * origin + 0.55 * node[0], 0.0, 0.0, -0.06), rf"$\mathbf{{R}}_{{{name}}}$"))
        notes.append(_note(_moved(node[0], 0.0, 0.0, -0.09), f"${name}$"))
        for k, text in enumerate(("x", "y", "z"), start=1):
            tip = node[0] + 0.36 * node[k] / np.linalg.norm(node[k])
            lines.append(_arrow(node[0], tip, color=1, width=1.8))
            notes.append(_note(tip + 0.06 * node[k] / np.linalg.norm(node[k]), rf"$\mathbf{{R}}_{{{name},{text}}}$"))
    rows = [["coordinates of a node", "12: those of R and of its slopes R,x R,y R,z in O-XYZ"],
            ["coordinates of an element", "24"], ["position of a point", "r = S(x, y, z) e"]]  # fmt: skip
    return _made(3, lines, notes, rows)


def straddling_distances(length: float) -> tuple[float, float]:
    """Distances from the axis of the ends and of the middle of a straight element that touches the hub there, m."""
    return math.hypot(R, 0.5 * length), R


def figure_4(options: Options) -> Made:
    """Detection of contact: positions in global axes, points inside an element, penetration and normal."""
    length, sunk = LENGTH / ELEMENTS, 0.07
    origin, hub = np.array([-1.15, -0.45]), np.array([0.0, 0.0])
    at = np.array([[-0.5 * length, R - sunk], [0.5 * length, R - sunk]])
    points = at[0] + np.arange(1, 5)[:, None] / 4.0 * (at[1] - at[0])
    inside = np.hypot(points[:, 0], points[:, 1]) < R
    lines = [_circle(hub, R, color="gray", width=1.6)]
    lines += [_line(at, color=0, width=2.2), _line(at, color=0, style="", marker="s")]
    lines += [_line(points[keep], color=k, style="", marker="o") for keep, k in ((~inside, 2), (inside, 1))]
    touched = points[1]
    lines += [_arrow(origin, origin + 0.28 * np.eye(2)[k], color="gray") for k in (0, 1)]
    vectors = ((origin, touched), (origin, hub), (hub, touched))
    lines += [_arrow(a, b, head=0.05, color=3 + k, width=1.3) for k, (a, b) in enumerate(vectors)]
    lines.append(_arrow(touched, _moved(touched, 0.0, 0.36), color=1, width=1.8))
    radius = R * np.array([math.cos(-0.6), math.sin(-0.6)])
    lines.append(_line([hub, radius], color="gray", style="--", width=1.0))
    notes = [
        _note(_moved(origin, -0.07, -0.07), "$O$"),
        _note(_moved(origin, 0.34, 0.0), "$X$"),
        _note(_moved(origin, 0.0, 0.34), "$Y$"),
        _note((0.07, -0.07), "$O'$"),
        _note((-0.68, 0.16), "$\\mathbf{R}_O$"),
        _note((-0.62, -0.33), "$\\mathbf{R}_{OO'}$"),
        _note((0.12, 0.25), "$\\mathbf{R}_{O'}$"),
        _note((0.08, R + 0.26), "$\\mathbf{N}$"),
        _note(_moved(0.6 * radius, 0.08, 0.06), "$R_h$"),
        Note(at=(-0.62, 0.95), text="nodes: coarse test", points_to=(at[0, 0], at[0, 1] + 0.03)),
        Note(
            at=(0.78, 0.88), text="detection points\ninside the element", points_to=(points[2, 0], points[2, 1] + 0.03)
        ),
        Note(
            at=(0.85, 0.28), text="touches: $\\delta = R_h - |\\mathbf{R}_{O'}| > 0$", points_to=(0.03, R - sunk - 0.02)
        ),
        _note((-0.25, -0.38), "hub"),
    ]
    reach, _ = straddling_distances(length)
    S = np.array(axis_shape(length, np.array([0.5])))[:, 0]
    rows = [["element", f"{length:g} m, straight; hub's radius {R:g} m"],
            ["distance of the nodes from the axis when the middle touches", f"{reach:.3f} m"],
            ["force f on the middle, on the nodes by S^T f", f"{S[0]:g} f, {S[2]:g} f"],
            ["and on the slopes, over the element's length", f"{S[1] / length:g} f, {S[3] / length:g} f"]]  # fmt: skip
    return _made(4, lines, notes, rows)


def figure_5(options: Options) -> Made:
    """The initial state: hub and straight rib with their dimensions, the hinge, the torque."""
    angle = np.linspace(0.0, 2.0 * np.pi, 91)
    ring = np.stack([R * np.cos(angle), R * np.sin(angle), 0.0 * angle], axis=1)
    up = 0.5 * HEIGHT * SECOND_AXIS
    lines = [_line(ring + shift, color="gray", width=1.2) for shift in (up, -up)]
    across = (ring @ SPACE)[:, 0]
    edges = ring[[int(np.argmin(across)), int(np.argmax(across))]]
    lines += [_line([edge - up, edge + up], color="gray", width=1.2) for edge in edges]
    shown, high = 0.5 * LENGTH, 4.0 * WIDTH
    strip = np.array([[R, 0.0, 1.0], [R + shown, 0.0, 1.0], [R + shown, 0.0, -1.0], [R, 0.0, -1.0], [R, 0.0, 1.0]])
    lines += [_line(strip * [1.0, 1.0, high], color=0, width=1.4), _line([[R, 0.0, 0.0]], style="", marker="o")]
    for k in range(ELEMENTS // 2 + 1):
        x = R + k * LENGTH / ELEMENTS
        lines.append(_line([[x, 0.0, -high], [x, 0.0, high]], color=0, width=0.8))
    notes = []
    for unit, text in zip(np.eye(3), "XYZ", strict=True):
        far = 2.0 if text == "Z" else 1.1
        lines.append(_arrow([0.0, 0.0, 0.0], far * unit, head=0.1, color="gray"))
        notes.append(_note(_moved((far + 0.15) * unit, 0.0, 0.0, -0.14 * (text == "X")), f"${text}$"))
    for side in (up, -up):  # clamped at both ends
        for x in np.linspace(-0.8 * R, 0.8 * R, 5):
            foot = np.array([x, 0.0, 0.0]) + side
            lines.append(_line([foot, _moved(foot, -0.1, 0.0, 0.12 * np.sign(side[2]))], color="gray", width=0.8))
    turn = np.linspace(-0.5, 0.6, 41)
    sweep = np.stack([4.4 * np.cos(turn), 4.4 * np.sin(turn), 0.0 * turn], axis=1)
    lines += [_line(sweep, color=1, width=1.0), _arrow(sweep[-4], sweep[-1], head=1.2, color=1)]
    notes += [
        _note(_moved(sweep[-1], -0.2, 0.5, 0.15), "constant torque about $Z$"),
        _note((-1.75, 0.9), "rigid hub\ndiameter 1.2 m\nheight 3 m\n7810 kg/m³\nclamped at\nboth ends"),
        _note((4.7, -1.9), "rib 12 m x 0.03 m x 0.3 mm\n1600 kg/m³, $E$ = 5 MPa, $\\nu$ = 0.3, 10 elements"),
        Note(at=(1.6, -1.15), text="hinge", points_to=(0.57, -0.16)),
    ]
    rows = [["hub", f"diameter {2.0 * R:g} m, height {HEIGHT:g} m, 7810 kg/m3, rigid, clamped at both ends"],
            ["rib", f"{LENGTH:g} m x {WIDTH:g} m x {THICKNESS:g} m, 1600 kg/m3, E = 5 MPa, nu = 0.3"],
            ["drawn of the rib", f"{shown:g} m of its length, eight times its width"],
            ["contact", "K = 1e6, c = 1e3 (units not given)"]]  # fmt: skip
    return _made(5, lines, notes, rows)
