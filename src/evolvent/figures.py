"""What a system wants to be drawn, as data: line plots, and the scene of a 3-D animation."""

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
class Solid:
    """A cylinder or a box that is fixed in the body, or turns about its axis there.

    Attributes
    ----------
    kind : "cylinder" or "box"
    centre : (3,) float, m, body axes
    size : (3,) float, m: radius, radius, length of a cylinder; the edges of a box
    axis : (3,) float, of a cylinder, body axes
    turned : (nt,) float, rad, how far a cylinder has turned about its axis; None where it is fixed
    """

    kind: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    turned: Array | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arrows:
    """Forces that are drawn as arrows.

    Attributes
    ----------
    label : str, with the unit of `force`
    at : (nt, na, 3) float, m, where each begins, body axes
    force : (nt, na, 3) float, body axes; NaN or zero for none
    longest : float, m, that the largest force is drawn with
    """

    label: str
    at: Array
    force: Array
    longest: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene:
    """Lines that move with a body, for a 3-D animation.

    Attributes
    ----------
    name : str, of the file
    time : (nt,) float, s
    points : (nt, nl, np, 3) float, m, points of every line, body axes from the body's origin
    value : (nt, nl, np - 1) float, of each piece of a line, shown as its color; NaN for none
    value_label : str, with its unit
    origin : (nt, 3) float, m, of the body, inertial axes
    angle : (nt,) float, rad, unwrapped, of the body about its z axis
    tilt : (nt, 4) float, what is left of the body's attitude: its quaternion is that of `angle` about z times this
    body : sequence of (k, 3) float, m, polygons that draw the body, body axes
    numbers : mapping, label with its unit -> (nt,) float, shown beside the picture
    others : mapping, label with its unit -> (nt, nl, np - 1) float, other values that may be shown as color
    coils : int, how many of the first lines are springs, from end to end
    solids : sequence of Solid, fixed in the body
    arrows : Arrows or None
    """

    name: str = "animation"
    title: str
    time: Array
    points: Array
    value: Array
    value_label: str
    origin: Array
    angle: Array
    tilt: Array
    body: Sequence[Array]
    numbers: dict[str, Array]
    others: Mapping[str, Array] = dataclasses.field(default_factory=dict)
    coils: int = 0
    solids: Sequence[Solid] = ()
    arrows: Arrows | None = None

    def labelled(self, label: str) -> Scene:
        """The scene with `label` in its title; itself where that is empty."""
        return dataclasses.replace(self, title=f"{self.title} - {label}") if label else self


@dataclasses.dataclass(frozen=True, kw_only=True)
class Number:
    """A result for the table on the screen: what it is, and its value as text with its unit."""

    label: str
    value: str
