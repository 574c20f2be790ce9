"""How figures are printed: texts lie on the sheet, do not cover one another, and no legend covers a curve."""

import itertools
import pathlib
from unittest import mock

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

#: Built-in cases and keys that make their runs short.
SHORT = {
    "andrews-mechanism": {},
    "boom-on-drum-stored": {"simulate.until": 0.05},
    "boom-slew": {"simulate.until": 1.0},
    "hanging-chain": {"simulate.until": 0.5},
    "flexible-array-shell": {"simulate.until": 0.1},
    "heliogyro": {"solver.duration": 20.0},
    "heliogyro-strip-payout": {"simulate.until": 1.0},
    "heliogyro-strip": {"simulate.until": 1.0},
    "hinge-stored": {},
    "inertia-stand": {},
    "miura-sheet": {"simulate.until": 0.02},
    "net-reflector": {"simulate.until": 0.005},
    "offload": {},
    "orbit-tether": {"simulate.until": 20.0},
    "plate-swing": {"simulate.until": 0.1},
    "rib-antenna": {"simulate.until": 0.5},
    "rib-antenna-wound": {"simulate.until": 0.5},
    "rib-held-ten-years": {"simulate.until": 1.0},
    "rib-lenticular-shell": {"simulate.until": 2e-6},
    "rib-reflector": {"simulate.until": 0.2},
    "ring-antenna": {"simulate.until": 0.01},
    "solar-array": {"simulate.until": 4.0},
    "solar-array-flexible": {"simulate.until": 1.0},
    "spinning-tether": {"simulate.until": 5.0},
    "tape-drum": {"simulate.until": 0.02},
    "tape-hinge": {"simulate.until": 0.1},
    "tape-hinge-shell": {"simulate.until": 0.002},
    "tape-hinge-stored": {},
    "tape-rods-stored": {"simulate.until": 0.1},
    "two-booms": {"simulate.until": 0.2},
    "wire-boom-satellite": {"simulate.until": 2.0},
    "wrapped-rib": {"solver.duration": 10.0},
    "wrapped-rib-deploy": {"solver.duration": 100.0},
    "wrapped-rib-hold": {"hold.time": 20.0},
    "yo-yo-despin": {"simulate.until": 0.2},
    "z-fold": {"simulate.until": 1.0},
}
#: Variants of other cases in this list.
VARIANTS = ("heliogyro-strip-payout", "solar-array-flexible", "tape-rods-stored")
SCHEMATICS = [name for name, entry in papers.ENTRIES.items() if "schematic" in entry.function]
#: Room around a text that may be shared, pixels, and share of points that a legend may cover.
SLACK, COVERED = 2.0, 0.01


def boxes(sheet):
    """Words and boxes of all texts that are drawn, in pixels."""
    drawn, original = [], Text.draw

    def record(self, renderer, *args, **kwargs):
        if self.get_visible() and self.get_text().strip():
            drawn.append(self)
        return original(self, renderer, *args, **kwargs)

    with mock.patch.object(Text, "draw", record):
        sheet.draw(sheet.canvas.get_renderer())
    return [(text.get_text(), Text.get_window_extent(text)) for text in dict.fromkeys(drawn)]


def figure_of(*panels):
    return Figure(name="f", title="", panels=list(panels), height=35.0 * len(panels))


def faults(figure):
    """What is wrong with the layout of a figure, as sentences."""
    sheet = plots.sheet(figure, dpi=100.0)
    found, texts = [], boxes(sheet)
    width, height = sheet.bbox.width, sheet.bbox.height
    for words, box in texts:
        if box.x0 < -1.0 or box.y0 < -1.0 or box.x1 > width + 1.0 or box.y1 > height + 1.0:
            found.append(f"{figure.name}: {words!r} is cut off")
    for (words, a), (others, b) in itertools.combinations(texts, 2):
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > SLACK and high > SLACK:
            found.append(f"{figure.name}: {words!r} and {others!r} cover one another")
    for axes in sheet.axes:
        legend = axes.get_legend()
        if legend is None:
            continue
        box = legend.get_window_extent()
        points = [axes.transData.transform(line.get_xydata()) for line in axes.lines if len(line.get_xydata())]
        at = np.concatenate(points)
        inside = np.mean((at > [box.x0, box.y0]).all(axis=1) & (at < [box.x1, box.y1]).all(axis=1))
        if inside > COVERED:
            found.append(f"{figure.name}: a legend covers {100.0 * inside:.0f} % of the points")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", SCHEMATICS)
def test_schematics_of_papers(name):
    assert faults(papers.ENTRIES[name].make(papers.Options(quick=True)).figure) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.release] if name in VARIANTS else []) for name in SHORT]
)
def test_figures_of_built_in_cases(name):
    run = evolvent.run(name, SHORT[name])
    figures = cases.presenter(run).figures(run)
    assert figures
    assert [fault for figure in figures for fault in faults(figure)] == []


def test_figures_of_all_structures_are_drawn():
    structures = {name for name in cases.built_in() if cases.content_of(name)["system"] == "structure"}
    assert structures <= set(SHORT)


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
