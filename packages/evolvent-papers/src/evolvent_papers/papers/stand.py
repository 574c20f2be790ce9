"""Figures 2 to 5 of Belyakov (2002), energies, amplitudes and frequencies of the modes, and curves over the offset."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import lazy_loader as lazy
import numpy as np

from evolvent import cases
from evolvent.design.studies.study import read
from evolvent_base.figures import Figure, Line, Map, Note, Panel
from evolvent_massprops.inertia import Body, NormalModes, Stand, vertical_model
from evolvent_massprops.inertia_stand import SYSTEM, chart
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.winding import markdown

if TYPE_CHECKING:
    import xarray as xr

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

CASE, STUDY = "inertia-stand", "inertia-stand-map"
KEYS = ("body.offset_x", "body.offset_z")
LABELS = ("offset_x, m", "offset_z, m")
#: The modes by rising frequency, on lines on which one offset is 0; as the paper describes them, with our names.
NAMES = ("heave", "pitch", "roll")
MODES = ("along Y\n(heave)", "about Z\n(pitch)", "about X\n(roll)")
#: The axes of figure 4, and that of figure 5 as it is printed.
PLANE = ("displacement along X, m", "displacement along Z, m")
ALONG_X = "displacement of the centre of mass relative to the centre of stiffness along the X axis, m"
#: Offsets of the curves: so many points over the range of the map.
POINTS = 241
#: Numbers of offsets on a line at which the motion is simulated: in full and of the quick form.
SIMULATED, QUICK_SIMULATED = 9, 3
#: Offsets (x, z) of the bars, m: in figure 2, a panel each, and in figure 3.
ENERGY_BARS = (((0.0, 0.0), (0.4, 0.0), (0.8, 0.0)), ((0.0, 0.0), (0.0, 0.174), (0.0, 0.348)))
AMPLITUDE_BARS = ((0.4, 0.0), (0.4, 0.174))
#: Colors of bars side by side, from dark to light.
SHADES = ("#08306b", "#2e7ebc", "#8fc2de", "#d9e8f5")
BARS = """\
Bars: modes identified from the simulated motion in six degrees of freedom. Abscissa and offsets are our reading: the
figure is lost, and its caption gives none.
"""
NOTE = """\
Lines: linear model of heave, roll and pitch. Circles: modes identified from the simulated motion in six degrees of
freedom.
"""


SPRINGS = "Springs 1 and 2 are at +x, 1 and 4 at +z; spring 1 is loaded.\n"


class Grid(NamedTuple):
    """The offsets of the map (`evolvent sweep inertia-stand-map`) and the case that it varies.

    Attributes
    ----------
    case : the case
    x, z : (37,), (27,) float, m, offsets
    text : str, the study as YAML
    """

    case: Any
    x: np.ndarray
    z: np.ndarray
    text: str

    @property
    def stand(self) -> Stand:
        """The springs."""
        given = self.case.stand
        return Stand(points=given.springs, stiffness=given.stiffness, length=given.natural_length)

    def body(self, x: Any, z: Any) -> Body:
        """The body with its centre of mass at offsets, broadcast."""
        x, z = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
        return Body(mass=self.case.body.mass, centre=np.stack([x, 0.0 * x, z], axis=-1), inertia=self.case.body.tensor)

    def modes(self, x: Any, z: Any) -> NormalModes:
        """Heave, roll and pitch of the level body with its centre of mass at offsets."""
        return vertical_model(self.stand, self.body(x, z)).modes()

    def energies(self, x: Any, z: Any, spring: int = 1) -> np.ndarray:
        """(..., 3) J, energies of the modes after the case's load at a spring, from 1."""
        modes = self.modes(x, z)
        return modes.energy(modes.release(self.case.excitation.force, self.stand.points[spring - 1]))

    def least_energies(self, x: Any, z: Any) -> np.ndarray:
        """(4, ...) J, energy of the weakest mode, loaded at each spring."""
        return np.array([self.energies(x, z, k + 1).min(axis=-1) for k in range(len(self.stand.points))])


@functools.cache
def grid() -> Grid:
    """The grid of the built-in map."""
    study = read(STUDY)
    x, z = (np.array(axis.values, dtype=float) for axis in study.axes)
    return Grid(cases.load(CASE), x, z, study.text)


def simulated(x: Any, z: Any, **changes: Any) -> list[Any]:
    """Runs of the built-in case at offsets, three modes identified; `changes` with "__" for the dots of keys."""
    fixed = {"identification.order": 3, "identification.way": "none"}
    fixed |= {key.replace("__", "."): value for key, value in changes.items()}
    offsets = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
    pairs = zip(*(offset.ravel() for offset in offsets), strict=True)
    several = [cases.load(CASE, fixed | dict(zip(KEYS, map(float, pair), strict=True))) for pair in pairs]
    runs = SYSTEM.run_batch(several)
    for run in runs:
        if isinstance(run, Exception):
            raise run
    return runs


def _line(options: Options, over: Grid, axis: int) -> tuple[np.ndarray, np.ndarray, Sequence[Any]]:
    """Offsets of the curves along an axis, those of the simulated cases, and their runs."""
    along = (over.x, over.z)[axis]
    count = QUICK_SIMULATED if options.quick else SIMULATED
    few = along[np.linspace(0, len(along) - 1, count).round().astype(int)]
    options.report(f"{count} simulated cases over {LABELS[axis].partition(',')[0]}")
    return np.linspace(along[0], along[-1], POINTS), few, _simulated_line(axis, tuple(few.tolist()))


@functools.lru_cache(maxsize=4)
def _simulated_line(axis: int, offsets: tuple[float, ...]) -> Sequence[Any]:
    """Runs along an axis, kept for the next figure."""
    return simulated(offsets if axis == 0 else 0.0, offsets if axis == 1 else 0.0)


def figure_2(options: Options) -> Made:
    """Distribution of the energy over the modes, as bars."""
    panels, rows = [], []
    for axis, offsets in enumerate(ENERGY_BARS):
        options.report(f"{len(offsets)} simulated cases over {LABELS[axis].partition(',')[0]}")
        runs = _simulated_at(offsets)
        labels = [f"{'XZ'[axis]} = {at[axis]:g} m" for at in offsets]
        energy = np.array([run.mode_energy.values for run in runs])
        panels.append(
            Panel(
                x_label="mode", y_label="energy, J", lines=_bars(energy, labels), x_names=dict(enumerate(MODES)),
                title=f"centre of mass at {'ZX'[axis]} = 0, and at", y_zero=True, notes=_values(energy),
            )
        )  # fmt: skip
        rows += [
            [f"{x:g}", f"{z:g}", *(f"{v:.4g}" for v in values), f"{values.sum():.2f}"]
            for (x, z), values in zip(offsets, energy, strict=True)
        ]
    head = (*LABELS, "heave, J", "pitch, J", "roll, J", "sum, J")
    title = (
        "Figure 2 of Belyakov (2002): distribution of the energy over the modes of oscillation (J). Our reading: bars, "
        "places of the centre of mass"
    )
    figure = Figure(name="stand-figure-2", title=title, panels=panels, columns=2, height=84.0)
    return Made(text=f"{BARS}\n{markdown(head, rows)}", figure=figure)


def figure_3(options: Options) -> Made:
    """Amplitudes by modes and by the numbers of the springs, as bars."""
    panels: list[Panel] = []
    rows = []
    options.report(f"{len(AMPLITUDE_BARS)} simulated cases")
    for (x, z), run in zip(AMPLITUDE_BARS, _simulated_at(AMPLITUDE_BARS), strict=True):
        amplitude = 1e3 * run.mode_amplitude.values
        labels = [f"$i$ = {k}" for k in range(1, 5)]
        panels.append(
            Panel(
                x_label="mode $k$", y_label="amplitude $A_{ki}$, mm",
                lines=_bars(amplitude.T, [] if panels else labels),
                title=f"centre of mass at X = {x:g} m, Z = {z:g} m", x_names=dict(enumerate(MODES)), y_zero=True,
            )
        )  # fmt: skip
        rows += [
            [f"{x:g}", f"{z:g}", name, *(f"{v:.4f}" for v in values)]
            for name, values in zip(NAMES, amplitude, strict=True)
        ]
    head = (*LABELS, "mode", *(f"spring {k}, mm" for k in range(1, 5)))
    title = (
        "Figure 3 of Belyakov (2002): amplitudes of oscillation by modes and by numbers $i$ of the springs' "
        "attachments. Our reading: bars, places of the centre of mass, spring 1 loaded at +X, +Z"
    )
    figure = Figure(name="stand-figure-3", title=title, panels=panels, columns=2, height=88.0)
    return Made(text=f"{BARS}{SPRINGS}\n{markdown(head, rows)}", figure=figure)


@functools.lru_cache(maxsize=8)
def _simulated_at(offsets: tuple[tuple[float, float], ...]) -> Sequence[Any]:
    """Runs at offsets (x, z)."""
    return simulated(*np.array(offsets).T)


def _bars(values: np.ndarray, labels: Sequence[str]) -> list[Line]:
    """Bars (k, groups), k of them side by side about the positions 0, 1, 2 of the groups."""
    lines, wide, none = [], 0.8 / len(values), np.full(1, np.nan)
    for k, row in enumerate(values):
        for group, value in enumerate(row):
            x = group - 0.4 + wide * (k + np.array([0.0, 0.0, 1.0, 1.0]))
            lines.append(Line(x=x, y=value * np.array([0.0, 1.0, 1.0, 0.0]), color="black", fill=SHADES[k], width=0.6))
        if labels:
            lines.append(Line(x=none, y=none, color=SHADES[k], width=5.0, label=labels[k]))  # of the legend
    return lines


def _values(values: np.ndarray) -> list[Note]:
    """The numbers of such bars, above them."""
    wide, high = 0.8 / len(values), 0.03 * float(values.max())
    return [
        Note(at=(group - 0.4 + wide * (k + 0.5), float(value) + high), text=f"{value:.2g}")
        for k, row in enumerate(values)
        for group, value in enumerate(row)
    ]


def energies(options: Options) -> Made:
    """Energies of the three modes over the offset."""
    over, panels, rows = grid(), [], []
    for axis in (0, 1):
        fine, few, runs = _line(options, over, axis)
        at = (fine, 0.0) if axis == 0 else (0.0, fine)
        curves, found = over.energies(*at), np.array([run.mode_energy.values for run in runs])
        lines = [Line(x=fine, y=curves[:, k], color=1 + k, label=NAMES[k] if axis == 0 else "") for k in range(3)]
        lines += [Line(x=few, y=found[:, k], style="", marker="o", color=1 + k) for k in range(3)]
        lines.append(Line(x=fine, y=curves.sum(axis=1), color="gray", width=2.0, label="sum" if axis == 0 else ""))
        panels.append(Panel(x_label=chart.LABELS[axis], y_label="energy, J", lines=lines, title=f"{_other(axis)} = 0"))
        worst = np.abs(found - over.energies(*((few, 0.0) if axis == 0 else (0.0, few)))).max()
        options.report(f"energies of the simulated and the linear motion differ by up to {worst:.2g} J")
        for offset in (0.0, 0.4, 0.8) if axis == 0 else (0.17392, 0.34784):
            values = over.energies(*((offset, 0.0) if axis == 0 else (0.0, offset)))
            where = [f"{offset:g}", "0"] if axis == 0 else ["0", f"{offset:g}"]
            rows.append([*where, *(f"{v:.4g}" for v in values), f"{values.sum():.2f}"])
    head = (*LABELS, "heave, J", "pitch, J", "roll, J", "sum, J")
    title = "Ours: energies of the three modes over the offset of the centre of mass"
    figure = Figure(name="stand-energies", title=title, panels=panels, columns=2, height=88.0)
    return Made(text=f"{NOTE}\n{markdown(head, rows)}", figure=figure)


def _other(axis: int) -> str:
    return chart.LABELS[1 - axis].partition(",")[0]


def amplitudes(options: Options) -> Made:
    """Amplitude of each mode at each spring over the offset."""
    over, panels, rows = grid(), [], []
    styles = ("-", "--", ":", "-.")
    for axis in (0, 1):
        fine, few, runs = _line(options, over, axis)
        curves = _amplitudes(over, *((fine, 0.0) if axis == 0 else (0.0, fine)))
        found = 1e3 * np.array([run.mode_amplitude.values for run in runs])
        for k, name in enumerate(NAMES):
            lines = []
            for spring in range(4):
                look: Any = {"color": 1 + spring, "style": styles[spring], "width": 3.2 - 1.6 * (spring % 2)}
                label = f"spring {spring + 1}" if (axis, k) == (0, 0) else ""
                lines.append(Line(x=fine, y=curves[:, k, spring], label=label, **look))
                lines.append(Line(x=few, y=found[:, k, spring], style="", marker="o", color=1 + spring))
            title = f"{name}, {_other(axis)} = 0"
            panels.append(
                Panel(x_label=chart.LABELS[axis], y_label="amplitude, mm", lines=lines, title=title, y_zero=True)
            )
    for offset in (0.0, 0.4, 0.8):
        for name, values in zip(NAMES, _amplitudes(over, offset, 0.0), strict=True):
            rows.append([f"{offset:g}", name, *(f"{value:.4f}" for value in values)])
    head = (LABELS[0], "mode", *(f"spring {k}, mm" for k in range(1, 5)))
    title = "Ours: amplitude of each mode at each spring over the offset of the centre of mass, spring 1 loaded"
    figure = Figure(name="stand-amplitudes", title=title, panels=panels, columns=3, height=152.0)
    return Made(text=f"{NOTE}{SPRINGS}\n{markdown(head, rows)}", figure=figure)


def _amplitudes(over: Grid, x: Any, z: Any) -> np.ndarray:
    """(..., 3, 4) mm, amplitude of each mode at each spring, loaded at spring 1."""
    modes, stand = over.modes(x, z), over.stand
    wave = modes.release(over.case.excitation.force, stand.points[0])
    return np.asarray(1e3 * np.abs(modes.amplitude(wave, stand.points)))


def figure_4(options: Options) -> Made:
    """Surface of the least of the modes' energies over the plane, on the 999 points of the built-in map."""
    over = grid()
    data = map_data(over)
    drawn = chart.least_energy_map(data)
    inside = chart.box(data)[1]
    top = float(over.energies(0.0, 0.0).max())
    rows = []
    for name, text in (("least_energy", "spring 1"), ("least_energy_best", "best spring")):
        part = data[name].values[inside]
        share, seen = 100.0 * np.mean(part < 0.01 * top), 100.0 * np.mean(part >= chart.LEAST)
        rows.append([text, f"{part.min():.2g}", f"{np.median(part):.3g}", f"{share:.1f}", f"{seen:.1f}"])
    head = ("loaded", "least, J", "median, J", f"below 1 % of {top:.2f} J, %", f"at least {chart.LEAST:g} J, %")
    note = (
        f"Linear model on the {data.least_energy.size} offsets of `evolvent sweep {STUDY}`; the table is over the "
        f"{int(inside.sum())} that lie within 20 % of the springs' spacing along each axis.\n"
    )
    title = (
        "Figure 4 of Belyakov (2002): least energies of the modes of oscillation (J), 999 points (ours: their range "
        f"and spacing). Maps: dashed 20 % of the spacing, white 1 % of the largest, black {chart.LEAST:g} J"
    )
    panels, loads = [], ("loaded at spring 1", "ours: loaded at the best spring")
    for flat, name, load in zip(drawn.panels, ("least_energy", "least_energy_best"), loads, strict=True):
        map_title = f"ours: the same as a map\n{flat.title.partition(chr(10))[2]}"
        raised = Map(x=over.x, y=over.z, values=data[name].values, label="least energy, J", surface=True)
        panels.append(Panel(x_label=PLANE[0], y_label=PLANE[1], lines=[], title=load, map=raised))
        panels.append(dataclasses.replace(flat, title=map_title, x_label=PLANE[0], y_label=PLANE[1]))
    figure = Figure(name="stand-figure-4", title=title, panels=panels, columns=2, height=184.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure)


def map_data(over: Grid) -> xr.Dataset:
    """Least energies over the map by the linear model, as the study of the map names them."""
    least = over.least_energies(over.x[:, None], over.z[None, :])
    data = {"least_energy": (KEYS, least[0]), "least_energy_best": (KEYS, least.max(axis=0))}
    return xr.Dataset(data, coords=dict(zip(KEYS, (over.x, over.z), strict=True)), attrs={"study": over.text})


def figure_5(options: Options) -> Made:
    """Two frequencies over the x offset."""
    over = grid()
    fine, few, runs = _line(options, over, 0)
    curves = over.modes(fine, 0.0).natural_frequency
    found = np.array([run.mode_frequency.values for run in runs])
    near = over.modes(few, 0.0).natural_frequency
    described = ("oscillation along the vertical axis", "rotation about the Z axis")
    lines = [Line(x=fine, y=curves[:, k], color=1 + k, label=described[k]) for k in range(2)]
    lines += [Line(x=few, y=found[:, k], style="", marker="o", color=1 + k) for k in range(2)]
    apart = [
        Line(x=few, y=1e6 * (found / near - 1.0)[:, k], style="", marker="os^"[k], color=1 + k, label=NAMES[k])
        for k in range(3)
    ]
    roll = f"rotation about the X axis stays at {found[:, 2].mean():.2f} rad/s"
    panels = [
        Panel(x_label=ALONG_X, y_label="frequency $\\omega$, rad/s", lines=lines, title=f"Z = 0; {roll}"),
        Panel(
            x_label=ALONG_X, y_label="simulated minus linear, ppm", lines=apart, y_span=20.0,
            title="ours: simulated and linear motion",
        ),
    ]  # fmt: skip
    rows = []
    for x in (0.0, 0.4, 0.8):
        modes = over.modes(x, 0.0)
        rows.append([f"{x:g}", *(f"{w:.3f}" for w in modes.natural_frequency), f"{modes.axes()[0][1, 0]:.3f}"])
    head = (LABELS[0], *(f"{name}, rad/s" for name in NAMES), "axis of pitch at x, m")
    title = (
        "Figure 5 of Belyakov (2002): frequencies by modes of oscillation (rad/s). Lines: linear model, circles: "
        "simulated motion (ours)"
    )
    figure = Figure(name="stand-figure-5", title=title, panels=panels, columns=2, height=92.0)
    return Made(text=f"{NOTE}\n{markdown(head, rows)}", figure=figure)
