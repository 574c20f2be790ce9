"""Docstrings of this package (parameters with shapes and units, fields of named tuples), gallery, lists of pages."""

from __future__ import annotations

import json
import pathlib
import re
from typing import Any

import pages
from docutils import nodes
from sphinx.util.docutils import SphinxDirective

import evolvent
from evolvent import cases


class CaseGallery(SphinxDirective):
    """``{case-gallery}``: a picture, the command and one line for every built-in case."""

    def run(self) -> list[nodes.Node]:
        """Write a card for each."""
        return self.parse_text_to_nodes(gallery_text())


def gallery_text() -> str:
    """A list of cards in Markdown; pictures are files of the folder images/cases."""
    cards = []
    for name, what in cases.built_in().items():
        image = [f"```{{image}} images/cases/{name}.png", f":alt: {what}", "```"]
        cards += [":::{container} case", *image, "", f"**`evolvent run {name}`**", "", what, ":::", ""]
    return "\n".join(["::::{container} cases", "", *cards, "::::"])


class PageList(SphinxDirective):
    """``{pages} parts``: the pages of a folder of the reference, each with a line on it, as list and in navigation."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Write the list and a hidden table of contents."""
        folder = self.arguments[0]
        found = [page for page in pages.every() if page.folder == folder]
        text = [f"- [{page.title}]({folder}/{page.name}.md): {page.line}" for page in found]
        text += ["", "```{toctree}", ":hidden:", "", *(f"{folder}/{page.name}" for page in found), "```"]
        return self.parse_text_to_nodes("\n".join(text))


class Measured(SphinxDirective):
    """``{measured} comparison.json``: when and with which version the numbers of a page were measured."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Write a sentence."""
        _, path = self.env.relfn2path(self.arguments[0])
        self.env.note_dependency(path)
        return self.parse_text_to_nodes(measured(json.loads(pathlib.Path(path).read_text(encoding="utf-8"))))


def measured(found: dict[str, Any]) -> str:
    """Date and version of a measurement, beside the version of these pages."""
    theirs = found["versions"]["evolvent"]
    text = f"**Measured on {found['date']} with evolvent {theirs}.**"
    if theirs != evolvent.__version__:
        text += f" This is the documentation of evolvent {evolvent.__version__}, which has not been measured."
    return text


def _skip(app: Any, what: str, name: str, item: Any, skip: bool, options: Any) -> bool | None:
    """Fields of named tuples are documented in the docstring of their class."""
    return True if (getattr(item, "__doc__", "") or "").startswith("Alias for field number") else None


def _plain_types(app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """What stands behind a parameter's colon is prose (shape, unit, meaning): text, and no names of classes."""
    descriptions: dict[str, str] = {}
    kept = []
    for line in lines:
        if line.startswith(":type: "):  # napoleon took a property's "what: shape" apart
            kept[0] = f"{line[7:]}: {kept[0]}"
        elif found := re.fullmatch(r":(?:type|vartype) ([^:]+): (.*)", line):
            descriptions[found[1].replace("\\", "")] = found[2]
        else:
            kept.append(line)
    lines[:] = []
    for line in kept:
        found = re.match(r":(param|ivar) ([^:]+):( .*)?$", line)
        prose = descriptions.pop(found[2].replace("\\", ""), "") if found else ""
        if found and prose:
            text = re.sub(r"([*|_])", r"\\\1", prose).replace("\\\\", "\\")
            line = f":{found[1]} {found[2].replace(', ', ',')}: {text}{'.' if found[3] else ''}{found[3] or ''}"
        lines.append(line)


def setup(app: Any) -> dict[str, Any]:
    """Register the directive and the hooks of autodoc."""
    app.add_directive("case-gallery", CaseGallery)
    app.add_directive("measured", Measured)
    app.add_directive("pages", PageList)
    app.connect("autodoc-skip-member", _skip)
    app.connect("autodoc-process-docstring", _plain_types, priority=600)  # after napoleon
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
