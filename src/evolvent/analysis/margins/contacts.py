"""Contacts beside a coordinate: whether they touch at a position; margins have no share of one that does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.assembly import families
from evolvent.base.errors import InputError

if TYPE_CHECKING:
    from evolvent.analysis.margins.mechanism import Mechanism, Position

Array = np.ndarray

#: Halvings of the way between two stations, to where a contact first touches.
_HALVINGS = 10


def names_of(mechanism: Mechanism) -> list[str]:
    """Names of all contacts."""
    sizes = {name: families.records(mechanism.whole, name).size for name in ("contact_surfaces", "body_contacts")}
    rows = [families.owner(mechanism.assembly, name, k) for name, size in sizes.items() for k in range(size)]
    return list(dict.fromkeys(rows))


def touching(mechanism: Mechanism, at: Position) -> str:
    """Name of a contact that touches at a position, '' of none."""
    model = mechanism.with_contacts
    if model is None:
        return ""
    mechanism.left(at.t, at.y, model)
    for k, row in enumerate(model.contact_surfaces):
        if np.any(model.contact_points["gap1"][row["first"] : row["last"]] < 0.0):
            return families.owner(mechanism.assembly, "contact_surfaces", k)
    pressed = np.flatnonzero(model.body_contacts["gap1"] < 0.0)
    return families.owner(mechanism.assembly, "body_contacts", int(pressed[0])) if pressed.size else ""


def refuse_touching(
    mechanism: Mechanism, k: int, held: dict[int, float], at: Position, before: Position | None
) -> None:
    """Refuse a contact that touches at a station of coordinate k.

    Parameters
    ----------
    held : values of the coordinates that are held, by row
    before : the station before, at which none touches; None at the first one

    Raises
    ------
    InputError
        With the name of the contact and the position at which it first touches.
    """
    name = touching(mechanism, at)
    if not name:
        return
    x = float(at.x[k])
    if before is not None:
        off = float(before.x[k])
        for _ in range(_HALVINGS):
            middle = mechanism.move({**held, k: 0.5 * (off + x)}, before)
            there = touching(mechanism, middle)
            if there:
                name, x = there, float(middle.x[k])
            else:
                before, off = middle, float(middle.x[k])
    raise InputError(
        f"{name!r} touches from {x:.4g} {mechanism.unit(k)} of {mechanism.names[k]!r} on, and margins have no share of "
        f"a contact; let margin.lines.{mechanism.names[k]}.travel end before it, or take the contact out of the case"
    )


def refuse_touching_in_run(mechanism: Mechanism, k: int, at: Position) -> None:
    """Refuse a contact that touches at a sample of a run in which coordinate k moves.

    Raises
    ------
    InputError
    """
    name = touching(mechanism, at)
    if name:
        raise InputError(
            f"{name!r} touches in the run at {at.t:.4g} s, while {mechanism.names[k]!r} moves, and margins have no "
            f"share of a contact; margins at rest need no run"
        )
