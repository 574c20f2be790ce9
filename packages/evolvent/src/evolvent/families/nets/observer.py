"""Observations of nets: nodes, tensions and lengths of cords, and how they are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.families.nets.cords import extremes_of_cords, own_cords, samples_of_cords, samples_of_nodes
from evolvent.results.observe.variables import Observed, Variable, observer
from evolvent.results.observe.view import View
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.nets.surface import Surface

#: How cords are drawn: as lines in colours by their tensions.
_CORDS = {"line": {"points": "position", "pieces": "cord_nodes", "values": ["tension"]}}


@observer("nets")
def observe_net(view: View, name: str) -> Observed:
    """Positions of the nodes, lengths and tensions of the cords, and how many of them are slack."""
    index, found = view.index(name), Observed()
    row, fields = view.model.nets[index], samples_of_cords(view, index)
    nodes = range(int(row["first_marker"]), int(row["first_marker"] + row["nodes"]))
    x = np.stack([view.marker(k)[0] for k in nodes], axis=1)
    ends = own_cords(view.model, index)
    cords = np.stack([ends["a"], ends["b"]], axis=1) - nodes.start
    found.along("position", "node", x, "m", "positions of the nodes, inertial axes")
    found.coordinate("node", "node", np.arange(len(nodes)), "1", "nodes in the order of the topology")
    found.coordinates["cord_nodes"] = Variable(("cord", "end"), cords, "1", "nodes at the ends of each cord")
    found.coordinate("cord", "cord", np.arange(len(cords)), "1", "cords of the net, of its rear net, and ties")
    found.coordinate("natural_length", "cord", ends["length"], "m", "lengths without tension")
    tension, over = fields["tension"], extremes_of_cords(view, index, "tension")
    found.along("tension", "cord", tension, "N", "tensions of the cords", extremes=over)
    found.along("length", "cord", fields["distance"], "m", "lengths of the cords")
    least = largest = None
    if over is not None:
        least, largest = over.min(axis=1), over.max(axis=1)
        least[1], largest[0] = np.nan, np.nan
    found.scalar("least_tension", tension.min(axis=1), "N", "least tension of a cord", extremes=least)
    found.scalar("largest_tension", tension.max(axis=1), "N", "largest tension of a cord", extremes=largest)
    found.scalar("slack_cords", (tension <= 0.0).sum(axis=1), "1", "number of cords without tension")
    net = view.assembly.parts[name]
    front = net.seen(x[:, : len(net.layout(name).plan)])
    error = np.array([_error(one, net.surface) for one in front])
    found.scalar("surface_error", error, "m", "rms distance of the nodes from the wanted surface, along its axis")
    found.scalar("energy_elastic", fields["stored"].sum(axis=1), "J", "elastic energy of the cords")
    places, nodal = samples_of_nodes(view, index)
    found.scalar("energy_kinetic", nodal["kinetic"].sum(axis=1), "J", "kinetic energy of the nodes")
    found.vector("momentum", nodal["linear"].sum(axis=1), "kg m s-1", "linear momentum, inertial axes")
    spin = np.cross(places, nodal["linear"]).sum(axis=1)
    found.vector("angular_momentum", spin, "kg m2 s-1", "angular momentum about the inertial origin")
    found.drawn = [_CORDS]
    found.plots = ["least_tension", "largest_tension"]
    return found


def _error(x: np.ndarray, surface: Surface) -> float:
    """Rms distance, m, of nodes (n, 3) from a surface along z; nan where they are beyond what its formula is for."""
    try:
        off = x[:, 2] - surface.height(x[:, 0], x[:, 1])
    except InputError:
        return float("nan")
    return float(np.sqrt(np.mean(off**2)))
