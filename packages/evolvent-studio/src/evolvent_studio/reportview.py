"""What is shown of margins, dispersions and calibrations: the page with their results, as the commands write it."""

from __future__ import annotations

import urllib.parse
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from evolvent_base.errors import InputError
from evolvent_studio import reading
from evolvent_studio.context import Context
from evolvent_studio.elements import report_frame
from evolvent_studio.folder import OWN
from evolvent_studio.job import COMPUTED, Job
from evolvent_studio.jobview import NAMES, STATUS, draw_job
from evolvent_studio.state import View
from evolvent_studio.worker import CALIBRATION, FITTED


class ReportView:
    """The part of the page that shows the results of a job that writes a page.

    Parameters
    ----------
    page : Context
    edit : mapping, kind of job -> what puts the content of one, and where it is from, into a form
    """

    def __init__(self, page: Context, edit: Mapping[str, Callable[[Any, str], None]]) -> None:
        self.page, self.studio, self._edit = page, page.studio, edit

    def draw(self, ref: str) -> None:
        """Draw the results of a job, or how far it is."""
        key = ref.partition(":")[2]
        job = self.studio.jobs.jobs.get(key)
        if job is None or job.open or self.studio.jobs.report(key) is None:
            draw_job(self.page, key)
            if job is not None and not job.open and job.kind not in COMPUTED:
                self._change(job, "outline").style("align-self:flex-start")
            return
        with ui.element("div").classes("ev-titlebar").props('data-testid="report-of"'):
            ui.label(f"{NAMES[job.kind]} {self.studio.name(ref)}").classes("ev-h1")
            ui.label(STATUS.get(job.status, job.status)).classes(f"ev-status {job.status}")
            ui.element("div").style("flex:1")
            self._change(job, "flat dense")
            if job.kind == "disperse":
                runs = ui.button("Open its runs", on_click=lambda: self.page.show(View("study", (ref,))))
                runs.props('flat dense color=primary data-testid="open-runs"')
            if job.kind == "calibrate":
                fitted = ui.button("Open the fitted case", on_click=lambda: self._open_fitted(job))
                fitted.props('flat dense color=primary data-testid="open-fitted"')
            self._downloads(job, urllib.parse.quote(ref))
        if job.message:
            kind = "bad" if job.status == "failed" else "warn" if job.is_warning else "note"
            ui.label(job.message[:1].upper() + job.message[1:]).classes(f"ev-banner {kind}").props(
                'data-testid="message"'
            )
        report_frame(ref, NAMES[job.kind])

    def _change(self, job: Job, look: str) -> ui.element:
        """The button that opens what a job was made from."""
        if job.kind in COMPUTED:
            button = ui.button("Open its case", on_click=lambda: self.page.open_job_case(job.key))
        else:
            take = self._edit[job.kind]
            button = ui.button(
                f"Edit the {NAMES[job.kind].lower()}",
                on_click=lambda: self.page.attempt(lambda: take(self.studio.jobs.case_text(job.key), job.title)),
            )
        return button.props(f'{look} color=primary data-testid="edit-job"')

    def _open_fitted(self, job: Job) -> None:
        def take() -> None:
            text = self.studio.folder.read(OWN, job.key, CALIBRATION, FITTED).decode("utf-8", "replace")
            content = reading.content(text, FITTED)
            if not isinstance(content, dict):
                raise InputError(f"{FITTED} of the calibration holds no case")
            self.studio.take_case(content, f"case with the values of calibration {int(job.key[:4])}")
            self.page.open_case()

        self.page.attempt(take)

    def _downloads(self, job: Job, ref: str) -> None:
        button = ui.button("Download").props('outline dense color=primary data-testid="download-report"')
        with button.style("padding:0 10px"), ui.menu():
            name = f"{NAMES[job.kind].lower()}.html"
            ui.menu_item("Report (HTML)", lambda: ui.download(f"/studio/report?ref={ref}", filename=name))
            if job.kind == "disperse":
                ui.menu_item("All runs (CSV)", lambda: ui.download(f"/studio/dispersed?ref={ref}"))
