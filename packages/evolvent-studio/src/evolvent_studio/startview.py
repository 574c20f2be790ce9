"""The start of the case that is being written, drawn beside its form, as its parts would be assembled."""

from __future__ import annotations

import asyncio
import copy
from typing import Any, Protocol

from nicegui import ui

from evolvent_base.errors import EvolventError
from evolvent_studio.context import Context
from evolvent_studio.drafts import Draft
from evolvent_studio.elements import MotionElement

#: Seconds after the last change before the start is assembled.
_PAUSE = 0.05


class Written(Protocol):
    """The case that is being written."""

    draft: Draft

    def wrong(self) -> dict[str, str]:
        """What is wrong with it: dotted key -> sentence."""

    def shown_wrong(self) -> dict[str, str]:
        """What of it is shown as an error."""

    def submit(self) -> None:
        """Run it."""

    def note(self, sentence: str) -> None:
        """Show what the assembly of the parts found beside the key that it names; '' for nothing."""


class StartView:
    """The part of the page that shows the start.

    Parameters
    ----------
    page : Context
    case : Written
    """

    def __init__(self, page: Context, case: Written) -> None:
        self.page, self.studio, self.case = page, page.studio, case
        self._asked = 0
        self._lock = asyncio.Lock()
        self._timer: ui.timer | None = None
        self._body: ui.element | None = None
        self._doing, self._drawn = "", False

    def draw(self) -> None:
        """Draw the start of the page's case."""
        with ui.element("div").classes("ev-titlebar"):
            ui.label("Start").classes("ev-h1")
            self._about = ui.label("").classes("ev-status")
            ui.element("div").style("flex:1")
            self._note = ui.label("").classes("ev-status").props('data-testid="start-note"')
            run = ui.button("Run", on_click=self.case.submit).classes("ev-narrow")
            run.props('unelevated dense color=primary data-testid="run-start"').style("padding:0 14px")
        self._error = ui.label("").classes("ev-banner bad").props('data-testid="start-error" role=alert')
        self._error.set_visibility(False)
        with ui.element("div").classes("ev-card ev-start").props('data-testid="start"') as self._body:
            self._motion = MotionElement([], [])
            ui.label("the last complete state").classes("ev-old")
        self._drawn = False
        self.schedule(0.01)

    def schedule(self, pause: float = _PAUSE) -> None:
        """The case has changed: assemble it after a pause, where the start is shown."""
        if self.page.view.kind != "start" or self._body is None or self._body.is_deleted:
            return
        self._asked += 1
        if self._timer is not None:
            self._timer.cancel()
        with self._body:
            self._timer = ui.timer(pause, self._assemble, once=True)

    def follow(self) -> None:
        """Show what is being done, where it takes long."""
        if self.page.view.kind == "start" and self._body is not None and not self._body.is_deleted:
            self._note.set_text(self._doing)

    async def _assemble(self) -> None:
        asked, case = self._asked, self.case
        async with self._lock:  # one at a time; of those that wait, the last one
            if asked != self._asked:
                return
            wrong = case.wrong()
            if wrong:
                shown = case.shown_wrong()
                self._show_reason(_first(shown) if shown else f"Not drawn yet. {_first(wrong)}", missing=not shown)
                return
            content = copy.deepcopy(case.draft.content)
            self._doing = "assembling"
            try:
                name = await asyncio.to_thread(self.studio.start, content, self._say)
            except EvolventError as error:
                if asked == self._asked:
                    self._show_reason(str(error))
                    case.note(str(error))
                return
            finally:
                self._doing = ""
        if asked != self._asked or self._body is None or self._body.is_deleted:
            return
        self._show_reason("")
        case.note("")
        self._drawn = True
        self._about.set_text(_counted(content))
        self._motion.show_start(name)

    def _say(self, text: str) -> None:
        self._doing = text

    def _show_reason(self, sentence: str, *, missing: bool = False) -> None:
        """Show why the start cannot be drawn; '' takes it away.

        Parameters
        ----------
        missing : bool, whether values are not given yet, which is no error
        """
        if self._body is None or self._body.is_deleted:
            return
        self._error.classes(add="note" if missing else "bad", remove="bad" if missing else "note")
        self._error.set_text(sentence)
        self._error.set_visibility(bool(sentence))
        if sentence and self._drawn:  # the last picture stays, and says that it is not of what is written now
            self._body.classes(add="ev-stale")
        else:
            self._body.classes(remove="ev-stale")
            self._body.set_visibility(not sentence)


def _first(wrong: dict[str, str]) -> str:
    """What is wrong with a form, in one sentence."""
    key, sentence = next(iter(wrong.items()))
    text = f"{key}: {sentence}" if key and key not in sentence else sentence
    return text if len(wrong) == 1 else f"{text} ({len(wrong) - 1} more)"


def _counted(content: dict[str, Any]) -> str:
    count = len(content.get("parts") or ())
    title = str(content.get("title") or "")
    words = "1 part" if count == 1 else f"{count} parts"
    return f"{title}, {words}" if title else words
