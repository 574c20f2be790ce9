"""An assembled system."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from evolvent import model as mdl
from evolvent_base.errors import InputError, nearest

Array = np.ndarray


class Pose(NamedTuple):
    """Where a body is at the start: position (3,), rotation (3, 3), velocity (3,), angular velocity (3,), inertial."""

    x: Array
    R: Array
    v: Array
    w: Array


@dataclasses.dataclass
class Assembly:
    """An assembled system: its model, initial state and the names of its parts.

    Attributes
    ----------
    model : Model
    y : (ny,) float, initial state [q | v | accounts]
    s : (ns,) int, initial switches
    names : dict, name -> (family, index)
    laws : dict, address -> user's law, kept alive as long as the model uses it
    row_parts : list of str, the part that wrote each row of the constraints
    parts : dict, name -> part, as the user wrote them
    expressions : dict, first index of its parameters -> the compiled function that runs it, and the text
    relaxations : dict, first Prony term of a law -> (viscoelastic part, the law, `evolvent.elements.viscoelastic`)
    directions : Model, optional, that of explicit methods, where the model has positions as coordinates of threads with
        segments of fixed length (`evolvent.solvers.common.coordinates`)
    shared : dict, what follows from the structure and was found for a variant of it, by name; None of a system that has
        no variants (`evolvent.assembly.variants`)
    touched : frozenset of str, arrays of the model in which it may differ from the first of its variants; None where it
        is not known
    """

    model: mdl.Model
    y: Array
    s: Array
    names: dict[str, tuple[str, int]]
    laws: dict[int, Any]
    row_parts: list[str]
    parts: dict[str, Any] = dataclasses.field(default_factory=dict)
    expressions: dict[int, tuple[Any, str]] = dataclasses.field(default_factory=dict)
    relaxations: dict[int, tuple[str, Any]] = dataclasses.field(default_factory=dict)
    directions: mdl.Model | None = None
    shared: dict[str, Any] | None = None
    touched: frozenset[str] | None = None

    def index(self, name: str, family: str | None = None) -> int:
        """Index of the part called `name` in its family."""
        if name not in self.names:
            raise InputError(f"no part is called {name!r}; {nearest(name, self.names)}")
        found, index = self.names[name]
        if family is not None and found != family:
            raise InputError(f"{name!r} is one of the {found.replace('_', ' ')}, not of the {family.replace('_', ' ')}")
        return index
