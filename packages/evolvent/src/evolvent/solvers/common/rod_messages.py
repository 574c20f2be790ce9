"""Elements of rods that bend or twist too far, in messages of runs that fail."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import bodies_of, owner
from evolvent.elements import rods
from evolvent.kernels.rotations import rotation_from_quaternion

#: Angle between the ends of an element, degrees, from which messages name it: that of an element at the start, at most.
#: Beyond 120 degrees strains are not defined; a step or a load factor that fails below this angle has other causes.
LARGE = 90.0


def bending_hint(assembly: Assembly, y: np.ndarray) -> str:
    """Hint on the element with the largest angle between its ends, "" below `LARGE`.

    Parameters
    ----------
    y : (ny,) float, the last state
    """
    model, worst, where = assembly.model, LARGE, ""
    for k, row in enumerate(model.rods):
        R = np.empty((int(row["elements"]) + 1, 3, 3))
        for i, b in enumerate(bodies_of(model, "rods", k)):
            q = int(model.bodies["iq"][b]) + 3
            rotation_from_quaternion(*y[q : q + 4], R[i])
        if not np.all(np.isfinite(R)):
            continue
        turns = np.degrees(np.linalg.norm(rods.strains(np.zeros((len(R), 3)), R, 1.0)[:, 3:], axis=1))
        if turns.max() >= worst:
            worst, element = float(turns.max()), int(turns.argmax())
            where = (
                f"; element {element} of {owner(assembly, 'rods', k)!r} is bent or twisted by {worst:.0f} deg "
                f"(limit: 120 deg): use more `elements`"
            )
    return where
