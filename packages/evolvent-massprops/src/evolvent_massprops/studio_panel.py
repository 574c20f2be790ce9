"""Measurements: signal files, what their columns are, the stand, and the certificate."""

from __future__ import annotations

import asyncio
import contextlib
import copy
import functools
import pathlib
import urllib.parse
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import yaml
from nicegui import events, ui

from evolvent_base import file_keys, signals, units
from evolvent_base.errors import EvolventError, InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.signals import timebase
from evolvent_massprops import description, torsion_rig
from evolvent_studio import charts, form
from evolvent_studio.context import Context, Panel as StudioPanel
from evolvent_studio.drafts import MEASURED, View
from evolvent_studio.elements import ChartElement, report_frame, table, upload
from evolvent_studio.formview import FormView, errors_text, first_error
from evolvent_studio.job import Job
from evolvent_studio.jobview import STATUS, draw_progress
from evolvent_studio.places import LARGEST, LARGEST_RECORDING, LARGEST_SIGNALS
from evolvent_studio.placing import SIGNALS

#: Number of signal columns that are drawn.
_DRAWN = 6
_SKIP = ("signals.sensors", "signals.time", "recordings", "stand.kind")
#: Kind of a stand whose description states its periods; it needs no signals.
_RIG = "torsion rig"
_USES = {"sensor": "sensor", "time": "time", "": "left out"}
#: What is asked of each sensor's column; the rest of the form's keys a description file may give.
_ASKED = ("point", "direction", "unit", "sensitivity")


class MeasurePanel(StudioPanel):
    """The panel, and what is shown beside it.

    Parameters
    ----------
    page : Context
    """

    label = "Identify"
    about = "modes and mass properties of a body from recorded signals"

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self.state = self.studio.measure
        for key, first in MEASURED.items():
            self.state.setdefault(key, copy.deepcopy(first))
        self._source: signals.Signals | None = None
        self._form: FormView | None = None
        self._chart: ChartElement | None = None
        self._wrong: dict[str, str] = {}
        self.content: dict[str, Any] = {}
        self._rows: dict[str, ui.element] = {}
        with ui.element("div").classes("ev-scroll"):
            ui.label(
                "Mass properties from recorded free vibration: signal files and a description of the stand give a "
                "certificate."
            ).classes("ev-what")
            with ui.element("div").classes("ev-drop w-full"):  # it stays: files may still be on their way through it
                upload(
                    label="Drop signal files here, or choose", multiple=True,
                    most=LARGEST_SIGNALS, handle=self._dropped, refused=self._refused,
                ).props('flat dense data-testid="signals"')  # fmt: skip
            self._known = ui.select([], label="or a file of the folder")
            self._known.props('outlined dense options-dense data-testid="signal-file"').classes("w-full")
            self._known.on_value_change(lambda e: self._add([str(e.value)]) if e.value else None)
            self._files = ui.element("div").classes("ev-part")
            ui.label("stand and body").classes("ev-h")
            self._stand = ui.select([])
            self._stand.props('outlined dense options-dense label="description" data-testid="stand"').classes("w-full")
            self._stand.on_value_change(lambda e: self._choose(str(e.value)) if e.value != self._source_of() else None)
            with ui.element("div").classes("ev-drop w-full"):
                upload(
                    label="or drop a description (YAML)", most=LARGEST, handle=self._described,
                    refused=lambda: self.page.show_message("a description is a YAML file of at most 500 kB"),
                ).props('flat dense data-testid="stand-upload"')  # fmt: skip
            self._body = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button("Find mass properties", on_click=self._submit)
            self._go.props('unelevated color=primary data-testid="measure"')
            self._hint = ui.label("").classes("ev-status")
        self.draw()

    # -------------------------------------------------------------------------------------------- the panel

    def draw(self) -> None:
        """Show what is there now; what is the same stays, so that no click on it is lost."""
        if self._form is not None:
            self._form.flush()
        self._read()
        known = self.studio.folder.files(*SIGNALS)
        self._known.set_options(known, value=None)
        self._known.set_visibility(bool(known))
        self._list()
        options = {f"kind:{k}": f"new: {k}" for k in (*description.KINDS, _RIG)}
        options |= {f"file:{n}": n for n in self.studio.stands()}
        value = self._source_of()
        self._stand.set_options({value: value.partition(":")[2], **options}, value=value)
        if self._form is not None and self.content == self.state["content"]:
            self._form.check()  # the columns may be others
            return
        self._body.clear()
        with self._body:
            self._form = FormView(
                torsion_rig.OnRig if self._is_rig else description.model(self.state["kind"]),
                self.state["content"],
                self._changed,
                skip=_SKIP,
                complete=self._complete,
            )

    @property
    def _is_rig(self) -> bool:
        """Whether the stand is a torsion rig."""
        return bool(self.state["kind"] == _RIG)

    def _source_of(self) -> str:
        """Where the description comes from."""
        return self.state["stand"] or f"kind:{self.state['kind']}"

    def _list(self) -> None:
        """List the files that are taken."""
        for name in [name for name in self._rows if name not in self.state["files"]]:
            self._rows.pop(name).delete()
        for name in self.state["files"]:
            if name in self._rows:
                continue
            with self._files, ui.element("div").classes("ev-row") as row:
                shown = ui.label(name.rpartition("/")[2]).classes("ev-link")
                shown.props["title"] = name
                ui.button(icon="close", on_click=lambda n=name: self._leave(n)).props("flat dense round size=xs")
            self._rows[name] = row

    def _choose(self, source: str) -> None:
        kind, _, name = source.partition(":")
        if kind == "kind":
            self._take({"stand": {"kind": "torsion", "rod": {}} if name == _RIG else {"kind": name}}, "")
        elif not self.page.attempt(lambda: self._open(name)):
            self._stand.set_value(self._source_of())

    def _open(self, name: str) -> None:
        content = self.studio.folder.content(name)
        stand = content.get("stand") if isinstance(content, Mapping) else None
        if not isinstance(stand, Mapping) or stand.get("kind") not in description.KINDS:
            raise InputError(
                f"{name}: it describes no stand; its stand.kind must be one of {', '.join(description.KINDS)}"
            )
        self._take(dict(content), f"file:{name}")

    def _take(self, content: dict[str, Any], stand: str) -> None:
        self._form = None  # what was typed there is of another stand
        kind = _RIG if torsion_rig.states_rig(content) else content["stand"]["kind"]
        self.state.update(content=content, stand=stand, kind=kind, columns={})
        self.draw()
        if self.page.view.kind == "measure" and not self.page.view.refs:
            self.page.draw()

    async def _described(self, event: events.UploadEventArguments) -> None:
        content = await event.file.read()
        self.page.attempt(lambda: self._open(self.studio.folder.keep(event.file.name, content)))

    # -------------------------------------------------------------------------------------------- signals

    async def _dropped(self, event: events.MultiUploadEventArguments) -> None:
        kept: list[str] = []

        def keep(name: str, content: bytes) -> None:
            kept.append(self.studio.folder.keep(name, content))

        for file in event.files:
            self.page.attempt(functools.partial(keep, file.name, await file.read()))
        for name in kept:
            shown = pathlib.PurePosixPath(name).name
            if shown not in [file.name for file in event.files]:
                ui.notify(f"Kept as {shown}: another upload has the name of the file.", position="bottom")
        await self._add(kept)

    def _refused(self) -> None:
        most = LARGEST_SIGNALS // 1_000_000
        self.page.show_message(
            f"the upload was refused: {most} MB can be uploaded at once; put larger files in the working folder"
        )

    async def _add(self, names: Sequence[str]) -> None:
        """Take files as signals; what is wrong with one of them does not keep the others out."""
        good = []
        for name in names:
            try:
                await asyncio.to_thread(_recording, self.studio.folder.file(name, LARGEST_RECORDING))
            except EvolventError as error:
                self.page.show_message(str(error))
            else:
                good.append(name)
        if not good:
            self._known.set_value(None)
            return
        self.state["files"] += [name for name in good if name not in self.state["files"]]
        self.draw()
        self.page.show(View("measure"))

    def _leave(self, name: str) -> None:
        self.state["files"].remove(name)
        self.draw()
        self.page.show(View("measure"))

    def _read(self) -> None:
        """Read the first file, whose columns stand for those of all."""
        self._source = None
        while self.state["files"] and self._source is None:
            try:
                self._source = _recording(self.studio.folder.file(self.state["files"][0], LARGEST_RECORDING))
            except InputError:
                del self.state["files"][0]
        self._map()

    def _map(self) -> None:
        """What each column is: as the description has it, else sensors, and times by their name."""
        if self._source is None or set(self.state["columns"]) == set(self._source.names):
            return
        given = self.state["content"].get("signals") or {}
        sensors = {}
        for sensor in given.get("sensors") or ():
            if isinstance(sensor, Mapping) and "column" in sensor:
                try:
                    sensors[self._source.names[self._source.index(sensor["column"])]] = sensor
                except InputError:
                    continue
        columns, times = {}, timebase.times(self._source)
        for k, name in enumerate(self._source.names):
            timed = name in (given.get("time"),) or k in times
            own = sensors.get(name, {})
            use = "time" if timed else "sensor" if own or not sensors else ""
            texts = {key: form.text_of(own.get(key)) for key in _ASKED}
            texts["unit"] = texts["unit"] or ""
            columns[name] = {"use": use, "stated": self._source.units[k], **texts, "own": dict(own)}
        self.state["columns"] = columns

    def _complete(self, typed: dict[str, Any]) -> dict[str, Any]:
        """The description with the columns in it."""
        if self._is_rig:
            return {**typed, "stand": {"kind": "torsion", **typed.get("stand", {})}}
        content = {**typed, "stand": {"kind": self.state["kind"], **typed.get("stand", {})}}
        given = dict(content.get("signals") or {})
        before = self.state["content"].get("signals") or {}
        if not self.state["columns"]:
            given |= {key: before[key] for key in ("sensors", "time") if key in before}
        sensors = []
        found = [] if self._source is None else [self._source.names[k] for k in timebase.times(self._source)]
        for name, column in self.state["columns"].items():
            if column["use"] == "time" and name not in found:
                given["time"] = name
            if column["use"] != "sensor":
                continue
            sensor = {"column": name}
            sensor |= {k: v for k, v in column["own"].items() if k not in ("column", *_ASKED)}
            for key in _ASKED:
                if column[key].strip():
                    try:
                        sensor[key] = form.value_of(column[key], key)
                    except InputError:
                        sensor[key] = column[key]
            sensors.append(sensor)
        every = all(column["use"] for column in self.state["columns"].values())
        plain = all(set(s) == {"column"} for s in sensors)
        if sensors and not (every and plain and self.state["kind"] != "springs"):
            given["sensors"] = sensors
        if given:
            content["signals"] = given
        if "recordings" in self.state["content"]:
            content["recordings"] = self.state["content"]["recordings"]
        return content

    def _changed(self, content: dict[str, Any], wrong: dict[str, str]) -> None:
        self.content = self.state["content"] = content
        columns = self.state["columns"].values()
        signals_given = bool(self.state["files"]) or self._is_rig
        used = not self.state["files"] or self._is_rig or any(column["use"] == "sensor" for column in columns)
        shown = self._form.shown if self._form is not None else {}
        self._wrong = wrong
        self._go.set_enabled(not shown and used and signals_given)
        hint = "give a signal file" if not signals_given else "no column is a sensor" if not used else ""
        self._hint.set_text(hint or errors_text(len(shown)))
        if self._chart is not None and not self._chart.is_deleted and self._source is not None:
            self._chart.show(_signal_chart(self._source, self.state["columns"], self._rate()))

    def _rate(self) -> float:
        """The sampling rate that the description states, Hz; 0 where it states none."""
        given = self.content.get("signals")
        text = given.get("rate") if isinstance(given, Mapping) else None
        try:
            return max(units.parse(str(text), "Hz"), 0.0) if text is not None else 0.0
        except units.UnitError:
            return 0.0

    # -------------------------------------------------------------------------------------------- beside the panel

    def draw_main(self) -> None:
        """The signals with their columns, or a measurement."""
        if self.page.view.refs:
            self._measured(self.page.view.refs[0])
            return
        if self._source is None:
            with ui.element("div").classes("ev-empty"):
                ui.label("Drop a file of signals on the left: CSV, TDMS, UFF 58, MAT, HDF5, WAV, or a run.")
            return
        source = self._source
        with ui.element("div").classes("ev-titlebar"):
            ui.label(source.path.rpartition("/")[2]).classes("ev-h1")
            rate = f", {source.rate:g} Hz" if source.rate else ""
            size = max(one.size for one in source.columns)
            ui.label(f"{source.format}, {size} samples{rate}").classes("ev-status")
        with ui.element("div").classes("ev-card").style("padding:8px"):
            self._chart = ChartElement(_signal_chart(source, self.state["columns"], self._rate()))
            self._chart.props('data-testid="signal-chart"')
        ui.label("Columns").classes("ev-h")
        self._columns()

    def _columns(self) -> None:
        asked = form.describe(description.Sensor)
        fields = {field.key: field for field in asked.fields()}
        card = ui.element("div").classes("ev-card").style("padding:6px 10px;overflow-x:auto")
        with card, ui.element("table").classes("ev-table").props('data-testid="columns"'):
            with ui.element("tr"):
                for head in ("column", "it is", *_ASKED):
                    with ui.element("th"):
                        label = ui.label(head)
                        if head in fields:
                            label.tooltip(fields[head].help)
            for k, (name, column) in enumerate(self.state["columns"].items()):
                with ui.element("tr").classes("ev-map-row"):
                    self._column(k, name, column)

    def _column(self, k: int, name: str, column: dict[str, Any]) -> None:
        def put(key: str, value: Any) -> None:
            column[key] = "" if value is None else str(value)
            if self._form is not None:
                self._form.check()

        with ui.element("td"):
            ui.label(name).style("white-space:nowrap")
        with ui.element("td"):
            use = ui.select(_USES, value=column["use"]).props(f'outlined dense options-dense data-testid="use-{k}"')
            use.style("min-width:92px").on_value_change(lambda e: put("use", e.value))
        for key in _ASKED:
            with ui.element("td") as cell:
                cell.bind_visibility_from(use, "value", value="sensor")
                shown = {"point": "1 or [x, y, z]", "direction": "vertical", "unit": column["stated"] or "m"}
                typed = ui.input(value=column[key], placeholder=shown.get(key, ""))
                typed.props(f'outlined dense spellcheck=false data-testid="{key}-{k}"').style("min-width:84px")
                typed.on_value_change(lambda e, key=key: put(key, e.value))

    def _submit(self) -> None:
        def add() -> None:
            if self._form is not None:
                self._form.flush()
                if self._wrong:
                    self._form.show_all()
                    self._changed(self.content, self._wrong)
                    raise InputError(first_error(self._wrong))
            names = [] if self._is_rig else self.state["files"]
            files = [str(self.studio.folder.file(name, LARGEST_RECORDING)) for name in names]
            given = (torsion_rig.load if self._is_rig else description.load)(self.content)
            title = given.title or given.body.name
            text = yaml.safe_dump(self.content, sort_keys=False, allow_unicode=True)
            job = self.studio.jobs.add("identify", title, case=text, extra={"signals": files})
            self.page.show(View("measure", (f"job:{job.key}",)))

        self.page.attempt(add)

    def _measured(self, ref: str) -> None:
        """A measurement: how far it is, or what came of it."""
        job = self.studio.jobs.jobs.get(ref.partition(":")[2])
        if job is None:
            ui.label("This identification was removed.").classes("ev-empty")
            return
        with ui.element("div").classes("ev-titlebar"):
            ui.label(job.title).classes("ev-h1")
            ui.label(STATUS.get(job.status, job.status)).classes(f"ev-status {job.status}")
            ui.element("div").style("flex:1")
            ui.button("Back to the signals", on_click=lambda: self.page.show(View("measure"), tab="measure")).props(
                "flat dense color=primary"
            )
            if self.studio.jobs.result(job.key) is not None:
                address = f"/studio/report?ref={urllib.parse.quote(ref)}"
                ui.button(
                    "Download the certificate", on_click=lambda: ui.download(address, filename="certificate.html")
                ).props("outline dense color=primary").style("padding:0 10px")
        if job.open:
            draw_progress(self.page, job)
            return
        if job.status == "interrupted":
            ui.label("This identification was cancelled.").classes("ev-banner warn").props('data-testid="message"')
        if job.status == "failed":
            ui.label(job.message).classes("ev-banner bad").props('data-testid="message"')
        self._results(job)
        if self.studio.jobs.result(job.key) is not None:
            report_frame(ref, "certificate", dark=self.studio.dark)

    def _results(self, job: Job) -> None:
        rows = job.extra.get("rows")
        if not rows:
            return
        card = ui.element("div").classes("ev-card ev-tablebox").props('data-testid="measured"')
        with card:
            table(rows, head=job.extra.get("head", ()))
        for kind, word, plural in (("warnings", "Warning", "warnings"), ("notes", "Note", "notes on the recordings")):
            _group(kind, word, plural, [str(text) for text in job.extra.get(kind, ())])


def _group(kind: str, word: str, plural: str, texts: Sequence[str]) -> None:
    """One box for all warnings, or all notes."""
    if not texts:
        return
    with ui.element("div").classes("ev-banner warn" if kind == "warnings" else "ev-banner note") as box:
        box.props(f'data-testid="{kind}"')
        if len(texts) == 1:
            ui.label(f"{word}: {texts[0]}")
            return
        ui.label(f"{len(texts)} {plural}").classes("ev-title")
        with ui.element("ul"):
            for text in texts:
                with ui.element("li"):
                    ui.label(text)


def _recording(path: pathlib.Path) -> signals.Signals:
    """The columns of a file, read once."""
    try:
        return _read_once(path, file_keys.state(path))
    except OSError:
        raise InputError(f"there is no file {path.name!r} any more") from None


@functools.lru_cache(maxsize=4)
def _read_once(path: pathlib.Path, stamp: tuple[int, ...]) -> signals.Signals:
    return signals.read(path)


def _signal_chart(source: signals.Signals, columns: Mapping[str, Any], rate: float) -> charts.Chart:
    """The columns over their time.

    Parameters
    ----------
    columns : what each column is used for
    rate : float, Hz, that the description states, 0 for none
    """
    times = [k for k, name in enumerate(source.names) if columns.get(name, {}).get("use") == "time"]
    has_time = bool(times or rate or source.rate)
    x_label = "time, s" if has_time else "sample (no sampling rate is given)"
    drawn = [k for k in range(len(source.names)) if k not in times][:_DRAWN]
    found = [columns.get(source.names[k], {}).get("unit") or source.units[k] for k in drawn]
    common = found[0] if len(set(found)) == 1 else ""
    labels = [
        f"{source.names[k]} [{unit}]" if unit and not common else source.names[k]
        for k, unit in zip(drawn, found, strict=True)
    ]
    lines = []
    for n, k in enumerate(drawn):
        with contextlib.suppress(InputError):  # of a column of words; it is said where it is used
            x = _times_of(source, k, times, rate)
            lines.append(Line(x=x, y=source.samples(k), label=labels[n], color=n))
    panel = Panel(x_label=x_label, y_label=f"reading, {common}" if common else "reading", lines=lines)
    made = charts.charts(Figure(name="signals", title="", panels=[panel]))[0]
    return charts.Chart(options=made.options, timed=False)


def _times_of(source: signals.Signals, k: int, times: Sequence[int], rate: float) -> np.ndarray:
    """Times of a column's samples, s; their numbers where nothing states them."""
    one = source.columns[k]
    own = next((t for t in times if source.columns[t].size == one.size), None)
    if own is not None:
        return timebase.in_seconds(source, own)
    rate = rate or one.rate or 0.0
    return one.start + np.arange(one.size) / rate if rate else np.arange(one.size, dtype=float)
