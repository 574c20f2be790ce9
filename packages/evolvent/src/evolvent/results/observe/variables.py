"""What an observation is made of: variables with dimensions and units, and what is drawn and plotted of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from evolvent.model import RESULTS, registry
from evolvent.results.rotations import quaternions

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
    extremes : array (2, ...), least and largest values over all steps, with the dimensions of `values` other than time;
        NaN where one is not known; None if none is known
    """

    dims: tuple[str, ...]
    values: Array
    units: str
    long_name: str
    extremes: Array | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """Number of entries of each dimension."""
        return dict(zip(self.dims, self.values.shape, strict=True))

    def isel(self, chosen: Mapping[Any, Any]) -> Variable:
        """The entries at an index of a dimension, which is gone then, or at several."""
        found = self
        for dim, index in chosen.items():
            axis = found.dims.index(dim)
            dims = found.dims if np.ndim(index) else found.dims[:axis] + found.dims[axis + 1 :]
            at = (slice(None),) * axis + (index,)
            extremes = found.extremes if dim == "time" or found.extremes is None else found.extremes[at]
            found = found._replace(dims=dims, values=found.values[at], extremes=extremes)
        return found

    def reduce(self, function: Callable[..., Array], dim: Any, *, keep_attrs: bool = True) -> Variable:
        """A function of the values along a dimension, which is gone then: as of xarray's variables."""
        axis = self.dims.index(dim)
        dims = self.dims[:axis] + self.dims[axis + 1 :]
        return self._replace(dims=dims, values=function(self.values, axis=axis), extremes=None)


class FamilyFields(dict[str, Array]):
    """Fields of the records of a family at samples, by name: (nt, n, ...) each.

    Parameters
    ----------
    noted : tuple of str, m fields whose extremes over all steps are stored in the records
    extremes : (n, 2 m) float, least and largest value of each of these fields in turn; (n, 2 m, k) for k copies
    """

    def __init__(self, values: Mapping[str, Array], noted: tuple[str, ...] = (), extremes: Array | None = None) -> None:
        super().__init__(values)
        self._noted, self._extremes = noted, extremes

    def extremes_of(self, field: str, index: Any) -> Array | None:
        """Least and largest value over all steps of a field of one record, (2,), or of m records, (2, m).

        Of k copies (2, k) or (2, m, k). None if they are not known, as without a time loop.
        """
        if self._extremes is None or field not in self._noted:
            return None
        at = 2 * self._noted.index(field)
        found = self._extremes[index, at : at + 2]
        pair = found.ndim - self._extremes.ndim + 1
        return np.moveaxis(found, pair, 0).copy() if np.isfinite(found).all() else None


@dataclasses.dataclass
class Observed:
    """Results of one part.

    Attributes
    ----------
    variables : dict, name -> Variable
    coordinates : dict, name -> Variable, of positions along the part's own dimensions
    drawn : list of dict, how the part is drawn, in words of JSON: see `evolvent.results.observe.symbols`
    plots : list of str, names of the variables that its default figures show
    plots_along : list of str, the same of one state: variables along its length
    happened : list of (time in s, what happened), beside the events that the solver has found
    one_sided : dict, name of a variable that is zero or of one sign, as the tension of a cord -> word for it at zero
    given : list of str, names of variables that the case gives over time, as a load: figures go on while they change
    """

    variables: dict[str, Variable] = dataclasses.field(default_factory=dict)
    coordinates: dict[str, Variable] = dataclasses.field(default_factory=dict)
    drawn: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    plots: list[str] = dataclasses.field(default_factory=list)
    plots_along: list[str] = dataclasses.field(default_factory=list)
    happened: list[tuple[float, str]] = dataclasses.field(default_factory=list)
    one_sided: dict[str, str] = dataclasses.field(default_factory=dict)
    given: list[str] = dataclasses.field(default_factory=list)

    def scalar(self, name: str, values: Array, units: str, long_name: str, *, extremes: Array | None = None) -> None:
        """Add a number at every sample: (nt,); `extremes` as of `Variable`."""
        self.variables[name] = Variable(("time",), np.asarray(values, dtype=float), units, long_name, extremes)

    def vector(self, name: str, values: Array, units: str, long_name: str) -> None:
        """Add a vector at every sample: (nt, 3)."""
        self.variables[name] = Variable(("time", "axis"), np.asarray(values, dtype=float), units, long_name)

    def happens(self, what: str, time: float, t: Array) -> None:
        """Add an event at a time (s) where it lies within the samples' times t (nt,)."""
        if t.size and t[0] <= time <= t[-1]:
            self.happened.append((float(time), what))

    def changes(self, t: Array, state: Array, words: Mapping[int, str]) -> None:
        """Add an event at each sample with another state (nt,) than the one before, where its value has a word."""
        for k in np.flatnonzero(np.diff(state)) + 1:
            if (word := words.get(int(state[k]))) is not None:
                self.happened.append((float(t[k]), word))

    def acts_one_way(self, t: Array, name: str, *, zero: str, other: str) -> None:
        """State that a variable (nt,) is zero for a time, and add the events: `zero` and `other` are its words.

        What is below a share of 1e-6 of its largest value is zero.
        """
        self.one_sided[name] = zero
        size = np.abs(np.nan_to_num(self.variables[name].values))
        self.changes(t, (size > 1e-6 * size.max(initial=0.0)).astype(int), {0: zero, 1: other})

    def along(
        self,
        name: str,
        dimension: str,
        values: Array,
        units: str,
        long_name: str,
        *,
        extremes: Array | None = None,
    ) -> None:
        """Add numbers (nt, n) or vectors (nt, n, 3) over a dimension of the part's own; see `scalar`."""
        dims = ("time", dimension, "axis")[: np.ndim(values)]
        self.variables[name] = Variable(dims, np.asarray(values, dtype=float), units, long_name, extremes)

    def attitudes(self, name: str, dimension: str, R: Array, long_name: str) -> None:
        """Add rotation matrices (nt, n, 3, 3) over a dimension of the part's own, as quaternions without jumps."""
        q = quaternions(R)
        sign = np.cumprod(np.where(np.einsum("tni,tni->tn", q[1:], q[:-1]) < 0.0, -1.0, 1.0), axis=0)
        q[1:] *= sign[..., None]
        self.variables[name] = Variable(("time", dimension, "quaternion"), q, "1", long_name)

    def results(self, family: str, fields: FamilyFields, index: int, without: Collection[str] = ()) -> None:
        """Add the fields of a record that are results (`model.RESULTS`), but those `without`.

        Parameters
        ----------
        fields : `View.fields` of the family
        """
        for field, described in RESULTS[family].items():
            if field not in without:
                values = fields[field][:, index]
                if values.ndim == 1:
                    self.scalar(described[0], values, *described[1:], extremes=fields.extremes_of(field, index))
                else:
                    self.vector(described[0], values, *described[1:])

    def results_along(
        self, family: str, fields: Mapping[str, Array], own: slice, dimension: str, without: Collection[str], where: str
    ) -> None:
        """`results` of the records `own` along a dimension; `where` follows the words of each."""
        for field, (name, units, words) in RESULTS[family].items():
            if field not in without:
                self.along(name, dimension, fields[field][:, own], units, f"{words}, {where}")

    def coordinate(self, name: str, dimension: str, values: Array, units: str, long_name: str) -> None:
        """Add a coordinate (n,) of a dimension of the part's own; of the dimension's name, it numbers its entries."""
        self.coordinates[name] = Variable((dimension,), np.asarray(values), units, long_name)


_OBSERVERS: dict[str, Callable[[Any, str], Observed]] = {}
Observer = TypeVar("Observer", bound=Callable[[Any, str], Observed])


def observer(family: str) -> Callable[[Observer], Observer]:
    """Decorator of the function that finds the results of the parts of a family."""

    def register(function: Observer) -> Observer:
        _OBSERVERS[family] = function
        return function

    return register


def observers() -> dict[str, Callable[[Any, str], Observed]]:
    """Functions of a view of a run and the name of a part to its results, by the family of the part (`observer`)."""
    registry.beside("observer")  # whose functions register themselves
    return _OBSERVERS


def norm(values: Array) -> Array:
    """Lengths of vectors (..., 3)."""
    found: Array = np.sqrt(np.einsum("...i,...i->...", values, values))
    return found


def cross(a: Array, b: Array) -> Array:
    """Vector products of vectors (..., 3): as of numpy.cross, in a third of its time."""
    found = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=found[..., i])
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


def integral(t: Array, rate: Array) -> Array:
    """Integral (nt,) of a rate since the first sample, by the trapezoidal rule."""
    found = np.zeros(t.size)
    np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t), out=found[1:])
    return found


def unwrapped(t: Array, angle: Array, rate: Array) -> Array:
    """An angle (nt,) over any number of turns, of one to whole turns and its rate.

    The rate determines how many turns lie between two samples, so that there may be several.
    """
    about = integral(t, rate)
    return angle[:1] + about + np.unwrap(angle - angle[:1] - about)
