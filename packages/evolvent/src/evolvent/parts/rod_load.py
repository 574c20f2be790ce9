"""Forces per length on rods, as forces at their nodes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import loads as kernels, springs
from evolvent.parts.expression import write_law
from evolvent.parts.load_window import FRAMES, window
from evolvent.parts.profile import write_profile
from evolvent_base.errors import InputError


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
    end, rest, law = window(builder, name, load), [], {}
    if load.profile is not None:
        rest = write_profile(builder, f"{name}.profile", load.profile)
    if load.law is not None:
        found = write_law(builder, name, load.law, "force", load.parameters, load.constants)
        law = {"law": found["law"], "law_first": found["first"], "law_last": found["last"]}
    _write_rows(builder, name, load.part, kernels.AT_MARKER, vector, [load.start, end, load.ramp, *rest], law)


def write_light(builder: Builder, name: str, rod: str, light: np.ndarray, optics: Sequence[float]) -> None:
    """Write light on a rod, a strip whose normal is y of its section, into the family `loads`: a panel at each node.

    Parameters
    ----------
    light : (3,) float, N/m, pressure times width along the light
    optics : fractions that are reflected specularly and diffusely
    """
    _write_rows(builder, name, rod, kernels.PANEL, light, [0.0, math.inf, 0.0, 0.0, 1.0, 0.0, *optics], {})


def _write_rows(builder: Builder, name: str, rod: str, kind: int, vector: np.ndarray, rest: Sequence[float],
                law: dict[str, int]) -> None:  # fmt: skip
    """Write loads of a kind at the nodes of a rod: the vector times the lengths of their shares, inertial axes."""
    part, index = builder.specs[rod], len(builder.rows["loads"])
    paid = 1 + builder.names[rod][1] if part.payout is not None else 0
    if paid and kind != kernels.PANEL:
        raise InputError(
            f"{name} is a line load on {rod!r}, whose length changes ({rod}.payout), which is not supported; give "
            f"light, weight or a force at its tip, or leave out {name}"
        )
    first_body = builder.rows["rods"][builder.names[rod][1]]["first_body"]
    lengths, along = part.centres()
    places = part.arms() + np.outer(along, [1.0, 0.0, 0.0])
    for i, (length, place) in enumerate(zip(lengths, places, strict=True)):
        target = builder.add("markers", kind=springs.ON_BODY, index=first_body + i, local=place)
        first, last = builder.parameters([*(length * vector), FRAMES["inertial"], *rest])
        whole = {"law": 0, "law_first": 0, "law_last": 0, "node": -1, "attitude": 0, "scale": 1.0, "rod": paid, **law}
        builder.add("loads", kind=kind, target=target, first=first, last=last, **whole)
    builder.names[name] = ("loads", index)
