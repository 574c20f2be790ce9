"""Pages of the reference that are written at every build: one a part, one a case, one a command, one a module.

They are the subfolders of docs/reference; what lies in that folder itself is written by hand.
"""

from __future__ import annotations

import importlib
import inspect
import pathlib
from collections import defaultdict
from typing import NamedTuple

from evolvent import cases, sphinxext
from evolvent.parts import registry
from evolvent_base import cli

REFERENCE = pathlib.Path(__file__).resolve().parents[1] / "reference"
#: Packages whose public names are documented by the module that defines them.
PACKAGES = {
    "elements": "evolvent.elements",
    "closed_forms": "evolvent.closed_forms",
    "inertia": "evolvent_massprops.inertia",
    "identification": "evolvent_massprops.identification",
}


class Page(NamedTuple):
    """A page: folder and name of its file, heading, one line on it, and the Markdown below the heading."""

    folder: str
    name: str
    title: str
    line: str
    text: str


def summary(item: object) -> str:
    """First paragraph of a docstring, as one line without marks of code."""
    return " ".join((inspect.getdoc(item) or "").partition("\n\n")[0].split()).replace("`", "")


def part_pages() -> list[Page]:
    """A page for each kind of part: its keys in a case file, and its class."""
    found = []
    for name, part in sorted(registry.kinds().items()):
        documented = f".. autoclass:: evolvent.parts.{part.__name__}\n   :members:\n   :exclude-members: write"
        text = f"## In a case file\n\n{sphinxext.keys_table(name)}\n\n## In Python\n\n{rst(documented)}"
        found.append(Page("parts", name, name, summary(part), text))
    return found


def case_pages() -> list[Page]:
    """A page for each system: the keys of its cases."""
    found = []
    for name in cases.systems():
        text = sphinxext.keys_table(name)
        if name == "structure":
            text += "\n\n`parts` holds the parts by name; [each kind of part](../parts.md) has a page with its keys.\n"
        found.append(Page("cases", name, name, summary(cases.system(name).Case), text))
    return found


def command_pages() -> list[Page]:
    """A page for each command."""
    return [
        Page("commands", name, f"evolvent {name}", cli.commands.get_command(None, name).get_short_help_str(90), text)
        for name in sphinxext.command_names()
        for text in [sphinxext.command_text(name)]
    ]


def module_pages(folder: str, package: str) -> list[Page]:
    """A page for each module that defines public names of a package."""
    names = defaultdict(list)
    home = importlib.import_module(package)
    for name in home.__all__:
        item = getattr(home, name)
        if inspect.isclass(item) or inspect.isroutine(item):
            names[item.__module__].append((name, inspect.isclass(item)))
    found = []
    for module, items in names.items():
        listed = [
            f".. autoclass:: {package}.{name}\n   :members:" if is_class else f".. autofunction:: {package}.{name}"
            for name, is_class in items
        ]
        stem = module.rpartition(".")[2]
        line = summary(importlib.import_module(module))
        text = f"{line}\n\n" + rst("\n".join(listed))
        shown = ", ".join(f"`{name}`" for name, _ in items)
        found.append(Page(folder, stem, stem.replace("_", " ").capitalize(), f"{line} {shown}.", text))
    return found


def rst(text: str) -> str:
    """A block of reStructuredText in Markdown."""
    return f"```{{eval-rst}}\n{text}\n```"


def every() -> list[Page]:
    """All pages."""
    modules = [page for folder, package in PACKAGES.items() for page in module_pages(folder, package)]
    return [*part_pages(), *case_pages(), *command_pages(), *modules]


def write() -> None:
    """Write all pages, and remove those that are no longer among them."""
    pages = {REFERENCE / page.folder / f"{page.name}.md": page for page in every()}
    for path in REFERENCE.glob("*/*.md"):
        if path not in pages:
            path.unlink()
    for path, page in pages.items():
        path.parent.mkdir(exist_ok=True)
        line = "" if page.folder in PACKAGES.keys() | {"commands"} or not page.line else f"{page.line}\n\n"
        path.write_text(f"# {page.title}\n\n{line}{page.text}\n", encoding="utf-8")
