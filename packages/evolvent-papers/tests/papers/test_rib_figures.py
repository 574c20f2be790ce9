"""Figures of the rib paper: schematics, quick forms of figures 6 to 9, root damping, contact points at rest."""

import numpy as np
import pytest

from evolvent_base import plots
from evolvent_papers import papers
from evolvent_papers.papers import Options, rib_figures, rib_runs
from evolvent_papers.papers.rib_captions import CAPTIONS, title
from evolvent_papers.papers.rib_schematics import straddling_distances

QUICK = Options(quick=True)


def numbers(text):
    """Rows of the Markdown table, as far as they are numbers."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return rows[2:]


@pytest.fixture
def until_the_whip(monkeypatch):
    """Runs end soon after the largest tip speed."""
    monkeypatch.setattr(rib_runs, "ALPHAS", {0.0: 30.0, 0.2: 70.0, 0.5: 150.0})


@pytest.mark.slow
@pytest.mark.usefixtures("until_the_whip")
def test_figure_7_shows_the_peaks_of_its_table():
    made = rib_figures.figure_7(QUICK)
    rows = [[float(cell) for cell in row] for row in numbers(made.text)]
    alpha, time, peak, coarse, string = np.array(rows).T
    assert list(alpha) == [0.0, 0.2, 0.5]
    assert np.all(np.diff(time) > 0.0)
    assert np.all(np.diff(peak) < 0.0)
    assert np.all(np.abs(time - string) < 0.03 * time)
    assert np.all(peak >= coarse)
    assert peak[0] > 1.5 * coarse[0]
    for k, panel in enumerate(made.figure.panels[1:]):
        assert panel.lines[0].y.max() == pytest.approx(peak[k], rel=0.01)
        assert made.figure.panels[0].lines[k].y.max() == pytest.approx(peak[k], rel=0.01)
        near = np.abs(panel.lines[0].x - panel.lines[0].x[np.argmax(panel.lines[0].y)]) < 0.01
        assert near.sum() >= 3


@pytest.mark.usefixtures("until_the_whip")
def test_figures_6_8_and_9_share_the_runs_of_figure_7():
    done = rib_runs._winding.cache_info().misses
    shapes, points, force = (make(QUICK) for make in (rib_figures.figure_6, rib_figures.figure_8, rib_figures.figure_9))
    assert rib_runs._winding.cache_info().misses <= done + 3
    turns, touching = np.array([[float(cell) for cell in row[2:4]] for row in numbers(shapes.text)]).T
    assert turns[0] == touching[0] == 0.0
    assert turns[-2] > 2.5
    assert np.all(np.diff(turns[:-1]) >= 0.0)
    assert float(numbers(shapes.text)[-1][0]) == 70.0  # the last shape is that of the end of the run
    assert [len(panel.lines) for panel in points.figure.panels] == [1, 3, 3]  # the paper's figure 8 has one curve
    for row in numbers(points.text):
        counts = [float(cell) for cell in row[1:5]]
        assert counts == sorted(counts)
        assert counts[-1] > 4.0 * counts[0]
    columns = np.array([[float(cell) for cell in row] for row in numbers(force.text)]).T
    for falling in columns[1:4]:
        assert np.all(np.diff(falling) < 0.0)
    for run in rib_runs.runs(rib_runs.of_the_paper(quick=True), papers.silent):
        gained = np.trapezoid(run.force[: run.peak + 1], run.t[: run.peak + 1])
        assert run.impulse[run.peak] == pytest.approx(gained, rel=0.05)


@pytest.mark.release
def test_damping_at_the_root_alone_neither_lowers_nor_delays_the_peak():
    made = rib_figures.root_damping(QUICK)
    time, peak, impulse, mean = np.array([[float(cell) for cell in row[1:5]] for row in numbers(made.text)]).T
    assert time == pytest.approx(time[0], rel=0.01)
    assert peak == pytest.approx(peak[0], rel=0.2)
    assert impulse == pytest.approx(impulse[0], rel=0.1)
    assert mean == pytest.approx(mean[0], rel=0.1)


@pytest.mark.release
def test_points_that_do_not_touch_at_rest_lie_off_by_what_a_cubic_departs_from_an_arc():
    """Of the wound rib's points, those at the nodes lie R theta^4/384 farther out than those in the middle."""
    (run,) = rib_runs.runs([rib_runs.of_the_paper()[1]], papers.silent)
    gap = run.gap[-1].reshape(40, 4)
    inner = gap[5:35]
    step = inner[:, 3] - inner[:, 1]
    assert step == pytest.approx(rib_figures.departure(run), rel=0.1)
    # quarter points lie 9/16 of it inside the nodes
    assert inner[:20, 3] - inner[:20, 0] == pytest.approx(9.0 / 16.0 * rib_figures.departure(run), rel=0.15)
    touching = run.touching[-1].reshape(40, 4)
    assert touching.any(axis=1).all()
    assert touching[:, 1].all()
    assert np.all(np.diff(touching[:, 3].astype(int)) <= 0)  # at the nodes near the root alone, where it presses most
    k = run.case.contact_stiffness
    pressed = k * np.where(touching, -gap, 0.0).sum(axis=1) / 0.3
    closed = 0.2 / 0.6**2 * (1.0 - (np.arange(40) + 0.5) / 40)
    assert pressed[2:38] == pytest.approx(closed[2:38], abs=0.02 * closed[0])
    assert run.force[-1] == pytest.approx(k * np.where(touching, -gap, 0.0).sum(), rel=1e-4)
    made = rib_figures.points_at_rest(Options())
    assert made.figure.title.endswith(f"at rest, {int(run.points[-1])} of 160 touch")


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, 6))
def test_schematics_are_drawn(number, tmp_path):
    made = papers.entry(f"rib-figure-{number}").make(QUICK)
    (panel,) = made.figure.panels
    assert not panel.axes
    assert made.figure.title.startswith(f"{CAPTIONS[number]}\n(figure {number} of Yi et al. 2017")
    assert "Schematic, drawn by us" in made.text
    assert all(np.isfinite(line.x).all() for line in panel.lines)
    assert len({note.text for note in panel.notes}) == len(panel.notes) >= 4
    path = plots.save(made.figure, tmp_path / "figure.svg")
    assert "<svg" in (tmp_path / "figure.svg").read_text(encoding="utf-8")[:2000], path


def test_figures_have_the_captions_of_the_paper_and_mark_what_is_ours():
    for number, caption in CAPTIONS.items():
        assert caption in papers.entry(f"rib-figure-{number}").title
    assert title(6, "torque 0.2 N m") == f"{CAPTIONS[6]}\n(figure 6 of Yi et al. 2017; ours: torque 0.2 N m)"


@pytest.mark.usefixtures("until_the_whip")
def test_added_panels_and_curves_are_marked_as_ours():
    for make, number in ((rib_figures.figure_7, 7), (rib_figures.figure_8, 8), (rib_figures.figure_9, 9)):
        made = make(QUICK)
        assert made.figure.title.startswith(title(number, "torque 0.2 N m")[:-1])
        first, *added = made.figure.panels
        assert all(panel.title.startswith("ours: ") for panel in added)
        assert not first.title
        labels = {line.label for line in first.lines if line.label}
        assert {label for label in labels if not label.startswith("ours: ")} <= {
            f"$a$ = {a:g} 1/s" for a in (0, 0.2, 0.5)
        }


def test_a_search_by_nodes_must_reach_beyond_the_hub():
    outside, middle = straddling_distances(1.2)
    assert middle == 0.6
    assert outside == pytest.approx(0.6 * np.sqrt(2.0))


def test_an_interrupted_run_is_the_last_one(monkeypatch):
    class Stopped:
        status = "interrupted"

    monkeypatch.setattr(rib_runs, "winding", lambda **_: Stopped())
    said = []
    assert len(list(rib_runs.runs([{"damping__alpha": 0.0}, {}], said.append))) == 1
    assert said == ["run 1 of 2: damping.alpha 0.0"]
