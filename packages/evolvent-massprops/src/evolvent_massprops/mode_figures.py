"""Figures of signals and of the modes identified in them: of `evolvent identify`, and of systems that identify."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evolvent_base.figures import Figure, Line, Panel, spectrum, stacked
from evolvent_base.signals.times import read_times
from evolvent_massprops.identification import IdentifiedModes

Array = np.ndarray
#: Most sensors that are drawn.
MOST = 4
#: Least length of the axis of a difference, of the largest value: it is drawn over ±1 % or more.
LEAST_SCALE = 0.02


def figures(modes: IdentifiedModes, unit: str) -> list[Figure]:
    """Signals with the sum of the modes, their spectra, and the amplitudes at the sensors.

    Parameters
    ----------
    modes : evolvent_massprops.identification.IdentifiedModes
    unit : str, of the sensors
    """
    read = np.where(np.isfinite(modes.data), modes.data, modes.fitted)
    titles = [f"{w:.5g} rad/s" for w in modes.frequency]
    return [
        signals(modes.time, modes.data, modes.fitted, modes.names, unit=unit),
        spectra(*_even(modes, read), modes.names, modes.frequency, unit=unit),
        amplitudes(modes.names, modes.mode_shapes().real, titles, unit=unit),
    ]


def _even(modes: IdentifiedModes, read: Array) -> tuple[Array, Array]:
    """Times and signals on an even grid: what the modes leave is interpolated, if the times are uneven."""
    times = read_times(modes.time)
    if times.even:
        return modes.time, read
    time = times.step * np.arange(int(modes.time[-1] / times.step) + 1)
    left = [np.interp(time, modes.time, column) for column in (read - modes.fitted).T]
    return time, modes.predict(time) + np.column_stack(left)


def signals(time: Array, read: Array, fitted: Array | None, names: Sequence[str], *, unit: str) -> Figure:
    """Signals (nt, c), the sum of the modes identified in them, and what it leaves; without the last two for None."""
    panels, columns = [], 1 if fitted is None else 2
    for k, name in enumerate(names[:MOST]):
        lines = [Line(x=time, y=read[:, k], label="signal", width=1.0)]
        if fitted is not None:
            lines = [Line(x=time, y=read[:, k], label="signal", color="0.7", width=2.4)]
            lines.append(Line(x=time, y=fitted[:, k], label="sum of the modes", width=0.8))
        panels.append(Panel(x_label="time, s", y_label=f"signal, {unit}", lines=lines, title=name))
        if fitted is not None:
            left = [Line(x=time, y=read[:, k] - fitted[:, k], color=1, width=0.8)]
            span = LEAST_SCALE * float(np.nanmax(np.abs(read[:, k]), initial=0.0))
            label = f"signal minus modes, {unit}"
            panels.append(Panel(x_label="time, s", y_label=label, lines=left, title=name, y_span=span))
    height = stacked(min(len(names), MOST))
    return Figure(name="signals", title="Signals and identified modes", panels=panels, columns=columns, height=height)


def spectra(time: Array, read: Array, names: Sequence[str], frequency: Array, *, unit: str) -> Figure:
    """Amplitude spectra of signals (nt, c), with the identified frequencies (rad/s)."""
    lines = [Line(x=time, y=read[:, k], label=name, color=k) for k, name in enumerate(names[:MOST])]
    return spectrum(lines, unit=unit, marks=frequency.tolist(), title="Spectra of the signals")


def amplitudes(
    names: Sequence[str], amplitude: Array, titles: Sequence[str], *, unit: str, model: Array | None = None
) -> Figure:
    """Signed amplitudes (m, c) of the modes at the sensors, beside those of a model (NaN for none)."""
    sensor, panels = np.arange(float(len(names))), []
    x_names = dict(zip(sensor.tolist(), (name.removeprefix("sensor ") for name in names), strict=True))
    zero = Line(x=np.array([-0.5, len(names) - 0.5]), y=np.zeros(2), color="gray", width=0.8)
    for k, title in enumerate(titles):
        lines = [Line(x=sensor, y=amplitude[k], label="identified", style="", marker="o")]
        if model is not None and np.all(np.isfinite(model[k])):
            lines.append(Line(x=sensor, y=model[k], label="linear model", color=2, style="", marker="+"))
        label = f"amplitude at $t = 0$, {unit}"
        panels.append(Panel(x_label="sensor", x_names=x_names, y_label=label, lines=[*lines, zero], title=title))
    columns = min(len(panels), 3)
    height = stacked(-(-len(panels) // 3))
    return Figure(name="mode_shapes", title="Amplitudes of the modes", panels=panels, columns=columns, height=height)
