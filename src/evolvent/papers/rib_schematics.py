"""Schematics of the model of Yi, Yuan, Dong & Li (2017), figures 1 to 5, drawn from the geometry of our own model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.elements import axis_shape, coil, nodal
from evolvent.figures import Figure, Line, Note, Panel
from evolvent.papers import Made, Options
from evolvent.papers.winding import markdown

Array = np.ndarray
#: Directions of x, y and z on the sheet, of bodies in space.
SPACE = np.array([[0.9, -0.22], [0.42, 0.48], [0.0, 1.0]])
#: Hub's radius and height, rib's length and width, m; elements of the paper.
R, HEIGHT, LENGTH, WIDTH, ELEMENTS = 0.6, 3.0, 12.0, 0.03, 10
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


def _made(number: int, title: str, lines: list[Line], notes: list[Note], rows: list[list[str]]) -> Made:
    panel = Panel(x_label="", y_label="", lines=lines, notes=notes, axes=False, equal=True)
    text = f"{title} (schematic, figure {number})"
    figure = Figure(name=f"rib-figure-{number}", title=text, panels=[panel])
    return Made(text=f"{text}.\n\n{markdown(('quantity', 'value'), rows)}", figure=figure)


def _axis(nodes: Array, length: float, xi: Array) -> Array:
    """Points (k, 3) of an element's axis; `nodes` (2, vectors, 3)."""
    ends = np.stack([nodes[0, 0], nodes[0, 1], nodes[1, 0], nodes[1, 1]])
    found: Array = np.einsum("jk,ji->ki", np.array(axis_shape(length, xi)), ends)
    return found


def figure_1(options: Options) -> Made:
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
    for unit, text in zip(np.eye(3), "xyz", strict=True):
        lines.append(_arrow(origin, origin + 0.25 * unit, color="gray"))
        notes.append(_note(origin + 0.3 * unit, f"${text}$"))
    for node, name in zip(nodes, "pq", strict=True):
        lines.append(_arrow(origin, node[0], head=0.05, color=2, width=1.2))
        lines.append(_line(node[:1], color=0, style="", marker="o"))
        notes.append(_note(_moved(0.45 * origin + 0.55 * node[0], 0.0, 0.0, -0.06), rf"$\mathbf{{r}}_{{{name}}}$"))
        for k, text in enumerate(("x", "y", "z"), start=1):
            tip = node[0] + 0.36 * node[k] / np.linalg.norm(node[k])
            lines.append(_arrow(node[0], tip, color=1, width=1.8))
            notes.append(_note(tip + 0.06 * node[k] / np.linalg.norm(node[k]), rf"$\mathbf{{r}}_{{{name},{text}}}$"))
    rows = [["coordinates of a node", "12: position r and slopes r,x r,y r,z"], ["coordinates of an element", "24"],
            ["position of a point", "r = S(x, y, z) e"]]  # fmt: skip
    return _made(1, "Fully parametrised element with the vectors of its nodes", lines, notes, rows)


def figure_2(options: Options) -> Made:
    """The hub, the rib at the start and partly wound, and the axes."""
    angle = np.linspace(0.0, 2.0 * np.pi, 91)
    ring = np.stack([R * np.cos(angle), R * np.sin(angle), 0.0 * angle], axis=1)
    up = 0.5 * HEIGHT * SECOND_AXIS
    lines = [_line(ring + shift, color="gray", width=1.2) for shift in (up, -up)]
    across = (ring @ SPACE)[:, 0]
    edges = ring[[int(np.argmin(across)), int(np.argmax(across))]]
    lines += [_line([edge - up, edge + up], color="gray", width=1.2) for edge in edges]
    shown, root = 0.4 * LENGTH, np.array([R, 0.0, 0.0])
    strip = np.array([[R, 0.0, 1.0], [R + shown, 0.0, 1.0], [R + shown, 0.0, -1.0], [R, 0.0, -1.0], [R, 0.0, 1.0]])
    lines.append(_line(strip * [1.0, 1.0, 0.5 * 5.0 * WIDTH], color=0, width=1.4))
    wrap = np.linspace(0.0, 0.6 * np.pi, 41)
    hub = np.stack([R * np.cos(wrap), R * np.sin(wrap), 0.0 * wrap], axis=1)
    tail = hub[-1] + (shown - R * wrap[-1]) * np.array([-math.sin(wrap[-1]), math.cos(wrap[-1]), 0.0])
    lines += [_line(np.vstack([hub, tail]), color=2, width=1.8, style="--"), _line([root], style="", marker="o")]
    notes = [
        _note(_moved(root, 3.6, 0.0, 0.4), "rib at the start"),
        _note(_moved(0.7 * tail + 0.3 * hub[-1], 0.0, 0.0, 0.25), "partly wound"),
    ]
    for unit, text in zip(np.eye(3), "xyz", strict=True):
        lines.append(_arrow([0.0, 0.0, 0.0], (2.1 if text == "z" else 1.1) * unit, head=0.1, color="gray"))
        notes.append(
            _note(_moved((2.25 if text == "z" else 1.25) * unit, 0.0, 0.0, -0.12 * (text == "x")), f"${text}$")
        )
    turn = np.linspace(-0.4, 1.0, 41)
    sweep = np.stack([3.2 * np.cos(turn), 3.2 * np.sin(turn), 0.0 * turn], axis=1)
    lines += [_line(sweep, color=1, width=1.0), _arrow(sweep[-4], sweep[-1], head=1.2, color=1)]
    notes.append(_note(_moved(sweep[-1], 0.2, 0.3, 0.1), "torque $T$ about $z$"))
    notes.append(_note([0.0, 0.0, -1.95], "hub, radius $R$"))
    rows = [["hub, diameter and height", f"{2.0 * R:g} m, {HEIGHT:g} m"],
            ["rib", f"{LENGTH:g} m x {WIDTH:g} m x 0.0003 m, {ELEMENTS} elements"],
            ["drawn of the rib", f"{shown:g} m of its length, 5 times its width"]]  # fmt: skip
    return _made(2, "Hub, rib, inertial axes and drive", lines, notes, rows)


def straddling_distances(length: float) -> tuple[float, float]:
    """Distances from the axis of the ends and of the middle of a straight element that touches the hub there, m."""
    return math.hypot(R, 0.5 * length), R


def figure_3(options: Options) -> Made:
    """Search for contact: an element whose nodes are both outside although its middle touches."""
    length = LENGTH / ELEMENTS
    ends, _ = straddling_distances(length)
    sunk = 0.06
    at = np.array([[-0.5 * length, R - sunk], [0.5 * length, R - sunk]])
    share = np.arange(1, 5) / 4.0
    points = at[0] + share[:, None] * (at[1] - at[0])
    out = np.hypot(points[:, 0], points[:, 1]) - R
    lines = [_circle((0.0, 0.0), R, 0.0, np.pi, color="gray", width=1.4)]
    lines.append(_circle((0.0, 0.0), ends, 0.15 * np.pi, 0.85 * np.pi, color="gray", style="--", width=0.9))
    lines += [_line(at, color=0, width=2.2), _line(at, color=0, style="", marker="s")]
    lines.append(_line(points[out >= 0.0], color=2, style="", marker="o"))
    lines.append(_line(points[out < 0.0], color=1, style="", marker="o"))
    mid = 0.5 * (at[0] + at[1])
    lines.append(_line([[0.0, 0.0], mid], color="gray", style=":", width=1.0))
    notes = [
        Note(at=(-0.62, 0.30), text="nodes: both outside", points_to=(at[0, 0], at[0, 1] - 0.02)),
        Note(at=(0.52, 0.22), text="contact points inside the element", points_to=(points[0, 0], points[0, 1] - 0.02)),
        Note(at=(0.22, 0.36), text="penetrates", points_to=(mid[0] + 0.01, mid[1] - 0.015)),
        _note((0.0, -0.05), "hub's axis"),
        Note(at=(0.0, 0.74), text="least reach of a search by nodes", points_to=(0.0, ends - 0.005)),
    ]
    rows = [["element", f"{length:g} m, straight"], ["hub's radius", f"{R:g} m"],
            ["distance of the nodes when the middle touches", f"{ends:.3f} m"]]  # fmt: skip
    return _made(3, "Search for contact at points inside an element", lines, notes, rows)


def figure_4(options: Options) -> Made:
    """Penetration of a contact point, the normal, and the force on the nodes."""
    length, xi = 0.3, 0.5
    S = np.array(axis_shape(length, np.array([xi])))[:, 0]
    sunk, low, high = 0.02, 0.5 * math.pi - 0.35, 0.5 * math.pi + 0.35
    lines = [_circle((0.0, 0.0), R, low, high, color="gray", width=1.6)]
    point, normal = np.array([0.0, R - sunk]), np.array([0.0, 1.0])
    ends = np.array([[-0.5 * length, R - sunk + 0.004], [0.5 * length, R - sunk + 0.004]])
    nodes = np.stack([np.stack([ends[k], np.array([1.0, -0.055 * (1 - 2 * k)])]) for k in (0, 1)])
    axis = _axis(nodes, length, np.linspace(0.0, 1.0, 41))
    point = _axis(nodes, length, np.array([xi]))[0]
    lines += [_line(axis, color=0, width=2.2), _line(ends, color=0, style="", marker="s")]
    lines.append(_line([point], color=1, style="", marker="o"))
    lines.append(_arrow(point, point + 0.11 * normal, color=1, width=2.0))
    for end, share in zip(ends, (S[0], S[2]), strict=True):
        lines.append(_arrow(end, end + 0.11 * share * normal, color=2, width=2.0))
    lines.append(_line([[0.02, R], [0.06, R]], color="gray", width=0.8))
    lines.append(_line([_moved(point, 0.02, 0.0), _moved(point, 0.06, 0.0)], color="gray", width=0.8))
    lines.append(_arrow([0.05, R + 0.03], [0.05, R], color="gray", head=0.3))
    lines.append(_arrow([0.05, point[1] - 0.03], [0.05, point[1]], color="gray", head=0.3))
    notes = [
        _note((-0.03, point[1] + 0.085), "force $f\\,\\mathbf{n}$"),
        _note((0.05, R + 0.04), "penetration $d = R - |\\mathbf{r}|$"),
        _note((ends[0, 0], ends[0, 1] + 0.075), f"$S_1 f = {S[0]:.2g}\\,f$"),
        _note((ends[1, 0], ends[1, 1] + 0.075), f"$S_5 f = {S[2]:.2g}\\,f$"),
        _note((-0.19, R - 0.06), "hub"),
        Note(
            at=(-0.06, point[1] - 0.04),
            text="contact point $\\mathbf{r} = S\\,\\mathbf{e}$",
            points_to=(point[0], point[1] - 0.003),
        ),
    ]
    rows = [["contact point", f"{xi:g} of an element of {length:g} m"], ["force on the nodes", f"{S[0]:g}, {S[2]:g} f"],
            ["on the slopes, times the element's length", f"{S[1] / length:g}, {S[3] / length:g} f"]]  # fmt: skip
    return _made(4, "Penetration of a contact point and its force on the nodes", lines, notes, rows)


def figure_5(options: Options) -> Made:
    """The hinge of the root: what it holds and what it leaves free."""
    low, high, root = -0.9, 0.9, np.array([R, 0.0])
    lines = [_circle((0.0, 0.0), R, low, high, color="gray", width=1.6)]
    notes = [_note((0.40, 0.0), "hub"), _note((0.50, -0.12), "hinge, axis $z$")]
    for k, angle in enumerate((0.0, 0.25 * math.pi, 0.5 * math.pi)):
        direction = np.array([math.cos(angle), math.sin(angle)])
        lines.append(_line([root, root + 0.75 * direction], color=k, width=2.2))
        notes.append(_note(root + 0.84 * direction, f"{math.degrees(angle):g}°"))
    lines.append(_line([root], color=0, style="", marker="o"))
    lines.append(_circle(root, 0.35, 0.0, 0.5 * math.pi, color="gray", width=1.0))
    turned = root + 0.35 * np.array([math.cos(0.3 * math.pi), math.sin(0.3 * math.pi)])
    notes.append(_note(_moved(turned, 0.12, 0.06), "free angle"))
    lines.append(_arrow(root, _moved(root, 0.3, 0.0), color=1, width=1.8))
    lines.append(_arrow(root, _moved(root, 0.0, 0.3), color=1, width=1.8))
    notes += [_note(_moved(root, 0.22, -0.07), "outwards"), _note(_moved(root, -0.13, 0.27), "tangent")]
    one = coil("cable", 4, 0.3, _section(), _material(), radius=R)
    path = np.vstack([_axis(one[k : k + 2], 0.3, np.linspace(0.0, 1.0, 21)) for k in range(4)])[:, :2]
    lines.append(_line(path, color="gray", style=":", width=1.2))
    notes.append(_note(_moved(path[-1], 0.0, 0.1), "wound"))
    rows = [["held", "position (3 equations), direction across the axis (2)"], ["free", "angle about the hub's axis"],
            ["wound rib leaves the hinge at", "90 deg from outwards"]]  # fmt: skip
    return _made(5, "Hinge of the root, and directions of the rib", lines, notes, rows)


def _section() -> Any:
    from evolvent.elements import Rectangle

    return Rectangle(thickness=0.0003, width=WIDTH)


def _material() -> Any:
    from evolvent.elements import Material

    return Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0)
