"""Figures of storage along lines: the shapes that beams, rods and threads had, and what deformation they keep."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evolvent.results.motion import Motion
from evolvent.view.drawing import motion_of
from evolvent_base.figures import Figure, Line, Panel, stacked

if TYPE_CHECKING:
    import xarray as xr

Array = np.ndarray
#: Height of the figure of shapes, mm.
_HEIGHT = 90.0


class Kept(NamedTuple):
    """Deformation along a part that it keeps just after all stress is released at once.

    Attributes
    ----------
    part, words, unit : str
    arc : (n,) float, m, length from the root
    values : (n,) float
    """

    part: str
    words: str
    arc: Array
    values: Array
    unit: str


def kept_figure(kept: Sequence[Kept]) -> Figure | None:
    """What is kept along the parts, a panel a deformation; None where there is nothing."""
    panels = []
    for words, own in itertools.groupby(sorted(kept, key=lambda one: one.words), lambda one: one.words):
        rows = list(own)
        lines = [Line(x=one.arc, y=one.values, label=one.part, color=k) for k, one in enumerate(rows)]
        panels.append(
            Panel(x_label="length from the root, m", y_label=f"{words}, {rows[0].unit}", lines=lines, y_zero=True)
        )
    if not panels:
        return None
    title = "Kept along the length just after a sudden release of all stress"
    return Figure(name="storage_kept", title=title, panels=panels, height=stacked(len(panels)))


def shape_figure(over: xr.DataTree, runs: Sequence[xr.DataTree]) -> Figure | None:
    """Shapes of all lines before and after storage, and at the end of the deployments; None of a system without lines.

    Parameters
    ----------
    over : xarray.DataTree, the equilibria over storage
    runs : the deployments before and after; none without them
    """
    stowed = motion_of(over)
    if stowed is None or not _lines(stowed, 0):
        return None
    moments = [("stowed", [("before storage", stowed, 0), ("after storage", stowed, -1)])]
    ends = [motion_of(run) for run in runs]
    if ends and all(ends):
        time = float(runs[-1].to_dataset()["time"].values[-1])
        labels = ("without storage", "after storage")
        shown = [(label, end, -1) for label, end in zip(labels, ends, strict=True) if end is not None]
        moments.append((f"end of the deployment, {time:.4g} s", shown))
    clouds = [own for _, shown in moments for _, motion, at in shown for own in _lines(motion, at)]
    plane = _plane(clouds)
    panels = [
        Panel(
            x_label=f"{'xyz'[plane[0]]}, m", y_label=f"{'xyz'[plane[1]]}, m", title=title, equal=True,
            lines=[*_drawn(shown, plane)],
        )
        for title, shown in moments
    ]  # fmt: skip
    title = "Shapes before and after storage"
    return Figure(name="storage_shapes", title=title, panels=panels, columns=len(panels), height=_HEIGHT)


def _lines(motion: Motion, at: int) -> list[Array]:
    """Points (n, 3) of each line that is there at a sample, but for those of springs."""
    return [own[at] for own in motion.strands if np.isfinite(own[at]).any()]


def _plane(clouds: Sequence[Array]) -> tuple[int, int]:
    """The two axes along which single lines, points (n, 3) each, extend most."""
    extent = np.max([np.nanmax(own, axis=0) - np.nanmin(own, axis=0) for own in clouds], axis=0)
    first, second = sorted(np.argsort(-extent, kind="stable")[:2].tolist())
    return first, second


def _drawn(shown: Sequence[tuple[str, Motion, int]], plane: tuple[int, int]) -> list[Line]:
    """Lines of a panel: dashed before, full after; the first of each has the label."""
    found = []
    for style, (label, motion, at) in zip(("--", "-"), shown, strict=True):
        for k, own in enumerate(_lines(motion, at)):
            found.append(Line(x=own[:, plane[0]], y=own[:, plane[1]], label="" if k else label, style=style))
    return found
