"""Elements of the page that NiceGUI does not have: the motion, charts with a time cursor."""

from __future__ import annotations

import pathlib
import urllib.parse
from collections.abc import Callable, Sequence
from typing import Any

from nicegui import ui
from nicegui.element import Element

from evolvent.studio.charts import Chart

_STATIC = pathlib.Path(__file__).with_name("static")
#: What NiceGUI ships of ECharts; charts import it, offline.
SHIPPED = (ui.echart,)


class ChartElement(Element, component=_STATIC / "chart.js"):
    """A chart.

    Parameters
    ----------
    chart : Chart
    on_point : called with (series, index) of a point that was clicked
    """

    def __init__(self, chart: Chart, *, on_point: Callable[[int, int], Any] | None = None) -> None:
        super().__init__()
        self._props["options"] = chart.options
        self._props["timed"] = chart.timed
        self._props["equal"] = chart.equal
        self._props["clickable"] = on_point is not None
        if on_point is not None:
            self.on("point", lambda event: on_point(int(event.args["series"]), int(event.args["index"])))

    def show(self, chart: Chart) -> None:
        """Show another chart in its place."""
        if chart.options != self._props["options"]:
            self._props["options"] = chart.options
            self.update()


class MotionElement(Element, component=_STATIC / "motion.js"):
    """The motion of runs.

    Parameters
    ----------
    refs : of the runs
    names : of the runs
    """

    def __init__(self, refs: Sequence[str], names: Sequence[str]) -> None:
        super().__init__()
        self._props["urls"] = [f"/studio/motion?ref={urllib.parse.quote(ref)}" for ref in refs]
        self._props["labels"] = list(names)

    def show_start(self, ref: str) -> None:
        """Show the start of a case that is being written, from where the last one was seen."""
        self._show(f"/studio/start?ref={urllib.parse.quote(ref)}")

    def show_mode(self, ref: str) -> None:
        """Show a mode, "job:KEY:NUMBER", moving, from where the last one was seen."""
        self._props["playing"] = True
        self._show(f"/studio/mode?ref={urllib.parse.quote(ref)}")

    def _show(self, url: str) -> None:
        self._props["urls"] = [url]
        self.update()


def upload(**options: Any) -> ui.upload:
    """What files are dropped on; it forgets them once they are here, for it would refuse the same file else."""
    drop = ui.upload(auto_upload=True, **options)
    drop.on("uploaded", lambda: drop.run_method("removeUploadedFiles"), args=[])
    return drop
