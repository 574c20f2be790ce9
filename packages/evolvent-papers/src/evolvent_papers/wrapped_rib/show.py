"""Numbers, figures and motion of a run, beside the closed forms that hold for it."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, closed_forms
from evolvent.elements import axis_shape
from evolvent.results import closing_numbers, regular, variables
from evolvent.results.rotations import rotation_matrices
from evolvent.view import balance, show
from evolvent.view.drawing import motion_of, smooth
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of, stacked
from evolvent_papers.wrapped_rib.case import Case
from evolvent_papers.wrapped_rib.case_checks import bending_stiffness_ratio
from evolvent_papers.wrapped_rib.keys import IMPLICIT

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.results.motion import Motion

Array = np.ndarray
#: Share of a run, at its end, over which the contact force is averaged.
WINDOW = 0.04
#: Work of bending, of that of the torque, above which a string without bending stiffness is not compared with a rib.
FLEXIBLE = 0.1
#: Shapes that are drawn of a run.
SHAPES = 6
#: Width of thin lines.
THIN = 1.2
#: Titles of the phases.
PHASES = {"wind": "Winding", "hold": "Holding", "deploy": "Deployment"}


def _of(run: xr.DataTree, name: str) -> Array:
    """Values of a variable by its full name."""
    return np.asarray(variables.get(run, name).values)


def _case(run: xr.DataTree) -> Case:
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


# ------------------------------------------------------------------------------------------------ closed forms


def estimating_string(case: Case) -> closed_forms.Winding | None:
    """A string without bending stiffness under the case's drive, straight whatever is damped, if there is one."""
    drive = case.drive
    if case.begins != "straight" or drive is None or drive.kind != "torque" or drive.torque is None:
        return None
    return None if case.hub.motion != "fixed" or drive.ramp > 0.0 else case.string


def comparable_string(case: Case) -> closed_forms.Winding | None:
    """The string, where the rib is as flexible; None as well where drag on a part bends the tail."""
    drive, strip = case.drive, case.strip
    if drive is None or drive.torque is None or not _is_straight_and_uniform(case) or _bends_the_tail(case):
        return None
    is_flexible = strip.bending_stiffness <= 2.0 * FLEXIBLE * strip.radius * drive.torque
    return estimating_string(case) if is_flexible else None


def _is_straight_and_uniform(case: Case) -> bool:
    """Whether a rib is straight without stress, and has no taper."""
    return case.rib.shape is None and case.strip.taper == 1.0


def _bends_the_tail(case: Case) -> bool:
    """Whether drag acts on a part of the rib alone."""
    return case.damped_arcs is not None and case.damping.alpha > 0.0


def comparable_release(case: Case) -> bool:
    """Whether the closed form of deployment holds: a straight uniform rib without damping, friction or drive."""
    free = case.phase == "deploy" and case.drive is None and case.hub.motion == "fixed"
    undamped = case.damping.alpha == 0.0 and case.damping.beta == 0.0 and case.contact.friction == 0.0
    return free and undamped and case.begins == "wound" and _is_straight_and_uniform(case)


def _resting_torque(case: Case) -> float | None:
    """The torque under which a wound rib comes to rest as the closed form says, N m; None if it does not."""
    drive = case.drive
    if drive is None or drive.kind != "torque" or case.hub.motion != "fixed" or case.contact.friction > 0.0:
        return None
    if case.rib.shape is not None:  # whose moment is not constant on the hub
        return None
    return drive.torque


# ------------------------------------------------------------------------------------------------ numbers


def numbers(run: xr.DataTree) -> list[Number]:
    """Rows of the table; of several ribs, those of the first."""
    root, case = run.to_dataset(), _case(run)
    time, force, hub = root.time.values, _of(run, "contact-1.normal_force"), case.hub.motion
    rows: list[tuple[Any, ...]] = [
        ("time reached", f"{time[-1]:.6g} s", (time[-1], "s")),
        ("wound at the end", *_turns(root, "wrap_angle")),
        ("touches the hub at the end", *_touching(root, case.strip)),
    ]
    rows += {"wind": _of_winding, "hold": _of_holding, "deploy": _of_deployment}[case.phase](run, case)
    if case.rib.pitch > 0.0:
        heights = _of(run, "rib-1.position")[-1, :, 2]
        rise = heights[-1] - heights[0]
        quantities = (rise, "m"), (case.rise, "m", "helix")
        rows.append(("tip above the root at the end", f"{rise:.5g} m (helix {case.rise:.5g})", *quantities))
    if np.any(force > 0.0):
        k = int(np.argmax(force))
        peak = f"{force[k]:.4g} N at {time[k]:.5g} s (it depends on the mesh)"
        impulse = _of(run, "contact-1.impulse")[-1]
        rows.append(("impulse of the contact", f"{impulse:.4g} N s", (impulse, "N s")))
        rows.append(("largest contact force, one sample", peak, (force[k], "N"), (time[k], "s", "time")))
    if case.contact.self:
        points, normal = _of(run, "layer-1.points")[-1], _of(run, "layer-1.normal_force")[-1]
        text, quantities = f"{normal:.4g} N at {points:.0f} contact points", ((normal, "N"), (points, "1", "points"))
        rows.append(("turns on one another at the end", text, *quantities))
    if np.any(root.hub_torque.values):
        torque = float(root.hub_torque.values[-1])
        rows.append(("torque on the hub at the end", f"{torque:.4g} N m", (torque, "N m")))
    if hub != "fixed":
        turned = math.degrees(float(root.hub_angle.values[-1] - root.hub_angle.values[0]))
        rows.append(("hub turned by", f"{turned:.5g} deg", (turned, "deg")))
    if hub in ("free", "spin") and case.drive is None and case.damping.alpha == 0.0:
        for name, unit in (("angular_momentum", "kg m2/s"), ("momentum", "kg m/s"))[: 2 if hub == "free" else 1]:
            drift = np.abs(root[name].values - root[name].values[0])[:, 0 if hub == "free" else 2 :].max()
            label = f"drift of {'linear ' * (name == 'momentum')}{name.replace('_', ' ')}"
            rows.append((label, f"{drift:.2g} {unit}", (drift, unit)))
    ratio = bending_stiffness_ratio(case)
    rows.append(("bending stiffness of the mesh, over the rib's", f"{ratio:.4g}", (ratio, "1")))
    if case.method not in IMPLICIT:
        text = f"{case.penalty[0]:.4g} N/m, in place of joints"
        rows.append(("roots held by penalties of", text, (case.penalty[0], "N/m")))
    return numbers_of(rows) + balance.balance_numbers(run) + closing_numbers(run)


def _turns(root: xr.Dataset, variable: str) -> tuple[Any, ...]:
    turns = float(root[variable].values[-1, 0]) / (2.0 * math.pi)
    text = f"{abs(turns):.4g} turns" + (", the other way round" if turns < 0.0 else "")
    return text, (turns, "turns")


def _touching(root: xr.Dataset, strip: closed_forms.Strip) -> tuple[Any, ...]:
    text, turns = _turns(root, "touching_angle")
    share = 100.0 * abs(float(root.touching_angle.values[-1, 0])) * strip.radius / strip.length
    return f"{text}, {share:.4g} % of the rib", turns, (share, "%", "share of the rib")


def _of_winding(run: xr.DataTree, case: Case) -> list[tuple[Any, ...]]:
    """When the tip is fastest, beside the string; where all is wound, the largest speed grows with the mesh."""
    string = comparable_string(case)
    fastest, at = _of(run, "tip_speed_peak")[0], _of(run, "tip_speed_peak_time")[0]
    peak, estimated = f"{fastest:.4g} m/s at {at:.5g} s", []
    if string is not None and string.end_time < _of(run, "time")[-1]:
        peak += " (the time converges, the speed does not)"
    if string is not None and math.isfinite(string.end_time):
        estimate, estimated = f"{string.end_time:.5g} s", [(string.end_time, "s")]
    elif _bends_the_tail(case) and estimating_string(case) is not None:
        estimate = "no comparison, for damping.alpha on chosen elements bends its tail"
    else:
        return [("largest tip speed", peak, (fastest, "m/s"), (at, "s", "time"))]
    return [
        ("largest tip speed", peak, (fastest, "m/s"), (at, "s", "time")),
        ("98 % wound, estimate for a string", estimate, *estimated),
    ]


def _of_holding(run: xr.DataTree, case: Case) -> list[tuple[Any, ...]]:
    """The rest on the hub, beside its closed form."""
    run = regular(run)
    time = _of(run, "time")
    late = time >= (1.0 - WINDOW) * time[-1]
    force, torque = _of(run, "contact-1.normal_force")[late].mean(), _resting_torque(case)
    text, quantities = f"{force:.5g} N", [(force, "N", "")]
    if torque is not None:
        closed = "T L / 2 R2 =" if case.strip.taper == 1.0 else "closed form"
        wound = closed_forms.wound_contact_force(case.strip, torque)
        text += f" ({closed} {wound:.5g})"
        quantities.append((wound, "N", "closed form"))
    arc, curvature = curvature_of(run, case)
    bent = case.hub.radius * curvature[-1, (arc > 0.1 * arc[-1]) & (arc < 0.9 * arc[-1])]
    return [
        (f"contact force, mean of the last {100.0 * WINDOW:g} %", text, *quantities),
        (
            "curvature x R, away from the ends",
            f"{bent.mean():.5g} ± {bent.std():.2g}",
            (bent.mean(), "1"),
            (bent.std(), "1", "standard deviation"),
        ),
    ]


def _of_deployment(run: xr.DataTree, case: Case) -> list[tuple[Any, ...]]:
    """The tip's position and speed beside the closed form."""
    run = regular(run)
    time, strip = _of(run, "time"), case.strip
    r, v = _of(run, "tip_radius")[-1, 0], _of(run, "rib-1.tip_speed")[time >= 0.5 * time[-1]].mean()
    radius, speed = f"{r:.5g} m", f"{v:.4g} m/s"
    if not comparable_release(case):
        return [
            ("tip radius at the end", radius, (r, "m")),
            ("tip speed, mean of the second half", speed, (v, "m/s")),
        ]
    far, fast = float(closed_forms.deployed_tip_radius(strip, time[-1])), closed_forms.deployment_speed(strip)
    whole = closed_forms.deployment_time(strip)
    return [
        ("tip radius at the end", f"{radius} (closed form {far:.5g})", (r, "m"), (far, "m", "closed form")),
        (
            "tip speed, mean of the second half",
            f"{speed} (closed form {fast:.4g})",
            (v, "m/s"),
            (fast, "m/s", "closed form"),
        ),
        ("closed form unwinds all in", f"{whole:.5g} s", (whole, "s")),
    ]


# ------------------------------------------------------------------------------------------------ along the rib


def curvature_of(run: xr.DataTree, case: Case, rib: int = 1) -> tuple[Array, Array]:
    """Lengths along a rib from its root (k,), m, and the turn there about the hub's axis per length, (nt, k), 1/m.

    Notes
    -----
    Positive as it winds, per length without stress: (r' x r'') . z / |r'|^2. In each element the straight line through
    the two points of Gauss's rule, at which its cubic is nearest to the shape that it stands for, at `output.points`
    of it; means where elements meet.
    """
    length, per = case.rib.element_length, case.output.points
    x, s = _of(run, f"rib-{rib}.position"), _of(run, f"rib-{rib}.slope")
    ends, (at, _) = np.stack([x[:, :-1], s[:, :-1], x[:, 1:], s[:, 1:]], axis=2), np.polynomial.legendre.leggauss(2)
    shapes = [axis_shape(length, 0.5 * (1.0 + at), order=order) for order in (1, 2)]
    slope, bend = (np.einsum("jk,tnji->tnki", shape, ends) for shape in shapes)
    z = rotation_matrices(_of(run, "hub.attitude"))[:, :, 2]
    turn = np.einsum("tnki,ti->tnk", np.cross(slope, bend), z) / np.einsum("...i,...i", slope, slope)
    mean, tilt = turn.mean(axis=-1), 0.5 * (turn[..., 1] - turn[..., 0]) / at[1]
    values = mean[..., None] + tilt[..., None] * (2.0 * np.arange(per + 1) / per - 1.0)
    values[:, 1:, 0] = values[:, :-1, -1] = 0.5 * (values[:, 1:, 0] + values[:, :-1, -1])
    found = np.concatenate([values[..., :-1].reshape(len(values), -1), values[:, -1:, -1]], axis=1)
    return length / per * np.arange(found.shape[1]), found


def tension_of(run: xr.DataTree, rib: int = 1) -> tuple[Array, Array]:
    """Lengths of the elements' middles from the root (n,), m, and the mean force along each of them, (nt, n), N."""
    force, arc = _of(run, f"rib-{rib}.axial_force"), _of(run, f"rib-{rib}.arc")
    return arc.reshape(-1, 2).mean(axis=1), force.reshape(len(force), -1, 2).mean(axis=2)


# ------------------------------------------------------------------------------------------------ figures


def figures(run: xr.DataTree) -> list[Figure]:
    """What to draw of a run; nothing of one with fewer than three samples."""
    root, case = run.to_dataset(), _case(run)
    if root.sizes["time"] < 3:
        return []
    found = [_shape_figure(run, root, case), _tip_figure(run, root, case)]
    if any(np.any(_of(run, f"contact-{k}.points") > 0.0) for k in root.rib.values):
        found.append(_contact_figure(run, root, case))
    found += [_along_figure(run, root, case), balance.balance_figure(run)]
    hub = ["hub_torque"] if case.hub.motion == "fixed" else ["hub_torque", "hub_angle", "angular_momentum"]
    if len(hub) > 1 or np.any(root.hub_torque.values):
        found.append(show.figure(run, hub, name="hub", title="Hub"))
    return found


def _dashed(x: Any, y: Any, label: str = "closed form") -> Line:
    """A closed form."""
    return Line(x=np.asarray(x), y=np.asarray(y), label=label, color=2, style="--", width=THIN)


def _with_lines(figure: Figure, more: dict[str, list[Line]]) -> Figure:
    """A figure with more lines in its panels, by their labels, which they get; axes that start at zero."""
    panels = [
        dataclasses.replace(panel, y_label=label, lines=[*panel.lines, *lines], y_zero=True)
        for panel, (label, lines) in zip(figure.panels, more.items(), strict=True)
    ]
    return dataclasses.replace(figure, panels=panels)


def _moments(root: xr.Dataset) -> list[int]:
    """Samples at which shapes are drawn: evenly spread over what the tip does, not over time."""
    along = np.abs(np.diff(root.wrap_angle.values[:, 0], prepend=root.wrap_angle.values[0, 0])).cumsum()
    along = along / along[-1] if along[-1] > 0.0 else np.zeros_like(along)
    time = root.time.values
    mixed = along + 0.5 * (time - time[0]) / (time[-1] - time[0])
    return sorted({int(np.searchsorted(mixed, x)) for x in np.linspace(mixed[0], mixed[-1], SHAPES)})


def _shape_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Shapes round the hub at several times (Yi, figure 6): the whole, and what is near the hub."""
    time, R, moments = root.time.values, case.hub.radius, _moments(root)
    around, hub = np.linspace(0.0, 2.0 * np.pi, 181), _of(run, "hub.position")[moments]
    whole = [Line(x=R * np.cos(around), y=R * np.sin(around), color="gray", width=1.0, fill="gainsboro")]
    for b in root.rib.values:
        nodes, slopes = (_of(run, f"rib-{b}.{name}")[moments] for name in ("position", "slope"))
        points = smooth(nodes, slopes, case.rib.element_length, case.output.points) - hub[:, None]
        for k, x in enumerate(points):
            label = f"{time[moments[k]]:.4g} s" if b == 1 else ""
            whole.append(Line(x=x[:, 0], y=x[:, 1], label=label, color=k / len(moments), width=THIN))
    near = whole[:1]
    for line in whole[1:]:
        inside = np.hypot(line.x, line.y) < 2.0 * R
        x, y = (np.where(inside, values, np.nan) for values in (line.x, line.y))
        near.append(Line(x=x, y=y, color=line.color, width=THIN, marker="."))
    title = "along the hub's first axis, from its middle" if case.hub.motion == "free" else "along the hub's axis"
    panels = [
        Panel(x_label="x, m", y_label="y, m", lines=lines, title=text, equal=True)
        for lines, text in ((whole, title), (near, "near the hub"))
    ]
    return Figure(name="shape", title="Shape of the rib", panels=panels, columns=2, height=104.0)


def _tip_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Speed and radius of the tip (Yi, figure 7), beside the string or the closed form."""
    time, strip, R = root.time.values, case.strip, case.hub.radius
    names = [*(f"rib-{k}.tip_speed" for k in root.rib.values), "tip_radius", "wrap_angle", "touching_angle"]
    speed, radius, angle = [], [], []
    if root.tip_speed_peak.values[0] > 1.01 * _of(run, "rib-1.tip_speed").max():
        peaks = zip(root.tip_speed_peak_time.values, root.tip_speed_peak.values, strict=True)
        for b, (at, most) in enumerate(peaks):
            label = "" if b else "largest, between samples"
            speed.append(Line(x=np.array([at]), y=np.array([most]), label=label, color=b, style="", marker="o"))
    string = comparable_string(case) if case.phase == "wind" else None
    if string is not None:
        kept = string.time <= time[-1]
        at, wrap, swing = string.time[kept], string.wrap[kept], string.swing[kept]
        tail = strip.length - R * wrap
        speed.append(_dashed(at, string.tip_speed[kept], label="string without bending stiffness"))
        radius.append(_dashed(at, np.sqrt(R**2 + tail**2 + 2.0 * R * tail * np.cos(swing)), label=""))
        angle.append(_dashed(at, wrap, label=""))
    if comparable_release(case):
        v, end = closed_forms.deployment_speed(strip), min(float(time[-1]), closed_forms.deployment_time(strip))
        speed.append(_dashed([time[0], end], [v, v]))
        radius.append(_dashed(time, closed_forms.deployed_tip_radius(strip, time)))
        angle.append(_dashed(time, (strip.length - closed_forms.deployed_length(strip, time)) / R))
    found = show.figure(run, names, name="tip", title="Motion of the tip")
    return _with_lines(found, {"tip speed, m/s": speed, "tip from the axis, m": radius, "angle, rad": angle})


def _contact_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Normal forces on the hub and their means, impulse, and points in contact (Yi, figures 8 and 9)."""
    wanted = ("normal_force", "mean_force", "impulse", "points")
    names, held = [f"contact-{k}.{name}" for name in wanted for k in root.rib.values], []
    torque = _resting_torque(case)
    if torque is not None:
        force, time = closed_forms.wound_contact_force(case.strip, torque), root.time.values
        held.append(_dashed([time[0], time[-1]], [force, force], label="wound and held, closed form"))
    found = show.figure(run, names, name="contact", title="Contact with the hub")
    points = f"points in contact (of {case.rib.elements * case.contact.points})"
    return _with_lines(found, {"contact force, N": held, "impulse, N s": [], points: []})


def _along_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Curvature, tension and, in phase hold, pressure along the first rib, beside the closed form."""
    time, R, hold, strip = root.time.values, case.hub.radius, case.phase == "hold", case.strip
    shown = [time.size - 1] if hold else _moments(root)
    colors = [0] if hold else [count / len(shown) for count in range(len(shown))]
    (arc, turn), (middle, pull) = curvature_of(run, case), tension_of(run)

    def at_times(x: Array, y: Array, *, named: bool = False) -> list[Line]:
        labels = [f"{time[k]:.4g} s" if named else "" for k in shown]
        each = zip(shown, colors, labels, strict=True)
        return [Line(x=x, y=y[k], label=label, color=color, width=THIN) for k, color, label in each]

    curvature, tension = at_times(arc, R * turn, named=True), at_times(middle, pull)
    panels = [Panel(x_label="", y_label=r"curvature $\times R$", lines=curvature)]
    panels.append(Panel(x_label="" if hold else "from the root, m", y_label="tension, N", lines=tension))
    if hold:
        forces = _of(run, "contact-1.point_force").reshape(time.size, middle.size, -1).sum(axis=2)
        pressures, T = at_times(middle, forces / case.rib.element_length), _resting_torque(case)
        if T is not None:
            share = strip.length / case.rib.length  # cosine of the angle of a helix
            closed = closed_forms.wound_tension(strip, T, share * arc)
            stretched = 1.0 + closed / closed_forms.axial_stiffness_at(strip, share * arc)
            curvature.append(_dashed(arc, share**3 * stretched, label="closed form"))
            tension.append(_dashed(arc, closed / share))
            pressures.append(_dashed(arc, share * closed_forms.wound_pressure(strip, T, share * arc)))
        panels.append(Panel(x_label="from the root, m", y_label="pressure on the hub, N/m", lines=pressures))
    return Figure(name="along", title="Along the rib", panels=panels, height=stacked(len(panels)))


# ------------------------------------------------------------------------------------------------ motion


def motion(run: xr.DataTree) -> Motion | None:
    """Ribs, coloured by the force along them or, in phase deploy, by curvature first; contact forces and the hub."""
    case = _case(run)
    found = motion_of(run, title=f"{PHASES[case.phase]} of the rib")
    if found is None:
        return None
    shown = {
        "tip speed [m/s]": _of(run, "rib-1.tip_speed"),
        "wound [turns]": _of(run, "wrap_angle")[:, 0] / (2.0 * np.pi),
        "contact force [N]": _of(run, "contact-1.normal_force"),
    }
    lines = [
        dataclasses.replace(line, values=dict(sorted(line.values.items(), reverse=case.phase == "deploy")))
        for line in found.lines
    ]
    return dataclasses.replace(found, lines=lines, numbers=shown)
