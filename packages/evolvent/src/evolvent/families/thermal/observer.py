"""Observations of temperatures of beams and rods: free strains, and what they take from the strains of the beams."""

from __future__ import annotations

import numpy as np

from evolvent.families.beams.observer import add_sections, section_arc
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("thermal_loads")
def observe_thermal_load(view: View, name: str) -> Observed:
    """Temperatures, free strains and curvatures, and the work done as they change."""
    found, index = Observed(), view.index(name)
    load = view.part(name)
    beam = view.part(load.part)
    found.results("thermal_loads", view.fields["thermal_loads"], index)
    row, change = view.model.thermal_loads[index], view.fields["thermal_loads"]["change"][:, index]
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
    found.plots, found.plots_along = ["temperature"], ["free_strain"]
    return found


def _observe_rod(view: View, index: int, found: Observed) -> None:
    """Free strains of the elements of a rod."""
    row = view.model.rods[index]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    free, where = view.fields["rod_elements"]["free"][:, own], "of each element"
    found.along("free_strain", "section", free[..., 0], "1", f"strain of the axis without stress {where}")
    found.along("free_curvature_y", "section", free[..., 4], "m-1", f"curvature about y without stress {where}")
    found.along("free_curvature_z", "section", free[..., 5], "m-1", f"curvature about z without stress {where}")
