"""Results as a tree: one group a part, times and balances at the root.

A group's attributes say how the part is drawn and plotted (``drawn``, ``plots`` and ``plots_along``, JSON), so that a
file needs nothing beside itself to be shown. ``variables`` lists what was written: a damaged file is recognised.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.results.observe import Observed, observe
from evolvent.results.observe.variables import AXES
from evolvent.solvers import balance as eb
from evolvent.solvers.solution import Solution

#: Energies and work of the root, each with its field in the balance; their names are in `references.OF_THE_RUN` too.
_ENERGIES = {
    "energy_kinetic": ("kinetic", "kinetic energy"),
    "work_loads": ("loads", "work of loads and weight since the start"),
    "work_drives": ("drives", "work of drives since the start"),
    "work_spools": ("spools", "work of spools since the start"),
    "energy_released": ("released", "energy that nodes brought in at their release since the start"),
}
#: What dissipates energy, in the order of `evolvent.solvers.balance.LOSSES`.
CAUSES = ("mass damping", "stiffness damping", "contact", "friction", "joints", "springs")


def tree_of(
    solution: Solution, attrs: dict[str, Any], root: dict[str, Any] | None = None, *, balances: bool = True
) -> xr.DataTree:
    """A run as a tree of its parts.

    Parameters
    ----------
    solution : Solution
    attrs : attributes of the root (`evolvent.results.attributes`)
    root : dict, optional, name -> (dims, values, units, long name), more variables of the root
    balances : bool, whether the root has energies and momenta
    """
    tree = xr.DataTree(root_of(solution, root or {}, balances=balances))
    # assigned at once: DataTree.from_dict copies the tree with every group, three times the time
    tree.children = {name: xr.DataTree(_group(solution, name, found)) for name, found in observe(solution).items()}
    tree.attrs = attrs | {"variables": results.variables_of(tree), "parts": json.dumps(list(tree.children))}
    return tree


def _group(solution: Solution, name: str, found: Observed) -> xr.Dataset:
    """Variables and coordinates of a part, and how it is drawn and plotted."""
    part = solution.assembly.parts[name]
    attrs = {
        "kind": type(part).model_fields["kind"].default,
        "drawn": json.dumps(found.drawn),
        "plots": json.dumps(found.plots),
        "plots_along": json.dumps(found.plots_along),
    }
    variables, coordinates = (
        {key: xr.Variable(v.dims, v.values, {"units": v.units, "long_name": v.long_name}) for key, v in of.items()}
        for of in (found.variables, found.coordinates)
    )
    dataset = xr.Dataset(variables, coordinates, attrs)
    dataset.attrs["variables"] = results.variables_of(dataset)
    return dataset


def root_of(solution: Solution, more: dict[str, Any], *, balances: bool = True) -> xr.Dataset:
    """Times, energy balance and momenta."""
    time = ("time",)
    data = _balances(solution) if balances else {}
    for name, (dims, values, unit, text) in more.items():
        data[name] = xr.Variable(dims, values, {"units": unit, "long_name": text})
    times = xr.Variable(time, solution.t, {"units": "s", "long_name": "time"})
    return xr.Dataset(data, {"time": times, "axis": ("axis", list(AXES))})


def _balances(solution: Solution) -> dict[str, xr.Variable]:
    """Energies, work, losses and momenta over time."""
    balance, time = solution.balance, ("time",)

    def energy(values: Any, text: str) -> xr.Variable:
        return xr.Variable(time, np.asarray(values, dtype=float), {"units": "J", "long_name": text})

    data = {name: energy(balance[field], text) for name, (field, text) in _ENERGIES.items()}
    data["energy_released"] -= balance["released"][0]
    data["energy_elastic"] = energy(balance["elastic"] + balance["coupled"], "elastic energy")
    data["energy"] = energy(eb.energy(balance), "kinetic and elastic energy")
    data["energy_dissipated"] = energy(eb.dissipated(balance), "energy dissipated since the start")
    losses = np.stack([np.asarray(balance[name], dtype=float) for name in eb.LOSSES], axis=1)
    text = "energy dissipated since the start, by cause"
    data["energy_losses"] = xr.Variable((*time, "cause"), losses, {"units": "J", "long_name": text})
    data["cause"] = xr.Variable(("cause",), list(CAUSES), {"units": "1", "long_name": "what dissipates energy"})
    data["energy_defect"] = energy(
        solution.energy_defect,
        "energy minus that at the start and the work, plus the losses; negative: dissipated by the method",
    )
    data["energy_moved"] = energy(
        solution.energy_moved, "energy moved since the start: the largest of ranges of energies, work and losses"
    )
    momentum = solution.momentum
    for name, values, unit, text in (
        ("momentum", momentum.linear, "kg m s-1", "linear momentum of all parts, inertial axes"),
        ("angular_momentum", momentum.angular, "kg m2 s-1", "angular momentum of all parts about the origin"),
    ):
        data[name] = xr.Variable((*time, "axis"), values, {"units": unit, "long_name": text})
    return data
