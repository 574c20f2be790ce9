"""The page of a run that answers what is asked of a deployment, and the order of its table."""

import numpy as np
import pytest

import evolvent
from evolvent import System, cases, parts
from evolvent.view import balance, show, summary, table
from evolvent_base.figures import Line

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def array():
    return evolvent.run("solar-array")


def test_the_table_begins_with_latches_in_order_of_time(array):
    rows = cases.presenter(array).numbers(array)
    labels = [row.label for row in rows]
    assert labels[:3] == ["hinge 2, latch", "hinge 3, latch", "hinge 1, latch"]
    rate = float(array["hinge 2"]["latch_rate"][-1])
    assert f"with a rate of {abs(np.degrees(rate)):.3g} deg/s" in rows[0].value
    assert "pivot 1.angle" not in labels  # hinge 1 shows this motion
    k = int(np.argmax(np.linalg.norm(array["panel 3"]["rate"], axis=1)))
    values = {row.label: row.value for row in rows}
    assert values["panel 3.rate"].endswith(f"at {float(array.time[k]):.4g} s")


def test_the_summary_answers_what_is_asked(array):
    figures = cases.presenter(array).figures(array)
    assert [figure.name for figure in figures] == ["summary", "rigid-body", "joint-spring", "energy-balance"]
    strip, angles, torques, rate, turn, energy = figures[0].panels
    assert strip.y_names == {0.0: "hinge 1 to 3 latched"}
    np.testing.assert_allclose(strip.lines[0].x, array.ev.latches.time)
    assert [panel.y_label for panel in figures[0].panels[1:]] == [
        "angle, deg", "latch torque, N m", "rate of satellite about z, deg/s", "turn of satellite, deg", "energy, J",
    ]  # fmt: skip
    marks = {float(line.x[0]): line for line in angles.lines if line.marker == "o"}
    held = array.ev.latches
    np.testing.assert_allclose(sorted(marks), held.time)
    for time in marks:
        assert marks[time].y == pytest.approx(0.0, abs=1.0)  # they latch at 0
    # the torque that the table states, which is between samples, is marked, and not only the largest sample
    peaks = sorted(abs(float(line.y[0])) for line in torques.lines if line.marker == "o")
    np.testing.assert_allclose(peaks, np.sort(np.abs(held.peak)))
    sampled = max(float(np.abs(line.y).max()) for line in torques.lines if line.marker != "o")
    assert sampled < peaks[-1]
    # the page ends where nothing changes any more
    end = float(angles.lines[0].x[-1])
    assert float(held.time.max()) < end < 0.6 * float(array.time[-1])
    later = array["satellite"]["rate"].values[array.time.values > end]
    assert np.abs(later).max() < 0.01 * np.abs(array["satellite"]["rate"].values).max()
    assert rate.lines[0].y.max() == pytest.approx(np.degrees(array["satellite"]["rate"][:, 2].values.max()))
    attitude = array["satellite"]["attitude"].values
    assert turn.lines[0].y.max() == pytest.approx(np.degrees(2.0 * np.arccos(np.abs(attitude[:, 0]))).max(), rel=0.02)
    assert energy.lines[0].label == "kinetic"
    (torque,) = figures[2].panels  # the angles are in the summary
    assert torque.y_label.endswith("N m")


def test_figures_of_kinds_have_no_curves_of_round_off_and_one_for_equal_parts(array):
    run = array.copy()
    held = run["satellite"].to_dataset()
    run["satellite"] = held.assign(rate=held["rate"] * 1e-14 + 1e-17)
    run["panel 2"] = run["panel 3"].to_dataset().assign_attrs(run["panel 2"].attrs)
    bodies = next(figure for figure in show.figures(run) if figure.name == "rigid-body")
    (rates,) = (panel for panel in bodies.panels if "angular velocity" in panel.y_label)
    assert [line.label for line in rates.lines] == ["panel 1", "panel 2 and 3"]


def test_roots_of_beams_show_their_largest_loads():
    run = evolvent.run("boom-slew", {"simulate.until": 3.0})
    force, moment, *_ = summary.figures(run)[0].panels
    size = np.linalg.norm(run["clamp"]["moment"], axis=1)
    line, mark = moment.lines
    assert float(mark.y[0]) == size.max()
    np.testing.assert_allclose(line.y, size)
    assert line.label.endswith(f"at {float(run.time[int(size.argmax())]):.4g} s")
    assert force.y_label == "force in joints, N"


def test_cords_that_are_constraints_are_shown_with_their_peaks_and_curves_that_are_not_seen_are_not():
    run = evolvent.run("yo-yo-despin")
    tension, rate, turn, _ = summary.figures(run)[0].panels
    values = run["cord 1"]["tension"].values
    k = int(np.argmax(values))
    assert tension.y_label == "tension of joints, N"
    assert tension.lines[0].label == f"cord 1 and 2: {values[k]:.3g} N at {float(run.time[k]):.4g} s"
    assert rate.lines[0].label == "largest: 286 deg/s at 0 s"  # 5 rad/s at the start
    assert (float(rate.lines[1].x[0]), rate.lines[1].marker) == (0.0, "o")
    assert turn.y_label == "turn of body, deg"
    left = next(row for row in balance.balance_numbers(run) if row.label == "energy at the end")
    assert [one.what for one in left.quantities] == ["kinetic"]  # nothing is elastic
    run["cord 2"] = run["cord 2"].to_dataset().assign(tension=1e-5 * run["cord 2"]["tension"])
    assert len(summary.figures(run)[0].panels[0].lines) == 2  # one curve and the mark of its peak


def test_many_different_curves_of_repeated_parts_are_a_band():
    """Its sides are the least and the largest values, its mark is at the largest one, whose part is named."""
    time = np.linspace(0.0, 1.0, 11)
    curves = {f"cord {k}": Line(x=time, y=k * time * (1.0 - time)) for k in range(1, 9)}
    curves["tie"] = Line(x=time, y=-time)
    tie, band, *marks = summary._with_peaks(curves, "N")
    assert (tie.label, tie.fill) == ("tie: 1 N at 1 s", "")
    assert band.label == "cord 1 to 8: 2 N at 0.5 s (cord 8)"
    assert band.fill.startswith("#")
    low, high = summary._curves_of(band, time.size)
    np.testing.assert_allclose([low, high], [curves["cord 1"].y, curves["cord 8"].y])
    assert [(float(mark.x[0]), float(mark.y[0])) for mark in marks] == [(1.0, -1.0), (0.5, 2.0)]
    few = {part: curves[part] for part in ("cord 1", "cord 2", "cord 3")}
    assert [line.fill for line in summary._with_peaks(few, "N")] == [""] * 6


def test_what_has_no_latch_spring_or_root_has_no_summary():
    system = System()
    system.add(parts.Point(position=(1.0, 0.0, 0.0), mass=1.0), "mass")
    system.add(parts.Spring(a=("ground", (0.0, 0.0, 0.0)), b="mass", stiffness=1.0, length=0.5), "spring")
    run = system.simulate(until=1.0)
    assert [figure.name for figure in summary.figures(run)] == [figure.name for figure in show.figures(run)]


def test_events_stand_in_the_table():
    run = evolvent.run("heliogyro", {"solver.duration": "30 s"})
    rows = {row.label: row.value for row in table.joined(table.event_rows(run))}
    assert rows["blade-1, released"].startswith("at 0, ")
