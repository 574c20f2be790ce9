"""compas_fd: the form of a net on ribs, for `tests/nets/test_net_forms.py`.

In an environment of its own: `pip install compas-fd==0.5.4`, then
`python benchmarks/peers/nets_with_compas_fd.py tests/nets/data/compas_fd.json`.
"""

from __future__ import annotations

import importlib.metadata
import json
import pathlib
import sys

import numpy as np
from compas_fd.solvers import fd_numpy
from net_on_ribs import problem


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
