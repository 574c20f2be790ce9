"""Bearings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.bearings import bearing
from evolvent.families.bearings.bearing import measure_load
from evolvent.kernels import calls, turning
from evolvent.kernels.bristle import SLIP
from evolvent.kernels.ends import of_coordinate, of_joint
from evolvent.model.family import EVERY, EXPLICIT, End, Family, Kind, Records, record
from evolvent.model.layout import Accounts
from evolvent.model.powers import COUPLED_ENERGY, RUBBED
from evolvent.model.questions import BETWEEN, Coupling, Friction, Implicit, Parts, Samples, Stability, Step
from evolvent.model.shares import FRICTION, Rule, Shares
from evolvent_base.errors import InputError

Array = np.ndarray
_3 = (3,)


def _of_bearing(row: Any, records: Records) -> Iterator[End]:
    for k in range(int(row["first"]), int(row["last"])):
        yield from of_joint(records("joints")[k], records)
    yield from of_coordinate(records("coordinates")[int(row["coordinate"])], records)


#: Rate of a bearing, beside that of the coordinate, below which it does not move; what friction may be off in the end.
_STILL, _OFF = 1e-7, 1e-12
#: Rank of what holds the mechanism, beside the largest singular value.
_RANK = 1e-10
#: Iterations to the friction at a station.
_MOST = 500


def _powers(
    mechanism: Any, shares: list[Any], direction: Any, at: Any, rows: list[int], la: Array | None
) -> dict[str, float]:
    """Virtual power of friction in each bearing, by the label of its share: N m or N, below 0 (`Shares.together`).

    By the reactions at a station, or by those of a simulated motion.

    Raises
    ------
    InputError
        Where bearings lock themselves: friction makes reactions that make more friction.

    Notes
    -----
    At a station the mechanism stands: its coordinates are held by torques, what nothing holds is accelerated. Of all
    forces Q, on the left of the equations, the multipliers la of the joints and the torques are those that leave the
    least force, beside the mass matrix M: with the gradients A of joints, loops of cables and held coordinates,
    |Q + A^T la| in M^-1 is least. Friction at its limit, the static one, against the direction is among Q, so it is
    found by iteration.
    """
    own = [share for share in shares if share.family == "bearings"]
    if not own:
        return {}
    rates = direction.rates[mechanism.whole.bearings["coordinate"]]
    rates = np.where(np.abs(rates) > _STILL, rates, 0.0)
    if la is None:
        torques = _at_rest(mechanism, shares, direction, at, rows, rates)
    else:
        torques = mechanism.whole.bearings["coefficient"] * _loads(mechanism, at, la)
    found = -np.abs(rates) * torques
    return {share.label: math.fsum(found[list(share.rows)]) for share in own}


def _loads(mechanism: Any, at: Any, la: Array) -> Array:
    """Loads of all bearings with the multipliers la: (n,), m N or N."""
    model = mechanism.bare._replace(bearings=mechanism.whole.bearings.copy())
    la = np.ascontiguousarray(la, dtype=float)
    mechanism.left(at.t, at.y, mechanism.bare, la=la)
    for k in range(model.bearings.size):
        measure_load(k, la, model)
    return np.array(model.bearings["load"])


def _at_rest(mechanism: Any, shares: list[Any], direction: Any, at: Any, rows: list[int], rates: Array) -> Array:
    """Torques or forces of all bearings at the limit of sticking, where the mechanism stands: (n,)."""
    bearings, n_j = mechanism.whole.bearings, mechanism.n_j
    others = [share for share in shares if share.family != "bearings"]
    Q = sum((mechanism.force(share, at, direction, still=True) for share in others), np.zeros(mechanism.n_v))
    A = np.vstack([at.G, mechanism.tied(at.J), at.J[rows]])
    gradients, J = np.linalg.pinv(at.mass.half(A.T), rcond=_RANK), at.J[bearings["coordinate"]]
    torques = np.zeros(bearings.size)
    for _ in range(_MOST):
        la = -gradients @ at.mass.half(Q + (np.sign(rates) * torques) @ J)
        before, torques = torques, bearings["static"] * _loads(mechanism, at, la[:n_j])
        if not np.all(np.isfinite(torques)):
            break
        if np.abs(torques - before).max() <= _OFF * np.abs(torques).max():
            return torques
    name = next(share.part for share in shares if share.family == "bearings")
    raise InputError(
        f"the friction of {name!r} and the reactions that it makes grow without an end: the mechanism locks itself at "
        f"{float(at.x[rows[0]]):.6g} {mechanism.unit(rows[0])}"
    )


@calls.force
def force(interval, model):
    """Friction by the reactions of the joints."""
    interval.powers[COUPLED_ENERGY] += bearing.add_bearings(interval.step.h, interval.la, model, model.F)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    bearing.add_bearing_tangents(interval.step.scale, interval.la, model, matrix)


@calls.force
def evaluate(interval, model):
    """Coordinates and rates of all bearings."""
    bearing.note_bearings(model)


@calls.force
def end_step(interval, model):
    """Accounts of all bearings, anchors of their bristles, and what these have taken."""
    interval.powers[RUBBED] += bearing.end_bearings(interval.step.share, interval.y1, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of the bristles."""
    return bearing.bearing_energy(model)


@calls.contact_set
def contact_set(found, model):
    """Which bearings slide."""
    return turning.note_slips(found, model.bearings)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a bearing turns back."""
    rows, part = model.bearings, turning.NO_TURN
    for k in range(rows.size):
        slider, start = model.coordinates[rows[k].coordinate], rows[k].stick * rows[k].bristle0
        part = min(part, turning.until_slider_turns(SLIP, rows[k].stick, rows[k].limit, start, slider, h))
    return part


@calls.friction_change
def friction_change(model):
    """Of all bearings, by the reactions of their joints."""
    return bearing.change_of_friction(model)


@calls.force
def start(interval, model):
    """What moves at a state slides already."""
    if interval.step.share == 1.0:
        bearing.start_bearings(bearing.AGAIN if interval.step.again != 0.0 else bearing.FIRST, model)


# friction by the reactions of a joint, whose rows are first to last, on a coordinate of its own
# (`bearing`); account: of what it has dissipated. by_force, by_moment, by_axis: derivatives of the load by
# the force and the moment on the second body, and by the axis; slips: the sense in which it slides, noted: friction
# at the iteration before; relax, fresh: under generalized-alpha. Of the last step: bristle0, rubs0, slips0, anchor
BEARINGS = Family(
    "bearings",
    record(
        "coordinate first last account",
        "coefficient static radial axial twist constant arm stick",
        "load by_force by_moment by_axis radial_force axial_force tilting slope limit angle rate "
        "bristle slips rubs noted relax fresh stored bristle0 rubs0 slips0 anchor",
        by_force=_3, by_moment=_3, by_axis=_3,
    ),
    order=330,
    results={
        "angle": ("angle", "rad", "angle since the start"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "rubs": ("torque", "N m", "torque of friction, positive against the angle"),
        "limit": ("torque_limit", "N m", "torque of friction that slides under the present load"),
        "radial_force": ("radial_force", "N", "sum of the forces across the axis on both ends of the bearing"),
        "axial_force": ("axial_force", "N", "force along the axis on the second part"),
        "tilting": ("tilting_moment", "N m", "moment across the axis on the second part, about the joint's position"),
        "stored": ("energy_elastic", "J", "elastic energy of the bristle"),
    },
    kinds=(
        Kind(
            "a bearing", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum, which find friction and reactions together",
        ),
    ),
    ends=_of_bearing,
    isolated=True,
    force=force,
    tangent=tangent,
    accounts=(Accounts(1, order=7),),
    shares=Shares((Rule(FRICTION),), place=7, together=_powers, measured="coordinate"),
    smooth=True,
    parts=Parts(totals={"reactive": lambda found: found.size}),
    coupling=Coupling(through=True),
    friction=Friction(until_turn=until_turn, change=friction_change),
    stability=Stability(by_rates=False),
    implicit=Implicit(end_step=end_step, contact_set=contact_set, start=start),
    step=Step(energy=coupled_energy),
    samples=Samples(
        evaluate=evaluate,
        kept=dict.fromkeys(("rubs", "limit", "radial_force", "axial_force", "tilting", "stored"), BETWEEN),
    ),
)  # fmt: skip
