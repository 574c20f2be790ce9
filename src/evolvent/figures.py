"""What a system wants to be drawn, as data: line plots and maps, and numbers for a table."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

Array = np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Line:
    """One curve of a panel.

    Attributes
    ----------
    x, y : (k,) float
    label : str, '' for none in the legend
    color : int, place in the palette of lines; or float from 0 to 1, place on the scale of times; or a color's name
    style : str, of matplotlib ("-", "--", ":"), "" for none
    marker : str, of matplotlib, "" for none
    width : float, points
    """

    x: Array
    y: Array
    label: str = ""
    color: int | float | str = 0
    style: str = "-"
    marker: str = ""
    width: float = 1.6


@dataclasses.dataclass(frozen=True, kw_only=True)
class Map:
    """Values over a plane, as colours; what is not finite stays grey.

    Attributes
    ----------
    x, y : (n,), (k,) float
    values : (n, k) float
    label : str, of the colour bar, with the unit
    limits : (2,) float, values of the first and last colour, beyond which values are clipped; None for their range
    log : bool, whether colours are logarithmic in the values; needs limits above zero
    colors : str, name of matplotlib's colour map
    contours : mapping, value -> color of a contour line
    """

    x: Array
    y: Array
    values: Array
    label: str
    limits: tuple[float, float] | None = None
    log: bool = False
    colors: str = "viridis"
    contours: Mapping[float, str] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Note:
    """Text in a panel, as of a schematic.

    Attributes
    ----------
    at : (2,) float, middle of the text
    text : str
    points_to : (2,) float, where an arrow from the text ends; None for no arrow
    """

    at: tuple[float, float]
    text: str
    points_to: tuple[float, float] | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Panel:
    """One pair of axes; axis labels carry their units.

    Attributes
    ----------
    equal : bool, whether both axes have the same scale
    log, log_x : bool, whether y, and whether x, is logarithmic
    y_zero : bool, whether the y axis starts at zero where no value is below it
    x_names, y_names : mapping, place on the axis -> name, for an axis of things rather than numbers
    map : Map, drawn below the lines; None for none
    notes : text over the lines
    axes : bool, False hides axes and grid, as of a schematic
    legend_outside : bool, whether the legend stands to the right of the axes, as it does with more than 6 labels
    """

    x_label: str
    y_label: str
    lines: Sequence[Line]
    title: str = ""
    equal: bool = False
    log: bool = False
    log_x: bool = False
    y_zero: bool = False
    x_names: Mapping[float, str] | None = None
    y_names: Mapping[float, str] | None = None
    map: Map | None = None
    notes: Sequence[Note] = ()
    axes: bool = True
    legend_outside: bool = False


@dataclasses.dataclass(frozen=True, kw_only=True)
class Figure:
    """Panels on a sheet, `columns` beside one another.

    Attributes
    ----------
    name : str, of the file
    size : (2,) float, inches
    heights : sequence of float, relative heights of the rows
    """

    name: str
    title: str
    panels: Sequence[Panel]
    columns: int = 1
    size: tuple[float, float] = (8.0, 6.0)
    heights: Sequence[float] | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Number:
    """A result for the table on the screen: what it is, and its value as text with its unit."""

    label: str
    value: str


def spline(x: Array, y: Array, at: Array) -> Array:
    """The cubic spline through points, with "not-a-knot" ends, as SciPy's, which takes 0.3 s to load.

    Parameters
    ----------
    x, y : (n,) float, n >= 4, `x` increasing
    at : (k,) float, within `x`

    Notes
    -----
    Its second derivatives M follow from h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (s[i] - s[i-1]), with
    h the widths and s the slopes of the pieces. M at the ends is eliminated first: the third derivative is continuous
    at x[1] and x[-2].
    """
    h = np.diff(x)
    slope = np.diff(y) / h
    below, diagonal, above = h[:-1].copy(), 2.0 * (h[:-1] + h[1:]), h[1:].copy()
    right = 6.0 * np.diff(slope)
    diagonal[0] += h[0] * (h[0] + h[1]) / h[1]
    above[0] -= h[0] ** 2 / h[1]
    diagonal[-1] += h[-1] * (h[-1] + h[-2]) / h[-2]
    below[-1] -= h[-1] ** 2 / h[-2]
    for i in range(1, right.size):
        share = below[i] / diagonal[i - 1]
        diagonal[i] -= share * above[i - 1]
        right[i] -= share * right[i - 1]
    M = np.empty(x.size)
    M[-2] = right[-1] / diagonal[-1]
    for i in range(right.size - 2, -1, -1):
        M[i + 1] = (right[i] - above[i] * M[i + 2]) / diagonal[i]
    M[0] = M[1] - (M[2] - M[1]) * h[0] / h[1]
    M[-1] = M[-2] + (M[-2] - M[-3]) * h[-1] / h[-2]
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, h.size - 1)
    u, w = at - x[k], h[k]
    first, third = slope[k] - w * (2.0 * M[k] + M[k + 1]) / 6.0, (M[k + 1] - M[k]) / (6.0 * w)
    return y[k] + u * (first + u * (0.5 * M[k] + u * third))
