"""Links to files of the repository, which a Git host shows: in the pages they lead to what is made of the file."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

#: Links to an example, or to the head of the gallery.
_EXAMPLE = re.compile(r"\]\(\.\./((?:\.\./)*)examples/(\w+)\.(?:py|rst)\)")


def to_pages(text: str) -> str:
    """The text with links to files of `examples` as links to their pages in the gallery."""
    return _EXAMPLE.sub(
        lambda match: f"]({match[1]}examples/{'index' if match[2] == 'GALLERY_HEADER' else match[2]})", text
    )


def _read(app: Sphinx, name: str, source: list[str]) -> None:
    source[0] = to_pages(source[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Change every page that is read."""
    app.connect("source-read", _read)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
