"""Spring-damper between two markers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.builder import Builder
from evolvent.parts.checks import not_negative


@dataclasses.dataclass(frozen=True, kw_only=True)
class Spring:
    """A spring-damper along the line between two points.

    Parameters
    ----------
    a, b : str, (str, (3,) float) or (3,) float
        Ends: a point's or body's name, a body's name with a position in its axes, or a position on the ground.
    stiffness : float, N/m
    damping : float, N s/m
    length : float, m, natural length; the distance at the start if left out
    law : function under ``@evolvent.spring_law``, optional
        ``law(extension, rate, t, parameters) -> tension`` in place of stiffness and damping.
    parameters : sequence of float, of the law
    """

    a: Any
    b: Any
    stiffness: float = 0.0
    damping: float = 0.0
    length: float | None = None
    law: Any = None
    parameters: Sequence[float] = ()

    def write(self, builder: Builder, name: str) -> None:
        """Write the spring into the family `springs`."""
        a, b = builder.marker(self.a), builder.marker(self.b)
        length = self.length
        if length is None:
            length = float(np.linalg.norm(builder.marker_state(b)[0] - builder.marker_state(a)[0]))
        first, last = builder.parameters(self.parameters)
        index = builder.add(
            "springs",
            a=a,
            b=b,
            stiffness=not_negative(f"{name}.stiffness", self.stiffness),
            damping=not_negative(f"{name}.damping", self.damping),
            length=not_negative(f"{name}.length", length),
            law=0 if self.law is None else builder.law(self.law, "spring"),
            first=first,
            last=last,
        )
        builder.names[name] = ("springs", index)
