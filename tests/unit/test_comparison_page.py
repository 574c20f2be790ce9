"""The page of the comparison with other programs, from a canned result: nothing is measured."""

from __future__ import annotations

import importlib.util
import pathlib

PATH = pathlib.Path(__file__).parents[2] / "benchmarks" / "peers" / "page.py"


def row(program: str, step: float, seconds: list[float], error: float, large: dict) -> dict:
    return {
        "program": program,
        "label": "RK4",
        "reference": "line",
        "runs": [{"step": step, "stepping": seconds, "all": seconds, "error": error}],
        "large": [{"step": 2.0, **large}],
    }


def test_page() -> None:
    spec = importlib.util.spec_from_file_location("comparison_page", PATH)
    assert spec is not None
    assert spec.loader is not None
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    text = page.page(
        {
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
    )
    assert "| evolvent | RK4 | 0.001 | 3 (2) | 0.003 | 1e-06 |  |" in text
    assert "| MuJoCo | RK4 | 0.001 | 6 (6) | 0.006 | 1e-06 | 2 |" in text
    assert "refused or stopped: InputError: too large" in text
    assert "**ended without a word, wrong by 0.7 m**" in text
    assert "**ended with what is not a number, with the warning careful**" in text
    assert "MoorDyn did not take part: it could not be installed" in text
    losses = text.partition("## Where evolvent loses")[2]
    assert "Exudyn (RK4) is 2 times as fast a step as ours (RK4)" in losses
    assert "MuJoCo" not in losses
