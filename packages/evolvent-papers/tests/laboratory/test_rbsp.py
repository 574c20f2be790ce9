"""Spin rates of Van Allen Probe A: what the guide states, and a second log of the same form."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from evolvent_papers import laboratory
from evolvent_papers.laboratory import rbsp
from evolvent_papers.wire_booms import SYSTEM, closed_form, inertia, log

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
    assert rates[0].band.half_width == pytest.approx(0.030, abs=5e-4)
    assert rates[-1].band.half_width == pytest.approx(0.083, abs=5e-4)
    assert all(one.band.shares["start"] == one.band.shares["spacecraft"] == 0.0 for one in rates)
    assert fit.predicted == pytest.approx(0.0077, abs=5e-5)
    assert (start.predicted, start.measured) == (pytest.approx(10.14, abs=0.01), pytest.approx(10.0))
    assert start.band.shares["fit"] == pytest.approx(0.064, abs=1e-3)
    assert (fit.band.half_width, start.band.half_width) == pytest.approx((0.0086, 0.188), rel=0.01)
    assert found.text == "1 of 1 goals are met; 10 of 10 differences are within their bands of 95 %"
    assert any("8 of 8 are within their bands" in note for note in found.notes)
    assert any("begins at 7 m by the log, at 10 m by the clicks" in note for note in found.notes)


def second_log(path, masses: np.ndarray, start: float, *, clicks: bool) -> None:
    """The steps of the log with rates of other wires, whose second group begins at a length that the strokes lack."""
    made = rbsp.Prediction(path=SHIPPED, masses=masses, starts={1: start})
    predicted, groups = made.rates, made.line.groups
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
    second_log(tmp_path / "c.csv", 1.3 * masses, 10.2, clicks=True)
    found = laboratory.found("rbsp").validate(data=str(tmp_path / "c.csv"))
    assert found.coverage[0] < 12  # other wires are not those of the first log
    assert found.comparisons[20].predicted < 1e-5


MASSES = np.array([0.0912, 0.00339])


def test_a_common_scale_of_lengths_is_that_of_the_root() -> None:
    """With masses over s^2 and s^3, lengths times s are the same as the distance of the root over s: exactly."""
    s = 1.0 + rbsp.SPOOL
    plain = rbsp.Prediction(path=SHIPPED, masses=MASSES, starts={1: 10.0})
    nearer = plain.case.replaced(body=plain.case.body.replaced(root=plain.case.body.root / s))
    expected = closed_form(nearer, plain.line.after)["spin_rate"] / log.RPM
    parts = plain.contributions(np.zeros((2, 2)), 0.2, 0.01)
    np.testing.assert_allclose(parts["spool"], np.abs(expected - plain.rates), rtol=1e-6, atol=1e-9)
    assert np.all(parts["start"][plain.line.groups != 1] < 1e-12)
    # 0.2 m of all four wires at 10 m: d ln J / d l = 4 (2 m (R + l) + rho (R + l)^2) / J, less that after the step
    far = plain.case.body.root + 10.0
    slope = 4.0 * (2.0 * MASSES[0] * far + MASSES[1] * far**2) / inertia(plain.case, np.array([10.0, 10.0]))
    first = np.flatnonzero(plain.line.groups == 1)[1]  # both pairs have moved to 15 m, by the log
    assert parts["start"][first] == pytest.approx(0.2 * slope * plain.rates[first], rel=0.02)


def test_bands_cover_logs_that_are_drawn_as_they_state() -> None:
    """Rates of another craft whose second group starts elsewhere, lengths by whole clicks, rates rounded: 95 %."""
    random = np.random.default_rng(3)
    plain = rbsp.Prediction(path=SHIPPED, masses=MASSES, starts={1: 10.0})
    parts = plain.contributions(np.zeros((2, 2)), 0.15, rbsp.CRAFT)
    half = 1.96 * np.sqrt(sum(parts[name] ** 2 for name in ("rounding", "clicks", "start", "spacecraft")))
    case, groups = plain.case, plain.line.groups
    firsts = np.searchsorted(groups, groups)
    own = case.body.inertia
    wires = [
        inertia(case, closed_form(case, time)["boom_length"]) - own for time in (plain.line.before, plain.line.after)
    ]
    slopes = [
        np.stack([inertia(case, length + 0.01 * e) - inertia(case, length) for e in np.eye(2)], axis=-1) / 0.01
        for length in (closed_form(case, time)["boom_length"] for time in (plain.line.before, plain.line.after))
    ]
    runs, inside = 400, 0
    for _ in range(runs):
        click = random.uniform(-0.5, 0.5, (2, groups.size, 2)) / rbsp.CLICKS
        moved = [wire + (slope * one).sum(axis=-1) for wire, slope, one in zip(wires, slopes, click, strict=True)]
        offset = 0.15 * random.standard_normal() * (groups == 1)
        start = moved[0] + slopes[0].sum(axis=-1) * offset
        body = own * (1.0 + rbsp.CRAFT * random.standard_normal())
        truth = np.array(case.rates)[groups] / log.RPM * (body + start[firsts]) / (body + moved[1])
        error = random.uniform(-0.005, 0.005, (2, groups.size))
        truth = truth + error[0] - plain.shares * error[1][firsts]
        inside += np.sum(np.abs(truth - plain.rates) <= half)
    assert inside / (runs * groups.size) == pytest.approx(0.95, abs=0.02)


@pytest.mark.slow
def test_a_start_that_the_log_does_not_hold_is_in_the_bands(tmp_path) -> None:
    """The second group begins at 10.2 m, at 10 m by the clicks: rates are missed as far as the bands say."""
    masses = rbsp.fitted(SHIPPED).values[:2]
    second_log(tmp_path / "b.csv", masses, 10.2, clicks=True)
    found = laboratory.found("rbsp").validate(data=str(tmp_path / "b.csv"))
    assert all(one.covered for one in found.comparisons[:21])
    assert not found.comparisons[21].covered  # clicks and spool do not explain 0.2 m
    group = found.comparisons[4:12]
    without = [np.sqrt(sum(v**2 for k, v in one.band.shares.items() if k != "start")) for one in group]
    off = np.array([abs(one.difference) for one in group])
    assert np.sqrt(np.mean(off**2)) > 0.024
    assert np.any(off > 1.96 * np.array(without))
    assert found.comparisons[21].predicted == pytest.approx(10.2, abs=1e-3)
    assert any("20 of 20 are within their bands" in note for note in found.notes)


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
