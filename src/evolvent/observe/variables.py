"""What an observation is made of: variables with dimensions and units, and what is drawn and plotted of them."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray
#: Names of the three components of a vector.
AXES = ("x", "y", "z")


class Variable(NamedTuple):
    """A quantity at every sample.

    Attributes
    ----------
    dims : names of the dimensions, "time" first where it changes; "axis" counts x, y, z
    values : array
    units : str, SI, as UDUNITS writes them ("kg m2 s-1")
    long_name : str, what it is and in which axes
    """

    dims: tuple[str, ...]
    values: Array
    units: str
    long_name: str


@dataclasses.dataclass
class Observed:
    """Results of one part.

    Attributes
    ----------
    variables : dict, name -> Variable
    drawn : list of dict, how the part is drawn, in words of JSON: see `evolvent.observe.drawing`
    plots : list of str, names of the variables that its default figures show
    """

    variables: dict[str, Variable] = dataclasses.field(default_factory=dict)
    drawn: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    plots: list[str] = dataclasses.field(default_factory=list)

    def scalar(self, name: str, values: Array, units: str, long_name: str) -> None:
        """Add a number at every sample: (nt,)."""
        self.variables[name] = Variable(("time",), np.asarray(values, dtype=float), units, long_name)

    def vector(self, name: str, values: Array, units: str, long_name: str) -> None:
        """Add a vector at every sample: (nt, 3)."""
        self.variables[name] = Variable(("time", "axis"), np.asarray(values, dtype=float), units, long_name)

    def along(self, name: str, dimension: str, values: Array, units: str, long_name: str) -> None:
        """Add numbers (nt, n) or vectors (nt, n, 3) over a dimension of the part's own."""
        dims = ("time", dimension, "axis")[: np.ndim(values)]
        self.variables[name] = Variable(dims, np.asarray(values, dtype=float), units, long_name)


def norm(values: Array) -> Array:
    """Lengths of vectors (..., 3)."""
    found: Array = np.sqrt(np.einsum("...i,...i->...", values, values))
    return found


def dot(a: Array, b: Array) -> Array:
    """Scalar products of vectors (..., 3)."""
    found: Array = np.einsum("...i,...i->...", a, b)
    return found


def turned(R: Array, v: Array) -> Array:
    """Vectors v (3,) or (nt, 3) of body axes in inertial ones, R (nt, 3, 3)."""
    found: Array = np.einsum("tij,...j->ti" if np.ndim(v) == 1 else "tij,tj->ti", R, v)
    return found


def turned_back(R: Array, v: Array) -> Array:
    """Vectors v (nt, 3) of inertial axes in those of a body, R (nt, 3, 3)."""
    found: Array = np.einsum("tji,tj->ti", R, v)
    return found
