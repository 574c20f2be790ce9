"""What to show of a run: numbers, figures, motion."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, show
from evolvent.figures import Figure, Line, Number, Panel
from evolvent.systems.inertia_stand.case import Case

if TYPE_CHECKING:
    from evolvent.motion import Motion

#: Largest displacement in pictures, of the stand's half length; the true one would not be seen.
SHOWN = 0.12


def case_of(run: Any) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


def numbers(run: Any) -> list[Number]:
    """The results that a user wants to see at once."""
    from evolvent.results import closing_numbers

    case = case_of(run)
    found = []
    for k in range(run.sizes["mode"]):
        frequency, std = float(run.mode_frequency[k]), float(run.mode_frequency_std[k])
        if not np.isfinite(frequency):
            continue
        linear = float(run.mode_frequency_linear[k])
        near = int(np.argmin(np.abs(run.linear_frequency.values - linear))) if np.isfinite(linear) else -1
        what = str(run.linear_kind.values[near]) if near >= 0 else "no mode of the linear model"
        text = f"{frequency:.7g} rad/s"
        if np.isfinite(std):
            text += f" ± {std:.2g}"
        if near >= 0:
            text += f" (linear {linear:.7g})"
        energy = float(run.mode_energy[k])
        text += f", {energy:.4g} J" if np.isfinite(energy) else ""
        found.append(Number(label=f"mode {k + 1}, {what}", value=text))
    if np.any(np.isfinite(energies := run.mode_energy.values)):
        found.append(Number(label="sum of the modes' energies", value=f"{float(np.nansum(energies)):.5g} J"))
    for name, true, value, std in zip(
        run.component.values,
        run.inertia_true.values,
        run.inertia_identified.values,
        run.inertia_std.values,
        strict=True,
    ):
        if not np.isfinite(value):
            continue
        scale = true if true != 0.0 else float(np.max(run.inertia_true.values))
        text = f"{value:.8g} kg m2"
        if np.isfinite(std):
            text += f" ± {std:.2g}"
        of = "" if true != 0.0 else " of the largest moment"
        text += f"; true {true:.8g}, error {100.0 * (value - true) / scale:+.2g} %{of}"
        found.append(Number(label=f"I{name} identified", value=text))
    more = (
        ("mass", case.body.mass, "kg"),
        ("offset_x", case.body.offset_x, "m"),
        ("offset_z", case.body.offset_z, "m"),
    )
    for name, true, unit in (*more, ("height", case.body.height, "m")):
        value = float(run[f"{name}_identified"])
        if np.isfinite(value):
            label = f"{name.replace('_', ' ')} identified"
            found.append(Number(label=label, value=f"{value:.7g} {unit}; true {true:.7g}"))
    found.append(Number(label="tilt at rest", value=f"{np.degrees(float(run.static_tilt)):.4g} deg"))
    balance = float(np.abs(run.energy_defect.values).max()) / _largest(run)
    found.append(Number(label="energy balance", value=f"{balance:.2g} of the largest energy"))
    return found + closing_numbers(run)


def _largest(run: Any) -> float:
    """Largest kinetic energy, or potential energy above that at rest, J."""
    return max(float(run.energy_kinetic.max()), float(run.energy_potential.max()), 1e-300)


def figures(run: Any) -> list[Figure]:
    """What to draw of a run; nothing of one with a single sample."""
    if run.sizes["time"] < 3:
        return []
    return [_signals(run), _spectrum(run), _shapes(run), _inertia(run), _motion(run), _balance(run)]


def _signals(run: Any) -> Figure:
    """Signals of up to four sensors, and what the identified modes leave of them."""
    time = run.time.values
    shown = range(min(run.sizes["sensor"], 4))
    panels = []
    for k in shown:
        lines = [Line(x=time, y=1e3 * run.sensor_displacement.values[:, k], label="read", width=1.0)]
        if "sensor_fitted" in run:
            lines.append(Line(x=time, y=1e3 * run.sensor_fitted.values[:, k], label="modes", color=2, style="--"))
        panels.append(Panel(x_label="time, s", y_label="displacement, mm", lines=lines, title=f"sensor {k + 1}"))
        if "sensor_fitted" in run:
            left = run.sensor_displacement.values[:, k] - run.sensor_fitted.values[:, k]
            lines = [Line(x=time, y=1e6 * left, color=1, width=0.8)]
            panels.append(Panel(x_label="time, s", y_label="read less modes, um", lines=lines, title=f"sensor {k + 1}"))
    columns = 2 if "sensor_fitted" in run else 1
    size = (6.0 * columns, 2.4 * len(shown) + 0.4)
    return Figure(name="signals", title="Signals and identified modes", panels=panels, columns=columns, size=size)


def _spectrum(run: Any) -> Figure:
    """Amplitude spectra with the identified frequencies."""
    x = run.sensor_displacement.values
    window = np.hanning(len(x))[:, None]
    step = float(run.time[1] - run.time[0])
    size = 4 * len(x)
    amplitude = 2.0 * np.abs(np.fft.rfft((x - x.mean(axis=0)) * window, size, axis=0)) / window.sum()
    omega = 2.0 * np.pi * np.fft.rfftfreq(size, step)
    lines = [
        Line(x=omega, y=1e3 * amplitude[:, k], label=f"sensor {k + 1}", color=k, width=1.0)
        for k in range(min(x.shape[1], 4))
    ]
    low, high = 1e3 * max(float(amplitude.min()), 1e-6 * float(amplitude.max())), 2e3 * float(amplitude.max())
    for k, frequency in enumerate(run.mode_frequency.values):
        lines.append(
            Line(
                x=np.array([frequency, frequency]), y=np.array([low, high]), color="gray", style=":",
                label="identified" if k == 0 else "",
            )
        )  # fmt: skip
    panel = Panel(x_label="angular frequency, rad/s", y_label="amplitude, mm", lines=lines, log=True)
    return Figure(name="spectrum", title="Spectra of the signals (Hann window)", panels=[panel], size=(8.0, 4.5))


def _shapes(run: Any) -> Figure:
    """Amplitude of each mode at each sensor, identified and of the linear model."""
    sensor = run.sensor.values.astype(float)
    panels = []
    for k in range(run.sizes["mode"]):
        phase = run.mode_phase.values[k]
        amplitude = run.mode_amplitude.values[k] * np.cos(phase)
        lines = [Line(x=sensor, y=1e3 * amplitude, label="identified", style="", marker="o")]
        linear = float(run.mode_frequency_linear[k])
        if np.isfinite(linear):
            near = int(np.argmin(np.abs(run.linear_frequency.values - linear)))
            sign = np.where(np.cos(phase) < 0.0, -1.0, 1.0)
            lines.append(
                Line(
                    x=sensor, y=1e3 * sign * run.linear_amplitude.values[near], label="linear model", color=2,
                    style="--",
                )
            )  # fmt: skip
        energy = float(run.mode_energy[k])
        title = f"{float(run.mode_frequency[k]):.5g} rad/s" + (f", {energy:.4g} J" if np.isfinite(energy) else "")
        panels.append(Panel(x_label="sensor", y_label="amplitude at t = 0, mm", lines=lines, title=title))
    size = (4.2 * min(len(panels), 3), 3.4 * -(-len(panels) // 3))
    return Figure(
        name="mode_shapes", title="Amplitudes of the modes", panels=panels, columns=min(len(panels), 3), size=size
    )


def _inertia(run: Any) -> Figure:
    """Error of the identified moments with their standard deviations."""
    true, value, std = (run[name].values for name in ("inertia_true", "inertia_identified", "inertia_std"))
    names = [str(c) for c in run.component.values]
    scale = np.sqrt(np.array([true[names.index(n[0] * 2)] * true[names.index(n[1] * 2)] for n in names]))
    known = np.flatnonzero(np.isfinite(value))
    lines = []
    for k in known:
        error, bar = 100.0 * (value[k] - true[k]) / scale[k], 196.0 * std[k] / scale[k]
        x = np.array([k, k], dtype=float)
        lines.append(Line(x=x[:1], y=np.array([error]), marker="o", style="", color=int(k)))
        if np.isfinite(bar):
            lines.append(Line(x=x, y=np.array([error - bar, error + bar]), color=int(k)))
    lines.append(Line(x=np.array([-0.5, 5.5]), y=np.zeros(2), color="gray", style=":"))
    panel = Panel(
        x_label="moment or product of inertia",
        x_names={k: f"I{n}" for k, n in enumerate(names)},
        y_label="identified less true, %",
        lines=lines,
        title="bars: 95 % by the signals' noise alone; products in % of the geometric mean of their moments",
    )
    return Figure(name="inertia", title="Identified moments of inertia", panels=[panel], size=(8.0, 4.0))


def _motion(run: Any) -> Figure:
    """Motion of the centre of mass, small rotations, forces of the springs."""
    time = run.time.values
    turned = 2e3 * run["rotation"].values[:, 1:]
    names = ("x", "y", "z")
    panels = [
        Panel(
            x_label="time, s",
            y_label="displacement, mm",
            lines=[Line(x=time, y=1e3 * run.displacement.values[:, k], label=n, color=k) for k, n in enumerate(names)],
            title="centre of mass, from its rest",
        ),
        Panel(
            x_label="time, s",
            y_label="rotation, mrad",
            lines=[Line(x=time, y=turned[:, k], label=f"about {n}", color=k) for k, n in enumerate(names)],
        ),
        Panel(
            x_label="time, s",
            y_label="force, kN",
            lines=[
                Line(x=time, y=1e-3 * run[f"spring-{k + 1}"].force.values, label=f"spring {k + 1}", color=k)
                for k in range(min(run.sizes["spring"], 6))
            ],
        ),
    ]
    return Figure(name="motion", title="Motion of the body", panels=panels, size=(8.0, 8.0))


def _balance(run: Any) -> Figure:
    """Energies and their balance."""
    time = run.time.values
    names = [
        ("energy_kinetic", "kinetic"),
        ("energy_potential", "springs and gravity"),
        ("energy_dissipated", "dissipated"),
    ]
    lines = [Line(x=time, y=run[name].values, label=label, color=k) for k, (name, label) in enumerate(names)]
    panels = [
        Panel(x_label="time, s", y_label="energy above rest, J", lines=lines),
        Panel(
            x_label="time, s",
            y_label="balance, of the largest energy",
            lines=[Line(x=time, y=run.energy_defect.values / _largest(run))],
        ),
    ]
    return Figure(name="balance", title="Energy account", panels=panels, size=(8.0, 6.0))


def motion(run: Any) -> Motion:
    """Springs from ground to body, their forces on it, and the body as a box that reaches to them; y up."""
    from evolvent.motion import Forces, Marks
    from evolvent.solids import Solid

    case, found = case_of(run), show.motion(run)
    assert found is not None
    ground, ends = (np.stack([line.points[:, k] for line in found.lines], axis=1) for k in (0, 1))
    along = (ground - ends) / np.linalg.norm(ground - ends, axis=-1, keepdims=True)
    tension = np.stack([run[line.name].force.values for line in found.lines], axis=1)
    pulls = Forces(name="force of the springs on the body", points=ends, vectors=tension[..., None] * along)
    springs = np.array(case.stand.springs)
    reach = float(np.abs(springs).max())
    margin = np.array([0.0, 0.12 * reach, 0.0])
    low, high = springs.min(axis=0) - margin, springs.max(axis=0) + margin
    box = Solid.box(high - low, centre=0.5 * (low + high) - np.array(case.body.centre))
    moved = float(np.abs(ends - ends.mean(axis=0)).max())
    return dataclasses.replace(
        found,
        title="Inertia stand",
        forces=[pulls],
        marks=[Marks(name="fixed end", points=ground)],
        frames=[dataclasses.replace(found.frames[0], solids=[box])],
        numbers={
            "kinetic energy [J]": run.energy_kinetic.values,
            "height above rest [mm]": 1e3 * run.displacement.values[:, 1],
        },
        up="y",
        magnification=float(f"{max(1.0, SHOWN * reach / moved):.1g}") if moved > 0.0 else 1.0,
    )
