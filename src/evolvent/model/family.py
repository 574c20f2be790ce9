"""What a family of records is, and which families there are.

A family is declared by one module: of the package `evolvent.families`, or of another distribution that has an entry
point of the group `evolvent.families`. Nothing else names it: whatever the package asks about parts, it asks every
family of a model.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.base import plugins
from evolvent.model.shares import Rule, Shares

Array = np.ndarray

EXPLICIT, IMPLICIT, ENERGY, STATIC, MODES = "explicit", "implicit", "energy", "static", "modes"
#: Solvers, and what messages call them.
SOLVERS = {
    EXPLICIT: "rk4, heun and dopri5",
    IMPLICIT: "generalized-alpha",
    ENERGY: "energy-momentum",
    STATIC: "equilibrium",
    MODES: "modes",
}
EVERY = frozenset(SOLVERS)
#: Group of entry points, and package, of modules that declare families.
GROUP, PACKAGE = "evolvent.families", "evolvent.families"
#: Words of the work of a load.
WORK = "work since the first sample, of the power interpolated between the samples times the load's course in time"
#: What a record acts on: ("bodies", index), ("reduced_bodies", index), ("vectors", index).
End = tuple[str, int]
#: Records of a family by its name.
Records = Callable[[str], Any]


def record(integers: str, floats: str = "", scratch: str = "", **shapes: tuple[int, ...]) -> np.dtype:
    """A family's record: integer and float fields that a part writes, then scratch that a call overwrites.

    Parameters
    ----------
    shapes : of fields that are no scalars
    """
    names: list[tuple[str, type]] = [(name, np.int64) for name in integers.split()]
    names += [(name, np.float64) for name in (floats + " " + scratch).split()]
    return np.dtype([(name, kind, shapes.get(name, ())) for name, kind in names], align=True)


def where(field: str, value: Any) -> Callable[[Array], Array]:
    """Mask of the records of which a field has a value, as `Kind.which`."""
    return lambda found: np.asarray(found[field] == value)


def has_parameters(found: Array, others: int) -> Array:
    """Whether loads have more than `others` parameters: (n,) bool."""
    return np.asarray(found["last"] - found["first"] > others)


@dataclasses.dataclass(frozen=True)
class Kind:
    """Some records of a family, as messages call them, and which solvers support them.

    Attributes
    ----------
    name : str, as messages call one of it
    solvers : frozenset of str, those that support it
    advice : str, what to use instead
    which : function of the records to a mask of those that are of the kind; None for all
    symmetric : whether its stiffness is symmetric: for all records, or a function of the model and the records
    """

    name: str
    solvers: frozenset[str] = EVERY
    advice: str = ""
    which: Callable[[Array], Array] | None = None
    symmetric: bool | Callable[[Any, Array], bool] = False

    def mask(self, records: Array) -> Array:
        """Which records are of the kind: (n,) bool."""
        if self.which is None:
            return np.ones(records.size, dtype=bool)
        return np.asarray(self.which(records), dtype=bool)

    def is_symmetric(self, model: Any, records: Array) -> bool:
        """Whether the stiffness of those of the records that are of the kind is symmetric."""
        mask = self.mask(records)
        if not np.any(mask) or isinstance(self.symmetric, bool):
            return bool(self.symmetric) or not np.any(mask)
        return self.symmetric(model, records[mask])


@dataclasses.dataclass(frozen=True, eq=False)
class Family:
    """Records of one type in a model, and the answers to whatever solvers and results ask about them.

    Attributes
    ----------
    name : str, the field of the model
    record : dtype of a record (see `record`)
    order : float, place among the families: forces are added in this order
    results : fields that are results: name of the variable, unit and words
    kinds : what messages call its records, and which solvers support them; each record is of one kind
    of : str, family to which the records belong, whose part wrote them; supported where that is
    ends : function of a record and `Records` to what it acts on (`End`), for families that act between parts; the index
        of vectors is that in the state of the first velocity, of reduced bodies the modal coordinates are meant. A
        record with a field `outside` acts at times: it is 1 where an end of it is no free body
    through : whether its records act through those of others, whose ends theirs are
    couples : function of a record and `Records` to the groups of ends that are coupled with one another in the matrix
        of an implicit method; None where all ends of a record are
    within : whether it acts within one body: what holds its axis takes its torque across that, but nothing is tied
    outside : function of its records to those that act from outside, whatever their ends; None for none
    isolated : whether nothing but gravity and loads on beams, whose torque is known, acts from outside in a system with
        its records that tie nothing to other than free bodies: for all of them, or a function of them and `Records`;
        None stands for those with ends
    owner : function of `Records` and the index of a record to the family and the index of that whose part wrote it
    several : whether a part writes several records, named by the first of them
    consists : function of a record and its index to the bodies that it consists of, which have its name
    local : whether results of its records at a sample follow from the states at it and at the first one, without
        reactions
    changes : str, fields that a part writes and solvers alone read: a variant with other values of them and of
        parameters takes a copy of the model. None where more follows: then it is assembled whole
    reads_inertia : whether its parts or checks read the mass or inertia of others; None: as those of the family to
        which it belongs, else they do
    smooth : whether what it does to a motion changes continuously with a key, so that derivatives of a run go through
        it: for all of its records, or a function of them to a mask
    shares : shares of its parts in margins; None where their forces are not evaluated along a coordinate
    category : str, in margins, of the force of a part whose family has one share and says no more of it
    conserved : str, what a system with its records is called that takes the steps of energy-momentum, which gain no
        energy at any length; '' of one that need not
    implicit : function of its records to those that implicit methods suit better, and why; explicit : whether explicit
        methods keep its constraints as well
    adaptive : function of its records to why adaptive explicit steps suit them, '' where they do not; None where it
        does not matter
    stiff : function of its records to why implicit methods suit them at least as well, '' where they need not
    """

    name: str
    record: np.dtype
    order: float
    results: Mapping[str, tuple[str, str, str]] = dataclasses.field(default_factory=dict)
    kinds: tuple[Kind, ...] = ()
    of: str = ""
    ends: Callable[[Any, Records], Iterator[End]] | None = None
    through: bool = False
    couples: Callable[[Any, Records], Iterator[Iterable[End]]] | None = None
    within: bool = False
    outside: Callable[[Array], Array] | None = None
    isolated: bool | Callable[[Array, Records], bool] | None = None
    owner: Callable[[Records, int], tuple[str, int]] | None = None
    several: bool = False
    consists: Callable[[Any, int], range] | None = None
    local: bool = False
    changes: str | None = None
    reads_inertia: bool | None = None
    smooth: bool | Callable[[Array], Array] = False
    shares: Shares | None = None
    category: str = ""
    conserved: str = ""
    implicit: tuple[Callable[[Array], Array], str] | None = None
    explicit: bool = False
    adaptive: Callable[[Array], str] | None = None
    stiff: Callable[[Array], str] | None = None

    def may_be_isolated(self, found: Array, records: Records) -> bool:
        """Whether no record of it acts from outside but by its ends (see `isolated`)."""
        if self.isolated is None:
            return self.ends is not None or not found.size
        return self.isolated(found, records) if callable(self.isolated) else self.isolated or not found.size

    @property
    def in_margins(self) -> Shares | None:
        """Its shares in margins; None where parts of it are refused."""
        return Shares((Rule(self.category),)) if self.shares is None and self.category else self.shares

    def called(self, row: Array) -> str:
        """What messages call a record, given as one of (1,)."""
        found = next((kind.name for kind in self.kinds if kind.mask(row)[0]), "")
        return found or f"one of the {self.name.replace('_', ' ')}"

    def records(self, model: Any) -> Array:
        """Its records in a model."""
        found: Array = getattr(model, self.name)
        return found


def _modules() -> Iterator[Any]:
    """Modules that declare families: those of the package, then those of other distributions."""
    package = importlib.import_module(PACKAGE)
    for found in sorted(module.name for module in pkgutil.iter_modules(package.__path__)):
        yield importlib.import_module(f"{PACKAGE}.{found}")
    for entry in plugins.entry_points(GROUP):
        yield plugins.load(entry, f"the families of the entry point {entry.name!r}")


def _declared() -> Iterator[Family]:
    """Families of the package by their order, then those of other distributions."""
    for is_own in (True, False):
        found: dict[str, Family] = {}
        for module in _modules():
            if module.__name__.startswith(f"{PACKAGE}.") == is_own:
                found |= {value.name: value for value in vars(module).values() if isinstance(value, Family)}
        yield from sorted(found.values(), key=lambda family: (family.order, family.name))


@functools.cache
def families() -> dict[str, Family]:
    """All families, by name and in their order; families of other distributions come last.

    Raises
    ------
    InputError
        If a module of another distribution cannot be loaded.
    """
    return {family.name: family for family in _declared()}


def acting() -> list[Family]:
    """Families that act between parts, but those whose ends are those of another family."""
    every = families()
    found = [family for family in every.values() if family.ends is not None and not family.through]
    return [family for family in found if not family.of or every[family.of].ends is None]


def asked(question: str) -> dict[str, Any]:
    """Answers of the families that have one to a question, by name.

    Parameters
    ----------
    question : str, attribute of `Family`
    """
    found = ((name, getattr(family, question)) for name, family in families().items())
    return {name: answer for name, answer in found if answer is not None}
