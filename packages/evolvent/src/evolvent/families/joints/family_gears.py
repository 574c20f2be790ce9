"""Gears."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.ends import of_coordinate
from evolvent.model.family import Family, record
from evolvent.model.questions import Parts

Array = np.ndarray
_3 = (3,)


# angles and travels of gears, which are joints (`gear`); first, last of a joint: its coordinates; fields as
# those of joint coordinates
GEAR_COORDINATES = Family(
    "gear_coordinates",
    record(
        "kind body on other iq iv", "axis zero local factor", "angle before rate u g p0 q0 p1 q1",
        axis=_3, zero=_3, local=_3, u=_3, g=_3,
    ),
    order=300,
    of="joints",
    ends=of_coordinate,
    parts=Parts(changes=""),
)  # fmt: skip
