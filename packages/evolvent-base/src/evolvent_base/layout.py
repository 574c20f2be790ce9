"""Where the axes of a figure stand on its sheet: margins follow from the texts, without drawing them first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from evolvent_base.figures import WIDTH
from evolvent_base.style import STYLE, block, text_width

#: Sizes of texts, points: numbers of ticks and names of axes.
_TICKS, _NAMES = STYLE["ytick.labelsize"], STYLE["axes.labelsize"]
#: Room between the edge of the sheet and what stands on it, and from an axis to the numbers of its ticks, mm.
EDGE, _TO_TICKS = 1.5, 2.6
#: From the numbers of ticks to the name of the axis, and from the axes to the row above or column beside, mm.
_TO_NAME, _APART = 1.2, 2.5
#: Width of a colour bar, and its distance from the axes, mm.
_BAR, _TO_BAR = 3.0, 2.0


class Place(NamedTuple):
    """What stands in one place of a sheet.

    Attributes
    ----------
    axis : axes of matplotlib
    above : float, mm, height of the texts above the axes
    upright : bool, whether the names at the x axis stand upright
    bar : axes of a colour bar, to the right; None for none
    """

    axis: Any
    above: float
    upright: bool = False
    bar: Any = None


def arrange(
    places: Sequence[Place], *, columns: int, height: float, ratios: Sequence[float] | None, top: float, bottom: float
) -> None:
    """Set the positions of axes, colour bars and names of axes.

    All axes are as wide; those of a row are as high, in the ratio of the row.

    Parameters
    ----------
    places : row after row
    height : float, mm, of the sheet
    ratios : heights of the rows, relative; None for equal ones
    top, bottom : float, mm, of the sheet that are taken
    """
    rows = [places[k : k + columns] for k in range(0, len(places), columns)]
    shares = [1.0] * len(rows) if ratios is None else [float(one) for one in ratios]
    numbers: list[float] | None = None
    sides = [_Sides(20.0, 5.0, one.above, _below(one)) for one in places]
    for _ in range(2 if all(one.axis.axison for one in places) else 4):  # texts in axes that are not drawn may be wide
        left, right = ([max(side[k] for side in sides[c::columns]) for c in range(columns)] for k in (0, 1))
        above, below = (
            [max(side[k] for side in sides[r * columns : (r + 1) * columns]) for r in range(len(rows))] for k in (2, 3)
        )
        wide = (WIDTH - sum(left) - sum(right) - _APART * (columns - 1)) / columns
        inner = height - top - bottom - sum(above) - sum(below) - _APART * (len(rows) - 1)
        y = height - top
        for r, row in enumerate(rows):
            high, x = max(inner, 5.0 * len(rows)) * shares[r] / sum(shares), 0.0
            y -= above[r] + high
            for c, one in enumerate(row):
                x += left[c]
                _set(one, (x, y, wide, high), height, None if numbers is None else numbers[c])
                x += wide + right[c] + _APART
            y -= below[r] + _APART
        numbers = [max(_widest(one.axis.yaxis) for one in places[c::columns]) for c in range(columns)]
        sides = [_sides(one, numbers[k % columns]) for k, one in enumerate(places)]


class _Sides(NamedTuple):
    """Room of texts around axes, mm."""

    left: float
    right: float
    above: float
    below: float


def _sides(one: Place, numbers: float) -> _Sides:
    """Room that the texts around axes take, where the numbers of the y axis are so wide, mm."""
    if not one.axis.axison:
        texts, box = one.axis.get_tightbbox(), one.axis.get_window_extent()
        beyond = (box.x0 - texts.x0, texts.x1 - box.x1, texts.y1 - box.y1, box.y0 - texts.y0)
        left, right, above, below = (EDGE + max(size, 0.0) * 25.4 / one.axis.figure.dpi for size in beyond)
        return _Sides(left, right, above, below)
    name = block(one.axis.get_ylabel(), _NAMES)
    return _Sides(EDGE + _TO_TICKS + numbers + (_TO_NAME + name if name else 0.0), _right(one), one.above, _below(one))


def _set(one: Place, box: tuple[float, float, float, float], height: float, numbers: float | None) -> None:
    """Set the position of axes, mm, and where their names stand, if the width of the numbers is known."""
    x, y, wide, high = box
    one.axis.set_position((x / WIDTH, y / height, wide / WIDTH, high / height))
    one.axis.apply_aspect()
    if one.bar is not None:
        one.bar.set_position(((x + wide + _TO_BAR) / WIDTH, y / height, _BAR / WIDTH, high / height))
    if numbers is not None:
        one.axis.yaxis.set_label_coords(-(_TO_TICKS + numbers + _TO_NAME) / wide, 0.5)
        one.axis.xaxis.set_label_coords(0.5, -(_TO_TICKS + _high(one) + _TO_NAME) / high)


def _below(one: Place) -> float:
    """Height of what stands below axes, mm."""
    name = block(one.axis.get_xlabel(), _NAMES)
    return _TO_TICKS + _high(one) + (_TO_NAME + name if name else 0.0)


def _right(one: Place) -> float:
    """Width of what stands to the right of axes, mm."""
    if one.bar is not None:
        name = block(one.bar.get_ylabel(), _NAMES)
        return _TO_BAR + _BAR + _TO_TICKS + _widest(one.bar.yaxis) + _TO_NAME + name + EDGE
    return EDGE + 0.5 * _width(_numbers(one.axis.xaxis)[-1:])


def _numbers(along: Any) -> list[str]:
    """Texts of the ticks of an axis within its ends."""
    if not any(along.get_tick_params().get(f"label{side}") for side in ("left", "right", "bottom", "top")):
        return []
    low, high = sorted(along.get_view_interval())
    room, found = 1e-9 * (high - low), []
    for places, numbers in (
        (along.get_minorticklocs(), along.get_minor_formatter()),
        (along.get_majorticklocs(), along.get_major_formatter()),
    ):
        if len(places):
            texts = zip(places, numbers.format_ticks(places), strict=False)
            found += [text for place, text in texts if low - room <= place <= high + room]
    return found


def _width(texts: Sequence[str]) -> float:
    return max((text_width(line, _TICKS) for text in texts for line in text.split("\n")), default=0.0)


def _widest(along: Any) -> float:
    """Width of the widest number or name at a y axis, mm."""
    return _width(_numbers(along))


def _high(one: Place) -> float:
    """Height of the numbers or names at an x axis, mm; those that stand upright are as high as wide."""
    texts = _numbers(one.axis.xaxis)
    return _width(texts) if one.upright else max((block(text, _TICKS) for text in texts), default=0.0)
