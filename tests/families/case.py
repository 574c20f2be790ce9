"""What is known of a small system that has a family of the table."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipj

from evolvent import System
from evolvent.assembly.assembled import Assembly
from implicit.rigs import coordinates

Array = np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Case:
    """A system that has a family, and what is known of it.

    Attributes
    ----------
    part : str, the part that belongs to the family
    system : function of nothing to the System
    seen : function of (assembly, states (..., ny)) to the quantities that are compared, (..., k)
    motion : function of times (nt,) to their exact values, (nt, k); not a number where no closed form is known
    end : float, s, of the motion; step : float, s, of RK4
    stops : bool, whether an event ends the motion, at `end`
    theory : float, relative difference between the system and that of the closed form
    kink : float, relative error of explicit methods where their order falls: friction that sets in within a step
    still : (k,) float, exact values in equilibrium; poles : (n,) complex, the slowest ones, exact
    time, rotating, damped : options of statics and modes
    """

    part: str
    system: Callable[[], System]
    seen: Callable[[Assembly, Array], Array]
    motion: Callable[[Array], Array]
    end: float
    step: float
    stops: bool = False
    theory: float = 1e-7
    kink: float = 0.0
    still: ArrayLike | None = None
    poles: ArrayLike | None = None
    time: float = 0.0
    rotating: str | None = None
    damped: bool = False

    @property
    def times(self) -> Array:
        """Times at which motions are compared, s."""
        return np.linspace(0.0, 1.9 * self.end if self.stops else self.end, 9)


CASES: dict[str, Callable[[], Case]] = {}


def of(family: str) -> Callable[[Callable[[], Case]], Callable[[], Case]]:
    """Enter a function that makes a case under the name of its family."""

    def enter(make: Callable[[], Case]) -> Callable[[], Case]:
        CASES[family] = functools.cache(make)
        return CASES[family]

    return enter


# ------------------------------------------------------------------------------------------------ closed forms


def swing(t: Array, start: float, w: float) -> Array:
    """Angle of phi'' = -w^2 sin(phi), from rest at `start`."""
    k = math.sin(0.5 * start)
    _, cn, dn, _ = ellipj(w * t, k * k)
    return 2.0 * np.arcsin(k * cn / dn)


def columns(*values: Any) -> Array:
    """Functions of time and constants as the columns of a matrix."""
    return np.stack(np.broadcast_arrays(*values), axis=-1)


def springs_poles(*squares: float) -> Array:
    """Poles of undamped modes, from the squares of their frequencies."""
    return 1j * np.sqrt(np.sort(squares))


def at(name: str) -> Callable[[Assembly, Array], Array]:
    """Coordinates of a point, or of a body."""
    return lambda assembly, y: coordinates(assembly, y, name)
