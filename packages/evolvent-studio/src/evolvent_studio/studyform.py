"""The form of a study: its case, how it is sampled, the keys that vary, and what is kept of every case."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from evolvent import cases
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import form, studydraft
from evolvent_studio.context import Context
from evolvent_studio.studydraft import StudyDraft

_HELP = {
    "values": "such as 0.1, 0.2 N m",
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

    def marked(self, name: str) -> str:
        """The name of an element in tests of the page, among its properties."""
        return f'data-testid="{self.mark}{name}"'


STUDIES = Kind(
    job="sweep", tab="studies", word="study", samples=studydraft.SAMPLES, mark="",
    kept="variables (empty: all without a time axis)",
)  # fmt: skip
DISPERSIONS = Kind(
    job="disperse", tab="disperse", word="dispersion", samples=studydraft.DISPERSED, mark="dispersion-",
    kept="results, one or more; margins too",
)  # fmt: skip


class StudyForm:
    """The form.

    Parameters
    ----------
    page : Context
    kind : Kind, of studies that it writes
    body : ui.element, in which it is drawn
    changed : called when the study has changed
    """

    def __init__(self, page: Context, kind: Kind, body: ui.element, changed: Callable[[], None]) -> None:
        self.page, self.studio, self.kind = page, page.studio, kind
        self.wrong: dict[str, str] = {}  # fields that cannot be read: key and field -> sentence
        self.errors: dict[str, ui.label] = {}
        self.responses: list[str] = []  # results that can be kept
        self._body, self._changed = body, changed

    @property
    def draft(self) -> StudyDraft:
        """The study in the form."""
        return self.studio.studies[self.kind.job]

    @draft.setter
    def draft(self, draft: StudyDraft) -> None:
        self.studio.studies[self.kind.job] = draft

    def draw(self) -> None:
        """Draw the form again."""
        content, self.errors = self.draft.content, {}
        try:
            case = studydraft.case_of(self.studio.folder, self.draft)
        except (EvolventError, OSError):
            case = {}
        self._case, self._keys = case, studydraft.keys(case)
        self._body.clear()
        with self._body:
            self.banner = (
                ui.label("").classes("ev-banner bad").props(f"{self.kind.marked('error-of-study')} role=alert")
            )
            self.banner.set_visibility(False)
            self._name()
            self._draw_case()
            sample, samples = str(content.get("sample", "grid")), self.kind.samples
            if sample not in samples:
                samples = {sample: studydraft.DISPERSED.get(sample, sample), **samples}
            ways = ui.select(dict(samples), value=sample)
            ways.props(f'outlined dense options-dense label="sampling" {self.kind.marked("sample")}').classes("w-full")
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
            add.props(self.kind.marked("add-key")).style("align-self:flex-start")
            ui.label("results kept of every case").classes("ev-h")
            self._draw_keep()
            self._blocks()

    def _name(self) -> None:
        with ui.element("div").classes("ev-field"):
            with ui.element("div").classes("ev-name"):
                ui.label("name")
            typed = ui.input(value=str(self.draft.content.get("study", "study")))
            typed.props(
                f'outlined dense spellcheck=false {self.kind.marked("name-of-study")} aria-label="name of the study"'
            )
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
        chosen.props(f"outlined dense options-dense {self.kind.marked('case-of-study')}").classes("w-full")
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
            typed.props(f"outlined dense {self.kind.marked(f'{key}-of-study')}").classes("w-full")
            self.errors[key] = ui.label("").classes("ev-error")
        typed.on_value_change(lambda e: self._read(key, key, str(e.value or ""), self._put))

    def _axis(self, place: int, key: str, given: Any, sample: str) -> None:
        over = self.draft.content["over"]
        options = [name for name in self._keys if name == key or name not in over]
        if key and key not in options:
            options.insert(0, key)
        unit, text = self._keys.get(key, ("", ""))
        with ui.element("div").classes("ev-axis").props(self.kind.marked(f"axis-{place}")):
            with ui.element("div").classes("ev-row"):
                chosen = ui.select(
                    options, value=key or None, label="key", with_input=True, new_value_mode="add-unique"
                )
                chosen.props(f"outlined dense options-dense {self.kind.marked(f'axis-key-{place}')}")
                chosen.style("flex:1;min-width:0")
                chosen.on_value_change(lambda e: self._rename(key, str(e.value or "").strip()))
                drop = ui.button(icon="close", on_click=lambda: self._drop(key)).props("flat dense round size=sm")
                drop.props(f'{self.kind.marked(f"axis-drop-{place}")} aria-label="remove the key"')
            way, ways = studydraft.way_of(given, sample), studydraft.WAYS.get(sample, studydraft.WAYS["grid"])
            with ui.element("div").classes("ev-fields"):
                if len(ways) > 1 and (way != "text" or self.kind is STUDIES):
                    how = ui.select(ways, value=way).props("outlined dense options-dense")
                    how.props(f'{self.kind.marked(f"axis-way-{place}")} aria-label="how its values are given"').classes(
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
                        spacing.props(f"outlined dense options-dense {self.kind.marked(f'axis-{place}-spacing')}")
                        spacing.on_value_change(lambda e: self._put_end(key, "spacing", str(e.value)))
            now = studydraft.value_at(self._case, key)
            notes = [f"{form.text_of(now)} in the case" if now is not None and not isinstance(now, Mapping) else "",
                     f"a plain number is in {unit}" if unit else ""]  # fmt: skip
            if any(notes):
                ui.label("; ".join(note for note in notes if note)).classes("ev-what").tooltip(text)
            self.errors[f"over.{key}"] = ui.label("").classes("ev-error").props(self.kind.marked(f"axis-error-{place}"))

    def _values(self, place: int, key: str, given: Any) -> None:
        typed = ui.input(value=studydraft.written_values(given), placeholder=_HELP["values"])
        typed.props(
            f'outlined dense spellcheck=false {self.kind.marked(f"axis-{place}-values")} aria-label="values of the key"'
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
        typed.props(self.kind.marked(f"axis-{place}-{name}")).tooltip(_HELP[name])

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

    def _draw_keep(self) -> None:
        keep = [str(name) for name in self.draft.content.get("keep") or []]
        self._keep = ui.select(
            [*dict.fromkeys([*keep, *self.responses])], multiple=True, with_input=True, value=keep,
            new_value_mode="add-unique", label=self.kind.kept,
        )  # fmt: skip
        self._keep.props(f"outlined dense options-dense use-chips {self.kind.marked('keep')}").classes("w-full")
        self._keep.on_value_change(lambda e: self._put("keep", list(e.value or [])))

    def _blocks(self) -> None:
        """Mappings and lists of the study that are typed as YAML."""
        hints = {"set": "blade.nodes: 20", "stages": "- {name: wind, set: {phase: wind}}"}
        hints |= {"correlation": "- [first key, second key, 0.5]"} if self.kind is DISPERSIONS else {}
        for key, hint in hints.items():
            name = "set in every case" if key == "set" else key
            value = self.draft.content.get(key)
            with (
                ui.expansion(name, value=bool(value))
                .classes("ev-group")
                .props(f"dense {self.kind.marked(f'block-{key}')}")
            ):
                written = studydraft.block(value) if value else ""
                typed = ui.textarea(value=written, placeholder=hint).props("autogrow outlined dense spellcheck=false")
                typed.props(f'{self.kind.marked(f"{key}-of-study")} aria-label="{name}"').classes("w-full ev-mono")
                self.errors[key] = ui.label("").classes("ev-error")
                typed.on_value_change(lambda e, k=key: self._read(k, k, str(e.value or ""), self._put))

    def _read(self, row: str, where: str, text: str, take: Any) -> None:
        """Read what was typed in a field; an error is shown beside it."""
        try:
            value = form.value_of(text, where) if text.strip() else None
        except InputError as error:
            self.wrong[row] = str(error)
            self._changed()
            return
        self.wrong.pop(row, None)
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
        self.wrong = {}
        self.draw()
        self._changed()

    def offer(self, names: list[str]) -> None:
        """Offer other results that can be kept."""
        self.responses = names
        self._keep.set_options([*dict.fromkeys([*(self._keep.value or []), *names])], value=self._keep.value)
