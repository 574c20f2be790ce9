"""The panel of calibrations: measured data, what was measured, and the keys of the open case that are fitted to it."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import yaml
from nicegui import events, ui

from evolvent.design.calibration import data
from evolvent_base import signals
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import form, reading, studydraft
from evolvent_studio.context import Context
from evolvent_studio.drafts import view_of
from evolvent_studio.elements import upload
from evolvent_studio.places import LARGEST_RECORDING, LARGEST_SIGNALS
from evolvent_studio.placing import TABLES, source_file
from evolvent_studio.relaxationpanel import RelaxationPanel

#: The two forms of the panel, and what is fitted by each.
_FORMS = {"keys": "keys of the case", "curves": "relaxation curves"}
#: Fields of what was measured and of keys that are fitted, and what they are called.
_ROWS = {
    "observe": {"variable": "variable", "column": "column", "std": "standard deviation"},
    "fit": {"key": "key", "low": "from", "high": "to"},
}


class CalibratePanel:
    """The panel.

    Parameters
    ----------
    page : Context
    """

    def __init__(self, page: Context) -> None:
        self.page, self.studio = page, page.studio
        self._columns: list[str] = []
        self._names: list[str] = []
        self._asked: Any = None
        with ui.element("div").classes("ev-pick-form"):
            self._turn = ui.toggle(_FORMS, value=self._shown)
            self._turn.props('dense flat no-caps spread toggle-color=primary data-testid="form-of-calibration"')
            self._turn.on_value_change(lambda e: self._turned(str(e.value)))
        with ui.element("div").classes("ev-part") as of_keys:
            self._draw_form()
        with ui.element("div").classes("ev-part") as of_curves:
            self.curves = RelaxationPanel(page, self.draw)
        self._forms = {"keys": of_keys, "curves": of_curves}
        self.draw()

    def _draw_form(self) -> None:
        """Draw the form of fitted keys."""
        with ui.element("div").classes("ev-scroll"):
            ui.label(
                "Keys of the open case are fitted to measured data: a history over time, or a table of runs whose "
                "columns are keys of the case."
            ).classes("ev-what")
            with ui.element("div").classes("ev-drop w-full"):
                upload(
                    label="Drop a file of data (CSV) here, or choose", most=LARGEST_SIGNALS, handle=self._dropped,
                    refused=lambda: self.page.show_message("the upload was refused: it is too large"),
                ).props(f'flat dense accept="{",".join(TABLES)}" data-testid="data-upload"')  # fmt: skip
            self._file = ui.select([], label="or a file of the folder")
            self._file.props('outlined dense options-dense data-testid="data-file"').classes("w-full")
            self._file.on_value_change(lambda e: self._choose(str(e.value or "")))
            self._about = ui.label("").classes("ev-what").props('data-testid="data-columns"')
            self._case = ui.label("").classes("ev-what").props('data-testid="case-of-calibration"')
            self._body = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button("Fit the keys", on_click=self._submit)
            self._go.props('unelevated color=primary data-testid="calibrate"')
            self._hint = ui.label("").classes("ev-status ev-wrap")

    @property
    def _state(self) -> dict[str, Any]:
        return self.studio.calibration

    @property
    def _shown(self) -> str:
        """Which of the two forms is shown."""
        shown = str(self._state["shown"])
        return shown if shown in _FORMS else "keys"

    def _turned(self, shown: str) -> None:
        """Show another of the two forms."""
        if shown != self._state["shown"]:
            self._state["shown"] = shown
            self.list()

    def draw(self) -> None:
        """Draw the panel again."""
        self._turn.set_value(self._shown)
        for name, part in self._forms.items():
            part.set_visibility(name == self._shown)
        if self._shown == "curves":
            self.curves.draw()
            return
        self._read()
        case = self.studio.draft.content
        self._keys = studydraft.keys(case)
        self._case.set_text(f"of the open case: {self.studio.open_case_title()}")
        files = self.studio.folder.files(*TABLES)
        own = [self._state["file"]] if self._state["file"] and self._state["file"] not in files else []
        self._file.set_options({name: name.rpartition("/")[2] if name in own else name for name in own + files},
                               value=self._state["file"] or None)  # fmt: skip
        self._about.set_text(f"columns: {', '.join(self._columns)}" if self._columns else "")
        self._body.clear()
        with self._body:
            ui.label("what was measured").classes("ev-h")
            self._draw_rows("observe")
            ui.label("keys that are fitted").classes("ev-h")
            self._draw_rows("fit")
        self._show()

    def list(self) -> None:
        """Take the case that is open, and the names of its variables; keys of another case are forgotten."""
        case = self.studio.draft.content
        self._state["fit"] = [row for row in self._state["fit"] if studydraft.has_key(case, row["key"])]
        self.draw()
        if self._asked != case and self._shown == "keys":
            ui.timer(0.01, self._ask, once=True)

    async def _ask(self) -> None:
        case = self._asked = dict(self.studio.draft.content)

        def ask() -> list[str]:
            with self.studio.computing:
                return studydraft.over_time(self._placed(case))

        try:
            self._names = await asyncio.to_thread(ask)
        except EvolventError:
            self._names = []
        if not self._body.is_deleted:
            self._match()
            self.draw()

    # -------------------------------------------------------------------------------------------- data

    async def _dropped(self, event: events.UploadEventArguments) -> None:
        content = await event.file.read()
        self.page.attempt(lambda: self._choose(self.studio.folder.keep(event.file.name, content)))

    def _choose(self, name: str) -> None:
        if name != self._state["file"]:
            self._state.update(file=name, observe=[])
            self._read()
            self._match()
            self.draw()

    def _read(self) -> None:
        """Read the names of the file's columns."""
        self._columns = []
        if self._state["file"]:
            with contextlib.suppress(InputError):  # of a log that only its system reads; else it is said when it is run
                path = self.studio.folder.file(self._state["file"], LARGEST_RECORDING)
                self._columns = list(signals.read(str(path)).names)

    # -------------------------------------------------------------------------------------------- rows of the form

    def _draw_rows(self, what: str) -> None:
        rows, word = self._state[what], "a variable" if what == "observe" else "a key"
        for place, row in enumerate(rows):
            with ui.element("div").classes("ev-axis").props(f'data-testid="{what}-{place}"'):
                first, *others = _ROWS[what]
                with ui.element("div").classes("ev-row"):
                    options = self._names if what == "observe" else list(self._keys)
                    self._select(what, place, first, options)
                    drop = ui.button(icon="close", on_click=lambda r=row: self._drop(what, r))
                    drop.props('flat dense round size=sm aria-label="remove it"')
                with ui.element("div").classes("ev-fields"):
                    for field in others:
                        if field == "column":
                            self._select(what, place, field, self._columns)
                            continue
                        typed = ui.input(_ROWS[what][field], value=row.get(field, ""))
                        typed.props(f'outlined dense spellcheck=false data-testid="{what}-{place}-{field}"')
                        typed.on_value_change(lambda e, r=row, f=field: self._put(r, f, e.value))
                if what == "fit" and row.get("key"):
                    self._draw_start(row["key"])
        add = ui.button(f"Add {word}", icon="add", on_click=lambda: self._add(what))
        add.props(f'flat dense color=primary size=sm data-testid="add-{what}"').style("align-self:flex-start")

    def _draw_start(self, key: str) -> None:
        """What is known of a fitted key."""
        value, unit = studydraft.value_at(self.studio.draft.content, key), self._keys.get(key, ("", ""))[0]
        start = "" if value is None or isinstance(value, Mapping) else f"starts at {form.text_of(value)}"
        notes = [start, f"a plain number is in {unit}" if unit else ""]
        ui.label("; ".join(filter(None, notes))).classes("ev-what")

    def _select(self, what: str, place: int, field: str, options: Sequence[str]) -> None:
        row = self._state[what][place]
        value = row.get(field) or None
        listed = [value, *options] if value and value not in options else [*options]
        chosen = ui.select(listed, value=value, label=_ROWS[what][field], with_input=True, new_value_mode="add-unique")
        chosen.props(f'outlined dense options-dense data-testid="{what}-{place}-{field}"')
        chosen.style("flex:1;min-width:0").on_value_change(
            lambda e: self._put(row, field, e.value, again=field in ("key", "variable"))
        )

    def _match(self) -> None:
        """Observe each variable that a column of the file is named by, where nothing is observed yet."""
        if not any(any(row.values()) for row in self._state["observe"]):
            found = matched(self._columns, self._names)
            own = [dict(zip(_ROWS["observe"], (name, column, ""), strict=True)) for name, column in found.items()]
            self._state["observe"] = own or self._state["observe"]

    def _put(self, row: dict[str, str], field: str, value: Any, *, again: bool = False) -> None:
        row[field] = "" if value is None else str(value).strip()
        if field == "variable" and not row["column"]:
            row["column"] = matched(self._columns, [row["variable"]]).get(row["variable"], "")
        if again:
            self.draw()
        self._show()

    def _add(self, what: str) -> None:
        self._state[what].append(dict.fromkeys(_ROWS[what], ""))
        self.draw()

    def _drop(self, what: str, row: dict[str, str]) -> None:
        self._state[what] = [one for one in self._state[what] if one is not row]
        self.draw()

    def _show(self) -> None:
        """Show what is missing."""
        rows = {what: [row for row in self._state[what] if row[next(iter(_ROWS[what]))]] for what in _ROWS}
        hint = "give a file of data" if not self._state["file"] else ""
        hint = hint or ("" if rows["observe"] else "add a variable that was measured")
        hint = hint or ("" if rows["fit"] else "add a key")
        self._hint.set_text(hint)
        self._go.set_enabled(not hint)

    # -------------------------------------------------------------------------------------------- what is done with it

    def _placed(self, case: dict[str, Any]) -> Any:
        """The case that is open, its files by absolute paths."""
        draft = self.studio.draft
        return self.studio.folder.placed(case, source_file(draft.origin or draft.source))

    def _content(self) -> dict[str, Any]:
        """What the job is asked for."""
        case = self._placed(self.studio.draft.content)
        observed = [row for row in self._state["observe"] if row["variable"]]
        fitted = [row for row in self._state["fit"] if row["key"]]
        found: dict[str, Any] = {
            "data": self._state["file"],
            "case": case,
            "fit": [row["key"] for row in fitted],
            "observe": [row["variable"] + (f"={row['column']}" if row["column"] else "") for row in observed],
        }
        bounds = {row["key"]: [row["low"] or -math.inf, row["high"] or math.inf]
                  for row in fitted if row["low"] or row["high"]}  # fmt: skip
        if bounds:
            found["bounds"] = bounds
        if any(row["std"] for row in observed):
            found["deviations"] = [_number(row["variable"], row["std"]) for row in observed]
        return found

    async def _submit(self) -> None:
        self._go.props("loading")
        path = ""

        def check() -> dict[str, Any]:
            nonlocal path
            content = self._content()
            path = str(self.studio.folder.file(self._state["file"], LARGEST_RECORDING))
            data.read(path, content["case"], content["observe"])
            return content

        try:
            content = await asyncio.to_thread(check)
        except EvolventError as error:
            self.page.show_message(str(error))
            return
        finally:
            self._go.props(remove="loading")
        title = self.studio.open_case_title().partition(",")[0].rpartition("/")[2].partition(".")[0]
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        job = self.studio.jobs.add("calibrate", title, case=text, extra={"signals": [path]})
        self.page.show(view_of(job), tab="runs")

    def edit(self, content: Any, about: str) -> None:
        """Put a calibration into the form, and its case into that of the case.

        Parameters
        ----------
        content : str, of the job as YAML
        about : str, its name
        """
        asked = reading.content(content, about)
        if not is_calibration(asked):
            raise InputError(
                f"{about}: it holds no calibration; one has a case, and lists of what is fitted and observed"
            )
        self.studio.take_case(asked["case"], f"case of calibration {about}")
        pairs = itertools.zip_longest(
            asked["observe"], asked.get("deviations", [])[: len(asked["observe"])], fillvalue=""
        )
        observed = [(*name.partition("=")[::2], std) for name, std in pairs]
        ends = {key: [form.text_of(end) if _is_typed(end) else "" for end in both]
                for key, both in asked.get("bounds", {}).items()}  # fmt: skip
        self._state.update(
            shown="keys",
            file=str(asked.get("data", "")),
            observe=[dict(zip(_ROWS["observe"], map(str, row), strict=True)) for row in observed],
            fit=[dict(zip(_ROWS["fit"], (key, *ends.get(key, ("", ""))), strict=True)) for key in asked["fit"]],
        )
        self.page.open_case()
        self.page.open_tab("calibrate")


def matched(columns: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    """Columns of a file that are named as variables are: variable -> column.

    Letters and digits count, not their case, and not a unit in brackets: "Hinge angle (deg)" is "hinge.angle". A name
    that several columns have, or several variables, is left out.
    """

    def plain(text: str) -> str:
        return re.sub(r"[^a-z0-9]+", "", re.sub(r"[(\[].*?[)\]]", "", text).lower())

    by_name: dict[str, list[str]] = {}
    for column in columns:
        by_name.setdefault(plain(column), []).append(column)
    wanted = Counter(map(plain, names))
    found = {name: by_name.get(plain(name), []) for name in names if wanted[plain(name)] == 1}
    return {name: own[0] for name, own in found.items() if len(own) == 1}


def is_calibration(asked: Any) -> bool:
    """Whether a content is that of a job that fits keys."""
    if not isinstance(asked, dict) or not isinstance(asked.get("case"), dict):
        return False
    texts, bounds = (asked.get("fit"), asked.get("observe")), asked.get("bounds", {})
    lists = all(isinstance(one, list) and all(isinstance(text, str) for text in one) for one in texts)
    pairs = isinstance(bounds, dict) and all(isinstance(both, list) and len(both) == 2 for both in bounds.values())
    return lists and pairs and isinstance(asked.get("deviations", []), list)


def _is_typed(end: Any) -> bool:
    """Whether an end of bounds is one that was typed."""
    return not (isinstance(end, float) and math.isinf(end))


def _number(name: str, text: str) -> float:
    """A standard deviation.

    Raises
    ------
    InputError
        If it is no number.
    """
    try:
        return float(text)
    except ValueError:
        raise InputError(
            f"the standard deviation of {name} is {text!r}; give a number in the unit of its column, for every variable"
        ) from None
