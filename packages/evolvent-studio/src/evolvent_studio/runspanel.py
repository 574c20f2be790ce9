"""The panel of runs: the queue, runs that are done, and those saved in the folder."""

from __future__ import annotations

import shutil

from nicegui import ui

from evolvent_base.errors import EvolventError
from evolvent_studio.context import Context
from evolvent_studio.drafts import View, view_of
from evolvent_studio.job import Job
from evolvent_studio.jobview import (
    ask_title,
    changes_text,
    date_text,
    draw_folded,
    draw_limits,
    progress_text,
    since_text,
    status_of,
)

#: Changed keys of a run that its row shows.
_CHANGES = 4


class RunsPanel:
    """The panel.

    Parameters
    ----------
    page : Context
    """

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self._files: list[str] | None = None
        self._ticked: list[str] = [r for r in page.view.refs if page.view.kind == "run" and len(page.view.refs) > 1]
        self._rows: dict[str, tuple[ui.element, tuple[object, ...]]] = {}  # of jobs: where, and what it shows
        self._bars: dict[str, tuple[ui.element, ui.label]] = {}
        with ui.element("div").classes("ev-scroll").props('data-testid="runs"'):
            self._none = ui.label("No runs yet. Runs are listed here, and stay after a reload.").classes("ev-what")
            self._jobs = ui.element("div").classes("ev-part")
            with ui.element("div").classes("ev-row"):
                ui.label("saved in the folder").classes("ev-h")
                ui.element("div").style("flex:1")
                ui.button(icon="refresh", on_click=self.draw).props("flat dense round size=sm color=primary")
            self._saved = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._compare = ui.button("Compare", on_click=self._show_ticked)
            self._compare.props('unelevated color=primary data-testid="compare"')
            self._hint = ui.label("").classes("ev-status")
        self.draw()

    def draw(self) -> None:
        """Show what is there now; what is the same stays, so that no click on it is lost."""
        jobs = self.studio.jobs.listed()
        self._none.set_visibility(not jobs)
        for key in set(self._rows) - {job.key for job in jobs}:
            self._rows.pop(key)[0].delete()
            self._bars.pop(key, None)
            self._set(f"job:{key}", False)
        for place, job in enumerate(jobs):
            ref = f"job:{job.key}"
            held = self.studio.jobs.result(job.key) is not None
            shown = job.status, job.title, progress_text(job) if not job.open else "", held, ref in self.page.view.refs
            row, before = self._rows.get(job.key, (None, None))
            if shown == before:
                continue
            if row is None:
                with self._jobs:
                    row = ui.element("div").classes("ev-part")
                row.move(target_index=place)
            self._rows[job.key] = row, shown
            self._bars.pop(job.key, None)
            row.clear()
            with row:
                self._job(job)
        self.list()
        self._count()

    def list(self) -> None:
        """List the runs of the folder again, where they are others."""
        files = self.studio.folder.runs()
        if files == self._files:
            return
        self._files = files
        gone = [ref for ref in self._ticked if ref.startswith("file:") and ref.removeprefix("file:") not in files]
        for ref in gone:
            self._set(ref, False)
        self._saved.clear()
        with self._saved:
            if not files:
                ui.label("none (*.nc)").classes("ev-what")
            for name in files:
                with ui.element("div").classes("ev-row"):
                    self._tick(f"file:{name}")
                    self._link(name, View("run", (f"file:{name}",)))

    def follow(self, changed: bool) -> None:
        """Follow the queue: the list where it changed, else the bars."""
        if changed:
            self.draw()
            return
        for key, (bar, label) in self._bars.items():
            job = self.studio.jobs.jobs.get(key)
            if job is not None:
                bar.style(f"width:{100.0 * job.share:.1f}%")
                label.set_text(progress_text(job))

    def _job(self, job: Job) -> None:
        ref = f"job:{job.key}"
        on = ref in self.page.view.refs
        with ui.element("div").classes("ev-job" + (" on" if on else "")).props(f'data-testid="job-{job.key}"'):
            with ui.element("div").classes("ev-row"):
                if job.kind == "run":
                    self._tick(ref, enabled=self.studio.jobs.result(job.key) is not None)
                self._link(f"{int(job.key[:4])} {job.title}", view_of(job))
                (text, look), kind = status_of(job), job.sort.row
                if job.limits and not job.open:
                    draw_limits(*job.limits)
                ui.label(f"{kind}, {text}" if kind else text).classes(f"ev-status {look}")
                if job.open:
                    ui.button("Cancel", on_click=lambda k=job.key: self._cancel(k)).props(
                        f'flat dense size=sm color=primary data-testid="cancel-{job.key}"'
                    )
                else:
                    self._menu(job)
            bar = ui.element("div")
            if job.status in ("running", "cancelling"):
                with ui.element("div").classes("ev-track"):
                    bar = ui.element("div").style(f"width:{100.0 * job.share:.1f}%")
            changed = since_text(job, _CHANGES) or changes_text(job, _CHANGES)
            if changed:
                whole = "; ".join(text for text in (since_text(job), changes_text(job)) if text)
                ui.label(changed).classes("ev-changes").tooltip(whole)
            date = date_text(job)
            with ui.element("div").classes("ev-sub"):
                text = progress_text(job)
                if job.status == "failed":
                    label = draw_folded(f"{date}, {text}" if date else text, "")
                else:
                    if date:
                        ui.label(f"{date}, ").classes("ev-date")
                    label = ui.label(text)
            if job.open and isinstance(label, ui.label):
                self._bars[job.key] = bar, label

    def _menu(self, job: Job) -> None:
        with ui.button(icon="more_vert").props(f'flat dense round size=sm data-testid="menu-{job.key}"'), ui.menu():
            if job.sort.of_case:
                ui.menu_item("Open its case", lambda: self.open_case(job.key))
                if job.sort.view == "run" and self.studio.jobs.result(job.key) is not None:
                    ui.menu_item("Save it in the folder", lambda: self.save_run(f"job:{job.key}"))
            if job.sort.resumed and job.status != "success":
                ui.menu_item("Continue", lambda: self.page.attempt(lambda: self.studio.jobs.resume(job.key)))
            ui.menu_item("Rename", lambda: ask_title(self.page, job.key))
            ui.menu_item("Remove", lambda: self._remove(job.key))

    def open_case(self, key: str) -> None:
        """Put the case of a job into the form."""

        def take() -> None:
            origin = str(self.studio.jobs.get(key).extra.get("origin", ""))
            self.studio.take_case(self.studio.job_case(key), f"case of run {int(key[:4])}", origin)
            self.page.open_case()

        self.page.attempt(take)

    def save_run(self, ref: str) -> None:
        """Copy a run into the working folder."""

        def copy(name: str) -> str:
            path = self.studio.folder.new(name, ".nc")
            shutil.copyfile(self.studio.path(ref), path)
            self.draw()
            return self.studio.folder.name(path)

        name = self.studio.name(ref).replace(" ", "-")
        self.page.ask_name("Keep the run in the working folder", f"{name}.nc", copy)

    def _link(self, text: str, view: View) -> None:
        link = ui.element("button").classes("ev-link").props("type=button")
        with link:
            ui.label(text).style("overflow:hidden;text-overflow:ellipsis")
        if len(text) > 28:
            link.props["title"] = text
        link.on("click", lambda: self.page.show(view))

    def _tick(self, ref: str, *, enabled: bool = True) -> None:
        box = ui.checkbox(value=ref in self._ticked).props("dense size=xs")
        box.props["data-testid"] = f"tick-{ref}"  # a file's name is nothing to be parsed
        box.set_enabled(enabled)
        box.on_value_change(lambda e: self._set(ref, bool(e.value)))

    def _set(self, ref: str, on: bool) -> None:
        if ref in self._ticked:
            self._ticked.remove(ref)
        if on:
            self._ticked.append(ref)
        self._count()

    def _count(self) -> None:
        count = len(self._ticked)
        self._compare.set_enabled(count > 1)
        self._compare.set_text(f"Compare {count} runs" if count > 1 else "Compare")
        self._hint.set_text("" if count > 1 else "tick two or more runs")

    def _show_ticked(self) -> None:
        self.page.show(View("run", tuple(self._ticked)))

    def _cancel(self, key: str) -> None:
        self.page.attempt(lambda: self.studio.jobs.cancel(key))
        self.page.update()

    def _remove(self, key: str) -> None:
        try:
            self.studio.jobs.remove(key)
        except EvolventError as error:
            self.page.show_message(str(error))
            return
        ref = f"job:{key}"
        self._set(ref, False)
        if ref in self.page.view.refs:
            self.page.show(View())
