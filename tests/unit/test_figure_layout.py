"""How figures are printed: texts lie on the sheet, do not cover one another, and no legend covers a curve."""

import pathlib

import numpy as np
import pytest
from matplotlib.text import Text

import evolvent
from evolvent import cases
from evolvent_base import plots, ticks
from evolvent_base.figures import WIDTH, Figure, Line, Map, Note, Panel, axis_label, counts, plain, y_limits
from evolvent_massprops import mode_figures
from evolvent_massprops.identification import identify
from evolvent_papers import papers
from layout import boxes, faults

#: Built-in cases that are no structures, and keys that make their runs short; `test_builtin_cases.py` draws the others.
SHORT = {
    "heliogyro": {"solver.duration": 20.0},
    "inertia-stand": {},
    "wrapped-rib": {"solver.duration": 10.0},
    "wrapped-rib-deploy": {"solver.duration": 100.0},
    "wrapped-rib-hold": {"hold.time": 20.0},
}
SCHEMATICS = [name for name, entry in papers.ENTRIES.items() if "schematic" in entry.function]


def figure_of(*panels):
    return Figure(name="f", title="", panels=list(panels), height=35.0 * len(panels))


@pytest.mark.slow
@pytest.mark.parametrize("name", SCHEMATICS)
def test_schematics_of_papers(name):
    assert faults(papers.ENTRIES[name].make(papers.Options(quick=True)).figure) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", SHORT)
def test_figures_of_built_in_cases(name):
    run = evolvent.run(name, SHORT[name])
    figures = cases.presenter(run).figures(run)
    assert figures
    assert [fault for figure in figures for fault in faults(figure)] == []


@pytest.mark.slow
def test_figures_of_signals_and_maps():
    t = np.arange(200) / 50.0
    data = {f"corner {k}": np.cos(9.0 * t + k) + 0.2 * np.cos(21.0 * t) for k in range(8)}
    modes = identify(data, rate=50.0, order=2)
    x = np.linspace(-0.5, 0.5, 6)
    energy = Map(
        x=x, y=x, values=np.abs(x)[:, None] + np.abs(x) + 1e-3, label="energy, kg m2/s2", log=True, limits=(1e-3, 1.0)
    )
    long = "a long title of a panel, which says what is drawn and goes over more than one line of the sheet " * 2
    panels = [Panel(x_label="offset $e_x$, m", y_label="offset $e_z$, m", lines=[], map=energy, title=long)] * 2
    figures = [
        *mode_figures.figures(modes, "mm"),
        Figure(name="map", title=long, panels=panels, columns=2, height=95.0),
    ]
    assert [fault for figure in figures for fault in faults(figure)] == []


@pytest.mark.slow
def test_figures_have_the_width_of_a_page_and_text_that_can_be_read():
    lines = [Line(x=np.arange(3.0), y=np.arange(3.0) * k, label=f"line {k}", color=k) for k in range(9)]
    figure = Figure(name="f", title="F", panels=[Panel(x_label="time, s", y_label="y, m", lines=lines)], height=80.0)
    sheet = plots.sheet(figure)
    assert sheet.get_size_inches() * 25.4 == pytest.approx([WIDTH, 80.0])
    sizes = {text.get_fontsize() for text in sheet.findobj(Text) if text.get_text()}
    assert min(sizes) >= 7.0
    assert len({str(line.get_linestyle()) + str(line._dash_pattern) for line in sheet.axes[0].lines[:7]}) == 7
    assert len(plots.sheet(Figure(name="f", title="", panels=list(figure.panels) * 3, columns=2)).axes) == 3


def test_labels_of_axes_have_units_in_brackets():
    assert axis_label("time, s") == "time [s]"
    assert axis_label("momentum, 1e-3 kg m2/s") == "momentum [10⁻³ kg m²/s]"
    assert axis_label("gap, um") == "gap [µm]"
    assert axis_label(", rad/s") == "[rad/s]"
    assert axis_label("sensor") == "sensor"
    assert plain(r"moment $I_{xx}$, $\alpha$ = 1") == "moment Ixx, \N{GREEK SMALL LETTER ALPHA} = 1"


def test_a_power_of_ten_stands_before_the_unit_of_the_label():
    """Beside the axis it would lie on the legend."""
    x = np.linspace(0.0, 1.0, 5)
    line = Line(x=x, y=3e-5 * x, label="force")
    words = [
        text for text, _ in boxes(plots.sheet(figure_of(Panel(x_label="time, s", y_label="force, N", lines=[line]))))
    ]
    assert "force [10⁻⁵ N]" in words
    assert not any("times" in text for text in words)
    line = Line(x=x, y=3e5 * x)
    words = [text for text, _ in boxes(plots.sheet(figure_of(Panel(x_label="time, s", y_label="cases", lines=[line]))))]
    assert "cases [10⁵]" in words


def test_a_unit_is_not_broken_into_two_lines():
    panel = Panel(x_label="t, s", y_label="a long name of it, N m s", lines=[Line(x=np.ones(2), y=np.ones(2))])
    words = [text for text, _ in boxes(plots.sheet(figure_of(panel, panel, panel)))]
    assert any("\n" in text for text in words)
    assert any(text.endswith("[N m s]") for text in words)


def test_a_line_looks_the_same_in_all_panels_that_share_a_legend():
    x = np.arange(3.0)
    panels = [
        Panel(x_label="", y_label="", lines=[Line(x=x, y=x * k, color=k, label=label) for k in (1, 2)])
        for label in ("a", "")
    ]
    first, second = plots.sheet(Figure(name="f", title="", panels=panels, columns=2)).axes
    styles = [[line._unscaled_dash_pattern for line in axis.lines] for axis in (first, second)]
    assert styles[0] == styles[1]
    assert styles[0][0] != styles[0][1]


def test_panels_over_one_another_share_the_axis_that_the_lowest_names():
    x = np.linspace(0.0, 3.0, 4)
    lines = [Line(x=x, y=x), Line(x=x, y=np.where(x > 1.5, x, np.nan))]
    panels = [Panel(x_label="time, s" if k else "", y_label="y, m", lines=[line]) for k, line in enumerate(lines)]
    first, second = plots.sheet(figure_of(*panels)).axes
    assert first.get_xlim() == second.get_xlim() == pytest.approx((-0.06, 3.06))
    shown = [axis.xaxis.get_tick_params()["labelbottom"] for axis in (first, second)]
    assert shown == [False, True]
    named = [Panel(x_label="time, s", y_label="y, m", lines=[line]) for line in lines]
    first, second = plots.sheet(figure_of(*named)).axes
    assert first.get_xlim() != second.get_xlim()


def test_powers_at_logarithmic_axes_are_plain_text():
    x = np.linspace(0.0, 1.0, 30)
    panel = Panel(x_label="time, s", y_label="energy, J", lines=[Line(x=x, y=10.0 ** (-6.0 * x))], log=True)
    words = {text for text, _ in boxes(plots.sheet(figure_of(panel)))}
    assert {"10⁰", "10⁻¹", "10⁻⁶"} & words
    assert not any("$" in text for text in words)


def test_shared_ticks_draw_the_same_picture():
    """Linear axes with a common power of ten, logarithmic axes with minor ticks, and a map."""
    x = np.linspace(1.0, 30.0, 30)
    panels = [
        Panel(x_label="time, s", y_label="", lines=[Line(x=x, y=1e7 * np.sin(x), label="sine")]),
        Panel(x_label="time, s", y_label="energy, J", lines=[Line(x=x, y=x)], log=True, log_x=True),
        Panel(x_label="x, m", y_label="y, m", lines=[], map=Map(x=x, y=x, values=np.outer(x, x), label="z, m")),
    ]
    drawn = plots.sheet(figure_of(*panels), dpi=100.0)
    points, _ = plots._points(drawn)
    along = [one for axis in drawn.axes for one in (axis.xaxis, axis.yaxis)]
    assert all(len(one.majorTicks) <= 1 and len(one.minorTicks) <= 1 for one in along[:6])
    for one in along:
        one.get_major_ticks()
        one.get_minor_ticks()
    assert sum(len(one.majorTicks) for one in along) > 20
    assert np.array_equal(plots._points(drawn)[0], points)


def test_names_of_the_y_axes_stand_in_one_column():
    x = np.linspace(0.0, 1.0, 5)
    panels = [Panel(x_label="time, s", y_label="y, m", lines=[Line(x=x, y=size * x)]) for size in (1.0, 1e4)]
    words = boxes(plots.sheet(figure_of(*panels)))
    first, second = (box for text, box in words if text == "y [m]")
    assert first.x0 == pytest.approx(second.x0, abs=0.5)


def test_the_inside_of_a_hub_is_filled():
    circle = np.linspace(0.0, 2.0 * np.pi, 40)
    line = Line(x=np.cos(circle), y=np.sin(circle), fill="gainsboro")
    sheet = plots.sheet(figure_of(Panel(x_label="x, m", y_label="y, m", lines=[line], equal=True)))
    assert len(sheet.axes[0].patches) == 1


def test_small_differences_look_small():
    x = np.arange(3.0)

    def ends(y, **given):
        return y_limits(Panel(x_label="", y_label="", lines=[Line(x=x, y=np.asarray(y))], **given))

    assert ends([-1e-6, 0.0, 2e-6], y_span=0.02) == (-0.01, 0.01)
    assert ends([-1.0, 0.0, 2.0], y_span=0.02) is None
    assert ends([5.0, 5.0 + 1e-9, 5.0]) == pytest.approx((4.5, 5.5))
    assert ends([0.0, 1.0, 2.0], y_zero=True) == pytest.approx((0.0, 2.1))
    assert ends([1.0, 2.0, 3.0], y_span=0.02, log=True) is None


@pytest.mark.parametrize(
    ("label", "y", "whole"),
    [("points", [0.0, 3.0, np.nan], True), ("points", [0.0, 2.5], False), ("speed, m/s", [0.0, 3.0], False),
     ("points", [2.0, 2.0], False)],
)  # fmt: skip
def test_an_axis_that_counts_has_ticks_at_whole_numbers_alone(label, y, whole):
    panel = Panel(x_label="time, s", y_label=label, lines=[Line(x=np.arange(len(y)), y=np.array(y))])
    assert counts(panel, "y") == whole
    if whole:
        (axis,) = plots.sheet(Figure(name="n", title="t", panels=[panel])).axes
        assert np.all(axis.get_yticks() == np.round(axis.get_yticks()))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "head"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_formats_of_files(kind, head, tmp_path):
    line = Line(x=np.arange(3.0), y=np.arange(3.0))
    figure = Figure(name="f", title="F", panels=[Panel(x_label="time, s", y_label="y, m", lines=[line])])
    (path,) = plots.draw([figure], tmp_path, kind=kind)
    assert path.endswith(f"f.{kind}")
    content = pathlib.Path(path).read_bytes()
    assert content.startswith(head)
    assert content == plots.picture(figure, kind)
    if kind == "pdf":
        assert b"/Type0" in content  # an embedded TrueType font, no outlines of letters
        assert b"/MediaBox [ 0 0 493.2" in content  # 174 mm in points


def test_faults_of_a_layout_are_found(monkeypatch):
    for module in (plots, ticks):
        monkeypatch.setattr(module, "wrapped", lambda text, size, width: text)
    line = Line(x=np.arange(2.0), y=np.arange(2.0))
    notes = [Note(at=(0.5, 0.5), text="one"), Note(at=(0.5, 0.5), text="another")]
    panel = Panel(x_label="x, m", y_label="y" * 80, lines=[line], notes=notes)
    found = faults(Figure(name="f", title="F", panels=[panel], height=60.0))
    assert "f: 'one' and 'another' cover one another" in found
    assert any(fault.endswith("is cut off") for fault in found)
