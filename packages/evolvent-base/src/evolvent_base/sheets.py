"""What is used of Matplotlib: a module that is loaded when something is drawn."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import LogFormatterSciNotation, NullLocator, ScalarFormatter
from PIL import Image

__all__ = [
    "Figure", "FigureCanvasAgg", "FontProperties", "Image", "LineCollection", "LogFormatterSciNotation", "LogNorm",
    "Normalize", "NullLocator", "PolyCollection", "ScalarFormatter", "mpl", "text_to_path",
]  # fmt: skip
