"""What is shown of modes: their frequencies, damping and effective masses in a table, and the chosen one moving."""

from __future__ import annotations

import urllib.parse

from nicegui import ui

from evolvent_studio.context import Context
from evolvent_studio.elements import MotionElement
from evolvent_studio.job import Job
from evolvent_studio.jobview import STATUS, draw_job


class ModesView:
    """The part of the page that shows modes.

    Parameters
    ----------
    page : Context
    """

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self._chosen: dict[str, int] = {}  # of each job, the mode that was chosen last

    def draw(self, ref: str) -> None:
        """Draw the modes of a job, or how far it is."""
        key = ref.partition(":")[2]
        if draw_job(self.page, key):
            return
        job = self.studio.jobs.get(key)
        with ui.element("div").classes("ev-titlebar").props('data-testid="modes-of"'):
            ui.label(f"Modes {self.studio.name(ref)}").classes("ev-h1")
            ui.label(STATUS.get(job.status, job.status)).classes(f"ev-status {job.status}")
            ui.element("div").style("flex:1")
            ui.button("Open its case", on_click=lambda: self.page.open_job_case(key)).props("flat dense color=primary")
            address = f"/studio/modes?ref={urllib.parse.quote(ref)}"
            download = ui.button("Download", on_click=lambda: ui.download(address))
            download.props('outline dense color=primary data-testid="download-modes"').style("padding:0 10px")
        rows = job.extra.get("rows", [])
        if not rows:
            ui.label("The structure has no modes: nothing in it moves.").classes("ev-banner warn")
            return
        with ui.element("div").classes("ev-card").props('data-testid="motion"'):
            motion = MotionElement([], [])
        self._table(job, motion)

    def _table(self, job: Job, motion: MotionElement) -> None:
        """The table, whose rows choose the mode that moves."""
        lines: list[ui.element] = []
        last = len(job.extra["rows"]) - 1

        def choose(k: int) -> None:
            self._chosen[job.key] = k
            for i, line in enumerate(lines):
                line.classes(add="on" if i == k else "", remove="" if i == k else "on")
                line.props(f"aria-selected={'true' if i == k else 'false'}")
            motion.show_mode(f"job:{job.key}:{k}")

        def put(k: int) -> None:
            with ui.element("tr").classes("ev-pick").props(f'tabindex=0 data-testid="mode-{k}"') as line:
                for text in job.extra["rows"][k]:
                    with ui.element("td"):
                        ui.label(text)
            line.on("click", lambda: choose(k))
            line.on("keydown.enter", lambda: choose(k))
            lines.append(line)

        with (
            ui.element("div").classes("ev-card ev-tablebox ev-modes").props('data-testid="modes-table"'),
            ui.element("table").classes("ev-table"),
        ):
            with ui.element("tr"):
                for text in job.extra["head"]:
                    with ui.element("th"):
                        ui.label(text)
            for k in range(last + 1):
                put(k)
        first = next((k for k, row in enumerate(job.extra["rows"]) if float(row[1]) != 0.0), 0)  # the first elastic one
        choose(min(self._chosen.get(job.key, first), last))
