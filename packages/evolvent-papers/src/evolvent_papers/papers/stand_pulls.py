"""Pulls other than at one spring: which of them leave no mode without energy in the box that the paper calls safe."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from evolvent_base.figures import Figure, Line, Map, Panel
from evolvent_massprops.inertia import Load, best_point, least_energy
from evolvent_massprops.inertia_stand import chart
from evolvent_massprops.planning.pulls import SHARES
from evolvent_papers.papers import Made, Options, stand
from evolvent_papers.papers.stand import CASE, KEYS, STUDY
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
#: Energy of a mode, of that of the modes without offset, below which it is taken as dead.
DEAD = 0.01


class Least(NamedTuple):
    """Least energies of the modes over the map (nx, nz), J, NaN where they were not computed.

    Attributes
    ----------
    spring : pulled at spring 1
    pair : at the two springs that are best for each offset, with shares of the pull of which one may point up
    point : at the best point between the springs for each offset
    records : at spring 1 in one record and at spring 3, opposite, in another: the better of both for each mode
    inside : bool, offsets in the box
    top : float, J, energy of the modes without offset
    """

    spring: Array
    pair: Array
    point: Array
    records: Array
    inside: Array
    top: float


@functools.cache
def _least(*, box: bool) -> Least:
    """Least energies on the built-in map; at the best point in the box alone if `box`."""
    over = stand.grid()
    springs, force = over.stand.points, np.array(over.case.excitation.force)
    modes = over.modes(over.x[:, None], over.z[None, :])
    each = [modes.release(force, point) for point in springs]
    energies = [modes.energy(z) for z in each]
    pairs = [
        modes.energy(one * each[i] + other * each[j]).min(axis=-1)
        for i, j in itertools.combinations(range(len(springs)), 2)
        for one, other in SHARES
    ]
    inside = chart.box(stand.map_data(over))[1]
    point = np.full(inside.shape, np.nan)
    for i, j in np.argwhere(inside if box else np.full(inside.shape, True)):
        own = over.modes(over.x[i], over.z[j])
        at = best_point(own, springs, force)
        point[i, j] = float(least_energy(own, [Load(force, at)]))
    records = np.maximum(energies[0], energies[2]).min(axis=-1)
    top = float(over.energies(0.0, 0.0).max())
    return Least(energies[0].min(axis=-1), np.max(pairs, axis=0), point, records, inside, top)


def measure() -> Mapping[str, float]:
    """Least and median energy of the weakest mode in the box, J, and shares below 1 % of the middle's, %."""
    found = _least(box=True)
    values = {"points": float(found.inside.sum()), "top": found.top}
    for name in ("spring", "pair", "point", "records"):
        part = getattr(found, name)[found.inside]
        values |= {
            f"{name}_least": float(part.min()),
            f"{name}_median": float(np.median(part)),
            f"{name}_below": 100.0 * float(np.mean(part < DEAD * found.top)),
        }
    return values


def figure(options: Options) -> Made:
    """Energy of the weakest mode over the offset of the centre of mass, for four ways of pulling."""
    found, over = _least(box=options.quick), stand.grid()
    lines: list[Line] = chart.box(stand.map_data(over))[0]
    panels, rows = [], []
    titles = {
        "spring": "at spring 1, as in the paper", "pair": "at the best two springs for each offset",
        "point": "at the best point for each offset", "records": "at springs 1 and 3 in two records",
    }  # fmt: skip
    for name, title in titles.items():
        values = getattr(found, name)
        part = values[found.inside]
        below = 100.0 * float(np.mean(part < DEAD * found.top))
        rows.append([title, f"{part.min():.2g}", f"{np.median(part):.3g}", f"{below:.1f}"])
        drawn = Map(x=over.x, y=over.z, values=values, log=True, label="energy, J", limits=(1e-3, found.top),
                    contours={DEAD * found.top: "white"})  # fmt: skip
        panels.append(Panel(x_label=chart.LABELS[0], y_label=chart.LABELS[1], title=title, lines=lines, map=drawn))
    head = ("pulled", "least, J", "median, J", f"below 1 % of {found.top:.2f} J, %")
    note = (
        f"Linear model of the case `{CASE}` on the {found.spring.size} offsets of `evolvent sweep {STUDY}` "
        f"({', '.join(KEYS)}); the table is over the {int(found.inside.sum())} within 20 % of the springs' spacing.\n"
    )
    title = (
        "Energy of the weakest of three modes for pulls of the same force (all ours but the first); dashed: 20 % of "
        "the spacing, white: 1 % of the energy without offset; colours end at 1 mJ"
    )
    figure = Figure(name="stand-pulls", title=title, panels=panels, columns=2, height=170.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure)
