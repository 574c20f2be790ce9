"""Table 1 and figure 10 of Yi, Yuan, Dong & Li (2017): a rib wound without damping by two models and several methods.

The paper compares its elements with a model in LS-DYNA, which it does not describe. Here a chain of point masses by
central differences (`rib_chain`) takes the place of that model; explicit methods on the same mesh are compared too.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from evolvent import cases
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.rib_captions import title
from evolvent_papers.papers.rib_chain import LINKS, Chain
from evolvent_papers.papers.winding import (
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

#: What the paper sets for this comparison.
FREE: Mapping[str, Any] = {"damping.alpha": 0.0}
#: End of the runs, s, and a time shortly before the tip whips onto the hub.
END, BEFORE_THE_WHIP = 40.0, 28.0
#: Step of the cable beside the chain, s, and of the chain, of its limit: it then gains less than 1 % of the energy.
KEEPING, HALF = 2.5e-3, 0.45
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
#: What of figure 10 is ours, the torque and what stands in place of the paper's second method.
OURS = "torque 0.2 N m, a chain of links in place of LS-DYNA"
#: Names of the runs of figure 10.
PAIRS = (
    "implicit, 40 cable elements", "explicit, chain of links", "cable, hunt-crossley 0.5 s/m",
    "chain, hunt-crossley 0.5 s/m",
)  # fmt: skip
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
NOTE_ON_ENERGY = """\
After the whip the course depends on what the contacts take. With contacts that keep all energy (cable: contact.law
conservative, spectral radius 1; chain: springs) both models keep the work of the torque, and the tip goes on at the
same mean speed. The contacts of the case, hunt-crossley, take some 40 % of the energy in the whip, in both models.
"""
NOTE_ON_CHAIN = f"""\
{CHAIN}: a second model, a program of its own in NumPy, in place of the paper's LS-DYNA model: {{links}} links between
point masses, contact at the joints, without damping where not named. Its tip error contains the difference of the
models. At 0.9 of the limit it gains energy in the whip. Most of its CPU time is NumPy's.
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
    dissipation : float, s/m, of its contacts
    """

    def __init__(self, end: float, overrides: Mapping[str, Any], links: int = LINKS, dissipation: float = 0.0) -> None:
        self.name, self.end = "wrapped-rib", end
        self.chain = Chain(cases.load(self.name, dict(overrides)), links, dissipation)

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
        speed = np.interp(t, motion.t, motion.speed)
        energy, work = (np.interp(t, motion.sampled, one) for one in (motion.energy, motion.work))
        defect, largest, keeps = energy - work, max(np.abs(energy).max(), 1e-300), self.chain.dissipation == 0.0
        known = keeps and not motion.diverged  # its contacts do not count what they take
        return Winding(
            trial=trial, step=step, mean_step=motion.step, cpu=motion.cpu, t=t, tip=tip, speed=speed, energy=energy,
            work=work, by_contact=np.full(t.size, 0.0 if keeps else math.nan),
            gain=float(np.max(defect - np.minimum.accumulate(defect)) / largest) if known else math.nan,
            taken=float(max(-defect.min(), 0.0) / largest) if known else math.nan,
            iterations=math.nan, divided=0, status="diverged" if motion.diverged else "success", message="",
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


def _table(runs: list[Winding], names: Sequence[str] = ()) -> str:
    """Rows of runs, whose first is the reference; names of the first runs in place of their method's."""
    return markdown(TABLE, [_row(run, runs[0], name) for run, name in zip_longest(runs, names)])


def _row(run: Winding, reference: Winding, name: str | None = None) -> list[str]:
    """A run in the table."""
    errors = [written(1e3 * run.error(reference, until), least=0.01) for until in (BEFORE_THE_WHIP, END)]
    is_reference = run is reference
    return [
        (name or run.trial.method) + (", reference" if is_reference else ""),
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


def two_models(end: float, *, quick: bool = False) -> Iterator[tuple[str, Runnable, Trial]]:
    """The cable and the chain with contacts that keep the energy, and with those of the case: name, model and trial."""
    taken, links = cases.load("wrapped-rib", dict(FREE)).contact.dissipation, QUICK_LINKS * 3 // 2 if quick else LINKS
    keeping = {**FREE, "contact.law": "conservative"}
    yield "cable", Model("wrapped-rib", end, keeping), Trial(ENERGY, step=KEEPING, radius=1.0)
    yield "chain", ChainModel(end, FREE, links), Trial(CHAIN, share=HALF)
    yield "damped_cable", Model("wrapped-rib", end, FREE), Trial(ENERGY, step=KEEPING)
    yield "damped_chain", ChainModel(end, FREE, links, taken), Trial(CHAIN, share=HALF)


def figure_10(options: Options) -> Made:
    """The tip's speed over time by the implicit method and by a second model with an explicit method."""
    main = [(model, trial) for _, model, trial in two_models(END, quick=options.quick)]
    (cable, _), (chain, _) = main[2], main[1]
    assert isinstance(chain, ChainModel)
    fine: tuple[Runnable, Trial] = (cable, Trial(ENERGY, step=QUICK_FINE if options.quick else FINE))
    others: list[tuple[Runnable, Trial]] = [(cable, Trial(ENERGY, step=0.05))]
    others += [(cable, Trial(ALPHA, step=step)) for step in ((0.5,) if options.quick else (0.5, 0.1, 0.005))]
    others += [(chain, Trial(CHAIN, step=0.5))]
    wanted = [fine, *main, *others]
    runs = [one for _, one in run_all(wanted, options.report)]
    reference, pairs, coarse = runs[0], runs[1:5], [runs[0], *runs[5:]]
    named = [(run, name, k) for k, (run, name) in enumerate(zip(pairs, PAIRS, strict=False))]
    text = "tip speed, m/s"
    panels = [
        Panel(x_label="time, s", y_label=text, lines=[_curve(*one, "speed") for one in named[:2]], y_zero=True,
              title="two methods, contacts that keep the energy"),
        Panel(x_label="time, s", y_label=text, lines=[_curve(*one, "speed") for one in named[2:]], y_zero=True,
              title="ours: contacts that take energy, as of the case"),
        Panel(x_label="time, s", y_label="energy, J", lines=[_curve(*one, "energy") for one in named], y_zero=True,
              title="ours: energy of motion, stretch, bending and contact"),
    ]  # fmt: skip
    lines = [line for k, run in enumerate(coarse) for line in _speed(run, k)]
    lines = [_between(line, (0.0, BEFORE_THE_WHIP)) for line in lines if line.x[0] <= BEFORE_THE_WHIP]
    lines = [dataclasses.replace(line, y=np.minimum(line.y, LARGEST_SHOWN)) for line in lines]
    words = "ours: longer steps, to the whip"
    panels.append(Panel(x_label="time, s", y_label=text, lines=lines, y_zero=True, title=words))
    figure = Figure(name="rib-figure-10", title=title(10, OURS), panels=panels, height=250.0)
    note = NOTE_ON_CHAIN.format(links=chain.chain.mass.size - 1)
    table = _table([reference, *pairs, *coarse[1:]], [ENERGY, *PAIRS[: len(pairs)]])
    body = f"{NOTE}\n{note}\n{NOTE_ON_ENERGY}\n{table}"
    return Made(text=body, figure=figure, complete=_is_complete(runs, len(wanted)))


def _curve(run: Winding, name: str, k: int, what: str) -> Line:
    """Speed of the tip or energy of a run over time."""
    return Line(x=run.t, y=getattr(run, what), label=name, color=k, width=1.6 if k % 2 else 2.0)


def _speed(run: Winding, k: int) -> list[Line]:
    """The tip's speed of the k-th run, the first being the reference; a cross where it failed."""
    label = f"{described(run.trial)}{'' if k else ', reference'}"
    line = Line(x=run.t, y=run.speed, label=label, color=k, width=1.1 if k else 2.4)
    if run.status == "success":
        return [line]
    end = Line(x=run.t[-1:], y=run.speed[-1:], color=k, style="", marker="X")
    return [dataclasses.replace(line, label=f"{label}, {run.outcome}"), end]


def _between(line: Line, limits: tuple[float, float]) -> Line:
    """The part of a line between two times."""
    part = (line.x >= limits[0]) & (line.x <= limits[1])
    return dataclasses.replace(line, x=line.x[part], y=line.y[part])
