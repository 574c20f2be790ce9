"""Ways of setting a planned body swinging: a pull at a spring, at two springs together, or at a point."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from evolvent_massprops.excitation_keys import excitation_on
from evolvent_massprops.inertia import Load, NormalModes, best_point, coordinates, least_energy
from evolvent_massprops.spring_keys import Planned

Array = np.ndarray
#: Shares of the force of which the two parts of a pull at two springs have; a negative one pulls up.
SHARES = ((1 / 2, 1 / 2), (1 / 2, -1 / 2), (2 / 3, 1 / 3), (2 / 3, -1 / 3), (1 / 3, 2 / 3), (1 / 3, -2 / 3))


class Pull(NamedTuple):
    """What sets a recording swinging.

    Attributes
    ----------
    label : str, where it acts
    kind : {"spring", "two springs", "point", "given"}
    z : (m,) complex, modal coordinates
    least : float, J, energy of the weakest of heave, roll and pitch
    """

    label: str
    kind: str
    z: Array
    least: float


def pulls_of(planned: Planned, springs: Array, modes: NormalModes) -> tuple[Pull, ...]:
    """The excitation that a description states, or the pulls that are compared.

    Parameters
    ----------
    planned : Planned
    springs : (n, 3) float, m, body points of the springs
    modes : NormalModes

    Notes
    -----
    Pulled down by the force that is stated: at each spring; at the two springs, with shares of it of which one may pull
    up, whose weakest mode has most energy; at the point between the springs for which that holds.
    """
    if planned.excitation is not None:
        planned.excitation.check_springs(len(springs), "plan.excitation")
        found = excitation_on(planned.excitation, springs, modes)
        label = f"spring {found.spring}" if found.spring else "the place stated" if found.loads else "the state stated"
        return (Pull(label, "given", found.z, float(modes.energy(found.z)[modes.vertical].min())),)
    assert planned.force is not None
    down, every = np.array([0.0, -planned.force, 0.0]), []
    if "spring" in planned.places:
        every += [_pull(f"spring {k + 1}", "spring", modes, [Load(down, p)]) for k, p in enumerate(springs)]
    if "two springs" in planned.places:
        pairs = [
            _pull(_of_pair(i, j, one, other), "two springs", modes,
                  [Load(one * down, springs[i]), Load(other * down, springs[j])])
            for i, j in itertools.combinations(range(len(springs)), 2)
            for one, other in SHARES
        ]  # fmt: skip
        every.append(max(pairs, key=lambda pull: round(pull.least, 9)))
    if "point" in planned.places:
        point = best_point(modes, springs, down)
        label = f"point x = {point[0]:.3g} m, z = {point[2]:.3g} m"
        every.append(_pull(label, "point", modes, [Load(down, point)]))
    return tuple(every)


def _pull(label: str, kind: str, modes: NormalModes, loads: list[Load]) -> Pull:
    return Pull(label, kind, coordinates(modes, loads), float(least_energy(modes, loads)))


def _of_pair(i: int, j: int, one: float, other: float) -> str:
    text = {1 / 2: "1/2", 1 / 3: "1/3", 2 / 3: "2/3"}
    way = "down" if other > 0.0 else "up"
    return f"springs {i + 1} and {j + 1} ({text[one]} down, {text[abs(other)]} {way})"
