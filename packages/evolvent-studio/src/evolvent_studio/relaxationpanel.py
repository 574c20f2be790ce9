"""The form of relaxation fits: files with curves, columns and temperatures, and the options of the series."""

from __future__ import annotations

import asyncio
import contextlib
import pathlib
from collections.abc import Callable
from typing import Any

import yaml
from nicegui import events, ui

from evolvent.design.calibration.relaxation import curves
from evolvent_base import signals
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import reading, relaxation
from evolvent_studio.context import Context
from evolvent_studio.drafts import view_of
from evolvent_studio.elements import upload
from evolvent_studio.formview import FormView, errors_text
from evolvent_studio.places import LARGEST_RECORDING, LARGEST_SIGNALS
from evolvent_studio.placing import TABLES


class RelaxationPanel:
    """The form.

    Parameters
    ----------
    page : Context
    shown : called where the form is to be shown in place of the other one
    """

    def __init__(self, page: Context, shown: Callable[[], None]) -> None:
        self.page, self.studio, self._shown = page, page.studio, shown
        self._form: FormView | None = None
        self._wrong: dict[str, str] = {}
        with ui.element("div").classes("ev-scroll"):
            ui.label(
                "A Prony series is fitted to curves of relaxation: force or torque over time at a position that is "
                "held, at one temperature or several. The fitted law goes into a part of the open case."
            ).classes("ev-what")
            with ui.element("div").classes("ev-drop w-full"):
                upload(
                    label="Drop files of data (CSV) here, or choose", multiple=True,
                    most=LARGEST_SIGNALS, handle=self._dropped,
                    refused=lambda: self.page.show_message("the upload was refused: it is too large"),
                ).props(f'flat dense accept="{",".join(TABLES)}" data-testid="curves-upload"')  # fmt: skip
            self._known = ui.select([], label="or a file of the folder")
            self._known.props('outlined dense options-dense data-testid="curves-file"').classes("w-full")
            self._known.on_value_change(lambda e: self._add([str(e.value)]) if e.value else None)
            self._body = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button("Fit the series", on_click=self._submit)
            self._go.props('unelevated color=primary data-testid="fit-series"')
            self._hint = ui.label("").classes("ev-status ev-wrap")
        self.draw()

    @property
    def _state(self) -> dict[str, Any]:
        return self.studio.calibration

    def draw(self) -> None:
        """Draw the form again."""
        state = self._state
        taken = [row["file"] for row in state["curves"]]
        self._known.set_options([name for name in self.studio.folder.files(*TABLES) if name not in taken], value=None)
        names = self._columns()
        self._body.clear()
        with self._body:
            for place, row in enumerate(state["curves"]):
                self._draw_row(place, row)
            if state["curves"]:
                ui.label("columns").classes("ev-h")
                with ui.element("div").classes("ev-fields"):
                    self._select("column", "force or torque", names)
                    self._select("temperature", "temperature", names)
            ui.label("series").classes("ev-h")
            self._form = FormView(
                relaxation.Asked, state["options"], self._changed, skip=relaxation.OF_FILES, complete=self._whole,
                before="relaxation.", flat=True, folds=False, elsewhere=relaxation.OF_FILES,
            )  # fmt: skip
        self._show()

    def _columns(self) -> list[str]:
        """Names of the columns of the first file that can be read."""
        for row in self._state["curves"]:
            with contextlib.suppress(InputError):  # it is said when it is fitted
                path = self.studio.folder.file(row["file"], LARGEST_RECORDING)
                return list(signals.read(str(path)).names)
        return []

    def _draw_row(self, place: int, row: dict[str, str]) -> None:
        with ui.element("div").classes("ev-axis").props(f'data-testid="curve-{place}"'):
            with ui.element("div").classes("ev-row"):
                ui.label(row["file"].rpartition("/")[2]).classes("ev-cut").style("flex:1")
                drop = ui.button(icon="close", on_click=lambda: self._drop(row))
                drop.props('flat dense round size=sm aria-label="remove it"')
            if not self._state["temperature"]:
                typed = ui.input("its temperature, such as 20 degC", value=row["temperature"]).classes("w-full")
                typed.props(f'outlined dense spellcheck=false data-testid="curve-{place}-temperature"')
                typed.on_value_change(lambda e: self._put(row, "temperature", e.value))

    def _select(self, key: str, label: str, names: list[str]) -> None:
        value = self._state[key] or None
        listed = [value, *names] if value and value not in names else names
        chosen = ui.select(listed, value=value, label=label, clearable=True).classes("ev-grow")
        chosen.props(f'outlined dense options-dense data-testid="curves-{key}"')
        chosen.on_value_change(lambda e: self._put(self._state, key, e.value, again=key == "temperature"))

    # -------------------------------------------------------------------------------------------- what is typed

    async def _dropped(self, event: events.MultiUploadEventArguments) -> None:
        contents = [(file.name, await file.read()) for file in event.files]
        self.page.attempt(lambda: self._add([self.studio.folder.keep(name, content) for name, content in contents]))

    def _add(self, names: list[str]) -> None:
        rows = self._state["curves"]
        taken = {row["file"] for row in rows}
        rows += [{"file": name, "temperature": ""} for name in names if name not in taken]
        self.draw()

    def _drop(self, row: dict[str, str]) -> None:
        self._state["curves"] = [one for one in self._state["curves"] if one is not row]
        self.draw()

    def _put(self, place: dict[str, Any], key: str, value: Any, *, again: bool = False) -> None:
        place[key] = "" if value is None else str(value).strip()
        if again:
            self.draw()
        self._show()

    def _whole(self, typed: dict[str, Any]) -> dict[str, Any]:
        """The options with the files and columns."""
        state = self._state
        given = [row["temperature"] for row in state["curves"] if row["temperature"]]
        temperatures = [state["temperature"]] if state["temperature"] else given
        data = [row["file"] for row in state["curves"]]
        return {"data": data, "column": state["column"], "temperatures": temperatures, **typed}

    def _changed(self, content: dict[str, Any], wrong: dict[str, str]) -> None:
        self._state["options"] = {key: value for key, value in content.items() if key not in relaxation.OF_FILES}
        self._wrong = wrong
        self._show()

    def _show(self) -> None:
        """Show what is missing."""
        state = self._state
        given = [bool(row["temperature"]) for row in state["curves"]]
        hint = "" if state["curves"] else "give a file of data"
        hint = hint or ("" if state["column"] else "choose the column of the force or torque")
        if not hint and not state["temperature"] and any(given) and not all(given):
            hint = "give the temperature of each file, or of none"
        self._hint.set_text(hint or errors_text(len(self._wrong)))
        self._go.set_enabled(not hint and not self._wrong)

    # -------------------------------------------------------------------------------------------- what is done with it

    async def _submit(self) -> None:
        if self._form is not None:
            self._form.flush()
        content = self._whole(self._state["options"])
        paths: list[str] = []

        def check() -> None:
            asked = relaxation.asked(content)
            paths[:] = [str(self.studio.folder.file(name, LARGEST_RECORDING)) for name in asked.data]
            relaxation.check(asked, paths)

        self._go.props("loading")
        try:
            await asyncio.to_thread(check)
        except EvolventError as error:
            self.page.show_message(str(error))
            return
        finally:
            self._go.props(remove="loading")
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        title = pathlib.PurePosixPath(content["data"][0]).stem
        job = self.studio.jobs.add("relaxation", title, case=text, extra={"signals": paths})
        self.page.show(view_of(job), tab="runs")

    def edit(self, content: Any, about: str) -> None:
        """Put a fit into the form.

        Parameters
        ----------
        content : str, of the job as YAML
        about : str, its name
        """
        found = reading.content(content, about)
        asked = relaxation.asked(found)
        rows = [{"file": name, "temperature": ""} for name in asked.data]
        of_files = len(asked.temperatures) == len(rows) and all(map(curves.is_value, asked.temperatures))
        if of_files:
            for row, temperature in zip(rows, asked.temperatures, strict=True):
                row["temperature"] = temperature
        self._state.update(
            shown="curves", curves=rows, column=asked.column,
            temperature="" if of_files else next(iter(asked.temperatures), ""),
            options={key: value for key, value in found.items() if key not in relaxation.OF_FILES},
        )  # fmt: skip
        self._shown()
        self.page.open_tab("calibrate")
