"""Links that lead elsewhere are found as a reader follows them."""

from __future__ import annotations

import importlib.util
import pathlib

SCRIPT = pathlib.Path(__file__).parents[2] / "tools" / "external_links.py"


def test_links_of_texts_and_of_the_pages() -> None:
    spec = importlib.util.spec_from_file_location("external_links", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    text = (
        "[coal](https://github.com/coal-library/coal), see https://a.org/b_(c). "
        "`https://x.org/y#part` and http://localhost:8080/, https://example.org/no"
    )
    assert [*script.links(text)] == ["https://github.com/coal-library/coal", "https://a.org/b_(c)", "https://x.org/y"]
    found = script.collected()
    assert "docs/guide/clearance.md" in found["https://github.com/coal-library/coal"]
    assert all(" " not in address for address in found)
