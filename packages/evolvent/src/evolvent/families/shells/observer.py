"""Observations of shells: shape, stress resultants and energies."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.families import bodies_of
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View

#: Fields of an element of which the shell has the sum.
_SUMS = ("stored", "bent", "drilled")


@observer("shells")
def observe_shell(view: View, name: str) -> Observed:
    """Positions and normals of the nodes, stress resultants, energies and momenta of a shell.

    Notes
    -----
    Resultants are those in the middle of each element, in its axes: the first one is axis 1 in the element's plane.
    """
    index, found = view.index(name), Observed()
    poses = [view.pose(b) for b in bodies_of(view.model, "shells", index)]
    found.along("position", "node", np.stack([pose.x for pose in poses], axis=1), "m", "positions, inertial axes")
    normals = np.stack([pose.R[:, :, 2] for pose in poses], axis=1)
    found.along("normal", "node", normals, "1", "normals at the nodes, inertial axes")
    row, fields = view.model.shells[index], view.fields["shell_elements"]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    found.results_along("shell_elements", fields, own, "element", _SUMS, "in the middle of each element")
    found.results("shells", view.fields["shells"], index)
    for field in _SUMS:
        called, *described = RESULTS["shell_elements"][field]
        found.scalar(called, fields[field][:, own].sum(axis=1), *described)
    found.plots = ["energy_elastic"]
    return found
