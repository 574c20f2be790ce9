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
from evolvent.model.questions import (
    AdjointSupport,
    Bound,
    Coordinates,
    Felt,
    KeptFields,
    Law,
    LinearizedPoint,
    Records as Records,
)

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
#: For all records of a family, or a function of the records to a mask of those for which it is so.
Some = bool | Callable[[Array], Array]


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


def some(answer: Some, found: Array) -> bool:
    """Whether an answer is so for any of the records."""
    return bool(np.any(answer(found))) if callable(answer) else answer and found.size > 0


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
    laws : users' laws that records call
    means : function of its records to those that act over a step of energy-momentum as means of what is no user's law
        (`kernels.law_means`); None for none
    of_step : whether forces belong to a step, and follow from what the step before has left, not from a state alone
    stiff : whether a record resists a change of shape, but by a law
    adjoint : why the adjoint supports it; None of one that it does not support
    coordinates : of its records
    consists_of : function of a record to the bodies of which it consists; None where it does of none
    felt : how its records answer the stiffness and damping that they feel, for the bound of explicit steps
    bound : function of the model after `kinematics`, the state, and blocks of stiffness and damping that are felt, by
        family (2, n, size, size), to bounds of the fastest modes of its own; it adds to the blocks what its records
        make others feel. Where `stiff` records have none, the fastest mode is found by differences of accelerations
    uneven : function of a steady turn (`solvers.steady_turn.Turn`) and of the records with an end on what does not
        turn, of all without `ends`, to those that are not the same at every angle about its axis; None for all of them
    sizes : function of the model and its size, m, to indices of velocities in the state and what counts as 1 of their
        coordinates, but for positions, slopes and turns
    extents : function of its records to lengths, m, that count for the size of the system
    points : function of the assembly, the name and index of a part, its velocities and a state to its points, by name
    acts_on : function of the model, the index of a load, parameters of the model and a time to the family and index on
        which it acts then, if it does
    rubs : function of its records to those whose friction statics take by displacements
    at_rest : prepares the records of a model for statics, for which neither rates nor steps before count
    stand : lets what a drive moves stand where it is at a time
    end_ramps : lets the records of a model act as after their ramps
    forget : makes the records of a model forget the steps before
    settle : notes in a model the state at rest as that at the end of a step
    kept : fields of its records that are kept at samples
    bending : function of the model after its last forces and of the state to the strain energy of bending, J
    rubbed : function of its records to indices of the state, what friction has taken in an explicit run
    changes : function of its records to times, s, beside those of the model (`breaks`), at which forces change
    inner : function of its records to how many inner unknowns they need in the matrix of an implicit method
    presses : function of the model to a mask of its contacts that touch
    no_balance : function of the model after its last forces, the time and the state to records that are in no
        equilibrium in spite of their forces, and why, as the end of a sentence
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
    laws: tuple[Law, ...] = ()
    means: Callable[[Array], Array] | None = None
    of_step: Some = True
    stiff: Some = True
    adjoint: AdjointSupport | None = None
    coordinates: tuple[Coordinates, ...] = ()
    consists_of: Callable[[Any], range] | None = None
    felt: Felt | None = None
    bound: Callable[[Any, Array, Mapping[str, Array]], Iterator[Bound]] | None = None
    uneven: Callable[[Any, list[int]], Iterable[int]] | None = None
    sizes: Callable[[Any, float], Iterator[tuple[Any, Any]]] | None = None
    extents: Callable[[Array], Array] | None = None
    points: Callable[[Any, str, int, slice, Array], Iterator[tuple[str, LinearizedPoint]]] | None = None
    acts_on: Callable[[Any, int, Array, float], tuple[str, int] | None] | None = None
    rubs: Callable[[Array], Array] | None = None
    at_rest: Callable[[Any], None] | None = None
    stand: Callable[[Any, float], None] | None = None
    end_ramps: Callable[[Any], None] | None = None
    forget: Callable[[Any], None] | None = None
    settle: Callable[[Any, Array], None] | None = None
    kept: tuple[KeptFields, ...] = ()
    bending: Callable[[Any, Array], float] | None = None
    rubbed: Callable[[Array], Iterator[Array]] | None = None
    changes: Callable[[Array], Array] | None = None
    inner: Callable[[Array], int] | None = None
    presses: Callable[[Any], Array] | None = None
    no_balance: Callable[[Any, float, Array], Iterator[tuple[int, str]]] | None = None

    def may_be_isolated(self, found: Array, records: Records) -> bool:
        """Whether no record of it acts from outside but by its ends (see `isolated`)."""
        if self.isolated is None:
            return self.ends is not None or not found.size
        return self.isolated(found, records) if callable(self.isolated) else self.isolated or not found.size

    def masks_of_means(self) -> list[Callable[[Array], Array]]:
        """Functions of its records to masks of those that act as means over a step of energy-momentum."""
        return [law.which for law in self.laws if law.is_force] + ([] if self.means is None else [self.means])

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


def whole() -> Iterator[Family]:
    """Families of records that belong to no other family's."""
    return (family for family in families().values() if not family.of)


def acting() -> list[Family]:
    """Families that act between parts, but those whose ends are those of another family."""
    every = families()
    found = [family for family in every.values() if family.ends is not None and not family.through]
    return [family for family in found if not family.of or every[family.of].ends is None]


def forget_steps(model: Any) -> None:
    """Make all records of a model forget the steps before."""
    for forget in asked("forget").values():
        forget(model)


def asked(question: str) -> dict[str, Any]:
    """Answers of the families that have one to a question, by name.

    Parameters
    ----------
    question : str, attribute of `Family`
    """
    found = ((name, getattr(family, question)) for name, family in families().items())
    return {name: answer for name, answer in found if answer is not None}
