"""Bearings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels.ends import of_coordinate, of_joint
from evolvent.model.family import EVERY, EXPLICIT, End, Family, Kind, Records, record
from evolvent.model.layout import Accounts

Array = np.ndarray
_3 = (3,)


def _of_bearing(row: Any, records: Records) -> Iterator[End]:
    for k in range(int(row["first"]), int(row["last"])):
        yield from of_joint(records("joints")[k], records)
    yield from of_coordinate(records("coordinates")[int(row["coordinate"])], records)


# friction by the reactions of a joint, whose rows are first to last, on a coordinate of its own
# (`kernels.bearing`); account: of what it has dissipated. by_force, by_moment, by_axis: derivatives of the load by
# the force and the moment on the second body, and by the axis; slips: the sense in which it slides, noted: friction
# at the iteration before; relax, fresh: under generalized-alpha. Of the last step: bristle0, rubs0, slips0, anchor
BEARINGS = Family(
    "bearings",
    record(
        "coordinate first last account",
        "coefficient static radial axial twist constant arm stick",
        "load by_force by_moment by_axis radial_force axial_force tilting slope limit angle rate "
        "bristle slips rubs noted relax fresh stored bristle0 rubs0 slips0 anchor",
        by_force=_3, by_moment=_3, by_axis=_3,
    ),
    order=320,
    results={
        "angle": ("angle", "rad", "angle since the start"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "rubs": ("torque", "N m", "torque of friction, positive against the angle"),
        "limit": ("torque_limit", "N m", "torque of friction that slides under the present load"),
        "radial_force": ("radial_force", "N", "sum of the forces across the axis on both ends of the bearing"),
        "axial_force": ("axial_force", "N", "force along the axis on the second part"),
        "tilting": ("tilting_moment", "N m", "moment across the axis on the second part, about the joint's position"),
        "stored": ("energy_elastic", "J", "elastic energy of the bristle"),
    },
    kinds=(
        Kind(
            "a bearing", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, which find friction and reactions together",
        ),
    ),
    ends=_of_bearing,
    through=True,
    accounts=(Accounts(1),),
)  # fmt: skip
