"""What the claims of Belyakov (2002) on the plane of the offsets, and on what is drawn, are measured by."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia import Body, from_three_frequencies, linear_model
from evolvent_massprops.inertia_stand import chart
from evolvent_papers.papers import Options, stand, stand_schematic
from evolvent_papers.papers.stand import Grid, grid, simulated

Values = Mapping[str, float]
#: Every so-manieth of the 999 points of the map is simulated.
EVERY = 83
#: Offsets of the centre of mass, m, that rows name: the middle, on the x axis, and beside the axes.
PLACES = {"middle": (0.0, 0.0), "line": (0.4, 0.0), "behind": (-0.2, 0.174), "beside": (0.4, 0.174)}


def drawing() -> Values:
    """Lengths that are read off the lines of the drawing, m: of the springs' plan, of the body's end view.

    `springs` is the number of attachments in the plan, `spacing` that between them along X, `width` along Z, `diameter`
    the height of the outline in the end view; `outside` is how far, m, the attachments lie outside the body's outline.
    """
    side, end, plan = stand_schematic.figure_1(Options(quick=True)).figure.panels  # type: ignore[union-attr]
    marked = [line for line in plan.lines if line.marker in ("o", "X") and line.x.size == 1]
    marks = {(float(line.x[0]), float(line.y[0])) for line in marked}
    outline = np.array([plan.lines[0].x, plan.lines[0].y])
    corners = np.array([place for place in marks if abs(place[0]) > 0.25 * np.ptp(outline[0])])
    beyond = np.abs(corners) - outline.max(axis=1)
    return {
        "springs": float(len(corners)),
        "spacing": float(np.ptp(corners[:, 0])),
        "width": float(np.ptp(corners[:, 1])),
        "diameter": float(np.ptp(end.lines[0].y)),
        "height": float(np.ptp(side.lines[0].y)),
        "outside": float(max(beyond.max(), 0.0)),
    }


def surface() -> Values:
    """The surface of least energies as drawn, beside the simulated motion at every 83rd of its points.

    `apart` is the largest difference, J, of the drawn energy from the least of those that are identified from the
    simulated motion by (C/2) times the sum of squares, which are from `low` to `high`; `top` and `middle`, J, are the
    largest of the surface and that without offset.
    """
    over = grid()
    drawn = stand.map_data(over).least_energy.values
    x, z = (values.ravel() for values in np.meshgrid(over.x, over.z, indexing="ij"))
    chosen = np.arange(EVERY // 2, x.size, EVERY)
    least = np.array([float(run.mode_energy.min()) for run in simulated(x[chosen], z[chosen])])
    return {
        "points": float(drawn.size),
        "simulated": float(chosen.size),
        "apart": float(np.abs(drawn.ravel()[chosen] - least).max()),
        "low": float(least.min()),
        "high": float(least.max()),
        "top": float(drawn.max()),
        "middle": float(over.energies(0.0, 0.0).min()),
    }


@functools.cache
def _box() -> tuple[np.ndarray, np.ndarray]:
    """Offsets, m, of the points of the map in the box of 20 % of the spacing."""
    over = grid()
    inside = chart.box(stand.map_data(over))[1]
    x, z = np.meshgrid(over.x, over.z, indexing="ij")
    return x[inside], z[inside]


def _errors(over: Grid, turned: np.ndarray, at: tuple[float, float]) -> tuple[float, float]:
    """Errors of Ixx and Izz, %, by three frequencies of a body with a tensor, whose products are taken as 0."""
    level = over.body(*at)
    body = Body(mass=level.mass, centre=level.centre, inertia=turned)
    modes, springs = linear_model(over.stand, body).modes(), over.stand.points
    frequency, shapes = modes.natural_frequency[modes.vertical], modes.at(springs)[modes.vertical]
    try:
        found = from_three_frequencies(over.stand, level, frequency, shapes=shapes, points=springs)
    except InputError:
        return float("nan"), float("nan")
    Ixx, Izz = (100.0 * (float(found[name]) / float(turned[k, k]) - 1.0) for name, k in (("Ixx", 0), ("Izz", 2)))
    return Ixx, Izz


def product() -> Values:
    """Errors of Izz, %, where principal axes are turned by 1 degree about the vertical and Ixz is taken as 0.

    At the middle and three offsets; over every fifth of the 425 points of the map in the box of 20 % of the spacing the
    median and the largest of |error|, the largest of Ixx, and the share of points, %, with more than 0.1 % of Izz.
    """
    over, angle = grid(), np.radians(1.0)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    tensor = turn @ over.case.body.tensor @ turn.T
    places = {name: _errors(over, tensor, at)[1] for name, at in PLACES.items()}
    x, z = (values[::5].tolist() for values in _box())
    every = np.abs([_errors(over, tensor, at) for at in zip(x, z, strict=True)])
    return places | {
        "median": float(np.nanmedian(every[:, 1])),
        "largest": float(np.nanmax(every[:, 1])),
        "Ixx": float(np.nanmax(every[:, 0])),
        "share": 100.0 * float(np.nanmean(every[:, 1] > 0.1)),
        "none": float(np.isnan(every[:, 0]).sum()),
    }


def height() -> Values:
    """Change of the frequencies of roll and pitch, %, of a hanging body 0.1 m below the plane of its attachments.

    Of roll at the middle and at (0.4, 0.174) m, of pitch at the middle.
    """
    over = grid()
    given = over.case.body

    def change(at: tuple[float, float], kind: str) -> float:
        raised = Body(mass=given.mass, centre=(at[0], -0.1, at[1]), inertia=given.tensor)
        found = []
        for body in (over.body(*at), raised):
            modes = linear_model(over.stand, body).modes()
            found.append(float(modes.natural_frequency[modes.kinds.index(kind)]))
        return 100.0 * (found[1] / found[0] - 1.0)

    return {
        "roll": change(PLACES["middle"], "roll"),
        "beside": change(PLACES["beside"], "roll"),
        "pitch": change(PLACES["middle"], "pitch"),
    }
