"""What to show of a run: numbers, figures and motion."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, variables
from evolvent.figures import Figure, Line, Number, Panel
from evolvent.systems.wrapped_rib import reference
from evolvent.systems.wrapped_rib.advice import locking
from evolvent.systems.wrapped_rib.case import Case

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.motion import Motion

#: Share of a run over which contact forces are averaged, since single samples depend on the mesh.
WINDOW = 0.04
#: Work of bending, of that of the torque, above which a light string is no measure of a rib.
LIGHT = 0.1
#: Smallest stored energy that is drawn, of the largest energy: less is round-off.
STORED_SHOWN = 1e-10
#: Shapes that are drawn of a run.
SHAPES = 9
#: Width of thin lines.
THIN = 1.2
#: Titles of the phases.
PHASES = {"wind": "Winding", "hold": "Holding", "deploy": "Deployment"}


def _opened(run: xr.DataTree) -> tuple[xr.Dataset, Case]:
    """The root of a run, and the case that it was made from."""
    return run.to_dataset(), cases.of_run(run.attrs["case"])


# ------------------------------------------------------------------------------------------------ numbers


def numbers(run: xr.DataTree) -> list[Number]:
    """The results that a user wants to see at once; of several ribs, those of the first."""
    from evolvent.results import closing_numbers, statistics_of

    root, case = _opened(run)
    time, force = root.time.values, root.contact_force.values[:, 0]
    rows = [("time reached", f"{time[-1]:.6g} s"), ("wound at the end", _wound(root, case.strip))]
    rows += {"wind": _of_winding, "hold": _of_holding, "deploy": _of_deployment}[case.phase](root, case)
    if np.any(force > 0.0):
        rows.append(("impulse of the contact", f"{root.contact_impulse.values[-1, 0]:.4g} N s"))
        peak = f"{_peak(time, force, 'N')} (it depends on the mesh)"
        rows.append(("largest contact force, one sample", peak))
    if case.contact.self:
        pressed = f"{root.turn_force.values[-1, 0]:.4g} N at {root.turn_points.values[-1, 0]:.0f} contact points"
        rows.append(("turns on one another at the end", pressed))
    if np.any(root.hub_torque.values):
        rows.append(("torque on the hub at the end", f"{root.hub_torque.values[-1]:.4g} N m"))
    if case.hub.motion != "fixed":
        turned = math.degrees(float(root.hub_angle.values[-1] - root.hub_angle.values[0]))
        rows.append(("hub turned by", f"{turned:.5g} deg"))
    rows += _energy_rows(root)
    if case.hub.motion in ("free", "spin") and case.drive is None and case.damping.alpha == 0.0:
        free = case.hub.motion == "free"
        drifts = [("angular momentum", "kg m2/s", slice(0 if free else 2, 3)), ("linear momentum", "kg m/s", slice(3))]
        for label, unit, axes in drifts[: 2 if free else 1]:
            values = root[label.replace(" ", "_").removeprefix("linear_")].values[:, axes]
            rows.append((f"drift of {label}", f"{np.abs(values - values[0]).max():.2g} {unit}"))
    rows.append(("bending stiffness of the mesh, over the rib's", f"{locking(case)[0]:.4g}"))
    penalty = statistics_of(run).get("penalty_stiffness")
    if penalty:
        rows.append(("roots held by penalties of", f"{penalty:.4g} N/m, in place of joints"))
    return [Number(label=label, value=value) for label, value in rows] + closing_numbers(run)


def _peak(time: np.ndarray, values: np.ndarray, unit: str) -> str:
    k = int(np.argmax(values))
    return f"{values[k]:.4g} {unit} at {time[k]:.5g} s"


def _wound(root: xr.Dataset, strip: reference.Strip) -> str:
    angle = float(root.wrap_angle.values[-1, 0])
    turns, share = abs(angle) / (2.0 * math.pi), 100.0 * abs(angle) * strip.radius / strip.length
    return f"{turns:.4g} turns, {share:.4g} % of the rib" + (", the other way round" if angle < 0.0 else "")


def _of_winding(root: xr.Dataset, case: Case) -> list[tuple[str, str]]:
    """When the tip is fastest, beside the light string; all wound, its speed grows with the mesh, as l^(-1/2)."""
    string = comparable_string(case)
    wound = string is not None and string.end_time < root.time.values[-1]
    peak = _peak(root.time.values, root.tip_speed.values[:, 0], "m/s")
    if "tip_speed_peak" in root:
        peak = f"{float(root.tip_speed_peak[0]):.4g} m/s at {float(root.tip_speed_peak_time[0]):.5g} s"
    found = [("largest tip speed", peak + (" (the time converges, the speed does not)" if wound else ""))]
    if string is not None and math.isfinite(string.end_time):
        found.append(("a light string is 98 % wound at", f"{string.end_time:.5g} s"))
    elif _bends_the_tail(case) and estimating_string(case) is not None:
        found.append(("a light string", "no comparison, for damping.alpha on chosen elements bends its tail"))
    return found


def _of_holding(root: xr.Dataset, case: Case) -> list[tuple[str, str]]:
    """The rest on the hub, beside its closed form."""
    late = root.time.values >= (1.0 - WINDOW) * root.time.values[-1]
    text = f"{root.contact_force.values[late, 0].mean():.5g} N"
    torque = _resting_torque(case)
    if torque is not None:
        closed = "T L / 2 R2 =" if case.strip.taper == 1.0 else "closed form"
        text += f" ({closed} {reference.wound_contact_force(case.strip, torque):.5g})"
    arc = root.arc.values
    inside = (arc > 0.1 * arc[-1]) & (arc < 0.9 * arc[-1])
    bent = case.hub.radius * root.curvature.values[-1, 0, inside]
    return [
        (f"contact force, mean of the last {100.0 * WINDOW:g} %", text),
        ("curvature x R, away from the ends", f"{bent.mean():.5g} ± {bent.std():.2g}"),
    ]


def _of_deployment(root: xr.Dataset, case: Case) -> list[tuple[str, str]]:
    """The tip's position and speed beside the closed form."""
    time, strip = root.time.values, case.strip
    radius = f"{float(root.tip_radius.values[-1, 0]):.5g} m"
    speed = f"{root.tip_speed.values[time >= 0.5 * time[-1], 0].mean():.4g} m/s"
    closed = comparable_release(case)
    if closed:
        radius += f" (closed form {float(reference.deployed_tip_radius(strip, time[-1])):.5g})"
        speed += f" (closed form {reference.deployment_speed(strip):.4g})"
    found = [("tip radius at the end", radius), ("tip speed, mean of the second half", speed)]
    return found + ([("closed form unwinds all in", f"{reference.deployment_time(strip):.5g} s")] if closed else [])


def _energy_rows(root: xr.Dataset) -> list[tuple[str, str]]:
    kinds = ("kinetic", "membrane", "bending", "contact")
    found = [("energy at the end", ", ".join(f"{k} {float(root[f'energy_{k}'].values[-1]):.3g}" for k in kinds) + " J")]
    taken = dict(zip(root.cause.values, root.energy_dissipated.values[-1], strict=True))
    largest = max(abs(value) for value in taken.values())
    causes = [f"{name} {value:.3g}" for name, value in taken.items() if abs(value) > 1e-6 * largest > 0.0]
    if causes:
        found.append(("energy taken by", f"{', '.join(causes)} J"))
    return [*found, ("energy balance", f"{float(np.abs(root.energy_balance.values).max()):.2g} of the largest energy")]


def comparable_string(case: Case) -> reference.Winding | None:
    """The light string under the case's drive, if it has one that is comparable: drag on a part bends the tail."""
    drive, strip = case.drive, case.strip
    if drive is None or drive.torque is None or strip.taper != 1.0 or _bends_the_tail(case):
        return None
    if strip.bending_stiffness > 2.0 * LIGHT * strip.radius * drive.torque:
        return None
    return estimating_string(case)


def _bends_the_tail(case: Case) -> bool:
    """Whether drag acts on a part of the rib alone."""
    return case.damped_arcs is not None and case.damping.alpha > 0.0


def estimating_string(case: Case) -> reference.Winding | None:
    """The light string under the case's drive, straight whatever is damped, if there is one."""
    drive = case.drive
    if case.begins != "straight" or drive is None or drive.kind != "torque" or drive.torque is None:
        return None
    return None if case.hub.motion != "fixed" or drive.ramp > 0.0 else case.string


def comparable_release(case: Case) -> bool:
    """Whether the closed form of deployment holds: a uniform rib without stretch, and nothing damps or drives it."""
    free = case.phase == "deploy" and case.drive is None and case.hub.motion == "fixed"
    undamped = case.damping.alpha == 0.0 and case.damping.beta == 0.0 and case.contact.friction == 0.0
    return free and undamped and case.begins == "wound" and case.strip.taper == 1.0


def _resting_torque(case: Case) -> float | None:
    """The torque under which a wound rib comes to rest as the closed form says, N m; None if it does not."""
    drive = case.drive
    if drive is None or drive.kind != "torque" or case.hub.motion != "fixed" or case.contact.friction > 0.0:
        return None
    return drive.torque


# ------------------------------------------------------------------------------------------------ figures


def figures(run: xr.DataTree) -> list[Figure]:
    """What to draw of a run; nothing of one with fewer than three samples."""
    root, case = _opened(run)
    if root.sizes["time"] < 3:
        return []
    found = [_shape_figure(run, root, case), _tip_figure(root, case)]
    if np.any(root.contact_force.values > 0.0):
        found += [_points_figure(root, case), _force_figure(root, case)]
    found += [_along_figure(run, root, case), _energy_figure(root)]
    if case.hub.motion != "fixed" or np.any(root.hub_torque.values):
        found.append(_hub_figure(root, case))
    return found


def _of_ribs(root: xr.Dataset, name: str, *, factor: float = 1.0, named: bool = False, **style: Any) -> list[Line]:
    """A variable over time, a line a rib; the third colour is for what a run is judged by."""
    count = root.sizes["rib"]
    return [
        Line(
            x=root.time.values,
            y=factor * root[name].values[:, b],
            label=f"rib {b + 1}" if named and count > 1 else "",
            color=(0, 1, 3, 4, 5, 6)[b % 6],
            **style,
        )
        for b in range(count)
    ]


def _moments(root: xr.Dataset) -> list[int]:
    """Samples at which shapes are drawn: evenly spread over what the tip does, not over time."""
    along = np.abs(np.diff(root.wrap_angle.values[:, 0], prepend=root.wrap_angle.values[0, 0])).cumsum()
    along = along / along[-1] if along[-1] > 0.0 else np.zeros_like(along)
    time = root.time.values
    mixed = along + 0.5 * (time - time[0]) / (time[-1] - time[0])
    return sorted({int(np.searchsorted(mixed, x)) for x in np.linspace(mixed[0], mixed[-1], SHAPES)})


def _dashed(x: Any, y: Any, label: str = "") -> Line:
    """What a run is to be judged by."""
    return Line(x=np.asarray(x), y=np.asarray(y), label=label, color=2, style="--", width=THIN)


def _shape_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Shapes round the hub at several times (Yi, figure 6): the whole, and what is near the hub."""
    time, R, free = root.time.values, case.hub.radius, case.hub.motion == "free"
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    whole = [Line(x=R * np.cos(around), y=R * np.sin(around), color="gray", width=1.0)]
    hub = variables.group_of(run, "hub")["position"].values if free else np.zeros((time.size, 3))
    moments = _moments(root)
    for count, k in enumerate(moments):
        for b in range(root.sizes["rib"]):
            x, label = root.position.values[k, b] - hub[k], f"{time[k]:.4g} s" if b == 0 else ""
            whole.append(Line(x=x[:, 0], y=x[:, 1], label=label, color=count / len(moments), width=THIN))
    near = whole[:1]
    for line in whole[1:]:
        inside = np.hypot(line.x, line.y) < 2.0 * R
        x, y = (np.where(inside, values, np.nan) for values in (line.x, line.y))
        near.append(Line(x=x, y=y, color=line.color, width=THIN, marker="."))
    title = "along the hub's first axis, from its middle" if free else "along the hub's axis"
    panels = [
        Panel(x_label="x, m", y_label="y, m", lines=lines, title=text, equal=True)
        for lines, text in ((whole, title), (near, "near the hub"))
    ]
    return Figure(name="shape", title="Shape of the rib", panels=panels, columns=2, size=(12.0, 5.2))


def _tip_figure(root: xr.Dataset, case: Case) -> Figure:
    """Speed and radius of the tip (Yi, figure 7), beside the light string or the closed form."""
    time, strip, turn = root.time.values, case.strip, 2.0 * np.pi
    speed = _of_ribs(root, "tip_speed", named=True)
    radius, turns = _of_ribs(root, "tip_radius"), _of_ribs(root, "wrap_angle", factor=1.0 / turn)
    string = comparable_string(case) if case.phase == "wind" else None
    if string is not None:
        kept = string.time <= time[-1]
        at, wrap, swing = string.time[kept], string.wrap[kept], string.swing[kept]
        tail, R = strip.length - strip.radius * wrap, strip.radius
        speed.append(_dashed(at, string.tip_speed[kept], label="light string"))
        radius.append(_dashed(at, np.sqrt(R**2 + tail**2 + 2.0 * R * tail * np.cos(swing))))
        turns.append(_dashed(at, wrap / turn))
    if comparable_release(case):
        v, end = reference.deployment_speed(strip), min(float(time[-1]), reference.deployment_time(strip))
        speed.append(_dashed([time[0], end], [v, v], label="closed form"))
        radius.append(_dashed(time, reference.deployed_tip_radius(strip, time)))
        wound = strip.length - reference.deployed_length(strip, time)
        turns.append(_dashed(time, wound / (turn * strip.radius)))
    if "tip_speed_peak" in root and float(root.tip_speed_peak[0]) > 1.01 * float(root.tip_speed[:, 0].max()):
        at, most = root.tip_speed_peak_time.values, root.tip_speed_peak.values
        for b, line in enumerate(speed[: root.sizes["rib"]]):
            label = "largest, between samples" if b == 0 else ""
            one = slice(b, b + 1)
            speed.append(Line(x=at[one], y=most[one], label=label, color=line.color, style="", marker="o"))
    panels = [
        Panel(x_label="", y_label="tip speed, m/s", lines=speed, y_zero=True),
        Panel(x_label="", y_label="tip from the axis, m", lines=radius, y_zero=True),
        Panel(x_label="time, s", y_label="wound, turns", lines=turns, y_zero=True),
    ]
    return Figure(name="tip", title="Motion of the tip", panels=panels, size=(8.0, 8.0))


def _points_figure(root: xr.Dataset, case: Case) -> Figure:
    """Number of contact points in contact (Yi, figure 8)."""
    lines = _of_ribs(root, "contact_points", named=True, width=1.0)
    title = f"of {case.rib.elements * case.contact.points} on each rib"
    panel = Panel(x_label="time, s", y_label="contact points in contact", lines=lines, title=title, y_zero=True)
    return Figure(name="contact_points", title="Contact with the hub", panels=[panel], size=(8.0, 4.0))


def running_mean(time: np.ndarray, values: np.ndarray, window: float) -> np.ndarray:
    """Mean of `values` over the time `window` about every sample, shorter at both ends."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (values[1:] + values[:-1]))])
    return mean_of_integral(time, total, window)


def mean_of_integral(time: np.ndarray, total: np.ndarray, window: float) -> np.ndarray:
    """The same of what has the integral `total`: of a force, its impulse, which has what lies between samples."""
    low, high = np.maximum(time - 0.5 * window, time[0]), np.minimum(time + 0.5 * window, time[-1])
    mean: np.ndarray = (np.interp(high, time, total) - np.interp(low, time, total)) / (high - low)
    return mean


def _force_figure(root: xr.Dataset, case: Case) -> Figure:
    """Sum of the normal forces on the hub with a running mean, and its impulse (Yi, figure 9)."""
    time = root.time.values
    window = WINDOW * float(time[-1] - time[0])
    impulse, force = _of_ribs(root, "contact_impulse"), []
    samples = _of_ribs(root, "contact_force", named=True, width=0.7)
    for one, total in zip(samples, impulse, strict=True):
        single = {"label": "samples", "color": 6} if len(samples) == 1 else {"label": "", "style": ":"}
        force.append(dataclasses.replace(one, **single))
        mean, label = mean_of_integral(time, total.y, window), f"mean of {window:.3g} s {one.label}".strip()
        force.append(Line(x=time, y=mean, label=label, color=one.color))
    torque = _resting_torque(case)
    if torque is not None:
        held = reference.wound_contact_force(case.strip, torque)
        label = "at rest, wound: T L / 2 R2" if case.strip.taper == 1.0 else "at rest, wound"
        force.append(_dashed([time[0], time[-1]], [held, held], label=label))
    title = "single samples depend on the mesh and on the contact's stiffness; means and impulses do not"
    panels = [
        Panel(x_label="", y_label="contact force, N", lines=force, title=title, y_zero=True),
        Panel(x_label="time, s", y_label="impulse, N s", lines=impulse, y_zero=True),
    ]
    return Figure(name="contact_force", title="Force of the contact with the hub", panels=panels, size=(8.0, 7.0))


def _along_figure(run: xr.DataTree, root: xr.Dataset, case: Case) -> Figure:
    """Curvature, tension and pressure along the first rib at several times; in phase hold, beside the closed form."""
    time, arc, R, hold = root.time.values, root.arc.values, case.hub.radius, case.phase == "hold"
    shown = [time.size - 1] if hold else _moments(root)
    colors = [0] if hold else [count / len(shown) for count in range(len(shown))]
    curvature = [
        Line(x=arc, y=R * root.curvature.values[k, 0], label=f"{time[k]:.4g} s", color=color, width=THIN)
        for k, color in zip(shown, colors, strict=True)
    ]
    tension = [
        Line(x=arc, y=root.tension.values[k, 0], color=color, width=THIN)
        for k, color in zip(shown, colors, strict=True)
    ]
    panels = [
        Panel(x_label="", y_label="curvature x R", lines=curvature),
        Panel(x_label="" if hold else "from the root, m", y_label="tension, N", lines=tension),
    ]
    if hold:
        length = case.rib.element_length
        at = length * (np.arange(case.rib.elements) + 0.5)
        pressure = (
            variables.group_of(run, "contact-1")["point_force"].values[-1].reshape(at.size, -1).sum(axis=1) / length
        )
        pressures, T, strip = [Line(x=at, y=pressure, color=0, width=THIN)], _resting_torque(case), case.strip
        if T is not None:
            pull = reference.wound_tension(strip, T, arc)
            stretched = 1.0 + pull / reference.axial_stiffness_at(strip, arc)
            curvature.append(_dashed(arc, stretched, label="closed form"))
            tension.append(_dashed(arc, pull))
            pressures.append(_dashed(arc, reference.wound_pressure(strip, T, arc)))
        panels.append(Panel(x_label="from the root, m", y_label="pressure on the hub, N/m", lines=pressures))
    return Figure(name="along", title="Along the rib", panels=panels, size=(8.0, 2.9 * len(panels)))


def _energy_figure(root: xr.Dataset) -> Figure:
    """Energies, what takes them, and how well the account closes."""
    time = root.time.values
    largest = max(float(root[name].max()) for name in ("energy_kinetic", "energy_elastic", "work_external"))
    scale, unit = (1.0, "J") if largest > 1.0 else (1e3, "mJ") if largest > 1e-3 else (1e6, "µJ")

    def lines(columns: list[tuple[str, np.ndarray, int]], *, least: float = -np.inf) -> list[Line]:
        return [
            Line(x=time, y=np.where(y > least, scale * y, np.nan), label=str(label), color=color, width=THIN)
            for label, y, color in columns
            if np.any(y)
        ]

    def kinds(**colors: int) -> list[tuple[str, np.ndarray, int]]:
        return [(kind, root[f"energy_{kind}"].values, color) for kind, color in colors.items()]

    whole = lines(kinds(kinetic=1, elastic=6))
    whole.append(Line(x=time, y=scale * root.work_external.values, label="work from outside", color=0))
    panels = [Panel(x_label="", y_label=f"energy, {unit}", lines=whole)]
    stored = lines(kinds(membrane=2, bending=3, contact=4), least=STORED_SHOWN * largest)
    if stored:
        panels.append(Panel(x_label="", y_label=f"energy stored, {unit}", lines=stored, log=True))
    taken = lines([(name, root.energy_dissipated.values[:, k], k + 1) for k, name in enumerate(root.cause.values)])
    if taken:
        panels.append(Panel(x_label="", y_label=f"taken, {unit}", lines=taken))
    balance = np.abs(root.energy_balance.values)
    if np.any(balance > 0.0):
        defect = [Line(x=time, y=np.where(balance > 0.0, balance, np.nan), width=1.0)]
        panels.append(Panel(x_label="", y_label="relative defect", lines=defect, title="what it lacks", log=True))
    panels[-1] = dataclasses.replace(panels[-1], x_label="time, s")
    return Figure(name="energy", title="Energy account", panels=panels, size=(8.0, 2.9 * len(panels)))


def _hub_figure(root: xr.Dataset, case: Case) -> Figure:
    """Torque of the ribs on the hub about its axis, and how the hub turns."""
    time = root.time.values
    curves = {"torque on the hub, N m": [Line(x=time, y=root.hub_torque.values, width=1.0)]}
    if case.hub.motion != "fixed":
        momentum = root.angular_momentum.values
        curves["hub turned, deg"] = [Line(x=time, y=np.degrees(root.hub_angle.values))]
        curves["angular momentum, kg m2/s"] = [
            Line(x=time, y=momentum[:, c], label="xyz"[c], color=c + 1) for c in range(3)
        ]
    panels = [Panel(x_label="time, s", y_label=label, lines=lines) for label, lines in curves.items()]
    return Figure(name="hub", title="Hub", panels=panels, size=(8.0, 3.2 * len(panels)))


# ------------------------------------------------------------------------------------------------ motion


def motion(run: xr.DataTree) -> Motion | None:
    """Ribs, coloured by tension or, in phase deploy, by curvature first; the forces on them, and the hub."""
    from evolvent.drawing import between_places, motion_of

    root, case = _opened(run)
    found = motion_of(run, title=f"{PHASES[case.phase]} of the rib")
    if found is None:
        return None
    numbers = {
        "tip speed [m/s]": root.tip_speed.values[:, 0],
        "wound [turns]": root.wrap_angle.values[:, 0] / (2.0 * np.pi),
        "contact force [N]": root.contact_force.values[:, 0],
    }
    colours = {"tension [N]": root.tension.values, "curvature [1/m]": root.curvature.values}
    order = sorted(colours, reverse=case.phase != "deploy")
    lines, arc = [], root.arc.values
    for b, line in enumerate(found.lines):
        at = np.linspace(0.0, arc[-1], line.points.shape[1])
        lines.append(
            dataclasses.replace(line, values={name: between_places(colours[name][:, b], arc, at) for name in order})
        )
    return dataclasses.replace(found, lines=lines, numbers=numbers)
