"""The page of the comparison with other programs and its figures, from a canned result: nothing is measured."""

from __future__ import annotations

import importlib
import json
import pathlib
import struct
from types import ModuleType

import pytest

PEERS = pathlib.Path(__file__).parents[2] / "benchmarks" / "peers"


def row(program: str, step: float, seconds: list[float], error: float, large: dict) -> dict:
    return {
        "program": program,
        "label": "RK4",
        "reference": "line",
        "runs": [{"step": step, "stepping": seconds, "all": seconds, "error": error}],
        "large": [{"step": 2.0, **large}],
    }


RESULT = {
    "date": "2001-01-01",
    "machine": {"kind": "x86_64", "cores": 2, "python": "3.11", "load": [1.0, 2.0]},
    "repeat": 3,
    "versions": {"evolvent": "0", "mujoco": "1", "exudyn": "2"},
    "missing": {"moordyn": "it could not be installed"},
    "works": [
        {
            "title": "A line",
            "text": "It swings.",
            "size": 1.0,
            "references": {"line": {"text": "closed form", "sure": 1e-12}},
            "rows": [
                row("evolvent", 1e-3, [2e-6, 4e-6, 3e-6], 1e-6, {"raised": "InputError: too large"}),
                row("mujoco", 1e-3, [6e-6], 1e-6, {"error": 0.7}),
                row("exudyn", 1e-3, [1.5e-6], 2e-6, {"error": float("nan"), "warned": "careful"}),
            ],
        }
    ],
}


@pytest.fixture(params=["page", "plots"])
def module(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A module of the comparison, which lies beside the package."""
    monkeypatch.syspath_prepend(str(PEERS))
    return importlib.import_module(request.param)


@pytest.mark.parametrize("module", ["page"], indirect=True)
def test_page(module: ModuleType) -> None:
    text = module.page(RESULT)
    assert "| evolvent | RK4 | 0.001 | 3 (2) | 0.003 | 1e-06 |  |" in text
    assert "| MuJoCo | RK4 | 0.001 | 6 (6) | 0.006 | 1e-06 | 2 |" in text
    assert "refused or stopped: InputError: too large" in text
    assert "**ended without a warning, wrong by 0.7 m**" in text
    assert "**ended with NaN, with the warning careful**" in text
    assert "MoorDyn did not take part: it could not be installed" in text
    losses = text.partition("## Where evolvent loses")[2]
    assert "Exudyn (RK4) is 2 times as fast per step as ours (RK4)" in losses
    assert "MuJoCo" not in losses
    for name in ("comparison-time.png", "comparison-error.png"):
        assert f"(images/{name})" in text


@pytest.mark.parametrize("module", ["plots"], indirect=True)
def test_figures(module: ModuleType, tmp_path: pathlib.Path) -> None:
    shown = module.summary(RESULT)
    assert (shown["date"], shown["versions"]["evolvent"]) == ("2001-01-01", "0")
    rows = shown["works"][0]["rows"]
    assert rows[0]["runs"] == [{"step": 1e-3, "median": 3e-6, "least": 2e-6, "error": 1e-6}]
    assert [row["program"] for row in rows] == ["evolvent", "mujoco", "exudyn"]
    module.draw(json.loads(json.dumps(shown)), tmp_path)
    for name in module.FILES:
        content = (tmp_path / name).read_bytes()
        width, height = struct.unpack(">II", content[16:24])
        assert content[:8] == b"\x89PNG\r\n\x1a\n"
        assert width > 1000
        assert height > 200


@pytest.mark.parametrize("module", ["page"], indirect=True)
def test_the_figures_show_the_numbers_of_the_page(module: ModuleType) -> None:
    """The file beside the page, from which the figures are drawn, and the page's tables."""
    docs = PEERS.parents[1] / "docs"
    page, shown = (docs / "comparison.md").read_text(), json.loads((docs / "comparison.json").read_text())
    machine = shown["machine"]
    assert (
        f"Measured on {shown['date']}: {machine['kind']}, {machine['cores']} cores, Python {machine['python']}." in page
    )
    assert f"Programs: {', '.join(f'{module.NAMES[name]} {text}' for name, text in shown['versions'].items())}." in page
    assert "```{measured} comparison.json\n```\n" in page
    for work in shown["works"]:
        table = page.partition(f"## {work['title']}\n")[2]
        for row in work["rows"]:
            for run in row["runs"]:
                cells = [module.NAMES[row["program"]], row["label"], module.number(run["step"])]
                cells.append(f"{module.number(1e6 * run['median'])} ({module.number(1e6 * run['least'])})")
                assert "| " + " | ".join(cells) + " | " in table
