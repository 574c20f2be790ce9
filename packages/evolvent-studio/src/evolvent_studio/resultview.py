"""What is shown of a run, or of several over one another: motion, numbers, charts."""

from __future__ import annotations

import asyncio
import urllib.parse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from nicegui import ui

from evolvent import cases
from evolvent.results import WELL, limits, variables
from evolvent.results.happened import events_of
from evolvent.view import show
from evolvent_base.errors import EvolventError
from evolvent_studio import charts, comparison, exports, exportview
from evolvent_studio.context import Context
from evolvent_studio.elements import ChartElement, MotionElement, table
from evolvent_studio.jobview import (
    STATUS,
    ask_title,
    changes_text,
    date_text,
    draw_job,
    draw_limits,
    since_text,
)
from evolvent_studio.state import Loaded

if TYPE_CHECKING:
    from evolvent_base.figures import Figure

#: Downloads that are there at once, and those that are written first: kind -> what it is called.
_FILES = {"run": "Results (NetCDF)", "case": "Case (YAML)"}
_EXPORTS = {
    "report": "Report (HTML)", "figures": "Figures and animation (ZIP)", "csv": "Tables (CSV, ZIP)",
    "mat": "MATLAB and Octave (MAT)", "vtk": "ParaView files (VTK, ZIP)", "glb": "Animated model (glTF)",
    "mp4": "Film (MP4)", "gif": "Film (GIF)",
}  # fmt: skip


class ResultView:
    """The part of the page that shows runs.

    Parameters
    ----------
    page : Context
    """

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self._asked = 0
        self._names: dict[str, list[str]] = {}  # variables that were chosen last, of each system

    def draw(self, refs: Sequence[str]) -> None:
        """Draw runs, or how far the one that is computed is."""
        self._asked += 1
        if len(refs) == 1 and refs[0].startswith("job:") and draw_job(self.page, refs[0].partition(":")[2]):
            return
        asked = self._asked
        wait = ui.label("reading the results").classes("ev-dim")

        async def load() -> None:
            try:
                loaded = [await asyncio.to_thread(self.studio.load, ref) for ref in refs]
            except EvolventError as error:
                wait.set_text(str(error))
                wait.classes(replace="ev-banner bad")
                return
            if asked != self._asked or self.page.view.refs != tuple(refs):
                return
            wait.delete()
            with self.page.main:
                if len(loaded) == 1:
                    self._one(loaded[0])
                else:
                    self._several(loaded)

        ui.timer(0.01, load, once=True)

    # -------------------------------------------------------------------------------------------- one run

    def _one(self, loaded: Loaded) -> None:
        attrs = loaded.run.attrs
        with ui.element("div").classes("ev-titlebar").props('data-testid="result"'):
            title = (show.title_of(loaded.run) if loaded.file else "") or loaded.name
            ui.label(f"Equilibrium {title}" if attrs["method"] == "static" else title).classes("ev-h1")
            if loaded.ref.startswith("job:"):
                key = loaded.ref.partition(":")[2]
                pencil = ui.button(icon="edit", on_click=lambda: ask_title(self.page, key))
                pencil.props('flat dense round size=sm color=primary data-testid="rename"').tooltip("rename this run")
            status, checked = attrs["status"], limits.of_run(loaded.run)
            met = sum(one.is_met for one in checked)
            if checked:
                draw_limits(met, len(checked))
            look = "interrupted" if status in WELL and met < len(checked) else status.split()[0]
            ui.label(STATUS.get(status, status)).classes(f"ev-status {look}")
            if loaded.file:
                ui.label(loaded.file).classes("ev-status")
            ui.label(f"{attrs['system']}, version {attrs['version']}").classes("ev-status")
            ui.element("div").style("flex:1")
            ui.button("Open its case", on_click=lambda: self._open(loaded)).props("flat dense color=primary")
            self._downloads(loaded)
        if loaded.ref.startswith("job:"):
            job = self.studio.jobs.get(loaded.ref.partition(":")[2])
            about = " · ".join(text for text in (date_text(job), since_text(job), changes_text(job)) if text)
            if about:
                ui.label(about).classes("ev-changes").props('data-testid="changes"')
        _messages(attrs)
        _warnings([("", str(attrs.get("warning") or ""))])
        with ui.element("div").classes("ev-pair"):
            still = " ev-still" if loaded.still else ""
            with ui.element("div").classes(f"ev-card{still}").props('data-testid="motion"'):
                MotionElement([loaded.ref], [loaded.name])
            with ui.element("div").classes("ev-card ev-tablebox ev-two"):
                table([(n.label, n.value) for n in loaded.numbers if n.label != "warning"])
        if not loaded.still or loaded.figures:
            with ui.element("div").classes("ev-events").props('data-testid="events"'):
                for text in charts.events_texts(_events(loaded)):
                    ui.label(text)
            self._tabs([(figure.title, [("", figure)]) for figure in loaded.figures], [loaded])

    def _open(self, loaded: Loaded) -> None:
        if loaded.ref.startswith("job:"):
            self.page.open_job_case(loaded.ref.partition(":")[2])
            return

        def take() -> None:
            content = cases.parse_yaml(loaded.run.attrs["case"], "the run's case")
            self.studio.take_case(content, f"case of {loaded.name}")
            self.page.open_case()

        self.page.attempt(take)

    def _downloads(self, loaded: Loaded) -> None:
        ref = urllib.parse.quote(loaded.ref)
        button = ui.button("Download").props('outline dense color=primary data-testid="download"')
        with button.style("padding:0 10px"), ui.menu():
            for what, label in _FILES.items():
                item = ui.menu_item(label, lambda w=what: ui.download(f"/studio/{w}?ref={ref}"))
                item.props(f'data-testid="download-{what}"')
            ui.separator()
            for what, label in _EXPORTS.items():
                if loaded.still and what in ("mp4", "gif"):
                    continue
                reason = exports.missing(what)
                item = ui.menu_item(label, lambda w=what: exportview.write(self.page, loaded.ref, w, _EXPORTS[w]))
                item.props(f'data-testid="download-{what}"')
                if reason:
                    item.disable()
                    ui.label(reason).classes("ev-what ev-missing")
            if loaded.ref.startswith("job:"):
                ui.separator()
                ui.menu_item("Save the run in the folder", lambda: self.page.save_run(loaded.ref))

    def _tabs(self, figures: Sequence[tuple[str, Sequence[tuple[str, Figure]]]], loaded: Sequence[Loaded]) -> None:
        """Charts, one tab for each figure, and last the variables that one chooses."""
        if not figures:
            several = len(loaded) > 1
            ui.label("The runs have no figure in common." if several else "The run has no figures.").classes("ev-dim")
        with (
            ui.tabs()
            .props("dense align=left no-caps indicator-color=primary outside-arrows mobile-arrows")
            .classes("ev-tabs w-full") as tabs
        ):
            for k, (title, _) in enumerate(figures):
                ui.tab(str(k), label=title).props(f'data-testid="figure-{k}"')
            if not all(item.still for item in loaded):
                ui.tab("chosen", label="Variables").props('data-testid="figure-chosen"')
        body = ui.element("div").style("width:100%").props('data-testid="charts"')

        def draw(which: str) -> None:
            body.clear()
            with body:
                if which == "chosen":
                    self._chosen(loaded)
                else:
                    _charts(figures[int(which)][1], loaded)

        tabs.on_value_change(lambda e: draw(str(e.value)))
        tabs.set_value("0" if figures else "chosen")

    def _chosen(self, loaded: Sequence[Loaded]) -> None:
        """Charts of variables that one chooses by name; those of one unit share one."""
        known = [variables.names(item.run) for item in loaded]
        names = [name for name in dict.fromkeys(name for one in known for name in one) if all(name in k for k in known)]
        system = str(loaded[0].run.attrs["system"])
        with ui.element("div").classes("ev-choose"):
            chosen = ui.select(
                names, multiple=True, with_input=True, value=[n for n in self._names.get(system, []) if n in names],
                label=f"variables over time, {len(names)} of them",
            )  # fmt: skip
            chosen.props('outlined dense options-dense use-chips clearable data-testid="variables"')
        body = ui.element("div").style("width:100%").props('data-testid="chosen"')

        def draw() -> None:
            self._names[system] = list(chosen.value or [])
            body.clear()
            with body:
                if not self._names[system]:
                    ui.label("Choose variables by name, such as a part's position or the energy.").classes("ev-dim")
                    return
                try:
                    drawn = [(item.name if len(loaded) > 1 else "", self._figure(item)) for item in loaded]
                except EvolventError as error:
                    ui.label(str(error)).classes("ev-banner bad")
                    return
                _charts(drawn, loaded)

        chosen.on_value_change(draw)
        draw()

    def _figure(self, loaded: Loaded) -> Figure:
        """The chosen variables of a run."""
        return show.figure(loaded.run, self._names[str(loaded.run.attrs["system"])])

    # -------------------------------------------------------------------------------------------- several runs

    def _several(self, loaded: Sequence[Loaded]) -> None:
        names = [item.name for item in loaded]
        with ui.element("div").classes("ev-titlebar").props('data-testid="comparison"'):
            ui.label(f"{len(loaded)} runs compared").classes("ev-h1")
        for item in loaded:
            _messages(item.run.attrs, name=item.name)
        _warnings([(item.name, str(item.run.attrs.get("warning") or "")) for item in loaded])
        same = len({item.run.attrs["system"] for item in loaded}) == 1
        with ui.element("div").classes("ev-card").props('data-testid="motion"'):
            MotionElement([item.ref for item in loaded], names)
        heads = [*names, "difference", "unit"]
        with ui.element("div").classes("ev-card ev-tablebox ev-beside"):
            ui.label(f"difference: {comparison.less(names)}").classes("ev-what")
            texts = [str(item.run.attrs["case"]) for item in loaded]
            table(comparison.differing(texts), head=["what differs", *heads])
            table(comparison.results([item.numbers for item in loaded]), head=["results", *heads])
        if not same:
            ui.label("The runs are of different systems; figures that two or more of them have are shown.").classes(
                "ev-dim"
            )
        figures = []
        for called in dict.fromkeys(figure.name for item in loaded for figure in item.figures):
            every = [next((f for f in item.figures if f.name == called), None) for item in loaded]
            beside = [(name, f) for name, f in zip(names, every, strict=True) if f is not None]
            if len(beside) > 1:
                figures.append((beside[0][1].title, beside))
        self._tabs(figures, loaded)


def _events(loaded: Loaded) -> list[tuple[float, str]]:
    """Events of a run: time, s, and what happened."""
    found = events_of(loaded.run)
    rows = zip(found.time.values, found.part.values, found.what.values, strict=True)
    return [(float(time), f"{part} {what}".strip()) for time, part, what in rows]


def _charts(figures: Sequence[tuple[str, Figure]], loaded: Sequence[Loaded]) -> None:
    """Charts of one figure, of several runs over one another; events are marked on those of one run."""
    drawn = charts.compared(figures)
    if len(loaded) == 1:
        drawn = [charts.marked(chart, _events(loaded[0])) for chart in drawn]
    with ui.element("div").classes("ev-charts" + (" one" if len(drawn) == 1 else "")):
        for chart in drawn:
            with ui.element("div").classes("ev-card"):
                element = ChartElement(chart)
                if chart.equal or len(drawn) == 1:
                    element.classes("tall")


def _messages(attrs: Any, *, name: str = "") -> None:
    """Why a run did not end as it should."""
    before = f"{name}: " if name else ""
    if attrs["status"] == "failed":
        text = f"{before}This run failed; the results are those before the failure. {attrs['message']}"
        ui.label(text).classes("ev-banner bad").props('data-testid="failed"')
    elif attrs["status"] == "interrupted":
        ui.label(f"{before}{attrs['message']}").classes("ev-banner warn").props('data-testid="interrupted"')


def _warnings(given: Sequence[tuple[str, str]]) -> None:
    """Warnings of runs in one place, the same ones once.

    Parameters
    ----------
    given : (name of the run, or '' of the only one; its warning, '' for none)
    """
    runs: dict[str, list[str]] = {}
    for name, text in given:
        if text:
            runs.setdefault(text, []).append(name)
    if not runs:
        return
    with ui.element("div").classes("ev-banner warn").props('data-testid="warning"'):
        ui.label("Warning" if len(runs) == 1 else f"{len(runs)} warnings").classes("ev-title")
        for text, names in runs.items():
            of = "all runs" if 1 < len(given) == len(names) else ", ".join(names)
            ui.label(f"{of}: {text}" if of else text)
