"""Forces per length on rods, as forces at their nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import loads as kernels, springs
from evolvent.parts.expression import write_law
from evolvent.parts.load_window import FRAMES, window
from evolvent.parts.profile import write_profile


def is_rod(builder: Builder, name: str) -> bool:
    """Whether a part that has been added is a rod."""
    return bool(builder.names.get(name, ("",))[0] == "rods")


def write_line_load(builder: Builder, name: str, load: Any, vector: np.ndarray) -> None:
    """Write a `LineLoad` on a rod into the family `loads`: a force at each node, in the order of the nodes.

    Parameters
    ----------
    vector : (3,) float, N/m, of the load, or its direction, which a profile multiplies; ones, which a law multiplies

    Notes
    -----
    The force on half an element acts a sixth of the element from the node, on the line of centroids: of a uniform load
    these are the consistent forces q h/2 and moments q h^2/12. The force and its point in the section's axes are fixed,
    so that the load has a potential.
    """
    rod = builder.specs[load.part]
    row = builder.rows["rods"][builder.names[load.part][1]]
    end, rest, law = window(builder, name, load), [], {}
    if load.profile is not None:
        rest = write_profile(builder, f"{name}.profile", load.profile)
    if load.law is not None:
        found = write_law(builder, name, load.law, "force", load.parameters, load.constants)
        law = {"law": found["law"], "law_first": found["first"], "law_last": found["last"]}
    lengths, along = rod.centres()
    places = rod.arms() + np.outer(along, [1.0, 0.0, 0.0])
    times, index = [FRAMES["inertial"], load.start, end, load.ramp], len(builder.rows["loads"])
    for i, (length, place) in enumerate(zip(lengths, places, strict=True)):
        target = builder.add("markers", kind=springs.ON_BODY, index=row["first_body"] + i, local=place)
        first, last = builder.parameters([*(length * vector), *times, *rest])
        whole = {"law": 0, "law_first": 0, "law_last": 0, "node": -1, "attitude": 0, "scale": 1.0, **law}
        builder.add("loads", kind=kernels.AT_MARKER, target=target, first=first, last=last, **whole)
    builder.names[name] = ("loads", index)
