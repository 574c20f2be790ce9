"""Figures of the thread paper, from short runs: what the paper or the model says they show."""

import json

import numpy as np
import pytest
import xarray as xr

from evolvent import cases, papers
from evolvent.papers import Options, thread, thread_runs, thread_schematics

QUICK = Options(quick=True)


@pytest.fixture
def short(monkeypatch):
    """Runs of figures end after 21 s, in which three nodes leave the spool."""
    monkeypatch.setattr(thread_runs, "SHARED", {"solver.duration": 21.0})


def cells(text):
    """The rows of a Markdown table, without its head."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.mark.parametrize("name", [name for name in papers.THREAD if name.startswith("thread-figure-3")])
def test_schematics_are_drawn(name):
    made = papers.entry(name).make(QUICK)
    assert made.figure.name == name
    assert made.complete
    (panel,) = made.figure.panels
    assert not panel.axes
    assert panel.equal
    assert panel.notes
    assert all(np.isfinite(line.x).all() and np.isfinite(line.y).all() for line in panel.lines)
    assert cells(made.text)


def test_wound_nodes_lie_on_the_spool_at_the_angles_of_eq_2():
    seen = thread_schematics.drawn()
    assert seen.out == 8
    wound = seen.wound[seen.out :]
    expected = thread_schematics.R * np.column_stack([np.sin(wound), 0.0 * wound, np.cos(wound)])
    assert seen.nodes[seen.out :] == pytest.approx(expected, abs=1e-12)


def test_the_boundary_node_is_its_rest_length_from_the_departure_point():
    """Eq. (10), with links of fixed length."""
    rows = dict(cells(thread_schematics.figure_3_3(QUICK).text))
    rest, distance = (float(rows[key]) for key in rows if key.endswith("mm"))
    assert distance == pytest.approx(rest, abs=1e-4)


@pytest.mark.usefixtures("short")
def test_figure_4_1_eq_18_lies_above_and_the_corrected_formula_on_the_computed_rate():
    made = thread.figure_4_1(QUICK)
    gaps = {line.label: line.y for line in made.figure.panels[1].lines}
    for n in (20, 40):
        assert 2.3 < gaps[f"eq. (18), $n$ = {n}"][-1] < 2.7
        assert np.abs(gaps[f"corrected, $n$ = {n}"]).max() < 0.15
    assert [row[0] for row in cells(made.text)] == ["20", "40"]


@pytest.mark.usefixtures("short")
def test_figure_4_2_starts_with_a_swing_about_the_steady_lag():
    made = thread.figure_4_2(QUICK)
    start = {line.label: line for line in made.figure.panels[1].lines}
    assert start["steady lag"].y[0] == pytest.approx(np.degrees(np.arcsin(2.0 * 0.035 / 0.3)))
    for n in (20, 40):
        line = start[f"$n$ = {n}"]
        assert np.nanmax(line.y) == pytest.approx(15.26, abs=0.05)
        assert line.x[np.nanargmax(line.y)] == pytest.approx(0.13, abs=0.02)
    assert [float(row[1]) for row in cells(made.text)] == pytest.approx([13.46, 13.46], abs=0.005)


@pytest.mark.usefixtures("short")
def test_figure_4_3_damping_does_not_matter():
    made = thread.figure_4_3(QUICK)
    assert made.complete
    rows = cells(made.text)
    assert len(rows) == 2 * len(thread.QUICK_DAMPINGS)
    assert all(float(row[-1]) < 3e-4 for row in rows)
    assert len({row[2] for row in rows}) == 1


@pytest.mark.usefixtures("short")
def test_figure_4_4_curves_are_equal_to_five_decimals():
    made = thread.figure_4_4(QUICK)
    _, *curves = made.figure.panels[0].lines
    assert len(curves) == len(thread.STIFFNESSES)
    late = curves[0].x >= 1.0
    for curve in curves[1:]:
        assert np.abs(curve.y - curves[0].y)[late].max() < 5e-6
    assert len({tuple(row[3:5]) for row in cells(made.text)}) == 1


def test_the_figure_of_a_study_has_the_change_to_the_next_value():
    t, c, n = np.array([0.0, 1.0, 2.0]), np.array([1e2, 1e3, 1e4]), np.array([20, 40])
    lag = np.broadcast_to(1.0 / c[None, :, None, None] * np.array([1.0, 2.0])[:, None, None, None], (2, 3, 3, 2))
    dataset = xr.Dataset(
        {"tip_lag": (("n", "c", "time", "blade"), lag)},
        coords={"n": n, "c": ("c", c, {"units": "N m-1"}), "time": t},
        attrs={"sample": "grid", "keys": json.dumps(["n", "c"])},
    )
    system = cases.system("heliogyro")
    figure = system.study_figures(dataset)["lag_change"]
    first, second = figure.panels[0].lines
    assert first.x.tolist() == [1e2, 1e3]
    assert first.y == pytest.approx(np.degrees([9e-3, 9e-4]))
    assert second.y == pytest.approx(2.0 * first.y)
    assert figure.panels[0].log_x
    assert system.study_figures(dataset.drop_vars("tip_lag")) == {}
    assert system.study_figures(dataset.isel(time=-1)) == {}
