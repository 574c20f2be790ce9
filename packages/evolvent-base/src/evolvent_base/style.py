"""The style of all figures: colours, dashes, sizes of letters, and the room that texts take."""

from __future__ import annotations

import contextlib
import functools
import re
import textwrap
from typing import Any

import lazy_loader as lazy

sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)

#: Okabe and Ito's palette, distinguishable with any kind of colour vision; black leads.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
#: Dashes of solid lines that share a panel, by the index of their color in the palette: distinguishable in grey.
DASHES: tuple[Any, ...] = (
    "-", (0, (7, 1.5)), (0, (1.5, 1)), (0, (7, 1.5, 1.5, 1.5)), (0, (3, 1.2)), (0, (7, 1.2, 1.2, 1.2, 1.2, 1.2)),
    (0, (12, 2)),
)  # fmt: skip
_NO_BREAK = "\N{NO-BREAK SPACE}"
#: Style of every figure: sizes of text, points, on a page of 174 mm; fonts are embedded as TrueType.
STYLE: Any = {
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.use_mathtext": True,
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 8,
    "axes.xmargin": 0.02,
    "figure.titlesize": 9,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "legend.borderaxespad": 0.2,
    "legend.borderpad": 0.1,
    "legend.columnspacing": 1.2,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.handletextpad": 0.5,
    "legend.labelspacing": 0.25,
    "mathtext.fontset": "dejavusans",
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "evolvent",
    "xtick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.labelsize": 7.5,
    "ytick.major.width": 0.6,
}
#: Millimetres in a point; height of a line of text, in its size.
POINT, LINE = 25.4 / 72.0, 1.17


def block(text: str, size: float) -> float:
    """Height of the lines of a text, mm, in letters of some size, points; 0 of none."""
    return LINE * size * POINT * (text.count("\n") + 1) if text.strip() else 0.0


@functools.lru_cache(maxsize=2048)
def text_width(text: str, size: float) -> float:
    """Width of a text, mm, in letters of some size, points."""
    if not text.strip():
        return 0.0
    letters, math = sheets.FontProperties(family="DejaVu Sans", size=size), text.count("$") > 1
    with sheets.mpl.rc_context(STYLE) if math else contextlib.nullcontext():
        width, *_ = sheets.text_to_path.get_text_width_height_descent(text, letters, ismath=math)
    return float(width) * POINT


def wrapped(text: str, size: float, width: float) -> str:
    """A text in lines that are no longer than a width, mm; no line ends within a unit in brackets."""
    lines = []
    joined = re.sub(r"\[[^]]*\]", lambda m: m[0].replace(" ", _NO_BREAK), text)
    for paragraph in joined.split("\n"):
        letters = len(paragraph)
        while (
            letters > 8 and max((text_width(one, size) for one in textwrap.wrap(paragraph, letters)), default=0) > width
        ):
            letters -= 1
        lines += textwrap.wrap(paragraph, max(letters, 1)) or [""]
    return "\n".join(lines).replace(_NO_BREAK, " ")
