"""What a solver returns."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from evolvent import model as mdl
from evolvent.model.registry import asked, is_by_rates
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.observations import Observations, momenta_of, observe, sums_of
from evolvent.solvers.common.sampled import (
    Momentum,
    Sampled,
    angular_momentum,
    balances,
    by_field,
    empty,
    evaluate,
    momentum_of,
)
from evolvent.solvers.common.sizes import energy_floor, round_off_energy, sizes, strain_round_off
from evolvent.solvers.common.standing import stand_still

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly

Array = np.ndarray


def event_numbers(model: Any, logged: Array) -> Array:
    """Numbers among all events of a model (`Solution.event_kinds`) of those that the loop of an implicit run logs.

    Parameters
    ----------
    logged : (n,) int, k of those that a family finds itself, -1 - k of those that are watched, which stand before
    """
    first = int(model.event_firsts[0]) if model.event_firsts.size else 0
    return np.asarray(np.where(logged >= 0, first + model.watches.size + logged, first - 1 - logged))


#: Rows of `Path.newton`.
NEWTON = np.dtype([("step", np.int64), ("iteration", np.int64)]
                  + [(name, np.float64) for name in ("factor", "force", "moment", "correction")])  # fmt: skip


class Path(NamedTuple):
    """What a static solution has of its own.

    Attributes
    ----------
    factor : (nt,) float, load factors along the path
    loads : (nt, nv) float, N, generalised loads on beams, and weights
    spin : (6,) float, rad/s and m, rate and centre of the steady turn
    free : list of str, parts that move without any resistance at the end; the equilibrium is then one of many
    unstable : int
        In how many ways the end is unstable: directions in which the energy falls; under loads without a potential, or
        with gyroscopic forces, motions that grow, those of the linear motion with dampers. -1 where it is not known.
    newton : (n,) records `NEWTON`, how Newton's method converged
        Number of the load step (from 1), iteration (from 0), load factor, largest unbalanced force (N) and moment (N m,
        also of forces on slopes) before the iteration, and its largest correction, beside the size of the system (or 1
        for slopes and turns). The last row of a step has the unbalance that is left, and no correction.
    """

    factor: Array
    loads: Array
    spin: Array
    free: list[str]
    unstable: int
    newton: Any


class Capture(NamedTuple):
    """A capture: the part by its family and row, when it began (s), in what time it takes the motion (s), and how."""

    family: str
    row: int
    time: float
    duration: float
    what: str = "captures"


class Pending(Protocol):
    """Accelerations, multipliers and forces of samples, evaluated when they are first asked for."""

    def chosen(self, samples: Any) -> Pending:
        """Those of some of the samples: (k,) bool, or indices."""

    def evaluated(self) -> tuple[Array, Array, Array]:
        """Accelerations (k, nv), multipliers (k, nj) and forces (k, n) as `Sampled` holds them."""


@dataclasses.dataclass
class Solution:
    """What every solver returns; it prints nothing.

    Attributes
    ----------
    assembly : Assembly, what was solved; its model is the solver's own copy
    method : str, "rk4", "heun", "dopri5", "generalized-alpha" or "static"
    t : (nt,) float, s, times of the samples; of a static solution the time at which drives and loads stand
    y, s : (nt, ny) float and (nt, ns) int, states [q | v | accounts] and switches there; of threads with segments of
        fixed length explicit methods have directions and their rates, all others positions and velocities
    status : {"success", "stopped by event", "interrupted", "failed"}
    message : str, one sentence; for a failure: what, where, when, what to try
    statistics : dict of steps, rejected_steps, events, step (s), energy_moved (J), energy_defect (beside that; see
        `evolvent.solvers.common.balance`) and what else a method counts
    event_times, event_kinds : (ne,) float and int, s, and what each is: 2 p, a node or the whole of thread p is
        released; 2 p + 1, a node is taken up; then the events that the user has added, in their order; then those of
        other families, as `model.registry.event_of` reads them
    wall_time, compile_time : float, s
    kept : Sampled, what the method has kept at its samples; None of explicit methods
    path : Path, of a static solution; None of a motion
    reactions : Pending, what evaluates accelerations and reactions when they are first asked for; None where
        `kept` has them
    captures : Capture of each latch that has locked in an implicit run of fixed steps
    passages : of each spring that a motion has brought to length zero: the first time (s), and a sentence
    round_offs : energies of elements and weights that steps do not resolve, and round-off of energies and works of the
        run, J (`closure`); None where they are to be found
    measured : of each reel that reacts, by its name: variable -> times of the samples (s), values with noise, unit
    """

    assembly: Assembly
    method: str
    t: Array
    y: Array
    s: Array
    status: str
    message: str
    statistics: dict[str, float]
    event_times: Array
    event_kinds: Array
    wall_time: float
    compile_time: float
    kept: Sampled | None = None
    path: Path | None = None
    reactions: Pending | None = None
    captures: tuple[Capture, ...] = ()
    passages: tuple[tuple[float, str], ...] = ()
    round_offs: tuple[float, float] | None = None
    measured: Mapping[str, Mapping[str, tuple[Array, Array, str]]] = dataclasses.field(default_factory=dict)

    @property
    def success(self) -> bool:
        """Whether the run reached its end, or the event that was to stop it."""
        return self.status in ("success", "stopped by event")

    @functools.cached_property
    def model(self) -> mdl.Model:
        """What its states are evaluated with: of equilibria without a steady turn a model at rest."""
        found: mdl.Model = self.assembly.model
        if self.path is not None and self.t.size and not np.any(self.path.spin):
            found = found.copy()
            stand_still(found, float(self.t[0]))
        return found

    @functools.cached_property
    def observations(self) -> Observations:
        """Positions and tensions of threads, and motion of bodies, at the samples."""
        return observe(self.model, self.t, self.y, self.s, None if self.kept is None else self.kept.la)

    @functools.cached_property
    def sums(self) -> Array:
        """(nt, N_INVENTORY) energies and momenta at the samples (see `evolvent.equations.inventory`)."""
        if self.assembly.model.info.releases:
            return self.observations.inventory
        return sums_of(self.model, self.t, self.y, self.s)

    @functools.cached_property
    def sampled(self) -> Sampled:
        """Accelerations, multipliers, energy balance and forces at the samples."""
        if self.kept is not None and self.reactions is not None:
            acceleration, la, forces = self.reactions.evaluated()
            return self.kept._replace(acceleration=acceleration, la=la, forces=forces)
        if self.kept is not None:
            return self.kept
        return evaluate(self.assembly, self.t, self.y, self.s, self.sums)

    @property
    def acceleration(self) -> Array:
        """See `Sampled`."""
        return self.sampled.acceleration

    @property
    def la(self) -> Array:
        """See `Sampled`."""
        return self.sampled.la

    @functools.cached_property
    def balance(self) -> Any:
        """See `Sampled`."""
        model = self.assembly.model
        of_run = self.sampled if self.kept is None and self._is_split else self.kept
        found = of_run.balance if of_run is not None else balances(model, self.y, self.sums)
        for rebalance in asked("energies.rebalance").values():
            found = rebalance(model, self.t, self.y, 1.0 if self.path is None else self.path.factor, found)
        return found

    @property
    def _is_split(self) -> bool:
        """Whether energies of contacts and joints stand apart from the others."""
        return self.kept is not None or is_by_rates(self.assembly.model)

    @property
    def forces(self) -> dict[str, dict[str, Array]]:
        """Fields of records that are kept at the samples: see `sampled.by_field`."""
        return by_field(self.assembly.model, self.sampled.forces)

    @property
    def wrenches(self) -> Array:
        """(nt, nb, 6) all that acts on each body at its origin, N and N m: see `Sampled`."""
        return self.forces["bodies"]["F"]

    @property
    def energy(self) -> Array:
        """(nt,) kinetic and potential energy, J."""
        return np.asarray(eb.energy(self.balance))

    @property
    def energy_defect(self) -> Array:
        """(nt,) energy less that at the first sample, less work since, plus losses, J; below zero: numerical damping.

        NaN of a static solution, which has no work over time.
        """
        found = np.asarray(eb.defect(self.balance, 0.0))
        return found - found[:1]

    @property
    def energy_moved(self) -> Array:
        """(nt,) energy moved since the first sample, J, beside which the defect counts (`solvers.common.balance`)."""
        return eb.moved_over(self.balance)

    @functools.cached_property
    def closure(self) -> eb.Closure:
        """How well the energy balance closes, and whether the run fails or warns for it."""
        seen, damps = float(self.statistics.get("energy_moved", 0.0)), self.kept is not None
        unresolved, floor = self.round_offs or self._round_offs()
        return eb.closure(self.balance, moved=seen, unresolved=unresolved, damps=damps, floor=floor)

    def _round_offs(self) -> tuple[float, float]:
        """See `round_offs`."""
        unresolved = strain_round_off(self.assembly.model)
        if self.kept is not None and self.t.size:
            weight, mass = sizes(self.assembly)
            unresolved = energy_floor(self.assembly, mass, weight)
        return unresolved, round_off_energy(self.assembly, float(self.t[0])) if self.t.size else 0.0

    @functools.cached_property
    def momentum(self) -> Momentum:
        """Linear and angular momentum at the samples, and what events brought in."""
        model = self.assembly.model
        if self.kept is not None and self.kept.momenta is not None:
            return momentum_of(model, self.y, self.kept.momenta[:, :3], self.kept.momenta[:, 3:])
        if self.kept is not None and not model.info.releases:  # without the functions of explicit methods
            return momentum_of(model, self.y, *momenta_of(model, self.t, self.y))
        return momentum_of(model, self.y, self.sums[:, mdl.P_ALL : mdl.P_ALL + 3], angular_momentum(self.sums))

    def chosen(self, samples: Any) -> Solution:
        """The solution at some of its samples: (nt,) bool, or indices; `energy_defect` counts from the first one."""
        kept = None if self.kept is None else self.kept.chosen(samples)
        path = self.path
        if path is not None:
            path = path._replace(factor=path.factor[samples], loads=path.loads[samples])
        pending = None if self.reactions is None else self.reactions.chosen(samples)
        return dataclasses.replace(
            self, t=self.t[samples], y=self.y[samples], s=self.s[samples], kept=kept, path=path, reactions=pending
        )

    def or_start(self, t: float) -> Solution:
        """The solution; where it has no sample, its start at time t (s), and NaN for what was not computed there."""
        if self.t.size:
            return self
        kept = None
        if self.kept is not None:
            kept = empty(self.assembly.model, 1)
            for values in (kept.acceleration, kept.la, kept.forces):
                values[:] = np.nan
            for name in eb.BALANCE.names or ():
                kept.balance[name] = np.nan
        y, s = self.assembly.y[None].copy(), self.assembly.s[None].copy()
        return dataclasses.replace(self, t=np.array([t]), y=y, s=s, kept=kept, reactions=None)
