"""The winding of the wrapped rib by one method after another: time, energy, and distance from a converged run."""

from __future__ import annotations

import dataclasses
import functools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from evolvent import cases
from evolvent.analysis.runs import plan
from evolvent.results.observe import View
from evolvent.solvers.time.explicit.plan import choose_step

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
ALPHA, ENERGY, EXPLICIT = "generalized-alpha", "energy-momentum", ("rk4", "heun")
#: The chain of links of `rib_chain`, a model and method of its own.
CHAIN = "chain, central differences"
#: Time between samples, s.
EVERY = 0.01
#: CPU time (s) of a step of 40 cable elements, about, and of a whole run beside it; for forecasts alone.
COSTS = {ALPHA: (3e-5, 1.0), ENERGY: (9e-5, 1.5), "rk4": (3.5e-5, 0.1), "heun": (1.8e-5, 0.1)}
#: Shortest run, in steps, that loads all that a method needs.
WARM_STEPS = 2


class Trial(NamedTuple):
    """A run that is asked for: by a fixed step, a share of the stability limit of an explicit method, or a tolerance.

    Attributes
    ----------
    method : str
    step : float, s; None for another way
    share : float, of the stability limit
    tolerance : float, of an adaptive run
    stop : float, s, at which the run ends before the others do; None for no such time. Its CPU time is scaled up.
    radius : float, spectral radius of an implicit method; None for that of `evolvent run`
    """

    method: str
    step: float | None = None
    share: float | None = None
    tolerance: float | None = None
    stop: float | None = None
    radius: float | None = None


@dataclasses.dataclass(frozen=True)
class Winding:
    """The result of a trial.

    Attributes
    ----------
    trial : Trial
    step, mean_step : float, s, asked for (NaN of an adaptive run), and taken on average
    cpu : float, s, of the solution alone
    t, tip, speed : (nt,) s, (nt, 3) m, (nt,) m/s, of the first rib's tip
    energy, work, by_contact : (nt,) J, of the rib and its contacts, done by the loads, taken by the contacts
    gain, taken : float, of the largest energy or work: the largest climb of the energy balance, and its lowest value
    iterations : float, of Newton's method a step, NaN of an explicit method
    divided : int, steps that were divided since Newton's method had not solved them
    status, message : str, as of `Solution`
    """

    trial: Trial
    step: float
    mean_step: float
    cpu: float
    t: Array
    tip: Array
    speed: Array
    energy: Array
    work: Array
    by_contact: Array
    gain: float
    taken: float
    iterations: float
    divided: int
    status: str
    message: str

    @property
    def peak_time(self) -> float:
        """Time of the largest tip speed, s."""
        return float(self.t[np.argmax(self.speed)])

    def mean_speed(self, first: float, last: float) -> float:
        """Mean speed of the tip between two times, m/s."""
        return float(self.speed[(self.t >= first) & (self.t <= last)].mean())

    @property
    def outcome(self) -> str:
        """How the run ended."""
        if self.status == "success":
            return "finished" if self.trial.stop is None else f"run to {self.trial.stop:g} s, CPU time scaled"
        return f"{self.status} at {self.t[-1]:.4g} s"

    def error(self, reference: Winding, until: float) -> float:
        """Root of the mean square of the tip's distance from the reference up to a time, m; NaN if it was not reached.

        Parameters
        ----------
        reference : Winding, with a sample wherever this run has one
        """
        if min(self.t[-1], reference.t[-1]) < until - 1e-6:
            return math.nan
        t = self.t[self.t <= until + 1e-6]
        at = np.searchsorted(reference.t, t - 1e-6)
        distance = np.linalg.norm(self.tip[: t.size] - reference.tip[at], axis=1)
        return float(np.sqrt(np.trapezoid(distance**2, t) / (t[-1] - t[0])))


class Runnable(Protocol):
    """What runs trials: a case by the methods of the package (`Model`), or another model of it."""

    name: str

    def forecast(self, trial: Trial) -> float:
        """CPU time (s) that a trial may take, very roughly."""

    def run(self, trial: Trial) -> Winding:
        """Run a trial; a failed run is a result as any other."""


class Model:
    """A case of the wrapped rib, assembled once for implicit and once for explicit methods.

    Parameters
    ----------
    name : str, of a case; overrides : mapping, of its keys
    end : float, s, of its runs
    """

    def __init__(self, name: str, end: float, overrides: Mapping[str, Any] | None = None) -> None:
        self.name, self.end, self.overrides = name, end, dict(overrides or {})

    @functools.cache  # noqa: B019  (a command makes a few models and ends)
    def assembly(self, method: str) -> Assembly:
        """The parts of the case in arrays; joints on the rib are penalties for explicit methods."""
        given = self.overrides | {"solver.method": method}
        if method == ENERGY and cases.load(self.name, given).contact.law == "paper":
            given["contact.law"] = "hunt-crossley"
        case = cases.load(self.name, given)
        assembly: Assembly = cases.system(case.system).build(case).assemble()
        return assembly

    def settings(self, trial: Trial) -> dict[str, Any]:
        """Options of `runs.plan`, as `evolvent run` has them; a share of the stability limit becomes a step."""
        assembly = self.assembly("rk4" if trial.method in EXPLICIT else trial.method)
        if trial.method in EXPLICIT:
            limit = choose_step(assembly, trial.method, None, self.end)[1]
            return {"method": trial.method, "step": trial.step if trial.share is None else trial.share * limit}
        radius = trial.radius or (0.3 if trial.method == ALPHA else 1.0 / 3.0)
        return {"method": trial.method, "step": trial.step, "tolerance": trial.tolerance, "spectral_radius": radius}

    def run(self, trial: Trial) -> Winding:
        """Run a trial; a failed run is a result as any other."""
        settings = self.settings(trial)
        step, method = settings["step"], trial.method
        assembly = self.assembly("rk4" if method in EXPLICIT else method)
        warm = step or 1e-4
        plan(assembly, np.array([0.0, WARM_STEPS * warm]), **settings)[0].run(None)  # loads what it calls
        end = self.end if trial.stop is None else trial.stop
        samples = np.linspace(0.0, end, max(round(end / EVERY), 1) + 1)
        prepared, _ = plan(assembly, samples, **settings)
        began = time.process_time()
        found = prepared.run(None).or_start(0.0)
        return self._winding(trial, step, found, (time.process_time() - began) * self.end / end)

    def _winding(self, trial: Trial, step: float | None, found: Solution, cpu: float) -> Winding:
        view = View.of(found)
        places, rates = view.nodes(view.index("rib-1"))
        counts, defect = found.statistics, found.energy_defect
        largest = max(np.abs(found.energy).max(), np.abs(found.balance.loads).max(), 1e-300)
        return Winding(
            trial=trial,
            step=math.nan if step is None else step,
            mean_step=float(found.t[-1] - found.t[0]) / max(counts["steps"], 1),
            cpu=cpu,
            t=found.t,
            tip=places[:, -1, 0],
            speed=np.linalg.norm(rates[:, -1, 0], axis=1),
            energy=found.energy,
            work=found.balance.loads,
            by_contact=found.balance.by_contact,
            gain=float(np.max(defect - np.minimum.accumulate(defect)) / largest),
            taken=float(max(-defect.min(), 0.0) / largest),
            iterations=counts["iterations"] / max(counts["steps"], 1) if "iterations" in counts else math.nan,
            divided=int(counts.get("divided_steps", 0)),
            status=found.status,
            message=found.message,
        )

    def forecast(self, trial: Trial) -> float:
        """CPU time (s) that a trial may take, very roughly."""
        step = self.settings(trial)["step"] or 0.02
        each, whole = COSTS[trial.method]
        return whole + each * (trial.stop or self.end) / step


def run_all(
    trials: Sequence[tuple[Runnable, Trial]], report: Callable[[str], None]
) -> Iterator[tuple[Runnable, Winding]]:
    """Run one trial after another; Ctrl-C ends them, and an interrupted run is the last one.

    Raises
    ------
    KeyboardInterrupt
        Where it ends the first run.
    """
    guesses = [model.forecast(trial) for model, trial in trials]
    spent = 0.0
    for k, (model, trial) in enumerate(trials):
        done = sum(guesses[:k])
        left = sum(guesses[k:]) * (spent / done if done > 0.0 else 1.0)
        report(f"run {k + 1} of {len(trials)}: {model.name}, {described(trial)}; about {math.ceil(left)} s left")
        began = time.perf_counter()
        try:
            found = model.run(trial)
        except KeyboardInterrupt:  # while a function is compiled
            if k == 0:
                raise
            return
        spent += time.perf_counter() - began
        yield model, found
        if found.status == "interrupted":
            return


def described(trial: Trial) -> str:
    """A trial in words."""
    method = trial.method if trial.radius is None else f"{trial.method} (spectral radius {trial.radius:g})"
    if trial.tolerance is not None:
        return f"{method}, tolerance {trial.tolerance:g}"
    if trial.share is not None:
        return f"{method}, {'at' if trial.share == 1.0 else f'{trial.share:g} of'} the stability limit"
    return f"{method}, step {trial.step:g} s"


def written(value: float, *, least: float = 0.0) -> str:
    """A number with two digits, "-" for none; what lies below `least` is named so."""
    if math.isnan(value):
        return "-"
    if value < least:
        return f"< {least:g}"
    digits = math.floor(math.log10(value)) if value > 0.0 else 0
    return f"{value:.2g}" if digits < 1 else f"{round(value, 1 - digits):.0f}"


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |".replace("| --- ", "|---").replace("---|", "---|") for line in lines)
