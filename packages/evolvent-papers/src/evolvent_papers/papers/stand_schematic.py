"""Figure 1 of Belyakov (2002): the stand, drawn from the geometry of the built-in case."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent import cases
from evolvent_base.figures import Figure, Line, Note, Panel
from evolvent_massprops.inertia import NormalModes, Stand
from evolvent_massprops.inertia_stand.structure import setup_of
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.winding import markdown

#: Offset of the centre of mass in the drawing, m: the middle of the paper's box.
OFFSET = {"body.offset_x": 0.4, "body.offset_z": 0.17392}
#: The body: its diameter, m, and how far it reaches beyond the springs along x.
DIAMETER, BEYOND = 1.74, 0.5
#: The springs are drawn so many times as long, and so wide, m.
LONGER, WIDTH = 1.6, 0.1
COILS = 5


class _View(NamedTuple):
    """A view: the axes that are drawn to the right and up, with their names and signs."""

    right: int
    up: int

    def of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, dtype=float)
        return points[..., self.right], points[..., self.up]

    def line(self, points: np.ndarray, **look: object) -> Line:
        x, y = self.of(points)
        return Line(x=x, y=y, **look)  # type: ignore[arg-type]


def figure_1(options: Options) -> Made:
    """The stand in two elevations and in plan, with the axes of rotation of its modes."""
    case = cases.load("inertia-stand", dict(OFFSET))
    setup = setup_of(case)
    centre = np.array(case.body.centre)
    side, end, plan = (
        _elevation(setup.stand, centre, _View(0, 1), "Side view"),
        _elevation(setup.stand, centre, _View(2, 1), "End view"),
        _plan(setup.stand, centre, setup.modes, setup.excited.spring),
    )
    title = (
        "Figure 1 of Belyakov (2002): scheme of the measuring stand, drawn from the text. Ours: spacing along Z, "
        "numbers of the springs, place of the centre of mass, axes of rotation of the modes"
    )
    figure = Figure(name="stand-figure-1", title=title, panels=[side, end, plan], columns=2)
    stand, body = case.stand, case.body
    rows = [
        ["mass M", f"{body.mass:g} kg"],
        ["moments Ixx, Iyy, Izz", ", ".join(f"{v:g}" for v in body.inertia) + " kg m2"],
        ["springs at X, Z", f"+-{stand.half_length:g} m, +-{stand.half_width:g} m (along Z: ours)"],
        ["stiffness C of each", f"{stand.stiffness:g} N/m"],
        ["natural length", f"{stand.natural_length:g} m"],
        ["load at spring 1", f"{-case.excitation.force[1]:g} N down, released suddenly"],
        ["centre of mass at X, Z", f"{OFFSET['body.offset_x']:g} m, {OFFSET['body.offset_z']:g} m (ours)"],
    ]
    return Made(text=f"Drawn from the case `inertia-stand`.\n\n{markdown(('quantity', 'value'), rows)}", figure=figure)


def _coil(low: np.ndarray, high: np.ndarray, across: np.ndarray) -> np.ndarray:
    """(n, 3) points of a spring between two ends as a zigzag."""
    share = np.concatenate([[0.0, 0.15], np.linspace(0.15, 0.85, 2 * COILS + 1)[1:-1], [0.85, 1.0]])
    swing = np.where(np.arange(len(share)) % 2 == 0, 1.0, -1.0) * WIDTH
    swing[[0, 1, -2, -1]] = 0.0
    return low + share[:, None] * (high - low) + swing[:, None] * across


def _elevation(stand: Stand, centre: np.ndarray, view: _View, title: str) -> Panel:
    """A view along a horizontal axis."""
    across = np.eye(3)[view.right]
    radius = 0.5 * DIAMETER
    lines, points = [], stand.points
    reach = np.abs(points[:, view.right]).max()
    if view.right == 0:
        wide = reach + BEYOND
        outline = np.array([[-wide, -radius, 0], [wide, -radius, 0], [wide, radius, 0], [-wide, radius, 0]])
        outline = np.vstack([outline, outline[:1]])
    else:
        turn = np.linspace(0.0, 2.0 * np.pi, 121)
        outline = radius * np.stack([0.0 * turn, np.sin(turn), np.cos(turn)], axis=1)
    lines.append(view.line(outline, color=0, width=1.8))
    up = np.array([0.0, 1.0, 0.0])
    for point in np.unique(np.where(np.arange(3) == view.right, points, 0.0), axis=0):
        high = point + LONGER * up
        lines.append(view.line(_coil(point, high, across), color=1, width=1.2))
        ceiling = np.array([high - 0.3 * across, high + 0.3 * across])
        lines.append(view.line(ceiling, color=0, width=2.4))
        for k in range(5):
            foot = high + (-0.3 + 0.13 * k) * across
            lines.append(view.line(np.array([foot, foot + 0.08 * across + 0.12 * up]), color=0, width=0.8))
        lines.append(view.line(point[None], style="", marker="o", color=1))
    plane = np.array([-1.15 * reach * across, 1.15 * reach * across])
    lines.append(view.line(plane, color="gray", style=":", width=1.0))
    lines += [view.line(np.zeros((1, 3)), style="", marker="s", color=0)]
    lines += [view.line(centre[None], style="", marker="o", color=2)]
    letter, spacing = ("X", f"{2.0 * reach:g} m") if view.right == 0 else ("Z", f"{2.0 * reach:g} m (ours)")
    shift = float(view.of(centre)[0])
    beside = (-0.55, shift + 0.4, -0.55 * radius) if view.right == 0 else (-0.33, 0.38, -0.42 * radius)
    lines += _arrow(np.zeros(2), np.array([0.0, 0.62 * radius + 0.5]))
    lines += _arrow(np.array([0.0, -radius - 0.35]), np.array([0.62, -radius - 0.35]))
    notes = [
        Note(at=(0.0, 0.62 * radius + 0.62), text="$Y$"),
        Note(at=(0.74, -radius - 0.35), text=f"${letter}$"),
        Note(at=(0.0, LONGER + 0.42), text=spacing),
        Note(at=(beside[0], beside[2]), text="stiffness\ncentre", points_to=(0.0, 0.0)),
        Note(at=(beside[1], beside[2]), text="centre\nof mass", points_to=(shift, 0.0)),
        Note(at=(-reach - 0.3, 0.7 * LONGER), text="$C$"),
        Note(at=(reach, -0.745) if view.right == 0 else (reach + 0.37, -0.5), text="1000 kgf"),
    ]
    ends = np.array([[-reach, LONGER + 0.24], [reach, LONGER + 0.24]])
    lines += _arrow(ends[0], ends[1]) + _arrow(ends[1], ends[0])
    lines += _arrow(np.array([reach, 0.0]), np.array([reach, -0.62]), color=2)
    return Panel(x_label="", y_label="", lines=lines, title=title, equal=True, axes=False, notes=notes)


def _arrow(start: np.ndarray, end: np.ndarray, color: int | str = 0) -> list[Line]:
    """A line with a head."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]])
    head = np.array([end - 0.12 * along + 0.05 * across, end, end - 0.12 * along - 0.05 * across])
    shaft = np.array([start, end])
    return [Line(x=part[:, 0], y=part[:, 1], color=color, width=1.2) for part in (shaft, head)]


def _plan(stand: Stand, centre: np.ndarray, modes: NormalModes, loaded: int) -> Panel:
    """The view from above, z down, with the axes of rotation."""
    radius = 0.5 * DIAMETER
    reach = np.abs(stand.points[:, 0]).max()
    wide = reach + BEYOND
    outline = np.array([[-wide, -radius], [wide, -radius], [wide, radius], [-wide, radius], [-wide, -radius]])
    lines = [Line(x=outline[:, 0], y=outline[:, 1], color=0, width=1.8)]
    notes = []
    points, directions = modes.axes()
    for k, kind in enumerate(modes.kinds):
        if kind not in ("heave", "roll", "pitch"):
            continue
        at, along = points[k][[0, 2]] * [1, -1], directions[k][[0, 2]] * [1, -1]
        ends = _clipped(at, along, (1.15 * wide, 2.1 * radius))
        color = 1 + ("heave", "pitch", "roll").index(kind)
        lines.append(Line(x=ends[:, 0], y=ends[:, 1], color=color, style="--", width=1.2, label=f"axis of {kind}"))
    for k, point in enumerate(stand.points):
        place = (float(point[0]), -float(point[2]))
        marker, color = ("X", 2) if k + 1 == loaded else ("o", 1)
        lines.append(Line(x=np.array([place[0]]), y=np.array([place[1]]), style="", marker=marker, color=color))
        text = f"{k + 1}, loaded" if k + 1 == loaded else f"{k + 1}"
        notes.append(Note(at=(place[0] + 0.0, place[1] + 0.22 * np.sign(place[1])), text=text))
    lines.append(Line(x=np.zeros(1), y=np.zeros(1), style="", marker="s", color=0))
    lines.append(Line(x=centre[:1], y=-centre[2:], style="", marker="o", color=2))
    origin = np.array([-wide, -2.0 * radius])
    lines += _arrow(origin, origin + np.array([0.6, 0.0])) + _arrow(origin, origin - np.array([0.0, 0.6]))
    notes += [
        Note(at=(origin[0] + 0.75, origin[1]), text="$X$"),
        Note(at=(origin[0] + 0.16, origin[1] - 0.6), text="$Z$"),
    ]
    return Panel(x_label="", y_label="", lines=lines, title="Plan", equal=True, axes=False, notes=notes)


def _clipped(at: np.ndarray, along: np.ndarray, half: tuple[float, float]) -> np.ndarray:
    """(2, 2) ends of a line in a rectangle about the origin."""
    with np.errstate(divide="ignore"):
        near = np.sort(np.stack([(-np.array(half) - at) / along, (np.array(half) - at) / along]), axis=0)
    return np.array([at + near[0].max() * along, at + near[1].min() * along])
