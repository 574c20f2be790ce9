"""Figures 6 to 9 of Yi, Yuan, Dong & Li (2017) from one set of runs, and figures on root damping and contact points."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import closed_forms
from evolvent.elements import axis_shape
from evolvent.view.drawing import smooth
from evolvent_base.figures import Figure, Line, Panel, plain
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.rib_captions import title
from evolvent_papers.papers.rib_runs import ALPHAS, RibRun, of_the_paper, runs
from evolvent_papers.papers.winding import markdown
from evolvent_papers.wrapped_rib.show import comparable_string

Array = np.ndarray
#: Time before and after the whip that is drawn in detail, s, and about the paper's root damping.
DETAIL, ROOT_DETAIL = (-0.2, 0.2), (27.9, 28.6)
#: Shapes that are drawn of a run, and its mass damping, 1/s.
SHAPES, SHOWN = 6, 0.2
#: Speed of the tip below which a wound rib is at rest, m/s.
AT_REST = 1e-3
#: Points of an element at which its shape is drawn.
SMOOTH = 12
TIME = "time, s"
#: Runs on the damping of the root: name -> keys beside those of a run without damping.
ROOT: Mapping[str, Mapping[str, Any]] = {
    "no damping": {},
    "$a$ = 0.5 1/s on the first 1.2 m": {"damping__alpha": 0.5, "damping__elements": (1, 2, 3, 4)},
    "hinge damper 0.05 N m s": {"rib__root_damping": 0.05},
    "hinge damper 1 N m s": {"rib__root_damping": 1.0},
}


def _all(options: Options) -> tuple[list[RibRun], bool]:
    """The runs with the paper's three mass dampings, and whether they are complete."""
    return _of(of_the_paper(quick=options.quick), options)


def _of(wanted: Sequence[Mapping[str, Any]], options: Options) -> tuple[list[RibRun], bool]:
    found = list(runs(wanted, options.report))
    return found, len(found) == len(wanted) and found[-1].status != "interrupted"


def _name(run: RibRun) -> str:
    return f"$a$ = {run.case.damping.alpha:g} 1/s"


def _ours(run: RibRun, damping: str = "$a$") -> str:
    """What the paper does not give, or leaves open."""
    return f"torque {run.case.drive.torque:g} N m, {damping} on the whole rib"


def _note(run: RibRun) -> str:
    return f"{run.case.rib.elements} cable elements, torque {run.case.drive.torque:g} N m, energy-momentum.\n"


def _lines(found: list[RibRun], values: Callable[[RibRun], Array]) -> list[Line]:
    """A line of each run over its time."""
    return [Line(x=run.t, y=values(run), label=_name(run), color=k, width=1.2) for k, run in enumerate(found)]


# ------------------------------------------------------------------------------------------------ figures 6 to 9


def figure_6(options: Options) -> Made:
    """Shapes of the rib in time."""
    wanted = [keys for keys in of_the_paper(quick=options.quick) if keys["damping__alpha"] == SHOWN]
    (run, *_), complete = _of(wanted, options)
    kept = np.flatnonzero(run.even & (run.t <= run.t[run.peak]))
    turned = np.maximum.accumulate(np.abs(run.turns[kept]))
    mixed = turned / max(turned[-1], 1e-300) + 0.3 * run.t[kept] / run.t[kept[-1]]
    moments = sorted({int(kept[np.searchsorted(mixed, x)]) for x in np.linspace(mixed[0], mixed[-1], SHAPES)})
    moments.append(run.t.size - 1)  # wound and at rest
    R, length = run.case.hub.radius, run.case.rib.element_length
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    whole = [Line(x=R * np.cos(around), y=R * np.sin(around), color="gray", width=1.0)]
    paths = smooth(run.x[moments, :, 0], run.x[moments, :, 1], length, SMOOTH)
    for k, path in enumerate(paths):
        label, color = f"{run.t[moments[k]]:.4g} s", k / len(moments)
        label += ", at rest" * bool(k and run.speed[moments[k]] < AT_REST)
        whole.append(Line(x=path[:, 0], y=path[:, 1], label=label, color=color, width=1.3))
    near = [_inside(line, 2.0 * R) for line in whole]
    panels = [
        Panel(x_label="x, m", y_label="y, m", lines=lines, title=text, equal=True)
        for lines, text in ((whole, "along the hub's axis"), (near, "near the hub"))
    ]
    figure = Figure(name="rib-figure-6", title=title(6, _ours(run, _name(run))), panels=panels, columns=2, height=108.0)
    tip, wound, touching = np.linalg.norm(run.x[:, -1, 0, :2], axis=1), run.turns, run.touching_turns
    rows = [[f"{run.t[k]:.4g}", f"{tip[k]:.3g}", f"{wound[k]:.3g}", f"{touching[k]:.3g}"] for k in moments]
    table = markdown(("time, s", "tip from the hub's axis, m", "turns wound", "turns that touch"), rows)
    return Made(text=f"{_note(run)}\n{table}", figure=figure, complete=complete)


def _inside(line: Line, radius: float) -> Line:
    """The part of a line nearer to the axis than a radius, without its name."""
    out = np.hypot(line.x, line.y) > radius
    x, y = (np.where(out, np.nan, values) for values in (line.x, line.y))
    return dataclasses.replace(line, label="", x=x, y=y)


def _string_speed(run: RibRun) -> Line:
    """Speed of the tip of a string without bending stiffness."""
    string = comparable_string(run.case)
    assert string is not None
    at, speed = string.time, string.tip_speed
    return Line(x=at, y=speed, label="", color="gray", style="--", width=1.0)


def figure_7(options: Options) -> Made:
    """The tip's speed for the three dampings."""
    found, complete = _all(options)
    strings = [_string_speed(run) for run in found]
    if strings:
        strings[0] = dataclasses.replace(strings[0], label="ours: string, to 98 % wound")
    lines = [*_lines(found, lambda run: run.speed), *strings]
    panels = [Panel(x_label=TIME, y_label="tip speed, m/s", lines=lines, y_zero=True)]
    for k, run in enumerate(found):
        peak = run.t[run.peak]
        near = (run.t > peak + DETAIL[0]) & (run.t < peak + DETAIL[1])
        drawn = [Line(x=run.t[near], y=run.speed[near], label=_name(run), color=k)]
        coarse = near & run.even
        drawn.append(Line(x=run.t[coarse], y=run.speed[coarse], color=k, style="", marker="o", label="every 0.25 s"))
        text = f"ours: detail, {run.speed[run.peak]:.1f} m/s at {peak:.2f} s"
        panels.append(Panel(x_label=TIME, y_label="tip speed, m/s", lines=drawn, y_zero=True, title=text))
    figure = Figure(name="rib-figure-7", title=title(7, _ours(found[0])), panels=panels, columns=2, height=160.0)
    rows = [
        [
            f"{run.case.damping.alpha:g}", f"{run.t[run.peak]:.2f}", f"{run.speed[run.peak]:.3g}",
            f"{run.speed[run.even].max():.3g}", f"{run.case.string.end_time:.2f}",
        ]
        for run in found
    ]  # fmt: skip
    head = ("a, 1/s", "tip fastest at, s", "peak, m/s", "largest of samples every 0.25 s, m/s",
            "string 98 % wound at, s")  # fmt: skip
    return Made(text=f"{_note(found[0])}\n{markdown(head, rows)}", figure=figure, complete=complete)


def _touching_elements(run: RibRun) -> Array:
    """Number of elements of which a contact point touches, (nt,)."""
    found: Array = run.touching.reshape(run.t.size, run.case.rib.elements, -1).any(axis=2).sum(axis=1)
    return found


def figure_8(options: Options) -> Made:
    """Points in contact over time."""
    found, complete = _all(options)
    case = found[0].case
    total = case.rib.elements * case.contact.points
    label, touching = f"points with contact (of {total})", f"elements that touch (of {case.rib.elements})"
    every = _lines(found, lambda run: run.points)
    k = min(1, len(every) - 1)  # the paper has one curve, of a damping that it does not name
    panels = [
        Panel(x_label="", y_label=label, lines=[every[k]]),
        Panel(x_label="", y_label=label, lines=every, title="ours: three dampings"),
        Panel(x_label=TIME, y_label=touching, lines=_lines(found, _touching_elements), title="ours: elements"),
    ]
    figure = Figure(name="rib-figure-8", title=title(8, _ours(found[k], _name(found[k]))), panels=panels, height=200.0)
    rows = []
    for run in found:
        at = np.searchsorted(run.t, run.t[run.peak] * np.array([0.5, 0.75, 0.9, 0.99]))
        counts = [f"{run.points[k]:.0f}" for k in at]
        end = f"{run.points[-1]:.0f} at {run.t[-1]:g} s"
        rows.append([f"{run.case.damping.alpha:g}", *counts, end, str(_touching_elements(run)[-1])])
    head = (
        "a, 1/s",
        "points at 50 % of the peak's time",
        "75 %",
        "90 %",
        "99 %",
        "at the end",
        "elements, at the end",
    )
    return Made(text=f"{_note(found[0])}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_9(options: Options) -> Made:
    """The contact force for the three dampings."""
    found, complete = _all(options)
    closed = closed_forms.wound_contact_force(found[0].case.strip, found[0].case.drive.torque)
    span = np.array([0.0, max(run.t[-1] for run in found)])
    words = "ours: wound and held, $TL/2R^2$"
    rest = Line(x=span, y=np.full(2, closed), label=words, color="gray", style="--", width=1.0)
    impulses = _lines(found, lambda run: run.impulse)
    panels = [
        Panel(x_label="", y_label="contact force, N", lines=[*_lines(found, lambda run: run.force), rest], y_zero=True),
        Panel(x_label=TIME, y_label="impulse, N s", lines=impulses, title="ours: impulse"),
    ]
    near = []
    for k, run in enumerate(found):
        part = np.abs(run.t - run.t[run.peak] + 0.05) < 0.15
        near.append(Line(x=run.t[part] - run.t[run.peak], y=run.force[part], label=_name(run), color=k, width=1.2))
    label = "time from the peak of the tip's speed, s"
    panels.append(Panel(x_label=label, y_label="contact force, N", lines=near, y_zero=True, title="ours: detail"))
    figure = Figure(name="rib-figure-9", title=title(9, _ours(found[0])), panels=panels, height=200.0)
    head = ("a, 1/s", *FORCES)
    rows = [[f"{run.case.damping.alpha:g}", *_forces(run)] for run in found]
    return Made(text=f"{_note(found[0])}\n{markdown(head, rows)}", figure=figure, complete=complete)


#: Columns on the contact force.
FORCES = ("impulse to the peak of the tip's speed, N s", "largest mean over 10 ms, N", "largest sample, N",
          "largest of samples every 0.25 s, N")  # fmt: skip


def _forces(run: RibRun) -> list[str]:
    values = (run.impulse[run.peak], run.largest_mean_force, run.force.max(), run.force[run.even].max())
    return [f"{value:.3g}" for value in values]


# ------------------------------------------------------------------------------------------------ root damping


def root_keys(*, quick: bool = False) -> list[dict[str, Any]]:
    """Keys of the runs on the damping of the root."""
    coarse = {"rib__elements": 20} if quick else {}
    base = {"damping__alpha": 0.0, "solver__duration": 30.0 if quick else ALPHAS[0.0]} | coarse
    found = [base | dict(keys) for keys in ROOT.values()]
    if quick:  # the same length in half as many elements
        found[1]["damping__elements"] = (1, 2)
    return found


def root_damping(options: Options) -> Made:
    """Damping in the first element alone, and dampers in the hinge, beside a rib without damping."""
    found, complete = _of(root_keys(quick=options.quick), options)
    lines: list[list[Line]] = [[], [], []]
    for k, (run, name) in enumerate(zip(found, ROOT, strict=False)):
        near = (run.t > ROOT_DETAIL[0]) & (run.t < ROOT_DETAIL[1])
        lines[0].append(Line(x=run.t, y=run.speed, label=name, color=k, width=1.2))
        lines[1].append(Line(x=run.t[near], y=run.speed[near], color=k, width=1.2))
        before = run.t < run.t[run.peak] + 0.1
        lines[2].append(Line(x=run.t[before], y=run.impulse[before], color=k, width=1.2))
    labels = ("tip speed, m/s", "tip speed, m/s", "impulse of the contact, N s")
    panels = [
        Panel(x_label=TIME, y_label=label, lines=each, y_zero=True) for label, each in zip(labels, lines, strict=True)
    ]
    text = "Ours: damping at the root alone does not guide the winding (section 2.3 of Yi et al. 2017)"
    figure = Figure(name="rib-root-damping", title=text, panels=panels, height=190.0)
    rows = [
        [plain(name), f"{run.t[run.peak]:.2f}", f"{run.speed[run.peak]:.3g}", *_forces(run)]
        for run, name in zip(found, ROOT, strict=False)
    ]
    head = ("damping", "tip fastest at, s", "peak, m/s", *FORCES)
    return Made(text=f"{_note(found[0])}\n{markdown(head, rows)}", figure=figure, complete=complete)


# ------------------------------------------------------------------------------------------------ points at rest


def departure(run: RibRun) -> float:
    """Largest distance of a cubic from an arc of the hub's radius with whose ends and directions it agrees, m."""
    R = run.case.hub.radius
    return float(R * (run.case.rib.element_length / R) ** 4 / 384.0)


def points_at_rest(options: Options) -> Made:
    """Gaps of the contact points of the wound rib at rest."""
    wanted = [keys for keys in of_the_paper(quick=options.quick) if keys["damping__alpha"] == SHOWN]
    (run, *_), complete = _of(wanted, options)
    case, L = run.case, run.case.rib.length
    each, count = case.contact.points, case.rib.elements
    arc = np.arange(1, each * count + 1).reshape(count, each) / (each * count) * L
    gap, touches = 1e6 * run.gap[-1].reshape(count, each), run.touching[-1].reshape(count, each)
    needed = closed_forms.wound_pressure(case.strip, case.drive.torque, arc[:, 0]) * case.contact_spacing
    sunk = -1e6 * needed / case.contact_stiffness
    inside = slice(0, count - 1)  # beyond, the free end springs off the hub
    lines = [
        Line(x=arc[inside, i], y=gap[inside, i], label=f"point at {(i + 1) / each:g} of each element", color=i,
             style="", marker="o")
        for i in range(each)
    ]  # fmt: skip
    lines.append(Line(x=arc[:, 0], y=sunk, label="pressure over stiffness", color="gray", style="--", width=1.0))
    lines.append(Line(x=np.array([0.0, L]), y=np.zeros(2), color="gray", width=0.8))
    panels = [Panel(x_label="from the root, m", y_label="distance from the hub, um", lines=lines)]
    xi = np.linspace(0.0, 1.0, 41)
    shape, drawn = axis_shape(case.rib.element_length, xi), []
    for k, number in enumerate((round(0.1 * count), round(0.5 * count), round(0.9 * count))):
        x = run.x[-1, number : number + 2, :2].reshape(4, 3)
        path = np.einsum("jk,ji->ki", np.array(shape), x)
        off = 1e6 * (np.hypot(path[:, 0], path[:, 1]) - case.hub.radius)
        drawn.append(Line(x=xi, y=off, label=f"element {number + 1}", color=k))
        drawn.append(Line(x=np.arange(1, each + 1) / each, y=gap[number], color=k, style="", marker="o"))
    drawn.append(Line(x=np.array([0.0, 1.0]), y=np.zeros(2), color="gray", width=0.8))
    panels.append(Panel(x_label="along the element", y_label="distance from the hub, um", lines=drawn))
    heading = f"Ours: contact points of the wound rib at rest, {touches.sum()} of {touches.size} touch"
    figure = Figure(name="rib-points-at-rest", title=heading, panels=panels, height=160.0)
    head = ("point, of each element", f"touch, of {count}", "mean gap, um", "smallest, um", "largest, um")
    rows = [
        [f"{(i + 1) / each:g}", str(touches[:, i].sum()), f"{gap[inside, i].mean():.3g}", f"{gap[inside, i].min():.3g}",
         f"{gap[inside, i].max():.3g}"]
        for i in range(each)
    ]  # fmt: skip
    text = f"""{_note(run)}
A cubic element departs by up to {1e6 * departure(run):.3g} um from an arc of {math.degrees(case.rib.element_length / case.hub.radius):.3g} deg on
the hub, its middle nearest to the axis. The pressure sinks the contact points in by {-sunk[0]:.3g} um at the root and not
at all at the tip. The gaps are those of all elements but the last, which springs off at its free end.
"""  # noqa: E501
    return Made(text=f"{text}\n{markdown(head, rows)}", figure=figure, complete=complete)
