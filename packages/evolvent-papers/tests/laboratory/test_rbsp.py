"""Spin rates of Van Allen Probe A: what the guide states, and a second log of the same form."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from evolvent_papers import laboratory
from evolvent_papers.laboratory import rbsp
from evolvent_papers.wire_booms import SYSTEM, log

SHIPPED = SYSTEM.data_files["rbsp-a.csv"]


@pytest.mark.slow
def test_the_log_of_the_package() -> None:
    """`docs/laboratory/rbsp.md` and the table of `docs/guide/laboratory.md` state these numbers."""
    found = laboratory.found("rbsp").validate()
    rates, fit, start = found.comparisons[:8], found.comparisons[8], found.comparisons[9]
    assert [one.what.split(",")[0] for one in rates] == [f"rate after step {k}" for k in range(13, 21)]
    assert all(one.covered for one in rates)
    assert np.sqrt(np.mean([one.difference**2 for one in rates])) == pytest.approx(0.0231, abs=1e-4)
    assert max(abs(one.difference) for one in rates) == pytest.approx(0.0334, abs=1e-4)
    assert rates[0].band.half_width == pytest.approx(0.018, abs=5e-4)
    assert rates[-1].band.half_width == pytest.approx(0.079, abs=5e-4)
    assert fit.predicted == pytest.approx(0.0077, abs=5e-5)
    assert (start.predicted, start.measured) == (pytest.approx(10.14, abs=0.01), pytest.approx(10.0))
    assert start.band.parameters == pytest.approx(0.064, abs=1e-3)
    assert (fit.covered, start.covered) == (False, False)
    assert found.text == "1 of 1 goals are met; 8 of 10 differences are within their bands of 95 %"
    assert any("begins at 7 m by the log, at 10 m by the clicks" in note for note in found.notes)


def second_log(path, masses: np.ndarray, start: float, *, clicks: bool) -> None:
    """The steps of the log with rates of other wires, whose second group begins at a length that the strokes lack."""
    predicted, groups, _ = rbsp.rates_after(SHIPPED, masses, {1: start})
    with open(SHIPPED, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for k, row in enumerate(rows):
        row["rate_after_rpm"] = f"{predicted[k]:.9f}"
        if k and groups[k] == groups[k - 1]:
            row["rate_before_rpm"] = f"{predicted[k - 1]:.9f}"
        if not clicks:
            del row["clicks"]
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


@pytest.mark.slow
def test_a_second_log_is_predicted_by_the_first(tmp_path) -> None:
    """All rates after steps by the wires that the package's log gives; the length that the log lacks is found again."""
    masses = rbsp.fitted(SHIPPED).values[:2]
    second_log(tmp_path / "b.csv", masses, 10.0, clicks=True)
    found = laboratory.found("rbsp").validate(data=str(tmp_path / "b.csv"))
    rates = found.comparisons[:20]
    assert max(abs(one.difference) for one in rates) < 1e-6
    assert all(one.band.parameters > 0.0 for one in rates)
    assert found.comparisons[20].predicted < 1e-5
    assert found.comparisons[21].predicted == pytest.approx(10.0, abs=1e-3)
    second_log(tmp_path / "c.csv", 1.3 * masses, 10.0, clicks=True)
    found = laboratory.found("rbsp").validate(data=str(tmp_path / "c.csv"))
    assert found.coverage[0] < 10  # other wires are not those of the first log
    assert found.comparisons[20].predicted < 1e-5


@pytest.mark.slow
def test_without_clicks_the_strokes_are_taken(tmp_path) -> None:
    second_log(tmp_path / "b.csv", rbsp.fitted(SHIPPED).values[:2], 7.0, clicks=False)
    assert rbsp.hidden_starts(str(tmp_path / "b.csv")) == {}
    found = laboratory.found("rbsp").validate(data=str(tmp_path / "b.csv"))
    assert len(found.comparisons) == 21
    assert found.comparisons[20].predicted < 1e-5


def test_the_last_group_is_left_out(tmp_path) -> None:
    kept = rbsp.without_last_group(SHIPPED, str(tmp_path))
    assert [len(group) for group in log.grouped(log.read(kept)[0])] == [4, 8]
