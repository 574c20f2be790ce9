"""Elements of the page that NiceGUI does not have: the motion, charts with a time cursor."""

from __future__ import annotations

import pathlib
import urllib.parse
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from nicegui import ui
from nicegui.element import Element

from evolvent_studio.charts import Chart
from evolvent_studio.differences import whole
from evolvent_studio.places import LARGEST_SIGNALS

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


def report_frame(ref: str, title: str, *, dark: bool | None) -> ui.element:
    """The page with the results of a job, in a frame that runs no script.

    Parameters
    ----------
    dark : bool, whether it is dark; None as the browser has it
    """
    frame = ui.element("iframe").classes("ev-frame")
    look = "" if dark is None else f"&look={'dark' if dark else 'light'}"
    address = f"/studio/report?ref={urllib.parse.quote(ref)}{look}"
    return frame.props(f'src="{address}" sandbox="allow-popups" title="{title}" data-testid="{title.lower()}"')


def table(rows: Sequence[Sequence[object]], *, head: Sequence[str] = ()) -> None:
    """A table of texts, with a line of heads where there are any."""
    with ui.element("table").classes("ev-table"):
        for row, cell in [(head, "th")] * bool(head) + [(row, "td") for row in rows]:
            with ui.element("tr"):
                for text in row:
                    with ui.element(cell):
                        ui.label(whole(str(text)))


def upload(
    *, most: int, handle: Callable[[Any], Awaitable[None]], refused: Callable[[], Any], **options: Any
) -> ui.upload:
    """What files are dropped on.

    Parameters
    ----------
    most : int, bytes that a file may have; the browser refuses more, and so does the server
    handle : called with the event, of one file, or of all of them where `multiple` is given
    refused : called where a file is too large, or was not received whole
    """

    async def checked(event: Any) -> None:
        files = [event.file] if hasattr(event, "file") else event.files
        if any(file.size() > most for file in files):
            refused()
        else:
            await handle(event)

    many = bool(options.get("multiple"))
    drop = ui.upload(
        auto_upload=True,
        max_file_size=most,
        max_total_size=LARGEST_SIGNALS if many else None,
        on_rejected=refused,
        on_upload=None if many else checked,
        on_multi_upload=checked if many else None,
        **options,
    )
    drop.on("failed", lambda: refused(), args=[])
    # it forgets the files once they are here, for it would refuse the same file else
    drop.on("uploaded", lambda: drop.run_method("removeUploadedFiles"), args=[])
    return drop
