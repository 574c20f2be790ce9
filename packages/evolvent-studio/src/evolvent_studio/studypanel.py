"""The panel of studies: a form that writes one, its number of cases and expected time, and results in the folder."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import pathlib
import tempfile
from collections.abc import Sequence
from typing import Any

from nicegui import ui

from evolvent import cases
from evolvent.design.dispersions import dispersed
from evolvent.design.studies import runner
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import child, reading, studydraft
from evolvent_studio.context import Context
from evolvent_studio.drafts import View, view_of
from evolvent_studio.sentences import as_sentence, cases_text, estimated_text, names_key
from evolvent_studio.studyform import DISPERSIONS, STUDIES, Kind, StudyForm
from evolvent_studio.studyview import StudyView

#: Seconds after the last change before the study is checked.
_PAUSE = 0.7
#: Row of a key that varies and is still to be chosen.
_NO_KEY = "over."
#: Cases up to which a study is checked as it is typed; a larger one is when it is run.
_CHECKED = 2000


class StudyPanel:
    """The panel, and what is shown of a study beside it.

    Parameters
    ----------
    page : Context
    kind : Kind, of studies that it writes
    """

    def __init__(self, page: Context, kind: Kind = STUDIES) -> None:
        self.page, self.studio, self.kind = page, page.studio, kind
        self.view = StudyView(page, self.edit)
        self._error = ""
        self._asked = 0
        self._timer: ui.timer | None = None
        self._process: asyncio.subprocess.Process | None = None
        with ui.element("div").classes("ev-scroll"):
            self._done = ui.element("div").classes("ev-part")
            self._head = ui.element("div").classes("ev-part")
            body = ui.element("div").classes("ev-part")
        self.form = StudyForm(page, kind, body, self._changed)
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button(f"Run the {kind.word}", on_click=self._submit)
            self._go.props(f"unelevated color=primary {self.kind.marked('run-study')}")
            self._guess = ui.button("Estimate", on_click=self._estimate)
            self._guess.props(f"outline color=primary {self.kind.marked('estimate')}")
            self._guess.tooltip("runs a few cases of the study and measures their time")
            ui.button("Save as", on_click=self._save).props(
                f"flat dense color=primary {self.kind.marked('save-study')}"
            )
            ui.button("YAML", on_click=self._text).props(
                f"flat dense color=primary {self.kind.marked('yaml-of-study')}"
            )
            self._state = ui.label("").classes("ev-status ev-wrap").props(self.kind.marked("state-of-study"))
        ui.context.client.on_disconnect(self._end)
        self.draw()

    # -------------------------------------------------------------------------------------------- the form

    def draw(self) -> None:
        """Draw the panel again."""
        self._follow()
        self.form.wrong, self._error, self.form.responses = {}, "", []
        self._draw_head()
        self.form.draw()
        self._draw_done()
        self._changed()

    def list(self) -> None:
        """Take the case that is open, and list the studies again; what is the same stays under the mouse."""
        if self._follow():
            self.form.draw()
            self._changed()
        if self._sources() != self._listed:
            self._draw_head()
        if self._results() != self._finished:
            self._draw_done()
        self._schedule()

    def _follow(self) -> bool:
        """Take the case that is open, where the study is of that one; returns whether it is another than before."""
        try:
            return self.studio.follow_case(self.kind.job)
        except (EvolventError, OSError):  # the check says what is wrong with it
            return False

    def edit(self, content: Any, about: str) -> None:
        """Put a study into the form.

        Parameters
        ----------
        content : mapping, or YAML
        """

        def take() -> None:
            raw = reading.content(content, about) if isinstance(content, str) else content
            self.form.draft = studydraft.of_content(raw, about)

        if self.page.attempt(take):
            self.draw()
            self.page.open_tab(self.kind.tab)

    def _sources(self) -> dict[str, str]:
        found = self.studio.study_sources(self.kind.job)
        return found if self.form.draft.source in found else {self.form.draft.source: self.form.draft.about, **found}

    def _draw_head(self) -> None:
        self._listed = self._sources()
        self._head.clear()
        with self._head:
            chosen = ui.select(
                self._listed, value=self.form.draft.source, label=f"{self.kind.word} or YAML file of the folder"
            )
            chosen.props(f"outlined dense options-dense {self.kind.marked('study')}").classes("w-full")
            chosen.on_value_change(lambda e: self._choose(str(e.value)))
            if self.form.draft.source.startswith("case:"):
                ui.label(self.form.draft.about).classes("ev-what")

    def _draw_done(self) -> None:
        self._finished = self._results()
        self._done.clear()
        with self._done:
            if not self._finished:
                return
            ui.label("results in the folder").classes("ev-h").style("margin-top:0")
            with ui.element("div").classes("ev-results"):
                for name in self._finished:
                    link = ui.element("button").classes("ev-link").props("type=button")
                    link.props["data-testid"] = f"{self.kind.mark}study-{name}"
                    with link:
                        ui.label(name)
                    link.on("click", lambda n=name: self._show_results(n))
            ui.label("write and run").classes("ev-h")

    def _results(self) -> Sequence[str]:
        """The folders with results of what the panel writes."""
        return self.studio.folder.studies(dispersed=self.kind is DISPERSIONS)

    def _show_results(self, name: str) -> None:
        """Show the results in a folder: their report, if there is one."""
        kind = "study" if self.studio.folder.report(name) is None else "report"
        self.page.show(View(kind, (f"file:{name}",)))

    def _choose(self, source: str) -> None:
        if source == self.form.draft.source:
            return

        def take() -> None:
            self.form.draft = studydraft.opened(self.studio.folder, source)

        self.page.attempt(take)
        self.draw()

    # -------------------------------------------------------------------------------------------- checking

    def _changed(self) -> None:
        """Show the number of cases now, and check the study after a pause."""
        self._error = ""
        if "" in (self.form.draft.content.get("over") or {}):
            self.form.wrong[_NO_KEY] = "choose a key"
        self._show()
        self._schedule()

    def _schedule(self) -> None:
        self._asked += 1
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        count = studydraft.count(self.form.draft.content)
        if self.studio.tab != self.kind.tab or self.form.wrong or count is None or count > _CHECKED:
            return
        with self._done:
            self._timer = ui.timer(_PAUSE, self._check, once=True)

    async def _check(self) -> None:
        asked, self._timer = self._asked, None
        draft = dataclasses.replace(self.form.draft, content=dict(self.form.draft.content))

        def read() -> list[str]:
            with self.studio.computing:
                return studydraft.responses(self.studio.folder, draft)

        try:
            found, error = await asyncio.to_thread(read), ""
        except EvolventError as problem:
            found, error = [], str(problem)
        if asked != self._asked or self._done.is_deleted:
            return
        self._error = error
        if not error and found != self.form.responses:
            self.form.offer(found)
        self._show()

    def _show(self, note: str = "") -> None:
        """Show what is wrong, or the number of cases."""
        loose, count = self._error, studydraft.count(self.form.draft.content)
        beside = dict(self.form.wrong)
        own = max((row for row in self.form.errors if names_key(loose, row)), key=len, default="")
        if loose and own:
            beside[own], loose = loose, ""
        for row, shown in self.form.errors.items():
            shown.set_text(as_sentence(beside.get(row, "")))
            asked = row == _NO_KEY and row in self.form.wrong  # what is still to be chosen is no error
            shown.classes(add="ev-todo" if asked else "", remove="" if asked else "ev-todo")
        self.form.banner.set_text(as_sentence(loose))
        self.form.banner.set_visibility(bool(loose))
        broken = bool(self.form.wrong or self._error)
        self._go.set_enabled(not broken)
        self._guess.set_enabled(not broken or self._process is not None)
        self._state.set_text(note or ("" if count is None else cases_text(count)))

    # -------------------------------------------------------------------------------------------- what is done with it

    def _asked_study(self) -> Any:
        """The checked study, in a thread: it reads every case."""
        runner.check_installed()
        with self.studio.computing:
            asked = studydraft.read(self.studio.folder, self.form.draft)
        if self.kind is DISPERSIONS:
            dispersed.check(asked)
            if not asked.keep:
                raise InputError("keep is empty; choose one or more results, such as a margin or a time of latching")
        return asked

    async def _submit(self) -> None:
        self._go.props("loading")
        try:
            asked = await asyncio.to_thread(self._asked_study)
            self.studio.folder.placed(cases.parse_yaml(asked.text, asked.name))
        except EvolventError as error:
            self._error = str(error)
            self._show()
            self.page.show_message(str(error))
            return
        finally:
            self._go.props(remove="loading")
        job = self.studio.jobs.add(self.kind.job, asked.name, case=asked.text)
        self.page.show(view_of(job), tab="runs")

    async def _estimate(self) -> None:
        """Compute a few cases in its own process; the same button cancels it."""
        if self._process is not None:
            self._end()
            return
        self._guess.props("loading")
        try:
            asked = await asyncio.to_thread(self._asked_study)
            self._process = await asyncio.create_subprocess_exec(
                *child.command("estimate"), cwd=tempfile.gettempdir(),
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
            )  # fmt: skip
        except EvolventError as error:
            self.page.show_message(str(error))
            return
        except OSError as error:
            self.page.show_message(f"no process can be started: {error.strerror}")
            return
        finally:
            self._guess.props(remove="loading")
        self._guess.set_text("Cancel")
        self._show(f"{cases_text(asked.count)}; computing one of them")
        process = self._process
        content, _ = await process.communicate(asked.text.encode())
        self._process = None
        if self._done.is_deleted:
            return
        self._guess.set_text("Estimate")
        self._show(estimated_text(asked.count, content))

    def _end(self) -> None:
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()

    def _text(self) -> None:
        name = f"{self.form.draft.content.get('study', self.kind.word)}.yaml"
        self.page.show_text(f"The {self.kind.word} as a file", studydraft.text(self.form.draft), name)

    def _save(self) -> None:
        own = self.form.draft.source.removeprefix("file:") if self.form.draft.source.startswith("file:") else ""

        def keep(name: str) -> str:
            folder = self.studio.folder
            name = name.strip()
            path = folder.inside(name) if own and name == own else folder.new(name, ".yaml")
            text = studydraft.text(self.form.draft, pathlib.PurePosixPath(folder.name(path)).parent)
            path.write_text(text, encoding="utf-8")
            saved = folder.name(path)
            self.form.draft = dataclasses.replace(self.form.draft, source=f"file:{saved}", about=saved)
            self._draw_head()
            return saved

        name = own or f"{self.form.draft.content.get('study', self.kind.word)}.yaml"
        self.page.ask_name(f"Save the {self.kind.word} in the working folder", name, keep)
