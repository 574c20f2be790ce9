"""Table 1 and figure 10 of Yi, Yuan, Dong & Li (2017): a rib wound round a hub by implicit and explicit methods."""

from __future__ import annotations

import dataclasses

from evolvent.figures import Figure, Line, Panel
from evolvent.papers import Made, Options
from evolvent.papers.winding import ALPHA, ENERGY, Model, Trial, Winding, described, markdown, run_all, written

#: End of the runs, s, and a time shortly before the tip whips onto the hub.
END, BEFORE_THE_WHIP = 80.0, 66.0
#: Interval about the whip, s.
WHIP = (65.0, 69.0)
#: Fixed steps of the implicit methods, s; the paper's is the first.
STEPS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
QUICK_STEPS = (0.5, 0.1, 0.02, 0.005)
#: Steps of the references, s: in full and of the quick form.
FINE, QUICK_FINE = 2.5e-4, 1e-3
#: Steps of explicit methods, of their stability limit.
SHARES = (1.0, 0.5, 0.25, 0.1)
#: End of the explicit run with the paper's mesh, s.
SHORT = 0.02
TABLE = (
    "method", "step asked for, s", "mean step taken, s", "CPU time, s", "tip error before the whip, mm",
    "tip error to the end, mm", "energy gained, %", "divided steps", "outcome",
)  # fmt: skip
NOTE = f"""\
Winding of the rib over {END:g} s. Tip error: root of the mean square over time of the tip's distance from the reference
on the same mesh, up to {BEFORE_THE_WHIP:g} s (before the whip) and up to the end. Energy gained: largest climb of the
energy balance, of the largest energy or work. CPU time: of one core, without compilation. Explicit methods hold the
hinge by a penalty, which is part of their error; their limit is the stability limit at the start. After the whip the
motion is chaotic: runs of half the reference's step and of its own are some 100 mm apart on average.
"""
NOTE_ON_MESH = f"""\
Ten `full` elements. energy-momentum does not support the paper's contact law and runs with hunt-crossley, as does the
reference. The CPU time of rk4 is that of {SHORT:g} s, scaled.
"""


def _of_cable(*, quick: bool) -> list[Trial]:
    """Runs of the 40 cable elements; the first is the reference."""
    steps = QUICK_STEPS if quick else STEPS
    trials = [Trial(ENERGY, step=QUICK_FINE if quick else FINE)]
    trials += [Trial(method, step=step) for method in (ENERGY, ALPHA) for step in steps]
    trials += [Trial(method, tolerance=3e-4) for method in (ENERGY, ALPHA)]
    trials += [Trial("rk4", share=share) for share in (SHARES[:1] if quick else SHARES)]
    return trials if quick else [*trials, Trial("heun", share=1.0)]


def _of_paper(*, quick: bool) -> list[Trial]:
    """Runs of the paper's own set-up; the first is the reference."""
    trials = [Trial(ENERGY, step=5e-3 if quick else 1e-3)]
    trials += [Trial(ENERGY, step=step) for step in (0.5, 0.1, 0.02)]
    trials += [Trial(ALPHA, step=step) for step in ((0.5,) if quick else (0.5, 0.1, 0.02, 0.004))]
    return [*trials, Trial(ALPHA, tolerance=3e-4), Trial("rk4", share=1.0, stop=SHORT)]


def table_1(options: Options) -> Made:
    """CPU time and error of implicit and explicit methods over the step."""
    cable, paper = Model("wrapped-rib", END), Model("wrapped-rib-paper", END)
    trials = [(cable, trial) for trial in _of_cable(quick=options.quick)]
    trials += [(paper, trial) for trial in _of_paper(quick=options.quick)]
    found: dict[Model, list[Winding]] = {cable: [], paper: []}
    for model, run in run_all(trials, options.report):
        found[model].append(run)
    text = [NOTE, "The case `wrapped-rib`, 40 cable elements:\n", _table(found[cable])]
    text += ["\nThe case `wrapped-rib-paper`, the paper's own set-up:\n", NOTE_ON_MESH, _table(found[paper])]
    complete = _is_complete(found[cable] + found[paper], len(trials))
    return Made(text="\n".join(text if found[paper] else text[:3]), complete=complete)


def _is_complete(runs: list[Winding], count: int) -> bool:
    """Whether all runs came to an end of their own."""
    return len(runs) == count and runs[-1].status != "interrupted"


def _table(runs: list[Winding]) -> str:
    """Rows of runs, whose first is the reference."""
    return markdown(TABLE, [_row(run, runs[0]) for run in runs])


def _row(run: Winding, reference: Winding) -> list[str]:
    """A run in the table."""
    errors = [written(1e3 * run.error(reference, until), least=0.01) for until in (BEFORE_THE_WHIP, END)]
    is_reference = run is reference
    return [
        run.trial.method + (", reference" if is_reference else ""),
        _asked(run),
        f"{run.mean_step:.3g}",
        written(run.cpu),
        *(("0", "0") if is_reference else errors),
        "-" if run.trial.stop is not None else written(100.0 * run.gain, least=0.01),
        str(run.divided) if run.trial.method == ENERGY else "-",
        run.outcome,
    ]


def _asked(run: Winding) -> str:
    """The step that was asked for."""
    if run.trial.tolerance is not None:
        return f"tolerance {run.trial.tolerance:g}"
    share = run.trial.share
    named = "" if share is None else " (the limit)" if share == 1.0 else f" ({share:g} of the limit)"
    return f"{run.step:.3g}{named}"


def figure_10(options: Options) -> Made:
    """The tip's speed over time, by implicit and explicit methods."""
    model = Model("wrapped-rib", END)
    trials = [Trial(ENERGY, step=QUICK_FINE if options.quick else FINE), Trial(ENERGY, step=0.5)]
    trials += [Trial(ALPHA, step=step) for step in (0.5, 0.02, 0.005)]
    trials += [Trial("rk4", share=1.0 if options.quick else 0.25)]
    runs = [one for _, one in run_all([(model, trial) for trial in trials], options.report)]
    lines = [line for k, run in enumerate(runs) for line in _speed(run, k)]
    panels = [Panel(x_label="time, s", y_label="tip speed, m/s", lines=lines, y_zero=True)]
    near = [_between(line, WHIP) for line in lines if line.x[-1] > WHIP[0]]
    if near:
        panels.append(Panel(x_label="time, s", y_label="tip speed, m/s", lines=near, title="tip at its largest speed"))
    title = "Tip speed of a rib that is wound, implicit and explicit (figure 10 of Yi et al. 2017)"
    figure = Figure(name="rib-figure-10", title=title, panels=panels, height=160.0)
    return Made(text=f"{NOTE}\n{_table(runs)}", figure=figure, complete=_is_complete(runs, len(trials)))


def _speed(run: Winding, k: int) -> list[Line]:
    """The tip's speed of the k-th run, the first being the reference; a dot where it failed."""
    label = f"{described(run.trial)}{'' if k else ', reference'}"
    line = Line(x=run.t, y=run.speed, label=label, color=k, width=1.1 if k else 2.4)
    if run.status == "success":
        return [line]
    end = Line(x=run.t[-1:], y=run.speed[-1:], color=k, style="", marker="X")
    return [dataclasses.replace(line, label=f"{label}, {run.outcome}"), end]


def _between(line: Line, limits: tuple[float, float]) -> Line:
    """The part of a line between two times, without its name."""
    part = (line.x >= limits[0]) & (line.x <= limits[1])
    return dataclasses.replace(line, x=line.x[part], y=line.y[part], label="")
