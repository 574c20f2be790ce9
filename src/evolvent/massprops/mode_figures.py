"""Figures of signals and of the modes identified in them: of `evolvent identify`, and of systems that identify."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evolvent import show
from evolvent.figures import Figure, Line, Panel
from evolvent.massprops.identification import Modes

Array = np.ndarray
#: Most sensors that are drawn.
MOST = 4


def figures(modes: Modes, unit: str) -> list[Figure]:
    """Signals with the sum of the modes, their spectra, and the amplitudes at the sensors.

    Parameters
    ----------
    modes : evolvent.massprops.identification.Modes
    unit : str, of the sensors
    """
    read = np.where(np.isfinite(modes.data), modes.data, modes.fitted)
    titles = [f"{w:.5g} rad/s" for w in modes.frequency]
    return [
        signals(modes.time, modes.data, modes.fitted, modes.names, unit=unit),
        spectra(modes.time, read, modes.names, modes.frequency, unit=unit),
        amplitudes(modes.names, modes.mode_shapes().real, titles, unit=unit),
    ]


def signals(time: Array, read: Array, fitted: Array | None, names: Sequence[str], *, unit: str) -> Figure:
    """Signals (nt, c), the sum of the modes identified in them, and what it leaves; without the last two for None."""
    panels, columns = [], 1 if fitted is None else 2
    for k, name in enumerate(names[:MOST]):
        lines = [Line(x=time, y=read[:, k], label="read", width=1.0)]
        if fitted is not None:
            lines.append(Line(x=time, y=fitted[:, k], label="modes", color=2, style="--"))
        panels.append(Panel(x_label="time, s", y_label=f"signal, {unit}", lines=lines, title=name))
        if fitted is not None:
            left = [Line(x=time, y=read[:, k] - fitted[:, k], color=1, width=0.8)]
            panels.append(Panel(x_label="time, s", y_label=f"read less modes, {unit}", lines=left, title=name))
    size = (6.0 * columns, 2.4 * min(len(names), MOST) + 0.4)
    return Figure(name="signals", title="Signals and identified modes", panels=panels, columns=columns, size=size)


def spectra(time: Array, read: Array, names: Sequence[str], frequency: Array, *, unit: str) -> Figure:
    """Amplitude spectra of signals (nt, c), with the identified frequencies (rad/s)."""
    lines = [Line(x=time, y=read[:, k], label=name, color=k) for k, name in enumerate(names[:MOST])]
    return show.spectrum(lines, unit=unit, marks=frequency.tolist(), title="Spectra of the signals")


def amplitudes(
    names: Sequence[str], amplitude: Array, titles: Sequence[str], *, unit: str, model: Array | None = None
) -> Figure:
    """Signed amplitudes (m, c) of the modes at the sensors, beside those of a model (NaN for none)."""
    sensor, panels = np.arange(1.0, len(names) + 1.0), []
    for k, title in enumerate(titles):
        lines = [Line(x=sensor, y=amplitude[k], label="identified", style="", marker="o")]
        if model is not None and np.all(np.isfinite(model[k])):
            lines.append(Line(x=sensor, y=model[k], label="linear model", color=2, style="--"))
        panels.append(Panel(x_label="sensor", y_label=f"amplitude at t = 0, {unit}", lines=lines, title=title))
    columns = min(len(panels), 3)
    size = (4.2 * columns, 3.4 * -(-len(panels) // 3))
    return Figure(name="mode_shapes", title="Amplitudes of the modes", panels=panels, columns=columns, size=size)
