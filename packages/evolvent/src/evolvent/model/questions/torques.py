"""Torques on the coordinates of joints."""

from __future__ import annotations

import dataclasses

from evolvent.model.questions.base import Call


@dataclasses.dataclass(frozen=True)
class Torques:
    """Torques on coordinates of another family, asked by the forces of that. All are compiled.

    Attributes
    ----------
    apply : torques at the coordinates' last evaluation, (t, share, kept, y, s, model) as of
        `families.coordinates.coordinate.add_applied`; returns energy (J), and the powers that it takes and gives (W)
    tangent : derivatives of them, between different coordinates or into `motor_slope` and `motor_damper` of each
    """

    apply: Call = None
    tangent: Call = None
