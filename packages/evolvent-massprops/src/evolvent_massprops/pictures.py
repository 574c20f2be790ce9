"""Figures of a certificate, as images that stand in the page itself."""

from __future__ import annotations

import os
import re
from typing import Any

import lazy_loader as lazy
import numpy as np

from evolvent_base import pages
from evolvent_base.figures import WIDTH, axis_label
from evolvent_base.plots import content
from evolvent_base.style import PALETTE, STYLE
from evolvent_massprops.estimates import Estimates, Evaluation
from evolvent_massprops.identification.signals import power, read_signal
from evolvent_massprops.modal import Modal

sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)

_BLUE, _RED, _GREEN = PALETTE[1], PALETTE[2], PALETTE[3]
#: Most shares that a bar shows.
_MOST_SHARES = 7


class Sheet:
    """A figure with its axes; `image` gives the image in the page."""

    def __init__(self, rows: int, columns: int, height: float, **options: Any) -> None:
        self._context = sheets.mpl.rc_context(STYLE)
        self._context.__enter__()
        self.figure = sheets.Figure(figsize=(WIDTH / 25.4, height), layout="constrained", dpi=140)
        sheets.FigureCanvasAgg(self.figure)
        self.axes = self.figure.subplots(rows, columns, squeeze=False, **options)

    def image(self, alt: str, *, raster: bool = False) -> pages.Picture:
        """The figure as an image in the page; PNG where SVG would hold very many points."""
        self._context.__exit__(None, None, None)
        image = content(self.figure, "png" if raster else "svg")
        return pages.picture(image, "png" if raster else "svg+xml", alt)


def _sheet_of(count: int, most: int, height: float) -> tuple[Sheet, int]:
    """A sheet with `count` axes in rows of some `height`, inch, and how many stand in a row, `most` or fewer."""
    columns = min(count, most)
    rows = -(-count // columns)
    sheet = Sheet(rows, columns, 0.3 + height * rows)
    for axis in sheet.axes.ravel()[count:]:
        axis.set_axis_off()
    return sheet, columns


def _symbol(key: str) -> str:
    """A quantity as it is written: "Ixx" -> "$I_{xx}$"."""
    return re.sub(r"^I([xyz]{1,2})$", r"$I_{\1}$", key)


def signals(modal: Modal) -> pages.Picture:
    """Each sensor with the fit, and its residual."""
    modes = modal.modes
    c = len(modes.names)
    sheet = Sheet(c, 2, 0.65 + 1.15 * c, width_ratios=(2.0, 1.0), sharex=True)
    t = modes.time + modal.reading.start
    for row, (left, right) in enumerate(sheet.axes):
        left.plot(t, modes.data[:, row], ".", color="0.6", markersize=2.0, label="signal")
        left.plot(t, modes.fitted[:, row], "-", color=_BLUE, linewidth=0.8, label="fit")
        left.set_ylabel(f"{modes.names[row]} [{modal.reading.unit}]")
        right.plot(t, modes.residual[:, row], ".", color=_RED, markersize=1.5)
        for side in (-2.0, 2.0):
            right.axhline(side * modes.noise[row], color="0.3", linewidth=0.7, linestyle="--")
        right.ticklabel_format(axis="y", scilimits=(-2, 3))
    sheet.figure.legend(
        *sheet.axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2, markerscale=3.0
    )
    sheet.axes[0, 1].set_title("residual, ± 2 deviations")
    for axis in sheet.axes[-1]:
        axis.set_xlabel("time [s]")
    return sheet.image(f"signals of {c} sensors with fit and residual", raster=True)


def spectrum(modal: Modal) -> pages.Picture:
    """Spectra of the signals and of the residual, over the level of white noise."""
    modes = modal.modes
    counts = np.sum(~np.isnan(modes.data), axis=0)
    signal = read_signal(modes.data, time=modes.time)
    window = np.hanning(signal.extent + 2)[1:-1, None]
    window = window if signal.cells is None else window[signal.cells]
    mean = np.nanmean(modes.data, axis=0)
    whole = power((modes.data - mean) * window, signal.cells) / (modes.noise**2 * np.sum(window**2))
    left = power(modes.residual, signal.cells) / (modes.noise**2 * counts)
    w = 2.0 * np.pi * np.arange(len(left)) / (signal.extent * signal.step)
    sheet = Sheet(1, 1, 2.3)
    axis = sheet.axes[0, 0]
    axis.semilogy(w[1:], np.maximum(whole.mean(axis=1), 1e-3)[1:], color="0.6", linewidth=0.8, label="signals")
    axis.semilogy(w[1:], np.maximum(left.mean(axis=1), 1e-3)[1:], color=_RED, linewidth=0.8, label="residual")
    axis.axhline(1.0, color="0.2", linewidth=0.8, linestyle="--", label="white noise")
    for k, frequency in enumerate(modes.frequency):
        axis.axvline(frequency, color=_BLUE, linewidth=0.6, alpha=0.6, label="modes" if k == 0 else None)
    axis.set_xlabel("angular frequency [rad/s]")
    axis.set_ylabel("power, of the noise's")
    sheet.figure.legend(loc="outside upper left", ncols=4)
    return sheet.image("spectra of signals and residual")


def _root(C: np.ndarray) -> np.ndarray:
    """A square root of a covariance, which may be singular: dry friction has no decay rate."""
    values, vectors = np.linalg.eigh(C)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def poles(e: Evaluation) -> pages.Picture:
    """Each mode's pole with its ellipse of 95 %."""
    modal, modes = e.modal, e.modal.modes
    m = modes.order
    sheet, columns = _sheet_of(m, 4, 1.75)
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    circle = np.sqrt(5.991) * np.stack([np.cos(angle), np.sin(angle)])
    for k, axis in enumerate(sheet.axes.ravel()[:m]):
        C = modes.pole_covariance[np.ix_([k, m + k], [k, m + k])] * modal.widening[k] ** 2
        x, y = _root(C) @ circle if np.all(np.isfinite(C)) else np.zeros((2, 1))
        color = _BLUE if k in e.used else "0.5"
        axis.plot(1e3 * x, modes.decay_rate[k] + y, color=color, linewidth=1.0)
        axis.plot(0.0, modes.decay_rate[k], "+", color=color)
        axis.set_title(f"{k + 1}: {modes.frequency[k]:.7g} rad/s" + ("" if k in e.used else ", left out"))
        axis.locator_params(nbins=4)
        axis.set_xlabel(axis_label("off that frequency, 1e-3 rad/s"))
        if k % columns == 0:
            axis.set_ylabel("decay rate [1/s]")
    return sheet.image("poles with their ellipses of 95 %")


def shapes(e: Evaluation) -> pages.Picture:
    """Measured amplitudes at the sensors with twice their deviations, beside the model's."""
    rows = list(e.used)
    measured, c = e.modal.shapes[rows], e.modal.shapes.shape[1]
    std = np.sqrt(np.diagonal(e.modal.shape_covariance[rows], axis1=1, axis2=2))
    sheet, columns = _sheet_of(len(rows), 3, 1.6)
    x = np.arange(c)
    for k, axis in enumerate(sheet.axes.ravel()[: len(rows)]):
        axis.axhline(0.0, color="0.3", linewidth=0.7)
        axis.bar(
            x, measured[k], 0.55, yerr=np.nan_to_num(2.0 * std[k]), color=_BLUE, alpha=0.55, capsize=3, label="measured"
        )
        if e.model_shapes is not None:
            axis.plot(x, e.model_shapes[k], "_", color=_RED, markersize=16, markeredgewidth=2.0, label="model")
        axis.set_title(f"mode {rows[k] + 1}: {e.modal.frequency[rows[k]]:.6g} rad/s")
        axis.set_xticks(x, e.modal.modes.names, rotation=0 if c <= 4 else 90)
        axis.ticklabel_format(axis="y", scilimits=(-2, 3))
        if k % columns == 0:
            axis.set_ylabel(f"amplitude [{e.modal.reading.unit}]")
    sheet.figure.legend(*sheet.axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return sheet.image("mode shapes at the sensors")


def budget(found: Estimates) -> pages.Picture:
    """Shares of the variance of each quantity, one bar each."""
    part = np.array([s.contribution**2 for s in found.shares])
    part = 100.0 * part / np.maximum(part.sum(axis=0), 1e-300)
    order = np.argsort(-part.max(axis=1))
    p = len(found.outputs)
    sheet = Sheet(1, 1, 0.55 + max(0.32 * p, 0.19 * min(len(order), _MOST_SHARES + 1)))
    axis = sheet.axes[0, 0]
    left = np.zeros(p)
    y = np.arange(p)[::-1]
    for place, k in enumerate(order[:_MOST_SHARES]):
        color = (*PALETTE[1:], PALETTE[0])[place % len(PALETTE)]
        axis.barh(y, part[k], 0.6, left=left, color=color, label=found.shares[k].label)
        left = left + part[k]
    if len(order) > _MOST_SHARES:
        axis.barh(y, 100.0 - left, 0.6, left=left, color="0.8", label="all others")
    axis.set_yticks(y, [_symbol(o.key) for o in found.outputs])
    axis.set_xlim(0.0, 100.0)
    axis.set_xlabel("share of the variance [%]")
    axis.grid(visible=False)
    sheet.figure.legend(loc="outside right upper")
    return sheet.image("shares of the variance")


def recordings(found: Estimates) -> pages.Picture:
    """Values of all recordings with their own deviations, the mean and its expanded uncertainty."""
    p, n = len(found.outputs), len(found.evaluations)
    sheet = Sheet(p, 1, 0.3 + 2.1 * p, sharex=True)
    names = [os.path.splitext(os.path.basename(s.path))[0] for s in found.signals]
    for k, axis in enumerate(sheet.axes[:, 0]):
        mean, U = found.values[k], found.expanded[k]
        axis.axhspan(mean - U, mean + U, color=_GREEN, alpha=0.2, linewidth=0, label="mean, U")
        axis.axhline(mean, color=_GREEN, linewidth=1.0)
        y = [e.values[k] for e in found.evaluations]
        own = [np.sqrt(sum(s.contribution[k] ** 2 for s in e.shares if s.own)) for e in found.evaluations]
        axis.errorbar(
            np.arange(n),
            y,
            2.0 * np.array(own),
            fmt="o",
            color=_BLUE,
            markersize=3.5,
            capsize=3,
            linewidth=1.0,
            label="recording, ± 2 u of its own noise and inputs",
        )
        axis.set_ylabel(axis_label(f"{_symbol(found.outputs[k].key)}, {found.outputs[k].unit}"))
        axis.ticklabel_format(axis="y", useOffset=False)
    sheet.figure.legend(*sheet.axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    sheet.axes[-1, 0].set_xticks(np.arange(n), names, rotation=0 if n <= 6 else 60)
    return sheet.image("values of the recordings")


def draws(e: Evaluation, found: Estimates) -> pages.Picture:
    """Histograms of the Monte Carlo with the coverage interval."""
    assert e.draws is not None
    p = len(found.outputs)
    sheet, _ = _sheet_of(p, 3, 1.7)
    for k, axis in enumerate(sheet.axes.ravel()[:p]):
        axis.hist(e.draws[:, k] - found.values[k], 40, color=_BLUE, alpha=0.6)
        for side in found.interval[:, k]:
            axis.axvline(side - found.values[k], color=_RED, linewidth=1.0)
        axis.set_xlabel(axis_label(f"{_symbol(found.outputs[k].key)} - {found.values[k]:.6g}, {found.outputs[k].unit}"))
        axis.locator_params(axis="x", nbins=5)
    return sheet.image("distributions of the Monte Carlo")
