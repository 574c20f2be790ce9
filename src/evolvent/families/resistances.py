"""Resistances."""

from __future__ import annotations

import numpy as np

from evolvent.kernels import calls, resistance, turning
from evolvent.kernels.ends import of_coordinates
from evolvent.model.family import EVERY, EXPLICIT, Family, Kind, record, where
from evolvent.model.powers import FRICTION

Array = np.ndarray


@calls.apply
def apply(t, share, kept, y, s, model):
    """Torques of all resistances."""
    return resistance.add_resistances(y, share, kept, s, model), 0.0, 0.0


@calls.force
def end_step(interval, model):
    """Bristles at the end of a step, and what they have taken."""
    share = interval.step.share if interval.step.h > 0.0 else 0.5
    interval.powers[FRICTION] += resistance.end_resistances(interval.y1, 0, share, model)


@calls.end_friction
def end_friction(y, model):
    """Bristles of all resistances."""
    return resistance.end_resistances(y, 1, 0.5, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of all resistances."""
    return resistance.resistance_energy(model.switches, model)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where a bristle turns back."""
    rows, bristles, coordinates, part = model.resistances, model.bristles, model.coordinates, turning.NO_TURN
    for k in range(rows.size):
        c = rows[k].coordinate
        a, b = coordinates[c].start_rate, coordinates[c].end_rate
        for i in range(rows[k].first, rows[k].last):
            kind, start = bristles[i].kind, y[bristles[i].account]
            part = min(part, turning.until_turn_of(kind, bristles[i].stick, bristles[i].limit, start, a, b, h))
    return part


@calls.power
def friction_power(model):
    """Power of all bristles."""
    rows, power = model.resistances, 0.0
    for k in range(rows.size):
        for i in range(rows[k].first, rows[k].last):
            power += model.bristles[i].force * model.coordinates[rows[k].coordinate].end_rate
    return power


# resistances on coordinates that depend on the path (`kernels.resistance`): curves from `curve` on, bristles from
# first to last; start: number of the first curve, switch: index of that of the present one; account: of what is
# lost. time: s, of the last change of the curve, changes: how many there were
RESISTANCES = Family(
    "resistances",
    record(
        "coordinate kind curve curves first last start switch account",
        "",
        "angle rate torque rubs stored time changes",
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
    ends=of_coordinates("coordinate"),
    through=True,
    apply=apply,
    end_step=end_step,
    end_friction=end_friction,
    coupled_energy=coupled_energy,
    until_turn=until_turn,
    friction_power=friction_power,
    evaluate=False,
)  # fmt: skip

# first, count: of the coordinates among the parameters, then the torques and the energies; low, high: where the
# curve ends, and below, above: the number of the curve behind that
CURVES = Family(
    "curves",
    record("first count below above", "low high"),
    order=240,
    of="resistances",
)  # fmt: skip


@calls.contact_set
def contact_set(found, model):
    """Which bristles slip."""
    for i in range(model.bristles.size):
        found = 3 * found + 1 + int(model.bristles[i].slips)
    return found


# before, force0: coordinate and force at the start of a step; slips: the sense in which it slips; account: of the
# force
BRISTLES = Family(
    "bristles",
    record("kind account", "stick limit", "before force0 force slips"),
    order=250,
    of="resistances",
    contact_set=contact_set,
)  # fmt: skip
