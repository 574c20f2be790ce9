"""The cords and nodes of a net in a model: what analyses of nets read and write of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.kernels import markers
from evolvent.results.observe.view import View
from evolvent.solvers.common.solution import Solution

Array = np.ndarray


class Held(NamedTuple):
    """Nodes of a net in a state, inertial axes.

    Attributes
    ----------
    x : (n, 3) float, m
    turns, arms : (n, 3, 3) and (n, 3) float, m, attitudes of the bodies that have nodes, and the places of these from
        their origins; of other nodes one and zero
    """

    x: Array
    turns: Array
    arms: Array


def names(assembly: Assembly) -> list[str]:
    """Names of the nets of a system."""
    return [name for name, (family, _) in assembly.names.items() if family == "nets"]


def _own(model: Any, index: int) -> slice:
    """Which springs are the cords of a net."""
    row = model.nets[index]
    return slice(int(row["first_spring"]), int(row["first_spring"] + row["cords"]))


def own_cords(model: Any, index: int) -> Array:
    """Records of the cords of a net, which are springs."""
    found: Array = model.springs[_own(model, index)]
    return found


def samples_of_cords(view: View, index: int) -> dict[str, Array]:
    """Samples (nt, m) of what the records of the cords hold, by field."""
    own = _own(view.model, index)
    return {name: values[:, own] for name, values in view.fields["springs"].items()}


def extremes_of_cords(view: View, index: int, field: str) -> Array | None:
    """Least and largest values over all steps of a field of each cord, (2, m) float; None if they are not known."""
    return view.fields["springs"].extremes_of(field, _own(view.model, index))


def samples_of_nodes(view: View, index: int) -> tuple[Array, dict[str, Array]]:
    """Positions (nt, n, 3), m, of the nodes of a net that move, and what the records of these points hold, by field."""
    row = view.model.nets[index]
    own = slice(int(row["first_point"]), int(row["first_point"] + row["points"]))
    places = [view.coordinates(int(point["iq"])) for point in view.model.points[own]]
    x = np.stack(places, axis=1) if places else np.zeros((len(view.t), 0, 3))
    return x, {name: values[:, own] for name, values in view.fields["points"].items()}


class NetCords:
    """Cords and nodes of a net.

    Attributes
    ----------
    nodes : range, markers of the nodes
    ends : (m, 2) int, nodes at the ends of the cords
    iq, iv : (n,) int, indices in the state of the first coordinate of each node that is a point, -1 of the others; and
        of the first velocity of each, or of the body that has it, -1 of those that stand
    """

    def __init__(self, assembly: Assembly, name: str) -> None:
        self._model, self._index = assembly.model, assembly.index(name, "nets")
        model, row = self._model, self._model.nets[self._index]
        self.nodes = range(int(row["first_marker"]), int(row["first_marker"] + row["nodes"]))
        self.ends = np.stack([self.records["a"], self.records["b"]], axis=1) - self.nodes.start
        self.iq, self.iv = np.full((2, len(self.nodes)), -1)
        for k, marker in enumerate(self._markers):
            point = marker["kind"] == markers.ON_POINT
            record = (model.points if point else model.bodies)[marker["index"]]
            self.iq[k], self.iv[k] = record["iq"] if point else -1, record["iv"]

    @property
    def records(self) -> Array:
        """Records of the cords, with stiffness (N/m), damping (N s/m) and natural length (m)."""
        return own_cords(self._model, self._index)

    @property
    def _markers(self) -> Array:
        found: Array = self._model.markers[self.nodes.start : self.nodes.stop]
        return found

    def held(self, solution: Solution) -> Held:
        """The nodes in a solution with one sample."""
        view = View(solution, joints=False)
        x = np.stack([view.marker(k)[0][0] for k in self.nodes])
        turns, arms = np.tile(np.eye(3), (len(x), 1, 1)), np.zeros_like(x)
        for k in np.flatnonzero(self.iq < 0):
            marker = self._markers[k]
            turns[k] = view.pose(int(marker["index"])).R[0]
            arms[k] = turns[k] @ marker["local"]
        return Held(x, turns, arms)
