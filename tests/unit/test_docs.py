"""What the guide to the warnings quotes is what the code says."""

import ast
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[2]
PAGE = ROOT / "docs" / "guide" / "warnings.md"


def texts(node: ast.AST) -> list[str]:
    """Every text in a module, with \x00 for what an f-string puts in."""
    found = []
    for inner in ast.walk(node):
        if isinstance(inner, ast.JoinedStr):
            parts = (v.value if isinstance(v, ast.Constant) else "\x00" for v in inner.values)
            found.append("".join(str(part) for part in parts))
        elif isinstance(inner, ast.Constant) and isinstance(inner.value, str):
            found.append(inner.value)
    return found


@pytest.fixture(scope="module")
def corpus() -> str:
    sources = (ROOT / "src" / "evolvent").rglob("*.py")
    return "\n".join(text for path in sources for text in texts(ast.parse(path.read_text(encoding="utf-8"))))


def quoted() -> list[str]:
    """The quotations that head the page's entries."""
    page = PAGE.read_text(encoding="utf-8")
    return [" ".join(quote.split()) for quote in re.findall(r'\*\*"(.*?)"\*\*', page, flags=re.DOTALL)]


def test_warnings_are_quoted_as_they_are(corpus):
    quotes = quoted()
    assert len(quotes) > 40
    missing = []
    for quote in quotes:
        pieces = [piece.strip(" ;,") for piece in quote.split("...")]
        missing += [(piece, quote) for piece in pieces if len(piece) > 3 and piece not in corpus]
    assert not missing
