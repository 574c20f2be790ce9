"""Links and guides."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import AdjointSupport, Advice, Parts, Statics, never
from evolvent.model.shares import Shares

Array = np.ndarray
_3 = (3,)


def _unmet_link(name: str, gap: float, rate: float, length: float, moves: bool) -> str:
    if abs(gap) > 1e-6 * length:
        return f"link {name!r}: its ends are {length + gap:.9g} m apart at the start, its length is {length:.9g} m"
    return f"link {name!r}: its ends part at {rate:.6g} m/s at the start; give velocities that keep it" if moves else ""


def _unmet_guide(name: str, _: float, rate: float, __: float, moves: bool) -> str:
    return f"guide {name!r}: the body moves against it, at {rate:.6g}, at the start" if moves else ""


#: What is said of both: their constraints are records of the family `joints`.
_HELD_BY_JOINTS: dict[str, Any] = {
    "isolated": True,
    "smooth": True,
    "shares": Shares(),
    "advice": Advice(explicit=True),
    "of_step": False,
    "stiff": False,
    "adjoint": AdjointSupport("joints hold it", timed=False, rates=False, smooth=True),
    "statics": Statics(uneven=never),
}

LINKS = Family(
    "links",
    record("a b sense", "length drum axis zero", axis=_3, zero=_3),
    order=310,
    kinds=(
        Kind("a link", symmetric=True),
    ),
    **_HELD_BY_JOINTS,
    parts=Parts(unmet=_unmet_link),
)  # fmt: skip

# kind 0: the body's centre keeps its coordinate `value` along the direction; 1: the body's axis stays across it
GUIDES = Family(
    "guides",
    record("kind body", "direction axis value", direction=_3, axis=_3),
    order=320,
    kinds=(
        Kind("a guide", symmetric=True),
    ),
    **_HELD_BY_JOINTS,
    parts=Parts(unmet=_unmet_guide),
)  # fmt: skip
