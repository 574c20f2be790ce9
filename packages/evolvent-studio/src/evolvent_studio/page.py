"""The page: panels on the left for what goes in, and beside them what comes out."""

from __future__ import annotations

import pathlib

from nicegui import app, ui

from evolvent_studio import added
from evolvent_studio.calibratepanel import CalibratePanel
from evolvent_studio.casepanel import CasePanel
from evolvent_studio.context import Context, Panel
from evolvent_studio.drafts import View, view_of
from evolvent_studio.modesview import ModesView
from evolvent_studio.reportview import ReportView
from evolvent_studio.resultview import ResultView
from evolvent_studio.runspanel import RunsPanel
from evolvent_studio.state import FIRST, Studio
from evolvent_studio.studyform import DISPERSIONS
from evolvent_studio.studypanel import StudyPanel

#: Seconds between looks at the queue.
_LOOK = 0.3
_TABS = {
    "case": "Case",
    "runs": "Runs",
    "studies": "Studies",
    "disperse": "Dispersion",
    "calibrate": "Calibration",
}
#: A press on a button of a form leaves the focus in the field: else the field's help would vanish at once, the button
#: move away from the pointer, and the click be lost.
_STEADY = """addEventListener("mousedown", (event) => {
  const inside = event.target.closest?.(".ev-scroll, .ev-add");
  const button = event.target.closest?.("button, .q-item, .q-checkbox");
  if (inside && button && !event.target.closest("input, textarea, .q-field")) event.preventDefault();
});"""


class Page(Context):
    """One page in one browser.

    Parameters
    ----------
    studio : Studio
    """

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.view = studio.view
        self._seen, self._looked, self._drawn = -1, False, False
        self._states: dict[str, tuple[str, str]] = {}  # of jobs: status and name
        self._before_start = View()
        self._top()
        with ui.element("div").classes("ev-shell ev-beside-shown").props('data-testid="shell"') as self.shell:
            with ui.element("div").classes("ev-side"):
                self._side()
            self.main = ui.element("div").classes("ev-main").props('data-testid="main"')
        self.dialogs = ui.element("div")  # they stay while what is shown changes
        self.result = ResultView(self)
        self.modes = ModesView(self)
        self.report = ReportView(
            self,
            {
                "disperse": self.dispersions.edit,
                "calibrate": self.calibrations.edit,
                "relaxation": self.calibrations.curves.edit,
            },
        )
        ui.run_javascript(_STEADY)
        ui.timer(_LOOK, self.update)
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
                if self.view.kind in ("report", *self.added):  # whose pages have colours of their own
                    self.draw()

            turn.on_value_change(lambda e: choose(e.value))

    def _side(self) -> None:
        studio = self.studio
        with ui.tabs().props("dense align=justify no-caps indicator-color=primary").classes("w-full") as tabs:
            labels = _TABS | {name: panel.label for name, panel in added.panels().items()}
            for name, label in labels.items():
                ui.tab(name, label=label).props(f'data-testid="tab-{name}"').on("click", lambda: self._turn_to("panel"))
        self.tabs = tabs
        with ui.tab_panels(tabs, value=studio.tab, animated=False, keep_alive=True).classes("w-full"):
            with ui.tab_panel("case"):
                self.case = CasePanel(self)
            with ui.tab_panel("runs"):
                self.runs = RunsPanel(self)
            with ui.tab_panel("studies"):
                self.studies = StudyPanel(self)
            with ui.tab_panel("disperse"):
                self.dispersions = StudyPanel(self, DISPERSIONS)
            with ui.tab_panel("calibrate"):
                self.calibrations = CalibratePanel(self)
            self.added: dict[str, Panel] = {}
            for name, panel in added.panels().items():
                with ui.tab_panel(name):
                    self.added[name] = panel(self)
        tabs.on_value_change(lambda e: self._turn(str(e.value)))

    def _turn_to(self, place: str) -> None:
        """On a narrow screen, show the panel or what is beside it; a wide one has room for both."""
        self.shell.classes(
            add="ev-beside-shown" if place == "main" else "", remove="" if place == "main" else "ev-beside-shown"
        )

    def _turn(self, tab: str) -> None:
        """Another panel is shown; what it lists of the folder is listed again."""
        self.case.flush()  # another panel may take the case
        self.studio.tab = tab
        if tab == "case":
            self.case_drawn()
        elif self.view.kind == "start" and self._before_start.kind:
            self._show(self._before_start)
        lists = {
            "case": self.case.list, "runs": self.runs.list, "disperse": self.dispersions.list,
            "calibrate": self.calibrations.list, **{name: panel.draw for name, panel in self.added.items()},
        }  # fmt: skip
        lists.get(tab, self.studies.list)()

    # -------------------------------------------------------------------------------------------- of the context

    def show(self, view: View, *, tab: str = "") -> None:
        """Show something beside the panels."""
        self._turn_to("main")
        self._show(view, tab=tab)

    def _show(self, view: View, *, tab: str = "") -> None:
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
            self._show(View("start"))
        elif not self.case.has_parts and self.view.kind == "start":
            self._show(self._before_start)
        elif self.view.kind == "start":
            self.draw()

    def draw(self) -> None:
        """Draw what is beside the panels again."""
        self.main.clear()
        with self.main:
            match self.view.kind:
                case "start" if self.case.has_parts:
                    self.case.start.draw()
                case "run":
                    self.result.draw(self.view.refs)
                case "modes":
                    self.modes.draw(self.view.refs[0])
                case "report":
                    self.report.draw(self.view.refs[0])
                case kind if kind in self.added:
                    self.added[kind].draw_main()
                case "study":
                    self._panel_of(self.view.refs[0]).view.draw(self.view.refs[0])
                case _:
                    self._welcome()

    def _panel_of(self, ref: str) -> StudyPanel:
        """The panel that writes a study: of a dispersion another than of the others."""
        kind, _, name = ref.partition(":")
        job = self.studio.jobs.jobs.get(name) if kind == "job" else None
        dispersed = job.kind == "disperse" if job is not None else name in self.studio.folder.studies(dispersed=True)
        return self.dispersions if dispersed else self.studies

    def _welcome(self) -> None:
        with ui.element("div").classes("ev-empty"):
            ui.label("Nothing to show yet").classes("ev-h1")
            ui.label("Run an example, or choose a case, change its values and run it.")
            ui.button("Run the example", on_click=self._example).props(
                'unelevated color=primary data-testid="example"'
            ).style("margin:10px 0 14px")
            ui.label(
                "Case: the values of a case, and of a structure its parts. "
                "Runs: the queue, and runs saved in the folder; tick two or more to compare them. "
                "Studies: many cases over keys that vary. Dispersion: keys drawn from distributions. "
                "Calibration: keys fitted to measured data, and laws to relaxation curves."
                + "".join(f" {panel.label}: {panel.about}." for panel in self.added.values())
            ).classes("ev-what")

    def _example(self) -> None:
        """Run the first built-in case, and show it."""

        def add() -> None:
            draft = self.studio.read_case(FIRST)
            key = self.studio.submit(draft)
            self.show(view_of(self.studio.jobs.get(key)), tab="runs")

        self.attempt(add)

    def open_case(self) -> None:
        """Show the case of the draft in its panel."""
        self.case.draw()
        self.open_tab("case")

    def open_job_case(self, key: str) -> None:
        """Put the case of a job into the form."""
        self.runs.open_case(key)

    def open_tab(self, tab: str) -> None:
        """Show a panel by its name."""
        self._turn_to("panel")
        self.tabs.set_value(tab)

    def save_run(self, ref: str) -> None:
        """Copy a run into the working folder under a name that is asked for."""
        self.runs.save_run(ref)

    def update(self) -> None:
        """Follow the queue, and keep what the tab shows."""
        self.case.start.follow()
        self.studio.save()
        jobs = self.studio.jobs
        if jobs.version == self._seen:
            return
        self._seen = jobs.version
        states = {job.key: (job.status, job.title) for job in jobs.listed()}
        changed = states != self._states
        turned = [key for key, state in states.items() if state != self._states.get(key)] if self._looked else []
        self._states, self._looked = states, True
        self.runs.follow(changed)
        if any(f"job:{key}" in self.view.refs for key in turned):
            self.draw()


def install(studio: Studio) -> None:
    """Make the page known to the server."""
    style = pathlib.Path(__file__).with_name("static").joinpath("style.css").read_text(encoding="utf-8")

    app.on_shutdown(studio.exports.stop)

    @ui.page("/")
    async def studio_page() -> None:
        ui.add_css(style)
        ui.colors(primary="#0b63a5")
        client = ui.context.client
        await client.connected()  # only then the tab of the browser has a name
        if client.tab_id is not None:
            page = Page(studio.of_tab(client.tab_id))
            client.on_disconnect(page.studio.save)
