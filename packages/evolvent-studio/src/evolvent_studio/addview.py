"""The dialog that adds a part: kinds in groups, then a name; or the values of several parts that are added at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from nicegui import ui

from evolvent.parts.registry import kinds
from evolvent_base.errors import InputError
from evolvent_studio import form, kindgroups
from evolvent_studio.assemblies import HingedPanel
from evolvent_studio.context import Context
from evolvent_studio.formview import FormView, first_error

#: The entry that adds a panel with its hinge, and the name that its panel gets.
PANEL, PANEL_NAME = "panel on a hinge", "panel"
#: Heading of what adds several parts.
_SEVERAL = "several parts at once"


class AddView:
    """The dialog.

    Parameters
    ----------
    page : Context
    propose : returns a name for a part of a kind
    add : adds parts, name -> keys and values
    words : returns what a field may be that refers to other parts
    """

    def __init__(
        self,
        page: Context,
        propose: Callable[[str], str],
        add: Callable[[Mapping[str, Mapping[str, Any]]], None],
        words: Callable[[], Sequence[str]],
    ) -> None:
        self.page, self._propose, self._add, self._words = page, propose, add, words
        self._rows: dict[str, tuple[ui.element, str]] = {}
        self._heads: list[tuple[ui.element, list[str]]] = []
        with page.dialogs, ui.dialog(value=True) as self._dialog:
            self._card = ui.card().classes("ev-add")
        self._list()

    # -------------------------------------------------------------------------------------------- kinds

    def _list(self) -> None:
        """Draw the kinds in groups, and what finds one by what is typed."""
        self._card.clear()
        self._rows, self._heads = {}, []
        with self._card:
            ui.label("Add a part").classes("ev-title")
            typed = ui.input(placeholder="find by name or words").props("outlined dense autofocus clearable")
            typed.props('data-testid="part-kind" aria-label="find a kind of part"').classes("w-full")
            with ui.element("div").classes("ev-kinds"):
                self._group(_SEVERAL, {PANEL: form.describe(HingedPanel).help})
                for group, names in kindgroups.grouped():
                    self._group(group, {name: form.describe(kinds()[name], flat=True).help for name in names})
            ui.button("Cancel", on_click=self._dialog.close).props("flat")
        typed.on_value_change(lambda e: self._find(str(e.value or "")))
        typed.on("keydown.enter", self._first)

    def _group(self, group: str, texts: Mapping[str, str]) -> None:
        head = ui.label(group).classes("ev-h")
        self._heads.append((head, list(texts)))
        for name, text in texts.items():
            with ui.element("button").classes("ev-kind").props("type=button") as row:
                row.props["data-testid"] = f"kind-{name}"
                ui.label(name).classes("ev-title")
                ui.label(text).classes("ev-what")
            row.on("click", lambda n=name: self._choose(n))
            self._rows[name] = row, f"{group} {name} {text}".lower()

    def _find(self, typed: str) -> None:
        wanted = typed.lower().split()
        for row, text in self._rows.values():
            row.set_visibility(all(word in text for word in wanted))
        for head, names in self._heads:
            head.set_visibility(any(self._rows[name][0].visible for name in names))

    def _first(self) -> None:
        """Choose the first kind that is shown."""
        name = next((name for name, (row, _) in self._rows.items() if row.visible), None)
        if name is not None:
            self._choose(name)

    # -------------------------------------------------------------------------------------------- one of them

    def _choose(self, name: str) -> None:
        self._card.clear()
        with self._card:
            ui.label(f"Add a {name}" if name[0] not in "aeiou" else f"Add an {name}").classes("ev-title")
            add = self._draw_panel() if name == PANEL else self._draw_name(name)
            with ui.row():
                ui.button("Add", on_click=lambda: self._done(add)).props(
                    'unelevated color=primary data-testid="part-done"'
                )
                ui.button("Back", on_click=self._list).props("flat")
                ui.button("Cancel", on_click=self._dialog.close).props("flat")

    def _done(self, add: Callable[[], None]) -> None:
        if self.page.attempt(add):
            self._dialog.close()

    def _draw_name(self, kind: str) -> Callable[[], None]:
        ui.label(form.describe(kinds()[kind], flat=True).help).classes("ev-what")
        typed = ui.input("name", value=self._propose(kind)).props('outlined dense autofocus data-testid="part-name"')
        typed.classes("w-full")

        def add() -> None:
            self._add({typed.value or "": {"kind": kind}})

        typed.on("keydown.enter", lambda: self._done(add))
        return add

    def _draw_panel(self) -> Callable[[], None]:
        ui.label(form.describe(HingedPanel).help).classes("ev-what")
        held: dict[str, Any] = {}

        def take(content: dict[str, Any], wrong: dict[str, str]) -> None:
            held.update(content=content, wrong=wrong)

        bodies = [word for word in self._words() if "." not in word]
        first = {"body": bodies[0]} if bodies else {}
        view = FormView(HingedPanel, first, take, before=f"{PANEL_NAME}.", flat=True, folds=False, words=lambda: bodies)

        def add() -> None:
            view.flush()
            if held["wrong"]:
                view.show_all()
                raise InputError(first_error(held["wrong"]))
            self._add(HingedPanel.model_validate(held["content"]).parts(self._propose(PANEL_NAME)))

        return add
