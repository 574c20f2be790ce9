"""The guide states what the command prints."""

import pathlib
import re

import pytest

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "guide" / "clearance.md"


@pytest.mark.slow
def test_what_the_guide_prints(call, monkeypatch):
    pytest.importorskip("coal")
    monkeypatch.setenv("COLUMNS", "120")
    (block,) = re.findall(r"^```text\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    code, out, _ = call("clearance", "solar-array")
    assert code == 0
    printed = " ".join(out.split())
    for line in block.splitlines():
        assert " ".join(line.split()) in printed
