"""Figures IV.2 to IV.4 and table IV.1 of Tenenbaum (2014): the heliogyro.

Panels are those of the paper, in its colours, but for those whose titles begin with "ours".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.thread_runs import (
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
from evolvent_papers.papers.thread_variants import Data
from evolvent_papers.papers.winding import markdown

#: The paper's data.
PAPER = Data()
#: Modulus of the film in table IV.1, N/m2, and the density of a polyester film, ours, kg/m3.
MODULUS, DENSITY = 1e9, 1400.0
#: Colour and style of the curves of figure IV.4.
CURVES_4_4 = (("black", "-"), ("green", "--"), ("red", ":"))
#: Numbers of nodes of the paper.
NODES = (20, 40)
#: Dampings of a segment, N s/m: the paper's range in seven, and those of the quick form.
DAMPINGS, QUICK_DAMPINGS = tuple(10.0**k for k in range(-6, 1)), (1e-6, 1e-3, 1.0)
#: Stiffnesses of a segment, N/m.
STIFFNESSES = (1e7, 1e8, 1e9)
#: Stiffnesses of our figure beside IV.4, N/m.
SOFT = (1e2, 1e3, 1e4)
#: Steps of generalized-alpha, s: in full and of the quick form, of figure IV.3 and of figure IV.4.
STEP, QUICK_STEP = 1e-3, 2.5e-3
FINE, QUICK_FINE = 2.5e-4, 1e-3
#: Interval of the start that is drawn by itself, s.
START = 5.0
TIME, LAG = "Time, s", "lag $\\Delta_1$, deg"
RATE = "$\\Omega_{KA}$, rad/s"
#: What figure IV.2 compares the rate of the body with.
LAW = "the law of conservation of momentum"
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


def _n(trial: Trial) -> int:
    return int(trial.overrides["blade.nodes"])


def _fourteen(options: Options) -> _Runs:
    """Both numbers of nodes with seven dampings, or three of the quick form."""
    stiffness = QUICK_STIFFNESS if options.quick else STIFFNESS
    dampings, step = (QUICK_DAMPINGS, QUICK_STEP) if options.quick else (DAMPINGS, STEP)
    trials = [springs(n, stiffness, damping=d, step=step) for n in NODES for d in dampings]
    return _run([one._replace(overrides={**one.overrides, "output.every": 0.02}) for one in trials], options)


def figure_4_2(options: Options) -> Made:
    """Rate of the body in each run beside (18) with the length of that run; below it the gaps, ours."""
    runs, complete = _fourteen(options)
    least = _power(runs[0][0].overrides["blade.damping"])
    computed, formulas, gaps, rows = [], [], [], []
    for k, (trial, one) in enumerate(runs):
        n, d = _n(trial), trial.overrides["blade.damping"]
        names = (
            (f"integration (ours: generalized-alpha), {len(runs)} runs", f"formula (18), {len(runs)} curves")
            if k == 0
            else ("", "")
        )
        computed.append(Line(x=one.t, y=one.rate, label=names[0], color="black"))
        formulas.append(Line(x=one.t, y=one.formula, label=names[1], color="red", style="--", width=1.2))
        row = [str(n), f"{d:g}", f"{one.rate[-1]:.5f}"]
        for c, (label, values) in enumerate((("formula (18)", one.formula), ("with $L_0$", one.corrected)), start=2):
            if k == 0 or n != _n(runs[k - 1][0]):
                style = "-" if n == NODES[0] else ":"
                difference = 100.0 * (values - one.rate) / one.rate
                gaps.append(Line(x=one.t, y=difference, label=f"{label}, $n$ = {n}", color=c, style=style))
            worst = gap(values, one.rate)
            row.append(f"{worst.max():.3f} % at {one.t[worst.argmax()]:.1f} s")
        rows.append(row)
    panels = [
        Panel(x_label=TIME, y_label=RATE, lines=computed + formulas, y_zero=True),
        Panel(
            x_label=TIME, y_label="formula minus integration, %", lines=gaps,
            title=f"ours: gap of (18), and of (18) with $L_0$ in the moment of inertia, $d$ = {least} N s/m",
        ),
    ]  # fmt: skip
    head = ["n", "d, N s/m", "rate at the end, rad/s", "largest gap to (18)", "largest gap with L0"]
    furthest = max(float(np.abs(one.formula - one.rate).max()) for _, one in runs)
    note = (
        f"Data of the paper, c = {runs[0][0].overrides['blade.stiffness']:g} N/m. (18) is at most {furthest:.3f} rad/s "
        f"from a run, {100.0 * furthest / 6.0:.1f} % of the axis. The caption means angular "
        "momentum. With L0: (18) with the distance L0 of the "
        "spools, from the momentum (J_KA + 2 m_K L0^2) Omega_0 of body and tip masses at the start. Gaps: of the "
        f"computed rate. Runs by {IMPLICIT}"
    )
    title = (
        f"Results of the check of {LAW} by the angular rate of the spacecraft's body (black solid line: results of the "
        "integration, red dashed: by formula (18)) (Tenenbaum 2014, figure IV.2)"
    )
    figure = Figure(name="thread-figure-4-2", title=title, panels=panels, height=150.0, heights=(2.0, 1.0))
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_4_3(options: Options) -> Made:
    """Lag of the tip for both numbers of nodes and seven dampings; below it start and differences, ours."""
    runs, complete = _fourteen(options)
    lines, start, differences, rows = [], [], [], []
    firsts: list[Deployment] = []
    for n, color, style in zip(NODES, ("black", "red"), ("-", "--"), strict=True):
        group = [(trial.overrides["blade.damping"], one) for trial, one in runs if _n(trial) == n]
        for k, (d, one) in enumerate(group):
            label = f"$n$ = {n}, {len(group)} values of $d$ (ours: generalized-alpha)" if k == 0 else ""
            lines.append(Line(x=one.t, y=one.lag, label=label, color=color, style=style, width=1.2))
            apart, shown = one.lag - group[0][1].lag, one.t >= 1.0
            rows.append([str(n), f"{d:g}", *_written(means(one)), f"{largest(apart, one.t):.1e}"])
            if k and k == len(group) - 1:
                y = np.maximum(np.abs(apart[shown]), 1e-12)
                label = f"$n$ = {n}, $d$ = {_power(d)} and {_power(group[0][0])} N s/m"
                differences.append(Line(x=one.t[shown], y=y, label=label, color=color, width=0.8))
        for _, one in group[:1]:
            early = one.t <= START
            start.append(Line(x=one.t[early], y=one.lag[early], label=f"$n$ = {n}", color=color, style=style))
            firsts.append(one)
    swing = ""
    if len(firsts) == len(NODES):
        apart, t = np.abs(firsts[0].lag - firsts[1].lag), firsts[0].t
        differences.append(Line(x=t[1:], y=apart[1:], label="$n$ = 20 and $n$ = 40", color="0.5", width=0.8))
        if (late := t >= WINDOWS[0][0]).any():
            swing = (
                f" The lag with n = 20 swings about that with n = 40 by up to {apart[late].max():.3f} deg, "
                f"{100.0 * (apart / firsts[1].lag)[late].max():.2f} % of it."
            )
    steady = math.degrees(math.asin(2.0 * PAPER.speed / (PAPER.offset * PAPER.rate)))
    start.append(Line(x=np.array([0.0, START]), y=np.full(2, steady), label="steady lag", color="0.5", style=":"))
    panels = [
        Panel(x_label=TIME, y_label=LAG, lines=lines),
        Panel(x_label=TIME, y_label=LAG, lines=start, title=f"ours: first {START:g} s"),
        Panel(x_label=TIME, y_label="difference, deg", lines=differences, log=True, title="ours: differences"),
    ]
    head = ["n", "d, N s/m", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS), "from the least d"]
    note = (
        f"{DATA} c = {runs[0][0].overrides['blade.stiffness']:g} N/m. The steady lag at the start, "
        f"asin(2 r w / (L0 Omega_0)), is {steady:.2f}.{swing} Runs by {IMPLICIT}"
    )
    title = (
        "Angle $\\Delta_1$ over the time of deployment (black solid line: $n$ = 20, red dashed: $n$ = 40) "
        "(Tenenbaum 2014, figure IV.3)"
    )
    figure = Figure(name="thread-figure-4-3", title=title, panels=panels, height=200.0, heights=(2.0, 1.0, 1.0))
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def figure_4_4(options: Options) -> Made:
    """Lag of the tip for three stiffnesses; below it differences, also from links of fixed length, ours."""
    step = QUICK_FINE if options.quick else FINE
    trials = [Trial("links of fixed length, dopri5", RIGID if options.quick else TIGHT, 1.0)]
    trials += [springs(20, c, step=step) for c in STIFFNESSES]
    if not options.quick:
        trials.append(springs(20, STIFFNESSES[0]))
    runs, complete = _run(trials, options)
    (_, rigid), implicit = runs[0], [one for one in runs if one[0].overrides["solver.method"] == "generalized-alpha"]
    lines, apart, rows = [], [], []
    for k, (trial, one) in enumerate(runs[1:]):
        c, method = trial.overrides["blade.stiffness"], str(trial.overrides["solver.method"])
        named = f"$c$ = {_power(c)} N/m, {method}"
        color, style = (*CURVES_4_4, ("0.5", "-"))[k]
        if k < len(CURVES_4_4):
            lines.append(Line(x=one.t, y=one.lag, label=f"$c$ = {_power(c)} N/m", color=color, style=style))
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
            apart.append(Line(x=one.t[shown], y=1e6 * y[shown], label=label, color=color, width=0.9))
    panels = [
        Panel(x_label=TIME, y_label=LAG, lines=lines),
        Panel(
            x_label=TIME,
            y_label="difference, 1e-6 deg",
            lines=apart,
            title="ours: differences after the first second",
        ),
    ]
    head = ["c, N/m", "method", "step, s", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS)]
    head += ["from links of fixed length", "from c = 1e7, same method"]
    note = f"{DATA} n = 20, d = 1e-3 N s/m. Largest differences of the lag after the first second. Runs by {IMPLICIT}"
    title = (
        "Angle $\\Delta_1$ over the time of deployment (black solid line: $c$ = $10^7$ N/m, green dashed: "
        "$c$ = $10^8$ N/m, red dotted: $c$ = $10^9$ N/m) (Tenenbaum 2014, figure IV.4)"
    )
    figure = Figure(name="thread-figure-4-4", title=title, panels=panels, height=150.0, heights=(2.0, 1.0))
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def soft(options: Options) -> Made:
    """Lag of the tip for stiffnesses at which the paper's sentences on figure IV.4 hold, ours."""
    runs, complete = _run([springs(20, c) for c in SOFT], options)
    lines, rows = [], []
    for k, (trial, one) in enumerate(runs):
        (color, style), c = CURVES_4_4[k], trial.overrides["blade.stiffness"]
        lines.append(Line(x=one.t, y=one.lag, label=f"$c$ = {_power(c)} N/m", color=color, style=style))
        row, before = [f"{c:g}", *_written(means(one)), "-", "-"], runs[max(k - 1, 0)][1]
        if k:
            apart = np.interp(one.t, before.t, before.lag) - one.lag
            row[-2:] = [f"{largest(apart, one.t):.3f}", f"{largest(100.0 * apart / one.lag, one.t):.2f}"]
        rows.append(row)
    panel = Panel(x_label=TIME, y_label=LAG, lines=lines)
    head = ["c, N/m", *(f"mean over {low:g} to {high:g} s" for low, high in WINDOWS)]
    head += ["from the row above, deg", "%"]
    note = (
        f"{DATA} n = 20, d = 1e-3 N s/m, RK4. Figure IV.4 of the paper with a stiffness 1e5 times lower: per cents "
        "over two decades, and two curves that coincide. Largest differences after the first second.\n"
    )
    title = (
        "Ours: angle $\\Delta_1$ over the time of deployment with $c$ = 100, $10^3$ and $10^4$ N/m "
        "(beside Tenenbaum 2014, figure IV.4)"
    )
    figure = Figure(name="thread-soft", title=title, panels=[panel], height=100.0)
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure, complete=complete)


def table_4_1(options: Options) -> Made:
    """The data of the deployment as the paper gives them, and the film that they belong to."""
    l0 = [PAPER.length / n for n in NODES]
    data = [
        ["J_KA", "moment of inertia of the spacecraft about the axis of rotation", "kg m2", f"{PAPER.inertia:g}"],
        ["rho_L", "mass of the blades per length", "kg/m", f"{PAPER.line_density:g}"],
        ["L", "length of the blades", "m", f"{PAPER.length:.1f}"],
        ["L_0", "distance from the axis of rotation of the spacecraft to that of the spool", "m", f"{PAPER.offset:g}"],
        ["r", "radius on which the blades are wound on the spools", "m", f"{PAPER.radius:g}"],
        ["Omega_0", "angular rate of the spacecraft at the start", "rad/s", f"{PAPER.rate:.1f}"],
        ["omega", "angular rate of the spools in the deployment", "rad/s", f"{PAPER.spool_rate:g}"],
        ["m_K", "mass of the weights at the ends of the blades", "kg", f"{PAPER.tip_mass:g}"],
        ["n", "number of nodes on the length of a blade", "-", ", ".join(str(n) for n in NODES)],
        ["Delta phi", "angular pitch of the nodes on the spool", "rad", "L / (n r)"],
        ["c", "stiffness of the elastic link between nodes", "N/m", "E b h / (Delta phi r)"],
        ["d", "coefficient of damping of the link between nodes", "N s/m", "1e-6...1.0"],
        ["E", "modulus of elasticity of the blade's material", "N/m2", "1.0e9"],
    ]
    section = [STIFFNESS * one / MODULUS for one in l0]
    film = PAPER.line_density / DENSITY
    implied = [
        ["Delta phi = L / (n r), rad", *(f"{one / PAPER.radius:g}" for one in l0)],
        ["l_0 = r Delta phi, m", *(f"{one:g}" for one in l0)],
        ["b h = c l_0 / E for c = 1e7 N/m, m2", *(f"{one:.3g}" for one in section)],
        ["density of that film, rho_L / (b h), kg/m3", *(f"{PAPER.line_density / one:.2g}" for one in section)],
        [f"b h = rho_L / rho of a film of {DENSITY:g} kg/m3, m2", *(f"{film:.3g}" for _ in l0)],
        ["c = E b h / l_0 of that film, N/m", *(f"{MODULUS * film / one:.2g}" for one in l0)],
    ]
    text = (
        "Input data of the simulation (Tenenbaum 2014, table IV.1); width b and thickness h of the film are not "
        "given.\n\n"
        f"{markdown(['parameter', 'description', 'unit', 'value'], data)}\n\n"
        f"Ours: what follows from them. Figure IV.4 begins with c = 1e7 N/m.\n\n"
        f"{markdown(['quantity', *(f'n = {n}' for n in NODES)], implied)}"
    )
    return Made(text=text)


def _power(value: float) -> str:
    """A number, as a power of ten where it is one: 1e-6 -> "$10^{-6}$"."""
    exponent = round(math.log10(value)) if value > 0.0 else 0
    return f"$10^{{{exponent}}}$" if abs(exponent) > 2 and math.isclose(value, 10.0**exponent) else f"{value:g}"


def _written(values: Sequence[float], digits: int = 3) -> list[str]:
    """Numbers of a row, "-" for none."""
    return ["-" if math.isnan(value) else f"{value:.{digits}f}" for value in values]
