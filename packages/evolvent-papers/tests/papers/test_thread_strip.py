"""The strip in place of the thread: figure, and its measurements on short runs."""

import numpy as np
import pytest

from evolvent_papers import papers
from evolvent_papers.papers import Options, thread_strip


@pytest.mark.slow
def test_the_figure_has_the_limit_of_strips_and_the_lag_of_both(monkeypatch):
    """Two widths and one rate: where they buckle is where the closed form has the rate, and they lag as threads do."""
    monkeypatch.setattr(thread_strip, "WIDTHS", (0.01, 0.02625))
    monkeypatch.setattr(thread_strip, "QUICK_RATES", (0.035,))
    monkeypatch.setattr(thread_strip, "TWISTS", (0.06,))
    said = []
    made = papers.entry("thread-strip-payout").make(Options(quick=True, report=said.append))
    limit, lags, twists = made.figure.panels
    assert len(said) == 3
    assert all(panel.title.startswith("ours: ") for panel in made.figure.panels)
    assert [line.label for line in limit.lines][:2] == ["strip, 10 mm", "strip, 26.25 mm"]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in made.text.splitlines()[4:]]
    assert len(rows) == 2
    for row, line in zip(rows, limit.lines, strict=False):
        _, rate, reached, closed, strip, _ = map(float, [*row[:5], "0"])
        assert rate == pytest.approx(float(line.y[0]))
        assert reached == pytest.approx(float(line.x[0]), abs=0.006)
        assert reached == pytest.approx(closed, rel=0.05)
        assert strip == pytest.approx(13.1, abs=0.3)
    assert float(rows[1][5]) == pytest.approx(float(rows[1][4]), abs=0.2)
    crosses = next(line for line in lags.lines if line.label == "thread")
    assert crosses.y.shape == (1,)
    assert twists.lines[0].y.max() > 10.0


@pytest.mark.slow
def test_a_buckled_strip_moves_as_the_thread():
    """Its lag is within 5 % of the thread's, from which it started."""
    found = thread_strip.buckled()
    assert 0.0 < found["buckled"] < 0.05 * found["lag"]
    assert found["lag"] == pytest.approx(12.5, abs=0.5)


def test_forces_across_a_blade_are_those_of_its_pitch():
    """Share of the force across the plane of a straight blade: the sine of the pitch of its root."""

    class Values:
        def __init__(self, values):
            self.values = np.asarray(values, dtype=float)

    class Blade:
        def __init__(self, pitch):
            s = np.linspace(0.05, 4.05, 9)
            self.position = Values(np.tile(np.column_stack([s, 0.0 * s, 0.0 * s]), (12, 1, 1)))
            along = np.linspace(0.0, thread_strip.PAPER, 9)
            self.velocity = Values(np.tile(np.column_stack([along, 0.5 * s, 0.0 * s]), (12, 1, 1)))
            # the sections' y is the normal: from the inertial axes a turn of 90 deg about x, less the pitch
            half = 0.5 * (0.5 * np.pi - pitch)
            self.attitude = Values(np.tile([np.cos(half), np.sin(half), 0.0, 0.0], (12, 9, 1)))

    class Run(dict):
        body_rate = Values(np.full(12, 0.5))
        deployed_length = Values(np.linspace(3.0, 4.0, 12))
        buckled_length = 4.0

    for pitch in (0.0, 0.01, 0.3):
        assert thread_strip._across(Run(blade=Blade(pitch))) == pytest.approx(100.0 * np.sin(pitch), abs=1e-9)
