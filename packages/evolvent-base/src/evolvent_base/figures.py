"""What a system wants to be drawn, as data: line plots and maps, and numbers for a table."""

from __future__ import annotations

import dataclasses
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_base.scales import named_times

Array = np.ndarray
#: Width of every figure, mm: that of a page of a journal, two columns.
WIDTH = 174.0
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Line:
    """One curve of a panel.

    Attributes
    ----------
    x, y : (k,) float
    label : str, '' for none in the legend
    color : int, index in the palette of lines; or float from 0 to 1, position on the scale of times; or a color's name
    style : str, of matplotlib ("-", "--", ":"), "" for none
    marker : str, of matplotlib, "" for none
    width : float, points
    fill : str, color's name of the area inside a closed curve, "" for none; charts of the studio leave it empty
    """

    x: Array
    y: Array
    label: str = ""
    color: int | float | str = 0
    style: str = "-"
    marker: str = ""
    width: float = 1.6
    fill: str = ""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Map:
    """Values over a plane, as colours; what is not finite stays grey. The colour bar states where values are clipped.

    Attributes
    ----------
    x, y : (n,), (k,) float
    values : (n, k) float
    label : str, of the colour bar, with the unit
    limits : (2,) float, values of the first and last colour, beyond which values are clipped; None for their range
    log : bool, whether colours are logarithmic in the values; needs limits above zero
    colors : str, name of matplotlib's colour map
    contours : mapping, value -> color of a contour line
    surface : bool, whether the values are linear heights over the plane, seen from above at an angle; without limits,
        contours and lines of the panel
    """

    x: Array
    y: Array
    values: Array
    label: str
    limits: tuple[float, float] | None = None
    log: bool = False
    colors: str = "viridis"
    contours: Mapping[float, str] = dataclasses.field(default_factory=dict)
    surface: bool = False

    @property
    def clipped(self) -> tuple[bool, bool]:
        """Whether values lie below that of the first colour, and above that of the last."""
        if self.limits is None:
            return False, False
        values = np.asarray(self.values, dtype=float)
        values = values[np.isfinite(values)]
        low, high = self.limits
        return bool(np.any(values < low * (1.0 - 1e-9))), bool(np.any(values > high * (1.0 + 1e-9)))

    @property
    def bar_label(self) -> str:
        """Label of the colour bar: the quantity with its unit in brackets, and where values are clipped."""
        sides = zip(self.clipped, ("below", "above"), self.limits or (0.0, 0.0), strict=True)
        clipped = [f"{word} {limit:g}" for is_clipped, word, limit in sides if is_clipped]
        return axis_label(self.label) + (f", one colour {' and '.join(clipped)}" if clipped else "")


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
    """One pair of axes.

    Attributes
    ----------
    x_label, y_label : str, a quantity, and after the last ", " its unit
    equal : bool, whether both axes have the same scale
    log, log_x : bool, whether y, and whether x, is logarithmic
    y_zero : bool, whether the y axis starts at zero where no value is below it
    y_span : float, least length of the y axis, so that differences that do not matter look small
    x_names, y_names : mapping, position on the axis -> name, for an axis of things rather than numbers; of a
        logarithmic one with their units, in place of that of the label
    map : Map, drawn below the lines; None for none
    notes : text over the lines
    axes : bool, False hides axes and grid, as of a schematic
    """

    x_label: str
    y_label: str
    lines: Sequence[Line]
    title: str = ""
    equal: bool = False
    log: bool = False
    log_x: bool = False
    y_zero: bool = False
    y_span: float = 0.0
    x_names: Mapping[float, str] | None = None
    y_names: Mapping[float, str] | None = None
    map: Map | None = None
    notes: Sequence[Note] = ()
    axes: bool = True


@dataclasses.dataclass(frozen=True, kw_only=True)
class Figure:
    """Panels on a sheet that is `WIDTH` wide, `columns` beside one another.

    Attributes
    ----------
    name : str, of the file
    height : float, mm; a sheet of schematics alone is as high as they are
    heights : sequence of float, relative heights of the rows
    whole : Figure, the same over all of its time, where this one is cut; None of one that is not
    """

    name: str
    title: str
    panels: Sequence[Panel]
    columns: int = 1
    height: float = 120.0
    heights: Sequence[float] | None = None
    whole: Figure | None = None


class Quantity(NamedTuple):
    """One number of a result.

    Attributes
    ----------
    value : float
    unit : str, without a prefix, "1" for a plain number; of angles and rates, that in which they are shown
    what : str, what it is of the result; '' for the result itself
    """

    value: float
    unit: str = "1"
    what: str = ""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Number:
    """A result for the table on the screen: what it is, its value as text with its unit, and the numbers in it."""

    label: str
    value: str
    quantities: tuple[Quantity, ...] = ()


def numbers_of(rows: Iterable[tuple[Any, ...]]) -> list[Number]:
    """Results of rows (label, text, *numbers), each number as (value, unit, what), the last two if they are needed.

    Values that are not finite are left out.
    """
    return [
        Number(
            label=label,
            value=text,
            quantities=tuple(Quantity(float(x), *rest) for x, *rest in quantities if np.isfinite(x)),
        )
        for label, text, *quantities in rows
    ]


def over_log_time(label: str, first: float, last: float) -> dict[str, Any]:
    """Fields of a panel over the logarithm of time (s): its ticks are named in s, h, days and years.

    Parameters
    ----------
    label : str, without the unit
    first, last : float, s, ends of the lines
    """
    names = named_times(first, last)
    return {"x_label": f"{label}, s", "x_names": names if len(names) > 1 else None, "log_x": True}


def stacked(rows: int) -> float:
    """Height of a figure with so many panels over one another, mm."""
    return 12.0 + 47.0 * rows


def axis_label(text: str) -> str:
    """Label of an axis with its unit in brackets: "area, m2" -> "area [m²]"."""
    quantity, comma, unit = text.rpartition(", ")
    if not comma:
        return text
    unit = re.sub(r"\b1e(-?\d+)\b", lambda m: "10" + superscript(m[1]), unit)
    unit = re.sub(r"(?<=[a-zA-Z])\^?(-?\d+)\b", lambda m: superscript(m[1]), unit)
    unit = re.sub(r"\bu(?=[mNsJg]\b)", "µ", unit)
    return f"{quantity} [{unit}]".lstrip()


def superscript(digits: str) -> str:
    """A whole number as an exponent: "-3" -> "⁻³"."""
    return digits.translate(_SUPERSCRIPTS)


def with_power(text: str, power: int) -> str:
    """Label of an axis whose numbers are multiples of 10^power: "force, N" -> "force, 1e-4 N"."""
    quantity, comma, unit = text.rpartition(", ")
    return text if power == 0 else f"{quantity}, 1e{power} {unit}" if comma else f"{text}, 1e{power}"


def plain(text: str) -> str:
    """Text of a figure without mathtext, as of a page: "$I_{xx}$" -> "Ixx"."""

    def letters(found: re.Match[str]) -> str:
        inside = re.sub(r"\\(?:mathrm|mathit|mathbf)", "", found[1])
        inside = re.sub(r"\\([A-Za-z]+) ?", lambda m: _letter(m[1]), inside)
        return re.sub(r"[{}_\\]", "", inside)

    return re.sub(r"\$([^$]*)\$", letters, text)


def _letter(name: str) -> str:
    """The letter or sign that mathtext calls so."""
    size = "CAPITAL" if name[0].isupper() else "SMALL"
    known = {"times": "MULTIPLICATION SIGN"}.get(name, f"GREEK {size} LETTER {name.upper()}")
    try:
        return unicodedata.lookup(known)
    except KeyError:
        return name


def spectrum(lines: Sequence[Line], *, unit: str, marks: Sequence[float] = (), title: str = "Spectra") -> Figure:
    """Amplitude spectra with a Hann window, in which an oscillation's peak is as high as its amplitude.

    Parameters
    ----------
    lines : values over time (s), as of `lines_of`, at equal intervals
    unit : str, of the values
    marks : angular frequencies, rad/s, that are marked as identified

    Raises
    ------
    InputError
        If there are fewer than four samples, or their intervals are not equal.
    """
    time = lines[0].x
    steps = np.diff(time)
    if time.size < 4 or np.ptp(steps) > 1e-6 * steps.max():
        raise InputError(f"the run has {time.size} samples; a spectrum needs four or more at equal intervals")
    window = np.hanning(time.size)
    omega = 2.0 * np.pi * np.fft.rfftfreq(4 * time.size, steps[0])
    drawn = []
    for line in lines:
        transform = np.fft.rfft((line.y - line.y.mean()) * window, 4 * time.size)
        drawn.append(dataclasses.replace(line, x=omega, y=2.0 * np.abs(transform) / window.sum(), width=1.0))
    top = max(float(line.y.max()) for line in drawn)
    low = max(min(float(line.y.min()) for line in drawn), 1e-6 * top)
    for k, w in enumerate(marks):
        label = "identified" if k == 0 else ""
        drawn.append(Line(x=np.array([w, w]), y=np.array([low, 2.0 * top]), color="gray", style=":", label=label))
    panel = Panel(x_label="angular frequency, rad/s", y_label=f"amplitude, {unit}", lines=drawn, log=True)
    return Figure(name="spectrum", title=f"{title} (Hann window)", panels=[panel], height=90.0)


def counts(panel: Panel, direction: str) -> bool:
    """Whether the axis "x" or "y" of a panel counts things: its values are whole numbers without a unit."""
    if ", " in getattr(panel, f"{direction}_label") or not panel.lines:
        return False
    values = np.concatenate([np.ravel(np.asarray(getattr(line, direction), dtype=float)) for line in panel.lines])
    values = values[np.isfinite(values)]
    return bool(values.size and np.ptp(values) >= 1.0 and np.all(values == np.round(values)))


def y_limits(panel: Panel) -> tuple[float, float] | None:
    """Ends of a panel's y axis where its values alone do not decide them.

    An axis starts at zero where `y_zero` asks for it, is `y_span` long or longer, and is wide where all values are the
    same but for round-off. One of names has half a row beside the first and the last.
    """
    if panel.log or panel.equal or panel.map is not None:
        return None
    if panel.y_names:
        low, high = min(panel.y_names), max(panel.y_names)
        row = (high - low) / max(len(panel.y_names) - 1, 1) or 1.0
        return low - 0.5 * row, high + 0.5 * row
    values = np.concatenate([np.ravel(np.asarray(line.y, dtype=float)) for line in panel.lines] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    if not values.size:
        return None
    low, high = float(values.min()), float(values.max())
    if panel.y_zero and low >= 0.0 and high > 0.0:
        return 0.0, 1.05 * max(high, panel.y_span)
    size = max(abs(low), abs(high))
    span = max(panel.y_span, 0.2 * size if high - low <= 1e-5 * size else 0.0)
    if high - low >= span:
        return None
    if low <= 0.0 <= high:  # about zero
        return min(-0.5 * span, 1.05 * low), max(0.5 * span, 1.05 * high)
    middle = 0.5 * (low + high)
    return middle - 0.5 * span, middle + 0.5 * span


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
