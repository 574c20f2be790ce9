"""The panel of the case: which one, its form, and the button that runs it."""

from __future__ import annotations

import copy
import dataclasses
import pathlib
from collections.abc import Callable
from typing import Any

from nicegui import events, ui

from evolvent import cases
from evolvent_base.errors import EvolventError, InputError
from evolvent_base.schema import Section
from evolvent_studio import parts
from evolvent_studio.context import Context
from evolvent_studio.drafts import Draft, view_of
from evolvent_studio.elements import upload
from evolvent_studio.formview import FormView, errors_text, first_error
from evolvent_studio.jobkinds import KINDS
from evolvent_studio.partsview import PartsView
from evolvent_studio.places import LARGEST
from evolvent_studio.startview import StartView


class CasePanel:
    """The panel.

    Parameters
    ----------
    page : Context
    """

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self._parts: PartsView | None = None
        self._form: FormView | None = None
        self._wrong: dict[str, str] = {}
        self.start = StartView(page, self)
        with ui.element("div").classes("ev-scroll"):
            with ui.element("div").classes("ev-drop w-full"):  # it stays: a file may still be on its way through it
                upload(
                    label="drop a case (YAML) here, or choose", most=LARGEST, handle=self._dropped,
                    refused=lambda: self.page.show_message("a case is a YAML file of at most 500 kB"),
                ).props('flat dense accept=".yaml,.yml" data-testid="case-upload"')  # fmt: skip
            self._body = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._run = ui.button("Run", on_click=lambda: self._submit()).props(
                'unelevated color=primary data-testid="run"'
            )
            self._analyses: dict[str, ui.button] = {}
            for kind, sort in KINDS.items():
                if sort.analysis:
                    button = ui.button(sort.title, on_click=lambda k=kind: self._submit(k))
                    button.props(f'outline color=primary data-testid="{kind}"')
                    button.props["title"] = sort.analysis
                    self._analyses[kind] = button
            ui.button("Save as", on_click=self._save).props('flat color=primary data-testid="save-case"')
            ui.button("YAML", on_click=self._text).props('flat color=primary data-testid="yaml"')
            self._state = ui.label("").classes("ev-status").style("margin-left:auto")
        self.draw()

    def draw(self, draft: Draft | None = None) -> None:
        """Draw the form of a draft, that of the studio unless given; the page goes on with its own copy."""
        draft = self.draft = dataclasses.replace(draft or self.studio.draft)
        self._body.clear()
        with self._body:
            options = self._options()
            with ui.element("div").classes("ev-row").style("order:-1"):  # above what files are dropped on
                chosen = ui.select(options, value=draft.source, label="case or YAML file of the folder")
                chosen.props('outlined dense options-dense data-testid="case"').style("flex:1;min-width:0")
                chosen.on_value_change(lambda e: self._choose(str(e.value)))
                self._chosen = chosen
                again = ui.button(icon="refresh", on_click=self._again).props("flat dense round size=sm color=primary")
                again.tooltip("reload the list of files and this file")
            ui.label(draft.about).classes("ev-what")
            self._draw_form(str(draft.content["system"]))
        self.page.case_drawn()

    def _draw_form(self, system: str) -> None:
        """Draw the form of a case, and cards of its parts where it has any."""
        kind, content = cases.system(system).Case, self.draft.content
        key = parts.key_of(kind)
        self._parts, self._form = None, None

        def draw_parts() -> None:
            if key:
                self._parts = PartsView(self.page, key, content.get(key), self._parts_changed)

        def complete(typed: dict[str, Any]) -> dict[str, Any]:
            whole = {"system": system, **typed}
            if self._parts is not None:
                whole[key] = self._parts.content
            return {name: whole[name] for name in sorted(whole, key=_place_in(kind))}

        self._form = FormView(
            kind, content, self._changed, skip=("system", key) if key else ("system",), complete=complete,
            middle=draw_parts, elsewhere=(key,) if key else (),
        )  # fmt: skip
        self._changed(self.draft.content, self._wrong)

    def list(self) -> None:
        """List the cases of the folder again."""
        self._chosen.set_options(self._options(), value=self.draft.source)

    def _options(self) -> dict[str, str]:
        draft, options = self.draft, self.studio.sources()
        return options if draft.source in options else {draft.source: draft.about, **options}

    def _choose(self, source: str) -> None:
        if source == self.draft.source and source not in self.studio.sources():
            return
        done = self.page.attempt(lambda: self.studio.open_case(source))
        self.draw(None if done else self.draft)

    async def _dropped(self, event: events.UploadEventArguments) -> None:
        content = await event.file.read()
        done = self.page.attempt(
            lambda: self.studio.open_case(f"file:{self.studio.folder.keep(event.file.name, content)}")
        )
        self.draw(None if done else self.draft)

    def _again(self) -> None:
        """Look for files again, and read that of the form again."""
        if self.draft.source in self.studio.sources():
            self._choose(self.draft.source)
        else:
            self.draw(self.draft)

    def wrong(self) -> dict[str, str]:
        """What is wrong with the case: dotted key -> sentence."""
        return self._wrong | (self._parts.problems() if self._parts is not None else {})

    def shown_wrong(self) -> dict[str, str]:
        """Those of the errors that are shown: not of fields that are empty and were not touched."""
        shown = self._form.shown if self._form is not None else self._wrong
        return shown | (self._parts.shown_problems() if self._parts is not None else {})

    def note(self, sentence: str) -> None:
        """Show what the assembly of the parts found beside the key that it names; '' for nothing."""
        if self._parts is not None:
            self._parts.note(sentence)

    @property
    def has_parts(self) -> bool:
        """Whether the case is one of parts by name."""
        return self._parts is not None

    def _parts_changed(self) -> None:
        if self._form is not None:
            self._form.check()

    def _changed(self, content: dict[str, Any], wrong: dict[str, str]) -> None:
        self.draft.content, self._wrong = content, wrong
        self.studio.draft = self.draft
        count = len(self.shown_wrong())
        self._run.set_enabled(not count)
        for kind, button in self._analyses.items():
            needs = KINDS[kind].needs
            button.set_visibility(self.has_parts and (not needs or content.get(needs) is not None))
            button.set_enabled(not count)
        self.start.schedule()
        self._state.set_text(errors_text(count))

    def submit(self) -> None:
        """Run the case."""
        self._submit()

    def _submit(self, kind: str = "run") -> None:
        def add() -> None:
            self.flush()
            if wrong := self.wrong():
                self._show_all()
                raise InputError(first_error(wrong))
            key = self.studio.submit(self.draft, kind)
            self.page.show(view_of(self.studio.jobs.get(key)), tab="runs")

        self.page.attempt(add)

    def _show_all(self) -> None:
        """Show all errors, also of fields that were not touched."""
        if self._form is not None:
            self._form.show_all()
        if self._parts is not None:
            self._parts.show_all()
        self._changed(self.draft.content, self._wrong)

    def flush(self) -> None:
        """Check now what was typed a moment ago."""
        if self._parts is not None:
            self._parts.flush()
        if self._form is not None:
            self._form.flush()

    def _written(self) -> str:
        """The case as YAML, in full where it is right."""
        self.flush()
        try:
            return cases.to_yaml(cases.load(self.draft.content), self.draft.content)
        except EvolventError:
            return cases.dump(self.draft.content)

    def _text(self) -> None:
        self.page.show_text("The case as a file, all defaults written out", self._written(), "case.yaml")

    def _save(self) -> None:
        def keep(name: str) -> str:
            path = self.studio.folder.new(name, ".yaml")
            path.write_text(self._written(), encoding="utf-8")
            source, content = f"file:{self.studio.folder.name(path)}", self.draft.content
            self.studio.draft = Draft(source, path.name, content, copy.deepcopy(content), source)
            self.draw()
            return self.studio.folder.name(path)

        stem = pathlib.PurePosixPath(self.draft.source.partition(":")[2] or "case").stem
        self.page.ask_name("Save the case in the working folder", f"{stem}-2.yaml", keep)


def _place_in(kind: type[Section]) -> Callable[[str], int]:
    """Order of a section's keys; what it does not know comes last."""
    known = list(kind.model_fields)
    return lambda name: known.index(name) if name in known else len(known)
