"""Parts on the page: a card each with the form of its keys, and what adds, renames, duplicates and removes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from evolvent.parts import repetition
from evolvent_studio import form, parts
from evolvent_studio.addview import AddView
from evolvent_studio.context import Context
from evolvent_studio.formview import FormView, errors_text


class PartsView:
    """The parts of a case.

    Parameters
    ----------
    page : Context
    key : str, of the case, that holds them
    content : mapping, what it shows at first: name -> keys of a part
    changed : called after each change
    """

    def __init__(self, page: Context, key: str, content: Any, changed: Callable[[], None]) -> None:
        self.page, self.key, self._changed = page, key, changed
        self.content: parts.Parts = dict(content) if isinstance(content, Mapping) else {}
        self._wrong = {} if isinstance(content, Mapping | None) else parts.problems(content, key)
        self._open: set[str] = set()
        self._cards: dict[str, _Card] = {}
        with ui.element("div").classes("ev-row"):
            ui.label("parts").classes("ev-h")
            self._count = ui.label("").classes("ev-status")
            ui.element("div").style("flex:1")
            add = ui.button("Add a part", icon="add", on_click=self._ask_kind)
            add.props('flat dense size=sm color=primary data-testid="add-part"')
        self._list = ui.element("div").classes("ev-part").props('data-testid="parts"')
        self.draw()

    def draw(self) -> None:
        """Draw the cards of all parts."""
        self._list.clear()
        self._cards = {}
        with self._list:
            for name in self.content:
                self._cards[name] = _Card(self, name, is_open=name in self._open)
        self._counted()

    def problems(self) -> dict[str, str]:
        """What is wrong with the parts: dotted key -> sentence."""
        return self._by_key({name: card.wrong for name, card in self._cards.items()})

    def shown_problems(self) -> dict[str, str]:
        """Those of the problems that are shown."""
        return self._by_key({name: card.shown for name, card in self._cards.items()})

    def _by_key(self, wrong: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
        """Problems of each part as problems of the case."""
        if not self.content:
            return self._wrong
        return {f"{self.key}.{part}.{own}".rstrip("."): text for part, of in wrong.items() for own, text in of.items()}

    def show_all(self) -> None:
        """Show all problems, also of fields that were not touched."""
        for card in self._cards.values():
            card.show_all()

    def note(self, sentence: str) -> None:
        """Show what the assembly of the parts found, beside the key that it names; '' for nothing."""
        about, _, key = parts.named_in(sentence, self.content).partition(".")
        for name, card in self._cards.items():
            card.note({key: sentence} if sentence and name == about else {})

    def flush(self) -> None:
        """Check now what was typed a moment ago."""
        for card in self._cards.values():
            card.flush()

    # -------------------------------------------------------------------------------------------- what cards call

    def part_changed(self, name: str, content: dict[str, Any]) -> None:
        """A part has other keys."""
        self.content[name] = content
        self._changed()

    def opened(self, name: str, on: bool) -> None:
        """A card was opened or closed."""
        (self._open.add if on else self._open.discard)(name)

    def remove(self, name: str) -> None:
        """Take a part out; parts that refer to it stay, and the start says that they do."""
        left = parts.referring(self.content, name)
        del self.content[name]
        self._open.discard(name)
        self._cards.pop(name).delete()
        self._after()
        if left:
            ui.notify(f"{', '.join(left)} still refer{'s' if len(left) == 1 else ''} to {name}", position="bottom")

    def duplicate(self, name: str) -> None:
        """Add a copy of a part."""
        self._add({parts.proposed_name(self.content, name): self.content[name]})

    def ask_name(self, name: str) -> None:
        """Ask what a part is to be called."""
        self.page.ask(
            f"Rename {name}", name, lambda new: self._rename(name, new), word="Rename",
            marks=("part-name", "part-done"), note="References to it in other parts follow.",
        )  # fmt: skip

    def _rename(self, old: str, new: str) -> None:
        self.flush()
        self.content = parts.renamed(self.content, old, new)
        self._open = {new.strip() if name == old else name for name in self._open}
        self.draw()
        self._after()

    # -------------------------------------------------------------------------------------------- adding

    def _ask_kind(self) -> None:
        AddView(
            self.page,
            propose=lambda kind: parts.proposed_name(self.content, kind),
            add=self._add,
            words=lambda: parts.words(self.content),
        )

    def _add(self, added: Mapping[str, Mapping[str, Any]]) -> None:
        """Add parts: all of them, or none where one cannot be."""
        self.flush()
        content = self.content
        for name, keys in added.items():
            content = parts.added(content, name, keys)
        self.content = content
        names = [name.strip() for name in added]
        self._open.add(names[0])
        with self._list:
            for name in names:
                self._cards[name] = _Card(self, name, is_open=name in self._open)
        self._cards[names[0]].show()
        self._after()

    def _after(self) -> None:
        self._counted()
        for card in self._cards.values():
            card.refresh_words()
        self._changed()

    def _counted(self) -> None:
        self._count.set_text(str(len(self.content)) if self.content else "none yet")


class _Card:
    """One part; its form is drawn when the card is opened first."""

    def __init__(self, view: PartsView, name: str, *, is_open: bool) -> None:
        self.view, self.name = view, name
        self._form: FormView | None = None
        self._notes: dict[str, str] = {}
        content = view.content[name]
        self.wrong = parts.part_problems(name, content, view.key)
        self._mark = f"{view.key}.{name}"
        self._root = ui.expansion(value=is_open).classes("ev-group ev-partcard")
        self._root.props("dense")
        self._root.props["data-testid"] = f"part-{name}"  # a name may hold blanks
        with self._root.add_slot("header"), ui.element("div").classes("ev-head"):
            ui.label(name).classes("ev-title ev-cut")
            self._kind = ui.label(_kind_text(content)).classes("ev-status ev-cut")
            self._count = ui.label("").classes("ev-count")
            self._menu()
        with self._root:
            self._body = ui.column().classes("w-full gap-1")
        self._root.on_value_change(lambda e: self._turned(bool(e.value)))
        if is_open:
            self._draw()
        self._counted()

    def _menu(self) -> None:
        with ui.button(icon="more_vert").props("flat dense round size=sm") as button:
            button.props["data-testid"] = f"part-menu-{self.name}"
            button.on("click.stop", lambda: None)
            with ui.menu():
                for text, act in (
                    ("Rename", self.view.ask_name),
                    ("Duplicate", self.view.duplicate),
                    ("Remove", self.view.remove),
                ):
                    ui.menu_item(text, lambda a=act: a(self.name))

    def _turned(self, on: bool) -> None:
        self.view.opened(self.name, on)
        if on and self._form is None:
            self._draw()

    def _draw(self) -> None:
        content = self.view.content[self.name]
        kind = parts.kind_of(content)
        with self._body:
            if kind is None or "" in self.wrong:
                banner = ui.label(self.wrong.get("", "")).classes("ev-banner bad")
                banner.props["data-testid"] = f"{self._mark}.form-error"
                return
            ui.label(form.describe(kind, flat=True).help).classes("ev-what")
            self._form = FormView(
                kind, content, self._typed, skip=("kind",), before=f"{self._mark}.", flat=True, repeats=True,
                problems=lambda typed: parts.own_problems(typed, kind),
                complete=lambda typed: {"kind": content["kind"], **typed},
                words=lambda: [word for word in parts.words(self.view.content) if not self._own(word)],
            )  # fmt: skip
            self._form.note(self._notes)

    def _own(self, word: str) -> bool:
        return word == self.name or word.startswith(f"{self.name}.")

    def _typed(self, content: dict[str, Any], wrong: dict[str, str]) -> None:
        same = content == self.view.content[self.name] and wrong == self.wrong
        self.wrong = wrong
        self._counted()
        if not same:
            self._kind.set_text(_kind_text(content))
            self.view.part_changed(self.name, content)

    def _counted(self) -> None:
        self._count.set_text(errors_text(len(self.shown) or len(self._notes)))

    @property
    def shown(self) -> dict[str, str]:
        """The errors that are shown: key of its own -> sentence."""
        return self.wrong if self._form is None else self._form.shown

    def show_all(self) -> None:
        """Show all errors, also of fields that were not touched."""
        if self._form is not None:
            self._form.show_all()
            self._counted()

    def note(self, notes: dict[str, str]) -> None:
        """Show what the assembly found of this part: key, '' for the part itself -> sentence."""
        if notes != self._notes:
            self._notes = notes
            if self._form is not None:
                self._form.note(notes)
            self._counted()

    def refresh_words(self) -> None:
        """Offer the names that parts have now."""
        if self._form is not None:
            self._form.refresh_words()

    def flush(self) -> None:
        """Check now what was typed a moment ago."""
        if self._form is not None:
            self._form.flush()

    def show(self) -> None:
        """Bring the card into view."""
        ui.run_javascript(f"document.getElementById('c{self._root.id}')?.scrollIntoView({{block: 'nearest'}})")

    def delete(self) -> None:
        """Take the card off the page."""
        self._root.delete()


def _kind_text(content: Any) -> str:
    """The kind of a part, the type of a joint, and how many parts it stands for."""
    if not isinstance(content, Mapping):
        return ""
    kind = parts.kind_of(content)
    text = str(content.get("kind", ""))
    if kind is not None and "type" in kind.model_fields:
        word = content.get("type", kind.model_fields["type"].default)
        text += f", {word}" if isinstance(word, str) else ""
    if parts.is_repeated(content):
        repeat = content[repetition.KEY]
        text += f", {repeat.get('count', '?')} times" if isinstance(repeat, Mapping) else ""
    return text
