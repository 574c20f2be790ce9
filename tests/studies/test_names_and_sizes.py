"""Keys of parts whose names hold a blank, and grids of very many cases."""

from __future__ import annotations

import json
import pathlib
import warnings

import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent.design.studies import draw
from evolvent_base.errors import InputError
from evolvent_base.progress import Stage, shown_by

CASE = {
    "parts": {"tip 1": {"kind": "point", "mass": "1 kg", "position": [0, 0, 0], "velocity": [0, 0, 1]}},
    "gravity": [0, 0, -1],
    "simulate": {"until": "1 s", "every": "0.5 s"},
}


@pytest.mark.slow
@pytest.mark.parametrize("sample", ["list", "grid"])
def test_keys_of_parts_with_a_blank_are_drawn(sample: str, tmp_path: pathlib.Path) -> None:
    key = "parts.tip 1.mass"
    study = {"case": CASE, "sample": sample, "over": {key: [1.0, 2.0]}, "keep": ["tip 1.energy_kinetic.last"]}
    with warnings.catch_warnings():
        warnings.simplefilter("error", category=UserWarning)
        found = studies.sweep(study, output=tmp_path / "study")
    assert key in found.coords
    assert studies.open(tmp_path / "study").identical(found)
    assert json.loads(found.attrs["keys"]) == [key]
    assert len(draw.figures(found)) == 1


def test_large_grids_are_checked_by_their_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along the edges of the grid, which hold every value, and with progress."""
    loaded, stages, load = [], [], cases.load

    def counted(*given: object) -> object:
        loaded.append(given)
        return load(*given)

    monkeypatch.setattr(cases, "load", counted)
    over = {
        "spool.rate": {"from": 2.0, "to": 3.0, "points": 300},
        "blade.length": {"from": 0.1, "to": 0.4, "points": 300},
    }
    with shown_by(stages.append):
        study = studies.read({"case": "heliogyro", "over": over})
    assert study.count == 90_000
    assert 599 <= len(loaded) < 700
    assert study.axes[1].values[299] == pytest.approx(0.4)
    assert any(isinstance(s, Stage) and s.what == "checking the cases" and s.total == 600 for s in stages)
    over["blade.length"] = {"from": -0.1, "to": 0.4, "points": 300}
    with pytest.raises(InputError, match=r"case 0 of the study .* blade\.length"):
        studies.read({"case": "heliogyro", "over": over})
