"""What to show of a run: numbers, figures, motion."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.results import closing_numbers
from evolvent.results.motion import Forces, Marks
from evolvent.results.solids import Solid
from evolvent.view import balance, show
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of
from evolvent_massprops import mode_figures
from evolvent_massprops.inertia_stand.case import Case

if TYPE_CHECKING:
    from evolvent.results.motion import Motion

#: Largest displacement in pictures, of the stand's half length; the true one would not be seen.
SHOWN = 0.12
#: Most springs whose forces are drawn.
MOST_SPRINGS = 6


def case_of(run: Any) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


def partner(run: Any, k: int) -> int | None:
    """Number of the linear model's mode that identified mode k is; None where it is none of them."""
    linear = float(run.mode_frequency_linear[k])
    return int(np.argmin(np.abs(run.linear_frequency.values - linear))) if np.isfinite(linear) else None


def numbers(run: Any) -> list[Number]:
    """Rows of the table on the screen."""
    found = [_mode(run, int(k)) for k in np.flatnonzero(np.isfinite(run.mode_frequency.values))]
    if np.any(np.isfinite(energies := run.mode_energy.values)):
        total = float(np.nansum(energies))
        found += numbers_of([("sum of the modes' energies", f"{total:.5g} J", (total, "J"))])
    found += [_moment(run, int(k)) for k in np.flatnonzero(np.isfinite(run.inertia_identified.values))]
    for name, unit in (("mass", "kg"), ("offset_x", "m"), ("offset_z", "m"), ("height", "m")):
        value = float(run[f"{name}_identified"])
        if np.isfinite(value):
            true = float(getattr(case_of(run).body, name))
            text, quantities = f"{value:.7g} {unit}; true {true:.7g}", ((value, unit), (true, unit, "true"))
            found += numbers_of([(f"{name.replace('_', ' ')} identified", text, *quantities)])
    found += [_axis(run, k) for k in range(run.sizes["linear_mode"]) if _turns(run, k)]
    tilt = float(np.degrees(float(run.static_tilt)))
    largest = max(1e-300, *(float(run[f"energy_{name}"].max()) for name in ("kinetic", "potential")))
    balance = float(np.abs(run.energy_defect.values).max()) / largest
    rows = [
        ("tilt at rest", f"{tilt:.4g} deg", (tilt, "deg")),
        ("energy balance", f"{balance:.2g} of the largest energy", (balance, "1")),
    ]
    return found + numbers_of(rows) + closing_numbers(run)


def _mode(run: Any, k: int) -> Number:
    """Frequency and energy of an identified mode, and which mode of the linear model it is."""
    near, std, energy = partner(run, k), float(run.mode_frequency_std[k]), float(run.mode_energy[k])
    what = "no mode of the linear model" if near is None else str(run.linear_kind.values[near])
    frequency, linear = float(run.mode_frequency[k]), float(run.mode_frequency_linear[k])
    text = f"{frequency:.7g} rad/s"
    text += f" ± {std:.2g}" if np.isfinite(std) else ""
    text += "" if near is None else f" (linear {linear:.7g})"
    text += f", {energy:.4g} J" if np.isfinite(energy) else ""
    quantities = [(frequency, "rad/s", ""), (std, "rad/s", "standard uncertainty")]
    quantities += [] if near is None else [(linear, "rad/s", "linear model")]
    known = [one for one in [*quantities, (energy, "J", "energy")] if np.isfinite(one[0])]
    return numbers_of([(f"mode {k + 1}, {what}", text, *known)])[0]


def _turns(run: Any, k: int) -> bool:
    """Whether a linear mode is a heave, roll or pitch with an axis of rotation."""
    return run.linear_kind.values[k] in ("heave", "roll", "pitch") and bool(np.isfinite(run.linear_axis_point[k, 0]))


def _axis(run: Any, k: int) -> Number:
    """Where the axis of rotation of a mode of the linear model passes the centre of mass."""
    x, _, z = run.linear_axis_point.values[k] + 0.0
    text = f"x {x:.4g} m, z {z:.4g} m (linear model)"
    return numbers_of([(f"axis of {run.linear_kind.values[k]}", text, (x, "m", "x"), (z, "m", "z"))])[0]


def _moment(run: Any, k: int) -> Number:
    """An identified component of the inertia tensor, and its error."""
    true, value, std = (float(run[f"inertia_{name}"][k]) for name in ("true", "identified", "std"))
    scale = true if true != 0.0 else float(np.max(run.inertia_true.values))
    text = f"{value:.8g} kg m2" + (f" ± {std:.2g}" if np.isfinite(std) else "")
    of = "" if true != 0.0 else " of the largest moment"
    text += f"; true {true:.8g}, error {100.0 * (value - true) / scale:+.2g} %{of}"
    quantities = [(value, "kg m2", ""), (true, "kg m2", "true")]
    quantities += [(std, "kg m2", "standard uncertainty")] if np.isfinite(std) else []
    return numbers_of([(f"I{run.component.values[k]} identified", text, *quantities)])[0]


def figures(run: Any) -> list[Figure]:
    """What to draw of a run; nothing of one with a single sample."""
    if run.sizes["time"] < 4:
        return []
    time, read = run.time.values, 1e3 * run.sensor_displacement.values
    fitted = 1e3 * run.sensor_fitted.values if "sensor_fitted" in run else None
    names = [f"sensor {k}" for k in run.sensor.values]
    rows = {"energy_kinetic": "kinetic", "energy_potential": "springs and gravity, above equilibrium"}
    return [
        mode_figures.signals(time, read, fitted, names, unit="mm"),
        mode_figures.spectra(time, read, names, run.mode_frequency.values, unit="mm"),
        _shapes(run, names),
        _inertia(run),
        _motion(run),
        balance.balance_figure(run, rows | {"energy_dissipated": "dissipated"}),
    ]


def _shapes(run: Any, names: list[str]) -> Figure:
    """Amplitude of each mode at each sensor, identified and of the linear model."""
    wave = np.cos(run.mode_phase.values)
    model, titles = np.full(wave.shape, np.nan), []
    for k, (frequency, energy) in enumerate(zip(run.mode_frequency.values, run.mode_energy.values, strict=True)):
        titles.append(f"{frequency:.5g} rad/s" + (f", {energy:.4g} J" if np.isfinite(energy) else ""))
        near = partner(run, k)
        if near is not None:
            model[k] = 1e3 * np.where(wave[k] < 0.0, -1.0, 1.0) * run.linear_amplitude.values[near]
    return mode_figures.amplitudes(names, 1e3 * run.mode_amplitude.values * wave, titles, unit="mm", model=model)


def _inertia(run: Any) -> Figure:
    """Error of the identified moments with their standard deviations."""
    true, value, std = (run[name].values for name in ("inertia_true", "inertia_identified", "inertia_std"))
    names = [str(c) for c in run.component.values]
    scale = np.sqrt(np.array([true[names.index(n[0] * 2)] * true[names.index(n[1] * 2)] for n in names]))
    lines, identified_ones = [], np.flatnonzero(np.isfinite(value))
    for at, k in enumerate(identified_ones):
        error, bar = 100.0 * (value[k] - true[k]) / scale[k], 196.0 * std[k] / scale[k]
        lines.append(Line(x=np.array([float(at)]), y=np.array([error]), marker="o", style="", color=1))
        if np.isfinite(bar):
            lines.append(Line(x=np.full(2, float(at)), y=np.array([error - bar, error + bar]), color=1))
    lines.append(Line(x=np.array([-0.5, len(identified_ones) - 0.5]), y=np.zeros(2), color="gray", style=":"))
    products = any(names[k][0] != names[k][1] for k in identified_ones)
    panel = Panel(
        x_label="identified moments and products of inertia" if products else "identified moments of inertia",
        x_names={float(at): f"$I_{{{names[k]}}}$" for at, k in enumerate(identified_ones)},
        y_label="identified minus true, %",
        lines=lines,
        title="bars: 95 % by the signals' noise alone"
        + ("; products in % of the geometric mean of their moments" if products else ""),
        y_span=0.2,
    )
    return Figure(name="inertia", title="Identified moments of inertia", panels=[panel], height=80.0)


def _motion(run: Any) -> Figure:
    """Motion of the centre of mass, small rotations, forces of the springs."""
    time, count = run.time.values, min(run.sizes["spring"], MOST_SPRINGS)
    moved, turned = 1e3 * run.displacement.values, 2e3 * run["rotation"].values[:, 1:]
    forces = {f"spring {k + 1}": 1e-3 * run[f"spring-{k + 1}"].force.values for k in range(count)}
    panels = []
    for label, title, columns in (
        ("displacement, mm", "centre of mass, from equilibrium", dict(zip("xyz", moved.T, strict=True))),
        ("rotation, mrad", "", {f"about {n}": y for n, y in zip("xyz", turned.T, strict=True)}),
        ("force, kN", "", forces),
    ):
        lines = [Line(x=time, y=y, label=name, color=k) for k, (name, y) in enumerate(columns.items())]
        panels.append(Panel(x_label="time, s", y_label=label, lines=lines, title=title))
    return Figure(name="motion", title="Motion of the body", panels=panels, height=160.0)


def motion(run: Any) -> Motion:
    """Springs from ground to body, their forces on it, and the body as a box that reaches to them; y up."""
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
    moved, height = float(np.abs(ends - ends.mean(axis=0)).max()), 1e3 * run.displacement.values[:, 1]
    return dataclasses.replace(
        found,
        forces=[pulls],
        marks=[Marks(name="fixed end", points=ground)],
        frames=[dataclasses.replace(found.frames[0], solids=[box])],
        numbers={"kinetic energy [J]": run.energy_kinetic.values, "height above equilibrium [mm]": height},
        up="y",
        magnification=float(f"{max(1.0, SHOWN * reach / moved):.1g}") if moved > 0.0 else 1.0,
    )
