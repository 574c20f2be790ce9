"""Numbers at the ticks of axes as plain text: the parser of mathtext took a third of the time of a figure."""

from __future__ import annotations

import re
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
