"""Resistances."""

from __future__ import annotations

import numpy as np

from evolvent.kernels import resistance
from evolvent.kernels.ends import of_coordinates
from evolvent.model.family import EVERY, EXPLICIT, Family, Kind, record, where
from evolvent.model.layout import Accounts, Switches

Array = np.ndarray


# resistances on coordinates that depend on the path (`kernels.resistance`): curves from `curve` on, bristles from
# first to last; start: number of the first curve, switch: index of that of the present one; account: of what is
# lost. time: s, of the last change of the curve, changes: how many there were
RESISTANCES = Family(
    "resistances",
    record(
        "coordinate kind curve curves first last start switch account",
        "",
        "angle rate torque rubs stored time changes",
    ),
    order=290,
    results={
        "angle": ("angle", "rad", "angle on which it acts"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque, positive against the angle"),
        "rubs": ("hysteresis_torque", "N m", "torque of the bristles, part of the torque"),
        "stored": ("energy_elastic", "J", "elastic energy"),
    },
    kinds=(
        Kind("a harness", which=where("kind", resistance.HARNESS), symmetric=True),
        Kind(
            "a tape-spring hinge", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, whose steps end where it snaps",
            which=where("kind", resistance.TAPE_SPRING),
            symmetric=True,
        ),
        Kind(
            "an adhesion", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, whose steps end where it breaks",
            which=where("kind", resistance.ADHESION),
            symmetric=True,
        ),
    ),
    ends=of_coordinates("coordinate"),
    through=True,
    accounts=(Accounts(1),),
    switches=(Switches(1, lambda found, _: found["start"]),),
)  # fmt: skip

# first, count: of the coordinates among the parameters, then the torques and the energies; low, high: where the
# curve ends, and below, above: the number of the curve behind that
CURVES = Family(
    "curves",
    record("first count below above", "low high"),
    order=300,
    of="resistances",
)  # fmt: skip

# before, force0: coordinate and force at the start of a step; slips: the sense in which it slips; account: of the
# force
BRISTLES = Family(
    "bristles",
    record("kind account", "stick limit", "before force0 force slips"),
    order=310,
    of="resistances",
    accounts=(Accounts(1, start="force0"),),
    rubs=lambda found: np.ones(found.size, dtype=bool),
)  # fmt: skip
