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
from evolvent.base.errors import InputError
from evolvent.model.layout import Accounts, Events, Rows, Switches

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
    observe : function of a view of a run (`results.observe.View`), the name of a part and its results
        (`results.observe.Observed`), which may be changed; before it these are the fields of the record in `results`
    place : function of the builder and a reference (`assembly.references.Named`) to the point of a part that it names
        (`assembly.references.Location`), for families on whose parts there are points
    accounts, switches, events : what its records have in the state, and what solvers find of them (`model.layout`)
    rows : rows of constraint under explicit methods; None for none
    unmet : function of the name of a part, and of gap, rate and value of its row of the family `joints` and whether it
        moves at the start, to a sentence on why the start does not meet the constraint; '' where it does. None of
        parts that are no constraints of their own
    by_causes : whether the accounts of explicit methods tell apart what dissipates energy in a model with its records
    rubs : function of its records to those with friction that slips under explicit methods; None for none
    times : fields that hold times at which a record starts or ceases to act, on which solvers land
    totals : numbers of its records that are fields of the model's `info`, functions of the records by the field
    offsets : fields that hold indices of velocities in the state, -1 for none, which parts count from the first one
    initial : fields of the record with what its scratch fields are at the start, by these
    scratch : function of `Records` and the builder to arrays of the model that its records need, whether there are some
        or none; None for none
    heat : function of the builder, the name of a part and a thermal load on it; writes the constants of its elements
        among the parameters, and returns the fields of a record of `thermal_loads` that are its own; None where no
        thermal load acts
    check : function of the builder that refuses what its parts cannot be together with others; None for none
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
    observe: Callable[[Any, str, Any], None] | None = None
    place: Callable[[Any, Any], Any] | None = None
    accounts: tuple[Accounts, ...] = ()
    switches: tuple[Switches, ...] = ()
    events: tuple[Events, ...] = ()
    rows: Rows | None = None
    unmet: Callable[[str, float, float, float, bool], str] | None = None
    by_causes: bool = False
    rubs: Callable[[Array], Array] | None = None
    times: tuple[str, ...] = ()
    totals: Mapping[str, Callable[[Array], int]] = dataclasses.field(default_factory=dict)
    offsets: tuple[str, ...] = ("iv",)
    initial: Mapping[str, str] = dataclasses.field(default_factory=dict)
    scratch: Callable[[Records, Any], Mapping[str, Array]] | None = None
    heat: Callable[[Any, str, Any], dict[str, int]] | None = None
    check: Callable[[Any], None] | None = None

    def may_be_isolated(self, found: Array, records: Records) -> bool:
        """Whether no record of it acts from outside but by its ends (see `isolated`)."""
        if self.isolated is None:
            return self.ends is not None or not found.size
        return self.isolated(found, records) if callable(self.isolated) else self.isolated or not found.size

    def records(self, model: Any) -> Array:
        """Its records in a model."""
        found: Array = getattr(model, self.name)
        return found


@functools.cache
def _modules_and_failures() -> tuple[list[Any], dict[str, str]]:
    """Modules that declare families: those of the package, then those of other distributions; and why others do not."""
    package, wrong = importlib.import_module(PACKAGE), dict[str, str]()
    found = [importlib.import_module(f"{PACKAGE}.{one.name}") for one in pkgutil.iter_modules(package.__path__)]
    found.sort(key=lambda module: str(module.__name__))
    for entry in plugins.entry_points(GROUP):
        try:
            found.append(plugins.load(entry, f"the families of the entry point {entry.name!r}"))
        except InputError as error:
            wrong[entry.name] = str(error)
    return found, wrong


def modules() -> list[Any]:
    """Modules that declare families: those of the package, then those of other distributions that can be loaded."""
    return _modules_and_failures()[0]


def unusable() -> Mapping[str, str]:
    """Sentences on modules of other distributions that cannot be loaded, by the name of the entry point."""
    return _modules_and_failures()[1]


def _declared() -> Iterator[Family]:
    """Families of the package by their order, then those of other distributions."""
    for is_own in (True, False):
        found: dict[str, Family] = {}
        for module in modules():
            if module.__name__.startswith(f"{PACKAGE}.") == is_own:
                found |= {value.name: value for value in vars(module).values() if isinstance(value, Family)}
        yield from sorted(found.values(), key=lambda family: (family.order, family.name))


@functools.cache
def families() -> dict[str, Family]:
    """All families, by name and in their order; families of other distributions come last."""
    return {family.name: family for family in _declared()}


def acting() -> list[Family]:
    """Families that act between parts, but those whose ends are those of another family."""
    every = families()
    found = [family for family in every.values() if family.ends is not None and not family.through]
    return [family for family in found if not family.of or every[family.of].ends is None]


def events() -> list[tuple[Family, Events]]:
    """Events of all families, in the order of their numbers."""
    own = ((family, one) for family in families().values() for one in family.events)
    return sorted(own, key=lambda found: found[0].order if found[1].order is None else found[1].order)


def asked(question: str) -> dict[str, Any]:
    """Answers of the families that have one to a question, by name.

    Parameters
    ----------
    question : str, attribute of `Family`
    """
    found = ((name, getattr(family, question)) for name, family in families().items())
    return {name: answer for name, answer in found if answer is not None}
