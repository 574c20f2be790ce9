"""What releases a joint or switches off a motor: a time, an event, or the latch of a spring."""

from __future__ import annotations

import math
from typing import Annotated, Any

from evolvent.assembly.builder import Builder
from evolvent.kernels.axial import REACHED
from evolvent.parts.base import Reference
from evolvent_base.errors import InputError, nearest

ReleaseName = Annotated[str, Reference(what="an event, or a spring with a latch")]


def release_fields(builder: Builder, name: str, part: Any) -> dict[str, Any]:
    """Fields of a row by the keys `until` and `released_by` of a part."""
    until = math.inf if part.until is None else float(part.until)
    fields = {"until": until, "latest": until, "event": -1, "switch": -1}
    if part.released_by is None:
        return fields
    family, index = builder.names.get(part.released_by, ("", -1))
    if family == "events":
        return fields | {"event": index}
    key = f"{name}.released_by is {part.released_by!r}"
    if family != "coordinates":
        known = [
            n for n, (f, k) in builder.names.items() if f == "events" or (f == "coordinates" and _latches(builder, k))
        ]
        raise InputError(
            f"{key}, neither an event nor a spring with a latch"
            + (f"; {nearest(part.released_by, known)}" if known else "; there is none of either")
        )
    if not _latches(builder, index):
        raise InputError(f"{key}, a spring without a latch; give {part.released_by}.latch, or name an event")
    row = builder.rows["coordinates"][index]
    if abs(row["angle"] - row["latch"]) <= REACHED:
        raise InputError(f"{key}, whose latch is locked from the start; leave {name} out")
    return fields | {"event": -2 - index}


def _latches(builder: Builder, hinge: int) -> bool:
    """Whether a spring of the family `coordinates` has a latch."""
    return math.isfinite(builder.rows["coordinates"][hinge]["latch"])
