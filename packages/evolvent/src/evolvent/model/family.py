"""What a family of records is: the questions that solvers and results ask about the parts of a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.model.layout import Accounts, Events, Rows, Switches
from evolvent.model.questions import (
    AdjointSupport,
    Bound,
    Coordinates,
    Equations,
    Felt,
    Law,
    LinearizedPoint,
    Positions,
    Records as Records,
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
#: How fields are kept at samples, in the order in which they stand there (`Family.kept`).
CLEARED, BETWEEN, NEARER, SUMMED = range(4)
#: Words of the work of a load.
WORK = "work since the first sample, of the power interpolated between the samples times the load's course in time"
#: What a record acts on: ("bodies", index), ("reduced_bodies", index), ("vectors", index).
End = tuple[str, int]
#: An answer that is a compiled function, which walks over a model's families call (`evolvent.kernels.calls`).
Call = Any
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
    """Which records have friction, (n,) bool, as `Family.rubs`."""
    return np.asarray(found["friction"] > 0.0)


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
        of vectors is that in the state of the first velocity, of reduced bodies the modal coordinates are meant.
    at_times : whether its records act at times, which `equations.implicit.is_isolated` asks of their field `outside`, 1
        where an end is no free body. Records of other families count as acting at all times
    through : whether its records act through those of others, whose ends theirs are
    couples : function of a record and `Records` to the groups of ends that are coupled with one another in the matrix
        of an implicit method; None where all ends of a record are
    within : whether it acts within one body: what holds its axis takes its torque across that, but nothing is tied
    outside : function of its records to those that act from outside, whatever their ends; None for none
    isolated : whether nothing but gravity and loads on beams, whose torque is known, acts from outside in a system with
        its records that tie nothing to other than free bodies: for all of them, or a function of them and `Records`;
        None stands for none of them
    by_rates : whether explicit methods find its fastest mode from the rates of the whole model
        (`solvers.time.explicit.fastest_modes`), or a function of the model; None stands for those with a force. Those
        whose forces act on coordinates (`Model.F`, `Model.P`), not on bodies and points alone, are always among them
    force, tangent : functions of `evolvent.kernels.calls`: forces of its records in a state or over a step, and their
        derivatives; step_force, step_tangent over a step, where that is another function
    inertia, inertia_tangent, step_inertia, step_inertia_tangent : the same of masses, after all forces
    explicit_force : function of forces in a state of an explicit method, where it is another one; False for none
    explicit_rate : of rates of the coordinates of its own that no constraint holds, after all forces
    explicit_carried : of rates of what bodies carry, by the accelerations of these, and of what it does to those that
        are driven
    explicit_end : of what needs the accelerations of all
    measure : of what a step needs of its start and its end
    energy, momentum : of a state; explicit_energy of one of an explicit method, where forces were not evaluated
    owner : function of `Records` and the index of a record to the family and the index of that whose part wrote it
    several : whether a part writes several records, named by the first of them
    consists : function of a record and its index to the bodies that it consists of, which have its name
    frame : of forces on all masses, with a field `scale` each: function of a record to the rate of the frame that turns
        with it, (3,) float, rad/s, inertial axes; None of a law
    resists : fields with the length or angle of a record, and with its forces; None of what does not resist by these
    is_motion : whether its records are motions between parts, with an `angle` each, which have margins and latches
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
    short_steps : function of its records to why explicit steps are short with them, '' where they need not be
    observe : function of a view of a run (`results.observe.View`), the name of a part and its results
        (`results.observe.Observed`), which may be changed; before it these are the fields of the record in `results`
    place : function of the builder and a reference (`assembly.references.Named`) to the point of a part that it names
        (`assembly.references.Location`), for families on whose parts there are points
    accounts, switches, events : what its records have in the state, and what solvers find of them (`model.layout`)
    rows : rows of constraint (`model.layout.Rows`); None for none
    unmet : function of the name of a part, and of gap, rate and value of its row of constraint and whether it moves at
        the start, to a sentence on why the start does not meet the constraint; '' where it does. None of
        parts that are no constraints of their own
    by_causes : whether the accounts of explicit methods tell apart what dissipates energy in a model with its records
    rubs : function of its records to those with friction that slips under explicit methods; None for none
    times : fields that hold times at which a record starts or ceases to act, on which solvers land
    totals : numbers of its records that are added up in fields of the model's `info`, functions of the records by field
    offsets : fields that hold indices of velocities in the state, -1 for none, which parts count from the first one
    initial : fields of the record with what its scratch fields are at the start, by these
    scratch : function of `Records` and the builder to arrays of the model that its records need, whether there are some
        or none; None for none
    heat : function of the builder, the name of a part and a thermal load on it; writes the constants of its elements
        among the parameters, and returns the fields of a record of `thermal_loads` that are its own; None where no
        thermal load acts
    check : function of the builder that refuses what its parts cannot be together with others; None for none
    laws : users' laws that records call
    means : function of its records to those that act over a step of energy-momentum as means of what is no user's law
        (`kernels.law_means`); None for none
    of_step : whether forces belong to a step, and follow from what the step before has left, not from a state alone
    stiff : whether a record resists a change of shape, but by a law
    adjoint : why the adjoint supports it; None of one that it does not support
    unknowns : coordinates of its records
    felt : how its records answer the stiffness and damping that they feel, for the bound of explicit steps
    bound : function of the model after `kinematics`, the state, and blocks of stiffness and damping that are felt, by
        family (2, n, size, size), to bounds of the fastest modes of its own; it adds to the blocks what its records
        make others feel. Where `stiff` records have none, the fastest mode is found by differences of accelerations
    uneven : function of a steady turn (`solvers.static.steady_turn.Turn`) and of the records with an end on what does
        not turn, of all without `ends`, to those that are not the same at every angle about its axis; None for all of
        them
    start : of a run by implicit steps, before its first forces
    end_step : of a step that has been taken: what the next one needs of it, and into `Interval.powers` the work and the
        losses that the family books itself (J, `evolvent.model.powers`)
    note_step : of records alone, what the next step of energy-momentum needs of the last one
    longest_turn : longest step that its records allow at their last rates, s
    own_rates : (y, model, rates): rates of its coordinates that are part of the state y, after its step
    excess : (t, h, y, s, model): of a step of an explicit method to t, beside the longest that its records allow
    measure_state : (t, y, s, model): what its frictions move by, in a state, after `kinematics`
    take_step : (s, model): the last evaluation becomes the start of the next step; note_state : (t, y, s, model): a
        state does, whose forces have not been evaluated; note_stage : (t, starts, model): what is noted of the last
        evaluation in a step, or at the start of a run
    scale : (factor, parameters, model): loads at a load factor of statics, by their parameters at factor 1
    touches : function of the model to groups of ends that are coupled by what touches at present; is_layered : mask of
        the records by which that changes in a run
    ties : whether a record that acts at times now ties the system to what is not part of it, or acts from outside
    until_event : part of a step of a length, after one of another (s, 0 for none), whose rates are means over steps or
        not, at which its next event that is not watched falls, by its last evaluation; 1 for none
    reached : number of its first such event, from one on, that the last evaluation has reached; -1 for none
    change : (t, y, s, model): goes over to other laws where the last evaluation has ended some; returns what energy is
        lost, J, not a number where none has ended
    release : ends its records that wait for a trigger: (t, trigger, ends, y, s, model) as of `kernels.watches.release`;
        returns 1 where there are some
    row_measure, row_bend, row_force, row_tangent : of records with `rows`, one row each: its gap; second derivative of
        that without accelerations; generalised forces of its multiplier; gradient as row and column of the matrix, and
        the multiplier times the second derivatives by coordinates (`kernels.constraints`). row_end gives the row of the
        end of a step, row_rates what a change of place alone changes in the rate of the gap,
        row_note results at a sample, by the multiplier
    coupled_energy : at the end of a step of energy-momentum, of penalties and of what acts on coordinates, J
    contact_set : goes on with a number that encodes which records touch or slip, and in which sense
    change_values : values of its events by which records change, into those of all, in the order of `Events.order`; one
        fires where its value is not negative
    apply_change : carries out an event: 1 where the run is to stop there, 0, -1 where it cannot be carried out, 2 where
        it is another family's; the values of those that are carried out with it become infinite
    longest_step : until its records need the end of a step, s
    until_change : part of a step of implicit methods, (length, y at its start and its end, s), at which the first of
        its events falls; is_due : whether one is due in a state
    lock : masses of its records before impulses, after `kinematics`
    kick : velocities of its records jump, as impulses say
    project : brings the coordinates of its records back onto their constraints
    add_sums : energies and momenta of a state of an explicit method into the sums of `equations.inventory`, where
        `energy` and `momentum` do not have them
    note_part : of a sample between the ends of a step, (part, start, length), before its state is interpolated
    interpolate : moves in a state between those of the ends of a step, (part, y0, y1), what lies on lines of its own;
        between : the same of a sample, (part, start, length, y0, y1), where it needs the time as well
    apply : torques on coordinates at their last evaluation, (t, share, kept, y, s, model) as of
        `kernels.coordinate.add_applied`; returns energy (J), and the powers that it takes and gives (W);
        apply_tangent : its derivatives, between different coordinates or into `motor_slope` and `motor_damper` of each
    until_turn : part of a step at which a friction turns back (`kernels.turning`), asked of families some records of
        which rub, or without an answer to that; with measure_rates of the state at its end, keep_rates at the start of
        the next, and friction_power, of all frictions at the last evaluation
    end_friction : under explicit methods, frictions at the end of a step into the accounts; returns what they take, J
    turning : accelerations of a steady turn, but those of vectors in `Model.blocks` (`solvers.static.equilibrium`), and
        turning_tangent, derivatives of the forces by these accelerations
    evaluate : fields that are results, at a sample; by `force` where a family with results has no answer, False for
        none. Before that of all families prepare_sample, then evaluate_rates of what follows from the rates of explicit
        methods, which are evaluated for it; after it evaluate_last
    forget : function of a model whose records forget the steps before, as at the start of a run
    kept : fields that a run keeps at its samples, and how: `BETWEEN` (values at both ends of a step lie on a straight
        line), `CLEARED` (the same, of what `kinematics` clears), `NEARER` (of the nearer end), or `SUMMED` (since the
        start); keeps : function of `Records` to whether they are kept; keep : what fills them after forces
    sizes : function of the model and its size, m, to indices of velocities in the state and what counts as 1 of their
        coordinates, but for positions, slopes and turns
    extents : function of its records to lengths, m, that count for the size of the system
    points : function of the assembly, the name and index of a part, its velocities and a state to its points, by name
    acts_on : function of the model, the index of a load, parameters of the model and a time to the family and index on
        which it acts then, if it does
    static_friction : function of its records to those whose friction statics take by displacements
    at_rest : prepares the records of a model for statics, for which neither rates nor steps before count
    stand : lets what a drive moves stand where it is at a time
    end_ramps : lets the records of a model act as after their ramps
    settle : notes in a model the state at rest as that at the end of a step
    bending : function of the model after its last forces and of the state to the strain energy of bending, J
    rubbed : function of its records to indices of the state, what friction has taken in an explicit run
    stops : function of the model and of the start and the end of a run to times, s, beside those of the model
        (`breaks`), at which forces change or events fall due
    check_run : function of the assembly and of times over a run up to its end, s, which refuses drives that leave what
        its parts have
    freeze : function of the model and a time to the model in which what its drives change the length of has that of the
        time
    place_at : function of the assembly, a time, the state, the switches and whether the state is given, which sets in
        them for statics what follows from the drives then; nodes of a given state stay where they are
    positions : function of the model to what differs (`Positions`) in one with positions as coordinates, as implicit
        methods have; None where nothing does
    hold : function of a time, the state, the switches and the model, in which constraints hold as they do then
    multipliers : function of the right-hand side of explicit methods, the assembly and times, states, switches and
        multipliers of samples, of which it writes those that follow from a state, not from a step
    releases : function of the assembly and `Equations` to what carries out events by which the number of its moving
        nodes changes between the steps of implicit methods; see `families.threads.releases.Releases`
    captures : function of a solution to events of its records that bring something to rest: record, time and duration,
        s, and what the record does
    rebalance : function of the model, times, states, load factors and energy balances to these as they are with what
        solvers leave out of energies
    hint : function of the model and a state to records that may be why a run fails, and a half sentence on each, in
        which `{name}` stands for the part
    limits : function of a solution to sentences on where its states leave the range in which its records hold
    calls : functions that call others by slots in its records, with the fields of these
    warn : function of a solution to sentences on what its records do in it that they are not meant to
    reacts : function of its records to those that react to what is measured, by loops that runs close
    directions : function of the model to first indices of coordinates that are directions, whose length stays
    flows : function of the model to indices of velocities of what material flows through at rest
    nodal : function of a record to the shape of its velocities by nodes: their number, then of one node's
    unsteady : function of the model, and whether it is in an orbital frame, to records that do not support that, or a
        steady turn, and a sentence on each, in which `{name}` stands for the part
    taut : function of its records to those so stiff that little lengths are large forces
    waves : function of its records, along which waves run far faster than the motion, to the part of the longest stable
        explicit step that is short enough, at most that of the method
    axes : function of the model to ranges of the bodies that are nodes along an axis, whose slope their turns follow
        but for shear, part by part
    strained : function of the model to energies of which its strain energy is the difference, J
    round_off : function of the model to the energy whose round-off steps do not resolve, J
    inner : function of its records to how many inner unknowns they need in the matrix of an implicit method
    presses : function of the model to a mask of its contacts that touch
    no_balance : function of the model after its last forces, the time and the state to records that are in no
        equilibrium in spite of their forces, and why, as the end of a sentence
    not_at_rest : function of the model after its first forces to records whose rate changes in statics, and why, as the
        end of a sentence
    stiffest : makes the records of a model as stiff as they can become, for the fastest mode by rates; what `bound`
        counts, or `solvers.time.explicit.fastest_modes` adds, has no stiffness then
    paid_out : function of the model, and of a function of a record to the largest rate of its drive in a run, to the
        kinetic energy of what drives pay out, J
    jumps : function of its records to contacts whose force jumps at the touch
    passages : function of the model to records whose force has lost its direction in a run: time, s, and what happened
    without_normal : function of its records to contacts without a normal at the start of a step
    relax_over : lets statics of a model have the stiffness after a time, s, over which strains are held, from the last
        state that was accepted: 0 for that at once, infinity for that after all relaxation
    resume : function of the model at rest, after its last forces, and of the state: its records go on from what the
        state has kept of their strains
    softened : function of the model at rest, after its last forces, to relaxation times, s, and parts of the stiffness
        that relaxes with them, which tangents lack while it stands at them; stresses stay
    sets : function of the model and the index of a viscoelastic record to what deformation it keeps just after all
        stress is released at once: words, largest value, unit
    """

    name: str
    record: np.dtype
    order: float
    results: Mapping[str, tuple[str, str, str]] = dataclasses.field(default_factory=dict)
    kinds: tuple[Kind, ...] = ()
    of: str = ""
    ends: Callable[[Any, Records], Iterator[End]] | None = None
    at_times: bool = False
    through: bool = False
    couples: Callable[[Any, Records], Iterator[Iterable[End]]] | None = None
    within: bool = False
    outside: Callable[[Array], Array] | None = None
    isolated: bool | Callable[[Array, Records], bool] | None = None
    owner: Callable[[Records, int], tuple[str, int]] | None = None
    several: bool = False
    consists: Callable[[Any, int], range] | None = None
    frame: Callable[[Any], Array | None] | None = None
    resists: tuple[str, ...] | None = None
    is_motion: bool = False
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
    short_steps: Callable[[Array], str] | None = None
    by_rates: bool | Callable[[Any], bool] | None = None
    force: Call = None
    step_force: Call = None
    inertia: Call = None
    step_inertia: Call = None
    tangent: Call = None
    step_tangent: Call = None
    inertia_tangent: Call = None
    step_inertia_tangent: Call = None
    explicit_force: Call = None
    explicit_rate: Call = None
    explicit_end: Call = None
    measure: Call = None
    energy: Call = None
    explicit_energy: Call = None
    momentum: Call = None
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
    laws: tuple[Law, ...] = ()
    means: Callable[[Array], Array] | None = None
    of_step: Some = True
    stiff: Some = True
    adjoint: AdjointSupport | None = None
    unknowns: tuple[Coordinates, ...] = ()
    felt: Felt | None = None
    bound: Callable[[Any, Array, Mapping[str, Array]], Iterator[Bound]] | None = None
    uneven: Callable[[Any, list[int]], Iterable[int]] | None = None
    start: Call = None
    end_step: Call = None
    note_step: Call = None
    coupled_energy: Call = None
    release: Call = None
    longest_turn: Call = None
    excess: Call = None
    own_rates: Call = None
    take_step: Call = None
    measure_state: Call = None
    note_state: Call = None
    note_stage: Call = None
    scale: Call = None
    ties: Call = None
    until_event: Call = None
    reached: Call = None
    change: Call = None
    row_measure: Call = None
    row_bend: Call = None
    row_force: Call = None
    row_tangent: Call = None
    row_end: Call = None
    row_rates: Call = None
    row_note: Call = None
    contact_set: Call = None
    apply: Call = None
    apply_tangent: Call = None
    until_turn: Call = None
    measure_rates: Call = None
    keep_rates: Call = None
    friction_power: Call = None
    end_friction: Call = None
    change_values: Call = None
    apply_change: Call = None
    longest_step: Call = None
    until_change: Call = None
    is_due: Call = None
    lock: Call = None
    kick: Call = None
    project: Call = None
    add_sums: Call = None
    note_part: Call = None
    interpolate: Call = None
    between: Call = None
    turning: Call = None
    turning_tangent: Call = None
    prepare_sample: Call = None
    evaluate_rates: Call = None
    evaluate: Call = None
    evaluate_last: Call = None
    keep: Call = None
    explicit_carried: Call = None
    forget: Callable[[Any], None] | None = None
    kept: Mapping[str, int] = dataclasses.field(default_factory=dict)
    keeps: Callable[[Records], bool] | None = None
    sizes: Callable[[Any, float], Iterator[tuple[Any, Any]]] | None = None
    extents: Callable[[Array], Array] | None = None
    points: Callable[[Any, str, int, slice, Array], Iterator[tuple[str, LinearizedPoint]]] | None = None
    acts_on: Callable[[Any, int, Array, float], tuple[str, int] | None] | None = None
    static_friction: Callable[[Array], Array] | None = None
    at_rest: Callable[[Any], None] | None = None
    stand: Callable[[Any, float], None] | None = None
    end_ramps: Callable[[Any], None] | None = None
    settle: Callable[[Any, Array], None] | None = None
    bending: Callable[[Any, Array], float] | None = None
    rubbed: Callable[[Array], Iterator[Array]] | None = None
    stops: Callable[[Any, float, float], Array] | None = None
    check_run: Callable[[Any, Array], None] | None = None
    freeze: Callable[[Any, float], Any] | None = None
    place_at: Callable[[Any, float, Array, Array, bool], None] | None = None
    positions: Callable[[Any], Positions | None] | None = None
    hold: Callable[[float, Array, Array, Any], None] | None = None
    multipliers: Callable[..., None] | None = None
    releases: Callable[[Any, Equations], Any] | None = None
    captures: Callable[[Any], Iterator[tuple[int, float, float, str]]] | None = None
    rebalance: Callable[[Any, Array, Array, Any, Any], Any] | None = None
    hint: Callable[[Any, Array], Iterator[tuple[int, str]]] | None = None
    limits: Callable[[Any], Iterator[str]] | None = None
    calls: Mapping[Any, str] | None = None
    warn: Callable[[Any], Iterator[str]] | None = None
    reacts: Callable[[Array], Array] | None = None
    directions: Callable[[Any], Array] | None = None
    flows: Callable[[Any], Array] | None = None
    nodal: Callable[[Any], tuple[int, ...]] | None = None
    unsteady: Callable[[Any, bool], Iterator[tuple[int, str]]] | None = None
    taut: Callable[[Array], Array] | None = None
    waves: Callable[[Array], float] | None = None
    axes: Callable[[Any], Iterator[range]] | None = None
    strained: Callable[[Any], float] | None = None
    round_off: Callable[[Any], float] | None = None
    inner: Callable[[Array], int] | None = None
    touches: Callable[[Any], Iterator[Iterable[End]]] | None = None
    is_layered: Callable[[Array], Array] | None = None
    presses: Callable[[Any], Array] | None = None
    no_balance: Callable[[Any, float, Array], Iterator[tuple[int, str]]] | None = None
    not_at_rest: Callable[[Any], Iterator[tuple[int, str]]] | None = None
    stiffest: Callable[[Any], None] | None = None
    paid_out: Callable[[Any, Callable[[Any], float]], float] | None = None
    jumps: Callable[[Array], Array] | None = None
    passages: Callable[[Any], Iterator[tuple[int, float, str]]] | None = None
    without_normal: Callable[[Array], Array] | None = None
    relax_over: Callable[[Any, float], None] | None = None
    resume: Callable[[Any, Array], None] | None = None
    softened: Callable[[Any], Iterator[tuple[float, float]]] | None = None
    sets: Callable[[Any, int], Iterator[tuple[str, float, str]]] | None = None

    def may_be_isolated(self, found: Array, records: Records) -> bool:
        """Whether no record of it acts from outside but by its ends (see `isolated`)."""
        if callable(self.isolated):
            return self.isolated(found, records)
        return bool(self.isolated) or not found.size

    def is_by_rates(self, model: Any) -> bool:
        """Whether explicit methods find the fastest mode of its records in a model from the rates of that."""
        if not self.records(model).size:
            return False
        if self.by_rates is None:
            return self.force is not None
        return self.by_rates(model) if callable(self.by_rates) else self.by_rates

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
        return [law.which for law in self.laws if law.is_force] + ([] if self.means is None else [self.means])

    def records(self, model: Any) -> Array:
        """Its records in a model."""
        found: Array = getattr(model, self.name)
        return found
