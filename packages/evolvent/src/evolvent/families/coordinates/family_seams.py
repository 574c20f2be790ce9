"""Seams: edges that are joined node by node, whose forces are those of joints and of the springs of coordinates."""

from __future__ import annotations

from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import AdjointSupport, Advice, Parts, Statics, never
from evolvent.model.shares import Shares

# nodes: of the edge, each with a joint of its own but those that stand still; sprung: 1 where these have springs;
# sense: -1 where the joints have the ground as their first side, 1 else
SEAMS = Family(
    "seams",
    record("nodes sprung sense"),
    order=330,
    kinds=(
        Kind("a seam", symmetric=True),
    ),
    isolated=True,
    smooth=True,
    shares=Shares(),
    advice=Advice(explicit=True),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("joints hold it", timed=False, rates=False, smooth=True),
    parts=Parts(reads_inertia=False),
    statics=Statics(uneven=never),
)  # fmt: skip
