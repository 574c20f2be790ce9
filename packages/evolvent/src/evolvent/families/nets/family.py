"""Nets: their nodes are points and their cords springs that only pull, which have the forces."""

from __future__ import annotations

from typing import Any

from evolvent.kernels import markers
from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import AdjointSupport, Parts, Samples, State, Statics, never
from evolvent.model.shares import Shares
from evolvent_base.errors import InputError


def _parts(row: Any) -> dict[str, range]:
    """Its points and springs."""
    return {
        "points": range(int(row["first_point"]), int(row["first_point"] + row["points"])),
        "springs": range(int(row["first_spring"]), int(row["first_spring"] + row["cords"])),
    }


def _place(builder: Any, at: Any) -> Any:
    """A node of a net: a point, or what holds it."""
    row = builder.rows["nets"][at.row]
    last = row["nodes"] - 1
    if not isinstance(at.on, int) or at.on > last:
        raise InputError(
            f"{at.key} is {at.where!r}; {at.name!r} is a net; give a node from '{at.name}[0]' to '{at.name}[{last}]'"
        )
    marker = builder.rows["markers"][row["first_marker"] + at.on]
    if marker["kind"] == markers.ON_BODY:
        return builder.on_body(marker["index"], marker["local"])
    point = builder.rows["points"][marker["index"]]
    return builder.on_coordinates("points", marker["index"], point["iq"], point["iv"])


# nodes: markers from first_marker on, of which some are points of its own, from first_point on; cords: springs from
# first_spring on, those of the net, of its rear net, and ties; aperture: m, its diameter
NETS = Family(
    "nets",
    record("first_marker nodes first_point points first_spring cords", "aperture"),
    order=371,
    kinds=(Kind("a net", symmetric=True),),
    isolated=True,
    shares=Shares(),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport(
        "its nodes are points, and its cords springs", timed=False, rates=False, mirrored=True, smooth=True
    ),
    parts=Parts(reads_inertia=False, place=_place, contains=_parts),
    samples=Samples(local=True),
    state=State(extents=lambda found: found["aperture"]),
    statics=Statics(uneven=never),
)
