"""Figures as data: spectra, maps and identified modes, and how they are drawn."""

import numpy as np
import pytest

import evolvent
from evolvent import System, parts
from evolvent_base import plots
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Map, Panel, spectrum
from evolvent_massprops import mode_figures
from evolvent_massprops.identification import identify


def test_the_peak_of_a_spectrum_is_the_amplitude():
    """Of two oscillations 40 lines apart, within the window's 0.2 % of each other."""
    t = np.arange(1000) * 0.01
    w = 2.0 * np.pi * np.array([40, 80]) / (t.size * 0.01)
    y = 3.0 + 0.7 * np.cos(w[0] * t) + 0.05 * np.cos(w[1] * t + 1.0)
    figure = spectrum([Line(x=t, y=y, label="tip", color=2)], unit="m", marks=w.tolist())
    line, *marks = figure.panels[0].lines
    for amplitude, at in zip((0.7, 0.05), w, strict=True):
        near = np.abs(line.x - at) < 3.0
        assert line.y[near].max() == pytest.approx(amplitude, rel=2e-3)
        assert line.x[near][np.argmax(line.y[near])] == pytest.approx(at, abs=0.1)
    assert [mark.x[0] for mark in marks] == w.tolist()
    assert figure.panels[0].y_label == "amplitude, m"
    assert line.label == "tip"


@pytest.mark.parametrize("time", [np.arange(3.0), np.array([0.0, 1.0, 2.0, 3.0, 3.5])])
def test_few_or_uneven_samples_have_no_spectrum(time):
    with pytest.raises(InputError, match="a spectrum needs four or more at equal intervals"):
        spectrum([Line(x=time, y=time)], unit="m")


@pytest.mark.slow
def test_a_run_draws_the_spectrum_of_its_variables(tmp_path):
    """A mass on a spring: sqrt(k/m) = 5 rad/s."""
    system = System()
    system.add(parts.Point(mass=2.0, position=(1.1, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=50.0, length=1.0), "spring")
    run = system.simulate(until=40.0, every=0.05, tolerance=1e-8)
    sheet = run.ev.spectrum("spring.extension")
    line = sheet.axes[0].lines[0]
    assert line.get_xdata()[np.argmax(line.get_ydata())] == pytest.approx(5.0, abs=0.05)
    assert line.get_ydata().max() == pytest.approx(0.1, rel=0.02)
    assert run.ev.spectrum("spring.extension", path=tmp_path / "s.png").endswith("s.png")
    with pytest.raises(InputError, match="no variable is named"):
        run.ev.spectrum()


def test_a_figure_is_a_picture_in_a_notebook_without_pyplot():
    run = evolvent.run("hanging-chain")
    assert run.ev.plot()[0]._repr_png_().startswith(b"\x89PNG")


def test_a_map_is_drawn_with_its_contours_and_lines():
    x, y = np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 2.0, 4)
    values = np.abs(x)[:, None] + y[None] ** 2
    values[1, 2] = np.nan
    drawn = Map(x=x, y=y, values=values, label="energy, J", limits=(0.1, 10.0), log=True, contours={1.0: "white"})
    outline = Line(x=np.array([-0.5, 0.5]), y=np.array([1.0, 1.0]), color="black", style="--")
    names = {0.0: "near", 2.0: "far"}
    panel = Panel(x_label="x, m", y_label="", y_names=names, lines=[outline], map=drawn)
    sheet = plots.sheet(Figure(name="map", title="Map", panels=[panel]))
    axis, bar = sheet.axes
    mesh = axis.collections[0]
    assert mesh.get_array().shape == (4, 5)
    assert np.ma.is_masked(mesh.get_array()[2, 1])
    assert mesh.get_array().min() == 0.1  # clipped to the limits
    assert mesh.get_clim() == (0.1, 10.0)
    assert len(axis.collections) == 2
    assert [label.get_text() for label in axis.get_yticklabels()] == ["near", "far"]
    assert bar.get_ylabel() == "energy [J], one colour below 0.1"
    assert len(axis.lines) == 1


@pytest.mark.parametrize(
    ("limits", "text", "extended"),
    [
        (None, "", "neither"),
        ((0.0, 3.0), "", "neither"),
        ((1.0, 3.0), ", one colour below 1", "min"),
        ((0.0, 2.5), ", one colour above 2.5", "max"),
        ((0.5, 2.5), ", one colour below 0.5 and above 2.5", "both"),
    ],
)
def test_a_map_states_where_it_is_clipped(limits, text, extended):
    x = np.arange(4.0)
    values = np.tile(x, (4, 1))
    values[0, 0] = np.nan
    drawn = Map(x=x, y=x, values=values, label="energy, J", limits=limits)
    sheet = plots.sheet(Figure(name="map", title="", panels=[Panel(x_label="x", y_label="y", lines=[], map=drawn)]))
    bar = sheet.axes[1]
    assert bar.get_ylabel() == f"energy [J]{text}"
    assert sheet.axes[0].collections[0].colorbar.extend == extended


def test_a_map_is_drawn_as_a_surface_of_linear_heights():
    x, y = np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 2.0, 4)
    drawn = Map(x=x, y=y, values=x[:, None] ** 2 + y[None], label="energy, J", surface=True)
    panel = Panel(x_label="x, m", y_label="y, m", lines=[], map=drawn, title="seen from above")
    sheet = plots.sheet(Figure(name="map", title="Map", panels=[panel]))
    (axis,) = sheet.axes
    assert axis.name == "3d"
    assert [axis.get_xlabel(), axis.get_ylabel(), axis.get_zlabel()] == ["x [m]", "y [m]", "energy [J]"]
    assert axis.get_zlim()[0] <= 0.0 < 3.0 <= axis.get_zlim()[1]
    assert len(axis.collections[0].get_facecolor()) == 12
    assert plots.picture(Figure(name="map", title="Map", panels=[panel]), "png").startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.digits
def test_figures_of_identified_modes():
    t = np.arange(500) / 50.0
    read = np.stack([np.cos(9.0 * t) + 0.2 * np.cos(21.0 * t), np.cos(9.0 * t) - 0.2 * np.cos(21.0 * t)], axis=1)
    read[100:110, 0] = np.nan
    modes = identify({"left": read[:, 0], "right": read[:, 1]}, rate=50.0, order=2)
    signals, spectra, amplitudes = mode_figures.figures(modes, "mm")
    assert [panel.title for panel in signals.panels] == ["left", "left", "right", "right"]
    assert np.nanmax(np.abs(signals.panels[1].lines[0].y)) < 1e-6
    peak = spectra.panels[0].lines[0]
    assert peak.y.max() == pytest.approx(1.0, rel=0.01)
    assert [panel.title for panel in amplitudes.panels] == ["9 rad/s", "21 rad/s"]
    assert amplitudes.panels[1].lines[0].y == pytest.approx([0.2, -0.2], abs=1e-6)  # equal: the first is positive
    for figure in (signals, spectra, amplitudes):
        assert plots.picture(figure, "png").startswith(b"\x89PNG")
