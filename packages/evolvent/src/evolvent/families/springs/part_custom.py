"""Forces between points by a law of the user's, or of a package from outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import GetJsonSchemaHandler
from pydantic_core import PydanticCustomError

from evolvent.assembly.builder import Builder
from evolvent.compiled.laws import FORMS
from evolvent.parts.base import Group, Part, PointReferences
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Annotation


class _Law(Annotation):
    """A pydantic annotation: a function under ``@evolvent.law``; case files hold none."""

    allowed = "a function under @evolvent.law, given in Python"

    def read(self, value: Any) -> Any:
        """The function, as it is."""
        if not callable(value):
            raise PydanticCustomError("law", "it must be {allowed}", {"allowed": self.allowed})
        return value

    def write(self, value: Any) -> Any:
        """Refuse to write a function into a case file."""
        name = getattr(value, "__name__", repr(value))
        raise InputError(
            f"the law {name!r} is a Python function, which a file cannot hold; make a kind of part with it, a subclass "
            f"of CustomForce"
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Nothing that a file could hold."""
        return {"not": {}, "description": self.allowed}


ElementLaw = Annotated[Any, _Law()]


class CustomForce(Part):
    """Forces on several points that follow from their positions and velocities by a law.

    Parameters
    ----------
    points : list of point
        Point masses, points of bodies, nodes of beams, positions on the ground: "mass", "hub.left", ("hub", (x, y, z)),
        "boom.tip".
    law : function under ``@evolvent.law``
        ``law(t, x, v, parameters, f) -> (energy, power)``: from the positions x and velocities v of the k points,
        (3 k,) each, it adds to f : (3 k,) the forces on them, and returns the energy stored (J) and the power
        dissipated (W); the work of a law that always returns zeros is work of loads.
    parameters : list of float
        Of the law.

    Notes
    -----
    A part of its own is a subclass with a `kind`, keys, and `law_and_parameters`, which turns its keys into a law and
    its numbers.
    """

    kind: Literal["custom-force"] = "custom-force"
    group = Group.LOADS
    points: PointReferences
    law: ElementLaw | None = None
    parameters: units.Parameters = ()

    def law_and_parameters(self, positions: np.ndarray) -> tuple[Any, Sequence[float]]:
        """The law, and the numbers it is called with.

        Parameters
        ----------
        positions : (k, 3) float, m, of the points at the start, inertial axes
        """
        return self.law, self.parameters

    def write(self, builder: Builder, name: str) -> None:
        """Write a row of the family `custom_forces`, and a marker for each point."""
        own = [builder.marker(where, f"{name}.points[{k}]", nodes=True) for k, where in enumerate(self.points)]
        if not own:
            raise InputError(f"{name}.points is empty; a custom force needs a point to act on")
        law, parameters = self.law_and_parameters(np.array([builder.marker_state(marker)[0] for marker in own]))
        if law is None:
            raise InputError(
                f"{name}.law is missing; it must be a function under @evolvent.law, {FORMS['element'].text}"
            )
        first, last = builder.parameters(parameters)
        address = builder.law(law, "element", key=f"{name}.law")
        row = builder.add("custom_forces", law=address, first=first, last=last, first_marker=own[0], points=len(own))
        builder.names[name] = ("custom_forces", row)
