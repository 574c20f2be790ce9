"""What a family of records is: the questions that solvers and results ask about the parts of a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.model.layout import Accounts, Events, Switches
from evolvent.model.questions import (
    AdjointSupport,
    Advice,
    Call,
    Contacts,
    Coupling,
    Drives,
    End as End,
    Energies,
    Explicit,
    Friction,
    Implicit,
    Inertia,
    Law,
    NodeEvents,
    Notes,
    Parts,
    Records as Records,
    Rows,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    Switching,
    Torques,
)
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
#: Words of the work of a load.
WORK = "work since the first sample, of the power interpolated between the samples times the load's course in time"
#: Field of a record that holds the least and largest values over all steps of some results (`Samples.extremes`), and
#: attribute of a variable of a run that holds them for each of its entries.
EXTREMES = "extremes"
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


def has_friction(found: Array) -> Array:
    """Which records have friction, (n,) bool, as `Friction.rubs`."""
    return np.asarray(found["friction"] > 0.0)


def has_parameters(found: Array, others: int) -> Array:
    """Whether loads have more than `others` parameters: (n,) bool."""
    return np.asarray(found["last"] - found["first"] > others)


def some(answer: Some, found: Array) -> bool:
    """Whether an answer is so for any of the records."""
    return bool(np.any(answer(found))) if callable(answer) else answer and found.size > 0


def every(answer: Some, found: Array) -> bool:
    """Whether an answer is so for all of the records."""
    return bool(np.all(answer(found))) if callable(answer) else answer or found.size == 0


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

    @property
    def reacts(self) -> bool:
        """Whether its records react to what is measured, by loops that runs close: no solver supports them alone."""
        return not self.solvers

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

    What a force between parts needs stands first. Further questions are in groups by who asks (see
    `evolvent.model.questions`); a group that is left out has no answers.

    Attributes
    ----------
    name : str, the field of the model
    record : dtype of a record (see `record`)
    order : float, place among the families: forces are added in this order
    results : fields that are results: name of the variable, unit and words
    kinds : what messages call its records, and which solvers support them; each record is of one kind
    of : str, family to which the records belong, whose part wrote them; supported where that is
    ends : function of a record and `Records` to what it acts on (`End`), for families that act between parts; the index
        of vectors is that in the state of the first velocity, of reduced bodies the modal coordinates are meant.
    outside : function of its records to those that act from outside, whatever their ends; None for none
    isolated : whether nothing but gravity and loads on beams, whose torque is known, acts from outside in a system with
        its records that tie nothing to other than free bodies: for all of them, or a function of them and `Records`;
        None stands for none of them
    concerned : questions that concern some of its records alone, such as "friction.until_turn", with functions of the
        records to a mask of these; a model without such does not call the answer
    force, tangent : functions of `evolvent.kernels.calls`: forces of its records in a state or over a step, and minus
        their derivatives
    energy, momentum : of a state
    accounts, switches, events : what its records have in the state, and what solvers find of them (`model.layout`)
    rows : rows of constraint; None for none
    laws : users' laws that records call
    times : fields that hold times at which a record starts or ceases to act, on which solvers land
    offsets : fields that hold indices of velocities in the state, -1 for none, which parts count from the first one
    category : str, in margins, of the force of a part whose family has one share and says no more of it
    shares : shares of its parts in margins; None where their forces are not evaluated along a coordinate
    smooth : whether what it does to a motion changes continuously with a key, so that derivatives of a run go through
        it: for all of its records, or a function of them to a mask
    stiff : whether a record resists a change of shape, but by a law
    of_step : whether forces belong to a step, and follow from what the step before has left, not from a state alone
    adjoint : why the adjoint supports it; None of one that it does not support
    observe : function of a view of a run (`results.observe.View`), the name of a part and its results
        (`results.observe.Observed`), which may be changed; before it these are the fields of the record in `results`
    and the groups of questions
    """

    name: str
    record: np.dtype
    order: float
    results: Mapping[str, tuple[str, str, str]] = dataclasses.field(default_factory=dict)
    kinds: tuple[Kind, ...] = ()
    of: str = ""
    ends: Callable[[Any, Records], Iterator[End]] | None = None
    outside: Callable[[Array], Array] | None = None
    isolated: bool | Callable[[Array, Records], bool] | None = None
    concerned: Mapping[str, Callable[[Array], Array]] = dataclasses.field(default_factory=dict)
    force: Call = None
    tangent: Call = None
    energy: Call = None
    momentum: Call = None
    accounts: tuple[Accounts, ...] = ()
    switches: tuple[Switches, ...] = ()
    events: tuple[Events, ...] = ()
    rows: Rows | None = None
    laws: tuple[Law, ...] = ()
    times: tuple[str, ...] = ()
    offsets: tuple[str, ...] = ("iv",)
    category: str = ""
    shares: Shares | None = None
    smooth: bool | Callable[[Array], Array] = False
    stiff: Some = True
    of_step: Some = True
    adjoint: AdjointSupport | None = None
    observe: Callable[[Any, str, Any], None] | None = None
    parts: Parts = dataclasses.field(default_factory=Parts)
    coupling: Coupling = dataclasses.field(default_factory=Coupling)
    state: State = dataclasses.field(default_factory=State)
    inertia: Inertia = dataclasses.field(default_factory=Inertia)
    torques: Torques = dataclasses.field(default_factory=Torques)
    friction: Friction = dataclasses.field(default_factory=Friction)
    contacts: Contacts = dataclasses.field(default_factory=Contacts)
    explicit: Explicit = dataclasses.field(default_factory=Explicit)
    stability: Stability = dataclasses.field(default_factory=Stability)
    implicit: Implicit = dataclasses.field(default_factory=Implicit)
    step: Step = dataclasses.field(default_factory=Step)
    switching: Switching = dataclasses.field(default_factory=Switching)
    node_events: NodeEvents = dataclasses.field(default_factory=NodeEvents)
    drives: Drives = dataclasses.field(default_factory=Drives)
    statics: Statics = dataclasses.field(default_factory=Statics)
    energies: Energies = dataclasses.field(default_factory=Energies)
    samples: Samples = dataclasses.field(default_factory=Samples)
    advice: Advice = dataclasses.field(default_factory=Advice)
    notes: Notes = dataclasses.field(default_factory=Notes)

    def may_be_isolated(self, found: Array, records: Records) -> bool:
        """Whether no record of it acts from outside but by its ends (see `isolated`)."""
        if callable(self.isolated):
            return self.isolated(found, records)
        return bool(self.isolated) or not found.size

    def is_by_rates(self, model: Any) -> bool:
        """Whether explicit methods find the fastest mode of its records in a model from the rates of that."""
        if not self.records(model).size:
            return False
        by_rates = self.stability.by_rates
        if by_rates is None:
            return self.force is not None
        return by_rates(model) if callable(by_rates) else by_rates

    @property
    def in_margins(self) -> Shares | None:
        """Its shares in margins; None where parts of it are refused."""
        return Shares((Rule(self.category),)) if self.shares is None and self.category else self.shares

    def called(self, row: Array) -> str:
        """What messages call a record, given as one of (1,)."""
        found = next((kind.name for kind in self.kinds if kind.mask(row)[0]), "")
        return found or f"one of the {self.name.replace('_', ' ')}"

    def masks_of_means(self) -> list[Callable[[Array], Array]]:
        """Functions of its records to masks of those that act as means over a step of energy-momentum."""
        return [law.which for law in self.laws if law.is_force] + ([] if self.step.means is None else [self.step.means])

    def records(self, model: Any) -> Array:
        """Its records in a model."""
        found: Array = getattr(model, self.name)
        return found
