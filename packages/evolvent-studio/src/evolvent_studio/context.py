"""What the page offers to its panels; it stands below them, so that no panel imports the page."""

from __future__ import annotations

import abc
import pathlib
from collections.abc import Callable
from typing import Any, ClassVar

from nicegui import ui

from evolvent_base.errors import EvolventError, reason_of
from evolvent_studio.drafts import View
from evolvent_studio.state import Studio


class Context(abc.ABC):
    """One page in one browser, as its panels know it.

    Attributes
    ----------
    studio : Studio
    view : View, what is shown beside the panels
    main : ui.element, the area beside the panels
    dialogs : ui.element, the parent of dialogs; it stays while the area beside the panels is drawn again
    """

    studio: Studio
    view: View
    main: ui.element
    dialogs: ui.element

    @abc.abstractmethod
    def show(self, view: View, *, tab: str = "") -> None:
        """Show something beside the panels."""

    @abc.abstractmethod
    def draw(self) -> None:
        """Draw the area beside the panels again."""

    @abc.abstractmethod
    def update(self) -> None:
        """Read the state of the queue now."""

    @abc.abstractmethod
    def case_drawn(self) -> None:
        """The panel of the case shows another case."""

    @abc.abstractmethod
    def open_case(self) -> None:
        """Show the case of the studio's draft in its panel."""

    @abc.abstractmethod
    def open_job_case(self, key: str) -> None:
        """Put the case of a job into the form."""

    @abc.abstractmethod
    def open_tab(self, tab: str) -> None:
        """Show a panel by its name."""

    @abc.abstractmethod
    def save_run(self, ref: str) -> None:
        """Copy a run into the working folder under a name that is asked for."""

    def attempt(self, action: Callable[[], Any]) -> bool:
        """Do something and show its error on the page. Returns whether it succeeded."""
        try:
            action()
        except EvolventError as error:
            self.show_message(str(error))
            return False
        except OSError as error:  # a full disk, a folder that may not be written to
            name = f" {pathlib.Path(error.filename).name!r}" if isinstance(error.filename, str) else ""
            self.show_message(f"the file{name} cannot be read or written: {reason_of(error)}")
            return False
        return True

    def show_message(self, text: str) -> None:
        """Show what went wrong."""
        word = text.partition(" ")[0]
        if word.isalpha():  # else it is a key, or the name of a file
            text = text[:1].upper() + text[1:]
        with self.main:
            ui.notify(text, type="negative", position="bottom", multi_line=True, timeout=8000,
                      close_button="Close", classes="ev-notify")  # fmt: skip

    def ask(
        self, title: str, name: str, take: Callable[[str], Any], *, word: str, marks: tuple[str, str], note: str = "",
        most: int = 0,
    ) -> None:  # fmt: skip
        """Ask for a name; the dialog stays open until `take` takes what is typed.

        Parameters
        ----------
        title, note : str, what is asked
        name : str, what stands in the field at first
        word : str, of the button
        marks : (str, str), names of field and button in tests of the page
        most : int, characters that can be typed, 0 for any number
        """
        with self.dialogs, ui.dialog(value=True) as dialog, ui.card().style("min-width:min(360px,90vw)"):
            ui.label(title).classes("ev-title")
            if note:
                ui.label(note).classes("ev-what")
            typed = ui.input("name", value=name).props(f'outlined dense autofocus data-testid="{marks[0]}"')
            typed.classes("w-full").props(f"maxlength={most}" if most else "")

            def done() -> None:
                if self.attempt(lambda: take(typed.value or "")):
                    dialog.close()

            typed.on("keydown.enter", done)
            with ui.row():
                ui.button(word, on_click=done).props(f'unelevated color=primary data-testid="{marks[1]}"')
                ui.button("Cancel", on_click=dialog.close).props("flat")

    def ask_name(self, title: str, name: str, keep: Callable[[str], str]) -> None:
        """Ask for the name of a file, and write it; `keep` does so, and returns the name that it has then."""

        def take(typed: str) -> None:
            ui.notify(f"Saved as {keep(typed)}", type="positive", position="bottom")

        self.ask(title, name, take, word="Save", marks=("file-name", "file-save"))

    def show_text(self, title: str, text: str, name: str) -> None:
        """Show a YAML text, which can be downloaded as a file of that name."""
        with self.dialogs, ui.dialog(value=True) as dialog, ui.card().style("width:900px;max-width:94vw"):
            ui.label(title).classes("ev-title")
            ui.code(text, language="yaml").classes("ev-code w-full")
            with ui.row():
                ui.button("Download", on_click=lambda: ui.download.content(text, name)).props("flat no-caps")
                ui.button("Close", on_click=dialog.close).props("flat no-caps")


class Panel(abc.ABC):
    """A panel of another package, and what is shown beside it.

    Attributes
    ----------
    label : str, of its tab
    about : str, what it is for, a sentence
    """

    label: ClassVar[str]
    about: ClassVar[str]

    @abc.abstractmethod
    def __init__(self, page: Context) -> None: ...

    @abc.abstractmethod
    def draw(self) -> None:
        """Show what is there now."""

    @abc.abstractmethod
    def draw_main(self) -> None:
        """Draw the area beside the panel."""
