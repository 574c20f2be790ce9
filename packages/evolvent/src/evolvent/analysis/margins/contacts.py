"""Contacts beside a coordinate: the force of each at a position, and where it first touches.

Notes
-----
The normal force is the elastic one of the depth at the position, k d^n, and gives or takes energy as a spring does;
friction is mu times it, against the velocity of the point along the direction of the coordinate. Rigid parts do not
yield: their depth is that of the coordinates. Elastic parts are in equilibrium with the normal forces (`elastic`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from evolvent.analysis.margins.positions import Direction, MechanismModels, Position
from evolvent.analysis.margins.shares import Share
from evolvent.assembly.families import records
from evolvent.model.shares import NORMAL
from evolvent_base.errors import InputError

Array = np.ndarray

#: Part of a normal force along motions that nothing holds, beside all of it, that is round-off.
_HELD = 1e-9
#: Halvings of the way between two stations, to where a contact first touches.
_HALVINGS = 10


def force(mechanism: MechanismModels, share: Share, at: Position, direction: Direction) -> Array:
    """Generalised forces of a contact's share on the left of the equations, with those of the bare model: (nv,)."""
    n_q, n_v, contact = mechanism.n_q, mechanism.n_v, share.evaluated.contact
    assert contact is not None
    own = records(mechanism.whole, share.family)[list(share.rows)]
    pressed = mechanism.once(f"{share.part}.{NORMAL}", **{share.family: contact.pressing(own, False)})
    if share.aspect == NORMAL:
        return mechanism.left(at.t, at.y, pressed)[:n_v]
    rubbed, y = mechanism.once(share.label, **{share.family: contact.pressing(own, True)}), at.y.copy()
    y[n_q : n_q + n_v] = direction.v
    # within a step of an explicit method (whose length does not count) bristles are dampers
    both = [mechanism.left(at.t, y, model, step=math.inf)[:n_v] for model in (rubbed, pressed)]
    return np.asarray(at.zero + both[0] - both[1])


def touching(
    mechanism: MechanismModels, shares: list[Share], direction: Direction, at: Position
) -> dict[str, tuple[Share, Array]]:
    """Shares of the contacts that touch at a position, and their normal forces (nv,), by the name of the contact."""
    found = {}
    for share in shares:
        if share.evaluated.contact is not None and share.aspect == NORMAL:
            own = force(mechanism, share, at, direction) - at.zero
            if np.any(own):
                found[share.part] = share, own
    return found


def refuse_undetermined(
    mechanism: MechanismModels, found: dict[str, tuple[Share, Array]], rows: list[int], at: Position
) -> None:
    """Refuse contacts that touch at a position and whose forces do not follow from the coordinates.

    Parameters
    ----------
    found : of `touching`
    rows : the coordinate with the margin, and those that are held at a station; none along a run, which has all places

    Raises
    ------
    InputError
        With the name of the contact and the reason.
    """
    for name, (share, own) in found.items():
        contact = share.evaluated.contact
        assert contact is not None
        row = records(mechanism.whole, share.family)[share.rows[0]]
        why = "" if contact.undetermined is None else contact.undetermined(row)
        if not why and rows and mechanism.elastic is None and _is_free(mechanism, own, rows, at):
            why = "its depth follows from a motion that no joint and no held coordinate determines; hold that part"
        if why:
            k = rows[0] if rows else 0
            where = (
                f"at {round(float(at.x[k]), 12) + 0.0:.4g} {mechanism.unit(k)} of {mechanism.names[k]!r}"
                if rows
                else "in the run"
            )
            raise InputError(
                f"{name!r} touches {where}, and its force is not determined there: {why}, let the travel end before "
                f"it, or take the contact out of the case"
            )


def _is_free(mechanism: MechanismModels, own: Array, rows: list[int], at: Position) -> bool:
    """Whether forces do work along motions that joints, loops of cables and held coordinates leave."""
    A = np.vstack([at.G, mechanism.tied(at.J), at.J[rows]])
    B, f = at.mass.half(A.T), at.mass.half(own)
    norms = np.linalg.norm(B, axis=0)
    norms[norms == 0.0] = 1.0
    left = f - B @ (np.linalg.lstsq(B / norms, f, rcond=_HELD)[0] / norms)
    return bool(np.linalg.norm(left) > _HELD * np.linalg.norm(f))


def first_touch(
    mechanism: MechanismModels, share: Share, near: Mapping[int, tuple[float, float]], direction: Direction, k: int,
    before: Position | None,
) -> float:  # fmt: skip
    """Value of coordinate k from which on a contact touches, rad or m.

    Parameters
    ----------
    near : values of the coordinates at the station before, at which it does not touch, and at one at which it does, by
        row
    before : the position of the former; None at the first station
    """
    if before is None:
        return near[k][1]
    switches = mechanism.bare.switches.copy()
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        half = 0.5 * (low + high)
        middle = mechanism.move({j: first + (last - first) * half for j, (first, last) in near.items()}, before)
        if touching(mechanism, [share], direction, middle):
            high = half
        else:
            low, before = half, middle
    mechanism.bare.switches[:] = switches
    return near[k][0] + (near[k][1] - near[k][0]) * high
