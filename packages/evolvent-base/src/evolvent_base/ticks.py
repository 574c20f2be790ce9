"""Ticks of axes, drawn faster: plain text instead of mathtext, and one tick object for all ticks of an axis."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy

from evolvent_base.figures import axis_label, superscript, with_power
from evolvent_base.style import wrapped

if TYPE_CHECKING:
    from evolvent_base import sheets
else:
    sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)

#: Ratio of the ends of a logarithmic axis above which powers of ten alone have ticks: others take half of the time.
_DECADES = 1e3
#: Distance of a tick outside the ends of an axis that is round-off, relative to the length of the axis (as matplotlib).
_ROUND_OFF = 1e-10


def set_plain_ticks(axis: Any, labels: tuple[str, str] = ("", ""), size: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write the numbers of axes as plain text, and a power of ten that they share before the unit of the label.

    Without a label the power stays beside the axis.

    Parameters
    ----------
    axis : axes of matplotlib
    labels : of both axes
    size : width and height of the axes, mm, about
    """
    for one, label, room in zip((axis.xaxis, axis.yaxis), labels, size, strict=True):
        if type(one.get_major_formatter()) is sheets.ScalarFormatter:
            one.set_major_formatter(_numbers(one, label, room))
        if type(one.get_major_formatter()) is sheets.LogFormatterSciNotation:
            one.set_major_formatter(_powers(few=False))
            low, high = one.get_view_interval()
            if high > _DECADES * low:
                one.set_minor_locator(sheets.NullLocator())
            else:
                one.set_minor_formatter(_powers(few=True))


def _numbers(along: Any, label: str, room: float) -> Any:
    """A formatter of the numbers at a linear axis."""

    class PlainNumbers(sheets.ScalarFormatter):
        beside = ""  # a factor of all numbers that is not in the label

        def __call__(self, x: float, pos: int | None = None) -> str:
            return str(super().__call__(x, pos)).removeprefix(r"$\mathdefault{").removesuffix("}$")

        def set_locs(self, locs: Any) -> None:
            super().set_locs(locs)
            self.beside = str(super().get_offset())
            power = re.search(r"10\^\{([-\N{MINUS SIGN}]?\d+)\}", self.beside)
            if label:
                text = with_power(label, int(power[1].replace("\N{MINUS SIGN}", "-"))) if power else label
                along.set_label_text(wrapped(axis_label(text), 8.0, room))
                self.beside = "" if power else self.beside

        def get_offset(self) -> str:
            return self.beside

    return PlainNumbers()


def _powers(*, few: bool) -> Any:
    """A formatter of the numbers at a logarithmic axis, of its minor ticks (`few` have a number)."""

    class PlainPowers(sheets.LogFormatterSciNotation):
        def __call__(self, x: float, pos: int | None = None) -> str:
            text = str(super().__call__(x, pos)).removeprefix(r"$\mathdefault{").removesuffix("}$")
            text = text.replace(r"\times", "\N{MULTIPLICATION SIGN}")
            return re.sub(r"\^\{(-?\d+)\}", lambda found: superscript(found[1]), text)

    return PlainPowers(labelOnlyBase=False) if few else PlainPowers()


def share_ticks(axis: Any) -> None:
    """Draw all major ticks of an axis with one tick object, which is moved, and all minor ticks with another one.

    matplotlib creates three lines and two texts for each tick, which takes longer than drawing them. The picture is
    the same. If the single ticks of the axis are requested (`get_xticklabels` and the like), matplotlib creates them,
    and draws them as usual.

    Parameters
    ----------
    axis : x or y axis of matplotlib
    """
    axis.draw = functools.partial(_draw_axis, axis, axis.draw)


def _draw_axis(axis: Any, draw: Any, renderer: Any) -> None:
    """Draw an axis as matplotlib does, with one tick object; call `draw` if the axis has several tick objects."""
    if len(axis.majorTicks) > 1 or len(axis.minorTicks) > 1:
        draw(renderer)
        return
    if not axis.get_visible():
        return
    renderer.open_group("matplotlib.axis", gid=axis.get_gid())
    numbers = axis.get_major_formatter()
    boxes: tuple[list[Any], list[Any]] = [], []
    for tick in _ticks_in_view(axis):
        for label, found in zip((tick.label1, tick.label2), boxes, strict=True):
            # the offset text is placed beside the labels
            if numbers.get_offset() and label.get_visible() and label.get_in_layout():
                found.append(label.get_window_extent(renderer))
        tick.draw(renderer)
    axis._update_label_position(renderer)
    axis.label.draw(renderer)
    axis._update_offset_text_position(*boxes)
    axis.offsetText.set_text(numbers.get_offset())
    axis.offsetText.draw(renderer)
    renderer.close_group("matplotlib.axis")
    axis.stale = False


def _ticks_in_view(axis: Any) -> Iterator[Any]:
    """The tick object of an axis, moved to each location in view: major ticks, then minor ones."""
    low, high = sorted(axis.get_transform().transform(axis.get_view_interval()))
    room = _ROUND_OFF * (high - low)
    for locator, formatter, places, ticks in (
        (axis.get_major_locator(), axis.get_major_formatter(), axis.get_majorticklocs, axis.get_major_ticks),
        (axis.get_minor_locator(), axis.get_minor_formatter(), axis.get_minorticklocs, axis.get_minor_ticks),
    ):
        if isinstance(locator, sheets.NullLocator) or not len(at := places()):
            continue
        texts = formatter.format_ticks(at)
        (tick,) = ticks(1)
        for place, text in zip(at, texts, strict=True):
            if low - room <= axis.get_transform().transform(place) <= high + room:
                tick.update_position(place)
                tick.label1.set_text(text)
                tick.label2.set_text(text)
                yield tick
