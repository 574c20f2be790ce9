"""What is shown of margins, dispersions and calibrations: the page with their results, as the commands write it."""

from __future__ import annotations

import dataclasses
import urllib.parse
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from evolvent_base.errors import InputError
from evolvent_studio import laws, reading
from evolvent_studio.context import Context
from evolvent_studio.drafts import View
from evolvent_studio.elements import report_frame
from evolvent_studio.folder import OWN
from evolvent_studio.job import Job
from evolvent_studio.jobkinds import CALIBRATION, FITTED, LAW
from evolvent_studio.jobview import draw_job, status_of


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
        """Draw the results of a job, or how far it is, or those of a dispersion in a folder."""
        kind, _, key = ref.partition(":")
        if kind == "file":
            self._in_folder(ref, key)
            return
        job = self.studio.jobs.jobs.get(key)
        if job is None or job.open or self.studio.jobs.report(key) is None:
            draw_job(self.page, key)
            if job is not None and not job.open and not job.sort.of_case:
                self._change(job, "outline").style("align-self:flex-start")
            return
        with ui.element("div").classes("ev-titlebar").props('data-testid="report-of"'):
            ui.label(f"{job.sort.title} {self.studio.name(ref)}").classes("ev-h1")
            text, look = status_of(job)
            ui.label(text).classes(f"ev-status {look}")
            ui.element("div").style("flex:1")
            self._change(job, "flat dense")
            if job.kind == "disperse":
                self._runs(ref)
            if job.kind == "calibrate":
                fitted = ui.button("Open the fitted case", on_click=lambda: self._open_fitted(job))
                fitted.props('flat dense color=primary data-testid="open-fitted"')
            if job.kind == "relaxation":
                law = ui.button(
                    "Put it into the case", on_click=lambda: self.page.attempt(lambda: self._ask_place(job))
                )
                law.props('flat dense color=primary data-testid="put-law"')
            self._downloads(job, urllib.parse.quote(ref))
        if job.message:
            kind = "bad" if job.status == "failed" else "warn" if job.is_warning else "note"
            ui.label(job.message[:1].upper() + job.message[1:]).classes(f"ev-banner {kind}").props(
                'data-testid="message"'
            )
        report_frame(ref, job.sort.title, dark=self.studio.dark)

    def _in_folder(self, ref: str, name: str) -> None:
        """Draw the report of a dispersion in a folder."""
        with ui.element("div").classes("ev-titlebar").props('data-testid="report-of"'):
            ui.label(f"Dispersion {name}").classes("ev-h1")
            ui.element("div").style("flex:1")
            self._runs(ref)
            address = f"/studio/report?ref={urllib.parse.quote(ref)}"
            button = ui.button("Download", on_click=lambda: ui.download(address, filename="dispersion.html"))
            button.props('outline dense color=primary data-testid="download-report"').style("padding:0 10px")
        report_frame(ref, "Dispersion", dark=self.studio.dark)

    def _runs(self, ref: str) -> None:
        """The button that shows the runs of a dispersion."""
        runs = ui.button("Open its runs", on_click=lambda: self.page.show(View("study", (ref,))))
        runs.props('flat dense color=primary data-testid="open-runs"')

    def _change(self, job: Job, look: str) -> ui.element:
        """The button that opens what a job was made from."""
        if job.sort.of_case:
            button = ui.button("Open its case", on_click=lambda: self.page.open_job_case(job.key))
        else:
            take = self._edit[job.kind]
            button = ui.button(
                f"Edit the {job.sort.title.lower()}",
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

    def _ask_place(self, job: Job) -> None:
        """Ask which parts of the open case take the law of a relaxation fit, and put it there."""
        text = self.studio.folder.read(OWN, job.key, CALIBRATION, LAW).decode("utf-8", "replace")
        law = reading.content(text, LAW)
        law = law.get("viscoelastic") if isinstance(law, dict) else None
        if not isinstance(law, dict):
            raise InputError(f"{LAW} of the relaxation fit holds no law")
        draft = self.studio.draft
        options = {place: _named(draft.content, place) for place in laws.places(draft.content)}
        title = self.studio.open_case_title()
        if not options:
            raise InputError(f"the open case, {title}, has no material and no spring that can relax; open another one")
        with self.page.dialogs, ui.dialog(value=True) as dialog, ui.card().style("min-width:min(460px,90vw)"):
            ui.label("Put the law into the open case").classes("ev-title")
            ui.label(f"{title}: the key viscoelastic of").classes("ev-what")
            chosen = ui.select(options, value=[next(iter(options))] if len(options) == 1 else [], multiple=True)
            chosen.props('outlined dense options-dense use-chips data-testid="law-places"').classes("w-full")
            ui.label(text.strip()).classes("ev-code ev-law w-full")

            def put() -> None:
                if not chosen.value:
                    raise InputError("no part is chosen; choose one or more")
                content = laws.with_law(draft.content, law, chosen.value)
                self.studio.draft = dataclasses.replace(draft, content=content)
                dialog.close()
                self.page.open_case()

            with ui.row():
                button = ui.button("Put it there", on_click=lambda: self.page.attempt(put))
                button.props('unelevated color=primary data-testid="law-done"')
                ui.button("Cancel", on_click=dialog.close).props("flat")

    def _downloads(self, job: Job, ref: str) -> None:
        button = ui.button("Download").props('outline dense color=primary data-testid="download-report"')
        with button.style("padding:0 10px"), ui.menu():
            name = f"{job.sort.title.lower().replace(' ', '-')}.html"
            ui.menu_item("Report (HTML)", lambda: ui.download(f"/studio/report?ref={ref}", filename=name))
            for text, file in job.sort.kept.items():
                ui.menu_item(text, lambda f=file: ui.download(f"/studio/kept?ref={ref}:{f}"))


def _named(content: Mapping[str, Any], place: str) -> str:
    """How a place of a law is called: its part, what of it, and whether it holds a law already."""
    name = place.partition(".")[2].rpartition(".")[0].replace(".", ": ")
    return f"{name} (replaces its law)" if laws.held(content, place) else name
