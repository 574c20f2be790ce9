"""Studies: run one, and see what came of its cases as maps and lines; a click opens the case."""

from __future__ import annotations

import asyncio
import base64
import json
import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

from evolvent import cases
from evolvent.errors import EvolventError, InputError
from evolvent.studio.charts import VIRIDIS, Chart
from evolvent.studio.elements import ChartElement
from evolvent.studio.runspanel import progress_text
from evolvent.studio.state import View

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.studies import Study
    from evolvent.studio.page import Page

#: Lines that are drawn over one another, at most.
_LINES = 12


class StudyPanel:
    """The panel, and what is shown beside it.

    Parameters
    ----------
    page : Page
    """

    def __init__(self, page: Page) -> None:
        self.page, self.studio = page, page.studio
        self._source = ""
        self._body = ui.element("div").classes("ev-scroll")
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button("Run the study", on_click=self._submit)
            self._go.props('unelevated color=primary data-testid="run-study"')
        self.draw()

    def draw(self) -> None:
        """Draw the panel anew."""
        from evolvent import studies

        self._shown = self._found()
        options, found = self._shown
        self._body.clear()
        with self._body:
            ui.label(
                "Many cases of one system, over keys that vary. A study is a YAML file; evolvent show prints one."
            ).classes("ev-what")
            self._source = self._source or next(iter(options))
            chosen = ui.select(options, value=self._source, label="study").classes("w-full")
            chosen.props('outlined dense options-dense data-testid="study"')
            chosen.on_value_change(lambda e: self._choose(str(e.value)))
            kind, _, name = self._source.partition(":")
            about = studies.built_in().get(name, "") if kind == "case" else ""
            if about:
                ui.label(about).classes("ev-what")
            ui.label("finished, in the folder").classes("ev-h")
            for name in found:
                link = ui.element("button").classes("ev-link").props("type=button")
                link.props["data-testid"] = f"study-{name}"
                with link:
                    ui.label(name)
                link.on("click", lambda n=name: self.page.show(View("study", (f"file:{n}",))))
            if not found:
                ui.label("none").classes("ev-what")

    def list(self) -> None:
        """List the studies anew, where they are others; what is the same stays under the mouse."""
        if self._found() != self._shown:
            self.draw()

    def _found(self) -> tuple[dict[str, str], Sequence[str]]:
        """Studies that can be run, and folders of those that are done."""
        return self.studio.study_sources(), self.studio.folder.studies()

    def _choose(self, source: str) -> None:
        self._source = source
        self.draw()

    async def _submit(self) -> None:
        def read() -> Study:
            from evolvent import studies
            from evolvent.studies import runner

            runner.check_installed()
            kind, _, name = self._source.partition(":")
            source = name
            if kind == "file":
                path = self.studio.folder.inside(name)
                raw = cases.parse_yaml(self.studio.folder.text(name), name)
                self.studio.folder.check_case(raw, path.parent)
                source = str(path)
            asked = studies.read(source)
            self.studio.folder.check_case(cases.parse_yaml(asked.text, name))
            return asked

        self._go.props("loading")
        try:
            asked = await asyncio.to_thread(read)  # it checks every case
        except EvolventError as error:
            self.page.tell(str(error))
            return
        finally:
            self._go.props(remove="loading")
        job = self.studio.jobs.add("sweep", asked.name, case=asked.text)
        self.page.show(View("study", (f"job:{job.key}",)), tab="runs")

    # -------------------------------------------------------------------------------------------- beside the panel

    def draw_main(self, ref: str) -> None:
        """A study: how far it is, or what came of it."""
        kind, _, name = ref.partition(":")
        if kind == "job":
            job = self.studio.jobs.jobs.get(name)
            if job is None:
                ui.label("This study was removed.").classes("ev-empty")
                return
            if job.open:
                self.page.result._progress(job)
                return
            if self.studio.jobs.result(name) is None:
                ui.label(f"{job.title}: {progress_text(job)}").classes(
                    "ev-banner bad" if job.status == "failed" else "ev-banner warn"
                )
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
                _Results(self.page, found, study)

        ui.timer(0.01, load, once=True)


def _opened(path: pathlib.Path) -> tuple[xr.Dataset, Study]:
    """The results of a study, and the study; both take a moment."""
    from evolvent import studies

    found = studies.open(path)
    return found, studies.read(cases.parse_yaml(found.attrs["study"], "the study"))


def _pictures(study: xr.Dataset) -> dict[str, bytes]:
    """What the system of a study draws of it, as PNG."""
    from evolvent.studies import draw

    return {name: draw.picture(figure) for name, figure in draw.of_system(study).items()}


class _Results:
    """What came of a study: one output at a time."""

    def __init__(self, page: Page, study: xr.Dataset, asked: Study) -> None:
        self.page, self.study, self.asked = page, study, asked
        self.grid = study.attrs["sample"] == "grid"
        keys = [key for key in json.loads(study.attrs["keys"]) if key in study.coords]
        self.keys = [key for key in keys if study[key].size > 1] or keys[:1]
        self.cases = list(keys) if self.grid else ["case"]
        self.outputs = [
            str(n) for n, v in study.data_vars.items() if v.dtype.kind in "fi" and set(self.cases) <= set(v.dims)
        ]
        self.places: dict[str, int] = {}
        with ui.element("div").classes("ev-titlebar").props('data-testid="study-result"'):
            ui.label(study.attrs["title"].removeprefix("evolvent ")).classes("ev-h1")
            ui.label(f"{study.status.size} cases of {study.attrs['system']}").classes("ev-status")
        failed = (study.status == "failed").values
        if failed.any():
            reason = str(study.reason.values[failed][0])
            ui.label(f"{failed.sum()} of {failed.size} cases failed; the first: {reason}").classes("ev-banner warn")
        if not self.outputs:
            ui.label("The study holds no numbers over its cases.").classes("ev-dim")
            return
        varies = [n for n in self.outputs if self._varies(n)]
        first = next((n for n in varies if study[n].dtype.kind == "f"), (varies or self.outputs)[0])
        with ui.element("div").classes("ev-row").style("flex-wrap:wrap;gap:10px"):
            self.chosen = ui.select({n: self._title(n) for n in self.outputs}, value=first, label="result")
            self.chosen.props('outlined dense options-dense data-testid="output"').style("min-width:280px")
            self.chosen.on_value_change(lambda e: self._choose())
            self.rest = ui.element("div").classes("ev-row").style("width:auto;flex-wrap:wrap")
        self.body = ui.element("div").style("width:100%").props('data-testid="study-chart"')
        ui.label("A click on a point opens its case. Blank: the case failed.").classes("ev-what")
        self._choose()
        ui.timer(0.01, self._draw_figures, once=True)

    async def _draw_figures(self) -> None:
        """The figures that the system has for such a study, below the chart."""
        drawn = await asyncio.to_thread(_pictures, self.study)
        if not drawn or self.body.is_deleted:
            return
        with self.page.main, ui.element("div").classes("ev-sheets").props('data-testid="study-figures"'):
            for name, content in drawn.items():
                sheet = ui.element("img").classes("ev-card")
                sheet.props["src"] = f"data:image/png;base64,{base64.b64encode(content).decode()}"
                sheet.props["alt"] = name.replace("_", " ")

    def _varies(self, name: str) -> bool:
        values = self.study[name].values
        finite = values[np.isfinite(values)]
        return finite.size > 1 and float(np.ptp(finite)) > 0.0

    def _title(self, name: str) -> str:
        attrs = self.study[name].attrs
        unit = attrs.get("units", "1")
        text = f"{name.replace('_', ' ')}" + (f", {unit}" if unit not in ("1", "") else "")
        return text + (f": {attrs['long_name']}" if attrs.get("long_name") else "")

    def _label(self, name: str) -> str:
        unit = str(self.study[name].attrs.get("units", "1"))
        return name if unit in ("1", "") else f"{name}, {unit}"

    def _choose(self) -> None:
        """What else must be chosen for an output, and its chart."""
        variable = self.study[self.chosen.value]
        along = self._along(variable)
        self.free = [d for d in map(str, variable.dims) if d not in self.cases and d != along]
        self.free += [k for k in self.cases[:] if self.grid and k in variable.dims and k not in self.keys[:2]]
        self.rest.clear()
        with self.rest:
            for dim in self.free:
                names = self.study[dim].values if dim in self.study.coords else np.arange(1, variable.sizes[dim] + 1)
                options = {k: _shown(names[k]) for k in range(variable.sizes[dim])}
                select = ui.select(options, value=min(self.places.get(dim, 0), len(options) - 1), label=dim)
                select.props("outlined dense options-dense").style("min-width:110px")
                select.on_value_change(lambda e, d=dim: self._place(d, int(e.value)))
                self.places[dim] = int(select.value)
        self._draw()

    def _along(self, variable: xr.DataArray) -> str:
        """The dimension that lines run along, where few cases have results over one, such as the time; '' for none."""
        if not self.grid or len(self.keys) != 1 or self.study.sizes[self.keys[0]] > _LINES:
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
        self.body.clear()
        with self.body, ui.element("div").classes("ev-charts one"):
            if along:
                self._chart(self._lines(chosen, along), lambda series, index: self._open({self.keys[0]: series}))
            elif self.grid and len(self.keys) > 1:
                x, y = self.keys[:2]
                count = self.study.sizes[y]
                self._chart(
                    self._map(chosen.transpose(x, y), x, y),
                    lambda series, index: self._open({x: index // count, y: index % count}),
                )
            elif self.grid:
                self._chart(
                    self._points(chosen, self.keys[0], lines=True), lambda s, index: self._open({self.keys[0]: index})
                )
            else:
                for key in self.keys:
                    self._chart(self._points(chosen, key, lines=False), lambda s, index: self._open({"case": index}))

    def _chart(self, options: dict[str, Any], on_point: Any) -> None:
        with ui.element("div").classes("ev-card"):
            ChartElement(Chart(options=options, timed=False), on_point=on_point).classes("tall")

    def _map(self, values: xr.DataArray, x: str, y: str) -> dict[str, Any]:
        every = values.values.astype(float)
        finite = every[np.isfinite(every)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        data = [[i, j, _number(every[i, j])] for i in range(every.shape[0]) for j in range(every.shape[1])]
        return {
            "title": {"text": self._title(self.chosen.value)},
            "legend": {"show": False},
            "xAxis": {"type": "category", "name": self._label(x), "data": [_shown(v) for v in self.study[x].values]},
            "yAxis": {"type": "category", "name": self._label(y), "data": [_shown(v) for v in self.study[y].values]},
            "visualMap": {
                "type": "continuous", "min": low, "max": high if high > low else low + 1.0, "calculable": True,
                "right": 6, "top": 40, "itemHeight": 220, "precision": _precision(low, high),
                "inRange": {"color": list(VIRIDIS)},
            },
            "series": [
                {"type": "heatmap", "data": data, "progressive": 0, "emphasis": {"itemStyle": {"borderColor": "#000"}}}
            ],
        }  # fmt: skip

    def _points(self, values: xr.DataArray, key: str, *, lines: bool) -> dict[str, Any]:
        at = self.study[key].values
        words = at.dtype.kind not in "iuf"
        x = [_shown(v) for v in at] if words else [float(v) for v in at]
        y = values.values.astype(float)
        axis: dict[str, Any] = {"type": "category" if words else "value", "name": self._label(key), "scale": True}
        if words:
            axis["data"] = list(dict.fromkeys(x))
        series: dict[str, Any] = {
            "type": "line" if lines else "scatter",
            "name": "",
            "data": [[a, _number(b)] for a, b in zip(x, y, strict=True)],
            "symbol": "circle",
            "symbolSize": 8,
            "showSymbol": True,
            "showAllSymbol": True,
            "itemStyle": {"color": "@1"},
            "lineStyle": {"color": "@1", "width": 1.4},
        }
        return {
            "title": {"text": self._title(self.chosen.value)},
            "legend": {"show": False},
            "xAxis": axis,
            "yAxis": {"type": "value", "name": self._label(self.chosen.value), "scale": True},
            "series": [series],
        }

    def _lines(self, values: xr.DataArray, along: str) -> dict[str, Any]:
        key = self.keys[0]
        x = self.study[along].values.astype(float)
        series = []
        for k, value in enumerate(self.study[key].values):
            y = values.isel({key: k}).values.astype(float)
            data = [[_number(a), _number(b)] for a, b in zip(x, y, strict=True)]
            series.append(
                {
                    "type": "line", "name": f"{key} = {_shown(value)}", "data": data, "showSymbol": False,
                    "triggerLineEvent": True, "itemStyle": {"color": f"@{k}"},
                    "lineStyle": {"color": f"@{k}", "width": 1.6},
                }
            )  # fmt: skip
        return {
            "title": {"text": self._title(self.chosen.value)},
            "legend": {"show": True},
            "xAxis": {"type": "value", "name": self._label(along), "scale": True},
            "yAxis": {"type": "value", "name": self._label(self.chosen.value), "scale": True},
            "series": series,
        }

    def _open(self, at: dict[str, int]) -> None:
        """Open the case of a point."""

        def take() -> None:
            study = self.asked
            place: Sequence[int] = [at.get(dim, self.places.get(dim, 0)) for dim in study.dims]
            if any(k < 0 or k >= size for k, size in zip(place, study.shape, strict=True)):
                raise InputError("there is no case at that point")
            index = int(np.ravel_multi_index(tuple(place), study.shape))
            changed = study.overrides(index)
            content = cases.content_of(study.content, changed)
            axes = [axis.key for axis in study.axes]
            changes_text = ", ".join(f"{key} = {form_text(changed[key])}" for key in axes)
            self.page.studio.take_case(content, f"case {index + 1} of study {study.name}: {changes_text}")
            self.page.open_case()

        self.page.attempt(take)


def form_text(value: Any) -> str:
    """A value as it is shown in a sentence."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _number(value: float) -> float | None:
    return float(f"{value:.7g}") if np.isfinite(value) else None


def _shown(value: Any) -> str:
    return f"{float(value):.4g}" if isinstance(value, (float, np.floating)) else str(value)


def _precision(low: float, high: float) -> int:
    """Digits after the point of a scale's ends."""
    span = max(high - low, 1e-12)
    return int(np.clip(2 - np.floor(np.log10(span)), 0, 10))
