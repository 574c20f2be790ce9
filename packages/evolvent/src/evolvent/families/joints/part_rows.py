"""Rows of the family `joints`: scalar constraints, or penalties in their place."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_sides import NOTHING, Side


def add_row(builder: Builder, kind: int, a: Side, b: Side, *, direction: Side = NOTHING, **fields: Any) -> int:
    """One scalar constraint; returns its index."""
    zero, found = np.zeros(3), (a, b, direction)
    whole = {
        "along": zero, "centre": zero, "axis": zero, "zero": zero, "radius": 0.0, "value": 0.0, "path": kernels.STILL,
        "drive": 0, "law": 0, "first": 0, "last": 0, "stiffness": 0.0, "damping": 0.0, "until": math.inf,
        "event": -1, "switch": -1, "prony": 0, "prony_end": 0, "branch": 0,
    }  # fmt: skip
    whole |= fields
    return builder.add(
        "joints",
        kind=kind,
        on=[side.on for side in found],
        index=[side.body for side in found],
        iq=[side.iq for side in found],
        iv=[side.iv for side in found],
        local=np.array([side.local for side in found]),
        **({"latest": whole["until"]} | whole),
    )
