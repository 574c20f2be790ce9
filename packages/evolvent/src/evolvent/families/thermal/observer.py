"""Observations of temperatures of beams, rods and shells, and of their free strains."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.families.beams.observer import add_sections, section_arc
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View

#: Free strains of a wall, as they are called, with units and texts; the transverse shear has none.
_WALL = (
    ("free_strain_1", "1", "strain along axis 1 without stress"),
    ("free_strain_2", "1", "strain along axis 2 without stress"),
    ("free_shear_strain", "1", "shear strain in the plane without stress"),
    ("free_curvature_1", "m-1", "change of curvature along axis 1 without stress"),
    ("free_curvature_2", "m-1", "change of curvature along axis 2 without stress"),
    ("free_twist", "m-1", "twist without stress, twice the component 12 of the curvature"),
)


@observer("thermal_loads")
def observe_thermal_load(view: View, name: str) -> Observed:
    """Temperatures, free strains and curvatures, and the work done as they change."""
    found, index = Observed(), view.index(name)
    load = view.part(name)
    found.results("thermal_loads", view.fields["thermal_loads"], index)
    row = view.model.thermal_loads[index]
    found.plots, found.given = ["temperature"], ["temperature"]
    if row["shell"] >= 0:
        _observe_shell(view, load, index, found)
        return found
    beam, change = view.part(load.part), view.fields["thermal_loads"]["change"][:, index]
    text, where = "change of temperature", "of each element" if row["rod"] >= 0 else "at two points of each element"
    arc = 0.5 * (beam.arc[1:] + beam.arc[:-1]) if row["rod"] >= 0 else section_arc(beam)
    factors = load.means(beam.arc / beam.length) if row["rod"] >= 0 else load.factor(arc / beam.length)
    found.along("temperature_change", "section", np.outer(change, factors), "K", f"{text} {where}")
    if row["rod"] >= 0:
        _observe_rod(view, int(row["rod"]), found)
        found.coordinate("arc", "section", arc, "m", "length from the root to the elements' middles")
    else:
        curvatures = " free_curvature_y free_curvature_z" if beam.vectors == 4 else ""
        add_sections(view, int(row["beam"]), f"free_strain{curvatures}", found)
        found.coordinate("arc", "section", arc, "m", "length from the root to the two points of each element")
    found.plots_along = ["free_strain"]
    return found


def _observe_rod(view: View, index: int, found: Observed) -> None:
    """Free strains of the elements of a rod."""
    row = view.model.rods[index]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    free, where = view.fields["rod_elements"]["free"][:, own], "of each element"
    found.along("free_strain", "section", free[..., 0], "1", f"strain of the axis without stress {where}")
    found.along("free_curvature_y", "section", free[..., 4], "m-1", f"curvature about y without stress {where}")
    found.along("free_curvature_z", "section", free[..., 5], "m-1", f"curvature about z without stress {where}")


def _observe_shell(view: View, load: Any, index: int, found: Observed) -> None:
    """Temperatures of the middle and the faces of the elements of a shell, and their free strains, of first order."""
    row, wall = view.model.thermal_loads[index], view.part(load.part).wall(load.part)
    first, count = (int(view.model.shells[int(row["shell"])][key]) for key in ("first_element", "elements"))
    fields, own = view.fields["shell_elements"], slice(first, first + count)
    change, gradient = fields["warmth"][:, own], fields["slope"][:, own]
    text = "change of temperature of each element"
    found.along("temperature_change", "element", change, "K", f"{text}, mean through the wall")
    found.along("temperature_gradient", "element", gradient, "K m-1", "gradient of temperature along the normal")
    if row["walls"] >= 0:
        own = slice(int(row["walls"]), int(row["walls"]) + count)
        found.results_along("heated_walls", view.fields["heated_walls"], own, "element", (), "of each element")
    else:
        for key, side, where in (("top", 0.5, "to which"), ("bottom", -0.5, "from which")):
            face = change + side * wall.thickness * gradient
            found.along(f"temperature_{key}", "element", face, "K", f"{text}, on the face {where} the normal points")
    for k, (called, unit, what) in enumerate(_WALL):
        free = change * wall.expansion[k, 0] + gradient * wall.expansion[k, 1]
        found.along(called, "element", free, unit, f"{what}, of first order")
    found.coordinate("element", "element", np.arange(count), "1", "element i n2 + j, i along side 1, j along side 2")
