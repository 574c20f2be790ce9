"""Links and guides."""

from __future__ import annotations

import numpy as np

from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import AdjointSupport, never
from evolvent.model.shares import Shares

Array = np.ndarray
_3 = (3,)


LINKS = Family(
    "links",
    record("a b sense", "length drum axis zero", axis=_3, zero=_3),
    order=310,
    kinds=(
        Kind("a link", symmetric=True),
    ),
    isolated=True,
    smooth=True,
    shares=Shares(),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("joints hold it", timed=False),
    uneven=never,
)  # fmt: skip

# kind 0: the body's centre keeps its coordinate `value` along the direction; 1: the body's axis stays across it
GUIDES = Family(
    "guides",
    record("kind body", "direction axis value", direction=_3, axis=_3),
    order=320,
    kinds=(
        Kind("a guide", symmetric=True),
    ),
    isolated=True,
    smooth=True,
    shares=Shares(),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("joints hold it", timed=False),
    uneven=never,
)  # fmt: skip
