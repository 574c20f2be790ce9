"""Tapes."""

from __future__ import annotations

import numpy as np

from evolvent.model.family import Family, record

Array = np.ndarray


# sections of rods that flatten (`kernels.tape`). bending: stiffness of the wall times the width, N m2; transverse:
# its curvature without stress, 1/m; slenderness: u over the square of the curvature, m2; twisting: m2; stretching:
# g over u; closed: 1 of a lenticular section
TAPES = Family(
    "tapes",
    record("first_node nodes closed", "bending poisson transverse slenderness twisting stretching"),
    order=200,
    of="rods",
    owner=lambda records, k: ("rods", int(np.flatnonzero(records("rods")["tape"] == k + 1)[0])),
)  # fmt: skip

# the coordinate of a node; alpha: damping by mass, 1/s; value0, value1: at the ends of a step; before: its change
# over the step before
TAPE_NODES = Family(
    "tape_nodes",
    record("iq iv", "mass alpha", "value rate force value0 value1 before"),
    order=210,
    results={
        "value": ("transverse_curvature", "m-1", "curvature of the section at each node, 0 where it is flat"),
    },
    of="rods",
)  # fmt: skip
