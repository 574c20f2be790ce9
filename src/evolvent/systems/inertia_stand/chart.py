"""Figures of a study over the offsets of the centre of mass: what the paper shows in its figures 2 to 5, and more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr
    from matplotlib.figure import Figure

#: The box that the paper calls safe: 20 % of the springs' spacing to each side, as a share of half of it.
BOX = 0.4
KEYS = ("body.offset_x", "body.offset_z")
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
NAMES = ("lowest", "middle", "highest")


def _name(k: int, modes: int) -> str:
    """Name of mode k, from 0, of so many."""
    return NAMES[k] if modes == len(NAMES) else f"mode {k + 1}"


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of a grid over both offsets; none for other studies.

    Parameters
    ----------
    dataset : as `evolvent.studies.open` returns it
    """
    if any(key not in dataset.dims for key in KEYS):
        return {}
    ordered = dataset.transpose(*KEYS, ...)
    drawn: dict[str, tuple[Callable[[xr.Dataset], Figure], set[str]]] = {
        "energies": (_energies, {"linear_frequency", "linear_energy", "mode_energy"}),
        "amplitudes": (_amplitudes, {"mode_amplitude"}),
        "least_energy": (_least, {"least_energy"}),
        "frequencies": (_frequencies, {"mode_frequency", "mode_frequency_linear"}),
        "inertia_error": (_errors, {"inertia_identified", "inertia_true"}),
    }
    over = set(KEYS)
    held = {str(name) for name, values in ordered.data_vars.items() if over <= set(values.dims)}
    found = {name: draw(ordered) for name, (draw, needs) in drawn.items() if needs <= held}
    return found


def _sheet(rows: int, columns: int, size: tuple[float, float], title: str) -> tuple[Figure, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sheet = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(sheet)
    sheet.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return sheet, sheet.subplots(rows, columns, squeeze=False)


def _line(study: xr.Dataset) -> tuple[xr.Dataset, float]:
    """The cases nearest to offset_z = 0, along offset_x."""
    middle = int(np.argmin(np.abs(study[KEYS[1]].values)))
    return study.isel({KEYS[1]: middle}), float(study[KEYS[1]][middle])


def _plain(axis: Any, title: str = "") -> None:
    axis.grid(alpha=0.25)
    axis.spines[["top", "right"]].set_visible(False)
    axis.set_title(title, loc="left", fontsize=10)


def _energies(study: xr.Dataset) -> Figure:
    """Energies of the modes along both offsets (Belyakov, figure 2)."""
    sheet, axes = _sheet(1, 2, (11.0, 4.2), "Energies of the three modes")
    along_x, z = _line(study)
    middle = int(np.argmin(np.abs(study[KEYS[0]].values)))
    along_z = study.isel({KEYS[0]: middle})
    x = float(study[KEYS[0]][middle])
    for axis, line, key, title in (
        (axes[0, 0], along_x, KEYS[0], f"offset_z = {z:.3g} m"),
        (axes[0, 1], along_z, KEYS[1], f"offset_x = {x:.3g} m"),
    ):
        order = np.argsort(line.linear_frequency.values, axis=1)[:, -3:]
        linear = np.take_along_axis(line.linear_energy.values, order, axis=1)
        modes = line.sizes["mode"]
        for k in range(modes):
            label = f"{_name(k, modes)}, identified"
            axis.plot(line[key], line.mode_energy[:, k], "o", ms=3, color=COLORS[k % len(COLORS)], label=label)
        for k in range(linear.shape[1]):
            axis.plot(line[key], linear[:, k], "-", lw=1.2, color=COLORS[k], label="linear model")
        axis.plot(line[key], line.mode_energy.sum("mode"), ":", color="gray", label="sum")
        axis.set_xlabel(f"{key.partition('.')[2]}, m")
        axis.set_ylabel("energy, J")
        _plain(axis, title)
    axes[0, 1].legend(frameon=False, fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 0.95))
    return sheet


def _amplitudes(study: xr.Dataset) -> Figure:
    """Amplitude of each mode at each spring along offset_x (figure 3)."""
    line, z = _line(study)
    modes = line.sizes["mode"]
    sheet, axes = _sheet(1, modes, (4.0 * modes, 3.8), f"Amplitudes at the sensors, offset_z = {z:.3g} m")
    for k in range(modes):
        axis = axes[0, k]
        for c in range(min(line.sizes["sensor"], 4)):
            axis.plot(line[KEYS[0]], 1e3 * line.mode_amplitude[:, k, c], ".-", lw=1, ms=4, label=f"sensor {c + 1}")
        axis.set_xlabel("offset_x, m")
        axis.set_ylabel("amplitude, mm")
        _plain(axis, f"{NAMES[k]} mode" if modes == len(NAMES) else _name(k, modes))
    axes[0, 0].legend(frameon=False, fontsize=8)
    return sheet


def _box(axis: Any, case: Any) -> None:
    """The paper's box."""
    from matplotlib.patches import Rectangle

    a, b = BOX * case.stand.half_length, BOX * case.stand.half_width
    axis.add_patch(Rectangle((-a, -b), 2 * a, 2 * b, fill=False, ec="white", lw=2.2))
    axis.add_patch(Rectangle((-a, -b), 2 * a, 2 * b, fill=False, ec="black", lw=1.2, ls="--"))


def _case(study: xr.Dataset) -> Any:
    from evolvent import cases

    content = cases.parse_yaml(study.attrs["study"], "the study")
    return cases.load(content["case"], content.get("set") or {})


def _least(study: xr.Dataset) -> Figure:
    """Least of the modes' energies over the plane (figure 4), with the given load and with the best one."""
    from matplotlib.colors import LogNorm

    case = _case(study)
    x, z = study[KEYS[0]].values, study[KEYS[1]].values
    inside = (np.abs(x)[:, None] <= BOX * case.stand.half_length + 1e-9) & (
        np.abs(z)[None, :] <= BOX * case.stand.half_width + 1e-9
    )
    titles = {"least_energy": "as the case sets it in motion"}
    if "least_energy_best" in study:  # an initial state acts at no spring
        titles["least_energy_best"] = "loaded at the best spring for each offset"
    top = max(float(np.nan_to_num(study[name].values).max()) for name in titles)
    top = top if top > 0.0 else 1.0
    least = min(1e-3, 1e-4 * top)
    levels = LogNorm(vmin=least, vmax=top)
    sheet, axes = _sheet(
        1, len(titles), (6.5 * len(titles), 4.6), "Energy of the weakest of three modes; dashed: 20 % of the spacing"
    )
    for axis, (name, title) in zip(axes[0], titles.items(), strict=True):
        values = study[name].values
        image = axis.pcolormesh(x, z, np.maximum(values, least).T, norm=levels, cmap="viridis", shading="nearest")
        for level, color in ((0.01 * top, "white"), (0.3, "black")):
            if min(values.shape) > 1 and np.any(values < level) and np.any(values > level):
                axis.contour(x, z, values.T, levels=[level], colors=[color], linewidths=1.0)
        _box(axis, case)
        part = values[inside & np.isfinite(values)]
        share = 100.0 * float(np.mean(part < 0.01 * top)) if part.size else np.nan
        axis.set_title(
            f"{title}\nin the box: least {part.min():.2g} J, median {np.median(part):.2g} J, below 1 % of the top "
            f"{share:.0f} %"
            if part.size
            else f"{title}\nno case in the box",
            loc="left",
            fontsize=9,
        )
        axis.set_facecolor("lightgray")
        axis.set_xlabel("offset_x, m")
        axis.set_ylabel("offset_z, m")
    sheet.colorbar(image, ax=axes, label="energy, J (white line: 1 % of the top, black: 0.3 J; gray: no run)")
    return sheet


def _frequencies(study: xr.Dataset) -> Figure:
    """Frequencies along offset_x (figure 5), and how far the identified lie from the linear model's."""
    line, z = _line(study)
    sheet, axes = _sheet(1, 2, (11.0, 4.2), f"Frequencies, offset_z = {z:.3g} m")
    modes = line.sizes["mode"]
    for k in range(modes):
        f, linear = line.mode_frequency[:, k], line.mode_frequency_linear[:, k]
        color = COLORS[k % len(COLORS)]
        axes[0, 0].plot(line[KEYS[0]], f, "o", ms=3, color=color, label=f"{_name(k, modes)}, identified")
        axes[0, 0].plot(line[KEYS[0]], linear, "-", lw=1.2, color=color, label="linear model")
        axes[0, 1].plot(line[KEYS[0]], 1e6 * (f / linear - 1.0), ".-", lw=1, ms=4, color=color)
    axes[0, 0].set_ylabel("frequency, rad/s")
    axes[0, 1].set_ylabel("identified less linear, ppm")
    for axis in axes[0]:
        axis.set_xlabel("offset_x, m")
        _plain(axis)
    axes[0, 0].legend(frameon=False, fontsize=8)
    return sheet


def _errors(study: xr.Dataset) -> Figure:
    """Error of the identified moments over the plane."""
    from matplotlib.colors import LogNorm

    case = _case(study)
    x, z = study[KEYS[0]].values, study[KEYS[1]].values
    sheet, axes = _sheet(1, 2, (13.0, 4.6), "Error of the identified moments of inertia; dashed: 20 % of the spacing")
    error = 100.0 * np.abs(study.inertia_identified / study.inertia_true - 1.0)
    norm = LogNorm(vmin=1e-5, vmax=1.0)
    for axis, component in zip(axes[0], ("xx", "zz"), strict=True):
        values = error.sel(component=component).values
        image = axis.pcolormesh(x, z, np.clip(values, 1e-5, None).T, norm=norm, cmap="magma_r", shading="nearest")
        axis.set_facecolor("lightgray")
        _box(axis, case)
        known = values[np.isfinite(values)]
        found = f"median {np.median(known):.2g} %, worst {known.max():.2g} %, " if known.size else ""
        axis.set_title(
            f"I{component}: {found}not identified {values.size - known.size}",
            loc="left",
            fontsize=9,
        )
        axis.set_xlabel("offset_x, m")
        axis.set_ylabel("offset_z, m")
    sheet.colorbar(image, ax=axes, label="error, % (gray: not identified)")
    return sheet
