"""A net between ribs, for programs that find forms by force densities."""

from __future__ import annotations

from typing import Any

import numpy as np

RIBS, STATIONS, ACROSS, RADIUS, FOCAL = 8, 4, 3, 5.0, 4.0


def problem(ribs: int = RIBS, stations: int = STATIONS) -> dict[str, Any]:
    """A net between ribs on a paraboloid, with uneven force densities and loads along the axis."""
    count = ribs * ACROSS
    nodes = []
    for i in range(stations + 1):
        r = 0.8 + (RADIUS - 0.8) * i / stations
        for k in range(count):
            angle = 2.0 * np.pi * k / count
            nodes.append([r * np.cos(angle), r * np.sin(angle), r * r / (4.0 * FOCAL)])
    ring = [[i * count + k, i * count + (k + 1) % count] for i in range(stations + 1) for k in range(count)]
    along = [[i * count + k, (i + 1) * count + k] for i in range(stations) for k in range(count) if k % ACROSS]
    cords = ring + along
    rim = [i * count + k for i in range(stations + 1) for k in range(0, count, ACROSS)]
    density = [2.0 + np.sin(0.7 * k) for k in range(len(cords))]
    loads = [0.0 if k in rim else -0.3 for k in range(len(nodes))]
    return {"nodes": nodes, "cords": cords, "rim": rim, "density": density, "loads": loads}


def facets() -> list[list[int]]:
    """Triangles of the net of `problem`, two in each mesh."""
    count, found = RIBS * ACROSS, []
    for i in range(STATIONS):
        for k in range(count):
            a, b = i * count + k, i * count + (k + 1) % count
            found += [[a, a + count, b + count], [a, b + count, b]]
    return found
