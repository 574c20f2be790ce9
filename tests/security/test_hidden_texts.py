"""Formulas, control characters and characters that turn the direction of writing, in texts that others wrote."""

from __future__ import annotations

import pathlib
import xml.etree.ElementTree as ET
from typing import Any

import pytest

from evolvent import cases
from evolvent.analysis.system import System
from evolvent.exports import table
from evolvent_base import pages, signals
from evolvent_base.errors import EvolventError, InputError, visible
from evolvent_cosim.fmu import description

HIDDEN = ("\x00", "\x07", "\x1b[2J", "\u202e", "\u2066", "\x9b", "\ufffe")


@pytest.mark.parametrize("text", HIDDEN)
def test_hidden_characters_become_escapes(text: str) -> None:
    shown = visible(f"boom{text} end")
    assert shown.startswith("boom\\")
    assert shown.isprintable()
    assert visible("Größe\t10 µm\n\u05e9\u05dc \x85") == "Größe\t10 µm\n\u05e9\u05dc \x85"
    assert visible("\ud800") == "\\ud800"
    assert "\\" in str(EvolventError(f"a{text}b"))


@pytest.mark.parametrize("text", ["\\u202e", "\\e", "\\a", "\\uFFFE", "\\x9b"])
def test_cases_with_hidden_characters_are_refused(text: str) -> None:
    for source in (f'title: "a{text}"', f'"a{text}": 1', f'a: ["b{text}"]'):
        with pytest.raises(InputError, match=r"line 1, column \d+: the character '.*' is not allowed"):
            cases.parse_yaml(f"{source}\n", "case")


def test_titles_with_hidden_characters_are_refused() -> None:
    for title in ("a\u202e", "a\x1b[2J"):
        with pytest.raises(InputError, match=r"title is .*; the character '\\.*' is not allowed"):
            System(title=title)
        with pytest.raises(InputError, match=r"title is .* is not allowed"):
            cases.load("two-booms", {"title": title})


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        ("=1+1", "'=1+1"),
        ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
        ("-2+3+cmd|x", "'-2+3+cmd|x"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\t=1", "'\t=1"),
        ("\r=1", "\\r=1"),
        ("-1.5", "-1.5"),
        ("-0.5 kg m^2", "-0.5 kg m^2"),
        ("+1e-5 N/m", "+1e-5 N/m"),
        (-1.5, -1.5),
        (-3, -3),
        ("tip", "tip"),
        ("a\x1bb", "a\\x1bb"),
    ],
)
def test_formulas_in_tables(value: Any, cell: Any) -> None:
    assert table._cell(value) == cell


@pytest.mark.parametrize("text", HIDDEN)
def test_xml_and_pages_can_be_read(text: str) -> None:
    root = ET.Element("fmiModelDescription", modelName=f"a{text}b")
    assert ET.fromstring(description._text(root)).attrib["modelName"] == visible(f"a{text}b")
    written = pages._json({f"a{text}": [f"b{text}", 1.5, "é<"]})
    assert "\\\\" in written
    assert "é<" not in written  # ASCII


def test_names_of_columns_are_visible(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("a\u202e (m\x1bm),a\x07\n1,2\n2,3\n3,4\n", encoding="utf-8")
    read = signals.read(path)
    assert read.names == ("a\\u202e", "a\\x07")
    assert read.units == ("m\\x1bm", "")
