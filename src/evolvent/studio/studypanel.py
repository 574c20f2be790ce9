"""The panel of studies: a form that writes one, its number of cases and expected time, and results in the folder."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import pathlib
import sys
import tempfile
from collections.abc import Mapping
from typing import Any

from nicegui import ui

from evolvent import cases
from evolvent.base.errors import EvolventError, InputError
from evolvent.studio import form, reading, studydraft
from evolvent.studio.context import Context
from evolvent.studio.sentences import as_sentence, cases_text, estimated_text, names_key
from evolvent.studio.state import View, view_of
from evolvent.studio.studydraft import StudyDraft
from evolvent.studio.studyview import StudyView

#: Seconds after the last change before the study is checked.
_PAUSE = 0.7
#: Cases up to which a study is checked as it is typed; a larger one is when it is run.
_CHECKED = 2000
_HELP = {
    "values": "values with units, separated by commas",
    "from": "first value", "to": "last value", "points": "number of points",
    "mean": "mean", "std": "standard deviation",
}  # fmt: skip
_DISTRIBUTIONS = (
    "10%, tolerance(-5%, 10%), uniform(LOW, HIGH), triangular(LOW, MODE, HIGH), normal(MEAN, STD), "
    "truncated-normal(MEAN, STD, LOW, HIGH), table(VALUE, VALUE, ...), table(FILE.csv); nominal is the case's own value"
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Kind:
    """What a panel writes: studies or dispersions.

    Attributes
    ----------
    job : str, kind of the job that runs it
    tab : str, the panel's
    word : str, what it is called
    samples : mapping, ways of sampling -> what they do
    kept : str, what is asked of the results that are kept
    mark : str, before the names of the panel's elements in tests of the page
    """

    job: str
    tab: str
    word: str
    samples: Mapping[str, str]
    kept: str
    mark: str


STUDIES = Kind(
    job="sweep", tab="studies", word="study", samples=studydraft.SAMPLES, mark="",
    kept="variables (empty: all without a time axis)",
)  # fmt: skip
DISPERSIONS = Kind(
    job="disperse", tab="disperse", word="dispersion", samples=studydraft.DISPERSED, mark="dispersion-",
    kept="results, one or more; margins too",
)  # fmt: skip


class StudyPanel:
    """The panel, and what is shown of a study beside it.

    Parameters
    ----------
    page : Context
    kind : Kind, of studies that it writes
    """

    def __init__(self, page: Context, kind: Kind = STUDIES) -> None:
        self.page, self.studio, self.kind = page, page.studio, kind
        self.view = StudyView(page, self.edit)
        self._wrong: dict[str, str] = {}  # fields that cannot be read: key and field -> sentence
        self._error = ""
        self._asked = 0
        self._timer: ui.timer | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._errors: dict[str, ui.label] = {}
        self._responses: list[str] = []
        with ui.element("div").classes("ev-scroll"):
            self._done = ui.element("div").classes("ev-part")
            self._head = ui.element("div").classes("ev-part")
            self._body = ui.element("div").classes("ev-part")
        with ui.element("div").classes("ev-foot"):
            self._go = ui.button(f"Run the {kind.word}", on_click=self._submit)
            self._go.props(f"unelevated color=primary {self._mark('run-study')}")
            self._guess = ui.button("Estimate", on_click=self._estimate)
            self._guess.props(f"outline color=primary {self._mark('estimate')}")
            self._guess.tooltip("runs a few cases of the study and measures their time")
            ui.button("Save as", on_click=self._save).props(f"flat dense color=primary {self._mark('save-study')}")
            ui.button("YAML", on_click=self._text).props(f"flat dense color=primary {self._mark('yaml-of-study')}")
            self._state = ui.label("").classes("ev-status ev-wrap").props(f"{self._mark('state-of-study')}")
        ui.context.client.on_disconnect(self._end)
        self.draw()

    @property
    def draft(self) -> StudyDraft:
        """The study in the form."""
        return self.studio.studies[self.kind.job]

    @draft.setter
    def draft(self, draft: StudyDraft) -> None:
        self.studio.studies[self.kind.job] = draft

    def _mark(self, name: str) -> str:
        """The name of an element in tests of the page, among its properties."""
        return f'data-testid="{self.kind.mark}{name}"'

    # -------------------------------------------------------------------------------------------- the form

    def draw(self) -> None:
        """Draw the panel again."""
        self._follow()
        self._wrong, self._error, self._responses = {}, "", []
        self._draw_head()
        self._draw_form()
        self._draw_done()
        self._changed()

    def list(self) -> None:
        """Take the case that is open, and list the studies again; what is the same stays under the mouse."""
        if self._follow():
            self._draw_form()
            self._changed()
        if self._sources() != self._listed:
            self._draw_head()
        if self.studio.folder.studies() != self._finished:
            self._draw_done()
        self._schedule()

    def _follow(self) -> bool:
        """Take the case that is open, where the study is of that one; returns whether it is another than before."""
        try:
            return self.studio.follow_case(self.kind.job)
        except (EvolventError, OSError):  # the check says what is wrong with it
            return False

    def edit(self, content: Any, about: str) -> None:
        """Put a study into the form.

        Parameters
        ----------
        content : mapping, or YAML
        """

        def take() -> None:
            raw = reading.content(content, about) if isinstance(content, str) else content
            self.draft = studydraft.of_content(raw, about)

        if self.page.attempt(take):
            self.draw()
            self.page.open_tab(self.kind.tab)

    def _sources(self) -> dict[str, str]:
        found = self.studio.study_sources(self.kind.job)
        return found if self.draft.source in found else {self.draft.source: self.draft.about, **found}

    def _draw_head(self) -> None:
        self._listed = self._sources()
        self._head.clear()
        with self._head:
            chosen = ui.select(
                self._listed, value=self.draft.source, label=f"{self.kind.word} or YAML file of the folder"
            )
            chosen.props(f"outlined dense options-dense {self._mark('study')}").classes("w-full")
            chosen.on_value_change(lambda e: self._choose(str(e.value)))
            if self.draft.source.startswith("case:"):
                ui.label(self.draft.about).classes("ev-what")

    def _draw_done(self) -> None:
        self._finished = self.studio.folder.studies()
        self._done.clear()
        with self._done:
            if not self._finished:
                return
            ui.label("results in the folder").classes("ev-h").style("margin-top:0")
            with ui.element("div").classes("ev-results"):
                for name in self._finished:
                    link = ui.element("button").classes("ev-link").props("type=button")
                    link.props["data-testid"] = f"{self.kind.mark}study-{name}"
                    with link:
                        ui.label(name)
                    link.on("click", lambda n=name: self.page.show(View("study", (f"file:{n}",))))
            ui.label("write and run").classes("ev-h")

    def _draw_form(self) -> None:
        content, self._errors = self.draft.content, {}
        try:
            case = studydraft.case_of(self.studio.folder, self.draft)
        except (EvolventError, OSError):
            case = {}
        self._case, self._keys = case, studydraft.keys(case)
        self._body.clear()
        with self._body:
            self._banner = ui.label("").classes("ev-banner bad").props(f"{self._mark('error-of-study')} role=alert")
            self._banner.set_visibility(False)
            self._name()
            self._draw_case()
            sample, samples = str(content.get("sample", "grid")), self.kind.samples
            if sample not in samples:
                samples = {sample: studydraft.DISPERSED.get(sample, sample), **samples}
            ways = ui.select(dict(samples), value=sample)
            ways.props(f'outlined dense options-dense label="sampling" {self._mark("sample")}').classes("w-full")
            ways.on_value_change(lambda e: self._take(studydraft.with_sample(content, str(e.value))))
            if sample not in ("grid", "list"):
                with ui.element("div").classes("ev-two-fields"):
                    if sample != "corners":
                        self._plain("samples", "number of samples")
                    self._plain("seed", "seed")
            ui.label("keys that vary").classes("ev-h")
            over: dict[str, Any] = content.get("over") or {}
            for place, key in enumerate(over):
                self._axis(place, str(key), over[key], sample)
            add = ui.button("Add a key", icon="add", on_click=self._add).props("flat dense color=primary size=sm")
            add.props(f"{self._mark('add-key')}").style("align-self:flex-start")
            ui.label("results kept of every case").classes("ev-h")
            self._draw_keep()
            self._blocks()

    def _name(self) -> None:
        with ui.element("div").classes("ev-field"):
            with ui.element("div").classes("ev-name"):
                ui.label("name")
            typed = ui.input(value=str(self.draft.content.get("study", "study")))
            typed.props(f'outlined dense spellcheck=false {self._mark("name-of-study")} aria-label="name of the study"')
            typed.on_value_change(lambda e: self._put("study", str(e.value or "").strip()))

    def _draw_case(self) -> None:
        case = self.draft.content.get("case")
        known = {studydraft.OPEN_CASE: f"the open case: {self.studio.open_case_title()}"}
        known |= {name: name for name in cases.built_in()}
        known |= {name: name for name, found in self.studio.folder.yaml().items() if found.keys & {"system", "parts"}}
        value = case if isinstance(case, str) else studydraft.OWN_CASE
        if self.draft.follows:
            value = studydraft.OPEN_CASE
        elif value not in known:
            known = {value: "keys in the study itself" if value == studydraft.OWN_CASE else str(value), **known}
        if not isinstance(case, str):
            self._own = case
        chosen = ui.select(known, value=value, label="case")
        chosen.props(f"outlined dense options-dense {self._mark('case-of-study')}").classes("w-full")
        chosen.on_value_change(lambda e: self._choose_case(str(e.value)))

    def _choose_case(self, name: str) -> None:
        follows = name == studydraft.OPEN_CASE
        case = self.studio.open_case_named() if follows else self._own if name == studydraft.OWN_CASE else name

        def take() -> None:
            content = studydraft.with_case(self.studio.folder, self.draft, case)
            self.draft = dataclasses.replace(self.draft, content=content, follows=follows)

        self.page.attempt(take)
        self._take(self.draft.content)

    def _plain(self, key: str, name: str) -> None:
        """A whole number of the study."""
        with ui.element("div"):
            value = self.draft.content.get(key)
            typed = ui.input(name, value="" if value is None else form.text_of(value))
            typed.props(f"outlined dense {self._mark(f'{key}-of-study')}").classes("w-full")
            self._errors[key] = ui.label("").classes("ev-error")
        typed.on_value_change(lambda e: self._read(key, key, str(e.value or ""), self._put))

    # -------------------------------------------------------------------------------------------- a key that varies

    def _axis(self, place: int, key: str, given: Any, sample: str) -> None:
        over = self.draft.content["over"]
        options = [name for name in self._keys if name == key or name not in over]
        if key and key not in options:
            options.insert(0, key)
        unit, text = self._keys.get(key, ("", ""))
        with ui.element("div").classes("ev-axis").props(f"{self._mark(f'axis-{place}')}"):
            with ui.element("div").classes("ev-row"):
                chosen = ui.select(
                    options, value=key or None, label="key", with_input=True, new_value_mode="add-unique"
                )
                chosen.props(f"outlined dense options-dense {self._mark(f'axis-key-{place}')}")
                chosen.style("flex:1;min-width:0")
                chosen.on_value_change(lambda e: self._rename(key, str(e.value or "").strip()))
                drop = ui.button(icon="close", on_click=lambda: self._drop(key)).props("flat dense round size=sm")
                drop.props(f'{self._mark(f"axis-drop-{place}")} aria-label="remove the key"')
            way, ways = studydraft.way_of(given, sample), studydraft.WAYS.get(sample, studydraft.WAYS["grid"])
            with ui.element("div").classes("ev-fields"):
                if len(ways) > 1 and (way != "text" or self.kind is STUDIES):
                    how = ui.select(ways, value=way).props("outlined dense options-dense")
                    how.props(f'{self._mark(f"axis-way-{place}")} aria-label="how its values are given"').classes(
                        "ev-way"
                    )
                    how.on_value_change(lambda e: self._give(key, studydraft.changed_way(given, str(e.value))))
                if way == "values":
                    self._values(place, key, given)
                elif way == "text":
                    self._distribution(place, key, given)
                else:
                    for name in studydraft.FIELDS[way]:
                        self._end_of(place, key, name, given)
                    if way == "range":
                        spacing = ui.select(["linear", "log"], value=given.get("spacing", "linear"), label="spacing")
                        spacing.props(f"outlined dense options-dense {self._mark(f'axis-{place}-spacing')}")
                        spacing.on_value_change(lambda e: self._put_end(key, "spacing", str(e.value)))
            now = studydraft.value_at(self._case, key)
            notes = [f"{form.text_of(now)} in the case" if now is not None and not isinstance(now, Mapping) else "",
                     f"a plain number is in {unit}" if unit else ""]  # fmt: skip
            if any(notes):
                ui.label("; ".join(note for note in notes if note)).classes("ev-what").tooltip(text)
            self._errors[f"over.{key}"] = ui.label("").classes("ev-error").props(f"{self._mark(f'axis-error-{place}')}")

    def _values(self, place: int, key: str, given: Any) -> None:
        typed = ui.input(value=studydraft.written_values(given), placeholder=_HELP["values"])
        typed.props(
            f'outlined dense spellcheck=false {self._mark(f"axis-{place}-values")} aria-label="values of the key"'
        )
        typed.classes("ev-grow")

        def take(_: str, values: Any) -> None:
            self._over(key, values)

        typed.on_value_change(lambda e: self._read(f"over.{key}", f"over.{key}", f"[{e.value or ''}]", take))

    def _distribution(self, place: int, key: str, given: Any) -> None:
        typed = ui.input(value=str(given), placeholder=studydraft.FIRST_TEXT)
        typed.props('outlined dense spellcheck=false aria-label="distribution of the key"').classes("ev-grow")
        typed.props["data-testid"] = f"{self.kind.mark}axis-{place}-text"
        typed.tooltip(_DISTRIBUTIONS)
        typed.on_value_change(lambda e: self._over(key, str(e.value or "").strip()))

    def _end_of(self, place: int, key: str, name: str, given: Any) -> None:
        value = given.get(name, "") if isinstance(given, Mapping) else ""
        typed = ui.input(name, value=form.text_of(value)).props("outlined dense spellcheck=false")
        typed.props(f"{self._mark(f'axis-{place}-{name}')}").tooltip(_HELP[name])

        def take(_: str, read: Any) -> None:
            self._put_end(key, name, read)

        typed.on_value_change(lambda e: self._read(f"over.{key}", f"over.{key}.{name}", str(e.value or ""), take))

    def _over(self, key: str, given: Any) -> None:
        self.draft.content["over"][key] = given
        self._changed()

    def _put_end(self, key: str, name: str, value: Any) -> None:
        given = dict(self.draft.content["over"][key])
        given[name] = value
        if name == "spacing" and value == "linear":
            given.pop("spacing")
        self._over(key, given)

    def _give(self, key: str, given: Any) -> None:
        self._take({**self.draft.content, "over": {**self.draft.content["over"], key: given}})

    def _rename(self, old: str, new: str) -> None:
        over = self.draft.content["over"]
        if not new or new == old or new in over:
            return
        sample = str(self.draft.content.get("sample", "grid"))
        now = studydraft.value_at(self._case, new)
        given = [] if now is None or isinstance(now, Mapping) else [now]
        ways = studydraft.WAYS.get(sample, studydraft.WAYS["grid"])
        if "values" not in ways:
            given = studydraft.changed_way(given, "text" if self.kind is DISPERSIONS else next(iter(ways)))
        self._take({**self.draft.content, "over": {new if k == old else k: given if k == old else v
                                                   for k, v in over.items()}})  # fmt: skip

    def _drop(self, key: str) -> None:
        over = {k: v for k, v in self.draft.content["over"].items() if k != key}
        self._take({**self.draft.content, "over": over})

    def _add(self) -> None:
        over = self.draft.content.get("over") or {}
        if "" not in over:
            self._take({**self.draft.content, "over": {**over, "": []}})

    # -------------------------------------------------------------------------------------------- the rest

    def _draw_keep(self) -> None:
        keep = [str(name) for name in self.draft.content.get("keep") or []]
        self._keep = ui.select(
            [*dict.fromkeys([*keep, *self._responses])], multiple=True, with_input=True, value=keep,
            new_value_mode="add-unique", label=self.kind.kept,
        )  # fmt: skip
        self._keep.props(f"outlined dense options-dense use-chips {self._mark('keep')}").classes("w-full")
        self._keep.on_value_change(lambda e: self._put("keep", list(e.value or [])))

    def _blocks(self) -> None:
        """Mappings and lists of the study that are typed as YAML."""
        hints = {"set": "blade.nodes: 20", "stages": "- {name: wind, set: {phase: wind}}"}
        hints |= {"correlation": "- [first key, second key, 0.5]"} if self.kind is DISPERSIONS else {}
        for key, hint in hints.items():
            name = "set in every case" if key == "set" else key
            value = self.draft.content.get(key)
            with ui.expansion(name, value=bool(value)).classes("ev-group").props(f"dense {self._mark(f'block-{key}')}"):
                written = studydraft.block(value) if value else ""
                typed = ui.textarea(value=written, placeholder=hint).props("autogrow outlined dense spellcheck=false")
                typed.props(f'{self._mark(f"{key}-of-study")} aria-label="{name}"').classes("w-full ev-mono")
                self._errors[key] = ui.label("").classes("ev-error")
                typed.on_value_change(lambda e, k=key: self._read(k, k, str(e.value or ""), self._put))

    def _read(self, row: str, where: str, text: str, take: Any) -> None:
        """Read what was typed in a field; an error is shown beside it."""
        try:
            value = form.value_of(text, where) if text.strip() else None
        except InputError as error:
            self._wrong[row] = str(error)
            self._changed()
            return
        self._wrong.pop(row, None)
        take(row, value)

    def _put(self, key: str, value: Any) -> None:
        if value in (None, "", [], {}):
            self.draft.content.pop(key, None)
        else:
            self.draft.content[key] = value
        self._changed()

    def _take(self, content: dict[str, Any]) -> None:
        """Another form: draw it again."""
        self.draft.content = content
        self._wrong = {}
        self._draw_form()
        self._changed()

    def _choose(self, source: str) -> None:
        if source == self.draft.source:
            return

        def take() -> None:
            self.draft = studydraft.opened(self.studio.folder, source)

        self.page.attempt(take)
        self.draw()

    # -------------------------------------------------------------------------------------------- checking

    def _changed(self) -> None:
        """Show the number of cases now, and check the study after a pause."""
        self._error = ""
        if "" in (self.draft.content.get("over") or {}):
            self._wrong["over."] = "choose a key"
        self._show()
        self._schedule()

    def _schedule(self) -> None:
        self._asked += 1
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        count = studydraft.count(self.draft.content)
        if self.studio.tab != self.kind.tab or self._wrong or count is None or count > _CHECKED:
            return
        with self._done:
            self._timer = ui.timer(_PAUSE, self._check, once=True)

    async def _check(self) -> None:
        asked, self._timer = self._asked, None
        draft = dataclasses.replace(self.draft, content=dict(self.draft.content))

        def read() -> list[str]:
            with self.studio.computing:
                return studydraft.responses(self.studio.folder, draft)

        try:
            found, error = await asyncio.to_thread(read), ""
        except EvolventError as problem:
            found, error = [], str(problem)
        if asked != self._asked or self._body.is_deleted:
            return
        self._error = error
        if not error and found != self._responses:
            self._responses = found
            self._keep.set_options([*dict.fromkeys([*(self._keep.value or []), *found])], value=self._keep.value)
        self._show()

    def _show(self, note: str = "") -> None:
        """Show what is wrong, or the number of cases."""
        loose, count = self._error, studydraft.count(self.draft.content)
        beside = dict(self._wrong)
        own = max((row for row in self._errors if names_key(loose, row)), key=len, default="")
        if loose and own:
            beside[own], loose = loose, ""
        for row, shown in self._errors.items():
            shown.set_text(as_sentence(beside.get(row, "")))
        self._banner.set_text(as_sentence(loose))
        self._banner.set_visibility(bool(loose))
        broken = bool(self._wrong or self._error)
        self._go.set_enabled(not broken)
        self._guess.set_enabled(not broken or self._process is not None)
        self._state.set_text(note or ("" if count is None else cases_text(count)))

    # -------------------------------------------------------------------------------------------- what is done with it

    def _asked_study(self) -> Any:
        """The checked study, in a thread: it reads every case."""
        from evolvent.design.dispersions import dispersed
        from evolvent.design.studies import runner

        runner.check_installed()
        with self.studio.computing:
            asked = studydraft.read(self.studio.folder, self.draft)
        if self.kind is DISPERSIONS:
            dispersed.check(asked)
            if not asked.keep:
                raise InputError("keep is empty; choose one or more results, such as a margin or a time of latching")
        return asked

    async def _submit(self) -> None:
        self._go.props("loading")
        try:
            asked = await asyncio.to_thread(self._asked_study)
            self.studio.folder.placed(cases.parse_yaml(asked.text, asked.name))
        except EvolventError as error:
            self._error = str(error)
            self._show()
            self.page.show_message(str(error))
            return
        finally:
            self._go.props(remove="loading")
        job = self.studio.jobs.add(self.kind.job, asked.name, case=asked.text)
        self.page.show(view_of(job), tab="runs")

    async def _estimate(self) -> None:
        """Compute a few cases in its own process; the same button cancels it."""
        if self._process is not None:
            self._end()
            return
        self._guess.props("loading")
        try:
            asked = await asyncio.to_thread(self._asked_study)
            self._process = await asyncio.create_subprocess_exec(
                sys.executable, "-P", "-m", "evolvent.studio.estimate", cwd=tempfile.gettempdir(),
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
            )  # fmt: skip
        except EvolventError as error:
            self.page.show_message(str(error))
            return
        except OSError as error:
            self.page.show_message(f"no process can be started: {error.strerror}")
            return
        finally:
            self._guess.props(remove="loading")
        self._guess.set_text("Cancel")
        self._show(f"{cases_text(asked.count)}; computing one of them")
        process = self._process
        content, _ = await process.communicate(asked.text.encode())
        self._process = None
        if self._body.is_deleted:
            return
        self._guess.set_text("Estimate")
        self._show(estimated_text(asked.count, content))

    def _end(self) -> None:
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()

    def _text(self) -> None:
        name = f"{self.draft.content.get('study', self.kind.word)}.yaml"
        self.page.show_text(f"The {self.kind.word} as a file", studydraft.text(self.draft), name)

    def _save(self) -> None:
        own = self.draft.source.removeprefix("file:") if self.draft.source.startswith("file:") else ""

        def keep(name: str) -> str:
            folder = self.studio.folder
            name = name.strip()
            path = folder.inside(name) if own and name == own else folder.new(name, ".yaml")
            text = studydraft.text(self.draft, pathlib.PurePosixPath(folder.name(path)).parent)
            path.write_text(text, encoding="utf-8")
            saved = folder.name(path)
            self.draft = dataclasses.replace(self.draft, source=f"file:{saved}", about=saved)
            self._draw_head()
            return saved

        name = own or f"{self.draft.content.get('study', self.kind.word)}.yaml"
        self.page.ask_name(f"Save the {self.kind.word} in the working folder", name, keep)
