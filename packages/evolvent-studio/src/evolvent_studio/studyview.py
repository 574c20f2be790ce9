"""What came of a study: maps, lines, bars and points of one result at a time; a click on one opens its case."""

from __future__ import annotations

import asyncio
import base64
import json
import pathlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

from evolvent import cases
from evolvent.design import studies
from evolvent.design.studies import draw
from evolvent_base import answer as an, plots
from evolvent_base.errors import EvolventError
from evolvent_studio import studycharts, studytable
from evolvent_studio.charts import Chart
from evolvent_studio.context import Context
from evolvent_studio.drafts import View
from evolvent_studio.elements import ChartElement
from evolvent_studio.jobview import draw_job
from evolvent_studio.state import plain

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.design.studies import Study

#: Failed cases that are listed, at most.
_LISTED = 200


class StudyView:
    """The part of the page that shows a study's results.

    Parameters
    ----------
    page : Context
    edit : called with a study's content and where it is from, puts it into the form
    """

    def __init__(self, page: Context, edit: Callable[[Any, str], None]) -> None:
        self.page, self.studio, self._edit = page, page.studio, edit

    def draw(self, ref: str) -> None:
        """Draw a study: how far it is, or what came of it."""
        kind, _, name = ref.partition(":")
        if kind == "job" and draw_job(self.page, name):
            if name in self.studio.jobs.jobs and not self.studio.jobs.get(name).open:
                self._change(name)
            return
        wait = ui.label("reading the study").classes("ev-dim")

        async def load() -> None:
            try:
                found, study = await asyncio.to_thread(_opened, self.studio.path(ref))
            except EvolventError as error:
                wait.set_text(str(error))
                wait.classes(replace="ev-banner bad")
                return
            if self.page.view.refs != (ref,):
                return
            wait.delete()
            with self.page.main:
                _Results(self.page, found, study, self._edit, ref)

        ui.timer(0.01, load, once=True)

    def _change(self, key: str) -> None:
        """The button that puts the study of a job without results into the form."""

        def take() -> None:
            text = self.studio.jobs.case_text(key)
            self._edit(text, f"study {self.studio.jobs.get(key).title}")

        button = ui.button("Edit the study", on_click=lambda: self.page.attempt(take))
        button.props('outline color=primary data-testid="edit-study"').style("align-self:flex-start")


def _opened(path: pathlib.Path) -> tuple[xr.Dataset, Study]:
    """The results of a study, and the study; both take a moment."""
    found = studies.open(path)
    return found, studies.read(cases.parse_yaml(found.attrs["study"], "the study"))


def _pictures(study: xr.Dataset) -> dict[str, bytes]:
    """What the system of a study draws of it, as PNG."""
    return {name: plots.content(figure, "png") for name, figure in draw.of_system(study).items()}


class _Results:
    """What came of a study: one result at a time."""

    def __init__(
        self, page: Context, study: xr.Dataset, asked: Study, edit: Callable[[Any, str], None], ref: str
    ) -> None:
        written = cases.parse_yaml(study.attrs["study"], "the study")
        self.units = studytable.Units(written.get("over"), {axis.key: axis.unit for axis in asked.axes})
        self.page, self.whole, self.asked = page, study, asked
        self.study = study = self.units.shown(study)
        self.grid = study.attrs["sample"] == "grid"
        keys = [key for key in json.loads(study.attrs["keys"]) if key in study.coords]
        self.keys = [key for key in keys if study[key].size > 1] or keys[:1]
        self.cases = list(keys) if self.grid else ["case"]
        self.reasons = study.reason.where(study.status == "failed", "").transpose(*self.cases)
        self.outputs = studycharts.outputs(study, self.cases)
        self.places: dict[str, int] = {}
        with ui.element("div").classes("ev-titlebar").props('data-testid="study-result"'):
            ui.label(study.attrs["title"].removeprefix("evolvent ")).classes("ev-h1")
            ui.label(f"{study.status.size} cases of {study.attrs['system']}").classes("ev-status")
            ui.element("div").style("flex:1")
            table = ui.button("Table (CSV)", on_click=lambda: self._table(keys))
            table.props('flat dense color=primary data-testid="study-table"')
            change = ui.button("Edit the study", on_click=lambda: edit(asked.text, f"study {asked.name}"))
            change.props('flat dense color=primary data-testid="edit-study"')
            if page.studio.has_report(ref):
                ui.button("Show the report", on_click=lambda: page.show(View("report", (ref,)))).props(
                    'flat dense color=primary data-testid="show-report"'
                )
        count = int((study.status == "failed").sum())
        if count:
            failed = f"{count} of {study.status.size} cases failed; they are marked with a cross and listed below"
            ui.label(failed).classes("ev-banner warn").props('data-testid="study-failed"')
        if self.outputs:
            self._draw_outputs()
        else:
            ui.label("The study has no results of its cases that can be drawn.").classes("ev-dim")
        if count:
            self._list_failed(count)
        if self.outputs:
            ui.timer(0.01, self._draw_figures, once=True)

    def _draw_outputs(self) -> None:
        """The list of results, and the chart of the one that is chosen."""
        first = studycharts.most_informative(self.study, self.outputs, self.cases)
        with ui.element("div").classes("ev-row").style("flex-wrap:wrap;gap:10px"):
            titles = {name: studycharts.title(self.study[name]) for name in self.outputs}
            self.chosen = ui.select(titles, value=first, label="result")
            self.chosen.props('outlined dense options-dense data-testid="output"').classes("ev-output")
            self.chosen.on_value_change(lambda e: self._choose())
            self.rest = ui.element("div").classes("ev-row").style("width:auto;flex-wrap:wrap")
        self.body = ui.element("div").style("width:100%").props('data-testid="study-chart"')
        ui.label("A click on a point opens its case.").classes("ev-what")
        self._choose()

    def _list_failed(self, count: int) -> None:
        """The cases that failed, by reason; a click opens one."""
        reasons = self.reasons.values
        failed = [int(k) for k in np.flatnonzero(reasons.ravel() != "")][:_LISTED]
        with ui.element("div").classes("ev-card ev-tablebox").props('data-testid="failed-cases"'):
            with ui.element("table").classes("ev-table"):
                with ui.element("tr"):
                    for text in ("failed case", "reason"):
                        with ui.element("th"):
                            ui.label(text)
                for index in failed:
                    with ui.element("tr"):
                        with ui.element("td"), ui.element("button").classes("ev-link").props("type=button") as link:
                            ui.label(self._named(index))
                        link.on("click", lambda k=index: self._open_index(k))
                        with ui.element("td"):
                            ui.label(str(reasons.ravel()[index]))
            if count > len(failed):
                ui.label(f"the first {len(failed)} of {count}").classes("ev-what")

    def _named(self, index: int) -> str:
        places = np.unravel_index(index, self.asked.shape) * (1 if self.grid else len(self.asked.axes))
        axes = zip(self.asked.axes, places, strict=True)
        texts = (f"{axis.key} = {form_text(self.units.text(axis.key, axis.written(int(k))))}" for axis, k in axes)
        return f"{index + 1}: {', '.join(texts)}"

    def _table(self, keys: Sequence[str]) -> None:
        """Download all cases as a table."""
        content = an.as_csv(studytable.rows(self.study, self.cases, keys))
        ui.download.content(content, f"{plain(self.asked.name)}.csv")

    async def _draw_figures(self) -> None:
        """The figures that the system has for such a study, below the chart."""
        drawn = await asyncio.to_thread(_pictures, self.whole)
        if not drawn or self.body.is_deleted:
            return
        with self.page.main, ui.element("div").classes("ev-sheets").props('data-testid="study-figures"'):
            for name, content in drawn.items():
                sheet = ui.element("img").classes("ev-card")
                sheet.props["src"] = f"data:image/png;base64,{base64.b64encode(content).decode()}"
                sheet.props["alt"] = name.replace("_", " ")

    def _choose(self) -> None:
        """What else must be chosen for a result, and its chart; at first where it varies most."""
        variable = self.study[self.chosen.value]
        places = {**studycharts.entry(variable, self.cases), **self.places}
        along = self._along(variable)
        self.free = [d for d in map(str, variable.dims) if d not in self.cases and d != along]
        self.free += [k for k in self.cases[:] if self.grid and k in variable.dims and k not in self.keys[:2]]
        self.rest.clear()
        with self.rest:
            for dim in self.free:
                names = self.study[dim].values if dim in self.study.coords else np.arange(1, variable.sizes[dim] + 1)
                options = {k: studycharts.text(names[k]) for k in range(variable.sizes[dim])}
                select = ui.select(options, value=min(places.get(dim, 0), len(options) - 1), label=dim)
                select.props("outlined dense options-dense").style("min-width:110px")
                select.on_value_change(lambda e, d=dim: self._place(d, int(e.value)))
                self.places[dim] = int(select.value)
        self._draw()

    def _along(self, variable: xr.DataArray) -> str:
        """The dimension that lines run along, where few cases have results over one, such as the time; '' for none."""
        if not self.grid or len(self.keys) != 1 or self.study.sizes[self.keys[0]] > studycharts.LINES:
            return ""
        long = [
            d
            for d in map(str, variable.dims)
            if d not in self.cases and variable.sizes[d] > 8 and d in self.study.coords
        ]
        return long[0] if long else ""

    def _place(self, dim: str, place: int) -> None:
        self.places[dim] = place
        self._draw()

    def _draw(self) -> None:
        variable = self.study[self.chosen.value]
        along = self._along(variable)
        chosen = variable.isel({dim: self.places[dim] for dim in self.free})
        reasons = self.reasons.isel({dim: self.places[dim] for dim in self.free if dim in self.reasons.dims})
        keys = [self.study[key] for key in self.keys]
        self.body.clear()
        with self.body, ui.element("div").classes("ev-charts one"):
            if along:
                chosen = chosen.transpose(self.keys[0], along)
                self._chart(*studycharts.lines(chosen, keys[0], self.study[along], reasons.values))
            elif self.grid and len(keys) > 1:
                words = next((k for k in keys[:2] if k.dtype.kind not in "iuf" and k.size <= studycharts.LINES), None)
                number = next((k for k in keys[:2] if k.dtype.kind in "iuf"), None)
                if words is not None and number is not None and not studycharts.is_category(chosen):
                    order = (str(words.name), str(number.name))
                    own = chosen.transpose(*order), words, number, reasons.transpose(*order).values
                    self._chart(*studycharts.lines(*own))
                else:
                    order = (self.keys[0], self.keys[1])
                    own = chosen.transpose(*order), *keys[:2], reasons.transpose(*order).values
                    self._chart(*studycharts.heatmap(*own))
            elif self.grid:
                own = chosen.squeeze(drop=True) if chosen.ndim > 1 else chosen
                broken = reasons.values.reshape(-1)
                self._chart(*studycharts.points(own, keys[0], broken, grid=True))
            else:
                for key in keys:
                    self._chart(*studycharts.points(chosen, key, reasons.values, grid=False))

    def _chart(self, options: dict[str, Any], at: studycharts.At) -> None:
        options = {"title": {"text": studycharts.title(self.study[self.chosen.value])}, **options}
        chart = Chart(options=options, timed=False)
        with ui.element("div").classes("ev-card"):
            ChartElement(chart, on_point=lambda series, index: self._open(at(series, index))).classes("tall")

    def _open(self, at: dict[str, int]) -> None:
        """Open the case of a point."""
        study = self.asked
        place: Sequence[int] = [at.get(dim, self.places.get(dim, 0)) for dim in study.dims]
        if any(k < 0 or k >= size for k, size in zip(place, study.shape, strict=True)):
            self.page.show_message("there is no case at that point")
            return
        self._open_index(int(np.ravel_multi_index(tuple(place), study.shape)))

    def _open_index(self, index: int) -> None:
        """Open a case by its number."""

        def take() -> None:
            paths = {axis.path: axis.key for axis in self.asked.axes}
            values = self.asked.overrides(index)
            changed = {key: self.units.text(paths[key], one) if key in paths else one for key, one in values.items()}
            content = cases.content_of(self.asked.content, changed)
            number, _, text = self._named(index).partition(": ")
            self.page.studio.take_case(content, f"case {number} of study {self.asked.name}: {text}")
            self.page.open_case()

        self.page.attempt(take)


def form_text(value: Any) -> str:
    """A value as it is shown in a sentence."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
