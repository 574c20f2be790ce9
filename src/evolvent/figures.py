"""What a system wants to be drawn, as data: line plots, and numbers for a table."""

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
class Panel:
    """One pair of axes; axis labels carry their units.

    Attributes
    ----------
    equal : bool, whether both axes have the same scale
    log : bool, whether y is logarithmic
    y_zero : bool, whether the y axis starts at zero where no value is below it
    x_names : mapping, place on the x axis -> name, for an axis of things rather than numbers
    """

    x_label: str
    y_label: str
    lines: Sequence[Line]
    title: str = ""
    equal: bool = False
    log: bool = False
    y_zero: bool = False
    x_names: Mapping[float, str] | None = None


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
