"""Results as a tree: one group a part, times and balances at the root.

A group's attributes say how the part is drawn and plotted (``drawn``, ``plots`` and ``plots_along``, JSON), so that a
file needs nothing beside itself to be shown. ``variables`` lists what was written: a damaged file is recognised.

The root and a group are made when one of their variables or attributes is first asked for: observing the parts of a
small structure takes more time than its run.
"""

from __future__ import annotations

import functools
import json
import weakref
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.results import display, variables
from evolvent.results.happened import EVENTS, events_text
from evolvent.results.observe import has_results, observe
from evolvent.results.observe.variables import AXES, Variable
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.solution import Solution
from evolvent_base.units import units_as_written

#: Energies and work of the root, each with its field in the balance; their names are in `references.OF_THE_RUN` too.
_ENERGIES = {
    "energy_kinetic": ("kinetic", "kinetic energy"),
    "work_loads": ("loads", "work of loads and weight since the start"),
    "work_drives": ("drives", "work of drives since the start"),
    "work_spools": ("spools", "work of spools since the start"),
    "energy_released": ("released", "energy that nodes brought in at their release since the start"),
}
#: What dissipates energy, in the order of `evolvent.solvers.common.balance.LOSSES`.
CAUSES = ("mass damping", "stiffness damping", "contact", "friction", "joints", "springs")


#: Variables of the root that follow from the states at a sample and at the first one.
OF_A_SAMPLE = frozenset(_ENERGIES) | {
    "energy_elastic", "energy", "energy_dissipated", "energy_losses", "energy_defect", "momentum", "angular_momentum",
}  # fmt: skip

#: Solutions of trees that are in memory, by the identity of the tree.
_SOLUTIONS: dict[int, Solution] = {}


def keep_solution(tree: xr.DataTree, solution: Solution) -> None:
    """Keep the states of a run for `solution_of`, as long as its tree is in memory."""
    _SOLUTIONS[id(tree)] = solution
    weakref.finalize(tree, _SOLUTIONS.pop, id(tree), None)


def solution_of(tree: xr.DataTree) -> Solution | None:
    """The solution of a run that was kept; None of a copy, of a file and of others."""
    return _SOLUTIONS.get(id(tree))


def tree_of(
    solution: Solution,
    attrs: Callable[[], dict[str, Any]],
    root: dict[str, Any] | None = None,
    *,
    balances: bool = True,
) -> xr.DataTree:
    """A run as a tree of its parts.

    Parameters
    ----------
    solution : Solution
    attrs : returns the attributes of the root (`evolvent.results.attributes`)
    root : dict, optional, name -> (dims, values, units, long name), more variables of the root
    balances : bool, whether the root has energies and momenta
    """
    names = [name for name in solution.assembly.names if has_results(solution, name)]

    def make_root() -> xr.Dataset:
        found = root_of(solution, root or {}, balances=balances)
        found.attrs = attrs() | {"variables": results.variables_of(found), "parts": json.dumps(names)}
        return found

    tree = _Later.of(make_root, lambda: xr.Dataset(coords=_root_coordinates(solution, balances=balances)))
    _attach(tree, {name: _Later.of(functools.partial(_group, solution, name)) for name in names})
    return tree


#: Attributes of a node with its data, which are slots of xarray's class.
_DATA = (
    "_data_variables", "_node_coord_variables", "_node_dims", "_node_indexes", "_encoding", "_attrs", "_close",
)  # fmt: skip
#: Those of them from which groups inherit coordinates.
_INHERITED = "_node_coord_variables", "_node_indexes"
#: Whether xarray's class is as `_Later` needs it; if not, groups are made at once.
_CAN_WAIT = set(_DATA) < set(xr.DataTree.__slots__) and hasattr(xr.DataTree(), "__dict__")


class _Later(xr.DataTree):
    """A node whose data set is made when it is first asked for; it is a plain node from then on.

    Python calls `__getattr__` for a slot that is not set. Where one is set, the data set is made first.
    """

    __slots__ = ()

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.__class__ = xr.DataTree  # type: ignore[assignment]  # xarray makes new nodes of the class of an old one

    @classmethod
    def of(
        cls, make: Callable[[], xr.Dataset], coordinates: Callable[[], xr.Dataset] | None = None
    ) -> xr.DataTree:  # fmt: skip
        """A node without a parent, whose data set `make` returns; its groups inherit from `coordinates` until then."""
        if not _CAN_WAIT:
            return xr.DataTree(make())
        node = cls.__new__(cls)
        node._name = node._parent = None
        node._children, node._cache = {}, {}
        node.__dict__["make"], node.__dict__["coordinates"] = make, coordinates
        return node

    def __getattr__(self, name: str) -> Any:
        if name not in _DATA:
            return super().__getattr__(name)
        coordinates = self.__dict__.get("coordinates") if name in _INHERITED else None
        if coordinates is None:
            self._fill()
        else:
            made = xr.DataTree(coordinates())
            for slot in _INHERITED:
                xr.DataTree.__setattr__(self, slot, getattr(made, slot))
        return getattr(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _DATA:
            self._fill()
        xr.DataTree.__setattr__(self, name, value)  # whose class it may be by now

    def __reduce_ex__(self, protocol: Any) -> Any:
        self._fill()
        return self.__reduce_ex__(protocol)

    def _fill(self) -> None:
        """Make the data set."""
        make = self.__dict__.get("make")
        if make is None:  # another thread was first
            return
        made = xr.DataTree(make())
        for slot in _DATA:
            xr.DataTree.__setattr__(self, slot, getattr(made, slot))
        self.__class__ = xr.DataTree  # type: ignore[assignment]
        self.__dict__.pop("make", None)
        self.__dict__.pop("coordinates", None)


def _attach(tree: xr.DataTree, groups: dict[str, xr.DataTree]) -> None:
    """Attach groups to a tree without groups.

    Where they wait, without xarray's check that they have the same coordinates, for which it would ask for them.
    """
    if not _CAN_WAIT:
        tree.children = groups
        return
    for name, group in groups.items():
        tree._children[name] = group
        group._name, group._parent = name, tree


def _variable(found: Variable, written: Collection[str]) -> xr.Variable:
    """A variable with its attributes, and its extremes over all steps if these are known."""
    own = xr.Variable(found.dims, found.values, display.attributes(found.units, found.long_name, written))
    return own if found.extremes is None else variables.with_extremes(own, found.extremes)


def _group(solution: Solution, name: str) -> xr.Dataset:
    """Variables and coordinates of a part, and how it is drawn and plotted."""
    found, part = observe(solution, [name])[name], solution.assembly.parts[name]
    attrs = {
        "kind": type(part).model_fields["kind"].default,
        "drawn": json.dumps(found.drawn),
        "plots": json.dumps(found.plots),
        "plots_along": json.dumps(found.plots_along),
        **({"one_sided": json.dumps(found.one_sided)} if found.one_sided else {}),
        **({"given": json.dumps(found.given)} if found.given else {}),
        **({EVENTS: events_text(found.happened, name)} if found.happened else {}),
    }
    written = units_as_written(part)
    own, coordinates = (
        {key: _variable(v, written) for key, v in of.items()} for of in (found.variables, found.coordinates)
    )
    dataset = xr.Dataset(own, coordinates, attrs)
    dataset.attrs["variables"] = results.variables_of(dataset)
    return dataset


def root_of(solution: Solution, more: dict[str, Any], *, balances: bool = True) -> xr.Dataset:
    """Times, energy balance and momenta."""
    data = balances_of(solution) if balances else {}
    for name, (dims, values, unit, text) in more.items():
        data[name] = xr.Variable(dims, values, {"units": unit, "long_name": text})
    along = _root_coordinates(solution, balances=balances)
    return xr.Dataset(data, {name: one for name, one in along.items() if name not in data})


def _root_coordinates(solution: Solution, *, balances: bool) -> dict[str, Any]:
    """Coordinates of the root."""
    times = xr.Variable(("time",), solution.t, {"units": "s", "long_name": "time"})
    return ({"cause": _cause_coordinate()} if balances else {}) | {"time": times, "axis": ("axis", list(AXES))}


def _cause_coordinate() -> xr.Variable:
    """Coordinate of the losses by cause."""
    return xr.Variable(("cause",), list(CAUSES), {"units": "1", "long_name": "what dissipates energy"})


def balances_of(solution: Solution) -> dict[str, xr.Variable]:
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
    data["cause"] = _cause_coordinate()
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
