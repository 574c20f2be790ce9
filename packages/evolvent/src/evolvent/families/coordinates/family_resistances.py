"""Resistances."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import scipy

from evolvent.families.coordinates import coordinate, resistance
from evolvent.families.coordinates.relaxing_curve import relaxed_resistances, strain_of
from evolvent.families.relaxation.family import set_of
from evolvent.kernels import axial, calls, turning
from evolvent.kernels.ends import OfCoordinates
from evolvent.kernels.extremes import note_extremes
from evolvent.model import zeros
from evolvent.model.family import EVERY, EXPLICIT, Family, Kind, record, where
from evolvent.model.layout import Accounts, Switches
from evolvent.model.powers import JOINTS, RUBBED
from evolvent.model.questions import Coupling, Friction, Implicit, Parts, Samples, Statics, Step, Switching, Torques
from evolvent.model.shares import ADHESION, HARNESS, SPRING, Rule, Shares

Array = np.ndarray


@calls.apply
def apply(t, share, kept, y, s, model):
    """Torques of all resistances."""
    stored, lost = resistance.add_resistances(y, share, kept, s, model)
    return stored, lost, 0.0


@calls.force
def end_step(interval, model):
    """Bristles at the end of a step, and what they have taken."""
    interval.powers[JOINTS] += relaxed_resistances(interval.step.h, model)
    share = interval.step.share if interval.step.h > 0.0 else 0.5
    interval.powers[RUBBED] += resistance.end_resistances(interval.y1, 0, share, model)


@calls.end_friction
def end_friction(y, model):
    """Bristles of all resistances."""
    return resistance.end_resistances(y, 1, 0.5, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of all resistances."""
    return resistance.resistance_energy(model.switches, model)


@calls.power
def friction_power(model):
    """Power of all bristles."""
    rows, power = model.resistances, 0.0
    for k in range(rows.size):
        for i in range(rows[k].first, rows[k].last):
            power += model.bristles[i].force * model.coordinates[rows[k].coordinate].end_rate
    return power


#: Shares of a harness: its curve helps or resists; its bristles slip against the direction and resist in full.
_CURVE, _HYSTERESIS = "elastic", "hysteresis"
#: Rate of a coordinate, beside that of the direction, below which it does not move.
_OFF = 1e-7
#: Points at which the torque of a curve is evaluated between two rows, both rows included.
_PLACES = 9


def _of_kind(kind: int) -> Callable[[Any], bool]:
    return lambda row: bool(row["kind"] == kind)


def _has_bristles(row: Any) -> bool:
    return bool(row["kind"] == resistance.HARNESS and row["first"] != row["last"])


def _row(mechanism: Any, share: Any) -> Any:
    (row,) = (mechanism.whole.resistances[k] for k in share.rows)
    return row


def _curve(mechanism: Any, row: Any) -> Any:
    """The curve of a resistance now."""
    return mechanism.whole.curves[int(row["curve"]) + int(mechanism.bare.switches[row["switch"]])]


def _set_curve(mechanism: Any, row: Any, at: Any, still: bool) -> None:
    """Let the curve of a resistance be that of a position: at rest that of the start, or the one behind its end.

    The strains of its branches are those of the start, and follow the strain but for what it changes by between curves.
    """
    switches, x = mechanism.bare.switches, float(at.x[int(row["coordinate"])])
    branches = slice(int(row["branch"]), int(row["branch"]) + int(row["prony_end"]) - int(row["prony"]))
    if still:
        switches[row["switch"]] = mechanism.assembly.s[row["switch"]]
        mechanism.bare.branch_strains["x0"][branches] = mechanism.assembly.model.branch_strains["x0"][branches]
    curve, before = _curve(mechanism, row), int(switches[row["switch"]])
    if not curve["low"] <= x <= curve["high"]:
        switches[row["switch"]] = curve["below" if x < curve["low"] else "above"]
        if branches.stop > branches.start:
            end, first = float(curve["low" if x < curve["low"] else "high"]), int(row["curve"])
            y0, y1 = (strain_of(first + c, end, mechanism.whole)[0] for c in (before, int(switches[row["switch"]])))
            mechanism.bare.branch_strains["x0"][branches] += y1 - y0


def _force(mechanism: Any, share: Any, at: Any, direction: Any, still: bool) -> Array:
    row = _row(mechanism, share)
    _set_curve(mechanism, row, at, still)
    k = int(row["coordinate"])
    own, rate = mechanism.bare.bristles[int(row["first"]) : int(row["last"])], float(direction.rates[k])
    if share.aspect == _HYSTERESIS:
        limit = 0.0 if abs(rate) <= _OFF else math.copysign(math.fsum(own["limit"]), rate)
        return np.asarray(at.zero + limit * at.J[k])
    own["before"], own["force0"] = at.x[k], 0.0
    return np.asarray(mechanism.left(at.t, at.y, mechanism.with_share(share))[: mechanism.n_v])


def _power(mechanism: Any, share: Any, at: Any, direction: Any, still: bool) -> float | None:
    """Of an adhesion that holds: the most that it takes before it breaks in the direction."""
    row = _row(mechanism, share)
    _set_curve(mechanism, row, at, still)
    curve, rate = _curve(mechanism, row), float(direction.rates[int(row["coordinate"])])
    end = float(curve["high" if rate > 0.0 else "low"])
    if row["kind"] != resistance.ADHESION or abs(rate) <= _OFF or not math.isfinite(end):
        return None
    x, torque = mechanism.whole.parameters[int(curve["first"]) :][: 2 * int(curve["count"])].reshape(2, -1)
    held = rate * float(np.interp(end, x, torque))
    return -held if held > 0.0 else None


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where a bristle turns back."""
    rows, part = model.resistances, turning.NO_TURN
    for k in range(rows.size):
        slider = model.coordinates[rows[k].coordinate]
        for i in range(rows[k].first, rows[k].last):
            own = model.bristles[i]
            part = min(part, turning.until_slider_turns(own.kind, own.stick, own.limit, y[own.account], slider, h))
    return part


def _no_balance(model: Any, _: float, y: Array) -> Iterator[tuple[int, str]]:
    """Tape-springs that would have snapped before, and adhesions that would have broken."""
    for k, row in enumerate(model.resistances):
        curve = model.curves[int(row["curve"]) + int(model.switches[row["switch"]])]
        x = float(model.coordinates["angle"][row["coordinate"]])
        if not curve["low"] - resistance.AT_END <= x <= curve["high"] + resistance.AT_END:
            end = float(curve["low"] if x < curve["low"] else curve["high"])
            why = (
                f"has no equilibrium as it is: it would be at {x:.6g}, beyond {end:.6g}, where it changes over; "
                f"find what follows by a run in time"
            )
            yield k, why


def _torques(model: Any, row: Any, state: int, wanted: float, at: Iterable[float]) -> Array:
    """Torques of a curve at places, (n,) float, where its branches keep a strain; 0 where that of the curve is."""
    strains = [strain_of(int(row["curve"]) + state, float(x), model)[:2] for x in at]
    return np.array([(y - wanted) * by_x for y, by_x in strains])


def _towards(model: Any, row: Any, state: int, x: float) -> Array:
    """Places from x on towards where the energy of a curve is least: to there, or to the end before it."""
    curve = model.curves[int(row["curve"]) + state]
    end = min(max(float(curve["zero"]), float(curve["low"])), float(curve["high"]))
    rows = model.parameters[int(curve["first"]) :][: int(curve["count"])]
    own = rows[(rows > min(x, end)) & (rows < max(x, end))]
    corners = np.unique([x, *own, end])
    inner = [np.linspace(*pair, _PLACES) for pair in itertools.pairwise(corners)]
    found = np.unique(np.concatenate([corners, *inner]))
    return found if end >= x else found[::-1]


def _released(model: Any, row: Any, x: float) -> float | None:
    """Where the torque of a resistance is zero just after a release at x, past snaps; None where it is not.

    No time passes: the strain that its branches keep is that at x but for what it changes by between curves
    (`relaxing_curve.snap`).
    """
    state, wanted = int(model.switches[row["switch"]]), float(set_of(model, row)[0])
    relaxed = float(model.prony_terms["share"][int(row["prony"]) : int(row["prony_end"])].sum())
    for _ in range(int(row["curves"])):
        at = _towards(model, row, state, x)
        torques = _torques(model, row, state, wanted, at)
        if torques[0] == 0.0:
            return x
        zeros = np.flatnonzero(torques[1:] * torques[0] <= 0.0)
        if zeros.size:
            own, k = functools.partial(_torques, model, row, state, wanted), int(zeros[0])
            return float(scipy.optimize.brentq(lambda place: own([place])[0], at[k], at[k + 1], xtol=1e-12))  # noqa: B023
        curve, x = model.curves[int(row["curve"]) + state], float(at[-1])
        after = int({curve["low"]: curve["below"], curve["high"]: curve["above"]}.get(x, -1))
        if after < 0:
            return None
        before, then = (float(strain_of(int(row["curve"]) + one, x, model)[0]) for one in (state, after))
        state, wanted = after, wanted + relaxed * (then - before)
    return None


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    """Where the torque is zero just after a sudden release, from where that of the curve at the lowest energy is."""
    row = model.resistances[index]
    slider = model.coordinates[int(row["coordinate"])]
    found, zero = _released(model, row, float(slider["angle"])), float(model.curves["zero"][int(row["curve"])])
    if found is not None:
        name, unit = ("angle", "rad") if slider["kind"] == axial.ANGLE else ("travel", "m")
        yield f"{name} beyond that of no torque", found - zero, unit


@calls.force
def start(interval, model):
    """Bristles, which are among the accounts of a state."""
    if interval.step.again == 0.0:
        coordinate.begin_resistances(interval.step.t, interval.y1, interval.s, model)


@calls.note_extremes
def note_resistances(s, model):
    """Extremes of the coordinates, rates, torques and bristle torques of all resistances."""
    rows = model.resistances
    for k in range(rows.size):
        note_extremes(rows[k].extremes, 0, rows[k].angle)
        note_extremes(rows[k].extremes, 1, rows[k].rate)
        note_extremes(rows[k].extremes, 2, rows[k].torque)
        note_extremes(rows[k].extremes, 3, rows[k].rubs)


# resistances on coordinates that depend on the path (`resistance`): curves from `curve` on, bristles from
# first to last; start: number of the first curve, switch: index of that of the present one; account: of what is
# lost. time: s, of the last change of the curve, changes: how many there were
RESISTANCES = Family(
    "resistances",
    record(
        "coordinate kind curve curves first last start switch account prony prony_end branch",
        "",
        "angle rate torque rubs stored time changes extremes",
        extremes=(8,),
    ),
    order=230,
    results={
        "angle": ("angle", "rad", "angle on which it acts"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque, positive against the angle"),
        "rubs": ("hysteresis_torque", "N m", "torque of the bristles, part of the torque"),
        "stored": ("energy_elastic", "J", "elastic energy"),
    },
    kinds=(
        Kind("a harness", which=where("kind", resistance.HARNESS), symmetric=True),
        Kind(
            "a tape-spring hinge", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, whose steps end where it snaps",
            which=where("kind", resistance.TAPE_SPRING),
            symmetric=True,
        ),
        Kind(
            "an adhesion", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, whose steps end where it breaks",
            which=where("kind", resistance.ADHESION),
            symmetric=True,
        ),
    ),
    ends=OfCoordinates("coordinate"),
    isolated=True,
    accounts=(Accounts(1, order=4),),
    switches=(Switches(1, lambda found, _: found["start"], order=3),),
    shares=Shares(
        (
            Rule(HARNESS, _CURVE, which=_of_kind(resistance.HARNESS)),
            Rule(HARNESS, _HYSTERESIS, which=_has_bristles),
            Rule(SPRING, which=_of_kind(resistance.TAPE_SPRING)),
            Rule(ADHESION, which=_of_kind(resistance.ADHESION)),
        ),
        place=6,
        unforced=lambda model: {"resistances": zeros("resistances", 0), "bristles": model.bristles.copy()},
        force=_force,
        power=_power,
    ),
    parts=Parts(reads_inertia=False),
    coupling=Coupling(through=True),
    torques=Torques(apply=apply),
    friction=Friction(end=end_friction, power=friction_power, rubbed=lambda found: iter([found["account"]])),
    implicit=Implicit(end_step=end_step, start=start),
    step=Step(energy=coupled_energy),
    switching=Switching(change=resistance.change_curves),
    statics=Statics(no_balance=_no_balance, sets=_sets),
    samples=Samples(
        local=True, evaluate=False, extremes=("angle", "rate", "torque", "rubs"), note_extremes=note_resistances
    ),
)  # fmt: skip

# first, count: of the coordinates among the parameters, then the torques and the energies; low, high: where the
# curve ends, and below, above: the number of the curve behind that; zero: of a viscoelastic one where its energy is 0,
# infinite below or above all of it
CURVES = Family(
    "curves",
    record("first count below above", "low high zero"),
    order=240,
    of="resistances",
)  # fmt: skip


@calls.contact_set
def contact_set(found, model):
    """Which bristles slip."""
    return turning.note_slips(found, model.bristles)


# before, force0: coordinate and force at the start of a step; slips: the sense in which it slips; account: of the
# force
BRISTLES = Family(
    "bristles",
    record("kind account", "stick limit", "before force0 force slips"),
    order=250,
    of="resistances",
    accounts=(Accounts(1, start="force0", states=(0,), order=5),),
    friction=Friction(rubs=lambda found: np.ones(found.size, dtype=bool), until_turn=until_turn),
    implicit=Implicit(contact_set=contact_set),
)  # fmt: skip
