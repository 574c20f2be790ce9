"""Figures of the paper on the inertia stand: their numbers against closed forms, and their panels."""

import numpy as np
import pytest

import evolvent
from evolvent_papers import papers
from evolvent_papers.papers import Options, stand, stand_error, stand_prony, stand_pulls, stand_schematic

QUICK = Options(quick=True)


def columns(text):
    """Rows of the last Markdown table of a text, as lists of str."""
    rows = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]


@pytest.fixture(scope="module")
def over():
    return stand.grid()


@pytest.mark.slow
def test_the_grid_is_the_papers_999_points_and_holds_the_box(over):
    assert over.x.size * over.z.size == 999
    for offset in (0.0, 0.4, 0.8):
        assert np.abs(over.x - offset).min() < 1e-12
    assert np.abs(over.z - 0.4 * over.case.stand.half_width).min() < 1e-12


def test_the_sum_of_energies_is_the_same_at_all_999_points(over):
    expected = 3.0 * 9806.65**2 / (8.0 * 740250.0)
    assert over.energies(over.x[:, None], over.z[None, :]).sum(axis=-1) == pytest.approx(expected, rel=1e-9)


def test_a_mode_gets_no_energy_where_its_axis_passes_through_the_loaded_spring(over):
    """At (ex, 0) the axis of pitch is at x = a where the energy of pitch vanishes."""
    from scipy.optimize import brentq

    def beyond(ex):
        return over.modes(ex, 0.0).axes()[0][1, 0] - over.case.stand.half_length

    ex = brentq(beyond, 0.5, 1.19)
    body = over.case.body
    assert ex == pytest.approx(np.sqrt(4.0 - body.inertia[2] / body.mass), rel=1e-9)  # a^2 - ex^2 = Izz / M
    assert over.energies(ex, 0.0)[1] < 1e-12 * over.energies(ex, 0.0).sum()


def test_figure_1_draws_springs_where_they_are():
    made = stand_schematic.figure_1(QUICK)
    plan = made.figure.panels[2]
    springs = [line for line in plan.lines if line.marker in ("o", "X")][:4]
    assert [(float(line.x[0]), -float(line.y[0])) for line in springs] == [
        (2, 0.8696),
        (2, -0.8696),
        (-2, -0.8696),
        (-2, 0.8696),
    ]
    assert sum(line.label.startswith("axis of") for line in plan.lines) == 3
    assert all(not panel.axes and panel.equal for panel in made.figure.panels)


@pytest.mark.parametrize(
    ("number", "caption"),
    [
        (1, "scheme of the measuring stand"),
        (2, "distribution of the energy over the modes of oscillation (J)"),
        (3, "amplitudes of oscillation by modes and by numbers $i$ of the springs' attachments"),
        (4, "least energies of the modes of oscillation (J)"),
        (5, "frequencies by modes of oscillation (rad/s)"),
    ],
)
@pytest.mark.slow
def test_figures_have_their_printed_captions_and_name_what_is_ours(number, caption):
    """The captions are the paper's, translated; of each figure some words say what of it is ours."""
    title = papers.STAND[f"stand-figure-{number}"].make(QUICK).figure.title
    assert title.startswith(f"Figure {number} of Belyakov (2002): {caption}")
    assert "ours" in title.lower() or "our reading" in title.lower()


def bars(panel):
    """Heights of the bars of a panel, in the order in which they are drawn: one series after the other."""
    return np.array([line.y.max() for line in panel.lines if line.fill])


@pytest.mark.slow
def test_figure_2_has_a_bar_a_mode_and_offset(over):
    made = stand.figure_2(QUICK)
    assert "Our reading" in made.figure.title
    for panel, offsets in zip(made.figure.panels, stand.ENERGY_BARS, strict=True):
        expected = [over.energies(*at) for at in offsets]
        assert bars(panel) == pytest.approx(np.ravel(expected), abs=0.01)
        assert list(panel.x_names.values()) == ["along Y\n(heave)", "about Z\n(pitch)", "about X\n(roll)"]
    assert [row[2:5] for row in columns(made.text)][1] == ["30.21", "2.27", "16.24"]


def test_bars_stand_side_by_side():
    lines = [line for line in stand._bars(np.ones((3, 2)), ["a", "b", "c"]) if line.fill]
    ends = sorted((float(line.x.min()), float(line.x.max())) for line in lines)
    assert np.ravel(ends[:3]) == pytest.approx([-0.4, -0.4 / 3, -0.4 / 3, 0.4 / 3, 0.4 / 3, 0.4])
    assert ends[3][0] == pytest.approx(0.6)


@pytest.mark.slow
def test_figure_3_obeys_the_energy_of_the_load(over):
    """The energy of a mode is half the load times its amplitude at the loaded spring, and (k/2) times all squares."""
    made = stand.figure_3(QUICK)
    assert "Our reading" in made.figure.title
    rows = columns(made.text)
    for offset, panel, at in zip(stand.AMPLITUDE_BARS, made.figure.panels, (0, 3), strict=True):
        amplitude = 1e-3 * np.array([row[3:] for row in rows[at : at + 3]], dtype=float)
        energies = over.energies(*offset)
        assert amplitude[:, 0] * 9806.65 / 2.0 == pytest.approx(energies, rel=2e-3)
        assert 0.5 * 740250.0 * (amplitude**2).sum(axis=1) == pytest.approx(energies, rel=2e-3)
        assert bars(panel).reshape(4, 3).T * 1e-3 == pytest.approx(amplitude, abs=1e-7)


@pytest.mark.slow
def test_energies_have_simulated_ones_on_the_curves(over):
    made = stand.energies(QUICK)
    for panel in made.figure.panels:
        for k in range(3):
            curve, circles = panel.lines[k], panel.lines[3 + k]
            assert circles.y == pytest.approx(np.interp(circles.x, curve.x, curve.y), abs=0.01)
    assert [row[2:5] for row in columns(made.text)][1] == ["30.21", "2.271", "16.24"]


@pytest.mark.slow
@pytest.mark.slow
def test_pulls_other_than_at_one_spring_leave_no_mode_dead():
    """The share of the box with a dead mode is that of the map for one spring, and 0 for the others."""
    made = stand_pulls.figure(QUICK)
    assert len(made.figure.panels) == 4
    shares = [float(row[-1]) for row in columns(made.text)]
    over = stand.grid()
    x, z = over.x[np.abs(over.x) < 0.8001], over.z[np.abs(over.z) < 0.34785]
    least = over.least_energies(x[:, None], z[None, :])[0]
    assert shares[0] == pytest.approx(100.0 * np.mean(least < 0.01 * 9806.65**2 / (8.0 * 740250.0)), abs=0.06)
    assert shares[1:] == [0.0, 0.0, 0.0]


def test_amplitudes_obey_the_energy_of_the_load(over):
    made = stand.amplitudes(QUICK)
    amplitude = [float(row[2]) for row in columns(made.text)]
    energies = [over.energies(x, 0.0) for x in (0.0, 0.4, 0.8)]
    assert np.array(amplitude) * 1e-3 * 9806.65 / 2.0 == pytest.approx(np.ravel(energies), rel=2e-3)
    assert len(made.figure.panels) == 6


@pytest.mark.slow
def test_figure_4_gives_the_numbers_of_the_text():
    made = stand.figure_4(QUICK)
    surface, flat, *ours = made.figure.panels
    assert surface.map.values == pytest.approx(flat.map.values)
    assert surface.map.surface
    assert surface.map.limits is None
    assert flat.map.bar_label == "energy [J], one colour below 0.001"
    assert all(panel.title.startswith("ours") for panel in (flat, *ours))
    rows = columns(made.text)
    assert rows[0] == ["spring 1", "1.3e-05", "2.72", "13.4", "82.1"]
    assert rows[1] == ["best spring", "0.17", "7.04", "0.0", "99.1"]


@pytest.mark.slow
def test_figure_5_falls_rises_and_stays():
    made = stand.figure_5(QUICK)
    rows = np.array(columns(made.text), dtype=float)
    assert rows[:, 1:4] == pytest.approx(
        np.array([[13.962, 16.422, 24.590], [13.229, 17.332, 24.590], [12.036, 19.050, 24.590]]), abs=6e-4
    )
    left, right = made.figure.panels
    assert [line.label for line in left.lines[:2]] == [
        "oscillation along the vertical axis",
        "rotation about the Z axis",
    ]
    assert left.x_label.startswith(
        "displacement of the centre of mass relative to the centre of stiffness along the X axis"
    )
    assert [np.sign(line.y[-1] - line.y[1]) for line in left.lines[2:]] == [-1.0, 1.0]
    assert "rotation about the X axis stays at 24.59 rad/s" in left.title
    assert np.abs(right.lines[2].y).max() < 120.0  # ppm


def test_every_entry_is_a_function():
    import importlib

    for one in papers.STAND.values():
        module, _, name = one.function.partition(".")
        assert callable(getattr(importlib.import_module(f"evolvent_papers.papers.{module}"), name))


@pytest.mark.slow
def test_the_step_makes_the_papers_error():
    """Without offset, by the closed form (w_roll^2 - w_heave^2) dt^2/24; the fit on an exact motion has none."""
    found = stand_error.errors({"identification.method": "varpro"}, stand_error.OFFSETS[:1])[0]
    assert found == pytest.approx(stand_error.of_the_step(), rel=0.03)
    exact = stand_error.errors(stand_error.VARIANTS["DOP853 and VARPRO"], stand_error.OFFSETS[:1])[0]
    assert np.abs(exact).max() < 1e-5


@pytest.mark.slow
def test_the_papers_case_shows_its_printed_frequency():
    run = evolvent.run("inertia-stand-paper")
    assert f"{float(run.mode_frequency[-1]):.2f}" == "24.59"
    assert float(run.linear_frequency[-1]) == pytest.approx(24.6015, abs=1e-3)
    assert run.attrs["status"] == "success"


@pytest.mark.slow
def test_prony_is_biased_and_varpro_reaches_the_bound():
    record = stand_prony.Record()
    assert stand_prony.accuracy(stand_prony.plain_prony, record, 40).error > 5.0 * stand_prony.bound(record)
    assert stand_prony.accuracy(stand_prony.maximum_likelihood, record, 40).error < 1.5 * stand_prony.bound(record)
    once, again = (stand_prony.accuracy(stand_prony.plain_prony, record, 40) for _ in range(2))
    assert (once.error, once.failed) == (again.error, again.failed)


@pytest.mark.parametrize("damping", [0.002, 0.005, 0.01])
def test_the_bound_of_a_decrement_has_a_closed_form(damping):
    """Modes that are resolved: 4 beats of the nearest two fit into the record, and each swings often."""
    record = stand_prony.Record(damping=damping)
    assert stand_prony.single_mode_bounds(record) == pytest.approx(stand_prony.bounds(record)[1], rel=0.03)
    undamped = stand_prony.bounds(stand_prony.Record())
    time = np.arange(100) / stand_prony.Record().rate
    expected = 0.01 * np.sqrt(2.0 / (np.square(time - time.mean()).sum())) / stand_prony.frequencies()
    assert undamped[0] == pytest.approx(expected, rel=0.03)  # Rife and Boorstyn (1974)
    assert np.isnan(undamped[1]).all()


def test_decrements_are_right_without_noise_and_off_with_it():
    clean = stand_prony.Record(damping=0.01, noise=0.0)
    for method in (stand_prony.plain_prony, stand_prony.maximum_likelihood):
        assert stand_prony.accuracy(method, clean, 1).decrement < 1e-6
    noisy = clean._replace(noise=0.01)
    found = stand_prony.errors(stand_prony.plain_prony, noisy, 40)[1]
    least = stand_prony.bounds(noisy)[1]
    assert np.all(np.sqrt(np.mean(found**2, axis=0)) > 1.5 * least)
    assert np.all(np.abs(found.mean(axis=0))[:2] > 2.0 * least[:2])  # of heave and pitch it is a bias
    assert least.min() > 500.0 * stand_prony.CLAIMED


@pytest.mark.slow
def test_the_study_of_prony_has_its_table_and_panels(monkeypatch):
    monkeypatch.setattr(stand_prony, "QUICK_TRIALS", 4)
    monkeypatch.setattr(stand_prony, "TABLE_RATES", (2.4, 9.0))
    monkeypatch.setattr(stand_prony, "_fewer", lambda trials: 2)
    made = stand_prony.figure_prony(QUICK)
    rows = columns(made.text)
    assert [row[1] for row in rows] == ["2.4", "9"] * 3
    assert [row[0] for row in rows[::2]] == ["0 (frequency)", "0.002", "0.01"]
    assert float(rows[0][2]) < 0.1 < 50.0 < float(rows[1][2])
    assert len(made.figure.panels) == 6
