"""Observations of sheets that fold: fold angles of the creases, energy in their springs."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.families import bodies_of
from evolvent.elements.fold_files import Crease
from evolvent.families.origami.folding import edge_of
from evolvent.results.observe.variables import Observed, cross, dot, norm, observer
from evolvent.results.observe.view import View

Array = np.ndarray


@observer("origami")
def observe_origami(view: View, name: str) -> Observed:
    """Fold angles of the creases, without jumps, and the energy in their springs.

    Notes
    -----
    The fold angle of flexible facets is that between the means of their normals along the crease.
    """
    found, creases = Observed(), view.part(name).pattern.creases
    angles = np.zeros((view.t.size, len(creases)))
    for k, crease in enumerate(creases):
        right, axis = _side(view, name, crease, crease.right, crease.end)
        left, _ = _side(view, name, crease, crease.left, crease.begin)
        angles[:, k] = np.unwrap(np.arctan2(dot(cross(right, left), axis), norm(axis) * dot(left, right)))
    numbers = np.array([one.edge for one in creases], dtype=int)
    found.coordinate("crease", "crease", numbers, "1", "number of the edge in the file")
    found.along("fold_angle", "crease", angles, "rad", "fold angle of each crease, positive of valleys")
    begin, places = f"{name} crease ", view.assembly.names.items()
    springs = [place[1] for own, place in places if own.startswith(begin) and place[0] == "coordinates"]
    stored = view.fields["coordinates"]["stored"][:, springs].sum(axis=1) if springs else np.zeros(view.t.size)
    found.scalar("crease_energy", stored, "J", "energy in the springs and latches of all creases")
    found.plots = ["fold_angle", "crease_energy"]
    return found


def _side(view: View, name: str, crease: Crease, facet: int, begin: int) -> tuple[Array, Array]:
    """Normal of a facet at a crease, and the direction of the crease there, (nt, 3), inertial axes."""
    called, pattern = f"{name} facet {facet}", view.part(name).pattern
    family, index = view.assembly.names[called]
    if family == "bodies":
        R = view.pose(index).R
        return R[:, :, 2], R[:, :, :2] @ (pattern.x[crease.end] - pattern.x[crease.begin])
    word, along = edge_of(pattern.facets[facet], begin)
    nodes = bodies_of(view.model, family, index)
    poses = [view.pose(nodes[k]) for k in view.part(called).edge(word)]
    sense = along if begin == crease.begin else -along
    return np.mean([pose.R[:, :, 2] for pose in poses], axis=0), sense * (poses[-1].x - poses[0].x)
