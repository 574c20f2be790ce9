"""Figures IV.1 to IV.4 of Tenenbaum (2014): the deployment of the heliogyro over nodes, damping and stiffness."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent.figures import Figure, Line, Panel
from evolvent.papers import Made, Options
from evolvent.papers.thread_runs import (
    QUICK_STIFFNESS,
    RIGID,
    STIFFNESS,
    TIGHT,
    WINDOWS,
    Deployment,
    Trial,
    gap,
    largest,
    means,
    run_all,
    springs,
)
from evolvent.papers.winding import markdown

#: Numbers of nodes of the paper.
NODES = (20, 40)
#: Dampings of a segment, N s/m: the paper's range in seven, and those of the quick form.
DAMPINGS, QUICK_DAMPINGS = tuple(10.0**k for k in range(-6, 1)), (1e-6, 1e-3, 1.0)
#: Stiffnesses of a segment, N/m.
STIFFNESSES = (1e7, 1e8, 1e9)
#: Steps of generalized-alpha, s: in full and of the quick form, of figure IV.3 and of figure IV.4.
STEP, QUICK_STEP = 1e-3, 2.5e-3
FINE, QUICK_FINE = 2.5e-4, 1e-3
#: Interval of the start that is drawn by itself, s.
START = 5.0
LAG = "lag of the tip, deg"
DATA = "Data of the paper; lags in degrees."
IMPLICIT = """\
generalized-alpha, with steps far above the stability limit of explicit RK4. Compared with RK4 (c = 1e7 N/m, n = 20, the
whole deployment) its lag after the first second differs by 0.0044, 0.0005 and 0.0001 deg at steps of 2.5, 1 and
0.25 ms.
"""


class _Runs(NamedTuple):
    """Runs that were made, and whether they are all that were asked for."""

    runs: list[tuple[Trial, Deployment]]
    complete: bool


def _run(trials: Sequence[Trial], options: Options) -> _Runs:
    runs = list(run_all(trials, options.report))
    return _Runs(runs, len(runs) == len(trials) and all(one.status != "interrupted" for _, one in runs))


def _over_nodes(options: Options, every: float) -> _Runs:
    """The deployment by RK4 for both numbers of nodes."""
    stiffness = QUICK_STIFFNESS if options.quick else STIFFNESS
    trials = [springs(nodes, stiffness) for nodes in NODES]
    return _run([one._replace(overrides={**one.overrides, "output.every": every}) for one in trials], options)


def _n(trial: Trial) -> int:
    return int(trial.overrides["blade.nodes"])


def figure_4_1(options: Options) -> Made:
    """Rate of the body beside (18) and beside the formula with the offset of the spools."""
    runs, complete = _over_nodes(options, 0.1)
    rates, gaps, rows = [], [], []
    for k, (trial, one) in enumerate(runs):
        n, style = _n(trial), "-" if k == 0 else ":"
        rates.append(Line(x=one.t, y=one.rate, label=f"computed, $n$ = {n}", color=k, style=style, width=2.2))
        row = [str(n), f"{one.rate[-1]:.5f}"]
        for c, (label, values) in enumerate((("eq. (18)", one.formula), ("corrected", one.corrected)), start=2):
            if k == 0:
                rates.append(Line(x=one.t, y=values, label=label, color=c, style="--"))
            difference = 100.0 * (values - one.rate) / one.rate
            gaps.append(Line(x=one.t, y=difference, label=f"{label}, $n$ = {n}", color=c, style=style))
            worst = gap(values, one.rate)
            row.append(f"{worst.max():.2f} % at {one.t[worst.argmax()]:.1f} s")
        rows.append(row)
    panels = [
        Panel(x_label="time, s", y_label="rate of the body, rad/s", lines=rates, y_zero=True),
        Panel(x_label="time, s", y_label="formula minus simulation, %", lines=gaps),
    ]
    head = ["n", "rate at the end, rad/s", "largest gap to (18)", "largest gap to the corrected formula"]
    note = (
        f"{DATA} Corrected: (18) with the offset L0 of the spools, from the momentum (J + 2 m_k L0^2) W0 of body and "
        "tip masses at the start. Gaps: of the computed rate, over the whole deployment.\n"
    )
    title = "Rate of the body compared with eq. (18) (Tenenbaum 2014, figure IV.1)"
    figure = Figure(name="thread-figure-4-1", title=title, panels=panels, height=140.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_4_2(options: Options) -> Made:
    """Lag of the tip, whole and at the start."""
    runs, complete = _over_nodes(options, 0.02)
    whole, start, rows = [], [], []
    for k, (trial, one) in enumerate(runs):
        label, first, style = f"$n$ = {_n(trial)}", one.t <= START, "-" if k == 0 else "--"
        whole.append(Line(x=one.t, y=one.lag, label=label, color=k, width=1.2))
        start.append(Line(x=one.t[first], y=one.lag[first], label=label, color=k, style=style, width=1.2))
        rows.append([str(_n(trial)), *_written(means(one)), f"{np.nanmax(one.lag):.2f}"])
    steady = math.degrees(math.asin(2.0 * 0.035 / (0.05 * 6.0)))
    start.append(Line(x=np.array([0.0, START]), y=np.full(2, steady), label="steady lag", color="0.5", style=":"))
    panels = [
        Panel(x_label="time, s", y_label=LAG, lines=whole),
        Panel(x_label="time, s", y_label=LAG, lines=start, title=f"first {START:g} s"),
    ]
    text = f"{DATA} The steady lag at the start, asin(2 v / (L0 W0)), is {steady:.2f}.\n"
    head = ["n", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS), "largest"]
    title = "Lag of the tip, $n$ = 20 and 40 (Tenenbaum 2014, figure IV.2)"
    figure = Figure(name="thread-figure-4-2", title=title, panels=panels, height=140.0)
    return Made(text=f"{text}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_4_3(options: Options) -> Made:
    """Lag of the tip for both numbers of nodes and seven dampings."""
    stiffness = QUICK_STIFFNESS if options.quick else STIFFNESS
    dampings, step = (QUICK_DAMPINGS, QUICK_STEP) if options.quick else (DAMPINGS, STEP)
    trials = [springs(n, stiffness, damping=d, step=step) for n in NODES for d in dampings]
    runs, complete = _run(trials, options)
    panels, rows = [], []
    differences: list[Line] = []
    for k, n in enumerate(NODES):
        group = [(trial.overrides["blade.damping"], one) for trial, one in runs if _n(trial) == n]
        lines = []
        for c, (d, one) in enumerate(group):
            scale, least = c / max(len(dampings) - 1, 1), group[0][1]
            lines.append(
                Line(x=one.t, y=one.lag, label=f"$d$ = {_power(d)} N s/m", color=scale, width=3.5 - 3.0 * scale)
            )
            apart = one.lag - least.lag
            rows.append([str(n), f"{d:g}", *_written(means(one)), f"{largest(apart, one.t):.1e}"])
            if c == len(group) - 1 and c:
                shown = one.t >= 1.0
                y = np.maximum(np.abs(apart[shown]), 1e-12)
                label = f"$n$ = {n}, $d$ = {_power(d)} and {_power(group[0][0])} N s/m"
                differences.append(Line(x=one.t[shown], y=y, label=label, color=k, width=0.8))
        panels.append(Panel(x_label="", y_label=LAG, lines=lines, title=f"$n$ = {n}"))
    first = [one for trial, one in runs if trial.overrides["blade.damping"] == dampings[0]]
    if len(first) == len(NODES):
        apart = np.abs(first[0].lag - first[1].lag)
        differences.append(Line(x=first[0].t[1:], y=apart[1:], label="$n$ = 20 and $n$ = 40", color="0.5", width=0.8))
    panels.append(Panel(x_label="time, s", y_label="difference, deg", lines=differences, log=True))
    head = ["n", "d, N s/m", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS), "from the least d"]
    swing = ""
    if len(first) == len(NODES):
        late = first[0].t >= WINDOWS[0][0]
        if late.any():
            swing = (
                f" The lag with n = 20 swings about that with n = 40 by up to {apart[late].max():.3f} deg, "
                f"{100.0 * (apart / first[1].lag)[late].max():.2f} % of it."
            )
    note = f"{DATA} c = {stiffness:g} N/m.{swing} Runs by {IMPLICIT}"
    title = "Lag of the tip, $n$ = 20 and 40, dampings $d$ of $10^{-6}$ to 1 N s/m (Tenenbaum 2014, figure IV.3)"
    figure = Figure(name="thread-figure-4-3", title=title, panels=panels, height=190.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_4_4(options: Options) -> Made:
    """Lag of the tip for three stiffnesses, beside links of fixed length."""
    step = QUICK_FINE if options.quick else FINE
    trials = [Trial("links of fixed length, dopri5", RIGID if options.quick else TIGHT, 1.0)]
    trials += [springs(20, c, step=step) for c in STIFFNESSES]
    if not options.quick:
        trials.append(springs(20, STIFFNESSES[0]))
    runs, complete = _run(trials, options)
    (_, rigid), implicit = runs[0], [one for one in runs if one[0].overrides["solver.method"] == "generalized-alpha"]
    lines = [Line(x=rigid.t, y=rigid.lag, label="links of fixed length", color="0.6", width=5.0)]
    apart, rows = [], []
    for k, (trial, one) in enumerate(runs[1:]):
        c, method = trial.overrides["blade.stiffness"], str(trial.overrides["solver.method"])
        named = f"$c$ = {_power(c)} N/m, {method}"
        lines.append(
            Line(x=one.t, y=one.lag, label=named, color=k, style=("-", "--", ":", "-.")[k], width=2.0 - 0.4 * k)
        )
        first = implicit[0][1] if method == "generalized-alpha" else None
        shown = one.t >= 1.0
        row = [f"{c:g}", method, f"{trial.overrides['solver.step']:.3g}", *_written(means(one), 5)]
        row.append(f"{largest(one.lag - rigid.lag, one.t):.1e}")
        row.append("-" if first is None or one is first else f"{largest(one.lag - first.lag, one.t):.1e}")
        rows.append(row)
        y = one.lag - rigid.lag if first is None else one.lag - first.lag
        if first is None or one is not first:
            against = "links of fixed length" if first is None else f"$c$ = {_power(STIFFNESSES[0])} N/m"
            label = f"{named}, from {against}"
            apart.append(Line(x=one.t[shown], y=1e6 * y[shown], label=label, color=k, width=0.9))
    panels = [
        Panel(x_label="", y_label=LAG, lines=lines),
        Panel(x_label="time, s", y_label="difference, 1e-6 deg", lines=apart, title="after the first second"),
    ]
    head = ["c, N/m", "method", "step, s", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS)]
    head += ["from links of fixed length", "from c = 1e7, same method"]
    note = (
        f"{DATA} n = 20. Largest differences of the lag after the first second. Runs by {IMPLICIT}"
        "RK4 was run once with each stiffness over the whole deployment (27, 76 and 234 s of CPU time); its lag "
        "differs from\nthat of links of fixed length by 1.5e-6, 1.4e-7 and 4e-8 deg.\n"
    )
    title = "Lag of the tip, $c$ = $10^7$, $10^8$ and $10^9$ N/m (Tenenbaum 2014, figure IV.4)"
    figure = Figure(name="thread-figure-4-4", title=title, panels=panels, height=140.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def _power(value: float) -> str:
    """A number, as a power of ten where it is one: 1e-6 -> "$10^{-6}$"."""
    exponent = round(math.log10(value)) if value > 0.0 else 0
    return f"$10^{{{exponent}}}$" if abs(exponent) > 2 and math.isclose(value, 10.0**exponent) else f"{value:g}"


def _written(values: Sequence[float], digits: int = 3) -> list[str]:
    """Numbers of a row, "-" for none."""
    return ["-" if math.isnan(value) else f"{value:.{digits}f}" for value in values]
