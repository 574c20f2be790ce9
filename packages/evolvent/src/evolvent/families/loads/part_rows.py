"""Rows of the families `loads` and `beam_loads`, which loads and radiation write."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import split_reference
from evolvent.kernels import loads as kernels, markers
from evolvent.parts.base import Spread
from evolvent.parts.profile import write_profile
from evolvent_base.errors import InputError

FRAMES = {"inertial": 0.0, "body": 1.0}
Frame = Literal["inertial", "body"]


def window(builder: Builder, name: str, load: Any) -> tuple[float, float, float]:
    """Start, end and ramp of a load with the keys `start`, `until` and `ramp`, s; its times become breaks."""
    end = end_of(name, load)
    times = (load.start, load.start + load.ramp if load.ramp else 0.0, end)
    builder.breaks.update(t for t in times if math.isfinite(t) and t > 0.0)
    return load.start, end, load.ramp


def end_of(name: str, load: Any) -> float:
    """When a load ends, s; infinite of one that never does."""
    if load.until is not None and not load.until > load.start:
        raise InputError(f"{name}.until is {load.until!r} s; it must be after {name}.start, {load.start!r} s")
    return math.inf if load.until is None else float(load.until)


def add_load(builder: Builder, kind: int, target: int, values: Sequence[float] | None = None, **fields: Any) -> int:
    """Append a row of the family `loads`, with its parameters; returns its index."""
    if values is not None:
        fields["first"], fields["last"] = builder.parameters(values)
    return builder.add("loads", kind=kind, target=target, **{"law": 0, "node": -1, "scale": 1.0, **fields})


def add_beam_load(builder: Builder, name: str, kind: int, beam: int, load: Any, **fields: Any) -> None:
    """Append a row of the family `beam_loads`: when the load acts, and its profile."""
    end = end_of(name, load)
    if load.profile is not None:
        fields["first"], fields["last"] = builder.parameters(write_profile(builder, f"{name}.profile", load.profile))
    whole = {"iq": -1, "iv": -1, "value": 1.0, "start": load.start, "end": end, "ramp": load.ramp, **fields}
    builder.names[name] = ("beam_loads", builder.add("beam_loads", kind=kind, beam=beam, **whole))


def refuse_ground(builder: Builder, name: str, at: Any, target: int) -> None:
    """Refuse a load whose marker is on the ground."""
    marker = builder.rows["markers"][target]
    if marker["kind"] == markers.ON_BODY and marker["index"] == builder.names["ground"][1]:
        raise InputError(f"{name}.at is {at!r}, on the ground, which no load moves; give a body, a point or a node")


def add_rod_loads(builder: Builder, name: str, kind: int, rod: str, vector: np.ndarray, rest: Sequence[float],
                  **fields: Any) -> None:  # fmt: skip
    """Append rows of the family `loads` at the nodes of a rod, in their order: a force per length as a force at each.

    Parameters
    ----------
    vector : (3,) float, times the length of the share of each node; of a force per length, N/m, inertial axes
    rest : parameters behind the vector and its frame

    Notes
    -----
    The force on half an element acts a sixth of the element from the node, on the line of centroids: of a uniform load
    these are the consistent forces q h/2 and moments q h^2/12. The force and its point in the section's axes are fixed,
    so that the load has a potential.
    """
    part, index = builder.specs[rod], len(builder.rows["loads"])
    paid = 1 + builder.names[rod][1] if part.payout is not None else 0
    if paid and kind != kernels.PANEL:
        raise InputError(
            f"{name} is a load along {rod!r}, whose length changes ({rod}.payout), which is not supported; give "
            f"light, weight or a force at its tip, or leave out {name}"
        )
    first_body = builder.rows["rods"][builder.names[rod][1]]["first_body"]
    lengths, along = part.centres()
    places = part.arms() + np.outer(along, [1.0, 0.0, 0.0])
    for i, (length, place) in enumerate(zip(lengths, places, strict=True)):
        target = builder.add("markers", kind=markers.ON_BODY, index=first_body + i, local=place)
        add_load(builder, kind, target, [*(length * vector), FRAMES["inertial"], *rest], rod=paid, **fields)
    builder.names[name] = ("loads", index)


def spread_of(builder: Builder, along: str) -> Spread | None:
    """Nodes of an edge or a surface; None of other parts, and where there is no such part."""
    part, on = split_reference(along)
    return builder.specs[part].spread(part, on) if part in builder.specs else None
