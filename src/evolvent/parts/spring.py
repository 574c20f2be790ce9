"""Spring-damper between two markers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.parts.checks import not_negative, unit_vector
from evolvent.parts.law import write_law


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
    law : optional, tension (N) in place of stiffness and damping: an expression of the extension x (m), its rate v
        (m/s) and t (s), or a function under ``@evolvent.spring_law``:
        ``law(extension, rate, t, parameters) -> tension``
    parameters : list of numbers, of a Python law
    constants : mapping of names to numbers, of an expression
    lateral_stiffness, lateral_damping : float, N/m and N s/m
        Against displacement of `b` across the axis of the spring's mount; `a` must then be on the ground.
    axis : (3,) float, of that mount, inertial frame; from `a` to `b` at the start if left out
    """

    a: Any
    b: Any
    stiffness: float = 0.0
    damping: float = 0.0
    length: float | None = None
    law: Any = None
    parameters: Sequence[float] = ()
    constants: Any = None
    lateral_stiffness: float = 0.0
    lateral_damping: float = 0.0
    axis: Sequence[float] | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the spring into the family `springs`."""
        a, b = builder.marker(self.a), builder.marker(self.b)
        apart = builder.marker_state(b)[0] - builder.marker_state(a)[0]
        length = float(np.linalg.norm(apart)) if self.length is None else self.length
        sideways = [
            not_negative(f"{name}.lateral_stiffness", self.lateral_stiffness),
            not_negative(f"{name}.lateral_damping", self.lateral_damping),
        ]
        axis = np.zeros(3)
        if any(sideways):
            if isinstance(self.a, str) or isinstance(self.a[0], str):
                raise InputError(f"{name}.a is {self.a!r}; a spring with lateral stiffness must stand on the ground")
            axis = unit_vector(f"{name}.axis", apart if self.axis is None else self.axis)
        law = {"law": 0, "first": 0, "last": 0}
        if self.law is not None:
            law = write_law(builder, name, self.law, "spring", self.parameters, self.constants)
        index = builder.add(
            "springs",
            a=a,
            b=b,
            stiffness=not_negative(f"{name}.stiffness", self.stiffness),
            damping=not_negative(f"{name}.damping", self.damping),
            length=not_negative(f"{name}.length", length),
            lateral_stiffness=sideways[0],
            lateral_damping=sideways[1],
            axis=axis,
            **law,
        )
        builder.names[name] = ("springs", index)
