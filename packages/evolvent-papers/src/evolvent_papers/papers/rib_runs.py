"""Windings of the rib of Yi, Yuan, Dong & Li (2017) with fine samples about the whip, for figures and claims."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.analysis.runs import plan
from evolvent.analysis.settings import sample_times
from evolvent.families.contact.observer_surfaces import touching_span
from evolvent.results.fine_samples import Times
from evolvent.results.observe import View
from evolvent.view.drawing import smooth
from evolvent_papers.wrapped_rib.derived import FOLLOWED, touching_angle, wrap_angle

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: The paper's mass damping, 1/s, and the end of the run with each, s; those with damping come to rest on the hub.
ALPHAS: Mapping[float, float] = {0.0: 40.0, 0.2: 150.0, 0.5: 180.0}
#: Half the interval about the largest tip speed in which a run is sampled again, s, and the samples in it.
ABOUT_THE_PEAK, FINE = 0.05, 501
#: Time over which the contact force is averaged, s: it converges where single samples do not.
WINDOW = 0.01


@dataclasses.dataclass(frozen=True, eq=False)
class RibRun:
    """A winding.

    Attributes
    ----------
    case : Case
    status, message : str, as of `Solution`
    statistics : mapping, as of `Solution`
    t : (nt,) float, s; `even` : (nt,) bool, samples of even times, without those about the whip
    x, rates : (nt, n + 1, vectors, 3) float, nodes and their rates
    force, impulse, points : (nt,) float, N, N s, 1, normal forces on the hub, their integral, points that touch
    gap : (nt, points) float, m, of each contact point, NaN where it is far away
    """

    case: Any
    status: str
    message: str
    statistics: Mapping[str, float]
    t: Array
    even: Array
    x: Array
    rates: Array
    force: Array
    impulse: Array
    points: Array
    gap: Array

    @property
    def speed(self) -> Array:
        """Speed of the tip (nt,), m/s."""
        return np.linalg.norm(self.rates[:, -1, 0], axis=1)

    @property
    def peak(self) -> int:
        """Sample at which the tip is fastest."""
        return int(np.argmax(self.speed))

    @property
    def largest_mean_force(self) -> float:
        """Largest mean of the contact force over `WINDOW`, N, from the impulse."""
        start = np.arange(self.t[0], self.t[-1] - WINDOW, 0.05 * WINDOW)
        gained = np.interp(start + WINDOW, self.t, self.impulse) - np.interp(start, self.t, self.impulse)
        return float(gained.max()) / WINDOW

    @property
    def touching(self) -> Array:
        """Whether each contact point touches, (nt, points) bool."""
        return np.nan_to_num(self.gap, nan=np.inf) < 0.0

    @property
    def turns(self) -> Array:
        """Turns by which the rib is wound, as if its tail were straight, (nt,), as `wrap_angle` of the results."""
        return wrap_angle(self._path[:, None], self.case.hub.radius)[:, 0] / (2.0 * math.pi)

    @property
    def touching_turns(self) -> Array:
        """Turns from the root to the last place that touches, (nt,), as `touching_angle` of the results."""
        points, length = self.gap.shape[1], self.case.rib.length
        _, last = touching_span(length / points * np.arange(1, points + 1), self.gap)
        return touching_angle(self._path, last, length) / (2.0 * math.pi)

    @property
    def _path(self) -> Array:
        """Points along the rib, (nt, n, 3), m."""
        return smooth(self.x[:, :, 0], self.x[:, :, 1], self.case.rib.element_length, FOLLOWED)


def winding(name: str = "wrapped-rib", **keys: Any) -> RibRun:
    """A run of a case, kept for the next call.

    Parameters
    ----------
    name : str, of a case
    keys : of the case, with "__" in place of dots (damping__alpha=0.2)
    """
    return _winding(name, tuple(sorted(keys.items())))


@functools.lru_cache(maxsize=24)
def _winding(name: str, keys: tuple[tuple[str, Any], ...]) -> RibRun:
    case = cases.load(name, {key.replace("__", "."): value for key, value in keys})
    system = cases.system(case.system)
    return simulated(system.build(case).assemble(), case)


def simulated(assembly: Assembly, case: Any) -> RibRun:
    """A run of the assembled parts of a case, sampled again about the largest tip speed where the tip whips."""
    system = cases.system(case.system)
    settings = system.settings(case)
    settings.pop("fine", None)  # the samples about the whip are chosen here
    even = sample_times(settings.pop("until"), settings.pop("every"), values=assembly.y.size)
    times = Times.of(even, system.between(case), fine=False, values=assembly.y.size)
    found = _read(_solved(assembly, times.all, settings), case, times.regular)
    at = found.t[found.peak]
    if found.status != "success" or found.even[found.peak]:
        return found
    more = at + ABOUT_THE_PEAK * np.linspace(-1.0, 1.0, FINE)
    more = np.concatenate([system.between(case), more[(more > 0.0) & (more < even[-1])]])
    times = Times.of(even, np.unique(more), fine=False, values=assembly.y.size)
    return _read(_solved(assembly, times.all, settings), case, times.regular)


def _solved(assembly: Assembly, times: Array, settings: Mapping[str, Any]) -> Solution:
    prepared, _ = plan(assembly, times, **settings)
    found: Solution = prepared.run(None).or_start(0.0)
    return found


def _read(solution: Solution, case: Any, kept: Array) -> RibRun:
    view = View.of(solution)
    x, rates = view.nodes(view.index("rib-1"))
    contact = {field: values[:, view.index("contact-1")] for field, values in view.fields["contact_surfaces"].items()}
    return RibRun(
        case=case, status=solution.status, message=solution.message, statistics=solution.statistics,
        t=solution.t, even=kept[: solution.t.size], x=x, rates=rates,
        force=contact["normal"], impulse=contact["impulse"], points=contact["touching"],
        gap=view.fields["contact_points"]["apart"],
    )  # fmt: skip


def runs(wanted: Sequence[Mapping[str, Any]], report: Callable[[str], None]) -> Iterator[RibRun]:
    """Run one after another; an interrupted run is the last one.

    Parameters
    ----------
    wanted : keys of each run, as of `winding`
    """
    for k, keys in enumerate(wanted):
        given = ", ".join(f"{key.replace('__', '.')} {value}" for key, value in keys.items() if key != "name")
        report(f"run {k + 1} of {len(wanted)}: {given}")
        found = winding(**keys)
        if found.status == "interrupted":
            _winding.cache_clear()
            yield found
            return
        yield found


def of_the_paper(*, quick: bool = False) -> list[dict[str, Any]]:
    """Keys of the windings with the paper's three mass dampings; quick: 20 elements."""
    coarse = {"rib__elements": 20} if quick else {}
    return [{"damping__alpha": alpha, "solver__duration": end} | coarse for alpha, end in ALPHAS.items()]
