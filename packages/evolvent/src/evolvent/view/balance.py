"""Energies of a run, and how well they balance: figure and rows of the table."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from evolvent.results import variables
from evolvent.results.motion import quantity
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of, stacked

#: Units of energy in figures: largest energy above which one is taken (J), its factor and name.
_ENERGY_UNITS = ((0.1, 1.0, "J"), (1e-4, 1e3, "mJ"), (0.0, 1e6, "µJ"))
#: Smallest stored energy that is drawn, of the largest energy: less is round-off.
_STORED_SHOWN = 1e-6
#: Largest share of the largest energy that is round-off of one at the end.
_LEFT = 1e-9
#: Least length of the axis of the balance's defect, of the largest energy: it is drawn over ±0.1 % or more.
_DEFECT_SCALE = 2e-3


#: Energies, work and losses of the balance, with their labels.
_BALANCE = {
    "energy_kinetic": "kinetic",
    "energy_elastic": "elastic",
    "energy_dissipated": "dissipated",
    "work_loads": "work of loads",
    "work_drives": "work of drives",
    "work_spools": "work of spools",
    "energy_released": "brought in at releases",
}


def balance_figure(run: xr.DataTree, rows: Mapping[str, str] | None = None) -> Figure:
    """Energies, work and losses, by kind where there are several, and how well they balance.

    Parameters
    ----------
    rows : mapping, variable of the root -> label; those of any run if left out
    """
    rows, root = _BALANCE if rows is None else rows, variables.root_dataset(run)
    time = root["time"].values
    peak = max(float(np.nanmax(np.abs(root[name].values), initial=0.0)) for name in rows)
    factor, unit = next((f, u) for least, f, u in _ENERGY_UNITS if peak > least or least == 0.0)

    def lines_of_all(columns: list[tuple[str, np.ndarray]], least: float) -> list[Line]:
        seen = [(text, y) for text, y in columns if np.nanmax(np.abs(y), initial=0.0) > least * peak]
        return [Line(x=time, y=factor * y, label=text, color=k) for k, (text, y) in enumerate(seen)]

    lines = lines_of_all([(text, root[name].values) for name, text in rows.items()], 1e-6)
    panels = [Panel(x_label="", y_label=f"energy, {unit}", lines=lines, y_zero=True)]
    stored = lines_of_all(list(stored_energies(run).items()), _STORED_SHOWN)
    if len(stored) > 1:
        for k, line in enumerate(stored):
            stored[k] = dataclasses.replace(line, y=np.where(line.y > _STORED_SHOWN * factor * peak, line.y, np.nan))
        panels.append(Panel(x_label="", y_label=f"energy stored, {unit}", lines=stored, log=True))
    causes = [str(name) for name in root["cause"].values] if "energy_losses" in root else []
    losses = lines_of_all([(name, root["energy_losses"].values[:, k]) for k, name in enumerate(causes)], 1e-9)
    if len(losses) > 1:
        panels.append(Panel(x_label="", y_label=f"dissipated, {unit}", lines=losses))
    defect, span = Line(x=time, y=factor * root["energy_defect"].values, color=0), _DEFECT_SCALE * factor * peak
    panels.append(Panel(x_label="time, s", y_label=f"defect, {unit}", lines=[defect], y_span=span))
    heights = (*[3.0] * (len(panels) - 1), 1.5)
    height = stacked(len(panels))
    return Figure(name="energy-balance", title="Energy balance", panels=panels, height=height, heights=heights)


def stored_energies(run: xr.DataTree | xr.Dataset) -> dict[str, np.ndarray]:
    """Elastic energies over time (J) of all beams, by what strains them, and of all contacts; those that there are."""
    found: dict[str, np.ndarray] = {}
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        if "energy_bending" in group:
            bending, elastic = group["energy_bending"].values, group["energy_elastic"].values
            found["bending"] = found.get("bending", 0.0) + bending
            found["stretch and shear"] = found.get("stretch and shear", 0.0) + elastic - bending
        elif "normal_force" in group and "energy_elastic" in group:
            found["contacts"] = found.get("contacts", 0.0) + group["energy_elastic"].values
    return found


def balance_numbers(run: xr.DataTree) -> list[Number]:
    """Rows of the table: energies at the end, what dissipated energy, and how well the balance closes."""
    root = variables.root_dataset(run)
    kinds = {"kinetic": root["energy_kinetic"].values}
    kinds |= stored_energies(run) or {"elastic": root["energy_elastic"].values}
    least = _LEFT * max(float(np.nanmax(np.abs(y), initial=0.0)) for y in kinds.values())
    left = {kind: float(y[-1]) for kind, y in kinds.items() if not abs(float(y[-1])) <= least} or {"": 0.0}
    text = ", ".join(f"{kind} {quantity(value, 'J')}".strip() for kind, value in left.items())
    found: list[tuple[Any, ...]] = [("energy at the end", text, *((value, "J", kind) for kind, value in left.items()))]
    if "energy_losses" in root:
        taken = dict(zip(root["cause"].values, root["energy_losses"].values[-1], strict=True))
        defect = float(root["energy_defect"].values[-1])
        taken |= {"numerical damping": -defect} if defect < 0.0 else {}
        largest = max([abs(value) for value in taken.values()] or [0.0])
        causes = {name: float(value) for name, value in taken.items() if abs(value) > 1e-6 * largest > 0.0}
        if causes:
            text = ", ".join(f"{name} {quantity(value, 'J')}" for name, value in causes.items())
            found.append(("energy dissipated by", text, *((value, "J", name) for name, value in causes.items())))
    worst = float(np.nanmax(np.abs(root["energy_defect"].values), initial=0.0))
    closes, quantities = f"closes to {quantity(worst, 'J', 2)}", [(worst, "J", "")]
    if "energy_moved" in root:
        moved = float(np.nanmax(root["energy_moved"].values, initial=0.0))
        closes += f", {worst / max(moved, 1e-300):.2g} of the {quantity(moved, 'J', 3)} that were moved"
        quantities.append((moved, "J", "moved"))
    found.append(("energy balance", closes, *quantities))
    return numbers_of(found)
