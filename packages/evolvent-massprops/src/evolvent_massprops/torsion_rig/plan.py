"""A measurement on a torsion rig, planned: in which orientations, and how often each is clamped."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent_base import answer as an
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown
from evolvent_massprops.torsion_rig.adjustment import Fit, critical_value, fit
from evolvent_massprops.torsion_rig.equations import Moments, stiffness
from evolvent_massprops.torsion_rig.inputs import Inputs
from evolvent_massprops.torsion_rig.keys import OnRig, RigPlan, load
from evolvent_massprops.torsion_rig.measured import evaluate
from evolvent_massprops.uncertain import Uncertain

#: Numbers of orientations that are compared, and angles of the first one that are tried, per distance of two.
COUNTS, STARTS = (3, 4, 5, 6), 12
#: Normal deviate of the chance of four in five, with which the smallest wrong record is found.
_POWER = 0.8416


@dataclasses.dataclass(frozen=True, eq=False)
class RigOption:
    """Orientations that are clamped several times each.

    Attributes
    ----------
    angles : (n,) float, rad
    mountings : int, of each orientation
    std : mapping, Ixx, Ixz, Izz -> standard uncertainty, with that of the bar's stiffness
    relative : mapping, Ixx, Izz -> U over the value
    least : float, part of a moment by which one record must be off to be found, in the worst orientation; infinite
        without redundancy
    reached : bool, whether the wanted uncertainty is
    """

    angles: np.ndarray
    mountings: int
    std: Mapping[str, float]
    relative: Mapping[str, float]
    least: float
    reached: bool

    @property
    def worst(self) -> float:
        """The largest relative expanded uncertainty."""
        return max(self.relative.values())


@dataclasses.dataclass(frozen=True, eq=False)
class RigMeasurementPlan(Shown):
    """A planned measurement on a torsion rig.

    Attributes
    ----------
    wanted : float, relative expanded uncertainty
    factor : float, coverage factor k
    best : RigOption
    options : tuple of RigOption, one a number of orientations
    floor : tuple of (label, part of U over the value), of what no mounting more improves, the largest first
    curves : (mountings, (options, mountings) largest U over the value)
    """

    wanted: float
    factor: float
    best: RigOption
    options: tuple[RigOption, ...]
    floor: tuple[tuple[str, float], ...]
    curves: tuple[np.ndarray, np.ndarray]

    named = "plans"

    def answer(self) -> an.Answer:
        """What is recommended, what was compared, and what limits it."""
        best = self.best
        listed = ", ".join(f"{math.degrees(one):.0f}" for one in best.angles)
        times = "once" if best.mountings == 1 else f"{best.mountings} times"
        verdict = f"hang the part in {len(best.angles)} orientations, at {listed} deg, and clamp each {times}"
        if len(best.angles) == 1:
            verdict = f"hang the part {times}"
        if not best.reached:
            verdict = f"{100.0 * self.wanted:.3g} % is not reached; nearest: {verdict}"
        rows = [
            (
                f"{len(one.angles)}", ", ".join(f"{math.degrees(a):.0f}" for a in one.angles), f"{one.mountings}",
                *(f"{100.0 * x:.3g} %" for x in one.relative.values()),
                "-" if math.isinf(one.least) else f"{100.0 * one.least:.2g} %",
                _tested(one), "reached" if one.reached else "not reached",
            )
            for one in self.options
        ]  # fmt: skip
        heads = ("orientations", "angles deg", "mountings of each", *best.relative, "wrong record found from",
                 "a wrong record is", "")  # fmt: skip
        floor = [(label, f"{100.0 * share:.3g} %") for label, share in self.floor]
        return an.Answer(
            title="Plan of a measurement",
            heads=[verdict, f"U (k = {self.factor:g}) over the value; a wrong record is found in four of five cases"],
            sections=[
                an.Section(title="", blocks=[an.Table(heads=heads, rows=rows, title="orientations", words=2)]),
                an.Section(title="", blocks=[an.Table(heads=("", "part of U, over the value"), rows=floor,
                                                      title="what further mountings do not improve")]),
                an.Section(title="", blocks=[self._figure()]),
            ],
        )  # fmt: skip

    def _figure(self) -> Figure:
        count, worst = self.curves
        lines = [
            Line(x=count, y=100.0 * row, label=f"{len(one.angles)} orientations", color=k)
            for k, (row, one) in enumerate(zip(worst, self.options, strict=True))
        ]
        wanted = Line(x=count[[0, -1]], y=np.full(2, 100.0 * self.wanted), label="wanted", color="gray", width=0.8)
        label = f"largest expanded uncertainty (k = {self.factor:g}), %"
        panel = Panel(x_label="mountings of each orientation", y_label=label, lines=[*lines, wanted])
        return Figure(name="plan", title="Uncertainty over the number of mountings", panels=[panel], columns=1)


def _tested(one: RigOption) -> str:
    """What redundancy lets one say of a wrong record; mountings are averaged, an orientation is tested."""
    spare = len(one.angles) * one.mountings - 3
    return "not found" if spare < 1 else "found, not named" if spare == 1 else "found and named"


def plan(stand: str | os.PathLike[str] | Mapping[str, Any] | OnRig, wanted: float,
         overrides: Mapping[str, Any] | None = None) -> RigMeasurementPlan:  # fmt: skip
    """Orientations and mountings by which the planar moments get a wanted uncertainty.

    Parameters
    ----------
    stand : path, mapping or OnRig; `plan` has the expected moments, else the measured orientations give them
    wanted : float, U over the value of Ixx and Izz
    overrides : mapping, dotted key -> value

    Raises
    ------
    InputError

    Notes
    -----
    Orientations lie evenly over 180 deg; the first is where the largest U is smallest. Each mounting is a record of its
    own, with its error of angle and moment. The stiffness of the bar is what no mounting improves.
    """
    given = _expecting(load(stand, overrides))
    asked = given.plan
    assert asked is not None
    options, rows = [], []
    counts = (1,) if given.body.shape == "round" else COUNTS
    bar, most = _bar(given), np.arange(1, asked.mountings + 1)
    for count in counts:
        spread = math.pi / count
        starts = [spread * k / STARTS for k in range(STARTS if count > 1 else 1)]
        fits = [
            (angles, _one_each(given, angles)) for angles in (start + spread * np.arange(count) for start in starts)
        ]
        angles, one_each = min(fits, key=lambda of: _option(given, of[0], of[1], bar, 1, wanted).worst)
        worst = [_option(given, angles, one_each, bar, int(m), wanted) for m in most]
        rows.append([one.worst for one in worst])
        options.append(next((one for one in worst if one.reached), worst[-1]))
    best = min(
        options, key=lambda one: (not one.reached, len(one.angles) * one.mountings if one.reached else one.worst)
    )
    return RigMeasurementPlan(
        wanted=wanted, factor=given.uncertainty.coverage_factor, best=best, options=tuple(options),
        floor=_floor(given), curves=(most.astype(float), np.array(rows)),
    )  # fmt: skip


def _expecting(given: OnRig) -> OnRig:
    """The description with expected moments: those that are stated, or those that its orientations give."""
    if given.plan is not None:
        if given.plan.Ixx.value <= 0.0 or given.plan.Izz.value <= 0.0:
            raise InputError("plan.Ixx and plan.Izz are the expected moments; both must be above 0")
        if given.plan.Ixz.value**2 >= given.plan.Ixx.value * given.plan.Izz.value:
            raise InputError(f"plan.Ixz is {given.plan.Ixz.value:g} kg m2, which no body has with these Ixx and Izz")
        return given
    found = evaluate(given)
    if found.moments is None:
        raise InputError("plan is missing; give the expected moments, such as plan: {Ixx: 2.2 kg m^2, Izz: 2.3 kg m^2}")
    if given.body.shape == "round":
        values = {"Ixx": found["Ixx"], "Izz": found["Ixx"]}
    else:
        values = {key: found[key] for key in ("Ixx", "Ixz", "Izz")}
    return given.replaced(plan=RigPlan(**values))


def records(given: OnRig, angles: np.ndarray, mountings: int) -> OnRig:
    """The description of the measurement that is planned, with the periods that are expected.

    Parameters
    ----------
    given : OnRig with `plan`
    angles : (n,) float, rad
    mountings : int
    """
    asked = given.plan
    assert asked is not None
    tensor = np.array([asked.Ixx.value, asked.Ixz.value, asked.Izz.value])
    inputs = Inputs(given)
    k, fixture = float(stiffness(inputs.values, inputs)), given.stand.fixture.value
    listed = []
    for a in angles:
        c, s = math.cos(a), math.sin(a)
        whole = float(np.array([c * c, -2.0 * s * c, s * s]) @ tensor) + fixture
        period = 2.0 * math.pi * math.sqrt(whole / k)
        listed += [
            {"name": f"{math.degrees(a):.1f} deg, {m + 1}", "angle": Uncertain(float(a), asked.angle),
             "period": Uncertain(period, asked.period * period)}
            for m in range(mountings)
        ]  # fmt: skip
    return given.replaced(orientations=tuple(listed), pendulums=())


def _option(given: OnRig, angles: np.ndarray, one: Fit, bar: float, mountings: int, wanted: float) -> RigOption:
    """What orientations give, each clamped so many times.

    Parameters
    ----------
    one : Fit, of each orientation once
    bar : float, relative standard uncertainty of the bar's stiffness
    """
    values = dict(zip(one.of.parameters, one.values, strict=True))
    covariance = one.own_covariance / mountings + bar**2 * np.outer(one.values, one.values)
    std = {key: math.sqrt(covariance[k, k]) for k, key in enumerate(one.of.parameters)}
    factor = given.uncertainty.coverage_factor
    relative = {key: factor * std[key] / abs(values[key]) for key in std if key != "Ixz"}
    least = math.inf
    spare = len(angles) * mountings - len(values)
    if spare > 0:
        # each mounting is tested against all others
        leverage = np.einsum("np,pq,nq->n", one.design, one.own_covariance / mountings, one.design)
        free = 1.0 - leverage / np.diag(one.variance)
        found = critical_value(len(angles) * mountings, 0.5 * given.uncertainty.false_alarms) + _POWER
        part = found * np.sqrt(np.diag(one.variance) / np.maximum(free, 1e-12)) / one.predicted
        least = float(part.max())
    return RigOption(angles, mountings, std, relative, least, max(relative.values()) <= wanted)


def _one_each(given: OnRig, angles: np.ndarray) -> Fit:
    """The fit of each orientation once, with the expected periods."""
    made = records(given, angles, 1)
    return fit(Moments(made, Inputs(made)))


def _bar(given: OnRig) -> float:
    """Relative standard uncertainty of the bar's stiffness."""
    return math.sqrt(sum(part**2 for _, part in _bar_parts(given)))


def _bar_parts(given: OnRig) -> list[tuple[str, float]]:
    """Relative parts of the stiffness' uncertainty by its inputs."""
    inputs = Inputs(given)
    y, k = inputs.values, float(stiffness(inputs.values, inputs))
    found = []
    for j, one in enumerate(inputs.listed):
        shift = np.zeros(y.size)
        shift[j] = 0.5 * one.std
        part = float(stiffness(y + shift, inputs) - stiffness(y - shift, inputs)) / k
        if abs(part) > 0.0:
            found.append((one.key, abs(part)))
    return found


def _floor(given: OnRig) -> tuple[tuple[str, float], ...]:
    factor = given.uncertainty.coverage_factor
    return tuple(sorted(((key, factor * part) for key, part in _bar_parts(given)), key=lambda one: -one[1]))


def check(stand: str | os.PathLike[str] | Mapping[str, Any] | OnRig, option: RigOption,
          overrides: Mapping[str, Any] | None = None, *, runs: int, seed: int = 1) -> dict[str, float]:  # fmt: skip
    """Scatter of simulated measurements over the predicted one, of each planar moment.

    Parameters
    ----------
    stand, overrides : as of `plan`
    option : RigOption
    runs : int
    seed : int

    Notes
    -----
    True numbers, those of the rod included, are drawn around what is read; the periods that follow are evaluated.
    """
    given = _expecting(load(stand, overrides))
    made = records(given, option.angles, option.mountings)
    inputs = Inputs(made)
    problem = Moments(made, inputs)
    expected, truth, std = fit(problem).values, inputs.values, inputs.std
    names = [one.name for one in problem.equations]
    periods, repeats = ([inputs.place[f"{name}.{key}"] for name in names] for key in ("period", "moment"))
    random, found = np.random.default_rng(seed), []
    for _ in range(runs):
        drawn = truth + std * random.standard_normal(truth.size)
        whole = problem.predicted(expected, drawn) * (1.0 + drawn[repeats]) + drawn[inputs.place["stand.fixture"]]
        read = 2.0 * math.pi * np.sqrt(whole / stiffness(drawn, inputs)) + drawn[periods] - truth[periods]
        for place, value in zip(periods, read, strict=True):
            inputs.listed[place] = inputs.listed[place]._replace(value=float(value))
        found.append(fit(problem).values)
    scatter = np.std(found, axis=0, ddof=1)
    return {key: float(s / option.std[key]) for key, s in zip(problem.parameters, scatter, strict=True)}
