"""compas_fd: the form of a net on ribs, for `tests/nets/test_net_forms.py`.

In an environment of its own: `pip install compas-fd==0.5.4`, then
`python benchmarks/peers/nets_with_compas_fd.py tests/nets/data/compas_fd.json`.
"""

from __future__ import annotations

import importlib.metadata
import json
import pathlib
import sys
from typing import Any

import numpy as np
from compas_fd.solvers import fd_numpy

RIBS, STATIONS, ACROSS, RADIUS, FOCAL = 8, 4, 3, 5.0, 4.0


def problem() -> dict[str, Any]:
    """A net between eight ribs on a paraboloid, with uneven force densities and loads along the axis."""
    count = RIBS * ACROSS
    nodes = []
    for i in range(STATIONS + 1):
        r = 0.8 + (RADIUS - 0.8) * i / STATIONS
        for k in range(count):
            angle = 2.0 * np.pi * k / count
            nodes.append([r * np.cos(angle), r * np.sin(angle), r * r / (4.0 * FOCAL)])
    ring = [[i * count + k, i * count + (k + 1) % count] for i in range(STATIONS + 1) for k in range(count)]
    along = [[i * count + k, (i + 1) * count + k] for i in range(STATIONS) for k in range(count) if k % ACROSS]
    cords = ring + along
    rim = [i * count + k for i in range(STATIONS + 1) for k in range(0, count, ACROSS)]
    density = [2.0 + np.sin(0.7 * k) for k in range(len(cords))]
    loads = [0.0 if k in rim else -0.3 for k in range(len(nodes))]
    return {"nodes": nodes, "cords": cords, "rim": rim, "density": density, "loads": loads}


def main(path: str) -> None:
    """Write the problem with its solution."""
    given = problem()
    loads = [[0.0, 0.0, load] for load in given["loads"]]
    found = fd_numpy(
        vertices=given["nodes"], fixed=given["rim"], edges=[tuple(cord) for cord in given["cords"]],
        forcedensities=given["density"], loads=loads,
    )  # fmt: skip
    made = {
        "made by": f"compas_fd {importlib.metadata.version('compas_fd')}", **given,
        "x": np.asarray(found.vertices).tolist(), "tension": np.ravel(found.forces).tolist(),
    }  # fmt: skip
    pathlib.Path(path).write_text(json.dumps(made) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
