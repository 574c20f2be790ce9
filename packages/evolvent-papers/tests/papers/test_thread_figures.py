"""Figures of the thread paper, from short runs: what the paper or the model says they show."""

import json

import numpy as np
import pytest
import xarray as xr

from evolvent import cases
from evolvent_papers import papers
from evolvent_papers.papers import Options, thread, thread_runs, thread_schematics, thread_spool_node

QUICK = Options(quick=True)


@pytest.fixture
def short(monkeypatch):
    """Runs of figures end after 21 s, in which three nodes leave the spool."""
    monkeypatch.setattr(thread_runs, "SHARED", {"solver.duration": 21.0})


def cells(text):
    """The rows of a Markdown table, without its head."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.mark.parametrize("name", ["2-1", "3-1", "3-2", "4-1"])
def test_schematics_are_drawn(name):
    name = f"thread-figure-{name}"
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


def test_groups_of_nodes_differ_in_colour_and_labels_point_at_one_of_each():
    (panel,) = thread_schematics.figure_3_1(QUICK).figure.panels
    marks = [line for line in panel.lines if line.marker]
    assert len({line.color for line in marks}) == len({line.marker for line in marks}) == 3
    places = [(line, np.column_stack([line.x, line.y])) for line in marks]
    found = []
    for name in ("free nodes", "boundary node", "nodes on the spool (wound)"):
        (note,) = [note for note in panel.notes if note.text == name]
        nearest = min(places, key=lambda one: np.linalg.norm(one[1] - note.points_to, axis=1).min())
        assert np.linalg.norm(nearest[1] - note.points_to, axis=1).min() < 0.5
        found.append(nearest[0].marker)
    assert len(set(found)) == 3


def test_the_boundary_node_of_figure_3_2_is_node_1_as_printed():
    made = thread_schematics.figure_3_2(QUICK)
    notes = " ".join(note.text for note in made.figure.panels[0].notes)
    assert "boundary node\n$i$ = 1" in notes
    assert "$i$ = 2" in notes
    seen = thread_schematics.drawn(*thread_schematics.BOUNDARY)
    assert seen.out == 1
    rows = dict(cells(made.text))
    assert 0.8 < float(rows["least distance of the link of eqs. (3, 4) from the spool's axis over r"]) < 0.99


@pytest.mark.parametrize("name", ["2-1", "3-1", "3-2", "4-1"])
def test_schematics_say_what_is_ours(name):
    (panel,) = papers.entry(f"thread-figure-{name}").make(QUICK).figure.panels
    assert any(note.text.startswith("ours: ") for note in panel.notes)


def test_figure_4_1_has_the_symbols_of_the_paper():
    (panel,) = thread_schematics.figure_4_1(QUICK).figure.panels
    text = " ".join(note.text for note in panel.notes)
    for symbol in (r"\Omega_{KA}", "J_{KA}", "L_0", "m_K", r"\Delta_1", "X_1", "Y_1"):
        assert symbol in text


def test_the_boundary_node_is_its_rest_length_from_the_departure_point():
    """Eq. (10), with links of fixed length."""
    rows = dict(cells(thread_schematics.figure_3_2(QUICK).text))
    rest, distance = (float(rows[key]) for key in rows if key.endswith("mm"))
    assert distance == pytest.approx(rest, abs=1e-4)


@pytest.fixture(scope="module")
def fourteen():
    """Figures IV.2 and IV.3 of the quick form from the same runs, which end after 21 s."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(thread_runs, "SHARED", {"solver.duration": 21.0})
        runs = thread._fourteen(QUICK)
        patch.setattr(thread, "_fourteen", lambda options: runs)
        yield thread.figure_4_2(QUICK), thread.figure_4_3(QUICK)


def test_entries_have_the_numbers_of_the_paper():
    numbers = ["2-1", "3-1", "3-2", "3-3", "3-4", "4-1", "4-2", "4-3", "4-4"]
    assert [name for name in papers.THREAD if "figure" in name] == [f"thread-figure-{k}" for k in numbers]
    assert papers.THREAD["thread-table-4-1"].kind == "table"


@pytest.mark.slow
def test_the_boundary_node_leaves_the_plane_by_eqs_3_4_and_stays_in_it_by_eqs_7_8(monkeypatch):
    """Figures III.3 and III.4: the fewer nodes on a turn, the larger the oscillation along Z; the thread stays out.

    The last row is the film, which is not drawn as the paper's: it winds about itself.
    """
    monkeypatch.setattr(thread_spool_node, "NODES", (6, 12, 24))
    shaken, straight = (
        [[float(cell) for cell in row] for row in cells(make(QUICK).text)]
        for make in (thread_spool_node.figure_3_3, thread_spool_node.figure_3_4)
    )
    assert [row[0] for row in shaken] == [6, 12, 24, 12]
    *regular, film = shaken
    assert regular[0][3] > 1.25 * regular[1][3] > 1.5 * regular[2][3] > 0.1
    assert all(tip > 0.9 * out for *_, tip, out in regular)
    assert film[3] > 1.0
    assert film[4] < 0.8 * film[5]
    *undisturbed, across = straight
    for *_, off, tip, out in undisturbed:
        assert off == 0.0
        assert tip == out
    *_, off, tip, out = across  # its tip starts along Z at a tenth of the pay-out's speed
    assert [tip / out, off / out] == pytest.approx([1.0 / 1.01**0.5, 0.1 / 1.01**0.5], rel=1e-3)


@pytest.mark.slow
def test_the_map_has_a_value_for_each_stiffness_damping_number_of_nodes_and_weight(monkeypatch):
    monkeypatch.setattr(thread_spool_node, "NODES", (6, 12))
    made = thread_spool_node.node_map(QUICK)
    stiffnesses, dampings = thread_spool_node.QUICK_TENSILE, thread_spool_node.QUICK_DAMPINGS
    assert [row[:3] for row in cells(made.text)] == [
        [str(n), weight, f"{c:g}"] for n in (6, 12) for weight in ("no", "yes") for c in stiffnesses
    ]
    assert all(len(row) == 3 + len(dampings) for row in cells(made.text))
    for panel in made.figure.panels:
        assert panel.map.values.shape == (len(dampings), len(stiffnesses))
        assert {note.text for note in panel.notes} <= {cell for row in cells(made.text) for cell in row}
    boxes = [line.label for line in made.figure.panels[0].lines]
    assert boxes == ["figure III.3"]
    six, twelve = (made.figure.panels[k].map.values[-1] for k in (0, 2))
    assert np.all(six > twelve)


def test_regular_cells_are_those_of_the_same_ratio_of_stiffness_to_damping():
    """Where the damper outweighs the inertia only E b h / d matters; a chaotic cell is named so."""
    one, other = (thread_spool_node.amplitude(12, c, 2.0 * c, weight=False) for c in (0.05, 0.1))
    assert not one.chaotic
    assert one.off == pytest.approx(other.off, rel=0.02)
    assert one.out > 0.98
    assert thread_spool_node.amplitude(6, 500.0, 1e-3, weight=False).chaotic


@pytest.mark.slow
def test_figure_4_2_has_a_run_and_eq_18_for_each_damping_and_number_of_nodes(fourteen):
    made, _ = fourteen
    rates, gaps = (panel.lines for panel in made.figure.panels)
    count = 2 * len(thread.QUICK_DAMPINGS)
    assert [(line.color, line.style) for line in rates] == [("black", "-")] * count + [("red", "--")] * count
    for computed, formula in zip(rates[:count], rates[count:], strict=True):
        assert 2.3 < 100.0 * (formula.y / computed.y - 1.0)[-1] < 2.7
    gap = {line.label: line.y for line in gaps}
    for n in (20, 40):
        assert 2.3 < gap[f"formula (18), $n$ = {n}"][-1] < 2.7
        assert np.abs(gap[f"with $L_0$, $n$ = {n}"]).max() < 0.15
    assert [row[0] for row in cells(made.text)] == ["20"] * (count // 2) + ["40"] * (count // 2)


def test_figures_4_2_and_4_3_have_the_captions_and_axes_of_the_paper(fourteen):
    check, lag = (made.figure for made in fourteen)
    assert check.title.startswith("Results of the check of the law of conservation of momentum")
    assert (check.panels[0].x_label, check.panels[0].y_label) == ("Time, s", "$\\Omega_{KA}$, rad/s")
    assert lag.title.startswith("Angle $\\Delta_1$ over the time of deployment (black solid line: $n$ = 20")
    for figure in (check, lag):
        assert all(panel.title.startswith("ours") for panel in figure.panels[1:])


def test_figure_4_3_starts_with_a_swing_about_the_steady_lag(fourteen):
    _, made = fourteen
    start = {line.label: line for line in made.figure.panels[1].lines}
    assert start["steady lag"].y[0] == pytest.approx(np.degrees(np.arcsin(2.0 * 0.035 / 0.3)))
    for n in (20, 40):
        line = start[f"$n$ = {n}"]
        assert np.nanmax(line.y) == pytest.approx(15.26, abs=0.05)
        assert line.x[np.nanargmax(line.y)] == pytest.approx(0.13, abs=0.07)


def test_figure_4_3_damping_does_not_matter(fourteen):
    _, made = fourteen
    assert made.complete
    rows = cells(made.text)
    assert len(rows) == 2 * len(thread.QUICK_DAMPINGS)
    assert all(float(row[-1]) < 3e-4 for row in rows)
    assert len({row[2] for row in rows}) == 1
    assert float(rows[0][2]) == pytest.approx(13.46, abs=0.005)
    curves = made.figure.panels[0].lines
    assert {(line.color, line.style) for line in curves} == {("black", "-"), ("red", "--")}
    assert len(curves) == len(rows)


def test_table_4_1_gives_the_paper_s_data_and_the_film_that_they_imply():
    text = thread.table_4_1(QUICK).text
    data, implied = text.split("Ours:")
    assert len(cells(data)) == 13
    assert ["E", "modulus of elasticity of the blade's material", "N/m2", "1.0e9"] in cells(data)
    values = {row[0]: [float(cell) for cell in row[1:]] for row in cells(implied)}
    assert values["Delta phi = L / (n r), rad"] == [25.0, 12.5]
    for k, n in enumerate((20, 40)):
        section = next(row[k] for key, row in values.items() if key.startswith("b h = c l_0"))
        assert section == pytest.approx(1e7 * (5.0 / n) / 1e9)
        film = next(row[k] for key, row in values.items() if key.startswith("b h = rho_L"))
        assert values["c = E b h / l_0 of that film, N/m"][k] == pytest.approx(1e9 * film / (5.0 / n), rel=0.01)


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_figure_4_4_curves_are_equal_to_five_decimals():
    made = thread.figure_4_4(QUICK)
    curves = made.figure.panels[0].lines
    assert [(line.color, line.style) for line in curves] == [("black", "-"), ("green", "--"), ("red", ":")]
    assert len(curves) == len(thread.STIFFNESSES)
    late = curves[0].x >= 1.0
    for curve in curves[1:]:
        assert np.abs(curve.y - curves[0].y)[late].max() < 5e-6
    assert len({tuple(row[3:5]) for row in cells(made.text)}) == 1


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_soft_segments_change_the_lag_by_per_cents_and_the_stiffer_two_coincide():
    rows = cells(thread.soft(QUICK).text)
    assert [float(row[0]) for row in rows] == list(thread.SOFT)
    assert float(rows[1][-1]) > 3.0 * float(rows[2][-1])
    assert float(rows[2][-1]) < 1.0


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
