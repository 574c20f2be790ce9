"""A net on a ring of pantographs that opens: kinematics, form, deployment; the case `ring-antenna` in small."""

from __future__ import annotations

import functools
import math
import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from book import Book
from evolvent import cases
from evolvent.families.coordinates.part_poses import Linkage
from evolvent_base.errors import InputError

CHAPTER = "Threads, reels, tethers"
#: Length of a bar, m, and elevations of the bars where the ring is folded and open, rad.
BAR, FOLDED, OPEN = 2.65, math.radians(85.0), math.radians(30.0)


def radius(count: int, elevation: float) -> float:
    """Radius of the hubs of a ring of `count` pantographs, m."""
    return BAR * math.cos(elevation) / (2.0 * math.sin(math.pi / count))


def content(count: int = 8, **net: Any) -> dict[str, Any]:
    """The case with `count` bays and one ring of triangles; keys of the net in place of its own."""
    found: dict[str, Any] = cases.content_of("ring-antenna")
    parts = found["parts"]
    c, s, folded, opened = (
        math.cos(math.pi / count), math.sin(math.pi / count), radius(count, FOLDED), radius(count, OPEN),
    )  # fmt: skip
    high, deep = BAR * math.sin(FOLDED), BAR * math.sin(OPEN)
    for part in parts.values():
        if "repeat" in part:
            part["repeat"] = part["repeat"] | {"count": count}
        if part["kind"] == "joint" and part["type"] == "revolute":
            part["axis"] = [c, s, 0.0]
    parts["pivot"]["axis"] = [-c, -s, 0.0]
    parts["top"]["position"], parts["foot"]["position"] = [folded, 0.0, high], [folded, 0.0, 0.0]
    parts["boom"]["a"] = [folded, 0.0, 0.0]
    for name, sense in (("rise", -1.0), ("fall", 1.0)):
        parts[name] |= {
            "position": [folded * c * c, folded * c * s, 0.5 * high],
            "orientation": {"euler": [0.0, sense * FOLDED, 0.5 * math.pi + math.pi / count], "order": "xyz"},
        }
    sag = opened**2 / (4.0 * 4.8)
    parts["net"] |= {
        "position": [folded - opened, 0.0, deep - sag],
        "surface": {"paraboloid": {"focal_length": 4.8, "diameter": 2.0 * opened}},
        "topology": {"rings": {"rings": 2, "gores": count, "held": "corners"}},
        "ties": {"rear": {"gap": deep - 2.0 * sag, "stiffness": 5e3}},
    } | net
    return found


@pytest.mark.parametrize("count", [4, 7])
def test_radius_by_the_angle(count: int, book: Book) -> None:
    """One pivot that moves opens the whole ring: hubs on regular polygons of the radius of its elevation."""
    found = content(count)
    del found["parts"]["net"]
    assembly = ev.load(found).assemble()
    linkage = Linkage(assembly, [])
    off = 0.0
    for elevation in (math.radians(60.0), OPEN):
        angle = 2.0 * (elevation - OPEN)
        assert linkage.move({assembly.index("spring 2", "coordinates"): angle}) == ""
        x = assembly.model.bodies["x"]
        size = radius(count, elevation)
        for name, height in (("top", BAR * math.sin(elevation)), ("foot", 0.0)):
            hubs = np.array([x[assembly.index(f"{name} {k + 1}", "bodies")] for k in range(count)])
            turns = 2.0 * math.pi * np.arange(count) / count
            wanted = size * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
            wanted += [radius(count, FOLDED) - size, 0.0, height]
            off = max(off, float(np.abs(hubs - wanted).max()))
        np.testing.assert_allclose(linkage.values(), angle, atol=1e-9)
    book(
        CHAPTER, f"Ring of {count} pantographs, places of its hubs by the angle of one pivot", reference="closed form",
        source="geometry", error=off / BAR, allowed=1e-9,
    )  # fmt: skip
