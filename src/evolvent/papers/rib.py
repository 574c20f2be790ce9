"""Table 1 and figure 10 of Yi, Yuan, Dong & Li (2017): a rib wound without damping by two models and several methods.

The paper compares its elements with a model in LS-DYNA, which it does not describe. Here a chain of point masses by
central differences (`rib_chain`) takes the place of that model; explicit methods on the same mesh are compared too.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.papers import Made, Options
from evolvent.papers.rib_chain import LINKS, Chain
from evolvent.papers.winding import (
    ALPHA,
    CHAIN,
    ENERGY,
    EVERY,
    Model,
    Runnable,
    Trial,
    Winding,
    described,
    markdown,
    run_all,
    written,
)
from evolvent.results.figures import Figure, Line, Panel

#: What the paper sets for this comparison.
FREE: Mapping[str, Any] = {"damping.alpha": 0.0}
#: End of the runs, s, and a time shortly before the tip whips onto the hub.
END, BEFORE_THE_WHIP = 40.0, 28.0
#: Interval about the whip, s.
WHIP = (27.4, 29.4)
#: Fixed steps of the implicit methods, s; the paper's is the first.
STEPS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
QUICK_STEPS = (0.5, 0.1, 0.02, 0.005)
#: Steps of the references, s: in full and of the quick form.
FINE, QUICK_FINE = 2.5e-4, 1e-3
#: Steps of explicit methods, of their stability limit; a usual one of explicit finite elements.
SHARES, USUAL = (1.0, 0.5, 0.25, 0.1), 0.9
#: End of the explicit run with the paper's mesh, s.
SHORT = 0.02
#: Links of the chain in the quick form.
QUICK_LINKS = 80
#: Tip speed at which curves of diverging runs are cut off, m/s.
LARGEST_SHOWN = 20.0
TABLE = (
    "method", "step asked for, s", "mean step taken, s", "CPU time, s", "tip error before the whip, mm",
    "tip error to the end, mm", "energy gained, %", "divided steps", "outcome",
)  # fmt: skip
NOTE = f"""\
Winding of the rib without damping (a = 0) over {END:g} s, torque 0.2 N m. Tip error: root of the mean square over time
of the tip's distance from the reference, up to {BEFORE_THE_WHIP:g} s (before the whip) and up to the end. Energy
gained: largest climb of the energy balance, of the largest energy or work. CPU time: of one core, without compilation.
Explicit methods hold the hinge by a penalty, which is part of their error; their limit is the stability limit at the
start. After the whip the motion is chaotic, and no two runs agree.
"""
NOTE_ON_CHAIN = f"""\
{CHAIN}: a second model, a program of its own in NumPy, in place of the paper's LS-DYNA model: {{links}} links between
point masses, contact at the joints. Its tip error contains the difference of the models. It has no damping: after the
whip its links oscillate on. Most of its CPU time is NumPy's.
"""
NOTE_ON_MESH = f"""\
Ten `full` elements. energy-momentum runs with hunt-crossley in place of the paper's contact law, as does the reference.
The CPU time of rk4 is that of {SHORT:g} s, scaled.
"""


class ChainModel:
    """A case of the wrapped rib by the chain of links, in place of `Model`.

    Parameters
    ----------
    end : float, s, of its runs; overrides : mapping, of the keys of `wrapped-rib`; links : int
    """

    def __init__(self, end: float, overrides: Mapping[str, Any], links: int = LINKS) -> None:
        self.name, self.end = "wrapped-rib", end
        self.chain = Chain(cases.load(self.name, dict(overrides)), links)

    def _step(self, trial: Trial) -> float:
        return trial.step if trial.step is not None else (trial.share or USUAL) * self.chain.limit

    def forecast(self, trial: Trial) -> float:
        """CPU time (s) that a trial may take, very roughly."""
        return 1.2e-4 * self.end / self._step(trial)

    def run(self, trial: Trial) -> Winding:
        """Run a trial, and take samples of it as often as `Model` does; a diverged run is a result as any other."""
        step = self._step(trial)
        motion = self.chain.run(self.end, step)
        end = motion.t[-1] if motion.diverged else self.end
        t = EVERY * np.arange(math.floor(end / EVERY + 1e-9) + 1)
        tip = np.stack([*(np.interp(t, motion.t, one) for one in motion.tip.T), np.zeros(t.size)], axis=1)
        return Winding(
            trial=trial, step=step, mean_step=motion.step, cpu=motion.cpu, t=t, tip=tip,
            speed=np.interp(t, motion.t, motion.speed), gain=math.nan, taken=math.nan, iterations=math.nan, divided=0,
            status="diverged" if motion.diverged else "success", message="",
        )  # fmt: skip


def _of_cable(*, quick: bool) -> list[Trial]:
    """Runs of the 40 cable elements; the first is the reference."""
    steps = QUICK_STEPS if quick else STEPS
    trials = [Trial(ENERGY, step=QUICK_FINE if quick else FINE)]
    trials += [Trial(method, step=step) for method in (ENERGY, ALPHA) for step in steps]
    trials += [Trial(method, tolerance=3e-4) for method in (ENERGY, ALPHA)]
    trials += [Trial("rk4", share=share) for share in (SHARES[:1] if quick else SHARES)]
    return trials if quick else [*trials, Trial("heun", share=1.0)]


def _of_chain(*, quick: bool) -> list[Trial]:
    """Runs of the chain, from the paper's step on."""
    steps = (0.5,) if quick else (0.5, 0.1, 0.02, 0.005)
    return [Trial(CHAIN, step=step) for step in steps] + [
        Trial(CHAIN, share=share) for share in ((USUAL,) if quick else (USUAL, 0.5, 0.25))
    ]


def _of_paper(*, quick: bool) -> list[Trial]:
    """Runs of the paper's own set-up; the first is the reference."""
    trials = [Trial(ENERGY, step=5e-3 if quick else 1e-3)]
    trials += [Trial(ENERGY, step=step) for step in (0.5, 0.1, 0.02)]
    trials += [Trial(ALPHA, step=step) for step in ((0.5,) if quick else (0.5, 0.1, 0.02, 0.004))]
    return [*trials, Trial(ALPHA, tolerance=3e-4), Trial("rk4", share=1.0, stop=SHORT)]


def table_1(options: Options) -> Made:
    """CPU time and error of implicit and explicit methods over the step."""
    cable, paper = Model("wrapped-rib", END, FREE), Model("wrapped-rib-paper", END, FREE)
    chain = ChainModel(END, FREE, QUICK_LINKS if options.quick else LINKS)
    wanted: list[tuple[Runnable, list[Trial]]] = [
        (cable, _of_cable(quick=options.quick)),
        (chain, _of_chain(quick=options.quick)),
        (paper, _of_paper(quick=options.quick)),
    ]
    trials = [(model, trial) for model, each in wanted for trial in each]
    found: dict[Runnable, list[Winding]] = {model: [] for model, _ in wanted}
    for model, run in run_all(trials, options.report):
        found[model].append(run)
    note = NOTE_ON_CHAIN.format(links=chain.chain.mass.size - 1)
    text = [NOTE, note, "The case `wrapped-rib`, 40 cable elements, and the chain:\n"]
    text.append(_table(found[cable] + found[chain]))
    if found[paper]:
        text += ["\nThe case `wrapped-rib-paper`, the paper's own set-up:\n", NOTE_ON_MESH, _table(found[paper])]
    complete = _is_complete([run for each in found.values() for run in each], len(trials))
    return Made(text="\n".join(text), complete=complete)


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
    """The tip's speed over time by the implicit method and by a second model with an explicit method."""
    model, chain = Model("wrapped-rib", END, FREE), ChainModel(END, FREE, QUICK_LINKS if options.quick else LINKS)
    two: list[tuple[Runnable, Trial]] = [
        (model, Trial(ENERGY, step=QUICK_FINE if options.quick else FINE)),
        (chain, Trial(CHAIN, share=USUAL)),
    ]
    others: list[tuple[Runnable, Trial]] = [(model, Trial(ENERGY, step=0.05))]
    others += [(model, Trial(ALPHA, step=step)) for step in ((0.5,) if options.quick else (0.5, 0.1, 0.005))]
    others += [(chain, Trial(CHAIN, step=0.5))]
    runs = [one for _, one in run_all([*two, *others], options.report)]
    lines = [line for k, run in enumerate(runs) for line in _speed(run, k)]
    shown = [line for k, run in enumerate(runs[:2]) for line in _speed(run, k)]
    near = [_between(line, WHIP) for line in lines if line.x[-1] > WHIP[0] and line.style]
    text = "tip speed, m/s"
    panels = [
        Panel(x_label="time, s", y_label=text, lines=shown, y_zero=True, title="two methods"),
        Panel(x_label="time, s", y_label=text, lines=near, y_zero=True, title="tip at its largest speed"),
    ]
    coarse = [line for k, run in enumerate(runs) if k != 1 for line in _speed(run, k)]
    coarse = [_between(line, (0.0, BEFORE_THE_WHIP), named=True) for line in coarse if line.x[0] <= BEFORE_THE_WHIP]
    coarse = [dataclasses.replace(line, y=np.minimum(line.y, LARGEST_SHOWN)) for line in coarse]
    panels.append(Panel(x_label="time, s", y_label=text, lines=coarse, y_zero=True, title="longer steps, to the whip"))
    title = "Tip speed by two methods, a = 0 (figure 10 of Yi et al. 2017; our chain in place of LS-DYNA)"
    figure = Figure(name="rib-figure-10", title=title, panels=panels, height=220.0)
    note = NOTE_ON_CHAIN.format(links=chain.chain.mass.size - 1)
    return Made(text=f"{NOTE}\n{note}\n{_table(runs)}", figure=figure, complete=_is_complete(runs, len(two + others)))


def _speed(run: Winding, k: int) -> list[Line]:
    """The tip's speed of the k-th run, the first being the reference; a cross where it failed."""
    label = f"{described(run.trial)}{'' if k else ', reference'}"
    line = Line(x=run.t, y=run.speed, label=label, color=k, width=1.1 if k else 2.4)
    if run.status == "success":
        return [line]
    end = Line(x=run.t[-1:], y=run.speed[-1:], color=k, style="", marker="X")
    return [dataclasses.replace(line, label=f"{label}, {run.outcome}"), end]


def _between(line: Line, limits: tuple[float, float], *, named: bool = False) -> Line:
    """The part of a line between two times, by default without its name."""
    part = (line.x >= limits[0]) & (line.x <= limits[1])
    return dataclasses.replace(line, x=line.x[part], y=line.y[part], label=line.label * named)
