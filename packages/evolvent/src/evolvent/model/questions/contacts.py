"""Contacts."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from evolvent.model.questions.base import Array, Call


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Records that are contacts, asked by samples, sensitivities and messages.

    Attributes
    ----------
    presses : function of the model to a mask of its contacts that touch
    jumps : function of its records to contacts whose force jumps at the touch
    without_normal : function of its records to contacts without a normal at the start of a step
    passing : compiled: above 1 where something may have passed through something else over a step, by the
        rotations and positions of bodies at both ends (`kernels.passing`)
    """

    presses: Callable[[Any], Array] | None = None
    jumps: Callable[[Array], Array] | None = None
    without_normal: Callable[[Array], Array] | None = None
    passing: Call = None
