"""The page: panels on the left for what goes in, and beside them what comes out."""

from __future__ import annotations

import pathlib
from collections.abc import Callable
from typing import Any

from nicegui import ui

from evolvent.errors import EvolventError
from evolvent.studio.casepanel import CasePanel
from evolvent.studio.measureview import MeasurePanel
from evolvent.studio.modesview import ModesView
from evolvent.studio.resultview import ResultView
from evolvent.studio.runspanel import RunsPanel
from evolvent.studio.startview import StartView
from evolvent.studio.state import Studio, View
from evolvent.studio.studyview import StudyPanel

#: Seconds between looks at the queue.
_LOOK = 0.3
_TABS = {"case": "Case", "runs": "Runs", "measure": "Measure", "studies": "Studies"}


class Page:
    """One page in one browser.

    Parameters
    ----------
    studio : Studio
    """

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.view = studio.view
        self._seen, self._looked, self._drawn = -1, False, False
        self._states: dict[str, str] = {}
        self._before_start = View()
        self.start = StartView(self)
        self._top()
        with ui.element("div").classes("ev-shell"):
            with ui.element("div").classes("ev-side"):
                self._side()
            self.main = ui.element("div").classes("ev-main").props('data-testid="main"')
        self.dialogs = ui.element("div")  # they stay while what is shown changes
        self.result = ResultView(self)
        self.modes = ModesView(self)
        ui.timer(_LOOK, self.look)
        ui.timer(0.01, self._first, once=True)

    def _first(self) -> None:
        """Draw what is beside the panels when the page has come."""
        self._drawn = True
        self.draw()
        self.case_drawn()

    def _top(self) -> None:
        dark = ui.dark_mode(self.studio.dark)
        with ui.element("div").classes("ev-top"):
            ui.label("evolvent studio").classes("ev-name")
            ui.label(str(self.studio.folder.root)).classes("ev-path").tooltip("working folder; nothing else is opened")
            ui.element("div").style("flex:1")
            turn = ui.toggle({None: "auto", False: "light", True: "dark"}, value=self.studio.dark)
            turn.props('dense flat size=12px no-caps toggle-color=primary data-testid="theme"')

            def choose(value: bool | None) -> None:
                self.studio.dark = value
                dark.set_value(value)

            turn.on_value_change(lambda e: choose(e.value))

    def _side(self) -> None:
        studio = self.studio
        with ui.tabs().props("dense align=justify no-caps indicator-color=primary").classes("w-full") as tabs:
            for name, label in _TABS.items():
                ui.tab(name, label=label).props(f'data-testid="tab-{name}"')
        self.tabs = tabs
        with ui.tab_panels(tabs, value=studio.tab, animated=False, keep_alive=True).classes("w-full"):
            with ui.tab_panel("case"):
                self.case = CasePanel(self)
            with ui.tab_panel("runs"):
                self.runs = RunsPanel(self)
            with ui.tab_panel("measure"):
                self.measure = MeasurePanel(self)
            with ui.tab_panel("studies"):
                self.studies = StudyPanel(self)
        tabs.on_value_change(lambda e: self._turn(str(e.value)))

    def _turn(self, tab: str) -> None:
        """Another panel is looked at; what it lists of the folder is listed anew."""
        self.studio.tab = tab
        if tab == "case":
            self.case_drawn()
        elif self.view.kind == "start" and self._before_start.kind:
            self.show(self._before_start)
        lists = {"case": self.case.list, "runs": self.runs.list, "measure": self.measure.draw}
        lists.get(tab, self.studies.list)()

    # -------------------------------------------------------------------------------------------- what panels call

    def show(self, view: View, *, tab: str = "") -> None:
        """Show something beside the panels."""
        self.view = self.studio.view = view
        if tab:
            self.tabs.set_value(tab)
        self.draw()
        self.runs.draw()

    def case_drawn(self) -> None:
        """The panel shows a case: of one of parts, show the start beside it."""
        if not self._drawn or self.studio.tab != "case":
            return
        if self.case.has_parts and self.view.kind != "start":
            self._before_start = self.view
            self.show(View("start"))
        elif not self.case.has_parts and self.view.kind == "start":
            self.show(self._before_start)
        elif self.view.kind == "start":
            self.draw()

    def draw(self) -> None:
        """Draw what is beside the panels anew."""
        self.main.clear()
        with self.main:
            match self.view.kind:
                case "start" if self.case.has_parts:
                    self.start.draw()
                case "run":
                    self.result.draw(self.view.refs)
                case "modes":
                    self.modes.draw(self.view.refs[0])
                case "measure":
                    self.measure.draw_main()
                case "study":
                    self.studies.draw_main(self.view.refs[0])
                case _:
                    _welcome()

    def open_case(self) -> None:
        """Show the case of the draft in its panel."""
        self.case.draw()
        self.tabs.set_value("case")

    def attempt(self, action: Callable[[], Any]) -> bool:
        """Do something; what is wrong with it is told on the page. Returns whether all went well."""
        try:
            action()
        except EvolventError as error:
            self.tell(str(error))
            return False
        except OSError as error:  # a full disk, a folder that may not be written to
            name = f" {pathlib.Path(error.filename).name!r}" if isinstance(error.filename, str) else ""
            self.tell(f"the file{name} cannot be read or written: {(error.strerror or str(error)).lower()}")
            return False
        return True

    def tell(self, text: str) -> None:
        """Tell what went wrong."""
        word = text.partition(" ")[0]
        if word.isalpha():  # else it is a key, or the name of a file
            text = text[:1].upper() + text[1:]
        with self.main:
            ui.notify(text, type="negative", position="bottom", multi_line=True, timeout=8000,
                      close_button="Close", classes="ev-notify")  # fmt: skip

    def look(self) -> None:
        """Follow the queue."""
        self.start.follow()
        jobs = self.studio.jobs
        if jobs.version == self._seen:
            return
        self._seen = jobs.version
        states = {job.key: job.status for job in jobs.listed()}
        changed = states != self._states
        turned = [key for key, status in states.items() if status != self._states.get(key)] if self._looked else []
        self._states, self._looked = states, True
        self.runs.follow(changed)
        if self.view.kind in ("run", "modes", "study", "measure"):
            if any(f"job:{key}" in self.view.refs for key in turned):
                self.draw()
            else:
                self.result.follow()


def _welcome() -> None:
    with ui.element("div").classes("ev-empty"):
        ui.label("Nothing to show yet").classes("ev-h1")
        ui.label(
            "Choose a case on the left, change what you like, and run it: its motion, charts and numbers stand here. "
            "Of a structure, parts are added, renamed and removed on the left, and its start is drawn here. "
            "Runs holds the queue and the runs saved in the folder; tick two or more to compare them. "
            "Measure finds the mass properties of a body from recorded signals. "
            "Studies shows what a sweep found, and opens any of its cases."
        )


def install(studio: Studio) -> None:
    """Make the page known to the server."""
    style = pathlib.Path(__file__).with_name("static").joinpath("style.css").read_text(encoding="utf-8")

    @ui.page("/")
    def studio_page() -> None:
        ui.add_css(style)
        ui.colors(primary="#0b63a5")
        Page(studio)
