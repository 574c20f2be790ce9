"""Observations of nets: nodes, tensions and lengths of cords, and how they are drawn."""

from __future__ import annotations

import numpy as np

from evolvent.families.nets.cords import own_cords
from evolvent.results.observe.variables import Observed, Variable, observer
from evolvent.results.observe.view import View


@observer("nets")
def observe_net(view: View, name: str) -> Observed:
    """Positions of the nodes, lengths and tensions of the cords, and how many of them are slack."""
    index, found = view.index(name), Observed()
    nodes, cord = _parts(view, index)
    x = np.stack([view.marker(k)[0] for k in nodes], axis=1)
    ends = own_cords(view.model, index)
    cords = np.stack([ends["a"], ends["b"]], axis=1) - nodes.start
    found.along("position", "node", x, "m", "positions of the nodes, inertial axes")
    found.coordinate("node", "node", np.arange(len(nodes)), "1", "nodes in the order of the topology")
    found.coordinates["cord_nodes"] = Variable(("cord", "end"), cords, "1", "nodes at the ends of each cord")
    found.coordinate("cord", "cord", np.arange(len(cords)), "1", "cords of the net, of its rear net, and ties")
    found.coordinate("natural_length", "cord", ends["length"], "m", "lengths without tension")
    tension = cord["tension"]
    found.along("tension", "cord", tension, "N", "tensions of the cords")
    found.along("length", "cord", cord["distance"], "m", "lengths of the cords")
    found.scalar("least_tension", tension.min(axis=1), "N", "least tension of a cord")
    found.scalar("largest_tension", tension.max(axis=1), "N", "largest tension of a cord")
    found.scalar("slack_cords", (tension <= 0.0).sum(axis=1), "1", "number of cords without tension")
    found.scalar("energy_elastic", cord["stored"].sum(axis=1), "J", "elastic energy of the cords")
    found.drawn = [{"line": {"points": "position", "pieces": "cord_nodes", "values": ["tension"]}}]
    found.plots = ["least_tension", "largest_tension"]
    return found


def _parts(view: View, index: int) -> tuple[range, dict[str, np.ndarray]]:
    """Markers of the nodes of a net, and results (nt, n) of its cords."""
    row = view.model.nets[index]
    nodes = range(int(row["first_marker"]), int(row["first_marker"] + row["nodes"]))
    own = slice(int(row["first_spring"]), int(row["first_spring"] + row["cords"]))
    results = view.fields["springs"]
    return nodes, {key: results[key][:, own] for key in ("tension", "distance", "stored")}
