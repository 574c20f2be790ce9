"""What to show of a run: numbers and figures."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from evolvent import cases
from evolvent.figures import Figure, Line, Number, Panel
from evolvent.systems.wrapped_rib import reference
from evolvent.systems.wrapped_rib.advice import locking
from evolvent.systems.wrapped_rib.case import Case

if TYPE_CHECKING:
    import xarray as xr

#: Share of a run over which contact forces are averaged, since single samples depend on the mesh.
WINDOW = 0.04
#: Work of bending, of that of the torque, above which a light string is no measure of a rib.
LIGHT = 0.1
#: Smallest stored energy that is drawn, of the largest energy: less is round-off.
STORED_SHOWN = 1e-10
#: Shapes that are drawn of a run.
SHAPES = 9


def case_of(run: xr.Dataset) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


# ------------------------------------------------------------------------------------------------ numbers


def numbers(run: xr.Dataset) -> list[Number]:
    """The results that a user wants to see at once; of several ribs, those of the first."""
    from evolvent.results import closing_numbers, statistics_of

    case = case_of(run)
    time, strip = run.time.values, case.strip
    found = [Number(label="time reached", value=f"{time[-1]:.6g} s"), _wound(run, strip)]
    found += {"wind": _of_winding, "hold": _of_holding, "deploy": _of_deployment}[case.phase](run, case)
    force, impulse = run.contact_force.values[:, 0], run.contact_impulse.values[:, 0]
    if np.any(force > 0.0):
        found += [
            Number(label="impulse of the contact", value=f"{impulse[-1]:.4g} N s"),
            Number(
                label="largest contact force, one sample", value=f"{_peak(time, force, 'N')} (it depends on the mesh)"
            ),
        ]
    if case.contact.self:
        pressed = f"{run.turn_force.values[-1, 0]:.4g} N at {run.turn_points.values[-1, 0]:.0f} contact points"
        found.append(Number(label="turns on one another at the end", value=pressed))
    if np.any(run.hub_torque.values):
        found.append(Number(label="torque on the hub at the end", value=f"{run.hub_torque.values[-1]:.4g} N m"))
    if case.hub.motion != "fixed":
        turned = math.degrees(float(run.hub_angle.values[-1] - run.hub_angle.values[0]))
        found.append(Number(label="hub turned by", value=f"{turned:.5g} deg"))
    found += _energy_numbers(run)
    if case.hub.motion in ("free", "spin") and case.drive is None and case.damping.alpha == 0.0:
        found += _momentum_numbers(run, free=case.hub.motion == "free")
    found.append(Number(label="bending stiffness of the mesh, over the rib's", value=f"{locking(case)[0]:.4g}"))
    penalty = statistics_of(run).get("penalty_stiffness")
    if penalty:
        found.append(Number(label="roots held by penalties of", value=f"{penalty:.4g} N/m, in place of joints"))
    return found + closing_numbers(run)


def _peak(time: np.ndarray, values: np.ndarray, unit: str) -> str:
    k = int(np.argmax(values))
    return f"{values[k]:.4g} {unit} at {time[k]:.5g} s"


def _wound(run: xr.Dataset, strip: reference.Strip) -> Number:
    angle = float(run.wrap_angle.values[-1, 0])
    turns, share = abs(angle) / (2.0 * math.pi), 100.0 * abs(angle) * strip.radius / strip.length
    sense = ", the other way round" if angle < 0.0 else ""
    return Number(label="wound at the end", value=f"{turns:.4g} turns, {share:.4g} % of the rib{sense}")


def _of_winding(run: xr.Dataset, case: Case) -> list[Number]:
    """When the tip is fastest, beside the light string; all wound, its speed grows with the mesh, as l^(-1/2)."""
    string = comparable_string(case)
    wound = string is not None and string.end_time < run.time.values[-1]
    if "tip_speed_peak" in run:
        peak = f"{float(run.tip_speed_peak[0]):.4g} m/s at {float(run.tip_speed_peak_time[0]):.5g} s"
    else:
        peak = _peak(run.time.values, run.tip_speed.values[:, 0], "m/s")
    peak += " (the time converges, the speed does not)" if wound else ""
    found = [Number(label="largest tip speed", value=peak)]
    if string is not None and math.isfinite(string.end_time):
        found.append(Number(label="a light string is 98 % wound at", value=f"{string.end_time:.5g} s"))
    elif _bends_the_tail(case) and estimating_string(case) is not None:
        told = "no comparison, for damping.alpha on chosen elements bends its tail"
        found.append(Number(label="a light string", value=told))
    return found


def _of_holding(run: xr.Dataset, case: Case) -> list[Number]:
    """The rest on the hub, beside its closed form."""
    late = run.time.values >= (1.0 - WINDOW) * run.time.values[-1]
    text = f"{run.contact_force.values[late, 0].mean():.5g} N"
    torque = _resting_torque(case)
    if torque is not None:
        closed = "T L / 2 R2 =" if case.strip.taper == 1.0 else "closed form"
        text += f" ({closed} {reference.wound_contact_force(case.strip, torque):.5g})"
    middle = _middle(run)
    bent = case.hub.radius * run.curvature.values[-1, 0, middle]
    return [
        Number(label=f"contact force, mean of the last {100.0 * WINDOW:g} %", value=text),
        Number(label="curvature x R, away from the ends", value=f"{bent.mean():.5g} ± {bent.std():.2g}"),
    ]


def _of_deployment(run: xr.Dataset, case: Case) -> list[Number]:
    """The tip's place and speed beside the closed form."""
    time = run.time.values
    radius = f"{float(run.tip_radius.values[-1, 0]):.5g} m"
    late = time >= 0.5 * time[-1]
    speed = f"{run.tip_speed.values[late, 0].mean():.4g} m/s"
    if comparable_release(case):
        radius += f" (closed form {float(reference.deployed_tip_radius(case.strip, time[-1])):.5g})"
        speed += f" (closed form {reference.deployment_speed(case.strip):.4g})"
    found = [Number(label="tip radius at the end", value=radius)]
    found.append(Number(label="tip speed, mean of the second half", value=speed))
    if comparable_release(case):
        end = reference.deployment_time(case.strip)
        found.append(Number(label="closed form unwinds all in", value=f"{end:.5g} s"))
    return found


def _energy_numbers(run: xr.Dataset) -> list[Number]:
    taken = run.energy_dissipated.values[-1]
    largest = float(np.abs(taken).max())
    causes = [
        f"{name} {value:.3g}"
        for name, value in zip(run.cause.values, taken, strict=True)
        if abs(value) > 1e-6 * largest > 0.0
    ]
    kinds = ", ".join(
        f"{name} {float(run[f'energy_{name}'].values[-1]):.3g}"
        for name in ("kinetic", "membrane", "bending", "contact")
    )
    found = [Number(label="energy at the end", value=f"{kinds} J")]
    if causes:
        found.append(Number(label="energy taken by", value=f"{', '.join(causes)} J"))
    balance = float(np.abs(run.energy_balance.values).max())
    found.append(Number(label="energy balance", value=f"{balance:.2g} of the largest energy"))
    return found


def _momentum_numbers(run: xr.Dataset, *, free: bool) -> list[Number]:
    def drift(name: str, unit: str, axes: slice) -> Number:
        values = run[name].values[:, axes]
        label = f"drift of {name.replace('_', ' ')}"
        return Number(label=label, value=f"{np.abs(values - values[0]).max():.2g} {unit}")

    found = [drift("angular_momentum", "kg m2/s", slice(0, 3) if free else slice(2, 3))]
    return [*found, drift("linear_momentum", "kg m/s", slice(0, 3))] if free else found


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
    if case.hub.motion != "fixed" or drive.ramp > 0.0:
        return None
    return reference.string_winding(
        case.strip,
        drive.torque,
        case.damping.alpha,
        damped=case.damped_arcs,
        start_angle=case.rib.start_angle,
    )


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


def _middle(run: xr.Dataset) -> np.ndarray:
    """Points away from both ends of a rib: a mask over its points."""
    arc = run.arc.values
    inside: np.ndarray = (arc > 0.1 * arc[-1]) & (arc < 0.9 * arc[-1])
    return inside


# ------------------------------------------------------------------------------------------------ figures


def figures(run: xr.Dataset) -> list[Figure]:
    """What to draw of a run; nothing of one with fewer than three samples."""
    if run.sizes["time"] < 3:
        return []
    case = case_of(run)
    found = [_shape_figure(run, case), _tip_figure(run, case)]
    if np.any(run.contact_force.values > 0.0):
        found += [_points_figure(run, case), _force_figure(run, case)]
    found.append(_along_figure(run, case))
    found.append(_energy_figure(run))
    if case.hub.motion != "fixed" or np.any(run.hub_torque.values):
        found.append(_hub_figure(run, case))
    return found


def _label(run: xr.Dataset, k: int) -> str:
    return f"rib {k + 1}" if run.sizes["rib"] > 1 else ""


def _color(b: int) -> int:
    """Place in the palette of the line of rib b; the third is for what a run is judged by."""
    return (0, 1, 3, 4, 5, 6)[b % 6]


def _moments(run: xr.Dataset, case: Case) -> list[int]:
    """Samples at which shapes are drawn: evenly spread over what the tip does, not over time."""
    along = np.abs(np.diff(run.wrap_angle.values[:, 0], prepend=run.wrap_angle.values[0, 0])).cumsum()
    along = along / along[-1] if along[-1] > 0.0 else np.zeros_like(along)
    time = run.time.values
    mixed = along + 0.5 * (time - time[0]) / (time[-1] - time[0])
    return sorted({int(np.searchsorted(mixed, x)) for x in np.linspace(mixed[0], mixed[-1], SHAPES)})


def _dashed(x: np.ndarray, y: np.ndarray, label: str = "") -> Line:
    """What a run is to be judged by."""
    return Line(x=x, y=y, label=label, color=2, style="--", width=1.2)


def _circle(case: Case) -> Line:
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    R = case.hub.radius
    return Line(x=R * np.cos(around), y=R * np.sin(around), color="gray", width=1.0)


def _shape_figure(run: xr.Dataset, case: Case) -> Figure:
    """Shapes round the hub at several times (Yi, figure 6): the whole, and what is near the hub."""
    time = run.time.values
    whole: list[Line] = [_circle(case)]
    moments = _moments(run, case)
    hub = run.hub_position.values if "hub_position" in run else np.zeros((time.size, 3))
    for count, k in enumerate(moments):
        color = count / len(moments)
        for b in range(run.sizes["rib"]):
            x = run.position.values[k, b] - hub[k]
            label = f"{time[k]:.4g} s" if b == 0 else ""
            whole.append(Line(x=x[:, 0], y=x[:, 1], label=label, color=color, width=1.2))
    title = "along the hub's axis" if "hub_position" not in run else "along the hub's first axis, from its middle"
    panels = [Panel(x_label="x, m", y_label="y, m", lines=whole, title=title, equal=True)]
    R = case.hub.radius
    near = [whole[0]]
    for line in whole[1:]:
        inside = np.hypot(line.x, line.y) < 2.0 * R
        near.append(
            Line(
                x=np.where(inside, line.x, np.nan),
                y=np.where(inside, line.y, np.nan),
                color=line.color,
                width=1.2,
                marker=".",
            )
        )
    panels.append(Panel(x_label="x, m", y_label="y, m", lines=near, title="near the hub", equal=True))
    return Figure(name="shape", title="Shape of the rib", panels=panels, columns=2, size=(12.0, 5.2))


def _tip_figure(run: xr.Dataset, case: Case) -> Figure:
    """Speed and place of the tip (Yi, figure 7), beside the light string or the closed form."""
    time = run.time.values
    speed = [
        Line(x=time, y=run.tip_speed.values[:, b], label=_label(run, b), color=_color(b))
        for b in range(run.sizes["rib"])
    ]
    radius = [Line(x=time, y=run.tip_radius.values[:, b], color=_color(b)) for b in range(run.sizes["rib"])]
    turns = [
        Line(x=time, y=run.wrap_angle.values[:, b] / (2 * np.pi), color=_color(b)) for b in range(run.sizes["rib"])
    ]
    string = comparable_string(case) if case.phase == "wind" else None
    if string is not None:
        kept = string.time <= time[-1]
        at = string.time[kept]
        speed.append(_dashed(x=at, y=string.tip_speed[kept], label="light string"))
        tail = case.strip.length - case.strip.radius * string.wrap
        root = case.strip.radius
        place = np.sqrt(root**2 + tail**2 + 2.0 * root * tail * np.cos(string.swing))
        radius.append(_dashed(x=at, y=place[kept]))
        turns.append(_dashed(x=at, y=string.wrap[kept] / (2 * np.pi)))
    if comparable_release(case):
        strip = case.strip
        closed = reference.deployed_length(strip, time)
        end = min(float(time[-1]), reference.deployment_time(strip))
        v = reference.deployment_speed(strip)
        speed.append(_dashed(x=np.array([time[0], end]), y=np.array([v, v]), label="closed form"))
        radius.append(_dashed(x=time, y=reference.deployed_tip_radius(strip, time)))
        turns.append(_dashed(x=time, y=(strip.length - closed) / (2 * np.pi * strip.radius)))
    if "tip_speed_peak" in run and float(run.tip_speed_peak[0]) > 1.01 * float(run.tip_speed[:, 0].max()):
        at, most = run.tip_speed_peak_time.values, run.tip_speed_peak.values
        for b in range(run.sizes["rib"]):
            label = "largest, between samples" if b == 0 else ""
            speed.append(Line(x=at[b : b + 1], y=most[b : b + 1], label=label, color=_color(b), style="", marker="o"))
    panels = [
        Panel(x_label="", y_label="tip speed, m/s", lines=speed, y_zero=True),
        Panel(x_label="", y_label="tip from the axis, m", lines=radius, y_zero=True),
        Panel(x_label="time, s", y_label="wound, turns", lines=turns, y_zero=True),
    ]
    return Figure(name="tip", title="Motion of the tip", panels=panels, size=(8.0, 8.0))


def _points_figure(run: xr.Dataset, case: Case) -> Figure:
    """Number of contact points in contact (Yi, figure 8)."""
    time = run.time.values
    lines = [
        Line(x=time, y=run.contact_points.values[:, b], label=_label(run, b), color=_color(b), width=1.0)
        for b in range(run.sizes["rib"])
    ]
    every = case.rib.elements * case.contact.points
    title = f"of {every} on each rib"
    panel = Panel(x_label="time, s", y_label="contact points in contact", lines=lines, title=title, y_zero=True)
    return Figure(name="contact_points", title="Contact with the hub", panels=[panel], size=(8.0, 4.0))


def running_mean(time: np.ndarray, values: np.ndarray, window: float) -> np.ndarray:
    """Mean of `values` over the time `window` about every sample, shorter at both ends."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (values[1:] + values[:-1]))])
    return mean_of_integral(time, total, window)


def mean_of_integral(time: np.ndarray, total: np.ndarray, window: float) -> np.ndarray:
    """The same of what has the integral `total`: of a force, its impulse, which knows what lies between samples."""
    low, high = np.maximum(time - 0.5 * window, time[0]), np.minimum(time + 0.5 * window, time[-1])
    mean: np.ndarray = (np.interp(high, time, total) - np.interp(low, time, total)) / (high - low)
    return mean


def _force_figure(run: xr.Dataset, case: Case) -> Figure:
    """Sum of the normal forces on the hub with a running mean, and its impulse (Yi, figure 9)."""
    time = run.time.values
    window = WINDOW * float(time[-1] - time[0])
    force, impulse = [], []
    for b in range(run.sizes["rib"]):
        values = run.contact_force.values[:, b]
        if run.sizes["rib"] == 1:
            force.append(Line(x=time, y=values, label="samples", color=6, width=0.7))
        else:
            force.append(Line(x=time, y=values, color=_color(b), style=":", width=0.7))
        mean = mean_of_integral(time, run.contact_impulse.values[:, b], window)
        label = f"mean of {window:.3g} s {_label(run, b)}".strip()
        force.append(Line(x=time, y=mean, label=label, color=_color(b)))
        impulse.append(Line(x=time, y=run.contact_impulse.values[:, b], color=_color(b)))
    torque = _resting_torque(case)
    if torque is not None:
        held = reference.wound_contact_force(case.strip, torque)
        label = "at rest, wound: T L / 2 R2" if case.strip.taper == 1.0 else "at rest, wound"
        ends = np.array([time[0], time[-1]])
        force.append(Line(x=ends, y=np.array([held, held]), label=label, color=2, style="--", width=1.2))
    title = "single samples depend on the mesh and on the contact's stiffness; means and impulses do not"
    panels = [
        Panel(x_label="", y_label="contact force, N", lines=force, title=title, y_zero=True),
        Panel(x_label="time, s", y_label="impulse, N s", lines=impulse, y_zero=True),
    ]
    return Figure(name="contact_force", title="Force of the contact with the hub", panels=panels, size=(8.0, 7.0))


def _along_figure(run: xr.Dataset, case: Case) -> Figure:
    """Curvature, tension and pressure along the first rib at several times; in phase hold, beside the closed form."""
    time, arc, R = run.time.values, run.arc.values, case.hub.radius
    curvature, tension, pressure = [], [], []
    shown = _moments(run, case) if case.phase != "hold" else [run.sizes["time"] - 1]
    for count, k in enumerate(shown):
        color: int | float = count / len(shown) if case.phase != "hold" else 0
        label = f"{time[k]:.4g} s"
        curvature.append(Line(x=arc, y=R * run.curvature.values[k, 0], label=label, color=color, width=1.2))
        tension.append(Line(x=arc, y=run.tension.values[k, 0], color=color, width=1.2))
        at, values = _pressure(run, k)
        pressure.append(Line(x=at, y=values, color=color, width=1.2))
    T, strip = _resting_torque(case), case.strip
    if case.phase == "hold" and T is not None:
        stretched = 1.0 + reference.wound_tension(strip, T, arc) / reference.axial_stiffness_at(strip, arc)
        curvature.append(_dashed(x=arc, y=stretched, label="closed form"))
        tension.append(_dashed(x=arc, y=reference.wound_tension(strip, T, arc)))
        pressure.append(_dashed(x=arc, y=reference.wound_pressure(strip, T, arc)))
    panels = [
        Panel(x_label="", y_label="curvature x R", lines=curvature),
        Panel(x_label="from the root, m", y_label="tension, N", lines=tension),
    ]
    if case.phase == "hold":
        label = "pressure on the hub, N/m"
        panels[-1] = Panel(x_label="", y_label="tension, N", lines=tension)
        panels.append(Panel(x_label="from the root, m", y_label=label, lines=pressure))
    return Figure(name="along", title="Along the rib", panels=panels, size=(8.0, 2.9 * len(panels)))


def _pressure(run: xr.Dataset, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Places along the first rib and the force on the hub per length there, N/m; tension times curvature if need be."""
    if "contact_pressure" in run:
        values = run.contact_pressure.values[k, 0]
        length = run.arc.values[-1] / values.size
        return length * (np.arange(values.size) + 0.5), values
    return run.arc.values, run.tension.values[k, 0] * run.curvature.values[k, 0]


def _energy_figure(run: xr.Dataset) -> Figure:
    """Energies, what takes them, and how well the account closes."""
    time = run.time.values
    largest = max(float(run.energy_kinetic.max()), float(run.energy_elastic.max()), float(run.work_external.max()))
    scale, unit = (1.0, "J") if largest > 1.0 else (1e3, "mJ") if largest > 1e-3 else (1e6, "µJ")

    def lines(*names: tuple[str, int], log: bool) -> list[Line]:
        found = []
        for name, color in names:
            values = scale * run[f"energy_{name}"].values
            y = np.where(values > STORED_SHOWN * scale * largest, values, np.nan) if log else values
            if np.any(values):
                found.append(Line(x=time, y=y, label=name, color=color, width=1.2))
        return found

    whole = lines(("kinetic", 1), ("elastic", 6), log=False)
    whole.append(Line(x=time, y=scale * run.work_external.values, label="work from outside", color=0))
    panels = [Panel(x_label="", y_label=f"energy, {unit}", lines=whole)]
    stored = lines(("membrane", 2), ("bending", 3), ("contact", 4), log=True)
    if stored:
        panels.append(Panel(x_label="", y_label=f"energy stored, {unit}", lines=stored, log=True))
    taken = []
    for k, name in enumerate(run.cause.values):
        values = run.energy_dissipated.values[:, k]
        if np.any(values):
            taken.append(Line(x=time, y=scale * values, label=str(name), color=k + 1, width=1.2))
    balance = np.abs(run.energy_balance.values)
    defect = [Line(x=time, y=np.where(balance > 0.0, balance, np.nan), width=1.0)]
    if taken:
        panels.append(Panel(x_label="", y_label=f"taken, {unit}", lines=taken))
    if np.any(balance > 0.0):
        panels.append(Panel(x_label="", y_label="relative defect", lines=defect, title="what it lacks", log=True))
    panels[-1] = dataclasses.replace(panels[-1], x_label="time, s")
    return Figure(name="energy", title="Energy account", panels=panels, size=(8.0, 2.9 * len(panels)))


def _hub_figure(run: xr.Dataset, case: Case) -> Figure:
    """Torque of the ribs on the hub about its axis, and how the hub turns."""
    time = run.time.values
    lines = [Line(x=time, y=run.hub_torque.values, width=1.0)]
    panels = [Panel(x_label="time, s", y_label="torque on the hub, N m", lines=lines)]
    if case.hub.motion != "fixed":
        angle = np.degrees(run.hub_angle.values)
        momentum = [Line(x=time, y=run.angular_momentum.values[:, c], label="xyz"[c], color=c + 1) for c in range(3)]
        panels.append(Panel(x_label="time, s", y_label="hub turned, deg", lines=[Line(x=time, y=angle)]))
        panels.append(Panel(x_label="time, s", y_label="angular momentum, kg m2/s", lines=momentum))
    return Figure(name="hub", title="Hub", panels=panels, size=(8.0, 3.2 * len(panels)))


# ------------------------------------------------------------------------------------------------ forces


def element_forces(run: xr.Dataset, away: np.ndarray) -> dict[str, np.ndarray]:
    """Forces on each element, what pushes -> (nt, ribs, ne, 3) N: its pressures times its length, along `away`.

    Parameters
    ----------
    away : (nt, ribs, ne, 3) float, from the hub's axis to the middle of each element
    """
    out = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-300)
    length = case_of(run).rib.element_length
    below = {"contact_pressure": "the hub", "turn_pressure": "the turn below"}
    return {what: length * run[name].values[..., None] * out for name, what in below.items() if name in run}
