"""Figures of a study over the offsets of the centre of mass, on what figures 2 to 5 of Belyakov (2002) show."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent_base.figures import Figure, Line, Map, Panel, stacked

if TYPE_CHECKING:
    import xarray as xr

#: The box that the paper calls safe: 20 % of the springs' spacing to each side, as a share of half of it.
BOX = 0.4
KEYS = ("body.offset_x", "body.offset_z")
LABELS = ("offset $e_x$, m", "offset $e_z$, m")
NAMES = ("lowest", "middle", "highest")
#: Energy, J, of a contour of the map: above it noise-free signals gave the moments to 0.1 %.
LEAST = 0.3


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of a grid over both offsets, as `evolvent.design.studies.open` reads it; none for other studies."""
    if any(key not in dataset.dims for key in KEYS):
        return {}
    ordered, over = dataset.transpose(*KEYS, ...), set(KEYS)
    drawn: dict[str, tuple[Callable[[xr.Dataset], Figure], set[str]]] = {
        "energies": (_energies, {"linear_frequency", "linear_energy", "mode_energy"}),
        "amplitudes": (_amplitudes, {"mode_amplitude"}),
        "least_energy": (least_energy_map, {"least_energy"}),
        "frequencies": (_frequencies, {"mode_frequency", "mode_frequency_linear"}),
        "inertia_error": (_errors, {"inertia_identified", "inertia_true"}),
    }
    held = {str(name) for name, values in ordered.data_vars.items() if over <= set(values.dims)}
    return {name: draw(ordered) for name, (draw, needs) in drawn.items() if needs <= held}


def _name(k: int, modes: int) -> str:
    """Name of mode k, from 0, of so many."""
    return f"{NAMES[k]} mode" if modes == len(NAMES) else f"mode {k + 1}"


def _both(x: np.ndarray, found: np.ndarray, linear: np.ndarray, *, named: bool = True) -> list[Line]:
    """Lines of the identified modes (n, m), and of the linear model's."""
    lines = []
    for k, y in enumerate(found.T):
        label = f"{_name(k, found.shape[1])}, identified" * named
        lines.append(Line(x=x, y=y, style="", marker="o", color=1 + k, label=label))
    for k, y in enumerate(linear.T):
        lines.append(Line(x=x, y=y, color=1 + k, width=1.2, label="linear model" * named))
    return lines


def _along(study: xr.Dataset, axis: int) -> tuple[xr.Dataset, str]:
    """The cases along one offset at which the other is nearest to 0, and its value there."""
    other = KEYS[1 - axis]
    middle = int(np.argmin(np.abs(study[other].values)))
    return study.isel({other: middle}), f"{LABELS[1 - axis].removesuffix(', m')} = {float(study[other][middle]):.3g} m"


def _energies(study: xr.Dataset) -> Figure:
    """Energies of the modes along both offsets."""
    panels = []
    for axis in (0, 1):
        cut, title = _along(study, axis)
        x, named = cut[KEYS[axis]].values, axis == 1
        order = np.argsort(cut.linear_frequency.values, axis=1)[:, -3:]
        linear, found = np.take_along_axis(cut.linear_energy.values, order, axis=1), cut.mode_energy.values
        lines = _both(x, found, linear, named=named)
        lines.append(Line(x=x, y=np.nansum(found, axis=1), style=":", color="gray", label="sum" * named))
        panels.append(Panel(x_label=LABELS[axis], y_label="energy, J", lines=lines, title=title))
    return Figure(name="energies", title="Energies of the three modes", panels=panels, columns=2, height=84.0)


def _amplitudes(study: xr.Dataset) -> Figure:
    """Amplitude of each mode at each spring along offset_x."""
    cut, at = _along(study, 0)
    x, amplitude, panels = cut[KEYS[0]].values, 1e3 * cut.mode_amplitude.values, []
    modes = amplitude.shape[1]
    for k in range(modes):
        lines = [
            Line(x=x, y=y, marker=".", width=1.0, color=1 + c, label=f"sensor {c + 1}" if k == 0 else "")
            for c, y in enumerate(amplitude[:, k, :4].T)
        ]
        panels.append(Panel(x_label=LABELS[0], y_label="amplitude, mm", lines=lines, title=_name(k, modes)))
    height = stacked(1)
    return Figure(
        name="amplitudes", title=f"Amplitudes at the sensors, {at}", panels=panels, columns=modes, height=height
    )


def _frequencies(study: xr.Dataset) -> Figure:
    """Frequencies along offset_x (Belyakov, figure 5), and how far the identified lie from the linear model's."""
    cut, at = _along(study, 0)
    x, found, linear = (cut[name].values for name in (KEYS[0], "mode_frequency", "mode_frequency_linear"))
    ratio = 1e6 * (found / linear - 1.0)
    apart = [Line(x=x, y=y, style="", marker=".", color=1 + k) for k, y in enumerate(ratio.T)]
    panels = [
        Panel(x_label=LABELS[0], y_label="frequency, rad/s", lines=_both(x, found, linear)),
        Panel(x_label=LABELS[0], y_label="identified minus linear, ppm", lines=apart, y_span=20.0),
    ]
    return Figure(name="frequencies", title=f"Frequencies, {at}", panels=panels, columns=2, height=84.0)


def box(study: xr.Dataset) -> tuple[list[Line], np.ndarray]:
    """The paper's box as lines, and which cases lie in it."""
    content = cases.parse_yaml(study.attrs["study"], "the study")
    stand: Any = cases.load(content["case"], content.get("set") or {}).stand
    a, b = BOX * stand.half_length, BOX * stand.half_width
    x, z = np.array([-a, a, a, -a, -a]), np.array([-b, -b, b, b, -b])
    inside = np.abs(study[KEYS[0]].values)[:, None] <= a + 1e-9
    lines = [Line(x=x, y=z, color="white", width=2.2), Line(x=x, y=z, color="black", style="--", width=1.2)]
    return lines, inside & (np.abs(study[KEYS[1]].values)[None, :] <= b + 1e-9)


def _map(study: xr.Dataset, values: np.ndarray, title: str, lines: list[Line], **look: Any) -> Panel:
    drawn = Map(x=study[KEYS[0]].values, y=study[KEYS[1]].values, values=values, log=True, **look)
    return Panel(x_label=LABELS[0], y_label=LABELS[1], title=title, lines=lines, map=drawn)


def least_energy_map(study: xr.Dataset) -> Figure:
    """Least of the modes' energies over the plane (Belyakov, figure 4), with the given load and with the best one."""
    lines, inside = box(study)
    titles = {"least_energy": "as the case sets it in motion"}
    if "least_energy_best" in study:  # an initial state acts at no spring
        titles["least_energy_best"] = "loaded at the best spring for each offset"
    if "least_energy_point" in study:
        titles["least_energy_point"] = "loaded at the best point for each offset"
    top = max(float(np.nan_to_num(study[name].values).max()) for name in titles) or 1.0
    limits, contours = (min(1e-3, 1e-4 * top), top), {0.01 * top: "white", LEAST: "black"}
    label = "energy, J"
    panels = []
    for name, title in titles.items():
        values = study[name].values
        part = values[inside & np.isfinite(values)]
        text = "no case"
        if part.size:
            share = 100.0 * float(np.mean(part < 0.01 * top))
            text = f"least {part.min():.2g} J, median {np.median(part):.2g} J, below 1 % of the largest: {share:.0f} %"
        title = f"{title}\nin the box: {text}"
        panels.append(_map(study, values, title, lines, label=label, limits=limits, contours=contours))
    title = (
        "Energy of the weakest of three modes; dashed: 20 % of the spacing, "
        f"white: 1 % of the largest, black: {LEAST:g} J, grey: no run"
    )
    height = 92.0
    return Figure(name="least_energy", title=title, panels=panels, columns=len(panels), height=height)


def _errors(study: xr.Dataset) -> Figure:
    """Error of the identified moments over the plane."""
    lines, panels = box(study)[0], []
    look: dict[str, Any] = {"label": "error (grey: not identified), %", "limits": (1e-5, 1.0), "colors": "magma_r"}
    error = 100.0 * np.abs(study.inertia_identified / study.inertia_true - 1.0)
    for component in ("xx", "zz"):
        values = error.sel(component=component).values
        known = values[np.isfinite(values)]
        found = f"median {np.median(known):.2g} %, worst {known.max():.2g} %, " if known.size else ""
        title = f"$I_{{{component}}}$: {found}not identified {values.size - known.size}"
        panels.append(_map(study, values, title, lines, **look))
    title = "Error of the identified moments of inertia; dashed: 20 % of the spacing"
    return Figure(name="inertia_error", title=title, panels=panels, columns=2, height=92.0)
