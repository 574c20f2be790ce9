"""A form on the page: a row for each field, help while one types, errors beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from nicegui import ui

from evolvent import cases
from evolvent_base.schema import Section
from evolvent_studio import form, tables
from evolvent_studio.form import Field, Group

#: Seconds after the last key before what was typed is checked.
_PAUSE = 0.1


def errors_text(count: int) -> str:
    """A number of errors, as words; '' for none."""
    return "" if not count else "1 error" if count == 1 else f"{count} errors"


def first_error(wrong: Mapping[str, str]) -> str:
    """The first error as a sentence that names its key."""
    key, sentence = next(iter(wrong.items()))
    return sentence if not key or sentence.startswith(key) else f"{key}: {sentence}"


class FormView:
    """The form of a case, or of another section.

    Parameters
    ----------
    kind : the pydantic model
    content : what it shows at first
    changed : called with the content, and what is wrong with it, after each change
    skip : dotted keys that the form leaves out
    complete : puts into the content what the form does not hold
    before : str, put before keys in marks of the page, such as "parts.boom."
    flat : bool, whether inner sections are single fields, written as YAML mappings
    folds : bool, whether fields at their defaults are folded away where `flat`
    words : returns what a field may be that refers to other parts
    middle : draws what stands between the fields and the sections
    elsewhere : keys among those of `skip` whose errors are shown elsewhere
    repeats : bool, whether a section says how a part is repeated
    problems : finds what is wrong with the content, dotted key -> sentence; by the model unless given
    """

    def __init__(
        self,
        kind: type[Section],
        content: Mapping[str, Any],
        changed: Callable[[dict[str, Any], dict[str, str]], None],
        *,
        skip: tuple[str, ...] = (),
        complete: Callable[[dict[str, Any]], dict[str, Any]] = dict,
        before: str = "",
        flat: bool = False,
        folds: bool = True,
        words: Callable[[], Sequence[str]] = tuple,
        middle: Callable[[], None] = lambda: None,
        elsewhere: tuple[str, ...] = (),
        repeats: bool = False,
        problems: Callable[[dict[str, Any]], dict[str, str]] | None = None,
    ) -> None:
        self.kind, self._complete, self._changed = kind, complete, changed
        self._elsewhere, self._before, self._words = elsewhere, before, words
        self._problems = problems or (lambda content: cases.problems(content, kind))
        self.form = form.describe(kind, skip=skip, flat=flat, repeats=repeats)
        self._defaults = {field.key: field.default for field in self.form.fields()}
        self._conditional = [field for field in self.form.fields() if field.when]
        self._folded: list[tuple[ui.element, ui.element, ui.label, list[Field]]] = []
        self.texts = form.texts(self.form, content)
        self.given = form.given(self.form, content)
        self._strange = form.unknown_content(
            self.form, content, skip
        )  # it is reported, and left out only if the user confirms
        self._rows: dict[str, ui.element] = {}
        self._errors: dict[str, ui.label] = {}
        self._counts: dict[str, ui.label] = {}
        self._bodies: dict[str, ui.element] = {}
        self._shown: dict[str, str] = {}
        self._found: dict[str, str] = {}
        self._touched: set[str] = set()
        self._all = False  # whether errors of fields are shown that nobody has touched
        self._timer: ui.timer | None = None
        self._notes: dict[str, str] = {}
        self._referring: list[ui.input] = []
        self._curves: dict[str, tuple[ui.element, str]] = {}  # of tables: where each is drawn, and of what text
        self._banner = ui.label("").classes("ev-banner bad").props(f'data-testid="{before}form-error"')
        self._banner.set_visibility(False)
        self._leave = ui.element("button").classes("ev-more").props(f'type=button data-testid="{before}leave-out"')
        with self._leave:
            count = len(self._strange)
            ui.label("Remove this key" if count == 1 else f"Remove these {count} keys")
        self._leave.set_visibility(bool(self._strange))
        self._leave.on("click", self._leave_out)
        self._fields(self.form, fold=flat and folds)
        middle()
        groups = [part for part in self.form.parts if isinstance(part, Group)]
        for group in sorted(groups, key=lambda g: g.whole or not any(f.required for f in g.fields())):
            self._group(group)
        self.check()

    # -------------------------------------------------------------------------------------------- drawing

    def _group(self, group: Group) -> None:
        wanted = any(self.texts.get(f.key) or f.required for f in group.fields())
        expansion = ui.expansion(value=group.key in self.given if group.optional else wanted).classes("ev-group")
        expansion.props(f'dense data-testid="group-{self._before}{group.key}"')
        with expansion.add_slot("header"), ui.element("div").classes("ev-head"):
            if group.optional:
                toggle = ui.checkbox(value=group.key in self.given).props(
                    f'dense size=xs data-testid="give-{self._before}{group.key}"'
                )
                toggle.tooltip("whether the case has it")
                toggle.on("click.stop", lambda: None)
                toggle.on_value_change(lambda e, g=group, x=expansion: self._give(g, bool(e.value), x))
            ui.label(group.name).classes("ev-title")
            self._counts[group.key] = ui.label("").classes("ev-count")
        with expansion:
            ui.label(group.help).classes("ev-what")
            self._errors[group.key] = (
                ui.label("").classes("ev-error").props(f'data-testid="error-{self._before}{group.key}"')
            )
            self._bodies[group.key] = ui.column().classes("w-full gap-1")
            with self._bodies[group.key]:
                self._rows_of(group)
            if group.optional:
                self._bodies[group.key].set_visibility(group.key in self.given)

    def _rows_of(self, group: Group) -> None:
        """What is given or must be, then the rest, folded away."""
        self._fields(group, fold=not group.whole)
        for part in group.parts:
            if isinstance(part, Group):
                self._group(part)

    def _fields(self, group: Group, *, fold: bool) -> None:
        fields = [part for part in group.parts if isinstance(part, Field)]
        given = {f.key for f in fields if not fold or f.required or self.texts.get(f.key)}
        first = [f for f in fields if f.key in given or f.leads(self._defaults)] if given else fields
        rest = [f for f in fields if f not in first]
        for field in first:
            self._row(field)
        if rest:
            more = (
                ui.element("button")
                .classes("ev-more")
                .props(f'type=button data-testid="more-{self._before}{group.key}"')
            )
            with more:
                word = ui.label("")
            body = ui.column().classes("w-full gap-1")
            body.set_visibility(False)
            self._folded.append((more, body, word, rest))

            def turn() -> None:
                body.set_visibility(not body.visible)
                self._count_folded()

            more.on("click", turn)
            with body:
                for field in rest:
                    self._row(field)

    def _count_folded(self) -> None:
        """Say how many fields are folded away, of those that apply."""
        for more, body, word, rest in self._folded:
            count = sum(self._rows[field.key].visible for field in rest)
            more.set_visibility(count > 0)
            word.set_text("fewer" if body.visible else f"{count} more, at their defaults")

    def _show_applicable(self) -> None:
        """Show the fields that apply beside what others hold, and those with an error."""
        for field in self._conditional:
            shown = field.key in self._shown or field.applies(self.texts, self._defaults)
            self._rows[field.key].set_visibility(shown)
        self._count_folded()

    def _row(self, field: Field) -> None:
        with ui.element("div").classes("ev-field" + (" ev-wide" if field.wide else "")) as row:
            self._rows[field.key] = row
            with ui.element("div").classes("ev-name") as name:
                ui.label(field.name)
                if field.unit:
                    ui.label(field.unit).classes("ev-unit")
            name.tooltip(field.help)
            self._input(field)
            if len(field.columns) == 2:
                self._curves[field.key] = ui.element("div").classes("ev-curve"), ""
            ui.label(field.help).classes("ev-help")
            error = ui.label("").classes("ev-error").props(f'data-testid="error-{self._before}{field.key}" role=alert')
            self._errors[field.key] = error

    def _input(self, field: Field) -> None:
        key = f"{self._before}{field.key}"
        mark = f'data-testid="field-{key}" aria-label="{key}"'
        text = self.texts.get(field.key, "")
        if field.kind in ("choice", "switch"):
            choices = field.choices if field.kind == "choice" else ("true", "false")
            options = {choice: choice for choice in choices}
            if not field.required:
                options = {"": f"{field.default} (not set)" if field.default else "not set", **options}
            if text not in options:
                options[text] = text
            chosen = ui.select(options, value=text).props(f"outlined dense options-dense {mark}").classes("w-full")
            chosen.on_value_change(lambda e, f=field: self._typed(f, e.value))
            return
        typed: ui.input | ui.textarea
        if field.wide:
            typed = ui.textarea(value=text, placeholder=field.default).props("autogrow")
        else:
            known = list(field.choices) + (list(self._words()) if field.refers else [])
            typed = ui.input(value=text, placeholder=field.default, autocomplete=known or None)
            if field.refers:
                self._referring.append(typed)
        typed.props(f"outlined dense spellcheck=false autocomplete=off {mark}").classes("w-full")

        def take(value: Any) -> None:
            rows = tables.pasted(str(value or "")) if field.columns else ""
            if rows:
                typed.set_value(rows)  # which comes here again
                typed.update()  # else nothing is sent to a field whose own change is handled
            else:
                self._typed(field, value)

        typed.on_value_change(lambda e: take(e.value))

    # -------------------------------------------------------------------------------------------- typing

    def _typed(self, field: Field, value: Any) -> None:
        self.texts[field.key] = "" if value is None else str(value)
        self._touched.add(field.key)
        if self._conditional:
            self._show_applicable()
        self._schedule()

    def _give(self, group: Group, on: bool, expansion: ui.expansion) -> None:
        (self.given.add if on else self.given.discard)(group.key)
        self._bodies[group.key].set_visibility(on)
        if on:
            expansion.open()
        self._schedule()

    def _leave_out(self) -> None:
        self._strange = {}
        self._leave.set_visibility(False)
        self.check()

    def _schedule(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        with self._banner.parent_slot or ui.element():
            self._timer = ui.timer(_PAUSE, self.check, once=True)

    def flush(self) -> None:
        """Check now what was typed a moment ago."""
        if self._timer is not None:
            self._timer.cancel()
            self.check()

    def check(self) -> None:
        """Check what was typed, and show what is wrong beside it."""
        self._timer = None
        typed, wrong = form.content_of(self.form, self.texts, self.given)
        for key, value in self._strange.items():
            form.put(typed, key, value)
        content = self._complete(typed)
        found = {
            key: sentence
            for key, sentence in form.problems({} if wrong else self._problems(content), wrong).items()
            if not any(key == own or key.startswith(f"{own}.") for own in self._elsewhere)
        }
        self._show(found)
        self._draw_curves()
        self._changed(content, found)

    def _draw_curves(self) -> None:
        """Draw the curves of tables that have changed."""
        columns = {field.key: field.columns for field in self.form.fields()} if self._curves else {}
        for key, (place, drawn) in self._curves.items():
            text = self.texts.get(key, "")
            if text != drawn:
                self._curves[key] = place, text
                place.clear()
                with place:
                    tables.draw_curve(text, columns[key])

    def show_all(self) -> None:
        """Show the errors of all fields from now on, also of those that are empty and were not touched."""
        self._all = True
        self._show(self._found)

    @property
    def shown(self) -> dict[str, str]:
        """The errors that are shown: dotted key -> sentence."""
        return {key: sentence for key, sentence in self._found.items() if self._is_shown(key)}

    def _is_shown(self, key: str) -> bool:
        """Whether an error is shown: not of a field that is empty and was not touched, or of such a section."""
        place = form.nearest_field(self.form, key)
        if self._all or not place or place in self._touched or self.texts.get(place):
            return True
        inner = [f.key for f in self.form.fields() if f.key.startswith(f"{place}.")]
        return any(f in self._touched or self.texts.get(f) for f in inner)

    def note(self, notes: Mapping[str, str]) -> None:
        """Show sentences that were found by another check beside fields without an error of their own; '' for all."""
        if notes != self._notes:
            self._notes = dict(notes)
            self._show(self._found)

    def refresh_words(self) -> None:
        """Offer the names that parts have now."""
        for typed in self._referring:
            typed.set_autocomplete(list(self._words()))

    def _show(self, found: Mapping[str, str]) -> None:
        self._found = dict(found)
        shown: dict[str, str] = {}
        loose = []
        for key, sentence in {**self._notes, **self.shown}.items():
            field = form.nearest_field(self.form, key)
            if field and field not in shown:
                shown[field] = sentence
            elif not field:
                loose.append(sentence)
        for key in {*shown, *self._shown}:
            if shown.get(key) != self._shown.get(key):
                self._errors[key].set_text(shown.get(key, ""))
                row = self._rows.get(key)
                if row is not None:
                    row.classes(add="ev-wrong") if key in shown else row.classes(remove="ev-wrong")
        for key, label in self._counts.items():
            count = sum(k == key or k.startswith(f"{key}.") for k in shown)
            label.set_text(errors_text(count))
        self._shown = shown
        self._show_applicable()
        self._banner.set_text("\n".join(loose))
        self._banner.set_visibility(bool(loose))
