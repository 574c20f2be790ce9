"""Observations of loads: their values, power and work."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.references import split_reference
from evolvent.families.loads import beam_loads
from evolvent.families.threads.observer import copies_drawn
from evolvent.kernels import loads as kernels
from evolvent.model import RESULTS
from evolvent.results.observe.symbols import Seat, basis, entry, symbol
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View

Array = np.ndarray


def _spread_on(part: Any) -> str | None:
    """What a load acts along or over; None of one that acts at a place."""
    return getattr(part, "along", None) or getattr(part, "over", None)


@observer("loads")
def observe_load(view: View, name: str) -> Observed:
    """Force or torque at a marker, or the resultant of a load along a thread or a line or on a surface."""
    index = view.index(name)
    row, along = view.model.loads[index], _spread_on(view.part(name))
    if row["kind"] < kernels.AT_MARKER:
        return observe_thread_load(view, index)
    what = "torque" if row["kind"] == kernels.TORQUE else "force"
    if along is not None:  # its rows are the loads at nodes
        part, on = split_reference(along)
        shares = view.assembly.parts[part].spread(part, on).shares
        own = slice(index, index + shares.size)
        return _observe(view, "loads", own, what, shares / float(shares.sum()))
    return _observe(view, "loads", slice(index, index + 1), what)


def observe_thread_load(view: View, index: int) -> Observed:
    """Resultant on the released thread, and the work on all copies that the thread stands for."""
    found = _observe(view, "loads", slice(index, index + 1), "force")
    thread = view.model.threads[int(view.model.loads["target"][index])]
    what = "resultant of the load on the released thread" + (", of one copy" if thread["copies"] > 1 else "")
    found.vector("force", found.variables["force"].values, "N", f"{what}, inertial axes")
    if thread["copies"] > 1:
        found.drawn[0]["forces"]["copies"] = copies_drawn(view, thread)
    return found


@observer("beam_loads")
def observe_beam_load(view: View, name: str) -> Observed:
    """Force at a beam's node, resultant force of a line load, or torque of one spread over the mass."""
    row, index, what = view.model.beam_loads[view.index(name)], view.index(name), "force"
    beam = view.model.beams[row["beam"]]
    if row["kind"] in (beam_loads.FIELD, beam_loads.MOMENT):
        what = "torque"
    elif row["kind"] == beam_loads.POINT and (int(row["iq"]) - int(beam["iq"])) // 3 % view.vectors(beam):
        what = "generalized_force"
    return _observe(view, "beam_loads", slice(index, index + 1), what)


def _observe(view: View, family: str, own: slice, what: str, shares: Any = 1.0) -> Observed:
    """Sum of the records `own` of a family: what acts, by its name, and where, weighted by the shares; power, work."""
    fields, found = {key: view.fields[family][key][:, own] for key in RESULTS[family]}, Observed()
    unit = "N" if what == "force" else "N m"
    text = "force on the slope" if what == "generalized_force" else what
    found.vector(what, fields["vector"].sum(axis=1), unit, f"{text} that acts, inertial axes")
    position, *words = RESULTS[family]["middle"]
    found.vector(position, np.einsum("n,tnc->tc", np.atleast_1d(shares), fields["middle"]), *words)
    for key in ("power", "work"):
        name, *words = RESULTS[family][key]
        found.scalar(name, fields[key].sum(axis=1), *words)
    found.drawn = [{"forces": {"points": position, "vectors": what, "unit": unit}}]
    found.plots, found.given = [what], [what]
    return found


@symbol("panel")
def _panel(view: View, name: str, found: Observed) -> None:
    """The outline of a square panel of the area that the light falls on."""
    part = view.part(name)
    if part.at is None:
        return
    marker = view.model.markers[int(view.model.loads["target"][view.index(name)])]
    x, y, _ = basis(part.normal)
    half = 0.5 * float(part.area) ** 0.5
    corners = [half * (i * x + j * y) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    lines = [corners, [corners[0], corners[2]], [corners[1], corners[3]]]
    seat = Seat(int(marker["index"]), np.array(marker["local"]), np.array(part.normal, dtype=float))
    outline = [[point.tolist() for point in line] for line in lines]
    found.drawn.append(entry(view, found, seat, outline=outline))
